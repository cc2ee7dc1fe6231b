//! The slow half's view of the fast one, taken once every [`PERIOD_TICKS`](quadrant_law::supervisor::PERIOD_TICKS).

use quadrant_law::admission::StageView;
use quadrant_law::axes::PerAxis;
use quadrant_law::axis::AxisState;
use quadrant_law::axis::telemetry::LimitedBy;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::injection::InjectionProgress;
use quadrant_law::learning::LearningReading;
use quadrant_law::safety::Switches;
use quadrant_law::safety::monitor::FollowingState;
use quadrant_law::safety::oscillation::OscillationReading;
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::{Plan, StageRef, StageState};
use quadrant_law::units::{EncoderCount, Position};

/// One axis in a [`Snapshot`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisSnapshot<S> {
    /// Measured position.
    pub measured: EncoderCount,
    /// Reference position of the feedback.
    pub reference: Position,
    /// Look-ahead reference position: ahead of the feedback's by the preview.
    pub ahead: Position,
    /// Tracking error, mm.
    pub error: S,
    /// Output, V.
    pub output: S,
    /// The active limit of the output.
    pub limited_by: LimitedBy,
    /// The largest tracking error since enabling, against its limit.
    pub following: FollowingState<S>,
    /// The result of learning.
    pub learning: LearningReading<S>,
    /// The oscillation that was found last.
    pub oscillation: OscillationReading,
}

/// The machine at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot<S> {
    /// Control ticks so far.
    pub tick: u32,
    /// The supervisor's view.
    pub view: StageView,
    /// The digital inputs.
    pub switches: Switches,
    /// The axes whose encoder has shown an index pulse.
    pub indexed: PerAxis<bool>,
    /// The axes in order: x, y, z.
    pub axes: [AxisSnapshot<S>; 3],
    /// Progress of the injection under way, or of the last one.
    pub injection: InjectionProgress,
    /// Orders of the server that control has taken; wraps.
    pub orders: u16,
    /// Axes that control has exchanged; wraps.
    pub exchanges: u16,
    /// True if the last order to exchange the plan was carried out.
    pub plan_taken: bool,
    /// True if the plan moves an axis.
    pub planned: bool,
}

impl<S: Scalar> Snapshot<S> {
    /// Takes a snapshot of the stage, which has taken no order yet and whose inputs are not known.
    pub fn of(
        stage: &StageRef<'_, S>,
        plan: &Plan<S>,
        state: &StageState<S, FIRMWARE_ELEMENTS>,
    ) -> Self {
        let mut snapshot = Self::default();
        snapshot.renew(stage, plan, state);
        snapshot
    }

    /// Takes a snapshot of the stage in the place of an older one; what control alone knows stays.
    // Field by field: a whole one is more than the registers hold, and passes through the stack.
    #[inline(always)]
    pub fn renew(
        &mut self,
        stage: &StageRef<'_, S>,
        plan: &Plan<S>,
        state: &StageState<S, FIRMWARE_ELEMENTS>,
    ) {
        for (place, axis) in self.axes.iter_mut().zip(state.axes()) {
            let telemetry = axis.telemetry();
            *place = AxisSnapshot {
                measured: telemetry.measured,
                reference: telemetry.reference,
                ahead: axis.reference(),
                error: telemetry.error,
                output: telemetry.output,
                limited_by: telemetry.limited_by,
                following: axis.following(),
                learning: axis.learning().reading(),
                oscillation: axis.oscillation(),
            };
        }
        self.tick = state.tick();
        self.indexed = state.axes().by_ref().map(AxisState::is_indexed);
        self.injection = state.injection_progress();
        self.view = stage.view(plan, state);
    }
}

/// Timing statistics of the control interrupt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimingStatistics {
    /// Ticks that began late, or ended after their deadline.
    pub overruns: u32,
    /// The longest tick, in cycles of its timer.
    pub longest_tick_cycles: u32,
}
