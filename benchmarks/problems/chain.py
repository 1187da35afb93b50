"""Chain of N four-bar linkages: N + 1 upright links on the ground joined by N couplers, one degree of freedom.

All links are uniform bars of 1 m and 1 kg; gravity pulls down; the upright links start at the top, their tips moving at
1 m/s. When all links lie in one line the constraints lose rank. In exact arithmetic the linkage stays a parallelogram,
so that its motion is that of one physical pendulum.

References
----------
.. [1] M. Gonzalez et al., "A benchmarking system for MBS simulation software", Multibody Syst. Dyn. 16 (2006) 179-190,
       and the benchmark library of the IFToMM technical committee for multibody dynamics, problem A02.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

from benchmarks.problems.lagrange import FORMULATIONS
from gearmbs.dae.problem import JACOBIAN_SIG, RESIDUAL_SIG, DAEProblem

GRAVITY = 9.81
MASS = 1.0
INERTIA = 1.0 / 12.0

# idata: header, then for each joint body and end of both sides, then where each Jacobian entry goes
FORM = 0
BODIES = 1
JOINTS = 2
NNZ = 3
ENTRIES = 4
N_HEADER = 5


@njit(RESIDUAL_SIG, cache=True, nogil=True, error_model="numpy")
def residual(t, y, yp, out, idata, rdata, work):
    """Write the residual; each body has (x, y, angle), each joint two rows."""
    form = idata[FORM]
    nq = 3 * idata[BODIES]
    ng = 2 * idata[JOINTS]
    lam = yp if form == 2 else y
    for i in range(nq):
        out[i] = yp[i] - y[nq + i]
        weight = INERTIA if i % 3 == 2 else MASS
        out[nq + i] = weight * yp[nq + i]
        if i % 3 == 1:
            out[nq + i] += MASS * GRAVITY
    for body in range(idata[BODIES]):
        work[2 * body] = np.cos(y[3 * body + 2])
        work[2 * body + 1] = np.sin(y[3 * body + 2])
    for k in range(idata[JOINTS]):
        row = 2 * nq + 2 * k
        gx = -rdata[2 * k]
        gy = -rdata[2 * k + 1]
        vx = 0.0
        vy = 0.0
        for side in range(2):
            body = idata[N_HEADER + 4 * k + 2 * side]
            if body < 0:
                continue
            sign = 1.0 - 2.0 * side
            half = 0.5 * idata[N_HEADER + 4 * k + 2 * side + 1]
            rx = half * work[2 * body]
            ry = half * work[2 * body + 1]
            q = 3 * body
            gx += sign * (y[q] + rx)
            gy += sign * (y[q + 1] + ry)
            vx += sign * (y[nq + q] - ry * y[nq + q + 2])
            vy += sign * (y[nq + q + 1] + rx * y[nq + q + 2])
            lx = sign * lam[row]
            ly = sign * lam[row + 1]
            out[nq + q] += lx
            out[nq + q + 1] += ly
            out[nq + q + 2] += rx * ly - ry * lx
            if form != 0:
                mx = sign * lam[row + ng]
                my = sign * lam[row + ng + 1]
                out[q] += mx
                out[q + 1] += my
                out[q + 2] += rx * my - ry * mx
        out[row] = gx
        out[row + 1] = gy
        if form != 0:
            out[row + ng] = vx
            out[row + ng + 1] = vy


@njit("int64(int64, float64[::1], float64[::1], float64, float64[::1], int64[::1])", cache=True, error_model="numpy")
def _entries(mode, y, yp, cj, target, idata):
    """Go through the entries in a fixed order: mode 0 adds values to CSC places, mode 1 lists row * n + column."""
    form = idata[FORM]
    nq = 3 * idata[BODIES]
    ng = 2 * idata[JOINTS]
    n = 2 * nq + ng if form == 0 else 2 * nq + 2 * ng
    lam = yp if form == 2 else y
    through = cj if form == 2 else 1.0
    place = idata[N_HEADER + 4 * idata[JOINTS] :]
    e = 0
    for i in range(nq):
        weight = INERTIA if i % 3 == 2 else MASS
        for which in range(3):
            if mode == 0:
                value = cj if which == 0 else (-1.0 if which == 1 else cj * weight)
                target[place[e]] += value
            else:
                r = i if which < 2 else nq + i
                c = i if which == 0 else nq + i
                target[e] = r * n + c
            e += 1
    for k in range(idata[JOINTS]):
        row = 2 * nq + 2 * k
        for side in range(2):
            body = idata[N_HEADER + 4 * k + 2 * side]
            if body < 0:
                continue
            sign = 1.0 - 2.0 * side
            half = 0.5 * idata[N_HEADER + 4 * k + 2 * side + 1]
            q = 3 * body
            rx = half * np.cos(y[q + 2])
            ry = half * np.sin(y[q + 2])
            for axis in range(2):
                turn = -ry if axis == 0 else rx
                for which in range(2):
                    g = sign if which == 0 else sign * turn
                    col = q + axis if which == 0 else q + 2
                    if mode == 0:
                        target[place[e]] += g
                        target[place[e + 1]] += through * g
                    else:
                        target[e] = (row + axis) * n + col
                        target[e + 1] = (nq + col) * n + row + axis
                    e += 2
                    if form != 0:
                        if mode == 0:
                            target[place[e]] += g
                            target[place[e + 1]] += through * g
                        else:
                            target[e] = (row + ng + axis) * n + nq + col
                            target[e + 1] = col * n + row + ng + axis
                        e += 2
            spin = y[nq + q + 2]
            if mode == 0:
                target[place[e]] += sign * (-rx * lam[row] - ry * lam[row + 1])
            else:
                target[e] = (nq + q + 2) * n + q + 2
            e += 1
            if form != 0:
                if mode == 0:
                    target[place[e]] += sign * (-rx * lam[row + ng] - ry * lam[row + ng + 1])
                    target[place[e + 1]] += -sign * rx * spin
                    target[place[e + 2]] += -sign * ry * spin
                else:
                    target[e] = (q + 2) * n + q + 2
                    target[e + 1] = (row + ng) * n + q + 2
                    target[e + 2] = (row + ng + 1) * n + q + 2
                e += 3
    return e


@njit(JACOBIAN_SIG, cache=True, nogil=True, error_model="numpy")
def jacobian(t, y, yp, cj, vals, idata, rdata, work):
    """Write dG/dy + cj dG/dy' in CSC order."""
    for p in range(idata[NNZ]):
        vals[p] = 0.0
    _entries(0, y, yp, cj, vals, idata)


