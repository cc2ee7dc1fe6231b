//! `quadrant new`: a settings file for a machine that nobody has commissioned.

mod ask;
mod from_linuxcnc;
mod hal_files;
mod presets;

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::output::{command_line, quoted};
use quadrant_cli::{say, warn};
use quadrant_law::axes::AxisName;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::settings_file::{SettingsFile, defaults_at, without_law};
use quadrant_sim::stage_file::DataSheet;
use quadrant_sim::stage_setup::enter_limits;
use quadrant_tune::test_axis::Travel;
use quadrant_written::whole;

use self::ask::Questions;
use self::presets::{Amplifier, Encoder};
use super::kept;
use super::subject::travel_both_ways;

/// Options of `quadrant new`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// The settings file to write.
    #[arg(value_name = "FILE", default_value = "stage.toml")]
    file: PathBuf,
    /// The axes that are described; several with a comma between have the same encoder, amplifier and limits. The others keep the
    /// defaults, without a law.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "x")]
    axis: Vec<Axis>,
    /// Take the axes, their scales, limits and gains, and the control rate from a configuration of LinuxCNC.
    #[arg(long, value_name = "INI", conflicts_with_all = ["axis", "scale", "lead_mm", "amplifier", "full_scale_v", "output_limit_v",
        "max_velocity", "max_acceleration", "travel", "rate"])]
    from_linuxcnc: Option<PathBuf>,
    /// A usual encoder, by name: rotary-2500 has 2500 lines in a turn of the screw, linear-1um is a scale of 1 um a count.
    #[arg(long, value_name = "NAME", group = "scale")]
    encoder: Option<Encoder>,
    /// Lines in a turn of an encoder on the screw: four counts each.
    #[arg(long, value_name = "LINES", group = "scale", value_parser = turn)]
    lines_per_turn: Option<u32>,
    /// Counts in a turn of an encoder on the screw.
    #[arg(long, value_name = "COUNTS", group = "scale", value_parser = turn)]
    counts_per_turn: Option<u32>,
    /// Length of a count of an encoder on the table, um.
    #[arg(long, value_name = "UM", group = "scale", value_parser = positive)]
    count_um: Option<f64>,
    /// Lead of the screw, mm: the way of a turn. An encoder on the table needs none.
    #[arg(long, value_name = "MM", value_parser = positive)]
    lead_mm: Option<f64>,
    /// A usual amplifier, by name: analog-10v has an input of +-10 V.
    #[arg(long, value_name = "NAME", conflicts_with = "full_scale_v")]
    amplifier: Option<Amplifier>,
    /// Voltage of the converter's largest code, V.
    #[arg(long, value_name = "V", value_parser = positive)]
    full_scale_v: Option<f64>,
    /// Largest voltage that is put out, V; without it that of the amplifier.
    #[arg(long, value_name = "V", value_parser = positive)]
    output_limit_v: Option<f64>,
    /// Largest velocity of the axis, mm/s.
    #[arg(long, value_name = "MM_S", value_parser = positive)]
    max_velocity: Option<f64>,
    /// Largest acceleration of the axis, mm/s².
    #[arg(long, value_name = "MM_S2", value_parser = positive)]
    max_acceleration: Option<f64>,
    /// Travel, mm, in force once the axis is homed, in positions that count from the origin that homing sets (homing.mark_mm): 200 for as
    /// much either way, or -5..180.
    #[arg(long, value_name = "MM", value_parser = travel_both_ways, allow_hyphen_values = true)]
    travel: Option<Travel>,
    /// Control rate, Hz.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    rate: Option<f64>,
    /// Write over a file that is there.
    #[arg(long)]
    overwrite: bool,
    /// List the usual encoders and amplifiers, and write nothing.
    #[arg(long)]
    list_presets: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "no number".to_owned())?;
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err("it must be above 0".to_owned())
    }
}

/// Fewest and most counts in a turn: what an index pulse may be apart.
const TURN_COUNTS: (u32, u32) = (16, 1_000_000_000);

/// Lines or counts in a turn.
fn turn(text: &str) -> Result<u32, String> {
    let value: u32 = text.parse().map_err(|_| "no whole number".to_owned())?;
    let (least, most) = TURN_COUNTS;
    if (least..=most / 4).contains(&value) {
        Ok(value)
    } else {
        Err(format!("it must be {least} to {}", most / 4))
    }
}

