//! Parts of the firmware on the host: tasks, server, store, drivers, wiring.

mod board_wiring;
mod brake_over_link;
mod capture;
mod change_detector;
mod checked_motions;
mod crash_record;
mod driver_ad5754r;
mod driver_hold_button;
mod driver_parts;
mod driver_tick_interval;
mod events;
mod friction_monitor;
mod glitch_monitor;
mod host_requests;
mod injection_over_link;
mod link_words;
mod operation;
mod oscillation_report;
mod preemption;
mod rate_limiter;
mod snapshot;
mod start_record;
mod store;
mod store_power_cut;
mod stored_bytes;
mod telemetry;
