"""What makes the statements of a deck of the objects of a model: ids, arguments, and names in expressions."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gearmbs.adams.errors import UNSUPPORTED, WARNING, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import RawStatement
from gearmbs.adams.view import frames
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import DEGREE, JOINTS, PARTS, Item
from gearmbs.adams.view.simulations.activity import Activity
from gearmbs.adams.view.values import ORIENTATIONS, Values, is_ground
from gearmbs.adams.view.vocabulary import ROWS
from gearmbs.adams.write.text import listed, number, wrapped
from gearmbs.solids.bodies import Body

PART_KEYWORDS = {"part": "PART", "point_mass": "POINT_MASS", "flexible_body": "FLEX_BODY"}
BETWEEN_PLACES = frozenset("spring sforce beam".split())
"""Forces by parts whose ends may be at two places, I's first."""
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
    "string": "STRING", "motion_of_instance": "MOTION", "sensor": "SENSOR",
    "request": "REQUEST", "modal_force": "MFORCE",
}  # fmt: skip
"""Statements by kinds of objects; graphics have ids of their own when contacts name them."""
ELEMENTS = frozenset(kind for kind, keyword in KEYWORDS.items() if keyword in st.switched("acts"))
"""Kinds of objects that act on parts, and go with these and with their markers."""
SPACES = {"POINT_MASS": "PART", "FLEX_BODY": "PART"}
"""Statements whose ids are those of others, too."""
IDLE = {row.kind: {name for name, acts in row.arguments.items() if not acts} for row in ROWS}
IDLE["ude"] |= {"location", "orientation", "relative_to"}
NAMING = {row.naming for row in ROWS} | {"adams_id"}


