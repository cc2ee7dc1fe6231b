//! Process that a controller is designed on: a model of the axis or its measured response, closed in continuous time or
//! as it runs.

use num_complex::Complex64;
use quadrant_law::control::{filter::FilterSettings, pid::PidGains, plant_model::PlantModel};
use quadrant_settings::response::{LinearResponse, denominator, sampled_filter_response};
use quadrant_sim::loop_shape::{ContinuousLoop, OpenLoop, SampledLoop};
use quadrant_sim::margins::{LoopGains, MarginError, Margins, bisect, margins};

use super::form::Form;
use super::measured::{MeasuredLoop, MeasuredResponse};
use crate::identify::mode::{self, Mode};

/// The axis, as far as a design knows it.
#[derive(Clone, Debug, PartialEq)]
pub enum Process {
    Model(PlantModel),
    /// The model with its structural modes, and the filters behind the law.
    Modelled {
        plant: PlantModel,
        modes: Vec<Mode>,
        filters: Vec<FilterSettings>,
    },
    /// Its measured frequency response, and the filters behind the law.
    Measured {
        response: MeasuredResponse,
        filters: Vec<FilterSettings>,
    },
}

/// A loop of either kind.
#[derive(Clone, Debug)]
pub enum AnyLoop<'a> {
    /// Model and PID in continuous time.
    Continuous(ContinuousLoop),
    /// Model and PID as they run.
    Sampled(SampledLoop),
    /// Measured response and PID, in either form.
    Measured(MeasuredLoop<'a>),
    /// Either with PID, modes and filters, in either form.
    Modal(ModalLoop<'a>),
}

/// A loop of the rigid model or of a measured response, times modes and filters. Through the converter's hold the product is that of the responses:
/// modes lie far below the control rate.
#[derive(Clone, Debug)]
pub struct ModalLoop<'a> {
    rigid: Box<AnyLoop<'a>>,
    modes: &'a [Mode],
    filters: &'a [FilterSettings],
    form: Form,
}

/// The response of all filters at a frequency in rad/s.
fn filters_at(filters: &[FilterSettings], form: Form, omega_rad_s: f64) -> Complex64 {
    let each = filters.iter().map(|filter| match form {
        Form::Continuous => filter.response(omega_rad_s),
        Form::Sampled { sample_time_s, .. } => {
            sampled_filter_response(filter, omega_rad_s, sample_time_s)
        }
    });
    each.product()
}

impl OpenLoop for ModalLoop<'_> {
    fn response(&self, omega_rad_s: f64) -> Complex64 {
        let filters = filters_at(self.filters, self.form, omega_rad_s);
        self.rigid.response(omega_rad_s) * mode::response_of(self.modes, omega_rad_s) * filters
    }

    fn band_rad_s(&self) -> (f64, f64) {
        self.rigid.band_rad_s()
    }
}

impl OpenLoop for AnyLoop<'_> {
    fn response(&self, omega_rad_s: f64) -> Complex64 {
        match self {
            Self::Continuous(open_loop) => open_loop.response(omega_rad_s),
            Self::Sampled(open_loop) => open_loop.response(omega_rad_s),
            Self::Measured(open_loop) => open_loop.response(omega_rad_s),
            Self::Modal(open_loop) => open_loop.response(omega_rad_s),
        }
    }

    fn band_rad_s(&self) -> (f64, f64) {
        match self {
            Self::Continuous(open_loop) => open_loop.band_rad_s(),
            Self::Sampled(open_loop) => open_loop.band_rad_s(),
            Self::Measured(open_loop) => open_loop.band_rad_s(),
            Self::Modal(open_loop) => open_loop.band_rad_s(),
        }
    }
}

impl AnyLoop<'_> {
    /// Checks that a measured response goes on to where the loop's gain, times a factor, has fallen.
    fn check_band(&self, factor: f64) -> Result<(), MarginError> {
        match self {
            Self::Measured(measured) if !measured.has_fallen(factor) => {
                Err(MarginError::BandTooNarrow)
            }
            // Filters amplify nothing.
            Self::Modal(modal) => modal.rigid.check_band(factor),
            _ => Ok(()),
        }
    }

    /// Margins with a factor on the gain of this loop; `loops` are those that it makes.
    ///
    /// # Errors
    /// As [`Process::margins`].
    pub(super) fn margins_of(
        &self,
        loops: &LoopGains<'_, Self>,
        factor: f64,
    ) -> Result<Margins, MarginError> {
        self.check_band(factor)?;
        loops.margins(factor)
    }
}

