//! The quadrant-glitch monitor: height of the error spike at each reversal, and the worst radial deviation of a circle.
//!
//! It runs in the supervising task on the snapshots, once every
//! [`PERIOD_TICKS`](quadrant_law::supervisor::PERIOD_TICKS), so the control interrupt pays for no more than the copy of three
//! reference positions in a snapshot. Its results are shown, in the log and as telemetry channels, and never fed back.
//!
//! - **Reversal**: the reference of an axis changes its direction, after a rest of 0.5 s at most. The *level* is the mean magnitude of the tracking error
//!   since the last spike, the *spike* the largest magnitude in the window after the reversal: a quarter of the time that the
//!   axis moved in one direction, at most 0.5 s. The glitch is spike minus level.
//! - **Circle**: exactly two axes move, and their reference stays within 1 % of a circle whose centre and radius are those of
//!   the turn before. The radial deviation of the measured position `p` from the reference `d`, both from the centre, is
//!   `(|p|^2 - |d|^2) / (|p| + |d|)`: without the cancellation of `|p| - |d|`, the error of the roots in the denominator is
//!   one relative to the micrometres shown.
//!
//! Root and arctangent are `micromath`'s. One Newton step brings its root (6 %) to 0.2 %; its arctangent errs by 0.2
//! degrees at most (`tests/firmware/glitch_monitor.rs` measures both).

use micromath::F32Ext;
use quadrant_link::message::AxisName;

use super::Snapshot;
use quadrant_law::scalar::{Quantity, Scalar};
use quadrant_law::units::{POSITION_UNITS_PER_COUNT, Position};

/// Longest window after a reversal, ticks: 0.5 s at 10 kHz.
const MAX_WINDOW_TICKS: u32 = 5_000;
/// Part of a stroke's duration that is the window after its end.
const WINDOW_SHARE: u32 = 4;
/// Largest deviation of a reference that counts as a circle, as a share of the radius.
const CIRCLE_TOLERANCE: f32 = 0.01;

/// The latest results, as the telemetry channels show them; zero before the first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GlitchReadings {
    /// Height of the last glitch of each axis, um.
    pub heights_um: [f32; 3],
    /// The last full circle.
    pub circle: CircleReading,
}

/// The worst point of a full circle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CircleReading {
    /// The radial deviation of the largest magnitude, um; outwards positive.
    pub deviation_um: f32,
    /// Its angle, 0 to 360 degrees from the first of the two axes towards the second.
    pub angle_deg: f32,
}

/// A result of the monitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GlitchEvent {
    /// The window after a reversal has ended.
    Reversal {
        /// The axis that reversed.
        axis: AxisName,
        /// The control tick of the reversal.
        tick: u32,
        /// Height of the glitch, um.
        height_um: f32,
    },
    /// A full circle has ended.
    Circle(CircleReading),
}

/// Most events of one step: a reversal of each axis, and a circle.
pub const MAX_GLITCH_EVENTS: usize = 4;

/// The monitor's memory.
#[derive(Clone, Debug)]
pub struct GlitchMonitor {
    resolution_mm: [f32; 3],
    axes: [AxisMonitor; 3],
    circle: CircleMonitor,
    readings: GlitchReadings,
}

impl GlitchMonitor {
    /// Returns a monitor of axes whose encoder counts have these lengths, mm.
    pub fn new(resolution_mm: [f32; 3]) -> Self {
        Self {
            resolution_mm,
            axes: [AxisMonitor::default(); 3],
            circle: CircleMonitor::default(),
            readings: GlitchReadings::default(),
        }
    }

