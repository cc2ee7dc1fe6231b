// The plant and the law of three axes in C++: the job that `main.rs` writes, with its operations in their order, so that every encoder
// count is the same. The law is the one that the firmware's is counted beside.

#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

extern "C" {
#include "../../../target-tests/peer/law.c"
}

namespace {

constexpr int PLANT_ELEMENTS = 10, SUBSTEPS = 4, REPETITIONS = 5;
constexpr double TAU = 6.28318530717958647692528676655900577;

struct node {
    double level, decay;
};

struct surface {
    double bound; // end of the first interval, mm/s
    node nodes[NODES];
};

// Of an axis, as in the file.
struct plant_parameters {
    double gain, damping, step_s, delay, volts_per_code, full_scale_v, offset_v, ripple_v, lead_mm, resolution_mm, codes_per_volt;
    double viscous[2];
    double stiffness[PLANT_ELEMENTS], weight[PLANT_ELEMENTS];
    surface surfaces[2];
};

struct reference {
    double position_mm;
    float displacement, velocity, acceleration, unused;
};

struct plant {
    std::vector<double> delayed; // V, the oldest at `next`
    std::size_t next = 0;
    double forces[PLANT_ELEMENTS] = {}; // V; while all slip, how far each was from its share of `sum`
    double sum = 0.0, left = 0.0;       // while all slip: the sum, V, and what is left of those distances
    std::uint32_t slipping = 0;
    bool backward = false;
    double friction_v = 0.0, position_mm = 0.0, velocity_mm_s = 0.0;
};

node slide(const surface &surface, double speed)
{
    constexpr int SHIFT = 52 - INTERVAL_BITS;

    if (speed < surface.bound) {
        const node &low = surface.nodes[0], &high = surface.nodes[1];
        double place = speed * (1.0 / surface.bound);
        return { low.level + (high.level - low.level) * place, low.decay + (high.decay - low.decay) * place };
    }
    auto bits = std::bit_cast<std::uint64_t>(speed);
    auto at = (bits >> SHIFT) - (std::bit_cast<std::uint64_t>(surface.bound) >> SHIFT) + 1;
    if (at >= NODES - 1)
        return surface.nodes[NODES - 1];
    double place = double(std::int64_t(bits & ((1ULL << SHIFT) - 1))) * (1.0 / double(1ULL << SHIFT));
    const node &low = surface.nodes[at], &high = surface.nodes[at + 1];
    return { low.level + (high.level - low.level) * place, low.decay + (high.decay - low.decay) * place };
}

// The elements' force after a displacement; `sign` is its sense.
double move_elements(const plant_parameters &truth, plant &axis, double displacement, node sliding, double sign)
{
    constexpr std::uint32_t ALL = (1u << PLANT_ELEMENTS) - 1;
    const bool backward = sign < 0.0;
    double total = 0.0;

    if (axis.backward != backward) {
        axis.backward = backward;
        if (axis.slipping == ALL)
            for (int i = 0; i < PLANT_ELEMENTS; i++)
                axis.forces[i] = axis.sum * truth.weight[i] + axis.forces[i] * axis.left;
        axis.slipping = 0;
    } else if (axis.slipping == ALL) {
        axis.sum = sign * (sliding.level + (sign * axis.sum - sliding.level) * sliding.decay);
        axis.left *= sliding.decay;
        return axis.sum;
    }
    for (int i = 0; i < PLANT_ELEMENTS; i++) {
        double share = sliding.level * truth.weight[i];
        double trial = axis.forces[i] + displacement * truth.stiffness[i];
        if (axis.slipping >> i & 1 || sign * axis.forces[i] > share) {
            axis.slipping |= 1u << i;
            axis.forces[i] = sign * (share + (sign * axis.forces[i] - share) * sliding.decay);
        } else if (sign * trial < share) {
            axis.forces[i] = trial;
        } else {
            axis.slipping |= 1u << i;
            axis.forces[i] = sign * share;
        }
        total += axis.forces[i];
    }
    if (axis.slipping == ALL) {
        axis.sum = total;
        axis.left = 1.0;
        for (int i = 0; i < PLANT_ELEMENTS; i++)
            axis.forces[i] -= total * truth.weight[i];
    }
    return total;
}

void substep(const plant_parameters &truth, plant &axis, double driven_v, double external_v)
{
    double force_v = driven_v;
    if (!axis.delayed.empty()) {
        force_v = axis.delayed[axis.next];
        axis.delayed[axis.next] = driven_v;
        if (++axis.next == axis.delayed.size())
            axis.next = 0;
    }
    double before = axis.velocity_mm_s;
    double drag = 0.5 * truth.step_s * (truth.damping + truth.gain * truth.viscous[before < 0.0]);
    double push = truth.gain * (force_v + external_v - axis.friction_v);
    double after = (before * (1.0 - drag) + push * truth.step_s) / (1.0 + drag);
    double displacement = 0.5 * (before + after) * truth.step_s;
    axis.velocity_mm_s = after;
    axis.position_mm += displacement;
    node sliding = slide(truth.surfaces[displacement < 0.0], std::fabs(after));
    if (displacement > 0.0)
        axis.friction_v = move_elements(truth, axis, displacement, sliding, 1.0);
    else if (displacement < 0.0)
        axis.friction_v = move_elements(truth, axis, displacement, sliding, -1.0);
}

int code(float output_v, float codes_per_volt)
{
    float scaled = output_v * codes_per_volt;
    int rounded = int(scaled + (scaled < 0.0f ? -0.5f : 0.5f));
    return rounded > 32767 ? 32767 : rounded < -32768 ? -32768 : rounded;
}

template <class T> void read(std::ifstream &file, T *values, std::size_t count)
{
    file.read(reinterpret_cast<char *>(values), std::streamsize(count * sizeof(T)));
    if (!file) {
        std::fprintf(stderr, "the job is too short\n");
        std::exit(1);
    }
}

} // namespace

