//! `identify`: measurements on the connected machine, and what they say.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, Subcommand};
use quadrant::safety::AxisName;
use quadrant::settings::AxisSettings;
use quadrant_sim::commission::bootstrap::{
    low_bandwidth_settings, measuring_settings, zero_gain_settings,
};
use quadrant_sim::console::Client;
use quadrant_sim::console::rig::ConnectedAxis;
use quadrant_sim::identify::frf::{self, FrfSettings};
use quadrant_sim::identify::motion::{MotionFitSettings, fit_motion, recommended, shuttle};
use quadrant_sim::identify::motor_constant::{self, MotorConstantSettings};
use quadrant_sim::identify::plant::{PlantFitSettings, Stiffness, fit_plant};
use quadrant_sim::identify::static_friction::{self, Exponent, StaticFrictionSettings, fit_map};
use quadrant_sim::identify::virgin_curve::{self, Knots, VirginCurveSettings};
use quadrant_sim::machine::TestAxis;
use quadrant_sim::presentation::{friction_table, gms_table, motion_table, plant_tables};
use quadrant_sim::report::Table;
use serde_json::json;

use super::command::axis_parser;
use super::commission::{travel, travel_mm};
use super::drive::Answer;
use crate::cli::output::share;

/// The measurements.
#[derive(Clone, Debug, Subcommand)]
pub(super) enum Command {
    /// Move the axis to and fro by up to 60 mm, and find inertia and friction in that motion.
    Motion(Options),
    /// Move the axis at 16 velocities from 0.1 to 40 mm/s, both ways, and fit the static model; within +-100 mm.
    StaticFriction(Options),
    /// Move the axis in a slow sine of micrometres under a quiet controller, and identify the GMS model; needs a plant in the
    /// settings.
    VirginCurve(Options),
    /// Measure the acceleration per volt in open loop, within some millimetres; needs nothing that works but encoder and
    /// amplifier.
    MotorConstant(Options),
    /// Excite the axis while it moves at 37 mm/s, measure its frequency response, position over voltage, and fit the linear
    /// model; the file holds the response.
    Plant(Options),
}

/// Options of a measurement.
#[derive(Clone, Debug, Args)]
pub(super) struct Options {
    /// The axis: x, y or z.
    #[arg(value_parser = axis_parser())]
    axis: AxisName,
    /// How far the axis may go from where it stands, either way, mm; without it, as far as its soft limits, once it is homed.
    #[arg(long, value_name = "MM", value_parser = travel)]
    travel: Option<f64>,
    /// File for the recording, CSV, which `quadrant identify ... --record` reads; of a response, which `--frf` does.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Travel of an axis that is not homed and has none stated, mm: of voltage steps, and of motions.
const STEPS_TRAVEL_MM: f64 = 20.0;
const MOTION_TRAVEL_MM: f64 = 200.0;
/// Moves to and fro.
const ROUNDS: usize = 1;
/// Slip-blocks.
const BLOCKS: usize = 4;

pub(super) fn run(client: &mut Client, command: &Command) -> anyhow::Result<Answer> {
    let (Command::Motion(options)
    | Command::StaticFriction(options)
    | Command::VirginCurve(options)
    | Command::MotorConstant(options)
    | Command::Plant(options)) = command;
    let travel_mm = match (travel_mm(client, options.axis, options.travel), command) {
        (Ok(travel_mm), _) => travel_mm,
        (Err(error), Command::Plant(_)) => return Err(error),
        (Err(_), Command::MotorConstant(_)) => STEPS_TRAVEL_MM,
        (Err(_), _) => MOTION_TRAVEL_MM,
    };
    let mut test_axis = ConnectedAxis::new(client, options.axis, travel_mm)?;
    let before = test_axis.settings().clone();
    let outcome = measure(&mut test_axis, command, options, &before);
    // Whatever came of it, the machine keeps the settings that it had.
    test_axis.apply(&before)?;
    let table = outcome?;
    let text = format!(
        "{}\n{}: the recording",
        table.to_text(),
        options.out.display()
    );
    Ok(Answer::new(
        text,
        json!({ "file": options.out, "table": table.to_csv()? }),
    ))
}

fn measure(
    test_axis: &mut ConnectedAxis<'_>,
    command: &Command,
    options: &Options,
    before: &AxisSettings,
) -> anyhow::Result<Table> {
    let bar = share("measuring");
    let mut progress = |done: f64| bar.set_position((1000.0 * done) as u64);
    match command {
        Command::Motion(_) => {
            let recording = shuttle(test_axis, ROUNDS, &mut progress)?;
            recording.write_csv(&options.out)?;
            let settings = MotionFitSettings::default();
            let candidates = fit_motion(&recording, &settings, &|_| {})?;
            let chosen =
                recommended(&candidates).context("no model of the motion is one of friction")?;
            Ok(motion_table(&chosen.model, None))
        }
        Command::StaticFriction(_) => {
            test_axis.apply(&measuring_settings(before))?;
            let settings = StaticFrictionSettings::default();
            let (map, _) = static_friction::measure(test_axis, &settings, &mut progress)?;
            map.write_csv(&options.out)?;
            Ok(friction_table(&fit_map(&map, Exponent::Free)?))
        }
        Command::VirginCurve(_) => {
            let plant = before.plant.context(
                "the settings hold no linear model to make a quiet controller for; load commissioned settings first",
            )?;
            let quiet = low_bandwidth_settings(before, &plant, test_axis.info().rate_hz);
            test_axis.apply(&quiet)?;
            let sine = VirginCurveSettings::outrunning(
                quiet.feedback.pid.kp_v_per_mm,
                before.friction.sliding.positive.curve.breakaway_v,
            );
            let recording = virgin_curve::measure(test_axis, &sine, &mut progress)?;
            recording.write_csv(&options.out)?;
            let known = Some(&before.friction.sliding);
            let found = virgin_curve::identify(&recording, known, &Knots::Automatic(BLOCKS))?;
            Ok(gms_table(&found))
        }
        Command::Plant(_) => {
            test_axis.apply(&measuring_settings(before))?;
            let found = frf::measure(test_axis, &FrfSettings::default(), &mut progress)?;
            let response = &found.estimate.response;
            response.write_csv(&options.out)?;
            let [parameters, _] = plant_tables(&fit_plant(response, &plant_fit())?);
            Ok(parameters)
        }
        Command::MotorConstant(_) => {
            test_axis.apply(&zero_gain_settings(before))?;
            let found = motor_constant::measure(
                test_axis,
                &MotorConstantSettings::default(),
                &mut progress,
            )?;
            found.recording.write_csv(&options.out)?;
            Ok(quadrant_sim::presentation::motor_constant_table(
                &found, None,
            ))
        }
    }
}

/// A model without a spring: what an axis on its guides is.
fn plant_fit() -> PlantFitSettings {
    PlantFitSettings {
        stiffness: Stiffness::Zero,
        ..PlantFitSettings::default()
    }
}
