//! The start: static storage, where the axes come from, and the crash record of the last run.

#[cfg(feature = "lean")]
mod host_axes;
#[cfg(not(feature = "lean"))]
mod own_settings;
mod storage;

use core::mem::MaybeUninit;

use quadrant::app::crash_record::CrashCause;
use quadrant::app::{Axis, Control, ControlEnds, Intake, Server, ServerParts};
use quadrant::hal::ResetCause;
use quadrant::safety::{FaultCode, Operation};
use quadrant::scalar::Scalar;
use quadrant::stage::Plan;

use crate::source::Source;
use crate::{board, log};

#[cfg(feature = "lean")]
pub(crate) use host_axes::{forget_starts, machine};
#[cfg(not(feature = "lean"))]
pub(crate) use own_settings::{forget_starts, machine};
pub(crate) use storage::StaticStorage;

/// The two halves of the machine, ready for the first tick.
pub(crate) struct Machine<S: Scalar + 'static> {
    /// The fast half, of the control interrupt.
    pub(crate) control: &'static mut Control<'static, 'static, S>,
    /// The link's bytes on their way, of the supervising task.
    pub(crate) intake: &'static mut Intake<'static>,
    /// The slow half, of the lowest task.
    pub(crate) server: &'static mut Server<'static, 'static, S, Source>,
    /// Control rate, Hz.
    pub(crate) rate_hz: u32,
    /// Lengths of the encoders' counts, mm.
    pub(crate) resolution_mm: [f64; 3],
}

/// Logs the crash record of the last run; returns its fault, or that of a watchdog reset.
pub(crate) fn report_crash(cause: ResetCause) -> Option<FaultCode> {
    log::started(cause);
    if let Some(record) = board::crash_record::take() {
        defmt::error!(
            "the firmware before this one ended in tick {=u32} by {=str}: {=str}",
            record.tick,
            record.cause.as_str(),
            record.text()
        );
        return Some(match record.cause {
            CrashCause::Panic => FaultCode::Panic,
            CrashCause::HardFault | CrashCause::StrayInterrupt | CrashCause::ClockFailed => {
                FaultCode::HardFault
            }
        });
    }
    (cause == ResetCause::Watchdog).then_some(FaultCode::WatchdogReset)
}

/// Makes room for an axis.
#[inline(never)]
fn blank_axis<S: Scalar>(place: &mut MaybeUninit<Axis<S>>) -> &mut Axis<S> {
    place.write(Axis::blank())
}

/// Makes the fast half in its place.
#[inline(never)]
fn place_control<S: Scalar>(
    place: &'static mut MaybeUninit<Control<'static, 'static, S>>,
    axes: [&'static mut Axis<S>; 3],
    operation: Operation,
    plan: Plan<S>,
    rate_hz: u32,
    ends: ControlEnds<'static, 'static, S>,
) -> &'static mut Control<'static, 'static, S> {
    place.write(Control::new(axes.into(), operation, plan, rate_hz, ends))
}

/// Makes the slow half in its place.
#[inline(never)]
fn place_server<S: Scalar>(
    place: &'static mut MaybeUninit<Server<'static, 'static, S, Source>>,
    parts: ServerParts<'static, 'static, S, Source>,
) -> &'static mut Server<'static, 'static, S, Source> {
    place.write(Server::new(parts))
}
