//! Streams of a host at the rate of the machine's time, and the machine's reaction when they stop.

use anyhow::{Context, Result, bail, ensure};
use quadrant_law::units::DacCode;
use quadrant_link::message::AxisName;
use quadrant_link::message::{
    Body, INJECT_VALUES, InjectRequest, InjectStatus, Reply, SetPoint, StreamRequest, Voltages,
};

use super::approach::{LONGEST, enabled};
use super::fixture::Fixture;

/// Ticks from a set point of a stream to the next.
const STREAM_TICKS: u16 = 100;
/// The same for one whose host falls silent: what it has sent lasts longer than the firmware's patience.
const LONG_STREAM_TICKS: u16 = 1_000;
/// Set points that a stream gets before it gets no more.
const SET_POINTS: u32 = 15;
/// Values that an injection gets before it gets no more: enough for it to begin.
const VALUES: u16 = 768;

/// A stream whose set points last longer than the firmware's patience with a host that falls silent; gives the tick after
/// the last request.
pub(crate) fn unfinished_stream(fixture: &mut Fixture) -> Result<u32> {
    streaming(fixture, LONG_STREAM_TICKS)
}

/// A small voltage that nobody goes on with; gives the tick in which the next value is due.
pub(crate) fn injection_without_end(fixture: &mut Fixture) -> Result<u32> {
    let started = injecting(fixture, 0.1, 10.0)?;
    Ok(started + u32::from(VALUES))
}

/// A stream in which x goes faster and faster, with all the set points there is room for; gives the tick after the last
/// request.
fn streaming(fixture: &mut Fixture, period_ticks: u16) -> Result<u32> {
    enabled(fixture)?;
    fixture.done(Body::Stream(StreamRequest::Open { period_ticks }))?;
    let mut sequence = 0;
    let mut asked = fixture.tick();
    while sequence < SET_POINTS {
        let points = (sequence..(sequence + 5).min(SET_POINTS))
            .map(|number| set_point(number + 1, period_ticks))
            .collect();
        asked = fixture.tick();
        let reply = fixture.reply(Body::Stream(StreamRequest::Points {
            sequence,
            points,
            last: false,
        }))?;
        let Reply::Stream(status) = reply else {
            bail!("not the stream's status: {reply:?}")
        };
        ensure!(status.next_sequence > sequence, "no room: {status:?}");
        sequence = status.next_sequence;
    }
    Ok(asked)
}

/// Uniform acceleration of x to 2 mm/s within the last set point.
fn set_point(number: u32, period_ticks: u16) -> SetPoint {
    let time_s = |number: u32| f64::from(number) * f64::from(period_ticks) / 1e4;
    let acceleration = 2.0 / time_s(SET_POINTS);
    let time = time_s(number);
    let mut point = SetPoint::default();
    point.axes[0].position_mm = 0.5 * acceleration * time * time;
    point.axes[0].velocity_mm_s = (acceleration * time) as f32;
    point.axes[0].acceleration_mm_s2 = acceleration as f32;
    point
}

/// A stream without a host that goes on with it; gives the tick in which the next set point is due.
pub(crate) fn underrunning(fixture: &mut Fixture) -> Result<u32> {
    streaming(fixture, STREAM_TICKS)?;
    if fixture.streams_since().is_none() {
        fixture.run_until(LONGEST, "the stream's start", |fixture| {
            fixture.streams_since().is_some()
        })?;
    }
    let started = fixture.streams_since().context("it has started")?;
    Ok(started + SET_POINTS * u32::from(STREAM_TICKS))
}

/// A voltage on x in open loop, with few values; gives the tick of the first.
pub(crate) fn injecting(fixture: &mut Fixture, voltage_v: f64, travel_mm: f64) -> Result<u32> {
    enabled(fixture)?;
    fixture.reply(Body::Inject(InjectRequest::Open {
        axis: AxisName::X,
        open_loop: true,
        with_plan: false,
        limit_v: 2.0,
        travel_mm,
        max_velocity_mm_s: 100.0,
    }))?;
    let code = (voltage_v / 10.0 * DacCode::FULL_SCALE) as i16;
    let mut status = InjectStatus::default();
    while status.next_sequence < VALUES.into() {
        let rest = usize::from(VALUES) - status.next_sequence as usize;
        let reply = fixture.reply(Body::Inject(InjectRequest::Values {
            sequence: status.next_sequence,
            values: Voltages::new(std::iter::repeat_n(code, rest.min(INJECT_VALUES))),
            last: false,
        }))?;
        let Reply::Inject(now) = reply else {
            bail!("not the injection's status: {reply:?}")
        };
        status = now;
    }
    while status.first_tick.is_none() {
        let ask = InjectRequest::Values {
            sequence: status.next_sequence,
            values: Voltages::default(),
            last: false,
        };
        if let Reply::Inject(now) = fixture.reply(Body::Inject(ask))? {
            status = now;
        }
    }
    status.first_tick.context("it has begun")
}
