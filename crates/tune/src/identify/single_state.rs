//! The models with a single state, Dahl and LuGre, fitted to a GMS model that was identified.
//!
//! Both are asked for the GMS's hysteresis in two motions, over the whole pre-sliding range and over a third of it, to
//! and fro, slowly: sigma0 (and Dahl's exponent) are least squares over one branch of each. A single state cannot hold
//! both loops; the fit is the compromise. What a slow motion does not show is chosen: LuGre's sigma1 is the viscous
//! friction, as much damping before sliding as in it.

use quadrant_law::friction::FrictionSettings;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::dahl::DahlParameters;
use quadrant_law::friction::gms::GmsParameters;
use quadrant_law::friction::lugre::LugreParameters;
use quadrant_law::friction::smoothed_gms::SmoothedGmsParameters;
use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_settings::leaves::LEAST_STIFFNESS_V_PER_MM;

use super::fit::{Fit, FitError, Loss, Parameter, fit};

/// Points of a branch.
const POINTS: usize = 200;
/// Amplitudes over the pre-sliding range.
const AMPLITUDES: [f64; 2] = [1.0, 1.0 / 3.0];
/// Cycles before a loop is closed: a slack bristle forgets its start within the first.
const CYCLES: usize = 4;
/// Least stiffness over that of all elements together; the largest is theirs, since no virgin curve starts steeper.
const MIN_STIFFNESS_SHARE: f64 = 1e-3;

/// A single-state model and how well it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingleState<P> {
    pub parameters: P,
    /// RMS of the difference to the GMS's hysteresis over the breakaway level.
    pub relative_error: f64,
}

/// The displacement in mm at which the last element breaks away on a surface of the given level.
pub fn presliding_range_mm(gms: &GmsParameters, level_v: f64) -> f64 {
    gms.elements
        .iter()
        .map(|element| element.weight * level_v / element.stiffness_v_per_mm)
        .fold(0.0, f64::max)
}

/// Dahl's model, which slides at the Coulomb level, for a GMS model on its breakaway level.
///
/// # Errors
/// As [`fit`]: elements without stiffness or weight.
pub fn fit_dahl(
    gms: &GmsParameters,
    breakaway_v: f64,
    coulomb_v: f64,
) -> Result<SingleState<DahlParameters>, FitError> {
    let exponent = Parameter {
        name: "delta",
        start: 1.5,
        bounds: (1.0, 3.0),
    };
    let model = |values: &[f64]| DahlParameters {
        stiffness_v_per_mm: values[0],
        exponent: values[1],
    };
    let parameters = [stiffness(gms), exponent];
    let found = fit(&parameters, Loss::Squares, |values| {
        residuals(gms, breakaway_v, &model(values), coulomb_v)
    })?;
    let mut dahl = model(&found.values);
    if found.at_bound[1] {
        dahl.exponent = dahl.exponent.round();
    }
    Ok(single(dahl, &found, breakaway_v))
}

/// The LuGre model, with damping `damping_v_s_per_mm`, for a GMS model on its breakaway level.
///
/// # Errors
/// As [`fit`]: elements without stiffness or weight.
pub fn fit_lugre(
    gms: &GmsParameters,
    breakaway_v: f64,
    damping_v_s_per_mm: f64,
) -> Result<SingleState<LugreParameters>, FitError> {
    // In slow motion LuGre is Dahl's model with an exponent of one, at the breakaway level.
    let slow = |values: &[f64]| DahlParameters {
        stiffness_v_per_mm: values[0],
        exponent: 1.0,
    };
    let found = fit(&[stiffness(gms)], Loss::Squares, |values| {
        residuals(gms, breakaway_v, &slow(values), breakaway_v)
    })?;
    let parameters = LugreParameters {
        stiffness_v_per_mm: found.values[0],
        damping_v_s_per_mm,
    };
    Ok(single(parameters, &found, breakaway_v))
}

/// Friction settings with every model: Dahl and LuGre fitted to the GMS, or absent if they cannot be, as where the GMS is that of an axis of
/// which nobody has measured any.
pub fn with_all_models(
    sliding: PerDirection<StaticFriction>,
    gms: GmsParameters,
) -> FrictionSettings {
    let PerDirection { positive, negative } = &sliding;
    let mean = |part: fn(&StaticFriction) -> f64| 0.5 * (part(positive) + part(negative));
    let breakaway_v = mean(|model| model.curve.breakaway_v);
    let dahl = fit_dahl(&gms, breakaway_v, mean(|model| model.curve.coulomb_v));
    let lugre = fit_lugre(&gms, breakaway_v, mean(|model| model.viscous_v_s_per_mm));
    FrictionSettings {
        sliding,
        smoothed_gms: SmoothedGmsParameters::default(),
        dahl: dahl
            .ok()
            .map(|found| found.parameters)
            .filter(|model| model.stiffness_v_per_mm >= LEAST_STIFFNESS_V_PER_MM),
        lugre: lugre
            .ok()
            .map(|found| found.parameters)
            .filter(|model| model.stiffness_v_per_mm >= LEAST_STIFFNESS_V_PER_MM),
        gms,
    }
}

