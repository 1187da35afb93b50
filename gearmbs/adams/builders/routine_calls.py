"""What a routine of the user is given, and the functions of expressions that call it.

A routine is called with a `RoutineCall`, which holds what ADAMS hands to its subroutines: id, time, parameters, the
quantities of its element, and the utility calls by name. It is called some times beforehand, with numbers of no
meaning, to learn which quantities it asks for, as ADAMS does with IFLAG; what it asks for becomes the arguments of a
function in the deck's expressions, so that a force by a routine has its derivatives, and stands in statics, modes and
results as any other. A function that numba has compiled is called with (time, x, xd, u, parameters) instead,
of an implicit GSE with xdot behind them.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism.language.user_functions import UserFunction, place_of

SYSARY = {
    "DISP": ("DX", "DY", "DZ", "PSI", "THETA", "PHI"),
    "TDISP": ("DX", "DY", "DZ"),
    "RDISP": ("PSI", "THETA", "PHI"),
    "VEL": ("VX", "VY", "VZ", "WX", "WY", "WZ"),
    "TVEL": ("VX", "VY", "VZ"),
    "RVEL": ("WX", "WY", "WZ"),
    "ACC": ("ACCX", "ACCY", "ACCZ", "WDTX", "WDTY", "WDTZ"),
    "TACC": ("ACCX", "ACCY", "ACCZ"),
    "RACC": ("WDTX", "WDTY", "WDTZ"),
    "FORCE": ("FX", "FY", "FZ", "TX", "TY", "TZ"),
    "TFORCE": ("FX", "FY", "FZ"),
    "RFORCE": ("TX", "TY", "TZ"),
}
"""Functions of a set of values that SYSARY returns by its name."""
MOST_IDS = {"PSI": 2, "THETA": 2, "PHI": 2, "WX": 3, "WY": 3, "WZ": 3}
"""Ids that these functions take of those of their set, which are I, J, K and L."""
ARRAYS = ("ARRAY", "X", "Y", "U")
"""Names under which SYSARY returns the values of an ARRAY."""

REHEARSALS = 16
Routine = Callable[..., Any]


def _empty() -> np.ndarray:
    return np.zeros(0)


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
    x, xd, u : ndarray
        Continuous states, discrete states and inputs of a GSE.
    xdot : ndarray
        Rates of the continuous states of an implicit GSE.
    q : ndarray
        Displacements of the joints of a COUPLER; rotations in rad.
    displacement, velocity : ndarray, shape (6,)
        Of I of a FIELD, as seen from J: DX, DY, DZ, AX, AY, AZ and VX, VY, VZ, WX, WY, WZ.
    alpha : float or None
        Parameter of a CURVE.
    loads : ndarray, shape (6 + n, cases)
        Load cases of the FLEX_BODY of an MFORCE.
    """

    id: int
    label: str
    parameters: tuple[float, ...]
    time: float = 0.0
    rehearsal: bool = False
    x: np.ndarray = field(default_factory=_empty)
    xd: np.ndarray = field(default_factory=_empty)
    u: np.ndarray = field(default_factory=_empty)
    xdot: np.ndarray = field(default_factory=_empty)
    q: np.ndarray = field(default_factory=_empty)
    displacement: np.ndarray = field(default_factory=_empty)
    velocity: np.ndarray = field(default_factory=_empty)
    alpha: float | None = None
    loads: np.ndarray = field(default_factory=_empty)
    _values: dict[str, float] = field(default_factory=dict)
    _draw: np.random.Generator = field(default_factory=np.random.default_rng)
    _deck: Deck = field(default_factory=Deck)

    def sysfnc(self, name: str, *ids: int) -> float:
        """Return a function of the deck's expressions by its name, for instance ``sysfnc("DX", 12, 10, 10)``."""
        text = f"{name.upper()}({','.join(str(int(i)) for i in _flat(ids))})"
        if self.rehearsal:
            self._values.setdefault(text, float(self._draw.uniform(0.1, 1.0)))
        elif text not in self._values:
            raise ValueError(f"asks for {text} only in some cases; ask for all it may need before the first branch")
        return self._values[text]

    def sysary(self, name: str, *ids: int) -> tuple[float, ...]:
        """Return a set of values by its name, for instance ``sysary("TDISP", 12, 10, 10)``: DX, DY, DZ.

        Ids are those of markers I, J, K along whose axes components are taken, and L in whose frame rates are seen.

        ``sysary("ARRAY", 3)`` returns what ARRAY/3 holds: numbers, variables, states or outputs.
        """
        if name.upper() in ARRAYS:
            (number,) = _flat(ids)
            return tuple(self.sysfnc("ARYVAL", number, k + 1) for k in range(self._size(number)))
        if name.upper() not in SYSARY:
            raise ValueError(f"SYSARY has no {name!r}; it has {', '.join((*SYSARY, *ARRAYS))}")
        given = _flat(ids)
        return tuple(self.sysfnc(one, *given[: MOST_IDS.get(one)]) for one in SYSARY[name.upper()])

    def gtaray(self, number: int) -> tuple[float, ...]:
        """Return the numbers of an ARRAY."""
        return self._array(number).numbers

    def gtstrg(self, number: int) -> str:
        """Return the text of a STRING."""
        if number not in self._deck.of(st.String):
            raise ValueError(f"asks for STRING/{number}, which the deck does not have")
        return self._deck.of(st.String)[number].text or ""

    def _array(self, number: int) -> st.Array:
        if number not in self._deck.of(st.Array):
            raise ValueError(f"asks for ARRAY/{number}, which the deck does not have")
        return self._deck.of(st.Array)[number]

    def _size(self, number: int) -> int:
        array = self._array(number)
        size = len(array.numbers) or len(array.variables) or array.size
        if not size:
            raise ValueError(f"asks for ARRAY/{number}, of which the deck does not give the SIZE")
        return size


