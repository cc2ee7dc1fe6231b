//! Law, stage and motion on the bench, tick by tick.

use std::collections::BTreeSet;
use std::path::Path;

use quadrant_law::axes::AxisName;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::gms::{FIRMWARE_ELEMENTS, GmsParameters};
use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_law::reference::{HarmonicSettings, MotionSettings, Plane, Sense, circle};
use quadrant_law::safety::SafetyState;
use quadrant_law::stage::Outputs;
use quadrant_settings::Job;
use quadrant_settings::{PlanSettings, SettingsError, StageSettings};
use quadrant_sim::law_machine::{LawMachine, Operator};
use quadrant_sim::plant::{AxisParameters, SimulatedStage, virgin_curve_elements};
use quadrant_sim::settings_file::SettingsFile;
use quadrant_sim::stage_file::StageFile;
use quadrant_sim::stage_setup::StageSetup;
use serde::{Deserialize, Serialize};

use crate::truth::{Ripple, Truth};

/// The settings that commissioning the simulated stage gave.
const COMMISSIONED: &str = include_str!("../../host-sim/data/identified-stage.toml");
/// Their name in messages.
const COMMISSIONED_NAME: &str = "identified-stage.toml";
/// The command of what the page has set, in a settings file.
const PROVENANCE: &str = "the bench in the browser";
/// Seed of the stage's noise: every run on the bench is the same again.
const SEED: u64 = 1;
/// Duration of the motion's lead-in, s.
const LEAD_S: f64 = 0.5;
/// Control periods between two samples of the page.
pub const SAMPLE_TICKS: u32 = 10;
/// Signals of the stage as a whole in a sample, before those of its axes.
pub const SIGNALS: [&str; 3] = ["time_s", "angle_rad", "radial_um"];
/// Signals of each axis in a sample.
pub const AXIS_SIGNALS: [&str; 5] = [
    "position_mm",
    "error_um",
    "output_v",
    "feedforward_v",
    "friction_v",
];

/// The motion on the bench: a circle in XY, and in Z a sine of half its radius and half its speed, without an end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BenchMotion {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Feed on the circle, mm/min.
    pub feed_mm_min: f64,
}

/// A number of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MotionNumber {
    /// Name in requests.
    pub name: &'static str,
    /// Name on the page.
    pub label: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Meaning, in one sentence.
    pub meaning: &'static str,
}

/// The numbers of the motion.
pub const MOTION: [MotionNumber; 2] = [
    MotionNumber {
        name: "radius_mm",
        label: "Radius",
        unit: "mm",
        range: [2.0, 50.0],
        meaning: "Radius of the circle; z runs a sine of half of it.",
    },
    MotionNumber {
        name: "feed_mm_min",
        label: "Feed",
        unit: "mm/min",
        range: [60.0, 3000.0],
        meaning: "Speed along the circle; z runs at half of it.",
    },
];

impl Default for BenchMotion {
    fn default() -> Self {
        Self {
            radius_mm: 10.0,
            feed_mm_min: 900.0,
        }
    }
}

impl BenchMotion {
    /// Checks the numbers against their ranges.
    fn check(self) -> Result<(), String> {
        for (number, value) in MOTION.iter().zip([self.radius_mm, self.feed_mm_min]) {
            let MotionNumber { name, range, .. } = number;
            if !(range[0]..=range[1]).contains(&value) {
                return Err(format!(
                    "{name} = {value} is outside {} to {}",
                    range[0], range[1]
                ));
            }
        }
        Ok(())
    }

    /// Checks that the motion of each axis fits its travel.
    fn check_travel(self, travel_mm: &[Option<f64>; 3]) -> Result<(), String> {
        let ways_mm = [2.0, 2.0, 1.0].map(|factor| factor * self.radius_mm);
        for ((axis, way_mm), travel_mm) in AxisName::ALL.iter().zip(ways_mm).zip(travel_mm) {
            if let Some(travel_mm) = travel_mm
                && way_mm > *travel_mm
            {
                return Err(format!(
                    "the motion takes {axis} over {way_mm} mm, and its travel is {travel_mm} mm: choose a smaller radius"
                ));
            }
        }
        Ok(())
    }

