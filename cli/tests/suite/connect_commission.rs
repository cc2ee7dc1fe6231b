//! An axis of a connected machine, commissioned through the link alone, against the same axis without firmware and link.

use std::path::Path;

use quadrant_sim::settings_file::SettingsFile;
use quadrant_sim::stage_setup::StageSetup;
use serde_json::Value;

use crate::command::succeed;

/// RMS of the first three laws of the verdict, um: PID, N-PID, and that with the best feedforward.
fn verdict(path: &Path) -> Vec<f64> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let headings = reader.headers().unwrap();
    let place = headings
        .iter()
        .position(|heading| heading.starts_with("RMS"))
        .unwrap();
    reader
        .records()
        .map(|row| row.unwrap()[place].parse().unwrap())
        .take(3)
        .collect()
}

#[test]
fn a_connected_axis_is_commissioned_as_well_as_the_axis_itself() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let said = succeed(
        at,
        &[
            "connect",
            "--simulated",
            "--json",
            "commission",
            "--axis",
            "x",
            "--travel",
            "200",
            "--quick",
            "--apply",
            "--store",
            "--out",
            "connected",
        ],
    );
    let result: Value = serde_json::from_str(said.trim()).unwrap();
    let result = &result["result"];
    assert_eq!(
        (&result["applied"], &result["stored"]),
        (&true.into(), &true.into())
    );
    succeed(
        at,
        &["commission", "--axis", "x", "--quick", "--out", "direct"],
    );

    let read = |name: &str| SettingsFile::read(&at.join(name).join("settings.toml")).unwrap();
    let [connected, direct] = [read("connected"), read("direct")];
    assert_eq!(connected.provenance.len(), 1);
    // Nobody has commissioned the others.
    let fresh = StageSetup::simulated().settings;
    assert_eq!(connected.stage.axes[1..], fresh.axes[1..]);
    let plants = [&connected, &direct].map(|file| file.stage.axes[0].plant.unwrap());
    let [of_link, itself] = plants;
    let close = |found: f64, known: f64, share: f64| {
        assert!(
            (found / known - 1.0).abs() < share,
            "{found} is not {known}"
        );
    };
    close(of_link.gain_mm_per_v_s2, itself.gain_mm_per_v_s2, 0.005);
    close(of_link.damping_per_s, itself.damping_per_s, 0.02);
    close(of_link.delay_s, itself.delay_s, 0.01);

    let [found, known] =
        ["connected", "direct"].map(|name| verdict(&at.join(name).join("x/verdict.csv")));
    println!("RMS, um: {found:?} connected, {known:?} directly; A {of_link:?} {itself:?}");
    for law in 0..2 {
        close(found[law], known[law], 0.1);
    }
    // What friction leaves of the full law is some counts.
    assert!(found[2] < 0.15 * found[0], "{found:?}");
}
