"""Read a command file of View: ``read_view``, ``parse_view``; its deck, its simulations and its variables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gearmbs.adams.errors import ERROR, IGNORED, UNSUPPORTED, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse.commands import Script
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.reader import COMMANDS_OF_VIEW, deck_of, is_deck, is_script, read_file
from gearmbs.adams.view import data, factors, forces, instances, machinery, measures, statements, tires
from gearmbs.adams.view.deckmaker import PART_KEYWORDS, Deckmaker, Made
from gearmbs.adams.view.interpreter import Interpreter
from gearmbs.adams.view.model import PARTS, Item
from gearmbs.adams.view.simulations.changes import same
from gearmbs.adams.view.simulations.runs import Analysis, Simulator, named
from gearmbs.adams.write.view_files import texts_of, write_new


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
        Its simulations by name: its scripts, each from the model as the file leaves it, and then what it runs itself,
        each from the model as it was then: under the name that it was saved under, else Run_1, Run_2 and so on, and
        Last_Run for the last.
    variables : dict of str to float
        Its design variables with one number each: what ``variables`` of `read_view` may change.
    name : str
    own : tuple of str
        Names of what the file runs itself, in order: each starts from the design.
    refused : dict of str to list of Diagnostic
        Scripts that cannot be carried out and that the file does not run itself, and why.
    models : dict of str to tuple of (Deck, str)
        Deck and text of those simulations whose model is another than that of ``deck``, which is the one that the file
        leaves.
    left_out : dict of str to tuple of Diagnostic
        What the command file holds and the deck of such a simulation lacks, as no statement could be made of it; under
        "" what ``deck`` lacks.
    """

    deck: Deck
    text: str
    scripts: dict[str, Script] = field(default_factory=dict)
    variables: dict[str, float] = field(default_factory=dict)
    name: str = ""
    own: tuple[str, ...] = ()
    refused: dict[str, list[Diagnostic]] = field(default_factory=dict)
    models: dict[str, tuple[Deck, str]] = field(default_factory=dict)
    left_out: dict[str, tuple[Diagnostic, ...]] = field(default_factory=dict)

    def deck_for(self, script: Script | None) -> Deck:
        """Return the deck of one of the simulations: the model as it was then; that of ``deck`` of other scripts."""
        name = next((name for name, one in self.scripts.items() if one is script), "")
        return self.models[name][0] if name in self.models else self.deck

    def save(self, path: str | Path, *, allow_unsupported: bool = False, overwrite: bool = False) -> list[Path]:
        """Write the deck, and its simulations beside it as NAME.acf; return the files.

        A simulation whose model is another, since commands between changed it, has its own deck beside its script.

        Parameters
        ----------
        path : str or Path
            Of the deck (.adm).
        allow_unsupported : bool
            Write it without what could not be made a statement, which comments at its top then name, instead of
            refusing.
        overwrite : bool
            Replace files that were not written by this method, or have been changed since. The command file itself is
            never replaced.

        Raises
        ------
        DeckError
            Naming what the deck would lack, or the files that would be lost; nothing is written then.
        """
        lacking = tuple(dict.fromkeys(one for decks in self.left_out.values() for one in decks))
        if lacking and not allow_unsupported:
            raise DeckError(lacking)
        models = {name: text for name, (_, text) in self.models.items()}
        texts = texts_of(Path(path), self.text, self.scripts, models, self.left_out)
        return write_new(texts, self.deck.file, overwrite)

    @property
    def script(self) -> Script | None:
        """The simulation to run when none is named: the last that the file runs itself, else the last that it holds.

        Raises
        ------
        DeckError
            If it holds only what cannot be carried out.
        """
        if not self.scripts and self.refused:
            raise DeckError(next(reversed(self.refused.values())))
        return next(reversed(self.scripts.values()), None)


