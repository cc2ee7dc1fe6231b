//! Every command that writes settings, over the folder that a commissioning has left: what the command is not for stays.

use std::path::Path;

use quadrant_settings::StageSettings;
use quadrant_sim::setting_value::changes;
use quadrant_sim::settings_file::SettingsFile;
use quadrant_written::whole;

use crate::command::{fail, succeed};

/// The file in which a commissioning leaves its settings by default.
const LEFT: &str = "quadrant-out/settings.toml";

/// The settings of a commissioned stage, with values of a person's own among them, in the default folder.
fn commissioned(folder: &Path) -> SettingsFile {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../host-sim/data/identified-stage.toml"
    );
    let mut file = SettingsFile::read(Path::new(path)).unwrap();
    file.stage.brake.release_s = 0.123;
    let [x, y, z] = &mut file.stage.axes;
    x.limits.braking_mm_s2 = 2345.0;
    x.friction.smoothed_gms.width = 0.31;
    y.homing = None;
    z.commissioned = false;
    std::fs::create_dir(folder.join("quadrant-out")).unwrap();
    file.write(&folder.join(LEFT), whole::write).unwrap();
    file
}

/// Runs a command over such a folder. Nothing but what lies below `meant` may change, and what changes is said.
fn assert_keeps(command: &str, meant: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let before = commissioned(folder.path());
    let words: Vec<&str> = command.split(' ').collect();
    let said = succeed(folder.path(), &words);
    let after = SettingsFile::read(&folder.path().join(LEFT)).unwrap();
    let changed = changes(&before.stage, &after.stage);
    assert!(!changed.is_empty(), "{command}");
    for change in changed {
        let path = &change.path;
        let is_meant = |prefix: &&str| path.starts_with(*prefix);
        assert!(meant.iter().any(is_meant), "{command}: {change}");
        assert!(
            said.contains(&format!("{change}\n")),
            "{command}: {change}\n{said}"
        );
    }
    let kept = &after.provenance[..after.provenance.len() - 1];
    let others = |origin: &&quadrant_sim::settings_file::Provenance| {
        !command.starts_with("commission") || origin.axis != "y"
    };
    let expected: Vec<_> = before.provenance.iter().filter(others).cloned().collect();
    assert_eq!(kept, expected, "{command}");
}

#[test]
fn a_design_changes_its_gains_in_what_a_commissioning_has_left_and_nothing_else() {
    for command in [
        "design pid --gain-margin-db 12 --phase-margin-deg 60",
        "design pid --gain 61200 --damping 20 --delay 0.0012",
    ] {
        assert_keeps(command, &["x/feedback/pid/"]);
    }
    assert_keeps(
        "design npid --axis y --draws 20 --sector-share 0.5",
        &["y/feedback/nonlinear/"],
    );
}

#[test]
fn an_identification_changes_what_it_has_identified_and_nothing_else() {
    let friction = [
        "x/friction/sliding/",
        "x/friction/gms/",
        "x/friction/dahl",
        "x/friction/lugre",
    ];
    let plant = ["x/plant/"];
    let both = [&friction[..], &plant[..]].concat();
    let first_pid = [
        "x/feedback/law",
        "x/feedback/pid/",
        "x/feedforward/kind",
        "x/limits/following_error",
    ];
    for (step, meant) in [
        ("motor-constant", &first_pid[..]),
        ("plant", &plant),
        ("static-friction --from-mm-s 0.4", &friction),
        ("virgin-curve --frequency-hz 0.2", &friction),
        ("motion --dead-time-s 0.00135", &both),
        ("nctf --most-mm-s 100", &["x/feedback/nctf"]),
    ] {
        assert_keeps(&format!("identify {step} --axis x --into {LEFT}"), meant);
    }
}

#[test]
fn the_commissioning_of_an_axis_changes_that_axis_and_nothing_else() {
    assert_keeps("commission --axis y --quick --travel 200", &["y/"]);
}

#[test]
fn what_another_has_measured_is_not_written_over_by_settings_of_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let before = commissioned(at);
    SettingsFile::new(StageSettings::simulated())
        .write(&at.join("other.toml"), whole::write)
        .unwrap();
    for command in [
        "design pid --settings other.toml",
        "design npid --draws 20 --settings other.toml",
        "identify plant --axis x --settings other.toml --into quadrant-out/settings.toml",
        "commission --axis x --quick --travel 200 --settings other.toml",
        "connect --simulated dump quadrant-out/settings.toml",
    ] {
        let words: Vec<&str> = command.split(' ').collect();
        let said = fail(at, &words);
        for part in [
            "quadrant-out/settings.toml",
            "would be lost",
            "brake/release_s",
        ] {
            assert!(said.contains(part), "{command}: {said}");
        }
        let after = SettingsFile::read(&at.join(LEFT)).unwrap();
        assert_eq!(after, before, "{command}");
    }
    // A folder for it, or the word of a person.
    succeed(
        at,
        &[
            "design",
            "pid",
            "--settings",
            "other.toml",
            "--out",
            "other",
        ],
    );
    let dump = ["connect", "--simulated", "dump", LEFT, "--overwrite"];
    succeed(at, &dump);
    assert_ne!(
        SettingsFile::read(&at.join(LEFT)).unwrap().stage,
        before.stage
    );
}

#[test]
fn no_axis_counts_as_commissioned_because_of_a_design_or_a_record() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let standing = |path: &str| {
        let stage = SettingsFile::read(&at.join(path)).unwrap().stage;
        stage.axes.map(|axis| axis.commissioned)
    };
    succeed(at, &["design", "pid"]);
    assert_eq!(standing(LEFT), [false; 3]);
    succeed(at, &["identify", "frf", "--axis", "x", "--out", "a"]);
    let plant = "identify plant --frf a/frf.csv --axis x --into b.toml";
    succeed(at, &plant.split(' ').collect::<Vec<_>>());
    assert_eq!(standing("b.toml"), [false; 3]);
}
