//! `cargo xtask test`: every check there is.
//!
//! The firmware and its images are checked by a process of its own beside the host's tests: linking an image keeps one
//! core busy. What is emulated comes last and alone, as lockstep needs both.

use std::fs::{self, File};
use std::process::{Child, Command};
use std::time::Instant;

use anyhow::{Context, Result, bail};

use xtask::image::{self, LAW_TRIPLES, LIBRARY_TRIPLES, TRIPLES, Target};
use xtask::toolchain::{self, Choice, Toolchain};
use xtask::{command, prove};

use crate::{book, documented, figures, layout, lines, msrv, python, setup, transcript, web};

/// Settings that a commissioning left, and seconds that the firmware runs on them.
const COMMISSIONED: &str = "host-sim/data/identified-stage.toml";
/// Output of the checks beside the host's tests.
const FIRMWARE_LOG: &str = "target/xtask/firmware.log";

/// Expected duration: 40 min were measured on a clean clone.
const DURATION: &str = "duration: about 40 min on two cores from a fresh clone";

/// Steps of the test, and their results.
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
            if let Err(error) = result {
                println!("       {error:#}");
            }
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
    let started = Instant::now();
    announce(choice)?;
    let mut report = Report::default();
    // Without its tools nothing else can be expected to work.
    println!("\n== setup");
    let toolchain = setup::run(choice, false)?;
    report
        .steps
        .push(("setup".into(), started.elapsed().as_secs_f64(), Ok(())));

    let firmware = Beside::start(toolchain)?;
    report.step("the figures in the pages", || figures::run(false));
    host(&mut report)?;
    firmware.finish(&mut report)?;
    report.step("the book", book::build);
    report.step("the commands that the documentation shows", || {
        documented::run(&documented::Options::default())
    });
    report.step("every converter word in a browser", || {
        web::check(&web::build(toolchain)?)
    });
    report.step("the Python package", python::run);
    report.step("LinuxCNC's loops and ours", || {
        command::run(command::command("cargo").args(["xtask", "linuxcnc", "--check"]))
    });
    emulated(&mut report, toolchain)?;
    println!("\n{:.1} min", started.elapsed().as_secs_f64() / 60.0);
    Ok(report.finish())
}

/// Says which compiler builds what, what is going to be installed, and how long it takes.
fn announce(choice: Choice) -> Result<()> {
    let host = toolchain::host_compiler()?;
    println!("host:     Rust {host}, {}", lints(&host));
    let toolchain = match choice {
        Choice::Auto => Toolchain::remembered(),
        Choice::Rustup => Some(Toolchain::Rustup),
        Choice::Debian => Some(Toolchain::Debian),
    };
    let Some(toolchain) = toolchain else {
        println!(
            "firmware: the same if rustup can add {}, else Debian's",
            TRIPLES.join(", ")
        );
        println!("{DURATION}");
        return Ok(());
    };
    match toolchain.compiler() {
        Ok(firmware) => println!(
            "firmware: Rust {firmware} ({}), {}; counts and sizes are held where the same compiler recorded them",
            toolchain.name(),
            lints(&firmware)
        ),
        Err(_) => println!("firmware: Debian's compiler, which is not installed"),
    }
    let missing = setup::missing(toolchain);
    if !missing.is_empty() {
        println!("to be installed: {}", missing.join(", "));
    }
    println!("{DURATION}");
    Ok(())
}

/// Returns the treatment of a compiler's warnings.
fn lints(compiler: &str) -> &'static str {
    if toolchain::denies_warnings(compiler) {
        "warnings are errors"
    } else {
        "warnings are printed"
    }
}

/// The flags that deny warnings, for a compiler whose warnings are known.
fn deny(compiler: &str) -> &'static [&'static str] {
    if toolchain::denies_warnings(compiler) {
        &["--deny", "warnings"]
    } else {
        &[]
    }
}

/// Checks that run on the host alone.
fn host(report: &mut Report) -> Result<()> {
    let deny = deny(&toolchain::host_compiler()?);
    let cargo = || command::command("cargo");
    report.step("format", || {
        command::run(cargo().args(["fmt", "--all", "--check"]))
    });
    report.step("lines by package", || lines::run(false));
    report.step("oldest compilers", msrv::run);
    report.step("host tests", || {
        // Setup has installed the browser: the tests that open pages in it must not skip.
        command::run_tests(
            cargo()
                .args(["test", "--workspace", "--no-fail-fast"])
                .env("QUADRANT_BROWSER_TESTS", "required"),
        )
    });
    report.step("clippy", || {
        command::run(
            cargo()
                .args(["clippy", "--workspace", "--all-targets", "--"])
                .args(deny),
        )
    });
    report.step("documentation", || {
        command::run(
            cargo()
                .args(["doc", "--workspace", "--no-deps"])
                .arg("--document-private-items")
                .env("RUSTDOCFLAGS", deny.join(" ")),
        )
    });
    Ok(())
}

/// The checks of what is built for a microcontroller, in a process of their own.
struct Beside(Child);

impl Beside {
    fn start(toolchain: Toolchain) -> Result<Self> {
        let path = command::root().join(FIRMWARE_LOG);
        let folder = path.parent().context("the file has a folder")?;
        fs::create_dir_all(folder)?;
        let log = File::create(&path)?;
        let child = Command::new(std::env::current_exe()?)
            .current_dir(command::root())
            .args(["--toolchain", toolchain.name(), "test", "--firmware-only"])
            .stdout(log.try_clone()?)
            .stderr(log)
            .spawn()
            .context("cannot start a second xtask")?;
        println!(
            "\nbeside what follows: lints, images and proofs of the firmware, into {FIRMWARE_LOG}"
        );
        Ok(Self(child))
    }

