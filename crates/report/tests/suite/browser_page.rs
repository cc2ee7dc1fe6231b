//! The page in a browser: drawn whole, without complaints, on a phone, in the dark, on paper; and that a broken page is
//! noticed.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::sample::{full, lines, page, table};
use quadrant_chromium::Browser;
use quadrant_report::{Block, Cell, Column, Page};
use serde_json::{Value, json};

/// A phone, a tablet, a screen wide enough for the contents at the side; CSS pixels.
const WINDOWS: [(u32, u32); 3] = [(375, 700), (900, 1000), (1400, 900)];
const PHONE: (u32, u32) = WINDOWS[0];

struct Opened {
    browser: Browser,
    folder: tempfile::TempDir,
}

impl Opened {
    fn new() -> Option<Self> {
        Some(Self {
            browser: Browser::start()?,
            folder: tempfile::tempdir().unwrap(),
        })
    }

    fn write(&self, html: &str) -> PathBuf {
        let path = self.folder.path().join("page.html");
        std::fs::write(&path, html).unwrap();
        path
    }

    /// Everything that is wrong with a page in a window, in words; nothing, if all is well.
    fn faults(&mut self, path: &Path, window: (u32, u32), is_dark: bool) -> Vec<String> {
        self.browser.open(path, window, is_dark);
        let found = self.browser.evaluate(include_str!("inspect.js"));
        let mut faults = self.browser.problems();
        for figure in found["figures"].as_array().unwrap() {
            if figure["traces"] != figure["curves"] || figure["curves"] == 0 {
                faults.push(format!("figure not drawn: {figure}"));
            }
            if figure["cut"] != json!([]) {
                faults.push(format!("label cut: {}", figure["cut"]));
            }
        }
        for hash in found["dangling"].as_array().unwrap() {
            faults.push(format!("dangling link: {hash}"));
        }
        if found["links"] == 0 {
            faults.push("no links".into());
        }
        if found["overflow"] != 0 {
            faults.push(format!("wider than the window by {} px", found["overflow"]));
        }
        if found["growth"].as_i64().unwrap().abs() > 1 {
            faults.push(format!("moved under the reader by {} px", found["growth"]));
        }
        let paper = if is_dark {
            "rgb(22, 24, 28)"
        } else {
            "rgb(255, 255, 255)"
        };
        let label = if is_dark {
            "rgb(228, 228, 225)"
        } else {
            "rgb(27, 27, 27)"
        };
        if found["paper"] != paper
            || found["figures"]
                .as_array()
                .unwrap()
                .iter()
                .any(|f| f["ink"] != label)
        {
            faults.push(format!(
                "wrong colours: {} and {}",
                found["paper"], found["figures"]
            ));
        }
        faults
    }
}

#[test]
fn the_page_is_whole_in_every_window_in_light_and_dark() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let path = opened.write(&full().to_html().unwrap());
    for window in WINDOWS {
        for is_dark in [false, true] {
            let faults = opened.faults(&path, window, is_dark);
            assert!(faults.is_empty(), "{window:?}, dark {is_dark}: {faults:#?}");
        }
    }
}

#[test]
fn a_label_at_the_end_of_an_axis_is_not_cut() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    // A single point is drawn in the middle of an axis that ends at round numbers.
    let mut figure = lines("error", 1, 1);
    if let quadrant_report::Plot::Lines(lines) = &mut figure.plot {
        for series in &mut lines.series {
            series.x = vec![1000.0];
            series.y = vec![1.0];
            series.style = quadrant_report::Style::points(quadrant_report::Colour::Blue);
        }
    }
    let path = opened.write(&page(vec![Block::Figure(figure)]).to_html().unwrap());
    for window in WINDOWS {
        let faults = opened.faults(&path, window, false);
        let cut = faults.iter().find(|fault| fault.starts_with("label cut"));
        assert_eq!(cut, None, "{window:?}");
    }
}

