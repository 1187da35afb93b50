"""Forces of one strip of the face: pressure, ends of the face, stiffness that varies along the path of contact."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.forces import derived as D
from gearmbs.contact.laws import friction_law
from gearmbs.contact.places import end_roll, limit_slopes
from gearmbs.contact.records import inlined, kernel, summing
from gearmbs.contact.slices import (
    Cut,
    end_force,
    moving_end,
    node_forces,
    node_slopes,
    slice_forces,
    slice_slopes,
    touching_parts,
)
from gearmbs.dae.equations.loads.forces import friction_over_speed


@kernel
def strip_forces(wheels, scratch, law, strip, node, low, high, share, totals, want):
    """Integrate the pressure over the slices of a strip, to nodal forces in ``scratch.loads``.

    Parameters
    ----------
    wheels, scratch : record
        The face's limits are those of ``scratch.pair``.
    law : Law
    strip : record
        Sections with gaps and rates.
    node : float
        The strip's first node.
    low, high : float
        First and last node of the strip that count.
    share : float
        1, or -1 for forces to be taken away.
    totals : record
        Diagnostics.
    want : int
        Nonzero to fill derivatives.

    Returns
    -------
    float
        Largest penetration; 0 if nothing touches.
    """
    side, pair, loads = scratch.side, scratch.pair, scratch.loads
    cut = Cut(pair.low - node, pair.high - node, low, high, -node, side.slices - 1.0 - node)
    touching_parts(strip, loads, L.LANES, cut)
    touching = False
    for i in range(L.LANES):
        touching = touching or loads.depth[i] > 0.0
    if not touching:
        return 0.0
    slice_forces(law, strip, loads, L.LANES, share * side.step, want)
    depth = node_forces(loads, L.LANES, totals)
    if want != 0:
        slice_slopes(strip, loads, L.LANES)
    first = int(min(max(np.floor(cut.low), cut.begin), cut.end))
    if 0 <= first < L.LANES and loads.depth[first] > 0.0:
        face_end(wheels, scratch, law, strip, first, cut.low - first, -1.0, share, want)
    last = int(min(max(np.ceil(cut.high) - 1.0, cut.begin), cut.end))
    if 0 <= last < L.LANES and loads.depth[last] > 0.0:
        face_end(wheels, scratch, law, strip, last, cut.high - last, 1.0, share, want)
    if want != 0:
        node_slopes(loads, L.LANES)
    return depth


@kernel
def face_end(wheels, scratch, law, strip, i, u, end, share, want):
    """Add what an end of the face that cuts slice ``i`` does: its own force, and its motion in the derivatives.

    Parameters
    ----------
    wheels, scratch : record
    law : Law
    strip : record
    i : int
        Slice of the strip that the face ends in.
    u : float
        Where in it, as a fraction.
    end : float
        -1 at the lower end, +1 at the higher.
    share : float
        1, or -1 for forces to be taken away.
    want : int
        Nonzero to add derivatives.
    """
    side, pair, loads = scratch.side, scratch.pair, scratch.loads
    limit = scratch.low if end < 0.0 else scratch.high
    roll = end_roll(side, wheels, end, pair.roll)
    limit_slopes(side, wheels, end, roll, limit, want)
    end_force(law, strip, i, side.step, u, end * share, limit, pair, scratch.sums, want)
    clipped = loads.clip_low[i] if end < 0.0 else loads.clip_high[i]
    if want != 0 and clipped == 0.0:
        moving_end(loads, i, end < 0.0, limit, side.step)


@kernel
def add_stiffness_gradient(sums, pair, strip, loads, n, want):
    """Complete the derivatives of nodal forces for a stiffness that varies along the path of contact."""
    if want == 0:
        return
    inverse = 1.0 / pair.stiffness_factor
    for k in range(6):
        # f is in proportion to the factor s: df/dx = f s_x / s
        relative = pair.stiffness_factor_x[k] * inverse
        for j in range(n):
            loads.force_x[k, j] += loads.force[j] * relative
    for j in range(n):
        # and Q has -U s_x / s, in which U changes with the gaps by dU/dg = -f_elastic
        elastic = loads.elastic[j] * inverse
        for k in range(6):
            for i in range(6):
                sums.q_x[i, k] += elastic * strip.grad[k, j] * pair.stiffness_factor_x[i]


@kernel
def finish_stiffness_gradient(sums, pair, energy, want):
    """Add the force of a stiffness that varies along the path, from the pair's elastic energy."""
    ratio = energy / pair.stiffness_factor
    for i in range(6):
        # Q = -dU/dx at fixed gaps: -U s_x / s
        sums.q[i] -= ratio * pair.stiffness_factor_x[i]
    if want == 0:
        return
    for i in range(6):
        for k in range(6):
            moved = pair.moved[k] / pair.stiffness_factor
            sums.q_x[i, k] -= ratio * pair.stiffness_factor_xx[i, k] + moved * pair.stiffness_factor_x[i]