class WrongResultError(ValueError):
    """A routine returns something else than the numbers of its statement."""


class Caller:
    """Calls a routine with the quantities of its element and those it asks for, once for all of its results.

    Parameters
    ----------
    deck : Deck
    statement : Statement
    parameters : tuple of float
    routine : callable
    count : int
        Numbers that it returns.
    quantities : mapping of str to int
        Names of attributes of the call, with their sizes, that the element gives.

    Raises
    ------
    ValueError
        If it fails in all rehearsals, or returns something else.
    """

    def __init__(
        self,
        deck: Deck,
        statement: st.Statement,
        parameters: tuple[float, ...],
        routine: Routine,
        count: int,
        quantities: Mapping[str, int] | None = None,
    ) -> None:
        self.deck, self.statement, self.parameters, self.count = deck, statement, parameters, count
        self.routine = callable_with_call(routine)
        self.quantities = dict(quantities or {})
        if hasattr(routine, "py_func"):
            self._check_indices(callable_with_call(routine.py_func, compiled=True))
        self.asked = list(dict.fromkeys(itertools.chain(*self._rehearsed())))
        self._last: tuple[tuple[float, ...], tuple[float, ...]] | None = None

    def _call(self, time: float, rehearsal: bool, values: dict[str, float], draw: np.random.Generator) -> RoutineCall:
        s = self.statement
        return RoutineCall(
            s.id, s.label(), self.parameters, time, rehearsal, _values=values, _draw=draw, _deck=self.deck
        )

    def _rehearsal(self, seed: int) -> RoutineCall:
        """Return a call with numbers of no meaning."""
        draw = np.random.default_rng(seed)
        call = self._call(float(draw.uniform(0.0, 1.0)), True, {}, draw)
        for name, size in self.quantities.items():
            setattr(call, name, draw.uniform(0.1, 1.0, size))
        return call

    def _check_indices(self, plain: Routine) -> None:
        """Refuse a function that numba compiles if it reads beyond its arrays, which would not be seen there."""
        try:
            plain(self._rehearsal(0))
        except IndexError as error:
            raise ValueError(f"fails: {error}; a compiled function is given time, x, xd, u and parameters") from error
        except Exception:
            # plain Python may not have all that numba has
            return

    def _rehearsed(self) -> Iterator[list[str]]:
        for seed in range(REHEARSALS):
            call = self._rehearsal(seed)
            try:
                self._results(call)
            except WrongResultError:
                raise
            except (ArithmeticError, ValueError) as error:
                # numbers of no meaning may have no root; what it asked for before counts
                if seed == REHEARSALS - 1 and not call._values and not self.quantities:
                    raise ValueError(f"fails: {error}{_in_rehearsal(error)}") from error
            except Exception as error:
                # whatever a user's function raises is told with its statement
                raise ValueError(f"fails: {type(error).__name__}: {error}{_in_rehearsal(error)}") from error
            yield list(call._values)

    def _results(self, call: RoutineCall) -> tuple[float, ...]:
        found = self.routine(call)
        try:
            values = np.asarray(found, dtype=float).ravel().tolist()
        except (TypeError, ValueError):
            values = None
        many = "one number" if self.count == 1 else f"{self.count} numbers"
        if found is None or values is None:
            raise WrongResultError(f"returns {found!r}, it must return {many}")
        if len(values) != self.count:
            raise WrongResultError(f"returns {len(values)} numbers, it must return {self.count}")
        return tuple(values)

    def results(self, arguments: Sequence[float]) -> tuple[float, ...]:
        """Return what the routine gives for time, the element's quantities and those it asks for."""
        arguments = tuple(arguments)
        if self._last is None or self._last[0] != arguments:
            rest = arguments[1:]
            given: dict[str, np.ndarray] = {}
            for name, size in self.quantities.items():
                given[name], rest = np.array(rest[:size]), rest[size:]
            call = self._call(arguments[0], False, dict(zip(self.asked, rest)), _NEVER)
            for name, values in given.items():
                setattr(call, name, values)
            try:
                self._last = arguments, self._results(call)
            except Exception as error:
                error.add_note(f"at TIME = {arguments[0]:.6g}")
                raise
        return self._last[1]

    def arguments(self, quantities: Sequence[str] = ()) -> list[str]:
        """Return the expressions of the arguments: time, the element's quantities, those it asks for."""
        return ["TIME", *quantities, *self.asked]

    def texts(self, functions: dict[str, UserFunction], prefix: str, quantities: Sequence[str] = ()) -> list[str]:
        """Add a function for each result and return the expressions that call them."""
        arguments = self.arguments(quantities)
        out = []
        for which in range(self.count):
            key = f"{prefix}_{which + 1}"

            def value(*given: float, k: int = which) -> float:
                return self.results(given)[k]

            label = f"{self.statement.label()}: USER"
            functions[key] = UserFunction(label, value, count=len(arguments))
            out.append(f"{key}({', '.join(arguments)})")
        return out


def _in_rehearsal(error: Exception) -> str:
    """Return where a routine failed, and that it was given numbers of no meaning."""
    place = place_of(error)
    return f" ({f'{place}; ' if place else ''}in a rehearsal, where numbers have no meaning: see call.rehearsal)"


_NEVER = np.random.default_rng(0)
"""Draws of calls that are no rehearsals, which make none."""


def callable_with_call(routine: Any, compiled: bool | None = None) -> Routine:
    """Return a routine that takes a call, of one that numba has compiled, which takes numbers and arrays.

    What the element gives stands in ``u`` then: the displacements of a COUPLER, displacement and velocity of a FIELD,
    the parameter of a CURVE.
    """
    if not (hasattr(routine, "py_func") if compiled is None else compiled):
        return routine

    def called(call: RoutineCall) -> Any:
        more = (call.xdot,) if call.xdot.size else ()
        alpha = [] if call.alpha is None else [call.alpha]
        given = np.concatenate([call.u, call.q, call.displacement, call.velocity, alpha])
        return routine(call.time, call.x, call.xd, given, np.array(call.parameters), *more)

    return called


def _flat(ids: Sequence[Any]) -> list[Any]:
    return [one for given in ids for one in (given if isinstance(given, (tuple, list)) else (given,))]
