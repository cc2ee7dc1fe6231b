//! `quadrant identify revise`.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};
use clap::Args;
use quadrant::settings::{AxisSettings, StageSettings};
use quadrant_sim::commission::{CommissionSettings, commission};
use quadrant_sim::identify::at_rest::AtRest;
use quadrant_sim::identify::excitation::{Excitation, Waveform};
use quadrant_sim::identify::revise::ExplicitFriction;
use quadrant_sim::presentation::{AmplitudeResponse, provenance, revise_page, revise_table};
use quadrant_sim::settings_file::SettingsFile;

use super::rig::Axis;
use super::simulated;
use crate::cli::output::{Output, command_line, share};

/// Options of `quadrant identify revise`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The axis of the simulated stage.
    #[arg(long, value_enum)]
    axis: Axis,
    /// Settings with the model, the friction and the PID of the axis, as `quadrant commission` writes them; without it the
    /// axis is commissioned first.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// RMS of the excitation that the model is revised at, V.
    #[arg(long, default_value_t = 0.4, value_name = "V")]
    amplitude_v: f64,
    /// Further amplitudes, V: how the response depends on them, measured and predicted.
    #[arg(long, value_delimiter = ',', default_values_t = [0.2, 0.6], value_name = "V,...")]
    further_v: Vec<f64>,
    /// Blocks that are averaged.
    #[arg(long, default_value_t = 12)]
    averages: usize,
    #[command(flatten)]
    output: Output,
}

/// Band of the excitation, Hz, and its period, s.
const BAND_HZ: (f64, f64) = (4.0, 400.0);
const PERIOD_S: f64 = 0.5;

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { axis, output, .. } = arguments;
    let mut amplitudes_v = vec![arguments.amplitude_v];
    amplitudes_v.extend(&arguments.further_v);
    for amplitude_v in &amplitudes_v {
        if !(*amplitude_v > 0.0 && *amplitude_v <= 5.0) {
            bail!("amplitude {amplitude_v} V: it must be above zero and at most 5 V RMS");
        }
    }
    if !(2..=1000).contains(&arguments.averages) {
        bail!("--averages {}: it must be 2 to 1000", arguments.averages);
    }
    let bar = share("commissioning");
    let mut rig = axis.rig(output.seed);
    let settings: AxisSettings = match &arguments.settings {
        Some(path) => SettingsFile::read(path)?.stage.axes[axis.index()].clone(),
        None => {
            let base = &StageSettings::default().axes[axis.index()];
            let request = CommissionSettings::default();
            commission(&mut rig, base, &request, &mut |_, done| {
                bar.set_position((1000.0 * done) as u64);
            })?
            .settings
        }
    };
    let original = settings.plant.with_context(|| {
        format!(
            "the settings hold no model of the {} axis: commission it",
            axis.name()
        )
    })?;

    bar.set_message("exciting the axis at rest");
    let mut measured = Vec::new();
    for (index, &rms_v) in amplitudes_v.iter().enumerate() {
        let excitation = Excitation {
            waveform: Waveform::Multisine,
            rms_v,
            band_hz: BAND_HZ,
            rise_hz: 0.0,
            period_s: PERIOD_S,
            seed: output.seed,
        };
        let done = index as f64;
        measured.push(AtRest::measure(
            &mut rig,
            &settings,
            excitation,
            arguments.averages,
            &mut |share| {
                let all = (done + share) / amplitudes_v.len() as f64;
                bar.set_position((1000.0 * all) as u64);
            },
        )?);
    }
    bar.set_message("revising the model, three times");
    bar.enable_steady_tick(Duration::from_millis(200));
    let [at_amplitude, ..] = &measured[..] else {
        return Ok(());
    };
    let response = at_amplitude.response()?;
    let revisions = at_amplitude.revise(&original)?;
    let both = revisions
        .iter()
        .find(|revision| revision.friction == ExplicitFriction::Both);
    let mut predicted = Vec::new();
    if let Some(both) = both {
        for at in &measured {
            predicted.push(AmplitudeResponse {
                amplitude_v: at.excitation.rms_v,
                measured: at.response()?,
                predicted: at.predict(&both.plant, ExplicitFriction::Both)?,
            });
        }
    }
    predicted.sort_by(|a, b| a.amplitude_v.total_cmp(&b.amplitude_v));
    bar.finish_and_clear();

    println!("Simulated, not measured.");
    for (at, name) in measured.iter().zip(1..) {
        let file = output.file(&format!("revise-recording-{name}.csv"))?;
        at.recording.write_csv(file)?;
    }
    response.write_csv(output.file("revise-frf.csv")?)?;
    output.table(&revise_table(&original, &revisions))?;
    let page = revise_page(
        &simulated(*axis),
        &response,
        &original,
        &revisions,
        &predicted,
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "revise.html")
}
