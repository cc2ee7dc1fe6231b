//! Remedies against a cut, tried beside the law: a disturbance observer, and a friction model fed with the measured
//! vibration. Each adds a voltage to the law's output.

use std::f64::consts::TAU;

use num_complex::Complex64;
use quadrant_law::axis::telemetry::AxisTelemetry;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::friction::Direction;
use quadrant_law::friction::gms::{FIRMWARE_ELEMENTS, Gms, GmsState};
use quadrant_law::friction::stribeck::SlidingTable;
use quadrant_settings::AxisSettings;
use quadrant_settings::response::LinearResponse;
use quadrant_sim::loop_shape::{OpenLoop, SampledLoop};

use super::run::Addition;

/// Bound of the sensitivity that the commissioning designs for.
const MOST_S: f64 = 1.7;
/// Bound of the complementary sensitivity that it designs for.
const MOST_T: f64 = 1.5;

/// A low-pass of second order, with its derivatives.
#[derive(Clone, Copy, Debug, Default)]
struct LowPass {
    value: f64,
    slope: f64,
}

impl LowPass {
    const DAMPING: f64 = 0.707;

    /// One step; returns value, slope and curvature.
    fn step(&mut self, input: f64, omega: f64, period_s: f64) -> (f64, f64, f64) {
        let bend = omega * omega * (input - self.value) - 2.0 * Self::DAMPING * omega * self.slope;
        self.slope += period_s * bend;
        self.value += period_s * self.slope;
        (self.value, self.slope, bend)
    }

    fn response(omega: f64, at: Complex64) -> Complex64 {
        omega * omega / (at * at + 2.0 * Self::DAMPING * omega * at + omega * omega)
    }
}

/// Disturbance observer of the nominal plant that receives the friction feedforward, so that it takes away only what that
/// leaves.
pub(super) struct Observer {
    plant: PlantModel,
    omega: f64,
    period_s: f64,
    resolution_mm: f64,
    position: LowPass,
    input: LowPass,
    /// Voltages on their way to the plant, the oldest first.
    late: std::collections::VecDeque<f64>,
    added_v: f64,
}

impl Observer {
    pub(super) fn new(axis: &AxisSettings, plant: &PlantModel, omega: f64, rate_hz: f64) -> Self {
        let delay = (plant.delay_s * rate_hz).round() as usize;
        Self {
            plant: *plant,
            omega,
            period_s: 1.0 / rate_hz,
            resolution_mm: axis.encoder.resolution_mm,
            position: LowPass::default(),
            input: LowPass::default(),
            late: vec![0.0; delay].into(),
            added_v: 0.0,
        }
    }

    /// Peaks of |S| and |T| of the axis' loop with an observer of a bandwidth, rad/s; 0 for none.
    pub(super) fn peaks(
        axis: &AxisSettings,
        plant: &PlantModel,
        omega: f64,
        rate_hz: f64,
    ) -> (f64, f64) {
        let alone = SampledLoop::new(plant, &axis.feedback.pid, 1.0 / rate_hz, 0.0);
        let mut peaks = (0.0, 0.0);
        for step in 0..2000 {
            let at = TAU * 0.1 * 10f64.powf(4.5 * f64::from(step) / 2000.0);
            let s = Complex64::new(0.0, at);
            let mut open = alone.response(at);
            if omega > 0.0 {
                let (filter, late) = (LowPass::response(omega, s), (-s * plant.delay_s).exp());
                let held = plant.response(at);
                let inverse = s * (s + plant.damping_per_s) / plant.gain_mm_per_v_s2;
                open = (open + held * filter * inverse) / (1.0 - filter * late);
            }
            let sensitivity = 1.0 / (1.0 + open);
            peaks.0 = sensitivity.norm().max(peaks.0);
            peaks.1 = (open * sensitivity).norm().max(peaks.1);
        }
        peaks
    }

    /// The largest bandwidth within the bounds of |S| and |T|, rad/s; 0 if the loop alone is at them.
    pub(super) fn widest(axis: &AxisSettings, plant: &PlantModel, rate_hz: f64) -> f64 {
        (1..=400)
            .map(f64::from)
            .take_while(|&omega| {
                let (sensitivity, complementary) = Self::peaks(axis, plant, omega, rate_hz);
                sensitivity <= MOST_S && complementary <= MOST_T
            })
            .last()
            .unwrap_or(0.0)
    }
}

