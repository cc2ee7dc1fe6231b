//! Margins and the Popov bound, confirmed by running the loop: tests by a method that knows no frequency response.

use proptest::prelude::*;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::popov::sector_bound;
use quadrant_settings::presets::{X_PLANT, Y_PLANT, Z_PLANT};
use quadrant_sim::loop_shape::{ContinuousLoop, SampledLoop};
use quadrant_sim::margins::margins;
use quadrant_tune::design::{Form, Process, ShapingError, noise_voltage_v, shape_to_margins};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The derivative filter of all axes, s.
const FILTER_S: f64 = 52e-6;
/// The proportional and derivative gains of the x axis, chosen with its plant.
const X_GAINS: PidGains = PidGains {
    kp_v_per_mm: 1.118,
    ki_v_per_mm_s: 0.0,
    kd_v_s_per_mm: 0.005537,
    derivative_filter_s: FILTER_S,
};
/// Control period of these tests, s.
const PERIOD_S: f64 = 1e-4;

/// One axis under sampled PID control, without reference or disturbance, let go at an error of 1 mm.
struct Run {
    plant: PlantModel,
    gains: PidGains,
    seconds: f64,
}

impl Run {
    /// The RMS error of the last tenth over that of the fifth tenth: below one when the motion dies out. `scaled` is
    /// what the PID is given in place of an error.
    fn growth(&self, scaled: impl Fn(f64) -> f64) -> f64 {
        let mut squares = [0.0; 10];
        self.periods(
            |position| scaled(-position),
            |done, _, position| squares[(10.0 * done) as usize] += position * position,
        );
        (squares[9] / squares[4]).sqrt()
    }

    /// The loop with `error` of the position; `observe` receives the share of the time, the voltage and the position, period by period.
    fn periods(&self, mut error: impl FnMut(f64) -> f64, mut observe: impl FnMut(f64, f64, f64)) {
        let periods = (self.seconds / PERIOD_S) as usize;
        let whole_delay = (self.plant.delay_s / PERIOD_S + 1e-9).floor();
        let older_share = (self.plant.delay_s - whole_delay * PERIOD_S).max(0.0);
        let filter = 2.0 * self.gains.derivative_filter_s;
        let a = (filter - PERIOD_S) / (filter + PERIOD_S);
        let b = 2.0 * self.gains.kd_v_s_per_mm / (filter + PERIOD_S);

        // The last output at the back; at rest before the start.
        let mut outputs = std::collections::VecDeque::from(vec![0.0; whole_delay as usize + 2]);
        let mut state = [1.0, 0.0];
        let (mut integral, mut derivative, mut previous) = (0.0, 0.0, error(1.0));
        for k in 0..periods {
            let error = error(state[0]);
            integral += self.gains.ki_v_per_mm_s * PERIOD_S * error;
            derivative = a * derivative + b * (error - previous);
            previous = error;
            outputs.push_back(self.gains.kp_v_per_mm * error + integral + derivative);
            outputs.pop_front();
            state = self.integrate(state, outputs[0], older_share);
            state = self.integrate(state, outputs[1], PERIOD_S - older_share);
            observe(
                k as f64 / periods as f64,
                outputs[outputs.len() - 1],
                state[0],
            );
        }
    }

