//! The fast half: the realtime function, from HAL pins to HAL pins.

use std::io;
use std::sync::atomic::Ordering;

use quadrant::app::{Control, Enabling, TimingStatistics};
use quadrant_law::axes::AxisName;
use quadrant_law::axis::Commissioning;
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::motion::MotionMode;
use quadrant_law::safety::{AxisSwitches, FaultCode, SafetyState, Switches};
use quadrant_law::stage::{Inputs, Outputs};

use crate::encoder_scale::EncoderScale;
use crate::fault::{ENDED, HOST_DRIVES, NO_NUMBER, NOT_ENABLED, OTHER_PERIOD, OTHER_SCALE};
use crate::reference::{CommandPins, CommandReference, Preview};
use crate::slow::{self, FastEnds, Place, Report, SlowThread, Wish};

/// Largest velocity of a command that is one, mm/s.
const MOST_MM_S: f64 = 1e5;

/// Largest deviation of the thread's period from the settings'.
const PERIOD_TOLERANCE: f64 = 0.01;

/// The pins of a joint.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QuadrantJoint {
    /// In: commanded position, machine units.
    pub position_cmd: f64,
    /// In: its velocity, machine units per second.
    pub velocity_cmd: f64,
    /// In: measured position, machine units.
    pub position_fb: f64,
    /// In: the encoder's count, which no index resets.
    pub rawcounts: i32,
    /// In: LinuxCNC leads the joint.
    pub enable: bool,
    /// In: the amplifier reports a fault.
    pub amp_fault: bool,
    /// In and out: P, I, D, FF1 and FF2, V, machine units and s: those in force, or others that are to act.
    pub gains: [f64; 5],
    /// Out: voltage for the amplifier, V.
    pub output: f64,
    /// Out: friction that is fed forward, V: the level of Coulomb and Stribeck.
    pub ff_level: f64,
    /// Out: viscous friction, V.
    pub ff_viscous: f64,
    /// Out: friction before sliding, V.
    pub ff_presliding: f64,
    /// Out: inertia, V.
    pub ff_inertia: f64,
    /// Out: commanded less measured position, machine units.
    pub error: f64,
    /// Out: scale of the friction that was learnt; 1 is the commissioned one.
    pub learning: f64,
    /// Out: the joint is at fault, or another is.
    pub faulted: bool,
    /// Out: number of the fault; 0 for none.
    pub fault: i32,
}

/// Everything that passes between the pins and the law in a tick.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QuadrantPins {
    /// In: the time at which the tick began, ns.
    pub now_ns: i64,
    /// In: the thread's period, ns.
    pub period_ns: i64,
    /// In: duration of the last tick, ns.
    pub elapsed_ns: i64,
    /// In: the emergency stop is pressed.
    pub estop: bool,
    /// Out: the outputs are driven.
    pub driven: bool,
    /// Out: what a host has stored could not be written to its file.
    pub store_failed: bool,
    /// The joints: x, y, z.
    pub joints: [QuadrantJoint; 3],
}

/// Options of a component besides its [`Place`].
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// The axes that are joints.
    pub joints: [bool; 3],
    /// Length of a machine unit, mm.
    pub unit_mm: f64,
    /// Counts are made of `position_fb`, where the encoder has no `rawcounts`.
    pub counts_of_position: bool,
    /// `output` is the feedforward alone, for another loop.
    pub feedforward_only: bool,
    /// The way to the reference after the preview.
    pub preview: Preview,
    /// Periods from one tick to the next above which the outputs go off; 0 for no limit.
    pub late_periods: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            joints: [true; 3],
            unit_mm: 1.0,
            counts_of_position: false,
            feedforward_only: false,
            preview: Preview::Extrapolate,
            late_periods: 0,
        }
    }
}

/// LinuxCNC's hold on a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Hold {
    /// None: the joint stands, or a host moves it.
    #[default]
    Released,
    /// The joint follows the command.
    Leads,
}

/// A joint between two ticks.
struct Joint {
    name: AxisName,
    resolution_mm: f64,
    counts_per_mm: f64,
    /// A positive count moves the law's position down.
    reversed: bool,
    reference: CommandReference,
    scale: EncoderScale,
    rawcounts: i32,
    /// The gains that the pins show.
    gains: [f64; 5],
    was_enabled: bool,
    hold: Hold,
    /// Scale of the output's words, and what it was made of.
    codes_per_volt: f32,
    volts_per_code: f64,
}

