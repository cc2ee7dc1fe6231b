//! The reference under any request of a host: in no tick does it go faster than the settings allow, in any order of
//! streams, moves, plans, jogs and stops.

use quadrant::app::Translated;
use quadrant_law::axes::AxisName;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};
use quadrant_law::units::{POSITION_FRACTION_BITS, Position};
use quadrant_link::message::{self, AxisPoint, AxisSet, Body, SetPoint, StreamRequest};
use quadrant_settings::PlanSettings;
use quadrant_test_support::Noise;

use crate::hostile_link::{Bench, whole};

/// Requests that are made.
const REQUESTS: u32 = 20_000;
/// Longest time from one request to the next, ticks.
const LONGEST_PAUSE: u64 = 400;
/// Largest velocity of an axis, mm/s: little more than the requests ask for, so that a jump shows.
const MOST_MM_S: f64 = 60.0;
/// Points of a stream: from few that start only with the last to more than the machine holds.
const POINTS: u64 = 20;

/// The references of a tick.
#[derive(Clone, Copy, Default)]
struct Seen {
    tick: u32,
    references: [Position; 3],
    homed: [bool; 3],
    enabled: bool,
}

struct Host {
    bench: Bench,
    noise: Noise,
    seen: Seen,
    /// Largest displacement in a tick that an axis may make, and the largest that it made.
    allowed: [i64; 3],
    largest: [i64; 3],
    /// The stream that was opened last, and how much of it was sent.
    points: Vec<SetPoint>,
    sent: usize,
    /// Ticks in which a stream was followed.
    streamed: u32,
}

impl Host {
    fn new(seed: u64) -> Self {
        let bench = Bench::with(|settings| {
            for axis in &mut settings.axes {
                axis.limits.max_velocity_mm_s = MOST_MM_S;
            }
        });
        let rate_hz = bench.settings.rate_hz;
        let allowed = bench.settings.axes.each_ref().map(|axis| {
            let fastest_mm = axis.limits.max_velocity_mm_s / rate_hz;
            // A count more, for rounding.
            Position::from_mm(fastest_mm, axis.encoder.resolution_mm).0
                + (1 << POSITION_FRACTION_BITS)
        });
        let mut host = Self {
            bench,
            noise: Noise::new(seed),
            seen: Seen::default(),
            allowed,
            largest: [0; 3],
            points: Vec::new(),
            sent: 0,
            streamed: 0,
        };
        host.ask(Body::Hello);
        host.ask(Body::Enable);
        host.run(100);
        host.ask(Body::Home(AxisSet::ALL));
        host.run(100);
        while host.bench.running.state().is_running() {
            host.ask(Body::Status);
            host.run(1000);
        }
        assert_eq!(host.seen.homed, [true; 3]);
        host
    }

    fn ask(&mut self, body: Body) {
        self.bench.send(&whole(body));
    }

    fn run(&mut self, ticks: u64) {
        for _ in 0..ticks {
            self.bench.tick();
            self.look();
        }
    }

    /// Compares the references with those of the tick before, unless homing or enabling restarted them, or a full line
    /// let ticks pass.
    fn look(&mut self) {
        let state = self.bench.running.state();
        let axes = state.axes().by_ref().into_array();
        let now = Seen {
            tick: state.tick(),
            references: axes.map(|axis| axis.reference()),
            homed: axes.map(|axis| axis.is_homed()),
            enabled: state.safety().drives(),
        };
        let modes = axes.map(|axis| axis.mode());
        let before = std::mem::replace(&mut self.seen, now);
        self.streamed += u32::from(modes.contains(&MotionMode::Stream));
        let goes_on = now.tick == before.tick + 1 && before.enabled && now.enabled;
        if !goes_on || before.homed != now.homed {
            return;
        }
        for (axis, name) in AxisName::ALL.into_iter().enumerate() {
            let way = (now.references[axis] - before.references[axis]).0.abs();
            let allowed = self.allowed[axis];
            assert!(
                way <= allowed,
                "{name}: {way} units in a tick, more than {allowed}, in {:?}",
                modes[axis]
            );
            self.largest[axis] = self.largest[axis].max(way);
        }
    }

    /// A number from `least` to `most`, as likely in each decade.
    fn logarithmic(&mut self, least: f64, most: f64) -> f64 {
        let share = self.noise.below(1 << 20) as f64 / f64::from(1 << 20);
        least * (most / least).powf(share)
    }

    fn signed(&mut self, most: f64) -> f64 {
        self.noise.counts(1 << 20) as f64 / f64::from(1 << 20) * most
    }

    /// Mostly one that an axis can have, down to the smallest that there is.
    fn velocity_mm_s(&mut self) -> f64 {
        match self.noise.below(8) {
            0 => f64::MIN_POSITIVE,
            1 => self.logarithmic(1e-300, 1e-3),
            2 => self.logarithmic(1e-7, 1.0),
            _ => self.logarithmic(1.0, MOST_MM_S),
        }
    }

