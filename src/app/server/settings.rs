//! Requests about settings: a draft is edited leaf by leaf, and takes effect as a whole.

use super::deferred::Work;
use super::{Server, busy, index, invalid, refused};
use crate::app::queues::AxisSwap;
use crate::app::wire::Translated;
use crate::hal::SettingsFlash;
use quadrant_law::axes::AxisName;
use quadrant_law::decimal::Decimal;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::scalar::Scalar;
use quadrant_link::message::{
    Applied, AxisSet, Event, LinkError, PAGE_PATHS, PathPage, Provenance, Reply, SettingsRequest,
    Value, text,
};
use quadrant_settings::draft::ApplyError;
use quadrant_settings::{AxisSettings, MAX_VALUE_BYTES, StageSettings};

impl<S: Scalar, F: SettingsFlash> Server<'_, '_, S, F> {
    /// The memory for settings.
    pub const fn flash(&self) -> &F {
        self.store.flash()
    }

    /// The origin of the stored settings.
    pub const fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// The settings in force.
    pub fn acting(&self) -> &StageSettings {
        self.draft.in_force()
    }

    /// Changes settings of an axis as the board's own controls ask, and lets them act.
    ///
    /// # Errors
    /// As a host's `Apply`, or while a host edits settings; nothing has changed then.
    pub fn change(
        &mut self,
        axis: AxisName,
        edit: impl FnOnce(&mut AxisSettings),
    ) -> Result<(), LinkError> {
        if self.draft.is_edited() {
            return Err(busy(format_args!("a host edits the settings")));
        }
        edit(self.draft.axis_mut(axis));
        let applied = self.apply();
        if applied.is_err() {
            self.draft.revert();
        }
        applied.map(|_| ())
    }

    /// Counts the paths of the draft. Visits them all: for rare occasions.
    pub fn paths(&self) -> usize {
        let mut paths = 0;
        // An error of the tree would end the visit early, and show as a number that is too small.
        let _ = self.draft.settings().list("", &mut |_| paths += 1);
        paths
    }

    #[inline(never)]
    pub(super) fn serve_settings(&mut self, request: SettingsRequest) -> Result<Reply, LinkError> {
        match request {
            SettingsRequest::Get(path) => value(self.draft.settings(), &path),
            SettingsRequest::GetInForce(path) => value(self.draft.in_force(), &path),
            SettingsRequest::Set { path, value } => self
                .draft
                .set_bytes(&path, value.kind, &value.bytes)
                .map(|()| Reply::Done)
                .map_err(|error| invalid(format_args!("{path}: {error}"))),
            SettingsRequest::List { cursor } => self.list(cursor, |_| true),
            SettingsRequest::Edited { cursor } => {
                self.list(cursor, |path| self.draft.differs_at(path))
            }
            SettingsRequest::Apply => self.apply(),
            SettingsRequest::Revert => {
                self.draft.revert();
                Ok(Reply::Done)
            }
            SettingsRequest::Defaults => {
                self.draft.settings_mut().set_default();
                Ok(Reply::Done)
            }
            SettingsRequest::Store(provenance) => self.defer(Work::Store(provenance)),
            SettingsRequest::Provenance => Ok(Reply::Provenance(self.provenance.clone())),
        }
    }

    /// A page of the draft's paths that are asked for.
    #[inline(never)]
    fn list(&self, cursor: u16, is_listed: impl Fn(&str) -> bool) -> Result<Reply, LinkError> {
        let mut page = PathPage::default();
        let mut number = 0;
        let visited = self.draft.settings().list("", &mut |path| {
            if !is_listed(path) {
                return;
            }
            if number >= usize::from(cursor) {
                if page.paths.len() < PAGE_PATHS {
                    let _ = page.paths.push(text(format_args!("{path}")));
                } else {
                    page.next = Some(cursor + PAGE_PATHS as u16);
                }
            }
            number += 1;
        });
        match visited {
            Ok(()) => Ok(Reply::Paths(page)),
            Err(error) => Err(invalid(format_args!("{error}"))),
        }
    }

