"""What callers give: values of settings, arrays, references and seeds."""

from __future__ import annotations

import importlib
import operator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._quadrant import Motion

_REFERENCE = (
    "a reference is a quadrant.Motion, an array of positions in mm, shape (n,), or a tuple of positions, velocities in mm/s and "
    "accelerations in mm/s², each of shape (n,)"
)


def plain(value: Any) -> Any:
    """Returns the number or the list that a scalar or an array of numpy is."""
    if isinstance(value, (np.generic, np.ndarray)) and value.dtype.kind in "biufU":
        return value.tolist()
    raise TypeError(f"{value!r} is no value of a setting: give a number, a text, True or False, a list, or None")


def real(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Returns an array of floats of any shape; what is masked is NaN. Raises `TypeError` for complex numbers."""
    array = np.asanyarray(values)
    if array.dtype.kind == "c":
        raise TypeError(f"{name} is complex: it must be real")
    if isinstance(array, np.ma.MaskedArray):
        array = np.ma.filled(array.astype(float), np.nan)
    return np.ascontiguousarray(array, dtype=float).reshape(array.shape)


def vector(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Returns an array of floats of shape (n,). Raises `ValueError` for another shape."""
    array = real(name, values)
    if array.ndim != 1:
        raise ValueError(f"{name} has the shape {array.shape}: it must be (n,)")
    return array


def whole(name: str, values: ArrayLike) -> NDArray[np.int64]:
    """Returns an array of integers of shape (n,). Raises `ValueError` for a number that is none."""
    array = np.asarray(values)
    if array.dtype.kind not in "iub":
        array = vector(name, array)
        bad = np.flatnonzero(array != np.rint(array))
        if len(bad):
            raise ValueError(f"{name}[{bad[0]}] = {array[bad[0]]} is not a whole number")
    if array.ndim != 1:
        raise ValueError(f"{name} has the shape {array.shape}: it must be (n,)")
    return np.ascontiguousarray(array, dtype=np.int64)


def reference(given: Any) -> Any:
    """Returns a reference as the extension takes it. Raises `TypeError` for what is none."""
    if isinstance(given, Motion):
        return given
    try:
        if isinstance(given, tuple) and len(given) == 3 and np.ndim(given[0]) == 1:
            names = ("position_mm", "velocity_mm_s", "acceleration_mm_s2")
            return tuple(vector(name, part) for name, part in zip(names, given))
        return vector("reference", given)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{_REFERENCE} ({error})") from None


def above_zero(name: str, value: float) -> float:
    """Returns a number above zero. Raises `ValueError` for another."""
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{name} = {value}: it must be a finite number above zero")
    return float(value)


def seed(value: Any) -> int:
    """Returns a seed. Raises `ValueError` for a number that is none."""
    found = operator.index(value)
    if not 0 <= found < 2**64:
        raise ValueError(f"seed = {found}: it must be 0 to 2**64 - 1")
    return found


def needs(package: str) -> None:
    """Raises `ModuleNotFoundError`, with the remedy, if a package that is not always installed is missing."""
    try:
        importlib.import_module(package)
    except ImportError:
        raise ModuleNotFoundError(f'this needs {package}: pip install {package}, or "quadrant-servo[all]"', name=package) from None
