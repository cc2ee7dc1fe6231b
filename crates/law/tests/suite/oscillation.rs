//! The monitor for oscillation: what is added and harms is taken away, hum is reported, a loop that swings is stopped, and a
//! healthy axis is left alone.
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_law::reference::{
    HarmonicSettings, MotionSettings, PlannedStroke, PointToPointSettings,
};
use quadrant_law::safety::FaultCode;
use quadrant_law::safety::oscillation::{
    Oscillation, OscillationInput, OscillationKind, OscillationReading, OscillationState,
};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_settings::{PlanSettings, StageSettings};
use quadrant_sim::plant::{
    AxisParameters, Backlash, Drive, EncoderSide, FrictionParameters, SimulatedAxis,
    StageParameters,
};
use quadrant_test_support::{Rig, sine_on_x, x_alone};

pub(crate) struct Bench<S: Scalar> {
    pub(crate) rig: Rig<S>,
    pub(crate) axis: SimulatedAxis,
    /// Amplitude, V, and frequency, Hz, of a load.
    shaken: (f64, f64),
}

impl<S: Scalar> Bench<S> {
    fn new(settings: &StageSettings, truth: AxisParameters, plan: &PlanSettings) -> Self {
        let mut bench = Self {
            rig: Rig::with_plant(settings, plan),
            axis: SimulatedAxis::new(truth, 1e4, 1),
            shaken: (0.0, 0.0),
        };
        bench.tick();
        bench.command(Command::Enable);
        bench.run(0.1);
        bench
    }

    fn found(&self) -> OscillationReading {
        self.rig.state.axes()[0].oscillation()
    }

    fn fault(&self) -> Option<FaultCode> {
        self.rig.state.safety().fault().map(|fault| fault.code)
    }

    fn command(&mut self, command: Command) {
        self.rig.inputs.command = Some(command);
        self.tick();
    }
    fn tick(&mut self) -> f64 {
        let (amplitude_v, hz) = self.shaken;
        let phase = std::f64::consts::TAU * hz * f64::from(self.rig.state.tick()) * 1e-4;
        self.axis.set_load_v(amplitude_v * phase.sin());
        self.rig.inputs.readings[0].count = self.axis.read_counter();
        let outputs = self.rig.tick();
        let [x, ..] = *outputs.codes;
        self.axis.step(x, outputs.enabled);
        self.rig.state.axes()[0]
            .telemetry()
            .error
            .to_f64(Quantity::Length)
    }
    /// Half of the swing of the error, its largest magnitude, and its RMS over a time, um.
    fn run(&mut self, seconds: f64) -> Error {
        let ticks = (seconds * 1e4) as usize;
        let (mut least, mut most, mut sum) = (f64::MAX, f64::MIN, 0.0);
        for _ in 0..ticks {
            let error = 1e3 * self.tick();
            (least, most) = (error.min(least), error.max(most));
            sum += error * error;
        }
        Error {
            half_swing: 0.5 * (most - least),
            most: most.max(-least),
            rms: (sum / ticks as f64).sqrt(),
        }
    }
}

/// A tracking error over a time, um.
struct Error {
    half_swing: f64,
    most: f64,
    rms: f64,
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.0}, {:.0}", self.most, self.rms)
    }
}

/// The x axis with a spring between motor and table.
fn truth(hz: f64, side: EncoderSide) -> AxisParameters {
    let [mut truth, ..] = StageParameters::real().axes;
    let gain = truth.gain_mm_per_v_s2;
    truth.drive = Drive::RackAndPinion(Backlash::resonating(hz, 0.1, 0.5, gain, side));
    truth
}

/// The x axis with a feedforward and gains that suit a spring between motor and table.
fn soft(kind: FeedforwardKind) -> StageSettings {
    x_alone(|x| {
        x.feedback.law = LawKind::Pid;
        x.feedback.pid.kp_v_per_mm *= 0.5;
        x.feedback.pid.ki_v_per_mm_s *= 0.5;
        x.feedback.pid.kd_v_s_per_mm *= 0.7;
        x.feedforward.kind = kind;
    })
}