    /// Waits, prints what it said, and adopts its steps.
    fn finish(mut self, report: &mut Report) -> Result<()> {
        let status = self.0.wait()?;
        let log = fs::read_to_string(command::root().join(FIRMWARE_LOG))?;
        println!("\n{log}");
        let before = report.steps.len();
        for line in log.lines() {
            report.steps.extend(summary_line(line));
        }
        let is_bad = report.steps[before..].iter().any(|step| step.2.is_err());
        if before == report.steps.len() || status.success() == is_bad {
            bail!("the firmware's checks ended with {status}");
        }
        Ok(())
    }
}

/// `passed    12.3 s  firmware image, mps2 f32`
fn summary_line(line: &str) -> Option<(String, f64, Result<()>)> {
    let (verdict, rest) = line.split_once(' ')?;
    let result = match verdict {
        "passed" => Ok(()),
        "FAILED" => Err(anyhow::anyhow!("see above")),
        _ => return None,
    };
    let (seconds, name) = rest.trim_start().split_once(" s  ")?;
    Some((name.to_owned(), seconds.parse().ok()?, result))
}

/// Checks what is built for a microcontroller, and returns whether all went well.
pub(crate) fn firmware_only(toolchain: Toolchain) -> Result<bool> {
    let mut report = Report::default();
    let deny = deny(&toolchain.compiler()?);
    for target in Target::ALL {
        report.step(format!("firmware image, {target}"), || {
            layout::check(&image::build(toolchain, target)?, false)
        });
        report.step(format!("no panic in the control tick, {target}"), || {
            prove::prove(&image::build(toolchain, target)?)
        });
    }
    report.step("firmware image, fallback outputs, log at trace", || {
        image::link_fallback(toolchain)
    });
    for target in Target::ALL {
        report.step(format!("firmware clippy, {target}"), || {
            let mut clippy = toolchain.cargo("clippy");
            // The most talkative level, so that every line of the log is compiled.
            clippy
                .args(target.arguments())
                .arg("--")
                .args(deny)
                .env("DEFMT_LOG", "trace");
            command::run(&mut clippy)
        });
    }
    for triple in [TRIPLES[0]].into_iter().chain(LIBRARY_TRIPLES) {
        report.step(format!("library for {triple}"), || {
            let mut check = toolchain.cargo("check");
            check.args(["--package", "quadrant", "--lib", "--profile", "firmware"]);
            command::run(check.args(["--target", triple]))
        });
    }
    for triple in [TRIPLES[0]]
        .into_iter()
        .chain(LIBRARY_TRIPLES)
        .chain(LAW_TRIPLES)
    {
        // Their one dependency is the law, without features: as another project has it.
        report.step(
            format!("the law in another firmware, also in C, for {triple}"),
            || {
                let mut check = toolchain.cargo("check");
                check.args([
                    "--package",
                    "quadrant-law-example",
                    "--package",
                    "quadrant-law-c",
                ]);
                check.args(["--profile", "firmware"]);
                command::run(check.args(["--target", triple]))
            },
        );
    }
    report.step("the page of the bench", || web::build(toolchain).map(drop));
    Ok(report.finish())
}

/// Checks that run in the emulator.
fn emulated(report: &mut Report, toolchain: Toolchain) -> Result<()> {
    // `cargo run`, or a build without `--tests`, would build the libraries once more: without the features that other packages
    // of the workspace, or their tests, ask for.
    report.step("the target's tests are built", || {
        command::run(command::command("cargo").args([
            "build",
            "--workspace",
            "--tests",
            "--bin",
            "target-tests",
        ]))
    });
    let chores = std::env::current_exe()?;
    let profiles = chores
        .ancestors()
        .nth(2)
        .context("xtask lies in a profile's folder")?;
    let program = profiles.join("debug/target-tests");
    let mut step = |name: &str, verb: &[&str]| {
        report.step(name, || {
            let mut test = command::command(&program);
            test.args(["--toolchain", toolchain.name()])
                .args(verb)
                .env(image::BUILT, "1");
            command::run(&mut test)
        });
    };
    step(
        "the reference board's image starts, ticks, and meets the end of its stack",
        &["board-smoke"],
    );
    for scalar in ["f32", "fixed"] {
        let of = |verb: &str| format!("{verb}, mps2 {scalar}");
        let s = ["--scalar", scalar];
        let verb = |words: &[&'static str]| [words, &s].concat();
        step(&of("lockstep"), &verb(&["emulate"]));
        step(
            &of("lockstep on commissioned settings"),
            &verb(&["emulate", "--seconds", "2", "--settings", COMMISSIONED]),
        );
        step(&of("paced by the timer"), &verb(&["emulate", "--paced"]));
        step(&of("every fault injected"), &verb(&["faults"]));
        step(&of("instructions per tick"), &verb(&["count"]));
        step(&of("cycles per tick, by calculation"), &verb(&["cycles"]));
        step(
            &of("every law and feedforward, and instructions of each"),
            &verb(&["combinations"]),
        );
    }
    step("control under overload, mps2 f32", &["saturation"]);
    step(
        "an axis is commissioned through the link, mps2 f32",
        &["commission"],
    );
    report.step("a session through the console, end to end", || {
        transcript::run(toolchain, false)
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_summary_is_read_back() {
        let (name, seconds, result) =
            summary_line("passed    12.3 s  firmware image, mps2 f32").unwrap();
        assert_eq!((name.as_str(), seconds), ("firmware image, mps2 f32", 12.3));
        assert!(result.is_ok());
        assert!(summary_line("FAILED     1.0 s  x").unwrap().2.is_err());
        assert!(summary_line("6 passed, 0 failed").is_none());
    }
}
