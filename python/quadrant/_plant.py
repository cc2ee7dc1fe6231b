"""Linear models of an axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _quadrant, _values

if TYPE_CHECKING:
    import control


class Mode(NamedTuple):
    """A structural mode: a factor on the response of the rigid axis."""

    frequency_hz: float
    """Frequency of the resonance, Hz."""
    damping: float
    """Its damping ratio."""
    anti: tuple[float, float] | None = None
    """Frequency, Hz, and damping ratio of the anti-resonance, if there is one."""


@dataclass(frozen=True)
class Plant:
    """The linear model of an axis, ``A exp(-s Td) / (s^2 + B s + C)`` times its modes; position over voltage, mm/V."""

    gain_mm_per_v_s2: float
    """A, acceleration per volt, mm/(V s²)."""
    damping_per_s: float = 0.0
    """B, 1/s."""
    stiffness_per_s2: float = 0.0
    """C, 1/s²; zero of an axis without a spring to ground."""
    delay_s: float = 0.0
    """Td, s."""
    modes: tuple[Mode, ...] = ()
    """Structural modes."""

    def numbers(self) -> tuple[float, float, float, float]:
        """Returns A, B, C and Td."""
        return (self.gain_mm_per_v_s2, self.damping_per_s, self.stiffness_per_s2, self.delay_s)

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """Returns the response at frequencies, Hz, mm/V, in the shape of the frequencies."""
        lines = _values.real("frequency_hz", frequency_hz)
        modes = [tuple(mode) for mode in self.modes]
        return _quadrant.plant_response(self.numbers(), modes, lines.ravel()).reshape(lines.shape)

    def to_control(self, pade: int | None = 3) -> control.TransferFunction:
        """Returns python-control's transfer function; the dead time by a Padé approximation of that order, or left out (None)."""
        _values.needs("control")
        import control

        found = control.tf([self.gain_mm_per_v_s2], [1.0, self.damping_per_s, self.stiffness_per_s2])
        for mode in self.modes:
            w = 2 * np.pi * mode.frequency_hz
            above: list[float] = [1.0]
            if mode.anti is not None:
                a = 2 * np.pi * mode.anti[0]
                above = [1 / a**2, 2 * mode.anti[1] / a, 1.0]
            found = found * control.tf(above, [1 / w**2, 2 * mode.damping / w, 1.0])
        if pade is not None and self.delay_s > 0:
            found = found * control.tf(*control.pade(self.delay_s, pade))
        return found
