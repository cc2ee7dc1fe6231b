/* The control law of one servo axis in C. Made from crates/law-c/src/lib.rs; do not edit. */

#ifndef QUADRANT_LAW_H
#define QUADRANT_LAW_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#if defined(__GNUC__) || defined(__clang__)
#define QUADRANT_ALIGNED(bytes) __attribute__((aligned(bytes)))
#else
#define QUADRANT_ALIGNED(bytes) __declspec(align(bytes))
#endif

// Most elements of an axis' friction.
#define QUADRANT_ELEMENTS 8

// Room for an axis in words of 8 bytes.
#define QUADRANT_AXIS_WORDS 1536

// The part that an axis cannot be made with.
typedef enum QuadrantError {
  // None: the axis is made.
  QUADRANT_ERROR_NONE = 0,
  // `resolution_mm` is not above zero.
  QUADRANT_ERROR_RESOLUTION = 1,
  // `rate_hz` is not above zero.
  QUADRANT_ERROR_RATE = 2,
  // `limit_v` is not above zero and within `full_scale_v`, or `offset_v` is more than a tenth of that.
  QUADRANT_ERROR_OUTPUT_LIMIT = 3,
  // `preview_ticks` is too large.
  QUADRANT_ERROR_PREVIEW = 4,
  // More elements than `QUADRANT_ELEMENTS`.
  QUADRANT_ERROR_ELEMENTS = 5,
  // A number is infinite or none.
  QUADRANT_ERROR_NOT_FINITE = 6,
  // A gain of the PID, or `integral_limit_v`, is negative, or `kp_v_per_mm` is zero.
  QUADRANT_ERROR_GAINS = 7,
  // Friction that cannot be: a negative level, share, stiffness or inertia, a velocity or an exponent out of its range, or weights that do
  // not add up to 1.
  QUADRANT_ERROR_FRICTION = 8,
  // `overspeed_mm_s` or `following_error_mm` is not above zero, or `following_lag_s` is negative.
  QUADRANT_ERROR_MONITOR = 9,
  // `counter_bits` is not 0 and not 8 to 32.
  QUADRANT_ERROR_COUNTER_BITS = 10,
} QuadrantError;

// An axis, made by `quadrant_axis_build`: static memory of the caller's that only these functions read and write.
typedef struct QUADRANT_ALIGNED(16) QuadrantAxis {
  // For the law alone.
  uint64_t words[QUADRANT_AXIS_WORDS];
} QuadrantAxis;

// Friction while the axis slides, in one sense of motion.
typedef struct QuadrantFriction {
  // Level of fast motion without its viscous part, V.
  double coulomb_v;
  // Level at which the axis breaks away, V.
  double breakaway_v;
  // Velocity at which the level has gone most of the way from one to the other, mm/s; above zero.
  double stribeck_velocity_mm_s;
  // Exponent of that velocity, above 0 and at most 4; mostly 1 or 2.
  double exponent;
  // Friction that grows with the velocity, V s/mm.
  double viscous_v_s_per_mm;
} QuadrantFriction;

// A block of friction before it slides: a spring, and the share of the level that it takes.
typedef struct QuadrantElement {
  // Stiffness, V/mm.
  double stiffness_v_per_mm;
  // Share of the level; the shares of all blocks add up to 1.
  double weight;
} QuadrantElement;

