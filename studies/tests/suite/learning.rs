//! `quadrant-studies learning`, as a person runs it.

use crate::command::{fail, succeed};

#[test]
fn the_figures_are_written_and_the_scale_settles_at_the_friction() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeed(
        folder.path(),
        &[
            "learning", "--only", "figures", "--format", "svg", "--format", "csv", "--out", "a",
        ],
    );
    assert!(said.contains("Simulated, not measured"), "{said}");
    for name in ["settling-scale", "settling-error", "slot"] {
        let file = folder.path().join(format!("a/figures/{name}.svg"));
        let size = std::fs::metadata(&file).unwrap().len();
        assert!((2_000..60_000).contains(&size), "{name}: {size} bytes");
    }
    let curves = std::fs::read_to_string(folder.path().join("a/figures/settling-scale.csv"));
    assert!(curves.unwrap().contains("scale learnt"));
    fail(folder.path(), &["learning", "--only", "magic"]);
}

#[test]
fn learning_leaves_as_little_as_a_feedforward_that_knows_the_friction() {
    let folder = tempfile::tempdir().unwrap();
    succeed(
        folder.path(),
        &[
            "learning", "--only", "known", "--format", "csv", "--out", "a",
        ],
    );
    let table = std::fs::read_to_string(folder.path().join("a/known.csv")).unwrap();
    for row in table.lines().skip(1) {
        let cells = row.split(',').skip(1);
        // Largest and RMS of: without, scaled by hand, the axis' own friction, learning; um.
        let errors: Vec<f64> = cells.map(|cell| cell.parse().unwrap()).collect();
        let [without, scaled, own, learning] = [errors[1], errors[3], errors[5], errors[7]];
        assert!(learning < 0.1 * without, "{table}");
        assert!(learning < 1.25 * f64::max(scaled, own), "{table}");
    }
}

/// A recording of an axis like EMPS: 25 s of two cosines, from rest, with friction that nothing of ours made.
fn record() -> String {
    let sines = [(45.0, 0.2), (12.0, 0.62)].map(|(mm, hz)| (mm, std::f64::consts::TAU * hz));
    let mut rows = "t_s,position_mm,voltage_v\n".to_owned();
    for row in 0..25_000 {
        let time_s = 1e-3 * f64::from(row);
        let [mut position, mut velocity, mut acceleration] = [0.0; 3];
        for (amplitude_mm, omega) in sines {
            let (sine, cosine) = (omega * time_s).sin_cos();
            position -= amplitude_mm * cosine;
            velocity += amplitude_mm * omega * sine;
            acceleration += amplitude_mm * omega * omega * cosine;
        }
        let friction = 0.58 * (velocity / 0.1).tanh() + 5.8e-3 * velocity;
        let voltage = acceleration / 369.6 + friction - 0.09;
        rows += &format!("{time_s:.3},{position:.6},{voltage:.6}\n");
    }
    rows
}

#[test]
fn on_recorded_friction_learning_is_as_good_as_a_right_scale_and_better_than_a_wrong_one() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("record.csv"), record()).unwrap();
    let arguments = ["learning", "--record", "record.csv", "--format", "csv"];
    let said = succeed(folder.path(), &[&arguments[..], &["--out", "a"]].concat());
    assert!(said.contains("Recorded friction"), "{said}");
    let table = std::fs::read_to_string(folder.path().join("a/recorded.csv")).unwrap();
    // RMS without, fixed and learning, um.
    let errors: Vec<[f64; 3]> = table
        .lines()
        .skip(1)
        .map(|row| {
            let cells: Vec<&str> = row.rsplitn(8, ',').collect();
            [cells[6], cells[4], cells[2]].map(|cell| cell.parse().unwrap())
        })
        .collect();
    let [published, catalogue, half, twice, fitted] = errors[..] else {
        panic!("{table}");
    };
    for [without, fixed, learning] in [published, catalogue, fitted] {
        assert!(
            learning < 1.15 * fixed + 0.1 && learning < 0.6 * without,
            "{table}"
        );
    }
    for [_, fixed, learning] in [half, twice] {
        assert!(learning < 0.8 * fixed, "{table}");
    }
    fail(folder.path(), &["learning", "--record", "none.csv"]);
}