/// A page with a table of thirteen columns.
fn thirteen_columns() -> String {
    let mut wide = table("wide");
    wide.columns = ["Plane", "Radius", "Feed", "Configuration"]
        .map(Column::new)
        .to_vec();
    let names = ["G(CW)", "G(CCW)", "G(b)", "H", "Fmax", "Fmin", "D"];
    let spikes = ["Spike mean", "Spike largest"];
    let values = names.iter().chain(&spikes);
    wide.columns
        .extend(values.map(|name| Column::with_unit(*name, "um")));
    let mut row = vec![
        Cell::text("XY"),
        Cell::number(30.0, 1),
        Cell::number(1000.0, 0),
        Cell::text("best PID + static + GMS"),
    ];
    row.extend((0..9).map(|_| Cell::number(-168.99, 2)));
    wide.rows = vec![row];
    page(vec![Block::Table(wide)]).to_html().unwrap()
}

#[test]
fn a_table_of_thirteen_columns_does_not_scroll_on_a_screen_of_1100_pixels() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let path = opened.write(&thirteen_columns());
    opened.browser.open(&path, (1100, 900), false);
    let hidden = "(() => { const t = document.querySelector('.scroll'); return t.scrollWidth - t.clientWidth; })()";
    assert_eq!(opened.browser.evaluate(hidden), json!(0));
}

#[test]
fn a_table_shows_a_shadow_where_columns_are_out_of_sight_and_only_there() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let path = opened.write(&thirteen_columns());
    opened.browser.open(&path, (390, 900), false);
    // The picture of a spot at the right edge of the table's head, above the names that take one line.
    let mut strip = |scrolled: &str| {
        let place = opened.browser.evaluate(&format!(
            "(() => {{ const table = document.querySelector('.scroll'); table.scrollLeft = {scrolled}; \
             table.scrollIntoView({{ block: 'center', behavior: 'instant' }}); const box = table.getBoundingClientRect(); \
             return [box.right - 4, box.top + 6]; }})()"
        ));
        let clip = json!({"x": place[0], "y": place[1], "width": 3, "height": 3, "scale": 1});
        let taken = opened.browser.call(
            "Page.captureScreenshot",
            json!({"format": "png", "clip": clip}),
        );
        taken["data"].as_str().unwrap().to_owned()
    };
    let [start, end] = ["0", "1e4"].map(&mut strip);
    assert_ne!(start, end);
}

#[test]
fn every_way_of_breaking_a_page_is_noticed() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let html = full().to_html().unwrap();
    let breakages = [
        ("\"curves\":[", "\"curves\":[3,", "figure not drawn"),
        ("href=\"#errors\"", "href=\"#nowhere\"", "dangling link"),
        (
            "<main>",
            "<main><div style=\"width:800px\">wide</div>",
            "wider than the window",
        ),
        (
            "<main>",
            "<main><img src=\"http://example.invalid/x.png\">",
            "log: ",
        ),
        (
            "<main>",
            "<main><script>undefined.field</script>",
            "exception: ",
        ),
        ("--paper: #fff;", "--paper: #eee;", "wrong colours"),
        (
            "<section id=\"other\">",
            "<section id=\"other\"><script>addEventListener('scroll',()=>document.querySelector('main').prepend(document.createElement('hr')),{once:true})</script>",
            "moved under the reader",
        ),
    ];
    for (intact, broken, fault) in breakages {
        assert!(html.contains(intact), "{intact}");
        let path = opened.write(&html.replacen(intact, broken, 1));
        let faults = opened.faults(&path, PHONE, false);
        let is_noticed = faults.iter().any(|found| found.starts_with(fault));
        assert!(is_noticed, "{broken} should give {fault:?}: {faults:#?}");
    }
}

#[test]
fn tables_are_downloaded_as_they_are() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let mut odd = table("odd");
    odd.caption = "Odd, \"quoted\"\nand broken".into();
    odd.rows[0][0] = quadrant_report::Cell::text("comma, \"quote\", %, #, µ");
    let path = opened.write(&page(vec![Block::Table(odd.clone())]).to_html().unwrap());
    opened.browser.open(&path, WINDOWS[1], false);
    let file = opened
        .browser
        .download("a.download", "odd.csv")
        .expect("odd.csv is downloaded");
    assert_eq!(String::from_utf8(file).unwrap(), odd.to_csv().unwrap());
}

