//! Numbers in JSON, which has none that are not finite, yet gaps in curves and unbounded results are such.

use serde::{Serialize, Serializer};

/// A number, or the name of one that JSON cannot hold.
pub(super) fn one<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() {
        value.serialize(to)
    } else {
        to.collect_str(value)
    }
}

/// The same for many: a sample that is not finite is `null`, a gap.
pub(super) fn list<S: Serializer>(values: &[f64], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(
        values
            .iter()
            .map(|value| value.is_finite().then_some(value)),
    )
}
