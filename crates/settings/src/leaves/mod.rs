//! The table of all settings: field, unit, range, default and meaning of each, written once.
//!
//! [`StageSettings::validate`](crate::StageSettings::validate) walks its ranges, the
//! [default settings](crate::StageSettings::default) and those of files that lack a field take its defaults,
//! `quadrant settings` and `docs/settings.md` are made from it. The firmware carries fields and ranges alone
//! (`rules`); words and units stay on the host. Defaults of flags, names and lists stand in `settings::defaults`, where
//! they are typed.
//!
//! A row comes after those that its range refers to, so that the first refused value is the one to mend.

mod feedback;
mod friction;
pub(super) mod limits;
mod pulses;
mod row;
pub(super) mod rules;
mod stage;
mod table;

pub use friction::LEAST_STIFFNESS_V_PER_MM;
pub use row::{Bound, Exchange, LeafInfo, Range, UNSET};
pub use table::{all, find};
pub(super) use table::{default, default_of};
