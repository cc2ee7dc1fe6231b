//! The converter's driver, byte for byte, against a mock of the bus and its pins.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as Level};
use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction};
use quadrant::drivers::ad5754r::{self, ALL_ZERO, Ad5754r, Clock, Error, Item, Pins, SelectClock};

use embedded_hal::spi::{ErrorKind, ErrorType, SpiBus};

/// The mock bus, which also keeps the clocks that were selected and can be told to fail.
struct Bus {
    spi: Spi<u8>,
    clocks: Rc<RefCell<Vec<Clock>>>,
    fails: bool,
}

impl ErrorType for Bus {
    type Error = ErrorKind;
}

impl Bus {
    fn verdict(&self) -> Result<(), ErrorKind> {
        if self.fails {
            Err(ErrorKind::Overrun)
        } else {
            Ok(())
        }
    }
}

impl SpiBus for Bus {
    fn read(&mut self, words: &mut [u8]) -> Result<(), ErrorKind> {
        SpiBus::read(&mut self.spi, words)
    }
    fn write(&mut self, words: &[u8]) -> Result<(), ErrorKind> {
        self.verdict()?;
        SpiBus::write(&mut self.spi, words)
    }
    fn transfer(&mut self, read: &mut [u8], write: &[u8]) -> Result<(), ErrorKind> {
        self.spi.transfer(read, write)
    }
    fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), ErrorKind> {
        self.verdict()?;
        self.spi.transfer_in_place(words)
    }
    fn flush(&mut self) -> Result<(), ErrorKind> {
        SpiBus::flush(&mut self.spi)
    }
}

impl SelectClock for Bus {
    fn select(&mut self, clock: Clock) {
        self.clocks.borrow_mut().push(clock);
    }
}

/// The transfers and pin levels that are expected.
#[derive(Default)]
struct Script {
    bus: Vec<Transaction<u8>>,
    sync: Vec<Level>,
    load: Vec<Level>,
    clear: Vec<Level>,
    clocks: Vec<Clock>,
}

impl Script {
    fn frame(mut self, bytes: [u8; 3]) -> Self {
        self.bus
            .extend([Transaction::write_vec(bytes.to_vec()), Transaction::flush()]);
        self.sync
            .extend([Level::set(State::Low), Level::set(State::High)]);
        self
    }

    fn answered_frame(mut self, bytes: [u8; 3], answer: [u8; 3]) -> Self {
        self.bus.extend([
            Transaction::transfer_in_place(bytes.to_vec(), answer.to_vec()),
            Transaction::flush(),
        ]);
        self.sync
            .extend([Level::set(State::Low), Level::set(State::High)]);
        self.clocks.extend([Clock::Reading, Clock::Writing]);
        self
    }

    fn update(mut self) -> Self {
        self.load
            .extend([Level::set(State::Low), Level::set(State::High)]);
        self
    }

    /// A converter that is held at zero volts and not started.
    fn held() -> Self {
        let mut script = Self::default();
        script.clear.push(Level::set(State::Low));
        script.sync.push(Level::set(State::High));
        script.load.push(Level::set(State::High));
        script
    }

    /// The start, up to the answers.
    fn powered() -> Self {
        let mut script = Self::held();
        script.clocks.push(Clock::Writing);
        script
            .frame([0x0C, 0x00, 0x04])
            .frame([0x19, 0x00, 0x0C])
            .frame([0x04, 0x00, 0x00])
            .update()
            .frame([0x10, 0x00, 0x1F])
            .frame([0x04, 0x00, 0x00])
            .update()
    }

    /// A start that goes well.
    fn started() -> Self {
        let mut script = Self::powered()
            .frame([0x88, 0x00, 0x00])
            .answered_frame([0x18, 0x00, 0x00], [0x00, 0x00, 0x04])
            .frame([0x90, 0x00, 0x00])
            .answered_frame([0x18, 0x00, 0x00], [0x00, 0x00, 0x1F]);
        script.clear.push(Level::set(State::High));
        script
    }

    /// A call of `write`: what it asks for, the answer, the codes.
    fn write(self, question: u8, answer: u16, codes: [i16; 3]) -> Self {
        let [a, b, c] = codes.map(i16::to_be_bytes);
        let [high, low] = answer.to_be_bytes();
        self.frame([question, 0, 0])
            .answered_frame([0x00, a[0], a[1]], [0x80, high, low])
            .frame([0x01, b[0], b[1]])
            .frame([0x02, c[0], c[1]])
            .update()
    }

