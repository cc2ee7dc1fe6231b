//! Two masses and the gap between them, a step at a time.
//!
//! Contact is stepped by the implicit midpoint rule, which keeps the energy of spring and masses and takes out what the
//! damper does; a step in which the gap closes is cut where it does. So the gap never gives energy, at a step of any length.

use super::Backlash;

/// A mass in motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Position, mm.
    pub position_mm: f64,
    /// Velocity, mm/s.
    pub velocity_mm_s: f64,
}

/// Forces on a mass besides the teeth's, constant over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forcing {
    /// Acceleration by a volt on this mass alone, mm/(V s^2); above zero.
    pub gain_mm_per_v_s2: f64,
    /// Acceleration without the teeth and without damping, mm/s^2.
    pub acceleration_mm_s2: f64,
    /// Damping over mass, 1/s.
    pub damping_per_s: f64,
}

impl Body {
    /// After a time under `forcing` and the teeth's push `push_v`, V, by the trapezoidal rule.
    fn after(self, forcing: &Forcing, push_v: f64, step_s: f64) -> Self {
        let drag = 0.5 * step_s * forcing.damping_per_s;
        let push = forcing.acceleration_mm_s2 + forcing.gain_mm_per_v_s2 * push_v;
        let velocity = (self.velocity_mm_s * (1.0 - drag) + push * step_s) / (1.0 + drag);
        Self {
            position_mm: self.position_mm + 0.5 * (self.velocity_mm_s + velocity) * step_s,
            velocity_mm_s: velocity,
        }
    }
}

impl Backlash {
    /// Motor and table after `step_s` s.
    pub fn step(&self, bodies: [Body; 2], forcings: &[Forcing; 2], step_s: f64) -> [Body; 2] {
        let half = 0.5 * self.width_mm;
        let lead = bodies[0].position_mm - bodies[1].position_mm;
        if lead.abs() >= half {
            return self.contact(bodies, forcings, step_s);
        }
        let free = |time_s: f64| {
            [
                bodies[0].after(&forcings[0], 0.0, time_s),
                bodies[1].after(&forcings[1], 0.0, time_s),
            ]
        };
        let apart = free(step_s);
        let reached = apart[0].position_mm - apart[1].position_mm;
        if reached.abs() < half {
            return apart;
        }
        let share = (half.copysign(reached) - lead) / (reached - lead);
        let touching = free(share * step_s);
        self.contact(touching, forcings, (1.0 - share) * step_s)
    }

    /// A step with the teeth in contact; a step that would have them pull passes without them.
    fn contact(&self, bodies: [Body; 2], forcings: &[Forcing; 2], step_s: f64) -> [Body; 2] {
        let [motor, table] = bodies;
        let lead = motor.position_mm - table.position_mm;
        let approach = motor.velocity_mm_s - table.velocity_mm_s;
        let pressed = lead - (0.5 * self.width_mm).copysign(lead);
        let free = forcings.map(|forcing| 1.0 + 0.5 * step_s * forcing.damping_per_s);
        let yielding: f64 = forcings
            .iter()
            .zip(free)
            .map(|(forcing, drag)| step_s * forcing.gain_mm_per_v_s2 / drag)
            .sum();
        let apart = motor.after(&forcings[0], 0.0, step_s).velocity_mm_s
            - table.after(&forcings[1], 0.0, step_s).velocity_mm_s;
        // At the middle of the step the spring has taken a quarter of the step times both velocities, the damper their mean.
        let weight = 0.25 * step_s * self.stiffness_v_per_mm + 0.5 * self.damping_v_s_per_mm;
        let force = (self.stiffness_v_per_mm * pressed + weight * (approach + apart))
            / (1.0 + weight * yielding);
        let force = if force * lead > 0.0 { force } else { 0.0 };
        [
            motor.after(&forcings[0], -force, step_s),
            table.after(&forcings[1], force, step_s),
        ]
    }

    /// The energy of both masses and of the teeth's spring, V mm: what a volt of force does over a millimetre.
    pub fn energy_v_mm(&self, bodies: [Body; 2], forcings: &[Forcing; 2]) -> f64 {
        let kinetic: f64 = bodies
            .iter()
            .zip(forcings)
            .map(|(body, forcing)| {
                0.5 * body.velocity_mm_s * body.velocity_mm_s / forcing.gain_mm_per_v_s2
            })
            .sum();
        let lead = bodies[0].position_mm - bodies[1].position_mm;
        let pressed = (lead.abs() - 0.5 * self.width_mm).max(0.0);
        kinetic + 0.5 * self.stiffness_v_per_mm * pressed * pressed
    }
}
