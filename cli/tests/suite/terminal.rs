//! The prompt at a real terminal: Ctrl-C, and the terminal's modes afterwards.
#![cfg(target_os = "linux")]

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use quadrant_settings::StageSettings;
use quadrant_sim::settings_file::SettingsFile;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{
    LocalModes, OptionalActions, Termios, Winsize, tcgetattr, tcsetattr, tcsetwinsize,
};

/// Longest time in which a text appears on the screen.
const SAID: Duration = Duration::from_secs(20);
/// Longest time of a whole commissioning.
const COMMISSIONED: Duration = Duration::from_secs(300);

/// A person at a terminal, with a program in front.
struct Person {
    keyboard: File,
    screen: Receiver<Vec<u8>>,
    terminal: File,
    child: Child,
    seen: String,
}

impl Person {
    /// Starts the console on a terminal that has these modes.
    fn sits_down(change: impl FnOnce(&mut Termios)) -> Self {
        let mut person = Self::starts(
            &["connect", "--simulated=commissioned"],
            Path::new("."),
            change,
        );
        person.sees("Ctrl-D ends");
        person.sees("quadrant> ");
        person
    }

    /// Starts a command in a folder.
    fn starts(words: &[&str], folder: &Path, change: impl FnOnce(&mut Termios)) -> Self {
        let keyboard = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&keyboard).unwrap();
        unlockpt(&keyboard).unwrap();
        let path = ptsname(&keyboard, Vec::new()).unwrap();
        let mut options = OpenOptions::new();
        let terminal = options.read(true).write(true);
        let terminal = terminal.open(path.to_str().unwrap()).unwrap();
        let mut modes = tcgetattr(&terminal).unwrap();
        change(&mut modes);
        tcsetattr(&terminal, OptionalActions::Now, &modes).unwrap();
        let wide = Winsize {
            ws_row: 24,
            ws_col: 1000,
            ws_xpixel: 0,
            ws_ypixel: 0,
        };
        tcsetwinsize(&terminal, wide).unwrap();
        // It makes the terminal the one whose Ctrl-C is the program's.
        let child = Command::new("setsid")
            .args(["--ctty", env!("CARGO_BIN_EXE_quadrant")])
            .args(words)
            .current_dir(folder)
            .env("TERM", "xterm")
            .stdin(Stdio::from(terminal.try_clone().unwrap()))
            .stdout(Stdio::from(terminal.try_clone().unwrap()))
            .stderr(Stdio::from(terminal.try_clone().unwrap()))
            .spawn()
            .unwrap();
        let keyboard = File::from(keyboard);
        let mut shown = keyboard.try_clone().unwrap();
        let (sender, screen) = mpsc::channel();
        thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = shown.read(&mut buffer) {
                if sender.send(buffer[..count].to_vec()).is_err() {
                    return;
                }
            }
        });
        Self {
            keyboard,
            screen,
            terminal,
            child,
            seen: String::new(),
        }
    }

    fn types(&mut self, text: &str) {
        self.keyboard.write_all(text.as_bytes()).unwrap();
    }

    /// Waits until the text is on the screen, and forgets what came before its end.
    fn sees(&mut self, text: &str) {
        self.reads_until(text);
    }

    /// Returns the text on the screen from here to `text`.
    fn reads_until(&mut self, text: &str) -> String {
        self.reads_within(SAID, text)
    }

    /// Returns the text on the screen from here to `text`, which comes within a time.
    fn reads_within(&mut self, time: Duration, text: &str) -> String {
        let due = Instant::now() + time;
        loop {
            if let Some(at) = self.seen.find(text) {
                let read = self.seen[..at].to_owned();
                self.seen.drain(..at + text.len());
                return read;
            }
            let left = due.saturating_duration_since(Instant::now());
            match self.screen.recv_timeout(left) {
                Ok(bytes) => self.seen.push_str(&String::from_utf8_lossy(&bytes)),
                Err(_) => panic!("`{text}` did not come: {:?}", self.seen),
            }
        }
    }

    fn modes(&self) -> LocalModes {
        tcgetattr(&self.terminal).unwrap().local_modes
    }

    /// A motion without an end that is soon.
    fn starts_a_motion(&mut self) {
        self.types("enable\r");
        self.sees("quadrant> ");
        self.types("jog x 0.001\r");
        self.sees("quadrant> ");
        self.types("wait rest --timeout 100000\r");
        let due = Instant::now() + SAID;
        while !self.modes().contains(LocalModes::ICANON) {
            assert!(Instant::now() < due, "the command does not begin");
            thread::sleep(Duration::from_millis(10));
        }
        // The command is under way.
        thread::sleep(Duration::from_millis(200));
    }

    fn finds_the_axes_at_rest(&mut self) {
        self.types("status\r");
        self.sees("enabled, at rest");
        self.sees("quadrant> ");
    }

    /// Ends the session with Ctrl-D.
    fn leaves(mut self) {
        self.types("\x04");
        assert_eq!(self.gives_back(), Some(0));
    }

    /// Waits for the program's end, and checks the modes that it leaves.
    fn gives_back(mut self) -> Option<i32> {
        let due = Instant::now() + SAID;
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(Instant::now() < due, "it does not end");
            thread::sleep(Duration::from_millis(10));
        };
        let usual = LocalModes::ISIG | LocalModes::ICANON | LocalModes::ECHO;
        assert!(self.modes().contains(usual), "{:?}", self.modes());
        status.code()
    }

    fn signal(&self, name: &str) {
        let number = self.child.id().to_string();
        let sent = Command::new("kill").args([name, &number]).status();
        assert!(sent.unwrap().success());
    }
}

