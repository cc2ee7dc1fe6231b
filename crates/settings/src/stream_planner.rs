//! The slow half of streaming: set points in, checked segments out.
//!
//! Every tick of a segment is checked before the control law receives the segment, so what the control law gets is within the
//! axis' limits for every request of a host.

use core::fmt;

use quadrant_law::admission::Refusal;
use quadrant_law::axes::AxisName;
use quadrant_law::decimal::Decimal;
use quadrant_law::reference::{MotionScale, ReferenceSample, Segment, Velocity, steps_per_mm};
use quadrant_law::rounding;
use quadrant_law::units::{POSITION_UNITS_PER_COUNT, Position};

/// The longest segment, in ticks: up to it the differences meet a set point to the unit.
pub const MOST_SEGMENT_TICKS: u32 = 1000;

/// The shortest period of set points, in ticks: at a shorter one their rounding to whole units makes velocity and
/// acceleration rough.
pub const LEAST_PERIOD_TICKS: u32 = 4;

/// Most set points that may be missing in a row.
pub const MOST_MISSING: u32 = 3;

/// A change of velocity per tick in 2^-32 of a [`Position`] unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Acceleration(i64);

/// One axis at a set point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisPoint {
    position: Position,
    velocity: Velocity,
    acceleration: Acceleration,
}

impl AxisPoint {
    /// At rest at a position.
    pub const fn at_rest(position: Position) -> Self {
        Self {
            position,
            velocity: Velocity::ZERO,
            acceleration: Acceleration(0),
        }
    }

    /// A position with the velocity (mm/s) and the acceleration (mm/s^2) there. What is not a number is taken for zero,
    /// what is too large is held at a bound that no axis' limit reaches.
    pub fn new(sample: ReferenceSample<f64>, scale: MotionScale) -> Self {
        let rate = scale.rate_hz;
        let acceleration = sample.acceleration * steps_per_mm(scale) / (rate * rate);
        let most = (1i64 << 61) as f64;
        Self {
            position: sample.position,
            velocity: Velocity::from_mm_s(sample.velocity, scale),
            // `as` turns NaN into zero.
            acceleration: Acceleration(
                rounding::clamp(rounding::round(acceleration), -most, most) as i64
            ),
        }
    }

    fn is_at_rest(&self) -> bool {
        self.velocity == Velocity::ZERO && self.acceleration == Acceleration(0)
    }
}

/// Limits of an axis that a stream must keep to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamLimits {
    /// Resolution and control rate of the axis.
    pub scale: MotionScale,
    /// Largest velocity, mm/s; above zero.
    pub max_velocity_mm_s: f64,
    /// Largest acceleration, mm/s^2; above zero.
    pub max_acceleration_mm_s2: f64,
    /// Lowest and highest position, if the axis knows where it is.
    pub travel: Option<(Position, Position)>,
    /// True if the axis has a law that can move it.
    pub has_law: bool,
}

/// A set point of all axes, `number` periods after the start of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetPoint {
    /// Counts the periods from the start, where the axes rest; from 1.
    pub number: u32,
    /// The set points of x, y and z.
    pub axes: [AxisPoint; 3],
    /// The stream ends here.
    pub last: bool,
}

/// Makes segments of set points. Runs in the slow half: it divides wide integers and looks at every tick.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamPlanner {
    limits: [StreamLimits; 3],
    period_ticks: u32,
    number: u32,
    axes: [AxisPoint; 3],
}

impl StreamPlanner {
    /// A stream with a set point every `period_ticks` ([`LEAST_PERIOD_TICKS`] to [`MOST_SEGMENT_TICKS`], else held there) that starts with
    /// the axes at rest at `start`.
    pub fn new(limits: [StreamLimits; 3], period_ticks: u32, start: [Position; 3]) -> Self {
        Self {
            limits,
            period_ticks: period_ticks.clamp(LEAST_PERIOD_TICKS, MOST_SEGMENT_TICKS),
            number: 0,
            axes: start.map(AxisPoint::at_rest),
        }
    }

