//! `quadrant circle`.

use anyhow::{Context, ensure};
use clap::Args;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, command_line, progress};
use quadrant_cli::say;
use quadrant_law::axes::AxisName;
use quadrant_law::reference::Plane;
use quadrant_pages::circle::page::{circle_page, circle_tables};
use quadrant_pages::circle::{CircleRequest, run_circle_tests};
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_pages::parts::provenance;
use quadrant_sim::stage_file::StageFile;

use crate::numbers::{self, Numbers};
use crate::own_stage::{self, OwnStage};
use crate::plane::PlaneName;

/// Options of `quadrant circle`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// Planes, separated by commas.
    #[arg(long, value_enum, value_delimiter = ',', default_values = ["xy", "yz", "zx"], value_name = "PLANES")]
    plane: Vec<PlaneName>,
    #[arg(long, value_name = "MM,...", help = radii_help())]
    radius_mm: Vec<Numbers>,
    /// Feeds along the path, mm/min, separated by commas.
    #[arg(long, default_values_t = [Numbers(vec![300.0, 1000.0, 3000.0])], value_name = "MM/MIN,...")]
    feed_mm_min: Vec<Numbers>,
    /// Run the thesis' eight configurations beside the best PID, not only its PID alone and N-PID with static and GMS feedforward; on a
    /// stage that is commissioned for it, the best PID with each feedforward.
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    stage: OwnStage,
    /// Number of noise seeds, from --seed on, 1 to 100; with several, tables give means and spreads over them.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    #[command(flatten)]
    settings: LawSettings,
    #[command(flatten)]
    output: Output,
}

/// Radii where none are given, mm.
const RADII_MM: [f64; 4] = [5.0, 15.0, 30.0, 50.0];

/// Help of the radii, with those that are usual.
fn radii_help() -> String {
    let usual = RADII_MM.map(|radius_mm| radius_mm.to_string()).join(", ");
    format!(
        "Radii, mm, separated by commas; without it {usual}, as far as they fit the travel that --stage says"
    )
}

impl Arguments {
    /// The radii that are asked for, or the usual ones that fit the travel of `axes`.
    fn radii_mm(&self, own: Option<&StageFile>, axes: &[AxisName]) -> anyhow::Result<Vec<f64>> {
        let given = numbers::all(&self.radius_mm);
        let Some(own) = own else {
            return Ok(if given.is_empty() {
                RADII_MM.to_vec()
            } else {
                given
            });
        };
        if given.is_empty() {
            let mut fitting = RADII_MM.to_vec();
            fitting.retain(|radius_mm| own_stage::fits(own, axes, 2.0 * radius_mm));
            ensure!(
                !fitting.is_empty(),
                "no circle of {} mm radius or more fits the travel in {}: give a smaller --radius-mm",
                RADII_MM[0],
                own.path.display()
            );
            return Ok(fitting);
        }
        for radius_mm in &given {
            for &axis in axes {
                let what = format!("--radius-mm {radius_mm}");
                own_stage::refuse_longer(own, axis, 2.0 * radius_mm, &what)?;
            }
        }
        Ok(given)
    }
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    output.ready()?;
    let own = arguments.stage.read()?;
    let planes: Vec<_> = arguments.plane.iter().map(|name| name.plane()).collect();
    let moving = |axis: &AxisName| {
        let moves = |plane: &Plane| <[usize; 2]>::from(plane.axes()).contains(&(*axis as usize));
        planes.iter().any(moves)
    };
    let axes: Vec<AxisName> = AxisName::ALL.into_iter().filter(moving).collect();
    let radii_mm = arguments.radii_mm(own.as_ref(), &axes)?;
    let feeds_mm_min = numbers::all(&arguments.feed_mm_min);
    for (option, values) in [("--radius-mm", &radii_mm), ("--feed-mm-min", &feeds_mm_min)] {
        for value in values {
            ensure!(
                *value > 0.0 && value.is_finite(),
                "{option} {value} must be a number above zero"
            );
        }
    }
    let setup = match &own {
        None => RunConfiguration::identified(arguments.settings.read()?.stage).with_best_pid()?,
        Some(own) => {
            let mut described = own_stage::axes(own);
            described.retain(|axis| axes.contains(axis));
            ensure!(
                !described.is_empty(),
                "{} describes no axis of these planes: add a table, or give another --plane",
                own.path.display()
            );
            own_stage::setup(own, &described, &arguments.settings, output)?
        }
    };
    let last_seed = output.seed.checked_add(arguments.seeds - 1);
    let last_seed =
        last_seed.context("--seed plus --seeds is beyond 2^64; choose a smaller one")?;
    let request = CircleRequest {
        planes,
        radii_mm,
        feeds_mm_min,
        configurations: setup.configurations(arguments.all),
        seeds: (output.seed..=last_seed).collect(),
    };
    let bar = progress(request.cases().len() as u64, "running circles");
    let results = run_circle_tests(&request, &setup, &|| bar.inc(1));
    bar.finish_and_clear();
    say!(
        "Simulated, not measured{}. 10 kHz, f32; seed {}\n",
        own_stage::on(own.as_ref()),
        output.seed
    );
    for table in circle_tables(&results) {
        output.table(&table)?;
    }
    ensure!(
        results.iter().any(|result| result.outcome.is_ok()),
        "no circle was run to its end; the table above says why"
    );
    let page = circle_page(
        &results,
        &own_stage::name(own.as_ref()),
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "circle.html")
}
