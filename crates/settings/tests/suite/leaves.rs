//! The table of all settings says what the tree and its validation do.

use std::collections::BTreeSet;

use quadrant_law::cancelling::CancellingSettings;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::filter::{FilterList, FilterSettings};
use quadrant_law::learning::LearningSettings;
use quadrant_settings::leaves::{LeafInfo, Range, all, find};
use quadrant_settings::tree::{TreeError, is_part};
use quadrant_settings::{PulseSettings, Reason, SerialSettings, SettingsError, StageSettings};
use serde_json::Value;

use quadrant_test_support::{get, is_whole, paths};

const ELEMENTS: usize = 8;

/// The simulated stage's, with the list that it leaves out.
fn settings() -> StageSettings {
    let mut settings = StageSettings::simulated();
    for axis in &mut settings.axes {
        axis.feedforward.learning = Some(LearningSettings::default());
        axis.feedforward.cancelling = Some(CancellingSettings::default());
        axis.encoder.serial = Some(SerialSettings::default());
        axis.encoder.offset_mm = Some(0.0);
        axis.pulses = Some(PulseSettings {
            step_mm: 5e-3,
            ..PulseSettings::default()
        });
        axis.feedback.filters = Some(FilterList::from_iter([FilterSettings::notch(
            1000.0, 0.2, 0.5,
        )]));
    }
    settings
}

/// All leaves of the tree with the axis as `*`, and the numbers of the lists' points with the point as `*`.
fn tree() -> BTreeSet<String> {
    let settings = settings();
    let mut found = BTreeSet::new();
    for path in paths(&settings, "") {
        let Some(below) = path.strip_prefix("/axes/0") else {
            if !path.starts_with("/axes/") {
                found.insert(path);
            }
            continue;
        };
        let json = get(&settings, &path).expect("listed");
        if is_part(&path) && json == "\"present\"" {
            continue;
        }
        found.insert(format!("/axes/*{below}"));
        let value: Value = serde_json::from_str(&json).expect("JSON");
        for point in value.as_array().into_iter().flatten() {
            for name in point.as_object().expect("a point").keys() {
                found.insert(format!("/axes/*{below}/*/{name}"));
            }
        }
    }
    found
}

#[test]
fn every_leaf_has_its_entry_and_every_entry_its_leaf() {
    let entries: BTreeSet<String> = all().map(|leaf| leaf.path().as_str().to_owned()).collect();
    let leaves = tree();
    let without_entry: Vec<_> = leaves.difference(&entries).collect();
    let without_leaf: Vec<_> = entries.difference(&leaves).collect();
    assert!(
        without_entry.is_empty() && without_leaf.is_empty(),
        "leaves without an entry in crates/settings/src/leaves: {without_entry:?}; entries without a leaf: {without_leaf:?}"
    );
    assert_eq!(all().count(), entries.len(), "an entry twice");
}

#[test]
fn every_entry_says_what_the_leaf_means() {
    for leaf in all() {
        assert!(
            leaf.meaning.ends_with('.') && leaf.meaning.len() > 2,
            "{}",
            leaf.path()
        );
        assert!(
            leaf.meaning.len() <= 160 && !leaf.meaning.contains(['\n', '|']),
            "{}",
            leaf.path()
        );
        // Of the leaf, or of what it is an end of.
        let unit_in_name = leaf
            .path()
            .rsplit('/')
            .take(2)
            .any(|name| name.contains('_'));
        if !leaf.unit.is_empty() {
            assert!(
                unit_in_name,
                "{} has a unit, but not in its name",
                leaf.path()
            );
        }
    }
}

#[test]
fn an_entry_is_found_by_its_path() {
    for path in [
        "/axes/*/feedback/pid/kp_v_per_mm",
        "/axes/x/feedback/pid/kp_v_per_mm",
        "/axes/2/feedback/pid/kp_v_per_mm",
    ] {
        assert_eq!(find(path).map(|leaf| leaf.unit), Some("V/mm"), "{path}");
    }
    let weight = find("/axes/y/friction/gms/elements/3/weight").expect("an entry");
    assert!(matches!(weight.range, Range::Number(..)));
    for path in ["", "/axes/x", "/axes/x/feedback/pid/kp_v_per_mm/0", "/rate"] {
        assert!(find(path).is_none(), "{path}");
    }
}

/// Writes a number into a leaf of the x axis; into the last point of a list.
fn write(settings: &mut StageSettings, path: &str, number: f64) -> Result<(), TreeError> {
    let path = path.replacen('*', "0", 1);
    let text = if is_whole(&path) {
        format!("{number:.0}")
    } else {
        serde_json::to_string(&number).expect("finite")
    };
    match path.split_once("/*/") {
        None => settings.set_json(&path, text.as_bytes())?,
        Some((list, name)) => {
            let mut points: Value = serde_json::from_str(&get(settings, list)?).expect("JSON");
            let point = points.as_array_mut().and_then(|points| points.last_mut());
            point.expect("a point")[name] = number.into();
            settings.set_json(list, points.to_string().as_bytes())?
        }
    };
    Ok(())
}

fn about(leaf: &LeafInfo, result: &Result<(), SettingsError>) -> Option<Reason> {
    let error = result.as_ref().err()?;
    (error.field == leaf.field).then_some(error.reason)
}

