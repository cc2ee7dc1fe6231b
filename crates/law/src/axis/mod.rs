//! One axis, one tick: counts in, a converter's word out.
//!
//! An [`Axis`] is what the tick reads, made by [`Axis::build`] or, in place, by an [`AxisBuilder`]; an [`AxisState`] is
//! what it remembers. The stage ticks three of them together; [`Axis::tick`] ticks one alone.
//!
//! ```
//! use quadrant_law::axis::{Axis, AxisState, OutputStage};
//! use quadrant_law::control::pid::PidGains;
//! use quadrant_law::encoder::EncoderReading;
//! use quadrant_law::reference::{Motion, MotionScale};
//!
//! let gains = PidGains { kp_v_per_mm: 1.0, ki_v_per_mm_s: 0.5, kd_v_s_per_mm: 5e-3, derivative_filter_s: 50e-6 };
//! // Counts of 0.5 um, 10 000 ticks a second, outputs within +-9 V of a converter of +-10 V.
//! let scale = MotionScale::new(0.5e-3, 1e4);
//! let axis = Axis::<f32>::build(scale, |axis| axis.output(OutputStage::limited_to(9.0)).pid(&gains, 2.0))?;
//! let mut state = AxisState::default();
//! axis.tick(&mut state, &Motion::Hold, &EncoderReading::of(0)).unwrap();
//! // Pushed one count away, the axis pushes back.
//! let code = axis.tick(&mut state, &Motion::Hold, &EncoderReading::of(1)).unwrap();
//! assert!(code.to_volts(10.0) < 0.0);
//! # Ok::<(), quadrant_law::axis::AxisError>(())
//! ```

mod build;
mod fading;
mod output;
mod rest;
mod state;
pub mod telemetry;

use crate::hint::cold_path;

pub use self::build::{AxisBuilder, AxisError};
use self::fading::FadingState;
use self::output::Amplifier;
pub use self::output::OutputStage;
use self::rest::RestState;
pub use self::state::AxisState;
use self::telemetry::{AxisTelemetry, LimitedBy};
use crate::cancelling::{Cancelling, Cut};
use crate::command::Command;
use crate::control::feedback::Feedback;
use crate::control::filter::{Filters, FiltersState};
use crate::control::pid::Pid;
use crate::control::terms::{FeedbackInput, FeedbackState, FeedbackTerms};
use crate::encoder::{Encoder, EncoderReading};
use crate::feedforward::{Feedforward, FeedforwardTerms, ReferenceStep};
use crate::friction::gms::FIRMWARE_ELEMENTS;
use crate::homing::HomingInput;
use crate::learning::{Learning, LearningInput, LearningState, LearningStatus};
use crate::motion::{GeneratorEvent, MotionMode, ReferenceGenerator};
use crate::reference::{Motion, PulseReference, ReferenceSample};
use crate::safety::monitor::{
    Following, IndexSpacing, Overspeed, OverspeedState, SignalLoss, SignalLossState,
};
use crate::safety::oscillation::{Oscillation, OscillationInput};
use crate::safety::overload::Overload;
use crate::safety::plausibility::{Plausibility, Shown, is_due};
use crate::safety::standstill::{Standstill, StandstillState};
use crate::safety::travel::{Travel, TravelState};
use crate::safety::{AxisSwitches, FaultCode};
use crate::scalar::{Quantity, Scalar};
use crate::units::{DacCode, POSITION_FRACTION_BITS, Position};

/// Ticks that the feedforward can look ahead at most: 3 ms at 10 kHz.
pub const MAX_PREVIEW_TICKS: usize = 30;

/// Room for the reference positions from the feedforward's tick back to the one before the feedback's; a power of two.
const PREVIEW_ROOM: usize = MAX_PREVIEW_TICKS + 2;

/// A speed in 2^-8 counts as a displacement.
const SPEED_SHIFT: u32 = POSITION_FRACTION_BITS - 8;

/// An axis ready for the tick; `N` is the room for GMS elements, the firmware's eight unless another is given. Made by an [`AxisBuilder`].
///
/// Fields that every tick reads come first, and tables last: floating-point loads reach 1020 bytes from an address.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct Axis<S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    encoder: Encoder,
    overspeed: Overspeed,
    /// Limit of the measured speed until the axis is homed, 2^-8 counts per tick; the largest number for none.
    reduced_speed: u32,
    signal_loss: SignalLoss<S>,
    preview_ticks: usize,
    unit_mm: S::Gain,
    following: Following<S>,
    amplifier: Amplifier<S>,
    bumpless_decay: S,
    travel: Travel,
    /// It learns or cancels.
    adapts: bool,
    learns: bool,
    cancels: bool,
    /// The feedforward alone is put out.
    feedforward_alone: bool,
    feedback: Feedback<S>,
    filters: Filters<S>,
    feedforward: Feedforward<S, N>,
    /// A displacement in a tick as a velocity.
    unit_mm_s: S::Gain,
    plausibility: Plausibility,
    overload: Overload,
    oscillation: Oscillation<S>,
    index_spacing: IndexSpacing,
    standstill: Standstill,
    generator: ReferenceGenerator<S>,
    commissioning: Commissioning,
    learning: Learning<S>,
    cancelling: Cancelling<S>,
    pulses: Option<PulseReference<S>>,
}

