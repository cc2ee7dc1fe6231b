//! The page in a headless Chromium: its converter words are the host's, and it runs in real time without complaints.
//!
//! `cargo xtask web --check` builds the page and runs these tests, as `cargo xtask test` does.

mod guide;
mod serial;

use std::path::PathBuf;

use quadrant_bench::bench::Bench;
use quadrant_bench::request::answer;
use quadrant_chromium::Browser;

/// Path of the built page.
const PAGE: &str = "QUADRANT_BENCH_PAGE";
/// Size of a phone's window, CSS pixels.
const PHONE: (u32, u32) = (390, 844);
/// Size of a tablet's window, CSS pixels.
const TABLET: (u32, u32) = (768, 1024);
/// Size of a desktop's window, CSS pixels.
const DESK: (u32, u32) = (1440, 900);

/// Control periods that are compared at once.
const CHUNK: u32 = 50_000;
/// Runs: requests before the motion, and its duration, s. The first is the bench as it opens.
const RUNS: [(&[&str], u32); 4] = [
    (&[], 60),
    (
        &[
            r#"{"choose": {"law": "pid", "feedforward": "none"}}"#,
            r#"{"turn": {"knob": "friction", "value": 1.7}}"#,
        ],
        10,
    ),
    (
        &[
            r#"{"choose": {"law": "sliding-mode", "feedforward": "lugre"}}"#,
            r#"{"start": {"motion": {"radius_mm": 20.0, "feed_mm_min": 2400.0}}}"#,
        ],
        10,
    ),
    (
        &[
            r#"{"choose": {"law": "cascade", "feedforward": "smoothed-gms"}}"#,
            r#"{"turn": {"knob": "mass", "value": 1.2}}"#,
            r#""tell-friction""#,
        ],
        10,
    ),
];

/// Waits until the page has drawn what is made by its script.
const READY: &str = "new Promise((done) => { \
    const look = () => document.querySelectorAll('#steps button').length === 6 ? done(true) : setTimeout(look, 20); \
    look(); })";

/// The built page.
fn page() -> PathBuf {
    let page = std::env::var_os(PAGE);
    PathBuf::from(page.expect("the page: run cargo xtask web --check"))
}

/// The built page, in a browser; `None`, with a message, where there is no browser and none is required.
fn open(window: (u32, u32), is_dark: bool) -> Option<Browser> {
    let mut browser = Browser::start()?;
    browser.open(&page(), window, is_dark);
    browser.evaluate(READY);
    Some(browser)
}

/// Number of ticks whose words differ, and the first of them.
fn compare(host: &[u8], page: &[u8]) -> (usize, Option<usize>) {
    let mut differing = host
        .chunks(6)
        .zip(page.chunks(6))
        .enumerate()
        .filter(|(_, (host, page))| host != page);
    let first = differing.next().map(|(tick, _)| tick);
    (usize::from(first.is_some()) + differing.count(), first)
}

