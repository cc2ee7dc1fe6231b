"""Friction models, as the control law and the simulated stage have them, and their fits.

Forces are in any unit, such as V at an amplifier's input or N; positions are in mm, velocities in mm/s.

Sources: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994) (Stribeck); Lampaert, Al-Bender and Swevers, PhysCon 2003 (GMS);
Dahl, AIAA Journal 14 (1976); Canudas de Wit et al., IEEE TAC 40 (1995) (LuGre). ``docs/friction-models.md`` has the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _quadrant, _values

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
Side = tuple[float, float, float, float, float]

__all__ = ["Dahl", "Fit", "Gms", "LuGre", "SmoothedGms", "Stribeck", "fit_hysteresis", "fit_motion", "fit_runs"]


@dataclass(frozen=True)
class Curve:
    """Sliding friction of one sense of motion: ``coulomb + (breakaway - coulomb) exp(-|v / stribeck_velocity|^exponent) + viscous |v|``."""

    coulomb: float
    """Level at high velocity, force."""
    breakaway: float
    """Level at rest, force."""
    stribeck_velocity: float = 1.0
    """Velocity scale of the change, mm/s."""
    exponent: float = 1.0
    """Shape of the change: 1 exponential, 2 Gaussian."""
    viscous: float = 0.0
    """Viscous friction, force per mm/s."""

    def side(self) -> Side:
        """Returns its numbers in their order."""
        return (self.coulomb, self.breakaway, self.stribeck_velocity, self.exponent, self.viscous)


def _curve(side: Side) -> Curve:
    return Curve(*side)


@dataclass(frozen=True)
class Stribeck:
    """The static model: a Stribeck curve and viscous friction, for each sense of motion.

    Parameters
    ----------
    positive : Curve
        Friction of motion to larger positions.
    negative : Curve, optional
        Friction of motion to smaller ones; the same by default.
    """

    positive: Curve
    negative: Curve | None = None

    @classmethod
    def of(cls, coulomb: float, breakaway: float, **rest: float) -> Stribeck:
        """Returns a model that is the same both ways; ``rest`` are the other fields of `Curve`."""
        return cls(Curve(coulomb, breakaway, **rest))

    def _sides(self) -> tuple[Side, Side]:
        return self.positive.side(), (self.negative or self.positive).side()

    def force(self, v: ArrayLike, x: ArrayLike | None = None) -> Floats:
        """Returns the friction at velocities, mm/s, in their shape; it has no memory, and positions do not count."""
        speeds = _values.real("v", v)
        return _quadrant.friction_static(*self._sides(), speeds.ravel()).reshape(speeds.shape)

    def plot(self, axes: Axes | None = None, most_mm_s: float = 20.0, label: str | None = None) -> Axes:
        """Plots the friction over the velocity; returns the axes of matplotlib."""
        v = np.linspace(-most_mm_s, most_mm_s, 801)
        return _plotted(axes, v, self.force(v), "velocity, mm/s", label)


def _plotted(axes: Axes | None, x: Floats, y: Floats, name: str, label: str | None) -> Axes:
    if axes is None:
        _values.needs("matplotlib")
        import matplotlib.pyplot as plt

        axes = plt.subplots()[1]
    axes.plot(x, y, label=label)
    axes.set_xlabel(name)
    axes.set_ylabel("friction")
    if label is not None:
        axes.legend()
    return axes


_ONE_ELEMENT = ((1.0, 1.0),)


@dataclass(frozen=True)
class _WithMemory:
    """A model that remembers where it was moved."""

    sliding: Stribeck
    """Levels and viscous friction."""

    def _model(self) -> tuple[str, list[float], list[tuple[float, float]], float]:
        raise NotImplementedError

    def force(self, v: ArrayLike | None, x: ArrayLike, sample_time_s: float = 1e-4) -> Floats:
        """Returns the friction along positions, from slack springs.

        Parameters
        ----------
        v : array of shape (n,) or None
            Velocities, mm/s; the differences of the positions without them.
        x : array of shape (n,)
            Positions, mm, at equal times.
        sample_time_s : float
            Time from one to the next, s.

        Returns
        -------
        array of shape (n,)
            The friction, viscous friction included, by the exact step of each branch over a sample.
        """
        x = _values.vector("x", x)
        _values.above_zero("sample_time_s", sample_time_s)
        moved = np.diff(x, prepend=x[:1]) / sample_time_s if v is None else _values.vector("v", v)
        kind, numbers, elements, attraction = self._model()
        return _quadrant.friction_force(
            kind, numbers, *self.sliding._sides(), elements, attraction, moved, x, sample_time_s
        )

    def loop(self, amplitude_mm: float = 0.02, frequency_hz: float = 0.5, cycles: float = 2.25) -> tuple[Floats, Floats]:
        """Returns positions and friction of a sine from rest: a hysteresis loop."""
        step_s = 1e-4
        _values.above_zero("frequency_hz", frequency_hz)
        time_s = np.arange(int(cycles / frequency_hz / step_s)) * step_s
        x = amplitude_mm * np.sin(2 * np.pi * frequency_hz * time_s)
        return x, self.force(None, x, step_s)

    def plot(self, axes: Axes | None = None, amplitude_mm: float = 0.02, label: str | None = None) -> Axes:
        """Plots a hysteresis loop; returns the axes of matplotlib."""
        x, force = self.loop(amplitude_mm)
        return _plotted(axes, 1e3 * x, force, "position, µm", label)


@dataclass(frozen=True)
class Gms(_WithMemory):
    """The generalized Maxwell-slip model on the curve of ``sliding``.

    Parameters
    ----------
    sliding : Stribeck
        Levels.
    elements : sequence of (stiffness, weight)
        Stiffness of each spring, force per mm, and its share of the load; the shares sum to 1, and there are ten at most.
    attraction : float
        Rate at which sliding friction follows the curve, force per s.
    """

    elements: Sequence[tuple[float, float]] = field(default=_ONE_ELEMENT)
    attraction: float = 5.0

    def _model(self) -> tuple[str, list[float], list[tuple[float, float]], float]:
        return "gms", [], [(float(k), float(w)) for k, w in self.elements], self.attraction

    def virgin_curve(self, displacement_mm: ArrayLike) -> Floats:
        """Returns the friction at displacements from slack springs, at the breakaway level."""
        mean = 0.5 * sum(side[1] for side in self.sliding._sides())
        places = _values.real("displacement_mm", displacement_mm)
        _, _, elements, attraction = self._model()
        return _quadrant.virgin_curve(elements, attraction, mean, places.ravel()).reshape(places.shape)


@dataclass(frozen=True)
class SmoothedGms(Gms):
    """The smoothed GMS model: `Gms` whose elements break away over a width of 0.001 to 1 of their level."""

    width: float = 0.25

    def _model(self) -> tuple[str, list[float], list[tuple[float, float]], float]:
        _, _, elements, attraction = super()._model()
        return "smoothed", [self.width], elements, attraction


@dataclass(frozen=True)
class Dahl(_WithMemory):
    """Dahl's model at the Coulomb level of ``sliding``: stiffness at zero force, force per mm, and exponent, 1 to 3."""

    stiffness: float = 10.0
    exponent: float = 1.0

    def _model(self) -> tuple[str, list[float], list[tuple[float, float]], float]:
        return "dahl", [self.stiffness, self.exponent], list(_ONE_ELEMENT), 1.0


