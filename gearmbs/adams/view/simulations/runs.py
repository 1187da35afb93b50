"""Carries out the simulations of a command file, each with the model as it is when its command comes.

What runs without a reset between is one analysis in parts: the model keeps its time and its state, and what has changed
in it becomes commands of the solver. After ``simulation single_run reset`` the next simulation starts from the design
again, with its own deck.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse.commands import Change, Command, Script, Stop, parse_script
from gearmbs.adams.view.deckmaker import KEYWORDS, Deckmaker, Made
from gearmbs.adams.view.expressions import text_of
from gearmbs.adams.view.interpreter import Interpreter
from gearmbs.adams.view.lexer import ViewError, commands
from gearmbs.adams.view.model import Item
from gearmbs.adams.view.simulations.changes import ChangeError, Course
from gearmbs.adams.view.values import Stored
from gearmbs.adams.view.vocabulary import Row, resolve
from gearmbs.adams.write.text import number

YES = ("yes", "on", "true", "1")
NO = ("no", "off", "false", "0")
ANALYSES = {
    "auto_select": "DYNAMICS",
    "dynamic": "DYNAMICS",
    "kinematic": "KINEMATICS",
    "static": "STATICS",
    "quasi_static": "STATICS",
    "initial_conditions": "INITIAL_CONDITIONS",
}
"""SIMULATE by the type of a simulation: dynamics do for mechanisms without freedom, too, as auto_select chooses."""
SINGLE = {"equilibrium": "SIMULATE/STATICS", "assemble": "SIMULATE/INITIAL_CONDITIONS"}
SCRIPTS = (
    ("solver_commands",),
    ("commands",),
    ("type", "initial_static", "number_of_steps", "step_size", "end_time", "duration"),
)
"""What a script holds: commands of the solver, of View, or one simulation."""
LAST = "Last_Run"
"""What View calls the analysis of the last simulation."""


@dataclass
class Analysis:
    """Simulations that go on from each other, from the design on.

    Attributes
    ----------
    model : Item
    course : Course
        Their statements.
    problems : list of Diagnostic
        What is not modelled at any of them.
    commands : list of Command
        Of the solver, at the lines of the simulations.
    remarks : list of Diagnostic
        On the commands.
    line : int
        Of the first simulation.
    name : str
        Under which it was saved, "" if it was not.
    """

    model: Item
    course: Course
    problems: list[Diagnostic]
    line: int
    commands: list[Command] = field(default_factory=list)
    remarks: list[Diagnostic] = field(default_factory=list)
    name: str = ""

    @property
    def statements(self) -> tuple[Made, ...]:
        """Those of the deck."""
        return tuple(self.course.statements.values())

    def script(self, file: str) -> Script:
        """Return the commands as a script."""
        before = parse_script("\n".join(self.course.before), file).commands
        return Script(
            file=file,
            commands=[*(replace(one, line=self.line) for one in before), *self.commands],
            diagnostics=list(self.remarks),
        )


class Simulator(Interpreter):
    """Carries out commands, simulations among them.

    Parameters
    ----------
    make : callable
        Makes the statements of a model as it is: of an interpreter and the model.
    file : str
    folder, variables
        As of `Interpreter`.
    only : callable, optional
        Which models are simulated; default: all.
    quiet : bool
        Whether simulations are left out for now.

    Attributes
    ----------
    analyses : list of Analysis
        In the order in which they began.
    """

    def __init__(
        self,
        make: Callable[[Interpreter, Item], Deckmaker],
        file: str,
        folder: Path | None = None,
        variables: Mapping[str, float] | None = None,
        only: Callable[[Item], bool] = lambda model: True,
        quiet: bool = False,
    ) -> None:
        super().__init__(folder, variables)
        self.make, self.file, self.only, self.quiet = make, file, only, quiet
        self.analyses: list[Analysis] = []
        self._open: dict[int, Analysis] = {}
        self._last: Analysis | None = None
        self._makers: dict[int, tuple[int, Deckmaker]] = {}

    def made(self, model: Item) -> Deckmaker:
        """Return the statements of a model as it is now."""
        known = self._makers.get(id(model))
        if known is None or known[0] != self.database.version:
            maker = self.make(self, model)
            self._makers[id(model)] = known = self.database.version, maker
        return known[1]

    def default_model(self) -> Item | None:
        """Return the default model, or the model that it is in; where it has no parts, the last one that has some."""
        models = [one for one in self.database.of("model") if one.path.count(".") == 1]
        full = [one for one in models if self._has_parts(one)]
        chosen = self.database.model
        while chosen is not None and chosen.path.count(".") > 1:
            chosen = self.database.items.get(chosen.parent.lower())
        if chosen is not None and (any(chosen is one for one in full) or not full):
            return chosen
        return full[-1] if full else None

    def _has_parts(self, model: Item) -> bool:
        inside = model.path.lower() + "."
        return any(part.path.lower().startswith(inside) for part in self.parts())

    def aside(self, item: Item) -> tuple[list[Analysis], list[Diagnostic]]:
        """Return the analyses of a script from the design on, and what is wrong with it; those of the file stay."""
        before, self._open, self._last = (self.analyses, self._open, self._last), {}, None
        self.analyses = []
        errors = len(self.errors)
        self.at = item.line
        wrong: list[Diagnostic] = []
        try:
            self._script(item, item.line)
        except ViewError as error:
            self.errors.append(error)
        except DeckError as error:
            wrong += error.diagnostics
        found = self.analyses
        self.analyses, self._open, self._last = before
        for one in self.errors[errors:]:
            wrong.append(Diagnostic(ERROR, f"in the simulation {item.path}: {one}", self.file, item.line))
        del self.errors[errors:]
        return found, list(dict.fromkeys(wrong))

    def only_simulates(self, item: Item) -> bool:
        """Return whether a script changes nothing of the model, and so is carried out without another reading."""
        if "commands" not in item.fields:
            return True
        for command in commands(self._lines(item, "commands")):
            row = None if isinstance(command, ViewError) else _row(command.words, command.line)
            if row is None or row.words[:2] != ("simulation", "single_run") or row.words[-1] == "scripted":
                return False
        return True

    # Commands.

    def _object(self, row: Row, given: dict[str, Stored], line: int) -> None:
        """Make or change an object; a script is what it was given last: commands of one kind, or one simulation."""
        kinds = [kind for kind in SCRIPTS if set(kind) & given.keys()] if row.kind == "script" else []
        if len(kinds) > 1:
            what = " and ".join(next(key for key in kind if key in given) for kind in kinds)
            raise ViewError(f"{' '.join(row.words)}: {what} exclude each other; give one", line)
        if kinds and row.verb == "modify":
            item = self._of_name(row, self._name(row, given, line), line)
            for key in [key for kind in SCRIPTS if kind is not kinds[0] for key in kind]:
                item.fields.pop(key, None)
        super()._object(row, given, line)

    def _simulation(self, row: Row, given: dict[str, Any], line: int) -> None:
        line = self.at or line
        word = row.words[-1]
        values = {key: value[0] for key, value in given.items() if value}
        if word == "reset":
            self._reset(None if "model_name" not in values else self._model(values, line))
        elif word == "save":
            if not self.quiet:
                self._save(values, line)
        elif word == "scripted":
            self._scripted(values, line)
        else:
            self._step(self._model(values, line), _simulated(word, values, line), line)

    def _model(self, values: Mapping[str, Any], line: int) -> Item:
        """Return the model that a simulation names, else the default model.

        Raises
        ------
        ViewError
            If there is none.
        """
        if "model_name" in values:
            given = values["model_name"]
            return given if isinstance(given, Item) else self._model_named(text_of(given), line)
        found = self.default_model()
        if found is None:
            raise ViewError("there is no model to simulate; create one before, with its parts", line)
        return found

    def _reset(self, model: Item | None) -> None:
        """Bring one or all models back to their design."""
        for key in [key for key in self._open if model is None or key == id(model)]:
            del self._open[key]

    def _save(self, values: Mapping[str, Any], line: int) -> None:
        """Keep the last analysis, as it is, under a name."""
        name = text_of(values.get("analysis_name", "")).rsplit(".", 1)[-1]
        if not name:
            raise ViewError("simulation single_run save needs analysis_name", line)
        if self._last is None:
            raise ViewError(f"there is no analysis to save as {name[:60]}: nothing was simulated before", line)
        if any(one.name.lower() == name.lower() for one in self.analyses):
            raise ViewError(f"there is an analysis {name[:60]} already; give another name", line)
        last = self._last
        if not last.name:
            last.name = name
            return
        # what was saved before under another name stays
        again = replace(last, commands=list(last.commands), remarks=list(last.remarks), name=name)
        self.analyses.append(again)

    def _scripted(self, values: Mapping[str, Any], line: int) -> None:
        name = values.get("sim_script_name", "")
        item = name if isinstance(name, Item) else self.database.find(text_of(name), ("script",))
        if item is None or item.kind != "script":
            raise ViewError(f"simulation single_run scripted: there is no script {text_of(name)[:60]}", line)
        model = self.database.model_of(item)
        if "model_name" in values and self._model(values, line) is not model and model is not None:
            raise ViewError(f"the script {item.path} is of another model than {text_of(values['model_name'])}", line)
        alone = _said(values, "reset_before_and_after", line)
        if alone:
            self._reset(None)
        self._script(item, line)
        if alone:
            self._reset(None)

    def _script(self, item: Item, line: int) -> None:
        """Carry out a script: commands of the solver, or of View, or one simulation."""
        model = self.database.model_of(item) or self._model({}, line)
        if "solver_commands" in item.fields:
            self._step(model, self._lines(item, "solver_commands"), line)
        elif "commands" in item.fields:
            self._nested(self._lines(item, "commands"), line)
        else:
            given = {key: self.values.values(item, key)[0] for key in item.fields if key != "adams_id"}
            self._step(model, _simulated("transient", given, line), line)

    def _lines(self, item: Item, key: str) -> str:
        return "\n".join(text_of(one) for one in self.values.values(item, key))

    def _step(self, model: Item, text: str, line: int) -> None:
        """Go on with a model: what has changed in it, and then commands of the solver."""
        if self.quiet or not self.only(model):
            return
        maker = self.made(model)
        analysis = self._open.get(id(model))
        if analysis is not None and analysis.name:
            # what was saved stays as it was then
            analysis = replace(analysis, commands=list(analysis.commands), remarks=list(analysis.remarks), name="")
            self.analyses.append(analysis)
        if analysis is None:
            there = {f"{KEYWORDS[one.kind]}/{maker.ids[id(one)]}" for one in maker.items if id(one) in maker.ids}
            course = Course(maker.statements, {*there, "ACCGRAV/"})
            analysis = Analysis(model, course, list(maker.problems), line)
            self.analyses.append(analysis)
        else:
            try:
                between = analysis.course.changed(maker.statements)
            except ChangeError as error:
                raise ViewError(str(error), line) from error
            analysis.problems += [one for one in maker.problems if one not in analysis.problems]
            self._add(analysis, "\n".join(between), line)
        self._open[id(model)] = self._last = analysis
        self._add(analysis, text, line)

    def _add(self, analysis: Analysis, text: str, line: int) -> None:
        """Add commands of the solver to an analysis."""
        script = _parsed(text, self.file, line)
        analysis.commands += script.commands
        analysis.remarks += script.diagnostics


def _row(words: tuple[str, ...], line: int) -> Row | None:
    try:
        return resolve(words, line)
    except ViewError:
        return None


def _said(values: Mapping[str, Any], key: str, line: int) -> bool:
    """Return whether an argument says yes.

    Raises
    ------
    ViewError
        If it is neither yes nor no.
    """
    word = text_of(values.get(key, "no")).lower()
    if word not in (*YES, *NO):
        raise ViewError(f"{key} = {word[:40]}; give yes or no", line)
    return word in YES


def _simulated(kind: str, given: Mapping[str, Any], line: int) -> str:
    """Return a simulation as commands of the solver.

    Raises
    ------
    ViewError
        If its type is unknown, or its end is not given.
    """
    if kind in SINGLE:
        return SINGLE[kind]
    if kind == "eigensolution":
        return "LINEAR/EIGENSOL"
    word = text_of(given.get("type", "auto_select")).lower()
    found = [one for one in ANALYSES if one == word] or [one for one in ANALYSES if one.startswith(word) and word]
    if len(found) != 1:
        raise ViewError(f"type = {word[:40]} is no type of simulation; one of {', '.join(ANALYSES)}", line)
    if _said(given, "forever", line):
        raise ViewError("forever: a simulation without an end is not carried out; give end_time or duration", line)
    analysis = ANALYSES[found[0]]
    first = "SIMULATE/STATICS\n" if _said(given, "initial_static", line) else ""
    if analysis == "INITIAL_CONDITIONS":
        return f"{first}SIMULATE/{analysis}"
    if not {"end_time", "duration"} & given.keys():
        raise ViewError("the simulation has no end; give end_time or duration", line)
    words = [f"SIMULATE/{analysis}"]
    for key, keyword in (
        ("end_time", "END"),
        ("duration", "DURATION"),
        ("number_of_steps", "STEPS"),
        ("step_size", "DTOUT"),
    ):
        value = given.get(key)
        if value is None:
            continue
        if not isinstance(value, (int, float)):
            raise ViewError(f"{key} = {text_of(value)[:40]} is no number", line)
        if keyword == "STEPS" and value != int(value):
            raise ViewError(f"{key} = {value:g}; it is a whole number", line)
        words.append(f"{keyword}={number(int(value) if keyword == 'STEPS' else value)}")
    return first + ", ".join(words)


def _parsed(text: str, file: str, line: int) -> Script:
    """Return commands of the solver, all of them at the line of their simulation.

    Raises
    ------
    DeckError
    """
    if re.search(r"^\s*FILE\b", text, re.IGNORECASE | re.MULTILINE):
        message = "in the simulation: FILE reads and writes elsewhere; give the commands themselves"
        raise DeckError([Diagnostic(ERROR, message, file, line)])
    lines = [one for one in text.splitlines() if one.strip() and not one.lstrip().startswith("!")]
    try:
        script = parse_script("\n".join(lines), file)
    except DeckError as error:
        raise DeckError(
            [Diagnostic(d.severity, f"in the simulation: {d.message}", file, line) for d in error.diagnostics]
        ) from error
    # STOP ends these commands, not what the file goes on with
    script.commands = [_at(one, line) for one in script.commands if not isinstance(one, Stop)]
    script.diagnostics = [replace(one, line=line) for one in script.diagnostics]
    return script


def _at(command: Command, line: int) -> Command:
    given = dict.fromkeys(command.given, line)
    if isinstance(command, Change) and command.statement is not None:
        statement = replace(command.statement, given=dict.fromkeys(command.statement.given, line))
        return replace(command, line=line, given=given, statement=statement)
    return replace(command, line=line, given=given)


def named(analyses: Sequence[Analysis], taken: Sequence[str]) -> dict[str, Analysis]:
    """Return the analyses of a file by name: those they were saved under, Run_1 to Run_n, and Last_Run for the last.

    Parameters
    ----------
    analyses : sequence of Analysis
    taken : sequence of str
        Names of scripts, which no analysis gets.
    """
    used = {*(one.lower() for one in taken), *(one.name.lower() for one in analyses)}
    found: dict[str, Analysis] = {}
    for k, one in enumerate(analyses, 1):
        name = one.name or (LAST if k == len(analyses) else f"Run_{k}")
        while not one.name and name.lower() in used:
            name += "_"
        used.add(name.lower())
        found[name] = one
    return found
