//! `cargo xtask figures`: the pages against the committed figures that they repeat.
//!
//! A golden file is written by the command that measures it. What a page says of it is listed here as a sentence or a row of a
//! table with the names of its figures, so that neither goes on without the other.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;

use anyhow::{Context, Result, bail, ensure};
use toml::Value;
use xtask::{command, golden};

/// The files of committed figures, and what they are called here.
const FILES: [(&str, &str); 4] = [
    ("count", golden::INSTRUCTIONS),
    ("cycles", golden::CYCLES),
    ("jitter", golden::JITTER),
    ("sizes", golden::SIZES),
];

/// Pages and what they say, with figures as `{file: table.key}`, or sums and differences of several.
const SENTENCES: &[(&str, &str)] = &[
    (
        "docs/tick.md",
        "| **all** | **{count: f32.total.mean}** | | |",
    ),
    ("docs/tick.md", "| usual | {count: f32.total.max} |"),
    (
        "docs/tick.md",
        "| a stream | {count: f32, stream.total.max} |",
    ),
    (
        "docs/tick.md",
        "| homing | {count: f32, homing.total.max} |",
    ),
    (
        "docs/tick.md",
        "| **of any kind** (enabling) | {count: f32, enable.total.max} |",
    ),
    (
        "docs/tick.md",
        "| {cycles: f32.no_wait_states} |\n| **with the converter** | | | | {cycles: f32.no_wait_states + converter.no_wait_states} |",
    ),
    (
        "docs/tick.md",
        "every line is waited for:\n{cycles: f32.no_cache + converter.no_cache} cycles",
    ),
    (
        "docs/tick.md",
        "both are beyond, {cycles: fixed.no_wait_states} and {cycles: fixed.no_cache} cycles without the converter",
    ),
    (
        "docs/tick.md",
        "| {jitter: f32.min} | {jitter: f32.max} | **{jitter: f32.max - f32.min}** |",
    ),
    (
        "docs/commands.md",
        "| {count: f32.total.mean} (largest {count: f32.total.max}) | {count: fixed.total.mean} (largest {count: fixed.total.max}) |",
    ),
    (
        "docs/learning.md",
        "N-PID): {count: f32, NPid, Combined.total.mean} a tick without, {count: f32, NPid, Combined, learning.total.mean} with it on every \
         axis; the\nlongest {count: f32, NPid, Combined.total.max} and {count: f32, NPid, Combined, learning.total.max}.",
    ),
    (
        "docs/learning.md",
        "in fixed point, {count: fixed, NPid, Combined.total.mean} and {count: fixed, NPid, Combined, learning.total.mean}, ",
    ),
    (
        "docs/tick.md",
        "The converter's driver comes on top, {cycles: converter.no_wait_states} cycles.",
    ),
    (
        "docs/board-nucleo-f446re.md",
        "outputs off are that short, {count: f32, enable.total.min} instructions and more; the shortest counted that drives takes {count: f32, motions start.total.min}.",
    ),
    (
        "docs/board-nucleo-f446re.md",
        "is {cycles: converter.no_wait_states} cycles at most in the whole interrupt",
    ),
    (
        "docs/memory.md",
        "| flash | 349 460 | {sizes: nucleo-f446re-f32.flash} |",
    ),
    (
        "docs/memory.md",
        "| variables | 63 864 | {sizes: nucleo-f446re-f32.variables} |",
    ),
    (
        "docs/memory.md",
        "| stack set aside | 66 560, no bound | {sizes: nucleo-f446re-f32.stack} |",
    ),
    (
        "docs/memory.md",
        "| of which at most in use | | {sizes: nucleo-f446re-f32.stack_bound} |",
    ),
    (
        "docs/memory.md",
        "stack's bound | | {sizes: nucleo-f446re-f32.variables + nucleo-f446re-f32.stack_bound} |",
    ),
    (
        "docs/memory.md",
        "| **bound** | **{sizes: nucleo-f446re-f32.stack_bound}** |",
    ),
];

/// The stages in the table of docs/tick.md.
const STAGES: [&str; 11] = [
    "interrupt",
    "inputs and outputs",
    "queues",
    "encoders",
    "safety",
    "stage",
    "axis",
    "reference",
    "feedforward",
    "feedback",
    "telemetry",
];

