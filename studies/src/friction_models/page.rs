//! The friction models side by side: table and page.

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_pages::parts::{UM_PER_MM, columns, lines, series};
use quadrant_report::{
    Block, Cell, Column, Figure, Page, Provenance, Section, Series, Style, Table,
};

use crate::friction_models::drift::{AMPLITUDE, FREQUENCY_HZ, MEAN};
use crate::friction_models::tracking::{TRUTHS, Tracked};
use crate::friction_models::{Behaviour, Curve, LAG_FREQUENCIES_HZ, Model, Parameters};

/// Largest closing error of a small loop that counts as closed, of the breakaway level.
const CLOSES: f64 = 0.05;

/// Returns the table of each model's properties and costs in the simulated axis.
pub fn friction_models_table(behaviours: &[Behaviour]) -> Table {
    let lag_heads = LAG_FREQUENCIES_HZ.map(|hertz| format!("lag at {hertz} Hz"));
    let mut heads = vec![
        ("Model", ""),
        ("loops, RMS to GMS", "% of Fs"),
        ("memory", ""),
        ("closing error", "% of Fs"),
        ("drift", "um/s"),
    ];
    heads.extend(lag_heads.iter().map(|head| (head.as_str(), "mV")));
    heads.extend([
        ("force in 1 nm after reversal", "mV"),
        ("slope step on virgin curve", "V/mm"),
    ]);
    let rows = behaviours
        .iter()
        .map(|behaviour| {
            let nested = behaviour.nested.as_ref();
            let memory = nested.map_or("none", |nested| {
                if nested.closing_error < CLOSES {
                    "non-local"
                } else {
                    "local"
                }
            });
            let mut row = vec![
                Cell::text(behaviour.model.name()),
                Cell::number(100.0 * behaviour.loop_error, 1),
                Cell::text(memory),
                nested.map_or(Cell::Missing, |nested| {
                    Cell::number(100.0 * nested.closing_error, 3)
                }),
                behaviour
                    .drift
                    .as_ref()
                    .map_or(Cell::Missing, |drift| Cell::number(drift.velocity_um_s, 4)),
            ];
            row.extend(
                behaviour
                    .lags
                    .iter()
                    .map(|lag| Cell::number(1e3 * lag.width_v, 2)),
            );
            row.push(Cell::number(1e3 * behaviour.reversal_step_v, 3));
            // A force that steps has no slope.
            row.push(match behaviour.model {
                Model::Static => Cell::Missing,
                _ => Cell::number(behaviour.slope_step_v_per_mm, 3),
            });
            row
        })
        .collect();
    Table {
        id: "friction-models".to_owned(),
        caption: format!(
            "What each friction model has, simulated. Memory is non-local if a small loop closes within {} % of the breakaway level; \
             drift of a free mass under a load of {MEAN} Fc that vibrates by {AMPLITUDE} Fc at {FREQUENCY_HZ} Hz",
            100.0 * CLOSES
        ),
        columns: columns(&heads),
        rows,
    }
}

/// The parameters, all from one virgin curve.
pub fn friction_parameters_table(parameters: &Parameters) -> Table {
    let Parameters { dahl, lugre, .. } = parameters;
    let friction = &parameters.friction;
    let total: f64 = friction
        .gms
        .elements
        .iter()
        .map(|element| element.stiffness_v_per_mm)
        .sum();
    let row = |model: Model, stiffness: Cell, other: String| {
        vec![Cell::text(model.name()), stiffness, Cell::text(other)]
    };
    Table {
        id: "friction-models-parameters".to_owned(),
        caption: format!(
            "Parameters; Dahl and LuGre are fitted to the loops of the GMS over {:.1} um and a third of it",
            UM_PER_MM * parameters.range_mm()
        ),
        columns: columns(&[("Model", ""), ("stiffness at rest", "V/mm"), ("others", "")]),
        rows: vec![
            row(
                Model::Static,
                Cell::Missing,
                "none before sliding".to_owned(),
            ),
            row(
                Model::Dahl,
                Cell::number(dahl.stiffness_v_per_mm, 3),
                format!("delta {:.3}; slides at Fc", dahl.exponent),
            ),
            row(
                Model::Lugre,
                Cell::number(lugre.stiffness_v_per_mm, 3),
                format!("sigma1 {:.3} mV s/mm", 1e3 * lugre.damping_v_s_per_mm),
            ),
            row(
                Model::Gms,
                Cell::number(total, 3),
                format!(
                    "{} elements, C {:.2} V/s",
                    friction.gms.elements.len(),
                    friction.gms.attraction_v_s
                ),
            ),
            row(
                Model::SmoothedGms,
                Cell::number(total, 3),
                format!(
                    "those of the GMS; width {:.3} of each element's level",
                    friction.smoothed_gms.width
                ),
            ),
        ],
    }
}

