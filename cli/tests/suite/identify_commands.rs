//! The commands `quadrant identify frf`, `plant` and `motion`, from end to end.

use std::fs;
use std::path::Path;

use quadrant_settings::StageSettings;
use quadrant_sim::settings_file::SettingsFile;
use quadrant_sim::stage_setup::StageSetup;
use quadrant_tune::identify::response::FrequencyResponse;
use quadrant_written::whole;

use crate::command;

fn succeed(folder: &Path, arguments: &[&str]) -> String {
    command::succeed(folder, &[&["identify"], arguments].concat())
}

fn fail(folder: &Path, arguments: &[&str]) -> String {
    command::fail(folder, &[&["identify"], arguments].concat())
}

/// The value of a parameter in a table's CSV file.
fn value(path: &Path, parameter: &str) -> f64 {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let row = reader
        .records()
        .map(Result::unwrap)
        .find(|row| &row[0] == parameter)
        .unwrap();
    row[2].parse().unwrap()
}

#[test]
fn a_measured_response_its_recordings_and_its_model_agree() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shown = succeed(
        at,
        &["frf", "--axis", "y", "--out", "measured", "--seed", "3"],
    );
    assert!(shown.contains("Simulated, not measured"), "{shown}");
    succeed(
        at,
        &["plant", "--frf", "measured/frf.csv", "--out", "measured"],
    );
    let gain = value(&at.join("measured/linear-model.csv"), "A");
    assert!((gain / 61_200.0 - 1.0).abs() < 2e-3, "{gain}");

    let recordings: Vec<String> = (1..)
        .map(|index| format!("measured/frf-recording-{index}.csv"))
        .take_while(|name| at.join(name).exists())
        .collect();
    assert!(recordings.len() > 1);
    let mut arguments = vec!["frf", "--out", "saved", "--record"];
    arguments.extend(recordings.iter().map(String::as_str));
    succeed(at, &arguments);
    let read = |name: &str| FrequencyResponse::read_csv(&at.join(name)).unwrap();
    let (measured, saved) = (read("measured/frf.csv"), read("saved/frf.csv"));
    assert_eq!(measured.points.len(), saved.points.len());
    for (a, b) in measured.points.iter().zip(&saved.points) {
        let apart = (a.response / b.response - 1.0).norm();
        assert!(
            apart < 1e-6 + 5.0 * a.relative_deviation,
            "{} Hz",
            a.frequency_hz
        );
    }
    for page in ["measured/frf.html", "measured/plant.html", "saved/frf.html"] {
        assert!(at.join(page).exists(), "{page}");
    }
}

#[test]
fn what_cannot_be_measured_or_fitted_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let band = ["plant", "--axis", "x", "--from-hz", "150"];
    assert!(fail(at, &band).contains("misses the corner"));
    let narrow = ["--axis", "x", "--from-hz", "4.1", "--to-hz", "4.2"];
    for step in ["frf", "plant", "revise"] {
        let words: Vec<&str> = [step].into_iter().chain(narrow).collect();
        let said = fail(at, &words);
        for part in ["4.1", "4.2", "every 2 Hz"] {
            assert!(said.contains(part), "{step}: {said}");
        }
    }
    let strong = ["frf", "--axis", "x", "--amplitude-v", "0.6"];
    assert!(fail(at, &strong).contains("lower its amplitude"));
    assert!(fail(at, &["frf"]).contains("--axis"));
    let missing = fail(at, &["frf", "--record", "none.csv"]);
    assert!(missing.contains("none.csv"), "{missing}");
    std::fs::write(at.join("short.csv"), "t_s,position_mm\n0,0\n").unwrap();
    let column = fail(at, &["frf", "--record", "short.csv"]);
    assert!(column.contains("no column voltage_v"), "{column}");
}