    /// The number of the last set point that was taken; 0 is the start.
    pub fn number(&self) -> u32 {
        self.number
    }

    /// The axes' segments from the last set point to this one. Up to [`MOST_MISSING`] numbers may be left out: the
    /// segment then takes as many periods longer. A refused set point changes nothing.
    ///
    /// # Errors
    /// The set point's number and what is wrong with it.
    pub fn plan(&mut self, point: &SetPoint) -> Result<[Segment; 3], StreamError> {
        let number = point.number;
        let refuse = |flaw| Err(StreamError { number, flaw });
        let Some(missing) = number
            .checked_sub(self.number)
            .and_then(|ahead| ahead.checked_sub(1))
        else {
            return refuse(StreamFlaw::OutOfOrder { last: self.number });
        };
        let ticks = self.period_ticks.saturating_mul(missing.saturating_add(1));
        if missing > MOST_MISSING || ticks > MOST_SEGMENT_TICKS {
            return refuse(StreamFlaw::Missing { missing });
        }
        let mut segments = [Segment {
            start: Position::ZERO,
            differences: [0; 5],
            ticks,
            first: self.number == 0,
            last: point.last,
        }; 3];
        for (index, segment) in segments.iter_mut().enumerate() {
            let axis = AxisName::ALL[index];
            let (from, to) = (&self.axes[index], &point.axes[index]);
            if !self.limits[index].has_law && to != from {
                return refuse(StreamFlaw::NoLaw { axis });
            }
            if point.last && !to.is_at_rest() {
                return refuse(StreamFlaw::NotAtRest { axis });
            }
            let bounds = Bounds::new(&self.limits[index], axis, ticks);
            if let Err(flaw) = bounds
                .check_ends(from, to)
                .and_then(|()| connect(segment, from, to, &bounds))
            {
                return refuse(flaw);
            }
        }
        self.number = number;
        self.axes = point.axes;
        Ok(segments)
    }
}

/// Fills in the segment's start and differences, and checks each of its ticks.
fn connect(
    segment: &mut Segment,
    from: &AxisPoint,
    to: &AxisPoint,
    bounds: &Bounds,
) -> Result<(), StreamFlaw> {
    let ticks = i128::from(segment.ticks);
    // Everything in 2^-33 units, halves of the inputs' step: no product is rounded.
    let distance = i128::from((to.position - from.position).0) << 33;
    let speeds = [from, to].map(|point| i128::from(point.velocity.steps()) * 2 * ticks);
    let bends = [from, to].map(|point| i128::from(point.acceleration.0) * ticks * ticks);
    let cubic = 10 * distance - 6 * speeds[0] - 4 * speeds[1] - 3 * bends[0] + bends[1];
    let quartic = -15 * distance + 8 * speeds[0] + 7 * speeds[1] + 3 * bends[0] - 2 * bends[1];
    let quintic = 6 * distance - 3 * (speeds[0] + speeds[1]) - bends[0] + bends[1];
    // To 2^-64 units: the limits on the inputs leave room for these shifts.
    let shift = Segment::FRACTION_BITS - 33;
    let cube = ticks * ticks * ticks;
    let third = (cubic << shift) / cube;
    let fourth = (quartic << shift) / (cube * ticks);
    let fifth = (quintic << shift) / (cube * ticks * ticks);
    let velocity = i128::from(from.velocity.steps()) << (Segment::FRACTION_BITS - 32);
    let acceleration = i128::from(from.acceleration.0) << (Segment::FRACTION_BITS - 32);
    segment.start = from.position;
    segment.differences = [
        velocity + acceleration / 2 + third + fourth + fifth,
        acceleration + 6 * third + 14 * fourth + 30 * fifth,
        6 * third + 36 * fourth + 150 * fifth,
        24 * fourth + 240 * fifth,
        120 * fifth,
    ];
    let (mut way, mut displacement) = (*segment, 0);
    for _ in 0..segment.ticks {
        bounds.check_tick(&way, displacement)?;
        way.advance(&mut displacement);
    }
    Ok(())
}

