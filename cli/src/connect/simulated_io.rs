//! Inputs, supply and log of a machine that is not real.

use anyhow::{Context, bail};
use quadrant_host::client::Client;
use quadrant_host::machine::simulated_io::{INPUTS, SimulatedIo, without};
use quadrant_law::safety::Switches;
use serde_json::json;

use super::answer::{Answer, RESTARTED};
use super::session::Session;

pub(super) fn press(session: &mut Session, names: &[String]) -> anyhow::Result<Answer> {
    let pressed = session.pressed.with(named(names));
    hold(session, "press", pressed)
}

/// Without names, lets go of all.
pub(super) fn release(session: &mut Session, names: &[String]) -> anyhow::Result<Answer> {
    let pressed = if names.is_empty() {
        Switches::NONE
    } else {
        without(session.pressed, named(names))
    };
    hold(session, "release", pressed)
}

fn hold(session: &mut Session, what: &str, pressed: Switches) -> anyhow::Result<Answer> {
    simulated_io(&mut session.client, what)?.press(pressed);
    session.pressed = pressed;
    let held: Vec<&str> = INPUTS
        .into_iter()
        .filter(|(_, switches)| pressed.bits() & switches.bits() != 0)
        .map(|(name, _)| name)
        .collect();
    let text = if held.is_empty() {
        "all inputs are released".to_owned()
    } else {
        format!("pressed: {}", held.join(", "))
    };
    Ok(Answer::new(text, json!({ "pressed": held })))
}

/// All inputs of these names.
fn named(names: &[String]) -> Switches {
    INPUTS
        .into_iter()
        .filter(|(name, _)| names.iter().any(|named| named == name))
        .fold(Switches::NONE, |all, (_, switches)| all.with(switches))
}

pub(super) fn power_cycle(client: &mut Client) -> anyhow::Result<Answer> {
    simulated_io(client, "power-cycle")?
        .power_cycle()
        .context("power-cycle")?;
    client.restarted()?;
    Ok(Answer::new(RESTARTED, json!("done")))
}

fn simulated_io<'a>(client: &'a mut Client, what: &str) -> anyhow::Result<&'a mut dyn SimulatedIo> {
    let endpoint = client.endpoint();
    match client.simulated_io() {
        Some(io) => Ok(io),
        None => bail!(
            "{what}: {endpoint} has no simulated inputs; do it yourself, or try it with --simulated or --emulated"
        ),
    }
}
