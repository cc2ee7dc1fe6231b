//! Motions and origins act under the settings only that they were checked against: plans, streams, injections, the origin.

use std::collections::BTreeMap;

use quadrant_fault_bench::tasks::Tasks;
use quadrant_law::axes::AxisName as LawAxis;
use quadrant_law::command::Command;
use quadrant_law::friction::Direction;
use quadrant_law::reference::Velocity;
use quadrant_law::safety::{AxisSwitches, Switches};
use quadrant_link::message::{
    AxisName, AxisPoint, Body, InjectRequest, LinkError, Motion, Plan, PointToPoint, Reply,
    SetPoint, SettingsRequest, StreamRequest,
};
use quadrant_settings::draft::Draft;
use quadrant_settings::{HomeSwitch, HomingSettings, StageSettings, TravelSettings};

use crate::preemption::{refused, set, settings};
use quadrant_test_support::Noise;

const APPLY: Body = Body::Settings(SettingsRequest::Apply);

/// Largest velocity, mm/s, and acceleration, mm/s^2, of every axis.
type Limits = (f64, f64);
const FAST: Limits = (250.0, 2000.0);
const SLOW: Limits = (40.0, 2000.0);
const GENTLE: Limits = (250.0, 100.0);

fn limited((velocity, acceleration): Limits) -> StageSettings {
    let mut settings = settings();
    for axis in &mut settings.axes {
        axis.limits.max_velocity_mm_s = velocity;
        axis.limits.max_acceleration_mm_s2 = acceleration;
        axis.limits.braking_mm_s2 = 4000.0;
        axis.limits.unhomed_mm_s = None;
    }
    settings
}

/// Requests that put limits of every axis in force.
fn applied(limits: Limits) -> Vec<Body> {
    let settings = limited(limits);
    let mut bodies: Vec<Body> = (0..3)
        .flat_map(|axis| {
            ["max_velocity_mm_s", "max_acceleration_mm_s2"]
                .map(|leaf| set(&format!("/axes/{axis}/limits/{leaf}"), &settings))
        })
        .collect();
    bodies.push(APPLY);
    bodies
}

/// A move of all axes by a distance, as fast as some limits allow.
fn plan(distance_mm: f64, (velocity, acceleration): Limits) -> Body {
    let motion = Motion::PointToPoint(PointToPoint {
        distance_mm,
        max_velocity_mm_s: velocity,
        max_acceleration_mm_s2: acceleration,
        max_jerk_mm_s3: 1e5,
    });
    Body::SetPlan(Plan {
        motions: [motion; 3],
    })
}

fn all(tasks: &mut Tasks, bodies: &[Body]) {
    for body in bodies {
        let answer = tasks.ask(body.clone());
        assert!(answer.is_ok(), "{body:?}: {answer:?}");
    }
    tasks.run(40);
}

/// Enables; the answer to `Run`, and the largest speed of x until the axes rest, mm/s.
fn enabled_run(tasks: &mut Tasks) -> (bool, f64) {
    all(tasks, &[Body::Enable]);
    let runs = tasks.ask(Body::Run).is_ok();
    let mut fastest: f64 = 0.0;
    let mut motion = ReferenceMotion::of(tasks);
    for _ in 0..20_000 {
        tasks.step();
        fastest = fastest.max(motion.step(tasks).0[0]);
    }
    (runs, fastest)
}

/// The motion of the references as differences of their positions: by no code of the law. The server's work takes some
/// ticks at a time, so these are means.
struct ReferenceMotion {
    tick: u32,
    ticks: f64,
    positions: [i64; 3],
    speeds: [f64; 3],
}

/// mm/s of a unit of position, 2^-16 counts of 0.5 um, per tick of 0.1 ms.
const UNIT_MM_S: f64 = 5e-4 / 65536.0 * 1e4;

impl ReferenceMotion {
    fn of(tasks: &Tasks) -> Self {
        Self {
            tick: tasks.tick(),
            ticks: 1.0,
            positions: positions(tasks),
            speeds: [0.0; 3],
        }
    }

