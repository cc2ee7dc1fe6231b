//! `quadrant replay --gcode`.

use std::path::{Path, PathBuf};

use clap::Args;
use quadrant_cli::output::{Output, command_line, progress};
use quadrant_cli::{say, warn};
use quadrant_gcode::{Limits, Program, Trajectory};
use quadrant_law::axes::AxisName;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_pages::parts::provenance;
use quadrant_pages::replay::part_program::{ProgramOutcome, ProgramTables, run_program};
use quadrant_pages::replay::part_program_page::{
    motion_summary_table, program_page, program_table,
};
use quadrant_sim::stage_file::StageFile;
use quadrant_tune::record::write_trace;

use crate::own_stage;

/// Options of `quadrant replay --gcode`.
#[derive(Clone, Debug, Args)]
pub(super) struct ProgramOptions {
    /// Part program in G-code that all three axes of the simulated stage follow: G0-G4, G17-G21, G61, G64, G90, G91, I, J, K or R,
    /// F in mm/min, M2/M30; what else a CAM system writes is ignored with a note, or refused by its name.
    #[arg(long, value_name = "FILE")]
    pub(super) gcode: Option<PathBuf>,
    /// Largest deviation of the path at a corner, mm, 0 to 10, where the program does not say by G61 or G64 P; 0 stops at it exactly.
    #[arg(long, requires = "gcode", default_value_t = 0.0, value_name = "MM")]
    corner_deviation_mm: f64,
    /// Largest acceleration along the path, mm/s^2; without it 500.
    #[arg(long, requires = "gcode", value_name = "MM/S^2")]
    acceleration_mm_s2: Option<f64>,
    /// Largest jerk along the path, mm/s^3; without it 20000.
    #[arg(long, requires = "gcode", value_name = "MM/S^3")]
    jerk_mm_s3: Option<f64>,
    /// Run the thesis' eight configurations beside the best PID, not only its PID alone and N-PID with static and GMS feedforward.
    #[arg(long, requires = "gcode")]
    all: bool,
}

/// Control ticks between two lines of a CSV file.
const TRACE_TICKS: usize = 10;

/// Follows a part program.
pub(super) fn run(
    path: &Path,
    options: &ProgramOptions,
    setup: &RunConfiguration,
    own: Option<&StageFile>,
    output: &Output,
) -> anyhow::Result<()> {
    let program = Program::read(path)?;
    for note in program.notes() {
        warn!("note: {note}");
    }
    let default = Limits::of(&setup.stage);
    let limits = Limits {
        corner_deviation_mm: options.corner_deviation_mm,
        path_acceleration_mm_s2: options
            .acceleration_mm_s2
            .unwrap_or(default.path_acceleration_mm_s2),
        path_jerk_mm_s3: options.jerk_mm_s3.unwrap_or(default.path_jerk_mm_s3),
        ..default
    };
    let trajectory = Trajectory::plan(&program, &limits)?;
    let tables = ProgramTables::sample(&trajectory, &setup.stage);
    if let Some(own) = own {
        for axis in AxisName::ALL {
            let reference_mm = tables.reference_mm[axis as usize].iter();
            let (low_mm, high_mm) = reference_mm.fold((f64::MAX, f64::MIN), |(low, high), &mm| {
                (low.min(mm), high.max(mm))
            });
            own_stage::refuse_longer(own, axis, high_mm - low_mm, "the program")?;
        }
    }
    let configurations = setup.configurations(options.all);
    let bar = progress(configurations.len() as u64, "following the program");
    let outcomes = run_program(
        &trajectory,
        &tables,
        &configurations,
        setup,
        output.seed,
        &|| bar.inc(1),
    )?;
    bar.finish_and_clear();
    say!(
        "Simulated, not measured{}. 10 kHz, f32; seed {}\n",
        own_stage::on(own),
        output.seed
    );
    output.table(&motion_summary_table(&trajectory, &tables))?;
    output.table(&program_table(&outcomes))?;
    write_axes(output, &tables, &outcomes)?;
    let title = path.file_name().unwrap_or(path.as_os_str());
    let page = program_page(
        &title.display().to_string(),
        &own_stage::name(own),
        &trajectory,
        &tables,
        &outcomes,
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "part-program.html")
}

/// Writes each axis' reference and errors; `quadrant replay --reference` reads what this writes.
fn write_axes(
    output: &Output,
    tables: &ProgramTables,
    outcomes: &[ProgramOutcome],
) -> anyhow::Result<()> {
    let thin = |signal: &[f64], count: usize| {
        let thinned = signal.iter().take(count).step_by(TRACE_TICKS);
        thinned.copied().collect::<Vec<_>>()
    };
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        // A run may end some ticks before its table, whose last samples are all alike.
        let count = outcomes
            .iter()
            .map(|outcome| outcome.position_mm[axis].len())
            .fold(tables.reference_mm[axis].len(), usize::min);
        let reference = thin(&tables.reference_mm[axis], count);
        let time = (0..reference.len()).map(|k| (k * TRACE_TICKS) as f64 * tables.period_s);
        let mut columns = vec![
            ("t_s".to_owned(), time.collect::<Vec<_>>()),
            ("reference_mm".to_owned(), reference),
        ];
        for outcome in outcomes {
            columns.push((
                format!("error_mm {}", outcome.configuration.name()),
                thin(&outcome.error_mm[axis], count),
            ));
        }
        let columns: Vec<(&str, &[f64])> = columns
            .iter()
            .map(|(name, signal)| (name.as_str(), signal.as_slice()))
            .collect();
        write_trace(&output.file(&format!("part-program-{name}.csv"))?, &columns)?;
    }
    Ok(())
}
