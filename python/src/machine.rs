//! Machines: a session on a thread of its own, which Python asks.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use numpy::IntoPyArray;
use pyo3::exceptions::{
    PyConnectionError, PyKeyError, PyRuntimeError, PyTimeoutError, PyValueError,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadrant_host::client::columns::values_mm;
use quadrant_host::client::samples::{TelemetryRecorder, least_decimation};
use quadrant_host::client::settings::{ExchangeError, resolutions_mm};
use quadrant_host::client::{Client, ClientError, Interrupt, settings, settle};
use quadrant_host::machine::Machine as Measured;
use quadrant_host::machine::{EmulatedLink, SerialTransport, SimulatedLink, TcpTransport};
use quadrant_law::axes::AxisName;
use quadrant_law::reference::MotionSettings;
use quadrant_link::message::{
    AxisName as LinkAxis, AxisSet, Body, Channel, Harmonic, Motion as LinkMotion, Plan,
    PointToPoint, Status,
};
use quadrant_settings::StageSettings;
use quadrant_sim::stage_setup::StageSetup;
use quadrant_tune::commission::CommissionSettings;
use quadrant_tune::test_axis::{TestAxis, Travel};

use crate::commission::{self, FrfRequest};
use crate::references::Motion;
use crate::settings::{Settings, axis_name};
use crate::stage::Stage;
use crate::{errors, json};

/// Something that the session's thread does.
type Job = Box<dyn FnOnce(&mut Client) + Send>;

/// Time between two looks for signals, and at the machine while nothing is asked of it.
const LOOK: Duration = Duration::from_millis(50);
/// Time between two looks whether a session has ended.
const CLOSING: Duration = Duration::from_millis(1);
/// Longest time for which an interrupted request, or the end of a session, is waited for.
const GIVE_UP: Duration = Duration::from_secs(5);

/// Place at which a machine is reached.
enum Place {
    Simulated(Box<StageSetup>, u64, Option<PathBuf>),
    Emulated(PathBuf, Box<StageSetup>, u64, Option<PathBuf>),
    Serial(String),
    Tcp(String),
}

impl Place {
    fn open(self) -> Result<Client, String> {
        let client = match self {
            Self::Simulated(setup, seed, flash) => {
                let link = SimulatedLink::start(&setup, seed, flash.as_deref());
                Client::open(link.map_err(|error| error.to_string())?)
            }
            Self::Emulated(image, setup, seed, flash) => {
                let link = EmulatedLink::start(&image, &setup, seed, flash.as_deref());
                Client::open(link.map_err(|error| error.to_string())?)
            }
            Self::Serial(path) => {
                let port = SerialTransport::open(&path).map_err(|error| {
                    format!(
                        "serial port {path} cannot be opened: {error}; check the cable, the name, that no other program has it, and that you \
                         may use it (group dialout)"
                    )
                })?;
                Client::open(port)
            }
            Self::Tcp(address) => {
                let socket = TcpTransport::connect(&address).map_err(|error| {
                    format!(
                        "tcp:{address} does not answer: {error}; check the address and that the machine runs"
                    )
                })?;
                Client::open(socket)
            }
        };
        client.map_err(|error| errors::words(&error))
    }
}

/// A session with a machine.
#[pyclass(module = "quadrant", name = "Session", frozen)]
#[derive(Debug)]
pub(crate) struct Session {
    jobs: Mutex<Option<Sender<Job>>>,
    interrupt: Interrupt,
    endpoint: String,
    /// Requests that have no answer yet.
    asked: AtomicUsize,
    /// The process that opened it, and its thread there.
    process: u32,
    thread: JoinHandle<()>,
}

/// The exception of an error of a session.
fn client_error(error: ClientError) -> PyErr {
    match error {
        ClientError::Fault {
            code,
            ref name,
            axis,
            tick,
            ref cause,
            ref remedy,
            ..
        } => errors::fault_in_words((code, name), axis, Some(tick), (cause, remedy)),
        ClientError::Connection { .. }
        | ClientError::Silent { .. }
        | ClientError::Unsure { .. }
        | ClientError::Version { .. }
        | ClientError::Restarted { .. }
        | ClientError::Unexpected { .. } => PyConnectionError::new_err(errors::words(&error)),
        ClientError::TimedOut { .. } => PyTimeoutError::new_err(errors::words(&error)),
        ClientError::Setting { .. } | ClientError::TooLong { .. } => {
            PyValueError::new_err(errors::words(&error))
        }
        other => PyRuntimeError::new_err(errors::words(&other)),
    }
}

fn exchange_error(error: ExchangeError) -> PyErr {
    PyValueError::new_err(errors::words(&error))
}

/// The session's thread: does what it is asked, and shows the machine meanwhile that its host is there.
fn serve(mut client: Client, jobs: &Receiver<Job>) {
    loop {
        match jobs.recv_timeout(LOOK) {
            Ok(job) => {
                // A person has given another command.
                client.resume();
                job(&mut client);
            }
            Err(RecvTimeoutError::Timeout) => {
                if client.moves() {
                    // A broken connection shows at the next request.
                    let _ = client.keep_alive();
                }
            }
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

/// Waits for an answer, and looks for signals meanwhile; at an interrupt `give_up` is done. Nothing if there will be none.
fn answered<T>(answers: &Receiver<T>, give_up: impl FnOnce()) -> PyResult<Option<T>> {
    loop {
        match answers.recv_timeout(LOOK) {
            Ok(answer) => return Ok(Some(answer)),
            Err(RecvTimeoutError::Timeout) => {
                if let Err(error) = Python::attach(|py| py.check_signals()) {
                    give_up();
                    return Err(error);
                }
            }
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
        }
    }
}

impl Session {
    /// Has the session's thread do something; an interrupt stops the axes.
    fn ask<T: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Client) -> T + Send + 'static,
    ) -> PyResult<T> {
        if thread::current().id() == self.thread.thread().id() {
            return Err(PyRuntimeError::new_err(
                "the machine is busy with what calls this function, such as a commissioning its progress",
            ));
        }
        if self.is_of_another_process() {
            return Err(PyConnectionError::new_err(
                "the machine was opened by another process: open it in this one",
            ));
        }
        let (answer, answers) = channel();
        let job: Job = Box::new(move |client| {
            // Nobody waits for it after an interrupt.
            let _ = answer.send(work(client));
        });
        let closed = || PyConnectionError::new_err("the machine is closed: open it again");
        let sent = match self.jobs.lock() {
            Ok(jobs) => jobs.as_ref().map(|jobs| jobs.send(job).is_ok()),
            Err(_) => None,
        };
        if sent != Some(true) {
            return Err(closed());
        }
        let interrupt = self.interrupt.clone();
        self.asked.fetch_add(1, Ordering::Relaxed);
        let answer = py.detach(move || {
            answered(&answers, || {
                interrupt.request();
                let _ = answers.recv_timeout(GIVE_UP);
            })
        });
        self.asked.fetch_sub(1, Ordering::Relaxed);
        answer?.ok_or_else(closed)
    }

    fn order(&self, py: Python<'_>, body: Body) -> PyResult<()> {
        self.ask(py, move |client| client.order(body))?
            .map_err(client_error)
    }

    /// True in a process that was forked: the session's thread is not in it.
    fn is_of_another_process(&self) -> bool {
        std::process::id() != self.process
    }

    /// An order that does not wait for what another thread has asked for: that ends.
    fn order_at_once(&self, py: Python<'_>, body: Body) -> PyResult<()> {
        if self.asked.load(Ordering::Relaxed) > 0 {
            self.interrupt.request();
        }
        let again = body.clone();
        let order = move |client: &mut Client| match client.order(body) {
            Err(ClientError::Interrupted { .. }) => {
                client.resume();
                client.order(again)
            }
            outcome => outcome,
        };
        self.ask(py, order)?.map_err(client_error)
    }
}

fn link_axis(name: &str) -> PyResult<LinkAxis> {
    Ok(match axis_name(name)? {
        AxisName::X => LinkAxis::X,
        AxisName::Y => LinkAxis::Y,
        AxisName::Z => LinkAxis::Z,
    })
}

/// The axes of letters.
fn axis_set(letters: &str) -> PyResult<AxisSet> {
    letters
        .chars()
        .map(|letter| link_axis(&letter.to_string()))
        .collect()
}

fn link_motion(settings: &MotionSettings) -> LinkMotion {
    match *settings {
        MotionSettings::Hold => LinkMotion::Hold,
        MotionSettings::Harmonic(sine) => LinkMotion::Harmonic(Harmonic {
            amplitude_mm: sine.amplitude_mm,
            frequency_hz: sine.frequency_hz,
            phase_rad: sine.phase_rad,
            cycles: sine.cycles,
            lead_s: sine.lead_s,
        }),
        MotionSettings::PointToPoint(way) => LinkMotion::PointToPoint(PointToPoint {
            distance_mm: way.distance_mm,
            max_velocity_mm_s: way.max_velocity_mm_s,
            max_acceleration_mm_s2: way.max_acceleration_mm_s2,
            max_jerk_mm_s3: way.max_jerk_mm_s3,
        }),
    }
}

/// A time of Python, s.
fn duration(name: &str, seconds: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(seconds).map_err(|_| {
        PyValueError::new_err(format!("{name} = {seconds}: a time of zero or more, s"))
    })
}

/// Refuses a travel that is none.
fn check_travel(travel_mm: Option<(f64, f64)>) -> PyResult<()> {
    match travel_mm {
        Some((negative, positive))
            if !(negative <= 0.0 && positive >= 0.0 && negative < positive) =>
        {
            Err(PyValueError::new_err(format!(
                "travel_mm = ({negative}, {positive}): the ways to both ends from where the axis stands, such as (-200, 200)"
            )))
        }
        _ => Ok(()),
    }
}

/// Outcome of the work on an axis, the settings that the machine had before, and the reason if it has not taken them back.
type Done<T> = (T, StageSettings, Result<(), String>);

/// Does something on an axis under test, then switches the outputs off and puts the settings back that the machine had.
fn on_axis<T>(
    client: &mut Client,
    name: AxisName,
    travel_mm: Option<(f64, f64)>,
    work: impl FnOnce(&mut dyn TestAxis, &StageSettings) -> T,
) -> Result<Done<T>, String> {
    let before = Measured::settings(client).map_err(|error| errors::words(&error))?;
    let known = Measured::free_travel(client, name).map_err(|error| errors::words(&error))?;
    let travel = match travel_mm {
        Some((negative, positive)) => Travel::between([negative, positive]),
        None if client.simulated_io().is_some() => known.unwrap_or(Travel::BUILT_IN),
        None => known.ok_or_else(|| {
            "the travel is not known: home the axis, or give travel_mm".to_owned()
        })?,
    };
    let outcome = {
        let mut axis =
            Measured::test_axis(client, name, travel).map_err(|error| errors::words(&error))?;
        work(axis.as_mut(), &before)
    };
    // An interrupt has ended the work, not the session.
    client.resume();
    let restored = Measured::load(client, &before).map_err(|error| {
        format!(
            "the machine did not take its old settings back: {}",
            errors::words(&error)
        )
    });
    Ok((outcome, before, restored))
}

fn status_dict<'py>(py: Python<'py>, status: &Status) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("tick", status.tick)?;
    found.set_item("state", kebab(&format!("{:?}", status.state)))?;
    found.set_item("fault", status.fault)?;
    found.set_item("running", status.running)?;
    let homed: Vec<&str> = status.homed.iter().map(LinkAxis::as_str).collect();
    found.set_item("homed", homed)?;
    for (name, axis) in AxisName::ALL.iter().zip(&status.axes) {
        let part = PyDict::new(py);
        part.set_item("mode", kebab(&format!("{:?}", axis.mode)))?;
        part.set_item("position_mm", axis.position_mm)?;
        part.set_item("error_mm", axis.error_mm)?;
        part.set_item("output_v", axis.output_v)?;
        part.set_item("high_mark", axis.high_mark)?;
        found.set_item(name.as_str(), part)?;
    }
    Ok(found)
}

