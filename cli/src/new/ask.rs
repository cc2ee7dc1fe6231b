//! Questions on a terminal.

use std::io::{self, IsTerminal};

use anyhow::bail;
use quadrant_cli::{say, terminal};

/// Values that no option gives: asked for on a terminal, else the defaults.
pub(super) struct Questions {
    asks: bool,
    /// Options whose defaults were taken unasked, as a command line gives them.
    taken: Vec<String>,
}

impl Questions {
    pub(super) fn new() -> Self {
        Self {
            asks: io::stdin().is_terminal(),
            taken: Vec::new(),
        }
    }

    /// The value of `option`: `given`, else the answer to `question`, else `default`.
    ///
    /// # Errors
    /// Nothing to ask, and no default; the end of the input.
    pub(super) fn value<T>(
        &mut self,
        given: Option<T>,
        option: &str,
        question: &str,
        default: Option<&str>,
        read: impl Fn(&str) -> Result<T, String>,
    ) -> anyhow::Result<T> {
        if let Some(given) = given {
            return Ok(given);
        }
        if !self.asks {
            let Some(default) = default else {
                bail!("{option} is needed ({question}); on a terminal it is asked for");
            };
            self.taken.push(format!("{option} {default}"));
            return read(default).map_err(anyhow::Error::msg);
        }
        loop {
            let bracket = default.map_or_else(String::new, |default| format!(" [{default}]"));
            terminal::print(format_args!("{question}{bracket}: "));
            let mut line = String::new();
            if io::stdin().read_line(&mut line)? == 0 {
                bail!("the answers ended before {option}; nothing was written");
            }
            let answer = match (line.trim(), default) {
                ("", Some(default)) => default,
                (answer, _) => answer,
            };
            match read(answer) {
                Ok(value) => return Ok(value),
                Err(_) if answer.is_empty() => say!("  an answer is needed"),
                Err(error) => say!("  {answer}: {error}"),
            }
        }
    }

    /// Options whose defaults were taken unasked.
    pub(super) fn taken(&self) -> Option<String> {
        (!self.taken.is_empty()).then(|| self.taken.join(" "))
    }
}