# Products of small matrices, and sums over the sections of a strip of products of rows.


@inlined
def row_of(matrix, i):
    """Row of a matrix, six numbers."""
    return matrix[i, 0], matrix[i, 1], matrix[i, 2], matrix[i, 3], matrix[i, 4], matrix[i, 5]


@inlined
def column_of(matrix, i):
    """Column of a matrix, six numbers."""
    return matrix[0, i], matrix[1, i], matrix[2, i], matrix[3, i], matrix[4, i], matrix[5, i]


@inlined
def dot(a, b):
    """Scalar product of six numbers and six others."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@inlined
def add_product(out, left, right, n):
    """Add the product of a 6 x 6 matrix and one of ``n`` columns, all columns side by side: ``out += left right``."""
    a, b, c = row_of(left, 0), row_of(left, 1), row_of(left, 2)
    d, e, f = row_of(left, 3), row_of(left, 4), row_of(left, 5)
    for j in range(n):
        x = column_of(right, j)
        out[0, j] += dot(a, x)
        out[1, j] += dot(b, x)
        out[2, j] += dot(c, x)
        out[3, j] += dot(d, x)
        out[4, j] += dot(e, x)
        out[5, j] += dot(f, x)


@inlined
def add_transposed_product(out, left, right, n):
    """Add the product of a transposed 6 x 6 matrix and one of ``n`` columns: ``out += left^T right``."""
    a, b, c = column_of(left, 0), column_of(left, 1), column_of(left, 2)
    d, e, f = column_of(left, 3), column_of(left, 4), column_of(left, 5)
    for j in range(n):
        x = column_of(right, j)
        out[0, j] += dot(a, x)
        out[1, j] += dot(b, x)
        out[2, j] += dot(c, x)
        out[3, j] += dot(d, x)
        out[4, j] += dot(e, x)
        out[5, j] += dot(f, x)


@inlined
def add_six(total, i, row):
    """Add six numbers to a row of a matrix."""
    v0, v1, v2, v3, v4, v5 = row
    total[i, 0] += v0
    total[i, 1] += v1
    total[i, 2] += v2
    total[i, 3] += v3
    total[i, 4] += v4
    total[i, 5] += v5


@summing
def add_outer(total, a, b, n):
    """Add the sum over the sections of ``a b^T``, the product of all rows of two quantities."""
    for i in range(6):
        v0 = v1 = v2 = v3 = v4 = v5 = 0.0
        for j in range(n):
            x = a[i, j]
            v0 += x * b[0, j]
            v1 += x * b[1, j]
            v2 += x * b[2, j]
            v3 += x * b[3, j]
            v4 += x * b[4, j]
            v5 += x * b[5, j]
        add_six(total, i, (v0, v1, v2, v3, v4, v5))


@summing
def add_stack(total, stack, n):
    """Add the sum over the sections of a matrix a section."""
    for i in range(6):
        v0 = v1 = v2 = v3 = v4 = v5 = 0.0
        for j in range(n):
            v0 += stack[i, 0, j]
            v1 += stack[i, 1, j]
            v2 += stack[i, 2, j]
            v3 += stack[i, 3, j]
            v4 += stack[i, 4, j]
            v5 += stack[i, 5, j]
        add_six(total, i, (v0, v1, v2, v3, v4, v5))


@summing
def add_curvatures(total, weight, hess, n):
    """Add the sum over the sections of symmetric matrices, given by their upper triangles, times a weight."""
    for i in range(6):
        for k in range(i, 6):
            value = 0.0
            for j in range(n):
                value += weight[j] * hess[i, k, j]
            total[i, k] += value
            if k > i:
                total[k, i] += value


# From nodal forces to generalised forces and the friction wrench, and their derivatives.


@kernel
def clear_sums(sums, want):
    """Set all sums to nothing."""
    for i in range(6):
        sums.q[i] = sums.f[i] = 0.0
        if want != 0:
            for j in range(6):
                sums.q_x[i, j] = sums.q_xd[i, j] = 0.0
                sums.f_x[i, j] = sums.f_twist[i, j] = sums.f_xd[i, j] = 0.0


@summing
def total_force(loads, n):
    """Sum of the nodal forces."""
    total = 0.0
    for j in range(n):
        total += loads.force[j]
    return total


@summing
def add_normal(sums, strip, loads, n, want):
    """Add the nodes' normal forces: Q grows by f dg/dx."""
    force, grad = loads.force, strip.grad
    for i in range(6):
        value = 0.0
        for j in range(n):
            value += force[j] * grad[i, j]
        sums.q[i] += value
    if want == 0:
        return
    # Q = f g_x: Q_x = g_x f_x^T + f g_xx, Q_x' = g_x f_x'^T
    add_outer(sums.q_x, grad, loads.force_x, n)
    add_curvatures(sums.q_x, force, strip.hess, n)
    add_outer(sums.q_xd, grad, loads.force_xd, n)


