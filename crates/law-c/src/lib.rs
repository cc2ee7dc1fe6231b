//! The control law of one axis for programs in C: `include/quadrant_law.h`, and a static library.
//!
//! The same law, bit for bit, as in a firmware in Rust: PID, and feedforward of friction and inertia, on a reference of the
//! caller's. An axis lies in memory of the caller's; nothing is allocated, and nothing waits.
//!
//! `docs/law-in-your-firmware.md` says how it is built and linked; `crates/law-c/examples/axis.c` is a program that uses it.
#![cfg_attr(target_os = "none", no_std)]

use core::mem::MaybeUninit;

use quadrant_law::axis::{Axis, AxisBuilder, AxisError, AxisState, OutputStage};
use quadrant_law::control::pid::PidGains;
use quadrant_law::encoder::{Encoder, EncoderReading};
use quadrant_law::feedforward::{FeedforwardGains, FeedforwardKind};
use quadrant_law::friction::gms::{GmsElement, GmsElements, GmsParameters};
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_law::friction::{FrictionSettings, PerDirection};
use quadrant_law::reference::ReferenceSample;
use quadrant_law::safety::monitor::Following;
use quadrant_law::units::Position;

/// Most elements of an axis' friction.
pub const QUADRANT_ELEMENTS: usize = 8;

/// Room for an axis in words of 8 bytes.
pub const QUADRANT_AXIS_WORDS: usize = 1536;

/// The content of a [`QuadrantAxis`].
struct Parts {
    axis: Axis<f32, QUADRANT_ELEMENTS>,
    state: AxisState<f32, QUADRANT_ELEMENTS>,
}

const _: () = assert!(size_of::<Parts>() <= size_of::<QuadrantAxis>());
const _: () = assert!(align_of::<Parts>() <= align_of::<QuadrantAxis>());

/// An axis, made by `quadrant_axis_build`: static memory of the caller's that only these functions read and write.
#[repr(C, align(16))]
pub struct QuadrantAxis {
    /// For the law alone.
    words: [MaybeUninit<u64>; QUADRANT_AXIS_WORDS],
}

/// Friction while the axis slides, in one sense of motion.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct QuadrantFriction {
    /// Level of fast motion without its viscous part, V.
    pub coulomb_v: f64,
    /// Level at which the axis breaks away, V.
    pub breakaway_v: f64,
    /// Velocity at which the level has gone most of the way from one to the other, mm/s; above zero.
    pub stribeck_velocity_mm_s: f64,
    /// Exponent of that velocity, above 0 and at most 4; mostly 1 or 2.
    pub exponent: f64,
    /// Friction that grows with the velocity, V s/mm.
    pub viscous_v_s_per_mm: f64,
}

/// A block of friction before it slides: a spring, and the share of the level that it takes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct QuadrantElement {
    /// Stiffness, V/mm.
    pub stiffness_v_per_mm: f64,
    /// Share of the level; the shares of all blocks add up to 1.
    pub weight: f64,
}

/// Everything that an axis is made of.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct QuadrantParameters {
    /// Length of an encoder count, mm.
    pub resolution_mm: f64,
    /// Width of the encoder's counter, 8 to 32 bits, or 0 for 32: it may wrap. Bits above it may hold anything.
    pub counter_bits: u32,
    /// Control periods per second, 1/s.
    pub rate_hz: f64,
    /// Largest output before the offset, V; at most `full_scale_v`.
    pub limit_v: f64,
    /// Voltage of the converter's largest code, V.
    pub full_scale_v: f64,
    /// Voltage at which the motor gives no force, V, at most a tenth of `full_scale_v`; it is added to every output.
    pub offset_v: f64,
    /// True if a positive voltage moves the axis to smaller counts.
    pub reversed: bool,
    /// Proportional gain, V/mm; above zero.
    pub kp_v_per_mm: f64,
    /// Integral gain, V/(mm s).
    pub ki_v_per_mm_s: f64,
    /// Derivative gain, V s/mm.
    pub kd_v_s_per_mm: f64,
    /// Time constant of the derivative's filter, s.
    pub derivative_filter_s: f64,
    /// Largest integral, V; 0 for a PD.
    pub integral_limit_v: f64,
    /// Friction towards larger positions.
    pub positive: QuadrantFriction,
    /// Friction towards smaller positions.
    pub negative: QuadrantFriction,
    /// Blocks of friction, the first `element_count` of them.
    pub elements: [QuadrantElement; QUADRANT_ELEMENTS],
    /// Number of blocks; with 0 no friction is fed forward.
    pub element_count: u32,
    /// Rate at which sliding friction follows its curve, V/s.
    pub attraction_v_s: f64,
    /// Share of friction that is fed forward; 1 for the whole of it.
    pub friction_share: f64,
    /// Inertia that is fed forward, V s^2/mm; 0 for none.
    pub inertia_v_s2_per_mm: f64,
    /// Ticks that feedforward looks ahead: the delay from the output to the encoder; at most 30.
    pub preview_ticks: u32,
    /// Speed above which the axis is at fault, mm/s; above zero.
    pub overspeed_mm_s: f64,
    /// Error at rest above which the axis is at fault, mm; above zero.
    pub following_error_mm: f64,
    /// Growth of that error with the speed of the reference, s.
    pub following_lag_s: f64,
}

