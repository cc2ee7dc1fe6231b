//! The fitted model run over the record: in open loop from the recorded voltage, in closed loop from its reference.

use super::model::{AT_ONCE_MM, MotionModel};
use super::signals::Signals;
use crate::record::Recording;

/// A position loop around a velocity loop, as many machines have it: `u = kv (kp (reference - position) - velocity)`, the
/// velocity by differencing the mean of each two neighbouring positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CascadeLoop {
    /// kp, 1/s; above zero.
    pub position_gain_per_s: f64,
    /// kv, V s/mm; above zero.
    pub velocity_gain_v_s_per_mm: f64,
    /// The amplifier input's range, +- V.
    pub limit_v: f64,
}

/// A simulated run beside the recorded one.
#[derive(Clone, Debug, PartialEq)]
pub struct Replayed {
    /// Simulated position, mm.
    pub position_mm: Vec<f64>,
    /// Voltage that drove it, V.
    pub voltage_v: Vec<f64>,
    /// RMS difference of the positions, mm.
    pub position_rms_mm: f64,
    /// Norm of the difference of the voltages over that of the recorded one; zero in open loop.
    pub voltage_error: f64,
}

/// Longest step of the simulation, s.
const STEP_S: f64 = 1e-4;

/// A model that moves.
struct Moving<'a> {
    model: &'a MotionModel,
    position_mm: f64,
    velocity_mm_s: f64,
    /// Level and knot of each element, and its share of the level, -1 to 1. Elements without a level count, too: what changes
    /// with velocity, time and place acts on the mean of all.
    elements: Vec<(f64, f64, f64)>,
}

impl<'a> Moving<'a> {
    /// At the record's first position and velocity; where the record starts in motion, the elements have turned its way.
    fn start(model: &'a MotionModel, signals: &Signals) -> Self {
        let velocity_mm_s = signals.velocity_mm_s.first().copied().unwrap_or(0.0);
        let turned = if velocity_mm_s.abs() > signals.moving_mm_s() {
            velocity_mm_s.signum()
        } else {
            0.0
        };
        let level_at_once = [(AT_ONCE_MM, model.friction.positive.curve.coulomb_v)];
        let elements = if model.elements.is_empty() {
            level_at_once.as_slice()
        } else {
            &model.elements
        };
        Self {
            model,
            position_mm: signals.position_mm.first().copied().unwrap_or(0.0),
            velocity_mm_s,
            elements: elements
                .iter()
                .map(|&(knot_mm, level_v)| (level_v, knot_mm, turned))
                .collect(),
        }
    }

    /// One step under a voltage that acts now; the velocity first, then the position with the new one.
    fn step(&mut self, voltage_v: f64, time_s: f64, step_s: f64) {
        let model = self.model;
        let moved_mm = self.velocity_mm_s * step_s;
        let (mut friction_v, mut hysteresis) = (0.0, 0.0);
        for (level_v, knot_mm, share) in &mut self.elements {
            *share = (*share + moved_mm / *knot_mm).clamp(-1.0, 1.0);
            friction_v += *level_v * *share;
            hysteresis += *share;
        }
        hysteresis /= self.elements.len() as f64;
        let velocity = self.velocity_mm_s;
        let way = if velocity < 0.0 {
            &model.friction.negative
        } else {
            &model.friction.positive
        };
        // The elements' levels are those of fast motion.
        let curve = &way.curve;
        let drop = if curve.breakaway_v == curve.coulomb_v {
            0.0
        } else {
            curve.level_v(velocity) - curve.coulomb_v
        };
        let time = model.span.time_share(time_s);
        let place = model.span.travel_share(self.position_mm);
        let level = drop + time * model.drift.level_v + place * model.along_travel.level_v;
        let offset_v =
            model.offset_v + time * model.drift.offset_v + place * model.along_travel.offset_v;
        let force_v = voltage_v
            - friction_v
            - hysteresis * level
            - way.viscous_v_s_per_mm * velocity
            - offset_v;
        self.velocity_mm_s += step_s * force_v / model.inertia_v_s2_per_mm;
        self.position_mm += step_s * self.velocity_mm_s;
    }
}

/// Drives the model by a voltage that `law` gives at each sample for the position then; each is held for a sample, and acts
/// the model's own delay later.
fn run(
    model: &MotionModel,
    signals: &Signals,
    (samples, sample_time_s): (usize, f64),
    mut law: impl FnMut(usize, f64) -> f64,
) -> (Vec<f64>, Vec<f64>) {
    let mut moving = Moving::start(model, signals);
    let steps = (sample_time_s / STEP_S).ceil().max(1.0);
    let step_s = sample_time_s / steps;
    let late_steps = (model.delay_s() / step_s).round() as usize;
    let steps = steps as usize;
    let (mut position_mm, mut voltage_v) = (Vec::new(), Vec::new());
    for sample in 0..samples {
        position_mm.push(moving.position_mm);
        voltage_v.push(law(sample, moving.position_mm));
        for step in 0..steps {
            let now = sample * steps + step;
            let acting = now.saturating_sub(late_steps) / steps;
            moving.step(voltage_v[acting], now as f64 * step_s, step_s);
        }
    }
    (position_mm, voltage_v)
}

/// The position of the model driven by the prepared record's voltage.
pub(super) fn open_loop_mm(model: &MotionModel, signals: &Signals) -> Vec<f64> {
    let length = (signals.voltage_v.len(), signals.sample_time_s);
    run(model, signals, length, |sample, _| {
        signals.voltage_v[sample]
    })
    .0
}

/// Drives the model by the recorded voltage.
pub fn replay_open_loop(model: &MotionModel, recording: &Recording, signals: &Signals) -> Replayed {
    replayed(model, recording, signals, |sample, _| {
        recording.voltage_v[sample]
    })
}

/// Lets the model follow the recorded reference under a cascade.
pub fn replay_closed_loop(
    model: &MotionModel,
    recording: &Recording,
    signals: &Signals,
    cascade: &CascadeLoop,
) -> Replayed {
    let first_mm = signals.position_mm.first().copied().unwrap_or(0.0);
    let moved_mm = signals.velocity_mm_s.first().copied().unwrap_or(0.0) * recording.sample_time_s;
    let mut before = [first_mm - 2.0 * moved_mm, first_mm - moved_mm];
    replayed(model, recording, signals, |sample, position| {
        let velocity = (position - before[0]) / (2.0 * recording.sample_time_s);
        before = [before[1], position];
        let commanded = cascade.position_gain_per_s * (recording.reference_mm[sample] - position);
        let voltage = cascade.velocity_gain_v_s_per_mm * (commanded - velocity);
        voltage.clamp(-cascade.limit_v, cascade.limit_v)
    })
}

fn replayed(
    model: &MotionModel,
    recording: &Recording,
    signals: &Signals,
    law: impl FnMut(usize, f64) -> f64,
) -> Replayed {
    let length = (recording.len(), recording.sample_time_s);
    let (position_mm, voltage_v) = run(model, signals, length, law);
    let squares =
        |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
    let recorded: f64 = recording.voltage_v.iter().map(|v| v * v).sum();
    Replayed {
        position_rms_mm: (squares(&position_mm, &recording.position_mm) / recording.len() as f64)
            .sqrt(),
        voltage_error: (squares(&voltage_v, &recording.voltage_v) / recorded).sqrt(),
        position_mm,
        voltage_v,
    }
}
