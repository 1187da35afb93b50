"""Kernel of joint friction, whose law is given in `gearmbs.mechanism.forces.friction`.

Every quantity is carried with its derivatives by all that the element depends on: 12 variations of the frames of I and
J each, the deformations, the six components of the joint's reaction. Quantities are rows of the scratch, the value
first, combined by the rules of differentiation.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.loads.forces import DERIVATIVES, FORCE_SIG, FRAME_A, FRAME_P, FRAME_V, FRAME_W
from gearmbs.dae.equations.loads.time_functions import smooth_step
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at

PIN, SLIDE, CYLINDER, BALL = 0, 1, 2, 3
"""Kinds: about the z axis of a frame, along z of J, along and about z of J, about all axes of J."""

KIND = 0
FRAME = 1
"""Whose axes a pin turns about and its reaction is taken in: 0 of I, 1 of J."""
CHANGES = 2
"""Whether the overlap changes with the displacement."""
LOADED = 3
"""Whether the reaction is among the inputs."""
INTEGERS = 4

LEVER = 0
"""Reals: arm of the slip of rotations; the force's arm of a torque."""
PER_RADIAL = 1
"""What presses the surfaces: factors of the lengths of the reaction's parts."""
PER_AXIAL = 2
PER_FORCE = 3
PER_BENDING = 4
PER_TWIST = 5
TINY_FORCE = 6
"""Below which lengths are rounded off."""
TINY_BENDING = 7
TINY_TWIST = 8
OVERLAP = 9
OVERLAP_SLOPE = 10
START = 11
LIMIT_STATIC = 12
"""Coefficients between which g(V) changes, and that at the transition without deformation."""
LIMIT_DYNAMIC = 13
TRANSITION = 14
DEFORMATION = 15
"""Largest, m; 0: friction by velocity."""
PER_DEFORMATION = 16
"""mu_s / D."""
KEPT_FORCE = 17
"""Normal loads of the unloaded joint."""
KEPT_TORQUE = 18
MAX_FORCE = 19
MAX_TORQUE = 20
REALS = 21

TINY = 1e-6
"""Part of its own scale, a limit or a transition velocity, below which the length of a vector is rounded off, so that
its derivative exists at zero. A length of that scale is off by 5e-13 of it."""

PRESSING, SPEED, STEP, FACTOR, SHARE, HELP, PART = 0, 1, 2, 3, 4, 5, 6
"""Rows of the scratch; the next have one for each slip."""
SLIP = 7
MU = 10
LOAD = 13
AXES = 16
"""Components of the reaction in a frame: three of F, three of N."""
ROWS = 22


@njit(cache=True, error_model="numpy")
def add(rows, out, factor, part):
    """Add a multiple of one quantity to another."""
    for k in range(rows.shape[1]):
        rows[out, k] += factor * rows[part, k]


@njit(cache=True, error_model="numpy")
def clear(rows, out, value):
    """Make a quantity a constant."""
    for k in range(rows.shape[1]):
        rows[out, k] = 0.0
    rows[out, 0] = value


@njit(cache=True, error_model="numpy")
def product(rows, out, a, b):
    """Write the product of two quantities, ``out`` none of them."""
    for k in range(1, rows.shape[1]):
        # d(a b) = a db + b da
        rows[out, k] = rows[a, 0] * rows[b, k] + rows[b, 0] * rows[a, k]
    rows[out, 0] = rows[a, 0] * rows[b, 0]


@njit(cache=True, error_model="numpy")
def function_of(rows, out, a, value, slope):
    """Write a function of a quantity, given by its value and slope there; ``out`` may be the quantity."""
    for k in range(1, rows.shape[1]):
        rows[out, k] = slope * rows[a, k]
    rows[out, 0] = value


@njit(cache=True, error_model="numpy")
def length_of(rows, out, first, last, tiny):
    """Write the length of a vector given by its components, rounded off."""
    clear(rows, out, 0.0)
    square = tiny * tiny
    for c in range(first, last):
        square += rows[c, 0] ** 2
    length = np.sqrt(square)
    for c in range(first, last):
        for k in range(1, rows.shape[1]):
            # l = sqrt(sum x^2 + tiny^2): dl = sum x dx / l
            rows[out, k] += rows[c, 0] / length * rows[c, k]
    rows[out, 0] = length