@inlined
def point_of(side, strip, loads, j):
    """Return where friction acts in a section: normal, the contact point's place, and how the contact line leans."""
    place = strip.zeta[j] + 0.5 * side.x[L.H]
    return strip.sin[j], strip.cos[j], loads.normal[j], loads.tangent[j], place, side.lean, side.across


@inlined
def twist_of(side):
    """Return the twist of wheel 1 relative to wheel 2 as seen on this side of the teeth."""
    twist = side.twist
    return twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]


@kernel
def sliding_speeds(side, strip, loads, n):
    """Fill the sliding velocity of wheel 1 against wheel 2 at the contact points, without its part along the normal."""
    twist = twist_of(side)
    for j in range(n):
        loads.v_profile[j], loads.v_axial[j] = D.sliding(*twist, *point_of(side, strip, loads, j))


@kernel
def friction_ratios(wheels, kind, loads, n):
    """Fill the friction coefficient over the sliding speed, and the derivative of that ratio."""
    mu_s, mu_d, v_s, v_d = wheels.static_friction, wheels.dynamic_friction, wheels.static_speed, wheels.dynamic_speed
    if kind != L.FRICTION_ADAMS:
        for j in range(n):
            vt, vz = loads.v_profile[j], loads.v_axial[j]
            loads.ratio[j], loads.ratio_slope[j] = friction_law(kind, mu_s, mu_d, v_s, v_d, np.sqrt(vt * vt + vz * vz))
        return
    for j in range(n):
        vt, vz = loads.v_profile[j], loads.v_axial[j]
        loads.ratio[j], loads.ratio_slope[j] = friction_over_speed(mu_s, mu_d, v_s, v_d, np.sqrt(vt * vt + vz * vz))


