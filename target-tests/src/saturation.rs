//! `cargo xtask saturation`: what a control tick costs while everything around it is overloaded, tick by tick against the
//! same motion in quiet.

use anyhow::{Context, Result, ensure};
use quadrant_law::command::Command;

use crate::faults::approach::moving;
use crate::faults::case::configuration;
use crate::faults::fixture::Fixture;
use crate::interrupt_latency;
use crate::jitter;
use crate::load;
use crate::trace::{Trace, Tracer};
use crate::traced_run;
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::toolchain::Toolchain;

/// Tick at which the motion is under way and the load has reached its height.
const FROM: u32 = 1_600;
/// Tick before which it has been asked for.
const LOADED: u32 = 1_500;
/// Ticks counted.
const TICKS: u32 = 200;
/// Cost of taking a request of the operator to its queue, instructions: the emulated board's own way in, which is
/// counted here because a real one would cost as much.
const REQUEST: i64 = 26;

/// Load on the firmware.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Load {
    /// Telemetry of as many channels as there may be, at every tick.
    telemetry: bool,
    /// Nobody takes what the firmware sends: its queue of samples is full.
    stops_reading: bool,
    /// Status requests and garbage, as fast as the port takes them.
    flood: bool,
    /// A request of the operator in every tick, all of them refused and logged: their queue is full, and so is the log's.
    requests: bool,
}

impl Load {
    /// Returns the instructions by which a tick may exceed the same tick with the same requests but without load.
    fn tolerance(self) -> i64 {
        if self.requests { REQUEST } else { 0 }
    }
}

/// The loads, and which of the runs before is the one without load.
const LOADS: [(&str, Load, usize); 6] = [
    (
        "in quiet",
        Load {
            telemetry: false,
            stops_reading: false,
            flood: false,
            requests: false,
        },
        0,
    ),
    (
        "frames and garbage without a pause",
        Load {
            telemetry: false,
            stops_reading: false,
            flood: true,
            requests: false,
        },
        0,
    ),
    (
        "a request in every tick, refused and logged",
        Load {
            telemetry: false,
            stops_reading: false,
            flood: false,
            requests: true,
        },
        0,
    ),
    (
        "telemetry of 8 channels in every tick",
        Load {
            telemetry: true,
            stops_reading: false,
            flood: false,
            requests: false,
        },
        3,
    ),
    (
        "the same, and nobody takes it",
        Load {
            telemetry: true,
            stops_reading: true,
            flood: false,
            requests: false,
        },
        3,
    ),
    (
        "all of it at once",
        Load {
            telemetry: true,
            stops_reading: true,
            flood: true,
            requests: true,
        },
        3,
    ),
];

/// Counts under every load, prints the table, and fails if a load lengthens a tick, or if the jitter has grown.
pub(crate) fn run(toolchain: Toolchain, scalar: Scalar, overwrite: bool) -> Result<()> {
    let board = Board::Mps2;
    let image = image::build(toolchain, Target::new(board, scalar))?;
    println!(
        "{}: instructions of {TICKS} control ticks, each against the same tick of the motion without the load",
        image.target
    );
    println!("| load | mean | largest | most added to a tick |");
    println!("|---|---|---|---|");
    let mut runs: Vec<Vec<u32>> = Vec::new();
    for (index, (name, load, without)) in LOADS.into_iter().enumerate() {
        let counted = count(&image, load).context(name)?;
        let base = if without == index {
            &counted
        } else {
            &runs[without]
        };
        let added = counted
            .iter()
            .zip(base)
            .map(|(loaded, quiet)| i64::from(*loaded) - i64::from(*quiet))
            .max()
            .context("there are ticks")?;
        let sum: u64 = counted.iter().copied().map(u64::from).sum();
        let largest = counted.iter().max().context("there are ticks")?;
        println!(
            "| {name} | {:.1} | {largest} | {added} |",
            sum as f64 / f64::from(TICKS)
        );
        ensure!(
            added <= load.tolerance(),
            "{name}: a tick takes {added} instructions more"
        );
        runs.push(counted);
    }
    println!(
        "longest stretches with interrupts masked, in instructions, with a line for the log in every millisecond:"
    );
    let stretches = interrupt_latency::longest(&image)?;
    ensure!(
        !stretches.is_empty(),
        "no place masks interrupts: none was looked at"
    );
    for (place, length) in stretches {
        println!("  {length:>6}  {place}");
    }
    jitter::run(&image, overwrite)
}

/// The instructions of each tick under a load.
fn count(image: &Image, load: Load) -> Result<Vec<u32>> {
    let trace = Trace::of(image)?;
    let ticks = traced_run::run(
        image,
        configuration(),
        |memory| trace.start(image, memory),
        |fixture, tracer| drive(fixture, tracer, load),
        |lines| trace.read(image, lines),
    )?;
    let counted = ticks
        .get(..TICKS as usize)
        .context("the trace ends too early")?;
    counted
        .iter()
        .map(|tick| Ok(tick.whole()?.instructions()))
        .collect()
}

/// Runs the motion, and the load from [`LOADED`] on.
fn drive(mut fixture: Fixture, tracer: &mut Tracer, load: Load) -> Result<()> {
    moving(&mut fixture, 1.0)?;
    if load.telemetry {
        load::select_telemetry(&mut fixture)?;
    }
    if load.stops_reading {
        fixture.stop_reading();
    }
    if load.requests {
        fixture.inject(Box::new(|input, _, _| input.request = Some(Command::Run)));
    }
    ensure!(fixture.tick() < LOADED, "tick {} already", fixture.tick());
    let before = fixture.sent();
    while fixture.tick() < FROM + TICKS + 1 {
        if fixture.tick() == FROM {
            tracer.trace()?;
        }
        if load.flood {
            load::flood(&mut fixture)?;
        }
        fixture.run(1)?;
    }
    if load.flood {
        load::ensure_flooded(&fixture, before, TICKS)?;
    }
    fixture.end().map(drop)
}
