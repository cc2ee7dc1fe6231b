//! Settings at the console of the simulated machine: every path, with each part that may be left out there and not.

use crate::command;
use std::path::Path;
use std::process::Output;

use quadrant_settings::StageSettings;
use quadrant_settings::tree::is_part;
use serde_json::Value;

/// Gives a script to a machine that has just been switched on.
fn session(options: &[&str], script: &str) -> Output {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    command::play(
        root,
        &[&["connect", "--simulated=commissioned"], options].concat(),
        script,
    )
}

fn answers(script: &str) -> Vec<Value> {
    let output = session(&["--json", "--keep-going"], script);
    let said = String::from_utf8(output.stdout).unwrap();
    let answers: Vec<Value> = said
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(answers.len(), script.lines().count(), "{said}");
    answers
}

/// Settings with every part, their paths, and those of the parts.
fn paths() -> (StageSettings, Vec<String>, Vec<String>) {
    let mut full = StageSettings::simulated();
    let mut parts = Vec::new();
    full.list("", &mut |path| {
        parts.extend(is_part(path).then(|| path.to_owned()))
    })
    .unwrap();
    for part in &parts {
        full.set_json(part, b"\"present\"").unwrap();
    }
    let mut paths = Vec::new();
    full.list("", &mut |path| paths.push(path.to_owned()))
        .unwrap();
    (full, paths, parts)
}

#[test]
fn every_setting_is_read_and_set_with_every_part_there() {
    let (_, paths, parts) = paths();
    let made: String = parts
        .iter()
        .map(|part| format!("set {part} present\n"))
        .collect();
    let gets: String = paths.iter().map(|path| format!("get {path}\n")).collect();
    let read = answers(&format!(
        "{made}{gets}get x/feedforward\nget y/feedforward/cancelling\ndiff\nlist\n"
    ));
    for answer in &read {
        assert!(answer.get("error").is_none(), "{answer}");
    }
    let values = &read[parts.len()..parts.len() + paths.len()];
    let [group, part, diff, list] = &read[parts.len() + paths.len()..] else {
        panic!("too few answers");
    };
    assert!(group["result"].as_object().unwrap().len() > 15, "{group}");
    assert_eq!(part["result"], "present");
    assert!(diff["result"].as_array().unwrap().len() > 20, "{diff}");
    assert_eq!(list["result"].as_array().unwrap().len(), paths.len());

    let sets: String = paths
        .iter()
        .zip(values)
        .map(|(path, value)| format!("set {path} '{}'\n", value["result"]))
        .collect();
    let again = answers(&format!("{made}{sets}{gets}"));
    for answer in &again {
        assert!(answer.get("error").is_none(), "{answer}");
    }
    assert_eq!(&again[parts.len() + paths.len()..], values);
}

#[test]
fn a_setting_in_a_part_that_is_left_out_says_so_and_every_other_is_read() {
    let (full, paths, parts) = paths();
    let in_part = |path: &&String| {
        let mut parts = parts.iter();
        parts.any(|part| path.starts_with(&format!("{part}/")))
    };
    let (members, others): (Vec<&String>, Vec<&String>) = paths.iter().partition(in_part);
    let gone: String = parts
        .iter()
        .map(|part| format!("set {part} null\n"))
        .collect();
    let mut script = gone;
    for path in &members {
        let mut json = [0; 2048];
        let length = full.get_json(path, &mut json).unwrap();
        let value = String::from_utf8_lossy(&json[..length]).into_owned();
        script.push_str(&format!("get {path}\nset {path} '{value}'\n"));
    }
    for path in &others {
        script.push_str(&format!("get {path}\n"));
    }
    let read = answers(&format!("{script}diff\nget x/feedforward\n"));
    let (of_members, of_others) = read[parts.len()..].split_at(2 * members.len());
    for (path, answers) in members.iter().zip(of_members.chunks(2)) {
        for answer in answers {
            let error = answer["error"].as_str().unwrap();
            assert!(error.contains("\"present\" first"), "{path}: {error}");
        }
    }
    for (path, answer) in others.iter().zip(of_others) {
        assert!(answer.get("error").is_none(), "{path}: {answer}");
        if parts.contains(path) {
            assert_eq!(answer["result"], Value::Null, "{path}");
        }
    }
    for answer in &of_others[others.len()..] {
        assert!(answer.get("error").is_none(), "{answer}");
    }
}

#[test]
fn a_path_has_one_spelling_and_one_that_there_is_not_names_the_one_that_is_meant() {
    let script = "list\nget x/feedback\nset x/feedback/pid/kp_v_per_mm 0.9\ndiff\nrevert\n\
                  load host-sim/data/identified-stage.toml\nset y/homing present\nset y/homing/search_mm_s -1\napply\n\
                  get y/feedback/law/none\nset x/feedback/pid/kp 1\nlist x/feedforwad\n";
    let output = session(&["--keep-going"], script);
    let [printed, errors] =
        [output.stdout, output.stderr].map(|said| String::from_utf8(said).unwrap());
    for said in [&printed, &errors] {
        assert!(!said.contains("/axes/"), "{said}");
    }
    for part in [
        "x/feedback/law \"n-pid\"",
        "x/feedback/pid/kp_v_per_mm 1.",
        "rate_hz\n",
    ] {
        assert!(printed.contains(part), "{printed}");
    }
    for part in [
        "y/homing/search_mm_s = -1 is outside",
        "did you mean y/feedback/law?",
        "did you mean x/feedback/pid/kp_v_per_mm?",
        "did you mean x/feedforward",
    ] {
        assert!(errors.contains(part), "{part}: {errors}");
    }
}

