//! Drive train between an axis' motor and its table. Every default number here is chosen, none measured.

use std::f64::consts::TAU;

/// The drive of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Drive {
    /// A screw so stiff that motor and table move as one; its ripple is among the axis' imperfections.
    #[default]
    BallScrew,
    /// A linear motor on the table itself.
    Direct(Cogging),
    /// A pinion on a rack, with backlash.
    RackAndPinion(Backlash),
}

/// The force with which a linear motor's iron seeks its magnets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cogging {
    /// Distance from one pole to the next, mm; above zero.
    pub pole_pitch_mm: f64,
    /// Amplitudes at once and twice a pole, V; zero or more.
    pub amplitude_v: [f64; 2],
}

impl Cogging {
    /// The force at a position, V: positive pushes towards larger positions.
    pub fn force_v(&self, position_mm: f64) -> f64 {
        let phase = TAU * position_mm / self.pole_pitch_mm;
        let [first, second] = self.amplitude_v;
        -(first * phase.sin() + second * (2.0 * phase).sin())
    }
}

/// Side of the backlash that the encoder is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncoderSide {
    /// On the motor: it does not see the backlash.
    Motor,
    /// On the table, behind the backlash.
    Load,
}

/// Two masses with a gap and a spring between them.
///
/// A share of the moving mass is the motor's; friction acts on the table, the linear damping B on each mass in proportion.
/// Within the gap nothing passes from one to the other; at its ends the teeth press on each other through a spring with
/// a damper, and never pull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backlash {
    /// Width of the gap, mm; zero or more.
    pub width_mm: f64,
    /// Stiffness of the teeth in contact, V/mm; above zero.
    pub stiffness_v_per_mm: f64,
    /// Damping in contact, V s/mm; zero or more.
    pub damping_v_s_per_mm: f64,
    /// The motor's share of the moving mass, 0 to 1, both excluded.
    pub motor_share: f64,
    /// Side that the encoder is on.
    pub encoder: EncoderSide,
}

impl Backlash {
    /// A gap between equal halves of a mass of which a volt accelerates the whole by `gain_mm_per_v_s2`: teeth that
    /// oscillate against each other at 500 Hz with a damping ratio of 0.1.
    pub fn chosen(width_mm: f64, gain_mm_per_v_s2: f64, encoder: EncoderSide) -> Self {
        Self {
            width_mm,
            ..Self::resonating(500.0, 0.1, 0.5, gain_mm_per_v_s2, encoder)
        }
    }

    /// No gap, but a spring on which motor and table oscillate against each other at a frequency in Hz with a damping ratio; the motor
    /// has a share of the mass, of which a volt accelerates the whole by `gain_mm_per_v_s2`.
    pub fn resonating(
        frequency_hz: f64,
        damping_ratio: f64,
        motor_share: f64,
        gain_mm_per_v_s2: f64,
        encoder: EncoderSide,
    ) -> Self {
        // The reduced mass is a b of the whole, a and b the shares.
        let reduced = motor_share * (1.0 - motor_share) / gain_mm_per_v_s2;
        let natural_rad_s = TAU * frequency_hz;
        Self {
            width_mm: 0.0,
            stiffness_v_per_mm: reduced * natural_rad_s * natural_rad_s,
            damping_v_s_per_mm: 2.0 * damping_ratio * reduced * natural_rad_s,
            motor_share,
            encoder,
        }
    }
}

impl Drive {
    /// The force that the drive itself exerts at a position, V.
    pub(super) fn force_v(&self, position_mm: f64) -> f64 {
        match self {
            Self::Direct(cogging) => cogging.force_v(position_mm),
            Self::BallScrew | Self::RackAndPinion(_) => 0.0,
        }
    }
}
