//! Page of a PID's design.

use quadrant_law::control::pid::PidGains;
use quadrant_report::{Block, Cell, Colour, Page, Provenance, Section, Style, Table};
use quadrant_sim::margins::{MarginError, Margins};
use quadrant_tune::design::AnyLoop;
use quadrant_tune::design::step_response::{StepProperties, StepResponse};

use crate::design::loop_figures::{
    DrawnLoop, bode_blocks, nyquist_block, sensitivity_blocks, step_blocks,
};
use crate::parts::columns;

/// Gains of a PID (thesis, Table 4.1).
pub fn pid_table(gains: &PidGains) -> Table {
    let row = |name: &str, unit: &str, value: f64, decimals: usize| {
        vec![
            Cell::text(name),
            Cell::text(unit),
            Cell::number(value, decimals),
        ]
    };
    Table {
        id: "pid-gains".to_owned(),
        caption: "PID with filtered derivative, Kp + Ki/s + Kd s / (1 + tau s)".to_owned(),
        columns: columns(&[("Parameter", ""), ("Unit", ""), ("Value", "")]),
        rows: vec![
            row("Kp", "V/mm", gains.kp_v_per_mm, 4),
            row("Ki", "V/(mm s)", gains.ki_v_per_mm_s, 2),
            row("Kd", "V s/mm", gains.kd_v_s_per_mm, 6),
            row("tau", "us", 1e6 * gains.derivative_filter_s, 1),
        ],
    }
}

/// Margins of a loop in several forms.
pub fn margins_table(forms: &[(String, Result<Margins, MarginError>)]) -> Table {
    Table {
        id: "margins".to_owned(),
        caption: "Margins and peaks of the loop".to_owned(),
        columns: columns(&[
            ("Loop", ""),
            ("Gain margin", "dB"),
            ("at", "Hz"),
            ("Phase margin", "deg"),
            ("at", "Hz"),
            ("Peak of |S|", ""),
            ("at", "Hz"),
            ("Peak of |T|", ""),
            ("at", "Hz"),
        ]),
        rows: forms
            .iter()
            .map(|(name, margins)| {
                let mut row = vec![Cell::text(name.as_str())];
                match margins {
                    Ok(m) => row.extend([
                        Cell::number(m.gain_margin_db, 1),
                        Cell::number(m.phase_crossover_hz, 0),
                        Cell::number(m.phase_margin_deg, 1),
                        Cell::number(m.gain_crossover_hz, 1),
                        Cell::number(m.sensitivity_peak, 3),
                        Cell::number(m.sensitivity_peak_hz, 0),
                        Cell::number(m.complementary_peak, 3),
                        Cell::number(m.complementary_peak_hz, 0),
                    ]),
                    Err(_) => row.extend(std::iter::repeat_n(Cell::Missing, 8)),
                }
                row
            })
            .collect(),
    }
}

/// Time-domain properties of step responses (thesis, Tables 4.2 and 4.3).
pub fn step_table(responses: &[(String, StepProperties)]) -> Table {
    Table {
        id: "step-properties".to_owned(),
        caption: "Step response of the axis without friction, under the firmware's own difference equations; settled within 2 %"
            .to_owned(),
        columns: columns(&[
            ("Law and step", ""),
            ("Rise, 10 to 90 %", "ms"),
            ("Peak at", "ms"),
            ("Overshoot", "%"),
            ("Settled after", "ms"),
            ("Largest voltage", "V"),
        ]),
        rows: responses
            .iter()
            .map(|(name, found)| {
                let time = |seconds: f64| {
                    if seconds.is_finite() {
                        Cell::number(1e3 * seconds, 1)
                    } else {
                        Cell::Missing
                    }
                };
                vec![
                    Cell::text(name.as_str()),
                    time(found.rise_time_s),
                    time(found.peak_time_s),
                    Cell::number(found.overshoot_percent, 1),
                    time(found.settling_time_s),
                    Cell::number(found.largest_voltage_v, 2),
                ]
            })
            .collect(),
    }
}

/// Content of a page of a PID's design.
#[derive(Clone, Debug)]
pub struct PidPage<'a> {
    /// Process that it is designed on.
    pub subject: String,
    pub gains: PidGains,
    /// The loop in its forms, the one designed on first, each with its margins.
    pub forms: Vec<(String, AnyLoop<'a>, Result<Margins, MarginError>)>,
    /// The step response; a measured response has none.
    pub step: Option<StepResponse>,
}

impl PidPage<'_> {
    /// Gains, margins and, where there is one, step response.
    pub fn tables(&self) -> Vec<Table> {
        let margins: Vec<_> = self
            .forms
            .iter()
            .map(|(name, _, margins)| (name.clone(), *margins))
            .collect();
        let mut tables = vec![pid_table(&self.gains), margins_table(&margins)];
        tables.extend(
            self.step
                .as_ref()
                .map(|step| step_table(&[(step_name("PID", step), step.properties())])),
        );
        tables
    }

    pub fn page(&self, provenance: Provenance) -> Page {
        let colours = [Colour::Blue, Colour::Vermillion];
        let loops: Vec<DrawnLoop<'_, AnyLoop<'_>>> = self
            .forms
            .iter()
            .zip(colours)
            .map(|((name, open_loop, _), colour)| DrawnLoop {
                name,
                open_loop,
                style: Style::solid(colour),
            })
            .collect();
        let mut tables = self.tables().into_iter().map(Block::Table);
        let (gains, margins) = (tables.next(), tables.next());
        let mut sections = vec![
            Section {
                provenance: None,
                id: "result".to_owned(),
                heading: "Gains and margins".to_owned(),
                prose: vec![
                    "The sampled loop drives the axis through the converter's hold with the firmware's difference equations; its margins \
                     are those that the machine has."
                        .to_owned(),
                ],
                blocks: gains.into_iter().chain(margins).collect(),
            },
            Section {
                provenance: None,
                id: "open-loop".to_owned(),
                heading: "Open loop".to_owned(),
                prose: Vec::new(),
                blocks: bode_blocks(&loops)
                    .into_iter()
                    .chain([nyquist_block(&loops)])
                    .collect(),
            },
            Section {
                provenance: None,
                id: "sensitivities".to_owned(),
                heading: "Closed loop".to_owned(),
                prose: Vec::new(),
                blocks: sensitivity_blocks(&loops).into(),
            },
        ];
        if let Some(step) = &self.step {
            sections.push(Section {
                provenance: None,
                id: "step-response".to_owned(),
                heading: "Step response".to_owned(),
                prose: Vec::new(),
                blocks: tables
                    .chain(step_blocks(&[(
                        step_name("PID", step),
                        step,
                        Style::solid(Colour::Blue),
                    )]))
                    .collect(),
            });
        }
        Page {
            title: "PID design".to_owned(),
            subtitle: self.subject.clone(),
            provenance,
            sections,
        }
    }
}

/// The law and the height of its step, for a legend.
pub(super) fn step_name(law: &str, step: &StepResponse) -> String {
    format!("{law}, {} um", 1e3 * step.height_mm)
}
