//! The table and page of the revised linear model (thesis, Table 3.4, Figs 3.16-3.21).

use quadrant_law::control::plant_model::PlantModel;
use quadrant_report::{Block, Cell, Colour, Column, Page, Provenance, Section, Style, Table};
use quadrant_tune::identify::fit::Fit;
use quadrant_tune::identify::response::FrequencyResponse;
use quadrant_tune::identify::revise::{ExplicitFriction, Misfit, Revision};

use crate::identify::bode::{Curve, bode_figures};

/// A response at one amplitude of the excitation: as measured, and as the model with friction predicts it.
pub struct AmplitudeResponse {
    /// RMS of the excitation, V.
    pub amplitude_v: f64,
    pub measured: FrequencyResponse,
    /// As predicted by the model revised for static and GMS friction.
    pub predicted: FrequencyResponse,
}

/// The original linear model beside the revised ones, and how far each lies from the measured response.
pub fn revise_table(original: &PlantModel, revisions: &[Revision]) -> Table {
    let misfit = |misfit: Option<Misfit>| {
        let (gain, phase) = misfit.map_or((Cell::Missing, Cell::Missing), |misfit| {
            (
                Cell::number(misfit.gain_db, 2),
                Cell::number(misfit.phase_deg, 1),
            )
        });
        [gain, phase]
    };
    let row =
        |name: String, plant: &PlantModel, fit: Option<&Fit>, misfits: [Option<Misfit>; 2]| {
            let error = |index: usize| {
                // At a bound the standard error means nothing.
                fit.filter(|fit| !fit.at_bound[index])
                    .map_or(Cell::Missing, |fit| {
                        Cell::number(fit.standard_errors[index], 1)
                    })
            };
            let mut cells = vec![
                Cell::text(name),
                Cell::number(plant.gain_mm_per_v_s2, 0),
                error(0),
                Cell::number(plant.damping_per_s, 1),
                error(1),
                Cell::number(plant.stiffness_per_s2, 1),
                error(2),
                Cell::number(plant.delay_s * 1e3, 3),
            ];
            cells.extend(misfits.into_iter().flat_map(misfit));
            cells
        };
    let revised = revisions.iter().map(|revision| {
        row(
            format!("revised for {}", revision.friction),
            &revision.plant,
            Some(&revision.fit),
            [Some(revision.misfit.0), Some(revision.misfit.1)],
        )
    });
    Table {
        id: "revised-model".to_owned(),
        caption: "Original and revised linear model. The misfit is the RMS distance of model and friction together from the \
                  measured response, before and after the revision"
            .to_owned(),
        columns: vec![
            Column::new("Model"),
            Column::with_unit("A", "mm/(V s²)"),
            Column::with_unit("± A", "mm/(V s²)"),
            Column::with_unit("B", "1/s"),
            Column::with_unit("± B", "1/s"),
            Column::with_unit("C", "1/s²"),
            Column::with_unit("± C", "1/s²"),
            Column::with_unit("Td", "ms"),
            Column::with_unit("Misfit before", "dB"),
            Column::with_unit("Misfit before", "deg"),
            Column::with_unit("Misfit after", "dB"),
            Column::with_unit("Misfit after", "deg"),
        ],
        rows: std::iter::once(row("original".to_owned(), original, None, [None, None]))
            .chain(revised)
            .collect(),
    }
}

/// The page of a revision.
pub fn revise_page(
    axis: &str,
    measured: &FrequencyResponse,
    original: &PlantModel,
    revisions: &[Revision],
    amplitudes: &[AmplitudeResponse],
    provenance: Provenance,
) -> Page {
    Page {
        title: "Linear model revised for explicit friction".to_owned(),
        subtitle: axis.to_owned(),
        provenance,
        sections: revise_sections(measured, original, revisions, amplitudes),
    }
}

/// Its sections; that on amplitudes is left out where there are none.
pub fn revise_sections(
    measured: &FrequencyResponse,
    original: &PlantModel,
    revisions: &[Revision],
    amplitudes: &[AmplitudeResponse],
) -> Vec<Section> {
    let mut blocks = vec![Block::Table(revise_table(original, revisions))];
    for revision in revisions {
        let name = match revision.friction {
            ExplicitFriction::None => "none",
            ExplicitFriction::Static => "static",
            ExplicitFriction::Gms => "gms",
            ExplicitFriction::Both => "both",
        };
        blocks.extend(bode_figures(
            &format!("revised-{name}"),
            &format!(
                "Measured, original and revised response with {} friction",
                revision.friction
            ),
            &[
                Curve {
                    name: "measured".to_owned(),
                    response: measured,
                    style: Style::points(Colour::Ink),
                },
                Curve {
                    name: "original, with friction".to_owned(),
                    response: &revision.responses.0,
                    style: Style::dashed(Colour::Vermillion),
                },
                Curve {
                    name: "revised, with friction".to_owned(),
                    response: &revision.responses.1,
                    style: Style::solid(Colour::Blue),
                },
            ],
        ));
    }
    let mut sections = vec![Section {
        provenance: None,
        id: "revised".to_owned(),
        heading: "Linear model and friction together".to_owned(),
        prose: vec![
            "An axis' frequency response already contains its friction. With friction explicit, A, B and C are revised until \
             both together show what was measured; every candidate is excited as the axis was. The friction carries the whole \
             viscous damping, which motion cannot separate from B, so B falls towards zero wherever the friction has a viscous term."
                .to_owned(),
            "For controllers the original model counts: it is what the loop sees at working amplitude.".to_owned(),
        ],
        blocks,
    }];
    if !amplitudes.is_empty() {
        let curves: Vec<Curve<'_>> = amplitudes
            .iter()
            .enumerate()
            .flat_map(|(index, at)| {
                let style = Style::nth(index);
                [
                    Curve {
                        name: format!("{} V, measured", at.amplitude_v),
                        response: &at.measured,
                        style: Style::points(style.colour),
                    },
                    Curve {
                        name: format!("{} V, predicted", at.amplitude_v),
                        response: &at.predicted,
                        style,
                    },
                ]
            })
            .collect();
        sections.push(Section {
            provenance: None,
            id: "amplitude".to_owned(),
            heading: "The response depends on the amplitude".to_owned(),
            prose: vec![
                "The same axis at several amplitudes of the excitation. At small ones the pre-sliding friction is a spring and \
                 the response flattens; at large ones friction is a small part of the voltage, and the response nears the \
                 linear model's."
                    .to_owned(),
            ],
            blocks: bode_figures("amplitude", "Response by RMS of the excitation", &curves).into(),
        });
    }
    sections
}