    /// Speeds, mm/s, and how much faster each axis has become, mm/s^2.
    fn step(&mut self, tasks: &Tasks) -> ([f64; 3], [f64; 3]) {
        let now = positions(tasks);
        let ticks = f64::from(tasks.tick().wrapping_sub(self.tick));
        let between_s = 0.5e-4 * (self.ticks + ticks);
        let speeds: [f64; 3] = std::array::from_fn(|axis| {
            now[axis].wrapping_sub(self.positions[axis]) as f64 * UNIT_MM_S / ticks
        })
        .map(f64::abs);
        let gains = std::array::from_fn(|axis| (speeds[axis] - self.speeds[axis]) / between_s);
        *self = Self {
            tick: tasks.tick(),
            ticks,
            positions: now,
            speeds,
        };
        (speeds, gains)
    }
}

fn positions(tasks: &Tasks) -> [i64; 3] {
    let upper = tasks.upper.borrow();
    upper
        .state()
        .axes()
        .by_ref()
        .map(|axis| axis.reference().0)
        .into_array()
}

#[test]
fn a_plan_does_not_outlive_the_limits_that_it_was_checked_against() {
    for tighter in [SLOW, GENTLE] {
        let mut tasks = Tasks::new(&limited(FAST), 1);
        all(&mut tasks, &[plan(30.0, FAST)]);
        all(&mut tasks, &applied(tighter));
        let (runs, fastest) = enabled_run(&mut tasks);
        assert!(!runs && fastest == 0.0, "{runs}, {fastest} mm/s");
        // One that keeps to them is taken and runs.
        assert!(tasks.ask(plan(30.0, FAST)).is_err());
        all(&mut tasks, &[plan(30.0, tighter)]);
        let (runs, fastest) = enabled_run(&mut tasks);
        assert!(
            runs && fastest > 0.0 && fastest < tighter.0 * 1.001,
            "{fastest} mm/s"
        );
    }
}

#[test]
fn a_plan_stays_when_settings_change_that_it_was_not_checked_against() {
    let mut tasks = Tasks::new(&limited(FAST), 1);
    let mut stiffer = limited(FAST);
    stiffer.axes[0].feedback.pid.kp_v_per_mm *= 1.1;
    all(
        &mut tasks,
        &[
            plan(3.0, SLOW),
            set("/axes/0/feedback/pid/kp_v_per_mm", &stiffer),
            APPLY,
        ],
    );
    assert!(enabled_run(&mut tasks).0);
}

#[test]
fn a_run_without_a_plan_is_refused() {
    let mut tasks = Tasks::new(&settings(), 1);
    all(&mut tasks, &[Body::Enable]);
    assert!(refused(Some(&tasks.ask(Body::Run))));
    let with_plan = Body::Inject(InjectRequest::Open {
        axis: AxisName::X,
        open_loop: false,
        with_plan: true,
        limit_v: 0.5,
        travel_mm: 1.0,
        max_velocity_mm_s: 20.0,
    });
    assert!(refused(Some(&tasks.ask(with_plan))));
}

#[test]
fn what_waits_of_a_stream_does_not_outlive_the_limits_that_it_was_checked_against() {
    let mut tasks = Tasks::new(&limited(FAST), 1);
    let point = |position_mm| {
        let mut point = SetPoint::default();
        point.axes[0] = AxisPoint {
            position_mm,
            ..AxisPoint::default()
        };
        point
    };
    let points = |last| {
        Body::Stream(StreamRequest::Points {
            sequence: 0,
            points: [1.0, 2.0].map(point).into_iter().collect(),
            last,
        })
    };
    let open = Body::Stream(StreamRequest::Open { period_ticks: 1000 });
    all(&mut tasks, &[Body::Enable, open.clone(), points(false)]);
    all(&mut tasks, &[Body::Disable]);
    all(&mut tasks, &applied(SLOW));
    all(&mut tasks, &[Body::Enable]);
    // Straight to control, past the server: nothing of it is there.
    tasks.upper.borrow_mut().operate(Command::StartStream);
    let before = positions(&tasks);
    tasks.run(3000);
    assert_eq!(positions(&tasks), before);
    all(&mut tasks, &[open, points(true)]);
    tasks.run(4000);
    assert_eq!(tasks.upper.borrow().snapshot().axes[0].measured.0, 4000);
}

