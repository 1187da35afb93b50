"""What a written deck asks for: REQUESTs, the files of results, the integrator."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from gearmbs.adams.write.context import WriterContext
from gearmbs.adams.write.text import number
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.expression_functions import ELEMENT_FORCES

COLUMNS = ("F2", "F3", "F4", "F6", "F7", "F8")
"""Columns of a request that the .req file contains."""
LONGEST = 80
"""Characters of a comment in the .req."""
NOT_ASKED = ("coupler", "gear")
"""Elements whose forces are those of their joints."""
METHODS = ("GSTIFF", "WSTIFF")
FORMULATIONS = ("I3", "SI2", "SI1")


def request_statements(writer: WriterContext, requests: Mapping[str, str | Sequence[str]], all_of_them: bool) -> None:
    """Write the requests a user asks for, then those of all bodies and elements.

    Raises
    ------
    ModelError
        For more than six expressions in a request.
    """
    texts: list[tuple[list[str], str]] = []
    for name, given in requests.items():
        expressions = [given] if isinstance(given, str) else list(given)
        if not 1 <= len(expressions) <= len(COLUMNS):
            raise ModelError(f"request '{name}': it holds 1 to {len(COLUMNS)} expressions, got {len(expressions)}")
        texts.append(([writer.expression(e) for e in expressions], name))
    for n, (expressions, name) in enumerate(texts, 1):
        _functions(writer, n, expressions, name)
    if all_of_them:
        _bodies_and_elements(writer, len(texts) + 1)


def _functions(writer: WriterContext, n: int, expressions: list[str], comment: str) -> None:
    columns = [f"{c} = {text}\\" for c, text in zip(COLUMNS, expressions)]
    writer.statement(f"REQUEST/{n}", [*columns, f"COMMENT = {_plain(comment)}"], comment)


def _bodies_and_elements(writer: WriterContext, n: int) -> None:
    for body in writer.mechanism.bodies.values():
        for kind in ("DISPLACEMENT", "VELOCITY"):
            comment = f"COMMENT = {_plain(f'{body.name} {kind.lower()}')}"
            writer.statement(f"REQUEST/{n}", [kind, f"I = {writer.centers[id(body)]}", comment])
            n += 1
    functions = {kind: function for function, kind in ELEMENT_FORCES.items() if kind not in NOT_ASKED}
    for (kind, name), number_ in writer.elements.items():
        if kind in functions:
            texts = [f"{functions[kind]}({number_}, 0, {c}, 0)" for c in (2, 3, 4, 6, 7, 8)]
            _functions(writer, n, texts, f"{name} force")
            n += 1


def integrator_statement(
    writer: WriterContext, integrator: str | None, formulation: str, tol: float | None, max_step: float | None
) -> None:
    """Write INTEGRATOR when any of its settings is given.

    Raises
    ------
    ModelError
        For a method or formulation that ADAMS does not have.
    """
    if integrator is None and tol is None and max_step is None:
        return
    method = (integrator or "GSTIFF").upper()
    for word, value, known in (("integrator", method, METHODS), ("formulation", formulation, FORMULATIONS)):
        if value not in known:
            raise ModelError(f"{word} = {value!r}: choose one of {', '.join(known)} for a deck")
    arguments = [method, formulation]
    if tol is not None:
        arguments.append(f"ERROR = {number(tol)}")
    if max_step is not None:
        arguments.append(f"HMAX = {number(max_step / writer.units.time)}")
    writer.statement("INTEGRATOR/", arguments)


def _plain(text: str) -> str:
    """Return a text without characters that mean something in a deck."""
    return re.sub(r"[^\w .:()+-]+", " ", text).strip()[:LONGEST] or "request"
