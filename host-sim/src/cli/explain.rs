//! Errors in words, their causes included.

/// Returns an error and its causes; most messages contain their cause's already.
pub(crate) fn explained(error: &anyhow::Error) -> String {
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
    fn a_cause_is_told_once() {
        let cause = anyhow!("the file is empty");
        let told = explained(&cause.context("stage.toml: the file is empty"));
        assert_eq!(told, "stage.toml: the file is empty");
        let result: anyhow::Result<()> = Err(anyhow!("no such file")).context("stage.toml");
        assert_eq!(explained(&result.unwrap_err()), "stage.toml: no such file");
    }
}
