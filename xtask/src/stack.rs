//! A bound of the stack: the deepest chain of calls at each priority, from the linked image.
//!
//! Calls by address go to the functions whose address is in the image. Which of them, a few rules say:
//!
//! - what pads and writes text ([`PADDING`]) calls writers of text alone;
//! - the other code of `core::fmt`, and what implements its traits, calls writers and formatters;
//! - all other code may call any of them.
//!
//! Formatters call each other by way of `core::fmt::write`: an error shows the error it holds. Each is counted once in a
//! chain, all together: no error holds itself. Another recursion is known with its depth ([`RECURSIONS`]), or refused.
//!
//! A panic is not added where it may happen but once, on top of everything, as is an interrupt that nobody asked for:
//! neither returns. A hard fault starts the stack afresh.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use anyhow::{Context, Result, bail, ensure};
use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;

use crate::frames::{FRESH, Frames, Node};
use xtask::image::Image;

/// Of a floating-point unit's context, the words to align it included: what the processor saves for a handler.
const EXCEPTION_FRAME_BYTES: u32 = 4 * 27;
/// Function that uses up the stack to inject a fault.
const USES_UP: &str = "fault_injection::dig";
/// Functions that no chain goes through: one counts once, the other is meant to leave no stack.
const LEFT_OUT: [&str; 2] = [PANIC, USES_UP];
/// Functions that call themselves, and how many of each can be under way: `frexp` scales a subnormal number, once.
const RECURSIONS: [(&str, u32); 1] = [("libm::math::frexp::frexp", 2)];
/// Function in which every panic ends.
const PANIC: &str = "__rustc::rust_begin_unwind";
/// The start, after which its frame is gone. It lets interrupts in at its end, when those that it called have returned.
const START: &str = "__rtic_init_resources";
/// Handler of interrupts that nobody asked for.
const STRAY: &str = "DefaultHandler";
/// Beginnings of names, without angle brackets, of functions that write text and format nothing.
const PADDING: [&str; 3] = [
    "core::fmt::Formatter::pad",
    "core::fmt::Formatter::write_formatted_parts",
    "char as core::fmt::Debug",
];
/// Function by which formatters format something else.
const WRITE: &str = "core::fmt::write";
/// Frames that are worth a line.
const WORTH_BYTES: u32 = 128;

/// The deepest chain from a function, and what it takes.
struct Chain {
    bytes: u32,
    /// Functions and their frames, the caller first; those of a recursion together.
    steps: Vec<(String, u32)>,
}

/// Prints the deepest chain at each priority, and returns the bound.
pub(crate) fn bound(image: &Image) -> Result<u32> {
    let frames = Frames::of(image)?;
    let chain = |name: &str, without: &[&str]| -> Result<Chain> {
        let root = frames.nodes.iter().find(|(_, node)| node.name == name);
        let (&root, _) = root.with_context(|| format!("the image has no function {name}"))?;
        deepest(&frames, root, without)
    };
    let start = chain("Reset", &LEFT_OUT)?;
    let idle = chain("Reset", &[PANIC, USES_UP, START])?;
    let (&reset, _) = frames
        .nodes
        .iter()
        .find(|(_, node)| node.name == "Reset")
        .context("the image has no start")?;
    let end_of_start = down_to(&frames, reset, START)?;
    let mut handlers = Vec::new();
    let mut fresh = None;
    let mut last = vec![(PANIC.to_owned(), chain(PANIC, &[USES_UP])?)];
    for vector in unique(&frames.vectors) {
        let name = &frames.nodes[&vector].name;
        let mut chain = deepest(&frames, vector, &LEFT_OUT)?;
        chain.bytes += EXCEPTION_FRAME_BYTES;
        match name.as_str() {
            "Reset" => {}
            FRESH => fresh = Some(chain),
            STRAY => last.push((name.clone(), chain)),
            name => handlers.push((name.to_owned(), chain)),
        }
    }
    println!("{}: the stack's deepest chains, bytes", image.target);
    print("start", &start);
    print("idle", &idle);
    println!("  {end_of_start:6} the end of the start, where interrupts come in");
    for (name, chain) in &handlers {
        print(name, chain);
    }
    let last = last.into_iter().max_by_key(|(_, chain)| chain.bytes);
    let (name, end) = last.context("there is an end")?;
    print(&format!("the end: {name}"), &end);
    let fresh = fresh.context("the image has no hard fault handler")?;
    print(FRESH, &fresh);
    let running: u32 = handlers.iter().map(|(_, chain)| chain.bytes).sum();
    let below = idle.bytes.max(end_of_start);
    let busy = start.bytes.max(below + running) + end.bytes;
    let bytes = busy.max(fresh.bytes);
    println!(
        "  bound: the larger of start, and of idle or the start's end with every handler on top of it, and the end: {bytes}"
    );
    Ok(bytes)
}

