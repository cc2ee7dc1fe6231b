//! A page as files: CSV, JSON and SVG from the same data as the HTML.

use crate::sample;
use std::collections::BTreeSet;

use crate::sample::{circle, full, lines, page, response};
use quadrant_report::{Block, Figure, Format, Plot};

const ALL: [Format; 4] = [Format::Html, Format::Csv, Format::Json, Format::Svg];

fn names(formats: &[Format]) -> BTreeSet<String> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made/on/demand");
    let written = full().write(&out, "page", formats).unwrap();
    written
        .iter()
        .map(|path| {
            assert!(path.is_file(), "{}", path.display());
            path.strip_prefix(&out)
                .unwrap()
                .to_str()
                .unwrap()
                .to_owned()
        })
        .collect()
}

#[test]
fn each_format_has_its_files() {
    let expected = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    assert_eq!(names(&[Format::Html]), expected(&["page.html"]));
    assert_eq!(names(&[Format::Json]), expected(&["page.json"]));
    let figures = ["circle", "error", "response"];
    let images: BTreeSet<String> = figures
        .iter()
        .map(|id| format!("figures/{id}.svg"))
        .collect();
    assert_eq!(names(&[Format::Svg]), images);
    let mut csv: BTreeSet<String> = figures
        .iter()
        .map(|id| format!("figures/{id}.csv"))
        .collect();
    csv.extend(["errors.csv", "labelled.csv"].map(str::to_owned));
    assert_eq!(names(&[Format::Csv]), csv);
    assert_eq!(names(&ALL).len(), 2 + 3 + 5);
    assert!(names(&[]).is_empty());
}

#[test]
fn the_same_data_give_the_same_bytes_in_every_format() {
    let [first, second] = [(), ()].map(|()| {
        let folder = tempfile::tempdir().unwrap();
        let written = full().write(folder.path(), "page", &ALL).unwrap();
        written
            .iter()
            .map(|path| std::fs::read(path).unwrap())
            .collect::<Vec<_>>()
    });
    assert_eq!(first, second);
}

#[test]
fn numbers_that_json_has_not_survive() {
    let mut table = sample::table("limits");
    table.rows[0][1] = quadrant_report::Cell::number(f64::INFINITY, 1);
    let page = page(vec![Block::Table(table), Block::Figure(response())]);
    let json = page.to_json().unwrap();
    assert!(
        json.contains("\"inf\"") && json.contains(",null,"),
        "{json}"
    );
}

#[test]
fn figures_data_are_tidy_csv_with_units_and_gaps() {
    let csv = response().to_csv().unwrap();
    let mut rows = csv.lines();
    assert_eq!(rows.next().unwrap(), "series,frequency (Hz),gain (um/V)");
    assert_eq!(rows.clone().count(), 2 * 300);
    assert!(rows.next().unwrap().starts_with("Points & co.,1,0.99"));
    let gap = csv.lines().filter(|line| line.ends_with(',')).count();
    assert_eq!(gap, 2, "the gap of both curves");
    assert!(
        circle()
            .to_csv()
            .unwrap()
            .starts_with("series,angle (rad),radial deviation (um)\nPID,0,0\n")
    );
}

#[test]
fn long_curves_are_thinned_without_losing_a_spike() {
    let mut figure = lines("long", 1, 400_000);
    let Plot::Lines(curves) = &mut figure.plot else {
        unreachable!()
    };
    curves.series[0].y[123_456] = 98.765;
    let page = page(vec![Block::Figure(figure)]);
    let json = page.to_json().unwrap();
    assert!(
        json.len() < 1_000_000 && json.contains("98.765"),
        "{} bytes",
        json.len()
    );
    let folder = tempfile::tempdir().unwrap();
    page.write(folder.path(), "page", &[Format::Csv, Format::Svg])
        .unwrap();
    let read =
        |name: &str| std::fs::read_to_string(folder.path().join("figures").join(name)).unwrap();
    let csv = read("long.csv");
    assert!(csv.lines().count() <= 8_001 && csv.contains("98.765"));
    assert!(read("long.svg").len() < 100_000);
}

/// A reader that refuses everything but well-formed XML of matching elements, and returns the texts.
fn texts(svg: &str) -> Vec<String> {
    let mut open: Vec<&str> = Vec::new();
    let mut texts = Vec::new();
    let mut rest = svg.trim_end();
    while !rest.is_empty() {
        let (text, markup) = rest.split_once('<').expect("an element follows every text");
        assert!(!text.contains('>'), "{text}");
        if !text.trim().is_empty() {
            texts.push(text.trim().to_owned());
        }
        let (element, after) = markup.split_once('>').expect("elements are closed");
        assert_eq!(
            element.matches('"').count() % 2,
            0,
            "quotes are paired: {element}"
        );
        match element.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop(), Some(name), "elements are nested"),
            None if element.ends_with('/') => {}
            None => open.push(element.split_whitespace().next().unwrap()),
        }
        rest = after;
    }
    assert!(open.is_empty(), "{open:?}");
    texts
}

fn figures() -> Vec<Figure> {
    vec![lines("error", 8, 3000), circle(), response()]
}

#[test]
fn images_are_well_formed_and_say_everything_in_text() {
    for figure in figures() {
        let svg = figure.to_svg().unwrap();
        assert!(
            !svg.contains("NaN") && !svg.contains("inf"),
            "{}",
            figure.id
        );
        let texts = texts(&svg);
        let labels: &[&str] = match figure.id.as_str() {
            "error" => &[
                "Time (s)",
                "Error (µm)",
                "law 7 &lt;/script&gt;&lt;b&gt;",
                "0.20",
                "\u{2212}10",
            ],
            "circle" => &[
                "x (mm)",
                "y (mm)",
                "PID",
                "2 µm/div",
                "+4 µm",
                "\u{2212}4 µm",
            ],
            _ => &[
                "frequency (Hz)",
                "gain (µm/V)",
                "Points &amp; co.",
                "100",
                "0.1",
            ],
        };
        for label in labels {
            assert!(
                texts.iter().any(|text| text == label),
                "{label:?} in {}: {texts:?}",
                figure.id
            );
        }
    }
}

#[test]
fn everything_in_the_data_is_drawn_in_its_colour() {
    let svg = lines("error", 8, 3000).to_svg().unwrap();
    for colour in [
        "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9",
    ] {
        let drawn = svg.matches(&format!("stroke=\"{colour}\"")).count();
        // Once as a curve and once in the legend; blue and vermillion come back dashed, a line for each dash.
        if ["#0072B2", "#D55E00"].contains(&colour) {
            assert!(drawn > 4 + 10, "{colour}: {drawn}");
        } else {
            assert_eq!(drawn, 2, "{colour}");
        }
    }
}
