//! Properties of the friction models, by the simulated experiments of `quadrant-studies friction`.

use crate::command::{fail, succeed};
use indicatif::ProgressBar;
use quadrant_law::units::DacCode;
use quadrant_settings::presets::x_axis;
use quadrant_sim::plant::{AxisParameters, FrictionParameters, SimulatedAxis, StageParameters};
use quadrant_studies::friction_models::{Behaviour, Model, Parameters, compare};

fn observed(width: f64) -> Vec<Behaviour> {
    let mut axis = x_axis();
    axis.friction.smoothed_gms.width = width;
    let parameters = Parameters::of(&axis).unwrap();
    compare(&parameters, &ProgressBar::hidden())
}

fn of(behaviours: &[Behaviour], model: Model) -> &Behaviour {
    behaviours.iter().find(|b| b.model == model).unwrap()
}

#[test]
fn only_models_with_elements_remember_where_they_turned() {
    let found = observed(0.25);
    let error = |model| of(&found, model).nested.as_ref().unwrap().closing_error;
    assert!(error(Model::Gms) < 1e-9, "{}", error(Model::Gms));
    // An element that slipped returns short of its share by 1/e of its width at most.
    assert!(error(Model::SmoothedGms) < 0.25 / std::f64::consts::E);
    assert!(error(Model::Dahl) > 0.15 && error(Model::Lugre) > 0.15);
}

#[test]
fn models_with_a_single_state_drift_under_vibration_and_gms_does_not() {
    let drift = |found: &[Behaviour], model| of(found, model).drift.as_ref().unwrap().velocity_um_s;
    let found = observed(0.25);
    assert!(drift(&found, Model::Gms).abs() < 1e-6);
    assert!(drift(&found, Model::Dahl) > 1.0 && drift(&found, Model::Lugre) > 1.0);
    // The smoothed GMS creeps, the less the narrower its transition.
    let narrow = drift(&observed(0.05), Model::SmoothedGms);
    let usual = drift(&found, Model::SmoothedGms);
    let wide = drift(&observed(1.0), Model::SmoothedGms);
    println!("S-GMS drifts by {narrow}, {usual}, {wide} um/s");
    assert!(narrow < usual && usual < wide, "{narrow} {usual} {wide}");
    assert!(usual < 0.01 * drift(&found, Model::Lugre));
}

#[test]
fn friction_lags_behind_the_velocity_where_the_model_has_a_stribeck_effect_and_a_state() {
    let found = observed(0.25);
    for model in Model::ALL {
        let widths: Vec<f64> = of(&found, model)
            .lags
            .iter()
            .map(|lag| lag.width_v)
            .collect();
        match model {
            Model::Static | Model::Dahl => {
                assert!(widths.iter().all(|width| width.abs() < 1e-6), "{widths:?}");
            }
            _ => assert!(
                widths[1] > widths[0] && widths[0] > 1e-4,
                "{model:?} {widths:?}"
            ),
        }
    }
}

#[test]
fn no_virgin_curve_grows_steeper() {
    for behaviour in observed(0.25).iter().filter(|b| b.model != Model::Static) {
        let slopes = &behaviour.slope.1;
        let rises = slopes.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        assert!(rises < 0.01 * slopes[0], "{:?}: {rises}", behaviour.model);
    }
}

#[test]
fn the_force_is_continuous_and_its_slope_but_for_gms_too() {
    let found = observed(0.25);
    // 2 Fs.
    assert!(of(&found, Model::Static).reversal_step_v > 0.29);
    for model in [Model::Dahl, Model::Lugre, Model::Gms, Model::SmoothedGms] {
        let behaviour = of(&found, model);
        assert!(behaviour.reversal_step_v < 1e-4, "{model:?}");
        let step = behaviour.slope_step_v_per_mm;
        if model == Model::Gms {
            assert!(step > 10.0, "{step}");
        } else {
            assert!(step < 0.2, "{model:?}: {step}");
        }
    }
}

/// x of the simulated stage, ideal, with another friction model.
fn axis(model: FrictionParameters) -> AxisParameters {
    AxisParameters {
        model,
        ..StageParameters::ideal().axes[0].clone()
    }
}

#[test]
fn any_model_can_be_the_truth_and_leaves_the_same_velocity_in_the_end() {
    let friction = x_axis().friction;
    let truths = [
        FrictionParameters::Gms,
        FrictionParameters::Smoothed(friction.smoothed_gms),
        FrictionParameters::Lugre(friction.lugre.unwrap()),
        FrictionParameters::Dahl(friction.dahl.unwrap()),
    ];
    let velocities = truths.map(|truth| {
        let mut axis = SimulatedAxis::new(axis(truth), 10e3, 1);
        // Below breakaway each holds the axis.
        for _ in 0..10_000 {
            axis.step(DacCode(200), true);
        }
        assert!(axis.velocity_mm_s().abs() < 1e-3, "{truth:?}");
        assert!((1e-4..0.03).contains(&axis.position_mm()), "{truth:?}");
        for _ in 0..30_000 {
            axis.step(DacCode(1638), true);
        }
        axis.velocity_mm_s()
    });
    let [gms, others @ ..] = velocities;
    for velocity in others {
        assert!((velocity / gms - 1.0).abs() < 1e-3, "{velocities:?}");
    }
}

#[test]
fn the_command_writes_tables_and_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shown = succeed(at, &["friction", "--axis", "z", "--width", "0.1"]);
    assert!(shown.contains("Simulated, not measured"), "{shown}");
    assert!(shown.contains("width 0.100"), "{shown}");
    let mut table =
        csv::Reader::from_path(at.join("quadrant-out/friction-models-tracking.csv")).unwrap();
    let rms: Vec<(String, [f64; 4])> = table
        .records()
        .map(|row| row.unwrap())
        .map(|row| {
            let of = |truth: usize| row[1 + 2 * truth].parse().unwrap();
            (row[0].to_owned(), [of(0), of(1), of(2), of(3)])
        })
        .collect();
    let find = |name: &str| rms.iter().find(|(kind, _)| kind == name).unwrap().1;
    let [none, best] = [find("none"), find("static + GMS")];
    assert!(
        (0..4).all(|truth| best[truth] < 0.3 * none[truth]),
        "{rms:?}"
    );
    // Each model does better than GMS on an axis that follows it.
    assert!(
        find("LuGre")[2] < best[2] && find("Dahl")[3] < best[3],
        "{rms:?}"
    );
    assert!(at.join("quadrant-out/friction-models.html").exists());
    let refused = fail(at, &["friction", "--width", "2"]);
    assert!(refused.contains("2 is outside 0.001 to 1"), "{refused}");
}
