//! The page: sections of prose, tables and figures, with everything a browser needs in one file.

use super::{Dash, Figure, ReportError, Style, Table, palette};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::Path;

/// Points on the whole page. Three million numbers' worth of text would be drawn no finer, and the page stays below
/// 8 MB, 4.7 MB of which are the plotting library.
const POINTS_PER_PAGE: usize = 150_000;
/// Bounds of what one series gets of them: fewer would show, more would not.
const POINTS_PER_SERIES: (usize, usize) = (1_000, 8_000);

/// Forbids the page to ask any network for anything.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";

/// A report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// One sentence under the title.
    pub subtitle: String,
    /// How it came about.
    pub provenance: Provenance,
    /// Its sections, in reading order.
    pub sections: Vec<Section>,
}

/// What a reader needs to make the same page again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// Seed of every random number, if there was one.
    pub seed: Option<u64>,
    /// Version of the program.
    pub version: String,
}

/// A section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Unique on the page; the section's link target.
    pub id: String,
    /// Its heading.
    pub heading: String,
    /// Its paragraphs, plain text.
    pub prose: Vec<String>,
    /// Its tables and figures, after the prose.
    pub blocks: Vec<Block>,
    /// How it came about, where that is not how the page did.
    pub provenance: Option<Provenance>,
}

/// A table or a figure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Block {
    /// A table.
    Table(Table),
    /// A figure.
    Figure(Figure),
    /// Either, under a label of its own ("Table 5.7") where the others are counted.
    Labelled {
        /// What stands before the caption.
        label: String,
        /// The table or figure.
        block: Box<Self>,
    },
}

impl Block {
    /// The same under a label of its own ("Table 5.7"); it is left out of the page's count.
    #[must_use]
    pub fn labelled(self, label: impl Into<String>) -> Self {
        Self::Labelled {
            label: label.into(),
            block: Box::new(self),
        }
    }

    fn id(&self) -> &str {
        match self.content() {
            Content::Table(table) => &table.id,
            Content::Figure(figure) => &figure.id,
        }
    }

    fn caption(&self) -> &str {
        match self.content() {
            Content::Table(table) => &table.caption,
            Content::Figure(figure) => &figure.caption,
        }
    }

    /// Its own label, if it has one; of several the outermost.
    fn label(&self) -> Option<&str> {
        match self {
            Self::Labelled { label, .. } => Some(label),
            Self::Table(_) | Self::Figure(_) => None,
        }
    }

    /// What it holds, whatever it is labelled.
    fn content(&self) -> Content<'_> {
        match self {
            Self::Table(table) => Content::Table(table),
            Self::Figure(figure) => Content::Figure(figure),
            Self::Labelled { block, .. } => block.content(),
        }
    }
}

/// A block without its label.
enum Content<'a> {
    Table(&'a Table),
    Figure(&'a Figure),
}

/// A block with its number among its kind: "Table 2", "Figure 5".
struct Numbered<'a> {
    label: String,
    block: &'a Block,
}

impl Page {
    /// The page as HTML. The same data give the same bytes.
    pub fn to_html(&self) -> Result<String, ReportError> {
        self.check()?;
        let sections = self.numbered();
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
                }
                body {
                    header {
                        h1 { (self.title) }
                        p.subtitle { (self.subtitle) }
                        (self.provenance.markup())
                    }
                    (contents(&sections))
                    main {
                        noscript { p { "The figures are drawn by a script in this page, which is switched off here." } }
                        @for (i, (section, blocks)) in sections.iter().enumerate() {
                            section id=(section.id) {
                                h2 { span.number { (i + 1) } " " (section.heading) }
                                @for paragraph in &section.prose { p { (paragraph) } }
                                @for numbered in blocks { (numbered.markup(points)) }
                            }
                        }
                    }
                    footer {
                        p {
                            "Curves are drawn with at most " (points) " points each; of every interval the extremes are \
                             kept, so that no spike is lost. Drag over a figure to zoom, double-click to go back."
                        }
                    }
                    (json("palette", &palette_json()))
                    (PreEscaped(plotting_library()))
                    script { (PreEscaped(include_str!("page.js"))) }
                }
            }
        };
        Ok(page.into_string())
    }

    /// Writes [`Self::to_html`] into a file.
    pub fn write_html(&self, path: impl AsRef<Path>) -> Result<(), ReportError> {
        let path = path.as_ref();
        std::fs::write(path, self.to_html()?).map_err(|source| ReportError::Write {
            path: path.to_owned(),
            source,
        })
    }

    fn blocks(&self) -> impl Iterator<Item = &Block> {
        self.sections.iter().flat_map(|section| &section.blocks)
    }

    fn check(&self) -> Result<(), ReportError> {
        let mut seen = HashSet::from(["palette", "contents"]);
        let ids = self.sections.iter().map(|section| section.id.as_str());
        for id in ids.chain(self.blocks().map(Block::id)) {
            let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
            if !(id.starts_with(|c: char| c.is_ascii_alphabetic()) && id.chars().all(fits)) {
                return Err(ReportError::BadId { id: id.to_owned() });
            }
            if !seen.insert(id) {
                return Err(ReportError::DuplicateId { id: id.to_owned() });
            }
        }
        self.blocks().try_for_each(|block| match block.content() {
            Content::Table(table) => table.check(),
            Content::Figure(figure) => figure.check(),
        })
    }

    fn points_per_series(&self) -> usize {
        let series: usize = self
            .blocks()
            .map(|block| match block.content() {
                Content::Table(_) => 0,
                Content::Figure(figure) => figure.legend().len(),
            })
            .sum();
        (POINTS_PER_PAGE / series.max(1)).clamp(POINTS_PER_SERIES.0, POINTS_PER_SERIES.1)
    }

    fn numbered(&self) -> Vec<(&Section, Vec<Numbered<'_>>)> {
        let (mut tables, mut figures) = (0, 0);
        let mut numbered = Vec::with_capacity(self.sections.len());
        for section in &self.sections {
            let mut blocks = Vec::with_capacity(section.blocks.len());
            for block in &section.blocks {
                let label = block.label().map_or_else(
                    || {
                        let (kind, count) = match block.content() {
                            Content::Table(_) => ("Table", &mut tables),
                            Content::Figure(_) => ("Figure", &mut figures),
                        };
                        *count += 1;
                        format!("{kind} {count}")
                    },
                    str::to_owned,
                );
                blocks.push(Numbered { label, block });
            }
            numbered.push((section, blocks));
        }
        numbered
    }
}

