//! `quadrant commission`, and what it shares with `quadrant connect commission`.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use quadrant::safety::AxisName;
use quadrant::settings::{AxisSettings, StageSettings};
use quadrant_sim::commission::{CommissionSettings, Commissioned, CrossCheck, commission};
use quadrant_sim::design::Target;
use quadrant_sim::machine::TestAxis;
use quadrant_sim::presentation::{
    commission_page, friction_table, gains_table, gms_table, motor_constant_table, plant_tables,
    provenance, revise_table, verdict_table,
};
use quadrant_sim::report::Table;
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
    #[command(flatten)]
    request: Request,
    #[command(flatten)]
    output: Output,
}

/// What is asked of a commissioning, wherever the axis is.
#[derive(Clone, Debug, Args)]
pub(super) struct Request {
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
}

/// What a commissioning found.
pub(super) struct Found {
    pub(super) found: Commissioned,
    checked: Option<CrossCheck>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        axis,
        request,
        output,
        ..
    } = arguments;
    let mut file = match &arguments.settings {
        Some(path) => SettingsFile::read(path)?,
        None => SettingsFile::new(StageSettings::default()),
    };
    let base = file.stage.axes[axis.index()].clone();
    let found = request.run(&mut axis.test_axis(output.seed), &base, output.seed)?;
    println!(
        "Simulated, not measured: {} axis, seed {}\n",
        axis.name(),
        output.seed
    );
    print!("{}", found.text());
    let who = format!("the {} axis of the simulated stage", axis.name());
    let axis = AxisName::ALL[axis.index()];
    for line in found.keep(output, &mut file, axis, &who)? {
        println!("{line}");
    }
    Ok(())
}

impl Request {
    /// Commissions the test_axis's axis, with a bar for whoever watches.
    pub(super) fn run(
        &self,
        test_axis: &mut dyn TestAxis,
        base: &AxisSettings,
        seed: u64,
    ) -> anyhow::Result<Found> {
        let request = CommissionSettings {
            target: Target::Margins {
                gain_margin_db: self.gain_margin_db,
                phase_margin_deg: self.phase_margin_deg,
                crossover_hz: None,
            },
            ..CommissionSettings::default()
        };
        let bar = share("commissioning");
        let mut report = |step, done: f64| {
            bar.set_message(step);
            bar.set_position((1000.0 * done) as u64);
        };
        let found = commission(test_axis, base, &request, &mut report)?;
        let checked = if self.quick {
            None
        } else {
            bar.enable_steady_tick(Duration::from_millis(200));
            let checked = CrossCheck::run(test_axis, &found.settings, seed, &mut report)?;
            Some(checked)
        };
        bar.finish_and_clear();
        Ok(Found { found, checked })
    }
}

impl Found {
    fn tables(&self) -> Vec<Table> {
        let found = &self.found;
        let [parameters, bands] = plant_tables(&found.plant);
        let (_, friction, _) = &found.friction;
        let mut tables = vec![
            motor_constant_table(&found.motor, None),
            parameters,
            bands,
            friction_table(friction),
            gms_table(&found.presliding.0),
            gains_table(found),
            verdict_table(&found.verdicts),
        ];
        if let Some(checked) = &self.checked {
            tables.push(revise_table(&found.plant.plant, &checked.revisions));
        }
        tables
    }

    /// The tables for a terminal.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for table in self.tables() {
            let _ = writeln!(text, "{}\n", table.to_text());
        }
        let agreement = self
            .checked
            .as_ref()
            .and_then(|checked| checked.inertia_agreement(&self.found.settings));
        if let Some(agreement) = agreement {
            let _ = writeln!(
                text,
                "An ordinary motion gives {agreement:.3} times the A of the frequency response.\n"
            );
        }
        text
    }

    /// Writes everything: recordings, tables, the page, and the settings, which become those of `file`. Says what is where.
    pub(super) fn keep(
        &self,
        output: &Output,
        file: &mut SettingsFile,
        axis: AxisName,
        who: &str,
    ) -> anyhow::Result<Vec<String>> {
        let (found, checked) = (&self.found, self.checked.as_ref());
        for table in self.tables() {
            output.keep_table(&table)?;
        }
        let command = command_line();
        let records = write_records(output, found, checked)?;
        file.stage.axes[axis as usize] = found.settings.clone();
        file.provenance.push(Provenance {
            command: command.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            axis: axis.as_str().to_owned(),
            records,
            sets: ["feedback", "friction", "feedforward", "plant"]
                .map(str::to_owned)
                .into(),
        });
        let settings = output.file("settings.toml")?;
        file.write(&settings)?;
        let page = commission_page(who, found, checked, provenance(&command, output.seed));
        let mut lines = vec![format!("{}: the settings of the stage", settings.display())];
        lines.extend(output.keep_page(&page, "commission.html")?);
        Ok(lines)
    }
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
