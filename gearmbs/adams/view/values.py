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
from gearmbs.adams.view.functions.defined import DEEPEST, MOST_CALLS, Defined, Scope, checked
from gearmbs.adams.view.functions.known import FUNCTIONS
from gearmbs.adams.view.lexer import BARE, EXPRESSION, Value, ViewError, closed
from gearmbs.adams.view.model import PARTS, PLACED, Database, Item
from gearmbs.adams.write.text import number

_NUMERIC = re.compile(r"[+-]?(?:\d|\.\d)")
_EVAL = re.compile(r"(?<![\w.$])eval\s*\(", re.IGNORECASE)
_PLAIN = re.compile(r"[\w.$]+")
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
    """

    values: tuple[tuple[str, Any], ...]
    line: int = 0
    frame: Item | None = None
    sequence: str = "body313"

    @property
    def live(self) -> bool:
        """Whether it is computed anew when it is asked for."""
        return any(kind == "tree" for kind, _ in self.values)


def fixed(*values: Any, line: int = 0) -> Stored:
    """Return what holds these values."""
    return Stored(tuple(("value", one) for one in values), line)


def _literal(value: Any, name: bool = False) -> str:
    """Return a value as an expression has it; a text without quotation marks where it may be a name."""
    if isinstance(value, str):
        if name and _PLAIN.fullmatch(value):
            return value
        quoted = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{quoted}"'
    return value.path if isinstance(value, Item) else number(value)


class _DeepError(Exception):
    """An argument is to be evaluated before what asks for it."""

    def __init__(self, *wanted: Any) -> None:
        self.wanted: tuple[Item, str, Item | None] = wanted


SHOWN = 4
"""Arguments of a circle that a message names."""


def _circle(rows: list[tuple[Item, str]]) -> ViewError:
    """Return the error of arguments each of which depends on the next one, and the last on the first."""
    first, key = rows[0]
    shown = [f"the {name} of {item.path}" for item, name in rows[1 : SHOWN + 1]]
    through = f", through {', '.join(shown)}{' and others' if len(rows) > SHOWN + 1 else ''}" if shown else ""
    line = max(item.fields[name].line for item, name in rows)
    return ViewError(f"{key} of {first.path} depends on itself{through}; give one of them numbers", line)


class Values:
    """Reads arguments of objects in a database."""

    def __init__(self, database: Database) -> None:
        self.db = database
        self.busy: dict[tuple[int, str], Item] = {}
        self._deep: dict[tuple[int, str, int], list[Any]] = {}
        self.loops: dict[str, Item] = {}
        self.functions: dict[str, Defined] = {}
        self._depth = self._calls = 0
        self._poses: dict[int, Pose] = {}
        self._rotations: dict[int, np.ndarray] = {}
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
            loop, rest = self._of_loop(tree[1])
            if loop is None:
                return tree
            held = self.variable(loop)
            return ("name", f"{held.path}.{rest}") if rest and isinstance(held, Item) else ("value", held)
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
        return self.evaluator(line, frame)(tree)

    def evaluator(self, line: int, frame: Item | None, scope: Scope | None = None) -> Evaluator:
        """Return what evaluates expressions; in a function of the file, with what it was called with."""

        def lookup(name: str) -> Any:
            return self.lookup(name) if scope is None else scope.lookup(name, frame)

        return Evaluator(lookup, lambda name, args, ev: self.call(name, args, ev, frame, scope), line)

    def call(
        self, name: str, args: tuple[Tree, ...], evaluator: Evaluator, frame: Item | None, scope: Scope | None = None
    ) -> Any:
        """Return the value of a function."""
        function = FUNCTIONS.get(name)
        if function is None:
            if (defined := self.functions.get(name.lower())) is None:
                raise evaluator.error(f"the function {name[:40]} is not evaluated here")
            return self._defined(defined, args, evaluator, frame, scope)
        if not function.least <= len(args) <= function.most:
            raise evaluator.error(f"{name} has {function.least} to {function.most} arguments, not {len(args)}")
        if function.placing:
            # what a function of places gets is global; what it gives is in the frame that it is asked in
            inner = self.evaluator(evaluator.line, None, scope)
            return function.run(self, inner, [inner(one) for one in args], frame)
        return function.run(self, evaluator, [evaluator(one) for one in args], frame)

    def _defined(
        self, one: Defined, args: tuple[Tree, ...], evaluator: Evaluator, frame: Item | None, outer: Scope | None
    ) -> Any:
        """Return the value of a function that the file defines."""
        if len(args) != len(one.arguments):
            raise evaluator.error(f"{one.name} has {len(one.arguments)} arguments, not {len(args)}")
        self._calls = self._calls + 1 if self._depth else 1
        if self._depth >= DEEPEST or self._calls > MOST_CALLS:
            often = f"{DEEPEST} deep" if self._depth >= DEEPEST else f"more than {MOST_CALLS} times for one value"
            raise evaluator.error(f"{one.name}: functions call each other, {often}; give parts of them values")
        line = evaluator.line
        scope = Scope(dict(zip(one.arguments, args)), lambda home: self.evaluator(line, home, outer), self.lookup)
        self._depth += 1
        try:
            return checked(one, self.evaluator(line, frame, scope)(one.body), evaluator)
        except RecursionError:
            raise evaluator.error(f"{one.name}: its expressions are nested too deeply") from None
        finally:
            self._depth -= 1

    def lookup(self, name: str) -> Any:
        """Return what a name stands for in an expression: the value of a variable, an object or an attribute.

        Raises
        ------
        ViewError
        """
        loop, rest = self._of_loop(name)
        if loop is not None and rest:
            held = self.variable(loop)
            if not isinstance(held, Item):
                raise ViewError(f"{name[:80]}: {loop.path} is {text_of(held)[:40]}, no object")
            return self.lookup(f"{held.path}.{rest}")
        item = loop or self.db.find(name)
        if item is not None:
            return self.variable(item) if item.kind == "variable" else item
        if name.lower() in _SPECIAL:
            return _SPECIAL[name.lower()]
        head, dot, attribute = name.rpartition(".")
        owner = self.db.find(head) if dot and head else None
        if owner is not None:
            return self.attribute(owner, attribute)
        raise ViewError(f"there is no object {name[:80]}")

    def _of_loop(self, name: str) -> tuple[Item | None, str]:
        """Return the variable of a loop that a name begins with, and what follows: an attribute of its object."""
        head, rest = name, ""
        while self.loops and head:
            if (loop := self.loops.get(head.lower())) is not None:
                return loop, rest
            head, _, last = head.rpartition(".")
            rest = f"{last}.{rest}" if rest else last
        return None, ""

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
        if not fields and item.kind == "variable" and isinstance(held := self.variable(item), Item):
            return self.attribute(held, name)
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
                    values = [
                        (self.db.find(one) or one) if isinstance(one, str) else one for one in values if one != ""
                    ]
                return values[0] if len(values) == 1 else values
        return 0

    def called_with(self, text: str, line: int) -> str:
        """Return an expression as a macro gets it: what stands in EVAL is evaluated at the call, and written as it is.

        Where EVAL is all of it, the bare value is written, of which a macro may make names.
        """
        tree = self.frozen(parse(text, self.db.units, line), line)
        if tree[0] == "value":
            return ", ".join(_literal(one, name=True) for one in (tree[1] if isinstance(tree[1], list) else [tree[1]]))
        pieces, at = [], 0
        for match in _EVAL.finditer(text):
            end = closed(text, match.end() - 1)
            if match.start() < at:
                continue
            value = self.evaluate(parse(text[match.end() : end - 1], self.db.units, line), line)
            members = value if isinstance(value, list) else [value]
            written = ", ".join(_literal(one) for one in members)
            pieces += [text[at : match.start()], f"{{{written}}}" if isinstance(value, list) else written]
            at = end
        return "".join(pieces) + text[at:]

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
                same = (all(a is b for a, b in zip(deep.wanted, one)) for one in waiting)
                if (first := next((k for k, one in enumerate(same) if one), None)) is not None:
                    raise _circle([(one, name) for one, name, _ in waiting[first:]]) from None
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
            rows = [(one, name) for (_, name), one in self.busy.items()]
            raise _circle(rows[list(self.busy).index(mark) :])
        known = self._deep.get((id(item), key, id(frame)))
        if known is not None:
            return known
        if len(self.busy) >= AT_ONCE:
            raise _DeepError(item, key, frame)
        self.busy[mark] = item
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
            self.busy.pop(mark, None)

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
        return self.rotation(home).T @ self.rotation(stored.frame) @ a

    def rotation(self, item: Item | None) -> np.ndarray:
        """Return the rotation of an object's frame in the global one, whatever its place depends on."""
        if item is None or item.kind == "model" or is_ground(item):
            return frames.IDENTITY
        self._see_placed(item)
        known = self._rotations.get(id(item))
        if known is None:
            known = self._rotations[id(item)] = self.rotation(self.home(item)) @ self.orientation(item)
        return known

    def pose(self, item: Item | None) -> Pose:
        """Return the rotation and the position of an object's frame in the global one."""
        if item is None or item.kind == "model" or is_ground(item):
            return GLOBAL
        self._see_placed(item)
        known = self._poses.get(id(item))
        if known is None:
            known = self._poses[id(item)] = self.rotation(item), self.point(item)
        return known

    def _see_placed(self, item: Item) -> None:
        """See that an object has a place, and forget places from before a change.

        Raises
        ------
        ViewError
        """
        if item.kind not in PLACED:
            raise ViewError(f"{item.path} is a {item.kind.replace('_', ' ')}, which has no place")
        if self._version != self.db.version:
            self._poses, self._rotations, self._version = {}, {}, self.db.version

    def point(self, item: Item) -> np.ndarray:
        """Return an object's position in the global frame, whatever its orientation depends on."""
        if item.kind == "model" or is_ground(item):
            return frames.ORIGIN
        self._see_placed(item)
        a, r = self.pose(self.home(item))
        return a @ self.location(item) + r


def is_ground(item: Item) -> bool:
    """Return whether an object is the ground of its model."""
    return item.kind == "part" and item.fields.get("ground_part") is not None
