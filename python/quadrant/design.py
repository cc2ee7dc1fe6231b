"""Design of controllers: the best PID under bounds, the nonlinear gain and its proof, margins of the sampled loop.

Sources: Åström and Hägglund, Advanced PID Control, 2006; ``docs/design.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _quadrant, _values
from ._plant import Plant
from ._quadrant import Settings
from .identify import Frf, PlantFit

__all__ = ["Margins", "Npid", "PidDesign", "PidGains", "Popov", "load_error", "margins", "npid", "open_loop", "pid", "popov"]


@dataclass(frozen=True)
class PidGains:
    """Gains of ``Kp + Ki / s + Kd s / (1 + tau s)``."""

    kp_v_per_mm: float
    """Kp, V/mm."""
    ki_v_per_mm_s: float = 0.0
    """Ki, V/(mm s)."""
    kd_v_s_per_mm: float = 0.0
    """Kd, V s/mm."""
    derivative_filter_s: float = 0.0
    """tau, s."""

    def numbers(self) -> tuple[float, float, float, float]:
        """Returns Kp, Ki, Kd and tau."""
        return (self.kp_v_per_mm, self.ki_v_per_mm_s, self.kd_v_s_per_mm, self.derivative_filter_s)

    @classmethod
    def of(cls, settings: Settings, axis: str = "x") -> PidGains:
        """Returns the gains of an axis of settings."""
        below = f"{axis}/feedback/pid"
        return cls(*(settings[f"{below}/{name}"] for name in cls.__dataclass_fields__))

    def put_into(self, settings: Settings, axis: str = "x") -> None:
        """Gives an axis of settings these gains."""
        for name in self.__dataclass_fields__:
            settings[f"{axis}/feedback/pid/{name}"] = getattr(self, name)


@dataclass(frozen=True)
class Margins:
    """Margins and peaks of a stable loop."""

    gain_margin_db: float
    phase_crossover_hz: float
    phase_margin_deg: float
    gain_crossover_hz: float
    sensitivity_peak: float
    """Peak of ``|S|``."""
    sensitivity_peak_hz: float
    complementary_peak: float
    """Peak of ``|T|``."""
    complementary_peak_hz: float


@dataclass(frozen=True)
class PidDesign:
    """A PID and the margins that it has."""

    gains: PidGains
    margins: Margins


Process = Union[Plant, PlantFit, Frf, Any]


def _process(process: Process, least_coherence: float = 0.9) -> _quadrant.Process:
    if isinstance(process, PlantFit):
        process = process.plant
    if isinstance(process, Plant):
        return _quadrant.Process.model(process.numbers(), [tuple(mode) for mode in process.modes])
    measured = Frf.of(process)
    return _quadrant.Process.measured(measured.frequency_hz, measured._complex(), measured.coherence, least_coherence)


def _numbers(gains: PidGains) -> tuple[float, float, float, float]:
    if not isinstance(gains, PidGains):
        raise TypeError(f"gains = {gains!r}: give a quadrant.design.PidGains")
    return gains.numbers()


def pid(
    plant: Process,
    *,
    ms: float = 1.7,
    mt: float = 1.5,
    rate_hz: float | None = 10_000.0,
    derivative_filter_s: float | None = None,
    computation_delay_s: float = 0.0,
) -> PidDesign:
    """Designs the best PID: the least error after a step of the load, squared and summed, among those whose peaks stay within bounds.

    Parameters
    ----------
    plant : Plant, PlantFit, Frf or control.FrequencyResponseData
        A model, or a measured response of which the coherent lines count.
    ms, mt : float
        Bounds on ``|S|`` and ``|T|``, above 1; 1.4 to 2 is usual.
    rate_hz : float or None
        Control rate, Hz: the loop is that of the firmware's difference equations through the converter's hold. None: continuous time.
    derivative_filter_s : float, optional
        Time constant of the derivative's filter, s; the shortest that settings allow by default.
    computation_delay_s : float
        Time from reading the encoder to writing the converter, s.

    Returns
    -------
    PidDesign
        The optimum, found globally, and its exact margins.

    Raises
    ------
    ValueError
        No PID keeps the bounds; says what stands in the way.
    """
    gains, found = _quadrant.design_pid(_process(plant), rate_hz, derivative_filter_s, ms, mt, computation_delay_s)
    return PidDesign(PidGains(*gains), Margins(**found))


def margins(plant: Process, gains: PidGains, *, rate_hz: float | None = 10_000.0, computation_delay_s: float = 0.0) -> Margins:
    """Returns the margins of the loop that a PID closes, sampled at ``rate_hz`` as the firmware runs it, or in continuous time (None)."""
    return Margins(**_quadrant.margins(_process(plant), _numbers(gains), rate_hz, computation_delay_s))


def load_error(plant: Process, gains: PidGains, *, rate_hz: float | None = 10_000.0, computation_delay_s: float = 0.0) -> float:
    """Returns the square root of the integral of the squared error after a step of the load of 1 V, mm sqrt(s); infinity without an integral
    gain. Raises `ValueError` for a loop that is unstable."""
    return _quadrant.load_error(_process(plant), _numbers(gains), rate_hz, computation_delay_s)


def open_loop(
    plant: Process,
    gains: PidGains,
    frequency_hz: ArrayLike,
    *,
    rate_hz: float | None = 10_000.0,
    computation_delay_s: float = 0.0,
) -> NDArray[np.complex128]:
    """Returns the open loop's response at frequencies, Hz, in the shape of the frequencies."""
    lines = _values.real("frequency_hz", frequency_hz)
    found = _quadrant.open_loop(_process(plant), _numbers(gains), rate_hz, lines.ravel(), computation_delay_s)
    return found.reshape(lines.shape)


