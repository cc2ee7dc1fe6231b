/* The control law of three axes in C: N-PID beside the feedforward of static friction and GMS, with the operations of the Rust
   law in their order, so that every word is the same. And a bare PID in the form of CMSIS-DSP's arm_pid_f32, which does less. */

#include <stdint.h>

enum { AXES = 3, ELEMENTS = 4, NODES = 226, INTERVAL_BITS = 4 };

/* Intervals of a table: one from zero to `bound`, then 16 in every octave. */
struct octaves {
    uint32_t key; /* exponent and leading mantissa bits of the interval before `bound` */
    float below;  /* turns an argument below `bound` into a place within the first interval */
    float bound;
};

struct parameters {
    float limit; /* of the output, V */
    /* Feedback: gains per tick, and the largest error (mm) and integral (V). */
    float proportional, derivative, pole, integral, error_limit, integral_limit;
    /* Feedforward: for positive and for negative velocities, for accelerations, and the elements' share. */
    float viscous[2], inertia, share;
    float stiffness[ELEMENTS], weight[ELEMENTS];
    /* Tables: the gain of an error, and level (V) and decay of the sliding surface for both senses. */
    float largest;
    struct octaves gain_octaves, surface_octaves[2];
    float gain[NODES], surface[2][NODES][2];
};

struct state {
    float forces[ELEMENTS]; /* V; while all slip, how far each was from its share of `sum` */
    float sum, left;        /* while all slip: the sum, V, and what is left of those distances */
    uint32_t slipping;      /* a bit for each element */
    uint32_t backward;      /* the sense of the last motion */
    float integral, lost;   /* V, and what its last rounding lost */
    float derivative;       /* V */
    float last_error;       /* mm */
};

struct input {
    float error;        /* mm */
    float displacement; /* mm in this tick */
    float velocity;     /* mm/s */
    float acceleration; /* mm/s^2 */
};

/* `value` between `low` and `high`; zero if it is not a number. */
static inline float limited(float value, float low, float high)
{
    if (value <= high)
        return value >= low ? value : low;
    return value > high ? high : 0.0f;
}

static inline float within(float value, float most)
{
    return __builtin_fabsf(value) <= most ? value : limited(value, -most, most);
}

/* The interval of a non-negative argument; `place` within it is 0 to 1. */
static inline uint32_t interval(const struct octaves *octaves, float argument, float *place)
{
    enum { SHIFT = 23 - INTERVAL_BITS };
    union {
        float value;
        uint32_t bits;
    } number = { .value = argument };

    if (argument < octaves->bound) {
        *place = argument * octaves->below;
        return 0;
    }
    *place = (float)(int32_t)(number.bits & ((1u << SHIFT) - 1)) * (1.0f / (1u << SHIFT));
    return (number.bits >> SHIFT) - octaves->key;
}

/* k(e) e. */
static inline float scaled_error(const struct parameters *law, float error)
{
    float place, gain;
    uint32_t at = interval(&law->gain_octaves, __builtin_fabsf(error), &place);

    if (at >= NODES - 1)
        gain = law->gain[NODES - 1];
    else
        gain = law->gain[at] + (law->gain[at + 1] - law->gain[at]) * place;
    return error * (gain < law->largest ? gain : law->largest);
}

/* The elements' force after a displacement over a surface, V; `sign` is the sense of the displacement. */
static inline float advance(const struct parameters *law, struct state *state, float displacement,
                            float level, float decay, float sign)
{
    const uint32_t backward = sign < 0.0f, all = (1u << ELEMENTS) - 1;
    float total = 0.0f;

    if (state->backward != backward) {
        state->backward = backward;
        if (state->slipping == all)
            for (int i = 0; i < ELEMENTS; i++)
                state->forces[i] = state->sum * law->weight[i] + state->forces[i] * state->left;
        state->slipping = 0;
    } else if (state->slipping == all) {
        state->sum = sign * (level + (sign * state->sum - level) * decay);
        state->left *= decay;
        return state->sum;
    }
    for (int i = 0; i < ELEMENTS; i++) {
        float share = level * law->weight[i], force = state->forces[i];
        float trial = force + displacement * law->stiffness[i];
        uint32_t slips = state->slipping >> i & 1;
        if (!slips && sign * trial < share) {
            force = trial;
        } else {
            state->slipping |= 1u << i;
            force = sign * (slips || sign * force > share ? share + (sign * force - share) * decay : share);
        }
        state->forces[i] = force;
        total += force;
    }
    if (state->slipping == all) {
        state->sum = total;
        state->left = 1.0f;
        for (int i = 0; i < ELEMENTS; i++)
            state->forces[i] -= total * law->weight[i];
    }
    return total;
}

