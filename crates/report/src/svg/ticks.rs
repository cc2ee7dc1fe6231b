//! Where an axis has its ticks, and what they are called.

use crate::Scale;

/// A tick of an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    /// Where it is: the value, or its logarithm on decades.
    pub(super) place: f64,
    /// What it is called; ticks between decades have no name.
    pub(super) label: Option<String>,
}

/// Ticks between two places, about `count` of them with names.
pub(super) fn ticks(scale: Scale, low: f64, high: f64, count: usize) -> Vec<Tick> {
    match scale {
        Scale::Linear => even(low, high, count),
        Scale::Logarithmic => decades(low, high, count),
    }
}

fn even(low: f64, high: f64, count: usize) -> Vec<Tick> {
    let rough = (high - low) / count.max(1) as f64;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|step| step * decade)
        .into_iter()
        .find(|step| *step >= rough * (1.0 - 1e-9))
        .unwrap_or(rough);
    let names = Names::of(step, low.abs().max(high.abs()));
    let tolerance = 1e-6;
    let first = (low / step - tolerance).ceil() as i64;
    let last = (high / step + tolerance).floor() as i64;
    (first..=last)
        .map(|k| {
            let value = k as f64 * step;
            Tick {
                place: value,
                label: Some(names.of_value(value)),
            }
        })
        .collect()
}

fn decades(low: f64, high: f64, count: usize) -> Vec<Tick> {
    let (first, last) = (low.floor() as i32, high.ceil() as i32);
    let span = high - low;
    // Below about two decades, powers of ten alone would leave an axis with one name or none.
    let named: &[u32] = match span {
        span if span < 1.0 => &[1, 2, 3, 4, 5, 6, 7, 8, 9],
        span if span < 2.2 => &[1, 2, 5],
        _ => &[1],
    };
    let every = ((span / count.max(1) as f64).ceil() as i32).max(1);
    (first..=last)
        .flat_map(|decade| (1..10).map(move |digit: u32| (decade, digit)))
        .filter_map(|(decade, digit)| {
            let place = f64::from(decade) + f64::from(digit).log10();
            let is_named = named.contains(&digit) && (span < 2.2 || decade % every == 0);
            let is_shown = is_named || digit == 1 || span < 4.5;
            ((low - 1e-9..=high + 1e-9).contains(&place) && is_shown).then(|| Tick {
                place,
                label: is_named.then(|| power(digit, decade)),
            })
        })
        .collect()
}

/// How the ticks of an even axis are named: as plain numbers, or as multiples of one power of ten where those are long.
struct Names {
    exponent: i32,
    decimals: usize,
}

impl Names {
    fn of(step: f64, largest: f64) -> Self {
        let exponent = if step < 1e-4 || largest >= 1e6 {
            largest.log10().floor() as i32
        } else {
            0
        };
        let decimals = f64::from(exponent) - step.log10().floor();
        Self {
            exponent,
            decimals: decimals.max(0.0) as usize,
        }
    }

    fn of_value(&self, value: f64) -> String {
        if value == 0.0 {
            return "0".to_owned();
        }
        let mantissa = value / 10f64.powi(self.exponent);
        let mantissa = format!("{mantissa:.*}", self.decimals).replace('-', "\u{2212}");
        match self.exponent {
            0 => mantissa,
            exponent => format!("{mantissa}·10{}", superscript(exponent)),
        }
    }
}

fn power(digit: u32, decade: i32) -> String {
    match (digit, decade) {
        (_, 0..=4) => format!("{}", u64::from(digit) * 10u64.pow(decade.unsigned_abs())),
        (_, -3..=-1) => format!(
            "{:.*}",
            decade.unsigned_abs() as usize,
            f64::from(digit) * 10f64.powi(decade)
        ),
        (1, _) => format!("10{}", superscript(decade)),
        _ => format!("{digit}·10{}", superscript(decade)),
    }
}

fn superscript(number: i32) -> String {
    number
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '0' => '⁰',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            digit => char::from_u32('⁴' as u32 + digit as u32 - '4' as u32).unwrap_or(digit),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{superscript, ticks};
    use crate::Scale;

    fn names(scale: Scale, low: f64, high: f64) -> Vec<String> {
        ticks(scale, low, high, 6)
            .into_iter()
            .filter_map(|tick| tick.label)
            .collect()
    }

    #[test]
    fn even_axes_have_round_ticks() {
        assert_eq!(
            names(Scale::Linear, -0.21, 0.4),
            ["\u{2212}0.2", "0", "0.2", "0.4"]
        );
        assert_eq!(names(Scale::Linear, 0.0, 37.7), ["0", "10", "20", "30"]);
        assert_eq!(
            names(Scale::Linear, 0.0, 3e-5)[1..3],
            ["0.5·10⁻⁵", "1.0·10⁻⁵"]
        );
        assert_eq!(names(Scale::Linear, 0.0, 5e6)[1], "1·10⁶");
    }

    #[test]
    fn decades_are_named_as_they_are_read() {
        assert_eq!(
            names(Scale::Logarithmic, -2.0, 3.0),
            ["0.01", "0.1", "1", "10", "100", "1000"]
        );
        assert_eq!(
            names(Scale::Logarithmic, 0.0, 1.5),
            ["1", "2", "5", "10", "20"]
        );
        assert_eq!(
            names(Scale::Logarithmic, -6.0, -4.0),
            [
                "10⁻⁶",
                "2·10⁻⁶",
                "5·10⁻⁶",
                "10⁻⁵",
                "2·10⁻⁵",
                "5·10⁻⁵",
                "10⁻⁴"
            ]
        );
    }

    #[test]
    fn every_span_has_ticks_but_not_a_crowd() {
        for exponent in -8..8 {
            for span in [1.0, 1.7, 3.3, 9.9] {
                let span = span * 10f64.powi(exponent);
                let count = names(Scale::Linear, 0.3 * span, 1.3 * span).len();
                assert!((2..=8).contains(&count), "{count} ticks over {span}");
            }
        }
        for decades in 1..16 {
            let count = names(Scale::Logarithmic, -3.1, -3.1 + f64::from(decades)).len();
            assert!(
                (2..=10).contains(&count),
                "{count} names on {decades} decades"
            );
        }
    }

    #[test]
    fn exponents_are_superscript() {
        assert_eq!(superscript(-12), "⁻¹²");
        assert_eq!(superscript(4567), "⁴⁵⁶⁷");
    }
}
