//! The log's latest bytes, for a host.

/// Takes bytes of the log out of a board's buffer, as many as there are and fit; `asked`: a host waits for them, else only what would be lost
/// soon.
pub type TakeLog = fn(bytes: &mut [u8], asked: bool) -> usize;

/// Bytes of the log that are kept.
const ROOM: usize = 2048;

/// Ring of the log's latest bytes, each with its number since the start.
#[derive(Clone, Debug)]
pub struct LogRing {
    bytes: [u8; ROOM],
    /// Bytes so far; wraps.
    total: u32,
    /// Bytes that are here.
    kept: usize,
}

impl LogRing {
    /// Returns an empty ring.
    pub const fn new() -> Self {
        Self {
            bytes: [0; ROOM],
            total: 0,
            kept: 0,
        }
    }

    /// Adds bytes in place of the oldest.
    pub fn push(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if let Some(place) = self.bytes.get_mut(self.total as usize % ROOM) {
                *place = byte;
            }
            self.total = self.total.wrapping_add(1);
        }
        self.kept = (self.kept + bytes.len()).min(ROOM);
    }

    /// Bytes from number `from` on, as many as `into` has room for, and the number of the first: a later one than `from` if that is not kept
    /// any more, and the oldest if there is no such number.
    pub fn read(&self, from: u32, into: &mut [u8]) -> (u32, usize) {
        let behind = (self.total.wrapping_sub(from) as usize).min(self.kept);
        let first = self.total.wrapping_sub(behind as u32);
        let count = behind.min(into.len());
        for (number, place) in into.iter_mut().take(count).enumerate() {
            let at = first.wrapping_add(number as u32) as usize % ROOM;
            *place = self.bytes.get(at).copied().unwrap_or(0);
        }
        (first, count)
    }
}

impl Default for LogRing {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::{LogRing, ROOM};

    #[test]
    fn bytes_are_read_from_any_number_that_is_kept() {
        let mut ring = LogRing::new();
        ring.push(b"abcdef");
        let mut page = [0; 4];
        assert_eq!(ring.read(0, &mut page), (0, 4));
        assert_eq!(&page, b"abcd");
        assert_eq!(ring.read(4, &mut page), (4, 2));
        assert_eq!(&page[..2], b"ef");
        assert_eq!(ring.read(6, &mut page), (6, 0));
    }

    #[test]
    fn the_oldest_gives_way_and_the_number_of_the_first_byte_says_how_much_is_lost() {
        let mut ring = LogRing::new();
        for number in 0..ROOM + 10 {
            ring.push(&[number as u8]);
        }
        let mut page = [0; 2];
        assert_eq!(ring.read(3, &mut page), (10, 2));
        assert_eq!(page, [10, 11]);
    }

    #[test]
    fn a_number_of_another_start_gives_the_oldest() {
        let mut ring = LogRing::new();
        ring.push(b"new");
        assert_eq!(ring.read(900, &mut [0; 8]), (0, 3));
    }
}
