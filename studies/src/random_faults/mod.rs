//! Random faults at random activities, over control, supervision, server and store as the target runs them, with an x axis
//! that moves as its output makes it, and a flash that wears and loses its power. One seed is one campaign of a second.
//!
//! The invariants are stated here once, by constants of their own: nothing of it is taken from the code under test.

mod restart;
mod summary;

use clap::Args;
use quadrant_law::command::Command;
use quadrant_law::safety::{SafetyState, Switches};
use quadrant_law::units::DacCode;
use quadrant_link::message::{
    AxisName, AxisSet, Body, Harmonic, InjectRequest, Motion, Plan, PointToPoint, Reply,
    SettingsRequest, Voltages,
};
use quadrant_settings::StageSettings;

use quadrant_fault_bench::flash::{Damage, SECTOR};
use quadrant_fault_bench::noise::Noise;
use quadrant_fault_bench::plant::{DEATHS, Death, Encoder, FLICKERS, MODEL, Plant};
use quadrant_fault_bench::tasks::{Moved, Tasks};
use serde::{Deserialize, Serialize};

use crate::campaign::{self, Lines};

/// `quadrant-studies faults`.
#[derive(Clone, Debug, Args)]
pub struct Faults {}

impl campaign::Campaign for Faults {
    type Line = Line;
    const NAME: &'static str = "faults";
    const COLUMNS: &'static [&'static str] = &[
        "broken",
        "unplanned_mm",
        "unseen",
        "fault",
        "was_cut",
        "campaign",
    ];

    fn judge(&self, seed: u64) -> Line {
        judge(seed)
    }

    fn summarise(lines: &Lines<Line>) -> anyhow::Result<()> {
        summary::print(lines)
    }
}

/// Largest word: 10 V of 10 V.
const LARGEST_WORD: i16 = 32_767;
/// Ticks from a fault that stops to outputs that are off: 105 ms of braking, 200 ticks of rest.
const STOP_TICKS: u32 = 1050 + 200;
/// Largest unplanned way of the x axis until the outputs are off, mm.
const UNPLANNED_MM: f64 = 2.1;
/// The same in motions slower than [`SLOW_MM_S`], mm: what friction holds there hides a dead encoder for longer.
const SLOW_UNPLANNED_MM: f64 = 17.0;
/// Speed below which that counts, mm/s.
const SLOW_MM_S: f64 = 2.0;
/// The same in motions slower than [`SLOWEST_MM_S`], mm: the voltage grows as slowly as the following error does, and the axis gains
/// speed until the voltage has grown by what friction may hold.
const SLOWEST_UNPLANNED_MM: f64 = 25.0;
/// Speed below which that counts, mm/s.
const SLOWEST_MM_S: f64 = 0.15;
/// The same under a voltage that is injected in closed loop, mm: it goes to and fro, and so does what is seen of the motion.
const INJECTED_UNPLANNED_MM: f64 = 3.5;
/// The same where an encoder shows counts of its own, mm.
const FLICKERING_UNPLANNED_MM: f64 = 15.0;
/// Speed below which such counts pass for a motion, mm/s.
const FLICKERING_MM_S: f64 = 10.0;
/// Speed below which a motion that ends does so before such an encoder is found, mm/s.
const FLICKERING_TO_REST_MM_S: f64 = 60.0;
/// Speed below which an axis comes to rest, mm/s: if its encoder dies then, the voltage that it has may be that of a load.
const COMING_TO_REST_MM_S: f64 = 30.0;
/// Distance that an axis coasts over its speed, s: 1 / B of the plant.
const COASTING_S: f64 = 1.0 / 144.8;
/// Distance that the largest output adds within the dead time, A V Td / B, mm.
const COASTING_MM: f64 = 69_390.0 * 10.0 * 1.2e-3 / 144.8;
/// Ticks of a campaign.
const TICKS: u32 = 10_000;
/// Last tick in which something happens.
const LAST_EVENT: u32 = 8_000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Activity {
    Rest,
    Jog(f32),
    Sine,
    Move,
    Home,
    OpenLoop,
    ClosedLoop,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    Dies(Death),
    Load(f64),
    HostSilent,
    Garbage,
    Settings,
    Button(Command),
    Store,
    EmergencyStop,
    Stop,
    /// The supply fails so many words and erasures after the axes were disabled and a store was asked for.
    PowerCut(u64, Damage),
}

