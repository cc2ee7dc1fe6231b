//! The whole study: the scenarios on the axis, the other drives, and the compliances.

use quadrant_settings::StageSettings;
use quadrant_sim::plant::StageParameters;
use quadrant_sim::plant::load::Force;

use crate::robustness::compliance::{
    Compliance, FREQUENCIES_HZ, frictionless, linear_compliance, pid_alone, simulated_compliance,
};
use crate::robustness::drives::{Refused, commission_drives, drive_cases};
use crate::robustness::{
    RobustnessError, RobustnessOutcome, RobustnessRequest, Scenario, run_robustness, scenarios,
    usual_competitors,
};

/// Request for the study.
pub struct StudyRequest {
    /// Settings that the axis was commissioned with.
    pub stage: StageSettings,
    /// The axis, 0 to 2.
    pub axis: usize,
    /// Backlash of the rack, mm; zero or more.
    pub backlash_mm: f64,
    /// A recorded force on the table, if there is one.
    pub force: Option<Force>,
    /// Only scenarios whose name contains this, and those that changes are counted from; no compliance then.
    pub only: Option<String>,
    /// Seed of the first run of each; the others follow it.
    pub seed: u64,
    /// Runs of each, 1 or more.
    pub seeds: u64,
}

/// Results of the study.
#[derive(Debug)]
pub struct RobustnessReport {
    /// The scenarios, in the order of the tables.
    pub scenarios: Vec<Scenario>,
    /// Results of the competitors.
    pub outcomes: Vec<RobustnessOutcome>,
    /// Drives on which no controller could be commissioned, and why.
    pub refused: Vec<Refused>,
    /// Compliances, the linear model's first; none where they were not asked for.
    pub compliances: Vec<Compliance>,
}

/// Reasons for which there is no study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// No scenario has such a name.
    #[error("no scenario's name contains {0:?}; --list shows them all")]
    NoScenario(String),
    /// The settings hold no linear model.
    #[error(
        "the settings hold no linear model of the axis: commission it, or give other --settings"
    )]
    NoPlant,
    #[error(transparent)]
    Run(#[from] RobustnessError),
}

/// Name and meaning of every scenario.
pub fn names(axis: usize, backlash_mm: f64) -> Vec<(String, String)> {
    let scenarios = scenarios(axis, None).into_iter();
    let cases = drive_cases(axis, backlash_mm).into_iter();
    scenarios
        .map(|scenario| (scenario.name, scenario.what))
        .chain(cases.map(|case| (case.name, case.what)))
        .collect()
}

/// Calls of a study's progress, about.
pub fn runs(request: &StudyRequest) -> u64 {
    let cases = drive_cases(request.axis, request.backlash_mm).len() as u64;
    let scenarios = scenarios(request.axis, None).len() as u64 + cases;
    let competitors = usual_competitors(&request.stage).len() as u64;
    cases + scenarios * competitors * request.seeds
}

/// Runs the study, in parallel; the same request gives the same report.
///
/// # Errors
/// No scenario, no model, refused settings.
pub fn run_study(
    request: &StudyRequest,
    progress: &(dyn Fn() + Sync),
) -> Result<RobustnessReport, StudyError> {
    let is_requested = |name: &str| {
        let only = request.only.as_deref();
        only.is_none_or(|text| name.contains(text))
    };
    let mut cases = drive_cases(request.axis, request.backlash_mm);
    cases.retain(|case| is_requested(&case.name));
    let (drives, refused) = commission_drives(request.axis, cases, request.seed, progress);
    let mut runs = RobustnessRequest {
        competitors: usual_competitors(&request.stage),
        axis: request.axis,
        scenarios: scenarios(request.axis, request.force.clone()),
        seed: request.seed,
        seeds: request.seeds,
    };
    let references = ["nominal", "hold", "slow feed"];
    runs.scenarios.retain(|scenario| {
        is_requested(&scenario.name) || references.contains(&scenario.name.as_str())
    });
    runs.scenarios.extend(drives);
    if let Some(only) = &request.only
        && refused.is_empty()
        && !runs
            .scenarios
            .iter()
            .any(|scenario| is_requested(&scenario.name))
    {
        return Err(StudyError::NoScenario(only.clone()));
    }
    let outcomes = run_robustness(&runs, progress)?;
    let compliances = match &request.only {
        None => compliances(&request.stage, &runs)?,
        Some(_) => Vec::new(),
    };
    Ok(RobustnessReport {
        scenarios: runs.scenarios,
        outcomes,
        refused,
        compliances,
    })
}

/// The linear model's compliance, the frictionless axis', and that of each law on the axis as it is.
fn compliances(
    stage: &StageSettings,
    request: &RobustnessRequest,
) -> Result<Vec<Compliance>, StudyError> {
    let truth = StageParameters::real().axes[request.axis].clone();
    let first = |stage: &StageSettings| {
        let mut stage = stage.clone();
        stage.axes[0] = stage.axes[request.axis].clone();
        stage
    };
    let alone = first(&pid_alone(stage));
    let own = &alone.axes[0];
    let plant = own.plant.ok_or(StudyError::NoPlant)?;
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
