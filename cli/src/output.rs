//! Output of the commands: results to the terminal, pages into files.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use quadrant_pages::parts::provenance;
use quadrant_report::{Block, FIGURES, Format, Page, Section, Table};

use crate::{say, terminal};

/// Options that every experiment has.
#[derive(Clone, Debug, Args)]
pub struct Output {
    /// Folder for results; made if it is missing.
    #[arg(long, default_value = Self::FOLDER, value_name = "FOLDER")]
    out: PathBuf,
    /// Seed of the simulated noise; the same seed gives the same results.
    #[arg(long, default_value_t = Self::SEED)]
    pub seed: u64,
    /// Formats of the results; may be given several times.
    #[arg(long, value_enum, default_values_t = Self::FORMATS, value_name = "FORMAT")]
    format: Vec<Format>,
    /// Folder of these results below that of all.
    #[arg(skip)]
    below: PathBuf,
}

impl Output {
    const FOLDER: &str = "quadrant-out";
    const SEED: u64 = 1;
    const FORMATS: [Format; 2] = [Format::Html, Format::Csv];

    /// The same in a folder below.
    #[must_use]
    pub fn below(&self, name: &str) -> Self {
        Self {
            below: self.below.join(name),
            ..self.clone()
        }
    }

    fn folder(&self) -> PathBuf {
        // Joined to nothing, a path would end in a slash.
        self.out
            .components()
            .chain(self.below.components())
            .collect()
    }

    /// The path of a file in the folder, which is made.
    ///
    /// # Errors
    /// A folder that cannot be made; a link that leads out of the folder for results.
    pub fn file(&self, name: &str) -> anyhow::Result<PathBuf> {
        let folder = self.folder();
        std::fs::create_dir_all(&self.out)
            .with_context(|| format!("cannot make the folder {}", self.out.display()))?;
        let path = folder.join(name);
        let mut on_the_way: Vec<&Path> =
            path.ancestors().take_while(|it| *it != self.out).collect();
        on_the_way.reverse();
        for path in on_the_way {
            self.refuse_link_out(path)?;
        }
        std::fs::create_dir_all(&folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        Ok(path)
    }

    /// Refuses a link that leads out of the folder for results: what is written into that one stays in it.
    fn refuse_link_out(&self, path: &Path) -> anyhow::Result<()> {
        if !path.is_symlink() {
            return Ok(());
        }
        let inside = self.out.canonicalize()?;
        // One that leads nowhere may lead there once it is written to.
        if path.canonicalize().is_ok_and(|to| to.starts_with(inside)) {
            return Ok(());
        }
        bail!(
            "{} is a link out of {}, and nothing is written through it: remove it, or give another --out",
            path.display(),
            self.out.display()
        )
    }

    /// Makes the folder, and finds out whether it can be written to: before anything is measured or computed.
    ///
    /// # Errors
    /// A folder that cannot be made or written to, or that a link leads out of the folder for results.
    pub fn ready(&self) -> anyhow::Result<()> {
        let folder = self.file(FIGURES)?;
        let folder = folder.parent().unwrap_or(&self.out);
        tempfile::tempfile_in(folder)
            .with_context(|| format!("cannot write to the folder {}", folder.display()))?;
        Ok(())
    }

    /// Keeps other commands that do the same from the folder until the result is dropped; none where the system locks no folders.
    ///
    /// # Errors
    /// Another command that has it.
    pub fn hold(&self) -> anyhow::Result<Option<File>> {
        let folder = self.folder();
        let Ok(held) = File::open(&folder) else {
            return Ok(None);
        };
        match held.try_lock() {
            Err(TryLockError::WouldBlock) => bail!(
                "another command measures into {}: wait until it has ended, or give another --out",
                folder.display()
            ),
            outcome => Ok(outcome.ok().map(|()| held)),
        }
    }

    /// Writes a table where CSV is requested, and prints it.
    pub fn table(&self, table: &Table) -> anyhow::Result<()> {
        self.keep_table(table)?;
        say!("{}", table.to_text(terminal::output_width()));
        Ok(())
    }

    /// Writes a table where CSV is requested.
    pub fn keep_table(&self, table: &Table) -> anyhow::Result<()> {
        if self.format.contains(&Format::Csv) {
            table.write_csv(&self.file(&format!("{}.csv", table.id))?)?;
        }
        Ok(())
    }

    /// Writes a page in the requested formats, under the stem of `name`.
    pub fn page(&self, page: &Page, name: &str) -> anyhow::Result<()> {
        for line in self.keep_page(page, name)? {
            say!("{line}");
        }
        Ok(())
    }

    /// The same, and says where it is instead of printing it.
    pub fn keep_page(&self, page: &Page, name: &str) -> anyhow::Result<Vec<String>> {
        let stem = name.strip_suffix(".html").unwrap_or(name);
        self.file(FIGURES)?;
        let folder = self.folder();
        page.write(&folder, stem, &self.format)?;
        let folder = folder.display();
        let line = |format: &Format| match format {
            Format::Html => format!("{folder}/{stem}.html: open it in a browser"),
            Format::Json => format!("{folder}/{stem}.json: the page as data"),
            Format::Csv => format!("{folder}/*.csv: its tables, and in figures/ its curves"),
            Format::Svg => format!("{folder}/figures/*.svg: its figures, for print"),
        };
        Ok(self.format.iter().map(line).collect())
    }

    /// Prints tables and writes a page of nothing else.
    pub fn tables(
        &self,
        title: &str,
        subtitle: &str,
        tables: Vec<Table>,
        name: &str,
    ) -> anyhow::Result<()> {
        for table in &tables {
            self.table(table)?;
        }
        let section = Section {
            id: "results".to_owned(),
            heading: "Results".to_owned(),
            provenance: None,
            prose: vec![],
            blocks: tables.into_iter().map(Block::Table).collect(),
        };
        self.section(title, subtitle, section, name)
    }

    /// Writes a page of one section.
    pub fn section(
        &self,
        title: &str,
        subtitle: &str,
        section: Section,
        name: &str,
    ) -> anyhow::Result<()> {
        let page = Page {
            title: title.to_owned(),
            subtitle: subtitle.to_owned(),
            provenance: provenance(&command_line(), self.seed),
            sections: vec![section],
        };
        self.page(&page, name)
    }
}

/// A progress bar over a share of 0 to 1, in thousandths; hidden where nobody watches.
pub fn share(what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent} %, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(1000).with_style(style).with_message(what)
}

