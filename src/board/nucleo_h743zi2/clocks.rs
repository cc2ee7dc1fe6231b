//! Supply scale, clock tree and the clocks of what is used.
//!
//! | clock | Hz | of |
//! |---|---|---|
//! | PLL 1, reference and VCO | 8 M, 960 M | the debug probe's 8 MHz at OSC_IN |
//! | processor | 480 M | output P, half of the VCO |
//! | AXI, AHB | 240 M | HPRE |
//! | APB 1 to 4 | 120 M | their prescalers |
//! | timers | 240 M | twice APB 1 and 2 |
//! | SPI 1 | 48 M | output Q, a twentieth of the VCO |
//! | USART 3 | 120 M | APB 1 |
//!
//! 480 MHz need voltage scale 0, which revisions Y and W do not have (ES0392, 2.2.21): the start refuses them.

use stm32h7::stm32h743v::{DBGMCU, FLASH, PWR, RCC, SYSCFG};

/// PWR_CR3 (RM0433, 6.8.4), written once after power-on: LDO on (LDOEN), no bypass, SCUEN as after reset.
const LDO: u32 = 1 << 2 | 1 << 1;
/// PWR_CSR1, ACTVOSRDY (6.8.2), and PWR_D3CR, VOSRDY (6.8.6).
const READY: u32 = 1 << 13;
/// PWR_D3CR, VOS = 11: scale 1.
const SCALE_1: u32 = 0b11 << 14;
/// SYSCFG_PWRCR, ODEN (RM0433, 12.3): makes scale 0 of scale 1.
const OVERDRIVE: u32 = 1;

/// RCC_CR (RM0433, 8.7.2): HSEON, HSERDY, HSEBYP, HSECSSON, PLL1ON, PLL1RDY.
const HSE_ON: u32 = 1 << 16;
const HSE_READY: u32 = 1 << 17;
const HSE_BYPASS: u32 = 1 << 18;
const HSE_SECURITY: u32 = 1 << 19;
const PLL_ON: u32 = 1 << 24;
const PLL_READY: u32 = 1 << 25;
/// RCC_PLLCKSELR (8.7.11): from the HSE (PLLSRC = 10), undivided (DIVM1 = 1); PLL 2 and 3 as after reset.
const PLL_SOURCE: u32 = 32 << 20 | 32 << 12 | 1 << 4 | 0b10;
/// RCC_PLLCFGR (8.7.12): reference of 8 to 16 MHz (PLL1RGE = 11), wide VCO (PLL1VCOSEL = 0), outputs P and Q on.
const PLL_OUTPUTS: u32 = 1 << 17 | 1 << 16 | 0b11 << 2;
/// RCC_PLL1DIVR (8.7.13): times 120 (DIVN1), P a half, Q a twentieth, R as after reset; each field is one less.
const PLL_DIVIDERS: u32 = 1 << 24 | (20 - 1) << 16 | (2 - 1) << 9 | (120 - 1);
/// RCC_D1CFGR (8.7.8): processor undivided (D1CPRE), AHB a half (HPRE = 1000), APB 3 a half of that (D1PPRE = 100).
const DOMAIN_1: u32 = 0b100 << 4 | 0b1000;
/// RCC_D2CFGR (8.7.9): APB 1 and 2 half of AHB (D2PPRE1, D2PPRE2 = 100).
const DOMAIN_2: u32 = 0b100 << 8 | 0b100 << 4;
/// RCC_D3CFGR (8.7.10): APB 4 half of AHB (D3PPRE = 100).
const DOMAIN_3: u32 = 0b100 << 4;
/// RCC_CFGR (8.7.7): system clock from PLL 1 (SW = 011), and the same as the hardware shows it (SWS).
const FROM_PLL: u32 = 0b011;
const IS_FROM_PLL: u32 = 0b011 << 3;
/// FLASH_ACR (4.9.1; table 17, scale 0, AXI at up to 240 MHz): four wait states (LATENCY), WRHIGHFREQ = 10.
const FLASH_TIMES: u32 = 0b10 << 4 | 4;
/// DBGMCU_IDC (60.5.8), REV_ID: the first revision with scale 0, which is V.
const FIRST_REVISION: u32 = 0x2003;

/// Looks at a flag before the start is given up, with the processor at 64 MHz: some 50 ms, while the slowest, the HSE, takes 2 ms.
const PATIENCE: u32 = 300_000;

/// Waits for a flag that the hardware sets; without it nothing starts, and the watchdog tries again.
fn wait(what: &str, is_set: impl Fn() -> bool) {
    for _ in 0..PATIENCE {
        if is_set() {
            return;
        }
    }
    panic!("the clock does not start: {what}");
}

