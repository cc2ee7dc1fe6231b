//! `quadrant commission`, and what it shares with `quadrant connect commission`.

mod saved;

use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::output::{Output, command_line, share};
use quadrant_cli::{say, terminal, warn};
use quadrant_host::machine::{Begun, Journal, Machine};
use quadrant_law::axes::AxisName;
use quadrant_pages::commission::{commission_page, gains_table, plan_table, results_table};
use quadrant_pages::identify::friction::{friction_table, gms_table};
use quadrant_pages::identify::linear::{motor_constant_table, plant_tables};
use quadrant_pages::identify::revise::revise_table;
use quadrant_pages::parts::provenance;
use quadrant_report::{Table, wrapped};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::setting_value::{Change, changes};
use quadrant_sim::settings_file::SettingsFile;
use quadrant_sim::stage_file::StageFile;
use quadrant_tune::commission::{
    CommissionError, CommissionSettings, Commissioned, CrossCheck, Watch, commission, plan,
};
use quadrant_tune::design::Target;
use quadrant_tune::test_axis::{TestAxis, Travel};
use quadrant_written::whole;
use serde_json::{Value, json};

use super::endpoint::{Endpoint, Simulation};
use super::kept;
use super::own_stage::{OwnStage, axes, refuse_other_hardware};
use super::subject::{and_restored, known_travel, travel_both_ways};

/// Options of `quadrant commission`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// The axis to commission.
    #[arg(long, value_enum)]
    axis: Axis,
    /// The machine: law (the control law alone on the simulated stage), simulated (the firmware's application on it, not
    /// commissioned), simulated:commissioned, emulated or emulated:ELF (its image in QEMU), serial:PORT, tcp:HOST:PORT.
    #[arg(
        long,
        default_value = "law",
        value_name = "MACHINE",
        conflicts_with = "record"
    )]
    machine: Endpoint,
    #[command(flatten)]
    stage: OwnStage,
    /// The folder of an earlier commissioning instead, whose recordings are identified again; nothing moves, so there is no
    /// verdict and no cross-check.
    #[arg(long, value_name = "FOLDER")]
    record: Option<PathBuf>,
    /// Travel from where the axis stands, mm: 200 for as much either way, or -5..180 of one that stands near an end. Without it,
    /// that to the soft limits of a homed axis.
    #[arg(long, value_name = "MM", value_parser = travel_both_ways, allow_hyphen_values = true, conflicts_with = "record")]
    travel: Option<Travel>,
    /// Settings to start from: encoder, amplifier and limits of this axis, and the other axes, which stay as they are. The law of this
    /// axis is not read. A machine that is not real starts with them, and has their rate, encoder and converter.
    /// Without them those of --into if it is there; else the machine's for this axis, and everything else as it is in the
    /// folder for results, or as the machine has it.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Write the settings into this file; without it, into settings.toml in the folder for results. Everything else is
    /// written into a folder of the axis below it.
    #[arg(long, value_name = "FILE")]
    into: Option<PathBuf>,
    /// Let the settings that were found act on the machine. Without it the machine keeps those that it had.
    #[arg(long, conflicts_with = "record")]
    apply: bool,
    /// Keep them in the machine's flash too.
    #[arg(long, requires = "apply")]
    store: bool,
    #[command(flatten)]
    request: Request,
    #[command(flatten)]
    output: Output,
}

/// Options of a commissioning on any machine.
#[derive(Clone, Debug, Args)]
pub(super) struct Request {
    /// Gain margin of the PID, dB, in continuous time; without it and --phase-margin-deg, the PID is the best with |S| up to 1.7
    /// and |T| up to 1.5 on the sampled loop. The thesis has 9.9.
    #[arg(long, value_name = "DB", requires = "phase_margin_deg")]
    gain_margin_db: Option<f64>,
    /// Phase margin of the PID, deg. The thesis has 54.2.
    #[arg(long, value_name = "DEG", requires = "gain_margin_db")]
    phase_margin_deg: Option<f64>,
    /// Leave out the cross-checks: the response at rest, with the linear model revised for explicit friction, and an ordinary
    /// motion.
    #[arg(long)]
    quick: bool,
    /// Go on where an interrupted commissioning stood: its experiments are not run again. The axis must stand as free as at the
    /// beginning.
    #[arg(long)]
    resume: bool,
}

/// Results of a commissioning.
struct Found {
    found: Commissioned,
    /// Nothing where cross-checks were not asked for.
    checked: Option<Result<CrossCheck, CommissionError>>,
}

/// A commissioning of one axis of a machine.
pub(super) struct Job<'a> {
    pub(super) axis: AxisName,
    /// Travel from where the axis stands; without it, that to the soft limits.
    pub(super) travel: Option<Travel>,
    /// Simulated stage of one's own that the machine has.
    pub(super) stage: Option<&'a StageFile>,
    /// Settings to start from; without them, those of the machine.
    pub(super) start: Option<SettingsFile>,
    /// File for the settings, in place of `settings.toml` in the folder for results.
    pub(super) into: Option<&'a Path>,
    pub(super) request: &'a Request,
    pub(super) output: &'a Output,
    /// True if the machine is to run on the new settings.
    pub(super) apply: bool,
    /// True if it is to keep them in its flash.
    pub(super) store: bool,
}

/// A commissioning that is done: for a person, and as data.
pub(super) struct Done {
    pub(super) text: String,
    pub(super) data: Value,
    /// Reason why it counts as failed, where nothing better than the PID alone was found.
    pub(super) failure: Option<String>,
}