/// The fast half of a component.
pub struct Board {
    control: Control<'static, 'static, f32>,
    ends: FastEnds,
    joints: [Option<Joint>; 3],
    options: Options,
    mm_to_units: f64,
    rate_hz: f64,
    /// The previews that act, s.
    previews_s: [f64; 3],
    /// Shortest and longest period that the settings are for, ns.
    periods_ns: [i64; 2],
    last_ns: i64,
    frames: u32,
    /// Gains that the pins have asked for so far; wraps.
    wishes: u32,
    timing: TimingStatistics,
    enabling: Enabling,
    fault: i32,
    /// The number on the pins.
    shown: i32,
    // Ends before what it is joined with.
    _thread: SlowThread,
}

impl Board {
    /// Starts the application.
    ///
    /// # Errors
    /// Files that cannot be read, settings that are refused, an address that is taken.
    pub fn start(place: &Place<'_>, options: Options) -> io::Result<Self> {
        let started = slow::start(place)?;
        let settings = &started.settings;
        let rate_hz = settings.rate_hz;
        let period_ns = 1e9 / rate_hz;
        let mut joints = [None, None, None];
        for (index, name) in AxisName::ALL.into_iter().enumerate() {
            let axis = &settings.axes[index];
            if !options.joints[index] {
                continue;
            }
            if axis.encoder.counter_bits != 32 {
                return Err(io::Error::other(format!(
                    "{name}/encoder.counter_bits = {}: pins count 32 bits; set 32",
                    axis.encoder.counter_bits
                )));
            }
            // The pins are those of LinuxCNC's own encoder and commands.
            for (part, holds) in [
                ("encoder.serial", axis.encoder.serial.is_some()),
                ("pulses", axis.pulses.is_some()),
            ] {
                if holds {
                    return Err(io::Error::other(format!(
                        "{name}/{part}: LinuxCNC reads encoders and commands by its own pins; leave the part out"
                    )));
                }
            }
            let resolution_mm = axis.encoder.resolution_mm;
            joints[index] = Some(Joint {
                name,
                resolution_mm,
                counts_per_mm: 1.0 / resolution_mm,
                reversed: axis.encoder.reversed,
                reference: CommandReference::new(resolution_mm, rate_hz, options.preview),
                scale: EncoderScale::default(),
                rawcounts: 0,
                gains: [0.0; 5],
                was_enabled: false,
                hold: Hold::Released,
                codes_per_volt: 0.0,
                volts_per_code: 0.0,
            });
        }
        let mut board = Self {
            control: started.control,
            ends: started.ends,
            joints,
            options,
            mm_to_units: 1.0 / options.unit_mm,
            rate_hz,
            previews_s: [0.0; 3],
            periods_ns: [-1.0, 1.0]
                .map(|sign| (period_ns * (1.0 + sign * PERIOD_TOLERANCE)) as i64),
            last_ns: 0,
            frames: 0,
            wishes: 0,
            timing: TimingStatistics::default(),
            enabling: Enabling::default(),
            fault: 0,
            shown: 0,
            _thread: started.thread,
        };
        board.preview(
            settings
                .axes
                .each_ref()
                .map(|axis| axis.feedforward.preview_s),
        );
        Ok(board)
    }

    /// Takes the axes' previews, s: with `delay`, all joints lag by the longest.
    fn preview(&mut self, previews_s: [f64; 3]) {
        self.previews_s = previews_s;
        let ticks = previews_s.map(|preview_s| (preview_s * self.rate_hz).round());
        let longest = ticks.into_iter().fold(0.0, f64::max);
        for joint in self.joints.iter_mut().flatten() {
            let index = joint.name as usize;
            let wait = (longest - ticks[index]) as usize;
            joint.reference.preview(previews_s[index], wait);
        }
    }

    /// The application's fast half.
    pub fn control(&self) -> &Control<'static, 'static, f32> {
        &self.control
    }

    /// One period of the realtime thread.
    pub fn tick(&mut self, pins: &mut QuadrantPins) {
        let mut inputs = self.read(pins);
        inputs.command = self.choose(pins);
        if inputs.command.is_none()
            && let Some(answer) = self.ends.answers.dequeue()
        {
            self.frames = answer.frames;
            self.control.show_glitches(answer.glitches);
            inputs.command = answer.command;
            if answer.previews_s != self.previews_s {
                self.preview(answer.previews_s);
            }
            if answer.wishes == self.wishes {
                for joint in self.joints.iter_mut().flatten() {
                    let gains = answer.gains[joint.name as usize];
                    joint.gains = gains.map(|gain| gain * self.options.unit_mm);
                    pins.joints[joint.name as usize].gains = joint.gains;
                }
            }
        }
        self.control.note_requests(self.frames);
        let outputs = self.control.tick(&mut inputs);
        self.ends
            .outputs_off
            .store(!outputs.enabled, Ordering::Relaxed);
        self.write(pins, &outputs);
        if self
            .control
            .observe(pins.elapsed_ns.clamp(0, u32::MAX.into()) as u32)
            && self.ends.reports.ready()
        {
            // There is room: only this side fills it.
            let _ = self.ends.reports.enqueue(Report {
                seen: self.control.snapshot(),
                timing: self.timing,
                fault: self.shown,
            });
        }
    }

