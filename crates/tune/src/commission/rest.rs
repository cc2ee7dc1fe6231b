//! The axis at rest under a law: knocked to either side, and held.
//!
//! Friction may hold the table while the motor swings on a spring, or hold nothing that the encoder sees: a loop that is stable while the axis
//! slides can hum there for ever. Only a knock starts it.

use quadrant_law::reference::MotionSettings;
use quadrant_settings::AxisSettings;

use super::error::CommissionError;
use super::linear_model::HOME_MM;
use super::ringing::{Ringing, detrended, ringing};
use super::verify::VerifyError;
use crate::test_axis::{Drive, Experiment, ExperimentError, MachineError, TestAxis, approach};

/// Time for which the axis is left alone after a knock, s.
const LEFT_ALONE_S: f64 = 3.0;
/// Time at the end of it that counts, s: one that sticks and slips may take as long from one slip to the next.
const COUNTED_S: f64 = 2.2;
/// Lowest frequency of a hum, Hz: what is slower hunts.
pub(super) const SLOWEST_HUM_HZ: f64 = 20.0;
/// Length of the lines about which it is looked at, s: a few periods of the slowest hum.
const PART_S: f64 = 0.1;
/// Duration of a knock, s.
const KNOCK_S: f64 = 5e-3;
/// Voltage of a knock over friction.
const KNOCK_RATIO: f64 = 3.0;
/// Parts of a knock's voltage, to either side: one that sticks and slips may come to rest after one of them, and not after another.
const STRENGTHS: [f64; 4] = [1.0, -1.0, 0.67, -0.67];
/// Shares of a knock's duration and of its voltage beyond friction, until one does not throw the axis beyond its limits: a light one on a
/// short travel may not be as fast as the whole makes it.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];
/// Largest RMS deviation of an axis that is at rest, counts, beside the encoder's noise.
const STILL_COUNTS: f64 = 1.0;
/// RMS deviation from which on a softer loop is worth its larger errors, counts.
const LOUD_COUNTS: f64 = 3.0;
/// Factor on the encoder's noise that a loop may make of it.
const NOISE_RATIO: f64 = 2.0;

/// Result of a test at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rest {
    /// Largest RMS deviation after a knock, mm.
    pub(super) rms_mm: f64,
    /// The oscillation, where the axis does not come to rest.
    pub(super) hum: Option<Ringing>,
}

/// Friction and noise of an axis, as far as a knock has to know them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Knock {
    /// Friction, V.
    pub(super) friction_v: f64,
    /// Noise of the encoder, mm RMS.
    pub(super) noise_mm: f64,
}

impl Knock {
    /// The oscillation of an axis at rest under settings, and if it is a hum that is too much to leave it: a softer loop hunts more. None of
    /// one that comes to rest, or cannot be tested.
    ///
    /// # Errors
    /// Settings that the machine refuses, and an interruption.
    pub(super) fn ringing(
        self,
        test_axis: &mut dyn TestAxis,
        settings: &AxisSettings,
    ) -> Result<Option<(Ringing, bool)>, CommissionError> {
        let count_mm = test_axis.info().resolution_mm;
        Ok(match self.test(test_axis, settings)? {
            Err(error @ ExperimentError::Interrupted { .. }) => {
                return Err(VerifyError::from(error).into());
            }
            Ok(rest) => rest.hum.map(|hum| {
                let is_loud = rest.rms_mm > LOUD_COUNTS * count_mm;
                (hum, is_loud && hum.frequency_hz >= SLOWEST_HUM_HZ)
            }),
            // It swung so far that it was stopped.
            Err(_) => test_axis
                .interrupted()
                .and_then(ringing)
                .map(|hum| (hum, true)),
        })
    }