/// Returns the table of RMS error and glitch that each kind of feedforward leaves on axes of each friction model.
pub fn tracking_table(tracked: &[Tracked]) -> Table {
    let heads: Vec<String> = TRUTHS
        .iter()
        .flat_map(|truth| ["RMS", "glitch"].map(|what| format!("{what} on {}", truth.name())))
        .collect();
    let mut columns = columns(&[("Feedforward", "")]);
    columns.extend(heads.iter().map(|head| Column::with_unit(head, "um")));
    let rows = FeedforwardKind::ALL
        .into_iter()
        .map(|kind| {
            let mut row = vec![Cell::text(kind_name(kind))];
            for truth in TRUTHS {
                let found = tracked.iter().find(|t| t.kind == kind && t.truth == truth);
                row.extend(
                    [found.map(|t| t.rms_mm), found.map(|t| t.glitch_mm)]
                        .map(|mm| mm.map_or(Cell::Missing, |mm| Cell::number(UM_PER_MM * mm, 2))),
                );
            }
            row
        })
        .collect();
    Table {
        id: "friction-models-tracking".to_owned(),
        caption: "Tracking error with each feedforward under N-PID, on simulated axes whose friction follows the model at the head of \
                  the column; mean over sines of 30 mm at 5, 10 and 15 mm/s"
            .to_owned(),
        columns,
        rows,
    }
}

const fn kind_name(kind: FeedforwardKind) -> &'static str {
    match kind {
        FeedforwardKind::None => "none",
        FeedforwardKind::Static => "static",
        FeedforwardKind::Gms => "GMS alone",
        FeedforwardKind::Combined => "static + GMS",
        FeedforwardKind::Dahl => "Dahl",
        FeedforwardKind::Lugre => "LuGre",
        FeedforwardKind::SmoothedGms => "S-GMS",
    }
}

pub fn friction_models_page(
    parameters: &Parameters,
    behaviours: &[Behaviour],
    tracked: &[Tracked],
    axis: &str,
    provenance: Provenance,
) -> Page {
    Page {
        title: "Friction models".to_owned(),
        subtitle: format!("{axis}; simulated, not measured"),
        provenance,
        sections: friction_models_sections(parameters, behaviours, tracked),
    }
}

/// The sections of the page.
pub fn friction_models_sections(
    parameters: &Parameters,
    behaviours: &[Behaviour],
    tracked: &[Tracked],
) -> Vec<Section> {
    vec![
            Section {
                provenance: None,
                id: "summary".to_owned(),
                heading: "Who has what".to_owned(),
                prose: vec![
                    "All models are moved alike and have their parameters from one virgin curve. Moved slowly (0.01 mm/s) they show \
                     pre-sliding and memory; as the friction of a free mass, whether they let it drift; while sliding, how friction \
                     lags behind the velocity."
                        .to_owned(),
                ],
                blocks: vec![
                    Block::Table(friction_models_table(behaviours)),
                    Block::Table(friction_parameters_table(parameters)),
                ],
            },
            presliding(behaviours),
            memory(behaviours),
            drifting(behaviours),
            lagging(behaviours),
            Section {
                provenance: None,
                id: "tracking".to_owned(),
                heading: "As feedforward".to_owned(),
                prose: vec![
                    "The same settings on axes that differ in their friction alone. A model does best on an axis that follows it."
                        .to_owned(),
                ],
                blocks: vec![Block::Table(tracking_table(tracked))],
            },
        ]
}

