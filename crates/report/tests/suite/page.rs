//! The page is complete, closed to the network, and the same for the same data.

use crate::sample;
use crate::sample::{circle, lines, page, sample, table};
use quadrant_report::{Block, Plot, ReportError};

#[test]
fn the_same_data_give_the_same_bytes() {
    assert_eq!(sample().to_html().unwrap(), sample().to_html().unwrap());
}

#[test]
fn the_page_asks_no_network_for_anything() {
    let html = sample().to_html().unwrap();
    assert!(html.contains("default-src 'none'"));
    // The name of SVG's elements is no address that anything is asked for.
    let own = html.replace("http://www.w3.org/2000/svg", "");
    for remote in [
        "http:", "https:", "src=\"//", "@import", "url(h", "fetch(", "import(",
    ] {
        assert!(!own.contains(remote), "{remote}");
    }
}

#[test]
fn the_script_is_embedded_once_and_small() {
    let page = page(
        (0..6)
            .map(|i| Block::Figure(lines(&format!("figure-{i}"), 1, 100)))
            .collect(),
    );
    let html = page.to_html().unwrap();
    assert_eq!(html.matches("const chart = ").count(), 1);
    assert!(html.len() < 100_000, "{} bytes", html.len());
}

#[test]
fn long_traces_leave_the_page_below_four_megabytes() {
    let blocks = (0..12)
        .map(|i| Block::Figure(lines(&format!("figure-{i}"), 8, 100_000)))
        .collect();
    let size = page(blocks).to_html().unwrap().len();
    assert!(size < 4_000_000, "{size} bytes");
}

#[test]
fn texts_are_escaped_everywhere() {
    let own = sample().to_html().unwrap();
    assert!(own.contains("&lt;b&gt;not&lt;/b&gt; markup") && own.contains("&lt;none&gt;"));
    assert!(
        own.contains("law 0 \\u003c/script>"),
        "series names cannot end their script element"
    );
}

#[test]
fn tables_and_figures_are_numbered_listed_and_downloadable() {
    let own = sample().to_html().unwrap();
    for label in ["Table 1", "Figure 1", "Figure 2"] {
        assert_eq!(
            own.matches(label).count(),
            2,
            "{label} in the contents and in its caption"
        );
    }
    assert!(own.contains("href=\"#errors\"") && own.contains("id=\"errors\""));
    assert!(own.contains("download=\"errors.csv\" href=\"data:text/csv;charset=utf-8,Law%2CError"));
    assert!(
        own.contains("times, 2\u{a0}µm per division"),
        "the circle states its scale"
    );
}

#[test]
fn every_curve_is_in_the_legend_in_both_colours() {
    let own = sample().to_html().unwrap();
    assert_eq!(own.matches("aria-pressed=\"true\"").count(), 3);
    assert!(own.contains("light-dark(#0072b2,#3f9fe0)"));
}

#[test]
fn ids_are_checked() {
    let twice = page(vec![
        Block::Table(table("errors")),
        Block::Figure(lines("errors", 1, 10)),
    ]);
    assert!(matches!(twice.to_html(), Err(ReportError::DuplicateId { id }) if id == "errors"));
    for bad in ["", "1st", "a b", "ä", "a\"b"] {
        let page = page(vec![Block::Table(table(bad))]);
        assert!(
            matches!(page.to_html(), Err(ReportError::BadId { .. })),
            "{bad:?}"
        );
    }
}

#[test]
fn a_circle_without_a_radius_is_refused() {
    let mut figure = circle();
    if let Plot::PolarDeviation(circle) = &mut figure.plot {
        circle.radius_mm = 0.0;
    }
    assert!(matches!(
        page(vec![Block::Figure(figure)]).to_html(),
        Err(ReportError::Radius { .. })
    ));
}

#[test]
fn a_page_that_cannot_be_written_is_named() {
    let error = page(vec![])
        .write_html("no/such/folder/report.html".as_ref())
        .unwrap_err();
    assert!(
        error.to_string().contains("no/such/folder/report.html"),
        "{error}"
    );
}

#[test]
fn every_block_says_which_command_made_it() {
    let own = sample::full().to_html().unwrap();
    assert_eq!(own.matches("class=\"made\"").count(), 5);
    assert_eq!(own.matches("seed 7 ·").count(), 3, "of the page");
    assert_eq!(
        own.matches("seed 9 ·").count(),
        2,
        "of the section from elsewhere"
    );
}

#[test]
fn labels_are_kept_and_left_out_of_the_count() {
    let mut page = sample::full();
    page.sections.push(quadrant_report::Section {
        id: "last".into(),
        heading: "Last".into(),
        provenance: None,
        prose: vec![],
        blocks: vec![
            Block::Table(table("last-table")),
            Block::Figure(lines("last-figure", 1, 10)),
        ],
    });
    let own = page.to_html().unwrap();
    for label in ["Table 5.7.", "Table 2.", "Figure 4."] {
        assert_eq!(
            own.matches(&format!("<b>{label}</b>")).count(),
            1,
            "{label}"
        );
    }
}
