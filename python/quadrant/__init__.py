"""The Quadrant servo control law: as its firmware runs it, on a simulated stage, from recordings to settings, and on machines.

Positions are in mm, voltages at the amplifier's input in V, times in s, frequencies in Hz; a name ends with its unit.
"""

from . import design, files, friction, identify, machine
from ._commission import Commissioned, commission, print_progress
from ._errors import CommissioningError, Fault
from ._law import Axis
from ._quadrant import Motion, Settings, SimulatedAxis, Stage, __version__
from ._result import ManyResult, Result, SimulationResult
from ._simulate import simulate, simulate_many
from .identify import Mode, Plant
from .machine import Machine

__all__ = [
    "Axis",
    "Commissioned",
    "CommissioningError",
    "Fault",
    "Machine",
    "ManyResult",
    "Mode",
    "Motion",
    "Plant",
    "Result",
    "Settings",
    "SimulatedAxis",
    "SimulationResult",
    "Stage",
    "__version__",
    "commission",
    "design",
    "files",
    "friction",
    "identify",
    "machine",
    "print_progress",
    "simulate",
    "simulate_many",
]
