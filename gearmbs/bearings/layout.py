"""Places of a bearing's integers, reals and scratch, shared by the tables and the kernels."""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit

BALL, ROLLER = 0, 1
"""Kinds of contact: point contact along the line of the groove centres, line contact with a fixed normal."""

ELEMENTS = 0
"""Integers: number of rolling elements."""
PATHS = 1
"""Contact paths an element: one of a ball, two with four points, the slices of a roller."""
KIND = 2
SPINS = 3
"""Number of elements whose spin is a state."""
OUTER_NODES = 4
"""Nodes of a profile of the outer ring, of the inner ring, of an element; 0: no profile."""
INNER_NODES = 5
SPIN_NODES = 6
CENTRIFUGAL = 7
"""Whether the elements' own centrifugal load counts."""
AT_PATHS = 8
"""Places of the tables among the reals."""
AT_ELEMENTS = 9
AT_OUTER = 10
AT_INNER = 11
AT_SPIN = 12
SLIP_NODES = 13
"""Nodes of the cage's random slip, 0: none, and its place among the reals."""
AT_SLIP = 14
ROWS = 15
"""Rows of elements, which share the paths of an element equally, one row's after the other's."""
INTEGERS = 16
"""Behind: for each path its row of the outer and of the inner profiles or -1; for each element its spin or -1."""

STIFFNESS = 0
"""Reals: K of the two contacts in series, N/m^n."""
EXPONENT = 1
DAMPING = 2
"""chi, s/m."""
CAGE = 3
"""d psi' / d Omega, in the mean."""
SPIN = 4
"""d beta' / d Omega."""
DISTANCE = 5
"""A_0 of balls, 0 of rollers."""
SMOOTH = 6
"""Half width of the smooth transition of contact, m; 0: none."""
ROLLING = 7
"""mu d_m / 2 of the load torque, m."""
VISCOUS = 8
"""c_0 of the speed torque, N m (s/rad)^(2/3)."""
SLOW = 9
"""Speed below which the friction torque falls to zero, rad/s."""
INNER_AXIS = 10
"""Axis of the inner ring in the axes of I, three reals."""
OUTER_TILT = 13
"""Components of the outer ring's axis along x_J and y_J."""
MASS_RADIUS = 15
"""m d_m / 2, kg m."""
INNER_STIFFNESS = 16
OUTER_STIFFNESS = 17
INNER_REACH = 18
"""Distance of the ball's centre from the groove centre of the inner ring without load, of the outer ring."""
OUTER_REACH = 19
SLIP_TURNS = 20
"""Turns of the cage after which its random slip repeats."""
SMOOTH_WORK = 21
"""Work of the whole smooth transition by K, m^(n + 1)."""
OUTER_APART = 22
"""Distance of the two groove centres of a four-point bearing's outer ring along the axis, m; else 0."""
REALS = 23

PATH_RADIAL = 0
"""Reals of a path: radial and axial distance of the groove centres, rings centred; of a roller the normal."""
PATH_AXIAL = 1
PATH_RADIUS = 2
"""Where the inner ring is touched: radius, and distance from the ring's middle along the axis."""
PATH_HEIGHT = 3
PATH_SHARE = 4
"""Share of the stiffness."""
PATH_GAP = 5
"""Clearance and profile of a roller along the normal."""
PATH_COLUMNS = 6

ELEMENT_COSINE = 0
"""Reals of an element: cosine and sine of its place in the cage, how much it is larger than the others."""
ELEMENT_SINE = 1
ELEMENT_OVERSIZE = 2
ELEMENT_PLACE = 3
ELEMENT_COLUMNS = 4

PSI, THETA, BETA = 5, 6, 7
"""Local coordinates q: displacement (0 to 2), tilt of the axis (3, 4), cage angle, angle of the inner ring, spins."""

