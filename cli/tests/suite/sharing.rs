//! A machine that one program holds and others look at, as programs.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_quadrant");

/// A program that holds a simulated machine, and shares it.
struct Holder {
    child: Child,
    input: ChildStdin,
    /// Options for those who look, as it says them.
    look: Vec<String>,
}

impl Holder {
    /// With as many open files as `files`.
    fn share(address: &str, files: u32) -> Self {
        let command = format!(
            "ulimit -n {files}; exec \"$0\" connect --simulated=commissioned --share {address}"
        );
        let mut child = Command::new("sh")
            .args(["-c", &command, PROGRAM])
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        said.read_line(&mut line).unwrap();
        let (_, look) = line.split_once("quadrant connect ").expect(&line);
        let look = look.split_whitespace().map(str::to_owned).collect();
        Self {
            input: child.stdin.take().unwrap(),
            child,
            look,
        }
    }

    fn say(&mut self, line: &str) {
        writeln!(self.input, "{line}").unwrap();
    }

    /// `host:port` at which others look.
    fn address(&self) -> &str {
        &self.look[1]
    }

    fn look(&self, command: &str) -> Output {
        Command::new(PROGRAM)
            .arg("connect")
            .args(&self.look)
            .arg(command)
            .output()
            .unwrap()
    }

    fn signal(&self, name: &str) {
        let number = self.child.id().to_string();
        let sent = Command::new("kill").args([name, &number]).status();
        assert!(sent.unwrap().success());
    }

    /// Processor time that it has taken.
    fn processor_time(&self) -> Duration {
        let path = format!("/proc/{}/stat", self.child.id());
        let text = fs::read_to_string(path).unwrap();
        let (_, fields) = text.rsplit_once(") ").unwrap();
        let fields: Vec<&str> = fields.split(' ').collect();
        let ticks = |index: usize| fields[index].parse::<u64>().unwrap();
        // In hundredths of a second, on every Linux.
        Duration::from_millis(10 * (ticks(11) + ticks(12)))
    }
}

impl Drop for Holder {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_viewer_is_answered_by_the_machine_or_says_that_it_is_not() {
    let mut holder = Holder::share("127.0.0.1:0", 256);
    holder.say("enable");
    sleep(Duration::from_millis(500));
    assert!(text(&holder.look("status").stdout).starts_with("enabled"));
    holder.signal("-STOP");
    let refused = holder.look("disable");
    assert!(!refused.status.success(), "{}", text(&refused.stdout));
    let errors = text(&refused.stderr);
    assert!(errors.contains("the machine may go on"), "{errors}");
    holder.signal("-CONT");
    sleep(Duration::from_millis(500));
    let done = holder.look("disable");
    assert!(done.status.success(), "{}", text(&done.stderr));
    // Not a moment later: the answer was the machine's.
    let state = holder.look("status");
    assert!(text(&state.stdout).starts_with("disabled"));
}

#[test]
fn a_holder_without_descriptors_waits_for_them() {
    let holder = Holder::share("127.0.0.1:0", 14);
    let crowd: Vec<_> = (0..40)
        .map(|_| TcpStream::connect(holder.address()).unwrap())
        .collect();
    sleep(Duration::from_millis(300));
    let (before, began) = (holder.processor_time(), Instant::now());
    sleep(Duration::from_secs(1));
    let share = (holder.processor_time() - before).as_secs_f64() / began.elapsed().as_secs_f64();
    assert!(share < 0.3, "{share} of a processor");
    drop(crowd);
}

#[test]
fn a_port_alone_is_of_this_computer_and_a_network_needs_a_token() {
    let holder = Holder::share("0", 256);
    assert!(holder.address().starts_with("127.0.0.1:"));
    assert!(holder.look("status").status.success());

    let mut holder = Holder::share("0.0.0.0:0", 256);
    holder.look[1] = holder.look[1].replace("0.0.0.0", "127.0.0.1");
    let seen = holder.look("status");
    assert!(seen.status.success(), "{}", text(&seen.stderr));
    assert_eq!(holder.look[2], "--token");
    holder.look[3].replace_range(..1, "x");
    for others in [4, 2] {
        holder.look.truncate(others);
        for command in ["status", "stop"] {
            let refused = holder.look(command);
            assert!(!refused.status.success());
            let errors = text(&refused.stderr);
            assert!(errors.contains("--token"), "{errors}");
        }
    }
}

/// The files below a folder.
fn files(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(folder).unwrap().flatten();
    entries
        .flat_map(|entry| match entry.file_type().unwrap().is_dir() {
            true => files(&entry.path()),
            false => vec![entry.path()],
        })
        .collect()
}

#[test]
fn a_lock_is_in_a_folder_of_the_users_own_and_follows_no_link() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(&path).unwrap();
        path
    };
    let (shared, own) = (at("shared"), at("own"));
    for runtime in [Some(&own), None] {
        let hello = || {
            let mut command = Command::new(PROGRAM);
            command
                .args(["connect", "--tcp", "127.0.0.1:1", "hello"])
                .env("TMPDIR", &shared)
                .env_remove("XDG_RUNTIME_DIR");
            command.envs(runtime.map(|own| ("XDG_RUNTIME_DIR", own)));
            text(&command.output().unwrap().stderr)
        };
        hello();
        let locks = files(runtime.unwrap_or(&shared));
        assert_eq!(locks.len(), 1, "{locks:?}");
        assert_ne!(locks[0].parent(), Some(&*shared), "anybody's folder");
        let precious = folder.path().join("precious");
        fs::write(&precious, "a thesis").unwrap();
        fs::remove_file(&locks[0]).unwrap();
        symlink(&precious, &locks[0]).unwrap();
        let said = hello();
        assert_eq!(fs::read_to_string(&precious).unwrap(), "a thesis");
        assert!(said.contains(locks[0].to_str().unwrap()), "{said}");
        fs::remove_file(&locks[0]).unwrap();
    }
}

#[test]
fn connections_beyond_the_viewers_and_silent_ones_are_closed() {
    let holder = Holder::share("127.0.0.1:0", 1024);
    let connect = || {
        let stream = TcpStream::connect(holder.address()).unwrap();
        stream.set_nonblocking(true).unwrap();
        stream
    };
    let mut crowd: Vec<_> = (0..300).map(|_| connect()).collect();
    sleep(Duration::from_millis(500));
    let open = |crowd: &mut [TcpStream]| {
        let is_open = |stream: &mut TcpStream| {
            let read = stream.read(&mut [0; 64]);
            read.is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock)
        };
        crowd.iter_mut().map(is_open).filter(|open| *open).count()
    };
    let kept = open(&mut crowd);
    assert!((1..=16).contains(&kept), "{kept} connections are kept");
    sleep(Duration::from_secs(3));
    assert_eq!(open(&mut crowd), 0);
    let seen = holder.look("status");
    assert!(seen.status.success(), "{}", text(&seen.stderr));
}
