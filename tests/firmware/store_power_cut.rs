//! A power cut at any operation of the flash leaves the settings that were stored last, or those that were being stored.

use quadrant::store::{BUFFER_BYTES, LoadError, LogError, Provenance, SaveError, Store, Stored};
use quadrant_law::control::feedback::LawKind;
use quadrant_settings::StageSettings;

use quadrant_fault_bench::flash::{Damage, Flash, FlashError, WordFlash};
use quadrant_test_support::Noise;

const ELEMENTS: usize = 8;

/// Settings that name their store, and are soon checked: without a plant there is no bound to search.
fn set(number: u32) -> StageSettings {
    let mut settings = StageSettings::simulated();
    for axis in &mut settings.axes {
        axis.plant = None;
        axis.feedback.law = LawKind::Pid;
        axis.feedback.pid.kp_v_per_mm = 1.0 + f64::from(number) * 1e-4;
    }
    settings
}

fn off() -> SaveError<FlashError> {
    SaveError::Log(LogError::Flash(FlashError::Off))
}

fn save<const WORD: usize>(
    flash: WordFlash<WORD>,
    number: u32,
) -> (WordFlash<WORD>, Result<Stored, SaveError<FlashError>>) {
    let mut store = Store::new(flash, 0);
    let provenance = Provenance::try_from("test").expect("fits");
    let saved = store.save(&set(number), ELEMENTS, &provenance, &mut [0; BUFFER_BYTES]);
    (store.into_flash(), saved)
}

/// The number of the set that a reboot finds; `None` if nothing was ever stored.
fn after_reboot<const WORD: usize>(flash: WordFlash<WORD>) -> (WordFlash<WORD>, Option<u32>) {
    let mut store = Store::new(flash.reboot(), 0);
    let mut settings = StageSettings::simulated();
    let loaded = match store.load(&mut settings, ELEMENTS, &mut [0; BUFFER_BYTES], &mut |_| {}) {
        // The remains of the first set, with none before it.
        Err(LoadError::Log(LogError::Damaged)) => None,
        loaded => loaded.expect("what was stored is valid"),
    };
    let number = loaded.map(|_| {
        let gain = settings.axes[0].feedback.pid.kp_v_per_mm;
        let number = ((gain - 1.0) * 1e4).round() as u32;
        assert_eq!(settings, set(number), "a mixture of sets");
        number
    });
    (store.into_flash(), number)
}

/// Cuts every operation of storing `number` over what `flash` holds; the cuts, and those after which the set was lost.
fn cut_everywhere<const WORD: usize>(
    flash: &WordFlash<WORD>,
    number: u32,
    every_damage: bool,
) -> (u64, u64) {
    let old = (number > 0).then(|| number - 1);
    let (done, saved) = save(flash.clone(), number);
    saved.expect("stores without a cut");
    let (mut cuts, mut lost) = (0, 0);
    for at in flash.operations..done.operations {
        let erasing = done.erasures != flash.erasures && at == flash.operations;
        let all = Damage::each(at);
        let damages = if every_damage || erasing {
            &all[..]
        } else {
            // By turns.
            &all[at as usize % all.len()..][..1]
        };
        for &damage in damages {
            let mut cut = flash.clone();
            cut.cut = Some((at, damage));
            let (cut, saved) = save(cut, number);
            assert_eq!(saved, Err(off()));
            let (cut, found) = after_reboot(cut);
            cuts += 1;
            lost += u64::from(found != old && found != Some(number));
            // The flash still takes a set.
            if at % 97 == 0 || erasing {
                let (cut, saved) = save(cut, number + 1);
                saved.expect("stores after a cut");
                assert_eq!(after_reboot(cut).1, Some(number + 1));
            }
        }
    }
    (cuts, lost)
}

