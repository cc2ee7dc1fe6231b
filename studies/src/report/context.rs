//! Inputs that the parts of a report share.

use std::path::PathBuf;
use std::sync::OnceLock;

use quadrant_cli::law_settings::LawSettings;
use quadrant_pages::compare::comparison::{AMPLITUDES_MM, Comparison, Request};
use quadrant_pages::compare::sine::Sines;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_pages::parts::provenance;
use quadrant_report::Provenance;
use quadrant_sim::settings_file::SettingsFile;

/// Inputs that the parts of a report share.
pub struct Context {
    /// Seed of the simulated noise; of repeated runs the first, which the others follow.
    pub seed: u64,
    /// Runs of each configuration with the identified model.
    pub seeds: u64,
    /// The settings.
    pub settings: SettingsFile,
    /// The file they came from; the built-in ones came from none.
    pub settings_path: Option<PathBuf>,
    /// The runs of chapter 5, once a part has needed them.
    comparison: OnceLock<Comparison>,
}

impl Context {
    /// A context with the settings of a file, or with those that commissioning the simulated stage gave.
    ///
    /// # Errors
    /// Settings that cannot be read or that are refused.
    pub fn new(seed: u64, seeds: u64, law_settings: LawSettings) -> anyhow::Result<Self> {
        let settings = law_settings.read()?;
        Ok(Self {
            seed,
            seeds,
            settings,
            settings_path: law_settings.path,
            comparison: OnceLock::new(),
        })
    }

    /// With the exact and with the identified model; both with the controllers of the settings, as the thesis simulated and
    /// measured with the same ones.
    pub fn setups(&self) -> [RunConfiguration; 2] {
        RunConfiguration::both(&self.settings.stage)
    }

    /// Runs the comparison of chapter 5, and the best PID on the same sines of the first amplitude, unless a part before did.
    /// `advance` receives shares of the whole.
    ///
    /// # Errors
    /// A model that no PID keeps the bounds on, a refused setting or a fault.
    pub fn comparison(&self, advance: &(dyn Fn(f64) + Sync)) -> anyhow::Result<&Comparison> {
        if let Some(comparison) = self.comparison.get() {
            advance(1.0);
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

    /// About how long that takes on two cores, s; nothing once it was done.
    pub fn comparison_s(&self) -> f64 {
        if self.comparison.get().is_some() {
            return 0.0;
        }
        let setups = self.setups();
        let configurations = Configuration::all();
        self.request(&setups, &configurations).expected_s()
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

    /// The command that makes these parts again; all parts when none is named.
    pub fn provenance(&self, only: &[&str]) -> Provenance {
        let mut command = "quadrant-studies report".to_owned();
        for id in only {
            command += &format!(" --only {id}");
        }
        if let Some(path) = &self.settings_path {
            command += &format!(" --settings {}", path.display());
        }
        command += &format!(" --seed {} --seeds {}", self.seed, self.seeds);
        provenance(&command, self.seed)
    }
}
