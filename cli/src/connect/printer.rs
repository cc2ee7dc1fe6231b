//! Results: for a person, or one JSON object a line.

use quadrant_cli::{say, warn};
use serde_json::{Value, json};

/// Printer of results and errors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Printer {
    pub(super) json: bool,
}

impl Printer {
    /// Prints the result of a command: for a person, or as data.
    pub(super) fn result(&self, command: &str, text: &str, result: &Value) {
        if self.json {
            say!("{}", json!({ "command": command, "result": result }));
        } else if !text.is_empty() {
            say!("{}", text.trim_end());
        }
    }

    /// Prints the error of a command; `place` is its line, such as "line 3".
    pub(super) fn error(&self, command: &str, place: &str, error: &str) {
        if self.json {
            say!("{}", json!({ "command": command, "error": error }));
        } else {
            let place = if place.is_empty() {
                String::new()
            } else {
                format!("{place}: ")
            };
            warn!("error: {place}{error}");
        }
    }
}
