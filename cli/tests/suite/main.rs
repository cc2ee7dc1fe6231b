//! The command `quadrant`, run as a program.
//!
//! One program of many modules: each would otherwise be linked once more.

mod about;
mod circle;
mod command;
mod commission;
mod connect;
mod connect_commission;
mod console_motion;
mod console_settings;
mod control_characters;
mod design_commands;
mod first_screen;
mod flash;
mod identify_commands;
mod interrupted;
mod kept_settings;
mod new;
mod new_from_linuxcnc;
mod own_stage;
mod pages;
mod part_program;
mod plot;
mod record_bad_input;
#[cfg(target_os = "linux")]
mod record_large;
mod sharing;
mod terminal;
mod transcript;