/// A point of the reference: where it is to be `preview_ticks` from now. The axis delays it for its feedback by itself.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct QuadrantReference {
    /// Position, 1/65536 of a count, from where the encoder was first read.
    pub position: i64,
    /// Velocity, mm/s.
    pub velocity_mm_s: f32,
    /// Acceleration, mm/s^2.
    pub acceleration_mm_s2: f32,
}

/// The part that an axis cannot be made with.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuadrantError {
    /// None: the axis is made.
    None = 0,
    /// `resolution_mm` is not above zero.
    Resolution = 1,
    /// `rate_hz` is not above zero.
    Rate = 2,
    /// `limit_v` is not above zero and within `full_scale_v`, or `offset_v` is more than a tenth of that.
    OutputLimit = 3,
    /// `preview_ticks` is too large.
    Preview = 4,
    /// More elements than `QUADRANT_ELEMENTS`.
    Elements = 5,
    /// A number is infinite or none.
    NotFinite = 6,
    /// A gain of the PID, or `integral_limit_v`, is negative, or `kp_v_per_mm` is zero.
    Gains = 7,
    /// Friction that cannot be: a negative level, share, stiffness or inertia, a velocity or an exponent out of its range, or weights that do
    /// not add up to 1.
    Friction = 8,
    /// `overspeed_mm_s` or `following_error_mm` is not above zero, or `following_lag_s` is negative.
    Monitor = 9,
    /// `counter_bits` is not 0 and not 8 to 32.
    CounterBits = 10,
}

impl From<AxisError> for QuadrantError {
    fn from(error: AxisError) -> Self {
        match error {
            AxisError::Resolution(_) => Self::Resolution,
            AxisError::Period(_) => Self::Rate,
            AxisError::OutputLimit(_) => Self::OutputLimit,
            AxisError::Preview(_) => Self::Preview,
            AxisError::Bumpless(_) => Self::NotFinite,
            AxisError::Gains => Self::Gains,
        }
    }
}

impl QuadrantFriction {
    fn numbers(&self) -> [f64; 5] {
        [
            self.coulomb_v,
            self.breakaway_v,
            self.stribeck_velocity_mm_s,
            self.exponent,
            self.viscous_v_s_per_mm,
        ]
    }

    fn is_valid(&self) -> bool {
        self.coulomb_v >= 0.0
            && self.breakaway_v >= 0.0
            && self.stribeck_velocity_mm_s > 0.0
            && self.exponent > 0.0
            && self.exponent <= 4.0
            && self.viscous_v_s_per_mm >= 0.0
    }

    fn sliding(&self) -> StaticFriction {
        StaticFriction {
            curve: StribeckCurve {
                coulomb_v: self.coulomb_v,
                breakaway_v: self.breakaway_v,
                stribeck_velocity_mm_s: self.stribeck_velocity_mm_s,
                exponent: self.exponent,
            },
            viscous_v_s_per_mm: self.viscous_v_s_per_mm,
        }
    }
}

