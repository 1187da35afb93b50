"""Contact of a gear pair: wrench on the wheels and its exact derivatives from poses and velocities."""

from __future__ import annotations

from gearmbs.contact import layout as L
from gearmbs.contact.loads import add_product, add_transposed_product, clear_sums, mirror
from gearmbs.contact.pair import side_contacts
from gearmbs.contact.pose import pose_columns, pose_rate_slopes, pose_rates, pose_wrench, relative_pose
from gearmbs.contact.records import inlined, kernel, options_at, pair_at, scratch_at
from gearmbs.contact.root import root_contacts
from gearmbs.contact.search import open_side, set_twist
from gearmbs.dae.equations.loads.forces import DERIVATIVES, FORCE_SIG, FRAME_A, FRAME_COLUMNS, FRAME_P, FRAME_V, FRAME_W
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import matrix_at, vector_at

COUPLED = 1e-10
"""Part of the largest entry of a block of derivatives up to which others are rounding."""
VEC = types.float64[::1]
MAT = types.float64[:, ::1]
GEAR_CONTACT_SIG = types.void(
    types.int64[::1], VEC, VEC, MAT, VEC, VEC, VEC, MAT, VEC, VEC, VEC, MAT, VEC, types.int64, VEC
)


@kernel
def relative_twist(R1, v1, w1, R2, v2, w2, motion):
    """Twist of wheel 1 relative to wheel 2 at R1, in the mean frame."""
    dx = R1[0] - R2[0]
    dy = R1[1] - R2[1]
    dz = R1[2] - R2[2]
    vx = v1[0] - v2[0] - (w2[1] * dz - w2[2] * dy)
    vy = v1[1] - v2[1] - (w2[2] * dx - w2[0] * dz)
    vz = v1[2] - v2[2] - (w2[0] * dy - w2[1] * dx)
    ox = w1[0] - w2[0]
    oy = w1[1] - w2[1]
    oz = w1[2] - w2[2]
    frame, twist = motion.frame, motion.twist
    for k in range(3):
        twist[k] = frame[0, k] * vx + frame[1, k] * vy + frame[2, k] * vz
        twist[3 + k] = frame[0, k] * ox + frame[1, k] * oy + frame[2, k] * oz


@kernel
def wrench_slopes(motion, sums, n):
    """Derivatives of the wrench W = G^T Q + F by the pose and by the relative twist.

    Both depend on the pose's rates, which are ``G twist``, through ``D = G^T dQ/d(dx/dt) + dF/d(dx/dt)``. ``n`` is
    the number of columns worked on side by side, `layout.PADDED`.
    """
    G, by_x, by_twist, by_xd = motion.columns, motion.by_x, motion.by_twist, motion.by_xd
    f_x, f_twist, f_xd, wrench_x = sums.f_x, sums.f_twist, sums.f_xd, motion.wrench_x
    for i in range(6):
        for j in range(n):
            by_x[i, j] = f_x[i, j] + wrench_x[i, j]
            by_twist[i, j] = f_twist[i, j]
            by_xd[i, j] = f_xd[i, j]
    add_transposed_product(by_xd, G, sums.q_xd, n)
    add_transposed_product(by_x, G, sums.q_x, n)
    add_product(by_x, by_xd, motion.xd_x, n)
    add_product(by_twist, by_xd, G, n)


@kernel
def turn_effects(turn, v, wrench, twist_turn, jac):
    """Fill how twist and wrench, constant in space, change in components of the turning mean frame.

    ``twist_turn`` is what that does to the twist, ``jac`` what it does to the wrench.
    """
    v0, v1, v2, v3, v4, v5 = v[0], v[1], v[2], v[3], v[4], v[5]
    f0, f1, f2, m0, m1, m2 = wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5]
    for j in range(turn.shape[1]):
        ux, uy, uz = turn[0, j], turn[1, j], turn[2, j]
        twist_turn[0, j] = uz * v1 - uy * v2
        twist_turn[1, j] = ux * v2 - uz * v0
        twist_turn[2, j] = uy * v0 - ux * v1
        twist_turn[3, j] = uz * v4 - uy * v5
        twist_turn[4, j] = ux * v5 - uz * v3
        twist_turn[5, j] = uy * v3 - ux * v4
        jac[0, j] = uy * f2 - uz * f1
        jac[1, j] = uz * f0 - ux * f2
        jac[2, j] = ux * f1 - uy * f0
        jac[3, j] = uy * m2 - uz * m1
        jac[4, j] = uz * m0 - ux * m2
        jac[5, j] = ux * m1 - uy * m0


