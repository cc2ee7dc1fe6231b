//! The parts of a report and the files they are kept in.

use std::cell::Cell;
use std::path::Path;

use indicatif::ProgressBar;
use quadrant_cli::law_settings::LawSettings;
use quadrant_report::{Block, Cell as TableCell, Column, Page, Section, Table};
use quadrant_studies::report::{Context, Part, Progress, Request, compute};

thread_local! {
    /// Parts computed in this test.
    static COMPUTED: Cell<u32> = const { Cell::new(0) };
    /// True while the second part ends with an error.
    static INTERRUPTED: Cell<bool> = const { Cell::new(false) };
}

/// A section with numbers that are awkward in a file.
fn section(id: &str, seed: u64) -> Section {
    COMPUTED.set(COMPUTED.get() + 1);
    let value = |value| TableCell::number(value, 3);
    Section {
        id: id.to_owned(),
        heading: id.to_owned(),
        provenance: None,
        prose: Vec::new(),
        blocks: vec![
            Block::Table(Table {
                id: format!("{id}-table"),
                caption: "Awkward".to_owned(),
                columns: vec![Column::new("a"), Column::new("b"), Column::new("c")],
                rows: vec![
                    vec![value(0.1 + 0.2), value(f64::NAN), TableCell::Missing],
                    vec![value(seed as f64 / 3.0), value(-0.0), value(f64::INFINITY)],
                ],
            })
            .labelled("Table 9.9"),
        ],
    }
}

const PARTS: [Part; 2] = [
    Part {
        id: "first",
        title: "always works",
        expected_s: |_| 1.0,
        needs_comparison: false,
        run: |context: &Context, progress: &Progress| {
            progress.at(0.5);
            Ok(vec![section("first", context.seed)])
        },
    },
    Part {
        id: "second",
        title: "can be interrupted",
        expected_s: |_| 3.0,
        needs_comparison: false,
        run: |context: &Context, progress: &Progress| {
            progress.advance(0.25);
            if INTERRUPTED.get() {
                anyhow::bail!("interrupted");
            }
            Ok(vec![section("second", context.seed)])
        },
    },
];

/// The sections, or the error; the progress lines; how many parts were computed.
fn report(
    folder: &Path,
    context: &Context,
    fresh: bool,
) -> (Result<Vec<Section>, String>, Vec<String>, u32) {
    COMPUTED.set(0);
    let mut lines = Vec::new();
    let done = compute(
        &Request {
            parts: &PARTS,
            context,
            folder: folder.to_owned(),
            fresh,
        },
        &ProgressBar::hidden(),
        &mut |line| lines.push(line),
    );
    let sections = done
        .map(|done| done.into_iter().flat_map(|done| done.sections).collect())
        .map_err(|error| format!("{error:#}"));
    (sections, lines, COMPUTED.get())
}

fn context(seed: u64) -> Context {
    Context::new(seed, 2, LawSettings::default()).unwrap()
}

fn html(sections: Vec<Section>) -> String {
    let page = Page {
        title: "Parts".to_owned(),
        subtitle: String::new(),
        provenance: context(1).provenance(&[]),
        sections,
    };
    page.to_html().unwrap()
}

#[test]
fn an_interrupted_report_goes_on_where_it_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let context = context(1);
    INTERRUPTED.set(true);
    let (interrupted, _, computed) = report(folder.path(), &context, false);
    assert_eq!(interrupted.unwrap_err(), "part second: interrupted");
    assert_eq!(computed, 1);

    INTERRUPTED.set(false);
    let (resumed, lines, computed) = report(folder.path(), &context, false);
    assert_eq!(computed, 1, "the first part was computed again");
    assert!(
        lines.len() == 1 && lines[0].starts_with("first: kept from"),
        "{lines:?}"
    );

    let (fresh, lines, computed) = report(folder.path(), &context, true);
    assert_eq!((computed, lines.len()), (2, 0));
    assert!(html(resumed.unwrap()) == html(fresh.unwrap()));
}

#[test]
fn every_section_says_which_command_makes_it_again() {
    let folder = tempfile::tempdir().unwrap();
    let (sections, ..) = report(folder.path(), &context(4), false);
    for section in sections.unwrap() {
        let provenance = section.provenance.unwrap();
        let expected = format!(
            "quadrant-studies report --only {} --seed 4 --seeds 2",
            section.id
        );
        assert_eq!(provenance.command, expected);
        assert_eq!(provenance.seed, Some(4));
    }
}

#[test]
fn a_file_that_is_damaged_or_of_other_inputs_is_said_so_and_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    let context_1 = context(1);
    let again = |context: &Context, reason: &str| {
        let (sections, lines, computed) = report(folder.path(), context, false);
        assert!(
            lines.iter().any(|line| line.contains(reason)),
            "{reason}: {lines:?}"
        );
        assert!(computed >= 1);
        sections.unwrap()
    };
    report(folder.path(), &context_1, false).0.unwrap();

    let path = folder.path().join("first.json");
    let whole = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    again(&context_1, "first.json holds no part: EOF");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), whole);

    std::fs::copy(folder.path().join("second.json"), &path).unwrap();
    again(
        &context_1,
        "first.json is of another part: first is computed again",
    );

    std::fs::write(
        &path,
        whole.replacen("\"version\":\"", "\"version\":\"9", 1),
    )
    .unwrap();
    again(
        &context_1,
        "first.json is of another version of this program",
    );

    again(&context(2), "first.json is of another seed");
    again(
        &Context::new(2, 3, LawSettings::default()).unwrap(),
        "first.json is of another number of seeds",
    );

    let mut other = Context::new(2, 3, LawSettings::default()).unwrap();
    other.settings.stage.axes[0].feedback.pid.kp_v_per_mm *= 1.01;
    again(&other, "first.json is of other settings");
    let (_, lines, computed) = report(folder.path(), &other, false);
    assert_eq!(computed, 0, "{lines:?}");
}