#[test]
fn a_stream_is_not_opened_in_a_motion_which_goes_on() {
    let mut tasks = Tasks::new(&limited(FAST), 1);
    all(&mut tasks, &[plan(10.0, FAST), Body::Enable, Body::Run]);
    let answer = tasks.ask(Body::Stream(StreamRequest::Open { period_ticks: 1000 }));
    assert!(answer.is_err(), "{answer:?}");
    tasks.run(4000);
    assert_eq!(tasks.upper.borrow().snapshot().axes[0].measured.0, 20_000);
}

/// Settings of an x axis that is homed at the edge of its switch, which is `mark_mm` then.
fn marked(mark_mm: f64) -> StageSettings {
    let mut settings = limited(FAST);
    settings.axes[0].homing = Some(HomingSettings {
        direction: Direction::Negative,
        switch: HomeSwitch::Home,
        index: false,
        mark_mm,
        park_mm: mark_mm,
        ..StageSettings::simulated().axes[0].homing.expect("homes")
    });
    settings
}

/// Homes x at the edge of a switch that is pressed beyond -0.2 mm.
fn home_x(tasks: &mut Tasks) {
    all(
        tasks,
        &[
            Body::Enable,
            Body::Home([AxisName::X].into_iter().collect()),
        ],
    );
    for _ in 0..60_000 {
        tasks.step();
        let mut upper = tasks.upper.borrow_mut();
        let snapshot = upper.snapshot();
        let pressed = !snapshot.view.homed[0] && snapshot.axes[0].measured.0 < -400;
        upper.inputs.switches = if pressed {
            Switches::NONE.with_axis(LawAxis::X, AxisSwitches::HOME)
        } else {
            Switches::NONE
        };
        if snapshot.view.homed[0] && !snapshot.view.running {
            break;
        }
    }
    all(tasks, &[Body::Disable]);
}

#[test]
fn a_stream_keeps_to_the_travel_of_a_homed_axis() {
    let mut settings = marked(-0.2);
    settings.axes[0].limits.travel_mm = Some(TravelSettings {
        negative: -0.5,
        positive: 1.0,
    });
    let mut tasks = Tasks::new(&settings, 1);
    home_x(&mut tasks);
    all(&mut tasks, &[Body::Enable]);
    for (end_mm, within) in [(1.5, false), (-1.0, false), (0.8, true)] {
        let mut point = SetPoint::default();
        point.axes[0].position_mm = end_mm;
        let open = Body::Stream(StreamRequest::Open { period_ticks: 1000 });
        all(&mut tasks, &[open]);
        let answer = tasks.ask(Body::Stream(StreamRequest::Points {
            sequence: 0,
            points: [point].into_iter().collect(),
            last: true,
        }));
        assert_eq!(answer.is_ok(), within, "{end_mm} mm: {answer:?}");
    }
}

#[test]
fn the_origin_does_not_outlive_the_homing_that_found_it() {
    for (leaf, changed, stays) in [
        ("limits/max_velocity_mm_s", limited(SLOW), true),
        ("homing/mark_mm", marked(1.0), false),
    ] {
        let mut tasks = Tasks::new(&marked(-0.2), 1);
        home_x(&mut tasks);
        all(&mut tasks, &[set(&format!("/axes/0/{leaf}"), &changed)]);
        assert!(tasks.upper.borrow().snapshot().view.homed[0]);
        all(&mut tasks, &[APPLY]);
        assert_eq!(
            tasks.upper.borrow().snapshot().view.homed[0],
            stays,
            "{leaf}"
        );
    }
}

