//! Settings that are being edited, beside those that are in force.
//!
//! A leaf is written at any time; nothing follows from it until [`Draft::apply`] has found the whole to be valid and
//! said which axes are to be rebuilt ([`StageSettings::build_axis`]). Both sets stay where they are: they are too large to
//! be moved over the firmware's stack.

use core::fmt;

use super::axis::AxisSettings;
use super::error::{PathOf, SettingsError};
use super::leaves::rules::{SAFETY_OF_AN_AXIS, SAFETY_OF_THE_STAGE};
use super::stage::StageSettings;
use super::tree::{MAX_VALUE_BYTES, TreeError, same_in};
use quadrant_law::axes::{AxisName, PerAxis};

/// A set of settings that is edited leaf by leaf, and the one in force.
#[derive(Debug)]
pub struct Draft<'a> {
    settings: &'a mut StageSettings,
    in_force: &'a mut StageSettings,
    touched: [bool; 3],
}

/// Reason why a draft does not take effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ApplyError {
    /// It is not valid.
    Refused(SettingsError),
    /// The control rate differs from the one in force: the settings are to be stored and the machine restarted.
    RateNeedsRestart,
    /// An axis' encoder differs from the one in force, likewise.
    EncoderNeedsRestart(AxisName),
}

impl fmt::Display for ApplyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const REMEDY: &str = "changes only with a restart: `store` the settings and restart";
        match self {
            Self::Refused(error) => error.fmt(f),
            Self::RateNeedsRestart => write!(f, "rate_hz {REMEDY}"),
            Self::EncoderNeedsRestart(axis) => write!(f, "{axis}/encoder {REMEDY}"),
        }
    }
}

impl core::error::Error for ApplyError {}

impl From<SettingsError> for ApplyError {
    fn from(error: SettingsError) -> Self {
        Self::Refused(error)
    }
}

/// A setting on which the safety of an axis depends: it changes only while the outputs are off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SafetyLeaf {
    /// Its axis; none for the stage's.
    pub axis: Option<AxisName>,
    /// Its name below the axis, or below the stage.
    pub field: &'static str,
}

impl fmt::Display for SafetyLeaf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} changes only while the outputs are off: disable them first",
            PathOf(self.axis, self.field)
        )
    }
}

impl StageSettings {
    /// The first setting that differs and on which safety depends, if there is one.
    #[inline(never)]
    pub fn safety_change(&self, other: &Self) -> Option<SafetyLeaf> {
        let of_stage = SAFETY_OF_THE_STAGE
            .iter()
            .find(|field| !self.same_in(other, field))
            .map(|field| SafetyLeaf { axis: None, field });
        of_stage.or_else(|| {
            AxisName::ALL.into_iter().find_map(|name| {
                let (one, other) = (self.axis(name), other.axis(name));
                SAFETY_OF_AN_AXIS
                    .iter()
                    .find(|field| !same_in(one, other, field))
                    .map(|field| SafetyLeaf {
                        axis: Some(name),
                        field,
                    })
            })
        })
    }
}

impl<'a> Draft<'a> {
    /// A draft of the settings that the stage was built from, in the place of `settings`.
    pub fn new(in_force: &'a mut StageSettings, settings: &'a mut StageSettings) -> Self {
        settings.copy_from(in_force);
        Self {
            settings,
            in_force,
            touched: [false; 3],
        }
    }

    /// A draft that holds other settings than those in force, edited already.
    pub fn edited(in_force: &'a mut StageSettings, settings: &'a mut StageSettings) -> Self {
        Self {
            settings,
            in_force,
            touched: [true; 3],
        }
    }

    /// The settings in force.
    pub fn in_force(&self) -> &StageSettings {
        self.in_force
    }

    /// The settings as they are edited so far; valid only if [`validate`](StageSettings::validate) says so.
    pub fn settings(&self) -> &StageSettings {
        self.settings
    }

    /// All of the settings, to be replaced by another set; every axis counts as changed.
    pub fn settings_mut(&mut self) -> &mut StageSettings {
        self.touched = [true; 3];
        self.settings
    }