    /// Runs `body` on a converter, and checks that exactly this happened.
    fn run(self, body: impl FnOnce(&mut Converter)) {
        let mut spi = Spi::new(&self.bus);
        let mut sync = Pin::new(&self.sync);
        let mut load = Pin::new(&self.load);
        let mut clear = Pin::new(&self.clear);
        let clocks = Rc::new(RefCell::new(Vec::new()));
        let bus = Bus {
            spi: spi.clone(),
            clocks: clocks.clone(),
            fails: false,
        };
        let pins = Pins {
            sync: sync.clone(),
            load: load.clone(),
            clear: clear.clone(),
        };
        body(&mut Ad5754r::new(bus, pins, NoopDelay::new()));
        spi.done();
        sync.done();
        load.done();
        clear.done();
        assert_eq!(*clocks.borrow(), self.clocks);
    }
}

type Converter = Ad5754r<Bus, Pin, Pin, Pin, NoopDelay>;

const STARTED: Result<(), Error<ErrorKind>> = Ok(());

#[test]
fn powers_up_in_the_bipolar_range_at_zero_and_then_lets_go_of_clear() {
    Script::started().run(|converter| assert_eq!(converter.start(), STARTED));
}

#[test]
fn is_held_at_zero_volts_until_it_is_started() {
    Script::held().run(|_| {});
}

#[test]
fn a_chip_that_is_not_there_stays_cleared_and_is_reported() {
    // A floating SDO reads as ones.
    let script = Script::powered()
        .frame([0x88, 0x00, 0x00])
        .answered_frame([0x18, 0x00, 0x00], [0xFF; 3]);
    script.run(|converter| {
        let error = Error::Mismatch {
            item: Item::Range,
            expected: 4,
            answered: 0xFFFF,
        };
        assert_eq!(converter.start(), Err(error));
    });
}

#[test]
fn a_chip_that_does_not_power_up_is_reported() {
    let script = Script::powered()
        .frame([0x88, 0x00, 0x00])
        .answered_frame([0x18, 0x00, 0x00], [0x00, 0x00, 0x04])
        .frame([0x90, 0x00, 0x00])
        .answered_frame([0x18, 0x00, 0x00], [0x00, 0x00, 0x0F]);
    script.run(|converter| {
        let error = Error::Mismatch {
            item: Item::Power,
            expected: 0x1F,
            answered: 0x0F,
        };
        assert_eq!(converter.start(), Err(error));
    });
}

#[test]
fn writes_three_codes_that_take_effect_together_and_reads_back_one_register_after_the_other() {
    let codes = [
        [1, -1, 0x1234],
        [i16::MIN, i16::MAX, 0],
        [-2, 3, -4],
        [5, 6, 7],
        [8, 9, 10],
    ];
    Script::started()
        .write(0x80, 0x0000, codes[0])
        .write(0x81, 0xFFFF, codes[1])
        .write(0x82, 0x0000, codes[2])
        .write(0x90, 0x001F, codes[3])
        .write(0x80, 0x0005, codes[4])
        .run(|converter| {
            assert_eq!(converter.start(), STARTED);
            for codes in codes {
                assert_eq!(converter.write(codes), STARTED, "{codes:?}");
            }
        });
}

#[test]
fn every_wrong_bit_of_every_register_is_reported_and_the_codes_are_written_all_the_same() {
    // Bits 6 and 11..15 of the power register mean nothing.
    let questions = [
        (0x80, Item::Code(0), 100_u16, u16::MAX),
        (0x81, Item::Code(1), 200, u16::MAX),
        (0x82, Item::Code(2), 300, u16::MAX),
        (0x90, Item::Power, 0x1F, 0x07BF),
    ];
    let codes = [100, 200, 300];
    let wrong = |turn: usize, bit: u16| questions[turn].2 ^ (1 << bit);
    // In the first round the codes of the call before are zero.
    let mut script = Script::started().write(questions[0].0, 0, codes);
    for (question, _, expected, _) in &questions[1..] {
        script = script.write(*question, *expected, codes);
    }
    for bit in 0..16 {
        for (turn, (question, ..)) in questions.iter().enumerate() {
            script = script.write(*question, wrong(turn, bit), codes);
        }
    }
    // Pulled once, and held as long as nothing else is written.
    script.clear.push(Level::set(State::Low));
    script.run(|converter| {
        assert_eq!(converter.start(), STARTED);
        for _ in 0..4 {
            assert_eq!(converter.write(codes), STARTED);
        }
        for bit in 0..16 {
            for (turn, (_, item, expected, bits)) in questions.into_iter().enumerate() {
                // A bit that means nothing leaves the mismatch of the register before.
                let found = if bits >> bit & 1 == 1 {
                    Error::Mismatch {
                        item,
                        expected,
                        answered: wrong(turn, bit),
                    }
                } else {
                    Error::Mismatch {
                        item: questions[2].1,
                        expected: questions[2].2,
                        answered: wrong(2, bit),
                    }
                };
                assert_eq!(converter.write(codes), Err(found), "bit {bit} of {item:?}");
            }
        }
    });
}

