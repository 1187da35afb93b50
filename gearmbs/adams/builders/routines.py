"""Routines of the user: USER(...) in the functions of a deck, bound to Python functions."""

from __future__ import annotations

import inspect
import runpy
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gearmbs.adams.builders.modal_loads import bind_mforce
from gearmbs.adams.builders.routine_calls import Caller, Routine, RoutineCall
from gearmbs.adams.builders.user_elements import bind_coupler, bind_curve, bind_field, bind_gse, gse_parts
from gearmbs.adams.errors import ERROR, UNSUPPORTED, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.refused import without_refused
from gearmbs.mechanism.expression_syntax import Call, Negative, Node, Number, parse

ROUTINES: dict[type, tuple[str, tuple[str, ...]]] = {
    st.Sforce: ("SFOSUB", ("function",)),
    st.Vforce: ("VFOSUB", ("fx", "fy", "fz")),
    st.Vtorque: ("VTOSUB", ("tx", "ty", "tz")),
    st.Gforce: ("GFOSUB", ("fx", "fy", "fz", "tx", "ty", "tz")),
    st.Motion: ("MOTSUB", ("function",)),
    st.Variable: ("VARSUB", ("function",)),
    st.Diff: ("DIFSUB", ("function",)),
    st.Sensor: ("SENSUB", ("function",)),
    st.Request: ("REQSUB", ("f1", "f2", "f3", "f4", "f5", "f6", "f7", "f8")),
}
"""ADAMS's name of the routine of a statement, and where its results go."""

BINDERS: dict[type, tuple[str, Callable]] = {
    st.Coupler: ("COUSUB", bind_coupler),
    st.Field: ("FIESUB", bind_field),
    st.CurveStatement: ("CURSUB", bind_curve),
    st.Gse: ("GSE_DERIV", bind_gse),
    st.Mforce: ("MFOSUB", bind_mforce),
}
"""Likewise, with what makes of a routine what the statement needs."""

EVALUATED = "SEVSUB"
"""That of what a SENSOR evaluates when it fires."""


def bound(deck: Deck, routines: Mapping[str, Any] | None = None, allow_missing: bool = False) -> Deck:
    """Return a deck in which the functions USER(...) call Python functions, without what is not supported.

    What uses functions that are not supported, and what reads it, is taken out, and remarked in the deck's diagnostics:
    a run refuses these unless it is asked to leave them out.

    Parameters
    ----------
    deck : Deck
    routines : mapping, optional
        By statement ("SFORCE/3"), by the name in ROUTINE= or INTERFACE= behind any library's, or by ADAMS's name
        (SFOSUB, ...). Those of a GSE also as one mapping of "deriv", "output" and "update".
    allow_missing : bool
        Leave out statements whose routine is missing, and those that read them or what is not supported, instead of
        refusing.

    Raises
    ------
    DeckError
        Naming all routines that are missing, with what else is not supported, and what is wrong with the others.
    """
    known = {name.upper(): routine for name, routine in (routines or {}).items()}
    users = [use for s in deck for use in _uses(s)]
    made = replace(deck, items={kind: dict(group) for kind, group in deck.items.items()})
    made.diagnostics, made.functions = list(deck.diagnostics), dict(deck.functions)
    made.left_out = set(deck.left_out)
    problems = []
    gone: list[st.Statement] = []
    for use in users:
        statement, group = use.statement, made.items[type(use.statement)]
        refused = f"{statement.label()}: FUNCTION is not supported"
        made.diagnostics = [d for d in made.diagnostics if not d.message.startswith(refused)]
        try:
            found, missing = _found(use, known)
        except ValueError as error:
            problems.append(_wrong(deck, statement, error))
            continue
        if missing:
            word, are = ("routine", "is") if len(missing) == 1 else ("routines", "are")
            message = f"{statement.label()}: its {word} {', '.join(missing)} {are} missing; give it in routines"
            problems.append(Diagnostic(UNSUPPORTED, message, deck.file, statement.line))
            if group.pop(statement.id, None) is not None:
                gone.append(statement)
            continue
        if statement.id not in group:
            # another routine of it is missing
            continue
        try:
            group[statement.id] = _with_function(made, group[statement.id], use, found)
        except ValueError as error:
            problems.append(_wrong(deck, statement, error))
    if any(d.severity == ERROR for d in problems):
        raise DeckError(problems)
    made.diagnostics.extend([*problems, *without_refused(made, gone, readers=allow_missing)])
    if not users and made.left_out == deck.left_out:
        # as it was: remarks on the run are to be found in the user's own deck
        return deck
    if problems and not allow_missing:
        raise DeckError(sorted(made.unsupported, key=lambda d: d.line))
    return made


