//! A host's voltage within the tick of the stage.

use super::{StageRef, StageState};
use crate::law::axis::{Axis, AxisState};
use crate::law::injection::{InjectedValue, Injection, InjectionProgress, InjectionStep};
use crate::law::safety::{AxisName, Command};
use crate::law::scalar::Scalar;

impl<S: Scalar, const N: usize> StageState<S, N> {
    /// Takes an injection; it begins with [`Command::StartInjection`], once its first value is there.
    pub fn prepare_injection(&mut self, injection: Injection<S>) {
        self.injection.prepare(injection);
    }

    /// Whether there is an injection, so that its values are wanted.
    pub fn has_injection(&self) -> bool {
        self.injection.is_prepared()
    }

    /// Whether it has room for a value.
    pub fn wants_voltage(&self) -> bool {
        self.injection.wants_value()
    }

    /// Gives it the next value of a block; call it when [`StageState::wants_voltage`].
    pub(crate) fn offer_value(&mut self, value: InjectedValue) {
        self.injection.offer(value);
    }

    /// Gives it its next value, in the converter's words; call it when [`StageState::wants_voltage`]. `last`: it ends with
    /// this one.
    pub fn offer_voltage(&mut self, word: i16, last: bool) {
        self.offer_value(InjectedValue { word, last });
    }

    /// Whether an injection can begin.
    pub fn is_injection_ready(&self) -> bool {
        self.injection.is_ready()
    }

    /// Whether an injection is under way.
    pub fn is_injecting(&self) -> bool {
        self.injection.is_running()
    }

    /// How far the injection has come, or came that was the last.
    pub fn injection_progress(&self) -> InjectionProgress {
        self.injection.progress()
    }
}

impl<S: Scalar, const N: usize> StageRef<'_, S, N> {
    /// The axis of an injection, and its memory.
    fn of_axis<'s>(
        &self,
        axes: &'s mut [AxisState<S, N>; 3],
        name: AxisName,
    ) -> (&Axis<S, N>, &'s mut AxisState<S, N>) {
        let ([ax, ay, az], [x, y, z]) = (self.axes, axes);
        match name {
            AxisName::X => (ax, x),
            AxisName::Y => (ay, y),
            AxisName::Z => (az, z),
        }
    }

    /// Begins the injection that is ready.
    pub(super) fn start_injection(&self, state: &mut StageState<S, N>, tick: u32) {
        let Some(injection) = state.injection.injection() else {
            return;
        };
        let (name, open_loop, with_plan) =
            (injection.axis, injection.open_loop, injection.with_plan);
        let (axis, memory) = self.of_axis(&mut state.axes, name);
        state.injection.begin(tick, memory.measured());
        if open_loop {
            axis.open_loop(memory);
        } else if with_plan {
            for (axis, memory) in self.axes.into_iter().zip(&mut state.axes) {
                axis.obey(memory, Command::Run);
            }
        }
    }

    /// The voltage of this tick.
    #[cold]
    #[inline(never)]
    pub(super) fn inject(&self, state: &mut StageState<S, N>, tick: u32) {
        let Some(name) = state.injection.injection().map(|injection| injection.axis) else {
            return;
        };
        let (_, memory) = self.of_axis(&mut state.axes, name);
        match state.injection.step(memory.measured(), memory.speed()) {
            InjectionStep::Voltage(voltage) => memory.inject(voltage),
            InjectionStep::Finished => self.end_injection(state),
            InjectionStep::Fault(code) => self.trip(state, code, Some(name), tick),
        }
    }

    /// Ends an injection, if one is under way: no voltage more, and the loop closed, braking from the motion that the axis
    /// has.
    pub(super) fn end_injection(&self, state: &mut StageState<S, N>) {
        if let Some(injection) = state.injection.end() {
            let (axis, memory) = self.of_axis(&mut state.axes, injection.axis);
            axis.end_injection(memory);
        }
    }
}
