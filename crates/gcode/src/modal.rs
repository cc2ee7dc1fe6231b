//! The state that codes leave behind for the lines that follow.

use quadrant_law::reference::{Plane, Sense};

use crate::error::ProgramError;
use crate::lexer::Word;

/// Kind of motion to the coordinates of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Motion {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2 and G3.
    Arc(Sense),
}

impl Motion {
    pub(super) const fn code(self) -> &'static str {
        match self {
            Self::Rapid => "G0",
            Self::Line => "G1",
            Self::Arc(Sense::Clockwise) => "G2",
            Self::Arc(Sense::CounterClockwise) => "G3",
        }
    }
}

/// The way in which joints of moves are passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathControl {
    /// The program does not say.
    Unsaid,
    /// G61.1: a stop at the end of every move.
    ExactStop,
    /// G61, and G64 P: joints are left by this much at most, mm.
    Within(f64),
}

/// Modal state set by codes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Modes {
    /// Group 1; nothing before the first motion code.
    pub(super) motion: Option<Motion>,
    /// G17, G18, G19.
    pub(super) plane: Plane,
    /// G20 instead of G21.
    pub(super) inches: bool,
    /// G91 instead of G90.
    pub(super) incremental: bool,
    /// G90.1 instead of G91.1.
    pub(super) absolute_centres: bool,
    /// G61, G61.1, G64.
    pub(super) path_control: PathControl,
    /// M2 or M30 has been read.
    pub(super) ended: bool,
}

impl Default for Modes {
    fn default() -> Self {
        Self {
            motion: None,
            plane: Plane::Xy,
            inches: false,
            incremental: false,
            absolute_centres: false,
            path_control: PathControl::Unsaid,
            ended: false,
        }
    }
}

/// Codes named in the error about a code that is not supported.
const SUPPORTED: &str = "G0-G4, G17-G21, G28, G30, G40, G43, G49, G53-G59, G61, G64, G80, G90, G91, G90.1, G91.1, G94, M2 and M30";

/// Effect of a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    /// It has set a mode.
    Set,
    /// It concerns what the stage does not have; its reason.
    Ignored(&'static str),
    /// The same, and the line's coordinates belong to it.
    IgnoredMotion(&'static str),
    /// G4: a rest of P seconds.
    Dwell,
    /// G64: P is the deviation allowed at joints.
    Blend,
}

pub(super) const NO_SPINDLE: &str = "the stage has no spindle, coolant or tools";
const NO_LENGTH: &str = "the stage has no tools, whose length would count";
const NO_OPERATOR: &str = "a test of an axis waits for no operator and has no inputs and outputs";
const ONE_SYSTEM: &str = "the coordinates of all systems count from where the axes stand";
const NO_REFERENCE: &str = "the stage has no machine coordinates; the axes stay where they are";
const NO_CYCLES: &str =
    "it concerns canned cycles and the feed a revolution, and neither is supported";

/// Name of the unsupported feature that a code asks for, in the plural; nothing for codes that are unknown.
fn beyond_a_test(letter: char, code: u32) -> Option<&'static str> {
    Some(match (letter, code) {
        ('G', 50..=53) => "splines (G5)",
        ('G', 70) => "diameters for radii (G7)",
        ('G', 100) => "offsets set by the program (G10)",
        ('G', 120..=131) => "circular pockets (G12, G13)",
        ('G', 160) => "polar coordinates (G16)",
        ('G', 320 | 330..=339 | 760) => "threads (G32, G33, G76)",
        ('G', 380..=389 | 310) => "probing moves (G31, G38)",
        ('G', 410..=429) => "tool radius compensations (G41, G42)",
        ('G', 510) => "scaled coordinates (G51)",
        ('G', 520 | 920) => "shifts of the origin (G52, G92)",
        ('G', 650..=661) => "macros (G65, G66)",
        ('G', 680..=689) => "turned coordinates (G68)",
        ('G', 700..=759 | 810..=899) => "canned cycles (G73, G81 to G89)",
        ('G', 930) => "inverse-time feeds (G93)",
        ('G', 950) => "feeds a revolution (G95)",
        ('G', 960) => "constant surface speeds (G96)",
        ('M', 970 | 980 | 990) => "subprograms (M97 to M99)",
        _ => return None,
    })
}

