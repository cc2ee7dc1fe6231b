//! `quadrant new`: from data sheets to a settings file, and from there to a commissioned axis.

use crate::command;
use std::fs;
use std::path::Path;

use quadrant_settings::StageSettings;
use quadrant_sim::settings_file::SettingsFile;

/// Options that describe a machine whole.
const WHOLE: [&str; 12] = [
    "--encoder",
    "rotary-2500",
    "--lead-mm",
    "5",
    "--amplifier",
    "analog-10v",
    "--max-velocity",
    "120",
    "--max-acceleration",
    "1500",
    "--travel",
    "-60..140",
];

fn new<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["new", "mine.toml"][..], &WHOLE, more].concat()
}

fn read(at: &Path) -> StageSettings {
    SettingsFile::read(&at.join("mine.toml")).unwrap().stage
}

#[test]
fn a_file_is_written_that_has_what_differs_from_the_defaults_with_units_and_names_the_next_command()
{
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shown = command::succeed(at, &new(&["--rate", "5000", "--axis", "y"]));
    assert!(shown.contains("quadrant connect --port"), "{shown}");
    assert!(
        shown.contains("quadrant commission --axis y --settings mine.toml --machine simulated --travel -60..140"),
        "{shown}"
    );
    let stage = read(at);
    assert_eq!(stage.rate_hz, 5e3);
    let axis = &stage.axes[1];
    assert_eq!(axis.encoder.resolution_mm, 5e-4);
    assert_eq!(axis.encoder.counts_per_index, Some(10_000));
    assert_eq!(axis.limits.max_velocity_mm_s, 120.0);
    let travel = axis.limits.travel_mm.unwrap();
    assert_eq!((travel.negative, travel.positive), (-60.0, 140.0));
    assert!(stage.axes.iter().all(|axis| !axis.commissioned));
    assert_eq!(
        stage.axes[0].limits,
        StageSettings::default().axes[0].limits
    );
    let text = fs::read_to_string(at.join("mine.toml")).unwrap();
    assert!(text.lines().count() < 50, "{text}");
    for part in [
        "max_velocity_mm_s = 120.0 # mm/s: ",
        "rate_hz = 5000.0 # Hz: ",
    ] {
        assert!(text.contains(part), "{part}:\n{text}");
    }
    assert!(!text.contains("kp_v_per_mm"), "{text}");
}

#[test]
fn an_existing_file_stays_unless_it_is_to_be_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("mine.toml"), "mine").unwrap();
    let said = command::fail(at, &new(&[]));
    assert!(said.contains("--overwrite"), "{said}");
    assert_eq!(fs::read_to_string(at.join("mine.toml")).unwrap(), "mine");
    command::succeed(at, &new(&["--overwrite"]));
    assert_eq!(read(at).axes[0].limits.max_velocity_mm_s, 120.0);
}

#[test]
fn without_a_terminal_nothing_is_asked() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (given, missing) in [
        (&["new"][..], "--encoder is needed"),
        (&["new", "--encoder", "rotary-2500"], "--lead-mm is needed"),
        (&["new", "--count-um", "1"], "--travel is needed"),
    ] {
        let said = command::fail(at, given);
        assert!(said.contains(missing), "{said}");
        assert!(!at.join("stage.toml").exists());
    }
    let said = command::fail(at, &["new", "--encoder", "rotary-250"]);
    assert!(
        said.contains("rotary-2500") && said.contains("--lines-per-turn"),
        "{said}"
    );
    // What the firmware would refuse is not written.
    let said = command::fail(at, &new(&["--rate", "500"]));
    assert!(
        said.contains("rate_hz = 500") && !at.join("mine.toml").exists(),
        "{said}"
    );
    let shown = command::succeed(at, &["new", "--list-presets"]);
    assert!(
        shown.contains("linear-1um") && shown.contains("analog-10v"),
        "{shown}"
    );
}

/// Commissions the x axis of a file that was written at a rate; returns its settings.
fn commissioned(rate: &str, machine: &str, more: &[&str]) -> StageSettings {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    command::succeed(at, &new(&["--rate", rate]));
    let commission = [
        &[
            "commission",
            "--axis",
            "x",
            "--settings",
            "mine.toml",
            "--machine",
            machine,
        ][..],
        &["--quick", "--out", "out"],
        more,
    ];
    command::succeed(at, &commission.concat());
    SettingsFile::read(&at.join("out/settings.toml"))
        .unwrap()
        .stage
}

fn is_commissioned_at(stage: &StageSettings, rate_hz: f64) {
    assert_eq!(stage.rate_hz, rate_hz);
    let [x, y, _] = &stage.axes;
    assert!(x.commissioned && !y.commissioned);
    let plant = x.plant.unwrap();
    // Of the simulated stage.
    assert!(
        (plant.gain_mm_per_v_s2 / 69_390.0 - 1.0).abs() < 0.05,
        "{plant:?}"
    );
    assert!(stage.is_commissioned());
}

#[test]
fn a_new_file_of_another_rate_is_commissioned_under_the_law_alone() {
    for (rate, rate_hz) in [("2000", 2e3), ("20000", 2e4)] {
        is_commissioned_at(&commissioned(rate, "law", &[]), rate_hz);
    }
}

#[test]
fn a_new_file_of_another_rate_is_commissioned_over_the_firmware_on_a_short_travel() {
    for (rate, rate_hz) in [("2000", 2e3), ("5000", 5e3)] {
        let travel = ["--travel", "15"];
        is_commissioned_at(&commissioned(rate, "simulated", &travel), rate_hz);
    }
}

#[test]
fn a_file_is_written_into_a_folder_that_is_not_there_and_says_where_its_soft_limits_count_from() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let words = [&["new", "deep/mine/x.toml"][..], &WHOLE].concat();
    let shown = command::succeed(at, &words);
    assert!(at.join("deep/mine/x.toml").exists());
    for name in ["--travel", "limits.travel_mm", "homing.mark_mm"] {
        assert!(shown.contains(name), "{name}: {shown}");
    }
}

#[test]
fn a_simulated_machine_is_measured_with_the_rate_and_the_encoder_of_the_settings() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    command::succeed(at, &new(&["--rate", "1000"]));
    let measure = |machine: &'static str| {
        let line = "identify motor-constant --axis x --settings mine.toml --travel 40 --machine";
        line.split(' ').chain([machine]).collect::<Vec<_>>()
    };
    let shown = command::succeed(at, &measure("simulated"));
    assert!(shown.contains("mm/(V s"), "{shown}");
    let before = fs::read(at.join("quadrant-out/motor-constant.csv")).unwrap();
    let refused = command::fail(at, &measure("simulated:commissioned"));
    assert!(refused.contains("`store` and `reboot`"), "{refused}");
    let after = fs::read(at.join("quadrant-out/motor-constant.csv")).unwrap();
    assert_eq!(before, after);
}
