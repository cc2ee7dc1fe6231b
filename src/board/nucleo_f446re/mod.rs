//! The reference board: ST Nucleo-F446RE (STM32F446RE, Cortex-M4F at 180 MHz).
//!
//! `docs/board-nucleo-f446re.md` has the pins by connector, the circuit around them, and the way to a first motion.
//!
//! | signal                          | pins                   | peripheral |
//! |---------------------------------|------------------------|------------|
//! | encoder x: A, B, index          | PB8, PB9, PB10         | TIM2, 32 bit |
//! | encoder y: A, B, index          | PA6, PA7, PB0          | TIM3, 16 bit, extended |
//! | encoder z: A, B, index          | PC6, PC7, PC8          | TIM8, 16 bit, extended |
//! | serial encoder x: MA, SLO       | PB3, PB4               | SPI3, TIM6, DMA1; instead of A, B, index |
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
//! Left alone: SWD (PA13, PA14), without a serial encoder SWO (PB3) and PB4, PA15, which are JTAG's at power-up, the oscillators' (PC14, PC15,
//! PH0, PH1), and the spare PD2.

#[cfg(not(feature = "output-on-chip"))]
mod bus_times;
pub(crate) mod chip;
mod encoders;
mod flash;
#[cfg(feature = "output-on-chip")]
mod on_chip;
mod serial_master;
#[cfg(not(feature = "output-on-chip"))]
mod spi;
mod supply;
mod usart;
mod wiring;

use stm32f4xx_hal::gpio::{PinState, Pull, Speed};
use stm32f4xx_hal::pac::{self, DMA1, GPIOA, GPIOC, PWR, TIM4, TIM6, TIM7};
#[cfg(not(feature = "output-on-chip"))]
use stm32f4xx_hal::pac::{DMA2, SPI2, TIM1};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Enable as _, Reset as _};

use self::chip::{CORE_HZ, Supply, Usart};
pub(crate) use self::flash::SettingsFlash;
#[cfg(feature = "output-on-chip")]
pub(crate) use self::on_chip::{Amplifiers, outputs_off};
use self::serial_master::SerialParts;
use self::wiring::INPUTS;
use super::stm32::pulses::StepInput;
use super::stm32::serial_input::SerialInput;
use super::stm32::switches::pull_ups;
use super::stm32::{self, Board, Idle, Operator, Serial, Switches, Tick, Watchdog};
use quadrant::app::PulseLead;
use quadrant_law::reference::PulseState;

