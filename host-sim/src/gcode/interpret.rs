//! From words to moves.

use std::path::Path;

use crate::gcode::arc::{ArcWords, CircleWords};
use crate::gcode::error::ProgramError;
use crate::gcode::lexer::{Word, words};
use crate::gcode::modal::{Effect, Modes, Motion};
use crate::gcode::segment::{Segment, Vector};

/// A piece of the path, and how fast it is to be run.
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    pub segment: Segment,
    /// Feed along the path, mm/s; `None` for a rapid move.
    pub feed_mm_s: Option<f64>,
    /// The program's line that it comes from, from 1.
    pub line: usize,
}

/// A program that has been understood.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Its moves in order, the first from the origin; not empty.
    pub moves: Vec<Move>,
    /// Codes without effect on a stage (spindle, coolant, tools), with their lines.
    pub ignored: Vec<(usize, String)>,
}

/// Largest file, bytes: a program of this length runs for hours.
const MOST_BYTES: u64 = 16 << 20;
/// Feeds that are understood, mm/min.
const FEEDS_MM_MIN: (f64, f64) = (1e-3, 1e6);

impl Program {
    /// Reads a program from a file.
    ///
    /// # Errors
    /// A file that cannot be read, or a program that is refused.
    pub fn read(path: &Path) -> Result<Self, ProgramError> {
        let unreadable = |source| ProgramError::Read {
            path: path.to_owned(),
            source,
        };
        let bytes = std::fs::metadata(path).map_err(unreadable)?.len();
        if bytes > MOST_BYTES {
            return Err(ProgramError::TooLarge {
                path: path.to_owned(),
                bytes,
                most: MOST_BYTES,
            });
        }
        Self::parse(&std::fs::read_to_string(path).map_err(unreadable)?)
    }

    /// Reads a program from its text.
    ///
    /// # Errors
    /// The first line that is refused.
    pub fn parse(source: &str) -> Result<Self, ProgramError> {
        let words = words(source)?;
        let mut interpreter = Interpreter::default();
        for line in words.chunk_by(|one, other| one.line == other.line) {
            interpreter.line(line)?;
            if interpreter.modes.ended {
                break;
            }
        }
        if interpreter.moves.is_empty() {
            return Err(ProgramError::Empty);
        }
        Ok(Self {
            moves: interpreter.moves,
            ignored: interpreter.ignored,
        })
    }
}

#[derive(Default)]
struct Interpreter {
    modes: Modes,
    feed_mm_s: Option<f64>,
    position: Vector,
    moves: Vec<Move>,
    ignored: Vec<(usize, String)>,
}

/// The words of a line that are not codes.
#[derive(Default)]
struct Line<'w> {
    axes: [Option<&'w Word>; 3],
    offsets: [Option<&'w Word>; 3],
    radius: Option<&'w Word>,
    feed: Option<&'w Word>,
}

const WORDS: &str = "the codes G, M, T and the words X, Y, Z, I, J, K, R, F, S, N";

impl<'w> Line<'w> {
    fn take(&mut self, word: &'w Word) -> Result<(), ProgramError> {
        let slot = match word.letter {
            'X' => &mut self.axes[0],
            'Y' => &mut self.axes[1],
            'Z' => &mut self.axes[2],
            'I' => &mut self.offsets[0],
            'J' => &mut self.offsets[1],
            'K' => &mut self.offsets[2],
            'R' => &mut self.radius,
            'F' => &mut self.feed,
            _ => {
                return Err(ProgramError::Unsupported {
                    line: word.line,
                    word: word.text.clone(),
                    supported: WORDS,
                });
            }
        };
        match slot.replace(word) {
            None => Ok(()),
            Some(other) => Err(ProgramError::Contradiction {
                line: word.line,
                word: word.text.clone(),
                other: other.text.clone(),
            }),
        }
    }

    /// The first of the words that ask for a motion.
    fn moving(&self) -> Option<&'w Word> {
        let words = self.axes.iter().chain(&self.offsets).chain([&self.radius]);
        words.copied().flatten().next()
    }
}