impl Addition for Observer {
    fn step(&mut self, seen: &AxisTelemetry<f32>) -> f64 {
        let position_mm = seen.reference.to_mm(self.resolution_mm) - f64::from(seen.error_mm());
        let (_, velocity, acceleration) =
            self.position.step(position_mm, self.omega, self.period_s);
        let friction = f64::from(seen.feedforward.level + seen.feedforward.gms);
        self.late
            .push_back(f64::from(seen.output_v()) + self.added_v - friction);
        let arriving = self.late.pop_front().unwrap_or(0.0);
        let (driven, ..) = self.input.step(arriving, self.omega, self.period_s);
        let needed =
            (acceleration + self.plant.damping_per_s * velocity) / self.plant.gain_mm_per_v_s2;
        self.added_v = (driven - needed).clamp(-0.5, 0.5);
        self.added_v
    }
}

/// Corner above which the error is vibration, Hz.
const VIBRATION_HZ: f64 = 40.0;
/// Corner above which friction averages it out, Hz.
const AVERAGED_HZ: f64 = 75.0;
/// Corner above which the encoder's noise outweighs vibration, Hz.
const NOISE_HZ: f64 = 400.0;
/// Time over which the fed model's output is averaged, s.
const AVERAGE_S: f64 = 0.01;
/// Time over which the vibration's power is averaged, s.
const POWER_S: f64 = 0.05;
/// Amplitude of the vibration's velocity that halves, as the gate's, mm/s.
const HALF_MM_S: f64 = 2.0;
/// Largest amplitude that does not count as vibration, mm/s.
const QUIET_MM_S: f64 = 1.5;

/// One-pole high-pass.
#[derive(Clone, Copy, Debug, Default)]
struct HighPass {
    slow: f64,
}

impl HighPass {
    fn step(&mut self, input: f64, hz: f64, period_s: f64) -> f64 {
        self.slow += (1.0 - (-TAU * hz * period_s).exp()) * (input - self.slow);
        input - self.slow
    }
}

/// The GMS of the settings stepped by the reference and by the measured vibration, its output averaged; blended with the gate by
/// the share of the vibration's power above 75 Hz.
pub(super) struct FedFriction {
    model: Gms<f64, FIRMWARE_ELEMENTS>,
    state: GmsState<f64, FIRMWARE_ELEMENTS>,
    surface: SlidingTable<f64>,
    gain: f64,
    period_s: f64,
    high: [HighPass; 2],
    higher: HighPass,
    last: [f64; 2],
    quiet: [HighPass; 2],
    power: [f64; 2],
    average: std::collections::VecDeque<f64>,
    sum: f64,
}

impl FedFriction {
    pub(super) fn new(axis: &AxisSettings, rate_hz: f64) -> Self {
        let period_s = 1.0 / rate_hz;
        Self {
            state: GmsState::default(),
            model: Gms::build(&axis.friction.gms.elements),
            surface: SlidingTable::build(
                &axis.friction.sliding.map(|model| model.curve),
                axis.friction.gms.attraction_v_s,
                period_s,
            ),
            gain: axis.feedforward.gains.gms,
            period_s,
            high: [HighPass::default(); 2],
            higher: HighPass::default(),
            last: [0.0; 2],
            quiet: [HighPass::default(); 2],
            power: [0.0; 2],
            average: vec![0.0; (AVERAGE_S * rate_hz) as usize].into(),
            sum: 0.0,
        }
    }
}

impl Addition for FedFriction {
    fn step(&mut self, seen: &AxisTelemetry<f32>) -> f64 {
        let [first, second] = &mut self.high;
        let once = first.step(-f64::from(seen.error_mm()), VIBRATION_HZ, self.period_s);
        let vibration = second.step(once, VIBRATION_HZ, self.period_s);
        let higher = self.higher.step(vibration, AVERAGED_HZ, self.period_s);
        let now = [vibration, higher];
        let filters = self.power.iter_mut().zip(&mut self.quiet);
        for ((power, quiet), (now, last)) in filters.zip(now.iter().zip(self.last)) {
            let raw = (now - last) / self.period_s;
            let velocity = raw - quiet.step(raw, NOISE_HZ, self.period_s);
            *power += self.period_s / POWER_S * (2.0 * velocity * velocity - *power);
        }
        let displacement = now[0] - self.last[0];
        self.last = now;
        let velocity = f64::from(seen.velocity);
        let moved = velocity * self.period_s + displacement;
        let sense = Direction::of(moved);
        let surface = self.surface.at((moved / self.period_s).abs(), sense);
        let force = self.gain * self.model.step(&mut self.state, moved, surface);
        self.sum += force - self.average.pop_front().unwrap_or(0.0);
        self.average.push_back(force);
        let fed = self.sum / self.average.len() as f64;
        let power = (self.power[0] - QUIET_MM_S * QUIET_MM_S).max(0.0);
        let shaken = power / (power + HALF_MM_S * HALF_MM_S);
        let averaged = (self.power[1] / self.power[0].max(1e-12)).min(1.0);
        shaken * (averaged * fed - f64::from(seen.feedforward.gms))
    }
}
