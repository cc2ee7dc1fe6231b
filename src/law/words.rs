//! Built configuration as 32-bit words: an axis that a host has built, on its way to a board that builds none.
//!
//! Every type that the tick reads says once, field by field, which words it is made of ([`Words`]). The same passage over a value
//! gives its words or takes new ones ([`Window`]), so that what one side writes is what the other reads. A window shows a part of
//! the words: a board takes an axis in pieces, in place, and no buffer holds the whole of it.
//!
//! Each word that is taken is checked: a variant must be known, a number finite, a length within its capacity. That the words
//! are of the same layout tells [`Words::LAYOUT`], a hash of all names and types, and that none was damaged a CRC; both are for
//! whoever carries them.
//!
//! ```
//! use quadrant::axis::Axis;
//! use quadrant::law::words::{Window, Words};
//! use quadrant::settings::StageSettings;
//! use quadrant::axes::AxisName;
//!
//! let mut built: Axis<f32, 8> = StageSettings::simulated().build_axis(AxisName::X);
//! let mut words = vec![0; Window::count(&mut built)];
//! Window::give(&mut words, 0).pass_over(&mut built)?;
//!
//! let mut taken = Axis::<f32, 8>::blank();
//! for (part, chunk) in words.chunks_mut(100).enumerate() {
//!     Window::take(chunk, 100 * part).pass_over(&mut taken)?;
//! }
//! assert_eq!(taken, built);
//! # Ok::<(), quadrant::law::words::WordsError>(())
//! ```

use core::fmt;

use heapless::Vec;

/// A value that is made of words.
pub trait Words: Sized {
    /// Hash of the type's name, and of the names and types of its fields: it differs where the words would mean something else.
    const LAYOUT: u32;

    /// A value that is to be taken over from words: zeros wherever there can be, so that making one takes no room on the stack.
    const BLANK: Self;

    /// Passes over the words in order.
    ///
    /// # Errors
    /// A word in the window that the type does not know.
    fn pass(&mut self, window: &mut Window<'_>) -> Result<(), WordsError>;
}

/// A word that was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WordsError {
    /// Its place among the words of the value, from zero.
    pub place: usize,
    /// The flaw of it.
    pub flaw: WordFlaw,
}

/// A flaw of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WordFlaw {
    /// It names no variant.
    Variant,
    /// It ends a number that is not finite.
    NotFinite,
    /// It is a length beyond the capacity, or a number beyond what its type holds.
    TooLarge,
}

impl fmt::Display for WordsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let flaw = match self.flaw {
            WordFlaw::Variant => "names no variant",
            WordFlaw::NotFinite => "is not finite",
            WordFlaw::TooLarge => "is too large",
        };
        write!(f, "word {} {flaw}", self.place)
    }
}

impl core::error::Error for WordsError {}

/// The direction of a passage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Passage {
    /// From the value.
    Give,
    /// Into the value.
    Take,
}

/// Some consecutive words of a value.
#[derive(Debug)]
pub struct Window<'a> {
    words: &'a mut [u32],
    /// Place of the first word of the window.
    first: usize,
    /// Place of the next word.
    place: usize,
    passage: Passage,
}

impl<'a> Window<'a> {
    /// A window that is filled with a value's words from the one at `first` on.
    pub fn give(words: &'a mut [u32], first: usize) -> Self {
        Self::new(words, first, Passage::Give)
    }

    /// A window whose words, from the one at `first` on, take the place of a value's. A value is taken from its first word on.
    pub fn take(words: &'a mut [u32], first: usize) -> Self {
        Self::new(words, first, Passage::Take)
    }

    fn new(words: &'a mut [u32], first: usize, passage: Passage) -> Self {
        Self {
            words,
            first,
            place: 0,
            passage,
        }
    }

    /// The number of words of a value.
    pub fn count<T: Words>(value: &mut T) -> usize {
        // Nothing is taken, so nothing is refused.
        Window::give(&mut [], 0)
            .pass_over(value)
            .unwrap_or_default()
    }

