//! The machine's settings: leaf by leaf, and as a file.

use heapless::String as Bounded;
use quadrant_link::message::{Applied, Body, Reply, SettingsRequest, Value as LeafValue};
use quadrant_settings::StageSettings;
use quadrant_settings::tree::{expand, is_part};
use quadrant_sim::setting_value::{self, short};
use serde::Serialize;
use serde_json::Value;

use super::error::ClientError;
use super::session::Client;

/// The whole path of what a person may write: `x/limits/max_velocity_mm_s` for `/axes/0/limits/max_velocity_mm_s`. What is
/// longer than any path stays as it is.
pub fn whole_path(path: &str) -> String {
    expand(path).map_or_else(|| path.to_owned(), |path| path.as_str().to_owned())
}

/// The value of a leaf in the machine's draft, or whether a part that may be left out is there.
///
/// # Errors
/// A path that there is not, or a connection that is broken.
pub fn get(client: &mut Client, path: &str) -> Result<Value, ClientError> {
    let value = get_bytes(client, path)?;
    decode(path, &value)
}

/// The bytes of a value as JSON.
fn decode(path: &str, value: &LeafValue) -> Result<Value, ClientError> {
    let json = setting_value::to_json(path, value.kind, &value.bytes).map_err(|source| {
        ClientError::Setting {
            path: short(path),
            source,
        }
    })?;
    Ok(serde_json::from_str(&json).unwrap_or_else(|_| Value::from(json)))
}

fn get_bytes(client: &mut Client, path: &str) -> Result<LeafValue, ClientError> {
    request_value(client, SettingsRequest::Get(bounded("path", path)?))
}

fn request_value(client: &mut Client, request: SettingsRequest) -> Result<LeafValue, ClientError> {
    match client.request(Body::Settings(request))? {
        Reply::Value(value) => Ok(value),
        other => Err(client.unexpected("get", &other)),
    }
}

/// A setting of which one side has another value than the other.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Its path, as it is shown.
    pub path: String,
    /// The value that acts now; none where the settings in force lack the part.
    pub acting: Option<Value>,
    /// The other value: the draft's, or a file's.
    pub other: Option<Value>,
}

/// The settings that `apply` would change: those of the machine's draft that differ from the acting ones.
///
/// # Errors
/// A connection that is broken.
pub fn edited(client: &mut Client) -> Result<Vec<Difference>, ClientError> {
    let paths = paths(client, "edited", |cursor| SettingsRequest::Edited {
        cursor,
    })?;
    let mut differences = Vec::new();
    for path in paths {
        differences.push(Difference {
            acting: acting(client, &path)?,
            other: Some(get(client, &path)?),
            path: short(&path),
        });
    }
    Ok(differences)
}

/// The settings that loading a file would change.
///
/// # Errors
/// A connection that is broken.
pub fn against(client: &mut Client, file: &StageSettings) -> Result<Vec<Difference>, ClientError> {
    let mut paths = Vec::new();
    // A part that the file lacks is a path too: one difference.
    let _ = file.list("", &mut |path| paths.push(path.to_owned()));
    let mut differences = Vec::new();
    for path in paths {
        let Ok((kind, bytes)) = setting_value::of(file, &path) else {
            continue;
        };
        let requested = LeafValue { kind, bytes };
        let acting = acting(client, &path)?;
        let other = decode(&path, &requested)?;
        if acting.as_ref() != Some(&other) {
            differences.push(Difference {
                path: short(&path),
                acting,
                other: Some(other),
            });
        }
    }
    Ok(differences)
}

/// The value that acts at a path, if the settings in force have it.
pub(super) fn acting(client: &mut Client, path: &str) -> Result<Option<Value>, ClientError> {
    acting_bytes(client, path)?
        .map(|value| decode(path, &value))
        .transpose()
}

