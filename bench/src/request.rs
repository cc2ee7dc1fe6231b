//! Requests of the page and their replies, as JSON.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::bench::{AXIS_SIGNALS, Bench, BenchMotion, MOTION, SAMPLE_TICKS, SIGNALS};
use crate::controls::Controls;
use crate::loop_response::LoopResponse;
use crate::truth::KNOBS;

/// The repository's example of a stage.
const EXAMPLE: &str = include_str!("../../examples/stage.toml");

/// A request: its name, or an object of its name and an object of its fields.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// The signals of a sample, the sample rate, the knobs of the stage and the numbers of the motion.
    Describe,
    /// Settings offered for an axis, 0 to 2; with the motion, the knobs' values and the fault.
    Show {
        /// The axis.
        axis: usize,
    },
    /// Sets a setting.
    Set {
        /// Path of the setting.
        path: String,
        /// Its value.
        value: Value,
    },
    /// Chooses feedback law and feedforward of all axes.
    Choose {
        /// Name of the feedback law.
        law: String,
        /// Name of the feedforward.
        feedforward: String,
    },
    /// Turns a knob of the stage.
    Turn {
        /// Name of the knob.
        knob: String,
        /// Its value.
        value: f64,
    },
    /// Sets the law's friction to the stage's own.
    TellFriction,
    /// Starts another motion.
    Start {
        /// The motion.
        motion: BenchMotion,
    },
    /// Starts again from rest.
    Restart,
    /// Puts law, stage and motion as they were when the page was opened.
    Reset,
    /// Takes the settings or the stage of a file; the reply says in words what it did.
    Load {
        /// The file's text.
        text: String,
        /// The file's name.
        name: String,
    },
    /// The text of the example of a stage's file.
    Example,
    /// The settings as a file's text.
    Save,
    /// The open loop of an axis, 0 to 2.
    Loop {
        /// The axis.
        axis: usize,
    },
}

/// Reply to [`Request::Show`].
#[derive(Serialize)]
struct Shown {
    controls: Controls,
    knobs: Vec<f64>,
    motion: BenchMotion,
    fault: Option<String>,
}

/// Answers a request: `{"ok": ...}`, or `{"error": "..."}` with the reason in words.
pub fn answer(bench: &mut Bench, request: &[u8]) -> Vec<u8> {
    let request = serde_json::from_slice(request).map_err(|error| error.to_string());
    let reply = match request.and_then(|request| act(bench, request)) {
        Ok(value) => json!({ "ok": value }),
        Err(error) => json!({ "error": error }),
    };
    reply.to_string().into_bytes()
}

fn act(bench: &mut Bench, request: Request) -> Result<Value, String> {
    match request {
        Request::Describe => {
            return Ok(json!({
                "signals": SIGNALS,
                "axis_signals": AXIS_SIGNALS,
                "rate_hz": bench.settings().rate_hz,
                "sample_ticks": SAMPLE_TICKS,
                "knobs": KNOBS,
                "motion": MOTION,
            }));
        }
        Request::Show { axis } => {
            let shown = Shown {
                controls: Controls::of(bench.settings(), known(axis)?),
                knobs: bench.truth().values().to_vec(),
                motion: bench.motion(),
                fault: bench.fault(),
            };
            return serde_json::to_value(shown).map_err(|error| error.to_string());
        }
        Request::Loop { axis } => {
            let found = LoopResponse::of(bench.settings(), &bench.truth().stage(), known(axis)?);
            return serde_json::to_value(found).map_err(|error| error.to_string());
        }
        Request::Load { text, name } => return Ok(Value::String(bench.load(&text, &name)?)),
        Request::Example => return Ok(Value::String(EXAMPLE.to_owned())),
        Request::Save => return Ok(Value::String(bench.save()?)),
        Request::Set { path, value } => bench.set(&path, &value.to_string())?,
        Request::Choose { law, feedforward } => bench.choose(&law, &feedforward)?,
        Request::Turn { knob, value } => bench.turn(&knob, value)?,
        Request::TellFriction => bench.set_true_friction()?,
        Request::Start { motion } => bench.start(motion)?,
        Request::Restart => bench.restart(),
        Request::Reset => *bench = Bench::default(),
    }
    Ok(Value::Null)
}

/// The axis, if there is one of this number.
fn known(axis: usize) -> Result<usize, String> {
    if axis < 3 {
        Ok(axis)
    } else {
        Err(format!("there is no axis {axis}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(bench: &mut Bench, request: &Value) -> Value {
        serde_json::from_slice(&answer(bench, request.to_string().as_bytes())).unwrap()
    }

    #[test]
    fn every_law_and_feedforward_that_is_offered_can_be_chosen() {
        let mut bench = Bench::default();
        let shown = ask(&mut bench, &json!({"show": {"axis": 0}}));
        let controls = &shown["ok"]["controls"];
        for law in controls["laws"].as_array().unwrap() {
            for feedforward in controls["feedforwards"].as_array().unwrap() {
                let choice =
                    json!({"choose": {"law": law["name"], "feedforward": feedforward["name"]}});
                assert!(ask(&mut bench, &choice)["error"].is_null(), "{choice}");
                let shown = ask(&mut bench, &json!({"show": {"axis": 2}}));
                assert_eq!(shown["ok"]["controls"]["law"], law["name"]);
            }
        }
    }

    #[test]
    fn the_example_of_a_stage_can_be_loaded_as_it_is() {
        let mut bench = Bench::default();
        let example = ask(&mut bench, &json!("example"));
        let load = json!({"load": {"text": example["ok"], "name": "stage.toml"}});
        let said = ask(&mut bench, &load);
        assert!(
            said["ok"]
                .as_str()
                .unwrap()
                .starts_with("stage.toml: the stage is yours")
        );
    }

    #[test]
    fn what_cannot_be_done_is_reported_in_words() {
        let mut bench = Bench::default();
        for request in [
            json!("dance"),
            json!({"show": {"axis": 3}}),
            json!({"turn": {"knob": "mass", "value": 9.0}}),
            json!({"choose": {"law": "pid", "feedforward": "magic"}}),
        ] {
            let reply = ask(&mut bench, &request);
            assert!(reply["error"].is_string(), "{request}: {reply}");
        }
    }
}
