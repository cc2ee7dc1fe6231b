//! The emulated firmware on the simulated stage beside the reference model in this process, with a host at its link and somebody who
//! breaks things.

mod link;

use std::time::{Duration, Instant};

use anyhow::{Result, bail, ensure};
use quadrant::axes::AxisName;
use quadrant::link::message::{Body, NumberType};
use quadrant::lockstep::{
    END_OF_RUN, FLASH, INJECTED_FAULT, INJECTED_FAULT_TICK, INPUT, INPUT_SEQUENCE, InjectedFault,
    InputRecord, Job, Mode, OUTPUT, OUTPUT_SEQUENCE, OutputRecord, RESETS_LEFT, STARTS, held,
};
use quadrant::motion::MotionMode;
use quadrant::safety::{AxisSwitches, FaultCode};
use quadrant::scalar::{Fixed, Scalar};
use quadrant::stage::Outputs;
use quadrant_sim::machine::application::{Running, Start};
use quadrant_sim::machine::emulator::{Clock, Emulator, Memory};
use quadrant_sim::machine::memory_flash::MemoryFlash;
use quadrant_sim::plant::{MarkTruth, SimulatedStage, StageTruth};

use self::link::HostLink;
use super::serial_ring::SerialRing;
use crate::reference_model;
use xtask::image::{self, Image};

/// Seed of the simulated stage's noise.
const SEED: u64 = 1;
/// How long the firmware may take to answer, in the host's time: when it is traced, its start takes longest.
const TIMEOUT: Duration = Duration::from_secs(120);
/// Looks at the answer between two pauses.
const LOOKS: u32 = 1 << 8;
/// Pauses between two looks at the clock.
const PAUSES: u32 = 1 << 8;
/// Ticks until the firmware has looked at what was asked or has happened.
pub(crate) const A_WHILE: u32 = 40;

/// What goes wrong: changes what the firmware reads, or the stage itself, given the ticks since it began to.
pub(crate) type InputFault = Box<dyn FnMut(&mut InputRecord, &mut SimulatedStage, u32)>;

/// An application of either number type.
trait Application {
    fn tick(&mut self, input: &InputRecord, serial: &mut SerialRing) -> Outputs;
    fn mode_of_x(&self) -> MotionMode;
}

impl<S: Scalar> Application for Running<S> {
    fn tick(&mut self, input: &InputRecord, serial: &mut SerialRing) -> Outputs {
        Running::tick(self, input, serial).0
    }

    fn mode_of_x(&self) -> MotionMode {
        self.state().axes()[0].mode()
    }
}

/// What firmware and reference model start with.
pub(crate) struct Configuration {
    /// Settings of a machine whose flash is empty, and motions.
    pub(crate) job: Job,
    /// Where the stage's marks are.
    pub(crate) marks: MarkTruth,
    /// The flash for settings.
    pub(crate) flash: MemoryFlash,
}

/// Firmware and reference model.
pub(crate) struct Fixture {
    memory: Memory,
    emulator: Emulator,
    scalar: image::Scalar,
    configuration: Configuration,
    model: Box<dyn Application>,
    serial: SerialRing,
    plant: SimulatedStage,
    cause: Option<(u32, InputFault)>,
    /// Ticks since the firmware's start.
    tick: u32,
    /// The outputs of each.
    outputs: Vec<Outputs>,
    host: HostLink,
    mismatches: [bool; 3],
    streams_since: Option<u32>,
    starts: u32,
    /// Converter words and bytes of the link that were compared.
    pub(crate) compared: (u64, u64),
}

impl Fixture {
    /// Starts both.
    pub(crate) fn start(image: &Image, configuration: Configuration) -> Result<Self> {
        Self::start_with(image, configuration, |memory| {
            Ok(Emulator::start(
                &reference_model::program(image)?,
                memory,
                Clock::Host,
                |_| {},
            )?)
        })
    }