@njit(cache=True, error_model="numpy")
def component(rows, out, frames, f, axis, x, y, z):
    """Write the component of a vector along an axis of frame f, with its derivative by the frame's rotation only.

    Parameters
    ----------
    rows : ndarray, shape (ROWS, 1 + dependencies)
        The quantities: value, then derivatives.
    out : int
        Row to write.
    frames : ndarray, shape (2, 18)
        Frames of I and J, as in `gearmbs.dae.equations.loads.forces`.
    f, axis : int
        Frame and its axis: 0, 1, 2 for x, y, z.
    x, y, z : float
        The vector, global components.
    """
    clear(rows, out, 0.0)
    ex, ey, ez = frames[f, FRAME_A + axis], frames[f, FRAME_A + 3 + axis], frames[f, FRAME_A + 6 + axis]
    rows[out, 0] = ex * x + ey * y + ez * z
    # X . (dpi x e) = dpi . (e x X)
    at = 1 + 12 * f + 3
    rows[out, at] = ey * z - ez * y
    rows[out, at + 1] = ez * x - ex * z
    rows[out, at + 2] = ex * y - ey * x


@njit(cache=True, error_model="numpy")
def difference(frames, at):
    """Return three entries of the frame of I less those of J's."""
    return frames[0, at] - frames[1, at], frames[0, at + 1] - frames[1, at + 1], frames[0, at + 2] - frames[1, at + 2]


@njit(cache=True, error_model="numpy")
def turning(rows, out, frames, f, axis, lever):
    """Write the slip by rotation: lever times the relative angular velocity along an axis of frame f."""
    x, y, z = difference(frames, FRAME_W)
    component(rows, out, frames, f, axis, x, y, z)
    for c in range(3):
        # and by the angular velocities themselves: along the axis for I, against it for J
        rows[out, 1 + 9 + c] = frames[f, FRAME_A + 3 * c + axis]
        rows[out, 1 + 21 + c] = -frames[f, FRAME_A + 3 * c + axis]
    for k in range(rows.shape[1]):
        rows[out, k] *= lever


@njit(cache=True, error_model="numpy")
def sliding(rows, out, frames):
    """Write the slip along z of J: its component of v_I - v_J - w_J x d."""
    d, base = difference(frames, FRAME_P), (frames[1, FRAME_W], frames[1, FRAME_W + 1], frames[1, FRAME_W + 2])
    x, y, z = difference(frames, FRAME_V)
    x -= base[1] * d[2] - base[2] * d[1]
    y -= base[2] * d[0] - base[0] * d[2]
    z -= base[0] * d[1] - base[1] * d[0]
    component(rows, out, frames, 1, 2, x, y, z)
    for c in range(3):
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        a = frames[1, FRAME_A + 3 * c + 2]
        a1, a2 = frames[1, FRAME_A + 3 * c1 + 2], frames[1, FRAME_A + 3 * c2 + 2]
        # s = a . (v_I - v_J - w x d): by d it is -(a x w), by w -(d x a)
        away = a1 * base[c2] - a2 * base[c1]
        rows[out, 1 + c], rows[out, 13 + c] = -away, away
        rows[out, 7 + c], rows[out, 19 + c] = a, -a
        rows[out, 22 + c] = a1 * d[c2] - a2 * d[c1]