    /// Passes over a value; returns the number of its words.
    ///
    /// # Errors
    /// The first word taken that is refused; the value is of no use then.
    pub fn pass_over<T: Words>(mut self, value: &mut T) -> Result<usize, WordsError> {
        value.pass(&mut self)?;
        Ok(self.place)
    }

    /// Passes over one word; returns true if it was taken.
    #[inline(never)]
    fn word(&mut self, own: &mut u32) -> bool {
        let place = self.place;
        self.place += 1;
        let shown = place
            .checked_sub(self.first)
            .and_then(|index| self.words.get_mut(index));
        match (shown, self.passage) {
            (Some(word), Passage::Give) => *word = *own,
            (Some(word), Passage::Take) => {
                *own = *word;
                return true;
            }
            (None, _) => {}
        }
        false
    }

    /// The refusal of the word passed over last.
    fn refuse(&self, flaw: WordFlaw) -> WordsError {
        WordsError {
            place: self.place.saturating_sub(1),
            flaw,
        }
    }

    /// Passes over the number of a variant, 0 to `variants` less one; returns true if it is another now.
    ///
    /// # Errors
    /// A number that is none.
    #[inline(never)]
    pub(crate) fn variant(&mut self, own: &mut u32, variants: u32) -> Result<bool, WordsError> {
        let before = *own;
        self.word(own);
        if *own >= variants {
            return Err(self.refuse(WordFlaw::Variant));
        }
        Ok(*own != before)
    }

    /// Passes over an unsigned number up to `most`.
    #[inline(never)]
    fn up_to(&mut self, own: &mut u32, most: u32) -> Result<(), WordsError> {
        self.word(own);
        if *own > most {
            return Err(self.refuse(WordFlaw::TooLarge));
        }
        Ok(())
    }

    /// Passes over two words, the lower half first; returns true if the second was taken.
    #[inline(never)]
    fn double(&mut self, own: &mut u64) -> bool {
        let (mut low, mut high) = (*own as u32, (*own >> 32) as u32);
        self.word(&mut low);
        let taken = self.word(&mut high);
        *own = u64::from(high) << 32 | u64::from(low);
        taken
    }
}

/// Hash of nothing (FNV-1a).
pub(crate) const NO_LAYOUT: u32 = 0x811C_9DC5;

/// Adds a name to a hash.
pub(crate) const fn with_name(hash: u32, name: &str) -> u32 {
    let (bytes, mut hash, mut index) = (name.as_bytes(), hash, 0);
    while index < bytes.len() {
        hash = (hash ^ bytes[index] as u32).wrapping_mul(0x0100_0193);
        index += 1;
    }
    // What ends a name, so that its letters are not another's.
    (hash ^ 0xFF).wrapping_mul(0x0100_0193)
}

/// Adds a layout, or a number, to a hash.
pub(crate) const fn with_layout(hash: u32, layout: u32) -> u32 {
    let (bytes, mut hash, mut index) = (layout.to_le_bytes(), hash, 0);
    while index < bytes.len() {
        hash = (hash ^ bytes[index] as u32).wrapping_mul(0x0100_0193);
        index += 1;
    }
    hash
}

/// The number of variants, whose numbers must be 0, 1, 2 and so on.
pub(crate) const fn in_order(numbers: &[u32]) -> u32 {
    let mut index = 0;
    while index < numbers.len() {
        assert!(numbers[index] == index as u32, "variants out of order");
        index += 1;
    }
    index as u32
}

