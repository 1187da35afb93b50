"""Systems of a control loop as states and expressions: LSE and TFSISO here, GSE by state equations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import matrix_values
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism.language.syntax import Call, Number, parse, walk
from gearmbs.mechanism.parts.elements import State

# Differential equations that are not solved for the rates: DIFF and GSE with IMPLICIT.
#
# Of F(x, x', ...) = 0 each rate r = x' that F depends on is an unknown of its own, an algebraic state, and x follows
# it:
#
#     x' = r,    0 = F(x, r, ...).
#
# A state whose rate does not stand in F is an algebraic state itself. The equations must determine these unknowns: dF
# by them must not be singular (index 1).


def rate_name(state: str) -> str:
    """Return the name of the algebraic state that is the rate of a state."""
    return f"{state}.RATE"


def condition(unknown: str, residual: str, start: float) -> State:
    """Return an algebraic state whose equation is that a residual vanishes."""
    return State(unknown, f"VARVAL({unknown}) + ({residual})", start, algebraic=True, implicit=True)


def has_rate(diff: st.Diff) -> bool:
    """Whether an implicit DIFF asks for its own rate."""
    asked = [n.args[:1] for n in walk(parse(diff.function or "0")) if isinstance(n, Call) and n.name == "DIF1"]
    return any(isinstance(first, Number) and first.integer == diff.id for args in asked for first in args)


def diff_name(diff: st.Diff) -> str:
    """Return the name of the state of a DIFF."""
    return f"DIFF_{diff.id}"


def implicit_states(diff: st.Diff, residual: str, time: float) -> dict[int | str, State]:
    """Return the states of an implicit DIFF.

    Parameters
    ----------
    diff : Diff
    residual : str
        Its function in the mechanism's names.
    time : float
        The deck's unit of time, s.
    """
    name, (start, *rates) = diff_name(diff), diff.ic
    if not has_rate(diff):
        return {name: condition(name, residual, start)}
    rate = rate_name(name)
    return {
        diff.id: State(name, f"VARVAL({rate})/{time!r}", start),
        rate: condition(rate, residual, rates[0] if rates else 0.0),
    }


# State equations by routines of the user as states and expressions: GSE.


class StateEquations(NamedTuple):
    """x' = f and y = g as expressions, by time in the deck's unit.

    Attributes
    ----------
    names : tuple of str
        Of the states in the mechanism.
    derivatives : list of str or None
        None of an algebraic state.
    results : list of str
    start : ndarray
        States at the start.
    x, y : int or None
        ARRAYs of the states and outputs.
    algebraic : tuple of State
        Of implicit equations: the rates, and states without one.
    """

    names: tuple[str, ...]
    derivatives: list[str | None]
    results: list[str]
    start: np.ndarray
    x: int | None
    y: int | None
    algebraic: tuple[State, ...] = ()

    def rates(self) -> list[str | None]:
        """Return the states' rates as expressions."""
        return self.derivatives

    def outputs(self) -> list[str]:
        """Return the outputs as expressions."""
        return self.results


def state_equations(deck: Deck, s: st.Gse) -> StateEquations:
    """Return the equations of a GSE whose routines are bound; its discrete states are the numbers they are now.

    Raises
    ------
    ValueError
        If arrays are missing or do not fit, or routines are missing.
    """
    if s.callers is None:
        raise ValueError("has no routines")
    inputs = deck.of(st.Array)[of_array(deck, s, "U", s.u)].variables if s.u is not None else ()
    for name, keyword, ref, size in (("X", "X", s.x, s.ns), ("Y", "Y", s.y, s.no), ("X", "XD", s.xd, s.nd)):
        given = deck.of(st.Array)[of_array(deck, s, name, ref)].size if ref is not None else None
        if given is not None and given != size:
            raise ValueError(f"{keyword} = {ref} has SIZE = {given}, it must be {size}")
    for keyword, ref, size in (("IC", s.ic, s.ns), ("ICD", s.icd, s.nd)):
        numbers = deck.of(st.Array)[of_array(deck, s, "IC", ref)].numbers if ref is not None else None
        if numbers is not None and len(numbers) != size:
            raise ValueError(f"{keyword} = {ref} holds {len(numbers)} numbers for {size} states")
    names = tuple(f"GSE_{s.id}.X{k + 1}" for k in range(s.ns))
    given_texts = quantities(s, inputs)

    def texts(part: str) -> list[str]:
        if part not in s.callers:
            return []
        caller = s.callers[part]
        more = rate_texts(s) if part == "deriv" else []
        arguments = ", ".join(caller.arguments([*given_texts, *more]))
        return [f"USER_GSE_{s.id}_{part.upper()}_{k + 1}({arguments})" for k in range(caller.count)]

    start = np.array(deck.of(st.Array)[s.ic].numbers) if s.ic is not None else np.zeros(s.ns)
    found = texts("deriv")
    if not s.implicit:
        return StateEquations(names, list(found), texts("output"), start, s.x, s.y)
    rates = [f"VARVAL({rate_name(name)})" if rated else None for name, rated in zip(names, s.rated)]
    unknowns = [rate_name(name) if rated else name for name, rated in zip(names, s.rated)]
    starts = [0.0 if rated else float(x) for x, rated in zip(start, s.rated)]
    algebraic = tuple(condition(*given) for given in zip(unknowns, found, starts))
    return StateEquations(names, rates, texts("output"), start, s.x, s.y, algebraic)


