"""What the equations ask of a body: its row of the kinematics table, its rows of the residual and their derivatives.

All that depends on the kind of a body and is compiled stands here, or is called from here: the loops over bodies of
`gearmbs.dae.equations.residual`, ``jacobian`` and their like hand each body to these functions and do not know what it
is. A body without Euler angles keeps its orientation: its row has no axes, no angular velocity and no angular momentum,
so that moments do nothing to it.
"""

from __future__ import annotations

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.inertia import (
    add_momentum,
    modal_residual,
    set_modal_momenta,
    update_inertia,
)
from gearmbs.dae.equations.bodies.inertia_entries import modal_body_entries
from gearmbs.dae.equations.constraints.terms import cross3, dot3
from gearmbs.dae.equations.rotation import (
    KIN_A,
    KIN_ADOT,
    KIN_AXES,
    KIN_FORCE,
    KIN_H,
    KIN_MOMENT,
    KIN_R,
    KIN_SHIFT,
    KIN_TURN,
    KIN_V,
    KIN_W,
    POSE_A,
    POSE_R,
    POSE_V,
    POSE_W,
    axes_and_velocity,
    axes_of,
    euler_angles,
    euler_rates,
    matrix_of,
)
from gearmbs.dae.equations.unknowns import put
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES

J_AXES, J_AXIS_RATES, TURNED_MOMENTUM, CROSS = 0, 9, 18, 30
"""Places in the scratch of `body_entries`: J a_m, J adot_m, and dh/dtheta_m = a_m x h + J adot_m, three vectors each;
then two vectors that come and go."""
CROSS_2 = CROSS + 3


@njit(cache=True, error_model="numpy", forceinline=True)
def has_angles(at):
    """Return whether a body, given its places, has Euler angles."""
    return at[T.AT_ANGLES] > 0


# --- kinematics ----------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy", forceinline=True)
def inertia_times(kin_row, body_row, v, i, out, k, s):
    """Write J_global v to ``out[k:k+3]``; ``s`` has three scratch places."""
    for c in range(3):
        s[c] = kin_row[KIN_A + c] * v[i] + kin_row[KIN_A + 3 + c] * v[i + 1] + kin_row[KIN_A + 6 + c] * v[i + 2]
    q = T.BODY_INERTIA
    x = dot3(body_row, q, s, 0)
    y = dot3(body_row, q + 3, s, 0)
    z = dot3(body_row, q + 6, s, 0)
    for c in range(3):
        a = KIN_A + 3 * c
        out[k + c] = kin_row[a] * x + kin_row[a + 1] * y + kin_row[a + 2] * z


@njit(cache=True, error_model="numpy", forceinline=True)
def update_ground(kin):
    """Set the ground's row: the global frame at rest, with no Euler axes."""
    row = kin[0]
    for c in range(row.size):
        row[c] = 0.0
    row[KIN_A] = row[KIN_A + 4] = row[KIN_A + 8] = 1.0


