//! A jog at the highest control rate that the board is up to.

use anyhow::{Result, ensure};
use quadrant_link::message::{AxisName, Body};
use quadrant_settings::StageSettings;

use crate::bench::Subject;
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::{commissioned, enable, runs, started};
use crate::stage::COUNT_MM;

/// Velocity of the jog, mm/s.
const VELOCITY: f64 = 20.0;

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let rate_hz = image.board.fastest_hz;
    // Two cycles each at most.
    let image = &Subject {
        instructions_per_s: image.instructions_per_s.max(image.board.core_hz / 2),
        ..image.clone()
    };
    let mut bench = started(image, Some(&commissioned(image)?))?;
    let mut client = Client::open(&mut bench)?;
    let mut settings = StageSettings::simulated();
    settings.rate_hz = rate_hz;
    client.load(&mut bench, &settings, &StageSettings::simulated())?;
    client.store(&mut bench, "fastest")?;
    client.ask(&mut bench, Body::Reboot)?;
    bench.run_for(0.1);
    ensure!(runs(&mut bench), "no control tick; log: {:#?}", bench.log());
    bench.with(|world, _, _| world.plant = true);
    let mut client = Client::open(&mut bench)?;
    enable(&mut bench, &mut client)?;
    client.ask(
        &mut bench,
        Body::Jog {
            axis: AxisName::X,
            velocity_mm_s: VELOCITY,
        },
    )?;
    bench.run_for(0.3);
    client.status(&mut bench)?;
    bench.ticks();
    let before = bench.with(|world, _, _| world.shown[0]);
    bench.run_for(0.4);
    let after = bench.with(|world, _, _| world.shown[0]);
    let ticks = bench.ticks();
    let status = client.status(&mut bench)?;
    let velocity = (after - before) as f64 * COUNT_MM / 0.4;
    report.row(
        &format!("{rate_hz} Hz: velocity of the encoder's edges"),
        format!("{VELOCITY} mm/s ±1 %"),
        format!("{velocity:.3} mm/s"),
        (velocity - VELOCITY).abs() < 0.01 * VELOCITY,
    );
    report.equal(
        "control ticks in 0.4 s",
        (0.4 * rate_hz) as u64,
        ticks.count,
    );
    report.row(
        "instructions a tick",
        "fewer than half of the cycles of a tick",
        ticks.instructions.1,
        (ticks.instructions.1 as f64) < 0.5 * image.board.core_hz as f64 / rate_hz,
    );
    report.equal("overruns", 0, status.overruns);
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}
