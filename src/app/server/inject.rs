//! A voltage that a host adds to an axis' output.

use super::opened::OpenInjection;
use super::{Server, invalid, refused};
use crate::app::queues::{STREAM_ITEM_ROOM, StreamItem};
use crate::app::wire::Translated;
use crate::hal::SettingsFlash;
use quadrant_law::command::Command;
use quadrant_law::injection::{BLOCK_VALUES, VoltageBlock};
use quadrant_law::scalar::Scalar;
use quadrant_law::supervisor::PERIOD_TICKS;
use quadrant_link::message::{InjectRequest, InjectStatus, LinkError, Reply, Voltages};
use quadrant_settings::InjectionSettings;

/// Blocks that must wait before the injection begins: the host is that far ahead.
const START_BLOCKS: usize = STREAM_ITEM_ROOM / 2;
/// Ticks after which a command that was sent shows in the snapshot.
const ARRIVAL_TICKS: u32 = 3 * PERIOD_TICKS;

impl<S: Scalar, F: SettingsFlash> Server<'_, '_, S, F> {
    pub(super) fn serve_inject(&mut self, request: InjectRequest) -> Result<Reply, LinkError> {
        match request {
            InjectRequest::Open {
                axis,
                open_loop,
                with_plan,
                limit_v,
                travel_mm,
                max_velocity_mm_s,
            } => self.open_injection(&InjectionSettings {
                axis: Translated::translated(axis),
                open_loop,
                with_plan,
                limit_v,
                travel_mm,
                max_velocity_mm_s,
            }),
            InjectRequest::Values {
                sequence,
                values,
                last,
            } => self.take_values(sequence, &values, last),
            InjectRequest::Close => {
                if self.is_injecting() {
                    self.command(Command::Stop)?;
                    self.give_up_injection();
                }
                self.injection_status()
            }
        }
    }

    /// True if a host has opened an injection that has not ended.
    pub(super) fn is_injecting(&self) -> bool {
        self.injection
            .as_ref()
            .is_some_and(|injection| !injection.ended)
    }

    /// Ends an injection that has not begun: with a stop that the control law has been sent.
    pub(super) fn give_up_injection(&mut self) {
        if let Some(injection) = &mut self.injection {
            injection.ended |= injection.started.is_none();
        }
    }

    fn open_injection(&mut self, request: &InjectionSettings) -> Result<Reply, LinkError> {
        self.check(Command::Run)?;
        if self.stream.is_some() || self.is_injecting() || self.ends.stream_items.len() > 0 {
            return Err(refused(format_args!(
                "a stream or an injection is open; close it or wait until it ends"
            )));
        }
        if request.open_loop && request.with_plan {
            return Err(invalid(format_args!(
                "with_plan: the plan needs the loop that open_loop opens; give one of them"
            )));
        }
        if request.with_plan {
            self.check_plan()?;
        }
        let (injection, most) = self
            .in_force()?
            .injection(request)
            .map_err(|error| invalid(format_args!("{error}")))?;
        // There is room: nothing waits.
        let _ = self
            .ends
            .stream_items
            .enqueue(StreamItem::Injection(injection));
        self.injection = Some(OpenInjection {
            most,
            next: 0,
            complete: false,
            started: None,
            progress: None,
            ended: false,
        });
        self.injection_status()
    }

    fn opened_injection(&mut self) -> Result<&mut OpenInjection, LinkError> {
        self.injection
            .as_mut()
            .ok_or_else(|| refused(format_args!("no injection is open; open one first")))
    }

    /// Takes values unless they are known, as far as there is room.
    fn take_values(
        &mut self,
        sequence: u32,
        values: &Voltages,
        last: bool,
    ) -> Result<Reply, LinkError> {
        let injection = self.opened_injection()?;
        let (next, most) = (injection.next, injection.most);
        if values.is_empty() || injection.ended {
            return self.injection_status();
        }
        if sequence > next {
            return Err(invalid(format_args!(
                "sequence = {sequence}: the values from {next} on are missing; send them first"
            )));
        }
        let known = (next - sequence) as usize;
        let fresh = values.iter().skip(known);
        if fresh.len() > 0 && injection.complete {
            return Err(refused(format_args!(
                "value {next} comes after the last one; open another injection when this one has ended"
            )));
        }
        if let Some(word) = fresh.clone().find(|word| word.unsigned_abs() > most) {
            return Err(invalid(format_args!(
                "values: {word} is beyond {most}, which limit_v comes to; lower the values or raise limit_v"
            )));
        }
        let mut left = fresh;
        while left.len() > 0 && self.ends.stream_items.ready() {
            let ends = last && left.len() <= BLOCK_VALUES;
            let block = VoltageBlock::new(&mut left, ends);
            let count = block.len() as u32;
            // There is room: it was looked at before.
            let _ = self.ends.stream_items.enqueue(StreamItem::Voltages(block));
            let injection = self.opened_injection()?;
            injection.next = injection.next.saturating_add(count);
            injection.complete = ends;
        }
        self.injection_status()
    }

    fn injection_status(&mut self) -> Result<Reply, LinkError> {
        let free = STREAM_ITEM_ROOM - self.ends.stream_items.len();
        let injection = self.opened_injection()?;
        let progress = injection.progress.filter(|progress| progress.values > 0);
        Ok(Reply::Inject(InjectStatus {
            next_sequence: injection.next,
            free: (free * BLOCK_VALUES) as u16,
            first_tick: progress.map(|progress| progress.first_tick),
            done: progress.map_or(0, |progress| progress.values),
            ended: injection.ended,
        }))
    }

    /// Begins when enough is there, and sees how far it has come.
    pub(super) fn follow_injection(&mut self) {
        let waiting = self.ends.stream_items.len();
        let view = &self.seen.view;
        let (enabled, injecting, ready) = (
            view.safety.is_enabled(),
            view.injecting,
            view.injection_ready,
        );
        let (tick, progress) = (self.seen.tick, self.seen.injection);
        let Some(injection) = &mut self.injection else {
            return;
        };
        if injection.ended {
            return;
        }
        match injection.started {
            Some(since) => {
                let arrived = tick.wrapping_sub(since) > ARRIVAL_TICKS;
                if injecting || arrived {
                    injection.progress = Some(progress);
                }
                injection.ended = arrived && !injecting;
            }
            None if !enabled => injection.ended = true,
            None => {
                let enough = waiting >= START_BLOCKS || injection.complete;
                if enough && ready && self.command(Command::StartInjection).is_ok() {
                    self.begun(tick);
                }
            }
        }
    }

    fn begun(&mut self, tick: u32) {
        if let Some(injection) = &mut self.injection {
            injection.started = Some(tick);
        }
    }
}