    fn plan(self) -> PlanSettings {
        let feed_mm_s = self.feed_mm_min / 60.0;
        let sense = Sense::CounterClockwise;
        let mut motions = circle(
            Plane::Xy,
            sense,
            self.radius_mm,
            feed_mm_s,
            0.0,
            1.0,
            LEAD_S,
        );
        motions[2] = MotionSettings::Harmonic(HarmonicSettings::with_velocity(
            0.5 * self.radius_mm,
            0.5 * feed_mm_s,
            1.0,
            LEAD_S,
        ));
        for motion in &mut motions {
            if let MotionSettings::Harmonic(sine) = motion {
                sine.cycles = None;
            }
        }
        PlanSettings { motions }
    }
}

/// Control law and simulated stage.
pub struct Bench {
    file: SettingsFile,
    /// Fields of each axis that were set here.
    set_here: [BTreeSet<String>; 3],
    truth: Truth,
    /// Travel of each axis, mm; none of the simulated stage's, which has room for every motion.
    travel_mm: [Option<f64>; 3],
    motion: BenchMotion,
    law: LawMachine<f32, FIRMWARE_ELEMENTS>,
    stage: SimulatedStage,
    ripples: [Ripple; 3],
    /// Linear damping of each axis, V s/mm: B / A, which no motion can distinguish from friction.
    damping_v_s_per_mm: [f64; 3],
    operator: Operator,
}

impl Default for Bench {
    /// The commissioned settings on the simulated stage.
    fn default() -> Self {
        let file = SettingsFile::parse(COMMISSIONED, Path::new(COMMISSIONED_NAME));
        // A test reads the committed file.
        let file = file.expect("settings that this version accepts");
        let (truth, motion) = (Truth::default(), BenchMotion::default());
        let run = Run::new(&file.stage, &truth, motion).expect("a motion within the limits");
        Self {
            file,
            set_here: Default::default(),
            ripples: truth.ripples(),
            damping_v_s_per_mm: damping(&truth),
            truth,
            travel_mm: [None; 3],
            motion,
            law: run.law,
            stage: run.stage,
            operator: Operator::runs_the_plan(),
        }
    }
}

/// A law and a stage that have not moved yet.
struct Run {
    law: LawMachine<f32, FIRMWARE_ELEMENTS>,
    stage: SimulatedStage,
}

impl Run {
    fn new(
        settings: &StageSettings,
        truth: &Truth,
        motion: BenchMotion,
    ) -> Result<Self, SettingsError> {
        let law = LawMachine::new(&Job {
            stage: settings.clone(),
            plan: motion.plan(),
        })?;
        let mut stage = SimulatedStage::new(&truth.stage(), settings.rate_hz, SEED);
        stage.set_marks(truth.marks);
        Ok(Self { law, stage })
    }
}

impl Bench {
    /// The settings of the law.
    pub fn settings(&self) -> &StageSettings {
        &self.file.stage
    }

    /// The stage's own parameters.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The motion.
    pub fn motion(&self) -> BenchMotion {
        self.motion
    }

    /// The cause and the remedy of the fault that switched the outputs off, if one did.
    pub fn fault(&self) -> Option<String> {
        match self.law.state().safety() {
            SafetyState::Faulted(fault) => Some(format!(
                "fault {} on {}: {}; {}",
                fault.code.number(),
                fault.axis.map_or("the stage", AxisName::as_str),
                fault.code.cause(),
                fault.code.remedy()
            )),
            _ => None,
        }
    }

