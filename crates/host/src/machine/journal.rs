//! A journal of experiments: each is kept when it has ended, so that a series that was interrupted goes on where it stood.

use std::fs::{self, FileType};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};

use quadrant_law::axes::AxisName;
use quadrant_law::safety::{Fault, FaultCode};
use quadrant_settings::AxisSettings;
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::{
    AxisInfo, Drive, Experiment, ExperimentError, MachineError, TestAxis, Travel, approach,
};
use quadrant_written::whole;
use serde::{Deserialize, Serialize};

/// Extension of a file with an experiment.
const KEPT: &str = "json";
/// File of the words that say what the experiments are of.
const REQUEST: &str = "request.txt";

/// A test axis whose experiments are kept in a folder. Those that are there already are not run again, as long as they are the
/// same experiments under the same settings in the same order; settings act only once an experiment is run. One that was stopped
/// is stopped again, as long as the series went on after it.
pub struct Journal<'a> {
    axis: &'a mut dyn TestAxis,
    folder: PathBuf,
    /// Number of the next experiment.
    next: usize,
    /// The next experiment may be in the folder.
    known: bool,
    settings: AxisSettings,
    /// The settings are not in force yet.
    pending: bool,
    /// The outputs are to be off before the next experiment.
    begins_off: bool,
    /// The recording of the last experiment, if that was stopped.
    interrupted: Option<Recording>,
    /// Position at the end of the last experiment that was in the folder, mm.
    left_at_mm: Option<f64>,
    /// Travel of the axis from where it stood when the series was begun.
    travel: Option<Travel>,
    /// Files in the folder that no journal has written: they stay.
    foreign: Vec<PathBuf>,
}

/// The beginning of a series of experiments.
#[derive(Clone, Debug, PartialEq)]
pub struct Begun {
    /// Its options, in words.
    pub words: String,
    /// The machine's position of the axis, mm.
    pub at_mm: f64,
    /// The travel from there.
    pub travel: Travel,
}

/// An experiment that has ended.
#[derive(Serialize, Deserialize)]
struct Entry {
    name: String,
    /// Distinguishes the experiment and its settings from others.
    key: u64,
    /// Of an experiment that was stopped, up to there, if anything is left of it.
    recording: Option<Recording>,
    stopped: Option<Stopped>,
    /// Of all of the above, by which a file is found that was changed since.
    sum: u64,
}

impl Entry {
    fn new(name: &str, key: u64, recording: Option<Recording>, stopped: Option<Stopped>) -> Self {
        let mut entry = Self {
            name: name.to_owned(),
            key,
            recording,
            stopped,
            sum: 0,
        };
        entry.sum = entry.total();
        entry
    }

    fn total(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (&self.name, self.key, format!("{:?}", self.stopped)).hash(&mut hasher);
        if let Some(recording) = &self.recording {
            recording.sample_time_s.to_bits().hash(&mut hasher);
            for column in [
                &recording.reference_mm,
                &recording.position_mm,
                &recording.voltage_v,
                &recording.injection_v,
            ] {
                column.len().hash(&mut hasher);
                column
                    .iter()
                    .for_each(|value| value.to_bits().hash(&mut hasher));
            }
        }
        hasher.finish()
    }

    /// Checks what a file holds, as a recording that is read from one is.
    fn check(&self, path: &Path, decimation: usize) -> Result<(), String> {
        if let Some(recording) = &self.recording {
            let checked = recording.check(path, decimation);
            checked.map_err(|error| error.to_string())?;
        }
        if self.sum != self.total() {
            return Err(format!(
                "{}, sum: {}, and its content comes to {}: the file was changed since it was written",
                path.display(),
                self.sum,
                self.total()
            ));
        }
        Ok(())
    }
}

/// Reason for which an experiment was stopped: one of those after which a series may go on with another.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
enum Stopped {
    Travel {
        travel_mm: f64,
        time_s: f64,
    },
    Overspeed {
        max_velocity_mm_s: f64,
        time_s: f64,
    },
    Fault {
        number: u8,
        axis: Option<AxisName>,
        tick: u32,
    },
}

