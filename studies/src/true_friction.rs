//! Simulated axes whose friction is of another model than the simulated stage's.

use clap::ValueEnum;
use quadrant_law::friction::dahl::DahlParameters;
use quadrant_law::friction::lugre::LugreParameters;
use quadrant_law::friction::smoothed_gms::SmoothedGmsParameters;
use quadrant_sim::plant::{AxisParameters, FrictionParameters};

/// The model of an axis' true friction, over the levels of the simulated stage's x axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum TrueFriction {
    #[default]
    Gms,
    SmoothedGms,
    Lugre,
    Dahl,
}

/// Stiffness of the pre-sliding range of LuGre and Dahl, V/mm: that of the simulated stage's x axis.
const STIFFNESS_V_PER_MM: f64 = 15.0;
/// Damping of LuGre's bristles, V s/mm.
const DAMPING_V_S_PER_MM: f64 = 1e-3;

impl TrueFriction {
    /// Gives it to an axis.
    pub fn of(self, mut axis: AxisParameters) -> AxisParameters {
        axis.model = match self {
            Self::Gms => FrictionParameters::Gms,
            Self::SmoothedGms => FrictionParameters::Smoothed(SmoothedGmsParameters::default()),
            Self::Lugre => FrictionParameters::Lugre(LugreParameters {
                stiffness_v_per_mm: STIFFNESS_V_PER_MM,
                damping_v_s_per_mm: DAMPING_V_S_PER_MM,
            }),
            Self::Dahl => FrictionParameters::Dahl(DahlParameters {
                stiffness_v_per_mm: STIFFNESS_V_PER_MM,
                exponent: 1.0,
            }),
        };
        axis
    }
}