impl Drop for Person {
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

#[test]
fn an_interrupted_command_ends_and_the_prompt_goes_on() {
    let mut person = Person::sits_down(|_| {});
    for _ in 0..2 {
        person.starts_a_motion();
        person.types("\x03");
        person.sees("interrupted: the axes have stopped");
        person.sees("quadrant> ");
        // Longer than a look at whether the session has ended.
        thread::sleep(Duration::from_millis(300));
        person.finds_the_axes_at_rest();
    }
    person.leaves();
}

#[test]
fn a_terminal_without_an_interrupt_gets_one() {
    let mut person = Person::sits_down(|modes| {
        modes.local_modes &= !(LocalModes::ISIG | LocalModes::ICANON);
    });
    person.starts_a_motion();
    person.types("\x03");
    person.sees("interrupted: the axes have stopped");
    person.sees("quadrant> ");
    person.leaves();
}

#[test]
fn a_signal_ends_the_prompt_and_leaves_the_terminal_as_it_was() {
    for name in ["-TERM", "-HUP"] {
        let person = Person::sits_down(|_| {});
        person.signal(name);
        person.gives_back();
        let mut person = Person::sits_down(|_| {});
        person.starts_a_motion();
        person.signal(name);
        person.sees("interrupted: the axes have stopped");
        person.gives_back();
    }
}

#[test]
fn the_third_signal_ends_at_once_and_leaves_the_terminal_as_it_was() {
    let person = Person::sits_down(|_| {});
    // The program stands, so that it acts on none of them in between.
    person.signal("-STOP");
    for name in ["-INT", "-TERM", "-HUP", "-CONT"] {
        person.signal(name);
    }
    person.gives_back();
}

#[test]
fn a_motion_that_was_ordered_arrives_while_the_prompt_waits() {
    let mut person = Person::sits_down(|_| {});
    for line in ["enable\r", "jog x 1\r"] {
        person.types(line);
        person.sees("quadrant> ");
    }
    thread::sleep(Duration::from_secs(2));
    person.types("status\r");
    person.sees("no     jog");
    let position = person.reads_until("\n");
    let position: f64 = position.split_whitespace().next().unwrap().parse().unwrap();
    assert!((0.5..10.0).contains(&position), "{position} mm");
    person.types("stop\r");
    person.sees("quadrant> ");
    thread::sleep(Duration::from_millis(500));
    person.finds_the_axes_at_rest();
    person.leaves();
}

#[test]
fn a_tab_completes_what_all_that_is_possible_begins_with() {
    let mut person = Person::sits_down(|_| {});
    person.types("get x/feedba\tpid/kp\t\r");
    person.sees("pid/kp_v_per_mm");
    let answer = person.reads_until("quadrant> ");
    assert!(!answer.contains("error"), "{answer}");
    person.leaves();
}

/// Experiments that a commissioning in a folder has kept.
fn kept(folder: &Path) -> usize {
    let files = std::fs::read_dir(folder.join("quadrant-out/x/experiments"));
    let is_kept = |path: &Path| path.extension().is_some_and(|end| end == "json");
    files.map_or(0, |files| {
        files
            .filter(|file| is_kept(&file.as_ref().unwrap().path()))
            .count()
    })
}

/// Waits until a commissioning has kept a number of experiments, and the next one is under way.
fn waits_for_experiments(folder: &Path, number: usize) {
    let due = Instant::now() + SAID;
    while kept(folder) < number {
        assert!(Instant::now() < due, "nothing is measured");
        thread::sleep(Duration::from_millis(10));
    }
}

const COMMISSION: [&str; 8] = [
    "commission",
    "--axis",
    "x",
    "--travel",
    "15",
    "--quick",
    "--seed",
    "3",
];

#[test]
fn a_commissioning_that_is_interrupted_gives_the_old_settings_back_and_is_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let words = [&COMMISSION[..], &["--machine", "simulated"]].concat();
    let mut person = Person::starts(&words, folder.path(), |_| {});
    waits_for_experiments(folder.path(), 4);
    person.types("\x03");
    person.sees("the machine has its old settings back, its outputs off; with --resume it goes on");
    person.sees("interrupted");
    person.sees("the axes have stopped");
    assert_eq!(person.gives_back(), Some(1));
    let measured = kept(folder.path());
    let resumed = [&words[..], &["--resume"]].concat();
    let mut person = Person::starts(&resumed, folder.path(), |_| {});
    person.sees(&format!("resuming with the {measured} experiments"));
    person.reads_within(COMMISSIONED, "settings.toml: the settings of the stage");
    assert_eq!(person.gives_back(), Some(0));
    assert_eq!(kept(folder.path()), 0);
}

