"""A mechanism as a DAE: tables, names, consistent initial values, and the problem an integrator solves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from gearmbs.dae.equations import jacobian, residual, unknowns
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.builder import TableBuilder
from gearmbs.dae.equations.constraint_terms import ANGLE, dot3
from gearmbs.dae.equations.euler_switch import hook
from gearmbs.dae.equations.reactions import reactions_from
from gearmbs.dae.equations.rotation import (
    KIN_A,
    KIN_ADOT,
    KIN_AXES,
    KIN_H,
    POSE_A,
    POSE_COLUMNS,
    POSE_R,
    POSE_V,
    POSE_W,
    axes_and_velocity,
    best_reference,
    euler_angles,
    euler_rates,
)
from gearmbs.dae.equations.unknowns import FORMULATIONS, I3, SI1, Unknown
from gearmbs.dae.equations.update import inertia_times
from gearmbs.dae.errors import AssemblyError, ModelError, SingularModelError
from gearmbs.dae.model import evaluator, initial
from gearmbs.dae.problem import DAEProblem

DENSE_COORDINATES = 600
"""Coordinates up to which motions without inertia are looked for by dense decompositions."""
INVERSE_ITERATIONS = 3
MAX_LOAD_ITERATIONS = 200
"""Of loads that depend on each other, at the start; friction converges like a power of the friction coefficient."""

LARGEST_LOCK = 600
"""Constraint rows up to which the cause of a failure is sought in a locking position."""


@njit("void(float64[:, ::1], int64[::1], float64[::1], float64[::1], float64[::1])", cache=True, error_model="numpy")
def state_from_pose(pose, idata, rdata, work, y):
    """Fill u, p, eps, R, theta of y from R, A, v, omega of each moving body."""
    tab = T.unpack(idata, rdata, work)
    kin = tab.kin
    s = tab.scratch
    for b in range(1, idata[T.H_BODIES]):
        row, at = pose[b - 1], tab.at[b]
        th, e, p = at[T.AT_THETA], at[T.AT_EPS], at[T.AT_P]
        for c in range(3):
            y[at[T.AT_R] + c] = row[POSE_R + c]
            y[at[T.AT_U] + c] = row[POSE_V + c]
        for c in range(9):
            kin[b, KIN_A + c] = row[POSE_A + c]
        euler_angles(row, POSE_A, tab.code[b], y, th)
        axes_and_velocity(y[th], y[th + 1], 0.0, 0.0, 0.0, kin, b)
        euler_rates(kin, b, row, POSE_W, y, e)
        inertia_times(kin[b], tab.body[b], row, POSE_W, kin[b], KIN_H, s)
        for m in range(3):
            y[p + m] = dot3(kin[b], KIN_AXES + 3 * m, kin[b], KIN_H)


def _restart_rates(t, y, yp, idata, rdata) -> np.ndarray:
    """Return y' after a change of reference: angles' rates are eps, p' makes its residual vanish."""
    yp = yp.copy()
    out, work = np.zeros(y.size), np.zeros(int(idata[T.H_WORK]))
    e, r, th, p, lam = (int(idata[k]) for k in (T.H_EPS, T.H_R, T.H_THETA, T.H_P, T.H_LAMBDA))
    yp[th:lam] = y[e:r]
    residual.residual(t, y, yp, out, idata, rdata, work)
    yp[p:e] -= out[p:e]
    return yp