    /// Takes the draft over as a whole, or not at all. The axes get theirs one after the other within milliseconds.
    #[inline(never)]
    fn apply(&mut self) -> Result<Reply, LinkError> {
        if !self.pending.is_empty() {
            return Err(busy(format_args!(
                "the settings applied last are still being built; ask again"
            )));
        }
        self.check_board()?;
        let safety = self.draft.safety_change();
        let new_origins = self.draft.new_origins();
        if let Some(leaf) = safety
            && self.seen.view.safety.drives()
        {
            return Err(refused(format_args!("{leaf}")));
        }
        let changed = match self.draft.apply(FIRMWARE_ELEMENTS) {
            Ok(changed) => changed,
            Err(ApplyError::Refused(error)) => return Err(invalid(format_args!("{error}"))),
            // They stay in the draft: stored and restarted, they take effect.
            Err(ApplyError::RateNeedsRestart | ApplyError::EncoderNeedsRestart(_)) => {
                return Ok(Reply::Applied(Applied {
                    changed: AxisSet::NONE,
                    restart_needed: true,
                }));
            }
        };
        let changed = AxisName::ALL
            .into_iter()
            .filter(|&axis| changed[index(axis)])
            .map(Translated::translated)
            .collect();
        self.pending = changed;
        self.changed = changed;
        self.needs_disabled = safety.is_some();
        self.new_origins = new_origins;
        Ok(Reply::Applied(Applied {
            changed,
            restart_needed: false,
        }))
    }

    /// Checks that the board is up to the draft's control rate, counts the pulses that axes are to follow, and reads their serial
    /// encoders.
    fn check_board(&self) -> Result<(), LinkError> {
        self.check_rate()?;
        for name in AxisName::ALL {
            let axis = self.draft.settings().axis(name);
            if axis.encoder.serial.is_some() && !self.serial_axes[index(name)] {
                return Err(invalid(format_args!(
                    "{name}/encoder/serial: this board reads no serial encoder of the axis; leave the part out, or use an axis that it \
                     reads one of (docs/serial-encoders.md)"
                )));
            }
            let follows = axis.pulses.is_some();
            if follows && !self.pulse_axes[index(name)] {
                return Err(invalid(format_args!(
                    "{name}/pulses: this board counts no steps for the axis; leave the part out, or use an axis that it counts \
                     steps for (docs/step-direction.md)"
                )));
            }
        }
        Ok(())
    }

    fn check_rate(&self) -> Result<(), LinkError> {
        let (lowest, highest) = self.rates_hz;
        let rate_hz = self.draft.settings().rate_hz;
        if (lowest..=highest).contains(&rate_hz) {
            return Ok(());
        }
        Err(invalid(format_args!(
            "rate_hz = {}: this board is up to {} to {}",
            Decimal(rate_hz),
            Decimal(lowest),
            Decimal(highest)
        )))
    }

    /// Builds the next axis whose settings have changed into the back buffer, and passes it to control.
    pub(super) fn build_pending(&mut self) {
        if self.back_buffer.is_none() {
            self.back_buffer = self.ends.back_buffers.dequeue();
        }
        let Some(pending) = self.pending.iter().next() else {
            return;
        };
        let Some(axis) = self.back_buffer.take() else {
            return;
        };
        let name = Translated::translated(pending);
        let settings = self.draft.in_force();
        settings.build_axis_into(name, axis);
        let swap = AxisSwap {
            name,
            axis,
            operation: settings.operation(),
            needs_disabled: self.needs_disabled,
            more: self.pending.iter().nth(1).is_some(),
            new_origin: self.new_origins[name],
        };
        match self.ends.swaps.enqueue(swap) {
            Ok(()) => {
                self.exchanges = self.exchanges.wrapping_add(1);
                self.pending = self
                    .pending
                    .iter()
                    .filter(|&other| other != pending)
                    .collect();
                if self.pending.is_empty() {
                    self.applied = self.applied.wrapping_add(1);
                    self.push_event(self.seen.tick, Event::SettingsApplied(self.changed));
                }
            }
            // The control law has not taken the last one: the same axis again at the next poll.
            Err(swap) => self.back_buffer = Some(swap.axis),
        }
    }

    /// Stores the draft: the settings in force, unless it was edited since or needs a restart. Control keeps the outputs off.
    #[inline(never)]
    pub(super) fn save(&mut self, provenance: Provenance) -> Result<Reply, LinkError> {
        self.check_board()?;
        self.store
            .save(
                self.draft.settings(),
                FIRMWARE_ELEMENTS,
                &provenance,
                self.buffer,
            )
            .map_err(|error| LinkError::Storage(text(format_args!("{error}"))))?;
        self.accepted = true;
        self.provenance = provenance;
        self.stored = self.stored.wrapping_add(1);
        self.push_event(self.seen.tick, Event::SettingsStored);
        Ok(Reply::Done)
    }
}

/// The value at a path.
#[inline(never)]
fn value(settings: &StageSettings, path: &str) -> Result<Reply, LinkError> {
    let mut bytes = heapless::Vec::new();
    // Cannot fail: that is its capacity.
    let _ = bytes.resize_default(MAX_VALUE_BYTES);
    let (kind, length) = settings
        .get_bytes(path, &mut bytes)
        .map_err(|error| invalid(format_args!("{path}: {error}")))?;
    bytes.truncate(length);
    Ok(Reply::Value(Value { kind, bytes }))
}
