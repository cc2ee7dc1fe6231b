//! The lean firmware's application: what a host loads into it, what it refuses, and that it then does what a machine with settings of
//! its own does.

use std::collections::VecDeque;

use quadrant::app::HostAxes;
use quadrant::command::Command;
use quadrant::hal::Serial;
use quadrant::link::frame::{self, FRAME_BYTES, Receiver};
use quadrant::link::message::{
    AxisSet, Body, LinkError, LoadHeader, LoadPart, LoadRequest, LoadStatus, Message, NumberType,
    Reply, Request, Response, SettingsRequest, Words,
};
use quadrant::lockstep::InputRecord;
use quadrant::reference::{HarmonicSettings, MotionSettings};
use quadrant::settings::{PlanSettings, StageSettings};
use quadrant::stage::Outputs;
use quadrant_sim::client::load::{self, BuiltPart, LoadError, build};
use quadrant_sim::client::{Client, ClientError, settings};
use quadrant_sim::machine::SimulatedLink;
use quadrant_sim::machine::application::{BoardIdentity, Running, Start};
use quadrant_sim::machine::memory_flash::MemoryFlash;
use quadrant_sim::plant::{SimulatedStage, StageParameters};

const RATE_HZ: u32 = 10_000;

fn client() -> Client {
    Client::open(SimulatedLink::start_lean(1)).expect("greets")
}

fn state(client: &mut Client) -> LoadStatus {
    let state = load::state(client).expect("answers");
    state.expect("a machine that is loaded")
}

fn parts(stage: &StageSettings, client: &mut Client) -> Vec<BuiltPart> {
    build(stage, &state(client)).expect("valid settings")
}

fn ask(client: &mut Client, request: LoadRequest) -> Result<LoadStatus, String> {
    match client.request(Body::Load(request)) {
        Ok(Reply::Load(status)) => Ok(status),
        Ok(other) => panic!("{other:?}"),
        Err(ClientError::Refused {
            source: LinkError::Refused(text) | LinkError::Invalid(text),
            ..
        }) => Err(text.as_str().to_owned()),
        Err(error) => panic!("{error}"),
    }
}

fn block(words: &[u32]) -> Words {
    let mut block = Words::new();
    assert!(block.extend(words.iter().copied()));
    block
}

fn send(client: &mut Client, part: &BuiltPart) -> Result<LoadStatus, String> {
    let mut answers = part.requests().map(|request| ask(client, request));
    let first = answers.next().expect("a head")?;
    answers.try_fold(first, |_, answer| answer)
}

/// The part with the CRC that belongs to it.
fn sealed(mut part: BuiltPart) -> BuiltPart {
    let mut checksum = part.header.checksum();
    checksum.update(part.words.iter().copied());
    part.header.crc = checksum.value();
    part
}

fn refusal(client: &mut Client, body: Body) -> String {
    match client.request(body) {
        Err(ClientError::Refused {
            source: LinkError::Refused(text),
            ..
        }) => text.as_str().to_owned(),
        other => panic!("not refused: {other:?}"),
    }
}

fn is_not_loaded(client: &mut Client) {
    let text = refusal(client, Body::Enable);
    assert!(text.contains("no axes are loaded"), "{text}");
    let inputs = client.inputs().expect("answers");
    let text = inputs.refusal.expect("the button would be refused, too");
    assert!(text.contains("no axes are loaded"), "{text}");
}

fn load_all(client: &mut Client, stage: &StageSettings) {
    let board = state(client);
    load::load(client, stage, &board, |_| {}).expect("loads");
}

#[test]
fn nothing_is_enabled_or_moved_before_axes_are_loaded() {
    let mut client = client();
    is_not_loaded(&mut client);
    for body in [
        Body::Run,
        Body::Home(AxisSet::ALL),
        Body::SetPlan(PlanSettings::default().into()),
        Body::Spindle { rpm: 100.0 },
    ] {
        let text = refusal(&mut client, body);
        assert!(text.contains("`quadrant connect load FILE`"), "{text}");
    }
    for request in [
        SettingsRequest::List { cursor: 0 },
        SettingsRequest::Apply,
        SettingsRequest::Store(Default::default()),
    ] {
        let text = refusal(&mut client, Body::Settings(request));
        assert!(text.contains("holds no settings"), "{text}");
    }
    client.order(Body::Stop).expect("stops");
    client.order(Body::Disable).expect("disables");
}

