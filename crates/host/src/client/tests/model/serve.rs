//! Answers of the model to each request.

use heapless::String as Bounded;
use quadrant::app::Translated;
use quadrant::app::telemetry::{Packer, Selection};
use quadrant_link::message::*;
use quadrant_link::message::{CaptureCause, CapturePhase, CaptureRecord};
use quadrant_link::message::{LimitedBy, MachineState, SampleWords};
use quadrant_settings::{MAX_VALUE_BYTES, StageSettings};

use super::{Model, ROOM, read};

impl Model {
    pub(super) fn serve(&mut self, body: Body) -> Result<Reply, LinkError> {
        let refused = |why: &str| LinkError::Refused(text(format_args!("{why}")));
        {
            let mut bench = self.bench.borrow_mut();
            bench.requests.push(body.name());
            if bench.busy > 0 {
                bench.busy -= 1;
                return Err(LinkError::Busy(text(format_args!("another change"))));
            }
        }
        if body.may_move() && !self.enabled && !matches!(body, Body::Enable) {
            return Err(refused("outputs are off; `enable` first"));
        }
        match body {
            Body::Hello => {
                return Ok(Reply::Identity(Identity {
                    protocol: 1,
                    firmware: Bounded::try_from("0.1.0").unwrap(),
                    board: Bounded::try_from("model").unwrap(),
                    rate_hz: 1e4,
                    cycle_hz: 1_000_000,
                    number: NumberType::F64,
                    tick: self.tick,
                }));
            }
            Body::Status => return Ok(Reply::Status(self.status())),
            Body::Inputs => {
                return Ok(Reply::Inputs(Inputs {
                    tick: self.tick,
                    switches: 0,
                    indexed: AxisSet::NONE,
                    refusal: None,
                }));
            }
            Body::Learning => {
                return Ok(Reply::Learning(Learning {
                    tick: self.tick,
                    axes: [None; 3],
                }));
            }
            Body::Fault => {
                return Ok(Reply::Fault(self.fault.map(|code| FaultReport {
                    code,
                    axis: None,
                    tick: self.tick,
                    name: Bounded::try_from("emergency-stop").unwrap(),
                    cause: Bounded::try_from("the emergency stop is pressed").unwrap(),
                    remedy: Bounded::try_from("release it").unwrap(),
                    captured: false,
                })));
            }
            Body::Log { .. } => {
                return Err(LinkError::Unsupported(text(format_args!("no log"))));
            }
            // Nothing of the model turns.
            Body::Spindle { .. } => {}
            Body::ResetFault => self.fault = None,
            Body::Enable if self.fault.is_some() => return Err(refused("a fault is latched")),
            Body::Enable => self.enabled = true,
            Body::Disable => self.enabled = false,
            Body::Stop => {
                self.goal = None;
                self.plan_left = 0;
            }
            Body::Home(axes) => {
                self.homed = AxisSet::from_iter(self.homed.iter().chain(axes.iter()))
            }
            Body::Move {
                axis,
                target_mm,
                velocity_mm_s,
            } => self.goal = Some((axis as usize, target_mm, velocity_mm_s)),
            Body::Jog {
                axis,
                velocity_mm_s,
            } => {
                let far = 1e3 * velocity_mm_s.signum();
                self.goal = (velocity_mm_s != 0.0).then_some((axis as usize, far, velocity_mm_s));
            }
            Body::Run if self.running() => return Err(refused("a motion is under way")),
            Body::Run => self.plan_left = 5000,
            Body::SetPlan(plan) => {
                self.bench.borrow_mut().plan = Some(Translated::translated(plan))
            }
            Body::Stream(request) => return self.stream(request),
            Body::Settings(request) => return self.settings(request),
            Body::Telemetry(TelemetryRequest::Select {
                channels,
                decimation,
            }) => {
                let selection = Selection::new(&channels, decimation)
                    .map_err(|error| LinkError::Invalid(text(format_args!("{error}"))))?;
                self.generation = self.generation.wrapping_add(1);
                let packer = Packer::new(&selection, self.generation);
                self.telemetry = Some((selection, packer, 0));
                return Ok(Reply::Telemetry {
                    generation: self.generation,
                });
            }
            // What no block was filled with is let go.
            Body::Telemetry(TelemetryRequest::Stop) => self.telemetry = None,
            Body::Capture(request) => return self.capture(request),
            Body::Inject(_) => return Err(refused("the model injects nothing")),
            Body::Reboot => self.bench.borrow_mut().restart = true,
        }
        Ok(Reply::Done)
    }

