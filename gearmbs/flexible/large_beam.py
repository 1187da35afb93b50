"""Beams of large motion: rigid nodes joined by elements of small strain that turn as far as they like."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, Unpack

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations.loads.forces import (
    DERIVATIVES,
    DISSIPATED,
    FORCE_SIG,
    FRAME_A,
    FRAME_P,
    FRAME_V,
    FRAME_W,
    STORED,
)
from gearmbs.flexible.beam import BeamSection
from gearmbs.flexible.material import FlexibleError
from gearmbs.kernels.jit import njit
from gearmbs.mechanism import Body, Compiled, Diagnostic, ForceElement, Marker, Mechanism
from gearmbs.mechanism.parts.quantities import frame_along, quantity, vector
from gearmbs.units import Quantity

if TYPE_CHECKING:
    from gearmbs.mechanism.parts.keywords import MotionKeywords


@dataclass(eq=False, repr=False)
class LargeBeam(ForceElement):
    """A beam from marker I to marker J, along z of both: see `gearmbs.flexible.large_beam`.

    Attributes
    ----------
    length : float
        Unstrained, m.
    section : BeamSection
    damping_time : float
        Damping stress by strain rate over stress by strain, s: modes of circular frequency w are damped by w tau / 2.
    """

    length: float
    section: BeamSection
    damping_time: float = 0.0

    kind = "large_beam"
    has_force = True
    diagnostics = (Diagnostic("strain_energy", "J", STORED), Diagnostic("damping_power", "W", DISSIPATED))

    def compiled(self) -> Compiled:
        """Return kernel and tables."""

        b, g = self.section.bending, self.section.shear
        shear = [1.0 / (1.0 / g[p] + self.length**2 / (12.0 * b[p])) for p in range(2)]
        reals = (self.length, *shear, self.section.axial, b[1], b[0], self.section.torsion, self.damping_time)
        return Compiled(large_beam, reals=reals, scratch=WORK)


@dataclass(frozen=True, eq=False)
class BeamChain:
    """A beam of large motion in a mechanism.

    Attributes
    ----------
    bodies : list of Body
        The nodes, rigid, from the first end on.
    markers : list of Marker
        At the nodes, z along the beam, x as asked for.
    elements : list of LargeBeam
    """

    bodies: list[Body]
    markers: list[Marker]
    elements: list[LargeBeam]

    @property
    def first(self) -> Marker:
        """Marker at the beginning."""
        return self.markers[0]

    @property
    def last(self) -> Marker:
        """Marker at the end."""
        return self.markers[-1]


def node_shares(elements: int) -> np.ndarray:
    """Return the share of each node in the mass of a beam, in elements: weights of a rule of quadrature, all positive.

    A load of inertia m u'' dx that varies smoothly is replaced by forces at the nodes. Half of each element at either
    end (the trapezoidal rule) makes errors of h^2 at the ends of the beam: its moment of inertia is too large by the
    share 2/n^2. Gregory's rule of third order (K. Atkinson, *An Introduction to Numerical Analysis*, 2nd ed., section
    5.4) has them right up to h^4, as Newton's and Cotes's of few points; inside all weights are 1.

    Parameters
    ----------
    elements : int
        n.

    Returns
    -------
    ndarray, shape (n + 1,)
        Their sum is n; mass, centre and, from two elements on, moments of inertia of a straight beam are exact.
    """
    few = {1: (1 / 2,) * 2, 2: (1 / 3, 4 / 3, 1 / 3), 3: (3 / 8, 9 / 8, 9 / 8, 3 / 8),
           4: (14 / 45, 64 / 45, 24 / 45, 64 / 45, 14 / 45)}  # fmt: skip
    if elements in few:
        return np.array(few[elements])
    ends = np.array([9.0, 28.0, 23.0]) / 24.0
    return np.concatenate([ends, np.ones(elements - 5), ends[::-1]])


def add_beam(
    mechanism: Mechanism,
    name: str,
    section: BeamSection,
    start: npt.ArrayLike,
    end: npt.ArrayLike,
    elements: int = 16,
    *,
    x_axis: npt.ArrayLike | None = None,
    damping_time: Quantity = 0.0,
    **motion: Unpack[MotionKeywords],
) -> BeamChain:
    """Add a straight beam that may bend, twist and turn as far as it likes.

    Its nodes are rigid bodies with the mass and rotary inertia that `node_shares` gives them. Bending frequencies are
    then wrong by terms of h^4; those of stretching and torsion fall short by (k h)^2/24 of a wave of number k.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
        Bodies are ``name.0``, ``name.1`` ..., elements ``name.beam1`` ...
    section : BeamSection
    start, end : array_like of 3 floats
        Its ends at the start, global components, m.
    elements : int
    x_axis : array_like of 3 floats, optional
        Direction of the section's x, at right angles to the beam; default: the global axis that fits best.
    damping_time : float or str
        See `LargeBeam`, s.
    **motion
        ``velocity`` and ``angular_velocity`` of the beam at the start as of one rigid body, velocity that of ``start``.

    Returns
    -------
    BeamChain

    Raises
    ------
    FlexibleError
        For a beam without length or elements, and a damping time that is negative.
    """
    a, b = vector(start, f"beam '{name}': start", "length"), vector(end, f"beam '{name}': end", "length")
    length = float(np.linalg.norm(b - a))
    whole = isinstance(elements, Integral) and not isinstance(elements, bool)
    if not length > 0.0 or not whole or elements < 1:
        raise FlexibleError(
            f"beam '{name}': length {length} m, {elements!r} elements; both must be positive, and elements a whole "
            "number"
        )
    tau = quantity(damping_time, "time", f"beam '{name}': damping_time")
    if not 0.0 <= tau < math.inf:
        raise FlexibleError(f"beam '{name}': damping_time is {tau} s; give a time from 0 up, negative damping drives")
    axes = frame_along(b - a, f"beam '{name}'", None if x_axis is None else x_axis)
    u = vector(motion.pop("velocity", (0, 0, 0)), f"beam '{name}': velocity", "speed")
    w = vector(motion.pop("angular_velocity", (0, 0, 0)), f"beam '{name}': angular_velocity", "angular speed")
    if motion:
        raise FlexibleError(f"beam '{name}': {', '.join(motion)} is no setting; velocity and angular_velocity are")
    step = length / elements
    bodies, markers, parts = [], [], []
    for k, share in enumerate(step * node_shares(elements)):
        place = a + (b - a) * k / elements
        body = mechanism.body(
            f"{name}.{k}", section.mass * share, tuple(share * j for j in section.inertia), position=place,
            orientation=axes, velocity=u + np.cross(w, place - a), angular_velocity=w,
        )  # fmt: skip
        bodies.append(body)
        markers.append(body.marker(name=f"{name}.node{k}"))
    for k in range(elements):
        element = LargeBeam(f"{name}.beam{k + 1}", markers[k], markers[k + 1], step, section, tau)
        parts.append(mechanism.add(element))
    return BeamChain(bodies, markers, parts)


# Kernel of the beam element of large motion: two frames, an energy of their distance and relative rotation.
#
# With R = A_I^T A_J = exp(theta~) and the frame A_m = A_I exp(theta~/2) half-way between, the element of length l has
#
#     Gamma = A_m^T (P_J - P_I) - l e_z,    U = 1/(2 l) (Gamma . C_G Gamma + theta . C_k theta),
#
# which is objective for rotations of any size. With C_G from 1/(kappa G A) + l^2/(12 E I) the element is, for
# small strains, the exact one of Timoshenko under loads at its ends (residual bending flexibility, R. MacNeal, Comput.
# Struct. 8 (1978) 175). Strain rates enter with the factor tau: C (strain + tau strain'). In the axes of I, with
# r = A_I^T (P_J - P_I), S = (1 + exp(theta~/2))^-1 and D = (sum of theta~^k/(k+1)!)^-1, force and moment on I are
#
#     f = exp(theta~/2) n,    N = (1 - S^T) (r x f) + D^T m.


LENGTH = 0
SHEAR = 1
"""C_G: shear in x and y, tension, N."""
BENDING = 4
"""C_k: bending about x and y, torsion, N m^2."""
DELAY = 7
"""tau, s."""

HALF, BACK, MIDDLE, TANGENT, TRANSPOSED, REST = 0, 1, 2, 3, 4, 5
"""Rows of the functions of theta~: exp(theta~/2), its transpose, S, D, D^T, 1 - S^T."""

SERIES = 0.01
"""Square of the angle below which the functions are taken from their series."""

WORK = 150


@njit(cache=True, error_model="numpy")
def functions(square, out):
    """Write c0, c1, c2 and the derivatives of c1 and c2 by angle^2/2 of each function c0 + c1 theta~ + c2 theta~^2.

    Parameters
    ----------
    square : float
        Angle squared.
    out : ndarray, shape (6, 5)
        Rows as listed above.
    """
    x = square
    if x < SERIES:
        h1 = 0.5 - x * (1 / 48 - x * (1 / 3840 - x / 645120))
        dh1 = -2 * (1 / 48 - x * (2 / 3840 - 3 * x / 645120))
        h2 = 0.125 - x * (1 / 384 - x * (1 / 46080 - x / 10321920))
        dh2 = -2 * (1 / 384 - x * (2 / 46080 - 3 * x / 10321920))
        t = 0.125 + x * (1 / 384 + x * (1 / 15360 + 17 * x / 10321920))
        dt = 2 * (1 / 384 + x * (2 / 15360 + 51 * x / 10321920))
        b = 1 / 12 + x * (1 / 720 + x * (1 / 30240 + x / 1209600))
        db = 2 * (1 / 720 + x * (2 / 30240 + 3 * x / 1209600))
    else:
        angle = np.sqrt(x)
        s, c = np.sin(angle / 2), np.cos(angle / 2)
        quarter = np.tan(angle / 4)
        h1, h2, t = s / angle, (1 - c) / x, quarter / (2 * angle)
        dh1 = (c / (2 * angle) - s / x) / angle
        dh2 = (s / (2 * x) - 2 * (1 - c) / (x * angle)) / angle
        dt = ((1 + quarter * quarter) / (8 * angle) - quarter / (2 * x)) / angle
        b = 1 / x - c / (2 * angle * s)
        db = (-2 / (x * angle) + 1 / (4 * angle * s * s) + c / (2 * x * s)) / angle
    for k in range(6):
        for q in range(5):
            out[k, q] = 0.0
    out[HALF, 0], out[HALF, 1], out[HALF, 2], out[HALF, 3], out[HALF, 4] = 1.0, h1, h2, dh1, dh2
    out[BACK, 0], out[BACK, 1], out[BACK, 2], out[BACK, 3], out[BACK, 4] = 1.0, -h1, h2, -dh1, dh2
    out[MIDDLE, 0], out[MIDDLE, 1], out[MIDDLE, 3] = 0.5, -t, -dt
    out[TANGENT, 0], out[TANGENT, 1], out[TANGENT, 2], out[TANGENT, 4] = 1.0, -0.5, b, db
    out[TRANSPOSED, 0], out[TRANSPOSED, 1], out[TRANSPOSED, 2], out[TRANSPOSED, 4] = 1.0, 0.5, b, db
    out[REST, 0], out[REST, 1], out[REST, 3] = 0.5, -t, -dt


@njit(cache=True, error_model="numpy", forceinline=True)
def cross(a, b, out):
    """Write a x b."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    out[0], out[1] = x, y


