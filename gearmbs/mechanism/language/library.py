"""The functions of ADAMS's function language, written as operations of the tape."""

from __future__ import annotations

import math
from functools import partial

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.opcodes import NotEvaluatedError
from gearmbs.dae.equations.expressions.tape import Tape, TapeBuilder
from gearmbs.mechanism.language.lowering import (
    BINARY,
    ELEMENT_FORCES,
    UNARY,
    UNSUPPORTED,
    Function,
    Lowering,
)
from gearmbs.mechanism.language.syntax import (
    Call,
    Ref,
    Scope,
    parse,
    shown,
)

EULER_SEQUENCES = ("123", "231", "312", "132", "213", "321", "121", "131", "212", "232", "313", "323")
"""Body-fixed sequences of ORIENT's systems 1 to 12."""
PARALLEL = 1e-8
"""Sine of the angle between the first and the third axis up to which rounding, or the integrator's error, would say how
their turns are divided."""


# ADAMS functions of several arguments: each is a function of the lowering and the call.


def _vector(code: int, dimension: str, axis: int, low: Lowering, call: Call) -> int:
    """DX, VX, WX, ACCX, WDTX (i, j, k, l) and their lengths DM, WM (i, j) and VM, ACCM, WDTM (i, j, l)."""
    last = 2 if axis == op.MAGNITUDE else 3
    i, j = low.marker(call, 0), low.marker(call, 1)
    k = op.GLOBAL if axis == op.MAGNITUDE else low.marker(call, 2)
    l = low.marker(call, last) if dimension in ("velocity", "acceleration") or code == op.ANGULAR_ACCELERATION else -1
    return low.scaled(low.builder.vector(code, i, j, l, k, axis), dimension)


def _radial_velocity(low: Lowering, call: Call) -> int:
    low.marker(call, 2)
    return low.scaled(low.builder.radial_velocity(low.marker(call, 0), low.marker(call, 1)), "velocity")


def _euler(low: Lowering, sequence: str, component: int, i: int, j: int) -> int:
    """Return an angle of a body-fixed sequence from the cosines R[r][c] = axis r of j . axis c of i."""
    b = low.builder
    a, m, c = (int(ch) - 1 for ch in sequence)

    def cosine(row: int, column: int) -> int:
        return b.cosine(i, column, j, row)

    def signed(positive: bool, register: int) -> int:
        return register if positive else b.unary(op.NEG, register)

    third = c if c != a else 3 - a - m
    even = (a, m, third) in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    # the sine of the second angle, or its cosine where the three axes differ
    across = (cosine(m, a), cosine(third, a)) if c == a else (cosine(a, a), cosine(a, m))
    apart = b.binary(op.HYPOT, *across)
    if component == 2:
        return (
            b.binary(op.ATAN2, apart, cosine(a, a)) if c == a else b.binary(op.ATAN2, signed(even, cosine(a, c)), apart)
        )
    if component == 1:
        angle = (
            b.binary(op.ATAN2, across[0], signed(not even, across[1]))
            if c == a
            else b.binary(op.ATAN2, signed(not even, cosine(m, c)), cosine(c, c))
        )
        instead = b.binary(op.ATAN2, signed(even, cosine(third, m)), cosine(m, m))
    else:
        angle = (
            b.binary(op.ATAN2, cosine(a, m), signed(even, cosine(a, third)))
            if c == a
            else b.binary(op.ATAN2, signed(not even, across[1]), across[0])
        )
        instead = b.constant(0.0)
    # where the first and the third axis are parallel, the first angle has the whole turn
    return b.select(b.binary(op.SUB, apart, b.constant(PARALLEL)), instead, instead, angle)


def _sequence_angle(sequence: str, component: int, sign: int, low: Lowering, call: Call) -> int:
    """PSI, THETA, PHI (3-1-3) and YAW, PITCH, ROLL (3-2-1, pitch about the negative y axis)."""
    angle = _euler(low, sequence, component, low.marker(call, 0), low.marker(call, 1))
    return angle if sign > 0 else low.builder.unary(op.NEG, angle)


