//! A friction model alone: the hysteresis of GMS friction as it is pushed 50 um to and fro.

use quadrant_law::friction::{Direction, gms, stribeck::SlidingTable};

fn main() {
    const PERIOD_S: f64 = 1e-3;
    let friction = quadrant_settings::presets::x_axis().friction;
    let curves = friction.sliding.map(|side| side.curve);
    let surface = SlidingTable::build(&curves, friction.gms.attraction_v_s, PERIOD_S);
    let model = gms::Gms::<f64, 10>::build(&friction.gms.elements);
    let mut state = gms::GmsState::default();
    println!("position_um,friction_v");
    let mut position_mm = 0.0;
    for tick in 0..1000 {
        let next_mm = 0.05 * (f64::from(tick) * PERIOD_S * core::f64::consts::TAU).sin();
        let displacement = next_mm - position_mm;
        position_mm = next_mm;
        let sliding = surface.at(displacement.abs() / PERIOD_S, Direction::of(displacement));
        let force = model.step(&mut state, displacement, sliding);
        if tick % 20 == 0 {
            println!("{:.3},{force:.5}", 1000.0 * position_mm);
        }
    }
}