fn print(name: &str, chain: &Chain) {
    println!("  {:6} {name}", chain.bytes);
    for (name, bytes) in chain
        .steps
        .iter()
        .filter(|(_, bytes)| *bytes >= WORTH_BYTES)
    {
        println!("           {bytes:6} {name}");
    }
}

fn unique(vectors: &[u32]) -> Vec<u32> {
    let mut vectors = vectors.to_vec();
    vectors.sort_unstable();
    vectors.dedup();
    vectors
}

/// Returns true if a function that is called by its address writes text.
fn writes(name: &str) -> bool {
    let (_, method) = name.rsplit_once("::").unwrap_or_default();
    name.contains(" as core::fmt::Write>::") && matches!(method, "write_str" | "write_char")
}

/// Returns true if a function that is called by its address formats a value.
fn formats(name: &str) -> bool {
    name.contains(" as core::fmt::") && name.ends_with(">::fmt")
}

/// Returns true if an address that `caller` calls may be that of `callee`.
fn may_call(caller: &str, callee: &str) -> bool {
    let plain = caller.replace(['<', '>'], "");
    if PADDING.iter().any(|start| plain.starts_with(start)) || writes(caller) {
        writes(callee)
    } else if caller.contains("core::fmt::") {
        writes(callee) || formats(callee)
    } else {
        true
    }
}

/// The frames on the shortest way from a function to the one whose name contains `part`, without those that this calls.
fn down_to(frames: &Frames, root: u32, part: &str) -> Result<u32> {
    let mut waiting = VecDeque::from([(root, 0)]);
    let mut seen = BTreeSet::from([root]);
    while let Some((address, above)) = waiting.pop_front() {
        let node = &frames.nodes[&address];
        let bytes = above + node.bytes;
        if node.name.contains(part) {
            return Ok(bytes);
        }
        waiting.extend(
            node.calls
                .iter()
                .filter(|callee| seen.insert(**callee))
                .map(|callee| (*callee, bytes)),
        );
    }
    bail!("{} does not lead to {part}", frames.nodes[&root].name)
}

/// Returns the number of calls of a function that may be under way, if it is one that calls itself.
fn times(node: &Node) -> Option<u32> {
    let known = RECURSIONS.iter().find(|(name, _)| *name == node.name);
    known.map(|(_, times)| *times)
}

/// The deepest chain from a function, without those whose names contain one of `without`.
fn deepest(frames: &Frames, root: u32, without: &[&str]) -> Result<Chain> {
    let left_out = |node: &Node| without.iter().any(|part| node.name.contains(part));
    let mut graph = DiGraphMap::<u32, ()>::new();
    let mut waiting = vec![root];
    graph.add_node(root);
    while let Some(address) = waiting.pop() {
        let node = &frames.nodes[&address];
        let by_address = frames
            .by_address
            .iter()
            .filter(|callee| node.is_indirect && may_call(&node.name, &frames.nodes[*callee].name));
        for &callee in node.calls.iter().chain(by_address) {
            if left_out(&frames.nodes[&callee]) {
                continue;
            }
            if !graph.contains_node(callee) {
                waiting.push(callee);
            }
            graph.add_edge(address, callee, ());
        }
    }
    // Callees come before their callers.
    let groups = tarjan_scc(&graph);
    let mut group_of = BTreeMap::new();
    let mut depths: Vec<(u32, Option<usize>)> = Vec::new();
    for (index, group) in groups.iter().enumerate() {
        for &address in group {
            group_of.insert(address, index);
        }
        let recursive = group.len() > 1 || graph.contains_edge(group[0], group[0]);
        let repeated = match group.as_slice() {
            [alone] if recursive => times(&frames.nodes[alone]),
            _ => None,
        };
        if recursive && repeated.is_none() {
            refuse_unless_formatting(frames, group)?;
        }
        let callees = group.iter().flat_map(|&address| graph.neighbors(address));
        let deepest = callees
            .map(|callee| group_of[&callee])
            .filter(|&callee| callee != index)
            .max_by_key(|&callee| depths[callee].0);
        let own: u32 = group
            .iter()
            .map(|address| frames.nodes[address].bytes)
            .sum();
        let own = own * repeated.unwrap_or(1);
        depths.push((own + deepest.map_or(0, |callee| depths[callee].0), deepest));
    }
    let mut next = group_of.get(&root).copied();
    let bytes = next.map_or(0, |group| depths[group].0);
    let mut steps = Vec::new();
    while let Some(index) = next {
        let group = &groups[index];
        let name = match group.as_slice() {
            [alone] => frames.nodes[alone].name.clone(),
            several => format!(
                "{} functions that format by calling each other",
                several.len()
            ),
        };
        let own = group.iter().map(|address| frames.nodes[address].bytes);
        steps.push((name, own.sum()));
        next = depths[index].1;
    }
    Ok(Chain { bytes, steps })
}

