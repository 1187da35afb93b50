"""The force of one contact path and its derivatives: balls without and with centrifugal load, rollers.

A path sees the vector (X, Y) from the groove centre of the outer to that of the inner ring in the plane of the element,
radial and axial, and the material h that is missing. Balls without inertia lie on the line of the centres,

    delta = L - A_0 - h,    L = |(X, Y)|,    n = (X, Y)/L,    Q = K s(delta)^n,

rollers have a fixed normal: delta = n . (X, Y) - gap - h. What is told of the contact, at ``S_LAW`` of the scratch: Q,
n, dQ by X, Y, h and the centrifugal load F, and d(alpha) by the same, the turn of n in its plane.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.bearings import layout as B

ITERATIONS = 60
HALVINGS = 30


@njit(cache=True, error_model="numpy")
def positive_part(delta, width):
    """Return max(delta, 0) and its slope, smooth to the second derivative between -width and width."""
    if delta >= width:
        return delta, 1.0
    if delta <= -width:
        return 0.0, 0.0
    up = delta + width
    scale = 1.0 / (16.0 * width * width * width)
    return up * up * up * (3.0 * width - delta) * scale, 4.0 * up * up * (2.0 * width - delta) * scale


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


@njit(cache=True, error_model="numpy")
def hertz_energy(stiffness, exponent, delta, width):
    """Return the work stored at a deflection: the integral of K s(delta)^n."""
    if delta >= width:
        stored = stiffness * delta ** (exponent + 1.0) / (exponent + 1.0)
        if width > 0.0:
            stored += hertz_energy_within(stiffness, exponent, width, width)
            stored -= stiffness * width ** (exponent + 1.0) / (exponent + 1.0)
        return stored
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
def ball_law(stiffness, exponent, distance, width, x, y, h, law):
    """Write the contact of a ball without inertia; return its deflection.

    Parameters
    ----------
    stiffness, exponent : float
        K and n.
    distance : float
        A_0, m.
    width : float
        Half width of the smooth transition, m.
    x, y : float
        From the groove centre of the outer to that of the inner ring, m.
    h : float
        Missing material, m.
    law : ndarray, shape (11,)
        Out: Q, n (2), dQ by x, y, h, F, d(alpha) by x, y, h, F. Only Q where there is no contact.
    """
    law[0] = 0.0
    reach = distance + h - width
    square = x * x + y * y
    if square <= reach * reach and reach > 0.0:
        return np.sqrt(square) - distance - h
    length = np.sqrt(square)
    part, part_slope = positive_part(length - distance - h, width)
    force, slope = hertz_force(stiffness, exponent, part)
    if force <= 0.0:
        return length - distance - h
    write_ball_law(force, slope * part_slope, x / length, y / length, length, law)
    return length - distance - h


@njit(cache=True, error_model="numpy")
def write_ball_law(force, slope, nx, ny, length, law):
    """Write the contact of a ball without inertia, of a force, its slope, a normal and a distance of the centres."""
    law[0], law[1], law[2] = force, nx, ny
    law[3], law[4], law[5], law[6] = slope * nx, slope * ny, -slope, 0.0
    law[7], law[8], law[9], law[10] = -ny / length, nx / length, 0.0, 0.0


@njit(cache=True, error_model="numpy")
def roller_law(stiffness, exponent, width, nx, ny, delta, law):
    """Write the contact of a slice of a roller with normal n at a deflection; see `ball_law`."""
    law[0] = 0.0
    part, part_slope = positive_part(delta, width)
    force, slope = hertz_force(stiffness, exponent, part)
    if force <= 0.0:
        return
    slope *= part_slope
    law[0], law[1], law[2] = force, nx, ny
    law[3], law[4], law[5] = slope * nx, slope * ny, -slope
    for k in range(6, 11):
        law[k] = 0.0


@njit(cache=True, error_model="numpy")
def ball_potential(reals, x, y, h, load, vr, vz):
    """Return the potential of a ball's centre at v: both contacts less the work of the centrifugal load."""
    outer = np.sqrt(vr * vr + vz * vz) - reals[B.OUTER_REACH]
    inner = np.sqrt((x - vr) ** 2 + (y - vz) ** 2) - reals[B.INNER_REACH] - h
    total = -load * vr
    if outer > 0.0:
        total += 0.4 * reals[B.OUTER_STIFFNESS] * outer**2.5
    if inner > 0.0:
        total += 0.4 * reals[B.INNER_STIFFNESS] * inner**2.5
    return total


@njit(cache=True, error_model="numpy")
def contact_block(stiffness, ex, ey, length, delta):
    """Return force and stiffness (xx, xy, yy) of a contact along e, and its slope."""
    force, slope = hertz_force(stiffness, 1.5, delta)
    across = force / length
    return (
        force,
        slope * ex * ex + across * ey * ey,
        (slope - across) * ex * ey,
        slope * ey * ey + across * ex * ex,
        slope,
    )


