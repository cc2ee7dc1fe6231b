//! Flashing a board: what is refused before a debug probe is looked for, and what is asked of one.

use std::fs;

use tempfile::TempDir;

use crate::command;

/// An ELF file without a section (System V ABI, chapter 4).
pub(crate) fn empty_elf() -> Vec<u8> {
    // 32 bits, the least byte first; an executable file for Arm with a header of 52 bytes.
    let mut elf = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0\x02\0\x28\0\x01\0\0\0".to_vec();
    elf.extend([0; 16]);
    elf.extend(
        [52_u16, 32, 0, 40, 0, 0]
            .map(u16::to_le_bytes)
            .as_flattened(),
    );
    elf
}

/// A folder with such a file, and with one that is none.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("own.elf"), empty_elf()).unwrap();
    fs::write(folder.path().join("text.elf"), "an image").unwrap();
    folder
}

#[test]
fn what_is_no_image_is_refused_for_what_it_is() {
    let folder = folder();
    for (file, reason) in [
        ("none.elf", "no such file"),
        (".", "folder"),
        ("text.elf", "no ELF file"),
    ] {
        let words = ["connect", "flash", file, "--chip", "STM32F446RETx"];
        let said = command::fail(folder.path(), &words);
        assert!(said.contains(reason), "{file}: {said}");
    }
}

#[test]
fn a_machine_behind_an_option_is_not_flashed() {
    let folder = folder();
    for machine in ["--simulated", "--port=/dev/ttyACM0"] {
        let words = [
            "connect",
            machine,
            "flash",
            "own.elf",
            "--chip",
            "STM32F446RETx",
        ];
        let said = command::fail(folder.path(), &words);
        assert!(
            said.contains("--simulated") && said.contains("probe"),
            "{said}"
        );
    }
}

#[test]
fn an_image_that_names_no_chip_is_refused() {
    let folder = folder();
    for words in [&["flash", "own.elf"][..], &["log", "--elf", "own.elf"]] {
        let said = command::fail(folder.path(), &[&["connect"], words].concat());
        assert!(
            said.contains("own.elf") && said.contains("--chip"),
            "{said}"
        );
    }
}

#[test]
fn a_probe_is_of_an_image() {
    let folder = folder();
    let words = ["connect", "--simulated", "log", "--probe", "0483:374b"];
    let said = command::fail(folder.path(), &words);
    assert!(said.contains("--elf"), "{said}");
}

/// No probe has these numbers: nothing is flashed where one is connected.
#[cfg(feature = "flash")]
const NO_PROBE: &str = "0000:0000:none";

#[cfg(feature = "flash")]
#[test]
fn without_a_debug_probe_the_refusal_names_it() {
    let folder = folder();
    let words = ["connect", "flash", "own.elf", "--chip", "STM32F446RETx"];
    let said = command::fail(
        folder.path(),
        &[&words[..], &["--probe", NO_PROBE]].concat(),
    );
    let refused = said.contains("no debug probe is found") || said.contains("no probe is 0000");
    assert!(refused, "{said}");
}

#[cfg(feature = "flash")]
#[test]
fn a_chip_or_a_probe_that_cannot_be_is_refused() {
    let folder = folder();
    let flash = |chip: &str, probe: &str| {
        let words = [
            "connect", "flash", "own.elf", "--chip", chip, "--probe", probe,
        ];
        command::fail(folder.path(), &words)
    };
    let said = flash("STM32F999", NO_PROBE);
    assert!(said.contains("knows no such chip"), "{said}");
    let said = flash("STM32F446RETx", "first");
    assert!(said.contains("VID:PID:SERIAL"), "{said}");
}

/// A fault or a reset that the probe caught would hold the processor before the firmware has switched the outputs off.
#[cfg(all(unix, not(feature = "flash")))]
#[test]
fn the_program_flashes_verifies_and_catches_no_fault() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let program = folder.path().join("probe-rs");
    fs::write(&program, "#!/bin/sh\necho \"asked: $*\"\n").unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let path = std::env::var("PATH").unwrap();
    let asked = |words: &[&str]| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_quadrant"))
            .arg("connect")
            .args(words)
            .args(["--chip", "STM32H743ZITx", "--probe", "0483:374e"])
            .current_dir(folder.path())
            .env("PATH", format!("{}:{path}", folder.path().display()))
            .output()
            .unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stdout).unwrap()
    };
    let of = "--chip STM32H743ZITx --probe 0483:374e";
    assert_eq!(
        asked(&["flash", "own.elf"]),
        format!("asked: download {of} --verify own.elf\nasked: reset {of}\n")
    );
    let lets_run = "--no-catch-hardfault --no-catch-reset own.elf";
    assert_eq!(
        asked(&["flash", "own.elf", "--run"]),
        format!("asked: run {of} {lets_run}\n")
    );
    assert_eq!(
        asked(&["log", "--elf", "own.elf"]),
        format!("asked: attach {of} {lets_run}\n")
    );
}
