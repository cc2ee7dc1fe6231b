//! Commands of the console, as they are written on a command line or in a script.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Args, Subcommand, ValueEnum};
use quadrant_cli::axis::Axis;
use quadrant_cli::output::Output;
use quadrant_host::log::LogFilter;
use quadrant_host::machine::simulated_io;
use quadrant_link::message::Channel;
use quadrant_tune::test_axis::Travel;
use strum::IntoStaticStr;

use crate::commission::Request;
use crate::plane::PlaneName;
use crate::subject::{travel, travel_both_ways};

/// Format of the file of `plan`.
const PLAN_FILE: &str = "The file has one line, `motions = [X, Y, Z]`, and each of them is one of
  \"hold\"
  { harmonic = { amplitude_mm = 10, frequency_hz = 0.2, phase_rad = 0, cycles = 3, lead_s = 1 } }
  { point-to-point = { distance_mm = 10, max_velocity_mm_s = 50, max_acceleration_mm_s2 = 500, max_jerk_mm_s3 = 1e4 } }
A harmonic without `cycles` goes on until `stop`.";

/// One thing to ask of the machine.
#[derive(Clone, Debug, Subcommand, IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub(super) enum Command {
    /// Say who the machine is: firmware, board, control rate.
    Hello,
    /// Say how the machine is: state, fault, and of each axis position, error and output.
    Status,
    /// Say which of the digital inputs are active, and what keeps the outputs from being enabled: press each switch, and look.
    Inputs {
        /// Look for this long, and say what changes, s.
        #[arg(default_value_t = 0.0)]
        seconds: f64,
    },
    /// Say which fault is latched, its cause, and what to do about it.
    Fault,
    /// Clear the latched fault; the outputs stay off.
    Reset,
    /// Switch the outputs on; the axes hold where they stand.
    Enable,
    /// Switch the outputs off.
    Disable,
    /// Brake all axes to rest; the outputs stay on.
    Stop,
    /// Find the home position of axes; without any, of all. `wait homed` waits for it.
    Home {
        /// The axes: x, y, z.
        #[arg(value_enum)]
        axes: Vec<Axis>,
    },
    /// Move one axis to a position. `wait rest` waits for it.
    #[command(allow_negative_numbers = true)]
    Move {
        /// The axis: x, y or z.
        #[arg(value_enum)]
        axis: Axis,
        /// Target, mm from the home position; without homing, from where the axis stood at the start.
        target_mm: f64,
        /// Largest velocity, mm/s; at most the axis' largest velocity.
        #[arg(long, default_value_t = 10.0, value_name = "MM_S")]
        velocity: f64,
    },
    /// Move one axis at a velocity until `stop`, or `jog` at 0.
    #[command(allow_negative_numbers = true)]
    Jog {
        /// The axis: x, y or z.
        #[arg(value_enum)]
        axis: Axis,
        /// The velocity, mm/s, with its sign; 0 brakes.
        velocity_mm_s: f64,
    },
    /// Set the speed of the spindle: axes with `feedforward/cancelling` cancel the vibration of the cut by it.
    Spindle {
        /// The speed, rpm; 0 if it stands.
        rpm: f64,
    },
    /// Start the plan: the motions of `plan` or `circle`, from where the axes stand. `wait rest` waits for their end.
    Run,
    /// Exchange the plan for that of a TOML file: `motions`, one for each axis.
    #[command(after_help = PLAN_FILE)]
    Plan {
        /// The file: TOML.
        file: PathBuf,
    },
    /// Exchange the plan for a circle from where the axes stand; `run` starts it.
    Circle(CircleOptions),
    /// Follow a part program in G-code from where the axes stand, and wait for its end.
    Stream(StreamOptions),
    /// Show a setting, or all below a path, as they are edited.
    Get {
        /// Its path: /axes/x/feedback/pid/kp_v_per_mm, or x/feedback/pid/kp_v_per_mm for short.
        path: String,
    },
    /// Change a setting of the draft; `apply` lets the draft act.
    #[command(allow_negative_numbers = true)]
    Set {
        /// Its path, as for `get`.
        path: String,
        /// Its value: a number, true, false, a name, a list in JSON, null to leave a part out, present to make it.
        value: String,
    },
    /// List the paths of the settings.
    List {
        /// Only those below this path.
        #[arg(default_value = "")]
        prefix: String,
    },
    /// Show what `apply` would change, or what loading a file would.
    Diff {
        /// The file: TOML, as for `load`; without it, what `apply` would change.
        file: Option<PathBuf>,
    },
    /// Take the friction that an axis has learnt into the draft: its friction gains as they act, times the scale.
    Adopt {
        /// The axis: x, y or z.
        #[arg(value_enum)]
        axis: Axis,
    },
    /// Write all settings to a file that every other command reads.
    Dump {
        /// The file: TOML. One that holds other settings is refused.
        file: PathBuf,
        /// Write over a file that holds other settings.
        #[arg(long)]
        overwrite: bool,
    },
    /// Load all settings from a file and let them act as a whole; what the machine refuses changes nothing.
    Load {
        /// The file: TOML, as from `dump` or `quadrant commission`.
        file: PathBuf,
    },
    /// Let the edited settings act, checked as a whole, without a bump.
    Apply,
    /// Take the last `apply` or `load` of this session back: what acted before acts again.
    Undo,
    /// Forget what was edited: the draft equals the settings in force again.
    Revert,
    /// Make the draft the defaults; `apply` lets them act.
    Defaults,
    /// Keep the settings for the next start; the outputs must be off.
    Store {
        /// Their origin, at most 200 bytes; without it, the file that was loaded, or the origin that was stored before, and whether
        /// they were edited since.
        #[arg(value_name = "TEXT")]
        provenance: Option<String>,
    },
    /// Say where the kept settings come from.
    Provenance,
    /// List the channels that can be recorded and shown, with their units.
    Channels {
        /// Only those whose name begins like this: x, y., stage.
        #[arg(default_value = "")]
        prefix: String,
    },
    /// List the serial ports of this computer; needs no connection.
    Ports,
    /// Record channels to a CSV file that every other command reads.
    Record(RecordOptions),
    /// Capture channels at the full control rate, around a trigger.
    #[command(subcommand)]
    Capture(CaptureCommand),
    /// Draw channels in the terminal while they are sampled; with --svg or --csv, keep what was drawn.
    Scope(ScopeOptions),
    /// Watch the machine live in the terminal: states, inputs, strip charts of channels, gains that are nudged meanwhile. `?` shows
    /// the keys.
    Watch(WatchOptions),
    /// Show events as the link reports them: states, faults, motions, settings.
    Events {
        /// Duration, s; 0 shows only those that have come already.
        #[arg(default_value_t = 0.0)]
        seconds: f64,
    },
    /// Show what the firmware has logged (defmt) since the last time: over the link, where --elf has its strings, or of the emulated
    /// board. Without a connection: of a file, or through a debug probe until Ctrl-C.
    Log(LogOptions),
    /// Press inputs of a simulated or emulated machine, until `release`.
    Press {
        /// The inputs: emergency-stop, x.negative-limit, x.positive-limit, x.home, x.amplifier-fault, and of y and z.
        #[arg(required = true, value_parser = input_parser())]
        inputs: Vec<String>,
    },
    /// Let go of inputs; without any, of all.
    Release {
        /// The inputs, as for `press`.
        #[arg(value_parser = input_parser())]
        inputs: Vec<String>,
    },
    /// Cut the supply of a simulated or emulated machine for a second, in any state; what is stored stays.
    PowerCycle,
    /// Wait: for some seconds of the machine's time, for the axes to rest, or until axes are homed.
    Wait {
        /// Seconds, `rest` or `homed`.
        what: String,
        /// After `homed`: the axes; without any, all.
        #[arg(value_enum)]
        axes: Vec<Axis>,
        /// Longest time to wait for rest or homing, s.
        #[arg(long, default_value_t = 600.0, value_name = "S")]
        timeout: f64,
    },
    /// Measure an axis, and say what it is like; the machine keeps its settings.
    #[command(subcommand)]
    Identify(IdentifyCommand),
    /// Measure an axis of which only encoder, amplifier and limits are known, and make settings for it, unattended; it moves
    /// within its travel for about a quarter of an hour.
    Commission(CommissionOptions),
    /// Restart the machine, as after power-up; the outputs must be off.
    Reboot,
    /// Flash firmware onto the board through its debug probe, and verify it; needs no connection. The board restarts with its outputs
    /// off.
    Flash(FlashOptions),
    /// Take commands from standard input, one a line; `#` begins a comment. The same as no command.
    #[command(name = "-")]
    #[strum(serialize = "-")]
    Script,
}