static inline float friction(const struct parameters *law, struct state *state, const struct input *input,
                             uint32_t sense)
{
    float place, level, decay, total = 0.0f;
    uint32_t at = interval(&law->surface_octaves[sense], __builtin_fabsf(input->velocity), &place);
    const float(*nodes)[2] = law->surface[sense];

    if (at >= NODES - 1) {
        level = nodes[NODES - 1][0];
        decay = nodes[NODES - 1][1];
    } else {
        level = nodes[at][0] + (nodes[at + 1][0] - nodes[at][0]) * place;
        decay = nodes[at][1] + (nodes[at + 1][1] - nodes[at][1]) * place;
    }
    if (input->displacement > 0.0f)
        return advance(law, state, input->displacement, level, decay, 1.0f);
    if (input->displacement < 0.0f)
        return advance(law, state, input->displacement, level, decay, -1.0f);
    if (state->slipping == (1u << ELEMENTS) - 1)
        return state->sum;
    for (int i = 0; i < ELEMENTS; i++)
        total += state->forces[i];
    return total;
}

static inline float feedforward(const struct parameters *law, struct state *state, const struct input *input)
{
    uint32_t sense = input->velocity < 0.0f;
    float inertia = input->acceleration * law->inertia;
    float viscous = input->velocity * law->viscous[sense];

    return 0.0f + viscous + friction(law, state, input, sense) * law->share + inertia;
}

/* Beside `base`; together they stay within the limit. */
static inline float feedback(const struct parameters *law, struct state *state, float error, float base)
{
    float proportional, derivative, fast, term, integral, lost, wanted, low, high;

    error = within(scaled_error(law, error), law->error_limit);
    proportional = error * law->proportional;
    derivative = state->derivative * law->pole + (error - state->last_error) * law->derivative;
    state->derivative = derivative;
    state->last_error = error;

    fast = proportional + derivative;
    term = error * law->integral + state->lost;
    integral = state->integral + term;
    lost = term - (integral - state->integral);
    wanted = fast + integral;
    if (__builtin_fabsf(wanted + base) <= law->limit && __builtin_fabsf(integral) <= law->integral_limit) {
        state->integral = integral;
        state->lost = lost;
        return wanted;
    }
    /* At a bound: the integral takes nothing that would push the output further out. */
    low = -law->limit - base;
    high = law->limit - base;
    if (wanted > high ? error > 0.0f : wanted < low && error < 0.0f) {
        integral = state->integral;
    } else {
        float bounded = within(integral, law->integral_limit);
        state->lost = bounded == integral ? lost : 0.0f;
        state->integral = integral = bounded;
    }
    return limited(fast + integral, low, high);
}

void c_law(const struct parameters laws[AXES], struct state states[AXES], const struct input inputs[AXES],
           float outputs[AXES])
{
    for (int axis = 0; axis < AXES; axis++) {
        const struct parameters *law = &laws[axis];
        float base = feedforward(law, &states[axis], &inputs[axis]);
        float rest = feedback(law, &states[axis], inputs[axis].error, base);

        outputs[axis] = within(rest + base, law->limit);
    }
}

/* A PID without bounds, filter or anti-windup: the output and two errors are kept. */
struct bare_pid {
    float a0, a1, a2;
    float last[2], output;
};

void c_pid(struct bare_pid pids[AXES], const struct input inputs[AXES], float outputs[AXES])
{
    for (int axis = 0; axis < AXES; axis++) {
        struct bare_pid *pid = &pids[axis];
        float error = inputs[axis].error;
        float output = pid->a0 * error + pid->a1 * pid->last[0] + pid->a2 * pid->last[1] + pid->output;

        pid->last[1] = pid->last[0];
        pid->last[0] = error;
        pid->output = output;
        outputs[axis] = output;
    }
}