    /// Takes the next snapshot; returns what has ended with it.
    pub fn step<S: Scalar>(
        &mut self,
        seen: &Snapshot<S>,
    ) -> heapless::Vec<GlitchEvent, MAX_GLITCH_EVENTS> {
        let mut events = heapless::Vec::new();
        if !seen.view.safety.is_enabled() {
            self.axes = [AxisMonitor::default(); 3];
            self.circle = CircleMonitor::default();
            return events;
        }
        let errors_um = seen
            .axes
            .map(|axis| 1e3 * axis.error.to_f32(Quantity::Length));
        let references = seen.axes.map(|axis| axis.reference);
        let mut reversed = [false; 3];
        for (index, axis) in self.axes.iter_mut().enumerate() {
            let (ended, now) = axis.step(seen.tick, references[index], errors_um[index]);
            reversed[index] = now;
            if let Some((tick, height_um)) = ended {
                self.readings.heights_um[index] = height_um;
                // There is room for one of each axis.
                let _ = events.push(GlitchEvent::Reversal {
                    axis: AxisName::ALL[index],
                    tick,
                    height_um,
                });
            }
        }
        let moving = self.axes.map(|axis| axis.direction != 0);
        let pair = match moving {
            [true, true, false] => Some([0, 1]),
            [false, true, true] => Some([1, 2]),
            [true, false, true] => Some([0, 2]),
            _ => None,
        };
        let circle = pair.and_then(|pair| {
            let scales =
                pair.map(|axis| self.resolution_mm[axis] / POSITION_UNITS_PER_COUNT as f32);
            self.circle.step(
                pair,
                pair.map(|axis| references[axis]),
                pair.map(|axis| 1e-3 * errors_um[axis]),
                scales,
                reversed[pair[0]] && self.axes[pair[0]].direction > 0,
            )
        });
        if let Some(reading) = circle {
            self.readings.circle = reading;
            let _ = events.push(GlitchEvent::Circle(reading));
        }
        events
    }

    /// The latest results.
    pub const fn readings(&self) -> GlitchReadings {
        self.readings
    }
}

/// One axis: its direction, the level of its error, and the window after its last reversal.
#[derive(Clone, Copy, Debug, Default)]
struct AxisMonitor {
    last: Option<Position>,
    /// Sign of the reference's velocity; 0 before the first motion.
    direction: i8,
    /// The last tick at which the reference moved.
    moved: u32,
    /// The tick at which the present stroke began.
    begun: u32,
    sum_um: f32,
    count: u32,
    window: Option<Window>,
}

/// The window after a reversal.
#[derive(Clone, Copy, Debug)]
struct Window {
    reversal: u32,
    ticks: u32,
    level_um: f32,
    peak_um: f32,
}

impl AxisMonitor {
    /// Returns the tick and the height of a glitch whose window has ended, and true if the axis has just reversed.
    fn step(
        &mut self,
        tick: u32,
        reference: Position,
        error_um: f32,
    ) -> (Option<(u32, f32)>, bool) {
        let error_um = error_um.abs();
        let last = self.last.replace(reference).unwrap_or(reference);
        let direction = (reference.0 - last.0).signum() as i8;
        if direction != 0 {
            self.moved = tick;
        } else if tick.wrapping_sub(self.moved) > MAX_WINDOW_TICKS {
            *self = Self {
                last: self.last,
                moved: self.moved,
                ..Self::default()
            };
        }
        let reversed = direction != 0 && self.direction != 0 && direction != self.direction;
        let mut ended = None;
        if reversed {
            ended = self.close();
            let level_um = match self.count {
                0 => 0.0,
                count => self.sum_um / count as f32,
            };
            self.window = Some(Window {
                reversal: tick,
                ticks: (tick.wrapping_sub(self.begun) / WINDOW_SHARE).min(MAX_WINDOW_TICKS),
                level_um,
                peak_um: 0.0,
            });
            (self.sum_um, self.count) = (0.0, 0);
        }
        if reversed || self.direction == 0 {
            self.begun = tick;
        }
        if direction != 0 {
            self.direction = direction;
        }
        match &mut self.window {
            Some(window) => {
                window.peak_um = window.peak_um.max(error_um);
                if tick.wrapping_sub(window.reversal) >= window.ticks {
                    ended = self.close();
                }
            }
            None if self.direction != 0 => {
                self.sum_um += error_um;
                self.count += 1;
                // The older half of a long stroke counts half.
                if self.count >= 1 << 12 {
                    (self.sum_um, self.count) = (0.5 * self.sum_um, self.count / 2);
                }
            }
            None => {}
        }
        (ended, reversed)
    }

