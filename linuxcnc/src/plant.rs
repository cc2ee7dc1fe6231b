//! The simulated stage behind HAL pins: volts in, counts out, and a record for judging.

use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use quadrant_law::stage::Outputs;
use quadrant_law::units::DacCode;
use quadrant_sim::plant::{SimulatedStage, StageParameters};

/// Least rate of the simulation, Hz: a slow thread takes several of its steps a period.
const LEAST_RATE_HZ: f64 = 10e3;

/// The pins of a simulated axis.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QuadrantPlantAxis {
    /// In: voltage of the amplifier, V.
    pub voltage: f64,
    /// In: commanded position for the record, mm.
    pub position_cmd: f64,
    /// In: the encoder shows its last count.
    pub freeze: bool,
    /// In and out: the next index pulse makes its place zero, and ends this.
    pub index_enable: bool,
    /// Out: the encoder's count.
    pub rawcounts: i32,
    /// Out: the same since the index, mm.
    pub position_fb: f64,
    /// Out: largest change of the voltage from one period to the next, just after the index, V.
    pub index_step: f64,
}

/// The pins of the simulated stage.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QuadrantPlantPins {
    /// In: the amplifiers are enabled.
    pub enable: bool,
    /// In: this tick is recorded.
    pub record: bool,
    /// The axes: x, y, z.
    pub axes: [QuadrantPlantAxis; 3],
}

/// A tick of the record: the command for this moment, and the true position, mm.
pub type Recorded = [[f64; 3]; 2];

/// Periods after an index pulse in which steps of the voltage are looked for.
const INDEX_PERIODS: u32 = 10;

/// Trace that an index pulse leaves behind.
#[derive(Clone, Copy, Default)]
struct Index {
    /// Its count, which is zero of the position.
    count: i32,
    /// Periods in which steps of the voltage are still looked for.
    watched: u32,
    voltage: f64,
}

/// The simulated stage.
pub struct Plant {
    stage: SimulatedStage,
    resolution_mm: [f64; 3],
    full_scale_v: [f64; 3],
    /// Steps of the simulation in a period.
    steps: u32,
    index: [Index; 3],
    before: Option<[f64; 3]>,
    record: Vec<Recorded>,
    file: Option<PathBuf>,
}

impl Plant {
    /// A stage at rest for a thread of `rate_hz`. A record of `room` ticks is written to `file` in the end.
    pub fn new(
        truth: &StageParameters,
        rate_hz: f64,
        seed: u64,
        file: Option<PathBuf>,
        room: usize,
    ) -> Self {
        let steps = (LEAST_RATE_HZ / rate_hz).ceil().max(1.0);
        Self {
            stage: SimulatedStage::new(truth, rate_hz * steps, seed),
            resolution_mm: truth.axes.each_ref().map(|axis| axis.resolution_mm),
            full_scale_v: truth.axes.each_ref().map(|axis| axis.full_scale_v),
            steps: steps as u32,
            index: Default::default(),
            before: None,
            record: Vec::with_capacity(if file.is_some() { room } else { 0 }),
            file,
        }
    }

    /// Begins a period: reads the encoders.
    pub fn read(&mut self, pins: &mut QuadrantPlantPins) {
        let readings = self.stage.read_inputs(None).readings;
        for (number, axis) in pins.axes.iter_mut().enumerate() {
            if axis.freeze {
                continue;
            }
            let index = &mut self.index[number];
            if let Some(pulse) = readings[number].index
                && axis.index_enable
            {
                axis.index_enable = false;
                axis.index_step = 0.0;
                index.count = pulse as i32;
                index.watched = INDEX_PERIODS;
            }
            axis.rawcounts = readings[number].count as i32;
            let since = axis.rawcounts.wrapping_sub(index.count);
            axis.position_fb = f64::from(since) * self.resolution_mm[number];
        }
    }

    /// Ends a period: moves the axes by their voltages until the next.
    pub fn write(&mut self, pins: &mut QuadrantPlantPins) {
        let command = pins.axes.map(|axis| axis.position_cmd);
        // LinuxCNC's command is for the next reading.
        if let Some(due) = self.before.replace(command)
            && pins.record
            && self.record.len() < self.record.capacity()
        {
            let mut position = self.stage.axes().each_ref().map(|axis| axis.position_mm());
            for (number, position) in position.iter_mut().enumerate() {
                *position -= f64::from(self.index[number].count) * self.resolution_mm[number];
            }
            self.record.push([due, position]);
        }
        let mut outputs = Outputs {
            enabled: pins.enable,
            ..Outputs::default()
        };
        for (number, axis) in pins.axes.iter_mut().enumerate() {
            outputs.codes[number] = DacCode::from_volts(axis.voltage, self.full_scale_v[number]);
            let index = &mut self.index[number];
            if index.watched > 0 {
                index.watched -= 1;
                axis.index_step = axis.index_step.max((axis.voltage - index.voltage).abs());
            }
            index.voltage = axis.voltage;
        }
        for _ in 0..self.steps {
            self.stage.step(&outputs);
        }
    }

    /// Writes the record, and ends.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(self) -> io::Result<()> {
        let Some(path) = self.file else {
            return Ok(());
        };
        let mut file = BufWriter::new(std::fs::File::create(path)?);
        for number in self.record.iter().flatten().flatten() {
            file.write_all(&number.to_le_bytes())?;
        }
        file.flush()
    }
}