/// A variant's name in lower case with hyphens.
fn kebab(name: &str) -> String {
    let mut text = String::new();
    for (index, letter) in name.chars().enumerate() {
        if index > 0 && letter.is_uppercase() {
            text.push('-');
        }
        text.extend(letter.to_lowercase());
    }
    text
}

#[pymethods]
impl Session {
    /// Opens a session: `simulated`, `simulated:commissioned`, `emulated:IMAGE`, `serial:PORT`, a path of a port, or `tcp:HOST:PORT`.
    #[new]
    #[pyo3(signature = (place, stage=None, settings=None, seed=1, flash=None))]
    fn new(
        py: Python<'_>,
        place: &str,
        stage: Option<&Stage>,
        settings: Option<&Settings>,
        seed: u64,
        flash: Option<PathBuf>,
    ) -> PyResult<Self> {
        let (kind, rest) = place.split_once(':').unwrap_or((place, ""));
        let setup = || -> StageSetup {
            let setup = match stage {
                Some(stage) => stage.setup.clone(),
                None if rest == "commissioned" => StageSetup::commissioned(),
                None => StageSetup::simulated(),
            };
            match settings {
                Some(settings) => setup.started_with(&settings.file.stage),
                None => setup,
            }
        };
        let is_simulated = matches!(kind, "simulated" | "emulated");
        if !is_simulated && (stage.is_some() || settings.is_some() || flash.is_some()) {
            return Err(PyValueError::new_err(format!(
                "{place}: stage, settings and flash are those of a simulated or emulated machine"
            )));
        }
        let place = match (kind, rest) {
            ("simulated", "" | "commissioned") => Place::Simulated(Box::new(setup()), seed, flash),
            ("emulated", image) if !image.is_empty() => {
                Place::Emulated(image.into(), Box::new(setup()), seed, flash)
            }
            ("serial", port) if !port.is_empty() => Place::Serial(port.to_owned()),
            ("tcp", address) if !address.is_empty() => Place::Tcp(address.to_owned()),
            _ if place.starts_with('/') || place.starts_with("COM") => {
                Place::Serial(place.to_owned())
            }
            _ => {
                return Err(PyValueError::new_err(format!(
                    "{place:?}: give \"simulated\", \"simulated:commissioned\", \"emulated:IMAGE\", \"serial:PORT\", a path such as \
                     \"/dev/ttyACM0\", or \"tcp:HOST:PORT\""
                )));
            }
        };
        let (jobs, received) = channel();
        let (opened, opening) = channel();
        // Transports stay on the thread that opened them.
        let session = thread::spawn(move || match place.open() {
            Ok(client) => {
                let _ = opened.send(Ok((client.interrupt(), client.endpoint())));
                serve(client, &received);
            }
            Err(reason) => {
                let _ = opened.send(Err(reason));
            }
        });
        // After an interrupt it opens, has no jobs, and closes.
        let opened = py.detach(move || answered(&opening, || {}))?;
        let (interrupt, endpoint) = opened
            .ok_or_else(|| PyConnectionError::new_err("the session has ended before it began"))?
            .map_err(PyConnectionError::new_err)?;
        Ok(Self {
            jobs: Mutex::new(Some(jobs)),
            interrupt,
            endpoint,
            asked: AtomicUsize::new(0),
            process: std::process::id(),
            thread: session,
        })
    }

