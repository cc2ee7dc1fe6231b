//! The committed settings are what commissioning its axes gives, within what its measurements differ by, and as good as the truth.

use quadrant_law::friction::gms::{GmsElement, GmsParameters};
use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_pages::compare::sine::run_configuration;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::metrics::Score;
use quadrant_sim::plant::StageParameters;
use quadrant_sim::settings_file::SettingsFile;
use quadrant_tune::commission::{CommissionSettings, commission};
use quadrant_tune::test_axis::SimulatedTestAxis;
use rayon::prelude::*;

/// Largest difference of a value, and of the stiffness before sliding, between the committed settings and another measurement, over it.
const FINE: f64 = 1e-3;
const COARSE: f64 = 0.02;

#[test]
fn commissioning_the_axes_again_gives_the_committed_settings() {
    let committed = identified_settings().unwrap();
    let mut again = SettingsFile::new(StageSettings::simulated());
    again
        .stage
        .axes
        .par_iter_mut()
        .zip(StageParameters::real().axes)
        .enumerate()
        .for_each(|(index, (axis, truth))| {
            let mut rig = SimulatedTestAxis::new(index, truth, 1);
            let request = CommissionSettings::thesis();
            *axis = commission(&mut rig, axis, &request, &mut |_, _| {})
                .unwrap()
                .settings;
        });
    for (again, committed) in again.stage.axes.iter_mut().zip(&committed.stage.axes) {
        for ((again, most), (committed, _)) in measured(again).iter().zip(&measured(committed)) {
            assert!(
                (again / committed - 1.0).abs() < *most,
                "{again} for {committed}"
            );
        }
        (again.feedback, again.friction) = (committed.feedback.clone(), committed.friction.clone());
        (again.feedforward, again.plant) = (committed.feedforward, committed.plant);
    }
    assert_eq!(again.stage, committed.stage);
}

/// Values that a commissioning measures of an axis or makes of them, each with its largest difference from another, over it.
fn measured(axis: &AxisSettings) -> Vec<(f64, f64)> {
    let (pid, nonlinear) = (axis.feedback.pid, axis.feedback.nonlinear.unwrap());
    let sliding = &axis.friction.sliding;
    let ways = [sliding.positive, sliding.negative].into_iter();
    let friction = ways.flat_map(|way| {
        let curve = way.curve;
        [curve.coulomb_v, curve.breakaway_v, way.viscous_v_s_per_mm]
    });
    let others = [
        pid.kp_v_per_mm,
        pid.ki_v_per_mm_s,
        pid.kd_v_s_per_mm,
        nonlinear.rate_per_mm,
        axis.feedforward.gains.inertia_v_s2_per_mm,
        axis.feedforward.preview_s,
    ];
    let stiffness_v_per_mm = axis.friction.gms.stiffness_v_per_mm();
    let fine = others
        .into_iter()
        .chain(friction)
        .map(|value| (value, FINE));
    fine.chain([(stiffness_v_per_mm, COARSE)]).collect()
}

/// N-PID with the combined feedforward on the x axis with the identified model: largest and RMS tracking error, and glitch, mean over
/// three velocities and three seeds, mm.
fn performance(stage: &StageSettings) -> [f64; 3] {
    let best = Configuration::BEST;
    let setup = RunConfiguration::identified(stage.clone());
    let outcomes: Vec<_> = [1, 2, 3]
        .into_par_iter()
        .flat_map(|seed| run_configuration::<f32>(best, &setup, seed).unwrap())
        .collect();
    let mean = |score: fn(&Score) -> f64| {
        let sum: f64 = outcomes.iter().map(|outcome| score(&outcome.score)).sum();
        sum / outcomes.len() as f64
    };
    [
        mean(|score| score.largest_mm),
        mean(|score| score.rms_mm),
        mean(|score| score.glitch_mm),
    ]
}

/// The committed settings, but with the stage's true friction in the feedforward of x, on the given elements.
fn with_true_friction(elements: &GmsParameters) -> StageSettings {
    let mut stage = identified_settings().unwrap().stage;
    let [truth, _, _] = StageParameters::real().axes;
    let axis = &mut stage.axes[0];
    let damping_v = truth.damping_per_s / truth.gain_mm_per_v_s2;
    axis.friction.sliding = truth.friction.map(|model| StaticFriction {
        viscous_v_s_per_mm: model.viscous_v_s_per_mm + damping_v,
        ..*model
    });
    axis.friction.gms = GmsParameters {
        elements: elements.elements.clone(),
        attraction_v_s: truth.gms.attraction_v_s,
    };
    axis.feedforward.gains.inertia_v_s2_per_mm = 1.0 / truth.gain_mm_per_v_s2;
    axis.feedforward.preview_s = truth.delay_s;
    axis.amplifier.offset_v = -truth.imperfections.offset_v;
    stage
}

/// The true virgin curve, cut at the knots of the committed elements.
fn truth_on_the_same_knots() -> GmsParameters {
    let [truth, _, _] = StageParameters::real().axes;
    let axis = &identified_settings().unwrap().stage.axes[0];
    let level_v = 0.15;
    let knots: Vec<f64> = axis
        .friction
        .gms
        .elements
        .iter()
        .map(|element| {
            element.weight * axis.friction.mean_breakaway_v() / element.stiffness_v_per_mm
        })
        .collect();
    let force = |x: f64| truth.gms.virgin_curve_v(x, level_v);
    let mut slopes = Vec::new();
    let mut before = 0.0;
    for &knot in &knots {
        slopes.push((force(knot) - force(before)) / (knot - before));
        before = knot;
    }
    slopes.push(0.0);
    let stiffnesses: Vec<f64> = slopes.windows(2).map(|pair| pair[0] - pair[1]).collect();
    let shares: Vec<f64> = stiffnesses.iter().zip(&knots).map(|(k, x)| k * x).collect();
    let sum: f64 = shares.iter().sum();
    GmsParameters {
        elements: stiffnesses
            .iter()
            .zip(&shares)
            // Beyond its last spring the true curve is flat.
            .filter(|(stiffness_v_per_mm, _)| **stiffness_v_per_mm > 0.0)
            .map(|(&stiffness_v_per_mm, share)| GmsElement {
                stiffness_v_per_mm,
                weight: share / sum,
            })
            .collect(),
        attraction_v_s: truth.gms.attraction_v_s,
    }
}

#[test]
fn identified_settings_do_as_well_as_the_truth_on_as_many_elements() {
    let identified = performance(&identified_settings().unwrap().stage);
    let exact = performance(&with_true_friction(&truth_on_the_same_knots()));
    println!("identified {identified:?}, true friction {exact:?}");
    // With its true friction on its own ten elements, the axis does better where a single instant counts.
    let [truth, _, _] = StageParameters::real().axes;
    let ten = performance(&with_true_friction(&truth.gms));
    for exact in [exact, ten] {
        let [largest, rms, glitch] = [0, 1, 2].map(|score| identified[score] / exact[score]);
        assert!(
            largest < 1.4 && rms < 1.1 && glitch < 1.6,
            "{identified:?} against {exact:?}"
        );
    }
}
