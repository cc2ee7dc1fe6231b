//! Waiting for the machine.

use std::time::Duration;

use quadrant_link::message::{AxisMode, AxisName, AxisSet, MachineState, Status};

use super::error::ClientError;
use super::session::Client;

/// Time in which an order that was acknowledged has reached the control law.
const ARRIVAL: Duration = Duration::from_millis(20);
/// Time from one look at the machine to the next.
const LOOK: Duration = Duration::from_millis(20);

/// Waits until no motion is under way.
///
/// # Errors
/// A fault, a motion that has not ended after `timeout`, or a connection that is broken.
pub fn rest(client: &mut Client, timeout: Duration) -> Result<Status, ClientError> {
    until(
        client,
        "wait rest",
        timeout,
        "the motion has not ended; `stop` ends it",
        Status::is_at_rest,
    )
}

/// Waits until axes are homed.
///
/// # Errors
/// A fault, homing that was given up or has not ended after `timeout`, or a connection that is broken.
pub fn homed(client: &mut Client, axes: AxisSet, timeout: Duration) -> Result<Status, ClientError> {
    // An axis knows where it is before it has moved to where homing ends.
    let homing = |status: &Status| {
        let mut modes = axes.iter().map(|axis| status.axes[axis as usize].mode);
        modes.any(|mode| mode == AxisMode::Home)
    };
    let status = until(
        client,
        "wait homed",
        timeout,
        "homing has not ended; check that the switch is reached, `stop` ends it",
        |status| !homing(status),
    )?;
    let missing = axes.iter().filter(|axis| !status.homed.contains(*axis));
    let missing: Vec<&str> = missing.map(AxisName::as_str).collect();
    match missing.is_empty() {
        true => Ok(status),
        false => Err(ClientError::NotHoming {
            axes: missing.join(", "),
        }),
    }
}

/// Lets time pass.
///
/// # Errors
/// A fault that is reported meanwhile, or a connection that is broken.
pub fn time(client: &mut Client, time: Duration) -> Result<(), ClientError> {
    client.act_on_reported();
    client.wait(time)?;
    client.refuse_reported("wait")
}

/// Looks at the machine until a condition holds. Axes that brake for a fault have it latched when they stand.
fn until(
    client: &mut Client,
    what: &'static str,
    timeout: Duration,
    remedy: &'static str,
    mut is_so: impl FnMut(&Status) -> bool,
) -> Result<Status, ClientError> {
    let due = client.now() + timeout;
    client.wait(ARRIVAL)?;
    loop {
        let status = client.status()?;
        client.refuse_fault(what, &status)?;
        client.refuse_reported(what)?;
        if status.state != MachineState::Stopping && is_so(&status) {
            return Ok(status);
        }
        if client.now() >= due {
            return Err(ClientError::TimedOut {
                what,
                waited_s: timeout.as_secs_f64(),
                remedy,
            });
        }
        client.wait(LOOK)?;
    }
}
