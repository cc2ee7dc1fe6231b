//! Feedback and feedforward laws in combination: the configurations that experiments compare.

use quadrant::control::feedback::LawKind;
use quadrant::feedforward::FeedforwardKind;
use quadrant::settings::StageSettings;

/// Room for GMS elements: the exact model has the plant's ten.
pub const ELEMENTS: usize = 10;

/// Feedback and feedforward together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Configuration {
    pub controller: LawKind,
    pub feedforward: FeedforwardKind,
    pub gains: Gains,
}

/// The feedback's gains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gains {
    /// Those of the settings: of the built-in ones, the thesis'.
    Settings,
    /// Those of the best PID that commissioning designs on the axis' model.
    BestPid,
}

impl Configuration {
    pub const PID: Self = Self {
        controller: LawKind::Pid,
        feedforward: FeedforwardKind::None,
        gains: Gains::Settings,
    };
    /// The best PID alone: the baseline.
    pub const BEST_PID: Self = Self {
        gains: Gains::BestPid,
        ..Self::PID
    };
    /// The best PID with static and GMS feedforward.
    pub const BEST_PID_FED: Self = Self {
        feedforward: FeedforwardKind::Combined,
        ..Self::BEST_PID
    };
    /// Everything: N-PID with static and GMS feedforward.
    pub const BEST: Self = Self {
        controller: LawKind::NPid,
        feedforward: FeedforwardKind::Combined,
        gains: Gains::Settings,
    };
    /// Those that a command compares unless it is asked for more, the baseline first.
    pub const USUAL: [Self; 4] = [Self::BEST_PID, Self::BEST_PID_FED, Self::PID, Self::BEST];
    /// The two configurations that most studies compare.
    pub const EXTREMES: [Self; 2] = [Self::PID, Self::BEST];

    /// The best PID alone and with feedforward, and all eight.
    pub fn with_best_pid() -> Vec<Self> {
        [Self::BEST_PID, Self::BEST_PID_FED]
            .into_iter()
            .chain(Self::all())
            .collect()
    }

    /// All eight of the thesis, in the order of its tables.
    pub fn all() -> Vec<Self> {
        [LawKind::Pid, LawKind::NPid]
            .into_iter()
            .flat_map(|controller| {
                FeedforwardKind::THESIS.map(|feedforward| Self {
                    controller,
                    feedforward,
                    gains: Gains::Settings,
                })
            })
            .collect()
    }

    /// Its name in tables.
    pub fn name(self) -> String {
        let controller = match self.gains {
            Gains::Settings => self.controller.name().to_owned(),
            Gains::BestPid => format!("best {}", self.controller.name()),
        };
        match self.feedforward {
            FeedforwardKind::None => controller,
            FeedforwardKind::Static => format!("{controller} + static"),
            FeedforwardKind::Gms => format!("{controller} + GMS"),
            FeedforwardKind::Combined => format!("{controller} + static + GMS"),
            FeedforwardKind::Dahl => format!("{controller} + Dahl"),
            FeedforwardKind::Lugre => format!("{controller} + LuGre"),
            FeedforwardKind::SmoothedGms => format!("{controller} + S-GMS"),
        }
    }

    /// Sets its law and feedforward; gains stay as they are.
    pub fn apply(self, stage: &mut StageSettings) {
        for axis in &mut stage.axes {
            axis.feedback.law = self.controller;
            axis.feedforward.kind = self.feedforward;
        }
    }
}
