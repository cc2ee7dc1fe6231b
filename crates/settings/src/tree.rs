//! The settings as a tree of leaves, each with a path and a JSON value.
//!
//! A path is `/rate_hz` or `/axes/<axis>/…`, the axis as `x`, `y`, `z` or as 0 to 2: `/axes/x/feedback/pid/kp_v_per_mm`.
//! Numbers, truth values, names and lists are leaves. Some parts of an axis may be left out ([`is_part`]): such a part
//! reads as `null` or `"present"`, `null` removes it, and `"present"` makes it, with default values, unless it is there
//! already. A leaf that is written is not checked; [`StageSettings::validate`] checks the whole.
//!
//! The same values are read and written as bytes ([`StageSettings::get_bytes`]), for a firmware that leaves JSON to the
//! host.

use core::any::Any;

use miniconf::{
    ConstPath, ConstPathIter, IntoKeys, KeyError, Keys, NodeIter, TreeAny, TreeSchema, ValueError,
};

use super::axis::AxisSettings;
use super::parts::{Part, part_below_axis, part_of};
use super::path::{self, below_axis};
pub use super::path::{MAX_PATH, Path, expand};
use super::stage::StageSettings;
pub use super::value::MAX_VALUE_BYTES;
use super::value::{KIND_PART, kind, number, take_bytes, take_json, to_bytes, to_json};

/// The value of a part that is there.
const PRESENT: &[u8] = b"\"present\"";

/// The value of a part that is not.
const NULL: &[u8] = b"null";

/// Reason why a leaf cannot be read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeError {
    /// Nothing has this path.
    NotFound,
    /// The path ends above the leaves.
    NotALeaf,
    /// The leaf is in a part that is left out.
    Absent,
    /// The value is no JSON, is of another type, or is none of the names that the leaf knows.
    Value,
    /// The value does not fit into the buffer.
    NoRoom,
}

impl core::fmt::Display for TreeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFound => "no setting has this path: `list` shows those there are",
            Self::NotALeaf => "this path holds several settings: `list` shows them",
            Self::Absent => {
                "this setting is in a part that is left out: set the part to \"present\" first"
            }
            Self::Value => "the value is not what this setting holds: `get` shows its form",
            Self::NoRoom => "the value does not fit into the answer",
        })
    }
}

impl core::error::Error for TreeError {}

impl From<ValueError> for TreeError {
    fn from(error: ValueError) -> Self {
        match error {
            ValueError::Key(KeyError::TooShort) => Self::NotALeaf,
            ValueError::Key(_) => Self::NotFound,
            ValueError::Absent => Self::Absent,
            ValueError::Access(_) => Self::Value,
        }
    }
}

/// True if a path names a part that may be left out.
pub fn is_part(path: &str) -> bool {
    canonical(path).is_ok_and(|path| part_at(&path).is_some())
}

/// The part that this canonical path names, and its axis.
fn part_at(path: &str) -> Option<(usize, &'static Part)> {
    let (axis, below) = below_axis(path)?;
    Some((axis, part_below_axis(below)?))
}

/// The path with its axis as a number.
fn canonical(written: &str) -> Result<Path, TreeError> {
    path::canonical(written).ok_or(TreeError::NotFound)
}

/// Number of nodes on the way to the deepest leaf.
const DEPTH: usize = StageSettings::SCHEMA.max_depth();

/// The canonical paths of all leaves, those in parts that may be left out too; in the order of the fields.
pub struct Leaves(NodeIter<ConstPath<Path, '/'>, DEPTH>);

/// All leaves of the tree.
pub fn leaves() -> Leaves {
    Leaves(NodeIter::new(StageSettings::SCHEMA))
}

impl Iterator for Leaves {
    type Item = Path;

    fn next(&mut self) -> Option<Path> {
        // No path is too long: a test reads the schema's longest.
        Some(self.0.next()?.ok()?.into_inner())
    }
}

/// True if there is a leaf at a canonical path.
pub fn is_leaf(path: &str) -> bool {
    StageSettings::SCHEMA
        .get(path)
        .is_ok_and(|found| found.schema.is_leaf())
}

/// The leaf of an axis by its keys. It is in the image once: without `dyn` the search would be there for every kind of keys,
/// inlined for every call.
#[inline(never)]
fn axis_leaf_by<'a>(
    axis: &'a AxisSettings,
    keys: &mut dyn Keys,
) -> Result<&'a dyn Any, ValueError> {
    axis.ref_any_by_key(keys)
}

/// The leaf at a path below an axis.
pub fn axis_leaf<'a>(axis: &'a AxisSettings, below: &str) -> Result<&'a dyn Any, TreeError> {
    Ok(axis_leaf_by(axis, &mut below.into_keys())?)
}