#[test]
fn the_reader_chooses_the_colours() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let path = opened.write(&full().to_html().unwrap());
    opened.browser.open(&path, WINDOWS[1], false);
    let choose = |theme: &str| {
        format!(
            "(async () => {{
                const theme = document.getElementById('theme');
                theme.value = '{theme}';
                theme.dispatchEvent(new Event('change'));
                const drawing = document.querySelector('.drawing');
                drawing.scrollIntoView({{behavior: 'instant'}});
                await new Promise((done) => setTimeout(done, 500));
                return [getComputedStyle(document.body).backgroundColor, getComputedStyle(drawing.querySelector('.x-label')).fill];
            }})()"
        )
    };
    let (light, dark) = (
        json!(["rgb(255, 255, 255)", "rgb(27, 27, 27)"]),
        json!(["rgb(22, 24, 28)", "rgb(228, 228, 225)"]),
    );
    assert_eq!(
        opened
            .browser
            .evaluate("document.querySelector('.theme').hidden"),
        false
    );
    assert_eq!(opened.browser.evaluate(&choose("dark")), dark);
    // The choice outlives a visit, and the system's preference does not count against it.
    opened.browser.open(&path, WINDOWS[1], false);
    assert_eq!(
        opened
            .browser
            .evaluate("document.getElementById('theme').value"),
        "dark"
    );
    assert_eq!(opened.browser.evaluate(&choose("light")), light);
    opened.browser.emulate("screen", true);
    assert_eq!(opened.browser.evaluate(&choose("light")), light);
    assert_eq!(opened.browser.evaluate(&choose("")), dark);
    assert_eq!(opened.browser.problems(), Vec::<String>::new());
}

/// Script that returns the state of the page while it is being printed.
const PRINTED: &str = "(() => {
    const drawings = [...document.querySelectorAll('.drawing')];
    const style = (element) => getComputedStyle(element);
    return {
        drawn: drawings.filter((drawing) => drawing.querySelector('svg.chart .curve path')).length,
        widest: Math.max(...drawings.map((drawing) => drawing.querySelector('svg.chart')?.clientWidth ?? 9999)),
        tallest: Math.max(...[...document.querySelectorAll('figure.plot')].map((figure) => figure.offsetHeight)),
        inks: [...new Set(drawings.map((drawing) => style(drawing.querySelector('.x-label')).fill))],
        paper: style(document.documentElement).getPropertyValue('--paper').trim(),
        cut: [...document.querySelectorAll('figure.plot')].filter((figure) => style(figure).breakInside !== 'avoid').length,
        overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
        shown: ['.theme', '.download', 'footer'].filter((part) => style(document.querySelector(part)).display !== 'none'),
        sections: [...document.querySelectorAll('main > section')].filter((section) => section.offsetHeight > 50).length,
    };
})()";

#[test]
fn all_of_the_page_is_printed_in_light_colours_wherever_the_reader_was() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let path = opened.write(&full().to_html().unwrap());
    // A dark phone, at the top of the page: nothing of the end has been drawn.
    opened.browser.open(&path, PHONE, true);
    let drawn = opened
        .browser
        .evaluate("document.querySelectorAll('.drawing svg.chart').length");
    let metrics = json!({"width": 680, "height": 1000, "deviceScaleFactor": 1, "mobile": false});
    opened
        .browser
        .evaluate("dispatchEvent(new Event('beforeprint'))");
    opened
        .browser
        .call("Emulation.setDeviceMetricsOverride", metrics);
    // A sheet has no scroll bars.
    opened
        .browser
        .call("Emulation.setScrollbarsHidden", json!({"hidden": true}));
    opened.browser.emulate("print", true);
    let printed = opened.browser.evaluate(PRINTED);
    let figures = full().sections.iter().flat_map(|s| &s.blocks).count() - 2;
    assert_eq!(
        printed["drawn"], figures,
        "{printed}, after {drawn} on the screen"
    );
    assert!(printed["widest"].as_f64().unwrap() <= 680.0, "{printed}");
    // 265 mm of an A4 sheet, at 96 px to the inch.
    assert!(printed["tallest"].as_f64().unwrap() < 1000.0, "{printed}");
    assert_eq!(printed["inks"], json!(["rgb(0, 0, 0)"]), "{printed}");
    assert_eq!(printed["paper"], "#fff", "{printed}");
    for nothing in ["cut", "overflow"] {
        assert_eq!(printed[nothing], 0, "{printed}");
    }
    assert_eq!(printed["shown"], json!([]), "{printed}");
    assert_eq!(printed["sections"], full().sections.len(), "{printed}");
    opened
        .browser
        .evaluate("dispatchEvent(new Event('afterprint'))");
    // And back on the screen all is as it was.
    let faults = opened.faults(&path, PHONE, true);
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn printing_to_a_file_draws_every_figure_first() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let path = opened.write(&full().to_html().unwrap());
    opened.browser.open(&path, PHONE, true);
    opened.browser.evaluate(&format!(
        "addEventListener('beforeprint', () => {{ window.printed = {PRINTED}; }})"
    ));
    let pdf = opened
        .browser
        .call("Page.printToPDF", json!({"preferCSSPageSize": true}));
    let printed = opened.browser.evaluate("window.printed");
    assert_eq!(printed["drawn"], 3, "{printed}");
    // "%PDF-" in base64.
    assert!(pdf["data"].as_str().unwrap().starts_with("JVBERi0"));
    assert_eq!(opened.browser.problems(), Vec::<String>::new());
}

