//! Faults of the component besides the law's: number on the pins, cause and remedy.

use quadrant_law::safety::FaultCode;

/// The outputs could not be enabled: no axis is commissioned, the settings are damaged, or an axis moves.
pub const NOT_ENABLED: i32 = 100;
/// A joint no longer follows LinuxCNC: a host has stopped it, or its settings want it homed by the law.
pub const ENDED: i32 = 101;
/// The thread's period is not the one that the settings are for.
pub const OTHER_PERIOD: i32 = 102;
/// The command is no number, or faster than 100 m/s.
pub const NO_NUMBER: i32 = 103;
/// A host drove the axes when LinuxCNC's machine was switched on.
pub const HOST_DRIVES: i32 = 104;
/// Position and count do not grow together as the settings' resolution says.
pub const OTHER_SCALE: i32 = 105;

/// Cause and remedy of a fault on the pins; none of a number that is no fault.
pub fn text(number: i32) -> Option<[&'static str; 2]> {
    Some(match number {
        NOT_ENABLED => [
            "the outputs could not be enabled: a joint has no law, the settings are damaged, an axis moves, or a host measures",
            "commission every joint, or leave it out of joints=",
        ],
        ENDED => [
            "a joint no longer follows LinuxCNC: a host has stopped it, or limits.unhomed_mm_s is set",
            "remove that setting, machine off and on",
        ],
        OTHER_PERIOD => [
            "the thread's period is not that of the settings",
            "make rate_hz and SERVO_PERIOD agree",
        ],
        NO_NUMBER => [
            "a command is no number, or faster than 100 m/s",
            "check kinematics and the pins of the command",
        ],
        HOST_DRIVES => [
            "a host drove the axes when LinuxCNC's machine was switched on, so that all outputs went off",
            "end the commissioning or motion, then machine on",
        ],
        OTHER_SCALE => [
            "position-fb does not move with rawcounts as encoder.resolution_mm and encoder.reversed say",
            "correct them, or the encoder's scale in the INI file",
        ],
        law => {
            let code = FaultCode::from_number(u8::try_from(law).ok()?)?;
            [code.cause(), code.remedy()]
        }
    })
}