@kernel
def own_columns(motion, w2, n):
    """Derivatives of the wrench by displacements of wheel 1, in the mean frame: ``motion.jac``.

    ``n`` is the number of columns worked on side by side, `layout.PADDED`.
    """
    frame, twist_turn, jac = motion.frame, motion.twist_turn, motion.jac
    turn_effects(motion.turn, motion.twist, motion.wrench, twist_turn, jac)
    # the twist is that at the origin of wheel 1, which moves through the velocities of wheel 2's turning
    s0 = frame[0, 0] * w2[0] + frame[1, 0] * w2[1] + frame[2, 0] * w2[2]
    s1 = frame[0, 1] * w2[0] + frame[1, 1] * w2[1] + frame[2, 1] * w2[2]
    s2 = frame[0, 2] * w2[0] + frame[1, 2] * w2[1] + frame[2, 2] * w2[2]
    twist_turn[1, 0] -= s2
    twist_turn[2, 0] += s1
    twist_turn[0, 1] += s2
    twist_turn[2, 1] -= s0
    twist_turn[0, 2] -= s1
    twist_turn[1, 2] += s0
    add_product(jac, motion.by_x, motion.columns, n)
    add_product(jac, motion.by_twist, twist_turn, n)


@kernel
def turn_to_global(motion, jac):
    """Turn the columns of wheel 1 from the mean frame into global components, block by block: ``M J M^T``."""
    turn_blocks(motion.jac, motion.frame, jac, 0)
    turn_blocks(motion.by_twist, motion.frame, jac, 6)


@kernel
def turn_blocks(own, m, jac, first):
    """Turn the four blocks of a 6 x 6 matrix into global components, to the columns of ``jac`` from ``first`` on."""
    for b in range(0, 6, 3):
        for c in range(0, 6, 3):
            for k in range(3):
                mx, my, mz = m[k, 0], m[k, 1], m[k, 2]
                m0 = own[b, c] * mx + own[b, c + 1] * my + own[b, c + 2] * mz
                m1 = own[b + 1, c] * mx + own[b + 1, c + 1] * my + own[b + 1, c + 2] * mz
                m2 = own[b + 2, c] * mx + own[b + 2, c + 1] * my + own[b + 2, c + 2] * mz
                jac[b, first + c + k] = m[0, 0] * m0 + m[0, 1] * m1 + m[0, 2] * m2
                jac[b + 1, first + c + k] = m[1, 0] * m0 + m[1, 1] * m1 + m[1, 2] * m2
                jac[b + 2, first + c + k] = m[2, 0] * m0 + m[2, 1] * m1 + m[2, 2] * m2


@kernel
def mate_columns(R1, v1, w1, R2, v2, w2, wrench, jac):
    """Complete the columns of wheel 2 from the invariance of contact under common motions of both wheels.

    Parameters
    ----------
    R1, v1, w1, R2, v2, w2 : ndarray, shape (3,)
        Places, velocities and angular velocities of the wheels.
    wrench : ndarray, shape (6,)
    jac : ndarray, shape (6, 24)
        In: columns of wheel 1; out: those of wheel 2, too.
    """
    dx, dy, dz = R2[0] - R1[0], R2[1] - R1[1], R2[2] - R1[2]
    ax, ay, az = v1[0] - v2[0], v1[1] - v2[1], v1[2] - v2[2]
    bx, by, bz = w1[0] - w2[0], w1[1] - w2[1], w1[2] - w2[2]
    for i in range(6):
        rx, ry, rz = jac[i, 0], jac[i, 1], jac[i, 2]
        px, py, pz = jac[i, 6], jac[i, 7], jac[i, 8]
        ox, oy, oz = jac[i, 9], jac[i, 10], jac[i, 11]
        jac[i, 12] = -rx
        jac[i, 13] = -ry
        jac[i, 14] = -rz
        # J_R2 = -J_R1 as for dv; the moment of dw2 about R1 joins J_w2
        jac[i, 18] = -px
        jac[i, 19] = -py
        jac[i, 20] = -pz
        jac[i, 21] = -ox + dy * pz - dz * py
        jac[i, 22] = -oy + dz * px - dx * pz
        jac[i, 23] = -oz + dx * py - dy * px
        jac[i, 15] = -jac[i, 3] + dy * rz - dz * ry
        jac[i, 16] = -jac[i, 4] + dz * rx - dx * rz
        jac[i, 17] = -jac[i, 5] + dx * ry - dy * rx
        # minus J_v (dpi x (v1 - v2)) and so on, J_w2 (dpi x w2) expanded
        qx, qy, qz = jac[i, 21] + ox, jac[i, 22] + oy, jac[i, 23] + oz
        jac[i, 15] -= ay * pz - az * py + by * oz - bz * oy + w2[1] * qz - w2[2] * qy
        jac[i, 16] -= az * px - ax * pz + bz * ox - bx * oz + w2[2] * qx - w2[0] * qz
        jac[i, 17] -= ax * py - ay * px + bx * oy - by * ox + w2[0] * qy - w2[1] * qx
    for b in range(0, 6, 3):
        fx, fy, fz = wrench[b], wrench[b + 1], wrench[b + 2]
        jac[b + 1, 15] -= fz
        jac[b + 2, 15] += fy
        jac[b + 2, 16] -= fx
        jac[b, 16] += fz
        jac[b, 17] -= fy
        jac[b + 1, 17] += fx