def _wrong(deck: Deck, statement: st.Statement, error: ValueError) -> Diagnostic:
    return Diagnostic(ERROR, f"{statement.label()}: its routine {error}", deck.file, statement.line)


def load_routines(path: str | Path) -> dict[str, Routine]:
    """Return the functions that a Python file defines, by name, as routines; it may import what stands beside it.

    Raises
    ------
    ValueError
        If it cannot be read or run, or defines none.
    """
    path = Path(path)
    sys.path.insert(0, str(path.resolve().parent))
    try:
        space = runpy.run_path(str(path))
    except Exception as error:
        raise ValueError(f"{path}: {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(str(path.resolve().parent))
    found: dict[str, Routine] = {k: v for k, v in space.items() if k[0] != "_" and _defined_here(v)}
    if not found:
        raise ValueError(f"{path}: it defines no functions; write for example def sfosub(call): ...")
    return found


def _defined_here(value: Any) -> bool:
    """Whether a file that is run defines a function itself, plain or compiled by numba."""
    value = getattr(value, "py_func", value)
    return inspect.isfunction(value) and value.__module__ == "<run_path>"


@dataclass(frozen=True)
class _Use:
    """One USER(...) of a statement: ADAMS's name of its routine, where its results go, where the user's name stands."""

    statement: st.Statement
    call: Call
    routine: str
    fields: tuple[str, ...]
    given: str | None

    def names(self) -> list[str]:
        """Return the names under which the routine is looked for."""
        own = [self.given.strip("\"' ").rpartition("::")[2].upper()] if self.given else []
        label = self.statement.label()
        return [f"{label}/EVALUATE" if self.routine == EVALUATED else label, *own, self.routine]


def _uses(s: st.Statement) -> Iterator[_Use]:
    """Yield what a statement calls of the user."""
    if type(s) in ROUTINES or type(s) in BINDERS:
        name, fields = ROUTINES.get(type(s)) or (BINDERS[type(s)][0], ())
        call = _user_call(getattr(s, "function", None)) or _user_call(getattr(s, "force", None))
        if call is not None:
            yield _Use(s, call, name, fields, getattr(s, "routine", None))
    if isinstance(s, st.Sensor):
        call = _user_call(s.evaluate)
        if call is not None:
            yield _Use(s, call, EVALUATED, ("evaluate",), s.evaluate_routine)


def _user_call(text: str | None) -> Call | None:
    if not isinstance(text, str):
        return None
    try:
        node = parse(text)
    except ValueError:
        return None
    return node if isinstance(node, Call) and node.name == "USER" else None


def _found(use: _Use, known: Mapping[str, Any]) -> tuple[dict[str, Routine], list[str]]:
    """Return the routines of a statement by part ("" for the only one), and the names of those that are missing."""
    found: dict[str, Routine] = {}
    missing = []
    s = use.statement
    wanted: Iterable[tuple[str, list[str]]] = [("", use.names())]
    own = known.get(s.label())
    if isinstance(s, st.Gse):
        wanted = gse_parts(s)
        if isinstance(own, Mapping):
            known = {**known, **{f"{s.label()}.{part}".upper(): routine for part, routine in own.items()}}
    for part, names in wanted:
        routine = next((known[name] for name in names if name in known), None)
        if routine is not None and not callable(routine):
            raise ValueError(f"is {routine!r}, which cannot be called")
        if routine is not None:
            found[part] = routine
        else:
            missing.append(names[1])
    return found, missing


def _with_function(deck: Deck, s: st.Statement, use: _Use, found: Mapping[str, Routine]) -> Any:
    """Return a statement whose results are calls of functions that the deck then has."""
    parameters = tuple(_number(a) for a in use.call.args)
    if type(s) in BINDERS:
        return BINDERS[type(s)][1](deck, s, parameters, found)
    caller = Caller(deck, s, parameters, found[""], len(use.fields))
    if isinstance(s, st.Motion) and caller.asked:
        raise ValueError(f"asks for {caller.asked[0]}; a motion depends on TIME only")
    texts: dict[str, str | None] = {} if use.routine == EVALUATED else {"function": None}
    texts |= dict(zip(use.fields, caller.texts(deck.functions, f"{use.routine}_{s.label().replace('/', '_')}")))
    return replace(s, **texts)  # type: ignore[arg-type]


def _number(node: Node) -> float:
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Negative) and isinstance(node.operand, Number):
        return -node.operand.value
    raise ValueError("has parameters that are no numbers")


__all__ = ["BINDERS", "ROUTINES", "RoutineCall", "bound", "load_routines"]
