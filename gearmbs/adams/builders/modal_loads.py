"""Load cases of an MFORCE, and what its routine becomes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gearmbs.adams.builders.flexible_data import LOADS, flexible_body
from gearmbs.adams.builders.routine_calls import Caller, Routine, RoutineCall
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck


def load_cases(deck: Deck, s: st.Mforce) -> np.ndarray | None:
    """Return the load cases that a statement scales, None if its routine gives the load itself."""
    if s.force is not None or "force" in s.given:
        return None
    return flexible_body(deck, deck.of(st.FlexBody)[s.flex_body or 0]).loads


def load_case(case: int, loads: np.ndarray) -> int:
    """Return a load case's number, which is one of a column."""
    if not 1 <= case <= loads.shape[1]:
        raise ValueError(f"CASE_INDEX = {case}; {LOADS} has {loads.shape[1]} columns")
    return case


def no_cases(s: st.Mforce) -> str:
    """Return what is missing where a body has no load cases."""
    return (
        f"FLEX_BODY/{s.flex_body} has no matrix {LOADS}; load cases inside a modal neutral file are not read, write "
        "them as a MATRIX"
    )


def bind_mforce(deck: Deck, s: st.Mforce, parameters: tuple[float, ...], found: Mapping[str, Routine]) -> st.Mforce:
    """MFORCE by MFOSUB: with FORCE the load itself, with FUNCTION the scale and the number of a load case."""
    if s.flex_body not in deck.of(st.FlexBody):
        raise ValueError(f"acts on FLEX_BODY/{s.flex_body}, which the deck does not have")
    body = flexible_body(deck, deck.of(st.FlexBody)[s.flex_body])
    direct = "force" in s.given
    if not direct and body.loads is None:
        raise ValueError(f"scales a load case, but {no_cases(s)}")
    size = 6 + body.model.modes if direct else body.loads.shape[1]  # type: ignore[union-attr]

    def routine(call: RoutineCall) -> np.ndarray:
        call.loads = np.zeros((size, 0)) if body.loads is None else body.loads
        values = found[""](call)
        if direct:
            return values
        scale, case = np.asarray(values, dtype=float)
        out = np.zeros(size)
        out[load_case(int(case), body.loads) - 1] = scale  # type: ignore[arg-type]
        return out

    caller = Caller(deck, s, parameters, found[""] if hasattr(found[""], "py_func") and direct else routine, size)
    shares = caller.texts(deck.functions, f"USER_MFORCE_{s.id}")
    return replace(s, force=None, function=None, shares=tuple(shares))