/// The loop that a PID closes around the rigid model.
fn rigid_loop(plant: &PlantModel, gains: &PidGains, form: Form) -> AnyLoop<'static> {
    match form {
        Form::Continuous => AnyLoop::Continuous(ContinuousLoop {
            plant: *plant,
            gains: *gains,
        }),
        Form::Sampled {
            sample_time_s,
            computation_delay_s,
        } => AnyLoop::Sampled(SampledLoop::new(
            plant,
            gains,
            sample_time_s,
            computation_delay_s,
        )),
    }
}

impl Process {
    /// The axis of a model without modes, and the filters behind the law.
    pub fn filtered(plant: PlantModel, filters: &[FilterSettings]) -> Self {
        if filters.is_empty() {
            return Self::Model(plant);
        }
        Self::Modelled {
            plant,
            modes: Vec::new(),
            filters: filters.to_vec(),
        }
    }

    /// The loop that a PID closes around the process.
    pub fn open_loop(&self, gains: &PidGains, form: Form) -> AnyLoop<'_> {
        match (self, form) {
            (
                Self::Modelled {
                    plant,
                    modes,
                    filters,
                },
                form,
            ) => AnyLoop::Modal(ModalLoop {
                rigid: Box::new(rigid_loop(plant, gains, form)),
                modes,
                filters,
                form,
            }),
            (Self::Model(plant), form) => rigid_loop(plant, gains, form),
            (Self::Measured { response, filters }, form) => {
                let measured = AnyLoop::Measured(MeasuredLoop::new(response, gains, form));
                if filters.is_empty() {
                    return measured;
                }
                AnyLoop::Modal(ModalLoop {
                    rigid: Box::new(measured),
                    modes: &[],
                    filters,
                    form,
                })
            }
        }
    }

    /// The response of a PID and of the filters behind it, V/mm, at a frequency in rad/s.
    pub(super) fn controller(&self, gains: &PidGains, form: Form, omega_rad_s: f64) -> Complex64 {
        let pid = form.controller(gains, omega_rad_s);
        match self {
            Self::Modelled { filters, .. } | Self::Measured { filters, .. } => {
                pid * filters_at(filters, form, omega_rad_s)
            }
            Self::Model(_) => pid,
        }
    }

    /// Margins and peaks of the closed loop.
    ///
    /// # Errors
    /// A loop without margins; [`MarginError::BandTooNarrow`] when a measured response ends before the loop's gain has fallen.
    pub fn margins(&self, gains: &PidGains, form: Form) -> Result<Margins, MarginError> {
        let open_loop = self.open_loop(gains, form);
        open_loop.check_band(1.0)?;
        margins(&open_loop)
    }

    /// The frequency at which the phase of the process alone reaches -180 degrees, Hz: without derivative action no
    /// crossover lies above it; of the rigid axis where there are modes, and with some damping: without, the phase
    /// begins there. Nothing when the band does not hold it.
    pub fn half_turn_hz(&self) -> Option<f64> {
        match self {
            Self::Model(plant) | Self::Modelled { plant, .. } => {
                let damped = PlantModel {
                    damping_per_s: plant.damping_per_s.max(LEAST_DAMPING / plant.delay_s),
                    ..*plant
                };
                // Above the resonance, where delay and inertia turn on: from there the phase only falls.
                let lag = |omega: f64| {
                    (-denominator(&damped, omega).arg()) - omega * plant.delay_s
                        > -std::f64::consts::PI
                };
                let lowest = plant.stiffness_per_s2.sqrt().max(1e-3);
                let highest = 1e6;
                (plant.delay_s > 0.0 && lag(lowest) && !lag(highest))
                    .then(|| bisect(lowest, highest, lag) / std::f64::consts::TAU)
            }
            Self::Measured { response, .. } => response.half_turn_hz(),
        }
    }
}

/// Least damping over mass, times the dead time, of an axis whose half turn is asked for.
const LEAST_DAMPING: f64 = 0.01;
