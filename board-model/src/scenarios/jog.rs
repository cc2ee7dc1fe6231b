//! A jog of three axes, through edges and frames.

use anyhow::Result;
use quadrant_link::message::{AxisName, Body, MachineState};

use crate::bench::Subject;
use crate::report::Report;
use crate::scenarios::{driving, row_off};
use crate::stage::COUNT_MM;

/// Velocities of x, y, z, mm/s.
const VELOCITIES: [f64; 3] = [20.0, -15.0, 8.0];

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let (mut bench, mut client) = driving(image)?;
    bench.ticks();
    bench.with(|world, _, _| world.feeds.1 = 0);
    for (axis, velocity_mm_s) in AxisName::ALL.into_iter().zip(VELOCITIES) {
        client.ask(
            &mut bench,
            Body::Jog {
                axis,
                velocity_mm_s,
            },
        )?;
    }
    bench.run_for(0.3);
    client.status(&mut bench)?;
    let before = bench.with(|world, _, now| (world.shown, now.0));
    bench.run_for(0.4);
    let after = bench.with(|world, _, now| (world.shown, now.0));
    let status = client.status(&mut bench)?;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let counts = (after.0[axis] - before.0[axis]) as f64;
        let velocity = counts * COUNT_MM / ((after.1 - before.1) as f64 * 1e-9);
        let requested = VELOCITIES[axis];
        let passes = (velocity - requested).abs() < 0.01 * requested.abs();
        report.row(
            &format!("{name}: velocity of the encoder's edges"),
            format!("{requested} mm/s ±1 %"),
            format!("{velocity:.3} mm/s"),
            passes,
        );
        let error = f64::from(status.axes[axis].error_mm) * 1e3;
        report.within(
            &format!("{name}: following error"),
            -20.0,
            20.0,
            error,
            "um",
        );
    }
    client.ask(&mut bench, Body::Stop)?;
    bench.run_for(0.3);
    let status = client.status(&mut bench)?;
    report.equal(
        "after `stop`: state, running",
        "enabled false".into(),
        format!("{} {}", status.state.as_str(), status.running),
    );
    let before = bench.with(|world, _, _| world.shown);
    bench.run_for(0.2);
    let after = bench.with(|world, _, _| world.shown);
    let moved = (0..3)
        .map(|axis| (after[axis] - before[axis]).abs())
        .max()
        .unwrap_or(0);
    report.row(
        "counts that an axis moves in 0.2 s after `stop`",
        "at most 100: 0.25 mm/s",
        moved,
        moved <= 100,
    );
    let asked = bench.now();
    client.ask(&mut bench, Body::Disable)?;
    // From the last byte of the request at most 11 ticks (docs/safety.md), and the bytes themselves.
    row_off(&mut bench, report, "disable", asked, 1.7e-3);
    report.equal(
        "state",
        "disabled",
        client
            .status(&mut bench)
            .map(|status| MachineState::as_str(status.state))?,
    );
    let longest = bench.with(|world, _, _| world.feeds.1) as f64 * 1e-6;
    report.within(
        "longest time between two feeds of the watchdog",
        0.0,
        image.board.watchdog_s[0] * 1e3,
        longest,
        "ms",
    );
    let ticks = bench.ticks();
    report.equal(
        "time from tick to tick, ns",
        "100000 to 100000".into(),
        format!("{} to {}", ticks.period_ns.0, ticks.period_ns.1),
    );
    report.equal("overruns", 0, status.overruns);
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}
