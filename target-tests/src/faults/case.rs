//! Cases: the cause of each fault that is found while the machine runs.

use anyhow::Result;
use quadrant::app::Translated;
use quadrant_host::machine::memory_flash::MemoryFlash;
use quadrant_law::axes::AxisName;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::safety::{AxisSwitches, FaultCode, Switches};
use quadrant_link::message::Body;
use quadrant_lockstep::InputRecord;
use quadrant_settings::Job;
use quadrant_settings::{AxisSettings, PlanSettings, StageSettings};
use quadrant_sim::plant::MarkParameters;

use super::approach::{SPEED_MM_S, enabled, homed, homing, moving, start_homing};
use super::fixture::{Configuration, Fixture, InputFault};
use super::streams;

/// Counts from one index pulse to the next: 1 mm, so that homing is short.
const COUNTS_PER_INDEX: u32 = 2_000;
/// Counts that a damaged encoder loses.
const LOST_COUNTS: u32 = 100;

/// A way to bring a fault about.
pub(crate) struct Case {
    /// In words.
    pub(crate) how: &'static str,
    /// Changes to the common configuration.
    pub(crate) adjust: fn(&mut Configuration),
    /// Brings the machine there, and breaks something; gives the first tick whose inputs show it.
    pub(crate) bring: fn(&mut Fixture) -> Result<u32>,
}

/// A sine without an end on every axis, on default settings, with a home switch and index pulses near the start.
pub(crate) fn configuration() -> Configuration {
    let sine = HarmonicSettings {
        cycles: None,
        ..HarmonicSettings::with_velocity(1.0, SPEED_MM_S, 1.0, 0.1)
    };
    let mut stage = StageSettings::simulated();
    for axis in &mut stage.axes {
        axis.encoder.counts_per_index = Some(COUNTS_PER_INDEX);
        if let Some(homing) = &mut axis.homing {
            homing.latch_mm_s = 10.0;
            homing.mark_mm = -0.5;
            homing.travel_mm = 3.0;
        }
    }
    Configuration {
        job: Job {
            stage,
            plan: PlanSettings {
                motions: [MotionSettings::Harmonic(sine); 3],
            },
        },
        marks: MarkParameters {
            home_mm: -1.0,
            index_count: -1_000,
            counts_per_index: COUNTS_PER_INDEX.into(),
            ..MarkParameters::default()
        },
        flash: MemoryFlash::default(),
    }
}

