//! The fitted model run over the record: in open loop from the recorded voltage, in closed loop from its reference.

use quadrant::units::DacCode;

use super::model::MotionModel;
use crate::plant::SimulatedAxis;
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

/// Steps of the simulation in a sample of the record.
const STEPS: usize = 10;
/// Converter range of the simulation, V: finer than the record's own where that stays within it.
const FULL_SCALE_V: f64 = 20.0;

/// Drives the model by the recorded voltage, from rest at the first position.
pub fn replay_open_loop(model: &MotionModel, recording: &Recording) -> Replayed {
    run(model, recording, |sample, _| recording.voltage_v[sample])
}

/// Lets the model follow the recorded reference under a cascade.
pub fn replay_closed_loop(
    model: &MotionModel,
    recording: &Recording,
    cascade: &CascadeLoop,
) -> Replayed {
    let mut before = [recording.position_mm.first().copied().unwrap_or(0.0); 2];
    run(model, recording, |sample, position| {
        let velocity = (position - before[0]) / (2.0 * recording.sample_time_s);
        before = [before[1], position];
        let wanted = cascade.position_gain_per_s * (recording.reference_mm[sample] - position);
        let voltage = cascade.velocity_gain_v_s_per_mm * (wanted - velocity);
        voltage.clamp(-cascade.limit_v, cascade.limit_v)
    })
}

fn run(
    model: &MotionModel,
    recording: &Recording,
    mut law: impl FnMut(usize, f64) -> f64,
) -> Replayed {
    let rate_hz = STEPS as f64 / recording.sample_time_s;
    let mut axis = SimulatedAxis::new(model.axis(FULL_SCALE_V), rate_hz, 0);
    let start_mm = recording.position_mm.first().copied().unwrap_or(0.0);
    let codes_per_volt = DacCode::FULL_SCALE / FULL_SCALE_V;
    let (mut position_mm, mut voltage_v) = (Vec::new(), Vec::new());
    for sample in 0..recording.len() {
        let position = start_mm + axis.position_mm();
        let voltage = law(sample, position);
        position_mm.push(position);
        voltage_v.push(voltage);
        let code = DacCode((voltage * codes_per_volt).round() as i16);
        for _ in 0..STEPS {
            axis.step(code, true);
        }
    }
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
