//! The tree of settings has every field, and nothing else.

use std::collections::BTreeSet;

use miniconf::{Internal, Schema, TreeSchema};
use quadrant_settings::tree::{MAX_PATH, expand, is_part};
use quadrant_settings::{AxisSettings, StageSettings};

use quadrant_test_support::{get, paths};

/// The JSON leaves of a tree, lists as one.
fn json_leaves(value: &serde_json::Value, path: &str, found: &mut BTreeSet<String>) {
    match value {
        serde_json::Value::Object(fields) => {
            for (name, value) in fields {
                json_leaves(value, &format!("{path}/{name}"), found);
            }
        }
        serde_json::Value::Array(axes) if path == "/axes" => {
            for (index, value) in axes.iter().enumerate() {
                json_leaves(value, &format!("{path}/{index}"), found);
            }
        }
        _ => {
            found.insert(path.to_owned());
        }
    }
}

#[test]
fn every_field_of_the_settings_file_is_a_leaf_and_the_other_way_round() {
    let settings = StageSettings::simulated();
    let tree = serde_json::to_value(&settings).expect("plain data");
    let mut fields = BTreeSet::new();
    json_leaves(&tree, "", &mut fields);
    let leaves: BTreeSet<String> = paths(&settings, "")
        .into_iter()
        .filter(|path| get(&settings, path).as_deref() != Ok("\"present\""))
        .collect();
    assert_eq!(leaves, fields);
}

#[test]
fn every_part_that_may_be_left_out_can_be() {
    fn absent(schema: &Schema, path: &str, found: &mut BTreeSet<String>) {
        if schema.sem().is_some_and(|sem| sem.maybe_absent()) {
            found.insert(path.to_owned());
        }
        if let Some(Internal::Named(fields)) = schema.internal() {
            for field in *fields {
                absent(field.schema(), &format!("{path}/{}", field.name()), found);
            }
        }
    }
    let mut found = BTreeSet::new();
    absent(AxisSettings::SCHEMA, "/axes/0", &mut found);
    let parts: BTreeSet<String> = paths(&StageSettings::simulated(), "/axes/x")
        .into_iter()
        .filter(|path| is_part(path))
        .collect();
    assert_eq!(parts, found);
}

#[test]
fn the_longest_path_has_room() {
    assert!(StageSettings::SCHEMA.max_length("/") < MAX_PATH);
}

#[test]
fn what_a_person_writes_for_a_path_becomes_the_whole_path() {
    for (written, whole) in [
        ("x/limits/silent_s", "/axes/0/limits/silent_s"),
        ("/axes/y/homing", "/axes/1/homing"),
        ("axes/2/plant", "/axes/2/plant"),
        ("z", "/axes/2"),
        ("0/plant", "/axes/0/plant"),
        ("rate_hz", "/rate_hz"),
        ("/streaming/underrun", "/streaming/underrun"),
        ("", "/"),
    ] {
        assert_eq!(expand(written).as_deref(), Some(whole), "{written}");
    }
    assert_eq!(expand(&"x".repeat(MAX_PATH + 1)), None);
}
