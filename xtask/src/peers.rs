//! The host simulation beside the same in C++, Numba and NumPy: one job, one run, one table.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use crate::setup;
use xtask::command;

/// Folder of the programs beside ours.
const SOURCES: &str = "host-sim/benches/peers";
/// Folder of what they are built into, and of the job.
const FOLDER: &str = "target/peers";
/// Packages of the Python programs.
const PYTHON_PACKAGES: [&str; 2] = ["numba==0.68.1", "numpy==2.4.6"];
/// Options of g++: no fused multiply-add, which would put out other counts.
const CPP_OPTIONS: [&str; 3] = ["-std=c++20", "-O3", "-ffp-contract=off"];
/// Control period in real time, ns.
const PERIOD_NS: f64 = 100_000.0;
/// Largest difference of a position from ours, mm.
const BOUND_MM: f64 = 1e-9;

/// Name of the law's program.
const OURS: &str = "Quadrant";
/// Name of the program of the whole tick.
const WHOLE: &str = "Quadrant, the whole tick";
/// Name of the C++ program.
const CPP: &str = "C++ (g++ -O3)";
/// Rounds, of which the shortest time of each program counts.
const ROUNDS: usize = 3;

/// Outcome of a program.
struct Outcome {
    tick_ns: f64,
    /// Digest of the encoder counts and positions, mm, after the first ticks, and after all unless the program stops there.
    parts: Vec<(u32, [f64; 3])>,
}

/// Builds and runs all of them, and prints the table.
pub(crate) fn run() -> Result<()> {
    let folder = command::root().join(FOLDER);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let python = python(&folder)?;
    let simulate = cpp(&folder)?;
    let job = folder.join("job.bin");
    let script = command::root().join(SOURCES).join("simulate.py");
    let ours = || {
        let mut cargo = command::command("cargo");
        let cargo = cargo.args(["bench", "--quiet", "--package", "quadrant-sim"]);
        command::output(
            cargo
                .args(["--bench", "peers"])
                .env("QUADRANT_PEERS", &folder),
        )
    };
    let peer = |name: &str| match name {
        CPP => command::output(command::command(&simulate).arg(&job)),
        _ => {
            let kind = name.to_lowercase();
            command::output(command::command(&python).arg(&script).arg(kind).arg(&job))
        }
    };
    // In turns: a machine that is busy for a while is so for all.
    let mut rows = [OURS, CPP, "Numba", "NumPy", WHOLE].map(|name| (name, f64::INFINITY));
    for _ in 0..ROUNDS {
        let printed = ours()?;
        let mut lines = printed.lines();
        let ours = Outcome::parse(lines.next().unwrap_or_default())?;
        let whole_ns: f64 = lines.next().unwrap_or_default().trim().parse()?;
        for (name, best_ns) in &mut rows {
            let tick_ns = match *name {
                OURS => ours.tick_ns,
                WHOLE => whole_ns,
                _ => {
                    let outcome = Outcome::parse(&peer(name)?)?;
                    ours.check(name, &outcome)?;
                    outcome.tick_ns
                }
            };
            *best_ns = best_ns.min(tick_ns);
        }
    }
    println!("| | ns a tick | x real time | time over ours |");
    println!("|---|--:|--:|--:|");
    for (name, tick_ns) in rows {
        row(name, tick_ns, rows[0].1);
    }
    println!();
    println!(
        "All encoder counts are the same, and the positions at the end within {BOUND_MM:e} mm."
    );
    Ok(())
}

/// Prints a row of the table.
fn row(name: &str, tick_ns: f64, ours_ns: f64) {
    let (real_time, ratio) = (PERIOD_NS / tick_ns, tick_ns / ours_ns);
    if real_time >= 10.0 {
        println!("| {name} | {tick_ns:.0} | {real_time:.0} | {ratio:.2} |");
    } else {
        println!("| {name} | {tick_ns:.0} | {real_time:.2} | {ratio:.0} |");
    }
}

impl Outcome {
    /// Reads a line `ns (digest x y z)...`.
    fn parse(line: &str) -> Result<Self> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let Some((tick_ns, parts)) = words.split_first() else {
            bail!("nothing was printed");
        };
        let part = |words: &[&str]| -> Result<_> {
            let [digest, x, y, z] = words else {
                bail!("`{line}` is cut off");
            };
            Ok((digest.parse()?, [x.parse()?, y.parse()?, z.parse()?]))
        };
        Ok(Self {
            tick_ns: tick_ns.parse()?,
            parts: parts.chunks(4).map(part).collect::<Result<_>>()?,
        })
    }

    /// Fails if a program computed something else than ours.
    fn check(&self, name: &str, peer: &Self) -> Result<()> {
        ensure!(!peer.parts.is_empty(), "{name} ran no ticks");
        for ((ours, positions), (theirs, other)) in self.parts.iter().zip(&peer.parts) {
            ensure!(ours == theirs, "{name} has other encoder counts");
            for (ours, theirs) in positions.iter().zip(other) {
                let apart = (ours - theirs).abs();
                ensure!(apart <= BOUND_MM, "{name} is {apart:e} mm away");
            }
        }
        Ok(())
    }
}

/// Compiles the program in C++; returns its path.
fn cpp(folder: &Path) -> Result<std::path::PathBuf> {
    if !command::exists("g++") {
        setup::install(&["g++"])?;
    }
    let program = folder.join("simulate");
    command::run_quietly(
        command::command("g++")
            .args(CPP_OPTIONS)
            .arg(Path::new(SOURCES).join("simulate.cpp"))
            .arg("-o")
            .arg(&program),
    )?;
    Ok(program)
}

/// Makes an environment with Numba and NumPy; returns its Python.
fn python(folder: &Path) -> Result<std::path::PathBuf> {
    let environment = folder.join("python");
    let python = environment.join("bin/python");
    if !python.exists() {
        command::run(
            command::command("python3")
                .args(["-m", "venv"])
                .arg(&environment),
        )?;
    }
    command::run_quietly(
        command::command(&python)
            .args(["-m", "pip", "install", "--quiet"])
            .args(PYTHON_PACKAGES),
    )?;
    Ok(python)
}
