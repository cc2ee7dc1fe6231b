//! Margins as a publication prints them.

use quadrant_sim::margins::Margins;

/// A figure as a publication prints it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Printed {
    pub(crate) value: f64,
    /// Digits after the decimal point.
    pub(crate) decimals: usize,
}

impl Printed {
    /// Returns true if an exact value would be printed the same.
    pub(crate) fn reads(&self, exact: f64) -> bool {
        format!("{:.*}", self.decimals, exact) == format!("{:.*}", self.decimals, self.value)
    }
}

/// The four margins of a loop as a publication prints them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PrintedMargins {
    /// Gain margin, dB.
    pub(crate) gain_margin_db: Printed,
    /// Its frequency, Hz.
    pub(crate) phase_crossover_hz: Printed,
    /// Phase margin, deg.
    pub(crate) phase_margin_deg: Printed,
    /// Its frequency, Hz.
    pub(crate) gain_crossover_hz: Printed,
}

impl PrintedMargins {
    /// The open loop of the x axis with the PID (thesis, Fig 4.2): 9.9 dB at 194 Hz, 54.2 deg at 64.9 Hz.
    pub(crate) const THESIS_X: Self = Self {
        gain_margin_db: Printed {
            value: 9.9,
            decimals: 1,
        },
        phase_crossover_hz: Printed {
            value: 194.0,
            decimals: 0,
        },
        phase_margin_deg: Printed {
            value: 54.2,
            decimals: 1,
        },
        gain_crossover_hz: Printed {
            value: 64.9,
            decimals: 1,
        },
    };

    /// Returns true if exact margins would be printed the same.
    pub(crate) fn read(&self, exact: &Margins) -> bool {
        self.gain_margin_db.reads(exact.gain_margin_db)
            && self.phase_crossover_hz.reads(exact.phase_crossover_hz)
            && self.phase_margin_deg.reads(exact.phase_margin_deg)
            && self.gain_crossover_hz.reads(exact.gain_crossover_hz)
    }
}