@njit(cache=True, error_model="numpy")
def apply(row, theta, v, s, out):
    """Write c0 v + c1 theta x v + c2 theta x (theta x v) to ``out``; ``s`` is scratch of six."""
    once, twice = s[0:3], s[3:6]
    cross(theta, v, once)
    cross(theta, once, twice)
    for q in range(3):
        out[q] = row[0] * v[q] + row[1] * once[q] + row[2] * twice[q]


@njit(cache=True, error_model="numpy")
def apply_change(row, theta, dtheta, v, dv, s, out):
    """Write the change of `apply` with those of theta and v to ``out``.

    Parameters
    ----------
    row : ndarray, shape (5,)
        Of `functions`.
    theta, dtheta, v, dv : ndarray, shape (3,)
    s : ndarray, shape (12,)
        Scratch.
    """
    once, twice, d_once, d_twice = s[0:3], s[3:6], s[6:9], s[9:12]
    cross(theta, v, once)
    cross(theta, once, twice)
    along = theta[0] * dtheta[0] + theta[1] * dtheta[1] + theta[2] * dtheta[2]
    for q in range(3):
        out[q] = row[0] * dv[q] + along * (row[3] * once[q] + row[4] * twice[q])
    cross(dtheta, v, d_once)
    cross(theta, dv, d_twice)
    for q in range(3):
        d_once[q] += d_twice[q]
        out[q] += row[1] * d_once[q]
    cross(theta, d_once, d_twice)
    cross(dtheta, once, once)
    for q in range(3):
        out[q] += row[2] * (d_twice[q] + once[q])