    /// Sets a setting to a JSON value, while the axes move.
    ///
    /// # Errors
    /// A path that is none, or settings that the firmware would refuse, in words; nothing has changed then.
    pub fn set(&mut self, path: &str, value: &str) -> Result<(), String> {
        let mut settings = self.file.stage.clone();
        let axis = settings
            .set_json(path, value.as_bytes())
            .map_err(|error| error.to_string())?;
        self.take(settings)?;
        if let Some(axis) = axis {
            let field = path.split('/').skip(3).collect::<Vec<_>>().join(".");
            self.set_here[axis].insert(field);
        }
        Ok(())
    }

    /// Chooses feedback law and feedforward of all axes, by their names.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn choose(&mut self, law: &str, feedforward: &str) -> Result<(), String> {
        let mut settings = self.file.stage.clone();
        for axis in &mut settings.axes {
            axis.feedback.law = law
                .parse()
                .map_err(|_| format!("there is no feedback law {law}"))?;
            axis.feedforward.kind = feedforward
                .parse()
                .map_err(|_| format!("there is no feedforward {feedforward}"))?;
        }
        self.take(settings)?;
        for set in &mut self.set_here {
            set.extend(["feedback.law", "feedforward.kind"].map(str::to_owned));
        }
        Ok(())
    }

    fn take(&mut self, settings: StageSettings) -> Result<(), String> {
        let stage = settings.build().map_err(|error| error.to_string())?;
        self.law.exchange(stage);
        self.file.stage = settings;
        Ok(())
    }

    /// Turns a knob of the stage, while the axes move.
    ///
    /// # Errors
    /// As [`Truth::turn`].
    pub fn turn(&mut self, knob: &str, value: f64) -> Result<(), String> {
        let mut truth = self.truth.clone();
        truth.turn(knob, value)?;
        self.set_truth(truth);
        let truth = self.truth.stage();
        for (axis, truth) in self.stage.axes_mut().iter_mut().zip(truth.axes) {
            axis.change(truth);
        }
        Ok(())
    }

    /// Sets the law's friction to the stage's own.
    ///
    /// # Errors
    /// Friction that the firmware would refuse, in words.
    pub fn set_true_friction(&mut self) -> Result<(), String> {
        let mut settings = self.file.stage.clone();
        for (axis, truth) in settings.axes.iter_mut().zip(self.truth.stage().axes) {
            axis.friction.sliding = truth
                .friction
                .map(|model| with_linear_damping(model, &truth));
            axis.friction.gms = firmware_elements(&truth);
        }
        self.take(settings)?;
        for set in &mut self.set_here {
            set.extend(["friction.sliding", "friction.gms"].map(str::to_owned));
        }
        Ok(())
    }

    /// Starts again from rest, with the settings and the stage as they are.
    pub fn restart(&mut self) {
        // Both were accepted when they came.
        if let Ok(run) = Run::new(&self.file.stage, &self.truth, self.motion) {
            self.begin(run);
        }
    }

    fn begin(&mut self, run: Run) {
        self.law = run.law;
        self.stage = run.stage;
        self.operator = Operator::runs_the_plan();
    }

    /// Starts another motion from rest.
    ///
    /// # Errors
    /// A motion outside its ranges or beyond the limits of the settings, in words; the old one goes on then.
    pub fn start(&mut self, motion: BenchMotion) -> Result<(), String> {
        motion.check()?;
        motion.check_travel(&self.travel_mm)?;
        let run = Run::new(&self.file.stage, &self.truth, motion);
        self.begin(run.map_err(|error| error.to_string())?);
        self.motion = motion;
        Ok(())
    }

    /// Takes the settings or the stage of a file, and starts again from rest. Returns what it did, in words; `name` is what
    /// messages call the file.
    ///
    /// # Errors
    /// A file that is refused, in words; nothing has changed then.
    pub fn load(&mut self, text: &str, name: &str) -> Result<String, String> {
        if StageFile::has_axes(text) {
            self.load_stage(text, name)
        } else {
            self.load_settings(text, name)
        }
    }

    /// Settings for the stage as it is, which gets the encoders and the converters that they say.
    fn load_settings(&mut self, text: &str, name: &str) -> Result<String, String> {
        let file = SettingsFile::parse(text, Path::new(name)).map_err(|error| error.to_string())?;
        let truth = self.truth.clone().equipped(&file.stage);
        let run = Run::new(&file.stage, &truth, self.motion);
        self.begin(run.map_err(|error| format!("{name}: {error}"))?);
        self.set_truth(truth);
        self.file = file;
        self.set_here = Default::default();
        Ok(format!("{name}: the law runs on it"))
    }

    /// Another stage under the settings as they are, but for the encoders, converters and limits of a stage that has others.
    fn load_stage(&mut self, text: &str, name: &str) -> Result<String, String> {
        let stage = StageFile::parse(text, Path::new(name)).map_err(|error| error.to_string())?;
        let travel_mm = stage.known.map(|known| known.map(|sheet| sheet.span_mm()));
        self.motion
            .check_travel(&travel_mm)
            .map_err(|error| format!("{name}: {error}"))?;
        let fresh = StageSetup::of(&stage).settings;
        let mut settings = self.file.stage.clone();
        let mut set_here = self.set_here.clone();
        let axes = settings.axes.iter_mut().zip(&fresh.axes);
        for (axis, (own, fresh)) in axes.enumerate() {
            let is_same = own.encoder.resolution_mm == fresh.encoder.resolution_mm
                && own.amplifier.full_scale_v == fresh.amplifier.full_scale_v;
            if stage.known[axis].is_some() && !is_same {
                own.encoder = fresh.encoder;
                own.amplifier = fresh.amplifier;
                own.limits = fresh.limits;
                set_here[axis].extend(["encoder", "amplifier", "limits"].map(str::to_owned));
            }
        }
        let truth = Truth::new(stage.truth, stage.marks).equipped(&settings);
        let run = Run::new(&settings, &truth, self.motion);
        self.begin(run.map_err(|error| format!("{name}: {error}"))?);
        self.set_truth(truth);
        self.travel_mm = travel_mm;
        self.file.stage = settings;
        self.set_here = set_here;
        Ok(format!(
            "{name}: the stage is yours, the law is still tuned for another; now open the settings that quadrant compare --stage \
             {name} writes"
        ))
    }

    fn set_truth(&mut self, truth: Truth) {
        self.truth = truth;
        self.ripples = self.truth.ripples();
        self.damping_v_s_per_mm = damping(&self.truth);
    }

    /// Returns the settings as a file, with their origin.
    ///
    /// # Errors
    /// Settings that the firmware would refuse, in words.
    pub fn save(&self) -> Result<String, String> {
        let mut file = self.file.clone();
        for (axis, set) in AxisName::ALL.iter().zip(&self.set_here) {
            if !set.is_empty() {
                let sets: Vec<_> = set.iter().map(String::as_str).collect();
                file.add_provenance(PROVENANCE, axis.as_str(), Vec::new(), &sets);
            }
        }
        file.text(Path::new("settings.toml"))
            .map_err(|error| error.to_string())
    }

    /// The law's half of a control period.
    fn tick(&mut self) -> Outputs {
        let request = self.operator.request(self.law.state().tick());
        let inputs = self.stage.read_inputs(request);
        self.law.tick(&inputs)
    }

    /// The stage's half of a control period.
    fn step(&mut self, outputs: &Outputs) {
        for (axis, ripple) in self.stage.axes_mut().iter_mut().zip(&self.ripples) {
            axis.set_load_v(ripple.force_v(axis.position_mm()));
        }
        self.stage.step(outputs);
    }

    /// Runs control periods, and adds a sample for every [`SAMPLE_TICKS`] of them.
    pub fn advance(&mut self, ticks: u32, samples: &mut Vec<f64>) {
        for _ in 0..ticks {
            let outputs = self.tick();
            if self.law.state().tick().is_multiple_of(SAMPLE_TICKS) {
                self.sample(samples);
            }
            self.step(&outputs);
        }
    }

    /// Runs control periods, and adds the converters' words of each: x, y, z, little-endian.
    pub fn words(&mut self, ticks: u32, words: &mut Vec<u8>) {
        for _ in 0..ticks {
            let outputs = self.tick();
            for code in outputs.codes {
                words.extend(code.0.to_le_bytes());
            }
            self.step(&outputs);
        }
    }

    fn sample(&self, samples: &mut Vec<f64>) {
        let state = self.law.state();
        let seen = state.axes().each_ref().map(|axis| axis.telemetry());
        let mut errors_mm = [0.0; 3];
        for (index, error) in errors_mm.iter_mut().enumerate() {
            let resolution_mm = self.file.stage.axes[index].encoder.resolution_mm;
            let reference_mm = seen[index].reference.to_mm(resolution_mm);
            *error = reference_mm - self.stage.axes()[index].position_mm();
        }
        let (angle_rad, radial_mm) = radial(
            [0, 1].map(|axis| f64::from(seen[axis].velocity)),
            [errors_mm[0], errors_mm[1]],
            self.motion.radius_mm,
        );
        let time_s = f64::from(state.tick()) / self.file.stage.rate_hz;
        samples.extend([time_s, angle_rad, 1e3 * radial_mm]);
        for (index, axis) in self.stage.axes().iter().enumerate() {
            samples.extend([
                axis.position_mm(),
                1e3 * errors_mm[index],
                f64::from(seen[index].output_v()),
                f64::from(seen[index].feedforward.total()),
                axis.friction_v() + self.damping_v_s_per_mm[index] * axis.velocity_mm_s(),
            ]);
        }
    }
}

