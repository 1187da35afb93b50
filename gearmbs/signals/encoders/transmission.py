"""Transmission error of two shafts from the pulses of their encoders."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from gearmbs.progress import waiting
from gearmbs.signals.encoders.estimate import Found, Row, estimate
from gearmbs.signals.encoders.lengths import ACCURACY
from gearmbs.signals.encoders.levels import Levels
from gearmbs.signals.encoders.marks import encoder_marks, share_found
from gearmbs.signals.encoders.meetings import averaged, lines_by_meetings
from gearmbs.signals.encoders.orders import (
    FEWEST_TURNS,
    MOST_SCATTER,
    Course,
    Gearing,
    Line,
    Window,
    bridged,
    common_angle,
    deviations,
    smooth_angle,
)
from gearmbs.signals.encoders.plausible import doubted_numbers, repeating_marks, stray_lines
from gearmbs.signals.encoders.pulses import TURN, PulseTrain
from gearmbs.signals.encoders.result import MeasuredTransmissionError, OrderLine
from gearmbs.signals.encoders.turned import check_turned, level_beyond
from gearmbs.signals.encoders.visible import (
    MOST_HARMONICS,
    Order,
    folded_onto,
    hidden_harmonics,
    shadow,
    standing_harmonics,
    visible_orders,
)
from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.rotation.phase import MOST_MISSING
from gearmbs.signals.signal.signal import check_teeth
from gearmbs.units import Quantity, to_si

SLIPPED = 0.05
"""Pitches by which wheels and discs of two runs may stand otherwise than told: 1/20 is 18 degrees of the mesh."""
LARGEST_RADIUS = 10.0
"""m: girth gears of mills are about as large; a radius in mm without its unit is beyond."""
LARGEST_TERM = 2000
"""Largest denominator that a ratio given as a decimal number is taken for."""


@dataclass(frozen=True, eq=False)
class CoupledRun:
    """A run of both shafts in mesh.

    Attributes
    ----------
    driver, driven : PulseTrain
        Of one clock.
    load : str
        Which load; runs of one load have one transmission error.
    shift : (float or str, float or str)
        Angles, rad, by which the discs of driver and driven have been turned on their shafts in the sense of rotation
        since the first run. Of one disc this need only be known to a quarter of a tooth: the pulses tell the rest.
    """

    driver: PulseTrain
    driven: PulseTrain
    load: str = "load"
    shift: tuple[Quantity, Quantity] = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class _Measured:
    """Lines of one run by order, in rad of the first shaft, the place of the second disc, turns that scatter is of."""

    run: CoupledRun
    values: dict[Fraction, Line]
    mesh: list[Fraction]
    ratio: float
    place: float
    scattered: int
    doubt: str | None
    window: Window
    stray: list[tuple[float, float]]

    @cached_property
    def wander(self) -> float:
        """RMS of the lag in the mesh, rad of the second shaft at most."""
        return math.sqrt(0.5 * sum(abs(self.values[o].value) ** 2 for o in self.mesh)) / self.ratio


@waiting("transmission error")
def transmission_error_from_pulses(
    runs: CoupledRun | Sequence[CoupledRun],
    teeth: Sequence[int] | None = None,
    *,
    base_radius: Quantity,
    ratio: Fraction | float | None = None,
    mesh_order: Fraction | float | None = None,
    free: Mapping[str, PulseTrain | Sequence[PulseTrain]] | None = None,
    mark_error: float | Sequence[float] | None = None,
    probability: float = 0.95,
    harmonics: int | None = None,
    accuracy: float = ACCURACY,
) -> MeasuredTransmissionError:
    """Transmission error of two shafts, its mesh and shaft orders, with the interval that the marks leave.

    Mesh orders are whole orders of both shafts, as are errors of the marks, so that one run cannot tell them apart.
    Runs that differ can: a shaft that turns free, and a disc that has been turned on its shaft. What they leave is the
    interval; without any it is the level of the marks.

    Parameters
    ----------
    runs : CoupledRun or sequence of CoupledRun
        Records of both shafts. Of several, mark 0 of both discs must be known (`pulse_train`).
    teeth : (int, int), optional
        Of driver and driven.
    base_radius : float or str
        Of the driver, m: the error is a length on its base circle, positive where the driven wheel lags.
    ratio, mesh_order : Fraction or float, optional
        Instead of teeth, of any train: speed of the first shaft by that of the second, and meshes during a turn of the
        first. Of a planetary set with its ring at rest, sun first, 1 + z_r/z_s and z_r z_s/(z_s + z_r).
    free : mapping, optional
        "driver" and "driven": trains of each shaft running free, from which its marks are known.
    mark_error : float or (float, float), optional
        RMS of the errors of the marks as a share of their pitch; default: from the orders beside the mesh orders.
    probability : float
        Of the intervals.
    harmonics : int, optional
        Highest mesh harmonic. Those from half the lines on are taken, where teeth that are alike pass the marks in many
        phases, at the orders they are folded to; what these orders have of their own, by those beside them, is in the
        interval. Default: those below half the lines.
    accuracy : float
        Share of themselves that mesh harmonics are wanted to: the result says which are not, and how long a record they
        take.

    Returns
    -------
    MeasuredTransmissionError

    Raises
    ------
    SignalError
        If records do not fit each other, the ratio or what is told of the discs, or are too short.
    """
    runs = [runs] if isinstance(runs, CoupledRun) else list(runs)
    if not runs:
        raise SignalError("runs: give at least one CoupledRun")
    if not 0.0 < probability < 1.0:
        raise SignalError(f"probability: must lie between 0 and 1, got {probability!r}")
    if not 0.0 < accuracy < 1.0:
        raise SignalError(f"accuracy: must be a share of the amplitude between 0 and 1, such as 0.02, got {accuracy!r}")
    gearing = _gearing(teeth, ratio, mesh_order)
    radius = to_si(base_radius, "length", "base_radius")
    if not 0.0 < radius < LARGEST_RADIUS:
        raise SignalError(
            f"base_radius: must be positive and below {LARGEST_RADIUS:g} m, got {base_radius!r}; a number is in m, a "
            'length in mm is written "41.76 mm"'
        )
    trains = (runs[0].driver, runs[0].driven)
    freed = {name: _listed((free or {}).get(name)) for name in ("driver", "driven")}
    stray = set(free or {}) - set(freed)
    if stray:
        raise SignalError(f"free: has {sorted(stray)}; the shafts are 'driver' and 'driven'")
    _check_trains(runs, freed, gearing)
    if harmonics is not None and (isinstance(harmonics, bool) or not 1 <= harmonics <= MOST_HARMONICS):
        raise SignalError(f"harmonics: must be a whole number from 1 to {MOST_HARMONICS}, got {harmonics!r}")
    orders, refused, remarks = visible_orders(gearing, trains, harmonics)
    remarks += _check_free(runs, freed, gearing)
    # known marks are put right where the pulses are, as the wheels' lag moves them; what is left of them is an unknown
    errors = {name: encoder_marks(trains).errors if trains else None for name, trains in freed.items()}
    measured, standing = _all_lines(runs, gearing, orders, errors, teeth is None)
    if standing:
        orders = [o for o in orders if o.order not in standing]
        measured, _ = _all_lines(runs, gearing, orders, errors, teeth is None)
        refused += folded_onto(standing, gearing)
    shifts, notes = _shifts(measured, gearing)
    notes += [_strayed(one, radius) for one in measured if one.stray]
    notes = list(dict.fromkeys([n for r in runs for t in (r.driver, r.driven) for n in t.notes] + notes + remarks))
    marks = {
        name: [_free_lines(train, name, _whole(orders, k), errors[name]) for train in freed[name]]
        for k, name in enumerate(freed)
    }
    levels = Levels(gearing, orders, [m.values for m in measured], trains, mark_error, marks)
    if any(any(shift) for shift in shifts[1:]):
        notes += _turned(shifts, orders, gearing, measured, marks, levels)
    shadows = _shadows(gearing, orders, measured, trains)
    found = []
    for order in orders:
        known = {name: level for name in marks if not marks[name] and (level := levels.at(order, name)) is not None}
        beside = levels.folded(order, trains) + shadows.get(order.order, 0.0)
        rows = _rows(order, gearing, measured, shifts, marks, known.get("driven", 0.0), beside)
        solved = estimate(rows, known)
        calibrated = all(_is_calibrated(solved, known, name) for name in solved.names if name in known)
        freedom = 2.0 * sum(m.scattered - 1 for m in measured) if calibrated else levels.freedom
        found.append(OrderLine(*order, solved, freedom, calibrated))
    return MeasuredTransmissionError(
        gearing=gearing, radius=radius, lines=found, loads=tuple(dict.fromkeys(r.load for r in runs)), refused=refused,
        notes=notes, probability=probability, teeth=None if teeth is None else check_teeth(teeth),  # type: ignore[arg-type]
        tooth_at_zero=(trains[0].tooth_at_zero, trains[1].tooth_at_zero),
        referenced=(trains[0].referenced, trains[1].referenced), speed=trains[0].mean_speed,
        places={m.run.load: m.place for m in reversed(measured)},
        lines_of=(trains[0].lines, trains[1].lines), turns=min(m.window.turns for m in measured),
        doubt=next(filter(None, (m.doubt for m in measured)), None), accuracy=accuracy,
        recorded={r.load: sum(_seconds(s.driver) for s in runs if s.load == r.load) for r in runs},
        freed={name: sum(map(_seconds, trains)) for name, trains in freed.items()},
    )  # fmt: skip


CALIBRATED = 0.1
"""Share of a level that is left of a mark's variance where runs have told it: then noise is all that matters."""