/// One campaign, drawn from its seed.
#[derive(Debug)]
struct Campaign {
    seed: u64,
    activity: Activity,
    events: Vec<(u32, Event)>,
    /// The flash holds a set already.
    has_stored: bool,
    /// Words of the flash that no longer change.
    worn: Option<(usize, usize)>,
}

impl Campaign {
    fn draw(seed: u64) -> Self {
        let mut noise = Noise::new(seed + 1);
        // The first numbers of neighbouring seeds are alike.
        for _ in 0..8 {
            noise.bits();
        }
        let mut pick = |below: u64| (noise.bits() >> 20) % below;
        let activity = match pick(7) {
            0 => Activity::Rest,
            1 => Activity::Jog(
                [0.1, -0.2, 0.5, 1.0, -2.0, 5.0, 10.0, -50.0, 200.0][pick(9) as usize],
            ),
            2 => Activity::Sine,
            3 => Activity::Move,
            4 => Activity::Home,
            5 => Activity::OpenLoop,
            _ => Activity::ClosedLoop,
        };
        let deaths = [&DEATHS[..], &FLICKERS].concat();
        let buttons = [Command::Enable, Command::Disable, Command::Run];
        let mut events: Vec<_> = (0..1 + pick(3))
            .map(|_| {
                let tick = 500 + pick(u64::from(LAST_EVENT) - 500) as u32;
                let event = match pick(10) {
                    0..=2 => Event::Dies(deaths[pick(deaths.len() as u64) as usize]),
                    3 => Event::Load(0.25 * (pick(9) as f64 - 4.0)),
                    4 => Event::HostSilent,
                    5 => [Event::Garbage, Event::Settings][pick(2) as usize],
                    6 => Event::Button(buttons[pick(3) as usize]),
                    7 => Event::Store,
                    8 => Event::PowerCut(pick(1500), Damage::each(seed)[pick(5) as usize]),
                    _ => [Event::EmergencyStop, Event::Stop][pick(2) as usize],
                };
                (tick, event)
            })
            .collect();
        events.sort_by_key(|(tick, _)| *tick);
        let has_stored = pick(2) == 0;
        // One campaign in eight.
        let worn = (pick(8) == 0).then(|| {
            let from = 4 * pick(SECTOR as u64 / 2) as usize;
            (from, from + 4 * (1 + pick(64) as usize))
        });
        Self {
            seed,
            activity,
            events,
            has_stored,
            worn,
        }
    }

    fn bodies(&self) -> Vec<Body> {
        let on_x = |motion| {
            let mut motions = [Motion::Hold; 3];
            motions[0] = motion;
            vec![Body::SetPlan(Plan { motions }), Body::Run]
        };
        let injection = |open_loop| {
            vec![Body::Inject(InjectRequest::Open {
                axis: AxisName::X,
                open_loop,
                with_plan: false,
                limit_v: 1.0,
                travel_mm: 20.0,
                max_velocity_mm_s: 200.0,
            })]
        };
        match self.activity {
            Activity::Rest => vec![],
            Activity::Jog(velocity_mm_s) => vec![Body::Jog {
                axis: AxisName::X,
                velocity_mm_s: velocity_mm_s.into(),
            }],
            Activity::Sine => on_x(Motion::Harmonic(Harmonic {
                amplitude_mm: 5.0,
                frequency_hz: 1.0,
                phase_rad: 0.0,
                cycles: None,
                lead_s: 0.1,
            })),
            Activity::Move => on_x(Motion::PointToPoint(PointToPoint {
                distance_mm: 80.0,
                max_velocity_mm_s: 200.0,
                max_acceleration_mm_s2: 2000.0,
                max_jerk_mm_s3: 1e5,
            })),
            Activity::Home => vec![Body::Home([AxisName::X].into_iter().collect::<AxisSet>())],
            Activity::OpenLoop => injection(true),
            Activity::ClosedLoop => injection(false),
        }
    }

