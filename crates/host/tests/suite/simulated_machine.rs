//! A session with the firmware's application, through its port alone.

use quadrant_host::machine::simulated::SimulatedMachine;
use quadrant_law::safety::Switches;
use quadrant_link::frame::{self, FRAME_BYTES, Receiver};
use quadrant_link::message::{AxisName, Channel, MachineState};
use quadrant_link::message::{
    AxisSet, Body, CaptureRequest, Event, LinkError, Message, Notice, Reply, Request, Response,
    SettingsRequest, Status, StreamRequest, TelemetryRequest, Value,
};
use quadrant_settings::{MAX_VALUE_BYTES, StageSettings};
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::plant::StageParameters;

struct Session {
    machine: SimulatedMachine,
    receiver: Receiver,
    notices: Vec<Notice>,
    id: u16,
}

impl Session {
    fn open() -> Self {
        let mut settings = identified_settings().unwrap().stage;
        // Commissioning does not say where the switches are.
        for (axis, default) in settings
            .axes
            .iter_mut()
            .zip(StageSettings::simulated().axes)
        {
            axis.homing = default.homing;
            axis.limits.travel_mm = default.limits.travel_mm;
        }
        let machine = SimulatedMachine::new(&settings, &StageParameters::real(), 1).unwrap();
        let mut session = Self {
            machine,
            receiver: Receiver::new(),
            notices: Vec::new(),
            id: 0,
        };
        session.machine.run(100);
        session.done(Body::Hello);
        session
    }

    fn ask(&mut self, body: Body) -> Result<Reply, LinkError> {
        self.id += 1;
        let mut buffer = [0; FRAME_BYTES];
        let request = Request { id: self.id, body };
        self.machine
            .send(frame::encode(&request, &mut buffer).unwrap());
        for _ in 0..100 {
            for message in self.receive(10) {
                match message {
                    Message::Response(Response { id, result }) => {
                        assert_eq!(id, self.id);
                        return result;
                    }
                    Message::Notice(notice) => self.notices.push(notice),
                }
            }
        }
        panic!("no answer within 1000 ticks");
    }

    fn receive(&mut self, ticks: u32) -> Vec<Message> {
        self.machine.run(ticks);
        let bytes = self.machine.receive();
        let mut messages = Vec::new();
        for byte in bytes {
            if let Some(payload) = self.receiver.push(byte) {
                messages.push(frame::decode(payload).unwrap());
            }
        }
        messages
    }

    fn run(&mut self, ticks: u32) {
        let messages = self.receive(ticks);
        self.notices
            .extend(messages.into_iter().filter_map(|message| match message {
                Message::Notice(notice) => Some(notice),
                Message::Response(_) => None,
            }));
    }

    fn done(&mut self, body: Body) -> Reply {
        let name = body.name();
        self.ask(body)
            .unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn refused(&mut self, body: Body) -> String {
        self.ask(body).unwrap_err().to_string()
    }

    fn status(&mut self) -> Status {
        match self.done(Body::Status) {
            Reply::Status(status) => status,
            other => panic!("{other:?}"),
        }
    }

    fn until_rest(&mut self) {
        for _ in 0..1000 {
            self.run(1000);
            if !self.status().running {
                return;
            }
        }
        panic!("the axes never rest");
    }

    fn events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.notices)
            .into_iter()
            .filter_map(|notice| match notice {
                Notice::Event { event, .. } => Some(event),
                _ => None,
            })
            .collect()
    }

    fn get(&mut self, path: &str) -> String {
        let name = path.to_owned();
        let path = path.try_into().unwrap();
        match self.done(Body::Settings(SettingsRequest::Get(path))) {
            Reply::Value(value) => {
                let mut settings = StageSettings::simulated();
                settings.set_bytes(&name, value.kind, &value.bytes).unwrap();
                let mut text = [0; 1536];
                let length = settings.get_json(&name, &mut text).unwrap();
                String::from_utf8(text[..length].to_vec()).unwrap()
            }
            other => panic!("{other:?}"),
        }
    }

    fn set(&mut self, path: &str, value: &str) {
        let mut settings = StageSettings::simulated();
        settings.set_json(path, value.as_bytes()).unwrap();
        let mut bytes = [0; MAX_VALUE_BYTES];
        let (kind, length) = settings.get_bytes(path, &mut bytes).unwrap();
        let bytes = heapless::Vec::from_slice(&bytes[..length]).unwrap();
        self.done(Body::Settings(SettingsRequest::Set {
            path: path.try_into().unwrap(),
            value: Value { kind, bytes },
        }));
    }
}

