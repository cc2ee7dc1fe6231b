//! The response of the nominal closed loop at the spindle's frequencies, and the margin that its phase has. Settings time only.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use num_complex::Complex64;

use crate::law::control::filter::FilterSettings;
use crate::law::control::pid::PidGains;
use crate::law::control::plant_model::PlantModel;
use crate::law::friction::gms::GmsParameters;

/// Control periods in a step.
pub const STEP_TICKS: u32 = 4;

/// Least margin of phase, degrees: a harmonic is left out where the loop's phase may be wrong by more than the rest of a
/// right angle.
pub const LEAST_MARGIN_DEG: f64 = 30.0;

/// Largest gain of one harmonic's growth on slow errors, over the law's proportional gain: the rate is lower where it would be
/// larger.
const MOST_GAIN: f64 = 0.1;

/// Errors of the plant's mass that the margin is for, as factors.
const MASSES: [f64; 2] = [0.75, 1.33];
/// Errors of the plant's dead time that the margin is for, as factors.
const DEAD_TIMES: [f64; 2] = [0.9, 1.1];

/// Amplitudes of a vibration before sliding, mm.
const AMPLITUDES_MM: [f64; 4] = [2e-3, 5e-3, 10e-3, 20e-3];
/// Least response before sliding that counts, over the response while sliding.
const LEAST_SHARE: f64 = 0.3;
/// Largest lead of the response before sliding that counts, rad.
const MOST_LEAD: f64 = 45.0 * PI / 180.0;

/// Number of positions at which the virgin curve is integrated.
const INTEGRATION_POINTS: u32 = 16;

/// The table's first octave begins at 2^FIRST_OCTAVE units, 2^-9 turns in a step: 4.9 Hz at 10 kHz. There are eight octaves.
const FIRST_OCTAVE: u32 = 23;
/// Intervals in an octave, as a power of two.
const INTERVAL_BITS: u32 = 2;

/// Nodes of the table: the last one, at 7/16 of a turn in a step, is 1094 Hz at 10 kHz.
pub(super) const NODES: usize = 8 << INTERVAL_BITS;

/// The frequency of a node, turns in a step.
pub(super) fn node_turns(index: usize) -> f64 {
    let intervals = 1usize << INTERVAL_BITS;
    let place = (index % intervals) as f64 / intervals as f64;
    let octave = (index / intervals) as i32 + FIRST_OCTAVE as i32 - 32;
    libm::scalbn(1.0 + place, octave)
}

/// The interval of the table that holds a frequency, 2^-32 turns in a step, and the place in it with 30 fraction bits; none
/// below the first.
#[inline(always)]
pub(super) fn interval(turns: u32) -> Option<(usize, i32)> {
    let leading = turns.leading_zeros();
    let octave = (31 - FIRST_OCTAVE).checked_sub(leading)?;
    let normal = turns << (leading & 31);
    let within = (normal << 1) >> (32 - INTERVAL_BITS);
    let place = ((normal << (1 + INTERVAL_BITS)) >> 2) as i32;
    Some((((octave << INTERVAL_BITS) + within) as usize, place))
}

/// The loop that is cancelled in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CancellingLoop<'a> {
    /// The axis' plant.
    pub plant: &'a PlantModel,
    /// Its law at small errors.
    pub pid: &'a PidGains,
    /// Its friction before sliding.
    pub friction: &'a GmsParameters,
    /// Its mean breakaway level, V.
    pub breakaway_v: f64,
    /// The filters behind the law.
    pub filters: &'a [FilterSettings],
    /// The largest gain of the law over that at small errors: above 1 with an N-PID.
    pub largest_gain: f64,
}

/// A vector at a frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Node {
    /// Its growth by the error of one step, V/mm.
    pub(super) growth: Complex64,
    /// The error of the last tick that it takes away, mm/V.
    pub(super) response: Complex64,
}

/// `sin(x) / x` of a positive number.
fn sinc(x: f64) -> f64 {
    libm::sin(x) / x
}

fn cis(angle: f64) -> Complex64 {
    let (sine, cosine) = libm::sincos(angle);
    Complex64::new(cosine, sine)
}

