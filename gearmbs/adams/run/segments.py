"""From the solution of an analysis to what its results show: ``segment_of``, ``kept_until``."""

from __future__ import annotations

import contextlib
from typing import Any

from gearmbs.adams.builders.model import AdamsModel
from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import Simulate
from gearmbs.adams.results.assembly import assembly_of
from gearmbs.adams.results.record import Segment
from gearmbs.adams.results.requests import RequestEvaluator
from gearmbs.adams.results.tracks import tracks_of
from gearmbs.adams.run.curve_ends import off_the_end
from gearmbs.adams.run.session import Session
from gearmbs.dae.analyses.statics import StaticResult
from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.errors import ModelError
from gearmbs.dae.results.solution import Solution


def segment_of(
    session: Session,
    command: Simulate,
    kind: str,
    model: AdamsModel,
    solution: Solution,
    options: dict[str, Any],
    note: str | None,
    equilibrium: StaticResult | None = None,
) -> tuple[Segment, RequestEvaluator]:
    """Return an analysis with its requests, forces, tracks and variables, and what evaluates more of it.

    Raises
    ------
    DeckError
        If a REQUEST cannot be evaluated.
    """
    evaluator = RequestEvaluator(model, solution)
    segment = Segment(command, kind, model, solution, options, note, equilibrium=equilibrium)
    if kind != "STATICS":
        segment.assembly = assembly_of(model, solution)
    for request in session.deck.of(st.Request).values():
        try:
            segment.requests[request.id] = evaluator.request(request)
        except ExpressionError as error:
            raise DeckError([Diagnostic(ERROR, str(error), session.deck.file, request.line)]) from error
    for kind_id in model.pairs:
        segment.wrenches[kind_id] = evaluator.wrench(*kind_id)[:, :6]
    segment.tracks = tracks_of(model, solution)
    segment.variables = evaluator.variables()
    segment.note = "\n".join(filter(None, [note, *off_the_end(model, solution)])) or None
    return segment, evaluator


def kept_until(
    session: Session, command: Simulate, kind: str, model: AdamsModel | None, error: Exception, options: dict[str, Any]
) -> Segment | None:
    """Return what an analysis computed before a routine of the user failed in it, None where there is nothing."""
    solution = getattr(error, "solution", None)
    if model is None or solution is None or solution.t.size == 0:
        return None
    with contextlib.suppress(ModelError, DeckError, ArithmeticError):
        return segment_of(session, command, kind, model, solution, options, None)[0]
    return None
