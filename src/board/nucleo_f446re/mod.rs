//! The reference board: ST Nucleo-F446RE (STM32F446RE, Cortex-M4F at 180 MHz).
//!
//! | signal            | pin (connector)          | peripheral |
//! |-------------------|--------------------------|------------|
//! | encoder x, A and B | PB8 (D15), PB9 (D14)    | TIM2, 32 bit |
//! | encoder y, A and B | PA0 (A0), PA1 (A1)      | TIM5, 32 bit |
//! | encoder z, A and B | PC6 (CN10-4), PC7 (D9)  | TIM3, 16 bit, extended in software |
//! | DAC SCLK, SDIN     | PB13 (CN10-30), PB15 (CN10-26) | SPI2 |
//! | DAC /SYNC, /LDAC   | PB12 (CN10-16), PB14 (CN10-28) | |
//! | amplifier enable   | PC8 (CN10-2), high enables | |
//! | enabling button    | PC13 (B1, blue), hold to enable | |
//! | control tick       |                          | TIM7 |
//!
//! Left alone: the debug probe's serial port (PA2, PA3), SWD and SWO (PA13, PA14, PB3), the LED (PA5) and PB4, which
//! is JTAG's reset at power-up.
//!
//! The enable line needs a pull-down at the amplifiers: while the processor is in reset its pins float.

mod amplifiers;
pub(crate) mod device;
mod encoders;
mod tick;

use defmt_rtt as _;
use stm32f4xx_hal::gpio::{Input, PC13};
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;

pub(crate) use self::amplifiers::{Amplifiers, outputs_off};
pub(crate) use self::encoders::Encoders;
pub(crate) use self::tick::Tick;
use quadrant::safety::Command;

use super::{Finished, Outcome};

/// Clock of the processor.
const CORE_HZ: u32 = 180_000_000;

/// The machine, started, in pieces.
pub(crate) struct Board {
    /// Three position encoders.
    pub(crate) encoders: Encoders,
    /// What the operator asks for.
    pub(crate) operator: Operator,
    /// Three amplifiers.
    pub(crate) amplifiers: Amplifiers,
    /// The control tick.
    pub(crate) tick: Tick,
    /// What the idle loop does.
    pub(crate) idle: Idle,
}

impl Board {
    /// Starts the board with `rate_hz` control ticks per second.
    pub(crate) fn init(_core: cortex_m::Peripherals, rate_hz: u32) -> Self {
        let Some(chip) = pac::Peripherals::take() else {
            panic!("the board is started twice");
        };
        // The debug probe feeds its 8 MHz clock to the oscillator pin. Above 168 MHz the core's regulator must be
        // overdriven, which `freeze` does.
        let clocks = Config::hse(8.MHz())
            .bypass_hse_oscillator()
            .sysclk(CORE_HZ.Hz());
        let mut rcc = chip.RCC.freeze(clocks);
        let port_a = chip.GPIOA.split(&mut rcc);
        let port_b = chip.GPIOB.split(&mut rcc);
        let port_c = chip.GPIOC.split(&mut rcc);

        let encoders = Encoders::new(
            (chip.TIM2, port_b.pb8, port_b.pb9),
            (chip.TIM5, port_a.pa0, port_a.pa1),
            (chip.TIM3, port_c.pc6, port_c.pc7),
            &mut rcc,
        );
        let pins = amplifiers::Pins {
            clock: port_b.pb13,
            data: port_b.pb15,
            sync: port_b.pb12,
            load: port_b.pb14,
            enable: port_c.pc8,
        };
        let amplifiers = Amplifiers::new(chip.SPI2, pins, &mut rcc);
        let operator = Operator {
            button: port_c.pc13.into_input(),
            history: u32::MAX,
            held: false,
        };
        let tick = Tick::start(chip.TIM7, rate_hz, &mut rcc);
        Self {
            encoders,
            operator,
            amplifiers,
            tick,
            idle: Idle,
        }
    }
}

/// The job that a host has left: none, the board has no such host.
pub(crate) fn job() -> Option<&'static [u8]> {
    None
}

/// What the operator asks for: the button is a dead man's switch.
pub(crate) struct Operator {
    button: PC13<Input>,
    /// The button's level in the last ticks, the newest in the lowest bit; all ones is a button at rest.
    history: u32,
    held: bool,
}

impl Operator {
    /// What is asked for in this tick: to enable once the button has been down for 32 ticks, and to disable at the
    /// first tick it is up.
    #[inline(always)]
    pub(crate) fn request(&mut self) -> Option<Command> {
        // Pressed is low.
        self.history = self.history << 1 | u32::from(self.button.is_high());
        match (self.held, self.history) {
            (false, 0) => {
                self.held = true;
                Some(Command::Enable)
            }
            (true, history) if history & 1 == 1 => {
                self.held = false;
                Some(Command::Disable)
            }
            _ => None,
        }
    }
}

/// What the idle loop does.
pub(crate) struct Idle;

impl Idle {
    /// One turn of the idle loop: nothing. It never finishes.
    ///
    /// It does not sleep: a sleeping core is cut off from the debug probe that reads the log.
    pub(crate) fn turn(&mut self) -> Option<Finished> {
        cortex_m::asm::nop();
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
