//! For how long the control interrupt can be kept waiting: the longest stretches of instructions with interrupts masked,
//! seen while every tick brings a line for the log.

use std::collections::{BTreeMap, HashMap};
use std::io::Read;

use anyhow::Result;
use quadrant_law::command::Command;

use crate::faults::approach::moving;
use crate::faults::case::configuration;
use crate::faults::fixture::Fixture;
use crate::trace::{self, Tracer, for_each_instruction};
use crate::traced_run;
use xtask::image::Image;
use xtask::listing::Listing;

/// Ticks that are traced.
const TICKS: u32 = 200;
/// Function that is not traced: initialisation and the idle loop, which masks nothing once ticks are due.
const IDLE: &str = "main";

/// Effect of an instruction on the interrupt mask.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Effect {
    Mask,
    Restore,
    Unmask,
}

/// The longest stretch with interrupts masked, by the function that it is spent in.
pub(crate) fn longest(image: &Image) -> Result<BTreeMap<String, u32>> {
    let listing = Listing::of(image)?;
    let idle = image.function(IDLE)?;
    let ranges: Vec<String> = listing
        .functions()
        .filter(|function| function.range.start != idle)
        .map(|function| {
            let range = &function.range;
            format!("{:#x}..{:#x}", range.start, range.end - 1)
        })
        .collect();
    traced_run::run(
        image,
        configuration(),
        |memory| trace::start(image, memory, &ranges.join(",")),
        drive,
        |lines| Stretches::of(&listing).read(lines),
    )
}

/// A motion with a refused request in every tick, traced from then on.
fn drive(mut fixture: Fixture, tracer: &mut Tracer) -> Result<()> {
    moving(&mut fixture, 1.0)?;
    fixture.inject(Box::new(|input, _, _| input.request = Some(Command::Run)));
    fixture.run(100)?;
    tracer.trace()?;
    fixture.run(TICKS)?;
    fixture.end().map(drop)
}

/// Follows a trace.
struct Stretches<'a> {
    listing: &'a Listing,
    effects: HashMap<u32, Effect>,
    depth: u32,
    length: u32,
    /// The function in which the stretch is spent: the first that is no helper.
    place: Option<&'a str>,
    longest: BTreeMap<String, u32>,
}

impl<'a> Stretches<'a> {
    fn of(listing: &'a Listing) -> Self {
        let instructions = listing
            .functions()
            .flat_map(|function| &function.instructions);
        let effects = instructions
            .filter_map(|instruction| {
                let effect = match (&*instruction.mnemonic, &*instruction.operands) {
                    ("cpsid", "i") => Effect::Mask,
                    ("cpsie", "i") => Effect::Unmask,
                    ("msr", operands) if operands.starts_with("PRIMASK") => Effect::Restore,
                    _ => return None,
                };
                Some((instruction.address, effect))
            })
            .collect();
        Self {
            listing,
            effects,
            depth: 0,
            length: 0,
            place: None,
            longest: BTreeMap::new(),
        }
    }

    fn read(mut self, trace: impl Read) -> Result<BTreeMap<String, u32>> {
        for_each_instruction(trace, |address| {
            self.executed(address);
            Ok(())
        })?;
        Ok(self.longest)
    }

    fn executed(&mut self, address: u32) {
        let effect = self.effects.get(&address).copied();
        if self.depth > 0 {
            self.length += 1;
            if self.place.is_none() {
                let function = self.listing.at(address);
                self.place = function
                    .map(|function| function.name.as_str())
                    .filter(|name| !name.contains("critical_section"));
            }
        }
        match effect {
            Some(Effect::Mask) => {
                if self.depth == 0 {
                    (self.length, self.place) = (0, None);
                }
                self.depth += 1;
            }
            Some(Effect::Restore) => self.leave(self.depth.saturating_sub(1)),
            Some(Effect::Unmask) => self.leave(0),
            None => {}
        }
    }

    fn leave(&mut self, depth: u32) {
        if self.depth > 0 && depth == 0 {
            let place = self.place.unwrap_or("?").to_owned();
            let longest = self.longest.entry(place).or_default();
            *longest = self.length.max(*longest);
        }
        self.depth = depth;
    }
}
