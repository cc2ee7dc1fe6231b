//! The converter's model by itself: "no complaint" means something only if it complains.

use anyhow::Result;

use crate::ad5754r::{Ad5754r, Wire};
use crate::bench::Subject;
use crate::report::Report;

/// A write of a code to channel A, and one of the power register.
const WRITE_A: [u32; 3] = [0x00, 0x12, 0x34];
const POWER_UP: [u32; 3] = [0x10, 0x00, 0x1F];
/// A question for channel A.
const ASK_A: [u32; 3] = [0x80, 0x00, 0x00];

/// Times of a sequence, ns; each at its least.
#[derive(Clone, Copy)]
struct Times {
    /// Eight bits (8 t1).
    byte: u64,
    /// /SYNC to the first byte's beginning (t4).
    setup: u64,
    /// The last byte to /SYNC (t5).
    hold: u64,
    /// /SYNC high (t6, t17).
    high: u64,
    /// /SYNC high to /LDAC (t10).
    to_ldac: u64,
    /// /LDAC low (t11).
    ldac: u64,
    /// /LDAC low to /SYNC (t9).
    ldac_to_sync: u64,
    /// Bytes of a frame.
    bytes: usize,
    /// First frame.
    first: [u32; 3],
}

/// The times of the data sheet.
const KEPT: Times = Times {
    byte: 264,
    setup: 13,
    hold: 13,
    high: 100,
    to_ldac: 130,
    ldac: 20,
    ldac_to_sync: 20,
    bytes: 3,
    first: WRITE_A,
};

/// Complaints about two frames and a load.
fn complaints(times: Times) -> usize {
    let mut chip = Ad5754r::default();
    let mut now = 1000;
    chip.edge(Wire::Clr, true, now);
    let mut frame = |chip: &mut Ad5754r, bytes: [u32; 3], high: u64| {
        now += high;
        chip.edge(Wire::Bus, false, now);
        now += times.setup;
        for byte in bytes.into_iter().take(times.bytes) {
            now += times.byte;
            chip.byte(byte, 8, now);
        }
        now += times.hold;
        chip.edge(Wire::Bus, true, now);
        now
    };
    frame(&mut chip, times.first, 1000);
    let mut now = frame(&mut chip, WRITE_A, times.high) + times.to_ldac;
    chip.edge(Wire::Ldac, false, now);
    if times.ldac_to_sync < KEPT.ldac_to_sync {
        now += times.ldac_to_sync;
        chip.edge(Wire::Bus, false, now);
        chip.edge(Wire::Bus, true, now);
    }
    now += times.ldac;
    chip.edge(Wire::Ldac, true, now);
    chip.complaints.len()
}

pub(super) fn run(_: &Subject, report: &mut Report) -> Result<()> {
    report.equal("all times at their least: complaints", 0, complaints(KEPT));
    let read = Times {
        first: ASK_A,
        high: 200,
        ..KEPT
    };
    report.equal("the same with a question: complaints", 0, complaints(read));
    for (what, times) in [
        ("a byte in 263 ns", Times { byte: 263, ..KEPT }),
        ("/SYNC high 12 ns after SCLK", Times { hold: 12, ..KEPT }),
        ("/SYNC high for 99 ns", Times { high: 99, ..KEPT }),
        (
            "/SYNC high for 199 ns before a read-out",
            Times { high: 199, ..read },
        ),
        (
            "/LDAC 129 ns after /SYNC",
            Times {
                to_ldac: 129,
                ..KEPT
            },
        ),
        ("/LDAC low for 19 ns", Times { ldac: 19, ..KEPT }),
        (
            "/SYNC 19 ns after /LDAC",
            Times {
                ldac_to_sync: 19,
                high: 200,
                ..KEPT
            },
        ),
        ("frames of 16 bits", Times { bytes: 2, ..KEPT }),
        (
            "a load less than 10 us after power-up",
            Times {
                first: POWER_UP,
                ..KEPT
            },
        ),
    ] {
        let found = complaints(times);
        report.row(
            &format!("{what}: complaints"),
            "at least 1",
            found,
            found > 0,
        );
    }
    Ok(())
}
