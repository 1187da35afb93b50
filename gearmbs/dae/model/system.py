"""A mechanism as a DAE: its model, names, a start that is made consistent, and the problem an integrator solves.

The functions find consistent initial values: accelerations, multipliers, loads, states and rates.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
import scipy

from gearmbs.dae.equations import elements, jacobian, residual, unknowns
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.body import turning_rates
from gearmbs.dae.equations.constraints.terms import ANGLE
from gearmbs.dae.equations.kinematics import AXES, hook
from gearmbs.dae.equations.loads.reactions import reactions_from
from gearmbs.dae.equations.unknowns import FORMULATIONS, I3, Unknown, multipliers_stand_as_rates
from gearmbs.dae.model import diagnosis, initial
from gearmbs.dae.model.base_system import BaseSystem
from gearmbs.dae.model.diagnosis import conflict
from gearmbs.dae.model.model import Configuration
from gearmbs.dae.problem import AssemblyError, Counted, DAEProblem, ModelError, SingularModelError

if TYPE_CHECKING:
    from gearmbs.dae.model.evaluator import Assembled
    from gearmbs.dae.model.model import Model

MAX_LOAD_ITERATIONS = 200
"""Passes in which loads that depend on each other may come to agree at the start; friction converges like a power of
the friction coefficient."""
REMEMBERED = 12
"""Earlier passes that are looked at where they do not come closer."""
CLOSER = 0.9
"""Ratio of the changes of two passes below which plain passes go on, a digit in at most 22; slower ones are
extrapolated."""
MAX_STATE_ITERATIONS = 100


def accelerations(
    system: BaseSystem, configuration: Configuration, t: float
) -> tuple[np.ndarray, np.ndarray, Assembled]:
    """Return the accelerations of the coordinates, lambda, and the system they solve with its loads in y.

    Loads that depend on other loads or on reactions are iterated until they agree.

    Raises
    ------
    SingularModelError
        If a body can move without inertia.
    ModelError
        If a load or a function of time has no finite value.
    """
    base = configuration.coordinates
    inner = _algebraic_start(system, configuration, t)
    passes: list[tuple[np.ndarray, np.ndarray]] = []
    for attempt in range(MAX_LOAD_ITERATIONS if _coupled(system.model) else 1):
        found = system.assembler.at(configuration, t, inner, system.state_start)
        diagnosis.check_finite(system, found.rhs, found.loads, t)
        solution = found.matrix.solved(found.rhs)
        if not np.all(np.isfinite(solution)) or (attempt == 0 and diagnosis.is_massless(system.model, found.matrix)):
            raise SingularModelError(diagnosis.singular_message(system.model, found.matrix))
        y, idata = found.y, found.idata
        last, inner = inner, _inner(y, found.loads, idata)
        y[int(idata[T.H_F]) :] = inner
        if (T.forces_in(idata)[:, T.FORCE_KIND] == T.REACTION).any():
            # reactions read the markers' axes and arms, which this array has not seen yet
            residual.update(t, y, y, idata, found.rdata, found.work)
            reactions_from(solution[base:].copy(), y, idata, found.rdata, found.work)
        inner = y[int(idata[T.H_F]) :].copy()
        if last is not None:
            if np.abs(inner - last).max() <= 1e-13 * (1e-3 + np.abs(inner).max()):
                break
            passes = [*passes[-REMEMBERED:], (last, inner)]
            inner = _extrapolated(passes)
    return solution[:base], solution[base:], found


def _extrapolated(passes: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Return the loads to go on with: as found, while passes come closer, else where a straight line has them agree.

    Loads that depend on accelerations do so linearly, and may answer with more than they were given: passes then
    diverge, but this (Anderson's mixing) finds the answer in as many as there are such loads.
    """
    off = np.array([after - before for before, after in passes])
    if len(passes) < 3 or np.abs(off[-1]).max() < CLOSER * np.abs(off[-2]).max():
        return passes[-1][1]
    steps = np.diff(np.array([after for _, after in passes]), axis=0)
    weights = np.linalg.lstsq(np.diff(off, axis=0).T, off[-1], rcond=1e-12)[0]
    return passes[-1][1] - weights @ steps


