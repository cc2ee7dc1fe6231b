//! `quadrant compare`.

use anyhow::{bail, ensure};
use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, share};
use quadrant_cli::{say, terminal};
use quadrant_host::client::plot;
use quadrant_law::axes::AxisName;
use quadrant_pages::circle::run_circles;
use quadrant_pages::compare::comparison::{Comparison, Request};
use quadrant_pages::compare::glance::Glance;
use quadrant_pages::compare::page::{comparison_page, comparison_tables};
use quadrant_pages::compare::sine::{AMPLITUDE_MM, Sines, VELOCITIES_MM_S};
use quadrant_pages::compare::subject::Subject;
use quadrant_pages::experiment::run_configuration::{ModelKnowledge, RunConfiguration};
use quadrant_pages::parts::provenance;
use quadrant_report::wrapped;
use quadrant_settings::StageSettings;
use quadrant_sim::stage_file::StageFile;
use quadrant_tune::record::write_trace;

use crate::numbers::{self, Numbers};
use crate::own_stage::{self, OwnStage};

/// Options of `quadrant compare`.
#[derive(Clone, Debug, Args)]
// Beside the group of the program without a command.
#[group(id = "comparison")]
pub(super) struct Arguments {
    #[command(flatten)]
    stage: OwnStage,
    /// The axis that follows the sines; without it x, or the first that --stage describes.
    #[arg(long, value_enum)]
    axis: Option<Axis>,
    /// Largest velocities of the sines, mm/s, one to three, separated by commas; without it 5, 10 and 15.
    #[arg(long, value_name = "MM/S,...")]
    velocity: Vec<Numbers>,
    /// Amplitude of the sines, mm; without it 30, or 40 % of the travel that --stage says if that is less.
    #[arg(long, value_name = "MM")]
    amplitude: Option<f64>,
    #[command(flatten)]
    settings: LawSettings,
    /// Noise seeds of the runs whose friction was identified from experiments, from --seed on, 1 to 100; tables give means over them.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    /// Print every table, not only the result.
    #[arg(long)]
    tables: bool,
    #[command(flatten)]
    output: Output,
}

/// Control ticks between two lines of a trace's CSV file.
const TRACE_TICKS: usize = 10;
/// Control rate of the traces, Hz.
const RATE_HZ: f64 = 1e4;
/// Steps of the progress bar.
const STEPS: u64 = 1_000_000;
/// Share of half the travel that the sine takes unless an amplitude is given.
const TRAVEL_SHARE: f64 = 0.8;
/// Largest amplitude, mm.
const MOST_AMPLITUDE_MM: f64 = 1e4;
/// Least and largest velocity, mm/s.
const VELOCITY_RANGE_MM_S: (f64, f64) = (0.01, 1e4);
/// Longest cycle that is simulated, s.
const MOST_CYCLE_S: f64 = 600.0;

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { output, seeds, .. } = arguments;
    output.ready()?;
    let stage = arguments.stage.read()?;
    let sines = arguments.sines(stage.as_ref())?;
    let (setups, subject) = arguments.subject(stage.as_ref(), sines)?;
    for setup in &setups {
        refuse_faster(&setup.stage, &subject.sines)?;
    }
    let bar = share("comparing on a simulated stage");
    bar.set_length(STEPS);
    let request = Request {
        setups: &setups,
        configurations: &subject.all,
        sines: vec![subject.sines.clone()],
        seed: output.seed,
        seeds: *seeds,
    };
    let comparison = request.run(&|done| bar.inc((done * STEPS as f64) as u64))?;
    let circles = match (&stage, setups.last()) {
        (None, Some(identified)) => run_circles(&subject.all, identified, output.seed)?,
        _ => Vec::new(),
    };
    bar.finish_and_clear();
    let glance = Glance::of(&comparison, &subject);
    show(&glance, &subject, output)?;
    for table in comparison_tables(&comparison, &subject, &circles) {
        if arguments.tables {
            output.table(&table)?;
        } else {
            output.keep_table(&table)?;
        }
    }
    for &knowledge in &subject.knowledge {
        for &velocity in &subject.sines.velocities_mm_s {
            write_errors(output, &comparison, &subject, knowledge, velocity)?;
        }
    }
    let command = arguments.command();
    let page = comparison_page(
        &comparison,
        &subject,
        &glance,
        &circles,
        provenance(&command, output.seed),
    );
    output.page(&page, "comparison.html")?;
    if !arguments.tables {
        say!("`quadrant compare --tables` prints every table");
    }
    Ok(())
}

