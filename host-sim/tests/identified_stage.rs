//! The settings of the virtual machine are what commissioning its axes gives, and as good as the truth.

use quadrant::control::feedback::LawKind;
use quadrant::feedforward::FeedforwardKind;
use quadrant::friction::gms::GmsParameters;
use quadrant::friction::stribeck::StaticFriction;
use quadrant::settings::StageSettings;
use quadrant_sim::commission::{CommissionSettings, commission};
use quadrant_sim::experiment::comparison::{Configuration, run_configuration};
use quadrant_sim::experiment::compensator::{Setup, identified};
use quadrant_sim::experiment::metrics::Score;
use quadrant_sim::plant::StageTruth;
use quadrant_sim::rig::SimulatedRig;
use quadrant_sim::settings_file::SettingsFile;
use rayon::prelude::*;

#[test]
fn commissioning_the_axes_again_gives_the_committed_settings() {
    let committed = identified().unwrap();
    let mut again = SettingsFile::new(StageSettings::default());
    again
        .stage
        .axes
        .par_iter_mut()
        .zip(StageTruth::real().axes)
        .enumerate()
        .for_each(|(index, (axis, truth))| {
            let mut rig = SimulatedRig::new(index, truth, 1);
            let request = CommissionSettings::default();
            *axis = commission(&mut rig, axis, &request, &mut |_, _| {})
                .unwrap()
                .settings;
        });
    assert_eq!(again.stage, committed.stage);
}

/// N-PID with the combined feedforward on the x axis of the virtual machine: largest and RMS tracking error, and glitch, mean over
/// three velocities and three seeds, mm.
fn performance(stage: &StageSettings) -> [f64; 3] {
    let best = Configuration {
        controller: LawKind::NPid,
        feedforward: FeedforwardKind::Combined,
    };
    let setup = Setup::virtual_machine(stage.clone());
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

/// The committed settings, but the feedforward of x told the truth, on the given elements.
fn truth_told(elements: &GmsParameters) -> StageSettings {
    let mut stage = identified().unwrap().stage;
    let [truth, _, _] = StageTruth::real().axes;
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

#[test]
fn identified_settings_do_as_well_as_the_truth() {
    let identified = performance(&identified().unwrap().stage);
    let [truth, _, _] = StageTruth::real().axes;
    let told = performance(&truth_told(&truth.gms));
    for (found, exact) in identified.iter().zip(&told) {
        assert!(*found < 1.1 * exact, "{identified:?} against {told:?}");
    }
}