int main(int, char **arguments)
{
    static plant_parameters truths[AXES];
    static parameters laws[AXES];
    std::ifstream file(arguments[1], std::ios::binary);
    std::uint64_t ticks[2];
    read(file, ticks, 2);
    for (int axis = 0; axis < AXES; axis++) {
        read(file, &truths[axis], 1);
        read(file, &laws[axis], 1);
    }
    std::vector<reference> references(ticks[0] * AXES);
    read(file, references.data(), references.size());

    double best_ns = 1e300, positions[2][AXES] = {};
    std::uint32_t digests[2] = {};
    for (int repetition = 0; repetition < REPETITIONS; repetition++) {
        plant axes[AXES];
        state states[AXES] = {};
        std::uint32_t digest = 0;
        for (int axis = 0; axis < AXES; axis++)
            axes[axis].delayed.assign(std::size_t(truths[axis].delay), 0.0);
        auto start = std::chrono::steady_clock::now();
        for (std::uint64_t tick = 0; tick < ticks[0]; tick++) {
            input inputs[AXES];
            float outputs[AXES];
            double driven_v[AXES], external_v[AXES];
            if (tick == ticks[1]) {
                digests[0] = digest;
                for (int axis = 0; axis < AXES; axis++)
                    positions[0][axis] = axes[axis].position_mm;
            }
            for (int axis = 0; axis < AXES; axis++) {
                const reference &wanted = references[tick * AXES + axis];
                const plant_parameters &truth = truths[axis];
                auto counter = std::uint32_t(std::int64_t(std::floor(axes[axis].position_mm / truth.resolution_mm)));
                digest = digest * 31 + counter;
                double measured_mm = double(std::int32_t(counter)) * truth.resolution_mm;
                inputs[axis] = { float(wanted.position_mm - measured_mm), wanted.displacement, wanted.velocity,
                                 wanted.acceleration };
            }
            c_law(laws, states, inputs, outputs);
            for (int axis = 0; axis < AXES; axis++) {
                const plant_parameters &truth = truths[axis];
                double asked = code(outputs[axis], float(truth.codes_per_volt)) * truth.volts_per_code + truth.offset_v;
                driven_v[axis] = asked > truth.full_scale_v    ? truth.full_scale_v
                                 : asked < -truth.full_scale_v ? -truth.full_scale_v
                                                               : asked;
                external_v[axis] = -(truth.ripple_v * std::sin(TAU * axes[axis].position_mm / truth.lead_mm));
            }
            for (int step = 0; step < SUBSTEPS; step++)
                for (int axis = 0; axis < AXES; axis++)
                    substep(truths[axis], axes[axis], driven_v[axis], external_v[axis]);
        }
        std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
        best_ns = std::fmin(best_ns, taken.count() / double(ticks[0]));
        digests[1] = digest;
        for (int axis = 0; axis < AXES; axis++)
            positions[1][axis] = axes[axis].position_mm;
    }
    std::printf("%.2f", best_ns);
    for (int part = 0; part < 2; part++)
        std::printf(" %u %.17g %.17g %.17g", digests[part], positions[part][0], positions[part][1], positions[part][2]);
    std::printf("\n");
}
