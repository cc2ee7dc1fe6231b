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
fn from_other_gains_and_other_friction_learning_ends_as_if_it_were_identified() {
    let folder = tempfile::tempdir().unwrap();
    succeed(
        folder.path(),
        &[
            "learning", "--only", "starts", "--format", "csv", "--out", "a",
        ],
    );
    // Largest and RMS of: without, fixed, learning; um.
    let errors = |name: &str| -> Vec<[f64; 6]> {
        let text = std::fs::read_to_string(folder.path().join("a").join(name)).unwrap();
        let row = |row: &str| {
            let cells: Vec<&str> = row.rsplitn(8, ',').collect();
            std::array::from_fn(|index| cells[6 - index].parse().unwrap())
        };
        text.lines().skip(1).map(row).collect()
    };
    let starts = errors("starts.csv");
    let [_, _, _, identified, ..] = starts[0];
    for [_, without, _, fixed, _, learning] in &starts {
        assert!(*learning < 1.25 * identified, "{starts:?}");
        assert!(*learning < 0.1 * without, "{starts:?}");
        assert!(*learning < fixed + 0.2, "{starts:?}");
    }
    let catalogue = errors("catalogue.csv");
    assert_eq!(catalogue.len(), 10);
    for [without, _, fixed, _, learning, _] in &catalogue {
        assert!(*learning < 0.2 * without, "{catalogue:?}");
        assert!(*learning < fixed + 0.5, "{catalogue:?}");
    }
}
