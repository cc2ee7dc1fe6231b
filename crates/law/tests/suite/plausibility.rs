//! The comparison of encoder and plant, against its definition in seconds, volts and millimetres.
//!
//! The expectation is integrated here in f64 from the description: no line of it is shared with the law.

use quadrant_fault_bench::noise::Noise;
use quadrant_fault_bench::plant::{MODEL, Plant, Truth};
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::reference::Velocity;
use quadrant_law::safety::FaultCode;
use quadrant_law::safety::plausibility::{
    OutputScale, Plausibility, PlausibilityModel, PlausibilityState, Shown,
};
use quadrant_law::units::DacCode;
use quadrant_settings::StageSettings;

use quadrant_test_support::Rig;

const PERIOD_S: f64 = 1e-4;
const COUNT_MM: f64 = 5e-4;
/// Ticks from one comparison to the next.
const INTERVAL: u32 = 4;
/// The same in seconds.
const INTERVAL_S: f64 = INTERVAL as f64 * PERIOD_S;
/// Time in which a distance is forgotten: the largest power of two of comparisons within 0.3 s.
const FORGET_S: f64 = 512.0 * INTERVAL_S;
/// Time by which the filtered speed lags: its 8 ticks, and half an interval.
const FILTER_S: f64 = 10.0 * PERIOD_S;
/// A filtered speed of 1 mm/s.
const SPEED: f64 = PERIOD_S / COUNT_MM * 256.0;

const AMPLIFIERS: [OutputScale; 3] = [
    OutputScale {
        per_volt: DacCode::FULL_SCALE / 10.0,
        offset: 0,
    },
    OutputScale {
        per_volt: DacCode::FULL_SCALE / 10.0,
        offset: 250,
    },
    OutputScale {
        per_volt: -1638.35,
        offset: -40,
    },
];

/// More than any output.
const NEVER_V: f64 = 1e6;

fn model() -> PlausibilityModel {
    PlausibilityModel {
        gain_mm_per_v_s2: 2000.0,
        damping_per_s: 20.0,
        delay_s: 1e-3,
        limit_v: 10.0,
        largest_mm_s: 300.0,
        held_v: 0.6,
        eased_v: 0.0,
        regained_v: 0.0,
        // Of no concern, but to those that set them.
        stuck_v: NEVER_V,
        sliding_v: NEVER_V,
        turned_v: NEVER_V,
        most_turned_v: 1.5 * NEVER_V,
        answer_v_per_mm: 0.0,
        answer_v_s_per_mm: 0.0,
        turn_mm: 0.032,
        alive_mm: 0.032,
        ahead_mm: 0.2,
        breakaway_v: 0.8,
        load_v: 3.0,
        first_load_v: 1.0,
        proving_mm: 1e9,
        distance_mm: 0.3,
        velocity_mm_s: 60.0,
    }
}

/// Shows comparisons until one fails; gives the time, s, at most 3.
fn time_until_found(
    plausibility: &Plausibility,
    words: OutputScale,
    open: bool,
    volts: impl Fn(f64) -> f64,
    motion: impl Fn(f64) -> (f64, f64),
) -> Option<f64> {
    let mut state = PlausibilityState::default();
    let mut sum = 0_i32;
    for tick in 1..30_000_u32 {
        let time_s = f64::from(tick) * PERIOD_S;
        let word = (volts(time_s) * words.per_volt).round() as i32 + words.offset;
        sum = sum.wrapping_add(word);
        if !tick.is_multiple_of(INTERVAL) {
            continue;
        }
        let (position_mm, velocity_mm_s) = motion(time_s);
        let shown = Shown {
            count: (position_mm / COUNT_MM).round() as i32,
            speed: (velocity_mm_s * SPEED).round() as i32,
            words: sum,
            reference: 0,
            open,
            excited: open,
        };
        if !plausibility.step(&mut state, shown) {
            return Some(time_s);
        }
    }
    None
}

/// Steps of an interval until `step` says that it is found; gives the time, s.
fn expected(mut step: impl FnMut(f64) -> bool) -> Option<f64> {
    (1..7500)
        .map(|index| f64::from(index) * INTERVAL_S)
        .find(|&time_s| step(time_s))
}

/// The model of an axis that stands.
#[derive(Default)]
struct Standing {
    velocity_mm_s: f64,
    distance_mm: f64,
}

