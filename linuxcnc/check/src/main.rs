//! `cargo xtask linuxcnc`: the components of LinuxCNC, built, installed, run and judged.

mod install;
mod picture;
mod prove;
mod score;
mod session;

use std::path::Path;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_report::Series;
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
/// Largest step of a voltage in a period while an axis passes its index at 1 mm/s, V: a jump by a turn would be volts.
const MOST_INDEX_STEP_V: f64 = 0.1;
/// Seeds of the stage's noise.
const SEEDS: [u32; 3] = [1, 2, 3];

/// The components of LinuxCNC
#[derive(Parser)]
#[command(name = "cargo xtask linuxcnc")]
struct Options {
    /// Build both components against the installed LinuxCNC, and install them
    #[arg(long)]
    install: bool,
    /// Build both components against the installed LinuxCNC into this folder, with manual page and configurations
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["install", "uninstall", "run", "check"])]
    build: Option<std::path::PathBuf>,
    /// Remove them
    #[arg(long, conflicts_with_all = ["install", "run", "check"])]
    uninstall: bool,
    /// Write a configuration on the simulated stage to a folder, and start LinuxCNC on it
    #[arg(long)]
    run: bool,
    /// Run a part program without a screen under four loops, and judge them
    #[arg(long, conflicts_with = "run")]
    check: bool,
    /// Repeat the part program under pid with our feedforward for so many minutes instead, and print the times of the functions
    #[arg(long, requires = "check", value_name = "MINUTES")]
    minutes: Option<u32>,
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
                    minutes: 0,
                });
            }
        }
    }
    let mut scores = Vec::new();
    let mut curves = Vec::new();
    // Of LinuxCNC's loops and of ours.
    let mut index_steps = [0.0_f64; 2];
    let mut judge = |session: &Session, folder: &Path| -> Result<()> {
        let record = score::read(&folder.join("record"))?;
        let rate_hz = session.settings.rate_hz;
        scores.push(score::judge(&record, rate_hz));
        if let Some(way) = way_in_picture(loops, session) {
            curves.push(picture::curve(way.words, &record, rate_hz, curves.len())?);
        }
        // LinuxCNC begins again at the feedback, so that its command steps by an axis' lag where there is one.
        if session.preview == "extrapolate" && session.drive_lag_us == 0 {
            let most = &mut index_steps[usize::from(session.loops == "quadrant.hal")];
            *most = most.max(score::index_step(folder)?);
        }
        Ok(())
    };
    if again {
        for session in &sessions {
            judge(session, &folder.join(&session.name))?;
        }
        draw(curves, folder)?;
        return report(loops, &scores, index_steps);
    }
    if let Some(session) = sessions.first() {
        let [faults, units] =
            ["faults", "units"].map(|name| session::start_halrun(session, folder, name));
        faults?.finish()?;
        println!(
            "unloaded while it drove, loaded again, an encoder stopped: the voltages were zero"
        );
        units?.finish()?;
        println!("followed in inches; friction as a torque offset in per mille");
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
    draw(curves, folder)?;
    report(loops, &scores, index_steps)
}

/// The loop of a session whose reversal is drawn: each that pid and our feedforward are in, at the slower rate.
fn way_in_picture<'a>(loops: &'a [Loop], session: &Session) -> Option<&'a Loop> {
    let drawn = loops
        .iter()
        .filter(|way| matches!(way.letter, "a" | "c" | "d"));
    let name = |way: &Loop| format!("{}-{}-{}", RATES_HZ[0], way.letter, SEEDS[0]);
    drawn.into_iter().find(|way| name(way) == session.name)
}

/// Leaves the picture in the folder.
fn draw(curves: Vec<Series>, folder: &Path) -> Result<()> {
    let picture = picture::svg(curves, RATES_HZ[0])?;
    std::fs::write(folder.join("linuxcnc-reversal.svg"), picture)?;
    Ok(())
}

/// Repeats the part program with `pid` and our component in one thread, and prints how long each takes.
fn measure_times(folder: &Path, minutes: u32) -> Result<()> {
    let settings = settings_at(RATES_HZ[0])?;
    let session = Session {
        name: "times".to_owned(),
        loops: "feedforward.hal\nHALFILE = times.hal",
        gains: pid_gains(&settings),
        settings: for_pid(&settings),
        preview: "extrapolate",
        drive_lag_us: 0,
        seed: SEEDS[0],
        minutes,
    };
    let folder = session::start(&session, folder)?.finish()?;
    let text = std::fs::read_to_string(folder.join("times"))?;
    let mut lines: Vec<Vec<f64>> = text
        .lines()
        .map(|line| line.split(' ').map(str::parse).collect())
        .collect::<Result<_, _>>()?;
    let jitter_ns = lines.pop().context("the jitter")?;
    let longest = lines.pop().context("the longest times")?;
    // LinuxCNC counts the processor's clocks.
    let processors = std::fs::read_to_string("/proc/cpuinfo")?;
    let clock = processors
        .lines()
        .find_map(|line| line.strip_prefix("cpu MHz"));
    let clock = clock.and_then(|line| line.split(": ").nth(1)?.parse::<f64>().ok());
    let clock_mhz = clock.context("the processor's clock")?;
    println!(
        "us, over {minutes} minutes; {} calls, and the longest of all",
        lines.len()
    );
    println!("| function | median | 99 % | longest |\n|---|---|---|---|");
    let functions = [
        "quadrant, three joints",
        "pid, one joint",
        "motion-controller",
        "the whole thread",
    ];
    for (index, function) in functions.iter().enumerate() {
        let mut times: Vec<f64> = lines.iter().map(|line| line[index] / clock_mhz).collect();
        times.sort_by(f64::total_cmp);
        let share = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
        println!(
            "| {function} | {:.2} | {:.2} | {:.0} |",
            share(0.5),
            share(0.99),
            longest[index] / clock_mhz
        );
    }
    println!(
        "largest jitter of the thread: {:.0} us",
        1e-3 * jitter_ns[0]
    );
    Ok(())
}

/// Prints the table; an error if a loop of ours is worse than LinuxCNC's, or homing to the index makes its voltage jump.
fn report(loops: &[Loop], scores: &[Score], index_steps: [f64; 2]) -> Result<()> {
    let [pid, ours] = index_steps;
    println!(
        "homed to the index: the voltage stepped by {ours:.3} V at most, and by {pid:.3} V with pid"
    );
    ensure!(
        ours < MOST_INDEX_STEP_V,
        "a jump by the index reaches the voltage"
    );
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
        minutes: 0,
    };
    session::write(&session, &folder, "axis")?;
    let ini = folder.join("machine.ini");
    ensure!(
        !session::is_root()?,
        "LinuxCNC does not run as root: as another user, who may write to {}: linuxcnc {}",
        folder.display(),
        ini.display()
    );
    xtask::command::run(xtask::command::command("linuxcnc").arg(ini))
}

fn main() -> Result<()> {
    let options = Options::parse();
    if options.uninstall {
        return install::uninstall();
    }
    install::require_linuxcnc(options.check)?;
    if let Some(folder) = &options.build {
        return install::pack(folder);
    }
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
        let folder = folder.canonicalize()?;
        if let Some(minutes) = options.minutes {
            return measure_times(&folder, minutes);
        }
        return check(&folder, options.delay, options.again);
    }
    Ok(())
}
