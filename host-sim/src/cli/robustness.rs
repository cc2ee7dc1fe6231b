//! `quadrant robustness`.

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Args;
use quadrant::settings::StageSettings;
use quadrant_sim::experiment::compensator::identified;
use quadrant_sim::experiment::robustness::compliance::{
    Compliance, FREQUENCIES_HZ, frictionless, linear_compliance, pid_alone, simulated_compliance,
};
use quadrant_sim::experiment::robustness::drives::{commission_drives, drive_cases};
use quadrant_sim::experiment::robustness::{
    RobustnessRequest, run_robustness, scenarios, usual_competitors,
};
use quadrant_sim::plant::StageTruth;
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::presentation::{
    RobustnessReport, provenance, robustness_full_table, robustness_sections, robustness_tables,
};
use quadrant_sim::record::{ForceRecord, write_trace};
use quadrant_sim::report::Page;
use quadrant_sim::settings_file::SettingsFile;

use super::identify::rig::Axis;
use super::output::{Output, command_line, progress};

/// Options of `quadrant robustness`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// The axis of the simulated stage.
    #[arg(long, value_enum, default_value = "x")]
    axis: Axis,
    /// Settings of the control law, as `quadrant commission` leaves them; without it, those that commissioning the
    /// simulated stage gave.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Runs of each scenario and law, with a seed each, 1 to 100.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    /// Backlash of the rack, um, 0 to 1000.
    #[arg(long, default_value_t = 20.0, value_name = "UM")]
    backlash_um: f64,
    /// Recorded force on the table, CSV: t_s, even, and force_x_n, force_y_n or force_z_n, in N; repeated as long as it
    /// takes.
    #[arg(long, value_name = "FILE")]
    force: Option<PathBuf>,
    /// Run only scenarios whose name contains this, and those that changes are counted from; no compliance.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    #[command(flatten)]
    output: Output,
}

/// Sampling of the cutting force that is written, s, and its samples: ten turns of the spindle.
const FORCE_PERIOD_S: f64 = 2e-4;
const FORCE_SAMPLES: usize = 1000;

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { axis, output, .. } = arguments;
    if !(0.0..=1000.0).contains(&arguments.backlash_um) {
        bail!(
            "--backlash-um is {}, and may be 0 to 1000 um: a gap is not negative, and a larger one is a broken drive",
            arguments.backlash_um
        );
    }
    let stage = match &arguments.settings {
        Some(path) => SettingsFile::read(path)?.stage,
        None => identified()?.stage,
    };
    let mut request = RobustnessRequest {
        competitors: usual_competitors(&stage),
        axis: axis.index(),
        scenarios: scenarios(axis.index(), recorded_force(arguments)?),
        seed: output.seed,
        seeds: arguments.seeds,
    };
    let wanted = |name: &str| {
        let only = arguments.only.as_deref();
        only.is_none_or(|text| name.contains(text))
    };
    let mut cases = drive_cases(axis.index(), 1e-3 * arguments.backlash_um);
    cases.retain(|case| wanted(&case.name));
    let bar = progress(cases.len() as u64, "commissioning on other drives");
    let (drives, refused) = commission_drives(axis.index(), cases, output.seed, &bar);
    bar.finish_and_clear();
    let references = ["nominal", "hold", "slow feed"];
    request
        .scenarios
        .retain(|scenario| wanted(&scenario.name) || references.contains(&scenario.name.as_str()));
    request.scenarios.extend(drives);
    if !request
        .scenarios
        .iter()
        .any(|scenario| wanted(&scenario.name))
        && refused.is_empty()
    {
        bail!(
            "--only is {:?}, and no scenario's name contains that; without it the first table lists them all",
            arguments.only.as_deref().unwrap_or_default()
        );
    }
    let bar = progress(request.runs(), "running the scenarios");
    let outcomes = run_robustness(&request, &bar)?;
    bar.finish_and_clear();
    let compliances = match &arguments.only {
        None => compliances(&stage, &request)?,
        Some(_) => Vec::new(),
    };
    let report = RobustnessReport {
        scenarios: request.scenarios,
        outcomes,
        refused,
        compliances,
    };
    println!(
        "Simulated, not measured: {} axis; runs of each: {}, seeds from {} on\n",
        axis.name(),
        arguments.seeds,
        output.seed
    );
    for table in robustness_tables(&report) {
        output.table(&table)?;
    }
    let all = robustness_full_table(&report);
    all.write_csv(output.file(&format!("{}.csv", all.id))?)?;
    write_cutting_force(output)?;
    let page = Page {
        title: "Robustness on the simulated stage".to_owned(),
        subtitle: "PID and N-PID, with and without friction compensation, on an axis that is no longer what it was; simulated, \
                   not measured"
            .to_owned(),
        provenance: provenance(&command_line(), output.seed),
        sections: robustness_sections(&report),
    };
    output.page(&page, "robustness.html")
}

