"""State equations by routines of the user as states and expressions: GSE."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearmbs.adams.builders.implicit import condition, rate_name
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism.elements import State


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
