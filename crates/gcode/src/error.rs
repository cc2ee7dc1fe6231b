//! Errors of a part program.

/// Error of a part program, with the line it stands in (from 1).
#[derive(Debug, thiserror::Error)]
pub enum ProgramError {
    /// The file cannot be read.
    #[error("cannot read {path}: {source}", path = .path.display())]
    Read {
        path: std::path::PathBuf,
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{path} has {bytes} bytes, more than {most}; split the program", path = .path.display())]
    TooLarge {
        path: std::path::PathBuf,
        bytes: u64,
        most: u64,
    },
    #[error("line {line}: {text:?} is not understood: {detail}")]
    Syntax {
        line: usize,
        text: String,
        detail: String,
    },
    /// A part of the language that a test of an axis does without.
    #[error("line {line}: {text}: {what} are not supported; write the moves out")]
    NotRead {
        line: usize,
        text: String,
        /// Name of it, in the plural.
        what: &'static str,
    },
    /// G-code that this program does not know.
    #[error("line {line}: {word} is not supported; supported are {supported}")]
    Unsupported {
        line: usize,
        /// The code or word.
        word: String,
        /// Values that could stand there.
        supported: &'static str,
    },
    /// A word stands twice, or two codes exclude each other.
    #[error("line {line}: {word} contradicts {other} in the same line; keep one of them")]
    Contradiction {
        line: usize,
        word: String,
        other: String,
    },
    /// Coordinates, and nothing says what to do with them.
    #[error("line {line}: {word} has no motion code; write G0, G1, G2 or G3 before it")]
    NoMotion { line: usize, word: String },
    /// A cutting move without a feed.
    #[error(
        "line {line}: {word} has no feed; write F, in mm/min (inch/min after G20), in this line or before it"
    )]
    NoFeed { line: usize, word: &'static str },
    /// A number below its limit.
    #[error("line {line}: {word} must be at least {least}")]
    TooSmall {
        line: usize,
        word: String,
        least: f64,
    },
    /// A dwell without its time.
    #[error("line {line}: {word} has no time; write P, in seconds")]
    NoTime { line: usize, word: String },
    /// An arc without a centre, with one in another plane, or with two.
    #[error("line {line}: the arc {what}; {remedy}")]
    Arc {
        line: usize,
        what: String,
        remedy: &'static str,
    },
    /// An arc whose ends are at different distances from its centre.
    #[error(
        "line {line}: the arc starts {start_mm:.4} mm and ends {end_mm:.4} mm from its centre, which differ by more than \
         {most_mm:.4} mm; correct the centre or the end, or write more decimals"
    )]
    ArcRadius {
        line: usize,
        /// Radius at the start.
        start_mm: f64,
        /// Radius at the end.
        end_mm: f64,
        most_mm: f64,
    },
    /// A move leaves the axis' travel.
    #[error(
        "line {line}: the move takes {axis} to {reaches_mm:.3} mm, outside of its travel of {low_mm} to {high_mm} mm; \
         move the program's origin"
    )]
    Travel {
        line: usize,
        axis: &'static str,
        /// Position that it would reach, mm.
        reaches_mm: f64,
        /// The travel's lower end.
        low_mm: f64,
        high_mm: f64,
    },
    #[error(
        "the program has no move; write at least one line with G0, G1, G2 or G3 and a coordinate"
    )]
    Empty,
    /// The program runs for too long.
    #[error(
        "the program takes {duration_s:.0} s, more than {most_s} s; raise its feeds or split it"
    )]
    TooLong { duration_s: f64, most_s: f64 },
    /// A limit of the motion that cannot be kept.
    #[error("{what} is {value}, but must be within {least} and {most}")]
    Limit {
        what: &'static str,
        value: f64,
        least: f64,
        most: f64,
    },
}