def _algebraic_start(system: BaseSystem, configuration: Configuration, t: float) -> np.ndarray | None:
    """Return F, N and z at a configuration whose algebraic states satisfy their equations, None without such states.

    Newton's method from the given start; the loads follow the states, reactions are left out.
    """
    model, algebraic = system.model, np.flatnonzero(~system.model.differential_states)
    if algebraic.size == 0:
        return None
    found = system.assembler.at(configuration, t, None, system.state_start)
    y, first, z = found.y, int(found.idata[T.H_F]), int(found.idata[T.H_Z])
    y[first:] = _inner(y, found.loads, found.idata)
    indptr, indices, slots = jacobian.pattern(found.idata, found.rdata, found.work.size, t, y)
    idata, rdata, size = model.pack(I3, slots, found.codes)
    out, rest, vals, work = np.zeros(y.size), np.zeros(y.size), np.zeros(indices.size), np.zeros(size)
    places = np.concatenate([np.arange(first, z), z + algebraic])
    for _ in range(MAX_STATE_ITERATIONS):
        residual.residual(t, y, rest, out, idata, rdata, work)
        diagnosis.check_states(system, out[z:], t)
        jacobian.jacobian(t, y, rest, 0.0, vals, idata, rdata, work)
        matrix = scipy.sparse.csc_array((vals, indices, indptr), shape=(y.size, y.size))
        try:
            step = scipy.sparse.linalg.splu(scipy.sparse.csc_array(matrix[places][:, places])).solve(out[places])
        except RuntimeError:
            break
        if not np.all(np.isfinite(step)):
            break
        y[places] -= step
        if np.abs(step).max() <= 1e-12 * (1.0 + np.abs(y[places]).max()):
            return y[first:].copy()
    names = ", ".join(system.state_names[k] for k in algebraic)
    raise ModelError(
        f"algebraic states {names}: no values were found at t = {t:.6g} s that satisfy their equations; start them "
        "nearer to their values"
    )


def _coupled(model: Model) -> bool:
    """Whether some load depends on unknowns other than positions, velocities and states."""
    at = model.layouts[I3]
    for row in model.forces:
        first = row[T.FORCE_DEPENDS]
        first += 1 + model.extra_i[first]
        count = model.extra_i[first]
        if any(at["lambda"] <= k < at["z"] for k in model.extra_i[first + 1 : first + 1 + count]):
            return True
    return False


def _inner(y: np.ndarray, loads: np.ndarray, idata: np.ndarray) -> np.ndarray:
    """Return F, N and z of y with the loads of the force records."""
    out = y[int(idata[T.H_F]) :].copy()
    table = idata[int(idata[T.H_I_FORCE]) : int(idata[T.H_I_FUNCTION])].reshape(-1, T.FORCE_COLUMNS)
    for f, row in enumerate(table):
        for column, part in ((T.FORCE_F, loads[f, 0:3]), (T.FORCE_N, loads[f, 3:6])):
            if row[column] >= 0:
                at = int(row[column] - idata[T.H_F])
                out[at : at + 3] = part
    return out


RESIDUALS_AN_ENTRY = 0.6
"""Residuals in whose time a Jacobian with modal bodies is evaluated, for each entry of a column: 11 to 16 measured."""

# --- the problem --------------------------------------------------------------------------------------