/// Every leaf that motions are checked against changes only while the outputs are off, or with a restart: otherwise a
/// motion that was checked could be under way when it does.
#[test]
fn nothing_that_motions_are_checked_against_changes_while_the_outputs_are_on() {
    let mut tighter = limited(FAST);
    for axis in &mut tighter.axes {
        let (encoder, amplifier, limits) =
            (&mut axis.encoder, &mut axis.amplifier, &mut axis.limits);
        encoder.resolution_mm *= 0.5;
        amplifier.full_scale_v *= 0.9;
        amplifier.output_limit_v *= 0.9;
        limits.max_velocity_mm_s *= 0.9;
        limits.max_acceleration_mm_s2 *= 0.9;
        limits.max_jerk_mm_s3 *= 0.9;
        limits.travel_mm = None;
        axis.homing = None;
    }
    let original = limited(FAST);
    let mut paths = Vec::new();
    original
        .list("", &mut |path| paths.push(path.to_owned()))
        .expect("lists");
    let mut bounding = 0;
    for path in paths {
        let mut bytes = [0; quadrant_settings::MAX_VALUE_BYTES];
        let Ok((kind, length)) = tighter.get_bytes(&path, &mut bytes) else {
            continue;
        };
        let (mut in_force, mut edited) = (original.clone(), original.clone());
        let mut draft = Draft::new(&mut in_force, &mut edited);
        if draft.set_bytes(&path, kind, &bytes[..length]).is_err() {
            continue;
        }
        if !draft.differs_at(&path) {
            continue;
        }
        bounding += 1;
        let held =
            draft.safety_change().is_some() || path.contains("encoder") || path.contains("rate_hz");
        assert!(held, "{path}");
    }
    assert!(bounding >= 15, "{bounding}");
}

/// Bursts of requests in random orders, between which limits change: no reference is faster, or becomes so more quickly, than
/// the limits allow that were applied last.
#[test]
fn no_order_of_requests_moves_an_axis_beyond_the_limits_in_force() {
    let seeds = std::env::var("QUADRANT_ORDERS").map_or(40, |count| {
        count.parse().expect("QUADRANT_ORDERS: a number")
    });
    let (mut runs, mut changes, mut fast, mut moved) = (0, 0, 0, 0);
    for seed in 0..seeds {
        let mut noise = Noise::new(seed);
        let mut draw = move |most: u64| noise.bits() % most;
        let mut tasks = Tasks::new(&limited(FAST), seed);
        // The limits in force, and those that wait for the answer of a request.
        let mut limits = FAST;
        let mut waiting: BTreeMap<u16, Limits> = BTreeMap::new();
        let mut motion = ReferenceMotion::of(&tasks);
        let mut driven = 0;
        for _ in 0..16 {
            let mut burst = Vec::new();
            let mut changed = Vec::new();
            for _ in 0..=draw(5) {
                let any = [FAST, SLOW, GENTLE][draw(3) as usize];
                let distance_mm = [15.0, -15.0][draw(2) as usize];
                match draw(12) {
                    0 | 1 => burst.push(Body::Enable),
                    2 => burst.push(Body::Disable),
                    3 | 4 => {
                        burst.extend(applied(any));
                        changed.push((burst.len() - 1, any));
                    }
                    5 | 6 => burst.push(plan(distance_mm, any)),
                    7 | 8 => burst.push(Body::Run),
                    9 => burst.push(Body::Stop),
                    10 => burst.push(Body::Jog {
                        axis: AxisName::Y,
                        velocity_mm_s: distance_mm.signum() * any.0 * 0.9,
                    }),
                    _ => burst.push(Body::Move {
                        axis: AxisName::Z,
                        target_mm: distance_mm,
                        velocity_mm_s: any.0,
                    }),
                }
            }
            let first = tasks.send(&burst);
            waiting.extend(
                changed
                    .into_iter()
                    .map(|(place, any)| (first + place as u16, any)),
            );
            for _ in 0..500 + draw(4000) {
                tasks.step();
                // Of a burst that is too long the board loses requests, which are never answered.
                waiting.retain(|id, any| match tasks.answers.get(id) {
                    None => true,
                    Some(answer) => {
                        if matches!(answer, Ok(Reply::Applied(_))) {
                            changes += u32::from(limits != *any);
                            limits = *any;
                        }
                        false
                    }
                });
                let (speeds, gains) = motion.step(&tasks);
                // Before the outputs are on, and in the tick after, the reference goes where the axis is.
                driven = if tasks.upper.borrow().outputs.enabled {
                    driven + 1
                } else {
                    0
                };
                if driven < 3 {
                    continue;
                }
                for axis in 0..3 {
                    let (speed, gain) = (speeds[axis], gains[axis]);
                    moved += u32::from(speed > 1.0);
                    fast += u32::from(speed > 1.1 * SLOW.0);
                    assert!(
                        speed <= 1.001 * limits.0 + 0.01 && gain <= 1.01 * limits.1 + 5.0,
                        "seed {seed}: axis {axis}, {speed} mm/s, {gain} mm/s^2 within {limits:?}"
                    );
                }
            }
            for (body, id) in burst.iter().zip(first..) {
                let done = matches!(tasks.answers.get(&id), Some(Ok(_)));
                runs += u32::from(done && *body == Body::Run);
            }
        }
    }
    println!(
        "{seeds} seeds: {runs} runs, {changes} changes, {moved} ticks in motion, {fast} of them fast"
    );
    let least = seeds as u32;
    assert!(runs > least && changes > least && moved > 1000 * least && fast > 100 * least);
}

