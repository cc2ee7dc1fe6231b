//! Commands that concern the machine's settings.

use std::path::Path;

use anyhow::{Context, anyhow, bail};
use quadrant::store::PROVENANCE_BYTES;
use quadrant_host::client::settings::{self, Before, Difference, whole_path};
use quadrant_host::client::{Client, ClientError};
use quadrant_link::message::{Applied, Body, SettingsRequest};
use quadrant_sim::setting_value::{meant, short, shown};
use quadrant_sim::settings_file::{Provenance, SettingsFile};
use quadrant_written::whole;
use serde_json::{Map, Value, json};

use super::answer::Answer;
use super::command::Command;
use super::session::{Origin, Session};
use crate::kept;

pub(super) fn get(client: &mut Client, path: &str) -> anyhow::Result<Answer> {
    let path = whole_path(path);
    match settings::get(client, &path) {
        // A part that may be left out: with what is in it.
        Ok(value) if value == "present" => {
            let text = lines(&leaves(client, &path)?);
            Ok(Answer::new(text, value))
        }
        Ok(value) => Ok(Answer::new(&value, value.clone())),
        Err(error) => {
            // Perhaps a path above leaves.
            let values = leaves(client, &path)?;
            if values.is_empty() {
                return Err(named(error, "get", &path));
            }
            Ok(Answer::new(lines(&values), Value::Object(values)))
        }
    }
}

/// The settings at a path and below, with their values.
fn leaves(client: &mut Client, path: &str) -> anyhow::Result<Map<String, Value>> {
    let mut values = Map::new();
    for path in below(client, path)? {
        let value = settings::get(client, &path)?;
        values.insert(short(&path), value);
    }
    Ok(values)
}

fn lines(values: &Map<String, Value>) -> String {
    let lines: Vec<String> = values
        .iter()
        .map(|(path, value)| format!("{path} {value}"))
        .collect();
    lines.join("\n")
}

fn below(client: &mut Client, path: &str) -> anyhow::Result<Vec<String>> {
    let mut paths = settings::list(client, path)?;
    let stem = path.trim_end_matches('/');
    paths.retain(|found| found.len() == stem.len() || found[stem.len()..].starts_with('/'));
    Ok(paths)
}

/// An error about a setting, with the path as it is shown; where no setting has it, with the one that is meant.
fn named(error: ClientError, command: &str, path: &str) -> anyhow::Error {
    let shown = short(path);
    match meant(&shown) {
        Some(meant) => {
            anyhow!("{command}: no setting is {shown}; did you mean {meant}? `list` shows all")
        }
        None => anyhow!(error.to_string().replace(path, &shown)),
    }
}

pub(super) fn set(client: &mut Client, path: &str, value: &str) -> anyhow::Result<Answer> {
    let path = whole_path(path);
    settings::set(client, &path, value).map_err(|error| named(error, "set", &path))?;
    Ok(Answer::done())
}

pub(super) fn list(client: &mut Client, prefix: &str) -> anyhow::Result<Answer> {
    let path = whole_path(prefix);
    let paths = below(client, &path)?;
    if paths.is_empty() {
        let shown = short(&path);
        match meant(&shown) {
            Some(meant) => bail!(
                "list: no setting is at or below {shown}; did you mean {meant}? `list` shows all"
            ),
            None => bail!("list: {shown} is in a part that is left out"),
        }
    }
    let paths: Vec<String> = paths.iter().map(|path| short(path)).collect();
    Ok(Answer::new(paths.join("\n"), json!(paths)))
}

pub(super) fn diff(client: &mut Client, file: Option<&Path>) -> anyhow::Result<Answer> {
    let differences = match file {
        Some(file) => settings::against(client, &SettingsFile::read(file)?.stage)?,
        None => settings::edited(client)?,
    };
    let mut lines: Vec<String> = differences.iter().map(difference_line).collect();
    if lines.is_empty() {
        lines.push(match file {
            Some(file) => format!("the settings in force are those of {}", file.display()),
            None => "nothing is edited that does not act".to_owned(),
        });
    }
    Ok(Answer::new(lines.join("\n"), json!(differences)))
}

