"""The door for compiled force elements: what the equations know of one, whatever it is.

A force element is a kernel with the signature `FORCE_SIG` and a row of the tables. It looks at the frames of some
markers and acts on the bodies of one, two or more of them; the rows of eq. (9) for its F and N are F - F(q, q', t) = 0.

* Two acting markers I and J: one wrench. F acts at the origin of I and N on I's body; -F acts at the same point, and
  -N, on J's body.
* One acting marker: one wrench, its reaction on the ground.
* More acting markers: one wrench each, about the marker's origin; that they balance is the kernel's own affair.

The kernel is called as

    kernel(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics)

Parameters of a kernel
----------------------
ints, reals : ndarray of int64, of float64
    The element's own tables, read only. ``ints`` begins with the addresses of the compiled functions it declares.
t : float
    Time, s.
frames : ndarray, shape (markers, 18)
    Of each marker it looks at: origin P (3), orientation A (row-major 3x3, columns are the axes), velocity of P (3),
    angular velocity (3); global components, SI. Acting markers that it looks at come first.
states : ndarray, shape (states,)
    Its own states z, differential or algebraic, read only.
inputs : ndarray
    Further unknowns of y it declares, then values of the functions of time, then the references of the angles it
    counts: the values near which those are to be expected, see `gearmbs.dae.equations.counted_angles`. Read only.
want : int
    Sum of `DERIVATIVES` and `DIAGNOSTICS`, or 0 for the values alone.
work : ndarray
    Scratch of the declared length; it keeps nothing between calls.
wrench : ndarray, shape (wrenches, 6)
    Out: F, N and N, N m, global components. Zero on entry.
rates : ndarray, shape (states,)
    Out: z' of a differential, z of an algebraic state. Zero on entry.
jac : ndarray, shape (6 wrenches + states, 12 markers + states + unknowns)
    Out, if derivatives are wanted: exact derivatives of the wrenches, one after the other, and of the rates. Columns:
    for each frame the spatial variations [dP, dpi, dv, dw], the states, the further unknowns. Zero on entry.
    Of a turned frame dA = dpi x A, while v and w stay.
diagnostics : ndarray
    Out, at least if wanted: the values of the declared `Diagnostic` list. Zero on entry.

A kernel is a function of its arguments alone, so that every integrator, formulation and analysis may call it at any
point in any order.
"""

from __future__ import annotations

from dataclasses import dataclass

from numba import types

from gearmbs.dae.compiled.pointers import F8, I8, IVEC, MAT, VEC

FORCE_SIG = types.void(IVEC, VEC, F8, MAT, VEC, VEC, I8, VEC, MAT, VEC, MAT, VEC)
"""Signature of a force element's kernel."""

DERIVATIVES = 1
DIAGNOSTICS = 2

FRAME_P = 0
"""In a row of frames: origin."""
FRAME_A = 3
"""Orientation, row-major."""
FRAME_V = 12
"""Velocity of the origin."""
FRAME_W = 15
"""Angular velocity."""
FRAME_COLUMNS = 18

STORED = "stored"
"""Energy that the element gives back, J."""
DISSIPATED = "dissipated"
"""Power that is lost in the element, W."""
COUNT = "count"
"""A whole number."""
PLAIN = "plain"
"""Any other quantity."""
ROLES = (STORED, DISSIPATED, COUNT, PLAIN)


@dataclass(frozen=True)
class Diagnostic:
    """A quantity that a force element tells beside its wrench.

    Attributes
    ----------
    name : str
    unit : str
        "1" for a number.
    role : {"stored", "dissipated", "count", "plain"}
        How the energy balance takes it. An element with stored or dissipated quantities has to name them all: its
        wrench does the work of nothing else.
    """

    name: str
    unit: str = "1"
    role: str = PLAIN
