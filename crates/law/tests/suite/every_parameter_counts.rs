//! No stored parameter is inert: each changes the outputs, brings about a fault, or decides whether settings and plan
//! are accepted.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::filter::FilterSettings;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::safety::SafetyState;
use quadrant_law::scalar::Scalar;
use quadrant_settings::popov::filtered_sector_bound;
use quadrant_settings::{HomingSettings, StageSettings, TravelSettings};
use serde_json::Value;

use crate::parameter_trace::{Trace, plan, tick_of};
use crate::provocations::provoke;
use quadrant_test_support::{Noise, Rig};

/// A motion both ways with noise, an error beyond emax, a stretch that saturates, a change of settings, and in the end
/// a jump of half a 32-bit counter's range and one beyond the plausible.
fn run<S: Scalar>(settings: &StageSettings, jumping: usize) -> Option<Trace> {
    if settings.validate(4).is_err() || plan().validate(settings).is_err() {
        return None;
    }
    let mut weaker = settings.clone();
    for axis in &mut weaker.axes {
        axis.feedback.pid.kp_v_per_mm *= 0.5;
    }
    let mut rig = Rig::<S>::new(&weaker, &plan());
    let mut noise = Noise::new(11);
    let mut trace = vec![];
    rig.start();
    for tick in 0..3500 {
        if tick == 1000 {
            rig.exchange(settings);
        }
        // mm behind the reference: 0.15 for a while, then almost the following-error limit.
        let lag = match tick {
            0..500 => 0.02,
            500..1500 => 0.02 + 0.13 * f64::from(tick - 500) / 1000.0,
            1500..2000 => 0.15,
            2000..2500 => 0.15 + 0.84 * f64::from(tick - 2000) / 500.0,
            2500..3000 => 0.99,
            _ => 0.99 - 0.9 * f64::from(tick - 3000) / 500.0,
        };
        for index in 0..3 {
            let reference = rig.state.axes()[index].telemetry().reference;
            let count = (reference.0 >> 16) - (lag / 5e-4) as i64 + noise.counts(2);
            rig.inputs.readings[index].count = count as u32;
        }
        trace.push(tick_of(&mut rig));
    }
    // At rest: as far as one tick can plausibly go, then half the counter, then too far.
    for jump in [100, 1 << 31, 103] {
        rig.inputs.readings[jumping].count = rig.inputs.readings[jumping].count.wrapping_add(jump);
        trace.push(tick_of(&mut rig));
    }
    Some((trace, rig.state.safety()))
}

/// The paths of all leaves of a tree.
fn leaves(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            // On an axis of which the runs here know the plant, they act: `learning.rs`, `cancelling.rs`. Pulses act
            // where a board counts them; an offset of a serial encoder, where a board reads one (`absolute_encoder.rs`).
            let known = ["learning", "cancelling", "pulses", "serial", "offset_mm"];
            for (name, value) in fields
                .iter()
                .filter(|(name, _)| !known.contains(&name.as_str()))
            {
                leaves(value, &format!("{path}/{name}"), found);
            }
        }
        Value::Array(items) => {
            for (index, value) in items.iter().enumerate() {
                leaves(value, &format!("{path}/{index}"), found);
            }
        }
        _ => found.push(path.to_owned()),
    }
}

/// A small change to a leaf; some act only as the bound of something else, and need a larger one.
fn perturbed(path: &str, value: &Value) -> Value {
    let field = path.rsplit('/').next().unwrap_or_default();
    match value {
        Value::Bool(flag) => Value::Bool(!flag),
        Value::String(_) if field == "law" => Value::from("pid"),
        Value::String(direction) if direction == "negative" => Value::from("positive"),
        Value::String(switch) if switch == "home" => Value::from("limit"),
        Value::String(reaction) if reaction == "stop" => Value::from("hold"),
        Value::String(reaction) if reaction == "off" => Value::from("stop"),
        Value::String(_) if field == "enabled_by" => Value::from("host"),
        Value::String(_) if field == "host_needed" => Value::from("endless-motion"),
        Value::String(kind) => Value::from(if kind == "static" { "gms" } else { "static" }),
        // Left out by default: with it, the plan waits for homing.
        Value::Null if field == "unhomed_mm_s" => Value::from(10.0),
        Value::Null => panic!("{path} is not set by default"),
        Value::Number(number) if number.is_u64() => Value::from(number.as_u64().expect("u64") - 1),
        Value::Number(number) => {
            let number = number.as_f64().expect("a number");
            Value::from(match field {
                // The plant only bounds what others may be: Popov's gain and the stiffness.
                "gain_mm_per_v_s2" | "delay_s" => number * 2.0,
                "damping_per_s" => 0.0,
                "stiffness_per_s2" => 1e6,
                // Whole ticks count.
                "preview_s" | "debounce_s" => number * 0.9,
                // The first stroke is long and fast, whatever it is; the second is not.
                "from_mm" | "from_mm_s" => 50.0,
                _ if number == 0.0 => 1e-3,
                _ => number * 0.97,
            })
        }
        _ => unreachable!("{path} is no leaf"),
    }
}

