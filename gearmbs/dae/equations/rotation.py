"""Rotations by body-fixed 3-1-3 Euler angles, with a switchable body reference.

A body's orientation is ``A = Az(psi) Ax(theta) Az(phi) S^T`` where S is one of two constant
rotations, selected by the body's *reference code*: the identity, or a quarter turn about x.  The
angles are singular where sin(theta) = 0; that never happens for both references at once, so a body
whose angles come near the singularity changes its code and no orientation is out of reach.

With the rotation axes a_1 = z, a_2 = line of nodes, a_3 = S z in global components, all that the
equations need follows from one rule: an axis is turned by the angles before it,

    da_k/dtheta_l = a_l x a_k  for l < k, else 0,

hence for a body-fixed vector s: ds/dtheta_k = a_k x s and
d2s/dtheta_k dtheta_l = a_min x (a_max x s).

Sines and cosines are computed for eight angles at a time, which a library computes one after the other.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.expressions.opcodes import KIN_A, KIN_R, KIN_V, KIN_W
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, lanes_of, magnitude, put_lanes

KIN_AXES = 18
"""Columns of the kinematics table with the three Euler axes, global components."""
KIN_DW = 27
"""Columns with d(omega)/d(theta_k) at fixed Euler rates."""
KIN_ADOT = 36
"""Columns with the time derivatives of the three Euler axes."""
KIN_H = 45
"""Columns with the angular momentum about the centre of mass."""
KIN_FORCE = 48
"""Columns in which the residual adds up what constraints and loads exert on a body: the force that enters M u' and the
moment about the centre of mass, less those applied; global components."""
KIN_MOMENT = 51
KIN_SHIFT = 54
"""Columns in which it adds up the displacements Phi_R^T mu and, as a spatial rotation, Phi_pi^T mu of eq. (6)."""
KIN_TURN = 57
KIN_COLUMNS = 60

POSE_R = 0
"""Columns of a record of a body's pose: position of the centre of mass, orientation (row-major), velocities."""
POSE_A = 3
POSE_V = 12
POSE_W = 15
POSE_COLUMNS = 18

REFERENCE_IDENTITY = 0
REFERENCE_QUARTER_TURN = 1
SWITCH_SINE = 0.5
"""Below this |sin(theta)| the other reference is at least sqrt(3)/2 away from its singularity."""


@njit(
    "void(float64, float64, float64, float64, float64, float64, float64[::1], int64)", cache=True, error_model="numpy"
)
def cross_into(ax, ay, az, bx, by, bz, out, k):
    """Write a x b to ``out[k:]``.

    Parameters
    ----------
    ax, ay, az, bx, by, bz : float
        Components of a and b.
    out : ndarray
        Receives the three components.
    k : int
        Where the first is written.
    """
    out[k] = ay * bz - az * by
    out[k + 1] = az * bx - ax * bz
    out[k + 2] = ax * by - ay * bx


@njit(cache=True, error_model="numpy", forceinline=True)
def matrix_of(turn_1, turn_2, turn_3, code, out, k):
    """Write A (row-major) to ``out[k:k+9]`` from cosine and sine of each of the three angles."""
    c1, s1 = turn_1
    c2, s2 = turn_2
    c3, s3 = turn_3
    xx, xy, xz = c1 * c3 - s1 * c2 * s3, -c1 * s3 - s1 * c2 * c3, s1 * s2
    yx, yy, yz = s1 * c3 + c1 * c2 * s3, -s1 * s3 + c1 * c2 * c3, -c1 * s2
    zx, zy, zz = s2 * s3, s2 * c3, c2
    if code == REFERENCE_IDENTITY:
        out[k], out[k + 1], out[k + 2] = xx, xy, xz
        out[k + 3], out[k + 4], out[k + 5] = yx, yy, yz
        out[k + 6], out[k + 7], out[k + 8] = zx, zy, zz
    else:
        out[k], out[k + 1], out[k + 2] = xx, -xz, xy
        out[k + 3], out[k + 4], out[k + 5] = yx, -yz, yy
        out[k + 6], out[k + 7], out[k + 8] = zx, -zz, zy


@njit("void(float64, float64, float64, int64, float64[::1], int64)", cache=True, error_model="numpy")
def rotation_matrix(psi, theta, phi, code, out, k):
    """Write A (row-major) of the 3-1-3 angles and the reference code to ``out[k:k+9]``."""
    matrix_of((np.cos(psi), np.sin(psi)), (np.cos(theta), np.sin(theta)), (np.cos(phi), np.sin(phi)), code, out, k)


@njit("void(float64[::1], int64, int64, float64[::1], int64)", cache=True, error_model="numpy")
def euler_angles(a, k, code, out, j):
    """Write the 3-1-3 angles (theta in [0, pi]) of the row-major matrix ``a[k:k+9]`` to ``out[j:j+3]``."""
    if code == REFERENCE_IDENTITY:
        xz, yz, zx, zy, zz = a[k + 2], a[k + 5], a[k + 6], a[k + 7], a[k + 8]
        xx, yx = a[k], a[k + 3]
    else:
        xz, yz, zx, zy, zz = -a[k + 1], -a[k + 4], a[k + 6], a[k + 8], -a[k + 7]
        xx, yx = a[k], a[k + 3]
    sine = np.hypot(xz, yz)
    out[j + 1] = np.arctan2(sine, zz)
    if sine > 1e-12:
        out[j] = np.arctan2(xz, -yz)
        out[j + 2] = np.arctan2(zx, zy)
    else:
        out[j] = np.arctan2(yx, xx)
        out[j + 2] = 0.0