    fn place_mm(&self, axis: usize) -> f64 {
        self.seen.references[axis].to_mm(self.bench.settings.axes[axis].encoder.resolution_mm)
    }

    fn axis(&mut self) -> message::AxisName {
        message::AxisName::ALL[self.noise.below(3) as usize]
    }

    /// A stream from where the axes are, along the polynomial that rests at both ends.
    fn draw_stream(&mut self, period_ticks: u16) {
        let points = 2 + self.noise.below(POINTS - 1);
        let period_s = f64::from(period_ticks) / self.bench.settings.rate_hz;
        let duration_s = points as f64 * period_s;
        let from: [f64; 3] = std::array::from_fn(|axis| self.place_mm(axis));
        // Its peaks are 1.9 D / T and 5.8 D / T^2.
        let most_mm = (20.0 * duration_s).min(80.0 * duration_s * duration_s);
        let way = [(); 3].map(|()| self.signed(most_mm));
        self.points = (1..=points)
            .map(|number| {
                let u = number as f64 / points as f64;
                let share = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
                let speed = 30.0 * u * u * (1.0 - u) * (1.0 - u) / duration_s;
                let bend = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (duration_s * duration_s);
                SetPoint {
                    axes: std::array::from_fn(|axis| AxisPoint {
                        position_mm: from[axis] + way[axis] * share,
                        velocity_mm_s: (way[axis] * speed) as f32,
                        acceleration_mm_s2: (way[axis] * bend) as f32,
                    }),
                }
            })
            .collect();
        self.sent = 0;
    }

    fn next_points(&mut self) -> Body {
        let end = (self.sent + 1 + self.noise.below(8) as usize).min(self.points.len());
        let points = self.points[self.sent..end].iter().cloned().collect();
        let sequence = self.sent as u32;
        self.sent = end;
        Body::Stream(StreamRequest::Points {
            sequence,
            points,
            last: end == self.points.len(),
        })
    }

    fn motion(&mut self) -> MotionSettings {
        match self.noise.below(3) {
            0 => MotionSettings::Hold,
            1 => MotionSettings::PointToPoint(PointToPointSettings {
                distance_mm: self.signed(5.0),
                max_velocity_mm_s: self.velocity_mm_s(),
                max_acceleration_mm_s2: self.logarithmic(1e-3, 500.0),
                max_jerk_mm_s3: self.logarithmic(1e-3, 1e6),
            }),
            _ => MotionSettings::Harmonic(HarmonicSettings {
                amplitude_mm: self.logarithmic(1e-6, 5.0),
                frequency_hz: self.logarithmic(1e-6, 5.0),
                phase_rad: self.signed(3.0),
                cycles: (self.noise.below(2) == 0).then(|| self.logarithmic(1e-3, 10.0)),
                lead_s: self.logarithmic(1e-3, 10.0),
            }),
        }
    }

    fn request(&mut self) -> Body {
        match self.noise.below(24) {
            0..=4 => {
                let period_ticks = 10 + self.noise.below(150) as u16;
                self.draw_stream(period_ticks);
                Body::Stream(StreamRequest::Open { period_ticks })
            }
            5..=14 => self.next_points(),
            15 => Body::Stream(StreamRequest::Close),
            16 | 17 => {
                let axis = self.axis();
                Body::Move {
                    axis,
                    target_mm: self.place_mm(axis as usize) + self.signed(2.0),
                    velocity_mm_s: self.velocity_mm_s(),
                }
            }
            18 => Body::SetPlan(Translated::translated(PlanSettings {
                motions: [(); 3].map(|()| self.motion()),
            })),
            19 => Body::Run,
            20 => {
                let sign = if self.noise.below(2) == 0 { -1.0 } else { 1.0 };
                Body::Jog {
                    axis: self.axis(),
                    velocity_mm_s: sign * self.velocity_mm_s(),
                }
            }
            _ => Body::Stop,
        }
    }
}

#[test]
fn no_order_of_requests_moves_a_reference_faster_than_the_settings_allow() {
    let mut host = Host::new(1);
    for _ in 0..REQUESTS {
        let body = host.request();
        host.ask(body);
        let pause = match host.noise.below(3) {
            0 => 0,
            1 => host.noise.below(40),
            _ => host.noise.below(LONGEST_PAUSE),
        };
        host.run(pause);
        if host.noise.below(20) == 0 {
            host.ask(Body::ResetFault);
            host.ask(Body::Enable);
        }
    }
    println!(
        "{:?} of {:?}, {} ticks streamed",
        host.largest, host.allowed, host.streamed
    );
    assert!(host.streamed > 10_000, "{}", host.streamed);
    for axis in 0..3 {
        assert!(host.largest[axis] > host.allowed[axis] / 20);
    }
}
