//! A part program as set points, and sending them in time.

use std::time::Duration;

use heapless::Vec as Bounded;
use quadrant_gcode::{Trajectory, Vector};
use quadrant_link::message::{
    AxisPoint, Body, Reply, STREAM_POINTS, SetPoint, Status, StreamRequest, StreamStatus,
};

use super::error::ClientError;
use super::session::Client;

/// Set points at rest after the last one that moves.
const REST_POINTS: usize = 2;

/// Pause before a full buffer is asked again.
const PAUSE: Duration = Duration::from_millis(2);

/// The set points of a trajectory, one every `period_ticks` control ticks, the first of them one period after the start;
/// `origin_mm` is added to all positions. They end at rest.
pub fn set_points(
    trajectory: &Trajectory,
    rate_hz: f64,
    period_ticks: u16,
    origin_mm: [f64; 3],
) -> Vec<SetPoint> {
    // At the control rate, so that a difference of velocities is an acceleration.
    let (velocities, positions): (Vec<Vector>, Vec<Vector>) = trajectory
        .places(rate_hz)
        .map(|place| {
            let tangent = trajectory.moves()[place.index]
                .segment
                .tangent(place.along_mm);
            (tangent * place.speed_mm_s, trajectory.point(&place))
        })
        .unzip();
    let Some(last) = positions.len().checked_sub(1) else {
        return Vec::new();
    };
    let at = |tick: usize| {
        let before = velocities[tick.saturating_sub(1)];
        let after = velocities[(tick + 1).min(last)];
        let acceleration = (after - before) * (0.5 * rate_hz);
        point(
            &positions[tick],
            &velocities[tick],
            &acceleration,
            origin_mm,
        )
    };
    let end = point(
        &positions[last],
        &Vector::zeros(),
        &Vector::zeros(),
        origin_mm,
    );
    let period = usize::from(period_ticks.max(1));
    (period..last)
        .step_by(period)
        .map(at)
        .chain(std::iter::repeat_n(end, REST_POINTS))
        .collect()
}

fn point(
    position: &Vector,
    velocity: &Vector,
    acceleration: &Vector,
    origin_mm: [f64; 3],
) -> SetPoint {
    SetPoint {
        axes: std::array::from_fn(|axis| AxisPoint {
            position_mm: origin_mm[axis] + position[axis],
            velocity_mm_s: velocity[axis] as f32,
            acceleration_mm_s2: acceleration[axis] as f32,
        }),
    }
}

/// Returns the references of resting axes, mm: the origin of a part program.
pub fn references_mm(status: &Status) -> [f64; 3] {
    status
        .axes
        .map(|axis| axis.position_mm + f64::from(axis.error_mm))
}

/// Sends set points as fast as the machine has room for them. `progress` receives how many have been sent, and may let other
/// things happen to the client. The motion ends after this, when the last of them is reached. A stream that fails is closed, and
/// the axes brake: nothing of it waits in the machine.
///
/// # Errors
/// A set point that the machine refuses, a fault, or a connection that is broken.
pub fn stream(
    client: &mut Client,
    points: &[SetPoint],
    period_ticks: u16,
    progress: &mut dyn FnMut(&mut Client, usize) -> Result<(), ClientError>,
) -> Result<(), ClientError> {
    let opened = ask(client, StreamRequest::Open { period_ticks });
    // Of a stream that was not begun there is nothing to close, and what moves is somebody else's.
    if matches!(
        opened,
        Err(ClientError::Refused { .. } | ClientError::Fault { .. })
    ) {
        return opened.map(|_| ());
    }
    let sent = opened.and_then(|status| send(client, points, status, progress));
    if sent.is_err() {
        // The first error says more than that this fails, too.
        let _ = client.request(Body::Stream(StreamRequest::Close));
    }
    sent
}

/// Sends the set points of a stream that is open.
fn send(
    client: &mut Client,
    points: &[SetPoint],
    mut status: StreamStatus,
    progress: &mut dyn FnMut(&mut Client, usize) -> Result<(), ClientError>,
) -> Result<(), ClientError> {
    let mut silent = 0_u32;
    while (status.next_sequence as usize) < points.len() {
        let sent = status.next_sequence as usize;
        let room = usize::from(status.free).min(STREAM_POINTS);
        let end = points.len().min(sent + room);
        status = ask(
            client,
            StreamRequest::Points {
                sequence: status.next_sequence,
                // An empty list only asks how much room there is.
                points: Bounded::from_slice(&points[sent..end]).unwrap_or_default(),
                last: end == points.len(),
            },
        )?;
        if status.next_sequence as usize > sent {
            silent = 0;
        } else {
            client.wait(PAUSE)?;
            silent += 1;
            if silent.is_multiple_of(50) {
                let machine = client.status()?;
                client.refuse_fault("stream", &machine)?;
            }
            if silent > 5000 {
                return Err(ClientError::TimedOut {
                    what: "stream",
                    waited_s: PAUSE.as_secs_f64() * f64::from(silent),
                    remedy: "the machine takes no more set points; look at `status`",
                });
            }
        }
        progress(client, status.next_sequence as usize)?;
    }
    Ok(())
}

fn ask(client: &mut Client, request: StreamRequest) -> Result<StreamStatus, ClientError> {
    match client.request(Body::Stream(request)) {
        Ok(Reply::Stream(status)) => Ok(status),
        Ok(other) => Err(client.unexpected("stream", &other)),
        Err(error) => {
            // A stream that was refused because of a fault: the fault says more.
            let status = client.status()?;
            client.refuse_fault("stream", &status)?;
            Err(error)
        }
    }
}
