"""Read a command file of View: ``read_view``, ``parse_view``; its deck, its simulations and its variables."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gearmbs.adams.errors import ERROR, IGNORED, UNSUPPORTED, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse.commands import Script, parse_script
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.reader import COMMANDS_OF_VIEW, deck_of, is_deck, is_script, read_file
from gearmbs.adams.view import data, forces, instances, machinery, measures, statements, tires
from gearmbs.adams.view.deckmaker import PART_KEYWORDS, Deckmaker, Made
from gearmbs.adams.view.expressions import text_of
from gearmbs.adams.view.interpreter import Interpreter
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item
from gearmbs.adams.write.text import number
from gearmbs.files import write_whole


@dataclass
class ViewModel:
    """What a command file holds.

    Attributes
    ----------
    deck : Deck
        Its model, as the statements of a deck.
    text : str
        These statements as they are written into an .adm file.
    scripts : dict of str to Script
        Its simulations by name, those that it runs itself under the numbers of their lines.
    variables : dict of str to float
        Its design variables with one number each: what ``variables`` of `read_view` may change.
    name : str
    """

    deck: Deck
    text: str
    scripts: dict[str, Script] = field(default_factory=dict)
    variables: dict[str, float] = field(default_factory=dict)
    name: str = ""

    def save(self, path: str | Path) -> list[Path]:
        """Write the deck, and its simulations beside it as NAME.acf; return the files.

        Parameters
        ----------
        path : str or Path
            Of the deck (.adm).
        """
        path = Path(path)
        written = [path]
        write_whole(path, self.text)
        for name, script in self.scripts.items():
            stem = re.sub(r"\W+", "_", name)
            written.append(path.with_name(f"{path.stem}_{stem}.acf"))
            lines = [path.stem, f"{path.stem}_{stem}", *(command.text for command in script), "STOP"]
            write_whole(written[-1], "\n".join(lines) + "\n")
        return written

    @property
    def script(self) -> Script | None:
        """The simulation to run when none is named: the last that the file runs itself, else the last that it holds."""
        return next(reversed(self.scripts.values()), None)


def read_view(path: str | Path, variables: Mapping[str, float] | None = None, model: str | None = None) -> ViewModel:
    """Read a command file of View (.cmd).

    Parameters
    ----------
    path : str or Path
    variables : mapping of str to float, optional
        Values of design variables instead of those in the file, by full names or their ends.
    model : str, optional
        Which model becomes the deck, where the file makes several; default: the last with a part.

    Returns
    -------
    ViewModel

    Raises
    ------
    DeckError
        Naming file and line of everything that cannot be carried out.
    """
    path = Path(path)
    return parse_view(read_file(path), str(path), variables, model, path.parent)


def parse_view(
    text: str,
    file: str = "<commands>",
    variables: Mapping[str, float] | None = None,
    model: str | None = None,
    folder: Path | None = None,
) -> ViewModel:
    """Carry out the commands of a text, as `read_view` does those of a file.

    Parameters
    ----------
    text, file : str
    variables, model
        As in `read_view`.
    folder : Path, optional
        Where files that are named may be; without it none is read.

    Raises
    ------
    DeckError
    """
    if not COMMANDS_OF_VIEW.search(text) and (is_deck(text) or is_script(text)):
        kind = "a deck (.adm); `read_deck` reads it" if is_deck(text) else "commands (.acf); `read_script` reads them"
        raise DeckError(
            [Diagnostic(ERROR, f"this is of the solver, not of View: {kind}, `run_deck` runs them", file, 1)]
        )
    run = Interpreter(folder, variables)
    run.run(text)
    errors = [Diagnostic(ERROR, str(error), file, max(error.line, 0)) for error in run.errors]
    missing = [name for name in run.overrides if name not in run.overridden]
    if missing and not errors:
        errors += [Diagnostic(ERROR, f"there is no variable {name}", file, 0) for name in missing]
    for name, paths in run.overridden.items():
        if len(paths) > 1 and not errors:
            which = " and ".join(sorted(paths))
            errors.append(Diagnostic(ERROR, f"variables: {name} may be {which}; give the full name of one", file, 0))
    chosen = _chosen(run, model)
    if chosen is None and not errors:
        errors.append(Diagnostic(ERROR, "no model is created; write 'model create model_name = ...'", file, 0))
    if errors:
        raise DeckError(errors)
    assert chosen is not None
    maker = _made(run, chosen, file)
    made = maker.statements
    title = f"ADAMS/View model name: {chosen.name}"
    deck = deck_of([one.raw() for one in made], title, file)
    deck.diagnostics += maker.problems
    if run.ignored:
        what = ", ".join(f"{word} {len(lines)}" for word, lines in sorted(run.ignored.items()))
        first = min(min(lines) for lines in run.ignored.values())
        deck.diagnostics.append(Diagnostic(IGNORED, f"commands without effect on the motion: {what}", file, first))
    lines = [title, "!", *(line for one in made for line in one.lines()), "END"]
    values = {}
    for item in run.database.of("variable"):
        value = run.values.variable(item) if item.line and "real_value" in item.fields else None
        if isinstance(value, (int, float)):
            values[item.path] = float(value)
    return ViewModel(deck, "\n".join(lines) + "\n", _scripts(run, chosen, file), values, chosen.name)


def _chosen(run: Interpreter, name: str | None) -> Item | None:
    models = run.database.of("model")
    if name is not None:
        return next((one for one in models if one.name.lower() == name.lower().lstrip(".")), None)
    top = [one for one in models if one.path.count(".") == 1]
    full = [one for one in top if any(part.path.lower().startswith(f"{one.path.lower()}.") for part in run.parts())]
    return next(reversed(full or top), None)


def _made(run: Interpreter, model: Item, file: str) -> Deckmaker:
    """Return a model's statements, and what is left out with all that needs it."""
    machinery.weigh(run.database, run.values)
    tires.weigh(run.database, run.values)
    maker = Deckmaker(run.values, model, file, measures.variable_of, run.parasolids, run.folder)
    before = -1
    while len(maker.failed) > before:
        before = len(maker.failed)
        maker.start_again()
        _statements(maker)
    return maker