impl Standing {
    /// Goes on for an interval under the voltage that friction does not take up; true when it has gone the distance.
    fn goes_too_far(&mut self, model: &PlausibilityModel, beyond_v: f64) -> bool {
        let gain = model.gain_mm_per_v_s2;
        if beyond_v == 0.0 {
            let speed = self.velocity_mm_s.abs() - gain * model.held_v * INTERVAL_S;
            self.velocity_mm_s = speed.max(0.0) * self.velocity_mm_s.signum();
        } else {
            self.velocity_mm_s +=
                (gain * beyond_v - model.damping_per_s * self.velocity_mm_s) * INTERVAL_S;
        }
        self.distance_mm += (self.velocity_mm_s - self.distance_mm / FORGET_S) * INTERVAL_S;
        self.distance_mm.abs() > model.distance_mm
    }
}

fn near(what: &str, found: Option<f64>, expected: Option<f64>) {
    match (found, expected) {
        (Some(found), Some(expected)) => assert!(
            (found - expected).abs() <= 0.02 * expected + 2.0 * INTERVAL_S,
            "{what}: {found} s, expected {expected} s"
        ),
        _ => assert_eq!(found, expected, "{what}"),
    }
}

#[test]
fn an_axis_without_a_model_has_its_budget_in_volt_seconds_in_open_loop_and_none_in_closed_loop() {
    for words in AMPLIFIERS {
        for (budget_v_s, breakaway_v, volts) in [
            (0.02, 0.5, 1.0),
            (0.02, 0.5, -1.0),
            (0.05, 0.2, 3.0),
            (0.05, 0.0, 0.4),
            (0.02, 0.5, 0.49),
            // As much is forgotten in time as comes: it is never spent.
            (0.2, 0.5, 0.9),
        ] {
            let axis = Plausibility::without_model(budget_v_s, breakaway_v, words, PERIOD_S);
            let mut spent = 0.0;
            let beyond = (f64::abs(volts) - breakaway_v).max(0.0);
            let budget = expected(|_| {
                spent += (beyond - spent / FORGET_S) * INTERVAL_S;
                spent > budget_v_s
            });
            let what = format!("{words:?}, {budget_v_s} V s, {volts} V of {breakaway_v}");
            let stands = |_| (0.0, 0.0);
            let found = |open| time_until_found(&axis, words, open, |_| volts, stands);
            near(&what, found(true), budget);
            assert_eq!(found(false), None, "{what}");
        }
    }
}

/// Levels that change every 8 ms, as those of the motor test.
fn levels(time_s: f64) -> f64 {
    if (time_s / 0.016).fract() < 0.5 {
        1.0
    } else {
        0.4
    }
}

#[test]
fn without_a_model_friction_that_holds_an_axis_is_no_dead_encoder_while_the_axis_yields_to_each_change_of_the_voltage()
 {
    for words in AMPLIFIERS {
        let axis = Plausibility::without_model(8e-3, 0.2, words, PERIOD_S);
        // Stiffness of friction 80 V/mm: 15 counts a volt beyond 0.4 V.
        for (sign, yields_mm_per_v, found) in [
            (1.0, 1.0 / 80.0, false),
            (-1.0, 1.0 / 80.0, false),
            (1.0, 0.0, true),
        ] {
            let volts = |time_s| sign * levels(time_s);
            let motion = |time_s: f64| (yields_mm_per_v * volts((time_s - 1e-3).max(0.0)), 0.0);
            let fault = time_until_found(&axis, words, true, volts, motion);
            assert_eq!(
                fault.is_some(),
                found,
                "{sign}, {yields_mm_per_v} mm/V: {fault:?}"
            );
        }
    }
}

#[test]
fn without_a_model_an_encoder_that_dies_at_speed_is_found_when_a_motion_is_old_and_the_budget_spent()
 {
    const DIES_S: f64 = 0.5;
    const ALIVE_S: f64 = 0.025;
    for words in AMPLIFIERS {
        for volts in [0.5, -1.0, 3.0] {
            let (budget_v_s, breakaway_v) = (8e-3, 0.2);
            let axis = Plausibility::without_model(budget_v_s, breakaway_v, words, PERIOD_S);
            let motion = |time_s: f64| (20.0 * volts * time_s.min(DIES_S), 0.0);
            let found = time_until_found(&axis, words, true, |_| volts, motion);
            let expected = DIES_S + ALIVE_S + budget_v_s / (volts.abs() - breakaway_v);
            let late_s = found.expect("found") - expected;
            assert!(late_s.abs() < 3e-3, "{words:?}, {volts} V: {late_s} s late");
        }
    }
}