// Everything that an axis is made of.
typedef struct QuadrantParameters {
  // Length of an encoder count, mm.
  double resolution_mm;
  // Width of the encoder's counter, 8 to 32 bits, or 0 for 32: it may wrap. Bits above it may hold anything.
  uint32_t counter_bits;
  // Control periods per second, 1/s.
  double rate_hz;
  // Largest output before the offset, V; at most `full_scale_v`.
  double limit_v;
  // Voltage of the converter's largest code, V.
  double full_scale_v;
  // Voltage at which the motor gives no force, V, at most a tenth of `full_scale_v`; it is added to every output.
  double offset_v;
  // True if a positive voltage moves the axis to smaller counts.
  bool reversed;
  // Proportional gain, V/mm; above zero.
  double kp_v_per_mm;
  // Integral gain, V/(mm s).
  double ki_v_per_mm_s;
  // Derivative gain, V s/mm.
  double kd_v_s_per_mm;
  // Time constant of the derivative's filter, s.
  double derivative_filter_s;
  // Largest integral, V; 0 for a PD.
  double integral_limit_v;
  // Friction towards larger positions.
  struct QuadrantFriction positive;
  // Friction towards smaller positions.
  struct QuadrantFriction negative;
  // Blocks of friction, the first `element_count` of them.
  struct QuadrantElement elements[QUADRANT_ELEMENTS];
  // Number of blocks; with 0 no friction is fed forward.
  uint32_t element_count;
  // Rate at which sliding friction follows its curve, V/s.
  double attraction_v_s;
  // Share of friction that is fed forward; 1 for the whole of it.
  double friction_share;
  // Inertia that is fed forward, V s^2/mm; 0 for none.
  double inertia_v_s2_per_mm;
  // Ticks that feedforward looks ahead: the delay from the output to the encoder; at most 30.
  uint32_t preview_ticks;
  // Speed above which the axis is at fault, mm/s; above zero.
  double overspeed_mm_s;
  // Error at rest above which the axis is at fault, mm; above zero.
  double following_error_mm;
  // Growth of that error with the speed of the reference, s.
  double following_lag_s;
} QuadrantParameters;

// A point of the reference: where it is to be `preview_ticks` from now. The axis delays it for its feedback by itself.
typedef struct QuadrantReference {
  // Position, 1/65536 of a count, from where the encoder was first read.
  int64_t position;
  // Velocity, mm/s.
  float velocity_mm_s;
  // Acceleration, mm/s^2.
  float acceleration_mm_s2;
} QuadrantReference;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Makes an axis in `axis`, which may be uninitialised; it holds where its encoder is first read. Takes milliseconds: not for an
// interrupt. A refused axis is made too, and puts out nothing.
//
// # Safety
// `axis` and `parameters` point to one of these each, and nothing else uses the axis meanwhile.
enum QuadrantError quadrant_axis_build(struct QuadrantAxis *axis,
                                       const struct QuadrantParameters *parameters);

// Prepares the axis to hold where its encoder stands, and forgets what went before: in every period that the outputs are off, after
// `quadrant_axis_tick`. When they are switched on the reference begins at `quadrant_axis_position`.
//
// # Safety
// `axis` was made by `quadrant_axis_build`, and nothing else uses it meanwhile.
void quadrant_axis_hold_here(struct QuadrantAxis *axis);

// Measured position of the axis, 1/65536 of a count: where a reference begins after `quadrant_axis_hold_here`.
//
// # Safety
// `axis` was made by `quadrant_axis_build`, and nothing else uses it meanwhile.
int64_t quadrant_axis_position(struct QuadrantAxis *axis);

// One control period: the counter of the encoder and the reference in, the converter's word out, -32768 to 32767. Returns the number
// of the fault (`docs/safety.md`), 0 for none. With a fault the word is 0, and the caller switches the amplifier off and keeps the fault: the
// axis does not, and may put out again in the next period. A reference that is no finite number is fault 1, following error.
//
// Also call it in every period that the outputs are off, so that the encoder is followed: with a reference that stands at
// `quadrant_axis_position`, and `quadrant_axis_hold_here` after it. What it returns then does not matter.
//
// # Safety
// `axis` was made by `quadrant_axis_build`, nothing else uses it meanwhile, and `reference` and `word` point to one of these each.
uint8_t quadrant_axis_tick(struct QuadrantAxis *axis,
                           const struct QuadrantReference *reference,
                           uint32_t count,
                           int16_t *word);

// Tracking error of the last period, mm.
//
// # Safety
// `axis` was made by `quadrant_axis_build`, and nothing else uses it meanwhile.
float quadrant_axis_error_mm(struct QuadrantAxis *axis);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* QUADRANT_LAW_H */
