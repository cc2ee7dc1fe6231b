//! `quadrant connect` on the simulated machine: whole sessions, through the command alone.

use std::path::Path;
use std::process::Output;

use quadrant_sim::settings_file::SettingsFile;
use quadrant_tune::record::{AxisLimits, Record};
use serde_json::{Value, json};

use crate::command;

const LIMITS: AxisLimits = AxisLimits {
    travel_mm: 410.0,
    max_velocity_mm_s: 250.0,
    max_acceleration_mm_s2: 1e5,
    resolution_mm: 0.0005,
};

/// Gives a script to a machine with settings that suit it.
fn session(folder: &Path, options: &[&str], script: &str) -> Output {
    command::play(
        folder,
        &[&["connect", "--simulated=commissioned"], options].concat(),
        script,
    )
}

/// Returns the output of a session that must succeed.
fn succeeds(folder: &Path, options: &[&str], script: &str) -> String {
    let output = session(folder, options, script);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{errors}\n{said}");
    said
}

fn results(said: &str) -> Vec<Value> {
    said.lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("no JSON: {line}")))
        .collect()
}

#[test]
fn a_circle_is_homed_run_and_recorded_for_the_other_commands() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(
        folder.path(),
        &["--json"],
        "enable\nhome\nwait homed\nstatus\n\
         circle --radius-mm 10 --feed-mm-min 1200 --turns 1\n\
         record --channels x.reference,x.position,x.output,y.reference,y.position,y.output --out run.csv -- run\n\
         wait rest\nstatus\n",
    );
    let results = results(&said);
    let status = &results[3]["result"];
    assert_eq!(status["state"], "enabled");
    assert_eq!(status["homed"], json!(["x", "y", "z"]));
    assert!(status["frames"]["good"].as_u64().unwrap() > 3, "{status}");
    for axis in status["axes"].as_array().unwrap() {
        assert!(axis["position_mm"].as_f64().unwrap().abs() < 0.01, "{axis}");
    }
    let recorded = results
        .iter()
        .find(|line| line["command"] == "record")
        .unwrap();
    assert_eq!(recorded["result"]["lost"], 0);
    for axis in ["x", "y"] {
        let record = Record::read(&folder.path().join(format!("run-{axis}.csv")), &LIMITS).unwrap();
        let fold =
            |of: fn(f64, f64) -> f64, from| record.reference_mm.iter().copied().fold(from, of);
        let (low, high) = (fold(f64::min, f64::MAX), fold(f64::max, f64::MIN));
        // The lead-in begins before the turn does, so only the diameter is known.
        assert!((high - low - 20.0).abs() < 0.01, "{axis}: {low} {high}");
        let position = record.position_mm.unwrap();
        let errors = record.reference_mm.iter().zip(&position);
        assert!(errors.map(|(r, y)| (r - y).abs()).all(|error| error < 0.1));
    }
}

#[test]
fn the_same_session_is_the_same_to_the_last_byte() {
    let script = "enable\nhome x\nwait homed x\nrecord --out a.csv --seconds 0.3 -- move x 1\nwait rest\nstatus\nevents\n";
    let [one, other] = [0, 1].map(|_| {
        let folder = tempfile::tempdir().unwrap();
        let said = succeeds(folder.path(), &["--seed", "3"], script);
        (said, std::fs::read(folder.path().join("a.csv")).unwrap())
    });
    assert_eq!(one, other);
    // What happened before and while it was recorded is reported all the same.
    for event in ["outputs on", "motion begins", "motion ends"] {
        assert!(one.0.contains(event), "{event}: {}", one.0);
    }
}

#[test]
fn settings_go_out_and_in_and_survive_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(
        folder.path(),
        &[],
        "dump before.toml\n\
         set x/feedback/pid/kp_v_per_mm 0.9\nset x/homing null\napply\ndump changed.toml\n\
         store 'a test'\nreboot\nwait 0.1\nprovenance\ndump kept.toml\n\
         load before.toml\ndump after.toml\n",
    );
    let read = |name| SettingsFile::read(&folder.path().join(name)).unwrap().stage;
    let (before, changed) = (read("before.toml"), read("changed.toml"));
    assert_eq!(changed.axes[0].feedback.pid.kp_v_per_mm, 0.9);
    assert_eq!(changed.axes[0].homing, None);
    assert_eq!(changed.axes[1], before.axes[1]);
    assert_eq!(read("kept.toml"), changed);
    assert_eq!(read("after.toml"), before);
}

