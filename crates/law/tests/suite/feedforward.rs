//! Friction feedforward: nothing when off, each effect once, at the right time.

use proptest::prelude::*;
use quadrant_law::feedforward::{
    Feedforward, FeedforwardGains, FeedforwardKind, FeedforwardState, FeedforwardTerms,
    ReferenceStep,
};
use quadrant_law::friction::FrictionSettings;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_law::units::{DacCode, Position};
use quadrant_settings::presets::x_axis;
use quadrant_settings::{PlanSettings, StageSettings};

use quadrant_test_support::{Noise, Rig, any_f32, repeatable, sine_on_x, with_x, x_alone};

const PERIOD_S: f64 = 1e-4;
const WHOLE: FeedforwardGains = FeedforwardGains {
    level: 1.0,
    viscous: 1.0,
    presliding: 1.0,
    inertia_v_s2_per_mm: 0.0,
};

/// The x axis' friction, with another level backwards.
fn friction() -> FrictionSettings {
    let mut friction = x_axis().friction;
    let negative = &mut friction.sliding.negative;
    negative.curve.coulomb_v = 0.10;
    negative.curve.breakaway_v = 0.14;
    negative.viscous_v_s_per_mm = 0.003;
    friction
}

fn build<S: Scalar>(kind: FeedforwardKind, gains: &FeedforwardGains) -> Feedforward<S, 4> {
    Feedforward::build(kind, gains, &friction(), PERIOD_S)
}

/// The terms after a second at constant velocity.
fn settled<S: Scalar>(kind: FeedforwardKind, velocity_mm_s: f64) -> FeedforwardTerms<S> {
    let feedforward = build::<S>(kind, &WHOLE);
    let mut state = FeedforwardState::default();
    let mut terms = FeedforwardTerms::default();
    for _ in 0..10_000 {
        let step = ReferenceStep {
            displacement: S::quantise(velocity_mm_s * PERIOD_S, Quantity::Length),
            velocity: S::quantise(velocity_mm_s, Quantity::Velocity),
            acceleration: S::ZERO,
        };
        terms = feedforward.step(&mut state, step);
    }
    terms
}

fn each_effect_counts_once<S: Scalar>(tolerance_v: f64) {
    let friction = friction().sliding;
    for velocity in [0.5, 1.0, 3.0, 10.0, 40.0, -0.5, -1.0, -3.0, -10.0, -40.0] {
        let (model, sign) = if velocity > 0.0 {
            (friction.positive, 1.0)
        } else {
            (friction.negative, -1.0)
        };
        let volts = |kind| {
            settled::<S>(kind, velocity)
                .total()
                .to_f64(Quantity::Voltage)
        };
        let exact = model.friction_v(velocity);
        for kind in [
            FeedforwardKind::Static,
            FeedforwardKind::Combined,
            FeedforwardKind::Lugre,
            FeedforwardKind::SmoothedGms,
        ] {
            let error = volts(kind) - exact;
            assert!(
                error.abs() < tolerance_v,
                "{kind:?} at {velocity} mm/s: {error} V"
            );
        }
        let dahl = sign * model.curve.coulomb_v + model.viscous_v_s_per_mm * velocity;
        let error = volts(FeedforwardKind::Dahl) - dahl;
        assert!(
            error.abs() < tolerance_v,
            "Dahl at {velocity} mm/s: {error} V"
        );
        let alone = volts(FeedforwardKind::Gms) - sign * model.curve.breakaway_v;
        assert!(
            alone.abs() < tolerance_v,
            "GMS alone at {velocity} mm/s: {alone} V"
        );
        assert_eq!(volts(FeedforwardKind::None), 0.0);
    }
}

#[test]
fn each_effect_counts_once_at_constant_velocity() {
    // The tables' 0.1 % of breakaway.
    each_effect_counts_once::<f64>(1.5e-4);
    each_effect_counts_once::<f32>(1.5e-4);
    each_effect_counts_once::<Fixed>(1.5e-4);
}

