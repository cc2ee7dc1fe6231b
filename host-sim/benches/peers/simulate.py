"""The plant and the law of three axes in Numba or NumPy: the job that `main.rs` writes, with its operations in their order.

python simulate.py numba|numpy JOB: prints what the other programs print. NumPy steps the three axes as one array and does only the first
ticks of the job."""

import math
import sys
import time

import numpy as np

NODES, ELEMENTS, PLANT_ELEMENTS, SUBSTEPS, REPETITIONS = 226, 4, 10, 4, 5
f4, f8, u4 = "<f4", "<f8", "<u4"

OCTAVES = [("key", u4), ("below", f4), ("bound", f4)]
LAW = np.dtype(
    [(name, f4) for name in ("limit", "proportional", "derivative", "pole", "integral", "error_limit", "integral_limit")]
    + [("viscous", f4, 2), ("inertia", f4), ("share", f4), ("stiffness", f4, ELEMENTS), ("weight", f4, ELEMENTS)]
    + [("largest", f4), ("gain_octaves", OCTAVES), ("surface_octaves", OCTAVES, 2)]
    + [("gain", f4, NODES), ("surface", f4, (2, NODES, 2))]
)
PLANT_NUMBERS = (
    "gain damping step_s delay volts_per_code full_scale_v offset_v ripple_v lead_mm resolution_mm codes_per_volt".split()
)
PLANT = np.dtype(
    [(name, f8) for name in PLANT_NUMBERS]
    + [("viscous", f8, 2), ("stiffness", f8, PLANT_ELEMENTS), ("weight", f8, PLANT_ELEMENTS)]
    + [("surfaces", [("bound", f8), ("nodes", f8, (NODES, 2))], 2)]
)
REFERENCE = np.dtype([("position_mm", f8), ("displacement", f4), ("velocity", f4), ("acceleration", f4), ("unused", f4)])


def read(path):
    """Numbers of ticks, plant, law and references of the three axes."""
    data = open(path, "rb").read()
    ticks = np.frombuffer(data, "<u8", 2)
    axes = np.frombuffer(data, np.dtype([("plant", PLANT), ("law", LAW)]), 3, 16)
    start = 16 + 3 * axes.dtype.itemsize
    references = np.frombuffer(data, REFERENCE, offset=start).reshape(-1, 3)
    return int(ticks[0]), int(ticks[1]), axes["plant"], axes["law"], references