def quantities(s: st.Gse, inputs: tuple[int, ...]) -> list[str]:
    """Return what a GSE's routines are given, as expressions: states, discrete states, inputs."""
    names = [f"GSE_{s.id}.X{k + 1}" for k in range(s.ns)]
    rated = s.rated or (True,) * s.ns
    states = [f"DIF({name})" if has_rate else f"VARVAL({name})" for name, has_rate in zip(names, rated)]
    return [*states, *(repr(float(v)) for v in s.held), *(f"VARVAL({v})" for v in inputs)]


def rate_texts(s: st.Gse) -> list[str]:
    """Return the rates that the routine of an implicit GSE is given, too; of an algebraic state it is zero."""
    names = [rate_name(f"GSE_{s.id}.X{k + 1}") for k in range(s.ns)] if s.implicit else []
    return [f"VARVAL({name})" if rated else "0" for name, rated in zip(names, s.rated)]


def of_array(deck: Deck, s: st.Statement, name: str, ref: int | None) -> int:
    """Return the id of an ARRAY that must be of a type.

    Raises
    ------
    ValueError
        If there is none, or it is of another type.
    """
    array = deck.of(st.Array).get(ref or 0)
    if array is None:
        raise ValueError(f"there is no ARRAY/{ref} for {name}")
    kind = (array.type or "IC").upper()
    if kind != name:
        raise ValueError(f"{name} = {ref}, but ARRAY/{ref} is of type {kind}")
    return array.id


class LinearSystem(NamedTuple):
    """x' = A x + B u, y = C x + D u, by time in the deck's unit.

    Attributes
    ----------
    names : tuple of str
        Of the states in the mechanism.
    inputs : tuple of int
        VARIABLEs of u.
    a, b, c, d : ndarray
    start : ndarray
        States at the start.
    x, y : int or None
        ARRAYs of the states and outputs.
    algebraic : tuple of State
        None here.
    """

    names: tuple[str, ...]
    inputs: tuple[int, ...]
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    start: np.ndarray
    x: int | None
    y: int | None
    algebraic: tuple[State, ...] = ()

    def rates(self) -> list[str]:
        """Return the states' rates as expressions."""
        return [self._row(self.a, self.b, k) for k in range(len(self.names))]

    def outputs(self) -> list[str]:
        """Return the outputs as expressions."""
        return [self._row(self.c, self.d, k) for k in range(len(self.c))]

    def _row(self, by_state: np.ndarray, by_input: np.ndarray, k: int) -> str:
        terms = [f"{float(v)!r}*DIF({name})" for v, name in zip(by_state[k], self.names) if v != 0.0]
        terms += [f"{float(v)!r}*VARVAL({u})" for v, u in zip(by_input[k], self.inputs) if v != 0.0]
        return " + ".join(f"({t})" for t in terms) or "0"


def state_systems(deck: Deck) -> Iterator[tuple[st.Statement, LinearSystem | StateEquations]]:
    """Yield the LSE, TFSISO and GSE statements of a deck that hold together, each with what it stands for."""
    for statement in deck.each(st.System):
        try:
            system = state_system(deck, statement)
        except ValueError:
            # whoever adds it to a mechanism says so
            continue
        yield statement, system


