//! The real server and control law behind a hostile line: the firmware's application on the simulated stage.
//!
//! Frames arrive whole, damaged, doubled, cut and between garbage; whole ones carry anything that can be asked, plausible
//! or not, and payloads that are no request at all behind a right CRC. What is asserted in every tick: nothing panics,
//! outputs are zero unless enabled, nothing is enabled unless a whole frame asked for it, and nothing moves unless a whole
//! frame asked for a motion.

use std::collections::VecDeque;
use std::time::Instant;

use quadrant::app::Poll;
use quadrant::hal::Serial;
use quadrant_host::machine::application::{BoardIdentity, Running, Start};
use quadrant_host::machine::memory_flash::MemoryFlash;
use quadrant_law::stage::Outputs;
use quadrant_link::frame::{self, FRAME_BYTES, PAYLOAD_BYTES};
use quadrant_link::message::{
    AxisSet, Body, LinkError, NumberType, Reply, Request, SettingsRequest, StreamRequest, Value,
};
use quadrant_link::server::LinkServer;
use quadrant_settings::{MAX_VALUE_BYTES, PlanSettings, StageSettings};
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::plant::{SimulatedStage, StageParameters};
use quadrant_test_support::Noise;
use quadrant_test_support::traffic::{self, arrival, framed};

/// Bytes that may wait before the machine runs on.
const BACKLOG: usize = 1_000;
/// Requests to start afresh of which one is sent: each start takes memory for good.
const RESTARTS: u64 = 1_000;
/// Factors of plausible velocities.
const SLOWER: [f64; 6] = [1.0, 1.0, 1e-3, 1e-6, 1e-12, f64::MIN_POSITIVE];

/// Requests that whole frames may make.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Allowed {
    /// Neither to enable nor to move.
    Looking,
    /// To enable as well.
    Enabling,
    /// Anything.
    Anything,
}

/// A line whose far end takes everything.
#[derive(Default)]
struct Line {
    bytes: VecDeque<u8>,
    answered: u64,
}

impl Serial for Line {
    fn read(&mut self, into: &mut [u8]) -> usize {
        let count = into.len().min(self.bytes.len());
        for (place, byte) in into.iter_mut().zip(self.bytes.drain(..count)) {
            *place = byte;
        }
        count
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        self.answered += bytes
            .iter()
            .filter(|byte| **byte == frame::DELIMITER)
            .count() as u64;
        bytes.len()
    }
}

#[derive(Debug, Default)]
struct Tally {
    frames: u64,
    ticks: u64,
    /// Frames that the machine sent.
    answered: u64,
    received: u64,
    restarts: u64,
    enabled_ticks: u64,
    moving_ticks: u64,
    enabled_unasked: u64,
    moved_unasked: u64,
}

pub(crate) struct Bench {
    pub(crate) running: Running<f32>,
    plant: SimulatedStage,
    pub(crate) settings: StageSettings,
    line: Line,
    /// Receives what a port receives.
    ear: LinkServer,
    asked_to_enable: bool,
    asked_to_move: bool,
    tally: Tally,
}

fn start(settings: &StageSettings) -> Running<f32> {
    let start = Start {
        defaults: settings,
        plan: &PlanSettings::default(),
        fault: None,
        identity: BoardIdentity {
            board: "hostile",
            cycle_hz: 0,
            number: NumberType::F32,
        },
    };
    Running::start(start, MemoryFlash::default()).expect("valid settings")
}

fn starts_a_motion(body: &Body) -> bool {
    body.may_move() && !matches!(body, Body::Enable)
}

impl Bench {
    fn new() -> Self {
        Self::with(|_| {})
    }

    /// A bench with a change to its settings.
    pub(crate) fn with(change: impl FnOnce(&mut StageSettings)) -> Self {
        let mut settings = identified_settings().expect("the committed settings").stage;
        for (axis, default) in settings
            .axes
            .iter_mut()
            .zip(StageSettings::simulated().axes)
        {
            axis.homing = default.homing;
            axis.limits.travel_mm = default.limits.travel_mm;
        }
        change(&mut settings);
        Self {
            running: start(&settings),
            plant: SimulatedStage::new(&StageParameters::real(), settings.rate_hz, 1),
            settings,
            line: Line::default(),
            ear: LinkServer::new(),
            asked_to_enable: false,
            asked_to_move: false,
            tally: Tally::default(),
        }
    }

