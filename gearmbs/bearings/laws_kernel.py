"""Constants of Hertz's contacts, and the contact of a path of balls and rollers with centrifugal load.

The law of a contact without it, and all that follows from a law, is in `gearmbs.bearings.definitions`. With it the
place of an element is the solution of an iteration. What is told of the contact, at ``S_LAW`` of the scratch: Q, n, dQ
by X, Y, h and the centrifugal load F, and d(alpha) by the same, the turn of n in its plane; then both by the tilt phi.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearmbs.bearings import layout as B
from gearmbs.bearings.derived import smooth_part
from gearmbs.kernels.jit import njit

# Hertz constants of balls on grooves and of rollers on rings.
#
# For a ball of diameter d on a groove of radius f d the sum of curvatures and their difference are, with
# g = d cos(a)/D and the upper sign for the inner ring,
#
#     sum rho = (4 - 1/f + 2 s)/d,    F(rho) = (1/f + 2 s)/(4 - 1/f + 2 s),    s = g/(1 - g) or -g/(1 + g).
#
# The ellipticity k = a/b solves F(rho) = ((k^2 + 1) E - 2 K)/((k^2 - 1) E) with the complete elliptic integrals K and E
# of m = 1 - 1/k^2; then delta* = (2 K/pi) (pi/(2 k^2 E))^(1/3) and
#
#     Q = K_c delta^(3/2),    K_c = E_y 2^(3/2)/(3 (1 - nu^2)) (sum rho)^(-1/2) delta*^(-3/2).
#
# References
# ----------
# .. [1] T. A. Harris, M. N. Kotzalas, Essential Concepts of Bearing Technology, 5th ed. (2007), chapter 6.
# .. [2] A. Palmgren, Ball and Roller Bearing Engineering, 3rd ed. (1959): line contact.


BALL_EXPONENT = 1.5
"""Exponent of the deflection in the force of a point contact (Hertz)."""
ROLLER_EXPONENT = 10.0 / 9.0
PALMGREN = 3.84e-5
"""mm of approach per contact for Q = 1 N on a line of 1 mm: delta = 3.84e-5 Q^0.9/L^0.8, mm and N, steel."""
ROUND = 1e-9
"""Difference of the curvatures by their sum below which a contact is a circle: rounding of equal radii."""
STEEL = 2.07e11, 0.3
"""Young's modulus, Pa, and Poisson's ratio of that steel, and of bearings where none are given."""


@dataclass(frozen=True)
class PointContact:
    """A ball on a groove.

    Attributes
    ----------
    stiffness : float
        K_c of Q = K_c delta^1.5, N/m^1.5.
    ellipticity : float
        a/b, major by minor half axis.
    approach : float
        delta*, dimensionless.
    curvature_sum, curvature_difference : float
        sum rho (1/m) and F(rho).
    semi_axes : tuple of float
        a and b at Q = 1 N, m; they grow with Q^(1/3).
    """

    stiffness: float
    ellipticity: float
    approach: float
    curvature_sum: float
    curvature_difference: float
    semi_axes: tuple[float, float]

    def pressure(self, force: float) -> float:
        """Return the largest pressure at a normal force in N, Pa."""
        a, b = self.semi_axes
        return 1.5 * force ** (1.0 / 3.0) / (math.pi * a * b)

    def force_at(self, pressure: float) -> float:
        """Return the normal force at which the largest pressure is this, N."""
        a, b = self.semi_axes
        return (pressure * math.pi * a * b / 1.5) ** 3


def groove_contact(
    diameter: float, curvature: float, slope: float, youngs_modulus: float = STEEL[0], poisson_ratio: float = STEEL[1]
) -> PointContact:
    """Return the contact of a ball with a groove.

    Parameters
    ----------
    diameter : float
        Of the ball, m.
    curvature : float
        Groove radius by ball diameter, f.
    slope : float
        s: ``g/(1 - g)`` for the inner, ``-g/(1 + g)`` for the outer ring, with g = d cos(a)/D.
    youngs_modulus, poisson_ratio : float
        Of ball and ring, Pa.
    """
    from scipy.optimize import brentq

    total = (4.0 - 1.0 / curvature + 2.0 * slope) / diameter
    difference = (1.0 / curvature + 2.0 * slope) / (4.0 - 1.0 / curvature + 2.0 * slope)

    def mismatch(log_ratio: float) -> float:
        return _difference(math.exp(log_ratio)) - difference

    # a sphere touches in a circle
    round_one = mismatch(1e-6) >= 0.0 or abs(difference) < ROUND
    ratio = math.exp(1e-6 if round_one else brentq(mismatch, 1e-6, math.log(1e4), xtol=1e-14, rtol=1e-14))
    first, second = _integrals(ratio)
    approach = 2.0 * first / math.pi * (math.pi / (2.0 * ratio**2 * second)) ** (1.0 / 3.0)
    modulus = youngs_modulus / (1.0 - poisson_ratio**2)
    stiffness = modulus * 2.0**1.5 / 3.0 / math.sqrt(total) / approach**1.5
    size = (3.0 / (total * modulus)) ** (1.0 / 3.0)
    major = (2.0 * ratio**2 * second / math.pi) ** (1.0 / 3.0) * size
    return PointContact(stiffness, ratio, approach, total, difference, (major, major / ratio))


def _integrals(ratio: float) -> tuple[float, float]:
    from scipy.special import ellipe, ellipk

    m = 1.0 - 1.0 / ratio**2
    return float(ellipk(m)), float(ellipe(m))


def _difference(ratio: float) -> float:
    first, second = _integrals(ratio)
    square = ratio**2
    return ((square + 1.0) * second - 2.0 * first) / ((square - 1.0) * second)


def in_series(first: float, second: float, exponent: float) -> float:
    """Return K of two contacts one behind the other, (K_1^(-1/n) + K_2^(-1/n))^(-n)."""
    power = -1.0 / exponent
    return float((first**power + second**power) ** -exponent)


def line_contact(length: float, youngs_modulus: float = STEEL[0], poisson_ratio: float = STEEL[1]) -> float:
    """Return K of Q = K delta^(10/9) for one contact of a roller by Palmgren, N/m^(10/9).

    The approach of other materials than steel goes with (Q/E')^0.9, E' = E/(1 - nu^2), so that K goes with E'.

    Parameters
    ----------
    length : float
        Effective length, m.
    youngs_modulus, poisson_ratio : float
        Of roller and ring, Pa.
    """
    by_steel = youngs_modulus / (1.0 - poisson_ratio**2) / (STEEL[0] / (1.0 - STEEL[1] ** 2))
    # delta [m] = 1e-3 * 3.84e-5 Q^0.9 / (1e3 L)^0.8
    return float(by_steel * (1e3 * (1e3 * length) ** 0.8 / PALMGREN) ** ROLLER_EXPONENT)


ITERATIONS = 60
HALVINGS = 30


@njit(cache=True, error_model="numpy", forceinline=True)
def positive_part(delta, width):
    """Return max(delta, 0) and its slope, smooth to the second derivative between -width and width."""
    if delta >= width:
        return delta, 1.0
    if delta <= -width:
        return 0.0, 0.0
    return smooth_part(delta, width)


@njit(cache=True, error_model="numpy")
def hertz_force(stiffness, exponent, delta):
    """Return K delta^n and its slope."""
    if delta <= 0.0:
        return 0.0, 0.0
    if exponent == 1.5:
        root = stiffness * np.sqrt(delta)
        return root * delta, 1.5 * root
    root = stiffness * delta ** (exponent - 1.0)
    return root * delta, exponent * root


@njit(cache=True, error_model="numpy", forceinline=True)
def hertz_energy(stiffness, exponent, delta, width, transition):
    """Return the work stored at a deflection: the integral of K s(delta)^n.

    Parameters
    ----------
    stiffness, exponent : float
        K and n.
    delta, width : float
        m.
    transition : float
        Work of the whole transition by K.
    """
    if delta >= width:
        stored = hertz_force(stiffness, exponent, delta)[0] * delta
        if width > 0.0:
            stored -= hertz_force(stiffness, exponent, width)[0] * width
        return stored / (exponent + 1.0) + stiffness * transition
    return hertz_energy_within(stiffness, exponent, delta, width)


@njit(cache=True, error_model="numpy")
def hertz_energy_within(stiffness, exponent, delta, width):
    """Return the work of the transition from -width to delta, by Gauss's rule with five points on eight panels."""
    total = 0.0
    if delta <= -width:
        return total
    panel = (delta + width) / 8.0
    for k in range(8):
        middle = -width + (k + 0.5) * panel
        for sign in (-1.0, 1.0):
            for node in range(2):
                x = 0.9061798459386640 if node else 0.5384693101056831
                w = 0.2369268850561891 if node else 0.4786286704993665
                total += w * positive_part(middle + 0.5 * panel * sign * x, width)[0] ** exponent
        total += 0.5688888888888889 * positive_part(middle, width)[0] ** exponent
    return 0.5 * panel * stiffness * total


@njit(cache=True, error_model="numpy")
def ball_potential(reals, x, y, other_x, other_y, h, load, vr, vz):
    """Return the potential of a ball's centre at v: all contacts less the work of the centrifugal load.

    Parameters
    ----------
    reals : ndarray
    x, y : float
        From the groove centre of the outer to that of the inner ring, m.
    other_x, other_y : float
        The same of the other path of a four-point bearing.
    h : float
        Missing material, m.
    load : float
        Centrifugal load, N.
    vr, vz : float
        From the groove centre of the outer ring to the ball's, m.
    """
    total = contact_work(reals[B.OUTER_STIFFNESS], vr, vz, reals[B.OUTER_REACH]) - load * vr
    total += contact_work(reals[B.INNER_STIFFNESS], x - vr, y - vz, reals[B.INNER_REACH] + h)
    apart = reals[B.OUTER_APART]
    if apart > 0.0:
        total += contact_work(reals[B.OUTER_STIFFNESS], vr, vz - apart, reals[B.OUTER_REACH])
        far_y = other_y + apart - vz
        total += contact_work(reals[B.INNER_STIFFNESS], other_x - vr, far_y, reals[B.INNER_REACH] + h)
    return total


@njit(cache=True, error_model="numpy")
def contact_work(stiffness, x, y, reach):
    """Return the work stored in a contact whose centres are (x, y) apart and touch at a distance."""
    delta = np.sqrt(x * x + y * y) - reach
    return 0.4 * hertz_force(stiffness, 1.5, delta)[0] * delta if delta > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def contact_block(stiffness, x, y, reach):
    """Return of a contact whose centres are (x, y) apart: force, its slope, stiffness (xx, xy, yy) and direction."""
    length = np.sqrt(x * x + y * y)
    nx, ny = x / length, y / length
    force, slope = hertz_force(stiffness, 1.5, length - reach)
    across = force / length
    xx, yy = slope * nx * nx + across * ny * ny, slope * ny * ny + across * nx * nx
    return force, slope, xx, (slope - across) * nx * ny, yy, nx, ny


@njit(cache=True, error_model="numpy")
def ball_start(reals, x, y, other_x, other_y, h, load):
    """Return a first guess of a ball's centre: at rest in the outer ring, or on the line of a path's groove centres."""
    k_o, k_i, r_o, r_i = reals[B.OUTER_STIFFNESS], reals[B.INNER_STIFFNESS], reals[B.OUTER_REACH], reals[B.INNER_REACH]
    middle = 0.5 * reals[B.OUTER_APART]
    lean = np.sqrt(1.0 - (middle / r_o) ** 2)
    paths = 2.0 if middle > 0.0 else 1.0
    sunk = r_o + (max(load, 0.0) / (paths * lean * k_o)) ** (2.0 / 3.0)
    rest_r, rest_z = np.sqrt(sunk * sunk - middle * middle), middle
    best_r, best_z = rest_r, rest_z
    least = ball_potential(reals, x, y, other_x, other_y, h, load, rest_r, rest_z)
    share = 1.0 / (1.0 + (k_o / k_i) ** (2.0 / 3.0))
    for path in range(int(paths)):
        ax, ay, from_z = (x, y, 0.0) if path == 0 else (other_x, other_y, 2.0 * middle)
        length = np.sqrt(ax * ax + ay * ay)
        free = max(length - r_o - r_i - h, 1e-9)
        start = (r_o + share * free + (load / k_o) ** (2.0 / 3.0)) / length
        value = ball_potential(reals, x, y, other_x, other_y, h, load, start * ax, from_z + start * ay)
        if value < least:
            least, best_r, best_z = value, start * ax, from_z + start * ay
    return rest_r, rest_z, best_r, best_z


@njit(cache=True, error_model="numpy")
def ball_centre(reals, x, y, other_x, other_y, h, load):
    """Return the centre of a ball in equilibrium between both races and its centrifugal load.

    Arguments as of `ball_potential`, which is convex and is minimised by damped Newton steps.
    """
    k_o, k_i, r_o, r_i = reals[B.OUTER_STIFFNESS], reals[B.INNER_STIFFNESS], reals[B.OUTER_REACH], reals[B.INNER_REACH]
    apart = reals[B.OUTER_APART]
    rest_r, rest_z, vr, vz = ball_start(reals, x, y, other_x, other_y, h, load)
    if apart == 0.0 and np.hypot(x - rest_r, y - rest_z) <= r_i + h:
        return rest_r, rest_z
    value = ball_potential(reals, x, y, other_x, other_y, h, load, vr, vz)
    soft = 1e-9 * (k_o + k_i) * np.sqrt(1e-6)
    length = np.sqrt(x * x + y * y)
    for _ in range(ITERATIONS):
        f_o, _, sxx, sxy, syy, nx, ny = contact_block(k_o, vr, vz, r_o)
        f_i, _, xx, xy, yy, mx, my = contact_block(k_i, x - vr, y - vz, r_i + h)
        gx, gy, size = f_o * nx - f_i * mx - load, f_o * ny - f_i * my, f_o + f_i + load
        sxx, sxy, syy = sxx + xx + soft, sxy + xy, syy + yy + soft
        if apart > 0.0:
            f_o, _, xx, xy, yy, nx, ny = contact_block(k_o, vr, vz - apart, r_o)
            gx, gy, sxx, sxy, syy, size = gx + f_o * nx, gy + f_o * ny, sxx + xx, sxy + xy, syy + yy, size + f_o
            f_i, _, xx, xy, yy, mx, my = contact_block(k_i, other_x - vr, other_y + apart - vz, r_i + h)
            gx, gy, sxx, sxy, syy, size = gx - f_i * mx, gy - f_i * my, sxx + xx, sxy + xy, syy + yy, size + f_i
        det = sxx * syy - sxy * sxy
        dx, dy = -(syy * gx - sxy * gy) / det, -(sxx * gy - sxy * gx) / det
        step, way = 1.0, gx * dx + gy * dy
        for _ in range(HALVINGS):
            there = ball_potential(reals, x, y, other_x, other_y, h, load, vr + step * dx, vz + step * dy)
            if there <= value + 1e-4 * step * way or abs(step * way) <= 1e-15 * abs(value):
                break
            step *= 0.5
        vr, vz, value = vr + step * dx, vz + step * dy, there
        if abs(dx) + abs(dy) <= 1e-16 * length or abs(gx) + abs(gy) <= 1e-13 * size:
            break
    return vr, vz


@njit(cache=True, error_model="numpy")
def ball_law_at_speed(reals, x, y, other_x, other_y, apart, twist, h, vr, vz, law):
    """Write the contact of a ball in equilibrium with its centrifugal load; return its deflection.

    The centre v balances all contacts and the load, with one path Q_o v/|v| = Q_i (A - v)/|A - v| + F e_r; what is
    written is this path's contact with the inner ring, see `layout.S_LAW`.

    Parameters
    ----------
    reals : ndarray
    x, y : float
        From the groove centre of the outer to that of the inner ring, m.
    other_x, other_y : float
        The same of the other path of a four-point bearing.
    apart : float
        Place of the other groove centre of the outer ring along the axis, seen from this one, m; 0: there is none.
    twist : float
        By how much a tilt phi moves the other groove centre of the inner ring radially beyond this one, m.
    h : float
        Missing material, m.
    vr, vz : float
        From the groove centre of the outer ring to the ball's, see `ball_centre`, m.
    law : ndarray, shape (13,)
        Out.
    """
    law[0] = 0.0
    inner = np.hypot(x - vr, y - vz) - reals[B.INNER_REACH] - h
    if inner <= 0.0:
        return inner
    k_o, k_i, r_o, r_i = reals[B.OUTER_STIFFNESS], reals[B.INNER_STIFFNESS], reals[B.OUTER_REACH], reals[B.INNER_REACH]
    force, slope, ixx, ixy, iyy, nx, ny = contact_block(k_i, x - vr, y - vz, r_i + h)
    _, _, sxx, sxy, syy, _, _ = contact_block(k_o, vr, vz, r_o)
    sxx, sxy, syy = sxx + ixx, sxy + ixy, syy + iyy
    far = fxx = fxy = fyy = mx = my = 0.0
    if apart != 0.0:
        _, _, xx, xy, yy, _, _ = contact_block(k_o, vr, vz - apart, r_o)
        _, far, fxx, fxy, fyy, mx, my = contact_block(k_i, other_x - vr, other_y + apart - vz, r_i + h)
        sxx, sxy, syy = sxx + xx + fxx, sxy + xy + fxy, syy + yy + fyy
    det = sxx * syy - sxy * sxy
    law[0], law[1], law[2] = force, nx, ny
    for k in range(5):
        # moved groove centres of the inner ring by X, Y, h, F, phi; then what pulls the ball's centre, K_i dA of both
        # paths, -Q_i' n dh, e_r dF, and df = K_i (dA - dv) - Q_i' n dh
        ax, ay = (1.0 if k == 0 else 0.0), (1.0 if k == 1 else 0.0)
        bx = twist if k == 4 else ax
        px, py = ixx * ax + ixy * ay + fxx * bx + fxy * ay, ixy * ax + iyy * ay + fxy * bx + fyy * ay
        if k == 2:
            px, py = -slope * nx - far * mx, -slope * ny - far * my
        elif k == 3:
            px, py = 1.0, 0.0
        vx, vy = (syy * px - sxy * py) / det, (sxx * py - sxy * px) / det
        fx, fy = ixx * (ax - vx) + ixy * (ay - vy), ixy * (ax - vx) + iyy * (ay - vy)
        if k == 2:
            fx, fy = fx - slope * nx, fy - slope * ny
        by_force, by_angle = (3 + k, 7 + k) if k < 4 else (11, 12)
        law[by_force] = nx * fx + ny * fy
        law[by_angle] = (-ny * fx + nx * fy) / force
    return inner


@njit(cache=True, error_model="numpy", forceinline=True)
def roller_law_at_speed(reals, share, nx, ny, delta, load, law):
    """Write the contact of a slice of a roller pressed outward; return its deflection and energy.

    With delta_i + delta_o = delta and F the centrifugal load along the normal, K_o delta_o^n = K_i delta_i^n + F; of a
    tapered roller the flange takes what is left. What is written is the contact with the inner ring, see
    `layout.S_LAW`; the energy is that of both contacts less F delta_o.

    Parameters
    ----------
    reals : ndarray
    share : float
        Of the slice in the roller.
    nx, ny : float
        Normal.
    delta : float
        Approach of the rings there, m.
    load : float
        Centrifugal load of the roller, N.
    law : ndarray, shape (13,)
    """
    n, k_i, k_o = reals[B.EXPONENT], share * reals[B.INNER_STIFFNESS], share * reals[B.OUTER_STIFFNESS]
    push = share * load * nx
    rest = (push / k_o) ** (1.0 / n)
    law[0] = 0.0
    if delta <= rest:
        return delta - rest, k_o * rest ** (n + 1.0) / (n + 1.0) - push * rest
    low, high = 0.0, delta - rest
    inner = high / (1.0 + (k_i / k_o) ** (1.0 / n))
    for _ in range(ITERATIONS):
        q_i, s_i = hertz_force(k_i, n, inner)
        q_o, s_o = hertz_force(k_o, n, delta - inner)
        miss = q_o - q_i - push
        if miss > 0.0:
            low = inner
        else:
            high = inner
        there = inner + miss / (s_i + s_o)
        if there <= low or there >= high:
            there = 0.5 * (low + high)
        change, inner = abs(there - inner), there
        if change <= 1e-16 * delta:
            break
    outer = delta - inner
    q_i, s_i = hertz_force(k_i, n, inner)
    _, s_o = hertz_force(k_o, n, outer)
    slope, by_push = s_i * s_o / (s_i + s_o), -s_i / (s_i + s_o)
    law[0], law[1], law[2] = q_i, nx, ny
    law[3], law[4], law[5], law[6] = slope * nx, slope * ny, -slope, by_push * share * nx
    for k in range(7, B.LAW):
        law[k] = 0.0
    energy = (k_i * inner ** (n + 1.0) + k_o * outer ** (n + 1.0)) / (n + 1.0) - push * outer
    return delta - rest, energy
