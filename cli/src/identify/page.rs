//! The page of one step of `quadrant identify`.

use quadrant_sim::report::{Page, Provenance, Section};

/// A page of one step.
pub(super) fn page(
    title: &str,
    axis: &str,
    sections: Vec<Section>,
    provenance: Provenance,
) -> Page {
    Page {
        title: title.to_owned(),
        subtitle: axis.to_owned(),
        provenance,
        sections,
    }
}