def _is_calibrated(solved: Found, known: Mapping[str, float], name: str) -> bool:
    k = solved.names.index(name)
    return bool(np.real(solved.covariance[k, k]) < CALIBRATED * known[name])


def _seconds(train: PulseTrain) -> float:
    return float(train.times[-1] - train.times[0])


def _listed(trains: PulseTrain | Sequence[PulseTrain] | None) -> list[PulseTrain]:
    return [] if trains is None else [trains] if isinstance(trains, PulseTrain) else list(trains)


def _fraction(value: Any, name: str) -> Fraction:
    found = value if isinstance(value, Fraction) else Fraction(float(value)).limit_denominator(LARGEST_TERM)
    if not found > 0 or abs(float(found) - float(value)) > 1e-9 * float(value):
        raise SignalError(f"{name}: {value!r} is no ratio of whole numbers; give it as fractions.Fraction(34, 21)")
    return found


def _gearing(teeth: Sequence[int] | None, ratio: Any, mesh_order: Any) -> Gearing:
    if teeth is not None:
        counts = check_teeth(teeth)
        if ratio is not None or mesh_order is not None or len(counts) != 2:
            raise SignalError(f"teeth: give two counts alone, such as teeth=(21, 34), got {teeth!r}")
        return Gearing(Fraction(counts[1], counts[0]), Fraction(counts[0]))
    if ratio is None or mesh_order is None:
        raise MissingMetadataError("teeth", "a transmission error", "pass teeth=(z1, z2), or ratio= and mesh_order=")
    return Gearing(_fraction(ratio, "ratio"), _fraction(mesh_order, "mesh_order"))


