"""Scalar operations of the tape with their first and second partial derivatives."""

from __future__ import annotations

import math

import numpy as np

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.loads.time_functions import cubic, smooth_step
from gearmbs.kernels.jit import njit


@njit("UniTuple(float64, 3)(int64, float64, float64)", cache=True, error_model="numpy", nogil=True)
def _piecewise(code, a, p):
    """Return what `unary` does of roundings, steps and powers, which are defined piece by piece."""
    if code == op.AINT:
        return (np.floor(a) if a >= 0.0 else np.ceil(a)), 0.0, 0.0
    if code == op.ANINT:
        return (np.floor(a + 0.5) if a >= 0.0 else np.ceil(a - 0.5)), 0.0, 0.0
    if code == op.STEP01 or code == op.STEP5_01:
        _, f, slope, curvature = smooth_step(a, 1 if code == op.STEP5_01 else 0)
        return f, slope, curvature
    if code == op.HAVERSINE01:
        if a <= 0.0:
            return 0.0, 0.0, 0.0
        if a >= 1.0:
            return 1.0, 0.0, 0.0
        c, s = math.cos(math.pi * a), math.sin(math.pi * a)
        return 0.5 * (1.0 - c), 0.5 * math.pi * s, 0.5 * math.pi * math.pi * c
    if code == op.POSITIVE_PART:
        if a > 0.0:
            return a, 1.0, 0.0
        return 0.0, 0.0, 0.0
    if code == op.UNIT_STEP:
        return (1.0 if a > 0.0 else 0.0), 0.0, 0.0
    if code == op.POWER_INT:
        if p == 0.0:
            return 1.0, 0.0, 0.0
        if p == 1.0:
            return a, 1.0, 0.0
        if p == 2.0:
            return a * a, 2.0 * a, 2.0
        if a == 0.0:
            if p < 0.0:
                return math.inf, -math.inf, math.inf
            return 0.0, 0.0, 0.0
        f = a**p
        return f, p * f / a, p * (p - 1.0) * f / (a * a)
    return math.nan, math.nan, math.nan


@njit("UniTuple(float64, 3)(int64, float64, float64)", cache=True, error_model="numpy", nogil=True)
def unary(code, a, p):
    """Return f(a), f'(a), f''(a) of the one-operand operation ``code``; ``p`` is its constant parameter."""
    if code == op.NEG:
        return -a, -1.0, 0.0
    if code == op.ABS:
        return abs(a), (1.0 if a >= 0.0 else -1.0), 0.0
    if code == op.SQRT:
        if a < 0.0:
            return math.nan, math.nan, math.nan
        f = math.sqrt(a)
        if f == 0.0:
            return 0.0, math.inf, -math.inf
        return f, 0.5 / f, -0.25 / (f * a)
    if code == op.EXP:
        f = math.exp(a)
        return f, f, f
    if code == op.LOG or code == op.LOG10:
        if a <= 0.0:
            return (-math.inf if a == 0.0 else math.nan), math.nan, math.nan
        scale = 1.0 if code == op.LOG else 1.0 / math.log(10.0)
        return scale * math.log(a), scale / a, -scale / (a * a)
    if code == op.SIN:
        s, c = math.sin(a), math.cos(a)
        return s, c, -s
    if code == op.COS:
        s, c = math.sin(a), math.cos(a)
        return c, -s, -c
    if code == op.TAN:
        f = math.tan(a)
        g = 1.0 + f * f
        return f, g, 2.0 * f * g
    if code == op.ASIN or code == op.ACOS:
        if abs(a) > 1.0:
            return math.nan, math.nan, math.nan
        w = 1.0 - a * a
        root = math.sqrt(w)
        first = math.inf if root == 0.0 else 1.0 / root
        second = math.inf if root == 0.0 else a / (w * root)
        if code == op.ASIN:
            return math.asin(a), first, second
        return math.acos(a), -first, -second
    if code == op.ATAN:
        g = 1.0 / (1.0 + a * a)
        return math.atan(a), g, -2.0 * a * g * g
    if code == op.SINH:
        s, c = math.sinh(a), math.cosh(a)
        return s, c, s
    if code == op.COSH:
        s, c = math.sinh(a), math.cosh(a)
        return c, s, c
    if code == op.TANH:
        f = math.tanh(a)
        g = 1.0 - f * f
        return f, g, -2.0 * f * g
    return _piecewise(code, a, p)


@njit("UniTuple(float64, 6)(float64, float64)", cache=True, error_model="numpy", nogil=True)
def _positive_power(a, b):
    """Return a**b with its partials, zero where the base is not positive."""
    if a <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    f = a**b
    la = math.log(a)
    return f, b * f / a, f * la, b * (b - 1.0) * f / (a * a), f / a * (1.0 + b * la), f * la * la


