"""The force element of a rolling bearing: frame I in the inner ring, J in the outer, z along the axes.

From the frames come the local coordinates, in the axes of J: d = P_I - P_J, the axis a of the inner ring, the angle
theta of I about it, and the rates

    d' = v_I - v_J - w_J x d,    a' = w x a,    theta' = g . w,    psi' = kappa_c w_z,    beta' = kappa_b w_z,

with w = w_I - w_J. `gearmbs.bearings.elements_kernel` gives the generalised forces G on q; the wrench on I is

    F = G_d,    N = a x G_a + G_theta g + (kappa_c G_psi + kappa_b sum G_beta + T) z,

the forces that drive cage and elements being those of ideal rolling, and T the friction torque. So the power of the
wrench is exactly -dU/dt less what damping and friction dissipate.
"""

from __future__ import annotations

import numpy as np

from gearmbs.bearings import derived as D
from gearmbs.bearings import layout as B
from gearmbs.bearings.elements_kernel import element_sums
from gearmbs.bearings.layout import place_of, profile_slope, profile_value
from gearmbs.dae.equations.loads.forces import DERIVATIVES, DIAGNOSTICS, FORCE_SIG, FRAME_A, FRAME_P, FRAME_V, FRAME_W
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, vector_at


@njit(cache=True, error_model="numpy")
def measure(ints, reals, frames, work):
    """Write the local coordinates and rates."""
    dx, dy, dz = (
        frames[0, FRAME_P] - frames[1, FRAME_P],
        frames[0, FRAME_P + 1] - frames[1, FRAME_P + 1],
        frames[0, FRAME_P + 2] - frames[1, FRAME_P + 2],
    )
    wx, wy, wz = frames[1, FRAME_W], frames[1, FRAME_W + 1], frames[1, FRAME_W + 2]
    vx = frames[0, FRAME_V] - frames[1, FRAME_V] - wy * dz + wz * dy
    vy = frames[0, FRAME_V + 1] - frames[1, FRAME_V + 1] - wz * dx + wx * dz
    vz = frames[0, FRAME_V + 2] - frames[1, FRAME_V + 2] - wx * dy + wy * dx
    ux, uy, uz = frames[0, FRAME_W] - wx, frames[0, FRAME_W + 1] - wy, frames[0, FRAME_W + 2] - wz
    n0, n1, n2 = reals[B.INNER_AXIS], reals[B.INNER_AXIS + 1], reals[B.INNER_AXIS + 2]
    ax = frames[0, FRAME_A] * n0 + frames[0, FRAME_A + 1] * n1 + frames[0, FRAME_A + 2] * n2
    ay = frames[0, FRAME_A + 3] * n0 + frames[0, FRAME_A + 4] * n1 + frames[0, FRAME_A + 5] * n2
    az = frames[0, FRAME_A + 6] * n0 + frames[0, FRAME_A + 7] * n1 + frames[0, FRAME_A + 8] * n2
    for k in range(3):
        e0, e1, e2 = frames[1, FRAME_A + k], frames[1, FRAME_A + 3 + k], frames[1, FRAME_A + 6 + k]
        work[B.S_MOTION + k] = e0 * dx + e1 * dy + e2 * dz
        work[B.S_A + k] = e0 * ax + e1 * ay + e2 * az
        work[B.S_RATES + k] = e0 * vx + e1 * vy + e2 * vz
        work[B.S_W + k] = e0 * ux + e1 * uy + e2 * uz
    work[B.S_SPIN] = wx * frames[1, FRAME_A + 2] + wy * frames[1, FRAME_A + 5] + wz * frames[1, FRAME_A + 8]
    work[B.S_TILT] = work[B.S_A] - reals[B.OUTER_TILT]
    work[B.S_TILT + 1] = work[B.S_A + 1] - reals[B.OUTER_TILT + 1]
    work[B.S_RATES + 3] = work[B.S_W + 1] * work[B.S_A + 2] - work[B.S_W + 2] * work[B.S_A + 1]
    work[B.S_RATES + 4] = work[B.S_W + 2] * work[B.S_A] - work[B.S_W] * work[B.S_A + 2]
    work[B.S_THETA] = work[B.S_THETA_RATE] = 0.0
    for k in range(3):
        work[B.S_TURN + k] = 0.0
    if ints[B.INNER_NODES]:
        inner_angle(frames, work)


