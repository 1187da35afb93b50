"""Kernels of joint friction, whose law is given in `gearmbs.mechanism.forces.friction` and stated in `definitions`.

Each kind of joint has its own, so that a mechanism compiles those that it has. What is seen of a joint, N and the
slips s_k, makes loads L_k and the rates of deformations, of which each stage gives the derivatives by what it is
handed; here they are multiplied, and the loads put along their axes.
"""

from __future__ import annotations

from gearmbs.dae.equations.loads.forces import CHANGED_SIG, DERIVATIVES, FORCE_SIG, FRAME_A
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, vector_at
from gearmbs.mechanism.forces.joint_friction import BALL, CYLINDER, PIN, SLIDE
from gearmbs.mechanism.forces.joint_friction import derived as D

SEEN = 0
"""In the scratch: N and the slips, and their changes; loads with the rates; the reaction, or zeros of a joint without
load."""
SEEN_CHANGED = 4
LOADS = 8
REACTION = 14
BY_SEEN = 20
"""Derivatives of loads and rates by what is seen and the deformations, (6, 7); of what is seen by the variations of
both frames and the reaction, (4, 30); of one load by these."""
SEEN_SLOPES = BY_SEEN + 6 * 7
VARIED = 24 + 6
LOAD_SLOPES = SEEN_SLOPES + 4 * VARIED
SCRATCH = LOAD_SLOPES + VARIED


@njit(cache=True, error_model="numpy", forceinline=True)
def rooms(inputs, work):
    """Return the joint's reaction, or zeros, and where what is seen and the loads are written."""
    reaction = vector_at(work, REACTION, 6)
    for k in range(6):
        reaction[k] = inputs[k] if inputs.size > 0 else 0.0
    return reaction, vector_at(work, SEEN, 4), vector_at(work, LOADS, 6)


@njit(cache=True, error_model="numpy", forceinline=True)
def cleared(slips, states, work):
    """Return where derivatives are written, made zero: of loads and rates by what is seen, of what is seen."""
    by = matrix_at(work, BY_SEEN, slips + states.size, 1 + slips + states.size)
    slopes = matrix_at(work, SEEN_SLOPES, 4, VARIED)
    by[:] = 0.0
    slopes[:] = 0.0
    return by, slopes


@njit(cache=True, error_model="numpy", forceinline=True)
def direction_of(kind, k):
    """Return along which axis a load acts, and where in a wrench: 0 a force, 3 a torque."""
    return k if kind == BALL else 2, 0 if kind == SLIDE or (kind == CYLINDER and k == 0) else 3


@njit(cache=True, error_model="numpy")
def act(kind, f, slips, frames, loads, out):
    """Add the wrench of the loads along axes of frame f; it is linear in them, so as well its change by theirs."""
    for k in range(slips):
        axis, first = direction_of(kind, k)
        for c in range(3):
            out[first + c] += loads[k] * frames[f, FRAME_A + 3 * c + axis]


