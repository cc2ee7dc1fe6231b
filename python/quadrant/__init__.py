"""The Quadrant servo control law: as its firmware runs it, on a simulated stage, from recordings to settings, and on machines.

Positions are in mm, voltages at the amplifier's input in V, times in s, frequencies in Hz; a name ends with its unit.
"""

from ._errors import Fault
from ._law import Axis
from ._quadrant import Motion, Settings, SimulatedAxis, Stage, __version__
from ._result import ManyResult, Result, SimulationResult
from ._simulate import simulate, simulate_many

__all__ = [
    "Axis",
    "Fault",
    "ManyResult",
    "Motion",
    "Result",
    "Settings",
    "SimulatedAxis",
    "SimulationResult",
    "Stage",
    "__version__",
    "simulate",
    "simulate_many",
]