    /// Reads the pins, and gives the axes that LinuxCNC leads their reference.
    fn read(&mut self, pins: &QuadrantPins) -> Inputs {
        let mut inputs = Inputs::default();
        if pins.estop {
            inputs.switches = Switches::EMERGENCY_STOP;
        }
        for joint in self.joints.iter_mut().flatten() {
            let seen = &pins.joints[joint.name as usize];
            let position_mm = seen.position_fb * self.options.unit_mm;
            let (count, position_mm) = if self.options.counts_of_position {
                let count = (position_mm * joint.counts_per_mm).round_ties_even() as i64;
                (count as i32, count as f64 * joint.resolution_mm)
            } else {
                (seen.rawcounts, position_mm)
            };
            let step = count.wrapping_sub(joint.rawcounts);
            joint.rawcounts = count;
            inputs.readings[joint.name] = EncoderReading::of(count as u32);
            if seen.amp_fault {
                let switches = AxisSwitches::AMPLIFIER_FAULT;
                inputs.switches = inputs.switches.with_axis(joint.name, switches);
            }
            // Bits: no number is the same as itself, too.
            let asked = seen.gains.map(f64::to_bits) != joint.gains.map(f64::to_bits);
            if asked && self.ends.wishes.ready() {
                joint.gains = seen.gains;
                self.wishes = self.wishes.wrapping_add(1);
                // There is room: only this side fills it.
                let _ = self.ends.wishes.enqueue(Wish {
                    axis: joint.name,
                    gains: seen.gains.map(|gain| gain * self.mm_to_units),
                });
            }
            let sign = if joint.reversed { -1 } else { 1 };
            let moved = sign * i64::from(step);
            let counted_mm = moved as f64 * joint.resolution_mm;
            if !self.options.counts_of_position
                && !joint.scale.agrees(counted_mm, position_mm)
                && seen.enable
            {
                self.fault = OTHER_SCALE;
            }
            let before = self.control.state().axes()[joint.name].telemetry().measured;
            let measured = before.0 + moved;
            let begins = joint.hold == Hold::Released;
            let command_mm = seen.position_cmd * self.options.unit_mm;
            let command = CommandPins {
                ahead_mm: command_mm - position_mm,
                velocity_mm_s: seen.velocity_cmd * self.options.unit_mm,
            };
            // False also for what is no number.
            let is_motion = command.velocity_mm_s.abs() <= MOST_MM_S;
            if !(command.ahead_mm.is_finite() && is_motion) {
                self.fault = NO_NUMBER;
                continue;
            }
            let led = joint.reference.step(command, measured, begins);
            if seen.enable {
                self.control.lead(joint.name, led.now, led.ahead);
            }
        }
        let since_ns = pins.now_ns.wrapping_sub(self.last_ns);
        let most_ns = pins
            .period_ns
            .saturating_mul(self.options.late_periods.into());
        if most_ns > 0 && self.last_ns != 0 && since_ns > most_ns {
            inputs.deadline_missed = true;
            self.timing.overruns = self.timing.overruns.wrapping_add(1);
        }
        self.last_ns = pins.now_ns;
        let elapsed = pins.elapsed_ns.clamp(0, u32::MAX.into()) as u32;
        self.timing.longest_tick_cycles = self.timing.longest_tick_cycles.max(elapsed);
        inputs
    }

    /// The command that the pins bring about in this tick.
    fn choose(&mut self, pins: &QuadrantPins) -> Option<Command> {
        let safety = self.control.state().safety();
        let (mut rose, mut fell, mut any) = (false, false, false);
        for joint in self.joints.iter_mut().flatten() {
            let enable = pins.joints[joint.name as usize].enable;
            rose |= enable && !joint.was_enabled;
            fell |= joint.was_enabled && !enable;
            any |= enable;
            joint.was_enabled = enable;
            if !(enable && safety.is_enabled()) && joint.hold == Hold::Leads {
                joint.hold = Hold::Released;
                self.control.release(joint.name);
            }
        }
        if rose {
            self.enabling.begin();
            self.fault = 0;
        }
        let [shortest, longest] = self.periods_ns;
        if !(shortest..=longest).contains(&pins.period_ns) {
            self.fault = OTHER_PERIOD;
        }
        let ends = fell || !any || self.fault != 0;
        if ends {
            self.enabling.end();
        }
        if let SafetyState::Stopping(fault) | SafetyState::Faulted(fault) = safety
            && !self.enabling.is_under_way()
            && self.fault == 0
            && any
        {
            self.fault = fault.code.number().into();
        }
        // A fault of a joint that LinuxCNC leads ends no motion by a ramp: the output is zero already.
        if fell || any && (self.fault != 0 || matches!(safety, SafetyState::Stopping(_))) {
            return safety.drives().then_some(Command::Disable);
        }
        // Two cannot lead: all ends here, and LinuxCNC does not take over what it has not seen begin.
        let mut joints = self.joints.iter().flatten();
        if rose && safety.drives() && !joints.any(|joint| joint.hold == Hold::Leads) {
            self.fault = HOST_DRIVES;
            self.enabling.end();
            return Some(Command::Disable);
        }
        let command = self.enabling.step(safety);
        if command.is_some() {
            return command;
        }
        if safety.is_enabled() {
            return self.take_hold();
        }
        if any && !self.enabling.is_under_way() && self.fault == 0 {
            self.fault = why_not(pins);
        }
        None
    }