/// The number `field` (as the table names it) of an axis; `None` in a part that is left out.
pub(crate) fn number_at(axis: &AxisSettings, field: &str) -> Option<f64> {
    number(axis_leaf_by(axis, &mut ConstPathIter::<'.'>::new(Some(field))).ok()?)
}

impl StageSettings {
    /// The number `field` of the stage.
    pub(crate) fn number_at(&self, field: &str) -> Option<f64> {
        let keys: &mut dyn Keys = &mut ConstPathIter::<'.'>::new(Some(field));
        number(self.ref_any_by_key(keys).ok()?)
    }
}

/// True if two leaves have the same value, or both are left out.
fn same(one: Result<&dyn Any, ValueError>, other: Result<&dyn Any, ValueError>) -> bool {
    let (Ok(one), Ok(other)) = (&one, &other) else {
        return one.is_err() == other.is_err();
    };
    // Numbers, flags and names: none is longer.
    let (mut left, mut right) = ([0; 32], [0; 32]);
    to_bytes(*one, &mut left) == to_bytes(*other, &mut right) && left == right
}

/// True if the field (as the table names it) has the same value in both axes.
pub(crate) fn same_in(one: &AxisSettings, other: &AxisSettings, field: &str) -> bool {
    let mut keys = [(); 2].map(|()| ConstPathIter::<'.'>::new(Some(field)));
    let [first, second] = &mut keys;
    same(axis_leaf_by(one, first), axis_leaf_by(other, second))
}

impl StageSettings {
    /// True if the field of the stage has the same value in both.
    pub(crate) fn same_in(&self, other: &Self, field: &str) -> bool {
        let mut keys = [(); 2].map(|()| ConstPathIter::<'.'>::new(Some(field)));
        let [first, second] = &mut keys;
        same(
            self.ref_any_by_key(first as &mut dyn Keys),
            other.ref_any_by_key(second as &mut dyn Keys),
        )
    }
}

/// The leaf at a path below an axis, to be written.
pub(crate) fn axis_leaf_mut<'a>(
    axis: &'a mut AxisSettings,
    below: &str,
) -> Result<&'a mut dyn Any, TreeError> {
    let keys: &mut dyn Keys = &mut below.into_keys();
    Ok(axis.mut_any_by_key(keys)?)
}

/// A change to a leaf or a part.
enum Change<'a> {
    /// The part is removed.
    Remove,
    /// The part is made.
    Make,
    /// The leaf takes a value; false if it is none of its.
    Take(&'a dyn Fn(&mut dyn Any) -> bool),
}

/// A leaf, or a part and whether it is there.
enum Found<'a> {
    Leaf(&'a dyn Any),
    Part(bool),
}

impl StageSettings {
    /// The leaf at a canonical path.
    pub fn leaf(&self, path: &str) -> Result<&dyn Any, TreeError> {
        match below_axis(path) {
            Some((axis, below)) => {
                axis_leaf(self.axes.get(axis).ok_or(TreeError::NotFound)?, below)
            }
            None => Ok(self.ref_any_by_key(&mut path.into_keys() as &mut dyn Keys)?),
        }
    }

    /// The leaf at a canonical path, to be written.
    pub fn leaf_mut(&mut self, path: &str) -> Result<&mut dyn Any, TreeError> {
        match below_axis(path) {
            Some((axis, below)) => {
                axis_leaf_mut(self.axes.get_mut(axis).ok_or(TreeError::NotFound)?, below)
            }
            None => Ok(self.mut_any_by_key(&mut path.into_keys() as &mut dyn Keys)?),
        }
    }

