//! Checks of how an axis finds out where it is.

use super::{LONGEST_TRAVEL_MM, Place};
use crate::settings::{AxisSettings, Reason, SettingsError};

/// The slowest and the fastest homing, mm/s.
const SLOWEST_MM_S: f64 = 1e-3;
const FASTEST_MM_S: f64 = 1e3;
/// The longest bounce of a switch, s.
const LONGEST_BOUNCE_S: f64 = 0.1;

impl AxisSettings {
    pub(super) fn validate_homing(&self, at: Place) -> Result<(), SettingsError> {
        let Some(homing) = &self.homing else {
            return Ok(());
        };
        at.within(
            "homing.search_mm_s",
            homing.search_mm_s,
            SLOWEST_MM_S,
            FASTEST_MM_S,
        )?;
        at.within(
            "homing.latch_mm_s",
            homing.latch_mm_s,
            SLOWEST_MM_S,
            homing.search_mm_s,
        )?;
        let field = "homing.debounce_s";
        at.within(field, homing.debounce_s, 0.0, LONGEST_BOUNCE_S)?;
        if homing.index && self.encoder.counts_per_index.is_none() {
            return at.refuse("homing.index", 1.0, Reason::IndexUnknown);
        }
        for (field, value) in [
            ("homing.mark_mm", homing.mark_mm),
            ("homing.park_mm", homing.park_mm),
        ] {
            at.within(field, value, -LONGEST_TRAVEL_MM, LONGEST_TRAVEL_MM)?;
        }
        at.within(
            "homing.travel_mm",
            homing.travel_mm,
            self.encoder.resolution_mm,
            2.0 * LONGEST_TRAVEL_MM,
        )
    }
}
