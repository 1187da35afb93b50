"""Routines of the user: USER(...) in the functions of a deck, bound to Python functions.

A routine is called with a `RoutineCall`, which holds what ADAMS hands to its subroutines: id, time, parameters, and the
utility calls by name. It is called some times beforehand, with numbers of no meaning, to learn which quantities it asks
for, as ADAMS does with IFLAG; what it asks for becomes the arguments of a function in the deck's expressions, so that a
force by a routine has its derivatives, and stands in statics, modes and results as any other.
"""

from __future__ import annotations

import inspect
import itertools
import runpy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.adams.errors import ERROR, UNSUPPORTED, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism.expression_syntax import Call, Negative, Node, Number, parse
from gearmbs.mechanism.user_functions import UserFunction

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
EVALUATED = "SEVSUB"
"""That of what a SENSOR evaluates when it fires."""

SYSARY = {
    "DISP": ("DX", "DY", "DZ", "PSI", "THETA", "PHI"),
    "TDISP": ("DX", "DY", "DZ"),
    "RDISP": ("PSI", "THETA", "PHI"),
    "VEL": ("VX", "VY", "VZ", "WX", "WY", "WZ"),
    "TVEL": ("VX", "VY", "VZ"),
    "RVEL": ("WX", "WY", "WZ"),
    "FORCE": ("FX", "FY", "FZ", "TX", "TY", "TZ"),
    "TFORCE": ("FX", "FY", "FZ"),
    "RFORCE": ("TX", "TY", "TZ"),
}
"""Functions of a set of values that SYSARY returns by its name."""

REHEARSALS = 16
Routine = Callable[["RoutineCall"], Any]


@dataclass
class RoutineCall:
    """What a routine is given.

    Attributes
    ----------
    id : int
        Of the statement.
    label : str
        The statement, for instance "SFORCE/3".
    parameters : tuple of float
        Those of USER(...).
    time : float
        In the deck's unit.
    rehearsal : bool
        Whether this call only finds out what the routine asks for; numbers then have no meaning.
    """

    id: int
    label: str
    parameters: tuple[float, ...]
    time: float = 0.0
    rehearsal: bool = False
    _values: dict[str, float] = field(default_factory=dict)
    _draw: np.random.Generator = field(default_factory=np.random.default_rng)

    def sysfnc(self, name: str, *ids: int) -> float:
        """Return a function of the deck's expressions by its name, for instance ``sysfnc("DX", 12, 10, 10)``."""
        text = f"{name.upper()}({','.join(str(int(i)) for i in _flat(ids))})"
        if self.rehearsal:
            self._values.setdefault(text, float(self._draw.uniform(0.1, 1.0)))
        elif text not in self._values:
            raise ValueError(f"asks for {text} only in some cases; ask for all it may need before the first branch")
        return self._values[text]

    def sysary(self, name: str, *ids: int) -> tuple[float, ...]:
        """Return a set of values by its name, for instance ``sysary("TDISP", 12, 10, 10)``: DX, DY, DZ."""
        if name.upper() not in SYSARY:
            raise ValueError(f"SYSARY has no {name!r}; it has {', '.join(SYSARY)}")
        return tuple(self.sysfnc(one, *ids) for one in SYSARY[name.upper()])


def bound(deck: Deck, routines: Mapping[str, Routine] | None = None, allow_missing: bool = False) -> Deck:
    """Return a deck in which the functions USER(...) call Python functions.

    Parameters
    ----------
    deck : Deck
    routines : mapping, optional
        By statement ("SFORCE/3"), by the name in ROUTINE= behind any library's, or by ADAMS's name (SFOSUB, ...).
    allow_missing : bool
        Leave out statements whose routine is missing instead of refusing.

    Raises
    ------
    DeckError
        Naming all routines that are missing, and what is wrong with the others.
    """
    known = {name.upper(): routine for name, routine in (routines or {}).items()}
    users = [use for s in deck for use in _uses(s)]
    if not users:
        return deck
    made = replace(deck, items={kind: dict(group) for kind, group in deck.items.items()})
    made.diagnostics, made.functions = list(deck.diagnostics), dict(deck.functions)
    problems = []
    for use in users:
        statement, group = use.statement, made.items[type(use.statement)]
        routine = next((known[name] for name in use.names() if name in known), None)
        if routine is None:
            message = f"{statement.label()}: its routine {use.names()[1]} is missing; give it in routines"
            problems.append(Diagnostic(UNSUPPORTED, message, deck.file, statement.line))
            group.pop(statement.id, None)
            continue
        if statement.id not in group:
            # another routine of it is missing
            continue
        try:
            group[statement.id] = _with_function(made, group[statement.id], use, routine)
        except ValueError as error:
            message = f"{statement.label()}: its routine {error}"
            problems.append(Diagnostic(ERROR, message, deck.file, statement.line))
        refused = f"{statement.label()}: FUNCTION is not supported"
        made.diagnostics = [d for d in made.diagnostics if d.message != refused]
    if any(d.severity == ERROR for d in problems) or (problems and not allow_missing):
        raise DeckError(problems)
    made.diagnostics.extend(problems)
    return made


