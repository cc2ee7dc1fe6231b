//! The common part of all command lines and lines of the console.

use clap::Command;
use clap::error::{ContextKind, ErrorKind};

/// A grammar in which every value may begin with a minus and a digit: a negative number is refused by its range, and is no unknown
/// option.
pub(super) fn with_negative_numbers(grammar: Command) -> Command {
    grammar
        .mut_args(|argument| {
            let takes_value = argument.get_action().takes_values();
            // Words that are passed on may be anything already.
            if takes_value && !argument.is_allow_hyphen_values_set() && !argument.is_last_set() {
                argument.allow_negative_numbers(true)
            } else {
                argument
            }
        })
        .mut_subcommands(with_negative_numbers)
}

/// The message of a refused line in plain words: a number with a decimal comma is refused with the one that is meant.
pub(super) fn message(error: &clap::Error) -> String {
    let text = error.to_string();
    let text = text.replace("invalid float literal", "no number");
    let value = error.get(ContextKind::InvalidValue);
    match value.map(ToString::to_string) {
        Some(value) if error.kind() == ErrorKind::ValueValidation => {
            with_point(&value).map_or(text.clone(), |meant| {
                let remedy = format!("no number; a decimal point is meant: {meant}");
                text.replacen("no number", &remedy, 1)
            })
        }
        _ => text,
    }
}

/// A number whose decimals follow a comma, with a point.
fn with_point(value: &str) -> Option<String> {
    let (whole, decimals) = value.split_once(',')?;
    let meant = format!("{whole}.{decimals}");
    meant.parse::<f64>().is_ok().then_some(meant)
}
