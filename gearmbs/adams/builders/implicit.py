"""Differential equations that are not solved for the rates: DIFF and GSE with IMPLICIT.

Of F(x, x', ...) = 0 each rate r = x' that F depends on is an unknown of its own, an algebraic state, and x follows it:

    x' = r,    0 = F(x, r, ...).

A state whose rate does not stand in F is an algebraic state itself. The equations must determine these unknowns: dF by
them must not be singular (index 1).
"""

from __future__ import annotations

from gearmbs.adams.parse import statements as st
from gearmbs.mechanism.elements import State
from gearmbs.mechanism.expression_syntax import Call, Number, parse, walk


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