/// The limits of an axis over a segment, in the units of its differences.
struct Bounds<'a> {
    limits: &'a StreamLimits,
    axis: AxisName,
    ticks: u32,
    velocity: i128,
    acceleration: i128,
}

/// One unit of a position, 2^-16 counts, in 2^-33 units.
const UNIT: i128 = 1 << Segment::FRACTION_BITS;

impl<'a> Bounds<'a> {
    fn new(limits: &'a StreamLimits, axis: AxisName, ticks: u32) -> Self {
        let rate = limits.scale.rate_hz;
        let scaled = |value: f64| {
            libm::scalbn(
                value * steps_per_mm(limits.scale),
                Segment::FRACTION_BITS as i32 - 32,
            ) as i128
        };
        let ticks_wide = i128::from(ticks);
        Self {
            limits,
            axis,
            ticks,
            // A motion at the limit may pass it by what the rounding of its set points to whole units does.
            velocity: scaled(limits.max_velocity_mm_s / rate) + 4 * UNIT / ticks_wide,
            acceleration: scaled(limits.max_acceleration_mm_s2 / (rate * rate))
                + 12 * UNIT / (ticks_wide * ticks_wide),
        }
    }

    fn unit_mm(&self) -> f64 {
        self.limits.scale.resolution_mm / POSITION_UNITS_PER_COUNT
    }

    /// Checks what needs no segment: the set points themselves and the mean velocity between them. After it no product of
    /// [`connect`] overflows.
    fn check_ends(&self, from: &AxisPoint, to: &AxisPoint) -> Result<(), StreamFlaw> {
        let distance = i128::from(to.position.0) - i128::from(from.position.0);
        // A mean; saturated, because a hostile distance has no bound.
        let mean = distance.clamp(-(1 << 60), 1 << 60) * UNIT / i128::from(self.ticks);
        self.check_velocity(mean)?;
        self.check_velocity(i128::from(to.velocity.steps()) << (Segment::FRACTION_BITS - 32))?;
        self.check_acceleration(i128::from(to.acceleration.0) << (Segment::FRACTION_BITS - 32))
    }

    fn check_tick(&self, way: &Segment, displacement: i128) -> Result<(), StreamFlaw> {
        let [velocity, acceleration, ..] = way.differences;
        self.check_velocity(velocity)?;
        self.check_acceleration(acceleration)?;
        let Some((lowest, highest)) = self.limits.travel else {
            return Ok(());
        };
        let next = displacement + velocity + UNIT / 2;
        let position = way.start + Position((next >> Segment::FRACTION_BITS) as i64);
        let limit = if position < lowest {
            lowest
        } else if position > highest {
            highest
        } else {
            return Ok(());
        };
        let resolution_mm = self.limits.scale.resolution_mm;
        Err(StreamFlaw::Travel {
            axis: self.axis,
            value_mm: position.to_mm(resolution_mm),
            limit_mm: limit.to_mm(resolution_mm),
        })
    }

    fn check_velocity(&self, displacement: i128) -> Result<(), StreamFlaw> {
        if displacement.abs() <= self.velocity {
            return Ok(());
        }
        let units = libm::scalbn(displacement as f64, -(Segment::FRACTION_BITS as i32));
        Err(StreamFlaw::Velocity {
            axis: self.axis,
            value_mm_s: units * self.unit_mm() * self.limits.scale.rate_hz,
            limit_mm_s: self.limits.max_velocity_mm_s,
        })
    }

