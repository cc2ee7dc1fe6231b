"""Signals of runs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _values

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]


@dataclass(eq=False, repr=False)
class Result:
    """Signals of an axis, one row a control period; each of shape (n,).

    A row is the tick in which the feedback works on that sample of the reference.
    """

    rate_hz: float
    """Control rate, Hz."""
    resolution_mm: float
    """Length of a count of the encoder, mm."""
    reference_mm: Floats
    """Reference of the feedback, mm."""
    counts: NDArray[np.int32]
    """Position by the encoder, counts."""
    word: NDArray[np.int16]
    """Words of the converter."""
    output_v: Singles
    """Output after all limits, V."""
    proportional_v: Singles
    """Proportional term of the feedback, V."""
    integral_v: Singles
    """Integral term of the feedback, V."""
    derivative_v: Singles
    """Derivative term of the feedback, V."""
    feedforward_v: Singles
    """Friction that is fed forward, V."""
    inertia_v: Singles
    """Inertia that is fed forward, V."""
    limited: NDArray[np.bool_]
    """True where the output limit acts."""

    @property
    def measured_mm(self) -> Floats:
        """Position by the encoder, mm."""
        return self.counts.astype(float) * self.resolution_mm

    @property
    def error_mm(self) -> Floats:
        """Reference minus measured position, mm."""
        return self.reference_mm - self.measured_mm

    @property
    def time_s(self) -> Floats:
        """Time from the first row, s."""
        return np.arange(len(self.word), dtype=float) / self.rate_hz

    @property
    def rms_error_mm(self) -> float:
        """RMS of the error, mm."""
        return float(np.sqrt(np.mean(self.error_mm**2)))

    @property
    def largest_error_mm(self) -> float:
        """Largest error, mm."""
        return float(np.max(np.abs(self.error_mm)))

    def to_dict(self) -> dict[str, NDArray[Any]]:
        """Returns the signals by name, with the time, s."""
        signals: dict[str, NDArray[Any]] = {"t_s": self.time_s, "measured_mm": self.measured_mm, "error_mm": self.error_mm}
        for field in fields(self):
            signal = getattr(self, field.name)
            if isinstance(signal, np.ndarray):
                signals[field.name] = signal
        return signals

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a data frame with a column for each signal, indexed by the time in s."""
        _values.needs("pandas")
        import pandas

        frame: pandas.DataFrame = pandas.DataFrame(self.to_dict()).set_index("t_s")
        return frame

    def plot(self, axes: Axes | None = None, label: str | None = None) -> Axes:
        """Plots the error in um over the time in s; returns the axes of matplotlib."""
        if axes is None:
            _values.needs("matplotlib")
            import matplotlib.pyplot as plt

            axes = plt.subplots()[1]
        axes.plot(self.time_s, 1e3 * self.error_mm, label=label, linewidth=0.8)
        axes.set_xlabel("time, s")
        axes.set_ylabel("error, µm")
        if label is not None:
            axes.legend()
        return axes

    def __len__(self) -> int:
        return len(self.word)

    def __repr__(self) -> str:
        return (
            f"{type(self).__name__}({len(self)} rows at {self.rate_hz:g} Hz, error "
            f"{1e3 * self.rms_error_mm:.3g} um RMS, {1e3 * self.largest_error_mm:.3g} um at most)"
        )


@dataclass(eq=False, repr=False)
class SimulationResult(Result):
    """Signals of a simulated axis, with those that only a simulation has."""

    position_mm: Floats
    """True position, mm."""
    friction_v: Singles
    """True friction, V at the amplifier's input."""
    first_mm: float = 0.0
    """Where the axis stood at the start, mm."""

    @property
    def measured_mm(self) -> Floats:
        """Position by the encoder, mm."""
        return self.counts.astype(float) * self.resolution_mm + self.first_mm

    @property
    def error_mm(self) -> Floats:
        """Reference minus true position, mm."""
        return self.reference_mm - self.position_mm


@dataclass(eq=False, repr=False)
class ManyResult:
    """Outcomes of many runs, one an entry."""

    largest_error_mm: Floats
    """Largest error of each run, mm, shape (runs,); NaN where a fault ended it."""
    rms_error_mm: Floats
    """RMS of the error of each run, mm, shape (runs,); NaN where a fault ended it."""
    faults: list[Exception | None]
    """The fault that ended each run, a `quadrant.Fault`, or None."""
    signals: dict[str, Floats]
    """Signals that were kept, each of shape (runs, n)."""

    def __len__(self) -> int:
        return len(self.rms_error_mm)

    def __repr__(self) -> str:
        failed = sum(fault is not None for fault in self.faults)
        rest = self.rms_error_mm[np.isfinite(self.rms_error_mm)]
        median = f", error {1e3 * np.median(rest):.3g} um RMS in the median" if len(rest) else ""
        return f"ManyResult({len(self)} runs, {failed} with a fault{median})"