    fn integrate(&self, mut state: [f64; 2], volts: f64, duration_s: f64) -> [f64; 2] {
        let rates = |[position, velocity]: [f64; 2]| {
            let acceleration = self.plant.gain_mm_per_v_s2 * volts
                - self.plant.damping_per_s * velocity
                - self.plant.stiffness_per_s2 * position;
            [velocity, acceleration]
        };
        let along = |from: [f64; 2], rate: [f64; 2], time: f64| {
            [from[0] + time * rate[0], from[1] + time * rate[1]]
        };
        // Two steps of the classical Runge-Kutta method: exact to 1e-9 here.
        let h = duration_s / 2.0;
        for _ in 0..2 {
            let k1 = rates(state);
            let k2 = rates(along(state, k1, h / 2.0));
            let k3 = rates(along(state, k2, h / 2.0));
            let k4 = rates(along(state, k3, h));
            for i in 0..2 {
                state[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        state
    }

    fn growth_at_gain(&self, factor: f64) -> f64 {
        self.growth(|error| factor * error)
    }

    fn growth_with_extra_delay(&self, extra_s: f64) -> f64 {
        let plant = PlantModel {
            delay_s: self.plant.delay_s + extra_s,
            ..self.plant
        };
        Run { plant, ..*self }.growth(|error| error)
    }
}

/// That gain and delay at 98 % of the sampled loop's margins leave it stable, and at 102 % do not.
fn confirm_margins(plant: PlantModel, gains: PidGains) -> Result<(), TestCaseError> {
    let margins = margins(&SampledLoop::new(&plant, &gains, PERIOD_S, 0.0))
        .map_err(|error| TestCaseError::fail(error.to_string()))?;
    let run = Run {
        plant,
        gains,
        seconds: 3.0,
    };
    let gain = 10.0_f64.powf(margins.gain_margin_db / 20.0);
    let (inside, outside) = (
        run.growth_at_gain(0.98 * gain),
        run.growth_at_gain(1.02 * gain),
    );
    prop_assert!(inside < 0.9, "gain inside its margin: {inside}");
    prop_assert!(outside > 1.1, "gain outside its margin: {outside}");
    let delay = margins.phase_margin_deg / 360.0 / margins.gain_crossover_hz;
    let inside = run.growth_with_extra_delay(0.98 * delay);
    let outside = run.growth_with_extra_delay(1.02 * delay);
    prop_assert!(inside < 0.9, "delay inside the phase margin: {inside}");
    prop_assert!(outside > 1.1, "delay outside the phase margin: {outside}");
    Ok(())
}

fn axes() -> [(PlantModel, PidGains); 3] {
    let shaped = |plant| {
        (
            plant,
            shape_to_margins(
                &Process::Model(plant),
                Form::Continuous,
                FILTER_S,
                9.9,
                54.2,
            )
            .unwrap(),
        )
    };
    [(X_PLANT, X_GAINS), shaped(Y_PLANT), shaped(Z_PLANT)]
}

#[test]
fn the_margins_of_the_three_axes_are_where_their_loops_become_unstable() {
    for (plant, gains) in axes() {
        let gains = PidGains {
            ki_v_per_mm_s: 0.7,
            ..gains
        };
        confirm_margins(plant, gains).unwrap();
    }
}

#[test]
fn a_gain_just_inside_the_popov_bound_is_stable_constant_or_growing_with_the_error() {
    for (plant, gains) in axes() {
        let bound = sector_bound(&plant, &gains, PERIOD_S);
        let run = Run {
            plant,
            gains,
            seconds: 3.0,
        };
        let constant = run.growth_at_gain(0.98 * bound);
        assert!(constant < 0.9, "{constant}");
        for range_mm in [0.05, 0.5, 5.0] {
            let rate = (0.98 * bound).acosh() / range_mm;
            let nonlinear = run.growth(|e| (rate * e.abs().min(range_mm)).cosh() * e);
            assert!(nonlinear < 0.9, "{nonlinear} at a range of {range_mm} mm");
        }
    }
}

#[test]
fn the_popov_bound_of_the_axes_is_their_gain_margin() {
    // What the nonlinearity costs beyond a constant gain is nothing here: the Popov line touches the plot on the axis.
    for (plant, gains) in axes() {
        let margins = margins(&ContinuousLoop { plant, gains }).unwrap();
        let gain = 10.0_f64.powf(margins.gain_margin_db / 20.0);
        let bound = sector_bound(&plant, &gains, 0.0);
        assert!((bound / gain - 1.0).abs() < 1e-4, "{bound}, {gain}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn shaped_loops_have_the_margins_asked_for_and_lose_stability_at_them(
        gain in 2e4..2e5_f64,
        damping in 20.0..300.0_f64,
        stiffness in 0.0..2e3_f64,
        delay in 0.8e-3..3e-3_f64,
        gain_margin_db in 8.0..12.0_f64,
        phase_margin_deg in 35.0..55.0_f64,
    ) {
        let plant = PlantModel {
            gain_mm_per_v_s2: gain,
            damping_per_s: damping,
            stiffness_per_s2: stiffness,
            delay_s: delay,
        };
        let gains = match shape_to_margins(&Process::Model(plant), Form::Continuous, FILTER_S, gain_margin_db, phase_margin_deg) {
            Ok(gains) => gains,
            Err(ShapingError::OutOfReach { smallest_deg, largest_deg }) => {
                prop_assert!(!(smallest_deg..largest_deg).contains(&phase_margin_deg));
                return Ok(());
            }
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        let found = margins(&ContinuousLoop { plant, gains }).unwrap();
        prop_assert!((found.gain_margin_db - gain_margin_db).abs() < 1e-6);
        prop_assert!((found.phase_margin_deg - phase_margin_deg).abs() < 1e-6);
        confirm_margins(plant, gains)?;
    }

    #[test]
    fn the_popov_bound_never_exceeds_the_gain_margin(
        gain in 2e4..2e5_f64,
        damping in 1.0..300.0_f64,
        stiffness in 0.0..1e5_f64,
        delay in 0.2e-3..3e-3_f64,
        kp in 0.1..3.0_f64,
        ki in 0.0..50.0_f64,
        kd in 0.0..0.02_f64,
    ) {
        let plant = PlantModel {
            gain_mm_per_v_s2: gain,
            damping_per_s: damping,
            stiffness_per_s2: stiffness,
            delay_s: delay,
        };
        let gains = PidGains {
            kp_v_per_mm: kp,
            ki_v_per_mm_s: ki,
            kd_v_s_per_mm: kd,
            derivative_filter_s: FILTER_S,
        };
        let bound = sector_bound(&plant, &gains, 0.0);
        let largest = margins(&ContinuousLoop { plant, gains })
            .map_or(1.0, |m| 10.0_f64.powf(m.gain_margin_db / 20.0));
        prop_assert!(bound >= 1.0 && bound <= largest * (1.0 + 1e-4), "{bound}, {largest}");
    }
}

#[test]
fn the_voltage_of_the_noise_is_that_of_the_loop_that_runs() {
    let form = Form::Sampled {
        sample_time_s: PERIOD_S,
        computation_delay_s: 0.0,
    };
    let noise_mm = 1e-3;
    for filter_s in [FILTER_S, 4e-4] {
        for (plant, gains) in axes() {
            let gains = PidGains {
                ki_v_per_mm_s: 0.7,
                derivative_filter_s: filter_s,
                ..gains
            };
            let run = Run {
                plant,
                gains,
                seconds: 6.0,
            };
            let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
            // Of uniform noise.
            let most_mm = noise_mm * 3.0_f64.sqrt();
            let (mut squares, mut count) = (0.0, 0.0);
            run.periods(
                |position| -position + random.random_range(-most_mm..most_mm),
                // The first position, which is let go, is forgotten by then.
                |done, volts, _| {
                    if done > 0.3 {
                        squares += volts * volts;
                        count += 1.0;
                    }
                },
            );
            let measured_v = f64::sqrt(squares / count);
            let expected_v = noise_voltage_v(&Process::Model(plant), &gains, form, noise_mm);
            let ratio = measured_v / expected_v;
            assert!((0.97..1.03).contains(&ratio), "{measured_v} {expected_v} V");
        }
    }
}
