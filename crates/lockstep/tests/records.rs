//! The records of the lockstep channel survive the way there and back.

use proptest::prelude::*;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::reference::Velocity;
use quadrant_law::safety::{AxisSwitches, Switches};
use quadrant_law::stage::Outputs;
use quadrant_law::units::DacCode;
use quadrant_lockstep::{
    BootBlock, InjectedFault, InputRecord, JOB_BYTES, Mode, OutputRecord, Reset, held,
};
use quadrant_settings::Job;
use quadrant_settings::{PlanSettings, StageSettings};

use quadrant_test_support::{repeatable, sine_on_x};

proptest! {
    #![proptest_config(repeatable(500))]

    #[test]
    fn input_records_round_trip(
        counts in any::<[u32; 3]>(),
        index in any::<[Option<u32>; 3]>(),
        fresh in any::<[bool; 3]>(),
        valid in any::<[bool; 3]>(),
        switches in any::<u16>(),
        link_lost in any::<bool>(),
        stuck in any::<[bool; 3]>(),
        slow in any::<bool>(),
        number in 0u32..=5,
    ) {
        let reading = |axis: usize| EncoderReading {
            count: counts[axis],
            index: index[axis],
            fresh: fresh[axis],
            valid: valid[axis],
        };
        let record = InputRecord {
            readings: [0, 1, 2].map(reading),
            switches: Switches::from_bits(switches),
            link_lost,
            stuck,
            slow,
            request: Command::from_number(number),
        };
        prop_assert_eq!(InputRecord::decode(&record.encode()), record);
    }

    #[test]
    fn output_records_round_trip(codes in any::<[i16; 3]>(), enabled in any::<bool>(), brake_released in any::<bool>()) {
        let outputs = Outputs { codes: codes.map(DacCode).into(), enabled, brake_released };
        let record = OutputRecord { outputs };
        prop_assert_eq!(OutputRecord::decode(&record.encode()), record);
    }

    #[test]
    fn boot_blocks_round_trip(mode in 0u8..3, ticks in any::<u32>(), job_bytes in 0..=JOB_BYTES as u32) {
        let mode = [Mode::Lockstep, Mode::Paced, Mode::Unpaced][usize::from(mode)];
        let block = BootBlock { mode, ticks, job_bytes };
        prop_assert_eq!(BootBlock::decode(&block.encode()), Some(block));
    }

    #[test]
    fn a_memory_that_no_host_prepared_is_not_a_boot_block(bytes in any::<[u8; BootBlock::BYTES]>()) {
        prop_assume!(bytes[..4] != *b"DAUQ");
        prop_assert_eq!(BootBlock::decode(&bytes), None);
    }
}

#[test]
fn records_are_little_endian_words() {
    let mut record = InputRecord::of_counts([1, 0x0203, 0x0405_0607], Some(Command::Run));
    let mut bytes = [0; 32];
    bytes[..16].copy_from_slice(&[1, 0, 0, 0, 3, 2, 0, 0, 7, 6, 5, 4, 4, 0, 0, 0]);
    assert_eq!(record.encode(), bytes);
    record.switches = Switches::EMERGENCY_STOP.with_axis(AxisName::Y, AxisSwitches::HOME);
    record.readings[0].index = Some(0x0807);
    record.readings[1].fresh = false;
    record.readings[2].valid = false;
    record.link_lost = true;
    record.stuck[2] = true;
    record.slow = true;
    bytes[16..22].copy_from_slice(&[0x80, 0x80, 0x11, 0x33, 7, 8]);
    assert_eq!(record.encode(), bytes);
    let record = OutputRecord {
        outputs: Outputs {
            codes: [DacCode(-1), DacCode(2), DacCode(-3)].into(),
            enabled: true,
            brake_released: true,
        },
    };
    assert_eq!(record.encode(), [0xFF, 0xFF, 2, 0, 0xFD, 0xFF, 3, 0]);
}

#[test]
fn a_stuck_bit_shows_in_the_words_that_lack_it() {
    let codes = [DacCode(-1), DacCode(3), DacCode(3)];
    assert_eq!(held(codes, [false; 3]), codes);
    assert_eq!(
        held(codes, [true, true, false]),
        [DacCode(-1), DacCode(0x1003), DacCode(3)]
    );
}

#[test]
fn words_of_resets_and_provocations_round_trip() {
    for reset in [Reset::PowerOn, Reset::Watchdog, Reset::Software] {
        assert_eq!(Reset::from_word(reset as u32), reset);
    }
    let known: Vec<_> = (0..100).filter_map(InjectedFault::from_repr).collect();
    assert_eq!(known.last(), Some(&InjectedFault::LateTick));
    assert_eq!(known.len(), InjectedFault::LateTick as usize);
    for (word, provocation) in (1..).zip(known) {
        assert_eq!(provocation as u32, word);
    }
}

#[test]
fn boot_blocks_with_wrong_magic_mode_or_size_are_refused() {
    let block = BootBlock {
        mode: Mode::Paced,
        ticks: 10,
        job_bytes: 100,
    };
    for (byte, value) in [(0, 0), (4, 3), (12 + 1, 0x7F)] {
        let mut bytes = block.encode();
        bytes[byte] = value;
        assert_eq!(BootBlock::decode(&bytes), None, "byte {byte}");
    }
}

#[test]
fn every_command_without_a_value_has_its_number_and_no_other_number_a_command() {
    let found: Vec<(u32, Command)> = (0..1000)
        .chain([u32::MAX])
        .filter_map(|number| Some((number, Command::from_number(number)?)))
        .collect();
    assert_eq!(found.len(), 7 + 3 + 3);
    for &(number, command) in &found {
        assert_eq!(command.number(), Some(number), "{command:?}");
    }
    assert_eq!(
        &found[..4],
        &[
            (1, Command::Enable),
            (2, Command::Disable),
            (3, Command::ResetFault),
            (4, Command::Run),
        ]
    );
    assert_eq!(Command::Jog(AxisName::X, Velocity::ZERO).number(), None);
}

#[test]
fn the_default_job_fits_its_room_and_round_trips() {
    let job = Job {
        stage: StageSettings::simulated(),
        plan: sine_on_x(30.0, 10.0),
    };
    let mut room = vec![0; JOB_BYTES];
    let used = postcard::to_slice(&job, &mut room).expect("fits").len();
    let back: Job = postcard::from_bytes(&room[..used]).expect("decodes");
    assert_eq!(back, job);
    assert_ne!(back.plan, PlanSettings::default());
}