impl QuadrantParameters {
    fn is_finite(&self) -> bool {
        let own = [
            self.resolution_mm,
            self.rate_hz,
            self.limit_v,
            self.full_scale_v,
            self.offset_v,
            self.kp_v_per_mm,
            self.ki_v_per_mm_s,
            self.kd_v_s_per_mm,
            self.derivative_filter_s,
            self.integral_limit_v,
            self.attraction_v_s,
            self.friction_share,
            self.inertia_v_s2_per_mm,
            self.overspeed_mm_s,
            self.following_error_mm,
            self.following_lag_s,
        ];
        let elements = self.elements.iter().take(self.element_count as usize);
        own.into_iter()
            .chain(self.positive.numbers())
            .chain(self.negative.numbers())
            .chain(elements.flat_map(|element| [element.stiffness_v_per_mm, element.weight]))
            .all(f64::is_finite)
    }

    /// True for friction that can be; any where none is fed forward.
    fn is_friction(&self, elements: &[QuadrantElement]) -> bool {
        let sum: f64 = elements.iter().map(|element| element.weight).sum();
        let has_elements = (sum - 1.0).abs() < 1e-3
            && elements
                .iter()
                .all(|element| element.weight >= 0.0 && element.stiffness_v_per_mm > 0.0);
        self.inertia_v_s2_per_mm >= 0.0
            && (elements.is_empty()
                || has_elements
                    && self.positive.is_valid()
                    && self.negative.is_valid()
                    && self.attraction_v_s >= 0.0
                    && self.friction_share >= 0.0)
    }

    /// The first part that cannot be, of those that the builder does not look at.
    fn check(&self, elements: &[QuadrantElement]) -> Result<(), QuadrantError> {
        let is_monitor = self.overspeed_mm_s > 0.0
            && self.following_error_mm > 0.0
            && self.following_lag_s >= 0.0;
        let checks = [
            (self.is_finite(), QuadrantError::NotFinite),
            (
                matches!(self.counter_bits, 0 | 8..=32),
                QuadrantError::CounterBits,
            ),
            (
                self.offset_v.abs() <= 0.1 * self.full_scale_v,
                QuadrantError::OutputLimit,
            ),
            (self.is_friction(elements), QuadrantError::Friction),
            (is_monitor, QuadrantError::Monitor),
        ];
        let found = checks.into_iter().find(|(holds, _)| !holds);
        found.map_or(Ok(()), |(_, error)| Err(error))
    }

    fn build(&self, axis: &mut Axis<f32, QUADRANT_ELEMENTS>) -> Result<(), QuadrantError> {
        let elements = self
            .elements
            .get(..self.element_count as usize)
            .ok_or(QuadrantError::Elements)?;
        self.check(elements)?;
        let elements: GmsElements = elements
            .iter()
            .map(|element| GmsElement {
                stiffness_v_per_mm: element.stiffness_v_per_mm,
                weight: element.weight,
            })
            .collect();
        let kind = if elements.is_empty() {
            FeedforwardKind::None
        } else {
            FeedforwardKind::Combined
        };
        let gms = GmsParameters {
            elements,
            attraction_v_s: self.attraction_v_s,
        };
        let friction = FrictionSettings {
            sliding: PerDirection {
                positive: self.positive.sliding(),
                negative: self.negative.sliding(),
            },
            ..FrictionSettings::new(self.positive.sliding(), gms)
        };
        let share = FeedforwardGains {
            level: self.friction_share,
            viscous: self.friction_share,
            presliding: self.friction_share,
            inertia_v_s2_per_mm: self.inertia_v_s2_per_mm,
        };
        let gains = PidGains {
            kp_v_per_mm: self.kp_v_per_mm,
            ki_v_per_mm_s: self.ki_v_per_mm_s,
            kd_v_s_per_mm: self.kd_v_s_per_mm,
            derivative_filter_s: self.derivative_filter_s,
        };
        let (error_mm, lag_s) = (self.following_error_mm, self.following_lag_s);
        let period_s = 1.0 / self.rate_hz;
        let bits = if self.counter_bits == 0 {
            32
        } else {
            self.counter_bits
        };
        AxisBuilder::new(axis, self.resolution_mm, period_s)
            .encoder(Encoder::new(bits, false, i32::MAX))
            .output(OutputStage {
                limit_v: self.limit_v,
                full_scale_v: self.full_scale_v,
                offset_v: self.offset_v,
                reversed: self.reversed,
            })
            .pid(&gains, self.integral_limit_v)
            .feedforward(kind, &share, &friction, self.preview_ticks as usize)
            .overspeed_mm_s(self.overspeed_mm_s)
            .following(Following::new(
                error_mm,
                lag_s,
                error_mm + lag_s * self.overspeed_mm_s,
            ))
            .try_build()?;
        Ok(())
    }
}

