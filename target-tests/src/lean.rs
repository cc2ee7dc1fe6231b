//! `cargo xtask lean`: the emulated lean firmware, which holds no settings, loaded by a host over its link: what it refuses, and a job
//! whose every converter word and byte of the link is that of the reference model in this process.

use anyhow::{Context, Result, bail, ensure};
use quadrant::command::Command;
use quadrant::link::message::{
    AxisSet, Body, LinkError, LoadRequest, LoadStatus, Reply, SettingsRequest,
};
use quadrant::settings::StageSettings;
use quadrant_sim::client::load::{BuiltPart, build};

use crate::faults::approach::{LONGEST, SPEED_MM_S, homed};
use crate::faults::fixture::{A_WHILE, Fixture};
use crate::hosted::homed_configuration;
use xtask::image::{self, Board, Scalar, Target};
use xtask::toolchain::Toolchain;

/// Ticks of the plan.
const MOVING_TICKS: u32 = 4_000;

/// Loads the image, runs a job on it, and fails on any difference.
pub(crate) fn run(toolchain: Toolchain) -> Result<()> {
    let target = Target::new(Board::Mps2, Scalar::F32).lean();
    let image = image::build(toolchain, target)?;
    println!("{}", image.footprint()?);
    let configuration = homed_configuration();
    let (stage, plan) = (configuration.job.stage.clone(), configuration.job.plan);
    let mut fixture = Fixture::start(&image, configuration)?;
    unloaded(&mut fixture)?;
    let parts = build(&stage, &status(&mut fixture)?)?;
    damaged(&mut fixture, &parts)?;
    load(&mut fixture, &parts)?;
    homed(&mut fixture)?;
    refused(
        &mut fixture,
        Body::Load(LoadRequest::Begin(parts[0].header)),
        "outputs are on",
    )?;
    fixture.done(Body::SetPlan(plan.into()))?;
    fixture.done(Body::Run)?;
    fixture.run_until(LONGEST, "full speed", |fixture| {
        fixture.plant().axes()[0].velocity_mm_s() > 0.97 * SPEED_MM_S
    })?;
    fixture.run(MOVING_TICKS)?;
    fixture.done(Body::Stop)?;
    fixture.run(LONGEST / 10)?;
    again(&mut fixture, &stage)?;
    let (words, bytes) = fixture.compared;
    fixture.end()?;
    println!(
        "loaded, homed, moved and loaded again; {words} converter words and {bytes} bytes of the link compared, 0 differ"
    );
    Ok(())
}

/// Before axes are loaded nothing is enabled, from the link or at the machine, and nothing moves.
fn unloaded(fixture: &mut Fixture) -> Result<()> {
    refused(fixture, Body::Enable, "no axes are loaded")?;
    refused(fixture, Body::Home(AxisSet::ALL), "no axes are loaded")?;
    refused(fixture, Body::Run, "no axes are loaded")?;
    refused(
        fixture,
        Body::Settings(SettingsRequest::Apply),
        "holds no settings",
    )?;
    press_enable(fixture)?;
    ensure!(status(fixture)?.axes == AxisSet::NONE, "axes from nowhere");
    Ok(())
}

/// A part of another layout, one with a damaged word, and an axis before its machine are refused, and nothing is enabled after.
fn damaged(fixture: &mut Fixture, parts: &[BuiltPart]) -> Result<()> {
    let [machine, x, ..] = parts else {
        bail!("parts are missing: {}", parts.len());
    };
    let mut other = machine.header;
    other.fingerprint ^= 1;
    refused(
        fixture,
        Body::Load(LoadRequest::Begin(other)),
        "another release",
    )?;
    refused(
        fixture,
        Body::Load(LoadRequest::Begin(x.header)),
        "begin with it",
    )?;
    send(fixture, machine)?;
    let mut broken = x.clone();
    if let Some(word) = broken.words.last_mut() {
        *word ^= 1;
    }
    let error = send(fixture, &broken)
        .err()
        .context("a damaged axis was taken")?;
    ensure!(
        error.to_string().contains("crc"),
        "another refusal: {error:#}"
    );
    press_enable(fixture)
}

/// Other axes are loaded while the outputs are off, and enabled.
fn again(fixture: &mut Fixture, stage: &StageSettings) -> Result<()> {
    fixture.done(Body::Disable)?;
    fixture.run(A_WHILE)?;
    let mut softer = stage.clone();
    for axis in &mut softer.axes {
        axis.feedback.pid.kp_v_per_mm *= 0.9;
    }
    let board = status(fixture)?;
    load(fixture, &build(&softer, &board)?)?;
    fixture.done(Body::Enable)?;
    fixture.run(MOVING_TICKS)?;
    let enabled = fixture
        .outputs(fixture.tick() - 1)
        .is_some_and(|outputs| outputs.enabled);
    ensure!(enabled, "not enabled: {:?}", fixture.status()?);
    Ok(())
}

/// Somebody at the machine asks to enable, in vain.
fn press_enable(fixture: &mut Fixture) -> Result<()> {
    fixture.inject(Box::new(|input, _, since| {
        input.request = (since == 0).then_some(Command::Enable);
    }));
    fixture.run(A_WHILE)?;
    let outputs = fixture.outputs(fixture.tick() - 1).unwrap_or_default();
    ensure!(!outputs.enabled, "enabled without axes: {outputs:?}");
    Ok(())
}

fn load(fixture: &mut Fixture, parts: &[BuiltPart]) -> Result<()> {
    for part in parts {
        send(fixture, part)?;
    }
    fixture.run(A_WHILE)?;
    let status = status(fixture)?;
    ensure!(status.axes == AxisSet::ALL, "not all are there: {status:?}");
    Ok(())
}

fn send(fixture: &mut Fixture, part: &BuiltPart) -> Result<()> {
    for request in part.requests() {
        fixture.done(Body::Load(request))?;
    }
    Ok(())
}

fn status(fixture: &mut Fixture) -> Result<LoadStatus> {
    match fixture.reply(Body::Load(LoadRequest::State))? {
        Reply::Load(status) => Ok(status),
        other => bail!("not what is loaded: {other:?}"),
    }
}

fn refused(fixture: &mut Fixture, body: Body, because: &str) -> Result<()> {
    let name = body.name();
    match fixture.ask(body)? {
        Err(LinkError::Refused(text) | LinkError::Invalid(text)) if text.contains(because) => {
            Ok(())
        }
        other => bail!("{name} is not refused because {because:?}: {other:?}"),
    }
}