def _check_trains(runs: Sequence[CoupledRun], freed: Mapping[str, list[PulseTrain]], gearing: Gearing) -> None:
    """Refuse trains of other discs, of another ratio, or without mark 0 where runs are combined."""
    for name in freed:
        trains = [*freed[name], *(getattr(run, name) for run in runs)]
        for train in trains:
            _check_gaps(train)
        counts = {train.lines for train in trains}
        if len(counts) > 1:
            raise SignalError(f"runs: trains of the {name} have {sorted(counts)} lines; give those of one disc")
        loose = [train.name for train in trains if not train.referenced]
        if loose and len(trains) > 1:
            raise SignalError(
                f"runs: nothing says which pulse of {loose[0]!r} is that of mark 0, by which records of the {name} are "
                "combined; record index pulses (index=..., in files a column 'driver index' beside 'driver'), or use "
                "one run alone"
            )
    for run in runs:
        measured = run.driver.mean_speed / run.driven.mean_speed
        if abs(measured / float(gearing.ratio) - 1.0) > 0.5 / max(run.driver.turns, 1.0):
            raise SignalError(
                f"ratio: the driver turns {measured:.6g} times as fast as the driven shaft, not "
                f"{float(gearing.ratio):.6g} times; check teeth, lines ({run.driver.lines}, {run.driven.lines}) and "
                "which of the trains is the driver's"
            )


def _check_gaps(train: PulseTrain) -> None:
    """Refuse a train with a gap so long that nothing numbers the pulses behind it."""
    interval = np.diff(train.times) / np.diff(train.numbers)
    beside = np.maximum(np.r_[0.0, interval[:-1]], np.r_[interval[1:], 0.0])
    longest = int(np.argmax(interval / beside))
    pitches = float(interval[longest] / beside[longest])
    if pitches > MOST_MISSING:
        raise SignalError(
            f"runs: {train.name!r} has no pulses from {train.times[longest]:.6g} to {train.times[longest + 1]:.6g} s, "
            f"about {pitches:.3g} pitches, behind which nothing says their numbers; give the record before the gap, or "
            "that behind it"
        )