    /// Sends bytes, and runs the machine until it has read most of what was sent.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        for byte in bytes {
            let (enable, motion, received) = (
                &mut self.asked_to_enable,
                &mut self.asked_to_move,
                &mut self.tally.received,
            );
            self.ear.push(*byte, |body| -> Result<Reply, LinkError> {
                *received += 1;
                *enable |= body == Body::Enable;
                *motion |= starts_a_motion(&body);
                Ok(Reply::Done)
            });
        }
        self.line.bytes.extend(bytes);
        self.tally.frames += 1;
        while self.line.bytes.len() > BACKLOG {
            self.tick();
        }
    }

    pub(crate) fn tick(&mut self) {
        let inputs = self.plant.read_inputs(None);
        let (outputs, after) = self.running.tick(&inputs, &mut self.line);
        self.plant.step(&outputs);
        let tally = &mut self.tally;
        tally.ticks += 1;
        if !outputs.enabled {
            assert_eq!(outputs, Outputs::default());
        }
        let moves = self.running.state().is_running();
        tally.enabled_ticks += u64::from(outputs.enabled);
        tally.moving_ticks += u64::from(moves);
        tally.enabled_unasked += u64::from(outputs.enabled && !self.asked_to_enable);
        tally.moved_unasked += u64::from(moves && !self.asked_to_move);
        if after == Poll::Reboot {
            self.restart();
        }
    }

    fn restart(&mut self) {
        self.tally.restarts += 1;
        self.running = start(&self.settings);
        self.line.bytes.clear();
        self.ear = LinkServer::new();
        (self.asked_to_enable, self.asked_to_move) = (false, false);
        self.hello();
    }

    fn hello(&mut self) {
        self.send(&whole(Body::Hello));
    }

    /// Returns true if the line and the effects of its requests are as quiet as they have to be.
    fn is_clean(&self, allowed: Allowed) -> bool {
        match allowed {
            Allowed::Looking => !self.asked_to_enable && !self.asked_to_move,
            Allowed::Enabling => !self.asked_to_move,
            Allowed::Anything => true,
        }
    }
}

pub(crate) fn whole(body: Body) -> Vec<u8> {
    [vec![frame::DELIMITER], framed(&Request { id: 7, body })].concat()
}

/// A frame with a right CRC around any payload.
fn forged(payload: &[u8]) -> Vec<u8> {
    let crc = crc32fast::hash(payload).to_le_bytes();
    let mut encoded = vec![0; 2 * FRAME_BYTES];
    let length = cobs::encode(&[payload, &crc].concat(), &mut encoded);
    [&[frame::DELIMITER], &encoded[..length], &[frame::DELIMITER]].concat()
}

/// Makes of a request one that a machine may well take.
fn plausible(body: Body, noise: &mut Noise, paths: &[String]) -> Body {
    // A velocity may be so small that nothing that takes its time holds it.
    let slow = SLOWER[noise.below(SLOWER.len() as u64) as usize];
    let mut value = |most: f64| noise.counts(1_000) as f64 / 1_000.0 * most;
    match body {
        Body::Move { axis, .. } => Body::Move {
            axis,
            target_mm: value(20.0),
            velocity_mm_s: slow * value(60.0),
        },
        Body::Jog { axis, .. } => Body::Jog {
            axis,
            velocity_mm_s: slow * value(60.0),
        },
        Body::Home(axes) if axes.is_empty() => Body::Home(AxisSet::ALL),
        Body::Stream(StreamRequest::Open { period_ticks }) => Body::Stream(StreamRequest::Open {
            period_ticks: period_ticks % 200,
        }),
        Body::Stream(StreamRequest::Points {
            sequence,
            mut points,
            last,
        }) => {
            for axis in points.iter_mut().flat_map(|point| &mut point.axes) {
                axis.position_mm = value(0.01);
                axis.velocity_mm_s = value(0.1) as f32;
                axis.acceleration_mm_s2 = value(1.0) as f32;
            }
            Body::Stream(StreamRequest::Points {
                sequence: sequence % 16,
                points,
                last,
            })
        }
        Body::Settings(SettingsRequest::Set { .. }) => set_something(noise, paths),
        other => other,
    }
}

/// A setting set to what it is by default, or to something near in its bits.
fn set_something(noise: &mut Noise, paths: &[String]) -> Body {
    let path = &paths[noise.below(paths.len() as u64) as usize];
    let mut bytes = [0; MAX_VALUE_BYTES];
    let (kind, length) = StageSettings::simulated()
        .get_bytes(path, &mut bytes)
        .unwrap_or((0, 0));
    let mut bytes = bytes[..length].to_vec();
    if length > 0 && noise.below(2) == 0 {
        let at = noise.below(length as u64) as usize;
        bytes[at] ^= 1 << noise.below(8);
    }
    Body::Settings(SettingsRequest::Set {
        path: path.as_str().try_into().expect("a path of the tree fits"),
        value: Value {
            kind,
            bytes: bytes.into_iter().collect(),
        },
    })
}

