//! Jitter of the output: instructions from the control interrupt's entry to the converter word, in every tick of a circle while link,
//! log and capture are busy.

use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;

use anyhow::{Context, Result, bail, ensure};
use quadrant_law::command::Command;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_link::message::{Body, CaptureRequest, Trigger};
use serde::{Deserialize, Serialize};

use crate::attribution::Attribution;
use crate::faults::approach::{LONGEST, SPEED_MM_S, homed};
use crate::faults::fixture::Fixture;
use crate::hosted;
use crate::load;
use crate::trace::{Trace, Tracer};
use crate::traced_run;
use xtask::golden::{self, Golden};
use xtask::image::Image;
use xtask::listing::Listing;

/// Radius of the circle of x and y, mm; z stands still.
const RADIUS_MM: f64 = 1.0;
/// Ticks of the circle, at [`SPEED_MM_S`] and 10 kHz.
const TICKS: u32 = 2_095;
/// Ticks under load before the first that counts.
const SETTLING: u32 = 100;
/// Share of the capture that comes before its trigger, %.
const BEFORE_PERCENT: u8 = 99;
/// Function that puts the words out, and the one of a volatile write.
const OUTPUT: &str =
    "<quadrant_firmware::board::mps2::Amplifiers as quadrant::hal::Amplifiers>::write";
const STORE: &str = "core::ptr::write_volatile";

/// Growth of the spread that is allowed, %.
const TOLERANCE_PERCENT: f64 = 5.0;

/// File of the expected spread.
const GOLDEN: Golden = Golden {
    path: golden::JITTER,
    head: "Written by `cargo xtask saturation --overwrite-expected`; `cargo xtask saturation` compares its figures with these.",
};

/// Instructions from the interrupt's entry to the first converter word, that one included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Latency {
    ticks: u32,
    min: u32,
    max: u32,
}

impl Latency {
    fn spread(self) -> u32 {
        self.max - self.min
    }
}

/// Counts, prints, and compares the spread with the committed one.
pub(crate) fn run(image: &Image, overwrite: bool) -> Result<()> {
    let counts = count(image)?;
    let mean = counts.iter().copied().map(f64::from).sum::<f64>() / f64::from(TICKS);
    let latency = Latency {
        ticks: TICKS,
        min: counts.iter().copied().min().context("there are ticks")?,
        max: counts.iter().copied().max().context("there are ticks")?,
    };
    println!(
        "jitter: instructions from the interrupt's entry to the converter word, over {TICKS} ticks of a circle with link, log and capture busy:\n  \
         mean {mean:.1}, least {}, most {}, spread {}",
        latency.min,
        latency.max,
        latency.spread()
    );
    let key = image.target.scalar_name();
    if overwrite {
        return GOLDEN.store(Some(&image.compiler), [(key, latency)]);
    }
    let Some((expected, difference)) = GOLDEN.read::<Latency>()?.table(&key, &image.compiler)
    else {
        bail!(
            "no jitter is committed for {key}: `cargo xtask saturation --overwrite-expected` makes it"
        );
    };
    let growth = 100.0 * (f64::from(latency.spread()) / f64::from(expected.spread()) - 1.0);
    println!("  {key}: {growth:+.1} % against the committed spread");
    difference.ensure(growth.abs() <= TOLERANCE_PERCENT, || {
        format!(
            "{key}: the jitter has changed by {growth:+.1} %, more than {TOLERANCE_PERCENT} %; if that is intended, \
             `cargo xtask saturation --overwrite-expected` accepts it"
        )
    })
}

/// The instructions of each tick of the circle up to the word.
fn count(image: &Image) -> Result<Vec<u32>> {
    let mut configuration = hosted::homed_configuration();
    let sine = HarmonicSettings {
        cycles: None,
        ..HarmonicSettings::with_velocity(RADIUS_MM, SPEED_MM_S, 1.0, 0.1)
    };
    let cosine = HarmonicSettings {
        phase_rad: FRAC_PI_2,
        ..sine
    };
    configuration.job.plan.motions = [
        MotionSettings::Harmonic(sine),
        MotionSettings::Harmonic(cosine),
        MotionSettings::Hold,
    ];
    let trace = Trace::of(image)?;
    let ticks = traced_run::run(
        image,
        configuration,
        |memory| trace.start(image, memory),
        drive,
        |lines| trace.read(image, lines),
    )?;
    let stores = stores(image, trace.root())?;
    ticks
        .get(..TICKS as usize)
        .context("the trace ends too early")?
        .iter()
        .map(|tick| {
            let mut path = tick.whole()?.path.iter();
            let before = path.position(|address| stores.contains(address));
            let before = before.context("a tick puts no word out")?;
            Ok(u32::try_from(before)? + 1)
        })
        .collect()
}

/// Homes the axes, puts the load on them, and lets them go round once.
fn drive(mut fixture: Fixture, tracer: &mut Tracer) -> Result<()> {
    homed(&mut fixture)?;
    load::select_telemetry(&mut fixture)?;
    fixture.reply(Body::Capture(CaptureRequest::Disarm))?;
    fixture.reply(Body::Capture(CaptureRequest::Arm {
        channels: load::busy_channels().collect(),
        decimation: 1,
        pre_trigger_percent: BEFORE_PERCENT,
        trigger: Trigger::Fault,
    }))?;
    fixture.done(Body::Run)?;
    fixture.run_until(LONGEST, "full speed", |fixture| {
        fixture.plant().axes()[0].velocity_mm_s() > 0.97 * SPEED_MM_S
    })?;
    fixture.inject(Box::new(|input, _, _| input.request = Some(Command::Run)));
    let from = fixture.tick() + SETTLING;
    let before = fixture.sent();
    while fixture.tick() < from + TICKS + 1 {
        if fixture.tick() == from {
            tracer.trace()?;
        }
        load::flood(&mut fixture)?;
        fixture.run(1)?;
    }
    load::ensure_flooded(&fixture, before, TICKS)?;
    ensure!(
        fixture.outputs(from).is_some_and(|outputs| outputs.enabled),
        "the outputs went off"
    );
    fixture.end().map(drop)
}

/// The instructions that put words out, by their addresses.
fn stores(image: &Image, root: u32) -> Result<BTreeSet<u32>> {
    let listing = Listing::of(image)?;
    let interrupt = listing.at(root).context("the interrupt is in the image")?;
    let attribution = Attribution::of(image)?;
    let mut stores = BTreeSet::new();
    for instruction in &interrupt.instructions {
        let functions = attribution.functions(instruction.address)?;
        let puts_out = functions.iter().any(|name| name == OUTPUT);
        if puts_out && functions[0].starts_with(STORE) && instruction.mnemonic.starts_with("str") {
            stores.insert(instruction.address);
        }
    }
    ensure!(
        !stores.is_empty(),
        "no instruction of {OUTPUT} puts a word out"
    );
    Ok(stores)
}
