//! The page as HTML, with everything a browser needs in one file.

use super::drawing::{Curve, Drawing, Shape, typeset};
use super::page::{Content, Numbered, Part};
use super::{Figure, Page, Plot, Provenance, ReportError, Table};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use std::path::Path;

/// Forbids the page to ask any network for anything.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";

/// Blocks up to which the contents are shown unfolded.
const UNFOLDED: usize = 30;

/// Settles the colours before anything is drawn; storage may be closed to pages from files.
const THEME: &str = "try{const t=localStorage.getItem('quadrant-theme');\
                     if(t==='light'||t==='dark')document.documentElement.dataset.theme=t}catch{}";

/// Draws the figures, and does what the page does beyond them.
const SCRIPT: &str = concat!(
    "\"use strict\";\n",
    include_str!("chart.js"),
    include_str!("page.js")
);

/// The box a sample of a legend fills, px.
const SAMPLE: (f64, f64) = (26.0, 10.0);

impl Page {
    /// The page as HTML. The same data give the same bytes.
    pub fn to_html(&self) -> Result<String, ReportError> {
        self.check()?;
        let parts = self.parts();
        let points = self.points_per_series();
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(POLICY);
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    title { (self.title) }
                    style { (PreEscaped(include_str!("page.css"))) }
                    script { (PreEscaped(THEME)) }
                }
                body {
                    header {
                        (theme_switch())
                        h1 { (self.title) }
                        p.subtitle { (typeset(&self.subtitle)) }
                        (provenance(&self.provenance))
                    }
                    (contents(&parts))
                    main {
                        noscript { p { "The figures are drawn by a script in this page, which is switched off here." } }
                        @for (i, part) in parts.iter().enumerate() {
                            section id=(part.section.id) {
                                h2 { span.number { (i + 1) } " " (part.section.heading) }
                                @for paragraph in &part.section.prose { p { (typeset(paragraph)) } }
                                @for numbered in &part.blocks { (numbered.markup(points, part.provenance)) }
                            }
                        }
                    }
                    footer {
                        p {
                            "Curves are drawn with at most " (points) " points each; of every interval the extremes are \
                             kept, so that no spike is lost. Drag over a figure to zoom, double-click to go back."
                        }
                    }
                    script { (PreEscaped(SCRIPT)) }
                }
            }
        };
        Ok(page.into_string())
    }

    /// Writes [`Self::to_html`] into a file.
    pub fn write_html(&self, path: &Path) -> Result<(), ReportError> {
        super::write::file(path, &self.to_html()?)
    }
}

/// Shown by the script, which it needs.
fn theme_switch() -> Markup {
    html! {
        label.theme hidden {
            "Colours "
            select #theme {
                option value="" { "as the system" }
                option value="light" { "light" }
                option value="dark" { "dark" }
            }
        }
    }
}

fn provenance(made: &Provenance) -> Markup {
    html! {
        dl.provenance {
            dt { "Command" } dd { code { (whole_words(&made.command)) } }
            @if let Some(seed) = made.seed { dt { "Seed" } dd { (seed) } }
            dt { "Version" } dd { (made.version) }
        }
    }
}

/// The same in one line, beneath a table or a figure, so that it can be quoted alone.
fn short_provenance(made: &Provenance) -> Markup {
    html! {
        p.made {
            code { (whole_words(&made.command)) }
            @if let Some(seed) = made.seed { " · seed " (seed) }
            " · version " (made.version)
        }
    }
}

