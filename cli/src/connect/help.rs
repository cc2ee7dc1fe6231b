//! The list of the console's commands, by what they are for.

use clap::Command;

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

/// Characters of a line that are left for what a command does.
const ROOM: usize = 64;

/// The list for a grammar of lines: each command with the beginning of what it does.
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
            text.push_str(&format!("  {name:<12} {}\n", beginning(&about)));
        }
        text.push('\n');
    }
    text.push_str("`help COMMAND` says more; `quit` or Ctrl-D ends.");
    text
}

/// As much of a text as a line of a terminal has room for: its first clause, or whole words of it.
fn beginning(text: &str) -> String {
    let end = [". ", ": ", "; "]
        .iter()
        .filter_map(|end| text.find(end))
        .min()
        .unwrap_or(text.len());
    let clause = text[..end].trim_end_matches('.');
    if clause.len() <= ROOM {
        return clause.to_owned();
    }
    let within = &clause[..=clause.floor_char_boundary(ROOM - 2)];
    match (within.rfind(", "), within.rfind(' ')) {
        (Some(comma), _) => within[..comma].to_owned(),
        (None, Some(space)) => format!("{} ...", &within[..space]),
        (None, None) => within.to_owned(),
    }
}
