//! The friction-velocity map: what the runs showed, in memory and as CSV.

use std::path::Path;

use crate::identify::measured_table::{Columns, TableError};

/// One run at constant velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionRun {
    /// Measured mean velocity, mm/s; its sign is the direction's.
    pub velocity_mm_s: f64,
    /// Mean voltage, V.
    pub voltage_v: f64,
    /// Standard deviation of that mean, from the scatter within the run, V.
    pub deviation_v: f64,
    /// The axis stuck and slipped instead of moving evenly, or broke away under vibration: the mean is no friction at this velocity.
    pub stick_slip: bool,
}

/// Runs at several velocities in both directions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrictionMap {
    /// The runs, by rising velocity.
    pub runs: Vec<FrictionRun>,
}

/// Least exponent of the fall of friction with speed, from one run to the next slower one, of an axis that breaks away under vibration.
const MIN_BREAKAWAY_EXPONENT: f64 = 0.5;
/// Runs below this share of the first speed without such a fall are marked.
const MARKED_SPEED_SHARE: f64 = 0.95;

/// Fewest even runs of a direction by which its friction is known.
pub(super) const LEAST_RUNS: usize = 6;

const COLUMNS: Columns<4> = Columns {
    what: "a friction map",
    names: &["velocity_mm_s", "voltage_v", "deviation_v", "stick_slip"],
    expected: [
        "a finite number other than zero",
        "a finite number",
        "a number above zero",
        "0 or 1",
    ],
};

