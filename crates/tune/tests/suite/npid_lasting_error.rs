//! N-PID under a load that leaves a lasting error: Popov's criterion speaks of the origin, and about another point the loop
//! has the slope of k(e) e for a gain.

use quadrant_law::control::npid::{NonlinearGain, NonlinearGainTable};
use quadrant_law::control::pid::Pid;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::control::terms::FeedbackState;
use quadrant_settings::popov::sector_bound;
use quadrant_settings::presets::{X_GAINS, X_PLANT};
use quadrant_sim::held_plant::{HeldPlant, HeldPlantRun};
use quadrant_tune::design::{Form, Process};

/// The x axis, without the spring and the integral action that would end a lasting error.
const PLANT: PlantModel = PlantModel {
    stiffness_per_s2: 0.0,
    ..X_PLANT
};
const GAINS: PidGains = PidGains {
    ki_v_per_mm_s: 0.0,
    ..X_GAINS
};
const GAIN: NonlinearGain = NonlinearGain {
    rate_per_mm: 15.0,
    range_mm: 0.1,
};
const PERIOD_S: f64 = 1e-4;
const LIMIT_V: f64 = 10.0;

/// The slope of k(e) e within emax.
fn slope(error_mm: f64) -> f64 {
    let x = GAIN.rate_per_mm * error_mm;
    x.cosh() + x * x.sinh()
}

/// Returns the swing that is left of the axis, mm, 1.3 s after a load that the law holds at `error_mm` was put on
/// slowly.
fn unrest_mm(error_mm: f64) -> f64 {
    let load_v = GAINS.kp_v_per_mm * GAIN.at(error_mm) * error_mm;
    let pid = Pid::<f64>::build(&GAINS, LIMIT_V, PERIOD_S);
    let table = NonlinearGainTable::<f64>::build(&GAIN);
    let mut axis = HeldPlantRun::at_rest(HeldPlant::new(&PLANT, PERIOD_S, 0.0), 0.0);
    let mut state = FeedbackState::default();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for tick in 0..20_000 {
        let share = (f64::from(tick) / 5_000.0).min(1.0);
        let scaled = table.scaled_error(-axis.position_mm());
        let terms = pid.step(&mut state, scaled, 0.0, LIMIT_V);
        axis.step(terms.output - share * load_v);
        if tick >= 18_000 {
            low = low.min(axis.position_mm());
            high = high.max(axis.position_mm());
        }
    }
    high - low
}

#[test]
fn the_loop_hunts_about_a_lasting_error_where_the_slope_exceeds_the_gain_margin() {
    let sampled = Form::Sampled {
        sample_time_s: PERIOD_S,
        computation_delay_s: 0.0,
    };
    let margins = Process::Model(PLANT).margins(&GAINS, sampled).unwrap();
    let bearable = 10.0_f64.powf(margins.gain_margin_db / 20.0);
    // Absolutely stable all the same.
    assert!(GAIN.largest() < sector_bound(&PLANT, &GAINS, PERIOD_S));
    for (error_mm, hunts) in [
        (0.03, false),
        (0.05, false),
        (0.065, false),
        (0.08, true),
        (0.09, true),
    ] {
        assert_eq!(slope(error_mm) > bearable, hunts, "{error_mm}");
        let unrest_um = 1e3 * unrest_mm(error_mm);
        assert!(
            if hunts {
                unrest_um > 5.0
            } else {
                unrest_um < 0.01
            },
            "{error_mm} mm: slope {:.2}, gain margin {bearable:.2}, unrest {unrest_um} um",
            slope(error_mm)
        );
    }
}