def _axis_angle(axis: int, low: Lowering, call: Call) -> int:
    """AX, AY, AZ: the turn of marker i about an axis of marker j, counted through full turns."""
    b = low.builder
    i, j = low.marker(call, 0), low.marker(call, 1)
    if axis == 0:
        angle = b.binary(op.ATAN2, b.unary(op.NEG, b.cosine(i, 2, j, 1)), b.cosine(i, 2, j, 2))
    elif axis == 1:
        angle = b.binary(op.ATAN2, b.cosine(i, 2, j, 0), b.cosine(i, 2, j, 2))
    else:
        angle = b.binary(op.ATAN2, b.cosine(i, 0, j, 1), b.cosine(i, 0, j, 0))
    return b.wound(angle, ("AXAYAZ"[2 * axis : 2 * axis + 2], i, j))


def _included_angle(low: Lowering, call: Call) -> int:
    """INCANG(i, j, k): the angle at marker j between the lines to i and to k, 0 to pi."""
    b = low.builder
    i, j, k = (low.marker(call, n) for n in range(3))
    if i == j or k == j:
        low.fail("INCANG needs a vertex apart from the two other markers", call.at)

    def line(end: int) -> list[int]:
        return [b.vector(op.DISPLACEMENT, end, j, -1, op.GLOBAL, axis) for axis in range(3)]

    def product(x: int, y: int) -> int:
        return b.binary(op.MUL, x, y)

    u, v = line(i), line(k)
    dot = b.binary(op.ADD, b.binary(op.ADD, product(u[0], v[0]), product(u[1], v[1])), product(u[2], v[2]))
    cross = [b.binary(op.SUB, product(u[a], v[c]), product(u[c], v[a])) for a, c in ((1, 2), (2, 0), (0, 1))]
    return b.binary(op.ATAN2, b.binary(op.HYPOT, b.binary(op.HYPOT, cross[0], cross[1]), cross[2]), dot)


def _orient(low: Lowering, call: Call) -> int:
    system = low.literal(call, 0, 1, 27)
    i, j = low.marker(call, 2), low.marker(call, 3)
    if system == 27:
        return low.builder.euler_parameter(i, j, low.literal(call, 1, 1, 4) - 1)
    if system > 12:
        low.fail(f"ORIENT's system {system} is not supported; 1 to 12 and 27 are", call.at)
    return _euler(low, EULER_SEQUENCES[system - 1], low.literal(call, 1, 1, 3), i, j)


def _ramp(low: Lowering, call: Call, x: int, x0: int, x1: int) -> int:
    """Return (x - x0)/(x1 - x0)."""
    b = low.builder
    width = b.binary(op.SUB, x1, x0)
    if b.value_of(width) == 0.0:
        low.fail(f"{call.name} needs x1 different from x0", call.at)
    return b.binary(op.DIV, b.binary(op.SUB, x, x0), width)


def _smooth(code: int, low: Lowering, call: Call) -> int:
    """STEP, STEP5, HAVSIN (x, x0, h0, x1, h1) = h0 + (h1 - h0) S((x - x0)/(x1 - x0))."""
    b = low.builder
    x, x0, h0, x1, h1 = low.values(call)
    s = b.unary(code, _ramp(low, call, x, x0, x1))
    return b.binary(op.ADD, h0, b.binary(op.MUL, b.binary(op.SUB, h1, h0), s))


def _contact(low: Lowering, penetration: int, rate: int, k: int, e: int, c: int, d: int) -> int:
    """Return max(0, k p^e + c p' S(p/d)) for p > 0, else 0, with ``rate`` = p'."""
    b = low.builder
    elastic = b.binary(op.MUL, k, b.binary(op.POSITIVE_POWER, penetration, e))
    if b.value_of(d) == 0.0:
        step = b.unary(op.UNIT_STEP, penetration)
    else:
        step = b.unary(op.STEP01, b.binary(op.DIV, penetration, d))
    damping = b.binary(op.MUL, b.binary(op.MUL, c, rate), step)
    return b.unary(op.POSITIVE_PART, b.binary(op.ADD, elastic, damping))


def _impact(low: Lowering, call: Call) -> int:
    """IMPACT(q, q', q1, k, e, cmax, d): a one-sided stop for q < q1."""
    q, rate, q1, k, e, c, d = low.values(call)
    b = low.builder
    return _contact(low, b.binary(op.SUB, q1, q), b.unary(op.NEG, rate), k, e, c, d)


def _bistop(low: Lowering, call: Call) -> int:
    """BISTOP(q, q', q1, q2, k, e, cmax, d): free between q1 and q2."""
    q, rate, q1, q2, k, e, c, d = low.values(call)
    b = low.builder
    lower = _contact(low, b.binary(op.SUB, q1, q), b.unary(op.NEG, rate), k, e, c, d)
    upper = _contact(low, b.binary(op.SUB, q, q2), rate, k, e, c, d)
    return b.binary(op.SUB, lower, upper)


