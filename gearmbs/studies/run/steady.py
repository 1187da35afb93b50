"""The steady motion of a case, a drivetrain or a mechanism: one period, found without waiting for it.

A case starts in the static equilibrium of its teeth at full speed, which leaves a few mesh periods until its motion is
near an orbit; see `gearmbs.dae.orbits` and docs/theory/orbits.md.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Unpack, overload

import numpy as np

from gearmbs.dae.continuation import AtValue
from gearmbs.dae.methods import INTEGRATORS, those_that
from gearmbs.dae.orbits import NoOrbit, attracting_orbit
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.results.solution import Solution
from gearmbs.drivetrain import Drivetrain, DrivetrainError, SpeedDrive
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.solve.orbits import TIGHTER, Posed, SteadyMotion, steady_motion
from gearmbs.studies.case.case import Case, CaseError
from gearmbs.studies.case.limits import check_record, geometric_period
from gearmbs.studies.run.periodic import Found, PeriodicRecorder
from gearmbs.studies.run.record import check_variables
from gearmbs.studies.run.simulation import case_mechanism, evaluated_period, load_kernels
from gearmbs.wording import any_of, warn

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.mechanism.solve.keywords import SteadyOptions
    from gearmbs.units import QuantityLike

FURTHEST = 0.5
"""Part of a pitch by which the driven wheel is turned at most to find where its teeth carry the load."""
LOOKS = 400
"""Places there at which the moment is looked at: ten within the tenth of a millimetre of a usual backlash."""
CLOSED = 1e-5
"""How nearly the motion of a case closes, as part of its size: forces of teeth, stiff as they are, follow relative
motions of that part of their own amplitude to 1e-4."""
AROUND = 2
"""Mesh periods ahead of a record that its interpolation and its seams need."""
LONG = 200
"""Mesh cycles of a period from which a search is told of: it integrates several, which takes a minute and more."""


@dataclass(frozen=True, eq=False, repr=False)
class SteadyCase(SteadyMotion):
    """The steady motion of a case.

    Attributes
    ----------
    record : Dataset
        As `run_case` returns it of a motion that repeats itself; with ``orbit_multiplier``, the size of the largest
        multiplier, in its attributes: by the matrix that closed the orbit, whose own is made for ``multipliers``.
    """

    record: xr.Dataset


@overload
def steady(
    what: Case, period: None = None, *, variables: Collection[str] | None = None, most: int = 200
) -> SteadyCase: ...


@overload
def steady(what: Mechanism, period: QuantityLike, **settings: Unpack[SteadyOptions]) -> SteadyMotion: ...


@overload
def steady(what: Drivetrain, period: QuantityLike | None = None, **settings: Unpack[SteadyOptions]) -> SteadyMotion: ...


def steady(what: Case | Mechanism | Drivetrain, period: QuantityLike | None = None, **settings: Any) -> SteadyMotion:
    """Find the motion that repeats itself after a period.

    Parameters
    ----------
    what : Case, Mechanism or Drivetrain
        A case at constant speed: its period is that of its mesh, with faulty teeth that of the faulty wheels. A
        drivetrain whose drives prescribe its speed: by default the time after which all its teeth stand as before.
    period : float or str, optional
        Of a mechanism, needed: s.
    **settings
        Of mechanisms and drivetrains: see `gearmbs.mechanism.solve.orbits.steady_motion`. Of a case: ``variables`` as
        of `run_case`, and ``most``, the mesh periods that may be integrated.

    Returns
    -------
    SteadyMotion
        Of a case with its ``record``.

    Raises
    ------
    NoOrbit
        If there is no such motion; it tells why. `run_case` integrates the motion that there is.

    Examples
    --------
    >>> motion = steady(Case(operation={"speed": "1000 rpm", "torque": "100 N m"}))
    >>> motion.stable, f"{1e3 * motion.period:.3f} ms"
    (True, '2.069 ms')
    >>> bool(motion.record["gmf_rms"].sel(component="line_of_action", way="orders")[0] > 0.0)
    True
    """
    if isinstance(what, Case):
        if period is not None:
            raise CaseError("steady: the period of a case follows from its wheels; leave period away")
        return steady_case(what, **settings)
    if isinstance(what, Drivetrain):
        return steady_train(what, period, **settings)
    if not isinstance(what, Mechanism):
        raise ModelError(f"steady: {what!r} is a {type(what).__name__}; give a Case, a Mechanism or a Drivetrain")
    if period is None:
        raise ModelError("steady: give the period of the mechanism, s; that of a mesh is 1 over its frequency")
    return steady_motion(what, period, **settings)


def steady_case(case: Case, *, variables: Collection[str] | None = None, most: int = 200) -> SteadyCase:
    """Find the steady motion of a case; see `steady`.

    Parameters
    ----------
    case : Case
        Its ``duration`` and ``formulation`` have no part in it: the bodies turn about fixed axes, and are integrated by
        their angles alone.
    variables : collection of str, optional
        Of the record, as of `run_case`.
    most : int
        Mesh periods that may be integrated beside those of the first orbit tried.

    Raises
    ------
    CaseError
        For a speed or torque that is no constant.
    NoOrbit
        See `steady`.
    """
    check_variables(variables)
    case, posed, at, tol = posed_case(case)
    meshes = geometric_period(case)
    settle = 2 if meshes == 1 else 0
    orbit = attracting_orbit(
        at.problem, at.period, at.advance, tol=tol, settle=settle, most=max(3, math.ceil(most / meshes)) + settle,
        closed=CLOSED, method=case.solver.integrator, continuous=meshes == 1,
    )  # fmt: skip
    solution = posed.solution(orbit)
    found = round(orbit.period * case.mesh_frequency)
    recorder = period_recorder(case, solution, found, orbit.error)
    plain = evaluated_period(case, solution, recorder, variables)
    plain.told |= recorder.attributes() | {"orbit_multiplier": orbit.decay}
    return SteadyCase(solution, orbit, posed.state(orbit), plain.dataset())


def posed_case(case: Case) -> tuple[Case, Posed, AtValue, float]:
    """Return a case at "auto", its equations as assembled and at speed, and the tolerance of its orbit."""
    operation = case.operation
    if operation.speed_curve is not None or not np.isscalar(operation.torque):
        raise CaseError("steady: speed and torque have to be constant; run_case follows curves")
    if case.shafts.are_parts:
        raise CaseError(
            "steady: of a case the bodies turn about fixed axes, and its shafts bend or stand in rolling bearings; "
            "give steady(case_train(case)), or take run_case with the duration 'auto'"
        )
    if not INTEGRATORS[case.solver.integrator].can("dense_output"):
        able = any_of(those_that("dense_output"))
        raise CaseError(f"steady: solver.integrator = {case.solver.integrator!r} has no stored steps; take {able}")
    case = case.changed(operation={"duration": "auto"})
    check_record(case)
    load_kernels(case.solver.integrator, True)
    tol = case.tolerance if case.solver.tolerance else TIGHTER * case.tolerance
    rate_scale = operation.top_speed * case.gears.teeth[0]
    posed = Posed.of(case_mechanism(case), 0.0, None, True, "SI2", rate_scale, tol)
    return case, posed, at_speed(case, posed.problem, geometric_period(case)), tol


def steady_train(
    train: Drivetrain, period: QuantityLike | None = None, **settings: Unpack[SteadyOptions]
) -> SteadyMotion:
    """Find the steady motion of a drivetrain; see `steady`.

    Parameters
    ----------
    train : Drivetrain
        Its drives prescribe constant speeds.
    period : float or str, optional
        s; default the time after which all meshes have made whole cycles; with faulty teeth, and planets that a carrier
        takes along or whose pins give way, all shafts and planets whole turns.
    **settings
        As of `gearmbs.mechanism.solve.orbits.steady_motion`; ``t_start`` is by default the end of the run-up.

    Raises
    ------
    DrivetrainError
        If no drive prescribes a constant speed: the period of what a motor drives is not known.
    ModelError
        Where elastic bearings let shafts turn about axes that move: it repeats itself after whole turns alone.

    Warns
    -----
    UserWarning
        Where planets come back after more than `LONG` mesh cycles alone, before they are integrated.
    """
    for drive in train.drives:
        if (
            not isinstance(drive, SpeedDrive)
            or drive.curve is not None
            or drive.function is not None
            or drive.reference
        ):
            raise DrivetrainError(
                f"{drive.label}: does not prescribe a constant speed: the motion has a period of its own; take a "
                'drive of kind "speed", or run_train'
            )
    if period is None:
        period = mesh_period(train)
        _warn_of_length(train, period)
    options: SteadyOptions = {"t_start": train.run_up, **settings}
    return steady_motion(train.build(), period, **options)


def _warn_of_length(train: Drivetrain, period: float) -> None:
    """Warn of a period in which planets come back after very many meshes, before it is integrated."""
    cycles = period * max(abs(train.kinematics.mesh_frequency(mesh.name)) for mesh in train.meshings)
    if train.planetary_stages and cycles > LONG:
        warn(
            f"steady: all teeth of drivetrain '{train.name}' stand as before after {cycles:.0f} mesh cycles, "
            f"{period:.4g} s, and the search takes several such periods; run_train records some turns of the carrier "
            "in less, or give the period after which your planets come back",
        )


def mesh_period(train: Drivetrain) -> float:
    """Return the time after which all meshes of a drivetrain have made whole cycles, s.

    With faults of single teeth it is that after which all shafts have made whole turns.
    """
    frequencies = [abs(train.kinematics.mesh_frequency(mesh.name)) for mesh in train.meshings]
    turning = [f for f in frequencies if f > 0.0]
    if not turning:
        raise DrivetrainError(f"drivetrain '{train.name}': no mesh turns; give the period")
    faulty = [mesh.settings.get("faults") for mesh in train.meshes]
    # planets whose pins turn, or give way, come back with the carrier; those on axes that stand with their teeth
    faulty += [
        stage.gears.faults or stage.on_pins is not None or stage.carrier != "ground" for stage in train.planetary_stages
    ]
    if any(faulty):
        return train.kinematics.common_period()
    shares = [Fraction(f / turning[0]).limit_denominator(10**7) for f in turning]
    return math.lcm(*(share.denominator for share in shares)) / turning[0]


def at_speed(case: Case, problem: DAEProblem, meshes: int) -> AtValue:
    """Return the equations with the driven wheel at speed and its teeth in equilibrium with the load.

    Angle and speed are counted from those of a driven wheel that follows without play and deflection.
    """
    pair, run_up = case.pair(), case.operation.run_up
    z2 = case.gears.teeth[1]
    speed = -pair.rotation * math.tau * case.mesh_frequency / z2
    # during the run-up, which rises evenly, the driver turns half as far as at speed; the orbit starts with the first
    # tooth at the same place, whatever the speed
    meshed = 0.5 * run_up * case.mesh_frequency
    start = run_up + (math.ceil(meshed / meshes) * meshes - meshed) / case.mesh_frequency
    omega, phi = (
        problem.names.index(next(n for n in problem.names if n.startswith(head))) for head in ("omega", "phi")
    )
    y, rates, out, work = problem.y0.copy(), np.zeros(problem.n), np.zeros(problem.n), np.zeros(problem.work_size)
    y[omega] = speed

    def moment(angle: float) -> float:
        y[phi] = angle
        problem.residual(start, y, rates, out, problem.idata, problem.rdata, work)
        return float(out[omega])

    middle = speed * (start - 0.5 * run_up)
    y[phi] = middle + _balanced(lambda angle: moment(middle + angle), FURTHEST * math.tau / z2)
    rates[phi] = speed
    advance, origin = np.zeros(problem.n), np.zeros(problem.n)
    advance[phi] = math.copysign(math.tau * meshes / z2, speed)
    origin[omega], origin[phi] = speed, middle
    posed = replace(problem, t0=start, y0=y, yp0=rates)
    return AtValue(posed, meshes / case.mesh_frequency, advance, origin)


def _balanced(moment: Any, most: float) -> float:
    """Return the nearest angle to zero, up to ``most``, at which a moment vanishes."""
    from scipy.optimize import brentq

    angles = np.linspace(0.0, most, LOOKS // 2 + 1)
    last = {1.0: moment(0.0), -1.0: moment(0.0)}
    if last[1.0] == 0.0:
        return 0.0
    for before, angle in pairwise(angles):
        for side in last:
            value = moment(side * angle)
            if value * last[side] <= 0.0:
                return float(brentq(moment, side * before, side * angle))
            last[side] = value
    raise NoOrbit("the teeth do not carry the load at any angle within half a pitch; run_case tells what happens")


def period_recorder(case: Case, solution: Solution, meshes: int, error: float) -> PeriodicRecorder:
    """Return what the record of a period is made from: what lies ahead of it and behind it are repetitions."""
    # it begins and ends between steps: times of copies of one step differ in their last digits
    recorder = PeriodicRecorder(case, begin=float(solution.t[:2].mean()))
    t, length = solution.t, meshes / case.mesh_frequency
    # teeth stand as before after whole periods alone
    ahead = t >= t[-1] - AROUND * length / meshes if meshes > AROUND else t >= t[0]
    behind = t <= t[0] + length / meshes
    ahead[-1] = False
    recorder.repeat(solution, [(ahead, 0.0), (np.arange(t.size - 1), length), (behind, 2.0 * length)])
    recorder.found, recorder.deviation = Found(meshes, meshes), error
    return recorder
