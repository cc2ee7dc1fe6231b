//! The header is what the library exports, and a program in C that uses both gets the words of the law in Rust.

use std::path::{Path, PathBuf};
use std::process::Command;

use quadrant_law::axis::{Axis, AxisState, OutputStage};
use quadrant_law::control::pid::PidGains;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::feedforward::{FeedforwardGains, FeedforwardKind};
use quadrant_law::friction::FrictionSettings;
use quadrant_law::friction::gms::GmsParameters;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_law::reference::{MotionScale, ReferenceSample};
use quadrant_law::safety::monitor::Following;
use quadrant_law::units::Position;
use quadrant_law_c::{
    QuadrantAxis, QuadrantElement, QuadrantError, QuadrantFriction, QuadrantParameters,
    QuadrantReference, quadrant_axis_build, quadrant_axis_position, quadrant_axis_tick,
};

fn package() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Set: the header is written again.
const RENEW: &str = "QUADRANT_RENEW_HEADER";

#[test]
fn the_header_says_what_the_library_exports() {
    let path = package().join("include/quadrant_law.h");
    let mut made = Vec::new();
    let config = cbindgen::Config::from_file(package().join("cbindgen.toml")).expect("a config");
    cbindgen::generate_with_config(package(), config)
        .expect("exports")
        .write(&mut made);
    let made = String::from_utf8(made).expect("text");
    if std::env::var_os(RENEW).is_some() {
        std::fs::write(&path, &made).expect("writes");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        made == kept,
        "include/quadrant_law.h is not of src/lib.rs; {RENEW}=1 cargo test -p quadrant-law-c writes it"
    );
}

/// The static library that was built with this test: the newest beside it.
fn library() -> PathBuf {
    let own = std::env::current_exe().expect("a path");
    let files = own
        .parent()
        .expect("a folder")
        .read_dir()
        .expect("readable");
    let built = files.flatten().map(|file| file.path()).filter(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("libquadrant_law_c-") && name.ends_with(".a")
    });
    let written = |path: &PathBuf| {
        path.metadata()
            .and_then(|of| of.modified())
            .expect("a time")
    };
    built.max_by_key(written).expect("a static library")
}

/// Builds `crates/law-c/examples/axis.c` and returns what it prints with these arguments.
fn example(arguments: &[&str]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("axis");
    let built = Command::new("cc")
        .args([
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-O2",
            "-ffp-contract=off",
        ])
        .arg("-I")
        .arg(package().join("include"))
        .arg(package().join("examples/axis.c"))
        .arg(library())
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(&program)
        .output()
        .expect("a C compiler: apt install gcc");
    assert!(
        built.status.success(),
        "{}",
        String::from_utf8_lossy(&built.stderr)
    );
    let run = Command::new(program)
        .args(arguments)
        .output()
        .expect("runs");
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    String::from_utf8(run.stdout).expect("text")
}

/// The words of the same axis, mass and sine in Rust.
fn words() -> Vec<i16> {
    const SCALE: MotionScale = MotionScale::new(0.5e-3, 10e3);
    let sliding = StaticFriction {
        curve: StribeckCurve {
            coulomb_v: 0.12,
            breakaway_v: 0.15,
            stribeck_velocity_mm_s: 1.0,
            exponent: 1.0,
        },
        viscous_v_s_per_mm: 2.09e-3,
    };
    let blocks = [(21.4, 0.30), (7.5, 0.30), (2.66, 0.25), (0.75, 0.15)];
    let friction = FrictionSettings::new(sliding, GmsParameters::new(blocks, 5.0));
    let gains = PidGains {
        kp_v_per_mm: 1.118,
        ki_v_per_mm_s: 0.74,
        kd_v_s_per_mm: 5.537e-3,
        derivative_filter_s: 52e-6,
    };
    let axis = Axis::<f32>::build(SCALE, |axis| {
        let whole = FeedforwardGains::whole(1.0 / 69390.0);
        axis.output(OutputStage::limited_to(9.0))
            .pid(&gains, 2.0)
            .feedforward(FeedforwardKind::Combined, &whole, &friction, 0)
            .overspeed_mm_s(250.0)
            .following(Following::new(0.5, 0.02, 5.5))
    })
    .expect("valid");
    let mut state = AxisState::default();
    axis.hold_here(&mut state);
    let (period, frequency) = (1e-4, 2.0);
    let (mut sine, mut mass, mut spring) = ([0.0, 5.0], [0.0, 0.0], 0.0_f64);
    (0..80_000)
        .map(|_| {
            let ahead = ReferenceSample {
                position: Position((sine[0] / SCALE.resolution_mm * 65536.0) as i64),
                velocity: sine[1] as f32,
                acceleration: (-frequency * frequency * sine[0]) as f32,
            };
            let count = (mass[0] / SCALE.resolution_mm) as i32 as u32;
            let code = axis
                .follow(&mut state, &ahead, &EncoderReading::of(count))
                .expect("no fault");
            spring = (spring + 20.0 * period * mass[1]).clamp(-0.12, 0.12);
            let driven = f64::from(code.0) / 32767.0 * 10.0 - spring - 2.09e-3 * mass[1];
            mass[1] += period * 69390.0 * driven;
            mass[0] += period * mass[1];
            sine[1] -= period * frequency * frequency * sine[0];
            sine[0] += period * sine[1];
            code.0
        })
        .collect()
}