/// The parts of an axis that `quadrant_axis_build` has made.
///
/// # Safety
/// `axis` is that of an axis that was made, and nothing else uses it meanwhile.
unsafe fn parts<'a>(axis: *mut QuadrantAxis) -> &'a mut Parts {
    // SAFETY: the memory is large enough and aligned (above); the caller says that `Parts` lie there and are not shared.
    unsafe { &mut *axis.cast::<Parts>() }
}

/// Makes an axis in `axis`, which may be uninitialised; it holds where its encoder is first read. Takes milliseconds: not for an
/// interrupt. A refused axis is made too, and puts out nothing.
///
/// # Safety
/// `axis` and `parameters` point to one of these each, and nothing else uses the axis meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_axis_build(
    axis: *mut QuadrantAxis,
    parameters: *const QuadrantParameters,
) -> QuadrantError {
    // SAFETY: large enough and aligned (above), for the caller is to pass memory of that type; a write needs nothing there.
    unsafe {
        axis.cast::<Parts>().write(Parts {
            axis: Axis::blank(),
            state: AxisState::default(),
        });
    }
    // SAFETY: written above; the parameters are the caller's promise.
    let (parts, parameters) = unsafe { (parts(axis), &*parameters) };
    match parameters.build(&mut parts.axis) {
        Ok(()) => {
            parts.axis.hold_here(&mut parts.state);
            QuadrantError::None
        }
        Err(error) => {
            parts.axis = Axis::blank();
            error
        }
    }
}

/// Prepares the axis to hold where its encoder stands, and forgets what went before: in every period that the outputs are off, after
/// `quadrant_axis_tick`. When they are switched on the reference begins at `quadrant_axis_position`.
///
/// # Safety
/// `axis` was made by `quadrant_axis_build`, and nothing else uses it meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_axis_hold_here(axis: *mut QuadrantAxis) {
    // SAFETY: the caller's promise.
    let parts = unsafe { parts(axis) };
    parts.axis.hold_here(&mut parts.state);
}

/// Measured position of the axis, 1/65536 of a count: where a reference begins after `quadrant_axis_hold_here`.
///
/// # Safety
/// `axis` was made by `quadrant_axis_build`, and nothing else uses it meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_axis_position(axis: *mut QuadrantAxis) -> i64 {
    // SAFETY: the caller's promise.
    let parts = unsafe { parts(axis) };
    parts.state.telemetry().measured.position().0
}

/// One control period: the counter of the encoder and the reference in, the converter's word out, -32768 to 32767. Returns the number
/// of the fault (`docs/safety.md`), 0 for none. With a fault the word is 0, and the caller switches the amplifier off and keeps the fault: the
/// axis does not, and may put out again in the next period. A reference that is no finite number is fault 1, following error.
///
/// Also call it in every period that the outputs are off, so that the encoder is followed: with a reference that stands at
/// `quadrant_axis_position`, and `quadrant_axis_hold_here` after it. What it returns then does not matter.
///
/// # Safety
/// `axis` was made by `quadrant_axis_build`, nothing else uses it meanwhile, and `reference` and `word` point to one of these each.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_axis_tick(
    axis: *mut QuadrantAxis,
    reference: *const QuadrantReference,
    count: u32,
    word: *mut i16,
) -> u8 {
    // SAFETY: the caller's promise.
    let (parts, reference) = unsafe { (parts(axis), &*reference) };
    let ahead = ReferenceSample {
        position: Position(reference.position),
        velocity: reference.velocity_mm_s,
        acceleration: reference.acceleration_mm_s2,
    };
    let result = parts
        .axis
        .follow(&mut parts.state, &ahead, &EncoderReading::of(count));
    // SAFETY: the caller's promise.
    unsafe { word.write(result.map_or(0, |code| code.0)) };
    result.map_or_else(|fault| fault as u8, |_| 0)
}

/// Tracking error of the last period, mm.
///
/// # Safety
/// `axis` was made by `quadrant_axis_build`, and nothing else uses it meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn quadrant_axis_error_mm(axis: *mut QuadrantAxis) -> f32 {
    // SAFETY: the caller's promise.
    let parts = unsafe { parts(axis) };
    parts.state.telemetry().error_mm()
}

/// Nothing that the law does panics; a static library has to name what would happen.
#[cfg(all(target_os = "none", not(test)))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
