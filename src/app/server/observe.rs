//! Requests about samples: telemetry and the capture.

use super::{Server, busy, invalid, refused};
use crate::app::capture::Capture;
use crate::app::queues::CaptureCommand;
use crate::app::telemetry::{Packer, Sampler, Selection};
use crate::hal::SettingsFlash;
use quadrant_law::safety::SafetyState;
use quadrant_law::scalar::Scalar;
use quadrant_link::message::{
    AxisName, AxisSignal, BLOCK_WORDS, CapturePhase, CaptureRequest, CaptureStatus, Channel, Event,
    LinkError, Reply, StageSignal, TelemetryBlock, TelemetryRequest, Trigger, WordPage,
};

/// Pre-trigger share of the capture that waits for faults, %.
const FAULT_PRE_TRIGGER_PERCENT: u8 = 75;

impl<S: Scalar, F: SettingsFlash> Server<'_, '_, S, F> {
    #[inline(never)]
    pub(super) fn serve_telemetry(
        &mut self,
        request: TelemetryRequest,
    ) -> Result<Reply, LinkError> {
        let selection = match request {
            TelemetryRequest::Select {
                channels,
                decimation,
            } => Some(
                Selection::new(&channels, decimation)
                    .map_err(|error| invalid(format_args!("{error}")))?,
            ),
            TelemetryRequest::Stop => None,
        };
        let generation = self.generation.wrapping_add(1);
        let packer = match &selection {
            Some(selection) => Packer::new(selection, generation),
            None => Packer::default(),
        };
        self.ends
            .samplers
            .enqueue(Sampler::new(selection, generation))
            .map_err(|_| {
                busy(format_args!(
                    "the last selection is not taken yet; ask again"
                ))
            })?;
        self.generation = generation;
        self.packer = packer;
        Ok(Reply::Telemetry { generation })
    }

    /// Returns the next full block, or the samples gathered so far.
    #[inline(never)]
    pub(super) fn next_block(&mut self) -> Option<TelemetryBlock> {
        while let Some(sample) = self.ends.samples.dequeue() {
            if let Some(block) = self.packer.push::<S>(&sample) {
                return Some(block);
            }
        }
        self.packer.flush()
    }

    #[inline(never)]
    pub(super) fn serve_capture(&mut self, request: CaptureRequest) -> Result<Reply, LinkError> {
        match request {
            CaptureRequest::Arm {
                channels,
                decimation,
                pre_trigger_percent,
                trigger,
            } => {
                let selection = Selection::new(&channels, decimation)
                    .map_err(|error| invalid(format_args!("{error}")))?;
                self.arm(selection, pre_trigger_percent, trigger)?;
            }
            CaptureRequest::Disarm => {
                if self.recorder.capture.is_none() {
                    self.ends
                        .capture_commands
                        .enqueue(CaptureCommand::GiveBack)
                        .map_err(|_| busy(format_args!("the capture is being armed; ask again")))?;
                }
            }
            CaptureRequest::State => {}
            CaptureRequest::Read { offset } => return self.read_capture(offset),
        }
        Ok(Reply::Capture(self.capture_status()))
    }

    fn arm(
        &mut self,
        selection: Selection,
        pre_trigger_percent: u8,
        trigger: Trigger,
    ) -> Result<(), LinkError> {
        let Some(mut capture) = self.recorder.capture.take() else {
            return Err(busy(format_args!(
                "a capture is armed; disarm it first, or wait until it is full"
            )));
        };
        if let Err(error) = capture.arm(selection.clone(), pre_trigger_percent, trigger) {
            self.recorder.capture = Some(capture);
            return Err(invalid(format_args!("{error}")));
        }
        match self
            .ends
            .capture_commands
            .enqueue(CaptureCommand::Record(capture))
        {
            Ok(()) => {
                self.recorder.selection = Some(selection);
                Ok(())
            }
            Err(command) => {
                if let CaptureCommand::Record(capture) = command {
                    self.recorder.capture = Some(capture);
                }
                Err(busy(format_args!(
                    "the last command is not taken yet; ask again"
                )))
            }
        }
    }

    /// Arms the capture for the first time once the stage has seen good inputs, so that every fault from then on leaves its
    /// trace; one that was latched at the start has none.
    pub(super) fn arm_at_start(&mut self) {
        if self.recorder.phase() == CapturePhase::Idle
            && self.seen.view.safety != SafetyState::Start
        {
            self.arm_for_faults();
        }
    }

    /// Lets the capture wait for a fault, unless it waits for something already.
    pub(super) fn arm_for_faults(&mut self) {
        let of = |axis, signal| Channel::Axis(axis, signal);
        let channels = [
            of(AxisName::X, AxisSignal::Error),
            of(AxisName::Y, AxisSignal::Error),
            of(AxisName::Z, AxisSignal::Error),
            of(AxisName::X, AxisSignal::Output),
            of(AxisName::Y, AxisSignal::Output),
            of(AxisName::Z, AxisSignal::Output),
            Channel::Stage(StageSignal::State),
            Channel::Stage(StageSignal::Fault),
        ];
        if let Ok(selection) = Selection::new(&channels, 1) {
            // Busy: it waits for something already, and a fault triggers that as well.
            let _ = self.arm(selection, FAULT_PRE_TRIGGER_PERCENT, Trigger::Fault);
        }
    }

    /// Takes a capture that the control interrupt gives back.
    pub(super) fn collect_capture(&mut self) {
        if let Some(capture) = self.ends.captures.dequeue() {
            self.recorder.capture = Some(capture);
            self.recorder.number = self.recorder.number.wrapping_add(1);
            let number = self.recorder.number;
            self.push_event(self.seen.tick, Event::CaptureFrozen { number });
        }
    }

    fn capture_status(&self) -> CaptureStatus {
        let selection = self.recorder.selection.as_ref();
        CaptureStatus {
            phase: self.recorder.phase(),
            number: self.recorder.number,
            channels: selection
                .and_then(|selection| heapless::Vec::from_slice(selection.channels()).ok())
                .unwrap_or_default(),
            decimation: selection.map_or(1, Selection::decimation),
            record: self.recorder.capture.as_ref().and_then(Capture::record),
        }
    }

    #[inline(never)]
    fn read_capture(&self, offset: u16) -> Result<Reply, LinkError> {
        let Some(capture) = &self.recorder.capture else {
            return Err(refused(format_args!(
                "the capture is armed; disarm it, or wait until it is full"
            )));
        };
        let mut page = WordPage {
            number: self.recorder.number,
            offset,
            ..WordPage::default()
        };
        let words = capture.words::<S>(offset.into());
        let _ = page.words.extend(words.take(BLOCK_WORDS));
        Ok(Reply::Words(page))
    }
}