/// The parameters that change nothing, of those whose path is of interest.
fn inert(base: &StageSettings, of_interest: impl Fn(&str) -> bool) -> Vec<String> {
    let tree = serde_json::to_value(base).expect("plain data");
    let mut paths = vec![];
    leaves(&tree, "", &mut paths);
    assert!(paths.len() > 100, "{} leaves", paths.len());
    let unchanged = [0, 1, 2].map(|axis| run::<f32>(base, axis).expect("valid"));
    let provoked = [0, 1, 2].map(|axis| provoke(base, axis));
    paths
        .into_iter()
        .filter(|path| of_interest(path))
        .filter(|path| {
            let mut tree = tree.clone();
            let leaf = tree.pointer_mut(path).expect("a leaf");
            *leaf = perturbed(path, leaf);
            let settings: StageSettings = serde_json::from_value(tree).expect("the same shape");
            assert_ne!(settings, *base, "{path} changed");
            let axis = path
                .strip_prefix("/axes/")
                .and_then(|rest| rest[..1].parse().ok());
            let axis = axis.unwrap_or(0);
            run::<f32>(&settings, axis).is_some_and(|trace| trace == unchanged[axis])
                && provoke(&settings, axis) == provoked[axis]
        })
        .collect()
}

fn with_kind(kind: FeedforwardKind) -> StageSettings {
    let mut settings = StageSettings::simulated();
    for axis in &mut settings.axes {
        axis.feedforward.kind = kind;
        // Low enough for the stretch with a large error to saturate, and the integral to reach its limit.
        axis.amplifier.output_limit_v = 1.5;
        axis.feedback.integral_limit_v = 0.05;
        // Within reach of the provocations.
        axis.limits.following_error_lag_s = 5e-3;
        axis.limits.following_error_max_mm = 1.1;
        axis.limits.travel_mm = Some(TravelSettings {
            negative: -0.3,
            positive: 0.3,
        });
        axis.encoder.counts_per_index = Some(20);
        axis.homing = Some(HomingSettings {
            search_mm_s: 2.0,
            latch_mm_s: 0.5,
            debounce_s: 1e-3,
            mark_mm: -0.1,
            park_mm: 0.05,
            travel_mm: 0.2,
            ..axis.homing.expect("by default")
        });
        let filters = [FilterSettings {
            frequency_hz: 900.0,
            damping: 0.3,
            centre_gain: 0.3,
            high_frequency_gain: 0.9,
        }];
        axis.feedback.filters = Some(filters.into_iter().collect());
        // As much nonlinear gain as the plant allows, so that less damping allows less.
        let plant = axis.plant.expect("a plant by default");
        let period_s = 1.0 / settings.rate_hz;
        let bound = filtered_sector_bound(&plant, &axis.feedback.pid, &filters, period_s);
        let gain = axis
            .feedback
            .nonlinear
            .as_mut()
            .expect("an N-PID by default");
        gain.rate_per_mm = (0.999 * bound).acosh() / gain.range_mm;
    }
    settings
}

/// Parameters of a law that does not act.
fn is_of_another_law(path: &str) -> bool {
    ["schedule", "cascade", "sliding_mode", "nctf"]
        .iter()
        .any(|law| path.contains(&format!("/feedback/{law}/")))
}

/// Parameters of the load, which by default nobody watches.
fn is_of_the_load(path: &str) -> bool {
    path.ends_with("/continuous_v") || path.ends_with("/overload_s")
}

/// Paths of the fields that act with one kind of feedforward alone, below each axis.
const OF_ONE_KIND: [(FeedforwardKind, &[&str]); 4] = [
    (FeedforwardKind::Static, &["feedforward/gains/level"]),
    (
        FeedforwardKind::Dahl,
        &["friction/dahl/exponent", "friction/dahl/stiffness_v_per_mm"],
    ),
    (
        FeedforwardKind::Lugre,
        &[
            "friction/lugre/damping_v_s_per_mm",
            "friction/lugre/stiffness_v_per_mm",
        ],
    ),
    (
        FeedforwardKind::SmoothedGms,
        &["friction/smoothed_gms/width"],
    ),
];

