//! A machine to talk to: the library's own end of the link before a stage that follows every order exactly, with a line
//! that can be made bad.

mod serve;

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use quadrant::app::telemetry::{Packer, Sample, Selection};
use quadrant_link::frame::{self, FRAME_BYTES};
use quadrant_link::message::*;
use quadrant_link::message::{AxisSignal, Channel, StageSignal};
use quadrant_link::server::LinkServer;
use quadrant_settings::StageSettings;

use crate::machine::SimulatedPeer;

/// Control ticks in an exchange, of 0.1 ms.
const TICKS: u32 = 10;
/// Room for set points.
const ROOM: u16 = 16;

/// Observations and disturbances of a test, unseen by the client.
#[derive(Default)]
pub(super) struct Bench {
    /// Names of the requests that arrived, in order.
    pub(super) requests: Vec<&'static str>,
    /// Number of the next answers that the line loses.
    pub(super) lose_answers: u32,
    /// Bytes that the line adds before each answer.
    pub(super) noise: Vec<u8>,
    /// Time for which the next answer is held back, ms.
    pub(super) answer_after_ms: u32,
    /// The next exchange restarts the machine.
    pub(super) restart: bool,
    /// The fault that the next exchange finds.
    pub(super) fault: Option<u8>,
    /// Number of the next requests that are answered with `Busy`.
    pub(super) busy: u32,
    /// Every how many telemetry samples one is lost.
    pub(super) lose_every: Option<u32>,
    /// Set points, as they came.
    pub(super) points: Vec<SetPoint>,
    /// The settings in force.
    pub(super) in_force: StageSettings,
    /// The plan, once one was sent.
    pub(super) plan: Option<quadrant_settings::PlanSettings>,
}

pub(super) struct Model {
    pub(super) bench: Rc<RefCell<Bench>>,
    port: LinkServer,
    tick: u32,
    enabled: bool,
    fault: Option<u8>,
    homed: AxisSet,
    position_mm: [f64; 3],
    goal: Option<(usize, f64, f64)>,
    /// Ticks that the plan still runs.
    plan_left: u32,
    draft: StageSettings,
    stored: std::string::String,
    stream: Option<(u32, u32)>,
    telemetry: Option<(Selection, Packer, u32)>,
    generation: u8,
    capture: Option<(Selection, u16)>,
    outbox: Vec<u8>,
    events: u16,
    was_running: bool,
}

impl Model {
    pub(super) fn new() -> (Self, Rc<RefCell<Bench>>) {
        let bench = Rc::new(RefCell::new(Bench {
            in_force: StageSettings::simulated(),
            ..Bench::default()
        }));
        let model = Self {
            bench: Rc::clone(&bench),
            port: LinkServer::new(),
            tick: 0,
            enabled: false,
            fault: None,
            homed: AxisSet::NONE,
            position_mm: [0.0; 3],
            goal: None,
            plan_left: 0,
            draft: StageSettings::simulated(),
            stored: std::string::String::new(),
            stream: None,
            telemetry: None,
            generation: 0,
            capture: None,
            outbox: Vec::new(),
            events: 0,
            was_running: false,
        };
        (model, bench)
    }

    fn running(&self) -> bool {
        self.goal.is_some() || self.plan_left > 0 || self.stream.is_some()
    }

    fn step(&mut self) {
        if std::mem::take(&mut self.bench.borrow_mut().restart) {
            let bench = Rc::clone(&self.bench);
            *self = Self {
                bench,
                ..Self::new().0
            };
        }
        let fault = self.bench.borrow_mut().fault.take();
        if let Some(code) = fault {
            self.fault = Some(code);
            self.enabled = false;
            self.goal = None;
            self.plan_left = 0;
            self.event(Event::Fault { code, axis: None });
        }
        for _ in 0..TICKS {
            self.step_tick();
        }
        if self.running() != self.was_running {
            self.was_running = self.running();
            self.event(if self.was_running {
                Event::MotionStarted
            } else {
                Event::MotionFinished
            });
        }
    }

