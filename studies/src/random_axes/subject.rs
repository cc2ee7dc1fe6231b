//! An axis that is commissioned and judged.

use quadrant_sim::plant::AxisParameters;
use quadrant_tune::test_axis::Travel;

/// An axis that is commissioned and judged.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Decides the noise.
    pub seed: u64,
    pub parameters: AxisParameters,
    /// Travel from where it stands.
    pub travel: Travel,
    /// Frequency of the resonance, Hz, if there is one.
    pub resonance_hz: Option<f64>,
    /// Relative change of friction when the axis is warm, and the time in which it warms, s.
    pub warming: (f64, f64),
    /// The axis, for a person.
    pub description: String,
}

impl Subject {
    /// The parameters after the axis was used for a time, s; nothing of one that does not warm.
    pub(super) fn warmed(&self, used_s: f64) -> Option<AxisParameters> {
        let (change, warms_s) = self.warming;
        let factor = 1.0 + change * (1.0 - (-used_s / warms_s).exp());
        (change != 0.0).then(|| self.parameters.clone().with_friction(factor))
    }
}
