//! The friction-velocity map and its model, judged against the truth of the simulated stage.

use quadrant_law::friction::PerDirection;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_tune::commission::bootstrap::measuring_settings;
use quadrant_tune::identify::static_friction::{
    Exponent, FrictionFitError, FrictionMap, FrictionRun, KnownViscous, ShortRuns,
    StaticFrictionError, StaticFrictionSettings, fit_map, measure,
};
use quadrant_tune::test_axis::{AxisInfo, SimulatedTestAxis, TestAxis};

/// An axis under its own PID.
fn test_axis(index: usize, truth: &AxisParameters, seed: u64) -> SimulatedTestAxis {
    let mut test_axis = SimulatedTestAxis::new(index, truth.clone(), seed);
    let settings = measuring_settings(test_axis.settings());
    test_axis.apply(&settings).unwrap();
    test_axis
}

/// The runs of a commissioning.
fn runs() -> StaticFrictionSettings {
    StaticFrictionSettings {
        velocities_mm_s: (0.1, 40.0),
        ..StaticFrictionSettings::default()
    }
}

/// The same with short slow runs.
fn short_runs() -> StaticFrictionSettings {
    StaticFrictionSettings {
        short: Some(ShortRuns {
            below_mm_s: 0.5,
            stretch_mm: 2.5,
        }),
        ..runs()
    }
}

/// Fewer and shorter ones, for levels alone.
fn few_runs() -> StaticFrictionSettings {
    StaticFrictionSettings {
        velocities_mm_s: (0.4, 20.0),
        count: 8,
        ..StaticFrictionSettings::default()
    }
}

fn mapped(test_axis: &mut SimulatedTestAxis, settings: &StaticFrictionSettings) -> FrictionMap {
    measure(test_axis, settings, &mut |_| {}).unwrap().0
}

/// Friction of the positive direction by `factor`, of the negative by its mirror image around 1; nothing pushes.
fn leaning(factor: f64) -> AxisParameters {
    let mut truth = StageParameters::real().axes[0].clone();
    truth.imperfections.offset_v = 0.0;
    let mut mean = truth.friction.positive;
    mean.curve.coulomb_v = 0.120;
    mean.curve.breakaway_v = 0.150;
    let directed = |factor: f64| {
        let mut model = mean;
        model.curve.coulomb_v *= factor;
        model.curve.breakaway_v *= factor;
        model
    };
    truth.friction = PerDirection {
        positive: directed(factor),
        negative: directed(2.0 - factor),
    };
    truth
}

#[test]
fn every_axis_shows_its_friction_in_both_directions() {
    let axes = StageParameters::real().axes;
    for (index, settings) in [0, 1, 2]
        .map(|index| (index, runs()))
        .into_iter()
        .chain([(0, short_runs()), (2, short_runs())])
    {
        let truth = &axes[index];
        let map = mapped(&mut test_axis(index, truth, 1), &settings);
        let found = fit_map(&map, Exponent::Fixed(1.0), None).unwrap();
        let offset_v = truth.imperfections.offset_v;
        for (model, exact, pushed_v) in [
            (
                &found.directions.positive,
                truth.friction.positive,
                offset_v,
            ),
            (
                &found.directions.negative,
                truth.friction.negative,
                -offset_v,
            ),
        ] {
            let curve = model.model.curve;
            let off = |value: f64, exact: f64| (value / exact - 1.0).abs();
            let errors = [
                off(curve.coulomb_v, exact.curve.coulomb_v - pushed_v),
                off(curve.breakaway_v, exact.curve.breakaway_v - pushed_v),
                off(
                    curve.stribeck_velocity_mm_s,
                    exact.curve.stribeck_velocity_mm_s,
                ),
            ];
            for (error, most) in errors.into_iter().zip([0.03, 0.05, 0.20]) {
                assert!(error < most, "axis {index}: {errors:?}");
            }
        }
    }
}

#[test]
fn a_friction_that_depends_on_direction_is_found() {
    for factor in [1.15, 0.9] {
        let map = mapped(&mut test_axis(0, &leaning(factor), 2), &few_runs());
        let found = fit_map(&map, Exponent::Fixed(1.0), None).unwrap().models();
        let ratio = found.positive.curve.coulomb_v / found.negative.curve.coulomb_v;
        let exact = factor / (2.0 - factor);
        assert!((ratio / exact - 1.0).abs() < 0.02, "{ratio} for {exact}");
    }
}

