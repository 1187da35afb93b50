"""Sines and cosines of eight angles at a time, which a library computes one after the other."""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, lanes_of, magnitude, put_lanes

# An angle x is n quarter turns and a rest of at most an eighth of a turn. n pi/2 is taken off in two parts, the first
# of which times n is exact; sine and cosine of the rest are polynomials, and quarter turns exchange the two and their
# signs. Errors are at most an ulp of one.
#
# References
# ----------
# .. [1] S. Gal, B. Bachelis, "An accurate elementary mathematical library for the IEEE floating point standard",
#        ACM Trans. Math. Software 17 (1991) 26-45.
# .. [2] W. J. Cody, W. Waite, Software Manual for the Elementary Functions, Prentice-Hall, 1980.


FARTHEST_ANGLE = 1e5
"""Angle, rad, up to which the rest is exact to an ulp of one; the library takes larger ones."""

INTEGER = 6755399441055744.0
"""1.5 2^52: added to a number, it leaves no digits for a fraction."""

QUARTERS = 2.0 / np.pi
HALF_PI = 1.5707963267341256
"""First 33 bits of pi/2: times an n below 2^20 it has no rounding."""
HALF_PI_REST = 6.077100506506192e-11
"""What is left of pi/2, to a double: `pio2_1t` of fdlibm, as `HALF_PI` is its `pio2_1`."""

SINE = (-1.0 / 6.0, 0.008333333333330936, -0.00019841269836740532, 2.7557316093198404e-06,
        -2.5051129896450185e-08, 1.5917988979397432e-10)  # fmt: skip
"""(sin x - x)/x^3 in powers of x^2, interpolated at the Chebyshev points of |x| up to pi/4."""
COSINE = (1.0 / 24.0, -0.0013888888888887389, 2.48015872987544e-05, -2.755731726587808e-07,
          2.087614504941318e-09, -1.138254464534925e-11)  # fmt: skip
"""(cos x - 1 + x^2/2)/x^4 likewise."""


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def sines_and_cosines(angles):
    """Return sines and cosines of angles in lanes, each at most `FARTHEST_ANGLE` in size."""
    turns = (angles * QUARTERS + INTEGER) - INTEGER
    near = angles - turns * HALF_PI
    x = near - turns * HALF_PI_REST
    # what x has lost by rounding
    rest = (near - x) - turns * HALF_PI_REST
    z = x * x
    zz = z * z
    sine = SINE[1] + z * SINE[2] + zz * (SINE[3] + z * SINE[4] + zz * SINE[5])
    sine = x + (z * x * (SINE[0] + z * sine) + rest)
    cosine = z * (COSINE[0] + z * COSINE[1] + zz * (COSINE[2] + z * COSINE[3] + zz * (COSINE[4] + z * COSINE[5])))
    half = 0.5 * z
    most = 1.0 - half
    cosine = most + (((1.0 - most) - half) + (z * cosine - x * rest))
    # the turns modulo four, from -2 to 2, and the cosine and sine of so many
    turns = turns - 4.0 * ((0.25 * turns + INTEGER) - INTEGER)
    size = magnitude(turns)
    along, across = 1.0 - size, turns * (2.0 - size)
    return along * sine + across * cosine, along * cosine - across * sine


@njit(cache=True, error_model="numpy", forceinline=True)
def put_turns(y, first, second, out):
    """Write sines and cosines of two times three angles to lanes 0 and 1 of ``out``, six of the eight of each.

    Parameters
    ----------
    y : ndarray
    first, second : int
        Where in ``y`` the angles, rad, begin.
    out : ndarray
        16 places.
    """
    a, b, c, d, e, f = y[first], y[first + 1], y[first + 2], y[second], y[second + 1], y[second + 2]
    if abs(a) + abs(b) + abs(c) + abs(d) + abs(e) + abs(f) <= FARTHEST_ANGLE:
        sine, cosine = sines_and_cosines(lanes_of(a, b, c, d, e, f, 0.0, 0.0))
        put_lanes(out, 0, sine)
        put_lanes(out, 1, cosine)
        return
    for k in range(3):
        out[k], out[LANES + k] = np.sin(y[first + k]), np.cos(y[first + k])
        out[3 + k], out[LANES + 3 + k] = np.sin(y[second + k]), np.cos(y[second + k])
