//! A plain axis moves as it did before loads, changes and other drives came in, bit for bit.

use quadrant_law::friction::Direction;
use quadrant_law::friction::gms::{Gms, GmsState};
use quadrant_law::friction::stribeck::SlidingTable;
use quadrant_law::stage::Outputs;
use quadrant_law::units::DacCode;
use quadrant_sim::plant::{PLANT_ELEMENTS, SimulatedAxis, SimulatedStage, StageParameters};
use std::collections::VecDeque;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 10e3;
const SUBSTEPS: usize = 4;

fn along(velocity: f64) -> Direction {
    if velocity < 0.0 {
        Direction::Negative
    } else {
        Direction::Positive
    }
}

#[test]
fn a_plain_axis_moves_by_the_equations_of_old() {
    for (index, truth) in StageParameters::real().axes.into_iter().enumerate() {
        let mut axis = SimulatedAxis::new(truth.clone(), RATE_HZ, 7);
        let step_s = 1.0 / (RATE_HZ * SUBSTEPS as f64);
        let delay = (truth.delay_s / step_s).round() as usize;
        let mut pipeline = VecDeque::from(vec![0.0; delay]);
        let gms: Gms<f64, PLANT_ELEMENTS> = Gms::build(&truth.gms.elements);
        let surface = SlidingTable::<f64>::build(
            &truth.friction.map(|model| model.curve),
            truth.gms.attraction_v_s,
            step_s,
        );
        let mut state = GmsState::default();
        let (mut elements, mut position, mut velocity) = (0.0, 0.0, 0.0_f64);
        let (gain, odd) = (truth.gain_mm_per_v_s2, &truth.imperfections);
        for tick in 0..30_000 {
            let code = DacCode((1000.0 * (TAU * f64::from(tick) / 4000.0).sin()) as i16);
            axis.step(code, true);
            let driven = f64::from(code.0) * (10.0 / DacCode::FULL_SCALE) + odd.offset_v;
            let external = 0.0 - odd.ripple_v * (TAU * position / odd.lead_mm).sin();
            for _ in 0..SUBSTEPS {
                pipeline.push_back(driven);
                let force = pipeline.pop_front().unwrap() + external;
                let viscous = truth.friction.of(along(velocity)).viscous_v_s_per_mm;
                let drag = 0.5 * step_s * (truth.damping_per_s + gain * viscous);
                let push = gain * (force - elements) - truth.stiffness_per_s2 * position;
                let after = (velocity * (1.0 - drag) + push * step_s) / (1.0 + drag);
                let displacement = 0.5 * (velocity + after) * step_s;
                velocity = after;
                position += displacement;
                let sliding = surface.at(after.abs(), along(displacement));
                elements = gms.step(&mut state, displacement, sliding);
            }
            assert_eq!(
                (axis.position_mm().to_bits(), axis.velocity_mm_s().to_bits()),
                (position.to_bits(), velocity.to_bits()),
                "axis {index}, tick {tick}"
            );
        }
        assert!(position.abs() > 1.0);
    }
}

#[test]
fn the_axes_of_a_stage_move_as_each_would_alone() {
    let truth = StageParameters::real();
    let mut stage = SimulatedStage::new(&truth, RATE_HZ, 7);
    let mut seeds = 7 * 3..;
    let mut alone = truth
        .axes
        .map(|axis| SimulatedAxis::new(axis, RATE_HZ, seeds.next().unwrap()));
    for tick in 0..20_000 {
        let code = |period: f64| DacCode((1000.0 * (TAU * f64::from(tick) / period).sin()) as i16);
        let codes = [4000.0, 3100.0, 1700.0].map(code);
        let enabled = tick % 7000 < 6500;
        stage.step(&Outputs {
            codes: codes.into(),
            enabled,
            ..Outputs::default()
        });
        for (axis, code) in alone.iter_mut().zip(codes) {
            axis.step(code, enabled);
        }
        let counters = alone.each_mut().map(SimulatedAxis::read_counter);
        assert_eq!(stage.read_counters(), counters, "tick {tick}");
    }
    for (together, alone) in stage.axes().iter().zip(&alone) {
        assert_eq!(
            together.position_mm().to_bits(),
            alone.position_mm().to_bits()
        );
        assert_eq!(
            together.friction_v().to_bits(),
            alone.friction_v().to_bits()
        );
    }
}
