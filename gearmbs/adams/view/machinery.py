"""Gears of ADAMS/Machinery in command files: their wheels as parts, their simplified force as a pair of this program.

Command files hold what decks do not: teeth, module, pressure and helix angle, width, profile shift, stiffness, damping
and play by their names. The names of what wheels and forces have are those of exported files, what they mean is in the
manual's pages on the dialog boxes of the simplified method.
"""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any

from gearmbs.adams.view.deckmaker import Deckmaker, Made
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Database, Item
from gearmbs.adams.view.values import Stored, Values, fixed
from gearmbs.adams.write.text import listed

if TYPE_CHECKING:
    from gearmbs.gears import GearPair, GearSpec

ELEMENT, FORCE, SET = "udes.ac_am_cylindrical_gear_element", "udes.ac_am_simplified_helical_gear_force", "udes.gear_set"
"""Definitions, by the last two parts of their names."""
ALIKE = 1e-4
"""Relative difference of moments of inertia across the axis that are taken as equal: files have ten digits of them."""
CONNECTIONS = {"fixed": "FIXED", "rotational": "REVOLUTE"}
STIFFNESSES = ("compliant_stiffness", "compliant_tstiffness", "compliant_damping", "compliant_tdamping")


def add_wheel(db: Database, item: Item, line: int) -> None:
    """Make the part of a gear element, at its reference marker, which commands go on to name."""
    part = db.add("part", f"{item.path}.gear_part", line)
    marker = ("name", f"{item.path}.ref_marker")
    for key, function in (("location", "LOC_RELATIVE_TO"), ("orientation", "ORI_RELATIVE_TO")):
        tree = ("call", function, (("value", [0.0, 0.0, 0.0]), marker))
        part.fields[key] = Stored((("tree", tree),), line)


def _held(values: Values, item: Item, name: str, default: Any = None) -> Any:
    """Return what an instance has under a name.

    Raises
    ------
    ViewError
        If it has nothing there, and there is no default.
    """
    found = values.db.items.get(f"{item.path}.{name}".lower())
    value = default if found is None else values.variable(found)
    if value is None:
        raise ViewError(f"its {name} is missing", item.line)
    return value


def _number(values: Values, item: Item, name: str, default: float | None = None) -> float:
    value = _held(values, item, name, default)
    if not isinstance(value, (int, float)):
        raise ViewError(f"its {name} is no number", item.line)
    return float(value)


def weigh(db: Database, values: Values) -> None:
    """Give the parts of gear elements their mass, before statements are made."""
    for item in db.of("ude"):
        part = db.items.get(f"{item.path}.gear_part".lower())
        if values.definition(item) != ELEMENT or part is None or "mass" in part.fields:
            continue
        try:
            part.fields["mass"] = fixed(_number(values, item, "mass"), line=item.line)
            inertia = [_number(values, item, key) for key in ("ixx", "iyy", "izz")]
            if str(_held(values, item, "define_mass_by", "user")).lower().startswith(("material", "density", "geom")):
                # of geometry View gives principal moments, the largest first, whatever the axes
                inertia = _about_z(inertia)
            for key, value in zip(("ixx", "iyy", "izz"), inertia):
                part.fields[key] = fixed(value, line=item.line)
            offset = [_number(values, item, f"cm_location_from_part_{axis}", 0.0) for axis in "xyz"]
        except ViewError:
            # named where the statement is made
            continue
        if any(offset):
            db.add("marker", f"{part.path}.cm", item.line).fields["location"] = fixed(*offset, line=item.line)


def _about_z(moments: list[float]) -> list[float]:
    """Return principal moments of a wheel with the one that differs from the two others last."""
    a, b, c = moments
    for polar, one, other in ((a, b, c), (b, a, c), (c, a, b)):
        if abs(one - other) <= ALIKE * max(abs(one), abs(other)):
            return [one, other, polar]
    return moments


def make_wheel(m: Deckmaker, item: Item) -> None:
    """Connect a wheel with the part of its reference marker.

    Raises
    ------
    ViewError
    """
    _number(m.values, item, "mass")
    part = m.db.items.get(f"{item.path}.gear_part".lower())
    marker = _held(m.values, item, "ref_marker")
    if not isinstance(marker, Item) or marker.kind != "marker" or part is None:
        raise ViewError("its ref_marker is missing")
    own = m.new_marker(item, part, *m.values.pose(part))
    how = str(_held(m.values, item, "conn_type", "none")).lower()
    ends = f"I = {own}", f"J = {m.id(marker)}"
    if how in CONNECTIONS:
        m.add(item, f"JOINT/{m.fresh('JOINT')}", CONNECTIONS[how], *ends)
    elif how == "compliant":
        k, kt, c, ct = (_held(m.values, item, name, [0.0, 0.0, 0.0]) for name in STIFFNESSES)
        if any((*k, *kt, *c, *ct)):
            turning = [[x / m.radian for x in row] for row in (kt, ct)]
            rows = zip(("K", "KT", "C", "CT"), (k, turning[0], c, turning[1]))
            m.add(item, f"BUSHING/{m.fresh('BUSHING')}", *ends, *(f"{key} = {listed(row)}" for key, row in rows))
    elif how != "none":
        raise ViewError(f"conn_type = {how[:40]}; give fixed, rotational, compliant or none, and joints of your own")


