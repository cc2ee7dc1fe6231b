//! The boards as their pages have them: what is wired to which pin, where the chip has what, and what is promised.

use std::ops::Range;

/// A pin: port (0 for A) and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct At(pub usize, pub u8);

/// A timer of the chip model, by its kind and its place in the model's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimerModel {
    /// General purpose.
    General(usize),
    /// Advanced control.
    Advanced(usize),
    /// TIM15 of the STM32H743.
    Fifteen,
}

/// An encoder at its timer.
#[derive(Clone, Copy, Debug)]
pub struct Encoder {
    /// A, B, index.
    pub lines: [At; 3],
    /// The alternate function that leads them to the timer.
    pub function: u8,
    /// The timer.
    pub timer: TimerModel,
    /// Its base address.
    pub base: u64,
    /// Bits of its counter.
    pub mask: u32,
}

/// Lines of another control.
#[derive(Clone, Copy, Debug)]
pub struct Pulses {
    /// Step, direction.
    pub lines: [At; 2],
    /// The alternate function that leads them to the timer.
    pub function: u8,
    /// The timer.
    pub timer: TimerModel,
    /// Its base address.
    pub base: u64,
    /// SERVO ON, closed to ground: on.
    pub servo_on: At,
    /// ALARM, high while all is well.
    pub alarm: At,
}

/// Model of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// An STM32F427 in the place of an STM32F446.
    F4,
    /// An STM32H743.
    H7,
}

/// A board.
#[derive(Debug)]
pub struct Wiring {
    /// Name, as the image has it.
    pub name: &'static str,
    /// Model of its chip.
    pub family: Family,
    /// Clock of the core, Hz.
    pub core_hz: u64,
    /// Instructions a second of virtual time, unless a scenario needs more.
    pub instructions_per_s: u64,
    /// SYSCLK/HCLK/PCLK1/PCLK2/timers 1/timers 2, MHz.
    pub clocks_mhz: &'static str,
    /// Amplifier enable, high enables.
    pub enable: At,
    /// Second contact of the emergency stop.
    pub emergency_stop: At,
    /// Amplifiers ready.
    pub ready: At,
    /// Faults of the amplifiers x, y, z.
    pub faults: [At; 3],
    /// Limits x-, x+, y-, y+, z-, z+.
    pub limits: [At; 6],
    /// Home switches.
    pub homes: [At; 3],
    /// Enabling button, and its level while it is up.
    pub button: (At, bool),
    /// Outputs that a resistor pulls to ground: enable, brake, /CLR, ALARM.
    pub pulled_down: [At; 4],
    /// x, y, z.
    pub encoders: [Encoder; 3],
    /// Another control's, for x.
    pub pulses: Pulses,
    /// Port of /SYNC, /LDAC and /CLR, and their numbers.
    pub converter_port: &'static str,
    /// See there.
    pub converter_pins: [u8; 3],
    /// Index of the SPI that has the bus, and of one that is not used.
    pub spi: [usize; 2],
    /// Index of the SPI that has the serial encoder.
    pub serial_spi: usize,
    /// Age of its position, us (docs/serial-encoders.md); the model latches it up to a byte later.
    pub serial_age_us: [f64; 2],
    /// Index of the link's USART.
    pub usart: usize,
    /// Address of the SPI's register that has the divider, and the place of its three bits.
    pub spi_divider: (u64, u32),
    /// Address of the SPI's register that has clock polarity and phase, and their bits.
    pub spi_mode: (u64, u32, u32),
    /// Kernel clock of the SPI, Hz.
    pub spi_hz: u64,
    /// IWDG_KR.
    pub watchdog_key: u64,
    /// Registers of all ports.
    pub ports: Range<u64>,
    /// The two sectors of settings: their address, and the size of each.
    pub settings: (u64, u64),
    /// The flash's control register: address, bit that starts an erasure, place of the sector's number, number of the first sector.
    pub flash_control: (u64, u64, u32, u64),
    /// Addresses below the stack, which is at the bottom of RAM.
    pub below_stack: Range<u64>,
    /// Pulses of an encoder's line that do not pass its filter, and that do, ns.
    pub filtered_ns: [u64; 2],
    /// Beginning of the first frame to /LDAC at most, ns.
    pub load_ns: u64,
    /// A reading takes less than this from a tick's beginning, ns.
    pub read_within_ns: u64,
    /// Supply below the lowest threshold of the supply monitor, mV.
    pub low_mv: u32,
    /// The watchdog's time after its last feed, s.
    pub watchdog_s: [f64; 2],
    /// True if the control ticks go on in time for the watchdog when the chip has fallen back to its own clock.
    pub own_clock_feeds: bool,
    /// Highest control rate, Hz.
    pub fastest_hz: f64,
    /// Longest start, s.
    pub start_s: f64,
    /// Complaints of the chip model that are about the model, by a part of their text.
    pub known: &'static [&'static str],
}

/// All of them.
pub const BOARDS: [&Wiring; 2] = [&NUCLEO_F446RE, &NUCLEO_H743ZI2];

