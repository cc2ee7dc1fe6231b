//! One axis of the law on a plant, behind an encoder that may die.

use quadrant_law::axes::AxisName;
use quadrant_law::axis::{Axis, AxisState};
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::reference::{Motion, MotionSettings, Velocity};
use quadrant_law::safety::FaultCode;
use quadrant_law::scalar::Scalar;
use quadrant_settings::StageSettings;

use crate::plant::{Encoder, Plant};

/// An order to an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    Rest,
    /// mm/s.
    Jog(f64),
    Plan(MotionSettings),
}

/// Ticks from enabling to the order.
pub const BEFORE: u32 = 50;

/// The x axis of a stage by itself, driven until a fault.
pub struct Lone<S: Scalar> {
    axis: Axis<S, 4>,
    state: AxisState<S, 4>,
    motion: Motion<S>,
    start: Option<Command>,
    full_scale_v: f64,
    /// Tick in which the encoder dies.
    dies: u32,
    pub plant: Plant,
    pub encoder: Encoder,
    pub ticks: u32,
    pub fault: Option<FaultCode>,
    /// Output of the last tick, V.
    pub output_v: f64,
    /// Position that the encoder showed in it, mm.
    pub shown_mm: f64,
}

impl<S: Scalar> Lone<S> {
    pub fn new(
        settings: &StageSettings,
        order: Order,
        plant: Plant,
        encoder: Encoder,
        dies: u32,
    ) -> Self {
        settings.validate(4).expect("valid settings");
        let scale = settings.motion_scale(0);
        let (motion, start) = match &order {
            Order::Rest => (Motion::Hold, None),
            Order::Jog(speed) => {
                let speed = Velocity::from_mm_s(*speed, scale);
                (Motion::Hold, Some(Command::Jog(AxisName::X, speed)))
            }
            Order::Plan(plan) => (Motion::build(plan, scale), Some(Command::Run)),
        };
        Self {
            axis: settings.build_axis(AxisName::X),
            state: AxisState::default(),
            motion,
            start,
            full_scale_v: settings.axes[0].amplifier.full_scale_v,
            dies,
            plant,
            encoder,
            ticks: 0,
            fault: None,
            output_v: 0.0,
            shown_mm: 0.0,
        }
    }

    /// Position of the reference that the feedback has, mm.
    pub fn reference_mm(&self) -> f64 {
        self.state.reference().to_mm(crate::plant::COUNT_MM)
    }

    /// A control period; after a fault the output is zero.
    pub fn tick(&mut self) {
        let age = self.ticks.checked_sub(self.dies);
        let count = self.encoder.read(self.plant.position_mm, age);
        self.shown_mm = count as f64 * crate::plant::COUNT_MM;
        let reading = EncoderReading::of(count as i32 as u32);
        if self.ticks == BEFORE
            && let Some(command) = self.start.take()
        {
            self.axis.handle_command(&mut self.state, command);
        }
        if self.fault.is_none() {
            let code = self.axis.tick(&mut self.state, &self.motion, &reading);
            match code {
                Ok(code) => self.output_v = code.to_volts(self.full_scale_v),
                Err(fault) => (self.fault, self.output_v) = (Some(fault), 0.0),
            }
            if self.ticks == 1 {
                self.axis.hold_here(&mut self.state);
            }
        }
        self.plant.step(self.output_v);
        self.ticks += 1;
    }
}
