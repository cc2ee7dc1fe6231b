//! The page with a machine at a serial port: the firmware's application on the simulated stage, behind a port that the test
//! feeds. The machine runs in real time; that it stops is judged by its stage.

use std::time::{Duration, Instant};

use quadrant_chromium::Browser;
use quadrant_host::machine::simulated::SimulatedMachine;
use quadrant_law::axes::AxisName;
use quadrant_law::safety::{AxisSwitches, Switches};
use quadrant_link::watch::{LinkWatch, Seen};
use quadrant_settings::StageSettings;
use quadrant_sim::plant::StageParameters;
use serde_json::{Value, json};

use super::{DESK, PHONE, TABLET, page};

/// The port, before the page's own scripts.
const PORT: &str = include_str!("port.js");
/// Longest time that the machine is behind: a browser that was busy is not made up for at once.
const MOST_BEHIND: Duration = Duration::from_millis(100);
/// Longest wait for what the page is to show.
const PATIENCE: Duration = Duration::from_secs(20);
/// Time in which a jog has to have stopped, in control ticks: before the machine's own time-out of 5000.
const STOPPED_TICKS: u32 = 4000;
/// Way of an axis at rest at most, mm: its law holds it against noise.
const REST_MM: f64 = 0.01;
/// Hides the page, and shows it again, as far as the page can detect it.
const HIDE: &str = "Object.defineProperty(document, 'hidden', { configurable: true, get: () => true }); \
    document.dispatchEvent(new Event('visibilitychange'))";
const SHOW: &str = "delete document.hidden; document.dispatchEvent(new Event('visibilitychange'))";
/// The button that jogs x towards larger positions.
const JOG: &str = "[data-jog='x+']";

/// A page and a machine, with their cable.
struct Wired {
    browser: Browser,
    machine: SimulatedMachine,
    ran: Instant,
    /// Bytes that the page has sent.
    sent: usize,
}

impl Wired {
    /// The page as it opens; `None` where there is no browser.
    fn open(window: (u32, u32), is_dark: bool) -> Option<Self> {
        let mut browser = Browser::start()?;
        browser.call(
            "Page.addScriptToEvaluateOnNewDocument",
            json!({ "source": PORT }),
        );
        let mut address = page().into_os_string();
        address.push("?machine=serial");
        browser.open(address.as_ref(), window, is_dark);
        let settings = StageSettings::simulated();
        let machine = SimulatedMachine::new(&settings, &StageParameters::real(), 1).unwrap();
        let mut wired = Self {
            browser,
            machine,
            ran: Instant::now(),
            sent: 0,
        };
        wired.wait_for("typeof machineView === 'object'");
        Some(wired)
    }

    /// The same, connected.
    fn connected(window: (u32, u32)) -> Option<Self> {
        let mut wired = Self::open(window, false)?;
        wired.click("#m-connect");
        wired.wait_for("document.documentElement.dataset.live === 'true' && machineView.strips.record.end > 10");
        Some(wired)
    }

    /// The same, with its outputs on.
    fn enabled(window: (u32, u32)) -> Option<Self> {
        let mut wired = Self::connected(window)?;
        wired.click("#m-enable");
        wired.wait_for("machineView.status?.state === 'enabled'");
        assert!(wired.machine.outputs().enabled);
        Some(wired)
    }

    /// Lets the machine run up to now, and carries bytes both ways.
    fn relay(&mut self) {
        let time = self.ran.elapsed().min(MOST_BEHIND);
        self.ran = Instant::now();
        self.machine.run((time.as_secs_f64() * 1e4) as u32);
        let received: String = self.machine.receive().into_iter().map(char::from).collect();
        let sent = self.evaluate(&format!("fakePort.exchange({})", json!(received)));
        let sent: Vec<u8> = sent
            .as_str()
            .unwrap()
            .chars()
            .map(|byte| byte as u8)
            .collect();
        self.sent += sent.len();
        self.machine.send(&sent);
    }

    /// Lets so many control ticks pass, at least.
    fn pass(&mut self, ticks: u32) {
        let from = self.machine.tick();
        while self.machine.tick() - from < ticks {
            self.relay();
        }
    }

    fn evaluate(&mut self, expression: &str) -> Value {
        self.browser.evaluate(expression)
    }

