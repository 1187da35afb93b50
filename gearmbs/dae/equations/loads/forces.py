"""Compiled force elements inside the equations: their kernels are called, their derivatives handed on.

What a kernel is given and gives is written in `gearmbs.dae.equations.loads.forces`.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints.terms import cross3
from gearmbs.dae.equations.loads.time_functions import cubic
from gearmbs.dae.equations.rotation import KIN_R, KIN_V, KIN_W
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import F8, I8, IVEC, MAT, VEC, caller
from gearmbs.kernels.structs import matrix_at, vector_at

# The interface of compiled force elements: what the equations know of one, whatever it is.
#
# A force element is a kernel with the signature `FORCE_SIG` and a row of the tables. It looks at the frames of some
# markers and acts on the bodies of one, two or more of them; the rows of eq. (9) for its F and N are F - F(q, q', t) =
# 0.
#
# * Two acting markers I and J: one wrench. F acts at the origin of I and N on I's body; -F acts at the same point, and
#   -N, on J's body.
# * One acting marker: one wrench, its reaction on the ground.
# * More acting markers: one wrench each, about the marker's origin; that they balance is the kernel's own affair.
#
# The kernel is called as
#
#     kernel(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics)
#
# Parameters of a kernel
# ----------------------
# ints, reals : ndarray of int64, of float64
#     The element's own tables, read only. ``ints`` begins with the addresses of the compiled functions it declares.
# t : float
#     Time, s.
# frames : ndarray, shape (markers, 18)
#     Of each marker it looks at: origin P (3), orientation A (row-major 3x3, columns are the axes), velocity of P (3),
#     angular velocity (3); global components, SI. Acting markers that it looks at come first.
# states : ndarray, shape (states,)
#     Its own states z, differential or algebraic, read only.
# inputs : ndarray
#     Further unknowns of y it declares, then values of the functions of time, then the references of the angles it
#     counts: the values near which those are to be expected, see `gearmbs.dae.equations.kinematics`. Read only.
# want : int
#     Sum of `DERIVATIVES` and `DIAGNOSTICS`, or 0 for the values alone.
# work : ndarray
#     Scratch of the declared length; it keeps nothing between calls.
# wrench : ndarray, shape (wrenches, 6)
#     Out: F, N and N, N m, global components. Zero on entry.
# rates : ndarray, shape (states,)
#     Out: z' of a differential, z of an algebraic state. Zero on entry.
# jac : ndarray, shape (6 wrenches + states, 12 markers + states + unknowns)
#     Out, if derivatives are wanted: exact derivatives of the wrenches, one after the other, and of the rates. Columns:
#     for each frame the spatial variations [dP, dpi, dv, dw], the states, the further unknowns. Zero on entry.
#     Of a turned frame dA = dpi x A, while v and w stay.
# diagnostics : ndarray
#     Out, at least if wanted: the values of the declared `Diagnostic` list. Zero on entry.
#
# A kernel is a function of its arguments alone, so that every integrator, formulation and analysis may call it at any
# point in any order.


FORCE_SIG = types.void(IVEC, VEC, F8, MAT, VEC, VEC, I8, VEC, MAT, VEC, MAT, VEC)
"""Signature of a force element's kernel."""
TURNING_SIG = types.void(IVEC, VEC, VEC, VEC, I8, VEC, VEC, MAT, VEC)
"""Signature of a leaner kernel of an element between two bodies that do nothing but turn about fixed axes,

    kernel(ints, reals, own, turns, want, work, wrench, slopes, diagnostics)

with the element's tables, a table of what its two axes imply, the angles by which I's and J's body have turned and
their rates. ``slopes``, shape (6, 4), are the wrench's derivatives by these, ``work`` has 36 places."""
CHANGED_SIG = types.void(IVEC, VEC, VEC, MAT, VEC, VEC, VEC, VEC)
"""Signature of a kernel of derivatives by numbers of an element,

    kernel(ints, reals, changed, frames, states, inputs, work, out)

with the element's tables and what it sees; ``changed`` is a change of the reals, along which the derivatives of F, N
and the rates are added to ``out``."""
LEAN_ADDRESS = 0
"""Address of an element's lean kernel in this process, or 0."""
LEAN_FIRST = 1
"""Where in ``rdata`` its own table is: behind n x (P - C) for the axes of I's and J's body, six numbers."""
LEAN_SIZE = 2
"""Length of that table."""
LEAN_COLUMNS = 3
LEVERS = 6

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


force_at = caller(FORCE_SIG)
turning_at = caller(TURNING_SIG)


