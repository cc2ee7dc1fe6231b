//! The scenarios, with their numbers: all chosen, none measured; `docs/robustness.md` says why.

use std::sync::Arc;

use quadrant_settings::AxisSettings;
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::{Force, Load};
use quadrant_sim::plant::{AxisParameters, NEWTONS_PER_VOLT, StageParameters};

use crate::robustness::Task;

/// A change of the axis, or a load on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Its name in tables.
    pub name: String,
    /// Difference from the nominal axis, with its numbers.
    pub what: String,
    /// The axis as it then is.
    pub truth: AxisParameters,
    /// Load on the axis.
    pub load: Load,
    /// Task of the axis.
    pub task: Task,
    /// Settings from a commissioning of this axis, where it is another machine; otherwise the settings stay as they
    /// were.
    pub commissioned: Option<AxisSettings>,
    /// True if the error over time is kept.
    pub keeps_trace: bool,
}

impl Scenario {
    fn new(task: Task, name: &str, what: &str, truth: AxisParameters) -> Self {
        Self {
            name: name.to_owned(),
            what: what.to_owned(),
            truth,
            load: Load::None,
            task,
            commissioned: None,
            keeps_trace: false,
        }
    }

    fn loaded(mut self, load: Load) -> Self {
        self.load = load;
        self.keeps_trace = true;
        self
    }

    /// The sine on another machine, under the settings that were found on it.
    pub fn on_drive(name: &str, what: &str, truth: AxisParameters, found: AxisSettings) -> Self {
        Self {
            commissioned: Some(found),
            ..Self::new(Task::Sine, name, what, truth)
        }
    }
}

/// A hold, s, all of it scored.
const HOLD: Task = Task::Hold {
    seconds: 4.0,
    scored_from: 0.0,
};
/// Start and end of the cut in a hold and in a slow move, s.
const ENGAGED_S: (f64, f64) = (1.0, 3.0);
/// The same in a sine, s: all of it.
const ALWAYS_S: (f64, f64) = (0.0, 1e3);

/// A cut whose force across the feed acts along the axis.
fn milling(cut: Milling, engaged_s: (f64, f64)) -> Load {
    Load::Milling {
        cut,
        component: Component::Normal,
        engaged_s,
        newtons_per_volt: NEWTONS_PER_VOLT,
    }
}

/// All scenarios of an axis (0 to 2) of the simulated stage but those of other drives; `recorded` adds those of a recorded
/// force.
pub fn scenarios(axis: usize, recorded: Option<Force>) -> Vec<Scenario> {
    let nominal = || StageParameters::real().axes[axis].clone();
    let sine = |name: &str, what: &str, truth| Scenario::new(Task::Sine, name, what, truth);
    let mut all = vec![sine("nominal", "as commissioned", nominal())];
    all.extend(changed_axes(&nominal(), sine));
    all.extend([
        sine("cutting", "slot milled all along", nominal())
            .loaded(milling(Milling::slot(), ALWAYS_S)),
        sine("light cutting", "finishing cut all along", nominal())
            .loaded(milling(Milling::finishing(), ALWAYS_S)),
        Scenario::new(HOLD, "hold", "position held", nominal()),
        Scenario::new(HOLD, "hold, cutting", "slot milled for 2 s", nominal())
            .loaded(milling(Milling::slot(), ENGAGED_S)),
        Scenario::new(Task::SlowFeed, "slow feed", "10 mm at 2 mm/s", nominal()),
        Scenario::new(
            Task::SlowFeed,
            "slow feed, cutting",
            "slot milled for 2 s",
            nominal(),
        )
        .loaded(milling(Milling::slot(), ENGAGED_S)),
    ]);
    if let Some(force) = recorded {
        let load = Load::Recorded {
            force: Arc::new(force),
            newtons_per_volt: NEWTONS_PER_VOLT,
        };
        all.extend([
            sine("recorded force", "the file's force all along", nominal()).loaded(load.clone()),
            Scenario::new(
                HOLD,
                "hold, recorded force",
                "the file's force all along",
                nominal(),
            )
            .loaded(load),
        ]);
    }
    all
}

fn changed_axes(
    nominal: &AxisParameters,
    sine: impl Fn(&str, &str, AxisParameters) -> Scenario,
) -> Vec<Scenario> {
    let axis = || nominal.clone();
    vec![
        sine("mass +30 %", "moving mass x 1.3", axis().with_mass(1.3)),
        sine("mass -30 %", "moving mass x 0.7", axis().with_mass(0.7)),
        sine(
            "friction +50 %",
            "cold: all friction x 1.5",
            axis().with_friction(1.5),
        ),
        sine(
            "friction -30 %",
            "freshly lubricated: all friction x 0.7",
            axis().with_friction(0.7),
        ),
        sine(
            "friction x 2",
            "all friction x 2",
            axis().with_friction(2.0),
        ),
        sine(
            "friction x 0.5",
            "all friction x 0.5",
            axis().with_friction(0.5),
        ),
        sine(
            "friction along the travel",
            "friction +-20 % over 40 mm",
            axis().with_imperfection(|it| {
                it.friction_variation = 0.2;
                it.friction_period_mm = 40.0;
            }),
        ),
        sine(
            "offset 50 mV",
            "amplifier offset 50 mV in place of a few",
            axis().with_imperfection(|it| it.offset_v = 0.050),
        ),
        sine(
            "amplifier +10 %",
            "amplifier gain x 1.1",
            axis().with_imperfection(|it| it.amplifier_gain_error = 0.1),
        ),
        sine(
            "amplifier -10 %",
            "amplifier gain x 0.9",
            axis().with_imperfection(|it| it.amplifier_gain_error = -0.1),
        ),
        sine(
            "delay +1 sample",
            "dead time + 0.1 ms",
            axis().with_more_delay(1e-4),
        ),
        sine(
            "encoder noise 0.5 um",
            "RMS, in place of 0.15 um",
            axis().with_imperfection(|it| it.encoder_noise_mm = 5e-4),
        ),
        sine(
            "encoder noise 1 um",
            "RMS, in place of 0.15 um",
            axis().with_imperfection(|it| it.encoder_noise_mm = 1e-3),
        ),
        sine(
            "encoder interpolation",
            "0.3 um in every 20 um of the grating",
            axis().with_imperfection(|it| {
                it.interpolation_mm = 3e-4;
                it.grating_mm = 0.020;
            }),
        ),
    ]
}