impl Stopped {
    /// The reason in an error; none of one that is no property of the axis, a broken connection for instance.
    fn of(error: &ExperimentError) -> Option<Self> {
        match *error {
            ExperimentError::Travel {
                travel_mm, time_s, ..
            } => Some(Self::Travel { travel_mm, time_s }),
            ExperimentError::Overspeed {
                max_velocity_mm_s,
                time_s,
                ..
            } => Some(Self::Overspeed {
                max_velocity_mm_s,
                time_s,
            }),
            ExperimentError::Fault { fault, .. } => Some(Self::Fault {
                number: fault.code.number(),
                axis: fault.axis,
                tick: fault.tick,
            }),
            ExperimentError::Motion { .. }
            | ExperimentError::Impossible { .. }
            | ExperimentError::Interrupted { .. }
            | ExperimentError::TimedOut { .. } => None,
        }
    }

    /// The error that it was; none of a fault that this release does not know.
    fn error(self, experiment: String) -> Option<ExperimentError> {
        Some(match self {
            Self::Travel { travel_mm, time_s } => ExperimentError::Travel {
                experiment,
                travel_mm,
                time_s,
            },
            Self::Overspeed {
                max_velocity_mm_s,
                time_s,
            } => ExperimentError::Overspeed {
                experiment,
                max_velocity_mm_s,
                time_s,
            },
            Self::Fault { number, axis, tick } => ExperimentError::Fault {
                experiment,
                fault: Fault {
                    code: FaultCode::from_number(number)?,
                    axis,
                    tick,
                },
            },
        })
    }
}

impl<'a> Journal<'a> {
    /// Name of a file in the folder for the settings that the machine had before, which the caller may keep there.
    pub const BEFORE: &'static str = "before.toml";

    /// A journal in a folder, which is made. Without `resume`, the experiments there are deleted, and [nothing
    /// else](Self::foreign).
    ///
    /// # Errors
    /// A folder that is a link, or that cannot be made or emptied; a file that is no experiment under the name of one.
    pub fn open(axis: &'a mut dyn TestAxis, folder: &Path, resume: bool) -> io::Result<Self> {
        let foreign = match resume {
            true => Vec::new(),
            false => Self::remove(folder)?,
        };
        fs::create_dir_all(folder)?;
        is_there(folder)?;
        Ok(Self {
            settings: axis.settings().clone(),
            travel: None,
            axis,
            folder: folder.to_owned(),
            next: 0,
            known: resume,
            begins_off: false,
            pending: false,
            interrupted: None,
            left_at_mm: None,
            foreign,
        })
    }

    /// Files that were in the folder, and that no journal has written: they were not deleted.
    pub fn foreign(&self) -> &[PathBuf] {
        &self.foreign
    }

