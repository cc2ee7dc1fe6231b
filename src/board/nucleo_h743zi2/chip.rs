//! The chip, its pins and its peripherals, by the names that [`stm32`](super::super::stm32) has for them.

use stm32h7::stm32h743v::Interrupt;

pub(crate) use super::bus_times::{READING, WRITING};
use super::gpio::{self, Pin};
pub(crate) use super::serial_master::{SerialMaster, SerialParts};
pub(crate) use super::spi::{Rate, Spi};
pub(crate) use super::supply::Supply;
pub(crate) use super::usart::Usart;
pub(crate) use super::wiring::{ENCODER_FILTER, INPUTS, SERIAL_TIMES};
pub(crate) use stm32h7::stm32h743v as pac;

/// Clock of the processor.
pub(crate) const CORE_HZ: u32 = 480_000_000;
/// Cycles that a turn of `cortex_m::asm::delay`'s loop takes at least: this core may issue its two instructions together.
pub(crate) const CYCLES_PER_TURN: u32 = 1;

/// The control tick: basic timer 7.
pub(crate) const CONTROL_TICK: Interrupt = Interrupt::TIM7;
/// Task dispatchers, on vectors of the CAN controllers, which are switched off.
pub(crate) const DISPATCHERS: [Interrupt; 3] = [
    Interrupt::FDCAN1_IT0,
    Interrupt::FDCAN1_IT1,
    Interrupt::FDCAN2_IT0,
];

/// The amplifiers' enable line.
pub(crate) type Enable = Pin<{ gpio::C }, ENABLE>;
/// The holding brake.
pub(crate) type Brake = Pin<{ gpio::C }, BRAKE>;
/// Numbers of both in port C.
const ENABLE: u8 = 9;
const BRAKE: u8 = 10;

/// /CLR, /SYNC and /LDAC of the converter.
pub(crate) type Clear = Pin<{ gpio::G }, CLEAR>;
pub(crate) type Sync = Pin<{ gpio::G }, SYNC>;
pub(crate) type Load = Pin<{ gpio::G }, LOAD>;
/// Their numbers in port G.
const CLEAR: u8 = 0;
pub(crate) const SYNC: u8 = 2;
pub(crate) const LOAD: u8 = 3;

/// The timer of the converter's bus.
pub(crate) type ConverterTimer = pac::TIM8;
/// DMA_SxCR has no bits that select a request: DMAMUX 1 does, in [`route_requests`](super::route_requests).
pub(crate) const TIMER_STREAM: u32 = 0;
pub(crate) const SPI_STREAM: u32 = 0;
/// DMA_SxCR, TRBUFF: "must be set when a stream serves a USART" (RM0433, 15.5.5; ES0392, "DMA stream locked when transferring data
/// to/from USART").
pub(crate) const UART_STREAM: u32 = 1 << 20;
/// Largest number of polls of what was started before giving up: the longest takes some 5800 cycles, a look, which crosses two
/// bridges, at least 10.
pub(crate) const PATIENCE: u32 = 600;

/// The timers of the encoders. Those of 32 bits have no two inputs that Ethernet's chip or the trace port leave alone.
pub(crate) type X = pac::TIM1;
pub(crate) type Y = pac::TIM3;
pub(crate) type Z = pac::TIM4;

/// Another control's step and direction.
pub(crate) type StepTimer = pac::TIM15;
/// Its direction line.
pub(crate) type Direction = Pin<{ gpio::E }, DIRECTION>;
const DIRECTION: u8 = 6;
/// Its SERVO ON, with a pull-up.
pub(crate) type ServoOn = Pin<{ gpio::E }, 3>;
/// Our ALARM to it.
pub(crate) type Alarm = Pin<{ gpio::E }, 4>;
/// TIMx_CR1, CKD (RM0433, 38.4.1, 39.4.1 and 41.5.1): the filter's clock is a quarter of the timer's.
pub(crate) const FILTER_CLOCK: u32 = 0b10 << 8;

/// The enabling button.
pub(crate) type Button = Pin<{ gpio::C }, 13>;

/// True if the button is pressed: high.
#[inline(always)]
pub(crate) fn is_pressed(button: &Button) -> bool {
    button.is_high()
}

/// True if the direction line is on: high.
#[inline(always)]
pub(crate) fn is_backwards() -> bool {
    gpio::port(gpio::E).idr().read().bits() & 1 << DIRECTION != 0
}

/// Levels of the ports of the switches, D and F.
#[inline(always)]
pub(crate) fn levels() -> (u16, u16) {
    let level = |base| gpio::port(base).idr().read().bits() as u16;
    (level(gpio::D), level(gpio::F))
}

/// True if the amplifiers' enable line is low: the pin's input, which shows what is on the line.
pub(crate) fn enable_line_is_low() -> bool {
    gpio::port(gpio::C).idr().read().bits() & 1 << ENABLE == 0
}

/// Amplifiers disabled, brake applied, /CLR low, from any context.
pub(crate) fn lines_off() {
    // SAFETY: single writes, each of which changes nothing but these pins.
    unsafe {
        let both = 1 << (16 + ENABLE) | 1 << (16 + BRAKE);
        gpio::port(gpio::C).bsrr().write(|w| w.bits(both));
    }
    set_lines(1 << (16 + CLEAR));
}

/// Address of the set/reset register of the port of /SYNC and /LDAC.
pub(crate) fn port_address() -> u32 {
    gpio::port(gpio::G).bsrr().as_ptr() as u32
}

/// Writes that register, from any context.
pub(crate) fn set_lines(word: u32) {
    // SAFETY: a single write, of a word for the converter's pins alone.
    unsafe { gpio::port(gpio::G).bsrr().write(|w| w.bits(word)) };
}

/// Lets a halted processor stop the watchdog, or not (DBGMCU_APB4FZ1, bit 18, WDGLSD1; RM0433, 60.5.8).
#[inline(always)]
pub(crate) fn freeze_in_debug(freeze: bool) {
    // SAFETY: nobody else uses this register.
    let debugger = unsafe { pac::DBGMCU::steal() };
    debugger.apb4fz1().modify(|_, w| w.dbg_iwdg1().bit(freeze));
}
