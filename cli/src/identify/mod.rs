//! The command `quadrant identify`.

pub(super) mod frf;
pub(super) mod friction;
pub(super) mod motion;
pub(super) mod motor_constant;
mod nctf;
mod plant;
mod recorded;
mod revise;
pub(super) mod virgin_curve;

use clap::Subcommand;

/// The steps from measurements to parameters.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Measure the axis' frequency response, position over voltage (thesis, Figs 3.5, 3.6).
    Frf(frf::Arguments),
    /// Fit the linear model A exp(-s Td) / (s² + B s + C) to a response (thesis, Table 3.1).
    Plant(plant::Arguments),
    /// Find inertia and friction in an ordinary motion record, without any special excitation.
    Motion(motion::Arguments),
    /// Measure the acceleration per volt in open loop (thesis, Fig 3.7).
    MotorConstant(motor_constant::Arguments),
    /// Measure the trajectory that NCTF control follows: how the axis comes to rest by itself.
    Nctf(nctf::Arguments),
    /// Revise the linear model for explicit friction, excited as the axis was (thesis, Table 3.4, Figs 3.16-3.21).
    Revise(revise::Arguments),
    /// Measure friction at constant velocity, both ways, and fit the static model (thesis, Table 3.2).
    StaticFriction(friction::Arguments),
    /// Measure the hysteresis of a slow sine and identify the GMS model (thesis, Table 3.3).
    VirginCurve(virgin_curve::Arguments),
}

pub(super) fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Frf(arguments) => frf::run(arguments),
        Command::Plant(arguments) => plant::run(arguments),
        Command::Motion(arguments) => motion::run(arguments),
        Command::MotorConstant(arguments) => motor_constant::run(arguments),
        Command::Nctf(arguments) => nctf::run(arguments),
        Command::Revise(arguments) => revise::run(arguments),
        Command::StaticFriction(arguments) => friction::run(arguments),
        Command::VirginCurve(arguments) => virgin_curve::run(arguments),
    }
}