    /// The same with an emulator of one's own.
    pub(crate) fn start_with(
        image: &Image,
        configuration: Configuration,
        emulator: impl FnOnce(&Memory) -> Result<Emulator>,
    ) -> Result<Self> {
        let memory = Memory::create()?;
        memory.prepare(
            Mode::Lockstep,
            0,
            &reference_model::encode(&configuration.job)?,
        )?;
        let flash: Vec<u8> = configuration
            .flash
            .bytes()
            .iter()
            .map(|byte| !byte)
            .collect();
        memory.write(FLASH, &flash)?;
        let mut plant =
            SimulatedStage::new(&StageTruth::real(), configuration.job.stage.rate_hz, SEED);
        plant.set_marks([configuration.marks; 3]);
        let scalar = image.target.scalar;
        let mut fixture = Self {
            emulator: emulator(&memory)?,
            memory,
            scalar,
            model: application(scalar, &configuration, None)?,
            configuration,
            serial: SerialRing::default(),
            plant,
            cause: None,
            tick: 0,
            outputs: Vec::new(),
            host: HostLink::default(),
            mismatches: [false; 3],
            streams_since: None,
            starts: 0,
            compared: (0, 0),
        };
        fixture.await_start()?;
        fixture.run(A_WHILE)?;
        fixture.done(Body::Hello)?;
        Ok(fixture)
    }

    /// Waits until the firmware has started once more.
    fn await_start(&mut self) -> Result<()> {
        self.starts += 1;
        wait_for(&self.memory, &mut self.emulator, STARTS, self.starts)
    }

    /// Ticks since the firmware's start.
    pub(crate) fn tick(&self) -> u32 {
        self.tick
    }

    /// The stage.
    pub(crate) fn plant(&self) -> &SimulatedStage {
        &self.plant
    }

    /// The first tick in which x followed a stream.
    pub(crate) fn streams_since(&self) -> Option<u32> {
        self.streams_since
    }

    /// The outputs of a tick; ticks count from zero.
    pub(crate) fn outputs(&self, tick: u32) -> Option<Outputs> {
        self.outputs.get(tick as usize).copied()
    }

    /// Lets something go wrong from the next tick on.
    pub(crate) fn inject(&mut self, cause: InputFault) {
        self.cause = Some((0, cause));
    }

    /// Runs some ticks.
    pub(crate) fn run(&mut self, ticks: u32) -> Result<()> {
        (0..ticks).try_for_each(|_| self.step().map(drop))
    }

    /// Runs until something is so, for `ticks` ticks at most.
    pub(crate) fn run_until(
        &mut self,
        ticks: u32,
        what: &str,
        mut reached: impl FnMut(&Self) -> bool,
    ) -> Result<()> {
        for _ in 0..ticks {
            self.step()?;
            if reached(self) {
                return Ok(());
            }
        }
        bail!("not within {ticks} ticks: {what}")
    }

    /// One control period: the same inputs for both, and the same outputs from both.
    fn step(&mut self) -> Result<Outputs> {
        let mut input = self.plant.read_inputs(None);
        if let Some((since, cause)) = &mut self.cause {
            cause(&mut input, &mut self.plant, *since);
            *since += 1;
        }
        let arriving = self.send()?;
        self.memory.write(INPUT, &input.encode())?;
        self.memory.set_word(INPUT_SEQUENCE, self.tick + 1)?;
        // The reference model computes while the firmware does.
        let shown = self.serial.exchange(&arriving, self.host.freed());
        let expected = self.compute(input);
        wait_for(
            &self.memory,
            &mut self.emulator,
            OUTPUT_SEQUENCE,
            self.tick + 1,
        )?;
        let mut bytes = [0; OutputRecord::BYTES];
        self.memory.read(OUTPUT, &mut bytes)?;
        let found = OutputRecord::decode(&bytes).outputs;
        ensure!(
            found == expected,
            "tick {}: {expected:?} here, {found:?} in the firmware",
            self.tick
        );
        self.receive(&shown)?;
        self.plant.step(&found);
        self.outputs.push(found);
        self.compared.0 += 3;
        self.tick += 1;
        Ok(found)
    }