/// The kinds of ticks that have a mean in the table of docs/tick.md: what the row begins with, and the kind.
const KINDS: [(&str, &str); 13] = [
    ("homing, at the same time", "homing"),
    ("the plan starts", "motions start"),
    ("lead-in: the speed of the phase changes", "lead-in"),
    ("with a snapshot, one in ten of the usual ones", "snapshot"),
    ("an index pulse", "index pulse"),
    (
        "the emergency stop is pressed: outputs off, the capture triggers",
        "fault",
    ),
    ("a stream, between two changes of segment", "stream"),
    (
        "a segment has run out: the next one is adopted, and in the tick after it the one behind it from the queue",
        "segment change",
    ),
    (
        "a capture of eight channels triggers at a level and is full two ticks later",
        "capture triggers",
    ),
    (
        "reversal: 20 ms, in which the elements stick and slip again",
        "reversal",
    ),
    ("controlled stop", "stop"),
    (
        "jog near the end of the travel, with its stop there",
        "jog, end of travel",
    ),
    ("**usual: the plan at its speed**", ""),
];

/// Laws and feedforwards in the table of docs/control-laws/README.md: the row's first two cells, and the combination.
const COMBINATIONS: [(&str, &str); 16] = [
    ("PD | static + GMS", "Pd, Combined"),
    ("PID | static + GMS", "Pid, Combined"),
    ("N-PID | static + GMS", "NPid, Combined"),
    ("gain scheduling | static + GMS", "Scheduled, Combined"),
    ("cascade P/PI | static + GMS", "Cascade, Combined"),
    ("sliding mode | static + GMS", "SlidingMode, Combined"),
    ("NCTF | static + GMS", "Nctf, Combined"),
    ("PID | none", "Pid, None"),
    ("PID | static", "Pid, Static"),
    ("PID | GMS", "Pid, Gms"),
    ("PID | Dahl", "Pid, Dahl"),
    ("PID | LuGre", "Pid, Lugre"),
    ("PID | smoothed GMS", "Pid, SmoothedGms"),
    (
        "N-PID | static + GMS, [learning](../learning.md)",
        "NPid, Combined, learning",
    ),
    (
        "N-PID | static + GMS, [cancelling](../cancelling.md) three harmonics",
        "NPid, Combined, cancelling",
    ),
    (
        "N-PID | static + GMS, learning and cancelling",
        "NPid, Combined, learning, cancelling",
    ),
];

/// Everything that the pages say of the figures: the page, and its text.
fn claims() -> Vec<(String, String)> {
    let sentences = SENTENCES
        .iter()
        .map(|(page, text)| ((*page).to_owned(), (*text).to_owned()));
    let tick = |text| ("docs/tick.md".to_owned(), text);
    let stages = STAGES
        .iter()
        .map(|stage| tick(format!("| {stage} | {{count: f32.stages.{stage}.mean}} |")));
    let kinds = KINDS.iter().map(|(row, kind)| {
        let of = |scalar: &str| match *kind {
            "" => format!("{{count: {scalar}.total.mean}} | {{count: {scalar}.total.max}}"),
            kind => format!(
                "{{count: {scalar}, {kind}.total.mean}} | {{count: {scalar}, {kind}.total.max}}"
            ),
        };
        tick(format!("| {row} | {} | {} |", of("f32"), of("fixed")))
    });
    let enabling = tick(
        "three memories begin again | | {count: f32, enable.total.max} | | {count: fixed, enable.total.max} |"
            .to_owned(),
    );
    let combinations = COMBINATIONS.iter().map(|(row, name)| {
        let of = |scalar: &str| {
            format!(
                "{{count: {scalar}, {name}.total.mean}} ({{count: {scalar}, {name}.total.max}})"
            )
        };
        let text = format!("| {row} | {} | {} |", of("f32"), of("fixed"));
        ("docs/control-laws/README.md".to_owned(), text)
    });
    sentences
        .chain(stages)
        .chain(kinds)
        .chain([enabling])
        .chain(combinations)
        .collect()
}

/// Compares the pages with the committed figures, or writes those into them.
///
/// # Errors
/// All that differs, and what a page no longer says.
pub(crate) fn run(overwrite: bool) -> Result<()> {
    let golden = read_all()?;
    let claims = claims();
    let mut pages = BTreeMap::new();
    for (page, _) in &claims {
        if !pages.contains_key(page) {
            pages.insert(page, fs::read_to_string(command::root().join(page))?);
        }
    }
    let mut wrong = Vec::new();
    for (page, text) in &claims {
        let content = pages.get_mut(page).context("every page has been read")?;
        let (literals, figures) = parts(text, &golden)?;
        let places = find(content, &literals);
        let [found] = places.as_slice() else {
            bail!(
                "{page} says `{text}` {} times instead of once: adapt it, or xtask/src/figures.rs",
                places.len()
            );
        };
        let expected = join(&literals, &figures);
        let said = &content[found.clone()];
        if said != expected {
            wrong.push(format!("{page}: {said}\n  should be: {expected}"));
            content.replace_range(found.clone(), &expected);
        }
    }
    if overwrite {
        for (page, content) in pages {
            fs::write(command::root().join(page), content)?;
        }
        println!("{} of {} places rewritten", wrong.len(), claims.len());
        return Ok(());
    }
    ensure!(
        wrong.is_empty(),
        "{}\n`cargo xtask figures --overwrite` writes them",
        wrong.join("\n")
    );
    println!("{} places hold the committed figures", claims.len());
    Ok(())
}