/// The next bytes on the line.
fn next(noise: &mut Noise, allowed: Allowed, paths: &[String]) -> Vec<u8> {
    let forbidden = |body: &Body| match allowed {
        Allowed::Looking => *body == Body::Enable || starts_a_motion(body),
        Allowed::Enabling => starts_a_motion(body),
        Allowed::Anything => false,
    };
    match noise.below(8) {
        // A payload that is almost a request.
        0 => {
            let request = Request {
                id: noise.bits() as u16,
                body: traffic::body(noise),
            };
            let mut buffer = [0; PAYLOAD_BYTES];
            let posted = postcard::to_slice(&request, &mut buffer).expect("fits");
            let mut payload = [&[quadrant_link::PROTOCOL_VERSION], &*posted].concat();
            let at = noise.below(payload.len() as u64) as usize;
            payload[at] = noise.bits() as u8;
            payload.truncate(PAYLOAD_BYTES);
            match frame::decode::<Request>(&payload) {
                Ok(request) if forbidden(&request.body) || is_restart(&request.body, noise) => {
                    Vec::new()
                }
                _ => forged(&payload),
            }
        }
        1..=3 => {
            let body = traffic::body(noise);
            let body = plausible(body, noise, paths);
            if forbidden(&body) || is_restart(&body, noise) {
                return Vec::new();
            }
            whole(body)
        }
        _ => {
            let arrival = arrival(noise, 9);
            let body = &arrival.request.body;
            if arrival.copies > 0 && (forbidden(body) || is_restart(body, noise)) {
                return Vec::new();
            }
            arrival.bytes
        }
    }
}

fn is_restart(body: &Body, noise: &mut Noise) -> bool {
    *body == Body::Reboot && noise.below(RESTARTS) > 0
}

fn hostile(seed: u64, frames: u64, allowed: Allowed) -> Tally {
    let mut noise = Noise::new(seed);
    let mut bench = Bench::new();
    let mut paths = Vec::new();
    let listed = StageSettings::simulated().list("", &mut |path| paths.push(path.to_owned()));
    listed.expect("the tree lists itself");
    bench.hello();
    while bench.tally.frames < frames {
        let bytes = next(&mut noise, allowed, &paths);
        if !bytes.is_empty() {
            bench.send(&bytes);
        }
        // What one trouble took away, another may have put back: then that was asked for.
        if !bench.is_clean(allowed) {
            bench.restart();
        }
        match noise.below(64) {
            // Now and then the line is silent.
            0 => (0..noise.below(2_000)).for_each(|_| bench.tick()),
            // Somebody clears up, so that there is something to break again.
            1 => {
                bench.send(&whole(Body::ResetFault));
                if allowed != Allowed::Looking {
                    bench.send(&whole(Body::Enable));
                }
            }
            _ => {}
        }
    }
    bench.tally.answered = bench.line.answered;
    bench.tally
}

fn check(seed: u64, frames: u64) {
    for (number, allowed) in (0..).zip([Allowed::Looking, Allowed::Enabling, Allowed::Anything]) {
        let began = Instant::now();
        let tally = hostile(seed + number, frames / 3 + 1, allowed);
        println!(
            "{allowed:?}: {tally:?} in {:.1} s",
            began.elapsed().as_secs_f64()
        );
        assert_eq!(
            (tally.enabled_unasked, tally.moved_unasked),
            (0, 0),
            "{tally:?}"
        );
        assert!(tally.received > frames / 12, "{tally:?}");
        assert!(tally.answered > frames / 12, "{tally:?}");
        match allowed {
            Allowed::Looking => assert_eq!((tally.enabled_ticks, tally.moving_ticks), (0, 0)),
            Allowed::Enabling => {
                assert!(tally.enabled_ticks > tally.ticks / 20, "{tally:?}");
                assert_eq!(tally.moving_ticks, 0, "{tally:?}");
            }
            Allowed::Anything => assert!(tally.moving_ticks > tally.ticks / 100, "{tally:?}"),
        }
    }
}

#[test]
fn a_hostile_line_neither_enables_nor_moves_the_machine() {
    check(1, 30_000);
}

/// `cargo test -p quadrant-host --test suite ten_million -- --ignored --nocapture`
#[test]
#[ignore = "ten million frames take long"]
fn ten_million_frames_of_a_hostile_line() {
    check(100, 10_000_000);
}

// A frame is never longer than this, so the backlog holds whole ones.
const _: () = assert!(BACKLOG > FRAME_BYTES);
