"""What a case must satisfy to give a useful record, checked before it is simulated.

The record goes through an anti-alias filter and through band-passes about the mesh harmonics. Whether their bands fit
below half the sampling rate and whether the record is long enough follows from the settings alone.
"""

from __future__ import annotations

import math

import numpy as np

from gearmbs.gears.spec import COUNTED_TWICE
from gearmbs.signals.analysis.bands import ATTENUATION_DB, HALF_WIDTH, MIN_PERIODS, TRANSITION
from gearmbs.signals.filters import bandpass_taps
from gearmbs.studies.case.case import Case, CaseError
from gearmbs.studies.case.sections import AUTO, LONGEST

HARMONICS = 3
DEEPEST = 0.25
"""Static penetration of one tooth pair, in modules, beyond which teeth would have to pass through each other."""

LEAST_TURNS = 4.25
"""Revolutions that a record of changing speed must hold."""


def check_record(case: Case, source: str = "", *, bands: bool = False) -> None:
    """Refuse a case whose record could not be evaluated.

    Parameters
    ----------
    case : Case
    source : str
        Where it comes from, for messages; default its name.
    bands : bool
        Whether mesh harmonics are wanted by band-passes, too, and not by orders alone.

    Raises
    ------
    CaseError
        If the bands of the mesh harmonics do not fit below half the signal rate, if the record is too short for their
        lines, if it begins too early, or if the contact is too soft to carry the load.
    """
    source = source or f"case '{case.name}'"
    operation, gmf, rate = case.operation, case.mesh_frequency, case.signal_rate
    turns = f"operation.speed = {operation.top_speed:.6g} rad/s ({operation.top_speed * 30.0 / math.pi:.6g} rpm)"
    top = (HARMONICS + HALF_WIDTH + TRANSITION) * gmf
    if top >= 0.5 * rate:
        enough = (math.floor(2.0 * top / rate) + 1) * rate
        finer = case.changed(solver={"signal_rate": enough, "output_rate": None}).output_rate
        raise CaseError(
            f"{source}: solver.signal_rate = {rate:g} Hz: {turns} with {case.gears.teeth[0]} teeth puts "
            f"the band of mesh harmonic {HARMONICS} up to {top:.6g} Hz, above half that rate; give signal_rate = "
            f"{enough:g} and output_rate = {finer:g}, leave both out so that they follow the "
            "mesh frequency, or give a lower speed (a plain number is in rad/s; write '1000 rpm')"
        )
    if operation.speed_curve is None:
        _check_length(case, source, bands)
    else:
        _check_curve(case, source)
    ahead = case.edge
    if operation.run_up + operation.settling < ahead:
        raise CaseError(
            f"{source}: operation.settling = {operation.settling:g} s: run_up and settling are "
            f"{operation.run_up + operation.settling:g} s together, but the anti-alias filter at signal_rate = "
            f"{rate:g} Hz needs {ahead:.3g} s before the record; give a longer settling"
        )
    check_stiffness(case, source)


def _check_length(case: Case, source: str, bands: bool) -> None:
    """Refuse a record at constant speed that is too short for its mesh harmonics."""
    gmf = case.mesh_frequency
    need = least_for_bands(case) if bands else MIN_PERIODS / gmf + 1.0 / case.signal_rate
    if case.operation.longest < need:
        least, longest = math.ceil(1e4 * need) / 1e4, case.operation.longest
        what = "the band-pass about" if bands else "the transform at"
        given = f"'{AUTO}', at most {longest:g} s" if case.is_auto else f"{longest:g} s"
        enough = "" if bands or case.is_auto else _or_auto(need)
        rpm = case.operation.top_speed * 30.0 / math.pi * need / longest
        raise CaseError(
            f"{source}: operation.duration = {given}: {what} the mesh frequency of {gmf:.6g} Hz needs a record of at "
            f"least {least:g} s, that is {math.ceil(need * gmf)} mesh periods; give that duration{enough}, or a "
            f"speed of {math.ceil(10.0 * rpm) / 10.0:g} rpm or more (a plain number is in rad/s; write '1000 rpm')"
        )


def _or_auto(need: float) -> str:
    """Return the second remedy of a record that needs so many seconds, where it is one."""
    return f", or '{AUTO}'" if need <= LONGEST else ""


def band_taps(case: Case) -> list[np.ndarray]:
    """Return the band-pass filters about the mesh harmonics at the signal rate."""
    gmf = case.mesh_frequency
    bands = [((k - HALF_WIDTH) * gmf, (k + HALF_WIDTH) * gmf) for k in range(1, HARMONICS + 1)]
    return [bandpass_taps(case.signal_rate, low, high, TRANSITION * gmf, ATTENUATION_DB) for low, high in bands]


