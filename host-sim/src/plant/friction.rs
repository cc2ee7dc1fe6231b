//! The simulated axes' pre-sliding friction: any of the library's models, in `f64`.

use quadrant_law::friction::Direction;
use quadrant_law::friction::bristle::Bristle;
use quadrant_law::friction::dahl::Dahl;
use quadrant_law::friction::gms::{Gms, GmsState};
use quadrant_law::friction::lugre::Lugre;
use quadrant_law::friction::smoothed_gms::SmoothedGms;
use quadrant_law::friction::stribeck::SlidingTable;

use super::{AxisParameters, FrictionParameters, PLANT_ELEMENTS};

/// Pre-sliding friction of an axis: its model, and the model's state.
#[derive(Clone, Debug)]
pub struct Presliding(Model);

#[allow(
    clippy::large_enum_variant,
    reason = "tables of like size, one an axis, used in every substep"
)]
#[derive(Clone, Debug)]
enum Model {
    Gms(
        Gms<f64, PLANT_ELEMENTS>,
        SlidingTable<f64>,
        GmsState<f64, PLANT_ELEMENTS>,
    ),
    Smoothed(
        SmoothedGms<f64, PLANT_ELEMENTS>,
        SlidingTable<f64>,
        GmsState<f64, PLANT_ELEMENTS>,
    ),
    Lugre(Lugre<f64>, Bristle<f64>),
    Dahl(Dahl<f64>, Bristle<f64>),
}

impl Presliding {
    /// The axis' model at rest, springs slack; `step_s` is the time between evaluations.
    pub fn new(truth: &AxisParameters, step_s: f64) -> Self {
        let curves = truth.friction.map(|model| model.curve);
        let surface = || SlidingTable::build(&curves, truth.gms.attraction_v_s, step_s);
        Self(match &truth.model {
            FrictionParameters::Gms => Model::Gms(
                Gms::build(&truth.gms.elements),
                surface(),
                GmsState::default(),
            ),
            FrictionParameters::Smoothed(parameters) => {
                let breakaway_v = 0.5 * (curves.positive.breakaway_v + curves.negative.breakaway_v);
                let model = SmoothedGms::build(&truth.gms.elements, parameters, breakaway_v);
                Model::Smoothed(model, surface(), GmsState::default())
            }
            FrictionParameters::Lugre(parameters) => Model::Lugre(
                Lugre::build(parameters, &curves, step_s),
                Bristle::default(),
            ),
            FrictionParameters::Dahl(parameters) => Model::Dahl(
                Dahl::build(parameters, curves.map(|curve| curve.coulomb_v)),
                Bristle::default(),
            ),
        })
    }

    /// Gives the axis' model other parameters; its memory stays where the model is of the same kind.
    pub fn change(&mut self, truth: &AxisParameters, step_s: f64) {
        let Self(mut model) = Self::new(truth, step_s);
        match (&mut model, &self.0) {
            (Model::Gms(.., state), Model::Gms(.., kept))
            | (Model::Smoothed(.., state), Model::Smoothed(.., kept)) => state.clone_from(kept),
            (Model::Lugre(_, bristle), Model::Lugre(_, kept))
            | (Model::Dahl(_, bristle), Model::Dahl(_, kept)) => bristle.clone_from(kept),
            _ => {}
        }
        self.0 = model;
    }

    /// The friction in V without its viscous part, after a displacement (mm) that ended at a speed (mm/s) and took
    /// `step_s`.
    #[inline(always)]
    pub fn step(&mut self, displacement: f64, speed: f64, step_s: f64) -> f64 {
        let direction = Direction::of(displacement);
        match &mut self.0 {
            Model::Gms(model, surface, state) => {
                model.step(state, displacement, surface.at(speed, direction))
            }
            Model::Smoothed(model, surface, state) => {
                model.step(state, displacement, surface.at(speed, direction))
            }
            // At the mean speed of the step: the bristles must bend by what the mass moves.
            Model::Lugre(model, bristle) => {
                model.step(bristle, displacement, displacement.abs() / step_s)
            }
            Model::Dahl(model, bristle) => model.step(bristle, displacement),
        }
    }
}
