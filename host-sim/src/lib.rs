//! The simulated stage under the control law, wherever Rust runs: on a host, and in a browser.
//!
//! - [`plant`]: the stage, simulated, with friction that the control law does not know exactly;
//! - [`law_machine`]: the control law and its supervisor, tick by tick; [`run`]: one run of it on the stage, and its traces;
//! - [`given_run`]: a run on references in memory, some ticks at a time;
//! - [`pulse_train`]: the pulses of a control with step and direction, and the axes that follow them;
//! - [`metrics`]: tracking error and quadrant glitch; [`sine_test`]: an axis on a sine, scored; [`benchmark_job`]: the motion
//!   that ticks are counted and timed with;
//! - [`stage_setup`]: the stage of a simulated machine, and its settings; [`identified_stage`]: those that commissioning gave;
//! - [`settings_file`]: a stage's settings with their origin, as TOML; [`toml_file`]: what such files have in common;
//! - [`stage_file`]: a stage of one's own, as TOML;
//! - [`setting_value`]: a setting's value as it crosses the link, and as JSON;
//! - [`held_plant`], [`loop_shape`], [`margins`]: the linear axis behind its converter, the open loop, its margins.
//!
//! It knows no threads, ports and clock, no link, no application of the firmware, and no channel to an emulator.
#![forbid(unsafe_code)]
// A tool, not a library for others: a comment that only repeats a name is left out.
#![allow(missing_docs)]

pub mod benchmark_job;
pub mod given_run;
pub mod held_plant;
pub mod identified_stage;
pub mod law_machine;
pub mod loop_shape;
pub mod margins;
pub mod metrics;
pub mod plant;
pub mod pulse_train;
pub mod run;
pub mod setting_value;
pub mod settings_file;
pub mod sine_test;
pub mod stage_file;
pub mod stage_setup;
pub mod toml_file;

#[cfg(test)]
mod fixtures {
    use quadrant_law::control::pid::PidGains;
    use quadrant_settings::presets;
    pub(crate) use quadrant_settings::presets::X_PLANT;

    /// The proportional and derivative gains of the x axis, chosen with its plant.
    pub(crate) const X_GAINS: PidGains = PidGains {
        ki_v_per_mm_s: 0.0,
        ..presets::X_GAINS
    };
}