def least_for_bands(case: Case) -> float:
    """Return the length of a record from which its mesh harmonics are evaluated by band-passes too, s."""
    gmf, rate = case.mesh_frequency, case.signal_rate
    longest = max(taps.size for taps in band_taps(case))
    return max((longest + 1) / rate + 1.0 / gmf, MIN_PERIODS / gmf + 1.0 / rate)


def geometric_period(case: Case) -> int:
    """Return after how many mesh periods the same flanks meet as the faults of teeth tell them apart."""
    if not case.fault.teeth:
        return 1
    from gearmbs.gears.tables import tooth_deviations

    periods = []
    for wheel in tooth_deviations(case.pair()):
        teeth = wheel.gear.teeth
        parts = [np.moveaxis(part, 1, 0) for part in (wheel.offset, wheel.shape, wheel.tip, wheel.compliance)]
        steps = (step for step in range(1, teeth + 1) if teeth % step == 0)
        periods.append(next(s for s in steps if all(np.array_equal(part, np.roll(part, s, 0)) for part in parts)))
    return math.lcm(*periods)


def holds_period(case: Case) -> bool:
    """Return whether a record is as long, to a sample, as faulty teeth take to meet again."""
    return case.operation.longest + 1.0 / case.signal_rate >= geometric_period(case) / case.mesh_frequency


def _check_curve(case: Case, source: str) -> None:
    """Refuse a run-up in which the driver turns less than the window that its orders are tracked with."""
    turned = case.angle_turned / math.tau
    if turned < LEAST_TURNS:
        raise CaseError(
            f"{source}: operation.speed: the driver makes {turned:.3g} revolutions in the record of "
            f"{case.operation.longest:g} s, orders are tracked over {LEAST_TURNS:g} and more; give a longer curve or "
            "higher speeds"
        )


def check_stiffness(case: Case, source: str) -> None:
    """Refuse a contact in which the load would press the teeth through each other.

    Raises
    ------
    CaseError
        If one tooth pair needs a penetration above `DEEPEST` modules to carry the torque.
    """
    pair = case.pair()
    depth = pair.penetration()
    if depth > DEEPEST * case.gears.module:
        raise CaseError(
            f"{source}: contact.stiffness = {case.contact.stiffness!r}: at operation.torque = "
            f"{case.operation.top_torque:g} N m a tooth pair would be pressed in by {depth * 1e3:.4g} mm, a module is "
            f"{case.gears.module * 1e3:.4g} mm; give a stiffer contact (the paper's is '2.9852e5 N/mm^1.3') or less "
            "torque"
        )


def remarks(case: Case) -> list[str]:
    """Return what a user should know about a case that is possible but unusual."""
    found = []
    ratio = case.pair().contact_ratio
    if ratio < 1.0:
        found.append(
            f"contact ratio {ratio:.3g} is below 1: for part of each mesh period no flanks are in contact but a tip "
            "edge runs along the mate's flank"
        )
    for number, wheel in enumerate(case.pair().wheels, 1):
        shafts = case.shafts
        total = wheel.mass + shafts.density * math.pi * shafts.radius**2 * shafts.length
        twice = wheel.mass_within(shafts.radius, shafts.length)
        if twice > COUNTED_TWICE * total:
            found.append(
                f"{twice:.4g} kg of the {total:.4g} kg of gear {number} and its shaft are counted twice: "
                f"gears.bore_radius is {1e3 * wheel.bore_radius:g} mm, shafts.radius {1e3 * shafts.radius:g} mm; "
                "give a bore of the shaft's radius"
            )
    operation, solver = case.operation, case.solver
    if operation.speed_curve is None and operation.longest < least_for_bands(case):
        periods, least = operation.longest * case.mesh_frequency, least_for_bands(case)
        found.append(
            f"operation.duration = {operation.longest:g} s is {periods:.3g} mesh periods: mesh harmonics are told by "
            f"orders alone, their bands need {least:.3g} s"
        )
    if operation.speed_curve is None and not case.is_auto and not holds_period(case):
        period = geometric_period(case)
        need = period / case.mesh_frequency
        found.append(
            f"operation.duration = {operation.longest:g} s is shorter than the {period} mesh periods after which "
            "faulty teeth meet again: mesh harmonics depend on where the record begins; give "
            f"{need:.3g} s or more{_or_auto(need)}"
        )
    if solver.integrator == "IDA" and solver.used_tolerance > 2e-7:
        found.append(
            f"solver.tolerance = {solver.used_tolerance:g} with IDA: the paper's mesh harmonics are off by up to 12 % "
            "at 1e-6, 1 % at 1e-7"
        )
    return found
