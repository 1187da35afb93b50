"""Tooth contact behind the door for force elements, see `gearmbs.dae.equations.force_elements`."""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.contact.jit import inlined
from gearmbs.contact.kernel import GEAR_CONTACT_SIG
from gearmbs.dae.compiled.pointers import caller
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations.force_elements import (
    DERIVATIVES,
    FORCE_SIG,
    FRAME_A,
    FRAME_COLUMNS,
    FRAME_P,
    FRAME_V,
    FRAME_W,
)

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
