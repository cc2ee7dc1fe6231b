//! Motions and faults at the console of the simulated machine: what is refused before it moves, what ends a script, and where plans
//! end.

use crate::command;
use std::path::Path;

use serde_json::Value;

/// The result of a script: what it printed, what it said of errors, and if it succeeded.
struct Played {
    printed: String,
    errors: String,
    succeeded: bool,
}

/// Gives a script to a machine that has just been switched on.
fn play(options: &[&str], script: &str) -> Played {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let output = command::play(
        root,
        &[&["connect", "--simulated=commissioned"], options].concat(),
        script,
    );
    Played {
        printed: String::from_utf8(output.stdout).unwrap(),
        errors: String::from_utf8(output.stderr).unwrap(),
        succeeded: output.status.success(),
    }
}

/// The positions of the axes in each `status` of a session with `--json`, mm.
fn positions_mm(played: &Played) -> Vec<[f64; 3]> {
    let answers = played
        .printed
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap());
    answers
        .filter(|answer| answer["command"] == "status")
        .map(|answer| {
            let axes = answer["result"]["axes"].as_array().unwrap();
            std::array::from_fn(|axis| axes[axis]["position_mm"].as_f64().unwrap())
        })
        .collect()
}

const HOMED: &str = "load host-sim/data/identified-stage.toml\nenable\nhome\nwait homed\n";

#[test]
fn a_plan_that_leaves_the_travel_is_refused_before_it_moves() {
    for (plan, said) in [
        (
            "circle --radius-mm 300 --feed-mm-min 6000",
            "the travel of -200 to 200 mm",
        ),
        (
            "move x -150\nwait rest\ncircle --radius-mm 30 --feed-mm-min 6000",
            "x: -2",
        ),
        (
            "move y -190\nwait rest\ncircle --radius-mm 40 --feed-mm-min 6000",
            "y: -2",
        ),
    ] {
        let played = play(
            &["--json", "--keep-going"],
            &format!("{HOMED}{plan}\nstatus\nrun\nwait 1\nstatus\nfault\n"),
        );
        let refused = played
            .printed
            .lines()
            .find(|line| line.contains("\"error\":"))
            .unwrap();
        assert!(refused.contains("\"run\""), "{refused}");
        assert!(refused.contains("mm is outside the travel of"), "{refused}");
        assert!(refused.contains(said), "{plan}: {refused}");
        let [before, after] = positions_mm(&played)[..] else {
            panic!("{}", played.printed);
        };
        for (before, after) in before.iter().zip(after) {
            assert!((before - after).abs() < 0.005, "{plan}: {before} {after}");
        }
        assert!(
            played.printed.ends_with("\"result\":null}\n"),
            "{}",
            played.printed
        );
        // Without --keep-going the script ends there.
        let played = play(
            &[],
            &format!("{HOMED}{plan}\nrun\nwait rest\nget x/feedback/law\n"),
        );
        assert!(
            !played.succeeded && !played.printed.contains("n-pid"),
            "{}",
            played.printed
        );
    }
    let within = play(
        &[],
        &format!("{HOMED}circle --radius-mm 90 --feed-mm-min 12000\nrun\nwait rest\n"),
    );
    assert!(within.succeeded, "{}", within.errors);
}

