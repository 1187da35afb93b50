"""From the objects of a model to the statements of a deck: bodies, markers and constraints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearmbs.adams.view import frames
from gearmbs.adams.view.deckmaker import JOINTS, PART_KEYWORDS, PRIMITIVES, Deckmaker, place, translated
from gearmbs.adams.view.geometry.masses import mass_of_geometry
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import UNREAD, Item
from gearmbs.adams.view.values import is_ground
from gearmbs.adams.write.text import listed, number

# Bodies and markers.


def make_part(m: Deckmaker, item: Item) -> None:
    """PART, POINT_MASS or FLEX_BODY."""
    keyword = PART_KEYWORDS[item.kind]
    head = f"{keyword}/{m.id(item)}"
    item.used.add("exact_coordinates")
    if "exact_coordinates" in item.fields and not is_ground(item):
        m.remark(item, "exact_coordinates is without effect: where joints contradict places, all parts are moved alike")
    if is_ground(item):
        for key in ("mass", "center_of_mass_marker", "density", "material_type", "location", "orientation", "planar"):
            item.used.add(key)
        item.used.update(key for key in item.fields if key.startswith(("i", "v", "w", "ground")))
        m.add(item, head, "GROUND")
        return
    arguments: list[str | None] = [*place(m.values.orientation(item), m.values.location(item), "QG")]
    for key in ("vx", "vy", "vz"):
        arguments.append(m.real(item, key, key.upper()))
    if item.kind != "point_mass":
        for key in ("wx", "wy", "wz"):
            arguments.append(m.real(item, key, key.upper(), m.radian))
        arguments += [m.ref(item, "vm", "VM", ("marker",)), m.ref(item, "wm", "WM", ("marker",))]
    if item.kind == "flexible_body":
        arguments += _modal(m, item)
    else:
        arguments = [*_mass(m, item), *arguments]
        if m.yes(item, "planar"):
            arguments.append("PLANAR")
    m.add(item, head, *arguments)


def _mass(m: Deckmaker, item: Item) -> list[str | None]:
    """Return mass, centre of mass and inertia: as they are given, or of the geometry."""
    given = m.values.number(item, "mass")
    marker = m.values.ref(item, "center_of_mass_marker", ("marker",)) or m.db.items.get(f"{item.path}.cm".lower())
    item.used |= {"density", "material_type"}
    if given is None:
        return mass_of_geometry(m, item, marker)
    unread = [one for one in item.children.values() if one.kind == UNREAD]
    if unread:
        files = ", ".join(m.values.text(one, "file_name") or "" for one in unread)[:200]
        m.remark(item, f"geometry of files is not read, and does not count for the given mass: {files}")
    inertia = [m.values.number(item, key, 0.0) or 0.0 for key in ("ixx", "iyy", "izz", "ixy", "izx", "iyz")]
    at = m.values.ref(item, "inertia_marker", ("marker",))
    arguments: list[str | None] = [f"MASS = {number(given)}"]
    if marker is None and given > 0.0:
        m.remark(item, "no center_of_mass_marker is given: its centre of mass is taken to be at its origin")
        arguments.append(f"CM = {m.new_marker(item, item, *m.values.pose(item))}")
    elif marker is not None:
        arguments.append(f"CM = {m.id(marker)}")
    if at is not None and at is not marker:
        arguments.append(f"IM = {m.id(at)}")
    if item.kind == "part" and any(inertia):
        arguments.append(f"IP = {listed(inertia if any(inertia[3:]) else inertia[:3])}")
    return arguments


def _modal(m: Deckmaker, item: Item) -> list[str | None]:
    """Return what a FLEX_BODY has of its file."""
    file = m.values.text(item, "modal_neutral_file_name")
    if file is None:
        raise ViewError("only flexible bodies of a modal neutral file are read; give modal_neutral_file_name")
    if "damping_ratio" in item.fields:
        ratio = m.values.text(item, "damping_ratio") or ""
        return [f"MNF_FILE = {file}", f"CRATIO = {translated(m, ratio, item.line)}"]
    return [f"MNF_FILE = {file}"]


def make_marker(m: Deckmaker, item: Item) -> None:
    """MARKER on a body."""
    part = m.db.owner(item)
    if part is None:
        raise ViewError(f"{item.path} belongs to no part")
    owner = m.owner_argument(part)
    node = m.real(item, "node_id", "NODE_ID")
    if item.kind == "floating_marker":
        m.add(item, f"MARKER/{m.id(item)}", owner, "FLOATING")
        return
    if node is not None and part.kind == "flexible_body":
        item.used |= {"location"}
        m.add(item, f"MARKER/{m.id(item)}", owner, node, place(m.values.orientation(item), frames.ORIGIN)[1])
        return
    if "orientation" not in item.fields and not np.allclose(m.values.pose(part)[0], frames.IDENTITY, atol=1e-12):
        m.remark(item, "no orientation is given: it has the axes of its part, which are turned")
    at = m.centres.get(id(item))
    where = m.values.location(item)
    m.add(item, f"MARKER/{m.id(item)}", owner, *place(m.values.orientation(item), where if at is None else at))


# Constraints.


def make_joint(m: Deckmaker, item: Item) -> None:
    """JOINT of any type."""
    if m.yes(item, "friction_enabled"):
        raise ViewError("friction_enabled: the law of this friction is not known; give a friction element")
    item.used.add("friction_enabled")
    initial: list[str | None] = []
    for place_, rate, keyword, scale in (
        ("translational_ic", "velocity_ic", "ICTRAN", 1.0),
        ("rotational_ic", "angular_velocity_ic", "ICROT", m.radian),
    ):
        at, speed = m.values.number(item, place_), m.values.number(item, rate)
        if speed is not None:
            initial.append(f"{keyword} = {listed(((at or 0.0) * scale, speed * scale))}")
        elif at is not None:
            initial.append(f"{keyword} = {number(at * scale)}")
    pitch = m.real(item, "pitch", "PITCH") or m.real(item, "diameter_of_pitch", "PD")
    m.add(item, f"JOINT/{m.id(item)}", item.kind.upper(), *m.pair(item), pitch, *initial)


def make_primitive(m: Deckmaker, item: Item) -> None:
    """JPRIM of any type."""
    m.add(item, f"JPRIM/{m.id(item)}", item.kind.upper(), *m.pair(item))


def make_motion(m: Deckmaker, item: Item) -> None:
    """MOTION of a joint, or between two markers along or about an axis."""
    function = m.user(item) or [m.expression(item, "function", "FUNCTION")]
    if function[0] is None:
        raise ViewError("a motion needs a function")
    joint = m.values.ref(item, "joint_name", tuple(JOINTS))
    turning = m.values.word(item, "type_of_freedom").startswith("rot")
    axis = m.values.word(item, "axis")
    if joint is not None:
        where: list[str | None] = [f"JOINT = {m.id(joint)}", "ROTATIONAL" if turning else "TRANSLATIONAL"]
    else:
        where = [*m.pair(item), axis.upper()]
        turning = axis.startswith("b")
    level = m.values.word(item, "time_derivative", "displacement").upper()
    own, other = ("rotational_", "") if turning else ("", "rotational_")
    start, speed = (m.values.number(item, f"{own}{what}_ic") for what in ("displacement", "velocity"))
    scale = m.radian if turning else 1.0
    # without effect where the displacement itself is given
    at = None if start is None or level == "DISPLACEMENT" else f"ICDISP = {number(start * scale)}"
    rate = None if speed is None or level != "ACCELERATION" else f"ICVEL = {number(speed * scale)}"
    wrong = next(
        (key for what in ("displacement", "velocity") if m.values.number(item, key := f"{other}{what}_ic")), None
    )
    if wrong is not None and level != "DISPLACEMENT":
        raise ViewError(f"{wrong} is of a motion of the other kind; give {own}{wrong.removeprefix(other)}")
    m.add(item, f"MOTION/{m.id(item)}", *where, level if level != "DISPLACEMENT" else None, at, rate, *function)


def make_coupler(m: Deckmaker, item: Item) -> None:
    """COUPLER of two or three joints."""
    joints = m.refs(item, "joint_name", "JOINTS", tuple(JOINTS))
    kinds = m.values.word(item, "type_of_freedom", "rot_rot_rot")
    words = ["ROTATIONAL" if one.startswith("rot") else "TRANSLATIONAL" for one in kinds.split("_")]
    count = len(m.values.refs(item, "joint_name"))
    user = m.user(item)
    if user is not None:
        m.add(item, f"COUPLER/{m.id(item)}", joints, f"TYPE = {', '.join(words[:count])}", *user)
        return
    scales = m.values.numbers(item, "motion_multipliers")
    if scales is None:
        scales = []
        for name in ("first", "second", "third")[:count]:
            turning = m.values.number(item, f"{name}_angular_scale_factor")
            plain = m.values.number(item, f"{name}_scale_factor")
            if turning is None and plain is None:
                raise ViewError(f"give motion_multipliers, or {name}_scale_factor or {name}_angular_scale_factor")
            # an angle, in the model's unit
            scales.append(turning * m.radian if turning is not None else plain or 0.0)
    m.add(item, f"COUPLER/{m.id(item)}", joints, f"TYPE = {', '.join(words[:count])}", f"SCALES = {listed(scales)}")


def make_gear(m: Deckmaker, item: Item) -> None:
    """GEAR: two joints whose common-velocity marker moves alike on both."""
    joints = m.refs(item, "joint_name", "JOINTS", tuple(JOINTS))
    m.add(item, f"GEAR/{m.id(item)}", joints, m.ref(item, "common_velocity_marker", "CV", ("marker",)))


def make_gcon(m: Deckmaker, item: Item) -> None:
    """GCON."""
    where = m.ref(item, "i_marker_name", "I", ("marker",))
    m.add(item, f"GCON/{m.id(item)}", where, m.expression(item, "function", "FUNCTION", "0"))


def make_point_curve(m: Deckmaker, item: Item) -> None:
    """PTCV: a point on a curve."""
    m.add(
        item,
        f"PTCV/{m.id(item)}",
        m.ref(item, "i_marker_name", "I", ("marker",)),
        m.ref(item, "curve_name", "CURVE", ("curve",)),
        m.ref(item, "ref_marker_name", "RM", ("marker",)),
        m.ref(item, "j_floating_marker_name", "JFLOAT", ("floating_marker",)),
        m.reals(item, "displacement_ic", "DISP"),
        m.reals(item, "velocity_ic", "VEL"),
        m.ref(item, "ic_ref_marker_name", "ICM", ("marker",)),
    )


def refuse(what: str) -> Callable[[Deckmaker, Item], None]:
    """Return what names an object that is not modelled, and what to write instead."""

    def named(m: Deckmaker, item: Item) -> None:
        raise ViewError(what)

    return named


MAKERS: dict[str, Callable[[Deckmaker, Item], None]] = {
    **dict.fromkeys(PART_KEYWORDS, make_part),
    "marker": make_marker,
    "floating_marker": make_marker,
    **dict.fromkeys(JOINTS, make_joint),
    **dict.fromkeys(PRIMITIVES, make_primitive),
    "point_point": refuse("point_point is not modelled; give a general_constraint with DM, or a spring"),
    "motion": make_motion,
    "coupler": make_coupler,
    "gear": make_gear,
    "gcon": make_gcon,
    "ptcv": make_point_curve,
    "cvcv": refuse("a curve on a curve is read in decks; write CVCV into the deck of --to-deck"),
    "user_constraint": refuse("a constraint of a routine is not modelled; give a general_constraint"),
}
