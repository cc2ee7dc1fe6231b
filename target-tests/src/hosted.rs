//! Ticks of a machine with a host at its link: homed axes that follow a stream, reverse, are watched by a capture, stop, and jog to
//! the end of their travel.

use anyhow::{Context, Result, bail, ensure};
use quadrant_law::command::Command;
use quadrant_link::message::{
    AxisName, AxisSignal, Body, CaptureRequest, Channel, Edge, Level, Reply, SetPoint,
    StreamRequest, Trigger,
};

use crate::faults::approach::{LONGEST, SPEED_MM_S, homed};
use crate::faults::case::configuration;
use crate::faults::fixture::{A_WHILE, Configuration, Fixture};
use crate::load;
use crate::near_home::{self, PARK_MM};
use crate::trace::{Tick, Trace, Tracer};
use crate::traced_run;
use xtask::image::Image;

/// Ticks of one kind, one after the other.
type Kind = (&'static str, Vec<Tick>);

/// Ticks of a stream from one set point to the next.
const STREAM_TICKS: u16 = 50;
/// Set points of a stream: as many as there is room for.
const SET_POINTS: u32 = 15;
/// Distance that the stream goes and comes back, mm.
const STREAM_MM: f64 = 0.25;
/// Ticks of the stream that are traced.
const STREAMED: u32 = 250;
/// Ticks from the end of a segment on that are of the change: the next one is adopted, and then the one after it from the queue.
const CHANGE_TICKS: u32 = 2;

/// Velocity at whose crossing a capture triggers, mm/s.
const TRIGGER_MM_S: f64 = 15.0;
/// Share of the capture that comes before its trigger, %.
const BEFORE_PERCENT: u8 = 99;
/// Ticks from the trigger on until the capture is full: the rest of 256.
const FILLING_TICKS: u32 = 3;
/// Velocity at which tracing of a trigger begins, mm/s, and the ticks traced: the motion loses 0.09 mm/s a tick.
const BEFORE_TRIGGER: (f64, u32) = (TRIGGER_MM_S + 3.0, 50);
/// The same of a reversal: its reference is a dead time, some 13 ticks, ahead.
const BEFORE_REVERSAL: (f64, u32) = (3.0, 200);
/// Ticks of a controlled stop that are traced.
const STOPPED: u32 = 50;

/// Velocity of the jog, mm/s.
const JOG_MM_S: f64 = 200.0;
/// Position of x from which on the jog is traced, mm, for as many ticks: a stop at the largest velocity would end beyond the
/// travel.
const END_OF_TRAVEL: (f64, u32) = (193.0, 200);

/// Runs the image with a host; its ticks by kind.
pub(crate) fn traced(image: &Image) -> Result<Vec<Kind>> {
    let trace = Trace::of(image)?;
    let mut kinds = Vec::new();
    let ticks = traced_run::run(
        image,
        homed_configuration(),
        |memory| trace.start(image, memory),
        |fixture, tracer| {
            let mut run = Run {
                fixture,
                tracer,
                kinds: Vec::new(),
                traced: 0,
            };
            run.stream()?;
            run.slow_down_and_reverse()?;
            run.stop()?;
            run.jog_to_the_end()?;
            kinds = run.kinds;
            run.fixture.end().map(drop)
        },
        |lines| trace.read(image, lines),
    )?;
    let tick = |index: usize| ticks.get(index).context("the trace ends too early");
    kinds
        .into_iter()
        .map(|(name, indices)| {
            let of_kind: Result<_> = indices
                .into_iter()
                .map(|i| tick(i)?.whole().cloned())
                .collect();
            Ok((name, of_kind?))
        })
        .collect()
}

/// The configuration of the faults, with a short way to the reference mark.
pub(crate) fn homed_configuration() -> Configuration {
    let mut configuration = configuration();
    configuration.marks = near_home::prepare(&mut configuration.job.stage);
    configuration
}

/// A run under the trace.
struct Run<'a> {
    fixture: Fixture,
    tracer: &'a mut Tracer,
    /// Indices of the traced ticks that are of each kind.
    kinds: Vec<(&'static str, Vec<usize>)>,
    /// Ticks traced so far.
    traced: usize,
}

impl Run<'_> {
    /// Traces the next ticks; returns the first one's index.
    fn trace(&mut self, ticks: u32) -> Result<usize> {
        let first = self.traced;
        self.tracer.trace()?;
        // The interrupt of the last tick may not have returned yet.
        self.fixture.run(ticks + 1)?;
        self.tracer.pause()?;
        self.traced += ticks as usize + 1;
        Ok(first)
    }

    /// Traces the next ticks, all of a kind.
    fn trace_kind(&mut self, name: &'static str, ticks: u32) -> Result<()> {
        let first = self.trace(ticks)?;
        self.kinds
            .push((name, (first..first + ticks as usize).collect()));
        Ok(())
    }

    /// A stream of all axes from where they park, there and back.
    fn stream(&mut self) -> Result<()> {
        homed(&mut self.fixture)?;
        self.fixture.done(Body::Stream(StreamRequest::Open {
            period_ticks: STREAM_TICKS,
        }))?;
        let mut sequence = 0;
        while sequence < SET_POINTS {
            let end = (sequence + 5).min(SET_POINTS);
            let reply = self.fixture.reply(Body::Stream(StreamRequest::Points {
                sequence,
                points: (sequence..end)
                    .map(|number| set_point(number + 1))
                    .collect(),
                last: end == SET_POINTS,
            }))?;
            let Reply::Stream(status) = reply else {
                bail!("not the stream's status: {reply:?}")
            };
            ensure!(status.next_sequence > sequence, "no room: {status:?}");
            sequence = status.next_sequence;
        }
        self.fixture
            .run_until(LONGEST, "the stream's start", |fixture| {
                fixture.streams_since().is_some()
            })?;
        let since = self.fixture.streams_since().context("it has started")?;
        // The tick after the one that starts the stream takes the first step.
        let from = self.fixture.tick() - (since + 1);
        ensure!(
            from + STREAMED < SET_POINTS * u32::from(STREAM_TICKS),
            "the stream is traced from its tick {from} on: that is too late"
        );
        let first = self.trace(STREAMED)?;
        let changes = |tick: &u32| (from + tick) % u32::from(STREAM_TICKS) < CHANGE_TICKS;
        let index = |tick: u32| first + tick as usize;
        let (changing, going): (Vec<u32>, Vec<u32>) = (0..STREAMED).partition(changes);
        for (name, ticks) in [("stream", going), ("segment change", changing)] {
            self.kinds
                .push((name, ticks.into_iter().map(index).collect()));
        }
        self.rest()
    }

    /// Sines of all axes: a capture triggers while they slow down, and then they reverse.
    fn slow_down_and_reverse(&mut self) -> Result<()> {
        self.full_speed()?;
        // The ring is the one that waits for a fault.
        self.fixture.reply(Body::Capture(CaptureRequest::Disarm))?;
        self.fixture.run(A_WHILE)?;
        self.arm(Trigger::Level(Level {
            channel: Channel::Axis(AxisName::X, AxisSignal::Velocity),
            edge: Edge::Falling,
            level: TRIGGER_MM_S,
        }))?;
        let (velocity_mm_s, ticks) = BEFORE_TRIGGER;
        self.slower_than(velocity_mm_s)?;
        let from = self.fixture.tick();
        let first = self.trace(ticks)?;
        let triggered = self.triggered()?;
        ensure!(
            (from..=from + ticks - FILLING_TICKS).contains(&triggered),
            "the capture has triggered in tick {triggered}, and {ticks} from {from} on are traced"
        );
        let first = first + (triggered - from) as usize;
        let filling = first..first + FILLING_TICKS as usize;
        self.kinds.push(("capture triggers", filling.collect()));
        self.arm(Trigger::Fault)?;
        let (velocity_mm_s, ticks) = BEFORE_REVERSAL;
        self.slower_than(velocity_mm_s)?;
        self.trace_kind("reversal", ticks)
    }

    /// Arms the capture with as many channels as there may be.
    fn arm(&mut self, trigger: Trigger) -> Result<()> {
        let request = CaptureRequest::Arm {
            channels: load::busy_channels().collect(),
            decimation: 1,
            pre_trigger_percent: BEFORE_PERCENT,
            trigger,
        };
        self.fixture.reply(Body::Capture(request)).map(drop)
    }

    /// The tick in which the capture, which is full, has triggered; ticks count from zero.
    fn triggered(&mut self) -> Result<u32> {
        let reply = self.fixture.reply(Body::Capture(CaptureRequest::State))?;
        let Reply::Capture(status) = reply else {
            bail!("not the capture's status: {reply:?}")
        };
        let record = status.record.context("the capture is not full")?;
        // The firmware's first tick is number 1.
        Ok(record.trigger_tick - 1)
    }

    /// The controlled stop of all axes from full speed.
    fn stop(&mut self) -> Result<()> {
        self.full_speed()?;
        self.fixture.inject(Box::new(|input, _, since| {
            input.request = (since == 0).then_some(Command::Stop);
        }));
        self.trace_kind("stop", STOPPED)?;
        self.rest()
    }

    /// A jog of all axes to the end of their travel.
    fn jog_to_the_end(&mut self) -> Result<()> {
        for axis in AxisName::ALL {
            self.fixture.done(Body::Jog {
                axis,
                velocity_mm_s: JOG_MM_S,
            })?;
        }
        let (position_mm, ticks) = END_OF_TRAVEL;
        while self.fixture.plant().axes()[0].position_mm() < position_mm {
            // A jog goes on only while its host asks something.
            let status = self.fixture.status()?;
            ensure!(status.running, "the jog has ended: {status:?}");
        }
        self.trace_kind("jog, end of travel", ticks)
    }

    /// Runs the plan until x goes at full speed, once more if it does already.
    fn full_speed(&mut self) -> Result<()> {
        if !self.fixture.status()?.running {
            self.fixture.done(Body::Run)?;
        }
        self.fixture.run_until(LONGEST, "full speed", |fixture| {
            fixture.plant().axes()[0].velocity_mm_s() > 0.97 * SPEED_MM_S
        })
    }

    fn slower_than(&mut self, velocity_mm_s: f64) -> Result<()> {
        self.fixture
            .run_until(LONGEST, "a lower velocity", |fixture| {
                fixture.plant().axes()[0].velocity_mm_s() < velocity_mm_s
            })
    }

    /// Waits until no axis moves.
    fn rest(&mut self) -> Result<()> {
        for _ in 0..LONGEST / 100 {
            self.fixture.run(100)?;
            let status = self.fixture.status()?;
            ensure!(status.fault.is_none(), "a fault: {status:?}");
            if !status.running {
                return Ok(());
            }
        }
        bail!("the motion never ends")
    }
}

/// A set point of all axes: there and back by [`STREAM_MM`] along `64 (u - u^2)^3`, from rest to rest.
fn set_point(number: u32) -> SetPoint {
    let duration_s = f64::from(SET_POINTS * u32::from(STREAM_TICKS)) / 1e4;
    let u = f64::from(number) / f64::from(SET_POINTS);
    let (hump, slope) = (u * (1.0 - u), 1.0 - 2.0 * u);
    let scale = 64.0 * STREAM_MM;
    let velocity = scale * 3.0 * hump.powi(2) * slope;
    let acceleration = scale * 6.0 * (hump * slope.powi(2) - hump.powi(2));
    let mut point = SetPoint::default();
    for axis in &mut point.axes {
        axis.position_mm = PARK_MM + scale * hump.powi(3);
        axis.velocity_mm_s = (velocity / duration_s) as f32;
        axis.acceleration_mm_s2 = (acceleration / duration_s.powi(2)) as f32;
    }
    point
}