    fn has_load(&self) -> bool {
        let is_load = |(_, event): &(u32, Event)| matches!(event, Event::Load(_));
        self.events.iter().any(is_load)
    }

    /// True if nothing that the law sees shows that an encoder died at this speed: `docs/safety.md`, "Not found".
    fn is_unseen(&self, death: Death, speed_mm_s: f64) -> bool {
        let stops = |(_, event): &(u32, Event)| *event == Event::Stop;
        let goes_on = matches!(self.activity, Activity::Jog(_) | Activity::Home)
            && !self.events.iter().any(stops);
        match death {
            Death::Healthy => false,
            Death::Intermittent => true,
            Death::Reversed => self.activity == Activity::OpenLoop,
            _ if self.has_load() => true,
            // Counts of its own look like those of a slow motion.
            _ if FLICKERS.contains(&death) => {
                !goes_on && speed_mm_s.abs() < FLICKERING_TO_REST_MM_S
                    || speed_mm_s.abs() < FLICKERING_MM_S
                    || matches!(self.activity, Activity::OpenLoop | Activity::ClosedLoop)
            }
            _ => self.has_load() || !goes_on && speed_mm_s.abs() < COMING_TO_REST_MM_S,
        }
    }
}

/// The largest way, mm, that is not planned in an activity after an encoder died at this speed.
fn most_unplanned_mm(activity: Activity, death: Option<Death>, speed_mm_s: f64) -> f64 {
    // As fast as it is ordered, or slower while it speeds up.
    let speed_mm_s = match activity {
        Activity::Jog(ordered) => speed_mm_s.abs().min(ordered.abs().into()),
        _ => speed_mm_s.abs(),
    };
    match death {
        Some(death) if FLICKERS.contains(&death) => FLICKERING_UNPLANNED_MM,
        Some(_) if activity == Activity::ClosedLoop => INJECTED_UNPLANNED_MM,
        Some(_) if speed_mm_s < SLOWEST_MM_S => SLOWEST_UNPLANNED_MM,
        Some(_) if speed_mm_s < SLOW_MM_S => SLOW_UNPLANNED_MM,
        _ => UNPLANNED_MM,
    }
}

/// The invariants, watched tick by tick.
#[derive(Debug, Default)]
struct Watch {
    /// Somebody has asked to enable since the outputs were last off.
    asked: bool,
    /// The first fault, and the ticks for which it has not switched off.
    fault: Option<(u8, u32)>,
    /// The largest way that was not planned, mm, and the speed when the outputs went off, mm/s.
    unplanned_mm: f64,
    coasts_at: f64,
    off_at: Option<f64>,
    /// A load moves a disabled axis.
    loaded: bool,
}

