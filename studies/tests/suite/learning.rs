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
