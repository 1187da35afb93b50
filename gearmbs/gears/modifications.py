"""Modifications of flanks: relief of tip, root and ends, crowning, lead, and a map over the whole flank.

They are described as faults are, and combine with them; see `gearmbs.gears.faults`, which offers them, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from numbers import Integral, Real
from typing import Any, ClassVar, Literal

import numpy as np

from gearmbs._display import Written
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.spec import GearSpec, convert_fields
from gearmbs.units import Given, Quantity, shown, to_si, truth

# Deviations of the tooth flanks of one wheel, to which every fault adds its own; packed into the contact tables.


PROFILE_POINTS = 65
FACE_SECTIONS = 33
"""Sections along the face where flanks vary along it, at least."""
MOST_SECTIONS = 257
"""The same at most: 100 teeth have 27 MB of them."""
MOST_LONG = 3.0
"""Length of a fault, by the face width or ten modules, at most: a relief longer than its flank still has a meaning."""
STEPS_A_DETAIL = 3
"""Sections, and slices of the contact, over the length in which a flank changes: a parabola is then good to 1.4 %."""
COMPLIANCE_POINTS = 65


class ToothDeviations:
    """Deviations of every tooth flank of one wheel.

    Material missing from a flank, along its normal, is positive. Flank 0 is the one at the counter-clockwise side of
    its tooth, seen against the wheel's axis; flank 1 the other.

    Attributes
    ----------
    gear : GearSpec
    drive : int
        The flank that carries the load.
    roll_length : ndarray, shape (ns,)
        Points of the profile from the base circle (of an internal wheel: from the root) to the tip, by their length of
        roll, m.
    section : ndarray, shape (nz,)
        Transverse sections along the face, from mid-face, m.
    offset : ndarray, shape (2, z)
        Constant material missing per flank, m.
    shape : ndarray, shape (2, z, nz, ns)
        Material missing over face and profile, m.
    tip : ndarray, shape (2, z, nz)
        Length of roll where the flank ends at the tip, m.
    compliance : ndarray, shape (2, z, nc)
        Compliance added to a tooth pair, relative to a healthy pair's, at `compliance_roll_length`.
    compliance_roll_length : ndarray, shape (nc,)
        Lengths of roll on this wheel, m.
    """

    def __init__(self, gear: GearSpec, rotation: int, sections: int, compliance_roll_length: np.ndarray) -> None:
        z, nz = gear.teeth, sections
        self.gear = gear
        self.drive = 0 if rotation > 0 else 1
        start = gear.form_roll_length if gear.internal else 0.0
        self.roll_length = np.linspace(start, gear.tip_roll_length, PROFILE_POINTS)
        self.section = np.linspace(-0.5, 0.5, nz) * gear.face_width
        self.offset = np.zeros((2, z))
        self.shape = np.zeros((2, z, nz, PROFILE_POINTS))
        self.tip = np.full((2, z, nz), gear.tip_roll_length)
        self.compliance_roll_length = compliance_roll_length
        self.compliance = np.zeros((2, z, compliance_roll_length.size))

    @property
    def radius(self) -> np.ndarray:
        """Radii of the points of the profile, m."""
        return np.hypot(self.gear.base_radius, self.roll_length)

    def flanks(self, which: str) -> list[int]:
        """Flank numbers of ``"drive"``, ``"coast"`` or ``"both"``."""
        choices = {"drive": [self.drive], "coast": [1 - self.drive], "both": [0, 1]}
        if which not in choices:
            raise ValueError(f"flank is {which!r}; choose 'drive', 'coast' or 'both'")
        return choices[which]

    def normal_angle(self, flank: int) -> np.ndarray:
        """Direction of the outward normal in the wheel's frame, rad, shape (z, nz, ns)."""
        side = 1 - 2 * flank
        middle = 2 * math.pi * np.arange(self.gear.teeth) / self.gear.teeth
        lead = self.gear.twist_tangent / self.gear.base_radius * self.section
        turned = self.gear.sign * self.roll_length / self.gear.base_radius
        tangent = middle[:, None, None] + lead[:, None] + side * (self.gear.base_half_angle - turned)
        return tangent + side * 0.5 * math.pi

    def shift(self, x: np.ndarray | float, y: np.ndarray | float) -> None:
        """Displace the whole toothing by (x, y) in the wheel's frame, m; arrays run along the face."""
        x = np.broadcast_to(np.asarray(x, dtype=float), self.section.shape)
        y = np.broadcast_to(np.asarray(y, dtype=float), self.section.shape)
        for flank in (0, 1):
            angle = self.normal_angle(flank)
            self.shape[flank] -= x[:, None] * np.cos(angle) + y[:, None] * np.sin(angle)

    def shorten(self, tooth: int, radius: np.ndarray) -> None:
        """Cut both flanks of a tooth at these radii along the face, m."""
        roll_length = np.sqrt(np.maximum(radius**2 - self.gear.base_radius**2, 0.0))
        # a shorter tooth ends at a larger radius where teeth point inwards
        shorter = np.maximum if self.gear.internal else np.minimum
        self.tip[:, tooth] = shorter(self.tip[:, tooth], roll_length)

    def tooth_list(self, teeth: object) -> list[int]:
        """Tooth numbers from ``"all"``, one number or several; numbers wrap around the wheel."""
        if isinstance(teeth, str):
            if teeth != "all":
                raise ValueError(f"teeth is {teeth!r}; give 'all', a tooth number or several")
            return list(range(self.gear.teeth))
        numbers = [teeth] if isinstance(teeth, int) else list(teeth)  # type: ignore[call-overload]
        return [int(n) % self.gear.teeth for n in numbers]


