//! Provocations of the monitors' parameters: short runs that end in a fault, or would with other parameters.

use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::safety::{AxisSwitches, Operation, SafetyState, Switches};
use quadrant_settings::StageSettings;

use crate::parameter_trace::{Trace, plan, tick_of};
use quadrant_test_support::Rig;

/// The longest of the runs, ticks.
const LONGEST: usize = 4000;

/// A run on one axis: moves its encoder, and says what the others do.
type Run = fn(&mut Rig<f32>, usize, usize);

fn moving(rig: &mut Rig<f32>) {
    for index in 0..3 {
        let reference = rig.state.axes()[index].telemetry().reference;
        rig.inputs.readings[index].count = (reference.0 >> 16) as u32;
    }
}

/// Falls behind almost to the limit at rest, and from `later` on by two counts a tick: the error meets the limit of the
/// speed at that time.
fn fall_behind(rig: &mut Rig<f32>, axis: usize, tick: usize, later: usize) {
    moving(rig);
    let lag = (50 * tick).min(1980) + 2 * tick.saturating_sub(later);
    let count = &mut rig.inputs.readings[axis].count;
    *count = count.wrapping_sub(lag as u32);
}

const MOVING: [Run; 4] = [
    |rig, axis, tick| fall_behind(rig, axis, tick, 600),
    |rig, axis, tick| fall_behind(rig, axis, tick, 1200),
    // Through the middle at full speed.
    |rig, axis, tick| fall_behind(rig, axis, tick, 1950),
    |rig, _, tick| {
        moving(rig);
        rig.inputs.link_lost = tick > 2000;
    },
];

const STANDING: [Run; 5] = [
    // Above the fastest of the base settings.
    |rig, axis, _| {
        let count = &mut rig.inputs.readings[axis].count;
        *count = count.wrapping_add(63);
    },
    // Away, until the output is just below the level; then the integral raises it.
    |rig, axis, _| {
        if rig.state.axes()[axis].telemetry().output.abs() < 0.88 * 1.5 {
            rig.inputs.readings[axis].count += 5;
        }
    },
    // Out of the travel, on either side.
    |rig, axis, tick| {
        rig.state.set_homed(AxisName::ALL[axis], true);
        rig.inputs.readings[axis].count = tick as u32;
    },
    |rig, axis, tick| {
        rig.state.set_homed(AxisName::ALL[axis], true);
        rig.inputs.readings[axis].count = 0u32.wrapping_sub(tick as u32);
    },
    // Two index pulses, just within the tolerance.
    |rig, axis, tick| {
        let reading = &mut rig.inputs.readings[axis];
        reading.count = (tick as u32).min(100);
        reading.index = match tick {
            1 => Some(0),
            60 => Some(24),
            _ => None,
        };
    },
];

/// Homes; with a switch below -200 counts, or without one.
fn home(rig: &mut Rig<f32>, axis: usize, tick: usize, has_switch: bool) {
    let name = AxisName::ALL[axis];
    if tick == 1 {
        rig.inputs.command = Some(Command::Home(name));
    }
    let (seen, asked) = {
        let telemetry = rig.state.axes()[axis].telemetry();
        (telemetry.measured.0, telemetry.reference.0 >> 16)
    };
    let reading = &mut rig.inputs.readings[axis];
    let before = reading.count as i32;
    // The counter knows nothing of the origin.
    let after = before + (asked - seen) as i32;
    reading.count = after as u32;
    let pulse = (before.max(after) - 10).div_euclid(20) * 20 + 10;
    reading.index = (pulse > before.min(after)).then_some(pulse as u32);
    let pressed = has_switch && after <= -200;
    let home = if pressed {
        AxisSwitches::HOME
    } else {
        AxisSwitches::default()
    };
    rig.inputs.switches = Switches::NONE.with_axis(name, home);
}

const HOMING: [Run; 2] = [
    |rig, axis, tick| home(rig, axis, tick, true),
    |rig, axis, tick| home(rig, axis, tick, false),
];

fn run(settings: &StageSettings, axis: usize, moves: bool, run: Run) -> Trace {
    let mut rig = Rig::<f32>::new(settings, &plan());
    if moves {
        rig.start();
    } else {
        rig.tick();
        rig.command(quadrant_law::command::Command::Enable);
    }
    let mut trace = vec![];
    for tick in 1..LONGEST {
        run(&mut rig, axis, tick);
        trace.push(tick_of(&mut rig));
        if let SafetyState::Faulted(_) = rig.state.safety() {
            break;
        }
    }
    (trace, rig.state.safety())
}

/// The result of every run, and the stage's rules of operation.
pub(crate) fn provoke(settings: &StageSettings, axis: usize) -> Option<(Vec<Trace>, Operation)> {
    let stage = settings.build::<f32, 4>().ok()?;
    plan().validate(settings).ok()?;
    let moving = MOVING.iter().map(|each| run(settings, axis, true, *each));
    let standing = STANDING
        .iter()
        .chain(&HOMING)
        .map(|each| run(settings, axis, false, *each));
    Some((moving.chain(standing).collect(), *stage.as_ref().operation))
}
