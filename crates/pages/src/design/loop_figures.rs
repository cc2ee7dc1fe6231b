//! Figures of a loop: Bode, Nyquist, sensitivities, step.

use std::f64::consts::TAU;

use num_complex::Complex64;
use quadrant_report::{Block, Colour, Figure, Plot, Scale, Series, Style};
use quadrant_sim::loop_shape::OpenLoop;
use quadrant_sim::margins::{Margins, margins};
use quadrant_tune::design::step_response::StepResponse;

use crate::parts::{lines, series};

/// A loop to draw.
pub(super) struct DrawnLoop<'a, L: OpenLoop> {
    pub(super) name: &'a str,
    pub(super) open_loop: &'a L,
    pub(super) style: Style,
}

/// Points of each curve.
const POINTS: usize = 600;
/// The frequencies drawn, if the loop's band reaches so far, Hz.
const DRAWN_HZ: (f64, f64) = (1.0, 1000.0);
/// Length of a drawn step response, in multiples of the longest settling time.
const DRAWN_SETTLINGS: f64 = 3.0;
/// Half of the Nyquist plot's width: what lies beyond concerns nobody.
const NYQUIST_REACH: f64 = 2.5;

/// Frequencies, Hz, and the loop's response at them.
fn sampled(open_loop: &impl OpenLoop) -> (Vec<f64>, Vec<Complex64>) {
    let (first, last) = open_loop.band_rad_s();
    let low = (first / TAU).max(DRAWN_HZ.0);
    let high = (last / TAU).min(DRAWN_HZ.1);
    let frequencies: Vec<f64> = (0..POINTS)
        .map(|index| low * (high / low).powf(index as f64 / (POINTS - 1) as f64))
        .collect();
    let responses = frequencies
        .iter()
        .map(|hz| open_loop.response(TAU * hz))
        .collect();
    (frequencies, responses)
}

fn decibels(value: Complex64) -> f64 {
    20.0 * value.norm().log10()
}

/// The phase followed from one point to the next, starting within (-360, 0], deg.
fn unwrapped_deg(responses: &[Complex64]) -> Vec<f64> {
    let mut phase_deg = responses.first().map_or(0.0, |first| {
        let start = first.arg().to_degrees();
        if start > 0.0 { start - 360.0 } else { start }
    });
    let mut previous = responses.first().copied().unwrap_or_default();
    responses
        .iter()
        .map(|&response| {
            phase_deg += (response * previous.conj()).arg().to_degrees();
            previous = response;
            phase_deg
        })
        .collect()
}

/// A figure over frequency, on a logarithmic axis.
fn over_frequency(id: &str, caption: &str, y_label: &str, curves: Vec<Series>) -> Block {
    let mut figure = lines(id, caption, ("frequency (Hz)", y_label), curves);
    if let Plot::Lines(lines) = &mut figure.plot {
        lines.x_scale = Scale::Logarithmic;
    }
    Block::Figure(figure)
}

/// A point that marks a margin of a loop, with its figures in the legend.
fn mark<L: OpenLoop>(drawn: &DrawnLoop<'_, L>, figures: &str, (x, y): (f64, f64)) -> Series {
    series(
        &format!("{}: {figures}", drawn.name),
        vec![x],
        vec![y],
        Style::points(drawn.style.colour),
    )
}

fn gain_margin_text(margins: &Margins) -> String {
    format!(
        "gain margin {:.1} dB at {:.0} Hz",
        margins.gain_margin_db, margins.phase_crossover_hz
    )
}

fn phase_margin_text(margins: &Margins) -> String {
    format!(
        "phase margin {:.1} deg at {:.0} Hz",
        margins.phase_margin_deg, margins.gain_crossover_hz
    )
}

