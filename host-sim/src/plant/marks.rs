//! Limit switches, home switch and index pulses of a simulated axis.

use quadrant_law::encoder::EncoderReading;
use quadrant_law::safety::AxisSwitches;

/// True positions of an axis' switches and index pulses. Every number is chosen, none measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkParameters {
    /// The negative limit switch is pressed below this, mm.
    pub negative_limit_mm: f64,
    /// The positive limit switch is pressed above this, mm.
    pub positive_limit_mm: f64,
    /// The home switch is pressed below this, mm.
    pub home_mm: f64,
    /// Hysteresis of the switches, mm: how much later they let go than they are pressed.
    pub hysteresis_mm: f64,
    /// Position of one of the index pulses, counts.
    pub index_count: i64,
    /// Counts between two of them.
    pub counts_per_index: i64,
}

impl Default for MarkParameters {
    /// Limit switches 5 mm beyond the default travel, a home switch at -40 mm, and an index pulse in every turn of a screw
    /// with a lead of 10 mm, one of them at -36 mm.
    fn default() -> Self {
        Self {
            negative_limit_mm: -205.0,
            positive_limit_mm: 205.0,
            home_mm: -40.0,
            hysteresis_mm: 0.05,
            index_count: -72_000,
            counts_per_index: 20_000,
        }
    }
}

/// The marks of an axis in use.
#[derive(Clone, Copy, Debug, Default)]
pub struct Marks {
    truth: MarkParameters,
    pressed: AxisSwitches,
    /// The encoder's count when it was last read.
    count: i64,
}

impl Marks {
    /// Marks of an axis that stands at zero.
    pub fn new(truth: MarkParameters) -> Self {
        Self {
            truth,
            ..Self::default()
        }
    }

    /// The same marks of an axis that stands at zero.
    pub(super) fn restarted(self) -> Self {
        Self::new(self.truth)
    }

    /// Returns the board's readings: the counter with what it latched at an index pulse on the way, and the switches.
    pub fn read(&mut self, counter: u32, position_mm: f64) -> (EncoderReading, AxisSwitches) {
        let truth = self.truth;
        let last = self.count;
        // The counter wraps; the axis moves by less than half of it between two readings.
        self.count += i64::from(counter.wrapping_sub(last as u32) as i32);
        let (low, high) = (last.min(self.count), last.max(self.count));
        let spacing = truth.counts_per_index;
        let pulse = (high - truth.index_count).div_euclid(spacing) * spacing + truth.index_count;
        let mut switches = AxisSwitches::default();
        for (switch, beyond_mm) in [
            (
                AxisSwitches::NEGATIVE_LIMIT,
                truth.negative_limit_mm - position_mm,
            ),
            (
                AxisSwitches::POSITIVE_LIMIT,
                position_mm - truth.positive_limit_mm,
            ),
            (AxisSwitches::HOME, truth.home_mm - position_mm),
        ] {
            let release_mm = if self.pressed.has(switch) {
                -truth.hysteresis_mm
            } else {
                0.0
            };
            if beyond_mm > release_mm {
                switches = switches.with(switch);
            }
        }
        self.pressed = switches;
        let reading = EncoderReading {
            index: (pulse > low).then_some(pulse as u32),
            ..EncoderReading::of(counter)
        };
        (reading, switches)
    }
}