/// Linear damping of each axis, V s/mm.
fn damping(truth: &Truth) -> [f64; 3] {
    let axes = truth.stage().axes;
    axes.map(|axis| axis.damping_per_s / axis.gain_mm_per_v_s2)
}

/// The place on a circle that is run counter-clockwise, rad, and the deviation from its radius there, mm, from the
/// reference's velocity, mm/s, and the error, mm; at rest, not a number.
fn radial([x, y]: [f64; 2], [error_x, error_y]: [f64; 2], radius_mm: f64) -> (f64, f64) {
    let speed = x.hypot(y);
    if speed == 0.0 {
        return (f64::NAN, f64::NAN);
    }
    // Outwards is to the right of the way.
    let (out_x, out_y) = (y / speed, -x / speed);
    let place_x = radius_mm * out_x - error_x;
    let place_y = radius_mm * out_y - error_y;
    (out_y.atan2(out_x), place_x.hypot(place_y) - radius_mm)
}

/// Friction as a run at constant velocity shows it: with the linear damping, which no motion can distinguish from it.
fn with_linear_damping(model: &StaticFriction, truth: &AxisParameters) -> StaticFriction {
    StaticFriction {
        viscous_v_s_per_mm: model.viscous_v_s_per_mm + truth.damping_per_s / truth.gain_mm_per_v_s2,
        ..*model
    }
}