/// The file for the settings of the stage.
const SETTINGS: &str = "settings.toml";
/// The folder for experiments of a commissioning that has not ended.
const EXPERIMENTS: &str = "experiments";
/// The file for settings with the PID alone, written as soon as there is one.
const PID_ALONE: &str = "settings-pid-alone.toml";

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        axis,
        into,
        request,
        output,
        ..
    } = arguments;
    let existing = into.as_deref().filter(|path| path.exists());
    let start = arguments.settings.as_deref().or(existing);
    let name = AxisName::from(*axis);
    let start = start
        .map(|path| SettingsFile::read_for_commissioning(path, name))
        .transpose()?;
    if let Some(folder) = &arguments.record {
        return arguments.run_saved(folder, start);
    }
    let stage = arguments.stage.read()?;
    let own_travel = stage
        .as_ref()
        .and_then(|stage| stage.known[axis.index()])
        .map(|known| Travel::between(known.travel_mm));
    if let (Some(stage), Some(start)) = (&stage, &start) {
        refuse_other_hardware(stage, &axes(stage), &start.stage)?;
    }
    let simulation = Simulation {
        seed: output.seed,
        stage,
        start: start.as_ref().map(|file| file.stage.clone()),
        alone: Some(name),
    };
    let mut machine = arguments.machine.open(&simulation)?;
    let job = Job {
        axis: name,
        travel: arguments.travel.or(own_travel),
        stage: simulation.stage.as_ref(),
        start,
        into: into.as_deref(),
        request,
        output,
        apply: arguments.apply,
        store: arguments.store,
    };
    let done = job.run(&mut *machine)?;
    if machine.is_simulated() {
        say!(
            "Simulated, not measured: {} axis, seed {}\n",
            axis.name(),
            output.seed
        );
    }
    terminal::print(format_args!("{}", done.text));
    match done.failure {
        Some(failure) => bail!(failure),
        None => Ok(()),
    }
}

impl Arguments {
    /// Identifies the recordings of an earlier commissioning again.
    fn run_saved(&self, folder: &Path, start: Option<SettingsFile>) -> anyhow::Result<()> {
        let Self { output, .. } = self;
        output.ready()?;
        let axis = AxisName::from(self.axis);
        let path = match &self.into {
            Some(path) => path.clone(),
            None => output.file(SETTINGS)?,
        };
        let mut file = match start {
            Some(file) => file,
            None if path.exists() => SettingsFile::read(&path)?,
            None => kept::built_in_for(axis),
        };
        kept::refuse_loss_beside(&path, &file.stage, axis)?;
        let base = file.stage.axes[axis as usize].clone();
        let found = Found {
            found: saved::read(folder, base.encoder.resolution_mm)?.commissioned(
                &base,
                &self.request.settings(),
                file.stage.rate_hz,
            )?,
            checked: None,
        };
        let who = format!("the {axis} axis, recorded in {}", folder.display());
        let output = &output.below(axis.as_str());
        let text = found.keep(output, &mut file, &path, axis, &who)?;
        terminal::print(format_args!("{text}"));
        Ok(())
    }
}

/// The settings in `path` with the machine's of this axis; those of the machine where there is no such file.
fn beside_others(
    machine: StageSettings,
    axis: AxisName,
    path: &Path,
) -> anyhow::Result<SettingsFile> {
    if !path.exists() {
        return Ok(SettingsFile::new(machine));
    }
    let mut file = SettingsFile::read(path)?;
    file.exchange_axis(&machine, axis).map_err(|what| {
        anyhow!(
            "{}: {what} there is not that of the machine; give another --out, or --settings",
            path.display()
        )
    })?;
    Ok(file)
}

/// Refuses settings that a machine takes with a restart alone, and has others of.
fn refuse_restart(
    machine: &StageSettings,
    start: &StageSettings,
    axis: AxisName,
) -> anyhow::Result<()> {
    let differing = changes(machine, start).into_iter().find(|change| {
        change.path == "rate_hz" || change.path.starts_with(&format!("{axis}/encoder/"))
    });
    if let Some(Change { path, old, new }) = differing {
        bail!(
            "the machine has {path} = {old}, and the settings to start from say {new}, which it takes with a restart: `load` them in its console, `store` and `reboot`, then commission it"
        );
    }
    Ok(())
}

/// Settings of an axis, behind its name, that a commissioning changes while it measures.
const MEASURED_UNDER: [&str; 10] = [
    "commissioned",
    "feedback/",
    "feedforward/",
    "friction/",
    "plant",
    "amplifier/output_limit_v",
    "limits/max_velocity_mm_s",
    "limits/unhomed_mm_s",
    "limits/following_error_mm",
    "limits/following_error_max_mm",
];

/// Refuses to go on with an axis that has other settings than before the first session where no measuring changes them.
fn refuse_changed(before: &StageSettings, now: AxisSettings, axis: AxisName) -> anyhow::Result<()> {
    let mut machine = before.clone();
    machine.axes[axis as usize] = now;
    let own = format!("{axis}/");
    let differing = changes(before, &machine).into_iter().find(|change| {
        let name = change.path.strip_prefix(&own).unwrap_or(&change.path);
        !MEASURED_UNDER
            .iter()
            .any(|measured| name.starts_with(measured))
    });
    if let Some(Change { path, old, new }) = differing {
        bail!(
            "the machine has {path} = {new}, and had {old} when the commissioning was begun: give it back, or leave out --resume to begin again"
        );
    }
    Ok(())
}