def state_system(deck: Deck, s: st.Statement) -> LinearSystem | StateEquations:
    """Return what an LSE, TFSISO or GSE stands for.

    Raises
    ------
    ValueError
        If arrays, matrices or routines are missing or do not fit.
    """
    if isinstance(s, st.Gse):
        return state_equations(deck, s)
    assert isinstance(s, (st.Lse, st.Tfsiso))
    return linear_system(deck, s)


def linear_system(deck: Deck, s: st.Lse | st.Tfsiso) -> LinearSystem:
    """Return the system of a statement.

    Raises
    ------
    ValueError
        If arrays or matrices are missing or do not fit.
    """
    inputs = deck.of(st.Array)[of_array(deck, s, "U", s.u)].variables if s.u is not None else ()
    if isinstance(s, st.Tfsiso):
        a, b, c, d = _canonical(s, inputs)
        start = np.zeros(len(a))
    else:
        a, b, c, d = _matrices(deck, s, inputs)
        start = np.zeros(len(a))
        if s.ic is not None:
            start = np.array(deck.of(st.Array)[of_array(deck, s, "IC", s.ic)].numbers)
            if start.size != len(a):
                raise ValueError(f"IC = {s.ic} holds {start.size} numbers for {len(a)} states")
    for name, ref, size in (("X", s.x, len(a)), ("Y", s.y, len(c))):
        if ref is None:
            continue
        given = deck.of(st.Array)[of_array(deck, s, name, ref)].size
        if given is not None and given != size:
            raise ValueError(f"{name} = {ref} has SIZE = {given}, it must be {size}")
    keyword = "LSE" if isinstance(s, st.Lse) else "TFSISO"
    names = tuple(f"{keyword}_{s.id}.X{k + 1}" for k in range(len(a)))
    return LinearSystem(names, inputs, a, b, c, d, start, s.x, s.y)


def _matrices(deck: Deck, s: st.Lse, inputs: tuple[int, ...]) -> list[np.ndarray]:
    if s.a is None:
        raise ValueError("A is missing")
    found = {}
    for name in "abcd":
        ref = getattr(s, name)
        if ref is not None and ref not in deck.of(st.Matrix):
            raise ValueError(f"there is no MATRIX/{ref} for {name.upper()}")
        if ref is not None:
            found[name] = matrix_values(deck.of(st.Matrix)[ref])
    n = len(found["a"])
    if ("b" in found or "d" in found) and not inputs:
        raise ValueError("B and D need U, an ARRAY of variables")
    if s.y is not None and not ("c" in found or "d" in found):
        raise ValueError("Y needs C or D")
    outputs = len(found["c"]) if "c" in found else len(found.get("d", ()))
    sizes = {"a": (n, n), "b": (n, len(inputs)), "c": (outputs, n), "d": (outputs, len(inputs))}
    for name, size in sizes.items():
        if name in found and found[name].shape != size:
            rows, columns = found[name].shape
            raise ValueError(f"{name.upper()} is {rows} by {columns}, it must be {size[0]} by {size[1]}")
    return [found.get(name, np.zeros(size)) for name, size in sizes.items()]


def _canonical(s: st.Tfsiso, inputs: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return a transfer function in controllable canonical form: u is the input of a chain of integrators."""
    if not s.numerator or not s.denominator:
        raise ValueError("NUMERATOR and DENOMINATOR are needed")
    if len(inputs) != 1:
        raise ValueError(f"U must be an ARRAY of one variable, it has {len(inputs)}")
    n = len(s.denominator) - 1
    if len(s.numerator) > n + 1:
        raise ValueError(f"NUMERATOR has {len(s.numerator)} coefficients, more than DENOMINATOR with {n + 1}")
    lead = s.denominator[-1]
    if lead == 0.0:
        raise ValueError("the last coefficient of DENOMINATOR is 0")
    below = np.array(s.denominator[:-1]) / lead
    above = np.zeros(n + 1)
    above[: len(s.numerator)] = np.array(s.numerator) / lead
    a = np.eye(n, k=1)
    if n:
        a[-1] = -below
    b = np.zeros((n, 1))
    b[-1:] = 1.0
    return a, b, (above[:-1] - above[-1] * below)[None], above[-1:][None]