#[test]
fn a_chip_that_lost_its_supply_is_reported_by_every_write_until_it_is_powered_up() {
    let codes = [0; 3];
    let questions = [0x80, 0x81, 0x82, 0x90];
    let mut script = Script::started();
    for power in [0, 0, 0x1F] {
        for question in questions {
            let answer = if question == 0x90 { power } else { 0 };
            script = script.write(question, answer, codes);
        }
    }
    script
        .clear
        .extend([Level::set(State::Low), Level::set(State::High)]);
    script.run(|converter| {
        assert_eq!(converter.start(), STARTED);
        let off = Err(Error::Mismatch {
            item: Item::Power,
            expected: 0x1F,
            answered: 0,
        });
        let found: Vec<_> = (0..12).map(|_| converter.write(codes)).collect();
        assert_eq!(found[..3], [STARTED; 3]);
        assert_eq!(
            found[3..11],
            [off; 8],
            "the codes read right, the chip is off"
        );
        assert_eq!(found[11], STARTED);
    });
}

#[test]
fn a_mismatch_clears_the_outputs_until_two_writes_of_zero_succeed() {
    let mut script = Script::started()
        .write(0x80, 0, [7, 0, 0])
        .write(0x81, 1, [7, 0, 0])
        .write(0x82, 0, [0; 3])
        .write(0x90, 0x1F, [0; 3])
        .write(0x80, 0, [0; 3])
        .write(0x81, 0, [0; 3])
        .write(0x82, 0, [1, 2, 3]);
    script
        .clear
        .extend([Level::set(State::Low), Level::set(State::High)]);
    script.run(|converter| {
        assert_eq!(converter.start(), STARTED);
        assert_eq!(converter.write([7, 0, 0]), STARTED);
        let found = Err(Error::Mismatch {
            item: Item::Code(1),
            expected: 0,
            answered: 1,
        });
        assert_eq!(converter.write([7, 0, 0]), found);
        for _ in 0..3 {
            assert_eq!(converter.write([0; 3]), found);
        }
        assert_eq!(converter.write([0; 3]), STARTED);
        assert_eq!(converter.write([1, 2, 3]), STARTED);
    });
}

/// The second channel: it needs no bus.
#[test]
fn a_bus_that_fails_is_reported_clears_the_outputs_and_loads_nothing() {
    let mut spi = Spi::new(&[]);
    let mut sync = Pin::new(&[
        Level::set(State::High),
        Level::set(State::Low),
        Level::set(State::High),
    ]);
    let mut load = Pin::new(&[Level::set(State::High)]);
    let mut clear = Pin::new(&[Level::set(State::Low), Level::set(State::Low)]);
    let bus = Bus {
        spi: spi.clone(),
        clocks: Rc::default(),
        fails: true,
    };
    let pins = Pins {
        sync: sync.clone(),
        load: load.clone(),
        clear: clear.clone(),
    };
    let mut converter = Ad5754r::new(bus, pins, NoopDelay::new());
    assert_eq!(
        converter.write([1, 2, 3]),
        Err(Error::Bus(ErrorKind::Overrun))
    );
    spi.done();
    sync.done();
    load.done();
    clear.done();
}

#[test]
fn all_zero_is_the_frame_that_the_start_sends() {
    assert_eq!(ALL_ZERO, [0x04, 0x00, 0x00]);
}

#[test]
fn a_write_takes_a_twelfth_of_a_control_period_at_10_khz() {
    let microseconds = ad5754r::write_ns(22_500_000, 5_625_000) as f64 * 1e-3;
    println!("bus and pins of one write: {microseconds:.2} us");
    assert!((8.1..8.2).contains(&microseconds), "{microseconds} us");
}
