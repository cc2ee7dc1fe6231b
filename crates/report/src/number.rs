//! Numbers in files: JSON has none that are not finite, yet gaps in curves and unbounded results are such.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

/// A number, or the name of one that JSON cannot hold.
pub(super) fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    if to.is_human_readable() && !value.is_finite() {
        to.collect_str(value)
    } else {
        value.serialize(to)
    }
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    if !from.is_human_readable() {
        return f64::deserialize(from);
    }
    // Not an untagged enum: none takes a number where another crate has asked serde_json for arbitrary precision.
    let value = Value::deserialize(from)?;
    let found = match &value {
        Value::Number(number) => number.as_f64(),
        Value::String(name) => name.parse().ok(),
        _ => None,
    };
    found.ok_or_else(|| Error::custom(format!("{value} is no number; \"NaN\" and \"inf\" are")))
}

/// The same for many: a sample that is not finite is `null`, a gap.
pub(super) mod list {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(values: &[f64], to: S) -> Result<S::Ok, S::Error> {
        if to.is_human_readable() {
            to.collect_seq(
                values
                    .iter()
                    .map(|value| value.is_finite().then_some(value)),
            )
        } else {
            values.serialize(to)
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        if from.is_human_readable() {
            let values = Vec::<Option<f64>>::deserialize(from)?;
            Ok(values
                .into_iter()
                .map(|value| value.unwrap_or(f64::NAN))
                .collect())
        } else {
            Vec::deserialize(from)
        }
    }
}
