//! `quadrant commission`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use quadrant::settings::StageSettings;
use quadrant_sim::commission::{CommissionSettings, Commissioned, CrossCheck, commission};
use quadrant_sim::design::Target;
use quadrant_sim::presentation::{
    commission_page, friction_table, gains_table, gms_table, motor_constant_table, plant_tables,
    provenance, revise_table, verdict_table,
};
use quadrant_sim::settings_file::{Provenance, SettingsFile};

use super::identify::rig::Axis;
use super::output::{Output, command_line, share};

/// Options of `quadrant commission`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// The axis of the simulated stage.
    #[arg(long, value_enum)]
    axis: Axis,
    /// Settings to start from: encoder, amplifier and limits of this axis, and the other axes, which stay as they are.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Gain margin of the PID, dB.
    #[arg(long, default_value_t = 9.9, value_name = "DB")]
    gain_margin_db: f64,
    /// Phase margin of the PID, deg.
    #[arg(long, default_value_t = 54.2, value_name = "DEG")]
    phase_margin_deg: f64,
    /// Leave out the cross-checks: the response at rest, with the linear model revised for explicit friction, and an ordinary
    /// motion.
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    output: Output,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { axis, output, .. } = arguments;
    let mut file = match &arguments.settings {
        Some(path) => SettingsFile::read(path)?,
        None => SettingsFile::new(StageSettings::default()),
    };
    let request = CommissionSettings {
        target: Target::Margins {
            gain_margin_db: arguments.gain_margin_db,
            phase_margin_deg: arguments.phase_margin_deg,
            crossover_hz: None,
        },
        ..CommissionSettings::default()
    };
    let bar = share("commissioning");
    let mut rig = axis.rig(output.seed);
    let found = commission(
        &mut rig,
        &file.stage.axes[axis.index()],
        &request,
        &mut |step, done| {
            bar.set_message(step);
            bar.set_position((1000.0 * done) as u64);
        },
    )?;
    let checked = if arguments.quick {
        None
    } else {
        bar.enable_steady_tick(Duration::from_millis(200));
        let report = &mut |step, done: f64| {
            bar.set_message(step);
            bar.set_position((1000.0 * done) as u64);
        };
        Some(CrossCheck::run(
            &mut rig,
            &found.settings,
            output.seed,
            report,
        )?)
    };
    bar.finish_and_clear();
    println!(
        "Simulated, not measured: {} axis, seed {}\n",
        axis.name(),
        output.seed
    );
    let [parameters, bands] = plant_tables(&found.plant);
    let (_, friction, _) = &found.friction;
    for table in [
        motor_constant_table(&found.motor, None),
        parameters,
        bands,
        friction_table(friction),
        gms_table(&found.presliding.0),
        gains_table(&found),
        verdict_table(&found.verdicts),
    ] {
        output.table(&table)?;
    }
    if let Some(checked) = &checked {
        output.table(&revise_table(&found.plant.plant, &checked.revisions))?;
        if let Some(agreement) = checked.inertia_agreement(&found.settings) {
            println!(
                "An ordinary motion gives {agreement:.3} times the A of the frequency response.\n"
            );
        }
    }
    let command = command_line();
    let records = write_records(output, &found, checked.as_ref())?;
    file.stage.axes[axis.index()] = found.settings.clone();
    file.provenance.push(Provenance {
        command: command.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        axis: axis.name().to_owned(),
        records,
        sets: ["feedback", "friction", "feedforward", "plant"]
            .map(str::to_owned)
            .into(),
    });
    let settings = output.file("settings.toml")?;
    file.write(&settings)?;
    println!("{}: the settings of the stage", settings.display());
    let page = commission_page(
        &format!("the {} axis of the simulated stage", axis.name()),
        &found,
        checked.as_ref(),
        provenance(&command, output.seed),
    );
    output.page(&page, "commission.html")
}

/// Saves every recording that the settings rest on; their names.
fn write_records(
    output: &Output,
    found: &Commissioned,
    checked: Option<&CrossCheck>,
) -> anyhow::Result<Vec<String>> {
    let mut records = vec![(
        "motor-constant-recording.csv".to_owned(),
        &found.motor.recording,
    )];
    let responses = found.response.recordings.iter().enumerate();
    records.extend(
        responses.map(|(index, record)| (format!("frf-recording-{}.csv", index + 1), record)),
    );
    records.push(("virgin-curve-recording.csv".to_owned(), &found.presliding.1));
    if let Some(CrossCheck { recordings, .. }) = checked {
        let named = ["at-rest-recording.csv", "motion-recording.csv"].map(str::to_owned);
        records.extend(named.into_iter().zip(recordings));
    }
    let mut names = Vec::new();
    for (name, recording) in records {
        recording.write_csv(output.file(&name)?)?;
        names.push(name);
    }
    found
        .response
        .estimate
        .response
        .write_csv(output.file("frf.csv")?)?;
    found
        .friction
        .0
        .write_csv(output.file("friction-map.csv")?)?;
    names.extend(["frf.csv", "friction-map.csv"].map(str::to_owned));
    Ok(names)
}
