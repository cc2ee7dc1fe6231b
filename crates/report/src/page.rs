//! The page: sections of prose, tables and figures.

use super::{Figure, ReportError, Table};
use serde::Serialize;
use std::collections::HashSet;

/// Points on the whole page. Three million numbers' worth of text would be drawn no finer, and the page stays below
/// 4 MB.
const POINTS_PER_PAGE: usize = 150_000;
/// Bounds of what one series gets of them: fewer would show, more would not.
const POINTS_PER_SERIES: (usize, usize) = (400, 8_000);

/// Ids that the page's own parts have.
const RESERVED: [&str; 2] = ["contents", "theme"];

/// A report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// One sentence under the title.
    pub subtitle: String,
    /// Provenance of the page.
    pub provenance: Provenance,
    /// Its sections, in reading order.
    pub sections: Vec<Section>,
}

/// Provenance: all that a reader needs to make the same page again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// Seed of every random number, if there was one.
    pub seed: Option<u64>,
    /// Version of the program.
    pub version: String,
}

/// A section.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Section {
    /// Unique on the page; the section's link target.
    pub id: String,
    /// Its heading.
    pub heading: String,
    /// Its paragraphs, plain text.
    pub prose: Vec<String>,
    /// Its tables and figures, after the prose.
    pub blocks: Vec<Block>,
    /// Provenance, if it is not the page's.
    pub provenance: Option<Provenance>,
}

/// A table or a figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Block {
    /// A table.
    Table(Table),
    /// A figure.
    Figure(Figure),
    /// Either, under a label of its own ("Table 5.7") where the others are counted.
    Labelled {
        /// Text before the caption.
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

    pub(super) fn id(&self) -> &str {
        match self.content() {
            Content::Table(table) => &table.id,
            Content::Figure(figure) => &figure.id,
        }
    }

    pub(super) fn caption(&self) -> &str {
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

    /// Returns the content of any label.
    pub(super) fn content(&self) -> Content<'_> {
        match self {
            Self::Table(table) => Content::Table(table),
            Self::Figure(figure) => Content::Figure(figure),
            Self::Labelled { block, .. } => block.content(),
        }
    }
}

/// A block without its label.
#[derive(Clone, Copy)]
pub(super) enum Content<'a> {
    Table(&'a Table),
    Figure(&'a Figure),
}

/// A section as a reader meets it.
pub(super) struct Part<'a> {
    pub(super) section: &'a Section,
    pub(super) blocks: Vec<Numbered<'a>>,
    /// Provenance: the section's own, or else the page's.
    pub(super) provenance: &'a Provenance,
}

/// A block with its number among its kind: "Table 2", "Figure 5".
pub(super) struct Numbered<'a> {
    pub(super) label: String,
    pub(super) block: &'a Block,
}

impl Page {
    pub(super) fn blocks(&self) -> impl Iterator<Item = &Block> {
        self.sections.iter().flat_map(|section| &section.blocks)
    }

    pub(super) fn tables(&self) -> impl Iterator<Item = &Table> {
        self.blocks().filter_map(|block| match block.content() {
            Content::Table(table) => Some(table),
            Content::Figure(_) => None,
        })
    }

    pub(super) fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.blocks().filter_map(|block| match block.content() {
            Content::Table(_) => None,
            Content::Figure(figure) => Some(figure),
        })
    }

    pub(super) fn check(&self) -> Result<(), ReportError> {
        let mut seen = HashSet::from(RESERVED);
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

    /// Samples that every curve of the page may have, so that the page stays small.
    pub(super) fn points_per_series(&self) -> usize {
        let series: usize = self.figures().map(|figure| figure.curve_count()).sum();
        (POINTS_PER_PAGE / series.max(1)).clamp(POINTS_PER_SERIES.0, POINTS_PER_SERIES.1)
    }

    /// The same with at most `points` samples of each curve; no spike is lost.
    pub(super) fn decimated(&self, points: usize) -> Self {
        let mut page = self.clone();
        for block in page.sections.iter_mut().flat_map(|s| &mut s.blocks) {
            let mut block = block;
            while let Block::Labelled { block: inner, .. } = block {
                block = inner;
            }
            if let Block::Figure(figure) = block {
                *figure = figure.decimated(points);
            }
        }
        page
    }

    /// The sections with their blocks numbered, in reading order.
    pub(super) fn parts(&self) -> Vec<Part<'_>> {
        let (mut tables, mut figures) = (0, 0);
        let mut parts = Vec::with_capacity(self.sections.len());
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
            parts.push(Part {
                section,
                blocks,
                provenance: section.provenance.as_ref().unwrap_or(&self.provenance),
            });
        }
        parts
    }
}
