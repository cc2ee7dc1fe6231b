//! Axes that a host has built: a board without settings takes them as words, checks them whole, and hands them to control.
//!
//! ```text
//!   Begin(machine)  control locks the outputs off, or refuses: they are on
//!   Words ...       into the machine to come
//!   Begin(x)        Words ... into the back buffer, CRC, handed over; y and z alike
//!   all taken       the machine is in force, control unlocks
//! ```
//!
//! Nothing of a part acts before its last word is there and its CRC agrees. From the machine's head to the last axis the outputs
//! stay off, as they do from the start of the board on; a set that is broken off leaves them off.

use super::deferred::Work;
use super::maintenance::outputs_on;
use super::{AxisSource, Server, busy, invalid, refused};
use crate::app::Axis;
use crate::app::queues::{AxisSwap, Order};
use crate::law::admission::{Lock, Refusal};
use crate::law::axes::AxisName;
use crate::law::scalar::Scalar;
use crate::law::words::{Window, Words, with_layout};
use crate::settings::{Machine, StageBounds};
use quadrant_link::message::{
    self, AxisSet, BLOCK_WORDS, Checksum, Event, LinkError, LoadHeader, LoadPart, LoadRequest,
    LoadStatus, NumberType, Reply, SettingsRequest,
};

/// Layout of the words that a board of number type `S` takes.
pub const fn fingerprint<S: Scalar>() -> u32 {
    with_layout(Axis::<S>::LAYOUT, Machine::LAYOUT)
}

/// Axes that a host has built.
pub struct HostAxes {
    rate_hz: u32,
    /// The machine in force.
    machine: Machine,
    /// That of the set under way.
    next: Machine,
    /// The part under way, or the last one.
    part: Option<Receiving>,
    /// The set under way, or the one in force.
    set: Option<u32>,
    /// The machine of the set is whole.
    machine_is_whole: bool,
    /// Axes of the set that were handed to control.
    handed: AxisSet,
    /// Control has all of them, and the machine is in force.
    in_force: bool,
    /// A set has been in force since the start.
    ever: bool,
}

/// A part that is being received.
struct Receiving {
    header: LoadHeader,
    received: u16,
    checksum: Checksum,
}

impl HostAxes {
    /// Returns the source of a board that runs at `rate_hz`, before anything is loaded.
    pub fn new(rate_hz: u32) -> Self {
        Self {
            rate_hz,
            machine: Machine::BLANK,
            next: Machine::BLANK,
            part: None,
            set: None,
            machine_is_whole: false,
            handed: AxisSet::NONE,
            in_force: false,
            ever: false,
        }
    }

    /// Checks that the machine received fits this board and what was loaded before.
    fn check_machine(&self) -> Result<(), LinkError> {
        let (next, before) = (&self.next.bounds, &self.machine.bounds);
        if next.rate_hz != f64::from(self.rate_hz) {
            return Err(other_rate(self.rate_hz));
        }
        for axis in AxisName::ALL {
            let encoder = &next.axes[axis].encoder;
            if !(encoder.resolution_mm > 0.0 && encoder.resolution_mm <= 1.0) {
                return Err(invalid(format_args!(
                    "{axis}.encoder.resolution_mm is outside 0 (exclusive) to 1"
                )));
            }
            // Its counts are those of the other one, homed or not.
            if self.ever && *encoder != before.axes[axis].encoder {
                return Err(refused(format_args!(
                    "{axis}.encoder changes only with a restart: `reboot`, then load"
                )));
            }
        }
        Ok(())
    }

    fn status(&self, number: NumberType, fingerprint: u32, taken: AxisSet) -> Reply {
        Reply::Load(LoadStatus {
            fingerprint,
            number,
            rate_hz: self.rate_hz,
            part: self.part.as_ref().map(|part| part.header.part),
            received: self.part.as_ref().map_or(0, |part| part.received),
            set: self.set,
            axes: taken,
        })
    }
}

