//! Samples as CSV files that every other command reads.

use std::path::{Path, PathBuf};

use quadrant_link::message::{AxisName, AxisSignal, Channel, StageSignal};
use quadrant_tune::record::{TraceError, write_trace};

use super::samples::Samples;

/// The name of a channel's column, with its unit: of an axis as the other commands know it, `position_mm`.
pub fn column(channel: Channel) -> String {
    let name = match channel {
        Channel::Axis(_, AxisSignal::Output) => return "voltage_v".to_owned(),
        Channel::Stage(StageSignal::Tick) => return "tick".to_owned(),
        Channel::Stage(StageSignal::Elapsed) => return "elapsed_cycles".to_owned(),
        Channel::Axis(_, signal) => signal.as_str(),
        Channel::Stage(signal) => signal.as_str(),
    };
    let with_unit = match channel.physical_unit() {
        "" => name.to_owned(),
        unit => format!("{name}_{unit}"),
    };
    with_unit.replace(['-', '/'], "_").to_lowercase()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_an_axis_have_the_names_that_every_command_reads() {
        let names: Vec<String> = Channel::all().map(column).collect();
        let of_x = "reference_mm position_mm error_mm velocity_mm_s p_v i_v d_v level_v viscous_v presliding_v inertia_v transfer_v \
                    voltage_v code limited_by injection_v code_sum glitch_um friction_scale learning vibration_gate error_squares \
                    error_squares_off";
        let of_stage = "state fault tick elapsed_cycles circle_deviation_um circle_angle_deg";
        let expected = [of_x, of_x, of_x, of_stage].join(" ");
        assert_eq!(names.join(" "), expected);
    }
}