/// Checks that a folder holds experiments of the commissioning that `words` are of, and says what is adopted from there.
fn resumed(experiments: &Path, words: &str) -> anyhow::Result<(String, Begun)> {
    let folder = experiments.display();
    let count = Journal::count(experiments);
    if count == 0 {
        bail!(
            "nothing is to be resumed in {folder}: no commissioning was interrupted there. One that has ended is not begun again by \
             --resume; leave it out to begin"
        );
    }
    match Journal::begun(experiments) {
        Some(begun) if begun.words != words => bail!(
            "the commissioning in {folder} was begun with {}, and this is {words}: resume it with the same, or leave out --resume \
             to begin again",
            begun.words
        ),
        Some(begun) => Ok((
            format!(
                "resuming with the {count} experiments in {folder}, which were begun with {words}"
            ),
            begun,
        )),
        None => bail!(
            "{folder} does not say with which options it was begun: leave out --resume to begin again"
        ),
    }
}

/// The travel of the beginning for an axis that has moved since to `at_mm`.
fn again(axis: AxisName, begun: &Begun, at_mm: f64) -> anyhow::Result<Travel> {
    let Begun {
        at_mm: began_mm,
        travel: given,
        ..
    } = *begun;
    let moved_mm = at_mm - began_mm;
    let travel = Travel {
        negative_mm: given.negative_mm + moved_mm,
        positive_mm: given.positive_mm - moved_mm,
    };
    if travel.nearer_mm() < 0.0 {
        bail!(
            "{axis} stands at {at_mm:.3} mm, and was to stay between {:.3} and {:.3} mm when this was begun: move it back to \
             {began_mm:.3} mm, then --resume; or leave out --resume",
            began_mm - given.negative_mm,
            began_mm + given.positive_mm
        );
    }
    Ok(travel)
}

/// Says that soft limits do not count from where an axis stands that is not homed.
fn warn_of_origins(axis: AxisName, settings: &AxisSettings) {
    if let Some(soft) = settings.limits.travel_mm {
        let mark_mm = settings.homing.map_or(0.0, |homing| homing.mark_mm);
        warn!(
            "note: --travel counts from where {axis} stands; limits.travel_mm ({} to {} mm) counts from the origin that homing sets, with \
             its mark at homing.mark_mm = {mark_mm} mm: check both before {axis} is homed",
            soft.negative, soft.positive
        );
    }
}

impl Job<'_> {
    /// Commissions the axis, and writes everything that was found. The machine has its old settings afterwards unless the
    /// new ones are to act, also after an error.
    pub(super) fn run(self, machine: &mut dyn Machine) -> anyhow::Result<Done> {
        let Self { axis, output, .. } = self;
        output.ready()?;
        let travel = known_travel(machine, axis, self.travel)?;
        let folder = output.below(axis.as_str());
        folder.ready()?;
        let _held = folder.hold()?;
        let experiments = folder.file(EXPERIMENTS)?;
        let mut before = machine.settings()?;
        let settings_before = experiments.join(Journal::BEFORE);
        if self.request.resume && settings_before.exists() {
            // Where the host has died, a law that was tried may be in force.
            let first = SettingsFile::read(&settings_before)?.stage.axes[axis as usize].clone();
            let now = std::mem::replace(&mut before.axes[axis as usize], first);
            refuse_changed(&before, now, axis)?;
        }
        let mut file = match self.start {
            Some(file) => {
                refuse_restart(&before, &file.stage, axis)?;
                file
            }
            None => beside_others(before.clone(), axis, &output.file(SETTINGS)?)?,
        };
        let result = match self.into {
            Some(path) => path.to_owned(),
            None => output.file(SETTINGS)?,
        };
        kept::refuse_loss_beside(&result, &file.stage, axis)?;
        let base = file.stage.axes[axis as usize].clone();
        if self.travel.is_some() && machine.free_travel(axis)?.is_none() {
            warn_of_origins(axis, &base);
        }
        let words = self
            .request
            .words(output.seed, self.travel, self.stage, &base);
        let at_mm = machine.position_mm(axis)?;
        let begun = if self.request.resume {
            let (text, begun) = resumed(&experiments, &words)?;
            warn!("{text}");
            begun
        } else {
            Begun {
                words,
                at_mm,
                travel,
            }
        };
        let travel = again(axis, &begun, at_mm)?;
        let outcome = {
            let mut test_axis = machine.test_axis(axis, travel)?;
            let mut journal = Journal::open(&mut *test_axis, &experiments, self.request.resume)
                .with_context(|| format!("cannot keep experiments in {}", experiments.display()))?;
            journal
                .begin(&begun)
                .with_context(|| format!("cannot write into {}", experiments.display()))?;
            SettingsFile::new(before.clone()).write(&settings_before, whole::write)?;
            for path in journal.foreign() {
                warn!("{} was not written here, and stays", path.display());
            }
            let mut early = PidAlone {
                file: file.clone(),
                axis,
                path: folder.file(PID_ALONE)?,
                written: None,
            };
            let outcome = self
                .request
                .run(&mut journal, &base, output.seed, &mut early);
            early.said_in(outcome)
        };
        let restored = machine.load(&before);
        let found = match outcome {
            Ok(found) => found,
            Err(error) => {
                let back = if restored.is_ok() {
                    "; the machine has its old settings back, its outputs off"
                } else {
                    ""
                };
                let error = if Journal::count(&experiments) == 0 {
                    Journal::remove(&experiments)?;
                    error.context(format!(
                        "the commissioning has ended before anything was measured{back}"
                    ))
                } else {
                    error.context(format!(
                        "the commissioning has ended early{back}; with --resume it goes on with what is in {}",
                        experiments.display()
                    ))
                };
                return and_restored(Err(error), restored);
            }
        };

        let who = format!("the {axis} axis of {}", machine.description());
        let better = found.is_better_than_pid();
        let path = if better {
            result
        } else {
            folder.file(PID_ALONE)?
        };
        let mut text = found.keep(&folder, &mut file, &path, axis, &who)?;
        Journal::remove(&experiments)?;
        if let Err(error) = and_restored(Ok(()), restored) {
            return Ok(Done {
                text,
                data: json!({ "settings": path, "better_than_pid": better }),
                failure: Some(format!(
                    "{}; `reboot` gives it those that it has stored",
                    quadrant_cli::explained(&error)
                )),
            });
        }
        if self.apply && better {
            machine
                .load(&file.stage)
                .context("the settings that were found")?;
            text.push_str("The settings act; the outputs are off.\n");
        }
        if self.store && better {
            let origin = format!("quadrant {} commission {axis}", env!("CARGO_PKG_VERSION"));
            machine.store(&origin)?;
            text.push_str("They are kept for the next start.\n");
        }
        let drift = found.found.drift_note();
        text.extend(drift.iter().map(|note| format!("{note}\n")));
        let verdict: Vec<_> = found
            .found
            .verification
            .iter()
            .flat_map(|verification| &verification.laws)
            .filter_map(|law| {
                let first = law.scores.first()?;
                Some(json!({ "law": law.law, "rms_um": 1e3 * first.rms_mm }))
            })
            .collect();
        let data = json!({
            "settings": path,
            "verdict": verdict,
            "better_than_pid": better,
            "drift": found.found.verification.as_ref().map(|tried| tried.drift.ratio()),
            "applied": self.apply && better,
            "stored": self.store && better,
        });
        let failure = (!better).then(|| {
            format!(
                "nothing was better than the PID alone on every sine; its settings are in {}, and the page beside them shows what \
                 was tried",
                path.display()
            )
        });
        Ok(Done {
            text,
            data,
            failure,
        })
    }
}