/// A setting with the value that acts, and the other one.
pub(super) fn difference_line(difference: &Difference) -> String {
    let json = |value: &Option<Value>| value.as_ref().map_or("-".to_owned(), Value::to_string);
    let Difference {
        path,
        acting,
        other,
    } = difference;
    let [acting, other] = shown(&json(acting), &json(other));
    format!("{path} {acting} -> {other}")
}

pub(super) fn dump(client: &mut Client, file: &Path, overwrite: bool) -> anyhow::Result<Answer> {
    let stage = settings::dump(client)?;
    if !overwrite {
        kept::refuse_other(file, &stage)?;
    }
    let mut dumped = SettingsFile::new(stage);
    let stored = settings::provenance(client)?;
    let identity = client.identity();
    if !stored.is_empty() {
        dumped.provenance.push(Provenance {
            command: format!("stored in the machine: {stored}"),
            version: identity.firmware.as_str().to_owned(),
            axis: "all".to_owned(),
            records: Vec::new(),
            sets: Vec::new(),
        });
    }
    dumped.provenance.push(Provenance {
        command: format!("quadrant connect dump, from {}", client.endpoint()),
        version: identity.firmware.as_str().to_owned(),
        axis: "all".to_owned(),
        records: Vec::new(),
        sets: Vec::new(),
    });
    dumped.write(file, whole::write)?;
    let text = format!("{}: the settings of all axes", file.display());
    Ok(Answer::new(text, json!({ "file": file })))
}

pub(super) fn load(session: &mut Session, file: &Path) -> anyhow::Result<Answer> {
    let client = &mut session.client;
    let read = SettingsFile::read(file)?;
    let (loaded, before) = settings::load_undoably(client, &read.stage)
        .with_context(|| format!("{} was not loaded", file.display()))?;
    session.undo.push(before);
    session.origin = Origin {
        loaded: Some(origin_of(file, &read)),
        edited: false,
    };
    let mut text = format!(
        "{} settings changed; {}",
        loaded.changed.len(),
        applied_text(&loaded.applied)
    );
    if !loaded.left.is_empty() {
        text.push_str(&format!(
            "\nnote: the machine has {} settings that the file does not know; they stay: {}",
            loaded.left.len(),
            loaded.left.join(", ")
        ));
    }
    let data = json!({
        "changed": loaded.changed,
        "left": loaded.left,
        "applied": loaded.applied,
    });
    Ok(Answer::new(text, data))
}

/// Says where a file's settings come from: its name, and the last command that changed them.
fn origin_of(file: &Path, read: &SettingsFile) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str()).display();
    match read.provenance.last() {
        Some(Provenance { command, .. }) => format!("{name} ({command})"),
        None => name.to_string(),
    }
}

pub(super) fn apply(session: &mut Session) -> anyhow::Result<Answer> {
    let client = &mut session.client;
    let mut before = None;
    let outcome = settings::before(client).and_then(|found| {
        before = Some(found);
        settings::apply(client)
    });
    let applied = match outcome {
        Err(error @ ClientError::Interrupted { .. }) => {
            return Err(interrupted(session, before, &error)?);
        }
        outcome => outcome?,
    };
    if !applied.changed.is_empty() {
        session.undo.extend(before);
        session.origin.edited = true;
    }
    Ok(Answer::new(applied_text(&applied), json!(applied)))
}

/// The error of an `apply` that was interrupted, with its outcome: the machine may have applied the draft before its answer was received.
fn interrupted(
    session: &mut Session,
    before: Option<Before>,
    error: &ClientError,
) -> Result<anyhow::Error, ClientError> {
    if !settings::edited(&mut session.client)?.is_empty() {
        return Ok(anyhow!(
            "{error}; the draft does not act: `apply` again, or `revert`"
        ));
    }
    session.undo.extend(before);
    session.origin.edited = true;
    Ok(anyhow!("{error}; the draft acts, and `undo` takes it back"))
}

pub(super) fn undo(session: &mut Session) -> anyhow::Result<Answer> {
    let Some(before) = session.undo.last() else {
        bail!("undo: this session has applied nothing that is not undone");
    };
    let client = &mut session.client;
    let (count, applied) =
        settings::take_back(client, before).context("what acted before cannot act again")?;
    session.undo.pop();
    session.origin.edited = true;
    let text = format!(
        "{count} settings are what they were; {}",
        applied_text(&applied)
    );
    Ok(Answer::new(text, json!(applied)))
}

