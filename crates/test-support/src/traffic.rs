//! Traffic for the link: any request, and what a bad line makes of it.

use std::ops::{Deref, DerefMut};

use heapless::{String, Vec as Bounded};
use quadrant_link::frame::{self, FRAME_BYTES};
use quadrant_link::message::AxisName;
use quadrant_link::message::Channel;
use quadrant_link::message::{
    AxisPoint, AxisSet, Body, CaptureRequest, InjectRequest, Request, SetPoint, SettingsRequest,
    StreamRequest, TelemetryRequest, Value, Voltages,
};
use quadrant_link::message::{Edge, Level, Trigger};
use quadrant_link::message::{Harmonic, Motion, Plan, PointToPoint};

use quadrant_fault_bench::noise::Noise;

/// Draws requests.
struct Requests<'a>(&'a mut Noise);

impl Deref for Requests<'_> {
    type Target = Noise;

    fn deref(&self) -> &Noise {
        self.0
    }
}

impl DerefMut for Requests<'_> {
    fn deref_mut(&mut self) -> &mut Noise {
        self.0
    }
}

fn random_bytes(noise: &mut Noise, count: u64) -> Vec<u8> {
    (0..count).map(|_| noise.bits() as u8).collect()
}

impl Requests<'_> {
    fn real(&mut self) -> f64 {
        self.counts(1 << 30) as f64 / 1024.0
    }

    fn axis(&mut self) -> AxisName {
        AxisName::ALL[self.below(3) as usize]
    }

    fn text<const N: usize>(&mut self) -> String<N> {
        let length = self.below(N as u64 + 1);
        (0..length)
            .map(|_| char::from(b' ' + self.below(95) as u8))
            .collect()
    }

    fn value(&mut self) -> Value {
        let length = self.below(321);
        Value {
            kind: self.bits() as u8,
            bytes: (0..length).map(|_| self.bits() as u8).collect(),
        }
    }

    fn channels(&mut self) -> Bounded<Channel, 8> {
        let all: Vec<_> = Channel::all().collect();
        let count = self.below(9);
        (0..count)
            .map(|_| all[self.below(all.len() as u64) as usize])
            .collect()
    }

    fn motion(&mut self) -> Motion {
        match self.below(3) {
            0 => Motion::Hold,
            1 => Motion::Harmonic(Harmonic {
                amplitude_mm: self.real(),
                frequency_hz: self.real(),
                phase_rad: self.real(),
                cycles: (self.below(2) == 0).then(|| self.real()),
                lead_s: self.real(),
            }),
            _ => Motion::PointToPoint(PointToPoint {
                distance_mm: self.real(),
                max_velocity_mm_s: self.real(),
                max_acceleration_mm_s2: self.real(),
                max_jerk_mm_s3: self.real(),
            }),
        }
    }

    fn point(&mut self) -> SetPoint {
        SetPoint {
            axes: std::array::from_fn(|_| AxisPoint {
                position_mm: self.real(),
                velocity_mm_s: self.real() as f32,
                acceleration_mm_s2: self.real() as f32,
            }),
        }
    }

    fn stream(&mut self) -> StreamRequest {
        match self.below(3) {
            0 => StreamRequest::Open {
                period_ticks: self.bits() as u16,
            },
            1 => {
                let count = self.below(9);
                StreamRequest::Points {
                    sequence: self.bits() as u32,
                    points: (0..count).map(|_| self.point()).collect(),
                    last: self.below(2) == 0,
                }
            }
            _ => StreamRequest::Close,
        }
    }

    fn injection(&mut self) -> InjectRequest {
        match self.below(3) {
            0 => InjectRequest::Open {
                axis: self.axis(),
                open_loop: self.below(2) == 0,
                with_plan: self.below(2) == 0,
                limit_v: self.real(),
                travel_mm: self.real(),
                max_velocity_mm_s: self.real(),
            },
            1 => {
                let count = self.below(193);
                InjectRequest::Values {
                    sequence: self.bits() as u32,
                    values: Voltages::new((0..count).map(|_| self.bits() as i16)),
                    last: self.below(2) == 0,
                }
            }
            _ => InjectRequest::Close,
        }
    }

    fn settings(&mut self) -> SettingsRequest {
        match self.below(10) {
            0 => SettingsRequest::Get(self.text()),
            1 => SettingsRequest::Set {
                path: self.text(),
                value: self.value(),
            },
            2 => SettingsRequest::List {
                cursor: self.bits() as u16,
            },
            3 => SettingsRequest::Apply,
            4 => SettingsRequest::Revert,
            5 => SettingsRequest::Defaults,
            6 => SettingsRequest::Store(self.text()),
            7 => SettingsRequest::Provenance,
            8 => SettingsRequest::Edited {
                cursor: self.bits() as u16,
            },
            _ => SettingsRequest::GetInForce(self.text()),
        }
    }

    fn capture(&mut self) -> CaptureRequest {
        match self.below(4) {
            0 => CaptureRequest::Arm {
                channels: self.channels(),
                decimation: self.bits() as u16,
                pre_trigger_percent: self.bits() as u8,
                trigger: match self.below(5) {
                    0 => Trigger::Now,
                    1 => Trigger::Command,
                    2 => Trigger::Fault,
                    3 => Trigger::MotionStart,
                    _ => Trigger::Level(Level {
                        channel: Channel::all().next().expect("there are channels"),
                        edge: [Edge::Rising, Edge::Falling, Edge::Either][self.below(3) as usize],
                        level: self.real(),
                    }),
                },
            },
            1 => CaptureRequest::Disarm,
            2 => CaptureRequest::State,
            _ => CaptureRequest::Read {
                offset: self.bits() as u16,
            },
        }
    }

    /// Any request, all its numbers finite.
    fn body(&mut self) -> Body {
        match self.below(22) {
            0 => Body::Hello,
            1 => Body::Status,
            2 => Body::Fault,
            3 => Body::ResetFault,
            4 => Body::Enable,
            5 => Body::Disable,
            6 => Body::Stop,
            7 => Body::Home(AxisSet::try_from(self.below(8) as u8).expect("three bits")),
            8 => Body::Move {
                axis: self.axis(),
                target_mm: self.real(),
                velocity_mm_s: self.real(),
            },
            9 => Body::Jog {
                axis: self.axis(),
                velocity_mm_s: self.real(),
            },
            10 => Body::Run,
            11 => Body::SetPlan(Plan {
                motions: std::array::from_fn(|_| self.motion()),
            }),
            12 => Body::Stream(self.stream()),
            13 => Body::Settings(self.settings()),
            14 => Body::Telemetry(match self.below(2) {
                0 => TelemetryRequest::Select {
                    channels: self.channels(),
                    decimation: self.bits() as u16,
                },
                _ => TelemetryRequest::Stop,
            }),
            15 => Body::Capture(self.capture()),
            16 => Body::Inject(self.injection()),
            17 => Body::Inputs,
            18 => Body::Learning,
            19 => Body::Spindle { rpm: self.real() },
            20 => Body::Log {
                from: self.bits() as u32,
            },
            _ => Body::Reboot,
        }
    }
}

