//! The glitch monitor against f64, on signals with known spikes, and the error of the approximations it uses.

use quadrant::app::Snapshot;
use quadrant::app::glitch_monitor::{GlitchEvent, GlitchMonitor, degrees, root};
use quadrant_law::safety::SafetyState;
use quadrant_law::supervisor::PERIOD_TICKS;
use quadrant_law::units::Position;
use quadrant_link::message::AxisName;

/// Length of a count, mm.
const RESOLUTION_MM: f64 = 5e-4;
/// Control rate, Hz.
const RATE_HZ: f64 = 1e4;
/// Radius of the circle, mm.
const RADIUS_MM: f64 = 15.0;
/// Turns of the circle in a second, Hz.
const FREQUENCY_HZ: f64 = 0.5;
/// Error between the spikes, mm.
const LEVEL_MM: f64 = 0.8e-3;
/// Decay of a spike, s.
const DECAY_S: f64 = 0.02;

/// Reference and error of an axis at a time since its last reversal: a level, and a spike that rises in 5 ms and decays.
fn error_mm(since_reversal_s: f64, spike_mm: f64) -> f64 {
    let rise = (since_reversal_s / 0.005).min(1.0);
    let spike = spike_mm * rise * (-(since_reversal_s - 0.005).max(0.0) / DECAY_S).exp();
    spike.max(LEVEL_MM)
}

/// A stage that follows a circle in the plane of two axes, its errors those of the radial `push` and of spikes.
struct Circling {
    pair: [usize; 2],
    spikes_mm: [f64; 2],
    tick: u32,
}

impl Circling {
    /// Angle of the reference, rad.
    fn angle(&self) -> f64 {
        std::f64::consts::TAU * FREQUENCY_HZ * f64::from(self.tick) / RATE_HZ
    }

    fn reference_mm(&self) -> [f64; 2] {
        let (sine, cosine) = self.angle().sin_cos();
        [RADIUS_MM * cosine, RADIUS_MM * sine]
    }

    fn errors_mm(&self) -> [f64; 2] {
        let half_turn = 0.5 / FREQUENCY_HZ;
        let seconds = f64::from(self.tick) / RATE_HZ;
        // x reverses at whole and half turns, y a quarter of a turn later. The stage stays behind.
        [(0.0, 0), (0.5 * half_turn, 1)].map(|(shift, axis)| {
            let phase = (seconds - shift).rem_euclid(half_turn);
            let turns = ((seconds - shift) / half_turn).floor() as i64;
            let sign = if turns.rem_euclid(2) == axis as i64 {
                -1.0
            } else {
                1.0
            };
            sign * error_mm(phase, self.spikes_mm[axis])
        })
    }

    fn snapshot(&self) -> Snapshot<f32> {
        let mut seen = Snapshot {
            tick: self.tick,
            ..Snapshot::default()
        };
        seen.view.safety = SafetyState::Enabled;
        let (references, errors) = (self.reference_mm(), self.errors_mm());
        for (part, axis) in self.pair.into_iter().enumerate() {
            seen.axes[axis].reference = Position::from_mm(references[part], RESOLUTION_MM);
            seen.axes[axis].error = errors[part] as f32;
        }
        seen
    }

    /// Radial deviation of the measured position, um, computed without approximations.
    fn deviation_um(&self) -> f64 {
        let ([x, y], [error_x, error_y]) = (self.reference_mm(), self.errors_mm());
        1e3 * ((x - error_x).hypot(y - error_y) - RADIUS_MM)
    }
}

fn run(circling: &mut Circling, seconds: f64) -> (Vec<GlitchEvent>, GlitchMonitor) {
    let mut monitor = GlitchMonitor::new([RESOLUTION_MM as f32; 3]);
    let mut events = vec![];
    while f64::from(circling.tick) < seconds * RATE_HZ {
        circling.tick += 1;
        if circling.tick.is_multiple_of(PERIOD_TICKS) {
            events.extend(monitor.step(&circling.snapshot()));
        }
    }
    (events, monitor)
}

fn circling(pair: [usize; 2]) -> Circling {
    Circling {
        pair,
        spikes_mm: [5.6e-3, 3.9e-3],
        tick: 0,
    }
}

#[test]
fn the_height_of_each_spike_is_found_with_its_axis_and_tick() {
    let mut machine = circling([0, 1]);
    let (events, monitor) = run(&mut machine, 9.9);
    let mut found = 0;
    for event in &events {
        let GlitchEvent::Reversal {
            axis,
            tick,
            height_um,
        } = *event
        else {
            continue;
        };
        let (spike_mm, shift) = match axis {
            AxisName::X => (machine.spikes_mm[0], 0.0),
            AxisName::Y => (machine.spikes_mm[1], 0.25),
            AxisName::Z => panic!("z stands"),
        };
        let expected_um = 1e3 * (spike_mm - LEVEL_MM);
        // Seen once a millisecond, of which the spike loses 2.5 % from its top.
        let height_um = f64::from(height_um);
        assert!(
            (0.97 * expected_um - 0.05..=expected_um + 0.01).contains(&height_um),
            "{axis}: {height_um} for {expected_um} um"
        );
        let turns = f64::from(tick) / RATE_HZ * FREQUENCY_HZ - shift;
        let off_ticks = (2.0 * turns - (2.0 * turns).round()) / 2.0 / FREQUENCY_HZ * RATE_HZ;
        assert!(
            (0.0..=11.0).contains(&off_ticks),
            "tick {tick}: {off_ticks}"
        );
        found += 1;
    }
    // The first reversal of each axis is where it starts.
    assert!((17..=19).contains(&found), "{found} reversals");
    let shown = monitor.readings().heights_um;
    assert!(
        (shown[0] - 4.8).abs() < 0.2 && (shown[1] - 3.1).abs() < 0.2,
        "{shown:?}"
    );
}