@njit(cache=True, error_model="numpy")
def pressing(ints, reals, frames, inputs, rows):
    """Write what presses the surfaces together, N or N r, from the joint's reaction."""
    clear(rows, PRESSING, 0.0)
    if ints[LOADED] == 0:
        return
    f = ints[FRAME]
    first = rows.shape[1] - 6
    for part in range(2):
        for axis in range(3):
            out = AXES + 3 * part + axis
            component(rows, out, frames, f, axis, inputs[3 * part], inputs[3 * part + 1], inputs[3 * part + 2])
            for c in range(3):
                # and by the reaction, of which it is a component
                rows[out, first + 3 * part + c] = frames[f, FRAME_A + 3 * c + axis]
    for k, low, high, tiny in (
        (PER_RADIAL, 0, 2, TINY_FORCE),
        (PER_AXIAL, 2, 3, TINY_FORCE),
        (PER_FORCE, 0, 3, TINY_FORCE),
        (PER_TWIST, 5, 6, TINY_TWIST),
    ):
        if reals[k] != 0.0:
            length_of(rows, PART, AXES + low, AXES + high, reals[tiny])
            add(rows, PRESSING, reals[k], PART)
    if reals[PER_BENDING] == 0.0:
        return
    length_of(rows, PART, AXES + 3, AXES + 5, reals[TINY_BENDING])
    if ints[CHANGES] == 0:
        add(rows, PRESSING, reals[PER_BENDING], PART)
        return
    x, y, z = difference(frames, FRAME_P)
    component(rows, HELP, frames, 1, 2, x, y, z)
    for c in range(3):
        rows[HELP, 1 + c], rows[HELP, 13 + c] = frames[1, FRAME_A + 3 * c + 2], -frames[1, FRAME_A + 3 * c + 2]
    # bending is carried by a couple at the ends of the overlap: force = moment / overlap
    overlap = reals[OVERLAP] + reals[OVERLAP_SLOPE] * (rows[HELP, 0] - reals[START])
    function_of(rows, HELP, HELP, 1.0 / overlap, -reals[OVERLAP_SLOPE] / overlap**2)
    product(rows, FACTOR, PART, HELP)
    add(rows, PRESSING, reals[PER_BENDING], FACTOR)


@njit(cache=True, error_model="numpy")
def ramp(rows, out, transition, low, high):
    """Write a STEP of the slip speed from one value at the transition to another at one and a half of it."""
    width = 0.5 * transition
    _, value, slope, _ = smooth_step((rows[SPEED, 0] - transition) / width, np.int64(0))
    function_of(rows, out, SPEED, low + (high - low) * value, (high - low) * slope / width)


@njit(cache=True, error_model="numpy")
def by_velocity(reals, slips, rows):
    """Write mu_k = g(V) s_k / V, the cubic below the transition."""
    v, transition = rows[SPEED, 0], reals[TRANSITION]
    if v <= transition:
        static, ratio = reals[LIMIT_STATIC], v / transition
        # g / V of the cubic g = mu_s r (3 - r^2) / 2, r = V / V_t, finite at rest
        value, slope = 0.5 * static / transition * (3.0 - ratio * ratio), -static * ratio / transition**2
        function_of(rows, FACTOR, SPEED, value, slope)
    else:
        ramp(rows, STEP, transition, reals[LIMIT_STATIC], reals[LIMIT_DYNAMIC])
        # above it STEP from mu_s to mu_d, over V
        function_of(rows, HELP, SPEED, 1.0 / v, -1.0 / (v * v))
        product(rows, FACTOR, STEP, HELP)
    for k in range(slips):
        product(rows, MU + k, SLIP + k, FACTOR)


@njit(cache=True, error_model="numpy")
def by_deformation(reals, slips, states, want, rows, rates, jac):
    """Write the rates z_k' and mu_k = mu_s (z_k + tau z_k') / D."""
    transition, stiffness = reals[TRANSITION], reals[PER_DEFORMATION]
    ramp(rows, STEP, transition, reals[LIMIT_STATIC], reals[LIMIT_DYNAMIC])
    # V / g, by which deformations fade
    function_of(rows, STEP, STEP, 1.0 / rows[STEP, 0], -1.0 / rows[STEP, 0] ** 2)
    product(rows, FACTOR, SPEED, STEP)
    # damping of the deformation, none in full slip
    tau = reals[DEFORMATION] / transition
    ramp(rows, SHARE, transition, tau, 0.0)
    for k in range(slips):
        # z_k' = s_k - (mu_s/D) V z_k / g
        clear(rows, HELP, states[k])
        rows[HELP, 1 + 24 + k] = 1.0
        product(rows, PART, FACTOR, HELP)
        clear(rows, STEP, 0.0)
        add(rows, STEP, 1.0, SLIP + k)
        add(rows, STEP, -stiffness, PART)
        rates[k] = rows[STEP, 0]
        if want & DERIVATIVES:
            for q in range(jac.shape[1]):
                jac[6 + k, q] = rows[STEP, 1 + q]
        product(rows, PART, SHARE, STEP)
        add(rows, PART, 1.0, HELP)
        clear(rows, MU + k, 0.0)
        add(rows, MU + k, stiffness, PART)


