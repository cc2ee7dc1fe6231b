//! Requests to a machine by name, as the page makes them, and the messages of the link that they become.

use quadrant_link::heapless::{String as Bounded, Vec as BoundedList};
use quadrant_link::message::{
    AxisName, Body, Channel, MAX_CHANNELS, SERIAL_VALUES_PER_S, SettingsRequest, TelemetryRequest,
    Value as LeafValue,
};
use quadrant_settings::tree::expand;
use quadrant_sim::setting_value;
use serde::Deserialize;
use serde_json::Value;

/// Samples across a strip chart at most.
const MOST_SAMPLES: f64 = 3000.0;

/// A request: its name, or an object of its name and an object of its fields.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Ask {
    /// Opens the session: the machine's identity.
    Hello,
    /// State, axes and counters.
    Status,
    /// The digital inputs, and what keeps the outputs off.
    Inputs,
    /// The latched fault.
    Fault,
    /// Clears the latched fault.
    ResetFault,
    /// Switches the outputs on.
    Enable,
    /// Switches the outputs off.
    Disable,
    /// Brakes to rest.
    Stop,
    /// Homes axes.
    Home {
        /// The axes.
        axes: Vec<AxisName>,
    },
    /// Moves an axis at a velocity until it is stopped.
    Jog {
        /// The axis.
        axis: AxisName,
        /// The velocity, mm/s, with its sign.
        velocity_mm_s: f64,
    },
    /// Samples of these channels, as often as a chart of this width needs and a serial port carries.
    Watch {
        /// Names of the channels.
        channels: Vec<String>,
        /// Width of the chart, s.
        window_s: f64,
    },
    /// The paths of the settings, page by page.
    List {
        /// Zero, or where the page before ended.
        cursor: u16,
    },
    /// The paths at which the draft differs from the settings in force, page by page.
    Edited {
        /// Zero, or where the page before ended.
        cursor: u16,
    },
    /// A value of the draft.
    Get {
        /// Path of the setting.
        path: String,
    },
    /// A value that acts.
    GetInForce {
        /// Path of the setting.
        path: String,
    },
    /// Changes a value of the draft.
    Set {
        /// Path of the setting.
        path: String,
        /// Its value.
        value: Value,
    },
    /// Puts the draft in force.
    Apply,
    /// Replaces the draft by the settings in force.
    Revert,
    /// Stores the draft for the next start.
    Store {
        /// Its origin, for later readers.
        text: String,
    },
}

/// Control ticks from one sample to the next: few enough samples for the chart and for a serial port.
fn decimation(channels: usize, window_s: f64, rate_hz: f64) -> u16 {
    let ticks =
        (window_s * rate_hz / MOST_SAMPLES).max(channels as f64 * rate_hz / SERIAL_VALUES_PER_S);
    ticks.ceil().clamp(1.0, f64::from(u16::MAX)) as u16
}

fn bounded<const N: usize>(what: &str, text: &str) -> Result<Bounded<N>, String> {
    Bounded::try_from(text).map_err(|_| {
        format!(
            "{what}: {} bytes long, the link carries {N}; shorten it",
            text.len()
        )
    })
}

fn path(written: &str) -> Result<Bounded<96>, String> {
    expand(written).ok_or_else(|| format!("{written}: longer than any path"))
}

