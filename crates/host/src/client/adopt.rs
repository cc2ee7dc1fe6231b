//! The scale that an axis has learnt, taken into its settings.

use quadrant_link::message::AxisName;
use quadrant_sim::setting_value::short;
use serde::Serialize;

use super::error::ClientError;
use super::session::Client;
use super::settings::{self, Difference, whole_path};

/// The gains of the friction feedforward, which the scale multiplies.
const GAINS: [&str; 3] = ["presliding", "level", "viscous"];

/// Largest gain that the settings take.
const MOST: f64 = 2.0;

/// Result of adopting a scale.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Adopted {
    /// The scale: friction over what was commissioned.
    pub scale: f64,
    /// The gains as they act, and as the draft has them now.
    pub gains: Vec<Difference>,
}

/// Error of adopting a scale.
#[derive(Debug, thiserror::Error)]
pub enum AdoptError {
    /// The link.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The axis does not learn.
    #[error(
        "{axis} does not learn; `set {axis}/feedforward/learning present` and `apply` let it, then run what it works at"
    )]
    Off { axis: AxisName },
    /// The gain would leave its range.
    #[error(
        "{path} would be {gain:.2}, and may be at most {MOST}: friction is far from what was commissioned; look after the axis and identify its friction again"
    )]
    TooLarge {
        /// Path of the gain.
        path: String,
        /// Its value.
        gain: f64,
    },
}

/// Makes the friction gains of the machine's draft those that act, times what the axis has learnt. Made twice, it is the same as
/// made once. Once the draft acts, the scale begins at 1 again.
///
/// # Errors
/// An axis that does not learn, a gain beyond its range, or a connection that is broken.
pub fn adopt(client: &mut Client, axis: AxisName) -> Result<Adopted, AdoptError> {
    let learnt = client.learning()?.axes[axis as usize];
    let scale = f64::from(learnt.ok_or(AdoptError::Off { axis })?.scale);
    let mut gains = Vec::new();
    for name in GAINS {
        let path = whole_path(&format!("{axis}/feedforward/gains/{name}"));
        let acting = settings::acting(client, &path)?;
        let before = acting.as_ref().and_then(serde_json::Value::as_f64);
        // Four digits: more is not known, and a person reads them.
        let gain = (1e4 * scale * before.unwrap_or(1.0)).round() / 1e4;
        if gain > MOST {
            return Err(AdoptError::TooLarge {
                path: short(&path),
                gain,
            });
        }
        gains.push(Difference {
            path: short(&path),
            acting,
            other: Some(gain.into()),
        });
    }
    for difference in &gains {
        if let Some(gain) = &difference.other {
            settings::set(client, &whole_path(&difference.path), &gain.to_string())?;
        }
    }
    Ok(Adopted { scale, gains })
}