    fn step_tick(&mut self) {
        if let Some((axis, target, velocity)) = self.goal {
            let way = velocity.abs() * 1e-4;
            let left = target - self.position_mm[axis];
            self.position_mm[axis] += left.clamp(-way, way);
            if left.abs() <= way {
                self.goal = None;
            }
        }
        self.plan_left = self.plan_left.saturating_sub(1);
        let words = |channels: &[Channel], position_mm: &[f64; 3], tick: u32| {
            let mut words = [0; 8];
            for (word, channel) in words.iter_mut().zip(channels) {
                *word = read(*channel, position_mm, tick);
            }
            words
        };
        let lose_every = self.bench.borrow().lose_every;
        let mut block = None;
        if let Some((selection, packer, number)) = &mut self.telemetry
            && self.tick.is_multiple_of(u32::from(selection.decimation()))
        {
            let sample = Sample {
                sequence: *number,
                tick: self.tick,
                generation: self.generation,
                words: words(selection.channels(), &self.position_mm, self.tick),
            };
            *number += 1;
            if lose_every
                .is_none_or(|every| !sample.sequence.is_multiple_of(every) || sample.sequence == 0)
            {
                block = packer.push::<f32>(&sample);
            }
        }
        if let Some(block) = block {
            self.notice(Notice::Telemetry(block));
        }
        self.tick += 1;
    }

    fn event(&mut self, event: Event) {
        let sequence = self.events;
        self.events = self.events.wrapping_add(1);
        let tick = self.tick;
        self.notice(Notice::Event {
            sequence,
            tick,
            event,
        });
    }

    fn notice(&mut self, notice: Notice) {
        if self.port.is_greeted() {
            self.put(&Message::Notice(notice));
        }
    }

    fn put(&mut self, message: &Message) {
        let mut buffer = [0; FRAME_BYTES];
        let bytes = frame::encode(message, &mut buffer).unwrap();
        self.outbox.extend_from_slice(bytes);
    }
}

/// Returns the word of a channel: positions as they are, and the tick where a test wants to recognise a sample.
fn read(channel: Channel, position_mm: &[f64; 3], tick: u32) -> u32 {
    let counts = |axis: quadrant_link::message::AxisName| position_mm[axis as usize] / 0.0005;
    match channel {
        Channel::Axis(axis, AxisSignal::Position) => counts(axis).round() as i32 as u32,
        Channel::Axis(axis, AxisSignal::Reference) => (256.0 * counts(axis)).round() as i32 as u32,
        Channel::Axis(_, AxisSignal::Error) => 0.001_f32.to_bits(),
        Channel::Axis(_, AxisSignal::Code | AxisSignal::LimitedBy | AxisSignal::CodeSum) => 0,
        Channel::Axis(..) => (0.25 * tick as f32).to_bits(),
        Channel::Stage(StageSignal::Tick) => tick,
        Channel::Stage(_) => 3,
    }
}

impl SimulatedPeer for Model {
    fn exchange(&mut self, sent: &[u8]) -> std::io::Result<Vec<u8>> {
        self.step();
        let mut answers = Vec::new();
        let mut port = std::mem::take(&mut self.port);
        for &byte in sent {
            answers.extend(port.push(byte, |body| self.serve(body)));
        }
        self.port = port;
        for response in answers {
            let noise = self.bench.borrow().noise.clone();
            self.outbox.extend(noise);
            let mut bench = self.bench.borrow_mut();
            if bench.lose_answers > 0 {
                bench.lose_answers -= 1;
                continue;
            }
            drop(bench);
            self.put(&Message::Response(response));
        }
        let mut bench = self.bench.borrow_mut();
        if bench.answer_after_ms > 0 && !self.outbox.is_empty() {
            bench.answer_after_ms -= 1;
            return Ok(Vec::new());
        }
        Ok(std::mem::take(&mut self.outbox))
    }

    fn period(&self) -> Duration {
        Duration::from_millis(1)
    }
}