@kernel
def clear_rounding(jac):
    """Set to nothing what is rounding beside the largest entry of its 3 x 3 block.

    Wheels that joints hold parallel lean by rounding errors, through which directions couple that have nothing to do
    with each other. A Newton matrix without these couplings is as good, and sparser.
    """
    for b in range(0, 6, 3):
        for c in range(0, 24, 3):
            largest = 0.0
            for i in range(b, b + 3):
                for j in range(c, c + 3):
                    largest = max(largest, abs(jac[i, j]))
            least = COUPLED * largest
            for i in range(b, b + 3):
                for j in range(c, c + 3):
                    jac[i, j] = jac[i, j] if abs(jac[i, j]) > least else 0.0


@njit(cache=True, error_model="numpy")
def wrench_of_sums(motion, sums, want, wrench):
    """Fill the wrench on wheel 1 in global components; ``want`` is nonzero if derivatives follow."""
    pose_wrench(motion, sums.q, want)
    own, frame = motion.wrench, motion.frame
    for i in range(6):
        own[i] += sums.f[i]
    for b in range(0, 6, 3):
        for k in range(3):
            wrench[b + k] = frame[k, 0] * own[b] + frame[k, 1] * own[b + 1] + frame[k, 2] * own[b + 2]


@kernel
def slopes_of_sums(motion, sums, one, two, wrench, jac):
    """Fill the derivatives of the wrench; ``one``, ``two`` are place, velocity, angular velocity of the wheels."""
    R1, v1, w1 = one
    R2, v2, w2 = two
    pose_columns(motion)
    pose_rate_slopes(motion)
    wrench_slopes(motion, sums, L.PADDED)
    own_columns(motion, w2, L.PADDED)
    turn_to_global(motion, jac)
    mate_columns(R1, v1, w1, R2, v2, w2, wrench, jac)
    clear_rounding(jac)


@kernel
def both_sides(options, wheels, scratch, want):
    """Sum up the contacts of both sides of the teeth, the second seen in a mirror."""
    totals = scratch.totals
    motion, side, sums = scratch.motion, scratch.side, scratch.sums
    root = options.root != 0
    pose_rates(motion)
    clear_sums(sums, want)
    for i in range(6):
        side.x[i], side.xd[i], side.twist[i] = motion.x[i], motion.xd[i], motion.twist[i]
    if not open_side(wheels, side):
        return
    set_twist(wheels, side, 1.0)
    side_contacts(options, wheels, scratch, 1, totals, want)
    if root:
        root_contacts(options, wheels, scratch, 1, totals, want)
    for i in range(6):
        sign = -1.0 if i > 2 else 1.0
        side.x[i] = sign * motion.x[i]
        side.xd[i] = sign * motion.xd[i]
        side.twist[i] = -motion.twist[i] if i % 2 == 1 else motion.twist[i]
    set_twist(wheels, side, -1.0)
    # sums of the second side are added in the mirror: they are mirrored for it if it adds any, and back afterwards
    turned = side_contacts(options, wheels, scratch, -1, totals, want)
    if root:
        if not turned:
            mirror(sums, want)
        turned = True
        root_contacts(options, wheels, scratch, -1, totals, want)
    if turned:
        mirror(sums, want)


@kernel
def clear_totals(totals):
    """Set the diagnostics to nothing."""
    totals.energy = totals.damping_power = totals.friction_power = 0.0
    totals.depth_drive = totals.depth_coast = 0.0
    totals.pairs_drive = totals.pairs_coast = 0.0
    totals.normal_force = 0.0