/// The standing of an axis' settings: the outputs are enabled only if no axis is [`Missing`](Self::Missing) and one is
/// [`Done`](Self::Done).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Commissioning {
    /// Nobody has commissioned the axis, and its law puts out nothing.
    #[default]
    Inert,
    /// Nobody has commissioned the axis, but its law would drive it.
    Missing,
    /// The axis was commissioned.
    Done,
}

impl<S: Scalar, const N: usize> Axis<S, N> {
    /// An axis that puts out nothing: room for one that an [`AxisBuilder`] makes in its place.
    #[inline(never)]
    pub fn blank() -> Self {
        Self {
            encoder: Encoder::default(),
            unit_mm: S::Gain::default(),
            unit_mm_s: S::Gain::default(),
            feedback: Feedback::Pid(Pid::default()),
            filters: Filters::NONE,
            feedforward: Feedforward::blank(),
            preview_ticks: 0,
            amplifier: Amplifier::default(),
            bumpless_decay: S::ZERO,
            overspeed: Overspeed::default(),
            signal_loss: SignalLoss::default(),
            plausibility: Plausibility::default(),
            overload: Overload::UNLIMITED,
            oscillation: Oscillation::off(),
            index_spacing: IndexSpacing::default(),
            following: Following::default(),
            travel: Travel::UNLIMITED,
            standstill: Standstill::ALWAYS,
            reduced_speed: u32::MAX,
            generator: ReferenceGenerator::default(),
            commissioning: Commissioning::Inert,
            adapts: false,
            learns: false,
            learning: Learning::off(),
            cancels: false,
            cancelling: Cancelling::off(),
            feedforward_alone: false,
            pulses: None,
        }
    }

    /// The standing of the axis' settings.
    pub const fn commissioning(&self) -> Commissioning {
        self.commissioning
    }

    /// The reference of another control's pulses, if the axis follows any.
    pub const fn pulses(&self) -> Option<&PulseReference<S>> {
        self.pulses.as_ref()
    }

    /// Converter codes per volt; negative where the output is reversed.
    pub const fn codes_per_volt(&self) -> S::Gain {
        self.amplifier.codes_per_volt
    }

    /// One control period of an axis that is driven by itself, without a stage: reads the encoder, advances the
    /// reference, computes the output.
    ///
    /// # Errors
    /// The fault that was found, if any. It is the caller who switches the amplifier off.
    pub fn tick(
        &self,
        state: &mut AxisState<S, N>,
        motion: &Motion<S>,
        reading: &EncoderReading,
    ) -> Result<DacCode, FaultCode> {
        let tick = state.count_tick();
        self.read_encoder(state, reading, is_due(tick, 0))?;
        self.update_reference(state, motion, AxisSwitches::default(), tick)?;
        Ok(self.drive(state, false))
    }

    /// One control period of an axis that is driven by itself, on a reference from elsewhere: a trajectory planner of the
    /// caller's. `ahead` is where the reference will be after the preview, and its derivatives there. It begins where the axis
    /// was last [to hold](Self::hold_here).
    ///
    /// # Errors
    /// The fault that was found, if any; a reference that is no finite number is a following error. It is the caller who switches the
    /// amplifier off.
    pub fn follow(
        &self,
        state: &mut AxisState<S, N>,
        ahead: &ReferenceSample<S>,
        reading: &EncoderReading,
    ) -> Result<DacCode, FaultCode> {
        let tick = state.count_tick();
        self.read_encoder(state, reading, is_due(tick, 0))?;
        // Infinite or no number: nothing that is made of it could be compared with a limit.
        let is_finite = |value: S| value + -value == S::ZERO;
        if !is_finite(ahead.velocity) || !is_finite(ahead.acceleration) {
            return Err(FaultCode::FollowingError);
        }
        state.move_reference(ahead);
        let found = self.check_limits(state, AxisSwitches::default());
        self.form_error(state, tick)?;
        found?;
        Ok(self.drive(state, false))
    }