/// Says of a type which words it is made of: in brackets its generic parameters, then its fields in the order of their words.
///
/// A field that is not named, or of another type, does not compile. A variant has its number first; what it holds is named twice,
/// the second time as the passage calls it.
macro_rules! words {
    ([$($parameters:tt)*] struct $type:ty { $($field:tt: $of:ty),* $(,)? }) => {
        impl<$($parameters)*> $crate::law::words::Words for $type {
            const LAYOUT: u32 = {
                use $crate::law::words::{NO_LAYOUT, with_layout, with_name};
                let hash = with_name(NO_LAYOUT, stringify!($type));
                $(
                    let hash = with_name(hash, stringify!($field));
                    let hash = with_layout(hash, <$of as $crate::law::words::Words>::LAYOUT);
                )*
                hash
            };

            const BLANK: Self = Self { $($field: <$of as $crate::law::words::Words>::BLANK),* };

            fn pass(
                &mut self,
                window: &mut $crate::law::words::Window<'_>,
            ) -> Result<(), $crate::law::words::WordsError> {
                let Self { $($field: _),* } = self;
                $( <$of as $crate::law::words::Words>::pass(&mut self.$field, window)?; )*
                Ok(())
            }
        }
    };
    ([$($parameters:tt)*] enum $type:ty {
        $($number:literal $variant:ident { $($field:tt $name:ident: $of:ty),* }),* $(,)?
    }) => {
        impl<$($parameters)*> $crate::law::words::Words for $type {
            const LAYOUT: u32 = {
                use $crate::law::words::{NO_LAYOUT, with_layout, with_name};
                let hash = with_name(NO_LAYOUT, stringify!($type));
                $(
                    let hash = with_layout(hash, $number);
                    let hash = with_name(hash, stringify!($variant));
                    $(
                        let hash = with_layout(hash, <$of as $crate::law::words::Words>::LAYOUT);
                    )*
                )*
                hash
            };

            const BLANK: Self = $crate::law::words::first!($(
                Self::$variant { $($field: <$of as $crate::law::words::Words>::BLANK),* }
            ),*);

            fn pass(
                &mut self,
                window: &mut $crate::law::words::Window<'_>,
            ) -> Result<(), $crate::law::words::WordsError> {
                const VARIANTS: u32 = $crate::law::words::in_order(&[$($number),*]);
                let mut number: u32 = match self {
                    $( Self::$variant { .. } => $number ),*
                };
                if window.variant(&mut number, VARIANTS)? {
                    $(
                        if number == $number {
                            *self = Self::$variant {
                                $($field: <$of as $crate::law::words::Words>::BLANK),*
                            };
                        }
                    )*
                }
                match self {
                    $(
                        Self::$variant { $($field: $name),* } => {
                            $( <$of as $crate::law::words::Words>::pass($name, window)?; )*
                        }
                    )*
                }
                Ok(())
            }
        }
    };
}

/// The first of some expressions.
macro_rules! first {
    ($first:expr $(, $rest:expr)*) => {
        $first
    };
}

pub(crate) use {first, words};

/// Says of a number which words it is.
macro_rules! number {
    ($type:ty, |$own:ident, $window:ident| $pass:expr) => {
        impl Words for $type {
            const LAYOUT: u32 = with_name(NO_LAYOUT, stringify!($type));

            const BLANK: Self = 0 as $type;

            #[inline(never)]
            fn pass(&mut self, $window: &mut Window<'_>) -> Result<(), WordsError> {
                let $own = self;
                $pass
            }
        }
    };
}

number!(u32, |own, window| {
    window.word(own);
    Ok(())
});

number!(i32, |own, window| {
    let mut word = *own as u32;
    window.word(&mut word);
    *own = word as i32;
    Ok(())
});

number!(u8, |own, window| {
    let mut word = u32::from(*own);
    window.up_to(&mut word, u8::MAX.into())?;
    *own = word as u8;
    Ok(())
});

number!(u16, |own, window| {
    let mut word = u32::from(*own);
    window.up_to(&mut word, u16::MAX.into())?;
    *own = word as u16;
    Ok(())
});

// An index or a number of ticks: a word on every target.
number!(usize, |own, window| {
    let mut word = *own as u32;
    window.word(&mut word);
    *own = word as usize;
    Ok(())
});

impl Words for bool {
    const LAYOUT: u32 = with_name(NO_LAYOUT, "bool");

    const BLANK: Self = false;

