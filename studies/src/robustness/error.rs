//! The errors of the study.

use quadrant_settings::SettingsError;

/// Reasons for which a competitor cannot run.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RobustnessError {
    /// Its settings are refused.
    #[error("{competitor} in the scenario {scenario}: settings refused: {source}")]
    Settings {
        competitor: String,
        scenario: String,
        source: SettingsError,
    },
    /// A motion did not end.
    #[error(
        "{competitor} in the scenario {scenario}: the motion has not ended after {ticks} ticks"
    )]
    Endless {
        competitor: String,
        scenario: String,
        /// Ticks waited.
        ticks: usize,
    },
}
