//! `quadrant identify frf`.

use clap::Args;
use quadrant_sim::identify::excitation::{Excitation, Waveform};
use quadrant_sim::identify::frf::{FrfMeasurement, FrfSettings, measure};
use quadrant_sim::presentation::{provenance, response_section};

use super::rig::Axis;
use super::{page, simulated};
use crate::cli::output::{Output, share};

/// Options of `quadrant identify frf`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The axis of the simulated stage.
    #[arg(long, value_enum)]
    axis: Axis,
    #[command(flatten)]
    measurement: Measurement,
    #[command(flatten)]
    output: Output,
}

/// How a response is measured.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Measurement {
    /// What is injected.
    #[arg(long, value_enum, default_value_t = Waveform::Multisine)]
    waveform: Waveform,
    /// RMS of the excitation, V.
    #[arg(long, default_value_t = 0.1, value_name = "V")]
    amplitude_v: f64,
    /// Lowest frequency, Hz.
    #[arg(long, default_value_t = 4.0, value_name = "HZ")]
    from_hz: f64,
    /// Highest frequency, Hz.
    #[arg(long, default_value_t = 400.0, value_name = "HZ")]
    to_hz: f64,
    /// Frequency up to which a multisine's amplitudes rise, Hz.
    #[arg(long, default_value_t = 200.0, value_name = "HZ")]
    rise_hz: f64,
    /// Period of the excitation, s; its inverse is the resolution.
    #[arg(long, default_value_t = 0.5, value_name = "S")]
    period_s: f64,
    /// Blocks that are averaged.
    #[arg(long, default_value_t = 40)]
    averages: usize,
    /// Velocity at which the axis moves meanwhile, mm/s; 0 measures at standstill, where friction bends the response.
    #[arg(long, default_value_t = 37.0, value_name = "MM_S")]
    bias_velocity_mm_s: f64,
    /// The excitation alone drives the amplifier; at standstill.
    #[arg(long)]
    open_loop: bool,
}

impl Measurement {
    /// Runs it on an axis of the simulated stage, and saves recordings and response.
    pub(in crate::cli) fn run(
        &self,
        axis: Axis,
        output: &Output,
    ) -> anyhow::Result<FrfMeasurement> {
        let bar = share("exciting the axis");
        let found = measure(
            &mut axis.rig(output.seed),
            &self.settings(output.seed),
            &mut |done| bar.set_position((1000.0 * done) as u64),
        )?;
        bar.finish_and_clear();
        for (index, recording) in found.recordings.iter().enumerate() {
            recording.write_csv(output.file(&format!("frf-recording-{}.csv", index + 1))?)?;
        }
        found.estimate.response.write_csv(output.file("frf.csv")?)?;
        Ok(found)
    }

    fn settings(&self, seed: u64) -> FrfSettings {
        FrfSettings {
            excitation: Excitation {
                waveform: self.waveform,
                rms_v: self.amplitude_v,
                band_hz: (self.from_hz, self.to_hz),
                rise_hz: self.rise_hz,
                period_s: self.period_s,
                seed,
            },
            periods: self.averages,
            bias_velocity_mm_s: if self.open_loop {
                0.0
            } else {
                self.bias_velocity_mm_s
            },
            open_loop: self.open_loop,
        }
    }
}

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        axis,
        measurement,
        output,
    } = arguments;
    let found = measurement.run(*axis, output)?;
    let points = &found.estimate.response.points;
    let coherent = points.iter().filter(|point| point.coherence > 0.95).count();
    println!(
        "Simulated, not measured. {} lines from {:.1} to {:.1} Hz, {coherent} of them with a coherence above 0.95; resolution {} Hz, {} blocks",
        points.len(),
        points.first().map_or(f64::NAN, |point| point.frequency_hz),
        points.last().map_or(f64::NAN, |point| point.frequency_hz),
        found.estimate.resolution_hz,
        found.estimate.blocks
    );
    let command = format!(
        "quadrant identify frf --axis {} --seed {}",
        axis.name(),
        output.seed
    );
    let page = page(
        "Frequency response",
        &simulated(*axis),
        vec![response_section(&found, None)],
        provenance(&command, output.seed),
    );
    output.page(&page, "frf.html")
}
