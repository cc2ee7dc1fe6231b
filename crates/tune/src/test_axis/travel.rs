//! The room that an axis has from where it stands.

use quadrant_sim::stage_file::DataSheet;

/// Room in both directions, mm, each zero or more, and not both zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// To smaller positions.
    pub negative_mm: f64,
    /// To larger ones.
    pub positive_mm: f64,
}

impl Travel {
    /// That of the built-in stage's axes.
    pub const BUILT_IN: Self = Self::either_way(200.0);

    /// That of a simulated axis: as its data sheet says, or the built-in one.
    pub fn of(known: Option<DataSheet>) -> Self {
        known.map_or(Self::BUILT_IN, |known| Self::between(known.travel_mm))
    }

    /// As much either way, mm.
    pub const fn either_way(mm: f64) -> Self {
        Self {
            negative_mm: mm,
            positive_mm: mm,
        }
    }

    /// To both ends, mm: from where the axis stands, the negative one first.
    pub const fn between([negative_mm, positive_mm]: [f64; 2]) -> Self {
        Self {
            negative_mm: -negative_mm,
            positive_mm,
        }
    }

    /// From the middle to either end, mm.
    pub fn half_mm(self) -> f64 {
        0.5 * (self.negative_mm + self.positive_mm)
    }

    /// To the nearer end, mm.
    pub fn nearer_mm(self) -> f64 {
        self.negative_mm.min(self.positive_mm)
    }

    /// Position of where the axis stands, counted from the middle, mm.
    pub fn start_mm(self) -> f64 {
        0.5 * (self.negative_mm - self.positive_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_from_the_middle_of_the_travel() {
        let travel = Travel {
            negative_mm: 5.0,
            positive_mm: 180.0,
        };
        assert_eq!((travel.half_mm(), travel.start_mm()), (92.5, -87.5));
        assert_eq!(travel.start_mm() - travel.negative_mm, -travel.half_mm());
        assert_eq!(travel.nearer_mm(), 5.0);
        assert_eq!(Travel::either_way(20.0).start_mm(), 0.0);
        assert_eq!(Travel::between([-5.0, 180.0]), travel);
    }
}