/// Returns the case of a fault that is caused while the machine runs; `None` for those that are found elsewhere.
pub(crate) fn of(code: FaultCode) -> Option<Case> {
    let case = |how, bring| Case {
        how,
        adjust: |_| {},
        bring,
    };
    Some(match code {
        FaultCode::FollowingError => Case {
            how: "encoder of x stands still, 30 mm/s, no model of the plant",
            adjust: |configuration| each(configuration, forget_plant),
            bring: |fixture| {
                moving(fixture, 1.0)?;
                Ok(broken(fixture, frozen(false)))
            },
        },
        FaultCode::EncoderImplausible => case("encoder of x stands still, 30 mm/s", |fixture| {
            moving(fixture, 1.0)?;
            Ok(broken(fixture, frozen(false)))
        }),
        FaultCode::EncoderJump => case("1000 counts in one tick, 30 mm/s", |fixture| {
            moving(fixture, 1.0)?;
            Ok(broken(fixture, drifting(|_| 1_000)))
        }),
        FaultCode::EmergencyStop => case("pressed, 30 mm/s", |fixture| {
            pressed(fixture, 1.0, Switches::EMERGENCY_STOP)
        }),
        FaultCode::NegativeLimitSwitch => case("pressed, -30 mm/s", |fixture| {
            pressed(fixture, -1.0, on_x(AxisSwitches::NEGATIVE_LIMIT))
        }),
        FaultCode::PositiveLimitSwitch => case("pressed, 30 mm/s", |fixture| {
            pressed(fixture, 1.0, on_x(AxisSwitches::POSITIVE_LIMIT))
        }),
        FaultCode::TravelExceeded => Case {
            how: "a load of 2.5 V pushes x out of +-0.2 mm",
            adjust: |configuration| each(configuration, |axis| travel(axis, 0.2)),
            bring: |fixture| {
                homed(fixture)?;
                Ok(broken(
                    fixture,
                    Box::new(|_, plant, _| plant.axes_mut()[0].set_load_v(2.5)),
                ))
            },
        },
        FaultCode::PredictedSoftLimit => Case {
            how: "a sine of 1 mm starts, travel +-0.3 mm",
            adjust: |configuration| each(configuration, |axis| travel(axis, 0.3)),
            bring: |fixture| {
                homed(fixture)?;
                let from = fixture.tick();
                fixture.done(Body::Run)?;
                Ok(from)
            },
        },
        FaultCode::Overspeed => Case {
            how: "100 counts a tick (500 mm/s) at rest",
            adjust: |configuration| {
                each(configuration, far_from_following_error);
                each(configuration, forget_plant);
            },
            bring: |fixture| {
                enabled(fixture)?;
                Ok(broken(fixture, drifting(|ticks| 100 * (ticks + 1))))
            },
        },
        FaultCode::EncoderInvalid => case("both lines of x at once, 30 mm/s", |fixture| {
            moving(fixture, 1.0)?;
            Ok(broken(
                fixture,
                Box::new(|input, _, _| input.readings[0].valid = false),
            ))
        }),
        FaultCode::EncoderSignalLoss => Case {
            how: "one line of x dead, jog at 10 mm/s, output limit 1 V",
            adjust: |configuration| {
                each(configuration, |axis| weak(axis, 1.0));
            },
            bring: |fixture| {
                enabled(fixture)?;
                fixture.done(Body::Jog {
                    axis: Translated::translated(AxisName::X),
                    velocity_mm_s: 10.0,
                })?;
                for _ in 0..10 {
                    fixture.run(500)?;
                    // A jog goes on only while its host asks something.
                    fixture.status()?;
                }
                Ok(broken(fixture, frozen(true)))
            },
        },
        FaultCode::IndexMismatch => {
            case("x loses 100 counts in as many ticks, 30 mm/s", |fixture| {
                moving(fixture, 1.0)?;
                Ok(broken(
                    fixture,
                    drifting(|ticks| (ticks + 1).min(LOST_COUNTS).wrapping_neg()),
                ))
            })
        }
        FaultCode::StaleSample => case("x was not read, 30 mm/s", |fixture| {
            moving(fixture, 1.0)?;
            Ok(broken(
                fixture,
                Box::new(|input, _, _| input.readings[0].fresh = false),
            ))
        }),
        FaultCode::AmplifierFault => case("its line, 30 mm/s", |fixture| {
            pressed(fixture, 1.0, on_x(AxisSwitches::AMPLIFIER_FAULT))
        }),
        FaultCode::OutputMismatch => case(
            "bit 12 of x's converter sticks at one, 30 mm/s",
            |fixture| {
                moving(fixture, 1.0)?;
                Ok(broken(
                    fixture,
                    Box::new(|input, _, _| input.stuck[0] = true),
                ))
            },
        ),
        FaultCode::LinkLost => case(
            "the host falls silent; what it sent lasts for 1.5 s",
            streams::unfinished_stream,
        ),
        FaultCode::StreamUnderrun => case(
            "no more set points; from when the next is due",
            streams::underrunning,
        ),
        FaultCode::HomeSwitchMissing => Case {
            how: "the home switch is 40 mm away, homing goes 3 mm; from its start",
            adjust: |configuration| configuration.marks.home_mm = -40.0,
            bring: homing,
        },
        FaultCode::HomeSwitchStuck => case(
            "the home switch stays pressed; from homing's start",
            |fixture| {
                enabled(fixture)?;
                fixture.inject(Box::new(|input, _, _| {
                    input.switches = on_x(AxisSwitches::HOME);
                }));
                start_homing(fixture)
            },
        ),
        FaultCode::IndexMissing => case("no index pulses; from homing's start", |fixture| {
            enabled(fixture)?;
            fixture.inject(Box::new(|input, _, _| {
                input.readings = input.readings.map(|reading| EncoderReading {
                    index: None,
                    ..reading
                });
            }));
            start_homing(fixture)
        }),
        FaultCode::IndexNearSwitch => Case {
            how: "an index pulse 10 um behind the switch; from homing's start",
            // The switch lets go 0.05 mm after it was pressed.
            adjust: |configuration| configuration.marks.index_count = -1_880,
            bring: homing,
        },
        FaultCode::InjectionUnderrun => case(
            "no more values; from when the next is due",
            streams::injection_without_end,
        ),
        FaultCode::InjectionBounds => case(
            "1 V in open loop, 0.02 mm allowed; from its start",
            |fixture| streams::injecting(fixture, 1.0, 0.02),
        ),
        FaultCode::Overload => Case {
            how: "a load of 1 V on x at rest; its motor withstands 0.1 V indefinitely, 2 V for 50 ms",
            adjust: |configuration| {
                each(configuration, |axis| {
                    weak(axis, 2.0);
                    axis.amplifier.continuous_v = 0.1;
                    axis.amplifier.overload_s = 0.05;
                });
            },
            bring: |fixture| {
                enabled(fixture)?;
                Ok(broken(
                    fixture,
                    Box::new(|_, plant, _| plant.axes_mut()[0].set_load_v(1.0)),
                ))
            },
        },
        FaultCode::Oscillation => Case {
            how: "a load of 0.5 V and 60 Hz on x at rest; 0.2 mm of error allowed",
            adjust: |configuration| {
                each(configuration, |axis| axis.limits.following_error_mm = 0.2)
            },
            bring: |fixture| {
                enabled(fixture)?;
                Ok(broken(
                    fixture,
                    Box::new(|_, plant, tick| {
                        let phase = 60.0 * std::f64::consts::TAU * f64::from(tick) * 1e-4;
                        plant.axes_mut()[0].set_load_v(0.5 * phase.sin());
                    }),
                ))
            },
        },
        FaultCode::DeadlineMissed
        | FaultCode::WatchdogReset
        | FaultCode::Panic
        | FaultCode::HardFault
        | FaultCode::StopOverrun
        | FaultCode::PulseOverspeed
        | FaultCode::PulseJump
        | FaultCode::SettingsInvalid => return None,
    })
}

