"""A command script (.acf): simulations and the changes between them, typed and checked."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path, PureWindowsPath

from gearmbs.adams.errors import ERROR, IGNORED, UNSUPPORTED, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.files import LONGEST_NAME, named_file
from gearmbs.adams.parse.grammar import (
    CHOICE,
    CONTINUED,
    FLAG,
    ID,
    IDS,
    INT,
    PATH,
    REAL,
    TEXT,
    ArgumentReader,
    RawStatement,
    StatementError,
    arg,
    grammar_of,
)
from gearmbs.adams.parse.reader import (
    read_file,
    read_statement,
    refuse_view,
    resolve_statement,
    statements,
    unknown_statement,
)
from gearmbs.wording import did_you_mean

_HEAD = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_]*)\s*(/)?\s*(?:(\d{1,18})(?![\dA-Za-z_.]))?\s*")
SIMULATIONS = "DYNAMICS KINEMATICS STATICS TRANSIENT INITIAL_CONDITIONS ACCELERATION DISPLACEMENT VELOCITY"
ELEMENTS = " ".join(st.switched("acts"))
LEFT_ON = " ".join(st.switched("on"))
"""What ADAMS can switch, too, and stays on here."""
NOT_MODELLED = " ".join(st.switched(""))
"""What ADAMS can switch and is not there: to switch it changes nothing."""
DEEPEST = 10
"""Command files that may call each other."""


@dataclass(frozen=True)
class Command:
    """What all commands have: place in the script and, as it stands there, text."""

    file: str = ""
    line: int = 0
    given: dict[str, int] = field(default_factory=dict, compare=False)
    text: str = field(default="", compare=False, kw_only=True)


@dataclass(frozen=True)
class Simulate(Command):
    """SIMULATE: one analysis; times in the deck's unit."""

    kind: str | None = arg("kind", CHOICE, choices=SIMULATIONS)
    end: float | None = arg("END", REAL, dimension="time")
    duration: float | None = arg("DURATION", REAL, dimension="time")
    dtout: float | None = arg("DTOUT", REAL, dimension="time")
    steps: int | None = arg("STEPS", INT)
    until_equilibrium: bool = arg("UNTIL_EQUILIBRIUM", FLAG, False)


@dataclass(frozen=True)
class Switch(Command):
    """ACTIVATE or DEACTIVATE of an element, or of all of a kind whose ids lie in a range."""

    element: str | None = arg("element", CHOICE, choices=f"{ELEMENTS} {LEFT_ON} {NOT_MODELLED}")
    id: int | None = arg("ID", ID)
    range: tuple[int, ...] = arg("RANGE", IDS, (), count=2)
    on: bool = True


@dataclass(frozen=True)
class FileCommand(Command):
    """FILE: the model to read and the prefix of the output files."""

    model: str | None = arg("MODEL", PATH)
    output_prefix: str | None = arg("OUTPUT_PREFIX", PATH)
    command: str | None = arg("COMMAND", PATH)
    users: bool = arg("USERS", FLAG, False)


@dataclass(frozen=True)
class Linear(Command):
    """LINEAR/EIGENSOL or STATEMAT: eigenvalues, or the plant from PINPUT to POUTPUT, at the present configuration."""

    eigensol: bool = arg("EIGENSOL", FLAG, False)
    statemat: bool = arg("STATEMAT", FLAG, False)
    novector: bool = arg("NOVECTOR", FLAG, False)
    coordinates: str | None = arg("COORDS", TEXT)
    pinput: int | None = arg("PINPUT", ID)
    poutput: int | None = arg("POUTPUT", ID)
    data_file: str | None = arg("FILE", PATH)
    original: bool = arg("ORIGINAL", FLAG, False)
    form: str | None = arg("format", CHOICE, choices="MATLAB MATRIXX FSAVE")


@dataclass(frozen=True)
class Change(Command):
    """New arguments of a statement of the deck; ``statement`` holds only what was given."""

    statement: st.Statement | None = None


@dataclass(frozen=True)
class Stop(Command):
    """STOP: the end of the script."""


COMMANDS: dict[str, type[Command]] = {
    "SIMULATE": Simulate,
    "ACTIVATE": Switch,
    "DEACTIVATE": Switch,
    "FILE": FileCommand,
    "LINEAR": Linear,
    "STOP": Stop,
}
CHANGEABLE = tuple(sorted(name for name, cls in st.STATEMENTS.items() if cls.changeable))
FIXED = tuple(sorted(name for name, cls in st.STATEMENTS.items() if not cls.changeable))
"""Statements without a command."""
IGNORED_COMMANDS = ("PREFERENCES", "HELP", "INFO", "MENU", "SHOW", "TIME", "DEBUG", "ENVIRONMENT", "LSOLVER")
UNSUPPORTED_COMMANDS = ("SAVE", "RELOAD", "CONTROL", "FLEX_BODY")
_NAMES = (*COMMANDS, *CHANGEABLE, *IGNORED_COMMANDS, *UNSUPPORTED_COMMANDS)


