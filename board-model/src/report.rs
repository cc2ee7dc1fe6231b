//! Rows of the table that a run prints, as they come.

use std::fmt::Display;

/// Rows of a scenario.
#[derive(Debug, Default)]
pub struct Report {
    /// Number of them.
    pub rows: usize,
    /// Number of those that are not as expected.
    pub failed: usize,
}

impl Report {
    /// Prints a row: what was done, expected, measured, whether it is as expected.
    pub fn row(
        &mut self,
        done: &str,
        expected: impl Display,
        measured: impl Display,
        passes: bool,
    ) {
        let verdict = if passes { "ok  " } else { "FAIL" };
        println!("  {verdict} {done}: expected {expected}; measured {measured}");
        self.rows += 1;
        self.failed += usize::from(!passes);
    }

    /// Adds a row whose measured value must equal the expected one.
    pub fn equal<T: PartialEq + Display>(&mut self, done: &str, expected: T, measured: T) {
        let passes = expected == measured;
        self.row(done, expected, measured, passes);
    }

    /// Adds a row whose measured value lies in a range, both ends included.
    pub fn within(&mut self, done: &str, least: f64, most: f64, measured: f64, unit: &str) {
        let passes = (least..=most).contains(&measured);
        self.row(
            done,
            format!("{least} to {most} {unit}"),
            format!("{measured:.4} {unit}"),
            passes,
        );
    }

    /// Adds a row of complaints, of which there must be none.
    pub fn none(&mut self, done: &str, complaints: &[String]) {
        let measured = if complaints.is_empty() {
            "none".into()
        } else {
            complaints.join("; ")
        };
        self.row(done, "none", measured, complaints.is_empty());
    }
}