#[test]
fn a_loaded_machine_is_enabled_and_a_restarted_one_has_lost_its_axes() {
    let mut client = client();
    let mut shares = Vec::new();
    let board = state(&mut client);
    assert_eq!((board.set, board.axes), (None, AxisSet::NONE));
    let stage = StageSettings::simulated();
    let loaded = load::load(&mut client, &stage, &board, |share| shares.push(share));
    let loaded = loaded.expect("loads");
    assert!(
        shares.is_sorted() && shares.last() == Some(&1.0),
        "{shares:?}"
    );
    assert_eq!(state(&mut client).set, Some(loaded.set));
    assert_eq!(settings::dump(&mut client).expect("remembered"), stage);
    client.order(Body::Enable).expect("enables");
    client.order(Body::Disable).expect("disables");
    client.order(Body::Reboot).expect("restarts");
    client
        .wait(std::time::Duration::from_millis(50))
        .expect("waits");
    assert!(client.status().is_ok());
    is_not_loaded(&mut client);
    assert_eq!(state(&mut client).axes, AxisSet::NONE);
    assert!(
        settings::dump(&mut client).is_err(),
        "the machine has lost them"
    );
}

#[test]
fn parts_of_another_firmware_number_type_or_rate_are_refused() {
    let mut client = client();
    let parts = parts(&StageSettings::simulated(), &mut client);
    let good = parts[0].header;
    for (header, because) in [
        (
            LoadHeader {
                fingerprint: good.fingerprint ^ 1,
                ..good
            },
            "fingerprint",
        ),
        (
            LoadHeader {
                number: NumberType::Fixed,
                ..good
            },
            "number",
        ),
        (
            LoadHeader {
                rate_hz: 20_000,
                ..good
            },
            "this firmware runs at 10000",
        ),
    ] {
        let text = ask(&mut client, LoadRequest::Begin(header)).expect_err("refused");
        assert!(text.contains(because), "{text}");
        is_not_loaded(&mut client);
    }
    let board = state(&mut client);
    let mut stage = StageSettings::simulated();
    stage.rate_hz = 20_000.0;
    let error = build(&stage, &board).expect_err("refused");
    assert!(matches!(error, LoadError::Rate { .. }), "{error}");
    assert!(
        error
            .to_string()
            .contains("rate_hz = 20000: this board runs at 10000"),
        "{error}"
    );
    let other = LoadStatus {
        fingerprint: board.fingerprint ^ 1,
        ..board.clone()
    };
    let error = build(&StageSettings::simulated(), &other).expect_err("refused");
    assert!(matches!(error, LoadError::Fingerprint { .. }), "{error}");
    let mut stage = StageSettings::simulated();
    stage.axes[1].limits.max_velocity_mm_s = -1.0;
    let error = build(&stage, &board).expect_err("refused").to_string();
    assert!(error.contains("y.limits.max_velocity_mm_s"), "{error}");
}

#[test]
fn no_damaged_part_is_taken_whichever_word_it_is() {
    let mut client = client();
    let parts = parts(&StageSettings::simulated(), &mut client);
    for (number, part) in parts.iter().enumerate() {
        for place in (0..part.words.len()).step_by(if number == 1 { 97 } else { 331 }) {
            send(&mut client, &parts[0]).expect("the machine is good");
            let mut damaged = part.clone();
            damaged.words[place] ^= 1 << (place % 32);
            let refused = send(&mut client, &damaged).expect_err("refused");
            assert!(
                refused.contains("crc") || refused.contains("word"),
                "{refused}"
            );
            let refused = ask(
                &mut client,
                LoadRequest::Words {
                    offset: 0,
                    words: block(&[0]),
                },
            );
            assert!(refused.is_err(), "what was damaged goes on");
        }
    }
    is_not_loaded(&mut client);
    // The CRC of the head is of the part alone.
    let mut other = parts[1].clone();
    other.header.part = parts[2].header.part;
    send(&mut client, &parts[0]).expect("the machine is good");
    assert!(send(&mut client, &other).is_err(), "x was taken for y");
    is_not_loaded(&mut client);
    load_all(&mut client, &StageSettings::simulated());
    client.order(Body::Enable).expect("enables");
}