    /// Applies settings, knocks the axis to either side in the middle of its travel, and looks whether it comes to rest.
    ///
    /// # Errors
    /// A run that is stopped.
    pub(super) fn test(
        self,
        test_axis: &mut dyn TestAxis,
        settings: &AxisSettings,
    ) -> Result<Result<Rest, ExperimentError>, MachineError> {
        // Behind a push, the monitor that holds the encoder against the plant may take a healthy axis for a faulty one.
        let mut settings = settings.clone();
        settings.plant = None;
        settings.feedforward.learning = None;
        settings.feedforward.cancelling = None;
        test_axis.apply(&settings)?;
        let mut knocked =
            |share: f64| approach(test_axis, HOME_MM).and_then(|()| self.knocked(test_axis, share));
        let [whole, gentler @ ..] = SHARES;
        let mut outcome = knocked(whole);
        for share in gentler {
            match &outcome {
                Err(error) if error.strayed() => outcome = knocked(share),
                _ => break,
            }
        }
        Ok(outcome)
    }

    fn knocked(self, test_axis: &mut dyn TestAxis, share: f64) -> Result<Rest, ExperimentError> {
        let info = test_axis.info();
        let samples = |seconds: f64| ((seconds * info.rate_hz).round() as usize).max(1);
        let (knock, alone) = (samples(share * KNOCK_S), samples(LEFT_ALONE_S));
        let knock_v = self.friction_v * (1.0 + share * (KNOCK_RATIO - 1.0));
        let mut rest = Rest {
            rms_mm: 0.0,
            hum: None,
        };
        for strength in STRENGTHS {
            let mut injection_v = vec![strength * knock_v; knock];
            injection_v.resize(knock + alone, 0.0);
            let experiment = Experiment {
                name: "knock at rest".to_owned(),
                drive: Drive::ClosedLoop(MotionSettings::Hold),
                injection_v,
                decimation: 1,
                time_limit_s: 10.0,
            };
            let recording = test_axis.perform(&experiment, &mut |_| {})?;
            let counted = (COUNTED_S / recording.sample_time_s) as usize;
            let begin = recording.len().saturating_sub(counted);
            let seen = Swing::of(&recording.position_mm[begin..], recording.sample_time_s);
            let noise_mm = NOISE_RATIO * self.noise_mm;
            let still_mm = (STILL_COUNTS * info.resolution_mm).hypot(noise_mm);
            if seen.rms_mm > still_mm && seen.rms_mm > rest.rms_mm {
                let swing = recording.slice(begin..recording.len());
                let found = Some(seen.ringing());
                rest.hum = if seen.frequency_hz < SLOWEST_HUM_HZ {
                    found
                } else {
                    ringing(&swing).or(found)
                };
            }
            rest.rms_mm = rest.rms_mm.max(seen.rms_mm);
        }
        Ok(rest)
    }
}

/// Motion at rest.
struct Swing {
    /// RMS deviation from straight lines, one after the other: what creeps is no hum.
    rms_mm: f64,
    /// The same from one line, as one that sticks and slips moves: half of the distance between its ends, and how often it goes to and fro.
    amplitude_mm: f64,
    frequency_hz: f64,
}