@dataclass(frozen=True)
class LuGre(_WithMemory):
    """The LuGre model on the curve of ``sliding``: bristles' stiffness, force per mm, and damping, force per mm/s."""

    stiffness: float = 10.0
    damping: float = 0.0

    def _model(self) -> tuple[str, list[float], list[tuple[float, float]], float]:
        return "lugre", [self.stiffness, self.damping], list(_ONE_ELEMENT), 1.0


Model = TypeVar("Model", bound="Stribeck | _WithMemory")


@dataclass(frozen=True)
class Fit(Generic[Model]):
    """A fitted model."""

    model: Model
    """The model."""
    parameters: dict[str, tuple[float, float]]
    """Value and standard error of each parameter."""
    relative_error: float
    """Norm of what it leaves unexplained, over that of the force (of a loop: over the breakaway level)."""
    validation_error: float | None = None
    """The same on parts of the motion that were withheld from the fit."""
    details: Any = None
    """What the fit says besides."""

    def __str__(self) -> str:
        lines = [f"{name}: {value:.6g} +- {error:.2g}" for name, (value, error) in self.parameters.items()]
        withheld = "" if self.validation_error is None else f", {100 * self.validation_error:.2f} % on withheld motion"
        return "\n".join([*lines, f"relative error {100 * self.relative_error:.2f} %{withheld}"])