@summing
def friction_forces(side, sums, strip, loads, n, totals):
    """Add the wrench of friction and its power."""
    twist, f = twist_of(side), sums.f
    f0 = f1 = f2 = f3 = f4 = f5 = power = 0.0
    for j in range(n):
        x0, x1, x2, x3, x4, x5, lost = D.friction_wrench(
            *twist, *point_of(side, strip, loads, j), loads.ratio[j], loads.force[j]
        )  # fmt: skip
        f0, f1, f2, f3, f4, f5, power = f0 + x0, f1 + x1, f2 + x2, f3 + x3, f4 + x4, f5 + x5, power + lost
    f[0], f[1], f[2], f[3], f[4], f[5] = f[0] + f0, f[1] + f1, f[2] + f2, f[3] + f3, f[4] + f4, f[5] + f5
    totals.friction_power -= power


@inlined
def friction_along(twist, point, laws, strip, loads, j, k, place):
    """Fill how friction in section ``j`` moves with pose number ``k``; ``place`` is that of the contact point's."""
    D.friction_along(
        *twist, *point, *laws, strip.alpha_x[k, j], loads.normal_x[k, j], loads.tangent_x[k, j], place,
        loads.force_x[k, j], loads.moved, k, j,
    )  # fmt: skip


@kernel
def friction_slopes(side, sums, strip, loads, n):
    """Add the derivatives of friction by the pose, by the twist, and by the pose's rates through the normal force."""
    twist = twist_of(side)
    for j in range(n):
        point = point_of(side, strip, loads, j)
        laws = (loads.ratio[j], loads.force[j], loads.ratio_slope[j])
        friction_along(twist, point, laws, strip, loads, j, 0, 0.0)
        friction_along(twist, point, laws, strip, loads, j, 1, 0.5)
        friction_along(twist, point, laws, strip, loads, j, 2, 0.0)
        friction_along(twist, point, laws, strip, loads, j, 3, 0.0)
        friction_along(twist, point, laws, strip, loads, j, 4, 0.0)
        friction_along(twist, point, laws, strip, loads, j, 5, 0.0)
    add_stack(sums.f_x, loads.moved, n)
    for j in range(n):
        laws = (loads.ratio[j], loads.force[j], loads.ratio_slope[j])
        D.friction_by_twist(*twist, *point_of(side, strip, loads, j), *laws, loads.moved, loads.sliding, j)
    add_stack(sums.f_twist, loads.moved, n)
    add_outer(sums.f_xd, loads.sliding, loads.force_xd, n)


@kernel
def add_friction(wheels, kind, side, sums, strip, loads, n, totals, want):
    """Add the nodes' friction on wheel 1 at their contact points.

    It has a component along the profile and one along the face.

    Parameters
    ----------
    wheels : record
        The pair's table.
    kind : int
        Friction law.
    side, sums, strip, loads : record
    n : int
        Sections.
    totals : record
        Diagnostics.
    want : int
        Nonzero to add derivatives.
    """
    sliding_speeds(side, strip, loads, n)
    friction_ratios(wheels, kind, loads, n)
    friction_forces(side, sums, strip, loads, n, totals)
    if want != 0:
        friction_slopes(side, sums, strip, loads, n)


@kernel
def mirror(sums, want):
    """Reflect all sums in the plane of the axes: the other flanks are the same problem seen in a mirror."""
    for i in range(6):
        # of the pose q, phi_1 and phi_2 change sign, of twists and wrenches every second number
        si = -1.0 if i > 2 else 1.0
        fi = -1.0 if i % 2 == 1 else 1.0
        sums.q[i] *= si
        sums.f[i] *= fi
        if want == 0:
            continue
        for j in range(6):
            sj = -1.0 if j > 2 else 1.0
            fj = -1.0 if j % 2 == 1 else 1.0
            sums.q_x[i, j] *= si * sj
            sums.q_xd[i, j] *= si * sj
            sums.f_x[i, j] *= fi * sj
            sums.f_twist[i, j] *= fi * fj
            sums.f_xd[i, j] *= fi * sj
