//! The converter's driver against a chip at the pins: a timer, DMA that is late, an SPI, and an AD5754R that checks every time.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as Level};
use quadrant::drivers::ad5754r::steps::{
    BYTE_AT, FRAME_STEPS, FRAMES_AT, Hardware, MAX_STEPS, PIN_CHANGES, PINS_AT, PinChange,
};
use quadrant::drivers::ad5754r::{ALL_ZERO, Ad5754r, Error, Item, Sequencer};

#[path = "../../src/board/nucleo_f446re/bus_times.rs"]
mod nucleo_f446re;
#[path = "../../src/board/nucleo_h743zi2/bus_times.rs"]
mod nucleo_h743zi2;

/// Times of a board's bus.
#[derive(Clone, Copy)]
struct Times {
    timer_hz: u32,
    writing: Hardware,
    reading: Hardware,
}

const REFERENCE: Times = Times {
    timer_hz: nucleo_f446re::TIMER_HZ,
    writing: nucleo_f446re::WRITING,
    reading: nucleo_f446re::READING,
};

/// Those of both boards.
const BOARDS: [Times; 2] = [
    REFERENCE,
    Times {
        timer_hz: nucleo_h743zi2::TIMER_HZ,
        writing: nucleo_h743zi2::WRITING,
        reading: nucleo_h743zi2::READING,
    },
];

impl Times {
    /// Nanoseconds of a number of cycles.
    fn ns(self, cycles: u64) -> f64 {
        cycles as f64 * 1e9 / f64::from(self.timer_hz)
    }
}

/// A frame that ended, and the cycle at which it did.
type Frame = (u64, [u8; 3]);

/// The chip: what it sees at its pins, and what it rejects.
struct Chip {
    times: Times,
    selected: bool,
    sync_changed: u64,
    load_fell: Option<u64>,
    /// The last falling edge of the clock.
    edge: u64,
    bits: Vec<bool>,
    /// Word that SDO shifts out in the frame that goes on.
    answer: [u8; 3],
    /// Register that the next frame answers with.
    question: Option<u8>,
    frames: Vec<Frame>,
    loads: Vec<u64>,
    inputs: [u16; 3],
    codes: [u16; 3],
    power: u16,
    range: u16,
    rejected: Vec<String>,
    /// It receives nothing and answers ones.
    is_missing: bool,
    /// Bits of an answer that are wrong, by the register asked for.
    wrong: Option<(u8, u16)>,
}

impl Chip {
    fn new(times: Times) -> Self {
        Self {
            times,
            selected: false,
            sync_changed: 0,
            load_fell: None,
            edge: 0,
            bits: Vec::new(),
            answer: [0xFF; 3],
            question: None,
            frames: Vec::new(),
            loads: Vec::new(),
            inputs: [0; 3],
            codes: [0; 3],
            power: 0,
            range: 0,
            rejected: Vec::new(),
            is_missing: false,
            wrong: None,
        }
    }

    fn at_least(&mut self, what: &str, cycles: u64, least_ns: f64) {
        let ns = self.times.ns(cycles);
        if ns < least_ns {
            let words = format!("{what}: {ns:.0} ns instead of {least_ns}");
            self.rejected.push(words);
        }
    }

    fn pins(&mut self, now: u64, change: PinChange) {
        match change {
            PinChange::Keep => {}
            PinChange::Select => self.select(now),
            PinChange::Release => self.release(now),
            PinChange::Load => {
                self.at_least("/SYNC to /LDAC", now - self.sync_changed, 130.0);
                assert!(!self.selected, "/LDAC falls in a frame");
                self.load_fell = Some(now);
                self.loads.push(now);
                if !self.is_missing {
                    self.codes = self.inputs;
                }
            }
            PinChange::EndLoad => {
                let fell = self.load_fell.take().expect("/LDAC is low");
                self.at_least("/LDAC low", now - fell, 20.0);
            }
        }
    }

    fn select(&mut self, now: u64) {
        assert!(!self.selected, "/SYNC falls twice");
        let least = if self.question.is_some() {
            200.0
        } else {
            100.0
        };
        self.at_least("/SYNC high", now - self.sync_changed, least);
        (self.selected, self.sync_changed) = (true, now);
        self.bits.clear();
        let question = self.question.take();
        let flipped = match self.wrong {
            Some((address, bits)) if question == Some(address) => bits,
            _ => 0,
        };
        let register = match question {
            _ if self.is_missing => 0xFFFF,
            Some(address @ 0..=2) => self.codes[usize::from(address)],
            Some(0x08) => self.range,
            Some(0x10) => self.power,
            _ => 0,
        } ^ flipped;
        let [high, low] = register.to_be_bytes();
        self.answer = [if self.is_missing { 0xFF } else { 0 }, high, low];
    }

