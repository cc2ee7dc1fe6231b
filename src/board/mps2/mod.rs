//! The emulated machine: Arm MPS2 with the AN386 image (Cortex-M4F) or AN385 (Cortex-M3), as QEMU has them.
//!
//! There are no encoders and no amplifiers: counts come from, and codes go to, memory shared with a process on the
//! host. See `quadrant_lockstep` for its map and the ways to run.

pub(crate) mod device;
mod fault_injection;
mod flash;
mod guard;
mod mailbox;
mod nap;
mod serial;
mod timer;
mod watchdog;

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use cortex_m_semihosting::debug;
use defmt_semihosting as _;

use quadrant::app::log_ring::TakeLog;
use quadrant::drivers::tick_interval::TickInterval;
use quadrant::hal::{self, ResetCause};
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::safety;
use quadrant_law::stage::Outputs;
use quadrant_law::supervisor::PERIOD_TICKS;

pub(crate) use self::flash::SettingsFlash;
use self::nap::Nap;
pub(crate) use self::serial::Serial;
pub(crate) use self::watchdog::Watchdog;
use super::{Finished, Outcome};
use quadrant_lockstep::{
    END_OF_RUN, InputRecord, Mode, OutputRecord, RECORDED_INPUTS, RECORDED_OUTPUTS, RECORDED_TICKS,
    Reset,
};

/// Control ticks begun. Written by [`Tick::begin`] alone.
static TICKS: AtomicU32 = AtomicU32::new(0);

/// Offset of this tick's inputs. Written by [`Tick::begin`] alone.
static INPUTS: AtomicU32 = AtomicU32::new(RECORDED_INPUTS as u32);

/// Cycles from the start of the control timer to the last tick of a paced run.
static PACED_CYCLES: AtomicU32 = AtomicU32::new(0);

/// The machine, started, in pieces.
pub(crate) struct Board {
    /// Three position encoders.
    pub(crate) encoders: Encoders,
    /// Limits, homes, amplifier faults, emergency stop.
    pub(crate) switches: Switches,
    /// The operator's requests.
    pub(crate) operator: Operator,
    /// Three amplifiers.
    pub(crate) amplifiers: Amplifiers,
    /// The control tick.
    pub(crate) tick: Tick,
    /// Another control's step and direction: none.
    pub(crate) pulses: Pulses,
    /// The work of the idle loop.
    pub(crate) idle: Idle,
    /// The link's port, in the shared memory.
    pub(crate) serial: Serial,
    /// The watchdog, which bites in a paced run.
    pub(crate) watchdog: Watchdog,
    /// The flash for settings, in the shared memory.
    pub(crate) flash: SettingsFlash,
    /// The cause of the start.
    pub(crate) reset_cause: ResetCause,
}

/// Control rates, Hz: all that settings allow.
pub(crate) const RATES_HZ: (f64, f64) = (1e3, 1e5);

/// The log goes to the emulator, and is not on the link.
pub(crate) const TAKE_LOG: Option<TakeLog> = None;

/// The axes whose steps of another control are counted: none.
pub(crate) const PULSE_AXES: [bool; 3] = [false; 3];

/// No other control.
pub(crate) struct Pulses;

impl Pulses {
    /// Returns no command.
    #[inline(always)]
    pub(crate) fn step<C>(&mut self, _control: &mut C) -> Option<Command> {
        None
    }
}

/// The board's name.
pub(crate) const NAME: &str = "mps2";

/// Ends the emulator; the host starts it again. The answer to the request is on its way by then.
pub(crate) fn restart() -> ! {
    serial::exchange();
    halt(Outcome::Done)
}

