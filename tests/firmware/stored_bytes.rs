//! Settings as bytes: what comes back, and from which bytes.

use proptest::prelude::*;
use proptest::test_runner::Config;
use quadrant::store::{
    BUFFER_BYTES, DecodeError, FORMAT, PROVENANCE_BYTES, Provenance, decode, encode,
};
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::nctf::CharacteristicPoint;
use quadrant_law::control::schedule::SchedulePoint;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::gms::GmsElement;
use quadrant_settings::StageSettings;
use quadrant_settings::leaves::{Range, find};
use quadrant_settings::tree::{Path, is_part};
use serde::{Deserialize, Serialize};

use quadrant_fault_bench::flash::SECTOR;
use quadrant_test_support::{Noise, repeatable};
use quadrant_test_support::{get, is_whole, paths};

pub(crate) const ELEMENTS: usize = 8;

fn encoded(settings: &StageSettings, provenance: &str) -> Vec<u8> {
    let mut room = [0; BUFFER_BYTES];
    let length = encode(settings, provenance, &mut room).expect("fits");
    room[..length].to_vec()
}

/// The settings, their provenance, and what was reported.
type Decoded = Result<(StageSettings, Provenance, Vec<String>), DecodeError>;

fn decoded(bytes: &[u8]) -> Decoded {
    let mut findings = vec![];
    let mut settings = StageSettings {
        rate_hz: 77.0,
        ..StageSettings::simulated()
    };
    let result = decode(bytes, ELEMENTS, &mut settings, &mut |finding| {
        findings.push(format!("{finding:?}"));
    });
    if result.is_err() {
        assert_eq!(
            settings,
            StageSettings::default(),
            "refused settings leave a trace"
        );
    }
    result.map(|provenance| (settings, provenance, findings))
}

/// A record as `docs/settings-storage.md` has it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Record {
    shared: u8,
    suffix: String,
    kind: u8,
    axes: u8,
    #[serde(skip)]
    values: Vec<Vec<u8>>,
}

/// Format, provenance, and the records with their whole paths.
fn parse(bytes: &[u8]) -> ((u8, String), Vec<Record>) {
    let (head, mut rest) = postcard::take_from_bytes(bytes).expect("a head");
    let mut records = vec![];
    let mut path = String::new();
    while !rest.is_empty() {
        let (mut record, after): (Record, _) = postcard::take_from_bytes(rest).expect("a record");
        path.truncate(record.shared.into());
        path.push_str(&record.suffix);
        (record.shared, record.suffix) = (0, path.clone());
        rest = after;
        let count = if record.kind == 0 {
            0
        } else {
            record.axes.count_ones()
        };
        for _ in 0..count {
            let (value, after) = postcard::take_from_bytes(rest).expect("a value");
            record.values.push(value);
            rest = after;
        }
        records.push(record);
    }
    (head, records)
}

/// The other way, with nothing shared between paths.
fn assemble(head: &(u8, String), records: &[Record]) -> Vec<u8> {
    let mut bytes = postcard::to_stdvec(head).expect("writes");
    for record in records {
        bytes.extend(postcard::to_stdvec(record).expect("writes"));
        for value in &record.values {
            bytes.extend(postcard::to_stdvec(value).expect("writes"));
        }
    }
    bytes
}

/// A change to one record of the default settings' set.
fn with_record(path: &str, change: impl FnOnce(&mut Record)) -> Vec<u8> {
    let (head, mut records) = parse(&encoded(&StageSettings::simulated(), ""));
    let named = |record: &&mut Record| record.suffix == path && record.kind != 0;
    change(records.iter_mut().find(named).expect("a record"));
    assemble(&head, &records)
}

/// Settings unlike the default ones in everything that chance picks, valid or not.
pub(crate) fn varied(seed: u64) -> StageSettings {
    let mut noise = Noise::new(seed);
    let mut settings = StageSettings::simulated();
    for path in paths(&settings, "") {
        if is_part(&path) && noise.bits() >> 20 & 7 == 0 {
            settings.set_json(&path, b"null").expect("a part");
        }
    }
    for path in paths(&settings.clone(), "") {
        let axis: usize = path[6..]
            .chars()
            .next()
            .and_then(|axis| axis.to_digit(10))
            .unwrap_or(0) as usize;
        let chance = noise.bits() >> 9;
        let json = match find(&path).map(|leaf| leaf.range) {
            Some(Range::Flag) => (chance & 1 == 0).to_string(),
            Some(Range::Name(names)) => format!("{:?}", names[chance as usize % names.len()]),
            Some(Range::Number(least, most)) if !is_whole(&path) => {
                let json = get(&settings, &path).expect("a leaf");
                if json == "null" {
                    continue;
                }
                let number: f64 = json.parse().expect("a number");
                let other = number * (1.0 + 1e-5 * ((chance % 1000) as f64 - 500.0));
                let range = (least.value(&settings, axis), most.value(&settings, axis));
                other.clamp(range.0, range.1).to_string()
            }
            _ => continue,
        };
        settings
            .set_json(&path, json.as_bytes())
            .expect("of its type");
    }
    settings
}

