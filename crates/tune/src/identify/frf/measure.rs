//! The experiment: excitation injected at standstill or at constant velocity, in closed or open loop.

use std::ops::Range;

use quadrant_law::reference::{MotionSettings, PointToPointSettings};

use super::estimate::{Estimate, Estimator, estimates};
use crate::identify::excitation::{Excitation, NoLine, Waveform};
use crate::identify::setting::SettingError;
use crate::record::Recording;
use crate::test_axis::{
    AxisInfo, Drive, Experiment, ExperimentError, Sides, TestAxis, approach, approach_from,
};

/// Parameters of a frequency response measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrfSettings {
    pub excitation: Excitation,
    /// Blocks of two periods, overlapping by half, that are averaged; at least 2.
    pub periods: usize,
    /// Velocity at which the axis moves meanwhile, mm/s, there and back; zero for standstill. Closed loop only.
    pub bias_velocity_mm_s: f64,
    /// The feedback is off: the excitation alone drives the amplifier.
    pub open_loop: bool,
    /// Passes go through both sides of a short travel, from where the axis is taken before each.
    pub two_sided: bool,
    /// Acceleration of the passes, mm/s^2; of an axis that has less, its largest.
    pub acceleration_mm_s2: f64,
}

impl Default for FrfSettings {
    /// The sliding axis, 2 to 400 Hz: what a plant model is fitted to.
    fn default() -> Self {
        Self {
            excitation: Excitation {
                waveform: Waveform::Multisine,
                rms_v: 0.08,
                band_hz: (4.0, 400.0),
                rise_hz: 200.0,
                period_s: 0.5,
                seed: 1,
            },
            periods: 40,
            bias_velocity_mm_s: 37.0,
            open_loop: false,
            two_sided: false,
            acceleration_mm_s2: 500.0,
        }
    }
}

/// A measured response and what it was measured from.
#[derive(Clone, Debug)]
pub struct FrfMeasurement {
    /// The recordings, one for each pass.
    pub recordings: Vec<Recording>,
    /// The response, by the estimator that suits the loop.
    pub estimate: Estimate,
    /// The response by H1: under feedback, for comparison only.
    pub plain: Estimate,
    /// True if a feedback law was at work.
    pub closed_loop: bool,
}

/// Reasons for which a response cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum FrfError {
    /// A setting that cannot be.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A band without a line.
    #[error(transparent)]
    NoLine(#[from] NoLine),
    /// The travel does not allow a pass at this velocity.
    #[error(
        "a pass at {velocity_mm_s} mm/s needs {needed_mm:.0} mm of travel for a single period of {period_s} s, and there are \
         {travel_mm:.0} mm: lower the velocity or the period"
    )]
    Travel {
        velocity_mm_s: f64,
        /// Travel that one period takes, mm.
        needed_mm: f64,
        travel_mm: f64,
        period_s: f64,
    },
    /// The excitation slowed the axis so far that friction is not linear.
    #[error(
        "the excitation slowed the axis from {velocity_mm_s} to {least_mm_s:.1} mm/s, where friction is not linear: lower its \
         amplitude below {amplitude_v} V, let it rise up to a higher frequency, or raise the velocity"
    )]
    NotSliding {
        /// The velocity asked for.
        velocity_mm_s: f64,
        /// The least velocity seen.
        least_mm_s: f64,
        /// RMS of the excitation.
        amplitude_v: f64,
    },
    /// The experiment was stopped.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
}

/// Share of the travel by which a pass may begin away from where it should.
const ASTRAY: f64 = 0.04;
/// Time at constant velocity before the first block, s: transients have died away.
const SETTLING_S: f64 = 0.7;
/// The same where periods are short, s.
const SHORT_SETTLING_S: f64 = 0.4;
/// Periods in a block.
const BLOCK_PERIODS: usize = 2;
/// Jerk of the passes, mm/s^3.
const JERK_MM_S3: f64 = 2e4;
/// Travel either way below which both sides are used and periods are shorter, mm.
const SHORT_MM: f64 = 60.0;
/// Factor on the period there.
const SHORT_PERIOD: f64 = 0.5;
/// Highest frequency that is chosen over the control rate.
pub(crate) const BAND_SHARE: f64 = 0.36;
/// Share of the largest velocity that the bias takes at most: the excitation comes on top.
const BIAS_SHARE: f64 = 0.4;
/// Slowest pass that is chosen for a short travel, mm/s.
const SLOWEST_MM_S: f64 = 0.5;