impl Modes {
    /// Takes a G, M or T word; `seen` holds the group and word of every code of the line before it.
    ///
    /// # Errors
    /// A code that is not supported, or that contradicts one before it.
    pub(super) fn apply<'w>(
        &mut self,
        word: &'w Word,
        seen: &mut Vec<(u32, &'w Word)>,
    ) -> Result<Effect, ProgramError> {
        // Tenths, so that G90.1 is 901.
        let code = (10.0 * word.value).round() as u32;
        let mut effect = Effect::Set;
        let group = match (word.letter, code) {
            ('G', 0) => self.move_by(Motion::Rapid),
            ('G', 10) => self.move_by(Motion::Line),
            ('G', 20) => self.move_by(Motion::Arc(Sense::Clockwise)),
            ('G', 30) => self.move_by(Motion::Arc(Sense::CounterClockwise)),
            ('G', 170) => self.in_plane(Plane::Xy),
            ('G', 180) => self.in_plane(Plane::Zx),
            ('G', 190) => self.in_plane(Plane::Yz),
            ('G', 200 | 210) => {
                self.inches = code == 200;
                3
            }
            ('G', 900 | 910) => {
                self.incremental = code == 910;
                4
            }
            ('G', 901 | 911) => {
                self.absolute_centres = code == 901;
                5
            }
            // What is always so here: radii, no scale, no turn, no shift, no macro; no compensation of radius and length, no
            // cycle, feed a minute.
            ('G', 80 | 150 | 401 | 500 | 670 | 690 | 921..=923) => return Ok(Effect::Set),
            ('G', 400) => 6,
            ('G', 490) => 7,
            ('G', 540) => 8,
            ('G', 800) => 13,
            ('G', 940) => 10,
            ('G', 610 | 611) => {
                self.path_control = match code {
                    610 => PathControl::Within(0.0),
                    _ => PathControl::ExactStop,
                };
                9
            }
            ('G', 640) => {
                self.path_control = PathControl::Unsaid;
                effect = Effect::Blend;
                9
            }
            ('G', 40) => {
                effect = Effect::Dwell;
                12
            }
            ('G', 280 | 300 | 530) => {
                effect = Effect::IgnoredMotion(NO_REFERENCE);
                12
            }
            ('G', 281 | 301) => {
                effect = Effect::Ignored(NO_REFERENCE);
                12
            }
            ('G', 430..=432 | 440) => {
                effect = Effect::Ignored(NO_LENGTH);
                7
            }
            ('G', 550..=599) => {
                effect = Effect::Ignored(ONE_SYSTEM);
                8
            }
            ('G', 970) => {
                effect = Effect::Ignored(NO_SPINDLE);
                14
            }
            ('G', 980 | 990) => {
                effect = Effect::Ignored(NO_CYCLES);
                15
            }
            ('M', 20 | 300) => {
                self.ended = true;
                11
            }
            ('T', _) | ('M', 30..=90 | 190) => return Ok(Effect::Ignored(NO_SPINDLE)),
            (letter, code) => {
                if let Some(what) = beyond_a_test(letter, code) {
                    return Err(ProgramError::NotRead {
                        line: word.line,
                        text: word.text.clone(),
                        what,
                    });
                }
                if letter == 'M' {
                    return Ok(Effect::Ignored(NO_OPERATOR));
                }
                return Err(ProgramError::Unsupported {
                    line: word.line,
                    word: word.text.clone(),
                    supported: SUPPORTED,
                });
            }
        };
        if let Some((_, other)) = seen.iter().find(|(taken, _)| *taken == group) {
            return Err(ProgramError::Contradiction {
                line: word.line,
                word: word.text.clone(),
                other: other.text.clone(),
            });
        }
        seen.push((group, word));
        Ok(effect)
    }

    fn move_by(&mut self, motion: Motion) -> u32 {
        self.motion = Some(motion);
        1
    }

    fn in_plane(&mut self, plane: Plane) -> u32 {
        self.plane = plane;
        2
    }

    /// mm per unit of length.
    pub(super) const fn unit_mm(&self) -> f64 {
        if self.inches { 25.4 } else { 1.0 }
    }
}
