"""Exceptions of the package that are no exceptions of Python."""

from __future__ import annotations


class Fault(RuntimeError):
    """A fault of the control law or of a machine, which switches the outputs off.

    Attributes
    ----------
    code : int
        Stable number, 1 to 33.
    name : str
        Stable name, such as ``"following-error"``.
    axis : str or None
        Axis, ``"x"``, ``"y"`` or ``"z"``, if it is about one.
    tick : int or None
        Control tick that found it, if it is known.
    cause, remedy : str
        Cause and remedy in words.
    """

    def __init__(
        self, code: int, name: str, axis: str | None, tick: int | None, cause: str, remedy: str
    ) -> None:
        super().__init__(code, name, axis, tick, cause, remedy)
        self.code = code
        self.name = name
        self.axis = axis
        self.tick = tick
        self.cause = cause
        self.remedy = remedy

    def __str__(self) -> str:
        where = self.axis or "the stage"
        when = "" if self.tick is None else f" at tick {self.tick}"
        return f"fault {self.code} ({self.name}) on {where}{when}: {self.cause}; {self.remedy}"


class CommissioningError(RuntimeError):
    """A commissioning that ended early, with the step, the reason and what would help."""
