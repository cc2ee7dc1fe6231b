"""Identification: frequency responses, linear models, inertia and friction of ordinary motions.

A response of an axis is position over voltage, mm/V, of the axis in continuous time: the hold of the converter is divided out.

Sources: Pintelon and Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012; Janot, Gautier and Brunot, Data Set and
Reference Models of EMPS, 2019.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _quadrant, _values
from ._plant import Mode, Plant
from ._quadrant import Settings, Stage
from .friction import Curve
from .machine import Machine

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
Progress = Callable[[str, float], object]

__all__ = [
    "Frf",
    "Mode",
    "MotionModel",
    "MotionModels",
    "MotorConstant",
    "Plant",
    "PlantFit",
    "fit_tf",
    "frf",
    "measure_frf",
    "motion",
    "motor_constant",
]


@dataclass(frozen=True)
class Frf:
    """A measured frequency response, one line an entry, each array of shape (n,)."""

    frequency_hz: Floats
    """Frequencies, Hz, rising."""
    response: NDArray[np.complex128]
    """Position over voltage, mm/V."""
    coherence: Floats
    """Magnitude-squared coherence, 0 to 1."""
    relative_deviation: Floats
    """Standard deviation of each component of the response, over its magnitude."""
    blocks: int = 0
    """Blocks that were averaged."""

    def to_control(self) -> control.FrequencyResponseData:
        """Returns python-control's ``FrequencyResponseData``, with ``coherence`` and ``relative_deviation`` as attributes."""
        _values.needs("control")
        import control

        found = control.FrequencyResponseData(self.response, 2 * np.pi * self.frequency_hz, smooth=True)
        found.coherence = self.coherence
        found.relative_deviation = self.relative_deviation
        return found

    @classmethod
    def of(cls, data: Any) -> Frf:
        """Returns the response of python-control's ``FrequencyResponseData``; without a ``coherence`` every line is trusted."""
        if isinstance(data, cls):
            return data
        # Its name before python-control 0.10.2 is fresp.
        values = getattr(data, "frdata", None)
        values = getattr(data, "fresp", None) if values is None else values
        if values is None:
            raise TypeError(
                f"{type(data).__name__} is no frequency response; control.frd(system, 2 * numpy.pi * frequency_hz) makes one of a system"
            )
        response = np.ascontiguousarray(np.squeeze(values), dtype=complex)
        if response.ndim != 1:
            raise ValueError(f"the response has the shape {response.shape}: choose one output and one input, such as data[0, 0]")
        lines = np.asarray(data.omega, dtype=float) / (2 * np.pi)
        return cls(
            lines,
            response,
            _values.vector("coherence", getattr(data, "coherence", np.ones(len(lines)))),
            _values.vector("relative_deviation", getattr(data, "relative_deviation", np.full(len(lines), 1e-3))),
        )

    def _complex(self) -> NDArray[np.complex128]:
        """Returns the response in double precision."""
        return np.ascontiguousarray(self.response, dtype=complex)

    def plot(self, axes: Sequence[Axes] | None = None, label: str | None = None) -> Sequence[Axes]:
        """Plots gain, phase and coherence over the frequency; returns three axes of matplotlib."""
        if axes is None:
            _values.needs("matplotlib")
            import matplotlib.pyplot as plt

            axes = list(plt.subplots(3, 1, sharex=True)[1])
        axes[0].loglog(self.frequency_hz, np.abs(self.response), label=label)
        axes[1].semilogx(self.frequency_hz, np.degrees(np.unwrap(np.angle(self.response))))
        axes[2].semilogx(self.frequency_hz, self.coherence)
        for axis, name in zip(axes, ("gain, mm/V", "phase, deg", "coherence")):
            axis.set_ylabel(name)
        axes[2].set_xlabel("frequency, Hz")
        if label is not None:
            axes[0].legend()
        return axes


