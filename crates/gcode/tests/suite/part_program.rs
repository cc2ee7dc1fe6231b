//! Part programs: their geometry, the limits of their motion, and `quadrant replay --gcode` from end to end.

use std::f64::consts::TAU;

use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestCaseError};
use quadrant_gcode::{Limits, Program, ProgramError, Trajectory, Vector};
use quadrant_settings::StageSettings;

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
    let path = format!(
        "{}/../../host-sim/data/{name}.ngc",
        env!("CARGO_MANIFEST_DIR")
    );
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
            &["line 2", "5.1000", "4.9000", "0.0280"],
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
        .map(|ignored| ignored.word.as_str())
        .collect();
    assert_eq!(ignored, ["M3", "S1000"]);
    assert_eq!(Program::parse("G0 X1\nM2\nX5").unwrap().moves.len(), 1);
}

#[test]
fn what_cam_writes_around_its_moves_is_read_or_noted() {
    for (source, moves, length_mm, notes) in [
        // Line ends of old machines.
        (
            "G21 G90\rG1 X10 F600\r; up, and back\rY10\rX0\rM2\r",
            3,
            30.0,
            0,
        ),
        ("G21 G90\rG1 X10 F600\rY10\rM2\r", 2, 20.0, 0),
        (
            "G1 X10 F600\nM30\nSETUP: clamp left, zero on top face\n",
            1,
            10.0,
            0,
        ),
        ("%\nG1 X10 F600\n%\nleft over from the tape", 1, 10.0, 0),
        ("G1 X10 F600\n/G1 Y5\n/N30 G1 X0\nG1 X20\nM2", 2, 20.0, 1),
        (
            "%\nO0042 (BRACKET)\nN10 G0 G17 G21 G40 G49 G80 G90\nT1 M6\nG54 X0. Y0. S4000 M3\nG1 Z-1. F200.\nX20.\nM5\nM30\n%",
            2,
            21.0,
            5,
        ),
        (
            "G21 G90 G17\nG54 G0 X0. Y0. S4000 M3\nG43 H1 Z10. M8\nX20.\nM9 M5\nG91 G28 Z0.\nG90 M30",
            2,
            30.0,
            7,
        ),
        ("G0 X5\nG53 G0 Z0\nG28 X0 Y0\nG30\nX10\nM30", 2, 10.0, 3),
        ("G50 G69 G15 G0 X1\nM62 P3\nM66 P0 L3 Q5\nM0\nM1", 1, 1.0, 4),
        ("G55 G0 X1\nG59.3 G98 X2", 2, 2.0, 3),
        ("G1 X10 F9999999", 1, 10.0, 0),
        (":1234\nG1 X10 F600 (\u{fffd})", 1, 10.0, 0),
    ] {
        let program = match Program::parse(source) {
            Ok(program) => program,
            Err(error) => panic!("{source:?}: {error}"),
        };
        let path: f64 = program
            .moves
            .iter()
            .map(|step| step.segment.length_mm())
            .sum();
        assert_eq!(program.moves.len(), moves, "{source:?}");
        assert!((path - length_mm).abs() < 1e-9, "{source:?}: {path} mm");
        assert_eq!(
            program.notes().len(),
            notes,
            "{source:?}: {:?}",
            program.notes()
        );
    }
}

#[test]
fn a_note_counts_the_lines_that_it_is_about() {
    let program = Program::parse("G0 X1 M8\nX2 M8\nX3 M8 M9").unwrap();
    let notes = program.notes();
    assert!(
        notes[0].starts_with("line 1 and 2 more: M8 is ignored"),
        "{notes:?}"
    );
    assert!(notes[1].starts_with("line 3: M9 is ignored"), "{notes:?}");
}

