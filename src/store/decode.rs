//! Decoding of stored settings.

use core::fmt;

use heapless::String;
use serde::Deserialize;

use super::format::{FORMAT, Head, RecordHead};
use super::provenance::Provenance;
use quadrant_settings::parts::{PARTS, part_below_axis, part_of};
use quadrant_settings::path::{ANY_AXIS, Path, below_axis, of_any_axis, of_axis, present_name};
use quadrant_settings::tree::{TreeError, is_leaf, leaves};
use quadrant_settings::value::{KIND_PART, take_bytes};
use quadrant_settings::{SettingsError, StageSettings};

/// Reason why bytes are refused as settings.
#[derive(Clone, Debug, PartialEq)]
pub enum DecodeError {
    /// They are of another format.
    Format(u8),
    /// They end early, or a record is no record.
    Malformed,
    /// A value is not what this firmware's setting of that path holds.
    Type(Path),
    /// A value is out of its range, or values contradict each other.
    Refused(SettingsError),
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Format(format) => write!(
                f,
                "format {format} of stored settings; this firmware reads format {FORMAT}"
            ),
            Self::Malformed => f.write_str("the stored settings end early or are garbled"),
            Self::Type(path) => write!(f, "{path}: the stored value is of another type"),
            Self::Refused(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for DecodeError {}

/// A difference between the settings that were stored and those of this firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding<'a> {
    /// A stored value whose path this firmware does not know; it is skipped.
    Unknown(&'a str),
    /// A setting without a stored value; it has its default.
    Missing(&'a str),
}

/// Reads the records of a set one after the other.
struct Records<'b> {
    rest: &'b [u8],
    path: Path,
    kind: u8,
    axes: u8,
}

impl<'b> Records<'b> {
    fn new(rest: &'b [u8]) -> Self {
        Self {
            rest,
            path: Path::new(),
            kind: KIND_PART,
            axes: 0,
        }
    }

    fn take<T: Deserialize<'b>>(&mut self) -> Result<T, DecodeError> {
        let (value, rest) =
            postcard::take_from_bytes(self.rest).map_err(|_| DecodeError::Malformed)?;
        self.rest = rest;
        Ok(value)
    }

    /// The next record's head, in `self`, with its values; false at the end.
    fn next(&mut self, values: &mut [Option<&'b [u8]>; 3]) -> Result<bool, DecodeError> {
        *values = [None; 3];
        if self.rest.is_empty() {
            return Ok(false);
        }
        let head: RecordHead = self.take()?;
        let shared = usize::from(head.shared);
        if !self.path.is_char_boundary(shared) {
            return Err(DecodeError::Malformed);
        }
        self.path.truncate(shared);
        self.path
            .push_str(head.suffix)
            .map_err(|_| DecodeError::Malformed)?;
        (self.kind, self.axes) = (head.kind, head.axes);
        if self.axes >= 8 {
            return Err(DecodeError::Malformed);
        }
        if self.kind != KIND_PART {
            for (index, value) in values.iter_mut().enumerate() {
                if self.axes & 1 << index != 0 {
                    *value = Some(self.take()?);
                }
            }
        }
        Ok(true)
    }
}

/// Takes stored settings over the default ones, checks the whole with `elements` the room for GMS elements, and returns
/// their provenance.
///
/// Settings that are stored and unknown here, and those that are missing there, are passed to `report`.
///
/// # Errors
/// Bytes that are no settings, a value of another type, or settings that are refused as a whole; `settings` are the
/// default ones then.
pub fn decode(
    bytes: &[u8],
    elements: usize,
    settings: &mut StageSettings,
    report: &mut dyn FnMut(Finding<'_>),
) -> Result<Provenance, DecodeError> {
    settings.set_default();
    let decoded = decode_over(bytes, settings, report).and_then(|provenance| {
        settings
            .validate(elements)
            .map_err(DecodeError::Refused)
            .map(|()| provenance)
    });
    if decoded.is_err() {
        settings.set_default();
    }
    decoded
}

fn decode_over(
    bytes: &[u8],
    settings: &mut StageSettings,
    report: &mut dyn FnMut(Finding<'_>),
) -> Result<Provenance, DecodeError> {
    match bytes.first() {
        None => return Err(DecodeError::Malformed),
        Some(&FORMAT) => {}
        Some(&other) => return Err(DecodeError::Format(other)),
    }
    let mut records = Records::new(bytes);
    let head: Head = records.take()?;
    let provenance = String::try_from(head.provenance).map_err(|_| DecodeError::Malformed)?;
    let first = records.rest;
    let mut values = [None; 3];
    while records.next(&mut values)? {
        if !take_record(&records, &values, settings)? {
            report(Finding::Unknown(&records.path));
        }
    }
    report_missing(first, settings, report)?;
    Ok(provenance)
}

/// The path of a record under its present name.
fn present_path(stored: &Path) -> Path {
    let below = stored.strip_prefix(ANY_AXIS).map(present_name);
    below
        .and_then(of_any_axis)
        .unwrap_or_else(|| stored.clone())
}

/// True if a record is about this path, under whichever name.
fn is_about(stored: &str, path: &str) -> bool {
    let below = stored.strip_prefix(ANY_AXIS).map(present_name);
    stored == path || below.is_some() && below == path.strip_prefix(ANY_AXIS)
}

/// Takes one record over; false if its path is unknown.
fn take_record(
    record: &Records<'_>,
    values: &[Option<&[u8]>; 3],
    settings: &mut StageSettings,
) -> Result<bool, DecodeError> {
    if record.kind == KIND_PART {
        let below = record.path.strip_prefix(ANY_AXIS);
        let Some(part) = below.and_then(part_below_axis) else {
            return Ok(false);
        };
        for (index, axis) in settings.axes.iter_mut().enumerate() {
            // One that is there is made by its leaves.
            if record.axes & 1 << index == 0 {
                (part.remove)(axis);
            }
        }
        return Ok(true);
    }
    let present = present_path(&record.path);
    for (index, value) in values.iter().enumerate() {
        let path = of_axis(&present, index);
        if !is_leaf(&path) {
            return Ok(false);
        }
        let Some(value) = value else { continue };
        // Also where a later firmware has made a part optional that was not.
        if let (Err(TreeError::Absent), Some((index, below))) =
            (settings.leaf(&path), below_axis(&path))
            && let (Some(part), Some(axis)) = (part_of(below), settings.axes.get_mut(index))
        {
            (part.make)(axis);
        }
        let taken = settings
            .leaf_mut(&path)
            .is_ok_and(|leaf| take_bytes(leaf, record.kind, value));
        if !taken {
            return Err(DecodeError::Type(path));
        }
    }
    Ok(true)
}

/// Reports every leaf and every part that no record of the set is about.
fn report_missing(
    records: &[u8],
    settings: &StageSettings,
    report: &mut dyn FnMut(Finding<'_>),
) -> Result<(), DecodeError> {
    // The axes of a path's record.
    let stored = |path: &str, is_part: bool| -> Result<Option<u8>, DecodeError> {
        let mut records = Records::new(records);
        let mut values = [None; 3];
        while records.next(&mut values)? {
            if is_about(&records.path, path) && (records.kind == KIND_PART) == is_part {
                return Ok(Some(records.axes));
            }
        }
        Ok(None)
    };
    for part in &PARTS {
        let path = of_any_axis(part.path).ok_or(DecodeError::Malformed)?;
        if stored(&path, true)?.is_none() {
            report(Finding::Missing(&path));
        }
    }
    for leaf in leaves() {
        match below_axis(&leaf) {
            None if stored(&leaf, false)?.is_none() => report(Finding::Missing(&leaf)),
            Some((0, below)) => {
                let path = of_any_axis(below).ok_or(DecodeError::Malformed)?;
                let axes = stored(&path, false)?.unwrap_or(0);
                for (index, axis) in settings.axes.iter().enumerate() {
                    let left_out = part_of(below).is_some_and(|part| !(part.is_present)(axis));
                    if axes & 1 << index == 0 && !left_out {
                        report(Finding::Missing(&of_axis(&path, index)));
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}