fn contents(parts: &[Part<'_>]) -> Markup {
    let blocks: usize = parts.iter().map(|part| part.blocks.len()).sum();
    html! {
        nav #contents aria-label="Contents" {
            details open {
                summary { "Contents" }
                ol {
                    @for Part { section, blocks: listed, .. } in parts {
                        @let link = html! { a href={ "#" (section.id) } { (section.heading) } };
                        li {
                            @if listed.is_empty() { (link) } @else {
                                details open[blocks <= UNFOLDED] {
                                    summary { (link) }
                                    ul { @for numbered in listed { (numbered.entry()) } }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

impl Numbered<'_> {
    fn entry(&self) -> Markup {
        html! {
            li title=(self.block.caption()) {
                a href={ "#" (self.block.id()) } { (self.label) } " " span { (self.block.caption()) }
            }
        }
    }

    fn markup(&self, points_per_series: usize, made: &Provenance) -> Markup {
        let caption = |note: Option<String>| {
            html! {
                b { (self.label) "." } " " (typeset(self.block.caption()))
                @if !self.block.caption().ends_with(['.', '?', '!']) { "." }
                @if let Some(note) = note { " " span.note { (typeset(&note)) } }
            }
        };
        match self.block.content() {
            Content::Table(table) => html! {
                figure.table id=(table.id) {
                    figcaption { (caption(None)) " " (download(table)) }
                    div.scroll tabindex="0" role="region" aria-label=(table.caption) { (table_markup(table)) }
                    (short_provenance(made))
                }
            },
            Content::Figure(figure) => html! {
                @let drawn = figure.decimated(points_per_series).drawing();
                figure.plot id=(figure.id) {
                    (drawing(figure))
                    (legend(&drawn.curves))
                    (json(&drawn))
                    figcaption { (caption(figure.note())) }
                    (short_provenance(made))
                }
            },
        }
    }
}

/// The box of a drawing. Its height is settled before it is drawn, so that nothing on the page moves.
fn drawing(figure: &Figure) -> Markup {
    let kind = match &figure.plot {
        Plot::Lines(_) => "lines",
        Plot::PolarDeviation(_) => "polar",
    };
    html! {
        div.drawing data-figure=(figure.id) data-kind=(kind) role="group" aria-label=(figure.caption) {}
    }
}

/// The curves' names beside a sample of each line; a press hides the curve and shows it again.
fn legend(curves: &[Curve]) -> Markup {
    let (width, height) = SAMPLE;
    html! {
        div.legend {
            @for curve in curves {
                @let (light, dark) = curve.colour;
                button type="button" aria-pressed="true" {
                    svg.chart viewBox={ "0 0 " (width) " " (height) } width=(width) height=(height) aria-hidden="true"
                        style={ "color:" (light) ";color:light-dark(" (light) "," (dark) ")" } { (sample(&curve.shape)) }
                    span { (whole_words(&typeset(&curve.name))) }
                }
            }
        }
    }
}

fn sample(shape: &Shape) -> Markup {
    let (width, height) = SAMPLE;
    let middle = height / 2.0;
    html! {
        @match shape {
            Shape::Line { dash, .. } => path.stroke d={ "M0 " (middle) "H" (width) } stroke-dasharray=[*dash] {},
            Shape::Points { mark } => path.mark d={ "M" (width / 2.0) " " (middle) (mark) } {},
        }
    }
}

/// Text that breaks between words only, not after the hyphens in "N-PID" or "--seed".
fn whole_words(text: &str) -> Markup {
    html! {
        @for (i, word) in text.split(' ').enumerate() {
            @if i > 0 { " " }
            @if word.contains('-') { span.unbroken { (word) } } @else { (word) }
        }
    }
}

/// Columns of a table that stand closer.
const MANY: usize = 9;

fn table_markup(table: &Table) -> Markup {
    let class = |column| table.is_numeric(column).then_some("number");
    let many = (table.columns.len() >= MANY).then_some("many");
    html! {
        table class=[many] {
            thead {
                tr {
                    @for (i, column) in table.columns.iter().enumerate() {
                        th scope="col" class=[class(i)] {
                            (whole_words(&typeset(&column.heading)))
                            @if let Some(unit) = &column.unit { span.unit { (typeset(unit)) } }
                        }
                    }
                }
            }
            tbody {
                @for row in &table.rows {
                    tr { @for (i, cell) in row.iter().enumerate() { td class=[class(i)] { (typeset(&cell.shown())) } } }
                }
            }
        }
    }
}

/// A link that carries the table as CSV, so that it works without a server and without scripts.
fn download(table: &Table) -> Markup {
    // The page's tables have been checked before anything is drawn.
    let csv = table.to_csv().unwrap_or_default();
    let data = utf8_percent_encode(&csv, NON_ALPHANUMERIC);
    html! {
        a.download download={ (table.id) ".csv" } href={ "data:text/csv;charset=utf-8," (data) } { "CSV" }
    }
}

/// Data for the page's script. JSON may hold "</", which would end the element; "<" can be escaped in JSON.
fn json(drawing: &Drawing) -> Markup {
    let json = serde_json::to_string(drawing).expect("a drawing has nothing JSON cannot hold");
    html! { script type="application/json" { (PreEscaped(json.replace('<', "\\u003c"))) } }
}
