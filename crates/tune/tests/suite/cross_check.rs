//! The cross-checks of a commissioning, on axes that may not go fast.

use quadrant_settings::StageSettings;
use quadrant_sim::plant::StageParameters;
use quadrant_tune::commission::CrossCheck;
use quadrant_tune::identify::revise::ExplicitFriction;
use quadrant_tune::test_axis::SimulatedTestAxis;

#[test]
fn an_axis_of_50_mm_s_is_excited_at_rest_within_its_limits() {
    let [truth, ..] = StageParameters::real().axes;
    let mut stage = StageSettings::simulated();
    stage.axes[0].limits.max_velocity_mm_s = 50.0;
    let settings = stage.axes[0].clone();
    let mut axis = SimulatedTestAxis::under(&stage, 0, truth, 7);
    let checked =
        CrossCheck::run(&mut axis, &settings, 7, &mut |_, _| {}).expect("within its limits");
    let original = settings.plant.expect("a plant");
    let revised = checked
        .revisions
        .iter()
        .find(|revision| revision.friction == ExplicitFriction::Both)
        .expect("with both");
    let ratio = revised.plant.gain_mm_per_v_s2 / original.gain_mm_per_v_s2;
    assert!((0.9..1.1).contains(&ratio), "A {ratio} times the settings'");
}