#[test]
fn a_commissioning_in_the_console_that_is_interrupted_leaves_the_old_settings_and_is_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let mut person = Person::starts(&["connect", "--simulated"], folder.path(), |_| {});
    person.sees("quadrant> ");
    let dumps = |person: &mut Person, name: &str| {
        person.types(&format!("dump {name}\r"));
        person.sees("the settings of all axes");
        person.sees("quadrant> ");
        let dumped = std::fs::read_to_string(folder.path().join(name)).unwrap();
        // What follows says when it was written.
        dumped.split("[[provenance]]").next().unwrap().to_owned()
    };
    let before = dumps(&mut person, "before.toml");
    let line = COMMISSION.join(" ");
    person.types(&format!("{line}\r"));
    waits_for_experiments(folder.path(), 4);
    person.types("\x03");
    person.sees("the machine has its old settings back, its outputs off");
    person.sees("quadrant> ");
    assert_eq!(dumps(&mut person, "after.toml"), before);
    person.types("status\r");
    person.sees("disabled");
    person.sees("quadrant> ");
    let measured = kept(folder.path());
    person.types(&format!("{line} --resume\r"));
    person.sees(&format!("resuming with the {measured} experiments"));
    waits_for_experiments(folder.path(), measured + 1);
    person.types("\x03");
    person.sees("the machine has its old settings back, its outputs off");
    person.sees("quadrant> ");
    person.leaves();
}

#[test]
fn what_new_asks_is_answered_once_more_where_an_answer_cannot_be() {
    let folder = tempfile::tempdir().unwrap();
    let mut person = Person::starts(&["new", "mine.toml"], folder.path(), |_| {});
    for (question, answers) in [
        (
            "encoder: a name of --list-presets",
            &["rotary-250", "rotary-2500"][..],
        ),
        ("lead of the screw, mm a turn", &["none", "-5", "5"]),
        ("amplifier: a name of --list-presets", &[""]),
        ("largest velocity, mm/s", &["120"]),
        ("largest acceleration, mm/s²", &["1500"]),
        ("travel, mm: 200 for as much either way", &["-60..140"]),
        ("control rate, Hz", &[""]),
    ] {
        for answer in answers {
            person.sees(question);
            person.sees(": ");
            person.types(&format!("{answer}\r"));
        }
    }
    person.sees("quadrant commission --axis x --settings mine.toml");
    assert_eq!(person.gives_back(), Some(0));
    let file = SettingsFile::read(&folder.path().join("mine.toml")).unwrap();
    let axis = &file.stage.axes[0];
    assert_eq!(axis.encoder.resolution_mm, 5e-4);
    assert_eq!(axis.limits.max_velocity_mm_s, 120.0);
    let travel = axis.limits.travel_mm.unwrap();
    assert_eq!((travel.negative, travel.positive), (-60.0, 140.0));
    assert_eq!(file.stage.rate_hz, StageSettings::default().rate_hz);
}

#[test]
fn answers_that_end_early_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut person = Person::starts(&["new", "mine.toml"], folder.path(), |_| {});
    person.sees("encoder: a name of --list-presets");
    person.types("\x04");
    person.sees("the answers ended before --encoder; nothing was written");
    assert_eq!(person.gives_back(), Some(1));
    assert!(!folder.path().join("mine.toml").exists());
}
