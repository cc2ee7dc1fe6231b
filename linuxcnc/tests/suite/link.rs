//! The link of a component that ticks.

use std::fs;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use quadrant_host::client::{Client, settings, test_axis::ConnectedAxis};
use quadrant_host::machine::TcpTransport;
use quadrant_law::reference::MotionSettings;
use quadrant_link::message::{AxisMode, AxisName, Body, MachineState, Notice};
use quadrant_tune::test_axis::{Drive, Experiment, TestAxis, Travel};

use crate::component::{Component, Parameters};

/// A port that is free.
fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port()
}

/// A component that ticks in a thread of its own, and its host.
struct Ticking {
    ends: Arc<AtomicBool>,
    /// LinuxCNC's machine is on.
    on: Arc<AtomicBool>,
    thread: JoinHandle<Component>,
    client: Client,
}

impl Ticking {
    fn start() -> Self {
        Self::with_store(None)
    }

    fn with_store(store: Option<PathBuf>) -> Self {
        let port = free_port();
        let [ends, on] = [(); 2].map(|()| Arc::new(AtomicBool::new(false)));
        let (ended, enable) = (Arc::clone(&ends), Arc::clone(&on));
        let (ready, is_ready) = mpsc::channel();
        let thread = thread::spawn(move || {
            let mut component = Component::start(&Parameters {
                port: port.into(),
                store,
                ..Parameters::default()
            });
            ready.send(()).unwrap();
            while !ended.load(Ordering::Relaxed) {
                component.step(enable.load(Ordering::Relaxed));
                thread::sleep(Duration::from_micros(200));
            }
            component
        });
        is_ready.recv().unwrap();
        let transport = TcpTransport::connect(&format!("127.0.0.1:{port}")).unwrap();
        let client = Client::open(transport).unwrap();
        Self {
            ends,
            on,
            thread,
            client,
        }
    }

    /// The events so far, a line each.
    fn events(&mut self) -> String {
        let notices = self.client.take_notices();
        let events = notices.filter_map(|notice| match notice {
            Notice::Event { event, .. } => Some(format!("{event}\n")),
            _ => None,
        });
        events.collect()
    }

    /// Ends the ticks; returns the component as they left it.
    fn end(self) -> Component {
        self.ends.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

// SAFETY: its pointers are used by one thread at a time.
unsafe impl Send for Component {}

#[test]
fn a_host_talks_to_the_component_while_it_ticks() {
    let ticking = Ticking::start();
    assert_eq!(ticking.client.identity().board.as_str(), "linuxcnc");
    ticking.end();
}

#[test]
fn a_machine_that_is_switched_on_while_a_host_moves_switches_all_off_and_leads_at_the_next_time() {
    let mut ticking = Ticking::start();
    ticking.client.order(Body::Enable).unwrap();
    let jog = Body::Jog {
        axis: AxisName::X,
        velocity_mm_s: 1.0,
    };
    ticking.client.order(jog).unwrap();
    assert_eq!(ticking.client.status().unwrap().axes[0].mode, AxisMode::Jog);
    ticking.on.store(true, Ordering::Relaxed);
    thread::sleep(Duration::from_millis(200));
    let status = ticking.client.status().unwrap();
    assert_eq!(status.state, MachineState::Disabled);
    let events = ticking.events();
    let text = "fault 104 under LinuxCNC: a host drove the axes";
    assert!(events.contains(text), "{events}");
    for on in [false, true] {
        ticking.on.store(on, Ordering::Relaxed);
        thread::sleep(Duration::from_millis(500));
    }
    for axis in &ticking.client.status().unwrap().axes {
        assert_eq!(axis.mode, AxisMode::Plan);
    }
    let component = ticking.end();
    assert!(component.pins.driven && !component.pins.joints[0].faulted);
}

#[test]
fn an_experiment_ends_at_once_when_the_machine_is_switched_on() {
    let mut ticking = Ticking::start();
    let on = Arc::clone(&ticking.on);
    let travel = Travel::either_way(5.0);
    let mut axis =
        ConnectedAxis::new(&mut ticking.client, quadrant_law::axes::AxisName::X, travel).unwrap();
    let experiment = Experiment {
        name: "rest".to_owned(),
        drive: Drive::ClosedLoop(MotionSettings::Hold),
        injection_v: vec![0.001; 4 * 8_000],
        decimation: 4,
        time_limit_s: 30.0,
    };
    let switch = thread::spawn(move || {
        thread::sleep(Duration::from_millis(500));
        on.store(true, Ordering::Relaxed);
    });
    let began = Instant::now();
    let error = axis
        .perform(&experiment, &mut |_| {})
        .unwrap_err()
        .to_string();
    assert!(error.contains("outputs went off"), "{error}");
    assert!(began.elapsed() < Duration::from_secs(5));
    switch.join().unwrap();
    ticking.end();
}

#[test]
fn an_interruption_of_a_host_that_moves_nothing_leaves_the_joints_to_linuxcnc() {
    let mut ticking = Ticking::start();
    ticking.on.store(true, Ordering::Relaxed);
    thread::sleep(Duration::from_millis(200));
    let interrupt = ticking.client.interrupt();
    interrupt.request();
    ticking.client.wait(Duration::from_millis(50)).unwrap_err();
    thread::sleep(Duration::from_millis(200));
    assert!(ticking.end().pins.driven);
}

#[test]
fn a_host_that_stops_a_joint_that_linuxcnc_leads_switches_it_off_and_shows_it() {
    let mut ticking = Ticking::start();
    ticking.on.store(true, Ordering::Relaxed);
    thread::sleep(Duration::from_millis(200));
    ticking.client.order(Body::Stop).unwrap();
    thread::sleep(Duration::from_millis(200));
    let component = ticking.end();
    assert_eq!(component.outputs(), [0.0; 3]);
    assert_eq!(
        component.pins.joints[0].fault,
        quadrant_linuxcnc::fault::ENDED
    );
}

#[test]
fn a_store_that_cannot_be_written_is_refused_and_shown_on_a_pin() {
    for is_there in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        let below = folder.path().join("below");
        fs::create_dir(&below).unwrap();
        let mut ticking = Ticking::with_store(Some(below.join("settings.store")));
        if !is_there {
            fs::remove_dir_all(&below).unwrap();
        }
        let stored = settings::store(&mut ticking.client, "");
        assert_eq!(stored.is_ok(), is_there);
        thread::sleep(Duration::from_millis(300));
        assert_eq!(ticking.end().pins.store_failed, !is_there);
    }
}

#[test]
fn a_client_that_floods_changes_no_output() {
    let port = free_port();
    let mut quiet = Component::start(&Parameters::default());
    let mut flooded = Component::start(&Parameters {
        port: port.into(),
        ..Parameters::default()
    });
    let mut client = TcpStream::connect(("127.0.0.1", port)).unwrap();
    client.set_nonblocking(true).unwrap();
    let rubbish: Vec<u8> = (0..65_536_u32)
        .map(|index| (index.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let mut sent = 0;
    for tick in 0..20_000 {
        sent += client.write(&rubbish).unwrap_or(0);
        quiet.step(tick > 10);
        flooded.step(tick > 10);
        assert_eq!(quiet.outputs(), flooded.outputs(), "{tick}");
    }
    assert!(sent > 100_000, "{sent}");
    assert!(flooded.pins.driven);
}