impl Provenance {
    fn markup(&self) -> Markup {
        html! {
            dl.provenance {
                dt { "Command" } dd { code { (whole_words(&self.command)) } }
                @if let Some(seed) = self.seed { dt { "Seed" } dd { (seed) } }
                dt { "Version" } dd { (self.version) }
            }
        }
    }
}

fn contents(sections: &[(&Section, Vec<Numbered<'_>>)]) -> Markup {
    html! {
        nav #contents aria-label="Contents" {
            h2 { "Contents" }
            ol {
                @for (section, blocks) in sections {
                    li {
                        a href={ "#" (section.id) } { (section.heading) }
                        @if !blocks.is_empty() {
                            ul {
                                @for numbered in blocks {
                                    li title=(numbered.block.caption()) {
                                        a href={ "#" (numbered.block.id()) } { (numbered.label) } " "
                                        span { (numbered.block.caption()) }
                                    }
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
    fn markup(&self, points_per_series: usize) -> Markup {
        let caption = |note: Option<String>| {
            html! {
                b { (self.label) "." } " " (self.block.caption())
                @if !self.block.caption().ends_with(['.', '?', '!']) { "." }
                @if let Some(note) = note { " " span.note { (note) } }
            }
        };
        match self.block.content() {
            Content::Table(table) => html! {
                figure.table id=(table.id) {
                    figcaption { (caption(None)) " " (download(table)) }
                    div.scroll tabindex="0" role="region" aria-label=(table.caption) { (table_markup(table)) }
                }
            },
            Content::Figure(figure) => html! {
                figure.plot id=(figure.id) {
                    @let kind = match figure.plot {
                        super::Plot::Lines(_) => "lines",
                        super::Plot::PolarDeviation(_) => "polar",
                    };
                    div.drawing data-figure=(figure.id) data-kind=(kind) role="group" aria-label=(figure.caption) {}
                    (legend_markup(figure))
                    (json(&format!("{}-data", figure.id), &figure.to_plotly(points_per_series).to_json()))
                    figcaption { (caption(figure.note())) }
                }
            },
        }
    }
}

/// The curves' names beside a sample of each line; a press hides the curve and shows it again.
fn legend_markup(figure: &Figure) -> Markup {
    html! {
        div.legend {
            @for (name, style) in figure.legend() {
                @let Style { colour, dash } = style;
                @let pattern = match dash {
                    Dash::Solid => None,
                    Dash::Dashed => Some("6 4"),
                    Dash::Dotted => Some("2 3"),
                    Dash::Points => Some("4 7"),
                };
                button type="button" aria-pressed="true" {
                    svg viewBox="0 0 26 4" width="26" height="4" aria-hidden="true" {
                        path d="M0 2H26" stroke-dasharray=[pattern]
                            style={ "stroke:" (colour.light()) ";stroke:light-dark(" (colour.light()) "," (colour.dark()) ")" };
                    }
                    span { (whole_words(name)) }
                }
            }
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

fn table_markup(table: &Table) -> Markup {
    let class = |column| table.is_numeric(column).then_some("number");
    html! {
        table {
            thead {
                tr {
                    @for (i, column) in table.columns.iter().enumerate() {
                        th scope="col" class=[class(i)] {
                            (whole_words(&column.heading))
                            @if let Some(unit) = &column.unit { span.unit { (unit) } }
                        }
                    }
                }
            }
            tbody {
                @for row in &table.rows {
                    tr { @for (i, cell) in row.iter().enumerate() { td class=[class(i)] { (cell.shown()) } } }
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
fn json(id: &str, json: &str) -> Markup {
    html! { script type="application/json" id=(id) { (PreEscaped(json.replace('<', "\\u003c"))) } }
}

fn palette_json() -> String {
    let pairs = palette::PAIRS.map(|(light, dark)| format!("\"{light}\":\"{dark}\""));
    format!("{{{}}}", pairs.join(","))
}

/// plotly.js as a script element, without the formula renderer that comes with it: 2 MB which no figure uses.
fn plotting_library() -> String {
    const END: &str = "</script>";
    let mut scripts = plotly::Plot::offline_js_sources();
    if let Some(end) = scripts.find(END) {
        scripts.truncate(end + END.len());
    }
    scripts
}