@njit(cache=True, error_model="numpy")
def relative(frames, i, k):
    """Return an entry of A_J^T A_I."""
    return (
        frames[1, FRAME_A + i] * frames[0, FRAME_A + k]
        + frames[1, FRAME_A + 3 + i] * frames[0, FRAME_A + 3 + k]
        + frames[1, FRAME_A + 6 + i] * frames[0, FRAME_A + 6 + k]
    )


@njit(cache=True, error_model="numpy")
def inner_angle(frames, work):
    """Write the angle of I about z, its gradient g by a rotation in the axes of J, and its rate.

    With M = A_J^T A_I, C = M_00 + M_11 and S = M_10 - M_01 it is atan2(S, C).
    """
    c, s = relative(frames, 0, 0) + relative(frames, 1, 1), relative(frames, 1, 0) - relative(frames, 0, 1)
    m20, m21, square = relative(frames, 2, 0), relative(frames, 2, 1), c * c + s * s
    work[B.S_THETA] = np.arctan2(s, c)
    work[B.S_TURN] = (s * m21 - c * m20) / square
    work[B.S_TURN + 1] = -(c * m21 + s * m20) / square
    work[B.S_TURN + 2] = 1.0
    rate = work[B.S_W + 2]
    for k in range(2):
        rate += work[B.S_TURN + k] * work[B.S_W + k]
    work[B.S_THETA_RATE] = rate


@njit(cache=True, error_model="numpy")
def inner_angle_bend(frames, work, out):
    """Write the derivatives of g by a rotation: ``out[3 r + k]`` is dg_r by a turn about axis k of J."""
    c, s = relative(frames, 0, 0) + relative(frames, 1, 1), relative(frames, 1, 0) - relative(frames, 0, 1)
    m20, m21, square = relative(frames, 2, 0), relative(frames, 2, 1), c * c + s * s
    m00, m01, m10, m11 = relative(frames, 0, 0), relative(frames, 0, 1), relative(frames, 1, 0), relative(frames, 1, 1)
    for k in range(3):
        px, py, pz = (1.0 if k == 0 else 0.0), (1.0 if k == 1 else 0.0), (1.0 if k == 2 else 0.0)
        # dM = skew(p) M
        d20, d21 = px * m10 - py * m00, px * m11 - py * m01
        dc = py * m20 - pz * m10 + pz * m01 - px * m21
        ds = pz * m00 - px * m20 - py * m21 + pz * m11
        shrink = -2.0 * (c * dc + s * ds) / square
        out[k] = (ds * m21 + s * d21 - dc * m20 - c * d20) / square + work[B.S_TURN] * shrink
        out[3 + k] = -(dc * m21 + c * d21 + ds * m20 + s * d20) / square + work[B.S_TURN + 1] * shrink
        out[6 + k] = 0.0


@njit(cache=True, error_model="numpy")
def cage_rate(ints, reals, psi, work):
    """Write kappa_c at an angle of the cage, with its random slip, and its slope by the angle."""
    work[B.S_CAGE], work[B.S_CAGE_SLOPE] = reals[B.CAGE], 0.0
    nodes = ints[B.SLIP_NODES]
    if nodes:
        turns = reals[B.SLIP_TURNS]
        interval, part = place_of(nodes, psi / turns)
        work[B.S_CAGE] *= 1.0 - profile_value(reals, ints[B.AT_SLIP], interval, part)
        slope = profile_slope(reals, ints[B.AT_SLIP], nodes, interval, part)
        work[B.S_CAGE_SLOPE] = -reals[B.CAGE] * slope / turns


@njit(cache=True, error_model="numpy")
def friction_of(reals, total, speed):
    """Return the friction torque about z at a sum of normal forces and a speed, its slope by either."""
    if reals[B.ROLLING] == 0.0 and reals[B.VISCOUS] == 0.0:
        return 0.0, 0.0, 0.0
    return D.friction_torque(reals[B.ROLLING], reals[B.VISCOUS], reals[B.SLOW], total, speed)