def make_problem(system: BaseSystem, formulation: str, rate_scale: float) -> DAEProblem:
    """Return the DAE of a system in one of the formulations with consistent initial values.

    See :meth:`gearmbs.dae.model.system.System.problem`.
    """
    model, form = system.model, FORMULATIONS[formulation]
    acc, lam, found = accelerations(system, system.configuration, system.t0)
    codes = found.codes
    idata, rdata, size = model.pack(form, codes=codes)
    at = model.layouts[form]
    y, yp = np.zeros(at["n"]), np.zeros(at["n"])
    first = int(found.idata[T.H_F])
    y[: at["lambda"]] = found.y[: at["lambda"]]
    y[at["F"] : at["mu"]] = found.y[first:]
    (yp if multipliers_stand_as_rates(form) else y)[at["lambda"] : at["lambda"] + len(lam)] = lam
    indptr, indices, slots = jacobian.pattern(idata, rdata, size, system.t0, y)
    idata, rdata, size = model.pack(form, slots, codes)
    work = np.zeros(size)
    differential = model.differential_states
    _state_rates(system, y, yp, slice(at["z"], at["mu"]), idata, rdata, work, (indptr, indices))
    _rates(y, yp, acc, system.t0, idata, rdata, work)
    largest = float(np.abs(found.loads[:, :3]).max(initial=0.0))
    scale = unknowns.scales(model.counts, form, model.bodies[1:], model.modal_sizes, min(system.length, 1.0), largest)
    allowed = scale.copy()
    allowed[unknowns.velocities(at)] *= rate_scale
    flexible = sum(model.modes) > 0
    index_one = np.zeros(at["n"], dtype=bool)
    index_one[at["z"] : at["mu"]] = ~differential
    return DAEProblem(
        n=at["n"],
        residual=residual.residual,
        jacobian=jacobian.jacobian,
        indptr=indptr,
        indices=indices,
        idata=idata,
        rdata=rdata,
        work_size=size,
        y0=y,
        yp0=yp,
        error_mask=unknowns.error_mask(at, form, model.controlled_states),
        atol_scale=allowed,
        scale=scale,
        differential=unknowns.differential_mask(at, form, differential),
        continuous=unknowns.given_by_momenta(at, form),
        t0=system.t0,
        index_one=index_one if index_one.any() else None,
        constant_slopes=not multipliers_stand_as_rates(form),
        alone=elements.alone(idata),
        names=[unknown.name for unknown in model.unknowns(formulation)],
        hook=hook,
        hook_interval=_hook_interval(model, at),
        restart_rates=restart_rates,
        own_start=own_start,
        jacobian_residuals=round(RESIDUALS_AN_ENTRY * len(indices) / at["n"]) if flexible else 0,
        small_entries=flexible,
        couplings=unknowns.between_modes(at, indptr, indices) if flexible else None,
        modes=unknowns.places_of_modes(at, model.modes) if flexible else None,
        finite_rates=model.has_finite_forces,
        solved_at_outputs=unknowns.plain_states(at, model.controlled_states),
        solved_if_needed=unknowns.loads(at),
        numbers=model.numbers_in(idata),
        aliases=model.aliases,
        counted=counted_angles(system, idata),
    )


def counted_angles(system: BaseSystem, idata: np.ndarray) -> Counted | None:
    """Return the angles that the equations of a system count, and their places in its table of numbers, if any."""
    model, extra, winding = system.model, int(idata[T.H_R_EXTRA]), int(idata[T.H_R_REFERENCE]) + len(system.model.terms)
    found = []
    for k, term in enumerate(model.terms):
        if term[T.TERM_TYPE] == ANGLE:
            at = winding + 1 + k
            found.append((AXES[2], int(term[T.TERM_I]), int(term[T.TERM_J]), at, at + len(model.terms)))
    for tape, row in zip(model.tapes, model.tape_rows, strict=True):
        first = extra + int(row[T.TAPE_REFERENCE]) + tape.n_angles
        found += [(*key, first + k, first + tape.n_angles + k) for k, key in enumerate(tape.angles)]
    found += [(AXES[axis], i, j, extra + at + 1, extra + at + 2) for axis, i, j, at in model.angles.tolist()]
    if not found:
        return None
    bodies = () if system.mechanism is None else (system.mechanism.ground, *system.mechanism.bodies.values())
    markers = [(system.marker_index.get(id(marker), -1), marker.name) for body in bodies for marker in body.markers]
    often = Counter(name for _, name in markers)
    # a name that two markers have says nothing
    names = {-1: ""} | {index: name for index, name in markers if index >= 0 and often[name] == 1}
    angles = [(function, names.get(i, f"marker {i}"), names.get(j, f"marker {j}")) for function, i, j, *_ in found]
    places = [winding, *(at for *_, at, _ in found), *(at for *_, at in found)]
    return Counted(angles, np.array(places, dtype=np.int64))


def _hook_interval(model: Model, at: dict[str, int]):
    """Time in which no Euler angle comes near its singularity, and no counted angle turns by half a turn."""
    rates = slice(at["eps"], at["v_f"])
    counted = bool(np.any(model.terms[:, T.TERM_TYPE] == ANGLE)) or any(tape.n_angles for tape in model.tapes)
    counted = counted or len(model.angles) > 0

    def interval(t: float, y: np.ndarray, yp: np.ndarray) -> float:
        rate = np.abs(y[rates]).reshape(-1, 3)
        nearing = float(rate[:, 1].max(initial=0.0)) / 0.2
        turning = 0.0
        if counted:
            bent = np.abs(yp[rates]).reshape(-1, 3)
            turning = turns_of_one(rate.sum(axis=1), bent.sum(axis=1))
        return 1.0 / max(nearing, turning, 1e-12)

    return interval


