//! Values of leaves, as bytes and as JSON text.
//!
//! The bytes are postcard (<https://postcard.jamesmunns.com/wire-format>), a name as its text. They are what is stored, and
//! what a firmware should speak: JSON takes 55 KB of its image (`docs/settings-storage.md`).

use core::any::Any;

use super::homing::HomeSwitch;
use super::operation::{EmergencyReaction, LossReaction};
use super::serial_encoder::{CheckBit, SerialProtocol};
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::filter::FilterList;
use quadrant_law::control::nctf::Characteristic;
use quadrant_law::control::schedule::GainSchedule;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::Direction;
use quadrant_law::friction::gms::GmsElements;
use quadrant_law::safety::{EnabledBy, HostNeeded};

/// The longest value in bytes: a list of 16 points of two numbers takes 257.
pub const MAX_VALUE_BYTES: usize = 320;

/// Kind of a value that says whether a part that may be left out is there.
pub const KIND_PART: u8 = 0;

/// A leaf whose value is a number, a flag or a list is written by serde; a name by its text.
trait Value: Any {
    const KIND: u8;

    fn to_bytes(&self, room: &mut [u8]) -> Option<usize>;
    fn from_bytes(bytes: &[u8]) -> Option<Self>
    where
        Self: Sized;
    fn to_json(&self, room: &mut [u8]) -> Option<usize>;
    fn from_json(json: &[u8]) -> Option<Self>
    where
        Self: Sized;
}

fn whole<'a, T: serde::Deserialize<'a>>(bytes: &'a [u8]) -> Option<T> {
    let (value, rest) = postcard::take_from_bytes(bytes).ok()?;
    rest.is_empty().then_some(value)
}

macro_rules! plain {
    ($($kind:literal $type:ty),+) => {$(
        impl Value for $type {
            const KIND: u8 = $kind;

            fn to_bytes(&self, room: &mut [u8]) -> Option<usize> {
                Some(postcard::to_slice(self, room).ok()?.len())
            }

            fn from_bytes(bytes: &[u8]) -> Option<Self> {
                whole(bytes)
            }

            fn to_json(&self, room: &mut [u8]) -> Option<usize> {
                serde_json_core::to_slice(self, room).ok()
            }

            fn from_json(json: &[u8]) -> Option<Self> {
                // Nothing is no value, which a float would take for one that is not a number.
                if json == b"null" {
                    return None;
                }
                Some(serde_json_core::from_slice(json).ok()?.0)
            }
        }
    )+};
}

macro_rules! name {
    ($($kind:literal $type:ty),+) => {$(
        impl Value for $type {
            const KIND: u8 = $kind;

            fn to_bytes(&self, room: &mut [u8]) -> Option<usize> {
                Some(postcard::to_slice(self.as_ref(), room).ok()?.len())
            }

            fn from_bytes(bytes: &[u8]) -> Option<Self> {
                Self::try_from(whole::<&str>(bytes)?).ok()
            }

            fn to_json(&self, room: &mut [u8]) -> Option<usize> {
                serde_json_core::to_slice(self.as_ref(), room).ok()
            }

            fn from_json(json: &[u8]) -> Option<Self> {
                Self::try_from(serde_json_core::from_slice::<&str>(json).ok()?.0).ok()
            }
        }
    )+};
}

/// Defines what is done with a leaf of any of these types.
macro_rules! each {
    ($($type:ty),+) => {
        /// The kind of a leaf.
        pub fn kind(leaf: &dyn Any) -> Option<u8> {
            $(if leaf.is::<$type>() { return Some(<$type as Value>::KIND); })+
            None
        }

        /// Writes a leaf's bytes and returns their length.
        pub fn to_bytes(leaf: &dyn Any, room: &mut [u8]) -> Option<usize> {
            $(if let Some(leaf) = leaf.downcast_ref::<$type>() { return leaf.to_bytes(room); })+
            None
        }

        /// Takes a leaf's value from bytes of this kind; false, and nothing has changed, if they are none.
        pub fn take_bytes(leaf: &mut dyn Any, kind: u8, bytes: &[u8]) -> bool {
            $(if let Some(leaf) = leaf.downcast_mut::<$type>() {
                let value = if kind == <$type as Value>::KIND { Value::from_bytes(bytes) } else { None };
                return value.map(|value| *leaf = value).is_some();
            })+
            false
        }

        /// Writes a leaf's JSON text and returns its length.
        pub(crate) fn to_json(leaf: &dyn Any, room: &mut [u8]) -> Option<usize> {
            $(if let Some(leaf) = leaf.downcast_ref::<$type>() { return leaf.to_json(room); })+
            None
        }

        /// Takes a leaf's value from JSON text; false, and nothing has changed, if it is none.
        pub(crate) fn take_json(leaf: &mut dyn Any, json: &[u8]) -> bool {
            $(if let Some(leaf) = leaf.downcast_mut::<$type>() {
                return Value::from_json(json).map(|value| *leaf = value).is_some();
            })+
            false
        }
    };
}

/// The value of a leaf that is a number.
pub(crate) fn number(leaf: &dyn Any) -> Option<f64> {
    if let Some(&number) = leaf.downcast_ref::<f64>() {
        return Some(number);
    }
    let whole = leaf.downcast_ref::<u8>().map(|&whole| whole.into());
    whole.or_else(|| leaf.downcast_ref::<u32>().map(|&whole| whole.into()))
}

// A leaf of another type is to be added to both lists, with a kind of its own that stays.
plain!(1 GmsElements, 1 GainSchedule, 1 Characteristic, 1 FilterList, 2 bool, 4 f64, 5 u8, 7 u32);
name!(
    3 LawKind, 3 FeedforwardKind, 3 Direction, 3 HomeSwitch, 3 LossReaction, 3 EmergencyReaction, 3 EnabledBy,
    3 HostNeeded, 3 SerialProtocol, 3 CheckBit
);
each!(
    f64,
    bool,
    u8,
    u32,
    Direction,
    HomeSwitch,
    LossReaction,
    EmergencyReaction,
    EnabledBy,
    HostNeeded,
    SerialProtocol,
    CheckBit,
    LawKind,
    FeedforwardKind,
    GmsElements,
    GainSchedule,
    Characteristic,
    FilterList
);
