//! The open loop of an axis over frequency: with the plant of the settings, and with the stage's own.

use std::f64::consts::TAU;

use num_complex::Complex64;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::StageSettings;
use quadrant_sim::loop_shape::{OpenLoop, SampledLoop};
use quadrant_sim::margins::margins;
use quadrant_sim::plant::StageParameters;
use serde::Serialize;

/// Band of the plot, Hz.
const BAND_HZ: [f64; 2] = [1.0, 1000.0];
/// Points of a curve, even on a log scale.
const POINTS: usize = 240;

/// A loop over frequency, with its margins.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Gain, dB.
    pub gain_db: Vec<f64>,
    /// Phase, deg, without jumps.
    pub phase_deg: Vec<f64>,
    /// The margins in words, or why there are none.
    pub margins: String,
    /// Gain crossover, Hz, if it is stable.
    pub crossover_hz: Option<f64>,
}

/// The loop of an axis at small errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoopResponse {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// With the plant of the settings; none if they have none.
    pub settings_plant: Option<Curve>,
    /// With the stage's own.
    pub true_stage: Option<Curve>,
}

impl LoopResponse {
    /// The loop of an axis, 0 to 2.
    pub fn of(settings: &StageSettings, truth: &StageParameters, axis: usize) -> Self {
        let own = &truth.axes[axis];
        let viscous = 0.5
            * (own.friction.positive.viscous_v_s_per_mm + own.friction.negative.viscous_v_s_per_mm);
        let own = PlantModel {
            gain_mm_per_v_s2: own.gain_mm_per_v_s2,
            damping_per_s: own.damping_per_s + own.gain_mm_per_v_s2 * viscous,
            stiffness_per_s2: own.stiffness_per_s2,
            delay_s: own.delay_s,
        };
        let ratio = BAND_HZ[1] / BAND_HZ[0];
        let share = |point: usize| point as f64 / (POINTS - 1) as f64;
        let frequency_hz: Vec<_> = (0..POINTS)
            .map(|point| BAND_HZ[0] * ratio.powf(share(point)))
            .collect();
        let curve = |plant: &PlantModel| {
            let gains = settings.axes[axis].feedback.linear_gains();
            let open_loop = SampledLoop::new(plant, gains.first()?, 1.0 / settings.rate_hz, 0.0);
            Some(Curve::of(&open_loop, &frequency_hz))
        };
        Self {
            settings_plant: settings.axes[axis].plant.as_ref().and_then(curve),
            true_stage: curve(&own),
            frequency_hz,
        }
    }
}

impl Curve {
    fn of(open_loop: &SampledLoop, frequency_hz: &[f64]) -> Self {
        let responses: Vec<Complex64> = frequency_hz
            .iter()
            .map(|hz| open_loop.response(TAU * hz))
            .collect();
        let mut phase = 0.0;
        let phase_deg = responses.iter().map(|response| {
            // The turn nearest to the last point's; the first, with its integrators, lies between -360 and 0.
            let angle = response.arg().to_degrees();
            let near = if phase == 0.0 { -180.0 } else { phase };
            phase = angle + 360.0 * ((near - angle) / 360.0).round();
            phase
        });
        let phase_deg = phase_deg.collect();
        let margins = margins(open_loop);
        Self {
            gain_db: responses
                .iter()
                .map(|of| 20.0 * of.norm().log10())
                .collect(),
            phase_deg,
            crossover_hz: margins.as_ref().ok().map(|of| of.gain_crossover_hz),
            margins: match margins {
                Ok(of) => format!(
                    "gain margin {:.1} dB, phase margin {:.0}°, crossover {:.0} Hz",
                    of.gain_margin_db, of.phase_margin_deg, of.gain_crossover_hz
                ),
                Err(error) => error.to_string(),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preset_s_loop_has_its_margins_and_no_jump_of_phase() {
        let settings = StageSettings::simulated();
        let found = LoopResponse::of(&settings, &StageParameters::real(), 0);
        let of_settings = found.settings_plant.unwrap();
        assert!(
            of_settings.margins.starts_with("gain margin 9."),
            "{}",
            of_settings.margins
        );
        assert!((of_settings.crossover_hz.unwrap() - 65.0).abs() < 1.0);
        for pair in of_settings.phase_deg.windows(2) {
            assert!((pair[1] - pair[0]).abs() < 60.0, "{pair:?}");
        }
        assert_eq!(found.frequency_hz.len(), of_settings.gain_db.len());
        assert!(found.true_stage.is_some());
    }
}
