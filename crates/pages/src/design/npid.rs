//! Page of a nonlinear gain's design.

use std::f64::consts::TAU;

use quadrant_law::control::filter::FilterSettings;
use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_report::{Block, Cell, Colour, Page, Provenance, Section, Style, Table};
use quadrant_settings::popov::SectorProof;
use quadrant_sim::loop_shape::OpenLoop;
use quadrant_tune::design::robustness::Robustness;
use quadrant_tune::design::step_response::{StepProperties, StepResponse};
use quadrant_tune::design::time_varying::{Destabiliser, Switching};
use quadrant_tune::design::{Form, Process};

use crate::design::loop_figures::step_blocks;
use crate::design::pid::{step_name, step_table};
use crate::parts::{columns, lines, series};

/// Everything a nonlinear gain's design found.
#[derive(Clone, Debug)]
pub struct NonlinearPage {
    /// Process that it is designed on.
    pub subject: String,
    /// The model, its hold included in the delay as the proof counts it.
    pub plant: PlantModel,
    pub gains: PidGains,
    /// Filters behind the law.
    pub filters: Vec<FilterSettings>,
    pub proof: SectorProof,
    pub gain: NonlinearGain,
    /// The smallest destabilising gain of a search.
    pub destabiliser: Option<Destabiliser>,
    /// The bound over draws of the model.
    pub robustness: Robustness,
    /// Steps under PID and N-PID: law and response.
    pub steps: Vec<(&'static str, StepResponse)>,
}

fn switching_text(switching: Switching) -> String {
    match switching {
        Switching::Constant => "constant".to_owned(),
        Switching::Periodic { frequency_hz } => format!("switched at {frequency_hz:.0} Hz"),
        Switching::Turning {
            angle_rad,
            frequency_hz,
        } => format!(
            "by the phase of error and rate: {:.0} deg, {frequency_hz:.0} Hz",
            angle_rad.to_degrees()
        ),
    }
}

/// The largest slope of `k(e) e`, at emax: `cosh x + x sinh x` with `x = ko emax`.
fn steepest(gain: &NonlinearGain) -> f64 {
    let reach = gain.rate_per_mm * gain.range_mm;
    reach.cosh() + reach * reach.sinh()
}

impl NonlinearPage {
    /// The gain and its bounds.
    pub fn bounds_table(&self) -> Table {
        let row = |name: &str, unit: &str, value: f64, decimals: usize, meaning: &str| {
            vec![
                Cell::text(name),
                Cell::text(unit),
                Cell::number(value, decimals),
                Cell::text(meaning),
            ]
        };
        let mut rows = vec![
            row("ko", "1/mm", self.gain.rate_per_mm, 3, "rate of variation"),
            row("emax", "mm", self.gain.range_mm, 4, "range of variation"),
            row(
                "largest k(e)",
                "",
                self.gain.largest(),
                3,
                "cosh(ko emax), from emax on",
            ),
            row(
                "largest slope of k(e) e",
                "",
                steepest(&self.gain),
                3,
                "what small motions about a lasting error are amplified by; above the gain margin the loop hunts there",
            ),
            row(
                "circle bound",
                "",
                self.proof.circle,
                3,
                "any gain up to this is stable, however it varies",
            ),
            row(
                "Popov bound k_max",
                "",
                self.proof.popov,
                3,
                "any gain of the error alone up to this is stable",
            ),
            row("q", "ms", 1e3 * self.proof.slope_s, 3, "of the Popov line"),
        ];
        if let Some(found) = &self.destabiliser {
            rows.push(row(
                "smallest destabilising gain found",
                "",
                found.gain,
                3,
                &switching_text(found.switching),
            ));
        }
        Table {
            id: "nonlinear-gain".to_owned(),
            caption: "Nonlinear gain k(e) = cosh(ko sat(e, emax)) and what bounds it, the hold of the converter included"
                .to_owned(),
            columns: columns(&[("Quantity", ""), ("Unit", ""), ("Value", ""), ("Meaning", "")]),
            rows,
        }
    }

    /// The bound over the model's uncertainty.
    pub fn robustness_table(&self) -> Table {
        let bounds = &self.robustness;
        Table {
            id: "robustness".to_owned(),
            caption: format!(
                "Popov bound over {} draws of the model; the last column is the share of them for which the largest k(e) is not proven stable",
                bounds.bounds.len()
            ),
            columns: columns(&[
                ("Smallest", ""),
                ("5 % quantile", ""),
                ("Median", ""),
                ("95 % quantile", ""),
                ("Not proven", "%"),
            ]),
            rows: vec![vec![
                Cell::number(bounds.quantile(0.0), 3),
                Cell::number(bounds.quantile(0.05), 3),
                Cell::number(bounds.quantile(0.5), 3),
                Cell::number(bounds.quantile(0.95), 3),
                Cell::number(100.0 * bounds.share_below(self.gain.largest()), 2),
            ]],
        }
    }

    /// Steps (thesis, Table 4.3).
    pub fn step_table(&self) -> Table {
        let properties: Vec<(String, StepProperties)> = self
            .steps
            .iter()
            .map(|(law, step)| (step_name(law, step), step.properties()))
            .collect();
        step_table(&properties)
    }

    pub fn tables(&self) -> [Table; 3] {
        [
            self.bounds_table(),
            self.robustness_table(),
            self.step_table(),
        ]
    }

