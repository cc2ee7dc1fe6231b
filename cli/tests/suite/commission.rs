//! From an unknown axis to settings that a replay runs on, by the commands alone.

use std::fmt::Write as _;
use std::path::Path;

use crate::command::{fail, succeed};
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_settings::AxisSettings;
use quadrant_sim::settings_file::SettingsFile;

/// A column of the verdict, law by law.
fn verdict(path: &Path, heading: &str) -> Vec<(String, f64)> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let place = reader
        .headers()
        .unwrap()
        .iter()
        .position(|found| found.starts_with(heading))
        .unwrap();
    reader
        .records()
        .map(|row| row.unwrap())
        .map(|row| (row[0].to_owned(), row[place].parse().unwrap()))
        .collect()
}

#[test]
fn a_commissioned_axis_beats_its_pid_and_its_settings_replay() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shown = succeed(at, &["commission", "--axis", "x", "--out", "x"]);
    assert!(shown.contains("Simulated, not measured"), "{shown}");

    let file = SettingsFile::read(&at.join("x/settings.toml")).unwrap();
    // Of the axis that was commissioned, and of no other.
    let commissioned = file.stage.axes.each_ref().map(|axis| axis.commissioned);
    assert_eq!(commissioned, [true, false, false]);
    assert!(file.stage.is_commissioned());
    let axis = &file.stage.axes[0];
    let chosen = match axis.feedforward.kind {
        FeedforwardKind::Combined => "N-PID + static + GMS",
        FeedforwardKind::SmoothedGms => "N-PID + smoothed GMS",
        other => panic!("{other:?}"),
    };
    let [origin] = &file.provenance[..] else {
        panic!("{:?}", file.provenance);
    };
    assert_eq!(origin.axis, "x");
    for record in &origin.records {
        assert!(at.join("x").join(record).exists(), "{record}");
    }

    let rms = verdict(&at.join("x/x/verdict.csv"), "RMS");
    let of = |name: &str| {
        let law = rms.iter().find(|(law, _)| law == name);
        law.unwrap_or_else(|| panic!("{name}: {rms:?}")).1
    };
    // Little: |S| stays below 2.5 at the N-PID's largest gain.
    assert!(of("N-PID") < 0.98 * of("PID"), "{rms:?}");
    assert!(of(chosen) < 0.1 * of("PID"), "{rms:?}");
    assert!(shown.contains(&format!("Chosen: {chosen}")), "{shown}");

    // Another axis into the same folder leaves the first as it is.
    succeed(at, &["commission", "--axis", "y", "--quick", "--out", "x"]);
    let both = SettingsFile::read(&at.join("x/settings.toml")).unwrap();
    assert_eq!(&both.stage.axes[0], axis);
    assert_eq!(both.provenance.len(), 2);
    assert!(at.join("x/y/commission.html").exists());

    let again = succeed(
        at,
        &[
            "commission",
            "--axis",
            "x",
            "--record",
            "x/x",
            "--into",
            "again.toml",
            "--out",
            "again",
        ],
    );
    assert!(
        !again.contains("Simulated") && !again.contains("Tracking error"),
        "{again}"
    );
    let saved = SettingsFile::read(&at.join("again.toml")).unwrap();
    let [found, known] = [&saved.stage.axes[0], axis];
    let close = |found: f64, known: f64, share: f64| {
        assert!(
            (found / known - 1.0).abs() < share,
            "{found} is not {known}"
        );
    };
    let kp = |of: &AxisSettings| of.feedback.pid.kp_v_per_mm;
    close(kp(found), kp(known), 0.01);
    let breakaway_v = |of: &AxisSettings| of.friction.sliding.positive.curve.breakaway_v;
    close(breakaway_v(found), breakaway_v(known), 1e-6);
    let stiffness = |of: &AxisSettings| -> f64 {
        let elements = of.friction.gms.elements.iter();
        elements.map(|element| element.stiffness_v_per_mm).sum()
    };
    close(stiffness(found), stiffness(known), 1e-3);
    assert!(!at.join("again/x/verdict.csv").exists());
    assert!(at.join("again/x/commission.html").exists());

    let mut reference = "t_s,reference_mm\n".to_owned();
    for index in 0..1500 {
        let time_s = 2e-3 * f64::from(index);
        writeln!(reference, "{time_s},{}", 5.0 * (2.0 * time_s).sin().powi(2)).unwrap();
    }
    std::fs::write(at.join("reference.csv"), reference).unwrap();
    let shown = succeed(
        at,
        &[
            "replay",
            "--reference",
            "reference.csv",
            "--axis",
            "x",
            "--settings",
            "x/settings.toml",
            "--out",
            "replay",
        ],
    );
    assert!(shown.contains("N-PID + static + GMS"), "{shown}");
    assert!(at.join("replay/replay.html").exists());
}

#[test]
fn a_travel_that_is_too_short_for_any_place_is_said_to_be() {
    let folder = tempfile::tempdir().unwrap();
    let line = "commission --axis x --machine simulated --travel 1";
    let words: Vec<&str> = line.split(' ').collect();
    let refused = fail(folder.path(), &words);
    assert!(refused.contains("at least 4 mm"), "{refused}");
}
