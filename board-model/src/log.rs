//! Log of the firmware, drained from RTT's up-channel 0 as a probe does, and decoded with the image's own table.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

use defmt_decoder::{DecodeError, StreamDecoder, Table};
use rigless::emulator::Host;
use rigless::soc::Width;

/// True if lines are printed as they come.
pub static SHOWN: AtomicBool = AtomicBool::new(false);

/// Mode in which a probe reads the log.
const READ_BY_PROBE: u64 = 2;
/// The firmware's own mode.
const TRIMS: u64 = 1;

/// The log so far.
pub struct Log {
    block: Option<u64>,
    /// A probe reads the log.
    pub is_read: bool,
    decoder: Box<dyn StreamDecoder + Send>,
    /// Lines, each with its virtual time.
    pub lines: Vec<String>,
}

impl fmt::Debug for Log {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(&self.lines).finish()
    }
}

impl Log {
    /// The log of an image whose control block of RTT is at an address.
    ///
    /// # Errors
    /// The image has no table of its log's texts.
    pub fn new(elf: &[u8], block: Option<u64>) -> Result<Self, String> {
        let table = Table::parse(elf).map_err(|error| error.to_string())?;
        // One table a run of a scenario, as long as the process lives.
        let table: &'static Table = Box::leak(Box::new(table.ok_or("the image has no log")?));
        Ok(Self {
            block,
            is_read: true,
            decoder: table.new_stream_decoder(),
            lines: Vec::new(),
        })
    }

    /// Takes what the firmware has written.
    pub fn drain(&mut self, host: &mut dyn Host, now: u64) {
        let Some(block) = self.block else {
            return;
        };
        let mut word = |address: u64| host.read(address, Width::W32).unwrap_or(0);
        // SEGGER's control block: id[16], counts of up- and down-channels, then name, buffer, size, write, read of channel 0.
        if word(block) != u64::from(u32::from_le_bytes(*b"SEGG")) {
            return;
        }
        let up = block + 24;
        let mode = if self.is_read { READ_BY_PROBE } else { TRIMS };
        if word(up + 20) != mode {
            // Its place is in RAM, as that of all that follows.
            let _ = host.write(up + 20, Width::W32, mode);
        }
        if !self.is_read {
            return;
        }
        let mut word = |address: u64| host.read(address, Width::W32).unwrap_or(0);
        let (buffer, size, write, mut read) =
            (word(up + 4), word(up + 8), word(up + 12), word(up + 16));
        if write >= size || read >= size {
            return;
        }
        let mut bytes = Vec::new();
        while read != write {
            bytes.push(host.read(buffer + read, Width::W8).unwrap_or(0) as u8);
            read = (read + 1) % size;
        }
        if bytes.is_empty() || host.write(up + 16, Width::W32, read).is_err() {
            return;
        }
        self.decode(&bytes, now);
    }

    /// Decodes frames, or parts of them, into lines.
    pub fn decode(&mut self, bytes: &[u8], now: u64) {
        self.decoder.received(bytes);
        loop {
            match self.decoder.decode() {
                Ok(frame) => {
                    let level = frame.level().map_or("", |level| level.as_str());
                    let line = format!(
                        "{:.4} s {level} {}",
                        now as f64 * 1e-9,
                        frame.display_message()
                    );
                    if SHOWN.load(Ordering::Relaxed) {
                        println!("    {line}");
                    }
                    self.lines.push(line);
                }
                Err(DecodeError::UnexpectedEof) => break,
                // The next frame begins after a delimiter.
                Err(DecodeError::Malformed) => self.lines.push("a damaged frame of the log".into()),
            }
        }
    }
}
