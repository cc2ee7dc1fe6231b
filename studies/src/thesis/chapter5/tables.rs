//! Tables 5.1 to 5.22.

use FeedforwardKind::{Combined, None as Without};
use ModelKnowledge::{Exact, Identified};
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_pages::compare::comparison::{AMPLITUDES_MM, Entry};
use quadrant_pages::compare::sine::VELOCITIES_MM_S;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::ModelKnowledge;
use quadrant_pages::parts::{UM_PER_MM, statistic_cells};
use quadrant_report::{Block, Cell, Column, Table};
use quadrant_sim::metrics::{Metric, change_percent};

use crate::thesis::chapter5::{CONTROLLERS, Chapter, knowledge_name};

/// Name of the PID that no gain is denied, without feedforward.
const BEST_PID: &str = "none, best PID";

/// One side of a comparison: the heading of its columns, and whether its runs are repeated.
struct Side {
    heading: String,
    repeated: bool,
}

impl Side {
    fn new(heading: &str, knowledge: ModelKnowledge) -> Self {
        Self {
            heading: heading.to_owned(),
            repeated: knowledge == Identified,
        }
    }

    fn columns(&self, measure: &Metric) -> Vec<Column> {
        let heading = format!("{} {}", measure.name, self.heading);
        let mut columns = vec![Column::with_unit(heading.trim(), "um")];
        if self.repeated {
            columns.push(Column::with_unit("±", "um"));
        }
        columns
    }

    fn cells(&self, entry: Option<&Entry>, measure: &Metric) -> Vec<Cell> {
        let statistic = entry.map(|entry| entry.statistic(measure.read));
        let [mean, deviation] = statistic_cells(statistic, UM_PER_MM, 2);
        if self.repeated {
            vec![mean, deviation]
        } else {
            vec![mean]
        }
    }
}

/// The change between two entries' means, %.
fn change(from: Option<&Entry>, to: Option<&Entry>, measure: &Metric) -> Cell {
    let mean = |entry: &Entry| entry.statistic(measure.read).mean;
    match (from, to) {
        (Some(from), Some(to)) => Cell::number(change_percent(mean(from), mean(to)), 1),
        _ => Cell::Missing,
    }
}

/// A row that sets two entries beside each other.
struct Pair<'a> {
    labels: Vec<Cell>,
    entries: [Option<&'a Entry>; 2],
}

/// Two sides, and the change from the first to the second.
fn pair_table(
    number: usize,
    caption: &str,
    labels: Vec<Column>,
    sides: [Side; 2],
    measures: &[Metric],
    rows: Vec<Pair<'_>>,
) -> Block {
    let mut columns = labels;
    for measure in measures {
        columns.extend(sides.iter().flat_map(|side| side.columns(measure)));
        columns.push(Column::with_unit("Change", "%"));
    }
    let rows = rows
        .into_iter()
        .map(
            |Pair {
                 labels,
                 entries: [left, right],
             }| {
                let mut cells = labels;
                for measure in measures {
                    cells.extend(sides[0].cells(left, measure));
                    cells.extend(sides[1].cells(right, measure));
                    cells.push(change(left, right, measure));
                }
                cells
            },
        )
        .collect();
    numbered(number, caption, columns, rows)
}

/// The table under the thesis' number.
fn numbered(number: usize, caption: &str, columns: Vec<Column>, rows: Vec<Vec<Cell>>) -> Block {
    Block::Table(Table {
        id: format!("table-5-{number}"),
        caption: caption.to_owned(),
        columns,
        rows,
    })
    .labelled(format!("Table 5.{number}"))
}

fn velocity_column() -> Column {
    Column::with_unit("Velocity", "mm/s")
}

fn velocity_cell(velocity_mm_s: f64) -> Cell {
    Cell::number(velocity_mm_s, 0)
}