/// The files' tables, by the name of the file.
fn read_all() -> Result<BTreeMap<&'static str, Value>> {
    FILES
        .into_iter()
        .map(|(name, path)| {
            let text = fs::read_to_string(command::root().join(path))
                .with_context(|| format!("cannot read {path}"))?;
            let table = toml::from_str(&text).with_context(|| format!("{path} does not parse"))?;
            Ok((name, table))
        })
        .collect()
}

/// The text between the figures, and the figures as they are written; there is one more of the former.
fn parts<'a>(text: &'a str, golden: &BTreeMap<&str, Value>) -> Result<(Vec<&'a str>, Vec<String>)> {
    let (mut literals, mut figures) = (Vec::new(), Vec::new());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('{') {
        let (figure, behind) = after.split_once('}').context("a figure without its end")?;
        let (file, terms) = figure
            .split_once(": ")
            .context("a figure without its file")?;
        let table = golden
            .get(file)
            .with_context(|| format!("no file {file}"))?;
        let mut sum = 0.0;
        for added in terms.split(" + ") {
            for (index, key) in added.split(" - ").enumerate() {
                let value = value(table, key)?;
                sum += if index == 0 { value } else { -value };
            }
        }
        literals.push(before);
        figures.push(grouped(sum));
        rest = behind;
    }
    literals.push(rest);
    Ok((literals, figures))
}

/// A number of a file, by the path of its key.
fn value(table: &Value, path: &str) -> Result<f64> {
    let missing = || format!("no figure {path}");
    let value = path
        .split('.')
        .try_fold(table, |table, key| table.get(key))
        .with_context(missing)?;
    #[expect(
        clippy::cast_precision_loss,
        reason = "counts of some hundred thousand"
    )]
    let integer = value.as_integer().map(|integer| integer as f64);
    integer.or(value.as_float()).with_context(missing)
}

/// A whole number, from five digits on in groups of three.
fn grouped(value: f64) -> String {
    let digits = format!("{value:.0}");
    match digits.split_at_checked(digits.len().saturating_sub(3)) {
        Some((thousands, rest)) if thousands.len() > 1 => format!("{thousands} {rest}"),
        _ => digits,
    }
}

/// The places where literals stand with a number between each two.
fn find(content: &str, literals: &[&str]) -> Vec<Range<usize>> {
    let Some((first, rest)) = literals.split_first() else {
        return Vec::new();
    };
    let from = |start: usize| {
        let mut end = start + first.len();
        for literal in rest {
            end += number(&content[end..])?;
            end += content[end..]
                .starts_with(literal)
                .then_some(literal.len())?;
        }
        Some(start..end)
    };
    let starts = content.match_indices(first);
    starts.filter_map(|(start, _)| from(start)).collect()
}

/// The length of the number that a text begins with; groups of digits may have a space between them.
fn number(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    let mut end = 0;
    while digit(end) || (bytes.get(end) == Some(&b' ') && end > 0 && digit(end + 1)) {
        end += 1;
    }
    (end > 0).then_some(end)
}

/// Literals with figures between them.
fn join(literals: &[&str], figures: &[String]) -> String {
    let mut text = String::new();
    for (index, literal) in literals.iter().enumerate() {
        text += literal;
        text += figures.get(index).map_or("", String::as_str);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_found_whatever_it_is_and_written_in_groups() {
        let table = toml::from_str("[a.total]\nmean = 2378.6\n[b]\nmost = 14784.0").unwrap();
        let golden = BTreeMap::from([("count", table)]);
        let text = "| {count: a.total.mean} of {count: b.most - a.total.mean + a.total.mean} |";
        let (literals, figures) = parts(text, &golden).unwrap();
        assert_eq!(join(&literals, &figures), "| 2379 of 14 784 |");
        let page = "| 1 | 23 |\n| 2401 of 15 000 |";
        assert_eq!(find(page, &literals).first(), Some(&(11..page.len())));
        assert!(find("| of 15 000 |", &literals).is_empty());
        assert!(parts("{count: c.most}", &golden).is_err());
    }
}