def frf(
    position: ArrayLike,
    voltage: ArrayLike,
    fs: float,
    *,
    excitation: ArrayLike | None = None,
    nperseg: int = 5000,
    band_hz: tuple[float, float] = (0.0, np.inf),
) -> control.FrequencyResponseData:
    """Estimates the frequency response of an axis from a recording.

    Parameters
    ----------
    position, voltage : array of shape (n,)
        Position, mm, at the beginning of each sample's period, and voltage held over it, V.
    fs : float
        Sampling rate, Hz.
    excitation : array of shape (n,), optional
        The part of the voltage that was injected. Under feedback it is the instrument that makes the estimate free of bias
        (``S_yr / S_ur``); without it the estimate is H1 (``S_yu / S_uu``), which is for open loop.
    nperseg : int
        Samples of a block; blocks overlap by half, have a Hann window, and lose mean and slope.
    band_hz : (float, float)
        Lowest and highest line, Hz.

    Returns
    -------
    control.FrequencyResponseData
        Position over voltage, mm/V, with the attributes ``coherence`` and ``relative_deviation``.
    """
    low, high = band_hz
    found = _quadrant.frf(
        _values.vector("position", position),
        _values.vector("voltage", voltage),
        1.0 / _values.above_zero("fs", fs),
        nperseg,
        (low, min(high, fs)),
        None if excitation is None else _values.vector("excitation", excitation),
    )
    return Frf(**found).to_control()


def measure_frf(
    machine: Stage | Machine,
    axis: str = "x",
    *,
    settings: Settings | None = None,
    velocity_mm_s: float = 37.0,
    open_loop: bool = False,
    waveform: str = "multisine",
    rms_v: float | None = None,
    band_hz: tuple[float, float] = (4.0, 400.0),
    rise_hz: float = 200.0,
    period_s: float = 0.5,
    averages: int = 40,
    travel_mm: tuple[float, float] | None = None,
    seed: int = 1,
    progress: Progress | None = None,
) -> control.FrequencyResponseData:
    """Measures the frequency response of an axis: injects a voltage while the axis slides under its PID alone, or in open loop at rest.

    Parameters
    ----------
    machine : Machine or Stage
        The machine, or a simulated stage.
    axis : {"x", "y", "z"}
    settings : Settings, optional
        Of these the PID moves the axis; by default those in force. A stage needs them.
    velocity_mm_s : float
        Velocity meanwhile, mm/s, there and back; 0 measures at standstill, where friction bends the response.
    open_loop : bool
        True: the excitation alone drives the amplifier, at standstill.
    waveform : {"multisine", "random", "sweep"}
    rms_v : float, optional
        RMS of the excitation, V; by default 0.3 at standstill, else 0.08 of a multisine and 0.035 of the others.
    band_hz : (float, float)
        Lowest and highest frequency, Hz.
    rise_hz : float
        Frequency up to which a multisine's amplitudes rise, Hz.
    period_s : float
        Period of the excitation, s; its inverse is the resolution.
    averages : int
        Blocks that are averaged, 2 or more.
    travel_mm : (float, float), optional
        Ways to both ends from where the axis of a machine stands, such as (-200, 200); a homed axis knows it.
    seed : int
        Decides phases and, of a stage, the encoder's noise.
    progress : function of step and share, optional
        As of `quadrant.commission`.

    Returns
    -------
    control.FrequencyResponseData
        As of `frf`. A machine's outputs are off then, and its settings are as before.

    Raises
    ------
    RuntimeError
        A measurement that was stopped, or that cannot be, with reason and remedy.
    KeyboardInterrupt
        At Ctrl-C; the axis stops.
    """
    _values.needs("control")
    slides = velocity_mm_s != 0.0 and not open_loop
    usual = (0.08 if waveform == "multisine" else 0.035) if slides else 0.3
    request = (
        waveform,
        usual if rms_v is None else rms_v,
        band_hz,
        rise_hz,
        period_s,
        averages,
        velocity_mm_s if slides else 0.0,
        open_loop,
    )
    if isinstance(machine, Stage):
        if travel_mm is not None:
            raise ValueError("travel_mm is of a machine; that of a stage is its own: Stage(travel_mm=(-200, 200))")
        if settings is None:
            raise ValueError("settings: a stage has no law of its own; give those of a commissioning, or Settings.simulated()")
        found = _quadrant.measure_frf_simulated(machine, settings, axis, request, _values.seed(seed), progress)
    elif isinstance(machine, Machine):
        found = machine._session.measure_frf(settings, axis, travel_mm, request, _values.seed(seed), progress)
    else:
        raise TypeError(f"{machine!r}: give a quadrant.Stage or a quadrant.Machine")
    return Frf(**found).to_control()