    /// Takes the encoder's reading and checks it. `due`: it is compared with the plant in this tick.
    #[inline(always)]
    pub(crate) fn read_encoder(
        &self,
        state: &mut AxisState<S, N>,
        reading: &EncoderReading,
        due: bool,
    ) -> Result<(), FaultCode> {
        let counts = self.encoder.accumulate(&mut state.encoder, reading.count);
        state.telemetry.measured = state.encoder.count();
        state.overspeed.filter(counts);
        let alive = self
            .signal_loss
            .step(&mut state.signal_loss, counts, state.telemetry.output);
        let watched = if due { self.compare(state) } else { Ok(()) };
        let usual = alive
            && watched.is_ok()
            && self.encoder.is_plausible(counts)
            && self.is_slow(state)
            && (state.homed || !self.encoder.is_absolute())
            && reading.is_plain();
        if !usual {
            return self.examine(state, reading, counts, alive, watched);
        }
        Ok(())
    }

    /// True if the measured speed is within its limits.
    #[inline(always)]
    fn is_slow(&self, state: &AxisState<S, N>) -> bool {
        if !self.overspeed.allows(&state.overspeed) {
            return false;
        }
        if state.homed {
            return true;
        }
        cold_path();
        state.speed().unsigned_abs() <= self.reduced_speed
    }

    /// Examines a reading that has an index pulse, or that a monitor takes for a fault.
    #[cold]
    #[inline(never)]
    fn examine(
        &self,
        state: &mut AxisState<S, N>,
        reading: &EncoderReading,
        counts: i32,
        alive: bool,
        watched: Result<(), FaultCode>,
    ) -> Result<(), FaultCode> {
        let possible = self.encoder.is_plausible(counts);
        let slow = self.is_slow(state);
        if !state.homed {
            self.find_position(state, reading);
        }
        let indexed = match reading.index {
            Some(raw) => self.take_pulse(state, raw),
            None => true,
        };
        // An index pulse, and nothing wrong.
        if indexed && possible && slow && alive && watched.is_ok() && reading.is_good() {
            return Ok(());
        }
        cold_path();
        let agrees = watched != Err(FaultCode::EncoderImplausible);
        // Where counts may be lost, so is the origin.
        if [reading.valid, possible, indexed, agrees].contains(&false) {
            state.homed = false;
        }
        // The first that explains the others.
        Err(if !reading.fresh {
            FaultCode::StaleSample
        } else if !reading.valid {
            FaultCode::EncoderInvalid
        } else if !possible {
            FaultCode::EncoderJump
        } else if !indexed {
            FaultCode::IndexMismatch
        } else if !slow {
            FaultCode::Overspeed
        } else if !agrees {
            FaultCode::EncoderImplausible
        } else if !alive {
            FaultCode::EncoderSignalLoss
        } else {
            return watched;
        })
    }

    /// Takes the position of an absolute encoder. An axis outside its travel counts as homed once it is inside: another encoder may
    /// have been fitted.
    fn find_position(&self, state: &mut AxisState<S, N>, reading: &EncoderReading) {
        let (raw, good) = (reading.count, reading.is_good());
        if let Some(offset) = self.encoder.find(&mut state.encoder, raw, good) {
            if offset != Position::ZERO {
                Self::shift(state, offset);
            }
            state.homed = self.travel.holds(state.encoder.position());
        }
    }

    /// Compares the encoder with the plant, and watches the load.
    #[inline(never)]
    fn compare(&self, state: &mut AxisState<S, N>) -> Result<(), FaultCode> {
        if self.adapts {
            if self.learns {
                self.learn(state);
            }
            if self.cancels {
                self.cancel(state);
            }
        }
        let shown = state.shown();
        let within_load = self
            .overload
            .step(&mut state.overload, state.telemetry.code.0);
        let stable = self.watch_oscillation(state);
        if !self.plausibility.step(&mut state.plausibility, shown) {
            Err(FaultCode::EncoderImplausible)
        } else if !within_load {
            Err(FaultCode::Overload)
        } else if !stable {
            Err(FaultCode::Oscillation)
        } else {
            Ok(())
        }
    }

    /// Watches the error of the last tick for oscillation; returns false if the axis is not stable.
    #[inline(always)]
    fn watch_oscillation(&self, state: &mut AxisState<S, N>) -> bool {
        let seen = &state.telemetry;
        let reference = seen.reference.0 >> POSITION_FRACTION_BITS;
        let input = OscillationInput {
            error: reference.wrapping_sub(seen.measured.0),
            reference,
            sense: i8::from(seen.velocity > S::ZERO) - i8::from(seen.velocity < S::ZERO),
            speed: state.displacement.0.unsigned_abs().min(u64::from(u32::MAX)) as u32,
            excited: (state.injected != S::ZERO) | (state.mode() == MotionMode::OpenLoop),
        };
        self.oscillation.step(&mut state.oscillation, input)
    }

