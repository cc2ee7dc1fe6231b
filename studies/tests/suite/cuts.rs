//! Learning under random cuts.

use quadrant_studies::cuts::judge;
use quadrant_studies::true_friction::TrueFriction;
use rayon::prelude::*;

#[test]
fn under_random_cuts_learning_is_hardly_ever_worse_than_no_feedforward_and_far_better_on_the_whole()
{
    let lines: Vec<_> = (1..=20)
        .into_par_iter()
        .map(|seed| judge(seed, TrueFriction::Gms, None))
        .collect();
    let mut worse = 0.0;
    let (mut learning_um, mut cancelling_um) = (0.0, 0.0);
    for line in &lines {
        println!("{line:?}");
        assert!(line.learning.worst_ratio.is_finite(), "{line:?}");
        assert!(line.learning.rms_um < line.off_um, "{line:?}");
        assert!(line.cancelling.rms_um < line.off_um, "{line:?}");
        learning_um += line.learning.rms_um;
        cancelling_um += line.cancelling.rms_um;
        worse += line.learning.worse_percent / lines.len() as f64;
    }
    assert!(worse < 5.0, "{worse} % of the windows");
    assert!(cancelling_um < 0.9 * learning_um);
}

#[test]
fn a_voltage_in_quadrature_to_the_model_shakes_the_axis_no_longer_than_the_guard_allows() {
    // Friction's springs and the mass resonate near the teeth's frequency: the worst windows were x 12 and x 17.
    for seed in [886, 1039] {
        let line = judge(seed, TrueFriction::Gms, None);
        println!("{line:?}");
        assert!(line.cancelling.worst_ratio < 1.5, "{line:?}");
    }
}
