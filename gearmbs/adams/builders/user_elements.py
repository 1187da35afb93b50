"""What routines of the user are to COUPLER, FIELD, CURVE and GSE."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from gearmbs.adams.builders.routine_calls import Caller, Routine, RoutineCall
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck

SAMPLES = 201
"""Points at which a curve by a routine is taken; a cubic spline through them errs by some 1e-9 of a smooth curve."""
SEPARATE = 1e-9
"""Mixed difference, of the values, below which a coupler's displacements stand in separate terms."""
NEWTON = 50
TABLE = 16_000
"""Points of a coupler's term on either side of zero."""
ANGLE = 0.02
"""Their distance for a rotation, rad: fifty turns to either side, and a spline that errs by 4e-10 of a sine."""
SHARE = 1e-3
"""Their distance for a translation, of the largest coordinate in the deck."""
LINEAR = 1e-12
"""Spread of slopes, of the largest, below which a term is linear."""
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
    rows = []
    for alpha in np.linspace(low, high, SAMPLES):
        call = RoutineCall(s.id, s.label(), parameters, alpha=float(alpha), _deck=deck)
        point = np.asarray(found[""](call), dtype=float)
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
    """COUPLER by COUSUB: what it returns stays zero.

    Displacements in separate terms, f1(q1) + f2(q2) + ... = 0, stay so; else the second one is solved for. A term that
    is not linear becomes a cubic spline through TABLE points on either side.
    """
    n = len(s.joints)
    caller = Caller(deck, s, parameters, found[""], 1, {"q": n})
    if caller.asked:
        raise ValueError(f"asks for {caller.asked[0]}; a coupler depends on the displacements of its joints only")

    def residual(*q: float) -> float:
        return caller.results((0.0, *q))[0]

    constant = 0.0
    terms: list[Callable[[float], float]]
    if _separate(residual, n):
        constant = residual(*[0.0] * n)
        terms = [_alone(residual, n, k, constant) for k in range(n)]
    elif n == 2:
        terms = [_solved(residual), lambda q: -q]
    else:
        raise ValueError("mixes three displacements; write it as a sum of functions of one displacement each")
    tables = tuple(_table(term, _step(deck, ref)) for term, ref in zip(terms, s.joints))
    return replace(s, function=None, tables=tables, constant=constant)


def _step(deck: Deck, joint: int) -> float:
    """Return the distance of a table's points: an angle, or a share of the model's extent."""
    statement = deck.of(st.Joint).get(joint)
    if statement is None or statement.type != "TRANSLATIONAL":
        return ANGLE
    places = [abs(v) for part in deck.of(st.Part).values() for v in part.qg]
    places += [abs(v) for marker in deck.of(st.Marker).values() for v in marker.qp]
    return SHARE * (max(places, default=0.0) or 1.0)


def _table(term: Callable[[float], float], step: float) -> tuple[tuple[float, ...], ...]:
    """Return displacements and values of a term, or its slope alone if it is linear."""
    probes = step * np.array([-TABLE, -0.37 * TABLE, -1.0, 1.0, 0.61 * TABLE, TABLE])
    try:
        slopes = np.array([term(q) / q for q in probes])
        if np.ptp(slopes) <= LINEAR * np.abs(slopes).max():
            return ((float(slopes[-1]),),)
    except (ArithmeticError, ValueError):
        # it has no value everywhere
        pass
    sides = []
    for sign in (-1.0, 1.0):
        side: list[tuple[float, float]] = []
        for k in range(TABLE + 1):
            try:
                value = float(term(sign * k * step))
            except (ArithmeticError, ValueError):
                break
            if not np.isfinite(value):
                break
            side.append((sign * k * step, value))
        sides.append(side)
    points = sides[0][:0:-1] + sides[1]
    if len(points) < 4:
        raise ValueError("has no value near the joints' zero displacement")
    return tuple(q for q, _ in points), tuple(value for _, value in points)


def _separate(residual: Callable[..., float], n: int) -> bool:
    """Whether a function of several numbers is a sum of functions of one each, by mixed differences."""
    draw = np.random.default_rng(1)
    for _ in range(8):
        a, b = draw.uniform(-1.0, 1.0, (2, n))
        for i in range(n):
            for j in range(i):
                corners = [np.array(a) for _ in range(4)]
                corners[1][i] = corners[3][i] = b[i]
                corners[2][j] = corners[3][j] = b[j]
                values = [residual(*corner) for corner in corners]
                if abs(values[0] - values[1] - values[2] + values[3]) > SEPARATE * max(1e-30, *map(abs, values)):
                    return False
    return True


def _alone(residual: Callable[..., float], n: int, k: int, rest: float) -> Callable[[float], float]:
    def term(q: float) -> float:
        return residual(*[q if i == k else 0.0 for i in range(n)]) - rest

    return term


def _solved(residual: Callable[..., float]) -> Callable[[float], float]:
    """Return the second displacement as a function of the first, by Newton's method from the last one found."""
    last = [0.0]

    def second(first: float) -> float:
        q = last[0]
        for _ in range(NEWTON):
            value = residual(first, q)
            h = 1e-6 * max(1.0, abs(q))
            slope = (residual(first, q + h) - residual(first, q - h)) / (2.0 * h)
            if slope == 0.0:
                break
            change = value / slope
            q -= change
            if abs(change) <= 1e-14 * max(1.0, abs(q)):
                last[0] = q
                return q
        raise ValueError(f"has no zero for the first displacement {first:g}")

    return second
