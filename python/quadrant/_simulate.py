"""The law on the simulated stage."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import overload

import numpy as np

from . import _quadrant, _values
from ._law import Reference
from ._quadrant import Settings, Stage
from ._result import ManyResult, SimulationResult


@overload
def simulate(
    settings: Settings, reference: Reference, stage: Stage | None = None, *, axis: str = "x", seed: int = 1
) -> SimulationResult: ...
@overload
def simulate(
    settings: Settings, reference: Mapping[str, Reference], stage: Stage | None = None, *, axis: str = "x", seed: int = 1
) -> dict[str, SimulationResult]: ...
def simulate(
    settings: Settings,
    reference: Reference | Mapping[str, Reference],
    stage: Stage | None = None,
    *,
    axis: str = "x",
    seed: int = 1,
) -> SimulationResult | dict[str, SimulationResult]:
    """Simulates the law on a stage that it does not know: the control tick of the firmware, four steps of the stage in each.

    Parameters
    ----------
    settings : Settings
        The law; axes that are used must be commissioned. Operator, brake, homing and travel are left out.
    reference : Motion, array of shape (n,), tuple of three, or dict of them by axis
        Positions in mm at the control rate. A tuple has velocities, mm/s, and accelerations, mm/s², too; differences take
        their place otherwise. The axis stands at the first. With a dict all axes run, and those without a reference stand.
    stage : Stage, optional
        The stage; the project's simulated one by default.
    axis : {"x", "y", "z"}
        The axis of a reference that is no dict: it runs alone.
    seed : int
        Decides the encoder's noise: the same seed gives the same bits.

    Returns
    -------
    SimulationResult, or a dict of them by axis
        As many rows as samples of the reference.

    Raises
    ------
    quadrant.Fault
        A fault of the law, with axis and tick.
    ValueError
        Settings that are refused, or a reference that is none.
    KeyboardInterrupt
        Within a second of Ctrl-C. Python's lock is released meanwhile.
    """
    given = (
        {name: _values.reference(of) for name, of in reference.items()}
        if isinstance(reference, Mapping)
        else _values.reference(reference)
    )
    found = _quadrant.simulate(settings, given, stage or Stage(), axis, _values.seed(seed))
    results = {
        name: SimulationResult(
            rate_hz=settings.rate_hz, resolution_mm=settings[f"{name}/encoder/resolution_mm"], **signals
        )
        for name, signals in found.items()
    }
    return results if isinstance(reference, Mapping) else results[axis]


def simulate_many(
    settings: Settings | Sequence[Settings],
    reference: Reference,
    stage: Stage | Sequence[Stage] | None = None,
    *,
    axis: str = "x",
    seeds: int | Iterable[int] = 1,
    keep: Sequence[str] = (),
) -> ManyResult:
    """Simulates many runs of one axis on all cores.

    Parameters
    ----------
    settings, stage : one, or a sequence
        Of one each run has the same; sequences are as long as there are runs.
    reference : as in `simulate`, without a dict
    axis : {"x", "y", "z"}
    seeds : int or iterable of int
        Seed of each run; a number is that of all.
    keep : sequence of str
        Signals to keep of every run, 8 bytes a sample: "error_mm", "position_mm", "output_v", "feedforward_v", "friction_v".

    Returns
    -------
    ManyResult
        Largest and RMS error of each run, its fault if it had one, and the signals kept, each of shape (runs, n).
    """
    all_settings = [settings] if isinstance(settings, Settings) else list(settings)
    stages = [stage or Stage()] if stage is None or isinstance(stage, Stage) else list(stage)
    all_seeds = [_values.seed(seed) for seed in ([seeds] if isinstance(seeds, (int, np.integer)) else seeds)]
    kept = [keep] if isinstance(keep, str) else list(keep)
    found = _quadrant.simulate_many(all_settings, _values.reference(reference), stages, axis, all_seeds, kept)
    return ManyResult(
        largest_error_mm=found.pop("largest_error_mm"),
        rms_error_mm=found.pop("rms_error_mm"),
        faults=found.pop("faults"),
        signals=found,
    )
