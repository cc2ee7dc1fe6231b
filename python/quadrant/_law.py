"""The law as the firmware runs it."""

from __future__ import annotations

from typing import Union

from numpy.typing import ArrayLike

from . import _quadrant, _values
from ._result import Result

Reference = Union[_quadrant.Motion, ArrayLike, "tuple[ArrayLike, ArrayLike, ArrayLike]"]


class Axis(_quadrant.Axis):
    __doc__ = _quadrant.Axis.__doc__

    def run(self, reference: Reference, counts: ArrayLike) -> Result:
        """Runs a control period for each sample, from where the axis is.

        Parameters
        ----------
        reference : Motion, array of shape (n,), or tuple of three
            Where the axis is to be after the preview, mm; a tuple has velocities, mm/s, and accelerations,
            mm/s², too. A motion begins where the axis stands.
        counts : array of int, shape (n,)
            Counter of the encoder in each period; it may wrap.

        Returns
        -------
        Result
            Words, volts and every term; the error is that of the measured position.

        Raises
        ------
        quadrant.Fault
            What the law's monitors found, with its tick.
        ValueError
            Arrays that are not equally long, values that are not finite, or counts that are not whole.
        """
        signals = self.run_arrays(_values.reference(reference), _values.whole("counts", counts))
        return Result(rate_hz=self.rate_hz, resolution_mm=self.resolution_mm, **signals)
