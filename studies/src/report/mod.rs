//! `quadrant-studies report`: parts, each a few sections of one page, kept in files so that an interrupted report goes
//! on where it stopped.
//!
//! A new part is a function from [`Context`] to sections and one line in [`PARTS`].

mod chapters;
pub mod command;
mod comparative_studies;
mod context;
mod designs;
mod progress;
mod store;

use std::path::PathBuf;

use quadrant_report::Section;

pub use context::Context;
pub use progress::Progress;
use store::{Key, Store, Stored};

/// One part of the report.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Its name on the command line and of its file: lower-case letters, digits and hyphens.
    pub id: &'static str,
    pub title: &'static str,
    /// About how long it takes on two cores, s, without the runs of chapter 5: its share of the progress bar.
    pub expected_s: fn(&Context) -> f64,
    /// True if it needs [`Context::comparison`], the runs of chapter 5, which parts of one report share.
    pub needs_comparison: bool,
    /// Computes it. The same context must give the same sections, for any number of threads.
    pub run: fn(&Context, &Progress) -> anyhow::Result<Vec<Section>>,
}

/// All parts, in the order of the page.
pub const PARTS: &[Part] = &[
    Part {
        id: "headline",
        title: "The thesis' headline figures beside ours, and what limits ours",
        expected_s: chapters::headline_s,
        needs_comparison: true,
        run: chapters::headline,
    },
    Part {
        id: "chapter-3",
        title: "Identification of the x axis: Tables 3.1 to 3.4, Figures 3.5 to 3.21",
        expected_s: |_| 25.0,
        needs_comparison: false,
        run: designs::identification,
    },
    Part {
        id: "chapter-4",
        title: "PID and N-PID: Tables 4.1 to 4.4, Figures 4.2 to 4.11",
        expected_s: |_| 1.0,
        needs_comparison: false,
        run: designs::controllers,
    },
    Part {
        id: "chapter-5",
        title: "Every controller with every feedforward: Tables 5.1 to 5.22, Figures 5.1 to 5.18",
        expected_s: |_| 2.0,
        needs_comparison: true,
        run: chapters::chapter5,
    },
    Part {
        id: "laws",
        title: "Every feedback law at equal robustness, and what feedforward is worth when its model is wrong",
        expected_s: |_| 70.0,
        needs_comparison: false,
        run: comparative_studies::laws,
    },
    Part {
        id: "friction-models",
        title: "Dahl, LuGre, GMS and smoothed GMS: pre-sliding, memory, drift, lag, and each as feedforward",
        expected_s: |_| 20.0,
        needs_comparison: false,
        run: comparative_studies::friction_models,
    },
    Part {
        id: "robustness",
        title: "Changed mass, friction, delay, amplifier, encoder; cutting; other drives",
        expected_s: |_| 30.0,
        needs_comparison: false,
        run: comparative_studies::scenarios,
    },
    Part {
        id: "circle",
        title: "Circle tests after ISO 230-4 in three planes",
        expected_s: |_| 20.0,
        needs_comparison: false,
        run: comparative_studies::circles,
    },
];

/// Request for a report.
pub struct Request<'a> {
    /// The parts, in the order of the page.
    pub parts: &'a [Part],
    /// Inputs.
    pub context: &'a Context,
    /// Folder of the parts' files; made if it is missing.
    pub folder: PathBuf,
    /// True if files of earlier reports are left unread.
    pub fresh: bool,
}

/// A part that is done.
pub struct Done {
    pub part: Part,
    pub sections: Vec<Section>,
}

/// Computes the parts one after the other, or takes them from their files. `report_line` gets a line for each part that is not
/// computed, and for each file that cannot be used.
///
/// # Errors
/// The first part that fails, by name, or a file that cannot be written. Parts that were done stay in their files.
pub fn compute(
    request: &Request<'_>,
    bar: &indicatif::ProgressBar,
    report_line: &mut dyn FnMut(String),
) -> anyhow::Result<Vec<Done>> {
    let Request { context, .. } = request;
    let store = Store::new(&request.folder)?;
    let found: Vec<(Key, Option<Vec<Section>>)> = request
        .parts
        .iter()
        .map(|part| {
            let key = Key::new(part.id, context)?;
            let sections = match store.read(part.id, &key) {
                _ if request.fresh => None,
                Stored::Missing => None,
                Stored::Unusable(reason) => {
                    report_line(format!("{reason}: {} is computed again", part.id));
                    None
                }
                Stored::Sections(sections) => Some(sections),
            };
            Ok((key, sections))
        })
        .collect::<anyhow::Result<_>>()?;
    let mut comparison_s = context.comparison_s();
    let expected_s: Vec<f64> = request
        .parts
        .iter()
        .zip(&found)
        .map(|(part, (_, sections))| match sections {
            Some(_) => 0.0,
            None if part.needs_comparison => {
                (part.expected_s)(context) + std::mem::take(&mut comparison_s)
            }
            None => (part.expected_s)(context),
        })
        .collect();
    let mut progress = Progress::new(bar, expected_s.iter().sum());
    request
        .parts
        .iter()
        .zip(found)
        .zip(expected_s)
        .map(|((part, (key, sections)), expected_s)| {
            if let Some(sections) = sections {
                let path = store.path(part.id);
                report_line(format!("{}: kept from {}", part.id, path.display()));
                return Ok(Done {
                    part: *part,
                    sections,
                });
            }
            progress.begin(part.id, expected_s);
            let mut sections = (part.run)(context, &progress)
                .map_err(|error| error.context(format!("part {}", part.id)))?;
            for section in &mut sections {
                section.provenance = Some(context.provenance(&[part.id]));
            }
            store.write(part.id, &key, &sections)?;
            progress.end();
            Ok(Done {
                part: *part,
                sections,
            })
        })
        .collect()
}
