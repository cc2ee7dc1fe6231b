"""Machines: a board, its image in QEMU, or the firmware's application in this process."""

from __future__ import annotations

import warnings
import weakref
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from types import TracebackType
from typing import TYPE_CHECKING, Any

from . import _quadrant, _values
from ._quadrant import Motion, Settings, Stage

if TYPE_CHECKING:
    import pandas

__all__ = ["Machine"]


def _forget(session: _quadrant.Session) -> None:
    """Disables the outputs of a machine that nobody has closed, when nothing refers to it or the program ends."""
    try:
        session.disable()
    except (OSError, RuntimeError):
        # It is closed already, or does not answer any more.
        pass
    finally:
        session.close()


def _names(channels: str | Sequence[str]) -> list[str]:
    return [channels] if isinstance(channels, str) else list(channels)


class Machine:
    """A session with a machine, which disables the outputs when it is left, whatever happens.

    Parameters
    ----------
    place : str
        ``"simulated"`` (the firmware's application in this process), ``"simulated:commissioned"``, ``"emulated"`` or
        ``"emulated:IMAGE"`` (its image in QEMU), a port such as ``"/dev/ttyACM0"`` or ``"serial:COM3"``, or ``"tcp:HOST:PORT"``.
    stage : Stage, optional
        Stage of a simulated or emulated machine.
    settings : Settings, optional
        Settings with which such a machine starts.
    seed : int
        Noise of its encoders.
    flash : path, optional
        File that keeps its flash.

    Raises
    ------
    ConnectionError
        A machine that does not answer, or is of another release.
    ValueError
        A place that is none.

    Notes
    -----
    Ctrl-C stops the axes. A fault raises `quadrant.Fault` with code, axis, cause and remedy. The time of a simulated or emulated
    machine passes while something waits for it: `wait`, `sleep`, `record`.

    Examples
    --------
    >>> with Machine("simulated:commissioned") as machine:
    ...     machine.enable()
    ...     machine.run({"x": Motion.sine(5.0, 20.0, cycles=1.0)})
    ...     frame = machine.record(["x.error", "x.position"], 2.0)
    """

    def __init__(
        self,
        place: str = "simulated",
        *,
        stage: Stage | None = None,
        settings: Settings | None = None,
        seed: int = 1,
        flash: str | PathLike[str] | None = None,
    ) -> None:
        if place == "emulated":
            place = "emulated:target/images/mps2-f32.elf"
        self._session = _quadrant.Session(place, stage, settings, _values.seed(seed), flash)
        self._closed = False
        weakref.finalize(self, _forget, self._session)

    def __enter__(self) -> Machine:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Disables the outputs and ends the session; what another thread waits for ends.

        A machine that does not answer any more ends what its host has started by itself: a `RuntimeWarning` says so.
        """
        if self._closed:
            return
        self._closed = True
        try:
            self._session.disable()
        except (OSError, RuntimeError) as error:
            warnings.warn(f"the outputs may still be on: {error}", RuntimeWarning, stacklevel=2)
        finally:
            self._session.close()

    @property
    def endpoint(self) -> str:
        """The other end."""
        return self._session.endpoint

    @property
    def identity(self) -> dict[str, Any]:
        """Firmware, board, control rate and number type."""
        return self._session.identity()

    def status(self) -> dict[str, Any]:
        """Returns state, fault, homed axes, and of each axis mode, position (mm), error (mm) and output (V)."""
        return self._session.status()

    def enable(self) -> None:
        """Switches the outputs on, holding where the axes stand."""
        self._session.enable()
        self._session.sleep(0.05)

    def disable(self) -> None:
        """Switches the outputs off."""
        self._session.disable()

    def stop(self) -> None:
        """Brakes to rest, and stays enabled."""
        self._session.stop()

    def reset(self) -> None:
        """Clears the latched fault."""
        self._session.reset()
        self._session.sleep(0.05)

    def fault(self) -> Exception | None:
        """Returns the latched fault, a `quadrant.Fault`, if there is one."""
        return self._session.fault()

    def home(self, axes: str = "xyz", *, timeout_s: float = 60.0) -> None:
        """Homes axes, and waits until they are homed."""
        self._session.home(axes)
        self._session.wait_homed(axes, timeout_s)

    def jog(self, axis: str, velocity_mm_s: float) -> None:
        """Moves an axis at a velocity until another one is asked for; zero brakes."""
        self._session.jog(axis, velocity_mm_s)

    def move(self, axis: str, target_mm: float, velocity_mm_s: float, *, timeout_s: float = 60.0) -> None:
        """Moves an axis to a position, and waits until it stands."""
        self._session.move_to(axis, target_mm, velocity_mm_s)
        self.wait(timeout_s)

    def run(self, motions: Mapping[str, Motion] | None = None) -> None:
        """Starts motions of axes together, from where they stand; without motions those of the last plan."""
        if motions is not None:
            self._session.set_plan(dict(motions))
        self._session.run()

    def wait(self, timeout_s: float = 60.0) -> dict[str, Any]:
        """Waits until no motion is under way; returns the status. Raises `quadrant.Fault`, or `TimeoutError`."""
        return self._session.wait_rest(timeout_s)

    def sleep(self, seconds: float) -> None:
        """Lets time pass, by the machine's clock if it is no real one. Raises `quadrant.Fault` if one is reported meanwhile."""
        self._session.sleep(seconds)

    def get(self, path: str) -> Any:
        """Returns a setting of the draft, such as ``"x/feedback/pid/kp_v_per_mm"``."""
        return self._session.get(path)

    def set(self, path: str, value: object) -> None:
        """Changes a setting of the draft; `apply` puts the draft in force."""
        self._session.set(path, value)

    def apply(self) -> None:
        """Checks the draft as a whole and puts it in force: all of it, or nothing (`RuntimeError`)."""
        self._session.apply()

    def store(self, provenance: str = "quadrant-servo") -> None:
        """Keeps the settings in force for the next start."""
        self._session.store(provenance)

    def settings(self) -> Settings:
        """Returns the settings in force."""
        return self._session.settings()

    def load(self, settings: Settings) -> None:
        """Switches the outputs off and puts settings in force."""
        self.disable()
        self._session.load(settings)

    def record(self, channels: str | Sequence[str], seconds: float, *, decimation: int | None = None) -> pandas.DataFrame:
        """Records channels.

        Parameters
        ----------
        channels : str or sequence of str
            Such as ``"x.error"``, ``"x.position"``, ``"x.output"``, ``"stage.state"``; eight at most.
        seconds : float
            Time, s.
        decimation : int, optional
            Control ticks in a sample; by default as few as a serial port carries.

        Returns
        -------
        pandas.DataFrame
            A column for each channel (positions and errors in mm, velocities in mm/s, voltages in V), indexed by ``t_s``, the time in s.
            ``frame.attrs["lost"]`` is the number of samples that were lost on the way.
        """
        _values.needs("pandas")
        import pandas

        found = self._session.record(_names(channels), seconds, decimation)
        lost = found.pop("lost")
        frame: pandas.DataFrame = pandas.DataFrame(found).set_index("t_s")
        frame.attrs["lost"] = lost
        return frame

    def watch(self, channels: str | Sequence[str], seconds: float, *, every_s: float = 0.2) -> Iterator[pandas.DataFrame]:
        """Yields what `record` gives, a piece every ``every_s``, for a time; some samples between two pieces are missing."""
        for _ in range(round(_values.above_zero("seconds", seconds) / _values.above_zero("every_s", every_s)) or 1):
            yield self.record(channels, every_s)

    def live_plot(self, channels: str | Sequence[str], seconds: float = 10.0, *, every_s: float = 0.5) -> None:
        """Plots channels while they come, in a notebook or in a window of matplotlib."""
        _values.needs("matplotlib")
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots()
        handle: Any = None
        try:
            from IPython.display import display
        except ImportError:
            pass
        else:
            show: Any = display
            handle = show(figure, display_id=True)
        start_s = 0.0
        for piece in self.watch(channels, seconds, every_s=every_s):
            for color, name in enumerate(_names(channels)):
                label = name if start_s == 0.0 else None
                axes.plot(start_s + piece.index, piece[name], color=f"C{color}", label=label, linewidth=0.8)
            axes.set_xlabel("time, s")
            axes.legend(loc="upper right")
            start_s += every_s
            if handle is None:
                plt.pause(0.01)
            else:
                handle.update(figure)
        plt.close(figure)

    def __repr__(self) -> str:
        return f"Machine({self.endpoint!r})"
