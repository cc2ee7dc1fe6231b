//! A recording of ten million rows, a quarter of an hour at 10 kHz: time and memory of its identification.
//!
//! Ignored by default, because the file takes 0.7 GB of disk: `cargo test -p quadrant-cli --test suite record_large -- --ignored
//! --nocapture`.
use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use quadrant_sim::plant::StageParameters;
use quadrant_tune::identify::excitation::{Excitation, Waveform};
use quadrant_tune::record::{RecordError, Recording};
use quadrant_tune::test_axis::{Drive, Experiment, SimulatedTestAxis, TestAxis};

const ROWS: usize = 10_000_000;
/// Rows of a stretch that repeats in the file.
const STRETCH: usize = 1_000_000;
/// Sampling rate of the file, Hz.
const RATE_HZ: f64 = 1e4;

/// An axis shaken in open loop.
fn shaken() -> Recording {
    let mut test_axis = SimulatedTestAxis::new(0, StageParameters::real().axes[0].clone(), 1);
    let excitation = Excitation {
        waveform: Waveform::Random,
        rms_v: 0.3,
        band_hz: (4.0, 400.0),
        rise_hz: 0.0,
        period_s: 0.5,
        seed: 1,
    };
    let periods = STRETCH / excitation.period(RATE_HZ);
    test_axis
        .perform(
            &Experiment {
                name: "a long recording".to_owned(),
                drive: Drive::OpenLoop,
                injection_v: excitation.samples(RATE_HZ, periods),
                decimation: 1,
                time_limit_s: 1e3,
            },
            &mut |_| {},
        )
        .unwrap()
}

fn write_rows(path: &Path, recording: &Recording, rows: usize) {
    let mut file = BufWriter::new(fs::File::create(path).unwrap());
    writeln!(file, "t_s,reference_mm,position_mm,voltage_v,injection_v").unwrap();
    for row in 0..rows {
        let index = row % recording.len();
        writeln!(
            file,
            "{},{},{},{},{}",
            row as f64 / RATE_HZ,
            recording.reference_mm[index],
            recording.position_mm[index],
            recording.voltage_v[index],
            recording.injection_v[index]
        )
        .unwrap();
    }
    file.flush().unwrap();
}

/// Waits for the process; the largest memory that it had in use, bytes.
fn watch(child: &mut Child) -> u64 {
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let kib = text
            .lines()
            .find_map(|line| line.strip_prefix("VmHWM:"))
            .and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok());
        peak = peak.max(1024 * kib.unwrap_or(0));
        std::thread::sleep(Duration::from_millis(20));
    }
    peak
}

#[test]
#[ignore = "takes 0.7 GB of disk"]
fn ten_million_rows_are_identified_in_bounded_time_and_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("big.csv");
    write_rows(&path, &shaken(), ROWS);
    let begin = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_quadrant"))
        .args(["identify", "frf", "--record", "big.csv"])
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let peak = watch(&mut child);
    let seconds = begin.elapsed().as_secs_f64();
    let gib = peak as f64 / f64::from(1 << 30);
    println!(
        "{} MB of CSV, {ROWS} rows: {seconds:.1} s, at most {gib:.2} GiB",
        fs::metadata(&path).unwrap().len() / 1_000_000
    );
    assert!(child.wait().unwrap().success());
    assert!(gib < 2.0, "{gib}");
    assert!(seconds < 120.0, "{seconds}");
    let response = fs::read_to_string(folder.path().join("quadrant-out/frf.csv")).unwrap();
    assert!(response.lines().count() > 190);
}

#[test]
fn reading_reports_its_progress() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.csv");
    let recording = shaken().slice(0..200_000);
    write_rows(&path, &recording, recording.len());
    let mut shares: Vec<f64> = Vec::new();
    let read = Recording::read_csv_with(&path, &mut |share| shares.push(share));
    let read: Result<Recording, RecordError> = read;
    assert_eq!(read.unwrap().len(), 200_000);
    assert!(shares.len() >= 3 && shares.is_sorted(), "{shares:?}");
    assert!(
        shares[0] < 0.01 && (0.5..=1.0).contains(&shares[shares.len() - 1]),
        "{shares:?}"
    );
}
