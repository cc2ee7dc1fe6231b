//! Step and direction of another control, by pulses on the pins: docs/step-direction.md.

use anyhow::{Result, ensure};
use quadrant_law::safety::EnabledBy;
use quadrant_link::message::{AxisName, Body, Event, MachineState, Notice, Status};
use quadrant_settings::{PulseSettings, StageSettings};

use crate::bench::{Bench, Subject};
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::{NEXT_TICK_S, commissioned, enable, row_fault, row_off, runs, started};
use crate::stage::COUNT_MM;

/// The page's middle step, and its delay.
const STEP_MM: f64 = 0.005;
const DELAY_S: f64 = 0.0127;
/// A step that makes 200 mm/s of the fastest 500 kHz, and the shortest delay.
const FAST_STEP_MM: f64 = 0.0004;
const FAST_MM_S: f64 = 200.0;
const FAST_DELAY_S: f64 = 0.0063;
/// Acceleration of the trains, mm/s².
const ACCELERATION: f64 = 2000.0;
/// The direction line is set so long before the next step, ns.
const DIRECTION_NS: u64 = 1000;
/// From SERVO ON to the outputs, s: the page's 3.2 ms, and the ticks in which a fault is reset and the outputs come on.
const ON_S: [f64; 2] = [3.1e-3, 3.6e-3];
/// Time in which what was asked for by a line has happened or never does, s.
const SETTLED_S: f64 = 0.02;
/// The tick in which a jump is found, and the next one, which sets the line, s.
const JUMP_S: f64 = 300e-6;
/// A controlled stop from 250 mm/s at 2000 mm/s², 200 ticks at rest, and 50 ms in reserve (docs/safety.md), s.
const STOP_S: f64 = 0.195;

/// Following error, um: that of a jog.
const ERROR_UM: f64 = 20.0;

const STEP: usize = 0;
const DIRECTION: usize = 1;

/// Pulses of a control whose timer is not even: each step is late by up to a seventh of the time between two.
struct Train {
    edges: Vec<(u64, usize, bool)>,
    step_mm: f64,
    /// End of what is made so far, ns.
    end: u64,
    backwards: bool,
    /// Steps, each in its sense, and all of them.
    sum: i64,
    steps: u64,
    noise: u64,
}

impl Train {
    /// No pulses yet; the direction line is low.
    fn new(step_mm: f64) -> Self {
        Self {
            edges: Vec::new(),
            step_mm,
            end: 0,
            backwards: false,
            sum: 0,
            steps: 0,
            noise: 1,
        }
    }

    /// Between 0 and 1 (Lehmer's generator).
    fn random(&mut self) -> f64 {
        self.noise = self.noise * 48_271 % 0x7FFF_FFFF;
        self.noise as f64 / f64::from(0x7FFF_FFFF_u32)
    }

    /// Adds a motion from rest to rest, with a velocity that it does not exceed.
    fn motion(&mut self, mm: f64, mm_s: f64) {
        let way = mm.abs();
        let top = mm_s.min((ACCELERATION * way).sqrt());
        let ramp = top * top / (2.0 * ACCELERATION);
        let end_s = way / top + top / ACCELERATION;
        let begin = self.end + 2 * DIRECTION_NS;
        let backwards = mm < 0.0;
        for step in 1..=(way / self.step_mm).round() as u64 {
            let at = (step as f64 * self.step_mm).min(way);
            let (at_s, velocity) = if at < ramp {
                let s = (2.0 * at / ACCELERATION).sqrt();
                (s, s * ACCELERATION)
            } else if at <= way - ramp {
                (top / ACCELERATION + (at - ramp) / top, top)
            } else {
                let s = (2.0 * (way - at) / ACCELERATION).sqrt();
                (end_s - s, s * ACCELERATION)
            };
            let period = (self.step_mm / velocity.max(1e-3) * 1e9).min(20_000.0);
            let late = 0.15 * period * self.random();
            let rise = begin + (at_s * 1e9 + late) as u64;
            if self.backwards != backwards {
                self.backwards = backwards;
                self.edges.push((rise - DIRECTION_NS, DIRECTION, backwards));
            }
            self.edges.push((rise, STEP, true));
            self.edges
                .push((rise + (0.425 * period) as u64, STEP, false));
            self.sum += if backwards { -1 } else { 1 };
            self.steps += 1;
        }
        self.end = begin + (end_s * 1e9) as u64 + 20_000;
    }

