//! `quadrant plot`: columns of CSV files over time, in the terminal or as a page.

mod canvas;
mod columns;

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail, ensure};
use clap::Args;
use quadrant_cli::output::command_line;
use quadrant_cli::{say, terminal};
use quadrant_report::{
    Block, Figure, Format, Lines, Page, Plot, Provenance, Section, Series, Style,
};
use quadrant_tune::record::ColumnNames;

use self::columns::Run;

/// Options of `quadrant plot`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// CSV files with a column t_s: a capture, a recording, a table of a run. Several are drawn over each other. Of those of other
    /// programs delimiter, decimal comma, lines before the header and a row of units are guessed, and said.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Columns to draw, by name, separated by commas; without it those that every file has. The column of the time is named by
    /// time=NAME:UNIT, if it is not t_s; so are position, reference, voltage and injection, which are then drawn in mm and V as
    /// position_mm and so on.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    columns: Vec<String>,
    /// Time from which it is drawn, s.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    from: Option<f64>,
    /// Time up to which it is drawn, s.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    to: Option<f64>,
    /// Write a page for a browser into this file, instead of drawing in the terminal.
    #[arg(long, value_name = "FILE.html")]
    page: Option<PathBuf>,
}

/// Lines of a plot in the terminal.
const LINES: usize = 12;

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let (named, drawn) = arguments.columns()?;
    let runs = arguments.files.iter().map(|path| Run::read(path, &named));
    let mut runs = runs.collect::<anyhow::Result<Vec<Run>>>()?;
    let (from_s, to_s) = (
        arguments.from.unwrap_or(f64::NEG_INFINITY),
        arguments.to.unwrap_or(f64::INFINITY),
    );
    ensure!(from_s < to_s, "--from {from_s} must be below --to {to_s}");
    for run in &mut runs {
        let (first_s, last_s) = ends(&run.time_s);
        run.cut(from_s, to_s);
        ensure!(
            run.time_s.len() > 1,
            "{}: it goes from {first_s} to {last_s} s, and nothing of it is from {from_s} to {to_s} s",
            run.path.display()
        );
    }
    let names = names(&drawn, &runs)?;
    match &arguments.page {
        None => {
            draw(&runs, &names);
            Ok(())
        }
        Some(path) => write(path, &runs, &names),
    }
}

/// First and last time, s.
fn ends(time_s: &[f64]) -> (f64, f64) {
    let first = time_s.first().copied().unwrap_or_default();
    (first, time_s.last().copied().unwrap_or_default())
}

impl Arguments {
    /// The columns that are named as quantities, and those to draw.
    fn columns(&self) -> anyhow::Result<(ColumnNames, Vec<String>)> {
        let (named, drawn): (Vec<String>, Vec<String>) =
            (self.columns.iter().cloned()).partition(|name| name.contains('='));
        let named = match named.as_slice() {
            [] => ColumnNames::default(),
            _ => named
                .join(",")
                .parse()
                .map_err(|error| anyhow!("--columns: {error}"))?,
        };
        Ok((named, drawn))
    }
}

/// Columns to draw: those that are asked for, else those that every run has.
fn names(drawn: &[String], runs: &[Run]) -> anyhow::Result<Vec<String>> {
    for name in drawn {
        if let Some(run) = runs.iter().find(|run| run.column(name).is_none()) {
            bail!(
                "{}: no column {name:?}; found {}",
                run.path.display(),
                run.names().join(", ")
            );
        }
    }
    if !drawn.is_empty() {
        return Ok(drawn.to_vec());
    }
    let in_all = |name: &&str| runs.iter().all(|run| run.column(name).is_some());
    let names: Vec<String> = (runs.first().map(Run::names).unwrap_or_default().into_iter())
        .filter(in_all)
        .map(str::to_owned)
        .collect();
    ensure!(
        !names.is_empty(),
        "no column is in all of the files: {}",
        runs.iter()
            .map(|run| match run.names().join(", ") {
                none if none.is_empty() => format!("{} has none of numbers", run.path.display()),
                names => format!("{} has {names}", run.path.display()),
            })
            .collect::<Vec<_>>()
            .join("; ")
    );
    Ok(names)
}

/// Draws the columns in the terminal, one below the other.
fn draw(runs: &[Run], names: &[String]) {
    if runs.len() > 1 {
        for (index, run) in runs.iter().enumerate() {
            say!("{} {}", canvas::sign(index), run.name());
        }
    }
    for name in names {
        let curves: Vec<(&[f64], &[f64])> = runs
            .iter()
            .filter_map(|run| Some((run.time_s.as_slice(), run.column(name)?)))
            .collect();
        say!("{name}");
        for line in canvas::draw(&curves, terminal::output_width(), LINES) {
            say!("{line}");
        }
    }
}

/// Writes a page with a figure for each column.
fn write(path: &Path, runs: &[Run], names: &[String]) -> anyhow::Result<()> {
    let stem = path
        .file_stem()
        .filter(|_| path.extension().is_some_and(|end| end == "html"));
    let Some(stem) = stem.and_then(|stem| stem.to_str()) else {
        bail!("--page {}: its name must end in .html", path.display());
    };
    let figures = names.iter().enumerate().map(|(index, name)| Figure {
        id: format!("column-{index}"),
        caption: name.clone(),
        plot: Plot::Lines(Lines {
            x_label: "Time, s".to_owned(),
            y_label: name.clone(),
            series: (runs.iter().enumerate())
                .filter_map(|(index, run)| {
                    Some(Series {
                        name: run.name(),
                        x: run.time_s.clone(),
                        y: run.column(name)?.to_vec(),
                        style: Style::nth(index),
                    })
                })
                .collect(),
            ..Lines::default()
        }),
    });
    let files: Vec<String> = runs.iter().map(Run::name).collect();
    let page = Page {
        title: files.join(", "),
        subtitle: "Columns over time".to_owned(),
        provenance: Provenance {
            command: command_line(),
            seed: None,
            version: env!("CARGO_PKG_VERSION").to_owned(),
        },
        sections: vec![Section {
            id: "columns".to_owned(),
            heading: "Columns".to_owned(),
            prose: Vec::new(),
            blocks: figures.map(Block::Figure).collect(),
            provenance: None,
        }],
    };
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    page.write(folder.unwrap_or(".".as_ref()), stem, &[Format::Html])?;
    say!("{}: open it in a browser", path.display());
    Ok(())
}