    /// Learns from what the last tick left.
    #[inline(never)]
    fn learn(&self, state: &mut AxisState<S, N>) {
        let seen = &state.telemetry;
        if !self.learning.look(&mut state.learning, seen.error) {
            return;
        }
        let status = if !matches!(
            state.mode(),
            MotionMode::Plan | MotionMode::Stream | MotionMode::Hold
        ) || state.injected != S::ZERO
        {
            LearningStatus::OtherMotion
        } else if seen.velocity == S::ZERO {
            LearningStatus::AtRest
        } else {
            LearningStatus::Learning
        };
        let input = LearningInput {
            error: seen.error,
            status,
        };
        let is_reduced = state.oscillation.is_reduced();
        if is_reduced {
            self.learning.unsettle(&mut state.learning);
        }
        let mut gained =
            self.learning
                .step(&mut state.learning, input, |error| match &self.feedback {
                    Feedback::NPid(law) => Some(law.gain.at(error)),
                    _ => None,
                });
        if is_reduced {
            // The output gained no more than the share of it that is fed forward.
            let share = self.oscillation.share(&state.oscillation);
            gained = gained.times(share, Quantity::Multiplier);
        }
        state.feedback.unload(gained);
        state.rest.unload(gained);
        state.fading.unload(gained);
    }

    /// Takes a step of cancelling, on what the last tick left.
    #[inline(never)]
    fn cancel(&self, state: &mut AxisState<S, N>) {
        let mode = state.mode();
        if mode != MotionMode::OpenLoop {
            let words = self.cancelling.mean(&state.cancelling);
            let words = words.round_scaled(self.amplifier.codes_per_volt);
            state.plausibility.leave_out(words);
        }
        let works = matches!(
            mode,
            MotionMode::Plan | MotionMode::Stream | MotionMode::Hold
        );
        let seen = &state.telemetry;
        let fed = works & (state.injected == S::ZERO) & (seen.velocity != S::ZERO);
        let cut = if fed { Cut::Fed } else { Cut::Idle };
        self.cancelling.step(&mut state.cancelling, seen.error, cut);
    }

    /// Takes the count that was latched at an index pulse; returns true if it fits the last one.
    fn take_pulse(&self, state: &mut AxisState<S, N>, raw: u32) -> bool {
        let at = self.encoder.count_at(&state.encoder, raw);
        state.pulse = Some(at.position());
        self.index_spacing.step(&mut state.index, at.0 as u32)
    }

    /// True if the axis has to be homed before it may start more than jogs and homing.
    pub(crate) fn awaits_homing(&self, state: &AxisState<S, N>) -> bool {
        (self.reduced_speed != u32::MAX) & !state.homed
    }

    /// True if the measured speed is that of an axis that stands. `begins` where `standstill` was not asked in the tick before.
    pub(crate) fn stands(
        &self,
        state: &AxisState<S, N>,
        standstill: &mut StandstillState,
        begins: bool,
    ) -> bool {
        self.standstill.step(standstill, state.speed(), begins)
    }

    /// Prepares to hold the measured position, and forgets what went before: when the outputs are switched on, or in every tick that
    /// they are off.
    pub fn hold_here(&self, state: &mut AxisState<S, N>) {
        let here = state.encoder.position();
        let shown = Shown {
            speed: 0,
            reference: Shown::reference(here),
            ..state.shown()
        };
        // Field by field: a whole state, made apart and copied, takes half a tick longer.
        let AxisState {
            encoder: _,
            homed: _,
            overload: _,
            index: _,
            ticks: _,
            overspeed,
            signal_loss,
            travel,
            telemetry,
            displacement,
            displacement_before,
            look_ahead,
            following,
            acceleration,
            reference_velocity,
            injected,
            feedback,
            rest,
            fading,
            filters,
            friction,
            generator,
            plausibility,
            oscillation,
            preview,
            pulse,
            learning,
            cancelling,
        } = state;
        *overspeed = OverspeedState::default();
        *signal_loss = SignalLossState::default();
        *travel = TravelState::default();
        telemetry.bumpless_offset = S::ZERO;
        telemetry.output = S::ZERO;
        *displacement = Position::ZERO;
        *displacement_before = Position::ZERO;
        *look_ahead = here;
        *following = self.following.start();
        *acceleration = S::ZERO;
        *reference_velocity = S::ZERO;
        *injected = S::ZERO;
        *feedback = FeedbackState::default();
        *rest = RestState::default();
        *fading = FadingState::default();
        *filters = FiltersState::default();
        *friction = self.feedforward.start();
        generator.reset();
        *plausibility = self.plausibility.start(shown);
        self.oscillation.restart(oscillation);
        *preview = [here; PREVIEW_ROOM];
        *pulse = None;
        self.learning.resume(learning);
        if self.cancels {
            self.cancelling.start(cancelling);
        }
    }