#[test]
fn an_encoder_that_stands_is_found_when_the_model_has_gone_the_distance() {
    let model = model();
    for words in AMPLIFIERS {
        let axis = Plausibility::new(&model, words, COUNT_MM, PERIOD_S);
        for open in [true, false] {
            for volts in [0.55, 0.7, 1.0, -1.5, 4.0] {
                let (mut force, mut standing) = (0.0_f64, Standing::default());
                let found = expected(|_| {
                    force += (volts - force) * INTERVAL_S / (model.delay_s + FILTER_S);
                    let beyond = |limit: f64| (force.abs() - limit).max(0.0) * force.signum();
                    let mut moves = beyond(model.held_v);
                    if open && moves == 0.0 {
                        moves = beyond(model.breakaway_v);
                    }
                    standing.goes_too_far(&model, moves)
                });
                let what = format!("{words:?}, {volts} V, open: {open}");
                let stands = |_| (0.0, 0.0);
                near(
                    &what,
                    time_until_found(&axis, words, open, |_| volts, stands),
                    found,
                );
            }
        }
    }
}

/// So pushes a PID whose derivative answers every count of a fast axis.
#[test]
fn short_pushes_of_an_axis_that_friction_stops_after_each_do_not_add_up() {
    const EVERY_S: f64 = 0.01;
    let model = model();
    for words in AMPLIFIERS {
        let axis = Plausibility::new(&model, words, COUNT_MM, PERIOD_S);
        for (push_v, lasts_s) in [(9.0, 4e-4), (-9.0, 4e-4), (4.0, 8e-4), (-4.0, 3.6e-3)] {
            let volts = |time_s: f64| {
                let is_pushed = (time_s + 0.5 * PERIOD_S) % EVERY_S < lasts_s;
                if is_pushed { push_v } else { 0.0 }
            };
            let (mut force, mut standing) = (0.0_f64, Standing::default());
            let found = expected(|now_s| {
                let ticks = (0..INTERVAL).map(|tick| volts(now_s - f64::from(tick) * PERIOD_S));
                let mean_v = ticks.sum::<f64>() / f64::from(INTERVAL);
                force += (mean_v - force) * INTERVAL_S / (model.delay_s + FILTER_S);
                let beyond = (force.abs() - model.held_v).max(0.0) * force.signum();
                standing.goes_too_far(&model, beyond)
            });
            let what = format!("{words:?}, {push_v} V for {lasts_s} s");
            let stands = |_| (0.0, 0.0);
            let seen = time_until_found(&axis, words, false, volts, stands);
            near(&what, seen, found);
            assert_eq!(seen.is_none(), lasts_s < 1e-3, "{what}");
        }
    }
}

#[test]
fn a_force_that_falls_towards_zero_while_an_axis_stands_is_friction_that_eases() {
    const STOPS_S: f64 = 0.5;
    // Friction that eases takes nothing up of a force that rises.
    for (eased_v, falls_v_per_s) in [(0.0, 2.0), (1.5, 2.0), (1.5, -2.0)] {
        let model = PlausibilityModel {
            eased_v,
            regained_v: 0.1,
            load_v: NEVER_V,
            first_load_v: NEVER_V,
            ..model()
        };
        // From below what may ease, and from above it; a gain that the amplifier reverses, too.
        for (words, level_v) in AMPLIFIERS
            .into_iter()
            .flat_map(|words| [1.2_f64, -1.2, 2.5].map(|level_v| (words, level_v)))
        {
            let axis = Plausibility::new(&model, words, COUNT_MM, PERIOD_S);
            let volts = |time_s: f64| {
                let fallen_v = falls_v_per_s * (time_s - STOPS_S).max(0.0);
                level_v - fallen_v * level_v.signum()
            };
            // One that a load holds moves on whatever its voltage is.
            let creeps = |time_s: f64| (2.0 * time_s.min(STOPS_S), 0.0);
            let (mut force, mut standing) = (0.0_f64, Standing::default());
            let found = expected(|now_s| {
                force += (volts(now_s) - force) * INTERVAL_S / (model.delay_s + FILTER_S);
                if now_s < STOPS_S {
                    return false;
                }
                let fallen = (level_v - force) * level_v.signum();
                // All of 1.2 V, and 1.5 V of 2.5, and a little beyond.
                let taken = match (eased_v > 0.0 && fallen > 0.0, level_v.abs() > 2.0) {
                    (false, _) => model.held_v,
                    (true, false) => 1.2 + model.regained_v,
                    (true, true) => 1.5 + model.regained_v,
                };
                standing.goes_too_far(&model, (fallen.abs() - taken).max(0.0))
            });
            let seen = time_until_found(&axis, words, false, volts, creeps);
            let what = format!("{words:?}, {level_v} V, {eased_v} V, {falls_v_per_s} V/s");
            near(&what, seen, found);
        }
    }
}

