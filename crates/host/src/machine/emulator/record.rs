//! Signals of a simulated stage as the channel's records, and back.

use quadrant_lockstep::InputRecord;
use quadrant_sim::law_machine::TickInput;

/// The inputs of a tick as a record, with converters and times that are well.
pub fn record_of(input: &TickInput) -> InputRecord {
    InputRecord {
        readings: input.readings,
        switches: input.switches,
        link_lost: input.link_lost,
        request: input.request,
        ..InputRecord::default()
    }
}

/// Inputs of a tick, from a record.
pub fn input_of(record: &InputRecord) -> TickInput {
    TickInput {
        readings: record.readings,
        switches: record.switches,
        link_lost: record.link_lost,
        request: record.request,
    }
}
