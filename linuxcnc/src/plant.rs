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
    /// Out: the encoder's count.
    pub rawcounts: i32,
    /// Out: the same, mm.
    pub position_fb: f64,
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

/// The simulated stage.
pub struct Plant {
    stage: SimulatedStage,
    resolution_mm: [f64; 3],
    full_scale_v: [f64; 3],
    /// Steps of the simulation in a period.
    steps: u32,
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
            before: None,
            record: Vec::with_capacity(if file.is_some() { room } else { 0 }),
            file,
        }
    }

    /// Begins a period: reads the encoders.
    pub fn read(&mut self, pins: &mut QuadrantPlantPins) {
        let counts = self.stage.read_counters();
        for (index, axis) in pins.axes.iter_mut().enumerate() {
            if !axis.freeze {
                axis.rawcounts = counts[index] as i32;
                axis.position_fb = f64::from(axis.rawcounts) * self.resolution_mm[index];
            }
        }
    }

    /// Ends a period: moves the axes by their voltages until the next.
    pub fn write(&mut self, pins: &QuadrantPlantPins) {
        let command = pins.axes.map(|axis| axis.position_cmd);
        // LinuxCNC's command is for the next reading.
        if let Some(due) = self.before.replace(command)
            && pins.record
            && self.record.len() < self.record.capacity()
        {
            let position = self.stage.axes().each_ref().map(|axis| axis.position_mm());
            self.record.push([due, position]);
        }
        let mut outputs = Outputs {
            enabled: pins.enable,
            ..Outputs::default()
        };
        for (index, axis) in pins.axes.iter().enumerate() {
            outputs.codes[index] = DacCode::from_volts(axis.voltage, self.full_scale_v[index]);
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