/// The text of a file in the folder.
fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn what_was_measured_is_identified_again_from_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (step, measure, file, table) in [
        (
            "motor-constant",
            "--moving-mass-kg=12",
            "motor-constant-recording.csv",
            "motor-constant.csv",
        ),
        (
            "static-friction",
            "--from-mm-s=0.4",
            "friction-map.csv",
            "static-friction.csv",
        ),
        (
            "virgin-curve",
            "--frequency-hz=0.2",
            "virgin-curve-recording.csv",
            "slip-blocks.csv",
        ),
    ] {
        let measured = succeed(at, &[step, "--axis", "z", measure, "--out", step]);
        assert!(measured.contains("Simulated, not measured"), "{measured}");
        let record = format!("{step}/{file}");
        let mass = "--moving-mass-kg=12";
        let mut arguments = vec![step, "--record", &record, "--out", "again"];
        let into = format!("{step}.toml");
        arguments.extend(["--axis", "z", "--into", &into]);
        if step == "motor-constant" {
            arguments.push(mass);
        }
        let again = succeed(at, &arguments);
        assert!(!again.contains("Simulated"), "{again}");
        let page = format!("{step}.html");
        assert!(at.join(step).join(&page).exists() && at.join("again").join(&page).exists());
        assert_same(
            &text(at, &format!("{step}/{table}")),
            &text(at, &format!("again/{table}")),
        );
    }
    let written = |step: &str, set: &str| {
        let file = SettingsFile::read(&at.join(format!("{step}.toml"))).unwrap();
        assert_eq!(file.provenance[0].sets, [set]);
        // Nothing is known of the other axes: they have no law.
        let other = &file.stage.axes[1];
        assert!(!other.commissioned && other.feedback.pid.kp_v_per_mm == 0.0);
        file.stage.axes[2].clone()
    };
    let z = &StageSettings::simulated().axes[2];
    assert_ne!(
        written("static-friction", "friction").friction.sliding,
        z.friction.sliding
    );
    assert_ne!(
        written("virgin-curve", "friction").friction.gms,
        z.friction.gms
    );
    // A slow PID in place of the default one, and no model before one is identified.
    let first = written("motor-constant", "first PID");
    let kp = first.feedback.pid.kp_v_per_mm;
    assert!(kp > 0.0 && kp < z.feedback.pid.kp_v_per_mm, "{kp}");
    assert_eq!(first.plant, None);
}

#[test]
fn a_step_is_the_same_on_a_machine_and_in_the_console() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shown = succeed(
        at,
        &[
            "motor-constant",
            "--machine",
            "simulated",
            "--axis",
            "y",
            "--into",
            "stage.toml",
            "--out",
            "a",
        ],
    );
    assert!(shown.contains("Simulated, not measured"), "{shown}");
    let connect = "connect --simulated identify motor-constant y --out b.csv";
    let words: Vec<&str> = connect.split(' ').collect();
    let console = command::succeed(at, &words);
    assert!(console.contains("Motor constant"), "{console}");
    // Another session, so other noise, by which the search for the level ends at another one; what is found is the same.
    let gain = |shown: &str| -> f64 {
        let mut row = shown.lines().skip_while(|line| !line.contains("Level"));
        let row = row.nth(3).expect("a row of the table");
        let gain = row.split_whitespace().nth(1).expect("A");
        gain.parse().expect("a number")
    };
    let ratio = gain(&shown) / gain(&console);
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    let dumped = SettingsFile::read(&at.join("stage.toml")).unwrap();
    let fresh = StageSetup::simulated().settings;
    assert_eq!(dumped.stage.axes[0], fresh.axes[0]);
}

/// The sentences about a model.
fn sentences(said: &str) -> Vec<&str> {
    let is_one = |line: &&str| line.starts_with("Plant: ") || line.starts_with("The model ");
    said.lines().filter(is_one).collect()
}