@njit(cache=True, error_model="numpy", forceinline=True)
def stand_still(at, modal, row):
    """Set a row of the kinematics table to the constant orientation of a body that does not turn."""
    for c in range(row.size):
        row[c] = 0.0
    for c in range(9):
        row[KIN_A + c] = modal[at[T.AT_MODAL] + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def update_body(y, at, code, body_row, modal, partial, turn, first, row, moment):
    """Fill a body's row of the kinematics table from its positions and velocities.

    Parameters
    ----------
    y
        Unknowns.
    at, body_row, row : ndarray
        The body's places, its mass and inertia, its row of the kinematics table.
    code : int
        Its Euler reference.
    modal, partial : ndarray
        Numbers of modal bodies and point masses, present state of modal bodies.
    turn, first : ndarray, int
        Sines of angles, and `LANES` places on their cosines; the body's three begin at ``first``.
    moment : ndarray
        Scratch, 3 places.
    """
    u, r = at[T.AT_U], at[T.AT_R]
    if not has_angles(at):
        stand_still(at, modal, row)
    for c in range(3):
        row[KIN_R + c] = y[r + c]
        row[KIN_V + c] = y[u + c]
    if not has_angles(at):
        return
    if at[T.AT_MODES] > 0:
        update_inertia(y, at, modal, partial, body_row)
    e = at[T.AT_EPS]
    turn_1 = turn[LANES + first], turn[first]
    turn_2 = turn[LANES + first + 1], turn[first + 1]
    turn_3 = turn[LANES + first + 2], turn[first + 2]
    matrix_of(turn_1, turn_2, turn_3, code, row, KIN_A)
    axes_of(turn_1, turn_2, y[e], y[e + 1], y[e + 2], row)
    inertia_times(row, body_row, row, KIN_W, row, KIN_H, moment)
    if at[T.AT_MODES] > 0:
        add_momentum(y, at, partial, row)


# --- residual ------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy", forceinline=True)
def body_residual(y, yp, at, body_row, gravity, modal, partial, kin, out):
    """Write a body's rows of eq. (5) and (6) without loads and constraints.

    Parameters
    ----------
    y, yp, out : ndarray
        Unknowns and their rates; the residual.
    at, body_row, kin : ndarray
        The body's places, its mass and inertia, its row of the kinematics table.
    gravity : ndarray, shape (3,)
        m/s^2.
    modal, partial : ndarray
        Numbers and present state of modal bodies.
    """
    u, r = at[T.AT_U], at[T.AT_R]
    for c in range(3):
        out[u + c] = body_row[T.BODY_MASS] * (yp[u + c] - gravity[c])
        out[r + c] = y[u + c] - yp[r + c]
    if not has_angles(at):
        return
    p, e, th = at[T.AT_P], at[T.AT_EPS], at[T.AT_THETA]
    for c in range(3):
        out[p + c] = yp[p + c] - dot3(kin, KIN_ADOT + 3 * c, kin, KIN_H)
        out[e + c] = y[p + c] - dot3(kin, KIN_AXES + 3 * c, kin, KIN_H)
        out[th + c] = y[e + c] - yp[th + c]
    if at[T.AT_MODES] > 0:
        modal_residual(y, yp, at, modal, partial, kin, out)


@njit(cache=True, error_model="numpy", forceinline=True)
def add_wrench(at, row, out):
    """Bring the forces added up in a body's row of the kinematics table to its rows of eq. (5), and mu to eq. (6)."""
    u, r = at[T.AT_U], at[T.AT_R]
    for c in range(3):
        out[u + c] += row[KIN_FORCE + c]
        out[r + c] -= row[KIN_SHIFT + c]
    if not has_angles(at):
        return
    p, th = at[T.AT_P], at[T.AT_THETA]
    for c in range(3):
        out[p + c] += dot3(row, KIN_AXES + 3 * c, row, KIN_MOMENT)
        out[th + c] -= dot3(row, KIN_AXES + 3 * c, row, KIN_TURN)


# --- Jacobian ------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy", forceinline=True)
def rigid_entries(mode, cj, y, at, body_row, kin, s, slot, vals, k):
    """Hand over the inertia terms of eq. (5) and (6) of a body that turns; return the number of the next entry.

    Parameters
    ----------
    mode, cj, y, at, body_row, kin, s, slot, vals, k
        As of `body_entries`.
    """
    u, p, e, r, th = at[T.AT_U], at[T.AT_P], at[T.AT_EPS], at[T.AT_R], at[T.AT_THETA]
    mass = body_row[T.BODY_MASS]
    for m in range(3):
        axis, axis_rate, turned = KIN_AXES + 3 * m, KIN_ADOT + 3 * m, TURNED_MOMENTUM + 3 * m
        inertia_times(kin, body_row, kin, axis, s, J_AXES + 3 * m, s[CROSS:CROSS_2])
        inertia_times(kin, body_row, kin, axis_rate, s, J_AXIS_RATES + 3 * m, s[CROSS:CROSS_2])
        cross3(kin, axis, kin, KIN_H, s, turned)
        for c in range(3):
            s[turned + c] += s[J_AXIS_RATES + 3 * m + c]
    for m in range(3):
        k = put(mode, slot, vals, k, u + m, u + m, mass * cj)
        k = put(mode, slot, vals, k, p + m, p + m, cj)
        k = put(mode, slot, vals, k, e + m, p + m, 1.0)
        k = put(mode, slot, vals, k, r + m, u + m, 1.0)
        k = put(mode, slot, vals, k, r + m, r + m, -cj)
        k = put(mode, slot, vals, k, th + m, e + m, 1.0)
        k = put(mode, slot, vals, k, th + m, th + m, -cj)
        for n in range(3):
            # L_eps_m = a_m . h
            k = put(mode, slot, vals, k, e + m, e + n, -dot3(kin, KIN_AXES + 3 * m, s, J_AXES + 3 * n))
            mixed_mn = dot3(kin, KIN_ADOT + 3 * n, s, J_AXES + 3 * m)
            if m < n:
                cross3(kin, KIN_AXES + 3 * m, kin, KIN_AXES + 3 * n, s, CROSS)
                mixed_mn += dot3(s, CROSS, kin, KIN_H)
            # d2T/d(eps_m)d(theta_n) serves p - L_eps and p' - L_theta
            k = put(mode, slot, vals, k, e + m, th + n, -mixed_mn)
            k = put(mode, slot, vals, k, p + n, e + m, -mixed_mn)
    for m in range(3):
        for n in range(3):
            value = dot3(kin, KIN_ADOT + 3 * m, s, TURNED_MOMENTUM + 3 * n)
            if n < m:
                # d(adot_m)/d(theta_n) . h, with adot_m = sum_{l<m} eps_l a_l x a_m
                for l in range(m):
                    lo, hi = min(n, l), max(n, l)
                    cross3(kin, KIN_AXES + 3 * hi, kin, KIN_AXES + 3 * m, s, CROSS)
                    cross3(kin, KIN_AXES + 3 * lo, s, CROSS, s, CROSS_2)
                    value += y[e + l] * dot3(s, CROSS_2, kin, KIN_H)
            k = put(mode, slot, vals, k, p + m, th + n, -value)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def body_entries(mode, cj, y, at, body_row, modal, partial, kin, s, slot, vals, k):
    """Hand over the entries of a body's inertia in eq. (5) and (6); return the number of the next entry.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`.
    cj : float
        Factor of y'.
    y
        Unknowns.
    at, body_row, kin : ndarray
        The body's places, its mass and inertia, its row of the kinematics table.
    modal, partial : ndarray
        Numbers and present state of modal bodies.
    s : ndarray
        Scratch, 36 places.
    """
    if has_angles(at):
        k = rigid_entries(mode, cj, y, at, body_row, kin, s, slot, vals, k)
        if at[T.AT_MODES] > 0:
            k = modal_body_entries(mode, cj, y, at, modal, partial, kin, s, slot, vals, k)
        return k
    u, r = at[T.AT_U], at[T.AT_R]
    for m in range(3):
        k = put(mode, slot, vals, k, u + m, u + m, body_row[T.BODY_MASS] * cj)
        k = put(mode, slot, vals, k, r + m, u + m, 1.0)
        k = put(mode, slot, vals, k, r + m, r + m, -cj)
    return k


# --- other coordinates ---------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy", forceinline=True)
def displace_body(b, y, d, w, at, kin, s):
    """Move a body of y by its spatial displacements in ``d`` and change its spatial velocities by those in ``w``.

    Its row of the kinematics table must be up to date; conjugate momenta are left alone.

    Parameters
    ----------
    b : int
        The body.
    y, d, w : ndarray
        Unknowns; changes over all spatial displacements.
    at, kin : ndarray
        The body's places; the kinematics table.
    s : ndarray
        Scratch, 9 places.
    """
    i = at[T.AT_V]
    for c in range(3):
        y[at[T.AT_R] + c] += d[i + c]
        y[at[T.AT_U] + c] += w[i + c]
    for m in range(at[T.AT_MODES]):
        y[at[T.AT_QF] + m] += d[at[T.AT_V_MODES] + m]
        y[at[T.AT_VF] + m] += w[at[T.AT_V_MODES] + m]
    if not has_angles(at):
        return
    e, th = at[T.AT_EPS], at[T.AT_THETA]
    for c in range(3):
        s[c] = d[i + 3 + c]
        s[3 + c] = kin[b, KIN_W + c] + w[i + 3 + c]
    euler_rates(kin, b, s, 0, s, 6)
    for c in range(3):
        y[th + c] += s[6 + c]
    # the new rates give the corrected velocity about the displaced axes
    axes_and_velocity(y[th], y[th + 1], 0.0, 0.0, 0.0, kin, b)
    euler_rates(kin, b, s, 3, y, e)


@njit(cache=True, error_model="numpy", forceinline=True)
def body_from_pose(b, pose, y, at, code, body_row, modal, partial, kin, s):
    """Fill a body's positions, velocities and momenta in y from its pose; its modal coordinates are there already.

    Parameters
    ----------
    b, code : int
        The body, and its Euler reference.
    pose : ndarray
        Columns ``POSE_*``.
    y
        Unknowns, written.
    at, body_row : ndarray
        The body's places, its mass and inertia.
    modal, partial : ndarray
        Numbers and present state of modal bodies.
    kin, s : ndarray
        Kinematics table; scratch, 3 places.
    """
    for c in range(3):
        y[at[T.AT_R] + c] = pose[POSE_R + c]
        y[at[T.AT_U] + c] = pose[POSE_V + c]
    if not has_angles(at):
        return
    if at[T.AT_MODES] > 0:
        update_inertia(y, at, modal, partial, body_row)
    th, e, p = at[T.AT_THETA], at[T.AT_EPS], at[T.AT_P]
    for c in range(9):
        kin[b, KIN_A + c] = pose[POSE_A + c]
    euler_angles(pose, POSE_A, code, y, th)
    axes_and_velocity(y[th], y[th + 1], 0.0, 0.0, 0.0, kin, b)
    euler_rates(kin, b, pose, POSE_W, y, e)
    inertia_times(kin[b], body_row, pose, POSE_W, kin[b], KIN_H, s)
    if at[T.AT_MODES] > 0:
        for c in range(3):
            kin[b, KIN_W + c] = pose[POSE_W + c]
        add_momentum(y, at, partial, kin[b])
        set_modal_momenta(y, at, modal, partial, kin[b])
    for m in range(3):
        y[p + m] = dot3(kin[b], KIN_AXES + 3 * m, kin[b], KIN_H)


def turning_rates(places, acc, y, yp, kin) -> None:
    """Write the rates of the bodies' Euler rates to y' from their spatial accelerations; their rows must be up to date.

    Parameters
    ----------
    places : list
        Row of the table ``at`` of each body but the ground.
    acc : ndarray
        Spatial accelerations and those of the modal coordinates.
    """
    for b, at in enumerate(places, start=1):
        if at[T.AT_ANGLES]:
            v, e = at[T.AT_V], at[T.AT_EPS]
            adot = kin[b, KIN_ADOT : KIN_ADOT + 9].reshape(3, 3)
            euler_rates(kin, b, acc[v + 3 : v + 6] - y[e : e + 3] @ adot, 0, yp, e)
