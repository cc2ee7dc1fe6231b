"""Commissioning: from an unknown axis to settings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _quadrant, _values
from ._quadrant import Settings, Stage
from .design import Margins
from .friction import Curve, Gms, Stribeck
from .identify import Frf, Mode, MotorConstant, Plant, PlantFit, Progress
from .machine import Machine


@dataclass(frozen=True)
class Law:
    """A law that was tried on the axis."""

    law: str
    """Its name."""
    worst_over_pid: float
    """The largest of its errors over the PID's, on the sines of the trials."""
    mean_over_pid: float
    """The geometric mean of these ratios."""
    stopped: str | None
    """The reason why it was stopped, if it was."""


@dataclass(frozen=True)
class Commissioned:
    """What a commissioning has found."""

    axis: str
    """The axis."""
    settings: Settings
    """Settings with the chosen law."""
    pid_settings: Settings | None
    """The same with the PID alone."""
    notes: list[str]
    """Remarks, in sentences."""
    motor: MotorConstant
    """Acceleration per volt, from the open-loop test."""
    response: Frf
    """Response of the sliding axis."""
    plant: PlantFit
    """Linear model."""
    margins: Margins | None
    """Margins of the PID, sampled."""
    sector_bound: float
    """Popov bound of the nonlinear gain."""
    friction_runs: dict[str, NDArray[np.float64]]
    """Runs at constant velocity: ``velocity_mm_s``, ``voltage_v``, ``deviation_v``."""
    friction: Gms
    """Friction, V."""
    laws: list[Law]
    """Laws that were tried, the PID first."""
    chosen: int | None
    """Index of the chosen one."""


def _commissioned(axis: str, found: dict[str, Any]) -> Commissioned:
    plant = found["plant"]
    fit = PlantFit(
        replace(Plant(*plant["plant"]), modes=tuple(Mode(*mode) for mode in plant["modes"])),
        dict(zip(plant["names"], zip(plant["values"], plant["standard_errors"]))),
        plant["bands"],
        plant["lines"],
    )
    sliding = Stribeck(Curve(*found["positive"]), Curve(*found["negative"]))
    return Commissioned(
        axis=axis,
        settings=found["settings"],
        pid_settings=found["pid_settings"],
        notes=found["notes"],
        motor=MotorConstant(**found["motor"]),
        response=Frf(**found["response"]),
        plant=fit,
        margins=None if found["margins"] is None else Margins(**found["margins"]),
        sector_bound=found["sector_bound"],
        friction_runs=found["friction_runs"],
        friction=Gms(sliding, tuple(found["elements"]), found["attraction"]),
        laws=[Law(**law) for law in found["laws"]],
        chosen=found["chosen"],
    )


_last_step = ""


def print_progress(step: str, share: float) -> None:
    """Prints each step, and the share that is done when it begins, on a line."""
    global _last_step
    if step != _last_step:
        _last_step = step
        print(f"{100 * share:3.0f} %  {step}", flush=True)


def commission(
    machine: Stage | Machine,
    axis: str = "x",
    *,
    trials: bool = True,
    travel_mm: tuple[float, float] | None = None,
    seed: int = 1,
    progress: Progress | None = None,
) -> Commissioned:
    """Commissions an axis, unattended: motor constant, response, PID, friction, pre-sliding friction, law, trials.

    Parameters
    ----------
    machine : Machine or Stage
        The machine, or a simulated stage whose firmware knows no more than its data sheet.
    axis : {"x", "y", "z"}
    trials : bool
        True tries laws on the axis, and chooses the best that is nowhere worse than the PID alone.
    travel_mm : (float, float), optional
        Ways to both ends from where the axis of a machine stands, such as (-200, 200); a homed axis knows it.
    seed : int
        Noise of a simulated stage's encoder.
    progress : function of step and share, optional
        Is called a few times a second; ``quadrant.print_progress`` prints. An exception that it raises ends the commissioning.

    Returns
    -------
    Commissioned
        ``settings`` are complete: what was not commissioned is as it was. A machine has the settings in force that it had before, its
        outputs off: `Machine.load` and `Machine.store` put these in force and keep them.

    Raises
    ------
    quadrant.CommissioningError
        The first step that fails, with reason and remedy; the axis is left at rest, its outputs off.
    KeyboardInterrupt
        At Ctrl-C; the axis stops.
    """
    if isinstance(machine, Stage):
        if travel_mm is not None:
            raise ValueError("travel_mm is of a machine; that of a stage is its own: Stage(travel_mm=(-200, 200))")
        found = _quadrant.commission_simulated(machine, axis, _values.seed(seed), trials, progress)
    elif isinstance(machine, Machine):
        found = machine._session.commission(axis, travel_mm, trials, progress)
    else:
        raise TypeError(f"{machine!r}: give a quadrant.Stage or a quadrant.Machine")
    return _commissioned(axis, found)
