//! Settings of the laws that are tried: the commissioned ones with another feedforward.

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_settings::AxisSettings;

/// The settings of a feedback, with the feedforward of `full` of a kind.
pub(super) fn with_kind(
    feedback: &AxisSettings,
    full: &AxisSettings,
    kind: FeedforwardKind,
) -> AxisSettings {
    let mut settings = feedback.clone();
    settings.feedforward = full.feedforward;
    settings.feedforward.kind = kind;
    settings
}

/// The same settings with `factor` times the friction fed forward, but for its viscous part.
pub(super) fn with_friction(settings: &AxisSettings, factor: f64) -> AxisSettings {
    let mut scaled = settings.clone();
    let gains = &mut scaled.feedforward.gains;
    gains.level *= factor;
    gains.presliding *= factor;
    scaled
}

/// The same settings with pre-sliding friction, of whichever model, fed forward over `factor` times the displacement.
pub(super) fn over_range(settings: &AxisSettings, factor: f64) -> AxisSettings {
    let mut softer = settings.clone();
    softer.feedforward.range *= factor;
    softer
}

/// The same settings with friction fed forward from a velocity on, mm/s.
pub(super) fn feeding_from(settings: &AxisSettings, from_mm_s: f64) -> AxisSettings {
    let mut changed = settings.clone();
    changed.feedforward.from_mm_s = from_mm_s;
    changed
}

/// The same settings with friction fed forward on strokes beyond a length, mm.
pub(super) fn feeding_beyond(settings: &AxisSettings, from_mm: f64) -> AxisSettings {
    let mut changed = settings.clone();
    changed.feedforward.from_mm = from_mm;
    changed
}