proptest! {
    #![proptest_config(Config { max_global_rejects: 20_000, ..repeatable(200) })]

    #[test]
    fn any_valid_settings_come_back_as_they_were(seed: u64, provenance in "[ -~]{0,200}") {
        let settings = varied(seed);
        prop_assume!(settings.validate(ELEMENTS).is_ok());
        let (back, from, findings) = decoded(&encoded(&settings, &provenance)).expect("its own bytes");
        prop_assert_eq!(back, settings);
        prop_assert_eq!(from.as_str(), provenance);
        prop_assert!(findings.is_empty(), "{:?}", findings);
    }

    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = decoded(&bytes);
        let mut bytes = bytes;
        bytes.splice(0..0, [FORMAT, 0]);
        let _ = decoded(&bytes);
    }

    #[test]
    fn no_garbled_set_panics(place: prop::sample::Index, byte: u8) {
        let mut bytes = encoded(&StageSettings::simulated(), "from somewhere");
        let place = place.index(bytes.len());
        bytes[place] = byte;
        let _ = decoded(&bytes);
        let _ = decoded(&bytes[..place]);
    }
}

#[test]
fn the_paths_are_written_once_for_all_axes() {
    let ((format, provenance), records) = parse(&encoded(&StageSettings::simulated(), "here"));
    assert_eq!((format, provenance.as_str()), (1, "here"));
    let gain = records
        .iter()
        .find(|record| record.suffix == "/axes/*/feedback/pid/kp_v_per_mm");
    let gain = gain.expect("a record");
    let values: Vec<f64> = gain
        .values
        .iter()
        .map(|value| postcard::from_bytes(value).expect("a number"))
        .collect();
    assert_eq!((gain.axes, values), (7, vec![1.118, 1.31, 1.669]));
}

#[test]
fn what_is_unknown_is_skipped_and_reported() {
    let (head, mut records) = parse(&encoded(&StageSettings::simulated(), ""));
    let new = |suffix: &str, kind, axes: u8| Record {
        shared: 0,
        suffix: suffix.to_owned(),
        kind,
        axes,
        values: vec![
            vec![1, 2, 3];
            if kind == 0 {
                0
            } else {
                axes.count_ones() as usize
            }
        ],
    };
    records.insert(3, new("/axes/*/feedback/adaptive", 0, 7));
    records.insert(20, new("/axes/*/feedback/pid/feel", 200, 5));
    records.push(new("/spindle/speed", 4, 1));
    records.push(new("/axes/*/feedback", 4, 7));
    let (settings, _, findings) = decoded(&assemble(&head, &records)).expect("understood");
    assert_eq!(settings, StageSettings::simulated());
    assert_eq!(
        findings,
        [
            r#"Unknown("/axes/*/feedback/adaptive")"#,
            r#"Unknown("/axes/*/feedback/pid/feel")"#,
            r#"Unknown("/spindle/speed")"#,
            r#"Unknown("/axes/*/feedback")"#,
        ]
    );
}

#[test]
fn what_is_missing_has_its_default_and_is_reported() {
    let mut original = StageSettings::simulated();
    for axis in &mut original.axes {
        axis.feedback.transfer_s = 0.2;
        axis.feedforward.gains.level = 0.5;
    }
    let (head, mut records) = parse(&encoded(&original, ""));
    records.retain(|record| {
        !["/axes/*/feedback/transfer_s", "/rate_hz", "/axes/*/plant"]
            .contains(&record.suffix.as_str())
    });
    let level = records
        .iter_mut()
        .find(|record| record.suffix.ends_with("gains/level"));
    let level = level.expect("a record");
    level.axes = 0b101;
    level.values.remove(1);
    let (settings, _, findings) = decoded(&assemble(&head, &records)).expect("understood");
    let default = StageSettings::default();
    let mut expected = original;
    for (axis, default) in expected.axes.iter_mut().zip(&default.axes) {
        axis.feedback.transfer_s = default.feedback.transfer_s;
    }
    expected.axes[1].feedforward.gains.level = default.axes[1].feedforward.gains.level;
    assert_eq!(settings, expected);
    let mut findings = findings;
    findings.sort();
    assert_eq!(
        findings,
        [
            r#"Missing("/axes/*/plant")"#,
            r#"Missing("/axes/0/feedback/transfer_s")"#,
            r#"Missing("/axes/1/feedback/transfer_s")"#,
            r#"Missing("/axes/1/feedforward/gains/level")"#,
            r#"Missing("/axes/2/feedback/transfer_s")"#,
            r#"Missing("/rate_hz")"#,
        ]
    );
}

