//! Model of Analog Devices' quad 16-bit converter AD5754R, behind its five wires.
//!
//! Written from memory of its data sheet (table of timing characteristics, input shift register format, register map), without
//! reading this project's driver. Every violation of a time or a format is a complaint, and a frame that violates the format
//! does nothing. `SCLK`'s edges are not seen, only bytes: that its period is long enough is for the scenario to check.
//!
//! Not modelled: analogue settling, thermal shutdown, daisy chains.

use std::sync::{Arc, Mutex, MutexGuard};

use rigless::chip::Timeline;
use rigless::chip::spi::Peer;
use rigless::device::Level;
use rigless::snapshot::{Error, Reader, Store, Writer};

/// `SCLK` cycle time, ns (t1).
pub const SCLK_NS: u64 = 33;
/// Falling edge of `SCLK` to the rising one of `/SYNC`, ns (t5).
const SYNC_HOLD_NS: u64 = 13;
/// Falling edge of `/SYNC` to the first falling one of `SCLK`, ns (t4).
const SYNC_SETUP_NS: u64 = 13;
/// `/SYNC` high between writes, ns (t6).
const SYNC_HIGH_NS: u64 = 100;
/// Falling edge of `/LDAC` to the falling one of `/SYNC`, ns (t9).
const LDAC_TO_SYNC_NS: u64 = 20;
/// Rising edge of `/SYNC` to the falling one of `/LDAC`, ns (t10).
const SYNC_TO_LDAC_NS: u64 = 130;
/// `/LDAC` low, ns (t11).
const LDAC_LOW_NS: u64 = 20;
/// `/CLR` low, ns (t13).
const CLR_LOW_NS: u64 = 20;
/// Rising edge of `SCLK` to a valid `SDO` with 15 pF, ns (t16).
pub const SDO_NS: u64 = 40;
/// `/SYNC` high before the frame in which a register is read out, ns (t17).
const SYNC_HIGH_READ_NS: u64 = 200;
/// Power-up of a channel or of the reference until it may be loaded, ns.
const POWER_UP_NS: u64 = 10_000;
/// Outputs of the chip.
pub const CHANNELS: usize = 4;
/// Range code of ±10 V.
pub const RANGE_10_V: u16 = 0b100;

/// The chip's state.
#[derive(Debug)]
pub struct Ad5754r {
    /// False while the chip has no supply: it answers zeros and acts on nothing.
    powered: bool,
    shift: u32,
    bits: u32,
    reads_out: bool,
    input: [u16; CHANNELS],
    dac: [u16; CHANNELS],
    range: [u16; CHANNELS],
    power: u16,
    control: u16,
    powered_up_at: u64,
    sync: bool,
    ldac: bool,
    clr: bool,
    sync_fell: u64,
    sync_rose: u64,
    ldac_fell: u64,
    clr_fell: u64,
    last_edge: u64,
    /// Complaints: time in ns, text; the first 20.
    pub complaints: Vec<(u64, String)>,
    /// Frames of 24 bits that were carried out.
    pub frames: u64,
    /// Beginning of the last write frame to channel A, ns.
    began: u64,
    /// The longest time from the beginning of the write frame to channel A to `/LDAC`, ns.
    pub longest_load: u64,
    /// The chip loses its supply after so many bytes.
    pub fails_after_bytes: Option<u32>,
}

impl Default for Ad5754r {
    fn default() -> Self {
        Self {
            powered: true,
            shift: 0,
            bits: 0,
            reads_out: false,
            input: [0; CHANNELS],
            dac: [0; CHANNELS],
            range: [0; CHANNELS],
            power: 0,
            control: CONTROL_DEFAULT,
            powered_up_at: 0,
            sync: true,
            ldac: true,
            clr: false,
            sync_fell: 0,
            sync_rose: 0,
            ldac_fell: 0,
            clr_fell: 0,
            last_edge: 0,
            complaints: Vec::new(),
            frames: 0,
            began: 0,
            longest_load: 0,
            fails_after_bytes: None,
        }
    }
}

/// Control register after power-on: the current limit clamps.
const CONTROL_DEFAULT: u16 = 0b0100;
/// Control register: SDO is off.
const SDO_DISABLE: u16 = 0b0001;
/// Control register: `/CLR` sets the bipolar outputs to negative full scale.
const CLR_SELECT: u16 = 0b0010;
/// Power register: the bits that a write sets, four channels and the reference.
const POWER_BITS: u16 = 0b1_1111;
/// Power register: the reference is on.
const POWER_REFERENCE: u16 = 1 << 4;
/// Contents of the unspecified upper byte of an answer.
const UNSPECIFIED: u32 = 0x5A << 16;

