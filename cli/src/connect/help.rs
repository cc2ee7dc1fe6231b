//! The list of the console's commands, by what they are for.

use clap::Command;
use quadrant_report::wrapped;

/// The groups, and the names of their commands.
pub(super) const GROUPS: [(&str, &[&str]); 6] = [
    (
        "The machine",
        &[
            "hello", "status", "inputs", "fault", "reset", "reboot", "events", "log",
        ],
    ),
    (
        "Motion",
        &[
            "enable", "disable", "stop", "home", "move", "jog", "run", "plan", "circle", "stream",
            "spindle", "wait",
        ],
    ),
    (
        "Settings",
        &[
            "get",
            "set",
            "list",
            "diff",
            "adopt",
            "apply",
            "undo",
            "revert",
            "defaults",
            "load",
            "dump",
            "store",
            "provenance",
        ],
    ),
    (
        "Looking and recording",
        &["watch", "scope", "record", "capture", "channels"],
    ),
    ("Commissioning", &["identify", "commission"]),
    (
        "This computer, and machines that are simulated",
        &["ports", "press", "release", "power-cycle"],
    ),
];

/// Characters of a line before what a command does.
const INDENT: usize = 15;
/// Characters of a line for what a command does.
const ROOM: usize = 64;

/// The list for a grammar of lines: each command with the first clause of what it does.
pub(super) fn text(grammar: &Command) -> String {
    let mut text = String::new();
    for (title, names) in GROUPS {
        text.push_str(&format!("{title}:\n"));
        for name in names {
            let about = grammar
                .find_subcommand(name)
                .and_then(|command| command.get_about())
                .map(ToString::to_string)
                .unwrap_or_default();
            let lines = wrapped(first_clause(&about), ROOM);
            let lines = lines.join(&format!("\n{:INDENT$}", ""));
            text.push_str(&format!("  {name:<12} {lines}\n"));
        }
        text.push('\n');
    }
    text.push_str("`help COMMAND` says more; `quit` or Ctrl-D ends.");
    text
}

/// The first clause of a text, whole.
fn first_clause(text: &str) -> &str {
    let end = [". ", ": ", "; "]
        .iter()
        .filter_map(|end| text.find(end))
        .min()
        .unwrap_or(text.len());
    text[..end].trim_end_matches('.')
}
