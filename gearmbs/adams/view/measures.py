"""Measures as function expressions: for results, and where other expressions name them."""

from __future__ import annotations

from gearmbs.adams.view.deckmaker import MEASURES, Deckmaker, translated
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import PARTS, Item
from gearmbs.adams.view.values import is_ground
from gearmbs.adams.write.text import number

MARKERS = ("marker", "floating_marker")
KINEMATIC = {
    "translational_displacement": ("DX", "DY", "DZ", "DM"),
    "translational_velocity": ("VX", "VY", "VZ", "VM"),
    "translational_acceleration": ("ACCX", "ACCY", "ACCZ", "ACCM"),
    "angular_velocity": ("WX", "WY", "WZ", "WM"),
    "angular_acceleration": ("WDTX", "WDTY", "WDTZ", "WDTM"),
    "cm_position": ("DX", "DY", "DZ", "DM"),
    "cm_velocity": ("VX", "VY", "VZ", "VM"),
    "cm_acceleration": ("ACCX", "ACCY", "ACCZ", "ACCM"),
    "cm_angular_velocity": ("WX", "WY", "WZ", "WM"),
    "cm_angular_acceleration": ("WDTX", "WDTY", "WDTZ", "WDTM"),
    "ax_ay_az_projection_angles": ("AX", "AY", "AZ", ""),
}
"""Functions of the three components and the size."""
FORCES = {
    "motion": "MOTION", "sforce": "SFORCE", "vforce": "VFORCE", "vtorque": "VTORQ", "gforce": "GFORCE",
    "bushing": "BUSH", "beam": "BEAM", "field": "FIELD", "spring": "SPDP", "rotational_spring": "SPDP",
    "contact": "CONTACT", "ptcv": "PTCV", "gear": "GEAR", "coupler": "COUPLER", "friction": "FRICTION",
}  # fmt: skip
ANGULAR = frozenset(
    """angular_velocity angular_acceleration cm_angular_velocity cm_angular_acceleration
    ax_ay_az_projection_angles""".split()
)
"""What View gives in its unit of angle, and the solver in radians."""
ANGLES = KINEMATIC["ax_ay_az_projection_angles"]
EULER = {"psi": "PSI", "theta": "THETA", "phi": "PHI", "yaw": "YAW", "pitch": "PITCH", "roll": "ROLL"}


def variable_of(m: Deckmaker, item: Item, depth: int = 0) -> int | None:
    """Return the id of the VARIABLE that holds a measure, as in View's own decks; it is made when first asked for.

    Raises
    ------
    ViewError
        If what the measure names is not there.
    """
    if id(item) not in m.measured:
        expression = expression_of(m, item, depth)
        item.used |= set(item.fields)
        if expression is None:
            return None
        m.measured[id(item)] = m.id(item)
        m.add(item, f"VARIABLE/{m.id(item)}", f"FUNCTION = {expression}")
    return m.measured[id(item)]


def _angle(m: Deckmaker, expression: str) -> str:
    """Return an angle in View's unit."""
    return expression if m.radian == 1.0 else f"RTOD * {expression}"


def expression_of(m: Deckmaker, item: Item, depth: int = 0) -> str | None:
    """Return the expression of a measure as a deck has it, None of one that is not known here.

    Raises
    ------
    ViewError
        If what it names is not there.
    """
    kind = item.kind
    if kind == "function_measure" and "function" in item.fields:
        text = m.values.text(item, "function") or "0"
        return translated(m, text, item.line, depth) if text.strip() else "0"
    if kind == "angle_measure":
        points = [_marker(m, m.values.ref(item, key)) for key in ("first_point", "middle_point", "last_point")]
        return _angle(m, f"INCANG({', '.join(str(one) for one in points)})")
    if kind == "orient_measure":
        names = [m.ref(item, key, "", MARKERS) for key in ("to_frame", "from_frame")]
        component = m.values.word(item, "component").split("_")[0]
        if component in EULER and all(names):
            return _angle(m, f"{EULER[component]}({', '.join(str(one).strip(' =') for one in names)})")
        return None
    if kind in ("point_measure", "pt2pt_measure"):
        return _kinematic(m, item)
    if kind == "object_measure":
        return _object(m, item)
    return None


def _marker(m: Deckmaker, item: Item | None) -> int:
    """Return the id of a marker, or of one at a point or at the centre of a part."""
    if item is None:
        raise ViewError("a point is missing")
    if item.kind in MARKERS:
        return m.id(item)
    key = id(item)
    if key not in m.at_points:
        if item.kind == "point":
            part = m.db.owner(item)
            if part is None:
                raise ViewError(f"{item.path} belongs to no part")
            m.at_points[key] = m.new_marker(item, part, m.values.pose(part)[0], m.values.point(item))
        elif item.kind in PARTS and not is_ground(item):
            cm = m.values.ref(item, "center_of_mass_marker", MARKERS) or m.db.items.get(f"{item.path}.cm".lower())
            if cm is None:
                raise ViewError(f"{item.path} has no marker at its centre of mass")
            m.at_points[key] = m.id(cm)
        else:
            raise ViewError(f"{item.path} is a {item.kind.replace('_', ' ')}, not a point")
    return m.at_points[key]


