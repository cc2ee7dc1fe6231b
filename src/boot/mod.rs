//! The start: settings, static storage, and the crash record of the last run.

mod settings;
mod storage;

use core::mem::MaybeUninit;

use quadrant::app::crash_record::CrashCause;
use quadrant::app::{Axis, Control, ControlEnds, Intake, Server, ServerParts};
use quadrant::hal::{Encoders, ResetCause};
use quadrant_law::axes::AxisName;
use quadrant_law::safety::{FaultCode, Operation};
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::Plan;
use quadrant_link::message::NumberType;
use quadrant_settings::{EncoderSettings, StageSettings};

use self::settings::{Loaded, count_start, load};
use crate::board::{self, SettingsFlash};
use crate::log;

pub(crate) use self::settings::forget_starts;
pub(crate) use self::storage::StaticStorage;

/// The two halves of the machine, ready for the first tick.
pub(crate) struct Machine<S: Scalar + 'static> {
    /// The fast half, of the control interrupt.
    pub(crate) control: &'static mut Control<'static, 'static, S>,
    /// The link's bytes on their way, of the supervising task.
    pub(crate) intake: &'static mut Intake<'static>,
    /// The slow half, of the lowest task.
    pub(crate) server: &'static mut Server<'static, 'static, S, SettingsFlash>,
    /// Control rate, Hz.
    pub(crate) rate_hz: u32,
    /// The encoders.
    pub(crate) encoders: [EncoderSettings; 3],
}

/// Loads the settings and makes the machine of them. `crashed` is the fault that the last run left; `cycle_hz` is the rate of the
/// timer that measures ticks.
pub(crate) fn machine<S: Scalar>(
    storage: &'static mut StaticStorage<S>,
    flash: SettingsFlash,
    crashed: Option<FaultCode>,
    cycle_hz: u32,
    number: NumberType,
) -> Machine<S> {
    let settings = defaults(&mut storage.settings);
    let draft = defaults(&mut storage.draft);
    let Loaded {
        plan,
        provenance,
        store,
        invalid,
        keep_draft,
    } = load(
        flash,
        settings,
        draft,
        &mut storage.buffer,
        count_start(crashed.is_some()),
    );
    // The back buffer's content does not matter: it is built over before it is used.
    let [x, y, z, back_buffer] = storage.axes.each_mut().map(blank_axis);
    let mut axes = [x, y, z];
    // Tables are filled and bounds are searched before the first tick is due.
    for (name, axis) in AxisName::ALL.into_iter().zip(&mut axes) {
        settings.build_axis_into(name, axis);
    }
    let rate_hz = settings.rate_hz as u32;
    let encoders = settings.axes.each_ref().map(|axis| axis.encoder);
    let operation = settings.operation();
    let (control_ends, intake_ends, ends) = storage.queues.split();
    let control = place_control(
        &mut storage.control,
        axes,
        operation,
        plan,
        rate_hz,
        control_ends,
    );
    let invalid = invalid.then_some(FaultCode::SettingsInvalid);
    for code in [crashed, invalid].into_iter().flatten() {
        control.start_faulted(code);
    }
    let parts = ServerParts {
        ends,
        back_buffer,
        settings,
        draft,
        keep_draft,
        provenance,
        store,
        buffer: &mut storage.buffer,
        capture: &mut storage.capture,
        board: board::NAME,
        cycle_hz,
        rates_hz: board::RATES_HZ,
        pulse_axes: board::PULSE_AXES,
        serial_axes: <board::Encoders as Encoders>::SERIAL_AXES,
        number,
        log: board::TAKE_LOG,
    };
    Machine {
        control,
        intake: storage.intake.write(Intake::new(intake_ends)),
        server: place_server(&mut storage.server, parts),
        rate_hz,
        encoders,
    }
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

/// Makes the default settings in their place.
#[inline(never)]
fn defaults(place: &mut MaybeUninit<StageSettings>) -> &mut StageSettings {
    place.write(StageSettings::default())
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
    place: &'static mut MaybeUninit<Server<'static, 'static, S, SettingsFlash>>,
    parts: ServerParts<'static, 'static, S, SettingsFlash>,
) -> &'static mut Server<'static, 'static, S, SettingsFlash> {
    place.write(Server::new(parts))
}
