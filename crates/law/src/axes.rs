//! The stage's three axes by name, and what there is one of for each.

use core::array;
use core::fmt;
use core::ops::{Deref, DerefMut, Index, IndexMut};

/// One of the stage's three axes. Its name in text is in lower case: `x`, `y`, `z`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
#[cfg_attr(
    feature = "names",
    derive(strum::AsRefStr, strum::EnumString, strum::VariantNames),
    strum(serialize_all = "lowercase")
)]
pub enum AxisName {
    /// Index 0 in every array of three.
    X,
    /// Index 1 in every array of three.
    Y,
    /// Index 2 in every array of three.
    Z,
}

impl AxisName {
    /// All axes, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// The axis' name in lower case.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

impl fmt::Display for AxisName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// One `T` for each axis. It is stored, and crosses the link, as an array of three: x, y, z.
///
/// ```
/// use quadrant_law::axes::{AxisName, PerAxis};
///
/// let mut feeds_mm_s = PerAxis::splat(10.0);
/// feeds_mm_s[AxisName::Z] = 2.0;
/// assert_eq!(feeds_mm_s.map(|feed| 60.0 * feed), PerAxis::new([600.0, 600.0, 120.0]));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(transparent)
)]
pub struct PerAxis<T>([T; 3]);

impl<T> PerAxis<T> {
    /// The values of x, y and z.
    pub const fn new(values: [T; 3]) -> Self {
        Self(values)
    }

    /// The same value for every axis.
    pub const fn splat(value: T) -> Self
    where
        T: Copy,
    {
        Self([value; 3])
    }

    /// The value that `make` gives for each axis.
    pub fn from_fn(make: impl FnMut(AxisName) -> T) -> Self {
        Self(AxisName::ALL.map(make))
    }

    /// Each value turned into another.
    pub fn map<U>(self, change: impl FnMut(T) -> U) -> PerAxis<U> {
        PerAxis(self.0.map(change))
    }

    /// References to the values.
    pub const fn by_ref(&self) -> PerAxis<&T> {
        let [x, y, z] = &self.0;
        PerAxis([x, y, z])
    }

    /// Each value with that of another set for the same axis.
    pub fn zip<U>(self, other: PerAxis<U>) -> PerAxis<(T, U)> {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        PerAxis([(a, d), (b, e), (c, f)])
    }

    /// The values with their axes' names, in order.
    pub fn named(&self) -> impl ExactSizeIterator<Item = (AxisName, &T)> {
        AxisName::ALL.into_iter().zip(&self.0)
    }

    /// The values of x, y and z.
    pub fn into_array(self) -> [T; 3] {
        self.0
    }
}

impl<T> From<[T; 3]> for PerAxis<T> {
    fn from(values: [T; 3]) -> Self {
        Self(values)
    }
}

impl<T> From<PerAxis<T>> for [T; 3] {
    fn from(values: PerAxis<T>) -> Self {
        values.0
    }
}

impl<T: PartialEq> PartialEq<[T; 3]> for PerAxis<T> {
    fn eq(&self, values: &[T; 3]) -> bool {
        self.0 == *values
    }
}

impl<T> Deref for PerAxis<T> {
    type Target = [T; 3];

    fn deref(&self) -> &[T; 3] {
        &self.0
    }
}

impl<T> DerefMut for PerAxis<T> {
    fn deref_mut(&mut self) -> &mut [T; 3] {
        &mut self.0
    }
}

impl<T> Index<AxisName> for PerAxis<T> {
    type Output = T;

    #[inline(always)]
    fn index(&self, axis: AxisName) -> &T {
        // Nothing here can be out of bounds, so nothing can panic.
        let [x, y, z] = &self.0;
        match axis {
            AxisName::X => x,
            AxisName::Y => y,
            AxisName::Z => z,
        }
    }
}

impl<T> IndexMut<AxisName> for PerAxis<T> {
    #[inline(always)]
    fn index_mut(&mut self, axis: AxisName) -> &mut T {
        let [x, y, z] = &mut self.0;
        match axis {
            AxisName::X => x,
            AxisName::Y => y,
            AxisName::Z => z,
        }
    }
}

/// Panics beyond 2: for hosts and tests. The tick indexes by name.
impl<T> Index<usize> for PerAxis<T> {
    type Output = T;

    fn index(&self, index: usize) -> &T {
        &self.0[index]
    }
}

/// Panics beyond 2: for hosts and tests. The tick indexes by name.
impl<T> IndexMut<usize> for PerAxis<T> {
    fn index_mut(&mut self, index: usize) -> &mut T {
        &mut self.0[index]
    }
}

impl<T> IntoIterator for PerAxis<T> {
    type Item = T;
    type IntoIter = array::IntoIter<T, 3>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl<'a, T> IntoIterator for &'a PerAxis<T> {
    type Item = &'a T;
    type IntoIter = core::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

impl<'a, T> IntoIterator for &'a mut PerAxis<T> {
    type Item = &'a mut T;
    type IntoIter = core::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter_mut()
    }
}