#[test]
fn friction_that_differs_from_place_to_place_is_that_of_the_middle_and_not_viscous() {
    for (settings, period_mm) in [(runs(), 25.0), (short_runs(), 40.0)] {
        let mut truth = StageParameters::real().axes[0].clone();
        truth.imperfections.friction_variation = 0.2;
        truth.imperfections.friction_period_mm = period_mm;
        let map = mapped(&mut test_axis(0, &truth, 1), &settings);
        let found = fit_map(&map, Exponent::Fixed(1.0), None).unwrap().models();
        let damping = truth.damping_per_s / truth.gain_mm_per_v_s2;
        let offset_v = truth.imperfections.offset_v;
        for (found, exact, pushed_v) in [
            (found.positive, truth.friction.positive, offset_v),
            (found.negative, truth.friction.negative, -offset_v),
        ] {
            let exact_viscous = exact.viscous_v_s_per_mm + damping;
            let ratios = [
                found.viscous_v_s_per_mm / exact_viscous,
                found.curve.coulomb_v / (exact.curve.coulomb_v - pushed_v),
                found.curve.breakaway_v / (exact.curve.breakaway_v - pushed_v),
            ];
            println!("{period_mm} mm: {ratios:.3?}");
            assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.05));
        }
    }
}

#[test]
fn an_offset_of_the_amplifier_shows_as_the_difference_of_equal_frictions() {
    let mut truth = leaning(1.0);
    truth.imperfections.offset_v = 0.008;
    let map = mapped(&mut test_axis(0, &truth, 3), &few_runs());
    let found = fit_map(&map, Exponent::Fixed(1.0), None).unwrap();
    assert!((found.offset_v - 0.008).abs() < 5e-4, "{}", found.offset_v);
    let (coulomb_v, _) = found.mean_levels_v();
    assert!((coulomb_v / 0.120 - 1.0).abs() < 0.03, "{coulomb_v}");
}

#[test]
fn stick_slip_at_the_low_end_is_detected_and_does_not_count() {
    let settings = StaticFrictionSettings {
        velocities_mm_s: (0.03, 20.0),
        count: 12,
        stretch_mm: 1.0,
        ..StaticFrictionSettings::default()
    };
    let mut truth = StageParameters::real().axes[0].clone();
    for way in [&mut truth.friction.positive, &mut truth.friction.negative] {
        way.curve.breakaway_v *= 1.3;
    }
    let map = mapped(&mut test_axis(0, &truth, 1), &settings);
    let slowest = map.runs.iter().filter(|run| run.velocity_mm_s.abs() < 0.04);
    assert!(slowest.clone().count() == 2 && slowest.clone().all(|run| run.stick_slip));
    let mut fast = map.runs.iter().filter(|run| run.velocity_mm_s.abs() > 1.0);
    assert!(fast.all(|run| !run.stick_slip));
    let found = fit_map(&map, Exponent::Fixed(1.0), None).unwrap();
    let stuck = map.runs.iter().filter(|run| run.stick_slip).count();
    assert_eq!(found.stick_slip_runs, stuck);
    assert!(found.directions.positive.speeds_mm_s.0 > 0.04);
}

#[test]
fn short_runs_are_freed_of_the_screws_ripple_and_take_less_than_half_the_time() {
    let mut truth = leaning(1.0);
    truth.imperfections.ripple_v = 0.03;
    let mut levels_v = Vec::new();
    let mut lasts_s = Vec::new();
    for settings in [runs(), short_runs()] {
        let mut axis = test_axis(0, &truth, 4);
        let (map, recordings) = measure(&mut axis, &settings, &mut |_| {}).unwrap();
        // The next ones are at 0.74 mm/s.
        let slow = map.runs.iter().filter(|run| run.velocity_mm_s.abs() < 0.6);
        levels_v.push(slow.map(|run| run.voltage_v).collect::<Vec<_>>());
        lasts_s.push(recordings.iter().map(|run| run.duration_s()).sum::<f64>());
    }
    assert_eq!([levels_v[0].len(), levels_v[1].len()], [10, 10]);
    for (whole_v, short_v) in levels_v[0].iter().zip(&levels_v[1]) {
        assert!((whole_v - short_v).abs() < 0.002, "{levels_v:?}");
    }
    assert!(lasts_s[1] < 0.5 * lasts_s[0], "{lasts_s:?}");
}

#[test]
fn an_axis_under_its_own_controller_does_not_stick_and_slip() {
    let map = mapped(
        &mut test_axis(0, &StageParameters::real().axes[0], 1),
        &few_runs(),
    );
    assert_eq!(map.runs.len(), 16);
    assert!(map.runs.iter().all(|run| !run.stick_slip));
}