@njit(cache=True, error_model="numpy")
def relative(frames, state):
    """Write r, theta, u, w, omega in the axes of I to ``state[0:15]``: place, turn, velocities of J against I.

    w is the angular velocity of I, omega that of J less w.
    """
    for c in range(3):
        for k in range(5):
            state[3 * k + c] = 0.0
        for q in range(3):
            axis = frames[0, FRAME_A + 3 * q + c]
            state[c] += axis * (frames[1, FRAME_P + q] - frames[0, FRAME_P + q])
            state[6 + c] += axis * (frames[1, FRAME_V + q] - frames[0, FRAME_V + q])
            state[9 + c] += axis * frames[0, FRAME_W + q]
            state[12 + c] += axis * (frames[1, FRAME_W + q] - frames[0, FRAME_W + q])
    trace = 0.0
    for a in range(3):
        p, q = (a + 1) % 3, (a + 2) % 3
        for m in range(3):
            one, two = FRAME_A + 3 * m, FRAME_A + 3 * m
            trace += frames[0, one + a] * frames[1, two + a]
            state[3 + a] += 0.5 * (frames[0, one + q] * frames[1, two + p] - frames[0, one + p] * frames[1, two + q])
    sine = np.sqrt(state[3] ** 2 + state[4] ** 2 + state[5] ** 2)
    angle = np.arctan2(sine, 0.5 * (trace - 1.0))
    factor = angle / sine if sine > 1e-4 else 1.0 + sine * sine / 6.0
    for a in range(3):
        state[3 + a] *= factor


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def large_beam(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write force and moment on I of the beam to J.

    Arguments as in `gearmbs.dae.equations.loads.forces`; there are no inputs.
    """
    state, fun = work[0:15], work[15:45].reshape(6, 5)
    relative(frames, state)
    r, theta, u, w, spin = state[0:3], state[3:6], state[6:9], state[9:12], state[12:15]
    functions(theta[0] ** 2 + theta[1] ** 2 + theta[2] ** 2, fun)
    gamma, gamma_rate, turn_rate, speed = work[45:48], work[48:51], work[51:54], work[54:57]
    n, m, f, moment, middle, s = work[57:60], work[60:63], work[63:66], work[66:69], work[69:72], work[72:84]
    length, tau = reals[LENGTH], reals[DELAY]
    apply(fun[BACK], theta, r, s, gamma)
    gamma[2] -= length
    apply(fun[MIDDLE], theta, spin, s, middle)
    for q in range(3):
        middle[q] += w[q]
    cross(r, middle, speed)
    for q in range(3):
        speed[q] += u[q]
    apply(fun[BACK], theta, speed, s, gamma_rate)
    apply(fun[TANGENT], theta, spin, s, turn_rate)
    for q in range(3):
        n[q] = reals[SHEAR + q] * (gamma[q] + tau * gamma_rate[q]) / length
        m[q] = reals[BENDING + q] * (theta[q] + tau * turn_rate[q]) / length
        diagnostics[0] += 0.5 * (reals[SHEAR + q] * gamma[q] ** 2 + reals[BENDING + q] * theta[q] ** 2) / length
        lost = reals[SHEAR + q] * gamma_rate[q] ** 2 + reals[BENDING + q] * turn_rate[q] ** 2
        diagnostics[1] += tau * lost / length
    apply(fun[HALF], theta, n, s, f)
    arm, part = work[84:87], work[87:90]
    cross(r, f, arm)
    apply(fun[REST], theta, arm, s, moment)
    apply(fun[TRANSPOSED], theta, m, s, part)
    for q in range(3):
        moment[q] += part[q]
    to_space(frames, f, wrench[0], 0)
    to_space(frames, moment, wrench[0], 3)
    if want & DERIVATIVES:
        beam_derivatives(reals, frames, work, wrench, jac)


@njit(cache=True, error_model="numpy")
def to_space(frames, v, out, k):
    """Write a vector in the axes of I to ``out[k:k+3]`` in global components."""
    for q in range(3):
        a = FRAME_A + 3 * q
        out[k + q] = frames[0, a] * v[0] + frames[0, a + 1] * v[1] + frames[0, a + 2] * v[2]


@njit(cache=True, error_model="numpy")
def beam_derivatives(reals, frames, work, wrench, jac):
    """Write the derivatives of the wrench, one column after the other.

    Parameters
    ----------
    reals, frames, wrench, jac
        As of the element.
    work : ndarray
        What `large_beam` has left in it.
    """
    state, fun = work[0:15], work[15:45].reshape(6, 5)
    dstate, change = work[90:105], work[105:111]
    axis, other = work[111:114], work[114:117]
    for column in range(24):
        frame, kind, c = column // 12, (column % 12) // 3, column % 3
        for q in range(3):
            axis[q] = frames[0, FRAME_A + 3 * c + q]
        for q in range(15):
            dstate[q] = 0.0
        sign = 1.0 if frame == 1 else -1.0
        if kind == 0 or kind == 2:
            first = 0 if kind == 0 else 6
            for q in range(3):
                dstate[first + q] = sign * axis[q]
        elif kind == 1:
            for q in range(3):
                other[q] = sign * axis[q]
            apply(fun[TANGENT], state[3:6], other, work[72:84], dstate[3:6])
            if frame == 0:
                # vectors fixed in space, seen from turned axes
                cross(state[0:3], axis, dstate[0:3])
                for k in range(6, 15, 3):
                    cross(state[k : k + 3], axis, dstate[k : k + 3])
        else:
            for q in range(3):
                dstate[12 + q] = sign * axis[q]
                if frame == 0:
                    dstate[9 + q] = axis[q]
        load_change(reals, state, fun, dstate, work, change)
        for q in range(3):
            a = FRAME_A + 3 * q
            for part in range(2):
                total = 0.0
                for p in range(3):
                    total += frames[0, a + p] * change[3 * part + p]
                jac[3 * part + q, column] = total
    # dA = dpi x A turns force and moment with I
    for q in range(3):
        q1, q2 = (q + 1) % 3, (q + 2) % 3
        for part in range(0, 6, 3):
            jac[part + q1, 3 + q2] += wrench[0, part + q]
            jac[part + q2, 3 + q1] -= wrench[0, part + q]


@njit(cache=True, error_model="numpy")
def load_change(reals, state, fun, dstate, work, out):
    """Write the changes of f and N in the axes of I to ``out[0:6]``.

    Parameters
    ----------
    reals : ndarray
        Of the element.
    state, dstate : ndarray, shape (15,)
        Of `relative`, and their change.
    fun : ndarray, shape (6, 5)
        Of `functions`.
    work : ndarray
        What `large_beam` has left in it; scratch from place 117 on.
    """
    r, theta, spin = state[0:3], state[3:6], state[12:15]
    dr, dtheta, du, dw, dspin = dstate[0:3], dstate[3:6], dstate[6:9], dstate[9:12], dstate[12:15]
    speed, n, m, f, middle, arm = work[54:57], work[57:60], work[60:63], work[63:66], work[69:72], work[84:87]
    s = work[72:84]
    dgamma, drate, dn, dm = work[117:120], work[120:123], work[123:126], work[126:129]
    a, b, c = work[129:132], work[132:135], work[135:138]
    length, tau = reals[LENGTH], reals[DELAY]
    apply_change(fun[BACK], theta, dtheta, r, dr, s, dgamma)
    apply_change(fun[MIDDLE], theta, dtheta, spin, dspin, s, a)
    for q in range(3):
        a[q] += dw[q]
    cross(dr, middle, b)
    cross(r, a, c)
    for q in range(3):
        c[q] += b[q] + du[q]
    apply_change(fun[BACK], theta, dtheta, speed, c, s, drate)
    apply_change(fun[TANGENT], theta, dtheta, spin, dspin, s, a)
    for q in range(3):
        dn[q] = reals[SHEAR + q] * (dgamma[q] + tau * drate[q]) / length
        dm[q] = reals[BENDING + q] * (dtheta[q] + tau * a[q]) / length
    apply_change(fun[HALF], theta, dtheta, n, dn, s, out[0:3])
    cross(dr, f, a)
    cross(r, out[0:3], b)
    for q in range(3):
        a[q] += b[q]
    apply_change(fun[REST], theta, dtheta, arm, a, s, b)
    apply_change(fun[TRANSPOSED], theta, dtheta, m, dm, s, c)
    for q in range(3):
        out[3 + q] = b[q] + c[q]
