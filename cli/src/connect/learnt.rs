//! The friction that the axes have learnt: how it is shown, and how it is kept.

use quadrant_cli::axis::Axis;
use quadrant_host::client::{Client, adopt};
use quadrant_law::axes::AxisName;
use quadrant_link::message::{AxisLearning, Learning};
use serde_json::{Value, json};

use super::answer::Answer;
use super::settings::difference_line;

/// A line of each axis that learns, of 80 columns at most.
pub(super) fn lines(learning: &Learning) -> Vec<String> {
    let named = AxisName::ALL.into_iter().zip(&learning.axes);
    named
        .filter_map(|(axis, seen)| Some(line(axis, seen.as_ref()?)))
        .collect()
}

fn line(axis: AxisName, seen: &AxisLearning) -> String {
    let error = seen.error_share.map_or(String::new(), |share| {
        format!(", error {:.0} % of without", 100.0 * share)
    });
    format!(
        "friction of {} x {:.3}{error}; {}",
        axis.as_str(),
        seen.scale,
        seen.state.words()
    )
}

pub(super) fn data(learning: &Learning) -> Value {
    json!(learning.axes)
}

/// Takes what an axis has learnt into the draft.
pub(super) fn adopt(client: &mut Client, axis: Axis) -> anyhow::Result<Answer> {
    let adopted = adopt::adopt(client, axis.into())?;
    let mut lines = vec![format!(
        "friction of {} is {:.3} times the setting in force; in the draft now:",
        axis.name(),
        adopted.scale
    )];
    lines.extend(adopted.gains.iter().map(difference_line));
    lines.push("`apply` lets it act, and the scale begins at 1 again; `store` keeps it".to_owned());
    Ok(Answer::new(lines.join("\n"), json!(adopted)))
}
