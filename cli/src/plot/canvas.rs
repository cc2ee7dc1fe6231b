//! Curves in characters, one sign a run.

use quadrant_host::client::plot::number;

/// Sign of each run; a place that several runs take has that of the last.
const SIGNS: [char; 6] = ['*', 'o', '+', 'x', '#', '@'];
/// Room for the labels of the vertical axis, characters.
const LABEL: usize = 11;

/// The sign of the `index`th run.
pub(super) fn sign(index: usize) -> char {
    SIGNS[index % SIGNS.len()]
}

/// Draws runs of one column, each its times and its values, `width` by `height` characters with the labels. In each column of
/// characters a run spans from its lowest to its highest value, so that no spike is lost.
pub(super) fn draw(runs: &[(&[f64], &[f64])], width: usize, height: usize) -> Vec<String> {
    let (first_s, last_s) = span(runs.iter().flat_map(|(time_s, _)| *time_s));
    let (low, high) = span(runs.iter().flat_map(|(_, values)| *values));
    let width = width.saturating_sub(LABEL + 1).max(8);
    let share = |value: f64, (low, high): (f64, f64)| {
        // A constant is drawn in the middle.
        if high > low {
            (value - low) / (high - low)
        } else {
            0.5
        }
    };
    let place = |share: f64, count: usize| (share * (count - 1) as f64).round() as usize;
    let mut cells = vec![vec![' '; width]; height];
    for (index, (time_s, values)) in runs.iter().enumerate() {
        let mut spans: Vec<Option<(usize, usize)>> = vec![None; width];
        for (time_s, value) in time_s.iter().zip(*values) {
            if time_s.is_finite() && value.is_finite() {
                let column = place(share(*time_s, (first_s, last_s)), width);
                let row = height - 1 - place(share(*value, (low, high)), height);
                let (top, bottom) = spans[column].unwrap_or((row, row));
                spans[column] = Some((top.min(row), bottom.max(row)));
            }
        }
        for (column, span) in spans.into_iter().enumerate() {
            if let Some((top, bottom)) = span {
                (top..=bottom).for_each(|row| cells[row][column] = sign(index));
            }
        }
    }
    let mut lines: Vec<String> = (cells.into_iter().enumerate())
        .map(|(row, cells)| {
            let label = match row {
                0 => number(high),
                _ if row + 1 == height => number(low),
                _ => String::new(),
            };
            let cells: String = cells.into_iter().collect();
            format!("{label:>LABEL$} {cells}").trim_end().to_owned()
        })
        .collect();
    let (first, last) = (
        format!("{} s", number(first_s)),
        format!("{} s", number(last_s)),
    );
    let between = width.saturating_sub(first.len());
    lines.push(format!("{:LABEL$} {first}{last:>between$}", ""));
    lines
}

/// The lowest and the highest of some values.
fn span<'a>(values: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    let finite = values.filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(*value), high.max(*value))
    })
}

#[cfg(test)]
mod tests {
    use super::draw;

    #[test]
    fn runs_have_signs_of_their_own_on_one_scale_and_no_spike_is_lost() {
        let time_s: Vec<f64> = (0..1000).map(f64::from).collect();
        let mut spike = vec![0.0; 1000];
        spike[371] = 2.0;
        let level = vec![1.0; 1000];
        let lines = draw(&[(&time_s, &spike), (&time_s, &level)], 60, 5);
        assert_eq!(lines.len(), 6);
        assert!(
            lines.iter().all(|line| line.chars().count() <= 60),
            "{lines:#?}"
        );
        assert!(
            lines[0].contains('*') && lines[0].trim_start().starts_with('2'),
            "{lines:#?}"
        );
        assert_eq!(lines[2].matches('o').count(), 48, "{lines:#?}");
        assert!(
            lines[4].contains('*') && !lines[4].contains('o'),
            "{lines:#?}"
        );
        assert!(
            lines[5].contains("0 s") && lines[5].ends_with("999.00 s"),
            "{lines:#?}"
        );
    }
}
