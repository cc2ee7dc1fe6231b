//! Text of a bounded length.

use core::fmt::{self, Write as _};

use heapless::String;

/// What an error or a line of the log has to say: up to 192 bytes of UTF-8.
pub type Text = String<192>;

/// The text of what is formatted; what does not fit is cut off between two characters.
pub fn text<const N: usize>(arguments: fmt::Arguments<'_>) -> String<N> {
    let mut cut = Cut(String::new());
    // Only says that something was cut.
    let _ = cut.write_fmt(arguments);
    cut.0
}

/// A string that takes what fits and then no more.
struct Cut<const N: usize>(String<N>);

impl<const N: usize> fmt::Write for Cut<N> {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        let fits = part.floor_char_boundary(N - self.0.len());
        let _ = self.0.push_str(&part[..fits]);
        if fits == part.len() {
            Ok(())
        } else {
            Err(fmt::Error)
        }
    }
}
