"""From the objects of a model to the statements of a deck: what all of them share, bodies, markers and constraints."""

from __future__ import annotations


from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from gearmbs.adams.errors import UNSUPPORTED, WARNING, Diagnostic
from gearmbs.adams.parse.grammar import RawStatement
from gearmbs.adams.view import frames
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import DEGREE, PARTS, Item
from gearmbs.adams.view.runtime import translated
from gearmbs.adams.view.solids import mass_of_geometry
from gearmbs.adams.view.values import Values, is_ground
from gearmbs.adams.view.vocabulary import ROWS
from gearmbs.adams.write.text import listed, number, wrapped

PART_KEYWORDS = {"part": "PART", "point_mass": "POINT_MASS", "flexible_body": "FLEX_BODY"}
JOINTS = frozenset(
    "revolute translational cylindrical spherical fixed universal hooke convel planar screw rackpin".split()
)
PRIMITIVES = frozenset("atpoint inline inplane orientation parallel_axes perpendicular".split())
MEASURES = [f"{kind}_measure" for kind in "function object point pt2pt angle orient computed range query".split()]
KEYWORDS = {
    **dict.fromkeys(MEASURES, "VARIABLE"),
    **PART_KEYWORDS, **dict.fromkeys(JOINTS, "JOINT"), **dict.fromkeys(PRIMITIVES, "JPRIM"),
    "marker": "MARKER", "floating_marker": "MARKER", "motion": "MOTION", "coupler": "COUPLER", "gear": "GEAR",
    "gcon": "GCON", "ptcv": "PTCV", "cvcv": "CVCV", "sforce": "SFORCE", "vforce": "VFORCE", "vtorque": "VTORQUE",
    "gforce": "GFORCE", "beam": "BEAM", "bushing": "BUSHING", "field": "FIELD", "spring": "SPRINGDAMPER",
    "rotational_spring": "SPRINGDAMPER", "friction": "FRICTION", "contact": "CONTACT", "state_variable": "VARIABLE",
    "diff": "DIFF", "lse": "LSE", "tfsiso": "TFSISO", "gse": "GSE", "array": "ARRAY", "ic_array": "ARRAY",
    "u_array": "ARRAY", "x_array": "ARRAY", "y_array": "ARRAY", "curve": "CURVE", "matrix": "MATRIX",
    "sparse_matrix": "MATRIX", "plant_input": "PINPUT", "plant_output": "POUTPUT", "spline": "SPLINE",
    "string": "STRING", "sensor": "SENSOR", "request": "REQUEST", "modal_force": "MFORCE",
}  # fmt: skip
"""Statements by kinds of objects; graphics have ids of their own when contacts name them."""
SPACES = {"POINT_MASS": "PART", "FLEX_BODY": "PART"}
"""Statements whose ids are those of others, too."""
IDLE = {row.kind: {name for name, acts in row.arguments.items() if not acts} for row in ROWS}
NAMING = {row.naming for row in ROWS} | {"adams_id"}


@dataclass(frozen=True)
class Made:
    """A statement: its head, its arguments, the name of its object and the line that made it."""

    head: str
    arguments: tuple[str, ...]
    name: str
    line: int

    def raw(self) -> RawStatement:
        """Return it as the reader of decks takes it."""
        text = ", ".join((self.head, *self.arguments))
        return RawStatement(text, (0,), (self.line,), self.name or None)

    def lines(self) -> list[str]:
        """Return it as it is written."""
        title = [f"!{f'adams_view_name={self.name!r}':>50}"] if self.name and "'" not in self.name else []
        return [*title, self.head, *(line for one in self.arguments for line in wrapped(one))]