impl Arguments {
    /// The sines that are asked for, within what is simulated and the travel of the stage.
    fn sines(&self, stage: Option<&StageFile>) -> anyhow::Result<Sines> {
        let first = stage.and_then(|stage| own_stage::axes(stage).first().copied());
        let axis = self
            .axis
            .map(AxisName::from)
            .or(first)
            .unwrap_or(AxisName::X);
        let velocities_mm_s = match numbers::all(&self.velocity) {
            given if given.is_empty() => VELOCITIES_MM_S.to_vec(),
            given => given,
        };
        let (slowest, fastest) = VELOCITY_RANGE_MM_S;
        for velocity in &velocities_mm_s {
            ensure!(
                (slowest..=fastest).contains(velocity),
                "--velocity {velocity} must be {slowest} to {fastest} mm/s"
            );
        }
        ensure!(
            velocities_mm_s.len() <= VELOCITIES_MM_S.len(),
            "--velocity has {} numbers; give at most {}",
            velocities_mm_s.len(),
            VELOCITIES_MM_S.len()
        );
        let fitting_mm = stage
            .and_then(|stage| own_stage::half_travel_mm(stage, axis))
            .map_or(AMPLITUDE_MM, |half_mm| {
                AMPLITUDE_MM.min(TRAVEL_SHARE * half_mm)
            });
        let amplitude_mm = self.amplitude.unwrap_or(fitting_mm);
        ensure!(
            amplitude_mm > 0.0 && amplitude_mm <= MOST_AMPLITUDE_MM,
            "--amplitude {amplitude_mm} must be above 0 and at most {MOST_AMPLITUDE_MM} mm"
        );
        if let Some(stage) = stage {
            let what = format!("--amplitude {amplitude_mm}");
            own_stage::refuse_longer(stage, axis, 2.0 * amplitude_mm, &what)?;
        }
        let sines = Sines {
            axis,
            amplitude_mm,
            velocities_mm_s,
        };
        let longest_s = sines.longest_cycle_s();
        ensure!(
            longest_s <= MOST_CYCLE_S,
            "a cycle of {amplitude_mm} mm lasts {longest_s:.0} s, and up to {MOST_CYCLE_S} s are simulated: give a smaller --amplitude or a \
             higher --velocity"
        );
        Ok(sines)
    }

    /// The stages with their laws, and what is compared on them.
    fn subject(
        &self,
        stage: Option<&StageFile>,
        sines: Sines,
    ) -> anyhow::Result<(Vec<RunConfiguration>, Subject)> {
        let own = match self.settings.path {
            None => "thesis'",
            Some(_) => "settings'",
        };
        let Some(stage) = stage else {
            let [exact, identified] = RunConfiguration::both(&self.settings.read()?.stage);
            let setups = vec![exact.with_best_pid()?, identified.with_best_pid()?];
            return Ok((setups, Subject::built_in(own, sines)));
        };
        let name = stage.path.display().to_string();
        let axis = sines.axis;
        if stage.known[axis as usize].is_none() {
            bail!("{name} has no table [{axis}]: add one, or give another --axis");
        }
        let setup = own_stage::setup(stage, &[axis], &self.settings, &self.output)?;
        let subject = match self.settings.path {
            None => Subject::commissioned(name, &setup, sines),
            Some(_) => Subject::given(name, own, sines),
        };
        Ok((vec![setup], subject))
    }

    /// The command that makes the same page.
    fn command(&self) -> String {
        let mut command = format!("quadrant compare{}", self.stage.option());
        if let Some(axis) = self.axis {
            command += &format!(" --axis {}", axis.name());
        }
        if !self.velocity.is_empty() {
            command += &format!(" --velocity {}", Numbers(numbers::all(&self.velocity)));
        }
        if let Some(amplitude) = self.amplitude {
            command += &format!(" --amplitude {amplitude}");
        }
        command += &format!("{} --seed {}", self.settings.option(), self.output.seed);
        if self.seeds > 1 {
            command += &format!(" --seeds {}", self.seeds);
        }
        command
    }
}

