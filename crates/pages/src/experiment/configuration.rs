//! Feedback and feedforward laws in combination: the configurations that experiments compare.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_settings::{AxisSettings, StageSettings};

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
    /// Those of the settings, with the law and the feedforward of each axis as commissioning chose them.
    Commissioned,
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
    /// Each axis as commissioning left it.
    pub const COMMISSIONED: Self = Self {
        gains: Gains::Commissioned,
        ..Self::PID
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

    /// Those that a command compares on a stage that was commissioned for it: the best PID alone, with feedforward, and what
    /// commissioning chose.
    pub const OF_COMMISSIONED: [Self; 3] = [Self::BEST_PID, Self::BEST_PID_FED, Self::COMMISSIONED];

    /// The best PID with each of the thesis' feedforwards, and what commissioning chose.
    pub fn all_of_commissioned() -> Vec<Self> {
        FeedforwardKind::THESIS
            .into_iter()
            .map(|feedforward| Self {
                feedforward,
                ..Self::BEST_PID
            })
            .chain([Self::COMMISSIONED])
            .collect()
    }

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
            Gains::Commissioned => return "as commissioned".to_owned(),
        };
        Self::with_feedforward(controller, self.feedforward)
    }

    /// Name of an axis' law and feedforward as its settings have them.
    pub fn name_of(axis: &AxisSettings) -> String {
        let controller = axis.feedback.law.name().to_owned();
        Self::with_feedforward(controller, axis.feedforward.kind)
    }

    fn with_feedforward(controller: String, feedforward: FeedforwardKind) -> String {
        match feedforward {
            FeedforwardKind::None => controller,
            FeedforwardKind::Static => format!("{controller} + static"),
            FeedforwardKind::Gms => format!("{controller} + GMS"),
            FeedforwardKind::Combined => format!("{controller} + static + GMS"),
            FeedforwardKind::Dahl => format!("{controller} + Dahl"),
            FeedforwardKind::Lugre => format!("{controller} + LuGre"),
            FeedforwardKind::SmoothedGms => format!("{controller} + S-GMS"),
        }
    }

    /// Sets its law and feedforward; gains stay as they are, and everything does that commissioning chose.
    pub fn apply(self, stage: &mut StageSettings) {
        if self.gains == Gains::Commissioned {
            return;
        }
        for axis in &mut stage.axes {
            axis.feedback.law = self.controller;
            axis.feedforward.kind = self.feedforward;
        }
    }
}
