//! The recordings of a commissioning, in files.

use std::path::Path;

use anyhow::bail;
use quadrant_cli::output::Output;
use quadrant_tune::commission::{Commissioned, CrossCheck, Measurements};
use quadrant_tune::identify::frf::{FrfSettings, SavedSettings, response_of};
use quadrant_tune::identify::motor_constant::{MotorConstantSettings, evaluate};
use quadrant_tune::identify::static_friction::FrictionMap;
use quadrant_tune::record::Recording;

/// Settling time of a saved response, s.
const SETTLING_S: f64 = 0.7;
/// Name of the recording of the open-loop test.
const MOTOR_CONSTANT: &str = "motor-constant-recording.csv";
/// Name of the recording of the pre-sliding step.
const PRESLIDING: &str = "virgin-curve-recording.csv";
/// Name of the table of runs at constant velocity.
const FRICTION: &str = "friction-map.csv";

/// Name of the `number`th recording of the response, from 1.
fn response(number: usize) -> String {
    format!("frf-recording-{number}.csv")
}

/// Reads what [`write`] has written, as far as settings follow from it.
pub(super) fn read(folder: &Path, resolution_mm: f64) -> anyhow::Result<Measurements> {
    if !folder.is_dir() {
        bail!(
            "{}: no such folder; give the --out folder of an earlier commissioning",
            folder.display()
        );
    }
    let steps = Recording::read_csv(&folder.join(MOTOR_CONSTANT))?;
    let settings = MotorConstantSettings::of(&steps);
    let motor = evaluate(steps, &settings, resolution_mm)?;
    let responses = (1..)
        .map(|number| folder.join(response(number)))
        .take_while(|path| path.exists())
        .map(|path| Recording::read_csv(&path))
        .collect::<Result<Vec<_>, _>>()?;
    let excitation = FrfSettings::default().excitation;
    let saved = SavedSettings {
        period_s: excitation.period_s,
        band_hz: excitation.band_hz,
        settling_s: SETTLING_S,
    };
    Ok(Measurements {
        motor,
        response: response_of(responses, &saved)?,
        map: FrictionMap::read_csv(&folder.join(FRICTION))?,
        runs: Vec::new(),
        presliding: Recording::read_csv(&folder.join(PRESLIDING))?,
    })
}

/// Saves every recording that the settings rest on; returns their names.
pub(super) fn write(
    output: &Output,
    found: &Commissioned,
    checked: Option<&CrossCheck>,
) -> anyhow::Result<Vec<String>> {
    let mut records = vec![(MOTOR_CONSTANT.to_owned(), &found.motor.recording)];
    let responses = found.response.recordings.iter().enumerate();
    records.extend(responses.map(|(index, record)| (response(index + 1), record)));
    records.push((PRESLIDING.to_owned(), &found.presliding.1));
    if let Some(CrossCheck { recordings, .. }) = checked {
        let named = ["at-rest-recording.csv", "motion-recording.csv"].map(str::to_owned);
        records.extend(named.into_iter().zip(recordings));
    }
    let mut names = Vec::new();
    for (name, recording) in records {
        recording.write_csv(&output.file(&name)?)?;
        names.push(name);
    }
    found
        .response
        .estimate
        .response
        .write_csv(&output.file("frf.csv")?)?;
    found.friction.0.write_csv(&output.file(FRICTION)?)?;
    names.extend(["frf.csv", FRICTION].map(str::to_owned));
    Ok(names)
}
