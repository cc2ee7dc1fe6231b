//! `quadrant plot`: a recording and two runs over each other, in 80 columns and as a page.

use crate::command;
use quadrant_chromium::Browser;
use std::fmt::Write as _;
use std::fs;

fn run(gain: f64) -> String {
    (0..500).fold("t_s,position_mm,error_um\n".to_owned(), |mut text, row| {
        let time_s = 0.01 * f64::from(row);
        let _ = writeln!(text, "{time_s},{},{}", gain * time_s.sin(), 5.0 * gain);
        text
    })
}

#[test]
fn runs_are_drawn_over_each_other_within_eighty_columns_or_as_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("a.csv"), run(1.0)).unwrap();
    fs::write(at.join("b.csv"), run(3.0)).unwrap();
    let shown = command::succeed(at, &["plot", "a.csv", "b.csv"]);
    for part in ["* a.csv", "o b.csv", "position_mm", "error_um"] {
        assert!(shown.contains(part), "{part}:\n{shown}");
    }
    assert!(
        shown.lines().all(|line| line.chars().count() <= 80),
        "{shown}"
    );
    let shown = command::succeed(
        at,
        &[
            "plot",
            "a.csv",
            "--columns",
            "error_um",
            "--from",
            "1",
            "--to",
            "2",
        ],
    );
    assert!(!shown.contains("position_mm"), "{shown}");
    assert!(
        shown.contains("1.0000 s") && shown.contains("2.0000 s"),
        "{shown}"
    );
    command::succeed(at, &["plot", "a.csv", "b.csv", "--page", "both.html"]);
    let page = fs::read_to_string(at.join("both.html")).unwrap();
    assert!(page.contains("position_mm") && page.contains("b.csv"));
}

#[test]
fn what_cannot_be_drawn_is_refused_with_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("a.csv"), run(1.0)).unwrap();
    fs::write(at.join("bare.csv"), "0,1\n1,2\n").unwrap();
    fs::write(at.join("untimed.csv"), "x_mm,y_mm\n1,2\n3,4\n").unwrap();
    fs::write(at.join("short.csv"), "t_s,x_mm\n0,1\n1\n").unwrap();
    for (words, said) in [
        (
            "plot a.csv --columns speed",
            "no column \"speed\"; found position_mm, error_um",
        ),
        ("plot a.csv --from 9", "from 0 to 4.99 s"),
        ("plot bare.csv", "no header"),
        ("plot untimed.csv", "found x_mm, y_mm"),
        ("plot short.csv", "line 3: 1 cells, and the header has 2"),
        ("plot missing.csv", "missing.csv cannot be read"),
        ("plot a.csv --page a.pdf", "end in .html"),
    ] {
        let words: Vec<&str> = words.split(' ').collect();
        let shown = command::fail(at, &words);
        assert!(shown.contains(said), "{said}:\n{shown}");
    }
}

#[test]
fn what_record_writes_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let record = "connect --simulated=commissioned record --seconds 0.2 --out run.csv";
    command::succeed(at, &record.split(' ').collect::<Vec<_>>());
    let shown = command::succeed(at, &["plot", "run.csv"]);
    assert!(shown.contains("position_mm"), "{shown}");
}

#[test]
fn files_of_other_programs_are_drawn_and_what_is_guessed_and_no_number_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let rows = |row: &dyn Fn(u32) -> String| (0..40).map(row).collect::<String>();
    let comma = |value: f64| value.to_string().replace('.', ",");
    let text = rows(&|row| format!("{};{};{row}\n", comma(2.5 * f64::from(row)), comma(0.5)));
    fs::write(
        at.join("scope.csv"),
        format!("Recorder 7\nZeit [ms];Pos;Strom\n{text}"),
    )
    .unwrap();
    let words = ["plot", "scope.csv", "--columns", "time=Zeit:ms,Pos"];
    let (shown, said) = command::output(at, &words);
    assert!(shown.contains("Pos") && !shown.contains("Strom"), "{shown}");
    assert!(shown.contains("0.097500 s"), "{shown}");
    assert!(
        said.contains("cells separated by semicolons, a decimal comma"),
        "{said}"
    );
    let text = rows(&|row| format!("{row},{}\n", if row == 7 { "OVER" } else { "1.5" }));
    fs::write(at.join("gap.csv"), format!("t_s,level\n{text}")).unwrap();
    let (_, said) = command::output(at, &["plot", "gap.csv"]);
    assert!(said.contains("gap.csv: 1 cell holds no number"), "{said}");
    let text = rows(&|row| format!("{row}\t{}\n", 2 * row));
    fs::write(at.join("bare.txt"), text).unwrap();
    let said = command::fail(at, &["plot", "bare.txt"]);
    assert!(said.contains("time=NAME:UNIT; found 1, 2"), "{said}");
    let (shown, _) = command::output(at, &["plot", "bare.txt", "--columns", "time=1:us"]);
    assert!(shown.contains("3.900e-5 s"), "{shown}");
}

#[test]
fn a_page_of_runs_is_drawn_by_a_browser() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("a.csv"), run(1.0)).unwrap();
    fs::write(at.join("b.csv"), run(3.0)).unwrap();
    command::succeed(at, &["plot", "a.csv", "b.csv", "--page", "both.html"]);
    let Some(mut browser) = Browser::start() else {
        return;
    };
    browser.open(&at.join("both.html"), (900, 1000), false);
    let curves = browser.evaluate(
        "(async () => {
          const found = [];
          for (const drawing of document.querySelectorAll('.drawing')) {
            drawing.scrollIntoView({ behavior: 'instant', block: 'center' });
            for (let waited = 0; !drawing.dataset.drawn && waited < 5000; waited += 20)
              await new Promise((done) => setTimeout(done, 20));
            found.push(drawing.querySelectorAll('svg.chart .curve').length);
          }
          return found;
        })()",
    );
    assert_eq!(browser.problems(), Vec::<String>::new());
    assert_eq!(curves, serde_json::json!([2, 2]), "two figures of two runs");
}
