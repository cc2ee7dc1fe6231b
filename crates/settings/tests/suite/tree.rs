//! Settings by path, as JSON values.

use proptest::prelude::*;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_settings::StageSettings;
use quadrant_settings::tree::{MAX_VALUE_BYTES, TreeError, is_part};

use quadrant_test_support::{get, paths, repeatable};

/// Settings with no part that may be left out.
fn bare() -> StageSettings {
    let mut settings = StageSettings::simulated();
    let all = paths(&settings, "");
    for path in all.iter().filter(|path| is_part(path)) {
        settings.set_json(path, b"null").expect("a part");
    }
    settings
}

#[test]
fn a_leaf_is_read_and_written_by_its_path() {
    let mut settings = StageSettings::simulated();
    assert_eq!(get(&settings, "/rate_hz").as_deref(), Ok("10000.0"));
    let path = "/axes/y/feedback/pid/kp_v_per_mm";
    assert_eq!(get(&settings, path).as_deref(), Ok("1.31"));
    assert_eq!(settings.set_json(path, b"1.25e0"), Ok(Some(1)));
    assert_eq!(settings.axes[1].feedback.pid.kp_v_per_mm, 1.25);
    assert_eq!(
        settings.set_json("/axes/2/encoder/reversed", b"true"),
        Ok(Some(2))
    );
    assert!(settings.axes[2].encoder.reversed);
    assert_eq!(settings.set_json("/rate_hz", b"8000"), Ok(None));
    assert_eq!(settings.rate_hz, 8000.0);
}

#[test]
fn letters_and_numbers_name_the_same_axes() {
    let settings = StageSettings::simulated();
    for (letter, number) in [("x", "0"), ("y", "1"), ("z", "2")] {
        let gain = |axis: &str| {
            get(
                &settings,
                &format!("/axes/{axis}/feedback/pid/kd_v_s_per_mm"),
            )
        };
        assert_eq!(gain(letter), gain(number));
    }
}

#[test]
fn laws_and_kinds_go_by_their_names_as_in_settings_files() {
    let mut settings = StageSettings::simulated();
    for law in [
        LawKind::Pd,
        LawKind::Pid,
        LawKind::NPid,
        LawKind::Scheduled,
        LawKind::Cascade,
        LawKind::SlidingMode,
        LawKind::Nctf,
    ] {
        let name = serde_json::to_string(&law).expect("plain data");
        settings
            .set_json("/axes/x/feedback/law", name.as_bytes())
            .expect("a law");
        assert_eq!(settings.axes[0].feedback.law, law);
        assert_eq!(get(&settings, "/axes/x/feedback/law"), Ok(name));
    }
    for kind in [
        FeedforwardKind::None,
        FeedforwardKind::Static,
        FeedforwardKind::Gms,
        FeedforwardKind::Combined,
        FeedforwardKind::Dahl,
        FeedforwardKind::Lugre,
        FeedforwardKind::SmoothedGms,
    ] {
        let name = serde_json::to_string(&kind).expect("plain data");
        settings
            .set_json("/axes/z/feedforward/kind", name.as_bytes())
            .expect("a kind");
        assert_eq!(settings.axes[2].feedforward.kind, kind);
        assert_eq!(get(&settings, "/axes/z/feedforward/kind"), Ok(name));
    }
    assert_eq!(
        settings.set_json("/axes/x/feedback/law", b"\"pi\""),
        Err(TreeError::Value)
    );
    assert_eq!(
        settings.set_json("/axes/x/feedback/law", b"2"),
        Err(TreeError::Value)
    );
}

#[test]
fn a_part_is_removed_and_made_by_its_path() {
    let mut settings = StageSettings::simulated();
    for path in [
        "/axes/y/plant",
        "/axes/y/feedback/nonlinear",
        "/axes/y/friction/dahl",
    ] {
        assert_eq!(get(&settings, path).as_deref(), Ok("\"present\""));
        settings.set_json(path, b"null").expect("a part");
        assert_eq!(get(&settings, path).as_deref(), Ok("null"));
    }
    assert!(settings.axes[1].plant.is_none() && settings.axes[1].feedback.nonlinear.is_none());
    let leaf = "/axes/y/plant/delay_s";
    assert_eq!(get(&settings, leaf), Err(TreeError::Absent));
    assert_eq!(settings.set_json(leaf, b"0.001"), Err(TreeError::Absent));
    settings
        .set_json("/axes/y/plant", b"\"present\"")
        .expect("a part");
    let error = settings
        .validate(4)
        .expect_err("A must be given before the settings are valid");
    assert_eq!(error.field, "plant.gain_mm_per_v_s2");
    settings.set_json(leaf, b"0.001").expect("present now");
    settings
        .set_json("/axes/y/plant", b"\"present\"")
        .expect("a part");
    let delay = settings.axes[1].plant.expect("present").delay_s;
    assert_eq!(delay, 0.001, "a part that is there is left as it is");
}