    fn find(&self, path: &str) -> Result<Found<'_>, TreeError> {
        let path = canonical(path)?;
        match (self.leaf(&path), part_at(&path)) {
            (Ok(leaf), _) => Ok(Found::Leaf(leaf)),
            (Err(TreeError::Absent), Some(_)) => Ok(Found::Part(false)),
            (Err(TreeError::NotALeaf), Some((axis, part))) => Ok(Found::Part(
                self.axes.get(axis).is_some_and(part.is_present),
            )),
            (Err(error), _) => Err(error),
        }
    }

    /// Writes the JSON value of a leaf, or of a part that may be left out, into `buffer`, and returns its length.
    ///
    /// # Errors
    /// A path without a leaf, a leaf that is left out, or a buffer that is too small; 1.5 KB hold every value, and all but
    /// lists take less than 32 bytes.
    pub fn get_json(&self, path: &str, buffer: &mut [u8]) -> Result<usize, TreeError> {
        let value = match self.find(path)? {
            Found::Leaf(leaf) => return to_json(leaf, buffer).ok_or(TreeError::NoRoom),
            Found::Part(true) => PRESENT,
            Found::Part(false) => NULL,
        };
        let room = buffer.get_mut(..value.len()).ok_or(TreeError::NoRoom)?;
        room.copy_from_slice(value);
        Ok(value.len())
    }

    /// Writes a leaf, or makes or removes a part, and returns the axis it belongs to, if it does. A list that is left out is
    /// made by writing it.
    ///
    /// # Errors
    /// As for [`get_json`](Self::get_json), and a value that is not of the leaf's type; nothing has changed then.
    pub fn set_json(&mut self, path: &str, json: &[u8]) -> Result<Option<usize>, TreeError> {
        let change = match json {
            NULL if is_part(path) => Change::Remove,
            PRESENT if is_part(path) => Change::Make,
            _ => Change::Take(&|leaf| take_json(leaf, json)),
        };
        self.change(path, &change)
    }

    /// The value of a leaf, or of a part that may be left out, as bytes in `buffer`: their kind and length. A part's kind is
    /// 0, and its one byte 1 if it is there. `docs/settings-storage.md` has the kinds.
    ///
    /// # Errors
    /// As for [`get_json`](Self::get_json); [`MAX_VALUE_BYTES`] are enough.
    pub fn get_bytes(&self, path: &str, buffer: &mut [u8]) -> Result<(u8, usize), TreeError> {
        match self.find(path)? {
            Found::Leaf(leaf) => {
                let length = to_bytes(leaf, buffer).ok_or(TreeError::NoRoom)?;
                Ok((kind(leaf).ok_or(TreeError::Value)?, length))
            }
            Found::Part(present) => {
                *buffer.first_mut().ok_or(TreeError::NoRoom)? = present.into();
                Ok((KIND_PART, 1))
            }
        }
    }

    /// As [`set_json`](Self::set_json), from what [`get_bytes`](Self::get_bytes) gives.
    ///
    /// # Errors
    /// As there.
    pub fn set_bytes(
        &mut self,
        path: &str,
        kind: u8,
        bytes: &[u8],
    ) -> Result<Option<usize>, TreeError> {
        let change = match (kind, bytes) {
            (KIND_PART, [0]) => Change::Remove,
            (KIND_PART, [1]) => Change::Make,
            _ => Change::Take(&|leaf| take_bytes(leaf, kind, bytes)),
        };
        self.change(path, &change)
    }

    fn change(&mut self, path: &str, change: &Change) -> Result<Option<usize>, TreeError> {
        let path = canonical(path)?;
        let part = part_at(&path);
        let of_axis = below_axis(&path).map(|(axis, _)| axis);
        let made = match (part, change) {
            (None, Change::Remove | Change::Make) => {
                self.leaf(&path)?;
                return Err(TreeError::Value);
            }
            (None, Change::Take(_)) => None,
            (Some((index, part)), _) => {
                let axis = self.axes.get_mut(index).ok_or(TreeError::NotFound)?;
                if let Change::Remove = change {
                    (part.remove)(axis);
                    return Ok(of_axis);
                }
                let absent = !(part.is_present)(axis);
                if absent {
                    (part.make)(axis);
                }
                absent.then_some((index, part))
            }
        };
        let Change::Take(take) = change else {
            return Ok(of_axis);
        };
        let taken = match self.leaf_mut(&path) {
            Ok(leaf) => {
                if take(leaf) {
                    return Ok(of_axis);
                }
                TreeError::Value
            }
            Err(error) => error,
        };
        if let Some((index, part)) = made
            && let Some(axis) = self.axes.get_mut(index)
        {
            (part.remove)(axis);
        }
        Err(taken)
    }

    /// Calls `visit` with the path of every leaf that is there and of every part that may be left out, before its leaves:
    /// written in this order with [`set_json`](Self::set_json), the values make the same settings. `prefix` limits it to
    /// what lies below a path; it may be empty.
    ///
    /// # Errors
    /// A prefix that no path has.
    pub fn list(&self, prefix: &str, visit: &mut dyn FnMut(&str)) -> Result<(), TreeError> {
        let prefix = if prefix.is_empty() || prefix == "/" {
            Path::new()
        } else {
            canonical(prefix)?
        };
        let below = |path: &str| {
            path.strip_prefix(prefix.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        let mut found = false;
        let mut visit = |path: &str| {
            if below(path) {
                found = true;
                visit(path);
            }
        };
        let mut last_part: Option<(usize, &str)> = None;
        for leaf in leaves() {
            let Some((index, rest)) = below_axis(&leaf) else {
                visit(&leaf);
                continue;
            };
            let Some(part) = part_of(rest) else {
                visit(&leaf);
                continue;
            };
            if last_part != Some((index, part.path)) {
                last_part = Some((index, part.path));
                let end = leaf.len() - rest.len() + part.path.len();
                visit(leaf.get(..end).unwrap_or_default());
            }
            let present = self.axes.get(index).is_some_and(part.is_present);
            if present && rest != part.path {
                visit(&leaf);
            }
        }
        if found {
            Ok(())
        } else {
            Err(TreeError::NotFound)
        }
    }
}
