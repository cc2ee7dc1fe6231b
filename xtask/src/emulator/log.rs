//! The firmware's log: defmt frames, decoded with the strings in the image.

use std::io::Read;

use anyhow::{Context, Result, anyhow};
use defmt_decoder::{DecodeError, Table};

/// Decodes a stream to its end. With `echo` the lines are printed as they come.
pub(super) fn decode(mut stream: impl Read, elf: &[u8], echo: bool) -> Result<Vec<String>> {
    let table = Table::parse(elf)
        .map_err(|error| anyhow!("the image's log strings do not parse: {error}"))?;
    let table = table.context("the image has no log strings")?;
    let mut decoder = table.new_stream_decoder();
    let mut lines = Vec::new();
    let mut buffer = [0; 1024];
    loop {
        let length = stream.read(&mut buffer).context("cannot read the log")?;
        if length == 0 {
            return Ok(lines);
        }
        decoder.received(&buffer[..length]);
        loop {
            let line = match decoder.decode() {
                Ok(frame) => frame.display(false).to_string(),
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) if table.encoding().can_recover() => {
                    "(a damaged line)".to_owned()
                }
                Err(DecodeError::Malformed) => return Err(anyhow!("the log is damaged")),
            };
            if echo {
                println!("  firmware: {line}");
            }
            lines.push(line);
        }
    }
}