#[test]
fn what_is_not_read_is_refused_by_its_name() {
    for (line, name) in [
        ("o100 sub", "subprograms and loops (O-words)"),
        ("#1 = 5", "parameters (#)"),
        ("G1 X[2 * 3]", "expressions ([ ])"),
        ("G96 D2000 S200", "constant surface speeds (G96)"),
        ("G81 X1 Y1 Z-1 R2", "canned cycles"),
        ("G98 G83 X1 Z-1 R2 Q1", "canned cycles"),
        ("G73 Z-1", "canned cycles"),
        ("G10 L2 P1 X0", "offsets set by the program (G10)"),
        ("M98 P100", "subprograms (M97 to M99)"),
        ("M99", "subprograms (M97 to M99)"),
        ("G65 P9000", "macros"),
        ("G41 D1", "tool radius compensations"),
        ("G92 X0", "shifts of the origin"),
        ("G93", "inverse-time feeds"),
        ("G95", "feeds a revolution"),
        ("G5 I0 J3 P0 Q-3 X1 Y1", "splines"),
        ("G33 Z-1 K1", "threads"),
        ("G38.2 Z-1", "probing moves"),
        ("G68 R45", "turned coordinates"),
        ("G51 X2", "scaled coordinates"),
        ("G16", "polar coordinates"),
        ("G1 X1 A90", "axes other than X, Y and Z"),
    ] {
        let text = refusal(&format!("G21 G90 F600\n{line}"));
        let found =
            text.starts_with("line 2: ") && text.contains(name) && text.contains("not supported");
        assert!(found, "{line:?}: {text}");
    }
}

#[test]
fn a_dwell_is_a_rest_of_its_seconds() {
    let without = plan("G1 X10 F600\nX20").duration_s();
    for (source, moving_s, rest_s) in [
        (
            "G1 X10 F600\nG4 P0.5\nG1 X20",
            plan("G61.1 G1 X10 F600\nX20").duration_s(),
            0.5,
        ),
        ("G4 P1\nG1 X10 F600\nX20\nG04 P0.25", without, 1.25),
    ] {
        let trajectory = plan(source);
        let expected_s = moving_s + rest_s;
        assert!(
            (trajectory.duration_s() - expected_s).abs() < 1e-9,
            "{source:?}"
        );
        let resting = trajectory
            .places(1000.0)
            .filter(|place| place.speed_mm_s == 0.0);
        assert!(resting.count() as f64 >= 1000.0 * rest_s, "{source:?}");
    }
    for (line, part) in [
        ("G4", "no time"),
        ("G4 P-1", "at least 0"),
        ("G4 P1 X5", "X5 contradicts G4"),
    ] {
        let text = refusal(&format!("G1 X1 F600\n{line}"));
        assert!(
            text.contains("line 2") && text.contains(part),
            "{line:?}: {text}"
        );
    }
}

#[test]
fn a_program_says_itself_how_its_corners_are_passed() {
    let corner = Vector::new(10.0, 0.0, 0.0);
    let closest_mm = |source: &str, corner_deviation_mm| {
        let limits = Limits {
            corner_deviation_mm,
            ..limits()
        };
        let trajectory = Trajectory::plan(&Program::parse(source).unwrap(), &limits).unwrap();
        let distances = trajectory
            .places(limits.rate_hz)
            .map(|place| (trajectory.point(&place) - corner).norm());
        distances.fold(f64::MAX, f64::min)
    };
    for (code, asked_mm, left_mm) in [
        ("G64 P0.05", 0.0, 0.05),
        ("G64 P0.05", 0.2, 0.05),
        ("G20 G64 P0.002 G21", 0.0, 0.0508),
        ("G64", 0.02, 0.02),
        ("G64", 0.0, 0.0),
        ("G61", 0.02, 0.0),
        ("G61.1", 0.02, 0.0),
    ] {
        let code = code.replace(" G21", "\nG21");
        let found = closest_mm(&format!("{code}\nG1 X10 F600\nY10"), asked_mm);
        assert!((found - left_mm).abs() < 1e-4, "{code} {asked_mm}: {found}");
    }
}

#[test]
fn an_arc_may_end_as_far_beside_its_circle_as_linuxcnc_allows() {
    for source in [
        "G20 G90 G17\nG0 X0.4869 Y0.6926\nG3 X0.4864 Y0.6965 I-0.5651 J-0.0821 F25",
        "G21 G90 G17\nG0 X34.445 Y-19.525\nG3 X34.461 Y-19.477 I-8.803 J2.850 F600",
        "G21\nG3 X10.027 Y0 I5 F600",
        "G20\nG3 X1.0027 Y0 I.5 F60",
    ] {
        let trajectory = plan(source);
        let arc = trajectory.moves().last().unwrap();
        let end = arc.segment.point(arc.segment.length_mm());
        let programmed = Program::parse(source).unwrap().moves.pop().unwrap().segment;
        assert!(
            (end - programmed.point(programmed.length_mm())).norm() < 1e-9,
            "{source}"
        );
    }
    for (source, most) in [
        ("G21\nG3 X10.029 Y0 I5 F600", "0.0280"),
        ("G20\nG3 X1.0029 Y0 I.5 F60", "0.0720"),
    ] {
        let text = refusal(source);
        assert!(text.contains(most), "{text}");
    }
}