#[test]
fn a_program_in_c_gets_the_words_of_the_law_in_rust() {
    let printed = example(&["words"]);
    let printed: Vec<i16> = printed
        .lines()
        .map(|line| line.parse().expect("a word"))
        .collect();
    let words = words();
    assert_eq!(printed.len(), words.len());
    let differs = printed.iter().zip(&words).position(|(c, rust)| c != rust);
    assert_eq!(differs, None, "the first tick that differs");
    let largest = words.iter().map(|word| word.unsigned_abs()).max();
    assert!(largest > Some(300), "{largest:?}");
}

#[test]
fn the_example_in_c_shows_what_feedforward_gains() {
    let error_um = |arguments: &[&str]| -> f64 {
        let printed = example(arguments);
        let text = printed.trim().strip_prefix("largest error ");
        let number = text
            .and_then(|rest| rest.strip_suffix(" um"))
            .expect("an error");
        number.parse().expect("a number")
    };
    let (with, without) = (error_um(&[]), error_um(&["pid"]));
    assert!(
        (25.0..27.0).contains(&with) && (157.0..160.0).contains(&without),
        "{with} and {without} um"
    );
}

/// An axis without feedforward.
fn usual() -> QuadrantParameters {
    QuadrantParameters {
        resolution_mm: 0.5e-3,
        rate_hz: 1e4,
        limit_v: 10.0,
        full_scale_v: 10.0,
        kp_v_per_mm: 1.0,
        derivative_filter_s: 1e-4,
        overspeed_mm_s: 100.0,
        following_error_mm: 1.0,
        ..QuadrantParameters::default()
    }
}

/// The answer of `quadrant_axis_build` to parameters, and the first fault and word of the axis 100 counts away from its reference.
fn made(change: impl FnOnce(&mut QuadrantParameters)) -> (QuadrantError, u8, i16) {
    let mut parameters = usual();
    change(&mut parameters);
    let mut axis = Box::<QuadrantAxis>::new_uninit();
    let mut word = 1;
    let reference = QuadrantReference {
        position: 100 << 16,
        ..Default::default()
    };
    // SAFETY: memory of these types, used by nothing else; the axis is made before it is ticked.
    unsafe {
        let error = quadrant_axis_build(axis.as_mut_ptr(), &raw const parameters);
        let fault = quadrant_axis_tick(axis.as_mut_ptr(), &raw const reference, 0, &raw mut word);
        (error, fault, word)
    }
}

/// Friction that can be, of one element.
fn feeds(parameters: &mut QuadrantParameters) -> &mut QuadrantParameters {
    let friction = QuadrantFriction {
        coulomb_v: 0.1,
        breakaway_v: 0.15,
        stribeck_velocity_mm_s: 1.0,
        exponent: 1.0,
        viscous_v_s_per_mm: 1e-3,
    };
    (parameters.positive, parameters.negative) = (friction, friction);
    parameters.elements[0] = QuadrantElement {
        stiffness_v_per_mm: 10.0,
        weight: 1.0,
    };
    (parameters.element_count, parameters.friction_share) = (1, 1.0);
    parameters
}

