//! The parts that boards with an STM32 have alike. Each takes its registers, pins and rates by the names that the board's
//! [`chip`](super::chip) gives them: one board is built at a time, so they need no generics.
//!
//! | of the board's `chip` | who uses it |
//! |---|---|
//! | `pac`, `CORE_HZ`, `CYCLES_PER_TURN` | all |
//! | `CONTROL_TICK`, `DISPATCHERS` | `device` |
//! | `Enable`, `Brake`, `Clear`, `Sync`, `Load`, `lines_off` | `amplifiers`, `converter_bus` |
//! | `Spi`, `Rate`, `ConverterTimer`, `TIMER_STREAM`, `SPI_STREAM`, `port_address`, `set_lines`, `SYNC`, `LOAD`, `PATIENCE`, `WRITING`, `READING` | `converter_bus` |
//! | `X`, `Y`, `Z` | `encoders` |
//! | `SerialParts`, `SerialMaster`, `SERIAL_TIMES` | `serial_input` |
//! | `Usart`, `UART_STREAM` | `serial` |
//! | `StepTimer`, `ServoOn`, `Alarm`, `is_backwards`, `ENCODER_FILTER`, `FILTER_CLOCK` | `pulses` |
//! | `Supply`, `levels`, `INPUTS` | `switches` |
//! | `freeze_in_debug` | `watchdog` |
//! | `Button`, `is_pressed` | [`Operator`] |

#[cfg(not(feature = "output-on-chip"))]
pub(super) mod amplifiers;
#[cfg(not(feature = "output-on-chip"))]
pub(super) mod converter_bus;
pub(crate) mod device;
pub(super) mod dma_memory;
pub(super) mod encoders;
pub(super) mod pulses;
pub(super) mod rtt;
pub(super) mod serial;
pub(super) mod serial_input;
pub(super) mod settings_flash;
pub(super) mod switches;
pub(super) mod tick;
pub(super) mod watchdog;

use defmt_rtt as _;
use quadrant::app::PulseLead;
use quadrant::app::log_ring::TakeLog;
use quadrant::drivers::hold_button::HoldButton;
use quadrant::hal::ResetCause;
use quadrant_law::command::Command;

#[cfg(not(feature = "output-on-chip"))]
pub(crate) use self::amplifiers::{Amplifiers, outputs_off};
pub(crate) use self::encoders::Encoders;
pub(crate) use self::serial::Serial;
pub(crate) use self::switches::Switches;
pub(crate) use self::tick::Tick;
pub(crate) use self::watchdog::Watchdog;
use super::chip;
use super::{Finished, Outcome, SettingsFlash};

/// The machine, started, in pieces.
#[allow(dead_code, reason = "which pieces are used is up to the application")]
pub(crate) struct Board {
    /// Three position encoders.
    pub(crate) encoders: Encoders,
    /// Another control's step and direction.
    pub(crate) pulses: Pulses,
    /// The operator's requests.
    pub(crate) operator: Operator,
    /// Three amplifiers.
    pub(crate) amplifiers: super::Amplifiers,
    /// The control tick.
    pub(crate) tick: Tick,
    /// The work of the idle loop.
    pub(crate) idle: Idle,
    /// Limits, homes, amplifier faults, emergency stop.
    pub(crate) switches: Switches,
    /// The serial port of the link.
    pub(crate) serial: Serial,
    /// The watchdog, with seconds for the start.
    pub(crate) watchdog: Watchdog,
    /// The flash for settings.
    pub(crate) flash: SettingsFlash,
    /// The cause of the start.
    pub(crate) reset_cause: ResetCause,
}

/// Takes bytes of the log out of its buffer.
pub(crate) const TAKE_LOG: Option<TakeLog> = Some(rtt::take);

/// Another control that leads axes.
pub(crate) type Pulses = PulseLead<'static, pulses::StepInput>;

/// The axes whose steps of another control are counted: one timer with two free inputs is left.
pub(crate) const PULSE_AXES: [bool; 3] = [true, false, false];

/// Starts the firmware afresh.
pub(crate) fn restart() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

/// The job that a host has left: none, the board has no such host.
pub(crate) fn job() -> Option<&'static [u8]> {
    None
}

/// The operator's requests: the button is a dead man's switch.
pub(crate) struct Operator {
    button: chip::Button,
    hold: HoldButton,
}

impl Operator {
    /// The button, as an input.
    pub(super) const fn new(button: chip::Button) -> Self {
        Self {
            button,
            hold: HoldButton::new(),
        }
    }

    /// Returns this tick's request.
    #[inline(always)]
    pub(crate) fn request(&mut self) -> Option<Command> {
        self.hold.step(chip::is_pressed(&self.button))
    }
}

/// The work of the idle loop.
pub(crate) struct Idle {
    frames: serial_input::FrameReport,
}

impl Idle {
    /// An idle loop that has not turned.
    pub(super) const fn new() -> Self {
        Self {
            frames: serial_input::FrameReport::new(),
        }
    }

    /// One turn of the idle loop: it reports a serial encoder's frames. It never finishes.
    ///
    /// It does not sleep: a sleeping core is cut off from the debug probe that reads the log.
    pub(crate) fn turn(&mut self) -> Option<Finished> {
        self.frames.turn();
        None
    }
}

/// Stays put, with interrupts off, until somebody resets the board.
pub(crate) fn halt(_outcome: Outcome) -> ! {
    cortex_m::interrupt::disable();
    loop {
        cortex_m::asm::nop();
    }
}

/// Says what the chip does about a supply that fails.
pub(super) fn report_brown_out(level: Option<&str>) {
    match level {
        Some(level) => defmt::info!("brown-out reset: {=str}", level),
        None => {
            defmt::warn!("brown-out reset is off: set BOR_LEV once, as the board's page says")
        }
    }
}