/// Options of the command `circle`.
#[derive(Clone, Debug, Args)]
pub(super) struct CircleOptions {
    /// Radius of the circle, mm.
    #[arg(long, value_name = "MM")]
    pub(super) radius_mm: f64,
    /// Feed along the path, mm/min.
    #[arg(long, value_name = "MM_MIN")]
    pub(super) feed_mm_min: f64,
    /// Plane: xy, yz or zx.
    #[arg(long, value_enum, default_value_t = PlaneName::Xy)]
    pub(super) plane: PlaneName,
    /// Turns at full feed.
    #[arg(long, default_value_t = 2.0)]
    pub(super) turns: f64,
    /// Clockwise (G2) instead of counter-clockwise (G3).
    #[arg(long)]
    pub(super) clockwise: bool,
    /// Duration of the lead-in and of the lead-out, s.
    #[arg(long, default_value_t = 0.5, value_name = "S")]
    pub(super) lead_s: f64,
}

/// Options of the command `stream`.
#[derive(Clone, Debug, Args)]
pub(super) struct StreamOptions {
    /// The part program: G0-G4, G17-G21, G61, G64, G90, G91, I, J, K or R, F in mm/min, M2/M30; what else a CAM system writes is
    /// ignored with a note, or refused by its name.
    pub(super) file: PathBuf,
    /// Control ticks from one set point to the next, 4 to 1000.
    #[arg(long, default_value_t = 50, value_name = "TICKS", value_parser = clap::value_parser!(u16).range(4..=1000))]
    pub(super) period_ticks: u16,
    /// Largest distance of the path from a corner between straight lines, mm, 0 to 10, where the program does not say by G61 or
    /// G64 P; 0 stops at it exactly.
    #[arg(long, default_value_t = 0.0, value_name = "MM")]
    pub(super) corner_deviation_mm: f64,
}