impl CancellingLoop<'_> {
    /// A vector at a frequency; none where the margin is too small.
    pub(super) fn node(&self, frequency_hz: f64, rate_per_s: f64, period_s: f64) -> Option<Node> {
        if self.margin_deg(frequency_hz, period_s) < LEAST_MARGIN_DEG {
            return None;
        }
        let omega = TAU * frequency_hz;
        let step_s = period_s * f64::from(STEP_TICKS);
        // The growth acts on slow errors, too, as a gain of 2 rate / |w G|: it stays a share of the law's.
        let response = self.response(self.plant, 1.0, omega, period_s);
        let lead = self.lead(response, omega, period_s);
        let most_per_s =
            MOST_GAIN * self.pid.kp_v_per_mm * omega * 0.5 * libm::sqrt(response.norm_sqr());
        let rate_per_s = rate_per_s.min(most_per_s);
        // A straight line from step to step in place of a sine.
        let line = sinc(0.5 * omega * step_s);
        // The error is that of the tick before.
        let response = response * line * line * cis(lead - omega * period_s);
        Some(Node {
            growth: response.inv() * (2.0 * rate_per_s * step_s),
            response,
        })
    }

    /// Angle that the response is taken to be ahead of the one while the axis slides: half way to the one before sliding.
    fn lead(&self, sliding: Complex64, omega: f64, period_s: f64) -> f64 {
        let mut most = 0.0;
        for amplitude_mm in AMPLITUDES_MM {
            let held = self.held(amplitude_mm) * self.plant.gain_mm_per_v_s2;
            let response = self.response_of(self.plant, held, 1.0, omega, period_s);
            let ratio = response * sliding.conj();
            if response.norm_sqr() > LEAST_SHARE * LEAST_SHARE * sliding.norm_sqr() {
                most = f64::max(most, libm::atan2(ratio.im, ratio.re));
            }
        }
        (0.5 * most).min(MOST_LEAD)
    }

    /// Stiffness of the friction before sliding at an amplitude, V/mm; its imaginary part is the loss in a cycle (the branches are the
    /// virgin curve, twice as large).
    fn held(&self, amplitude_mm: f64) -> Complex64 {
        let force = |x| self.friction.virgin_curve_v(x, self.breakaway_v);
        let mut area = 0.0;
        for place in 0..INTEGRATION_POINTS {
            area += force((f64::from(place) + 0.5) / f64::from(INTEGRATION_POINTS) * amplitude_mm);
        }
        let area = area * amplitude_mm / f64::from(INTEGRATION_POINTS);
        let level = force(amplitude_mm);
        let lost = 8.0 * area - 4.0 * level * amplitude_mm;
        Complex64::new(
            level / amplitude_mm,
            lost / (PI * amplitude_mm * amplitude_mm),
        )
    }

    /// Position over a voltage at the plant's input, mm/V, of a plant, with so many times the law's gain.
    fn response(&self, plant: &PlantModel, gain: f64, omega: f64, period_s: f64) -> Complex64 {
        self.response_of(plant, Complex64::default(), gain, omega, period_s)
    }

    /// The same with a spring, 1/s^2.
    fn response_of(
        &self,
        plant: &PlantModel,
        spring: Complex64,
        gain: f64,
        omega: f64,
        period_s: f64,
    ) -> Complex64 {
        let half = 0.5 * omega * period_s;
        let driven = plant.delayed_gain(omega) * cis(-half) * sinc(half);
        let mut law = self.pid.response(omega) * gain;
        for filter in self.filters {
            law *= filter.response(omega);
        }
        driven / (plant.denominator(omega) + spring + driven * law)
    }

    /// A right angle less the largest error of the response's phase on plants with other masses and dead times, and with the law's
    /// largest gain, degrees. Negative: the harmonic would grow on one of them.
    pub fn margin_deg(&self, frequency_hz: f64, period_s: f64) -> f64 {
        let omega = TAU * frequency_hz;
        let nominal = self.response(self.plant, 1.0, omega, period_s);
        let mut worst = 0.0;
        for gain in [1.0, self.largest_gain] {
            for mass in MASSES {
                for dead_time in DEAD_TIMES {
                    let plant = PlantModel {
                        gain_mm_per_v_s2: self.plant.gain_mm_per_v_s2 / mass,
                        damping_per_s: self.plant.damping_per_s / mass,
                        stiffness_per_s2: self.plant.stiffness_per_s2 / mass,
                        delay_s: self.plant.delay_s * dead_time,
                    };
                    let ratio = self.response(&plant, gain, omega, period_s) * nominal.conj();
                    let error = libm::fabs(libm::atan2(ratio.im, ratio.re));
                    worst = f64::max(worst, error);
                }
            }
        }
        (FRAC_PI_2 - worst) * 180.0 / PI
    }
}