#[test]
fn an_axis_whose_friction_eased_is_held_on_the_other_side_of_zero_while_the_reference_stands() {
    for (regained_v, crosses_v) in [(0.1, 0.09), (0.1, 0.3), (0.0, 0.09)] {
        let model = PlausibilityModel {
            eased_v: 1.5,
            regained_v,
            ..model()
        };
        for (words, level_v) in AMPLIFIERS
            .into_iter()
            .flat_map(|words| [0.65_f64, -0.65].map(|level_v| (words, level_v)))
        {
            let axis = Plausibility::new(&model, words, COUNT_MM, PERIOD_S);
            let crossed_v = -crosses_v * level_v.signum();
            let volts = |time_s: f64| if time_s < 0.5 { level_v } else { crossed_v };
            let creeps = |time_s: f64| (2.0 * time_s.min(0.5), 0.0);
            let found = time_until_found(&axis, words, false, volts, creeps);
            assert_eq!(found.is_none(), crosses_v < regained_v, "{crosses_v} V");
        }
    }
}

#[test]
fn a_speed_that_no_load_explains_is_found_when_it_has_gained_the_bound() {
    let model = model();
    for (proving_mm, load_v) in [(1e9, model.first_load_v), (0.0, model.load_v)] {
        let model = PlausibilityModel {
            proving_mm,
            ..model
        };
        for words in AMPLIFIERS {
            let axis = Plausibility::new(&model, words, COUNT_MM, PERIOD_S);
            for (volts, acceleration) in [
                (0.0, 8000.0),
                (0.0, -12_000.0),
                (0.5, 12_000.0),
                (-0.5, 9000.0),
                (2.0, -9000.0),
                (0.0, 1500.0),
            ] {
                let speed_at = |time_s: f64| (acceleration * time_s).clamp(-290.0, 290.0);
                let (mut force, mut least, mut most) = (0.0_f64, 0.0_f64, 0.0_f64);
                let found = expected(|time_s| {
                    let speed = speed_at(time_s);
                    force += (volts - force) * INTERVAL_S / (model.delay_s + FILTER_S);
                    let load = load_v + force.abs() * (0.25 + 0.0625);
                    let push = |volts: f64| model.gain_mm_per_v_s2 * volts * INTERVAL_S;
                    let gained = push(force) - model.damping_per_s * speed * INTERVAL_S;
                    let (low, high) = (least + gained - push(load), most + gained + push(load));
                    let gap = (low - speed).max(speed - high);
                    (least, most) = (low.max(speed), high.min(speed));
                    gap > model.velocity_mm_s
                });
                let what =
                    format!("{words:?}, {volts} V, {acceleration} mm/s2, {load_v} V of load");
                let moves = |time_s: f64| {
                    // Far enough in the first comparison, where that is asked for.
                    let way = if proving_mm == 0.0 { 1.0 } else { 0.0 };
                    (way + 0.5 * acceleration * time_s * time_s, speed_at(time_s))
                };
                near(
                    &what,
                    time_until_found(&axis, words, false, |_| volts, moves),
                    found,
                );
            }
        }
    }
}

/// The stage with a plant as its x axis, whose counter began at `origin`.
struct Moved {
    rig: Rig<f32>,
    plant: Plant,
    origin: i64,
}

impl Moved {
    fn new(truth: &Truth, origin: i64) -> Self {
        Self {
            rig: Rig::with_plant(&StageSettings::simulated(), &Default::default()),
            plant: Plant::new(truth),
            origin,
        }
    }

    fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            let count = (self.plant.position_mm / COUNT_MM).floor() as i64 + self.origin;
            self.rig.inputs.readings[0].count = count as u32;
            let outputs = self.rig.tick();
            let volts = outputs.codes[0].to_volts(10.0);
            self.plant.step(if outputs.enabled { volts } else { 0.0 });
        }
    }

    fn command(&mut self, command: Command) {
        self.rig.inputs.command = Some(command);
        self.run(1);
    }

    fn fault(&self) -> Option<FaultCode> {
        self.rig.state.safety().fault().map(|fault| fault.code)
    }
}

#[test]
fn an_axis_that_is_enabled_again_is_compared_from_then_on() {
    let mut axis = Moved::new(&MODEL, 1_000_000);
    axis.run(100);
    for _ in 0..4 {
        axis.command(Command::Enable);
        axis.plant.load_v = 0.4;
        axis.run(5000);
        assert_eq!(axis.fault(), None);
        assert!(axis.rig.state.safety().is_enabled());
        axis.command(Command::Disable);
        axis.plant.load_v = 0.0;
        axis.run(500);
    }
}