/// Brings the processor to its rate. The parts of the chip are those of the table above alone.
pub(super) fn start(rcc: &RCC, power: &PWR, system: &SYSCFG, flash: &FLASH, debugger: &DBGMCU) {
    let revision = debugger.idc().read().bits() >> 16;
    if revision < FIRST_REVISION {
        panic!("the chip is of revision {revision:#x}: too old for 480 MHz");
    }
    // SAFETY: the values are the manual's, as the constants say; the order is that of RM0433, 6.6.2 and 8.5.5: voltage first,
    // then wait states, then rates.
    unsafe {
        power.cr3().write(|w| w.bits(LDO));
        wait("supply", || power.csr1().read().bits() & READY != 0);
        power.d3cr().write(|w| w.bits(SCALE_1));
        wait("scale 1", || power.d3cr().read().bits() & READY != 0);
        system.pwrcr().write(|w| w.bits(OVERDRIVE));
        wait("scale 0", || power.d3cr().read().bits() & READY != 0);

        rcc.cr().modify(|r, w| w.bits(r.bits() | HSE_BYPASS));
        rcc.cr().modify(|r, w| w.bits(r.bits() | HSE_ON));
        let has = |flag| move || rcc.cr().read().bits() & flag != 0;
        wait("no 8 MHz of the debug probe", has(HSE_READY));
        rcc.pllckselr().write(|w| w.bits(PLL_SOURCE));
        rcc.pllcfgr().write(|w| w.bits(PLL_OUTPUTS));
        rcc.pll1divr().write(|w| w.bits(PLL_DIVIDERS));
        rcc.cr().modify(|r, w| w.bits(r.bits() | PLL_ON));
        wait("PLL 1", has(PLL_READY));

        flash.acr().write(|w| w.bits(FLASH_TIMES));
        wait("flash", || flash.acr().read().bits() == FLASH_TIMES);
        rcc.d1cfgr().write(|w| w.bits(DOMAIN_1));
        rcc.d2cfgr().write(|w| w.bits(DOMAIN_2));
        rcc.d3cfgr().write(|w| w.bits(DOMAIN_3));
        rcc.cfgr().write(|w| w.bits(FROM_PLL));
        wait("switch", || {
            rcc.cfgr().read().bits() & 0b111 << 3 == IS_FROM_PLL
        });
        // Should the 8 MHz fail, the processor runs on from a clock of its own, at another speed, and takes the non-maskable
        // interrupt, which is the end (`fault::DefaultHandler`).
        rcc.cr().modify(|r, w| w.bits(r.bits() | HSE_SECURITY));
    }
}

/// Clocks the ports and the system's configuration.
pub(super) fn clock_ports(rcc: &RCC) {
    rcc.ahb4enr().modify(|_, w| {
        w.gpioaen().set_bit();
        w.gpioben().set_bit();
        w.gpiocen().set_bit();
        w.gpioden().set_bit();
        w.gpioeen().set_bit();
        w.gpiofen().set_bit();
        w.gpiogen().set_bit()
    });
    rcc.apb4enr().modify(|_, w| w.syscfgen().set_bit());
    // "A maximum delay of two periods of the enabled clock" (8.5.10): a read takes longer.
    let _ = rcc.apb4enr().read();
}

/// Clocks and resets the peripherals.
pub(super) fn clock_peripherals(rcc: &RCC) {
    rcc.ahb1enr()
        .modify(|_, w| w.dma1en().set_bit().dma2en().set_bit());
    rcc.ahb2enr().modify(|_, w| w.sram1en().set_bit());
    rcc.apb1lenr().modify(|_, w| {
        w.tim3en().set_bit();
        w.tim4en().set_bit();
        w.tim6en().set_bit();
        w.tim7en().set_bit();
        w.spi2en().set_bit();
        w.usart3en().set_bit()
    });
    rcc.apb2enr().modify(|_, w| {
        w.tim1en().set_bit();
        w.tim8en().set_bit();
        w.tim15en().set_bit();
        w.spi1en().set_bit()
    });
    rcc.ahb1rstr()
        .modify(|_, w| w.dma1rst().set_bit().dma2rst().set_bit());
    rcc.apb1lrstr().modify(|_, w| {
        w.tim3rst().set_bit();
        w.tim4rst().set_bit();
        w.tim6rst().set_bit();
        w.tim7rst().set_bit();
        w.spi2rst().set_bit();
        w.usart3rst().set_bit()
    });
    rcc.apb2rstr().modify(|_, w| {
        w.tim1rst().set_bit();
        w.tim8rst().set_bit();
        w.tim15rst().set_bit();
        w.spi1rst().set_bit()
    });
    rcc.ahb1rstr().reset();
    rcc.apb1lrstr().reset();
    rcc.apb2rstr().reset();
    let _ = rcc.apb2rstr().read();
}