#[test]
fn commissioned_settings_are_loaded_whole() {
    let folder = tempfile::tempdir().unwrap();
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../host-sim/data/identified-stage.toml"
    );
    succeeds(
        folder.path(),
        &[],
        &format!("load {file}\ndump loaded.toml\nenable\njog y 2\nwait 0.5\nstop\nwait rest\n"),
    );
    let loaded = SettingsFile::read(&folder.path().join("loaded.toml")).unwrap();
    assert_eq!(
        loaded.stage,
        SettingsFile::read(file.as_ref()).unwrap().stage
    );
}

#[test]
fn a_gain_is_changed_while_the_axis_moves() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(
        folder.path(),
        &["--json"],
        "enable\nset x/feedback/pid/kp_v_per_mm 1.2\n\
         circle --radius-mm 5 --feed-mm-min 600 --turns 1\nrun\nwait 0.5\n\
         record --every 2 --channels x.error,x.output --seconds 0.5 --out change.csv -- apply\nwait rest\nfault\n",
    );
    assert!(results(&said).last().unwrap()["result"].is_null());
    let text = std::fs::read_to_string(folder.path().join("change.csv")).unwrap();
    let volts: Vec<f64> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(2).unwrap().parse().unwrap())
        .collect();
    // Bumpless: no step beyond what noise and friction make from one sample to the next.
    let largest = volts
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .fold(0.0, f64::max);
    assert!(largest < 0.5, "{largest} V");
}

#[test]
fn a_part_program_is_followed_and_ends_where_it_says() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("part.ngc"),
        "G21 G90 G17 G94\nF900\nG1 X10\nG3 X10 Y8 J4\nG1 X2 Y8 Z1.5\nM2\n",
    )
    .unwrap();
    let said = succeeds(
        folder.path(),
        &["--json"],
        "enable\nhome\nwait homed\nmove x 1\nwait rest\nstream part.ngc\nstatus\nfault\n",
    );
    let results = results(&said);
    let status = &results[6]["result"];
    for (axis, target_mm) in [(0, 3.0), (1, 8.0), (2, 1.5)] {
        let reached = status["axes"][axis]["position_mm"].as_f64().unwrap();
        assert!((reached - target_mm).abs() < 0.01, "{axis}: {reached}");
    }
    assert!(results[7]["result"].is_null());
}

#[test]
fn a_capture_shows_every_tick_about_its_trigger() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(
        folder.path(),
        &["--json"],
        "enable\ncapture arm --channels stage.tick,x.error --on motion --pre-trigger 50\nwait 0.2\njog x 1\n\
         capture read --out trace.csv\n",
    );
    let results = results(&said);
    let read = &results.last().unwrap()["result"];
    let record = &read["record"];
    assert_eq!(record["cause"], "motion-start");
    assert_eq!(read["samples"], 1024);
    let text = std::fs::read_to_string(folder.path().join("trace.csv")).unwrap();
    let ticks: Vec<u64> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(1).unwrap().parse().unwrap())
        .collect();
    assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1));
    let trigger = record["trigger_sample"].as_u64().unwrap() as usize;
    assert_eq!(ticks[trigger], record["trigger_tick"].as_u64().unwrap());
}

#[test]
fn a_fault_ends_the_session_and_leaves_its_trace() {
    let folder = tempfile::tempdir().unwrap();
    // A tracking error of one count is a fault as soon as the axis moves.
    let script = "set x/limits/following_error_mm 0.0006\nset x/limits/following_error_max_mm 0.0006\n\
                  set x/limits/following_error_lag_s 0\napply\nenable\njog x 5\nwait rest\nstatus\n";
    let output = session(folder.path(), &[], script);
    assert_eq!(output.status.code(), Some(1));
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(
        errors.contains("line 7") && errors.contains("fault 1"),
        "{errors}"
    );
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(!said.contains("at rest"), "the session went on: {said}");
    let script = format!("{script}fault\ncapture read --out trace.csv\nreset\nenable\nfault\n");
    let output = session(folder.path(), &["--json", "--keep-going"], &script);
    assert_eq!(output.status.code(), Some(1));
    let results = results(&String::from_utf8(output.stdout).unwrap());
    let fault = results
        .iter()
        .find(|line| line["command"] == "fault")
        .unwrap();
    assert_eq!(fault["result"]["code"], 1);
    assert_eq!(fault["result"]["captured"], true);
    assert!(results.last().unwrap()["result"].is_null());
    assert!(folder.path().join("trace-x.csv").is_file());
}

