//! The same axis after something about it has changed, and the same axis on other drives. Every number is chosen.

use quadrant_law::friction::stribeck::StaticFriction;

use super::{
    AxisParameters, Backlash, Cogging, Drive, EncoderSide, Imperfections, virgin_curve_elements,
};

/// The force of a volt at the amplifier's input, N/V, on every axis of the simulated stage: with it the x axis, which a volt
/// accelerates by 69.39 m/s^2, moves 10 kg. Chosen; nothing but a load given in newtons depends on it.
pub const NEWTONS_PER_VOLT: f64 = 693.9;

impl AxisParameters {
    /// With `ratio` times the moving mass, above zero: A, B and C are forces over mass. Friction is left as it is.
    #[must_use]
    pub fn with_mass(mut self, ratio: f64) -> Self {
        self.gain_mm_per_v_s2 /= ratio;
        self.damping_per_s /= ratio;
        self.stiffness_per_s2 /= ratio;
        self
    }

    /// With all friction, level, viscous part and pre-sliding stiffness, `factor` times as large, above zero: cold
    /// grease, or fresh oil. The pre-sliding range stays.
    #[must_use]
    pub fn with_friction(mut self, factor: f64) -> Self {
        self.friction = self.friction.map(|model| StaticFriction {
            curve: quadrant_law::friction::stribeck::StribeckCurve {
                coulomb_v: factor * model.curve.coulomb_v,
                breakaway_v: factor * model.curve.breakaway_v,
                ..model.curve
            },
            viscous_v_s_per_mm: factor * model.viscous_v_s_per_mm,
        });
        for element in &mut self.gms.elements {
            element.stiffness_v_per_mm *= factor;
        }
        self.gms.attraction_v_s *= factor;
        self
    }

    /// With `seconds` more of delay.
    #[must_use]
    pub fn with_more_delay(mut self, seconds: f64) -> Self {
        self.delay_s += seconds;
        self
    }

    /// With `change` made to its imperfections.
    #[must_use]
    pub fn with_imperfection(mut self, change: impl FnOnce(&mut Imperfections)) -> Self {
        change(&mut self.imperfections);
        self
    }

    /// The axis with a linear motor: no screw and so no ripple, a fifth of the screw's friction (the guides alone) over half
    /// its pre-sliding range, a third of its linear damping, and cogging of
    /// `cogging_v` V once a pole of 16 mm and a quarter of that twice.
    #[must_use]
    pub fn direct_drive(mut self, cogging_v: f64) -> Self {
        self = self.with_friction(0.2);
        let breakaway_v = 0.5
            * (self.friction.positive.curve.breakaway_v + self.friction.negative.curve.breakaway_v);
        self.gms.elements = virgin_curve_elements(breakaway_v, 0.015, self.gms.elements.len());
        self.damping_per_s /= 3.0;
        self.imperfections.ripple_v = 0.0;
        self.drive = Drive::Direct(Cogging {
            pole_pitch_mm: 16.0,
            amplitude_v: [cogging_v, 0.25 * cogging_v],
        });
        self
    }

    /// The axis with a pinion on a rack and a gap of `width_mm`, without the screw's ripple.
    #[must_use]
    pub fn rack_and_pinion(mut self, width_mm: f64, encoder: EncoderSide) -> Self {
        self.imperfections.ripple_v = 0.0;
        self.drive =
            Drive::RackAndPinion(Backlash::chosen(width_mm, self.gain_mm_per_v_s2, encoder));
        self
    }
}