    /// Deletes the experiments in a folder, and the folder if nothing else is in it: nothing is to be resumed. Returns what
    /// stays.
    ///
    /// # Errors
    /// A folder that is a link, or a file that cannot be deleted or is no experiment under the name of one: nothing is deleted
    /// then.
    pub fn remove(folder: &Path) -> io::Result<Vec<PathBuf>> {
        if !is_there(folder)? {
            return Ok(Vec::new());
        }
        let (mut own, mut foreign) = (Vec::new(), Vec::new());
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let path = entry.path();
            match is_own(&path, entry.file_type()?)? {
                true => own.push(path),
                false => foreign.push(path),
            }
        }
        for path in own {
            fs::remove_file(path)?;
        }
        if foreign.is_empty() {
            fs::remove_dir(folder)?;
        }
        foreign.sort();
        Ok(foreign)
    }

    /// The number of experiments that are kept in a folder.
    pub fn count(folder: &Path) -> usize {
        let kept = |entry: &fs::DirEntry| is_named(&entry.path());
        fs::read_dir(folder).map_or(0, |entries| entries.flatten().filter(kept).count())
    }

    /// Begins a series, or goes on with one: keeps what it is of, for [`begun`](Self::begun), and gives its travel to the experiments.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn begin(&mut self, begun: &Begun) -> io::Result<()> {
        self.travel = Some(begun.travel);
        let Begun {
            words,
            at_mm,
            travel,
        } = begun;
        let text = format!(
            "{words}\n{at_mm} {} {}\n",
            travel.negative_mm, travel.positive_mm
        );
        whole::replace(&self.folder.join(REQUEST), text.into_bytes())
    }

    /// The beginning of the series in a folder, if it was kept.
    pub fn begun(folder: &Path) -> Option<Begun> {
        let text = fs::read_to_string(folder.join(REQUEST)).ok()?;
        let (words, numbers) = text.trim_end().rsplit_once('\n')?;
        let numbers: Vec<f64> = (numbers.split(' '))
            .map(|number| number.parse().ok())
            .collect::<Option<_>>()?;
        let &[at_mm, negative_mm, positive_mm] = numbers.as_slice() else {
            return None;
        };
        Some(Begun {
            words: words.to_owned(),
            at_mm,
            travel: Travel {
                negative_mm,
                positive_mm,
            },
        })
    }

    fn key(&self, experiment: &Experiment) -> u64 {
        let mut hasher = DefaultHasher::new();
        format!("{experiment:?} {:?}", self.settings).hash(&mut hasher);
        hasher.finish()
    }

    /// The file of an experiment.
    fn path(&self, number: usize) -> PathBuf {
        self.folder.join(format!("{number:03}.{KEPT}"))
    }

    /// The outcome of the next experiment, if it is kept.
    ///
    /// # Errors
    /// A file that is none, or was changed.
    fn kept(
        &mut self,
        key: u64,
        decimation: usize,
    ) -> Result<Option<Result<Recording, ExperimentError>>, String> {
        let path = self.path(self.next);
        let bytes = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            read => read.map_err(|error| format!("{}: {error}", path.display()))?,
        };
        let entry: Entry = serde_json::from_slice(&bytes)
            .map_err(|error| format!("{}: {error}", path.display()))?;
        if entry.key != key {
            return Ok(None);
        }
        entry.check(&path, decimation)?;
        let Some(stopped) = entry.stopped else {
            return Ok(entry.recording.map(Ok));
        };
        // One that ended the series is tried again.
        if !self.path(self.next + 1).exists() {
            return Ok(None);
        }
        let Some(error) = stopped.error(entry.name) else {
            return Ok(None);
        };
        self.interrupted = entry.recording;
        Ok(Some(Err(error)))
    }
}

/// True if a folder is there; no link to one, through which files elsewhere would be deleted and written.
fn is_there(folder: &Path) -> io::Result<bool> {
    match fs::symlink_metadata(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
        Ok(seen) if seen.is_dir() => Ok(true),
        Ok(_) => Err(io::Error::new(
            io::ErrorKind::NotADirectory,
            format!(
                "{} is no folder, or a link to one: remove it, or give another folder for results",
                folder.display()
            ),
        )),
    }
}

/// True for the name of an experiment's file.
fn is_named(path: &Path) -> bool {
    let number = path.file_stem().and_then(|stem| stem.to_str());
    path.extension().is_some_and(|extension| extension == KEPT)
        && number.is_some_and(|number| {
            number.len() >= 3 && number.bytes().all(|sign| sign.is_ascii_digit())
        })
}

/// True if a journal has written the file.
///
/// # Errors
/// It has the name of an experiment, and is none: a journal would write over it.
fn is_own(path: &Path, kind: FileType) -> io::Result<bool> {
    if !is_named(path) {
        let mut others = [REQUEST, Journal::BEFORE].into_iter();
        let is_other = others.any(|name| path.ends_with(name));
        return Ok(kind.is_file() && (is_other || whole::is_unfinished(path)));
    }
    let is_entry = kind.is_file() && serde_json::from_slice::<Entry>(&fs::read(path)?).is_ok();
    match is_entry {
        true => Ok(true),
        false => Err(io::Error::new(
            io::ErrorKind::InvalidData,
            format!(
                "{} is no experiment of a commissioning, and has the name of one: move it away, or give another folder for \
                 results",
                path.display()
            ),
        )),
    }
}

/// Writes a file whole or not at all.
fn keep(path: &Path, entry: &Entry) -> io::Result<()> {
    whole::replace(path, serde_json::to_vec(entry)?)
}

