//! A PID to order: margins, crossover, or the stiffest loop under bounds on sensitivity.

use quadrant_law::control::pid::PidGains;
use quadrant_sim::margins::{MarginError, Margins};

use super::bandwidth::{NoLoop, PeakBounds, stiffest};
use super::form::Form;
use super::integral_gain::largest_integral_gain_where;
use super::process::Process;
use super::shaping::{ShapingError, shape_to_crossover, shape_to_margins};

/// Design target of a PID.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// A gain margin and a phase margin; the crossover follows from them.
    Margins {
        /// Gain margin, dB; above zero.
        gain_margin_db: f64,
        /// Phase margin, deg; above zero.
        phase_margin_deg: f64,
        /// The crossover that must come out to 0.05 Hz, Hz: bounds Ki, which lowers it. Nothing where it does not
        /// matter.
        crossover_hz: Option<f64>,
    },
    /// A crossover and a phase margin; the gain margin follows, and must be large enough.
    Crossover {
        /// Frequency at which the loop's gain is one, Hz; above zero.
        crossover_hz: f64,
        /// Phase margin, deg; above zero.
        phase_margin_deg: f64,
        /// Smallest gain margin, dB.
        least_gain_margin_db: f64,
    },
    /// The stiffest loop, that with the largest Kp, whose peaks of `|S|` and `|T|` stay within bounds.
    Bandwidth {
        /// Bound on `|S|`, above 1; 1.4 to 2 is usual (Åström and Hägglund, *Advanced PID Control*, 2006, ch. 7).
        sensitivity_peak: f64,
        /// Bound on `|T|`, above 1.
        complementary_peak: f64,
        /// The share of each bound that proportional and derivative gain leave to integral action, 0 to 0.5:
        /// [`INTEGRAL_SHARE`] is stiff, more integrates faster.
        integral_share: f64,
    },
}

/// A design to make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidRequest {
    pub target: Target,
    /// Form of the loop.
    pub form: Form,
    /// Time constant of the derivative's filter, s; above zero, and zero allowed in continuous time.
    pub derivative_filter_s: f64,
    /// Ki, V/(mm s); without it, as much as the target does not notice.
    pub ki_v_per_mm_s: Option<f64>,
}

/// Gains and the margins they have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidDesign {
    pub gains: PidGains,
    /// Margins of the loop in the form designed on.
    pub margins: Margins,
}

/// Reasons for which no such PID exists.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// The margins exclude each other, or the process has none.
    #[error(transparent)]
    Shaping(#[from] ShapingError),
    /// The loop that the gains close has no margins.
    #[error("the loop that these gains close cannot be judged: {0}")]
    Margins(#[from] MarginError),
    /// The margins asked for have another crossover.
    #[error(
        "gain margin and phase margin together leave no choice of the crossover: it lies at {found_hz:.2} Hz, not at {asked_hz} Hz; leave \
         one of the three out"
    )]
    Crossover {
        /// Crossover found, Hz.
        found_hz: f64,
        /// Crossover asked for, Hz.
        asked_hz: f64,
    },
    /// The crossover asked for leaves too small a gain margin.
    #[error(
        "with a crossover at {crossover_hz} Hz the gain margin is {found_db:.2} dB, less than the {least_db} dB asked for: lower the \
         crossover, or the phase margin"
    )]
    GainMargin {
        crossover_hz: f64,
        /// Margin left, dB.
        found_db: f64,
        /// Margin asked for, dB.
        least_db: f64,
    },
    /// No loop is stable with a structural mode.
    #[error(
        "no PID, with or without notch and low-pass, keeps |S| and |T| within their bounds with the mode at {frequency_hz:.0} Hz: a stiffer \
         coupling or guide, more damping, or the encoder on the motor would help; by hand, settings with less bandwidth"
    )]
    Mode {
        /// Frequency of the lowest mode, Hz.
        frequency_hz: f64,
    },
    /// No crossover meets the bounds.
    #[error(
        "no PID keeps |S| within {sensitivity_peak} and |T| within {complementary_peak}: the nearest exceeds one of them by {percent:.1} %"
    )]
    Bounds {
        /// Bound on `|S|`.
        sensitivity_peak: f64,
        /// Bound on `|T|`.
        complementary_peak: f64,
        /// Deviation of the nearest, %.
        percent: f64,
    },
}

