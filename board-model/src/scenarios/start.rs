//! The start with blank settings.

use anyhow::Result;

use crate::ad5754r::{self, RANGE_10_V, SCLK_NS, SDO_NS};
use crate::bench::Subject;
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::started;

/// Time from a clock edge to a read SDO: 40 ns of the chip, and 10 ns for wire and input.
const READ_NS: u64 = SDO_NS + 10;

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let mut bench = started(image, None)?;
    let mhz = bench
        .clocks()
        .map(|hz| (hz / 1_000_000).to_string())
        .join("/");
    report.equal(
        "SYSCLK/HCLK/PCLK1/PCLK2/timers 1/timers 2, MHz",
        image.board.clocks_mhz.into(),
        mhz,
    );

    bench.run_for(0.1);
    bench.ticks();
    let before = ad5754r::lock(&bench.chip).frames;
    bench.run_for(0.5);
    let ticks = bench.ticks();
    let chip = bench.chip.clone();
    let frames = ad5754r::lock(&chip).frames - before;
    let (shortest, longest) = ticks.period_ns;
    report.equal("control ticks in 0.5 s", 5000, ticks.count);
    report.equal(
        "time from tick to tick, ns",
        "100000 to 100000".into(),
        format!("{shortest} to {longest}"),
    );
    report.equal(
        "frames of 24 bits a tick: A, B, C, question, answer",
        5.0,
        frames as f64 / ticks.count as f64,
    );
    let ad5754r = ad5754r::lock(&chip);
    report.equal(
        "ranges of A, B, C (100 is ±10 V)",
        [RANGE_10_V; 3].map(|r| format!("{r:03b}")).join(" "),
        ad5754r.ranges().map(|r| format!("{r:03b}")).join(" "),
    );
    report.equal(
        "outputs and reference on, /CLR released",
        "true true".into(),
        format!("{} {}", ad5754r.is_on(), ad5754r.is_clear_released()),
    );
    report.equal(
        "codes while disabled",
        "0 0 0".into(),
        ad5754r.codes().map(|c| c.to_string()).join(" "),
    );
    let (ldac, load_ns) = (ad5754r.longest_load, image.board.load_ns);
    report.row(
        "first frame's beginning to /LDAC",
        format!("at most {load_ns} ns"),
        format!("{ldac} ns"),
        (1..=load_ns).contains(&ldac),
    );
    drop(ad5754r);

    // The clock's settings in the frames that are written, and in the first one of a tick, in which a register is read.
    let mut fastest = [u64::MAX; 2];
    let mut takes_at_falling_edge = true;
    for _ in 0..800 {
        bench.run_for(0.3e-6);
        let (divider, place) = image.board.spi_divider;
        let (mode, polarity, phase) = image.board.spi_mode;
        let (divider, mode) =
            bench.with(move |_, board, now| (board.peek(now, divider), board.peek(now, mode)));
        let last_tick = bench.with(|world, _, _| world.ticks.last_ns);
        let Some(begun) = ad5754r::lock(&chip).frame_began() else {
            continue;
        };
        // CPOL and CPHA differ.
        takes_at_falling_edge &= (mode >> polarity & 1) != (mode >> phase & 1);
        let reads = begun > last_tick && begun - last_tick < image.board.read_within_ns;
        let period = 1_000_000_000 * (2 << (divider >> place & 7)) / image.board.spi_hz;
        fastest[usize::from(reads)] = period.min(fastest[usize::from(reads)]);
    }
    report.row(
        "SCLK period while writing",
        format!("at least {SCLK_NS} ns"),
        format!("{} ns", fastest[0]),
        fastest[0] >= SCLK_NS,
    );
    report.row(
        "half an SCLK period while reading",
        format!("at least {READ_NS} ns"),
        format!("{} ns", fastest[1] / 2),
        (READ_NS..1000).contains(&(fastest[1] / 2)),
    );
    report.equal(
        "SDIN is taken at the falling edge (CPOL and CPHA differ)",
        true,
        takes_at_falling_edge,
    );

    let status = Client::open(&mut bench)?.status(&mut bench)?;
    report.equal("overruns", 0, status.overruns);
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}