    /// Starts the motion of the plan, which the axis will be given in every tick, from where the reference stands. Unlike
    /// [`Command::Run`], it gives the axis the length and the speed of the strokes.
    pub fn run(&self, state: &mut AxisState<S, N>, motion: &Motion<S>) {
        self.handle_command(state, Command::Run);
        let planned = motion.planned_stroke();
        self.oscillation.plan(&mut state.oscillation, planned);
    }

    /// Starts or ends a motion, from where the reference stands. Only what
    /// [`admission`](crate::admission::refusal) lets through may come here.
    pub fn handle_command(&self, state: &mut AxisState<S, N>, command: Command) {
        let (generator, here) = (&mut state.generator, state.look_ahead);
        self.oscillation.plan(&mut state.oscillation, None);
        match command {
            Command::Run | Command::StartMove(_) => self.generator.start_plan(generator, here),
            Command::Jog(_, velocity) => {
                self.generator
                    .start_jog(generator, here, velocity, state.homed);
            }
            Command::StartStream => self.generator.start_stream(generator),
            Command::Stop => self.stop(state),
            Command::Home(_) => {
                if self.generator.start_homing(generator, here) {
                    state.homed = false;
                    state.pulse = None;
                }
            }
            // The stage's own.
            Command::StartInjection | Command::Enable | Command::Disable | Command::ResetFault => {}
        }
    }

    /// Puts the feedback's reference of tick `tick` where a planner has it, in the place of what the feedforward's was after the
    /// preview: an extrapolated reference does not pass its error on.
    pub(crate) fn place_reference(&self, state: &mut AxisState<S, N>, now: Position, tick: u32) {
        let delayed = (tick as usize).wrapping_sub(self.preview_ticks) % PREVIEW_ROOM;
        state.preview[delayed] = now;
    }

    /// Shifts the feedback's reference of tick `tick` from where the feedforward's was before the preview.
    pub(crate) fn shift_reference(&self, state: &mut AxisState<S, N>, by: Position, tick: u32) {
        let delayed = (tick as usize).wrapping_sub(self.preview_ticks) % PREVIEW_ROOM;
        state.preview[delayed] = state.preview[delayed] + by;
    }

    /// Begins a controlled stop, unless one is under way.
    pub(crate) fn stop(&self, state: &mut AxisState<S, N>) {
        let from = state.reference_state();
        self.generator.stop(&mut state.generator, from);
    }

    /// Shifts every position of the axis: nothing moves by it.
    #[cold]
    #[inline(never)]
    fn shift(state: &mut AxisState<S, N>, offset: Position) {
        state.encoder.shift(offset);
        state.telemetry.measured = state.encoder.count();
        state.plausibility.recount(state.encoder.count().0 as i32);
        state.look_ahead = state.look_ahead + offset;
        for position in &mut state.preview {
            *position = *position + offset;
        }
        // Distances to pulses before the shift would be off by it.
        IndexSpacing::forget(&mut state.index);
        state.travel = TravelState::default();
        state.homed = true;
    }

    /// Checks the reference against limit switches and soft limits.
    #[inline(always)]
    fn check_limits(
        &self,
        state: &mut AxisState<S, N>,
        switches: AxisSwitches,
    ) -> Result<(), FaultCode> {
        if switches.at_limit() {
            // Away from a pressed switch the axis may go.
            let forward = state.displacement > Position::ZERO;
            let backward = state.displacement < Position::ZERO;
            if forward && switches.has(AxisSwitches::POSITIVE_LIMIT) {
                return Err(FaultCode::PositiveLimitSwitch);
            }
            if backward && switches.has(AxisSwitches::NEGATIVE_LIMIT) {
                return Err(FaultCode::NegativeLimitSwitch);
            }
        }
        if !state.homed {
            return Ok(());
        }
        if self
            .travel
            .is_clear(state.look_ahead, state.encoder.position())
        {
            state.travel.enter();
            return Ok(());
        }
        self.check_travel(state)
    }

    /// Checks an axis near an end of its travel or beyond.
    #[inline(never)]
    fn check_travel(&self, state: &mut AxisState<S, N>) -> Result<(), FaultCode> {
        self.travel.step(
            &mut state.travel,
            self.generator.stop_ramp(),
            state.look_ahead,
            state.displacement,
            state.encoder.position(),
        )
    }

    /// Advances the reference, forms the error, and checks both. `tick` numbers the ticks.
    #[inline(never)]
    pub(crate) fn update_reference(
        &self,
        state: &mut AxisState<S, N>,
        motion: &Motion<S>,
        switches: AxisSwitches,
        tick: u32,
    ) -> Result<(), FaultCode> {
        let here = state.look_ahead;
        let planned = self
            .generator
            .advance_plan(&mut state.generator, motion, here);
        let Some(ahead) = planned else {
            return self.update_other_reference(state, motion, switches, tick);
        };
        state.move_reference(&ahead);
        let found = self.check_limits(state, switches);
        self.form_error(state, tick)?;
        found
    }

