//! A setting's value as it crosses the link, and as JSON.

use quadrant::link::message::{MAX_VALUE_BYTES, Value};
use quadrant::settings::StageSettings;
use quadrant::settings::tree::TreeError;

/// Room for every value as JSON.
const JSON_BYTES: usize = 2048;

/// The value at a path of some settings, or whether a part that may be left out is there.
///
/// # Errors
/// A path that there is not, or one in a part that is left out.
pub fn of(settings: &StageSettings, path: &str) -> Result<Value, TreeError> {
    let mut value = Value::default();
    // Cannot fail: that is its capacity.
    let _ = value.bytes.resize_default(MAX_VALUE_BYTES);
    let (kind, length) = settings.get_bytes(path, &mut value.bytes)?;
    value.kind = kind;
    value.bytes.truncate(length);
    Ok(value)
}

/// A value of this path as JSON.
///
/// # Errors
/// A path that there is not, or a value that is none of it.
pub fn to_json(path: &str, value: &Value) -> Result<String, TreeError> {
    // Settings with every part, into which the value is put to read it as text.
    let mut own = StageSettings::simulated();
    own.set_bytes(path, value.kind, &value.bytes)?;
    let mut json = [0; JSON_BYTES];
    let length = own.get_json(path, &mut json)?;
    Ok(String::from_utf8_lossy(&json[..length]).into_owned())
}

/// The value of this path that JSON says.
///
/// # Errors
/// A path that there is not, or a value that is none of it.
pub fn from_json(path: &str, json: &str) -> Result<Value, TreeError> {
    let mut own = StageSettings::simulated();
    own.set_json(path, json.as_bytes())?;
    of(&own, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_the_same_after_it_has_crossed_the_link() {
        for (path, json) in [
            ("/axes/0/feedback/pid/kp_v_per_mm", "0.9"),
            ("/axes/1/feedback/law", "\"n-pid\""),
            ("/axes/2/feedback/nonlinear", "null"),
        ] {
            let value = from_json(path, json).unwrap();
            assert_eq!(to_json(path, &value).unwrap(), json, "{path}");
        }
        assert!(from_json("/axes/0/feedback/pid/kp_v_per_mm", "\"much\"").is_err());
        assert!(from_json("/axes/0/nothing", "1").is_err());
    }
}