/// docs/board-nucleo-f446re.md; alternate functions by the data sheet of the F446, table 11.
pub static NUCLEO_F446RE: Wiring = Wiring {
    name: "nucleo-f446re",
    family: Family::F4,
    core_hz: 180_000_000,
    // 1.8 cycles each.
    instructions_per_s: 100_000_000,
    clocks_mhz: "180/180/45/90/90/180",
    enable: At(2, 9),
    emergency_stop: At(0, 0),
    ready: At(0, 1),
    faults: [At(0, 8), At(0, 9), At(0, 10)],
    limits: [At(2, 0), At(2, 1), At(2, 2), At(2, 3), At(2, 4), At(2, 5)],
    homes: [At(2, 10), At(2, 11), At(2, 12)],
    button: (At(2, 13), true),
    pulled_down: [At(2, 9), At(1, 5), At(1, 2), At(0, 12)],
    encoders: [
        Encoder {
            lines: [At(1, 8), At(1, 9), At(1, 10)],
            function: 1,
            timer: TimerModel::General(0),
            base: 0x4000_0000,
            mask: u32::MAX,
        },
        Encoder {
            lines: [At(0, 6), At(0, 7), At(1, 0)],
            function: 2,
            timer: TimerModel::General(1),
            base: 0x4000_0400,
            mask: 0xFFFF,
        },
        Encoder {
            lines: [At(2, 6), At(2, 7), At(2, 8)],
            function: 3,
            timer: TimerModel::Advanced(1),
            base: 0x4001_0400,
            mask: 0xFFFF,
        },
    ],
    pulses: Pulses {
        lines: [At(1, 6), At(1, 7)],
        function: 2,
        timer: TimerModel::General(2),
        base: 0x4000_0800,
        servo_on: At(0, 11),
        alarm: At(0, 12),
    },
    converter_port: "GPIOB",
    converter_pins: [12, 1, 2],
    spi: [1, 0],
    serial_spi: 2,
    serial_age_us: [22.2, 25.2],
    usart: 1,
    // SPI2_CR1.
    spi_divider: (0x4000_3800, 3),
    spi_mode: (0x4000_3800, 1, 0),
    spi_hz: 45_000_000,
    watchdog_key: 0x4000_3000,
    ports: 0x4002_0000..0x4002_0C00,
    settings: (0x0800_4000, 0x4000),
    // FLASH_CR.
    flash_control: (0x4002_3C10, 16, 3, 1),
    below_stack: 0x1FFF_8000..0x2000_0000,
    // 8 samples at 180/16 MHz (RM0390, IC1F = 1100): 711 ns; for the timers of APB 1 at 90/8 MHz the same.
    filtered_ns: [700, 720],
    load_ns: 7_800,
    read_within_ns: 7_000,
    low_mv: 2840,
    watchdog_s: [6.8e-3, 18.8e-3],
    own_clock_feeds: false,
    fastest_hz: 15_000.0,
    start_s: 2.0,
    known: &[],
};

/// docs/board-nucleo-h743zi2.md; alternate functions by the data sheet of the H743.
pub static NUCLEO_H743ZI2: Wiring = Wiring {
    name: "nucleo-h743zi2",
    family: Family::H7,
    core_hz: 480_000_000,
    // 4.8 cycles each, which is more than this core takes: a model of twice as many is twice as slow.
    instructions_per_s: 100_000_000,
    clocks_mhz: "480/240/120/120/240/240",
    enable: At(2, 9),
    emergency_stop: At(3, 0),
    ready: At(3, 1),
    faults: [At(3, 3), At(3, 4), At(3, 5)],
    limits: [At(5, 0), At(5, 1), At(5, 2), At(5, 3), At(5, 4), At(5, 5)],
    homes: [At(5, 7), At(5, 8), At(5, 9)],
    button: (At(2, 13), false),
    pulled_down: [At(2, 9), At(2, 10), At(6, 0), At(4, 4)],
    encoders: [
        Encoder {
            lines: [At(4, 9), At(4, 11), At(4, 13)],
            function: 1,
            timer: TimerModel::Advanced(0),
            base: 0x4001_0000,
            mask: 0xFFFF,
        },
        Encoder {
            lines: [At(2, 6), At(2, 7), At(2, 8)],
            function: 2,
            timer: TimerModel::General(1),
            base: 0x4000_0400,
            mask: 0xFFFF,
        },
        Encoder {
            lines: [At(3, 12), At(3, 13), At(3, 14)],
            function: 2,
            timer: TimerModel::General(2),
            base: 0x4000_0800,
            mask: 0xFFFF,
        },
    ],
    pulses: Pulses {
        lines: [At(4, 5), At(4, 6)],
        function: 4,
        timer: TimerModel::Fifteen,
        base: 0x4001_4000,
        servo_on: At(4, 3),
        alarm: At(4, 4),
    },
    converter_port: "GPIOG",
    converter_pins: [2, 3, 0],
    spi: [0, 2],
    serial_spi: 1,
    serial_age_us: [21.0, 23.7],
    usart: 2,
    // SPI1_CFG1, MBR, and SPI1_CFG2, CPOL and CPHA.
    spi_divider: (0x4001_3008, 28),
    spi_mode: (0x4001_300C, 25, 24),
    spi_hz: 48_000_000,
    watchdog_key: 0x5800_4800,
    ports: 0x5802_0000..0x5802_2C00,
    settings: (0x081C_0000, 0x2_0000),
    // FLASH_CR2.
    flash_control: (0x5200_210C, 7, 8, 6),
    below_stack: 0x1FFF_0000..0x2000_0000,
    // 6 samples at 240/32 MHz (RM0433, IC1F = 1000, CKD = 10): 800 ns.
    filtered_ns: [790, 810],
    load_ns: 8_200,
    read_within_ns: 7_500,
    low_mv: 2700,
    watchdog_s: [9.5e-3, 10.9e-3],
    // 64 MHz instead of 480: a tick lasts 0.75 ms, and the watchdog is fed every tenth.
    own_clock_feeds: true,
    fastest_hz: 20_000.0,
    start_s: 2.0,
    // The model ends at scale 1, 400 MHz (rigless, pwr.rs, "Voltage scale 0 and SYSCFG_PWRCR.ODEN").
    known: &["for the voltage scale in use"],
};
