//! Settings in flash.

use anyhow::{Result, bail, ensure};
use quadrant_law::control::feedback::LawKind;
use quadrant_link::message::{Body, SettingsRequest};
use quadrant_settings::StageSettings;

use crate::bench::{Bench, Subject, World};
use crate::link::{Client, provenance};
use crate::report::Report;
use crate::scenarios::{commissioned, resets, row_fault, row_started, runs, started};
use crate::stage::COUNT_MM;

/// Longest store, s.
const STORE_S: f64 = 5.0;

pub(super) fn reboot(image: &Subject, report: &mut Report) -> Result<()> {
    let flash = commissioned(image)?;
    let mut bench = started(image, Some(&flash))?;
    let mut client = Client::open(&mut bench)?;
    let (equal, all) = client.count_equal(&mut bench, &StageSettings::simulated())?;
    report.equal(
        "settings found after the supply was switched off and on",
        format!("{all} of {all}"),
        format!("{equal} of {all}"),
    );
    let mut changed = StageSettings::simulated();
    changed.axes[0].limits.max_velocity_mm_s = 123.5;
    client.load(&mut bench, &changed, &StageSettings::simulated())?;
    client.store(&mut bench, "a second set")?;
    client.ask(&mut bench, Body::Reboot)?;
    bench.run_for(0.1);
    report.equal("resets by `reboot`", "Core".into(), resets(&mut bench));
    ensure!(runs(&mut bench), "no control tick after the reboot");
    row_started(&mut bench, report, "started by software");
    client = Client::open(&mut bench)?;
    let (equal, all) = client.count_equal(&mut bench, &changed)?;
    report.equal(
        "settings found after the reboot",
        format!("{all} of {all}"),
        format!("{equal} of {all}"),
    );
    report.equal("origin", "a second set".into(), client.origin(&mut bench)?);
    row_fault(&mut bench, &mut client, report, "fault", "none")?;
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

/// Speeds at which hands turn the encoders, counts/s: counters of 16 bits pass their end every 0.3 s.
const TURNED: [f64; 3] = [150_000.0, -200_000.0, 180_000.0];

/// The slowest control rate, Hz: the models' time goes with the ticks.
const SLOW_HZ: f64 = 2500.0;

/// A set that is soon checked, for a control rate: without a plant there is no bound to search.
fn soon_checked(rate_hz: f64) -> StageSettings {
    let mut settings = StageSettings::simulated();
    settings.rate_hz = rate_hz;
    for axis in &mut settings.axes {
        axis.plant = None;
        axis.feedback.law = LawKind::Pid;
        axis.feedback.pid.derivative_filter_s = 1e-3;
    }
    settings
}

/// Contents of the settings' sectors whose next store erases one, and the origin of the last set, which is for a control rate. A sector
/// of 128 KiB takes some thirty stores, done at the slowest rate.
fn full(image: &Subject, rate_hz: f64) -> Result<(Vec<u8>, String)> {
    let slow = soon_checked(SLOW_HZ);
    let mut bench = started(image, None)?;
    let mut client = Client::open(&mut bench)?;
    client.load(&mut bench, &slow, &StageSettings::default())?;
    client.store(&mut bench, "set 0")?;
    let mut bench = started(image, Some(&bench.settings_flash()))?;
    let mut client = Client::open(&mut bench)?;
    // In force with the next start.
    client.load(&mut bench, &soon_checked(rate_hz), &slow)?;
    trace_flash(&mut bench);
    let most = stores(image);
    let mut origin = String::new();
    for number in 1..=most {
        let flash = bench.settings_flash();
        let next = format!("set {number}");
        if store_until_erasure(&mut bench, &mut client, &next)?.is_some() {
            return Ok((flash, origin));
        }
        origin = next;
    }
    bail!("no sector was erased by {most} stores")
}

pub(super) fn erase(image: &Subject, report: &mut Report) -> Result<()> {
    let (flash, _) = full(image, StageSettings::default().rate_hz)?;
    let mut bench = started(image, Some(&flash))?;
    let mut client = Client::open(&mut bench)?;
    trace_flash(&mut bench);
    let before = client.status(&mut bench)?;
    let erased = store_until_erasure(&mut bench, &mut client, "the next")?.is_some();
    report.equal("a sector is erased by a store", true, erased);
    bench.with(|world, _, _| world.feeds.1 = 0);
    bench.spin(TURNED);
    let answered = client.answer(&mut bench, STORE_S).is_some();
    bench.spin([0.0; 3]);
    bench.run_for(0.02);
    report.equal("the store is answered", true, answered);
    let (longest, resets) = bench.with(|world, _, _| (world.feeds.1, world.resets.len()));
    report.within(
        "longest time between two feeds of the watchdog",
        0.0,
        image.board.watchdog_s[0] * 1e3,
        longest as f64 * 1e-6,
        "ms",
    );
    report.equal("resets", 0, resets);
    let after = client.status(&mut bench)?;
    let shown = bench.with(|world, _, _| world.shown);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let moved = after.axes[axis].position_mm - before.axes[axis].position_mm;
        let turned = shown[axis] as f64 * COUNT_MM;
        report.row(
            &format!("{name}: position after {} counts", shown[axis]),
            format!("{turned:.4} mm"),
            format!("{moved:.4} mm"),
            (moved - turned).abs() < 1e-9,
        );
    }
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

/// A byte of the sector by the sector's size, its offset and what was there.
type Left = fn(usize, usize, u8) -> u8;

/// State of the sector that a cut erasure leaves.
const LEFT: [(&str, Left); 4] = [
    ("as it was", |_, _, old| old),
    ("erased in its lower half", |size, at, old| {
        if at < size / 2 { 0xFF } else { old }
    }),
    ("erased in its upper half", |size, at, old| {
        if at < size / 2 { old } else { 0xFF }
    }),
    ("erased in some of its bits", |_, at, old| {
        old | [0x5A, 0xC3, 0x3C][at % 3]
    }),
];

pub(super) fn power_cut(image: &Subject, report: &mut Report) -> Result<()> {
    let (flash, origin) = full(image, SLOW_HZ)?;
    let mut bench = started(image, Some(&flash))?;
    let mut client = Client::open(&mut bench)?;
    trace_flash(&mut bench);
    let Some(sector) = store_until_erasure(&mut bench, &mut client, "the next")? else {
        bail!("the store erases nothing");
    };
    let (.., lowest) = image.board.flash_control;
    report.row(
        "sector erased by a store",
        format!("{lowest} or {}", lowest + 1),
        sector,
        (lowest..=lowest + 1).contains(&sector),
    );
    let flash = bench.settings_flash();
    drop(bench);
    let size = image.board.settings.1 as usize;
    let first = (sector - lowest) as usize * size;
    for (how, left) in LEFT {
        let mut flash = flash.clone();
        for (at, byte) in flash[first..first + size].iter_mut().enumerate() {
            *byte = left(size, at, *byte);
        }
        let mut bench = started(image, Some(&flash))?;
        let mut client = Client::open(&mut bench)?;
        report.equal(
            &format!("cut, the sector {how}: origin of the settings in force"),
            origin.clone(),
            client.origin(&mut bench)?,
        );
        row_fault(
            &mut bench,
            &mut client,
            report,
            &format!("cut, the sector {how}: fault"),
            "none",
        )?;
        client.store(&mut bench, "afterwards")?;
        report.equal(
            &format!("cut, the sector {how}: the next store"),
            "afterwards".into(),
            client.origin(&mut bench)?,
        );
    }
    Ok(())
}

/// Stores by which a sector is full: a set takes more than 2 KiB.
fn stores(image: &Subject) -> u64 {
    image.board.settings.1 / 2048 - 1
}

/// Keeps what is written to the flash's control register.
fn trace_flash(bench: &mut Bench) {
    let (control, ..) = bench.wiring.flash_control;
    bench.with(move |world, _, _| world.trace = Some(control..control + 4));
}

/// Stores; returns the sector whose erasure has begun 100 ms before the end of the call, or none if the set is stored.
fn store_until_erasure(
    bench: &mut Bench,
    client: &mut Client,
    origin: &str,
) -> Result<Option<u64>> {
    bench.with(|world, _, _| world.traced.clear());
    let (_, start, number, _) = bench.wiring.flash_control;
    let begun = move |world: &World| {
        let mut writes = world.traced.iter();
        writes
            .find(|write| write.2 >> start & 1 != 0)
            .map(|write| write.2 >> number & 7)
    };
    client.begin(
        bench,
        Body::Settings(SettingsRequest::Store(provenance(origin)?)),
    )?;
    let end = bench.now() + (STORE_S * 1e9) as u64;
    while bench.now() < end {
        let left = (end - bench.now()) as f64 * 1e-9;
        bench.run_until_frame(left, 0.001, move |world| begun(world).is_some());
        if let Some(sector) = bench.with(move |world, _, _| begun(world)) {
            bench.run_for(0.1);
            return Ok(Some(sector));
        }
        if client.take(bench).is_some() {
            return Ok(None);
        }
    }
    bail!("a store was not answered")
}