@njit(cache=True, error_model="numpy", forceinline=True)
def marker_pose(m, marker_body, kin, frame, out, k):
    """Write the frame of marker m, columns ``FRAME_*``, to ``out[k:]``."""
    row = kin[marker_body[m]]
    cross3(row, KIN_W, frame[m], T.MK_ARM, out, k + FRAME_V)
    for c in range(3):
        out[k + FRAME_P + c] = row[KIN_R + c] + frame[m, T.MK_ARM + c]
        for axis in range(3):
            out[k + FRAME_A + 3 * c + axis] = frame[m, T.MK_AXES + 3 * axis + c]
        out[k + FRAME_V + c] += row[KIN_V + c]
        out[k + FRAME_W + c] = row[KIN_W + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def fill_inputs(row, y, extra_i, extra_r, angle, fval, sees, out, k):
    """Write the inputs that an element declares to ``out[k:]``; return the place after the last.

    Parameters
    ----------
    row : ndarray of int, shape (FORCE_COLUMNS,)
        The element's row of the force table.
    y : ndarray, shape (unknowns,)
        Its further unknowns come first.
    extra_i, extra_r : ndarray of int, ndarray
        Tables of extra integers and reals.
    angle : ndarray of int, shape (angles, ANGLE_COLUMNS)
        Counted angles, whose references come last.
    fval : ndarray, shape (functions, FUNCTION_VALUES)
        Functions of time, whose values come second.
    sees : int
        Place in ``extra_i`` of the number of functions, behind the list of markers.
    out, k : ndarray, int
        Where to write, and the first place.
    """
    at = row[T.FORCE_DEPENDS]
    at += 1 + extra_i[at]
    for q in range(at + 1 + row[T.FORCE_STATES], at + 1 + extra_i[at]):
        out[k] = y[extra_i[q]]
        k += 1
    for q in range(sees + 1, sees + 1 + extra_i[sees]):
        out[k] = fval[extra_i[q], 0]
        k += 1
    sees += 1 + extra_i[sees]
    for q in range(sees + 1, sees + 1 + extra_i[sees]):
        out[k] = extra_r[angle[extra_i[q], T.ANGLE_AT]]
        k += 1
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def evaluate_element(row, t, y, tab, want):
    """Call the kernel of a compiled element; ``row`` is that of its first wrench.

    Wrenches, rates and diagnostics are left one after the other in the scratch from ``row[FORCE_WORK]`` on, the
    derivatives, if wanted, at ``SCRATCH_FIXED``: columns of the bodies' variations, then of the unknowns.
    """
    scratch, extra_i = tab.scratch, tab.extra_i
    rates = row[T.FORCE_WORK] + 6 * row[T.FORCE_WRENCHES]
    diagnostics = rates + row[T.FORCE_STATES]
    poses = diagnostics + row[T.FORCE_DIAGNOSTICS]
    for k in range(row[T.FORCE_WORK], poses):
        scratch[k] = 0.0
    sees = row[T.FORCE_SEES]
    frames = extra_i[sees]
    for k in range(frames):
        marker_pose(extra_i[sees + 1 + k], tab.marker_body, tab.kin, tab.frame, scratch, poses + FRAME_COLUMNS * k)
    inputs = poses + FRAME_COLUMNS * frames
    end = fill_inputs(row, y, extra_i, tab.extra_r, tab.angle, tab.fval, sees + 1 + frames, scratch, inputs)
    rows = 6 * row[T.FORCE_WRENCHES] + row[T.FORCE_STATES]
    width = row[T.FORCE_WIDTH]
    jac = matrix_at(scratch, T.SCRATCH_FIXED, rows, width)
    if want & DERIVATIVES:
        for k in range(T.SCRATCH_FIXED, T.SCRATCH_FIXED + rows * width):
            scratch[k] = 0.0
    at = row[T.FORCE_IEXTRA]
    force_at(row[T.FORCE_ADDRESS])(
        vector_at(extra_i, at + 2, extra_i[at]),
        vector_at(tab.extra_r, row[T.FORCE_REXTRA], extra_i[at + 1]),
        t,
        matrix_at(scratch, poses, frames, FRAME_COLUMNS),
        vector_at(y, row[T.FORCE_Z], row[T.FORCE_STATES]),
        vector_at(scratch, inputs, end - inputs),
        want,
        vector_at(scratch, end, scratch.size - end),
        matrix_at(scratch, row[T.FORCE_WORK], row[T.FORCE_WRENCHES], 6),
        vector_at(scratch, rates, row[T.FORCE_STATES]),
        jac,
        vector_at(scratch, diagnostics, row[T.FORCE_DIAGNOSTICS]),
    )
    if want & DERIVATIVES:
        for k in range(frames):
            shift_to_body(extra_i[sees + 1 + k], tab.marker_body, tab.kin, tab.frame, jac, 12 * k)


@njit(cache=True, error_model="numpy", forceinline=True)
def evaluate_lean(row, lean, at, rdata, tab, want):
    """Call the lean kernel of an element; wrench and diagnostics are left where `evaluate_element` has them.

    The derivatives by the two angles and their rates, shape (6, 4), stand at ``SCRATCH_FIXED``.

    Parameters
    ----------
    row, lean : ndarray of int
        The element's rows ``FORCE_*`` and ``LEAN_*``.
    at : int
        Where in the scratch the angles and rates stand.
    rdata : ndarray
    tab : Tables
    want : int
    """
    scratch, first, ints = tab.scratch, row[T.FORCE_WORK], row[T.FORCE_IEXTRA]
    work = first + 6 + row[T.FORCE_DIAGNOSTICS]
    for k in range(first, work):
        scratch[k] = 0.0
    turning_at(lean[LEAN_ADDRESS])(
        vector_at(tab.extra_i, ints + 2, tab.extra_i[ints]),
        vector_at(tab.extra_r, row[T.FORCE_REXTRA], tab.extra_i[ints + 1]),
        vector_at(rdata, lean[LEAN_FIRST] + LEVERS, lean[LEAN_SIZE]),
        vector_at(scratch, at, 4),
        want,
        vector_at(scratch, work, 2 * FRAME_COLUMNS),
        vector_at(scratch, first, 6),
        matrix_at(scratch, T.SCRATCH_FIXED, 6, 4),
        vector_at(scratch, first + 6, row[T.FORCE_DIAGNOSTICS]),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def shift_to_body(m, marker_body, kin, frame, jac, first):
    """Turn columns of marker m's variations ``jac[:, first:first+12]`` into those of its body's frame.

    With arm s: dP = dR + dpi x s and d(v_P) = dv + dw x s + w x (dpi x s).
    """
    sx, sy, sz = frame[m, 0], frame[m, 1], frame[m, 2]
    if sx == 0.0 and sy == 0.0 and sz == 0.0:
        return
    row = kin[marker_body[m]]
    wx, wy, wz = row[KIN_W], row[KIN_W + 1], row[KIN_W + 2]
    for r in range(jac.shape[0]):
        px, py, pz = jac[r, first], jac[r, first + 1], jac[r, first + 2]
        vx, vy, vz = jac[r, first + 6], jac[r, first + 7], jac[r, first + 8]
        # g . (dpi x s) = dpi . (s x g), with g = dF/dP + (dF/dv) x w
        gx, gy, gz = px + vy * wz - vz * wy, py + vz * wx - vx * wz, pz + vx * wy - vy * wx
        jac[r, first + 3] += sy * gz - sz * gy
        jac[r, first + 4] += sz * gx - sx * gz
        jac[r, first + 5] += sx * gy - sy * gx
        jac[r, first + 9] += sy * vz - sz * vy
        jac[r, first + 10] += sz * vx - sx * vz
        jac[r, first + 11] += sx * vy - sy * vx


# IMPACT, eq. (10), with its STEP, eq. (11), and the friction that goes with it: laws of bodies that touch.
#
# They have no branches, so that loops over many points that call them become vectors. Products may be contracted with
# sums, and quotients become products with reciprocals.


CONTRACT = {"contract": True, "arcp": True}


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def impact(elastic, stiffness, damping, full_depth, depth, rate):
    """Return f = max(0, f_e + c STEP(d, 0, 0, d_max, 1) d'), f_e = k d^e, and its slopes by depth d and rate d'.

    Parameters
    ----------
    elastic, stiffness : float
        f_e, N, and its slope e f_e / d, N/m; or those of any other spring.
    damping, full_depth : float
        c, N s/m, and the depth of full damping d_max, m.
    depth, rate : float
        d > 0, m, and d', m/s.

    Returns
    -------
    force, by_depth, by_rate : float
    """
    ratio = min(depth / full_depth, 1.0)
    step, slope = cubic(ratio)
    force = elastic + damping * step * rate
    by_depth = stiffness + damping * (slope / full_depth) * rate
    pushes = force > 0.0
    return force if pushes else 0.0, by_depth if pushes else 0.0, damping * step if pushes else 0.0


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def stored_energy(elastic, exponent, depth):
    """Return the energy of the spring of `impact`, J."""
    return elastic * depth / (exponent + 1.0)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def friction_over_speed(static, dynamic, stiction, transition, speed):
    """Return mu(v)/v, finite at rest, and its derivative by v over v.

    mu rises as a cubic STEP from -mu_s at -v_s to mu_s at v_s and falls as a STEP to mu_d at v_d.

    Parameters
    ----------
    static, dynamic : float
        mu_s, mu_d.
    stiction, transition : float
        Their speeds v_s < v_d, m/s.
    speed : float
        v >= 0, m/s.
    """
    r = speed / stiction
    stick = 0.5 * static * (3.0 - r * r) / stiction
    stick_slope = -static / (stiction * stiction * stiction)
    moving = max(speed, stiction)
    fall, slope = cubic(min((moving - stiction) / (transition - stiction), 1.0))
    ratio = (static + (dynamic - static) * fall) / moving
    ratio_slope = ((dynamic - static) * slope / (transition - stiction) - ratio) / (moving * moving)
    sticks = speed <= stiction
    return stick if sticks else ratio, stick_slope if sticks else ratio_slope
