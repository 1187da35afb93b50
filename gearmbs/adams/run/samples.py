"""Discrete states of GSEs: held between samples, and renewed at them.

With SAMPLE_PERIOD T and SAMPLE_OFFSET t0 the samples are at t_n = t0 + n T, and xd(n+1) = h(t_n, x_n, xd(n), u_n) holds
from t_(n+1) on. An analysis is cut at the samples, so that each part of it is smooth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gearmbs.adams.builders.state_equations import quantities
from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.results.requests import RequestEvaluator
from gearmbs.adams.run.session import Session
from gearmbs.mechanism.expression_syntax import Number, parse

CLOSE = 1e-9
"""Of an analysis: times so near count as one."""
AT_SAMPLE = 1e-6
"""Of a sampling period: a time so near to a sample is one."""


def sampled(session: Session) -> list[st.Gse]:
    """Return the GSEs with discrete states."""
    return [g for g in session.deck.of(st.Gse).values() if g.nd]


def period_of(session: Session, gse: st.Gse) -> float:
    """Return a GSE's sampling period in the deck's unit.

    Raises
    ------
    DeckError
        If it is missing, no number, or not positive.
    """
    node = parse(gse.sample_period) if gse.sample_period is not None else None
    if isinstance(node, Number) and node.value > 0.0:
        return node.value
    given = "is missing" if gse.sample_period is None else f"= {gse.sample_period}; it must be a positive number"
    message = f"{gse.label()}: SAMPLE_PERIOD {given}"
    raise DeckError([Diagnostic(ERROR, message, session.deck.file, gse.line)])


def parts(session: Session, times: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the output times of the parts of an analysis between samples."""
    marks: list[float] = []
    for gse in sampled(session):
        period = period_of(session, gse)
        first = np.ceil((times[0] - gse.sample_offset) / period - CLOSE)
        last = np.floor((times[-1] - gse.sample_offset) / period + CLOSE)
        marks += [gse.sample_offset + period * k for k in np.arange(first, last + 1)]
    if not marks:
        yield times
        return
    span = float(times[-1] - times[0])
    edges = [float(times[0])]
    for mark in sorted(marks):
        if edges[-1] + CLOSE * span < mark < times[-1] - CLOSE * span:
            edges.append(float(mark))
    edges.append(float(times[-1]))
    for start, end in pairwise(edges):
        between = times[(times > start + CLOSE * span) & (times < end - CLOSE * span)]
        yield np.r_[start, between, end]


def take_samples(session: Session, evaluator: RequestEvaluator, time: float) -> None:
    """At the first row of a part compute what discrete states will be after the next sample."""
    for gse in sampled(session):
        period = period_of(session, gse)
        n = (time - gse.sample_offset) / period
        if abs(n - round(n)) > AT_SAMPLE or round(n) < 0:
            continue
        caller = gse.callers["update"]
        inputs = session.deck.of(st.Array)[gse.u].variables if gse.u is not None else ()
        arguments = [float(evaluator.expression(t)[0]) for t in caller.arguments(quantities(gse, inputs))]
        session.pending[gse.id] = round(n) + 1, caller.results(arguments)


def renew(session: Session) -> None:
    """Let discrete states take their next values where the session's time is a sample."""
    for gse in sampled(session):
        if gse.id not in session.pending:
            continue
        n, values = session.pending[gse.id]
        if (session.time - gse.sample_offset) / period_of(session, gse) >= n - AT_SAMPLE:
            session.deck.items[st.Gse][gse.id] = replace(gse, held=values)
            del session.pending[gse.id]
