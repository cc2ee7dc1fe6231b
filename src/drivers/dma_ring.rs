//! Reading what a DMA stream writes round and round into a ring, by polling.

/// Read position in a ring of `N` bytes.
///
/// The stream overwrites what nobody read. A reader that polls more often than the ring fills loses nothing; one that does
/// not gets what is in the ring when it comes back, and cannot detect it: frames carry a check sum for that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DmaRing<const N: usize> {
    next: usize,
}

impl<const N: usize> DmaRing<N> {
    /// A ring of which nothing was read.
    pub const fn new() -> Self {
        Self { next: 0 }
    }

    /// Copies what came since the last call, as much as `into` holds, and returns how much that was. `remaining` is the
    /// stream's count of bytes until it starts over, `N` down to 1; `byte` reads the ring.
    pub fn read(&mut self, remaining: usize, byte: impl Fn(usize) -> u8, into: &mut [u8]) -> usize {
        // A stream that was switched off shows 0, which is the ring's beginning like N is.
        let end = N.saturating_sub(remaining) % N;
        let mut copied = 0;
        for slot in into {
            if self.next == end {
                break;
            }
            *slot = byte(self.next);
            self.next = if self.next + 1 < N { self.next + 1 } else { 0 };
            copied += 1;
        }
        copied
    }
}