/// A preset by name, or a number and what is made of it.
fn preset_or<T: std::str::FromStr<Err = String>>(
    text: &str,
    number: impl Fn(f64) -> T,
) -> Result<T, String> {
    if text.parse::<f64>().is_ok() {
        positive(text).map(number)
    } else {
        text.parse()
    }
}

/// A machine as a person describes it.
struct Machine {
    encoder: Encoder,
    lead_mm: Option<f64>,
    amplifier: Amplifier,
    max_velocity_mm_s: f64,
    max_acceleration_mm_s2: f64,
    travel: Travel,
    rate_hz: f64,
}

impl Arguments {
    /// The machine by the options, and by the answers to what they leave out.
    fn machine(&self, questions: &mut Questions) -> anyhow::Result<Machine> {
        let defaults = StageSettings::default();
        let [limits, ..] = defaults.axes.each_ref().map(|axis| &axis.limits);
        let text = |value: f64| value.to_string();
        let counts = self.counts_per_turn;
        let counts = counts.or(self.lines_per_turn.map(|lines| 4 * lines));
        let encoder = self
            .encoder
            .or(counts.map(|counts| Encoder::Rotary { counts }))
            .or(self.count_um.map(|um| Encoder::Linear {
                count_mm: 1e-3 * um,
            }));
        let encoder = questions.value(
            encoder,
            "--encoder",
            "encoder: a name of --list-presets, or the length of a count in um",
            None,
            |answer| {
                preset_or(answer, |um| Encoder::Linear {
                    count_mm: 1e-3 * um,
                })
            },
        )?;
        let lead_mm = match encoder {
            Encoder::Linear { .. } => self.lead_mm,
            Encoder::Rotary { .. } => Some(questions.value(
                self.lead_mm,
                "--lead-mm",
                "lead of the screw, mm a turn",
                None,
                positive,
            )?),
        };
        let given = self
            .amplifier
            .or(self.full_scale_v.map(|full_scale_v| Amplifier {
                full_scale_v,
                output_limit_v: full_scale_v,
            }));
        let mut amplifier = questions.value(
            given,
            "--amplifier",
            "amplifier: a name of --list-presets, or its full scale in V",
            Some("analog-10v"),
            |answer| {
                preset_or(answer, |full_scale_v| Amplifier {
                    full_scale_v,
                    output_limit_v: full_scale_v,
                })
            },
        )?;
        if let Some(limit_v) = self.output_limit_v {
            amplifier.output_limit_v = limit_v;
        }
        Ok(Machine {
            encoder,
            lead_mm,
            amplifier,
            max_velocity_mm_s: questions.value(
                self.max_velocity,
                "--max-velocity",
                "largest velocity, mm/s",
                Some(&text(limits.max_velocity_mm_s)),
                positive,
            )?,
            max_acceleration_mm_s2: questions.value(
                self.max_acceleration,
                "--max-acceleration",
                "largest acceleration, mm/s²",
                Some(&text(limits.max_acceleration_mm_s2)),
                positive,
            )?,
            travel: questions.value(
                self.travel,
                "--travel",
                "travel, mm: 200 for as much either way, or -5..180",
                None,
                travel_both_ways,
            )?,
            rate_hz: questions.value(
                self.rate,
                "--rate",
                "control rate, Hz",
                Some(&text(defaults.rate_hz)),
                positive,
            )?,
        })
    }
}

impl Machine {
    /// An axis of it, which nobody has commissioned.
    fn axis(&self, default: &AxisSettings) -> AxisSettings {
        let mut axis = default.clone();
        // A lead is known where the encoder is rotary.
        axis.encoder.resolution_mm = self.encoder.count_mm(self.lead_mm.unwrap_or_default());
        if let Encoder::Rotary { counts } = self.encoder {
            axis.encoder.counts_per_index = Some(counts);
        }
        axis.amplifier.full_scale_v = self.amplifier.full_scale_v;
        axis.amplifier.output_limit_v = self.amplifier.output_limit_v;
        let known = DataSheet {
            travel_mm: [-self.travel.negative_mm, self.travel.positive_mm],
            max_velocity_mm_s: self.max_velocity_mm_s,
            max_acceleration_mm_s2: self.max_acceleration_mm_s2,
        };
        enter_limits(&mut axis.limits, &known, axis.encoder.resolution_mm);
        without_law(&mut axis, self.rate_hz);
        axis
    }

