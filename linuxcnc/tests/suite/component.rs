//! A component on the simulated stage, ticked as its C does.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::ptr;

use quadrant_linuxcnc::abi::{
    QuadrantConfig, QuadrantPlantConfig, quadrant_plant_read, quadrant_plant_start,
    quadrant_plant_stop, quadrant_plant_write, quadrant_start, quadrant_stop, quadrant_tick,
};
use quadrant_linuxcnc::board::{Board, QuadrantPins};
use quadrant_linuxcnc::plant::{Plant, QuadrantPlantPins};
use quadrant_settings::StageSettings;
use quadrant_sim::settings_file::SettingsFile;

use crate::forbidding::without_allocation;

/// Rate of the thread, Hz.
pub(crate) const RATE_HZ: f64 = 4e3;
/// Its period, ns.
pub(crate) const PERIOD_NS: i64 = 250_000;

/// Parameters of a component in a test.
#[derive(Default)]
pub(crate) struct Parameters {
    /// File for stored settings.
    pub(crate) store: Option<PathBuf>,
    /// Without settings to start with.
    pub(crate) bare: bool,
    /// Port of the link.
    pub(crate) port: i32,
    /// Periods above which a tick is late.
    pub(crate) late: i32,
    /// The feedforward alone.
    pub(crate) feedforward_only: bool,
    /// Settings in place of the tests' own.
    pub(crate) settings: Option<StageSettings>,
    /// Seed of the stage's noise.
    pub(crate) seed: i32,
}

/// The settings of the tests: the simulated stage's at the thread's rate.
pub(crate) fn settings() -> StageSettings {
    let mut settings = StageSettings::simulated();
    settings.rate_hz = RATE_HZ;
    for axis in &mut settings.axes {
        axis.feedback.pid.derivative_filter_s = 0.5 / RATE_HZ;
    }
    settings
}

/// A component and its stage.
pub(crate) struct Component {
    board: *mut Board,
    plant: *mut Plant,
    pub(crate) pins: QuadrantPins,
    pub(crate) stage: QuadrantPlantPins,
    /// Added to the position that LinuxCNC sees and commands, mm.
    pub(crate) origin_mm: f64,
    /// Position that LinuxCNC sees over that of the encoder.
    pub(crate) scale: f64,
    tick: u32,
    /// Positions of the joints when they were enabled, mm.
    start_mm: [f64; 3],
    _folder: tempfile::TempDir,
}

impl Drop for Component {
    fn drop(&mut self) {
        // SAFETY: both were started, and are not used again.
        unsafe {
            quadrant_stop(self.board);
            quadrant_plant_stop(self.plant);
        }
    }
}

