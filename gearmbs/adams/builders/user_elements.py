"""What routines of the user are to COUPLER, FIELD, CURVE and GSE."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from gearmbs.adams.builders.routine_calls import Caller, Routine, RoutineCall, callable_with_call
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism.user_functions import UserFunction

SAMPLES = 201
"""Points at which a curve by a routine is taken; a cubic spline through them errs by some 1e-9 of a smooth curve."""
LINEAR = 1e-12
"""Deviation from a linear function, of the largest term, below which a coupler is linear."""
SHARE = 0.1
"""Displacement over which a coupler by a routine may change much, of the largest coordinate in the deck."""
DRAWS = 4
"""Places at which implicit equations are asked on which rates they depend."""
PARTS = ("deriv", "output", "update")
"""Parts of a GSE's routines, in the order of INTERFACE."""


def bind_field(deck: Deck, s: st.Field, parameters: tuple[float, ...], found: Mapping[str, Routine]) -> st.Field:
    """FIELD by FIESUB: the six components of what acts on I, in the frame of J."""
    caller = Caller(deck, s, parameters, found[""], 6, {"displacement": 6, "velocity": 6})
    moved = [f"D{axis}({s.i},{s.j},{s.j})" for axis in "XYZ"] + [f"A{axis}({s.i},{s.j})" for axis in "XYZ"]
    rates = [f"V{axis}({s.i},{s.j},{s.j},{s.j})" for axis in "XYZ"] + [f"W{axis}({s.i},{s.j},{s.j})" for axis in "XYZ"]
    texts = caller.texts(deck.functions, f"USER_FIELD_{s.id}", [*moved, *rates])
    return replace(s, function=None, components=tuple(texts))


def bind_curve(
    deck: Deck, s: st.CurveStatement, parameters: tuple[float, ...], found: Mapping[str, Routine]
) -> st.CurveStatement:
    """CURVE by CURSUB: points for parameters from MINPAR to MAXPAR."""
    low = -1.0 if s.minpar is None else s.minpar
    high = 1.0 if s.maxpar is None else s.maxpar
    if not low < high:
        raise ValueError(f"has no range: MINPAR = {low:g}, MAXPAR = {high:g}")
    routine = callable_with_call(found[""])
    rows = []
    for alpha in np.linspace(low, high, SAMPLES):
        call = RoutineCall(s.id, s.label(), parameters, alpha=float(alpha), _deck=deck)
        try:
            point = np.asarray(routine(call), dtype=float)
        except Exception as error:
            # whatever a user's function raises is told with its statement
            raise ValueError(f"fails at alpha = {alpha:g}: {type(error).__name__}: {error}") from error
        if point.shape != (3,) or not np.isfinite(point).all():
            raise ValueError(f"returns {point}; it must return x, y and z")
        rows.append((float(alpha), *(float(v) for v in point)))
    return replace(s, function=None, sampled=tuple(rows))


def gse_parts(s: st.Gse) -> list[tuple[str, list[str]]]:
    """Return the parts of its routines that a GSE needs, each with the names it is looked for under."""
    named = [one.strip("\"' ").rpartition("::")[2].upper() for one in (s.interface or "").split(",")]
    out = []
    for k, (part, size) in enumerate(zip(PARTS, (s.ns, s.no, s.nd))):
        if size:
            own = named[k : k + 1] if named != [""] else []
            out.append((part, [f"{s.label()}.{part}".upper(), *own, f"GSE_{part}".upper()]))
    return out