#[test]
fn settings_of_a_law_that_is_off_bar_no_limit() {
    let load = "load host-sim/data/identified-stage.toml\n";
    let limit = "set x/amplifier/output_limit_v 0.3\napply\n";
    let output = session(&[], &format!("{load}{limit}"));
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    // In force, they do.
    let output = session(
        &[],
        &format!("{load}set x/feedback/law sliding-mode\n{limit}"),
    );
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(
        errors.contains("x/feedback/sliding_mode/switching_v = 1"),
        "{errors}"
    );
}

/// Settings that are commissioned.
const STAGE: &str = "host-sim/data/identified-stage.toml";

fn result(answer: &Value) -> &Value {
    assert!(answer["error"].is_null(), "{answer}");
    &answer["result"]
}

#[test]
fn what_was_applied_is_undone_step_by_step() {
    let read = answers(&format!(
        "load {STAGE}\nset x/feedback/pid/kp_v_per_mm 0.9\napply\n\
         set x/homing null\nset y/feedforward/learning present\napply\n\
         undo\nget x/homing\nget y/feedforward/learning\nget x/feedback/pid/kp_v_per_mm\nlist x/homing\n\
         undo\nget x/feedback/pid/kp_v_per_mm\ndiff\ndiff {STAGE}\nundo\nundo\n"
    ));
    for answer in &read[..read.len() - 1] {
        result(answer);
    }
    assert_eq!(read[7]["result"], "present");
    assert_eq!(read[8]["result"], Value::Null);
    assert_eq!(read[9]["result"], 0.9);
    assert!(read[10]["result"].as_array().unwrap().len() > 1);
    assert_ne!(read[12]["result"], 0.9);
    assert_eq!(
        read[13]["result"],
        serde_json::json!([]),
        "the draft equals the settings in force"
    );
    assert_eq!(
        read[14]["result"],
        serde_json::json!([]),
        "the file acts again"
    );
    let refused = read.last().unwrap()["error"].as_str().unwrap();
    assert!(refused.contains("nothing that is not undone"), "{refused}");
}

#[test]
fn every_command_after_an_apply_finds_it_in_force() {
    let change = |gain: &str| {
        format!(
            "set x/feedback/pid/kp_v_per_mm {gain}\nset z/feedback/pid/kp_v_per_mm {gain}\napply\n"
        )
    };
    let script = format!(
        "load {STAGE}\nenable\n{}{}apply\njog x 1\n{}jog x 0\nwait rest\n{}disable\n{}store\n{}events\n",
        change("0.9"),
        change("1.0"),
        change("1.1"),
        change("0.9"),
        change("1.0"),
        change("1.1"),
    );
    let output = session(&[], &script);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let said = String::from_utf8(output.stdout).unwrap();
    // The file's, and one for each change.
    assert_eq!(said.matches("settings act").count(), 7, "{said}");
}

#[test]
fn outputs_are_enabled_after_the_restart_that_a_script_has_asked_for() {
    let read = answers(&format!(
        "load {STAGE}\nstore\nenable\ndisable\nreboot\nenable\nstatus\n"
    ));
    for answer in &read {
        result(answer);
    }
    assert_eq!(read[6]["result"]["state"], "enabled");
}

#[test]
fn the_origin_of_stored_settings_names_the_file_and_the_edits() {
    let read = answers(&format!(
        "load {STAGE}\nstore\nprovenance\nset x/feedback/pid/kp_v_per_mm 0.9\napply\nstore\nprovenance\n\
         reboot\nset x/feedback/pid/kp_v_per_mm 0.8\napply\nstore\nprovenance\nstore 'by hand'\nprovenance\n"
    ));
    let at = |index: usize| result(&read[index]).as_str().unwrap().to_owned();
    let (loaded, edited, again) = (at(2), at(6), at(11));
    assert!(
        loaded.starts_with("identified-stage.toml (quadrant commission"),
        "{loaded}"
    );
    assert!(!loaded.contains("edited"), "{loaded}");
    let by = edited.strip_prefix(&loaded);
    assert!(
        by.is_some_and(|by| by.starts_with("; edited by quadrant connect")),
        "{edited}"
    );
    assert_eq!(again, edited, "once is enough");
    assert_eq!(at(13), "by hand");
}

#[test]
fn a_law_that_is_off_bars_no_limit() {
    let read = answers(
        "get x/feedback/law\nget x/feedback/sliding_mode/switching_v\nset x/amplifier/output_limit_v 0.3\napply\n\
         set x/feedback/law sliding-mode\napply\n",
    );
    assert_ne!(result(&read[0]), "sliding-mode");
    assert!(result(&read[1]).as_f64().unwrap() > 0.3);
    result(&read[3]);
    let refused = read[5]["error"].as_str().unwrap();
    assert!(refused.contains("switching_v"), "{refused}");
}

#[test]
fn no_zero_has_a_sign() {
    let output = session(&[], "status\n");
    let said = String::from_utf8(output.stdout).unwrap();
    for word in said.split_whitespace() {
        let digits = word.strip_prefix('-').unwrap_or("1");
        assert!(
            digits.chars().any(|sign| sign != '0' && sign != '.'),
            "{word}: {said}"
        );
    }
}

#[test]
fn a_part_that_may_be_left_out_is_shown_with_what_is_in_it() {
    let output = session(&[], "get x/homing\n");
    let shown = String::from_utf8(output.stdout).unwrap();
    assert!(shown.contains("x/homing \"present\""), "{shown}");
    assert!(shown.contains("x/homing/latch_mm_s 2"), "{shown}");
}