#[test]
fn a_session_homes_moves_streams_changes_a_gain_and_survives_a_restart() {
    let mut session = Session::open();
    assert_eq!(session.status().state, MachineState::Disabled);
    assert!(
        session
            .refused(Body::Home(AxisSet::ALL))
            .contains("enable them first")
    );
    session.done(Body::Enable);
    session.run(100);
    session.done(Body::Home(AxisSet::ALL));
    session.run(100);
    assert_eq!(session.status().state, MachineState::Homing);
    session.until_rest();
    assert_eq!(session.status().state, MachineState::Enabled);
    assert_eq!(session.status().homed, AxisSet::ALL);
    let events = session.events();
    assert!(events.contains(&Event::Homed(AxisName::Z)), "{events:?}");

    // A gain changes while an axis moves, and the output does not jump.
    session.done(Body::Jog {
        axis: AxisName::X,
        velocity_mm_s: 10.0,
    });
    // A jog needs its host, who is silent for half a second at most.
    session.run(4000);
    session.set("/axes/0/feedback/pid/kp_v_per_mm", "0.9");
    session.done(Body::Settings(SettingsRequest::Apply));
    let mut before = session.machine.outputs().codes[0].0;
    for _ in 0..2000 {
        session.run(1);
        let now = session.machine.outputs().codes[0].0;
        // 0.3 V is what an encoder count makes through the derivative, many times over.
        assert!(now.abs_diff(before) < 1000, "{before} {now}");
        before = now;
    }
    let x = [AxisName::X].into_iter().collect();
    assert!(session.events().contains(&Event::SettingsApplied(x)));
    session.done(Body::Stop);
    session.until_rest();
    assert_eq!(session.status().fault, None);

    session.done(Body::Move {
        axis: AxisName::X,
        target_mm: 12.5,
        velocity_mm_s: 20.0,
    });
    session.run(100);
    session.until_rest();
    let position = session.status().axes[0].position_mm;
    assert!((position - 12.5).abs() < 0.003, "{position}");

    // Not while the outputs are on: writing flash stops the processor.
    let store = || Body::Settings(SettingsRequest::Store("a test".try_into().unwrap()));
    assert!(session.refused(store()).contains("disable"));
    session.done(Body::Disable);
    session.run(100);
    session.done(store());
    session.done(Body::Reboot);
    session.run(100);
    assert!(matches!(session.ask(Body::Status), Err(LinkError::NoHello)));
    session.done(Body::Hello);
    assert_eq!(session.get("/axes/0/feedback/pid/kp_v_per_mm"), "0.9");
    assert_eq!(session.status().homed, AxisSet::NONE);
}

#[test]
fn an_emergency_stop_is_latched_with_its_trace_until_it_is_released_and_reset() {
    let mut session = Session::open();
    session.done(Body::Enable);
    session.done(Body::Jog {
        axis: AxisName::Y,
        velocity_mm_s: 10.0,
    });
    // A jog needs its host, who is silent for half a second at most.
    session.run(4000);
    session.machine.press(Switches::EMERGENCY_STOP);
    session.run(1);
    assert!(!session.machine.outputs().enabled);
    assert!(
        session
            .machine
            .outputs()
            .codes
            .iter()
            .all(|code| code.0 == 0)
    );
    session.run(3000);
    let Reply::Fault(Some(fault)) = session.done(Body::Fault) else {
        panic!("no fault")
    };
    assert_eq!((fault.name.as_str(), fault.code), ("emergency-stop", 4));
    assert!(fault.captured);
    let Reply::Words(page) = session.done(Body::Capture(CaptureRequest::Read { offset: 0 })) else {
        panic!("no words")
    };
    assert!(!page.words.is_empty());
    assert!(session.refused(Body::Enable).contains("reset"));
    session.done(Body::ResetFault);
    session.run(100);
    assert!(session.refused(Body::Enable).contains("emergency stop"));
    session.machine.press(Switches::NONE);
    session.run(100);
    session.done(Body::Enable);
    session.run(100);
    assert_eq!(session.status().state, MachineState::Enabled);
}

