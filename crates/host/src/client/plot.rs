//! Curves in a terminal, in braille: two dots across and four down in a character.

use quadrant_written::fixed;

/// The first braille pattern.
const BLANK: u32 = 0x2800;

/// The bit of each dot: columns of a character, each from top to bottom.
const BITS: [[u32; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];

/// Room for the labels of the vertical axis, characters.
const LABEL: usize = 11;

/// A curve over equally spaced samples, `width` by `height` characters with its labels; each column of dots spans from the
/// lowest to the highest of its samples, so that no spike is lost. Values that are not finite are gaps.
pub fn curve(values: &[f64], width: usize, height: usize) -> Vec<String> {
    beside(&[values], width, height)
}

/// Several curves on one scale, one beside the other, `width` by `height` characters together.
pub fn beside(curves: &[&[f64]], width: usize, height: usize) -> Vec<String> {
    let (low, high) = span(curves.iter().copied().flatten());
    let room = width.saturating_sub(LABEL) / curves.len().max(1);
    let drawn: Vec<Vec<String>> = curves
        .iter()
        .map(|values| {
            draw(
                values,
                (low, high),
                room.saturating_sub(1).max(1),
                height.max(1),
            )
        })
        .collect();
    (0..height.max(1))
        .map(|line| {
            let label = match line {
                0 if high.is_finite() => number(high),
                _ if line + 1 == height && low.is_finite() => number(low),
                _ => String::new(),
            };
            drawn
                .iter()
                .fold(format!("{label:>LABEL$}"), |text, curve| {
                    text + " " + &curve[line]
                })
        })
        .collect()
}

/// Returns the place of the `index`th of `count` curves of [`beside`], characters from the left.
pub fn place(index: usize, count: usize, width: usize) -> usize {
    LABEL + 1 + index * (width.saturating_sub(LABEL) / count.max(1))
}

/// Returns the lowest and the highest of some values; infinite ends if there are none.
fn span<'a>(values: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    let finite = values.copied().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}

/// Draws a curve in `width` by `height` characters.
fn draw(values: &[f64], (low, high): (f64, f64), width: usize, height: usize) -> Vec<String> {
    let columns = 2 * width;
    let rows = 4 * height;
    let mut cells = vec![vec![BLANK; width]; height];
    // A constant is drawn in the middle.
    let span = if high > low { high - low } else { 1.0 };
    let middle = if high > low { low } else { low - 0.5 };
    let row = |value: f64| {
        let share = ((value - middle) / span).clamp(0.0, 1.0);
        ((1.0 - share) * (rows - 1) as f64).round() as usize
    };
    let mut last = None;
    for column in 0..columns {
        let from = column * values.len() / columns;
        let to = ((column + 1) * values.len())
            .div_ceil(columns)
            .min(values.len());
        let part = values[from.min(to)..to]
            .iter()
            .copied()
            .filter(|value| value.is_finite());
        let Some((top, bottom)) = part
            .map(row)
            .fold(None, |span: Option<(usize, usize)>, row| {
                Some(span.map_or((row, row), |(top, bottom)| (top.min(row), bottom.max(row))))
            })
        else {
            last = None;
            continue;
        };
        // Joined to the column before, if there is one.
        let (first, end) = match last {
            Some((above, _)) if above > bottom => (top, above - 1),
            Some((_, below)) if below < top => (below + 1, bottom),
            _ => (top, bottom),
        };
        for dot in first..=end {
            cells[dot / 4][column / 2] |= BITS[column % 2][dot % 4];
        }
        last = Some((top, bottom));
    }
    let text = |cells: &Vec<u32>| {
        cells
            .iter()
            .filter_map(|&cell| char::from_u32(cell))
            .collect()
    };
    cells.iter().map(text).collect()
}

/// A number in few characters.
pub fn number(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 || (1e-3..1e6).contains(&magnitude) {
        let digits = (4 - magnitude.max(1e-3).log10().floor() as i32).clamp(0, 6);
        fixed(value, digits as usize)
    } else {
        format!("{value:.3e}")
    }
}

#[cfg(test)]
mod tests {
    use super::{beside, curve};

    fn dots(line: &str) -> u32 {
        line.chars()
            .filter(|c| ('\u{2800}'..='\u{28ff}').contains(c))
            .map(|c| (c as u32 - 0x2800).count_ones())
            .sum()
    }

    #[test]
    fn a_single_spike_among_many_samples_is_drawn() {
        let mut values = vec![0.0; 10_000];
        values[7_654] = 1.0;
        let lines = curve(&values, 60, 5);
        assert_eq!(lines.len(), 5);
        assert!(dots(&lines[0]) >= 1, "{lines:#?}");
        assert!(lines[0].trim_start().starts_with('1'));
        assert!(lines[4].trim_start().starts_with('0'));
    }

    #[test]
    fn a_ramp_is_joined_from_corner_to_corner() {
        let values: Vec<f64> = (0..48).map(f64::from).collect();
        let lines = curve(&values, 36, 6);
        // 24 characters and 12 of labels: 48 columns of dots, in 24 rows.
        assert!(lines.iter().all(|line| dots(line) >= 8), "{lines:#?}");
        let last = |line: &str| line.chars().last().unwrap();
        assert_ne!(last(&lines[0]), '\u{2800}');
        assert_eq!(last(&lines[5]), '\u{2800}');
    }

    #[test]
    fn curves_beside_each_other_have_one_scale() {
        let (large, small) = (vec![0.0, 10.0, 0.0], vec![0.0, 1.0, 0.0]);
        let lines = beside(&[&large, &small], 72, 8);
        let half = super::place(1, 2, 72);
        let right = |line: &str| line.chars().skip(half).collect::<String>();
        assert!(
            lines.iter().all(|line| line.chars().count() <= 72),
            "{lines:#?}"
        );
        assert!(dots(&lines[0]) > 0);
        assert_eq!(dots(&right(&lines[0])), 0, "{lines:#?}");
        assert!(dots(&right(&lines[7])) > 0, "{lines:#?}");
    }

    #[test]
    fn gaps_constants_and_nothing_are_drawn_too() {
        assert_eq!(dots(&curve(&[], 40, 4).concat()), 0);
        assert!(dots(&curve(&[2.5; 10], 40, 4).concat()) > 0);
        let gap = [1.0, f64::NAN, f64::INFINITY, 2.0];
        assert!(dots(&curve(&gap, 40, 4).concat()) > 0);
    }
}