    /// Way of all steps, mm.
    fn mm(&self) -> f64 {
        self.sum as f64 * self.step_mm
    }
}

/// Puts levels on the lines, at times from now on, ns.
fn send(bench: &mut Bench, edges: &[(u64, usize, bool)]) {
    let now = bench.now();
    let edges: Vec<_> = edges
        .iter()
        .map(|edge| (now + edge.0, edge.1, edge.2))
        .collect();
    bench.with(move |world, _, _| world.train.extend(edges));
}

fn settings(step_mm: f64, delay_s: f64) -> StageSettings {
    let mut settings = StageSettings::simulated();
    settings.axes[0].pulses = Some(PulseSettings {
        step_mm,
        delay_s,
        ..PulseSettings::default()
    });
    settings
}

/// The board with these settings, which were sent by the link; SERVO ON is off.
fn board(image: &Subject, settings: &StageSettings) -> Result<(Bench, Client)> {
    let mut bench = started(image, Some(&commissioned(image)?))?;
    bench.with(|world, _, _| world.plant = true);
    servo_on(&mut bench, false);
    let mut client = Client::open(&mut bench)?;
    apply(
        &mut bench,
        &mut client,
        settings,
        &StageSettings::simulated(),
    )?;
    // The line must be seen off.
    bench.run_for(SETTLED_S);
    Ok((bench, client))
}

/// Puts settings in force: the axes get theirs some time after the answer, and report it.
fn apply(
    bench: &mut Bench,
    client: &mut Client,
    settings: &StageSettings,
    present: &StageSettings,
) -> Result<()> {
    let applied = |notice: &Notice| {
        matches!(
            notice,
            Notice::Event {
                event: Event::SettingsApplied(_),
                ..
            }
        )
    };
    client.notices.clear();
    client.load(bench, settings, present)?;
    let end = bench.now() + 1_000_000_000;
    while !client.notices.iter().any(applied) {
        ensure!(bench.now() < end, "the settings do not act");
        bench.run_until_frame(0.1, 0.001, |_| false);
        client.take(bench);
    }
    Ok(())
}

fn servo_on(bench: &mut Bench, on: bool) {
    bench.drive(bench.wiring.pulses.servo_on, !on);
}

/// Turns SERVO ON off and on, and waits until the axis follows.
fn again(bench: &mut Bench) {
    servo_on(bench, false);
    bench.run_for(0.3);
    servo_on(bench, true);
    bench.run_for(SETTLED_S);
}

fn is_enabled(bench: &mut Bench) -> bool {
    bench.with(|_, board, _| board.is_enabled())
}

fn alarm(bench: &mut Bench) -> &'static str {
    let at = bench.wiring.pulses.alarm;
    match bench.with(move |_, board, _| board.level(at)) {
        true => "high",
        false => "low",
    }
}

/// Outputs and ALARM.
fn row_lines(bench: &mut Bench, report: &mut Report, done: &str, outputs: &str, level: &str) {
    let seen = if is_enabled(bench) { "on" } else { "off" };
    report.equal(
        done,
        format!("outputs {outputs}, ALARM {level}"),
        format!("outputs {seen}, ALARM {}", alarm(bench)),
    );
}

/// Time from an instant to the next change to a level, s.
fn change_after(changes: &[(u64, bool)], since: u64, level: bool) -> Option<f64> {
    let change = changes
        .iter()
        .find(|change| change.0 >= since && change.1 == level)?;
    Some((change.0 - since) as f64 * 1e-9)
}

/// The place that x is to have, mm.
fn reference(status: &Status) -> f64 {
    status.axes[0].position_mm + f64::from(status.axes[0].error_mm)
}