#[test]
fn a_right_crc_does_not_make_words_right() {
    let mut client = client();
    let parts = parts(&StageSettings::simulated(), &mut client);
    let [machine, x, ..] = &parts[..] else {
        panic!("{}", parts.len());
    };
    // The number of a rule of operation.
    let mut unknown = machine.clone();
    unknown.words[0] = 99;
    let text = send(&mut client, &sealed(unknown)).expect_err("refused");
    assert!(text.contains("word 0 names no variant"), "{text}");
    send(&mut client, machine).expect("good");
    let mut short = x.clone();
    short.words.pop();
    short.header.words -= 1;
    let text = send(&mut client, &sealed(short)).expect_err("refused");
    assert!(text.contains("words"), "{text}");
    let mut long = x.clone();
    long.words.push(0);
    long.header.words += 1;
    let text = send(&mut client, &sealed(long)).expect_err("refused");
    assert!(text.contains("words"), "{text}");
    is_not_loaded(&mut client);
}

#[test]
fn words_that_are_missing_are_asked_for_and_words_that_are_known_passed_over() {
    let mut client = client();
    let parts = parts(&StageSettings::simulated(), &mut client);
    let words = |offset: usize, count: usize| LoadRequest::Words {
        offset: offset as u16,
        words: block(&parts[1].words[offset..offset + count]),
    };
    assert!(
        ask(&mut client, words(0, 10)).is_err(),
        "no part is under way"
    );
    send(&mut client, &parts[0]).expect("good");
    ask(&mut client, LoadRequest::Begin(parts[1].header)).expect("begins");
    assert_eq!(ask(&mut client, words(0, 10)).expect("takes").received, 10);
    let text = ask(&mut client, words(20, 10)).expect_err("a gap");
    assert!(text.contains("the words from 10 on are missing"), "{text}");
    assert_eq!(ask(&mut client, words(0, 10)).expect("known").received, 10);
    assert_eq!(ask(&mut client, words(5, 15)).expect("takes").received, 20);
    // Repeated beyond the end of the part: nothing comes of it.
    for part in &parts[1..] {
        send(&mut client, part).expect("good");
        let end = part.words.len() - 5;
        let last = LoadRequest::Words {
            offset: end as u16,
            words: block(&part.words[end..]),
        };
        assert_eq!(
            ask(&mut client, last).expect("known").received,
            part.header.words
        );
    }
    client
        .wait(std::time::Duration::from_millis(20))
        .expect("waits");
    client.order(Body::Enable).expect("enables");
}

#[test]
fn a_set_is_loaded_whole_or_nothing_is_enabled() {
    let mut client = client();
    let first = StageSettings::simulated();
    load_all(&mut client, &first);
    let mut other = first.clone();
    for axis in &mut other.axes {
        axis.feedback.pid.kp_v_per_mm *= 0.9;
    }
    let parts = parts(&other, &mut client);
    // An axis without its machine, and one of another set.
    assert!(send(&mut client, &parts[1]).is_err(), "another set");
    client
        .order(Body::Enable)
        .expect("the first set is in force");
    client.order(Body::Disable).expect("disables");
    send(&mut client, &parts[0]).expect("begins");
    is_not_loaded(&mut client);
    for part in &parts[1..3] {
        send(&mut client, part).expect("takes");
        is_not_loaded(&mut client);
    }
    send(&mut client, &parts[3]).expect("takes");
    client
        .wait(std::time::Duration::from_millis(20))
        .expect("waits");
    assert_eq!(state(&mut client).axes, AxisSet::ALL);
    client.order(Body::Enable).expect("enables");
}