/// Options of the command `record`.
#[derive(Clone, Debug, Args)]
pub(super) struct RecordOptions {
    /// Channels, at most 8: x.reference, x.position, x.error, x.output, stage.state, ...
    #[arg(long, value_delimiter = ',', default_values_t = default_channels(), value_name = "CHANNEL,...")]
    pub(super) channels: Vec<Channel>,
    /// Duration, s of the machine's time; without it, until the axes rest after a motion.
    #[arg(long, value_name = "S")]
    pub(super) seconds: Option<f64>,
    /// Control ticks between samples; without it, as few as a serial port carries.
    #[arg(long, value_name = "TICKS", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) every: Option<u16>,
    /// The file; of several axes each gets its own, such as run-x.csv.
    #[arg(long, value_name = "FILE")]
    pub(super) out: PathBuf,
    /// Write the file though samples were lost; its time has gaps then.
    #[arg(long)]
    pub(super) allow_gaps: bool,
    /// After `--`: a command that is given once recording has begun, such as `run` or `move x 10`.
    #[arg(last = true, value_name = "COMMAND")]
    pub(super) then: Vec<String>,
}

fn default_channels() -> Vec<Channel> {
    ["x.reference", "x.position", "x.error", "x.output"]
        .into_iter()
        .filter_map(|name| name.parse().ok())
        .collect()
}

/// Commands that concern the capture.
#[derive(Clone, Debug, Subcommand)]
pub(super) enum CaptureCommand {
    /// Forget what was captured and wait for a trigger; a fault triggers in any case.
    Arm(ArmOptions),
    /// Say how far it is.
    State,
    /// Freeze what there is.
    Stop,
    /// Read what was captured into a CSV file, waiting until it is frozen.
    Read {
        /// The file; of several axes each gets its own, such as trace-x.csv.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Longest time to wait, s.
        #[arg(long, default_value_t = 10.0, value_name = "S")]
        timeout: f64,
    },
}