#[test]
fn each_kind_has_its_terms_and_no_others() {
    let has = |kind| {
        let terms = settled::<f64>(kind, 5.0);
        (
            terms.level != 0.0,
            terms.presliding != 0.0,
            terms.viscous != 0.0,
        )
    };
    assert_eq!(has(FeedforwardKind::None), (false, false, false));
    assert_eq!(has(FeedforwardKind::Static), (true, false, true));
    assert_eq!(has(FeedforwardKind::Gms), (false, true, false));
    for kind in [
        FeedforwardKind::Combined,
        FeedforwardKind::Dahl,
        FeedforwardKind::Lugre,
        FeedforwardKind::SmoothedGms,
    ] {
        assert_eq!(has(kind), (false, true, true), "{kind:?}");
    }
}

#[test]
fn inertia_acts_with_every_kind() {
    let gains = FeedforwardGains {
        inertia_v_s2_per_mm: 1.0 / 69_390.0,
        ..WHOLE
    };
    for kind in FeedforwardKind::ALL {
        let feedforward = build::<f64>(kind, &gains);
        let step = ReferenceStep {
            displacement: 0.0,
            velocity: 0.0,
            acceleration: 500.0,
        };
        let terms = feedforward.step(&mut FeedforwardState::default(), step);
        assert!((terms.total() - 500.0 / 69_390.0).abs() < 1e-15, "{kind:?}");
    }
}

#[test]
fn elements_take_over_the_force_of_bristles_and_stick() {
    let step = |displacement: f64| ReferenceStep {
        displacement,
        velocity: displacement / PERIOD_S,
        acceleration: 0.0,
    };
    let bristles = build::<f64>(FeedforwardKind::Lugre, &WHOLE);
    let elements = build::<f64>(FeedforwardKind::Combined, &WHOLE);
    let stiffness = friction().gms.stiffness_v_per_mm();
    for sense in [1.0, -1.0] {
        let mut state = FeedforwardState::<f64, 4>::default();
        while state.force().abs() < 0.05 {
            bristles.step(&mut state, step(sense * 1e-5));
        }
        let carried = state.force();
        for displacement in [1e-6, -1e-6] {
            let mut state = state.clone();
            let force = elements.step(&mut state, step(displacement)).presliding;
            assert!((force - carried - stiffness * displacement).abs() < 1e-12);
        }
    }
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn friction_terms_are_bounded_for_any_reference(
        steps in prop::collection::vec((any_f32(), any_f32(), any_f32()), 40),
        kind in prop::sample::select(FeedforwardKind::ALL.to_vec()),
    ) {
        let feedforward = build::<f32>(kind, &WHOLE);
        let mut state = FeedforwardState::default();
        for (displacement, velocity, acceleration) in steps {
            let step = ReferenceStep { displacement, velocity, acceleration };
            let terms = feedforward.step(&mut state, step);
            prop_assert!(terms.level.abs() <= 0.1501, "{terms:?}");
            // LuGre damps its bristles' bending: twice the level over sigma0 Ts / sigma1 in one step.
            let most = if kind == FeedforwardKind::Lugre { 0.5 } else { 0.1501 };
            prop_assert!(terms.presliding.abs() <= most, "{terms:?}");
            prop_assert!(state.force().abs() <= 0.1501, "{terms:?}");
        }
    }
}

/// Volts, as bits, and codes of x over a motion with noise on the counts.
fn record<S: Scalar>(settings: &StageSettings) -> Vec<(u64, DacCode)> {
    let mut rig = Rig::<S>::new(settings, &sine_on_x(1.0, 10.0));
    let mut noise = Noise::new(7);
    rig.start();
    (0..8000)
        .map(|_| {
            let reference = rig.state.axes()[0].telemetry().reference;
            let count = (reference.0 >> 16) + noise.counts(3);
            rig.inputs.set_counts([count as u32, 0, 0]);
            let outputs = rig.tick();
            assert!(outputs.enabled);
            let volts = rig.state.axes()[0].telemetry().output;
            (volts.to_f64(Quantity::Voltage).to_bits(), outputs.codes[0])
        })
        .collect()
}