# scratch
S_MOTION = 0
"""Displacement d of I seen from J in its axes, and q_3, q_4; then the rates of all q, one for all spins."""
S_TILT = 3
S_RATES = 5
MOTION = 13
S_A = 13
"""Axis of the inner ring and w of I seen from J, in its axes."""
S_W = 16
S_TURN = 19
"""Gradient of the angle of the inner ring by a rotation of I, and the angle, the rate."""
S_THETA = 22
S_THETA_RATE = 23
S_SPIN = 24
"""w_J . z_J"""
S_CAGE = 25
"""d psi' / d Omega at the cage's angle, and its slope by it."""
S_CAGE_SLOPE = 26
S_CENTRE = 27
"""Centre of a four-point bearing's ball, whose two paths share it, radially and along the axis."""
S_SUMS = 29
"""Sums over the elements: normal forces, energy, damping power, largest force of an element,
number of elements loaded, largest deflection."""
SUMS = 6
S_LAW = 35
"""Results of one contact: Q, n, derivatives of Q and of its direction by X, Y, h and the centrifugal load, then of
both by the tilt phi, as far as it moves the other path of the element against this one."""
LAW = 13
S_PROFILE = 48
"""Profiles at one contact: slopes of the outer ring's, the inner ring's and the element's profile, then their
curvatures."""
S_PLANE = 54
"""Coordinates of one element in its plane: u, w, phi, the rates of these and of the angles psi, theta, beta."""
PLANE = 9
S_PLANE_SUMS = 63
"""Sums over the paths of one element: six forces in its plane and f, their derivatives by the six coordinates, by the
rates, and by the centrifugal load; of plain elements three forces, f, and their derivatives by three and three."""
PLANE_FORCES, PLANE_SUMS, PLAIN_SUMS = 7, 98, 28
S_LOCAL = 161
"""From here, with n local coordinates: n generalised forces and the sum of normal forces, their derivatives by q, by
q' and by the centrifugal load, n + 1 rows each; then what the variations need, see `variations`."""

VARIATIONS = 13
"""Local variations: d, rotation, v, w of I seen from J, and w_J . z_J."""


def scratch(spins: int) -> int:
    """Return the length of the scratch of a bearing with so many spins."""
    n = BETA + spins
    # behind the generalised forces: the variations of the forces, of F and N locally and turned, and the angle's
    # derivatives
    return variations(n) + (n + 7) * (VARIATIONS + 1 + spins) + 32


@njit(cache=True, error_model="numpy")
def variations(n):
    """Return where the variations begin in the scratch of a bearing with n local coordinates."""
    return S_LOCAL + 2 * (n + 1) * (n + 1)


# Periodic profiles by cubic B-splines: value, slope and curvature.


MARGIN = 3
"""Coefficients beyond the nodes of a turn, so that no index wraps."""


@njit(cache=True, error_model="numpy")
def place_of(nodes, angle):
    """Return the interval of a profile with so many nodes in which an angle lies, and where in it, 0 to 1."""
    x = angle * (nodes / (2.0 * np.pi))
    x -= nodes * np.floor(x / nodes)
    k = int(x)
    if k >= nodes:
        k = nodes - 1
    return k, x - k


@njit(cache=True, error_model="numpy")
def profile_value(reals, at, k, f):
    """Return the profile whose coefficients begin at ``at``, in interval k at f."""
    g = 1.0 - f
    a, b, c, d = reals[at + k], reals[at + k + 1], reals[at + k + 2], reals[at + k + 3]
    b_weight = (3.0 * f - 6.0) * f * f + 4.0
    c_weight = ((3.0 - 3.0 * f) * f + 3.0) * f + 1.0
    return (g * g * g * a + b_weight * b + c_weight * c + f * f * f * d) / 6.0


@njit(cache=True, error_model="numpy")
def profile_slope(reals, at, nodes, k, f):
    """Return its slope by the angle."""
    g = 1.0 - f
    a, b, c, d = reals[at + k], reals[at + k + 1], reals[at + k + 2], reals[at + k + 3]
    total = -g * g * a + (3.0 * f - 4.0) * f * b + ((2.0 - 3.0 * f) * f + 1.0) * c + f * f * d
    return total * (nodes / (4.0 * np.pi))


@njit(cache=True, error_model="numpy")
def profile_curvature(reals, at, nodes, k, f):
    """Return its second derivative by the angle."""
    a, b, c, d = reals[at + k], reals[at + k + 1], reals[at + k + 2], reals[at + k + 3]
    total = (1.0 - f) * a + (3.0 * f - 2.0) * b + (1.0 - 3.0 * f) * c + f * d
    return total * (nodes / (2.0 * np.pi)) ** 2


