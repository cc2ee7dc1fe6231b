//! Parameters of the law in C, `law.c`, made from the settings.

use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::stribeck::StribeckCurve;
use quadrant_settings::AxisSettings;

/// Elements of the GMS model.
pub(crate) const ELEMENTS: usize = 4;
/// Octaves of a table.
const OCTAVES: i32 = 14;
/// Intervals of an octave.
const INTERVALS: usize = 16;
/// Nodes of a table.
pub(crate) const NODES: usize = OCTAVES as usize * INTERVALS + 2;

/// Start of a table.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Octaves {
    pub(crate) key: u32,
    pub(crate) below: f32,
    pub(crate) bound: f32,
}

/// Parameters of an axis.
#[repr(C)]
pub(crate) struct Parameters {
    pub(crate) limit: f32,
    pub(crate) proportional: f32,
    pub(crate) derivative: f32,
    pub(crate) pole: f32,
    pub(crate) integral: f32,
    pub(crate) error_limit: f32,
    pub(crate) integral_limit: f32,
    pub(crate) viscous: [f32; 2],
    pub(crate) inertia: f32,
    pub(crate) share: f32,
    pub(crate) stiffness: [f32; ELEMENTS],
    pub(crate) weight: [f32; ELEMENTS],
    pub(crate) largest: f32,
    pub(crate) gain_octaves: Octaves,
    pub(crate) surface_octaves: [Octaves; 2],
    pub(crate) gain: [f32; NODES],
    pub(crate) surface: [[[f32; 2]; NODES]; 2],
}

impl Parameters {
    /// Of an axis on N-PID with combined feedforward.
    pub(crate) fn of(axis: &AxisSettings, gain: &NonlinearGain, period_s: f64) -> Self {
        let (feedback, feedforward) = (&axis.feedback, &axis.feedforward.gains);
        let (pid, friction) = (&feedback.pid, &axis.friction);
        let filter = 2.0 * pid.derivative_filter_s + period_s;
        let gain_end = end_exponent(gain.range_mm);
        let PerDirection { positive, negative } = &friction.sliding;
        let senses = [positive, negative];
        let element = |index: usize| &friction.gms.elements[index];
        Self {
            limit: axis.amplifier.output_limit_v as f32,
            proportional: pid.kp_v_per_mm as f32,
            derivative: (2.0 * pid.kd_v_s_per_mm / filter) as f32,
            pole: ((2.0 * pid.derivative_filter_s - period_s) / filter) as f32,
            integral: (pid.ki_v_per_mm_s * period_s) as f32,
            error_limit: 31.0,
            integral_limit: feedback.integral_limit_v as f32,
            viscous: senses.map(|sense| (feedforward.viscous * sense.viscous_v_s_per_mm) as f32),
            inertia: feedforward.inertia_v_s2_per_mm as f32,
            share: feedforward.presliding as f32,
            stiffness: core::array::from_fn(|i| element(i).stiffness_v_per_mm as f32),
            weight: core::array::from_fn(|i| element(i).weight as f32),
            largest: gain.largest() as f32,
            gain_octaves: Octaves::up_to(gain_end),
            surface_octaves: senses.map(|sense| Octaves::up_to(surface_end(&sense.curve))),
            gain: core::array::from_fn(|index| {
                libm::cosh(gain.rate_per_mm * node(index, gain_end)) as f32
            }),
            surface: senses.map(|sense| {
                let end = surface_end(&sense.curve);
                core::array::from_fn(|index| {
                    let level = sense.curve.level_v(node(index, end));
                    let decay = libm::exp(-friction.gms.attraction_v_s * period_s / level);
                    [level as f32, decay as f32]
                })
            }),
        }
    }
}

impl Octaves {
    /// Of a table that ends at `2^end`.
    fn up_to(end: i32) -> Self {
        let bound = libm::scalbn(1.0, end - OCTAVES) as f32;
        Self {
            key: (bound.to_bits() >> 19) - 1,
            below: 1.0 / bound,
            bound,
        }
    }
}

/// The smallest exponent of two that reaches `end`.
fn end_exponent(end: f64) -> i32 {
    let (fraction, exponent) = libm::frexp(end);
    if fraction > 0.5 {
        exponent
    } else {
        exponent - 1
    }
}

/// The exponent of two at which the table of a surface ends.
pub(crate) fn surface_end(curve: &StribeckCurve) -> i32 {
    end_exponent(curve.flat_velocity_mm_s())
}

/// The argument of a node in a table that ends at `2^end`.
pub(crate) fn node(index: usize, end: i32) -> f64 {
    let Some(above) = index.checked_sub(1) else {
        return 0.0;
    };
    let octave = (above / INTERVALS) as i32 + end - OCTAVES;
    let within = (above % INTERVALS) as f64 / INTERVALS as f64;
    libm::scalbn(1.0 + within, octave)
}
