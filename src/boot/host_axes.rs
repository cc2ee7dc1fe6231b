//! The start of a board that holds no settings: a host loads its axes.

use quadrant::app::{HostAxes, Intake, ServerParts};
use quadrant::axes::PerAxis;
use quadrant::link::message::NumberType;
use quadrant::reference::Motion;
use quadrant::safety::{FaultCode, Operation};
use quadrant::scalar::Scalar;

use super::storage::StaticStorage;
use super::{Machine, blank_axis, place_control, place_server};
use crate::board;

/// Control rate, Hz: axes that are built for another are refused.
const RATE_HZ: u32 = 10_000;
const _: () = {
    let (lowest, highest) = board::RATES_HZ;
    assert!(RATE_HZ as f64 >= lowest && RATE_HZ as f64 <= highest);
};

/// Makes the machine without axes: it puts nothing out, and control keeps the outputs off until a host has loaded all of them.
/// `crashed` is the fault that the last run left; `cycle_hz` is the rate of the timer that measures ticks.
pub(crate) fn machine<S: Scalar>(
    storage: &'static mut StaticStorage<S>,
    crashed: Option<FaultCode>,
    cycle_hz: u32,
    number: NumberType,
) -> Machine<S> {
    let [x, y, z, back_buffer] = storage.axes.each_mut().map(blank_axis);
    let (control_ends, intake_ends, ends) = storage.queues.split();
    let plan = PerAxis::from_fn(|_| Motion::Hold);
    let control = place_control(
        &mut storage.control,
        [x, y, z],
        Operation::default(),
        plan,
        RATE_HZ,
        control_ends,
    );
    control.start_unloaded();
    if let Some(code) = crashed {
        control.start_faulted(code);
    }
    defmt::info!("no axes are loaded; `quadrant connect load FILE` loads them");
    let parts = ServerParts {
        ends,
        back_buffer,
        source: HostAxes::new(RATE_HZ),
        capture: &mut storage.capture,
        board: board::NAME,
        cycle_hz,
        number,
    };
    Machine {
        control,
        intake: storage.intake.write(Intake::new(intake_ends)),
        server: place_server(&mut storage.server, parts),
        rate_hz: RATE_HZ,
        resolution_mm: [0.0; 3],
    }
}

/// Starts are not counted: there are no settings to set aside.
pub(crate) fn forget_starts() {}
