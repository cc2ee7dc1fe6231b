//! Figures that are committed, with which later runs are compared.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;

use anyhow::{Context, Result, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::command;

/// File of the instructions of control ticks.
pub const INSTRUCTIONS: &str = "target-tests/golden/instructions.toml";
/// File of the bounds of their cycles.
pub const CYCLES: &str = "target-tests/golden/cycles.toml";
/// File of the jitter of the output.
pub const JITTER: &str = "target-tests/golden/jitter.toml";
/// File of the packages' lines.
pub const LINES: &str = "xtask/golden/lines.toml";
/// File of the images' sizes.
pub const SIZES: &str = "xtask/golden/sizes.toml";

/// A file of tables, each under the name of an image.
pub struct Golden {
    /// Its path, from the workspace's folder.
    pub path: &'static str,
    /// Its first line.
    pub head: &'static str,
}

/// The content of a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recorded<T> {
    /// The compiler whose images the figures are of; none if they do not depend on it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compiler: Option<String>,
    /// The tables.
    #[serde(flatten)]
    pub tables: BTreeMap<String, T>,
}

impl<T> Recorded<T> {
    /// Returns the table of a name, and what to make of a difference from it.
    pub fn table(mut self, key: &str, compiler: &str) -> Option<(T, Difference)> {
        let difference = match self.compiler {
            Some(recorded) if recorded != compiler => Difference::Printed { recorded },
            _ => Difference::Refused,
        };
        Some((self.tables.remove(key)?, difference))
    }
}

/// The consequence of a figure that differs from the committed one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Difference {
    /// The same compiler made both: an error.
    Refused,
    /// Another compiler made the committed one: worth a line.
    Printed {
        /// That compiler.
        recorded: String,
    },
}

impl Difference {
    /// Returns an error unless `holds`, or prints it where another compiler is at hand.
    ///
    /// # Errors
    /// The text, if the difference is to be refused.
    pub fn ensure(&self, holds: bool, text: impl FnOnce() -> String) -> Result<()> {
        match self {
            Self::Refused => ensure!(holds, "{}", text()),
            Self::Printed { recorded } if !holds => {
                println!(
                    "  not held, as {recorded} made the committed figure: {}",
                    text()
                );
            }
            Self::Printed { .. } => {}
        }
        Ok(())
    }
}

impl Golden {
    /// Reads all tables; none where there is no file yet.
    ///
    /// # Errors
    /// A file that cannot be read or does not parse.
    pub fn read<T: DeserializeOwned>(&self) -> Result<Recorded<T>> {
        let path = command::root().join(self.path);
        match fs::read_to_string(&path) {
            Ok(text) => {
                toml::from_str(&text).with_context(|| format!("{} does not parse", path.display()))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(Recorded {
                compiler: None,
                tables: BTreeMap::new(),
            }),
            Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
        }
    }

    /// Writes tables in the place of those of the same names. A file holds the figures of one compiler: those of another
    /// are dropped.
    ///
    /// # Errors
    /// A file that cannot be read or written.
    pub fn store<T: Serialize + DeserializeOwned>(
        &self,
        compiler: Option<&str>,
        tables: impl IntoIterator<Item = (String, T)>,
    ) -> Result<()> {
        let mut all = self.read()?;
        if all.compiler.as_deref() != compiler {
            if !all.tables.is_empty() {
                println!("the figures of another compiler are dropped: record all of them again");
            }
            all.tables.clear();
            all.compiler = compiler.map(str::to_owned);
        }
        all.tables.extend(tables);
        let text = format!("# {}\n\n{}", self.head, toml::to_string(&all)?);
        let path = command::root().join(self.path);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        println!("written to {}", path.display());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_held_for_the_compiler_they_were_recorded_with_alone() {
        let recorded: Recorded<u32> = toml::from_str("compiler = \"1.96\"\nflash = 7").unwrap();
        let (figure, difference) = recorded.clone().table("flash", "1.96").unwrap();
        assert_eq!(figure, 7);
        assert!(
            difference
                .ensure(false, || "8 instead of 7".into())
                .is_err()
        );
        assert!(difference.ensure(true, String::new).is_ok());
        let (_, difference) = recorded.clone().table("flash", "1.97").unwrap();
        assert!(difference.ensure(false, || "8 instead of 7".into()).is_ok());
        assert!(recorded.table("ram", "1.96").is_none());
    }
}