impl Swing {
    fn of(position_mm: &[f64], sample_time_s: f64) -> Self {
        let part = ((PART_S / sample_time_s) as usize).max(8);
        let values: Vec<f64> = position_mm.chunks_exact(part).flat_map(detrended).collect();
        let square: f64 = values.iter().map(|value| value * value).sum();
        let whole = detrended(position_mm);
        let (low, high) = whole
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(*value), high.max(*value))
            });
        // The encoder's noise makes no turns.
        let (lower, upper) = (0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high);
        let sides = whole.iter().filter_map(|value| {
            let is_outside = *value < lower || *value > upper;
            is_outside.then_some(*value > upper)
        });
        let sides: Vec<bool> = sides.collect();
        let turns = sides.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let lasts_s = whole.len() as f64 * sample_time_s;
        Self {
            rms_mm: (square / values.len().max(1) as f64).sqrt(),
            amplitude_mm: 0.5 * (high - low),
            frequency_hz: 0.5 * turns.max(1) as f64 / lasts_s,
        }
    }

    fn ringing(&self) -> Ringing {
        Ringing {
            frequency_hz: self.frequency_hz,
            amplitude_mm: self.amplitude_mm,
            share: 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use quadrant_sim::plant::{Backlash, Drive as DriveTrain, EncoderSide, StageParameters};

    use super::*;
    use crate::commission::bootstrap::measuring_settings;
    use crate::test_axis::SimulatedTestAxis;

    #[test]
    fn a_rigid_axis_comes_to_rest_and_a_motor_on_a_spring_hums_at_its_own_frequency() {
        let rigid = StageParameters::real().axes[0].clone();
        let knock = Knock {
            friction_v: 0.13,
            noise_mm: rigid.imperfections.encoder_noise_mm,
        };
        let mut axis = SimulatedTestAxis::new(0, rigid.clone(), 1);
        let settings = measuring_settings(axis.settings());
        let still = knock.test(&mut axis, &settings).unwrap().unwrap();
        assert_eq!(still.hum, None, "{still:?}");
        // More than the rigid axis' best PID.
        let mut sprung = rigid;
        let gain = sprung.gain_mm_per_v_s2;
        let spring = Backlash::resonating(150.0, 0.03, 0.5, gain, EncoderSide::Motor);
        sprung.drive = DriveTrain::RackAndPinion(spring);
        let axis = SimulatedTestAxis::new(0, sprung, 1);
        let mut settings = settings;
        settings.plant = None;
        settings.feedback.pid.kp_v_per_mm = 1.61;
        settings.feedback.pid.ki_v_per_mm_s = 173.0;
        settings.feedback.pid.kd_v_s_per_mm = 6.55e-3;
        // Under the second limit the whole knock makes it too fast.
        for max_velocity_mm_s in [settings.limits.max_velocity_mm_s, 40.0] {
            let mut axis = axis.clone();
            settings.limits.max_velocity_mm_s = max_velocity_mm_s;
            let rest = knock.test(&mut axis, &settings).unwrap().unwrap();
            let hum = rest.hum.unwrap();
            // The motor on the spring, and on the loop.
            assert!((120.0..220.0).contains(&hum.frequency_hz), "{hum:?}");
            assert!(rest.rms_mm > 4.0 * axis.info().resolution_mm, "{rest:?}");
        }
    }
    #[test]
    fn an_axis_that_sticks_and_slips_at_rest_is_told_from_one_that_hums() {
        let mut axis = StageParameters::real().axes[0].clone();
        axis.delay_s = 2.4e-3;
        for way in [&mut axis.friction.positive, &mut axis.friction.negative] {
            way.curve.breakaway_v = 2.0 * way.curve.coulomb_v;
        }
        let knock = Knock {
            friction_v: axis.friction.positive.curve.breakaway_v,
            noise_mm: axis.imperfections.encoder_noise_mm,
        };
        let mut axis = SimulatedTestAxis::new(0, axis, 1);
        let mut settings = measuring_settings(axis.settings());
        settings.plant = None;
        settings.feedback.pid.kp_v_per_mm = 0.15;
        settings.feedback.pid.ki_v_per_mm_s = 4.0;
        settings.feedback.pid.kd_v_s_per_mm = 1e-3;
        let rest = knock.test(&mut axis, &settings).unwrap().unwrap();
        let hunting = rest.hum.unwrap();
        assert!(hunting.frequency_hz < SLOWEST_HUM_HZ, "{hunting:?}");
        assert!(hunting.amplitude_mm > 0.05, "{hunting:?}");
        // A softer loop is no remedy.
        let seen = knock.ringing(&mut axis, &settings).unwrap();
        assert!(seen.is_some_and(|(_, is_loud)| !is_loud), "{seen:?}");
    }
}