/// Cuts 14 stores everywhere, by which both sectors are filled, and each is erased with settings in the other; the cuts.
fn cut_stores<const WORD: usize>() -> u64 {
    let mut flash = WordFlash::<WORD>::default();
    let (mut cuts, mut lost, mut erasures) = (0, 0, 0);
    for number in 0..14 {
        let (more, bad) = cut_everywhere(&flash, number, false);
        cuts += more;
        lost += bad;
        let (after, saved) = save(flash, number);
        erasures += u32::from(saved.expect("stores").erased);
        flash = after;
    }
    println!("{cuts} cuts over 14 stores with {erasures} erasures: {lost} sets lost");
    assert!(erasures >= 3, "{erasures} erasures");
    assert_eq!(lost, 0);
    cuts
}

#[test]
fn no_cut_loses_the_settings() {
    assert!(cut_stores::<4>() > 5000);
}

#[test]
fn no_cut_loses_the_settings_in_words_of_32_bytes_with_check_sums() {
    assert!(cut_stores::<32>() > 600);
}

/// Remains of one cut are there at the next.
#[test]
fn cuts_upon_cuts_lose_nothing() {
    let mut noise = Noise::new(7);
    let mut flash = Flash::default();
    let mut kept = None;
    let (mut cut_stores, mut survived) = (0, 0);
    for number in 0..600 {
        let before = flash.operations;
        let most = save(flash.clone(), number).0.operations - before;
        let at = before + noise.bits() % (most + most / 4);
        let damage = Damage::each(noise.bits())[(noise.bits() >> 9) as usize % 5];
        flash.cut = Some((at, damage));
        let (after, saved) = save(flash, number);
        let (after, found) = after_reboot(after);
        match saved {
            Ok(_) => kept = Some(number),
            Err(error) => {
                assert_eq!(error, off());
                cut_stores += 1;
                assert!(
                    found == kept || found == Some(number),
                    "{found:?} after {kept:?}"
                );
                survived += u32::from(found == Some(number));
                kept = found;
            }
        }
        assert_eq!(found, kept);
        flash = after;
    }
    println!("{cut_stores} of 600 stores cut, {survived} of them complete");
    assert!(cut_stores > 300);
}

#[test]
fn the_sectors_wear_evenly() {
    let mut flash = Flash::default();
    let mut first_erased = None;
    for number in 0..1000 {
        let (after, saved) = save(flash, number);
        if saved.expect("stores").erased && number > 0 {
            first_erased = first_erased.or(Some(number));
        }
        flash = after;
    }
    let [first, second] = flash.erasures[..] else {
        panic!("two sectors");
    };
    println!(
        "first erasure before store {first_erased:?}; {first} and {second} erasures in 1000 stores"
    );
    assert!(first.abs_diff(second) <= 1);
    assert!(
        first + second <= 1000 / 3 + 1,
        "{first} and {second} erasures"
    );
}

#[test]
fn a_worn_word_costs_a_sector_and_not_the_settings() {
    let (mut flash, saved) = save(Flash::default(), 0);
    saved.expect("stores");
    flash.worn = Some(8000..8004);
    let mut seen = 0;
    for number in 1..20 {
        let (after, saved) = save(flash, number);
        seen += u32::from(saved.expect("the other sector takes it").erased);
        let (after, found) = after_reboot(after);
        assert_eq!(found, Some(number));
        flash = after;
    }
    assert!(seen >= 4, "{seen} erasures");
}

#[test]
fn a_flash_that_keeps_nothing_says_so_and_keeps_the_old_set() {
    let (mut flash, saved) = save(Flash::default(), 0);
    saved.expect("stores");
    let used = flash
        .bytes
        .iter()
        .rposition(|&byte| byte != 0xFF)
        .expect("a set")
        + 1;
    flash.worn = Some(used.next_multiple_of(4)..flash.bytes.len());
    let (flash, saved) = save(flash, 1);
    assert_eq!(saved, Err(SaveError::Log(LogError::NotKept)));
    assert_eq!(after_reboot(flash).1, Some(0));
}
