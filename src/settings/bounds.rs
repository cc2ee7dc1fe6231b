//! The settings that requests to move are checked against, apart from the rest: a board that builds no axes has these alone.

use super::axis::{AxisSettings, EncoderSettings};
use super::limits::TravelSettings;
use super::stage::StageSettings;
use crate::law::axes::{AxisName, PerAxis};
use crate::law::reference::MotionScale;
use crate::law::safety::Operation;
use crate::law::words::words;

/// Bounds of a stage's motions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageBounds {
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// Those of each axis.
    pub axes: PerAxis<AxisBounds>,
}

words!([] struct StageBounds { rate_hz: f64, axes: PerAxis<AxisBounds> });

/// Bounds of an axis' motions; each as in the axis' settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisBounds {
    /// The encoder.
    pub encoder: EncoderSettings,
    /// Voltage of the converter's largest code, V.
    pub full_scale_v: f64,
    /// Largest output, V.
    pub output_limit_v: f64,
    /// Largest velocity, mm/s.
    pub max_velocity_mm_s: f64,
    /// Largest acceleration, mm/s^2.
    pub max_acceleration_mm_s2: f64,
    /// Jerk of jogs, moves and homing, mm/s^3.
    pub max_jerk_mm_s3: f64,
    /// Soft limits; none: they are not known.
    pub travel_mm: Option<TravelSettings>,
    /// True if the settings say how the axis is homed.
    pub can_home: bool,
}

words!([] struct AxisBounds {
    encoder: EncoderSettings,
    full_scale_v: f64,
    output_limit_v: f64,
    max_velocity_mm_s: f64,
    max_acceleration_mm_s2: f64,
    max_jerk_mm_s3: f64,
    travel_mm: Option<TravelSettings>,
    can_home: bool,
});

/// The rules and bounds that a board has beside its built axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// Rules of operation.
    pub operation: Operation,
    /// Bounds of the motions.
    pub bounds: StageBounds,
}

words!([] struct Machine { operation: Operation, bounds: StageBounds });

impl StageSettings {
    /// The bounds of the motions.
    #[inline(never)]
    pub fn bounds(&self) -> StageBounds {
        StageBounds {
            rate_hz: self.rate_hz,
            axes: PerAxis::from_fn(|axis| self.axis(axis).bounds()),
        }
    }

    /// All that a board needs beside its axes, which [`build_axis`](Self::build_axis) makes.
    pub fn machine(&self) -> Machine {
        Machine {
            operation: self.operation(),
            bounds: self.bounds(),
        }
    }
}

impl AxisSettings {
    fn bounds(&self) -> AxisBounds {
        let (amplifier, limits) = (&self.amplifier, &self.limits);
        AxisBounds {
            encoder: self.encoder,
            full_scale_v: amplifier.full_scale_v,
            output_limit_v: amplifier.output_limit_v,
            max_velocity_mm_s: limits.max_velocity_mm_s,
            max_acceleration_mm_s2: limits.max_acceleration_mm_s2,
            max_jerk_mm_s3: limits.max_jerk_mm_s3,
            travel_mm: limits.travel_mm,
            can_home: self.homing.is_some(),
        }
    }
}

impl StageBounds {
    /// The scale of an axis' motions.
    pub fn scale_of(&self, axis: AxisName) -> MotionScale {
        MotionScale {
            resolution_mm: self.axes[axis].encoder.resolution_mm,
            rate_hz: self.rate_hz,
        }
    }
}
