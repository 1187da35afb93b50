"""What solutions of one run share: an evaluator of outputs, and room for their records."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from gearmbs.dae.model.evaluator import Records


class Fills(Protocol):
    """What evaluates outputs: fills records piece by piece, in the order of time."""

    rdata: np.ndarray

    def fill(self, t: np.ndarray, y: np.ndarray, epochs: Any, records: Records) -> None:
        """Fill ``records`` for all rows of ``y``; ``epochs`` names the integer tables valid from each row on."""
        ...


class Shared:
    """An evaluator and room for records that solutions use in turn, made when somebody first evaluates an output.

    Runs of which everything is read from the integrator's own steps ask for neither.

    Parameters
    ----------
    evaluator : callable
        Returns an evaluator for output times in their order.
    records : callable
        Returns records for a number of output times.
    size : int
        Output times that there is room for.
    """

    def __init__(self, evaluator: Callable[[], Fills], records: Callable[[int], Records], size: int) -> None:
        self._make_evaluator, self._make_records, self.size = evaluator, records, size

    @cached_property
    def evaluator(self) -> Fills:
        """The evaluator."""
        return self._make_evaluator()

    @cached_property
    def room(self) -> Records:
        """Records for so many output times."""
        return self._make_records(self.size)
