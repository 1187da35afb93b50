"""Modifications of flanks: relief of tip, root and ends, crowning, lead, and a map over the whole flank.

They are described as faults are, and combine with them; see `gearmbs.gears.faults`, which offers them, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gearmbs.gears.fault import Fault, Flank
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.spec import require
from gearmbs.gears.tooth_deviations import ToothDeviations
from gearmbs.units import Quantity, shown, to_si


def _require_removal(relief: Fault, amount: Quantity) -> None:
    """Refuse a relief that would add material."""
    require(
        amount >= 0.0,
        f"{type(relief).__name__}.amount is {shown(amount, 'um')}: a relief takes material away; give 0 or more, or "
        "for flanks with more material a FlankMap with negative amounts",
    )


@dataclass(frozen=True, kw_only=True)
class TipRelief(Fault):
    """Material taken from the tip of all teeth.

    Parameters
    ----------
    amount : float or str
        At the tip; not negative.
    length : float or str
        Length of roll below the tip over which it extends.
    power : float
        1 linear, 2 parabolic.
    teeth, flank
        Which flanks.
    """

    label: ClassVar[str] = "tip relief"
    units: ClassVar[dict[str, str]] = {"amount": "length", "length": "length"}

    amount: Quantity = 20e-6
    length: Quantity = 3e-3
    power: float = 1.0
    teeth: Any = "all"
    flank: Flank = "both"

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_removal(self, self.amount)

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        name = type(self).__name__
        require(self.length > 0, f"{name}.length is {self.length} m; it must be positive")
        require(self.power >= 1, f"{name}.power is {self.power}; give 1 (linear) or more")
        relief = self.amount * np.clip(1 - self._distance(deviations, pair) / self.length, 0, None) ** self.power
        for flank in deviations.flanks(self.flank):
            deviations.shape[flank, deviations.tooth_list(self.teeth)] += relief

    def _distance(self, deviations: ToothDeviations, pair: PairGeometry) -> np.ndarray:
        return deviations.gear.sign * (deviations.gear.tip_roll_length - deviations.roll_length)


@dataclass(frozen=True, kw_only=True)
class RootRelief(TipRelief):
    """Material taken from the flank near the root; ``length`` counts from the start of the active profile."""

    label: ClassVar[str] = "root relief"

    def _distance(self, deviations: ToothDeviations, pair: PairGeometry) -> np.ndarray:
        start = pair.first_roll_lengths[self.wheel == "driven"]
        return np.maximum(deviations.gear.sign * (deviations.roll_length - start), 0.0)


@dataclass(frozen=True, kw_only=True)
class Crowning(Fault):
    """Flanks relieved towards both ends of the face, as a parabola.

    Parameters
    ----------
    amount : float or str
        At the ends of the face.
    teeth, flank
        Which flanks.
    """

    label: ClassVar[str] = "crowning"
    units: ClassVar[dict[str, str]] = {"amount": "length"}
    along_face: ClassVar[bool] = True

    amount: Quantity = 10e-6
    teeth: Any = "all"
    flank: Flank = "both"

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        relief = self.amount * (2 * deviations.section / deviations.gear.face_width) ** 2
        for flank in deviations.flanks(self.flank):
            deviations.shape[flank, deviations.tooth_list(self.teeth)] += relief[:, None]


@dataclass(frozen=True, kw_only=True)
class LeadCorrection(Fault):
    """A flank that leans along the face: helix slope, as a fault or against a known misalignment.

    Parameters
    ----------
    amount : float or str
        Material missing at the +z end less that at the -z end.
    teeth, flank
        Which flanks.
    """

    label: ClassVar[str] = "lead deviation"
    units: ClassVar[dict[str, str]] = {"amount": "length"}
    along_face: ClassVar[bool] = True

    amount: Quantity = 10e-6
    teeth: Any = "all"
    flank: Flank = "both"

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        slope = self.amount * deviations.section / deviations.gear.face_width
        for flank in deviations.flanks(self.flank):
            deviations.shape[flank, deviations.tooth_list(self.teeth)] += slope[:, None]


@dataclass(frozen=True, kw_only=True)
class EndRelief(Fault):
    """Material taken from the flanks near the ends of the face.

    Parameters
    ----------
    amount : float or str
        At the end of the face; not negative.
    length : float or str
        Part of the face over which it extends, from the end.
    power : float
        1 linear, 2 parabolic.
    ends : {0, 1, -1}
        0 for both ends, +1 for the one towards +z, -1 for the other.
    teeth, flank
        Which flanks.
    """

    label: ClassVar[str] = "end relief"
    units: ClassVar[dict[str, str]] = {"amount": "length", "length": "length"}
    along_face: ClassVar[bool] = True

    amount: Quantity = 20e-6
    length: Quantity = 3e-3
    power: float = 2.0
    ends: int = 0
    teeth: Any = "all"
    flank: Flank = "both"

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_removal(self, self.amount)

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        require(self.ends in (-1, 0, 1), f"EndRelief.ends is {self.ends}; choose 0 (both), 1 or -1")
        require(self.power >= 1, f"EndRelief.power is {self.power}; give 1 (linear) or more")
        width = deviations.gear.face_width
        require(
            0 < self.length <= width,
            f"EndRelief.length is {self.length} m; give more than 0 up to the face width, {width:.6g} m",
        )
        for end in (1, -1) if self.ends == 0 else (self.ends,):
            from_end = 0.5 * width - end * deviations.section
            relief = self.amount * np.maximum(0.0, 1 - from_end / self.length) ** self.power
            for flank in deviations.flanks(self.flank):
                deviations.shape[flank, deviations.tooth_list(self.teeth)] += relief[:, None]


@dataclass(frozen=True, kw_only=True)
class FlankMap(Fault):
    """A topological map: material missing over the whole flank, from a measurement or a grinding program.

    Parameters
    ----------
    amounts : sequence of sequences of float or str
        Material missing, m or text with a unit; negative for material added. Rows run along the face from its -z to its
        +z end, columns along the profile, evenly by length of roll, from the start of the active profile to the tip.
        Between rows it is taken linearly, between columns as monotone cubics; beyond the active profile it goes on as
        at its start.
    teeth, flank
        Which flanks.
    """

    label: ClassVar[str] = "flank map"
    along_face: ClassVar[bool] = True

    amounts: Any = ((0.0, 10e-6), (0.0, 0.0))
    teeth: Any = "all"
    flank: Flank = "both"

    def __post_init__(self) -> None:
        super().__post_init__()
        place = "FlankMap.amounts"
        rows = self.amounts
        good = isinstance(rows, (list, tuple, np.ndarray)) and len(rows) > 1
        good = good and all(isinstance(row, (list, tuple, np.ndarray)) and len(row) == len(rows[0]) > 1 for row in rows)
        require(good, f"{place} is {rows!r}; give two or more rows of equal length, each of two or more numbers")
        table = tuple(tuple(float(to_si(value, "length", place)) for value in row) for row in rows)
        require(bool(np.isfinite(table).all()), f"{place} holds a number that is not finite; give finite numbers")
        object.__setattr__(self, "amounts", table)

    @property
    def severity(self) -> float:
        """Largest amount, m."""
        return float(np.abs(self.amounts).max())

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        from scipy.interpolate import PchipInterpolator

        table = np.array(self.amounts)
        gear = deviations.gear
        start = pair.first_roll_lengths[self.wheel == "driven"]
        along = np.clip((deviations.roll_length - start) / (gear.tip_roll_length - start), 0, 1)
        profiles = PchipInterpolator(np.linspace(0, 1, table.shape[1]), table, axis=1)(along)
        rows = np.linspace(-0.5, 0.5, table.shape[0]) * gear.face_width
        places = np.searchsorted(rows, deviations.section).clip(1, rows.size - 1)
        share = ((deviations.section - rows[places - 1]) / (rows[places] - rows[places - 1]))[:, None]
        shape = (1 - share) * profiles[places - 1] + share * profiles[places]
        for flank in deviations.flanks(self.flank):
            deviations.shape[flank, deviations.tooth_list(self.teeth)] += shape
