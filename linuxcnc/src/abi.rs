//! The functions that the components' C calls. Each takes the pointer that its start has given.

use std::ffi::{CStr, c_char, c_int};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use quadrant_law::axes::AxisName;
use quadrant_sim::plant::StageParameters;
use quadrant_sim::stage_file::StageFile;

use crate::board::{Board, Options, QuadrantPins};
use crate::plant::{Plant, QuadrantPlantPins};
use crate::reference::Preview;
use crate::slow::Place;

/// Parameters of the component `quadrant`, as `loadrt` has them; text may be null.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct QuadrantConfig {
    /// File that keeps stored settings.
    pub settings: *const c_char,
    /// Settings (TOML) while nothing is stored.
    pub defaults: *const c_char,
    /// The joints: `x,y,z` or some of them.
    pub joints: *const c_char,
    /// Machine units: `mm` or `inch`.
    pub units: *const c_char,
    /// Source of the counts: `rawcounts` or `position`.
    pub feedback: *const c_char,
    /// `full`, or `feedforward` for the feedforward alone.
    pub mode: *const c_char,
    /// `extrapolate` or `delay`.
    pub preview: *const c_char,
    /// Address of the link, such as `127.0.0.1`.
    pub address: *const c_char,
    /// Port of the link; 0 for none.
    pub port: c_int,
    /// Control rate while there are no settings, Hz.
    pub rate: c_int,
    /// Periods from one tick to the next above which the outputs go off; 0 for no limit.
    pub late: c_int,
}

/// Parameters of the component `quadrant_plant`; text may be null.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct QuadrantPlantConfig {
    /// Description of a stage (TOML); the simulated stage without one.
    pub file: *const c_char,
    /// File for the record.
    pub record: *const c_char,
    /// Rate of the thread, Hz.
    pub rate: c_int,
    /// Lag of amplifiers in velocity mode, us; 0 for torque mode.
    pub drive_lag_us: c_int,
    /// Seed of the noise.
    pub seed: c_int,
    /// Longest record, ticks.
    pub room: c_int,
}

/// A text parameter; an empty one is none.
///
/// # Safety
/// Null, or a text that ends with a zero and outlives the result.
unsafe fn text<'a>(pointer: *const c_char) -> io::Result<Option<&'a str>> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: as the caller says.
    let text = unsafe { CStr::from_ptr(pointer) };
    let text = text.to_str().map_err(io::Error::other)?;
    Ok((!text.is_empty()).then_some(text))
}

/// A file; `none` is none, so that an INI file can say it.
fn file(given: Option<&str>) -> Option<&Path> {
    given.filter(|given| *given != "none").map(Path::new)
}

/// Checks that a number is from `least` to `most`.
fn within(name: &str, given: c_int, [least, most]: [c_int; 2]) -> io::Result<()> {
    if (least..=most).contains(&given) {
        return Ok(());
    }
    Err(io::Error::other(format!(
        "{name}={given}: give {least} to {most}"
    )))
}

/// The choice of a parameter: the first without one.
fn choice<T: Copy>(name: &str, given: Option<&str>, choices: [(&str, T); 2]) -> io::Result<T> {
    let [(first, value), (second, _)] = choices;
    let Some(given) = given else {
        return Ok(value);
    };
    let found = choices.iter().find(|(word, _)| *word == given);
    found
        .map(|(_, value)| *value)
        .ok_or_else(|| io::Error::other(format!("{name}={given}: give {first} or {second}")))
}

/// Prints what an attempt has failed by; null then.
fn started<T>(component: &str, attempt: impl FnOnce() -> io::Result<T>) -> *mut T {
    match catch_unwind(AssertUnwindSafe(attempt)) {
        Ok(Ok(value)) => return Box::into_raw(Box::new(value)),
        Ok(Err(error)) => eprintln!("{component}: {error}"),
        Err(_) => eprintln!("{component}: failed to start"),
    }
    std::ptr::null_mut()
}

