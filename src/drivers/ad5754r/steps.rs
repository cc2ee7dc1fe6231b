//! Frames as steps of a timer, so that they leave while the processor does something else.
//!
//! In every step the timer makes DMA write twice: a change of /SYNC and /LDAC, then a byte to the bus. A frame takes four
//! steps: /SYNC falls before its first byte, and rises before a byte more, which the chip does not receive. No hardware but a
//! timer, two DMA streams and an SPI is needed, and the frames have gaps that the SPI alone cannot make.

/// A change of the pins at the beginning of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PinChange {
    /// None.
    Keep,
    /// /SYNC falls: a frame begins.
    Select,
    /// /SYNC rises: it ends.
    Release,
    /// /LDAC falls: the codes go to the outputs.
    Load,
    /// /LDAC rises.
    EndLoad,
}

/// Steps of a frame.
pub const FRAME_STEPS: usize = 4;
/// Steps of the longest sequence.
pub const MAX_STEPS: usize = 4 * FRAME_STEPS + 2;

/// The changes of a writing: three frames, /LDAC, and a fourth frame. A reading is the first frame alone.
pub const PIN_CHANGES: [PinChange; MAX_STEPS] = {
    use PinChange::{EndLoad, Keep, Load, Release, Select};
    [
        Select, Keep, Keep, Release, //
        Select, Keep, Keep, Release, //
        Select, Keep, Keep, Release, //
        Load, EndLoad, //
        Select, Keep, Keep, Release,
    ]
};

/// Steps before the one in which /LDAC falls.
pub const LOAD_STEP: usize = 3 * FRAME_STEPS;
/// Steps before each of the four frames.
pub const FRAMES_AT: [usize; 4] = [0, FRAME_STEPS, 2 * FRAME_STEPS, LOAD_STEP + 2];

/// From the last falling edge of a frame's clock to the rise of /SYNC: at least 13 ns.
const HOLD_NS: u32 = 13;
/// The longest of the times that last a step: /SYNC high before the frame in which the chip answers, at least 200 ns. Between
/// other frames it is 100 ns, from the last one to /LDAC 130 ns, and /LDAC is low for 20 ns.
const LONGEST_GAP_NS: u32 = 200;

/// Times of the hardware that takes the steps, in cycles of the timer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hardware {
    /// The timer's clock, Hz.
    pub timer_hz: u32,
    /// Duration of a bit on the bus.
    pub bit_cycles: u32,
    /// Longest time from a byte's write until its first bit is on the bus.
    pub start_cycles: u32,
    /// Largest delay of one DMA write against another.
    pub late_cycles: u32,
}

/// Count of the timer at which the pins change in a step. Not zero, where it rests.
pub const PINS_AT: u32 = 2;
/// Count of the timer at which the byte is written: after the pins, even if they are late, as one DMA controller makes both writes
/// one after the other.
pub const BYTE_AT: u32 = 6;

impl Hardware {
    /// Duration of a step: a byte that is written as late as it may be has left when the pins change as early as they may in the
    /// next one.
    pub const fn step_cycles(self) -> u32 {
        let hold = (HOLD_NS * (self.timer_hz / 1_000_000)).div_ceil(1_000);
        let step =
            BYTE_AT + self.late_cycles + self.start_cycles + 8 * self.bit_cycles + hold - PINS_AT;
        let gap = (LONGEST_GAP_NS * (self.timer_hz / 1_000_000)).div_ceil(1_000);
        assert!(
            step >= gap + self.late_cycles,
            "the gaps are shorter than the chip needs"
        );
        step
    }

    /// Time from the start of a writing until /LDAC falls, ns, if the write that makes it fall is as late as it may be.
    pub const fn load_ns(self) -> u32 {
        let cycles = LOAD_STEP as u32 * self.step_cycles() + PINS_AT + self.late_cycles;
        (1_000 * cycles).div_ceil(self.timer_hz / 1_000_000)
    }

    /// Duration of some steps, ns.
    pub const fn steps_ns(self, steps: usize) -> u32 {
        (1_000 * steps as u32 * self.step_cycles()).div_ceil(self.timer_hz / 1_000_000)
    }
}
