"""An expression of TIME alone, with its first and second derivative: a Taylor series carried through the tape."""

from __future__ import annotations

import math

from gearmbs._jit import njit
from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.evaluate import TABLES, selected
from gearmbs.dae.equations.expressions.external import external
from gearmbs.dae.equations.expressions.integrals import integral
from gearmbs.dae.equations.expressions.scalar import binary, unary
from gearmbs.dae.equations.expressions.splines import spline_value


@njit(f"void({TABLES}, float64, float64[::1], float64[::1])", cache=True, nogil=True, error_model="numpy")
def eval_time(ints, floats, t, out, work):
    """Write f, f', f'' of an expression of TIME alone to ``out[0:3]``."""
    n = ints[op.HEAD_COUNT]
    at = ints[op.HEAD_CODE]
    for k in range(n):
        code = ints[at]
        f, f1, f2 = math.nan, math.nan, math.nan
        if code == op.CONST:
            f, f1, f2 = floats[ints[at + 1]], 0.0, 0.0
        elif code == op.TIME:
            f, f1, f2 = t, 1.0, 0.0
        elif op.FIRST_UNARY <= code <= op.LAST_UNARY:
            a = ints[at + 1]
            d = (0.0, 0.0, 0.0) if code == op.INTEGRAL else unary(code, work[a], float(ints[at + 2]))
            f = d[0]
            f1 = f2 = 0.0
            if code == op.INTEGRAL:
                f = integral(ints, floats, t, a, ints[at + 2], work[work.size - ints[op.HEAD_EXTERNAL] - n :])
                f1, f2 = work[a], work[n + a]
            elif work[n + a] != 0.0 or work[2 * n + a] != 0.0:
                f1 = d[1] * work[n + a]
                f2 = d[2] * work[n + a] ** 2 + d[1] * work[2 * n + a]
        elif op.FIRST_BINARY <= code <= op.LAST_BINARY:
            a, b = ints[at + 1], ints[at + 2]
            if code == op.SPLINE:
                e = spline_value(floats, ints[at + 3], ints[at + 4], work[a], work[b])
            else:
                e = binary(code, work[a], work[b])
            a1, a2, b1, b2 = work[n + a], work[2 * n + a], work[n + b], work[2 * n + b]
            f = e[0]
            f1 = f2 = 0.0
            if a1 != 0.0 or a2 != 0.0:
                f1 += e[1] * a1
                f2 += e[3] * a1 * a1 + e[1] * a2
            if b1 != 0.0 or b2 != 0.0:
                f1 += e[2] * b1
                f2 += e[5] * b1 * b1 + e[2] * b2
            if a1 != 0.0 and b1 != 0.0:
                f2 += 2.0 * e[4] * a1 * b1
        elif code == op.EXTERNAL:
            # of time alone, its first argument
            f = external(ints, at, t, op.FIRST_SECOND, work)
            a = ints[ints[at + 1]]
            first = work.size - ints[op.HEAD_EXTERNAL] + ints[at + 3] + ints[at + 2] + 1
            f1 = work[first] * work[n + a]
            f2 = work[first + 1] * work[n + a] ** 2 + work[first] * work[2 * n + a]
        elif code == op.SELECT:
            s = selected(ints, at, work)
            f, f1, f2 = work[s], work[n + s], work[2 * n + s]
        work[k], work[n + k], work[2 * n + k] = f, f1, f2
        at += op.WIDTH
    r = ints[op.HEAD_RESULT]
    out[0], out[1], out[2] = work[r], work[n + r], work[2 * n + r]
