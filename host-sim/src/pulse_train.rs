//! A control with step and direction in front of the simulated stage: the pulses of a planned path, with the jitter of the
//! control's own timer, and the axes that follow them.

use quadrant_law::reference::{
    MotionScale, MotionSettings, PulseReference, PulseScale, PulseState,
};
use quadrant_law::safety::FaultCode;
use quadrant_settings::StageSettings;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::given_run::{GivenReference, GivenRun};
use crate::metrics::{Score, score};
use crate::plant::StageParameters;
use crate::run::RunError;

/// A control that makes pulses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseControl {
    /// Its name.
    pub name: &'static str,
    /// Period in which it may make a step of each axis, s.
    pub period_s: f64,
    /// Largest delay of such a period, s; each has another.
    pub latency_s: f64,
    /// Time for which it keeps a step rate, s.
    pub segment_s: f64,
}

impl PulseControl {
    /// grbl and its descendants: a timer of 100 kHz that interrupts delay, and a hundred segments a second. Chosen.
    pub const GRBL: Self = Self {
        name: "grbl, 100 kHz",
        period_s: 10e-6,
        latency_s: 5e-6,
        segment_s: 10e-3,
    };
    /// LinuxCNC's software stepgen: a base thread of 25 us with 20 us of latency, a servo thread of 1 ms. Chosen.
    pub const LINUXCNC: Self = Self {
        name: "LinuxCNC, base thread 25 us",
        period_s: 25e-6,
        latency_s: 20e-6,
        segment_s: 1e-3,
    };
    /// Mach3 at a parallel port: a kernel of 45 kHz that Windows delays by up to 50 us. Chosen.
    pub const MACH: Self = Self {
        name: "Mach3, 45 kHz",
        period_s: 1.0 / 45e3,
        latency_s: 50e-6,
        segment_s: 1e-3,
    };
    /// All of them.
    pub const ALL: [Self; 3] = [Self::GRBL, Self::LINUXCNC, Self::MACH];

    /// The counter's count in each tick, for a path with a position a tick, mm, from rest; `step_mm` is the length of a step.
    pub fn counts(&self, path_mm: &[f64], step_mm: f64, rate_hz: f64, seed: u64) -> Vec<u32> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let first_mm = path_mm.first().copied().unwrap_or(0.0);
        let at = |time_s: f64| {
            let place = time_s * rate_hz;
            let index = (place as usize).min(path_mm.len() - 1);
            let next = path_mm[(index + 1).min(path_mm.len() - 1)];
            path_mm[index] + (next - path_mm[index]) * (place - index as f64).clamp(0.0, 1.0)
        };
        let mut counts = Vec::with_capacity(path_mm.len());
        let (mut count, mut period, mut due_s) = (0_i64, 0_u64, 0.0);
        for tick in 0..path_mm.len() {
            let now_s = tick as f64 / rate_hz;
            while due_s <= now_s {
                let time_s = period as f64 * self.period_s;
                // Within a segment the rate is constant.
                let segment = (time_s / self.segment_s).floor() * self.segment_s;
                let (from, to) = (at(segment), at(segment + self.segment_s));
                let place = from + (to - from) * (time_s - segment) / self.segment_s;
                let wanted = ((place - first_mm) / step_mm).round() as i64;
                count += (wanted - count).signum();
                period += 1;
                due_s = period as f64 * self.period_s + random.random_range(0.0..self.latency_s);
            }
            counts.push(count as u32);
        }
        counts
    }
}

/// The reference that an axis makes of counts, a tick each.
///
/// # Errors
/// A fault of the pulses.
pub fn followed(
    counts: &[u32],
    pulses: &PulseScale,
    scale: MotionScale,
) -> Result<GivenReference, FaultCode> {
    let reference = PulseReference::<f32>::new(pulses, scale);
    let mut state = PulseState::default();
    let samples = counts
        .iter()
        .map(|count| reference.step(&mut state, *count))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(GivenReference::of_pulses(&samples))
}

/// Pulses of a control, and the length of a step and the delay of the reference that is made of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseInput {
    pub control: PulseControl,
    pub step_mm: f64,
    pub delay_s: f64,
}

