//! Part programs: their geometry, the limits of their motion, and `quadrant replay --gcode` from end to end.

use std::f64::consts::TAU;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use quadrant::settings::StageSettings;
use quadrant_sim::gcode::{Limits, Program, ProgramError, Trajectory, Vector};

fn limits() -> Limits {
    Limits::of(&StageSettings::simulated())
}

fn plan(source: &str) -> Trajectory {
    Trajectory::plan(&Program::parse(source).unwrap(), &limits()).unwrap()
}

fn points(trajectory: &Trajectory) -> Vec<Vector> {
    let places = trajectory.places(limits().rate_hz);
    places.map(|place| trajectory.point(&place)).collect()
}

fn sample(name: &str) -> String {
    let path = format!("{}/data/{name}.ngc", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

/// The error of a program that is refused, as a person reads it.
fn refusal(source: &str) -> String {
    match Program::parse(source).and_then(|program| Trajectory::plan(&program, &limits())) {
        Ok(_) => panic!("{source:?} is accepted"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn arcs_keep_their_radius_in_every_plane_and_in_both_senses() {
    for (plane, ends, offsets, [first, second]) in [
        ("G17", "X0 Y0", "I-20 J0", [0, 1]),
        ("G18", "Z0 X0", "K-20 I0", [2, 0]),
        ("G19", "Y0 Z0", "J-20 K0", [1, 2]),
    ] {
        for (code, up) in [("G2", -1.0), ("G3", 1.0)] {
            let trajectory = plan(&format!("{plane}\n{code} {ends} {offsets} F1200"));
            let points = points(&trajectory);
            for point in &points {
                let radius = (point[first] + 20.0).hypot(point[second]);
                assert!((radius - 20.0).abs() < 1e-9, "{plane} {code}: {radius}");
                assert!(point[3 - first - second].abs() < 1e-12);
            }
            // Counter-clockwise: the second axis rises first.
            let early = points[points.len() / 10][second];
            assert!(early * up > 1.0, "{plane} {code}: {early}");
            assert!((trajectory.length_mm() - 20.0 * TAU).abs() < 1e-9);
        }
    }
}

#[test]
fn centres_may_be_absolute_and_lengths_in_inches() {
    let relative = plan("G21 G0 X10\nG3 X-10 I-10 F600");
    for other in [
        "G90.1 G0 X10\nG3 X-10 I0 J0 F600",
        "G91 G0 X10\nG90 G3 X-10 I-10 F600",
        "G0 X10\nG3 X-10 R10 F600",
        "g20 g0 x.393700787401575\ng3 x-.393700787401575 i-.393700787401575 f23.6220472440945",
    ] {
        let other = plan(other);
        assert!((other.length_mm() - relative.length_mm()).abs() < 1e-9);
        assert!((other.duration_s() - relative.duration_s()).abs() < 1e-9);
    }
}

#[test]
fn the_feed_is_held_through_tangent_joints_and_on_arcs() {
    let trajectory = plan(&sample("rounded-square"));
    let first_cut = 1;
    let last_cut = trajectory.moves().len() - 2;
    for place in trajectory.places(limits().rate_hz) {
        if (first_cut + 1..last_cut).contains(&place.index) {
            assert!((place.speed_mm_s - 25.0).abs() < 1e-6, "{place:?}");
        }
    }
}

#[test]
fn a_small_arc_is_run_as_fast_as_its_axes_can_turn() {
    let trajectory = plan("G1 X10 F6000\nG3 X10 Y0.4 R0.2\nG1 X0");
    let on_arc = trajectory
        .places(limits().rate_hz)
        .filter(|place| place.index == 1)
        .map(|place| place.speed_mm_s)
        .fold(0.0, f64::max);
    // v^2 / r at most 2000 mm/s^2 means 20 mm/s; a part is kept for changes of speed.
    assert!((15.0..20.0).contains(&on_arc), "{on_arc}");
}

#[test]
fn a_corner_is_stopped_at_or_rounded_by_the_deviation_allowed() {
    let program = Program::parse("G1 X20 F3000\nY20").unwrap();
    let corner = Vector::new(20.0, 0.0, 0.0);
    let closest = |corner_deviation_mm| {
        let limits = Limits {
            corner_deviation_mm,
            ..limits()
        };
        let trajectory = Trajectory::plan(&program, &limits).unwrap();
        let near = trajectory.places(limits.rate_hz).map(|place| {
            let distance = (trajectory.point(&place) - corner).norm();
            (distance, place.speed_mm_s)
        });
        near.fold(
            (f64::MAX, 0.0),
            |best, one| if one.0 < best.0 { one } else { best },
        )
    };
    let (distance, speed) = closest(0.0);
    assert!(
        distance < 1e-6 && speed < 0.1,
        "{distance} mm at {speed} mm/s"
    );
    let (distance, speed) = closest(0.02);
    assert!(
        (distance - 0.02).abs() < 1e-4 && speed > 5.0,
        "{distance} mm at {speed} mm/s"
    );
}

#[test]
fn refusals_name_line_word_and_limit() {
    for (source, parts) in [
        ("G1 X10", &["line 1", "G1", "no feed"][..]),
        ("F100\nX10", &["line 2", "X10", "G0, G1"]),
        ("G1 X10 F100\nG41 X5", &["line 2", "G41", "not supported"]),
        ("G1 X10 F100 P3", &["line 1", "P3"]),
        ("G1 X10 X11 F100", &["line 1", "X11", "X10"]),
        ("G1 G2 X10 F100", &["line 1", "G2", "G1"]),
        ("G1 X10 I5 F100", &["line 1", "I5", "G1"]),
        ("G1 X1 F0", &["line 1", "F0", "0.001"]),
        ("G2 X10 F100", &["line 1", "no centre"]),
        ("G2 X10 R4 F100", &["line 1", "4.0000 mm", "10.0000 mm"]),
        ("G2 X0 R4 F100", &["line 1", "full circle"]),
        ("G2 X10 I5 R5 F100", &["line 1", "R5"]),
        ("G2 X10 I5 K1 F100", &["line 1", "K1", "G18"]),
        (
            "G21\nG3 X10 I5.1 F100",
            &["line 2", "5.1000", "4.9000", "0.0050"],
        ),
        ("G0 X200.1", &["line 1", "x to 200.100 mm", "-200 to 200"]),
        ("G3 X0 Y0 I150 F100", &["line 1", "x to 300.000"]),
        ("G1 X100 F1", &["6000 s", "600 s"]),
        ("(nothing)\nM2\nG0 X1", &["no move"]),
    ] {
        let text = refusal(source);
        for part in parts {
            assert!(text.contains(part), "{source:?}: {text:?} lacks {part:?}");
        }
    }
    let limits = Limits {
        path_jerk_mm_s3: f64::NAN,
        ..limits()
    };
    let program = Program::parse("G0 X1").unwrap();
    let refused = Trajectory::plan(&program, &limits).unwrap_err();
    assert!(matches!(refused, ProgramError::Limit { .. }));
}

#[test]
fn what_the_stage_does_not_have_is_noted_and_the_end_ends() {
    let program = Program::parse("M3 S1000\nG0 X1\nM30").unwrap();
    let ignored: Vec<&str> = program
        .ignored
        .iter()
        .map(|(_, word)| word.as_str())
        .collect();
    assert_eq!(ignored, ["M3", "S1000"]);
    assert_eq!(Program::parse("G0 X1\nM2\nX5").unwrap().moves.len(), 1);
}

#[test]
fn the_deviation_from_the_path_is_measured_across_it() {
    let trajectory = plan("G1 X20 F600\nG3 X20 Y20 R10\nG1 X0");
    for place in trajectory.places(200.0) {
        let segment = &trajectory.moves()[place.index].segment;
        let tangent = segment.tangent(place.along_mm);
        let across = Vector::new(-tangent.y, tangent.x, 0.0);
        // 0.02 mm beside the path and 0.03 mm late: only the first is a contour error.
        let point = trajectory.point(&place) + across * 0.02 - tangent * 0.03;
        let found = trajectory.deviation(&place, &point).norm();
        assert!(found <= 0.0362, "{found}");
        if (1.0..segment.length_mm() - 1.0).contains(&place.along_mm) {
            assert!((found - 0.02).abs() < 1e-4, "{found} at {place:?}");
        }
    }
}

/// One line of a random program, from its place; and the place it leads to.
#[derive(Clone, Debug)]
enum Step {
    Rapid([f64; 3]),
    Line([f64; 3], f64),
    /// Centre from here, turned by, rise, feed.
    Arc([f64; 2], f64, f64, f64),
}

fn step() -> impl Strategy<Value = Step> {
    let place = prop::array::uniform3(-60.0..60.0f64);
    let feed = 600.0..12_000.0f64;
    let centre = prop::array::uniform2(prop_oneof![-25.0..-0.5f64, 0.5..25.0f64]);
    prop_oneof![
        place.clone().prop_map(Step::Rapid),
        (place, feed.clone()).prop_map(|(place, feed)| Step::Line(place, feed)),
        (centre, -1.0..1.0f64, -5.0..5.0f64, feed)
            .prop_filter("an arc that rounding leaves as it is", |(_, turns, ..)| {
                (0.02..0.999).contains(&turns.abs())
            })
            .prop_map(|(centre, turns, rise, feed)| Step::Arc(centre, turns, rise, feed)),
    ]
}

/// A program of such lines, and where it ends.
fn text(steps: &[Step]) -> String {
    let mut here = [0.0f64; 3];
    let mut text = String::from("G21 G90 G17\n");
    let round = |value: f64| (value * 1e4).round() / 1e4;
    for step in steps {
        match step {
            Step::Rapid(to) | Step::Line(to, _) => {
                here = to.map(round);
                let [x, y, z] = here;
                let feed = match step {
                    Step::Line(_, feed) => format!("G1 F{feed:.1}"),
                    _ => "G0".to_owned(),
                };
                text += &format!("{feed} X{x:.4} Y{y:.4} Z{z:.4}\n");
            }
            Step::Arc(centre, turns, rise, feed) => {
                let [i, j] = centre.map(round);
                let (sin, cos) = (TAU * turns).sin_cos();
                here = [
                    round(here[0] + i - (cos * i - sin * j)),
                    round(here[1] + j - (sin * i + cos * j)),
                    round(here[2] + rise),
                ];
                let code = if *turns > 0.0 { "G3" } else { "G2" };
                let [x, y, z] = here;
                text += &format!("{code} X{x:.4} Y{y:.4} Z{z:.4} I{i:.4} J{j:.4} F{feed:.1}\n");
            }
        }
    }
    text
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 300,
        rng_seed: RngSeed::Fixed(0x4E47_4331),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn no_program_exceeds_the_limits(
        steps in prop::collection::vec(step(), 1..7),
        corner in prop_oneof![Just(0.0), 0.001..0.5f64],
    ) {
        let limits = Limits { corner_deviation_mm: corner, travel_mm: [(-1e3, 1e3); 3], ..limits() };
        let program = Program::parse(&text(&steps)).unwrap();
        let trajectory = Trajectory::plan(&program, &limits).unwrap();
        let places: Vec<_> = trajectory.places(limits.rate_hz).collect();
        let points: Vec<Vector> = places.iter().map(|place| trajectory.point(place)).collect();
        let last = program.moves.last().unwrap();
        prop_assert!(points[0].norm() < 1e-9);
        let end = last.segment.point(last.segment.length_mm());
        prop_assert!((points[points.len() - 1] - end).norm() < 1e-6);
        let rate = limits.rate_hz;
        for three in points.windows(3) {
            let velocity = (three[1] - three[0]) * rate;
            let acceleration = (three[2] - three[1] * 2.0 + three[0]) * (rate * rate);
            for axis in 0..3 {
                prop_assert!(velocity[axis].abs() <= limits.velocity_mm_s[axis] * (1.0 + 1e-6));
                // Positions of 100 mm resolve 1e-14 mm, a second difference of them 1e-5 mm/s^2.
                prop_assert!(
                    acceleration[axis].abs() <= limits.acceleration_mm_s2[axis] + 1e-3,
                    "{acceleration}"
                );
            }
        }
        for three in places.windows(3) {
            let [one, two, last] = [0, 1, 2].map(|k| three[k].speed_mm_s);
            prop_assert!((two - one).abs() * rate <= limits.path_acceleration_mm_s2 * (1.0 + 1e-6));
            let jerk = (last - 2.0 * two + one) * rate * rate;
            prop_assert!(jerk.abs() <= limits.path_jerk_mm_s3 * (1.0 + 1e-6) + 1e-2, "{jerk}");
        }
        for place in &places {
            let feed = trajectory.moves()[place.index].feed_mm_s.unwrap_or(f64::INFINITY);
            prop_assert!(place.speed_mm_s <= feed * (1.0 + 1e-9) && place.speed_mm_s >= -1e-9);
        }
    }
}