# Material that is missing from rings and elements, as periodic splines over their angle.
#
# A ball that rolls over a gap stands on its edges: at a distance e from the nearer edge its centre has dropped by
#
#     r - sqrt(r^2 - e^2)    (r: radius of the element),
#
# at most by the depth of the gap. In the middle of a gap of width B this is r - sqrt(r^2 - B^2/4), and the path has a
# kink there, where the element strikes the far edge. Edges are rounded by a smooth average over their width.


LEAST_NODES = 1024
MOST_NODES = 1 << 16
PER_EDGE = 6
"""Nodes of the spline over the width of the finest edge."""


def drop(distance: np.ndarray, radius: float, depth: float) -> np.ndarray:
    """Return how far an element's centre has dropped at a distance inside the edge of a gap, m."""
    inside = np.clip(distance, 0.0, radius)
    return np.minimum(radius - np.sqrt(radius**2 - inside**2), depth)


def spall_depth(width: float, radius: float) -> float:
    """Return how far an element of a radius drops into the middle of a gap without bottom, m.

    Examples
    --------
    >>> [round(1e6 * spall_depth(1e-3 * width, 3.97e-3), 2) for width in (0.2, 0.5, 1.0, 2.0)]
    [1.26, 7.88, 31.61, 128.01]
    """
    return float(drop(np.array(0.5 * width), radius, np.inf))


def node_count(edge: float, radius: float) -> int:
    """Return the number of nodes, a power of two, that resolves an edge on a ring of a radius."""
    wanted = PER_EDGE * 2.0 * np.pi * radius / edge
    return int(np.clip(2 ** int(np.ceil(np.log2(max(wanted, 1.0)))), LEAST_NODES, MOST_NODES))


def angles(nodes: int) -> np.ndarray:
    """Return the angles of the nodes, rad."""
    return np.arange(nodes) * (2.0 * np.pi / nodes)


def rounded(values: np.ndarray, width: float) -> np.ndarray:
    """Return a periodic profile averaged over a width in rad, by the smooth bump (1 - x^2)^3."""
    nodes = values.size
    half = 0.5 * width * nodes / (2.0 * np.pi)
    if half < 0.5:
        return values
    reach = int(np.ceil(half))
    x = np.arange(-reach, reach + 1) / half
    bump = np.clip(1.0 - x**2, 0.0, None) ** 3
    kernel = np.zeros(nodes)
    np.add.at(kernel, np.arange(-reach, reach + 1) % nodes, bump / bump.sum())
    return np.fft.irfft(np.fft.rfft(values) * np.fft.rfft(kernel), nodes)


def spline_coefficients(values: np.ndarray) -> np.ndarray:
    """Return the coefficients of the periodic cubic B-spline through values at even nodes, the first three repeated."""
    nodes = values.size
    response = (4.0 + 2.0 * np.cos(2.0 * np.pi * np.arange(nodes // 2 + 1) / nodes)) / 6.0
    inner = np.fft.irfft(np.fft.rfft(values) / response, nodes)
    # the kernel begins one node before the interval
    return np.take(inner, np.arange(-1, nodes + MARGIN - 1), mode="wrap")


def one_element(integers: np.ndarray, rows: int, row: int, element: int) -> np.ndarray:
    """Return the integers of a bearing of one element in one row of a bearing's.

    Parameters
    ----------
    integers : ndarray
    rows : int
        Number of its rows.
    row, element : int
    """
    paths = int(integers[PATHS])
    own = paths // rows
    first = INTEGERS + own * row
    rings = [integers[at : at + own] for at in (first, first + paths)]
    spin = integers[INTEGERS + 2 * paths + element :][:1]
    one = np.concatenate([integers[:INTEGERS], *rings, spin])
    one[ELEMENTS], one[PATHS], one[ROWS] = 1, own, 1
    one[AT_ELEMENTS] += ELEMENT_COLUMNS * element
    one[AT_PATHS] += PATH_COLUMNS * own * row
    return one
