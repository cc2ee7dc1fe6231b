//! Lists of numbers on the command line.

use std::fmt;
use std::str::FromStr;

/// Numbers, separated by commas.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Numbers(pub(super) Vec<f64>);

/// The numbers of an option that may be given several times.
pub(super) fn all(lists: &[Numbers]) -> Vec<f64> {
    lists.iter().flat_map(|list| &list.0).copied().collect()
}

impl fmt::Display for Numbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers: Vec<String> = self.0.iter().map(f64::to_string).collect();
        f.write_str(&numbers.join(","))
    }
}

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        if let [whole, decimals] = parts[..]
            && is_whole(whole)
            && is_whole(decimals)
            && !decimals.starts_with('-')
        {
            return Err(format!(
                "its comma may stand for a decimal point: give {whole}.{decimals} for one number, {whole}.0,{decimals}.0 for two"
            ));
        }
        let mut numbers: Vec<f64> = Vec::new();
        for part in parts {
            let number = part.parse().map_err(|_| format!("`{part}` is no number"))?;
            if numbers.contains(&number) {
                return Err(format!("{number} is given twice"));
            }
            numbers.push(number);
        }
        Ok(Self(numbers))
    }
}

/// True for a number that is written without a point or an exponent.
fn is_whole(text: &str) -> bool {
    text.parse::<i64>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::Numbers;

    #[test]
    fn a_comma_that_may_be_a_decimal_one_is_refused_with_both_meanings() {
        let refused = |text: &str| text.parse::<Numbers>().unwrap_err();
        for (text, one, two) in [("5,5", "5.5", "5.0,5.0"), ("12,25", "12.25", "12.0,25.0")] {
            let error = refused(text);
            assert!(error.contains(one) && error.contains(two), "{error}");
        }
        assert!(refused("5.0,5.0").contains("twice"));
        assert!(refused("5,x").contains("`x`"));
        for (text, numbers) in [
            ("5", vec![5.0]),
            ("5.5", vec![5.5]),
            ("5.0,15", vec![5.0, 15.0]),
            ("5,15,30", vec![5.0, 15.0, 30.0]),
            ("-5", vec![-5.0]),
        ] {
            assert_eq!(text.parse(), Ok(Numbers(numbers)));
        }
    }
}
