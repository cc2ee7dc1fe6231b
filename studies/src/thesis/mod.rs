//! The thesis' chapters 3 to 5 and its headline figures on the simulated stage.
//!
//! A part of the report is a function from [`Context`] to sections, and an entry in `PARTS`.

pub mod chapter3;
pub mod chapter4;
pub mod chapter5;
pub mod headline;
pub mod imperfections;
mod numbers;

use std::sync::OnceLock;

use clap::Args;
use clap::builder::PossibleValuesParser;
use quadrant_cli::law_settings::LawSettings;
use quadrant_pages::compare::comparison::{AMPLITUDES_MM, Comparison, Request};
use quadrant_pages::compare::sine::Sines;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_pages::parts::provenance;
use quadrant_report::Section;
use quadrant_sim::settings_file::SettingsFile;

use crate::study::{Advance, Study};

/// `quadrant-studies report`.
#[derive(Clone, Debug, Args)]
pub struct Report {
    /// Only this part, and its tables in the terminal; may be given several times.
    #[arg(long, value_name = "PART", value_parser = PossibleValuesParser::new(PARTS.iter().map(|part| part.id)))]
    only: Vec<String>,
    /// Runs of each configuration with the identified model, with consecutive seeds: means are shown with one standard deviation.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    #[command(flatten)]
    settings: LawSettings,
}

/// A part of the report.
struct Part {
    /// Its name on the command line.
    id: &'static str,
    /// About how long it takes on two cores, s: its share of the progress bar.
    expected_s: f64,
    run: fn(&Context, Advance<'_>) -> anyhow::Result<Vec<Section>>,
}

/// All parts, in the order of the page.
const PARTS: [Part; 4] = [
    Part {
        id: "headline",
        expected_s: 60.0,
        run: headline::sections,
    },
    Part {
        id: "chapter-3",
        expected_s: 25.0,
        run: chapter3::sections,
    },
    Part {
        id: "chapter-4",
        expected_s: 1.0,
        run: chapter4::sections,
    },
    Part {
        id: "chapter-5",
        expected_s: 2.0,
        run: chapter5::sections,
    },
];

impl Study for Report {
    const NAME: &'static str = "report";
    const TITLE: &'static str = "The thesis' tables and figures on the simulated stage";
    const SUBTITLE: &'static str = "Under the thesis' numbers, beside its headline figures";

    fn run(&self, seed: u64, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
        let context = Context {
            seed,
            seeds: self.seeds,
            settings: self.settings.read()?,
            comparison: OnceLock::new(),
        };
        let is_requested =
            |part: &&Part| self.only.is_empty() || self.only.iter().any(|id| id == part.id);
        let parts: Vec<&Part> = PARTS.iter().filter(is_requested).collect();
        let whole_s: f64 = parts.iter().map(|part| part.expected_s).sum();
        let mut all = Vec::new();
        for part in parts {
            let share = part.expected_s / whole_s;
            let mut sections = (part.run)(&context, &|done| advance(share * done))
                .map_err(|error| error.context(format!("part {}", part.id)))?;
            let command = format!(
                "quadrant-studies report --only {}{} --seed {seed} --seeds {}",
                part.id,
                self.settings.option(),
                self.seeds
            );
            for section in &mut sections {
                section.provenance = Some(provenance(&command, seed));
            }
            all.extend(sections);
        }
        Ok(all)
    }

    /// The headlines, unless parts were asked for.
    fn shows(&self, section: &Section) -> bool {
        !self.only.is_empty() || section.id.starts_with("headline")
    }
}

/// Inputs that the parts of a report share.
pub struct Context {
    /// Seed of the simulated noise; of repeated runs the first, which the others follow.
    seed: u64,
    /// Runs of each configuration with the identified model.
    seeds: u64,
    settings: SettingsFile,
    /// The runs of chapter 5, once a part has needed them.
    comparison: OnceLock<Comparison>,
}

impl Context {
    /// With the exact and with the identified model; both with the controllers of the settings, as the thesis simulated and
    /// measured with the same ones.
    fn setups(&self) -> [RunConfiguration; 2] {
        RunConfiguration::both(&self.settings.stage)
    }

    /// Runs the comparison of chapter 5, and the best PID on the same sines of the first amplitude, unless a part before did.
    fn comparison(&self, advance: Advance<'_>) -> anyhow::Result<&Comparison> {
        if let Some(comparison) = self.comparison.get() {
            return Ok(comparison);
        }
        let setups = self.setups();
        let configurations = Configuration::all();
        let mut comparison = self.request(&setups, &configurations).run(advance)?;
        let [exact, identified] = setups.map(RunConfiguration::with_best_pid);
        let setups = [exact?, identified?];
        let best = Request {
            sines: vec![Sines::default()],
            ..self.request(&setups, &[Configuration::BEST_PID])
        };
        comparison.join(best.run(&|_| {})?);
        Ok(self.comparison.get_or_init(|| comparison))
    }

    fn request<'a>(
        &self,
        setups: &'a [RunConfiguration],
        configurations: &'a [Configuration],
    ) -> Request<'a> {
        Request {
            setups,
            configurations,
            sines: AMPLITUDES_MM.map(Sines::of_amplitude).to_vec(),
            seed: self.seed,
            seeds: self.seeds,
        }
    }
}
