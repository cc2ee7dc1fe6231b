//! `quadrant new --from-linuxcnc`: settings from a configuration of LinuxCNC.

use crate::command;
use std::fs;
use std::path::Path;

use quadrant_settings::StageSettings;
use quadrant_sim::settings_file::SettingsFile;

const INI: &str = "[EMCMOT]\nSERVO_PERIOD = 500000\n[HAL]\nHALFILE = card.hal\nHALFILE = gone.hal\n[TRAJ]\nLINEAR_UNITS = inch\n\
                   [KINS]\nKINEMATICS = trivkins coordinates=XZA\n#INCLUDE z.inc\n[JOINT_0]\nMIN_LIMIT = -4\nMAX_LIMIT = 6\n\
                   MAX_VELOCITY = 2\nMAX_ACCELERATION = 20\nENC = -50800\nOUTPUT_SCALE = 10\nMAX_OUTPUT = 8\nP = 25.4\nFF1 = 0.1\n\
                   BACKLASH = 0.001\nFERROR = 0.1\nMIN_FERROR = 0.02\nHOME_SEARCH_VEL = 1\n[JOINT_2]\nTYPE = ANGULAR\n";
const INCLUDED: &str =
    "[JOINT_1]\nTYPE = LINEAR\nENCODER_SCALE = 25400 0\nOUTPUT_SCALE = 50\nP = 3\n";
const HAL: &str = "setp card.0.encoder.00.scale [JOINT_0](ENC) # counts an inch\n\
                   net x-fb card.0.encoder.00.position => pid.x.feedback \\\n joint.0.motor-pos-fb\n\
                   net x-out pid.x.output => card.0.pwmgen.00.value\nsetp card.0.pwmgen.00.scale [JOINT_0]OUTPUT_SCALE\n";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("machine.ini", INI), ("z.inc", INCLUDED), ("card.hal", HAL)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn read(at: &Path) -> StageSettings {
    SettingsFile::read(&at.join("stage.toml")).unwrap().stage
}

#[test]
fn scales_limits_and_gains_come_from_ini_and_hal_in_mm_with_their_origins() {
    let folder = folder();
    let at = folder.path();
    let shown = command::succeed(at, &["new", "--from-linuxcnc", "machine.ini"]);
    let stage = read(at);
    assert_eq!(stage.rate_hz, 2000.0);
    let [x, y, z] = &stage.axes;
    let close = |found: f64, expected: f64| {
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    };
    close(x.encoder.resolution_mm, 0.0005);
    assert!(x.encoder.reversed && x.encoder.counter_bits == 32 && !x.commissioned);
    let travel = x.limits.travel_mm.unwrap();
    close(travel.negative, -101.6);
    close(travel.positive, 152.4);
    close(x.limits.max_velocity_mm_s, 50.8);
    close(x.limits.max_acceleration_mm_s2, 508.0);
    close(x.limits.following_error_mm, 0.508);
    close(x.limits.following_error_max_mm, 2.54);
    close(x.limits.following_error_lag_s, 0.05);
    close(x.amplifier.output_limit_v, 8.0);
    close(x.feedback.pid.kp_v_per_mm, 1.0);
    close(z.encoder.resolution_mm, 0.001);
    // Its output is no voltage, so that its gain is none in volts.
    let defaults = StageSettings::default();
    assert_eq!(
        z.feedback.pid.kp_v_per_mm,
        defaults.axes[2].feedback.pid.kp_v_per_mm
    );
    assert_eq!(y.limits, defaults.axes[1].limits);
    for part in [
        "not read: [HAL]HALFILE = gone.hal",
        "x: encoder.reversed = true: setp card.0.encoder.00.scale = -50800",
        "x: limits.travel_mm.negative = -101.6: [JOINT_0]MIN_LIMIT = -4",
        "x: velocity is fed forward",
        "x: backlash stays LinuxCNC's to compensate: [JOINT_0]BACKLASH = 0.001",
        "z: limits.travel_mm.positive = 200: not found, the default",
        "[JOINT_1]OUTPUT_SCALE = 50 is no voltage: set it to 10,",
        "joint 2 (a): left out",
    ] {
        assert!(shown.contains(part), "{part}\n{shown}");
    }
}

#[test]
fn what_is_no_configuration_is_refused() {
    let folder = folder();
    let at = folder.path();
    let said = command::fail(at, &["new", "--from-linuxcnc", "gone.ini"]);
    assert!(said.contains("gone.ini"), "{said}");
    fs::write(
        at.join("turns.ini"),
        "[KINS]\nKINEMATICS = trivkins coordinates=A\n",
    )
    .unwrap();
    let said = command::fail(at, &["new", "--from-linuxcnc", "turns.ini"]);
    assert!(said.contains("no linear joint"), "{said}");
    let said = command::fail(
        at,
        &["new", "--from-linuxcnc", "machine.ini", "--lead-mm", "5"],
    );
    assert!(said.contains("--lead-mm"), "{said}");
    fs::write(at.join("slow.ini"), INI.replace("500000", "5000000")).unwrap();
    let said = command::fail(at, &["new", "--from-linuxcnc", "slow.ini"]);
    assert!(
        said.contains("rate_hz = 200") && !at.join("stage.toml").exists(),
        "{said}"
    );
}
