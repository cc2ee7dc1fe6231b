//! The law in C, `law.c`: its types and its functions.

use quadrant_settings::AxisSettings;

use crate::parameters::{ELEMENTS, Parameters};

/// Memory of an axis.
#[repr(C)]
#[derive(Default)]
pub(crate) struct State {
    forces: [f32; ELEMENTS],
    sum: f32,
    left: f32,
    slipping: u32,
    backward: u32,
    integral: f32,
    lost: f32,
    derivative: f32,
    last_error: f32,
}

/// Inputs of an axis in a tick.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Input {
    /// Tracking error, mm.
    pub(crate) error: f32,
    /// Displacement of the reference in the tick, mm.
    pub(crate) displacement: f32,
    /// Velocity of the reference, mm/s.
    pub(crate) velocity: f32,
    /// Acceleration of the reference, mm/s^2.
    pub(crate) acceleration: f32,
}

/// Bare PID of an axis, with its memory.
#[repr(C)]
#[derive(Default)]
pub(crate) struct BarePid {
    a0: f32,
    a1: f32,
    a2: f32,
    last: [f32; 2],
    output: f32,
}

// SAFETY: `law.c` has these functions; they stay within the arrays of three that they are given, whose types have the same
// fields in the same order.
unsafe extern "C" {
    /// Steps the whole law; outputs in V.
    pub(crate) safe fn c_law(
        laws: &[Parameters; 3],
        states: &mut [State; 3],
        inputs: &[Input; 3],
        outputs: &mut [f32; 3],
    );
    /// Steps the bare PID; outputs in V.
    pub(crate) safe fn c_pid(pids: &mut [BarePid; 3], inputs: &[Input; 3], outputs: &mut [f32; 3]);
}

impl BarePid {
    /// Of an axis, its derivative not filtered.
    pub(crate) fn of(axis: &AxisSettings, period_s: f64) -> Self {
        let pid = &axis.feedback.pid;
        let (integral, derivative) = (pid.ki_v_per_mm_s * period_s, pid.kd_v_s_per_mm / period_s);
        Self {
            a0: (pid.kp_v_per_mm + integral + derivative) as f32,
            a1: (-pid.kp_v_per_mm - 2.0 * derivative) as f32,
            a2: derivative as f32,
            ..Self::default()
        }
    }
}
