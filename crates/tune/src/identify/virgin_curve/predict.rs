//! The hysteresis that a model predicts: the library's own GMS model, moved along the measured position.

use std::sync::Arc;

use quadrant_law::friction::gms::{Gms, GmsParameters, GmsState, MAX_ELEMENTS};
use quadrant_law::friction::stribeck::{Sliding, SlidingTable, StaticFriction, StribeckCurve};
use quadrant_law::friction::{Direction, PerDirection};

use super::branches::Smooth;
use crate::identify::latest::Latest;

/// Measured and predicted hysteresis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prediction {
    pub position_mm: Vec<f64>,
    /// Voltage measured, V.
    pub measured_v: Vec<f64>,
    /// Voltage predicted, V.
    pub predicted_v: Vec<f64>,
    /// RMS of the difference over the breakaway level, from the second reversal on.
    pub relative_error: f64,
}

/// The smooth position as steps that a model takes, on a static friction.
pub(super) struct Trajectory {
    steps: Vec<Step>,
    curves: PerDirection<StribeckCurve>,
    sample_time_s: f64,
    /// The surfaces of the attraction rates asked for last: most models of a search have the same, and other elements.
    latest: Latest<(f64, Surfaces)>,
}

/// The surface at each step of a trajectory.
type Surfaces = Arc<[Sliding<f64>]>;

/// A step of the position.
struct Step {
    displacement_mm: f64,
    speed_mm_s: f64,
    direction: Direction,
    viscous_v: f64,
}

/// Attraction rates whose surfaces are kept: that of a difference quotient's middle, and those of its ends.
const KEPT_SURFACES: usize = 3;

impl Trajectory {
    pub(super) fn new(smooth: &Smooth, sliding: &PerDirection<StaticFriction>) -> Self {
        let mut last_mm = smooth.position_mm.first().copied().unwrap_or_default();
        let step = |&position_mm: &f64| {
            let displacement_mm = position_mm - last_mm;
            last_mm = position_mm;
            let velocity = displacement_mm / smooth.sample_time_s;
            let direction = Direction::of(displacement_mm);
            Step {
                displacement_mm,
                speed_mm_s: velocity.abs(),
                direction,
                viscous_v: sliding.of(direction).viscous_v_s_per_mm * velocity,
            }
        };
        Self {
            steps: smooth.position_mm.iter().map(step).collect(),
            curves: sliding.map(|model| model.curve),
            sample_time_s: smooth.sample_time_s,
            latest: Latest::new(KEPT_SURFACES),
        }
    }

    /// The surface at each step.
    fn surfaces(&self, attraction_v_s: f64) -> Surfaces {
        let same = |(rate, _): &(f64, _)| *rate == attraction_v_s;
        if let Some((_, found)) = self.latest.find(same) {
            return found;
        }
        let table = SlidingTable::build(&self.curves, attraction_v_s, self.sample_time_s);
        let steps = self.steps.iter();
        let made: Surfaces = steps
            .map(|step| table.at(step.speed_mm_s, step.direction))
            .collect();
        self.latest.keep((attraction_v_s, made.clone()));
        made
    }

    /// The voltage that the model predicts at the first `count` positions.
    pub(super) fn predict(&self, gms: &GmsParameters, count: usize) -> Vec<f64> {
        let surfaces = self.surfaces(gms.attraction_v_s);
        let model = Gms::<f64, MAX_ELEMENTS>::build(&gms.elements);
        let mut state = GmsState::default();
        self.steps
            .iter()
            .zip(&*surfaces)
            .take(count)
            .map(|(step, surface)| {
                model.step(&mut state, step.displacement_mm, *surface) + step.viscous_v
            })
            .collect()
    }
}
