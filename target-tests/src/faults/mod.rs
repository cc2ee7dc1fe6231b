//! `cargo xtask faults`: every fault injected from outside in the emulated firmware, with the reference model in this process beside
//! it, and what was found compared with the committed table.

pub(crate) mod approach;
mod at_start;
pub(crate) mod case;
mod finding;
pub(crate) mod fixture;
mod paced;
mod serial_ring;
mod streams;

use anyhow::{Context, Result, bail, ensure};
use quadrant_law::safety::FaultCode;
use serde::{Deserialize, Serialize};

use self::finding::Finding;
use self::fixture::Fixture;
use xtask::golden::Golden;
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::toolchain::Toolchain;

/// Findings, in order of the faults' numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Table {
    #[serde(default)]
    finding: Vec<Finding>,
}

/// The committed tables, by number type.
const GOLDEN: Golden = Golden {
    path: "target-tests/golden/faults.toml",
    head: "Written by `cargo xtask faults --overwrite-expected`; `cargo xtask faults` compares what it finds with this.",
};

/// Injects every fault, prints the table, and compares it with the committed one.
pub(crate) fn run(
    toolchain: Toolchain,
    scalar: Scalar,
    only: Option<&str>,
    overwrite: bool,
) -> Result<()> {
    let board = Board::Mps2;
    let image = image::build(toolchain, Target::new(board, scalar))?;
    let codes: Vec<FaultCode> = match only {
        Some(name) => FaultCode::ALL
            .into_iter()
            .filter(|code| code.name() == name)
            .collect(),
        None => FaultCode::ALL.to_vec(),
    };
    ensure!(
        !codes.is_empty(),
        "there is no fault `{}`",
        only.unwrap_or("")
    );
    println!(
        "| no. | fault | injected by | found on | reaction | ticks | outputs in that tick | ticks until off | trace |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut table = Table::default();
    let mut compared = (0, 0);
    for code in codes {
        // The ramp of a stop ends within its bound by itself, and the emulated board counts no pulses: only tests on the host reach
        // these.
        if matches!(
            code,
            FaultCode::StopOverrun | FaultCode::PulseOverspeed | FaultCode::PulseJump
        ) {
            continue;
        }
        let findings =
            inject(&image, code).with_context(|| format!("{} was injected", code.name()))?;
        // A fault that nothing injects must not look like one that was found.
        ensure!(!findings.is_empty(), "{} is not injected", code.name());
        for finding in findings {
            println!("{}", finding.row(code));
            compared.0 += finding.compared.0;
            compared.1 += finding.compared.1;
            table.finding.push(finding);
        }
    }
    println!(
        "{} fault injections, all found; {} converter words and {} bytes of the link compared with the reference model's, 0 differ",
        table.finding.len(),
        compared.0,
        compared.1
    );
    if only.is_some() {
        return Ok(());
    }
    at_start::refused_job(&image).context("a job with settings that are refused")?;
    let key = image.target.scalar_name();
    if overwrite {
        // Found ticks and words depend on no compiler.
        GOLDEN.store(None, [(key, table)])
    } else {
        compare(&key, &table)
    }
}

/// All ways to inject a fault.
fn inject(image: &Image, code: FaultCode) -> Result<Vec<Finding>> {
    if let Some(case) = case::of(code) {
        let mut configuration = case::configuration();
        (case.adjust)(&mut configuration);
        let mut fixture = Fixture::start(image, configuration)?;
        let finding = finding::inject(&mut fixture, code, &case);
        let log = fixture.end()?;
        let finding = finding.with_context(|| format!("the log:\n{}", log.join("\n")))?;
        finding::log_contains(
            &log,
            &format!("fault {} on {} at tick", code.number(), finding.axis),
        )?;
        return Ok(vec![finding]);
    }
    Ok(match code {
        FaultCode::DeadlineMissed => paced::deadlines_missed(image)?,
        FaultCode::WatchdogReset => {
            let (finding, periods) = paced::watchdog(image)?;
            println!(
                "(the watchdog reset the processor {periods:.1} control periods after it hung)"
            );
            vec![finding]
        }
        FaultCode::Panic | FaultCode::HardFault => at_start::resets(image, code)?,
        FaultCode::SettingsInvalid => vec![at_start::refused_settings(image)?],
        _ => Vec::new(),
    })
}

fn compare(key: &str, table: &Table) -> Result<()> {
    let Some(expected) = GOLDEN.read::<Table>()?.tables.remove(key) else {
        bail!(
            "no table is committed for {key}: `cargo xtask faults --overwrite-expected` makes one"
        );
    };
    ensure!(
        expected.finding.len() == table.finding.len(),
        "{} fault injections instead of {}; if that is intended, `cargo xtask faults --overwrite-expected` accepts it",
        table.finding.len(),
        expected.finding.len()
    );
    for (found, expected) in table.finding.iter().zip(&expected.finding) {
        ensure!(
            found == expected,
            "{found:?}\ninstead of\n{expected:?}\nif that is intended, `cargo xtask faults --overwrite-expected` accepts it"
        );
    }
    Ok(())
}