impl Interpreter {
    fn line(&mut self, words: &[Word]) -> Result<(), ProgramError> {
        let mut line = Line::default();
        let mut seen = Vec::new();
        for word in words {
            match word.letter {
                'G' | 'M' | 'T' => {
                    if self.modes.apply(word, &mut seen)? == Effect::Ignored {
                        self.ignored.push((word.line, word.text.clone()));
                    }
                }
                'S' => self.ignored.push((word.line, word.text.clone())),
                _ => line.take(word)?,
            }
        }
        if let Some(word) = line.feed {
            let feed_mm_min = word.value * self.modes.unit_mm();
            let (least, most) = FEEDS_MM_MIN;
            if !(least..=most).contains(&feed_mm_min) {
                return Err(ProgramError::OutOfRange {
                    line: word.line,
                    word: word.text.clone(),
                    least: least / self.modes.unit_mm(),
                    most: most / self.modes.unit_mm(),
                });
            }
            self.feed_mm_s = Some(feed_mm_min / 60.0);
        }
        match line.moving() {
            Some(first) => self.motion(&line, first),
            None => Ok(()),
        }
    }

    fn motion(&mut self, line: &Line<'_>, first: &Word) -> Result<(), ProgramError> {
        let Some(motion) = self.modes.motion else {
            return Err(ProgramError::NoMotion {
                line: first.line,
                word: first.text.clone(),
            });
        };
        let feed_mm_s = match motion {
            Motion::Rapid => None,
            Motion::Line | Motion::Arc(_) => {
                Some(self.feed_mm_s.ok_or_else(|| ProgramError::NoFeed {
                    line: first.line,
                    word: motion.code(),
                })?)
            }
        };
        let unit_mm = self.modes.unit_mm();
        let mut target = self.position;
        for (axis, word) in line.axes.iter().enumerate() {
            if let Some(word) = word {
                let origin = if self.modes.incremental {
                    self.position[axis]
                } else {
                    0.0
                };
                target[axis] = origin + word.value * unit_mm;
            }
        }
        let segment = match motion {
            Motion::Rapid | Motion::Line => {
                self.refuse_arc_words(line, motion)?;
                Segment::line(self.position, target)
            }
            Motion::Arc(sense) => Some(
                ArcWords {
                    plane: self.modes.plane,
                    sense,
                    from: self.position,
                    to: target,
                    circle: self.circle(line, first.line)?,
                    line: first.line,
                }
                .segment()?,
            ),
        };
        if let Some(segment) = segment {
            self.moves.push(Move {
                segment,
                feed_mm_s,
                line: first.line,
            });
        }
        self.position = target;
        Ok(())
    }

    /// A straight move has neither centre nor radius.
    fn refuse_arc_words(&self, line: &Line<'_>, motion: Motion) -> Result<(), ProgramError> {
        let mut arc_words = line.offsets.iter().chain([&line.radius]);
        match arc_words.find_map(|word| *word) {
            None => Ok(()),
            Some(word) => Err(ProgramError::Contradiction {
                line: word.line,
                word: word.text.clone(),
                other: motion.code().to_owned(),
            }),
        }
    }

    /// The circle of an arc, from I, J, K or R.
    fn circle(&self, line: &Line<'_>, number: usize) -> Result<CircleWords, ProgramError> {
        let wrong = |what: String, remedy| ProgramError::Arc {
            line: number,
            what,
            remedy,
        };
        let (first, second) = self.modes.plane.axes();
        let unit_mm = self.modes.unit_mm();
        if let Some(word) = line.offsets[3 - first - second] {
            return Err(wrong(
                format!("has its centre off its plane by {}", word.text),
                "select the plane with G17 (XY), G18 (ZX) or G19 (YZ), or drop the word",
            ));
        }
        let centre = [first, second].map(|axis| line.offsets[axis]);
        match (line.radius, centre) {
            (None, [None, None]) => Err(wrong(
                "has no centre".to_owned(),
                "give I, J, K (two of them, by its plane) or R",
            )),
            (Some(radius), [None, None]) => Ok(CircleWords::Radius(radius.value * unit_mm)),
            (Some(radius), _) => Err(wrong(
                format!("has a centre and {}", radius.text),
                "keep either I, J, K or R",
            )),
            (None, centre) => {
                let mut at = [self.position[first], self.position[second]];
                for (at, word) in at.iter_mut().zip(centre) {
                    let offset = word.map(|word| word.value * unit_mm);
                    *at = match (offset, self.modes.absolute_centres) {
                        (Some(offset), false) => *at + offset,
                        (Some(centre), true) => centre,
                        (None, _) => *at,
                    };
                }
                Ok(CircleWords::Centre(at))
            }
        }
    }
}
