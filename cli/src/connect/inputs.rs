//! The machine's digital inputs.

use std::time::Duration;

use quadrant_host::machine::simulated_io::INPUTS;
use quadrant_law::safety::Switches;
use quadrant_link::message::{AxisName, Inputs};
use serde_json::{Value, json};

use super::answer::{Answer, seconds};
use super::session::Session;

/// Time from one look to the next.
const LOOK: Duration = Duration::from_millis(20);

/// Says how the inputs are, and for some seconds what changes.
pub(super) fn run(session: &mut Session, time_s: f64) -> anyhow::Result<Answer> {
    let due = session.client.now() + seconds("inputs", time_s)?;
    let mut seen = session.client.inputs()?;
    while session.client.now() < due {
        session.client.wait(LOOK)?;
        let now = session.client.inputs()?;
        let rate_hz = session.client.identity().rate_hz;
        for (name, switches) in INPUTS {
            let [before, after] = [&seen, &now].map(|inputs| is_active(inputs, switches));
            if before != after {
                let state = if after { "active" } else { "released" };
                let time_s = f64::from(now.tick) / rate_hz;
                session.printer.result(
                    "inputs",
                    &format!("{time_s:>12.4} s  {name} {state}"),
                    &json!({ "tick": now.tick, "input": name, "active": after }),
                );
            }
        }
        seen = now;
    }
    Ok(Answer::new(text(&seen), data(&seen)))
}

fn is_active(inputs: &Inputs, switches: Switches) -> bool {
    inputs.switches & switches.bits() != 0
}

/// The names of the active inputs.
pub(super) fn active(inputs: &Inputs) -> Vec<&'static str> {
    INPUTS
        .into_iter()
        .filter(|(_, switches)| is_active(inputs, *switches))
        .map(|(name, _)| name)
        .collect()
}

fn indexed(inputs: &Inputs) -> Vec<&'static str> {
    inputs.indexed.iter().map(AxisName::as_str).collect()
}

fn text(inputs: &Inputs) -> String {
    let width = INPUTS.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let mut lines: Vec<String> = INPUTS
        .into_iter()
        .map(|(name, switches)| {
            let state = if is_active(inputs, switches) {
                "ACTIVE"
            } else {
                "-"
            };
            format!("{name:<width$}  {state}")
        })
        .collect();
    let pulses = indexed(inputs);
    lines.push(if pulses.is_empty() {
        "no index pulse was seen".to_owned()
    } else {
        format!("index pulses were seen on {}", pulses.join(", "))
    });
    lines.push(refusal(inputs).unwrap_or_else(|| "nothing keeps the outputs off".to_owned()));
    lines.join("\n")
}

/// The reason for which the outputs would not be enabled, as a line.
pub(super) fn refusal(inputs: &Inputs) -> Option<String> {
    let refusal = inputs.refusal.as_ref()?;
    Some(format!("`enable` would be refused: {refusal}"))
}

fn data(inputs: &Inputs) -> Value {
    json!({
        "tick": inputs.tick,
        "active": active(inputs),
        "indexed": indexed(inputs),
        "refusal": inputs.refusal,
    })
}
