//! Numbers of an axis in a stage file: name, range, default and meaning in one table.

use serde::Deserialize;

use super::choices::{EncoderPlace, Friction};

/// A number of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Name, with the unit at its end.
    pub name: &'static str,
    /// Smallest and largest value.
    pub range: (f64, f64),
    /// Value where it is left out and no other number says it: that of the simulated stage's x axis.
    pub default: f64,
    /// Meaning.
    pub help: &'static str,
}

macro_rules! numbers {
    ($($name:ident: $least:literal..=$most:literal, $default:literal, $help:literal;)*) => {
        /// An axis as the file has it.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub(super) struct Written {
            $(pub(super) $name: Option<f64>,)*
            pub(super) friction: Friction,
            pub(super) encoder: EncoderPlace,
            pub(super) travel_mm: Option<[f64; 2]>,
        }

        /// The numbers of an axis, with those that the file leaves out.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub(super) struct Numbers {
            $(pub(super) $name: f64,)*
        }

        impl Written {
            /// The numbers, each that is left out from the table.
            pub(super) fn with_defaults(&self) -> Numbers {
                Numbers { $($name: self.$name.unwrap_or($default),)* }
            }
        }

        impl Numbers {
            /// The values, in the order of [`FIELDS`].
            pub(super) fn values(&self) -> [f64; FIELDS.len()] {
                [$(self.$name),*]
            }
        }

        /// Every number of an axis.
        pub const FIELDS: &[Field] = &[$(Field {
            name: stringify!($name),
            range: ($least, $most),
            default: $default,
            help: $help,
        }),*];
    };
}

numbers! {
    mass_kg: 0.01..=100_000.0, 10.0, "Moving mass, the rotor and the screw reduced to it.";
    force_n_per_v: 0.01..=1_000_000.0, 693.9, "Force for a volt at the amplifier's input.";
    full_scale_v: 0.1..=20.0, 10.0, "Voltage of the converter's largest code; the amplifier saturates there.";
    drive_lag_ms: 0.0..=20.0, 0.0, "Lag of the amplifier's own velocity loop; 0 in torque mode, where a voltage is a force.";
    drive_velocity_mm_s_per_v: 0.1..=1000.0, 25.0, "Velocity for a volt of an amplifier in velocity mode.";
    delay_ms: 0.0..=20.0, 1.2, "Delay from the converter's output to the force.";
    coulomb_n: 0.01..=1_000_000.0, 83.268, "Friction while it slides fast.";
    breakaway_n: 0.01..=1_000_000.0, 104.085, "Friction at which it breaks away; without it 1.25 times coulomb_n.";
    stribeck_velocity_mm_s: 0.01..=1000.0, 1.0, "Speed over which friction falls from the one to the other.";
    viscous_n_s_per_m: 0.0..=1_000_000.0, 1448.0, "Damping: friction that grows with the speed.";
    friction_asymmetry_percent: -50.0..=50.0, 3.0, "How much more friction there is in the positive direction than in the mean.";
    friction_variation_percent: 0.0..=90.0, 0.0, "How much friction changes along the travel, as a sine.";
    friction_period_mm: 1.0..=10_000.0, 100.0, "Length of that sine.";
    presliding_um: 0.1..=1000.0, 30.0, "Way that the axis gives before it breaks away; for coulomb and static without it 1, or more under much friction.";
    resolution_um: 0.001..=1000.0, 0.5, "Length of a count of the encoder.";
    noise_um: 0.0..=100.0, 0.15, "Standard deviation of the encoder's noise; without it 0.3 counts.";
    resonance_hz: 0.0..=2000.0, 0.0, "Resonance of motor against table; 0 for none.";
    resonance_damping: 0.001..=1.0, 0.03, "Its damping ratio.";
    motor_share: 0.05..=0.95, 0.5, "Share of the mass on the motor's side of the resonance or the backlash.";
    backlash_um: 0.0..=10_000.0, 0.0, "Backlash between motor and table; without a resonance the teeth oscillate at 500 Hz.";
    offset_mv: -1000.0..=1000.0, 3.0, "Offset of converter and amplifier.";
    gravity_n: -1_000_000.0..=1_000_000.0, 0.0, "Weight less its counterweight; negative towards smaller positions.";
    ripple_n: 0.0..=100_000.0, 1.3878, "Amplitude of a force that repeats with every turn of the screw.";
    max_velocity_mm_s: 0.1..=1000.0, 250.0, "Largest velocity of the axis; without it less if the encoder's counter cannot follow.";
    max_acceleration_mm_s2: 1.0..=30_000.0, 2000.0, "Largest acceleration of its motions.";
    screw_lead_mm: 0.1..=1000.0, 10.0, "Lead of the screw.";
}
