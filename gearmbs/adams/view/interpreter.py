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

from gearmbs.adams.parse.files import LONGEST_NAME, named_file
from gearmbs.adams.parse.reader import read_text
from gearmbs.adams.view.edits import Editor
from gearmbs.adams.view.expressions import text_of
from gearmbs.adams.view.functions.defined import defined
from gearmbs.adams.view.lexer import BARE, EXPRESSION, TEXT, Command, Value, ViewError, commands
from gearmbs.adams.view.model import PARTS, UNREAD, Item
from gearmbs.adams.view.values import Stored, fixed, is_ground
from gearmbs.adams.view.vocabulary import Row, kinds_of, resolve

MOST_COMMANDS = 300_000
"""Commands that are carried out; the largest public models have some 10 000."""
MOST_ERRORS = 50
DEEPEST_CALLS = 20
"""Macros and files within each other."""
_PARAMETER = re.compile(
    r"\$(?:'(?P<quoted>[A-Za-z_]\w*)(?P<within>(?::[A-Za-z]+=[^:'\s]*)*)'|(?P<plain>[A-Za-z_]\w*))"
    r"(?P<behind>(?::[A-Za-z]+=[^:\s]*)*)"
)
"""A parameter of a macro with its qualifiers: $length:t=real:d=5, $'length:t=real:d=5' or $'length'."""


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

    name: str
    text: str
    line: int
    parameters: dict[str, str]


class _Leave(Exception):
    """BREAK, CONTINUE or RETURN."""

    def __init__(self, word: str) -> None:
        super().__init__(word)
        self.word = word


