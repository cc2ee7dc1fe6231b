//! Figures that are committed, which later runs are held against.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;

use anyhow::{Context, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::command;

/// A file of tables, each under the name of an image.
pub(crate) struct Golden {
    /// Its name in `xtask/golden`.
    pub(crate) file: &'static str,
    /// What its first line says.
    pub(crate) head: &'static str,
}

impl Golden {
    /// All tables; none where there is no file yet.
    pub(crate) fn read<T: DeserializeOwned>(&self) -> Result<BTreeMap<String, T>> {
        let path = self.path();
        match fs::read_to_string(&path) {
            Ok(text) => {
                toml::from_str(&text).with_context(|| format!("{} does not parse", path.display()))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(BTreeMap::new()),
            Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
        }
    }

    /// Writes tables in the place of those of the same names.
    pub(crate) fn store<T: Serialize + DeserializeOwned>(
        &self,
        tables: impl IntoIterator<Item = (String, T)>,
    ) -> Result<()> {
        let mut all = self.read()?;
        all.extend(tables);
        let path = self.path();
        let text = format!("# {}\n\n{}", self.head, toml::to_string(&all)?);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        println!("written to {}", path.display());
        Ok(())
    }

    fn path(&self) -> std::path::PathBuf {
        command::root().join("xtask/golden").join(self.file)
    }
}