/// The error of the first two cycles, and of two after what is added was taken away or 12 half cycles have passed.
fn small_motion<S: Scalar>(
    kind: FeedforwardKind,
    truth: &AxisParameters,
    (amplitude_mm, velocity_mm_s): (f64, f64),
) -> ([Error; 2], Bench<S>) {
    let plan = sine_on_x(amplitude_mm, velocity_mm_s);
    let mut bench = Bench::<S>::new(&soft(kind), truth.clone(), &plan);
    bench.command(Command::Run);
    let cycle_s = std::f64::consts::TAU * amplitude_mm / velocity_mm_s;
    let before = bench.run(2.0 * cycle_s);
    for _ in 0..12 {
        if bench.found().number == 0 {
            bench.run(0.5 * cycle_s);
        }
    }
    let after = bench.run(2.0 * cycle_s);
    ([before, after], bench)
}

/// Small motions on every spring: feedforward that swings the axis is taken away, any other is left alone.
fn every_spring<S: Scalar>(motions: &[(f64, f64)]) -> Vec<u8> {
    let mut numbers = Vec::new();
    println!("largest and RMS error, um: alone; with feedforward; after the monitor");
    for lugre in [false, true] {
        for side in [EncoderSide::Load, EncoderSide::Motor] {
            for hz in [30.0, 60.0, 100.0] {
                let mut truth = truth(hz, side);
                if lugre {
                    let settings = StageSettings::simulated();
                    let parameters = settings.axes[0].friction.lugre.expect("by default");
                    truth.model = FrictionParameters::Lugre(parameters);
                }
                for &motion in motions {
                    let ([_, alone], _) = small_motion::<S>(FeedforwardKind::None, &truth, motion);
                    for kind in [FeedforwardKind::Static, FeedforwardKind::Combined] {
                        let ([before, after], bench) = small_motion::<S>(kind, &truth, motion);
                        let found = bench.found();
                        println!(
                            "{side:?}, {hz} Hz, LuGre {lugre}, {motion:?}, {kind:?}: {alone}; {before}; {after}; {:?}",
                            (found.number > 0).then_some(found.kind),
                        );
                        assert_eq!(bench.fault(), None);
                        numbers.push(found.number);
                        if found.number > 0 {
                            // The integral is still on its way to where it is without feedforward.
                            let swing = alone.half_swing;
                            assert!(after.half_swing < 1.15 * swing + 10.0, "{swing}");
                            assert!(after.half_swing < before.half_swing);
                        } else {
                            // An error as large as the motion, or no better without.
                            let most = (1e3 * motion.0).max(1.3 * alone.half_swing);
                            assert!(after.half_swing < 1.1 * most + 8.0, "{most}");
                        }
                    }
                }
            }
        }
    }
    numbers
}

#[test]
fn a_feedforward_that_swings_a_small_motion_is_taken_away() {
    let motions = [(0.02, 0.2), (0.05, 0.5), (0.1, 0.5), (0.2, 0.2), (0.2, 1.0)];
    let numbers = every_spring::<f32>(&motions);
    assert!(numbers.iter().filter(|&&number| number > 0).count() > 40);
}

#[test]
fn a_feedforward_that_swings_a_small_motion_is_taken_away_in_fixed_point() {
    let numbers = every_spring::<Fixed>(&[(0.05, 0.5)]);
    assert!(numbers.iter().filter(|&&number| number > 0).count() > 15);
}

#[test]
fn what_is_taken_away_comes_back_and_stays_away_after_the_third_time() {
    let mut bench = Bench::<f32>::new(
        &soft(FeedforwardKind::Static),
        truth(60.0, EncoderSide::Load),
        &sine_on_x(0.05, 0.5),
    );
    bench.command(Command::Run);
    let mut kinds = Vec::new();
    let mut harmed_s = 0.0;
    for _ in 0..100 {
        let error = bench.run(0.628);
        harmed_s += if error.half_swing > 100.0 { 0.628 } else { 0.0 };
        let found = bench.found();
        if usize::from(found.number) > kinds.len() {
            kinds.push(found.kind);
        }
    }
    println!("{kinds:?}, {harmed_s:.1} s of 62.8 s swing");
    use OscillationKind::{Added, AddedForGood};
    assert_eq!(kinds, [Added, Added, AddedForGood]);
    let friction =
        |bench: &Bench<f32>| bench.rig.state.axes()[0].telemetry().feedforward.friction();
    assert_eq!(friction(&bench), 0.0);
    // Other settings begin again.
    bench.rig.inputs.settings_changed[AxisName::X] = true;
    bench.run(0.628);
    assert!(friction(&bench).abs() > 0.05);
}