fn presliding(behaviours: &[Behaviour]) -> Section {
    let force = |id: &str, caption: &str, of: fn(&Behaviour) -> Option<&Curve>| {
        figure(id, caption, "friction (V)", behaviours, of)
    };
    Section {
        provenance: None,
        id: "pre-sliding".to_owned(),
        heading: "Pre-sliding".to_owned(),
        prose: vec![
            "The static model jumps. The slope of GMS falls in steps, an element at a time; that of the others is continuous.".to_owned(),
        ],
        blocks: vec![
            force("models-virgin", "Virgin curves", |b| Some(&b.virgin)),
            figure(
                "models-slope",
                "Slope of the virgin curves; the static model has none",
                "slope (V/mm)",
                behaviours,
                |b| (b.model != Model::Static).then_some(&b.slope),
            ),
            force("models-loop", "Hysteresis over the pre-sliding range", |b| Some(&b.loops[0])),
            force("models-small-loop", "Hysteresis over a third of it", |b| Some(&b.loops[1])),
        ],
    }
}

fn memory(behaviours: &[Behaviour]) -> Section {
    Section {
        provenance: None,
        id: "memory".to_owned(),
        heading: "Memory".to_owned(),
        prose: vec![
            "On the way up the axis turns back and returns. Real friction then goes on as if it had not turned: the small loop closes. \
             A model with one state cannot know where it turned."
                .to_owned(),
        ],
        blocks: vec![figure(
            "models-memory",
            "A small loop within a large one",
            "friction (V)",
            behaviours,
            |b| b.nested.as_ref().map(|nested| &nested.path),
        )],
    }
}

fn drifting(behaviours: &[Behaviour]) -> Section {
    let drawn = named(behaviours, |b| {
        let (time, position) = &b.drift.as_ref()?.path;
        Some((time.clone(), scaled(position)))
    });
    Section {
        provenance: None,
        id: "drift".to_owned(),
        heading: "Drift under vibration".to_owned(),
        prose: vec![
            "The load stays below breakaway, so a body on real friction stays where it is. Positions are means over each period."
                .to_owned(),
        ],
        blocks: vec![Block::Figure(lines(
            "models-drift",
            "Position of a free mass under a vibrating load below breakaway",
            ("time (s)", "position (um)"),
            drawn,
        ))],
    }
}

fn lagging(behaviours: &[Behaviour]) -> Section {
    let blocks = LAG_FREQUENCIES_HZ
        .iter()
        .enumerate()
        .map(|(index, hertz)| {
            let drawn = named(behaviours, |b| Some(b.lags.get(index)?.path.clone()));
            Block::Figure(lines(
                &format!("models-lag-{hertz}-hz"),
                &format!(
                    "Friction without its viscous part while the velocity swings at {hertz} Hz"
                ),
                ("velocity (mm/s)", "friction (V)"),
                drawn,
            ))
        })
        .collect();
    Section {
        provenance: None,
        id: "lag".to_owned(),
        heading: "Lag in sliding".to_owned(),
        prose: vec![
            "The velocity swings about the Stribeck velocity. Static friction and Dahl's follow at once, Dahl's with no Stribeck effect; \
             LuGre lags by the distance over which its bristles bend, GMS by the time that C sets."
                .to_owned(),
        ],
        blocks,
    }
}

fn scaled(mm: &[f64]) -> Vec<f64> {
    mm.iter().map(|mm| UM_PER_MM * mm).collect()
}

/// A figure of forces or slopes against displacement.
fn figure(
    id: &str,
    caption: &str,
    label: &str,
    behaviours: &[Behaviour],
    of: fn(&Behaviour) -> Option<&Curve>,
) -> Block {
    let drawn = named(behaviours, |b| {
        of(b).map(|(x, force)| (scaled(x), force.clone()))
    });
    let figure: Figure = lines(id, caption, ("displacement (um)", label), drawn);
    Block::Figure(figure)
}

/// One curve a model, in a style that is the model's throughout.
fn named(behaviours: &[Behaviour], curve: impl Fn(&Behaviour) -> Option<Curve>) -> Vec<Series> {
    behaviours
        .iter()
        .enumerate()
        .filter_map(|(index, behaviour)| {
            let (x, y) = curve(behaviour)?;
            Some(series(behaviour.model.name(), x, y, Style::nth(index)))
        })
        .collect()
}