    /// The same in every mode but the plan's and standstill.
    #[inline(never)]
    fn update_other_reference(
        &self,
        state: &mut AxisState<S, N>,
        motion: &Motion<S>,
        switches: AxisSwitches,
        tick: u32,
    ) -> Result<(), FaultCode> {
        let input = HomingInput {
            switches,
            index: state.pulse.take(),
            measured: state.encoder.position(),
        };
        let from = state.reference_state();
        let (ahead, event) =
            self.generator
                .advance(&mut state.generator, motion, from, state.homed, input);
        if event == GeneratorEvent::Open {
            return self.update_open_reference(state, switches, tick);
        }
        if let GeneratorEvent::Origin(offset) = event {
            Self::shift(state, offset);
        }
        state.move_reference(&ahead);
        let switches = switches.without(self.generator.expected(&state.generator));
        let mut found = if state.mode() == MotionMode::Stopping {
            Ok(())
        } else {
            self.check_limits(state, switches)
        };
        if let GeneratorEvent::Fault(code) = event {
            found = Err(code);
        }
        self.form_error(state, tick)?;
        found
    }

    /// Forms the error, and checks it.
    #[inline(always)]
    fn form_error(&self, state: &mut AxisState<S, N>, tick: u32) -> Result<(), FaultCode> {
        // The feedback's reference is what the feedforward's was `preview_ticks` ago.
        let slot = tick as usize % PREVIEW_ROOM;
        state.preview[slot] = state.look_ahead;
        let delayed = (tick as usize).wrapping_sub(self.preview_ticks) % PREVIEW_ROOM;
        let reference = state.preview[delayed];
        if self.feedback.needs_velocity() {
            let before = state.preview[delayed.wrapping_sub(1) % PREVIEW_ROOM];
            let displacement = (reference - before).clipped();
            state.reference_velocity = S::scale_integer(displacement, self.unit_mm_s);
        }

        let measured = state.encoder.position();
        let error = S::scale_wide((reference - measured).0, self.unit_mm);
        state.telemetry.reference = reference;
        state.telemetry.error = error;
        let speed = state.telemetry.velocity.magnitude();
        let follows = self.following.step(&mut state.following, error, speed);
        // An axis that does not follow cannot be stopped under control, so this goes before what could.
        if follows {
            Ok(())
        } else {
            Err(FaultCode::FollowingError)
        }
    }

    /// Lets the reference go along with the axis, so that the loop can be closed at any tick, and checks it.
    #[cold]
    #[inline(never)]
    fn update_open_reference(
        &self,
        state: &mut AxisState<S, N>,
        switches: AxisSwitches,
        tick: u32,
    ) -> Result<(), FaultCode> {
        let here = state.encoder.position();
        let speed = i64::from(state.speed()) << SPEED_SHIFT;
        let ahead_by = |ticks: i64| here + Position(ticks * speed);
        let preview = self.preview_ticks as i64;
        for age in 0..PREVIEW_ROOM {
            let slot = (tick as usize).wrapping_sub(age) % PREVIEW_ROOM;
            state.preview[slot] = ahead_by(preview - age as i64);
        }
        state.look_ahead = ahead_by(preview);
        state.displacement = Position(speed);
        state.displacement_before = state.displacement;
        let velocity = S::scale_integer(state.displacement.clipped(), self.unit_mm_s);
        state.reference_velocity = velocity;
        state.telemetry.error = S::ZERO;
        state.telemetry.velocity = velocity;
        state.telemetry.reference = here;
        self.check_limits(state, switches)
    }