/// Any request.
pub fn body(noise: &mut Noise) -> Body {
    Requests(noise).body()
}

/// A frame after the line.
pub struct Arrival {
    /// The bytes that arrive.
    pub bytes: Vec<u8>,
    /// The request that was sent.
    pub request: Request,
    /// Number of times the bytes hold its frame, whole and by itself.
    pub copies: usize,
}

/// The frame of any request.
pub fn framed(request: &Request) -> Vec<u8> {
    let mut buffer = [0; FRAME_BYTES];
    let sent = frame::encode(request, &mut buffer);
    sent.expect("every request fits a frame").to_vec()
}

/// The next frame over a bad line. One in two arrives as it was sent; a zero goes before it, as after every trouble.
pub fn arrival(noise: &mut Noise, id: u16) -> Arrival {
    let request = Request {
        id,
        body: body(noise),
    };
    let mut bytes = framed(&request);
    let mut copies = 0;
    match noise.below(12) {
        0..=5 => copies = 1,
        6 => copies = 2,
        7 => {
            // Distinct bits, so that no flip undoes another.
            let first = noise.below(bytes.len() as u64) as usize;
            for index in 0..1 + noise.below(8) as usize {
                let length = bytes.len();
                bytes[(first + index) % length] ^= 1 << noise.below(8);
            }
        }
        // The closing zero alone does not make the difference: the next frame brings one.
        8 => bytes.truncate(noise.below(bytes.len() as u64 - 1) as usize),
        9 => {
            bytes.remove(noise.below(bytes.len() as u64 - 1) as usize);
        }
        10 => {
            let place = 1 + noise.below(bytes.len() as u64 - 2) as usize;
            let length = 1 + noise.below(20);
            bytes.splice(place..place, random_bytes(noise, length));
        }
        _ => {
            let length = noise.below(700);
            bytes = random_bytes(noise, length);
        }
    }
    if copies > 0 {
        bytes = [vec![frame::DELIMITER], bytes.repeat(copies)].concat();
    }
    Arrival {
        bytes,
        request,
        copies,
    }
}