# What all faults of teeth share: a wheel, a severity, a label, checked settings.


Wheel = Literal["driver", "driven"]
Flank = Literal["drive", "coast", "both"]

CHOICES: dict[str, tuple[Any, ...]] = {
    "wheel": ("driver", "driven"),
    "flank": ("drive", "coast", "both"),
    "end": (1, -1),
}
COAST_ALIASES = {"back": "coast"}
"""The former name of the coast flank, still understood."""


@dataclass(frozen=True, kw_only=True)
class Fault(Written):
    """What all faults share.

    Parameters
    ----------
    wheel : {"driver", "driven"}
        The wheel that has it.

    Raises
    ------
    ValueError
        For a setting of the wrong kind; the message names the field, its value and what would do. What a wheel must
        fit, such as a length along its face, is found when the fault is applied to its wheel.
    """

    label: ClassVar[str] = "fault"
    units: ClassVar[dict[str, str]] = {}
    least: ClassVar[dict[str, int]] = {}
    along_face: ClassVar[bool] = False

    wheel: Wheel = "driver"

    def __post_init__(self) -> None:
        name = type(self).__name__
        for item in fields(self):
            value, place = getattr(self, item.name), f"{name}.{item.name}"
            if item.name in self.units:
                if value is None and item.default is not None:
                    raise ValueError(f"{place} is None; give a number")
            elif item.name in CHOICES:
                value = COAST_ALIASES.get(value, value) if item.name == "flank" and isinstance(value, str) else value
                value = _choice(value, place, CHOICES[item.name])
            elif item.name == "teeth":
                value = _tooth_numbers(value, place)
            elif isinstance(item.default, bool):
                value = truth(value, place)
            elif isinstance(item.default, int):
                value = _whole(value, place, self.least.get(item.name))
            elif isinstance(item.default, float):
                value = _real(value, place)
            object.__setattr__(self, item.name, value)
        try:
            convert_fields(self, self.units, name)
        except TypeError as error:
            raise ValueError(str(error)) from None
        for key in self.units:
            value = getattr(self, key)
            if not (value is None or math.isfinite(value)):
                raise ValueError(f"{name}.{key} is {value}; give a finite number")

    def check_teeth(self, count: int) -> None:
        """Refuse teeth that a wheel of so many teeth does not have; negative numbers count from its last.

        Raises
        ------
        ValueError
            Naming the field, the tooth and those that there are.
        """
        for name in ("tooth", "teeth"):
            numbers = getattr(self, name, ())
            for tooth in (numbers,) if isinstance(numbers, int) else () if isinstance(numbers, str) else numbers:
                if not -count <= tooth < count:
                    raise ValueError(
                        f"{type(self).__name__}.{name} is {tooth}; the {self.wheel} wheel has teeth 0 to {count - 1}"
                    )

    def check_sizes(self, gear: GearSpec) -> None:
        """Refuse sizes that its wheel's teeth do not have: a number without its unit, or with another one.

        Raises
        ------
        ValueError
            Naming the field, its value and what it may be at most.
        """
        for name in self.units:
            value = getattr(self, name)
            length = name in ("length", "height", "width")
            most = MOST_LONG * max(gear.face_width, 10.0 * gear.module) if length else gear.module
            if value is not None and (length or name in ("amount", "depth")):
                self._check_size(name, value, most, "mm" if length else "um")

    def _check_size(self, name: str, value: float, most: float, unit: str) -> None:
        if not abs(value) <= most:
            given = isinstance(value, Given)
            raise ValueError(
                f"{type(self).__name__}.{name} is {shown(value, 'mm') if given else f'{value:g} m'}, and its wheel has "
                f"no room for more than {shown(most, 'mm', '.4g')}; "
                + ("give less" if given else f"a plain number is in m, write '{value:g} {unit}'")
            )

    def face_detail(self, gear: GearSpec) -> tuple[str, float]:
        """Field by which flanks vary along the face, and length in which they change, m; infinite if they do not."""
        return "", gear.face_width if self.along_face else math.inf

    @property
    def severity(self) -> float:
        """Size of the fault, by its own main parameter."""
        return float(getattr(self, next(iter(self.units))))

    @property
    def description(self) -> dict[str, Any]:
        """Label, severity and all parameters, for storing beside results."""
        return {"label": self.label, "severity": self.severity, **asdict(self)}

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        """Add what the fault does to the deviations of its wheel.

        Parameters
        ----------
        deviations : ToothDeviations
            Of the wheel that has the fault.
        pair : PairGeometry
            The pair it is in.
        """
        raise TypeError(f"{type(self).__name__} does not say what it does to a tooth")


