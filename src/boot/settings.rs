//! The settings to start with: those in flash, or those of a job that a host has left.

use quadrant::app::start_record::StartRecord;
use quadrant::hal::Encoders;
use quadrant::store::{BUFFER_BYTES, Finding, Store};
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::Plan;
use quadrant_link::message::Provenance;
use quadrant_settings::Job;
use quadrant_settings::{AxisSettings, PlanSettings, SettingsError, StageSettings};

use crate::board::{self, SettingsFlash};
use crate::log;

/// Results of loading the settings.
pub(super) struct Loaded<S: Scalar> {
    /// The motions of the axes.
    pub(super) plan: Plan<S>,
    /// The origin of the settings.
    pub(super) provenance: Provenance,
    /// The store that holds them.
    pub(super) store: Store<SettingsFlash>,
    /// True if stored settings were refused or are damaged.
    pub(super) invalid: bool,
    /// True if the draft holds settings that are stored and not in force.
    pub(super) keep_draft: bool,
}

/// Puts into `settings` those in flash; without them those of the job that a host has left; without one, the defaults, on
/// which the outputs are not enabled. They have been checked then. An older set than one that is damaged, one that the board
/// is not up to, and one that is to be set aside go into `draft`.
///
/// # Panics
/// When a job cannot be decoded or is refused: then there is nothing that could safely be run.
// Each step of the start has a frame of its own, gone when the next one begins.
#[inline(never)]
pub(super) fn load<S: Scalar>(
    flash: SettingsFlash,
    settings: &mut StageSettings,
    draft: &mut StageSettings,
    buffer: &mut [u8; BUFFER_BYTES],
    set_aside: bool,
) -> Loaded<S> {
    let mut store = Store::new(flash, 0);
    let mut report = |finding: Finding<'_>| match finding {
        Finding::Unknown(path) => defmt::warn!("{=str} is stored, but unknown here", path),
        Finding::Missing(path) => defmt::warn!("{=str} is not stored, and has its default", path),
    };
    let found = store.load(settings, FIRMWARE_ELEMENTS, buffer, &mut report);
    let mut provenance = Provenance::new();
    let (mut invalid, mut keep_draft) = (false, false);
    let plan = match found {
        Ok(Some(stored)) if stored.is_newest && !set_aside && is_possible(settings) => {
            log::settings_loaded(settings, stored.sequence, &stored.provenance);
            provenance = stored.provenance;
            take(board::job(), None)
        }
        not_stored => {
            match not_stored {
                Err(error) => {
                    defmt::error!("stored settings refused: {}", defmt::Display2Format(&error));
                    invalid = true;
                }
                Ok(Some(stored)) => {
                    let why = if !stored.is_newest {
                        "those stored after them are damaged"
                    } else if set_aside {
                        "three starts with them did not last"
                    } else {
                        "the board is not up to their rate_hz, counts no steps for an axis with pulses, or reads no serial encoder of an axis"
                    };
                    defmt::error!(
                        "settings number {=u32} are in the draft, and not in force: {=str}",
                        stored.sequence,
                        why
                    );
                    provenance = stored.provenance;
                    draft.copy_from(settings);
                    settings.set_default();
                    (invalid, keep_draft) = (true, true);
                }
                Ok(None) => defmt::info!("no settings are stored"),
            }
            let plan = take(board::job(), Some(settings));
            built(settings.validate(FIRMWARE_ELEMENTS));
            log::not_commissioned(settings);
            plan
        }
    };
    let plan = built(plan.build(settings));
    Loaded {
        plan,
        provenance,
        store,
        invalid,
        keep_draft,
    }
}

/// Counts this start; returns true if as many as allowed have not lasted.
pub(super) fn count_start(crashed: bool) -> bool {
    let record = board::start_record::read().begin(crashed);
    board::start_record::write(record);
    record.is_safe_start()
}

/// Takes note that this start has lasted, or that the next is asked for.
pub(crate) fn forget_starts() {
    board::start_record::write(StartRecord::default());
}

/// True if the board is up to the control rate, counts the steps that axes are to follow, and reads their serial encoders.
fn is_possible(settings: &StageSettings) -> bool {
    let has_inputs = |(axis, (counts, reads)): (&AxisSettings, (bool, bool))| {
        (counts || axis.pulses.is_none()) && (reads || axis.encoder.serial.is_none())
    };
    let inputs = board::PULSE_AXES
        .into_iter()
        .zip(<board::Encoders as Encoders>::SERIAL_AXES);
    (board::RATES_HZ.0..=board::RATES_HZ.1).contains(&settings.rate_hz)
        && settings.axes.iter().zip(inputs).all(has_inputs)
}

/// Decodes the job that the board was given: its motions, and its settings into `settings`. Without a job, there is no
/// motion, and the settings stay as they are.
#[inline(never)]
fn take(bytes: Option<&[u8]>, settings: Option<&mut StageSettings>) -> PlanSettings {
    let Some(bytes) = bytes else {
        return PlanSettings::default();
    };
    match postcard::from_bytes::<Job>(bytes) {
        Ok(job) => {
            if let Some(settings) = settings {
                settings.copy_from(&job.stage);
            }
            job.plan
        }
        Err(_) => panic!(
            "the job of {} bytes cannot be decoded: host and firmware differ in version",
            bytes.len()
        ),
    }
}

/// Unwraps a build.
///
/// # Panics
/// When settings were refused.
fn built<T>(result: Result<T, SettingsError>) -> T {
    match result {
        Ok(built) => built,
        Err(error) => panic!("settings refused: {error}"),
    }
}
