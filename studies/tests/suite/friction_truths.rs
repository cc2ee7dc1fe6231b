//! Every friction model as the truth of a simulated axis.

use quadrant_law::units::DacCode;
use quadrant_settings::presets::x_axis;
use quadrant_sim::plant::{AxisParameters, FrictionParameters, SimulatedAxis, StageParameters};

#[test]
fn any_model_can_be_the_truth_and_leaves_the_same_velocity_in_the_end() {
    let friction = x_axis().friction;
    let truths = [
        FrictionParameters::Gms,
        FrictionParameters::Smoothed(friction.smoothed_gms),
        FrictionParameters::Lugre(friction.lugre.unwrap()),
        FrictionParameters::Dahl(friction.dahl.unwrap()),
    ];
    let velocities = truths.map(|model| {
        let truth = AxisParameters {
            model,
            ..StageParameters::ideal().axes[0].clone()
        };
        let mut axis = SimulatedAxis::new(truth, 10e3, 1);
        // Below breakaway each holds the axis.
        for _ in 0..10_000 {
            axis.step(DacCode(200), true);
        }
        assert!(axis.velocity_mm_s().abs() < 1e-3, "{model:?}");
        assert!((1e-4..0.03).contains(&axis.position_mm()), "{model:?}");
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