/// Options of `capture arm`.
#[derive(Clone, Debug, Args)]
pub(super) struct ArmOptions {
    /// Channels, at most 8; the ring of 2048 words is shared out among them.
    #[arg(long, value_delimiter = ',', default_values_t = default_channels(), value_name = "CHANNEL,...")]
    pub(super) channels: Vec<Channel>,
    /// Control ticks between samples.
    #[arg(long, default_value_t = 1, value_name = "TICKS", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) every: u16,
    /// Share of the ring for what comes before the trigger, percent, 0 to 100.
    #[arg(long, default_value_t = 25, value_name = "PERCENT")]
    pub(super) pre_trigger: u8,
    /// The trigger: now, command, fault, motion, or a channel that crosses a level.
    #[arg(long, value_enum, default_value_t = TriggerEvent::Fault, conflicts_with = "channel")]
    pub(super) on: TriggerEvent,
    /// The channel whose level triggers.
    #[arg(long, requires = "level")]
    pub(super) channel: Option<Channel>,
    /// The level, in the channel's unit: x.error in mm, x.output in V.
    #[arg(long, requires = "channel", allow_negative_numbers = true)]
    pub(super) level: Option<f64>,
    /// Direction in which the level is crossed.
    #[arg(long, value_enum, default_value_t = CrossedEdge::Either)]
    pub(super) edge: CrossedEdge,
}

/// Options of the command `scope`.
#[derive(Clone, Debug, Args)]
pub(super) struct ScopeOptions {
    /// Channels, at most 8.
    #[arg(
        value_delimiter = ',',
        value_name = "CHANNEL,...",
        default_value = "x.error"
    )]
    pub(super) channels: Vec<Channel>,
    /// Duration, s of the machine's time.
    #[arg(long, default_value_t = 10.0, value_name = "S")]
    pub(super) seconds: f64,
    /// Time across the screen, s.
    #[arg(long, default_value_t = 2.0, value_name = "S")]
    pub(super) window: f64,
    /// Width, characters; height of each channel, lines. Without it the terminal's width, and 6 lines.
    #[arg(long, num_args = 2, value_names = ["WIDTH", "HEIGHT"])]
    pub(super) size: Option<Vec<usize>>,
    /// Write what was sampled as a figure for print.
    #[arg(long, value_name = "FILE")]
    pub(super) svg: Option<PathBuf>,
    /// Write what was sampled as CSV.
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,
}

/// Options of the command `watch`.
#[derive(Clone, Debug, Args)]
pub(super) struct WatchOptions {
    /// Channels of the charts, at most 8.
    #[arg(
        value_delimiter = ',',
        value_name = "CHANNEL,...",
        default_value = "x.error,y.error,z.error"
    )]
    pub(super) channels: Vec<Channel>,
    /// Time across a chart, s, 0.1 to 60.
    #[arg(long, default_value_t = 4.0, value_name = "S")]
    pub(super) window: f64,
    /// Settings that are nudged, each a number; without any, the PID's gains of the charts' axes.
    #[arg(long, value_name = "PATH")]
    pub(super) gain: Vec<String>,
    /// The file for what is written by `w`: CSV.
    #[arg(long, value_name = "FILE", default_value = "watch.csv")]
    pub(super) csv: PathBuf,
}

/// Event that a capture waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum TriggerEvent {
    /// None: it begins at once.
    Now,
    /// The next command that is given.
    Command,
    /// The next fault that occurs.
    Fault,
    /// The start of the next motion.
    Motion,
}

/// Direction in which a level is crossed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum CrossedEdge {
    /// From below the level.
    Rising,
    /// From above the level.
    Falling,
    /// From either side of it.
    Either,
}

/// Measurements on a connected axis.
#[derive(Clone, Debug, Subcommand)]
pub(super) enum IdentifyCommand {
    /// Move the axis to and fro by up to 60 mm, and find inertia and friction in that motion.
    Motion(IdentifyOptions),
    /// Move the axis at 16 velocities from 0.05 to 40 mm/s, both ways, about the middle of its travel, and fit the static model; within +-90 mm.
    StaticFriction(IdentifyOptions),
    /// Move the axis in a slow sine of micrometres under a quiet controller, and identify the GMS model; needs a plant in the
    /// settings.
    VirginCurve(IdentifyOptions),
    /// Measure the acceleration per volt in open loop, within some millimetres; needs nothing that works but encoder and
    /// amplifier.
    MotorConstant(IdentifyOptions),
    /// Excite the axis while it moves at 37 mm/s, measure its frequency response, position over voltage, and fit the linear
    /// model; the file holds the response.
    Plant(IdentifyOptions),
}

