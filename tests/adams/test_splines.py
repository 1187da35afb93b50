"""CUBSPL and AKISPL of decks, with their derivatives, against splines of scipy."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import Akima1DInterpolator, make_interp_spline

from gearmbs.adams import parse_deck, run_deck

X = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.7, 1.0])
Y = np.array([1.0, -2.0, 3.0, 0.5, 0.2, -1.0, 4.0])
Z = np.array([2.0, 0.0, 1.0, -3.0, 2.0, 1.0, 0.0])
DECK = """splines
UNITS/SYSTEM=MKS
PART/1, GROUND
PART/2, MASS=1, CM=20, IP=1,1,1
MARKER/20, PART=2
SPLINE/1, LINEAR_EXTRAPOLATE, X={x}, Y={y}
SPLINE/2, X={x}, Y=0,{y}, Y=1,{z}
REQUEST/1, F2=CUBSPL({at},0,1)\\F3=CUBSPL({at},0,1,1)\\F4=CUBSPL({at},0,1,2)\\F6=AKISPL({at},0,1)\\F7=AKISPL({at},0,1,1)
REQUEST/2, F2=CUBSPL(TIME,0.3,2)\\F3=AKISPL({at},0,1,2)
END
"""


def cubic(y):
    """The spline whose third derivative at each end is that of the cubic through the four points there."""
    ends = [[(3, 6.0 * np.polyfit(X[some], y[some], 3)[0])] for some in (slice(0, 4), slice(-4, None))]
    return make_interp_spline(X, y, k=3, bc_type=tuple(ends))


def test_values_and_derivatives():
    lists = {name: ",".join(map(str, values)) for name, values in (("x", X), ("y", Y), ("z", Z))}
    result = run_deck(parse_deck(DECK.format(at="1.4*TIME-0.2", **lists)), end=1.0, steps=50)
    u = 1.4 * result.t - 0.2
    inside = (u >= 0.0) & (u <= 1.0)
    first, second = result.request(1), result.request(2)
    smooth, local = cubic(Y), Akima1DInterpolator(X, Y)
    for order, column in enumerate((1, 2, 3)):
        np.testing.assert_allclose(first[inside, column], smooth(u[inside], order), atol=1e-10)
    for order, values in enumerate((first[:, 5], first[:, 6], second[:, 2])):
        np.testing.assert_allclose(values[inside], local(u[inside], order), atol=1e-10)
    np.testing.assert_allclose(second[:, 1], cubic(0.7 * Y + 0.3 * Z)(result.t), atol=1e-12)
    # beyond the ends their tangents
    low, high = u < 0.0, u > 1.0
    np.testing.assert_allclose(first[low, 1], Y[0] + smooth(0.0, 1) * u[low], atol=1e-12)
    np.testing.assert_allclose(first[high, 1], Y[-1] + smooth(1.0, 1) * (u[high] - 1.0), atol=1e-12)