/// The settings of the PID alone, in a file from when there is one: what ends early after it leaves an axis that can be driven.
struct PidAlone {
    file: SettingsFile,
    axis: AxisName,
    path: PathBuf,
    written: Option<anyhow::Result<()>>,
}

impl PidAlone {
    fn keep(&mut self, settings: &AxisSettings) {
        self.file.stage.axes[self.axis as usize] = settings.clone();
        self.written = Some(
            self.file
                .write(&self.path, whole::write)
                .map_err(Into::into),
        );
    }

    /// Says in an error where the settings are.
    fn said_in<T>(self, outcome: anyhow::Result<T>) -> anyhow::Result<T> {
        let path = self.path.display();
        match (outcome, self.written) {
            (Err(error), Some(Ok(()))) => {
                Err(error.context(format!("the settings with the PID alone are in {path}")))
            }
            (Err(error), Some(Err(unwritten))) => Err(error.context(format!(
                "the settings with the PID alone could not be written into {path}: {unwritten:#}"
            ))),
            (outcome, _) => outcome,
        }
    }
}

/// A progress bar, and the file of the PID.
struct Watching<'a> {
    report: &'a mut dyn FnMut(&'static str, f64),
    pid: &'a mut PidAlone,
}

impl Watch for Watching<'_> {
    fn progress(&mut self, step: &'static str, share: f64) {
        (self.report)(step, share);
    }

    fn pid(&mut self, settings: &AxisSettings) {
        self.pid.keep(settings);
    }
}

impl Request {
    fn settings(&self) -> CommissionSettings {
        let margins = self.gain_margin_db.zip(self.phase_margin_deg);
        CommissionSettings {
            target: margins.map(|(gain_margin_db, phase_margin_deg)| Target::Margins {
                gain_margin_db,
                phase_margin_deg,
                crossover_hz: None,
            }),
            ..CommissionSettings::default()
        }
    }

    /// The only thing that a commissioning can be resumed with: seed, options, the stage of one's own, and the settings of the axis that it
    /// starts from.
    fn words(
        &self,
        seed: u64,
        travel: Option<Travel>,
        stage: Option<&StageFile>,
        base: &AxisSettings,
    ) -> String {
        let mut words = format!("--seed {seed}");
        if let Some(travel) = travel {
            let _ = write!(
                words,
                " --travel -{}..{}",
                travel.negative_mm, travel.positive_mm
            );
        }
        for (option, value) in [
            ("--gain-margin-db", self.gain_margin_db),
            ("--phase-margin-deg", self.phase_margin_deg),
        ] {
            if let Some(value) = value {
                let _ = write!(words, " {option} {value}");
            }
        }
        if self.quick {
            words.push_str(" --quick");
        }
        let number = |text: String| {
            let mut hasher = DefaultHasher::new();
            text.hash(&mut hasher);
            hasher.finish() as u32
        };
        if let Some(stage) = stage {
            let truth = number(format!("{:?}", stage.truth));
            let _ = write!(
                words,
                " --stage {} of number {truth:08x}",
                stage.path.display()
            );
        }
        let settings = number(format!("{base:?}"));
        let _ = write!(words, " and settings number {settings:08x}");
        words
    }