/// Starts the component; null, and a line on standard error, if it cannot.
///
/// # Safety
/// Every text ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_start(config: &QuadrantConfig) -> *mut Board {
    started("quadrant", || {
        // SAFETY: as the caller says; nothing of it is kept.
        let text = |pointer| unsafe { text(pointer) };
        within("port", config.port, [0, 65_535])?;
        within("late", config.late, [0, 1_000_000])?;
        let mut joints = [false; 3];
        for joint in text(config.joints)?.unwrap_or("x,y,z").split(',') {
            let axis = AxisName::ALL
                .into_iter()
                .find(|axis| axis.to_string() == joint)
                .ok_or_else(|| io::Error::other(format!("joints: {joint}: give x, y or z")))?;
            joints[axis as usize] = true;
        }
        let address = format!(
            "{}:{}",
            text(config.address)?.unwrap_or("127.0.0.1"),
            config.port
        );
        let place = Place {
            store: file(text(config.settings)?),
            defaults: file(text(config.defaults)?),
            address: (config.port > 0).then_some(address.as_str()),
            rate_hz: f64::from(config.rate),
        };
        let options = Options {
            joints,
            unit_mm: choice("units", text(config.units)?, [("mm", 1.0), ("inch", 25.4)])?,
            counts_of_position: choice(
                "feedback",
                text(config.feedback)?,
                [("rawcounts", false), ("position", true)],
            )?,
            feedforward_only: choice(
                "mode",
                text(config.mode)?,
                [("full", false), ("feedforward", true)],
            )?,
            preview: choice(
                "preview",
                text(config.preview)?,
                [
                    ("extrapolate", Preview::Extrapolate),
                    ("delay", Preview::Delay),
                ],
            )?,
            late_periods: u32::try_from(config.late).unwrap_or(0),
        };
        Board::start(&place, options)
    })
}

/// One period of the realtime thread.
///
/// # Safety
/// `board` is what `quadrant_start` has given, and no other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_tick(board: *mut Board, pins: &mut QuadrantPins) {
    // SAFETY: as the caller says.
    unsafe { &mut *board }.tick(pins);
}

/// Ends the component, and the threads of its slow half.
///
/// # Safety
/// `board` is what `quadrant_start` has given, or null, and is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_stop(board: *mut Board) {
    if !board.is_null() {
        // SAFETY: made by `Box::into_raw` in `started`.
        drop(unsafe { Box::from_raw(board) });
    }
}

/// Starts the simulated stage; null, and a line on standard error, if it cannot.
///
/// # Safety
/// Every text ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_plant_start(config: &QuadrantPlantConfig) -> *mut Plant {
    started("quadrant_plant", || {
        // SAFETY: as the caller says; nothing of it is kept.
        let text = |pointer| unsafe { text(pointer) };
        let mut truth = match file(text(config.file)?) {
            Some(path) => StageFile::read(path).map_err(io::Error::other)?.truth,
            None => StageParameters::real(),
        };
        within("rate", config.rate, [100, 100_000])?;
        within("drive_lag_us", config.drive_lag_us, [0, 1_000_000])?;
        // A tick of the record takes 48 bytes.
        within("room", config.room, [0, 10_000_000])?;
        if config.drive_lag_us > 0 {
            let lag_s = 1e-6 * f64::from(config.drive_lag_us);
            truth = truth.in_velocity_mode(lag_s);
        }
        Ok(Plant::new(
            &truth,
            f64::from(config.rate),
            u64::from(config.seed.unsigned_abs()),
            file(text(config.record)?).map(PathBuf::from),
            usize::try_from(config.room).unwrap_or(0),
        ))
    })
}

/// Begins a period: reads the encoders.
///
/// # Safety
/// `plant` is what `quadrant_plant_start` has given, and no other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_plant_read(plant: *mut Plant, pins: &mut QuadrantPlantPins) {
    // SAFETY: as the caller says.
    unsafe { &mut *plant }.read(pins);
}

/// Ends a period: moves the axes.
///
/// # Safety
/// As [`quadrant_plant_read`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_plant_write(plant: *mut Plant, pins: &mut QuadrantPlantPins) {
    // SAFETY: as the caller says.
    unsafe { &mut *plant }.write(pins);
}

/// Ends the simulated stage, and writes the record.
///
/// # Safety
/// `plant` is what `quadrant_plant_start` has given, or null, and is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_plant_stop(plant: *mut Plant) {
    if plant.is_null() {
        return;
    }
    // SAFETY: made by `Box::into_raw` in `started`.
    let plant = unsafe { Box::from_raw(plant) };
    if let Err(error) = plant.finish() {
        eprintln!("quadrant_plant: the record cannot be written: {error}");
    }
}