/// The law that alone reads a field.
pub(crate) fn law_of(field: &str) -> Option<LawKind> {
    let laws = [
        ("feedback.nonlinear.", LawKind::NPid),
        ("feedback.schedule.", LawKind::Scheduled),
        ("feedback.cascade.", LawKind::Cascade),
        ("feedback.sliding_mode.", LawKind::SlidingMode),
        ("feedback.nctf.", LawKind::Nctf),
    ];
    let found = laws.into_iter().find(|(part, _)| field.starts_with(part));
    found.map(|(_, law)| law)
}

#[test]
fn each_end_of_each_range_is_the_one_that_is_enforced() {
    let mut ends = 0;
    for leaf in all() {
        let Range::Number(least, most) = leaf.range else {
            continue;
        };
        let mut settings = settings();
        // An end that another setting decides is that of the law in force.
        if let Some(law) = law_of(leaf.field) {
            settings.axes[0].feedback.law = law;
        }
        let (least, most) = (least.value(&settings, 0), most.value(&settings, 0));
        assert!(least < most, "{}", leaf.path());
        let step: f64 = if is_whole(leaf.field) { 1.0 } else { 0.0 };
        for (end, away) in [(least, -1.0), (most, 1.0)] {
            let mut at_end = settings.clone();
            write(&mut at_end, &leaf.path(), end).expect("a number");
            let reason = about(leaf, &at_end.validate(ELEMENTS));
            let outside = matches!(reason, Some(Reason::OutOfRange { .. } | Reason::NotFinite));
            assert!(!outside, "{} = {end} is refused: {reason:?}", leaf.path());
            let beyond = end + away * step.max(1e-9 * f64::abs(end)).max(1e-12);
            if is_whole(leaf.field) && beyond < 0.0 {
                // The leaf's type has no such value.
                continue;
            }
            let mut outside = settings.clone();
            write(&mut outside, &leaf.path(), beyond).expect("a number");
            let reason = about(leaf, &outside.validate(ELEMENTS));
            let Some(Reason::OutOfRange {
                least: low,
                most: high,
            }) = reason
            else {
                panic!("{} = {beyond} is not refused: {reason:?}", leaf.path());
            };
            // What an end depends on may itself have been changed with it.
            let enforced = if away < 0.0 { low } else { high };
            let error = (enforced - end).abs();
            assert!(
                error <= 1e-12 * end.abs(),
                "{}: {enforced}, table {end}",
                leaf.path()
            );
            ends += 1;
        }
    }
    println!("{ends} ends of ranges provoked");
    assert!(ends > 100);
}

#[test]
fn each_list_has_the_room_that_is_said() {
    let mut lists = 0;
    for leaf in all() {
        let Range::List(most) = leaf.range else {
            continue;
        };
        lists += 1;
        let path = leaf.path().replacen('*', "0", 1);
        let mut settings = settings();
        let points: Value =
            serde_json::from_str(&get(&settings, &path).expect("a list")).expect("JSON");
        let first = points[0].clone();
        settings.set_json(&path, b"[]").expect("a list");
        let reason = about(leaf, &settings.validate(ELEMENTS));
        assert!(
            matches!(reason, Some(Reason::OutOfRange { least: 1.0, .. })),
            "{path}: {reason:?}"
        );
        for (count, fits) in [(most, true), (most + 1, false)] {
            let list = Value::Array(vec![first.clone(); count]).to_string();
            let written = settings.set_json(&path, list.as_bytes());
            let reason = about(leaf, &settings.validate(ELEMENTS));
            let too_many =
                written.is_err() || matches!(reason, Some(Reason::TooManyElements { .. }));
            assert_eq!(too_many, !fits, "{path}: {count} points");
        }
    }
    assert_eq!(lists, 4);
}

#[test]
fn each_name_is_understood_and_each_flag_is_one() {
    let mut settings = settings();
    for leaf in all() {
        let path = leaf.path().replacen('*', "0", 1);
        match leaf.range {
            Range::Name(names) => {
                for name in names {
                    let json = format!("{name:?}");
                    settings.set_json(&path, json.as_bytes()).expect("a name");
                    assert_eq!(get(&settings, &path), Ok(json));
                }
                let result = settings.set_json(&path, b"\"other\"");
                assert_eq!(result, Err(TreeError::Value));
            }
            Range::Flag => {
                for json in ["true", "false"] {
                    settings.set_json(&path, json.as_bytes()).expect("a flag");
                    assert_eq!(get(&settings, &path).as_deref(), Ok(json));
                }
            }
            Range::Number(..) | Range::List(_) => {}
        }
    }
}

#[test]
fn the_default_of_every_number_is_the_one_that_the_table_says() {
    let mut made = StageSettings::default();
    for path in paths(&StageSettings::simulated(), "/axes/x") {
        if is_part(&path) {
            made.set_json(&path, b"\"present\"").expect("a part");
        }
    }
    for leaf in all() {
        let Range::Number(..) = leaf.range else {
            continue;
        };
        let path = leaf.path().replacen('*', "0", 1);
        let value = match path.split_once("/*/") {
            None => get(&made, &path)
                .expect("a leaf")
                .parse()
                .expect("a number"),
            Some((list, name)) => {
                let points: Value =
                    serde_json::from_str(&get(&made, list).expect("a list")).expect("JSON");
                points[0][name].as_f64().expect("a number")
            }
        };
        assert_eq!(leaf.default, value, "{path}");
    }
}
