//! The commands `quadrant design pid` and `npid`, from end to end.

use std::path::Path;

use quadrant_law::axes::AxisName;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::filter::FilterSettings;
use quadrant_settings::StageSettings;
use quadrant_settings::popov::filtered_sector_bound;
use quadrant_settings::response::LinearResponse;
use quadrant_sim::settings_file::SettingsFile;
use quadrant_tune::design::{Form, Process};
use quadrant_tune::identify::response::{FrequencyResponse, ResponsePoint};
use quadrant_written::whole;

use crate::command;

fn succeed(folder: &Path, arguments: &[&str]) -> String {
    command::succeed(folder, &[&["design"], arguments].concat())
}

fn fail(folder: &Path, arguments: &[&str]) -> String {
    command::fail(folder, &[&["design"], arguments].concat())
}

/// The cells of a row of a table's CSV file.
fn row(path: &Path, first: &str) -> Vec<String> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let row = reader
        .records()
        .map(Result::unwrap)
        .find(|row| row[0].starts_with(first))
        .unwrap();
    row.iter().map(str::to_owned).collect()
}

#[test]
fn the_thesis_targets_print_the_thesis_margins() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeed(
        at,
        &[
            "pid",
            "--gain-margin-db",
            "9.9",
            "--phase-margin-deg",
            "54.2",
            "--crossover-hz",
            "64.9",
            "--out",
            "x",
        ],
    );
    let margins = row(&at.join("x/margins.csv"), "continuous");
    let value = |index: usize| -> f64 { margins[index].parse().unwrap() };
    assert_eq!(format!("{:.1} {:.0}", value(1), value(2)), "9.9 194");
    assert_eq!(format!("{:.1} {:.1}", value(3), value(4)), "54.2 64.9");
    assert!(at.join("x/pid.html").exists());
}

#[test]
fn one_design_builds_on_another_and_the_settings_name_both() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let bounds = ["--sensitivity-peak", "1.7", "--design-on", "sampled"];
    let mut arguments = vec!["pid", "--axis", "y", "--out", "pid"];
    arguments.extend(bounds);
    succeed(at, &arguments);
    succeed(
        at,
        &[
            "npid",
            "--axis",
            "y",
            "--settings",
            "pid/settings.toml",
            "--draws",
            "50",
            "--out",
            "npid",
        ],
    );
    let file = SettingsFile::read(&at.join("npid/settings.toml")).unwrap();
    let axes: Vec<&str> = file.provenance.iter().map(|p| p.axis.as_str()).collect();
    assert_eq!(axes, ["y", "y"]);
    assert_eq!(file.provenance[1].sets, ["feedback.nonlinear"]);
    let default = quadrant_settings::presets::y_axis();
    assert!(file.stage.axes[1].feedback.pid.kp_v_per_mm > default.feedback.pid.kp_v_per_mm);
    assert!(at.join("npid/npid.html").exists());
}

#[test]
fn a_design_goes_on_from_what_an_earlier_one_has_left_in_the_same_folder() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeed(at, &["pid", "--sensitivity-peak", "1.7"]);
    let path = at.join("quadrant-out/settings.toml");
    let pid = SettingsFile::read(&path).unwrap().stage.axes[0]
        .feedback
        .pid;
    let said = succeed(at, &["npid"]);
    let after = SettingsFile::read(&path).unwrap();
    assert_eq!(after.stage.axes[0].feedback.pid, pid);
    assert_eq!(after.provenance.len(), 2);
    assert!(said.contains("quadrant-out/settings.toml"), "{said}");
    assert!(after.stage.axes.iter().all(|axis| !axis.commissioned));
}

#[test]
fn a_design_counts_the_filters_of_its_axis() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let form = Form::Sampled {
        sample_time_s: 1e-4,
        computation_delay_s: 0.0,
    };
    let mut stage = StageSettings::simulated();
    let notch = FilterSettings::notch(120.0, 0.4, 0.2);
    stage.axes[0].feedback.filters = Some(std::iter::once(notch).collect());
    stage.axes[0].feedback.law = LawKind::Pid;
    let plant = stage.axes[0].plant.unwrap();
    let lines = (2..=500).map(|line| {
        let frequency_hz = 2.0 * f64::from(line);
        ResponsePoint {
            frequency_hz,
            response: plant.response(std::f64::consts::TAU * frequency_hz),
            coherence: 1.0,
            relative_deviation: 1e-3,
        }
    });
    let response = FrequencyResponse {
        points: lines.collect(),
    };
    response.write_csv(&at.join("frf.csv")).unwrap();
    SettingsFile::new(stage)
        .write(&at.join("stage.toml"), whole::write)
        .unwrap();
    let pid = |out: &str, more: &[&str]| {
        let common = [
            "pid",
            "--settings",
            "stage.toml",
            "--sensitivity-peak",
            "1.7",
            "--design-on",
            "sampled",
            "--out",
        ];
        let words: Vec<&str> = common
            .into_iter()
            .chain([out])
            .chain(more.iter().copied())
            .collect();
        succeed(at, &words);
        let file = at.join(out).join("settings.toml");
        let axis = SettingsFile::read(&file).unwrap().stage.axes[0].clone();
        let process = Process::Modelled {
            plant,
            modes: Vec::new(),
            filters: vec![notch],
        };
        let margins = process.margins(&axis.feedback.pid, form).unwrap();
        assert!(margins.sensitivity_peak < 1.72, "{out}: {margins:?}");
        // What is printed is that, too.
        let printed = row(&at.join(out).join("margins.csv"), "sampled");
        let peak: f64 = printed[5].parse().unwrap();
        assert!(
            (peak - margins.sensitivity_peak).abs() < 0.02,
            "{out}: {peak} {margins:?}"
        );
    };
    pid("model", &[]);
    pid("measured", &["--frf", "frf.csv"]);
    let npid = [
        "npid",
        "--settings",
        "model/settings.toml",
        "--draws",
        "50",
        "--out",
        "npid",
    ];
    succeed(at, &npid);
    let feedback = &SettingsFile::read(&at.join("npid/settings.toml"))
        .unwrap()
        .stage
        .axes[0]
        .feedback;
    let bound = filtered_sector_bound(&plant, &feedback.pid, &[notch], 1e-4);
    let largest = feedback.nonlinear.unwrap().largest();
    assert!(
        (largest / bound - 0.75).abs() < 1e-3,
        "{largest} of {bound}"
    );
    let robust = row(&at.join("npid/robustness.csv"), "");
    let median: f64 = robust[2].parse().unwrap();
    assert!((median / bound - 1.0).abs() < 0.1, "{median} of {bound}");
}

