//! Axes built here for a board that holds no settings (the lean firmware), and loaded as words.
//!
//! The code that builds them is the firmware's own: [`StageSettings::build_axis`], for the board's number type.

use std::time::Duration;

use quadrant::app::{Axis, fingerprint};
use quadrant::axes::AxisName;
use quadrant::friction::gms::FIRMWARE_ELEMENTS;
use quadrant::law::words::{Window, Words};
use quadrant::link::message::{
    self, AxisSet, BLOCK_WORDS, Body, LinkError, LoadHeader, LoadPart, LoadRequest, LoadStatus,
    NumberType, Reply,
};
use quadrant::scalar::{Fixed, Scalar};
use quadrant::settings::{SettingsError, StageSettings};

use super::error::ClientError;
use super::session::Client;

/// Time in which control takes the last axis, and time between two looks.
const TAKEN: Duration = Duration::from_secs(2);
const LOOK: Duration = Duration::from_millis(2);

/// Reason why axes were not loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The settings are not valid.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The settings are for another control rate.
    #[error("rate_hz = {rate_hz}: this board runs at {board_hz}; set that in the file")]
    Rate {
        /// Control rate of the settings, Hz.
        rate_hz: f64,
        /// That of the board, Hz.
        board_hz: u32,
    },
    /// The board is of another release.
    #[error(
        "the firmware lays its axes out otherwise (fingerprint {board:08x}, of this program {own:08x}): use a program and a firmware \
         of one release"
    )]
    Fingerprint {
        /// Fingerprint of the board.
        board: u32,
        /// Fingerprint of this program.
        own: u32,
    },
    /// The session failed, or the board refused.
    #[error(transparent)]
    Client(#[from] ClientError),
}

/// A part of a set, ready to be sent.
#[derive(Clone, Debug, PartialEq)]
pub struct BuiltPart {
    /// Its head.
    pub header: LoadHeader,
    /// Its words.
    pub words: Vec<u32>,
}

impl BuiltPart {
    /// The requests that load it, in order: the head, then the words in blocks.
    pub fn requests(&self) -> impl Iterator<Item = LoadRequest> + '_ {
        let blocks = self.words.chunks(BLOCK_WORDS).enumerate();
        let words = blocks.map(|(number, chunk)| {
            let mut words = message::Words::new();
            let fits = words.extend(chunk.iter().copied());
            debug_assert!(fits, "a chunk is a block");
            LoadRequest::Words {
                offset: (number * BLOCK_WORDS) as u16,
                words,
            }
        });
        std::iter::once(LoadRequest::Begin(self.header)).chain(words)
    }
}

/// The result of loading.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct LoadedAxes {
    /// Number of the set.
    pub set: u32,
    /// Words of all parts.
    pub words: usize,
    /// Words of the largest axis.
    pub axis_words: usize,
}

/// Returns what the machine takes, if it is one that axes are loaded into.
///
/// # Errors
/// A connection that is broken.
pub fn state(client: &mut Client) -> Result<Option<LoadStatus>, ClientError> {
    match client.request(Body::Load(LoadRequest::State)) {
        Ok(reply) => status(client, &reply).map(Some),
        // One that holds settings of its own, or one that has never heard of it.
        Err(ClientError::Refused {
            source: LinkError::Unsupported(_) | LinkError::Undecodable,
            ..
        }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn status(client: &Client, reply: &Reply) -> Result<LoadStatus, ClientError> {
    match reply {
        Reply::Load(status) => Ok(status.clone()),
        other => Err(client.unexpected("load", other)),
    }
}

/// Builds the axes of a stage for a board, part by part: the machine, x, y and z.
///
/// # Errors
/// Settings that are refused or for another rate, or a board of another release.
pub fn build(stage: &StageSettings, board: &LoadStatus) -> Result<Vec<BuiltPart>, LoadError> {
    stage.validate(FIRMWARE_ELEMENTS)?;
    if stage.rate_hz != f64::from(board.rate_hz) {
        return Err(LoadError::Rate {
            rate_hz: stage.rate_hz,
            board_hz: board.rate_hz,
        });
    }
    match board.number {
        NumberType::F32 => build_as::<f32>(stage, board),
        NumberType::Fixed => build_as::<Fixed>(stage, board),
        NumberType::F64 => build_as::<f64>(stage, board),
    }
}

fn build_as<S: Scalar>(
    stage: &StageSettings,
    board: &LoadStatus,
) -> Result<Vec<BuiltPart>, LoadError> {
    let own = fingerprint::<S>();
    if board.fingerprint != own {
        return Err(LoadError::Fingerprint {
            board: board.fingerprint,
            own,
        });
    }
    let mut parts = vec![(LoadPart::Machine, words_of(&mut stage.machine()))];
    for axis in AxisName::ALL {
        let mut built: Axis<S> = stage.build_axis(axis);
        parts.push((LoadPart::Axis(axis.into()), words_of(&mut built)));
    }
    let header = |part, words: &[u32], set| LoadHeader {
        part,
        fingerprint: own,
        number: board.number,
        rate_hz: board.rate_hz,
        set,
        // An axis has some 1300.
        words: words.len() as u16,
        crc: 0,
    };
    // All words decide the number of the set.
    let mut all = header(LoadPart::Machine, &[], 0).checksum();
    for (_, words) in &parts {
        all.update(words.iter().copied());
    }
    let set = all.value();
    Ok(parts
        .into_iter()
        .map(|(part, words)| {
            let mut header = header(part, &words, set);
            let mut checksum = header.checksum();
            checksum.update(words.iter().copied());
            header.crc = checksum.value();
            BuiltPart { header, words }
        })
        .collect())
}

fn words_of<T: Words>(value: &mut T) -> Vec<u32> {
    let mut words = vec![0; Window::count(value)];
    // Nothing is taken from the words, so nothing is refused.
    let _ = Window::give(&mut words, 0).pass_over(value);
    words
}

/// Builds the axes of a stage and loads them into a board whose outputs are off; `told` is told the share that is there, 0 to 1.
/// With the last axis all of them act.
///
/// # Errors
/// As [`build`]; outputs that are on, or a connection that is broken. The outputs stay off until a whole set is loaded.
pub fn load(
    client: &mut Client,
    stage: &StageSettings,
    board: &LoadStatus,
    mut told: impl FnMut(f64),
) -> Result<LoadedAxes, LoadError> {
    let parts = build(stage, board)?;
    let words: usize = parts.iter().map(|part| part.words.len()).sum();
    let mut sent = 0;
    for part in &parts {
        for request in part.requests() {
            let received = ask(client, request)?.received;
            told((sent + usize::from(received)) as f64 / words as f64);
        }
        sent += part.words.len();
    }
    let set = parts.first().map_or(0, |part| part.header.set);
    let due = client.now() + TAKEN;
    loop {
        let now = ask(client, LoadRequest::State)?;
        if now.set == Some(set) && now.axes == AxisSet::ALL {
            break;
        }
        if client.now() >= due {
            return Err(ClientError::TimedOut {
                what: "load",
                waited_s: TAKEN.as_secs_f64(),
                remedy: "the control law has not taken the axes: disable the outputs, and load again",
            }
            .into());
        }
        client.wait(LOOK)?;
    }
    client.remember_loaded(stage);
    Ok(LoadedAxes {
        set,
        words,
        axis_words: parts.iter().map(|part| part.words.len()).max().unwrap_or(0),
    })
}

fn ask(client: &mut Client, request: LoadRequest) -> Result<LoadStatus, ClientError> {
    let reply = client.request(Body::Load(request))?;
    status(client, &reply)
}