/// Runs `work` under a progress bar; what it is given takes the share that is done, 0 to 1.
pub fn with_bar<T>(message: &'static str, work: impl FnOnce(&mut dyn FnMut(f64)) -> T) -> T {
    let bar = share(message);
    let done = work(&mut |done| bar.set_position((1000.0 * done) as u64));
    bar.finish_and_clear();
    done
}

/// A progress bar over `runs`; hidden where nobody watches.
pub fn progress(runs: u64, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} runs, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(runs).with_style(style).with_message(what)
}

/// A word of a command as a shell takes it.
pub fn quoted(word: &str) -> String {
    let plain = |sign: char| sign.is_alphanumeric() || "_./:=,+-@%".contains(sign);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// The command line as it was given, but for the folder and the formats of the results: what a reader repeats.
pub fn command_line() -> String {
    const LEFT_OUT: [&str; 2] = ["--out", "--format"];
    let mut given = std::env::args();
    let program = given.next().unwrap_or_default();
    let program = Path::new(&program).file_stem().unwrap_or_default();
    let mut words = vec![program.to_string_lossy().into_owned()];
    while let Some(word) = given.next() {
        let name = word.split('=').next().unwrap_or_default();
        if !LEFT_OUT.contains(&name) {
            words.push(quoted(&word));
        } else if word == name {
            given.next();
        }
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn a_word_that_a_shell_would_take_apart_is_quoted() {
        for plain in ["--travel", "-3..20", "a/b_1.toml", "x=1:um,y=2", "ü.toml"] {
            assert_eq!(quoted(plain), plain);
        }
        assert_eq!(quoted("my stage.toml"), "'my stage.toml'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