/// The x axis as it is, at rest, shaken.
fn at_rest<S: Scalar>(volts: f64, hz: f64, noise_mm: f64) -> (Bench<S>, Error) {
    let [truth, ..] = StageParameters::real().axes;
    let mut bench = Bench::<S>::new(
        &soft(FeedforwardKind::Combined),
        truth.with_imperfection(|parts| parts.encoder_noise_mm = noise_mm),
        &PlanSettings::default(),
    );
    bench.shaken = (volts, hz);
    bench.run(1.5);
    let error = bench.run(2.0);
    (bench, error)
}

fn hummed<S: Scalar>(volts: f64, hz: f64) -> (OscillationReading, Error) {
    let (bench, error) = at_rest::<S>(volts, hz, 1.5e-4);
    (bench.found(), error)
}

#[test]
fn hum_at_rest_is_reported_once_with_its_frequency_and_amplitude() {
    for (volts, hz) in [
        (0.1, 25.0),
        (0.3, 60.0),
        (0.3, 120.0),
        (0.15, 259.0),
        (0.5, 259.0),
        (1.5, 300.0),
    ] {
        for (found, error) in [hummed::<f32>(volts, hz), hummed::<Fixed>(volts, hz)] {
            let seen_hz = found.frequency_hz();
            let seen_um = 0.5 * found.amplitude_counts();
            println!(
                "{hz} Hz, {} um: {seen_hz} Hz, {seen_um} um, {found:?}",
                error.most
            );
            assert_eq!((found.number, found.kind), (1, OscillationKind::Hum));
            assert!((f64::from(seen_hz) / hz - 1.0).abs() < 0.02);
            assert!((f64::from(seen_um) / error.half_swing - 0.85).abs() < 0.25);
        }
    }
}

#[test]
fn noise_at_rest_is_no_hum() {
    for counts in [0.0, 0.3, 1.0, 2.0, 4.0] {
        let (bench, error) = at_rest::<f32>(0.0, 0.0, counts * 5e-4);
        println!("{counts} counts: {error}, {:?}", bench.found());
        assert_eq!(bench.found().number, 0, "{counts}");
    }
}

#[test]
fn a_loop_that_swings_by_more_than_its_limit_is_stopped() {
    let stopped = |volts: f64, moving: bool| {
        let mut settings = soft(FeedforwardKind::Combined);
        settings.axes[0].limits.following_error_mm = 0.2;
        let [truth, ..] = StageParameters::real().axes;
        let mut bench = Bench::<f32>::new(&settings, truth, &PlanSettings::default());
        bench.shaken = (volts, 60.0);
        if moving {
            let jog = settings.jog_at(AxisName::X, 30.0).expect("slow enough");
            bench.command(Command::Jog(AxisName::X, jog));
        }
        let error = bench.run(4.0);
        println!("{volts} V, moving {moving}: {error}, {:?}", bench.fault());
        (error.most, bench.fault())
    };
    let (most, fault) = stopped(0.35, false);
    assert_eq!(fault, Some(FaultCode::Oscillation));
    assert!(most < 200.0);
    assert_eq!(stopped(0.2, false).1, None);
    // The axis goes on: it is cut.
    assert_eq!(stopped(0.35, true).1, None);
}

#[test]
fn a_healthy_axis_keeps_what_is_added() {
    let mut runs = 0;
    for law in [LawKind::Pid, LawKind::NPid] {
        for friction in [0.5, 0.7, 1.0, 1.5] {
            for noise_mm in [1.5e-4, 5e-4] {
                for (amplitude_mm, velocity_mm_s) in [
                    (0.005, 0.1),
                    (0.02, 0.1),
                    (0.02, 0.5),
                    (0.1, 0.1),
                    (0.1, 0.5),
                    (1.0, 3.0),
                    (2.0, 10.0),
                    (10.0, 30.0),
                    (30.0, 100.0),
                    (150.0, 250.0),
                ] {
                    // A feedforward of twice the friction moves an axis farther than so little.
                    if friction < 1.0 && amplitude_mm < 0.1 {
                        continue;
                    }
                    let [truth, ..] = StageParameters::real().axes;
                    let truth = truth
                        .with_friction(friction)
                        .with_imperfection(|parts| parts.encoder_noise_mm = noise_mm);
                    let mut plan = PlanSettings::default();
                    let lead_s = 0.1 + velocity_mm_s / 500.0;
                    plan.motions[0] = MotionSettings::Harmonic(HarmonicSettings {
                        cycles: None,
                        ..HarmonicSettings::with_velocity(amplitude_mm, velocity_mm_s, 1.0, lead_s)
                    });
                    let settings = x_alone(|x| x.feedback.law = law);
                    let mut bench = Bench::<f32>::new(&settings, truth, &plan);
                    bench.command(Command::Run);
                    let cycle_s = std::f64::consts::TAU * amplitude_mm / velocity_mm_s;
                    let error = bench.run((3.0 * cycle_s).max(3.0));
                    assert!(
                        bench.found().number == 0 && bench.fault().is_none(),
                        "{law:?}, friction x {friction}, noise {noise_mm} mm, {amplitude_mm} mm at {velocity_mm_s} mm/s: \
                         {error}, {:?}",
                        bench.found()
                    );
                    runs += 1;
                }
            }
        }
    }
    println!("{runs} runs");
}