#[test]
fn a_wrong_sign_is_found_as_soon_wherever_the_counter_began() {
    let reversed = Truth {
        reversed: true,
        ..MODEL
    };
    let found = [0, 1_000_000, -40_000_000].map(|origin| {
        let mut axis = Moved::new(&reversed, origin);
        axis.run(100);
        axis.command(Command::Enable);
        axis.run(100);
        let scale = StageSettings::simulated().motion_scale(0);
        axis.command(Command::Jog(AxisName::X, Velocity::from_mm_s(20.0, scale)));
        let ticks = (0..3000)
            .find(|_| {
                axis.run(1);
                axis.fault().is_some()
            })
            .expect("found");
        assert_eq!(axis.fault(), Some(FaultCode::EncoderImplausible));
        ticks
    });
    assert_eq!(found, [found[0]; 3]);
}

#[test]
fn an_axis_whose_encoder_is_not_plausible_is_homed_no_longer() {
    for (truth, homed) in [
        (MODEL, true),
        (
            Truth {
                reversed: true,
                ..MODEL
            },
            false,
        ),
    ] {
        let mut axis = Moved::new(&truth, 0);
        axis.run(100);
        axis.rig.state.set_homed(AxisName::X, true);
        axis.command(Command::Enable);
        axis.run(100);
        let scale = StageSettings::simulated().motion_scale(0);
        axis.command(Command::Jog(AxisName::X, Velocity::from_mm_s(20.0, scale)));
        axis.run(3000);
        assert_eq!(axis.fault().is_none(), homed);
        assert_eq!(axis.rig.state.axes()[0].is_homed(), homed);
    }
}

/// Time, s, at most 0.1, until an axis is found that speeds up at 8000 mm/s^2 without a voltage, and whose count stands at `count`
/// when the memory begins, at another place afterwards if it is given one, and `first` counts on from the first comparison.
fn gain_found_s(axis: &Plausibility, count: i32, moved_to: Option<i32>, first: i32) -> Option<f64> {
    let shown = |count: i32, speed_mm_s: f64| Shown {
        count,
        speed: (speed_mm_s * SPEED).round() as i32,
        words: 0,
        reference: 0,
        open: false,
        excited: false,
    };
    let mut state = axis.start(shown(count, 0.0));
    if let Some(count) = moved_to {
        state.recount(count);
    }
    let count = moved_to.unwrap_or(count).wrapping_add(first);
    (1..250)
        .map(|index| f64::from(index) * INTERVAL_S)
        .find(|time_s| !axis.step(&mut state, shown(count, 8000.0 * time_s)))
}

#[test]
fn the_first_motion_is_what_the_axis_has_gone_since_it_was_enabled_wherever_its_counter_stands() {
    // 0.5 mm: 1000 counts. Until then 1 V of load is believed, and 3 V afterwards.
    let model = PlausibilityModel {
        proving_mm: 0.5,
        ..model()
    };
    let axis = Plausibility::new(&model, AMPLIFIERS[0], COUNT_MM, PERIOD_S);
    let [at_first, later] = [0, 5000].map(|first| gain_found_s(&axis, 0, None, first));
    assert!(
        at_first.is_some() && at_first < later,
        "{at_first:?}, {later:?}"
    );
    for count in [0, 1_000_000, -40_000_000, i32::MAX] {
        for moved_to in [None, Some(0), Some(77), Some(-1_000_000)] {
            let what = format!("{count}, {moved_to:?}");
            let found = |first| gain_found_s(&axis, count, moved_to, first);
            for first in [0, 1000, -1000] {
                assert_eq!(found(first), at_first, "{what}, {first}");
            }
            for first in [1001, -1001] {
                assert_eq!(found(first), later, "{what}, {first}");
            }
        }
    }
}

#[test]
fn two_counts_to_and_fro_are_no_motion() {
    let axis = Plausibility::new(&model(), AMPLIFIERS[0], COUNT_MM, PERIOD_S);
    let found = |counts: f64| {
        let moves = |time_s: f64| {
            let forth = (time_s / INTERVAL_S).round() as i32 % 2 == 1;
            (if forth { counts * COUNT_MM } else { 0.0 }, 0.0)
        };
        // As much as a load may hold.
        time_until_found(&axis, AMPLIFIERS[0], true, |_| 1.0, moves)
    };
    let stands = found(0.0);
    assert!(stands.is_some());
    for counts in [1.0, -1.0, 2.0, -2.0] {
        assert_eq!(found(counts), stands, "{counts}");
    }
    for counts in [3.0, -3.0] {
        assert_eq!(found(counts), None, "{counts}");
    }
}