impl Board {
    /// Starts the board, but for the control tick.
    pub(crate) fn init(core: cortex_m::Peripherals) -> Self {
        let Some(chip) = pac::Peripherals::take() else {
            panic!("the board is started twice");
        };
        let reset_cause = supply::reset_cause(&chip.RCC);
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
        let watchdog = Watchdog::new(chip.IWDG);
        let port_a = chip.GPIOA.split(&mut rcc);
        let port_b = chip.GPIOB.split(&mut rcc);
        let port_c = chip.GPIOC.split(&mut rcc);

        // First of all pins, as the amplifiers float until then.
        let mut enable = port_c.pc9.into_push_pull_output();
        enable.set_low();
        let mut brake = port_b.pb5.into_push_pull_output();
        brake.set_low();
        // Two pieces use streams of it.
        DMA1::enable(&mut rcc);
        DMA1::reset(&mut rcc);
        #[cfg(not(feature = "output-on-chip"))]
        let amplifiers = {
            let clear = port_b.pb2.into_push_pull_output();
            // High from the first moment: an output that is set afterwards is low for 40 ns, which the converter takes for a frame.
            let high = PinState::High;
            let sync = port_b.pb12.into_push_pull_output_in_state(high);
            let load = port_b.pb1.into_push_pull_output_in_state(high);
            let lines = (sync.speed(Speed::VeryHigh), load.speed(Speed::VeryHigh));
            let _ = port_b.pb13.into_alternate::<5>().speed(Speed::VeryHigh);
            let _ = port_b.pb15.into_alternate::<5>().speed(Speed::VeryHigh);
            // A converter that is not there answers with ones.
            let _ = port_b
                .pb14
                .into_alternate::<5>()
                .internal_resistor(Pull::Up);
            SPI2::enable(&mut rcc);
            SPI2::reset(&mut rcc);
            TIM1::enable(&mut rcc);
            TIM1::reset(&mut rcc);
            DMA2::enable(&mut rcc);
            DMA2::reset(&mut rcc);
            let spi = chip::Spi::new(chip.SPI2);
            let bus = stm32::converter_bus::ConverterBus::new(spi, chip.TIM1, chip.DMA2, lines);
            stm32::Amplifiers::new(bus, clear, enable, brake)
        };
        #[cfg(feature = "output-on-chip")]
        let amplifiers = Amplifiers::new(
            chip.DAC,
            (port_a.pa4, port_a.pa5),
            (enable, brake),
            &mut rcc,
        );
        PWR::enable(&mut rcc);
        let supply = Supply::new(chip.PWR);
        if supply.is_low() {
            defmt::warn!("the processor's supply is below 3 V: outputs stay off until it is not");
        }
        let (of_a, of_c) = INPUTS.pins();
        // SAFETY: two bits a pin; the pins of the masks are nobody else's, inputs after reset, and this runs before any interrupt that
        // touches the ports. They are taken by number, as fourteen types would say less than two masks.
        unsafe {
            (*GPIOA::ptr())
                .pupdr()
                .modify(|r, w| w.bits(r.bits() | pull_ups(of_a)));
            (*GPIOC::ptr())
                .pupdr()
                .modify(|r, w| w.bits(r.bits() | pull_ups(of_c)));
        }
        let switches = Switches::new(supply);
        let encoder_pins = encoders::Pins {
            x: (port_b.pb8, port_b.pb9, port_b.pb10),
            y: (port_a.pa6, port_a.pa7, port_b.pb0),
            z: (port_c.pc6, port_c.pc7, port_c.pc8),
        };
        let timers = (chip.TIM2, chip.TIM3, chip.TIM8);
        let serial_pins = (port_b.pb3, port_b.pb4);
        let parts = SerialParts::new(chip.SPI3, serial_pins, &mut rcc);
        TIM6::enable(&mut rcc);
        TIM6::reset(&mut rcc);
        let serial_input = SerialInput::new(parts, chip.TIM6);
        let encoders = encoders::start(timers, encoder_pins, serial_input, &mut rcc);
        // A line that is not driven rests high.
        let _ = (
            port_b.pb6.into_alternate::<2>().internal_resistor(Pull::Up),
            port_b.pb7.into_alternate::<2>().internal_resistor(Pull::Up),
        );
        TIM4::enable(&mut rcc);
        TIM4::reset(&mut rcc);
        let memory = cortex_m::singleton!(: PulseState = PulseState::new());
        let (servo_on, alarm) = (
            port_a.pa11.into_pull_up_input(),
            port_a.pa12.into_push_pull_output(),
        );
        let pulses = PulseLead::new(
            StepInput::new(chip.TIM4, servo_on, alarm),
            [memory, None, None],
        );
        let usart = Usart::new(chip.USART2, (port_a.pa2, port_a.pa3), &mut rcc);
        let serial = Serial::new(usart, chip.DMA1);
        stm32::report_brown_out(supply::brown_out_level(&chip.FLASH));
        TIM7::enable(&mut rcc);
        TIM7::reset(&mut rcc);
        let rates = (rcc.clocks.timclk1().raw(), rcc.clocks.sysclk().raw());
        Self {
            encoders,
            pulses,
            operator: Operator::new(port_c.pc13.into_input()),
            amplifiers,
            tick: Tick::new(chip.TIM7, rates, core.DCB, core.DWT),
            idle: Idle::new(),
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

/// The board's name.
pub(crate) const NAME: &str = "nucleo-f446re";

/// The chip, by probe-rs' name, in the section where probe-rs and `quadrant connect flash` look for it. It is in the file alone:
/// nothing of it is loaded (`roles.x`).
#[used]
// SAFETY: the linker script keeps the section out of memory, and nothing refers to it.
#[unsafe(link_section = ".probe-rs.chip")]
static CHIP: [u8; 13] = *b"STM32F446RETx";
