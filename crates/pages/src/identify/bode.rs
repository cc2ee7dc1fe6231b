//! Frequency responses as figures: gain and phase.

use quadrant_report::{Block, Figure, Lines, Plot, Scale, Series, Style};
use quadrant_tune::identify::response::FrequencyResponse;

/// A response to draw.
pub(super) struct Curve<'a> {
    pub(super) name: String,
    pub(super) response: &'a FrequencyResponse,
    pub(super) style: Style,
}

/// Gain over phase of several responses; `id` and `caption` are completed for each of the two.
pub(super) fn bode_figures(id: &str, caption: &str, curves: &[Curve<'_>]) -> [Block; 2] {
    let figure = |what: &str, y_label: &str, ordinate: &dyn Fn(&FrequencyResponse) -> Vec<f64>| {
        let series = curves
            .iter()
            .map(|curve| Series {
                name: curve.name.clone(),
                x: curve
                    .response
                    .points
                    .iter()
                    .map(|point| point.frequency_hz)
                    .collect(),
                y: ordinate(curve.response),
                style: curve.style,
            })
            .collect();
        Block::Figure(Figure {
            id: format!("{id}-{what}"),
            caption: format!("{caption}: {what}"),
            plot: Plot::Lines(Lines {
                x_label: "frequency (Hz)".to_owned(),
                y_label: y_label.to_owned(),
                series,
                x_scale: Scale::Logarithmic,
                ..Lines::default()
            }),
        })
    };
    [
        figure("gain", "gain (dB re 1 mm/V)", &|response| {
            let points = response.points.iter();
            points
                .map(|point| 20.0 * point.response.norm().log10())
                .collect()
        }),
        figure("phase", "phase (deg)", &FrequencyResponse::phase_deg),
    ]
}