impl FrfSettings {
    /// Slower passes where travel or limits do not hold one at the velocity, and frequencies that the control rate resolves.
    #[must_use]
    pub fn fitted_to(self, axis: &AxisInfo) -> Self {
        let travel_mm = axis.travel_mm;
        let mut fitted = self.within(axis);
        let (_, highest_hz) = &mut fitted.excitation.band_hz;
        *highest_hz = highest_hz.min(BAND_SHARE * axis.rate_hz);
        let most_mm_s = BIAS_SHARE * axis.max_velocity_mm_s;
        fitted.bias_velocity_mm_s = fitted.bias_velocity_mm_s.min(most_mm_s);
        if travel_mm < SHORT_MM {
            fitted.two_sided = true;
            fitted.excitation.period_s *= SHORT_PERIOD;
            fitted.excitation.band_hz.0 /= SHORT_PERIOD;
        }
        while pass_length_mm(&fitted, 1) > fitted.room_mm(travel_mm)
            && fitted.bias_velocity_mm_s > SLOWEST_MM_S
        {
            fitted.bias_velocity_mm_s *= 0.9;
        }
        fitted
    }

    /// The same with no more acceleration than the axis has.
    fn within(self, axis: &AxisInfo) -> Self {
        Self {
            acceleration_mm_s2: self.acceleration_mm_s2.min(axis.max_acceleration_mm_s2),
            ..self
        }
    }

    /// Time in which a pass reaches its velocity, s.
    fn ramp_s(&self) -> f64 {
        self.bias_velocity_mm_s.abs() / self.acceleration_mm_s2
            + self.acceleration_mm_s2 / JERK_MM_S3
    }

    /// Length of a pass at most, mm.
    fn room_mm(&self, travel_mm: f64) -> f64 {
        Sides::of(self.two_sided).room_mm(travel_mm)
    }

    /// Position at which the axis stands before the first pass, mm.
    pub fn start_mm(&self, travel_mm: f64) -> f64 {
        Sides::of(self.two_sided).start_mm(travel_mm)
    }

    /// Passes, the longest of them in mm, and the time that all take, s; nothing if a pass does not fit the travel.
    pub fn extent(&self, travel_mm: f64, rate_hz: f64) -> Option<(usize, f64, f64)> {
        let (mut passes, mut longest_mm, mut lasts_s) = (0, 0.0_f64, 0.0);
        let mut missing = self.periods;
        while missing > 0 {
            let (experiment, blocks) = pass(self, travel_mm, rate_hz, missing, 1.0).ok()?;
            longest_mm = longest_mm.max(pass_length_mm(self, blocks));
            lasts_s += experiment.injection_v.len() as f64 / rate_hz;
            passes += 1;
            missing -= blocks;
        }
        Some((passes, longest_mm, lasts_s))
    }

    fn check(&self, rate_hz: f64) -> Result<(), FrfError> {
        let refuse = |field, value, expected| {
            Err(SettingError {
                field,
                value,
                expected,
            }
            .into())
        };
        let Excitation {
            rms_v,
            band_hz: (low, high),
            period_s,
            ..
        } = self.excitation;
        if !(rms_v.is_finite() && rms_v > 0.0) {
            return refuse("amplitude", rms_v, "it must be above zero, in V RMS");
        }
        if !(period_s.is_finite() && period_s * rate_hz >= 16.0 && period_s <= 100.0) {
            return refuse("period", period_s, "it must be 16 control periods to 100 s");
        }
        if !(low.is_finite() && low * period_s >= 1.0) {
            let expected = "the lowest frequency must be at least one cycle in a period";
            return refuse("band", low, expected);
        }
        if !(high > low && high < 0.4 * rate_hz) {
            let expected =
                "the highest frequency must lie above the lowest and below 0.4 of the control rate";
            return refuse("band", high, expected);
        }
        if self.periods < 2 {
            let expected = "at least 2 are needed, or there is no variance and no coherence";
            return refuse("periods", self.periods as f64, expected);
        }
        if self.open_loop && self.bias_velocity_mm_s != 0.0 {
            let expected = "an axis moves at constant velocity under feedback only";
            return refuse("bias velocity", self.bias_velocity_mm_s, expected);
        }
        Ok(self.excitation.check_lines()?)
    }
}