    fn status(&self) -> Status {
        Status {
            tick: self.tick,
            state: match (self.fault, self.enabled) {
                (Some(_), _) => MachineState::Fault,
                (None, true) => MachineState::Enabled,
                (None, false) => MachineState::Disabled,
            },
            fault: self.fault,
            running: self.running(),
            homed: self.homed,
            axes: self.position_mm.map(|position_mm| AxisStatus {
                mode: AxisMode::Hold,
                position_mm,
                error_mm: 0.001,
                output_v: 0.5,
                limited_by: LimitedBy::Nothing,
                high_mark: 0.1,
            }),
            overruns: 0,
            longest_tick_cycles: 1500,
            capture: CapturePhase::Idle,
            frames: self.port.counters(),
            dropped_samples: 0,
            dropped_events: 0,
        }
    }

    fn settings(&mut self, request: SettingsRequest) -> Result<Reply, LinkError> {
        let invalid = |why: String| LinkError::Invalid(text(format_args!("{why}")));
        Ok(match request {
            SettingsRequest::Get(path) => value(&self.draft, &path).map_err(invalid)?,
            SettingsRequest::GetInForce(path) => {
                value(&self.bench.borrow().in_force, &path).map_err(invalid)?
            }
            SettingsRequest::Set { path, value } => {
                self.draft
                    .set_bytes(&path, value.kind, &value.bytes)
                    .map_err(|error| invalid(format!("{path}: {error}")))?;
                Reply::Done
            }
            SettingsRequest::List { cursor } => page(&paths(&self.draft), cursor),
            SettingsRequest::Edited { cursor } => {
                let in_force = &self.bench.borrow().in_force;
                let mut edited = paths(&self.draft);
                edited.retain(|path| value(&self.draft, path) != value(in_force, path));
                page(&edited, cursor)
            }
            SettingsRequest::Apply => {
                let settings = self.draft.clone();
                settings
                    .validate(8)
                    .map_err(|error| invalid(error.to_string()))?;
                let old =
                    std::mem::replace(&mut self.bench.borrow_mut().in_force, settings.clone());
                let changed = quadrant_link::message::AxisName::ALL
                    .into_iter()
                    .filter(|axis| old.axes[*axis as usize] != settings.axes[*axis as usize]);
                Reply::Applied(Applied {
                    changed: changed.collect(),
                    restart_needed: false,
                })
            }
            SettingsRequest::Revert => {
                self.draft = self.bench.borrow().in_force.clone();
                Reply::Done
            }
            SettingsRequest::Defaults => {
                self.draft = StageSettings::simulated();
                Reply::Done
            }
            SettingsRequest::Store(provenance) => {
                self.stored = provenance.as_str().to_owned();
                Reply::Done
            }
            SettingsRequest::Provenance => {
                Reply::Provenance(Provenance::try_from(self.stored.as_str()).unwrap())
            }
        })
    }