fn single<P>(parameters: P, found: &Fit, breakaway_v: f64) -> SingleState<P> {
    SingleState {
        parameters,
        relative_error: found.residual_rms / breakaway_v,
    }
}

fn stiffness(gms: &GmsParameters) -> Parameter {
    let total = gms.stiffness_v_per_mm();
    Parameter {
        name: "sigma0",
        start: 0.5 * total,
        bounds: (MIN_STIFFNESS_SHARE * total, total),
    }
}

/// Differences to the GMS's settled loops, V, along the branches towards smaller positions.
fn residuals(
    gms: &GmsParameters,
    breakaway_v: f64,
    model: &DahlParameters,
    level_v: f64,
) -> Vec<f64> {
    let range_mm = presliding_range_mm(gms, breakaway_v);
    AMPLITUDES
        .iter()
        .flat_map(|share| {
            let amplitude = share * range_mm;
            let mut turn_v = 0.0;
            for _ in 0..CYCLES {
                turn_v = model.force_after_v(turn_v, -2.0 * amplitude, level_v);
                turn_v = model.force_after_v(turn_v, 2.0 * amplitude, level_v);
            }
            // Masing's rule: a branch is the virgin curve, doubled.
            let top_v = gms.virgin_curve_v(amplitude, breakaway_v);
            (1..=POINTS).map(move |point| {
                let back_mm = 2.0 * amplitude * point as f64 / POINTS as f64;
                let expected = top_v - 2.0 * gms.virgin_curve_v(0.5 * back_mm, breakaway_v);
                model.force_after_v(turn_v, -back_mm, level_v) - expected
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use quadrant_law::friction::gms::{GmsElement, GmsParameters};
    use quadrant_settings::StageSettings;

    use super::{fit_dahl, fit_lugre, with_all_models};

    fn rounded(value: f64) -> String {
        format!("{value:.3e}")
    }

    #[test]
    fn the_default_axes_have_what_the_fit_to_their_elements_gives() {
        for axis in StageSettings::simulated().axes {
            let friction = axis.friction;
            let again = with_all_models(friction.sliding, friction.gms.clone());
            let (dahl, fitted) = (friction.dahl.unwrap(), again.dahl.unwrap());
            assert_eq!(
                rounded(dahl.stiffness_v_per_mm),
                rounded(fitted.stiffness_v_per_mm)
            );
            assert_eq!(rounded(dahl.exponent), rounded(fitted.exponent));
            let (lugre, fitted) = (friction.lugre.unwrap(), again.lugre.unwrap());
            assert_eq!(
                rounded(lugre.stiffness_v_per_mm),
                rounded(fitted.stiffness_v_per_mm)
            );
            assert_eq!(lugre.damping_v_s_per_mm, fitted.damping_v_s_per_mm);
        }
    }

    #[test]
    fn the_fits_of_the_default_axes_are_a_tenth_of_breakaway_off() {
        for axis in StageSettings::simulated().axes {
            let (gms, curve) = (axis.friction.gms, axis.friction.sliding.positive.curve);
            let dahl = fit_dahl(&gms, curve.breakaway_v, curve.coulomb_v).unwrap();
            let lugre = fit_lugre(&gms, curve.breakaway_v, 0.0).unwrap();
            println!("{dahl:?} {lugre:?}");
            assert!(dahl.relative_error < 0.12, "{dahl:?}");
            assert!(lugre.relative_error < 0.12, "{lugre:?}");
        }
    }

    #[test]
    fn elements_that_cannot_be_fitted_leave_the_models_out() {
        let sliding = StageSettings::simulated().axes[0].friction.sliding;
        let gms = GmsParameters {
            elements: [GmsElement {
                stiffness_v_per_mm: 0.0,
                weight: 1.0,
            }]
            .into_iter()
            .collect(),
            attraction_v_s: 5.0,
        };
        let settings = with_all_models(sliding, gms);
        assert_eq!((settings.dahl, settings.lugre), (None, None));
        // Nobody has measured any before sliding.
        let unknown = StageSettings::default().axes[0].friction.gms.clone();
        let settings = with_all_models(sliding, unknown);
        assert_eq!((settings.dahl, settings.lugre), (None, None));
    }
}
