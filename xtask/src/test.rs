//! `cargo xtask test`: every check there is, one after the other.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;

use crate::image::{self, Board, Scalar, Target};
use crate::toolchain::{Choice, Toolchain};
use crate::{
    board_smoke, combinations, command, count, emulate, faults, layout, prove, setup, story, twin,
};

/// Ticks of the counting run.
const COUNTED_TICKS: u32 = 250;
/// Ticks of the counting run of each law and each feedforward.
const TICKS_EACH: u32 = 60;
/// Seconds of firmware time of the emulated runs.
const EMULATED_SECONDS: f64 = 10.0;
/// Settings that a commissioning left, and seconds that the firmware runs on them.
const COMMISSIONED: &str = "host-sim/data/identified-stage.toml";
const COMMISSIONED_SECONDS: f64 = 2.0;

/// What was checked, and how it went.
#[derive(Default)]
struct Report {
    steps: Vec<(String, f64, Result<()>)>,
}

impl Report {
    /// Announces a step, takes it, and keeps how it went.
    fn step(&mut self, name: impl Into<String>, step: impl FnOnce() -> Result<()>) {
        let name = name.into();
        println!("\n== {name}");
        let started = Instant::now();
        let result = step();
        let seconds = started.elapsed().as_secs_f64();
        match &result {
            Ok(()) => println!("== {name}: passed in {seconds:.1} s"),
            Err(error) => println!("== {name}: FAILED in {seconds:.1} s: {error:#}"),
        }
        self.steps.push((name, seconds, result));
    }

    /// Prints the summary, whose last line counts, and returns whether all went well.
    fn finish(self) -> bool {
        println!();
        for (name, seconds, result) in &self.steps {
            let verdict = if result.is_ok() { "passed" } else { "FAILED" };
            println!("{verdict} {seconds:>7.1} s  {name}");
        }
        let failed = self
            .steps
            .iter()
            .filter(|(_, _, result)| result.is_err())
            .count();
        println!("{} passed, {failed} failed", self.steps.len() - failed);
        failed == 0
    }
}

/// Sets up and checks everything, and returns whether all went well.
pub(crate) fn run(choice: Choice) -> Result<bool> {
    let mut report = Report::default();
    // Without its tools nothing else can be expected to work.
    let started = Instant::now();
    println!("== setup");
    let toolchain = setup::run(choice)?;
    report
        .steps
        .push(("setup".into(), started.elapsed().as_secs_f64(), Ok(())));

    host(&mut report);
    firmware(&mut report, toolchain);
    emulated(&mut report, toolchain);
    Ok(report.finish())
}

/// What runs on the host alone.
fn host(report: &mut Report) {
    let cargo = |arguments: &[&str]| command::run(command::command("cargo").args(arguments));
    report.step("format", || cargo(&["fmt", "--all", "--check"]));
    report.step("clippy", || {
        cargo(&[
            "clippy",
            "--workspace",
            "--all-targets",
            "--",
            "--deny",
            "warnings",
        ])
    });
    report.step("host tests", || {
        let mut test = command::command("cargo");
        // Setup has installed the browser: the tests that open pages in it must not skip.
        test.args(["test", "--workspace"])
            .env("QUADRANT_BROWSER_TESTS", "required");
        command::run(&mut test)
    });
    report.step("documentation", || {
        let mut doc = command::command("cargo");
        doc.args([
            "doc",
            "--workspace",
            "--no-deps",
            "--document-private-items",
        ]);
        command::run(doc.env("RUSTDOCFLAGS", "--deny warnings"))
    });
}

/// What is built for a microcontroller.
fn firmware(report: &mut Report, toolchain: Toolchain) {
    for target in Target::ALL {
        report.step(format!("firmware clippy, {target}"), || {
            let mut clippy = toolchain.cargo("clippy");
            // The most talkative level, so that every line of the log is compiled.
            clippy
                .args(target.arguments())
                .args(["--", "--deny", "warnings"])
                .env("DEFMT_LOG", "trace");
            command::run(&mut clippy)
        });
    }
    report.step("firmware image, fallback outputs, log at trace", || {
        image::link_fallback(toolchain)
    });
    for target in Target::ALL {
        report.step(format!("firmware image, {target}"), || {
            layout::check(&image::build(toolchain, target)?, false)
        });
        report.step(format!("no panic in the control tick, {target}"), || {
            prove::run(toolchain, target)
        });
    }
}

/// What is emulated.
fn emulated(report: &mut Report, toolchain: Toolchain) {
    report.step(
        "the reference board's image starts, ticks, and meets the end of its stack",
        || board_smoke::run(toolchain),
    );
    report.step("a machine's story, through the console", || {
        story::run(toolchain, false)
    });
    for scalar in [Scalar::F32, Scalar::Fixed] {
        let target = Target {
            board: Board::Mps2,
            scalar,
        };
        report.step(format!("emulation in lockstep, {target}"), || {
            emulate::run(toolchain, scalar, twin::job(), EMULATED_SECONDS, false)
        });
        report.step(
            format!("emulation on commissioned settings, {target}"),
            || {
                let job = twin::job_with(Path::new(COMMISSIONED))?;
                emulate::run(toolchain, scalar, job, COMMISSIONED_SECONDS, false)
            },
        );
        report.step(format!("emulation paced by the timer, {target}"), || {
            emulate::run(toolchain, scalar, twin::job(), EMULATED_SECONDS, true)
        });
        report.step(format!("every fault provoked, {target}"), || {
            faults::run(toolchain, scalar, None, false)
        });
        report.step(format!("instructions per tick, {target}"), || {
            count::run(toolchain, scalar, COUNTED_TICKS, false)
        });
        report.step(format!("every law and feedforward, {target}"), || {
            combinations::lockstep(toolchain, scalar)
        });
        report.step(format!("instructions of each, {target}"), || {
            combinations::count(toolchain, scalar, TICKS_EACH, false)
        });
    }
    report.step("control under overload, mps2 f32", || {
        faults::saturation::run(toolchain, Scalar::F32)
    });
}