impl Watch {
    fn look(&mut self, tasks: &Tasks, pressed: bool) -> Result<(), String> {
        let upper = tasks.upper.borrow();
        let (outputs, state) = (upper.outputs, upper.state());
        let words = outputs.codes.map(|code| code.0);
        if !outputs.enabled && words != [0; 3] {
            return Err(format!("off, and puts out {words:?}"));
        }
        if words
            .iter()
            .any(|word| word.unsigned_abs() > LARGEST_WORD as u16)
        {
            return Err(format!("puts out {words:?}"));
        }
        if outputs.enabled && !self.asked {
            return Err("enabled, and nobody has asked".into());
        }
        if outputs.enabled && pressed {
            return Err("enabled while the emergency stop is pressed".into());
        }
        if upper.driven_while_busy > 0 {
            return Err("enabled while flash is written".into());
        }
        match (state.safety(), &mut self.fault) {
            (SafetyState::Stopping(now) | SafetyState::Faulted(now), Some((first, _)))
                if now.code.number() != *first =>
            {
                return Err(format!("{first} became {}", now.code.name()));
            }
            (SafetyState::Stopping(now) | SafetyState::Faulted(now), None) => {
                self.fault = Some((now.code.number(), 0));
            }
            _ => {}
        }
        if let Some((first, ticks)) = &mut self.fault
            && outputs.enabled
        {
            *ticks += 1;
            if *ticks > STOP_TICKS {
                return Err(format!("enabled {ticks} ticks after fault {first}"));
            }
        }
        let x = upper.x.as_ref().expect("given");
        let reference = state.axes()[0].reference().to_mm(5e-4);
        if outputs.enabled {
            let open = state.axes()[0].mode() == quadrant_law::motion::MotionMode::OpenLoop;
            let planned = if open { x.plant.position_mm } else { reference };
            self.unplanned_mm = self.unplanned_mm.max((x.plant.position_mm - planned).abs());
            (self.coasts_at, self.off_at) = (x.plant.velocity_mm_s, Some(x.plant.position_mm));
        } else if let Some(at) = self.off_at
            && !self.loaded
        {
            let coasted = (x.plant.position_mm - at).abs();
            let may = self.coasts_at.abs() * COASTING_S + COASTING_MM;
            if coasted > may {
                return Err(format!("coasted {coasted:.2} mm, {may:.2} mm were due"));
            }
        }
        Ok(())
    }
}