@dataclass
class Script:
    """The content of an .acf file.

    Attributes
    ----------
    model : str
        Name of the deck in the first line or in FILE, "" when there is none.
    prefix : str
        Name of the output files, relative to the folder of the deck.
    prefix_line : int
        Where the script gives it.
    commands : list of Command
    diagnostics : list of Diagnostic
    """

    model: str = ""
    prefix: str = ""
    prefix_line: int = 0
    file: str = "<script>"
    commands: list[Command] = field(default_factory=list)
    diagnostics: list[Diagnostic] = field(default_factory=list)

    def __iter__(self) -> Iterator[Command]:
        return iter(self.commands)

    def output(self, model: str | Path) -> Path:
        """Return the prefix of the output files: the script's own in the model's folder, else the model's name.

        Raises
        ------
        DeckError
            If the script's own is not inside that folder: a file from elsewhere is not to choose what it overwrites.
        """
        model = Path(model)
        if not self.prefix:
            return model.with_suffix("")
        path = model.parent / self.prefix.replace("\\", "/")
        if PureWindowsPath(self.prefix).drive or model.parent.resolve() not in path.resolve().parents:
            message = (
                f"results would go to {self.prefix[:LONGEST_NAME]!r}, which is not in the folder of {model.name}; if "
                f"that is meant, say so with --out {self.prefix[:LONGEST_NAME]}"
            )
            raise DeckError([Diagnostic(ERROR, message, self.file, self.prefix_line)])
        return path

    @property
    def unsupported(self) -> list[Diagnostic]:
        """Commands that change the result and are not carried out."""
        return [d for d in self.diagnostics if d.severity == UNSUPPORTED]


def read_script(path: str | Path) -> Script:
    """Read an .acf file.

    Raises
    ------
    DeckError
        Naming file and line of everything that is wrong.
    """
    return parse_script(read_file(Path(path)), str(path))


def parse_script(text: str, file: str = "<script>", depth: int = 0) -> Script:
    """Parse the text of an .acf file.

    The first lines may hold the name of the deck and the prefix of the output files. The commands of a file named by
    FILE/COMMAND, which is looked for beside this one, take that command's place.

    Raises
    ------
    DeckError
        Naming the line of everything that is wrong.
    """
    refuse_view(text, file)
    script = Script(file=file)
    errors: list[Diagnostic] = []
    lines = re.split(r"\r\n|\r|\n", text)
    skip = 0
    for line in lines[:2]:
        body = line.partition("!")[0].strip()
        if _is_command(body):
            break
        if body and skip == 0:
            script.model = body
        elif body:
            script.prefix, script.prefix_line = body, 2
        skip += 1
    for raw in statements(text, skip=skip):
        command = _read(script, raw, errors)
        if command is not None:
            script.commands.append(command)
            if isinstance(command, FileCommand):
                if command.users:
                    message = "FILE: USERS has no effect here: there are no compiled subroutines to load"
                    script.diagnostics.append(Diagnostic(IGNORED, message, script.file, command.line))
                script.model = command.model or script.model
                if command.output_prefix:
                    script.prefix, script.prefix_line = command.output_prefix, command.line
                if command.command is not None:
                    _include(script, command, errors, depth)
            if any(isinstance(c, Stop) for c in script.commands[-1:]):
                break
    if errors:
        raise DeckError(errors)
    return script


def _include(script: Script, command: FileCommand, errors: list[Diagnostic], depth: int) -> None:
    """Append the commands of another file."""
    name = command.command or ""
    path = Path(script.file)
    try:
        path = named_file("COMMAND", name if Path(name).suffix else f"{name}.acf", path)
        if depth >= DEEPEST:
            raise DeckError([Diagnostic(ERROR, f"files call each other more than {DEEPEST} deep", script.file, 0)])
        if not path.is_file():
            raise DeckError([Diagnostic(ERROR, "there is no such file", script.file, 0)])
        other = parse_script(read_file(path), str(path), depth + 1)
    except (DeckError, ValueError, OSError) as error:
        places = error.diagnostics if isinstance(error, DeckError) else ()
        inner = [d for d in places if d.file == str(path)]
        message = f"FILE: COMMAND = {name[:LONGEST_NAME]}: {places[0].message if places else error}"
        errors.extend(inner or [Diagnostic(ERROR, message, script.file, command.line)])
        return
    script.commands.extend(other.commands)
    script.diagnostics.extend(other.diagnostics)
    script.model = script.model or other.model