@njit(cache=True, error_model="numpy")
def add_jacobian(kind, f, slips, by, seen, frames, held, work, wrench, jac):
    """Add the derivatives of the wrench and the rates.

    Parameters
    ----------
    kind, f, slips : int
        Of the joint, in whose frame its axes are, how many slips it has.
    by, seen : ndarray
        Derivatives of both stages, see `cleared`.
    frames : ndarray, shape (2, 18)
    held : int
        Number of deformations.
    work, wrench, jac : ndarray
        As of every element.
    """
    load = vector_at(work, LOAD_SLOPES, VARIED)
    variations = jac.shape[1] - held
    for k in range(slips + held):
        for q in range(variations):
            load[q] = 0.0
        for part in range(1 + slips):
            if by[k, part] != 0.0:
                # of a rate, which does not depend on N, there are fewer
                for q in range(variations):
                    load[q] += by[k, part] * seen[part, q]
        axis, first = direction_of(kind, k)
        for c in range(3 if k < slips else 1):
            # L e of a load, else the rate
            row, e = (first + c, frames[f, FRAME_A + 3 * c + axis]) if k < slips else (6 + k - slips, 1.0)
            for q in range(variations):
                jac[row, q if q < 24 else q + held] += load[q] * e
            for z in range(held):
                jac[row, 24 + z] += by[k, 1 + slips + z] * e
    for b in range(0, 6, 3):
        for c in range(3):
            # dpi x F, dpi x N of the frame whose axes they are along
            jac[b + (c + 1) % 3, 12 * f + 3 + (c + 2) % 3] += wrench[0, b + c]
            jac[b + (c + 2) % 3, 12 * f + 3 + (c + 1) % 3] -= wrench[0, b + c]


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def pin_friction(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the friction of a pin.

    Arguments as in `gearmbs.dae.equations.loads.forces`; the inputs are the reaction F and N on I's body at
    marker I if the friction depends on it, else none. The integer says about whose z axis it turns: 0 of I,
    1 of J.
    """
    own = ints[0]
    other, sense = 1 - own, 1.0 - 2.0 * own
    reaction, seen, loads = rooms(inputs, work)
    D.pin_seen(frames, own, other, sense, reaction, reals, seen)
    if states.size == 0:
        D.one_creeping_loads(seen, states, reals, loads, rates)
    else:
        D.one_sticking_loads(seen, states, reals, loads, rates)
    act(PIN, own, 1, frames, loads, wrench[0])
    if want & DERIVATIVES:
        by, slopes = cleared(1, states, work)
        D.pin_seen_slopes(frames, own, other, sense, reaction, reals, 12 * own, 12 * other, slopes)
        if states.size == 0:
            D.one_creeping_slopes(seen, states, reals, by)
        else:
            D.one_sticking_slopes(seen, states, reals, by)
        add_jacobian(PIN, own, 1, by, slopes, frames, states.size, work, wrench, jac)


@njit(CHANGED_SIG, cache=True, nogil=True, error_model="numpy")
def pin_friction_changed(ints, reals, changed, frames, states, inputs, work, out):
    """Write its derivatives along a change of the reals.

    Arguments as of `CHANGED_SIG` in `gearmbs.dae.equations.loads.forces`.
    """
    own = ints[0]
    other, sense = 1 - own, 1.0 - 2.0 * own
    reaction, seen, loads = rooms(inputs, work)
    moved = vector_at(work, SEEN_CHANGED, 4)
    D.pin_seen(frames, own, other, sense, reaction, reals, seen)
    D.pin_seen_changed(frames, own, other, sense, reaction, reals, changed, moved)
    if states.size == 0:
        D.one_creeping_changed(seen, states, reals, moved, changed, loads)
    else:
        D.one_sticking_changed(seen, states, reals, moved, changed, loads)
    act(PIN, own, 1, frames, loads, out)
    for k in range(states.size):
        out[6 + k] += loads[1 + k]


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def slide_friction(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the friction of a slide.

    Arguments as in `gearmbs.dae.equations.loads.forces`; the inputs are the reaction F and N on I's body at
    marker I if the friction depends on it, else none.
    """
    reaction, seen, loads = rooms(inputs, work)
    D.slide_seen(frames, reaction, reals, seen)
    if states.size == 0:
        D.one_creeping_loads(seen, states, reals, loads, rates)
    else:
        D.one_sticking_loads(seen, states, reals, loads, rates)
    act(SLIDE, 1, 1, frames, loads, wrench[0])
    if want & DERIVATIVES:
        by, slopes = cleared(1, states, work)
        D.slide_seen_slopes(frames, reaction, reals, slopes)
        if states.size == 0:
            D.one_creeping_slopes(seen, states, reals, by)
        else:
            D.one_sticking_slopes(seen, states, reals, by)
        add_jacobian(SLIDE, 1, 1, by, slopes, frames, states.size, work, wrench, jac)


@njit(CHANGED_SIG, cache=True, nogil=True, error_model="numpy")
def slide_friction_changed(ints, reals, changed, frames, states, inputs, work, out):
    """Write its derivatives along a change of the reals.

    Arguments as of `CHANGED_SIG` in `gearmbs.dae.equations.loads.forces`.
    """
    reaction, seen, loads = rooms(inputs, work)
    moved = vector_at(work, SEEN_CHANGED, 4)
    D.slide_seen(frames, reaction, reals, seen)
    D.slide_seen_changed(frames, reaction, reals, changed, moved)
    if states.size == 0:
        D.one_creeping_changed(seen, states, reals, moved, changed, loads)
    else:
        D.one_sticking_changed(seen, states, reals, moved, changed, loads)
    act(SLIDE, 1, 1, frames, loads, out)
    for k in range(states.size):
        out[6 + k] += loads[1 + k]


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def cylinder_friction(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the friction of a pin that slides.

    Arguments as in `gearmbs.dae.equations.loads.forces`; the inputs are the reaction F and N on I's body at
    marker I if the friction depends on it, else none.
    """
    reaction, seen, loads = rooms(inputs, work)
    D.cylinder_seen(frames, reaction, reals, seen)
    if states.size == 0:
        D.two_creeping_loads(seen, states, reals, loads, rates)
    else:
        D.two_sticking_loads(seen, states, reals, loads, rates)
    act(CYLINDER, 1, 2, frames, loads, wrench[0])
    if want & DERIVATIVES:
        by, slopes = cleared(2, states, work)
        D.cylinder_seen_slopes(frames, reaction, reals, slopes)
        if states.size == 0:
            D.two_creeping_slopes(seen, states, reals, by)
        else:
            D.two_sticking_slopes(seen, states, reals, by)
        add_jacobian(CYLINDER, 1, 2, by, slopes, frames, states.size, work, wrench, jac)


@njit(CHANGED_SIG, cache=True, nogil=True, error_model="numpy")
def cylinder_friction_changed(ints, reals, changed, frames, states, inputs, work, out):
    """Write its derivatives along a change of the reals.

    Arguments as of `CHANGED_SIG` in `gearmbs.dae.equations.loads.forces`.
    """
    reaction, seen, loads = rooms(inputs, work)
    moved = vector_at(work, SEEN_CHANGED, 4)
    D.cylinder_seen(frames, reaction, reals, seen)
    D.cylinder_seen_changed(frames, reaction, reals, changed, moved)
    if states.size == 0:
        D.two_creeping_changed(seen, states, reals, moved, changed, loads)
    else:
        D.two_sticking_changed(seen, states, reals, moved, changed, loads)
    act(CYLINDER, 1, 2, frames, loads, out)
    for k in range(states.size):
        out[6 + k] += loads[2 + k]


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def ball_friction(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the friction of a ball.

    Arguments as in `gearmbs.dae.equations.loads.forces`; the inputs are the reaction F and N on I's body at
    marker I if the friction depends on it, else none.
    """
    reaction, seen, loads = rooms(inputs, work)
    D.ball_seen(frames, reaction, reals, seen)
    if states.size == 0:
        D.three_creeping_loads(seen, states, reals, loads, rates)
    else:
        D.three_sticking_loads(seen, states, reals, loads, rates)
    act(BALL, 1, 3, frames, loads, wrench[0])
    if want & DERIVATIVES:
        by, slopes = cleared(3, states, work)
        D.ball_seen_slopes(frames, reaction, reals, slopes)
        if states.size == 0:
            D.three_creeping_slopes(seen, states, reals, by)
        else:
            D.three_sticking_slopes(seen, states, reals, by)
        add_jacobian(BALL, 1, 3, by, slopes, frames, states.size, work, wrench, jac)


@njit(CHANGED_SIG, cache=True, nogil=True, error_model="numpy")
def ball_friction_changed(ints, reals, changed, frames, states, inputs, work, out):
    """Write its derivatives along a change of the reals.

    Arguments as of `CHANGED_SIG` in `gearmbs.dae.equations.loads.forces`.
    """
    reaction, seen, loads = rooms(inputs, work)
    moved = vector_at(work, SEEN_CHANGED, 4)
    D.ball_seen(frames, reaction, reals, seen)
    D.ball_seen_changed(frames, reaction, reals, changed, moved)
    if states.size == 0:
        D.three_creeping_changed(seen, states, reals, moved, changed, loads)
    else:
        D.three_sticking_changed(seen, states, reals, moved, changed, loads)
    act(BALL, 1, 3, frames, loads, out)
    for k in range(states.size):
        out[6 + k] += loads[3 + k]


KERNELS = {
    "pin": (pin_friction, pin_friction_changed),
    "slide": (slide_friction, slide_friction_changed),
    "cylinder": (cylinder_friction, cylinder_friction_changed),
    "ball": (ball_friction, ball_friction_changed),
}
"""By the kind of surface: the kernel of its friction, and that of derivatives by its numbers."""
