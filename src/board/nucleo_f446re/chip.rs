//! The chip, its pins and its peripherals, by the names that [`stm32`](super::super::stm32) has for them.

use stm32f4xx_hal::gpio::{Input, Output, PA11, PA12, PC13};
#[cfg(not(feature = "output-on-chip"))]
use stm32f4xx_hal::gpio::{PB1, PB2, PB12};
use stm32f4xx_hal::gpio::{PB5, PC9};
use stm32f4xx_hal::pac::Interrupt;

#[cfg(not(feature = "output-on-chip"))]
pub(crate) use super::bus_times::{READING, WRITING};
pub(crate) use super::serial_master::{SerialMaster, SerialParts};
#[cfg(not(feature = "output-on-chip"))]
pub(crate) use super::spi::{Rate, Spi};
pub(crate) use super::supply::Supply;
pub(crate) use super::usart::Usart;
pub(crate) use super::wiring::{ENCODER_FILTER, INPUTS, SERIAL_TIMES};
pub(crate) use stm32f4xx_hal::pac;

/// Clock of the processor.
pub(crate) const CORE_HZ: u32 = 180_000_000;
/// Cycles that a turn of `cortex_m::asm::delay`'s loop takes at least: one for the subtraction, two for a branch that is
/// taken (Cortex-M4 TRM, 3.3.1).
#[cfg(not(feature = "output-on-chip"))]
pub(crate) const CYCLES_PER_TURN: u32 = 3;

/// The control tick: basic timer 7.
pub(crate) const CONTROL_TICK: Interrupt = Interrupt::TIM7;
/// Task dispatchers, on vectors of the CAN controller, which is switched off.
pub(crate) const DISPATCHERS: [Interrupt; 3] =
    [Interrupt::CAN1_TX, Interrupt::CAN1_RX0, Interrupt::CAN1_RX1];

/// The amplifiers' enable line.
pub(crate) type Enable = PC9<Output>;
/// The holding brake.
pub(crate) type Brake = PB5<Output>;
/// Numbers of both in ports C and B.
const ENABLE: u8 = 9;
const BRAKE: u8 = 5;

/// /CLR, /SYNC and /LDAC of the converter.
#[cfg(not(feature = "output-on-chip"))]
pub(crate) type Clear = PB2<Output>;
#[cfg(not(feature = "output-on-chip"))]
pub(crate) type Sync = PB12<Output>;
#[cfg(not(feature = "output-on-chip"))]
pub(crate) type Load = PB1<Output>;
/// Their numbers in port B.
#[cfg(not(feature = "output-on-chip"))]
const CLEAR: u8 = 2;
#[cfg(not(feature = "output-on-chip"))]
pub(crate) const SYNC: u8 = 12;
#[cfg(not(feature = "output-on-chip"))]
pub(crate) const LOAD: u8 = 1;

/// The timer of the converter's bus: its requests are those of DMA 2, stream 1 and 2, on channel 6 (RM0390, table 29), SPI2_RX is
/// stream 3 of DMA 1 on channel 0 (table 28).
#[cfg(not(feature = "output-on-chip"))]
pub(crate) type ConverterTimer = pac::TIM1;
/// DMA_SxCR, CHSEL.
#[cfg(not(feature = "output-on-chip"))]
pub(crate) const TIMER_STREAM: u32 = 6 << 25;
#[cfg(not(feature = "output-on-chip"))]
pub(crate) const SPI_STREAM: u32 = 0;
/// USART2_RX is stream 5, USART2_TX stream 6 of DMA 1, both on channel 4 (RM0390, table 28).
pub(crate) const UART_STREAM: u32 = 4 << 25;
/// Largest number of polls of what was started before giving up: the longest takes some 2100 cycles, a look nine at least.
#[cfg(not(feature = "output-on-chip"))]
pub(crate) const PATIENCE: u32 = 300;

/// The timers of the encoders.
pub(crate) type X = pac::TIM2;
pub(crate) type Y = pac::TIM3;
pub(crate) type Z = pac::TIM8;

/// Another control's step and direction: no other timer with two free inputs is left.
pub(crate) type StepTimer = pac::TIM4;
/// Its SERVO ON, with a pull-up.
pub(crate) type ServoOn = PA11<Input>;
/// Our ALARM to it.
pub(crate) type Alarm = PA12<Output>;
/// TIM4_CR1, CKD: the filter's clock is the timer's.
pub(crate) const FILTER_CLOCK: u32 = 0;

/// The enabling button.
pub(crate) type Button = PC13<Input>;

/// True if the button is pressed: low.
#[inline(always)]
pub(crate) fn is_pressed(button: &Button) -> bool {
    button.is_low()
}

/// True if the direction line is on: high.
#[inline(always)]
pub(crate) fn is_backwards() -> bool {
    const DIRECTION: u32 = 1 << 7;
    // SAFETY: reading a port's levels changes nothing and needs no owner.
    unsafe { (*pac::GPIOB::ptr()).idr().read().bits() & DIRECTION != 0 }
}

/// Levels of the ports of the switches, A and C.
#[inline(always)]
pub(crate) fn levels() -> (u16, u16) {
    // SAFETY: reading a port's levels changes nothing and needs no owner.
    let (first, second) = unsafe { (&*pac::GPIOA::ptr(), &*pac::GPIOC::ptr()) };
    (
        first.idr().read().bits() as u16,
        second.idr().read().bits() as u16,
    )
}

/// True if the amplifiers' enable line is low: the pin's input, which shows what is on the line.
pub(crate) fn enable_line_is_low() -> bool {
    // SAFETY: a read of a port's inputs changes nothing.
    let port = unsafe { pac::GPIOC::steal() };
    port.idr().read().bits() & 1 << ENABLE == 0
}

/// Amplifiers disabled, brake applied, /CLR low, from any context.
pub(crate) fn lines_off() {
    // SAFETY: single writes, each of which changes nothing but these pins.
    let (port_b, port_c) = unsafe { (pac::GPIOB::steal(), pac::GPIOC::steal()) };
    port_c.bsrr().write(|w| w.br(ENABLE).set_bit());
    port_b.bsrr().write(|w| w.br(BRAKE).set_bit());
    #[cfg(not(feature = "output-on-chip"))]
    port_b.bsrr().write(|w| w.br(CLEAR).set_bit());
}

/// Address of the set/reset register of the port of /SYNC and /LDAC.
#[cfg(not(feature = "output-on-chip"))]
pub(crate) fn port_address() -> u32 {
    // SAFETY: only the register's address is taken.
    unsafe { pac::GPIOB::steal() }.bsrr().as_ptr() as u32
}

/// Writes that register, from any context.
#[cfg(not(feature = "output-on-chip"))]
pub(crate) fn set_lines(word: u32) {
    // SAFETY: a single write, of a word for these pins alone.
    unsafe { pac::GPIOB::steal().bsrr().write(|w| w.bits(word)) };
}

/// Lets a halted processor stop the watchdog, or not (DBGMCU_APB1_FZ, DBG_IWDG_STOP).
#[inline(always)]
pub(crate) fn freeze_in_debug(freeze: bool) {
    // SAFETY: nobody else uses this register.
    let debugger = unsafe { pac::DBGMCU::steal() };
    debugger
        .apb1_fz()
        .modify(|_, w| w.dbg_iwdg_stop().bit(freeze));
}