def _if(low: Lowering, call: Call) -> int:
    return low.builder.select(*low.values(call))


def _extreme(code: int, low: Lowering, call: Call) -> int:
    result, *rest = low.values(call)
    for other in rest:
        result = low.builder.binary(code, result, other)
    return result


def _poly(low: Lowering, call: Call) -> int:
    """POLY(x, x0, a0, a1, ...) by Horner's rule."""
    b = low.builder
    x, x0, *coefficients = low.values(call)
    u = b.binary(op.SUB, x, x0)
    total = coefficients[-1]
    for a in reversed(coefficients[:-1]):
        total = b.binary(op.ADD, a, b.binary(op.MUL, u, total))
    return total


def _cheby(low: Lowering, call: Call) -> int:
    """CHEBY(x, x0, a0, a1, ...) = sum a_j T_j(x - x0)."""
    b = low.builder
    x, x0, *coefficients = low.values(call)
    u = b.binary(op.SUB, x, x0)
    twice = b.binary(op.MUL, b.constant(2.0), u)
    previous, current = b.constant(1.0), u
    total = coefficients[0]
    for a in coefficients[1:]:
        total = b.binary(op.ADD, total, b.binary(op.MUL, a, current))
        previous, current = current, b.binary(op.SUB, b.binary(op.MUL, twice, current), previous)
    return total


def _fourier(code: int, low: Lowering, call: Call) -> int:
    """FORCOS, FORSIN(x, x0, w, a0, a1, ...) = a0 + sum a_j cos|sin(j w (x - x0))."""
    b = low.builder
    x, x0, w, *coefficients = low.values(call)
    u = b.binary(op.MUL, w, b.binary(op.SUB, x, x0))
    total = coefficients[0]
    for j, a in enumerate(coefficients[1:], 1):
        wave = b.unary(code, b.binary(op.MUL, b.constant(float(j)), u))
        total = b.binary(op.ADD, total, b.binary(op.MUL, a, wave))
    return total


def _shf(low: Lowering, call: Call) -> int:
    """SHF(x, x0, a, w, phi, b) = a sin(w (x - x0) - phi) + b."""
    b = low.builder
    values = low.values(call) + [b.constant(0.0)]
    x, x0, a, w, phi, offset = values[:6]
    u = b.binary(op.SUB, b.binary(op.MUL, w, b.binary(op.SUB, x, x0)), phi)
    return b.binary(op.ADD, b.binary(op.MUL, a, b.unary(op.SIN, u)), offset)


def _sweep(low: Lowering, call: Call) -> int:
    """SWEEP(x, a, x0, f0, x1, f1, dx): the phase f0 x + (f1 - f0)(<x - x0>^2 - <x - x1>^2)/(2(x1 - x0)) in cycles."""
    b = low.builder
    x, a, x0, f0, x1, f1, dx = low.values(call)
    width = b.binary(op.SUB, x1, x0)
    if b.value_of(width) == 0.0 or b.value_of(dx) == 0.0:
        low.fail("SWEEP needs x1 different from x0 and dx greater than 0", call.at)
    squares = [b.unary(op.POWER_INT, b.unary(op.POSITIVE_PART, b.binary(op.SUB, x, v)), 2) for v in (x0, x1)]
    ramp = b.binary(op.DIV, b.binary(op.SUB, *squares), b.binary(op.MUL, b.constant(2.0), width))
    cycles = b.binary(op.ADD, b.binary(op.MUL, f0, x), b.binary(op.MUL, b.binary(op.SUB, f1, f0), ramp))
    wave = b.unary(op.SIN, b.binary(op.MUL, b.constant(2.0 * math.pi), cycles))
    fade = b.unary(op.STEP5_01, b.binary(op.DIV, b.binary(op.SUB, x, x0), dx))
    return b.binary(op.MUL, b.binary(op.MUL, a, wave), fade)


def _spline(method: str, low: Lowering, call: Call) -> int:
    """CUBSPL, AKISPL(x, z, id, order)."""
    ref = low.ref(call.args[2])
    if ref not in low.scope.splines:
        low.fail(f"there is no SPLINE {ref}", call.args[2].at)
    data = low.scope.splines[ref]
    order = low.literal(call, 3, 0, 2, 0)
    if order and len(data.y) > 1:
        low.fail(f"SPLINE {ref} is a surface; {call.name} gives derivatives of single curves only", call.at)
    return low.builder.spline(data, method, order, low.node(call.args[0]), low.node(call.args[1]))