/// Refuses sines beyond the limits of their axis.
fn refuse_faster(stage: &StageSettings, sines: &Sines) -> anyhow::Result<()> {
    let limits = &stage.axes[sines.axis as usize].limits;
    for velocity in &sines.velocities_mm_s {
        ensure!(
            *velocity <= limits.max_velocity_mm_s,
            "--velocity {velocity} is above the {} mm/s that {} may go: give a lower one, or raise max_velocity_mm_s (of --stage, or \
             below limits in --settings)",
            limits.max_velocity_mm_s,
            sines.axis
        );
        let acceleration_mm_s2 = velocity * velocity / sines.amplitude_mm;
        ensure!(
            acceleration_mm_s2 <= limits.max_acceleration_mm_s2,
            "--velocity {velocity} with --amplitude {} takes {acceleration_mm_s2:.0} mm/s^2, and {} may have {}: give a lower velocity or a \
             larger amplitude, or raise max_acceleration_mm_s2 (of --stage, or below limits in --settings)",
            sines.amplitude_mm,
            sines.axis,
            limits.max_acceleration_mm_s2
        );
    }
    Ok(())
}

/// Lines of the reversal's plot.
const PLOT_LINES: usize = 4;
/// Most characters of its width.
const PLOT_WIDTH: usize = 80;

/// Prints the result: a sentence, a table, a reversal.
fn show(glance: &Glance, subject: &Subject, output: &Output) -> anyhow::Result<()> {
    let width = terminal::output_width();
    say!("{}\n", wrapped(&glance.sentence, width).join("\n"));
    output.table(&glance.table)?;
    let Some((_, first)) = glance.reversals.first() else {
        return Ok(());
    };
    let caption = format!(
        "One reversal at {} mm/s: error in um over {:.2} s",
        subject.sines.velocities_mm_s[0],
        first.duration_s()
    );
    say!("{caption}");
    let width = width.min(PLOT_WIDTH);
    let curves: Vec<&[f64]> = glance
        .reversals
        .iter()
        .map(|(_, reversal)| reversal.error_um.as_slice())
        .collect();
    let mut names = String::new();
    for (index, (name, _)) in glance.reversals.iter().enumerate() {
        let place = plot::place(index, curves.len(), width);
        names = format!("{names:<place$}{name}");
    }
    say!("{names}");
    for line in plot::beside(&curves, width, PLOT_LINES) {
        say!("{line}");
    }
    Ok(())
}

/// Writes the errors of all configurations over the last cycle at one velocity.
fn write_errors(
    output: &Output,
    comparison: &Comparison,
    subject: &Subject,
    knowledge: ModelKnowledge,
    velocity_mm_s: f64,
) -> anyhow::Result<()> {
    // To the nanometre.
    let thin = |signal: &[f64]| {
        let thinned = signal.iter().step_by(TRACE_TICKS);
        thinned.map(|mm| (1e6 * mm).round() / 1e6).collect()
    };
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    let amplitude_mm = subject.sines.amplitude_mm;
    for &configuration in &subject.all {
        let Some(entry) = comparison.find(configuration, knowledge, amplitude_mm, velocity_mm_s)
        else {
            continue;
        };
        let cycle = &entry.last_cycle;
        if columns.is_empty() {
            let reference: Vec<f64> = thin(&cycle.reference_mm);
            let time = (0..reference.len()).map(|k| (k * TRACE_TICKS) as f64 / RATE_HZ);
            columns.push(("t_s".to_owned(), time.collect()));
            columns.push(("reference_mm".to_owned(), reference));
        }
        columns.push((
            format!("error_mm {}", configuration.name()),
            thin(&cycle.error_mm),
        ));
    }
    let columns: Vec<(&str, &[f64])> = columns
        .iter()
        .map(|(name, signal)| (name.as_str(), signal.as_slice()))
        .collect();
    let name = format!(
        "errors-{}-{velocity_mm_s}-mm-s.csv",
        knowledge.name().replace(' ', "-")
    );
    write_trace(&output.file(&name)?, &columns)?;
    Ok(())
}