@njit("int64(float64[::1], int64)", cache=True, error_model="numpy")
def best_reference(a, k):
    """Return the reference code whose |sin(theta)| is the larger for the matrix ``a[k:k+9]``."""
    if abs(a[k + 8]) <= abs(a[k + 7]):
        return REFERENCE_IDENTITY
    return REFERENCE_QUARTER_TURN


@njit(cache=True, error_model="numpy", forceinline=True)
def axes_of(turn_1, turn_2, e1, e2, e3, row):
    """Fill what `axes_and_velocity` does in a row of the kinematics table, from cosine and sine of psi and theta."""
    c1, s1 = turn_1
    c2, s2 = turn_2
    g = KIN_AXES
    row[g], row[g + 1], row[g + 2] = 0.0, 0.0, 1.0
    row[g + 3], row[g + 4], row[g + 5] = c1, s1, 0.0
    row[g + 6], row[g + 7], row[g + 8] = s1 * s2, -c1 * s2, c2
    w2x, w2y, w2z = e3 * row[g + 6], e3 * row[g + 7], e3 * row[g + 8]
    w1x, w1y, w1z = w2x + e2 * c1, w2y + e2 * s1, w2z
    row[KIN_W], row[KIN_W + 1], row[KIN_W + 2] = w1x, w1y, w1z + e1
    d = KIN_DW
    cross_into(0.0, 0.0, 1.0, w1x, w1y, w1z, row, d)
    cross_into(c1, s1, 0.0, w2x, w2y, w2z, row, d + 3)
    row[d + 6] = row[d + 7] = row[d + 8] = 0.0
    r = KIN_ADOT
    row[r] = row[r + 1] = row[r + 2] = 0.0
    row[r + 3], row[r + 4], row[r + 5] = -e1 * s1, e1 * c1, 0.0
    cross_into(e2 * c1, e2 * s1, e1, row[g + 6], row[g + 7], row[g + 8], row, r + 6)


@njit("void(float64, float64, float64, float64, float64, float64[:, ::1], int64)", cache=True, error_model="numpy")
def axes_and_velocity(psi, theta, e1, e2, e3, kin, b):
    """Fill axes, omega, d(omega)/d(theta) and axis rates of body b in the kinematics table."""
    axes_of((np.cos(psi), np.sin(psi)), (np.cos(theta), np.sin(theta)), e1, e2, e3, kin[b])


@njit("void(float64[:, ::1], int64, float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def euler_rates(kin, b, w, i, out, j):
    """Solve omega = sum_k a_k eps_k for the Euler rates of body b; ``w[i:i+3]`` is omega."""
    row = kin[b]
    g = KIN_AXES
    c1, s1 = row[g + 3], row[g + 4]
    s2 = s1 * row[g + 6] - c1 * row[g + 7]
    c2 = row[g + 8]
    wx, wy, wz = w[i], w[i + 1], w[i + 2]
    out[j + 1] = c1 * wx + s1 * wy
    e3 = (s1 * wx - c1 * wy) / s2
    out[j + 2] = e3
    out[j] = wz - c2 * e3


@njit("void(float64[:, ::1], int64, float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def momentum_from_conjugate(kin, b, p, i, out, j):
    """Solve p_k = a_k . h for the angular momentum h of body b."""
    row = kin[b]
    g = KIN_AXES
    c1, s1 = row[g + 3], row[g + 4]
    s2 = s1 * row[g + 6] - c1 * row[g + 7]
    c2 = row[g + 8]
    hz = p[i]
    along_nodes = p[i + 1]
    across = (p[i + 2] - c2 * hz) / s2
    out[j] = c1 * along_nodes + s1 * across
    out[j + 1] = s1 * along_nodes - c1 * across
    out[j + 2] = hz


def matrix_from_euler(psi: float, theta: float, phi: float) -> np.ndarray:
    """Return the 3x3 rotation matrix of body-fixed 3-1-3 Euler angles in radians."""
    out = np.empty(9)
    rotation_matrix(float(psi), float(theta), float(phi), REFERENCE_IDENTITY, out, 0)
    return out.reshape(3, 3)


def euler_from_matrix(a: np.ndarray) -> np.ndarray:
    """Return (psi, theta, phi) in radians of a 3x3 rotation matrix, theta in [0, pi]."""
    out = np.empty(3)
    euler_angles(np.ascontiguousarray(a, dtype=float).ravel(), 0, REFERENCE_IDENTITY, out, 0)
    return out


__all__ = [
    "KIN_A",
    "KIN_ADOT",
    "KIN_AXES",
    "KIN_COLUMNS",
    "KIN_DW",
    "KIN_FORCE",
    "KIN_H",
    "KIN_MOMENT",
    "KIN_R",
    "KIN_SHIFT",
    "KIN_TURN",
    "KIN_V",
    "KIN_W",
    "POSE_A",
    "POSE_COLUMNS",
    "POSE_R",
    "POSE_V",
    "POSE_W",
    "REFERENCE_IDENTITY",
    "REFERENCE_QUARTER_TURN",
    "SWITCH_SINE",
    "axes_and_velocity",
    "axes_of",
    "best_reference",
    "cross_into",
    "euler_angles",
    "euler_from_matrix",
    "euler_rates",
    "matrix_from_euler",
    "matrix_of",
    "momentum_from_conjugate",
    "rotation_matrix",
]


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