impl Ask {
    /// The message of the link; `rate_hz` is the machine's control rate.
    ///
    /// # Errors
    /// In words: a channel, a path or a value that there is not.
    pub fn body(&self, rate_hz: f64) -> Result<Body, String> {
        let settings = |request| Ok(Body::Settings(request));
        match self {
            Self::Hello => Ok(Body::Hello),
            Self::Status => Ok(Body::Status),
            Self::Inputs => Ok(Body::Inputs),
            Self::Fault => Ok(Body::Fault),
            Self::ResetFault => Ok(Body::ResetFault),
            Self::Enable => Ok(Body::Enable),
            Self::Disable => Ok(Body::Disable),
            Self::Stop => Ok(Body::Stop),
            Self::Home { axes } => Ok(Body::Home(axes.iter().copied().collect())),
            Self::Jog {
                axis,
                velocity_mm_s,
            } => Ok(Body::Jog {
                axis: *axis,
                velocity_mm_s: *velocity_mm_s,
            }),
            Self::Watch { channels, window_s } => watch(channels, *window_s, rate_hz),
            Self::List { cursor } => settings(SettingsRequest::List { cursor: *cursor }),
            Self::Edited { cursor } => settings(SettingsRequest::Edited { cursor: *cursor }),
            Self::Get { path: of } => settings(SettingsRequest::Get(path(of)?)),
            Self::GetInForce { path: of } => settings(SettingsRequest::GetInForce(path(of)?)),
            Self::Set { path: of, value } => {
                let json = value.to_string();
                let (kind, bytes) = setting_value::from_json(of, &json)
                    .map_err(|error| format!("{of} = {json}: {error}"))?;
                settings(SettingsRequest::Set {
                    path: path(of)?,
                    value: LeafValue { kind, bytes },
                })
            }
            Self::Apply => settings(SettingsRequest::Apply),
            Self::Revert => settings(SettingsRequest::Revert),
            Self::Store { text } => settings(SettingsRequest::Store(bounded("the origin", text)?)),
        }
    }
}

fn watch(names: &[String], window_s: f64, rate_hz: f64) -> Result<Body, String> {
    let mut channels = BoundedList::<Channel, MAX_CHANNELS>::new();
    for name in names {
        let channel = name.parse().map_err(|error| format!("{name}: {error}"))?;
        channels
            .push(channel)
            .map_err(|_| format!("{} channels; choose {MAX_CHANNELS} at most", names.len()))?;
    }
    Ok(Body::Telemetry(if channels.is_empty() {
        TelemetryRequest::Stop
    } else {
        TelemetryRequest::Select {
            decimation: decimation(channels.len(), window_s, rate_hz),
            channels,
        }
    }))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn body(request: Value) -> Result<Body, String> {
        let ask: Ask = serde_json::from_value(request).unwrap();
        ask.body(1e4)
    }

    #[test]
    fn names_and_units_of_the_page_are_those_of_the_link() {
        assert_eq!(body(json!("stop")), Ok(Body::Stop));
        assert_eq!(
            body(json!({"jog": {"axis": "y", "velocity_mm_s": -2.5}})),
            Ok(Body::Jog {
                axis: AxisName::Y,
                velocity_mm_s: -2.5
            })
        );
        let Ok(Body::Home(axes)) = body(json!({"home": {"axes": ["x", "z"]}})) else {
            panic!("no homing");
        };
        assert_eq!(u8::from(axes), 0b101);
    }

    #[test]
    fn samples_are_no_more_than_the_port_carries_and_the_chart_shows() {
        assert_eq!(decimation(8, 0.1, 1e4), 4);
        assert_eq!(decimation(1, 30.0, 1e4), 100);
        assert_eq!(decimation(1, 0.1, 1e4), 1);
    }

    #[test]
    fn what_the_link_has_no_room_for_is_refused_in_words() {
        let nine = vec!["x.error"; 9];
        for (request, part) in [
            (
                json!({"watch": {"channels": nine, "window_s": 5.0}}),
                "8 at most",
            ),
            (
                json!({"watch": {"channels": ["x.speed"], "window_s": 5.0}}),
                "no such channel",
            ),
            (json!({"store": {"text": "a".repeat(201)}}), "200"),
            (
                json!({"set": {"path": "/axes/0/feedback/pid/kp_v_per_mm", "value": "much"}}),
                "kp_v_per_mm = \"much\"",
            ),
        ] {
            let error = body(request.clone()).unwrap_err();
            assert!(error.contains(part), "{request}: {error}");
        }
    }
}