fn acting_bytes(client: &mut Client, path: &str) -> Result<Option<LeafValue>, ClientError> {
    match request_value(client, SettingsRequest::GetInForce(bounded("path", path)?)) {
        Ok(value) => Ok(Some(value)),
        Err(ClientError::Refused { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Changes a leaf of the machine's draft, makes a part (`"present"`), or leaves it out (`null`). A value that is no JSON is
/// taken for a text: `n-pid` for `"n-pid"`.
///
/// # Errors
/// A path that there is not, a value of another type, or a connection that is broken.
pub fn set(client: &mut Client, path: &str, value: &str) -> Result<(), ClientError> {
    let json = match serde_json::from_str::<Value>(value) {
        Ok(_) => value.to_owned(),
        Err(_) => Value::from(value).to_string(),
    };
    let (kind, bytes) =
        setting_value::from_json(path, &json).map_err(|source| ClientError::Setting {
            path: format!("{} = {json}", short(path)),
            source,
        })?;
    set_bytes(client, path, LeafValue { kind, bytes })
}

fn set_bytes(client: &mut Client, path: &str, value: LeafValue) -> Result<(), ClientError> {
    let path = bounded("path", path)?;
    client.order(Body::Settings(SettingsRequest::Set { path, value }))
}

/// The paths of the machine's draft that begin with `prefix`.
///
/// # Errors
/// A connection that is broken.
pub fn list(client: &mut Client, prefix: &str) -> Result<Vec<String>, ClientError> {
    let mut paths = paths(client, "list", |cursor| SettingsRequest::List { cursor })?;
    paths.retain(|path| path.starts_with(prefix));
    Ok(paths)
}

/// All paths of a request that is answered page by page.
fn paths(
    client: &mut Client,
    name: &'static str,
    page_from: impl Fn(u16) -> SettingsRequest,
) -> Result<Vec<String>, ClientError> {
    let mut paths = Vec::new();
    let mut cursor = 0;
    loop {
        match client.request(Body::Settings(page_from(cursor)))? {
            Reply::Paths(page) => {
                paths.extend(page.paths.iter().map(|path| path.as_str().to_owned()));
                match page.next {
                    Some(next) if next > cursor => cursor = next,
                    _ => return Ok(paths),
                }
            }
            other => return Err(client.unexpected(name, &other)),
        }
    }
}

/// Lets the draft act, checked as a whole.
///
/// # Errors
/// The first value that the machine refuses, or a connection that is broken.
pub fn apply(client: &mut Client) -> Result<Applied, ClientError> {
    match client.request(Body::Settings(SettingsRequest::Apply))? {
        Reply::Applied(applied) => Ok(applied),
        other => Err(client.unexpected("apply", &other)),
    }
}

/// Stores the draft for the next start, with its origin.
///
/// # Errors
/// A memory that failed, or a connection that is broken.
pub fn store(client: &mut Client, provenance: &str) -> Result<(), ClientError> {
    let request = SettingsRequest::Store(bounded("provenance", provenance)?);
    client.order(Body::Settings(request))
}

/// Reads the origin of the stored settings.
///
/// # Errors
/// A connection that is broken.
pub fn provenance(client: &mut Client) -> Result<String, ClientError> {
    match client.request(Body::Settings(SettingsRequest::Provenance))? {
        Reply::Provenance(provenance) => Ok(provenance.as_str().to_owned()),
        other => Err(client.unexpected("provenance", &other)),
    }
}

/// The length of a count of each axis, as it acts, mm.
///
/// # Errors
/// A connection that is broken.
pub fn resolutions_mm(client: &mut Client) -> Result<[f64; 3], ClientError> {
    let mut resolutions = [0.0; 3];
    for (axis, resolution) in resolutions.iter_mut().enumerate() {
        let path = format!("/axes/{axis}/encoder/resolution_mm");
        let request = SettingsRequest::GetInForce(bounded("path", &path)?);
        let value = decode(&path, &request_value(client, request)?)?;
        *resolution = value.as_f64().unwrap_or(f64::NAN);
    }
    Ok(resolutions)
}

/// Error of loading a file's settings.
#[derive(Debug, thiserror::Error)]
pub enum ExchangeError {
    /// The link, or a value that the machine refuses.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The machine lacks settings that the file has.
    #[error(
        "the machine has no setting {path}, which the file has; use host tools and firmware of one release"
    )]
    Unknown {
        /// The first of them.
        path: String,
    },
    /// The machine refuses the whole, or a leaf; its draft equals the settings in force again.
    #[error("{0}; nothing was changed")]
    Reverted(ClientError),
}

/// Reads all settings of the machine's draft.
///
/// # Errors
/// A connection that is broken, or a machine of a later release.
pub fn dump(client: &mut Client) -> Result<StageSettings, ClientError> {
    let mut settings = StageSettings::simulated();
    // In the machine's order a part comes before its leaves.
    for path in list(client, "")? {
        let LeafValue { kind, bytes } = get_bytes(client, &path)?;
        settings
            .set_bytes(&path, kind, &bytes)
            .map_err(|source| ClientError::Setting {
                path: short(&path),
                source,
            })?;
    }
    Ok(settings)
}

/// Reads all settings in force; the draft does not matter.
///
/// # Errors
/// As [`dump`].
pub fn in_force(client: &mut Client) -> Result<StageSettings, ClientError> {
    let mut settings = StageSettings::simulated();
    let drafted = list(client, "")?;
    take_acting(client, &drafted, &mut settings)?;
    // Leaves of parts that act and that the draft leaves out.
    let mut others = Vec::new();
    let _ = settings.list("", &mut |path| {
        if !drafted.iter().any(|known| known == path) {
            others.push(path.to_owned());
        }
    });
    take_acting(client, &others, &mut settings)?;
    Ok(settings)
}

/// Reads the settings in force at paths; a leaf of a part that does not act is left out.
fn take_acting(
    client: &mut Client,
    paths: &[String],
    settings: &mut StageSettings,
) -> Result<(), ClientError> {
    for path in paths {
        let Some(LeafValue { kind, bytes }) = acting_bytes(client, path)? else {
            continue;
        };
        settings
            .set_bytes(path, kind, &bytes)
            .map_err(|source| ClientError::Setting {
                path: short(path),
                source,
            })?;
    }
    Ok(())
}

/// Refuses to go on while the draft differs from the settings in force: what follows would write over it.
///
/// # Errors
/// The settings that are edited, or a connection that is broken.
pub(super) fn refuse_edited(client: &mut Client) -> Result<(), ClientError> {
    let edited = paths(client, "edited", |cursor| SettingsRequest::Edited {
        cursor,
    })?;
    let Some(first) = edited.first() else {
        return Ok(());
    };
    let more = match edited.len() - 1 {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Err(ClientError::Edited {
        paths: format!("{}{more}", short(first)),
    })
}

/// Result of loading settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The paths whose values changed.
    pub changed: Vec<String>,
    /// Settings of the machine, of a later release, that the file does not know; they stay as they are.
    pub left: Vec<String>,
    /// Reply of the machine.
    pub applied: Applied,
}

/// Writes all settings to the machine's draft, only those that differ, and lets them act as a whole. If the machine
/// refuses one of them, or the whole, its draft is reverted.
///
/// # Errors
/// A setting that the machine refuses, or a connection that is broken.
pub fn load(client: &mut Client, settings: &StageSettings) -> Result<Loaded, ExchangeError> {
    let (loaded, ()) = exchange(client, settings, |_| Ok(()))?;
    Ok(loaded)
}

/// The same, with what acted before.
///
/// # Errors
/// As [`load`].
pub fn load_undoably(
    client: &mut Client,
    settings: &StageSettings,
) -> Result<(Loaded, Before), ExchangeError> {
    exchange(client, settings, before)
}

/// Writes the requested settings into the draft, calls `look`, and applies the draft.
fn exchange<T>(
    client: &mut Client,
    settings: &StageSettings,
    look: impl FnOnce(&mut Client) -> Result<T, ClientError>,
) -> Result<(Loaded, T), ExchangeError> {
    let outcome = write_draft(client, settings).and_then(|(changed, left)| {
        let seen = look(client)?;
        let applied = apply(client)?;
        let loaded = Loaded {
            changed,
            left,
            applied,
        };
        Ok((loaded, seen))
    });
    or_reverted(client, outcome)
}

/// Resets the draft to the settings in force where the machine has refused what is in it.
fn or_reverted<T>(
    client: &mut Client,
    outcome: Result<T, ExchangeError>,
) -> Result<T, ExchangeError> {
    match outcome {
        Err(ExchangeError::Client(error @ ClientError::Refused { .. })) => {
            client.order(Body::Settings(SettingsRequest::Revert))?;
            Err(ExchangeError::Reverted(error))
        }
        Err(error @ ExchangeError::Unknown { .. }) => {
            client.order(Body::Settings(SettingsRequest::Revert))?;
            Err(error)
        }
        other => other,
    }
}

/// The settings that acted before others were applied: paths and values, parts before their leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Before(Vec<(String, Value)>);

/// Reads the settings in force wherever the draft differs.
///
/// # Errors
/// A connection that is broken.
pub fn before(client: &mut Client) -> Result<Before, ClientError> {
    let edited = paths(client, "edited", |cursor| SettingsRequest::Edited {
        cursor,
    })?;
    let mut values = Vec::new();
    for path in edited {
        // Leaves of a part that does not act go with it.
        let Some(value) = acting(client, &path)? else {
            continue;
        };
        let removed = is_part(&path) && !value.is_null();
        values.push((path.clone(), value));
        if removed {
            for leaf in leaves_of(&path) {
                values.extend(acting(client, &leaf)?.map(|value| (leaf, value)));
            }
        }
    }
    values.sort_by_key(|(path, _)| !is_part(path));
    Ok(Before(values))
}

/// The paths of what a part has.
fn leaves_of(part: &str) -> Vec<String> {
    let mut settings = StageSettings::simulated();
    // Every part can be made.
    let made = settings.set_json(part, b"\"present\"");
    debug_assert!(made.is_ok());
    let mut leaves = Vec::new();
    let _ = settings.list(part, &mut |path| {
        if path.len() > part.len() {
            leaves.push(path.to_owned());
        }
    });
    leaves
}

/// Lets what acted before act again, as a whole; gives the number of settings, and what was applied. Edits that do not act are
/// forgotten.
///
/// # Errors
/// A value that the machine refuses by now, or a connection that is broken.
pub fn take_back(client: &mut Client, before: &Before) -> Result<(usize, Applied), ExchangeError> {
    client.order(Body::Settings(SettingsRequest::Revert))?;
    let write = |client: &mut Client| {
        for (path, value) in &before.0 {
            set(client, path, &value.to_string())?;
        }
        apply(client)
    };
    let outcome = write(client).map_err(ExchangeError::from);
    or_reverted(client, outcome).map(|applied| (before.0.len(), applied))
}

/// Makes the draft equal to `requested`; gives the paths that changed, and those that are not in it.
fn write_draft(
    client: &mut Client,
    requested: &StageSettings,
) -> Result<(Vec<String>, Vec<String>), ExchangeError> {
    let mut changed = Vec::new();
    // First the parts that may be left out: they bring leaves, or take them away.
    let (parts, _) = list(client, "")?
        .into_iter()
        .partition(|path| is_part(path));
    let parts: Vec<String> = parts;
    for path in &parts {
        change(client, path, requested, &mut changed)?;
    }
    let paths = list(client, "")?;
    let mut left = Vec::new();
    for path in paths.iter().filter(|path| !is_part(path)) {
        if !change(client, path, requested, &mut changed)? {
            left.push(short(path));
        }
    }
    let mut unknown = None;
    let _ = requested.list("", &mut |path| {
        if unknown.is_none() && !paths.iter().any(|known| known == path) {
            unknown = Some(short(path));
        }
    });
    match unknown {
        Some(path) => Err(ExchangeError::Unknown { path }),
        None => Ok((changed, left)),
    }
}

/// Makes one leaf or part equal to `requested`; says whether that is known.
fn change(
    client: &mut Client,
    path: &str,
    requested: &StageSettings,
    changed: &mut Vec<String>,
) -> Result<bool, ClientError> {
    let Ok((kind, bytes)) = setting_value::of(requested, path) else {
        return Ok(false);
    };
    let value = LeafValue { kind, bytes };
    if get_bytes(client, path)? != value {
        set_bytes(client, path, value)?;
        changed.push(short(path));
    }
    Ok(true)
}

fn bounded<const N: usize>(what: &'static str, text: &str) -> Result<Bounded<N>, ClientError> {
    Bounded::try_from(text).map_err(|_| ClientError::TooLong {
        what,
        text: text.to_owned(),
        length: text.len(),
        most: N,
    })
}