impl Chapter<'_> {
    /// Tables 5.1 to 5.4: the controllers alone.
    pub(super) fn controller_tables(&self) -> Vec<Block> {
        let simulated_and_measured = CONTROLLERS.into_iter().zip(1..).map(|(controller, number)| {
            let name = controller.name();
            pair_table(
                number,
                &format!("Tracking error with {name}, with the exact and the identified model, by velocity"),
                vec![velocity_column()],
                [Side::new("exact", Exact), Side::new("identified", Identified)],
                &Metric::TRACKING,
                self.by_velocity(|velocity| {
                    [Exact, Identified]
                        .map(|knowledge| self.entry(controller, Without, knowledge, velocity))
                }),
            )
        });
        let against = |number, caption: &str, measures: &[Metric]| {
            pair_table(
                number,
                caption,
                vec![velocity_column()],
                ["PID", "N-PID"].map(|name| Side::new(name, Identified)),
                measures,
                self.by_velocity(|velocity| {
                    CONTROLLERS
                        .map(|controller| self.entry(controller, Without, Identified, velocity))
                }),
            )
        };
        simulated_and_measured
            .chain([
                against(
                    3,
                    "Tracking error with PID and with N-PID, identified model, by velocity",
                    &Metric::TRACKING,
                ),
                against(
                    4,
                    "Quadrant glitch with PID and with N-PID, identified model, by velocity",
                    &[Metric::GLITCH],
                ),
            ])
            .collect()
    }

    fn by_velocity<'a>(&self, entries: impl Fn(f64) -> [Option<&'a Entry>; 2]) -> Vec<Pair<'a>> {
        VELOCITIES_MM_S
            .into_iter()
            .map(|velocity| Pair {
                labels: vec![velocity_cell(velocity)],
                entries: entries(velocity),
            })
            .collect()
    }

    /// Tables 5.5 to 5.9 with PID, 5.10 to 5.14 with N-PID: each feedforward.
    pub(super) fn feedforward_tables(&self, controller: LawKind, first: usize) -> Vec<Block> {
        let name = controller.name();
        let tracking = [Exact, Identified].into_iter().zip(first..).map(|(knowledge, number)| {
            self.feedforward_table(
                number,
                &format!(
                    "Tracking error with {name} and each feedforward, {}; change against {name} alone",
                    knowledge_name(knowledge)
                ),
                controller,
                knowledge,
                &Metric::TRACKING,
                &VELOCITIES_MM_S,
            )
        });
        let glitches = VELOCITIES_MM_S.iter().zip(first + 2..).map(|(velocity, number)| {
            self.feedforward_table(
                number,
                &format!(
                    "Quadrant glitch with {name} and each feedforward at {velocity} mm/s, {}; change against {name} alone",
                    knowledge_name(Identified)
                ),
                controller,
                Identified,
                &[Metric::GLITCH],
                std::slice::from_ref(velocity),
            )
        });
        tracking.chain(glitches).collect()
    }

    fn feedforward_table(
        &self,
        number: usize,
        caption: &str,
        controller: LawKind,
        knowledge: ModelKnowledge,
        measures: &[Metric],
        velocities_mm_s: &[f64],
    ) -> Block {
        let side = Side::new("", knowledge);
        let mut columns = vec![velocity_column(), Column::new("Feedforward")];
        for measure in measures {
            columns.extend(side.columns(measure));
            columns.push(Column::with_unit("Change", "%"));
        }
        let mut rows = Vec::new();
        for &velocity in velocities_mm_s {
            let alone = self.entry(controller, Without, knowledge, velocity);
            for feedforward in FeedforwardKind::THESIS {
                let entry = self.entry(controller, feedforward, knowledge, velocity);
                let mut cells = vec![velocity_cell(velocity), Cell::text(feedforward.name())];
                for measure in measures {
                    cells.extend(side.cells(entry, measure));
                    cells.push(if feedforward == Without {
                        Cell::Missing
                    } else {
                        change(alone, entry, measure)
                    });
                }
                rows.push(cells);
            }
            if controller == LawKind::Pid {
                let best = self.comparison.find(
                    Configuration::BEST_PID,
                    knowledge,
                    AMPLITUDES_MM[0],
                    velocity,
                );
                let mut cells = vec![velocity_cell(velocity), Cell::text(BEST_PID)];
                for measure in measures {
                    cells.extend(side.cells(best, measure));
                    cells.push(change(alone, best, measure));
                }
                rows.push(cells);
            }
        }
        numbered(number, caption, columns, rows)
    }

    /// Tables 5.15 to 5.20: both controllers with each feedforward.
    pub(super) fn side_by_side_tables(&self) -> Vec<Block> {
        let one = |number, what: &str, measures: &[Metric], velocity: f64| {
            pair_table(
                number,
                &format!(
                    "{what} with PID and with N-PID and each feedforward at {velocity} mm/s, {}",
                    knowledge_name(Identified)
                ),
                vec![Column::new("Feedforward")],
                ["PID", "N-PID"].map(|name| Side::new(name, Identified)),
                measures,
                FeedforwardKind::THESIS
                    .into_iter()
                    .map(|feedforward| Pair {
                        labels: vec![Cell::text(feedforward.name())],
                        entries: CONTROLLERS.map(|controller| {
                            self.entry(controller, feedforward, Identified, velocity)
                        }),
                    })
                    .collect(),
            )
        };
        let glitches = VELOCITIES_MM_S.into_iter().zip(15..);
        let errors = VELOCITIES_MM_S.into_iter().zip(18..);
        glitches
            .map(|(velocity, number)| one(number, "Quadrant glitch", &[Metric::GLITCH], velocity))
            .chain(errors.map(|(velocity, number)| {
                one(number, "Tracking error", &Metric::TRACKING, velocity)
            }))
            .collect()
    }

    /// Tables 5.21 and 5.22: both amplitudes, without and with combined feedforward.
    pub(super) fn amplitude_tables(&self) -> Vec<Block> {
        let one = |number, what: &str, measures: &[Metric]| {
            let mut rows = Vec::new();
            for controller in CONTROLLERS {
                for amplitude in AMPLITUDES_MM.into_iter().rev() {
                    for velocity in VELOCITIES_MM_S {
                        rows.push(Pair {
                            labels: vec![
                                Cell::text(controller.name()),
                                Cell::number(amplitude, 0),
                                velocity_cell(velocity),
                            ],
                            entries: [Without, Combined].map(|feedforward| {
                                self.at(amplitude, controller, feedforward, Identified, velocity)
                            }),
                        });
                    }
                }
            }
            pair_table(
                number,
                &format!(
                    "{what} without feedforward and with static and GMS feedforward at both amplitudes, {}",
                    knowledge_name(Identified)
                ),
                vec![
                    Column::new("Controller"),
                    Column::with_unit("Amplitude", "mm"),
                    velocity_column(),
                ],
                ["without", "with"].map(|name| Side::new(name, Identified)),
                measures,
                rows,
            )
        };
        vec![
            one(21, "Tracking error", &[Metric::LARGEST]),
            one(22, "Quadrant glitch", &[Metric::GLITCH]),
        ]
    }
}