def turned_by_helix(gear: GearSpec, waves: int = 1) -> float:
    """Length along the face in which a helix turns the flank's normal by a radian of a wave, m; infinite for spurs."""
    turned = waves * abs(gear.twist_tangent) / gear.base_radius
    return 1.0 / turned if turned > 0.0 else math.inf


def face_sections(faults: Iterable[Fault], wheels: tuple[GearSpec, GearSpec]) -> int:
    """Sections along the face that the flanks with these faults need; two where none varies along it.

    Raises
    ------
    ValueError
        For details that `MOST_SECTIONS` do not resolve; the message names the field, its value and what would do.
    """
    most = 2
    for fault in faults:
        gear = wheels[fault.wheel == "driven"]
        field, detail = fault.face_detail(gear)
        if detail == math.inf:
            continue
        steps = STEPS_A_DETAIL * gear.face_width / detail
        if steps > MOST_SECTIONS - 1:
            least, value = STEPS_A_DETAIL * gear.face_width / (MOST_SECTIONS - 1), getattr(fault, field)
            if not isinstance(value, int):
                value = f"{len(value)} rows" if isinstance(value, tuple) else shown(value, "mm", ".4g")
            raise ValueError(
                f"{type(fault).__name__}.{field} is {value}: it changes the flanks within "
                f"{shown(detail, 'mm', '.3g')} along a face of {shown(gear.face_width, 'mm', '.4g')}, and sections "
                f"resolve {shown(least, 'mm', '.3g')} and more; make the fault coarser or the face narrower"
            )
        # a multiple of the fewest, so that what falls on those still does
        most = max(most, (FACE_SECTIONS - 1) * max(1, math.ceil(steps / (FACE_SECTIONS - 1))) + 1)
    return most