/// Only formatting may be recursive: by way of [`WRITE`], or a wrapper of a formatter in itself.
fn refuse_unless_formatting(frames: &Frames, group: &[u32]) -> Result<()> {
    let names: Vec<_> = group
        .iter()
        .map(|address| frames.nodes[address].name.as_str())
        .collect();
    let formatting =
        names.contains(&WRITE) || names.iter().all(|name| name.contains("core::fmt::"));
    ensure!(
        formatting,
        "{} can be called again before it returns, and nothing says how often",
        names.join(", ")
    );
    Ok(())
}

/// Compares the bound with the stack that an image sets aside.
pub(crate) fn check(image: &Image) -> Result<u32> {
    let bytes = bound(image)?;
    let size = image.symbol("_stack_start")? - image.symbol("_stack_end")?;
    ensure!(
        u64::from(bytes) <= size,
        "{}: up to {bytes} bytes of the stack may be in use, but {size} are set aside in board_memory.x",
        image.target
    );
    println!("  set aside: {size}");
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(functions: &[(&str, u32, &[u32], bool)], by_address: &[u32]) -> Frames {
        let nodes = functions.iter().enumerate().map(|(index, function)| {
            let &(name, bytes, calls, is_indirect) = function;
            let node = Node {
                name: name.into(),
                bytes,
                calls: calls.iter().copied().collect(),
                is_indirect,
            };
            (index as u32, node)
        });
        Frames {
            nodes: nodes.collect(),
            by_address: by_address.iter().copied().collect::<BTreeSet<_>>(),
            vectors: Vec::new(),
        }
    }

    #[test]
    fn the_deepest_chain_is_taken_and_not_the_longest() {
        let frames = frames(
            &[
                ("root", 8, &[1, 3], false),
                ("a", 16, &[2], false),
                ("b", 16, &[], false),
                ("c", 100, &[], false),
            ],
            &[],
        );
        let chain = deepest(&frames, 0, &[]).expect("no recursion");
        assert_eq!(chain.bytes, 108);
        assert_eq!(deepest(&frames, 0, &["c"]).expect("none").bytes, 40);
    }

    #[test]
    fn calls_by_address_reach_every_callable_function() {
        let functions: [(&str, u32, &[u32], bool); 4] = [
            ("root", 8, &[], true),
            ("closure", 50, &[], false),
            ("<X as core::fmt::Display>::fmt", 70, &[], false),
            ("<core::fmt::Formatter>::pad", 8, &[], true),
        ];
        let all = frames(&functions, &[1, 2]);
        assert_eq!(deepest(&all, 0, &[]).expect("none").bytes, 78);
        assert_eq!(deepest(&all, 3, &[]).expect("none").bytes, 8);
        let one = frames(&functions, &[1]);
        assert_eq!(deepest(&one, 0, &[]).expect("none").bytes, 58);
    }

    #[test]
    fn interrupts_come_in_on_top_of_the_starts_own_frame() {
        let functions: [(&str, u32, &[u32], bool); 4] = [
            ("Reset", 8, &[1], false),
            ("main", 16, &[2, 3], false),
            ("app::__rtic_init_resources", 100, &[3], false),
            ("new", 1000, &[], false),
        ];
        let frames = frames(&functions, &[]);
        assert_eq!(down_to(&frames, 0, START).expect("it leads there"), 124);
        assert!(down_to(&frames, 3, START).is_err());
    }

    #[test]
    fn a_known_recursion_counts_as_often_as_it_can_be_under_way() {
        let functions: [(&str, u32, &[u32], bool); 2] = [
            ("root", 8, &[1], false),
            ("libm::math::frexp::frexp", 48, &[1], false),
        ];
        let frames = frames(&functions, &[]);
        assert_eq!(deepest(&frames, 0, &[]).expect("known").bytes, 104);
    }

    #[test]
    fn formatters_count_once_each_and_other_recursion_is_refused() {
        let functions: [(&str, u32, &[u32], bool); 3] = [
            ("core::fmt::write", 8, &[], true),
            ("<X as core::fmt::Display>::fmt", 70, &[0], false),
            ("again", 8, &[2], false),
        ];
        let frames = frames(&functions, &[1]);
        assert_eq!(deepest(&frames, 0, &[]).expect("formatting").bytes, 78);
        assert!(deepest(&frames, 2, &[]).is_err());
    }
}
