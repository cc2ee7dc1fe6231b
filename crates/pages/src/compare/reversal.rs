//! One reversal of a sine, cut out of its cycle.

use quadrant_sim::run::AxisTrace;

use crate::parts::UM_PER_MM;

/// Control period of the traces, s.
const PERIOD_S: f64 = 1e-4;
/// Part of the cycle before and after the reversal that is shown.
const SHOWN: (f64, f64) = (0.003, 0.022);

/// The error about a reversal in the middle of a cycle, every tick of it.
#[derive(Clone, Debug)]
pub struct Reversal {
    /// Time from the reversal, s.
    pub time_s: Vec<f64>,
    /// The tracking error, um.
    pub error_um: Vec<f64>,
}

impl Reversal {
    /// Cuts the reversal out of a cycle; nothing of a cycle without one.
    pub fn of(cycle: &AxisTrace) -> Option<Self> {
        let count = cycle.reference_mm.len();
        let middle = count / 4..count - count / 4;
        let extreme = |index: &usize| cycle.reference_mm[*index].abs();
        let at = middle.max_by(|one, other| extreme(one).total_cmp(&extreme(other)))?;
        let part = |share: f64| (share * count as f64) as usize;
        let (from, to) = (at.saturating_sub(part(SHOWN.0)), at + part(SHOWN.1));
        let error_mm = cycle.error_mm.get(from..to)?;
        Some(Self {
            time_s: (from..to)
                .map(|tick| (tick as f64 - at as f64) * PERIOD_S)
                .collect(),
            error_um: error_mm.iter().map(|mm| mm * UM_PER_MM).collect(),
        })
    }

    /// Returns the time that is shown, s.
    pub fn duration_s(&self) -> f64 {
        self.error_um.len() as f64 * PERIOD_S
    }
}
