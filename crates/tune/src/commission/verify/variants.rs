//! Settings of the laws that are tried: the commissioned ones with another feedforward.

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::stribeck::StribeckCurve;
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

/// The same settings with pre-sliding friction, of whichever model, over `factor` times the displacement.
pub(super) fn over_range(settings: &AxisSettings, factor: f64) -> AxisSettings {
    let mut softer = settings.clone();
    let friction = &mut softer.friction;
    for element in &mut friction.gms.elements {
        element.stiffness_v_per_mm /= factor;
    }
    if let Some(lugre) = &mut friction.lugre {
        lugre.stiffness_v_per_mm /= factor;
    }
    if let Some(dahl) = &mut friction.dahl {
        dahl.stiffness_v_per_mm /= factor;
    }
    softer
}

/// The same settings with a level of friction that no speed changes: `share` of the lower one of the Coulomb and the breakaway level.
pub(super) fn flattened(settings: &AxisSettings, share: f64) -> AxisSettings {
    with_curves(settings, |curve| {
        let level_v = share * curve.coulomb_v.min(curve.breakaway_v);
        StribeckCurve {
            coulomb_v: level_v,
            breakaway_v: level_v,
            ..curve
        }
    })
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

fn with_curves(
    settings: &AxisSettings,
    change: impl Fn(StribeckCurve) -> StribeckCurve,
) -> AxisSettings {
    let mut changed = settings.clone();
    let sliding = &mut changed.friction.sliding;
    for way in [&mut sliding.positive, &mut sliding.negative] {
        way.curve = change(way.curve);
    }
    changed
}