@dataclass(frozen=True)
class Popov:
    """Bounds up to which a loop with a gain in front of it is proven stable."""

    popov: float
    """For every gain from 1 to this that depends on the error alone."""
    slope_s: float
    """The q of the line that proves it, s."""
    circle: float
    """For every gain from 1 to this, even one that varies with time in any way."""


def _rigid(plant: Process) -> Plant:
    found = plant.plant if isinstance(plant, PlantFit) else plant
    if not isinstance(found, Plant):
        raise TypeError("the proof needs a model: a Plant or a PlantFit")
    return found


def popov(plant: Plant | PlantFit, gains: PidGains, *, rate_hz: float = 10_000.0) -> Popov:
    """Returns the bounds of the nonlinear gain of a PID, as the firmware proves them; structural modes are left out. Both are 1 if nothing is
    proven, as of a loop that is unstable."""
    return Popov(*_quadrant.popov(_rigid(plant).numbers(), _numbers(gains), rate_hz))


@dataclass(frozen=True)
class Npid:
    """The nonlinear gain ``cosh(rate sat(e, range))`` in front of a PID."""

    rate_per_mm: float
    range_mm: float

    @property
    def largest(self) -> float:
        """The largest gain."""
        return float(np.cosh(self.rate_per_mm * self.range_mm))


def npid(
    plant: Plant | PlantFit,
    gains: PidGains,
    *,
    rate_hz: float = 10_000.0,
    sector_share: float = 0.75,
    breakaway_v: float | None = None,
    range_mm: float = 0.1,
    largest: float = np.inf,
) -> Npid | None:
    """Chooses the nonlinear gain: a share of the Popov bound, ``largest`` at most, over the error at which the proportional part equals
    ``breakaway_v``, or over ``range_mm``. None if that leaves no gain above 1."""
    bound = popov(plant, gains, rate_hz=rate_hz).popov
    found = _quadrant.npid(_numbers(gains), bound, sector_share, breakaway_v, range_mm, largest)
    return None if found is None else Npid(*found)
