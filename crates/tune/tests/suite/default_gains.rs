//! The default settings' gains are what `docs/parameters.md` says they are.

use quadrant_settings::popov::sector_bound;
use quadrant_settings::presets::{x_axis, y_axis, z_axis};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::loop_shape::ContinuousLoop;
use quadrant_sim::margins::{Margins, margins};
use quadrant_tune::design::{Form, Process, largest_integral_gain_where, shape_to_margins};

use crate::printed_margins::PrintedMargins;

fn loop_margins(axis: &AxisSettings) -> Margins {
    margins(&ContinuousLoop {
        plant: axis.plant.unwrap(),
        gains: axis.feedback.pid,
    })
    .unwrap()
}

#[test]
fn x_has_the_margins_that_the_thesis_prints() {
    assert!(PrintedMargins::THESIS_X.read(&loop_margins(&x_axis())));
}

#[test]
fn the_integral_gain_of_x_is_the_largest_that_leaves_them_as_printed() {
    let x = x_axis();
    let pid = x.feedback.pid;
    let process = Process::Model(x.plant.unwrap());
    let largest = largest_integral_gain_where(&process, Form::Continuous, &pid, |margins| {
        PrintedMargins::THESIS_X.read(margins)
    });
    assert_eq!(largest, Some(pid.ki_v_per_mm_s));
}

#[test]
fn what_limits_the_integral_gain_of_x_is_the_printed_crossover_frequency() {
    let mut x = x_axis();
    x.feedback.pid.ki_v_per_mm_s += 0.01;
    let (printed, beyond) = (PrintedMargins::THESIS_X, loop_margins(&x));
    assert!(!printed.gain_crossover_hz.reads(beyond.gain_crossover_hz));
    assert!(printed.gain_margin_db.reads(beyond.gain_margin_db));
    assert!(printed.phase_crossover_hz.reads(beyond.phase_crossover_hz));
    assert!(printed.phase_margin_deg.reads(beyond.phase_margin_deg));
}

#[test]
fn y_and_z_are_shaped_to_the_same_margins_with_an_integral_gain_chosen_as_strictly() {
    for axis in [y_axis(), z_axis()] {
        let (plant, pid) = (axis.plant.unwrap(), axis.feedback.pid);
        let shaped = shape_to_margins(
            &Process::Model(plant),
            Form::Continuous,
            pid.derivative_filter_s,
            9.9,
            54.2,
        )
        .unwrap();
        assert!((pid.kp_v_per_mm / shaped.kp_v_per_mm - 1.0).abs() < 5e-4);
        assert!((pid.kd_v_s_per_mm / shaped.kd_v_s_per_mm - 1.0).abs() < 5e-4);
        let without = margins(&ContinuousLoop {
            plant,
            gains: shaped,
        })
        .unwrap();
        let strict = |with: &Margins| {
            (with.gain_margin_db - without.gain_margin_db).abs() < 0.05
                && (with.phase_margin_deg - without.phase_margin_deg).abs() < 0.05
                && (with.phase_crossover_hz - without.phase_crossover_hz).abs() < 0.5
                && (with.gain_crossover_hz - without.gain_crossover_hz).abs() < 0.05
        };
        let largest =
            largest_integral_gain_where(&Process::Model(plant), Form::Continuous, &shaped, strict);
        assert_eq!(largest, Some(pid.ki_v_per_mm_s));
    }
}

#[test]
fn the_largest_nonlinear_gain_is_about_four_fifths_of_the_popov_bound() {
    let stage = StageSettings::simulated();
    for axis in &stage.axes {
        let bound = sector_bound(
            &axis.plant.unwrap(),
            &axis.feedback.pid,
            1.0 / stage.rate_hz,
        );
        let share = axis.feedback.nonlinear.unwrap().largest() / bound;
        assert!((0.75..0.82).contains(&share), "{share}");
    }
}
