//! x behind a BiSS-C encoder.

use anyhow::{Context, Result};
use quadrant_link::message::{AxisName, Body, MachineState};
use quadrant_settings::{SerialSettings, StageSettings, TravelSettings};

use crate::bench::{Bench, Subject};
use crate::biss::{self, Flaw};
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::{enable, row_fault, row_off, started};
use crate::stage::COUNT_MM;

/// Position that the encoder shows where the axis is at zero, mm.
const OFFSET_MM: f64 = 1234.5;
/// Position of the axis at the start, mm.
const START_MM: f64 = 40.0;
/// Velocity of the jog, mm/s.
const JOG_MM_S: f64 = 20.0;
/// From a flaw to the disabled amplifiers, s: the frame after it is bridged, and the second one is found in its tick.
const SECOND_FRAME_S: f64 = 250e-6;
/// The same where the first frame is found.
const FIRST_FRAME_S: f64 = 150e-6;
fn settings() -> StageSettings {
    let mut settings = StageSettings::simulated();
    let x = &mut settings.axes[0];
    x.homing = None;
    x.limits.unhomed_mm_s = Some(10.0);
    x.limits.travel_mm = Some(TravelSettings {
        negative: -100.0,
        positive: 100.0,
    });
    x.encoder.counter_bits = 26;
    x.encoder.counts_per_index = None;
    x.encoder.serial = Some(SerialSettings::default());
    x.encoder.offset_mm = Some(OFFSET_MM);
    settings
}

/// The encoder's count at a position of the axis.
fn count(position_mm: f64) -> i64 {
    ((position_mm + OFFSET_MM) / COUNT_MM).round() as i64
}

/// Contents of the settings' sectors with these settings.
fn stored(image: &Subject) -> Result<Vec<u8>> {
    let mut bench = started(image, None)?;
    let mut client = Client::open(&mut bench)?;
    client.load(&mut bench, &settings(), &StageSettings::default())?;
    client.store(&mut bench, "serial encoder")?;
    Ok(bench.settings_flash())
}

/// The board with the encoder at the start, driving.
fn driving(image: &Subject, flash: &[u8]) -> Result<(Bench, Client)> {
    let mut bench = started(image, Some(flash))?;
    bench.with(|world, _, _| (world.plant, world.serial_start) = (true, Some(count(START_MM))));
    bench.run_for(0.05);
    let mut client = Client::open(&mut bench)?;
    enable(&mut bench, &mut client).context("with a serial encoder")?;
    Ok((bench, client))
}

fn jogging(image: &Subject, flash: &[u8]) -> Result<(Bench, Client)> {
    let (mut bench, mut client) = driving(image, flash)?;
    let jog = Body::Jog {
        axis: AxisName::X,
        velocity_mm_s: JOG_MM_S,
    };
    client.ask(&mut bench, jog)?;
    bench.run_for(0.1);
    Ok((bench, client))
}

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let flash = stored(image)?;
    let (mut bench, mut client) = driving(image, &flash)?;
    let status = client.status(&mut bench)?;
    report.equal(
        "x is homed without a motion",
        true,
        status.homed.contains(AxisName::X),
    );
    let off_um = (status.axes[0].position_mm - START_MM) * 1e3;
    report.within("position of x less where it is", -1.0, 1.0, off_um, "um");

    let jog = Body::Jog {
        axis: AxisName::X,
        velocity_mm_s: JOG_MM_S,
    };
    client.ask(&mut bench, jog)?;
    bench.run_for(0.2);
    // A jog ends when its host is silent.
    client.status(&mut bench)?;
    bench.with(|world, _, _| world.ages = (u64::MAX, 0));
    bench.ticks();
    let from = bench.with(|world, _, now| (world.serial_count(), now.0));
    bench.run_for(0.3);
    let to = bench.with(|world, _, now| (world.serial_count(), now.0));
    let velocity = (to.0 - from.0) as f64 * COUNT_MM / ((to.1 - from.1) as f64 * 1e-9);
    report.within(
        "velocity of the jog",
        0.99 * JOG_MM_S,
        1.01 * JOG_MM_S,
        velocity,
        "mm/s",
    );
    let status = client.status(&mut bench)?;
    let error_um = f64::from(status.axes[0].error_mm) * 1e3;
    report.within("following error", -20.0, 20.0, error_um, "um");
    let ages = bench.with(|world, _, _| world.ages);
    let us = |ns: u64| ns as f64 * 1e-3;
    let [least, most] = image.board.serial_age_us;
    report.within(
        "age of the youngest position",
        least,
        most,
        us(ages.0),
        "us",
    );
    report.within("age of the oldest position", least, most, us(ages.1), "us");
    let ticks = bench.ticks();
    report.row(
        "instructions of a control tick, mean",
        "printed",
        ticks.total_instructions / ticks.count.max(1),
        true,
    );
    biss::lock(&bench.encoder).flaw = Flaw::WrongBits(1);
    bench.run_for(0.01);
    let status = client.status(&mut bench)?;
    report.equal(
        "one damaged frame",
        MachineState::Enabled.as_str(),
        status.state.as_str(),
    );
    let error_um = f64::from(status.axes[0].error_mm) * 1e3;
    report.within("following error after it", -20.0, 20.0, error_um, "um");
    report.equal("overruns", 0, status.overruns);
    biss::lock(&bench.encoder).flaw = Flaw::Warning;
    bench.run_for(0.01);
    let status = client.status(&mut bench)?;
    report.equal(
        "warnings",
        MachineState::Enabled.as_str(),
        status.state.as_str(),
    );
    report.none("complaints of the models", &bench.complaints());
    drop(bench);

    for (flaw, done, most_s) in [
        (Flaw::WrongBits(2), "two damaged frames", SECOND_FRAME_S),
        (Flaw::High, "SLO cut, read as high", SECOND_FRAME_S),
        (Flaw::Low, "SLO cut, read as low", SECOND_FRAME_S),
        (Flaw::Error, "the encoder's error bit", FIRST_FRAME_S),
    ] {
        let (mut bench, mut client) = jogging(image, &flash)?;
        // Whole frames, after which one is bridged.
        bench.run_for(0.1);
        let since = bench.now();
        biss::lock(&bench.encoder).flaw = flaw;
        bench.run_for(0.002);
        row_off(&mut bench, report, done, since, most_s);
        row_fault(
            &mut bench,
            &mut client,
            report,
            "fault",
            "10 encoder-invalid x",
        )?;
        biss::lock(&bench.encoder).flaw = Flaw::None;
        // It comes to rest.
        bench.run_for(0.5);
        client.ask(&mut bench, Body::ResetFault)?;
        enable(&mut bench, &mut client).context("after the flaw")?;
        let status = client.status(&mut bench)?;
        let at_mm = bench.with(|world, _, _| world.serial_count()) as f64 * COUNT_MM - OFFSET_MM;
        let off_um = (status.axes[0].position_mm - at_mm) * 1e3;
        report.within(
            "position of x less where it is, enabled again",
            -2.0,
            2.0,
            off_um,
            "um",
        );
        if flaw == Flaw::Error {
            // Once a second at most.
            bench.run_for(1.1);
            let log = bench.log();
            let counts = log.iter().find(|line| line.contains("frames of the"));
            let counts = counts.cloned().unwrap_or_default();
            let expected = format!(" {} with its error", biss::lock(&bench.encoder).errors);
            let passes = counts.contains(&expected);
            report.row("frames in the log", expected, counts, passes);
        }
    }
    Ok(())
}