    /// Lets the next joint that is enabled and stands follow its command; finds one that no longer does.
    fn take_hold(&mut self) -> Option<Command> {
        for joint in self.joints.iter_mut().flatten() {
            let mode = self.control.state().axes()[joint.name].mode();
            let axis = self.control.stage().axes[joint.name];
            match joint.hold {
                Hold::Leads if mode != MotionMode::Plan => {
                    self.fault = ENDED;
                    return Some(Command::Disable);
                }
                // Without a law it would have no voltage, and LinuxCNC would take it for driven.
                Hold::Released
                    if joint.was_enabled && axis.commissioning() == Commissioning::Inert =>
                {
                    self.fault = NOT_ENABLED;
                    return Some(Command::Disable);
                }
                Hold::Released if joint.was_enabled && mode == MotionMode::Hold => {
                    joint.hold = Hold::Leads;
                    return Some(Command::StartMove(joint.name));
                }
                _ => {}
            }
        }
        None
    }

    /// Writes the pins.
    fn write(&mut self, pins: &mut QuadrantPins, outputs: &Outputs) {
        let safety = self.control.state().safety();
        let any = self.joints.iter().flatten().any(|joint| joint.was_enabled);
        if self.fault == 0
            && any
            && !self.enabling.is_under_way()
            && let Some(fault) = safety.fault()
        {
            self.fault = fault.code.number().into();
        }
        pins.driven = outputs.enabled && !(any && self.fault != 0);
        pins.store_failed = self.ends.store_failed.load(Ordering::Relaxed);
        // While the outputs are being enabled, an old fault is being reset.
        let fault = if self.fault == 0 && !self.enabling.is_under_way() {
            safety.fault().map_or(0, |fault| fault.code.number().into())
        } else {
            self.fault
        };
        self.shown = fault;
        for joint in self.joints.iter_mut().flatten() {
            let axis = &self.control.state().axes()[joint.name];
            let codes_per_volt = self.control.stage().axes[joint.name].codes_per_volt().abs();
            if codes_per_volt != joint.codes_per_volt {
                joint.rescale(codes_per_volt);
            }
            let seen = axis.telemetry();
            let terms = &seen.feedforward;
            let place = &mut pins.joints[joint.name as usize];
            // A host's motion would add the whole law to the other loop.
            let silent = self.options.feedforward_only && joint.hold != Hold::Leads;
            place.output = if !pins.driven || silent {
                0.0
            } else if self.options.feedforward_only {
                terms.total().into()
            } else {
                f64::from(outputs.codes[joint.name].0) * joint.volts_per_code
            };
            place.ff_level = terms.level.into();
            place.ff_viscous = terms.viscous.into();
            place.ff_presliding = terms.presliding.into();
            place.ff_inertia = terms.inertia.into();
            place.error = f64::from(seen.error) * self.mm_to_units;
            place.learning = axis.learning().reading().scale().into();
            place.faulted = fault != 0;
            place.fault = fault;
        }
    }
}

impl Joint {
    /// Takes the scale of new settings: the only division of a tick, and not of every one.
    #[cold]
    fn rescale(&mut self, codes_per_volt: f32) {
        self.codes_per_volt = codes_per_volt;
        self.volts_per_code = 1.0 / f64::from(codes_per_volt);
    }
}

/// The number on `fault` of outputs that could not be enabled.
fn why_not(pins: &QuadrantPins) -> i32 {
    let amplifier = pins.joints.iter().any(|joint| joint.amp_fault);
    if pins.estop {
        FaultCode::EmergencyStop.number().into()
    } else if amplifier {
        FaultCode::AmplifierFault.number().into()
    } else {
        NOT_ENABLED
    }
}
