"""Systems of a control loop as states and expressions: LSE and TFSISO here, GSE by state equations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearmbs.adams.builders.curve_data import matrix_values
from gearmbs.adams.builders.implicit import diff_name, rate_name
from gearmbs.adams.builders.state_equations import StateEquations, of_array, state_equations
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism.elements import State

if TYPE_CHECKING:
    from gearmbs.adams.builders.model import AdamsModel


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
    for statement in (*deck.of(st.Lse).values(), *deck.of(st.Tfsiso).values(), *deck.of(st.Gse).values()):
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


def hold_states(model: AdamsModel) -> None:
    """Make the states of statements with STATIC_HOLD keep their values, as in static analyses."""
    deck, states = model.deck, model.mechanism.states
    held: list[int | str] = []
    for diff in deck.of(st.Diff).values():
        if diff.static_hold:
            held += [diff.id, diff_name(diff), rate_name(diff_name(diff))]
    for s, system in state_systems(deck):
        if getattr(s, "static_hold", False):
            held += [*system.names, *(state.name for state in system.algebraic)]
    for name in held:
        if name in states:
            states[name].expression = repr(states[name].start) if states[name].algebraic else "0"