#[test]
fn a_map_that_is_too_thin_or_has_wrong_signs_is_refused() {
    let mut map = mapped(
        &mut test_axis(0, &StageParameters::real().axes[0], 1),
        &few_runs(),
    );
    let thin = FrictionMap {
        runs: map.runs[3..].to_vec(),
    };
    let error = fit_map(&thin, Exponent::Free, None).unwrap_err();
    assert!(
        matches!(
            error,
            FrictionFitError::TooFewRuns {
                direction: "negative",
                runs: 5
            }
        ),
        "{error}"
    );
    for run in &mut map.runs {
        run.voltage_v = -run.voltage_v;
    }
    let error = fit_map(&map, Exponent::Free, None).unwrap_err();
    assert!(matches!(error, FrictionFitError::Sign { .. }), "{error}");
}

#[test]
fn runs_that_cannot_be_made_are_refused_before_the_axis_moves() {
    let mut test_axis = test_axis(0, &StageParameters::real().axes[0], 1);
    let far = StaticFrictionSettings {
        velocities_mm_s: (1.0, 240.0),
        ..StaticFrictionSettings::default()
    };
    let error = measure(&mut test_axis, &far, &mut |_| {}).unwrap_err();
    assert!(
        matches!(error, StaticFrictionError::Travel { velocity_mm_s, .. } if velocity_mm_s > 150.0),
        "{error}"
    );
    for settings in [
        StaticFrictionSettings {
            velocities_mm_s: (2.0, 1.0),
            ..runs()
        },
        StaticFrictionSettings { count: 5, ..runs() },
        StaticFrictionSettings {
            stretch_mm: f64::NAN,
            ..runs()
        },
    ] {
        let error = measure(&mut test_axis, &settings, &mut |_| {}).unwrap_err();
        assert!(matches!(error, StaticFrictionError::Setting(_)), "{error}");
    }
}

#[test]
fn the_level_at_rest_is_near_what_was_measured_where_no_run_was_slow() {
    // Speed, mm/s, mean voltage and its deviation, V: the screw's cogging is in the means.
    let seen = [
        (17.067, 0.0970, 0.0015),
        (19.005, 0.1020, 0.0019),
        (21.089, 0.0848, 0.0007),
        (29.066, 0.1041, 0.0015),
        (32.286, 0.0935, 0.0016),
        (36.009, 0.1162, 0.0007),
        (39.981, 0.1074, 0.0016),
    ];
    let run = |sign: f64, (speed, voltage_v, deviation_v): (f64, f64, f64)| FrictionRun {
        velocity_mm_s: sign * speed,
        voltage_v: sign * voltage_v,
        deviation_v,
        stick_slip: false,
    };
    let backward = seen.into_iter().rev().map(|seen| run(-1.0, seen));
    let map = FrictionMap {
        runs: backward
            .chain(seen.into_iter().map(|seen| run(1.0, seen)))
            .collect(),
    };
    let found = fit_map(&map, Exponent::Fixed(1.0), None).unwrap();
    let (coulomb_v, breakaway_v) = found.mean_levels_v();
    assert!(
        breakaway_v < 1.5 * 0.1162 && coulomb_v > 0.0,
        "{coulomb_v} {breakaway_v}"
    );
}

/// Viscous friction of the models whose maps follow, V s/mm.
const DAMPING: f64 = 2e-3;

/// Friction that goes from one level to another with a speed, V and mm/s, and viscous friction.
fn damped(coulomb_v: f64, breakaway_v: f64, stribeck_velocity_mm_s: f64) -> StaticFriction {
    StaticFriction {
        curve: StribeckCurve {
            coulomb_v,
            breakaway_v,
            stribeck_velocity_mm_s,
            exponent: 1.0,
        },
        viscous_v_s_per_mm: DAMPING,
    }
}

/// Fourteen runs both ways, the slowest at 0.1 mm/s, each faster than the one before by a ratio; `scatter` is relative.
fn map_of(truth: &StaticFriction, ratio: f64, scatter: f64) -> FrictionMap {
    let run = |index: i32| {
        let speed = 0.1 * ratio.powi(index);
        let scattered = 1.0 + scatter * (2.7 * f64::from(index)).sin();
        [1.0, -1.0].map(|sign| FrictionRun {
            velocity_mm_s: sign * speed,
            voltage_v: sign * scattered * truth.friction_v(speed),
            deviation_v: 1e-4,
            stick_slip: false,
        })
    };
    FrictionMap {
        runs: (0..14).flat_map(run).collect(),
    }
}