fn on_each_axis(fields: &[&str]) -> Vec<String> {
    let paths = |axis| {
        fields
            .iter()
            .map(move |field| format!("/axes/{axis}/{field}"))
    };
    (0..3).flat_map(paths).collect()
}

#[test]
fn every_parameter_acts_with_combined_feedforward_or_with_its_own_kind() {
    let other_laws = |path: &str| !is_of_another_law(path) && !is_of_the_load(path);
    let mut combined = inert(&with_kind(FeedforwardKind::Combined), other_laws);
    let mut others: Vec<String> = OF_ONE_KIND
        .iter()
        .flat_map(|(_, fields)| on_each_axis(fields))
        // An exponent below one is refused, for every kind.
        .filter(|path| !path.ends_with("exponent"))
        .collect();
    combined.sort();
    others.sort();
    assert_eq!(combined, others);
    for (kind, fields) in OF_ONE_KIND {
        let mut base = with_kind(kind);
        for axis in &mut base.axes {
            let dahl = axis.friction.dahl.as_mut().expect("by default");
            dahl.exponent = 1.5;
        }
        let inert = inert(&base, other_laws);
        for path in on_each_axis(fields) {
            assert!(!inert.contains(&path), "{kind:?}: {path}");
        }
    }
}

#[test]
fn every_parameter_of_a_law_acts_where_the_law_does() {
    for (law, field) in [
        (LawKind::Scheduled, "schedule"),
        (LawKind::Cascade, "cascade"),
        (LawKind::SlidingMode, "sliding_mode"),
        (LawKind::Nctf, "nctf"),
    ] {
        let mut settings = with_kind(FeedforwardKind::Combined);
        for axis in &mut settings.axes {
            axis.feedback.law = law;
            // Within reach of the scenario: the integrals, the limits, a knee.
            let feedback = &mut axis.feedback;
            let cascade = feedback.cascade.as_mut().expect("by default");
            cascade.velocity_limit_mm_s = 40.0;
            cascade.velocity_feedforward = 0.9;
            let sliding = feedback.sliding_mode.as_mut().expect("by default");
            sliding.boundary_mm_s *= 0.5 / sliding.switching_v;
            sliding.switching_v = 0.5;
            let nctf = feedback.nctf.as_mut().expect("by default");
            nctf.characteristic[0].error_mm *= 0.1;
            nctf.characteristic[0].velocity_mm_s *= 0.1;
        }
        for axis in 0..3 {
            let own = format!("/axes/{axis}/feedback/{field}/");
            let idle = inert(&settings, |path| path.starts_with(&own));
            // The first point of a schedule is at rest, in every variant.
            assert!(idle.is_empty(), "{idle:?}");
        }
    }
}

#[test]
fn every_parameter_of_the_load_acts_where_it_is_watched() {
    let mut settings = with_kind(FeedforwardKind::Combined);
    for axis in &mut settings.axes {
        axis.amplifier.continuous_v = 1.0;
        axis.amplifier.overload_s = 0.25;
        // Later than the load.
        axis.limits.silent_s = 10.0;
    }
    let idle = inert(&settings, is_of_the_load);
    assert!(idle.is_empty(), "{idle:?}");
}

/// The weights act on the outputs too, not only through their sum.
#[test]
fn each_weight_acts() {
    let base = with_kind(FeedforwardKind::Combined);
    let unchanged = run::<f32>(&base, 0);
    for axis in 0..3 {
        for element in 0..4 {
            let mut settings = base.clone();
            let elements = &mut settings.axes[axis].friction.gms.elements;
            elements[element].weight -= 0.01;
            elements[(element + 1) % 4].weight += 0.01;
            let trace = run::<f32>(&settings, 0);
            assert!(
                trace.is_some() && trace != unchanged,
                "axis {axis}, element {element}"
            );
        }
    }
}

#[test]
fn the_scenario_saturates_and_ends_in_the_jump() {
    let (trace, end) = run::<f32>(&with_kind(FeedforwardKind::Combined), 1).expect("valid");
    assert!(matches!(end, SafetyState::Faulted(_)), "{end:?}");
    let full = 1.5f32.to_bits();
    let limit = f64::from(f32::from_bits(full)).to_bits();
    assert!(
        trace.iter().any(|(volts, _)| volts[0] == limit),
        "it saturates"
    );
    let driven = trace.iter().filter(|(_, codes)| *codes != [0; 3]).count();
    assert!(driven > 3490, "{driven} ticks are driven");
}