#[test]
fn the_console_says_of_a_motion_what_the_shell_says_of_its_recording() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let connect = "connect --simulated=commissioned identify motion x --out a.csv";
    let words: Vec<&str> = connect.split(' ').collect();
    let (console, console_warned) = command::output(at, &words);
    let words = ["identify", "motion", "--record", "a.csv"];
    let (shell, shell_warned) = command::output(at, &words);
    assert!(!sentences(&shell).is_empty(), "{shell}");
    assert_eq!(sentences(&console), sentences(&shell));
    let warnings = |said: &str| -> Vec<String> {
        let is_one = |line: &&str| line.starts_with("warning: ");
        said.lines().filter(is_one).map(str::to_owned).collect()
    };
    assert_eq!(warnings(&console_warned), warnings(&shell_warned));
}

#[test]
fn a_machine_that_cannot_be_measured_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (arguments, part) in [
        ("plant --axis x --machine board", "serial:PORT"),
        ("plant --axis x --machine serial:/dev/none", "dialout"),
        ("frf --axis x --machine simulated", "--travel"),
        ("frf --record a.csv --machine simulated", "--machine"),
        ("plant --record a.csv --into stage.toml", "--axis"),
    ] {
        let words: Vec<&str> = arguments.split(' ').collect();
        let said = fail(at, &words);
        assert!(said.contains(part), "{arguments}: {said}");
    }
}

/// Two tables whose numbers agree to a millionth: a recording's clock is read back with its digits' rounding.
fn assert_same(one: &str, other: &str) {
    let cells = |text: &str| -> Vec<String> {
        let cells = text.split([',', '\n']);
        cells.map(str::to_owned).collect()
    };
    let (one, other) = (cells(one), cells(other));
    assert_eq!(one.len(), other.len());
    for (a, b) in one.iter().zip(&other) {
        match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(a), Ok(b)) => assert!((a - b).abs() <= 1e-6 * a.abs(), "{a} and {b}"),
            _ => assert_eq!(a, b),
        }
    }
}

#[test]
fn a_motion_record_is_saved_read_again_and_put_into_settings() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let fresh = succeed(
        at,
        &[
            "motion",
            "--axis",
            "z",
            "--dead-time-s",
            "0.00135",
            "--out",
            "a",
        ],
    );
    assert!(fresh.contains("Simulated, not measured"), "{fresh}");
    let file = SettingsFile::new(StageSettings::simulated());
    file.write(&at.join("stage.toml"), whole::write).unwrap();
    succeed(
        at,
        &[
            "motion",
            "--record",
            "a/motion-recording.csv",
            "--dead-time-s",
            "0.00135",
            "--force-per-volt",
            "35",
            "--settings",
            "stage.toml",
            "--axis",
            "z",
            "--out",
            "b",
            "--into",
            "b/settings.toml",
        ],
    );
    let inertia = |folder: &str| value(&at.join(folder).join("motion-parameters.csv"), "M'");
    assert!((inertia("a") / inertia("b") - 1.0).abs() < 1e-6);
    let written = SettingsFile::read(&at.join("b/settings.toml")).unwrap();
    let gain = written.stage.axes[2].plant.unwrap().gain_mm_per_v_s2;
    assert!((gain / 48_500.0 - 1.0).abs() < 0.03, "{gain}");
    assert_eq!(written.provenance[0].records, ["a/motion-recording.csv"]);
    let cascade = ["motion", "--axis", "x", "--cascade-kp", "160"];
    assert!(fail(at, &cascade).contains("--cascade-kv"));
}

/// A record of z, in the folder `rec`.
fn record_z(at: &Path) {
    let words = ["motion", "--axis", "z", "--rounds", "1", "--out", "rec"];
    succeed(at, &words);
}

const RECORD: &str = "rec/motion-recording.csv";