#[test]
fn errors_name_the_line_the_value_and_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    for (script, parts) in [
        ("\n# nothing\nmove x 1\n", ["line 3", "enable"]),
        ("fly\n", ["line 1", "fly"]),
        ("get x/nonsense\n", ["line 1", "`list`"]),
        (
            "enable\nhome x\nwait homed x\nmove x 500\n",
            ["line 4", "500"],
        ),
        ("wait until\n", ["line 1", "`rest`"]),
        ("load missing.toml\n", ["line 1", "missing.toml"]),
        (
            "capture read --out a.csv --timeout 0.1\n",
            ["line 1", "`capture arm`"],
        ),
    ] {
        let output = session(folder.path(), &[], script);
        assert_eq!(output.status.code(), Some(1), "{script}");
        let errors = String::from_utf8(output.stderr).unwrap();
        for part in parts {
            assert!(errors.contains(part), "{script}: {part}: {errors}");
        }
    }
}

#[test]
fn an_axis_of_unknown_travel_is_not_excited() {
    let folder = tempfile::tempdir().unwrap();
    for script in [
        "identify plant x --out a.csv\n",
        "commission --axis x --out x\n",
    ] {
        let output = session(folder.path(), &[], script);
        assert!(!output.status.success());
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(errors.contains("--travel"), "{errors}");
    }
}

#[test]
fn what_is_edited_and_does_not_act_yet_is_shown_and_what_a_file_would_change() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(
        folder.path(),
        &["--json"],
        "diff\nset x/feedback/pid/kp_v_per_mm 1.0\ndiff\ndump draft.toml\nrevert\ndiff\ndiff draft.toml\nload draft.toml\ndiff draft.toml\n",
    );
    let results: Vec<serde_json::Value> = said
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap())
        .filter(|line| line["command"] == "diff")
        .map(|line| line["result"].clone())
        .collect();
    let [at_first, edited, reverted, file, loaded] = &results[..] else {
        panic!("{said}");
    };
    for nothing in [at_first, reverted, loaded] {
        assert_eq!(nothing, &serde_json::json!([]));
    }
    assert_eq!(edited.as_array().map(Vec::len), Some(1), "{edited}");
    let only = &edited[0];
    assert_eq!(only["path"], "x/feedback/pid/kp_v_per_mm");
    assert_eq!(only["other"], 1.0);
    assert_eq!(only["acting"], 1.118);
    assert_eq!(file, edited);
}

#[test]
fn a_test_that_would_write_over_an_edited_draft_is_refused_and_the_draft_stays() {
    let folder = tempfile::tempdir().unwrap();
    let script =
        "set y/feedback/pid/kp_v_per_mm 0.5\nidentify motor-constant x --out a.csv\ndiff\n";
    let output = session(folder.path(), &["--json", "--keep-going"], script);
    assert_eq!(output.status.code(), Some(1));
    let results = results(&String::from_utf8(output.stdout).unwrap());
    let refused = results[1]["error"].to_string();
    assert!(
        refused.contains("y/feedback/pid/kp_v_per_mm") && refused.contains("`revert`"),
        "{refused}"
    );
    assert_eq!(results[2]["result"][0]["other"], 0.5, "{results:?}");
}

#[test]
fn what_is_recorded_has_the_unit_that_acts() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(
        folder.path(),
        &[],
        "enable\nhome x\nwait homed x\nmove x 10\nwait rest\nset x/encoder/resolution_mm 0.001\napply\n\
         record --channels x.position --out at.csv --seconds 0.1\n",
    );
    let text = std::fs::read_to_string(folder.path().join("at.csv")).unwrap();
    let last = text.lines().last().unwrap();
    assert!(
        last.split(',')
            .any(|cell| cell.starts_with("10.0") || cell.starts_with("9.99")),
        "{last}"
    );
}

#[test]
fn a_motion_that_a_fault_ends_fails_though_nothing_waits_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let script = "set x/limits/following_error_mm 0.0006\nset x/limits/following_error_max_mm 0.0006\n\
                  set x/limits/following_error_lag_s 0\napply\nenable\n\
                  circle --radius-mm 5 --feed-mm-min 600 --turns 1\nrun\n";
    let output = session(folder.path(), &[], script);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.contains("the motion: fault 1"), "{errors}");
}

#[test]
fn a_scope_of_several_units_has_a_chart_for_each() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(
        folder.path(),
        &[],
        "enable\njog x 5\nscope x.error,x.output,y.error --seconds 0.2 --svg scope.svg\nstop\n",
    );
    let svg = std::fs::read_to_string(folder.path().join("scope.svg")).unwrap();
    // One around the charts of mm and of V.
    assert_eq!(svg.matches("<svg").count(), 3);
    for text in ["x.error", "x.output", "y.error", "\nmm\n", "\nV\n"] {
        assert!(svg.contains(text), "{text}");
    }
}