#[test]
fn a_loop_that_is_opened_begins_its_standstill_anew() {
    let axis = Plausibility::new(&model(), AMPLIFIERS[0], COUNT_MM, PERIOD_S);
    let word = (0.7 * AMPLIFIERS[0].per_volt).round() as i32 * INTERVAL as i32;
    let found_after = |before: u32, forgets: bool| {
        let mut state = PlausibilityState::default();
        let mut shown = Shown {
            count: 0,
            speed: 0,
            words: 0,
            reference: 0,
            open: false,
            excited: false,
        };
        let mut step = |state: &mut PlausibilityState| {
            shown.words = shown.words.wrapping_add(word);
            axis.step(state, shown)
        };
        for _ in 0..before {
            assert!(step(&mut state));
        }
        if forgets {
            state.forget_standstill();
        }
        (0..1000).find(|_| !step(&mut state)).expect("found")
    };
    let restarted = found_after(30, true);
    assert_eq!(found_after(100, true), restarted);
    assert!(found_after(30, false) < restarted);
    assert!(found_after(100, false) < found_after(30, false));
}

#[test]
fn a_spent_budget_says_nothing_of_a_closed_loop() {
    let axis = Plausibility::without_model(0.02, 0.5, AMPLIFIERS[0], PERIOD_S);
    let mut state = PlausibilityState::default();
    let mut shown = Shown {
        count: 0,
        speed: 0,
        words: 0,
        reference: 0,
        open: true,
        excited: true,
    };
    let word = 3 * AMPLIFIERS[0].per_volt as i32 * INTERVAL as i32;
    for _ in 0..1000 {
        shown.words += word;
        if !axis.step(&mut state, shown) {
            break;
        }
    }
    shown.words += word;
    assert!(!axis.step(&mut state, shown));
    shown.open = false;
    shown.words += word;
    assert!(axis.step(&mut state, shown));
}

/// A jog, in which the axis follows for 0.3 s under the voltage at which it slides, and then shows what `motion` gives, mm since,
/// while the voltage grows by so many V/s. Gives the time from then until it is found, s, at most 2.
fn found_in_jog(
    model: &PlausibilityModel,
    jog_mm_s: f64,
    growth_v_per_s: f64,
    motion: impl FnMut(f64) -> f64,
) -> Option<f64> {
    let slides_v = SLIDES_V * jog_mm_s.signum();
    found_after(model, jog_mm_s, slides_v, growth_v_per_s, motion)
}

/// The same of an axis that slides at another voltage.
fn found_after(
    model: &PlausibilityModel,
    jog_mm_s: f64,
    slides_v: f64,
    growth_v_per_s: f64,
    mut motion: impl FnMut(f64) -> f64,
) -> Option<f64> {
    let axis = Plausibility::new(model, AMPLIFIERS[0], COUNT_MM, PERIOD_S);
    let mut state = PlausibilityState::default();
    let (mut sum, mut speed) = (0_i32, 0.0);
    let mut before_mm = 0.0;
    for tick in 1..23_000_u32 {
        let since_s = f64::from(tick) * PERIOD_S - SLIDES_S;
        let volts = slides_v + growth_v_per_s * since_s.max(0.0);
        sum = sum.wrapping_add((volts * AMPLIFIERS[0].per_volt).round() as i32);
        let position_mm = if since_s < 0.0 {
            jog_mm_s * (SLIDES_S + since_s)
        } else {
            jog_mm_s * SLIDES_S + motion(since_s)
        };
        let count = (position_mm / COUNT_MM).round();
        speed += (256.0 * (count - before_mm) - speed) / 8.0;
        before_mm = count;
        let shown = Shown {
            count: count as i32,
            speed: speed as i32,
            words: sum,
            reference: (jog_mm_s * (SLIDES_S + since_s) / COUNT_MM * 256.0).round() as i32,
            open: false,
            excited: false,
        };
        if tick.is_multiple_of(INTERVAL) && !axis.step(&mut state, shown) {
            return Some(since_s);
        }
    }
    None
}

/// Voltage at which the axis of these jogs slides, V.
const SLIDES_V: f64 = 0.2;
/// Time for which it slides, s.
const SLIDES_S: f64 = 0.3;

fn following_model() -> PlausibilityModel {
    PlausibilityModel {
        held_v: NEVER_V,
        eased_v: 0.0,
        regained_v: 0.0,
        load_v: NEVER_V,
        first_load_v: NEVER_V,
        sliding_v: 0.1,
        turned_v: 0.5,
        most_turned_v: 1.5 * 0.5,
        ..model()
    }
}