    fn stream(&mut self, request: StreamRequest) -> Result<Reply, LinkError> {
        let (next, taken) = match (request, self.stream) {
            (StreamRequest::Open { .. }, _) => (0, self.tick),
            (_, None) => return Err(LinkError::Refused(text(format_args!("no stream is open")))),
            (
                StreamRequest::Points {
                    sequence,
                    points,
                    last,
                },
                Some((next, began)),
            ) => {
                let mut bench = self.bench.borrow_mut();
                let known = (next - sequence.min(next)) as usize;
                bench.points.extend(points.iter().skip(known).copied());
                let next = next.max(sequence + points.len() as u32);
                drop(bench);
                if last {
                    self.stream = None;
                    return Ok(Reply::Stream(StreamStatus {
                        next_sequence: next,
                        free: ROOM,
                    }));
                }
                (next, began)
            }
            (StreamRequest::Close, Some((next, _))) => {
                self.stream = None;
                return Ok(Reply::Stream(StreamStatus {
                    next_sequence: next,
                    free: ROOM,
                }));
            }
        };
        self.stream = Some((next, taken));
        // A point is used up every 20 ticks.
        let used = (self.tick - taken) / 20;
        let waiting = next.saturating_sub(used);
        Ok(Reply::Stream(StreamStatus {
            next_sequence: next,
            free: ROOM.saturating_sub(waiting as u16),
        }))
    }

    fn capture(&mut self, request: CaptureRequest) -> Result<Reply, LinkError> {
        const SAMPLES: u32 = 300;
        match request {
            CaptureRequest::Arm {
                channels,
                decimation,
                ..
            } => {
                let number = self.capture.as_ref().map_or(0, |(_, number)| *number) + 1;
                self.capture = Some((Selection::new(&channels, decimation).unwrap(), number));
            }
            CaptureRequest::Read { offset } => {
                let (selection, number) = self.capture.as_ref().unwrap();
                let channels = selection.channels();
                let from = usize::from(offset);
                let all = SAMPLES as usize * channels.len();
                let mut words = SampleWords::new();
                assert!(words.extend((from..all.min(from + 112)).map(|place| {
                    read(
                        channels[place % channels.len()],
                        &[0.0; 3],
                        (place / channels.len()) as u32,
                    )
                })));
                return Ok(Reply::Words(WordPage {
                    number: *number,
                    offset,
                    words,
                }));
            }
            CaptureRequest::State | CaptureRequest::Disarm => {}
        }
        Ok(Reply::Capture(match &self.capture {
            None => CaptureStatus {
                phase: CapturePhase::Idle,
                number: 0,
                channels: Default::default(),
                decimation: 0,
                record: None,
            },
            Some((selection, number)) => CaptureStatus {
                phase: CapturePhase::Frozen,
                number: *number,
                channels: selection.channels().iter().copied().collect(),
                decimation: selection.decimation(),
                record: Some(CaptureRecord {
                    samples: SAMPLES,
                    trigger_sample: 100,
                    first_tick: 0,
                    trigger_tick: 100 * u32::from(selection.decimation()),
                    cause: CaptureCause::Command,
                }),
            },
        }))
    }
}

fn value(settings: &StageSettings, path: &str) -> Result<Reply, String> {
    let mut bytes = heapless::Vec::new();
    bytes.resize_default(MAX_VALUE_BYTES).unwrap();
    let (kind, length) = settings
        .get_bytes(path, &mut bytes)
        .map_err(|error| format!("{path}: {error}"))?;
    bytes.truncate(length);
    Ok(Reply::Value(Value { kind, bytes }))
}

fn paths(settings: &StageSettings) -> Vec<String> {
    let mut all = Vec::new();
    settings
        .list("", &mut |path| all.push(path.to_owned()))
        .unwrap();
    all
}

fn page(all: &[String], cursor: u16) -> Reply {
    let from = usize::from(cursor);
    let to = all.len().min(from + PAGE_PATHS);
    Reply::Paths(PathPage {
        paths: all[from..to]
            .iter()
            .map(|path| Path::try_from(path.as_str()).unwrap())
            .collect(),
        next: (to < all.len()).then_some(to as u16),
    })
}