#[test]
fn a_refused_axis_says_why_and_puts_out_nothing() {
    assert_eq!(made(|_| ()), (QuadrantError::None, 0, 164));
    assert_eq!(made(|of| _ = feeds(of)).0, QuadrantError::None);
    // What is in elements beyond their number does not matter.
    assert_eq!(
        made(|of| of.elements[7].weight = f64::NAN).0,
        QuadrantError::None
    );
    type Change = fn(&mut QuadrantParameters);
    let refused: [(Change, QuadrantError); 17] = [
        (|of| of.resolution_mm = 0.0, QuadrantError::Resolution),
        (|of| of.rate_hz = -1.0, QuadrantError::Rate),
        (|of| of.limit_v = 11.0, QuadrantError::OutputLimit),
        (|of| of.preview_ticks = 31, QuadrantError::Preview),
        (|of| of.element_count = 9, QuadrantError::Elements),
        (|of| of.kp_v_per_mm = f64::NAN, QuadrantError::NotFinite),
        (|of| of.ki_v_per_mm_s = -1.0, QuadrantError::Gains),
        (|of| of.offset_v = 1.1, QuadrantError::OutputLimit),
        (|of| of.inertia_v_s2_per_mm = -1.0, QuadrantError::Friction),
        (
            |of| feeds(of).elements[0].weight = 1.1,
            QuadrantError::Friction,
        ),
        (
            |of| feeds(of).positive.coulomb_v = -0.1,
            QuadrantError::Friction,
        ),
        (
            |of| feeds(of).negative.exponent = 0.0,
            QuadrantError::Friction,
        ),
        (
            |of| feeds(of).attraction_v_s = -5.0,
            QuadrantError::Friction,
        ),
        (|of| of.overspeed_mm_s = 0.0, QuadrantError::Monitor),
        (|of| of.following_lag_s = -0.1, QuadrantError::Monitor),
        (|of| of.counter_bits = 33, QuadrantError::CounterBits),
        (
            |of| feeds(of).elements[0].weight = f64::INFINITY,
            QuadrantError::NotFinite,
        ),
    ];
    for (change, error) in refused {
        let (said, _, word) = made(change);
        assert_eq!((said, word), (error, 0));
    }
}

#[test]
fn an_axis_that_does_not_follow_is_at_fault_and_puts_out_nothing() {
    let (error, fault, word) = made(|of| of.following_error_mm = 0.01);
    assert_eq!((error, fault, word), (QuadrantError::None, 1, 0));
}

#[test]
fn a_reference_that_is_no_number_is_a_fault() {
    for (velocity_mm_s, acceleration_mm_s2) in
        [(f32::NAN, 0.0), (f32::INFINITY, 0.0), (0.0, f32::NAN)]
    {
        let ticked = ticks(|_| (), &[(0, velocity_mm_s, acceleration_mm_s2)]);
        assert_eq!(ticked, [(1, 0, 0)]);
    }
}

#[test]
fn a_counter_of_16_bits_may_wrap() {
    let counts = [0xFFF0, 0xFFFF, 0x0005, 0x000F].map(|count| (count, 0.0, 0.0));
    let positions = ticks(
        |of| (of.counter_bits, of.following_error_mm) = (16, 10.0),
        &counts,
    );
    let positions = positions.map(|(fault, _, position)| (fault, position >> 16));
    assert_eq!(positions, [(0, 0), (0, 15), (0, 21), (0, 31)]);
}

/// Fault, word and position of an axis whose reference stands, tick by tick, at these counts, velocities and accelerations.
fn ticks<const N: usize>(
    change: impl FnOnce(&mut QuadrantParameters),
    inputs: &[(u32, f32, f32); N],
) -> [(u8, i16, i64); N] {
    let mut parameters = usual();
    change(&mut parameters);
    let mut axis = Box::<QuadrantAxis>::new_uninit();
    // SAFETY: memory of these types, used by nothing else; the axis is made before it is ticked.
    let error = unsafe { quadrant_axis_build(axis.as_mut_ptr(), &raw const parameters) };
    assert_eq!(error, QuadrantError::None);
    inputs.map(|(count, velocity_mm_s, acceleration_mm_s2)| {
        let reference = QuadrantReference {
            position: 0,
            velocity_mm_s,
            acceleration_mm_s2,
        };
        let mut word = 1;
        // SAFETY: as above.
        let (fault, position) = unsafe {
            let fault = quadrant_axis_tick(
                axis.as_mut_ptr(),
                &raw const reference,
                count,
                &raw mut word,
            );
            (fault, quadrant_axis_position(axis.as_mut_ptr()))
        };
        (fault, word, position)
    })
}