@dataclass(frozen=True)
class PlantFit:
    """The linear model of a response, ``A exp(-s Td) / (s^2 + B s + C)`` times its modes."""

    plant: Plant
    """The model."""
    parameters: dict[str, tuple[float, float]]
    """Value and standard error of each parameter."""
    bands: list[tuple[float, float, float, float]]
    """By thirds of the lines: lowest and highest frequency, Hz, and the model's distance from the response, dB and deg RMS."""
    lines: int
    """Lines that counted."""


def fit_tf(
    data: Any,
    *,
    modes: int | None = None,
    delay: bool = True,
    spring: bool = False,
    least_coherence: float = 0.9,
    band_hz: tuple[float, float] = (0.0, np.inf),
) -> PlantFit:
    """Fits the transfer function of an axis to a measured response, each line weighted by its own deviation.

    Parameters
    ----------
    data : control.FrequencyResponseData or Frf
        The response; its ``coherence`` and ``relative_deviation`` count if it has them.
    modes : int, optional
        Structural modes that the response must show. As many as it shows are fitted, two at most; another number is an error.
    delay : bool
        False if there must be no dead time: one that is found beyond its standard error is an error.
    spring : bool
        True fits a spring to ground, C: a response at standstill shows pre-sliding friction as one.
    least_coherence : float
        Lowest coherence of a line that counts.
    band_hz : (float, float)
        Lowest and highest frequency that count, Hz.

    Returns
    -------
    PlantFit

    Raises
    ------
    ValueError
        A response that supports no such model, with what would.
    """
    measured = Frf.of(data)
    found = _quadrant.fit_tf(
        measured.frequency_hz,
        measured._complex(),
        measured.coherence,
        measured.relative_deviation,
        least_coherence,
        (band_hz[0], min(band_hz[1], 1e9)),
        spring,
    )
    shown = [Mode(*mode) for mode in found["modes"]]
    if modes is not None and len(shown) != modes:
        places = ", ".join(f"{mode.frequency_hz:.1f} Hz" for mode in shown) or "none"
        raise ValueError(f"modes = {modes}: the response shows {len(shown)} ({places}); leave modes out, or limit band_hz")
    parameters = dict(zip(found["names"], zip(found["values"], found["standard_errors"])))
    dead_time, error = parameters["Td"]
    if not delay and dead_time > 3 * error:
        raise ValueError(f"delay = False: the response shows a dead time of {1e3 * dead_time:.3f} ms")
    plant = replace(Plant(*found["plant"]), modes=tuple(shown))
    return PlantFit(plant, parameters, found["bands"], found["lines"])


@dataclass(frozen=True)
class MotorConstant:
    """Acceleration per volt, from a square wave in open loop."""

    gain_mm_per_v_s2: float
    """A, mm/(V s²)."""
    standard_error: float
    """Its standard deviation, from the scatter over the passes."""
    damping_per_s: float
    """B, 1/s; rough."""
    friction_v: float
    """Friction in motion, V; rough."""
    directed_v: tuple[float, float]
    """The same in each sense of motion, V."""
    noise_mm: float
    """Standard deviation of the encoder's noise, mm."""


def motor_constant(position: ArrayLike, voltage: ArrayLike, fs: float, *, resolution_mm: float = 5e-4) -> MotorConstant:
    """Evaluates a recorded test: voltage steps between two levels of one sign while the axis slides, in both directions.

    Parameters
    ----------
    position, voltage : array of shape (n,)
        Position, mm, and voltage, V.
    fs : float
        Sampling rate, Hz.
    resolution_mm : float
        Length of a count of the encoder, mm.
    """
    return MotorConstant(**_quadrant.motor_constant(
            _values.vector("position", position),
            _values.vector("voltage", voltage),
            1.0 / _values.above_zero("fs", fs),
            resolution_mm,
        ))


