//! `cargo xtask linuxcnc`: the components of LinuxCNC, built, installed, run and judged.

mod install;
mod score;
mod session;

use std::path::Path;

use anyhow::{Result, ensure};
use clap::Parser;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_settings::StageSettings;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::plant::DRIVE_MM_S_PER_V;
use quadrant_tune::design::with_best_pid;

use self::score::Score;
use self::session::Session;

/// Sessions at a time.
const AT_A_TIME: usize = 8;
/// Rates of the servo thread, Hz.
const RATES_HZ: [f64; 2] = [1e3, 4e3];
/// Lag of amplifiers in velocity mode, us.
const VELOCITY_LAG_US: u32 = 2000;
/// Seeds of the stage's noise.
const SEEDS: [u32; 3] = [1, 2, 3];

/// The components of LinuxCNC
#[derive(Parser)]
#[command(name = "cargo xtask linuxcnc")]
struct Options {
    /// Build both components against the installed LinuxCNC, and install them
    #[arg(long)]
    install: bool,
    /// Remove them
    #[arg(long, conflicts_with_all = ["install", "run", "check"])]
    uninstall: bool,
    /// Write a configuration on the simulated stage to a folder, and start LinuxCNC on it
    #[arg(long)]
    run: bool,
    /// Run a part program without a screen under four loops, and judge them
    #[arg(long, conflicts_with = "run")]
    check: bool,
    /// Keep what the check leaves, in this folder
    #[arg(long, requires = "check")]
    keep: Option<std::path::PathBuf>,
    /// Judge again what an earlier check has kept
    #[arg(long, requires = "keep")]
    again: bool,
    /// Also delay the loop's reference by the preview instead of extrapolating it
    #[arg(long, requires = "check")]
    delay: bool,
}

/// A way to close the loops.
struct Loop {
    letter: &'static str,
    words: &'static str,
    file: &'static str,
    preview: &'static str,
    /// Lag of amplifiers in velocity mode, us; 0 for torque mode.
    drive_lag_us: u32,
    settings: fn(&StageSettings) -> StageSettings,
}

/// The loops that are compared; the first is the one that the others are compared with.
const LOOPS: [Loop; 6] = [
    Loop {
        letter: "a",
        words: "LinuxCNC's pid",
        file: "pid.hal",
        preview: "extrapolate",
        drive_lag_us: 0,
        settings: Clone::clone,
    },
    Loop {
        letter: "b",
        words: "ours, no friction fed forward",
        file: "quadrant.hal",
        preview: "extrapolate",
        drive_lag_us: 0,
        settings: without_friction,
    },
    Loop {
        letter: "c",
        words: "ours",
        file: "quadrant.hal",
        preview: "extrapolate",
        drive_lag_us: 0,
        settings: Clone::clone,
    },
    Loop {
        letter: "d",
        words: "pid + our feedforward",
        file: "feedforward.hal",
        preview: "extrapolate",
        drive_lag_us: 0,
        settings: for_pid,
    },
    Loop {
        letter: "e",
        words: "pid, amplifiers in velocity mode",
        file: "pid.hal",
        preview: "extrapolate",
        drive_lag_us: VELOCITY_LAG_US,
        settings: behind_velocity_loops,
    },
    Loop {
        letter: "f",
        words: "ours, reference delayed",
        file: "quadrant.hal",
        preview: "delay",
        drive_lag_us: 0,
        settings: Clone::clone,
    },
];

fn without_friction(settings: &StageSettings) -> StageSettings {
    let mut settings = settings.clone();
    for axis in &mut settings.axes {
        axis.feedforward.kind = FeedforwardKind::None;
    }
    settings
}

/// Settings of the linear model behind amplifiers in velocity mode, an integrator with a lag.
fn behind_velocity_loops(settings: &StageSettings) -> StageSettings {
    let mut settings = settings.clone();
    for plant in settings
        .axes
        .iter_mut()
        .filter_map(|axis| axis.plant.as_mut())
    {
        plant.damping_per_s = 1e6 / f64::from(VELOCITY_LAG_US);
        plant.gain_mm_per_v_s2 = DRIVE_MM_S_PER_V * plant.damping_per_s;
    }
    settings
}

/// Settings whose PID is the one that `pid` is: its derivative is the difference of two errors, which ours is where its filter's time
/// constant is half a period.
fn for_pid(settings: &StageSettings) -> StageSettings {
    let mut settings = settings.clone();
    for axis in &mut settings.axes {
        axis.feedback.pid.derivative_filter_s = 0.5 / settings.rate_hz;
    }
    with_best_pid(&settings).unwrap_or(settings)
}

/// Gains of `pid`: the best PID of its form; FF1 and FF2 are the plant's damping and inertia.
fn pid_gains(settings: &StageSettings) -> [[f64; 5]; 3] {
    for_pid(settings).axes.each_ref().map(|axis| {
        let pid = &axis.feedback.pid;
        let (damping, inertia) = axis.plant.map_or((0.0, 0.0), |plant| {
            let gain = plant.gain_mm_per_v_s2;
            (plant.damping_per_s / gain, 1.0 / gain)
        });
        [
            pid.kp_v_per_mm,
            pid.ki_v_per_mm_s,
            pid.kd_v_s_per_mm,
            damping,
            inertia,
        ]
    })
}