def bind_gse(deck: Deck, s: st.Gse, parameters: tuple[float, ...], found: Mapping[str, Routine]) -> st.Gse:
    """GSE: rates of its states, outputs, and the next values of its discrete states."""
    inputs = deck.of(st.Array)[s.u].variables if s.u in deck.of(st.Array) else ()
    sizes = {"x": s.ns, "xd": s.nd, "u": len(inputs)}
    counts = dict(zip(PARTS, (s.ns, s.no, s.nd)))
    callers = {}
    for part, routine in found.items():
        more = {"xdot": s.ns} if s.implicit and part == "deriv" else {}
        callers[part] = Caller(deck, s, parameters, routine, counts[part], sizes | more)
    for part in ("deriv", "output"):
        if part in callers:
            # the expressions are put together where the discrete states are known
            given = sum(callers[part].quantities.values())
            callers[part].texts(deck.functions, f"USER_GSE_{s.id}_{part.upper()}", [""] * given)
    held = deck.of(st.Array)[s.icd].numbers if s.icd in deck.of(st.Array) else (0.0,) * s.nd
    rated = _rated(callers["deriv"], s.ns) if s.implicit and s.ns else ()
    return replace(s, function=None, callers=callers, held=tuple(held), rated=rated)


def _rated(caller: Caller, n: int) -> tuple[bool, ...]:
    """Return of each state whether implicit equations depend on its rate, by draws."""
    draw = np.random.default_rng(2)
    sizes = list(caller.quantities.values())
    first = 1 + sum(sizes[:-1])
    found = np.zeros(n, dtype=bool)
    for _ in range(DRAWS):
        arguments = draw.uniform(0.1, 1.0, 1 + sum(sizes) + len(caller.asked))
        before = caller.results(arguments.tolist())
        for k in range(n):
            moved = arguments.copy()
            moved[first + k] += draw.uniform(0.1, 1.0)
            found[k] |= caller.results(moved.tolist()) != before
    return tuple(found.tolist())


def bind_coupler(deck: Deck, s: st.Coupler, parameters: tuple[float, ...], found: Mapping[str, Routine]) -> st.Coupler:
    """COUPLER by COUSUB: what it returns stays zero; a linear function becomes its slopes."""
    n = len(s.joints)
    caller = Caller(deck, s, parameters, found[""], 1, {"q": n})
    if caller.asked:
        raise ValueError(f"asks for {caller.asked[0]}; a coupler depends on the displacements of its joints only")

    def residual(*q: float) -> float:
        return caller.results((0.0, *q))[0]

    places = [f"{{{k}}}" for k in range(n)]
    slopes = _slopes(residual, n)
    if slopes is not None:
        terms = [f"({slope!r})*({place})" for slope, place in zip(slopes, places)]
        return replace(s, function=None, expression=" + ".join([*terms, f"({residual(*[0.0] * n)!r})"]))
    key = f"COUSUB_COUPLER_{s.id}"
    sizes = [_size(deck, ref) for ref in s.joints]
    deck.functions[key] = UserFunction(f"{s.label()}: USER", residual, count=n, sizes=sizes)
    return replace(s, function=None, expression=f"{key}({', '.join(places)})")


def _size(deck: Deck, joint: int) -> float:
    """Return over which displacement of a joint a coupler may change much: a radian, or a share of the model."""
    statement = deck.of(st.Joint).get(joint)
    if statement is None or statement.type not in ("TRANSLATIONAL", "CYLINDRICAL"):
        return 1.0
    places = [abs(v) for part in deck.of(st.Part).values() for v in part.qg]
    places += [abs(v) for marker in deck.of(st.Marker).values() for v in marker.qp]
    return SHARE * (max(places, default=0.0) or 1.0)


def _slopes(residual: Callable[..., float], n: int) -> list[float] | None:
    """Return the slopes of a linear function of several numbers, None of one that is not linear."""
    draw = np.random.default_rng(1)
    try:
        rest = residual(*[0.0] * n)
        slopes = [residual(*[float(i == k) for i in range(n)]) - rest for k in range(n)]
        for q in draw.uniform(-10.0, 10.0, (8, n)):
            terms = [rest, *(slope * one for slope, one in zip(slopes, q))]
            if not abs(residual(*q.tolist()) - sum(terms)) <= LINEAR * max(map(abs, terms)):
                return None
    except (ArithmeticError, ValueError):
        # it has no value everywhere
        return None
    return slopes