    /// Computes the output. `changed` says that the settings are new in this tick: the output then starts from where
    /// it was, and the difference fades.
    #[inline(never)]
    pub(crate) fn drive(&self, state: &mut AxisState<S, N>, changed: bool) -> DacCode {
        if state.mode() == MotionMode::OpenLoop {
            return self.drive_open(state, changed);
        }
        let moves = state.telemetry.velocity != S::ZERO;
        if state.rest.changes(moves) {
            self.set_off_or_stop(state, moves);
        }
        let seen = &mut state.telemetry;
        let step = ReferenceStep {
            displacement: S::scale_integer(state.displacement.clipped(), self.unit_mm),
            velocity: seen.velocity,
            acceleration: state.acceleration,
        };
        if changed {
            self.feedforward.go_on(&mut state.friction, step.velocity);
            self.oscillation.forget(&mut state.oscillation);
        }
        seen.feedforward = self.feedforward.step(&mut state.friction, step);
        let mut total = seen.feedforward.total();
        let error = seen.error;
        if self.adapts {
            if self.learns {
                total = self.scale_friction(state, changed);
            }
            if self.cancels {
                total = total + self.add_cancelling(state, changed);
            }
        }
        if state.oscillation.is_reduced() | state.oscillation.has_changed() {
            total = self.take_away(state, total);
        }
        let input = FeedbackInput {
            error,
            velocity: state.reference_velocity,
        };
        if changed {
            self.make_bumpless(state, input, total + state.injected);
        }
        let base = total + state.telemetry.bumpless_offset + state.injected;
        let mut feedback = self.feed_back(&mut state.feedback, input, base);
        feedback.output = self.filters.step(&mut state.filters, feedback.output);
        let mut output = feedback.output + base;
        if !output.is_within(self.amplifier.limit) {
            cold_path();
            output = output.within(self.amplifier.limit);
            // The law keeps to the limit; filters behind it may not.
            feedback.saturated = true;
        }
        let seen = &mut state.telemetry;
        seen.feedback = feedback;
        seen.bumpless_offset = seen
            .bumpless_offset
            .times(self.bumpless_decay, Quantity::Fraction);
        let code = self.put_out(state, output);
        if self.feedforward_alone {
            return self.feedforward_code(state);
        }
        code
    }

    /// The word of the feedforward alone, for an amplifier whose loop is another drive's. The law's own word stays what monitors and
    /// learning compute with: that drive puts out about the same.
    #[cold]
    #[inline(never)]
    fn feedforward_code(&self, state: &AxisState<S, N>) -> DacCode {
        let total = state.telemetry.feedforward.total();
        self.amplifier.code(total.within(self.amplifier.limit))
    }

    /// Takes note of a stop; at the next start the friction fed forward takes over the integral's change since then.
    #[cold]
    #[inline(never)]
    fn set_off_or_stop(&self, state: &mut AxisState<S, N>, moves: bool) {
        let integral = state.feedback.integral();
        if !moves {
            return state.rest.stop(integral);
        }
        state.fading.set_off(integral);
        let since_stop = state.rest.set_off(integral);
        let mut held = S::ZERO;
        let taken = if self.oscillation.returns_from_rest(&mut state.oscillation) {
            // The axis was held by the integral, not by what the model says, and by what is left of that.
            state.friction = self.feedforward.start();
            held = state.telemetry.feedforward.presliding;
            Some(state.fading.taken_up(integral) + held)
        } else {
            since_stop
        };
        let Some(mut taken) = taken else {
            return;
        };
        if self.learns {
            taken = self.learning.unscaled(&state.learning, taken);
        }
        taken = self.feedforward.take_over(&mut state.friction, taken);
        if self.learns {
            taken = self.learning.take_over(&mut state.learning, taken);
        }
        if state.oscillation.is_reduced() {
            let share = self.oscillation.share(&state.oscillation);
            taken = taken.times(share, Quantity::Multiplier);
        }
        self.unload(state, taken - held);
    }

    /// Takes a voltage that something else puts out from the integral.
    #[inline(always)]
    fn unload(&self, state: &mut AxisState<S, N>, voltage: S) {
        state.feedback.unload(voltage);
        state.rest.unload(voltage);
        self.filters.shift(&mut state.filters, -voltage);
    }

    /// Scales the friction's feedforward as was learnt; returns the whole feedforward, V.
    #[inline(never)]
    fn scale_friction(&self, state: &mut AxisState<S, N>, changed: bool) -> S {
        if changed {
            state.learning = self.learning.start();
        }
        let terms = &mut state.telemetry.feedforward;
        self.learning.apply(&mut state.learning, terms);
        terms.total()
    }

    /// The voltage that cancels; after a change of settings it begins at none.
    #[inline(always)]
    fn add_cancelling(&self, state: &mut AxisState<S, N>, changed: bool) -> S {
        if changed {
            self.cancelling.start(&mut state.cancelling);
        }
        self.cancelling.advance(&mut state.cancelling)
    }

    /// Leaves of the friction fed forward the share that the monitor for oscillation allows; returns the whole feedforward, V.
    ///
    /// Cancelling is left alone: it has a guard of its own, and would learn nothing right of a part of itself.
    #[cold]
    #[inline(never)]
    fn take_away(&self, state: &mut AxisState<S, N>, total: S) -> S {
        let share = self.oscillation.share(&state.oscillation);
        if state.oscillation.has_changed() {
            self.give_back(state);
        }
        let terms = &mut state.telemetry.feedforward;
        let cancelled = total - terms.total();
        terms.scale_friction(share);
        terms.total() + cancelled
    }

