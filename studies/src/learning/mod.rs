//! Learning of the friction feedforward's scale: other starts, friction that is known, part programs, changes of the axis, and
//! what else may be done about a cut.

mod changes;
pub mod command;
mod cuts;
mod figures;
mod known;
mod parts;
mod recorded;
mod remedies;
mod run;
mod starts;