#[test]
fn a_scope_draws_and_keeps_what_it_drew() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(
        folder.path(),
        &[],
        "enable\njog x 5\nscope x.error,y.error --seconds 0.5 --svg scope.svg --csv scope.csv\nstop\n",
    );
    assert!(said.contains("x.error, mm"), "{said}");
    let braille = |c: char| ('\u{2801}'..='\u{28ff}').contains(&c);
    assert!(said.contains(braille), "{said}");
    let widest = said.lines().map(|line| line.chars().count()).max();
    assert!(widest <= Some(80), "{said}");
    let svg = std::fs::read_to_string(folder.path().join("scope.svg")).unwrap();
    assert!(svg.contains("<svg") && svg.contains("x.error"));
    assert!(folder.path().join("scope-x.csv").is_file());
}

#[test]
fn one_command_needs_no_script_and_no_place_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let said = command::succeed(folder.path(), &["connect", "--simulated", "hello"]);
    assert!(
        said.contains("simulated") && said.contains("10000 Hz"),
        "{said}"
    );
    let errors = command::fail(folder.path(), &["connect", "status"]);
    assert!(
        errors.contains("--port") && errors.contains("--simulated"),
        "{errors}"
    );
    let errors = command::fail(folder.path(), &["connect", "--port", "/dev/none", "status"]);
    assert!(
        errors.contains("/dev/none") && errors.contains("dialout"),
        "{errors}"
    );
    let errors = command::fail(folder.path(), &["connect", "flash", "missing.elf"]);
    assert!(errors.contains("missing.elf"), "{errors}");
}

#[test]
fn every_shell_gets_its_completions() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let said = command::succeed(folder.path(), &["completions", shell]);
        assert!(
            said.contains("connect") && said.contains("velocity"),
            "{shell}"
        );
    }
}

#[test]
fn inputs_are_pressed_and_the_supply_is_cut() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(
        folder.path(),
        &["--json"],
        "press emergency-stop x.positive-limit\nwait 0.1\nrelease emergency-stop\nenable\nwait 0.1\nstatus\n\
         release\njog y 5\nwait 0.5\npower-cycle\nstatus\n",
    );
    let results = results(&said);
    let pressed = |index: usize| results[index]["result"]["pressed"].to_string();
    assert_eq!(pressed(0), r#"["emergency-stop","x.positive-limit"]"#);
    assert_eq!(pressed(2), r#"["x.positive-limit"]"#);
    assert_eq!(pressed(6), "[]");
    assert_eq!(results[5]["result"]["state"], "enabled");
    // Its state before does not count: it has just been switched on.
    let after = &results[10]["result"];
    assert_eq!(after["state"], "disabled");
    assert!(after["tick"].as_u64().unwrap() < 1000, "{after}");

    let refused = session(
        folder.path(),
        &[],
        "press emergency-stop\nwait 0.1\nenable\n",
    );
    let errors = String::from_utf8(refused.stderr).unwrap();
    assert!(
        errors.contains("line 3") && errors.contains("emergency stop"),
        "{errors}"
    );
}

#[test]
fn lines_of_a_debug_probe_cannot_be_chosen() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("firmware.elf"), "an image").unwrap();
    let words = ["connect", "log", "--elf", "firmware.elf"];
    for choice in [["--level", "warn"], ["--axis", "x"], ["--to", "9"]] {
        let errors = command::fail(folder.path(), &[&words[..], &choice].concat());
        assert!(errors.contains("not of a debug probe"), "{errors}");
    }
}

#[test]
fn a_flash_file_keeps_what_was_stored_from_one_command_to_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let flash = ["--flash", "settings.flash"];
    let get = "get x/feedback/pid/kp_v_per_mm\n";
    let change = "set x/feedback/pid/kp_v_per_mm 0.8\napply\nstore 'a test'\n";
    succeeds(folder.path(), &flash, change);
    let kept = succeeds(folder.path(), &flash, &format!("provenance\n{get}"));
    assert_eq!(kept, "a test\n0.8\n");
    assert_ne!(succeeds(folder.path(), &[], get), "0.8\n");
    std::fs::write(folder.path().join("short"), "no flash").unwrap();
    let refused = session(folder.path(), &["--flash", "short"], get);
    let errors = String::from_utf8(refused.stderr).unwrap();
    assert!(errors.contains("short has 8 bytes"), "{errors}");
}

