//! Standard output and standard error, which may be closed or full: the work goes on, and its files are written.
//!
//! [`say!`](crate::say) and [`warn!`](crate::warn) stand in for `println!` and `eprintln!`, which panic there. What they print may
//! come from a board, a file or a link, so that nothing of it acts on the terminal: characters that would are shown by their
//! number.

use std::fmt::{self, Arguments, Write as _};
use std::io::{self, IsTerminal, StdoutLock, Write};
use std::sync::Mutex;

use quadrant_report::wrapped;

/// The first error of standard output.
static FAILED: Mutex<Option<io::Error>> = Mutex::new(None);

/// Prints a line to standard output.
#[macro_export]
macro_rules! say {
    () => { $crate::terminal::print(format_args!("\n")) };
    ($($what:tt)*) => { $crate::terminal::print(format_args!("{}\n", format_args!($($what)*))) };
}

/// Prints a line to standard error.
#[macro_export]
macro_rules! warn {
    ($($what:tt)*) => { $crate::terminal::print_error(format_args!("{}\n", format_args!($($what)*))) };
}

/// Sequence that empties a terminal and begins at its top.
const CLEAR: &[u8] = b"\x1b[2J\x1b[H";

/// Characters of a line where nobody says how wide it is: a file, another program.
const WIDTH: usize = 80;

/// Returns the characters of a line of the terminal that standard output is; 80 of what is no terminal.
pub fn output_width() -> usize {
    width(&io::stdout())
}

/// Returns the characters of a line of the terminal that standard error is; 80 of what is no terminal.
pub fn error_width() -> usize {
    width(&io::stderr())
}

#[cfg(unix)]
fn width(of: &impl std::os::fd::AsFd) -> usize {
    terminal_size::terminal_size_of(of).map_or(WIDTH, |(width, _)| width.0.into())
}

#[cfg(windows)]
fn width(of: &impl std::os::windows::io::AsHandle) -> usize {
    terminal_size::terminal_size_of(of).map_or(WIDTH, |(width, _)| width.0.into())
}

/// Prints to standard output, unless that has failed before; long lines of prose are folded on a terminal.
pub fn print(what: Arguments<'_>) {
    let out = io::stdout();
    if out.is_terminal() {
        let text = folded(&what.to_string(), width(&out));
        to_output(|out| write_plain(out, format_args!("{text}")));
    } else {
        to_output(|out| write_plain(out, what));
    }
}

/// Empties the terminal that standard output is.
pub fn clear() {
    to_output(|out| out.write_all(CLEAR));
}

fn to_output(write: impl FnOnce(&mut StdoutLock<'static>) -> io::Result<()>) {
    let Ok(mut failed) = FAILED.lock() else {
        return;
    };
    if failed.is_none() {
        let mut out = io::stdout().lock();
        *failed = write(&mut out).and_then(|()| out.flush()).err();
    }
}

/// Prints to standard error, if that can be.
pub fn print_error(what: Arguments<'_>) {
    let text = match io::stderr().is_terminal() {
        true => folded(&what.to_string(), error_width()),
        false => what.to_string(),
    };
    // If this fails, there is nowhere left to say so.
    let _ = write_plain(&mut io::stderr().lock(), format_args!("{text}"));
}

/// A text whose long lines of prose are broken between words. Commands to be copied (indented), rows of tables (two spaces in
/// a row) and data (JSON) stay whole.
fn folded(text: &str, width: usize) -> String {
    let lines = text.split_inclusive('\n').map(|line| {
        let bare = line.trim_end_matches('\n');
        let whole = line.starts_with([' ', '{', '[']) || bare.contains("  ");
        if whole || bare.chars().count() <= width {
            return line.to_owned();
        }
        wrapped(bare, width).join("\n") + &line[bare.len()..]
    });
    lines.collect()
}

/// Writes a text without anything that acts on a terminal.
fn write_plain(out: &mut impl Write, what: Arguments<'_>) -> io::Result<()> {
    let mut plain = Plain { out, failed: None };
    let written = plain.write_fmt(what);
    match plain.failed {
        Some(error) => Err(error),
        None => written.map_err(io::Error::other),
    }
}

/// A text without anything that acts on a terminal.
pub fn plain(text: &str) -> String {
    text.chars().fold(String::new(), |mut plain, sign| {
        let _ = match acts(sign) {
            true => write!(plain, "\\u{:04x}", u32::from(sign)),
            false => plain.write_char(sign),
        };
        plain
    })
}

/// True for a character that moves the cursor, begins a sequence, or turns or hides the text behind it. Of the control
/// characters, a line's end and a tab are text.
const fn acts(sign: char) -> bool {
    match sign {
        '\n' | '\t' => false,
        // C0, DEL and C1.
        '\0'..='\u{1f}' | '\u{7f}'..='\u{9f}' => true,
        // Direction of writing, separators of lines, and what has no width.
        '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' => {
            true
        }
        '\u{feff}' | '\u{fff9}'..='\u{fffb}' => true,
        _ => false,
    }
}

/// A writer that shows what [`acts`] by its number, as JSON does: a line of JSON stays the same value.
struct Plain<'a, W> {
    out: &'a mut W,
    failed: Option<io::Error>,
}