    #[getter]
    fn endpoint(&self) -> &str {
        &self.endpoint
    }

    fn identity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let identity = self.ask(py, |client| client.identity().clone())?;
        let found = PyDict::new(py);
        found.set_item("protocol", identity.protocol)?;
        found.set_item("firmware", identity.firmware.as_str())?;
        found.set_item("board", identity.board.as_str())?;
        found.set_item("rate_hz", identity.rate_hz)?;
        found.set_item("number", kebab(&format!("{:?}", identity.number)))?;
        Ok(found)
    }

    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let status = self.ask(py, Client::status)?.map_err(client_error)?;
        status_dict(py, &status)
    }

    fn enable(&self, py: Python<'_>) -> PyResult<()> {
        self.order(py, Body::Enable)
    }

    fn disable(&self, py: Python<'_>) -> PyResult<()> {
        self.order_at_once(py, Body::Disable)
    }

    fn stop(&self, py: Python<'_>) -> PyResult<()> {
        self.order_at_once(py, Body::Stop)
    }

    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.order(py, Body::ResetFault)
    }

    fn home(&self, py: Python<'_>, axes: &str) -> PyResult<()> {
        let axes = axis_set(axes)?;
        self.order(py, Body::Home(axes))
    }

    fn jog(&self, py: Python<'_>, axis: &str, velocity_mm_s: f64) -> PyResult<()> {
        let axis = link_axis(axis)?;
        self.order(
            py,
            Body::Jog {
                axis,
                velocity_mm_s,
            },
        )
    }

    fn move_to(
        &self,
        py: Python<'_>,
        axis: &str,
        target_mm: f64,
        velocity_mm_s: f64,
    ) -> PyResult<()> {
        let axis = link_axis(axis)?;
        self.order(
            py,
            Body::Move {
                axis,
                target_mm,
                velocity_mm_s,
            },
        )
    }

    fn set_plan(&self, py: Python<'_>, motions: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut plan = Plan::default();
        for (key, motion) in motions {
            let name = axis_name(&key.extract::<String>()?)?;
            let motion: PyRef<'_, Motion> = motion.extract()?;
            plan.motions[name as usize] = link_motion(motion.settings());
        }
        self.order(py, Body::SetPlan(plan))
    }

    fn run(&self, py: Python<'_>) -> PyResult<()> {
        self.order(py, Body::Run)
    }

    fn wait_rest<'py>(&self, py: Python<'py>, timeout_s: f64) -> PyResult<Bound<'py, PyDict>> {
        let timeout = duration("timeout_s", timeout_s)?;
        let rested = self.ask(py, move |client| settle::rest(client, timeout))?;
        status_dict(py, &rested.map_err(client_error)?)
    }

    fn wait_homed<'py>(
        &self,
        py: Python<'py>,
        axes: &str,
        timeout_s: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let timeout = duration("timeout_s", timeout_s)?;
        let axes = axis_set(axes)?;
        let homed = self.ask(py, move |client| settle::homed(client, axes, timeout))?;
        status_dict(py, &homed.map_err(client_error)?)
    }

    fn sleep(&self, py: Python<'_>, seconds: f64) -> PyResult<()> {
        let time = duration("seconds", seconds)?;
        self.ask(py, move |client| settle::time(client, time))?
            .map_err(client_error)
    }

    fn get(&self, py: Python<'_>, path: String) -> PyResult<Py<PyAny>> {
        let value = self
            .ask(py, move |client| {
                settings::get(client, &settings::whole_path(&path))
            })?
            .map_err(client_error)?;
        Ok(json::load(py, &value.to_string())?.unbind())
    }

    fn set(&self, py: Python<'_>, path: String, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let json = json::dump(value)?;
        self.ask(py, move |client| {
            settings::set(client, &settings::whole_path(&path), &json)
        })?
        .map_err(client_error)
    }

    fn apply(&self, py: Python<'_>) -> PyResult<()> {
        let applied = self.ask(py, settings::apply)?;
        applied.map(drop).map_err(client_error)
    }

    fn store(&self, py: Python<'_>, provenance: String) -> PyResult<()> {
        self.ask(py, move |client| settings::store(client, &provenance))?
            .map_err(client_error)
    }

    fn settings(&self, py: Python<'_>) -> PyResult<Settings> {
        let stage = self.ask(py, settings::in_force)?.map_err(client_error)?;
        Ok(Settings::of(stage))
    }

    fn load(&self, py: Python<'_>, new: &Settings) -> PyResult<()> {
        new.validate_for_law()?;
        let stage = new.file.stage.clone();
        let loaded = self.ask(py, move |client| settings::load(client, &stage))?;
        loaded.map(drop).map_err(exchange_error)
    }

    fn fault(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let report = self.ask(py, Client::fault)?.map_err(client_error)?;
        let Some(report) = report else {
            return Ok(None);
        };
        let axis = report.axis.map(|axis| match axis {
            LinkAxis::X => AxisName::X,
            LinkAxis::Y => AxisName::Y,
            LinkAxis::Z => AxisName::Z,
        });
        let error = errors::fault_in_words(
            (report.code, &report.name),
            axis,
            Some(report.tick),
            (&report.cause, &report.remedy),
        );
        Ok(Some(error.into_value(py).into_any()))
    }

    /// Samples of channels: time, and each channel in mm, mm/s or V.
    #[pyo3(signature = (channels, seconds, decimation=None))]
    fn record<'py>(
        &self,
        py: Python<'py>,
        channels: Vec<String>,
        seconds: f64,
        decimation: Option<u16>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let time = duration("seconds", seconds)?;
        let selected: Vec<Channel> = channels
            .iter()
            .map(|name| {
                name.parse()
                    .map_err(|reason| PyKeyError::new_err(format!("{name}: {reason}")))
            })
            .collect::<PyResult<_>>()?;
        let recorded = self.ask(py, move |client| {
            let rate_hz = client.identity().rate_hz;
            let least = least_decimation(selected.len(), rate_hz);
            let decimation = decimation.unwrap_or(least);
            let mut recorder = TelemetryRecorder::start(client, &selected, decimation)?;
            let gathered = recorder.gather(client, time);
            let samples = recorder.finish(client)?;
            gathered?;
            let resolutions = resolutions_mm(client)?;
            let values: Vec<Vec<f64>> = (0..selected.len())
                .map(|index| values_mm(&samples, index, &resolutions))
                .collect();
            Ok((samples.time_s(), samples.lost(), values))
        })?;
        let (time_s, lost, values) = recorded.map_err(client_error)?;
        let found = PyDict::new(py);
        found.set_item("t_s", time_s.into_pyarray(py))?;
        for (name, values) in channels.iter().zip(values) {
            found.set_item(name, values.into_pyarray(py))?;
        }
        found.set_item("lost", lost)?;
        Ok(found)
    }

    /// Commissions an axis.
    #[pyo3(signature = (axis, travel_mm, trials, progress))]
    fn commission<'py>(
        &self,
        py: Python<'py>,
        axis: &str,
        travel_mm: Option<(f64, f64)>,
        trials: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let name = axis_name(axis)?;
        check_travel(travel_mm)?;
        let request = CommissionSettings {
            trials,
            ..CommissionSettings::default()
        };
        let raised = Mutex::new(None);
        let (done, raised) = self.ask(py, move |client| {
            let done = on_axis(client, name, travel_mm, |axis, stage| {
                let base = &stage.axes[name as usize];
                let calls = (progress.as_ref(), &raised);
                commission::run(axis, base, &request, calls, &AtomicBool::new(false))
            });
            (done, raised)
        })?;
        let (outcome, stage, restored) = done.map_err(PyRuntimeError::new_err)?;
        let found = commission::result(py, outcome, raised, &stage, name)?;
        restored.map_err(PyRuntimeError::new_err)?;
        Ok(found)
    }

    /// Measures the response of an axis.
    #[pyo3(signature = (settings, axis, travel_mm, request, seed, progress))]
    #[expect(
        clippy::too_many_arguments,
        reason = "a function of the extension, wrapped in Python"
    )]
    fn measure_frf<'py>(
        &self,
        py: Python<'py>,
        settings: Option<&Settings>,
        axis: &str,
        travel_mm: Option<(f64, f64)>,
        request: FrfRequest,
        seed: u64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let name = axis_name(axis)?;
        check_travel(travel_mm)?;
        let request = commission::frf_settings(request, seed)?;
        let own = settings.map(|settings| settings.file.stage.axes[name as usize].clone());
        let raised = Mutex::new(None);
        let (done, raised) = self.ask(py, move |client| {
            let done = on_axis(client, name, travel_mm, |axis, stage| {
                let base = own.as_ref().unwrap_or(&stage.axes[name as usize]);
                let calls = (progress.as_ref(), &raised);
                commission::measure_response(axis, base, &request, calls, &AtomicBool::new(false))
            });
            (done, raised)
        })?;
        let (measured, _, restored) = done.map_err(PyRuntimeError::new_err)?;
        let found = commission::measured_dict(py, measured, raised)?;
        restored.map_err(PyRuntimeError::new_err)?;
        Ok(found)
    }

    /// Ends the session, and waits until its port is free.
    fn close(&self, py: Python<'_>) {
        if let Ok(mut jobs) = self.jobs.lock() {
            jobs.take();
        }
        if thread::current().id() == self.thread.thread().id() || self.is_of_another_process() {
            return;
        }
        py.detach(|| {
            let since = Instant::now();
            while !self.thread.is_finished() && since.elapsed() < GIVE_UP {
                thread::sleep(CLOSING);
            }
        });
    }
}
