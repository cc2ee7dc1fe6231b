//! Results of commands, and checks they share.

use std::fmt::Display;
use std::time::Duration;

use serde_json::{Value, json};

/// Result of a command: for a person, and as data.
pub(super) struct Answer {
    pub(super) text: String,
    pub(super) data: Value,
    /// Reason why the command counts as failed, though it has a result.
    pub(super) failure: Option<String>,
}

impl Answer {
    pub(super) fn new(text: impl Display, data: Value) -> Self {
        Self {
            text: text.to_string(),
            data,
            failure: None,
        }
    }

    /// Success that a person needs no text for.
    pub(super) fn done() -> Self {
        Self::new("", json!("done"))
    }
}

/// State of a machine that was restarted.
pub(super) const RESTARTED: &str = "restarted: the outputs are off, home positions are lost";

/// Checks seconds that were given, 0 to 1e6.
pub(super) fn seconds(what: &str, seconds: f64) -> anyhow::Result<Duration> {
    const MOST_S: f64 = 1e6;
    if (0.0..=MOST_S).contains(&seconds) {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        anyhow::bail!("{what} = {seconds} s is outside 0 to {MOST_S}")
    }
}

/// Returns the serialised name of a value, in lower case.
pub(super) fn name(value: &impl serde::Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name.to_lowercase(),
        Ok(other) => other.to_string(),
        Err(_) => String::new(),
    }
}
