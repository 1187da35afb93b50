"""Kinematic lines of a rolling bearing: what a measurement needs to know of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from .errors import SignalError

OUTER, INNER, ELEMENT, CAGE = "outer race", "inner race", "rolling element", "cage"
PARTS = (OUTER, INNER, ELEMENT, CAGE)


@dataclass(frozen=True)
class BearingLines:
    """Frequencies of a bearing by turns of its shaft, the outer ring at rest.

    Attributes
    ----------
    name : str
    ftf, bsf, bpfo, bpfi : float
        Cage, spin of an element, passes of elements over a point of the outer and of the inner ring.
    ratio : float
        Speed of the bearing's shaft by the speed that is given.
    """

    name: str
    ftf: float
    bsf: float
    bpfo: float
    bpfi: float
    ratio: float = 1.0

    def __post_init__(self) -> None:
        for field in ("ftf", "bsf", "bpfo", "bpfi", "ratio"):
            value = getattr(self, field)
            if not (isinstance(value, (int, float)) and 0.0 < value < 1e4):
                raise SignalError(f"bearing {self.name!r}: {field} must be a positive number, got {value!r}")

    @property
    def orders(self) -> dict[str, float]:
        """Order of the fundamental line of each part: a defect of an element strikes twice a turn of its own."""
        return {OUTER: self.bpfo, INNER: self.bpfi, ELEMENT: 2.0 * self.bsf, CAGE: self.ftf}

    @property
    def sidebands(self) -> dict[str, float]:
        """Order of the spacing of each part's sidebands: how often it passes the load; 0 where it stands still."""
        return {OUTER: 0.0, INNER: 1.0, ELEMENT: self.ftf, CAGE: 0.0}

    def table(self, shaft: float, harmonics: int = 3) -> pd.DataFrame:
        """Return the kinematic lines at a shaft frequency in Hz: part, harmonic, Hz, spacing of sidebands."""
        turns = shaft * self.ratio
        rows = [
            (self.name, part, k, k * order * turns, self.sidebands[part] * turns)
            for part, order in self.orders.items()
            for k in range(1, harmonics + 1)
        ]
        return pd.DataFrame(rows, columns=["bearing", "part", "harmonic", "frequency", "sideband_spacing"])


def bearing_lines(bearing: Any, ratio: float = 1.0) -> BearingLines:
    """Return the lines of a bearing in whatever shape it is given.

    Parameters
    ----------
    bearing : BearingLines, Bearing, str or mapping
        A `gearmbs.bearings.Bearing`; its designation; or the multiples by name, FTF, BSF, BPFO and BPFI.
    ratio : float
        Speed of its shaft by the speed of the record.

    Raises
    ------
    SignalError
        If it cannot be read, or the designation is unknown; the message says what is missing.
    """
    if isinstance(bearing, BearingLines):
        return bearing
    if isinstance(bearing, str):
        from gearmbs.bearings import Bearing, BearingError

        try:
            bearing = Bearing.from_designation(bearing)
        except BearingError as error:
            raise SignalError(f"bearing: {error}") from None
    if isinstance(bearing, Mapping):
        given = {str(key).lower(): value for key, value in bearing.items()}
        missing = [name.upper() for name in ("ftf", "bsf", "bpfo", "bpfi") if name not in given]
        if missing:
            raise SignalError(
                f"bearing: {', '.join(missing)} missing; give FTF, BSF, BPFO and BPFI by turns of the shaft"
            )
        numbers = {name: float(given[name]) for name in ("ftf", "bsf", "bpfo", "bpfi")}
        return BearingLines(str(given.get("name", "bearing")), **numbers, ratio=ratio)
    try:
        name = bearing.designation or bearing.kind
        return BearingLines(name, bearing.ftf, bearing.bsf, bearing.bpfo, bearing.bpfi, ratio)
    except AttributeError:
        raise SignalError(
            f"bearing: {bearing!r} is none; give a designation such as '6205', a Bearing, or its multiples by name"
        ) from None