class Deckmaker:
    """Makes the statements of a model.

    Parameters
    ----------
    values : Values
    model : Item
        The model that is made a deck.

    Attributes
    ----------
    statements : list of Made
    problems : list of Diagnostic
        What is not modelled.
    failed : set of int
        Objects, by Python's id, that are left out: what needs them is, too.
    """

    def __init__(self, values: Values, model: Item, file: str, failed: frozenset[int] = frozenset()) -> None:
        self.values, self.db, self.model, self.file = values, values.db, model, file
        self.radian = self.db.units.radian
        self.failed = set(failed)
        self.statements: list[Made] = []
        self.problems: list[Diagnostic] = []
        self.taken: dict[str, set[int]] = {}
        self.ids: dict[int, int] = {}
        self.graphics: dict[int, int] = {}
        self.at_points: dict[int, int] = {}
        self.measured: dict[int, int] = {}
        self.centres: dict[int, np.ndarray] = {}
        inside = model.path.lower() + "."
        self.items = [item for key, item in self.db.items.items() if key.startswith(inside)]
        self._number()

    def _number(self) -> None:
        """Give every object its own id, those that have one first."""
        waiting = []
        for item in self.items:
            keyword = KEYWORDS.get(item.kind)
            if keyword is None:
                continue
            space = SPACES.get(keyword, keyword)
            try:
                given = self.values.number(item, "adams_id")
            except ViewError:
                given = None
            used = self.taken.setdefault(space, set())
            if given is not None and 0 < given < 1e17 and int(given) not in used:
                used.add(int(given))
                self.ids[id(item)] = int(given)
            else:
                waiting.append((item, space))
        for item, space in waiting:
            self.ids[id(item)] = self.fresh(space)

    def fresh(self, space: str) -> int:
        """Return an id that no statement of a kind has."""
        used = self.taken.setdefault(space, set())
        found = max(used, default=0) + 1
        if not used or found < 10**17:
            used.add(found)
        return found

    def id(self, item: Item) -> int:
        """Return the id of an object.

        Raises
        ------
        ViewError
            If it has none, or is switched off.
        """
        if id(item) not in self.ids:
            raise ViewError(f"{item.path} is a {item.kind.replace('_', ' ')}, which has no id in a deck")
        if id(item) in self.failed:
            raise ViewError(f"it needs {item.path}, which is left out")
        if not self.active(item):
            raise ViewError(f"{item.path} is not active")
        return self.ids[id(item)]

    def active(self, item: Item) -> bool:
        """Return whether an object and all that it belongs to are handed to the solver."""
        one: Item | None = item
        while one is not None:
            if not one.active:
                return False
            one = self.db.items.get(one.parent.lower())
        return True

    # What statements are made of.

    def add(self, item: Item, head: str, *arguments: str | None) -> None:
        """Add a statement."""
        self.statements.append(Made(head, tuple(a for a in arguments if a), item.name, item.line))

    def unsupported(self, item: Item, message: str, line: int = 0) -> None:
        """Note what is not modelled."""
        label = self.label(item)
        self.problems.append(Diagnostic(UNSUPPORTED, f"{label}: {message}", self.file, line or item.line))

    def label(self, item: Item) -> str:
        """Return an object as messages have it."""
        keyword = KEYWORDS.get(item.kind)
        return f"{keyword}/{self.ids[id(item)]} ({item.path})" if keyword else item.path

    @staticmethod
    def keyword(item: Item) -> str:
        """Return the statement of an object, "" if it has none."""
        return KEYWORDS.get(item.kind, "")

    def remark(self, item: Item, message: str) -> None:
        """Note what should be known."""
        self.problems.append(Diagnostic(WARNING, f"{item.path}: {message}", self.file, item.line))

    def real(self, item: Item, key: str, keyword: str, scale: float = 1.0) -> str | None:
        """Return a number as an argument, None where it was not given."""
        value = self.values.number(item, key)
        return None if value is None else f"{keyword} = {number(value * scale)}"

    def reals(self, item: Item, key: str, keyword: str, count: int | None = None, scale: float = 1.0) -> str | None:
        """Return a list of numbers as an argument."""
        found = self.values.numbers(item, key, count)
        return None if found is None else f"{keyword} = {listed(x * scale for x in found)}"

    def ref(self, item: Item, key: str, keyword: str, kinds: tuple[str, ...] = ()) -> str | None:
        """Return the id of an object as an argument."""
        found = self.values.ref(item, key, kinds)
        return None if found is None else f"{keyword} = {self.id(found)}"

    def refs(self, item: Item, key: str, keyword: str, kinds: tuple[str, ...] = ()) -> str | None:
        """Return the ids of objects as an argument."""
        found = self.values.refs(item, key, kinds)
        return f"{keyword} = {', '.join(str(self.id(one)) for one in found)}" if found else None

    def expression(self, item: Item, key: str, keyword: str, default: str | None = None) -> str | None:
        """Return a function expression as an argument."""
        text = self.values.text(item, key)
        if text is None or not text.strip():
            return None if default is None else f"{keyword} = {default}"
        return f"{keyword} = {translated(self, text, item.fields[key].line)}"

    def user(self, item: Item, key: str = "user_function", keyword: str = "FUNCTION") -> list[str] | None:
        """Return a call of a routine as arguments, None where there is none."""
        if key not in item.fields:
            return None
        parts = []
        for value in self.values.values(item, key):
            if isinstance(value, Item):
                value = self.id(value) if value.kind != "variable" else self.values.variable(value)
            parts.append(number(value) if isinstance(value, (int, float)) else str(value))
        routine = self.values.text(item, "routine")
        return [f"{keyword} = USER({', '.join(parts)})", *([f"ROUTINE = {routine}"] if routine else [])]

    def yes(self, item: Item, key: str) -> bool:
        """Return whether an argument says yes."""
        return self.values.word(item, key) in ("yes", "on", "true", "1")

    def measure(self, item: Item, depth: int = 0) -> int | None:
        """Return the id of the VARIABLE of a measure, None where it has none."""
        from gearmbs.adams.view.measures import variable_of

        return variable_of(self, item, depth)

    def new_marker(self, item: Item, part: Item, a: np.ndarray, r: np.ndarray) -> int:
        """Make a marker at a global place for an object that names parts, and return its id."""
        b, s = self.values.pose(part)
        found = self.fresh("MARKER")
        owner = self.owner_argument(part)
        self.statements.append(
            Made(f"MARKER/{found}", tuple(filter(None, (owner, *place(b.T @ a, b.T @ (r - s))))), "", item.line)
        )
        return found

    def owner_argument(self, part: Item) -> str:
        """Return the argument that says on what body a marker is."""
        return f"{PART_KEYWORDS[part.kind]} = {self.id(part)}"

    def pair(self, item: Item) -> tuple[str, str]:
        """Return the markers I and J of an object: those named, or new ones on the parts that it names.

        Raises
        ------
        ViewError
            If it names neither.
        """
        i, j = (self.values.ref(item, f"{side}_marker_name", ("marker", "floating_marker")) for side in "ij")
        if i is not None and j is not None:
            return f"I = {self.id(i)}", f"J = {self.id(j)}"
        parts = [self.values.ref(item, f"{side}_part_name", PARTS) for side in "ij"]
        if parts[0] is None or parts[1] is None:
            raise ViewError("give i_marker_name and j_marker_name, or two parts and a location", item.line)
        frame = item.fields.get("location")
        a = frames.rotation(
            [x * self.radian for x in self.values.numbers(item, "orientation", 3) or [0.0] * 3], self.db.sequence
        )
        r = np.array(self.values.numbers(item, "location", 3) or [0.0] * 3)
        relative = self.values.ref(item, "relative_to") or (frame.frame if frame is not None else None)
        b, s = self.values.pose(relative)
        found = [self.new_marker(item, part, b @ a, b @ r + s) for part in parts if part is not None]
        return f"I = {found[0]}", f"J = {found[1]}"

    def run(self, makers: dict[str, Callable[[Deckmaker, Item], None]], kinds: Iterable[str]) -> None:
        """Make the statements of all active objects of some kinds."""
        wanted = set(kinds)
        for item in self.items:
            if item.kind not in wanted or not self.active(item):
                continue
            before = len(self.statements)
            try:
                makers[item.kind](self, item)
            except ViewError as error:
                del self.statements[before:]
                self.failed.add(id(item))
                self.unsupported(item, str(error), error.line)
                if item.kind in PART_KEYWORDS:
                    # its markers stay, for what else is wrong
                    self.failed.discard(id(item))
                    self.add(item, f"{PART_KEYWORDS[item.kind]}/{self.ids[id(item)]}")
                continue
            unread = set(item.fields) - item.used - IDLE.get(item.kind, set()) - NAMING
            for key in sorted(unread):
                self.unsupported(item, f"{key} is not modelled", item.fields[key].line)


