//! A client of QEMU's debugger port: just enough of GDB's remote protocol to look into a stopped processor and step it.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

/// Timeout of QEMU's port and answers.
const TIMEOUT: Duration = Duration::from_secs(20);

/// The number of the program counter among the registers r0 to r15.
pub(crate) const PROGRAM_COUNTER: usize = 15;

/// The number of the stack pointer.
pub(crate) const STACK_POINTER: usize = 13;

/// The path of a socket for the port, removed when dropped.
pub(crate) struct Port(PathBuf);

impl Port {
    pub(crate) fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("quadrant-debugger-{}-{number}", std::process::id());
        Self(std::env::temp_dir().join(name))
    }

    /// Lets QEMU open the port, and stop before the first instruction.
    pub(crate) fn add_to(&self, qemu: &mut Command) {
        let port = self.0.display();
        qemu.args(["-S", "-gdb", "chardev:port", "-chardev"])
            .arg(format!("socket,id=port,path={port},server=on,wait=off"));
    }

    /// Connects to it.
    pub(crate) fn connect(&self) -> Result<Debugger> {
        Debugger::connect(&self.0)
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        // It may never have been there.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// A stopped processor.
pub(crate) struct Debugger {
    stream: UnixStream,
    received: Vec<u8>,
}

impl Debugger {
    /// Connects to the port, which QEMU opens a moment after its start.
    fn connect(path: &Path) -> Result<Self> {
        let begun = Instant::now();
        let stream = loop {
            match UnixStream::connect(path) {
                Ok(stream) => break stream,
                Err(_) if begun.elapsed() < TIMEOUT => thread::sleep(Duration::from_millis(20)),
                Err(error) => {
                    return Err(error).context("QEMU has not opened its debugger port");
                }
            }
        };
        stream.set_read_timeout(Some(TIMEOUT))?;
        let mut debugger = Self {
            stream,
            received: Vec::new(),
        };
        // Single registers are answered only to a client that has asked which there are.
        debugger.ask("qXfer:features:read:target.xml:0,fff")?;
        Ok(debugger)
    }

    /// A register, r0 to r15.
    pub(crate) fn register(&mut self, number: usize) -> Result<u32> {
        let answer = self.ask(&format!("p{number:x}"))?;
        let bytes = bytes(&answer)?;
        let word = bytes.first_chunk().context("a register has four bytes")?;
        Ok(u32::from_le_bytes(*word))
    }

    /// Sets a register, r0 to r15.
    pub(crate) fn set_register(&mut self, number: usize, value: u32) -> Result<()> {
        let value = hex(&value.to_le_bytes());
        self.order(&format!("P{number:x}={value}"))
    }

    /// Memory.
    pub(crate) fn read(&mut self, address: u32, length: usize) -> Result<Vec<u8>> {
        let answer = self.ask(&format!("m{address:x},{length:x}"))?;
        let read = bytes(&answer)?;
        ensure!(
            read.len() == length,
            "{length} bytes at {address:#010x} cannot be read"
        );
        Ok(read)
    }

    /// A word of memory.
    pub(crate) fn word(&mut self, address: u32) -> Result<u32> {
        let read = self.read(address, 4)?;
        let word = read.first_chunk().context("a word has four bytes")?;
        Ok(u32::from_le_bytes(*word))
    }

    /// Writes memory; peripherals are out of reach this way.
    pub(crate) fn write(&mut self, address: u32, data: &[u8]) -> Result<()> {
        let length = data.len();
        self.order(&format!("M{address:x},{length:x}:{}", hex(data)))
    }

    /// Executes one instruction. Interrupts wait meanwhile.
    pub(crate) fn step(&mut self) -> Result<()> {
        self.ask("s").map(drop)
    }

    /// Runs for a while of the host's time, then stops.
    pub(crate) fn run(&mut self, time: Duration) -> Result<()> {
        self.send("c")?;
        thread::sleep(time);
        self.stop()
    }

    /// Runs until an instruction is about to be executed.
    pub(crate) fn run_to(&mut self, address: u32) -> Result<()> {
        self.order(&format!("Z0,{address:x},2"))?;
        self.ask("c")?;
        self.order(&format!("z0,{address:x},2"))
    }

    /// Runs until a word of memory has been written.
    pub(crate) fn run_to_write(&mut self, address: u32) -> Result<()> {
        self.order(&format!("Z2,{address:x},4"))?;
        self.ask("c")?;
        self.order(&format!("z2,{address:x},4"))
    }

    /// Runs on.
    pub(crate) fn resume(&mut self) -> Result<()> {
        self.send("c")
    }

    /// Stops.
    pub(crate) fn stop(&mut self) -> Result<()> {
        self.stream.write_all(&[3])?;
        self.answer().map(drop)
    }

    /// Gives a command to QEMU's monitor; one that it does not know does nothing.
    pub(crate) fn monitor(&mut self, command: &str) -> Result<()> {
        self.send(&format!("qRcmd,{}", hex(command.as_bytes())))?;
        // What the monitor prints comes in packets of its own.
        while self.answer()? != "OK" {}
        Ok(())
    }

    fn order(&mut self, packet: &str) -> Result<()> {
        let answer = self.ask(packet)?;
        ensure!(
            answer == "OK",
            "QEMU's debugger refused `{packet}`: {answer}"
        );
        Ok(())
    }

    fn ask(&mut self, packet: &str) -> Result<String> {
        self.send(packet)?;
        self.answer()
    }

    fn send(&mut self, packet: &str) -> Result<()> {
        let sum = packet.bytes().fold(0_u8, u8::wrapping_add);
        write!(self.stream, "${packet}#{sum:02x}").context("QEMU's debugger port is closed")
    }

    /// The next packet: `$text#sum`. Acknowledgements in between are skipped; the port loses nothing, so sums are not
    /// checked.
    fn answer(&mut self) -> Result<String> {
        loop {
            if let Some(begin) = self.received.iter().position(|&byte| byte == b'$')
                && let Some(length) = self.received[begin..].iter().position(|&byte| byte == b'#')
                && self.received.len() >= begin + length + 3
            {
                let text = self.received[begin + 1..begin + length].to_vec();
                self.received.drain(..begin + length + 3);
                self.stream.write_all(b"+")?;
                return String::from_utf8(text).context("QEMU's debugger answers in ASCII");
            }
            let mut buffer = [0; 4096];
            match self.stream.read(&mut buffer) {
                Ok(0) => bail!("QEMU has closed its debugger port"),
                Ok(length) => self.received.extend_from_slice(&buffer[..length]),
                Err(error) => return Err(error).context("QEMU's debugger does not answer"),
            }
        }
    }
}

fn hex(data: &[u8]) -> String {
    data.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn bytes(text: &str) -> Result<Vec<u8>> {
    let (pairs, rest) = text.as_bytes().as_chunks::<2>();
    ensure!(rest.is_empty(), "QEMU's debugger answered `{text}`");
    pairs
        .iter()
        .map(|pair| {
            let pair = std::str::from_utf8(pair)?;
            u8::from_str_radix(pair, 16)
                .with_context(|| format!("QEMU's debugger answered `{text}`"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_survive_the_way_through_hexadecimal() {
        let data = [0x00, 0x7F, 0x80, 0xFF];
        assert_eq!(hex(&data), "007f80ff");
        assert_eq!(bytes("007f80ff").expect("is hexadecimal"), data);
        assert!(bytes("E22").is_err(), "an error code is no memory");
    }

    #[test]
    fn packets_are_found_between_acknowledgements() {
        let (near, mut far) = UnixStream::pair().expect("the host has sockets");
        let mut debugger = Debugger {
            stream: near,
            received: Vec::new(),
        };
        far.write_all(b"+$OK#9a+$T05thread:01;#07").expect("sends");
        assert_eq!(debugger.answer().expect("is there"), "OK");
        assert_eq!(debugger.answer().expect("is there"), "T05thread:01;");
    }
}