#[test]
fn nothing_is_loaded_while_the_outputs_are_on() {
    let mut client = client();
    load_all(&mut client, &StageSettings::simulated());
    client.order(Body::Enable).expect("enables");
    let parts = parts(&StageSettings::simulated(), &mut client);
    let text = send(&mut client, &parts[0]).expect_err("refused");
    assert!(
        text.contains("the outputs are on; disable them first"),
        "{text}"
    );
    for part in &parts[1..] {
        assert!(
            send(&mut client, part).is_err(),
            "taken while the outputs are on"
        );
    }
    assert!(client.status().expect("answers").state.drives());
    client.order(Body::Disable).expect("disables");
    client
        .wait(std::time::Duration::from_millis(20))
        .expect("waits");
    load_all(&mut client, &StageSettings::simulated());
}

#[test]
fn an_encoder_changes_only_with_a_restart() {
    let mut client = client();
    load_all(&mut client, &StageSettings::simulated());
    let mut other = StageSettings::simulated();
    other.axes[2].encoder.resolution_mm *= 2.0;
    let board = state(&mut client);
    let error = load::load(&mut client, &other, &board, |_| {}).expect_err("refused");
    assert!(
        error
            .to_string()
            .contains("z.encoder changes only with a restart"),
        "{error}"
    );
    is_not_loaded(&mut client);
    load_all(&mut client, &StageSettings::simulated());
    client.order(Body::Enable).expect("enables");
}

/// A line that carries whatever is sent.
#[derive(Default)]
struct Line {
    to_machine: VecDeque<u8>,
    to_host: Vec<u8>,
}

impl Serial for Line {
    fn read(&mut self, into: &mut [u8]) -> usize {
        let count = into.len().min(self.to_machine.len());
        for (place, byte) in into.iter_mut().zip(self.to_machine.drain(..count)) {
            *place = byte;
        }
        count
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        self.to_host.extend(bytes);
        bytes.len()
    }
}

impl Line {
    fn send(&mut self, body: Body) {
        let mut buffer = [0; FRAME_BYTES];
        let request = Request { id: 1, body };
        let bytes = frame::encode(&request, &mut buffer).expect("fits");
        self.to_machine.extend(bytes.iter());
    }
}

impl Line {
    /// The answers that refuse for a reason.
    fn refusals(&self, because: &str) -> usize {
        let mut receiver = Receiver::new();
        let mut refused = 0;
        for &byte in &self.to_host {
            let Some(payload) = receiver.push(byte) else {
                continue;
            };
            if let Ok(Message::Response(Response {
                result: Err(LinkError::Refused(text)),
                ..
            })) = frame::decode(payload)
            {
                refused += usize::from(text.contains(because));
            }
        }
        refused
    }
}

const IDENTITY: BoardIdentity = BoardIdentity {
    board: "lean",
    cycle_hz: 0,
    number: NumberType::F32,
};

/// A lean machine on a stage of its own.
struct Lean {
    running: Running<f32, HostAxes>,
    plant: SimulatedStage,
    line: Line,
}

impl Lean {
    fn new() -> Self {
        let mut lean = Self {
            running: Running::start_unloaded(IDENTITY, RATE_HZ, None),
            plant: SimulatedStage::new(&StageParameters::real(), RATE_HZ.into(), 1),
            line: Line::default(),
        };
        lean.line.send(Body::Hello);
        lean
    }

    fn tick(&mut self, request: Option<Command>) -> Outputs {
        let input = InputRecord {
            request,
            ..self.plant.read_inputs(None)
        };
        let (outputs, _) = self.running.tick(&input, &mut self.line);
        self.plant.step(&outputs);
        outputs
    }

    fn load(&mut self, stage: &StageSettings) {
        for part in parts_here(stage) {
            for request in part.requests() {
                self.line.send(Body::Load(request));
                // No faster than a host that waits for its answers.
                for _ in 0..60 {
                    self.tick(None);
                }
            }
        }
    }
}

/// The parts for a machine of this process.
fn parts_here(stage: &StageSettings) -> Vec<BuiltPart> {
    let board = LoadStatus {
        fingerprint: quadrant::app::fingerprint::<f32>(),
        number: NumberType::F32,
        rate_hz: RATE_HZ,
        part: None,
        received: 0,
        set: None,
        axes: AxisSet::NONE,
    };
    build(stage, &board).expect("valid settings")
}