@dataclass(frozen=True)
class Made:
    """A statement: its head, its arguments, the name of its object, the line that made it, comments with its pair."""

    head: str
    arguments: tuple[str, ...]
    name: str
    line: int
    pair: tuple[str, ...] = ()

    def raw(self) -> RawStatement:
        """Return it as the reader of decks takes it."""
        text = ", ".join((self.head, *self.arguments))
        pair = "".join(comment.partition(":")[2] for comment in self.pair)
        return RawStatement(text, (0,), (self.line,), self.name or None, pair)

    def lines(self) -> list[str]:
        """Return it as it is written."""
        title = [f"!{f'adams_view_name={self.name!r}':>50}"] if self.name and "'" not in self.name else []
        return [
            *(f"! {comment}" for comment in self.pair),
            *title,
            self.head,
            *(line for one in self.arguments for line in wrapped(one)),
        ]


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
    failed : dict of int to Diagnostic
        Objects, by Python's id, that are left out, and why: what needs them is, too.
    parasolids : list of (str, int)
        Files with geometry that the command file reads, with their lines.
    activity : Activity
        What is on and off.
    bodies : dict of Path to list of Body
        What they hold, once it is read.
    """

    def __init__(
        self,
        values: Values,
        model: Item,
        file: str,
        measurer: Callable[[Deckmaker, Item, int], int | None],
        parasolids: Sequence[tuple[str, int]] = (),
        folder: Path | None = None,
    ) -> None:
        self.values, self.db, self.model, self.file = values, values.db, model, file
        self.radian = self.db.units.radian
        self.measurer = measurer
        self.parasolids, self.folder = parasolids, folder
        self.bodies: dict[Path, list[Body]] = {}
        self.failed: dict[int, Diagnostic] = {}
        self.statements: list[Made] = []
        self.problems: list[Diagnostic] = []
        self.taken: dict[str, set[int]] = {}
        self.ids: dict[int, int] = {}
        self.graphics: dict[int, int] = {}
        self.solids: dict[str, Item] = {}
        self.at_points: dict[int, int] = {}
        self.measured: dict[int, int] = {}
        self.centres: dict[int, np.ndarray] = {}
        inside = model.path.lower() + "."
        self.items = [item for key, item in self.db.items.items() if key.startswith(inside)]
        self.activity = Activity(values, ELEMENTS)
        self._number()

    def start_again(self) -> None:
        """Forget the statements, not what is left out."""
        self.statements, self.problems = [], list(self.failed.values())
        self.graphics, self.at_points, self.measured, self.centres = {}, {}, {}, {}
        for group, why in self.activity.doubts:
            self.unsupported(group, why)

    def beside(self, name: str) -> Path | None:
        """Return a file in the folder of the command file by its name, whatever the case of its letters."""
        wanted = name.replace("\\", "/").rsplit("/", 1)[-1].lower()
        if self.folder is None or not wanted:
            return None
        try:
            return next(
                (one for one in sorted(self.folder.iterdir()) if one.name.lower() == wanted and one.is_file()), None
            )
        except OSError:
            return None

    def _number(self) -> None:
        """Give every object its own id, those that have one first."""
        waiting = []
        # the ground is PART/1 in View's own decks
        grounds = [item for item in self.items if is_ground(item)]
        for item in [*grounds, *(one for one in self.items if not is_ground(one))]:
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
            first = item in grounds and 1 not in self.taken[space]
            self.ids[id(item)] = 1 if first else self.fresh(space)
            self.taken[space].add(self.ids[id(item)])

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
        """Return whether an object is handed to the solver."""
        return self.activity.cause(item) is None

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

    def user(self, item: Item, key: str = "user_function", keyword: str = "FUNCTION") -> list[str | None] | None:
        """Return a call of a routine as arguments, None where there is none."""
        if key not in item.fields:
            return None
        parts = []
        for value in self.values.values(item, key):
            if isinstance(value, Item):
                value = self.id(value) if value.kind != "variable" else self.values.variable(value)
            parts.append(number(value) if isinstance(value, (int, float)) else str(value))
        routine = self.values.text(item, "routine")
        return [f"{keyword} = USER({', '.join(parts)})", f"ROUTINE = {routine}" if routine else None]

    def yes(self, item: Item, key: str) -> bool:
        """Return whether an argument says yes."""
        return self.values.word(item, key) in ("yes", "on", "true", "1")

    def measure(self, item: Item, depth: int = 0) -> int | None:
        """Return the id of the VARIABLE of a measure, None where it has none."""
        return self.measurer(self, item, depth)

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
        placed = [item.fields[key] for key in ("location", *ORIENTATIONS) if key in item.fields]
        relative = self.values.ref(item, "relative_to") or next((one.frame for one in placed), None)
        b, s = self.values.pose(relative)
        given_at = self.values.numbers(item, "location", frame=relative) or [0.0] * 3
        if len(given_at) != 3 and not (len(given_at) == 6 and item.kind in BETWEEN_PLACES):
            places = "three, or six, three for each end" if item.kind in BETWEEN_PLACES else "three"
            raise ViewError(f"location of {item.path}: {len(given_at)} numbers; give {places}", item.line)
        at = [b @ np.array(given_at[k : k + 3]) + s for k in range(0, len(given_at), 3)]
        r = at[0]
        angles = self.values.numbers(item, "orientation", 3, relative) or [0.0] * 3
        turned = item.fields.get("orientation")
        # functions of orientations give 313 angles whatever the setting is
        sequence = (
            turned.sequence if turned is not None and not (turned.live and len(turned.values) == 1) else "body313"
        )
        a = b @ frames.rotation([x * self.radian for x in angles], sequence)
        for key, count in (("along_axis_orientation", 2), ("in_plane_orientation", 3)):
            given = self.values.numbers(item, key, frame=relative)
            if given is None:
                continue
            points = [b @ np.array(given[k : k + 3]) + s for k in range(0, len(given), 3)]
            if len(points) < count:
                points.insert(0, r)
            if len(points) != count or len(given) % 3:
                raise ViewError(f"{key}: these are no points of three coordinates", item.line)
            a = frames.directed(key, points, item.fields[key].sequence)
        found = [self.new_marker(item, part, a, r) for part, r in zip(parts, (at[0], at[-1])) if part is not None]
        return f"I = {found[0]}", f"J = {found[1]}"

    def run(self, makers: dict[str, Callable[[Deckmaker, Item], None]], kinds: Iterable[str]) -> None:
        """Make the statements of all active objects of some kinds."""
        wanted = set(kinds)
        for item in self.items:
            if item.kind not in wanted or id(item) in self.failed or self._off(item):
                continue
            before = len(self.statements)
            try:
                makers[item.kind](self, item)
            except ViewError as error:
                del self.statements[before:]
                self.unsupported(item, str(error), error.line)
                if item.kind in PART_KEYWORDS:
                    # its markers stay, for what else is wrong
                    self.add(item, f"{PART_KEYWORDS[item.kind]}/{self.ids[id(item)]}")
                else:
                    self.failed[id(item)] = self.problems[-1]
                continue
            unread = set(item.fields) - item.used - IDLE.get(item.kind, set()) - NAMING
            for key in sorted(unread):
                self.unsupported(item, f"{key} is not modelled", item.fields[key].line)

    def _off(self, item: Item) -> bool:
        """Return whether an object is off; say so if it is with what it needs."""
        cause = self.activity.cause(item)
        alone = cause is None or cause is item or cause.kind == "group" or item.path.startswith(f"{cause.path}.")
        if cause is not None and not alone:
            self.remark(item, f"it is off with {cause.path}, which it needs")
        return cause is not None


def place(a: np.ndarray, r: np.ndarray, origin: str = "QP") -> tuple[str | None, str | None]:
    """Return position and orientation as arguments, in degrees; None of what is zero."""
    at = f"{origin} = {listed(float(x) + 0.0 for x in r)}" if np.any(r) else None
    if np.allclose(a, frames.IDENTITY, rtol=0.0, atol=1e-15):
        return at, None
    degrees = [x / DEGREE + 0.0 for x in frames.angles_313(a)]
    return at, f"REULER = {', '.join(number(x) + 'D' for x in degrees)}"


# Function expressions: names of objects become ids, those of design variables their values.


_NAME = re.compile(
    r"""(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?[A-Za-z_]*)
    |(?P<name>\.?[A-Za-z_$][\w$]*(?:\.[A-Za-z0-9_$|]+)*)(?P<called>\s*\()?""",
    re.VERBOSE,
)
PLAIN = frozenset("time pi dtor rtod mode".split())
MOST = 200_000
"""Characters of an expression: measures may name measures, each twice the one before."""


def translated(maker: Deckmaker, text: str, line: int, depth: int = 0) -> str:
    """Return an expression as a deck has it.

    Raises
    ------
    ViewError
        If a name has no meaning in it.
    """
    if depth > 20:
        raise ViewError("measures name each other, more than 20 deep", line)
    out, at, length = [], 0, 0
    for match in _NAME.finditer(text):
        word = match.group("name")
        if word is None or match.group("called") or word.lower() in PLAIN:
            continue
        out.append(text[at : match.start()] + _named(maker, word, line, depth))
        at = match.end()
        length += len(out[-1])
        if length > MOST:
            raise ViewError(f"an expression of more than {MOST} characters", line)
    return ("".join(out) + text[at:]).replace("\n", " ").strip()


def _named(maker: Deckmaker, word: str, line: int, depth: int) -> str:
    item = maker.db.find(word)
    if item is None:
        head, dot, attribute = word.rpartition(".")
        owner = maker.db.find(head) if dot and head else None
        if owner is None:
            raise ViewError(f"in the expression: there is no object {word[:80]}", line)
        value = maker.values.attribute(owner, attribute)
        if isinstance(value, Item):
            return str(maker.id(value))
        if isinstance(value, (int, float)):
            return f"({number(value)})"
        raise ViewError(f"in the expression: {word[:80]} is no number", line)
    if item.kind == "variable":
        return _valued(maker, item, line)
    if item.kind.endswith("_measure"):
        found = maker.measure(item, depth + 1)
        if found is None:
            raise ViewError(f"in the expression: the measure {item.path} has no expression here", line)
        return f"VARVAL({found})"
    return str(maker.id(item))


def _valued(maker: Deckmaker, item: Item, line: int) -> str:
    value = maker.values.variable(item)
    while isinstance(value, list) and len(value) == 1:
        value = value[0]
    if isinstance(value, Item):
        return str(maker.id(value))
    if not isinstance(value, (int, float)):
        raise ViewError(f"in the expression: the variable {item.path} is no number", line)
    if maker.radian != 1.0 and maker.values.word(item, "units") == "angle":
        raise ViewError(
            f"in the expression: {item.path} is an angle, {number(value)} in the model's unit, where functions of the "
            f"solver are in radians; give it units = no_units and write DTOR*{item.name}",
            line,
        )
    return f"({number(value)})"