    /// Commissions the axis under test, shows a progress bar, and keeps the PID as soon as there is one.
    fn run(
        &self,
        test_axis: &mut dyn TestAxis,
        base: &AxisSettings,
        seed: u64,
        pid: &mut PidAlone,
    ) -> anyhow::Result<Found> {
        let request = self.settings();
        let info = test_axis.info();
        // Before anything moves, and not among the results.
        warn!(
            "{}\n",
            plan_table(&info, &plan(&info, &request)).to_text(terminal::error_width())
        );
        let bar = share("commissioning");
        let mut report = |step, done: f64| {
            bar.set_message(step);
            bar.set_position((1000.0 * done) as u64);
        };
        let mut watch = Watching {
            report: &mut report,
            pid,
        };
        let found = commission(test_axis, base, &request, &mut watch)?;
        let checked = if self.quick {
            None
        } else {
            bar.enable_steady_tick(Duration::from_millis(200));
            Some(CrossCheck::run(
                test_axis,
                &found.settings,
                seed,
                &mut report,
            ))
        };
        bar.finish_and_clear();
        Ok(Found { found, checked })
    }
}

impl Found {
    /// False if the trials found nothing better than the PID alone.
    fn is_better_than_pid(&self) -> bool {
        let verification = self.found.verification.as_ref();
        verification.is_none_or(|verification| verification.is_better_than_pid())
    }

    /// The cross-checks, where they were made.
    fn checked(&self) -> Option<&CrossCheck> {
        self.checked.as_ref()?.as_ref().ok()
    }

    fn tables(&self) -> Vec<Table> {
        let found = &self.found;
        let [parameters, bands] = plant_tables(&found.plant);
        let (_, friction, _) = &found.friction;
        let mut tables = vec![
            motor_constant_table(&found.motor, None),
            parameters,
            bands,
            friction_table(friction),
        ];
        tables.extend(found.presliding.0.as_ref().ok().map(gms_table));
        tables.push(gains_table(found));
        tables.extend(found.verification.as_ref().map(results_table));
        if let Some(checked) = self.checked() {
            tables.push(revise_table(&found.plant.plant, &checked.revisions));
        }
        tables
    }

    /// The tables for a terminal.
    fn text(&self) -> String {
        let mut text = String::new();
        for table in self.tables() {
            let _ = writeln!(text, "{}\n", table.to_text(terminal::output_width()));
        }
        let mut notes = self.found.notes();
        // What was found is not lost for a check that could not be made.
        if let Some(Err(error)) = &self.checked {
            notes.push(format!("The cross-checks were not made: {error}."));
        }
        for note in notes {
            let lines = wrapped(&note, terminal::output_width());
            let _ = writeln!(text, "{}\n", lines.join("\n"));
        }
        let agreement = self
            .checked()
            .and_then(|checked| checked.inertia_agreement(&self.found.settings));
        if let Some(agreement) = agreement {
            let _ = writeln!(
                text,
                "An ordinary motion gives {agreement:.3} times the A of the frequency response.\n"
            );
        }
        text
    }

    /// Writes everything: recordings, tables, the page, and the settings, which become those of `file`. Returns the settings that change, the
    /// tables, the verdict, and lines that say what is where: the result is what a person sees last.
    fn keep(
        &self,
        output: &Output,
        file: &mut SettingsFile,
        path: &Path,
        axis: AxisName,
        who: &str,
    ) -> anyhow::Result<String> {
        let (found, checked) = (&self.found, self.checked());
        let command = command_line();
        // Seen from the settings' file.
        let records = saved::write(output, found, checked)?;
        let records = records
            .iter()
            .map(|name| format!("{axis}/{name}"))
            .collect();
        let start = file.stage.clone();
        file.stage.axes[axis as usize] = found.settings.clone();
        file.add_provenance(
            &command,
            axis.as_str(),
            records,
            &["feedback", "friction", "feedforward", "plant"],
        );
        let mut text = kept::write(file, &start, path)?.join("\n");
        if !text.is_empty() {
            text.push_str("\n\n");
        }
        text.push_str(&self.text());
        for table in self.tables() {
            output.keep_table(&table)?;
        }
        let page = commission_page(who, found, checked, provenance(&command, output.seed));
        let _ = writeln!(text, "{}: the settings of the stage", path.display());
        for line in output.keep_page(&page, "commission.html")? {
            let _ = writeln!(text, "{line}");
        }
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use quadrant_host::machine::LawStage;
    use quadrant_tune::record::Recording;
    use quadrant_tune::test_axis::{AxisInfo, Experiment, ExperimentError, MachineError};

    use super::*;

    /// The simulated stage, with an axis on which one kind of experiment goes wrong.
    struct Spoilt {
        stage: LawStage,
        /// True if nothing can be measured; else every law but the PID shakes the axis.
        dead: bool,
        /// True if the machine takes no settings any more.
        deaf: bool,
        /// The beginning of the name of experiments at which the line is cut.
        cut_at: Option<&'static str>,
        /// The same of experiments that a person interrupts.
        interrupted_at: Option<&'static str>,
    }

    struct SpoiltAxis<'a> {
        axis: Box<dyn TestAxis + 'a>,
        dead: bool,
        cut_at: Option<&'static str>,
        interrupted_at: Option<&'static str>,
    }

