//! The list of the console's commands, by what they are for.

use clap::CommandFactory;

use super::line::Line;

/// The groups, and the names of their commands.
const GROUPS: [(&str, &[&str]); 6] = [
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
            "wait",
        ],
    ),
    (
        "Settings",
        &[
            "get",
            "set",
            "list",
            "diff",
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

/// The list: each command with the beginning of what it does.
pub(super) fn text() -> String {
    let mut grammar = Line::command();
    grammar.build();
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

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::{GROUPS, Line, text};

    #[test]
    fn every_command_of_the_prompt_is_in_one_group() {
        let mut grouped: Vec<&str> = GROUPS
            .iter()
            .flat_map(|(_, names)| *names)
            .copied()
            .collect();
        grouped.sort_unstable();
        let grammar = Line::command();
        let mut known: Vec<&str> = grammar
            .get_subcommands()
            .map(|command| command.get_name())
            // For the shell alone.
            .filter(|name| !["-", "flash"].contains(name))
            .collect();
        known.sort_unstable();
        assert_eq!(grouped, known);
    }

    #[test]
    fn a_terminal_of_eighty_columns_has_room_for_it() {
        for line in text().lines() {
            assert!(line.chars().count() <= 80, "{line}");
            assert!(!line.ends_with(' '), "{line:?}: says nothing");
        }
    }
}