    /// Takes back what was written since the draft last took effect.
    pub fn revert(&mut self) {
        self.settings.copy_from(self.in_force);
        self.touched = [false; 3];
    }

    /// Writes a leaf, or makes or removes a part: [`StageSettings::set_json`].
    ///
    /// # Errors
    /// As there; nothing has changed then.
    pub fn set_json(&mut self, path: &str, json: &[u8]) -> Result<(), TreeError> {
        let axis = self.settings.set_json(path, json)?;
        self.touch(axis);
        Ok(())
    }

    /// Writes a leaf, or makes or removes a part: [`StageSettings::set_bytes`].
    ///
    /// # Errors
    /// As there; nothing has changed then.
    pub fn set_bytes(&mut self, path: &str, kind: u8, bytes: &[u8]) -> Result<(), TreeError> {
        let axis = self.settings.set_bytes(path, kind, bytes)?;
        self.touch(axis);
        Ok(())
    }

    /// The settings of an axis, to be edited; it counts as changed.
    pub fn axis_mut(&mut self, axis: AxisName) -> &mut AxisSettings {
        self.touch(Some(axis as usize));
        &mut self.settings.axes[axis as usize]
    }

    /// Marks an axis as changed; all of them for a setting of the stage.
    fn touch(&mut self, axis: Option<usize>) {
        for (index, touched) in self.touched.iter_mut().enumerate() {
            *touched |= axis.is_none_or(|axis| axis == index);
        }
    }

    /// True if something was written since the draft last took effect.
    pub fn is_edited(&self) -> bool {
        self.touched.contains(&true)
    }

    /// True if the value at a path of the draft is not the one in force.
    pub fn differs_at(&self, path: &str) -> bool {
        let mut edited = [0; MAX_VALUE_BYTES];
        let mut acting = [0; MAX_VALUE_BYTES];
        let edited = value_in(self.settings, path, &mut edited);
        edited != value_in(self.in_force, path, &mut acting)
    }

    /// The first setting by which the draft differs and on which safety depends: the outputs have to be off for it.
    pub fn safety_change(&self) -> Option<SafetyLeaf> {
        self.settings.safety_change(self.in_force)
    }

    /// The axes whose homing the draft changes: where they find their origin is not where they found it.
    pub fn new_origins(&self) -> PerAxis<bool> {
        PerAxis::from_fn(|axis| self.settings.axis(axis).homing != self.in_force.axis(axis).homing)
    }

    /// Checks the draft as a whole, with `elements` the room for GMS elements, and says of each axis whether it has to be
    /// rebuilt for the draft to take effect. The draft counts as in force from then on: the caller exchanges those axes.
    /// Slow: the Popov bound is searched.
    ///
    /// # Errors
    /// A value that is refused, or one that only changes with a restart; the draft stays as it is, and what was in force
    /// stays in force.
    pub fn apply(&mut self, elements: usize) -> Result<[bool; 3], ApplyError> {
        self.settings.validate(elements)?;
        if self.settings.rate_hz != self.in_force.rate_hz {
            return Err(ApplyError::RateNeedsRestart);
        }
        for axis in AxisName::ALL {
            if self.settings.axis(axis).encoder != self.in_force.axis(axis).encoder {
                return Err(ApplyError::EncoderNeedsRestart(axis));
            }
        }
        // Every axis waits for the one that looks ahead furthest.
        let waits = self.settings.longest_preview_ticks();
        let rebuild = if waits == self.in_force.longest_preview_ticks() {
            self.touched
        } else {
            [true; 3]
        };
        self.in_force.copy_from(self.settings);
        self.touched = [false; 3];
        Ok(rebuild)
    }
}

/// The kind and bytes of a value; none where the settings have no such path.
fn value_in<'b>(
    settings: &StageSettings,
    path: &str,
    buffer: &'b mut [u8],
) -> Option<(u8, &'b [u8])> {
    let (kind, length) = settings.get_bytes(path, buffer).ok()?;
    Some((kind, buffer.get(..length)?))
}