/// The time in which a model that nothing holds but `taken_v` has gone the distance under a growing voltage, s.
fn expected_in_jog(model: &PlausibilityModel, growth_v_per_s: f64, taken_v: f64) -> Option<f64> {
    let (mut force, mut velocity, mut ahead) = (0.0, 0.0, 0.0);
    expected(|time_s| {
        force += (growth_v_per_s * time_s - force) * INTERVAL_S / (model.delay_s + FILTER_S);
        let excess: f64 = force - taken_v;
        ahead -= ahead * INTERVAL_S / FORGET_S;
        if excess > 0.0 {
            velocity +=
                (model.gain_mm_per_v_s2 * excess - model.damping_per_s * velocity) * INTERVAL_S;
            ahead += velocity * INTERVAL_S;
        }
        ahead > model.ahead_mm
    })
}

#[test]
fn counts_that_flicker_or_go_astray_do_not_hide_that_the_axis_does_not_follow() {
    let model = following_model();
    for (jog_mm_s, growth_v_per_s) in [(1.0, 2.0), (1.0, 0.5), (-1.0, -2.0), (10.0, 2.0)] {
        let growth = f64::abs(growth_v_per_s);
        let stands_s = expected_in_jog(&model, growth, model.sliding_v);
        let found = found_in_jog(&model, jog_mm_s, growth_v_per_s, |_| 0.0);
        near(&format!("{jog_mm_s} mm/s, stands"), found, stands_s);
        let stands_s = stands_s.expect("found");
        for counts in [1, 2, 5, 20] {
            let mut noise = Noise::new(7);
            let flicker = |_| noise.counts(counts) as f64 * COUNT_MM;
            let found = found_in_jog(&model, jog_mm_s, growth_v_per_s, flicker).expect("found");
            assert!(
                found < 1.3 * stands_s + 0.02,
                "flicker of {counts}: {found} s, {stands_s} s"
            );
        }
        let (mut noise, mut astray, mut ticks) = (Noise::new(7), 0, 0);
        let walk = |_| {
            ticks += 1;
            astray += if ticks % 10 == 0 { noise.counts(1) } else { 0 };
            astray as f64 * COUNT_MM
        };
        let found = found_in_jog(&model, jog_mm_s, growth_v_per_s, walk).expect("found");
        assert!(
            found < 1.5 * stands_s + 0.05,
            "astray: {found} s, {stands_s} s"
        );
    }
}

#[test]
fn an_axis_that_follows_by_more_than_half_or_moves_some_way_is_alive_whatever_its_load() {
    let model = following_model();
    for share in [0.6, 1.0, 1.5] {
        assert_eq!(
            found_in_jog(&model, 1.0, 2.0, |time_s| share * time_s),
            None,
            "{share}"
        );
    }
    // A quarter as fast as the reference, but 64 counts every 32 ms.
    assert_eq!(found_in_jog(&model, 4.0, 2.0, |time_s| 1.0 * time_s), None);
    assert!(found_in_jog(&model, 4.0, 2.0, |time_s| 0.2 * time_s).is_some());
}

/// Friction of an axis that was turned around takes up twice what it takes of one that slides.
#[test]
fn an_axis_that_is_turned_around_may_take_up_more_before_it_follows() {
    let model = following_model();
    let found = found_in_jog(&model, 1.0, -2.0, |time_s| -time_s.min(0.0));
    // Its reference goes on, so nothing is owed the other way.
    assert_eq!(found, None);
    // Pushed back by 0.1 mm before it stands.
    let pushed = |time_s: f64| -0.1 * (time_s / 0.05).min(1.0);
    let found = found_in_jog(&model, 1.0, 2.0, pushed);
    near(
        "turned",
        found,
        expected_in_jog(&model, 2.0, model.turned_v),
    );
}

#[test]
fn a_load_that_was_seen_to_push_the_axis_back_is_answered_by_as_much() {
    let pushed_mm = 0.02;
    let model = PlausibilityModel {
        answer_v_per_mm: 10.0,
        ..following_model()
    };
    let pushed = |time_s: f64| -pushed_mm * (time_s / 0.02).min(1.0);
    let taken_v = model.sliding_v + model.answer_v_per_mm * pushed_mm;
    near(
        "pushed",
        found_in_jog(&model, 1.0, 2.0, pushed),
        expected_in_jog(&model, 2.0, taken_v),
    );
    let model = PlausibilityModel {
        answer_v_s_per_mm: 0.05,
        ..following_model()
    };
    // Thrown at 5 mm/s, a count a tick, against a reference of 1 mm/s.
    let thrown = |time_s: f64| -5.0 * time_s.min(0.005);
    let taken_v = model.sliding_v + 0.05 * 6.0;
    near(
        "thrown",
        found_in_jog(&model, 1.0, 2.0, thrown),
        expected_in_jog(&model, 2.0, taken_v),
    );
}