def _check_free(runs: Sequence[CoupledRun], freed: Mapping[str, list[PulseTrain]], gearing: Gearing) -> list[str]:
    """Refuse free runs of other discs than those of the runs, or the runs themselves; remark where nothing tells."""
    remarks = []
    for name, mesh in (("driver", gearing.mesh), ("driven", gearing.on_second(gearing.mesh))):
        coupled = [getattr(run, name) for run in runs]
        for free in freed[name]:
            if any(np.isin(free.times, train.times).mean() > SAME_RECORD for train in coupled):
                raise SignalError(
                    f"free: {free.name!r} of the {name} is the run in mesh itself, and would take the transmission "
                    f"error for marks; give a record of the {name} running free"
                )
            found = share_found(encoder_marks(free), coupled, float(mesh))
            if found is None:
                continue
            share, error = found
            words = f"{share:.2f} +- {error:.2f} of the errors of its marks is in the run in mesh"
            if share + SURELY * error < SAME_DISC:
                raise SignalError(
                    f"free: {free.name!r} is not of the {name}'s disc: {words}, of one disc it is 1; give the free run "
                    "of this disc, turning the same way and with the same mark 0, or leave free out"
                )
            if share - SURELY * error < SAME_DISC:
                remarks.append(f"Free run of the {name}: {words}, which does not tell whether it is of the same disc.")
    return remarks


SAME_RECORD = 0.5
"""Share of pulses at the same times from which two records are one: of two of 50 ns clocks one in thousands agrees."""
SAME_DISC = 0.5
"""Share of a free run's marks that must be found again: midway between those of one disc and of two."""
SURELY = 3.0
"""Standard errors by which a share must be below it: of a disc whose share is 1 fewer than 1 in 800 are."""


def _all_lines(
    runs: Sequence[CoupledRun],
    gearing: Gearing,
    orders: Sequence[Order],
    errors: Mapping[str, np.ndarray | None],
    several: bool,
) -> tuple[list[_Measured], dict[Fraction, tuple[str, int]]]:
    """Evaluate all runs; with known marks, also the shafts' orders that turn out to be later mesh harmonics, folded."""
    trains = (runs[0].driver, runs[0].driven)
    hidden = hidden_harmonics(gearing, trains, orders)
    measured = [_lines_of(run, gearing, orders, hidden, errors, several) for run in runs]
    if any(known is None for known in errors.values()):
        return measured, {}
    squares = {o.order: float(np.mean([abs(m.values[o.order].value) ** 2 for m in measured])) for o in orders}
    return measured, standing_harmonics(gearing, trains, orders, squares)


def _lines_of(
    run: CoupledRun,
    gearing: Gearing,
    orders: Sequence[Order],
    hidden: Sequence[Sequence[Fraction]],
    errors: Mapping[str, np.ndarray | None],
    several: bool,
) -> _Measured:
    """Evaluate a run at all orders."""
    course = common_angle(run.driver, errors["driver"])
    begin, end = _common(course, run.driven)
    turn = max(float(gearing.ratio), 1.0)
    slower = (end - begin) / (TURN * turn)
    if slower < FEWEST_TURNS:
        raise SignalError(
            f"runs: the records of {run.driver.name!r} and {run.driven.name!r} have {max(slower, 0.0):.3g} turns of "
            f"the slower shaft in common beside two that the smooth angle takes; {FEWEST_TURNS} are needed"
        )
    # the turns after which the wheels meet again, if there are as many
    window = Window.of(begin, end, (float(gearing.ratio.numerator), turn))
    end = begin + TURN * window.length
    scale = float(gearing.ratio)
    first = deviations(run.driver, course, begin, end, 1.0, errors["driver"])
    second = deviations(run.driven, course, begin, end, scale, errors["driven"])
    _check_clocks(run, first.drift - second.drift, float(gearing.mesh), window.length)
    period = Fraction(gearing.ratio.numerator)
    if not averaged(window, period):
        known = [float(o.order) for o in orders if o.harmonic]
        first, second = (bridged(one, known, window) for one in (first, second))
    steps = (Fraction(1), 1 / gearing.ratio, gearing.mesh)
    # after as many turns of the first and second shaft the wheels meet again
    counts = (gearing.ratio.numerator * run.driver.lines, gearing.ratio.denominator * run.driven.lines)
    values = lines_by_meetings(
        (first, second), [o.order for o in orders], steps, window, (1.0, -1.0), gearing.mesh,
        period=period, counts=counts, hidden=hidden,
    )  # fmt: skip
    mesh = [o.order for o in orders if o.harmonic]
    trains = (run.driver, run.driven)
    doubt = repeating_marks(trains, (float(gearing.mesh), float(gearing.on_second(gearing.mesh))), scale)
    # marks that repeat are told for lines of a mesh otherwise
    told = first, second, begin, end, gearing, (run.driver.lines, run.driven.lines)
    doubt = doubt or doubted_numbers(*told, several)
    scattered = min(max(2, math.floor(slower)), MOST_SCATTER)
    return _Measured(
        run, values, mesh, scale, second.mean / scale, scattered, doubt, window, stray_lines(*told) if several else []
    )


