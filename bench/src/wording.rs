//! The machine's answers as JSON for the page: names instead of numbers, times in s, errors in um.

use quadrant_link::message::{
    AxisName, AxisSet, AxisStatus, Event, FaultReport, INPUTS, Inputs, LimitedBy, Status,
};
use quadrant_settings::StageSettings;
use quadrant_settings::leaves::{Range, find};
use serde_json::{Value, json};

/// A control tick as the time since the start, s.
fn time_s(tick: u32, rate_hz: f64) -> f64 {
    f64::from(tick) / rate_hz
}

/// The names of some axes.
pub fn names(axes: AxisSet) -> Vec<&'static str> {
    axes.iter().map(AxisName::as_str).collect()
}

/// State, axes and counters.
pub fn status(status: &Status, rate_hz: f64) -> Value {
    let axes: Vec<Value> = AxisName::ALL
        .into_iter()
        .zip(&status.axes)
        .map(|(name, axis)| axis_status(name, axis, status.homed.contains(name)))
        .collect();
    json!({
        "time_s": time_s(status.tick, rate_hz),
        "state": status.state.as_str(),
        "drives": status.state.drives(),
        "at_rest": status.is_at_rest(),
        "fault": status.fault,
        "axes": axes,
        "overruns": status.overruns,
        "bad_frames": status.frames.damaged + status.frames.overlong + status.frames.undecodable,
        "dropped_samples": status.dropped_samples,
        "dropped_events": status.dropped_events,
    })
}

fn axis_status(name: AxisName, axis: &AxisStatus, is_homed: bool) -> Value {
    json!({
        "name": name.as_str(),
        "homed": is_homed,
        "mode": axis.mode,
        "position_mm": axis.position_mm,
        "error_um": 1e3 * axis.error_mm,
        "output_v": axis.output_v,
        "limited": axis.limited_by != LimitedBy::Nothing,
        "high_mark": axis.high_mark,
    })
}

/// Every input with its state, index pulses, and what keeps the outputs off.
pub fn inputs(inputs: &Inputs) -> Value {
    let each: Vec<Value> = INPUTS
        .iter()
        .map(|(name, bit)| json!({ "name": name, "active": inputs.switches & bit != 0 }))
        .collect();
    json!({ "inputs": each, "indexed": names(inputs.indexed), "refusal": inputs.refusal })
}

/// The latched fault, if there is one.
pub fn fault(fault: Option<&FaultReport>, rate_hz: f64) -> Value {
    fault.map_or(Value::Null, |fault| {
        json!({
            "code": fault.code,
            "name": fault.name,
            "axis": fault.axis,
            "time_s": time_s(fault.tick, rate_hz),
            "cause": fault.cause,
            "remedy": fault.remedy,
        })
    })
}

/// An event, in words.
pub fn event(tick: u32, event: &Event, rate_hz: f64) -> Value {
    json!({
        "time_s": time_s(tick, rate_hz),
        "text": event.to_string(),
        "concerns_fault": matches!(event, Event::Fault { .. } | Event::Stopping { .. } | Event::Held { .. }),
    })
}

/// A value with everything that the table of settings says of it. Bounds that are a share of another setting are those of
/// `settings`.
pub fn setting(path: &str, value: Value, settings: &StageSettings) -> Value {
    let Some(leaf) = find(path) else {
        return json!({ "path": path, "value": value, "kind": "part", "unit": "", "meaning": "" });
    };
    let axis = path
        .strip_prefix("/axes/")
        .and_then(|rest| rest.get(..1)?.parse().ok())
        .filter(|axis| *axis < settings.axes.len())
        .unwrap_or(0);
    let (kind, range, allowed) = match leaf.range {
        Range::Number(least, most) => {
            let range = [least, most].map(|bound| bound.value(settings, axis));
            ("number", Some(range), None)
        }
        Range::Flag => ("flag", None, None),
        Range::Name(names) => ("name", None, Some(names)),
        Range::List(_) => ("list", None, None),
    };
    json!({
        "path": path,
        "value": value,
        "kind": kind,
        "unit": leaf.unit,
        "range": range,
        "names": allowed,
        "meaning": leaf.meaning,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_reported_by_its_name() {
        let reported = inputs(&Inputs {
            tick: 0,
            switches: 1 << 15 | 1 << 6,
            indexed: AxisSet::NONE.with(AxisName::Z),
            refusal: None,
        });
        let active: Vec<&str> = reported["inputs"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|input| input["active"] == true)
            .map(|input| input["name"].as_str().unwrap())
            .collect();
        assert_eq!(active, ["emergency-stop", "y.positive-limit"]);
        assert_eq!(reported["indexed"], json!(["z"]));
    }

    #[test]
    fn a_setting_is_reported_with_unit_range_and_meaning() {
        let settings = StageSettings::simulated();
        let reported = setting("/axes/1/feedback/integral_limit_v", json!(2.0), &settings);
        assert_eq!(reported["unit"], "V");
        assert_eq!(
            reported["range"][1],
            settings.axes[1].amplifier.output_limit_v
        );
        assert!(
            reported["meaning"]
                .as_str()
                .unwrap()
                .starts_with("The integral")
        );
        let law = setting("/axes/0/feedback/law", json!("pid"), &settings);
        assert!(law["names"].as_array().unwrap().contains(&json!("n-pid")));
        assert_eq!(
            setting("/axes/0/feedback/nonlinear", json!(null), &settings)["kind"],
            "part"
        );
    }
}