    fn check_acceleration(&self, change: i128) -> Result<(), StreamFlaw> {
        if change.abs() <= self.acceleration {
            return Ok(());
        }
        let units = libm::scalbn(change as f64, -(Segment::FRACTION_BITS as i32));
        let rate = self.limits.scale.rate_hz;
        Err(StreamFlaw::Acceleration {
            axis: self.axis,
            value_mm_s2: units * self.unit_mm() * rate * rate,
            limit_mm_s2: self.limits.max_acceleration_mm_s2,
        })
    }
}

/// The flaw of a refused set point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StreamFlaw {
    /// Its number is not above the last one's.
    OutOfOrder {
        /// The number of the last set point that was taken.
        last: u32,
    },
    /// Too many set points are missing before it, or the time without one is too long.
    Missing {
        /// Number of set points that are missing.
        missing: u32,
    },
    /// The way to it is faster than the axis may move.
    Velocity {
        /// The axis that would do so.
        axis: AxisName,
        /// Velocity on the way, mm/s.
        value_mm_s: f64,
        /// Largest allowed velocity, mm/s.
        limit_mm_s: f64,
    },
    /// The way to it accelerates more than the axis may.
    Acceleration {
        /// The axis that would do so.
        axis: AxisName,
        /// Acceleration on the way, mm/s^2.
        value_mm_s2: f64,
        /// Largest allowed acceleration, mm/s^2.
        limit_mm_s2: f64,
    },
    /// The way to it leaves the axis' travel.
    Travel {
        /// The axis that would do so.
        axis: AxisName,
        /// Position on the way, mm.
        value_mm: f64,
        /// The end of the travel that it lies beyond, mm.
        limit_mm: f64,
    },
    /// It is the last, and the axis is not at rest there.
    NotAtRest {
        /// The axis that would do so.
        axis: AxisName,
    },
    /// It moves an axis that has no law.
    NoLaw {
        /// The axis.
        axis: AxisName,
    },
}

/// A refused set point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamError {
    /// Number of the set point.
    pub number: u32,
    /// The reason for the refusal.
    pub flaw: StreamFlaw,
}

impl fmt::Display for StreamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "set point {}: ", self.number)?;
        match self.flaw {
            StreamFlaw::OutOfOrder { last } => write!(
                f,
                "its number is not above that of the last one, {last}; number the set points upwards from 1"
            ),
            StreamFlaw::Missing { missing } => write!(
                f,
                "{missing} set points are missing before it, more than {MOST_MISSING}, or more than {MOST_SEGMENT_TICKS} \
                 ticks; send every set point, or lengthen the period"
            ),
            StreamFlaw::Velocity {
                axis,
                value_mm_s,
                limit_mm_s,
            } => write!(
                f,
                "{axis} would move at {:.3} mm/s, above its limit of {:.3} mm/s; \
                 check for a jump of the position, or lower the feed",
                Decimal(value_mm_s),
                Decimal(limit_mm_s)
            ),
            StreamFlaw::Acceleration {
                axis,
                value_mm_s2,
                limit_mm_s2,
            } => write!(
                f,
                "{axis} would accelerate at {:.1} mm/s^2, above its limit of {:.1} mm/s^2; \
                 check that position, velocity and acceleration agree, or lower the feed",
                Decimal(value_mm_s2),
                Decimal(limit_mm_s2)
            ),
            StreamFlaw::Travel {
                axis,
                value_mm,
                limit_mm,
            } => write!(
                f,
                "{axis} would be at {:.3} mm, beyond the end of its travel at {:.3} mm",
                Decimal(value_mm),
                Decimal(limit_mm)
            ),
            StreamFlaw::NotAtRest { axis } => write!(
                f,
                "it ends the stream, and {axis} still moves there; let the last set point have no velocity and \
                 no acceleration"
            ),
            StreamFlaw::NoLaw { axis } => Refusal::NoLaw(axis).fmt(f),
        }
    }
}

impl core::error::Error for StreamError {}
