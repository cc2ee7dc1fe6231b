//! A fixture that runs under the emulator while its trace is read.

use std::process::ChildStderr;

use anyhow::{Context, Result, anyhow};
use quadrant_host::machine::emulator::{Emulator, Memory};
use xtask::image::Image;

use crate::faults::fixture::{Configuration, Fixture};
use crate::trace::Tracer;

/// Runs a fixture while its trace is read.
pub(crate) fn run<T: Send>(
    image: &Image,
    configuration: Configuration,
    start: impl FnOnce(&Memory) -> Result<(Emulator, Tracer)>,
    drive: impl FnOnce(Fixture, &mut Tracer) -> Result<()>,
    read: impl FnOnce(ChildStderr) -> Result<T> + Send,
) -> Result<T> {
    std::thread::scope(|scope| {
        let mut begun = None;
        let fixture = Fixture::start_with(image, configuration, |memory| {
            let (mut emulator, mut tracer) = start(memory)?;
            let lines = emulator.take_stderr().context("QEMU's trace is a pipe")?;
            tracer.run()?;
            begun = Some((tracer, scope.spawn(move || read(lines))));
            Ok(emulator)
        })?;
        let (mut tracer, reader) = begun.context("it was started")?;
        drive(fixture, &mut tracer)?;
        match reader.join() {
            Ok(read) => read,
            Err(_) => Err(anyhow!("the thread that reads the trace panicked")),
        }
    })
}
