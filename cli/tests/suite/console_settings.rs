//! Settings at the console of the simulated machine: every path, with each part that may be left out there and not.

use crate::command;
use std::path::Path;
use std::process::Output;

use quadrant::settings::StageSettings;
use quadrant::settings::tree::is_part;
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