    /// Closes the window; returns the tick of its reversal and the height of its glitch.
    fn close(&mut self) -> Option<(u32, f32)> {
        let window = self.window.take()?;
        Some((window.reversal, (window.peak_um - window.level_um).max(0.0)))
    }
}

/// Two axes on a circle, turn by turn.
#[derive(Clone, Copy, Debug, Default)]
struct CircleMonitor {
    pair: [usize; 2],
    /// Lowest and highest reference of this turn, of both axes.
    extremes: Option<[(Position, Position); 2]>,
    /// Centre, and radius in mm, of the turn before.
    known: Option<([Position; 2], f32)>,
    /// The reference has left the known circle in this turn.
    left: bool,
    /// The turn began at the first axis' reversal.
    whole: bool,
    worst_mm: f32,
    worst_at: [f32; 2],
}

impl CircleMonitor {
    /// Returns the worst point of a turn that has ended. `scales` are mm per unit of position.
    fn step(
        &mut self,
        pair: [usize; 2],
        references: [Position; 2],
        errors_mm: [f32; 2],
        scales: [f32; 2],
        turned: bool,
    ) -> Option<CircleReading> {
        if pair != self.pair {
            *self = Self {
                pair,
                ..Self::default()
            };
        }
        let mut reading = None;
        if turned {
            if self.known.is_some() && self.whole && !self.left {
                let [along, across] = self.worst_at;
                reading = Some(CircleReading {
                    deviation_um: 1e3 * self.worst_mm,
                    angle_deg: degrees(across, along),
                });
            }
            self.known = match self.extremes {
                Some(extremes) if self.whole => circle_of(extremes, scales),
                _ => None,
            };
            *self = Self {
                pair,
                known: self.known,
                whole: true,
                ..Self::default()
            };
        }
        let extremes = self
            .extremes
            .get_or_insert(references.map(|reference| (reference, reference)));
        for ((low, high), reference) in extremes.iter_mut().zip(references) {
            (*low, *high) = ((*low).min(reference), (*high).max(reference));
        }
        if let Some((centre, radius_mm)) = self.known {
            let [x, y] =
                [0, 1].map(|axis| (references[axis].0 - centre[axis].0) as f32 * scales[axis]);
            let square = x * x + y * y;
            let radius_square = radius_mm * radius_mm;
            self.left |= (square - radius_square).abs() > 2.0 * CIRCLE_TOLERANCE * radius_square;
            let [error_x, error_y] = errors_mm;
            // |p|^2 - |d|^2 with p = d - e.
            let difference = error_x * (error_x - 2.0 * x) + error_y * (error_y - 2.0 * y);
            let deviation_mm = difference / (root(square + difference) + root(square));
            if deviation_mm.abs() > self.worst_mm.abs() {
                self.worst_mm = deviation_mm;
                self.worst_at = [x, y];
            }
        }
        reading
    }
}

/// The centre and the radius in mm of a turn with these extremes, if it is as wide as high.
fn circle_of(
    extremes: [(Position, Position); 2],
    scales: [f32; 2],
) -> Option<([Position; 2], f32)> {
    let [x, y] = [0, 1].map(|axis| {
        let (low, high) = extremes[axis];
        0.5 * (high.0 - low.0) as f32 * scales[axis]
    });
    let radius = 0.5 * (x + y);
    let round = radius > 0.0 && (x - y).abs() <= CIRCLE_TOLERANCE * radius;
    round.then(|| {
        (
            extremes.map(|(low, high)| Position((low.0 + high.0) / 2)),
            radius,
        )
    })
}

/// The square root of a positive number, within 0.2 %: `micromath`'s and a Newton step.
pub fn root(square: f32) -> f32 {
    let rough = F32Ext::sqrt(square);
    0.5 * (rough + square / rough)
}

/// The angle of a vector, 0 to 360 degrees, within 0.2 degrees.
pub fn degrees(across: f32, along: f32) -> f32 {
    let angle = F32Ext::atan2(across, along) * (180.0 / core::f32::consts::PI);
    if angle < 0.0 { angle + 360.0 } else { angle }
}