#[test]
fn what_cannot_be_designed_is_refused_with_what_can() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let crossover = ["pid", "--crossover-hz", "150", "--phase-margin-deg", "80"];
    assert!(fail(at, &crossover).contains("can only lie between"));
    let missing = fail(at, &["pid", "--frf", "none.csv"]);
    assert!(missing.contains("none.csv"), "{missing}");
    let zero = ["pid", "--gain", "0", "--damping", "10"];
    assert!(fail(at, &zero).contains("A must be above zero"));
    let share = ["npid", "--sector-share", "2"];
    assert!(fail(at, &share).contains("at most 1"));
    let rate = ["pid", "--rate-hz", "20"];
    assert!(fail(at, &rate).contains("1000 to 100000"));
}

/// A file of `quadrant new` for x.
fn new(at: &Path, file: &str) {
    let words = format!(
        "new {file} --count-um 0.5 --amplifier analog-10v --max-velocity 200 --max-acceleration 2000 --travel 150"
    );
    command::succeed(at, &words.split(' ').collect::<Vec<_>>());
}

/// A design on numbers.
const ON_NUMBERS: &str = "pid --gain 68560 --damping 143 --stiffness 0 --delay 0.00107 --best";

#[test]
fn a_design_is_written_into_the_settings_of_its_axis_and_the_others_stay() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    new(at, "mine.toml");
    let read = |file: &str| SettingsFile::read(&at.join(file)).unwrap().stage;
    let before = read("mine.toml");
    let into = format!("{ON_NUMBERS} --into mine.toml");
    let said = succeed(at, &into.split(' ').collect::<Vec<_>>());
    assert!(
        said.contains("mine.toml: the settings with this feedback.pid of x"),
        "{said}"
    );
    let mut after = read("mine.toml");
    let pid = after.axes[0].feedback.pid;
    assert!(pid.kp_v_per_mm > 0.0 && pid.kd_v_s_per_mm > 0.0);
    after.axes[0].feedback.pid = before.axes[0].feedback.pid;
    assert_eq!(after, before);
    assert!(!at.join("quadrant-out/settings.toml").exists());
    // Numbers stand for the model of settings that are given, too.
    let given = format!("{ON_NUMBERS} --settings mine.toml --into other.toml");
    succeed(at, &given.split(' ').collect::<Vec<_>>());
    assert_eq!(read("other.toml").axes[0].feedback.pid, pid);
    // Of the other axes of a machine nothing is known.
    let alone = format!("{ON_NUMBERS} --into alone.toml");
    succeed(at, &alone.split(' ').collect::<Vec<_>>());
    let alone = read("alone.toml");
    assert_eq!(alone.uncommissioned(), Some(AxisName::X));
    assert!(
        alone.axes[1..]
            .iter()
            .all(|axis| axis.feedback.pid.kp_v_per_mm == 0.0)
    );
}

#[test]
fn runs_under_settings_that_do_not_suit_them_are_refused_at_once_with_the_axis_and_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    new(at, "mine.toml");
    let into = format!("{ON_NUMBERS} --into mine.toml");
    succeed(at, &into.split(' ').collect::<Vec<_>>());
    for run in [
        &["compare"][..],
        &["circle"],
        &["replay", "--axis", "x", "--reference", "none.csv"],
    ] {
        let words = [run, &["--settings", "mine.toml"]].concat();
        let said = command::fail(at, &words);
        assert!(
            said.contains("mine.toml: x has a law, but is not commissioned: `quadrant commission"),
            "{said}"
        );
    }
    let path = at.join("mine.toml");
    let mut file = SettingsFile::read(&path).unwrap();
    file.stage.axes[0].commissioned = true;
    file.write(&path, whole::write).unwrap();
    let said = command::fail(at, &["compare", "--settings", "mine.toml"]);
    assert!(
        said.contains("x has the law PID and no nonlinear gain")
            && said.contains("`quadrant design npid --axis x --settings mine.toml"),
        "{said}"
    );
}