/// Position that the encoder's lines show of x, mm.
fn shown(bench: &mut Bench) -> f64 {
    bench.with(|world, _, _| world.shown[0]) as f64 * COUNT_MM
}

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    switching_on(image, report)?;
    following(image, report)?;
    fastest(image, report)?;
    faults(image, report)?;
    hosts(image, report)
}

/// The line SERVO ON, from the start on.
fn switching_on(image: &Subject, report: &mut Report) -> Result<()> {
    let (mut bench, mut client) = board(image, &settings(STEP_MM, DELAY_S))?;
    client.store(&mut bench, "step and direction")?;
    let flash = bench.settings_flash();
    drop(bench);
    let mut bench = Bench::start(image, Some(&flash));
    servo_on(&mut bench, true);
    ensure!(runs(&mut bench), "no control tick");
    bench.run_for(0.05);
    row_lines(
        &mut bench,
        report,
        "SERVO ON on since the start",
        "off",
        "high",
    );
    servo_on(&mut bench, false);
    bench.run_for(SETTLED_S);
    let since = bench.now();
    servo_on(&mut bench, true);
    bench.run_for(SETTLED_S);
    let enables = bench.with(|world, _, _| world.enables.clone());
    let on = change_after(&enables, since, true).unwrap_or(f64::NAN);
    report.within(
        "SERVO ON off and on: outputs on after",
        ON_S[0] * 1e3,
        ON_S[1] * 1e3,
        on * 1e3,
        "ms",
    );
    row_lines(&mut bench, report, "then", "on", "high");

    // Off and on with an input that is bad.
    servo_on(&mut bench, false);
    bench.run_for(0.3);
    bench.drive(image.board.faults[1], true);
    servo_on(&mut bench, true);
    bench.run_for(SETTLED_S);
    row_lines(
        &mut bench,
        report,
        "SERVO ON with amplifier y not sound",
        "off",
        "low",
    );
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

/// Steps of 5 um forth and back.
fn following(image: &Subject, report: &mut Report) -> Result<()> {
    const FORTH_MM: f64 = 12.0;
    const BACK_MM: f64 = 20.0;
    const MM_S: f64 = 50.0;
    let settings = settings(STEP_MM, DELAY_S);
    let (mut bench, mut client) = board(image, &settings)?;
    servo_on(&mut bench, true);
    bench.run_for(SETTLED_S);
    let start = client.status(&mut bench)?;
    let mut train = Train::new(STEP_MM);
    train.motion(FORTH_MM, MM_S);
    train.motion(-BACK_MM, MM_S);
    train.motion(0.1, 2.0);
    let (at, end) = (shown(&mut bench), train.end);
    send(&mut bench, &train.edges);
    // Half way forth the velocity is even.
    let half = (FORTH_MM / MM_S + MM_S / ACCELERATION) / 2.0;
    bench.run_for(half);
    let behind = FORTH_MM / 2.0 - (shown(&mut bench) - at);
    let previews = settings.axes.iter().map(|axis| axis.feedforward.preview_s);
    let lag = DELAY_S + previews.fold(0.0, f64::max);
    // Two ticks of rounding, the step that is under way, and the law's own error.
    let slack = 2e-4 + (STEP_MM + ERROR_UM * 1e-3) / MM_S;
    report.within(
        &format!("at {MM_S} mm/s: x behind its steps by"),
        ((lag - slack) * 1e4).floor() / 10.0,
        ((lag + slack) * 1e4).ceil() / 10.0,
        behind / MM_S * 1e3,
        "ms",
    );
    bench.run_for(end as f64 * 1e-9 - half + 0.3);
    let status = client.status(&mut bench)?;
    row_steps(&mut bench, report, &train);
    let moved = reference(&status) - reference(&start);
    report.within(
        &format!("reference less the {} steps forth", train.sum),
        -0.05,
        0.05,
        (moved - train.mm()) * 1e3,
        "um",
    );
    report.within(
        "x less its reference, at rest",
        -ERROR_UM,
        ERROR_UM,
        -f64::from(status.axes[0].error_mm) * 1e3,
        "um",
    );
    row_lines(&mut bench, report, "after it", "on", "high");
    report.equal("overruns", 0, status.overruns);

    // Off in motion.
    let mut train = Train::new(STEP_MM);
    train.motion(FORTH_MM, MM_S);
    send(&mut bench, &train.edges);
    bench.run_for(0.15);
    let since = bench.now();
    servo_on(&mut bench, false);
    bench.run_for(0.001);
    row_off(
        &mut bench,
        report,
        &format!("SERVO ON off at {MM_S} mm/s"),
        since,
        NEXT_TICK_S,
    );
    row_lines(&mut bench, report, "then", "off", "high");
    bench.run_for(0.4);
    let stands = client.status(&mut bench)?.axes[0].position_mm;
    servo_on(&mut bench, true);
    bench.run_for(0.1);
    let off = reference(&client.status(&mut bench)?) - stands;
    report.within(
        "on again, behind steps that it did not follow: reference less where it stood",
        -0.001,
        0.001,
        off,
        "mm",
    );
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

/// Steps that the timer has counted.
fn row_steps(bench: &mut Bench, report: &mut Report, train: &Train) {
    let counted = bench.with(|_, board, now| board.pulses(now));
    report.equal(
        &format!("steps counted of {}", train.steps),
        (train.steps as u32) & 0xFFFF,
        counted,
    );
}

/// The fastest train, and the shortest pulse.
fn fastest(image: &Subject, report: &mut Report) -> Result<()> {
    let (mut bench, mut client) = board(image, &settings(FAST_STEP_MM, FAST_DELAY_S))?;
    servo_on(&mut bench, true);
    bench.run_for(SETTLED_S);
    let start = client.status(&mut bench)?;
    let mut train = Train::new(FAST_STEP_MM);
    train.motion(30.0, FAST_MM_S);
    train.motion(-24.0, FAST_MM_S);
    let end = train.end;
    send(&mut bench, &train.edges);
    bench.run_for(end as f64 * 1e-9 + 0.3);
    let status = client.status(&mut bench)?;
    row_steps(&mut bench, report, &train);
    let moved = reference(&status) - reference(&start);
    report.within(
        &format!(
            "500 kHz forth and back: reference less the {} steps",
            train.sum
        ),
        -0.05,
        0.05,
        (moved - train.mm()) * 1e3,
        "um",
    );
    row_fault(&mut bench, &mut client, report, "fault", "none")?;
    report.equal("overruns", 0, status.overruns);
    servo_on(&mut bench, false);
    bench.run_for(SETTLED_S);
    let [rejected, passed] = image.board.filtered_ns;
    for (ns, steps) in [(rejected, 0), (passed, 1)] {
        let before = bench.with(|_, board, now| board.pulses(now));
        send(&mut bench, &[(0, STEP, true), (ns, STEP, false)]);
        bench.run_for(1e-5);
        let after = bench.with(|_, board, now| board.pulses(now));
        report.equal(
            &format!("steps seen of a pulse of {ns} ns"),
            steps,
            after.wrapping_sub(before) & 0xFFFF,
        );
    }
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

/// Faults 32 and 33.
fn faults(image: &Subject, report: &mut Report) -> Result<()> {
    let settings = settings(STEP_MM, DELAY_S);
    let (mut bench, mut client) = board(image, &settings)?;
    servo_on(&mut bench, true);
    bench.run_for(SETTLED_S);

    // Up to 320 mm/s; the limit is 250.
    let limit = settings.axes[0].limits.max_velocity_mm_s;
    let mut train = Train::new(STEP_MM);
    train.motion(80.0, 320.0);
    let since = bench.now() + (limit / ACCELERATION * 1e9) as u64;
    send(&mut bench, &train.edges);
    bench.run_for(limit / ACCELERATION + 0.5);
    let alarms = bench.with(|world, _, _| world.alarms.clone());
    let fell = change_after(&alarms, since, false).unwrap_or(f64::NAN);
    report.within(
        "steps of more than 250 mm/s: ALARM falls after",
        0.0,
        2.0 * DELAY_S * 1e3,
        fell * 1e3,
        "ms",
    );
    let fault_at = since + (fell * 1e9) as u64;
    row_off(
        &mut bench,
        report,
        "from there: braked, then off",
        fault_at,
        STOP_S,
    );
    row_fault(
        &mut bench,
        &mut client,
        report,
        "fault",
        "32 pulse-overspeed x",
    )?;
    row_lines(&mut bench, report, "after it", "off", "low");
    again(&mut bench);
    row_lines(&mut bench, report, "SERVO ON off and on", "on", "high");

    // 2500 mm/s for two ticks.
    let burst: Vec<_> = (0..100)
        .flat_map(|k| [(k * 2000, STEP, true), (k * 2000 + 900, STEP, false)])
        .collect();
    // Forth and back and forth within a tick.
    let turns = [(0, DIRECTION, true), (10_000, DIRECTION, false)];
    for (done, edges) in [
        ("2500 mm/s from rest", &burst[..]),
        ("two edges of direction within a tick", &turns[..]),
    ] {
        let since = bench.now();
        send(&mut bench, edges);
        bench.run_for(0.1);
        let alarms = bench.with(|world, _, _| world.alarms.clone());
        let fell = change_after(&alarms, since, false).unwrap_or(f64::NAN);
        report.within(
            &format!("{done}: ALARM falls after"),
            0.0,
            JUMP_S * 1e6,
            fell * 1e6,
            "us",
        );
        row_off(&mut bench, report, "braked, then off", since, STOP_S);
        row_fault(&mut bench, &mut client, report, "fault", "33 pulse-jump x")?;
        row_lines(&mut bench, report, "after it", "off", "low");
        again(&mut bench);
        row_lines(&mut bench, report, "SERVO ON off and on", "on", "high");
    }
    let status = client.status(&mut bench)?;
    report.equal(
        "state",
        MachineState::Enabled.as_str(),
        status.state.as_str(),
    );
    report.equal("overruns", 0, status.overruns);
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

/// A host beside the control.
fn hosts(image: &Subject, report: &mut Report) -> Result<()> {
    let with_pulses = settings(STEP_MM, DELAY_S);
    let (mut bench, mut client) = board(image, &with_pulses)?;
    servo_on(&mut bench, true);
    bench.run_for(SETTLED_S);
    let mut train = Train::new(STEP_MM);
    train.motion(10.0, 50.0);
    send(&mut bench, &train.edges);
    bench.run_for(0.1);
    let refusal = client.ask(
        &mut bench,
        Body::Jog {
            axis: AxisName::X,
            velocity_mm_s: 5.0,
        },
    );
    report.row(
        "a host's jog of x while it follows",
        "refused",
        refusal
            .as_ref()
            .map_or_else(|error| format!("{error:#}"), |_| "accepted".into()),
        refusal.is_err(),
    );
    client.ask(&mut bench, Body::Stop)?;
    bench.run_for(0.3);
    row_lines(&mut bench, report, "stopped by a host", "on", "low");
    again(&mut bench);
    row_lines(&mut bench, report, "SERVO ON off and on", "on", "high");
    servo_on(&mut bench, false);
    bench.run_for(0.3);

    enable(&mut bench, &mut client)?;
    let jog = Body::Jog {
        axis: AxisName::X,
        velocity_mm_s: 5.0,
    };
    client.ask(&mut bench, jog)?;
    bench.run_for(0.1);
    row_lines(&mut bench, report, "a host jogs", "on", "high");
    servo_on(&mut bench, true);
    bench.run_for(SETTLED_S);
    row_lines(&mut bench, report, "SERVO ON meanwhile", "off", "low");
    servo_on(&mut bench, false);
    bench.run_for(0.3);

    let mut by_host = with_pulses.clone();
    by_host.operation.enabled_by = EnabledBy::Host;
    apply(&mut bench, &mut client, &by_host, &with_pulses)?;
    bench.run_for(SETTLED_S);
    servo_on(&mut bench, true);
    bench.run_for(SETTLED_S);
    report.equal(
        "operation.enabled_by \"host\", SERVO ON: outputs on",
        false,
        is_enabled(&mut bench),
    );
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}