def _statements(maker: Deckmaker) -> None:
    """Make all statements of a model, in the order of a deck."""
    names = maker.db.units.names
    units = tuple(f"{quantity.upper()} = {names[quantity]}" for quantity in ("force", "mass", "length", "time"))
    maker.statements.append(Made("UNITS/", units, "", maker.model.line))
    makers = statements.MAKERS | forces.MAKERS | data.MAKERS | instances.MAKERS
    maker.run(makers, PART_KEYWORDS)
    maker.run(makers, ("marker", "floating_marker"))
    maker.run(makers, [kind for kind in makers if kind not in (*PART_KEYWORDS, "marker", "floating_marker")])
    before, known = len(maker.problems), set(maker.failed)
    maker.run(data.REQUESTS | measures.MAKERS, (*data.REQUESTS, *measures.MAKERS))
    # results that are not made change nothing of the motion
    for k in range(before, len(maker.problems)):
        problem = maker.problems[k]
        severity = WARNING if problem.severity == UNSUPPORTED else problem.severity
        maker.problems[k] = Diagnostic(severity, f"{problem.message}; it is left out", problem.file, problem.line)
    for key in maker.failed.keys() - known:
        del maker.failed[key]


# Simulations.


def _scripts(run: Interpreter, model: Item, file: str) -> dict[str, Script]:
    """Return the simulations of a model by name."""
    found: dict[str, Script] = {}
    for item in run.database.of("script"):
        if run.database.model_of(item) is not model:
            continue
        try:
            lines = _script_lines(run, item)
        except ViewError as error:
            raise DeckError([Diagnostic(ERROR, str(error), file, error.line or item.line)]) from error
        if lines:
            found[item.name] = _script(lines, file, item.line)
    own: list[str] = []
    for row, given, line in run.runs:
        if row.words[-1] == "scripted":
            name = text_of((given.get("sim_script_name") or [""])[0]).rsplit(".", 1)[-1]
            held = next((key for key in found if key.lower() == name.lower()), None)
            if held is not None:
                found[held] = found.pop(held)
            continue
        own += _simulation(row.words[-1], {key: value[0] for key, value in given.items() if value}, line)
    if own:
        found["the file itself"] = _script(own, file, run.runs[-1][2])
    return found


def _script(lines: list[str], file: str, line: int) -> Script:
    if any(re.match(r"\s*FILE\b", one, re.IGNORECASE) for one in lines):
        message = "in the simulation: FILE reads and writes elsewhere; give the commands themselves"
        raise DeckError([Diagnostic(ERROR, message, file, line)])
    try:
        return parse_script("\n".join(lines), file)
    except DeckError as error:
        raise DeckError(
            [Diagnostic(d.severity, f"in the simulation: {d.message}", file, line) for d in error.diagnostics]
        ) from error


def _script_lines(run: Interpreter, item: Item) -> list[str]:
    values = run.values
    for key in ("solver_commands", "commands"):
        if key not in item.fields:
            continue
        pieces = [text_of(one) for one in values.values(item, key)]
        lines = [line for piece in pieces for line in piece.splitlines()]
        if key == "solver_commands":
            return [line for line in lines if line.strip() and not line.lstrip().startswith("!")]
        found: list[str] = []
        inner = Interpreter(None)
        inner.database.model, inner.values = run.database.model, values
        inner.database.items, inner.database.by_name = run.database.items, run.database.by_name
        inner.run("\n".join(lines))
        if inner.errors:
            raise ViewError(f"in the simulation {item.path}: {inner.errors[0]}", item.line)
        for row, arguments, line in inner.runs:
            if row.words[-1] == "scripted":
                other = run.database.find(text_of((arguments.get("sim_script_name") or [""])[0]), ("script",))
                found += _script_lines(run, other) if other is not None and other is not item else []
            found += _simulation(row.words[-1], {key: value[0] for key, value in arguments.items() if value}, line)
        return found
    given: dict[str, Any] = {key: values.values(item, key)[0] for key in item.fields if key != "adams_id"}
    return _simulation("transient", given, item.line)


def _simulation(kind: str, given: dict[str, Any], line: int) -> list[str]:
    """Return a simulation as commands of the solver."""
    if kind == "equilibrium":
        return ["SIMULATE/STATICS"]
    if kind == "assemble":
        return ["SIMULATE/INITIAL_CONDITIONS"]
    if kind == "eigensolution":
        return ["LINEAR/EIGENSOL"]
    if kind not in ("transient",) or not {"end_time", "duration"} & given.keys():
        return []
    word = text_of(given.get("type", "dynamic")).lower()
    analysis = {"kinematic": "KINEMATICS", "static": "STATICS", "quasi_static": "STATICS"}.get(word, "DYNAMICS")
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
            raise DeckError([Diagnostic(ERROR, f"{key} = {text_of(value)[:40]} is no number", "", line)])
        words.append(f"{keyword}={number(int(value) if keyword == 'STEPS' else value)}")
    first = ["SIMULATE/STATICS"] if text_of(given.get("initial_static", "no")).lower() in ("yes", "on", "true") else []
    return [*first, ", ".join(words)]
