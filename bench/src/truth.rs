//! The stage's own parameters, which the law does not know: the simulated stage's or those of a file, with knobs.
//!
//! They are the same to the bit on every platform: what the plant would compute by the platform's functions is rounded, or
//! computed here by `libm`.

use std::f64::consts::TAU;

use quadrant_settings::StageSettings;
use quadrant_sim::plant::{AxisParameters, MarkParameters, StageParameters};
use quadrant_sim::stage_setup::StageSetup;
use serde::Serialize;

/// A knob of the stage, which turns all axes alike.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Knob {
    /// Name in requests.
    pub name: &'static str,
    /// Name on the page.
    pub label: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Smallest value.
    pub least: f64,
    /// Largest value.
    pub most: f64,
    /// Value at rest.
    pub default: f64,
    /// Meaning, in one sentence.
    pub meaning: &'static str,
    #[serde(skip)]
    turn: fn(AxisParameters, f64) -> AxisParameters,
}

/// All knobs.
pub const KNOBS: [Knob; 7] = [
    Knob {
        name: "friction",
        label: "Friction",
        unit: "×",
        least: 0.2,
        most: 3.0,
        default: 1.0,
        meaning: "All friction, over that of the simulated stage: fresh oil below one, cold grease above.",
        turn: AxisParameters::with_friction,
    },
    Knob {
        name: "stribeck",
        label: "Stribeck effect",
        unit: "×",
        least: 0.0,
        most: 4.0,
        default: 1.0,
        meaning: "Fall of friction from breakaway to fast sliding, over that of the simulated stage.",
        turn: with_stribeck,
    },
    Knob {
        name: "presliding",
        label: "Pre-sliding range",
        unit: "×",
        least: 0.3,
        most: 3.0,
        default: 1.0,
        meaning: "Way from rest until everything slides, over that of the simulated stage.",
        turn: with_presliding,
    },
    Knob {
        name: "mass",
        label: "Moving mass",
        unit: "×",
        least: 0.5,
        most: 2.0,
        default: 1.0,
        meaning: "Moving mass, over that of the simulated stage: a heavy workpiece.",
        turn: AxisParameters::with_mass,
    },
    Knob {
        name: "delay",
        label: "Added delay",
        unit: "ms",
        least: 0.0,
        most: 1.0,
        default: 0.0,
        meaning: "Delay of the amplifier beyond that of the simulated stage.",
        turn: |axis, ms| axis.with_more_delay(1e-3 * ms),
    },
    Knob {
        name: "ripple",
        label: "Screw's ripple",
        unit: "×",
        least: 0.0,
        most: 10.0,
        default: 1.0,
        meaning: "Force that repeats with each turn of the screw, over that of the simulated stage.",
        turn: |axis, factor| axis.with_imperfection(|of| of.ripple_v *= factor),
    },
    Knob {
        name: "noise",
        label: "Encoder's noise",
        unit: "×",
        least: 0.0,
        most: 10.0,
        default: 1.0,
        meaning: "Noise of the encoder, over that of the simulated stage.",
        turn: |axis, factor| axis.with_imperfection(|of| of.encoder_noise_mm *= factor),
    },
];

/// Breakaway as far above the Coulomb level as `factor` times before.
fn with_stribeck(mut axis: AxisParameters, factor: f64) -> AxisParameters {
    axis.friction = axis.friction.map(|model| {
        let mut model = *model;
        let curve = &mut model.curve;
        curve.breakaway_v = curve.coulomb_v + factor * (curve.breakaway_v - curve.coulomb_v);
        model
    });
    axis
}

/// The same levels, reached over `factor` times the way.
fn with_presliding(mut axis: AxisParameters, factor: f64) -> AxisParameters {
    for element in &mut axis.gms.elements {
        element.stiffness_v_per_mm /= factor;
    }
    axis
}

/// A stage, and the position of every knob.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The stage while all knobs are at rest.
    at_rest: StageParameters,
    /// Switches and index pulses.
    pub marks: [MarkParameters; 3],
    knobs: [f64; KNOBS.len()],
}

impl Default for Truth {
    fn default() -> Self {
        Self::new(StageParameters::real(), Default::default())
    }
}

impl Truth {
    /// A stage with all knobs at rest.
    pub fn new(at_rest: StageParameters, marks: [MarkParameters; 3]) -> Self {
        Self {
            at_rest,
            marks,
            knobs: KNOBS.map(|knob| knob.default),
        }
    }

