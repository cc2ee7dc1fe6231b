//! `quadrant settings`.

use clap::Args;
use quadrant_cli::{say, terminal};
use quadrant_sim::settings_reference::{markdown, rows};

/// Options of `quadrant settings`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// Only the settings whose path contains this.
    #[arg(value_name = "PART", default_value = "")]
    part: String,
    /// Print the whole reference as the page `docs/settings.md` instead.
    #[arg(long, conflicts_with = "part")]
    markdown: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if arguments.markdown {
        terminal::print(format_args!("{}", markdown()));
        return Ok(());
    }
    let rows = rows(&arguments.part);
    anyhow::ensure!(
        !rows.is_empty(),
        "no setting's path contains \"{}\": `quadrant settings` shows them all",
        arguments.part
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
