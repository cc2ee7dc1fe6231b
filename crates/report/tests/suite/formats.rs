//! A page as files: CSV, JSON and SVG from the same data as the HTML.

use crate::sample;
use std::collections::BTreeSet;

use crate::sample::{circle, dots, full, lines, page, response};
use quadrant_report::{Block, Figure, Format, Page, Plot, ReportError, Spread};

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
    let figures = ["circle", "dots", "error", "response"];
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
    assert_eq!(names(&ALL).len(), 2 + 4 + 6);
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
fn a_page_is_read_back_as_it_was_written() {
    // Curves short enough not to be thinned, so that nothing may differ.
    let mut page = full();
    page.sections[0].blocks = vec![Block::Figure(lines("short", 2, 50))];
    let json = page.to_json().unwrap();
    let read = Page::from_json(&json).unwrap();
    assert_eq!(read.to_json().unwrap(), json);
    assert_eq!(read.to_html().unwrap(), page.to_html().unwrap());
    assert_eq!(read.sections[0], page.sections[0]);
    assert_eq!(read.provenance, page.provenance);
}

#[test]
fn what_is_no_page_is_refused_with_the_reason() {
    assert!(matches!(
        Page::from_json("{"),
        Err(ReportError::Json { .. })
    ));
    let other = full()
        .to_json()
        .unwrap()
        .replace("quadrant-report/1", "quadrant-report/0");
    let error = Page::from_json(&other).unwrap_err().to_string();
    assert!(
        error.contains("quadrant-report/0") && error.contains("quadrant-report/1"),
        "{error}"
    );
    let wrong = full()
        .to_json()
        .unwrap()
        .replace("\"id\":\"errors\"", "\"id\":\"two words\"");
    assert!(matches!(
        Page::from_json(&wrong),
        Err(ReportError::BadId { .. })
    ));
}

#[test]
fn numbers_that_json_has_not_survive() {
    let mut table = sample::table("limits");
    table.rows[0][1] = quadrant_report::Cell::number(f64::INFINITY, 1);
    let page = page(vec![Block::Table(table), Block::Figure(dots())]);
    let json = page.to_json().unwrap();
    assert!(
        json.contains("\"inf\"") && json.contains("\"NaN\""),
        "{json}"
    );
    let read = Page::from_json(&json).unwrap();
    assert_eq!(read.sections[0].blocks[0], page.sections[0].blocks[0]);
}

#[test]
fn figures_data_are_tidy_csv_with_units_and_gaps() {
    let csv = response().to_csv().unwrap();
    let mut rows = csv.lines();
    assert_eq!(
        rows.next().unwrap(),
        "series,frequency (Hz),gain (um/V),low,high"
    );
    assert_eq!(rows.clone().count(), 3 * 300);
    assert!(rows.next().unwrap().starts_with("95 % of all,1,,0.79"));
    let gap = csv.lines().filter(|line| line.ends_with(",,,")).count();
    assert_eq!(gap, 3, "the gap of the band and of both curves");
    let csv = dots().to_csv().unwrap();
    assert!(
        csv.starts_with("category,series,glitch (um),low,high\nPID,<matched>,13,10,17\n"),
        "{csv}"
    );
    assert!(csv.contains("not run,virtual machine,,,\n"), "{csv}");
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
    vec![lines("error", 8, 3000), circle(), response(), dots()]
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
            "response" => &["frequency (Hz)", "gain (µm/V)", "95 % of all", "100", "0.1"],
            _ => &[
                "glitch (µm)",
                "&lt;matched&gt;",
                "N-PID with static and GMS",
                "friction feedforward",
                "not run",
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
    let svg = response().to_svg().unwrap();
    // The legend's sample, and the band in two parts.
    assert_eq!(svg.matches("opacity=\"0.22\"").count(), 3);
    let svg = dots().to_svg().unwrap();
    // Two bars of each series, each with two ends; the run that is missing has none.
    assert_eq!(svg.matches("stroke=\"#0072B2\"").count(), 6);
}

#[test]
fn a_spread_that_does_not_enclose_its_mean_is_named() {
    let mut figure = dots();
    if let Plot::Dots(dots) = &mut figure.plot {
        dots.series[1].values[0] = Spread {
            mean: 5.0,
            low: 6.0,
            high: 7.0,
        };
    }
    let error = figure.to_svg().unwrap_err().to_string();
    assert!(
        error.contains("virtual machine") && error.contains("PID"),
        "{error}"
    );
    let mut figure = dots();
    if let Plot::Dots(dots) = &mut figure.plot {
        dots.series[0].values.pop();
    }
    assert!(matches!(
        figure.to_svg(),
        Err(ReportError::SeriesLength { x: 3, y: 2, .. })
    ));
}