    /// The reference model's answer, behind converters that hold what the firmware's do and are read back as those are.
    fn compute(&mut self, mut input: InputRecord) -> Outputs {
        for (axis, differs) in AxisName::ALL.into_iter().zip(self.mismatches) {
            if differs {
                let switches = input.switches;
                input.switches = switches.with_axis(axis, AxisSwitches::OUTPUT_MISMATCH);
            }
        }
        let told = self.model.tick(&input, &mut self.serial);
        if self.model.mode_of_x() == MotionMode::Stream {
            self.streams_since.get_or_insert(self.tick);
        }
        let codes = held(told.codes.into_array(), input.stuck);
        self.mismatches = [0, 1, 2].map(|axis| codes[axis] != told.codes[axis]);
        Outputs {
            codes: codes.into(),
            enabled: told.enabled && self.mismatches == [false; 3],
        }
    }

    /// Makes the idle loop of the firmware do something instead of the next tick, and waits until the firmware has started
    /// again. Gives what the firmware has left at the outputs; the reference model starts with the fault that it is to find.
    pub(crate) fn inject_fault(
        &mut self,
        what: InjectedFault,
        finds: FaultCode,
    ) -> Result<Outputs> {
        self.memory.set_word(RESETS_LEFT, 1)?;
        self.memory.set_word(INJECTED_FAULT_TICK, self.tick + 1)?;
        self.memory.set_word(INJECTED_FAULT, what as u32)?;
        self.memory.set_word(INPUT_SEQUENCE, self.tick + 1)?;
        self.await_start()?;
        let mut bytes = [0; OutputRecord::BYTES];
        self.memory.read(OUTPUT, &mut bytes)?;
        self.begin_again(finds)?;
        Ok(OutputRecord::decode(&bytes).outputs)
    }

    /// The reference model after a reset, at which the stage stays where it is.
    fn begin_again(&mut self, finds: FaultCode) -> Result<()> {
        self.model = application(self.scalar, &self.configuration, Some(finds))?;
        self.serial = SerialRing::default();
        self.mismatches = [false; 3];
        self.tick = 0;
        self.outputs.clear();
        self.host = HostLink::default();
        self.run(A_WHILE)?;
        self.done(Body::Hello)
    }

    /// Ends the run; gives the firmware's log.
    pub(crate) fn end(self) -> Result<Vec<String>> {
        self.memory.set_word(INPUT_SEQUENCE, END_OF_RUN)?;
        Ok(self.emulator.wait()?)
    }
}

/// The application with the number type of an image.
fn application(
    scalar: image::Scalar,
    configuration: &Configuration,
    fault: Option<FaultCode>,
) -> Result<Box<dyn Application>> {
    let start = |number| Start {
        defaults: &configuration.job.stage,
        plan: &configuration.job.plan,
        fault,
        board: "mps2",
        // Nothing measures ticks in lockstep.
        cycle_hz: 0,
        number,
    };
    let flash = configuration.flash.clone();
    Ok(match scalar {
        image::Scalar::F32 => Box::new(Running::<f32>::start(start(NumberType::F32), flash)?),
        image::Scalar::Fixed => Box::new(Running::<Fixed>::start(start(NumberType::Fixed), flash)?),
    })
}

/// Waits until the firmware has written `value` to a word: the number of the tick that it has answered, or of its start.
fn wait_for(memory: &Memory, emulator: &mut Emulator, word: usize, value: u32) -> Result<()> {
    let mut since = None;
    loop {
        for _ in 0..PAUSES {
            for _ in 0..LOOKS {
                if memory.word(word)? == value {
                    return Ok(());
                }
                std::hint::spin_loop();
            }
            // The firmware may need this very core.
            std::thread::yield_now();
        }
        let since = *since.get_or_insert_with(Instant::now);
        let what = if word == OUTPUT_SEQUENCE {
            "answered tick"
        } else {
            "come to start"
        };
        if let Some(status) = emulator.ended()? {
            bail!("the emulator ended ({status}) before it {what} {value}");
        }
        ensure!(
            since.elapsed() < TIMEOUT,
            "the firmware has not {what} {value} within {TIMEOUT:?}"
        );
    }
}