    impl Spoilt {
        /// A stage on which no law is better than the PID.
        fn new() -> Self {
            Self {
                stage: LawStage::new(1),
                dead: false,
                deaf: false,
                cut_at: None,
                interrupted_at: None,
            }
        }
    }

    impl Machine for Spoilt {
        fn description(&self) -> String {
            self.stage.description()
        }

        fn is_simulated(&mut self) -> bool {
            true
        }

        fn settings(&mut self) -> Result<StageSettings, MachineError> {
            self.stage.settings()
        }

        fn position_mm(&mut self, axis: AxisName) -> Result<f64, MachineError> {
            self.stage.position_mm(axis)
        }

        fn free_travel(&mut self, axis: AxisName) -> Result<Option<Travel>, MachineError> {
            self.stage.free_travel(axis)
        }

        fn test_axis(
            &mut self,
            axis: AxisName,
            travel: Travel,
        ) -> Result<Box<dyn TestAxis + '_>, MachineError> {
            Ok(Box::new(SpoiltAxis {
                dead: self.dead,
                cut_at: self.cut_at,
                interrupted_at: self.interrupted_at,
                axis: self.stage.test_axis(axis, travel)?,
            }))
        }

        fn load(&mut self, settings: &StageSettings) -> Result<(), MachineError> {
            if self.deaf {
                return Err(MachineError::Connection("the cable is out".into()));
            }
            self.stage.load(settings)
        }