#[test]
fn an_axis_that_slid_and_stands_takes_up_little_more_in_that_sense() {
    let model = PlausibilityModel {
        stuck_v: 0.1,
        held_v: 0.6,
        eased_v: 0.0,
        regained_v: 0.0,
        ..model()
    };
    let stands = |_| 0.0;
    let forth = found_in_jog(&model, 1.0, 2.0, stands).expect("found");
    let back = found_in_jog(&model, 1.0, -2.0, stands).expect("found");
    assert!(forth < back - 0.15, "{forth} {back}");
    near(
        "the other way",
        found_in_jog(&model, -1.0, -2.0, stands),
        Some(forth),
    );
}

#[test]
fn an_axis_that_slipped_while_its_law_braked_it_is_held_by_friction_as_before() {
    let model = PlausibilityModel {
        stuck_v: 0.1,
        held_v: NEVER_V,
        eased_v: 0.3,
        regained_v: 0.0,
        ..model()
    };
    let growth_v_per_s = 2.0;
    let reaches_s = (model.eased_v + SLIDES_V) / growth_v_per_s;
    for sense in [1.0, -1.0] {
        let (slides_v, growth) = (-sense * SLIDES_V, sense * growth_v_per_s);
        let found = found_after(&model, sense, slides_v, growth, |_| 0.0).expect("found");
        assert!(
            (reaches_s..reaches_s + 0.1).contains(&found),
            "{sense}: {found} {reaches_s}"
        );
    }
}

#[test]
fn a_load_that_pushes_an_axis_back_by_millimetres_is_answered_however_stiff_the_law_is() {
    for (v_per_mm, v_s_per_mm) in [(1.0, 0.0), (300.0, 0.0), (1.0, 5.0)] {
        assert!(
            !is_found(v_per_mm, v_s_per_mm, -30.0, 1.0),
            "{v_per_mm} V/mm, {v_s_per_mm} V s/mm"
        );
    }
}

#[test]
fn an_axis_that_does_not_follow_is_found_however_stiff_its_law_is() {
    for v_per_mm in [1.0, 300.0] {
        assert!(is_found(v_per_mm, 0.1, 0.0, 1.0), "{v_per_mm} V/mm");
    }
}

/// True if an axis is found that goes from its origin with a speed, mm/s, under a voltage of 0.4 V, while its reference has another. Its
/// law answers a displacement and a speed by so many V/mm and V s/mm.
fn is_found(
    answer_v_per_mm: f64,
    answer_v_s_per_mm: f64,
    speed_mm_s: f64,
    reference_mm_s: f64,
) -> bool {
    let model = PlausibilityModel {
        sliding_v: 0.1,
        turned_v: 0.1,
        most_turned_v: 1.5 * 0.1,
        answer_v_per_mm,
        answer_v_s_per_mm,
        held_v: NEVER_V,
        eased_v: 0.0,
        regained_v: 0.0,
        ..model()
    };
    let axis = Plausibility::new(&model, AMPLIFIERS[0], COUNT_MM, PERIOD_S);
    let mut state = axis.start(STANDS);
    let word = (0.4 * AMPLIFIERS[0].per_volt) as i32 * INTERVAL as i32;
    (1..1000).any(|interval| {
        let time_s = f64::from(interval) * INTERVAL_S;
        let shown = Shown {
            count: (speed_mm_s * time_s / COUNT_MM) as i32,
            speed: (speed_mm_s * SPEED) as i32,
            words: word * interval,
            reference: (reference_mm_s * time_s / COUNT_MM * 256.0) as i32,
            ..STANDS
        };
        !axis.step(&mut state, shown)
    })
}

#[test]
fn an_axis_has_to_follow_its_reference_by_half_and_need_not_lead_it() {
    for (speed_mm_s, reference_mm_s, found) in [
        (0.0, 4.0, true),
        // Half of it is 2 mm/s; some of that shows that it is alive.
        (0.05, 4.0, true),
        (2.1, 4.0, false),
        (-2.1, -4.0, false),
        (-4.0, -4.0, false),
        (-7.9, -4.0, false),
        (0.0, 0.0, false),
        // A motion of 64 counts is one, however far the reference has gone.
        (1.0, 4.0, false),
    ] {
        assert_eq!(
            is_found(0.0, 0.0, speed_mm_s, reference_mm_s),
            found,
            "{speed_mm_s} mm/s of {reference_mm_s}"
        );
    }
}

/// An axis that stands at the origin of its counter.
const STANDS: Shown = Shown {
    count: 0,
    speed: 0,
    words: 0,
    reference: 0,
    open: false,
    excited: false,
};