impl Ad5754r {
    /// The output voltages of A, B and C at BIN//2sCOMP = low; zero without power.
    pub fn volts(&self) -> [f64; 3] {
        std::array::from_fn(|channel| {
            let on = self.power & (1 << channel) != 0 && self.power & POWER_REFERENCE != 0;
            if !(self.powered && on && self.range[channel] == RANGE_10_V) {
                return 0.0;
            }
            f64::from(self.dac[channel] as i16) / 32768.0 * 10.0
        })
    }

    /// The loaded codes of A, B and C.
    pub fn codes(&self) -> [i16; 3] {
        std::array::from_fn(|channel| self.dac[channel] as i16)
    }

    /// Ranges of A, B and C.
    pub fn ranges(&self) -> [u16; 3] {
        std::array::from_fn(|channel| self.range[channel])
    }

    /// True if the outputs A, B and C and the reference are on.
    pub fn is_on(&self) -> bool {
        let all = POWER_REFERENCE | 0b111;
        self.powered && self.power & all == all
    }

    /// True if `/CLR` is high.
    pub fn is_clear_released(&self) -> bool {
        self.clr
    }

    /// The beginning of the frame under way, ns.
    pub fn frame_began(&self) -> Option<u64> {
        (!self.sync).then_some(self.sync_fell)
    }

    /// Takes the supply away.
    pub fn power_off(&mut self) {
        *self = Self {
            powered: false,
            sync: self.sync,
            ldac: self.ldac,
            clr: self.clr,
            complaints: std::mem::take(&mut self.complaints),
            frames: self.frames,
            ..Self::default()
        };
    }

    /// Gives the supply back: the chip is as after power-on.
    pub fn power_on(&mut self) {
        self.power_off();
        self.powered = true;
    }

    /// A wire changes its level.
    pub fn edge(&mut self, wire: Wire, high: bool, now: u64) {
        match wire {
            Wire::Bus => self.set_sync(high, now),
            Wire::Ldac => self.set_ldac(high, now),
            Wire::Clr => self.set_clr(high, now),
        }
    }

    fn complain(&mut self, now: u64, text: impl Into<String>) {
        if self.complaints.len() < 20 {
            self.complaints.push((now, text.into()));
        }
    }

    fn check(&mut self, now: u64, since: u64, least: u64, what: &str) {
        let passed = now - since;
        if since != 0 && passed < least {
            self.complain(now, format!("{what}: {passed} ns instead of {least} ns"));
        }
    }

    /// Bits have crossed the bus; returns those of SDO.
    pub fn byte(&mut self, mosi: u32, bits: u32, now: u64) -> u32 {
        if let Some(left) = &mut self.fails_after_bytes {
            *left = left.saturating_sub(1);
            if *left == 0 {
                self.power_off();
            }
        }
        if !self.powered {
            return 0;
        }
        let setup = if self.bits == 0 { SYNC_SETUP_NS } else { 0 };
        let since = self.last_edge.max(self.sync_fell);
        self.check(
            now,
            since,
            u64::from(bits) * SCLK_NS + setup,
            "a byte's bits",
        );
        self.last_edge = now;
        self.bits += bits;
        let shifted = u64::from(self.shift) << bits;
        self.shift = (shifted as u32 | mosi) & 0xFF_FFFF;
        match self.control & SDO_DISABLE {
            0 => (shifted >> 24) as u32,
            _ => 0,
        }
    }

    fn set_sync(&mut self, high: bool, now: u64) {
        if self.sync == high {
            return;
        }
        self.sync = high;
        if !high {
            let least = if self.reads_out {
                SYNC_HIGH_READ_NS
            } else {
                SYNC_HIGH_NS
            };
            self.check(now, self.sync_rose, least, "/SYNC high");
            self.check(
                now,
                self.ldac_fell,
                LDAC_TO_SYNC_NS,
                "/LDAC low before /SYNC",
            );
            self.sync_fell = now;
            self.bits = 0;
            self.reads_out = false;
            return;
        }
        self.sync_rose = now;
        if !self.powered {
            return;
        }
        match self.bits {
            0 => {}
            24 => {
                self.check(now, self.last_edge, SYNC_HOLD_NS, "/SYNC after SCLK");
                self.frames += 1;
                self.execute(now);
            }
            bits => self.complain(now, format!("a frame of {bits} bits")),
        }
    }