#[test]
fn a_fault_ends_every_wait_and_the_script_with_its_cause() {
    for (fault, name) in [
        ("press emergency-stop", "emergency-stop"),
        // The axes brake before it is latched.
        ("press x.positive-limit", "limit-switch of x"),
        ("press y.amplifier-fault", "amplifier-fault of y"),
    ] {
        for wait in ["wait rest", "wait homed", "wait 1"] {
            let script =
                format!("{HOMED}jog x 20\nwait 0.2\n{fault}\n{wait}\nget x/feedback/law\n");
            let played = play(&[], &script);
            let said = format!("{fault}, {wait}: {}{}", played.printed, played.errors);
            assert!(!played.succeeded, "{said}");
            assert!(!played.printed.contains("n-pid"), "{said}");
            assert!(
                played.errors.contains("line 8: wait") && played.errors.contains(": fault "),
                "{said}"
            );
            assert!(played.errors.contains(name), "{said}");
        }
    }
    // One that was there before is no news to a wait for time.
    let before = "enable\npress emergency-stop\nwait 0.1\n";
    let played = play(
        &["--keep-going"],
        &format!("{before}wait 0.1\nget rate_hz\n"),
    );
    assert_eq!(
        played.errors.matches("error: ").count(),
        1,
        "{}",
        played.errors
    );
}

#[test]
fn a_script_goes_on_after_its_own_restart() {
    for restart in ["reboot", "power-cycle"] {
        let script = format!(
            "load host-sim/data/identified-stage.toml\nwait 0.5\nstore \"t\"\n{restart}\nenable\njog x 1\nwait 0.2\nstop\nwait rest\n"
        );
        let played = play(&[], &script);
        assert!(played.succeeded, "{restart}: {}", played.errors);
    }
}

#[test]
fn a_setting_is_changed_right_after_others_were_loaded() {
    let script = "load host-sim/data/identified-stage.toml\nset x/feedback/pid/kp_v_per_mm 1.0\napply\nset y/feedback/pid/kp_v_per_mm \
                  1.0\napply\napply\ndiff\n";
    let played = play(&[], script);
    assert!(played.succeeded, "{}", played.errors);
}

#[test]
fn a_circle_ends_where_it_began_however_often_it_runs() {
    for circle in [
        "--radius-mm 10 --feed-mm-min 1200",
        "--radius-mm 5 --feed-mm-min 600 --turns 1",
        "--radius-mm 3 --feed-mm-min 777 --turns 0.3 --clockwise",
        "--radius-mm 20 --feed-mm-min 5000 --lead-s 0.77 --plane zx",
    ] {
        let runs = "run\nwait rest\nstatus\n".repeat(3);
        let played = play(
            &["--json"],
            &format!("{HOMED}status\ncircle {circle}\n{runs}"),
        );
        assert!(played.succeeded, "{}{}", played.printed, played.errors);
        let positions = positions_mm(&played);
        assert_eq!(positions.len(), 4);
        for at in &positions[1..] {
            for (at, began) in at.iter().zip(positions[0]) {
                assert!((at - began).abs() < 0.01, "{circle}: {positions:?}");
            }
        }
    }
}

#[test]
fn an_error_names_the_command_that_was_typed() {
    for (script, said, other) in [
        (
            "reset\n",
            "reset: refused: there is no fault",
            "reset-fault",
        ),
        ("enable\nstore\n", "store: refused: ", "settings: refused"),
    ] {
        let played = play(&[], script);
        assert!(!played.succeeded, "{script}");
        assert!(
            played.errors.contains(said) && !played.errors.contains(other),
            "{}",
            played.errors
        );
    }
}

#[test]
fn the_help_of_plan_shows_a_file_that_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let help = command::succeed(folder.path(), &["connect", "plan", "--help"]);
    // As long as a terminal is wide.
    let words: Vec<&str> = help.split_whitespace().collect();
    let words = words.join(" ");
    let motions = ["{ harmonic", "{ point-to-point"].map(|begin| {
        let (_, rest) = words.split_once(begin).unwrap();
        let (inner, _) = rest.split_once("} }").unwrap();
        format!("{begin}{inner}}} }}")
    });
    let file = folder.path().join("plan.toml");
    std::fs::write(
        &file,
        format!("motions = [{}, {}, \"hold\"]", motions[0], motions[1]),
    )
    .unwrap();
    let script = format!("enable\nplan {}\n", file.display());
    let played = play(&[], &script);
    assert!(played.succeeded, "{}", played.errors);
}
