//! Amplifier in velocity mode: its own loop on the motor's velocity. Every number is chosen, none measured.

/// A velocity loop in the amplifier: a volt commands a velocity, and a PI drives the motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityDrive {
    /// Velocity for a volt, mm/(V s); above zero.
    pub velocity_mm_s_per_v: f64,
    /// Proportional gain, V s/mm of the motor's force.
    pub proportional_v_s_per_mm: f64,
    /// Integral gain, V/mm.
    pub integral_v_per_mm: f64,
    /// Largest force, V; the integral stops there.
    pub limit_v: f64,
}

/// Time constant of the PI's integral over the loop's lag: the symmetrical optimum.
const INTEGRAL_RATIO: f64 = 4.0;

impl VelocityDrive {
    /// A drive that is tuned for an axis of which a volt of force accelerates the mass by `gain_mm_per_v_s2`: the velocity follows its
    /// command with `lag_s`.
    pub fn with_lag(
        lag_s: f64,
        velocity_mm_s_per_v: f64,
        limit_v: f64,
        gain_mm_per_v_s2: f64,
    ) -> Self {
        let proportional_v_s_per_mm = 1.0 / (gain_mm_per_v_s2 * lag_s);
        Self {
            velocity_mm_s_per_v,
            proportional_v_s_per_mm,
            integral_v_per_mm: proportional_v_s_per_mm / (INTEGRAL_RATIO * lag_s),
            limit_v,
        }
    }

    /// One step: the motor's force, V, for a command, V, and a velocity.
    pub(super) fn step(
        &self,
        integral_v: &mut f64,
        command_v: f64,
        velocity_mm_s: f64,
        step_s: f64,
    ) -> f64 {
        let error_mm_s = self.velocity_mm_s_per_v * command_v - velocity_mm_s;
        let next_v = *integral_v + self.integral_v_per_mm * step_s * error_mm_s;
        let force_v = self.proportional_v_s_per_mm * error_mm_s + next_v;
        let limited_v = force_v.clamp(-self.limit_v, self.limit_v);
        // At a limit the integral goes back from it alone.
        if force_v == limited_v || (force_v - limited_v) * error_mm_s < 0.0 {
            *integral_v = next_v;
        }
        limited_v
    }
}
