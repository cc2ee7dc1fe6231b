//! Settings at the console of the simulated machine: every path, with each part that may be left out there and not.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use quadrant::settings::StageSettings;
use quadrant::settings::tree::is_part;
use serde_json::Value;

/// Gives a script to a machine that has just been switched on.
fn session(options: &[&str], script: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_quadrant"))
        .args(["connect", "--simulated"])
        .args(options)
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let script = script.to_owned();
    // The output of a long script fills the pipe before the script is read.
    let writer = std::thread::spawn(move || {
        let _ = input.write_all(script.as_bytes());
    });
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    output
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

/// The paths of all settings with every part, and those of the parts.
fn paths() -> (Vec<String>, Vec<String>) {
    let mut full = StageSettings::simulated();
    let mut parts = Vec::new();
    full.list("", &mut |path| parts.extend(is_part(path).then(|| path.to_owned())))
        .unwrap();
    for part in &parts {
        full.set_json(part, b"\"present\"").unwrap();
    }
    let mut paths = Vec::new();
    full.list("", &mut |path| paths.push(path.to_owned())).unwrap();
    (paths, parts)
}

#[test]
fn every_setting_is_read_and_set_with_every_part_there() {
    let (paths, parts) = paths();
    let made: String = parts.iter().map(|part| format!("set {part} present\n")).collect();
    let gets: String = paths.iter().map(|path| format!("get {path}\n")).collect();
    let read = answers(&format!("{made}{gets}get x/feedforward\nget y/feedforward/cancelling\ndiff\nlist\n"));
    for answer in &read {
        assert!(answer.get("error").is_none(), "{answer}");
    }
    let values = &read[parts.len()..parts.len() + paths.len()];
    let [group, part, diff, list] = &read[parts.len() + paths.len()..] else {
        panic!("too few answers");
    };
    assert!(group["result"].as_object().unwrap().len() > 15, "{group}");
    assert!(part["result"].as_object().unwrap().len() > 5, "{part}");
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
    let (paths, parts) = paths();
    let gone: String = parts.iter().map(|part| format!("set {part} null\n")).collect();
    let gets: String = paths.iter().map(|path| format!("get {path}\n")).collect();
    let sets: String = paths.iter().map(|path| format!("set {path} 1\n")).collect();
    let read = answers(&format!("{gone}{gets}{sets}diff\nget x/feedforward\n"));
    let in_part = |path: &str| {
        let part = parts.iter().find(|part| path.starts_with(&format!("{part}/")));
        part.is_some()
    };
    let (gets, rest) = read[parts.len()..].split_at(paths.len());
    let (sets, last) = rest.split_at(paths.len());
    for ((path, get), set) in paths.iter().zip(gets).zip(sets) {
        if in_part(path) {
            for answer in [get, set] {
                let error = answer["error"].as_str().unwrap();
                assert!(error.contains("\"present\" first"), "{path}: {error}");
            }
        } else {
            assert!(get.get("error").is_none(), "{path}: {get}");
            if parts.contains(path) {
                assert_eq!(get["result"], Value::Null, "{path}");
            }
        }
    }
    for answer in last {
        assert!(answer.get("error").is_none(), "{answer}");
    }
}
