//! The hysteresis that a model predicts: the library's own GMS model, moved along the measured position.

use quadrant::friction::gms::{Gms, GmsParameters, GmsState, MAX_ELEMENTS};
use quadrant::friction::stribeck::{SlidingTable, StaticFriction};
use quadrant::friction::{Direction, PerDirection};

use super::branches::Smooth;

/// Measured and predicted hysteresis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prediction {
    /// Position, mm.
    pub position_mm: Vec<f64>,
    /// Voltage measured, V.
    pub measured_v: Vec<f64>,
    /// Voltage predicted, V.
    pub predicted_v: Vec<f64>,
    /// RMS of the difference over the breakaway level, from the second reversal on.
    pub relative_error: f64,
}

/// The voltage that the model predicts along the smooth position.
pub(super) fn predict(
    smooth: &Smooth,
    sliding: &PerDirection<StaticFriction>,
    gms: &GmsParameters,
) -> Vec<f64> {
    let surface = SlidingTable::<f64>::build(
        &sliding.map(|model| model.curve),
        gms.attraction_v_s,
        smooth.sample_time_s,
    );
    let model = Gms::<f64, MAX_ELEMENTS>::build(&gms.elements);
    let mut state = GmsState::default();
    let mut last_mm = smooth.position_mm.first().copied().unwrap_or_default();
    smooth
        .position_mm
        .iter()
        .map(|&position_mm| {
            let displacement = position_mm - last_mm;
            last_mm = position_mm;
            let velocity = displacement / smooth.sample_time_s;
            let direction = if displacement < 0.0 {
                Direction::Negative
            } else {
                Direction::Positive
            };
            let force = model.step(
                &mut state,
                displacement,
                surface.at(velocity.abs(), direction),
            );
            force + sliding.of(direction).viscous_v_s_per_mm * velocity
        })
        .collect()
}