/// Options of a measurement.
#[derive(Clone, Debug, Args)]
pub(super) struct IdentifyOptions {
    /// The axis: x, y or z.
    #[arg(value_enum)]
    pub(super) axis: Axis,
    /// Travel either way from where the axis stands, mm; without it, that to its soft limits, once it is homed.
    #[arg(long, value_name = "MM", value_parser = travel)]
    pub(super) travel: Option<f64>,
    /// File for the recording, CSV, which `quadrant identify ... --record` reads; of `plant`, the response.
    #[arg(long, value_name = "FILE")]
    pub(super) out: PathBuf,
}

/// Options of the command `commission`.
#[derive(Clone, Debug, Args)]
pub(super) struct CommissionOptions {
    /// The axis: x, y or z.
    #[arg(long, value_enum)]
    pub(super) axis: Axis,
    /// Travel from where the axis stands, mm: 200 for as much either way, or -5..180 of one that stands near an end. Without it,
    /// that to its soft limits, once it is homed.
    #[arg(long, value_name = "MM", value_parser = travel_both_ways, allow_hyphen_values = true)]
    pub(super) travel: Option<Travel>,
    /// Let the settings that were found act on the machine. Without it the machine keeps those that it had.
    #[arg(long)]
    pub(super) apply: bool,
    /// Keep them in the machine's flash too.
    #[arg(long, requires = "apply")]
    pub(super) store: bool,
    #[command(flatten)]
    pub(super) request: Request,
    #[command(flatten)]
    pub(super) output: Output,
}

/// Options of the command `flash`.
#[derive(Clone, Debug, Args)]
pub(super) struct FlashOptions {
    /// The firmware: the board's ELF file of a release, or one that `cargo xtask build` has left in target/images.
    pub(super) elf: PathBuf,
    /// The chip, as probe-rs calls it, of an image that does not name it.
    #[arg(long)]
    pub(super) chip: Option<String>,
    /// The debug probe, where several are connected: VID:PID:SERIAL, or VID:PID.
    #[arg(long)]
    pub(super) probe: Option<String>,
    /// Stay, and show the firmware's log (defmt) until Ctrl-C.
    #[arg(long)]
    pub(super) run: bool,
}

/// Options of the command `log`.
#[derive(Clone, Debug, Args)]
pub(super) struct LogOptions {
    /// The firmware that is on the board: the ELF file it was flashed from, for its strings.
    #[arg(long, value_name = "FILE")]
    pub(super) elf: Option<PathBuf>,
    /// The chip, as probe-rs calls it, of an image that does not name it.
    #[arg(long, requires = "elf")]
    pub(super) chip: Option<String>,
    /// The debug probe, where several are connected: VID:PID:SERIAL, or VID:PID.
    #[arg(long, requires = "elf")]
    pub(super) probe: Option<String>,
    /// Frames that were captured elsewhere, instead of those of a machine.
    #[arg(
        long,
        value_name = "FRAMES",
        requires = "elf",
        conflicts_with = "follow"
    )]
    pub(super) file: Option<PathBuf>,
    /// Go on until Ctrl-C.
    #[arg(long)]
    pub(super) follow: bool,
    /// The least level.
    #[arg(long, value_enum, default_value_t = LogLevel::Trace)]
    level: LogLevel,
    /// Lines that name this axis only.
    #[arg(long)]
    axis: Option<Axis>,
    /// Lines from this control tick on.
    #[arg(long, value_name = "TICK")]
    from: Option<u32>,
    /// Lines up to this control tick.
    #[arg(long, value_name = "TICK")]
    to: Option<u32>,
}

/// Level of a line, the least first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LogLevel {
    Trace,
    Debug,
    Info,
    Warn,
    Error,
}

impl LogOptions {
    /// True if it chooses some of the lines.
    pub(super) fn chooses(&self) -> bool {
        let ticks = self.from.or(self.to);
        self.level != LogLevel::Trace || self.axis.is_some() || ticks.is_some()
    }

    /// The choice of lines.
    pub(super) fn filter(&self) -> LogFilter {
        LogFilter {
            level: self.level as usize,
            word: self.axis.map(|axis| axis.name().to_owned()),
            ticks: (self.from, self.to),
        }
    }
}

/// Reads the name of an input that can be pressed.
fn input_parser() -> PossibleValuesParser {
    PossibleValuesParser::new(simulated_io::INPUTS.map(|(name, _)| name))
}

impl Command {
    /// Returns its name, for `--json` and messages.
    pub(super) fn name(&self) -> &'static str {
        self.into()
    }
}