/// The settings that commissioning the simulated stage gave, with the best PID for a rate.
fn settings_at(rate_hz: f64) -> Result<StageSettings> {
    let mut settings = identified_settings()?.stage;
    settings.rate_hz = rate_hz;
    for axis in &mut settings.axes {
        let filter_s = &mut axis.feedback.pid.derivative_filter_s;
        *filter_s = filter_s.max(0.5 / rate_hz);
        axis.feedforward.learning = Some(LearningSettings::DEFAULT);
        // Nothing uses them, and they would be checked against the rate.
        (axis.friction.dahl, axis.friction.lugre) = (None, None);
    }
    Ok(with_best_pid(&settings)?)
}

fn check(folder: &Path, with_delay: bool, again: bool) -> Result<()> {
    let loops = &LOOPS[..LOOPS.len() - usize::from(!with_delay)];
    let mut sessions = Vec::new();
    for rate_hz in RATES_HZ {
        let settings = settings_at(rate_hz)?;
        for way in loops {
            for seed in SEEDS {
                sessions.push(Session {
                    name: format!("{rate_hz}-{}-{seed}", way.letter),
                    loops: way.file,
                    settings: (way.settings)(&settings),
                    gains: pid_gains(&(way.settings)(&settings)),
                    preview: way.preview,
                    drive_lag_us: way.drive_lag_us,
                    seed,
                });
            }
        }
    }
    let mut scores = Vec::new();
    let mut judge = |session: &Session, folder: &Path| -> Result<()> {
        let record = score::read(&folder.join("record"))?;
        scores.push(score::judge(&record, session.settings.rate_hz));
        Ok(())
    };
    if again {
        for session in &sessions {
            judge(session, &folder.join(&session.name))?;
        }
        return report(loops, &scores);
    }
    if let Some(session) = sessions.first() {
        session::start_faults(session, folder)?.finish()?;
        println!(
            "unloaded while it drove, loaded again, an encoder stopped: the voltages were zero"
        );
    }
    for wave in sessions.chunks(AT_A_TIME) {
        let running: Vec<_> = wave
            .iter()
            .map(|session| session::start(session, folder))
            .collect::<Result<_>>()?;
        for (session, running) in wave.iter().zip(running) {
            judge(session, &running.finish()?)?;
        }
    }
    report(loops, &scores)
}

/// Prints the table; an error if a loop of ours is worse than LinuxCNC's.
fn report(loops: &[Loop], scores: &[Score]) -> Result<()> {
    println!(
        "um, simulated; means of {} seeds, and against (a)",
        SEEDS.len()
    );
    println!("| rate | loop | circular deviation | largest error | reversal spike |");
    println!("|---|---|---|---|---|");
    let mut worse = Vec::new();
    let of_rates = scores.chunks(SEEDS.len() * loops.len());
    for (rate_hz, of_rate) in RATES_HZ.iter().zip(of_rates) {
        let means: Vec<[f64; 3]> = of_rate
            .chunks(SEEDS.len())
            .map(|seeds| {
                let mean = |figure: usize| {
                    let sum: f64 = seeds.iter().map(|score| score.figures()[figure]).sum();
                    sum / seeds.len() as f64
                };
                [mean(0), mean(1), mean(2)]
            })
            .collect();
        for (way, mean) in loops.iter().zip(&means) {
            let cells: Vec<String> = mean
                .iter()
                .zip(&means[0])
                .map(|(own, first)| format!("{own:.2} ({:+.0} %)", 100.0 * (own / first - 1.0)))
                .collect();
            println!(
                "| {rate_hz} Hz | ({}) {} | {} |",
                way.letter,
                way.words,
                cells.join(" | ")
            );
            let is_ours = matches!(way.letter, "c" | "d");
            if is_ours && mean.iter().zip(&means[0]).any(|(own, first)| own > first) {
                worse.push(format!("({}) at {rate_hz} Hz", way.letter));
            }
        }
    }
    ensure!(worse.is_empty(), "worse than (a): {}", worse.join(", "));
    Ok(())
}

/// Writes the configuration, and starts LinuxCNC on it.
fn run() -> Result<()> {
    let folder = xtask::command::root().join("target/linuxcnc");
    let settings = settings_at(RATES_HZ[0])?;
    let session = Session {
        name: String::new(),
        loops: "quadrant.hal",
        gains: pid_gains(&settings),
        settings,
        preview: "extrapolate",
        drive_lag_us: 0,
        seed: SEEDS[0],
    };
    session::write(&session, &folder, "axis")?;
    xtask::command::run(xtask::command::command("linuxcnc").arg(folder.join("machine.ini")))
}

fn main() -> Result<()> {
    let options = Options::parse();
    if options.uninstall {
        return install::uninstall();
    }
    install::require_linuxcnc(options.check)?;
    if options.install || options.check && !options.again {
        install::install()?;
    }
    if options.run {
        return run();
    }
    if options.check {
        session::make_user()?;
        // Not below /tmp, which each session has for itself.
        let temporary = tempfile::tempdir_in("/var/tmp")?;
        let folder = options.keep.as_deref().unwrap_or(temporary.path());
        std::fs::create_dir_all(folder)?;
        xtask::command::run_quietly(xtask::command::command("chmod").arg("755").arg(folder))?;
        return check(&folder.canonicalize()?, options.delay, options.again);
    }
    Ok(())
}