    /// The same stage with the encoders and the converters that settings say.
    #[must_use]
    pub fn equipped(self, settings: &StageSettings) -> Self {
        let setup = StageSetup::fresh(self.at_rest, self.marks).started_with(settings);
        Self {
            at_rest: setup.truth,
            marks: setup.marks,
            knobs: self.knobs,
        }
    }

    /// The knobs' values, in their order.
    pub fn values(&self) -> &[f64] {
        &self.knobs
    }

    /// Turns a knob.
    ///
    /// # Errors
    /// A knob that is not there, or a value outside its range, in words.
    pub fn turn(&mut self, name: &str, value: f64) -> Result<(), String> {
        let index = KNOBS.iter().position(|knob| knob.name == name);
        let index = index.ok_or_else(|| format!("the stage has no {name}"))?;
        let Knob { least, most, .. } = KNOBS[index];
        if !(least..=most).contains(&value) {
            return Err(format!("{name} = {value} is outside {least} to {most}"));
        }
        self.knobs[index] = value;
        Ok(())
    }

    /// The stage with the knobs where they are, but for the ripples of its screws.
    pub fn stage(&self) -> StageParameters {
        let mut axes = self.whole();
        for axis in &mut axes {
            axis.imperfections.ripple_v = 0.0;
            for element in &mut axis.gms.elements {
                element.stiffness_v_per_mm = rounded(element.stiffness_v_per_mm);
                element.weight = rounded(element.weight);
            }
        }
        StageParameters { axes }
    }

    /// The ripples of the screws, x, y, z.
    pub fn ripples(&self) -> [Ripple; 3] {
        self.whole().map(|axis| Ripple {
            amplitude_v: axis.imperfections.ripple_v,
            lead_mm: axis.imperfections.lead_mm,
        })
    }

    fn whole(&self) -> [AxisParameters; 3] {
        self.at_rest.axes.clone().map(|axis| {
            let knobs = KNOBS.iter().zip(self.knobs);
            knobs.fold(axis, |axis, (knob, value)| (knob.turn)(axis, value))
        })
    }
}

/// The force of a screw, which repeats with each of its turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripple {
    amplitude_v: f64,
    lead_mm: f64,
}

impl Ripple {
    /// The force at a position, V: positive pushes towards larger positions.
    pub fn force_v(&self, position_mm: f64) -> f64 {
        -self.amplitude_v * libm::sin(TAU * position_mm / self.lead_mm)
    }
}

/// A number to nine decimals: the exponential that it comes from has another last bit on another platform.
fn rounded(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knobs_at_rest_leave_the_simulated_stage_as_it_is() {
        let [truth, stage] = [Truth::default().stage(), StageParameters::real()];
        for (axis, real) in truth.axes.iter().zip(&stage.axes) {
            let level = |of: &AxisParameters| of.friction.positive.curve.breakaway_v;
            assert!((level(axis) - level(real)).abs() < 1e-15);
            let stiffness = |of: &AxisParameters| of.gms.elements[0].stiffness_v_per_mm;
            assert!((stiffness(axis) - stiffness(real)).abs() < 1e-9);
            assert_eq!(axis.delay_s, real.delay_s);
        }
    }

    #[test]
    fn every_knob_changes_every_axis() {
        let rest = Truth::default();
        for knob in KNOBS {
            let mut truth = Truth::default();
            truth.turn(knob.name, knob.most).unwrap();
            let (turned, before) = (truth.stage(), rest.stage());
            let ripples = truth.ripples().into_iter().zip(rest.ripples());
            for ((axis, other), (ripple, old)) in turned.axes.iter().zip(&before.axes).zip(ripples)
            {
                assert!(axis != other || ripple != old, "{}", knob.name);
            }
        }
    }

    #[test]
    fn a_value_outside_a_knob_s_range_is_refused() {
        let mut truth = Truth::default();
        assert_eq!(
            truth.turn("mass", 3.0).unwrap_err(),
            "mass = 3 is outside 0.5 to 2"
        );
        assert!(truth.turn("mass", f64::NAN).is_err());
        assert!(truth.turn("colour", 1.0).is_err());
        assert_eq!(truth, Truth::default());
    }
}