/// Measures the response of the axis under test, under the settings that are in force.
///
/// # Errors
/// Settings that cannot be, too little travel, or a run that is stopped.
pub fn measure(
    test_axis: &mut dyn TestAxis,
    settings: &FrfSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<FrfMeasurement, FrfError> {
    let axis = test_axis.info();
    let settings = &settings.within(&axis);
    settings.check(axis.rate_hz)?;
    let moves = settings.bias_velocity_mm_s != 0.0;
    let mut recordings: Vec<Recording> = Vec::new();
    let mut blocks: Vec<(usize, Range<usize>)> = Vec::new();
    while blocks.len() < settings.periods {
        let missing = settings.periods - blocks.len();
        let forward = recordings.len().is_multiple_of(2);
        let (experiment, expected) = if moves {
            let direction = if forward { 1.0 } else { -1.0 };
            // A new realisation in every pass: what depends on the signal (leakage, friction) then scatters, and is seen.
            let mut varied = *settings;
            varied.excitation.seed = settings
                .excitation
                .seed
                .wrapping_add(recordings.len() as u64);
            pass(&varied, axis.travel_mm, axis.rate_hz, missing, direction)?
        } else {
            (standstill(settings, axis.rate_hz), settings.periods)
        };
        let done = blocks.len() as f64;
        let start_mm = settings.start_mm(axis.travel_mm);
        if settings.two_sided {
            approach(test_axis, if forward { start_mm } else { -start_mm })?;
        } else if moves && forward {
            let astray_mm = ASTRAY * test_axis.info().travel_mm;
            approach_from(test_axis, recordings.last(), start_mm, astray_mm)?;
        }
        let recording = test_axis.perform(&experiment, &mut |share| {
            progress((done + share * expected as f64) / settings.periods as f64);
        })?;
        let period = in_samples(&settings.excitation, &recording, axis.rate_hz)?;
        let steady = steady_range(&recording, settings);
        check_sliding(&recording, &steady, settings, axis.resolution_mm)?;
        // Blocks begin where a period does, so that the excitation is the same in each; they overlap by half.
        let first = steady.start.div_ceil(period);
        let found = (first..)
            .map(|index| index * period..(index + BLOCK_PERIODS) * period)
            .take_while(|block| block.end <= steady.end)
            .take(missing);
        let index = recordings.len();
        let before = blocks.len();
        blocks.extend(found.map(|block| (index, block)));
        recordings.push(recording);
        if blocks.len() == before {
            return Err(too_short(settings, axis.travel_mm));
        }
    }
    let views: Vec<(&Recording, Range<usize>)> = blocks
        .iter()
        .map(|(index, block)| (&recordings[*index], block.clone()))
        .collect();
    let lines: Vec<usize> = settings
        .excitation
        .lines()
        .into_iter()
        .map(|line| line * BLOCK_PERIODS)
        .collect();
    let unbiased = if settings.open_loop {
        Estimator::H1
    } else {
        Estimator::Instrument
    };
    let [estimate, plain] = estimates(&views, &lines, [unbiased, Estimator::H1]);
    Ok(FrfMeasurement {
        estimate,
        plain,
        closed_loop: !settings.open_loop,
        recordings,
    })
}

/// The period of the excitation in samples of a recording, which may be coarser than control periods; all lines lie within the spectrum of
/// two periods.
fn in_samples(
    excitation: &Excitation,
    recording: &Recording,
    rate_hz: f64,
) -> Result<usize, SettingError> {
    let period = excitation.period(rate_hz);
    let every = (recording.sample_time_s * rate_hz).round() as usize;
    if every == 0 || !period.is_multiple_of(every) {
        return Err(SettingError {
            field: "period",
            value: period as f64 / rate_hz,
            expected: "it must be a whole number of the samples that are recorded",
        });
    }
    let (_, high) = excitation.band_hz;
    if high * recording.sample_time_s >= 0.5 {
        return Err(SettingError {
            field: "band",
            value: high,
            expected: "the highest frequency must lie below half the rate at which the axis was recorded",
        });
    }
    Ok(period / every)
}

fn too_short(settings: &FrfSettings, travel_mm: f64) -> FrfError {
    let velocity_mm_s = settings.bias_velocity_mm_s.abs();
    FrfError::Travel {
        velocity_mm_s,
        needed_mm: pass_length_mm(settings, 1),
        travel_mm: settings.room_mm(travel_mm),
        period_s: settings.excitation.period_s,
    }
}

/// The excitation at rest, in closed or open loop; one period settles.
pub fn standstill(settings: &FrfSettings, rate_hz: f64) -> Experiment {
    let periods = settings.periods + 1;
    Experiment {
        name: "frequency response at standstill".to_owned(),
        drive: if settings.open_loop {
            Drive::OpenLoop
        } else {
            Drive::ClosedLoop(MotionSettings::Hold)
        },
        injection_v: settings.excitation.samples(rate_hz, periods),
        decimation: 1,
        time_limit_s: 10.0 + 2.0 * periods as f64 * settings.excitation.period_s,
    }
}

fn settling_s(short: bool) -> f64 {
    if short { SHORT_SETTLING_S } else { SETTLING_S }
}

/// The distance in which so many blocks fit: a period more, because blocks begin where a period does.
fn pass_length_mm(settings: &FrfSettings, periods: usize) -> f64 {
    let speed = settings.bias_velocity_mm_s.abs();
    let steady_s = settling_s(settings.two_sided)
        + (periods + BLOCK_PERIODS) as f64 * settings.excitation.period_s;
    speed * (steady_s + settings.ramp_s())
}

/// One pass at constant velocity, and how many blocks it gives.
fn pass(
    settings: &FrfSettings,
    travel_mm: f64,
    rate_hz: f64,
    missing: usize,
    direction: f64,
) -> Result<(Experiment, usize), FrfError> {
    let room_mm = settings.room_mm(travel_mm);
    let periods = (1..=missing)
        .rev()
        .find(|&periods| pass_length_mm(settings, periods) <= room_mm)
        .ok_or_else(|| too_short(settings, travel_mm))?;
    let length_mm = pass_length_mm(settings, periods);
    let speed = settings.bias_velocity_mm_s.abs();
    let duration_s = length_mm / speed + settings.ramp_s();
    // The motion begins a few control periods after the recording.
    let excited = ((duration_s + 0.1) / settings.excitation.period_s).ceil() as usize;
    let motion = PointToPointSettings {
        distance_mm: direction * length_mm,
        max_velocity_mm_s: speed,
        max_acceleration_mm_s2: settings.acceleration_mm_s2,
        max_jerk_mm_s3: JERK_MM_S3,
    };
    let experiment = Experiment {
        name: format!("frequency response at {:.2} mm/s", direction * speed),
        drive: Drive::ClosedLoop(MotionSettings::PointToPoint(motion)),
        injection_v: settings.excitation.samples(rate_hz, excited),
        decimation: 1,
        time_limit_s: 10.0 + 2.0 * duration_s,
    };
    Ok((experiment, periods))
}

/// The samples at which the axis has settled: all but the first period at standstill, those at constant reference velocity
/// otherwise.
fn steady_range(recording: &Recording, settings: &FrfSettings) -> Range<usize> {
    let bias_velocity_mm_s = settings.bias_velocity_mm_s;
    if bias_velocity_mm_s == 0.0 {
        return 1..recording.len();
    }
    let step_mm = bias_velocity_mm_s.abs() * recording.sample_time_s;
    let reference = &recording.reference_mm;
    // The reference is rebuilt from single-precision errors: a step is known to a count's hundredth at best.
    let steady = |index: &usize| {
        let index = *index;
        let span = STEADY_SAMPLES.min(reference.len() - 1 - index);
        let moved = (reference[index + span] - reference[index]).abs();
        span == STEADY_SAMPLES
            && (moved - span as f64 * step_mm).abs() < 1e-3 * span as f64 * step_mm
    };
    let settling = (settling_s(settings.two_sided) / recording.sample_time_s) as usize;
    let first = (0..reference.len()).find(steady);
    let last = (0..reference.len()).rev().find(steady);
    match (first, last) {
        (Some(first), Some(last)) => first + settling..last.max(first + settling),
        _ => 0..0,
    }
}

/// Checks that the axis kept moving all the time.
fn check_sliding(
    recording: &Recording,
    steady: &Range<usize>,
    settings: &FrfSettings,
    resolution_mm: f64,
) -> Result<(), FrfError> {
    let bias = settings.bias_velocity_mm_s;
    if bias == 0.0 {
        return Ok(());
    }
    let seen_s = SPEED_COUNTS * resolution_mm / bias.abs();
    let span = ((SPEED_S.max(seen_s) / recording.sample_time_s) as usize).max(1);
    let along = if recording.reference_mm.first() < recording.reference_mm.last() {
        1.0
    } else {
        -1.0
    };
    let least_mm_s = recording.position_mm[steady.clone()]
        .windows(span + 1)
        .map(|window| along * (window[span] - window[0]) / (span as f64 * recording.sample_time_s))
        .fold(f64::INFINITY, f64::min);
    if least_mm_s < MIN_SPEED_RATIO * bias.abs() {
        return Err(FrfError::NotSliding {
            velocity_mm_s: bias.abs(),
            least_mm_s,
            amplitude_v: settings.excitation.rms_v,
        });
    }
    Ok(())
}

/// Least time over which the velocity is taken, s.
const SPEED_S: f64 = 2e-3;
/// Counts that the bias moves in this time at least: a noise of one count is no standstill then.
const SPEED_COUNTS: f64 = 12.0;
/// Least velocity over the bias: below it, the axis does not slide.
const MIN_SPEED_RATIO: f64 = 0.25;

/// Samples over which the reference's velocity is looked at.
const STEADY_SAMPLES: usize = 100;
