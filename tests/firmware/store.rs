//! Settings in a flash: what it may hold before, and what becomes of a set.

use quadrant::store::{
    BUFFER_BYTES, DecodeError, Finding, LoadError, LogError, Provenance, SaveError, Store,
};
use quadrant_law::friction::gms::GmsElement;
use quadrant_settings::{Reason, StageSettings};

use quadrant_fault_bench::flash::{Flash, FlashError, SECTOR};
use quadrant_test_support::Noise;

const ELEMENTS: usize = 8;

fn save(flash: Flash, settings: &StageSettings, elements: usize) -> Flash {
    let mut store = Store::new(flash, 0);
    let provenance = Provenance::try_from("test").expect("fits");
    store
        .save(settings, elements, &provenance, &mut [0; BUFFER_BYTES])
        .expect("stores");
    store.into_flash()
}

type Stored = Result<Option<(u32, StageSettings)>, LoadError<FlashError>>;

/// True if what is loaded may be put in force unasked.
fn is_newest(flash: &Flash) -> bool {
    let mut settings = StageSettings::default();
    Store::new(flash.clone(), 0)
        .load(&mut settings, ELEMENTS, &mut [0; BUFFER_BYTES], &mut |_| {})
        .is_ok_and(|loaded| loaded.is_some_and(|loaded| loaded.is_newest))
}

fn load(flash: &Flash) -> Stored {
    let mut settings = StageSettings {
        rate_hz: 77.0,
        ..StageSettings::simulated()
    };
    let loaded = Store::new(flash.clone(), 0).load(
        &mut settings,
        ELEMENTS,
        &mut [0; BUFFER_BYTES],
        &mut |_: Finding| {},
    );
    if !matches!(loaded, Ok(Some(_))) {
        assert_eq!(settings, StageSettings::default());
    }
    Ok(loaded?.map(|loaded| {
        assert_eq!(loaded.provenance, "test");
        (loaded.sequence, settings)
    }))
}

fn numbered(number: u32) -> StageSettings {
    let mut settings = StageSettings::simulated();
    settings.axes[0].feedback.transfer_s = 0.1 + f64::from(number) * 1e-3;
    settings
}

#[test]
fn an_empty_flash_gives_the_default_settings() {
    assert_eq!(load(&Flash::default()), Ok(None));
}

#[test]
fn a_flash_full_of_something_else_takes_settings() {
    let mut noise = Noise::new(3);
    let random: Vec<u8> = (0..2 * SECTOR)
        .map(|_| (noise.bits() >> 30) as u8)
        .collect();
    for bytes in [random, vec![0; 2 * SECTOR], b"Quadrant".repeat(SECTOR / 4)] {
        let mut flash = Flash::default();
        flash.bytes = bytes;
        assert_eq!(load(&flash), Err(LoadError::Log(LogError::Damaged)));
        let flash = save(flash, &numbered(1), ELEMENTS);
        assert_eq!(load(&flash), Ok(Some((1, numbered(1)))));
        assert!(is_newest(&flash), "what was there before is still doubted");
    }
}

#[test]
fn a_set_that_is_refused_stays_and_makes_room_for_another() {
    let mut many = StageSettings::simulated();
    let elements = &mut many.axes[1].friction.gms.elements;
    let (weight, stiffness_v_per_mm) = (1.0 / 9.0, 1.0);
    *elements = [GmsElement {
        stiffness_v_per_mm,
        weight,
    }; 9]
        .into_iter()
        .collect();
    let flash = save(Flash::default(), &many, 10);
    for _ in 0..2 {
        let Err(LoadError::Decode(DecodeError::Refused(error))) = load(&flash) else {
            panic!("more elements than there is room for");
        };
        assert_eq!(error.field, "friction.gms.elements");
        assert_eq!(error.reason, Reason::TooManyElements { room: 8 });
    }
    let flash = save(flash, &numbered(5), ELEMENTS);
    assert_eq!(load(&flash), Ok(Some((2, numbered(5)))));
}

/// One flipped bit anywhere costs at most the set it is in.
#[test]
fn a_flipped_bit_never_makes_other_settings() {
    let mut flash = Flash::default();
    let mut ends = vec![4];
    for number in 0..3 {
        flash = save(flash, &numbered(number), ELEMENTS);
        let used = flash
            .bytes
            .iter()
            .rposition(|&byte| byte != 0xFF)
            .expect("a set")
            + 1;
        ends.push(used.next_multiple_of(4));
    }
    let (mut kept, mut older) = (0, 0);
    for at in (0..ends[3]).step_by(7) {
        let mut flipped = flash.clone();
        flipped.bytes[at] ^= 1 << (at % 8);
        let (sequence, settings) = load(&flipped).expect("reads").expect("a set");
        assert_eq!(settings, numbered(sequence - 1));
        if at < ends[2] {
            assert_eq!(sequence, 3, "a flip at {at}, before the newest set");
        }
        // A set that is not the newest is never put in force in silence.
        assert_eq!(is_newest(&flipped), sequence == 3, "a flip at {at}");
        kept += u32::from(sequence == 3);
        older += u32::from(sequence == 2);
    }
    println!("{kept} flips kept the newest set, {older} fell back to the one before it");
    assert!(kept > 800 && older > 400, "{kept}, {older}");
}