def run_numba(ticks, first, plant, law, references):
    from numba import njit

    zero, one, half = np.float32(0.0), np.float32(1.0), np.float32(0.5)
    sixteen = np.float32(16.0)

    @njit(inline="always")
    def interval(value, bound):
        """Interval of a table from `bound` up, and the place in it."""
        mantissa, exponent = math.frexp(value)
        _, start = math.frexp(bound)
        sixteenths = (2.0 * mantissa - 1.0) * 16.0
        whole = math.floor(sixteenths)
        return (exponent - start) * 16 + int(whole) + 1, sixteenths - whole

    @njit(inline="always")
    def slide(bound, nodes, speed):
        at, place = 0, 0.0
        if speed < bound:
            place = speed * (1.0 / bound)
        else:
            at, place = interval(speed, bound)
            if at >= NODES - 1:
                return nodes[NODES - 1, 0], nodes[NODES - 1, 1]
        level = nodes[at, 0] + (nodes[at + 1, 0] - nodes[at, 0]) * place
        return level, nodes[at, 1] + (nodes[at + 1, 1] - nodes[at, 1]) * place

    @njit(inline="always")
    def slide_single(below, bound, nodes, speed):
        at, place = 0, zero
        if speed < bound:
            place = speed * below
        else:
            at, wide = interval(speed, bound)
            place = np.float32(wide)
            if at >= NODES - 1:
                return nodes[NODES - 1, 0], nodes[NODES - 1, 1]
        level = nodes[at, 0] + (nodes[at + 1, 0] - nodes[at, 0]) * place
        return level, nodes[at, 1] + (nodes[at + 1, 1] - nodes[at, 1]) * place

    @njit(inline="always")
    def move_elements(forces, joint, memory, stiffness, weight, displacement, level, decay, sign, total):
        """`memory`: a bit for each element that slips, and 1 for backward; `joint`, while all slip: the sum of the forces, and what
        is left of the distances from its shares that `forces` has then."""
        backward = 1 if sign < 0 else 0
        everything = (1 << len(forces)) - 1
        if memory[1] != backward:
            memory[1] = backward
            if memory[0] == everything:
                for i in range(len(forces)):
                    forces[i] = joint[0] * weight[i] + forces[i] * joint[1]
            memory[0] = 0
        elif memory[0] == everything:
            joint[0] = sign * (level + (sign * joint[0] - level) * decay)
            joint[1] *= decay
            return joint[0]
        for i in range(len(forces)):
            share = level * weight[i]
            trial = forces[i] + displacement * stiffness[i]
            if memory[0] >> i & 1 or sign * forces[i] > share:
                memory[0] |= 1 << i
                forces[i] = sign * (share + (sign * forces[i] - share) * decay)
            elif sign * trial < share:
                forces[i] = trial
            else:
                memory[0] |= 1 << i
                forces[i] = sign * share
            total += forces[i]
        if memory[0] == everything:
            joint[0] = total
            joint[1] = sign * sign
            for i in range(len(forces)):
                forces[i] -= total * weight[i]
        return total

    @njit(inline="always")
    def within(value, low, high):
        return high if value > high else low if value < low else value

    @njit(inline="always")
    def law_step(law, forces, joint, memory, pid, error, wanted):
        """`pid`: integral, what it lost, derivative and last error."""
        velocity, displacement = wanted["velocity"], wanted["displacement"]
        sense = 1 if velocity < zero else 0
        octaves = law["surface_octaves"][sense]
        level, decay = slide_single(octaves["below"], octaves["bound"], law["surface"][sense], abs(velocity))
        friction = zero
        if displacement != zero:
            sign = one if displacement > zero else -one
            friction = move_elements(
                forces, joint, memory, law["stiffness"], law["weight"], displacement, level, decay, sign, zero
            )
        elif memory[0] == (1 << ELEMENTS) - 1:
            friction = joint[0]
        else:
            for i in range(ELEMENTS):
                friction += forces[i]
        base = zero + velocity * law["viscous"][sense] + friction * law["share"] + wanted["acceleration"] * law["inertia"]
        low, high = -law["limit"] - base, law["limit"] - base

        size = abs(error)
        octaves = law["gain_octaves"]
        at, place = 0, zero
        if size < octaves["bound"]:
            place = size * octaves["below"]
        else:
            at, wide = interval(size, octaves["bound"])
            place = np.float32(wide)
        nodes = law["gain"]
        gain = nodes[NODES - 1] if at >= NODES - 1 else nodes[at] + (nodes[at + 1] - nodes[at]) * place
        error = error * (gain if gain < law["largest"] else law["largest"])
        error = within(error, -law["error_limit"], law["error_limit"])
        derivative = pid[2] * law["pole"] + (error - pid[3]) * law["derivative"]
        pid[2], pid[3] = derivative, error
        fast = error * law["proportional"] + derivative
        term = error * law["integral"] + pid[1]
        integral = pid[0] + term
        lost = term - (integral - pid[0])
        output = fast + integral
        if low <= output <= high and abs(integral) <= law["integral_limit"]:
            pid[0], pid[1] = integral, lost
        else:
            if (output > high and error > zero) or (output < low and error < zero):
                integral = pid[0]
            else:
                bounded = within(integral, -law["integral_limit"], law["integral_limit"])
                pid[1] = lost if bounded == integral else zero
                pid[0] = integral = bounded
            output = within(fast + integral, low, high)
        return within(output + base, -law["limit"], law["limit"])

    @njit
    def loop(ticks, first, plant, law, references, delayed, digests, positions):
        forces, memory = np.zeros((3, PLANT_ELEMENTS)), np.zeros((3, 2), np.int64)
        law_forces, law_memory = np.zeros((3, ELEMENTS), np.float32), np.zeros((3, 2), np.int64)
        joint, law_joint = np.zeros((3, 2)), np.zeros((3, 2), np.float32)
        pids = np.zeros((3, 4), np.float32)
        position, velocity, friction = np.zeros(3), np.zeros(3), np.zeros(3)
        following = np.zeros(3, np.int64)
        driven, external = np.zeros(3), np.zeros(3)
        digest = 0
        for tick in range(ticks):
            if tick == first:
                digests[0] = digest
                positions[0] = position
            for axis in range(3):
                truth = plant[axis]
                counter = int(math.floor(position[axis] / truth["resolution_mm"]))
                digest = (digest * 31 + counter) & 0xFFFFFFFF
                wanted = references[tick, axis]
                error = np.float32(wanted["position_mm"] - counter * truth["resolution_mm"])
                output = law_step(
                    law[axis], law_forces[axis], law_joint[axis], law_memory[axis], pids[axis], error, wanted
                )
                scaled = output * np.float32(truth["codes_per_volt"])
                code = int(scaled + (-half if scaled < zero else half))
                code = min(max(code, -32768), 32767)
                asked = code * truth["volts_per_code"] + truth["offset_v"]
                driven[axis] = within(asked, -truth["full_scale_v"], truth["full_scale_v"])
                external[axis] = -(truth["ripple_v"] * math.sin(math.tau * position[axis] / truth["lead_mm"]))
            for _ in range(SUBSTEPS):
                for axis in range(3):
                    truth = plant[axis]
                    at = following[axis]
                    force = delayed[axis, at]
                    delayed[axis, at] = driven[axis]
                    following[axis] = 0 if at + 1 == int(truth["delay"]) else at + 1
                    before = velocity[axis]
                    viscous = truth["viscous"][1 if before < 0.0 else 0]
                    drag = 0.5 * truth["step_s"] * (truth["damping"] + truth["gain"] * viscous)
                    push = truth["gain"] * (force + external[axis] - friction[axis])
                    after = (before * (1.0 - drag) + push * truth["step_s"]) / (1.0 + drag)
                    displacement = 0.5 * (before + after) * truth["step_s"]
                    velocity[axis] = after
                    position[axis] += displacement
                    surface = truth["surfaces"][1 if displacement < 0.0 else 0]
                    level, decay = slide(surface["bound"], surface["nodes"], abs(after))
                    if displacement != 0.0:
                        sign = 1.0 if displacement > 0.0 else -1.0
                        friction[axis] = move_elements(
                            forces[axis], joint[axis], memory[axis], truth["stiffness"], truth["weight"], displacement,
                            level, decay, sign, 0.0,
                        )
        digests[1] = digest
        positions[1] = position

    best = math.inf
    digests, positions = np.zeros(2, np.uint32), np.zeros((2, 3))
    # The first run compiles.
    for repetition in range(1 + REPETITIONS):
        delayed = np.zeros((3, int(plant["delay"].max())))
        start = time.perf_counter()
        loop(ticks, first, plant, law, references, delayed, digests, positions)
        if repetition:
            best = min(best, (time.perf_counter() - start) / ticks * 1e9)
    return best, digests, positions


