//! The simulated XYZ stage: what is on the other side of the converters and the encoders.
//!
//! The truth is in `f64` and sub-stepped. Its friction is one of the library's own models: the GMS, unless asked otherwise,
//! with more elements and other parameters than the control law has.

mod axis;
pub mod cutting;
mod delay;
mod drive;
mod friction;
pub mod load;
mod marks;
mod parameters;
mod stage;
mod transmission;
mod variation;
mod velocity_drive;

pub use axis::{SUBSTEPS, SimulatedAxis};
pub use drive::{Backlash, Cogging, Drive, EncoderSide};
pub use friction::Presliding;
pub use marks::{MarkParameters, Marks};
pub use parameters::{
    AxisParameters, DRIVE_MM_S_PER_V, FrictionParameters, Imperfections, PLANT_ELEMENTS,
    StageParameters, virgin_curve_elements,
};
pub use stage::SimulatedStage;
pub use transmission::{Body, Forcing};
pub use variation::NEWTONS_PER_VOLT;
pub use velocity_drive::VelocityDrive;