    /// Carries out the frame in the shift register: R/W, 0, three bits of register, three of address, 16 of data.
    fn execute(&mut self, now: u64) {
        let frame = self.shift;
        let (reads, register, address) = (frame >> 23 == 1, frame >> 19 & 7, frame >> 16 & 7);
        let data = (frame & 0xFFFF) as u16;
        let channels = match address {
            4 => 0..CHANNELS,
            channel if channel < 4 => channel as usize..channel as usize + 1,
            _ => 0..0,
        };
        let one = channels.start;
        if frame >> 22 & 1 != 0 {
            self.complain(now, format!("bit 22 set in {frame:#08x}"));
            return;
        }
        match (reads, register) {
            (true, 0..=3) => {
                let value = match register {
                    0 => self.dac.get(one).copied().unwrap_or(0),
                    1 => self.range.get(one).copied().unwrap_or(0),
                    2 => self.power,
                    _ => self.control,
                };
                self.shift = UNSPECIFIED | u32::from(value);
                self.reads_out = true;
            }
            (false, 0) if !channels.is_empty() => {
                if one == 0 {
                    self.began = self.sync_fell;
                }
                self.input[channels].fill(data);
                if !self.ldac {
                    self.load(now);
                }
            }
            (false, 1) if !channels.is_empty() && data & 7 <= 5 => {
                self.range[channels].fill(data & 7);
            }
            (false, 2) if address == 0 => {
                if data & POWER_BITS & !self.power != 0 {
                    self.powered_up_at = now;
                }
                self.power = data & POWER_BITS;
            }
            (false, 3) if address == 0 => {}
            (false, 3) if address == 1 => self.control = data & 0xF,
            (false, 3) if address == 4 => self.clear(),
            (false, 3) if address == 5 => self.load(now),
            _ => self.complain(now, format!("no such register or value: {frame:#08x}")),
        }
    }

    fn load(&mut self, now: u64) {
        if !self.clr {
            return;
        }
        if self.power != 0 {
            self.check(now, self.powered_up_at, POWER_UP_NS, "load after power-up");
        }
        self.dac = self.input;
        self.longest_load = self.longest_load.max(now - self.began);
    }

    fn clear(&mut self) {
        let code = if self.control & CLR_SELECT == 0 {
            0
        } else {
            0x8000
        };
        self.dac = [code; CHANNELS];
    }

    fn set_ldac(&mut self, high: bool, now: u64) {
        if self.ldac == high {
            return;
        }
        self.ldac = high;
        if high {
            self.check(now, self.ldac_fell, LDAC_LOW_NS, "/LDAC low");
            return;
        }
        self.ldac_fell = now;
        if self.powered {
            self.check(
                now,
                self.sync_rose,
                SYNC_TO_LDAC_NS,
                "/SYNC high before /LDAC",
            );
            self.load(now);
        }
    }

    fn set_clr(&mut self, high: bool, now: u64) {
        if self.clr == high {
            return;
        }
        self.clr = high;
        if high {
            self.check(now, self.clr_fell, CLR_LOW_NS, "/CLR low");
        } else {
            self.clr_fell = now;
            self.clear();
        }
    }
}

/// The converter, shared by its wires and the scenario.
pub type Shared = Arc<Mutex<Ad5754r>>;

/// A wire that ends at the converter.
#[derive(Clone, Copy, Debug)]
pub enum Wire {
    /// The serial bus, selected by `/SYNC`.
    Bus,
    /// `/LDAC`.
    Ldac,
    /// `/CLR`.
    Clr,
}

impl Wire {
    /// The level that the wire does not have at first: a chip whose pins float out of reset does not report the one that it has.
    pub const fn active(self) -> Level {
        match self {
            Self::Bus | Self::Ldac => Level::Low,
            Self::Clr => Level::High,
        }
    }
}

/// The converter's end of a wire. All are attached as chips of a serial bus, selected at [`Wire::active`]: so rigless
/// reports a pin's edges.
#[derive(Debug)]
pub struct End {
    wire: Wire,
    chip: Shared,
}

impl End {
    /// The end of a wire.
    pub fn new(wire: Wire, chip: &Shared) -> Self {
        Self {
            wire,
            chip: chip.clone(),
        }
    }

    fn edge(&self, high: bool, now: u64) {
        lock(&self.chip).edge(self.wire, high, now);
    }
}

/// The chip behind the lock, also after a panic elsewhere.
pub fn lock(chip: &Shared) -> MutexGuard<'_, Ad5754r> {
    chip.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Store for End {
    fn store(&self, _: &mut Writer) -> Result<(), Error> {
        Ok(())
    }

    fn load(&mut self, _: &mut Reader) -> Result<(), Error> {
        Ok(())
    }
}

impl Peer for End {
    fn transfer(&mut self, mosi: u32, bits: u8, context: &mut Timeline<'_, '_>) -> u32 {
        lock(&self.chip).byte(mosi, bits.into(), context.now().0)
    }

    fn select(&mut self, context: &mut Timeline<'_, '_>) {
        self.edge(self.wire.active() == Level::High, context.now().0);
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        self.edge(self.wire.active() == Level::Low, context.now().0);
    }
}
