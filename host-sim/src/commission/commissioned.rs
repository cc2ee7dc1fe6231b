//! Request and result of a commissioning.

use quadrant::settings::AxisSettings;

use super::verify::{SINE, SineResult};
use crate::design::{MarginError, Margins, Target};
use crate::experiment::sine_test::SineTest;
use crate::identify::frf::FrfMeasurement;
use crate::identify::motor_constant::MotorConstant;
use crate::identify::plant::PlantFit;
use crate::identify::static_friction::{FrictionFit, FrictionMap, StaticFrictionSettings};
use crate::identify::virgin_curve::GmsFit;
use crate::record::Recording;

/// Request for a commissioning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommissionSettings {
    /// Target of the PID, on the continuous loop.
    pub target: Target,
    /// Share of the Popov bound that the nonlinear gain may take, 0 to 1.
    pub sector_share: f64,
    /// The runs that the friction is taken from.
    pub friction: StaticFrictionSettings,
    /// The sine on which the result is judged.
    pub sine_test: SineTest,
}

impl Default for CommissionSettings {
    /// The thesis' margins, and three quarters of the Popov bound.
    fn default() -> Self {
        Self {
            target: Target::Margins {
                gain_margin_db: 9.9,
                phase_margin_deg: 54.2,
                crossover_hz: None,
            },
            sector_share: 0.75,
            friction: StaticFrictionSettings {
                velocities_mm_s: (0.1, 40.0),
                ..StaticFrictionSettings::default()
            },
            sine_test: SINE,
        }
    }
}

/// Everything a commissioning found, in the order in which it did.
#[derive(Clone, Debug)]
pub struct Commissioned {
    /// The motor constant, from the open-loop test.
    pub motor: MotorConstant,
    /// The response of the sliding axis.
    pub response: FrfMeasurement,
    /// Linear model, fitted to the response.
    pub plant: PlantFit,
    /// Margins of the PID with sampling at the control rate.
    pub margins: Result<Margins, MarginError>,
    /// The friction-velocity map, its model, and the recordings of the runs.
    pub friction: (FrictionMap, FrictionFit, Vec<Recording>),
    /// Pre-sliding friction, and its recording.
    pub presliding: (GmsFit, Recording),
    /// The Popov bound of the nonlinear gain.
    pub sector_bound: f64,
    /// Settings of the axis, finished.
    pub settings: AxisSettings,
    /// Results of the sine on the axis; none of a commissioning from saved recordings.
    pub results: Vec<SineResult>,
}
