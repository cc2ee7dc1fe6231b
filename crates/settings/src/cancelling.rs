//! The response of the nominal closed loop at the spindle's frequencies, and the margin that its phase has.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use num_complex::Complex64;

use crate::response::{LinearResponse, delayed_gain, denominator};
use quadrant_law::cancelling::{CancellingLoop, LEAST_MARGIN_DEG, Node, STEP_TICKS};
use quadrant_law::control::filter::FilterSettings;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::friction::gms::GmsParameters;

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

/// The loop that is cancelled in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NominalLoop<'a> {
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

/// `sin(x) / x` of a positive number.
fn sinc(x: f64) -> f64 {
    libm::sin(x) / x
}

fn cis(angle: f64) -> Complex64 {
    let (sine, cosine) = libm::sincos(angle);
    Complex64::new(cosine, sine)
}

impl CancellingLoop for NominalLoop<'_> {
    fn node(&self, frequency_hz: f64, rate_per_s: f64, period_s: f64) -> Option<Node> {
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
        let parts = |value: Complex64| [value.re, value.im];
        Some(Node {
            growth: parts(response.inv() * (2.0 * rate_per_s * step_s)),
            response: parts(response),
        })
    }
}

impl NominalLoop<'_> {
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
        let driven = delayed_gain(plant, omega) * cis(-half) * sinc(half);
        let mut law = self.pid.response(omega) * gain;
        for filter in self.filters {
            law *= filter.response(omega);
        }
        driven / (denominator(plant, omega) + spring + driven * law)
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