/// A circle of 10 mm radius about the origin in straight pieces, from (10, 0), at a feed in mm/min.
fn circle_in_pieces(pieces: u32, feed: f64) -> String {
    let mut text = format!("G21 G90 G17\nG0 X10 Y0\nF{feed}\n");
    for piece in 1..=pieces {
        let (sin, cos) = (TAU * f64::from(piece) / f64::from(pieces)).sin_cos();
        text += &format!("G1 X{:.4} Y{:.4}\n", 10.0 * cos, 10.0 * sin);
    }
    text + "M2\n"
}

#[test]
fn a_circle_in_pieces_takes_what_the_arc_takes() {
    for feed in [600.0, 3000.0, 9000.0] {
        let arc_s = plan(&format!("G0 X10 Y0\nG3 X10 Y0 I-10 F{feed}")).duration_s();
        for pieces in [72, 100, 180, 360, 720] {
            let found_s = plan(&circle_in_pieces(pieces, feed)).duration_s();
            assert!(
                (found_s / arc_s - 1.0).abs() < 0.05,
                "{pieces} pieces, F{feed}: {found_s} s, the arc {arc_s} s"
            );
        }
    }
}

#[test]
fn a_curve_in_pieces_is_left_by_hundredths_of_a_millimetre_at_most() {
    let trajectory = plan(&circle_in_pieces(72, 600.0));
    for place in trajectory.places(1000.0).filter(|place| place.index > 0) {
        let radius = trajectory.point(&place).norm();
        assert!((10.0 - radius).abs() < 0.02, "{radius}");
    }
}

#[test]
fn the_deviation_is_from_the_path_however_short_its_pieces_are() {
    let trajectory = plan(&circle_in_pieces(3600, 600.0));
    let places: Vec<_> = trajectory.places(200.0).collect();
    // 0.5 mm late on pieces of 0.017 mm, and 0.002 mm outside.
    for pair in places.windows(11).filter(|pair| pair[0].index > 1) {
        let late = trajectory.point(&pair[0]);
        let found = trajectory.deviation(&pair[10], &(late * 1.0002)).norm();
        assert!((found - 0.002).abs() < 2e-4, "{found}");
    }
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

/// A smooth curve in straight pieces of many lengths: speeds up, slows down, and turns now this way and now that.
fn curve() -> impl Strategy<Value = String> {
    let piece = (0.01..3.0f64, -0.3..0.3f64, -0.05..0.05f64);
    let bend = (prop::collection::vec(piece, 1..6), 1..40_usize);
    (prop::collection::vec(bend, 1..4), 600.0..12_000.0f64).prop_map(|(bends, feed)| {
        let (mut at, mut heading) = ([0.0, 0.0, 0.0], 0.0_f64);
        let mut text = format!("G21 G90 F{feed:.0}\n");
        for (pieces, repeats) in bends {
            for (length, turn, rise) in pieces.iter().cycle().take(repeats) {
                heading += turn;
                at[0] += length * heading.cos();
                at[1] += length * heading.sin();
                at[2] += rise;
                text += &format!("G1 X{:.4} Y{:.4} Z{:.4}\n", at[0], at[1], at[2]);
            }
        }
        text
    })
}

/// Checks that no sample of a program's motion exceeds a limit, and that it ends where the program does.
fn keeps_limits(source: &str, limits: &Limits) -> Result<(), TestCaseError> {
    let program = Program::parse(source).unwrap();
    let trajectory = Trajectory::plan(&program, limits).unwrap();
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
        prop_assert!(
            jerk.abs() <= limits.path_jerk_mm_s3 * (1.0 + 1e-6) + 1e-2,
            "{jerk}"
        );
    }
    for place in &places {
        let feed = trajectory.moves()[place.index]
            .feed_mm_s
            .unwrap_or(f64::INFINITY);
        prop_assert!(place.speed_mm_s <= feed * (1.0 + 1e-9) && place.speed_mm_s >= -1e-9);
    }
    Ok(())
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
        keeps_limits(&text(&steps), &limits)?;
    }

    #[test]
    fn no_curve_in_pieces_exceeds_the_limits(source in curve()) {
        keeps_limits(&source, &Limits { travel_mm: [(-1e3, 1e3); 3], ..limits() })?;
    }
}
