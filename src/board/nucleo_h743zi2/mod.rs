//! ST Nucleo-H743ZI2 (STM32H743ZI of revision V, Cortex-M7 at 480 MHz).
//!
//! `docs/board-nucleo-h743zi2.md` has the pins by connector, the circuit around them, and the way to a first motion.
//!
//! | signal                          | pins                   | peripheral |
//! |---------------------------------|------------------------|------------|
//! | encoder x: A, B, index          | PE9, PE11, PE13        | TIM1, 16 bit, extended |
//! | encoder y: A, B, index          | PC6, PC7, PC8          | TIM3, 16 bit, extended |
//! | encoder z: A, B, index          | PD12, PD13, PD14       | TIM4, 16 bit, extended |
//! | serial encoder x: MA, SLO       | PB10, PB15             | SPI2, TIM6, DMA1; instead of A, B, index |
//! | DAC: SCLK, SDIN, SDO            | PA5, PB5, PA6          | SPI1, DMA1 |
//! | DAC: /SYNC, /LDAC, /CLR         | PG2, PG3, PG0          | TIM8 and DMA2, /CLR by hand |
//! | amplifier enable                | PC9, high enables      | |
//! | holding brake                   | PC10, high releases    | |
//! | emergency stop, amplifiers ready | PD0, PD1              | low while all is well |
//! | amplifier faults x, y, z        | PD3, PD4, PD5          | low while all is well |
//! | limits x- x+ y- y+ z- z+        | PF0 to PF5             | low while all is well |
//! | home switches x, y, z           | PF7, PF8, PF9          | low while released |
//! | enabling button                 | PC13 (B1, blue), hold to enable | |
//! | link: to host, from host        | PD8, PD9               | USART3, DMA1 |
//! | another control's step, direction (x) | PE5, PE6  | TIM15, 16 bit, extended |
//! | its SERVO ON, our ALARM         | PE3, low is on; PE4, low is an alarm | |
//! | control tick                    |                        | TIM7 |
//!
//! Left alone: SWD and SWO (PA13, PA14, PB3), PA15 and PB4, which are JTAG's at power-up, the oscillators' (PC14, PC15, PH0, PH1),
//! Ethernet's chip (PA1, PA2, PA7, PB13, PC1, PC4, PC5, PG11, PG13), USB (PA8 to PA12, PD10, PG7), and LEDs (PB0, PB14, PE1).

mod bus_times;
pub(crate) mod chip;
mod clocks;
mod encoders;
mod flash;
mod gpio;
mod memory;
mod serial_master;
mod spi;
mod supply;
mod usart;
mod wiring;

use quadrant::app::PulseLead;
use quadrant_law::reference::PulseState;

use self::chip::pac::{self, DMAMUX1};
use self::chip::{CORE_HZ, Spi, Supply, Usart};
pub(crate) use self::flash::SettingsFlash;
use self::gpio::{Pin, Pull};
use self::serial_master::SerialParts;
use self::wiring::INPUTS;
use super::stm32::converter_bus::{self, ConverterBus};
use super::stm32::pulses::StepInput;
use super::stm32::serial_input::SerialInput;
use super::stm32::switches::pull_ups;
use super::stm32::{self, Amplifiers, Board, Idle, Operator, Serial, Switches, Tick, Watchdog};

/// Clock of timer 7 behind its prescaler of two: at 240 MHz its 16 bits would not last for the slowest control rate.
const TICK_HZ: u32 = 120_000_000;