#[test]
fn a_hum_that_ends_and_begins_again_is_reported_again() {
    let (mut bench, _) = at_rest::<f32>(0.3, 120.0, 1.5e-4);
    assert_eq!(bench.found().number, 1);
    bench.shaken = (0.0, 0.0);
    bench.run(3.0);
    assert_eq!(bench.found().number, 1);
    bench.shaken = (0.3, 120.0);
    bench.run(3.0);
    assert_eq!(bench.found().number, 2);
    // Its number is kept with the outputs off: an event is not reported twice.
    bench.command(Command::Disable);
    bench.run(0.1);
    assert_eq!(bench.found().number, 2);
}

/// The monitor alone, shown strokes of a way and of a swing of the error, in counts, that take 50 ms each.
struct Shown {
    monitor: Oscillation<f32>,
    state: OscillationState,
    forth: bool,
    /// Displacement of the reference in a tick, 2^-16 counts.
    speed: u32,
}

impl Shown {
    /// Strokes of 80 counts in which the error swings by 100; on trial, by 50: what is added is taken away.
    fn harmed() -> Self {
        let mut shown = Self {
            monitor: Oscillation::new(true, 1e6, 1e-4),
            state: OscillationState::default(),
            forth: false,
            speed: 0,
        };
        shown.strokes(4, 80, 100);
        shown.strokes(8, 80, 50);
        assert_eq!(shown.acts(), 0.0);
        assert_eq!(shown.state.reading().number, 1);
        shown
    }

    /// Nothing up to 100 counts, all from 200 on.
    fn feeding_beyond_100_counts() -> Self {
        Self {
            monitor: Oscillation::new(true, 1e6, 1e-4).feeding_beyond(100.0),
            state: OscillationState::default(),
            forth: false,
            speed: 1,
        }
    }

    fn strokes(&mut self, count: usize, way: i64, swing: i64) {
        for _ in 0..count {
            self.forth = !self.forth;
            for look in 1..=125 {
                let part = if self.forth { look } else { 125 - look };
                let input = OscillationInput {
                    error: swing * part / 125,
                    reference: way * part / 125,
                    sense: if self.forth { 1 } else { -1 },
                    speed: self.speed,
                    excited: false,
                };
                assert!(self.monitor.step(&mut self.state, input));
            }
        }
    }

    /// A time at rest, s.
    fn rest(&mut self, seconds: f64) {
        for _ in 0..(2500.0 * seconds) as usize {
            self.monitor.step(&mut self.state, AT_REST);
        }
    }

    /// Share of what is added that acts.
    fn acts(&self) -> f64 {
        self.monitor.share(&self.state).to_f64(Quantity::Multiplier)
    }
}

#[test]
fn what_was_taken_away_comes_back_at_once_where_the_error_is_no_less_without_it() {
    let mut shown = Shown::harmed();
    shown.strokes(4, 80, 100);
    assert_eq!(shown.acts(), 1.0);
    // For a minute it is not tried again.
    shown.strokes(1000, 80, 100);
    assert_eq!(shown.acts(), 1.0);
}

#[test]
fn what_was_taken_away_comes_back_at_once_where_strokes_are_longer() {
    for (way, comes_back) in [(80, false), (150, false), (170, true), (4000, true)] {
        let mut shown = Shown::harmed();
        shown.strokes(4, way, 40);
        assert_eq!(shown.acts() == 1.0, comes_back, "{way}");
        if comes_back {
            // Short strokes are tried again.
            shown.strokes(4, 80, 100);
            shown.strokes(8, 80, 50);
            assert_eq!(shown.acts(), 0.0, "{way}");
            assert_eq!(shown.state.reading().number, 2, "{way}");
        }
    }
}