#[test]
fn the_button_enables_nothing_before_axes_are_loaded() {
    let mut lean = Lean::new();
    for tick in 0..2_000 {
        let request = (tick % 50 == 0).then_some(Command::Enable);
        assert!(!lean.tick(request).enabled, "tick {tick}");
    }
    lean.load(&StageSettings::simulated());
    let enabled = (0..100).any(|tick| lean.tick((tick == 0).then_some(Command::Enable)).enabled);
    assert!(enabled, "loaded, and not enabled");
}

/// Somebody presses the button in any tick around the beginning of a set: either the outputs go on and the set is refused, or they
/// stay off until all of it is there.
#[test]
fn a_button_that_is_pressed_as_a_set_begins_never_drives_half_of_it() {
    let stage = StageSettings::simulated();
    let (mut began, mut refused) = (0, 0);
    for pressed in 0..60 {
        let mut lean = Lean::new();
        lean.load(&stage);
        for _ in 0..100 {
            lean.tick(None);
        }
        let machine = &parts_here(&stage)[0];
        lean.line.to_host.clear();
        lean.line
            .send(Body::Load(LoadRequest::Begin(machine.header)));
        let mut on = 0;
        for tick in 0..300 {
            on += u32::from(
                lean.tick((tick == pressed).then_some(Command::Enable))
                    .enabled,
            );
        }
        if lean.line.refusals("the outputs are on") == 0 {
            assert_eq!(on, 0, "the outputs were on: pressed in tick {pressed}");
            began += 1;
        } else {
            assert!(lean.tick(None).enabled, "pressed in tick {pressed}");
            refused += 1;
        }
    }
    assert!(
        began > 0 && refused > 0,
        "{began} began, {refused} were refused"
    );
}

/// The same job on a machine with these settings of its own, and on one into which their axes were loaded.
#[test]
fn every_word_is_that_of_a_machine_with_settings_of_its_own() {
    let stage = StageSettings::simulated();
    let start = Start {
        defaults: &stage,
        plan: &PlanSettings::default(),
        fault: None,
        identity: IDENTITY,
    };
    let mut own = Running::<f32>::start(start, MemoryFlash::default()).expect("valid");
    let mut plant = SimulatedStage::new(&StageParameters::real(), RATE_HZ.into(), 1);
    let mut line = Line::default();
    line.send(Body::Hello);
    let mut lean = Lean::new();
    lean.load(&stage);
    while lean.running.state().tick() % 1_000 != 0 {
        lean.tick(None);
    }
    while own.state().tick() < lean.running.state().tick() {
        let (outputs, _) = own.tick(&plant.read_inputs(None), &mut line);
        plant.step(&outputs);
    }
    let sine = HarmonicSettings {
        cycles: Some(3.0),
        ..HarmonicSettings::with_velocity(2.0, 20.0, 1.0, 0.1)
    };
    let plan = PlanSettings {
        motions: [MotionSettings::Harmonic(sine); 3],
    };
    let mut moved = 0;
    for tick in 0..30_000 {
        let body = match tick {
            0 => Some(Body::SetPlan(plan.into())),
            200 => Some(Body::Enable),
            400 => Some(Body::Run),
            _ if tick % 1_000 == 500 => Some(Body::Status),
            _ => None,
        };
        if let Some(body) = body {
            line.send(body.clone());
            lean.line.send(body);
        }
        let (expected, _) = own.tick(&plant.read_inputs(None), &mut line);
        plant.step(&expected);
        assert_eq!(lean.tick(None), expected, "tick {tick}");
        moved += u32::from(expected.codes[0].0 != 0);
    }
    assert!(moved > 20_000, "it moved in {moved} ticks");
}

#[test]
fn the_machine_is_the_first_part() {
    let parts = parts_here(&StageSettings::simulated());
    assert_eq!(parts.len(), 4);
    assert_eq!(parts[0].header.part, LoadPart::Machine);
    // What a part is made of fits the link's numbers, and the board's memory of it.
    assert!(parts.iter().all(|part| part.words.len() < 2_000));
}
