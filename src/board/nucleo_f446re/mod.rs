//! The reference board: ST Nucleo-F446RE (STM32F446RE, Cortex-M4F at 180 MHz).
//!
//! `docs/board-nucleo-f446re.md` has the pins by connector, the circuit around them, and the way to a first motion.
//!
//! | signal                          | pins                   | peripheral |
//! |---------------------------------|------------------------|------------|
//! | encoder x: A, B, index          | PB8, PB9, PB10         | TIM2, 32 bit |
//! | encoder y: A, B, index          | PA6, PA7, PB0          | TIM3, 16 bit, extended |
//! | encoder z: A, B, index          | PC6, PC7, PC8          | TIM8, 16 bit, extended |
//! | DAC: SCLK, SDIN, SDO            | PB13, PB15, PB14       | SPI2, DMA1 |
//! | DAC: /SYNC, /LDAC, /CLR         | PB12, PB1, PB2         | TIM1 and DMA2, /CLR by hand |
//! | amplifier enable                | PC9, high enables      | |
//! | holding brake                   | PB5, high releases     | |
//! | emergency stop, amplifiers ready | PA0, PA1              | low while all is well |
//! | amplifier faults x, y, z        | PA8, PA9, PA10         | low while all is well |
//! | limits x- x+ y- y+ z- z+        | PC0 to PC5             | low while all is well |
//! | home switches x, y, z           | PC10, PC11, PC12       | low while released |
//! | enabling button                 | PC13 (B1, blue), hold to enable | |
//! | link: to host, from host        | PA2, PA3               | USART2, DMA1 |
//! | another control's step, direction (x) | PB6, PB7  | TIM4, 16 bit, extended |
//! | its SERVO ON, our ALARM         | PA11, low is on; PA12, low is an alarm | |
//! | on-chip converters (fallback)   | PA4, PA5               | DAC |
//! | control tick                    |                        | TIM7 |
//!
//! Left alone: SWD and SWO (PA13, PA14, PB3), PA15 and PB4, which are JTAG's at power-up, the oscillators' (PC14, PC15,
//! PH0, PH1), and the spare PD2.

#[cfg(not(feature = "output-on-chip"))]
mod amplifiers;
#[cfg(feature = "output-on-chip")]
#[path = "on_chip.rs"]
mod amplifiers;
#[cfg(not(feature = "output-on-chip"))]
mod bus_times;
#[cfg(not(feature = "output-on-chip"))]
mod converter_bus;
pub(crate) mod device;
mod dma_memory;
mod encoders;
mod flash;
mod pins;
mod pulses;
mod rtt;
mod serial;
mod switches;
mod tick;
mod watchdog;
mod wiring;

use defmt_rtt as _;
use stm32f4xx_hal::gpio::{Input, PC13};
use stm32f4xx_hal::pac::{self, DMA1, PWR};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Enable as _, Reset as _};

pub(crate) use self::amplifiers::{Amplifiers, outputs_off};
pub(crate) use self::encoders::Encoders;
pub(crate) use self::flash::SettingsFlash;
use self::pulses::StepInput;
pub(crate) use self::serial::Serial;
pub(crate) use self::switches::Switches;
pub(crate) use self::tick::Tick;
use self::watchdog::Supply;
pub(crate) use self::watchdog::Watchdog;
use quadrant::app::PulseLead;
use quadrant::app::log_ring::TakeLog;
use quadrant::drivers::hold_button::HoldButton;
use quadrant::hal::ResetCause;
use quadrant_law::command::Command;
use quadrant_law::reference::PulseState;

use super::{Finished, Outcome};

/// Clock of the processor.
const CORE_HZ: u32 = 180_000_000;

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
    pub(crate) amplifiers: Amplifiers,
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