impl Board {
    /// Prepares the machine; the idle loop starts the control ticks.
    pub(crate) fn init(core: cortex_m::Peripherals) -> Self {
        guard::start(&core.MPU);
        let boot = mailbox::boot();
        let reset = mailbox::take_reset();
        if reset != Reset::PowerOn {
            serial::reset();
            mailbox::write(quadrant_lockstep::INPUT_SEQUENCE, 0);
            mailbox::write(quadrant_lockstep::OUTPUT_SEQUENCE, 0);
        }
        let starts = mailbox::read(quadrant_lockstep::STARTS).wrapping_add(1);
        mailbox::write_sequence(quadrant_lockstep::STARTS, starts);
        Self {
            encoders: Encoders { mode: boot.mode },
            switches: Switches,
            pulses: Pulses,
            operator: Operator,
            amplifiers: Amplifiers {
                mode: boot.mode,
                mismatches: [false; 3],
                // What the firmware put out before a reset is kept.
                earlier: starts.wrapping_sub(1).wrapping_mul(boot.ticks) as usize,
            },
            tick: Tick {
                mode: boot.mode,
                period: u32::MAX,
                last: boot.ticks,
                interval: TickInterval::new(u32::MAX, 0),
            },
            idle: Idle {
                mode: boot.mode,
                last: boot.ticks,
                started: false,
                nap: Nap::new(core.SYST),
            },
            serial: Serial::new(boot.mode),
            watchdog: Watchdog::new(boot.mode),
            flash: SettingsFlash,
            reset_cause: match reset {
                Reset::PowerOn => ResetCause::PowerOn,
                Reset::Watchdog => ResetCause::Watchdog,
                Reset::Software => ResetCause::Software,
            },
        }
    }
}

/// The job that the host has left, if it has.
pub(crate) fn job() -> Option<&'static [u8]> {
    let job = mailbox::boot().job;
    (!job.is_empty()).then_some(job)
}

/// Offset of a word of this tick's inputs.
#[inline(always)]
fn input(word: usize) -> usize {
    INPUTS.load(Ordering::Relaxed) as usize + 4 * word
}

/// The index of this tick's record, which stays inside the memory in every case.
#[inline(always)]
fn record() -> usize {
    TICKS
        .load(Ordering::Relaxed)
        .wrapping_sub(1)
        .min(RECORDED_TICKS as u32 - 1) as usize
}

/// Three position encoders.
pub(crate) struct Encoders {
    mode: Mode,
}

impl hal::Encoders for Encoders {
    #[inline(always)]
    fn read(&mut self) -> [EncoderReading; 3] {
        let at = input(0);
        let flags = mailbox::read(at + 4 * InputRecord::FLAGS_WORD);
        let mut readings = [0, 1, 2].map(|axis| EncoderReading::of(mailbox::read(at + 4 * axis)));
        if flags & InputRecord::SELDOM != 0 {
            self.read_flags(&mut readings);
        }
        readings
    }
}

impl Encoders {
    /// Adopts what the flags say, and is as slow as they say.
    #[cold]
    #[inline(never)]
    fn read_flags(&self, readings: &mut [EncoderReading; 3]) {
        let inputs =
            InputRecord::from_words(core::array::from_fn(|word| mailbox::read(input(word))));
        if inputs.slow && self.mode == Mode::Paced {
            timer::CONTROL.wait_until_due();
        }
        *readings = inputs.readings;
    }
}

/// The digital inputs of the stage.
pub(crate) struct Switches;

impl hal::Switches for Switches {
    #[inline(always)]
    fn read(&mut self) -> safety::Switches {
        safety::Switches::from_bits(mailbox::read(input(InputRecord::FLAGS_WORD)) as u16)
    }
}

/// The operator's requests.
pub(crate) struct Operator;

impl Operator {
    /// Returns this tick's request.
    #[inline(always)]
    pub(crate) fn request(&mut self) -> Option<Command> {
        Command::from_number(mailbox::read(input(InputRecord::REQUEST_WORD)))
    }
}

/// Three amplifiers. Their converters can be read back.
pub(crate) struct Amplifiers {
    mode: Mode,
    mismatches: [bool; 3],
    /// Records that a firmware before this one has written.
    earlier: usize,
}

