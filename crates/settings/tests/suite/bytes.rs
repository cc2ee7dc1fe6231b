//! Stored settings come back as they were.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};
use quadrant_settings::{PlanSettings, StageSettings};

use quadrant_test_support::with_x;

fn plan() -> PlanSettings {
    PlanSettings {
        motions: [
            MotionSettings::Hold,
            MotionSettings::Harmonic(HarmonicSettings::with_velocity(30.0, 10.0, 2.0, 0.5)),
            MotionSettings::PointToPoint(PointToPointSettings {
                distance_mm: -3.0,
                max_velocity_mm_s: 100.0,
                max_acceleration_mm_s2: 1000.0,
                max_jerk_mm_s3: 1e5,
            }),
        ],
    }
}

fn stages() -> [StageSettings; 2] {
    let bare = with_x(|axis| {
        axis.plant = None;
        axis.feedback.law = LawKind::Pid;
        axis.feedback.nonlinear = None;
        axis.feedback.nctf = None;
        axis.amplifier.reversed = true;
    });
    [StageSettings::simulated(), bare]
}

#[test]
fn settings_round_trip_through_postcard() {
    let mut room = [0; 4096];
    for stage in stages() {
        let bytes = postcard::to_slice(&stage, &mut room).expect("fits");
        assert_eq!(postcard::from_bytes::<StageSettings>(bytes), Ok(stage));
    }
    let bytes = postcard::to_slice(&plan(), &mut room).expect("fits");
    assert_eq!(postcard::from_bytes::<PlanSettings>(bytes), Ok(plan()));
}

#[test]
fn settings_round_trip_through_text() {
    for stage in stages() {
        let text = serde_json::to_string(&stage).expect("plain data");
        let back: StageSettings = serde_json::from_str(&text).expect("its own text");
        assert_eq!(back, stage);
    }
    let text = serde_json::to_string(&plan()).expect("plain data");
    let back: PlanSettings = serde_json::from_str(&text).expect("its own text");
    assert_eq!(back, plan());
}

#[test]
fn a_misspelt_field_is_refused_wherever_it_stands() {
    fn objects(value: &serde_json::Value, path: &str, found: &mut Vec<String>) {
        match value {
            serde_json::Value::Object(fields) => {
                found.push(path.to_owned());
                for (name, value) in fields {
                    objects(value, &format!("{path}/{name}"), found);
                }
            }
            serde_json::Value::Array(items) => {
                for (index, value) in items.iter().enumerate() {
                    objects(value, &format!("{path}/{index}"), found);
                }
            }
            _ => {}
        }
    }
    let tree = serde_json::to_value(StageSettings::simulated()).expect("plain data");
    let mut found = vec![];
    objects(&tree, "", &mut found);
    assert!(found.len() > 30, "{found:?}");
    for path in found {
        let mut tree = tree.clone();
        let object = tree.pointer_mut(&path).and_then(|v| v.as_object_mut());
        object
            .expect("an object")
            .insert("misspelt".into(), 1.0.into());
        let result = serde_json::from_value::<StageSettings>(tree);
        assert!(
            result.is_err(),
            "a misspelt field below {path:?} passes unnoticed"
        );
    }
}