fn large() -> Page {
    let blocks = (0..60).flat_map(|i| {
        [
            Block::Figure(lines(&format!("figure-{i}"), 6, 20_000)),
            Block::Table(table(&format!("table-{i}"))),
        ]
    });
    page(blocks.collect())
}

#[test]
fn a_page_of_sixty_figures_opens_before_they_are_drawn() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let html = large().to_html().unwrap();
    assert!(html.len() < 5_000_000, "{} bytes", html.len());
    let path = opened.write(&html);
    let started = Instant::now();
    opened.browser.open(&path, WINDOWS[2], false);
    let drawn = opened.browser.evaluate(
        "new Promise((done) => setTimeout(() => done(document.querySelectorAll('[data-drawn]').length), 300))",
    );
    let opening = started.elapsed();
    println!(
        "{} bytes opened in {opening:?}, {drawn} figures drawn",
        html.len()
    );
    let drawn = drawn.as_u64().unwrap();
    assert!(
        (1..=8).contains(&drawn),
        "{drawn} figures are drawn at once"
    );
    assert!(opening < Duration::from_secs(20), "opened in {opening:?}");
    let faults = opened.faults(&path, WINDOWS[2], false);
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn folding_the_contents_widens_the_figures() {
    let Some(mut opened) = Opened::new() else {
        return;
    };
    let path = opened.write(&full().to_html().unwrap());
    opened.browser.open(&path, WINDOWS[2], false);
    let width = |is_open: bool| {
        format!(
            "(async () => {{
                document.querySelector('#contents > details').open = {is_open};
                const drawing = document.querySelector('.drawing');
                drawing.scrollIntoView({{behavior: 'instant'}});
                await new Promise((done) => setTimeout(done, 600));
                return [drawing.querySelector('svg.chart').clientWidth, drawing.clientWidth];
            }})()"
        )
    };
    let widths = |value: Value| [0, 1].map(|i| value[i].as_f64().unwrap());
    let open = widths(opened.browser.evaluate(&width(true)));
    let folded = widths(opened.browser.evaluate(&width(false)));
    assert_eq!(
        [open[0], folded[0]],
        [open[1], folded[1]],
        "figures fill their boxes"
    );
    assert_eq!(opened.browser.problems(), Vec::<String>::new());
}

/// Opens the sample and brings its first figure into view.
fn with_figure() -> Option<Opened> {
    let mut opened = Opened::new()?;
    let path = opened.write(&full().to_html().unwrap());
    opened.browser.open(&path, WINDOWS[1], false);
    opened.browser.evaluate(
        "(async () => {
            const drawing = document.querySelector('.drawing');
            drawing.scrollIntoView({behavior: 'instant', block: 'center'});
            while (!drawing.dataset.drawn) await new Promise((done) => setTimeout(done, 20));
        })()",
    );
    Some(opened)
}

/// Labels of the first figure's ticks.
const TICKS: &str = "[...document.querySelectorAll('.drawing')[0].querySelectorAll('.tick')].map((tick) => tick.textContent)";

