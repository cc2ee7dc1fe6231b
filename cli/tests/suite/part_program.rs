//! The command `quadrant replay --gcode`.

use crate::command;

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-sim/data");

#[test]
fn the_sample_programs_run_on_the_stage_and_what_is_written_can_be_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for name in ["circle", "rounded-square", "pocket"] {
        let file = format!("{name}.ngc");
        std::fs::copy(format!("{DATA}/{file}"), at.join(&file)).unwrap();
        let shown = command::succeed(at, &["replay", "--gcode", &file, "--out", name]);
        assert!(shown.contains("Contour RMS"), "{shown}");
        let mut reader = csv::Reader::from_path(at.join(name).join("part-program.csv")).unwrap();
        let rms: Vec<f64> = reader
            .records()
            .map(|row| row.unwrap()[2].parse().unwrap())
            .collect();
        assert!(rms[1] < 0.5 * rms[0], "{name}: {rms:?}");
        let page = std::fs::read_to_string(at.join(name).join("part-program.html")).unwrap();
        assert!(page.contains(&file) && page.contains("part-program-feed"));
    }
    command::succeed(
        at,
        &[
            "replay",
            "--reference",
            "rounded-square/part-program-x.csv",
            "--axis",
            "x",
        ],
    );
    std::fs::write(at.join("bad.ngc"), "G21\nG1 X10\n").unwrap();
    let refused = command::fail(at, &["replay", "--gcode", "bad.ngc"]);
    assert!(refused.contains("line 2: G1 has no feed"), "{refused}");
    let refused = command::fail(at, &["replay", "--gcode", "bad.ngc", "--axis", "x"]);
    assert!(refused.contains("cannot be used with"), "{refused}");
}
