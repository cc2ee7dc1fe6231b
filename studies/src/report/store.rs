//! Parts that are kept between reports, one file each.

use std::fs;
use std::hash::{DefaultHasher, Hasher};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::Context as _;
use quadrant_report::Section;
use quadrant_written::whole;
use serde::{Deserialize, Serialize};

use crate::report::Context;

/// Form of the files.
const FORM: u32 = 1;

/// Everything that a part's sections follow from. Texts are kept whole, so that no two inputs pass for one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Key {
    form: u32,
    version: String,
    /// Of the program itself: between two versions it changes too.
    build: u64,
    part: String,
    seed: u64,
    seeds: u64,
    settings_path: Option<PathBuf>,
    settings: String,
}

impl Key {
    pub(super) fn new(part: &str, context: &Context) -> anyhow::Result<Self> {
        Ok(Self {
            form: FORM,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            build: build()?,
            part: part.to_owned(),
            seed: context.seed,
            seeds: context.seeds,
            settings_path: context.settings_path.clone(),
            settings: toml::to_string(&context.settings)?,
        })
    }

    /// Returns the first field of another key that differs.
    fn difference(&self, other: &Self) -> Option<&'static str> {
        let differs = [
            ("another form of this file", self.form != other.form),
            (
                "another version of this program",
                self.version != other.version,
            ),
            ("another build of this program", self.build != other.build),
            ("another part", self.part != other.part),
            ("another seed", self.seed != other.seed),
            ("another number of seeds", self.seeds != other.seeds),
            (
                "other settings",
                self.settings != other.settings || self.settings_path != other.settings_path,
            ),
        ];
        differs
            .into_iter()
            .find_map(|(what, differs)| differs.then_some(what))
    }
}

/// A number that another build of this program does not share.
fn build() -> anyhow::Result<u64> {
    static BUILD: OnceLock<u64> = OnceLock::new();
    if let Some(build) = BUILD.get() {
        return Ok(*build);
    }
    let program = std::env::current_exe().context("cannot find this program's own file")?;
    let bytes = fs::read(&program)
        .with_context(|| format!("cannot read {}, this program itself", program.display()))?;
    let mut hasher = DefaultHasher::new();
    hasher.write(&bytes);
    Ok(*BUILD.get_or_init(|| hasher.finish()))
}

#[derive(Serialize)]
struct Written<'a> {
    key: &'a Key,
    sections: &'a [Section],
}

#[derive(Deserialize)]
struct Read {
    key: Key,
    sections: Vec<Section>,
}

/// Content of a part's file.
pub(super) enum Stored {
    Missing,
    Sections(Vec<Section>),
    /// Nothing of use; the reason names the file.
    Unusable(String),
}

/// A folder of parts.
pub(super) struct Store {
    folder: PathBuf,
}

impl Store {
    pub(super) fn new(folder: &Path) -> anyhow::Result<Self> {
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        Ok(Self {
            folder: folder.to_owned(),
        })
    }

    pub(super) fn path(&self, part: &str) -> PathBuf {
        self.folder.join(format!("{part}.json"))
    }

    pub(super) fn read(&self, part: &str, key: &Key) -> Stored {
        let path = self.path(part);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Stored::Missing,
            Err(error) => return Stored::Unusable(format!("{}: {error}", path.display())),
        };
        match serde_json::from_str::<Read>(&text) {
            Err(error) => Stored::Unusable(format!("{} holds no part: {error}", path.display())),
            Ok(read) => match key.difference(&read.key) {
                None => Stored::Sections(read.sections),
                Some(what) => Stored::Unusable(format!("{} is of {what}", path.display())),
            },
        }
    }

    /// Writes a part's file, whole or not at all.
    pub(super) fn write(&self, part: &str, key: &Key, sections: &[Section]) -> anyhow::Result<()> {
        let path = self.path(part);
        let text = serde_json::to_string(&Written { key, sections })?;
        whole::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    }
}