def _wheel(m: Deckmaker, item: Item) -> GearSpec:
    """Return the wheel of a gear element.

    Raises
    ------
    ViewError
        If it is none that is modelled.
    """
    from gearmbs.gears import GearSpec

    length = m.db.units.si("length")
    internal = str(_held(m.values, item, "gear_type", "external")).lower() == "internal"
    teeth, shift = _number(m.values, item, "num_teeth"), _number(m.values, item, "profile_shifting", 0.0)
    module = length * _number(m.values, item, "module")
    if internal and shift:
        raise ViewError(
            f"{item.path}: profile_shifting = {shift:g} of an internal wheel, whose sense is not published; give 0 and "
            "another addendum_factor, or build the pair in Python"
        )
    for name in ("tip_relief_coeff", "crown_magnitude"):
        if _number(m.values, item, name, 0.0):
            m.remark(item, f"{name} is not modelled: the flanks are involutes")
    more: dict[str, Any] = {}
    if str(_held(m.values, item, "involute_def", "standard")).lower() == "standard":
        more["addendum"] = (_number(m.values, item, "addendum_factor", 1.0) + shift) * module
        more["dedendum"] = (_number(m.values, item, "dedendum_factor", 1.25) - shift) * module
    else:
        beta = m.radian * _number(m.values, item, "beta", 0.0)
        pitch = module * abs(teeth) / (2.0 * math.cos(beta))
        sign = -1.0 if internal else 1.0
        more["addendum"] = sign * (length * _number(m.values, item, "tip_radius") - pitch)
        more["dedendum"] = sign * (pitch - length * _number(m.values, item, "foot_radius"))
    hand = str(_held(m.values, item, "hand_of_helix", "right")).lower()
    return GearSpec(
        teeth=round(abs(teeth)),
        module=module,
        pressure_angle=m.radian * _number(m.values, item, "alfa", 20.0),
        face_width=length * _number(m.values, item, "width"),
        profile_shift=shift,
        helix_angle=m.radian * _number(m.values, item, "beta", 0.0),
        hand="left" if hand.startswith("l") else "right",
        bore_radius=0.0 if internal else length * _number(m.values, item, "shaft_radius", 0.0),
        internal=internal,
        name=item.name,
        **more,
    )


def _pair(m: Deckmaker, item: Item, wheels: list[Item]) -> GearPair:
    """Return the pair of a simplified gear force.

    Its stiffness is that of the mesh: a constant one of each tooth pair times the contact ratio, in the mean.

    Raises
    ------
    ViewError
        If the wheels do not mesh, or the stiffness is another than a constant.
    """
    from gearmbs.gears import ContactLaw, GearPair

    model = str(_held(m.values, item, "stiffness_model", "constant")).lower()
    if model != "constant":
        raise ViewError(f"stiffness_model = {model[:40]}; give constant, or build the pair in Python")
    stiffness, ratio = _number(m.values, item, "contact_stiffness"), _number(m.values, item, "damping_ratio", 0.0)
    sharpness = _number(m.values, item, "sharpness_factor", 1e4)
    if not (stiffness > 0.0 and ratio >= 0.0 and sharpness > 0.0):
        raise ViewError(
            f"contact_stiffness = {stiffness:g} and sharpness_factor = {sharpness:g} must be positive, damping_ratio = "
            f"{ratio:g} not negative"
        )
    stiffness *= m.db.units.si("force") / m.db.units.si("length")
    ratio *= m.db.units.si("time")
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            driver, driven = (_wheel(m, one) for one in wheels)
            if str(_held(m.values, item, "backlash_type", "angle")).lower() == "angle":
                play = m.radian * _number(m.values, item, "backlash_angle", 0.0) * driver.base_radius
            else:
                play = m.db.units.si("length") * _number(m.values, item, "backlash_length", 0.0)
            # of a law of its own: what is warned of is said of that of the file
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                contact_ratio = GearPair(driver, driven, backlash=play).contact_ratio
            law = ContactLaw.linear(
                stiffness / contact_ratio, ratio * stiffness / contact_ratio, driver.base_radius / sharpness
            )
            pair = GearPair(driver, driven, backlash=play, contact=law)
        except ValueError as error:
            raise ViewError(f"its wheels: {error}; give others, or build the pair in Python") from error
    for one in warned:
        if issubclass(one.category, UserWarning):
            m.remark(item, str(one.message))
    return pair


def make_force(m: Deckmaker, item: Item) -> None:
    """GFORCE with the pair of its wheels in comments; I and RM are where the wheels are, z their axes.

    Raises
    ------
    ViewError
    """
    from gearmbs.adams.write.contacts import pair_comments

    wheels = []
    for name in ("gear_1", "gear_2"):
        one = _held(m.values, item, name)
        if not isinstance(one, Item) or m.db.items.get(f"{one.path}.gear_part".lower()) is None:
            raise ViewError(f"its {name} is no cylindrical gear element")
        wheels.append(one)
    pair = _pair(m, item, wheels)
    parts = [m.db.items[f"{one.path}.gear_part".lower()] for one in wheels]
    (turned, place), (_, other) = (m.values.pose(part) for part in parts)
    apart = m.db.units.si("length") * abs(float(turned[:, 2] @ (other - place)))
    # whichever end of its face the marker of a wheel is at
    if not apart < pair.driver.face_width + pair.driven.face_width:
        raise ViewError(
            f"its wheels are {apart * 1e3:.4g} mm apart along the axis of the first one, more than they are wide; move "
            "their ref_marker"
        )
    ends = [m.new_marker(item, part, *m.values.pose(part)) for part in parts]
    floating = m.fresh("MARKER")
    m.statements.append(Made(f"MARKER/{floating}", (m.owner_argument(parts[1]), "FLOATING"), "", item.line))
    m.statements.append(
        Made(
            f"GFORCE/{m.fresh('GFORCE')}",
            (
                f"I = {ends[0]}",
                f"JFLOAT = {floating}",
                f"RM = {ends[1]}",
                "FUNCTION = USER(0)",
                "ROUTINE = amachinery::gears",
            ),
            item.name,
            item.line,
            tuple(pair_comments(pair)),
        )
    )