#[test]
fn what_a_place_lacks_is_named_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let no_log = command::fail(folder.path(), &["connect", "--simulated", "log"]);
    assert!(no_log.contains("`events`"), "{no_log}");
    let no_image = command::fail(folder.path(), &["connect", "--emulated", "hello"]);
    let remedies: &[&str] = if cfg!(feature = "emulated") {
        &[
            "target/images/mps2-f32.elf",
            "cargo xtask build --board mps2",
        ]
    } else {
        &["--features emulated"]
    };
    for part in remedies {
        assert!(no_image.contains(part), "{no_image}");
    }
}

#[test]
fn inputs_are_seen_and_what_they_prevent() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(
        folder.path(),
        &[],
        "press x.home y.negative-limit\ninputs\nrelease\npress emergency-stop\nstatus\nrelease\ninputs\n",
    );
    for input in ["x.home", "y.negative-limit"] {
        let is_active =
            |line: &str| line.split_whitespace().collect::<Vec<_>>() == [input, "ACTIVE"];
        assert!(said.lines().any(is_active), "{input}: {said}");
    }
    assert!(said.contains("active inputs: emergency-stop"), "{said}");
    assert!(
        said.contains("`enable` would be refused: the emergency stop is pressed"),
        "{said}"
    );
    let last = said.rsplit("emergency-stop ").next().unwrap();
    assert!(last.contains("nothing keeps the outputs off"), "{said}");
}

/// An x axis whose settings have 0.7 times its friction, and learns on a sine.
const TOO_LITTLE_FRICTION: &str = "set x/feedforward/gains/presliding 0.7\nset x/feedforward/gains/level 0.7\n\
     set x/feedforward/gains/viscous 0.7\nset x/feedforward/learning present\napply\n";

#[test]
fn what_an_axis_has_learnt_is_shown_reported_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let stage = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../host-sim/data/identified-stage.toml"
    );
    let said = succeeds(
        folder.path(),
        &["--json"],
        &format!(
            "load {stage}\n{TOO_LITTLE_FRICTION}enable\n\
             circle --radius-mm 5 --feed-mm-min 600 --turns 8\nrun\nwait rest\nstatus\nevents\n\
             adopt x\nadopt x\napply\nstatus\nget x/feedforward/gains/presliding\n"
        ),
    );
    let results = results(&said);
    let of = |command: &str| -> Vec<&Value> {
        let named = results.iter().filter(|line| line["command"] == command);
        named.map(|line| &line["result"]).collect()
    };
    let [before, after] = of("status")[..] else {
        panic!("{said}");
    };
    let learnt = &before["learning"][0];
    let scale = learnt["scale"].as_f64().unwrap();
    assert!((1.3..1.6).contains(&scale), "{learnt}");
    assert_eq!(learnt["state"], "at-rest");
    assert!(learnt["error_share"].as_f64().unwrap() < 0.5, "{learnt}");
    assert_eq!(before["learning"][1], Value::Null);
    let event = of("events")
        .into_iter()
        .find_map(|line| line["event"].get("FrictionChanged"))
        .unwrap_or_else(|| panic!("{said}"));
    assert_eq!(event["axis"], "x");
    assert!(
        (130..150).contains(&event["percent"].as_u64().unwrap()),
        "{event}"
    );
    // Twice is as once.
    let [first, second] = of("adopt")[..] else {
        panic!("{said}");
    };
    assert_eq!(first, second);
    assert_eq!(first["gains"].as_array().unwrap().len(), 3);
    let kept = of("get")[0].as_f64().unwrap();
    assert!((kept / (0.7 * scale) - 1.0).abs() < 1e-3, "{kept} {scale}");
    assert_eq!(after["learning"][0]["scale"], 1.0);
}

#[test]
fn an_axis_that_does_not_learn_has_nothing_to_keep() {
    let folder = tempfile::tempdir().unwrap();
    let output = session(folder.path(), &[], "adopt y\n");
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success());
    assert!(
        errors.contains("set y/feedforward/learning present"),
        "{errors}"
    );
}

#[test]
fn a_fresh_machine_is_not_commissioned_refuses_to_be_enabled_and_names_the_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for more in [&[][..], &["--flash", "new.flash"]] {
        let options = [&["connect", "--simulated", "--keep-going"], more].concat();
        let output = command::play(
            at,
            &options,
            "provenance\nget x/commissioned\nenable\nstatus\n",
        );
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(
            said.contains("starts not commissioned") && said.contains("\nfalse\n"),
            "{said}"
        );
        assert!(said.contains("disabled, at rest"), "{said}");
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(
            errors.contains("not commissioned") && errors.contains("`quadrant commission`"),
            "{errors}"
        );
    }
    let quick_look = ["connect", "--simulated=commissioned", "enable"];
    assert!(command::succeed(at, &quick_look).contains("the outputs are on"));
}
