//! The prompt at a real terminal: Ctrl-C, and the terminal's modes afterwards.
#![cfg(target_os = "linux")]

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};

/// Longest time in which something is said.
const SAID: Duration = Duration::from_secs(20);

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
        // It makes the terminal the one whose Ctrl-C is the program's.
        let child = Command::new("setsid")
            .args(["--ctty", env!("CARGO_BIN_EXE_quadrant")])
            .args(["connect", "--simulated=commissioned"])
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
        let mut person = Self {
            keyboard,
            screen,
            terminal,
            child,
            seen: String::new(),
        };
        person.sees("Ctrl-D ends");
        person.sees("quadrant> ");
        person
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
        let due = Instant::now() + SAID;
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