def _component(m: Deckmaker, item: Item) -> int:
    """Return 0 to 2 of a component, 3 of the size."""
    word = m.values.word(item, "component", "mag")
    return "xyz".find(word[0]) if word[0] in "xyz" else 3


def _kinematic(m: Deckmaker, item: Item) -> str | None:
    what = m.values.word(item, "characteristic")
    functions = KINEMATIC.get(what)
    if functions is None or not functions[_component(m, item)]:
        return None
    if item.kind == "pt2pt_measure":
        ends = [_marker(m, m.values.ref(item, key)) for key in ("to_point", "from_point")]
    else:
        ends = [_marker(m, m.values.ref(item, "point"))]
    return _call(m, item, functions[_component(m, item)], ends)


def _call(m: Deckmaker, item: Item, name: str, ends: list[int]) -> str | None:
    """Return a function of one marker or two, along the axes and relative to the frame that a measure names.

    None where a velocity is seen from a frame that moves: no public model shows which derivative View takes.
    """
    frame, seen = (m.values.ref(item, f"{what}_rframe", MARKERS) for what in ("coordinate", "motion"))
    if seen is not None:
        part = m.db.owner(seen)
        if name in ANGLES or (not name.startswith("D") and (part is None or not is_ground(part))):
            return None
        ends = ends if len(ends) > 1 else [*ends, m.id(seen)]
    along: list[int] = []
    if frame is not None and not name.endswith("M"):
        if name in ANGLES:
            return None
        along = [m.id(frame)] if len(ends) > 1 else [0, m.id(frame)]
    found = f"{name}({', '.join(map(str, (*ends, *along)))})"
    return _angle(m, found) if m.values.word(item, "characteristic") in ANGULAR else found


def _object(m: Deckmaker, item: Item) -> str | None:
    """Return the expression of a measure of a part, a joint or a force."""
    found = m.values.ref(item, "object")
    if found is None:
        return None
    what = m.values.word(item, "characteristic")
    if what in ("element_force", "element_torque"):
        function = FORCES.get(found.kind) or {"JOINT": "JOINT", "JPRIM": "JPRIM"}.get(m.keyword(found))
        if function is None:
            return None
        k = (1 if what == "element_force" else 5) + (_component(m, item) + 1) % 4
        frame = m.values.ref(item, "coordinate_rframe", MARKERS)
        ends = f"{m.id(found)}, {0 if _from_first(m, item) else 1}"
        return f"{function}({ends}, {k}, {m.id(frame) if frame is not None else 0})"
    functions = KINEMATIC.get(what)
    if functions is not None and functions[_component(m, item)]:
        return _call(m, item, functions[_component(m, item)], _seen(m, item, found))
    if found.kind == "spring" and what in ("deformation", "deformation_velocity"):
        name = "VR" if what.endswith("velocity") else "DM"
        base = f"{name}({', '.join(map(str, _ends(m, found)))})"
        free = m.values.number(found, "displacement_at_preload", 0.0) or 0.0
        return base if name == "VR" or not free else f"{base} - {number(free)}"
    return None


def _from_first(m: Deckmaker, item: Item) -> bool:
    word = m.values.word(item, "from_first")
    if not word:
        raise ViewError("from_first is missing, by which the sign goes; give yes or no")
    return word in ("yes", "on", "true")


def _seen(m: Deckmaker, item: Item, found: Item) -> list[int]:
    """Return the marker of a part, or those of a joint or force: the second from the first, or the other way round."""
    if found.kind in PARTS:
        return [_marker(m, found)]
    ends = _ends(m, found) or _ends(m, m.values.ref(found, "joint_name") or found)
    if len(ends) != 2:
        raise ViewError(f"{found.path} has no markers I and J to measure between")
    return ends[::-1] if _from_first(m, item) else ends


def _ends(m: Deckmaker, item: Item) -> list[int]:
    """Return the markers I and J of a joint or a force."""
    found = [m.values.ref(item, f"{side}_marker_name", MARKERS) for side in "ij"]
    return [m.id(one) for one in found if one is not None]


def make_measure(m: Deckmaker, item: Item) -> None:
    """VARIABLE of a measure, and the REQUEST that writes it."""
    found = variable_of(m, item)
    if found is None:
        raise ViewError(f"the measure {item.path} is not computed")
    m.add(item, f"REQUEST/{m.fresh('REQUEST')}", f"F2 = VARVAL({found})")


MAKERS = dict.fromkeys(MEASURES, make_measure)