impl Component {
    /// Starts a component; none where it does not start.
    pub(crate) fn try_start(parameters: &Parameters) -> Option<Self> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("settings.toml");
        let settings = parameters.settings.clone().unwrap_or_else(settings);
        let rate_hz = settings.rate_hz;
        let text = SettingsFile::new(settings).text(&path).expect("settings");
        std::fs::write(&path, text).expect("writes");
        let text = |path: &Path| CString::new(path.to_str().expect("text")).expect("no zero");
        let defaults = text(&path);
        let store = parameters.store.as_deref().map(text);
        let mode = CString::new(if parameters.feedforward_only {
            "feedforward"
        } else {
            "full"
        })
        .expect("no zero");
        let config = QuadrantConfig {
            settings: store.as_ref().map_or(ptr::null(), |store| store.as_ptr()),
            defaults: if parameters.bare {
                ptr::null()
            } else {
                defaults.as_ptr()
            },
            joints: ptr::null(),
            units: ptr::null(),
            feedback: ptr::null(),
            mode: mode.as_ptr(),
            preview: ptr::null(),
            address: ptr::null(),
            port: parameters.port,
            rate: rate_hz as i32,
            late: parameters.late,
        };
        let plant = QuadrantPlantConfig {
            file: ptr::null(),
            record: ptr::null(),
            rate: rate_hz as i32,
            drive_lag_us: 0,
            seed: parameters.seed,
            room: 0,
        };
        // SAFETY: all texts end with a zero.
        let (board, plant) = unsafe { (quadrant_start(&config), quadrant_plant_start(&plant)) };
        let component = Self {
            board,
            plant,
            pins: QuadrantPins {
                period_ns: (1e9 / rate_hz) as i64,
                now_ns: 1,
                ..QuadrantPins::default()
            },
            stage: QuadrantPlantPins::default(),
            origin_mm: 0.0,
            scale: 1.0,
            tick: 0,
            start_mm: [0.0; 3],
            _folder: folder,
        };
        (!board.is_null()).then_some(component)
    }

    /// Starts a component with settings of a commissioned stage.
    pub(crate) fn start(parameters: &Parameters) -> Self {
        Self::try_start(parameters).expect("a component")
    }

    /// Commanded positions of the joints in a tick, mm, and their velocity, mm/s: circles from rest.
    pub(crate) fn command(tick: u32) -> ([f64; 3], [f64; 3]) {
        let time_s = f64::from(tick) / RATE_HZ;
        // Starts within 0.2 s.
        let (angle, rate) = if time_s < 0.2 {
            (0.5 * 10.0 * time_s * time_s / 0.2, 10.0 * time_s / 0.2)
        } else {
            (10.0 * (time_s - 0.1), 10.0)
        };
        let (sine, cosine) = (angle.sin(), angle.cos());
        (
            [5.0 * (1.0 - cosine), 5.0 * sine, 0.0],
            [5.0 * rate * sine, 5.0 * rate * cosine, 0.0],
        )
    }

    /// One period: encoders, command, law, amplifiers. The command stands unless the joints are enabled.
    pub(crate) fn step(&mut self, enable: bool) {
        let was = self.pins.joints[0].enable;
        self.tick = if enable && was { self.tick + 1 } else { 0 };
        let (positions, velocities) = Self::command(self.tick);
        self.step_along(enable, positions, velocities);
    }

    /// One period along a command that begins where the joints were enabled.
    pub(crate) fn step_along(&mut self, enable: bool, positions: [f64; 3], velocities: [f64; 3]) {
        // SAFETY: both were started, and this is the only thread that uses them.
        unsafe { quadrant_plant_read(self.plant, &mut self.stage) };
        if enable && !self.pins.joints[0].enable {
            let scale = self.scale;
            self.start_mm = self.stage.axes.map(|axis| axis.position_fb * scale);
        }
        for index in 0..3 {
            let (joint, axis) = (&mut self.pins.joints[index], &self.stage.axes[index]);
            joint.rawcounts = axis.rawcounts;
            joint.position_fb = axis.position_fb * self.scale + self.origin_mm;
            joint.position_cmd = if enable {
                self.start_mm[index] + positions[index] + self.origin_mm
            } else {
                joint.position_fb
            };
            joint.velocity_cmd = if enable { velocities[index] } else { 0.0 };
            joint.enable = enable;
        }
        // SAFETY: as above.
        without_allocation(|| unsafe { quadrant_tick(self.board, &mut self.pins) });
        self.pins.now_ns += self.pins.period_ns;
        self.stage.enable = self.pins.driven;
        for (axis, joint) in self.stage.axes.iter_mut().zip(&self.pins.joints) {
            axis.voltage = joint.output;
        }
        // SAFETY: as above.
        unsafe { quadrant_plant_write(self.plant, &mut self.stage) };
    }

    /// Runs `ticks` periods.
    pub(crate) fn run(&mut self, ticks: u32, enable: bool) {
        for _ in 0..ticks {
            self.step(enable);
        }
    }

    /// The outputs of the joints, V.
    pub(crate) fn outputs(&self) -> [f64; 3] {
        self.pins.joints.map(|joint| joint.output)
    }
}
