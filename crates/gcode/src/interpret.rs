//! From words to moves.

use std::path::Path;

use crate::arc::{ArcWords, CircleWords, INCH_MISMATCH_MM, MISMATCH_MM};
use crate::error::ProgramError;
use crate::lexer::{self, Word};
use crate::modal::{Effect, Modes, Motion, NO_SPINDLE, PathControl};
use crate::segment::{Segment, Vector};

/// A piece of the path, and how fast it is to be run.
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    pub segment: Segment,
    /// Feed along the path, mm/s; `None` for a rapid move.
    pub feed_mm_s: Option<f64>,
    /// The program's line that it comes from, from 1.
    pub line: usize,
    /// The way in which its joints are passed.
    pub path_control: PathControl,
    /// Rest after it, s.
    pub rest_s: f64,
}

/// Something that a program asks for and a stage does not have.
#[derive(Clone, Debug, PartialEq)]
pub struct Ignored {
    /// Its line, from 1.
    pub line: usize,
    pub word: String,
    pub reason: &'static str,
}

/// A program that has been understood.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Its moves in order, the first from the origin; not empty.
    pub moves: Vec<Move>,
    /// Rest before the first of them, s.
    pub rest_s: f64,
    /// Codes without effect on a stage (spindle, coolant, tools), and lines that are left out.
    pub ignored: Vec<Ignored>,
}

/// Largest file, bytes: a program of this length runs for hours.
const MOST_BYTES: u64 = 16 << 20;
/// Lowest feed, mm/min.
const LEAST_FEED_MM_MIN: f64 = 1e-3;

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
        // Comments are in the machine's own character set.
        let text = std::fs::read(path).map_err(unreadable)?;
        Self::parse(&String::from_utf8_lossy(&text))
    }

    /// Reads a program from its text.
    ///
    /// # Errors
    /// The first line that is refused.
    pub fn parse(source: &str) -> Result<Self, ProgramError> {
        let mut interpreter = Interpreter::default();
        let mut begun = false;
        for (index, text) in lexer::lines(source).enumerate() {
            let line = index + 1;
            match lexer::line(text, line)? {
                // The second percent sign ends the program.
                lexer::Line::Percent if begun => break,
                lexer::Line::Percent => begun = true,
                lexer::Line::Deleted => interpreter.ignored.push(Ignored {
                    line,
                    word: "/".to_owned(),
                    reason: "a line that begins with a slash is left out",
                }),
                lexer::Line::Words(words) => {
                    begun |= !words.is_empty();
                    interpreter.line(&words)?;
                }
            }
            // What stands behind the end is not read.
            if interpreter.modes.ended {
                break;
            }
        }
        if interpreter.moves.is_empty() {
            return Err(ProgramError::Empty);
        }
        Ok(Self {
            moves: interpreter.moves,
            rest_s: interpreter.rest_s,
            ignored: interpreter.ignored,
        })
    }

    /// Notes about what is ignored, one for each word and reason, with the first line that it stands in.
    pub fn notes(&self) -> Vec<String> {
        let mut notes: Vec<(&Ignored, usize)> = Vec::new();
        for ignored in &self.ignored {
            let same = |(first, _): &&mut (&Ignored, usize)| {
                first.word == ignored.word && first.reason == ignored.reason
            };
            match notes.iter_mut().find(same) {
                Some((_, count)) => *count += 1,
                None => notes.push((ignored, 1)),
            }
        }
        let note = |(Ignored { line, word, reason }, count): (&Ignored, usize)| match count {
            1 => format!("line {line}: {word} is ignored; {reason}"),
            _ => format!(
                "line {line} and {} more: {word} is ignored; {reason}",
                count - 1
            ),
        };
        notes.into_iter().map(note).collect()
    }
}

#[derive(Default)]
struct Interpreter {
    modes: Modes,
    feed_mm_s: Option<f64>,
    position: Vector,
    moves: Vec<Move>,
    rest_s: f64,
    ignored: Vec<Ignored>,
}