/// Pre-sliding friction with as many elements as the firmware has, on the axis' own range and level.
fn firmware_elements(truth: &AxisParameters) -> GmsParameters {
    let PerDirection { positive, negative } = &truth.friction;
    let breakaway_v = 0.5 * (positive.curve.breakaway_v + negative.curve.breakaway_v);
    let knees = truth.gms.elements.iter();
    let range_mm = knees
        .map(|element| element.weight * breakaway_v / element.stiffness_v_per_mm)
        .fold(0.0, f64::max);
    GmsParameters {
        elements: virgin_curve_elements(breakaway_v, range_mm, FIRMWARE_ELEMENTS),
        attraction_v_s: truth.gms.attraction_v_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: &str = "/axes/x/feedback/law";
    const FEEDFORWARD: &str = "/axes/x/feedforward/kind";

    fn samples(bench: &mut Bench, seconds: f64) -> Vec<Vec<f64>> {
        let mut flat = Vec::new();
        bench.advance((1e4 * seconds) as u32, &mut flat);
        let width = SIGNALS.len() + 3 * AXIS_SIGNALS.len();
        flat.chunks(width).map(<[f64]>::to_vec).collect()
    }

    fn largest(samples: &[Vec<f64>], signal: usize) -> f64 {
        samples
            .iter()
            .map(|of| of[signal].abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn axes_move_and_the_whole_law_takes_most_of_the_error_away() {
        let mut bench = Bench::default();
        samples(&mut bench, 2.0);
        let whole = samples(&mut bench, 4.5);
        assert!(largest(&whole, 3) > 15.0);
        bench.set(LAW, "\"pid\"").unwrap();
        bench.set(FEEDFORWARD, "\"none\"").unwrap();
        samples(&mut bench, 2.0);
        let pid = samples(&mut bench, 4.5);
        let errors = [largest(&whole, 4), largest(&pid, 4)];
        assert!(errors[0] < 0.5 * errors[1], "{errors:?} um");
        assert_eq!(bench.fault(), None);
    }

    #[test]
    fn radial_deviation_is_that_of_the_place_from_the_circle() {
        let (angle, deviation) = radial([0.0, 5.0], [-0.003, 0.0], 10.0);
        assert!(angle.abs() < 1e-12 && (deviation - 0.003).abs() < 1e-12);
        let (angle, deviation) = radial([-5.0, 0.0], [0.0, 0.002], 10.0);
        assert!((angle - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((deviation + 0.002).abs() < 1e-12);
        assert!(radial([0.0, 0.0], [0.0, 0.0], 10.0).1.is_nan());
    }

    #[test]
    fn a_refused_setting_changes_nothing_and_names_its_range() {
        let mut bench = Bench::default();
        let before = bench.settings().clone();
        let error = bench
            .set("/axes/x/feedback/pid/kp_v_per_mm", "-1")
            .unwrap_err();
        assert!(
            error.contains("kp_v_per_mm = -1 is outside 0 to 10000"),
            "{error}"
        );
        assert!(bench.set("/axes/x/feedback/colour", "1").is_err());
        assert_eq!(*bench.settings(), before);
    }

    #[test]
    fn friction_set_from_the_stage_is_the_stage_s_own() {
        let mut bench = Bench::default();
        bench.turn("friction", 2.0).unwrap();
        bench.set_true_friction().unwrap();
        let own = bench.truth().stage();
        let curve = &bench.settings().axes[1].friction.sliding.positive.curve;
        assert_eq!(
            curve.coulomb_v,
            own.axes[1].friction.positive.curve.coulomb_v
        );
    }

    #[test]
    fn heavier_friction_shows_while_the_axes_move() {
        let mut bench = Bench::default();
        samples(&mut bench, 1.0);
        let light = largest(&samples(&mut bench, 3.0), 7);
        bench.turn("friction", 2.0).unwrap();
        let heavy = largest(&samples(&mut bench, 3.0), 7);
        assert!(heavy > 1.5 * light, "{heavy} V over {light} V");
        assert_eq!(bench.fault(), None);
    }

    #[test]
    fn a_saved_file_loads_again_and_names_what_the_bench_has_set() {
        let mut bench = Bench::default();
        bench
            .set("/axes/1/feedback/pid/kp_v_per_mm", "1.25")
            .unwrap();
        let text = bench.save().unwrap();
        assert!(text.contains(PROVENANCE) && text.contains("feedback.pid.kp_v_per_mm"));
        let mut other = Bench::default();
        other.load(&text, "mine.toml").unwrap();
        assert_eq!(other.settings(), bench.settings());
        let error = other.load("form = 2", "mine.toml").unwrap_err();
        assert!(error.starts_with("mine.toml: "), "{error}");
    }

    #[test]
    fn settings_of_another_encoder_run_on_a_stage_that_has_it() {
        let mut bench = Bench::default();
        let text = bench.save().unwrap();
        let finer = text
            .replace("resolution_mm = 0.0005", "resolution_mm = 0.0001")
            .replace("counts_per_index = 20000", "counts_per_index = 100000");
        assert_ne!(finer, text);
        bench.load(&finer, "finer.toml").unwrap();
        assert_eq!(bench.truth().stage().axes[0].resolution_mm, 1e-4);
        samples(&mut bench, 2.0);
        let whole = samples(&mut bench, 4.5);
        assert_eq!(bench.fault(), None);
        assert!(largest(&whole, 3) > 15.0);
        assert!(largest(&whole, 4) < 6.0, "{} um", largest(&whole, 4));
    }

    #[test]
    fn a_motion_beyond_the_limits_is_refused_and_the_old_one_goes_on() {
        let mut bench = Bench::default();
        let tight = BenchMotion {
            radius_mm: 2.0,
            feed_mm_min: 6000.0,
        };
        assert_eq!(
            bench.start(tight).unwrap_err(),
            "feed_mm_min = 6000 is outside 60 to 3000"
        );
        let mut settings = bench.settings().clone();
        settings.axes[0].limits.max_velocity_mm_s = 12.0;
        bench.take(settings).unwrap();
        assert!(bench.start(BenchMotion::default()).is_err());
        assert_eq!(bench.motion(), BenchMotion::default());
        assert!(largest(&samples(&mut bench, 2.0), 3) > 1.0);
    }

    #[test]
    fn a_stage_of_a_file_moves_as_its_numbers_say_and_a_refused_one_changes_nothing() {
        let mut bench = Bench::default();
        let text = include_str!("../../examples/stage.toml");
        let said = bench.load(text, "stage.toml").unwrap();
        assert!(
            said.contains("quadrant compare --stage stage.toml"),
            "{said}"
        );
        let [x, y, _] = bench.truth().stage().axes;
        // 400 N on 40 kg for a volt; the table's encoder counts 0.1 um.
        assert!((x.gain_mm_per_v_s2 - 1e4).abs() < 1e-6);
        assert_eq!(x.resolution_mm, 1e-4);
        assert_eq!(bench.settings().axes[0].encoder.resolution_mm, 1e-4);
        assert_eq!(y, Bench::default().truth().stage().axes[1]);
        // The law is tuned for another stage: it runs, and badly.
        samples(&mut bench, 2.0);
        assert!(largest(&samples(&mut bench, 4.5), 4) > 50.0);
        assert_eq!(bench.fault(), None);

        let before = (bench.truth().clone(), bench.settings().clone());
        for (text, reason) in [
            (
                "[x]\nmass_kg = -1\n",
                "mine.toml: x.mass_kg = -1 is outside 0.01 to 100000",
            ),
            ("[x]\nmas_kg = 1\n", "unknown field `mas_kg`"),
            (
                "[y]\ntravel_mm = [-5, 5]\n",
                "its travel is 10 mm: choose a smaller radius",
            ),
            (
                "[z]\nmax_velocity_mm_s = 1\nresolution_um = 1\n",
                "mine.toml: ",
            ),
        ] {
            let error = bench.load(text, "mine.toml").unwrap_err();
            assert!(error.contains(reason), "{error}");
            assert_eq!((bench.truth(), bench.settings()), (&before.0, &before.1));
        }
    }

    #[test]
    fn the_same_run_gives_the_same_words() {
        let words = |bench: &mut Bench| {
            let mut words = Vec::new();
            bench.words(5000, &mut words);
            words
        };
        let mut bench = Bench::default();
        let first = words(&mut bench);
        bench.restart();
        assert_eq!(words(&mut bench), first);
        assert!(first.iter().any(|byte| *byte != 0));
    }
}
