//! Request and result of a commissioning.

use quadrant_settings::AxisSettings;
use quadrant_sim::margins::{MarginError, Margins};

use super::guard::Run;
use super::rest::SLOWEST_HUM_HZ;
use super::ringing::Ringing;
use super::verify::{Refused, Verification, Worse};
use crate::design::Target;
use crate::identify::frf::FrfMeasurement;
use crate::identify::motor_constant::MotorConstant;
use crate::identify::plant::PlantFit;
use crate::identify::static_friction::{
    FrictionFit, FrictionMap, ShortRuns, StaticFrictionSettings,
};
use crate::identify::virgin_curve::{GmsFit, VirginCurveError};
use crate::record::Recording;

/// Request for a commissioning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommissionSettings {
    /// Target of the PID, on the continuous loop; without one it is the [best](crate::design::best_pid) on the sampled loop.
    pub target: Option<Target>,
    /// Share of the Popov bound that the nonlinear gain may take, 0 to 1.
    pub sector_share: f64,
    /// Largest `|S|` of the loop at the nonlinear gain's largest value; the Popov bound alone counts if it is infinite.
    pub nonlinear_peak: f64,
    /// True if laws are tried on the axis, and the best is chosen that is nowhere worse than the PID alone. Without trials the
    /// settings are the N-PID's with combined feedforward.
    pub trials: bool,
    /// The runs that the friction is taken from.
    pub friction: StaticFrictionSettings,
}

impl Default for CommissionSettings {
    /// The best PID, and 75 % of the Popov bound, or less where `|S|` would exceed 2.5: no
    /// disturbance is amplified by more than that.
    fn default() -> Self {
        Self {
            target: None,
            sector_share: 0.75,
            nonlinear_peak: 2.5,
            trials: true,
            friction: StaticFrictionSettings {
                short: Some(SHORT_RUNS),
                ..whole_runs()
            },
        }
    }
}

/// Slow runs that take a third of the time.
const SHORT_RUNS: ShortRuns = ShortRuns {
    below_mm_s: 0.5,
    stretch_mm: 2.5,
};

fn whole_runs() -> StaticFrictionSettings {
    StaticFrictionSettings {
        velocities_mm_s: (0.1, 40.0),
        ..StaticFrictionSettings::default()
    }
}

impl CommissionSettings {
    /// The thesis' margins for the PID, and its law, untried.
    pub fn thesis() -> Self {
        Self {
            target: Some(Target::Margins {
                gain_margin_db: 9.9,
                phase_margin_deg: 54.2,
                crossover_hz: None,
            }),
            nonlinear_peak: f64::INFINITY,
            trials: false,
            friction: whole_runs(),
            ..Self::default()
        }
    }
}

/// Everything a commissioning found, in the order in which it did.
#[derive(Clone, Debug)]
pub struct Commissioned {
    /// The motor constant, from the open-loop test.
    pub motor: MotorConstant,
    /// The response of the sliding axis.
    pub response: FrfMeasurement,
    /// Linear model, fitted to the response.
    pub plant: PlantFit,
    /// Margins of the PID with sampling at the control rate.
    pub margins: Result<Margins, MarginError>,
    /// The friction-velocity map, its model, and the recordings of the runs.
    pub friction: (FrictionMap, FrictionFit, Vec<Recording>),
    /// Pre-sliding friction, or the reason why it was not found, and its recording.
    pub presliding: (Result<GmsFit, VirginCurveError>, Recording),
    /// The Popov bound of the nonlinear gain.
    pub sector_bound: f64,
    /// Settings of the axis, finished.
    pub settings: AxisSettings,
    /// Departures from the usual course, with their reasons, in sentences.
    pub remarks: Vec<String>,
    /// What was run on the axis, in order; nothing of a commissioning from saved recordings.
    pub ran: Vec<Run>,
    /// Oscillation at rest under the settings after a knock; none of an axis that came to rest, or on which no laws were tried.
    pub hums: Option<Ringing>,
    /// Trials on the axis; none of a commissioning from saved recordings, or where none were asked for.
    pub verification: Option<Verification>,
}

/// Relative error of the predicted hysteresis from which on it is worth a note.
const NOTED_HYSTERESIS_ERROR: f64 = 0.10;
/// Acceleration per volt by the open-loop test and by the response, the larger over the smaller, from which on it is worth a note.
const NOTED_MOTOR_RATIO: f64 = 1.7;
/// Change of the PID's error during the commissioning from which on it is worth a note.
const NOTED_DRIFT: f64 = 0.10;

