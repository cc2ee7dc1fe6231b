//! The command `quadrant identify revise`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};
use clap::Args;
use indicatif::ProgressBar;
use quadrant_cli::axis::Axis;
use quadrant_cli::output::{Output, command_line, share};
use quadrant_pages::identify::revise::{AmplitudeResponse, revise_page, revise_table};
use quadrant_pages::parts::provenance;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_tune::commission::{CommissionSettings, commission};
use quadrant_tune::identify::at_rest::AtRest;
use quadrant_tune::identify::excitation::{Excitation, Waveform};
use quadrant_tune::identify::revise::ExplicitFriction;

use super::recorded;
use crate::endpoint::Endpoint;
use crate::numbers::Numbers;
use crate::subject::Subject;

/// Options of `quadrant identify revise`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: Subject,
    /// A recording of the axis at rest under its own PID instead, excited by an injected voltage: a CSV file with t_s,
    /// position_mm (or position_m), reference_mm, voltage_v and injection_v, a row each control period.
    #[arg(long, value_name = "FILE", requires = "settings", conflicts_with_all = ["amplitude_v", "further_v", "averages"])]
    record: Option<PathBuf>,
    /// RMS of the excitation that the model is revised at, V.
    #[arg(long, default_value_t = 0.4, value_name = "V")]
    amplitude_v: f64,
    /// Further amplitudes, V: how the response depends on them, measured and predicted.
    #[arg(long, default_value_t = Numbers(vec![0.2, 0.6]), value_name = "V,...")]
    further_v: Numbers,
    /// Blocks that are averaged.
    #[arg(long, default_value_t = 12)]
    averages: usize,
    /// Lowest frequency of the excitation, Hz.
    #[arg(long, default_value_t = 4.0, value_name = "HZ")]
    from_hz: f64,
    /// Highest frequency of the excitation, Hz.
    #[arg(long, default_value_t = 400.0, value_name = "HZ")]
    to_hz: f64,
    /// Period of the excitation, s.
    #[arg(long, default_value_t = 0.5, value_name = "S")]
    period_s: f64,
    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        subject, output, ..
    } = arguments;
    output.ready()?;
    arguments.check()?;
    let bar = share("commissioning");
    let (measured, settings, title) = match &arguments.record {
        Some(path) => arguments.recorded(path)?,
        None => arguments.measured(&bar)?,
    };
    let original = settings.plant.with_context(|| {
        format!(
            "the settings hold no model of the {} axis: commission it",
            subject.axis.map_or("", Axis::name)
        )
    })?;
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
    if let Some(both) = both
        && measured.len() > 1
    {
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

    response.write_csv(&output.file("revise-frf.csv")?)?;
    output.table(&revise_table(&original, &revisions))?;
    let page = revise_page(
        &title,
        &response,
        &original,
        &revisions,
        &predicted,
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "revise.html")
}

/// Responses at rest, the settings they were measured under, and what a page calls the axis.
type Measured = (Vec<AtRest>, AxisSettings, String);

impl Arguments {
    fn amplitudes_v(&self) -> Vec<f64> {
        let mut amplitudes_v = vec![self.amplitude_v];
        amplitudes_v.extend(&self.further_v.0);
        amplitudes_v
    }

    fn check(&self) -> anyhow::Result<()> {
        for amplitude_v in self.amplitudes_v() {
            if !(amplitude_v > 0.0 && amplitude_v <= 5.0) {
                bail!("amplitude {amplitude_v} V: it must be above zero and at most 5 V RMS");
            }
        }
        if !(2..=1000).contains(&self.averages) {
            bail!("--averages {}: it must be 2 to 1000", self.averages);
        }
        if !(0.01..=100.0).contains(&self.period_s) {
            bail!("--period-s {}: it must be 0.01 to 100 s", self.period_s);
        }
        if !(self.from_hz * self.period_s >= 1.0 && self.to_hz > self.from_hz) {
            bail!(
                "--from-hz {} --to-hz {}: the lowest must be a cycle in a period at least, the highest above it",
                self.from_hz,
                self.to_hz
            );
        }
        Ok(self.excitation(self.amplitude_v).check_lines()?)
    }

    fn excitation(&self, rms_v: f64) -> Excitation {
        Excitation {
            waveform: Waveform::Multisine,
            rms_v,
            band_hz: (self.from_hz, self.to_hz),
            rise_hz: 0.0,
            period_s: self.period_s,
            seed: self.output.seed,
        }
    }

    /// Reads a saved recording of the axis at rest.
    fn recorded(&self, path: &Path) -> anyhow::Result<Measured> {
        let axis = self.subject.axis()?;
        let stage = match self.subject.start(None)? {
            Some(file) => file.stage,
            None => bail!("--record needs --settings"),
        };
        let settings = stage.axes[axis.index()].clone();
        let recording = recorded::read(path)?;
        let square: f64 = recording.injection_v.iter().map(|v| v * v).sum();
        let rms_v = (square / recording.len() as f64).sqrt();
        let saved = AtRest::saved(recording, &settings, stage.rate_hz, self.excitation(rms_v))?;
        let subject = recorded::title(&[path.to_owned()]);
        Ok((vec![saved], settings, subject))
    }

    /// The axis, excited at every amplitude. One of the law alone is commissioned first, unless settings are given.
    fn measured(&self, bar: &ProgressBar) -> anyhow::Result<Measured> {
        let start = self.subject.start_axis(None)?;
        let unknown = start.is_none() && self.subject.machine == Endpoint::Law;
        let amplitudes_v = self.amplitudes_v();
        let measured =
            self.subject
                .measure(self.output.seed, start.as_ref(), None, |test_axis, base| {
                    let settings = if unknown {
                        let base = &StageSettings::simulated().axes[self.subject.axis()?.index()];
                        let request = CommissionSettings::thesis();
                        commission(test_axis, base, &request, &mut |_, done| {
                            bar.set_position((1000.0 * done) as u64);
                        })?
                        .settings
                    } else {
                        base.clone()
                    };
                    bar.set_message("exciting the axis at rest");
                    let mut measured = Vec::new();
                    for (rms_v, index) in amplitudes_v.iter().zip(0..) {
                        let excitation = self.excitation(*rms_v);
                        let report = &mut |share: f64| {
                            let done = (f64::from(index) + share) / amplitudes_v.len() as f64;
                            bar.set_position((1000.0 * done) as u64);
                        };
                        let averages = self.averages;
                        let at =
                            AtRest::measure(test_axis, &settings, excitation, averages, report)?;
                        let name = format!("revise-recording-{}.csv", index + 1);
                        at.recording.write_csv(&self.output.file(&name)?)?;
                        measured.push(at);
                    }
                    Ok((measured, settings))
                })?;
        let (at_rest, settings) = measured.found;
        Ok((at_rest, settings, measured.title))
    }
}