    fn release(&mut self, now: u64) {
        assert!(self.selected, "/SYNC rises twice");
        self.at_least("clock to /SYNC", now - self.edge, 13.0);
        (self.selected, self.sync_changed) = (false, now);
        if self.bits.len() != 24 {
            let words = format!("a frame of {} bits", self.bits.len());
            self.rejected.push(words);
            return;
        }
        let mut frame = [0; 3];
        for (byte, bits) in frame.iter_mut().zip(self.bits.chunks(8)) {
            *byte = bits.iter().fold(0, |byte, bit| byte << 1 | u8::from(*bit));
        }
        self.frames.push((now, frame));
        let [address, high, low] = frame;
        let data = u16::from_be_bytes([high, low]);
        match address {
            _ if self.is_missing => {}
            0..=2 => self.inputs[usize::from(address)] = data,
            0x04 => self.inputs = [data; 3],
            0x0C => self.range = data,
            0x10 => self.power = data,
            asked if asked & 0x80 != 0 => self.question = Some(asked & 0x7F),
            _ => {}
        }
    }

    /// A byte on the bus, the first bit from `begin` on; returns what SDO holds when the master samples it.
    fn byte(&mut self, begin: u64, byte: u8, bit_cycles: u64) -> u8 {
        let mut received = 0;
        for bit in 0..8 {
            let (rise, fall) = (
                begin + bit * bit_cycles,
                begin + bit * bit_cycles + bit_cycles / 2,
            );
            if self.selected {
                if self.bits.is_empty() {
                    self.at_least("/SYNC to clock", fall - self.sync_changed, 13.0);
                }
                let place = self.bits.len();
                self.bits.push(byte >> (7 - bit) & 1 == 1);
                // SDO follows the rising edge after 40 ns; before that it is anything, here the other level.
                let valid = self.times.ns(fall - rise) > 40.0;
                let level = self
                    .answer
                    .get(place / 8)
                    .is_some_and(|byte| byte >> (7 - place % 8) & 1 == 1);
                received = received << 1 | u8::from(level == valid);
            } else {
                // Nobody drives SDO: the pull-up does.
                received = received << 1 | 1;
            }
            self.edge = fall;
        }
        received
    }
}

/// The board's timer, DMA and SPI, and the time.
struct Model {
    now: u64,
    chip: Chip,
    /// The cycle at which what was started ends.
    end: u64,
    received: Vec<u8>,
    /// Delay of each write in turn.
    delays: Box<dyn FnMut() -> u64>,
    /// Cycles by which a step is shorter than it should be.
    hurry: u32,
    /// The bus does nothing.
    is_dead: bool,
    /// Cycles that `finish` has waited.
    waited: u64,
}

