//! A page as files, in the formats its readers want.

use std::path::{Path, PathBuf};

use quadrant_written::whole;
use serde::Serialize;

use super::{Figure, Lines, Page, Plot, PolarDeviation, ReportError};

/// Names the meaning of a page's JSON; a change of meaning changes the number.
const SCHEMA: &str = "quadrant-report/1";
/// Folder of what is written figure by figure.
pub const FIGURES: &str = "figures";

/// A format of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Format {
    /// One self-contained page with zoomable figures.
    Html,
    /// Each table, and in a folder `figures` the data of each figure.
    Csv,
    /// The whole page as data: tables, figures, how they were made.
    Json,
    /// Each figure as an image for print, in a folder `figures`.
    Svg,
}

/// A page in a JSON file.
#[derive(Serialize)]
struct Document {
    schema: &'static str,
    page: Page,
}

impl Page {
    /// Writes the page into a folder, which is made, as `name.html` and `name.json`, its tables as `<id>.csv`, its
    /// figures as `figures/<id>.csv` and `figures/<id>.svg`: those of them that `formats` asks for. Returns the paths
    /// of the files. The same data give the same bytes.
    ///
    /// # Errors
    /// As [`Self::to_html`], for all formats; files that cannot be written.
    pub fn write(
        &self,
        folder: &Path,
        name: &str,
        formats: &[Format],
    ) -> Result<Vec<PathBuf>, ReportError> {
        self.check()?;
        let figures = folder.join(FIGURES);
        let has = |format| formats.contains(&format);
        make_folder(folder)?;
        if self.figures().next().is_some() && (has(Format::Csv) || has(Format::Svg)) {
            make_folder(&figures)?;
        }
        let mut written = Vec::new();
        let mut put = |path: PathBuf, text: &str| {
            file(&path, text)?;
            written.push(path);
            Ok::<(), ReportError>(())
        };
        if has(Format::Html) {
            put(folder.join(format!("{name}.html")), &self.to_html()?)?;
        }
        if has(Format::Json) {
            put(folder.join(format!("{name}.json")), &self.to_json()?)?;
        }
        if has(Format::Csv) {
            for table in self.tables() {
                put(folder.join(format!("{}.csv", table.id)), &table.to_csv()?)?;
            }
            let points = self.points_per_series();
            for figure in self.figures() {
                let csv = figure.decimated(points).to_csv()?;
                put(figures.join(format!("{}.csv", figure.id)), &csv)?;
            }
        }
        if has(Format::Svg) {
            for figure in self.figures() {
                put(
                    figures.join(format!("{}.svg", figure.id)),
                    &figure.to_svg()?,
                )?;
            }
        }
        Ok(written)
    }

    /// The page as JSON: an object of `schema`, which names this format, and `page`, which has the fields of [`Page`].
    /// Curves have the samples that the HTML page draws, unrounded; a gap is `null`.
    pub fn to_json(&self) -> Result<String, ReportError> {
        self.check()?;
        let document = Document {
            schema: SCHEMA,
            page: self.decimated(self.points_per_series()),
        };
        let mut text =
            serde_json::to_string(&document).expect("a page has nothing JSON cannot hold");
        text.push('\n');
        Ok(text)
    }
}

impl Figure {
    /// The figure's data as CSV, one line for each sample, units in the heads, gaps empty.
    pub fn to_csv(&self) -> Result<String, ReportError> {
        self.check()?;
        let mut csv = csv::Writer::from_writer(Vec::new());
        let mut row = |cells: Vec<String>| {
            csv.write_record(&cells)
                .expect("rows of one length go into memory");
        };
        match &self.plot {
            Plot::Lines(lines) => lines_csv(lines, &mut row),
            Plot::PolarDeviation(circle) => circle_csv(circle, &mut row),
        }
        let bytes = csv.into_inner().expect("memory takes every byte");
        Ok(String::from_utf8(bytes).expect("CSV of text is text"))
    }
}

fn number(value: f64) -> String {
    if value.is_finite() {
        value.to_string()
    } else {
        String::new()
    }
}

fn lines_csv(lines: &Lines, row: &mut dyn FnMut(Vec<String>)) {
    row(vec![
        "series".to_owned(),
        lines.x_label.clone(),
        lines.y_label.clone(),
    ]);
    for series in &lines.series {
        for (&x, &y) in series.x.iter().zip(&series.y) {
            row(vec![series.name.clone(), number(x), number(y)]);
        }
    }
}

fn circle_csv(circle: &PolarDeviation, row: &mut dyn FnMut(Vec<String>)) {
    row(["series", "angle (rad)", "radial deviation (um)"]
        .map(str::to_owned)
        .into());
    for trace in &circle.traces {
        for (&angle, &deviation) in trace.angle_rad.iter().zip(&trace.deviation_um) {
            row(vec![trace.name.clone(), number(angle), number(deviation)]);
        }
    }
}

/// Writes a file.
pub(super) fn file(path: &Path, text: &str) -> Result<(), ReportError> {
    whole::replace(path, text).map_err(|source| ReportError::Write {
        path: path.to_owned(),
        source,
    })
}

fn make_folder(path: &Path) -> Result<(), ReportError> {
    std::fs::create_dir_all(path).map_err(|source| ReportError::Write {
        path: path.to_owned(),
        source,
    })
}