#[test]
fn a_list_is_one_value_and_makes_itself() {
    let mut settings = bare();
    let schedule = "/axes/x/feedback/schedule";
    assert_eq!(get(&settings, schedule).as_deref(), Ok("null"));
    let points = br#"[{"speed_mm_s":0.0,"proportional":1.0,"integral":3.5,"derivative":1.0}]"#;
    assert_eq!(settings.set_json(schedule, b"[{}]"), Err(TreeError::Value));
    assert_eq!(
        get(&settings, schedule).as_deref(),
        Ok("null"),
        "a bad list makes nothing"
    );
    settings.set_json(schedule, points).expect("a list");
    assert_eq!(get(&settings, schedule).expect("a list").as_bytes(), points);
    let elements = "/axes/x/friction/gms/elements";
    let one = br#"[{"stiffness_v_per_mm":7.5,"weight":1.0}]"#;
    settings.set_json(elements, one).expect("a list");
    assert_eq!(settings.axes[0].friction.gms.elements.len(), 1);
    let many = format!(
        "[{}]",
        [r#"{"stiffness_v_per_mm":1.0,"weight":0.1}"#; 11].join(",")
    );
    assert_eq!(
        settings.set_json(elements, many.as_bytes()),
        Err(TreeError::Value)
    );
    assert_eq!(settings.axes[0].friction.gms.elements.len(), 1);
}

#[test]
fn what_is_no_setting_is_distinguished_from_what_holds_several() {
    let mut settings = StageSettings::simulated();
    for path in [
        "",
        "rate_hz",
        "/rate",
        "/rate_hz/x",
        "/axes/w/plant",
        "/axes/3/plant/delay_s",
        "/axes/xx/plant",
        "/axes/x/feedback/pid/kp",
        "axes/x/feedback/law",
        "/axes/x/encoder/reversed/0",
        "//",
        "/axes/00/plant/delay_s",
    ] {
        assert_eq!(get(&settings, path), Err(TreeError::NotFound), "{path}");
        assert_eq!(
            settings.set_json(path, b"1"),
            Err(TreeError::NotFound),
            "{path}"
        );
    }
    for path in [
        "/axes",
        "/axes/x",
        "/axes/x/feedback",
        "/axes/x/friction/sliding/positive",
    ] {
        assert_eq!(get(&settings, path), Err(TreeError::NotALeaf), "{path}");
        assert_eq!(
            settings.set_json(path, b"null"),
            Err(TreeError::NotALeaf),
            "{path}"
        );
    }
    assert_eq!(
        settings.set_json("/axes/x/plant", b"{}"),
        Err(TreeError::NotALeaf)
    );
    assert_eq!(settings, StageSettings::simulated());
}

#[test]
fn values_that_are_none_change_nothing() {
    let mut settings = StageSettings::simulated();
    for json in ["", "nan", "1,2", "\"1\"", "true", "1 2", "{", "[1]"] {
        let result = settings.set_json("/axes/x/feedback/pid/kp_v_per_mm", json.as_bytes());
        assert_eq!(result, Err(TreeError::Value), "{json}");
    }
    for json in ["-1", "256", "1.5", "null"] {
        let result = settings.set_json("/axes/x/encoder/counter_bits", json.as_bytes());
        assert_eq!(result, Err(TreeError::Value), "{json}");
    }
    assert_eq!(settings, StageSettings::simulated());
}

#[test]
fn an_answer_that_does_not_fit_is_an_error_of_its_own() {
    let settings = StageSettings::simulated();
    for path in ["/rate_hz", "/axes/x/plant", "/axes/x/friction/gms/elements"] {
        let result = settings.get_json(path, &mut [0; 3]);
        assert_eq!(result, Err(TreeError::NoRoom), "{path}");
    }
}

#[test]
fn a_list_of_paths_is_complete_without_repetition_and_can_be_limited() {
    let settings = StageSettings::simulated();
    let all = paths(&settings, "");
    assert_eq!(
        all.iter().collect::<std::collections::BTreeSet<_>>().len(),
        all.len()
    );
    for path in &all {
        get(&settings, path).expect("listed");
    }
    let of_x = paths(&settings, "/axes/x");
    // The rate, three of operation, two of the brake, and two of streams.
    assert_eq!(3 * of_x.len() + 8, all.len());
    let pid = paths(&settings, "/axes/x/feedback/pid");
    assert_eq!(pid.len(), 4, "{pid:?}");
    assert_eq!(paths(&settings, "/axes/y/plant").len(), 5);
    assert_eq!(paths(&bare(), "/axes/y/plant"), ["/axes/1/plant"]);
    let mut none = vec![];
    let result = settings.list("/axes/x/plan", &mut |path| none.push(path.to_owned()));
    assert_eq!((result, none), (Err(TreeError::NotFound), vec![]));
}

/// As the console's `dump` and `load` do.
#[test]
fn a_dump_makes_the_same_settings_again() {
    for original in [StageSettings::simulated(), bare()] {
        let mut copy = if original == bare() {
            StageSettings::simulated()
        } else {
            bare()
        };
        copy.rate_hz = 1234.0;
        for path in paths(&original, "") {
            let value = get(&original, &path).expect("listed");
            copy.set_json(&path, value.as_bytes()).expect("dumped");
        }
        assert_eq!(copy, original);
    }
}

/// As a host does that leaves JSON to itself.
#[test]
fn a_dump_in_bytes_makes_the_same_settings_again() {
    let mut longest = 0;
    for original in [StageSettings::simulated(), bare()] {
        let mut copy = if original == bare() {
            StageSettings::simulated()
        } else {
            bare()
        };
        copy.rate_hz = 1234.0;
        for path in paths(&original, "") {
            let mut buffer = [0; MAX_VALUE_BYTES];
            let (kind, length) = original.get_bytes(&path, &mut buffer).expect("listed");
            longest = longest.max(length);
            let axis = copy
                .set_bytes(&path, kind, &buffer[..length])
                .expect("dumped");
            assert_eq!(axis.is_none(), !path.starts_with("/axes"), "{path}");
        }
        assert_eq!(copy, original);
    }
    assert!(longest > 64, "{longest}");
}

#[test]
fn bytes_of_another_kind_or_length_change_nothing() {
    let mut settings = StageSettings::simulated();
    let gain = "/axes/x/feedback/pid/kp_v_per_mm";
    let one = 1.0f64.to_le_bytes();
    for (path, kind, bytes) in [
        (gain, 5, &one[..]),
        (gain, 4, &one[..7]),
        (gain, 4, &[0; 9]),
        (gain, 0, &[1]),
        (gain, 0, &[0]),
        ("/axes/x/encoder/reversed", 2, &[2]),
        ("/axes/x/feedback/law", 3, &[1]),
        ("/axes/x/feedback/law", 3, b"\x02pi"),
        ("/axes/x/feedback/schedule", 1, &[9]),
    ] {
        let result = settings.set_bytes(path, kind, bytes);
        assert_eq!(result, Err(TreeError::Value), "{path} {kind} {bytes:?}");
    }
    assert_eq!(
        settings.set_bytes("/axes/x/plant", 0, &[2]),
        Err(TreeError::NotALeaf)
    );
    assert_eq!(
        settings.set_bytes("/axes/x", 0, &[1]),
        Err(TreeError::NotALeaf)
    );
    assert_eq!(settings, StageSettings::simulated());
    assert_eq!(settings.set_bytes(gain, 4, &one), Ok(Some(0)));
    assert_eq!(settings.axes[0].feedback.pid.kp_v_per_mm, 1.0);
}

proptest! {
    #![proptest_config(repeatable(2000))]

    #[test]
    fn any_finite_number_comes_back_to_the_last_bit(bits: u64) {
        let number = f64::from_bits(bits);
        prop_assume!(number.is_finite());
        let mut settings = StageSettings::simulated();
        let json = serde_json::to_string(&number).expect("finite");
        settings.set_json("/axes/x/feedback/transfer_s", json.as_bytes()).expect("a number");
        let read = get(&settings, "/axes/x/feedback/transfer_s").expect("a leaf");
        let back: f64 = serde_json::from_str(&read).expect("a number");
        prop_assert_eq!(settings.axes[0].feedback.transfer_s.to_bits(), bits);
        prop_assert_eq!(back.to_bits(), bits);
    }

    #[test]
    fn no_path_and_no_value_panics(path in "(/axes/[xyz0-9]{0,2})?(/[a-z_]{0,12}){0,5}", json in any::<Vec<u8>>()) {
        let mut settings = StageSettings::simulated();
        let _ = settings.get_json(&path, &mut [0; 64]);
        let _ = settings.list(&path, &mut |_| {});
        if settings.set_json(&path, &json).is_err() {
            prop_assert_eq!(settings, StageSettings::simulated());
        }
    }
}