/// The force of the file along the axis.
fn recorded_force(
    arguments: &Arguments,
) -> anyhow::Result<Option<quadrant_sim::plant::load::Force>> {
    let Some(path) = &arguments.force else {
        return Ok(None);
    };
    let axis = arguments.axis;
    let force = ForceRecord::read_csv(path)?.axes[axis.index()].take();
    let force = force.with_context(|| {
        format!(
            "{}: there is no column force_{}_n for the {} axis; add it, or choose another --axis",
            path.display(),
            axis.name(),
            axis.name()
        )
    })?;
    Ok(Some(force))
}

/// The linear model's compliance, the frictionless axis', and that of each law on the axis as it is.
fn compliances(
    stage: &StageSettings,
    request: &RobustnessRequest,
) -> anyhow::Result<Vec<Compliance>> {
    let truth = StageTruth::real().axes[request.axis].clone();
    let first = |stage: &StageSettings| {
        let mut stage = stage.clone();
        stage.axes[0] = stage.axes[request.axis].clone();
        stage
    };
    let alone = first(&pid_alone(stage));
    let own = &alone.axes[0];
    let plant = own.plant.context(
        "the settings hold no linear model of the axis: commission it, or give other --settings",
    )?;
    let linear = FREQUENCIES_HZ
        .map(|hz| Some(linear_compliance(&plant, own, stage.rate_hz, hz).norm()))
        .to_vec();
    let mut all = vec![
        Compliance {
            name: "PID, linear model".to_owned(),
            mm_per_v: linear,
        },
        simulated_compliance(
            "PID, no friction",
            &alone,
            &frictionless(&truth),
            request.seed,
        )?,
    ];
    // At rest the feedforward is silent: laws that differ in nothing else are one.
    let mut seen: Vec<StageSettings> = Vec::new();
    for (name, settings) in &request.competitors {
        let mut silent = first(settings);
        silent.axes[0].feedforward = own.feedforward;
        if !seen.contains(&silent) {
            all.push(simulated_compliance(name, &silent, &truth, request.seed)?);
            seen.push(silent);
        }
    }
    Ok(all)
}

/// Writes the force that the cutting scenarios are made with: synthetic, and a template of a recorded one.
fn write_cutting_force(output: &Output) -> anyhow::Result<()> {
    let cut = Milling::slot();
    let time: Vec<f64> = (0..FORCE_SAMPLES)
        .map(|k| k as f64 * FORCE_PERIOD_S)
        .collect();
    let force = |component| -> Vec<f64> {
        time.iter()
            .map(|time_s| cut.force_n(component, *time_s))
            .collect()
    };
    let (feed, normal) = (force(Component::Feed), force(Component::Normal));
    write_trace(
        output.file("synthetic-cutting-force.csv")?,
        &[("t_s", &time), ("force_x_n", &normal), ("force_y_n", &feed)],
    )?;
    Ok(())
}
