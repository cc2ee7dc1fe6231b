//! Proof that the realtime function of the linked component cannot panic, allocate or call the operating system: whatever it can reach by
//! calls and jumps neither is named so nor leaves the module, but to copy, clear and compare memory.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use anyhow::{Context, Result, ensure};
use xtask::command;

/// The realtime function.
const ROOT: &str = "quadrant_tick";
/// A function that allocates, so that the search is seen to find something.
const ALLOCATES: &str = "quadrant_start";
/// Functions of the C library that may be called.
const EXTERNAL: [&str; 4] = ["memcpy", "memmove", "memset", "bcmp"];
/// Parts of names that must not be reached: what panics, allocates, formats text or is the operating system's.
const FORBIDDEN: [&str; 6] = ["panic", "_fail", "alloc", "::fmt", "std::", "@plt"];
/// Instructions within which a jump by a table adds the entry to the table's address.
const TABLE_JUMP: usize = 5;
/// Reached from the end of the root alone, if something that it calls unwinds: nothing does that cannot panic.
const UNWINDS: &str = "panic_cannot_unwind";

/// An instruction: its name and operands, of which a comment is part.
type Instruction = (String, String);

/// The code of a module.
struct Code {
    /// Name and instructions of each function, by its address.
    functions: BTreeMap<u64, (String, Vec<Instruction>)>,
    /// Entries of the loader, by their address: a function's address (`*ABS*+0x1234`), or the name of one elsewhere.
    table: HashMap<u64, String>,
}

fn hexadecimal(text: &str) -> Option<u64> {
    u64::from_str_radix(text, 16).ok()
}

impl Code {
    fn of(module: &Path) -> Result<Self> {
        let dump = |options: &[&str]| {
            command::output(command::command("objdump").args(options).arg(module))
        };
        let mut functions: BTreeMap<u64, (String, Vec<Instruction>)> = BTreeMap::new();
        for line in dump(&["-d", "-C", "--no-show-raw-insn"])?.lines() {
            if let Some((address, name)) = line
                .strip_suffix(">:")
                .and_then(|line| line.split_once(" <"))
            {
                let address = hexadecimal(address).context("an address")?;
                functions.insert(address, (name.to_owned(), Vec::new()));
            } else if let Some((_, text)) = line.split_once(":\t")
                && let Some((_, (_, instructions))) = functions.iter_mut().next_back()
            {
                let (name, operands) = text.split_once(' ').unwrap_or((text, ""));
                instructions.push((name.to_owned(), operands.trim().to_owned()));
            }
        }
        let table = dump(&["-R"])?;
        let entries = table.lines().filter_map(|line| {
            let mut words = line.split_whitespace();
            Some((hexadecimal(words.next()?)?, words.nth(1)?.to_owned()))
        });
        Ok(Self {
            functions,
            table: entries.collect(),
        })
    }

    /// The function that covers an address.
    fn at(&self, address: u64) -> Option<u64> {
        self.functions
            .range(..=address)
            .next_back()
            .map(|(start, _)| *start)
    }

    /// Entry that the loader puts at the address in an instruction's comment.
    fn loaded(&self, operands: &str) -> Option<&str> {
        let (_, comment) = operands.split_once("# ")?;
        let address = hexadecimal(comment.split_whitespace().next()?)?;
        self.table.get(&address).map(String::as_str)
    }

    /// The destinations of an instruction of a function; none for one whose destination is not known.
    fn destinations(&self, instructions: &[Instruction], index: usize) -> Option<Vec<String>> {
        let (name, operands) = &instructions[index];
        if !name.starts_with("call") && !name.starts_with('j') {
            return Some(Vec::new());
        }
        if !operands.starts_with('*')
            && let Some((address, _)) = operands.split_once(" <")
        {
            return Some(vec![format!("*ABS*+0x{address}")]);
        }
        if let Some(loaded) = self.loaded(operands) {
            return Some(vec![loaded.to_owned()]);
        }
        let register = operands.strip_prefix('*')?;
        let writes = |operands: &str| {
            let to = operands.split(" #").next().unwrap_or_default();
            to.trim_end().ends_with(&format!(",{register}"))
        };
        if name.starts_with('j') {
            // A table of a `match`: its entry is added to its address just before.
            let before = &instructions[index.saturating_sub(TABLE_JUMP)..index];
            let from_table = before
                .iter()
                .any(|(name, operands)| name == "add" && writes(operands));
            return from_table.then(Vec::new);
        }
        // A function's address that the same function loads.
        let found: Vec<String> = instructions
            .iter()
            .filter(|(_, operands)| writes(operands))
            .filter_map(|(name, operands)| match name.as_str() {
                "mov" => self.loaded(operands).map(str::to_owned),
                "lea" => {
                    let (_, comment) = operands.split_once("# ")?;
                    let (address, _) = comment.split_once(" <")?;
                    let starts = self.functions.contains_key(&hexadecimal(address)?);
                    starts.then(|| format!("*ABS*+0x{address}"))
                }
                _ => None,
            })
            .collect();
        (!found.is_empty()).then_some(found)
    }
}

/// Follows what a function can reach; returns how many functions that are, and what is forbidden among it.
fn search(code: &Code, root: &str) -> Result<(usize, Vec<String>)> {
    let mut functions = code.functions.iter();
    let found = functions.find(|(_, (name, _))| name == root);
    let (root_start, _) = found.with_context(|| format!("there is no {root}"))?;
    let mut reached = BTreeMap::from([(*root_start, root.to_owned())]);
    let mut waiting = vec![*root_start];
    let mut findings = Vec::new();
    while let Some(start) = waiting.pop() {
        let (_, instructions) = &code.functions[&start];
        let chain = reached[&start].clone();
        for (index, (what, operands)) in instructions.iter().enumerate() {
            let Some(destinations) = code.destinations(instructions, index) else {
                findings.push(format!("{chain}: {what} {operands}"));
                continue;
            };
            for destination in destinations {
                let Some(address) = destination.strip_prefix("*ABS*+0x") else {
                    let function = destination.split('@').next().unwrap_or_default();
                    if !EXTERNAL.contains(&function) {
                        findings.push(format!("{chain} -> {destination}"));
                    }
                    continue;
                };
                let target = hexadecimal(address).and_then(|address| code.at(address));
                let target = target.with_context(|| format!("{chain} -> {destination}"))?;
                let (to, _) = &code.functions[&target];
                if reached.contains_key(&target) || start == *root_start && to.contains(UNWINDS) {
                    continue;
                }
                let chain = format!("{chain} -> {to}");
                if FORBIDDEN.iter().any(|part| to.contains(part)) {
                    findings.push(chain);
                    continue;
                }
                reached.insert(target, chain);
                waiting.push(target);
            }
        }
    }
    Ok((reached.len(), findings))
}

/// Proves a module that was linked with its symbols.
pub(crate) fn prove(module: &Path) -> Result<()> {
    let code = Code::of(module)?;
    let (_, allocations) = search(&code, ALLOCATES)?;
    ensure!(
        !allocations.is_empty(),
        "{ALLOCATES} allocates, and the search does not find it"
    );
    let (reached, findings) = search(&code, ROOT)?;
    for finding in &findings {
        println!("  FORBIDDEN {finding}");
    }
    ensure!(
        findings.is_empty(),
        "{} things that {ROOT} can reach are forbidden there",
        findings.len()
    );
    println!(
        "{reached} functions can be reached from {ROOT}: none panics, allocates or calls the operating system"
    );
    Ok(())
}