#[test]
fn viscous_friction_that_slow_runs_do_not_show_is_that_of_the_linear_model() {
    let truth = damped(0.07, 0.10, 3.0);
    // Friction differs by a hundredth from run to run, as no model of the velocity says.
    let map = map_of(&truth, 1.3, 0.01);
    let viscous = |known: Option<(f64, f64)>| {
        let known = known.map(|(ratio, deviation)| KnownViscous {
            value: ratio * DAMPING,
            deviation: deviation * DAMPING,
        });
        let found = fit_map(&map, Exponent::Fixed(1.0), known).unwrap();
        found.models().positive.viscous_v_s_per_mm / DAMPING
    };
    let alone = viscous(None);
    assert!((alone - 1.0).abs() > 0.5, "{alone}");
    for ratio in [0.8, 1.0, 1.2] {
        let found = viscous(Some((ratio, 0.3 * ratio)));
        assert!((found / ratio - 1.0).abs() < 0.2, "{found} for {ratio}");
    }
    let unsure = viscous(Some((0.01, 100.0)));
    assert!((unsure - alone).abs() < 0.1, "{unsure} for {alone}");
}

#[test]
fn a_level_that_rises_with_the_speed_is_found_beside_a_known_viscous_friction() {
    let truth = damped(0.12, 0.08, 4.0);
    let map = map_of(&truth, 1.5, 0.0);
    let known = KnownViscous {
        value: DAMPING,
        deviation: 0.3 * DAMPING,
    };
    let found = fit_map(&map, Exponent::Fixed(1.0), Some(known)).unwrap();
    let curve = found.models().positive.curve;
    let off = [curve.coulomb_v - 0.12, curve.breakaway_v - 0.08];
    assert!(off.iter().all(|off| off.abs() < 2e-3), "{curve:?}");
}

#[test]
fn runs_keep_to_the_travel_and_begin_about_its_middle() {
    for travel_mm in [5.0, 20.0, 59.0, 60.0, 100.0, 200.0] {
        let truth = StageParameters::real().axes[0].clone();
        let mut axis = SimulatedTestAxis::new(0, truth, 1).with_travel_mm(travel_mm);
        let settings = measuring_settings(axis.settings());
        axis.apply(&settings).unwrap();
        let runs = few_runs().fitted_to(&axis.info());
        let (map, recordings) = measure(&mut axis, &runs, &mut |_| {}).unwrap();
        assert_eq!(map.runs.len(), 16);
        for recording in &recordings {
            let ends = [
                recording.reference_mm.first(),
                recording.reference_mm.last(),
            ];
            let [from_mm, to_mm] = ends.map(|end| *end.unwrap());
            assert!(from_mm.abs().max(to_mm.abs()) < 0.9 * travel_mm);
            assert!((from_mm + to_mm).abs() < 0.2 * runs.stretch_mm);
        }
    }
}

#[test]
fn slow_runs_are_shorter_on_a_short_travel_too() {
    let axis = SimulatedTestAxis::new(0, StageParameters::real().axes[0].clone(), 1);
    let minutes = |settings: StaticFrictionSettings, travel_mm: f64| {
        let info = AxisInfo {
            travel_mm,
            ..axis.info()
        };
        settings.fitted_to(&info).lasts_s(&info) / 60.0
    };
    for travel_mm in [10.0, 18.0, 100.0] {
        let (all, with_short) = (minutes(runs(), travel_mm), minutes(short_runs(), travel_mm));
        assert!(
            with_short < 0.6 * all,
            "{travel_mm} mm: {with_short} min for {all}"
        );
    }
    // There is no part of these that would show enough.
    assert!(minutes(short_runs(), 1.5) > 0.99 * minutes(runs(), 1.5));
}

#[test]
fn a_short_travel_takes_from_the_time_before_a_run_first_and_then_from_the_velocity() {
    let axis = SimulatedTestAxis::new(0, StageParameters::real().axes[0].clone(), 1);
    let fitted = |travel_mm: f64| {
        let info = AxisInfo {
            travel_mm,
            ..axis.info()
        };
        let fitted = runs().fitted_to(&info);
        (fitted, fitted.lasts_s(&info))
    };
    let [(whole, whole_s), (shorter, shorter_s), (short, _)] = [200.0, 60.0, 10.0].map(fitted);
    assert_eq!((whole, shorter), (runs(), runs()));
    assert!(shorter_s < whole_s);
    assert!(short.velocities_mm_s.1 < whole.velocities_mm_s.1);
}
