//! Texts of a board, a file or a link reach a terminal as text: nothing of them moves its cursor or fills its clipboard.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Output};
use std::thread;

use quadrant_link::PROTOCOL_VERSION;
use quadrant_link::frame::{self, FRAME_BYTES};
use quadrant_link::message::{
    Body, FaultReport, Identity, LinkError, Message, Notice, NumberType, Reply, text,
};
use quadrant_link::server::LinkServer;

use crate::command;

/// A clipboard's content, a line that is written over, a sequence of C1, names from right to left, and a line of its own.
const ACTS: [&str; 5] = [
    "\x1b]52;c;aGk=\x07",
    "a\rb",
    "\u{9b}2J",
    "\u{202e}x\u{2066}",
    "a\nforged",
];

fn assert_plain(output: &Output) {
    for stream in [&output.stdout, &output.stderr] {
        let said = String::from_utf8(stream.clone()).unwrap();
        let acts = |sign: char| {
            (sign.is_control() && sign != '\n')
                || ('\u{202a}'..='\u{202e}').contains(&sign)
                || ('\u{2066}'..='\u{2069}').contains(&sign)
        };
        assert!(!said.contains(acts), "{said:?}");
        assert!(
            !said.lines().any(|line| line.starts_with("forged")),
            "{said:?}"
        );
    }
}

/// A board that says nothing but such texts, to one program.
fn board() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let all = ACTS.concat();
    let serve = move |body| match body {
        Body::Hello => Ok(Reply::Identity(Identity {
            protocol: PROTOCOL_VERSION,
            firmware: text(format_args!("{}", ACTS[0])),
            board: text(format_args!("{all}")),
            rate_hz: 1e4,
            cycle_hz: 0,
            number: NumberType::F32,
            tick: 0,
        })),
        Body::Fault => Ok(Reply::Fault(Some(FaultReport {
            code: 1,
            axis: None,
            tick: 0,
            name: text(format_args!("{}", ACTS[2])),
            cause: text(format_args!("{all}")),
            remedy: text(format_args!("{all}")),
            captured: false,
        }))),
        _ => Err(LinkError::Unsupported(text(format_args!(
            "{}",
            ACTS.concat()
        )))),
    };
    thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut server = LinkServer::new();
        let mut buffer = [0; FRAME_BYTES];
        let send = |stream: &mut std::net::TcpStream, message: &Message| {
            let mut frame = [0; FRAME_BYTES];
            let _ = stream.write_all(frame::encode(message, &mut frame).unwrap());
        };
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            for &byte in &buffer[..count] {
                if let Some(response) = server.push(byte, &serve) {
                    send(&mut stream, &Message::Response(response));
                    let log = text(format_args!("{}", ACTS.concat()));
                    send(&mut stream, &Message::Notice(Notice::Log(log)));
                }
            }
        }
    });
    address
}

#[test]
fn texts_of_a_board_do_not_act_on_the_terminal() {
    for options in [&["--keep-going"][..], &["--keep-going", "--json"]] {
        let board = board();
        let output = command::play(
            Path::new("."),
            &[&["connect", "--tcp", &board], options].concat(),
            "hello\nevents\nfault\nget x/homing\n",
        );
        let said = String::from_utf8_lossy(&output.stdout);
        // It is shown, by its number.
        assert!(said.contains("\\u001b]52;c;aGk=\\u0007"), "{said:?}");
        assert!(said.contains("\\u009b2J"), "{said:?}");
        for line in said.lines().filter(|_| options.contains(&"--json")) {
            serde_json::from_str::<serde_json::Value>(line).unwrap();
        }
        assert_plain(&output);
        let warned = String::from_utf8_lossy(&output.stderr);
        assert!(warned.contains("use those of one release"), "{warned}");
    }
}

#[test]
fn a_file_that_is_refused_does_not_act_on_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("stage.toml");
    let recording = folder.path().join("run.csv");
    for act in ACTS {
        std::fs::write(&settings, format!("form = 1\nstage = {act} 1\n")).unwrap();
        std::fs::write(&recording, format!("t_s,{act}\n0,1\n")).unwrap();
        for words in [
            &["connect", "--simulated", "load", "stage.toml"][..],
            &["commission", "--axis", "x", "--settings", "stage.toml"],
            &["identify", "frf", "--record", "run.csv"],
        ] {
            let output = Command::new(env!("CARGO_BIN_EXE_quadrant"))
                .args(words)
                .current_dir(folder.path())
                .output()
                .unwrap();
            assert!(!output.status.success());
            assert_plain(&output);
        }
    }
}

// With the feature `flash`, no program prints it.
#[cfg(all(unix, not(feature = "flash")))]
#[test]
fn a_log_through_the_debug_probe_does_not_act_on_the_terminal() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let probe = folder.path().join("probe-rs");
    let elf = folder.path().join("firmware.elf");
    std::fs::write(&elf, crate::flash::empty_elf()).unwrap();
    // A line of the probe's program is a line.
    std::fs::write(folder.path().join("log"), ACTS[..4].join("\n")).unwrap();
    std::fs::write(&probe, "#!/bin/sh\ncat \"${0%/*}/log\"\n").unwrap();
    std::fs::set_permissions(&probe, std::fs::Permissions::from_mode(0o755)).unwrap();
    let path = std::env::var("PATH").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_quadrant"))
        .args(["connect", "log", "--elf"])
        .arg(&elf)
        .args(["--chip", "STM32F446RETx"])
        .env("PATH", format!("{}:{path}", folder.path().display()))
        .output()
        .unwrap();
    assert!(output.status.success());
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("\\u001b]52;c;aGk="), "{said:?}");
    assert_plain(&output);
}
