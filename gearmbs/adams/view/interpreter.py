"""Carries out the commands of a file: objects made and changed, conditions, loops, macros; with bounded work.

Nothing outside the folder of the file is read, nothing is written, and no program is started: commands that would do so
are not in the vocabulary.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.adams.parse.reader import read_text
from gearmbs.adams.view import frames
from gearmbs.adams.view.expressions import text_of
from gearmbs.adams.view.lexer import BARE, EXPRESSION, TEXT, Command, Value, ViewError, commands
from gearmbs.adams.view.model import PARTS, PLACED, Database, Item
from gearmbs.adams.view.values import ORIENTATIONS, Stored, Values, fixed
from gearmbs.adams.view.vocabulary import Row, argument_of, resolve

MOST_COMMANDS = 300_000
"""Commands that are carried out; the largest public models have some 10 000."""
MOST_ERRORS = 50
DEEPEST_CALLS = 20
"""Macros and files within each other."""
MACRO_KINDS = ("real", "integer", "string", "location", "orientation", "marker", "part", "model", "object")
_PARAMETER = re.compile(r"\$'?([A-Za-z_]\w*)'?((?::[A-Za-z]+=[^:\s]*)*)")


@dataclass
class Block:
    """Commands that belong to a condition or a loop, with the parts that follow them.

    Attributes
    ----------
    command : Command
        IF, ELSEIF, ELSE, FOR or WHILE.
    body : list of Command or Block
    otherwise : Block or None
        ELSEIF or ELSE.
    """

    command: Command
    row: Row
    body: list[Any] = field(default_factory=list)
    otherwise: Block | None = None


@dataclass(frozen=True)
class Macro:
    """Commands that a name stands for, with their parameters and defaults."""

    text: str
    line: int
    parameters: dict[str, str]


class _Leave(Exception):
    """BREAK, CONTINUE or RETURN."""

    def __init__(self, word: str) -> None:
        super().__init__(word)
        self.word = word


class Interpreter:
    """Carries out commands.

    Parameters
    ----------
    folder : Path or None
        Where files that are named may be; None allows none.
    variables : mapping of str to float
        Values of variables instead of those in the file.

    Attributes
    ----------
    database : Database
    values : Values
    errors : list of ViewError
    runs : list of (Command, Row)
        Simulations that the file asks for.
    ignored : dict of str to list of int
        Lines of the commands that have no effect here, by their words.
    """

    def __init__(self, folder: Path | None = None, variables: Mapping[str, float] | None = None) -> None:
        self.database = Database()
        self.values = Values(self.database)
        self.folder = folder
        self.overrides = {name.lower(): float(value) for name, value in (variables or {}).items()}
        self.overridden: set[str] = set()
        self.errors: list[ViewError] = []
        self.runs: list[tuple[Row, dict[str, Any], int]] = []
        self.ignored: dict[str, list[int]] = {}
        self.macros: dict[tuple[str, ...], Macro] = {}
        self.carried_out = 0
        self.calls = 0
        self.at = 0

    def run(self, text: str) -> None:
        """Carry out the commands of a text."""
        try:
            self._body(self._blocks(commands(text)))
        except _Leave:
            pass

    # The structure of a file.

    def _blocks(self, found: Iterator[Command | ViewError]) -> list[Any]:
        """Return commands, those of conditions and loops within these."""
        top: list[Any] = []
        stack: list[tuple[Block, Block]] = []
        body = top
        for command in found:
            if isinstance(command, ViewError):
                self._failed(command)
                continue
            word = command.words[0]
            if word in ("if", "for", "while") and len(command.words) == 1:
                block = Block(command, self._row(command))
                body.append(block)
                stack.append((block, block))
                body = block.body
            elif word in ("elseif", "else", "end") and len(command.words) == 1:
                if not stack:
                    self._failed(ViewError(f"{word} without a condition or a loop before it", command.line))
                    continue
                first, last = stack.pop()
                if word == "end":
                    body = (stack[-1][1] if stack else Block(command, last.row, top)).body
                    continue
                if first.command.words[0] != "if":
                    self._failed(ViewError(f"{word} within {first.command.words[0]}", command.line))
                last.otherwise = Block(command, self._row(command))
                stack.append((first, last.otherwise))
                body = last.otherwise.body
            else:
                body.append(command)
        for first, _ in stack:
            self._failed(ViewError(f"{first.command.words[0]} is not closed by an end", first.command.line))
        return top

    @staticmethod
    def _row(command: Command) -> Row:
        row = resolve(command.words, command.line)
        assert row is not None
        return row

    def _failed(self, error: ViewError) -> None:
        if not error.line:
            error.line = self.at
        self.errors.append(error)
        if len(self.errors) >= MOST_ERRORS:
            raise _Leave("return")

    def _body(self, body: Sequence[Any]) -> None:
        for one in body:
            self.carried_out += 1
            if self.carried_out > MOST_COMMANDS:
                self.errors.append(ViewError(f"more than {MOST_COMMANDS} commands: a loop does not end", self.at))
                raise _Leave("return")
            command = one.command if isinstance(one, Block) else one
            if not self.calls:
                self.at = command.line
            try:
                if isinstance(one, Block):
                    self._block(one)
                else:
                    self._command(one)
            except ViewError as error:
                if self.calls:
                    error.line = self.at
                self._failed(error)

    def _block(self, block: Block) -> None:
        word = block.command.words[0]
        if word == "for":
            self._for(block)
        elif word == "while":
            while self._true(block):
                if not self._once(block.body):
                    return
                self.carried_out += 1
                if self.carried_out > MOST_COMMANDS:
                    raise ViewError(f"more than {MOST_COMMANDS} commands: this loop does not end", block.command.line)
        else:
            taken: Block | None = block
            while taken is not None and taken.command.words[0] != "else" and not self._true(taken):
                taken = taken.otherwise
            if taken is not None:
                self._body(taken.body)

    def _true(self, block: Block) -> bool:
        given = self._arguments(block.command, block.row)
        if "condition" not in given:
            raise ViewError(f"{block.command.words[0]} needs condition = (...)", block.command.line)
        return all(self._truth(one) for one in self._now(given["condition"]))

    @staticmethod
    def _truth(value: Any) -> bool:
        if isinstance(value, str):
            return value.lower() not in ("", "0", "no", "off", "false", "none")
        return bool(value)

    def _once(self, body: Sequence[Any]) -> bool:
        """Carry out the body of a loop once; return whether the loop goes on."""
        try:
            self._body(body)
        except _Leave as left:
            if left.word == "return":
                raise
            return left.word == "continue"
        return True

    def _for(self, block: Block) -> None:
        given = self._arguments(block.command, block.row)
        line = block.command.line
        if "variable_name" not in given:
            raise ViewError("for needs variable_name", line)
        name = text_of(self._now(given["variable_name"])[0])
        if "object_names" in given:
            members = self._members(self._now(given["object_names"]), given)
        else:
            first = given.get("start_value", given.get("from"))
            last = given.get("end_value", given.get("to"))
            if first is None or last is None:
                raise ViewError("for needs start_value and end_value, or object_names", line)
            step = self._number(given["increment_value"], line) if "increment_value" in given else 1.0
            members = _counted(self._number(first, line), self._number(last, line), step, line)
        old = self.values.loops.get(name.lower())
        loop = self.values.loops[name.lower()] = Item("variable", name, line)
        try:
            for member in members:
                loop.fields = {"real_value": fixed(member)}
                self.database.version += 1
                if not self._once(block.body):
                    break
        finally:
            if old is None:
                self.values.loops.pop(name.lower(), None)
            else:
                self.values.loops[name.lower()] = old

    def _members(self, found: list[Any], given: Mapping[str, Any]) -> list[Any]:
        members: list[Any] = []
        kind = text_of(self._now(given["type"])[0]).lower() if "type" in given else ""
        for one in found:
            pattern = text_of(one)
            if "*" in pattern:
                form = re.compile(re.escape(pattern.lower()).replace(r"\*", "[^.]*") + r"\Z")
                members += [item for key, item in self.database.items.items() if form.match(key)]
            elif pattern:
                item = one if isinstance(one, Item) else self.database.find(pattern)
                members.append(item if item is not None else one)
        return [one for one in members if not kind or not isinstance(one, Item) or one.kind == kind]

    def _number(self, stored: Stored, line: int) -> float:
        found = self._now(stored)
        value = found[0] if found else None
        if isinstance(value, Item) and value.kind == "variable":
            value = self.values.variable(value)
        if not isinstance(value, (int, float)):
            raise ViewError(f"a number is wanted, not {text_of(value)[:60] if value is not None else 'nothing'}", line)
        return value

    # One command.

    def _command(self, command: Command) -> None:
        if self._called(command):
            return
        row = resolve(command.words, command.line)
        if row is None:
            self.ignored.setdefault(command.words[0], []).append(command.line)
            return
        if row.words[0] in ("break", "continue", "return"):
            raise _Leave(row.words[0])
        given = self._arguments(command, row)
        if row.verb == "attributes":
            self._attributes(row, given, command.line)
        elif row.verb == "delete":
            for item in self._named(row, given, command.line):
                self.database.remove(item)
        elif row.kind == "macro":
            self._macro(row, given, command.line)
        elif row.kind == "variable":
            self._variable(row, given, command.line)
        elif row.kind:
            self._object(row, given, command.line)
        elif row.words[0] == "defaults":
            self._defaults(row, given, command.line)
        elif row.words == ("file", "command", "read"):
            self._file(given, command.line)
        else:
            self.runs.append((row, {key: self._now(value) for key, value in given.items()}, command.line))

    def _arguments(self, command: Command, row: Row) -> dict[str, Stored]:
        """Return the arguments of a command by their full names."""
        given: dict[str, Stored] = {}
        for word, values in command.arguments:
            name = argument_of(row, word, values[0].line if values else command.line)
            if name in given:
                raise ViewError(f"{' '.join(row.words)}: {name} is given twice", command.line)
            if row.arguments.get(name, False):
                given[name] = self.values.stored(values)
        return given

    def _now(self, stored: Stored) -> list[Any]:
        """Return what an argument comes to at once; words that name nothing stay words."""
        found: list[Any] = []
        for kind, value in stored.values:
            one = self.values.evaluate(value, stored.line) if kind == "tree" else value
            found.extend(one if isinstance(one, list) else [one])
        return found

    def _name(self, row: Row, given: dict[str, Stored], line: int) -> str | None:
        if row.naming not in given:
            return None
        found = self._now(given[row.naming])
        if len(found) != 1:
            raise ViewError(f"{' '.join(row.words)}: {row.naming} is one name", line)
        return text_of(found[0])

    def _named(self, row: Row, given: dict[str, Stored], line: int) -> list[Item]:
        """Return the objects that a command is about."""
        if row.naming not in given:
            raise ViewError(f"{' '.join(row.words)} needs {row.naming}", line)
        found = []
        for one in self._now(given[row.naming]):
            item = one if isinstance(one, Item) else self.database.find(text_of(one))
            if item is None:
                raise ViewError(f"{' '.join(row.words)}: there is no {text_of(one)[:80]}", line)
            found.append(item)
        return found

    def _attributes(self, row: Row, given: dict[str, Stored], line: int) -> None:
        if "active" not in given:
            return
        word = text_of((self._now(given["active"]) or [""])[0]).lower()
        if word in ("no_opinion", "no_op"):
            return
        active = word in ("on", "yes", "true", "1")
        for one in self._now(given[row.naming]) if row.naming in given else []:
            item = one if isinstance(one, Item) else self.database.find(text_of(one))
            if item is not None:
                item.active = active
            elif row.words[0] != "geometry":
                raise ViewError(f"{' '.join(row.words)}: there is no {text_of(one)[:80]}", line)

    def _object(self, row: Row, given: dict[str, Stored], line: int) -> None:
        """Make or change an object."""
        name = self._name(row, given, line)
        renamed = f"new_{row.naming}"
        if renamed in given:
            raise ViewError(f"{' '.join(row.words)}: {renamed} is not carried out; give the name at first", line)
        item = self._of_name(row, name, line)
        fields = {key: value for key, value in given.items() if key != row.naming}
        if item.kind in PLACED and item.kind != "model":
            self._place(item, fields)
        item.fields.update(fields)
        if item.kind == "csg":
            # what a solid is made of belongs to it from now on
            for part in [*self.values.refs(item, "base_object"), *self.values.refs(item, "object")]:
                self.database.move(part, f"{item.path}.{part.name}", line)
        if item.kind in PARTS:
            self.database.part = item
        if row.kind == "model":
            self._new_model(item, line)
        self.database.version += 1

    def _of_name(self, row: Row, name: str | None, line: int) -> Item:
        """Return the object of a command, made if it is to be made."""
        db = self.database
        if name is None and row.verb != "create" and (last := db.of(row.kind)):
            return last[-1]
        if name is None:
            if row.verb != "create" or row.kind not in ("marker", "part", "point"):
                raise ViewError(f"{' '.join(row.words)} needs {row.naming}", line)
            stem = f"{row.kind.upper()}_"
            k = 1
            while db.find(db.full_name(f"{stem}{k}", row.kind, line)) is not None:
                k += 1
            name = f"{stem}{k}"
        known = db.find(name) if row.verb != "create" or name.startswith(".") else None
        if known is None and row.verb == "create":
            known = db.items.get(db.full_name(name, row.kind, line).lower())
        if row.kind in ("integrator", "gstiff", "wstiff"):
            owner = self._model_named(name, line)
            known = db.items.get(f"{owner.path}.{row.kind}".lower())
            return known or db.add(row.kind, f"{owner.path}.{row.kind}", line)
        if row.verb == "create" and known is None:
            path = db.full_name(name, row.kind, line)
            self._check_owner(path, row.kind, line)
            return db.add(row.kind, path, line)
        if known is None:
            raise ViewError(f"{' '.join(row.words)}: there is no {name[:80]}", line)
        again = row.words[-1] in ("mass_properties", "initial_velocity", "modal_ics") or is_ground_again(known)
        if known.kind != row.kind and not (row.kind in JOINTS and known.kind in JOINTS):
            raise ViewError(f"{' '.join(row.words)}: {known.path} is a {known.kind.replace('_', ' ')}", line)
        if row.verb == "create" and not again:
            raise ViewError(f"{' '.join(row.words)}: there is a {known.path} already, made in line {known.line}", line)
        return known

    def _model_named(self, name: str, line: int) -> Item:
        found = self.database.find(name if name.startswith(".") else "." + name)
        if found is None or found.kind != "model":
            raise ViewError(f"there is no model {name[:60]}", line)
        return found

    def _check_owner(self, path: str, kind: str, line: int) -> None:
        """See that what a new object belongs to exists.

        Raises
        ------
        ViewError
        """
        if kind == "model" or path.count(".") < 2:
            if kind in PLACED and kind != "model":
                raise ViewError(f"{path} belongs to no model", line)
            return
        owner = self.database.items.get(path.rsplit(".", 1)[0].lower())
        if owner is None:
            raise ViewError(f"{path}: there is no {path.rsplit('.', 1)[0]}", line)
        if kind in ("marker", "point") and owner.kind not in (*PARTS, "fe_part"):
            raise ViewError(f"{path}: a {kind} belongs to a part; {owner.path} is a {owner.kind}", line)

    def _new_model(self, item: Item, line: int) -> None:
        db = self.database
        db.model = item
        ground = db.items.get(f"{item.path}.ground".lower())
        if ground is None:
            ground = db.add("part", f"{item.path}.ground", line)
            ground.fields["ground_part"] = fixed("yes", line=line)
        db.part, db.frame = ground, None

    def _place(self, item: Item, fields: dict[str, Stored]) -> None:
        """Bring places and orientations into the frame of an object's home, or keep their expressions with their frame."""
        values = self.values
        frame = self.database.frame
        if "relative_to" in fields:
            stored = fields.pop("relative_to")
            holder = Item("", item.path, stored.line, {"relative_to": stored})
            frame = values.ref(holder, "relative_to", PLACED)
        home = values.home(item)
        sequence = self.database.sequence
        if "location" in fields:
            stored = fields["location"]
            if stored.live:
                fields["location"] = Stored(stored.values, stored.line, frame, before=_fixed_before(item, "location"))
            else:
                point = np.array(self._triple(stored, f"the location of {item.path}"))
                here = values.brought(point, frame, home)
                fields["location"] = fixed(*(float(x) for x in here), line=stored.line)
        for key in ORIENTATIONS:
            if key not in fields:
                continue
            stored = fields.pop(key)
            if key != "orientation":
                fields["orientation"] = self._directed(item, key, stored, frame, fields)
            elif stored.live:
                fields[key] = Stored(stored.values, stored.line, frame, sequence, _fixed_before(item, key))
            else:
                radian = self.database.units.radian
                angles = self._triple(stored, f"the orientation of {item.path}")
                a = frames.rotation([x * radian for x in angles], sequence, stored.line)
                if frame is not home and not values.same(frame, home):
                    a = values.pose(home)[0].T @ values.pose(frame)[0] @ a
                fields[key] = Stored((("value", a),), stored.line)

    def _triple(self, stored: Stored, what: str) -> list[float]:
        found = self._now(stored)
        if len(found) != 3 or not all(isinstance(x, (int, float)) for x in found):
            shown = ", ".join(text_of(x) for x in found)[:60]
            raise ViewError(f"{what} is three numbers, not {shown}", stored.line)
        return [float(x) for x in found]

    def _directed(self, item: Item, key: str, stored: Stored, frame: Item | None, fields: dict[str, Stored]) -> Stored:
        """Return the orientation that points give: an axis through two, and a plane through a third."""
        values = self.values
        found = self._now(stored)
        if not all(isinstance(x, (int, float)) for x in found) or len(found) not in (3, 6, 9):
            raise ViewError(f"{key} of {item.path}: give points of three coordinates", stored.line)
        home = values.home(item)
        points = [values.brought(np.array(found[k : k + 3], float), frame, home) for k in range(0, len(found), 3)]
        if len(points) < (2 if key == "along_axis_orientation" else 3):
            start = fields.get("location", item.fields.get("location"))
            points.insert(0, np.array(self._triple(start, "location")) if start is not None else frames.ORIGIN)
        first, plane = self.database.axis[0], self.database.axis.split("_")[-2]
        if key == "along_axis_orientation":
            a = frames.along(first, points[1] - points[0])
        else:
            second = plane.replace(first, "", 1)
            a = frames.in_plane(first, second[:1] or "x", points[1] - points[0], points[2] - points[0])
        return Stored((("value", a),), stored.line)

    # Variables, settings, files and macros.

    def _variable(self, row: Row, given: dict[str, Stored], line: int) -> None:
        db = self.database
        name = self._name(row, given, line)
        if name is None:
            raise ViewError(f"{' '.join(row.words)} needs variable_name", line)
        loop = self.values.loops.get(name.lower())
        item = loop or db.find(name, ("variable",))
        if item is None and row.verb == "modify" and (owner := db.items.get(name.rpartition(".")[0].lower())) is not None:
            if owner.kind != "ude":
                raise ViewError(f"variable modify: there is no variable {name[:80]}", line)
            item = db.add("variable", name, line)
        if item is None and row.verb == "modify":
            raise ViewError(f"variable modify: there is no variable {name[:80]}", line)
        if item is not None and row.verb == "create":
            raise ViewError(f"variable create: there is a {item.path} already, made in line {item.line}", line)
        if item is None:
            item = db.add("variable", db.full_name(name, "variable", line), line)
        held = {key: given[key] for key in VALUES if key in given}
        if len(held) > 1:
            raise ViewError(f"{' '.join(row.words)}: give one of {', '.join(held)}", line)
        override = next((key for key in self.overrides if _meant(item, key)), None)
        if override is not None:
            self.overridden.add(override)
            item.fields["real_value"] = fixed(self.overrides[override], line=line)
        elif held and "index" in given:
            self._member(item, given["index"], *held.items(), line=line)
        elif held:
            for key in VALUES:
                item.fields.pop(key, None)
            item.fields.update(held)
        db.version += 1

    def _member(self, item: Item, index: Stored, held: tuple[str, Stored], line: int) -> None:
        """Set one member of a variable that is a list."""
        k = round(self._number(index, line))
        old = self.values.variable(item)
        members = list(old) if isinstance(old, list) else [old]
        if not 1 <= k <= len(members) + 1000:
            raise ViewError(f"index = {k}: {item.path} has {len(members)} members", line)
        members += [0] * (k - len(members))
        members[k - 1] = self._now(held[1])[0]
        item.fields[held[0]] = fixed(*members, line=line)

    def _defaults(self, row: Row, given: dict[str, Stored], line: int) -> None:
        db = self.database
        what = row.words[1]
        words = {key: text_of((self._now(value) or [""])[0]) for key, value in given.items()}
        if what == "units":
            for quantity in ("force", "mass", "length", "time", "angle"):
                if quantity in words:
                    before = db.units.names[quantity]
                    db.units.choose(quantity, words[quantity], line)
                    numbers = any(item.kind not in ("model", "variable", "part") for item in db)
                    if db.units.names[quantity] != before and numbers:
                        raise ViewError(f"the unit of {quantity} is changed after numbers were given in it", line)
            if words.get("coordinate_system_type", "cartesian")[:4].lower() != "cart":
                raise ViewError(f"coordinate_system_type = {words['coordinate_system_type'][:30]}; give cartesian", line)
            if "orientation_type" in words:
                frames.rotation([0.0, 0.0, 0.0], words["orientation_type"], line)
                db.sequence = words["orientation_type"]
        elif what == "coordinate_system" and "default_coordinate_system" in given:
            holder = Item("", "defaults", line, dict(given))
            db.frame = self.values.ref(holder, "default_coordinate_system", PLACED)
        elif what == "orient_axis_and_plane" and "axis_and_plane_setting" in words:
            setting = words["axis_and_plane_setting"].lower()
            if not re.match(r"[xyz]_axis(_(xy|yx|yz|zy|xz|zx)_plane)?\Z", setting):
                raise ViewError(f"axis_and_plane_setting = {setting[:40]}; give z_axis_zx_plane or the like", line)
            db.axis = setting if setting.endswith("plane") else f"{setting}_xz_plane"
        elif what == "model":
            if "model_name" in words:
                db.model = self._model_named(words["model_name"], line)
            if "part_name" in words:
                part = db.find(words["part_name"], PARTS)
                if part is not None:
                    db.part = part

    def _text_of_file(self, name: str, line: int) -> str:
        """Return the text of a file in the folder of this one.

        Raises
        ------
        ViewError
            If it is elsewhere, or cannot be read.
        """
        if self.folder is None:
            raise ViewError(f"{name[:80]}: a text without a folder reads no files", line)
        root = self.folder.resolve()
        path = (root / name.replace("\\", "/")).resolve()
        if root not in path.parents:
            raise ViewError(f"{name[:80]} is outside the folder of this file; copy it there", line)
        try:
            return read_text(path.read_bytes())
        except (OSError, ValueError) as error:
            raise ViewError(f"{name[:80]} cannot be read: {error}", line) from error

    def _file(self, given: dict[str, Stored], line: int) -> None:
        name = text_of((self._now(given["file_name"]) or [""])[0]) if "file_name" in given else ""
        self._nested(self._text_of_file(name, line), line)

    def _nested(self, text: str, line: int) -> None:
        """Carry out a text within this one; its errors are at the command that asked for it."""
        if self.calls >= DEEPEST_CALLS:
            raise ViewError(f"macros and files within each other, {DEEPEST_CALLS} deep", line)
        self.calls += 1
        try:
            self._body(self._blocks(commands(text)))
        except _Leave as left:
            if len(self.errors) >= MOST_ERRORS or self.carried_out > MOST_COMMANDS:
                raise left
        finally:
            self.calls -= 1

    def _macro(self, row: Row, given: dict[str, Stored], line: int) -> None:
        name = self._name(row, given, line)
        if name is None:
            raise ViewError("a macro needs macro_name", line)
        if row.verb == "read":
            text = self._text_of_file(text_of((self._now(given["file_name"]) or [""])[0]) if "file_name" in given else "", line)
        else:
            pieces = self._now(given["commands_to_be_executed"]) if "commands_to_be_executed" in given else []
            text = "\n".join(text_of(one) for one in pieces)
        called = self._now(given["user_entered_command"])[0] if "user_entered_command" in given else None
        for match in re.finditer(r"^!\s*USER_ENTERED_COMMAND\s+(.+)$", text, re.IGNORECASE | re.MULTILINE):
            called = called or match.group(1).strip()
        words = tuple(text_of(called or name.rsplit(".", 1)[-1]).lower().split())
        parameters: dict[str, str] = {}
        for match in _PARAMETER.finditer(text):
            options = dict(one.split("=", 1) for one in match.group(2).split(":") if "=" in one)
            default = next((v for k, v in options.items() if k.lower() in ("d", "default")), None)
            key = match.group(1).lower()
            if key != "_self" and (key not in parameters or default is not None):
                parameters[key] = default if default is not None else parameters.get(key, "")
        self.macros[words] = Macro(text, line, parameters)

    def _called(self, command: Command) -> bool:
        """Carry a macro out if a command calls one."""
        macro = self.macros.get(command.words)
        if macro is None:
            return False
        values = dict(macro.parameters)
        for word, found in command.arguments:
            names = [one for one in values if one == word] or [one for one in values if one.startswith(word)]
            if len(names) != 1:
                raise ViewError(f"{' '.join(command.words)}: it has no argument {word[:40]}", command.line)
            values[names[0]] = ", ".join(_written(one) for one in found)

        def filled(match: re.Match[str]) -> str:
            return values.get(match.group(1).lower(), match.group())

        body = "\n".join(line for line in macro.text.splitlines() if not line.lstrip().startswith("!"))
        self._nested(_PARAMETER.sub(filled, body), command.line)
        return True


