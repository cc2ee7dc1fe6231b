//! Options and output that the command `quadrant` and the studies share.
#![forbid(unsafe_code)]
// A tool, not a library for others: a comment that only repeats a name is left out.
#![allow(missing_docs)]

pub mod axis;
pub mod law_settings;
pub mod output;
pub mod terminal;

/// Returns an error with its causes; most messages contain their cause's already.
pub fn explained(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1) {
        let cause = cause.to_string();
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use anyhow::{Context, anyhow};

    use super::explained;

    #[test]
    fn a_cause_is_reported_once() {
        let cause = anyhow!("the file is empty");
        let text = explained(&cause.context("stage.toml: the file is empty"));
        assert_eq!(text, "stage.toml: the file is empty");
        let result: anyhow::Result<()> = Err(anyhow!("no such file")).context("stage.toml");
        assert_eq!(explained(&result.unwrap_err()), "stage.toml: no such file");
    }
}