/// Count of x where it is homed.
const HOME: i64 = -400;

/// An enabled stage whose x axis is homed.
fn homed() -> Tasks {
    let mut tasks = Tasks::new(&marked(-0.2), 1);
    home_x(&mut tasks);
    all(&mut tasks, &[Body::Enable]);
    assert_eq!(tasks.upper.borrow().snapshot().axes[0].measured.0, HOME);
    tasks
}

/// A move of x, as a request.
fn move_x(target_mm: f64) -> Body {
    Body::Move {
        axis: AxisName::X,
        target_mm,
        velocity_mm_s: 20.0,
    }
}

#[test]
fn a_move_does_not_take_the_place_of_a_motion_that_the_operator_has_started_meanwhile() {
    let mut overtaken = 0;
    for phase in 0..30 {
        let mut tasks = homed();
        all(&mut tasks, &[plan(1.0, SLOW)]);
        tasks.upper.borrow_mut().operate(Command::Run);
        for _ in 0..phase {
            tasks.step();
        }
        let id = tasks.send(&[move_x(-5.0)]);
        let mut last = tasks.upper.borrow().state().axes()[0].reference().0;
        for _ in 0..4000 {
            tasks.step();
            let now = tasks.upper.borrow().state().axes()[0].reference().0;
            // 20 mm/s are 4 counts a tick; a server that is interrupted takes up to 25 of them.
            assert!(
                (now - last).abs() <= (26 * 5) << 16,
                "a jump in phase {phase}"
            );
            last = now;
        }
        let done = matches!(tasks.answers.get(&id), Some(Ok(_)));
        let end = tasks.upper.borrow().snapshot().axes[0].measured.0;
        overtaken += u32::from(done && end == HOME + 2000);
        assert!(
            [HOME + 2000, -10_000].contains(&end),
            "{end} in phase {phase}"
        );
        assert!(done || end == HOME + 2000, "{end} in phase {phase}");
    }
    assert!(overtaken > 0);
}

#[test]
fn a_move_that_a_stop_has_overtaken_leaves_nothing_for_the_next_one() {
    let mut tasks = homed();
    // Commands in every tick let the order wait; then the operator's stop drops it.
    tasks.upper.borrow_mut().inputs.command = Some(Command::Enable);
    tasks.send(&[move_x(3.0)]);
    tasks.run(40);
    tasks.upper.borrow_mut().inputs.command = Some(Command::Stop);
    tasks.run(2);
    tasks.upper.borrow_mut().inputs.command = None;
    tasks.run(40);
    assert!(!tasks.upper.borrow().state().is_running());
    for target_mm in [-1.0, 0.5] {
        tasks.ask(move_x(target_mm)).expect("moves");
        tasks.run(5000);
        let end = tasks.upper.borrow().snapshot().axes[0].measured.0;
        assert_eq!(end, (2000.0 * target_mm) as i64);
    }
    all(&mut tasks, &[plan(0.02, SLOW)]);
}