/// Cost of integral action, as a loss of margin, dB and deg.
const INTEGRAL_COST: f64 = 0.05;
/// Tolerance of a crossover, Hz: half of the last digit that is printed of it.
const CROSSOVER_TOLERANCE_HZ: f64 = 0.05;
/// The usual share of the bounds for integral action: little, for the stiffest loop.
pub const INTEGRAL_SHARE: f64 = 0.02;

/// Returns true if a target still holds with integral action.
type Acceptance = Box<dyn Fn(&Margins) -> bool>;

/// Designs a PID: proportional and derivative gain for the target, then as much integral action as the target does not
/// notice. That is a Ki which moves neither margin by more than 0.05 dB or 0.05 deg, or, with bounds on `|S|` and `|T|`, one
/// that uses up the share left to it; rounded down to two significant digits.
///
/// # Errors
/// A target out of reach; says what is.
pub fn design_pid(process: &Process, request: &PidRequest) -> Result<PidDesign, DesignError> {
    let (form, filter_s) = (request.form, request.derivative_filter_s);
    let (gains, acceptable): (PidGains, Acceptance) = match request.target {
        Target::Margins {
            gain_margin_db,
            phase_margin_deg,
            crossover_hz,
        } => {
            let gains =
                shape_to_margins(process, form, filter_s, gain_margin_db, phase_margin_deg)?;
            let found_hz = process.margins(&gains, form)?.gain_crossover_hz;
            let misses = move |hz: f64| {
                crossover_hz.is_some_and(|asked_hz| (hz - asked_hz).abs() > CROSSOVER_TOLERANCE_HZ)
            };
            if let Some(asked_hz) = crossover_hz
                && misses(found_hz)
            {
                return Err(DesignError::Crossover { found_hz, asked_hz });
            }
            let kept = move |with: &Margins| {
                (with.gain_margin_db - gain_margin_db).abs() <= INTEGRAL_COST
                    && (with.phase_margin_deg - phase_margin_deg).abs() <= INTEGRAL_COST
                    && !misses(with.gain_crossover_hz)
            };
            (gains, Box::new(kept))
        }
        Target::Crossover {
            crossover_hz,
            phase_margin_deg,
            least_gain_margin_db: least_db,
        } => {
            let gains =
                shape_to_crossover(process, form, filter_s, crossover_hz, phase_margin_deg)?;
            let found_db = process.margins(&gains, form)?.gain_margin_db;
            if found_db < least_db {
                return Err(DesignError::GainMargin {
                    crossover_hz,
                    found_db,
                    least_db,
                });
            }
            let least_db = (found_db - INTEGRAL_COST).max(least_db);
            let kept = move |with: &Margins| {
                with.gain_margin_db >= least_db
                    && (with.phase_margin_deg - phase_margin_deg).abs() <= INTEGRAL_COST
            };
            (gains, Box::new(kept))
        }
        Target::Bandwidth {
            sensitivity_peak,
            complementary_peak,
            integral_share,
        } => {
            let proportional_share = 1.0 - integral_share;
            let bounds = PeakBounds {
                sensitivity: proportional_share * sensitivity_peak,
                complementary: proportional_share * complementary_peak,
            };
            let gains =
                stiffest(process, form, filter_s, &bounds).map_err(|reason| match reason {
                    NoLoop::Shaping(error) => DesignError::Shaping(error),
                    NoLoop::Excess(excess) => DesignError::Bounds {
                        sensitivity_peak,
                        complementary_peak,
                        percent: 100.0 * (proportional_share * excess - 1.0),
                    },
                })?;
            let kept = move |with: &Margins| {
                with.sensitivity_peak <= sensitivity_peak
                    && with.complementary_peak <= complementary_peak
            };
            (gains, Box::new(kept))
        }
    };
    let ki_v_per_mm_s = request
        .ki_v_per_mm_s
        .or_else(|| largest_integral_gain_where(process, form, &gains, acceptable));
    let gains = PidGains {
        ki_v_per_mm_s: ki_v_per_mm_s.unwrap_or(0.0),
        ..gains
    };
    Ok(PidDesign {
        gains,
        margins: process.margins(&gains, form)?,
    })
}