@njit(cache=True, error_model="numpy")
def ball_centre(reals, x, y, h, load):
    """Return the centre of a ball in equilibrium between both races and its centrifugal load, and if I is touched."""
    k_o, k_i, r_o, r_i = reals[B.OUTER_STIFFNESS], reals[B.INNER_STIFFNESS], reals[B.OUTER_REACH], reals[B.INNER_REACH]
    rest = r_o + (max(load, 0.0) / k_o) ** (2.0 / 3.0)
    if np.sqrt((x - rest) ** 2 + y * y) - r_i - h <= 0.0:
        return rest, 0.0, False
    length = np.sqrt(x * x + y * y)
    free = max(length - r_o - r_i - h, 1e-9)
    share = 1.0 / (1.0 + (k_o / k_i) ** (2.0 / 3.0))
    start = (r_o + share * free + (load / k_o) ** (2.0 / 3.0)) / length
    vr, vz = start * x, start * y
    value = ball_potential(reals, x, y, h, load, vr, vz)
    for _ in range(ITERATIONS):
        lo, li = np.sqrt(vr * vr + vz * vz), np.sqrt((x - vr) ** 2 + (y - vz) ** 2)
        ox, oy, ix, iy = vr / lo, vz / lo, (x - vr) / li, (y - vz) / li
        f_o, oxx, oxy, oyy, _ = contact_block(k_o, ox, oy, lo, max(lo - r_o, 0.0))
        f_i, ixx, ixy, iyy, _ = contact_block(k_i, ix, iy, li, max(li - r_i - h, 0.0))
        gx, gy = f_o * ox - f_i * ix - load, f_o * oy - f_i * iy
        sxx, sxy, syy = oxx + ixx, oxy + ixy, oyy + iyy
        soft = 1e-9 * (k_o + k_i) * np.sqrt(1e-6)
        sxx, syy = sxx + soft, syy + soft
        det = sxx * syy - sxy * sxy
        dx, dy = -(syy * gx - sxy * gy) / det, -(sxx * gy - sxy * gx) / det
        step, way = 1.0, gx * dx + gy * dy
        for _ in range(HALVINGS):
            there = ball_potential(reals, x, y, h, load, vr + step * dx, vz + step * dy)
            if there <= value + 1e-4 * step * way or abs(step * way) <= 1e-15 * abs(value):
                break
            step *= 0.5
        vr, vz, value = vr + step * dx, vz + step * dy, there
        if abs(dx) + abs(dy) <= 1e-16 * length or abs(gx) + abs(gy) <= 1e-13 * (f_o + load):
            break
    return vr, vz, True


@njit(cache=True, error_model="numpy")
def ball_law_at_speed(reals, x, y, h, load, law):
    """Write the contact of a ball in equilibrium with its centrifugal load; return deflection and energy.

    The centre v balances Q_o v/|v| = Q_i (A - v)/|A - v| + F e_r; what is written is the contact with the inner ring,
    see `ball_law`. Its potential, both contacts less F v_r, is returned as energy.
    """
    law[0] = 0.0
    vr, vz, touched = ball_centre(reals, x, y, h, load)
    energy = ball_potential(reals, x, y, h, load, vr, vz)
    if not touched:
        return -h, energy
    lo, li = np.sqrt(vr * vr + vz * vz), np.sqrt((x - vr) ** 2 + (y - vz) ** 2)
    inner = li - reals[B.INNER_REACH] - h
    if inner <= 0.0:
        return inner, energy
    nx, ny = (x - vr) / li, (y - vz) / li
    force, ixx, ixy, iyy, slope = contact_block(reals[B.INNER_STIFFNESS], nx, ny, li, inner)
    _, oxx, oxy, oyy, _ = contact_block(
        reals[B.OUTER_STIFFNESS], vr / lo, vz / lo, lo, max(lo - reals[B.OUTER_REACH], 0.0)
    )
    sxx, sxy, syy = oxx + ixx, oxy + ixy, oyy + iyy
    det = sxx * syy - sxy * sxy
    law[0], law[1], law[2] = force, nx, ny
    for k in range(4):
        # what pulls the centre: K_i dA, -Q_i' n dh, e_r dF; then df = K_i (dA - dv) - Q_i' n dh
        ax, ay = (1.0, 0.0) if k == 0 else ((0.0, 1.0) if k == 1 else (0.0, 0.0))
        px, py = ixx * ax + ixy * ay, ixy * ax + iyy * ay
        if k == 2:
            px, py = -slope * nx, -slope * ny
        elif k == 3:
            px, py = 1.0, 0.0
        vx, vy = (syy * px - sxy * py) / det, (sxx * py - sxy * px) / det
        fx, fy = ixx * (ax - vx) + ixy * (ay - vy), ixy * (ax - vx) + iyy * (ay - vy)
        if k == 2:
            fx, fy = fx - slope * nx, fy - slope * ny
        law[3 + k] = nx * fx + ny * fy
        law[7 + k] = (-ny * fx + nx * fy) / force
    return inner, energy


@njit(cache=True, error_model="numpy")
def roller_law_at_speed(reals, share, nx, ny, delta, load, law):
    """Write the contact of a slice of a roller pressed outward; return its deflection and energy.

    With delta_i + delta_o = delta and F the centrifugal load along the normal, K_o delta_o^n = K_i delta_i^n + F; of a
    tapered roller the flange takes what is left. What is written is the contact with the inner ring, see `ball_law`;
    the energy is that of both contacts less F delta_o.

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
    law : ndarray, shape (11,)
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
    for k in range(7, 11):
        law[k] = 0.0
    energy = (k_i * inner ** (n + 1.0) + k_o * outer ** (n + 1.0)) / (n + 1.0) - push * outer
    return delta - rest, energy