#[test]
fn strokes_of_another_kind_say_nothing_of_what_was_taken_away() {
    let mut shown = Shown::harmed();
    shown.state = OscillationState::default();
    shown.strokes(4, 80, 100);
    shown.strokes(8, 50, 50);
    assert_eq!(shown.acts(), 1.0);
    assert_eq!(shown.state.reading().number, 0);
}

/// An axis that stands without an error.
const AT_REST: OscillationInput = OscillationInput {
    error: 0,
    reference: 0,
    sense: 0,
    speed: 0,
    excited: false,
};

/// Displacement in a tick of a number of counts, 2^-16 counts.
const fn counts(thousandths: u32) -> u32 {
    (thousandths << 16) / 1000
}

#[test]
fn friction_is_fed_forward_by_the_fastest_of_two_strokes_and_stays_as_it_is_at_rest() {
    // Nothing below 0.4 counts a tick, all from 0.8 on.
    let mut shown = Shown {
        monitor: Oscillation::new(true, 1e6, 1e-4).feeding_from(0.4),
        state: OscillationState::default(),
        forth: false,
        speed: counts(300),
    };
    // The first stroke may be a fast one, until it turns.
    shown.strokes(1, 80, 10);
    assert_eq!(shown.acts(), 1.0, "from rest");
    shown.strokes(1, 80, 10);
    assert_eq!(shown.acts(), 0.0);
    // It comes with the first fast stroke, and is there through the reversal after it.
    for (speed, share) in [(counts(900), 1.0), (counts(100), 1.0), (counts(100), 0.0)] {
        shown.speed = speed;
        shown.strokes(1, 80, 10);
        assert_eq!(shown.acts(), share, "{speed}");
    }
    shown.speed = counts(600);
    shown.strokes(1, 80, 10);
    assert!((shown.acts() - 0.5).abs() < 0.02, "{}", shown.acts());
    let half = shown.acts();
    shown.rest(2.0);
    assert_eq!(shown.acts(), half, "at rest");
    // After a rest, what went before does not count: it returns.
    shown.speed = counts(100);
    for share in [1.0, 0.0] {
        shown.strokes(1, 80, 10);
        assert_eq!(shown.acts(), share);
    }
    // It fades over 50 ms, not at once.
    shown.speed = counts(2000);
    let mut share = shown.acts();
    let input = OscillationInput {
        sense: 1,
        speed: counts(2000),
        ..AT_REST
    };
    for _ in 0..125 {
        shown.monitor.step(&mut shown.state, input);
        assert!(shown.acts() - share < 0.011, "{share}");
        share = shown.acts();
    }
    assert_eq!(share, 1.0);
}

#[test]
fn an_axis_whose_settings_say_nothing_of_slow_motions_feeds_friction_forward_on_all_of_them() {
    let mut shown = Shown {
        monitor: Oscillation::new(true, 1e6, 1e-4).feeding_from(0.0),
        state: OscillationState::default(),
        forth: false,
        speed: 1,
    };
    shown.strokes(3, 80, 10);
    assert_eq!(shown.acts(), 1.0);
}

#[test]
fn friction_is_fed_forward_on_strokes_beyond_a_length_and_on_the_first_one_after_a_rest() {
    let mut shown = Shown::feeding_beyond_100_counts();
    for (way, share) in [(80, 1.0), (80, 0.0), (1000, 1.0), (80, 1.0), (80, 0.0)] {
        shown.strokes(1, way, 10);
        assert_eq!(shown.acts(), share, "{way}");
    }
    shown.strokes(2, 150, 10);
    assert!((shown.acts() - 0.5).abs() < 0.03, "{}", shown.acts());
    // A reversal on a path rests for less than 0.1 s.
    for (rest_s, share) in [(0.09, 0.0), (0.11, 1.0)] {
        shown.strokes(2, 80, 10);
        assert_eq!(shown.acts(), 0.0);
        shown.rest(rest_s);
        shown.strokes(1, 80, 10);
        assert_eq!(shown.acts(), share, "after {rest_s} s");
    }
}