/// A set damaged anywhere, behind as many others as a sector takes and more.
#[test]
fn a_damaged_newest_set_is_noticed_wherever_it_lies() {
    let mut flash = Flash::default();
    for number in 0..12 {
        let before = flash.clone();
        flash = save(flash, &numbered(number), ELEMENTS);
        assert!(is_newest(&flash), "after store {number}");
        // But for the library's own marks at both ends of a sector, which allow a flipped bit.
        let changed: Vec<usize> = (0..flash.bytes.len())
            .filter(|&at| flash.bytes[at] != before.bytes[at] && flash.bytes[at] != 0xFF)
            .filter(|&at| (4..SECTOR - 4).contains(&(at % SECTOR)))
            .collect();
        for &at in changed.iter().step_by(331) {
            let mut flipped = flash.clone();
            flipped.bytes[at] ^= 0x10;
            match load(&flipped) {
                Ok(Some((sequence, _))) if sequence == number + 1 => {
                    panic!("byte {at} of set {number} does not matter")
                }
                Ok(Some(_)) => assert!(!is_newest(&flipped), "byte {at} of set {number}"),
                Ok(None) => panic!("byte {at} of set {number}: taken for a blank flash"),
                Err(error) => assert_eq!(error, LoadError::Log(LogError::Damaged)),
            }
            let mended = save(flipped, &numbered(50), ELEMENTS);
            assert!(is_newest(&mended), "stored again after byte {at}");
        }
    }
}

#[test]
fn nothing_is_written_or_erased_while_the_enable_line_is_high() {
    let mut flash = Flash::default();
    for number in 0..12 {
        flash.outputs_on = true;
        let before = flash.operations;
        let mut store = Store::new(flash, 0);
        let saved = store.save(
            &numbered(number),
            ELEMENTS,
            &Provenance::new(),
            &mut [0; BUFFER_BYTES],
        );
        assert_eq!(saved, Err(SaveError::Log(LogError::OutputsOn)));
        flash = store.into_flash();
        assert_eq!(flash.operations, before);
        flash.outputs_on = false;
        flash = save(flash, &numbered(number), ELEMENTS);
    }
    assert!(flash.erasures.iter().all(|&erasures| erasures > 0));
}

#[test]
fn a_word_that_takes_no_write_costs_a_sector_and_not_the_settings() {
    let mut flash = save(Flash::default(), &numbered(0), ELEMENTS);
    let used = flash.bytes.iter().rposition(|&byte| byte != 0xFF);
    let end = (used.expect("a set") + 1).next_multiple_of(4);
    flash.refusing = Some(end..end + 4);
    for number in 1..4 {
        flash = save(flash, &numbered(number), ELEMENTS);
        assert_eq!(load(&flash), Ok(Some((number + 1, numbered(number)))));
    }
}

#[test]
fn settings_behind_something_else_leave_it_alone() {
    let mut flash = Flash::of_sectors(4);
    flash.bytes[..2 * SECTOR].fill(0x5A);
    let start = 2 * SECTOR as u32;
    for number in 0..12 {
        let mut store = Store::new(flash, start);
        let provenance = Provenance::try_from("test").expect("fits");
        let buffer = &mut [0; BUFFER_BYTES];
        store
            .save(&numbered(number), ELEMENTS, &provenance, buffer)
            .expect("stores");
        let mut settings = StageSettings::default();
        let loaded = store
            .load(&mut settings, ELEMENTS, buffer, &mut |_| {})
            .expect("reads")
            .expect("is there");
        assert_eq!((loaded.sequence, loaded.is_newest), (number + 1, true));
        assert_eq!(settings, numbered(number));
        flash = store.into_flash();
    }
    assert!(flash.bytes[..2 * SECTOR].iter().all(|&byte| byte == 0x5A));
    assert!(flash.erasures[..2] == [0; 2] && flash.erasures[2..].iter().all(|&count| count > 0));
}

#[test]
fn errors_say_what_was_wrong_and_what_to_do() {
    let refused = |settings: &StageSettings| settings.validate(ELEMENTS).expect_err("not valid");
    let mut invalid = StageSettings::simulated();
    invalid.axes[1].limits.max_velocity_mm_s = -1.0;
    let error = refused(&invalid);
    let texts = [
        (
            SaveError::<FlashError>::Refused(error).to_string(),
            error.to_string(),
        ),
        (
            SaveError::<FlashError>::TooLong.to_string(),
            format!("more than {BUFFER_BYTES} bytes"),
        ),
        (
            SaveError::Log(LogError::Flash(FlashError::Off)).to_string(),
            "the flash failed: Off".into(),
        ),
        (
            SaveError::<FlashError>::Log(LogError::NotKept).to_string(),
            "replace the board".into(),
        ),
        (
            SaveError::<FlashError>::Log(LogError::OutputsOn).to_string(),
            "disable them".into(),
        ),
        (
            LoadError::<FlashError>::Log(LogError::Damaged).to_string(),
            "is damaged".into(),
        ),
        (
            LoadError::<FlashError>::Decode(DecodeError::Refused(error)).to_string(),
            error.to_string(),
        ),
        (
            DecodeError::Refused(error).to_string(),
            "max_velocity_mm_s".into(),
        ),
    ];
    for (said, expected) in texts {
        assert!(said.contains(&expected), "{said}: {expected}");
    }
}
