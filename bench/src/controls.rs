//! The settings that the page offers to turn: of the law in force, of the feedforward, and of the friction that both use.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_settings::StageSettings;
use quadrant_settings::leaves::{LeafInfo, Range, all};
use serde::Serialize;
use serde_json::Value;

/// Range of a slider over its value at rest, either way.
const SPAN: f64 = 4.0;
/// Largest range of a pure number that a slider covers whole.
const WHOLE: f64 = 10.0;

/// A choice of several names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// Name in settings.
    pub name: String,
    /// Name on the page.
    pub label: &'static str,
}

/// A number.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Number {
    /// Path of the setting.
    pub path: String,
    /// Name below its axis.
    pub field: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Ends of a slider; none of a number that is zero and has no scale.
    pub slider: Option<[f64; 2]>,
    /// Value.
    pub value: f64,
    /// Meaning, in one sentence.
    pub meaning: &'static str,
}

/// Everything that the page offers for an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Controls {
    /// Feedback laws that the axis has parameters of.
    pub laws: Vec<Choice>,
    /// The one in force.
    pub law: LawKind,
    /// Feedforwards that the axis has parameters of.
    pub feedforwards: Vec<Choice>,
    /// The one that acts.
    pub feedforward: FeedforwardKind,
    /// Numbers of the law in force.
    pub feedback: Vec<Number>,
    /// Numbers of the feedforward.
    pub shares: Vec<Number>,
    /// Friction in the law's settings.
    pub friction: Vec<Number>,
}

/// Prefixes of the settings that a law reads.
fn prefixes(law: LawKind) -> &'static [&'static str] {
    match law {
        LawKind::Pd | LawKind::Pid | LawKind::Scheduled => &["feedback.pid."],
        LawKind::NPid => &["feedback.pid.", "feedback.nonlinear."],
        LawKind::Cascade => &["feedback.cascade.", "feedback.pid.derivative_filter_s"],
        LawKind::SlidingMode => &["feedback.sliding_mode.", "feedback.pid.derivative_filter_s"],
        LawKind::Nctf => &["feedback.nctf.", "feedback.pid.derivative_filter_s"],
    }
}

/// Ends of a slider for a number of a range.
fn slider(value: f64, [least, most]: [f64; 2], unit: &str) -> Option<[f64; 2]> {
    if unit.is_empty() && most - least <= WHOLE {
        return Some([least, most]);
    }
    let [low, high] = [value / SPAN, value * SPAN];
    (value > 0.0).then(|| [low.max(least), high.min(most)])
}

fn number(settings: &StageSettings, axis: usize, leaf: &LeafInfo) -> Option<Number> {
    let Range::Number(least, most) = leaf.range else {
        return None;
    };
    let path = leaf.path().as_str().replacen('*', &axis.to_string(), 1);
    let mut buffer = [0; 64];
    let length = settings.get_json(&path, &mut buffer).ok()?;
    let value: Value = serde_json::from_slice(&buffer[..length]).ok()?;
    let value = value.as_f64()?;
    let range = [least, most].map(|bound| bound.value(settings, axis));
    Some(Number {
        slider: slider(value, range, leaf.unit),
        path,
        field: leaf.field,
        unit: leaf.unit,
        range,
        value,
        meaning: leaf.meaning,
    })
}

impl Controls {
    /// The controls of an axis, 0 to 2.
    pub fn of(settings: &StageSettings, axis: usize) -> Self {
        let feedback = &settings.axes[axis].feedback;
        let friction = &settings.axes[axis].friction;
        let below = |prefixes: &[&str]| {
            all()
                .filter(|leaf| prefixes.iter().any(|start| leaf.field.starts_with(start)))
                .filter_map(|leaf| number(settings, axis, leaf))
                .collect()
        };
        let has_law = |law: &LawKind| match law {
            LawKind::Pd | LawKind::Pid => true,
            LawKind::NPid => feedback.nonlinear.is_some(),
            LawKind::Scheduled => feedback.schedule.is_some(),
            LawKind::Cascade => feedback.cascade.is_some(),
            LawKind::SlidingMode => feedback.sliding_mode.is_some(),
            LawKind::Nctf => feedback.nctf.is_some(),
        };
        let has_model = |kind: &FeedforwardKind| match kind {
            FeedforwardKind::Dahl => friction.dahl.is_some(),
            FeedforwardKind::Lugre => friction.lugre.is_some(),
            _ => true,
        };
        Self {
            laws: LawKind::ALL
                .iter()
                .filter(|law| has_law(law))
                .map(|law| Choice {
                    name: law.as_ref().to_owned(),
                    label: law.name(),
                })
                .collect(),
            law: feedback.law,
            feedforwards: FeedforwardKind::ALL
                .iter()
                .filter(|kind| has_model(kind))
                .map(|kind| Choice {
                    name: kind.as_ref().to_owned(),
                    label: kind.name(),
                })
                .collect(),
            feedforward: settings.axes[axis].feedforward.kind,
            feedback: below(prefixes(feedback.law)),
            shares: below(&["feedforward."]),
            friction: below(&["friction.sliding."]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_s_own_numbers_are_offered_with_unit_range_and_value() {
        let settings = StageSettings::simulated();
        let controls = Controls::of(&settings, 1);
        assert_eq!(controls.law, LawKind::NPid);
        let kp = &controls.feedback[0];
        assert_eq!(kp.path, "/axes/1/feedback/pid/kp_v_per_mm");
        assert_eq!((kp.unit, kp.value), ("V/mm", 1.31));
        let fields: Vec<_> = controls.feedback.iter().map(|of| of.field).collect();
        assert!(
            fields.contains(&"feedback.nonlinear.rate_per_mm"),
            "{fields:?}"
        );
        assert!(
            !fields
                .iter()
                .any(|field| field.starts_with("feedback.cascade"))
        );
    }

    #[test]
    fn sliders_stay_within_the_range_and_around_the_value() {
        assert_eq!(slider(1.0, [0.0, 2.0], ""), Some([0.0, 2.0]));
        assert_eq!(slider(1.0, [0.5, 100.0], "V"), Some([0.5, 4.0]));
        assert_eq!(slider(0.0, [0.0, 100.0], "V"), None);
    }
}
