//! `cargo xtask prove-no-panic`: nothing that panics, allocates, divides by a helper or computes in f64 can be reached
//! from the control interrupt. The proof is over the linked image, after all inlining.

use anyhow::{Result, ensure};

use crate::call_graph::CallGraph;
use crate::image::{self, Image, Target};
use crate::listing::{Function, Listing};
use crate::toolchain::Toolchain;

/// The control interrupt's handler.
pub const ROOT: &str = "CONTROL_TICK";

/// Parts of names of functions that must not be reachable, and why.
const FORBIDDEN_NAMES: [(&str, &str); 10] = [
    ("panic", "panics"),
    ("unwrap_failed", "panics"),
    ("expect_failed", "panics"),
    ("_fail", "panics"),
    ("handle_alloc_error", "allocates"),
    ("__rust_alloc", "allocates"),
    ("alloc::alloc::", "allocates"),
    ("core::fmt::", "formats text"),
    ("fault::fail", "ends the firmware"),
    ("sys_reset", "restarts the board"),
];

/// Parts of names of the functions that may be reached: the project's own, and what copies, clears, adds and compares in a bounded time.
const ALLOWED_NAMES: [&str; 9] = [
    "quadrant",
    ROOT,
    "__aeabi_mem",
    "compiler_builtins::mem::",
    "__aeabi_fadd",
    "__aeabi_fcmp",
    "__aeabi_fsub",
    "compiler_builtins::float::add",
    "compiler_builtins::float::cmp",
];

/// Beginnings of linker symbols that must not be reachable, and why.
const FORBIDDEN_SYMBOLS: [(&str, &str); 13] = [
    ("__aeabi_d", "computes in f64"),
    ("__aeabi_cd", "computes in f64"),
    ("__aeabi_idiv", "divides"),
    ("__aeabi_uidiv", "divides"),
    ("__aeabi_ldiv", "divides"),
    ("__aeabi_uldiv", "divides"),
    ("__aeabi_fdiv", "divides"),
    ("__div", "divides"),
    ("__udiv", "divides"),
    ("__mod", "divides"),
    ("__umod", "divides"),
    ("malloc", "allocates"),
    ("free", "allocates"),
];

/// Instructions that take long, or a time that depends on the data, that wait, or that end in another handler.
const FORBIDDEN_INSTRUCTIONS: [&str; 9] = [
    "sdiv", "udiv", "vdiv", "vsqrt", "wfi", "wfe", "svc", "bkpt", "udf",
];

/// Builds the image and proves it.
pub fn run(toolchain: Toolchain, target: Target) -> Result<()> {
    let image = image::build(toolchain, target)?;
    prove(&image)
}

/// Proves an image.
pub fn prove(image: &Image) -> Result<()> {
    let listing = Listing::of(image)?;
    let graph = CallGraph::from(&listing, image.function(ROOT)?)?;
    println!(
        "{}: {} functions can be reached from {ROOT}:",
        image.target,
        graph.reached.len()
    );
    for reached in graph.reached.values() {
        println!(
            "  {:#010x} {}",
            reached.function.range.start, reached.function.name
        );
    }
    let mut findings = Vec::new();
    for (start, reached) in &graph.reached {
        let why = forbidden_function(reached.function)
            .into_iter()
            .map(str::to_owned);
        let slow = reached.function.instructions.iter().filter(|instruction| {
            FORBIDDEN_INSTRUCTIONS
                .iter()
                .any(|forbidden| instruction.mnemonic.starts_with(forbidden))
        });
        let how = slow.map(|instruction| {
            format!(
                "has a {} at {:#x}",
                instruction.mnemonic, instruction.address
            )
        });
        findings.extend(
            why.chain(how)
                .map(|finding| format!("{}: {finding}", graph.chain(*start))),
        );
    }
    findings.extend(
        graph
            .indirect
            .iter()
            .map(|call| format!("an indirect call cannot be followed: {call}")),
    );
    for finding in &findings {
        println!("  FORBIDDEN {finding}");
    }
    ensure!(
        findings.is_empty(),
        "{} things reachable from {ROOT} are forbidden there",
        findings.len()
    );
    println!("  none panics, allocates, divides or computes in f64");
    Ok(())
}

/// Returns the reason for which a function must not be reachable, if there is one.
fn forbidden_function(function: &Function) -> Option<&'static str> {
    let Function { symbol, name, .. } = function;
    let by_name = FORBIDDEN_NAMES.iter().find(|(part, _)| name.contains(part));
    let by_symbol = FORBIDDEN_SYMBOLS
        .iter()
        .find(|(start, _)| symbol.starts_with(start));
    let reason = by_name.or(by_symbol).map(|(_, reason)| *reason);
    let is_known = ALLOWED_NAMES.iter().any(|part| name.contains(part));
    reason
        .or_else(|| is_double(symbol).then_some("computes in f64"))
        .or_else(|| {
            (!is_known).then_some("is not the project's own, and nothing says how long it takes")
        })
}

/// The compiler's own helpers for f64: `__adddf3`, `__extendsfdf2`, `__floatsidf`, `__aeabi_f2d` and their like.
fn is_double(symbol: &str) -> bool {
    symbol.starts_with("__aeabi_") && symbol.ends_with("2d")
        || symbol.starts_with("__") && symbol.contains("df")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(symbol: &str) -> Option<&'static str> {
        let name = format!("{:#}", rustc_demangle::demangle(symbol));
        forbidden_function(&Function {
            symbol: symbol.into(),
            name,
            range: 0..4,
            instructions: Vec::new(),
        })
    }

    #[test]
    fn helpers_are_distinguished() {
        assert_eq!(
            verdict("_ZN4core9panicking18panic_bounds_check17h0123456789abcdefE"),
            Some("panics")
        );
        assert_eq!(
            verdict("_ZN4core5slice5index26slice_start_index_len_fail17h0123456789abcdefE"),
            Some("panics")
        );
        assert_eq!(verdict("__aeabi_dmul"), Some("computes in f64"));
        assert_eq!(verdict("__extendsfdf2"), Some("computes in f64"));
        assert_eq!(verdict("__aeabi_ui2d"), Some("computes in f64"));
        assert_eq!(verdict("__aeabi_uldivmod"), Some("divides"));
        assert_eq!(verdict("__udivdi3"), Some("divides"));
        assert!(verdict("fmodf").is_some_and(|why| why.contains("not the project's own")));
        assert!(verdict("sqrtf").is_some());
        assert_eq!(verdict("__aeabi_fadd"), None);
        assert_eq!(verdict("__aeabi_memcpy4"), None);
        assert_eq!(verdict("CONTROL_TICK"), None);
    }
}