def _strayed(one: _Measured, radius: float) -> str:
    """Return what is said of lines that are of neither shaft."""
    listed = ", ".join(f"{order:.5g} ({1e6 * radius * height:.3g} um)" for order, height in one.stray)
    return (
        f"CHECK THE SHAFTS BETWEEN: lines stand at orders {listed} of the driver, whole ones of neither shaft, as of "
        "shafts and meshes between the two: curves, F_i' and errors of teeth lack them."
    )


def _check_clocks(run: CoupledRun, drift: float, mesh: float, turns: float) -> None:
    """Refuse shafts that move apart (rad of the first) by more than wheels in mesh can, their backlash included."""
    pitches = drift * mesh / TURN
    if abs(pitches) > SLIPPED:
        raise SignalError(
            f"runs: {run.driven.name!r} moves {pitches:.3g} pitches of teeth against {run.driver.name!r}, which no "
            f"wheels in mesh do: {1e6 * drift / (TURN * turns):.3g} ppm, as of two clocks, or lost pulses; record both "
            "with one counter, and see the notes of the trains"
        )


def _common(course: Course, driven: PulseTrain) -> tuple[float, float]:
    """Return the stretch of the common angle that both encoders cover."""
    low, high = max(course.begin, float(driven.times[0])), min(course.end, float(driven.times[-1]))
    if low >= high:
        raise SignalError(f"runs: the pulses of {driven.name!r} and of the driver are not of the same time")
    return float(course.angle(low)), float(course.angle(high))


def _free_lines(train: PulseTrain, name: str, orders: Sequence[int], errors: np.ndarray | None) -> dict[Fraction, Line]:
    """Return the lines of a shaft that runs free, at whole orders: what is left of its marks with the sign turned."""
    course = smooth_angle(train)
    begin, end = float(course.angle(course.begin)), float(course.angle(course.end))
    turns = (end - begin) / TURN
    if turns < FEWEST_TURNS:
        raise SignalError(
            f"free: {train.name!r} of the {name} has {turns:.3g} turns beside two that the smooth angle takes; "
            f"{FEWEST_TURNS} are needed, record longer"
        )
    window = Window.of(begin, end, (1.0,))
    found = deviations(train, course, begin, begin + TURN * window.length, 1.0, errors)
    whole, turn = [Fraction(k) for k in orders], Fraction(1)
    return lines_by_meetings((found,), whole, (turn,), window, (1.0,), period=turn, counts=(train.lines,))


def _shifts(measured: Sequence[_Measured], gearing: Gearing) -> tuple[list[tuple[float, float]], list[str]]:
    """Return the angles of the discs of each run, rad, a single one corrected by where the pulses say it stands."""
    pitch = TURN / float(gearing.on_second(gearing.mesh))
    found, notes = [], []
    for k, one in enumerate(measured):
        told = tuple(to_si(s, "angle", "shift") for s in one.run.shift)
        if k == 0:
            found.append((told[0], told[1]))
            continue
        # of a disc turned in the sense of rotation each mark passes earlier
        expected = told[1] - found[0][1] - (told[0] - found[0][0]) / float(gearing.ratio)
        off = one.place - measured[0].place - expected
        off -= pitch * round(off / pitch)
        if sum(s != 0.0 for s in told) == 1:
            at = 0 if told[0] else 1
            by = off * (-float(gearing.ratio) if at == 0 else 1.0)
            told = (told[0] + by, told[1]) if at == 0 else (told[0], told[1] + by)
            notes.append(
                f"Run {k + 1}: the disc of the {('driver', 'driven')[at]} was turned by {math.degrees(told[at]):.4f} "
                f"deg, {math.degrees(by):+.4f} deg off what was told."
            )
            if abs(off) > 0.25 * pitch:
                raise SignalError(
                    f"shift: the pulses of run {k + 1} put the disc {math.degrees(by):+.3f} deg off the "
                    f"{math.degrees(told[at] - by):.3f} deg that are told, more than a quarter of a tooth; check which "
                    "disc was turned, by how much, and its sense"
                )
        elif abs(off) > SLIPPED * pitch:
            raise SignalError(
                f"shift: discs and wheels of run {k + 1} stand {math.degrees(off):+.3f} deg otherwise than in the "
                "first run; give the angle of the disc that was turned, or leave this run out"
            )
        found.append((told[0], told[1]))
    return found, notes


