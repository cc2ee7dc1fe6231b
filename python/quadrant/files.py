"""Recordings and results as files: CSV, Parquet and MAT."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _quadrant, _values
from ._result import Result

if TYPE_CHECKING:
    import pandas

__all__ = ["Recording", "read", "read_mat", "to_csv", "to_mat", "to_parquet"]

Path = Union[str, "PathLike[str]"]


@dataclass
class Recording:
    """Signals of a motion at equal times, each of shape (n,)."""

    sample_time_s: float
    """Time from one sample to the next, s."""
    position_mm: NDArray[np.float64]
    """Position, mm."""
    voltage_v: NDArray[np.float64]
    """Voltage, V, or force."""
    reference_mm: NDArray[np.float64]
    """Reference, mm; the position where there is none."""
    injection_v: NDArray[np.float64]
    """The part of the voltage that was injected, V."""
    notes: list[str] = field(default_factory=list)
    """What was guessed and done when the file was read."""

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Time from the first sample, s."""
        return np.arange(len(self.position_mm), dtype=float) * self.sample_time_s

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a data frame with a column for each signal, indexed by ``t_s``."""
        _values.needs("pandas")
        import pandas

        frame: pandas.DataFrame = pandas.DataFrame(_signals(self)).set_index("t_s")
        return frame


def read(path: Path, columns: str | None = None, *, resample: bool = False) -> Recording:
    """Reads a recording of this or of another program from CSV, and checks it.

    Parameters
    ----------
    path : path
        A file with a header. Delimiter, decimal sign, lines before the header, and usual names and units are recognised.
    columns : str, optional
        Columns and units where they are not: ``"time=Zeit:ms,position=Ist:um,voltage=Moment:Nm"``, as ``--columns`` of the command line.
    resample : bool
        True interpolates uneven steps of time, which are refused otherwise.

    Raises
    ------
    ValueError
        Line, column and value of what is refused, and what is allowed.
    OSError
        A file that cannot be read.
    """
    signals, notes = _quadrant.read_recording(path, columns, resample)
    return Recording(notes=notes, **signals)


def _signals(source: Result | Recording | Mapping[str, ArrayLike] | pandas.DataFrame) -> dict[str, Any]:
    if isinstance(source, Result):
        return source.to_dict()
    if isinstance(source, Recording):
        names = ("reference_mm", "position_mm", "voltage_v", "injection_v")
        return {"t_s": source.time_s, **{name: getattr(source, name) for name in names}}
    if hasattr(source, "reset_index"):
        frame = source.reset_index()
        return {str(name): frame[name].to_numpy() for name in frame.columns}
    return {name: np.asarray(values) for name, values in source.items()}


def to_csv(source: Result | Recording, path: Path) -> None:
    """Writes a recording as the CSV file that the command line and `read` read, every number in full.

    Of a result of the law these are the reference, the position by the encoder and the output.
    """
    if isinstance(source, Result):
        volts = source.output_v.astype(float)
        source = Recording(1.0 / source.rate_hz, source.measured_mm, volts, source.reference_mm, np.zeros(len(source)))
    _quadrant.write_recording(
        path, source.sample_time_s, source.reference_mm, source.position_mm, source.voltage_v, source.injection_v
    )


def to_parquet(source: Result | Recording | Mapping[str, ArrayLike] | pandas.DataFrame, path: Path) -> None:
    """Writes signals as a Parquet file, a column each; needs pandas and pyarrow."""
    _values.needs("pandas")
    import pandas

    pandas.DataFrame(_signals(source)).to_parquet(path)


def to_mat(source: Result | Recording | Mapping[str, ArrayLike] | pandas.DataFrame, path: Path) -> None:
    """Writes signals as a MAT file of version 5, a column vector each, for MATLAB; needs SciPy."""
    _values.needs("scipy")
    from scipy.io import savemat

    signals = {name.replace(".", "_").replace("-", "_"): values for name, values in _signals(source).items()}
    savemat(fspath(path), signals, oned_as="column")


def read_mat(path: Path, *, time: str, position: str, voltage: str, reference: str | None = None) -> Recording:
    """Reads a recording from a MAT file by the names of its variables: time in s, evenly spaced, position in mm and voltage in V."""
    _values.needs("scipy")
    from scipy.io import loadmat

    found = loadmat(fspath(path), squeeze_me=True)
    missing = [name for name in (time, position, voltage, reference) if name is not None and name not in found]
    if missing:
        there = ", ".join(sorted(name for name in found if not name.startswith("__")))
        raise KeyError(f"{path} has no variable {missing[0]}; there are {there}")
    times, positions, voltages, references = (
        _values.vector(name, np.atleast_1d(found[name])) for name in (time, position, voltage, reference or position)
    )
    lengths = {name: len(np.atleast_1d(found[name])) for name in (time, position, voltage, reference or position)}
    if len(set(lengths.values())) > 1 or len(times) < 2:
        raise ValueError(f"{path}: the variables have {lengths} samples; they must have as many, two or more")
    steps = np.diff(times)
    sample_time_s = float(np.mean(steps))
    if not np.max(np.abs(steps - sample_time_s)) <= 1e-3 * sample_time_s:
        raise ValueError(f"{path}: steps of {time} are {np.min(steps)} to {np.max(steps)} s; they must be even within a thousandth")
    return Recording(sample_time_s, positions, voltages, references, np.zeros(len(times)))
