//! Settings in flash.

use anyhow::{Result, ensure};
use quadrant_link::message::{Body, SettingsRequest};
use quadrant_settings::StageSettings;

use crate::bench::{Bench, Subject};
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

pub(super) fn erase(image: &Subject, report: &mut Report) -> Result<()> {
    let mut bench = started(image, Some(&commissioned(image)?))?;
    let mut client = Client::open(&mut bench)?;
    trace_flash(&mut bench);
    let before = client.status(&mut bench)?;
    let mut erased = false;
    let most = stores(image);
    for number in 1..=most {
        if store_until_erasure(&mut bench, &mut client, &format!("set {number}"))?.is_some() {
            erased = true;
            break;
        }
    }
    report.equal(
        &format!("a sector is erased by one of {most} stores"),
        true,
        erased,
    );
    bench.with(|world, _, _| world.feeds.1 = 0);
    bench.spin(TURNED);
    let answered = bench.run_while(STORE_S, 0.001, |bench| client.take(bench).is_some());
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
    let mut bench = started(image, Some(&commissioned(image)?))?;
    let mut client = Client::open(&mut bench)?;
    trace_flash(&mut bench);
    let mut origin = String::from("board-run");
    let mut erased = None;
    let most = stores(image);
    for number in 1..=most {
        let next = format!("set {number}");
        let sector = store_until_erasure(&mut bench, &mut client, &next)?;
        if let Some(sector) = sector {
            erased = Some(sector);
            break;
        }
        origin = next;
    }
    let Some(sector) = erased else {
        report.row(
            "stores until a sector is erased",
            format!("at most {most}"),
            "none",
            false,
        );
        return Ok(());
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
    let begun = |bench: &mut Bench| {
        bench.with(move |world, _, _| {
            world
                .traced
                .iter()
                .find(|write| write.2 >> start & 1 != 0)
                .map(|write| write.2 >> number & 7)
        })
    };
    client.begin(
        bench,
        Body::Settings(SettingsRequest::Store(provenance(origin)?)),
    )?;
    let (mut sector, mut answer) = (None, false);
    bench.run_while(STORE_S, 0.001, |bench| {
        sector = begun(bench);
        answer = client.take(bench).is_some();
        answer || sector.is_some()
    });
    if sector.is_some() {
        bench.run_for(0.1);
        return Ok(sector);
    }
    ensure!(answer, "a store was not answered");
    Ok(None)
}
