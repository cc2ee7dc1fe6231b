//! `quadrant replay`.

use std::path::PathBuf;

use clap::Args;
use quadrant_sim::experiment::recorded::{self, RecordedAxis};
use quadrant_sim::presentation::{provenance, recorded_page, recorded_table};
use quadrant_sim::record::Record;

use super::output::{Output, progress};

/// Options of `quadrant replay`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// CSV file with the columns t_s and reference_m (or reference_mm); position_m (or position_mm), if present, is the
    /// recorded machine's own.
    #[arg(long, value_name = "FILE")]
    reference: PathBuf,
    /// The axis that follows it.
    #[arg(long, value_enum)]
    axis: RecordedAxis,
    #[command(flatten)]
    output: Output,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        reference,
        axis,
        output,
    } = arguments;
    let record = Record::read(reference, &axis.limits())?;
    for doubt in &record.doubts {
        eprintln!("note: {doubt}");
    }
    let bar = progress(recorded::RUNS, "following the record");
    let outcomes = recorded::replay::<f32>(&record, *axis, output.seed, &bar)?;
    bar.finish_and_clear();
    output.table(&recorded_table(&outcomes, *axis))?;
    let command = format!(
        "quadrant replay --reference {} --axis {} --seed {}",
        reference
            .file_name()
            .unwrap_or(reference.as_os_str())
            .display(),
        clap::ValueEnum::to_possible_value(axis)
            .map_or_else(String::new, |value| value.get_name().to_owned()),
        output.seed
    );
    let page = recorded_page(&outcomes, *axis, provenance(&command, output.seed));
    output.page(&page, "replay.html")
}
