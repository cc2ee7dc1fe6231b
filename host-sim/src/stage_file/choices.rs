//! Choices that a stage file names in words.

use serde::Deserialize;

/// Friction model of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Friction {
    /// One level, at rest as in motion.
    Coulomb,
    /// The Stribeck curve, and a short stiff spring before it slides.
    Static,
    #[default]
    Gms,
    SmoothedGms,
    Lugre,
    Dahl,
}

/// Side of resonance and backlash that the encoder is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum EncoderPlace {
    #[default]
    Table,
    Motor,
}
