//! The scenarios, with their numbers: all chosen, none measured; `docs/robustness.md` says why.

use std::sync::Arc;

use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::{Force, Load};
use quadrant_sim::plant::{AxisParameters, Imperfections, NEWTONS_PER_VOLT, StageParameters};

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
}

impl Scenario {
    fn new(task: Task, name: &str, what: &str, truth: AxisParameters) -> Self {
        Self {
            name: name.to_owned(),
            what: what.to_owned(),
            truth,
            load: Load::None,
            task,
        }
    }

    fn loaded(mut self, load: Load) -> Self {
        self.load = load;
        self
    }
}

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

/// All scenarios of an axis (0 to 2) of the simulated stage; `recorded` adds those of a recorded
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
        Scenario::new(Task::Hold, "hold", "position held", nominal()),
        Scenario::new(
            Task::Hold,
            "hold, cutting",
            "slot milled for 2 s",
            nominal(),
        )
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
                Task::Hold,
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
    let with = |name: &str, what: &str, change: fn(&mut Imperfections)| {
        sine(name, what, axis().with_imperfection(change))
    };
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
        with(
            "friction along the travel",
            "friction +-20 % over 40 mm",
            |it| {
                (it.friction_variation, it.friction_period_mm) = (0.2, 40.0);
            },
        ),
        with(
            "offset 50 mV",
            "amplifier offset 50 mV in place of a few",
            |it| it.offset_v = 0.050,
        ),
        with("amplifier +10 %", "amplifier gain x 1.1", |it| {
            it.amplifier_gain_error = 0.1
        }),
        with("amplifier -10 %", "amplifier gain x 0.9", |it| {
            it.amplifier_gain_error = -0.1
        }),
        sine(
            "delay +1 sample",
            "dead time + 0.1 ms",
            axis().with_more_delay(1e-4),
        ),
        with("encoder noise 0.5 um", "RMS, in place of 0.15 um", |it| {
            it.encoder_noise_mm = 5e-4
        }),
        with("encoder noise 1 um", "RMS, in place of 0.15 um", |it| {
            it.encoder_noise_mm = 1e-3
        }),
        with(
            "encoder interpolation",
            "0.3 um in every 20 um of the grating",
            |it| {
                (it.interpolation_mm, it.grating_mm) = (3e-4, 0.020);
            },
        ),
    ]
}