impl Board {
    /// Starts the board, but for the control tick.
    pub(crate) fn init(mut core: cortex_m::Peripherals) -> Self {
        let Some(chip) = pac::Peripherals::take() else {
            panic!("the board is started twice");
        };
        let reset_cause = supply::reset_cause(&chip.RCC);
        clocks::clock_ports(&chip.RCC);
        // First of all pins, as the amplifiers float until then.
        let (enable, brake) = (chip::Enable::output(false), chip::Brake::output(false));
        let clear = chip::Clear::output(false);
        let alarm = chip::Alarm::output(false);
        // A clock that does not start ends in its reset, and in another start.
        let watchdog = Watchdog::new(chip.IWDG);
        clocks::start(
            &chip.RCC,
            &chip.PWR,
            &chip.SYSCFG,
            &chip.FLASH,
            &chip.DBGMCU,
        );
        clocks::clock_peripherals(&chip.RCC);
        memory::start(&mut core);

        // High from the first moment: an output that is set afterwards is low for a moment, which the converter takes for a frame.
        let lines = (chip::Sync::fast_output(true), chip::Load::fast_output(true));
        route_requests(&chip.DMAMUX1);
        let spi = Spi::new(chip.SPI1);
        Pin::<{ gpio::A }, 5>::fast_alternate(5);
        Pin::<{ gpio::B }, 5>::fast_alternate(5);
        // A converter that is not there answers with ones.
        Pin::<{ gpio::A }, 6>::alternate(5, Pull::Up);
        let bus = ConverterBus::new(spi, chip.TIM8, chip.DMA2, lines);
        let amplifiers = Amplifiers::new(bus, clear, enable, brake);

        let supply = Supply::new(chip.PWR);
        if supply.is_low() {
            defmt::warn!("the processor's supply is below 2.8 V: outputs stay off until it is not");
        }
        let (of_d, of_f) = INPUTS.pins();
        for (port, pins) in [(gpio::D, of_d), (gpio::F, of_f)] {
            // SAFETY: two bits a pin, 00 for an input in MODER (RM0433, 11.4.1); the pins of the masks are nobody else's.
            unsafe {
                gpio::port(port)
                    .pupdr()
                    .modify(|r, w| w.bits(r.bits() | pull_ups(pins)));
                gpio::port(port)
                    .moder()
                    .modify(|r, w| w.bits(r.bits() & !(3 * pull_ups(pins))));
            }
        }
        scale(&chip.TIM6);
        let serial_input = SerialInput::new(SerialParts(chip.SPI2), chip.TIM6);
        let timers = (chip.TIM1, chip.TIM3, chip.TIM4);
        let encoders = encoders::start(timers, serial_input);
        // A line that is not driven rests high.
        Pin::<{ gpio::E }, 5>::alternate(4, Pull::Up);
        chip::Direction::alternate(4, Pull::Up);
        let memory = cortex_m::singleton!(: PulseState = PulseState::new());
        let servo_on = chip::ServoOn::input(Pull::Up);
        let pulses = PulseLead::new(
            StepInput::new(chip.TIM15, servo_on, alarm),
            [memory, None, None],
        );
        let serial = Serial::new(Usart::new(chip.USART3), chip.DMA1);
        stm32::report_brown_out(supply::brown_out_level(&chip.FLASH));
        scale(&chip.TIM7);
        cortex_m::peripheral::DWT::unlock();
        Self {
            encoders,
            pulses,
            operator: Operator::new(chip::Button::input(Pull::Down)),
            amplifiers,
            tick: Tick::new(chip.TIM7, (TICK_HZ, CORE_HZ), core.DCB, core.DWT),
            idle: Idle::new(),
            switches: Switches::new(supply),
            serial,
            watchdog,
            flash: SettingsFlash::new(chip.FLASH),
            reset_cause,
        }
    }
}

/// Sets the prescaler of a basic timer to two. It is in force with the update that the generation makes (RM0433, 42.4: PSC, EGR), of
/// which the flag remains.
fn scale(timer: &pac::tim6::RegisterBlock) {
    timer.psc().write(|w| w.psc().set(1));
    timer.egr().write(|w| w.ug().set_bit());
    timer.sr().write(|w| w.uif().clear());
}

/// Selects the requests of the streams: channel n of DMAMUX 1 is stream n of DMA 1, channel 8 + n stream n of DMA 2 (RM0433, 17.3.2).
fn route_requests(router: &DMAMUX1) {
    /// DMAREQ_ID (table 124): TIM8_CH1, TIM8_CH2, SPI1_RX, USART3_RX, USART3_TX, TIM6_UP.
    const ROUTES: [(usize, u32); 6] = [
        (8 + converter_bus::PINS, 47),
        (8 + converter_bus::BYTES, 48),
        (converter_bus::RECEIVER, 37),
        (stm32::serial::RECEIVER, 45),
        (stm32::serial::SENDER, 46),
        (stm32::serial_input::KICK, 69),
    ];
    for (channel, request) in ROUTES {
        // SAFETY: the values are the manual's.
        router.ccr(channel).write(|w| unsafe { w.bits(request) });
    }
}

/// Control rates, Hz: slower, the supervising task would feed the watchdog too late, which may bite after 9.5 ms; faster,
/// the tick leaves too little to the other tasks (`docs/board-nucleo-h743zi2.md`).
pub(crate) const RATES_HZ: (f64, f64) = (2.5e3, 2.0e4);

/// The board's name.
pub(crate) const NAME: &str = "nucleo-h743zi2";

/// The chip, by probe-rs' name, in the section where probe-rs and `quadrant connect flash` look for it. It is in the file alone:
/// nothing of it is loaded (`roles.x`).
#[used]
// SAFETY: the linker script keeps the section out of memory, and nothing refers to it.
#[unsafe(link_section = ".probe-rs.chip")]
static CHIP: [u8; 13] = *b"STM32H743ZITx";
