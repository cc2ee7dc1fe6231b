//! Text of a bounded length.

use core::fmt::{self, Write as _};

use heapless::String;
use heapless::string::StringView;

/// The text of an error or of a line of the log: up to 192 bytes of UTF-8.
pub type Text = String<192>;

/// The text of what is formatted; what does not fit is cut off between two characters.
pub fn text<const N: usize>(arguments: fmt::Arguments<'_>) -> String<N> {
    let mut text = String::new();
    // Only says that something was cut.
    let _ = Cut(text.as_mut_view()).write_fmt(arguments);
    text
}

/// A string of any capacity that takes what fits and then no more.
struct Cut<'a>(&'a mut StringView);

impl fmt::Write for Cut<'_> {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        let fits = part.floor_char_boundary(self.0.capacity() - self.0.len());
        // By `get`: slicing, should it fail, would want to print the text.
        let _ = self.0.push_str(part.get(..fits).unwrap_or_default());
        if fits == part.len() {
            Ok(())
        } else {
            Err(fmt::Error)
        }
    }
}