/// Reasons for which a path by pulses gives no errors.
#[derive(Clone, Debug, thiserror::Error)]
pub enum PulseRunError {
    #[error("{cause}", cause = .0.cause())]
    Pulses(FaultCode),
    #[error(transparent)]
    Run(#[from] RunError),
}

/// Planned less true position of each axis along paths, mm, a tick each; by pulses, or by the plan itself. The paths begin and end at
/// rest, and are equally long. With pulses the plan is delayed as much as the reference is.
///
/// # Errors
/// Refused settings, a fault of the pulses or of the stage.
pub fn path_errors(
    settings: &StageSettings,
    truth: &StageParameters,
    paths_mm: &[Vec<f64>; 3],
    input: Option<&PulseInput>,
    seed: u64,
) -> Result<[Vec<f64>; 3], PulseRunError> {
    let mut delay_ticks = 0;
    let mut references: [GivenReference; 3] = Default::default();
    for (index, reference) in references.iter_mut().enumerate() {
        let (scale, path_mm) = (settings.motion_scale(index), &paths_mm[index]);
        *reference = match input {
            None => GivenReference::through(path_mm, scale),
            Some(input) => {
                delay_ticks = (input.delay_s * settings.rate_hz).round() as usize;
                let last = path_mm.last().copied().unwrap_or(0.0);
                let mut path_mm = path_mm.clone();
                path_mm.resize(path_mm.len() + 2 * delay_ticks, last);
                let axis = &settings.axes[index];
                let limits = &axis.limits;
                let pulses = PulseScale {
                    step_mm: input.step_mm,
                    counter_bits: 32,
                    delay_ticks: delay_ticks as u32,
                    wait_ticks: 0,
                    preview_ticks: (axis.feedforward.preview_s * scale.rate_hz).round() as u32,
                    max_velocity_mm_s: limits.max_velocity_mm_s,
                    max_acceleration_mm_s2: limits.max_acceleration_mm_s2,
                };
                let noise = seed.wrapping_mul(3).wrapping_add(index as u64);
                let (step_mm, rate_hz) = (input.step_mm, scale.rate_hz);
                let counts = input.control.counts(&path_mm, step_mm, rate_hz, noise);
                followed(&counts, &pulses, scale).map_err(PulseRunError::Pulses)?
            }
        };
    }
    let mut run = GivenRun::of_stage(settings, truth, references, seed).map_err(RunError::from)?;
    while !run.advance(usize::MAX)? {}
    let traces = run.into_traces();
    Ok(std::array::from_fn(|index| {
        let first_mm = paths_mm[index][0];
        let planned = paths_mm[index].iter().map(|place| place - first_mm);
        let places = traces[index].position_mm.iter().skip(delay_ticks);
        planned
            .zip(places)
            .map(|(planned, true_mm)| planned - true_mm)
            .collect()
    }))
}

/// Motions to and fro that are followed and scored.
#[derive(Clone, Debug)]
pub struct ReversalPath {
    paths_mm: [Vec<f64>; 3],
    cycle: usize,
}

/// Longest path, ticks.
const MOST_TICKS: usize = 400_000;

impl ReversalPath {
    /// The path of motions that repeat after `cycle_s`.
    pub fn new(settings: &StageSettings, motions: &[MotionSettings; 3], cycle_s: f64) -> Self {
        let mut paths_mm: [Vec<f64>; 3] = std::array::from_fn(|index| {
            let scale = settings.motion_scale(index);
            let given = GivenReference::of_motion(&motions[index], scale, MOST_TICKS);
            let places = given.samples().iter().map(|sample| sample.position);
            places
                .map(|place| place.to_mm(scale.resolution_mm))
                .collect()
        });
        let longest = paths_mm.iter().map(Vec::len).max().unwrap_or(0);
        for path_mm in &mut paths_mm {
            let last = path_mm.last().copied().unwrap_or(0.0);
            path_mm.resize(longest, last);
        }
        Self {
            paths_mm,
            cycle: (cycle_s * settings.rate_hz).round() as usize,
        }
    }

    /// The score of each axis on two cycles that end an eighth of one before the lead-out of `lead_ticks`.
    ///
    /// # Errors
    /// As [`path_errors`].
    pub fn scores(
        &self,
        settings: &StageSettings,
        truth: &StageParameters,
        input: Option<&PulseInput>,
        (lead_ticks, seed): (usize, u64),
    ) -> Result<[Score; 3], PulseRunError> {
        let errors_mm = path_errors(settings, truth, &self.paths_mm, input, seed)?;
        let end = self.paths_mm[0].len() - lead_ticks - self.cycle / 8;
        let scored = end.saturating_sub(2 * self.cycle)..end;
        Ok(std::array::from_fn(|index| {
            let path_mm = &self.paths_mm[index][scored.clone()];
            score(path_mm, &errors_mm[index][scored.clone()], self.cycle)
        }))
    }
}