#[derive(Clone)]
struct Bus(Rc<RefCell<Model>>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Stuck;

impl Model {
    fn write(&mut self, bytes: &[u8]) {
        self.run(bytes, self.chip.times.writing);
    }

    fn read(&mut self, bytes: &[u8]) {
        self.run(bytes, self.chip.times.reading);
    }

    /// Takes all steps of a sequence that begins now.
    fn run(&mut self, bytes: &[u8], hardware: Hardware) {
        assert!(self.end <= self.now, "the timer was still counting");
        self.received.clear();
        if self.is_dead {
            self.end = u64::MAX;
            return;
        }
        let step = u64::from(hardware.step_cycles() - self.hurry);
        let begin = self.now;
        // One controller makes all writes, one after the other, each some cycles long.
        let mut free = 0;
        let mut write = |due: u64, delay: u64| {
            free = (due + delay).max(free + 4);
            free
        };
        let mut spi_free = 0;
        for (index, (change, byte)) in (0..).zip(PIN_CHANGES.into_iter().zip(bytes)) {
            let delay = (self.delays)();
            let at = write(begin + index * step + u64::from(PINS_AT), delay);
            self.chip.pins(at, change);
            let delay = (self.delays)();
            let at = write(begin + index * step + u64::from(BYTE_AT), delay);
            // It starts at once or as late as it may; both with the delay.
            let start = u64::from(hardware.start_cycles) * delay / u64::from(hardware.late_cycles);
            assert!(at >= spi_free, "a byte is written over");
            let bit = u64::from(hardware.bit_cycles);
            let received = self.chip.byte(at + start, *byte, bit);
            spi_free = at + start + 8 * bit;
            self.received.push(received);
        }
        self.end = begin + bytes.len() as u64 * step;
    }
}

impl Sequencer for Bus {
    type Error = Stuck;

    fn start_writing(&mut self, frames: [[u8; 3]; 4]) {
        let mut bytes = [0; MAX_STEPS];
        for (at, frame) in FRAMES_AT.into_iter().zip(frames) {
            bytes[at..at + 3].copy_from_slice(&frame);
        }
        self.0.borrow_mut().write(&bytes);
    }

    fn start_reading(&mut self, [first, second, third]: [u8; 3]) {
        let bytes: [u8; FRAME_STEPS] = [first, second, third, 0];
        self.0.borrow_mut().read(&bytes);
    }

    fn finish(&mut self) -> Result<[u8; 3], Stuck> {
        let mut model = self.0.borrow_mut();
        if model.end == u64::MAX {
            model.end = model.now;
            return Err(Stuck);
        }
        model.waited += model.end.saturating_sub(model.now);
        model.now = model.now.max(model.end);
        Ok([model.received[0], model.received[1], model.received[2]])
    }
}

type Converter = Ad5754r<Bus, Pin, NoopDelay>;

/// A converter at its chip.
struct Bench {
    converter: Converter,
    model: Rc<RefCell<Model>>,
    clear: Pin,
}

/// Control period at 10 kHz, in cycles.
const PERIOD: u64 = 18_000;
/// Cycles between the beginning of a tick and its write.
const COMPUTING: u64 = 5_000;

type Outcome = Result<(), Error<Stuck>>;

impl Bench {
    /// A converter of the reference board whose /CLR will take these levels, and whose writes are delayed.
    fn new(clear: &[State], delays: impl FnMut() -> u64 + 'static) -> Self {
        Self::on(REFERENCE, clear, delays)
    }

    /// One of any board.
    fn on(times: Times, clear: &[State], delays: impl FnMut() -> u64 + 'static) -> Self {
        let model = Rc::new(RefCell::new(Model {
            now: PERIOD,
            chip: Chip::new(times),
            end: 0,
            received: Vec::new(),
            delays: Box::new(delays),
            hurry: 0,
            is_dead: false,
            waited: 0,
        }));
        let levels: Vec<_> = clear.iter().map(|level| Level::set(*level)).collect();
        let clear = Pin::new(&levels);
        let bus = Bus(model.clone());
        Self {
            converter: Ad5754r::new(bus, clear.clone(), NoopDelay::new()),
            model,
            clear,
        }
    }

    /// One that has been started, with further levels of /CLR.
    fn started(clear: &[State], delays: impl FnMut() -> u64 + 'static) -> Self {
        Self::started_on(REFERENCE, clear, delays)
    }

    /// The same on any board.
    fn started_on(times: Times, clear: &[State], delays: impl FnMut() -> u64 + 'static) -> Self {
        let mut levels = vec![State::Low, State::High];
        levels.extend(clear);
        let mut bench = Self::on(times, &levels, delays);
        assert_eq!(bench.converter.start(), Ok(()));
        bench.pass(PERIOD);
        bench.chip(|chip| chip.frames.clear());
        bench
    }

    fn chip<T>(&self, look: impl FnOnce(&mut Chip) -> T) -> T {
        look(&mut self.model.borrow_mut().chip)
    }

    fn pass(&mut self, cycles: u64) {
        self.model.borrow_mut().now += cycles;
    }

    /// A tick that computes for some cycles; the outcome, with the time from its write until /LDAC fell.
    fn tick_after(&mut self, codes: [i16; 3], computing: u64) -> Outcome {
        let begun = self.converter.begin();
        self.pass(computing);
        let written = self.converter.write(codes);
        assert!(begun.is_ok() || written == begun, "both report a dead bus");
        written
    }

    fn tick(&mut self, codes: [i16; 3]) -> Outcome {
        let written = self.tick_after(codes, COMPUTING);
        self.pass(PERIOD - COMPUTING);
        written
    }

    /// Ends it: nothing was rejected, and /CLR took all its levels.
    fn done(mut self) {
        assert_eq!(
            self.chip(|chip| chip.rejected.clone()),
            Vec::<String>::new()
        );
        self.clear.done();
    }
}

/// Delays from zero to the largest, differently in each run.
fn random(times: Times, seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state % (u64::from(times.writing.late_cycles) + 1)
    }
}

