//! Set points that a host streams.

use super::opened::OpenStream;
use super::{Server, invalid, refused};
use crate::app::queues::{STREAM_ITEM_ROOM, StreamItem};
use crate::hal::SettingsFlash;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::reference::{MotionScale, ReferenceSample};
use quadrant_law::scalar::Scalar;
use quadrant_law::units::Position;
use quadrant_link::message::{self, LinkError, Reply, StreamRequest, StreamStatus};
use quadrant_settings::stream_planner::{
    AxisPoint, LEAST_PERIOD_TICKS, MOST_SEGMENT_TICKS, SetPoint, StreamPlanner,
};

/// Segments that must wait before the axes start: the host is that far ahead.
const START_SEGMENTS: usize = STREAM_ITEM_ROOM / 2;

impl<S: Scalar, F: SettingsFlash> Server<'_, '_, S, F> {
    #[inline(never)]
    pub(super) fn serve_stream(&mut self, request: StreamRequest) -> Result<Reply, LinkError> {
        match request {
            StreamRequest::Open { period_ticks } => self.open_stream(period_ticks.into()),
            StreamRequest::Points {
                sequence,
                points,
                last,
            } => {
                let end = sequence.saturating_add(points.len() as u32);
                for (number, point) in (sequence..end).zip(&points) {
                    if !self.take_point(number, point, last && number + 1 == end)? {
                        break;
                    }
                }
                self.stream_status()
            }
            StreamRequest::Close => {
                self.command(Command::Stop)?;
                self.stream = None;
                Ok(Reply::Done)
            }
        }
    }

    #[inline(never)]
    fn open_stream(&mut self, period_ticks: u32) -> Result<Reply, LinkError> {
        let view = &self.seen.view;
        if !view.safety.is_enabled() {
            return Err(refused(format_args!(
                "the outputs are off; enable them first"
            )));
        }
        if view.running || self.is_injecting() {
            return Err(refused(format_args!(
                "a motion is under way; stop it or wait until it ends"
            )));
        }
        if !(LEAST_PERIOD_TICKS..=MOST_SEGMENT_TICKS).contains(&period_ticks) {
            return Err(invalid(format_args!(
                "period_ticks = {period_ticks} is outside {LEAST_PERIOD_TICKS} to {MOST_SEGMENT_TICKS}"
            )));
        }
        let limits = self.in_force()?.stream_limits(view.homed.into_array());
        // Nothing moves: it drops what control has of a stream that never began.
        self.command(Command::Stop)?;
        let start = self.seen.axes.each_ref().map(|axis| axis.ahead);
        self.stream = Some(OpenStream {
            planner: StreamPlanner::new(limits, period_ticks, start),
            next: 0,
            started: false,
            complete: false,
        });
        self.stream_status()
    }

    fn opened(&mut self) -> Result<&mut OpenStream, LinkError> {
        self.stream
            .as_mut()
            .ok_or_else(|| refused(format_args!("no stream is open; open one first")))
    }

    /// Takes a point unless it is known, or there is no room; says whether there may be room for more. Missing points are
    /// bridged as far as the planner can.
    #[inline(never)]
    fn take_point(
        &mut self,
        number: u32,
        point: &message::SetPoint,
        last: bool,
    ) -> Result<bool, LinkError> {
        let settings = self.draft.in_force();
        let scales: [MotionScale; 3] = AxisName::ALL.map(|axis| settings.scale_of(axis));
        let room = self.ends.stream_items.ready();
        let stream = self.opened()?;
        if number < stream.next {
            return Ok(true);
        }
        if stream.complete {
            return Err(refused(format_args!(
                "set point {number} comes after the last one; open another stream when the axes rest"
            )));
        }
        if !room {
            return Ok(false);
        }
        let axes = core::array::from_fn(|axis| {
            let (from, scale) = (point.axes[axis], scales[axis]);
            let sample = ReferenceSample {
                position: Position::from_mm(from.position_mm, scale.resolution_mm),
                velocity: f64::from(from.velocity_mm_s),
                acceleration: f64::from(from.acceleration_mm_s2),
            };
            AxisPoint::new(sample, scale)
        });
        // The planner counts from the start, where the axes rest.
        let segments = stream
            .planner
            .plan(&SetPoint {
                number: number.saturating_add(1),
                axes,
                last,
            })
            .map_err(|error| invalid(format_args!("{error}")))?;
        stream.next = number.saturating_add(1);
        stream.complete = last;
        // There is room: it was looked at before.
        let _ = self
            .ends
            .stream_items
            .enqueue(StreamItem::Segments(segments));
        Ok(true)
    }

    fn stream_status(&mut self) -> Result<Reply, LinkError> {
        let waiting = self.ends.stream_items.len();
        let stream = self.opened()?;
        Ok(Reply::Stream(StreamStatus {
            next_sequence: stream.next,
            free: (STREAM_ITEM_ROOM - waiting) as u16,
        }))
    }

    /// Starts the axes when enough is there, and forgets a stream that has ended.
    pub(super) fn follow_stream(&mut self) {
        let waiting = self.ends.stream_items.len();
        let view = &self.seen.view;
        let (running, enabled) = (view.running, view.safety.is_enabled());
        let Some(stream) = &self.stream else {
            return;
        };
        let ended =
            stream.started && waiting == 0 && !running && self.seen.tick != self.request_tick;
        if !enabled || ended {
            self.stream = None;
        } else if !stream.started
            && (waiting >= START_SEGMENTS || stream.complete)
            && view.stream_ready
            && self.command(Command::StartStream).is_ok()
            && let Some(stream) = &mut self.stream
        {
            stream.started = true;
        }
    }
}