def turns_of_one(rates: np.ndarray, accelerations: np.ndarray) -> float:
    """Return how often a second (1/s) some angle may change by 1 rad, from its rate and its acceleration.

    Two bodies that turn against each other turn by at most 2 rad then. The acceleration counts where a body comes to
    rest and turns back.
    """
    return float((np.abs(rates) + np.sqrt(0.5 * np.abs(accelerations))).max(initial=0.0))


def _state_rates(
    system: BaseSystem, y, yp, z: slice, idata, rdata, work, pattern: tuple[np.ndarray, np.ndarray]
) -> None:
    """Settle algebraic states to their definitions, which reactions may enter; set the rates of the others.

    Implicit ones, which stand in their own definitions, are found by Newton's method. ``pattern`` is indptr and indices
    of the Jacobian.
    """
    out = np.zeros(y.size)
    differential, controlled = system.model.differential_states, system.model.controlled_states
    implicit = z.start + np.flatnonzero(controlled & ~differential)
    for _ in range(MAX_STATE_ITERATIONS if not differential.all() else 1):
        residual.residual(system.t0, y, yp, out, idata, rdata, work)
        diagnosis.check_states(system, out[z], system.t0)
        correction = out[z] * ~differential
        if np.abs(correction).max(initial=0.0) <= 1e-12 * (1.0 + np.abs(y[z]).max(initial=0.0)):
            break
        if implicit.size:
            indptr, indices = pattern
            vals = np.zeros(indices.size)
            jacobian.jacobian(system.t0, y, yp, 0.0, vals, idata, rdata, work)
            matrix = scipy.sparse.csc_array((vals, indices, indptr), shape=(y.size, y.size))
            block = matrix[implicit][:, implicit].toarray()
            # a singular one leaves them to the check of the start
            correction[implicit - z.start] = np.linalg.lstsq(block, out[implicit], rcond=None)[0]
        y[z] -= correction
    yp[z] -= out[z] * differential


def _rates(y, yp, acc: np.ndarray, t: float, idata, rdata, work) -> None:
    """Fill y' from the accelerations; p' and p_f' are what makes their own residuals vanish."""
    kin, bodies = T.kinematics_in(idata, work), int(idata[T.H_BODIES])
    places = T.rows_in(idata, int(idata[T.H_I_AT]), bodies, T.AT_COLUMNS)[1:].tolist()
    for at in places:
        u, v, v_f, modal, modes = (at[k] for k in (T.AT_U, T.AT_V, T.AT_VF, T.AT_V_MODES, T.AT_MODES))
        yp[u : u + 3] = acc[v : v + 3]
        yp[v_f : v_f + modes] = acc[modal : modal + modes]
    u, p, r, th = (int(idata[k]) for k in (T.H_U, T.H_P, T.H_R, T.H_THETA))
    yp[r:th] = y[u:p]
    _momentum_rates(t, y, yp, idata, rdata, work)
    turning_rates(places, acc, y, yp, kin)


def _momentum_rates(t: float, y, yp, idata, rdata, work) -> None:
    """Set theta' and q_f' to their velocities, p' and p_f' to what makes their own residuals vanish."""
    e, r, th, p, lam = (int(idata[k]) for k in (T.H_EPS, T.H_R, T.H_THETA, T.H_P, T.H_LAMBDA))
    out = np.zeros(y.size)
    yp[th:lam] = y[e:r]
    residual.residual(t, y, yp, out, idata, rdata, work)
    yp[p:e] -= out[p:e]


def restart_rates(t, y, yp, idata, rdata) -> np.ndarray:
    """Return y' after a change of an Euler reference, which leaves the rates of all but angles and momenta alone."""
    yp = yp.copy()
    _momentum_rates(t, y, yp, idata, rdata, np.zeros(int(idata[T.H_WORK])))
    return yp


