"""What follows from the formulas of the contact, against complex steps of them written anew."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.contact.formulas import derived as D
from tests.jets import jets

STEP = 1e-30


def stepped(function, numbers, k):
    """Return the derivative of a function by number k."""
    moved = np.array(numbers, dtype=complex)
    moved[k] += 1j * STEP
    return np.imag(function(*moved)) / STEP


def compared(found, exact):
    assert found == pytest.approx(exact, rel=1e-10, abs=1e-13 * np.max(np.abs(exact)))


X = np.array([0.09, 2e-3, 0.02, -0.03, 0.4, -0.2])
TWIST = np.array([0.3, -0.2, 0.1, 4.0, -3.0, 150.0])
FORCE = np.array([200.0, -30.0, 4.0, -2.0, 7.0, 5.0])


def cosine(x):
    return np.sqrt(1.0 - x[2] * x[2] - x[3] * x[3])


def rates(*numbers):
    """Return x' of the pose numbers a, h, p, q and the twist."""
    x, out = np.array(numbers[:4], dtype=complex), np.zeros(6, dtype=complex)
    D.pose_rates.py_func(x, cosine(x), np.array(numbers[4:]), out)
    return out


def test_derivatives_of_the_rates_of_the_pose():
    numbers = [*X[:4], *TWIST]
    found, columns, turn = np.zeros((6, 4)), np.zeros((6, 6)), np.zeros((3, 6))
    D.pose_rate_slopes.py_func(X, cosine(X), TWIST, found)
    D.pose_columns.py_func(X, cosine(X), columns, turn)
    for k in range(4):
        compared(found[:, k], stepped(rates, numbers, k))
    for k in range(6):
        compared(columns[:, k], stepped(rates, numbers, 4 + k))
    # linear in the twist; M turns half as far as the axes do together
    compared(columns @ TWIST, rates(*numbers).real)
    level = np.zeros((3, 6))
    D.pose_columns.py_func(np.array([0.09, 0.0, 0.0, 0.0]), 1.0, np.zeros((6, 6)), level)
    compared(level[:2, 3:5], 0.5 * np.eye(2))


def wrench(*numbers):
    x, out = np.array(numbers, dtype=complex), np.zeros(6, dtype=complex)
    D.pose_wrench.py_func(x, cosine(x), FORCE, out)
    return out


def test_the_wrench_does_the_work_of_the_force_and_has_exact_derivatives():
    found = np.zeros((6, 4))
    D.pose_wrench_slopes.py_func(X, cosine(X), FORCE, found)
    assert wrench(*X[:4]).real @ TWIST == pytest.approx(FORCE @ rates(*X[:4], *TWIST).real, rel=1e-13)
    for k in range(4):
        compared(found[:, k], stepped(wrench, X[:4], k))


def end(one, two, towards, blend):
    """Return the limit of the common face as a function of the pose, by angles instead of rules."""

    def limit(a, h, p, q, f1, f2):
        length = np.sqrt(a * a - (one + two) ** 2)
        alpha = np.arctan2(length, one + two + 0.0 * a)
        sine, cos = np.sin(alpha), np.cos(alpha)
        roll = 0.5 * (one * f1 - two * f2 + (one - two) * alpha + length)
        x, y = one * cos + roll * sine, roll * cos - one * sine
        w = np.sqrt(1.0 - p * p - q * q)
        ends = [
            (towards * width - sign * (p * x + q * y) - k * p * a) / w - sign * 0.5 * h
            for k, (sign, width) in enumerate(((1.0, 0.0100), (-1.0, 0.0103)))
        ]
        apart = ends[0] - ends[1]
        return 0.5 * (ends[0] + ends[1] - towards * np.sqrt(apart * apart + blend * blend))

    return limit


@pytest.mark.parametrize("towards", [1.0, -1.0])
@pytest.mark.parametrize("blend", [1e-5, 2e-3])
def test_ends_of_the_face_have_exact_derivatives(towards, blend):
    one, two = 0.0402, 0.0476
    numbers = a, h, p, q, f1, f2 = [*X[:4], 0.3, -0.4]
    exact = end(one, two, towards, blend)(*jets(numbers))
    alpha, i_w = np.arccos((one + two) / a), 1.0 / cosine(X)
    length = a * np.sin(alpha)
    sig = 0.5 * (one * f1 - two * f2 + (one - two) * alpha + length)
    widths = (towards * 0.0100, towards * 0.0103)
    first = (a, h, p, q, one, np.sin(alpha), np.cos(alpha), sig, i_w, *widths, towards, blend)
    more = (two, one + two, one - two, length, i_w**3)
    grad, hess = np.zeros(6), np.zeros((6, 6))
    D.end_slopes.py_func(*first, *more, grad)
    D.end_curves.py_func(*first, *more, i_w**5, hess)
    assert D.end_value.py_func(*first) == pytest.approx(exact.value, rel=1e-13)
    compared(grad, exact.gradient)
    compared(hess, exact.hessian)
