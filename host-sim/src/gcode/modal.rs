//! The state that codes leave behind for the lines that follow.

use quadrant::reference::{Plane, Sense};

use crate::gcode::error::ProgramError;
use crate::gcode::lexer::Word;

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
            ended: false,
        }
    }
}

/// Codes named in the error about a code that is not supported.
const SUPPORTED: &str =
    "G0-G3, G17-G21, G40, G49, G54, G61, G80, G90, G91, G90.1, G91.1, G94, M2 and M30";

/// Effect of a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    /// It has set a mode.
    Set,
    /// It concerns what the stage does not have: spindle, coolant, tools.
    Ignored,
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
            // What is always so here: no compensation of radius and length, no cycle, the one coordinate system, exact
            // path, feed a minute.
            ('G', 400) => 6,
            ('G', 490) => 7,
            ('G', 540) => 8,
            ('G', 610) => 9,
            ('G', 800) => 1,
            ('G', 940) => 10,
            ('M', 20 | 300) => {
                self.ended = true;
                11
            }
            ('M', 30 | 40 | 50 | 60 | 70 | 80 | 90) | ('T', _) => return Ok(Effect::Ignored),
            _ => {
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
        Ok(Effect::Set)
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
