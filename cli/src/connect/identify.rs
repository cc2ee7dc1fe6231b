//! `identify`: measurements on the connected machine, by the code of `quadrant identify`.

use quadrant_cli::terminal;
use quadrant_host::client::Client;
use quadrant_law::axes::AxisName;
use quadrant_pages::identify::friction::{friction_table, gms_table};
use quadrant_pages::identify::linear::{motor_constant_table, plant_tables};
use quadrant_pages::identify::motion::motion_table;
use quadrant_report::Table;
use quadrant_settings::AxisSettings;
use quadrant_tune::identify::frf::FrfSettings;
use quadrant_tune::identify::motion::MotionFitSettings;
use quadrant_tune::identify::motor_constant::MotorConstantSettings;
use quadrant_tune::identify::plant::{PlantFitSettings, Stiffness, fit_plant};
use quadrant_tune::identify::static_friction::{Exponent, StaticFrictionSettings, fit_map};
use quadrant_tune::identify::virgin_curve::{self, Knots};
use quadrant_tune::test_axis::TestAxis;
use serde_json::json;

use super::answer::Answer;
use super::command::{IdentifyCommand, IdentifyOptions};
use crate::identify::{frf, friction, motion, motor_constant, virgin_curve as sine};
use crate::subject::{on_axis, travel_mm};

/// Times that the axis moves to and fro.
const ROUNDS: usize = 1;
/// Slip-blocks of the GMS model.
const BLOCKS: usize = 4;

pub(super) fn run(client: &mut Client, command: &IdentifyCommand) -> anyhow::Result<Answer> {
    let (options, fallback_mm) = match command {
        IdentifyCommand::Motion(options) => (options, Some(motion::TRAVEL_MM)),
        IdentifyCommand::StaticFriction(options) => (options, Some(friction::TRAVEL_MM)),
        IdentifyCommand::VirginCurve(options) => (options, Some(sine::TRAVEL_MM)),
        IdentifyCommand::MotorConstant(options) => (options, Some(motor_constant::TRAVEL_MM)),
        IdentifyCommand::Plant(options) => (options, None),
    };
    let axis = AxisName::from(options.axis);
    let travel_mm = travel_mm(client, axis, options.travel, fallback_mm)?;
    let Found { table, lines } = on_axis(client, axis, travel_mm, None, |test_axis, base| {
        measure(test_axis, base, command, options)
    })?;
    let mut text = table.to_text(terminal::output_width());
    for line in &lines {
        text += &format!("\n{line}");
    }
    text += &format!("\n{}: the recording", options.out.display());
    Ok(Answer::new(
        text,
        json!({ "file": options.out, "table": table.to_csv()?, "lines": lines }),
    ))
}

/// Result of a measurement.
struct Found {
    table: Table,
    /// Lines beneath the table: the plant, what the model explains.
    lines: Vec<String>,
}

impl From<Table> for Found {
    fn from(table: Table) -> Self {
        Self {
            table,
            lines: Vec::new(),
        }
    }
}

fn measure(
    test_axis: &mut dyn TestAxis,
    base: &AxisSettings,
    command: &IdentifyCommand,
    options: &IdentifyOptions,
) -> anyhow::Result<Found> {
    match command {
        IdentifyCommand::Motion(_) => {
            let recording = motion::move_to_and_fro(test_axis, ROUNDS)?;
            recording.write_csv(&options.out)?;
            let fit = motion::fit(&recording, &MotionFitSettings::default(), None, None)?;
            let model = fit.model();
            motion::ensure_fits(model.relative_error)?;
            let explained = motion::judge(model, model.relative_error);
            Ok(Found {
                table: motion_table(model, None),
                lines: [Some(motion::plant_line(model)), explained]
                    .into_iter()
                    .flatten()
                    .collect(),
            })
        }
        IdentifyCommand::StaticFriction(_) => {
            let settings = StaticFrictionSettings::default().fitted_to(&test_axis.info());
            let (map, _) = friction::run_at_velocities(test_axis, base, &settings)?;
            map.write_csv(&options.out)?;
            Ok(friction_table(&fit_map(&map, Exponent::Free, None)?).into())
        }
        IdentifyCommand::VirginCurve(_) => {
            let (recording, _) = sine::Sine::default().measure(test_axis, base)?;
            recording.write_csv(&options.out)?;
            let known = Some(&base.friction.sliding);
            let found = virgin_curve::identify(&recording, known, &Knots::Automatic(BLOCKS))?;
            Ok(gms_table(&found).into())
        }
        IdentifyCommand::Plant(_) => {
            let found = frf::excite(test_axis, base, &FrfSettings::default())?;
            let response = &found.estimate.response;
            response.write_csv(&options.out)?;
            let [parameters, _] = plant_tables(&fit_plant(response, &plant_fit())?);
            Ok(parameters.into())
        }
        IdentifyCommand::MotorConstant(_) => {
            let settings = MotorConstantSettings::default();
            let found = motor_constant::step_voltage(test_axis, base, &settings)?;
            found.recording.write_csv(&options.out)?;
            Ok(motor_constant_table(&found, None).into())
        }
    }
}

/// A model without a spring: that of an axis on its guides.
fn plant_fit() -> PlantFitSettings {
    PlantFitSettings {
        stiffness: Stiffness::Zero,
        ..PlantFitSettings::default()
    }
}