    /// A stage of which these axes are the machine's.
    fn stage(&self, axes: &[AxisName]) -> StageSettings {
        let mut stage = defaults_at(self.rate_hz);
        stage.rate_hz = self.rate_hz;
        for &axis in axes {
            let default = stage.axes[axis as usize].clone();
            stage.axes[axis as usize] = self.axis(&default);
        }
        stage
    }
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if arguments.list_presets {
        say!("{}", presets::list().trim_end());
        return Ok(());
    }
    let path = &arguments.file;
    let shown = path.display();
    if path.exists() && !arguments.overwrite {
        bail!("{shown} is there: give another file, or --overwrite");
    }
    if let Some(ini) = &arguments.from_linuxcnc {
        return convert(ini, path);
    }
    let axes: Vec<AxisName> = arguments.axis.iter().map(|&axis| axis.into()).collect();
    let mut questions = Questions::new();
    let machine = arguments.machine(&mut questions)?;
    write(machine.stage(&axes), &axes, path)?;
    if let Some(taken) = questions.taken() {
        warn!("not given, so the defaults: {taken}");
    }
    say!("{}", next(&machine, &axes, path));
    Ok(())
}

/// Writes the settings of these axes.
fn write(stage: StageSettings, axes: &[AxisName], path: &Path) -> anyhow::Result<()> {
    let mut file = SettingsFile::new(stage);
    for axis in axes {
        let sets = ["encoder", "amplifier", "limits"];
        file.add_provenance(&command_line(), axis.as_str(), Vec::new(), &sets);
    }
    let text = file
        .sparse_text(path)
        .context("the firmware would refuse these settings; nothing was written")?;
    kept::make_folder(path)?;
    whole::write(path, text).with_context(|| format!("{} cannot be written", path.display()))
}

/// Writes the settings of a configuration of LinuxCNC, and prints where each was found.
fn convert(ini: &Path, path: &Path) -> anyhow::Result<()> {
    let taken = from_linuxcnc::read(ini)?;
    say!("{}", taken.lines.join("\n"));
    write(taken.stage, &taken.axes, path)?;
    let shown = path.display();
    say!(
        "\n{shown}: not commissioned. Next: `loadrt quadrant defaults={shown}`, and `quadrant commission --machine tcp:127.0.0.1:7711 --axis {}`",
        taken.axes[0]
    );
    Ok(())
}

/// The next commands, with the file.
fn next(machine: &Machine, axes: &[AxisName], path: &Path) -> String {
    let shown = path.display();
    let file = quoted(&shown.to_string());
    let names: Vec<&str> = axes.iter().map(|axis| axis.as_str()).collect();
    let axis = names.first().copied().unwrap_or("x");
    let Travel {
        negative_mm,
        positive_mm,
    } = machine.travel;
    let travel = if negative_mm == positive_mm {
        format!("{positive_mm}")
    } else {
        format!("-{negative_mm}..{positive_mm}")
    };
    let count_um = 1e3
        * machine
            .encoder
            .count_mm(machine.lead_mm.unwrap_or_default());
    format!(
        "{shown}: the settings of {}, {} um a count, {} Hz; not commissioned\n\
         \n\
         Next, on the simulated stage:\n\
         \x20   quadrant commission --axis {axis} --settings {file} --machine simulated --travel {travel}\n\
         On a board: `load {file}`, `store` and `reboot` in\n\
         \x20   quadrant connect --port PATH\n\
         then the same command with --machine serial:PATH, and with --travel as far as\n\
         it may go from where it stands.\n\
         limits.travel_mm counts from the origin that homing sets, where homing.mark_mm is\n\
         the position of its mark; 0 unless it is given.",
        names.join(", "),
        short(count_um),
        short(machine.rate_hz),
    )
}

/// A number with four digits behind the point at most.
fn short(value: f64) -> String {
    ((1e4 * value).round() / 1e4).to_string()
}