#[test]
fn a_drag_zooms_and_a_double_click_goes_back() {
    let Some(mut opened) = with_figure() else {
        return;
    };
    let whole = opened.browser.evaluate(TICKS);
    let corner = opened.browser.evaluate(
        "(({x, y}) => [x, y])(document.querySelector('.drawing').getBoundingClientRect())",
    );
    let [left, top] = [0, 1].map(|i| corner[i].as_f64().unwrap());
    let mut mouse = |kind: &str, x: f64, y: f64, clicks: u32| {
        let event = json!({"type": kind, "x": left + x, "y": top + y, "button": "left", "buttons": 1, "clickCount": clicks});
        opened.browser.call("Input.dispatchMouseEvent", event);
    };
    mouse("mousePressed", 200.0, 100.0, 1);
    mouse("mouseMoved", 250.0, 130.0, 0);
    mouse("mouseMoved", 300.0, 150.0, 0);
    mouse("mouseReleased", 300.0, 150.0, 1);
    let zoomed = opened.browser.evaluate(TICKS);
    assert_ne!(zoomed, whole);
    let event = |kind: &str, clicks: u32| json!({"type": kind, "x": left + 250.0, "y": top + 120.0, "button": "left", "clickCount": clicks});
    for clicks in [1, 2] {
        for kind in ["mousePressed", "mouseReleased"] {
            opened
                .browser
                .call("Input.dispatchMouseEvent", event(kind, clicks));
        }
    }
    assert_eq!(opened.browser.evaluate(TICKS), whole);
    assert_eq!(opened.browser.problems(), Vec::<String>::new());
}

#[test]
fn a_figure_is_zoomed_and_moved_by_keys() {
    let Some(mut opened) = with_figure() else {
        return;
    };
    let mut press = |key: &str| {
        opened.browser.evaluate(&format!(
            "document.querySelector('.drawing').dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}', bubbles: true}}))"
        ));
        opened.browser.evaluate(TICKS)
    };
    let whole = press("0");
    let near = press("+");
    let beside = press("ArrowRight");
    assert!(near != whole && beside != near && beside != whole);
    assert_eq!(press("Escape"), whole);
}

#[test]
fn the_pointer_reads_values_with_their_units() {
    let Some(mut opened) = with_figure() else {
        return;
    };
    let read = opened.browser.evaluate(
        "(() => {
            const drawing = document.querySelector('.drawing');
            const curve = drawing.querySelector('.curve path');
            const [, x, y] = /^M([\\d.]+) ([\\d.]+)/.exec(curve.getAttribute('d'));
            const corner = drawing.getBoundingClientRect();
            drawing.querySelector('svg').dispatchEvent(new PointerEvent('pointermove',
                {clientX: corner.x + Number(x), clientY: corner.y + Number(y), bubbles: true}));
            return drawing.querySelector('.readout').textContent;
        })()",
    );
    assert_eq!(
        read, "law 0 </script><b>: Time 0 s, Error 0 µm",
        "the first sample of the first curve"
    );
}

#[test]
fn a_press_in_the_legend_hides_a_curve() {
    let Some(mut opened) = with_figure() else {
        return;
    };
    let press = "(() => {
        const figure = document.querySelector('figure.plot');
        figure.querySelector('.legend button').click();
        return figure.querySelectorAll('.drawing .curve').length;
    })()";
    assert_eq!(opened.browser.evaluate(press), 1);
    assert_eq!(opened.browser.evaluate(press), 2);
}

#[test]
fn a_figure_is_saved_as_an_image_with_its_legend() {
    let Some(mut opened) = with_figure() else {
        return;
    };
    let svg = opened
        .browser
        .download("button[title='Save as SVG']", "error.svg")
        .expect("error.svg is downloaded");
    let svg = String::from_utf8(svg).unwrap();
    for part in ["<svg", "Time (s)", "law 1", "rgb(0, 114, 178)"] {
        assert!(svg.contains(part), "{part} in {svg:.3000}");
    }
    let png = opened
        .browser
        .download("button[title='Save as PNG']", "error.png")
        .expect("error.png is downloaded");
    assert!(png.starts_with(b"\x89PNG") && png.len() > 10_000);
    assert_eq!(opened.browser.problems(), Vec::<String>::new());
}