#[test]
fn friction_that_returns_in_a_stroke_does_not_throw_an_axis_whose_integral_holds_it() {
    fn check<S: Scalar>() {
        const FROM_MM: f64 = 0.3;
        const SLOW_MM_S: f64 = 0.2;
        let settings = x_alone(|x| {
            x.feedback.law = LawKind::Pid;
            x.feedforward.kind = FeedforwardKind::Combined;
            x.feedforward.from_mm = FROM_MM;
        });
        let [axis, ..] = StageParameters::real().axes;
        let mut bench = Bench::<S>::new(&settings, axis, &PlanSettings::default());
        let jog = |bench: &mut Bench<S>, mm_s: f64, seconds: f64| {
            let velocity = settings.jog_at(AxisName::X, mm_s).expect("slow enough");
            bench.command(Command::Jog(AxisName::X, velocity));
            bench.run(seconds);
        };
        // Short strokes without a rest between them, and a long one.
        for _ in 0..2 {
            jog(&mut bench, 2.0, 0.1);
            jog(&mut bench, -2.0, 0.1);
        }
        jog(&mut bench, SLOW_MM_S, FROM_MM / SLOW_MM_S);
        let fed_v = |bench: &Bench<S>| {
            let terms = bench.rig.state.axes()[0].telemetry().feedforward;
            terms.friction().to_f64(Quantity::Voltage)
        };
        assert!(fed_v(&bench) < 0.01, "{} V", fed_v(&bench));
        let before_um = 1e3 * bench.tick();
        let least_um = (0..20_000).fold(before_um, |least, _| least.min(1e3 * bench.tick()));
        assert!(fed_v(&bench) > 0.1, "{} V", fed_v(&bench));
        println!("{before_um:.1} um before, at least {least_um:.1} um then");
        assert!(least_um > -0.1 * before_um, "{least_um} um");
    }
    check::<f32>();
    check::<Fixed>();
}

#[test]
fn friction_acts_at_once_on_a_stroke_after_a_rest_and_begins_with_what_the_integral_holds() {
    fn largest_um<S: Scalar>(kind: FeedforwardKind, changed_at_rest: bool) -> f64 {
        let settings = x_alone(|x| {
            x.feedback.law = LawKind::Pid;
            x.feedforward.kind = kind;
            x.feedforward.from_mm = 0.3;
        });
        let [axis, ..] = StageParameters::real().axes;
        let mut bench = Bench::<S>::new(&settings, axis, &PlanSettings::default());
        let jog = |bench: &mut Bench<S>, mm_s: f64, seconds: f64| {
            let velocity = settings.jog_at(AxisName::X, mm_s).expect("slow enough");
            bench.command(Command::Jog(AxisName::X, velocity));
            bench.run(seconds).most
        };
        // Short strokes, and a longer one that is too slow for its friction to have returned: the integral holds it.
        for mm_s in [2.0, -2.0, 2.0, -2.0] {
            jog(&mut bench, mm_s, 0.1);
        }
        jog(&mut bench, 0.1, 2.0);
        bench.command(Command::Stop);
        bench.run(1.0);
        bench.rig.inputs.settings_changed[AxisName::X] = changed_at_rest;
        bench.tick();
        bench.rig.inputs.settings_changed[AxisName::X] = false;
        jog(&mut bench, 2.0, 0.05);
        let largest_um = bench.run(0.3).most;
        println!("{kind:?}: {largest_um:.1} um");
        largest_um
    }
    fn check<S: Scalar>() {
        for changed_at_rest in [false, true] {
            let pid_um = largest_um::<S>(FeedforwardKind::None, changed_at_rest);
            let own_um = largest_um::<S>(FeedforwardKind::Combined, changed_at_rest);
            assert!(own_um < 0.2 * pid_um, "{own_um} um for {pid_um}");
        }
    }
    check::<f32>();
    check::<Fixed>();
}

#[test]
fn a_planned_move_is_a_stroke_of_its_own_however_short_the_rest_before_it() {
    let mut shown = Shown::feeding_beyond_100_counts();
    shown.strokes(1, 1000, 10);
    assert_eq!(shown.acts(), 1.0);
    for (counts, way, share) in [(20, 20, 0.0), (20, 20, 0.0), (4000, 20, 1.0), (20, 20, 0.0)] {
        shown.rest(0.05);
        shown
            .monitor
            .plan(&mut shown.state, Some(PlannedStroke { counts, speed: 1 }));
        // In the sense of the one before.
        shown.forth = false;
        shown.strokes(1, way, 10);
        assert_eq!(shown.acts(), share, "{counts} counts");
    }
}

