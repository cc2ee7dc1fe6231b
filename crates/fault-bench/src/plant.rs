//! A model of the simulated stage's x axis, and an encoder that dies.

use std::collections::VecDeque;

use quadrant::settings::StageSettings;

use crate::noise::Noise;

/// Length of a count, mm.
pub const COUNT_MM: f64 = 5e-4;
/// Control period, s.
pub const PERIOD_S: f64 = 1e-4;
/// Steps of the plant in a control period.
const SUBSTEPS: usize = 4;

/// The simulated stage's x axis, with what may differ from the model in its settings.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// A, B and Td over the model's.
    pub gain: f64,
    pub damping: f64,
    pub delay: f64,
    /// Friction over the settings'.
    pub friction: f64,
    /// The amplifier turns the motor the other way.
    pub reversed: bool,
}

pub const MODEL: Truth = Truth {
    gain: 1.0,
    damping: 1.0,
    delay: 1.0,
    friction: 1.0,
    reversed: false,
};

/// The x axis: mass, drag, dead time, and friction that yields before it slides (blocks on springs).
pub struct Plant {
    gain: f64,
    damping: f64,
    /// Stiffness, V/mm, largest force, V, and present force, V, of each block.
    blocks: [[f64; 3]; 4],
    pipeline: VecDeque<f64>,
    pub position_mm: f64,
    pub velocity_mm_s: f64,
    pub load_v: f64,
    pub blocked: bool,
}

impl Plant {
    pub fn new(truth: &Truth) -> Self {
        let settings = StageSettings::simulated();
        let [axis, ..] = &settings.axes;
        let model = axis.plant.expect("by default");
        let level = truth.friction * axis.friction.sliding.positive.curve.breakaway_v;
        let mut blocks = [[0.0; 3]; 4];
        for (block, element) in blocks.iter_mut().zip(&axis.friction.gms.elements) {
            *block = [
                truth.friction * element.stiffness_v_per_mm,
                element.weight * level,
                0.0,
            ];
        }
        let delay = truth.delay * model.delay_s / PERIOD_S * SUBSTEPS as f64;
        Self {
            gain: if truth.reversed { -1.0 } else { 1.0 } * truth.gain * model.gain_mm_per_v_s2,
            damping: truth.damping * model.damping_per_s,
            blocks,
            pipeline: VecDeque::from(vec![0.0; delay.round() as usize]),
            position_mm: 0.0,
            velocity_mm_s: 0.0,
            load_v: 0.0,
            blocked: false,
        }
    }

    pub fn step(&mut self, volts: f64) {
        let step_s = PERIOD_S / SUBSTEPS as f64;
        for _ in 0..SUBSTEPS {
            self.pipeline.push_back(volts);
            let arriving = self.pipeline.pop_front().unwrap_or(volts);
            let friction: f64 = self.blocks.iter().map(|block| block[2]).sum();
            let force = self.gain * (arriving + self.load_v) - self.gain.abs() * friction;
            self.velocity_mm_s += step_s * (force - self.damping * self.velocity_mm_s);
            if self.blocked {
                self.velocity_mm_s = 0.0;
            }
            let moved = step_s * self.velocity_mm_s;
            self.position_mm += moved;
            for [stiffness, most, force] in &mut self.blocks {
                *force = (*force + *stiffness * moved).clamp(-*most, *most);
            }
        }
    }
}

/// A way in which an encoder dies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Death {
    Healthy,
    /// Both lines stuck, or the counter: it stands.
    Frozen,
    /// One line stuck: the other counts up and down again.
    OneLine,
    /// As frozen, and dithering by a count as noise would have it.
    Dithering,
    /// Five milliseconds without counts, five with.
    Intermittent,
    /// Counts the other way.
    Reversed,
}

pub const DEATHS: [Death; 5] = [
    Death::Frozen,
    Death::OneLine,
    Death::Dithering,
    Death::Intermittent,
    Death::Reversed,
];

pub struct Encoder {
    pub death: Death,
    raw: i64,
    seen: i64,
    pub noise: Noise,
    /// Noise that is added, counts rms.
    pub rms: f64,
}

impl Encoder {
    pub fn new(death: Death, seed: u64) -> Self {
        Self {
            death,
            raw: 0,
            seen: 0,
            noise: Noise::new(seed),
            rms: 0.0,
        }
    }

    /// Nearly normal: the sum of twelve uniform numbers.
    fn normal(&mut self) -> f64 {
        let sum: i64 = (0..12).map(|_| self.noise.counts(500)).sum();
        sum as f64 * 1e-3
    }

    pub fn read(&mut self, position_mm: f64, age: Option<u32>) -> i64 {
        let fine = self.noise.counts(300) as f64 * 1e-3
            + if self.rms > 0.0 {
                self.rms * self.normal()
            } else {
                0.0
            };
        let raw = (position_mm / COUNT_MM + fine).floor() as i64;
        let step = raw - self.raw;
        self.raw = raw;
        let Some(age) = age else {
            self.seen += step;
            return self.seen;
        };
        match self.death {
            Death::Healthy => self.seen += step,
            Death::Frozen => {}
            Death::OneLine => return self.seen + (raw >> 1 & 1),
            Death::Dithering => return self.seen + (self.noise.counts(1000) > 0) as i64,
            Death::Intermittent => {
                if age / 50 % 2 == 1 {
                    self.seen += step;
                }
            }
            Death::Reversed => self.seen -= step,
        }
        self.seen
    }
}