def read_view(path: str | Path, variables: Mapping[str, float] | None = None, model: str | None = None) -> ViewModel:
    """Read a command file of View (.cmd).

    Parameters
    ----------
    path : str or Path
    variables : mapping of str to float, optional
        Values of design variables instead of those in the file, by full names or their ends.
    model : str, optional
        Which model becomes the deck, where the file makes several, and whose simulations are read; default: the model
        of the last simulation of the file, else its default model, else the last with a part.

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
    given = factors.checked(variables, file)

    def asked_for(one: Item) -> bool:
        return model is None or one.name.lower() == model.lower().lstrip(".")

    def made(run: Interpreter, one: Item) -> Deckmaker:
        return _made(run, one, file)

    run = Simulator(made, file, folder, given, asked_for)
    run.run(text)
    _raise(run, file)
    missing = [name for name in run.overrides if name not in run.overridden]
    wrong = [f"there is no variable {name}" for name in missing]
    for name, paths in run.overridden.items():
        if len(paths) > 1 and not missing:
            which = " and ".join(sorted(paths))
            wrong.append(f"variables: {name} may be {which}; give the full name of one")
    models = [one for one in run.database.of("model") if asked_for(one)]
    chosen = run.default_model() if model is None else next(iter(models), None)
    if model is None and run.analyses:
        chosen = run.analyses[-1].model
    if chosen is None and not wrong:
        there = ", ".join(one.name for one in run.database.of("model"))
        message = f"there is no model {str(model)[:60]}; there is {there}"
        wrong.append(message if there else "no model is created; write 'model create model_name = ...'")
    if wrong or chosen is None:
        raise DeckError([Diagnostic(ERROR, message, file, 0) for message in wrong])

    # scripts that change the model start from it as the file leaves it, each for itself
    def again(path: str) -> tuple[list[Analysis], list[Diagnostic]]:
        return _read_again(text, Simulator(made, file, folder, given, asked_for, quiet=True), path)

    scripts, refused = _of_scripts(run, chosen, again)
    own = named(run.analyses, [*scripts, *refused])
    maker = run.made(chosen)
    deck, written = _deck(maker.statements, maker.problems, chosen, run, file)
    deck.diagnostics += factors.outside(run, file)
    for name, wrong_there in refused.items():
        said = f"{wrong_there[0].message}; it is left out of what can be run ({name})"
        deck.diagnostics.append(Diagnostic(WARNING, said, file, wrong_there[0].line))
    values, valueless = factors.listed(run, file)
    deck.diagnostics += valueless
    view = ViewModel(deck, written, variables=values, name=chosen.name, own=tuple(own), refused=refused)
    view.left_out[""] = _lacking(maker.problems)
    for name, analysis in (scripts | own).items():
        view.scripts[name] = analysis.script(file)
        if analysis.model.path != chosen.path or not same(analysis.statements, maker.statements):
            view.models[name] = _deck(analysis.statements, analysis.problems, analysis.model, run, file)
            view.left_out[name] = _lacking(analysis.problems)
    return view


def _raise(run: Interpreter, file: str) -> None:
    """Raise what is wrong with commands, if anything is."""
    if run.errors:
        raise DeckError([Diagnostic(ERROR, str(error), file, max(error.line, 0)) for error in run.errors])


def _read_again(text: str, run: Simulator, path: str) -> tuple[list[Analysis], list[Diagnostic]]:
    """Return the analyses of a script that changes the model, which the file is read again for, and what is wrong."""
    run.run(text)
    run.quiet = False
    item = run.database.items.get(path.lower())
    return run.aside(item) if item is not None else ([], [])


def _of_scripts(
    run: Simulator, model: Item, again: Callable[[str], tuple[list[Analysis], list[Diagnostic]]]
) -> tuple[dict[str, Analysis], dict[str, list[Diagnostic]]]:
    """Return what the scripts of a model do, by their names, each from the design on; and why some do not."""
    found: dict[str, Analysis] = {}
    refused: dict[str, list[Diagnostic]] = {}
    for item in run.database.of("script"):
        if run.database.model_of(item) is not model:
            continue
        analyses, wrong = run.aside(item) if run.only_simulates(item) else again(item.path)
        refused.pop(item.name, None)
        if wrong:
            refused[item.name] = wrong
            continue
        for k, one in enumerate(analyses, 1):
            if one.commands:
                found[item.name if k == len(analyses) else f"{item.name}_{k}"] = one
    return found, refused


def _deck(
    made: Sequence[Made], problems: Sequence[Diagnostic], model: Item, run: Interpreter, file: str
) -> tuple[Deck, str]:
    """Return the deck of a model's statements, and its text."""
    title = f"ADAMS/View model name: {model.name}"
    deck = deck_of([one.raw() for one in made], title, file)
    deck.diagnostics += problems
    if run.ignored:
        what = ", ".join(f"{word} {len(lines)}" for word, lines in sorted(run.ignored.items()))
        first = min(min(lines) for lines in run.ignored.values())
        deck.diagnostics.append(Diagnostic(IGNORED, f"commands without effect on the motion: {what}", file, first))
    lines = [title, "!", *(line for one in made for line in one.lines()), "END"]
    return deck, "\n".join(lines) + "\n"


def _lacking(problems: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    return tuple(one for one in problems if one.severity == UNSUPPORTED)


def _made(run: Interpreter, model: Item, file: str) -> Deckmaker:
    """Return a model's statements, and what is left out with all that needs it; the model stays as it is."""
    db = run.database
    before = set(db.items)
    fields = [(part, dict(part.fields)) for part in db.of(*PARTS)]
    machinery.weigh(db, run.values)
    tires.weigh(db, run.values)
    maker = Deckmaker(run.values, model, file, measures.variable_of, run.parasolids, run.folder)
    count = -1
    while len(maker.failed) > count:
        count = len(maker.failed)
        maker.start_again()
        _statements(maker)
    for part, held in fields:
        part.fields = held
    for key in [key for key in db.items if key not in before]:
        db.remove(db.items[key])
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
