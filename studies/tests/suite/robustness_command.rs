//! `quadrant-studies robustness`, as a person runs it.

use crate::command::{fail, succeed};

#[test]
fn chosen_scenarios_leave_tables_a_page_and_a_force_that_can_be_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeed(
        folder.path(),
        &["robustness", "--only", "hold", "--seeds", "1", "--out", "a"],
    );
    assert!(said.contains("Simulated, not measured"), "{said}");
    let file = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert!(file("a/robustness.csv").contains("\"hold, cutting\",hold,PID,"));
    assert!(file("a/robustness.html").contains("Tracking error, hold, cutting"));
    let force = "a/synthetic-cutting-force.csv";
    let arguments = [
        "robustness",
        "--only",
        "recorded",
        "--seeds",
        "1",
        "--force",
        force,
        "--out",
        "b",
    ];
    succeed(folder.path(), &arguments);
    // The same force, from the model and from the file, all along a sine and during a hold.
    assert!(file("b/robustness.csv").contains("\"hold, recorded force\",hold,PID,"));
    let refused = fail(
        folder.path(),
        &["robustness", "--axis", "z", "--force", force],
    );
    assert!(refused.contains("force_z_n"), "{refused}");
}

#[test]
fn what_cannot_be_is_refused_with_what_could() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, words) in [
        (
            ["robustness", "--backlash-um=-1"].as_slice(),
            "0 to 1000 um",
        ),
        (&["robustness", "--only", "earthquake"], "earthquake"),
        (&["robustness", "--seeds", "0"], "1..=100"),
        (&["robustness", "--force", "missing.csv"], "missing.csv"),
    ] {
        let said = fail(folder.path(), arguments);
        assert!(said.contains(words), "{said}");
    }
    std::fs::write(folder.path().join("f.csv"), "t_s,force_n\n0,1\n").unwrap();
    let said = fail(folder.path(), &["robustness", "--force", "f.csv"]);
    assert!(said.contains("force_x_n"), "{said}");
    let rows: String = (0..20)
        .map(|k| format!("{},{}\n", f64::from(k) * 1e-3, 2e5))
        .collect();
    std::fs::write(
        folder.path().join("g.csv"),
        format!("t_s,force_x_n\n{rows}"),
    )
    .unwrap();
    let said = fail(folder.path(), &["robustness", "--force", "g.csv"]);
    assert!(said.contains("newtons"), "{said}");
}
