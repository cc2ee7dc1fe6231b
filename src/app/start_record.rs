//! Count of starts that did not last, in memory that outlives a reset: after three of them the stored settings are not put
//! in force.

/// Starts in a row that end by a crash before stored settings are set aside.
pub const MOST_STARTS: u8 = 3;
/// Runs of the supervising task after which a start has lasted: 10 s at 10 kHz.
pub const LASTING_RUNS: u32 = 10_000;

/// Number of the starts in a row that have not lasted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StartRecord {
    starts: u8,
}

impl StartRecord {
    /// Encoded size.
    pub const BYTES: usize = 8;
    /// Marks a record: "STRT".
    const MAGIC: [u8; 4] = *b"STRT";

    /// Decodes a record; noise, as after power-up, is none.
    pub fn decode(bytes: [u8; Self::BYTES]) -> Self {
        let [a, b, c, d, starts, inverted, ..] = bytes;
        if [a, b, c, d] == Self::MAGIC && inverted == !starts {
            Self { starts }
        } else {
            Self::default()
        }
    }

    /// Encodes the record.
    pub const fn encode(self) -> [u8; Self::BYTES] {
        let [a, b, c, d] = Self::MAGIC;
        [a, b, c, d, self.starts, !self.starts, 0, 0]
    }

    /// Counts a start. `crashed`: the run before ended by a panic, a fault of the processor or the watchdog; if not, the
    /// count begins again.
    #[must_use]
    pub const fn begin(self, crashed: bool) -> Self {
        Self {
            starts: if crashed {
                self.starts.saturating_add(1)
            } else {
                1
            },
        }
    }

    /// True if stored settings are to be set aside: as many starts as allowed have not lasted.
    pub const fn is_safe_start(self) -> bool {
        self.starts > MOST_STARTS
    }
}
