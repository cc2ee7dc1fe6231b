//! What the firmware starts with: settings, and what the last run left.

use embedded_storage::nor_flash::NorFlash;
use quadrant::friction::gms::FIRMWARE_ELEMENTS;
use quadrant::hal::ResetCause;
use quadrant::last_words::Death;
use quadrant::link::lockstep::Job;
use quadrant::link::message::Provenance;
use quadrant::safety::FaultCode;
use quadrant::scalar::Scalar;
use quadrant::settings::{PlanSettings, SettingsError, StageSettings};
use quadrant::stage::Plan;
use quadrant::store::{BUFFER_BYTES, Finding, Store};

use crate::{board, log};

/// What is in force from the first tick on.
pub(crate) struct Loaded<S: Scalar, F> {
    /// Settings that have been checked.
    pub(crate) settings: StageSettings,
    /// The motions.
    pub(crate) plan: Plan<S>,
    /// Where the settings come from.
    pub(crate) provenance: Provenance,
    /// Where they are stored.
    pub(crate) store: Store<F>,
    /// Stored settings were refused.
    pub(crate) fault: Option<FaultCode>,
}

/// The settings in flash; without them those of the job that a host has left; without one, the defaults.
///
/// # Panics
/// When a job cannot be decoded or is refused: then there is nothing that could safely be run.
pub(crate) fn load<S: Scalar, F: NorFlash>(
    flash: F,
    buffer: &mut [u8; BUFFER_BYTES],
) -> Loaded<S, F> {
    let mut store = Store::new(flash, 0);
    let mut settings = StageSettings::default();
    let mut report = |finding: Finding<'_>| match finding {
        Finding::Unknown(path) => defmt::warn!("{=str} is stored, but unknown here", path),
        Finding::Missing(path) => defmt::warn!("{=str} is not stored, and has its default", path),
    };
    let found = store.load(&mut settings, FIRMWARE_ELEMENTS, buffer, &mut report);
    let job = take(board::job());
    let mut provenance = Provenance::new();
    let mut fault = None;
    match found {
        Ok(Some(stored)) => {
            log::settings_loaded(&settings, stored.sequence, &stored.provenance);
            provenance = stored.provenance;
        }
        Ok(None) => {
            defmt::info!("no settings are stored: the defaults are in force, or a host's");
            settings = job.stage;
            built(settings.validate(FIRMWARE_ELEMENTS));
        }
        Err(error) => {
            defmt::error!("stored settings refused: {}", defmt::Display2Format(&error));
            settings = job.stage;
            built(settings.validate(FIRMWARE_ELEMENTS));
            fault = Some(FaultCode::SettingsInvalid);
        }
    }
    let plan = built(job.plan.build(&settings));
    Loaded {
        settings,
        plan,
        provenance,
        store,
        fault,
    }
}

/// What the last run left: logged, and as a fault if it did not end of its own accord.
pub(crate) fn remains(cause: ResetCause) -> Option<FaultCode> {
    log::started(cause);
    if let Some(words) = board::remains::take() {
        defmt::error!(
            "the firmware before this one ended in tick {=u32} by {=str}: {=str}",
            words.tick,
            words.death.as_str(),
            words.text()
        );
        return Some(match words.death {
            Death::Panic => FaultCode::Panic,
            Death::HardFault | Death::StrayInterrupt => FaultCode::HardFault,
        });
    }
    (cause == ResetCause::Watchdog).then_some(FaultCode::WatchdogReset)
}

/// Decodes the job that the board was given; without one, the default settings and no motion.
fn take(bytes: Option<&[u8]>) -> Job {
    let Some(bytes) = bytes else {
        return Job {
            stage: StageSettings::default(),
            plan: PlanSettings::default(),
        };
    };
    match postcard::from_bytes(bytes) {
        Ok(job) => job,
        Err(_) => panic!(
            "the job of {} bytes cannot be decoded: host and firmware differ in version",
            bytes.len()
        ),
    }
}

/// What was built, if the settings were accepted.
fn built<T>(result: Result<T, SettingsError>) -> T {
    match result {
        Ok(built) => built,
        Err(error) => panic!("settings refused: {error}"),
    }
}