def load_routines(path: str | Path) -> dict[str, Routine]:
    """Return the functions that a Python file defines, by name, as routines.

    Raises
    ------
    ValueError
        If it cannot be read or run, or defines none.
    """
    path = Path(path)
    try:
        space = runpy.run_path(str(path))
    except Exception as error:
        raise ValueError(f"{path}: {type(error).__name__}: {error}") from error
    found: dict[str, Routine] = {}
    found |= {k: v for k, v in space.items() if inspect.isfunction(v) and v.__module__ == "<run_path>" and k[0] != "_"}
    if not found:
        raise ValueError(f"{path}: it defines no functions; write for example def sfosub(call): ...")
    return found


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
    if type(s) in ROUTINES:
        name, fields = ROUTINES[type(s)]
        call = _user_call(getattr(s, "function", None))
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


def _with_function(deck: Deck, s: st.Statement, use: _Use, routine: Routine) -> Any:
    """Return a statement whose results are calls of functions that the deck then has."""
    caller = _Caller(s, tuple(_number(a) for a in use.call.args), routine, len(use.fields))
    arguments = ", ".join(["TIME", *caller.asked])
    if isinstance(s, st.Motion) and caller.asked:
        raise ValueError(f"asks for {caller.asked[0]}; a motion depends on TIME only")
    texts: dict[str, str | None] = {} if use.routine == EVALUATED else {"function": None}
    for component, name in enumerate(use.fields):
        key = f"{use.routine}_{s.label().replace('/', '_')}_{component + 1}"
        count = 1 + len(caller.asked)
        deck.functions[key] = UserFunction(f"{s.label()}: USER", caller.component(component), count=count)
        texts[name] = f"{key}({arguments})"
    return replace(s, **texts)  # type: ignore[arg-type]


def _number(node: Node) -> float:
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Negative) and isinstance(node.operand, Number):
        return -node.operand.value
    raise ValueError("has parameters that are no numbers")


class _Caller:
    """Calls a routine with the values of what it asks for, once for all of its results."""

    def __init__(self, s: st.Statement, parameters: tuple[float, ...], routine: Routine, count: int) -> None:
        self.statement, self.parameters, self.routine, self.count = s, parameters, routine, count
        self.asked = list(dict.fromkeys(itertools.chain(*self._rehearsed())))
        self._last: tuple[tuple[float, ...], tuple[float, ...]] | None = None

    def _rehearsed(self) -> Iterator[list[str]]:
        for seed in range(REHEARSALS):
            draw = np.random.default_rng(seed)
            time = float(draw.uniform(0.0, 1.0))
            call = RoutineCall(self.statement.id, self.statement.label(), self.parameters, time, True, {}, draw)
            try:
                self._results(call)
            except (ArithmeticError, ValueError) as error:
                # numbers of no meaning may have no root; what it asked for before counts
                if seed == REHEARSALS - 1 and not call._values:
                    raise ValueError(f"fails: {error}") from error
            yield list(call._values)

    def _results(self, call: RoutineCall) -> tuple[float, ...]:
        found = self.routine(call)
        values = tuple(float(v) for v in np.atleast_1d(np.asarray(found, dtype=float)))
        if len(values) != self.count:
            raise ValueError(f"returns {len(values)} numbers, it must return {self.count}")
        return values

    def component(self, which: int) -> Callable[..., float]:
        """Return the function of time and the quantities asked for that gives one of the results."""

        def value(*arguments: float) -> float:
            if self._last is None or self._last[0] != arguments:
                s, given = self.statement, dict(zip(self.asked, arguments[1:]))
                call = RoutineCall(s.id, s.label(), self.parameters, arguments[0], False, given)
                self._last = arguments, self._results(call)
            return self._last[1][which]

        return value


def _flat(ids: Sequence[Any]) -> list[Any]:
    return [one for given in ids for one in (given if isinstance(given, (tuple, list)) else (given,))]