impl FrictionMap {
    /// Writes it as CSV: `velocity_mm_s`, `voltage_v`, `deviation_v`, `stick_slip` (0 or 1).
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), TableError> {
        let row = |run: &FrictionRun| {
            let stick_slip = f64::from(u8::from(run.stick_slip));
            [
                run.velocity_mm_s,
                run.voltage_v,
                run.deviation_v,
                stick_slip,
            ]
        };
        COLUMNS.write(path, self.runs.iter().map(row))
    }

    /// Reads what [`write_csv`](Self::write_csv) writes; the order of columns and rows is free, other columns are passed
    /// over.
    ///
    /// # Errors
    /// A file that cannot be read or is not a friction map; names the row and the column.
    pub fn read_csv(path: &Path) -> Result<Self, TableError> {
        let rows = COLUMNS.read(path, |column, value, _| match column {
            0 => value != 0.0,
            2 => value > 0.0,
            3 => value == 0.0 || value == 1.0,
            _ => true,
        })?;
        let run = |[velocity_mm_s, voltage_v, deviation_v, flag]: [f64; 4]| FrictionRun {
            velocity_mm_s,
            voltage_v,
            deviation_v,
            stick_slip: flag == 1.0,
        };
        let mut runs: Vec<FrictionRun> = rows.into_iter().map(run).collect();
        runs.sort_by(|a, b| a.velocity_mm_s.total_cmp(&b.velocity_mm_s));
        Ok(Self { runs })
    }

    /// Marks the slowest runs in which friction falls nearly in proportion to speed: noise or a vibration that is quicker than the
    /// axis makes it break away there. Nothing of an axis that has hardly any friction but that.
    pub(super) fn mark_shaken(&mut self) {
        let shaken = [1.0, -1.0].map(|sign| {
            let runs = self.direction(sign);
            let falls = |pair: &&[FrictionRun]| {
                let [slow, fast] = [pair[0], pair[1]];
                let volts = fast.voltage_v / slow.voltage_v;
                slow.voltage_v <= 0.0
                    || volts.ln()
                        > MIN_BREAKAWAY_EXPONENT * (fast.velocity_mm_s / slow.velocity_mm_s).ln()
            };
            let count = runs.windows(2).take_while(falls).count();
            if runs.len() < count + LEAST_RUNS {
                return None;
            }
            Some(runs[count].velocity_mm_s).filter(|_| count > 0)
        });
        let Some(below_mm_s) = shaken.into_iter().flatten().reduce(f64::max) else {
            return;
        };
        // The two directions' speeds differ by what the axis did not follow.
        for run in &mut self.runs {
            run.stick_slip |= run.velocity_mm_s.abs() < MARKED_SPEED_SHARE * below_mm_s;
        }
    }

    /// The runs of one direction that moved evenly, speeds and friction positive, by rising speed. `sign` is 1 or -1.
    pub(super) fn direction(&self, sign: f64) -> Vec<FrictionRun> {
        let mut runs: Vec<FrictionRun> = self
            .runs
            .iter()
            .filter(|run| sign * run.velocity_mm_s > 0.0 && !run.stick_slip)
            .map(|run| FrictionRun {
                velocity_mm_s: sign * run.velocity_mm_s,
                voltage_v: sign * run.voltage_v,
                ..*run
            })
            .collect();
        runs.sort_by(|a, b| a.velocity_mm_s.total_cmp(&b.velocity_mm_s));
        runs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(velocity_mm_s: f64, stick_slip: bool) -> FrictionRun {
        FrictionRun {
            velocity_mm_s,
            voltage_v: 0.1 * velocity_mm_s,
            deviation_v: 1e-3,
            stick_slip,
        }
    }

    #[test]
    fn what_is_written_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.csv");
        let map = FrictionMap {
            runs: vec![run(-2.0, false), run(0.05, true), run(1.0, false)],
        };
        map.write_csv(&path).unwrap();
        assert_eq!(FrictionMap::read_csv(&path).unwrap(), map);
    }

    #[test]
    fn the_slowest_runs_are_marked_in_which_friction_falls_with_speed_as_where_a_vibration_breaks_it_away()
     {
        let speeds = (0..12).map(|index| 0.1 * 1.35_f64.powi(index));
        let marked = |friction_v: fn(f64) -> f64| {
            let mut map = FrictionMap {
                runs: speeds
                    .clone()
                    .flat_map(|speed| [speed, -speed])
                    .map(|velocity_mm_s| FrictionRun {
                        voltage_v: friction_v(velocity_mm_s.abs()) * velocity_mm_s.signum(),
                        ..run(velocity_mm_s, false)
                    })
                    .collect(),
            };
            map.mark_shaken();
            map.runs.iter().filter(|run| run.stick_slip).count()
        };
        assert_eq!(marked(|speed| 0.25 + 0.02 * speed), 0);
        assert_eq!(marked(|speed| 0.25 + 0.2 * (-speed).exp()), 0, "Stribeck");
        assert_eq!(marked(|speed| 0.1 * speed), 0, "nothing but viscous");
        // 0.1, 0.135, 0.182 and 0.246 mm/s.
        let shaken = |speed: f64| {
            if speed < 0.3 {
                speed
            } else {
                0.3 + 0.02 * speed
            }
        };
        assert_eq!(marked(shaken), 8);
    }

    #[test]
    fn a_direction_has_positive_speeds_and_no_stick_slip() {
        let map = FrictionMap {
            runs: vec![
                run(-2.0, false),
                run(-1.0, false),
                run(-0.1, true),
                run(1.0, false),
            ],
        };
        let speeds: Vec<f64> = map
            .direction(-1.0)
            .iter()
            .map(|run| run.velocity_mm_s)
            .collect();
        assert_eq!(speeds, [1.0, 2.0]);
    }

    #[test]
    fn a_wrong_value_is_named_with_its_row_and_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.csv");
        let text = "velocity_mm_s,voltage_v,deviation_v,stick_slip\n1,0.1,0.001,0\n0,0.1,0.001,0\n";
        std::fs::write(&path, text).unwrap();
        let message = FrictionMap::read_csv(&path).unwrap_err().to_string();
        assert!(message.ends_with(
            "row 2, column velocity_mm_s: \"0\" is not a finite number other than zero"
        ));
    }
}
