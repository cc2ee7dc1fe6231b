"""Runs the same jobs by quadrant, python-control, SciPy and nfoursid: time, and the digits in which the results agree.

python benchmarks/comparison.py
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable
from typing import Any

import control
import numpy as np
import pandas
import scipy.optimize
import scipy.signal
from nfoursid.nfoursid import NFourSID

from quadrant import design, friction, identify

PLANT = identify.Plant(69_390.0, 144.8, 0.0, 1.2e-3)
RATE_HZ = 1000.0


def timed(run: Callable[[], Any], repetitions: int = 3) -> tuple[float, Any]:
    """The shortest time of a run, s, and its result."""
    best, result = math.inf, None
    for _ in range(repetitions):
        start = time.perf_counter()
        result = run()
        best = min(best, time.perf_counter() - start)
    return best, result


def digits(ours: Any, theirs: Any) -> str:
    """Decimal digits in which values agree at worst."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    apart = float(np.max(np.abs(ours - theirs) / np.abs(ours)))
    return "all" if apart == 0 else f"{max(0.0, -math.log10(apart)):.1f}"


def row(job: str, who: str, seconds: float | None, agreement: str) -> None:
    shown = "none has it" if seconds is None else f"{1e3 * seconds:.3g} ms"
    print(f"| {job} | {who} | {shown} | {agreement} |")


def record() -> tuple[np.ndarray, np.ndarray]:
    """Position, mm, and voltage, V, of the plant without its dead time under noise, held over each sample."""
    rng = np.random.default_rng(1)
    voltage = rng.normal(0.0, 1.0, 60_000)
    a, b, t = PLANT.gain_mm_per_v_s2, PLANT.damping_per_s, 1.0 / RATE_HZ
    system = scipy.signal.cont2discrete(([a], [1.0, b, 0.0]), t)
    _, position = scipy.signal.dlsim(system, voltage)
    return np.squeeze(position) + rng.normal(0.0, 1e-3, len(voltage)), voltage


def responses(position: np.ndarray, voltage: np.ndarray) -> None:
    ours_s, ours = timed(lambda: identify.frf(position, voltage, RATE_HZ, nperseg=2000, band_hz=(5.0, 300.0)))
    job = "frequency response of 60 000 samples"
    row(job, "`identify.frf`", ours_s, "")

    def by_scipy() -> np.ndarray:
        options = dict(fs=RATE_HZ, window="hann", nperseg=2000, noverlap=1000, detrend="linear")
        hz, cross = scipy.signal.csd(voltage, position, **options)
        _, power = scipy.signal.welch(voltage, **options)
        kept = (hz >= 5.0) & (hz <= 300.0)
        half = math.pi * hz[kept] / RATE_HZ
        hold = np.sin(half) / half * np.exp(-1j * half)
        return (cross[kept] / power[kept]) / hold

    theirs_s, theirs = timed(by_scipy)
    row(job, "`scipy.signal.csd` over `welch`, hold divided out by hand", theirs_s, digits(np.squeeze(ours.frdata), theirs))

    job = "linear model of a record"
    fit_s, fit = timed(lambda: identify.fit_tf(ours))
    row(job, "`identify.frf` and `fit_tf`", ours_s + fit_s, digits(PLANT.gain_mm_per_v_s2, fit.plant.gain_mm_per_v_s2) + " of A, true")

    def by_nfoursid() -> np.ndarray:
        frame = pandas.DataFrame({"u": voltage[:6000], "y": np.diff(position[:6001])})
        found = NFourSID(frame, output_columns=["y"], input_columns=["u"], num_block_rows=10)
        found.subspace_identification()
        model, _ = found.system_identification(rank=1)
        return np.array([model.a[0, 0]])

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs_s, pole = timed(by_nfoursid, 1)
    damping = -math.log(float(pole[0])) * RATE_HZ
    row(job, "nfoursid, of order 1, on 6000 differenced samples", theirs_s, digits(PLANT.damping_per_s, damping) + " of B, true; " + digits(PLANT.damping_per_s, fit.plant.damping_per_s) + " ours")


