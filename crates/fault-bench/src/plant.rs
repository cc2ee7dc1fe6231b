//! A model of the simulated stage's x axis, and an encoder that dies.

use std::collections::VecDeque;

use quadrant_settings::{AxisSettings, StageSettings};

use crate::noise::Noise;

/// Length of a count, mm.
pub const COUNT_MM: f64 = 5e-4;
/// Control period, s.
pub const PERIOD_S: f64 = 1e-4;
/// Steps of the plant in a control period.
const SUBSTEPS: usize = 4;
/// Ticks that a burst of counts lasts, and from one to the next.
const BURST_TICKS: (u32, u32) = (10, 200);

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

/// Friction of a plant before and while it slides; all of one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Presliding {
    /// Blocks on springs: the GMS elements of the settings.
    Blocks,
    /// Dahl's bristle, with the stiffness of the settings, V/mm; of Coulomb's level in place of breakaway's, if `coulomb`.
    Dahl { coulomb: bool },
    /// A LuGre bristle: the level falls from breakaway to Coulomb's with the speed.
    Lugre,
}

/// The memory of the friction.
enum Friction {
    /// Stiffness, V/mm, largest force, V, and present force, V, of each block.
    Blocks([[f64; 3]; 4]),
    /// Stiffness, V/mm, levels at rest and at speed, V, speed between them, mm/s, and present force, V.
    Bristle {
        stiffness: f64,
        breakaway: f64,
        coulomb: f64,
        stribeck_mm_s: f64,
        force: f64,
    },
}

impl Friction {
    fn new(axis: &AxisSettings, presliding: Presliding, factor: f64) -> Self {
        let curve = &axis.friction.sliding.positive.curve;
        let bristle = |stiffness: f64, breakaway: f64| Self::Bristle {
            stiffness: factor * stiffness,
            breakaway: factor * breakaway,
            coulomb: factor * curve.coulomb_v.min(breakaway),
            stribeck_mm_s: curve.stribeck_velocity_mm_s,
            force: 0.0,
        };
        match presliding {
            Presliding::Blocks => {
                let mut blocks = [[0.0; 3]; 4];
                for (block, element) in blocks.iter_mut().zip(&axis.friction.gms.elements) {
                    *block = [
                        factor * element.stiffness_v_per_mm,
                        element.weight * factor * curve.breakaway_v,
                        0.0,
                    ];
                }
                Self::Blocks(blocks)
            }
            Presliding::Dahl { coulomb } => {
                let stiffness = axis.friction.dahl.expect("by default").stiffness_v_per_mm;
                let level = if coulomb {
                    curve.coulomb_v
                } else {
                    curve.breakaway_v
                };
                let mut friction = bristle(stiffness, level);
                if let Self::Bristle {
                    breakaway, coulomb, ..
                } = &mut friction
                {
                    *coulomb = *breakaway;
                }
                friction
            }
            Presliding::Lugre => {
                let stiffness = axis.friction.lugre.expect("by default").stiffness_v_per_mm;
                bristle(stiffness, curve.breakaway_v)
            }
        }
    }

    fn force_v(&self) -> f64 {
        match self {
            Self::Blocks(blocks) => blocks.iter().map(|block| block[2]).sum(),
            Self::Bristle { force, .. } => *force,
        }
    }

    fn step(&mut self, moved_mm: f64, velocity_mm_s: f64) {
        match self {
            Self::Blocks(blocks) => {
                for [stiffness, most, force] in blocks {
                    *force = (*force + *stiffness * moved_mm).clamp(-*most, *most);
                }
            }
            Self::Bristle {
                stiffness,
                breakaway,
                coulomb,
                stribeck_mm_s,
                force,
            } => {
                let fallen = (-velocity_mm_s.abs() / *stribeck_mm_s).exp();
                let level = *coulomb + (*breakaway - *coulomb) * fallen;
                let end = level.copysign(moved_mm);
                *force = end + (*force - end) * (-*stiffness * moved_mm.abs() / level).exp();
            }
        }
    }
}

/// The x axis: mass, drag, dead time, and friction that yields before it slides.
pub struct Plant {
    gain: f64,
    damping: f64,
    friction: Friction,
    pipeline: VecDeque<f64>,
    pub position_mm: f64,
    pub velocity_mm_s: f64,
    pub load_v: f64,
    pub blocked: bool,
}

impl Plant {
    /// The simulated stage's x axis.
    pub fn new(truth: &Truth) -> Self {
        let settings = StageSettings::simulated();
        Self::of(&settings.axes[0], truth, Presliding::Blocks)
    }

    /// The axis that these settings describe, with what differs from them.
    pub fn of(axis: &AxisSettings, truth: &Truth, presliding: Presliding) -> Self {
        let model = axis.plant.expect("a plant");
        let delay = truth.delay * model.delay_s / PERIOD_S * SUBSTEPS as f64;
        Self {
            gain: if truth.reversed { -1.0 } else { 1.0 } * truth.gain * model.gain_mm_per_v_s2,
            damping: truth.damping * model.damping_per_s,
            friction: Friction::new(axis, presliding, truth.friction),
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
            let friction = self.friction.force_v();
            let force = self.gain * (arriving + self.load_v) - self.gain.abs() * friction;
            self.velocity_mm_s += step_s * (force - self.damping * self.velocity_mm_s);
            if self.blocked {
                self.velocity_mm_s = 0.0;
            }
            let moved = step_s * self.velocity_mm_s;
            self.position_mm += moved;
            self.friction.step(moved, self.velocity_mm_s);
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
    /// The same, and noise of so many counts.
    NoisyLine(i64),
    /// As frozen, and dithering by a count as noise would have it.
    Dithering,
    /// As frozen, and up to so many counts off to either side, another number in every tick: a cable that floats.
    Flickering(i64),
    /// A count forth or back every so many ticks.
    Walking(u32),
    /// In a millisecond of every twenty, up to so many counts forth or back in each tick.
    Bursting(i64),
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

/// Deaths of an encoder that shows counts of its own: what floats beside a motor.
pub const FLICKERS: [Death; 9] = [
    Death::Flickering(1),
    Death::Flickering(2),
    Death::Flickering(5),
    Death::Flickering(20),
    Death::Walking(50),
    Death::Walking(10),
    Death::Walking(1),
    Death::Bursting(3),
    Death::NoisyLine(3),
];

pub struct Encoder {
    pub death: Death,
    raw: i64,
    seen: i64,
    pub noise: Noise,
    /// Noise that is added, counts rms.
    pub rms: f64,
    /// Counts over those that there should be.
    pub scale: f64,
    /// Counts that are added in each tick.
    pub drift: f64,
    drifted: f64,
}

impl Encoder {
    pub fn new(death: Death, seed: u64) -> Self {
        Self {
            death,
            raw: 0,
            seen: 0,
            noise: Noise::new(seed),
            rms: 0.0,
            scale: 1.0,
            drift: 0.0,
            drifted: 0.0,
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
        self.drifted += self.drift;
        let raw = (self.scale * position_mm / COUNT_MM + self.drifted + fine).floor() as i64;
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
            Death::NoisyLine(most) => {
                return self.seen + (raw >> 1 & 1) + self.noise.counts(most);
            }
            Death::Flickering(most) => return self.seen + self.noise.counts(most),
            Death::Walking(ticks) => {
                if age.is_multiple_of(ticks) {
                    self.seen += 1 - 2 * (self.noise.below(2) as i64);
                }
            }
            Death::Bursting(most) => {
                if age % BURST_TICKS.1 < BURST_TICKS.0 {
                    self.seen += self.noise.counts(most);
                }
            }
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