fn each(configuration: &mut Configuration, change: fn(&mut AxisSettings)) {
    configuration.job.stage.axes.iter_mut().for_each(change);
}

fn travel(axis: &mut AxisSettings, most_mm: f64) {
    if let Some(travel) = &mut axis.limits.travel_mm {
        (travel.negative, travel.positive) = (-most_mm, most_mm);
    }
}

/// Leaves the comparison of encoder and plant out.
fn forget_plant(axis: &mut AxisSettings) {
    axis.plant = None;
}

fn far_from_following_error(axis: &mut AxisSettings) {
    axis.limits.following_error_mm = 20.0;
    axis.limits.following_error_max_mm = 20.0;
}

/// Limits the output, V, and leaves out the monitors that would find an axis that stands before its own does.
fn weak(axis: &mut AxisSettings, most_v: f64) {
    far_from_following_error(axis);
    forget_plant(axis);
    axis.amplifier.output_limit_v = most_v;
    let integral = &mut axis.feedback.integral_limit_v;
    *integral = integral.min(most_v);
}

fn on_x(switch: AxisSwitches) -> Switches {
    Switches::NONE.with_axis(AxisName::X, switch)
}

/// Breaks something from the next tick on, which is given.
fn broken(fixture: &mut Fixture, cause: InputFault) -> u32 {
    fixture.inject(cause);
    fixture.tick()
}

/// The encoder of x shows what it shows now, or dithers by a count.
fn frozen(dithers: bool) -> InputFault {
    let mut seen = None;
    Box::new(move |input, _, ticks| {
        let count = *seen.get_or_insert(input.readings[0].count);
        let dither = if dithers { ticks % 2 } else { 0 };
        input.readings[0] = EncoderReading::of(count.wrapping_add(dither));
    })
}

/// The counter of x is wrong by what is said.
fn drifting(by: fn(u32) -> u32) -> InputFault {
    Box::new(move |input: &mut InputRecord, _, ticks| {
        let reading = &mut input.readings[0];
        let wrong = by(ticks);
        reading.count = reading.count.wrapping_add(wrong);
        reading.index = reading.index.map(|index| index.wrapping_add(wrong));
    })
}

/// Something is pressed at full speed.
fn pressed(fixture: &mut Fixture, direction: f64, switches: Switches) -> Result<u32> {
    moving(fixture, direction)?;
    Ok(broken(
        fixture,
        Box::new(move |input, _, _| input.switches = input.switches.with(switches)),
    ))
}