fn applied_text(applied: &Applied) -> String {
    let axes: Vec<&str> = applied.changed.iter().map(|axis| axis.as_str()).collect();
    match (applied.restart_needed, axes.is_empty()) {
        (true, _) => "the control rate or an encoder changed: nothing acts yet; `disable`, `store` and `reboot`".to_owned(),
        (false, true) => "no axis changed".to_owned(),
        (false, false) => format!("acting now on {}", axes.join(", ")),
    }
}

pub(super) fn draft(client: &mut Client, command: &Command) -> anyhow::Result<Answer> {
    let request = match command {
        Command::Defaults => SettingsRequest::Defaults,
        _ => SettingsRequest::Revert,
    };
    client.order(Body::Settings(request))?;
    Ok(Answer::done())
}

pub(super) fn store(session: &mut Session, provenance: Option<&str>) -> anyhow::Result<Answer> {
    let provenance = match provenance {
        Some(given) => given.to_owned(),
        None => known_origin(session)?,
    };
    settings::store(&mut session.client, &provenance)?;
    Ok(Answer::new(
        format!("kept for the next start: {provenance}"),
        json!("done"),
    ))
}

/// Returns the origin of the settings that act: the file that was loaded, or the origin that was stored before, and whether they were
/// edited since.
fn known_origin(session: &mut Session) -> Result<String, ClientError> {
    let own = format!("quadrant connect {}", env!("CARGO_PKG_VERSION"));
    let before = match &session.origin.loaded {
        Some(loaded) => loaded.clone(),
        None => settings::provenance(&mut session.client)?,
    };
    let edit = format!("; edited by {own}");
    let before = before.strip_suffix(&edit).unwrap_or(&before);
    if before.is_empty() || before == own {
        return Ok(own);
    }
    let edit = if session.origin.edited { &edit } else { "" };
    let room = PROVENANCE_BYTES.saturating_sub(edit.len());
    Ok(format!(
        "{}{edit}",
        &before[..before.floor_char_boundary(room)]
    ))
}

pub(super) fn provenance(client: &mut Client) -> anyhow::Result<Answer> {
    let provenance = settings::provenance(client)?;
    let text = match provenance.as_str() {
        "" => "nothing is stored: the machine starts not commissioned",
        text => text,
    };
    Ok(Answer::new(text, json!(provenance)))
}

#[cfg(test)]
mod tests {
    use quadrant_host::machine::{Machine, SimulatedLink};
    use quadrant_sim::stage_setup::StageSetup;

    use super::*;
    use crate::connect::printer::Printer;

    const PATH: &str = "/axes/0/feedback/pid/kp_v_per_mm";

    /// A session whose draft has another gain.
    fn edited() -> Session {
        let setup = StageSetup::commissioned();
        let mut client = Client::open(SimulatedLink::start(&setup, 1, None).unwrap()).unwrap();
        settings::set(&mut client, PATH, "1.5").unwrap();
        Session::new(client, Printer { json: false })
    }

    fn acting(session: &mut Session) -> f64 {
        session.client.resume();
        let stage = session.client.settings().unwrap();
        stage.axes[0].feedback.pid.kp_v_per_mm
    }

    #[test]
    fn an_apply_that_is_interrupted_before_it_was_sent_leaves_the_settings_and_says_so() {
        let mut session = edited();
        session.client.interrupt().request();
        let error = apply(&mut session).err().unwrap().to_string();
        assert!(error.starts_with("interrupted: "), "{error}");
        assert!(error.contains("the draft does not act"), "{error}");
        assert_ne!(acting(&mut session), 1.5);
        assert!(session.undo.is_empty());
        apply(&mut session).unwrap();
        assert_eq!(acting(&mut session), 1.5);
    }

    #[test]
    fn an_apply_that_is_interrupted_after_it_was_sent_says_that_the_draft_acts_and_is_undone() {
        let mut session = edited();
        let before = settings::before(&mut session.client).unwrap();
        let old = acting(&mut session);
        session.client.interrupt().request();
        let error = settings::apply(&mut session.client).unwrap_err();
        let error = interrupted(&mut session, Some(before), &error).unwrap();
        assert!(error.to_string().contains("the draft acts"), "{error}");
        assert_eq!(acting(&mut session), 1.5);
        undo(&mut session).unwrap();
        assert_eq!(acting(&mut session), old);
    }
}