#[test]
fn what_is_identified_goes_into_settings_that_have_no_law_yet_and_brings_none() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_z(at);
    let words = "new mine/z.toml --axis z --count-um 0.5 --amplifier analog-10v --max-velocity 200 --max-acceleration 2000 --travel 100";
    command::succeed(at, &words.split(' ').collect::<Vec<_>>());
    for into in ["mine/z.toml", "of-nothing.toml"] {
        let words = ["motion", "--axis", "z", "--record", RECORD, "--into", into];
        succeed(at, &words);
        let stage = SettingsFile::read(&at.join(into)).unwrap().stage;
        let gain = stage.axes[2].plant.unwrap().gain_mm_per_v_s2;
        assert!((gain / 48_500.0 - 1.0).abs() < 0.1, "{gain}");
        assert!(stage.axes[2].friction.sliding.positive.curve.coulomb_v > 0.0);
        assert_eq!(stage.uncommissioned(), None, "{into}");
        for axis in &stage.axes {
            assert_eq!(axis.feedback.pid.kp_v_per_mm, 0.0, "{into}");
        }
    }
}

#[test]
fn the_plant_is_printed_though_no_settings_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_z(at);
    let said = succeed(at, &["motion", "--record", RECORD, "--out", "out"]);
    let line = said
        .lines()
        .find(|line| line.starts_with("Plant: gain "))
        .unwrap();
    let inertia = value(&at.join("out/motion-parameters.csv"), "M'");
    let gain: f64 = line.split(' ').nth(2).unwrap().parse().unwrap();
    assert!((gain * inertia - 1.0).abs() < 1e-3, "{line}");
}

/// An axis without a counterweight creeps while its outputs are off between the moves.
#[test]
fn the_motion_that_is_recorded_of_any_axis_is_read_again() {
    for axis in ["x", "y"] {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        let words = ["motion", "--axis", axis, "--rounds", "1", "--out", "a"];
        succeed(at, &words);
        let words = ["motion", "--record", "a/motion-recording.csv", "--out", "b"];
        succeed(at, &words);
    }
}

/// The share of the voltage that the last line says is explained, %.
fn explained_percent(said: &str) -> f64 {
    let line = said.lines().last().unwrap();
    let (_, share) = line.split_once("explains ").unwrap();
    share.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn the_last_line_says_what_the_model_explains_of_the_record_that_judges_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let measured = |out: &str, seed: &str| {
        let words = [
            "motion", "--axis", "z", "--rounds", "1", "--seed", seed, "--out", out,
        ];
        succeed(at, &words)
    };
    measured("one", "1");
    measured("two", "2");
    let record = ["motion", "--record", "one/motion-recording.csv"];
    let alone = explained_percent(&succeed(at, &[&record[..], &["--out", "alone"]].concat()));
    let judged = |other: &str, out: &str| {
        let more = ["--validate", other, "--out", out];
        succeed(at, &[&record[..], &more].concat())
    };
    let same = explained_percent(&judged("two/motion-recording.csv", "same"));
    // The other record with half as much voltage again: what is missing is no share of what is explained.
    let text = fs::read_to_string(at.join("two/motion-recording.csv")).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let voltage = header
        .split(',')
        .position(|name| name == "voltage_v")
        .unwrap();
    let mut louder = format!("{header}\n");
    for line in lines {
        let cells: Vec<String> = (line.split(',').enumerate())
            .map(|(index, cell)| match index == voltage {
                true => (1.1 * cell.parse::<f64>().unwrap()).to_string(),
                false => cell.to_owned(),
            })
            .collect();
        louder += &cells.join(",");
        louder.push('\n');
    }
    fs::write(at.join("louder.csv"), louder).unwrap();
    let louder = explained_percent(&judged("louder.csv", "louder"));
    println!("{alone} % alone, {same} % of another, {louder} % of a louder one");
    assert!(alone > 90.0 && (alone - same).abs() < 3.0, "{alone} {same}");
    // A tenth of the voltage, 1/11 of what there is, is not explained.
    assert!(louder < same - 1.0, "{louder} {same}");
}