/// Runs a campaign; returns what it came to.
///
/// # Errors
/// The invariant that did not hold.
fn run(campaign: &Campaign) -> Result<End, String> {
    let mut flash = restart::prepared(campaign.has_stored);
    flash.worn = campaign.worn.map(|(from, to)| from..to);
    let mut tasks = Tasks::with_flash(&StageSettings::simulated(), campaign.seed, flash, None);
    tasks.upper.borrow_mut().x = Some(Moved {
        plant: Plant::new(&MODEL),
        encoder: Encoder::new(Death::Healthy, campaign.seed),
        dead: None,
    });
    let mut watch = Watch {
        loaded: campaign.has_load(),
        ..Watch::default()
    };
    let (mut unseen, mut speed_mm_s, mut died) = (false, 0.0, None);
    let mut noise = Noise::new(campaign.seed ^ 0x5A5A);
    let (mut silent, mut pressed) = (false, false);
    let mut words = 0;
    let begin = tasks.tick();
    let mut events = campaign.events.iter().peekable();
    let mut stores = Vec::new();
    while tasks.tick() - begin < TICKS && !tasks.flash.borrow().is_off() {
        let at = tasks.tick() - begin;
        while let Some((_, event)) = events.next_if(|(tick, _)| *tick <= at) {
            match *event {
                Event::Dies(death) => {
                    let mut upper = tasks.upper.borrow_mut();
                    let x = upper.x.as_mut().expect("given");
                    // It dies once.
                    if x.dead.is_none() {
                        speed_mm_s = x.plant.velocity_mm_s;
                        died = Some(death);
                        unseen = campaign.is_unseen(death, speed_mm_s);
                        (x.encoder.death, x.dead) = (death, Some(0));
                    }
                }
                Event::Load(volts) => {
                    tasks
                        .upper
                        .borrow_mut()
                        .x
                        .as_mut()
                        .expect("given")
                        .plant
                        .load_v = volts;
                }
                Event::HostSilent => silent = true,
                Event::Garbage => {
                    let bytes: Vec<u8> = (0..64).map(|_| (noise.bits() >> 16) as u8).collect();
                    tasks.upper.borrow_mut().receive(&bytes);
                }
                Event::Settings => {
                    tasks.send(&[Body::Settings(SettingsRequest::Apply)]);
                }
                Event::Button(command) => {
                    watch.asked |= command == Command::Enable;
                    tasks.upper.borrow_mut().operate(command);
                }
                Event::Store => stores.push(tasks.send(&[restart::store()])),
                Event::PowerCut(operations, damage) => {
                    // In motion too: a machine that is moved by hand, or whose operator is quick.
                    stores.push(tasks.send(&[Body::Disable, restart::store()]) + 1);
                    let mut flash = tasks.flash.borrow_mut();
                    flash.cut = Some((flash.operations + operations, damage));
                }
                Event::EmergencyStop => {
                    tasks.upper.borrow_mut().inputs.switches = Switches::EMERGENCY_STOP;
                    pressed = true;
                }
                Event::Stop => {
                    tasks.send(&[Body::Stop]);
                }
            }
        }
        if at == 20 {
            watch.asked = true;
            tasks.send(&[Body::Enable]);
        } else if at == 120 {
            tasks.send(&campaign.bodies());
        } else if !silent && at % 1000 == 500 {
            tasks.send(&[Body::Status]);
        }
        let injects = matches!(campaign.activity, Activity::OpenLoop | Activity::ClosedLoop);
        if injects && !silent && at > 150 && at.is_multiple_of(20) {
            let values = Voltages::new((0..20).map(|place| {
                let turn = core::f64::consts::TAU * 20.0 * 1e-4 * f64::from(words + place);
                (0.8 * turn.sin() / 10.0 * DacCode::FULL_SCALE) as i16
            }));
            let sequence = words;
            words += 20;
            tasks.send(&[Body::Inject(InjectRequest::Values {
                sequence,
                values,
                last: false,
            })]);
        }
        tasks.step();
        watch.look(&tasks, pressed)?;
    }
    if watch.unplanned_mm > most_unplanned_mm(campaign.activity, died, speed_mm_s) && !unseen {
        return Err(format!(
            "{:.2} mm were not planned, dead at {speed_mm_s:.0} mm/s",
            watch.unplanned_mm
        ));
    }
    let acknowledged = stores
        .iter()
        .any(|id| tasks.answers.get(id) == Some(&Ok(Reply::Done)));
    let flash = tasks.flash.borrow().clone();
    let was_cut = flash.is_off();
    let before = restart::Before {
        has_stored: campaign.has_stored,
        is_worn: campaign.worn.is_some(),
        acknowledged,
    };
    restart::check(flash, &before, campaign.seed)?;
    Ok(End {
        unplanned_mm: watch.unplanned_mm,
        unseen,
        fault: watch.fault.map(|(code, _)| code),
        was_cut,
    })
}

/// The end of a campaign.
struct End {
    /// Largest way that was not planned, mm.
    unplanned_mm: f64,
    /// Nothing that the law sees shows that the encoder died.
    unseen: bool,
    /// The first fault's number.
    fault: Option<u8>,
    /// The supply failed while flash was written.
    was_cut: bool,
}

/// Result of a seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// The invariant that did not hold; empty if all did.
    pub broken: String,
    /// Largest way that the reference did not ask for until the outputs were off, mm.
    pub unplanned_mm: Option<f64>,
    /// Nothing that the law sees shows that the encoder died.
    pub unseen: Option<bool>,
    /// Number of the first fault.
    pub fault: Option<u8>,
    /// The supply failed while flash was written.
    pub was_cut: Option<bool>,
    /// Activity and events, for a person.
    pub campaign: String,
}

/// Runs the campaign of a seed.
pub fn judge(seed: u64) -> Line {
    let campaign = Campaign::draw(seed);
    let end = run(&campaign);
    let (end, broken) = match end {
        Ok(end) => (Some(end), String::new()),
        Err(why) => (None, why),
    };
    Line {
        broken,
        unplanned_mm: end.as_ref().map(|end| end.unplanned_mm),
        unseen: end.as_ref().map(|end| end.unseen),
        fault: end.as_ref().and_then(|end| end.fault),
        was_cut: end.as_ref().map(|end| end.was_cut),
        campaign: format!("{:?}: {:?}", campaign.activity, campaign.events),
    }
}