    /// Lets the integral give back what it has taken up of friction that returns.
    #[cold]
    #[inline(never)]
    fn give_back(&self, state: &mut AxisState<S, N>) {
        let integral = state.feedback.integral();
        if state.oscillation.was_whole() {
            state.fading.begin(integral);
        }
        let returned = self.oscillation.returned(&mut state.oscillation);
        let friction = state.telemetry.feedforward.friction();
        let friction = friction.times(returned, Quantity::Multiplier);
        let given = state.fading.returns(integral, friction);
        self.unload(state, given);
    }

    /// Puts the injected voltage out.
    #[cold]
    #[inline(never)]
    fn drive_open(&self, state: &mut AxisState<S, N>, changed: bool) -> DacCode {
        if changed {
            self.forget_learnt(state);
        }
        let output = state.injected.within(self.amplifier.limit);
        state.telemetry.feedback = FeedbackTerms {
            saturated: output != state.injected,
            ..FeedbackTerms::default()
        };
        state.telemetry.feedforward = FeedforwardTerms::default();
        self.put_out(state, output)
    }

    /// Makes a converter's word of the output, and leaves everything to be seen.
    #[inline(always)]
    fn put_out(&self, state: &mut AxisState<S, N>, output: S) -> DacCode {
        let code = self.amplifier.code(output);
        let telemetry = &mut state.telemetry;
        telemetry.output = output;
        telemetry.code = code;
        telemetry.code_sum = telemetry.code_sum.wrapping_add(code.0.into());
        telemetry.limited_by = if telemetry.feedback.saturated {
            cold_path();
            state.learning.saturate();
            state.cancelling.saturate();
            LimitedBy::OutputLimit
        } else {
            LimitedBy::Nothing
        };
        code
    }

    /// The law, within what the output limit leaves beside `base`.
    fn feed_back(
        &self,
        state: &mut FeedbackState<S>,
        input: FeedbackInput<S>,
        base: S,
    ) -> FeedbackTerms<S> {
        self.feedback.step(state, input, base, self.amplifier.limit)
    }

    /// Makes a change of settings bumpless: the output starts from where it was.
    #[cold]
    #[inline(never)]
    fn make_bumpless(&self, state: &mut AxisState<S, N>, input: FeedbackInput<S>, base: S) {
        self.feedback.take_over(&mut state.feedback, input.error);
        state.rest.forget();
        if !self.learns {
            state.learning = LearningState::default();
        }
        if !self.cancels {
            self.cancelling.start(&mut state.cancelling);
        }
        // The output under the new settings, computed on a copy, decides the offset.
        let mut trial = state.feedback.clone();
        let terms = self.feed_back(&mut trial, input, base);
        self.filters.settle(&mut state.filters, terms.output);
        state.telemetry.bumpless_offset = state.telemetry.output - (terms.output + base);
    }

    /// Opens the loop of an axis at rest.
    pub(crate) fn open_loop(&self, state: &mut AxisState<S, N>) {
        state.plausibility.forget_standstill();
        self.oscillation.plan(&mut state.oscillation, None);
        self.generator.open_loop(&mut state.generator);
    }

    /// Takes the injected voltage away. A loop that was open is closed: it stops from the motion that the axis has.
    pub(crate) fn end_injection(&self, state: &mut AxisState<S, N>) {
        state.injected = S::ZERO;
        if state.mode() == MotionMode::OpenLoop {
            // As after enabling: the law's memory is of before, and its error is zero now.
            state.feedback = FeedbackState::default();
            state.rest.forget();
            state.fading = FadingState::default();
            state.filters = FiltersState::default();
            state.friction = self.feedforward.start();
            self.learning.resume(&mut state.learning);
            self.cancelling.start(&mut state.cancelling);
            state.telemetry.bumpless_offset = S::ZERO;
            self.stop(state);
        }
    }

    /// Forgets what was learnt and cancelled under other settings.
    #[cold]
    #[inline(never)]
    fn forget_learnt(&self, state: &mut AxisState<S, N>) {
        state.learning = LearningState::default();
        self.cancelling.start(&mut state.cancelling);
        self.oscillation.forget(&mut state.oscillation);
    }

    /// Shows an axis whose outputs are off. `changed` says that the settings are new in this tick.
    #[inline(always)]
    pub(crate) fn output_zero(&self, state: &mut AxisState<S, N>, changed: bool) {
        if changed {
            self.forget_learnt(state);
        }
        let measured = state.encoder.count();
        state.generator.hold();
        state.injected = S::ZERO;
        self.oscillation.restart(&mut state.oscillation);
        state.plausibility = self.plausibility.start(state.shown());
        state.telemetry = AxisTelemetry {
            reference: state.encoder.position(),
            measured,
            code_sum: state.telemetry.code_sum,
            ..AxisTelemetry::default()
        };
    }
}