@kernel
def put_totals(totals, diag):
    """Write the diagnostics in the order of `layout.TOTALS`."""
    diag[0] = totals.energy
    diag[1] = totals.damping_power
    diag[2] = totals.friction_power
    diag[3] = totals.depth_drive
    diag[4] = totals.depth_coast
    diag[5] = totals.pairs_drive
    diag[6] = totals.pairs_coast
    diag[7] = totals.normal_force


@njit(GEAR_CONTACT_SIG, cache=True, nogil=True, error_model="numpy")
def gear_contact(gi, gr, R1, A1, v1, w1, R2, A2, v2, w2, wrench, jac, diag, want_jac, work):
    """Wrench of the contact of two wheels, its derivatives and diagnostics.

    Parameters
    ----------
    gi, gr : ndarray
        Packed tables of the pair, from ``GearPair.contact_tables``.
    R1, R2, v1, v2, w1, w2 : ndarray, shape (3,)
        Positions and velocities of the wheels' origins (mid-face, on the axis) and their angular velocities; global.
    A1, A2 : ndarray, shape (3, 3)
        Orientations; columns are the wheel's axes: z its axis, x through the middle of tooth 0.
    wrench : ndarray, shape (6,)
        Out: force on wheel 1, N, and torque on wheel 1 about R1, N m; global components.
    jac : ndarray, shape (6, 24)
        Out, when ``want_jac`` is not 0: derivatives by the spatial variations ``[dR, dpi, dv, dw]`` of wheel 1,
        then of wheel 2.
    diag : ndarray, shape (8,)
        Out: elastic energy J, damping power W, friction power W, largest penetration m on drive and on
        coast flanks, tooth pairs touching on drive and on coast flanks, sum of normal forces N.
    work : ndarray
        Scratch of at least the length that ``contact_tables`` returned.

    Notes
    -----
    Memory-free: the result is a function of the arguments alone. No contact is found when the axes are more than
    120 degrees apart, those of helical wheels more than 20, or the base circles overlap.
    """
    for i in range(6):
        wrench[i] = 0.0
    scratch = scratch_at(work)
    motion, sums, totals = scratch.motion, scratch.sums, scratch.totals
    clear_totals(totals)
    internal = pair_at(gr).wheel_2.base_radius < 0.0
    touching = relative_pose(R1, A1, R2, A2, internal, motion)
    if touching:
        relative_twist(R1, v1, w1, R2, v2, w2, motion)
        both_sides(options_at(gi), pair_at(gr), scratch, want_jac)
        touching = totals.energy > 0.0
    put_totals(totals, diag)
    if not touching:
        if want_jac != 0:
            for i in range(6):
                for j in range(24):
                    jac[i, j] = 0.0
        return
    wrench_of_sums(motion, sums, want_jac, wrench)
    if want_jac != 0:
        slopes_of_sums(motion, sums, (R1, v1, w1), (R2, v2, w2), wrench, jac)


# Tooth contact behind the interface of force elements, see `gearmbs.dae.equations.loads.forces`.


contact_at = caller(GEAR_CONTACT_SIG)


@inlined
def wheel_frame(frames, k):
    """Return place, axes, velocity and angular velocity of wheel 0 or 1 from the frames of a force element."""
    at = k * FRAME_COLUMNS
    return (
        vector_at(frames, at + FRAME_P, 3),
        matrix_at(frames, at + FRAME_A, 3, 3),
        vector_at(frames, at + FRAME_V, 3),
        vector_at(frames, at + FRAME_W, 3),
    )


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def contact_force(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Hand the frames of the two wheels to `gear_contact`, whose address stands before its integers.

    Called through it, the large kernel need not be compiled into this one.

    Parameters
    ----------
    ints, reals : ndarray
        Address of `gear_contact`, then the pair's tables.
    t, states, inputs, rates
        Not used.
    frames : ndarray
        Poses and velocities of the two wheels.
    want : int
        Flags; derivatives are filled if `DERIVATIVES` is among them.
    work : ndarray
        Scratch.
    wrench, jac, diagnostics : ndarray
        Out, as of `gear_contact`.
    """
    R1, A1, v1, w1 = wheel_frame(frames, 0)
    R2, A2, v2, w2 = wheel_frame(frames, 1)
    contact_at(ints[0])(
        vector_at(ints, 1, ints.size - 1),
        reals,
        R1, A1, v1, w1,
        R2, A2, v2, w2,
        vector_at(wrench, 0, 6),
        jac,
        diagnostics,
        want & DERIVATIVES,
        work,
    )  # fmt: skip
