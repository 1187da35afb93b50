"""Ends of a simulation where an expression passes a value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as tables
from gearmbs.dae.equations.expression_loads import value
from gearmbs.dae.equations.update import update_tables
from gearmbs.dae.errors import ModelError
from gearmbs.dae.integrators.events import STOP
from gearmbs.dae.problem import EVENTS_SIG, DAEProblem


@dataclass(frozen=True)
class StopAt:
    """End where a state passes a value.

    Attributes
    ----------
    state : str
        Name of a state of the mechanism; an algebraic one holds any expression, see `Mechanism.algebraic_state`.
    value : float
    direction : int
        1: rising only, -1: falling only, 0: either.
    """

    state: str
    value: float = 0.0
    direction: int = 0


@njit(EVENTS_SIG, cache=True, nogil=True, error_model="numpy")
def passes(t, y, yp, out, idata, rdata, work):
    """Write by how much states exceed their values: both stand at the ends of the tables, their number last.

    An algebraic state is taken from its expression. Between the ends of a step the polynomial through its values would
    pass where its function jumps later.
    """
    count = idata[idata.size - 1]
    tab = tables.unpack(idata, rdata, work)
    update_tables(t, y, tab, False)
    for k in range(count):
        place = idata[idata.size - 1 - count + k]
        state = tab.state[place - idata[tables.H_Z]]
        given = state[tables.STATE_KIND] != tables.STATE_DIFFERENTIAL and state[tables.STATE_TAPE] >= 0
        now = value(state[tables.STATE_TAPE], t, y, tab) if given else y[place]
        out[k] = now - rdata[rdata.size - count + k]


def with_stops(problem: DAEProblem, names: Sequence[str], first: int, stops: Sequence[StopAt]) -> DAEProblem:
    """Return a problem that ends where states pass values.

    Parameters
    ----------
    problem : DAEProblem
    names : sequence of str
        Of all states, in the order of the unknowns.
    first : int
        Place of the first among the unknowns.
    stops : sequence of StopAt

    Raises
    ------
    ModelError
        For a state that is not there.
    """
    places = []
    for stop in stops:
        if stop.state not in names:
            raise ModelError(f"stops: there is no state {stop.state!r}; the mechanism has {', '.join(names) or 'none'}")
        places.append(first + names.index(stop.state))
    idata = np.concatenate([problem.idata, places, [len(stops)]]).astype(np.int64)
    rdata = np.concatenate([problem.rdata, [float(stop.value) for stop in stops]])
    return replace(problem, idata=idata, rdata=rdata, events=passes, n_events=len(stops))


def stop_options(stops: Sequence[StopAt]) -> dict[str, Any]:
    """Return the options of the integrator that go with `with_stops`."""
    return {"event_direction": [stop.direction for stop in stops], "event_action": [STOP] * len(stops)}
