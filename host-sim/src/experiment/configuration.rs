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
}

impl Configuration {
    pub const PID: Self = Self {
        controller: LawKind::Pid,
        feedforward: FeedforwardKind::None,
    };
    /// Everything: N-PID with static and GMS feedforward.
    pub const BEST: Self = Self {
        controller: LawKind::NPid,
        feedforward: FeedforwardKind::Combined,
    };
    /// The two configurations that most studies compare.
    pub const EXTREMES: [Self; 2] = [Self::PID, Self::BEST];

    /// All eight, in the order of the thesis' tables.
    pub fn all() -> Vec<Self> {
        [LawKind::Pid, LawKind::NPid]
            .into_iter()
            .flat_map(|controller| {
                FeedforwardKind::THESIS.map(|feedforward| Self {
                    controller,
                    feedforward,
                })
            })
            .collect()
    }

    /// Its name in tables.
    pub fn name(self) -> String {
        let controller = self.controller.name();
        match self.feedforward {
            FeedforwardKind::None => controller.to_owned(),
            FeedforwardKind::Static => format!("{controller} + static"),
            FeedforwardKind::Gms => format!("{controller} + GMS"),
            FeedforwardKind::Combined => format!("{controller} + static + GMS"),
            FeedforwardKind::Dahl => format!("{controller} + Dahl"),
            FeedforwardKind::Lugre => format!("{controller} + LuGre"),
            FeedforwardKind::SmoothedGms => format!("{controller} + S-GMS"),
        }
    }

    /// Sets the stage up for it.
    pub fn apply(self, stage: &mut StageSettings) {
        for axis in &mut stage.axes {
            axis.feedback.law = self.controller;
            axis.feedforward.kind = self.feedforward;
        }
    }
}
