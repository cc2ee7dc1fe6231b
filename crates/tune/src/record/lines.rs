//! The line of a file that each of its rows stands in.

/// Line of each row, by runs: blank lines and quoted line breaks make lines and rows differ.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Lines {
    /// First row of each run, and its line.
    runs: Vec<(usize, u64)>,
    rows: usize,
}

impl Lines {
    /// Returns the number of rows.
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the line of a row, from 1; 0 where there are no rows.
    pub(super) fn line(&self, row: usize) -> u64 {
        let run = self
            .runs
            .partition_point(|(first, _)| *first <= row)
            .saturating_sub(1);
        self.runs
            .get(run)
            .map_or(0, |(first, line)| line + (row - first) as u64)
    }

    /// Adds a row.
    pub(super) fn push(&mut self, line: u64) {
        let row = self.rows;
        let follows = |(first, at): &(usize, u64)| at + (row - first) as u64 == line;
        if !self.runs.last().is_some_and(follows) {
            self.runs.push((row, line));
        }
        self.rows += 1;
    }
}