/// The words of a line that are not codes.
#[derive(Default)]
struct Line<'w> {
    axes: [Option<&'w Word>; 3],
    offsets: [Option<&'w Word>; 3],
    radius: Option<&'w Word>,
    feed: Option<&'w Word>,
    /// P: a time, or a deviation.
    amount: Option<&'w Word>,
    /// Words that only some codes take: the number of a tool, an input or an output.
    others: Vec<&'w Word>,
}

const WORDS: &str = "the codes G, M, T and the words X, Y, Z, I, J, K, R, F, P, S, N";

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
            'P' => &mut self.amount,
            'A' | 'B' | 'C' | 'U' | 'V' | 'W' => {
                return Err(ProgramError::NotRead {
                    line: word.line,
                    text: word.text.clone(),
                    what: "axes other than X, Y and Z",
                });
            }
            _ => {
                self.others.push(word);
                return Ok(());
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

    /// Refuses a word that no code of the line takes.
    fn refuse_others(&self, amount_taken: bool) -> Result<(), ProgramError> {
        let amount = self.amount.filter(|_| !amount_taken);
        match self.others.iter().copied().chain(amount).next() {
            None => Ok(()),
            Some(word) => Err(ProgramError::Unsupported {
                line: word.line,
                word: word.text.clone(),
                supported: WORDS,
            }),
        }
    }

    /// The first of the words that ask for a motion.
    fn moving(&self) -> Option<&'w Word> {
        let words = self.axes.iter().chain(&self.offsets).chain([&self.radius]);
        words.copied().flatten().next()
    }
}

/// The number of a word, unless it is below a limit.
fn at_least(word: &Word, least: f64) -> Result<f64, ProgramError> {
    if word.value >= least {
        return Ok(word.value);
    }
    Err(ProgramError::TooSmall {
        line: word.line,
        word: word.text.clone(),
        least,
    })
}

impl Interpreter {
    fn line(&mut self, words: &[Word]) -> Result<(), ProgramError> {
        let mut line = Line::default();
        let mut seen = Vec::new();
        let (mut dwell, mut blend, mut ignores, mut still) = (None, false, false, false);
        for word in words {
            let effect = match word.letter {
                'G' | 'M' | 'T' => self.modes.apply(word, &mut seen)?,
                'S' => Effect::Ignored(NO_SPINDLE),
                _ => {
                    line.take(word)?;
                    Effect::Set
                }
            };
            match effect {
                Effect::Set => {}
                Effect::Dwell => dwell = Some(word),
                Effect::Blend => blend = true,
                Effect::Ignored(reason) | Effect::IgnoredMotion(reason) => {
                    still |= matches!(effect, Effect::IgnoredMotion(_));
                    ignores = true;
                    self.ignored.push(Ignored {
                        line: word.line,
                        word: word.text.clone(),
                        reason,
                    });
                }
            }
        }
        if !ignores {
            line.refuse_others(dwell.is_some() || blend)?;
        }
        if let Some(word) = line.feed {
            self.feed(word)?;
        }
        if let Some(word) = line.amount.filter(|_| blend) {
            let within_mm = at_least(word, 0.0)? * self.modes.unit_mm();
            self.modes.path_control = PathControl::Within(within_mm);
        }
        let moving = line.moving().filter(|_| !still);
        match (dwell, moving) {
            (Some(dwell), None) => self.dwell(dwell, line.amount),
            (Some(dwell), Some(word)) => Err(ProgramError::Contradiction {
                line: word.line,
                word: word.text.clone(),
                other: dwell.text.clone(),
            }),
            (None, Some(first)) => self.motion(&line, first),
            (None, None) => Ok(()),
        }
    }

    fn feed(&mut self, word: &Word) -> Result<(), ProgramError> {
        let unit_mm = self.modes.unit_mm();
        let feed = at_least(word, LEAST_FEED_MM_MIN / unit_mm)?;
        self.feed_mm_s = Some(feed * unit_mm / 60.0);
        Ok(())
    }

    /// Adds a rest after the last move.
    fn dwell(&mut self, code: &Word, time: Option<&Word>) -> Result<(), ProgramError> {
        let time = time.ok_or_else(|| ProgramError::NoTime {
            line: code.line,
            word: code.text.clone(),
        })?;
        let rest_s = match self.moves.last_mut() {
            Some(last) => &mut last.rest_s,
            None => &mut self.rest_s,
        };
        *rest_s += at_least(time, 0.0)?;
        Ok(())
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
                    mismatch_mm: if self.modes.inches {
                        INCH_MISMATCH_MM
                    } else {
                        MISMATCH_MM
                    },
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
                path_control: self.modes.path_control,
                rest_s: 0.0,
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