@njit(cache=True, error_model="numpy")
def drive_of(ints, reals, work):
    """Return the torque about z that drives cage and elements."""
    drive = work[B.S_CAGE] * work[B.S_LOCAL + B.PSI]
    for k in range(ints[B.SPINS]):
        drive += reals[B.SPIN] * work[B.S_LOCAL + B.BETA + k]
    return drive


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def bearing_force(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the wrench of a rolling bearing on its inner ring, the rates of cage angle and spins.

    Arguments as in `gearmbs.dae.equations.loads.forces`; the tables as in `gearmbs.bearings.layout`.
    """
    measure(ints, reals, frames, work)
    cage_rate(ints, reals, states[0], work)
    element_sums(ints, reals, states, want, work)
    speed = work[B.S_W + 2]
    friction, by_total, by_speed = friction_of(reals, work[B.S_SUMS], speed)
    g, a = B.S_LOCAL, B.S_A
    nx, ny = -work[a + 2] * work[g + 4], work[a + 2] * work[g + 3]
    nz = work[a] * work[g + 4] - work[a + 1] * work[g + 3] + drive_of(ints, reals, work) + friction
    turn = work[g + B.THETA]
    nx, ny, nz = nx + turn * work[B.S_TURN], ny + turn * work[B.S_TURN + 1], nz + turn * work[B.S_TURN + 2]
    for c in range(3):
        e0, e1, e2 = frames[1, FRAME_A + 3 * c], frames[1, FRAME_A + 3 * c + 1], frames[1, FRAME_A + 3 * c + 2]
        wrench[0, c] = e0 * work[g] + e1 * work[g + 1] + e2 * work[g + 2]
        wrench[0, 3 + c] = e0 * nx + e1 * ny + e2 * nz
    rates[0] = work[B.S_CAGE] * speed
    for k in range(ints[B.SPINS]):
        rates[1 + k] = reals[B.SPIN] * speed
    if want & DIAGNOSTICS:
        diagnostics[0], diagnostics[1] = work[B.S_SUMS + 1], work[B.S_SUMS + 2]
        diagnostics[2] = -friction * speed
        diagnostics[3], diagnostics[4], diagnostics[5] = work[B.S_SUMS], work[B.S_SUMS + 3], work[B.S_SUMS + 5]
        diagnostics[6] = work[B.S_SUMS + 4]
    if want & DERIVATIVES:
        local_jacobian(ints, reals, frames, work, by_total, by_speed)
        to_global_jacobian(ints, reals, frames, work, wrench, jac)


@njit(cache=True, error_model="numpy")
def local_jacobian(ints, reals, frames, work, by_total, by_speed):
    """Write the derivatives of F and N, in the axes of J, by the local variations and the states.

    Parameters
    ----------
    ints, reals, frames, work
        As in `bearing_force`.
    by_total, by_speed : float
        Slopes of the friction torque.
    """
    spins = ints[B.SPINS]
    n, m, states = B.BETA + spins, B.VARIATIONS, 1 + spins
    base = B.S_LOCAL
    columns, first = m + states, B.variations(n)
    force, out = matrix_at(work, first, n + 1, columns), matrix_at(work, first + (n + 1) * columns, 6, columns)
    bend = vector_at(work, first + (n + 7) * columns, 9)
    for k in range(9):
        bend[k] = 0.0
    if ints[B.INNER_NODES]:
        inner_angle_bend(frames, work, bend)
    cage = 0.0
    if ints[B.CENTRIFUGAL]:
        cage = 2.0 * reals[B.MASS_RADIUS] * (work[B.S_SPIN] + work[B.S_CAGE] * work[B.S_W + 2])
    stiff, damp, by_load = base + n + 1, base + (n + 1) * (n + 1), base + (n + 1) * (2 * n + 1)
    for r in range(n + 1):
        by_variations(
            ints, reals, work, vector_at(work, stiff + n * r, n), vector_at(work, damp + n * r, n),
            work[by_load + r] * cage, bend, vector_at(work, first + columns * r, columns),
        )  # fmt: skip
    ax, ay, az = work[B.S_A], work[B.S_A + 1], work[B.S_A + 2]
    for c in range(columns):
        for k in range(3):
            out[k, c] = force[k, c]
            out[3 + k, c] = force[B.THETA, c] * work[B.S_TURN + k]
        out[3, c] -= az * force[4, c]
        out[4, c] += az * force[3, c]
        out[5, c] += ax * force[4, c] - ay * force[3, c] + work[B.S_CAGE] * force[B.PSI, c] + by_total * force[n, c]
        for k in range(spins):
            out[5, c] += reals[B.SPIN] * force[B.BETA + k, c]
    out[5, 11] += by_speed
    out[5, m] += work[B.S_CAGE_SLOPE] * work[base + B.PSI]
    q3, q4, turn = work[base + 3], work[base + 4], work[base + B.THETA]
    for k in range(3):
        # a x G_a with da = p x a, and g
        px, py, pz = (1.0 if k == 0 else 0.0), (1.0 if k == 1 else 0.0), (1.0 if k == 2 else 0.0)
        dx, dy, dz = py * az - pz * ay, pz * ax - px * az, px * ay - py * ax
        out[3, 3 + k] += turn * bend[k] - dz * q4
        out[4, 3 + k] += turn * bend[3 + k] + dz * q3
        out[5, 3 + k] += turn * bend[6 + k] + dx * q4 - dy * q3


@njit(cache=True, error_model="numpy", forceinline=True)
def by_variations(ints, reals, work, by_q, by_rate, by_cage, bend, out):
    """Write the derivatives of one generalised force by the local variations and the states.

    With a turn p of the inner ring da = p x a and da' = w x (p x a), with its angular velocity da' = dw x a. With the
    derivatives s = (s_x, s_y, 0) by a and r = (r_x, r_y, 0) by a' that makes

        p . [a x s + r (w . a) - w (r . a)],        dw . (a x r).

    Parameters
    ----------
    ints, reals, work
        As in `bearing_force`.
    by_q, by_rate : ndarray, shape (n,)
        Its derivatives by q and q'.
    by_cage : float
        Its derivative by the speed of the cage, through the centrifugal load.
    bend : ndarray, shape (9,)
        Derivatives of g, see `inner_angle_bend`.
    out : ndarray, shape (13 + states,)
    """
    ax, ay, az = work[B.S_A], work[B.S_A + 1], work[B.S_A + 2]
    wx, wy, wz = work[B.S_W], work[B.S_W + 1], work[B.S_W + 2]
    q3, q4, r3, r4 = by_q[3], by_q[4], by_rate[3], by_rate[4]
    cage_speed, spins = work[B.S_CAGE], ints[B.SPINS]
    for k in range(3):
        out[k], out[6 + k] = by_q[k], by_rate[k]
    out[3] = -q4 * az + r3 * (wy * ay + wz * az) - r4 * wx * ay
    out[4] = q3 * az - r3 * wy * ax + r4 * (wz * az + wx * ax)
    out[5] = q4 * ax - q3 * ay - wz * (r3 * ax + r4 * ay)
    out[9], out[10], out[11] = -r4 * az, r3 * az, r4 * ax - r3 * ay + by_rate[B.PSI] * cage_speed
    if ints[B.INNER_NODES]:
        for k in range(3):
            turn = work[B.S_TURN + k]
            swung = wx * bend[k] + wy * bend[3 + k] + wz * bend[6 + k]
            out[3 + k] += by_q[B.THETA] * turn + by_rate[B.THETA] * swung
            out[9 + k] += by_rate[B.THETA] * turn
    # with the cage's angle its rate changes
    swing = work[B.S_CAGE_SLOPE] * wz
    out[11] += by_cage * cage_speed
    out[12] = by_cage
    out[13] = by_q[B.PSI] + swing * (by_rate[B.PSI] + by_cage)
    for k in range(spins):
        out[11] += by_rate[B.BETA + k] * reals[B.SPIN]
        out[14 + k] = by_q[B.BETA + k]


@njit(cache=True, error_model="numpy")
def to_global_jacobian(ints, reals, frames, work, wrench, jac):
    """Turn the local derivatives into those by the variations of both frames, in global components.

    Local coordinates are A_J^T x, so that they change with a turn of J by A_J^T (x x dpi_J). With D, V, P and W for a
    row's derivatives by d, d', the turn of I in J and w, in global components, and s for that by w_J . z:

        dR_I    D - V x w_J                                       dR_J    the opposite
        dpi_I   P                                                 dpi_J   D x d + V x d' + W x w - P + s z x w_J
        dv_I    V                                                 dv_J    the opposite
        dw_I    W                                                 dw_J    -W + V x d + s z

    F and N themselves turn with J: dpi_J x F, dpi_J x N.
    """
    spins = ints[B.SPINS]
    n, m, states = B.BETA + spins, B.VARIATIONS, 1 + spins
    at = B.variations(n) + (n + 1) * (m + states)
    local = matrix_at(work, at, 6, m + states)
    at += 6 * (m + states) + 9
    turned = vector_at(work, at, m)
    d, v, w = vector_at(work, at + m, 3), vector_at(work, at + m + 3, 3), vector_at(work, at + m + 6, 3)
    for c in range(3):
        d[c] = frames[0, FRAME_P + c] - frames[1, FRAME_P + c]
        v[c] = w[c] = 0.0
        for k in range(3):
            v[c] += frames[1, FRAME_A + 3 * c + k] * work[B.S_RATES + k]
            w[c] += frames[1, FRAME_A + 3 * c + k] * work[B.S_W + k]
    for b in range(0, 6, 3):
        for row in range(3):
            r = b + row
            e0, e1, e2 = (
                frames[1, FRAME_A + 3 * row],
                frames[1, FRAME_A + 3 * row + 1],
                frames[1, FRAME_A + 3 * row + 2],
            )
            for group in range(0, 12, 3):
                x = e0 * local[b, group] + e1 * local[b + 1, group] + e2 * local[b + 2, group]
                y = e0 * local[b, group + 1] + e1 * local[b + 1, group + 1] + e2 * local[b + 2, group + 1]
                z = e0 * local[b, group + 2] + e1 * local[b + 1, group + 2] + e2 * local[b + 2, group + 2]
                for c in range(3):
                    axes = FRAME_A + 3 * c
                    turned[group + c] = x * frames[1, axes] + y * frames[1, axes + 1] + z * frames[1, axes + 2]
            turned[12] = e0 * local[b, 12] + e1 * local[b + 1, 12] + e2 * local[b + 2, 12]
            for c in range(3):
                c1, c2 = (c + 1) % 3, (c + 2) % 3
                z, z1, z2 = (
                    frames[1, FRAME_A + 3 * c + 2],
                    frames[1, FRAME_A + 3 * c1 + 2],
                    frames[1, FRAME_A + 3 * c2 + 2],
                )
                w1, w2 = frames[1, FRAME_W + c1], frames[1, FRAME_W + c2]
                by_d, by_v, by_w = turned[c], turned[6 + c], turned[9 + c]
                jac[r, c] = by_d - (turned[6 + c1] * w2 - turned[6 + c2] * w1)
                jac[r, 12 + c] = -jac[r, c]
                jac[r, 3 + c] = turned[3 + c]
                jac[r, 6 + c], jac[r, 18 + c] = by_v, -by_v
                jac[r, 9 + c] = by_w
                jac[r, 21 + c] = -by_w + turned[6 + c1] * d[c2] - turned[6 + c2] * d[c1] + turned[12] * z
                about = turned[c1] * d[c2] - turned[c2] * d[c1]
                about += turned[6 + c1] * v[c2] - turned[6 + c2] * v[c1]
                about += turned[9 + c1] * w[c2] - turned[9 + c2] * w[c1]
                jac[r, 15 + c] = about - turned[3 + c] + turned[12] * (z1 * w2 - z2 * w1)
            for k in range(states):
                jac[r, 24 + k] = e0 * local[b, m + k] + e1 * local[b + 1, m + k] + e2 * local[b + 2, m + k]
        for c in range(3):
            # dpi_J x F, dpi_J x N
            c1, c2 = (c + 1) % 3, (c + 2) % 3
            jac[b + c1, 15 + c] -= wrench[0, b + c2]
            jac[b + c2, 15 + c] += wrench[0, b + c1]
    for k in range(states):
        factor = work[B.S_CAGE] if k == 0 else reals[B.SPIN]
        for c in range(3):
            c1, c2 = (c + 1) % 3, (c + 2) % 3
            z = frames[1, FRAME_A + 3 * c + 2]
            jac[6 + k, 9 + c], jac[6 + k, 21 + c] = factor * z, -factor * z
            turn = frames[1, FRAME_A + 3 * c1 + 2] * w[c2] - frames[1, FRAME_A + 3 * c2 + 2] * w[c1]
            jac[6 + k, 15 + c] = factor * turn
    jac[6, 24] = work[B.S_CAGE_SLOPE] * work[B.S_W + 2]
