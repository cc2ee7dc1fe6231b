//! The command `quadrant circle`.

use crate::command;

#[test]
fn the_command_writes_tables_and_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shown = command::succeed(
        at,
        &[
            "circle",
            "--plane",
            "zx",
            "--radius-mm",
            "5",
            "--feed-mm-min",
            "3000",
            "--seeds",
            "2",
            "--out",
            "x",
        ],
    );
    assert!(shown.contains("G(b)") && shown.contains("ZX"), "{shown}");
    for file in [
        "circle-summary.csv",
        "circle-tests.csv",
        "circle-reversals.csv",
    ] {
        assert!(at.join("x").join(file).exists(), "{file}");
    }
    let page = std::fs::read_to_string(at.join("x/circle.html")).unwrap();
    assert!(page.contains("circle-polar-zx") && !page.contains("circle-polar-xy"));
    let refused = command::fail(at, &["circle", "--radius-mm", "5.0,0"]);
    assert!(refused.contains("--radius-mm 0 must be"), "{refused}");
}
