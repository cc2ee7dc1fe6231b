//! Position against count: both pins of an encoder move together.

/// Way over which they are compared, mm. An index, at which the position jumps, is in one of these stretches at most.
const STRETCH_MM: f64 = 1.0;
/// Largest difference of a stretch, in parts of it.
const TOLERANCE: f64 = 0.1;
/// Stretches one after the other that differ before it is a fault.
const STRETCHES: u32 = 3;

/// Compares the way of the position with that of the count.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EncoderScale {
    /// The position when the stretch began; none before the first tick.
    began_mm: Option<f64>,
    counted_mm: f64,
    differ: u32,
}

impl EncoderScale {
    /// One tick, in which the count has moved by `counted_mm`; false once they differ.
    pub(crate) fn agrees(&mut self, counted_mm: f64, position_mm: f64) -> bool {
        let began_mm = *self.began_mm.get_or_insert(position_mm);
        self.counted_mm += counted_mm;
        let moved_mm = position_mm - began_mm;
        let way_mm = self.counted_mm.abs().max(moved_mm.abs());
        if way_mm >= STRETCH_MM {
            let agrees = (moved_mm - self.counted_mm).abs() <= TOLERANCE * way_mm;
            self.differ = if agrees { 0 } else { self.differ + 1 };
            self.began_mm = Some(position_mm);
            self.counted_mm = 0.0;
        }
        self.differ < STRETCHES
    }
}