    fn pass(&mut self, window: &mut Window<'_>) -> Result<(), WordsError> {
        let mut word = u32::from(*self);
        window.variant(&mut word, 2)?;
        *self = word != 0;
        Ok(())
    }
}

number!(u64, |own, window| {
    window.double(own);
    Ok(())
});

number!(i64, |own, window| {
    let mut words = *own as u64;
    window.double(&mut words);
    *own = words as i64;
    Ok(())
});

number!(i128, |own, window| {
    let (mut low, mut high) = (*own as u64, (*own >> 64) as u64);
    window.double(&mut low);
    window.double(&mut high);
    *own = (u128::from(high) << 64 | u128::from(low)) as i128;
    Ok(())
});

number!(f32, |own, window| {
    let mut word = own.to_bits();
    let taken = window.word(&mut word);
    *own = f32::from_bits(word);
    if taken && !own.is_finite() {
        return Err(window.refuse(WordFlaw::NotFinite));
    }
    Ok(())
});

number!(f64, |own, window| {
    let mut words = own.to_bits();
    let taken = window.double(&mut words);
    *own = f64::from_bits(words);
    // The first half of the next number's words may lie between two windows: it is looked at when the second is there.
    if taken && !own.is_finite() {
        return Err(window.refuse(WordFlaw::NotFinite));
    }
    Ok(())
});

impl<T: Words, const N: usize> Words for [T; N] {
    const LAYOUT: u32 = with_layout(with_layout(NO_LAYOUT, N as u32), T::LAYOUT);

    const BLANK: Self = [const { T::BLANK }; N];

    fn pass(&mut self, window: &mut Window<'_>) -> Result<(), WordsError> {
        for each in self {
            each.pass(window)?;
        }
        Ok(())
    }
}

impl<A: Words, B: Words> Words for (A, B) {
    const LAYOUT: u32 = with_layout(with_layout(with_name(NO_LAYOUT, "2"), A::LAYOUT), B::LAYOUT);

    const BLANK: Self = (A::BLANK, B::BLANK);

    fn pass(&mut self, window: &mut Window<'_>) -> Result<(), WordsError> {
        self.0.pass(window)?;
        self.1.pass(window)
    }
}

impl<A: Words, B: Words, C: Words> Words for (A, B, C) {
    const LAYOUT: u32 = with_layout(
        with_layout(with_layout(with_name(NO_LAYOUT, "3"), A::LAYOUT), B::LAYOUT),
        C::LAYOUT,
    );

    const BLANK: Self = (A::BLANK, B::BLANK, C::BLANK);

    fn pass(&mut self, window: &mut Window<'_>) -> Result<(), WordsError> {
        self.0.pass(window)?;
        self.1.pass(window)?;
        self.2.pass(window)
    }
}

impl<T: Words> Words for Option<T> {
    const LAYOUT: u32 = with_layout(with_name(NO_LAYOUT, "Option"), T::LAYOUT);

    const BLANK: Self = None;

    fn pass(&mut self, window: &mut Window<'_>) -> Result<(), WordsError> {
        let mut number = u32::from(self.is_some());
        if window.variant(&mut number, 2)? {
            *self = (number == 1).then_some(T::BLANK);
        }
        match self {
            Some(value) => value.pass(window),
            None => Ok(()),
        }
    }
}

impl<T: Words, const N: usize> Words for Vec<T, N> {
    const LAYOUT: u32 = with_layout(
        with_layout(with_name(NO_LAYOUT, "Vec"), N as u32),
        T::LAYOUT,
    );

    const BLANK: Self = Self::new();

    fn pass(&mut self, window: &mut Window<'_>) -> Result<(), WordsError> {
        let mut length = self.len() as u32;
        window.up_to(&mut length, N as u32)?;
        self.truncate(length as usize);
        while self.len() < length as usize {
            // There is room: the length is within the capacity.
            let _ = self.push(T::BLANK);
        }
        for each in self {
            each.pass(window)?;
        }
        Ok(())
    }
}
