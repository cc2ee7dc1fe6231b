//! A simulated stage of one's own: what its axis would gain, and the way from its file to a machine that is moved.

use crate::command::{self, words};
use std::fs;
use std::path::Path;

use quadrant_sim::settings_file::SettingsFile;

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/stage.toml");

/// A short stage, which is quick to commission.
const SHORT: &str = "[x]\nmass_kg = 20\nforce_n_per_v = 500\ncoulomb_n = 70\ntravel_mm = [-20, 30]\n\
                     [y]\nfriction = \"static\"\ntravel_mm = [-25, 25]\n";

fn folder_with(name: &str, text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), text).unwrap();
    folder
}

#[test]
fn the_example_says_what_its_axis_gains_within_eighty_columns() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::copy(EXAMPLE, at.join("mine.toml")).unwrap();
    let shown = command::succeed(at, &["compare", "--stage", "mine.toml"]);
    for line in shown.lines() {
        assert!(line.chars().count() <= 80, "{line}\n{shown}");
    }
    assert!(shown.lines().count() <= 34, "{shown}");
    for part in [
        "commissioned on the x axis of mine.toml, takes",
        "% off the best PID's largest error",
        "commissioned: N-PID",
        "friction identified from experiments",
        "quadrant-out/mine-x-settings.toml",
    ] {
        assert!(words(&shown).contains(part), "{part}:\n{shown}");
    }
    assert!(!shown.contains("thesis"), "{shown}");
    // Of what was measured, not of the file: each number was found within its tolerance, and none is the file's own.
    let settings = SettingsFile::read(&at.join("quadrant-out/mine-x-settings.toml")).unwrap();
    let axis = &settings.stage.axes[0];
    let gain = axis.plant.unwrap().gain_mm_per_v_s2;
    assert!(gain != 1e4 && (gain / 1e4 - 1.0).abs() < 0.01, "{gain}");
    let coulomb_v = axis.friction.sliding.positive.curve.coulomb_v;
    let true_v = 1.03 * 90.0 / 400.0;
    assert!(
        coulomb_v != true_v && (coulomb_v / true_v - 1.0).abs() < 0.05,
        "{coulomb_v} {true_v}"
    );
    // The same settings again, without commissioning, on sines of one's own.
    let again = [
        "compare",
        "--stage",
        "mine.toml",
        "--settings",
        "quadrant-out/mine-x-settings.toml",
        "--velocity",
        "20",
        "--amplitude",
        "12",
        "--tables",
    ];
    let shown = command::succeed(at, &again);
    assert!(!shown.contains("Commissioned"), "{shown}");
    for part in ["sine of 12 mm", "20 mm/s", "RMS tracking error"] {
        assert!(shown.contains(part), "{part}:\n{shown}");
    }
    assert!(!shown.contains("Circle of"), "{shown}");
}

#[test]
fn every_axis_of_the_built_in_stage_is_compared_at_any_velocity_and_amplitude() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let asked = ["--axis", "y", "--velocity", "8.5", "--amplitude", "4"];
    let shown = command::succeed(at, &[&["compare"], &asked[..]].concat());
    for part in ["at 8.5 mm/s", "sine of 4 mm", "thesis' PID"] {
        assert!(shown.contains(part), "{part}:\n{shown}");
    }
    // The program without a command is the same.
    let same = command::succeed(at, &asked);
    assert_eq!(shown, same);
    let x = command::succeed(at, &["compare", "--velocity", "8.5", "--amplitude", "4"]);
    assert_ne!(shown, x);
}

#[test]
fn circle_and_replay_run_on_a_stage_that_was_commissioned_for_them() {
    let folder = folder_with("mine.toml", SHORT);
    let at = folder.path();
    let circle = [
        "circle",
        "--stage",
        "mine.toml",
        "--plane",
        "xy",
        "--feed-mm-min",
        "600",
    ];
    let shown = command::succeed(at, &circle);
    assert!(shown.contains("Commissioned: x with "), "{shown}");
    assert!(shown.contains(", y with "), "{shown}");
    let on_mine = "on the simulated stage of mine.toml";
    assert!(words(&shown).contains(on_mine), "{shown}");
    let page = fs::read_to_string(at.join("quadrant-out/circle.html")).unwrap();
    assert!(page.contains(on_mine), "circle.html");
    // Of the usual radii two fit 50 mm of travel.
    for part in [" 15.0 ", "best PID + static + GMS", "as commissioned"] {
        assert!(shown.contains(part), "{part}:\n{shown}");
    }
    assert!(!shown.contains(" 30.0 "), "{shown}");
    fs::write(at.join("part.ngc"), "G21 G90\nG1 X10 F600\nG1 Y10\nM2\n").unwrap();
    let settings = "quadrant-out/mine-xy-settings.toml";
    let replay = ["replay", "--stage", "mine.toml", "--settings", settings];
    let shown = command::succeed(at, &[&replay[..], &["--gcode", "part.ngc"]].concat());
    assert!(shown.contains("best PID"), "{shown}");
    assert!(words(&shown).contains(on_mine), "{shown}");
    let reference = "quadrant-out/part-program-x.csv";
    let recorded = ["--reference", reference, "--axis", "x"];
    let shown = command::succeed(at, &[&replay[..], &recorded].concat());
    assert!(shown.contains("best PID"), "{shown}");
    assert!(
        words(&shown).contains("x of the simulated stage of mine.toml"),
        "{shown}"
    );
}