def own_start(t, y, yp, idata, rdata) -> tuple[np.ndarray, np.ndarray]:
    """Return y and y' of a model with other inertias: velocities are what bodies have, momenta follow, p = L_eps^T."""
    y, yp = y.copy(), yp.copy()
    p, e, r = (int(idata[k]) for k in (T.H_P, T.H_EPS, T.H_R))
    out, work = np.zeros(y.size), np.zeros(int(idata[T.H_WORK]))
    residual.residual(t, y, yp, out, idata, rdata, work)
    y[p:e] -= out[e:r]
    residual.residual(t, y, yp, out, idata, rdata, work)
    yp[p:e] -= out[p:e]
    return y, yp


def settle_states(function, t, y, yp, idata, rdata) -> np.ndarray:
    """Return y with algebraic states z = f(...) of other numbers in the residual ``function``; all else stays."""
    y = y.copy()
    first, count = int(idata[T.H_Z]), int(idata[T.H_STATES])
    if not count:
        return y
    out, work = np.zeros(y.size), np.zeros(int(idata[T.H_WORK]))
    places = first + np.flatnonzero(T.states_in(idata)[:, T.STATE_KIND] == T.STATE_ALGEBRAIC)
    # one may stand in the expression of another
    for _ in places:
        function(t, y, yp, out, idata, rdata, work)
        y[places] -= out[places]
    return y


class System(BaseSystem):
    """A mechanism as a DAE.

    Built by :meth:`gearmbs.mechanism.Mechanism.compile`; users rarely make one themselves. For its parameters see
    `gearmbs.dae.model.base_system.BaseSystem`; the configuration is a guess that :meth:`initialise` makes consistent.

    Attributes
    ----------
    report : InitialReport or None
        What :meth:`initialise` found; None before.
    """

    report: initial.InitialReport | None = None

    # --- names --------------------------------------------------------------------------------------

    def unknowns(self, formulation: str = "SI2") -> list[Unknown]:
        """Return the table of the unknowns of eq. (9) in their order."""
        return self.model.unknowns(formulation)

    def unknowns_table(self, formulation: str = "SI2") -> str:
        """Return the table of the unknowns as text: index, name, meaning, equation, unit."""
        lines = [f"{'#':>4}  {'unknown':<48} {'eq.':<16} {'unit':<10} meaning"]
        for u in self.unknowns(formulation):
            lines.append(f"{u.index:>4}  {u.name:<48} {u.equation:<16} {u.unit:<10} {u.meaning}")
        return "\n".join(lines)

    # --- the start ----------------------------------------------------------------------------------

    def accelerations(self, configuration: Configuration | np.ndarray, t: float):
        """Return (a, alpha) a row per body, lambda, and the load records at a configuration; see `accelerations`."""
        configuration = self._configuration(configuration)
        acc, multipliers, found = accelerations(self, configuration, t)
        return configuration.parts(acc)[0], multipliers, found.loads

    def initialise(self) -> initial.InitialReport:
        """Make positions and velocities consistent; drop redundant constraint rows.

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
        configuration, kept, self.report = initial.assemble_position(self, self.configuration, self.t0)
        self.keep_rows(kept)
        self.configuration = initial.consistent_velocity(self, configuration, self.t0)
        found = self.conflict(self.configuration, self.t0)
        if found is not None:
            raise AssemblyError(found)
        return self.report

    # --- redundant rows, locking --------------------------------------------------------------------

    def conflict(self, configuration: Configuration | np.ndarray, t: float) -> str | None:
        """Return which row dropped as redundant contradicts the motion at a configuration, or None."""
        return conflict(self, self._configuration(configuration), t) if self.has_dropped_rows else None

    def locking(self, configuration: Configuration | np.ndarray, t: float) -> str | None:
        """Return which constraint rows are about to depend on each other, None when they are not."""
        return diagnosis.locking(self, self._configuration(configuration), t)

    # --- the problem --------------------------------------------------------------------------------

    def problem(self, formulation: str = "SI2", rate_scale: float = 1.0) -> DAEProblem:
        """Return the DAE in one of the formulations ``I3``, ``SI2``, ``SI1`` with consistent initial values.

        ``rate_scale`` (1/s) is the ratio of the error allowed in velocities to that in positions.
        """
        if formulation not in FORMULATIONS:
            raise ModelError(f"formulation: {formulation!r} is unknown; choose one of {', '.join(FORMULATIONS)}")
        if self.report is None:
            self.initialise()
        return make_problem(self, formulation, rate_scale)