impl TestAxis for Journal<'_> {
    fn info(&self) -> AxisInfo {
        // The limits of settings that are not in force yet, too.
        let limits = &self.settings.limits;
        let info = AxisInfo {
            max_velocity_mm_s: limits.max_velocity_mm_s,
            max_acceleration_mm_s2: limits.max_acceleration_mm_s2,
            ..self.axis.info()
        };
        match self.travel {
            // To the last bit as it was: experiments are found again by their numbers.
            Some(travel) => AxisInfo {
                travel_mm: travel.half_mm(),
                start_mm: travel.start_mm(),
                ..info
            },
            None => info,
        }
    }

    fn settings(&self) -> &AxisSettings {
        &self.settings
    }

    fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
        if !self.known {
            self.axis.apply(settings)?;
        }
        self.pending = self.known;
        self.settings = settings.clone();
        Ok(())
    }

    fn switch_off(&mut self) -> Result<(), ExperimentError> {
        if self.known {
            self.begins_off = true;
            return Ok(());
        }
        self.axis.switch_off()
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        let key = self.key(experiment);
        self.interrupted = None;
        let impossible = |reason: String| ExperimentError::Impossible {
            experiment: experiment.name.clone(),
            reason,
        };
        if self.known {
            let kept = self.kept(key, experiment.decimation).map_err(|reason| {
                impossible(format!(
                    "{reason}; delete the file to run this and what follows it again, or all of them by leaving out --resume"
                ))
            })?;
            if let Some(outcome) = kept {
                self.next += 1;
                self.begins_off = false;
                progress(1.0);
                let recording = outcome.as_ref().ok().or(self.interrupted.as_ref());
                let end_mm = recording.and_then(|recording| recording.position_mm.last());
                self.left_at_mm = end_mm.copied().or(self.left_at_mm);
                return outcome;
            }
        }
        let path = self.path(self.next);
        self.next += 1;
        self.known = false;
        let begins_off = std::mem::take(&mut self.begins_off);
        if begins_off {
            self.axis.switch_off()?;
        }
        if self.pending {
            let settings = self.settings.clone();
            self.axis
                .apply(&settings)
                .map_err(|error| impossible(error.to_string()))?;
            self.pending = false;
        }
        // What holds its axis goes on where the series was interrupted.
        if matches!(experiment.drive, Drive::ClosedLoop(_))
            && let Some(left_at_mm) = self.left_at_mm.take()
        {
            if begins_off {
                approach(&mut RestsOff(self.axis), left_at_mm)?;
            } else {
                approach(self.axis, left_at_mm)?;
            }
        }
        let entry = |recording, stopped| Entry::new(&experiment.name, key, recording, stopped);
        match self.axis.perform(experiment, progress) {
            Ok(recording) => {
                keep(&path, &entry(Some(recording.clone()), None)).map_err(|error| {
                    impossible(format!("cannot be kept in {}: {error}", path.display()))
                })?;
                Ok(recording)
            }
            Err(error) => {
                self.interrupted = self.axis.interrupted().cloned();
                if let Some(stopped) = Stopped::of(&error) {
                    // An older series' next is not this one's. What stopped it says more than that it is not kept.
                    let _ = fs::remove_file(self.path(self.next));
                    let _ = keep(&path, &entry(self.interrupted.clone(), Some(stopped)));
                }
                Err(error)
            }
        }
    }

    fn interrupted(&self) -> Option<&Recording> {
        self.interrupted.as_ref()
    }
}

/// An axis whose outputs are off between experiments.
struct RestsOff<'a>(&'a mut dyn TestAxis);

