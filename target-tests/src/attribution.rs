//! Attribution of an instruction to a stage, from the image's debug information.

use std::collections::{BTreeSet, HashMap};

use addr2line::Loader;
use anyhow::{Result, anyhow};

use crate::stages;
use xtask::image::Image;

/// Looks up instructions, each once.
pub(crate) struct Attribution {
    loader: Loader,
    known: HashMap<u32, Option<&'static str>>,
}

impl Attribution {
    /// Reads the debug information of an image.
    pub(crate) fn of(image: &Image) -> Result<Self> {
        let loader = Loader::new(&image.path)
            .map_err(|error| anyhow!("cannot read debug information: {error}"))?;
        Ok(Self {
            loader,
            known: HashMap::new(),
        })
    }

    /// The stage of the instruction at an address, if its own frames show it.
    pub(crate) fn stage(&mut self, address: u32) -> Result<Option<&'static str>> {
        if let Some(stage) = self.known.get(&address) {
            return Ok(*stage);
        }
        let stage = self.look_up(address)?;
        self.known.insert(address, stage);
        Ok(stage)
    }

    /// The functions of all instructions that were looked up, inlined ones too.
    pub(crate) fn seen_functions(&self) -> Result<BTreeSet<String>> {
        let mut functions = BTreeSet::new();
        for address in self.known.keys() {
            functions.extend(self.functions(*address)?);
        }
        Ok(functions)
    }

    fn look_up(&self, address: u32) -> Result<Option<&'static str>> {
        let functions = self.functions(address)?;
        Ok(stages::of(functions.iter().rev().map(String::as_str)))
    }

    /// The functions that the instruction at an address was inlined into, innermost first.
    pub(crate) fn functions(&self, address: u32) -> Result<Vec<String>> {
        let unreadable = |error| anyhow!("debug information at {address:#x}: {error}");
        let mut frames = self
            .loader
            .find_frames(address.into())
            .map_err(|error| anyhow!("at {address:#x}: {error}"))?;
        let mut functions = Vec::new();
        while let Some(frame) = frames.next().map_err(unreadable)? {
            if let Some(function) = frame.function {
                functions.push(function.demangle().map_err(unreadable)?.into_owned());
            }
        }
        Ok(functions)
    }
}