def fit_hysteresis(
    position: ArrayLike, force: ArrayLike, sample_time_s: float, *, elements: int = 4, sliding: Stribeck | None = None
) -> Fit[Gms]:
    """Fits a GMS model to a slow motion to and fro, in which the force is the friction.

    Parameters
    ----------
    position, force : array of shape (n,)
        Positions, mm, and forces at equal times, of a motion over more than the pre-sliding range with four reversals or more.
    sample_time_s : float
        Time from one sample to the next, s.
    elements : int
        Number of elements, 1 to 10.
    sliding : Stribeck, optional
        Static friction as runs at constant velocity give it; the plateau of the motion stands for it otherwise.

    Returns
    -------
    Fit
        Knots, shares and the attraction rate with standard errors; ``details`` has the averaged virgin curve.
    """
    known = None if sliding is None else sliding._sides()
    found = _quadrant.fit_hysteresis(
        _values.vector("position", position), _values.vector("force", force), sample_time_s, elements, known
    )
    level = found["level"]
    plateau = sliding or Stribeck.of(level, level)
    return Fit(
        Gms(plateau, tuple(found["elements"]), found["attraction"]),
        dict(zip(found["names"], zip(found["values"], found["standard_errors"]))),
        found["relative_error"],
        details=found,
    )


def fit_runs(v: ArrayLike, force: ArrayLike, deviation: ArrayLike | float, *, exponent: float | None = 1.0) -> Fit[Stribeck]:
    """Fits the static model to runs at constant velocity.

    Parameters
    ----------
    v, force : array of shape (n,)
        Mean velocity, mm/s, and mean force of each run, at least six in each sense of motion.
    deviation : array of shape (n,) or float
        Standard deviation of each mean force.
    exponent : float or None
        Exponent of the Stribeck curve; None fits it.
    """
    speeds, forces = _values.vector("v", v), _values.vector("force", force)
    deviations = _values.real("deviation", deviation)
    if deviations.ndim == 0:
        deviations = np.full(speeds.shape, deviations)
    found = _quadrant.fit_runs(speeds, forces, deviations, exponent)
    parameters = {
        f"{name}, {sense}": (value, error)
        for sense in ("positive", "negative")
        for name, value, error in zip(*(found[sense][key] for key in ("names", "values", "standard_errors")))
    }
    model = Stribeck(_curve(found["positive"]["side"]), _curve(found["negative"]["side"]))
    left = forces - model.force(speeds)
    return Fit(model, parameters, float(np.linalg.norm(left) / np.linalg.norm(forces)), details=found)


def fit_motion(
    position: ArrayLike,
    force: ArrayLike,
    sample_time_s: float,
    *,
    model: type[Stribeck] | type[Gms] | type[SmoothedGms] | type[Dahl] | type[LuGre] = Gms,
    cutoff_hz: float = 100.0,
    **settings: Any,
) -> Fit[Any]:
    """Fits a friction model, with the inertia, to an ordinary motion by inverse dynamics.

    Parameters
    ----------
    position, force : array of shape (n,)
        Positions, mm, and force at equal times, inertia included.
    sample_time_s : float
        Time from one sample to the next, s.
    model : type
        `Stribeck`, `Gms`, `SmoothedGms`, `Dahl` or `LuGre`. The last two are those that come nearest to the hysteresis of the GMS model.
    cutoff_hz : float
        Cut-off of the position's low-pass, Hz.
    **settings
        As of `quadrant.identify.motion`.

    Returns
    -------
    Fit
        Parameters with standard errors, which cover noise and what the value becomes with parts of the motion withheld; the relative error
        on the motion, and on parts of it that were withheld. ``details`` is the `quadrant.identify.MotionModel`.
    """
    from . import identify

    models = identify.motion(position, force, sample_time_s, cutoff_hz=cutoff_hz, **settings)
    wants = model is not Stribeck
    chosen = [m for m in models if m.presliding == wants]
    if not chosen:
        raise ValueError("the motion determines no such model: record more reversals, or another range of velocities")
    best = min(chosen, key=lambda m: m.relative_error if m.validation_error is None else m.validation_error)
    sliding = Stribeck(best.positive, best.negative)
    gms = (tuple(best.elements), best.attraction)
    made: Stribeck | Gms | Dahl | LuGre
    if model is Stribeck:
        made = sliding
    elif model in (Gms, SmoothedGms):
        made = model(sliding, *gms)
    else:
        breakaway = 0.5 * (best.positive.breakaway + best.negative.breakaway)
        coulomb = 0.5 * (best.positive.coulomb + best.negative.coulomb)
        viscous = 0.5 * (best.positive.viscous + best.negative.viscous)
        dahl, lugre = _quadrant.fit_single_state(list(best.elements), best.attraction, breakaway, coulomb, viscous)
        made = Dahl(sliding, dahl[0], dahl[1]) if model is Dahl else LuGre(sliding, lugre[0], lugre[1])
    return Fit(made, best.parameters, best.relative_error, best.validation_error, best)
