//! The way of a count through the control interrupt, as ARCHITECTURE.md has it, against the functions of a real trace.

use std::collections::BTreeSet;
use std::fs;

use anyhow::{Context, Result, ensure};
use xtask::command::root;

/// The page, and the heading of the way.
const PAGE: &str = "ARCHITECTURE.md";
const HEADING: &str = "### One encoder count to its converter word";

/// Checks that each function that the page names was executed.
pub(crate) fn check(executed: &BTreeSet<String>) -> Result<()> {
    let page = fs::read_to_string(root().join(PAGE)).context(PAGE)?;
    let named = named(&page).with_context(|| format!("{PAGE} has no heading {HEADING:?}"))?;
    ensure!(
        !named.is_empty(),
        "{PAGE} names no function below {HEADING:?}"
    );
    let missing: Vec<&str> = named
        .iter()
        .copied()
        .filter(|name| !executed.iter().any(|function| is(function, name)))
        .collect();
    ensure!(
        missing.is_empty(),
        "{PAGE} says that a tick goes through {}, and no traced tick did",
        missing.join(", ")
    );
    Ok(())
}

/// The functions that are named below the heading, such as `Axis::drive`.
fn named(page: &str) -> Option<Vec<&str>> {
    let (_, below) = page.split_once(HEADING)?;
    let section = below.split("\n### ").next()?;
    let quoted = section.split('`').skip(1).step_by(2);
    Some(quoted.filter(|text| text.contains("::")).collect())
}

/// True if a demangled function, `<quadrant_law::axis::Axis<f32, 8>>::drive`, is the one of this name, `Axis::drive`.
fn is(function: &str, name: &str) -> bool {
    let Some((of, method)) = name.split_once("::") else {
        return false;
    };
    // `tick::<u8>` has its own generics behind it.
    let bare = match function.rsplit_once("::<") {
        Some((bare, generics)) if !generics.contains("::") => bare,
        _ => function,
    };
    let Some((path, last)) = bare.rsplit_once("::") else {
        return false;
    };
    let mut words = path.split(|c: char| !c.is_alphanumeric() && c != '_');
    last == method && words.any(|word| word == of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_known_by_type_and_name() {
        let drive = "<quadrant_law::axis::Axis<f32, 8>>::drive";
        assert!(is(drive, "Axis::drive"));
        assert!(!is(drive, "Axis::drive_open"));
        assert!(!is(drive, "Stage::drive"));
        let write = "<quadrant_firmware::board::mps2::Outputs as quadrant::hal::Amplifiers>::write";
        assert!(is(write, "Amplifiers::write"));
        assert!(is(
            "quadrant::app::control::Control<f32>::tick::<u8>",
            "Control::tick"
        ));
    }

    #[test]
    fn a_way_through_what_did_not_run_is_refused() {
        let page = fs::read_to_string(root().join(PAGE)).expect("the page");
        let mut executed: BTreeSet<String> = named(&page)
            .expect("the heading")
            .iter()
            .map(|name| format!("quadrant::{name}"))
            .collect();
        check(&executed).expect("all of it ran");
        executed.remove("quadrant::Axis::drive");
        let error = check(&executed).expect_err("one is missing");
        assert!(error.to_string().contains("Axis::drive"), "{error}");
    }
}
