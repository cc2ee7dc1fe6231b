//! Feedforward whose model is made wrong on purpose.

use quadrant_sim::identified_stage::identified_settings;
use quadrant_studies::wrong_model::{Wrong, with_wrong_model};

#[test]
fn a_model_that_is_not_wrong_is_the_identified_one() {
    let settings = identified_settings().unwrap().stage.axes[0].clone();
    let off_by = |share, draw| {
        let wrong = Wrong::Everything { share, draw };
        with_wrong_model(&settings, wrong, 1)
    };
    let right = off_by(0.0, 0).friction;
    // Weights are normalised: equal up to rounding.
    let elements = right
        .gms
        .elements
        .iter()
        .zip(&settings.friction.gms.elements);
    for (one, other) in elements {
        assert!((one.weight - other.weight).abs() < 1e-12);
        assert_eq!(one.stiffness_v_per_mm, other.stiffness_v_per_mm);
    }
    assert_eq!(right.sliding, settings.friction.sliding);
    assert_ne!(off_by(0.5, 3).friction, settings.friction);
    assert_eq!(off_by(0.5, 3), off_by(0.5, 3));
    assert_ne!(off_by(0.5, 3), off_by(0.5, 4));
}
