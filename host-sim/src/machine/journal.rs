//! A journal of experiments: each is kept when it has ended, so that a series that was interrupted goes on where it stood.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};

use quadrant::axes::AxisName;
use quadrant::safety::{Fault, FaultCode};
use quadrant::settings::AxisSettings;
use serde::{Deserialize, Serialize};

use super::error::MachineError;
use super::test_axis::{AxisInfo, Experiment, ExperimentError, TestAxis};
use crate::record::Recording;

/// Extension of a file with an experiment.
const KEPT: &str = "json";

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
    /// The recording of the last experiment, if that was stopped.
    interrupted: Option<Recording>,
}

/// An experiment that has ended.
#[derive(Serialize, Deserialize)]
struct Entry {
    name: String,
    /// Tells the experiment and its settings from others.
    key: u64,
    /// Of an experiment that was stopped, up to there, if anything is left of it.
    recording: Option<Recording>,
    #[serde(default)]
    stopped: Option<Stopped>,
}

/// Reason for which an experiment was stopped: one of those after which a series may go on with another.
#[derive(Clone, Copy, Serialize, Deserialize)]
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
    /// A journal in a folder, which is made. Without `resume`, what is there is deleted.
    ///
    /// # Errors
    /// A folder that cannot be made or emptied.
    pub fn open(axis: &'a mut dyn TestAxis, folder: &Path, resume: bool) -> io::Result<Self> {
        if !resume {
            Self::remove(folder)?;
        }
        fs::create_dir_all(folder)?;
        Ok(Self {
            settings: axis.settings().clone(),
            axis,
            folder: folder.to_owned(),
            next: 0,
            known: resume,
            pending: false,
            interrupted: None,
        })
    }

    /// Deletes the journal in a folder: nothing is to be resumed.
    ///
    /// # Errors
    /// A folder that cannot be deleted.
    pub fn remove(folder: &Path) -> io::Result<()> {
        match fs::remove_dir_all(folder) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }

    /// True if no experiment is kept in a folder.
    pub fn is_empty(folder: &Path) -> bool {
        let kept = |entry: fs::DirEntry| entry.path().extension().is_some_and(|it| it == KEPT);
        fs::read_dir(folder).map_or(true, |entries| !entries.flatten().any(kept))
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
    fn kept(&mut self, key: u64) -> Option<Result<Recording, ExperimentError>> {
        let bytes = fs::read(self.path(self.next)).ok()?;
        let entry: Entry = serde_json::from_slice(&bytes).ok()?;
        if entry.key != key {
            return None;
        }
        let Some(stopped) = entry.stopped else {
            return entry.recording.map(Ok);
        };
        // One that ended the series is tried again.
        if !self.path(self.next + 1).exists() {
            return None;
        }
        let error = stopped.error(entry.name)?;
        self.interrupted = entry.recording;
        Some(Err(error))
    }
}

/// Writes a file whole or not at all.
fn keep(path: &Path, entry: &Entry) -> io::Result<()> {
    let unfinished = path.with_extension("unfinished");
    fs::write(&unfinished, serde_json::to_vec(entry)?)?;
    fs::rename(unfinished, path)
}

impl TestAxis for Journal<'_> {
    fn info(&self) -> AxisInfo {
        self.axis.info()
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

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        let key = self.key(experiment);
        self.interrupted = None;
        if self.known
            && let Some(outcome) = self.kept(key)
        {
            self.next += 1;
            progress(1.0);
            return outcome;
        }
        let path = self.path(self.next);
        self.next += 1;
        let impossible = |reason: String| ExperimentError::Impossible {
            experiment: experiment.name.clone(),
            reason,
        };
        self.known = false;
        if self.pending {
            let settings = self.settings.clone();
            self.axis
                .apply(&settings)
                .map_err(|error| impossible(error.to_string()))?;
            self.pending = false;
        }
        let entry = |recording, stopped| Entry {
            name: experiment.name.clone(),
            key,
            recording,
            stopped,
        };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Drive, SimulatedTestAxis, approach};
    use crate::plant::StageParameters;

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
    fn a_series_that_is_begun_anew_forgets_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let (mut first, mut again) = (axis(), axis());
        let mut journal = Journal::open(&mut first, folder.path(), false).unwrap();
        approach(&mut journal, 1.0).unwrap();
        assert!(folder.path().read_dir().unwrap().count() > 0);
        Journal::open(&mut again, folder.path(), false).unwrap();
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    }
}
