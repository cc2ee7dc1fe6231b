//! The feedforwards that the studies compare.

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_settings::AxisSettings;

/// The friction feedforward of a competitor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedforward {
    /// None: the feedback alone.
    Without,
    /// Static and GMS, as the settings have it.
    Fixed,
    /// The same, learning.
    Learning,
}

impl Feedforward {
    pub const ALL: [Self; 3] = [Self::Without, Self::Fixed, Self::Learning];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Without => "without",
            Self::Fixed => "fixed",
            Self::Learning => "learning",
        }
    }

    pub const fn kind(self) -> FeedforwardKind {
        match self {
            Self::Without => FeedforwardKind::None,
            Self::Fixed | Self::Learning => FeedforwardKind::Combined,
        }
    }

    /// Gives it to an axis.
    pub fn apply(self, axis: &mut AxisSettings) {
        axis.feedforward.kind = self.kind();
        axis.feedforward.learning = (self == Self::Learning).then(LearningSettings::default);
    }
}
