//! The guide on the page as it opens from a disk: each of its six steps has a result, files open, and it does not come again.

use quadrant_chromium::Browser;
use serde_json::json;

use super::{PHONE, open, page};

/// Presses a button of the guide by its label, and returns the result that it shows.
fn press(browser: &mut Browser, label: &str) -> String {
    let result = browser.evaluate(&format!(
        "[...document.querySelectorAll('#guide-actions button')].find((button) => button.textContent === {}).click(); \
         new Promise((done) => setTimeout(() => done(document.getElementById('guide-result').textContent), 300))",
        json!(label)
    ));
    result.as_str().unwrap().to_owned()
}

/// Presses a key where the focus is, as a keyboard does.
fn key(browser: &mut Browser, key: &str, code: u32) {
    for kind in ["rawKeyDown", "keyUp"] {
        browser.call(
            "Input.dispatchKeyEvent",
            json!({"type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code}),
        );
    }
}

/// Title of the step that is shown; empty while the guide is closed.
fn title(browser: &mut Browser) -> String {
    let title = browser.evaluate(
        "document.getElementById('guide').hidden ? '' : document.getElementById('guide-title').textContent",
    );
    title.as_str().unwrap().to_owned()
}

/// Numbers before "µm" in a result.
fn micrometres(result: &str) -> Vec<f64> {
    let words: Vec<&str> = result.split([' ', ',', ':']).collect();
    let pairs = words.windows(2).filter(|pair| pair[1].starts_with("µm"));
    pairs.map(|pair| pair[0].parse().unwrap()).collect()
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn each_of_the_guide_s_six_steps_shows_a_result_and_the_keyboard_walks_them() {
    let Some(mut browser) = open(PHONE, false) else {
        return;
    };
    assert_eq!(title(&mut browser), "1 of 6: What this is");
    let alone = micrometres(&press(&mut browser, "Run a turn with PID alone"));
    assert!(alone[0] > 100.0, "{alone:?}");
    browser.evaluate("document.getElementById('guide-next').focus()");

    key(&mut browser, "ArrowRight", 39);
    assert_eq!(title(&mut browser), "2 of 6: Choose a motion");
    let motion = press(&mut browser, "20 mm at 2400 mm/min");
    // 2 pi 20 mm at 40 mm/s.
    assert!(motion.starts_with("A turn takes 3.1 s."), "{motion}");
    let motion = press(&mut browser, "10 mm at 900 mm/min");
    assert!(motion.starts_with("A turn takes 4.2 s."), "{motion}");

    key(&mut browser, "ArrowRight", 39);
    let both = micrometres(&press(&mut browser, "Run both"));
    assert!(both[1] < 0.1 * both[0], "{both:?}");

    key(&mut browser, "ArrowRight", 39);
    let stiffer = press(&mut browser, "Ki × 4");
    assert!(stiffer.starts_with("Ki of x from 7.9 to 31.6 V/(mm s)."));
    let stiffer = micrometres(&stiffer);
    assert!(stiffer[0] < 0.8 * both[0], "{stiffer:?} {both:?}");
    press(&mut browser, "Ki ÷ 4");

    key(&mut browser, "ArrowRight", 39);
    let example = press(&mut browser, "Try the example of a stage");
    assert!(
        example.starts_with("stage.toml: the stage is yours"),
        "{example}"
    );
    let built_in = press(&mut browser, "Back to the built-in stage");
    assert!(
        built_in.starts_with("the settings as commissioned"),
        "{built_in}"
    );

    key(&mut browser, "ArrowRight", 39);
    assert_eq!(title(&mut browser), "6 of 6: Where to go next");
    let doubled = micrometres(&press(&mut browser, "Double the friction"));
    assert!(doubled[1] > 20.0, "{doubled:?}");
    key(&mut browser, "ArrowRight", 39);
    key(&mut browser, "ArrowLeft", 37);
    assert_eq!(title(&mut browser), "5 of 6: Open your own");

    key(&mut browser, "Escape", 27);
    assert_eq!(title(&mut browser), "");
    assert_eq!(browser.evaluate("document.activeElement.id"), "guide-open");
    browser.open(&page(), PHONE, false);
    browser.evaluate(super::READY);
    assert_eq!(title(&mut browser), "", "it came again");
    assert_eq!(
        browser.evaluate("document.getElementById('tour').hidden"),
        false
    );
    browser.evaluate("document.getElementById('guide-open').click()");
    assert_eq!(title(&mut browser), "1 of 6: What this is");
    assert_eq!(browser.problems(), Vec::<String>::new());
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn a_stage_and_settings_are_dropped_or_opened_and_a_refusal_names_the_file() {
    let Some(mut browser) = open(PHONE, false) else {
        return;
    };
    let stage = include_str!("../../../examples/stage.toml");
    let mut drop = |text: &str, name: &str| {
        let message = browser.evaluate(&format!(
            "(() => {{ const transfer = new DataTransfer(); transfer.items.add(new File([{}], {})); \
             document.body.dispatchEvent(new DragEvent('drop', {{ bubbles: true, cancelable: true, dataTransfer: transfer }})); \
             return new Promise((done) => setTimeout(() => done(document.getElementById('message').textContent), 500)); }})()",
            json!(text),
            json!(name)
        ));
        message.as_str().unwrap().to_owned()
    };
    let taken = drop(stage, "slide.toml");
    assert!(
        taken.starts_with("slide.toml: the stage is yours"),
        "{taken}"
    );
    let refused = drop("[x]\nmass_kg = 0\n", "light.toml");
    assert!(
        refused.starts_with("light.toml: x.mass_kg = 0 is outside"),
        "{refused}"
    );
    let taken = drop(
        include_str!("../../../host-sim/data/identified-stage.toml"),
        "mine.toml",
    );
    assert_eq!(taken, "mine.toml: the law runs on it");

    // A file of the disk, by the button.
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/stage.toml");
    let file = std::fs::canonicalize(file).unwrap();
    let button = browser.call(
        "Runtime.evaluate",
        json!({"expression": "document.getElementById('file')"}),
    );
    browser.call(
        "DOM.setFileInputFiles",
        json!({"files": [file], "objectId": button["result"]["objectId"]}),
    );
    let message = browser.evaluate(
        "new Promise((done) => setTimeout(() => done(document.getElementById('message').textContent), 500))",
    );
    assert!(
        message
            .as_str()
            .unwrap()
            .starts_with("stage.toml: the stage is yours"),
        "{message}"
    );
    assert_eq!(browser.problems(), Vec::<String>::new());
}
