"""What the arguments of objects hold, and what they come to: numbers, texts, objects, places.

An argument keeps an expression as it is, as View does: a marker that is placed by a variable moves with it. Numbers,
and what stands in EVAL, are fixed when the command is carried out. Places are kept in the frame of the object that the
owner belongs to.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.adams.view import frames
from gearmbs.adams.view.expressions import Evaluator, Tree, parse, text_of
from gearmbs.adams.view.functions import FUNCTIONS
from gearmbs.adams.view.lexer import BARE, EXPRESSION, Value, ViewError
from gearmbs.adams.view.model import PARTS, PLACED, Database, Item

_NUMERIC = re.compile(r"[+-]?(?:\d|\.\d)")
_SPECIAL = {"none": "", "true": 1, "false": 0, "pi": math.pi}
Pose = tuple[np.ndarray, np.ndarray]
"""Rotation and position of a frame in the global one."""
GLOBAL: Pose = (frames.IDENTITY, frames.ORIGIN)
AT_ONCE = 20
"""Arguments that are evaluated within each other: what stands behind these is evaluated first, so that rows of any
length are no deep recursion."""
ORIENTATIONS = ("orientation", "along_axis_orientation", "in_plane_orientation")


@dataclass(frozen=True)
class Stored:
    """What an argument holds.

    Attributes
    ----------
    values : tuple
        ("value", anything), ("tree", expression), or ("word", text).
    line : int
    frame : Item or None
        Of a place: what its numbers are relative to.
    sequence : str
        Of an orientation: how its angles are meant, such as body313; of one by points which axis and plane they give.
    before : Stored or None
        What was held before: it counts where expressions depend on each other in a circle.
    """

    values: tuple[tuple[str, Any], ...]
    line: int = 0
    frame: Item | None = None
    sequence: str = "body313"
    before: Stored | None = None

    @property
    def live(self) -> bool:
        """Whether it is computed anew when it is asked for."""
        return any(kind == "tree" for kind, _ in self.values)


def fixed(*values: Any, line: int = 0) -> Stored:
    """Return what holds these values."""
    return Stored(tuple(("value", one) for one in values), line)


class _DeepError(Exception):
    """An argument is to be evaluated before what asks for it."""

    def __init__(self, *wanted: Any) -> None:
        self.wanted: tuple[Item, str, Item | None] = wanted


class Values:
    """Reads arguments of objects in a database."""

    def __init__(self, database: Database) -> None:
        self.db = database
        self.busy: set[tuple[int, str]] = set()
        self._deep: dict[tuple[int, str, int], list[Any]] = {}
        self.loops: dict[str, Item] = {}
        self._poses: dict[int, Pose] = {}
        self._version = self._deep_version = -1
        self.constant = 0

    # From what was written to what is stored.

    def stored(self, values: tuple[Value, ...]) -> Stored:
        """Return what an argument holds: expressions that name no object are evaluated at once."""
        found = []
        for value in values:
            if value.kind == EXPRESSION:
                tree = self.frozen(parse(value.text, self.db.units, value.line), value.line)
                found.append(tree if tree[0] == "value" else ("tree", tree))
            elif value.kind == BARE and (_NUMERIC.match(value.text) or value.text[0] in "{-+"):
                found.append(("value", self.evaluate(parse(value.text, self.db.units, value.line), value.line)))
            elif value.kind == BARE:
                found.append(("word", value.text))
            else:
                found.append(("value", value.text))
        return Stored(tuple(found), values[0].line if values else 0)

    def frozen(self, tree: Tree, line: int) -> Tree:
        """Return an expression with EVAL and loop variables replaced by their values; a value if nothing is left."""
        kind = tree[0]
        if kind == "call" and tree[1] == "EVAL":
            if len(tree[2]) != 1:
                raise ViewError("EVAL has one argument", line)
            return ("value", self.evaluate(tree[2][0], line))
        if kind in ("number", "text", "value"):
            return ("value", tree[1])
        if kind == "name":
            loop = self.loops.get(tree[1].lower())
            return ("value", self.variable(loop)) if loop is not None else tree
        made: list[Any] = [kind]
        inner: list[Tree] = []
        for one in tree[1:]:
            if isinstance(one, tuple) and (not one or isinstance(one[0], tuple)):
                trees = tuple(self.frozen(member, line) for member in one)
                inner += trees
                made.append(trees)
            elif isinstance(one, tuple):
                made.append(self.frozen(one, line))
                inner.append(made[-1])
            else:
                made.append(one)
        if kind not in ("call", "attribute") and all(one[0] == "value" for one in inner):
            return ("value", self.evaluate(tuple(made), line))
        return tuple(made)

    def evaluate(self, tree: Tree, line: int = 0, frame: Item | None = None) -> Any:
        """Return the value of an expression; places come in a frame."""
        return Evaluator(self.lookup, lambda name, args, ev: self.call(name, args, ev, frame), line)(tree)

    def call(self, name: str, args: tuple[Tree, ...], evaluator: Evaluator, frame: Item | None) -> Any:
        """Return the value of a function."""
        function = FUNCTIONS.get(name)
        if function is None:
            raise evaluator.error(f"the function {name[:40]} is not evaluated here")
        if not function.least <= len(args) <= function.most:
            raise evaluator.error(f"{name} has {function.least} to {function.most} arguments, not {len(args)}")
        if function.placing:
            # what a function of places gets is global; what it gives is in the frame that it is asked in
            inner = Evaluator(self.lookup, lambda n, a, e: self.call(n, a, e, None), evaluator.line)
            return function.run(self, inner, [inner(one) for one in args], frame)
        return function.run(self, evaluator, [evaluator(one) for one in args], frame)

    def lookup(self, name: str) -> Any:
        """Return what a name stands for in an expression: the value of a variable, an object or an attribute.

        Raises
        ------
        ViewError
        """
        item = self.loops.get(name.lower()) or self.db.find(name)
        if item is not None:
            return self.variable(item) if item.kind == "variable" else item
        if name.lower() in _SPECIAL:
            return _SPECIAL[name.lower()]
        head, dot, attribute = name.rpartition(".")
        owner = self.db.find(head) if dot and head else None
        if owner is not None:
            return self.attribute(owner, attribute)
        raise ViewError(f"there is no object {name[:80]}")

    def attribute(self, item: Item, name: str) -> Any:
        """Return an attribute of an object."""
        word = name.lower()
        if word == "name":
            return item.name
        if item.kind in PLACED and len(word) > 2 and "location".startswith(word):
            return [float(x) for x in self.location(item)]
        if item.kind in PLACED and word in ("loc_x", "loc_y", "loc_z"):
            return float(self.location(item)["xyz".index(word[-1])])
        if item.kind in PLACED and len(word) > 2 and "orientation".startswith(word):
            return [x / self.db.units.radian for x in frames.angles_313(self.orientation(item))]
        if word == "adams_id" and word not in item.fields:
            raise ViewError(f"{item.path} has no adams_id before the deck is made")
        fields = [key for key in item.fields if key == word] or [key for key in item.fields if key.startswith(word)]
        if not fields:
            raise ViewError(f"{item.path} has no {name[:40]}")
        values = self.values(item, fields[0])
        return values[0] if len(values) == 1 else values

    def variable(self, item: Item) -> Any:
        """Return the value of a variable: one, or a list."""
        for key in ("real_value", "integer_value", "string_value", "object_value"):
            if key in item.fields:
                values = self.values(item, key)
                if key == "object_value":
                    values = [one if isinstance(one, Item) else self.db.find(one) or one for one in values if one != ""]
                return values[0] if len(values) == 1 else values
        return 0

    # What arguments come to.

    def values(self, item: Item, key: str, frame: Item | None = None) -> list[Any]:
        """Return all values of an argument, lists among them taken apart.

        Raises
        ------
        ViewError
            If it depends on itself, or cannot be evaluated.
        """
        if self.busy:
            return self._evaluated(item, key, frame)
        if self._deep_version != self.db.version or self.loops:
            self._deep, self._deep_version = {}, self.db.version
        waiting = [(item, key, frame)]
        while True:
            try:
                found = self._evaluated(*waiting[-1])
            except _DeepError as deep:
                if any(all(a is b for a, b in zip(deep.wanted, one)) for one in waiting):
                    raise ViewError(f"{key} of {item.path} depends on itself", item.fields[key].line) from None
                waiting.append(deep.wanted)
            except RecursionError:
                message = f"{key} of {item.path}: its expressions are nested too deeply; give parts of them names"
                raise ViewError(message, item.fields[key].line) from None
            else:
                last, name, home = waiting.pop()
                if not waiting:
                    return found
                self._deep[id(last), name, id(home)] = found

    def _evaluated(self, item: Item, key: str, frame: Item | None) -> list[Any]:
        stored: Stored = item.fields[key]
        item.used.add(key)
        mark = (id(item), key)
        if mark in self.busy:
            raise ViewError(f"{key} of {item.path} depends on itself", stored.line)
        known = self._deep.get((id(item), key, id(frame)))
        if known is not None:
            return known
        if len(self.busy) >= AT_ONCE:
            raise _DeepError(item, key, frame)
        self.busy.add(mark)
        try:
            found: list[Any] = []
            for kind, value in stored.values:
                one = self.evaluate(value, stored.line, frame) if kind == "tree" else value
                found.extend(one if isinstance(one, list) else [one])
            return found
        except ViewError as error:
            if not error.line:
                error.line = stored.line
            raise
        finally:
            self.busy.discard(mark)

    def numbers(self, item: Item, key: str, count: int | None = None, frame: Item | None = None) -> list[float] | None:
        """Return an argument as numbers, places among them in a frame, None where it was not given.

        Raises
        ------
        ViewError
            If it is no list of numbers, or of other length.
        """
        if key not in item.fields:
            return None
        line = item.fields[key].line
        found: list[float] = []
        for value in self.values(item, key, frame):
            if isinstance(value, str):
                named = self.db.find(value)
                if named is None or named.kind != "variable":
                    raise ViewError(f"{key} of {item.path} = {value[:60]}: a number is wanted", line)
                value = self.variable(named)
            found += Evaluator(self.lookup, lambda *_: 0, line).numbers(value)
        if count is not None and len(found) != count:
            raise ViewError(f"{key} of {item.path}: {len(found)} numbers; give {count}", line)
        return found

    def number(self, item: Item, key: str, default: float | None = None) -> float | None:
        """Return an argument as one number."""
        found = self.numbers(item, key, 1)
        return default if found is None else found[0]

    def text(self, item: Item, key: str) -> str | None:
        """Return an argument as a text, its pieces joined; None where it was not given."""
        if key not in item.fields:
            return None
        return "".join(text_of(value) for value in self.values(item, key))

    def word(self, item: Item, key: str, default: str = "") -> str:
        """Return an argument that is one word, in small letters."""
        found = self.text(item, key)
        return default if found is None else found.lower()

    def definition(self, item: Item) -> str:
        """Return the last two parts of the name of an instance's definition, in small letters."""
        return ".".join(self.word(item, "definition_name").split(".")[-2:])

    def refs(self, item: Item, key: str, kinds: tuple[str, ...] = ()) -> list[Item]:
        """Return the objects that an argument names.

        Raises
        ------
        ViewError
            If there is no such object, or one of another kind.
        """
        if key not in item.fields:
            return []
        found = []
        for value in self.values(item, key):
            one = value if isinstance(value, Item) else self.db.find(str(value), kinds)
            if one is not None and one.kind == "variable" and "variable" not in kinds:
                held = self.variable(one)
                one = held if isinstance(held, Item) else None
            if one is None:
                raise ViewError(f"{key} of {item.path}: there is no {text_of(value)[:80]}", item.fields[key].line)
            if kinds and one.kind not in kinds:
                what = f"{one.path} is a {one.kind.replace('_', ' ')}"
                raise ViewError(f"{key} of {item.path}: {what}, not a {' or '.join(kinds)}", item.fields[key].line)
            found.append(one)
        return found

    def ref(self, item: Item, key: str, kinds: tuple[str, ...] = ()) -> Item | None:
        """Return the one object that an argument names, None where it was not given."""
        found = self.refs(item, key, kinds)
        if len(found) > 1:
            raise ViewError(f"{key} of {item.path}: {len(found)} objects; give one", item.fields[key].line)
        return found[0] if found else None

    # Places.

    def home(self, item: Item) -> Item | None:
        """Return the body in whose frame an object's place is kept, None for the global one."""
        return None if item.kind in PARTS or item.kind == "model" else self.db.owner(item)

    def location(self, item: Item) -> np.ndarray:
        """Return an object's position in the frame of its home."""
        stored = item.fields.get("location")
        if stored is not None and (id(item), "location") in self.busy and stored.before is not None:
            stored = stored.before
        if stored is None:
            return frames.ORIGIN
        if not stored.live:
            item.used.add("location")
            return np.array([value for _, value in stored.values], float)
        values = self.values(item, "location", stored.frame)
        numbers = Evaluator(self.lookup, lambda *_: 0, stored.line).numbers(values)
        if len(numbers) != 3:
            raise ViewError(f"the location of {item.path} has {len(numbers)} coordinates; give three", stored.line)
        return self.brought(np.array(numbers), stored.frame, self.home(item))

    def brought(self, point: np.ndarray, frame: Item | None, home: Item | None) -> np.ndarray:
        """Return coordinates of a frame in another one."""
        if frame is home or self.same(frame, home):
            return point
        a, r = self.pose(frame)
        b, s = self.pose(home)
        return b.T @ (a @ point + r - s)

    @staticmethod
    def same(one: Item | None, other: Item | None) -> bool:
        """Return whether two frames are the global one."""
        return all(item is None or item.kind == "model" or is_ground(item) for item in (one, other))

    def orientation(self, item: Item) -> np.ndarray:
        """Return an object's rotation in the frame of its home."""
        stored = item.fields.get("orientation")
        if stored is not None and (id(item), "orientation") in self.busy and stored.before is not None:
            stored = stored.before
        if stored is None:
            return frames.IDENTITY
        if not stored.live and len(stored.values) == 1 and isinstance(stored.values[0][1], np.ndarray):
            item.used.add("orientation")
            return stored.values[0][1]
        values = self.values(item, "orientation", stored.frame)
        angles = Evaluator(self.lookup, lambda *_: 0, stored.line).numbers(values)
        # functions of orientations give 313 angles whatever the setting is
        whole = stored.live and len(stored.values) == 1
        sequence = "body313" if whole else stored.sequence
        a = frames.rotation([x * self.db.units.radian for x in angles], sequence, stored.line)
        home = self.home(item)
        if stored.frame is home or self.same(stored.frame, home):
            return a
        return self.pose(home)[0].T @ self.pose(stored.frame)[0] @ a

    def pose(self, item: Item | None) -> Pose:
        """Return the rotation and the position of an object's frame in the global one."""
        if item is None or item.kind == "model" or is_ground(item):
            return GLOBAL
        if item.kind not in PLACED:
            raise ViewError(f"{item.path} is a {item.kind.replace('_', ' ')}, which has no place")
        if self._version != self.db.version:
            self._poses, self._version = {}, self.db.version
        known = self._poses.get(id(item))
        if known is None:
            a, r = self.pose(self.home(item))
            known = a @ self.orientation(item), a @ self.location(item) + r
            self._poses[id(item)] = known
        return known

    def point(self, item: Item) -> np.ndarray:
        """Return an object's position in the global frame, whatever its orientation depends on."""
        if item.kind == "model" or is_ground(item):
            return frames.ORIGIN
        if item.kind not in PLACED:
            raise ViewError(f"{item.path} is a {item.kind.replace('_', ' ')}, which has no place")
        a, r = self.pose(self.home(item))
        return a @ self.location(item) + r


def is_ground(item: Item) -> bool:
    """Return whether an object is the ground of its model."""
    return item.kind == "part" and item.fields.get("ground_part") is not None
