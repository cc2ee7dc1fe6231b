"""Times the law on its simulated stage of three axes: ours, the same equations in Numba, and in Python with SciPy's integrator.

python benchmarks/simulation.py [--seconds S]

All three have a nonlinear PID, a feedforward of friction and inertia, a dead time, an encoder, and a mass on GMS friction of ten elements in
four steps a control period; ours has safety, telemetry and a reference generator besides. SciPy integrates the differential equations of
the mass and its elements over each control period.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import scipy.integrate

import quadrant

SUBSTEPS = 4


def parameters(settings: quadrant.Settings, stage: quadrant.Stage, name: str) -> dict[str, Any]:
    """The numbers of an axis and its law, as the loops below take them."""
    axis, truth = settings.to_dict()["axes"]["xyz".index(name)], stage.truth_of(name)
    pid, gain = axis["feedback"]["pid"], axis["feedback"]["nonlinear"]
    ours, theirs = axis["friction"]["sliding"], truth
    curve = lambda of: [of[k] for k in ("coulomb_v", "breakaway_v", "stribeck_velocity_mm_s", "exponent", "viscous_v_s_per_mm")]
    flat = lambda side: curve({**side["curve"], "viscous_v_s_per_mm": side["viscous_v_s_per_mm"]})
    gms = axis["friction"]["gms"]
    share = axis["feedforward"]["gains"]
    return dict(
        period=1.0 / settings.rate_hz,
        law=np.array([pid["kp_v_per_mm"], pid["ki_v_per_mm_s"], pid["kd_v_s_per_mm"], pid["derivative_filter_s"], gain["rate_per_mm"],
                      gain["range_mm"], axis["amplifier"]["output_limit_v"], axis["feedback"]["integral_limit_v"],
                      share["inertia_v_s2_per_mm"], share["presliding"], share["viscous"], gms["attraction_v_s"]]),
        law_curves=np.array([flat(ours["positive"]), flat(ours["negative"])]),
        law_elements=np.array([[e["stiffness_v_per_mm"], e["weight"]] for e in gms["elements"]]),
        preview=round(axis["feedforward"]["preview_s"] * settings.rate_hz),
        plant=np.array([truth["gain_mm_per_v_s2"], truth["damping_per_s"], truth["resolution_mm"], truth["full_scale_v"],
                        truth["offset_v"], truth["ripple_v"], truth["lead_mm"], truth["attraction_v_s"]]),
        curves=np.array([curve(theirs["positive"]), curve(theirs["negative"])]),
        elements=np.array(truth["elements"]),
        late=round(truth["delay_s"] * settings.rate_hz * SUBSTEPS),
    )


def level(curve: Any, speed: float) -> float:
    """The Stribeck curve, V."""
    return curve[0] + (curve[1] - curve[0]) * math.exp(-((speed / curve[2]) ** curve[3]))


def elements_step(forces: Any, slips: Any, elements: Any, displacement: float, surface: float, decay: float) -> float:
    """One step of the GMS elements, each exactly; returns their sum, V."""
    total = 0.0
    sign = 1.0 if displacement > 0.0 else -1.0
    for i in range(len(forces)):
        share = surface * elements[i, 1]
        trial = forces[i] + displacement * elements[i, 0]
        if not slips[i] and sign * trial < share:
            forces[i] = trial
        elif slips[i] or sign * forces[i] > share:
            slips[i] = True
            forces[i] = sign * (share + (sign * forces[i] - share) * decay)
        else:
            slips[i] = True
            forces[i] = sign * share
        total += forces[i]
    return total


def loop(level: Callable[..., float], elements_step: Callable[..., float]) -> Callable[..., Any]:
    """The loop in Python, which Numba compiles."""

    def run(position, velocity, acceleration, period, law, law_curves, law_elements, preview, plant, curves, elements, late):
        kp, ki, kd, tau, rate, reach, limit, integral_limit, inertia, share, viscous_share, law_attraction = law
        gain, damping, resolution, full_scale, offset, ripple, lead, attraction = plant
        step = period / SUBSTEPS
        size = len(position)
        errors = np.empty(size - preview)
        forces, slips = np.zeros(len(elements)), np.zeros(len(elements), dtype=np.bool_)
        law_forces, law_slips = np.zeros(len(law_elements)), np.zeros(len(law_elements), dtype=np.bool_)
        held = np.zeros(late)
        place = 0
        x, v, friction, friction_ff = 0.0, 0.0, 0.0, 0.0
        integral, derivative, last = 0.0, 0.0, 0.0
        sense, law_sense = 0, 0
        pole, slope = (2.0 * tau - period) / (2.0 * tau + period), 2.0 * kd / (2.0 * tau + period)
        before = position[0]
        for k in range(size):
            count = math.floor(x / resolution)
            reference = position[max(k - preview, 0)]
            error = reference - count * resolution
            if k >= preview:
                errors[k - preview] = reference - x
            # Feedforward, ahead by the preview.
            displacement, velocity_ahead = position[k] - before, velocity[k]
            before = position[k]
            curve = law_curves[1 if velocity_ahead < 0.0 else 0]
            if displacement != 0.0:
                now = 1 if displacement > 0.0 else -1
                if now != law_sense:
                    law_slips[:] = False
                    law_sense = now
                surface = level(curve, abs(velocity_ahead))
                friction_ff = elements_step(
                    law_forces, law_slips, law_elements, displacement, surface, math.exp(-law_attraction * period / surface)
                )
            base = share * friction_ff + viscous_share * curve[4] * velocity_ahead + inertia * acceleration[k]
            # Nonlinear PID.
            scaled = error * math.cosh(rate * min(abs(error), reach))
            derivative = pole * derivative + slope * (scaled - last)
            last = scaled
            total = integral + ki * period * scaled
            if abs(kp * scaled + derivative + total + base) <= limit and abs(total) <= integral_limit:
                integral = total
            output = max(-limit, min(limit, kp * scaled + derivative + integral + base))
            word = max(-32768, min(32767, math.floor(output * 32767.0 / full_scale + 0.5)))
            driven = max(-full_scale, min(full_scale, word * full_scale / 32767.0 + offset))
            external = -ripple * math.sin(2.0 * math.pi * x / lead)
            for _ in range(SUBSTEPS):
                acting = held[place]
                held[place] = driven
                place = place + 1 if place + 1 < late else 0
                own = curves[1 if v < 0.0 else 0]
                drag = 0.5 * step * (damping + gain * own[4])
                after = (v * (1.0 - drag) + gain * (acting + external - friction) * step) / (1.0 + drag)
                moved = 0.5 * (v + after) * step
                x += moved
                v = after
                if moved != 0.0:
                    now = 1 if moved > 0.0 else -1
                    if now != sense:
                        slips[:] = False
                        sense = now
                    own = curves[1 if moved < 0.0 else 0]
                    surface = level(own, abs(v))
                    friction = elements_step(forces, slips, elements, moved, surface, math.exp(-attraction * step / surface))
        return errors

    return run


def scipy_loop(position, velocity, acceleration, period, law, law_curves, law_elements, preview, plant, curves, elements, late):
    """The law in Python; mass and elements by scipy.integrate.solve_ivp over each control period."""
    kp, ki, kd, tau, rate, reach, limit, integral_limit, inertia, share, viscous_share, law_attraction = law
    gain, damping, resolution, full_scale, offset, ripple, lead, attraction = plant
    size = len(position)
    errors = np.empty(size - preview)
    law_forces, law_slips = np.zeros(len(law_elements)), np.zeros(len(law_elements), dtype=bool)
    state = np.zeros(2 + len(elements))
    held = np.zeros(late // SUBSTEPS)
    integral = derivative = last = friction_ff = 0.0
    law_sense = 0
    pole, slope = (2.0 * tau - period) / (2.0 * tau + period), 2.0 * kd / (2.0 * tau + period)
    before = position[0]
    stiffness, weight = elements[:, 0], elements[:, 1]

    def motion(_time: float, y: Any, volts: float) -> Any:
        v, forces = y[1], y[2:]
        own = curves[1 if v < 0.0 else 0]
        surface = level(own, abs(v))
        sign = 1.0 if v >= 0.0 else -1.0
        ratio = sign * forces / (surface * weight)
        slip = sign * attraction * (weight - np.abs(forces) / surface)
        rates = np.where(ratio < 1.0, stiffness * v, slip)
        force = volts - forces.sum() - ripple * math.sin(2.0 * math.pi * y[0] / lead)
        return np.concatenate(([v, gain * force - (damping + gain * own[4]) * v], rates))

    for k in range(size):
        count = math.floor(state[0] / resolution)
        reference = position[max(k - preview, 0)]
        error = reference - count * resolution
        if k >= preview:
            errors[k - preview] = reference - state[0]
        displacement, velocity_ahead = position[k] - before, velocity[k]
        before = position[k]
        curve = law_curves[1 if velocity_ahead < 0.0 else 0]
        if displacement != 0.0:
            now = 1 if displacement > 0.0 else -1
            if now != law_sense:
                law_slips[:] = False
                law_sense = now
            surface = level(curve, abs(velocity_ahead))
            friction_ff = elements_step(
                law_forces, law_slips, law_elements, displacement, surface, math.exp(-law_attraction * period / surface)
            )
        base = share * friction_ff + viscous_share * curve[4] * velocity_ahead + inertia * acceleration[k]
        scaled = error * math.cosh(rate * min(abs(error), reach))
        derivative = pole * derivative + slope * (scaled - last)
        last = scaled
        total = integral + ki * period * scaled
        if abs(kp * scaled + derivative + total + base) <= limit and abs(total) <= integral_limit:
            integral = total
        output = max(-limit, min(limit, kp * scaled + derivative + integral + base))
        word = max(-32768, min(32767, math.floor(output * 32767.0 / full_scale + 0.5)))
        driven = word * full_scale / 32767.0 + offset
        acting, held = held[0], np.append(held[1:], driven)
        solved = scipy.integrate.solve_ivp(motion, (0.0, period), state, args=(acting,), rtol=1e-6, atol=1e-9)
        state = solved.y[:, -1]
    return errors


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """The time of a run, s, and its result."""
    start = time.perf_counter()
    result = run()
    return time.perf_counter() - start, result


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seconds", type=float, default=10.0, help="machine time; SciPy does a hundredth of it")
    options.add_argument("--repetitions", type=int, default=5)
    given = options.parse_args()
    # Three axes that are alike: without noise, whose numbers the others would not have.
    tree = quadrant.Settings.simulated().to_dict()
    settings = quadrant.Settings.from_dict({**tree, "axes": tree["axes"][:1] * 3})
    stage = quadrant.Stage(noise_um=0)
    period_s = 2.0 * math.pi * 5.0 / 20.0
    motion = quadrant.Motion.sine(5.0, 20.0, cycles=max(0.25, (given.seconds - 1.0) / period_s))
    samples = {name: motion.samples(settings, name) for name in "xyz"}
    ticks = len(samples["x"][0])
    few = max(ticks // 100, 500)
    jobs = {}
    for name, reference in samples.items():
        numbers = parameters(settings, stage, name)
        late = numbers["preview"]
        ends = (reference[0][-1], 0.0, 0.0)
        padded = tuple(np.concatenate((signal, np.full(late, end))) for signal, end in zip(reference, ends))
        jobs[name] = (padded, late, tuple(numbers.values()))
    compiled = numba.njit(loop(numba.njit(inline="always")(level), numba.njit(inline="always")(elements_step)))

    def all_axes(run: Callable[..., Any], size: int) -> dict[str, Any]:
        return {name: run(*(s[: size + late] for s in padded), *numbers) for name, (padded, late, numbers) in jobs.items()}

    all_axes(compiled, few)
    ours_s = alone_s = numba_s = math.inf
    # In turns: a machine that is busy for a while is so for all.
    for _ in range(given.repetitions):
        taken, ours = timed(lambda: quadrant.simulate(settings, samples, stage))
        ours_s = min(ours_s, taken)
        taken, alone = timed(lambda: quadrant.simulate(settings, samples["x"], stage))
        alone_s = min(alone_s, taken)
        taken, theirs = timed(lambda: all_axes(compiled, ticks))
        numba_s = min(numba_s, taken)
    scipy_s, by_scipy = timed(lambda: all_axes(scipy_loop, few))
    mine = {name: result.error_mm for name, result in ours.items()}
    per_axis = 3 * ticks
    rows = [
        ("`quadrant.simulate`", ours_s / per_axis, mine),
        ("Numba", numba_s / per_axis, theirs),
        ("Python and `scipy.integrate`", scipy_s / (3 * few), by_scipy),
        ("`quadrant.simulate`, x alone", alone_s / ticks, {"x": alone.error_mm}),
    ]
    print("| | ns a control period and axis | time over ours | largest difference of the error from ours, um |")
    print("|---|--:|--:|--:|")
    for name, taken, errors in rows:
        apart = 1e3 * max(float(np.max(np.abs(e - mine[axis][: len(e)]))) for axis, e in errors.items())
        print(f"| {name} | {1e9 * taken:.0f} | {taken * per_axis / ours_s:.1f} | {apart:.3f} |")
    rms = ", ".join(f"{1e3 * result.rms_error_mm:.2f}" for result in ours.values())
    print(f"\n{ticks} control periods, errors of x, y, z {rms} um RMS; SciPy {few} of them. The shortest of {given.repetitions} in turns.")


if __name__ == "__main__":
    main()
