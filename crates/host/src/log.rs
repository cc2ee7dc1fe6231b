//! The firmware's log: defmt frames, decoded with the strings in its image.

use std::fmt;
use std::io;
use std::path::Path;

use defmt_decoder::{DecodeError, Encoding, Table};
use quadrant_link::message::LogPage;

/// Byte that ends a frame.
const DELIMITER: u8 = 0;

/// Levels, the least first, as lines have them.
pub const LEVELS: [&str; 5] = ["TRACE", "DEBUG", "INFO", "WARN", "ERROR"];

/// Choice of lines.
#[derive(Clone, Debug, Default)]
pub struct LogFilter {
    /// Number of the least level in [`LEVELS`].
    pub level: usize,
    /// A word of the line, such as the name of an axis.
    pub word: Option<String>,
    /// First and last tick.
    pub ticks: (Option<u32>, Option<u32>),
}

impl LogFilter {
    /// True if a line is chosen: `0000076710 INFO x: homed`. One that is not of this form says something about the log, and is always chosen.
    pub fn admits(&self, line: &str) -> bool {
        let mut parts = line.splitn(3, ' ');
        let tick = parts.next().and_then(|tick| tick.parse::<u32>().ok());
        let level = parts.next();
        let level = LEVELS.iter().position(|name| level == Some(name));
        let (Some(tick), Some(level)) = (tick, level) else {
            return true;
        };
        let text = parts.next().unwrap_or("");
        let mut words = text.split(|letter: char| !letter.is_alphanumeric());
        let (first, last) = self.ticks;
        level >= self.level
            && self
                .word
                .as_ref()
                .is_none_or(|word| words.any(|other| other == word))
            && first.is_none_or(|first| tick >= first)
            && last.is_none_or(|last| tick <= last)
    }
}

/// Decodes frames as they come, in pieces of any size.
pub struct LogDecoder {
    table: Table,
    /// The beginning of a frame.
    begun: Vec<u8>,
    /// The beginning of this frame is lost.
    lost: bool,
    next: u32,
}

impl LogDecoder {
    /// A decoder with the strings of an image.
    ///
    /// # Errors
    /// A file that cannot be read, or that is no image with a log.
    pub fn of_image(path: &Path) -> io::Result<Self> {
        let named = |text: String| io::Error::other(format!("{}: {text}", path.display()));
        let elf = std::fs::read(path).map_err(|error| named(error.to_string()))?;
        let table = table(&elf).map_err(named)?;
        Ok(Self {
            table,
            begun: Vec::new(),
            lost: false,
            next: 0,
        })
    }

    /// Number of the first byte that is still missing.
    pub const fn next(&self) -> u32 {
        self.next
    }

    /// Takes a page of the log over the link; the lines that are whole, and what was lost.
    pub fn page(&mut self, page: &LogPage) -> Vec<String> {
        let missing = page.from.wrapping_sub(self.next) as i32;
        let mut lines = Vec::new();
        if missing != 0 {
            self.begun.clear();
            self.lost = missing > 0;
            lines.push(if missing > 0 {
                format!("({missing} bytes of the log were lost)")
            } else {
                "(the board has restarted)".to_owned()
            });
        }
        self.next = page.from.wrapping_add(page.bytes.len() as u32);
        lines.extend(self.push(&page.bytes));
        lines
    }

    /// Takes bytes of the log; the lines that are whole.
    pub fn push(&mut self, mut bytes: &[u8]) -> Vec<String> {
        if self.lost {
            let Some(end) = bytes.iter().position(|&byte| byte == DELIMITER) else {
                return Vec::new();
            };
            bytes = &bytes[end + 1..];
            self.lost = false;
        }
        self.begun.extend(bytes);
        let Some(last) = self.begun.iter().rposition(|&byte| byte == DELIMITER) else {
            return Vec::new();
        };
        let rest = self.begun.split_off(last + 1);
        let whole = std::mem::replace(&mut self.begun, rest);
        decode(&self.table, &whole)
    }
}

impl fmt::Debug for LogDecoder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LogDecoder")
            .field("next", &self.next)
            .finish_non_exhaustive()
    }
}

/// The strings of an image's log.
pub(crate) fn table(elf: &[u8]) -> Result<Table, String> {
    let table = Table::parse(elf)
        .map_err(|error| format!("its log strings do not parse: {error}"))?
        .ok_or("it has no log strings")?;
    if table.encoding() != Encoding::Rzcobs {
        return Err("its log is not in frames".to_owned());
    }
    Ok(table)
}

/// The lines in whole frames.
pub(crate) fn decode(table: &Table, frames: &[u8]) -> Vec<String> {
    let mut decoder = table.new_stream_decoder();
    decoder.received(frames);
    let mut lines = Vec::new();
    loop {
        match decoder.decode() {
            Ok(frame) => lines.push(frame.display(false).to_string()),
            Err(DecodeError::Malformed) => {
                lines.push("(a line that is damaged, or of another image)".to_owned());
            }
            Err(DecodeError::UnexpectedEof) => return lines,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::LogFilter;

    #[test]
    fn a_filter_chooses_by_level_word_and_tick() {
        let of = LogFilter::default;
        let admits = |filter: LogFilter| filter.admits("0000076710 INFO x: homed");
        let word = |word: &str| LogFilter {
            word: Some(word.to_owned()),
            ..of()
        };
        let ticks = |first, last| LogFilter {
            ticks: (first, last),
            ..of()
        };
        for level in 0..5 {
            assert_eq!(admits(LogFilter { level, ..of() }), level <= 2);
        }
        assert!(admits(word("x")) && !admits(word("h")));
        assert!(admits(ticks(Some(76_710), Some(76_710))));
        assert!(!admits(ticks(Some(76_711), None)) && !admits(ticks(None, Some(76_709))));
        assert!(word("x").admits("(12 bytes of the log were lost)"));
    }
}
