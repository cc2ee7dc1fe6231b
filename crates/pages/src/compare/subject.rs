//! Subject of a comparison: the stage, its sines, and the laws that run on them.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;

use crate::compare::sine::Sines;
use crate::experiment::configuration::{Configuration, Gains};
use crate::experiment::run_configuration::{ModelKnowledge, RunConfiguration};

/// Subject of a comparison, for its tables and its page.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The stage, in words: "the simulated stage".
    pub stage: String,
    /// Whose gains the settings have: "the thesis'".
    pub own: &'static str,
    pub sines: Sines,
    /// Friction as the laws know it.
    pub knowledge: Vec<ModelKnowledge>,
    /// The laws at a glance, the baseline first.
    pub few: Vec<Configuration>,
    /// The laws of every table.
    pub all: Vec<Configuration>,
    /// The baseline, and the law whose effect is the result.
    pub shown: [Configuration; 2],
    /// Law and feedforward that commissioning chose for the axis, where it was commissioned for the comparison.
    pub chosen: Option<String>,
}

impl Subject {
    /// The built-in stage under settings whose gains are `own`.
    pub fn built_in(own: &'static str, sines: Sines) -> Self {
        Self {
            stage: "the simulated stage".to_owned(),
            own,
            sines,
            knowledge: ModelKnowledge::ALL.to_vec(),
            few: Configuration::USUAL.to_vec(),
            all: Configuration::with_best_pid(),
            shown: [Configuration::BEST_PID, Configuration::BEST_PID_FED],
            chosen: None,
        }
    }

    /// Another stage, named `stage`, under settings that were given for it.
    pub fn given(stage: String, own: &'static str, sines: Sines) -> Self {
        Self {
            stage,
            knowledge: vec![ModelKnowledge::Identified],
            ..Self::built_in(own, sines)
        }
    }

    /// Another stage, named `stage`, that was commissioned for the comparison.
    pub fn commissioned(stage: String, setup: &RunConfiguration, sines: Sines) -> Self {
        let axis = &setup.stage.axes[sines.axis as usize];
        let alone =
            axis.feedback.law == LawKind::Pid && axis.feedforward.kind == FeedforwardKind::None;
        let result = if alone {
            Configuration::BEST_PID_FED
        } else {
            Configuration::COMMISSIONED
        };
        Self {
            few: setup.configurations(false),
            all: setup.configurations(true),
            shown: [Configuration::BEST_PID, result],
            chosen: Some(Configuration::name_of(axis)),
            ..Self::given(stage, "its", sines)
        }
    }

    /// True if the sines are those of the thesis on the built-in stage.
    pub fn is_the_thesis(&self) -> bool {
        self.chosen.is_none()
            && self.knowledge == ModelKnowledge::ALL
            && self.sines == Sines::default()
    }

    /// Name of a law in the table at a glance.
    pub fn name(&self, configuration: Configuration) -> String {
        match (configuration.gains, &self.chosen) {
            (Gains::BestPid, _) => configuration.name(),
            (Gains::Commissioned, Some(chosen)) => format!("commissioned: {chosen}"),
            (Gains::Commissioned, None) => configuration.name(),
            (Gains::Settings, _) => format!("{} {}", self.own, configuration.name()),
        }
    }

    /// The axis, in words: "the x axis of the simulated stage".
    pub fn axis(&self) -> String {
        format!("the {} axis of {}", self.sines.axis, self.stage)
    }

    /// The velocities, in words: "5, 10 and 15 mm/s".
    pub fn velocities(&self) -> String {
        let names: Vec<String> = self
            .sines
            .velocities_mm_s
            .iter()
            .map(f64::to_string)
            .collect();
        match names.split_last() {
            Some((last, [])) => format!("{last} mm/s"),
            Some((last, rest)) => format!("{} and {last} mm/s", rest.join(", ")),
            None => String::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use quadrant_law::axes::AxisName;
    use quadrant_sim::identified_stage::identified_settings;
    use quadrant_sim::plant::StageParameters;

    use super::*;
    use crate::compare::sine::VELOCITIES_MM_S;

    fn sines(velocities_mm_s: &[f64]) -> Sines {
        Sines {
            axis: AxisName::Y,
            amplitude_mm: 8.0,
            velocities_mm_s: velocities_mm_s.to_vec(),
        }
    }

    #[test]
    fn axis_and_velocities_are_words() {
        let words =
            |velocities: &[f64]| Subject::built_in("thesis'", sines(velocities)).velocities();
        assert_eq!(words(&[5.0]), "5 mm/s");
        assert_eq!(words(&[5.0, 7.5]), "5 and 7.5 mm/s");
        assert_eq!(words(&VELOCITIES_MM_S), "5, 10 and 15 mm/s");
        let subject = Subject::built_in("thesis'", sines(&[5.0]));
        assert_eq!(subject.axis(), "the y axis of the simulated stage");
        assert!(!subject.is_the_thesis());
        assert!(Subject::built_in("thesis'", Sines::default()).is_the_thesis());
    }

    #[test]
    fn a_commissioned_axis_is_compared_as_commissioning_left_it_or_fed_where_that_kept_the_pid() {
        let mut stage = identified_settings().unwrap().stage;
        let subject = |stage: &quadrant_settings::StageSettings| {
            let setup = RunConfiguration::commissioned(
                stage.clone(),
                StageParameters::real(),
                &[AxisName::Y],
            )
            .unwrap();
            Subject::commissioned("mine.toml".to_owned(), &setup, sines(&[5.0]))
        };
        let chosen = subject(&stage);
        assert_eq!(chosen.shown[1], Configuration::COMMISSIONED);
        let name = Configuration::name_of(&stage.axes[1]);
        assert_eq!(
            chosen.name(Configuration::COMMISSIONED),
            format!("commissioned: {name}")
        );
        stage.axes[1].feedback.law = LawKind::Pid;
        stage.axes[1].feedforward.kind = FeedforwardKind::None;
        let alone = subject(&stage);
        assert_eq!(alone.shown[1], Configuration::BEST_PID_FED);
        assert_eq!(alone.chosen.as_deref(), Some("PID"));
    }
}