@njit(cache=True, error_model="numpy")
def limited(rows, out, most):
    """Keep a quantity between -most and most."""
    if abs(rows[out, 0]) > most:
        clear(rows, out, most if rows[out, 0] > 0.0 else -most)


@njit(cache=True, error_model="numpy")
def resisting(ints, reals, slips, rows):
    """Write the loads -(mu_k N + P mu_k / mu_d), limited."""
    kind = ints[KIND]
    for k in range(slips):
        torque = kind == PIN or kind == BALL or (kind == CYLINDER and k == 1)
        lever = reals[LEVER] if kind == BALL or (kind == CYLINDER and k == 1) else 1.0
        product(rows, LOAD + k, MU + k, PRESSING)
        for q in range(rows.shape[1]):
            # -(mu_k N) r, and what the unloaded joint keeps
            rows[LOAD + k, q] *= -lever
        add(rows, LOAD + k, -(reals[KEPT_TORQUE] if torque else reals[KEPT_FORCE]), MU + k)
        if kind != BALL:
            limited(rows, LOAD + k, reals[MAX_TORQUE] if torque else reals[MAX_FORCE])
    if kind == BALL and reals[MAX_TORQUE] < np.inf:
        most = reals[MAX_TORQUE]
        length_of(rows, HELP, LOAD, LOAD + 3, TINY * most)
        if rows[HELP, 0] > most:
            # a vector beyond its limit is shortened, its direction stays
            function_of(rows, HELP, HELP, most / rows[HELP, 0], -most / rows[HELP, 0] ** 2)
            for k in range(3):
                product(rows, PART, LOAD + k, HELP)
                clear(rows, LOAD + k, 0.0)
                add(rows, LOAD + k, 1.0, PART)


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def joint_friction(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the friction of a joint.

    Arguments as in `gearmbs.dae.equations.loads.forces`; the inputs are the reaction F and N on I's body at
    marker I if the friction depends on it, else none.
    """
    kind, f = ints[KIND], ints[FRAME]
    columns = 1 + 24 + states.size + inputs.size
    rows = matrix_at(work, 0, ROWS, columns)
    pressing(ints, reals, frames, inputs, rows)
    slips = 3 if kind == BALL else 2 if kind == CYLINDER else 1
    if kind == PIN:
        turning(rows, SLIP, frames, f, 2, reals[LEVER])
    elif kind == BALL:
        for axis in range(3):
            turning(rows, SLIP + axis, frames, f, axis, reals[LEVER])
    else:
        sliding(rows, SLIP, frames)
        if kind == CYLINDER:
            turning(rows, SLIP + 1, frames, f, 2, reals[LEVER])
    if slips == 1:
        function_of(rows, SPEED, SLIP, abs(rows[SLIP, 0]), 1.0 if rows[SLIP, 0] >= 0.0 else -1.0)
    else:
        length_of(rows, SPEED, SLIP, SLIP + slips, TINY * reals[TRANSITION])
    if reals[DEFORMATION] == 0.0:
        by_velocity(reals, slips, rows)
    else:
        by_deformation(reals, slips, states, want, rows, rates, jac)
    resisting(ints, reals, slips, rows)
    for k in range(slips):
        axis = k if kind == BALL else 2
        first = 0 if kind == SLIDE or (kind == CYLINDER and k == 0) else 3
        for c in range(3):
            e = frames[f, FRAME_A + 3 * c + axis]
            wrench[0, first + c] += rows[LOAD + k, 0] * e
            if want & DERIVATIVES:
                for q in range(columns - 1):
                    jac[first + c, q] += rows[LOAD + k, 1 + q] * e
    if want & DERIVATIVES:
        for b in range(0, 6, 3):
            for c in range(3):
                # dpi x F, dpi x N of the frame whose axes they are along
                jac[b + (c + 1) % 3, 12 * f + 3 + (c + 2) % 3] += wrench[0, b + c]
                jac[b + (c + 2) % 3, 12 * f + 3 + (c + 1) % 3] -= wrench[0, b + c]
