//! Identity and status of the machine, and orders to it.

use std::fmt::Write as _;

use anyhow::{Context, bail};
use quadrant::app::Translated;
use quadrant_cli::axis::Axis;
use quadrant_host::client::settings::{self, whole_path};
use quadrant_host::client::{Client, settle, with_reset};
use quadrant_host::machine::serial_ports;
use quadrant_law::axes::AxisName;
use quadrant_law::safety::FaultCode;
use quadrant_link::message::{self, AxisSet, Body, Status};
use quadrant_written::fixed;
use serde_json::json;

use super::answer::{Answer, RESTARTED, name, seconds};
use super::command::Command;
use super::{inputs, learnt};

/// Lists the serial ports of this computer.
pub(super) fn ports() -> anyhow::Result<Answer> {
    let ports = serial_ports().context("the serial ports cannot be listed")?;
    if ports.is_empty() {
        return Ok(Answer::new(
            "no serial port: is the board's cable in, and does it carry data?",
            json!([]),
        ));
    }
    let lines: Vec<String> = ports
        .iter()
        .map(|(path, what)| format!("{path:<16} {what}").trim_end().to_owned())
        .collect();
    let data = ports
        .iter()
        .map(|(path, what)| json!({ "path": path, "device": what }))
        .collect();
    Ok(Answer::new(lines.join("\n"), data))
}

pub(super) fn hello(client: &mut Client) -> anyhow::Result<Answer> {
    // Asked again: the machine may have been exchanged since.
    client.request(Body::Hello)?;
    let identity = client.identity();
    let text = format!(
        "{board}, firmware {firmware}, protocol {protocol}\ncontrol at {rate} Hz in {number}, {tick} ticks since the start",
        board = identity.board,
        firmware = identity.firmware,
        protocol = identity.protocol,
        rate = identity.rate_hz,
        number = name(&identity.number),
        tick = identity.tick,
    );
    Ok(Answer::new(text, json!(identity)))
}

pub(super) fn status(client: &mut Client) -> anyhow::Result<Answer> {
    let status = client.status()?;
    let inputs = client.inputs()?;
    let learning = client.learning()?;
    let mut text = status_text(
        &status,
        client.identity().rate_hz,
        client.identity().cycle_hz,
    );
    for line in learnt::lines(&learning) {
        let _ = write!(text, "\n{line}");
    }
    let active = inputs::active(&inputs);
    if !active.is_empty() {
        let _ = write!(text, "\nactive inputs: {}", active.join(", "));
    }
    if let Some(refusal) = inputs::refusal(&inputs) {
        let _ = write!(text, "\n{refusal}");
    }
    let mut data = json!(status);
    // Names instead of the wire's bits.
    let homed = status.homed.iter().map(message::AxisName::as_str);
    data["homed"] = json!(homed.collect::<Vec<_>>());
    for (index, axis) in AxisName::ALL.into_iter().enumerate() {
        data["axes"][index]["axis"] = json!(axis.as_str());
        data["axes"][index]["limited_by"] = json!(name(&status.axes[index].limited_by));
    }
    data["learning"] = learnt::data(&learning);
    data["inputs"] = json!(active);
    data["refusal"] = json!(inputs.refusal);
    Ok(Answer::new(text, data))
}

/// The axes as a table of 80 columns, its heads first.
pub(super) fn axis_lines(status: &Status) -> Vec<String> {
    let mut lines = vec![
        "axis  homed  follows   position mm   error um  output V  limited by    high mark"
            .to_owned(),
    ];
    for (axis, seen) in AxisName::ALL.into_iter().zip(&status.axes) {
        lines.push(format!(
            "{axis:<4}  {homed:<5}  {mode:<8}  {position:>11}  {error:>9}  {output:>8}  {limit:<12}  {mark:>9.3}",
            axis = axis.as_str(),
            homed = if status.homed.contains(Translated::translated(axis)) {
                "yes"
            } else {
                "no"
            },
            mode = name(&seen.mode),
            position = fixed(seen.position_mm, 4),
            error = fixed(f64::from(1e3 * seen.error_mm), 2),
            output = fixed(f64::from(seen.output_v), 4),
            limit = name(&seen.limited_by),
            mark = seen.high_mark,
        ));
    }
    lines
}

/// The name of a fault, with a space before it; nothing of one of a later release.
pub(super) fn fault_name(code: u8) -> String {
    FaultCode::from_number(code).map_or_else(String::new, |fault| format!(" {}", fault.name()))
}