def _integral(low: Lowering, call: Call) -> int:
    """INTEGRAL(f, start, end): the integral of a function of TIME from ``start``; no function of ADAMS.

    ``end`` says how far it is tabulated beforehand.
    """
    b = low.builder
    value, *span = low.values(call)
    start, end = (b.value_of(r) for r in span)
    if start is None or end is None:
        low.fail("the span of INTEGRAL must be constant", call.at)
    seconds = low.scope.units.time
    return b.binary(op.DIV, b.integral(value, start * seconds, end * seconds), b.constant(seconds))


def _variable(low: Lowering, call: Call, ref: Ref | None = None) -> int:
    ref = low.ref(call.args[0]) if ref is None else ref
    if ref in low.scope.states:
        return low.builder.algebraic(("variable", ref))
    if ref not in low.scope.variables:
        low.fail(f"there is no VARIABLE {ref}", call.args[0].at)
    return low.inline("variable", ref, low.scope.variables[ref], call.at)


def _diff(low: Lowering, call: Call) -> int:
    ref = low.ref(call.args[0])
    if ref not in low.scope.diffs:
        low.fail(f"there is no DIFF {ref}", call.args[0].at)
    return low.builder.algebraic(("diff", ref))


def _diff_rate(low: Lowering, call: Call) -> int:
    ref = low.ref(call.args[0])
    if ref not in low.scope.diffs:
        low.fail(f"there is no DIFF {ref}", call.args[0].at)
    text = low.scope.diffs[ref]
    if text is None:
        return low.scaled(low.builder.algebraic(("diff1", ref)), "rate")
    return low.inline("diff", ref, text, call.at)


def _modal(rate: bool, low: Lowering, call: Call) -> int:
    """MODAL(body, k), MODAL1(body, k): the k-th modal coordinate of a body and its rate; no functions of ADAMS."""
    ref = low.ref(call.args[0])
    if ref not in low.scope.modes:
        known = ", ".join(str(name) for name in low.scope.modes) or "none"
        low.fail(f"there is no body {ref} with modes; those with modes: {known}", call.args[0].at)
    key = ("mode1" if rate else "mode", ref, low.literal(call, 1, 1, low.scope.modes[ref]) - 1)
    found = low.builder.algebraic(key)
    return low.scaled(found, "rate") if rate else found


def _cosine(low: Lowering, call: Call) -> int:
    """COSINE(i, a, j, b): of the angle between axis a of marker i and axis b of marker j, 1 to 3; none of ADAMS."""
    i, a = low.marker(call, 0), low.literal(call, 1, 1, 3) - 1
    return low.builder.cosine(i, a, low.marker(call, 2), low.literal(call, 3, 1, 3) - 1)


def _array(low: Lowering, call: Call) -> int:
    ref = low.ref(call.args[0])
    if ref not in low.scope.arrays:
        low.fail(f"there is no ARRAY {ref} of numbers", call.args[0].at)
    values = low.scope.arrays[ref]
    return low.builder.constant(float(values[low.literal(call, 1, 1, len(values)) - 1]))


def _plant(kind: str, low: Lowering, call: Call) -> int:
    ref = low.ref(call.args[0])
    if (kind, ref) not in low.scope.plants:
        low.fail(f"there is no {kind.upper()} {ref}", call.args[0].at)
    members = low.scope.plants[kind, ref]
    return _variable(low, call, members[low.literal(call, 1, 1, len(members)) - 1])


def _between(torque: bool, axis: int, low: Lowering, call: Call) -> int:
    return low.force_between(call, torque, axis)


