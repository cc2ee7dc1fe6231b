//! `cargo xtask count --peer`: the control law alone beside the same law in C, on the same inputs in one emulated program.

use std::collections::BTreeMap;
use std::io::Read;

use anyhow::{Context, Result, ensure};
use quadrant_host::machine::emulator::Memory;
use xtask::command;
use xtask::image::{Board, Image, Scalar, Target};
use xtask::listing::Listing;
use xtask::toolchain::Toolchain;

use crate::trace::{self, for_each_instruction};

/// Package and program.
const PEER: &str = "quadrant-peer";
/// Function that calls what is counted.
const CALLER: &str = "compare";
/// What is counted, ours before the one in C, each with its name in the program.
const PAIRS: [(&str, [&str; 2]); 2] = [
    (
        "N-PID, static friction and GMS(4) fed forward",
        ["rust_law", "c_law"],
    ),
    (
        "PID; in C without bounds, filter and anti-windup",
        ["rust_pid", "c_pid"],
    ),
];

/// Instructions of each call of a function.
type Calls = Vec<u32>;

/// Runs the program, prints the counts, and fails if a word of the laws differs.
pub(crate) fn run(toolchain: Toolchain) -> Result<()> {
    let image = build(toolchain)?;
    let listing = Listing::of(&image)?;
    let functions = PAIRS.into_iter().flat_map(|(_, names)| names);
    let subjects = functions
        .map(|name| Ok((start(&listing, name)?, name)))
        .collect::<Result<BTreeMap<u32, &str>>>()?;
    let caller = start(&listing, CALLER)?;
    let (calls, log) = count(&image, &listing, &subjects, caller)?;
    println!(
        "instructions of three axes, Cortex-M4F, f32: our law, and the same in C (gcc -O3 -ffp-contract=off)"
    );
    println!(
        "  {:<50} {:>9} {:>7} {:>9} {:>7} {:>6}",
        "", "ours", "largest", "C", "largest", "ratio"
    );
    for (what, [ours, theirs]) in PAIRS {
        let (mean, largest) = figures(&calls, ours)?;
        let (c_mean, c_largest) = figures(&calls, theirs)?;
        println!(
            "  {what:<50} {mean:>9.1} {largest:>7} {c_mean:>9.1} {c_largest:>7} {:>6.2}",
            mean / c_mean
        );
    }
    let words = log
        .iter()
        .find(|line| line.contains("words compared"))
        .context("the program has compared nothing")?;
    println!("  {words}");
    ensure!(words.contains(", 0 differ"), "the laws put out other words");
    Ok(())
}

/// Builds the program.
fn build(toolchain: Toolchain) -> Result<Image> {
    let target = Target::new(Board::Mps2, Scalar::F32);
    let mut cargo = toolchain.cargo("build");
    cargo.args(["--package", PEER, "--profile", "firmware", "--target"]);
    command::run_quietly(cargo.arg(target.triple())).context("cannot build the law in C")?;
    let path = command::root()
        .join("target/firmware")
        .join(target.triple())
        .join("firmware")
        .join(PEER);
    Ok(Image {
        elf: std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?,
        compiler: toolchain.compiler()?,
        target,
        path,
    })
}

/// The first address of a function, by its name without a path.
fn start(listing: &Listing, name: &str) -> Result<u32> {
    listing
        .functions()
        .find(|function| function.name.rsplit("::").next() == Some(name))
        .map(|function| function.range.start)
        .with_context(|| format!("the program has no function `{name}`"))
}

/// Runs the program under the trace; the calls of each subject, and the log.
fn count<'a>(
    image: &Image,
    listing: &Listing,
    subjects: &BTreeMap<u32, &'a str>,
    caller: u32,
) -> Result<(BTreeMap<&'a str, Calls>, Vec<String>)> {
    let memory = Memory::create()?;
    let ranges: Vec<String> = listing
        .functions()
        .map(|function| {
            let range = &function.range;
            format!("{:#x}..{:#x}", range.start, range.end - 1)
        })
        .collect();
    let (mut emulator, mut tracer) = trace::start(image, &memory, &ranges.join(","))?;
    let lines = emulator.take_stderr().context("QEMU's trace is a pipe")?;
    // Tables and inputs are made before.
    tracer.trace_from(caller)?;
    let calls = calls(listing, subjects, caller, lines)?;
    Ok((calls, emulator.wait()?))
}

/// The calls of each subject in a trace: from its first instruction until the caller goes on.
fn calls<'a>(
    listing: &Listing,
    subjects: &BTreeMap<u32, &'a str>,
    caller: u32,
    trace: impl Read,
) -> Result<BTreeMap<&'a str, Calls>> {
    let mut calls: BTreeMap<&str, Calls> = BTreeMap::new();
    let mut open = None;
    for_each_instruction(trace, |address| {
        if let Some(name) = subjects.get(&address) {
            calls.entry(name).or_default().push(0);
            open = Some(*name);
        } else if listing.at(address).map(|f| f.range.start) == Some(caller) {
            open = None;
        }
        let call = open.and_then(|name| calls.get_mut(name)?.last_mut());
        if let Some(instructions) = call {
            *instructions += 1;
        }
        Ok(())
    })?;
    Ok(calls)
}

/// Mean and largest of a function's calls.
fn figures(calls: &BTreeMap<&str, Calls>, name: &str) -> Result<(f64, u32)> {
    let calls = calls.get(name).map(Vec::as_slice).unwrap_or_default();
    let largest = calls.iter().max();
    let largest = largest.with_context(|| format!("`{name}` was never called"))?;
    let sum: u64 = calls.iter().copied().map(u64::from).sum();
    Ok((sum as f64 / calls.len() as f64, *largest))
}