def _is_command(body: str) -> bool:
    match = _HEAD.match(body)
    if match is None:
        return False
    if match.group(2) is None:
        return body.upper() in ("STOP", "HELP", "TIME")
    return resolve_statement(match.group(1), _NAMES) is not None


def _read(script: Script, raw: RawStatement, errors: list[Diagnostic]) -> Command | None:
    """Read one command; report what is wrong with it."""

    def fail(message: str, line: int) -> None:
        errors.append(Diagnostic(ERROR, message, script.file, line))

    match = _HEAD.match(raw.text)
    if match is None:
        fail(f"expected a command such as SIMULATE/DYNAMICS, found {raw.text.strip()[:40]!r}", raw.line)
        return None
    name = resolve_statement(match.group(1), _NAMES)
    deck_only = resolve_statement(match.group(1), FIXED)
    if name is None and deck_only is not None:
        fail(f"{deck_only} is a statement of the deck (.adm), no command of a script; put it there", raw.line)
        return None
    if name is None:
        meant = did_you_mean(match.group(1).upper()[:40], _NAMES, before="unknown command; ")
        fail(meant or unknown_statement(match.group(1), _NAMES), raw.line)
        return None
    if name in IGNORED_COMMANDS:
        script.diagnostics.append(Diagnostic(IGNORED, f"{name} has no effect here", script.file, raw.line))
        return None
    if name in UNSUPPORTED_COMMANDS:
        script.diagnostics.append(Diagnostic(UNSUPPORTED, f"{name} is not supported", script.file, raw.line))
        return None
    try:
        return _typed(name, match, raw, script)
    except StatementError as error:
        fail(f"{name}: {error}", raw.line_at(error.offset))
        return None


def _typed(name: str, match: re.Match[str], raw: RawStatement, script: Script) -> Command | None:
    file, line = script.file, raw.line
    text = " ".join(raw.text.replace(CONTINUED, ",").split())
    if name == "STOP":
        return Stop(file, line, text=text)
    number = int(match.group(3)) if match.group(3) else 0
    if name in st.STATEMENTS:
        statement = read_statement(name, number, raw, match.end(), script.file)
        if not statement.given:
            raise StatementError("no argument is given")
        return Change(file, line, statement.given, statement=statement, text=text)
    if match.group(2) is None:
        raise StatementError(f"a slash is missing; write {name}/")
    if number:
        raise StatementError(f"{name} has no id")
    cls = COMMANDS[name]
    reader = ArgumentReader(raw, match.end(), grammar_of(cls))
    values = reader.read()
    if name == "DEACTIVATE":
        values["on"] = False
    if values.get("element") in LEFT_ON.split():
        severity, why = UNSUPPORTED, "is not supported; it stays as it is"
        if values["element"] == "REQUEST":
            severity, why = IGNORED, "has no effect here: requests are always written"
        script.diagnostics.append(Diagnostic(severity, f"{name} of {values['element']} {why}", file, line))
        return None
    command = cls(file, line, reader.lines, text=text, **values)
    _check(command)
    return command


def _check(command: Command) -> None:
    """Check that a command says all it needs to.

    Raises
    ------
    StatementError
    """
    if isinstance(command, Switch):
        if command.element is None or (
            command.id is None and not command.range and command.element not in st.WITHOUT_ID
        ):
            message = "give an element and its id or a range of ids, for instance DEACTIVATE/JOINT, ID=3"
            raise StatementError(message)
        if command.id is not None and command.range:
            raise StatementError("give ID or RANGE, not both")
        if command.range and command.range[0] > command.range[1]:
            raise StatementError(f"RANGE = {command.range[0]}, {command.range[1]}; the first must not be larger")
    if not isinstance(command, Simulate):
        return
    if command.kind is None:
        raise StatementError(f"give one of {', '.join(SIMULATIONS.split())}")
    if command.end is not None and command.duration is not None:
        raise StatementError("give END or DURATION, not both")
    if command.steps is not None and command.dtout is not None:
        raise StatementError("give STEPS or DTOUT, not both")
    if command.kind in ("DYNAMICS", "KINEMATICS", "TRANSIENT"):
        if command.end is None and command.duration is None:
            raise StatementError("give END or DURATION")
        if command.steps is None and command.dtout is None:
            raise StatementError("give STEPS or DTOUT")
    for key in ("duration", "dtout", "steps"):
        value = getattr(command, key)
        if value is not None and not value > 0:
            raise StatementError(f"{key.upper()} = {value}; it must be positive")


def apply_change(old: st.Statement, change: st.Statement) -> st.Statement:
    """Return a statement of the deck with the arguments of a command put in."""
    return replace(old, **{name: getattr(change, name) for name in change.given})