def _table() -> dict[str, Function]:
    functions: dict[str, Function] = {}
    vectors = (
        ("D", "", op.DISPLACEMENT, "length", 3),
        ("V", "", op.VELOCITY, "velocity", 4),
        ("W", "", op.ANGULAR_VELOCITY, "angular_velocity", 3),
        ("ACC", "", op.ACCELERATION, "acceleration", 4),
        ("WDT", "", op.ANGULAR_ACCELERATION, "angular_acceleration", 4),
    )
    for prefix, _, code, dimension, most in vectors:
        for axis, letter in enumerate("XYZ"):
            functions[prefix + letter] = (partial(_vector, code, dimension, axis), 1, most)
        functions[prefix + "M"] = (partial(_vector, code, dimension, op.MAGNITUDE), 1, most - 1)
    for axis, letter in enumerate("XYZ"):
        functions["A" + letter] = (partial(_axis_angle, axis), 1, 2)
        functions["F" + letter] = (partial(_between, False, axis), 1, 3)
        functions["T" + letter] = (partial(_between, True, axis), 1, 3)
    functions["FM"] = (partial(_between, False, op.MAGNITUDE), 1, 2)
    functions["TM"] = (partial(_between, True, op.MAGNITUDE), 1, 2)
    for component, (euler, cardan) in enumerate((("PSI", "YAW"), ("THETA", "PITCH"), ("PHI", "ROLL")), 1):
        functions[euler] = (partial(_sequence_angle, "313", component, 1), 1, 2)
        functions[cardan] = (partial(_sequence_angle, "321", component, -1 if component == 2 else 1), 1, 2)
    for name, code in (("STEP", op.STEP01), ("STEP5", op.STEP5_01), ("HAVSIN", op.HAVERSINE01)):
        functions[name] = (partial(_smooth, code), 5, 5)
    for name, method in (("CUBSPL", "cubic"), ("AKISPL", "akima")):
        functions[name] = (partial(_spline, method), 3, 4)
    functions |= {
        "VR": (_radial_velocity, 1, 3),
        "ORIENT": (_orient, 3, 4),
        "COSINE": (_cosine, 4, 4),
        "INCANG": (_included_angle, 3, 3),
        "IMPACT": (_impact, 7, 7),
        "BISTOP": (_bistop, 8, 8),
        "IF": (_if, 4, 4),
        "MIN": (partial(_extreme, op.MIN), 2, 60),
        "MAX": (partial(_extreme, op.MAX), 2, 60),
        "POLY": (_poly, 3, 33),
        "CHEBY": (_cheby, 3, 33),
        "FORCOS": (partial(_fourier, op.COS), 4, 34),
        "FORSIN": (partial(_fourier, op.SIN), 4, 34),
        "SHF": (_shf, 5, 6),
        "SWEEP": (_sweep, 7, 7),
        "INTEGRAL": (_integral, 3, 3),
        "VARVAL": (_variable, 1, 1),
        "DIF": (_diff, 1, 1),
        "DIF1": (_diff_rate, 1, 1),
        "MODAL": (partial(_modal, False), 2, 2),
        "MODAL1": (partial(_modal, True), 2, 2),
        "ARYVAL": (_array, 2, 2),
        "PINVAL": (partial(_plant, "pinput"), 2, 2),
        "POUVAL": (partial(_plant, "poutput"), 2, 2),
    }
    return functions


FUNCTIONS = _table()
"""Name -> (function, least, most number of arguments)."""


def known_functions() -> frozenset[str]:
    """Return the names of all functions of the language, those that are not evaluated here among them."""
    return frozenset((*UNARY, *BINARY, *ELEMENT_FORCES, *FUNCTIONS, *UNSUPPORTED))


# From a function expression to a tape: ``compile_expression``.


def compile_expression(
    text: str, scope: Scope, dimension: str = "number", accelerations: bool = False, outline: bool = False
) -> Tape:
    """Compile a function expression to a tape that returns SI values.

    Parameters
    ----------
    text : str
        The expression, in the units of ``scope.units``.
    scope : Scope
    dimension : str
        What the value is ("force", "torque", "length", "angle", ...): its unit is converted to SI.
    accelerations : bool
        Allow ACCX, WDTX and their kin: only requests know accelerations.
    outline : bool
        Leave integrals without their tables: the tape shows what the expression depends on and is not to be evaluated.

    Returns
    -------
    Tape

    Raises
    ------
    ExpressionError
        When the text is malformed or names something the scope does not hold.
    """
    builder = TapeBuilder(scope.marker_body, outline)
    lowering = Lowering(builder, scope, text, FUNCTIONS)
    result = lowering.whole(parse(text))
    factor = scope.units.factors[dimension]
    if factor != 1.0:
        result = builder.binary(op.MUL, builder.constant(factor), result)
    tape = builder.finish(result, text)
    if tape.level == op.LEVEL_ACCELERATION and not accelerations:
        raise NotEvaluatedError(
            f"accelerations can be measured, and forces and equations of a deck may ask for them, not {shown(text)}"
        )
    return tape
