//! The command `quadrant identify frf`.

use std::path::PathBuf;

use clap::Args;
use quadrant_cli::output::{Output, with_bar};
use quadrant_cli::{say, warn};
use quadrant_pages::identify::linear::response_section;
use quadrant_settings::AxisSettings;
use quadrant_tune::commission::bootstrap::measuring_settings;
use quadrant_tune::identify::excitation::{Excitation, Waveform};
use quadrant_tune::identify::frf::{
    FrfMeasurement, FrfSettings, SavedSettings, measure, response_of,
};
use quadrant_tune::test_axis::TestAxis;
use quadrant_written::Brief;

use super::recorded;
use crate::subject::{Measured, Subject};

/// The settling time of a fresh measurement, s.
const SETTLING_S: f64 = 0.7;

/// Options of `quadrant identify frf`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: Subject,
    /// Saved recordings instead, made alike: CSV files with t_s, position_mm (or position_m), voltage_v, injection_v and,
    /// if the axis moved, reference_mm. Of the excitation's options only the band and the period count then.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    record: Vec<PathBuf>,
    /// Time after a recorded axis has become steady before the first block, s.
    #[arg(long, default_value_t = SETTLING_S, value_name = "S")]
    settling_s: f64,
    #[command(flatten)]
    measurement: Measurement,
    #[command(flatten)]
    output: Output,
}

/// Options of a measured response.
#[derive(Clone, Debug, Args)]
pub(crate) struct Measurement {
    /// Waveform of the injected voltage.
    #[arg(long, value_enum, default_value_t = Waveform::Multisine)]
    waveform: Waveform,
    /// RMS of the excitation, V. Without it 0.08 for a multisine and 0.035 for the others while the axis moves, 0.3 at
    /// standstill.
    #[arg(long, value_name = "V")]
    amplitude_v: Option<f64>,
    /// Lowest frequency of the excitation, Hz.
    #[arg(long, default_value_t = 4.0, value_name = "HZ")]
    from_hz: f64,
    /// Highest frequency of the excitation, Hz.
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
    /// Runs it on the axis of a machine, under the settings' PID alone, and saves recordings and response.
    pub(super) fn run(
        &self,
        subject: &Subject,
        start: Option<&AxisSettings>,
        output: &Output,
    ) -> anyhow::Result<Measured<FrfMeasurement>> {
        let settings = self.settings(output.seed);
        subject.measure(output.seed, start, None, |test_axis, base| {
            let found = excite(test_axis, base, &settings)?;
            for (recording, number) in found.recordings.iter().zip(1..) {
                recording.write_csv(&output.file(&format!("frf-recording-{number}.csv"))?)?;
            }
            let response = &found.estimate.response;
            response.write_csv(&output.file("frf.csv")?)?;
            Ok(found)
        })
    }

    /// The velocity of the axis, mm/s: it slides under feedback only.
    fn velocity_mm_s(&self) -> f64 {
        if self.open_loop {
            0.0
        } else {
            self.bias_velocity_mm_s
        }
    }

    fn rms_v(&self) -> f64 {
        let usual = match self.waveform {
            _ if self.velocity_mm_s() == 0.0 => 0.3,
            Waveform::Multisine => FrfSettings::default().excitation.rms_v,
            // Their power is not shaped: what is low in frequency slows the axis.
            Waveform::Random | Waveform::Sweep => 0.035,
        };
        self.amplitude_v.unwrap_or(usual)
    }

    fn settings(&self, seed: u64) -> FrfSettings {
        FrfSettings {
            excitation: Excitation {
                waveform: self.waveform,
                rms_v: self.rms_v(),
                band_hz: (self.from_hz, self.to_hz),
                rise_hz: self.rise_hz,
                period_s: self.period_s,
                seed,
            },
            periods: self.averages,
            bias_velocity_mm_s: self.velocity_mm_s(),
            open_loop: self.open_loop,
            two_sided: false,
            ..FrfSettings::default()
        }
    }
}

/// Measures the response of an axis under the PID of `base` alone.
pub(crate) fn excite(
    test_axis: &mut dyn TestAxis,
    base: &AxisSettings,
    settings: &FrfSettings,
) -> anyhow::Result<FrfMeasurement> {
    test_axis.apply(&measuring_settings(base))?;
    let found = with_bar("exciting the axis", |progress| {
        measure(test_axis, settings, progress)
    })?;
    Ok(found)
}

/// The response of saved recordings, which is saved too.
fn response_of_saved(arguments: &Arguments) -> anyhow::Result<FrfMeasurement> {
    let Arguments {
        record,
        settling_s,
        measurement,
        output,
        ..
    } = arguments;
    let recordings = record
        .iter()
        .map(|path| recorded::read(path))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let settings = SavedSettings {
        period_s: measurement.period_s,
        band_hz: (measurement.from_hz, measurement.to_hz),
        settling_s: *settling_s,
    };
    let found = response_of(recordings, &settings)?;
    found
        .estimate
        .response
        .write_csv(&output.file("frf.csv")?)?;
    Ok(found)
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        subject,
        record,
        output,
        ..
    } = arguments;
    output.ready()?;
    let (found, title) = if record.is_empty() {
        let start = subject.start_axis(None)?;
        let measured = arguments.measurement.run(subject, start.as_ref(), output)?;
        (measured.found, measured.title)
    } else {
        (response_of_saved(arguments)?, recorded::title(record))
    };
    let points = &found.estimate.response.points;
    let coherent = points.iter().filter(|point| point.coherence > 0.95).count();
    say!(
        "{} lines from {:.1} to {:.1} Hz, {coherent} of them with a coherence above 0.95; resolution {} Hz, {} blocks, {} loop",
        points.len(),
        points.first().map_or(f64::NAN, |point| point.frequency_hz),
        points.last().map_or(f64::NAN, |point| point.frequency_hz),
        Brief(found.estimate.resolution_hz),
        found.estimate.blocks,
        if found.closed_loop { "closed" } else { "open" }
    );
    if 10 * coherent < points.len() {
        warn!(
            "note: hardly a line is coherent: the position does not follow the voltage. Are columns swapped, is the period right, is the \
             excitation lost in noise or friction?"
        );
    }
    output.section(
        "Frequency response",
        &title,
        response_section(&found, None),
        "frf.html",
    )
}
