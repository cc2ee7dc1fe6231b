//! A LinuxCNC without a screen that runs the part program on the simulated stage.
//!
//! LinuxCNC does not run as root: a user is made for it. Each session has network, shared memory and temporary files of its own, so that
//! several run at a time; the machine's time is counted in periods, so that they do not disturb one another.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, ensure};
use quadrant_settings::StageSettings;
use quadrant_sim::settings_file::SettingsFile;
use xtask::command;

use crate::install::sources;

/// The user that LinuxCNC runs as.
const USER: &str = "quadrant";

/// A session.
#[derive(Clone, Debug)]
pub(crate) struct Session {
    /// Name of its folder.
    pub(crate) name: String,
    /// File of the loops in `linuxcnc/configs/sim`.
    pub(crate) loops: &'static str,
    /// Settings of the component.
    pub(crate) settings: StageSettings,
    /// P, I, D, FF1 and FF2 of LinuxCNC's loops.
    pub(crate) gains: [[f64; 5]; 3],
    /// `extrapolate` or `delay`.
    pub(crate) preview: &'static str,
    /// Lag of amplifiers in velocity mode, us; 0 for torque mode.
    pub(crate) drive_lag_us: u32,
    /// Seed of the stage's noise.
    pub(crate) seed: u32,
    /// Minutes for which the part program is repeated, and times are taken; 0 for once.
    pub(crate) minutes: u32,
}

/// True for the user that LinuxCNC refuses.
pub(crate) fn is_root() -> Result<bool> {
    let user = command::output(command::command("id").arg("-u"))?;
    Ok(user.trim() == "0")
}

/// Makes the user, unless there is one.
pub(crate) fn make_user() -> Result<()> {
    ensure!(
        is_root()?,
        "the check makes a user and spaces for each session: run it as root"
    );
    if Path::new("/home").join(USER).exists() {
        return Ok(());
    }
    command::run(command::command("useradd").args(["--create-home", USER]))
}

/// Writes a session's files to a folder; `display`: the program that shows them.
pub(crate) fn write(session: &Session, folder: &Path, display: &str) -> Result<()> {
    fs::create_dir_all(folder)?;
    let configs = sources().join("configs/sim");
    for entry in configs.read_dir()? {
        let path = entry?.path();
        fs::copy(&path, folder.join(path.file_name().context("a file")?))?;
    }
    let rate = session.settings.rate_hz.to_string();
    let period = (1e9 / session.settings.rate_hz).to_string();
    let seed = session.seed.to_string();
    let mut values = vec![
        ("DISPLAY", "DISPLAY", display.to_owned()),
        ("DISPLAY", "MINUTES", session.minutes.to_string()),
        ("EMCMOT", "SERVO_PERIOD", period),
        ("QUADRANT", "PREVIEW", session.preview.to_owned()),
        ("PLANT", "RATE", rate),
        ("PLANT", "SEED", seed),
        ("PLANT", "DRIVE_LAG_US", session.drive_lag_us.to_string()),
        (
            "PLANT",
            "RECORD",
            folder.join("record").display().to_string(),
        ),
        (
            "QUADRANT",
            "DEFAULTS",
            folder.join("settings.toml").display().to_string(),
        ),
        (
            "QUADRANT",
            "STORE",
            folder.join("settings.store").display().to_string(),
        ),
        (
            "DISPLAY",
            "OPEN_FILE",
            folder.join("part.ngc").display().to_string(),
        ),
    ];
    for (joint, gains) in ["JOINT_0", "JOINT_1", "JOINT_2"].iter().zip(session.gains) {
        for (name, gain) in ["P", "I", "D", "FF1", "FF2"].into_iter().zip(gains) {
            values.push((joint, name, format!("{gain:.9}")));
        }
    }
    fs::copy(sources().join("check/times.hal"), folder.join("times.hal"))?;
    let text = fs::read_to_string(configs.join("machine.ini"))?;
    let text = with_values(&text, &values)?.replace(
        "HALFILE = quadrant.hal",
        &format!("HALFILE = {}", session.loops),
    );
    fs::write(folder.join("machine.ini"), text)?;
    let path = folder.join("settings.toml");
    let settings = SettingsFile::new(session.settings.clone());
    fs::write(&path, settings.text(&path).map_err(anyhow::Error::from)?)?;
    Ok(())
}

/// The text of an INI file with other values.
fn with_values(text: &str, values: &[(&str, &str, String)]) -> Result<String> {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (section, name, value) in values {
        let header = format!("[{section}]");
        let begin = lines.iter().position(|line| *line == header);
        let begin = begin.with_context(|| format!("machine.ini has no {header}"))?;
        let line = lines[begin..]
            .iter()
            .position(|line| line.split_once(" = ").is_some_and(|(key, _)| key == *name))
            .with_context(|| format!("{header} has no {name}"))?;
        lines[begin + line] = format!("{name} = {value}");
    }
    Ok(lines.join("\n") + "\n")
}

/// A session that runs.
pub(crate) struct Running {
    child: Child,
    folder: PathBuf,
}

/// Starts a session in a folder below `folder`.
pub(crate) fn start(session: &Session, folder: &Path) -> Result<Running> {
    let folder = folder.join(&session.name);
    let display = folder.join("headless.py").display().to_string();
    write(session, &folder, &display)?;
    // -r: what is printed goes to the log.
    let seconds = 100 + 60 * session.minutes;
    let line = format!("timeout {seconds} linuxcnc -r $PWD/machine.ini");
    spawn(folder, &line)
}

/// Starts the component without LinuxCNC, by files of the check: `name.hal` runs `name.sh`.
pub(crate) fn start_halrun(session: &Session, folder: &Path, name: &str) -> Result<Running> {
    let folder = folder.join(name);
    write(session, &folder, "")?;
    for ending in ["hal", "sh"] {
        let file = format!("{name}.{ending}");
        fs::copy(sources().join("check").join(&file), folder.join(&file))?;
    }
    spawn(
        folder,
        &format!("timeout 100 halrun -i machine.ini -f {name}.hal"),
    )
}

/// Runs a command in a folder as the user. Temporary files and the control's lock lie below /tmp, shared memory and ports in spaces of
/// their own.
fn spawn(folder: PathBuf, line: &str) -> Result<Running> {
    command::run_quietly(command::command("chown").args(["-R", USER]).arg(&folder))?;
    let script = format!(
        "ip link set lo up; mount -t proc proc /proc; cd {0} && mkdir -p tmp && chown {USER} tmp && mount --bind tmp /tmp && \
         exec runuser -u {USER} -- env HOME={0} DISPLAY= sh -c 'exec {line}'",
        folder.display()
    );
    let log = fs::File::create(folder.join("log"))?;
    let child = Command::new("unshare")
        .args([
            "--ipc", "--net", "--mount", "--pid", "--fork", "sh", "-c", &script,
        ])
        .stdin(Stdio::null())
        .stdout(log.try_clone()?)
        .stderr(log)
        .spawn()
        .context("unshare")?;
    Ok(Running { child, folder })
}

impl Running {
    /// Waits for its end; returns its folder.
    pub(crate) fn finish(mut self) -> Result<PathBuf> {
        let status = self.child.wait()?;
        let text = |name| fs::read_to_string(self.folder.join(name)).unwrap_or_default();
        let result = text("result");
        ensure!(
            result.trim() == "done",
            "{}: {status}: {result}{}",
            self.folder.display(),
            text("log")
        );
        Ok(self.folder)
    }
}
