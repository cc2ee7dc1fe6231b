//! Load on the firmware's link and capture.

use anyhow::{Result, anyhow, ensure};
use quadrant_link::frame::{self, FRAME_BYTES};
use quadrant_link::message::{
    AxisName, AxisSignal, Body, Channel, MAX_CHANNELS, Request, TelemetryRequest,
};

use crate::faults::fixture::Fixture;

/// As many channels as there may be.
pub(crate) fn busy_channels() -> impl Iterator<Item = Channel> {
    [AxisSignal::Error, AxisSignal::Output, AxisSignal::Position]
        .into_iter()
        .flat_map(|signal| AxisName::ALL.map(|axis| Channel::Axis(axis, signal)))
        .take(MAX_CHANNELS)
}

/// Asks for all of them, in every tick.
pub(crate) fn select_telemetry(fixture: &mut Fixture) -> Result<()> {
    fixture.done(Body::Telemetry(TelemetryRequest::Select {
        channels: busy_channels().collect(),
        decimation: 1,
    }))
}

/// Keeps the host's port full of status requests and garbage.
pub(crate) fn flood(fixture: &mut Fixture) -> Result<()> {
    while fixture.unsent() < 2 * FRAME_BYTES {
        let bytes = requests_and_garbage(fixture.tick())?;
        fixture.send_bytes(&bytes);
    }
    Ok(())
}

/// Returns an error unless the firmware has taken a byte and more a tick since `before` of them had been [sent](Fixture::sent).
pub(crate) fn ensure_flooded(fixture: &Fixture, before: u32, ticks: u32) -> Result<()> {
    let taken = fixture.sent().wrapping_sub(before);
    ensure!(
        taken > ticks,
        "only {taken} bytes in {ticks} ticks are no load"
    );
    Ok(())
}

/// A few requests and some garbage, which depends on the tick.
fn requests_and_garbage(tick: u32) -> Result<Vec<u8>> {
    let mut buffer = [0; FRAME_BYTES];
    let request = Request {
        id: tick as u16,
        body: Body::Status,
    };
    let frame = frame::encode(&request, &mut buffer).map_err(|error| anyhow!("{error}"))?;
    let mut bytes = frame.repeat(8);
    let mut noise = tick | 1;
    for _ in 0..256 {
        noise ^= noise << 13;
        noise ^= noise >> 17;
        noise ^= noise << 5;
        bytes.push(noise as u8);
    }
    bytes.push(frame::DELIMITER);
    Ok(bytes)
}
