//! Safety inputs of a moving machine.

use anyhow::Result;
use quadrant_link::message::{AxisName, Body};

use crate::bench::{Bench, Subject};
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::{NEXT_TICK_S, driving, enable, row_fault, row_off};
use crate::wiring::{At, Wiring};

/// Velocity of the jog, mm/s.
const VELOCITY: f64 = 20.0;
/// A controlled stop at most, s: 105 ms of braking with these settings, 200 ticks at rest, 50 ms in reserve (docs/safety.md).
const STOP_S: f64 = 0.155;

/// The inputs of which one broken wire, or one active contact, switches off at once.
fn off(wiring: &Wiring) -> [(&'static str, At, &'static str); 5] {
    let [x, y, z] = wiring.faults;
    [
        ("emergency stop", wiring.emergency_stop, "4 emergency-stop"),
        ("amplifiers ready", wiring.ready, "14 amplifier-fault x"),
        ("amplifier fault x", x, "14 amplifier-fault x"),
        ("amplifier fault y", y, "14 amplifier-fault y"),
        ("amplifier fault z", z, "14 amplifier-fault z"),
    ]
}

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let (mut bench, mut client) = driving(image)?;
    for (name, at, fault) in off(image.board) {
        jog(&mut bench, &mut client, AxisName::X, VELOCITY)?;
        let since = bench.now();
        bench.drive(at, true);
        bench.run_for(0.001);
        row_off(
            &mut bench,
            report,
            &format!("{name} open"),
            since,
            NEXT_TICK_S,
        );
        row_fault(
            &mut bench,
            &mut client,
            report,
            &format!("{name} open: fault"),
            fault,
        )?;
        let refusal = client
            .ask(&mut bench, Body::ResetFault)
            .and_then(|_| client.ask(&mut bench, Body::Enable));
        bench.run_for(0.005);
        let drives = bench.with(|_, board, _| board.is_enabled());
        report.row(
            &format!("{name} open: `enable`"),
            "refused",
            refusal.map_or_else(|e| format!("{e:#}"), |_| "accepted".into()),
            !drives,
        );
        bench.drive(at, false);
        again(&mut bench, &mut client)?;
    }
    jog(&mut bench, &mut client, AxisName::X, VELOCITY)?;
    let since = bench.now();
    let low_mv = image.board.low_mv;
    bench.with(move |_, board, _| board.set_supply(low_mv));
    bench.run_for(0.001);
    row_off(
        &mut bench,
        report,
        &format!("supply at {low_mv} mV"),
        since,
        NEXT_TICK_S,
    );
    row_fault(
        &mut bench,
        &mut client,
        report,
        "low supply: fault",
        "14 amplifier-fault x",
    )?;
    bench.with(|_, board, _| board.set_supply(3300));
    bench.run_for(0.01);
    again(&mut bench, &mut client)?;

    for (index, at) in image.board.limits.into_iter().enumerate() {
        let (axis, positive) = (AxisName::ALL[index / 2], index % 2 == 1);
        let (sign, code) = if positive {
            (1.0, "6 positive-limit-switch")
        } else {
            (-1.0, "5 negative-limit-switch")
        };
        let name = format!("limit {axis}{}", if positive { '+' } else { '-' });
        jog(&mut bench, &mut client, axis, sign * VELOCITY)?;
        let since = bench.now();
        bench.drive(at, true);
        // The host goes on asking, so that the stop is the switch's.
        bench.run_for(0.1);
        client.status(&mut bench)?;
        bench.run_for(0.1);
        row_off(
            &mut bench,
            report,
            &format!("{name} open while moving towards it: stop, then off"),
            since,
            STOP_S,
        );
        row_fault(
            &mut bench,
            &mut client,
            report,
            &format!("{name}: fault"),
            &format!("{code} {axis}"),
        )?;
        bench.drive(at, false);
        again(&mut bench, &mut client)?;
    }
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

/// Jogs an axis until it has its velocity.
fn jog(bench: &mut Bench, client: &mut Client, axis: AxisName, velocity_mm_s: f64) -> Result<()> {
    client.ask(
        bench,
        Body::Jog {
            axis,
            velocity_mm_s,
        },
    )?;
    bench.run_for(0.1);
    client.status(bench)?;
    Ok(())
}

/// Resets the fault and enables once the axes have coasted to rest.
fn again(bench: &mut Bench, client: &mut Client) -> Result<()> {
    bench.run_for(0.2);
    // Refused if it was reset while the input was active.
    let _ = client.ask(bench, Body::ResetFault);
    bench.run_for(0.005);
    enable(bench, client)
}