class System:
    """The tables of a mechanism with names, and what is computed from them before an integration.

    Built by :meth:`gearmbs.mechanism.Mechanism.compile`; users rarely make one themselves.

    Parameters
    ----------
    builder : TableBuilder
        Bodies, markers, constraint rows, force elements.
    pose : ndarray, shape (bodies, 18)
        Position R, orientation A (row-major), velocity v and angular velocity omega of each moving body, global
        components; a guess that :meth:`initialise` makes consistent.
    body_names, row_names, force_names : list of str
        Names for tables and messages; a row's name is ``joint: what it enforces``.
    """

    def __init__(
        self,
        builder: TableBuilder,
        pose: np.ndarray,
        body_names: list[str],
        row_names: list[str],
        force_names: list[str],
        t0: float = 0.0,
    ) -> None:
        self.builder = builder
        self.pose = np.array(pose, dtype=float).reshape(-1, POSE_COLUMNS)
        self.body_names = body_names
        self.row_names = row_names
        self.force_names = force_names
        self.row_index = list(range(len(row_names)))
        self.state_names: list[str] = []
        self.state_start = np.zeros(0)
        self.t0 = t0
        self.report: initial.InitialReport | None = None
        self._plan: tuple = (None, None)
        self._dropped: tuple | None = None
        self.mechanism: Any = None
        self.marker_index: dict[int, int] = {}

    # --- before the integration -------------------------------------------------------------------

    @property
    def length(self) -> float:
        """A typical length in m: the largest marker arm or distance between bodies, at least 1 mm."""
        arms = [np.abs(m[:3]).max() for m in self.builder.marker_frame] or [0.0]
        spread = np.ptp(self.pose[:, :3], axis=0).max(initial=0.0)
        return float(max(max(arms), spread, 1e-3))

    def coordinate_weights(self) -> np.ndarray:
        """Weights of the six spatial displacements of each body: 1 for metres, L^2 for radians."""
        one = np.concatenate([np.ones(3), np.full(3, min(self.length, 1.0) ** 2)])
        return np.tile(one, self.pose.shape[0])

    def choose_references(self, pose: np.ndarray) -> None:
        """Give each body the reference that is farther from its Euler singularity."""
        for b, row in enumerate(pose):
            self.builder.codes[b + 1] = best_reference(np.ascontiguousarray(row[3:12]), 0)

    def displaced(self, pose: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return the pose after displacements dR and rotations dpi (exponential map)."""
        from scipy.spatial.transform import Rotation

        pose = pose.copy()
        step = step.reshape(-1, 6)
        pose[:, 0:3] += step[:, 0:3]
        turned = Rotation.from_rotvec(step[:, 3:6]).as_matrix() @ pose[:, 3:12].reshape(-1, 3, 3)
        pose[:, 3:12] = turned.reshape(-1, 9)
        return pose

    def _evaluate(self, pose: np.ndarray, t: float, inner: np.ndarray | None = None):
        """Assemble the index-1 system at a pose; return (matrix, rhs, phi, loads, y, idata, rdata, work).

        ``inner`` holds loads and states, F to z of y; default: no loads, states at their start.
        """
        self.choose_references(pose)
        idata, rdata, size = self.builder.pack(I3)
        work = np.zeros(size)
        y = np.zeros(int(idata[T.H_UNKNOWNS]))
        y[int(idata[T.H_Z]) : int(idata[T.H_Z]) + self.state_start.size] = self.state_start
        if inner is not None:
            y[int(idata[T.H_F]) :] = inner
        state_from_pose(np.ascontiguousarray(pose), idata, rdata, work, y)
        key = len(self.builder.rows)
        if self._plan[0] != key:
            self._plan = (key, evaluator.pattern(idata, rdata, size))
        indptr, indices, slots = self._plan[1]
        n = indptr.size - 1
        vals = np.zeros(indices.size)
        records = evaluator.assemble(np.array([t]), y[None, :], slots, idata, rdata, size, vals)
        matrix = csc_array((vals, indices, indptr), shape=(n, n))
        return matrix, records.solution[0], records.phi[0], records.loads[0], y, idata, rdata, work

    def constraint_jacobian(self, pose: np.ndarray, t: float) -> tuple[csc_array, np.ndarray, np.ndarray]:
        """Return Phi_q in spatial displacements, Phi, and Phi_q v + Phi_t at a pose."""
        matrix, _, phi, *_ = self._evaluate(pose, t)
        base = 6 * pose.shape[0]
        return csc_array(matrix[base:, :base]), phi[0::3].copy(), phi[1::3].copy()

    def keep_rows(self, kept: np.ndarray) -> None:
        """Drop all constraint rows but ``kept``."""
        if kept.size == len(self.builder.rows):
            return
        old = self.builder
        whole = (old.rows, old.terms, old.coef, old.reference)
        bounds = [row[0] for row in old.rows] + [len(old.terms)]
        rows: list[tuple[int, int, int]] = []
        terms: list[tuple[int, ...]] = []
        coef: list[float] = []
        reference: list[float] = []
        for i in kept:
            rows.append((len(terms), old.rows[i][1], old.rows[i][2]))
            span = slice(bounds[i], bounds[i + 1])
            terms.extend(old.terms[span])
            coef.extend(old.coef[span])
            reference.extend(old.reference[span])
        lam, after = old.layout(I3)["lambda"], old.layout(I3)["F"]
        end = old.layout(I3)["n"]
        old.rows, old.terms, old.coef, old.reference = rows, terms, coef, reference
        moved = {lam + int(i): lam + k for k, i in enumerate(kept)}
        moved |= {k: k - after + old.layout(I3)["F"] for k in range(after, end)}
        old.renumber_unknowns(moved)
        dropped = np.setdiff1d(np.arange(len(whole[0])), kept)
        self._dropped = (whole, dropped, [self.row_names[i] for i in dropped])
        self.row_names = [self.row_names[i] for i in kept]
        self.row_index = [self.row_index[i] for i in kept]

    @property
    def has_dropped_rows(self) -> bool:
        """Whether constraint rows were set aside as redundant."""
        return self._dropped is not None

    def dropped_rates(self, pose: np.ndarray, t: float) -> tuple[csc_array, np.ndarray, list[str]]:
        """Return Phi_q, Phi_q v + Phi_t and the names of the rows set aside as redundant, at a pose."""
        assert self._dropped is not None
        whole, dropped, names = self._dropped
        builder = self.builder
        kept = (builder.rows, builder.terms, builder.coef, builder.reference)
        builder.rows, builder.terms, builder.coef, builder.reference = whole
        try:
            jacobian, _, rate = self.constraint_jacobian(pose, t)
        finally:
            builder.rows, builder.terms, builder.coef, builder.reference = kept
        return csc_array(jacobian[dropped]), rate[dropped], names

    def conflict(self, pose: np.ndarray, t: float) -> str | None:
        """Return which row set aside as redundant contradicts the motion at a pose, or None."""
        from gearmbs.dae.model.conflicts import conflict

        return conflict(self, pose, t) if self.has_dropped_rows else None

    def locking(self, pose: np.ndarray, t: float) -> str | None:
        """Return which constraint rows are about to depend on each other at a pose, None when they are not.

        At a position where a mechanism locks the constraint Jacobian loses rank; near it, its smallest singular value
        is well below that of the initial position.
        """
        if not self.row_names or len(self.row_names) > LARGEST_LOCK:
            return None
        scale = 1.0 / np.sqrt(self.coordinate_weights())

        def smallest(at: np.ndarray, time: float) -> tuple[float, np.ndarray]:
            left, values, _ = np.linalg.svd(self.constraint_jacobian(at, time)[0].toarray() * scale)
            return float(values[-1]), left[:, -1]

        value, direction = smallest(pose, t)
        if not np.isfinite(value) or value > 0.25 * smallest(self.pose, self.t0)[0]:
            return None
        rows = np.argsort(-np.abs(direction))[:3]
        named = ", ".join(self.row_names[r] for r in rows if abs(direction[r]) > 0.1 * np.abs(direction).max())
        return (
            f"The mechanism is near a position where it locks, or can branch: {named} come to depend on each other. "
            "Check the lengths, and whether the motions ask for more than the mechanism can reach."
        )

    def initialise(self) -> initial.InitialReport:
        """Make positions and velocities consistent; set redundant constraint rows aside.

        Raises
        ------
        AssemblyError
            If the joints contradict each other or cannot be satisfied.
        SingularModelError
            If a body can move without inertia.
        """
        if not np.all(np.isfinite(self.pose)):
            bad = self.body_names[int(np.argwhere(~np.isfinite(self.pose))[0, 0])]
            raise ModelError(f"body '{bad}': initial position, orientation or velocity is not finite")
        initial.check_inertia(self)
        pose, self.report = initial.assemble_position(self, self.pose, self.t0)
        self.pose = initial.consistent_velocity(self, pose, self.t0)
        found = self.conflict(self.pose, self.t0)
        if found is not None:
            raise AssemblyError(found)
        return self.report

    def accelerations(self, pose: np.ndarray, t: float):
        """Return (a, alpha) a row per body, lambda, force records, and y with its loads at a pose.

        Loads that depend on other loads or on reactions are iterated until they agree.
        """
        base = 6 * pose.shape[0]
        inner: np.ndarray | None = None
        for attempt in range(MAX_LOAD_ITERATIONS if self._coupled() else 1):
            matrix, rhs, _, loads, y, idata, rdata, work = self._evaluate(pose, t, inner)
            self._check_finite(matrix, rhs, loads, t)
            try:
                solution = splu(matrix).solve(rhs)
            except RuntimeError:
                solution = np.full(rhs.size, np.nan)
            if not np.all(np.isfinite(solution)) or (attempt == 0 and self._massless(matrix, base)):
                raise SingularModelError(self._singular_message(matrix, base))
            last, inner = inner, self._inner(y, loads, idata)
            y[int(idata[T.H_F]) :] = inner
            reactions_from(solution[base:].copy(), y, idata, rdata, work)
            inner = y[int(idata[T.H_F]) :].copy()
            if last is not None and np.abs(inner - last).max() <= 1e-13 * (1e-3 + np.abs(inner).max()):
                break
        return solution[:base].reshape(-1, 6), solution[base:], loads, y, idata, rdata, work

    def _check_finite(self, matrix: csc_array, rhs: np.ndarray, loads: np.ndarray, t: float) -> None:
        """Raise a ModelError that names the load, constraint or body whose terms of the equations are not finite."""
        bad = ~np.all(np.isfinite(loads[:, :6]), axis=1)
        if np.any(bad[: len(self.force_names)]):
            name = self.force_names[int(np.argmax(bad))]
            element = self.mechanism.elements.get(name) if self.mechanism is not None else None
            raise ModelError(
                f"{getattr(element, 'kind', 'load')} '{name}': its value at t = {t:.6g} s is not finite; look for a "
                f"division by zero, a root or logarithm of a negative number or coinciding markers in {element!r}"
            )
        base = matrix.shape[0] - len(self.row_names)
        wrong = np.flatnonzero(~np.isfinite(rhs))
        if wrong.size and wrong[-1] >= base:
            raise ModelError(
                f"{self.row_names[wrong[-1] - base]}: the derivatives of its function of time at t = {t:.6g} s are not "
                "finite; let the motion begin smoothly"
            )
        if wrong.size:
            raise ModelError(f"body '{self.body_names[wrong[0] // 6]}': its forces at t = {t:.6g} s are not finite")

    def _coupled(self) -> bool:
        """Whether some load depends on unknowns other than positions, velocities and states."""
        first, end = self.builder.layout(I3)["lambda"], self.builder.layout(I3)["z"]
        for row in self.builder.forces:
            at = row[T.FORCE_DEPENDS]
            at += 1 + self.builder.extra_i[at]
            count = self.builder.extra_i[at]
            if any(first <= k < end for k in self.builder.extra_i[at + 1 : at + 1 + count]):
                return True
        return False

    def _inner(self, y: np.ndarray, loads: np.ndarray, idata: np.ndarray) -> np.ndarray:
        """Return F, N and z of y with the loads of the force records."""
        out = y[int(idata[T.H_F]) :].copy()
        table = idata[int(idata[T.H_I_FORCE]) : int(idata[T.H_I_FUNCTION])].reshape(-1, T.FORCE_COLUMNS)
        for f, row in enumerate(table):
            for column, part in ((T.FORCE_F, loads[f, 0:3]), (T.FORCE_N, loads[f, 3:6])):
                if row[column] >= 0:
                    at = int(row[column] - idata[T.H_F])
                    out[at : at + 3] = part
        return out

    def _massless(self, matrix: csc_array, base: int) -> bool:
        """True when some motion allowed by the constraints has no inertia."""
        if all(row[0] > 0 and np.linalg.eigvalsh(row[1:].reshape(3, 3))[0] > 0 for row in self.builder.bodies[1:]):
            return False
        return self._free_massless_body(matrix, base) is not None

    def _free_massless_body(self, matrix: csc_array, base: int) -> str | None:
        from scipy.linalg import null_space

        if base > DENSE_COORDINATES:
            return self._free_massless_body_of_many(matrix, base)
        constraint = matrix[base:, :base].toarray()
        free = null_space(constraint) if constraint.shape[0] else np.eye(base)
        mass = matrix[:base, :base].toarray()
        values, vectors = np.linalg.eigh(free.T @ mass @ free)
        if values.size and values[0] <= 1e-14 * max(values[-1], 1e-300):
            motion = np.abs(free @ vectors[:, 0])
            return self.body_names[int(np.argmax(motion)) // 6]
        return None

    def _free_massless_body_of_many(self, matrix: csc_array, base: int) -> str | None:
        """Look for a motion without inertia by inverse iteration, on masses raised by a trace that keeps it regular."""
        heaviest = abs(matrix[:base, :base]).max()
        raised = np.zeros(matrix.shape[0])
        raised[:base] = 1e-15 * heaviest
        try:
            factors = splu(csc_array(matrix + diags_array(raised)))
        except RuntimeError:
            return None
        motion = np.zeros(matrix.shape[0])
        motion[:base] = np.random.default_rng(0).standard_normal(base)
        answer = 1.0
        for _ in range(INVERSE_ITERATIONS):
            motion[base:] = 0.0
            motion /= np.linalg.norm(motion)
            motion = factors.solve(motion)
            answer = float(np.linalg.norm(motion[:base]))
        if not answer * heaviest >= 1e14:
            return None
        return self.body_names[int(np.argmax(np.abs(motion[:base]))) // 6]

    def _singular_message(self, matrix: csc_array, base: int) -> str:
        name = self._free_massless_body(matrix, base)
        if name is not None:
            return (
                f"body '{name}' can move without any inertia resisting it: check whether a massless part is "
                "under-constrained, give it mass and inertia, or fix it with a joint"
            )
        return "the equations of motion have no unique solution: check for bodies without inertia and locked joints"

    # --- the problem ------------------------------------------------------------------------------

    def problem(self, formulation: str = "SI2", rate_scale: float = 1.0) -> DAEProblem:
        """Return the DAE in one of the formulations ``I3``, ``SI2``, ``SI1`` with consistent initial values.

        ``rate_scale`` (1/s) is the ratio of the error allowed in velocities to that in positions.
        """
        if formulation not in FORMULATIONS:
            raise ModelError(f"formulation: {formulation!r} is unknown; choose one of {', '.join(FORMULATIONS)}")
        if self.report is None:
            self.initialise()
        form = FORMULATIONS[formulation]
        acc, lam, loads, y_small, *_ = self.accelerations(self.pose, self.t0)
        idata, rdata, size = self.builder.pack(form)
        indptr, indices, slots = jacobian.pattern(idata, rdata, size)
        idata, rdata, size = self.builder.pack(form, slots)
        n = int(idata[T.H_UNKNOWNS])
        y, yp = np.zeros(n), np.zeros(n)
        y[: int(idata[T.H_LAMBDA])] = y_small[: int(idata[T.H_LAMBDA])]
        z = slice(int(idata[T.H_Z]), int(idata[T.H_Z]) + self.state_start.size)
        y[int(idata[T.H_F]) : int(idata[T.H_MU])] = y_small[int(idata[T.H_F]) :]
        rows = slice(int(idata[T.H_LAMBDA]), int(idata[T.H_LAMBDA]) + len(lam))
        (yp if form == SI1 else y)[rows] = lam
        work = np.zeros(size)
        self._settle_states(y, yp, z, idata, rdata, work)
        self._rates(y, yp, acc, idata, rdata, work)
        at = self.builder.layout(form)
        kinds = np.array([kind == T.STATE_DIFFERENTIAL for kind, _ in self.builder.states], dtype=bool)
        scale = self._scales(form, loads)
        allowed = scale.copy()
        allowed[unknowns.velocities(at)] *= rate_scale
        return DAEProblem(
            n=n,
            residual=residual.residual,
            jacobian=jacobian.jacobian,
            indptr=indptr,
            indices=indices,
            idata=idata,
            rdata=rdata,
            work_size=size,
            y0=y,
            yp0=yp,
            error_mask=unknowns.error_mask(at, form, kinds),
            atol_scale=allowed,
            scale=scale,
            differential=unknowns.differential_mask(at, form, kinds),
            t0=self.t0,
            names=[unknown.name for unknown in self.unknowns(formulation)],
            hook=hook,
            hook_interval=self._hook_interval(at),
            restart_rates=_restart_rates,
        )

    def _hook_interval(self, at: dict[str, int]):
        """Time in which no Euler angle comes near its singularity, and no counted angle turns by half a turn."""
        rates = slice(at["eps"], at["v_f"])
        counted = any(term[T.TERM_TYPE] == ANGLE for term in self.builder.terms)
        counted = counted or any(tape.n_angles for tape in self.builder.tapes)

        def interval(y: np.ndarray) -> float:
            rate = np.abs(y[rates]).reshape(-1, 3)
            nearing = float(rate[:, 1].max(initial=0.0)) / 0.2
            # two bodies may turn against each other: at most 2 rad between them
            turning = float(rate.sum(axis=1).max(initial=0.0)) if counted else 0.0
            return 1.0 / max(nearing, turning, 1e-12)

        return interval

    def _settle_states(self, y, yp, z, idata, rdata, work) -> None:
        """Iterate algebraic states to their definitions; set the rates of the differential ones."""
        out = np.zeros(y.size)
        algebraic = np.array([kind == T.STATE_ALGEBRAIC for kind, _ in self.builder.states], dtype=bool)
        for _ in range(100 if algebraic.any() else 1):
            residual.residual(self.t0, y, yp, out, idata, rdata, work)
            correction = out[z] * algebraic
            y[z] -= correction
            if np.abs(correction).max(initial=0.0) <= 1e-12 * (1.0 + np.abs(y[z]).max(initial=0.0)):
                break
        yp[z] -= out[z] * ~algebraic

    def _rates(self, y, yp, acc, idata, rdata, work) -> None:
        """Fill y' from the accelerations; p' is what makes its own residual vanish."""
        out = np.zeros(y.size)
        u, p, e, r, th, lam = (int(idata[k]) for k in (T.H_U, T.H_P, T.H_EPS, T.H_R, T.H_THETA, T.H_LAMBDA))
        yp[u:p] = acc[:, :3].ravel()
        yp[r:th] = y[u:p]
        yp[th:lam] = y[e:r]
        residual.residual(self.t0, y, yp, out, idata, rdata, work)
        yp[p:e] -= out[p:e]
        tab = T.unpack(idata, rdata, work)
        kin = tab.kin
        for b in range(1, kin.shape[0]):
            k = int(tab.at[b, T.AT_EPS])
            rest = acc[b - 1, 3:] - y[k : k + 3] @ kin[b, KIN_ADOT : KIN_ADOT + 9].reshape(3, 3)
            euler_rates(kin, b, np.ascontiguousarray(rest), 0, yp, k)

    def _scales(self, form: int, loads: np.ndarray) -> np.ndarray:
        """Typical magnitudes by kind of unknown: metres, radians, their rates, momenta, forces."""
        bodies = np.array(self.builder.bodies[1:]).reshape(-1, T.BODY_COLUMNS)
        largest = float(np.abs(loads[:, :3]).max(initial=0.0))
        return unknowns.scales(self.builder.counts(), form, bodies, np.zeros((0, 2)), min(self.length, 1.0), largest)

    def unknowns(self, formulation: str = "SI2") -> list[Unknown]:
        """Return the table of the unknowns of eq. (9) in their order."""
        forces = [name for name, row in zip(self.force_names, self.builder.forces) if row[T.FORCE_F]]
        torques = [name for name, row in zip(self.force_names, self.builder.forces) if row[T.FORCE_N]]
        names = (self.body_names, self.row_names, forces, torques, self.state_names)
        return unknowns.named(self.builder.counts(), FORMULATIONS[formulation], *names)

    def unknowns_table(self, formulation: str = "SI2") -> str:
        """Return the table of the unknowns as text: index, name, meaning, equation, unit."""
        lines = [f"{'#':>4}  {'unknown':<48} {'eq.':<16} {'unit':<10} meaning"]
        for u in self.unknowns(formulation):
            lines.append(f"{u.index:>4}  {u.name:<48} {u.equation:<16} {u.unit:<10} {u.meaning}")
        return "\n".join(lines)