def place(a: np.ndarray, r: np.ndarray, origin: str = "QP") -> tuple[str | None, str | None]:
    """Return position and orientation as arguments, in degrees; None of what is zero."""
    at = f"{origin} = {listed(float(x) + 0.0 for x in r)}" if np.any(r) else None
    if np.array_equal(a, frames.IDENTITY):
        return at, None
    degrees = [x / DEGREE + 0.0 for x in frames.angles_313(a)]
    return at, f"REULER = {', '.join(number(x) + 'D' for x in degrees)}"


# Bodies and markers.


def make_part(m: Deckmaker, item: Item) -> None:
    """PART, POINT_MASS or FLEX_BODY."""
    keyword = PART_KEYWORDS[item.kind]
    head = f"{keyword}/{m.id(item)}"
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
    inertia = [m.values.number(item, key, 0.0) or 0.0 for key in ("ixx", "iyy", "izz", "ixy", "izx", "iyz")]
    at = m.values.ref(item, "inertia_marker", ("marker",))
    arguments: list[str | None] = [f"MASS = {number(given)}"]
    if marker is None and given > 0.0:
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
    start = m.values.number(item, "rotational_displacement_ic" if turning else "displacement_ic")
    speed = m.values.number(item, "rotational_velocity_ic" if turning else "velocity_ic")
    scale = m.radian if turning else 1.0
    # without effect where the displacement itself is given
    at = None if start is None or level == "DISPLACEMENT" else f"ICDISP = {number(start * scale)}"
    rate = None if speed is None or level != "ACCELERATION" else f"ICVEL = {number(speed * scale)}"
    item.used |= {key for key in item.fields if key.endswith("_ic")}
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
        for k, name in enumerate(("first", "second", "third")[:count]):
            turning = m.values.number(item, f"{name}_angular_scale_factor")
            plain = m.values.number(item, f"{name}_scale_factor")
            scales.append(turning if turning is not None else plain if plain is not None else 1.0)
            del k
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
    "cvcv": refuse("a curve on a curve is read in decks; write the statement CVCV into the deck of --to-deck"),
    "user_constraint": refuse("a constraint of a routine is not modelled; give a general_constraint"),
}