impl TestAxis for RestsOff<'_> {
    fn info(&self) -> AxisInfo {
        self.0.info()
    }

    fn settings(&self) -> &AxisSettings {
        self.0.settings()
    }

    fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
        self.0.apply(settings)
    }

    fn switch_off(&mut self) -> Result<(), ExperimentError> {
        self.0.switch_off()
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        let recording = self.0.perform(experiment, progress)?;
        self.0.switch_off()?;
        Ok(recording)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use quadrant_sim::plant::StageParameters;
    use quadrant_tune::test_axis::SimulatedTestAxis;

    fn hold(ticks: usize) -> Experiment {
        Experiment {
            name: format!("{ticks} ticks"),
            drive: Drive::OpenLoop,
            injection_v: vec![0.3; ticks],
            decimation: 1,
            time_limit_s: 1.0,
        }
    }

    fn axis() -> SimulatedTestAxis {
        SimulatedTestAxis::new(0, StageParameters::real().axes[0].clone(), 1)
    }

    #[test]
    fn what_was_run_before_is_not_run_again_and_what_has_changed_is() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path().join("experiments");
        let (mut first, mut again, mut other) = (axis(), axis(), axis());
        let mut journal = Journal::open(&mut first, &at, false).unwrap();
        let before = [50, 60].map(|ticks| journal.perform(&hold(ticks), &mut |_| {}).unwrap());

        let mut journal = Journal::open(&mut again, &at, true).unwrap();
        let after = [50, 60].map(|ticks| journal.perform(&hold(ticks), &mut |_| {}).unwrap());
        assert_eq!(before, after);
        assert_eq!(again.plant().position_mm(), axis().plant().position_mm());

        let mut journal = Journal::open(&mut other, &at, true).unwrap();
        journal.perform(&hold(50), &mut |_| {}).unwrap();
        let mut settings = journal.settings().clone();
        settings.feedback.pid.kp_v_per_mm *= 0.5;
        journal.apply(&settings).unwrap();
        journal.perform(&hold(60), &mut |_| {}).unwrap();
        assert_eq!(other.settings(), &settings);
        assert_ne!(other.plant().position_mm(), axis().plant().position_mm());
    }

    /// One that drives the axis out of its travel.
    fn too_far() -> Experiment {
        Experiment {
            name: "too far".to_owned(),
            injection_v: vec![9.0; 5000],
            ..hold(0)
        }
    }

    #[test]
    fn an_experiment_that_was_stopped_is_not_run_again_if_the_series_went_on() {
        let folder = tempfile::tempdir().unwrap();
        let (mut first, mut again) = (axis(), axis());
        let run = |journal: &mut Journal<'_>| {
            let stopped = journal.perform(&too_far(), &mut |_| {}).unwrap_err();
            let end = journal.interrupted().cloned();
            let after = journal.perform(&hold(50), &mut |_| {}).unwrap();
            (format!("{stopped:?}"), end, after)
        };
        let before = run(&mut Journal::open(&mut first, folder.path(), false).unwrap());
        assert!(before.1.is_some());
        let after = run(&mut Journal::open(&mut again, folder.path(), true).unwrap());
        assert!(before == after, "{} {}", before.0, after.0);
        assert_eq!(again.plant().position_mm(), axis().plant().position_mm());
    }

    #[test]
    fn an_experiment_that_ended_the_series_is_run_again() {
        let folder = tempfile::tempdir().unwrap();
        let (mut first, mut again) = (axis(), axis());
        let mut journal = Journal::open(&mut first, folder.path(), false).unwrap();
        assert!(journal.perform(&too_far(), &mut |_| {}).is_err());
        let mut journal = Journal::open(&mut again, folder.path(), true).unwrap();
        assert!(journal.perform(&too_far(), &mut |_| {}).is_err());
        assert_ne!(again.plant().position_mm(), axis().plant().position_mm());
    }

    #[test]
    fn a_series_keeps_the_travel_that_it_was_begun_with_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let begun = Begun {
            words: "--seed 1 --travel -3..20".to_owned(),
            at_mm: 100.1,
            travel: Travel {
                negative_mm: 3.1,
                positive_mm: 20.0 / 3.0,
            },
        };
        let mut first = axis();
        let mut journal = Journal::open(&mut first, folder.path(), false).unwrap();
        journal.begin(&begun).unwrap();
        let found = Journal::begun(folder.path()).unwrap();
        assert_eq!(found, begun);
        // The axis of the next session stands elsewhere, within the same ends.
        let moved = Travel {
            negative_mm: begun.travel.negative_mm + 0.7,
            positive_mm: begun.travel.positive_mm - 0.7,
        };
        let mut again = axis().with_travel(moved);
        let mut journal = Journal::open(&mut again, folder.path(), true).unwrap();
        journal.begin(&found).unwrap();
        let AxisInfo {
            travel_mm,
            start_mm,
            ..
        } = journal.info();
        assert_eq!(travel_mm, begun.travel.half_mm());
        assert_eq!(start_mm, begun.travel.start_mm());
    }

    #[test]
    fn a_series_goes_on_where_it_left_its_axis() {
        let folder = tempfile::tempdir().unwrap();
        let (mut first, mut again) = (axis(), axis());
        let mut journal = Journal::open(&mut first, folder.path(), false).unwrap();
        approach(&mut journal, 5.0).unwrap();
        let left_mm = first.plant().position_mm();
        // The axis of the next session stands at the middle again.
        let mut journal = Journal::open(&mut again, folder.path(), true).unwrap();
        approach(&mut journal, 5.0).unwrap();
        let mut hold = hold(50);
        hold.drive = Drive::ClosedLoop(quadrant_law::reference::MotionSettings::Hold);
        hold.injection_v = vec![0.0; 50];
        journal.perform(&hold, &mut |_| {}).unwrap();
        let difference_mm = (again.plant().position_mm() - left_mm).abs();
        assert!(
            left_mm > 4.0 && difference_mm < 0.2,
            "{left_mm} {difference_mm}"
        );
    }

    /// An axis with an account of what it was asked for.
    struct Asked(SimulatedTestAxis, Vec<String>);

    impl TestAxis for Asked {
        fn info(&self) -> AxisInfo {
            self.0.info()
        }

        fn settings(&self) -> &AxisSettings {
            self.0.settings()
        }

        fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
            self.0.apply(settings)
        }

        fn switch_off(&mut self) -> Result<(), ExperimentError> {
            self.1.push("off".to_owned());
            self.0.switch_off()
        }

        fn perform(
            &mut self,
            experiment: &Experiment,
            progress: &mut dyn FnMut(f64),
        ) -> Result<Recording, ExperimentError> {
            self.1.push(experiment.name.clone());
            self.0.perform(experiment, progress)
        }
    }

    #[test]
    fn a_series_whose_outputs_rest_off_goes_on_with_outputs_that_rest_off() {
        let folder = tempfile::tempdir().unwrap();
        let (mut first, mut again) = (axis(), Asked(axis(), Vec::new()));
        let mut journal = Journal::open(&mut first, folder.path(), false).unwrap();
        approach(&mut journal, 5.0).unwrap();
        let mut journal = Journal::open(&mut again, folder.path(), true).unwrap();
        approach(&mut journal, 5.0).unwrap();
        journal.switch_off().unwrap();
        // In open loop nothing goes back to where the axis was left, and with the next one it does.
        journal.perform(&hold(50), &mut |_| {}).unwrap();
        assert_eq!(again.1, ["off", "50 ticks"]);
        let mut again = Asked(axis(), Vec::new());
        let mut journal = Journal::open(&mut again, folder.path(), true).unwrap();
        approach(&mut journal, 5.0).unwrap();
        journal.switch_off().unwrap();
        approach(&mut journal, 1.0).unwrap();
        let asked = &again.1;
        let first_own = 1 + asked.iter().rposition(|entry| entry == "off").unwrap();
        assert!(first_own > 3, "{asked:?}");
        for pair in asked[..first_own].windows(2) {
            assert!(pair.iter().any(|entry| entry == "off"), "{asked:?}");
        }
    }

    #[test]
    fn a_series_that_is_begun_anew_forgets_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let (mut first, mut again) = (axis(), axis());
        let mut journal = Journal::open(&mut first, folder.path(), false).unwrap();
        approach(&mut journal, 1.0).unwrap();
        assert!(folder.path().read_dir().unwrap().count() > 0);
        Journal::open(&mut again, folder.path(), false).unwrap();
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    }

    /// A journal of an experiment of which `change` made another file.
    fn changed(change: impl FnOnce(&mut serde_json::Value)) -> Result<Recording, ExperimentError> {
        let folder = tempfile::tempdir().unwrap();
        let mut first = axis();
        let mut journal = Journal::open(&mut first, folder.path(), false).unwrap();
        journal.perform(&hold(50), &mut |_| {}).unwrap();
        let path = folder.path().join("000.json");
        let mut value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        change(&mut value);
        fs::write(&path, value.to_string()).unwrap();
        let mut again = axis();
        let mut journal = Journal::open(&mut again, folder.path(), true).unwrap();
        let outcome = journal.perform(&hold(50), &mut |_| {});
        assert_eq!(again.plant().position_mm(), axis().plant().position_mm());
        outcome
    }

    #[test]
    fn a_file_that_was_changed_is_refused_by_its_name_field_and_value() {
        use serde_json::json;
        assert!(changed(|_| {}).is_ok());
        let sets: [(&str, serde_json::Value, &[&str]); 8] = [
            (
                "sample_time_s",
                json!(0.0),
                &["column t_s", "0 s", "100 kHz"],
            ),
            ("sample_time_s", json!(-1e-4), &["column t_s", "-0.0001 s"]),
            ("sample_time_s", json!(2e-4), &["sum"]),
            (
                "reference_mm",
                json!([]),
                &["column reference_mm", "0 values", "50"],
            ),
            (
                "voltage_v",
                json!(vec![0.3; 51]),
                &["column voltage_v", "51 values"],
            ),
            (
                "injection_v",
                json!(vec![1e300; 50]),
                &["column injection_v", "at most 20 V"],
            ),
            ("position_mm", json!(vec![0.0; 100]), &["50 values", "100"]),
            ("position_mm", json!("here"), &["invalid type"]),
        ];
        for (field, value, parts) in sets {
            let refused = changed(|entry| entry["recording"][field] = value.clone()).unwrap_err();
            let refused = refused.to_string();
            for part in parts.iter().chain(&["000.json", "--resume"]) {
                assert!(refused.contains(part), "{field} {value}: {part}: {refused}");
            }
        }
        let scale = |entry: &mut serde_json::Value, to: fn(f64) -> f64| {
            for value in entry["recording"]["position_mm"].as_array_mut().unwrap() {
                *value = json!(to(value.as_f64().unwrap()));
            }
        };
        let doubled = changed(|entry| scale(entry, |mm| 2.0 * mm)).unwrap_err();
        assert!(doubled.to_string().contains("sum"), "{doubled}");
        let far = changed(|entry| entry["recording"]["position_mm"][1] = json!(1e300)).unwrap_err();
        assert!(far.to_string().contains("10000 mm"), "{far}");
        let stopped = changed(|entry| {
            entry["stopped"] = json!({"Travel": {"travel_mm": -1.0, "time_s": -1.0}});
        });
        assert!(stopped.unwrap_err().to_string().contains("sum"));
    }

    #[test]
    fn what_no_journal_has_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path().join("experiments");
        let mut first = axis();
        let mut journal = Journal::open(&mut first, &at, false).unwrap();
        journal.perform(&hold(50), &mut |_| {}).unwrap();
        let notes = at.join("notes.txt");
        fs::write(&notes, "three weeks of work").unwrap();
        fs::create_dir(at.join("photographs")).unwrap();
        let mut again = axis();
        let journal = Journal::open(&mut again, &at, false).unwrap();
        assert_eq!(journal.foreign(), [notes.clone(), at.join("photographs")]);
        assert!(notes.exists() && !at.join("000.json").exists());
        fs::write(at.join("001.json"), "{}").unwrap();
        let refused = Journal::remove(&at).unwrap_err().to_string();
        assert!(refused.contains("001.json"), "{refused}");
        assert!(at.join("001.json").exists());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_place_of_the_folder_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let elsewhere = folder.path().join("elsewhere");
        fs::create_dir(&elsewhere).unwrap();
        let at = folder.path().join("experiments");
        std::os::unix::fs::symlink(&elsewhere, &at).unwrap();
        for resume in [false, true] {
            let mut axis = axis();
            let refused = Journal::open(&mut axis, &at, resume).err().unwrap();
            assert!(refused.to_string().contains("link"), "{refused}");
        }
        assert!(elsewhere.exists());
    }
}