/// Either none or the largest delay.
fn extreme(times: Times, seed: u64) -> impl FnMut() -> u64 {
    let mut random = random(times, seed);
    move || (random() & 1) * u64::from(times.writing.late_cycles)
}

fn none() -> u64 {
    0
}

#[test]
fn powers_up_in_the_bipolar_range_at_zero_and_then_lets_go_of_clear() {
    let mut bench = Bench::new(&[State::Low, State::High], none);
    assert_eq!(bench.converter.start(), Ok(()));
    let frames: Vec<_> = bench.chip(|chip| chip.frames.iter().map(|frame| frame.1).collect());
    assert_eq!(
        frames[..4],
        [[0x0C, 0, 4], [0x19, 0, 0x0C], ALL_ZERO, [0x10, 0, 0x1F]]
    );
    assert_eq!(bench.chip(|chip| (chip.range, chip.power)), (4, 0x1F));
    bench.done();
}

#[test]
fn is_held_at_zero_volts_until_it_is_started() {
    Bench::new(&[State::Low], none).done();
}

#[test]
fn a_chip_that_is_not_there_stays_cleared_and_is_reported() {
    let mut bench = Bench::new(&[State::Low], none);
    bench.chip(|chip| chip.is_missing = true);
    let error = Error::Mismatch {
        item: Item::Range,
        expected: 4,
        answered: 0xFFFF,
    };
    assert_eq!(bench.converter.start(), Err(error));
    bench.done();
}

#[test]
fn a_bus_that_is_dead_at_the_start_stays_cleared_and_is_reported() {
    let mut bench = Bench::new(&[State::Low], none);
    bench.model.borrow_mut().is_dead = true;
    assert_eq!(bench.converter.start(), Err(Error::Bus(Stuck)));
    bench.done();
}

#[test]
fn a_chip_that_does_not_power_up_is_reported() {
    let mut bench = Bench::new(&[State::Low], none);
    bench.chip(|chip| chip.wrong = Some((0x10, 0x10)));
    let error = Error::Mismatch {
        item: Item::Power,
        expected: 0x1F,
        answered: 0x0F,
    };
    assert_eq!(bench.converter.start(), Err(error));
    bench.done();
}

#[test]
fn three_codes_take_effect_together_in_every_tick_and_one_register_is_read_after_the_other() {
    let mut bench = Bench::started(&[], none);
    let codes = [
        [1, -1, 0x1234],
        [i16::MIN, i16::MAX, 0],
        [-2, 3, -4],
        [5, 6, 7],
        [8, 9, 10],
    ];
    let questions = [0x81, 0x82, 0x90, 0x80, 0x81];
    for (codes, question) in codes.into_iter().zip(questions) {
        bench.chip(|chip| {
            chip.frames.clear();
            chip.loads.clear();
        });
        assert_eq!(bench.tick(codes), Ok(()), "{codes:?}");
        let [a, b, c] = codes.map(i16::to_be_bytes);
        let expected = [
            [0x18, 0, 0],
            [0, a[0], a[1]],
            [1, b[0], b[1]],
            [2, c[0], c[1]],
            [question, 0, 0],
        ];
        bench.chip(|chip| {
            let frames: Vec<_> = chip.frames.iter().map(|frame| frame.1).collect();
            assert_eq!(frames, expected);
            assert_eq!(chip.codes, codes.map(i16::cast_unsigned));
            let [load] = chip.loads[..] else {
                panic!("one /LDAC a tick, not {:?}", chip.loads);
            };
            assert!(chip.frames[3].0 < load && load < chip.frames[4].0);
        });
    }
    bench.done();
}

#[test]
fn the_chip_minds_no_time_however_late_dma_is() {
    for (times, seed) in BOARDS
        .into_iter()
        .flat_map(|times| (1..200).map(move |seed| (times, seed)))
    {
        for extremely in [false, true] {
            let delays: Box<dyn FnMut() -> u64> = if extremely {
                Box::new(extreme(times, seed))
            } else {
                Box::new(random(times, seed))
            };
            let mut bench = Bench::started_on(times, &[], delays);
            for tick in 0..12 {
                let code = (seed as i16).wrapping_mul(7919).wrapping_add(tick);
                assert_eq!(bench.tick([code, -code, !code]), Ok(()), "seed {seed}");
            }
            bench.done();
        }
    }
}

