//! `quadrant settings`.

use clap::Args;
use quadrant_cli::{say, terminal};
use quadrant_pages::settings_reference::{markdown, rows};

/// Options of `quadrant settings`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// Only the settings whose path, unit or meaning contains each of these words; capitals or not.
    #[arg(value_name = "WORD")]
    words: Vec<String>,
    /// Print the whole reference as the page `docs/settings.md` instead.
    #[arg(long, conflicts_with = "words")]
    markdown: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if arguments.markdown {
        terminal::print(format_args!("{}", markdown()));
        return Ok(());
    }
    let asked = arguments.words.join(" ");
    let rows = rows(&asked);
    anyhow::ensure!(
        !rows.is_empty(),
        "no setting has \"{asked}\" in its path or meaning: `quadrant settings` shows them all"
    );
    for row in rows {
        let unit = if row.unit.is_empty() { "" } else { " " };
        say!("{}\n    {}", row.path, row.meaning);
        say!(
            "    {}{unit}{}; default {}",
            row.range,
            row.unit,
            row.default
        );
    }
    Ok(())
}
