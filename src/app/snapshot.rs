//! What the slow half sees of the fast one, once every [`PERIOD_TICKS`](crate::app::supervisor::PERIOD_TICKS).

use crate::law::admission::StageView;
use crate::law::friction::gms::FIRMWARE_ELEMENTS;
use crate::law::injection::InjectionProgress;
use crate::law::safety::monitor::FollowingState;
use crate::law::scalar::Scalar;
use crate::law::stage::StageState;
use crate::law::telemetry::LimitedBy;
use crate::law::units::{EncoderCount, Position};

/// One axis in a [`Snapshot`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisSnapshot<S> {
    /// Measured position.
    pub measured: EncoderCount,
    /// Where the reference stands, ahead of the feedback's by the preview.
    pub ahead: Position,
    /// Tracking error, mm.
    pub error: S,
    /// Output, V.
    pub output: S,
    /// What limits the output.
    pub limited_by: LimitedBy,
    /// The largest tracking error since enabling, against its limit.
    pub following: FollowingState<S>,
}

/// The machine at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot<S> {
    /// Control ticks so far.
    pub tick: u32,
    /// What decisions are made on.
    pub view: StageView,
    /// The axes.
    pub axes: [AxisSnapshot<S>; 3],
    /// How far the injection under way has come, or the last one came.
    pub injection: InjectionProgress,
}

impl<S: Scalar> Snapshot<S> {
    /// What there is to see.
    pub fn of(state: &StageState<S, FIRMWARE_ELEMENTS>) -> Self {
        Self {
            tick: state.tick(),
            view: StageView::of(state),
            axes: state.axes().each_ref().map(|axis| {
                let telemetry = axis.telemetry();
                AxisSnapshot {
                    measured: telemetry.measured,
                    ahead: axis.reference(),
                    error: telemetry.error,
                    output: telemetry.output,
                    limited_by: telemetry.limited_by,
                    following: axis.following(),
                }
            }),
            injection: state.injection_progress(),
        }
    }
}

/// How the control interrupt keeps its time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Meters {
    /// Ticks that ended after their deadline.
    pub overruns: u32,
    /// The longest tick, in cycles of its timer.
    pub longest_tick_cycles: u32,
}
