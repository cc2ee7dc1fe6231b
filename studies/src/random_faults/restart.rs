//! The start after the supply has failed: which settings are in force, and that nothing moves.

use quadrant::store::{BUFFER_BYTES, Loaded, Store};
use quadrant_fault_bench::flash::Flash;
use quadrant_fault_bench::tasks::Tasks;
use quadrant_link::message::{Body, Provenance, SettingsRequest};
use quadrant_settings::StageSettings;

/// Room for GMS elements.
const ELEMENTS: usize = 8;
/// Origin of the set that a campaign may begin with.
const BEFORE: &str = "before";
/// Origin of the sets that a campaign stores.
const DURING: &str = "during";
/// Ticks after the start for which nothing may be enabled.
const QUIET_TICKS: u32 = 500;

/// A flash that is blank, or holds a set.
pub(super) fn prepared(has_stored: bool) -> Flash {
    if !has_stored {
        return Flash::default();
    }
    let mut store = Store::new(Flash::default(), 0);
    let origin = Provenance::try_from(BEFORE).expect("short");
    store
        .save(
            &StageSettings::simulated(),
            ELEMENTS,
            &origin,
            &mut [0; BUFFER_BYTES],
        )
        .expect("a blank flash takes a set");
    store.into_flash()
}

/// The request to store what is in force.
pub(super) fn store() -> Body {
    let origin = Provenance::try_from(DURING).expect("short");
    Body::Settings(SettingsRequest::Store(origin))
}

/// The knowledge of a flash before a start.
pub(super) struct Before {
    /// It held a set before the campaign.
    pub(super) has_stored: bool,
    /// Some of its words no longer change.
    pub(super) is_worn: bool,
    /// A host has the reply that its settings are kept.
    pub(super) acknowledged: bool,
}

/// Starts on the flash that a campaign has left, as `docs/safety.md` says in its table of stored settings.
///
/// # Errors
/// The invariant that did not hold.
pub(super) fn check(flash: Flash, before: &Before, seed: u64) -> Result<(), String> {
    let was_cut = flash.is_off();
    let flash = flash.reboot();
    let mut settings = StageSettings::default();
    let loaded = Store::new(flash.clone(), 0).load(
        &mut settings,
        ELEMENTS,
        &mut [0; BUFFER_BYTES],
        &mut |_| {},
    );
    let newest = match loaded {
        Ok(Some(Loaded {
            is_newest: true,
            provenance,
            ..
        })) => Some(provenance),
        // A set that is damaged, or beside one that is: only a cut or worn words leave it.
        Ok(Some(_)) | Err(_) if was_cut || before.is_worn => return stays_off(flash),
        Ok(None) if !before.has_stored => None,
        other => return Err(format!("neither cut nor worn, and found {other:?}")),
    };
    let Some(origin) = newest else {
        return if before.acknowledged {
            Err("a set was kept, and is gone".into())
        } else {
            Ok(())
        };
    };
    if settings != StageSettings::simulated() {
        return Err(format!(
            "{origin:?} was stored, and reads as something else"
        ));
    }
    if before.acknowledged && origin != DURING {
        return Err(format!("a newer set was kept, and {origin:?} is in force"));
    }
    let mut tasks = Tasks::with_flash(&settings, seed, flash, None);
    quiet(&mut tasks)?;
    tasks.send(&[Body::Enable]);
    tasks.run(100);
    if tasks.upper.borrow().outputs.enabled {
        Ok(())
    } else {
        Err("valid settings, and the host's request to enable was refused".into())
    }
}

/// Starts on damaged settings: no station can enable.
fn stays_off(flash: Flash) -> Result<(), String> {
    let default = StageSettings::default();
    let mut tasks = Tasks::with_flash(&default, 1, flash, Some(&default));
    quiet(&mut tasks)?;
    tasks.send(&[Body::ResetFault, Body::Enable]);
    quiet(&mut tasks).map_err(|why| format!("damaged settings: {why}"))
}

/// Nothing is enabled for a while.
fn quiet(tasks: &mut Tasks) -> Result<(), String> {
    for _ in 0..QUIET_TICKS {
        tasks.step();
        if tasks.upper.borrow().outputs.enabled {
            return Err("enabled after the start, and nobody has asked".into());
        }
    }
    Ok(())
}