#[test]
fn a_run_after_a_move_runs_the_plan_and_not_the_move() {
    let mut tasks = homed();
    all(&mut tasks, &[move_x(1.0)]);
    tasks.run(5000);
    assert!(refused(Some(&tasks.ask(Body::Run))), "there is no plan");
    all(&mut tasks, &[plan(2.0, SLOW), move_x(-3.0)]);
    tasks.run(6000);
    all(&mut tasks, &[move_x(0.0)]);
    tasks.run(6000);
    for end in [4000, 8000] {
        all(&mut tasks, &[Body::Run]);
        tasks.run(6000);
        let counts = tasks
            .upper
            .borrow()
            .snapshot()
            .axes
            .map(|axis| axis.measured.0);
        assert_eq!(counts, [end, end, end]);
    }
}

/// The travel is asked of the plan that runs, and not of the move between: neither does a long move bar a short plan, nor a short
/// one let a long plan out.
#[test]
fn a_run_after_a_move_is_checked_by_the_reach_of_the_plan() {
    let mut settings = marked(-0.2);
    settings.axes[0].limits.travel_mm = Some(TravelSettings {
        negative: -5.0,
        positive: 5.0,
    });
    for (plan_mm, runs) in [(1.0, true), (8.0, false)] {
        let mut tasks = Tasks::new(&settings, 1);
        home_x(&mut tasks);
        all(
            &mut tasks,
            &[Body::Enable, plan(plan_mm, SLOW), move_x(4.5)],
        );
        tasks.run(6000);
        all(&mut tasks, &[move_x(0.0)]);
        tasks.run(6000);
        assert_eq!(tasks.ask(Body::Run).is_ok(), runs, "{plan_mm} mm");
    }
    // A plan that control refuses leaves the one before with its reach.
    let mut tasks = Tasks::new(&settings, 1);
    home_x(&mut tasks);
    all(&mut tasks, &[Body::Enable, plan(8.0, SLOW)]);
    tasks.upper.borrow_mut().operate(Command::Jog(
        LawAxis::Y,
        Velocity::from_mm_s(1.0, settings.motion_scale(1)),
    ));
    tasks.send(&[plan(1.0, SLOW)]);
    tasks.run(400);
    all(&mut tasks, &[Body::Stop]);
    tasks.run(2000);
    assert!(tasks.ask(Body::Run).is_err());
}

/// x and z are commissioned; y has no law.
fn y_without_a_law() -> Tasks {
    let mut settings = limited(FAST);
    settings.axes[1] = StageSettings::default().axes[1].clone();
    let mut tasks = Tasks::new(&settings, 1);
    all(&mut tasks, &[Body::Enable]);
    tasks
}

/// The text of a refusal.
fn refusal_of(answer: Result<Reply, LinkError>) -> String {
    match answer {
        Err(LinkError::Refused(text) | LinkError::Invalid(text)) => text.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_plan_that_moves_an_axis_without_a_law_is_refused_by_the_name_of_the_axis() {
    let mut tasks = y_without_a_law();
    all(&mut tasks, &[plan(1.0, (40.0, 100.0))]);
    let text = refusal_of(tasks.ask(Body::Run));
    assert!(text.starts_with("y: ") && text.contains("no law"), "{text}");
    tasks.run(200);
    let upper = tasks.upper.borrow();
    assert!(upper.outputs.enabled && !upper.state().is_running());
}

#[test]
fn a_streamed_set_point_that_moves_an_axis_without_a_law_is_refused_by_the_name_of_the_axis() {
    let mut tasks = y_without_a_law();
    let open = StreamRequest::Open { period_ticks: 10 };
    all(&mut tasks, &[Body::Stream(open)]);
    let still = AxisPoint {
        position_mm: 0.0,
        velocity_mm_s: 0.0,
        acceleration_mm_s2: 0.0,
    };
    let moved = AxisPoint {
        position_mm: 1e-4,
        ..still
    };
    let points = StreamRequest::Points {
        sequence: 0,
        points: [SetPoint {
            axes: [still, moved, still],
        }]
        .into_iter()
        .collect(),
        last: false,
    };
    let text = refusal_of(tasks.ask(Body::Stream(points)));
    assert!(
        text.contains("set point 1: y: ") && text.contains("no law"),
        "{text}"
    );
}