impl hal::Amplifiers for Amplifiers {
    /// Passes to the host what the converters hold of this tick's codes.
    #[inline(always)]
    fn write(&mut self, outputs: &Outputs) {
        let codes = outputs.codes.into_array();
        let flags = mailbox::read(input(InputRecord::FLAGS_WORD));
        let mut held = codes;
        self.mismatches = [false; 3];
        if flags & InputRecord::SELDOM != 0 {
            held = quadrant_lockstep::held(codes, InputRecord::stuck_of(flags));
            let [x, y, z] = codes;
            let [held_x, held_y, held_z] = held;
            self.mismatches = [x != held_x, y != held_y, z != held_z];
        }
        let agree = self.mismatches == [false; 3];
        let answer = OutputRecord {
            outputs: Outputs {
                codes: held.into(),
                enabled: outputs.enabled && agree,
                brake_released: outputs.brake_released && agree,
            },
        };
        let [low, high] = answer.words();
        match self.mode {
            Mode::Lockstep => {
                let tick = TICKS.load(Ordering::Relaxed);
                mailbox::write(quadrant_lockstep::OUTPUT, low);
                mailbox::write(quadrant_lockstep::OUTPUT + 4, high);
                let at = quadrant_lockstep::output_offset(tick);
                mailbox::write(at, low);
                mailbox::write(at + 4, high);
                mailbox::write_sequence(quadrant_lockstep::OUTPUT_SEQUENCE, tick);
            }
            Mode::Paced | Mode::Unpaced => {
                let index = (self.earlier + record()).min(RECORDED_TICKS - 1);
                let at = RECORDED_OUTPUTS + OutputRecord::BYTES * index;
                mailbox::write(at, low);
                mailbox::write(at + 4, high);
            }
        }
    }

    #[inline(always)]
    fn mismatches(&self) -> [bool; 3] {
        self.mismatches
    }
}

/// The control tick.
pub(crate) struct Tick {
    mode: Mode,
    period: u32,
    last: u32,
    interval: TickInterval,
}

impl Tick {
    /// Sets `rate_hz` ticks per second.
    pub(crate) fn start(&mut self, rate_hz: u32) {
        self.period = timer::CLOCK_HZ / rate_hz;
        timer::PERIOD.store(self.period, Ordering::Relaxed);
    }

    /// Rate of the timer, Hz; zero, if none measures the ticks, as in lockstep.
    pub(crate) fn cycle_hz(&self) -> u32 {
        match self.mode {
            Mode::Paced => timer::CLOCK_HZ,
            Mode::Lockstep | Mode::Unpaced => 0,
        }
    }

    /// Begins a tick: clears its interrupt and counts it. Returns true if it begins late; only a paced one can.
    #[inline(always)]
    pub(crate) fn begin(&mut self) -> bool {
        let ticks = TICKS.load(Ordering::Relaxed).wrapping_add(1);
        TICKS.store(ticks, Ordering::Relaxed);
        let at = match self.mode {
            Mode::Lockstep => quadrant_lockstep::input_offset(ticks),
            Mode::Paced | Mode::Unpaced => RECORDED_INPUTS + InputRecord::BYTES * record(),
        };
        INPUTS.store(at as u32, Ordering::Relaxed);
        if self.mode == Mode::Lockstep {
            pend_next(ticks);
        }
        if self.mode == Mode::Paced {
            timer::CONTROL.acknowledge();
            if ticks == self.last {
                timer::CONTROL.stop();
                // The clock counts down, and a record is shorter than its range: 172 s.
                PACED_CYCLES.store(u32::MAX - timer::CLOCK.value(), Ordering::Relaxed);
            }
            return self.begins_late(ticks);
        }
        false
    }

    /// True if this tick, one of a paced run, begins late; never the first, which has none before it.
    fn begins_late(&mut self, tick: u32) -> bool {
        let now = !timer::CLOCK.value();
        if tick == 1 {
            self.interval = TickInterval::new(self.period, now);
        }
        self.interval.is_late(now)
    }

    /// Cycles between two ticks.
    #[inline(always)]
    pub(crate) fn period_cycles(&self) -> u32 {
        self.period
    }