#[test]
fn a_move_or_sine_of_the_plan_is_known_to_be_short_or_slow_before_it_begins() {
    /// The largest friction that is fed forward in the first tenth of a second of a motion, V.
    fn friction_v(from_mm: f64, from_mm_s: f64, motion: MotionSettings) -> f64 {
        let settings = x_alone(|x| {
            x.feedforward.kind = FeedforwardKind::Gms;
            (x.feedforward.from_mm, x.feedforward.from_mm_s) = (from_mm, from_mm_s);
        });
        let [axis, ..] = StageParameters::real().axes;
        let mut plan = PlanSettings::default();
        plan.motions[0] = motion;
        let mut bench = Bench::<f32>::new(&settings, axis, &plan);
        bench.run(1.2);
        bench.command(Command::Run);
        let fed_v = |_| {
            bench.tick();
            let fed = &bench.rig.state.axes()[0].telemetry().feedforward;
            fed.presliding.to_f64(Quantity::Voltage)
        };
        (0..1000).map(fed_v).fold(0.0, f64::max)
    }
    // Strokes of a length at up to 1 mm/s.
    let moves = |distance_mm: f64| {
        MotionSettings::PointToPoint(PointToPointSettings {
            distance_mm,
            max_velocity_mm_s: 1.0,
            max_acceleration_mm_s2: 100.0,
            max_jerk_mm_s3: 1e4,
        })
    };
    let sine = |stroke_mm: f64| {
        MotionSettings::Harmonic(HarmonicSettings::with_velocity(
            0.5 * stroke_mm,
            1.0,
            1.0,
            0.4,
        ))
    };
    for (from_mm, from_mm_s, stroke_mm, is_fed) in [
        (0.5, 0.0, 0.4, false),
        (0.5, 0.0, 4.0, true),
        (0.0, 1.1, 4.0, false),
        (0.0, 0.4, 4.0, true),
    ] {
        for motion in [moves(stroke_mm), sine(stroke_mm)] {
            let fed_v = friction_v(from_mm, from_mm_s, motion);
            let whole_v = friction_v(0.0, 0.0, motion);
            assert!(whole_v > 0.02, "{motion:?}: {whole_v} V");
            let what = format!("{motion:?}, from {from_mm} mm, {from_mm_s} mm/s");
            assert_eq!(fed_v, if is_fed { whole_v } else { 0.0 }, "{what}");
        }
    }
}

#[test]
fn nothing_of_the_friction_is_fed_forward_on_slow_motions_whatever_the_speed_in_the_settings() {
    for thousandths in [1, 7, 40, 80, 160, 320, 400, 3000, 17_000] {
        let mut shown = Shown {
            monitor: Oscillation::new(true, 1e6, 1e-4)
                .feeding_from(f64::from(thousandths) / 1000.0),
            state: OscillationState::default(),
            forth: false,
            speed: counts(thousandths) / 2,
        };
        shown.strokes(2, 80, 10);
        assert_eq!(
            shown.acts(),
            0.0,
            "{thousandths} thousandths of a count a tick"
        );
    }
}

/// Errors of an axis that is shaken now and then, on motions too slow for its friction to be fed forward.
fn shaken_when_slow<S: Scalar>(learning: Option<LearningSettings>) -> Vec<f64> {
    let settings = x_alone(|x| {
        x.feedback.law = LawKind::Pid;
        x.feedforward.kind = FeedforwardKind::Lugre;
        x.feedforward.from_mm_s = 100.0;
        x.feedforward.learning = learning;
    });
    let [axis, ..] = StageParameters::real().axes;
    let mut bench = Bench::<S>::new(&settings, axis, &sine_on_x(0.2, 2.0));
    bench.run(1.2);
    bench.command(Command::Run);
    let mut errors = Vec::new();
    for index in 0..8 {
        bench.shaken = if index % 2 == 0 {
            (0.0, 80.0)
        } else {
            (0.4, 80.0)
        };
        errors.extend((0..2000).map(|_| bench.tick()));
    }
    errors
}

#[test]
fn learning_takes_nothing_from_the_integral_for_friction_that_is_not_fed_forward() {
    fn check<S: Scalar>() {
        let learning = shaken_when_slow::<S>(Some(LearningSettings::DEFAULT));
        assert_eq!(learning, shaken_when_slow::<S>(None));
    }
    check::<f32>();
    check::<Fixed>();
}