fn status_text(status: &Status, rate_hz: f64, cycle_hz: u32) -> String {
    let mut text = format!(
        "{state}{fault}, {motion}; tick {tick} ({time:.4} s)\n",
        state = status.state.as_str(),
        fault = status
            .fault
            .map(|code| format!(" {code}{} (`fault` says more)", fault_name(code)))
            .unwrap_or_default(),
        motion = if status.running { "moving" } else { "at rest" },
        tick = status.tick,
        time = f64::from(status.tick) / rate_hz,
    );
    for line in axis_lines(status) {
        let _ = writeln!(text, "{line}");
    }
    // A simulated machine measures no time.
    if cycle_hz > 0 {
        let _ = write!(
            text,
            "longest tick {:.2} us, {} overruns; ",
            1e6 * f64::from(status.longest_tick_cycles) / f64::from(cycle_hz),
            status.overruns,
        );
    }
    let _ = writeln!(text, "capture {}", name(&status.capture));
    let frames = status.frames;
    let _ = write!(
        text,
        "link {good} good frames, {bad} bad; dropped {samples} samples, {events} events",
        good = frames.good,
        bad = frames
            .damaged
            .wrapping_add(frames.overlong)
            .wrapping_add(frames.undecodable),
        samples = status.dropped_samples,
        events = status.dropped_events,
    );
    text
}

pub(super) fn fault(client: &mut Client) -> anyhow::Result<Answer> {
    let Some(fault) = client.fault()? else {
        return Ok(Answer::new("no fault", json!(null)));
    };
    let axis = fault
        .axis
        .map(|axis| format!(" of {axis}"))
        .unwrap_or_default();
    let trace = if fault.captured {
        "\ntrace: captured; `capture read --out FILE` fetches it"
    } else {
        ""
    };
    let text = format!(
        "fault {code} {name}{axis} at tick {tick}\ncause: {cause}\nremedy: {remedy}{trace}",
        code = fault.code,
        name = fault.name,
        tick = fault.tick,
        cause = fault.cause,
        remedy = with_reset(&fault.remedy),
    );
    Ok(Answer::new(text, json!(fault)))
}

pub(super) fn order(client: &mut Client, command: &Command) -> anyhow::Result<Answer> {
    let body = match command {
        Command::Reset => Body::ResetFault,
        Command::Enable => Body::Enable,
        Command::Disable => Body::Disable,
        Command::Stop => Body::Stop,
        Command::Home { axes } => Body::Home(to_home(client, axes)?),
        Command::Move {
            axis,
            target_mm,
            velocity,
        } => Body::Move {
            axis: (*axis).into(),
            target_mm: *target_mm,
            velocity_mm_s: *velocity,
        },
        Command::Jog {
            axis,
            velocity_mm_s,
        } => Body::Jog {
            axis: (*axis).into(),
            velocity_mm_s: *velocity_mm_s,
        },
        Command::Spindle { rpm } => Body::Spindle { rpm: *rpm },
        Command::Run => Body::Run,
        Command::Reboot => Body::Reboot,
        other => bail!("{}: not an order", other.name()),
    };
    client.order(body)?;
    let text = match command {
        Command::Reset => "the fault is cleared; the outputs are off",
        Command::Enable => "the outputs are on; the axes hold",
        Command::Home { axes } => &homing(axes),
        Command::Run => "the plan begins; `wait rest` waits for its end",
        Command::Reboot => {
            client.restarted()?;
            RESTARTED
        }
        _ => "",
    };
    Ok(Answer::new(text, json!("done")))
}

/// Says what waits for the end of homing these axes; without any, of all.
fn homing(axes: &[Axis]) -> String {
    let axes = axes.iter().map(|axis| format!(" {}", axis.name()));
    format!(
        "homing; `wait homed{}` waits for its end",
        axes.collect::<String>()
    )
}

/// The axes that are to be homed; where none is named, those that are commissioned and have a homing.
fn to_home(client: &mut Client, axes: &[Axis]) -> anyhow::Result<AxisSet> {
    if !axes.is_empty() {
        return Ok(axes.iter().copied().map(Into::into).collect());
    }
    let mut ready = Vec::new();
    for axis in AxisName::ALL {
        let mut get = |part: &str| settings::get(client, &whole_path(&format!("{axis}/{part}")));
        if get("commissioned")? == json!(true) && get("homing")? != json!(null) {
            ready.push(axis);
        }
    }
    // The machine says why none of them can.
    Ok(match ready.is_empty() {
        true => AxisSet::ALL,
        false => ready.into_iter().map(Translated::translated).collect(),
    })
}

pub(super) fn wait(
    client: &mut Client,
    what: &str,
    axes: &[Axis],
    timeout: f64,
) -> anyhow::Result<Answer> {
    let timeout = seconds("--timeout", timeout)?;
    if !axes.is_empty() && what != "homed" {
        bail!("wait {what}: axes belong behind `homed`");
    }
    match what {
        "rest" => {
            settle::rest(client, timeout)?;
        }
        "homed" => {
            let axes = to_home(client, axes)?;
            settle::homed(client, axes, timeout)?;
        }
        number => match number.parse() {
            Ok(time_s) => settle::time(client, seconds("wait", time_s)?)?,
            Err(_) => bail!("wait {number}: give seconds, `rest` or `homed`"),
        },
    }
    Ok(Answer::done())
}