@dataclass(frozen=True)
class MotionModel:
    """Inertia and friction of a motion, as seen at the force's place."""

    name: str
    """What it holds."""
    presliding: bool
    """True if friction turns over a displacement and not at once."""
    stribeck: bool
    """True if its level changes with the velocity."""
    validation_error: float | None
    """Relative error on parts of the motion that were withheld from the fit, one at a time."""
    relative_error: float
    """Relative error on the motion of the fit."""
    inertia: float
    """Force per acceleration, force s²/mm."""
    offset: float
    """Constant force."""
    delay_s: float
    """Dead time, s."""
    plant: Plant
    """The linear model of the axis in motion."""
    positive: Curve
    """Friction of motion to larger positions."""
    negative: Curve
    """Friction of motion to smaller positions."""
    elements: list[tuple[float, float]]
    """Stiffness and share of each element."""
    attraction: float
    """Attraction rate of the elements."""
    parameters: dict[str, tuple[float, float]]
    """Value and standard error of each parameter, in mm, s and the force's unit."""
    parameters_si: dict[str, tuple[float, float, str]]
    """The same with newtons, metres and seconds, if the force is in N; and the unit."""
    rows: dict[str, Floats]
    """Rows of the regression: ``time_s``, ``velocity_mm_s``, ``force``, ``residual``, ``friction``."""


class MotionModels(Sequence[MotionModel]):
    """Models of one motion, from the simplest to the one with most parts."""

    def __init__(self, fitted: _quadrant.MotionModels) -> None:
        self._fitted = fitted
        self._models = [self._model(index) for index in range(len(fitted))]

    def _model(self, index: int) -> MotionModel:
        found = self._fitted.model(index)
        estimates = found.pop("estimates")
        rows = {name: found.pop(name) for name in ("time_s", "velocity_mm_s", "force", "residual", "friction")}
        return MotionModel(
            **{
                **found,
                "plant": Plant(*found["plant"]),
                "positive": Curve(*found["positive"]),
                "negative": Curve(*found["negative"]),
            },
            parameters={name: (value, error) for name, _, value, error, _, _ in estimates},
            parameters_si={name: (si * value, si * error, unit) for name, _, value, error, si, unit in estimates},
            rows=rows,
        )

    def __getitem__(self, index: Any) -> Any:
        return self._models[index]

    def __len__(self) -> int:
        return len(self._models)

    @property
    def recommended(self) -> MotionModel | None:
        """The simplest of those that are as good as the best on withheld motion."""
        index = self._fitted.recommended()
        return None if index is None else self._models[index]

    def validate(self, position: ArrayLike, force: ArrayLike, sample_time_s: float) -> Floats:
        """Returns the relative error of each model on another motion, on which nothing is fitted, shape (models,)."""
        return self._fitted.validate(_values.vector("position", position), _values.vector("force", force), sample_time_s)

    def replay(self, model: MotionModel, position: ArrayLike, force: ArrayLike, sample_time_s: float) -> Floats:
        """Returns the positions of a model that a motion's force drives in open loop, mm, at 1 kHz at most."""
        return self._fitted.replay(self._models.index(model), _values.vector("position", position), _values.vector("force", force), sample_time_s)


def motion(
    position: ArrayLike,
    force: ArrayLike,
    sample_time_s: float,
    *,
    cutoff_hz: float = 100.0,
    edge_s: float = 0.05,
    row_rate_hz: float = 100.0,
    knots_mm: Sequence[float] = (0.002, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05),
    dead_time_s: float | None = None,
) -> MotionModels:
    """Fits inertia and friction to an ordinary motion, by inverse dynamics: eight models, from four parameters on.

    Parameters
    ----------
    position, force : array of shape (n,)
        Positions, mm, and force (or voltage) at equal times.
    sample_time_s : float
        Time from one sample to the next, s.
    cutoff_hz, edge_s, row_rate_hz : float
        Cut-off of the position's zero-phase low-pass, Hz; time cut at each end, s; rows a second, Hz.
    knots_mm : sequence of float
        Displacements at which pre-sliding elements may begin to slip, mm, rising.
    dead_time_s : float, optional
        Dead time from force to motion, if it is known, s.

    Returns
    -------
    MotionModels
        Each with standard errors, and with its error on withheld parts of the motion.
    """
    return MotionModels(
        _quadrant.fit_motion(
            _values.vector("position", position),
            _values.vector("force", force),
            sample_time_s,
            cutoff_hz,
            edge_s,
            row_rate_hz,
            list(knots_mm),
            dead_time_s,
        )
    )
