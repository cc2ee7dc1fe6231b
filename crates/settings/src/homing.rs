//! The settings of homing.

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};
use strum::{AsRefStr, EnumString, VariantNames};

use quadrant_law::friction::Direction;

/// The switch that homing looks for.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, AsRefStr, EnumString, VariantNames,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum HomeSwitch {
    /// Home switch.
    Home,
    /// Limit switch at the end that is searched.
    Limit,
}

/// Homing of an axis: search of a switch, then of an index pulse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct HomingSettings {
    /// End of the travel towards which the switch is searched.
    #[tree(with = miniconf::leaf)]
    pub direction: Direction,
    /// Switch that is searched.
    #[tree(with = miniconf::leaf)]
    pub switch: HomeSwitch,
    /// Velocity of the search and of the move after it, mm/s; held to the axis' largest.
    pub search_mm_s: f64,
    /// Creep velocity, mm/s: off the switch, over its edge and to the index pulse.
    pub latch_mm_s: f64,
    /// Longest bounce of the switch, s; its reading is delayed by as much.
    pub debounce_s: f64,
    /// True if the reference mark is the first index pulse after the switch, false if it is the switch's edge. Needs
    /// `encoder.counts_per_index`.
    pub index: bool,
    /// Position of the reference mark, mm; rounded to a whole count.
    pub mark_mm: f64,
    /// Position to which the axis moves in the end, mm; held to the travel.
    pub park_mm: f64,
    /// Longest way to the switch, and off it, before homing fails, mm.
    pub travel_mm: f64,
}