#[test]
fn a_value_of_another_type_refuses_the_set_and_names_the_path() {
    let named = |path: &str| Err(DecodeError::Type(Path::try_from(path).expect("fits")));
    let gain = "/axes/*/feedback/pid/kp_v_per_mm";
    // Another kind, a value too short, one too long.
    assert_eq!(
        decoded(&with_record(gain, |record| record.kind = 5)),
        named("/axes/0/feedback/pid/kp_v_per_mm")
    );
    let short = with_record(gain, |record| record.values[1].truncate(4));
    assert_eq!(decoded(&short), named("/axes/1/feedback/pid/kp_v_per_mm"));
    let long = with_record(gain, |record| record.values[2].push(0));
    assert_eq!(decoded(&long), named("/axes/2/feedback/pid/kp_v_per_mm"));
    let law = with_record("/axes/*/feedback/law", |record| {
        record.values[2] = postcard::to_stdvec("fuzzy").expect("writes");
    });
    assert_eq!(decoded(&law), named("/axes/2/feedback/law"));
}

#[test]
fn a_value_out_of_its_range_refuses_the_set() {
    let gain = with_record("/axes/*/feedback/pid/kp_v_per_mm", |record| {
        record.values[1] = postcard::to_stdvec(&-1.0).expect("writes");
    });
    let Err(DecodeError::Refused(error)) = decoded(&gain) else {
        panic!("a negative gain");
    };
    assert_eq!(
        error.to_string(),
        "y/feedback/pid/kp_v_per_mm = -1 is outside 0 to 10000"
    );
}

#[test]
fn another_format_is_refused() {
    let mut bytes = encoded(&StageSettings::simulated(), "");
    for format in [0, 2, 255] {
        bytes[0] = format;
        assert_eq!(decoded(&bytes), Err(DecodeError::Format(format)));
    }
    assert_eq!(decoded(&[]), Err(DecodeError::Malformed));
}

/// Bytes of the first release: every later release reads them. Beside them is what they say.
#[test]
fn a_set_of_the_first_release_is_read() {
    let (settings, provenance, findings) =
        decoded(include_bytes!("data/settings-format-1.bin")).expect("understood");
    assert_eq!(provenance, "quadrant commission --axis x, 0.1.0, frf.csv");
    let mut lines = 0;
    for line in include_str!("data/settings-format-1.txt").lines() {
        let (path, value) = line.split_once(' ').expect("a path and a value");
        assert_eq!(get(&settings, path).as_deref(), Ok(value), "{path}");
        lines += 1;
    }
    assert!(lines > 150, "{lines}");
    // It is stored under a former name.
    assert!(
        !findings
            .iter()
            .any(|finding| finding.contains("presliding")),
        "{findings:?}"
    );
    let unknown = findings
        .iter()
        .filter(|finding| finding.starts_with("Unknown"));
    assert_eq!(
        unknown.count(),
        0,
        "a setting of the first release is gone: {findings:?}"
    );
}

/// The longest settings there can be, and the longest provenance.
#[test]
fn the_buffer_holds_any_settings() {
    let mut settings = StageSettings::simulated();
    for axis in &mut settings.axes {
        axis.feedback.law = LawKind::SlidingMode;
        axis.feedforward.kind = FeedforwardKind::SmoothedGms;
        let (weight, stiffness_v_per_mm) = (0.1, 1.0);
        axis.friction.gms.elements = [GmsElement {
            stiffness_v_per_mm,
            weight,
        }; 10]
            .into_iter()
            .collect();
        let schedule = axis.feedback.schedule.as_mut().expect("by default");
        *schedule =
            std::iter::repeat_n(schedule[0], 4).collect::<heapless::Vec<SchedulePoint, 4>>();
        let nctf = axis.feedback.nctf.as_mut().expect("by default");
        nctf.characteristic = std::iter::repeat_n(nctf.characteristic[0], 16)
            .collect::<heapless::Vec<CharacteristicPoint, 16>>();
    }
    let longest = encoded(&settings, &"x".repeat(PROVENANCE_BYTES)).len();
    let usual = encoded(&StageSettings::simulated(), "quadrant commission --axis x").len();
    println!("longest set {longest} bytes, default set {usual} bytes, room {BUFFER_BYTES}");
    // The sequence number, and as much again as one more list on each axis.
    assert!(longest + 4 + 3 * 320 <= BUFFER_BYTES, "{longest}");
    // Two of the longest fit into a sector, or every store would erase.
    assert!(2 * (longest + 16) <= SECTOR - 8, "{longest}");
}