/// Bode plot of the open loops (thesis, Fig 4.2): gain and phase, with the margin that each shows.
pub(super) fn bode_blocks<L: OpenLoop>(loops: &[DrawnLoop<'_, L>]) -> [Block; 2] {
    let (mut gains, mut phases) = (Vec::new(), Vec::new());
    let (mut gain_marks, mut phase_marks) = (Vec::new(), Vec::new());
    for drawn in loops {
        let (frequencies, responses) = sampled(drawn.open_loop);
        let decibels = responses.iter().copied().map(decibels).collect();
        let degrees = unwrapped_deg(&responses);
        // A loop without margins is drawn without marks: the table says why.
        if let Ok(margins) = margins(drawn.open_loop) {
            gain_marks.push(mark(
                drawn,
                &gain_margin_text(&margins),
                (margins.phase_crossover_hz, -margins.gain_margin_db),
            ));
            let drawn_deg = frequencies
                .iter()
                .position(|&hz| hz >= margins.gain_crossover_hz)
                .map(|index| degrees[index]);
            if let Some(drawn_deg) = drawn_deg {
                phase_marks.push(mark(
                    drawn,
                    &phase_margin_text(&margins),
                    (margins.gain_crossover_hz, drawn_deg),
                ));
            }
        }
        gains.push(series(
            drawn.name,
            frequencies.clone(),
            decibels,
            drawn.style,
        ));
        phases.push(series(drawn.name, frequencies, degrees, drawn.style));
    }
    gains.extend(gain_marks);
    phases.extend(phase_marks);
    [
        over_frequency(
            "open-loop-gain",
            "Open loop, position over error: gain; a point marks how far below 0 dB it is where the phase is -180 deg",
            "gain (dB)",
            gains,
        ),
        over_frequency(
            "open-loop-phase",
            "Open loop: phase; a point marks how far above -180 deg it is where the gain is 0 dB",
            "phase (deg)",
            phases,
        ),
    ]
}

/// Nyquist plot (thesis, Fig 4.3) around the critical point.
pub(super) fn nyquist_block<L: OpenLoop>(loops: &[DrawnLoop<'_, L>]) -> Block {
    let circle: Vec<f64> = (0..=180)
        .map(|step| f64::from(step).to_radians() * 2.0)
        .collect();
    let mut curves = vec![
        series(
            "unit circle",
            circle.iter().map(|angle| angle.cos()).collect(),
            circle.iter().map(|angle| angle.sin()).collect(),
            Style::dashed(Colour::Grey),
        ),
        series("-1", vec![-1.0], vec![0.0], Style::points(Colour::Ink)),
    ];
    curves.extend(loops.iter().map(|drawn| {
        let (_, responses) = sampled(drawn.open_loop);
        let kept: Vec<Complex64> = responses
            .into_iter()
            .filter(|l| l.re.abs() < NYQUIST_REACH && l.im.abs() < NYQUIST_REACH)
            .collect();
        series(
            drawn.name,
            kept.iter().map(|l| l.re).collect(),
            kept.iter().map(|l| l.im).collect(),
            drawn.style,
        )
    }));
    for drawn in loops {
        let Ok(margins) = margins(drawn.open_loop) else {
            continue;
        };
        for (text, hz) in [
            (gain_margin_text(&margins), margins.phase_crossover_hz),
            (phase_margin_text(&margins), margins.gain_crossover_hz),
        ] {
            let response = drawn.open_loop.response(TAU * hz);
            curves.push(mark(drawn, &text, (response.re, response.im)));
        }
    }
    Block::Figure(plane(
        "nyquist",
        "Nyquist plot of the open loop",
        ("Re L", "Im L"),
        curves,
    ))
}

/// A figure in which both axes have the same unit.
pub(super) fn plane(id: &str, caption: &str, labels: (&str, &str), curves: Vec<Series>) -> Figure {
    let mut figure = lines(id, caption, labels, curves);
    if let Plot::Lines(lines) = &mut figure.plot {
        lines.equal_units = true;
    }
    figure
}

/// Closed loop T (thesis, Fig 4.6) and sensitivity S (Fig 4.7).
pub(super) fn sensitivity_blocks<L: OpenLoop>(loops: &[DrawnLoop<'_, L>]) -> [Block; 2] {
    let curves = |closed: fn(Complex64) -> Complex64| -> Vec<Series> {
        loops
            .iter()
            .map(|drawn| {
                let (frequencies, responses) = sampled(drawn.open_loop);
                let gains = responses.iter().map(|&l| decibels(closed(l))).collect();
                series(drawn.name, frequencies, gains, drawn.style)
            })
            .collect()
    };
    [
        over_frequency(
            "closed-loop",
            "Closed loop T = L / (1 + L)",
            "|T| (dB)",
            curves(|l| l / (l + 1.0)),
        ),
        over_frequency(
            "sensitivity",
            "Sensitivity S = 1 / (1 + L)",
            "|S| (dB)",
            curves(|l| (l + 1.0).inv()),
        ),
    ]
}

/// Step responses (thesis, Figs 4.8 and 4.11) over the height of the step, and their voltages.
pub(super) fn step_blocks(responses: &[(String, &StepResponse, Style)]) -> [Block; 2] {
    let settled_s = responses
        .iter()
        .map(|(_, response, _)| response.properties().settling_time_s)
        .fold(0.0, f64::max);
    let curves = |ordinate: &dyn Fn(&StepResponse) -> Vec<f64>| -> Vec<Series> {
        responses
            .iter()
            .map(|(name, response, style)| {
                let mut values = ordinate(response);
                // A loop that does not settle is drawn to the end.
                if settled_s > 0.0 {
                    let drawn_s = DRAWN_SETTLINGS * settled_s;
                    values.truncate((drawn_s / response.sample_time_s) as usize);
                }
                let times = (0..values.len())
                    .map(|sample| 1e3 * sample as f64 * response.sample_time_s)
                    .collect();
                series(name, times, values, *style)
            })
            .collect()
    };
    [
        Block::Figure(lines(
            "step",
            "Step response, over the height of the step; the axis without friction",
            ("time (ms)", "position over height"),
            curves(&|response| {
                let shares = response.position_mm.iter();
                shares
                    .map(|position| position / response.height_mm)
                    .collect()
            }),
        )),
        Block::Figure(lines(
            "step-voltage",
            "Voltage of the step response",
            ("time (ms)", "voltage (V)"),
            curves(&|response| response.voltage_v.clone()),
        )),
    ]
}