impl<'a, S: Scalar> AxisSource<'a, S> for HostAxes {
    fn rate_hz(&self) -> f64 {
        self.rate_hz.into()
    }

    fn bounds(&self) -> StageBounds {
        self.machine.bounds
    }

    fn refusal(&self) -> Option<Refusal> {
        (!self.in_force).then_some(Refusal::NotLoaded)
    }

    fn serve_settings(
        _server: &mut Server<'_, 'a, S, Self>,
        _request: SettingsRequest,
    ) -> Result<Reply, LinkError> {
        Err(refused(format_args!(
            "this firmware holds no settings: change the file, and load it with `quadrant connect load FILE`"
        )))
    }

    fn serve_load(
        server: &mut Server<'_, 'a, S, Self>,
        request: LoadRequest,
    ) -> Result<Reply, LinkError> {
        match request {
            LoadRequest::State => Ok(server.load_status()),
            LoadRequest::Begin(header) => server.begin_part(header),
            LoadRequest::Words { offset, words } => server.take_words(offset, &words),
        }
    }

    fn begin_load(
        server: &mut Server<'_, 'a, S, Self>,
        header: LoadHeader,
    ) -> Result<Reply, LinkError> {
        let source = &mut server.source;
        source.set = Some(header.set);
        source.machine_is_whole = false;
        source.handed = AxisSet::NONE;
        source.in_force = false;
        server.receive(header);
        Ok(server.load_status())
    }

    fn exchange(server: &mut Server<'_, 'a, S, Self>) {
        if server.back_buffer.is_none() {
            server.back_buffer = server.ends.back_buffers.dequeue();
        }
        let waits = server.source.handed == AxisSet::ALL && !server.source.in_force;
        // It is back: control has taken the last one.
        if waits && server.back_buffer.is_some() {
            let unlock = Order::Unlock {
                reason: Lock::Loading,
                stored: false,
            };
            if server.order(unlock).is_ok() {
                server.source.machine = server.source.next;
                server.source.in_force = true;
                server.source.ever = true;
                server.applied = server.applied.wrapping_add(1);
                server.push_event(server.seen.tick, Event::SettingsApplied(AxisSet::ALL));
            }
        }
    }
}

