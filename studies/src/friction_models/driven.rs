//! A friction model that is moved.

use quadrant_law::friction::Direction;
use quadrant_law::friction::stribeck::SlidingTable;
use quadrant_sim::plant::{AxisParameters, Presliding};

use crate::friction_models::Parameters;

/// A curve: displacement in mm or velocity in mm/s, and the force in V.
pub type Curve = (Vec<f64>, Vec<f64>);

/// A model, where it stands and how it is moved.
pub(super) struct Driven {
    model: Moved,
    step_s: f64,
    position_mm: f64,
}

#[allow(
    clippy::large_enum_variant,
    reason = "a table in both, and a handful of them"
)]
enum Moved {
    /// The level in the sense of the last motion.
    Static(SlidingTable<f64>),
    Presliding(Presliding),
}

impl Driven {
    /// A model at rest, springs slack; without a truth, the static model.
    pub(super) fn new(
        parameters: &Parameters,
        truth: Option<&AxisParameters>,
        step_s: f64,
    ) -> Self {
        let friction = &parameters.friction;
        let model = match truth {
            Some(truth) => Moved::Presliding(Presliding::new(truth, step_s)),
            None => Moved::Static(SlidingTable::build(
                &friction.sliding.map(|model| model.curve),
                friction.gms.attraction_v_s,
                step_s,
            )),
        };
        Self {
            model,
            step_s,
            position_mm: 0.0,
        }
    }

    /// The friction in V after a displacement in mm, not zero, at constant velocity.
    pub(super) fn step(&mut self, displacement_mm: f64) -> f64 {
        self.position_mm += displacement_mm;
        let speed = displacement_mm.abs() / self.step_s;
        match &mut self.model {
            Moved::Static(surface) if displacement_mm < 0.0 => {
                -surface.at(speed, Direction::Negative).level
            }
            Moved::Static(surface) => surface.at(speed, Direction::Positive).level,
            Moved::Presliding(model) => model.step(displacement_mm, speed, self.step_s),
        }
    }

    /// Moves by a distance in steps of `step_mm`: positions and forces.
    pub(super) fn travel(&mut self, distance_mm: f64, step_mm: f64) -> Curve {
        let steps = (distance_mm.abs() / step_mm).round() as usize;
        (0..steps)
            .map(|_| {
                let force = self.step(step_mm.copysign(distance_mm));
                (self.position_mm, force)
            })
            .unzip()
    }
}