        fn store(&mut self, provenance: &str) -> Result<(), MachineError> {
            self.stage.store(provenance)
        }
    }

    impl TestAxis for SpoiltAxis<'_> {
        fn info(&self) -> AxisInfo {
            self.axis.info()
        }

        fn settings(&self) -> &AxisSettings {
            self.axis.settings()
        }

        fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
            self.axis.apply(settings)
        }

        fn switch_off(&mut self) -> Result<(), ExperimentError> {
            self.axis.switch_off()
        }

        fn perform(
            &mut self,
            experiment: &Experiment,
            progress: &mut dyn FnMut(f64),
        ) -> Result<Recording, ExperimentError> {
            let is_cut = |at| experiment.name.starts_with(at);
            if self.dead || self.cut_at.is_some_and(is_cut) {
                return Err(ExperimentError::Impossible {
                    experiment: experiment.name.clone(),
                    reason: "the line is cut".to_owned(),
                });
            }
            if self.interrupted_at.is_some_and(is_cut) {
                return Err(ExperimentError::Interrupted {
                    experiment: experiment.name.clone(),
                    done: "the axes have stopped".to_owned(),
                });
            }
            let mut recording = self.axis.perform(experiment, progress)?;
            let name = &experiment.name;
            if name.starts_with("N-PID") || name.starts_with("PID + ") {
                for position_mm in recording.position_mm.iter_mut().step_by(2) {
                    *position_mm += 0.5;
                }
            }
            Ok(recording)
        }
    }

    #[derive(clap::Parser)]
    struct Words {
        #[command(flatten)]
        request: Request,
        #[command(flatten)]
        output: Output,
    }

    /// A quick commissioning of x into a folder.
    fn commission_into(folder: &Path, machine: &mut Spoilt) -> anyhow::Result<Done> {
        commission_with(folder, machine, &[])
    }

    fn commission_with(folder: &Path, machine: &mut Spoilt, more: &[&str]) -> anyhow::Result<Done> {
        commission_from(None, folder, machine, more)
    }

    fn commission_from(
        start: Option<SettingsFile>,
        folder: &Path,
        machine: &mut Spoilt,
        more: &[&str],
    ) -> anyhow::Result<Done> {
        let words = ["", "--quick", "--out"].map(std::ffi::OsStr::new);
        let words = words.into_iter().chain([folder.as_os_str()]);
        let words = words.chain(more.iter().map(std::ffi::OsStr::new));
        let Words { request, output } = clap::Parser::parse_from(words);
        let job = Job {
            axis: AxisName::X,
            travel: Some(Travel::either_way(30.0)),
            stage: None,
            start,
            into: None,
            request: &request,
            output: &output,
            apply: true,
            store: false,
        };
        job.run(machine)
    }

    #[test]
    fn where_nothing_beats_the_pid_it_fails_and_its_settings_are_in_the_folder_of_the_axis() {
        let folder = tempfile::tempdir().unwrap();
        let mut machine = Spoilt::new();
        let before = machine.settings().unwrap();
        let done = commission_into(folder.path(), &mut machine).unwrap();
        let kept = folder.path().join("x").join(PID_ALONE);
        let failure = done.failure.unwrap();
        assert!(failure.contains(&*kept.to_string_lossy()), "{failure}");
        let axis = &SettingsFile::read(&kept).unwrap().stage.axes[0];
        assert_eq!(
            axis.feedback.law,
            quadrant_law::control::feedback::LawKind::Pid
        );
        assert!(!folder.path().join(SETTINGS).exists());
        assert_eq!(done.data["applied"], false);
        assert_eq!(machine.settings().unwrap(), before);
    }

    #[test]
    fn settings_of_another_rate_or_encoder_than_the_machines_are_refused_before_anything_is_measured()
     {
        let folder = tempfile::tempdir().unwrap();
        let mut machine = Spoilt {
            // Every measurement would add an error of its own.
            dead: true,
            ..Spoilt::new()
        };
        let before = machine.settings().unwrap();
        let mut said = |change: fn(&mut StageSettings)| {
            let mut stage = before.clone();
            change(&mut stage);
            let start = Some(SettingsFile::new(stage));
            let outcome = commission_from(start, folder.path(), &mut machine, &[]);
            quadrant_cli::explained(&outcome.err().unwrap())
        };
        let rate = said(|stage| stage.rate_hz = 5e3);
        assert!(rate.contains("rate_hz = 10000"), "{rate}");
        assert!(
            rate.contains("say 5000") && rate.contains("`reboot`"),
            "{rate}"
        );
        let encoder = said(|stage| stage.axes[0].encoder.resolution_mm *= 2.0);
        assert!(encoder.contains("x/encoder/resolution_mm"), "{encoder}");
        // That of another axis is none of this commissioning's.
        let other = said(|stage| stage.axes[1].encoder.resolution_mm *= 2.0);
        assert!(other.contains("the line is cut"), "{other}");
    }

    #[test]
    fn nothing_is_to_be_resumed_where_nothing_was_measured() {
        let folder = tempfile::tempdir().unwrap();
        let mut machine = Spoilt {
            dead: true,
            ..Spoilt::new()
        };
        let error = commission_into(folder.path(), &mut machine).err().unwrap();
        let said = quadrant_cli::explained(&error);
        assert!(said.contains("the line is cut"), "{said}");
        assert!(!said.contains("--resume"), "{said}");
        assert!(!folder.path().join("x").join(EXPERIMENTS).exists());
    }

    #[test]
    fn an_interruption_among_the_trials_is_no_verdict_and_keeps_the_experiments() {
        for at in ["knock at rest", "PID on", "N-PID on", "N-PID + static on"] {
            let folder = tempfile::tempdir().unwrap();
            let mut machine = Spoilt {
                interrupted_at: Some(at),
                ..Spoilt::new()
            };
            let error = commission_into(folder.path(), &mut machine).err().unwrap();
            let said = quadrant_cli::explained(&error);
            assert!(said.contains("interrupted in"), "{at}: {said}");
            assert!(said.contains("--resume"), "{at}: {said}");
            assert!(Journal::count(&folder.path().join("x").join(EXPERIMENTS)) > 100);
        }
    }

    #[test]
    fn a_folder_into_which_another_command_commissions_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let mut machine = Spoilt {
            interrupted_at: Some("PID on"),
            ..Spoilt::new()
        };
        assert!(commission_into(folder.path(), &mut machine).is_err());
        let experiments = folder.path().join("x").join(EXPERIMENTS);
        let kept = Journal::count(&experiments);
        let other = std::fs::File::open(folder.path().join("x")).unwrap();
        other.lock().unwrap();
        let error = commission_into(folder.path(), &mut machine).err().unwrap();
        let said = quadrant_cli::explained(&error);
        assert!(said.contains("another command measures into"), "{said}");
        assert_eq!(Journal::count(&experiments), kept);
        assert!(Journal::begun(&experiments).is_some());
    }

    #[test]
    fn what_ends_early_after_there_is_a_pid_leaves_its_settings_and_says_where() {
        let folder = tempfile::tempdir().unwrap();
        let mut machine = Spoilt {
            cut_at: Some("friction at"),
            ..Spoilt::new()
        };
        let error = commission_into(folder.path(), &mut machine).err().unwrap();
        let said = quadrant_cli::explained(&error);
        let path = folder.path().join("x").join(PID_ALONE);
        assert!(said.contains(&path.display().to_string()), "{said}");
        let kept = SettingsFile::read(&path).unwrap().stage;
        assert!(kept.axes[0].feedback.pid.kp_v_per_mm > 0.5);
        assert!(kept.axes[0].plant.is_some());
        kept.validate(quadrant_law::friction::gms::FIRMWARE_ELEMENTS)
            .unwrap();
    }

    #[test]
    fn what_was_interrupted_is_resumed_with_the_same_options_alone_and_what_has_ended_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let mut machine = Spoilt {
            cut_at: Some("frequency response"),
            ..Spoilt::new()
        };
        let said = |outcome: anyhow::Result<Done>| match outcome {
            Ok(_) => String::new(),
            Err(error) => quadrant_cli::explained(&error),
        };
        let early = said(commission_with(folder.path(), &mut machine, &["--resume"]));
        assert!(early.contains("nothing is to be resumed"), "{early}");
        let cut = said(commission_into(folder.path(), &mut machine));
        assert!(cut.contains("--resume"), "{cut}");
        // A host that died left a law that it tried in force.
        let before = machine.settings().unwrap();
        let mut tried = before.clone();
        tried.axes[0].feedback.pid.kp_v_per_mm *= 0.9;
        machine.load(&tried).unwrap();
        let again = said(commission_with(folder.path(), &mut machine, &["--resume"]));
        assert!(again.contains("the line is cut"), "{again}");
        assert_eq!(machine.settings().unwrap(), before);
        // What a person has changed is not undone.
        let mut turned = before.clone();
        turned.axes[0].amplifier.reversed = true;
        machine.load(&turned).unwrap();
        let other = said(commission_with(folder.path(), &mut machine, &["--resume"]));
        assert!(other.contains("x/amplifier/reversed = true"), "{other}");
        assert_eq!(machine.settings().unwrap(), turned);
        machine.load(&before).unwrap();
        machine.cut_at = None;
        let kept = Journal::count(&folder.path().join("x").join(EXPERIMENTS));
        for options in [
            &["--resume", "--seed", "2"][..],
            &[
                "--resume",
                "--gain-margin-db",
                "12",
                "--phase-margin-deg",
                "60",
            ],
        ] {
            let other = said(commission_with(folder.path(), &mut machine, options));
            assert!(other.contains("begun with --seed 1"), "{other}");
            assert!(other.contains(&options[1..].join(" ")), "{other}");
        }
        assert_eq!(
            Journal::count(&folder.path().join("x").join(EXPERIMENTS)),
            kept
        );
        let experiments = folder.path().join("x").join(EXPERIMENTS);
        let begun = Journal::begun(&experiments).unwrap();
        let (adopted, _) = resumed(&experiments, &begun.words).unwrap();
        assert!(
            adopted.contains(&format!("{kept} experiments in")),
            "{adopted}"
        );
        Journal::remove(&experiments).unwrap();
        let ended = said(commission_with(folder.path(), &mut machine, &["--resume"]));
        assert!(ended.contains("has ended is not begun again"), "{ended}");
    }

    #[test]
    fn a_resumed_axis_keeps_the_travel_that_it_was_begun_with_wherever_it_stands() {
        let begun = Begun {
            words: String::new(),
            at_mm: 100.0,
            travel: Travel {
                negative_mm: 3.0,
                positive_mm: 20.0,
            },
        };
        // Begun at 100 mm, interrupted at 106: from 97 to 120 mm as before.
        let travel = again(AxisName::X, &begun, 106.0).unwrap();
        assert_eq!((travel.negative_mm, travel.positive_mm), (9.0, 14.0));
        let refused = again(AxisName::X, &begun, 0.0).unwrap_err().to_string();
        for part in [
            "stands at 0.000 mm",
            "97.000 and 120.000",
            "back to 100.000 mm",
        ] {
            assert!(refused.contains(part), "{part}: {refused}");
        }
    }

    #[test]
    fn a_commissioning_is_resumed_on_the_same_stage_of_ones_own_alone() {
        let Words { request, .. } = clap::Parser::parse_from([""]);
        let base = StageSettings::simulated().axes[0].clone();
        let words = |text: &str| {
            let stage = StageFile::parse(text, Path::new("mine.toml")).unwrap();
            request.words(1, None, Some(&stage), &base)
        };
        let light = words("[x]\nmass_kg = 10\n");
        assert!(light.contains("--stage mine.toml"), "{light}");
        assert_eq!(light, words("[x]\n"));
        assert_ne!(light, words("[x]\nmass_kg = 11\n"));
        assert_ne!(light, request.words(1, None, None, &base));
    }

    #[test]
    fn results_are_written_and_errors_reported_though_the_machine_does_not_take_its_settings_back()
    {
        for dead in [false, true] {
            let folder = tempfile::tempdir().unwrap();
            let mut machine = Spoilt {
                dead,
                deaf: true,
                ..Spoilt::new()
            };
            let said = match commission_into(folder.path(), &mut machine) {
                Ok(done) => {
                    assert!(done.text.contains("pid-alone"), "{}", done.text);
                    done.failure.unwrap()
                }
                Err(error) => quadrant_cli::explained(&error),
            };
            assert!(said.contains("the cable is out"), "{said}");
            assert_eq!(said.contains("the line is cut"), dead, "{said}");
            let kept = folder.path().join("x").join(PID_ALONE);
            assert_eq!(kept.exists(), !dead, "{said}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn nothing_is_written_through_a_link_and_nothing_deleted_that_is_not_its_own() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let [out, elsewhere] = ["out", "elsewhere"].map(|name| folder.path().join(name));
        let all = || {
            let entries = std::fs::read_dir(&elsewhere).unwrap();
            entries.count()
        };
        std::fs::create_dir_all(out.join("x/experiments")).unwrap();
        std::fs::create_dir(&elsewhere).unwrap();
        let mut machine = Spoilt {
            dead: true,
            ..Spoilt::new()
        };
        let mut refused = || {
            let error = commission_into(&out, &mut machine).err().unwrap();
            quadrant_cli::explained(&error)
        };
        let notes = out.join("x/experiments/notes.txt");
        std::fs::write(&notes, "three weeks of work").unwrap();
        let said = refused();
        assert!(said.contains("the line is cut"), "{said}");
        assert!(notes.exists());

        for link in ["x", "x/figures", "settings.toml", "x/experiments"] {
            let link = out.join(link);
            let moved = folder.path().join("moved");
            let was_there = std::fs::rename(&link, &moved).is_ok();
            std::fs::create_dir_all(link.parent().unwrap()).unwrap();
            symlink(&elsewhere, &link).unwrap();
            let said = refused();
            assert!(said.contains("link"), "{}: {said}", link.display());
            assert!(said.contains(link.to_str().unwrap()), "{said}");
            assert_eq!(all(), 0, "{}", link.display());
            std::fs::remove_file(&link).unwrap();
            if was_there {
                std::fs::rename(&moved, &link).unwrap();
            }
        }
        // One that is asked for may be a link itself.
        let asked = folder.path().join("asked");
        symlink(&elsewhere, &asked).unwrap();
        let error = commission_into(&asked, &mut machine).err().unwrap();
        let said = quadrant_cli::explained(&error);
        assert!(said.contains("the line is cut"), "{said}");
        assert!(elsewhere.join("x").exists());
    }
}