def four_bar_chain(loops: int, formulation: str = "SI2") -> DAEProblem:
    """Return the chain of ``loops`` four-bar linkages; bodies are upright link 0, coupler 0, upright link 1, ..."""
    form = FORMULATIONS[formulation]
    bodies = 2 * loops + 1
    # a joint joins end +-1 of one body with an end of another, or with a ground point (body -1)
    joints: list[tuple[int, int, int, int]] = []
    ground: list[tuple[float, float]] = []
    for i in range(loops + 1):
        joints.append((2 * i, -1, -1, 0))
        ground.append((float(i), 0.0))
        if i > 0:
            joints.append((2 * i - 1, 1, 2 * i, 1))
            ground.append((0.0, 0.0))
        if i < loops:
            joints.append((2 * i, 1, 2 * i + 1, -1))
            ground.append((0.0, 0.0))
    nq, ng = 3 * bodies, 2 * len(joints)
    n = 2 * nq + (ng if form == 0 else 2 * ng)
    header = [form, bodies, len(joints), 0, 0, *np.ravel(joints)]
    idata = np.array(header, dtype=np.int64)
    flat = np.zeros(16 * nq + 32 * len(joints))
    y0, yp0 = np.zeros(n), np.zeros(n)
    count = _entries(1, y0, yp0, 1.0, flat, idata)
    places = flat[:count].astype(np.int64)
    unique, place = np.unique((places % n) * n + places // n, return_inverse=True)
    idata[NNZ], idata[ENTRIES] = len(unique), count
    idata = np.concatenate((idata, place)).astype(np.int64)

    speed, pull = 1.0, gravity_rate(loops)
    for i in range(loops + 1):
        y0[6 * i : 6 * i + 3] = (i, 0.5, 0.5 * np.pi)
        y0[nq + 6 * i : nq + 6 * i + 3] = (0.5 * speed, 0.0, -speed)
        if i < loops:
            y0[6 * i + 3 : 6 * i + 6] = (i + 0.5, 1.0, 0.0)
            y0[nq + 6 * i + 3] = speed
    # upright links at the top: no angular acceleration, only the pull towards the pivots
    yp0[:nq] = y0[nq : 2 * nq]
    yp0[nq : 2 * nq].reshape(-1, 3)[0::2, 1] = -0.5 * speed**2
    yp0[nq : 2 * nq].reshape(-1, 3)[1::2, 1] = -(speed**2)
    _set_multipliers(y0, yp0, idata, nq, ng, form)
    controlled = np.zeros(n, dtype=bool)
    controlled[: nq if form == 0 else 2 * nq] = True
    differential = np.zeros(n, dtype=bool)
    differential[: n if form == 2 else 2 * nq] = True
    scale = np.concatenate((np.ones(nq), np.full(nq, np.sqrt(2.0 * pull)), np.full(n - 2 * nq, 10.0 * GRAVITY)))
    return DAEProblem(
        n=n,
        residual=residual,
        jacobian=jacobian,
        indptr=np.searchsorted(unique // n, np.arange(n + 1)).astype(np.int64),
        indices=(unique % n).astype(np.int64),
        idata=idata,
        rdata=np.ravel(ground),
        work_size=2 * bodies,
        y0=y0,
        yp0=yp0,
        error_mask=controlled,
        atol_scale=scale,
        scale=scale,
        differential=differential,
        names=[f"{kind}{axis}({b})" for kind in ("", "v_") for b in range(bodies) for axis in "xyt"],
    )


def _set_multipliers(y0, yp0, idata, nq, ng, form) -> None:
    """Joint forces at the start from the equations of motion, which are linear in them, by least squares."""
    n = len(y0)
    out = np.zeros(n)
    zero_work = np.zeros(2 * idata[BODIES])
    rdata = np.zeros(2 * idata[JOINTS])
    residual(0.0, y0, yp0, out, idata, rdata, zero_work)
    rest = out[nq : 2 * nq].copy()
    target = yp0 if form == 2 else y0
    columns = np.zeros((nq, ng))
    for k in range(ng):
        target[2 * nq + k] = 1.0
        residual(0.0, y0, yp0, out, idata, rdata, zero_work)
        columns[:, k] = out[nq : 2 * nq] - rest
        target[2 * nq + k] = 0.0
    target[2 * nq : 2 * nq + ng] = np.linalg.lstsq(columns, -rest, rcond=None)[0]


def gravity_rate(loops: int) -> float:
    """Return g times the ratio of first moment to inertia of the parallelogram: theta'' = rate * sin(theta)."""
    first = 0.5 * (loops + 1) + loops
    inertia = (loops + 1) / 3.0 + loops
    return GRAVITY * first / inertia


def chain_reference(loops: int, times: np.ndarray) -> np.ndarray:
    """Return angle and rate of the upright links from the one-degree-of-freedom pendulum, shape (2, m)."""
    rate = gravity_rate(loops)
    solution = solve_ivp(
        lambda t, s: (s[1], -rate * np.cos(s[0])),
        (0.0, float(times[-1])),
        (0.5 * np.pi, -1.0),
        method="DOP853",
        t_eval=times,
        rtol=1e-13,
        atol=1e-13,
    )
    return solution.y