    /// Cycles since this tick was due; [`Tick::period_cycles`] when the next one is due already.
    ///
    /// Only the hardware timer makes a tick due: in the other modes this is zero.
    #[inline(always)]
    pub(crate) fn elapsed_cycles(&self) -> u32 {
        if self.mode != Mode::Paced {
            return 0;
        }
        let left = timer::CONTROL.value();
        // Asked after the value was read: a reload in between is seen.
        if timer::CONTROL.is_due() {
            self.period
        } else {
            (self.period - 1).saturating_sub(left)
        }
    }
}

/// The work of the idle loop.
pub(crate) struct Idle {
    mode: Mode,
    last: u32,
    started: bool,
    nap: Nap,
}

impl Idle {
    /// One turn of the idle loop; something is returned when the run is over.
    ///
    /// It sleeps in lockstep only: with WFI a paced emulator's time would no longer follow the instructions executed.
    pub(crate) fn turn(&mut self) -> Option<Finished> {
        let over = match self.mode {
            Mode::Lockstep => {
                let ticks = TICKS.load(Ordering::Relaxed);
                let asked = mailbox::read_sequence(quadrant_lockstep::INPUT_SEQUENCE);
                if asked == ticks {
                    self.nap.turn();
                } else if asked != END_OF_RUN {
                    self.nap.end();
                    fault_injection::act_on(ticks.wrapping_add(1));
                    serial::exchange();
                    pend_tick();
                }
                asked == END_OF_RUN
            }
            Mode::Paced => {
                // Not before: ticks that come due while the application is still being set up would be lost.
                if !self.started {
                    self.started = true;
                    timer::CLOCK.start(u32::MAX, false);
                    timer::CONTROL.start(timer::PERIOD.load(Ordering::Relaxed) - 1, true);
                }
                let ticks = TICKS.load(Ordering::Relaxed);
                fault_injection::act_on(ticks);
                ticks == self.last
            }
            Mode::Unpaced => {
                let over = TICKS.load(Ordering::Relaxed) == self.last;
                if !over {
                    pend_tick();
                }
                over
            }
        };
        over.then(|| Finished {
            ticks: TICKS.load(Ordering::Relaxed),
            microseconds: PACED_CYCLES.load(Ordering::Relaxed) / (timer::CLOCK_HZ / 1_000_000),
        })
    }
}

/// In tick `ticks` of lockstep: if the host has asked the next one, too, pends its control interrupt, which then follows
/// without a way through the idle loop: a third of the emulator's time. Not where other tasks run between the two, which are
/// to be done before the next tick begins.
#[inline(always)]
fn pend_next(ticks: u32) {
    let asked = mailbox::read_sequence(quadrant_lockstep::INPUT_SEQUENCE);
    if asked != ticks && asked != END_OF_RUN && !ticks.is_multiple_of(PERIOD_TICKS) {
        NVIC::pend(device::Interrupt::CONTROL_TICK);
    }
}

/// Runs the control interrupt now.
fn pend_tick() {
    NVIC::pend(device::Interrupt::CONTROL_TICK);
    // The interrupt is taken before anything below is executed.
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// Zero codes, amplifiers disabled, from any context.
pub(crate) fn outputs_off() {
    timer::CONTROL.stop();
    mailbox::write(quadrant_lockstep::OUTPUT, 0);
    mailbox::write(quadrant_lockstep::OUTPUT + 4, 0);
}

/// Ends the emulator with an exit code that says how it went; a firmware that has failed resets the processor instead, as
/// often as the host allows it.
pub(crate) fn halt(outcome: Outcome) -> ! {
    let resets = mailbox::read(quadrant_lockstep::RESETS_LEFT);
    if outcome == Outcome::Failed && resets > 0 {
        mailbox::write(quadrant_lockstep::RESETS_LEFT, resets - 1);
        mailbox::write(quadrant_lockstep::RESET, Reset::Software as u32);
        cortex_m::peripheral::SCB::sys_reset();
    }
    loop {
        debug::exit(match outcome {
            Outcome::Done => debug::EXIT_SUCCESS,
            Outcome::Failed => debug::EXIT_FAILURE,
        });
    }
}