class Interpreter(Editor):
    """Carries out commands.

    Parameters
    ----------
    folder : Path or None
        Where files that are named may be; None allows none.
    variables : mapping of str to float
        Values of variables instead of those in the file.

    Attributes
    ----------
    errors : list of ViewError
    runs : list of (Command, Row)
        Simulations that the file asks for.
    parasolids : list of (str, int)
        Files with geometry that the file reads, with their lines.
    ignored : dict of str to list of int
        Lines of the commands that have no effect here, by their words.
    """

    def __init__(self, folder: Path | None = None, variables: Mapping[str, float] | None = None) -> None:
        super().__init__(variables)
        self.folder = folder
        self.errors: list[ViewError] = []
        self.runs: list[tuple[Row, dict[str, Any], int]] = []
        self.ignored: dict[str, list[int]] = {}
        self.parasolids: list[tuple[str, int]] = []
        self.macros: dict[tuple[str, ...], Macro] = {}
        self.carried_out = 0
        self.calls = 0
        self.at = 0

    def parts(self) -> list[Item]:
        """Return all bodies but the grounds."""
        return [item for item in self.database.of(*PARTS) if not is_ground(item)]

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
            members = list(_counted(self._number(first, line), self._number(last, line), step, line))
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
        kinds = kinds_of(text_of(self._now(given["type"])[0])) if "type" in given else None
        for one in found:
            pattern = text_of(one)
            if "*" in pattern:
                form = re.compile(re.escape(pattern.lower()).replace(r"\*", "[^.]*") + r"\Z")
                members += [item for key, item in self.database.items.items() if form.match(key)]
            elif pattern:
                item = one if isinstance(one, Item) else self.database.find(pattern)
                members.append(item if item is not None else one)
        return [one for one in members if kinds is None or not isinstance(one, Item) or one.kind in kinds]

    def _grouped(self, given: Mapping[str, Stored], line: int) -> Stored:
        """Return the objects of a group, those of one type where their names are patterns."""
        names = self._now(given["objects_in_group"])
        patterns = any("*" in text_of(one) for one in names)
        kind = given.get("type_filter") if patterns else None
        return fixed(*self._members(names, {} if kind is None else {"type": kind}), line=line)

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
        elif row.words[0] in ("function", "macro"):
            (self._function if row.words[0] == "function" else self._macro)(row, given, command.line)
        elif row.verb == "delete":
            for item in self._named(row, given, command.line):
                self.database.remove(item)
        elif row.kind == "variable":
            self._variable(row, given, command.line)
        elif row.kind:
            if row.kind == "group" and "objects_in_group" in given:
                given["objects_in_group"] = self._grouped(given, command.line)
            self._object(row, given, command.line)
        elif row.words[0] == "defaults":
            self._defaults(row, given, command.line)
        elif row.words == ("file", "command", "read"):
            self._file(given, command.line)
        elif row.words == ("file", "geometry", "read"):
            self._geometry(given, command.line)
        elif row.words == ("file", "parasolid", "read"):
            name = text_of((self._now(given["file_name"]) or [""])[0]) if "file_name" in given else ""
            self.parasolids.append((name, command.line))
            self.database.version += 1
            if set(given) & {"part_name", "location", "orientation", "relative_to"}:
                raise ViewError(
                    "file parasolid read: geometry is read as it was written, without a part or a place", command.line
                )
        else:
            self._simulation(row, {key: self._now(value) for key, value in given.items()}, command.line)

    def _simulation(self, row: Row, given: dict[str, Any], line: int) -> None:
        """Take note of a simulation; see `gearmbs.adams.view.simulations.runs.Simulator`."""
        self.runs.append((row, given, line))

    def _text_of_file(self, name: str, line: int) -> str:
        """Return the text of a file in the folder of this one.

        Raises
        ------
        ViewError
            If it is elsewhere, or cannot be read.
        """
        if self.folder is None:
            raise ViewError(f"{name[:LONGEST_NAME]}: a text without a folder reads no files", line)
        try:
            return read_text(named_file("file_name", name, self.folder / "this file").read_bytes())
        except (OSError, ValueError) as error:
            raise ViewError(f"{name[:LONGEST_NAME]} cannot be read: {error}", line) from error

    def _file(self, given: dict[str, Stored], line: int) -> None:
        name = text_of((self._now(given["file_name"]) or [""])[0]) if "file_name" in given else ""
        self._nested(self._text_of_file(name, line), line)

    def _geometry(self, given: dict[str, Stored], line: int) -> None:
        """Note that a part has geometry of a file, which is not read.

        Raises
        ------
        ViewError
            If no part is named: parts of unknown mass would be made.
        """
        name = text_of((self._now(given["file_name"]) or [""])[0]) if "file_name" in given else ""
        if "part_name" not in given:
            raise ViewError(
                f"file geometry read: {name[:80]} makes parts of a file that is not read; create them with their mass, "
                "and give part_name",
                line,
            )
        for one in self._now(given["part_name"]):
            part = one if isinstance(one, Item) else self.database.find(text_of(one), PARTS)
            if part is None or part.kind not in PARTS:
                raise ViewError(f"file geometry read: there is no part {text_of(one)[:80]}", line)
            k = sum(child.kind == UNREAD for child in part.children.values())
            solid = self.database.add(UNREAD, f"{part.path}.geometry_of_file_{k + 1}", line)
            solid.fields["file_name"] = fixed(name, line=line)

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
        if row.verb == "delete":
            gone = [words for words, macro in self.macros.items() if _same_name(macro.name, name)]
            if not gone:
                raise ViewError(f"macro delete: there is no macro {name[:80]}", line)
            del self.macros[gone[0]]
            return
        if row.verb == "read":
            text = self._text_of_file(
                text_of((self._now(given["file_name"]) or [""])[0]) if "file_name" in given else "", line
            )
        else:
            pieces = self._now(given["commands_to_be_executed"]) if "commands_to_be_executed" in given else []
            text = "\n".join(text_of(one) for one in pieces)
        called = self._now(given["user_entered_command"])[0] if "user_entered_command" in given else None
        for match in re.finditer(r"^!\s*USER_ENTERED_COMMAND\s+(.+)$", text, re.IGNORECASE | re.MULTILINE):
            called = called or match.group(1).strip()
        words = tuple(text_of(called or name.rsplit(".", 1)[-1]).lower().split())
        parameters: dict[str, str] = {}
        for match in _PARAMETER.finditer(text):
            qualifiers = f"{match['within'] or ''}{match['behind']}"
            options = dict(one.split("=", 1) for one in qualifiers.split(":") if "=" in one)
            default = next((v for k, v in options.items() if k.lower() in ("d", "default")), None)
            key = (match["quoted"] or match["plain"]).lower()
            if key != "_self" and (key not in parameters or default is not None):
                parameters[key] = default if default is not None else parameters.get(key, "")
        self.macros[words] = Macro(name, text, line, parameters)

    def _function(self, row: Row, given: dict[str, Stored], line: int) -> None:
        """Take note of a function of the file, change one, or forget it."""
        what, known = " ".join(row.words), self.values.functions
        name = self._name(row, given, line)
        if name is None:
            raise ViewError(f"{what} needs function_name", line)
        key = name.rpartition(".")[2].lower()
        if row.verb != "create" and key not in known:
            raise ViewError(f"{what}: there is no function {name[:80]}", line)
        self.database.version += 1
        if row.verb == "delete":
            del known[key]
            return
        now = {word: [text_of(one) for one in self._now(value)] for word, value in given.items()}
        function = defined(what, now, known.get(key) if row.verb == "modify" else None, self.database.units, line)
        if row.verb == "modify":
            del known[key]
        known[function.name.lower()] = function

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
            values[names[0]] = ", ".join(self._handed(one) for one in found)

        def filled(match: re.Match[str]) -> str:
            return values.get((match["quoted"] or match["plain"]).lower(), match.group())

        body = "\n".join(line for line in macro.text.splitlines() if not line.lstrip().startswith("!"))
        self._nested(_PARAMETER.sub(filled, body), command.line)
        return True

    def _handed(self, value: Value) -> str:
        """Return a value as a macro gets it: as it stood in the command, with what is in EVAL evaluated."""
        if value.kind == EXPRESSION and "eval" in value.text.lower():
            return self.values.called_with(value.text, value.line)
        return _written(value)


def _same_name(one: str, other: str) -> bool:
    """Return whether two names are of the same object at the root, with or without its point."""
    return one.lower().lstrip(".") == other.lower().lstrip(".")


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