#[test]
fn samples_come_without_a_gap_as_long_as_the_line_carries_them() {
    let mut session = Session::open();
    let channel: Channel = "x.error".parse().unwrap();
    session.done(Body::Telemetry(TelemetryRequest::Select {
        channels: [channel].into_iter().collect(),
        decimation: 10,
    }));
    session.run(20_000);
    let mut next = 0;
    for notice in &session.notices {
        if let Notice::Telemetry(block) = notice {
            assert_eq!((block.sequence, block.dropped), (next, 0));
            next += block.words.len() as u32;
        }
    }
    assert!((1_990..=2_000).contains(&next), "{next}");
}

#[test]
fn a_move_that_lasts_longer_than_the_tick_counter_is_refused() {
    let mut session = Session::open();
    session.done(Body::Enable);
    session.run(100);
    session.done(Body::Home([AxisName::X].into_iter().collect()));
    session.until_rest();
    let to = |target_mm, velocity_mm_s| Body::Move {
        axis: AxisName::X,
        target_mm,
        velocity_mm_s,
    };
    for (velocity_mm_s, field) in [
        (1e-4, "x/motion (duration, s) = "),
        (3e-5, "x/motion (duration, s) = "),
        (f64::MIN_POSITIVE, "x/motion/max_velocity_mm_s = "),
    ] {
        let text = session.refused(to(100.0, velocity_mm_s));
        assert!(text.contains(field), "{text}");
        assert!(text.contains(" is outside "), "{text}");
    }
    let before = session.status().axes[0].position_mm;
    session.run(3000);
    assert_eq!(session.status().state, MachineState::Enabled);
    assert!((session.status().axes[0].position_mm - before).abs() < 2e-3);
    // One that lasts 55 hours is none of them.
    session.done(to(100.0, 1e-3));
    session.run(1000);
    session.done(Body::Stop);
    session.until_rest();
    session.done(to(1.0, 20.0));
    session.until_rest();
    session.done(to(1.0, 20.0));
    session.until_rest();
    assert_eq!(session.status().state, MachineState::Enabled);
}

#[test]
fn a_stream_whose_host_falls_silent_brakes_and_latches() {
    let mut session = Session::open();
    session.done(Body::Enable);
    session.run(100);
    session.done(Body::Stream(StreamRequest::Open { period_ticks: 100 }));
    let mut sequence = 0;
    // A slow ramp on x, without an end.
    for _ in 0..6 {
        let points = (0..8)
            .map(|k| {
                let mut point = quadrant_link::message::SetPoint::default();
                let t = 0.01 * f64::from(sequence + k + 1);
                let rise = t.min(0.5);
                point.axes[0].position_mm = rise * rise + (t - rise) * 1.0;
                point.axes[0].velocity_mm_s = (2.0 * rise) as f32;
                point.axes[0].acceleration_mm_s2 = if t < 0.5 { 2.0 } else { 0.0 };
                point
            })
            .collect();
        let Reply::Stream(status) = session.done(Body::Stream(StreamRequest::Points {
            sequence,
            points,
            last: false,
        })) else {
            panic!()
        };
        sequence = status.next_sequence;
        session.run(600);
    }
    session.run(30_000);
    let status = session.status();
    assert_eq!(status.state, MachineState::Fault);
    assert!([16, 17].contains(&status.fault.unwrap()), "{status:?}");
    assert!(status.axes[0].position_mm > 0.1);
}