    /// The Popov plot with its line (thesis, Fig 4.9).
    fn popov_block(&self) -> Block {
        let process = Process::filtered(self.plant, &self.filters);
        let open_loop = process.open_loop(&self.gains, Form::Continuous);
        let (mut real, mut imaginary) = (Vec::new(), Vec::new());
        for index in 0..3000 {
            let omega = TAU * 10.0_f64.powf(f64::from(index) / 3000.0 * 3.5);
            let l = open_loop.response(omega);
            let h = l / (l + 1.0);
            real.push(h.re);
            imaginary.push(1e-3 * omega * h.im);
        }
        let foot = -1.0 / (self.proof.popov - 1.0);
        let lowest = imaginary.iter().copied().fold(0.0, f64::min);
        let ends = [0.5 * lowest, -0.25 * lowest];
        // The line Re H - q w Im H = foot, with w Im H in 1000 rad/s.
        let line_x = ends.map(|y| foot + self.proof.slope_s * 1e3 * y);
        Block::Figure(lines(
            "popov",
            "Popov plot of H = L / (1 + L): every gain up to k_max is stable because the plot lies right of the line, which meets the real \
             axis at -1 / (k_max - 1)",
            ("Re H", "ω Im H (1000 rad/s)"),
            vec![
                series("H", real, imaginary, Style::solid(Colour::Blue)),
                series(
                    "Popov line",
                    line_x.into(),
                    ends.into(),
                    Style::dashed(Colour::Vermillion),
                ),
                series(
                    "-1 / (k_max - 1)",
                    vec![foot],
                    vec![0.0],
                    Style::points(Colour::Ink),
                ),
            ],
        ))
    }

    /// k(e) over e (thesis, Fig 4.10).
    fn gain_block(&self) -> Block {
        let reach = 1.5 * self.gain.range_mm;
        let errors: Vec<f64> = (-300..=300).map(|i| reach * f64::from(i) / 300.0).collect();
        let gains = errors.iter().map(|&error| self.gain.at(error)).collect();
        let level = |name: &str, value: f64, style| {
            series(name, vec![-1e3 * reach, 1e3 * reach], vec![value; 2], style)
        };
        Block::Figure(lines(
            "nonlinear-gain-curve",
            "Nonlinear gain",
            ("error (um)", "k(e)"),
            vec![
                level(
                    "Popov bound",
                    self.proof.popov,
                    Style::dashed(Colour::Vermillion),
                ),
                level(
                    "circle bound",
                    self.proof.circle,
                    Style::dashed(Colour::Orange),
                ),
                series(
                    "k(e)",
                    errors.iter().map(|error| 1e3 * error).collect(),
                    gains,
                    Style::solid(Colour::Blue),
                ),
            ],
        ))
    }

    fn robustness_block(&self) -> Block {
        let bounds = &self.robustness.bounds;
        let share = (0..bounds.len())
            .map(|index| 100.0 * (index + 1) as f64 / bounds.len() as f64)
            .collect();
        let largest = self.gain.largest();
        Block::Figure(lines(
            "robustness-distribution",
            "Share of the draws whose Popov bound is below a gain",
            ("gain", "share of the draws (%)"),
            vec![
                series(
                    "Popov bound",
                    bounds.clone(),
                    share,
                    Style::solid(Colour::Blue),
                ),
                series(
                    "largest k(e)",
                    vec![largest; 2],
                    vec![0.0, 100.0],
                    Style::dashed(Colour::Vermillion),
                ),
            ],
        ))
    }

    pub fn page(&self, provenance: Provenance) -> Page {
        let steps: Vec<(String, &StepResponse, Style)> = self
            .steps
            .iter()
            .enumerate()
            .map(|(index, (law, step))| (step_name(law, step), step, Style::nth(index)))
            .collect();
        let section = |id: &str, heading: &str, prose: &str, blocks: Vec<Block>| Section {
            provenance: None,
            id: id.to_owned(),
            heading: heading.to_owned(),
            prose: vec![prose.to_owned()],
            blocks,
        };
        Page {
            title: "N-PID design".to_owned(),
            subtitle: self.subject.clone(),
            provenance,
            sections: vec![
                section(
                    "stability",
                    "How much gain the loop allows",
                    "Popov's criterion proves every gain that depends on the error alone. A gain that may also vary with time is proven by \
                     the circle criterion, up to a smaller bound; between the two a search over switching gains looks for instability.",
                    vec![
                        Block::Table(self.bounds_table()),
                        self.popov_block(),
                        self.gain_block(),
                    ],
                ),
                section(
                    "uncertainty",
                    "When the model is not quite the axis",
                    "The model is drawn from its uncertainty, and the bound computed for each draw.",
                    vec![
                        Block::Table(self.robustness_table()),
                        self.robustness_block(),
                    ],
                ),
                section(
                    "steps",
                    "Step responses",
                    "A small step sees the PID, a large one the nonlinear gain and then the converter's range.",
                    [Block::Table(self.step_table())]
                        .into_iter()
                        .chain(step_blocks(&steps))
                        .collect(),
                ),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steepest_slope_is_that_of_the_scaled_error_just_below_emax() {
        let gain = NonlinearGain {
            rate_per_mm: 15.0,
            range_mm: 0.1,
        };
        let scaled = |error: f64| gain.at(error) * error;
        let slope = (scaled(0.1) - scaled(0.1 - 1e-7)) / 1e-7;
        assert!((slope - steepest(&gain)).abs() < 1e-4, "{slope}");
    }
}