def run_numpy(ticks, plant, law, references):
    rows = np.arange(3)
    single = np.float32

    def place_in(value, bound):
        """Intervals of tables from `bound` up, and places in them."""
        mantissa, exponent = np.frexp(value)
        _, start = np.frexp(bound)
        sixteenths = (2 * mantissa - 1) * 16
        whole = np.floor(sixteenths)
        inside = value < bound
        at = np.where(inside, 0, (exponent - start) * 16 + whole.astype(int) + 1)
        place = np.where(inside, value * (1 / bound), sixteenths - whole)
        # Past the last interval: its end.
        return np.minimum(at, NODES - 2), np.where(at >= NODES - 1, value.dtype.type(1), place)

    def slide(bound, nodes, speed):
        at, place = place_in(speed, bound)
        low, high = nodes[rows, at], nodes[rows, at + 1]
        return (low + (high - low) * place[:, None]).T

    def move_elements(forces, joint, slipping, backward, stiffness, weight, displacement, level, decay):
        """`joint`, where all elements slip: the sum of the forces, and what is left of the distances from its shares that `forces`
        has then."""
        moves = displacement != 0
        turned = moves & ((displacement < 0) != backward)
        backward ^= turned
        parts = turned & slipping.all(axis=1)
        forces[parts] = joint[parts, :1] * weight[parts] + forces[parts] * joint[parts, 1:]
        slipping[turned] = False
        sign = np.where(displacement < 0, level.dtype.type(-1), level.dtype.type(1))
        together = slipping.all(axis=1)
        slides = moves & together
        joint[slides, 0] = (sign * (level + (sign * joint[:, 0] - level) * decay))[slides]
        joint[slides, 1] *= decay[slides]
        apart = moves & ~together
        sign, share = sign[:, None], level[:, None] * weight
        slipped = share + (sign * forces - share) * decay[:, None]
        trial = sign * (forces + displacement[:, None] * stiffness)
        slips = slipping | (sign * forces > share)
        stuck = ~slips & (trial < share)
        moved = sign * np.where(slips, slipped, np.where(stuck, trial, share))
        forces[apart] = moved[apart]
        slipping |= apart[:, None] & ~stuck
        total = np.zeros(3, level.dtype)
        for column in forces.T:
            total += column
        joins = apart & slipping.all(axis=1)
        joint[joins, 0], joint[joins, 1] = total[joins], 1
        forces[joins] -= (total[:, None] * weight)[joins]
        return np.where(together, joint[:, 0], total)

    forces, slipping, backward = np.zeros((3, PLANT_ELEMENTS)), np.zeros((3, PLANT_ELEMENTS), bool), np.zeros(3, bool)
    joint, law_joint = np.zeros((3, 2)), np.zeros((3, 2), single)
    law_forces, law_slipping, law_backward = np.zeros((3, ELEMENTS), single), np.zeros((3, ELEMENTS), bool), np.zeros(3, bool)
    integral, lost, derivative, last = (np.zeros(3, single) for _ in range(4))
    position, velocity, friction = np.zeros(3), np.zeros(3), np.zeros(3)
    steps = plant["delay"].astype(int)
    delayed = np.zeros((3, steps.max()))
    following = np.zeros(3, int)
    codes_per_volt = plant["codes_per_volt"].astype(single)
    digest = 0
    start = time.perf_counter()
    for tick in range(ticks):
        counter = np.floor(position / plant["resolution_mm"]).astype(np.int64)
        for value in counter:
            digest = (digest * 31 + int(value)) & 0xFFFFFFFF
        wanted = references[tick]
        error = (wanted["position_mm"] - counter * plant["resolution_mm"]).astype(single)

        sense = (wanted["velocity"] < 0).astype(int)
        octaves = law["surface_octaves"][rows, sense]
        level, decay = slide(octaves["bound"], law["surface"][rows, sense], np.abs(wanted["velocity"]))
        carried = move_elements(
            law_forces, law_joint, law_slipping, law_backward, law["stiffness"], law["weight"], wanted["displacement"], level, decay
        )
        viscous = wanted["velocity"] * law["viscous"][rows, sense]
        base = viscous + carried * law["share"] + wanted["acceleration"] * law["inertia"]
        low, high = -law["limit"] - base, law["limit"] - base
        at, place = place_in(np.abs(error), law["gain_octaves"]["bound"])
        nodes = law["gain"]
        gain = nodes[rows, at] + (nodes[rows, at + 1] - nodes[rows, at]) * place
        error = np.clip(error * np.minimum(gain, law["largest"]), -law["error_limit"], law["error_limit"])
        derivative = derivative * law["pole"] + (error - last) * law["derivative"]
        last = error
        fast = error * law["proportional"] + derivative
        term = error * law["integral"] + lost
        summed = integral + term
        rounded = term - (summed - integral)
        output = fast + summed
        kept = (output <= high) & (output >= low) & (np.abs(summed) <= law["integral_limit"])
        held = ~kept & (((output > high) & (error > 0)) | ((output < low) & (error < 0)))
        bounded = np.clip(summed, -law["integral_limit"], law["integral_limit"])
        lost = np.where(kept | (~held & (bounded == summed)), rounded, np.where(held, lost, single(0)))
        integral = np.where(kept, summed, np.where(held, integral, bounded))
        output = np.where(kept, output, np.clip(fast + integral, low, high))
        output = np.clip(output + base, -law["limit"], law["limit"])

        code = np.trunc(output * codes_per_volt + np.where(output < 0, single(-0.5), single(0.5)))
        asked = np.clip(code, -32768, 32767).astype(float) * plant["volts_per_code"] + plant["offset_v"]
        driven = np.clip(asked, -plant["full_scale_v"], plant["full_scale_v"])
        external = -(plant["ripple_v"] * np.sin(math.tau * position / plant["lead_mm"]))
        for _ in range(SUBSTEPS):
            force = delayed[rows, following]
            delayed[rows, following] = driven
            following = np.where(following + 1 == steps, 0, following + 1)
            drag = 0.5 * plant["step_s"] * (plant["damping"] + plant["gain"] * plant["viscous"][rows, (velocity < 0).astype(int)])
            push = plant["gain"] * (force + external - friction)
            after = (velocity * (1.0 - drag) + push * plant["step_s"]) / (1.0 + drag)
            displacement = 0.5 * (velocity + after) * plant["step_s"]
            velocity = after
            position = position + displacement
            surface = plant["surfaces"][rows, (displacement < 0).astype(int)]
            level, decay = slide(surface["bound"], surface["nodes"], np.abs(after))
            friction = move_elements(
                forces, joint, slipping, backward, plant["stiffness"], plant["weight"], displacement, level, decay
            )
    taken = (time.perf_counter() - start) / ticks * 1e9
    return taken, [digest], [position]


kind, path = sys.argv[1:]
ticks, first, plant, law, references = read(path)
if kind == "numba":
    taken, digests, positions = run_numba(ticks, first, plant, law, references)
else:
    taken, digests, positions = run_numpy(first, plant, law, references)
parts = [f"{digest} " + " ".join(repr(float(value)) for value in place) for digest, place in zip(digests, positions)]
print(f"{taken:.2f}", *parts)