impl Board {
    /// Starts the board, but for the control tick.
    pub(crate) fn init(core: cortex_m::Peripherals) -> Self {
        let Some(chip) = pac::Peripherals::take() else {
            panic!("the board is started twice");
        };
        let reset_cause = watchdog::reset_cause(&chip.RCC);
        // The debug probe feeds its 8 MHz clock to the oscillator pin. Above 168 MHz the core's regulator must be
        // overdriven, which `freeze` does.
        let clocks = Config::hse(8.MHz())
            .bypass_hse_oscillator()
            .sysclk(CORE_HZ.Hz());
        let mut rcc = chip.RCC.freeze(clocks);
        // Should that clock fail, the processor runs on from one of its own, at another speed, and takes the
        // non-maskable interrupt, which is the end (`fault::DefaultHandler`).
        rcc.cr().modify(|_, w| w.csson().set_bit());
        // Not before: without its 8 MHz the start waits for them.
        let watchdog = Watchdog::new(chip.IWDG, chip.DBGMCU);
        let port_a = chip.GPIOA.split(&mut rcc);
        let port_b = chip.GPIOB.split(&mut rcc);
        let port_c = chip.GPIOC.split(&mut rcc);

        // Two pieces use streams of it.
        DMA1::enable(&mut rcc);
        DMA1::reset(&mut rcc);
        // First of all pins, as the amplifiers float until then.
        #[cfg(not(feature = "output-on-chip"))]
        let amplifiers = {
            let pins = amplifiers::Pins {
                bus: amplifiers::BusPins {
                    clock: port_b.pb13,
                    answer: port_b.pb14,
                    data: port_b.pb15,
                    sync: port_b.pb12,
                    load: port_b.pb1,
                },
                clear: port_b.pb2,
                enable: port_c.pc9,
                brake: port_b.pb5,
            };
            Amplifiers::new((chip.SPI2, chip.TIM1, chip.DMA2), pins, &mut rcc)
        };
        #[cfg(feature = "output-on-chip")]
        let amplifiers = Amplifiers::new(
            chip.DAC,
            (port_a.pa4, port_a.pa5),
            (port_c.pc9, port_b.pb5),
            &mut rcc,
        );
        PWR::enable(&mut rcc);
        let supply = Supply::new(chip.PWR);
        if supply.is_low() {
            defmt::warn!("the processor's supply is below 3 V: outputs stay off until it is not");
        }
        let switches = Switches::new(supply);
        let encoder_pins = encoders::Pins {
            x: (port_b.pb8, port_b.pb9, port_b.pb10),
            y: (port_a.pa6, port_a.pa7, port_b.pb0),
            z: (port_c.pc6, port_c.pc7, port_c.pc8),
        };
        let encoders = Encoders::new(chip.TIM2, chip.TIM3, chip.TIM8, encoder_pins, &mut rcc);
        let pulse_pins = (port_b.pb6, port_b.pb7, port_a.pa11, port_a.pa12);
        let memory = cortex_m::singleton!(: PulseState = PulseState::new());
        let pulses = PulseLead::new(
            StepInput::new(chip.TIM4, pulse_pins, &mut rcc),
            [memory, None, None],
        );
        let serial = Serial::new(chip.USART2, chip.DMA1, (port_a.pa2, port_a.pa3), &mut rcc);
        match watchdog::brown_out_level(&chip.FLASH) {
            Some(level) => defmt::info!("brown-out reset: {=str}", level),
            None => {
                defmt::warn!("brown-out reset is off: set BOR_LEV once, as the board's page says")
            }
        }
        let operator = Operator {
            button: port_c.pc13.into_input(),
            hold: HoldButton::new(),
        };
        let tick = Tick::new(chip.TIM7, core.DCB, core.DWT, &mut rcc);
        Self {
            encoders,
            pulses,
            operator,
            amplifiers,
            tick,
            idle: Idle,
            switches,
            serial,
            watchdog,
            flash: SettingsFlash::new(chip.FLASH),
            reset_cause,
        }
    }
}

/// Control rates, Hz: slower, the supervising task would feed the watchdog too late, which may bite after 6.8 ms; faster,
/// the tick leaves too little to the other tasks.
pub(crate) const RATES_HZ: (f64, f64) = (2.5e3, 1.5e4);

/// Takes bytes of the log out of its buffer.
pub(crate) const TAKE_LOG: Option<TakeLog> = Some(rtt::take);

/// The axes whose steps of another control are counted: one timer is left.
pub(crate) const PULSE_AXES: [bool; 3] = [true, false, false];

/// Another control that leads axes.
pub(crate) type Pulses = PulseLead<'static, StepInput>;

/// The board's name.
pub(crate) const NAME: &str = "nucleo-f446re";

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
    button: PC13<Input>,
    hold: HoldButton,
}

impl Operator {
    /// Returns this tick's request.
    #[inline(always)]
    pub(crate) fn request(&mut self) -> Option<Command> {
        // Pressed is low.
        self.hold.step(self.button.is_low())
    }
}

/// The work of the idle loop.
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