#[test]
fn a_step_that_is_shorter_by_more_than_half_a_bit_is_minded() {
    for times in BOARDS {
        let mut bench = Bench::started_on(times, &[], extreme(times, 3));
        bench.model.borrow_mut().hurry = times.writing.bit_cycles / 2 + 1;
        for tick in 0..200 {
            let _ = bench.tick_after([tick; 3], COMPUTING);
            bench.pass(PERIOD);
        }
        let rejected = bench.chip(|chip| std::mem::take(&mut chip.rejected));
        assert!(
            rejected
                .iter()
                .any(|words| words.starts_with("clock to /SYNC")),
            "{rejected:?}"
        );
        bench.done();
    }
}

#[test]
fn the_codes_are_out_before_a_write_with_waits_had_them_out_and_nobody_waits() {
    for times in BOARDS {
        let mut bench = Bench::started_on(times, &[], extreme(times, 5));
        bench.model.borrow_mut().waited = 0;
        let mut latest = 0;
        for tick in 0..100 {
            let begun = bench.model.borrow().now;
            assert_eq!(bench.tick([tick, 0, 0]), Ok(()));
            let loaded = bench.chip(|chip| *chip.loads.last().unwrap());
            latest = latest.max(loaded - begun - COMPUTING);
        }
        let latest = times.ns(latest);
        println!("write to /LDAC: at most {latest:.0} ns");
        assert!(latest <= f64::from(times.writing.load_ns()));
        // What three fast frames, a slow one and the waits between them took before /LDAC, bus and pins alone.
        assert!(times.writing.load_ns() < 8_135);
        assert_eq!(bench.model.borrow().waited, 0);
        bench.done();
    }
}

#[test]
fn a_tick_that_follows_the_one_before_at_once_waits_for_its_end_and_loses_nothing() {
    let mut bench = Bench::started(&[], random(REFERENCE, 9));
    for tick in 0..40 {
        // Overrun: the next tick begins with the write of this one under way, and its own reading is not over when it writes.
        let codes = [tick, 2 * tick, -tick];
        assert_eq!(bench.tick_after(codes, 300), Ok(()), "tick {tick}");
        bench.pass(500);
    }
    bench.pass(PERIOD);
    assert_eq!(bench.chip(|chip| chip.frames.len()), 40 * 5);
    let codes = [39, 78, -39].map(i16::cast_unsigned);
    assert_eq!(bench.chip(|chip| chip.codes), codes);
    let waited = bench.model.borrow().waited;
    let (writing, reading) = (
        REFERENCE.writing.step_cycles() * MAX_STEPS as u32,
        REFERENCE.reading.step_cycles() * FRAME_STEPS as u32,
    );
    assert!(waited > 0 && waited <= 41 * u64::from(writing + reading));
    bench.done();
}

#[test]
fn a_tick_that_is_late_loses_nothing() {
    let mut bench = Bench::started(&[], random(REFERENCE, 11));
    for tick in 0..20 {
        assert_eq!(bench.tick([tick, 1, 2]), Ok(()));
        bench.pass(u64::from(tick as u16) * 10 * PERIOD);
    }
    assert_eq!(bench.chip(|chip| chip.frames.len()), 20 * 5);
    bench.done();
}

#[test]
fn every_wrong_bit_of_every_register_is_reported_and_the_codes_are_written_all_the_same() {
    // Bits 6 and 11..15 of the power register mean nothing.
    let registers = [
        (0x00, Item::Code(0), 100_u16, u16::MAX),
        (0x01, Item::Code(1), 200, u16::MAX),
        (0x02, Item::Code(2), 300, u16::MAX),
        (0x10, Item::Power, 0x1F, 0x07BF),
    ];
    let codes = [100, 200, 300];
    for (address, item, expected, bits) in registers {
        for bit in 0..16 {
            let rejects = bits >> bit & 1 == 1;
            let levels: &[State] = if rejects { &[State::Low] } else { &[] };
            let mut bench = Bench::started(levels, none);
            for _ in 0..4 {
                assert_eq!(bench.tick(codes), Ok(()));
            }
            bench.chip(|chip| chip.wrong = Some((address, 1 << bit)));
            let found: Vec<_> = (0..4).map(|_| bench.tick(codes)).collect();
            let error = Error::Mismatch {
                item,
                expected,
                answered: expected ^ 1 << bit,
            };
            let reported = found.iter().filter(|found| **found == Err(error)).count();
            assert_eq!(reported > 0, rejects, "bit {bit} of {item:?}: {found:?}");
            assert_eq!(bench.chip(|chip| chip.codes), [100, 200, 300]);
            bench.done();
        }
    }
}

