//! Numbers in files: JSON has none that are not finite, yet gaps in curves and unbounded results are such.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A number, or the name of one that JSON cannot hold.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Readable {
    Finite(f64),
    Named(String),
}

impl Readable {
    fn new(value: f64) -> Self {
        if value.is_finite() {
            Self::Finite(value)
        } else {
            Self::Named(value.to_string())
        }
    }

    fn value<E: serde::de::Error>(self) -> Result<f64, E> {
        match self {
            Self::Finite(value) => Ok(value),
            Self::Named(name) => name
                .parse()
                .map_err(|_| E::custom(format!("{name:?} is no number; \"NaN\" and \"inf\" are"))),
        }
    }
}

pub(super) fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    if to.is_human_readable() {
        Readable::new(*value).serialize(to)
    } else {
        value.serialize(to)
    }
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    if from.is_human_readable() {
        Readable::deserialize(from)?.value()
    } else {
        f64::deserialize(from)
    }
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
