//! The form of all campaigns: seeds, parts, files of results that go on and are merged.

use std::fs;
use std::path::Path;

use crate::command::{fail, succeed};

fn faults(folder: &Path, arguments: &[&str]) -> String {
    succeed(folder, &[&["faults"], arguments].concat())
}

fn lines(folder: &Path, name: &str) -> Vec<String> {
    let text = fs::read_to_string(folder.join(name)).unwrap();
    text.lines().map(str::to_owned).collect()
}

#[test]
fn a_campaign_goes_on_where_it_stopped_and_its_parts_are_summed_up() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let whole = faults(at, &["--seeds", "1+12"]);
    assert!(whole.contains("12 random faults"), "{whole}");
    let kept = lines(at, "faults.csv");
    assert_eq!(kept.len(), 13);

    fs::write(at.join("faults.csv"), kept[..5].join("\n") + "\n").unwrap();
    assert_eq!(faults(at, &["--seeds", "1+12"]), whole);
    let mut again = lines(at, "faults.csv");
    assert_eq!(again[..5], kept[..5]);
    let mut expected = kept.clone();
    again.sort();
    expected.sort();
    assert_eq!(again, expected);

    for shard in ["1/2", "2/2"] {
        let file = format!("{}.csv", &shard[..1]);
        faults(
            at,
            &["--seeds", "1+12", "--shard", shard, "--results", &file],
        );
        assert_eq!(lines(at, &file).len(), 7);
    }
    assert_eq!(faults(at, &["--merge", "1.csv", "2.csv"]), whole);
}

#[test]
fn results_have_a_column_for_each_value_of_their_parts() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let said = succeed(at, &["cuts", "--seeds", "3+1", "--traces", "t"]);
    let kept = lines(at, "cuts.csv");
    let columns: Vec<&str> = kept[0].split(',').collect();
    let values = csv::Reader::from_path(at.join("cuts.csv"))
        .unwrap()
        .records()
        .next()
        .unwrap()
        .unwrap();
    assert_eq!(values.len(), columns.len());
    let value = |name: &str| {
        let place = columns.iter().position(|column| *column == name);
        values[place.unwrap()].parse::<f64>().unwrap()
    };
    assert_eq!(value("seed"), 3.0);
    for name in ["fixed_um", "learning_um", "cancelling_um"] {
        assert!(value(name) < 0.5 * value("off_um"), "{name}");
    }
    assert!(
        fs::read_to_string(at.join("t/3.csv"))
            .unwrap()
            .contains("cancelling_gate")
    );
    // Read back, they say the same.
    assert_eq!(succeed(at, &["cuts", "--merge", "cuts.csv"]), said);
}

#[test]
fn a_file_of_other_columns_and_seeds_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("old.csv"), "seed,outcome\n1,refused\n").unwrap();
    let said = fail(at, &["faults", "--results", "old.csv"]);
    assert!(said.contains("old.csv has other columns"), "{said}");
    for (option, value, words) in [
        ("--seeds", "7", "FIRST+COUNT"),
        ("--shard", "3/2", "I/N"),
        ("--seeds", "1+0", "no seed"),
    ] {
        let said = fail(at, &["faults", option, value]);
        assert!(said.contains(words), "{said}");
    }
}