impl<W: Write> fmt::Write for Plain<'_, W> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let written = match text.contains(acts) {
            true => self.out.write_all(plain(text).as_bytes()),
            false => self.out.write_all(text.as_bytes()),
        };
        self.failed = written.err();
        match self.failed {
            Some(_) => Err(fmt::Error),
            None => Ok(()),
        }
    }
}

/// The modes of the terminal that standard input is, as this program leaves it.
#[cfg(unix)]
static MODES: Mutex<Option<rustix::termios::Termios>> = Mutex::new(None);

/// Lets Ctrl-C interrupt what is under way, also where an earlier program has left the terminal without, and keeps its modes for
/// [`restore_modes`].
#[cfg(unix)]
pub fn keep_modes() {
    use rustix::termios::{LocalModes, tcgetattr};
    let needed = LocalModes::ISIG | LocalModes::ICANON;
    let (Ok(mut kept), Ok(mut modes)) = (MODES.lock(), tcgetattr(rustix::stdio::stdin())) else {
        return;
    };
    let found = modes.local_modes;
    modes.local_modes |= needed;
    *kept = Some(modes);
    drop(kept);
    if found & needed != needed {
        restore_modes();
    }
}

/// Gives the terminal the modes that it had, but for an interrupt that was missing.
#[cfg(unix)]
pub fn restore_modes() {
    use rustix::process::getpgrp;
    use rustix::termios::{OptionalActions, tcgetpgrp, tcsetattr};
    let input = rustix::stdio::stdin();
    if let Ok(kept) = MODES.lock()
        && let Some(modes) = &*kept
        // A program in the background would be stopped for it.
        && tcgetpgrp(input).is_ok_and(|front| front == getpgrp())
    {
        let _ = tcsetattr(input, OptionalActions::Drain, modes);
    }
}

/// True unless the terminal at standard input has been closed.
#[cfg(unix)]
pub fn is_there() -> bool {
    rustix::termios::tcgetattr(rustix::stdio::stdin()).is_ok()
}

/// Only Unix shows it before it is read.
#[cfg(not(unix))]
pub fn is_there() -> bool {
    true
}

/// Only Unix has terminals with modes.
#[cfg(not(unix))]
pub fn keep_modes() {}

/// Only Unix has terminals with modes.
#[cfg(not(unix))]
pub fn restore_modes() {}

/// Says whether everything was printed.
///
/// # Errors
/// A device that is full, say. A reader that has seen enough, such as `head`, is none.
pub fn finish() -> anyhow::Result<()> {
    match FAILED.lock().ok().and_then(|mut failed| failed.take()) {
        Some(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(anyhow::Error::new(error).context("cannot write to standard output"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::{folded, write_plain};

    #[test]
    fn a_long_line_of_prose_is_broken_between_words_and_what_is_to_be_copied_stays_whole() {
        let text = "error: the axis stands\n    quadrant commission --axis x\n\nshort\n";
        let expected = "error: the axis\nstands\n    quadrant commission --axis x\n\nshort\n";
        assert_eq!(folded(text, 16), expected);
        for whole in ["axis  homed  follows\n", "{\"command\": \"status\"}\n"] {
            assert_eq!(folded(whole, 16), whole);
        }
    }

    #[test]
    fn what_controls_a_terminal_is_shown_by_its_number_and_text_is_as_it_was() {
        let printed = |text: &str| {
            let mut out = Vec::new();
            write_plain(&mut out, format_args!("{text}")).unwrap();
            String::from_utf8(out).unwrap()
        };
        let text = "x \u{b5}m \u{2801} \u{e4}\t1\n";
        assert_eq!(printed(text), text);
        // The clipboard, the cursor, a line written over, C1's sequences, and names from right to left.
        assert_eq!(printed("\x1b]52;c;aGk=\x07"), "\\u001b]52;c;aGk=\\u0007");
        assert_eq!(printed("a\rb\x08\x7f"), "a\\u000db\\u0008\\u007f");
        assert_eq!(printed("\u{9b}2J\u{85}"), "\\u009b2J\\u0085");
        assert_eq!(printed("\u{202e}lmot\u{2066}"), "\\u202elmot\\u2066");
    }
}