VALUES = ("real_value", "integer_value", "string_value", "object_value")
JOINTS = frozenset(
    "revolute translational cylindrical spherical fixed universal hooke convel planar screw rackpin".split()
)


def _fixed_before(item: Item, key: str) -> Stored | None:
    """Return the numbers that an argument held before it holds an expression."""
    before = item.fields.get(key)
    return before.before if before is not None and before.live else before


def is_ground_again(item: Item) -> bool:
    """Return whether an object is a ground, which exists before it is made."""
    return item.kind == "part" and "ground_part" in item.fields


def _meant(item: Item, key: str) -> bool:
    path = item.path.lower()
    return path == key or path.endswith("." + key.lstrip("."))


def _written(value: Value) -> str:
    """Return a value as it stood in a command."""
    if value.kind == TEXT:
        return '"' + value.text.replace("\\", "\\\\").replace('"', '\\"') + '"'
    assert value.kind in (BARE, EXPRESSION)
    return value.text


def _counted(first: float, last: float, step: float, line: int) -> Iterator[float]:
    if step == 0.0 or (last - first) / step > MOST_COMMANDS:
        raise ViewError(f"for: from {first:g} to {last:g} by {step:g} does not end", line)
    count = int((last - first) / step * (1.0 + 1e-12)) + 1 if (last - first) * step >= 0 else 0
    whole = all(float(one).is_integer() for one in (first, step))
    return iter([int(first + k * step) if whole else first + k * step for k in range(count)])