def fits() -> None:
    hz = np.geomspace(3.0, 600.0, 160)
    rng = np.random.default_rng(3).normal(size=(2, 160))
    values = PLANT.response(hz) * (1 + 0.005 * (rng[0] + 1j * rng[1]))
    measured = identify.Frf(hz, values, np.full(160, 0.99), np.full(160, 0.005))
    job = "A, B and dead time of 160 lines"
    ours_s, ours = timed(lambda: identify.fit_tf(measured))
    row(job, "`identify.fit_tf`, no start needed", ours_s, "")

    def residual(x: np.ndarray) -> np.ndarray:
        s = 2j * np.pi * hz
        left = (x[0] * 1e4 * np.exp(-1e-3 * x[2] * s) / (s * s + 100 * x[1] * s) / values - 1) / 0.005
        return np.concatenate((left.real, left.imag))

    theirs_s, theirs = timed(lambda: scipy.optimize.least_squares(residual, [5.0, 1.0, 1.0]))
    theirs_numbers = (1e4 * theirs.x[0], 100 * theirs.x[1], 1e-3 * theirs.x[2])
    numbers = ours.plant.numbers()
    row(job, "`scipy.optimize.least_squares`, model, weights and start by hand", theirs_s, digits(np.array(numbers)[[0, 1, 3]], theirs_numbers))
    row(job, "python-control 0.10", None, "")


def loops() -> None:
    ours_s, best = timed(lambda: design.pid(PLANT, rate_hz=None, derivative_filter_s=1e-4))
    margins_s, margins = timed(lambda: design.margins(PLANT, best.gains, rate_hz=None))
    omega = np.geomspace(1.0, 6000.0, 20_000)
    s = 1j * omega

    def loop(gains: np.ndarray) -> np.ndarray:
        kp, ki, kd = gains
        return PLANT.response(omega / (2 * np.pi)) * (kp + ki / s + kd * s / (1 + 1e-4 * s))

    numbers = np.array(best.gains.numbers()[:3])
    theirs_s, theirs = timed(lambda: control.stability_margins(control.frd(loop(numbers), omega, smooth=True)))
    job = "gain and phase margin with a dead time"
    row(job, "`design.margins`", margins_s, "")
    agreement = digits([margins.gain_margin_db, margins.phase_margin_deg], [20 * math.log10(theirs[0]), theirs[1]])
    row(job, "`control.stability_margins` on 20 000 points", theirs_s, agreement)

    job = "PID of the least load error within Ms 1.7, Mt 1.5"
    row(job, "`design.pid`", ours_s, "")

    def cost(logs: np.ndarray) -> float:
        gains = np.exp(logs)
        open_loop = loop(gains)
        peak = max(np.max(1 / np.abs(1 + open_loop)) / 1.7, np.max(np.abs(open_loop / (1 + open_loop))) / 1.5)
        found = control.stability_margins(control.frd(open_loop[::40], omega[::40], smooth=False))
        stable = found[0] > 1 and found[1] > 0
        error = design.load_error(PLANT, design.PidGains(*gains, 1e-4), rate_hz=None)
        return math.log(error) + (0.0 if stable else 10.0) + 100 * max(0.0, peak - 1)

    bounds = [(math.log(0.05), math.log(5)), (math.log(0.05), math.log(200)), (math.log(5e-4), math.log(0.05))]
    theirs_s, theirs = timed(lambda: scipy.optimize.differential_evolution(cost, bounds, seed=1, maxiter=25, polish=False), 1)
    ratio = math.exp(theirs.fun) / design.load_error(PLANT, best.gains, rate_hz=None)
    row(job, "`scipy.optimize.differential_evolution`, cost by hand", theirs_s, f"{digits(numbers, np.exp(theirs.x))}; its error is {ratio:.4f} of ours")


def frictions() -> None:
    sliding = friction.Stribeck.of(0.12, 0.15)
    gms = friction.Gms(sliding, ((21.4, 0.3), (7.5, 0.3), (2.66, 0.25), (0.75, 0.15)))
    x = 0.2 * np.sin(2 * np.pi * 0.1 * np.arange(40_000) * 1e-3)
    model_s, force = timed(lambda: gms.force(None, x, 1e-3))
    fit_s, _ = timed(lambda: friction.fit_hysteresis(x, force, 1e-3), 1)
    row("GMS friction over 40 000 samples", "`friction.Gms.force`", model_s, "")
    row("its identification with standard errors", "`friction.fit_hysteresis`", fit_s, "")
    row("GMS, LuGre, Dahl: models or identification", "python-control, SciPy, nfoursid", None, "")


def main() -> None:
    print("| job | by | time | agrees with ours, digits |")
    print("|---|---|--:|--:|")
    responses(*record())
    fits()
    loops()
    frictions()


if __name__ == "__main__":
    main()