#[test]
fn the_worst_point_of_a_circle_is_found_with_its_angle() {
    for pair in [[0, 1], [1, 2], [0, 2]] {
        let mut machine = circling(pair);
        let (events, monitor) = run(&mut machine, 9.9);
        // The reference: each tick of one turn in f64.
        let turn = (RATE_HZ / FREQUENCY_HZ) as u32;
        let (worst_um, angle_deg) = (0..turn)
            .map(|tick| {
                let at = Circling {
                    tick: tick + 2 * turn,
                    ..circling(pair)
                };
                (at.deviation_um(), at.angle().to_degrees().rem_euclid(360.0))
            })
            .max_by(|left, right| left.0.abs().total_cmp(&right.0.abs()))
            .expect("ticks");
        let circles = events
            .iter()
            .filter_map(|event| match event {
                GlitchEvent::Circle(circle) => Some(*circle),
                GlitchEvent::Reversal { .. } => None,
            })
            .collect::<Vec<_>>();
        assert!(circles.len() >= 2, "{circles:?}");
        for circle in circles {
            let off_um = f64::from(circle.deviation_um) - worst_um;
            assert!(
                off_um.abs() < 0.03 * worst_um.abs(),
                "{} for {worst_um} um",
                circle.deviation_um
            );
            // Both reversals of x have the same height: half a turn apart is as good.
            let off_deg = (f64::from(circle.angle_deg) - angle_deg).rem_euclid(180.0);
            assert!(
                off_deg.min(180.0 - off_deg) < 0.6,
                "{} for {angle_deg}",
                circle.angle_deg
            );
        }
        assert_eq!(
            Some(GlitchEvent::Circle(monitor.readings().circle)),
            events
                .iter()
                .rfind(|event| matches!(event, GlitchEvent::Circle(_)))
                .copied()
        );
    }
}

#[test]
fn an_ellipse_and_a_single_axis_are_no_circle() {
    let mut monitor = GlitchMonitor::new([RESOLUTION_MM as f32; 3]);
    let mut machine = circling([0, 1]);
    let mut ellipse = |flattened: f64| {
        (0..100_000u32).step_by(10).any(|tick| {
            machine.tick = tick;
            let mut seen = machine.snapshot();
            let y = machine.reference_mm()[1] * flattened;
            seen.axes[1].reference = Position::from_mm(y, RESOLUTION_MM);
            monitor
                .step(&seen)
                .iter()
                .any(|event| matches!(event, GlitchEvent::Circle(_)))
        })
    };
    assert!(!ellipse(0.9));
    assert!(!ellipse(0.0));
    assert!(ellipse(1.0));
}

#[test]
fn nothing_is_reported_while_the_outputs_are_off() {
    let mut monitor = GlitchMonitor::new([RESOLUTION_MM as f32; 3]);
    let mut machine = circling([0, 1]);
    for tick in (0..100_000).step_by(10) {
        machine.tick = tick;
        let mut seen = machine.snapshot();
        seen.view.safety = SafetyState::Disabled;
        assert!(monitor.step(&seen).is_empty());
    }
    assert_eq!(monitor.readings(), Default::default());
}

#[test]
fn the_root_errs_by_less_than_two_per_mille() {
    use micromath::F32Ext;
    let (mut rough, mut refined) = (0.0_f64, 0.0_f64);
    // Two octaves are all: the error repeats. Wider, to see that it does.
    for exponent in -20..20 {
        for step in 0..4096 {
            let square = 2f32.powi(exponent) * (1.0 + step as f32 / 4096.0);
            let exact = f64::from(square).sqrt();
            let off = |value: f32| (f64::from(value) / exact - 1.0).abs();
            rough = rough.max(off(F32Ext::sqrt(square)));
            refined = refined.max(off(root(square)));
        }
    }
    println!("sqrt: micromath errs by {rough:.5}, with one Newton step by {refined:.6}");
    assert!(rough < 0.062 && refined < 0.002, "{rough}, {refined}");
}

#[test]
fn the_angle_errs_by_less_than_a_fifth_of_a_degree() {
    let mut worst = 0.0_f64;
    for step in 0..36_000 {
        let exact = f64::from(step) / 100.0;
        let (sine, cosine) = exact.to_radians().sin_cos();
        for radius in [0.1, 15.0, 300.0] {
            let shown = degrees((radius * sine) as f32, (radius * cosine) as f32);
            assert!((0.0..=360.0).contains(&shown), "{exact}: {shown}");
            let off = (f64::from(shown) - exact + 180.0).rem_euclid(360.0) - 180.0;
            worst = worst.max(off.abs());
        }
    }
    println!("atan2: micromath errs by {worst:.4} deg");
    assert!(worst < 0.2, "{worst}");
}