/// FNV-1a, 64 bits.
fn hash(start: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(start, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn every_converter_word_in_the_browser_is_the_host_s() {
    let Some(mut browser) = open(DESK, false) else {
        return;
    };
    for (requests, seconds) in RUNS {
        let mut bench = Bench::default();
        browser.evaluate("openBench().then((bench) => { window.compared = bench; })");
        for request in requests {
            let reply = String::from_utf8(answer(&mut bench, request.as_bytes())).unwrap();
            assert_eq!(reply, r#"{"ok":null}"#, "{request}");
            browser.evaluate(&format!("compared.request({request})"));
        }
        let ticks = seconds * 10_000;
        let mut hashes = [0xCBF2_9CE4_8422_2325; 2];
        let (mut differing, mut moved) = (0, 0);
        for from in (0..ticks).step_by(CHUNK as usize) {
            let mut host = Vec::new();
            bench.words(CHUNK, &mut host);
            let page = browser.evaluate(&format!(
                "Array.from(compared.words({CHUNK}), (byte) => String.fromCharCode(byte)).join('')"
            ));
            let page: Vec<u8> = page
                .as_str()
                .unwrap()
                .chars()
                .map(|byte| byte as u8)
                .collect();
            assert_eq!(page.len(), host.len());
            let (count, first) = compare(&host, &page);
            if let (0, Some(first)) = (differing, first) {
                println!("first difference: tick {}", from as usize + first);
            }
            differing += count;
            moved += host.iter().filter(|byte| **byte != 0).count();
            hashes = [hash(hashes[0], &host), hash(hashes[1], &page)];
        }
        println!(
            "{seconds} s, {} words: {differing} ticks differ; host {:016x}, browser {:016x}",
            3 * ticks,
            hashes[0],
            hashes[1]
        );
        assert_eq!(bench.fault(), None, "{requests:?}");
        assert!(moved > ticks as usize, "the axes hardly moved");
        assert_eq!((differing, hashes[0]), (0, hashes[1]), "{requests:?}");
    }
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn the_page_fits_every_window_and_complains_of_nothing() {
    for (window, is_dark) in [(PHONE, true), (TABLET, false), (DESK, true)] {
        let Some(mut browser) = open(window, is_dark) else {
            return;
        };
        browser.evaluate("new Promise((done) => setTimeout(done, 1500))");
        let overflow = browser.evaluate("document.documentElement.scrollWidth - innerWidth");
        assert!(
            overflow.as_i64().unwrap() <= 0,
            "{window:?}: {overflow} px too wide"
        );
        let nameless = browser.evaluate(
            "[...document.querySelectorAll('input, select, button')].filter((control) => !control.labels?.length \
             && !control.ariaLabel && !control.textContent.trim()).map((control) => control.outerHTML)",
        );
        assert_eq!(nameless, serde_json::json!([]), "{window:?}");
        assert_eq!(browser.problems(), Vec::<String>::new(), "{window:?}");
    }
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn three_axes_run_in_real_time_in_less_than_half_a_core() {
    let Some(mut browser) = open(DESK, false) else {
        return;
    };
    // The page's own meters are of the last second; a busy machine may need another try.
    let mut seen = Vec::new();
    for _ in 0..10 {
        browser.evaluate("new Promise((done) => setTimeout(done, 2000))");
        let meters = browser.evaluate(
            "['pace', 'load', 'drawing'].map((id) => Number(document.getElementById(id).textContent.replace(/[^0-9.]/g, '')))",
        );
        let [pace, load, drawing] = [0, 1, 2].map(|of| meters[of].as_f64().unwrap());
        println!("x {pace} of real time; law and stage {load} % of a core, drawing {drawing} %");
        if (0.98..1.02).contains(&pace) && load < 50.0 {
            return;
        }
        seen.push(meters);
    }
    panic!("pace, load %, drawing %: {seen:?}");
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn a_tour_step_is_scored_and_settings_go_out_and_come_in() {
    let Some(mut browser) = open(TABLET, false) else {
        return;
    };
    browser.evaluate(
        "document.getElementById('speed').value = '4'; document.querySelectorAll('#steps button')[5].click(); \
         new Promise((done) => setTimeout(done, 6000))",
    );
    let score =
        browser.evaluate("document.querySelector('#scores tr.now td:nth-child(2)').textContent");
    let largest_um: f64 = score.as_str().unwrap().parse().unwrap();
    assert!((0.5..20.0).contains(&largest_um), "{largest_um} um");

    let saved = browser.download("#save", "settings.toml").unwrap();
    let saved = String::from_utf8(saved).unwrap();
    assert!(saved.contains("the bench in the browser"), "{saved}");
    let changed = saved.replacen("kp_v_per_mm = 1.1", "kp_v_per_mm = 0.9", 1);
    assert_ne!(changed, saved);
    let drop = |text: &str| {
        format!(
            "take(new File([{}], 'mine.toml')).then(() => [document.getElementById('message').textContent, \
             document.querySelector('#feedback input').value])",
            serde_json::json!(text)
        )
    };
    let taken = browser.evaluate(&drop(&changed));
    assert!(
        taken[0]
            .as_str()
            .unwrap()
            .starts_with("mine.toml: the law runs"),
        "{taken}"
    );
    assert!(taken[1].as_str().unwrap().starts_with("0.9"), "{taken}");
    let refused = browser.evaluate(&drop("form = 7"));
    assert!(
        refused[0].as_str().unwrap().starts_with("mine.toml: "),
        "{refused}"
    );
    assert_eq!(browser.problems(), Vec::<String>::new());
}