impl<'a, S: Scalar> Server<'_, 'a, S, HostAxes> {
    fn load_status(&self) -> Reply {
        let source = &self.source;
        let taken = if source.in_force {
            AxisSet::ALL
        } else if self.back_buffer.is_some() {
            source.handed
        } else {
            AxisSet::NONE
        };
        source.status(self.number, fingerprint::<S>(), taken)
    }

    fn begin_part(&mut self, header: LoadHeader) -> Result<Reply, LinkError> {
        if header.fingerprint != fingerprint::<S>() {
            return Err(invalid(format_args!(
                "fingerprint: the axes are of another release than this firmware; build both from the same source"
            )));
        }
        if header.number != self.number {
            return Err(invalid(format_args!(
                "number: the axes are built for another number type than this firmware's"
            )));
        }
        if header.rate_hz != self.source.rate_hz {
            return Err(other_rate(self.source.rate_hz));
        }
        if header.part == LoadPart::Machine {
            // Told early; control decides.
            if self.seen.view.safety.drives() {
                return Err(outputs_on());
            }
            if let Some(axis) = self.seen.view.moving {
                return Err(refused(format_args!(
                    "{axis}: {}",
                    Refusal::NotAtStandstill(axis).as_str()
                )));
            }
            return self.defer(Work::Load(header));
        }
        let source = &self.source;
        if source.set != Some(header.set) || !source.machine_is_whole {
            return Err(refused(format_args!(
                "the machine of this set is not loaded; begin with it"
            )));
        }
        if source.in_force {
            return Err(refused(format_args!(
                "this set is in force already; begin another with its machine"
            )));
        }
        self.receive(header);
        Ok(self.load_status())
    }

    fn receive(&mut self, header: LoadHeader) {
        self.source.part = Some(Receiving {
            header,
            received: 0,
            checksum: header.checksum(),
        });
    }

    /// Takes words unless they are known; with the last one the part is complete.
    #[inline(never)]
    fn take_words(&mut self, offset: u16, words: &message::Words) -> Result<Reply, LinkError> {
        let Some(part) = &mut self.source.part else {
            return Err(refused(format_args!(
                "no part is under way; begin one first"
            )));
        };
        let (received, most) = (part.received, part.header.words);
        let Some(known) = received.checked_sub(offset) else {
            return Err(invalid(format_args!(
                "offset = {offset}: the words from {received} on are missing; send them first"
            )));
        };
        let mut buffer = [0; BLOCK_WORDS];
        let mut count = 0;
        for (place, word) in buffer.iter_mut().zip(words.iter().skip(known.into())) {
            *place = word;
            count += 1;
        }
        let Some(fresh) = buffer.get_mut(..count).filter(|fresh| !fresh.is_empty()) else {
            return Ok(self.load_status());
        };
        if usize::from(received) + count > usize::from(most) {
            return Err(invalid(format_args!("words: the part has {most} of them")));
        }
        let first = usize::from(received);
        let checked = fresh.iter().copied();
        let mut checksum = part.checksum.clone();
        checksum.update(checked);
        let window = Window::take(fresh, first);
        let passed = match part.header.part {
            LoadPart::Machine => window.pass_over(&mut self.source.next),
            LoadPart::Axis(_) => match &mut self.back_buffer {
                Some(axis) => window.pass_over(&mut **axis),
                None => {
                    return Err(busy(format_args!(
                        "control has not taken the axis before it; ask again"
                    )));
                }
            },
        };
        part.checksum = checksum;
        part.received = received + count as u16;
        let complete = part.received == most;
        let result = match passed {
            Err(error) => Err(invalid(format_args!("{error}"))),
            Ok(passed) if complete => self.complete(passed),
            Ok(_) => Ok(()),
        };
        match result {
            Ok(()) => Ok(self.load_status()),
            Err(error) => {
                self.source.part = None;
                Err(error)
            }
        }
    }

    /// Ends the part under way: checks it whole, and hands an axis to control. `passed` is the number of words that it is made of.
    fn complete(&mut self, passed: usize) -> Result<(), LinkError> {
        let Some(part) = &self.source.part else {
            return Ok(());
        };
        let header = part.header;
        if part.checksum.clone().value() != header.crc {
            return Err(invalid(format_args!(
                "crc: the words are not those of the head; load again"
            )));
        }
        if passed != usize::from(header.words) {
            return Err(invalid(format_args!(
                "words = {}: the part is made of {passed}",
                header.words
            )));
        }
        match header.part {
            LoadPart::Machine => {
                self.source.check_machine()?;
                self.source.machine_is_whole = true;
                Ok(())
            }
            LoadPart::Axis(axis) => self.hand_axis_over(axis),
        }
    }

    fn hand_axis_over(&mut self, axis: message::AxisName) -> Result<(), LinkError> {
        let Some(built) = self.back_buffer.take() else {
            return Ok(());
        };
        let handed = self.source.handed.with(axis);
        let swap = AxisSwap {
            name: axis.into(),
            axis: built,
            operation: self.source.next.operation,
            needs_disabled: true,
            more: handed != AxisSet::ALL,
            first: !self.source.ever,
            new_origin: true,
        };
        match self.ends.swaps.enqueue(swap) {
            Ok(()) => {
                self.exchanges = self.exchanges.wrapping_add(1);
                self.source.handed = handed;
                Ok(())
            }
            // There is one back buffer, and it was here: the queue was empty.
            Err(swap) => {
                self.back_buffer = Some(swap.axis);
                Err(busy(format_args!(
                    "control has an axis waiting; load again"
                )))
            }
        }
    }
}

fn other_rate(rate_hz: u32) -> LinkError {
    invalid(format_args!(
        "rate_hz: this firmware runs at {rate_hz}; set that and load again"
    ))
}
