"""Simulate a case and record what the paper recorded."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Collection, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, Never, Unpack

import numpy as np

from gearmbs._lazy import uncollected
from gearmbs.dae.methods import INTEGRATORS
from gearmbs.dae.result import Status
from gearmbs.dae.results.solution import Solution
from gearmbs.gears.contact_element import contact_kernels
from gearmbs.mechanism.solve.simulate import simulate
from gearmbs.studies.case.case import Case, CaseError
from gearmbs.studies.case.limits import check_record
from gearmbs.studies.case.sections import Operation, Solver
from gearmbs.studies.run import rig
from gearmbs.studies.run.accuracy import Recorded, accurate_record, part_of
from gearmbs.studies.run.periodic import Found, PeriodicRecorder, Precision, reach, signal_stop
from gearmbs.studies.run.record import (
    VARIABLES,
    PlainRecord,
    attributes_of,
    bearing_attributes,
    check_variables,
    evaluate,
    needs_series,
    time_series,
    title_of,
)
from gearmbs.studies.run.recorder import (
    WATCHED,
    Measured,
    Recorder,
    Separations,
    measure,
    rows_of_record,
    slip,
    span_of,
)
from gearmbs.studies.run.refined import Behind, keeping

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.bearings import Bearing
    from gearmbs.bearings.settings import BearingKeywords
    from gearmbs.drivetrain import Drivetrain
    from gearmbs.mechanism import Mechanism
    from gearmbs.mechanism.solve.keywords import RunOptions
    from gearmbs.units import QuantityLike

ADVICE = {
    Status.STEP_TOO_SMALL: "Loosen solver.tolerance, raise contact.depth, or try another solver.integrator.",
    Status.NEWTON_FAILURE: "Raise contact.depth, lower contact.stiffness, or try another solver.integrator.",
    Status.TOO_MANY_REJECTIONS: "Loosen solver.tolerance, raise contact.depth, or make operation.run_up longer.",
    Status.NOT_FINITE: "Lower operation.torque or operation.speed, or make operation.run_up longer.",
    Status.SOLVER_FAILURE: "Loosen solver.tolerance, make operation.run_up longer, or take the WSTIFF integrator.",
}
"""What the settings of a case offer against a failing integration."""


KERNELS = (
    "gearmbs.mechanism.parts.elements",
    "gearmbs.signals.resampling",
)
"""Modules of kernels that are called late in a run, besides those of the contact."""

LUMPED_KERNELS = ("gearmbs.dae.model.fixed_axes",)
"""The same of a run in which gear and shaft turn as one."""


class SimulationFailed(RuntimeError):
    """The integrator stopped early, or what it computed is no motion of meshing gears.

    Attributes
    ----------
    solution : Solution or None
        What was computed until then; None if the case ran in another process.
    case : Case or None
    """

    def __init__(
        self,
        message: str,
        solution: Solution | None = None,
        case: Case | None = None,
        partial: xr.Dataset | None = None,
    ) -> None:
        super().__init__(message)
        self.solution = solution
        self.case = case
        self._partial = partial

    def partial(self) -> xr.Dataset | None:
        """Return what was computed until then; see `partial_record`."""
        if self._partial is None and self.case is not None and self.solution is not None:
            self._partial = partial_record(self.case, self.solution)
        return self._partial

    def __reduce__(self) -> tuple:
        return type(self), (str(self), None, self.case, self.partial())


class SimulationInterrupted(SimulationFailed):
    """The run was interrupted by the user; what was computed until then is kept."""


def simulate_case(
    case: Case,
    progress: bool | Callable[[float], None] | None = None,
    *,
    mechanism: Mechanism | None = None,
    every_step: bool = False,
    **options: Unpack[RunOptions],
) -> Solution:
    """Integrate the mechanism of a case from rest to the end of its record.

    Parameters
    ----------
    case : Case
    progress : bool or callable, optional
        Show a bar, or ``progress(t)`` with the time reached, s.
    mechanism : Mechanism, optional
        Integrate this one; default `case_mechanism` with joints as bearings.
    every_step : bool
        Outputs at the integrator's own steps instead of the case's output rate.
    **options
        Handed to the integrator.

    Returns
    -------
    Solution
        Sampled at the case's output rate, or at the integrator's own steps, from which :func:`record` makes signals
        without aliases; see its ``status``.
    """
    load_kernels(case.solver.integrator, case.lump)
    mechanism = case_mechanism(case) if mechanism is None else mechanism
    operation, solver = case.operation, case.solver
    t_end = operation.run_up + operation.settling + operation.longest + case.edge
    # up to a whole sample
    t_end = math.ceil(t_end * case.output_rate - 1e-6) / case.output_rate
    return simulate(
        mechanism,
        t_end,
        rate=None if every_step else case.output_rate,
        every_step=every_step,
        integrator=solver.integrator,
        formulation=solver.formulation,
        tol=case.tolerance,
        rate_scale=operation.top_speed * case.gears.teeth[0],
        lump=case.lump,
        progress=progress,
        advice=ADVICE,
        **options,
    )


def case_mechanism(
    case: Case,
    bearing: Bearing | str | None = None,
    *,
    each: Mapping[str, dict[str, Any]] | None = None,
    **settings: Unpack[BearingKeywords],
) -> Mechanism:
    """Return the mechanism of a case.

    Parameters
    ----------
    case : Case
    bearing : Bearing or str, optional
        Rolling bearing of which two stand on each rigid shaft, see `rolling_rig`, or its designation; default: what the
        case's shafts say.
    each : mapping of str to dict, optional
        Settings of single bearings by name, which overrule those of all.
    **settings
        Of all four bearings, as of `gearmbs.bearings.RollingBearing`.

    Raises
    ------
    CaseError
        For a bearing beside shafts that say what they stand in, or bend.

    Examples
    --------
    >>> from gearmbs.studies import Case
    >>> sorted(case_mechanism(Case(), "6206/CN").elements)
    ['bearing 1 a', 'bearing 1 b', 'bearing 2 a', 'bearing 2 b', 'load', 'mesh']
    >>> spall = {"kind": "spall", "width": "1 mm", "angle": "250 deg"}
    >>> m = case_mechanism(Case(), "6206/CN", each={"bearing 1 a": {"defects": [spall]}})
    >>> len(m.elements["bearing 1 a"].defects), len(m.elements["bearing 1 b"].defects)
    (1, 0)
    """
    operation, shafts = case.operation, case.shafts
    if shafts.are_parts:
        if bearing is not None:
            raise CaseError(
                f"bearing is {bearing!r}, and case '{case.name}' has shafts that bend or stand in bearings of their "
                f"own; give case.changed(shafts={{'bearings': {bearing!r}}})"
            )
        from gearmbs.studies.case.train import mechanism_of_parts

        return mechanism_of_parts(case, {**settings}, each)
    rigged: dict[str, Any] = {
        "speed": operation.speed,
        "torque": operation.torque,
        "run_up": operation.run_up,
        "start": operation.run_up + operation.settling,
        "shaft_radius": shafts.radius,
        "shaft_length": shafts.length,
        "shaft_density": shafts.density,
    }
    if bearing is None:
        return rig.gear_rig(case.pair(), **rigged)
    from gearmbs.bearings import Bearing
    from gearmbs.studies.run.rig import rolling_rig

    one = Bearing.from_designation(bearing) if isinstance(bearing, str) else bearing
    return rolling_rig(case.pair(), one, settings={**settings}, each=each, **rigged)


def case_train(case: Case) -> Drivetrain:
    """Return a case as a drivetrain: for its modes, its Campbell diagram, its report, or to go on from it.

    Parameters
    ----------
    case : Case
        At a constant torque.

    Returns
    -------
    Drivetrain
        Named parts: shaft 1, shaft 2, gear 1, gear 2, mesh, drive, load, and the bearings: of rolling ones
        bearing 1 a, bearing 1 b, bearing 2 a, bearing 2 b.

    Raises
    ------
    CaseError
        For a torque that follows a curve, and for shafts whose bearings do not hold them.

    Examples
    --------
    >>> from gearmbs.studies import Case
    >>> train = case_train(Case(shafts={"modes": 4, "bearings": "6206"}))
    >>> [bearing.name for bearing in train.bearings]
    ['bearing 1 a', 'bearing 1 b', 'bearing 2 a', 'bearing 2 b']
    """
    if case.operation.torque_curve is not None:
        raise CaseError(
            f"case '{case.name}': operation.torque follows a curve, and a drivetrain takes one that begins with the "
            "simulation: give case.changed(operation={'torque': ...}) a single one; run_case follows curves"
        )
    from gearmbs.studies.case.train import parts_of

    return parts_of(case)


def run_case(
    case: Case,
    progress: bool | Callable[[float], None] | None = None,
    *,
    mechanism: Mechanism | None = None,
    variables: Collection[str] | None = None,
    accuracy: QuantityLike | None = None,
    **settings: Never,
) -> xr.Dataset:
    """Simulate a case and return its record: a pure function of the case.

    Parameters
    ----------
    case : Case
    progress : bool or callable, optional
        Show a bar, or ``progress(t)`` with the time reached, s.
    mechanism : Mechanism, optional
        Simulate this one, such as ``case_mechanism(case, "6206/CN")`` with rolling bearings; it has the case's wheels,
        seats and mesh by their names. Default: the case's own.
    variables : collection of str, optional
        Evaluate only these of the variables below, with the same values; default all.
    accuracy : float or str, optional
        How well the mesh harmonics are to be known, such as "1 %" or 0.01, as a part of the largest of their component.
        Tolerance, length of a record whose duration is "auto" and slices of the face are chosen for it, as far as the
        case does not give them, and the record tells its numerical error; see `gearmbs.studies.run.accuracy`.
    **settings
        None: what else there is to set, such as ``lump``, belongs to the case, and is refused here by its place there.

    Returns
    -------
    Dataset
        ``force_1``, ``force_2``: force of the shaft on each gear at its seat, N, over ``time`` at the output rate;
        ``acceleration``: force on the driven gear over its mass, decimated to the signal rate, by component;
        ``gmf_rms``: RMS of the first three mesh harmonics by component, by band-pass and by orders; of a run-up instead
        ``order_rms``, the same followed by order tracking over ``track_time`` and ``track_speed``, and ``speed`` and
        ``angle`` of the driver over ``signal_time``; transmission error, contact forces and penetrations; with an
        accuracy, ``gmf_rms_error`` or ``order_rms_error``; parameters,
        versions and solver statistics in the attributes, with ``bearings``, ``bearing_defects`` and ``bearings_json``
        where the mechanism has rolling bearings.

    Raises
    ------
    CaseError
        If the record could not be evaluated; see :func:`gearmbs.studies.case.limits.check_record`. Nothing is
        simulated.
    SimulationFailed
        If the integrator stops early or teeth slip past each other; the exception carries the solution so far.
    """
    misplaced: dict[str, Any] = {**settings}
    for name, value in misplaced.items():
        raise CaseError(_misplaced(name, value))
    if accuracy is None:
        return plain_record(case, progress, mechanism=mechanism, variables=variables).dataset()

    def run(case: Case, variables: Collection[str] | None, precision: Precision) -> Recorded:
        return _recorded(case, progress, mechanism, variables, precision)

    _check(case, variables)
    return accurate_record(run, case, accuracy, variables, mechanism)


def plain_record(
    case: Case,
    progress: bool | Callable[[float], None] | None = None,
    *,
    mechanism: Mechanism | None = None,
    variables: Collection[str] | None = None,
) -> PlainRecord:
    """Simulate a case and return its record as plain arrays, for who asks for numbers of it; see `run_case`.

    xarray is loaded for run-ups, and for the dataset when somebody asks for that.

    Examples
    --------
    >>> from gearmbs.studies import Case
    >>> record = plain_record(Case(operation={"duration": "auto"}, solver={"lump": True}), variables=["gmf_rms"])
    >>> record.values("gmf_rms").shape, record.values("way").tolist()
    ((2, 3, 4), ['band', 'orders'])
    """
    _check(case, variables)
    record = _recorded(case, progress, mechanism, variables, None).record
    assert isinstance(record, PlainRecord)
    return record


def _check(case: Case, variables: Collection[str] | None) -> None:
    """Refuse what is no case, or has no record, and names that are no variables of one."""
    if not isinstance(case, Case):
        raise CaseError(f"case: is a {type(case).__name__}; make a case of tables by make_case, of a file by load_case")
    check_record(case)
    check_variables(variables)


def _recorded(
    case: Case,
    progress: bool | Callable[[float], None] | None,
    mechanism: Mechanism | None,
    variables: Collection[str] | None,
    precision: Precision | None,
) -> Recorded:
    """Simulate a case that has been checked; with a ``precision`` what it takes to judge the record comes with it."""
    load_kernels(case.solver.integrator, case.lump)
    # what rolls in bearings does not come back with the teeth
    known_period = mechanism is None and case.shafts.bearings is None
    behind = None if precision is None else precision.behind
    start = {} if behind is None else behind.start(case.pair().face_slices)
    simulated = start.pop("mechanism", mechanism)
    if simulated is None:
        simulated = case_mechanism(case)
    if mechanism is None and case.shafts.are_parts:
        mechanism = simulated
    periodic = PeriodicRecorder(case, known_period, precision=precision) if case.is_auto else None
    recorder = Recorder(case) if periodic is None else periodic.recorder
    apart = Separations(case) if precision is not None and periodic is None else None

    def take_both(part: Solution) -> None:
        recorder.take(part)
        if apart is not None:
            apart.take(part)

    take = recorder.take if apart is None else take_both
    options: dict[str, Any] = {"every_step": True, "consumer": take, "watch": WATCHED, **start}
    if periodic is not None and INTEGRATORS[case.solver.integrator].can("pause"):
        options["pause"] = periodic.pause
    if precision is not None and not precision.is_twin:
        # teeth damp what a twin does otherwise in some mesh periods
        settled = case.operation.run_up + 0.5 * case.operation.settling if periodic is None else periodic.settled
        options |= keeping(case.solver.integrator, settled)
    solution = simulate_case(case, progress, mechanism=simulated, **options)
    if not solution.success:
        kind = SimulationInterrupted if solution.status is Status.INTERRUPTED else SimulationFailed
        known = _partial(case, solution, recorder, mechanism)
        raise kind(f"case '{case.name}': {solution.message}", solution, case, known)
    levels = None
    try:
        if periodic is None or periodic.found is None:
            measured, even = recorder.measured(), recorder.is_even
            plain = _evaluated(case, solution, measured, recorder.slipped, even=even, variables=variables)
            part = part_of(case) if even and precision is not None and not precision.is_twin else None
            if part is not None:
                levels = _levels_of_part(part, solution, measured)
        else:
            plain = evaluated_period(case, solution, periodic, variables)
            levels = periodic.levels(periodic.part) if precision is not None else None
    except SimulationFailed as failure:
        known = _partial(case, solution, recorder, mechanism)
        raise SimulationFailed(str(failure), solution, case, known) from None
    plain.told |= bearing_attributes(mechanism, title_of(case))
    if periodic is not None:
        plain.told |= periodic.attributes()
    if apart is not None:
        plain.told["record_apart"] = apart.share
    found = None if periodic is None else periodic.part if periodic.found else Found(0, 0)
    return Recorded(plain, found, levels, Behind(simulated, solution, case.pair().face_slices))


def _levels_of_part(part: Case, solution: Solution, known: Measured) -> np.ndarray:
    """Return the RMS of the mesh harmonics of the first part of what was measured, which is a record of ``part``."""
    end = int(np.searchsorted(known.t, span_of(part).stop + part.edge + 0.5 / part.output_rate))
    contact = {name: values[:end] for name, values in known.contact.items()}
    first = Measured(known.t[:end], known.forces[:end], known.error[:end], contact)
    return _evaluated(part, solution, first, None, even=True, variables={"gmf_rms"}).values("gmf_rms")


def _misplaced(name: str, value: Any) -> str:
    """Return what is said of a setting of a case that is given to a function instead."""
    for table, section in (("solver", Solver), ("operation", Operation)):
        if name in section.model_fields:
            given = f"{table}={{{name!r}: {value!r}}}"
            return f"{name}: is a setting of the case's {table}; give run_case(case.changed({given}))"
    return f"{name}: run_case takes a case, progress, mechanism and variables; settings belong to the case"


@cache
def load_kernels(integrator: str, lump: bool) -> None:
    """Import the kernels of a run before the first is called, so that all that are missing are compiled at once."""
    with uncollected():
        contact_kernels()
        for name in (*KERNELS, *(LUMPED_KERNELS if lump else ())):
            importlib.import_module(name)
        INTEGRATORS[integrator].load()


def _partial(case: Case, solution: Solution, recorder: Recorder, mechanism: Mechanism | None) -> xr.Dataset | None:
    if recorder.is_empty:
        return None
    dataset = _partial_dataset(case, solution, recorder.everything())
    dataset.attrs |= bearing_attributes(mechanism, dataset.attrs["title"])
    return dataset


def partial_record(case: Case, solution: Solution) -> xr.Dataset:
    """Return the quantities of a record that need no filter, from the start to where the solution ends.

    Returns
    -------
    Dataset
        As of :func:`run_case` without ``acceleration`` and ``gmf_rms``; status and message in the attributes.
    """
    return _partial_dataset(case, solution, measure(case, solution))


def _partial_dataset(case: Case, solution: Solution, known: Measured) -> xr.Dataset:
    forces = {"force_1": known.forces[:, :3], "force_2": known.forces[:, 3:6]}
    dataset = time_series(known.t, {**forces, "transmission_error": known.error, **known.contact})
    attributes = attributes_of(case, solution)
    dataset.attrs = {**attributes, "status": solution.status.name, "message": solution.message}
    return dataset


def record(case: Case, solution: Solution, mechanism: Mechanism | None = None) -> xr.Dataset:
    """Return the record of a simulated case; see :func:`run_case`.

    Forces at uneven times are brought to the output rate through an anti-alias filter, the other series interpolated.

    Parameters
    ----------
    case : Case
    solution : Solution
    mechanism : Mechanism, optional
        The one that was simulated, if it was not the case's own: the record then says on which rolling bearings it ran.

    Raises
    ------
    SimulationFailed
        If teeth slipped past each other.
    """
    known = measure(case, solution, rows_of_record(case, solution.t))
    slipped = slip(case.pair(), known.t, known.error)
    plain = _evaluated(case, solution, known, slipped, even=_is_even(solution.t, case.output_rate))
    plain.told |= bearing_attributes(mechanism, title_of(case))
    return plain.dataset()


def _evaluated(
    case: Case,
    solution: Solution,
    known: Measured,
    slipped: str | None,
    *,
    even: bool,
    variables: Collection[str] | None = None,
) -> PlainRecord:
    """Return the record of what was measured, at even times or not; see `record`."""
    _check_slip(case, solution, slipped)
    # signals load xarray and what xarray loads
    with uncollected():
        return PlainRecord(case, solution, *evaluate(case, known, even=even, variables=variables))


def evaluated_period(
    case: Case, solution: Solution, periodic: PeriodicRecorder, variables: Collection[str] | None
) -> PlainRecord:
    """Return the record of a motion that repeats itself; its acceleration lasts for some turns of the driver."""
    _check_slip(case, solution, periodic.recorder.slipped)
    span, wanted = periodic.span, VARIABLES if variables is None else variables
    levels = periodic.levels() if "gmf_rms" in wanted else None
    known = periodic.measured(reach(case, span)) if needs_series(wanted) else None
    with uncollected():
        parts = evaluate(
            case,
            known,
            even=False,
            variables=variables,
            span=span,
            signal_stop=signal_stop(case, span),
            levels=levels,
        )
    return PlainRecord(case, solution, *parts)


def _check_slip(case: Case, solution: Solution, slipped: str | None) -> None:
    if slipped is not None:
        raise SimulationFailed(f"case '{case.name}': {slipped}", solution, case)


def _is_even(t: np.ndarray, rate: float) -> bool:
    return bool(np.allclose(np.diff(t) * rate, 1.0, atol=1e-6))
