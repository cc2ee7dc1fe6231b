//! Encoding of settings to be stored.

use core::any::Any;

use serde::Serialize;

use super::format::{FORMAT, Head, RecordHead};
use quadrant_settings::StageSettings;
use quadrant_settings::parts::PARTS;
use quadrant_settings::path::{Path, below_axis, of_any_axis};
use quadrant_settings::tree::{MAX_VALUE_BYTES, axis_leaf, leaves};
use quadrant_settings::value::{KIND_PART, kind, to_bytes};

/// Settings are longer than their room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLong;

struct Writer<'b> {
    room: &'b mut [u8],
    length: usize,
    last: Path,
}

impl Writer<'_> {
    fn write(&mut self, value: &impl Serialize) -> Result<(), TooLong> {
        let room = self.room.get_mut(self.length..).ok_or(TooLong)?;
        self.length += postcard::to_slice(value, room).map_err(|_| TooLong)?.len();
        Ok(())
    }

    fn value(&mut self, leaf: &dyn Any) -> Result<(), TooLong> {
        let mut value = [0; MAX_VALUE_BYTES];
        let length = to_bytes(leaf, &mut value).ok_or(TooLong)?;
        self.write(&value.get(..length).ok_or(TooLong)?)
    }

    fn head(&mut self, path: Path, kind: u8, axes: u8) -> Result<(), TooLong> {
        let same = path.bytes().zip(self.last.bytes());
        let shared = same.take_while(|(new, old)| new == old).count();
        let suffix = path.get(shared..).ok_or(TooLong)?;
        let shared = u8::try_from(shared).map_err(|_| TooLong)?;
        self.write(&RecordHead {
            shared,
            suffix,
            kind,
            axes,
        })?;
        self.last = path;
        Ok(())
    }
}

/// Writes settings and where they come from, and returns the length.
///
/// # Errors
/// More than there is room for; [`BUFFER_BYTES`](super::BUFFER_BYTES) are enough for any settings.
pub fn encode(
    settings: &StageSettings,
    provenance: &str,
    room: &mut [u8],
) -> Result<usize, TooLong> {
    let mut writer = Writer {
        room,
        length: 0,
        last: Path::new(),
    };
    writer.write(&Head {
        format: FORMAT,
        provenance,
    })?;
    for part in &PARTS {
        let present = |axes, (index, axis)| axes | u8::from((part.is_present)(axis)) << index;
        let axes = settings.axes.iter().enumerate().fold(0, present);
        writer.head(of_any_axis(part.path).ok_or(TooLong)?, KIND_PART, axes)?;
    }
    for leaf in leaves() {
        encode_leaf(settings, &leaf, &mut writer)?;
    }
    Ok(writer.length)
}

fn encode_leaf(settings: &StageSettings, path: &str, to: &mut Writer) -> Result<(), TooLong> {
    let below = match below_axis(path) {
        None => {
            let leaf = settings.leaf(path).map_err(|_| TooLong)?;
            let record = Path::try_from(path).map_err(|_| TooLong)?;
            to.head(record, kind(leaf).ok_or(TooLong)?, 1)?;
            return to.value(leaf);
        }
        Some((0, below)) => below,
        // Written with the first axis.
        Some(_) => return Ok(()),
    };
    let mut mask_at = None;
    for (index, axis) in settings.axes.iter().enumerate() {
        // In a part that is left out, or here.
        let Ok(leaf) = axis_leaf(axis, below) else {
            continue;
        };
        let mask_at = match mask_at {
            Some(place) => place,
            None => {
                let record = of_any_axis(below).ok_or(TooLong)?;
                to.head(record, kind(leaf).ok_or(TooLong)?, 0)?;
                *mask_at.insert(to.length.checked_sub(1).ok_or(TooLong)?)
            }
        };
        to.value(leaf)?;
        *to.room.get_mut(mask_at).ok_or(TooLong)? |= 1 << index;
    }
    Ok(())
}