#[test]
fn a_chip_that_lost_its_supply_is_reported_by_every_write_until_it_is_powered_up() {
    let mut bench = Bench::started(&[State::Low, State::High], none);
    bench.chip(|chip| chip.power = 0);
    let off = Err(Error::Mismatch {
        item: Item::Power,
        expected: 0x1F,
        answered: 0,
    });
    let mut found: Vec<_> = (0..8).map(|_| bench.tick([0; 3])).collect();
    bench.chip(|chip| chip.power = 0x1F);
    found.extend((0..4).map(|_| bench.tick([0; 3])));
    assert_eq!(found[..3], [Ok(()); 3]);
    assert_eq!(
        found[3..11],
        [off; 8],
        "the codes read right, the chip is off"
    );
    assert_eq!(found[11], Ok(()));
    bench.done();
}

#[test]
fn a_mismatch_clears_the_outputs_until_two_writes_of_zero_succeed() {
    let mut bench = Bench::started(&[State::Low, State::High], none);
    assert_eq!(bench.tick([7, 0, 0]), Ok(()));
    bench.chip(|chip| chip.wrong = Some((1, 1)));
    let found = Err(Error::Mismatch {
        item: Item::Code(1),
        expected: 0,
        answered: 1,
    });
    assert_eq!(bench.tick([7, 0, 0]), found);
    bench.chip(|chip| chip.wrong = None);
    for _ in 0..3 {
        assert_eq!(bench.tick([0; 3]), found);
    }
    assert_eq!(bench.tick([0; 3]), Ok(()));
    assert_eq!(bench.tick([1, 2, 3]), Ok(()));
    bench.done();
}

#[test]
fn a_chip_that_is_gone_is_found_in_the_next_tick() {
    let mut bench = Bench::started(&[State::Low], none);
    assert_eq!(bench.tick([7, 0, 0]), Ok(()));
    bench.chip(|chip| chip.is_missing = true);
    let found = bench.tick([7, 0, 0]);
    assert!(matches!(
        found,
        Err(Error::Mismatch {
            answered: 0xFFFF,
            ..
        })
    ));
    bench.done();
}

/// The second channel: it needs no bus.
#[test]
fn a_write_that_does_not_come_to_its_end_clears_the_outputs_at_the_beginning_of_the_next_tick() {
    let mut bench = Bench::started(&[State::Low, State::High], none);
    assert_eq!(bench.tick([7, 0, 0]), Ok(()));
    bench.pass(PERIOD);
    let begun = bench.converter.begin();
    assert_eq!(begun, Ok(()));
    bench.model.borrow_mut().is_dead = true;
    // Its reading has come to its end already.
    assert_eq!(bench.converter.write([8, 0, 0]), Ok(()));
    bench.pass(PERIOD);
    assert_eq!(bench.converter.begin(), Err(Error::Bus(Stuck)));
    assert_eq!(bench.converter.write([9, 0, 0]), Err(Error::Bus(Stuck)));
    // The bus works again: the outputs stay cleared until two writes of zero have got through.
    bench.model.borrow_mut().is_dead = false;
    bench.pass(PERIOD);
    assert_eq!(bench.tick([0; 3]), Err(Error::Bus(Stuck)));
    assert_eq!(bench.tick([0; 3]), Ok(()));
    assert_eq!(bench.tick([0; 3]), Ok(()));
    bench.done();
}

#[test]
fn a_reading_that_does_not_come_to_its_end_is_reported_by_the_write() {
    let mut bench = Bench::started(&[State::Low], none);
    bench.model.borrow_mut().is_dead = true;
    assert_eq!(bench.tick([7, 0, 0]), Err(Error::Bus(Stuck)));
    bench.done();
}

#[test]
fn a_write_ends_well_within_a_control_period_at_the_highest_rate() {
    let of = |times: Times| {
        (
            times.writing.load_ns(),
            times.writing.steps_ns(MAX_STEPS),
            times.reading.steps_ns(FRAME_STEPS),
        )
    };
    let both = BOARDS.map(of);
    println!("write to /LDAC, all of a write, a reading, ns: {both:?}");
    assert_eq!(both, [(7_812, 11_500, 7_356), (8_109, 11_925, 7_150)]);
}