    fn text(&mut self, id: &str) -> String {
        let text = self.evaluate(&format!("document.getElementById('{id}').textContent"));
        text.as_str().unwrap().to_owned()
    }

    /// Relays until an expression is true.
    fn wait_for(&mut self, expression: &str) {
        let began = Instant::now();
        while self.evaluate(expression) != true {
            assert!(
                began.elapsed() < PATIENCE,
                "not within {PATIENCE:?}: {expression}; message {:?}, alarm {:?}, {:?}",
                self.text("m-message"),
                self.text("m-alarm"),
                self.browser.problems()
            );
            self.relay();
        }
    }

    /// The middle of what a selector finds, scrolled into sight.
    fn place(&mut self, selector: &str) -> (f64, f64) {
        let place = self.evaluate(&format!(
            "(() => {{ const found = document.querySelector({selector:?}); found.scrollIntoView({{ block: 'center' }}); \
             const box = found.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }})()"
        ));
        (place[0].as_f64().unwrap(), place[1].as_f64().unwrap())
    }

    fn mouse(&mut self, kind: &str, (x, y): (f64, f64)) {
        let event =
            json!({"type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1});
        self.browser.call("Input.dispatchMouseEvent", event);
    }

    fn click(&mut self, selector: &str) {
        let place = self.place(selector);
        self.mouse("mousePressed", place);
        self.mouse("mouseReleased", place);
    }

    fn press_escape(&mut self) {
        for kind in ["keyDown", "keyUp"] {
            let event = json!({"type": kind, "key": "Escape", "code": "Escape"});
            self.browser.call("Input.dispatchKeyEvent", event);
        }
    }

    fn places_mm(&mut self) -> [f64; 3] {
        let axes = self.machine.plant_mut().axes();
        axes.each_ref().map(|axis| axis.position_mm())
    }

    /// Way of the axis that goes farthest within so many control ticks, mm.
    fn way_mm(&mut self, ticks: u32) -> f64 {
        let from = self.places_mm();
        self.pass(ticks);
        let to = self.places_mm();
        let ways = from.iter().zip(to).map(|(from, to)| (to - from).abs());
        ways.fold(0.0, f64::max)
    }

    /// Presses the button of x until the axis moves, and gives the button's place.
    fn jog(&mut self) -> (f64, f64) {
        let place = self.place(JOG);
        let from = self.places_mm()[0];
        self.mouse("mousePressed", place);
        let began = Instant::now();
        while self.places_mm()[0] < from + 0.2 {
            assert!(
                began.elapsed() < PATIENCE,
                "x does not jog: {}",
                self.text("m-message")
            );
            self.relay();
        }
        place
    }

    /// The axes have stopped soon, by the stage, and stay where they are.
    fn assert_stops(&mut self, why: &str) {
        self.pass(STOPPED_TICKS);
        let way_mm = self.way_mm(3000);
        assert!(way_mm < REST_MM, "{why}: {way_mm} mm");
        let events = self.text("m-events");
        assert!(
            !events.contains("fault"),
            "{why}: the machine had to stop by itself: {events}"
        );
    }

    fn assert_no_problems(&mut self) {
        assert_eq!(self.browser.problems(), Vec::<String>::new());
    }
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn a_machine_is_seen_jogs_while_a_button_is_held_and_stops_at_escape() {
    let Some(mut wired) = Wired::connected(DESK) else {
        return;
    };
    assert_eq!(wired.evaluate("fakePort.baudRate"), 921_600);
    assert!(wired.text("m-board").starts_with("simulated, firmware "));
    assert_eq!(
        wired.evaluate("document.querySelectorAll('#m-inputs li').length"),
        13
    );
    assert!(!wired.machine.outputs().enabled, "outputs on unasked");
    wired.click("#m-enable");
    wired.wait_for("machineView.status?.state === 'enabled'");
    wired.evaluate("document.querySelector('#m-channels input[value=\"x.position\"]').click()");
    wired.wait_for("machineView.strips.record.names.includes('x.position') && machineView.strips.record.end > 10");

    wired.jog();
    // Longer than the machine lets a silent host's jog go on.
    wired.pass(8000);
    assert!(wired.way_mm(1000) > 0.05, "the jog ended by itself");
    assert_eq!(wired.text("m-state"), "enabled, moving");
    wired.press_escape();
    wired.assert_stops("Escape");
    let seen = wired.evaluate(
        "(() => { const { record } = machineView.strips; const seen = record.last('x.position', record.end); \
         return Math.max(...seen) - Math.min(...seen); })()",
    );
    assert!(seen.as_f64().unwrap() > 0.5, "the chart saw {seen} mm");
    assert!(wired.machine.outputs().enabled, "a stop holds");
    let charts = wired.evaluate("[...document.querySelectorAll('#m-strips .strip')].map((plot) => plot.getAttribute('aria-label'))");
    assert_eq!(
        charts.as_array().unwrap().len(),
        2,
        "a chart of each unit: {charts}"
    );

    wired.click("#m-freeze");
    let drawn = "machineView.strips.charts[0].chart.plot.data[0].at(-1)";
    let before = wired.evaluate(drawn);
    wired.pass(3000);
    assert_eq!(wired.evaluate(drawn), before, "a frozen chart went on");
    wired.click("#m-disable");
    wired.wait_for("machineView.status?.state === 'disabled'");
    assert!(!wired.machine.outputs().enabled);
    wired.assert_no_problems();
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn a_jog_stops_when_its_button_is_let_go_or_its_user_is_gone() {
    let Some(mut wired) = Wired::enabled(DESK) else {
        return;
    };
    let place = wired.jog();
    wired.mouse("mouseReleased", place);
    wired.assert_stops("let go");

    let place = wired.jog();
    wired.mouse("mouseMoved", (place.0, place.1 + 300.0));
    wired.assert_stops("the pointer left");
    wired.mouse("mouseReleased", (place.0, place.1 + 300.0));

    for gone in [
        "window.dispatchEvent(new Event('blur'))",
        "window.dispatchEvent(new Event('pagehide'))",
    ] {
        let place = wired.jog();
        wired.evaluate(gone);
        wired.assert_stops(gone);
        wired.mouse("mouseReleased", place);
    }

    let place = wired.jog();
    wired.evaluate(HIDE);
    wired.assert_stops("hidden");
    let sent = wired.sent;
    wired.pass(5000);
    assert_eq!(wired.sent, sent, "a hidden page goes on asking");
    wired.mouse("mouseReleased", place);
    wired.evaluate(SHOW);
    wired.wait_for("document.documentElement.dataset.live === 'true'");
    wired.assert_stops("seen again");
    wired.assert_no_problems();
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn homing_stops_at_the_button_at_escape_and_when_the_page_is_hidden() {
    let Some(mut wired) = Wired::enabled(TABLET) else {
        return;
    };
    for way in ["button", "Escape", "hidden"] {
        wired.click("[data-home='x y z']");
        wired.wait_for("machineView.status?.state === 'homing'");
        let began = Instant::now();
        while wired.way_mm(200) < 0.02 {
            assert!(began.elapsed() < PATIENCE, "nothing moves");
        }
        match way {
            "button" => wired.click("#m-stop"),
            "Escape" => wired.press_escape(),
            _ => {
                wired.evaluate(HIDE);
            }
        }
        wired.assert_stops(way);
    }
    wired.evaluate(SHOW);
    wired.assert_no_problems();
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn stop_is_sent_though_earlier_requests_have_no_answer() {
    let Some(mut wired) = Wired::enabled(DESK) else {
        return;
    };
    let mut watch = LinkWatch::new();
    wired.evaluate(
        "fakePort.exchange(''); machineView.draft.load(); \
         document.getElementById('m-stop').click(); document.getElementById('m-disable').click()",
    );
    // Nothing is carried to the machine, and so nothing is answered.
    let sent =
        wired.evaluate("new Promise((done) => setTimeout(() => done(fakePort.exchange('')), 50))");
    let seen: Vec<Seen> = sent
        .as_str()
        .unwrap()
        .chars()
        .filter_map(|byte| watch.push(byte as u8))
        .collect();
    assert!(
        seen.contains(&Seen::Stop) && seen.contains(&Seen::Disable),
        "{seen:?}"
    );
    assert!(
        seen.contains(&Seen::Other),
        "nothing was asked before: {seen:?}"
    );
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn an_input_and_its_fault_are_shown_with_the_remedy_and_reset() {
    let Some(mut wired) = Wired::enabled(DESK) else {
        return;
    };
    let limit = Switches::NONE.with_axis(AxisName::Y, AxisSwitches::HOME);
    wired.machine.press(limit);
    wired.wait_for("document.querySelector('[data-input=\"y.home\"]').className === 'active'");
    wired.machine.press(Switches::EMERGENCY_STOP);
    wired.wait_for("!document.getElementById('m-fault').hidden");
    wired.wait_for(
        "document.querySelector('[data-input=\"emergency-stop\"]').className === 'active'",
    );
    assert!(wired.text("m-fault-name").contains("emergency-stop"));
    assert!(wired.text("m-fault-remedy").len() > 10);
    assert!(wired.text("m-events").contains("fault"));
    wired.wait_for("machineView.status?.state === 'fault'");
    assert!(!wired.machine.outputs().enabled);
    // Not "outputs on", which Enable had said.
    wired.wait_for("document.getElementById('m-message').textContent === 'the outputs are off'");

    // Not while it is pressed.
    wired.click("#m-reset");
    wired.wait_for("machineView.inputs.refusal !== null");
    wired.machine.press(Switches::NONE);
    wired.wait_for("document.querySelectorAll('#m-inputs .active').length === 0");
    wired.click("#m-reset");
    wired.wait_for("document.getElementById('m-fault').hidden");
    wired.pass(5000);
    assert!(!wired.machine.outputs().enabled, "outputs on unasked");
    wired.assert_no_problems();
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn a_gain_is_found_set_compared_applied_and_stored() {
    let Some(mut wired) = Wired::connected(DESK) else {
        return;
    };
    let erased = wired.machine.flash().bytes().to_vec();
    const PATH: &str = "/axes/0/feedback/pid/kp_v_per_mm";
    let row = format!("document.querySelector('.setting[data-path=\"{PATH}\"]')");
    wired.evaluate("document.getElementById('m-find').value = 'x kp'; document.getElementById('m-read').click()");
    wired.wait_for(&format!("{row} !== null"));
    let meaning = wired.evaluate(&format!("{row}.textContent"));
    let meaning = meaning.as_str().unwrap();
    assert!(
        meaning.contains("V/mm")
            && meaning.contains("proportional gain")
            && meaning.contains("0 to 10000"),
        "{meaning}"
    );

    let type_in = |text: &str| {
        format!(
            "(() => {{ const input = {row}.querySelector('input'); input.value = '{text}'; input.dispatchEvent(new Event('change')); }})()"
        )
    };
    wired.evaluate(&type_in("much"));
    wired.wait_for(&format!(
        "{row}.querySelector('.refused').textContent !== ''"
    ));
    wired.evaluate(&type_in("0.75"));
    wired.wait_for("document.querySelectorAll('#m-differences tr').length === 1");
    let difference = wired.evaluate(
        "[...document.querySelector('#m-differences tr').cells].map((cell) => cell.textContent)",
    );
    assert_eq!(difference[0], "x/feedback/pid/kp_v_per_mm");
    assert_eq!(difference[2], "0.75");
    assert_ne!(difference[1], "0.75", "it acts already");

    wired.click("#m-apply");
    wired.wait_for("document.querySelectorAll('#m-differences tr').length === 0 && document.getElementById('m-message').textContent === 'acting now on x'");
    wired.evaluate(&format!("machineView.ask({{ 'get-in-force': {{ path: '{PATH}' }} }}).then((answer) => {{ window.acting = answer.value; }}); 0"));
    wired.wait_for("window.acting === 0.75");
    wired.evaluate("document.getElementById('m-origin').value = 'kp of x lowered'; document.getElementById('m-store').click()");
    wired.wait_for(
        "document.getElementById('m-message').textContent === 'stored for the next start'",
    );
    assert_ne!(wired.machine.flash().bytes(), erased);
    wired.assert_no_problems();
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn a_held_port_a_silent_board_and_a_pulled_cable_are_reported() {
    let Some(mut wired) = Wired::open(DESK, true) else {
        return;
    };
    wired.evaluate("fakePort.isHeld = true");
    wired.click("#m-connect");
    wired.wait_for(
        "document.getElementById('m-alarm').textContent.includes('Another program may hold it')",
    );
    wired.evaluate("fakePort.isHeld = false");
    wired.click("#m-connect");
    wired.wait_for("document.documentElement.dataset.live === 'true'");
    wired.click("#m-enable");
    wired.wait_for("machineView.status?.state === 'enabled'");

    // Nothing is carried for a while.
    wired.evaluate("new Promise((done) => setTimeout(done, 1500))");
    assert_eq!(
        wired.evaluate("document.documentElement.dataset.live"),
        "false"
    );
    assert!(wired.text("m-alarm").contains("does not answer"));
    wired.wait_for("document.documentElement.dataset.live === 'true' && document.getElementById('m-alarm').hidden");

    wired.jog();
    wired.evaluate("fakePort.unplug()");
    wired.wait_for("document.getElementById('m-alarm').textContent.startsWith('Connection lost')");
    assert_eq!(wired.text("m-state"), "not connected");
    assert_eq!(
        wired.evaluate("document.getElementById('m-axes').rows[0].cells[3].textContent"),
        "–"
    );
    assert_eq!(
        wired.evaluate("document.documentElement.dataset.live"),
        "false"
    );

    // The machine stopped the jog by itself; the page connects again, and moves nothing.
    wired.pass(8000);
    assert!(wired.way_mm(3000) < REST_MM);
    wired.click("#m-connect");
    wired.wait_for("document.documentElement.dataset.live === 'true'");
    assert!(wired.way_mm(3000) < REST_MM);
    wired.machine.restart();
    wired.wait_for("document.getElementById('m-alarm').textContent.includes('restarted')");
    wired.pass(5000);
    assert!(!wired.machine.outputs().enabled);
    wired.assert_no_problems();
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn stop_is_in_sight_in_every_window_and_nothing_is_too_wide() {
    for (window, is_dark) in [(PHONE, true), (TABLET, false), (DESK, true)] {
        let Some(mut wired) = Wired::open(window, is_dark) else {
            return;
        };
        wired.click("#m-connect");
        wired.wait_for("document.documentElement.dataset.live === 'true'");
        wired.click("#m-enable");
        wired.wait_for("machineView.status?.state === 'enabled'");
        wired.machine.press(Switches::EMERGENCY_STOP);
        wired.evaluate("document.getElementById('m-find').value = 'x pid'; document.getElementById('m-read').click()");
        wired.wait_for("document.querySelectorAll('.setting').length > 3 && !document.getElementById('m-fault').hidden");
        let overflow = wired.evaluate("document.documentElement.scrollWidth - innerWidth");
        assert!(
            overflow.as_i64().unwrap() <= 0,
            "{window:?}: {overflow} px too wide"
        );
        for scroll in ["0", "document.body.scrollHeight"] {
            let seen = wired.evaluate(&format!(
                "(() => {{ scrollTo(0, {scroll}); const box = document.getElementById('m-stop').getBoundingClientRect(); \
                 return document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2)?.id === 'm-stop' && box.bottom <= innerHeight; }})()"
            ));
            assert_eq!(seen, true, "{window:?}, scrolled to {scroll}");
        }
        wired.assert_no_problems();
    }
}

#[test]
#[ignore = "needs the built page: cargo xtask web --check"]
fn a_browser_without_serial_ports_says_what_to_do() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    browser.call(
        "Page.addScriptToEvaluateOnNewDocument",
        json!({ "source": "Object.defineProperty(navigator, 'serial', { value: undefined })" }),
    );
    let mut address = page().into_os_string();
    address.push("?machine=serial");
    browser.open(address.as_ref(), PHONE, false);
    let text = browser.evaluate(
        "new Promise((done) => { const look = () => (typeof machineView === 'object' ? done(document.body.innerText) : setTimeout(look, 20)); look(); })",
    );
    assert!(
        text.as_str().unwrap().contains("Open this page in Chrome"),
        "{text}"
    );
    assert_eq!(
        browser.evaluate("document.getElementById('m-connect').disabled"),
        true
    );
    assert_eq!(browser.problems(), Vec::<String>::new());
}
