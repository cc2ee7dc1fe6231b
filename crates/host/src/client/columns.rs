//! Samples as CSV files that every other command reads.

use std::path::{Path, PathBuf};

use quadrant_link::message::{AxisName, AxisSignal, Channel, StageSignal};
use quadrant_tune::record::{TraceError, write_trace};

use super::samples::Samples;

/// The name of a channel's column, with its unit: of an axis as the other commands know it, `position_mm`.
pub fn column(channel: Channel) -> String {
    match channel {
        Channel::Axis(_, signal) => axis_column(signal).to_owned(),
        Channel::Stage(signal) => match signal {
            StageSignal::Elapsed => "elapsed_cycles".to_owned(),
            StageSignal::CircleDeviation => "circle_deviation_um".to_owned(),
            StageSignal::CircleAngle => "circle_angle_deg".to_owned(),
            other => other.as_str().to_owned(),
        },
    }
}

const fn axis_column(signal: AxisSignal) -> &'static str {
    match signal {
        AxisSignal::Reference => "reference_mm",
        AxisSignal::Position => "position_mm",
        AxisSignal::Error => "error_mm",
        AxisSignal::Velocity => "velocity_mm_s",
        AxisSignal::Proportional => "p_v",
        AxisSignal::Integral => "i_v",
        AxisSignal::Derivative => "d_v",
        AxisSignal::Level => "level_v",
        AxisSignal::Viscous => "viscous_v",
        AxisSignal::Presliding => "presliding_v",
        AxisSignal::Inertia => "inertia_v",
        AxisSignal::BumplessOffset => "transfer_v",
        AxisSignal::Output => "voltage_v",
        AxisSignal::Code => "code",
        AxisSignal::LimitedBy => "limited_by",
        AxisSignal::Injection => "injection_v",
        AxisSignal::CodeSum => "code_sum",
        AxisSignal::Glitch => "glitch_um",
        AxisSignal::FrictionScale => "friction_scale",
        AxisSignal::Learning => "learning",
        AxisSignal::VibrationGate => "vibration_gate",
        AxisSignal::ErrorSquares => "error_squares",
        AxisSignal::ErrorSquaresOff => "error_squares_off",
    }
}

/// A channel's values in its column's unit: positions in mm, by the length of a count of each axis.
pub fn values_mm(samples: &Samples, index: usize, resolution_mm: &[f64; 3]) -> Vec<f64> {
    let mut values = samples.values(index);
    if let Some(channel) = samples.channels.get(index) {
        for value in &mut values {
            *value = channel.physical(*value, resolution_mm);
        }
    }
    values
}

/// Writes samples as CSV: `t_s`, then a column for each channel. Of several axes each has a file of its own, `run.csv` as
/// `run-x.csv` and so on, with the stage's channels in each. Gives the paths.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    samples: &Samples,
    path: &Path,
    resolution_mm: &[f64; 3],
) -> Result<Vec<PathBuf>, TraceError> {
    let axes: Vec<AxisName> = AxisName::ALL
        .into_iter()
        .filter(|axis| {
            let on_axis = |channel: &Channel| matches!(channel, Channel::Axis(of, _) if of == axis);
            samples.channels.iter().any(on_axis)
        })
        .collect();
    let files: Vec<(Option<AxisName>, PathBuf)> = match axes.as_slice() {
        [] => vec![(None, path.to_owned())],
        [one] => vec![(Some(*one), path.to_owned())],
        several => several
            .iter()
            .map(|&axis| (Some(axis), of_axis(path, axis)))
            .collect(),
    };
    let time_s = samples.time_s();
    for (axis, path) in &files {
        let mut columns = vec![("t_s".to_owned(), time_s.clone())];
        for (index, &channel) in samples.channels.iter().enumerate() {
            if !matches!(channel, Channel::Axis(of, _) if Some(of) != *axis) {
                columns.push((column(channel), values_mm(samples, index, resolution_mm)));
            }
        }
        let columns: Vec<(&str, &[f64])> = columns
            .iter()
            .map(|(name, values)| (name.as_str(), values.as_slice()))
            .collect();
        write_trace(path, &columns)?;
    }
    Ok(files.into_iter().map(|(_, path)| path).collect())
}

fn of_axis(path: &Path, axis: AxisName) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(extension) => format!("{stem}-{axis}.{}", extension.to_string_lossy()),
        None => format!("{stem}-{axis}"),
    };
    path.with_file_name(name)
}