fn zero_gains_are_off<S: Scalar>() {
    let off = with_x(|axis| axis.feedforward.kind = FeedforwardKind::None);
    let expected = record::<S>(&off);
    for kind in FeedforwardKind::ALL {
        let zero = with_x(|axis| {
            axis.feedforward.kind = kind;
            axis.feedforward.gains = FeedforwardGains {
                level: 0.0,
                viscous: 0.0,
                presliding: 0.0,
                inertia_v_s2_per_mm: 0.0,
            };
        });
        assert!(record::<S>(&zero) == expected, "{kind:?}");
        if kind != FeedforwardKind::None {
            let on = with_x(|axis| axis.feedforward.kind = kind);
            assert!(record::<S>(&on) != expected, "{kind:?} acts with gains");
        }
    }
}

#[test]
fn zero_gains_are_bit_identical_to_off() {
    zero_gains_are_off::<f64>();
    zero_gains_are_off::<f32>();
    zero_gains_are_off::<Fixed>();
}

#[test]
fn preview_shifts_the_feedbacks_reference_by_whole_ticks() {
    let run = |preview_s: f64| {
        let settings = x_alone(|axis| axis.feedforward.preview_s = preview_s);
        let mut rig = Rig::<f64>::new(&settings, &sine_on_x(1.0, 10.0));
        rig.tick();
        rig.command(quadrant_law::command::Command::Enable);
        rig.inputs.command = Some(quadrant_law::command::Command::Run);
        (0..300)
            .map(|_| {
                rig.tick();
                let seen = rig.state.axes()[0].telemetry();
                (seen.reference, seen.feedforward)
            })
            .collect::<Vec<_>>()
    };
    let prompt = run(0.0);
    assert_ne!(prompt[299].0, prompt[298].0, "it moves");
    for (preview_s, ticks) in [
        (1e-4, 1),
        (1.2e-3, 12),
        (1.24e-3, 12),
        (1.26e-3, 13),
        (3.0e-3, 30),
    ] {
        let ahead = run(preview_s);
        for tick in 0..300 {
            assert_eq!(ahead[tick].1, prompt[tick].1, "feedforward of tick {tick}");
            let expected = tick
                .checked_sub(ticks)
                .map_or(Default::default(), |t| prompt[t].0);
            assert_eq!(ahead[tick].0, expected, "{preview_s} s, tick {tick}");
        }
    }
}

#[test]
fn a_stage_at_rest_feeds_nothing_forward() {
    for kind in FeedforwardKind::ALL {
        let settings = with_x(|axis| axis.feedforward.kind = kind);
        let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
        rig.start();
        rig.tick();
        let seen = rig.state.axes()[0].telemetry();
        assert_eq!(seen.feedforward.total(), 0.0, "{kind:?}");
    }
}

/// A stage on three axes stays within the memory of a small target.
#[test]
fn a_stage_of_any_kind_is_small() {
    let stage = size_of::<quadrant_law::stage::Stage<f32>>();
    let state = size_of::<quadrant_law::stage::StageState<f32>>();
    println!("stage {stage} bytes, its state {state} bytes");
    assert!(stage + state < 30 << 10, "{stage} + {state} bytes");
}

/// A path in the plane keeps its shape: an axis whose plant is slower must not drag its reference behind.
#[test]
fn axes_with_different_previews_keep_one_time() {
    let mut settings = StageSettings::simulated();
    for (axis, preview_s) in settings.axes.iter_mut().zip([1.2e-3, 0.0, 1.3e-3]) {
        *axis = quadrant_settings::presets::x_axis();
        axis.feedforward.preview_s = preview_s;
    }
    let sine = sine_on_x(1.0, 10.0).motions[0];
    let plan = PlanSettings {
        motions: [sine, sine, sine],
    };
    let mut rig = Rig::<f32>::new(&settings, &plan);
    rig.start();
    let mut moved = false;
    for tick in 0..400 {
        rig.tick();
        let [x, y, z] = rig
            .state
            .axes()
            .each_ref()
            .map(|axis| axis.telemetry().reference);
        assert!(x == y && y == z, "tick {tick}: {x:?} {y:?} {z:?}");
        moved |= x != Position::ZERO;
    }
    assert!(moved);
}