def _turned(
    shifts: list[tuple[float, float]],
    orders: Sequence[Order],
    gearing: Gearing,
    measured: Sequence[_Measured],
    marks: Mapping[str, list[dict[Fraction, Line]]],
    levels: Levels,
) -> list[str]:
    """Hold the angles of turned discs against the marks (`gearmbs.signals.encoders.turned`)."""
    mesh = {"driver": float(gearing.mesh), "driven": float(gearing.on_second(gearing.mesh))}
    known = dict(levels.told or {})
    for name in mesh if not known else ():
        level = level_beyond(levels.orders[name], levels.squares[name], mesh[name])
        if level is None:
            return []
        known[name] = level
    rows_of = lambda order, angles: _rows(order, gearing, measured, angles, marks, 0.0, 0.0)  # noqa: E731
    return check_turned(shifts, orders, gearing, rows_of, {k: v for k, v in known.items() if not marks[k]})


def _rows(
    order: Order,
    gearing: Gearing,
    measured: Sequence[_Measured],
    shifts: Sequence[tuple[float, float]],
    marks: Mapping[str, list[dict[Fraction, Line]]],
    unknown: float,
    folded_onto: float,
) -> list[Row]:
    """Return what all runs measured at one order, and of what it consists.

    Where the order is folded, what the shafts have of their own there is added to the noise.

    The wheels' lag moves the driven marks to and fro under the line: of unknown ones, whose lines have this variance,
    each run has another part (kappa lag)^2 of it.
    """
    rows = []
    for one, shift in zip(measured, shifts):
        value, variance = one.values[order.order]
        variance += folded_onto
        if unknown and order.second is not None:
            variance += unknown * (order.second * one.wander) ** 2 * float(gearing.ratio) ** 2
        if order.first is not None or order.second is None:
            phase = np.exp(-1j * float(order.order) * shift[0])
        else:
            phase = np.exp(1j * order.second * (one.place - shift[1]))
        factors: dict[str, complex] = {f"T {one.run.load}": complex(phase)}
        if order.first is not None:
            factors["driver"] = -1.0 + 0.0j
        if order.second is not None:
            factors["driven"] = complex(float(gearing.ratio) * np.exp(1j * order.second * one.place))
        rows.append(Row(value, variance, factors))
    for name, whole in (("driver", order.first), ("driven", order.second)):
        if whole is not None:
            rows += [Row(*found[Fraction(whole)], {name: -1.0 + 0.0j}) for found in marks[name]]
    return rows


def _shadows(
    gearing: Gearing, orders: Sequence[Order], measured: Sequence[_Measured], trains: Sequence[PulseTrain]
) -> dict[Fraction, float]:
    """Return the variances (rad^2 of the first shaft) of what later mesh harmonics may add where they are folded onto.

    Their amplitudes are taken to fall as the square of their number from those of the measured ones around.
    """
    mesh = [o for o in orders if o.harmonic]
    square = np.array([np.mean([abs(m.values[o.order].value) ** 2 for m in measured]) for o in mesh])
    found = {}
    for k, order in enumerate(mesh):
        later = shadow(gearing, trains, order.harmonic or 0)
        if later is not None:
            around = float(square[max(0, k - AROUND) : k + AROUND + 1].mean())
            found[order.order] = 0.5 * around * ((order.harmonic or 0) / later) ** 4
    return found


AROUND = 2
"""Harmonics to either side of one by which the height of those around it is told: spectra of curves have zeros."""


def _whole(orders: Iterable[Order], shaft: int) -> list[int]:
    """Return the whole orders of a shaft."""
    return [o for order in orders if (o := order.second if shaft else order.first) is not None]
