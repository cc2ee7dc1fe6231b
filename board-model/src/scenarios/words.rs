//! Every word on the converter's wires beside the reference model's.
//!
//! The reference model is the law in this process, on the counts that the chip's program has read from its timers, tick by tick from
//! the first one on. The ticks in which the orders reach the law are not on any wire. That of `enable` shows at the enable line, that of
//! `run` is the one with which the first words agree; all others then must.

use anyhow::{Result, anyhow, ensure};
use quadrant_law::command::Command;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::reference::MotionSettings;
use quadrant_law::stage::{Inputs, Plan, Stage, StageState};
use quadrant_link::message::{Body, Harmonic, Motion, Plan as LinkPlan};
use quadrant_sim::benchmark_job::circle_and_sine;
use quadrant_sim::law_machine::TickInput;

use crate::ad5754r;
use crate::bench::{Subject, TickRecord};
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::{commissioned, enable, started};

/// Motion compared, s.
const MOTION_S: f64 = 10.0;
/// Lead-in of the motions, s: that of `cargo xtask emulate`.
const LEAD_S: f64 = 0.05;
/// Ticks within which an order reaches the law.
const ORDER_TICKS: usize = 100;
/// Ticks from the order on by which its tick is found.
const SEARCH_TICKS: usize = 600;
/// Mean instructions of a tick of homed axes in motion, by `cargo xtask count` (target-tests/golden/instructions.toml).
const COUNTED: f64 = 2762.4;

/// The law, and what it is to do.
struct Reference {
    stage: Stage<f32, FIRMWARE_ELEMENTS>,
    plan: Plan<f32>,
}

impl Reference {
    /// Number of ticks whose words or enable line differ from what was recorded, the first of them, and words that are not zero.
    fn compare(
        &self,
        records: &[TickRecord],
        enable: usize,
        run: usize,
    ) -> (usize, Option<usize>, usize) {
        let mut state = StageState::default();
        let (mut differ, mut first, mut moving) = (0, None, 0);
        for (tick, record) in records.iter().enumerate() {
            let command = match tick {
                _ if tick == enable => Some(Command::Enable),
                _ if tick == run => Some(Command::Run),
                _ => None,
            };
            let inputs = Inputs {
                command,
                ..TickInput::of_counts(record.counts, None).inputs()
            };
            let outputs = self.stage.tick(&self.plan, &mut state, &inputs);
            let codes: Vec<i16> = outputs.codes.iter().map(|code| code.0).collect();
            moving += codes.iter().filter(|code| **code != 0).count();
            if codes != record.codes || outputs.enabled != record.enabled {
                differ += 1;
                first.get_or_insert(tick);
            }
        }
        (differ, first, moving)
    }
}

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let job = circle_and_sine(LEAD_S);
    let reference = Reference {
        stage: job.stage.build().map_err(|error| anyhow!("{error}"))?,
        plan: job
            .plan
            .build(&job.stage)
            .map_err(|error| anyhow!("{error}"))?,
    };
    let flash = commissioned(image)?;
    let mut bench = started(image, Some(&flash))?;
    let mut client = Client::open(&mut bench)?;
    bench.with(|world, _, _| {
        world.plant = true;
        // Index pulses are the scenario `encoders`'.
        world.index = false;
    });
    enable(&mut bench, &mut client)?;
    client.ask(&mut bench, Body::SetPlan(plan_of(&job.plan.motions)))?;
    let asked = bench.with(|world, _, _| world.record.len());
    client.ask(&mut bench, Body::Run)?;
    bench.ticks();
    let frames = ad5754r::lock(&bench.chip).frames;
    for _ in 0..(MOTION_S / 0.2) as usize {
        bench.run_for(0.2);
        ensure!(client.status(&mut bench)?.running, "the plan has ended");
    }
    let ticks = bench.ticks();
    let frames = ad5754r::lock(&bench.chip).frames - frames;
    let records = bench.with(|world, _, _| std::mem::take(&mut world.record));

    let enabled = records
        .iter()
        .position(|record| record.enabled)
        .unwrap_or(0);
    let window = &records[..records.len().min(asked + SEARCH_TICKS)];
    let starts = |&run: &usize| reference.compare(window, enabled, run).0 == 0;
    let run = (asked..asked + ORDER_TICKS).find(starts);
    report.row(
        "tick with which the first words of `run` agree",
        format!("within {ORDER_TICKS} of its request"),
        run.map_or("none".into(), |run| format!("{} after it", run - asked)),
        run.is_some(),
    );
    let run = run.unwrap_or(asked);
    let (differ, first, moving) = reference.compare(&records, enabled, run);
    let first = first.map_or(String::new(), |tick| {
        format!(
            ", the first {} ticks after `run`: {:?}",
            tick as i64 - run as i64,
            records[tick]
        )
    });
    let words = 3 * records.len();
    report.row(
        &format!(
            "words on the wires in {} ticks that differ from the reference model's",
            records.len()
        ),
        0,
        format!("{differ} of {words}{first}"),
        differ == 0,
    );
    let (later, ..) = reference.compare(&records, enabled, run + 1);
    report.row(
        "ticks that differ if `run` comes one tick later",
        "more than 0",
        later,
        later > 0,
    );
    report.row(
        "words that are not zero",
        format!("more than {}", words / 2),
        moving,
        moving > words / 2,
    );
    report.equal(
        "frames of 24 bits a tick",
        "5.000".into(),
        format!("{:.3}", frames as f64 / ticks.count as f64),
    );
    let mean = ticks.total_instructions as f64 / ticks.count as f64;
    let measured = format!(
        "{mean:.1} mean, {} to {}",
        ticks.instructions.0, ticks.instructions.1
    );
    report.row(
        "instructions a tick, from its acknowledge to its last look at the timer",
        format!("{COUNTED} ±20 % (cargo xtask count)"),
        measured,
        (mean / COUNTED - 1.0).abs() < 0.2,
    );
    report.equal(
        "time from tick to tick, ns",
        "100000 to 100000".into(),
        format!("{} to {}", ticks.period_ns.0, ticks.period_ns.1),
    );
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

/// The plan as the link has it.
fn plan_of(motions: &[MotionSettings]) -> LinkPlan {
    let mut plan = LinkPlan::default();
    for (motion, settings) in plan.motions.iter_mut().zip(motions) {
        if let MotionSettings::Harmonic(sine) = settings {
            *motion = Motion::Harmonic(Harmonic {
                amplitude_mm: sine.amplitude_mm,
                frequency_hz: sine.frequency_hz,
                phase_rad: sine.phase_rad,
                cycles: sine.cycles,
                lead_s: sine.lead_s,
            });
        }
    }
    plan
}
