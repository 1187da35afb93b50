"""Lagrange equations of the first kind as DAEs: M(q) v' = f - G^T lambda with g(q, t) = 0, in three formulations.

A problem writes its terms into one flat array of blocks; residual and Jacobian of I3, SI2 and SI1 follow from them.

* I3:  q' = v, M v' = f - G^T lambda, g = 0
* SI2: q' = v - G^T mu, ..., g = 0 and its time derivative G v + g_t = 0
* SI1: as SI2 with lambda = Lambda', mu = Gamma'

The unknowns are y = [q, v, lambda, mu].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import float64, int64, njit, types

from gearmbs.dae.problem import JACOBIAN_SIG, RESIDUAL_SIG, DAEProblem

FORMULATIONS = {"I3": 0, "SI2": 1, "SI1": 2}

# idata
FORM = 0
NQ = 1
NG = 2
NNZ = 3
N_HEADER = 4

TERMS_SIG = types.void(float64, types.float64[::1], types.float64[::1], int64, types.float64[::1], types.float64[::1])

_VEC = float64[::1]
_IVEC = int64[::1]


def block_offsets(nq: int, ng: int) -> dict[str, int]:
    """Return where each block starts in the flat array that a problem's ``terms`` writes.

    Blocks, row by row: ``mass`` (nq, nq), ``force`` (nq), ``g`` (ng), ``jac`` = dg/dq (ng, nq), ``g_t`` (ng); wanted
    only for the Jacobian: ``inertia_q`` = d(M v')/dq, ``force_q``, ``force_v`` (nq, nq each), ``hess`` = d2g/dq2
    (ng, nq, nq), ``jac_t`` = d2g/dq dt (ng, nq).
    """
    sizes = {
        "mass": nq * nq,
        "force": nq,
        "g": ng,
        "jac": ng * nq,
        "g_t": ng,
        "inertia_q": nq * nq,
        "force_q": nq * nq,
        "force_v": nq * nq,
        "hess": ng * nq * nq,
        "jac_t": ng * nq,
    }
    starts = np.concatenate(([0], np.cumsum(list(sizes.values()))))
    return dict(zip((*sizes, "end"), (int(s) for s in starts), strict=True))


@njit(types.void(_VEC, _VEC, _VEC, _IVEC, _VEC), cache=True, nogil=True, error_model="numpy")
def assemble_residual(y, yp, out, idata, b):
    """Write G(t, y, y') from the blocks ``b``."""
    form = idata[FORM]
    nq = idata[NQ]
    ng = idata[NG]
    o_force = nq * nq
    o_g = o_force + nq
    o_jac = o_g + ng
    o_gt = o_jac + ng * nq
    lam = yp if form == 2 else y
    for i in range(nq):
        out[i] = yp[i] - y[nq + i]
        s = -b[o_force + i]
        for j in range(nq):
            s += b[i * nq + j] * yp[nq + j]
        out[nq + i] = s
    for k in range(ng):
        multiplier = lam[2 * nq + k]
        out[2 * nq + k] = b[o_g + k]
        rate = b[o_gt + k]
        for i in range(nq):
            a = b[o_jac + k * nq + i]
            out[nq + i] += a * multiplier
            rate += a * y[nq + i]
        if form != 0:
            stabiliser = lam[2 * nq + ng + k]
            for i in range(nq):
                out[i] += b[o_jac + k * nq + i] * stabiliser
            out[2 * nq + ng + k] = rate


@njit(types.void(_VEC, _VEC, float64, _VEC, _IVEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def assemble_jacobian(y, yp, cj, vals, idata, b, dense):
    """Write dG/dy + cj dG/dy' from the blocks; ``dense`` holds the (n, n) matrix on the way."""
    form = idata[FORM]
    nq = idata[NQ]
    ng = idata[NG]
    n = 2 * nq + ng if form == 0 else 2 * nq + 2 * ng
    o_jac = nq * nq + nq + ng
    o_inertia_q = o_jac + ng * nq + ng
    o_force_q = o_inertia_q + nq * nq
    o_force_v = o_force_q + nq * nq
    o_hess = o_force_v + nq * nq
    o_jac_t = o_hess + ng * nq * nq
    lam = yp if form == 2 else y
    through = cj if form == 2 else 1.0
    for i in range(nq):
        dense[i * n + nq + i] = -1.0
        for j in range(nq):
            m = i * nq + j
            dense[i * n + j] = cj if i == j else 0.0
            dense[(nq + i) * n + j] = b[o_inertia_q + m] - b[o_force_q + m]
            dense[(nq + i) * n + nq + j] = cj * b[m] - b[o_force_v + m]
    for k in range(ng):
        multiplier = lam[2 * nq + k]
        stabiliser = lam[2 * nq + ng + k] if form != 0 else 0.0
        for i in range(nq):
            a = b[o_jac + k * nq + i]
            dense[(2 * nq + k) * n + i] = a
            dense[(nq + i) * n + 2 * nq + k] = through * a
            rate_q = b[o_jac_t + k * nq + i]
            for j in range(nq):
                h = b[o_hess + (k * nq + i) * nq + j]
                if h != 0.0:
                    dense[i * n + j] += stabiliser * h
                    dense[(nq + i) * n + j] += multiplier * h
                    rate_q += h * y[nq + j]
            if form != 0:
                dense[i * n + 2 * nq + ng + k] = through * a
                dense[(2 * nq + ng + k) * n + i] = rate_q
                dense[(2 * nq + ng + k) * n + nq + i] = a
    for p in range(idata[NNZ]):
        vals[p] = dense[idata[N_HEADER + p]]


@dataclass(frozen=True)
class LagrangeSystem:
    """A mechanical system with its compiled terms and what a DAE needs around them.

    Attributes
    ----------
    terms : compiled function
        ``terms(t, y, yp, want_jacobian, rdata, blocks)``.
    nq, ng : int
        Coordinates and constraints.
    rdata : ndarray
        Parameters.
    q0, v0 : ndarray
        Consistent start.
    q_scale, v_scale : ndarray
        Magnitudes; tolerances are relative to them.
    force_scale : float
        Magnitude of the multipliers.
    """

    terms: Callable
    nq: int
    ng: int
    rdata: np.ndarray
    q0: np.ndarray
    v0: np.ndarray
    q_scale: np.ndarray
    v_scale: np.ndarray
    force_scale: float

    def blocks(self, t: float, y: np.ndarray, yp: np.ndarray) -> dict[str, np.ndarray]:
        """Return mass, force, constraint and derivative blocks at one point, shaped."""
        o = block_offsets(self.nq, self.ng)
        b = np.zeros(o["end"])
        self.terms(t, y, yp, 1, self.rdata, b)
        q, g = self.nq, self.ng
        shapes = {
            "mass": (q, q), "force": (q,), "g": (g,), "jac": (g, q), "g_t": (g,), "inertia_q": (q, q),
            "force_q": (q, q), "force_v": (q, q), "hess": (g, q, q), "jac_t": (g, q),
        }  # fmt: skip
        return {name: b[o[name] : o[name] + int(np.prod(shape))].reshape(shape) for name, shape in shapes.items()}

    def accelerations(self, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Solve the index-1 system for v' and lambda; g_tt is differenced."""
        y = np.concatenate((q, v, np.zeros(2 * self.ng)))
        b = self.blocks(t, y, np.zeros_like(y))
        d = 1e-6
        rates = [self.blocks(s, y, np.zeros_like(y))["g_t"] for s in (t - d, t + d)]
        gamma = np.einsum("kij,i,j->k", b["hess"], v, v) + 2.0 * b["jac_t"] @ v + (rates[1] - rates[0]) / (2 * d)
        kkt = np.block([[b["mass"], b["jac"].T], [b["jac"], np.zeros((self.ng, self.ng))]])
        solution = np.linalg.solve(kkt, np.concatenate((b["force"], -gamma)))
        return solution[: self.nq], solution[self.nq :]

    def problem(self, formulation: str = "SI2") -> DAEProblem:
        """Return the DAE in one formulation."""
        form = FORMULATIONS[formulation]
        nq, ng = self.nq, self.ng
        n = 2 * nq + (ng if form == 0 else 2 * ng)
        acc, lam = self.accelerations(0.0, self.q0, self.v0)
        y0, yp0 = np.zeros(n), np.zeros(n)
        y0[:nq], y0[nq : 2 * nq] = self.q0, self.v0
        yp0[:nq], yp0[nq : 2 * nq] = self.v0, acc
        (yp0 if form == 2 else y0)[2 * nq : 2 * nq + ng] = lam
        controlled = np.zeros(n, dtype=bool)
        controlled[: nq if form == 0 else 2 * nq] = True
        differential = np.zeros(n, dtype=bool)
        differential[: n if form == 2 else 2 * nq] = True
        scale = np.concatenate((self.q_scale, self.v_scale, np.full(n - 2 * nq, self.force_scale)))
        rows, cols = self._pattern(form, n)
        idata = np.concatenate(([form, nq, ng, len(rows)], rows * n + cols)).astype(np.int64)
        indptr = np.concatenate(([0], np.cumsum(np.bincount(cols, minlength=n)))).astype(np.int64)
        names = [f"{kind}{i + 1}" for kind, m in (("q", nq), ("v", nq), ("lambda", ng)) for i in range(m)]
        residual, jacobian = compiled(self.terms)
        return DAEProblem(
            n=n,
            residual=residual,
            jacobian=jacobian,
            indptr=indptr,
            indices=rows.astype(np.int64),
            idata=idata,
            rdata=self.rdata.copy(),
            work_size=block_offsets(nq, ng)["end"] + n * n,
            y0=y0,
            yp0=yp0,
            error_mask=controlled,
            atol_scale=scale,
            scale=scale,
            differential=differential,
            names=names + [f"mu{i + 1}" for i in range(n - 2 * nq - ng)],
        )

    def _pattern(self, form: int, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Find the structural nonzeros as the union over random states, column by column."""
        rng = np.random.default_rng(0)
        end = block_offsets(self.nq, self.ng)["end"]
        everywhere = np.arange(n * n)
        idata = np.concatenate(([form, self.nq, self.ng, n * n], everywhere)).astype(np.int64)
        mask = np.zeros((n, n), dtype=bool)
        jacobian = compiled(self.terms)[1]
        for _ in range(4):
            vals = np.zeros(n * n)
            y, yp = rng.normal(size=n), rng.normal(size=n)
            jacobian(rng.uniform(0.1, 1.0), y, yp, 1.37, vals, idata, self.rdata, np.zeros(end + n * n))
            mask |= vals.reshape(n, n) != 0.0
        cols, rows = np.nonzero(mask.T)
        return rows, cols


@cache
def compiled(terms: Callable) -> tuple[Callable, Callable]:
    """Return residual and Jacobian around a compiled ``terms``; for problems that need no cache of their own."""

    @njit(RESIDUAL_SIG, nogil=True, error_model="numpy")
    def residual(t, y, yp, out, idata, rdata, work):
        terms(t, y, yp, 0, rdata, work)
        assemble_residual(y, yp, out, idata, work)

    @njit(JACOBIAN_SIG, nogil=True, error_model="numpy")
    def jacobian(t, y, yp, cj, vals, idata, rdata, work):
        n = y.shape[0]
        terms(t, y, yp, 1, rdata, work)
        assemble_jacobian(y, yp, cj, vals, idata, work, work[work.shape[0] - n * n :])

    return residual, jacobian
