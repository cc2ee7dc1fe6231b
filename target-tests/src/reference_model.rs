//! The reference model of the emulated firmware: the same job in this process, on the simulated stage.

use std::marker::PhantomData;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use quadrant_host::machine::emulator::{Program, input_of, record_of};
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::motion::MotionMode;
use quadrant_law::scalar::{Fixed, Scalar};
use quadrant_law::stage::Outputs;
use quadrant_lockstep::InputRecord;
use quadrant_settings::Job;
use quadrant_sim::benchmark_job::circle_and_sine;
use quadrant_sim::law_machine::{LawMachine, Operator};
use quadrant_sim::plant::{SimulatedStage, StageParameters};
use quadrant_sim::settings_file::SettingsFile;
use xtask::image::{self, Image};

use crate::near_home;

/// Seed of the simulated stage's noise.
const SEED: u64 = 1;

/// Lead-in of the motions, s: short, because counting traces every instruction of it.
const LEAD_S: f64 = 0.05;
/// Ticks after which the motions of [`job`] have reached their speed.
pub(crate) const SETTLING_TICKS: u32 = 750;

/// The job of an emulated run, on the default settings.
pub(crate) fn job() -> Job {
    circle_and_sine(LEAD_S)
}

/// The job of an emulated run, on the settings of a file.
pub(crate) fn job_with(settings: &Path) -> Result<Job> {
    Ok(Job {
        stage: SettingsFile::read(settings)?.stage,
        ..job()
    })
}

/// An image as the emulator takes it.
pub(crate) fn program(image: &Image) -> Result<Program> {
    ensure!(
        image.target.board == image::Board::Mps2,
        "{} is a real board: it is not emulated",
        image.target
    );
    Ok(Program::read(&image.path)?)
}

/// A job as the firmware reads it.
pub(crate) fn encode(job: &Job) -> Result<Vec<u8>> {
    postcard::to_allocvec(job).context("cannot encode the job")
}

/// A machine of either number type.
pub(crate) trait Law {
    /// One control period.
    fn tick(&mut self, input: &InputRecord) -> Outputs;
    /// True if all axes are homed and follow the plan.
    fn runs_homed(&self) -> bool;
}

impl<S: Scalar> Law for LawMachine<S, FIRMWARE_ELEMENTS> {
    fn tick(&mut self, input: &InputRecord) -> Outputs {
        LawMachine::tick(self, &input_of(input))
    }

    fn runs_homed(&self) -> bool {
        let mut axes = self.state().axes().iter();
        axes.all(|axis| axis.is_homed() && axis.mode() == MotionMode::Plan)
    }
}

/// Comparison of the firmware's words with the reference model's.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    /// Converter words compared.
    pub(crate) words: u64,
    /// Words that differ; a differing enable line counts as one more.
    pub(crate) differ: u64,
    /// Words that were not zero: a comparison of zeros proves nothing.
    pub(crate) moving: u64,
    /// Ticks with the outputs enabled.
    pub(crate) enabled: u64,
    /// The first difference: tick, the reference model's outputs, the firmware's.
    pub(crate) first: Option<(u32, Outputs, Outputs)>,
}

/// Law and stage in this process.
pub(crate) struct ReferenceModel {
    job: Job,
    law: Box<dyn Law>,
    plant: SimulatedStage,
    operator: Operator,
    tick: u32,
}

impl ReferenceModel {
    /// the reference model of a firmware of a number type that runs a job.
    pub(crate) fn of(scalar: image::Scalar, job: Job) -> Result<Self> {
        fn law<S: Scalar>(job: &Job, _: PhantomData<S>) -> Result<Box<dyn Law>> {
            Ok(Box::new(LawMachine::<S, FIRMWARE_ELEMENTS>::new(job)?))
        }
        Ok(Self {
            law: match scalar {
                image::Scalar::F32 => law(&job, PhantomData::<f32>)?,
                image::Scalar::Fixed => law(&job, PhantomData::<Fixed>)?,
            },
            plant: SimulatedStage::new(&StageParameters::real(), job.stage.rate_hz, SEED),
            operator: Operator::runs_the_plan(),
            tick: 0,
            job,
        })
    }

    /// The same on axes that stand where [`near_home`] says, which it homes before it runs the plan.
    pub(crate) fn homed(scalar: image::Scalar, mut job: Job) -> Result<Self> {
        let marks = near_home::prepare(&mut job.stage);
        let mut model = Self::of(scalar, job)?;
        model.plant.set_marks([marks; 3]);
        model.operator = Operator::follows([
            (near_home::ENABLE_TICK, Command::Enable),
            (near_home::HOME_TICK, Command::Home(AxisName::X)),
            (near_home::HOME_TICK + 10, Command::Home(AxisName::Y)),
            (near_home::HOME_TICK + 20, Command::Home(AxisName::Z)),
            (near_home::RUN_TICK, Command::Run),
        ]);
        Ok(model)
    }

    /// True if all axes are homed and follow the plan.
    pub(crate) fn runs_homed(&self) -> bool {
        self.law.runs_homed()
    }

    /// Returns the job that it runs.
    pub(crate) fn job(&self) -> &Job {
        &self.job
    }

    /// Returns the inputs of the next tick, for firmware and reference model.
    fn input(&mut self) -> InputRecord {
        record_of(&self.plant.read_inputs(self.operator.request(self.tick)))
    }

    /// The reference model's own answer.
    fn compute(&mut self, input: &InputRecord) -> Outputs {
        self.tick += 1;
        self.law.tick(input)
    }

    /// Moves the stage by one control period.
    fn step(&mut self, outputs: &Outputs) {
        self.plant.step(outputs);
    }

    /// The reference model alone in closed loop, for the next `ticks` ticks: what it read and what it answered.
    pub(crate) fn run_alone(&mut self, ticks: u32) -> (Vec<InputRecord>, Vec<Outputs>) {
        (0..ticks)
            .map(|_| {
                let input = self.input();
                let outputs = self.compute(&input);
                self.step(&outputs);
                (input, outputs)
            })
            .unzip()
    }
}

impl Tally {
    /// Compares the outputs of one tick.
    pub(crate) fn add(&mut self, tick: u32, expected: Outputs, firmware: Outputs) {
        for (ours, theirs) in expected.codes.iter().zip(firmware.codes) {
            self.words += 1;
            self.differ += u64::from(*ours != theirs);
            self.moving += u64::from(ours.0 != 0);
        }
        self.enabled += u64::from(expected.enabled);
        self.differ += u64::from(expected.enabled != firmware.enabled);
        if expected != firmware {
            self.first.get_or_insert((tick, expected, firmware));
        }
    }
}
