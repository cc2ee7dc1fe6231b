/* One axis of the law in C, against a simulated mass with friction that sticks and slides: 8 s of a sine with 2.5 mm and 5 mm/s.
 * Prints the largest error: about 26 um; with the argument `pid`, without feedforward of friction: 158 um. With the argument
 * `words` it prints every word of the converter instead.
 *
 * docs/law-in-your-firmware.md says how to build it. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "quadrant_law.h"

#define RATE_HZ 10000.0
#define COUNT_MM 0.5e-3
#define TICKS 80000

static QuadrantAxis axis;

static QuadrantParameters parameters = {
    .resolution_mm = COUNT_MM,
    .rate_hz = RATE_HZ,
    .limit_v = 9.0,
    .full_scale_v = 10.0,
    .kp_v_per_mm = 1.118,
    .ki_v_per_mm_s = 0.74,
    .kd_v_s_per_mm = 5.537e-3,
    .derivative_filter_s = 52e-6,
    .integral_limit_v = 2.0,
    .positive = {0.12, 0.15, 1.0, 1.0, 2.09e-3},
    .negative = {0.12, 0.15, 1.0, 1.0, 2.09e-3},
    .elements = {{21.4, 0.30}, {7.5, 0.30}, {2.66, 0.25}, {0.75, 0.15}},
    .element_count = 4,
    .attraction_v_s = 5.0,
    .friction_share = 1.0,
    .inertia_v_s2_per_mm = 1.0 / 69390.0,
    .overspeed_mm_s = 250.0,
    .following_error_mm = 0.5,
    .following_lag_s = 0.02,
};

/* A sine by two multiplications a tick: position in mm, exact to a count over these seconds. */
struct sine {
    double position, velocity;
};

/* A mass that is driven by a voltage: one spring of friction that slips at 0.12 V. */
struct mass {
    double position, velocity, spring;
};

static void sine_step(struct sine *sine, double frequency, double period) {
    sine->velocity -= period * frequency * frequency * sine->position;
    sine->position += period * sine->velocity;
}

static void mass_step(struct mass *mass, double volts) {
    const double period = 1.0 / RATE_HZ;
    mass->spring += 20.0 * period * mass->velocity;
    if (mass->spring > 0.12) mass->spring = 0.12;
    if (mass->spring < -0.12) mass->spring = -0.12;
    const double driven = volts - mass->spring - 2.09e-3 * mass->velocity;
    mass->velocity += period * 69390.0 * driven;
    mass->position += period * mass->velocity;
}

int main(int argc, char **argv) {
    const char *wish = argc > 1 ? argv[1] : "";
    const int shows_words = strcmp(wish, "words") == 0;
    if (strcmp(wish, "pid") == 0) parameters.friction_share = 0.0;
    const QuadrantError refused = quadrant_axis_build(&axis, &parameters);
    if (refused != QUADRANT_ERROR_NONE) {
        fprintf(stderr, "the axis was refused: %d\n", (int)refused);
        return 1;
    }
    const double frequency = 2.0; /* 1/s as an angle: 2.5 mm at 5 mm/s */
    struct sine sine = {0.0, 5.0};
    struct mass mass = {0.0, 0.0, 0.0};
    double largest_mm = 0.0;
    for (int tick = 0; tick < TICKS; tick++) {
        const QuadrantReference reference = {
            .position = (int64_t)(sine.position / COUNT_MM * 65536.0),
            .velocity_mm_s = (float)sine.velocity,
            .acceleration_mm_s2 = (float)(-frequency * frequency * sine.position),
        };
        const uint32_t count = (uint32_t)(int32_t)(mass.position / COUNT_MM);
        int16_t word = 0;
        const uint8_t fault = quadrant_axis_tick(&axis, &reference, count, &word);
        if (fault != 0) {
            fprintf(stderr, "fault %d at tick %d\n", (int)fault, tick);
            return 1;
        }
        if (shows_words) printf("%d\n", (int)word);
        /* The first two seconds start from rest at full speed. */
        const double error_mm = quadrant_axis_error_mm(&axis);
        if (tick > 20000 && error_mm > largest_mm) largest_mm = error_mm;
        if (tick > 20000 && -error_mm > largest_mm) largest_mm = -error_mm;
        mass_step(&mass, (double)word / 32767.0 * parameters.full_scale_v);
        sine_step(&sine, frequency, 1.0 / RATE_HZ);
    }
    if (!shows_words) printf("largest error %.2f um\n", 1e3 * largest_mm);
    return 0;
}