#[test]
fn a_machine_with_a_stage_of_ones_own_is_commissioned_and_homed_within_its_travel() {
    let folder = folder_with("mine.toml", SHORT);
    let at = folder.path();
    let commission = "commission --axis x --machine law --stage mine.toml --quick";
    let said = command::succeed(at, &commission.split(' ').collect::<Vec<_>>());
    assert!(said.contains("Simulated, not measured"), "{said}");
    let script = "provenance\nload quadrant-out/settings.toml\nenable\nhome x\nwait homed x\nmove x 25\nwait rest\nstatus\n";
    let connect = ["connect", "--simulated", "--stage", "mine.toml"];
    let output = command::play(at, &connect, script);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        output.status.success(),
        "{said}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(said.contains("starts not commissioned"), "{said}");
    let x = said.lines().rfind(|line| line.starts_with("x ")).unwrap();
    let place: f64 = x.split_whitespace().nth(3).unwrap().parse().unwrap();
    assert!(x.contains("yes") && (place - 25.0).abs() < 0.01, "{x}");
    let beyond = command::play(
        at,
        &connect,
        "load quadrant-out/settings.toml\nenable\nhome x\nwait homed x\nmove x 31\n",
    );
    let errors = String::from_utf8(beyond.stderr).unwrap();
    assert!(errors.contains("travel"), "{errors}");
}

#[test]
fn what_a_stage_does_not_allow_is_refused_with_the_field_and_the_remedy() {
    let folder = folder_with("mine.toml", SHORT);
    let at = folder.path();
    let identified = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../host-sim/data/identified-stage.toml"
    );
    fs::write(at.join("typing.toml"), "[x]\nmas_kg = 3\n").unwrap();
    fs::write(
        at.join("fine.toml"),
        "[x]\nresolution_um = 0.001\nmax_velocity_mm_s = 900\n",
    )
    .unwrap();
    fs::write(at.join("other.toml"), "[x]\nresolution_um = 1\n").unwrap();
    for (command, parts) in [
        ("compare --stage none.toml", ["none.toml", "No such file"]),
        ("compare --stage typing.toml", ["line 2", "`mass_kg`"]),
        (
            "compare --stage fine.toml",
            ["fine.toml", "max_velocity_mm_s"],
        ),
        (
            "compare --stage mine.toml --axis z",
            ["no table [z]", "--axis"],
        ),
        (
            "compare --stage mine.toml --amplitude 26",
            ["travel in mine.toml is 50 mm", "--amplitude 26"],
        ),
        (
            "compare --velocity 300",
            ["above the 250 mm/s", "max_velocity_mm_s"],
        ),
        (
            "compare --velocity 200 --amplitude 5",
            ["8000 mm/s^2", "larger amplitude"],
        ),
        ("compare --velocity 1,2,3,4", ["at most 3", "--velocity"]),
        ("compare --velocity 0.01", ["lasts", "higher --velocity"]),
        ("compare --amplitude 0", ["--amplitude 0", "above 0"]),
        (
            "circle --stage mine.toml --plane xy --radius-mm 26",
            ["--radius-mm 26", "travel in mine.toml is 50 mm"],
        ),
        (
            "replay --gcode part.ngc --stage mine.toml --model exact",
            ["--model exact", "commissioning"],
        ),
        (
            "replay --reference a.csv --axis emps --stage mine.toml",
            ["EMPS", "--stage"],
        ),
        (
            "commission --axis x --machine tcp:127.0.0.1:9 --stage mine.toml",
            ["mine.toml", "a stage of its own"],
        ),
        (
            "connect --simulated=commissioned --stage mine.toml status",
            ["no settings ready", "commission"],
        ),
    ] {
        let words: Vec<&str> = command.split(' ').collect();
        let said = command::fail(at, &words);
        for part in parts {
            assert!(said.contains(part), "{command}: {part}:\n{said}");
        }
    }
    let settings = ["compare", "--stage", "other.toml", "--settings", identified];
    let said = command::fail(at, &settings);
    assert!(
        said.contains("encoder.resolution_mm = 0.0005") && said.contains("0.001"),
        "{said}"
    );
    assert!(!Path::new(&at.join("quadrant-out/mine-x-settings.toml")).exists());
}