@njit("UniTuple(float64, 6)(float64, float64)", cache=True, error_model="numpy", nogil=True)
def _arctangent(a, b):
    """Return atan2(a, b) with its partials."""
    r2 = a * a + b * b
    if r2 == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    r4 = r2 * r2
    return math.atan2(a, b), b / r2, -a / r2, -2.0 * a * b / r4, (a * a - b * b) / r4, 2.0 * a * b / r4


@njit("UniTuple(float64, 6)(int64, float64, float64)", cache=True, error_model="numpy", nogil=True)
def binary(code, a, b):
    """Return f, f_a, f_b, f_aa, f_ab, f_bb of the two-operand operation ``code``."""
    if code == op.ADD:
        return a + b, 1.0, 1.0, 0.0, 0.0, 0.0
    if code == op.SUB:
        return a - b, 1.0, -1.0, 0.0, 0.0, 0.0
    if code == op.MUL:
        return a * b, b, a, 0.0, 1.0, 0.0
    if code == op.DIV:
        if b == 0.0:
            if a == 0.0 or math.isnan(a):
                return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
            return math.copysign(math.inf, a), math.nan, math.nan, math.nan, math.nan, math.nan
        q = 1.0 / b
        f = a * q
        return f, q, -f * q, 0.0, -q * q, 2.0 * f * q * q
    if code == op.POW:
        if a > 0.0:
            return _positive_power(a, b)
        if b == np.floor(b):
            f, first, second = 1.0, 0.0, 0.0
            if b != 0.0:
                if a == 0.0:
                    f = 0.0 if b > 0.0 else math.inf
                    first = 1.0 if b == 1.0 else 0.0
                    second = 2.0 if b == 2.0 else 0.0
                else:
                    f = a**b
                    first = b * f / a
                    second = b * (b - 1.0) * f / (a * a)
            return f, first, 0.0, second, 0.0, 0.0
        if a == 0.0 and b > 0.0:
            return 0.0, (0.0 if b > 1.0 else math.inf), 0.0, (0.0 if b > 2.0 else math.inf), 0.0, 0.0
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    if code == op.ATAN2:
        return _arctangent(a, b)
    if code == op.HYPOT:
        f = math.hypot(a, b)
        if f == 0.0:
            return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        ca, cb = a / f, b / f
        return f, ca, cb, cb * cb / f, -ca * cb / f, ca * ca / f
    if code == op.MIN:
        if a <= b:
            return a, 1.0, 0.0, 0.0, 0.0, 0.0
        return b, 0.0, 1.0, 0.0, 0.0, 0.0
    if code == op.MAX:
        if a >= b:
            return a, 1.0, 0.0, 0.0, 0.0, 0.0
        return b, 0.0, 1.0, 0.0, 0.0, 0.0
    if code == op.MOD:
        if b == 0.0:
            return math.nan, math.nan, math.nan, 0.0, 0.0, 0.0
        n = a / b
        n = np.floor(n) if n >= 0.0 else np.ceil(n)
        return a - n * b, 1.0, -n, 0.0, 0.0, 0.0
    if code == op.SIGN:
        s = 1.0 if b >= 0.0 else -1.0
        return abs(a) * s, (s if a >= 0.0 else -s), 0.0, 0.0, 0.0, 0.0
    if code == op.DIM:
        if a > b:
            return a - b, 1.0, -1.0, 0.0, 0.0, 0.0
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if code == op.POSITIVE_POWER:
        return _positive_power(a, b)
    return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan


@njit("float64(float64, float64)", cache=True, error_model="numpy", nogil=True)
def unwrap_angle(angle, reference):
    """Return ``angle`` plus the multiple of 2 pi that brings it nearest to ``reference``."""
    two_pi = 2.0 * math.pi
    return angle + two_pi * np.floor((reference - angle) / two_pi + 0.5)


PIECEWISE = frozenset(
    [op.AINT, op.ANINT, op.STEP01, op.STEP5_01, op.HAVERSINE01, op.POSITIVE_PART, op.UNIT_STEP, op.POWER_INT]
)
"""Operations that `unary` hands on."""


def unary_python(code: int, a: float, p: float) -> tuple[float, ...]:
    """Evaluate a one-operand operation on a constant without compiling anything: its value, and some derivatives."""
    if code == op.STEP01:
        return (cubic.py_func(min(max(a, 0.0), 1.0))[0],)
    if code == op.STEP5_01:
        return (smooth_step.py_func(a, 1)[1],)
    return (_piecewise if code in PIECEWISE else unary).py_func(code, a, p)


def binary_python(code: int, a: float, b: float) -> tuple[float, ...]:
    """Evaluate a two-operand operation on constants without compiling anything: its value, and some of its partials."""
    if code == op.POW and not (a > 0.0 or b == math.floor(b) or (a == 0.0 and b > 0.0)):
        return (math.nan,)
    if code in (op.POW, op.POSITIVE_POWER):
        return (a**b if a > 0.0 or code == op.POW else 0.0,)
    if code == op.ATAN2:
        return (math.atan2(a, b),)
    return binary.py_func(code, a, b)