def _require_removal(relief: Fault, amount: Quantity) -> None:
    """Refuse a relief that would add material."""
    if not amount >= 0.0:
        raise ValueError(
            f"{type(relief).__name__}.amount is {shown(amount, 'um')}: a relief takes material away; give 0 or more, "
            "or for flanks with more material a FlankMap with negative amounts"
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
        if not self.length > 0:
            raise ValueError(f"{name}.length is {self.length} m; it must be positive")
        if not self.power >= 1:
            raise ValueError(f"{name}.power is {self.power}; give 1 (linear) or more")
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

    def face_detail(self, gear: GearSpec) -> tuple[str, float]:
        return "length", self.length if self.length > 0 else gear.face_width

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        if self.ends not in (-1, 0, 1):
            raise ValueError(f"EndRelief.ends is {self.ends}; choose 0 (both), 1 or -1")
        if not self.power >= 1:
            raise ValueError(f"EndRelief.power is {self.power}; give 1 (linear) or more")
        width = deviations.gear.face_width
        if not 0 < self.length <= width:
            raise ValueError(
                f"EndRelief.length is {self.length} m; give more than 0 up to the face width, {width:.6g} m"
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
        if not good:
            raise ValueError(f"{place} is {rows!r}; give two or more rows of equal length, each of two or more numbers")
        table = tuple(tuple(float(to_si(value, "length", place)) for value in row) for row in rows)
        if not bool(np.isfinite(table).all()):
            raise ValueError(f"{place} holds a number that is not finite; give finite numbers")
        object.__setattr__(self, "amounts", table)

    def check_sizes(self, gear: GearSpec) -> None:
        self._check_size("amounts", max((value for row in self.amounts for value in row), key=abs), gear.module, "um")

    def face_detail(self, gear: GearSpec) -> tuple[str, float]:
        return "amounts", gear.face_width / (len(self.amounts) - 1)

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


# Settings of faults that are no quantities: numbers of teeth, counts, choices and switches.


def _whole(value: Any, field: str, least: int | None = None) -> int:
    """Return a whole number as ``int``.

    Raises
    ------
    ValueError
        For fractions, text and truth values, and for numbers below ``least``; the message names the field.
    """
    wanted = "a whole number" if least is None else f"a whole number from {least} up"
    good = isinstance(value, Integral) and not isinstance(value, (bool, np.bool_))
    if not good or (least is not None and value < least):
        raise ValueError(f"{field} is {value!r}; give {wanted}")
    return int(value)


def _real(value: Any, field: str) -> float:
    """Return a finite number as ``float``.

    Raises
    ------
    ValueError
        For anything else; the message names the field.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real) or not math.isfinite(value):
        raise ValueError(f"{field} is {value!r}; give a finite number")
    return float(value)


def _choice(value: Any, field: str, choices: tuple[Any, ...]) -> Any:
    """Return a value that is one of the choices.

    Raises
    ------
    ValueError
        For anything else; the message names the field and the choices.
    """
    if isinstance(value, Integral) and not isinstance(value, (bool, np.bool_)):
        value = int(value)
    known = isinstance(value, (str, int)) and not isinstance(value, bool) and value in choices
    if not known:
        names = [repr(item) for item in choices]
        raise ValueError(f"{field} is {value!r}; choose {', '.join(names[:-1])} or {names[-1]}")
    return value


def _tooth_numbers(value: Any, field: str) -> Any:
    """Return ``"all"``, a tooth number, or several, as plain integers.

    Raises
    ------
    ValueError
        For anything else and for no tooth at all; the message names the field.
    """
    remedy = "give 'all', a tooth number or several"
    if isinstance(value, str):
        if value != "all":
            raise ValueError(f"{field} is {value!r}; {remedy}")
        return value
    if not isinstance(value, Iterable):
        try:
            return _whole(value, field)
        except ValueError:
            raise ValueError(f"{field} is {value!r}; {remedy}") from None
    try:
        numbers = [_whole(item, field) for item in value]
    except ValueError as error:
        raise ValueError(f"{error} or several, or 'all'") from None
    if not numbers:
        raise ValueError(f"{field} is empty; {remedy}")
    return tuple(numbers) if isinstance(value, tuple) else numbers