impl Commissioned {
    /// The time for which the axis was used, and where it went, in a sentence.
    fn account(&self) -> String {
        let minutes = self.ran.iter().map(|run| run.lasted_s).sum::<f64>() / 60.0;
        let low_mm = self.ran.iter().map(|run| run.span_mm.0);
        let high_mm = self.ran.iter().map(|run| run.span_mm.1);
        let stopped = self.ran.iter().filter(|run| !run.ended).count();
        format!(
            "{minutes:.1} minutes of axis time: {} experiments between {:.1} and {:.1} mm from the middle of the travel, {stopped} of which were stopped by \
             their limits and repeated more gently.",
            self.ran.len(),
            low_mm.fold(f64::INFINITY, f64::min),
            high_mm.fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// Remarks on the result beside its tables, in sentences.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.ran.is_empty() {
            notes.push(self.account());
        }
        if let Some(hum) = &self.hums {
            notes.push(if hum.frequency_hz < SLOWEST_HUM_HZ {
                format!(
                    "At rest the axis sticks and slips by {:.1} um, {:.1} times a second, once it is knocked: the integral pushes against \
                     friction that holds more than it brakes. If that is too much, reduce feedback.pid.ki_v_per_mm_s: it slips less often, or not at \
                     all, and is less accurate in motion.",
                    2e3 * hum.amplitude_mm,
                    2.0 * hum.frequency_hz,
                )
            } else {
                format!(
                    "At rest the axis hums at {:.0} Hz, by {:.1} um, once it is knocked. If that is too much, look for a loose coupling or \
                     play, or ask for a softer PID with --gain-margin-db 14 --phase-margin-deg 60.",
                    hum.frequency_hz,
                    1e3 * hum.amplitude_mm,
                )
            });
        }
        let shown = self.motor.gain_mm_per_v_s2 / self.plant.plant.gain_mm_per_v_s2;
        if !(1.0 / NOTED_MOTOR_RATIO..NOTED_MOTOR_RATIO).contains(&shown) {
            notes.push(format!(
                "The open-loop test showed {:.0} % of the acceleration per volt that the frequency response gives, which counts: the \
                 axis is no rigid body at the test's frequency.",
                100.0 * shown
            ));
        }
        notes.extend(self.remarks.iter().cloned());
        let runs = &self.friction.0.runs;
        let uneven = runs.iter().filter(|run| run.stick_slip).count();
        if 2 * uneven > runs.len() {
            notes.push(format!(
                "The axis stuck and slipped, or broke away under vibration, in {uneven} of {} runs at constant velocity.",
                runs.len()
            ));
        }
        match &self.presliding.0 {
            Ok(gms) if gms.prediction.relative_error > NOTED_HYSTERESIS_ERROR => {
                notes.push(format!(
                    "The GMS model misses the measured hysteresis by {:.1} % of the breakaway level.",
                    100.0 * gms.prediction.relative_error
                ));
            }
            Ok(_) => {}
            Err(reason) => notes.push(format!(
                "No pre-sliding friction was identified ({reason}); one spring over {} um stands for it.",
                1e3 * ASSUMED_RANGE_MM
            )),
        }
        notes.extend(self.verification.iter().flat_map(verdict));
        notes
    }

    /// The change of the axis while laws were tried on it, and its meaning, in sentences; nothing of one that is not worth a note.
    pub fn drift_note(&self) -> Option<String> {
        let drift = &self.verification.as_ref()?.drift;
        let ([first_mm, last_mm], lasted_s) = drift.ends()?;
        let changed = drift.ratio() - 1.0;
        (changed.abs() > NOTED_DRIFT).then(|| {
            format!(
                "The axis changed by {:+.0} % while laws were tried on it: within {:.1} min the PID's RMS error went from {:.2} to \
                 {:.2} um. Each law was compared with the PID's error at its own time, but friction was measured before: warm the \
                 axis up and commission it again if it works warm.",
                100.0 * changed,
                lasted_s / 60.0,
                1e3 * first_mm,
                1e3 * last_mm,
            )
        })
    }
}

/// The choice of the trials, in sentences.
fn verdict(trials: &Verification) -> Vec<String> {
    let chosen = trials.chosen();
    let (worst, mean) = trials.against_pid(chosen);
    let refused: Vec<String> = trials.refused.iter().map(refusal).collect();
    let refused = (!refused.is_empty()).then(|| {
        format!(
            "On small slow motions worse than the PID alone: {}.",
            refused.join("; ")
        )
    });
    let choice = if trials.is_better_than_pid() {
        format!(
            "Chosen: {}, with {:.0} % of the PID's errors on the mean over {} sines, and {:.0} % at worst; on small slow motions it is {}.",
            chosen.law,
            100.0 * mean,
            trials.sines.len(),
            100.0 * worst,
            if trials.is_worse_when_small() {
                "worse, and so is less of it: for work of that kind set feedforward.kind to none"
            } else {
                "no worse"
            }
        )
    } else {
        "Nothing was better than the PID alone on every sine: the settings are those of the PID."
            .to_owned()
    };
    refused.into_iter().chain([choice]).collect()
}

/// The reason why a law was not chosen.
fn refusal(refused: &Refused) -> String {
    let law = &refused.law;
    let Some(worse) = refused.worse else {
        return format!("{law} was stopped");
    };
    let Worse {
        motion,
        largest_mm,
        pid_mm,
    } = worse;
    let excess = if refused.factor > 1.0 {
        format!(
            ", with {:.0} % too much friction,",
            100.0 * (refused.factor - 1.0)
        )
    } else {
        String::new()
    };
    format!(
        "{law}{excess} leaves {:.1} um for {:.1} ({motion})",
        1e3 * largest_mm,
        1e3 * pid_mm,
    )
}

/// Pre-sliding range where none was identified, mm.
pub(super) const ASSUMED_RANGE_MM: f64 = 0.02;
