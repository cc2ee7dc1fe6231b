//! The figures of a record: circular deviation, largest error, reversal spike.

use std::fs;
use std::path::Path;

use anyhow::Result;
use quadrant_linuxcnc::plant::Recorded;

/// Radius of the part program's circles, mm.
const RADIUS_MM: f64 = 10.0;
/// Largest distance of a command from the circle that it is on, mm: the path tolerance of the part program.
const ON_CIRCLE_MM: f64 = 1e-3;
/// Time after a reversal in which its spike is looked for, s.
const SPIKE_S: f64 = 0.15;

/// Figures of a record, um.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Score {
    /// Largest less smallest radius on the circles, both ways together.
    pub(crate) circular_um: f64,
    /// Largest error of x or y.
    pub(crate) largest_um: f64,
    /// Largest error of an axis soon after its reversal, as a mean over all reversals.
    pub(crate) spike_um: f64,
}

impl Score {
    /// The figures in order.
    pub(crate) const fn figures(&self) -> [f64; 3] {
        [self.circular_um, self.largest_um, self.spike_um]
    }
}

/// Reads a record: little-endian numbers.
pub(crate) fn read(path: &Path) -> Result<Vec<Recorded>> {
    let bytes = fs::read(path)?;
    let numbers: Vec<f64> = bytes
        .as_chunks::<8>()
        .0
        .iter()
        .map(|bytes| f64::from_le_bytes(*bytes))
        .collect();
    let tick = |numbers: &[f64; 6]| {
        let [a, b, c, d, e, f] = *numbers;
        [[a, b, c], [d, e, f]]
    };
    Ok(numbers.as_chunks::<6>().0.iter().map(tick).collect())
}

/// Largest step of a voltage just after the index pulse to which LinuxCNC homed, V.
pub(crate) fn index_step(folder: &Path) -> Result<f64> {
    let text = fs::read_to_string(folder.join("index"))?;
    let mut steps = text.lines().map(str::parse::<f64>);
    Ok(steps.try_fold(0.0, |most, step| step.map(|step| step.max(most)))?)
}

/// Judges a record of a thread of `rate_hz`.
pub(crate) fn judge(record: &[Recorded], rate_hz: f64) -> Score {
    // Homing sets the origin to within a count or two: the circles are where the commands go.
    let furthest = |axis: usize, sense: f64| {
        let along = record.iter().map(|[command, _]| sense * command[axis]);
        sense * along.fold(f64::MIN, f64::max)
    };
    let centre_mm = [
        furthest(0, 1.0) - RADIUS_MM,
        0.5 * (furthest(1, 1.0) + furthest(1, -1.0)),
    ];
    let radius = |point: [f64; 3]| (point[0] - centre_mm[0]).hypot(point[1] - centre_mm[1]);
    let radii: Vec<f64> = record
        .iter()
        .map(|[command, position]| (radius(*command), radius(*position)))
        .filter(|(command, _)| (command - RADIUS_MM).abs() < ON_CIRCLE_MM)
        .map(|(command, position)| position - command)
        .collect();
    let most = radii.iter().copied().fold(f64::MIN, f64::max);
    let least = radii.iter().copied().fold(f64::MAX, f64::min);
    let mut largest = 0.0_f64;
    let mut spikes = Vec::new();
    for axis in 0..2 {
        let errors: Vec<f64> = record
            .iter()
            .map(|[command, position]| (command[axis] - position[axis]).abs())
            .collect();
        largest = errors.iter().copied().fold(largest, f64::max);
        let window = (SPIKE_S * rate_hz) as usize;
        let mut sense = 0.0;
        for (index, pair) in record.windows(2).enumerate() {
            let moved = pair[1][0][axis] - pair[0][0][axis];
            // Parts of the record lie apart in time, not in place.
            if moved.abs() < 1e-9 {
                continue;
            }
            if sense * moved < 0.0 {
                let end = errors.len().min(index + window);
                spikes.push(errors[index..end].iter().copied().fold(0.0, f64::max));
            }
            sense = moved;
        }
    }
    Score {
        circular_um: 1e3 * (most - least),
        largest_um: 1e3 * largest,
        spike_um: 1e3 * spikes.iter().sum::<f64>() / spikes.len().max(1) as f64,
    }
}
