"""Remarks on an analysis: how far it had to move the parts before it could start, which solids touched by facets, which
points of contact left their curve, and whether the motion depends on the ERROR asked for.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.adams.builders.scopes import AdamsModel, markers_of
from gearmbs.adams.parse import statements as st
from gearmbs.dae.problem import ModelError
from gearmbs.dae.result import Status
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.contacts import ContactTracks, SolidContact, contact_tracks
from gearmbs.mechanism.language.syntax import Units

FAR = 1e-3
"""Displacement worth a warning, in sizes of the model."""
TURNED = np.deg2rad(0.1)
"""Rotation worth a warning, rad."""

LEAST_ANGLE = 1e-9
"""Rotation that is none but rounding, rad."""
ROUNDED = 1e-9
"""Change of a velocity, of it, that is none."""
GIVEN = frozenset("vx vy vz wx wy wz".split())
"""Arguments by which a statement gives velocities."""

TIGHTER = 0.01
"""Part of its error at which an analysis is solved again: the second solution's own error is then small beside the
change that is looked at."""
TIGHTEST = 1e-11
"""Least error asked for: what is smaller may be rounding."""
TELLING = 1e-9
"""Error up to which a second run that does not reach the end says nothing of the first."""
LONGER = 20
"""Steps of the second run, in those of the first, after which it is given up."""
APART = 0.01
"""Distance of two runs, of the largest displacement of a part, that is remarked."""
STILL = 1e-6
"""Largest displacement, of the largest coordinate of a part or a marker, up to which nothing moves."""
NOWHERE = 1e-15
"""Metres, the size of a proton: no part moves by less."""
CHEAP = 2_000_000
"""Work of a second run that is not asked for, at most: about a second or two."""
EXPECTED = 3
"""Steps of the second run, in those of the first, that are expected of it: 100^(1/4) for an error of fourth order."""


@dataclass(frozen=True)
class Assembly:
    """The largest corrections of the initial conditions.

    Attributes
    ----------
    distance : float
        Of a part's centre of mass, in the deck's unit of length.
    angle : float
        Rad.
    farthest, most_turned : str
        Which parts they are, "" without any.
    far : bool
        Whether that is more than the rounded numbers of a deck explain.
    speed, spin : float
        Largest changes of velocities that the deck gives, in its units.
    fastest, most_spun : str
        Which parts they are, "" if none was changed.
    """

    distance: float = 0.0
    angle: float = 0.0
    farthest: str = ""
    most_turned: str = ""
    far: bool = False
    speed: float = 0.0
    spin: float = 0.0
    fastest: str = ""
    most_spun: str = ""

    def remark(self, time: float, unit: str) -> str:
        """Return a sentence on parts that were moved far, "" when none was."""
        if not self.far:
            return ""
        moved = [f"{self.farthest} by {self.distance:.4g} {unit}"] if self.distance > 0.0 else []
        if self.angle > LEAST_ANGLE or not moved:
            moved.append(f"{self.most_turned} by {np.rad2deg(self.angle):.4g} degrees")
        return f"at TIME = {time:g} the parts did not fit their joints and motions and were moved: {', '.join(moved)}"


def assembly_of(model: AdamsModel, solution: Solution) -> Assembly:
    """Compare where the parts were put with where a solution starts."""
    bodies = model.mechanism.bodies
    distances, angles, speeds, spins = {}, {}, {"": 0.0}, {"": 0.0}
    for name, body in bodies.items():
        if name not in model.sources:
            # a runner on a curve, which is no part
            continue
        label = model.sources[name].label()
        distances[label] = float(np.linalg.norm(solution.com_position(name)[0] - body.centre_of_mass()[0]))
        # |A - B| = 2 sqrt(2) sin(angle/2)
        apart = float(np.linalg.norm(solution.orientation(name)[0] - body.orientation))
        angles[label] = 2.0 * float(np.arcsin(min(1.0, apart / np.sqrt(8.0))))
        if GIVEN & set(model.sources[name].given):
            speeds[label] = _change(body.centre_of_mass()[1], solution.com_velocity(name)[0])
            spins[label] = _change(body.angular_velocity, solution.angular_velocity(name)[0])
    if not bodies:
        return Assembly()
    places = np.array([m.global_position() for m in markers_of(model.mechanism)])
    size = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
    farthest, most_turned = max(distances, key=distances.__getitem__), max(angles, key=angles.__getitem__)
    distance, angle = distances[farthest], angles[most_turned]
    far = distance > FAR * size or angle > TURNED
    fastest, most_spun = max(speeds, key=speeds.__getitem__), max(spins, key=spins.__getitem__)
    units = model.deck.units
    return Assembly(
        distance / units.length, angle, farthest, most_turned, far, speeds[fastest] / units.factor("velocity"),
        spins[most_spun] / units.factor("angular_velocity"), fastest, most_spun,
    )  # fmt: skip


def _change(given: np.ndarray, found: np.ndarray) -> float:
    """Return by how much a velocity differs from that given, 0 where only by rounding."""
    change = float(np.linalg.norm(found - given))
    return change if change > ROUNDED * float(np.linalg.norm(given)) else 0.0


# Constraint rows in the words of ADAMS's message files.


PATTERNS = (
    (re.compile(r"coincident (\w)"), "Translation of I Marker Along {0}g"),
    (re.compile(r"no offset along (\w)_J"), "Translation of I Marker Along {0}j"),
    (re.compile(r"(\w)_I normal to (\w)_J"), "Rotation Between {0}i & {1}j"),
    (re.compile(r"angle"), "Rotation About Zj"),
    (re.compile(r"displacement"), "Translation Along Zj"),
)


def row_text(model: AdamsModel, name: str) -> str:
    """Return a row, named ``joint: what it enforces``, as ADAMS names it: element, its type, its motion."""
    element, _, label = name.rpartition(": ")
    statement = model.sources.get(element)
    where = element
    if statement is not None:
        kind = getattr(statement, "type", None) or ""
        words = f"{str(kind).title()} {statement.entity.replace('_', ' ')}".strip()
        where = f"{statement.label()} {element}" + (f" ({words})" if words else "")
    for pattern, text in PATTERNS:
        found = pattern.fullmatch(label)
        if found is not None:
            return f"{where}    {text.format(*(axis.upper() for axis in found.groups()))}"
    return f"{where}    {label}"


# What is to be said of contacts whose solids are cut into facets: what rolls on these loses speed.


@dataclass(frozen=True)
class FacetedTouch:
    """Two solids that touched, one of them round and cut into facets.

    Attributes
    ----------
    contact, first, second : str
        The CONTACT and both GRAPHICS.
    triangles : int
        Of both solids.
    sagitta, depth : float
        Between the facets and the round surface, and the median penetration while they touched, m.
    """

    contact: str
    first: str
    second: str
    triangles: int
    sagitta: float
    depth: float


def faceted_touches(model: AdamsModel, tracks: dict[int, ContactTracks]) -> list[FacetedTouch]:
    """Return pairs of round solids in facets that touched, those first whose facets are coarsest against the depth."""
    found = []
    for number, track in tracks.items():
        name = model.names["contact", number]
        statement, element = model.sources[name], model.mechanism.elements[name]
        assert isinstance(statement, st.Contact)
        assert isinstance(element, SolidContact)
        depths: dict[tuple[int, int], list[np.ndarray]] = {}
        for k, pair in enumerate(track.pairs):
            depths.setdefault(pair, []).append(track.penetration[track.touching[:, k], k])
        for (i, j), triangles, sagitta in element.round_facets():
            sunk = np.concatenate(depths.get((i, j), [np.zeros(0)]))
            if sunk.size:
                first, second = f"GRAPHICS/{statement.igeom[i]}", f"GRAPHICS/{statement.jgeom[j]}"
                label = statement.label()
                found.append(FacetedTouch(label, first, second, triangles, sagitta, float(np.median(sunk))))
    return sorted(found, key=lambda touch: -touch.sagitta / touch.depth)


def facets_remark(touches: list[FacetedTouch], length: float, unit: str) -> str:
    """Return one sentence on all of them, lengths in the deck's unit, which is ``length`` m and called ``unit``."""
    worst, others = touches[0], touches[1:]
    also = ""
    if others:
        named = list(dict.fromkeys(f"{t.first} and {t.second} of {t.contact}" for t in others))
        shown = ", ".join(named[:3]) + (f" and {len(named) - 3} more" if len(named) > 3 else "")
        also = f"; so are {shown}"
    return (
        f"{worst.contact}: {worst.first} and {worst.second} are cut into {worst.triangles} triangles, which leave the "
        f"round surface by up to {worst.sagitta / length:.3g} {unit}, while they sink in by {worst.depth / length:.3g}"
        f"{also}. What rolls on facets is lifted over each edge and loses speed to DAMPING, which nothing else tells; "
        "let it roll on solids whose contact is exact (PLANE, BOX, CYLINDER, FRUSTUM, ELLIPSOID for what is round), "
        "give a finer mesh, or less DAMPING, and compare"
    )


# What happened at the points of contact of a CONTACT, under the names that ADAMS's postprocessor has for it.


VECTORS: dict[str, tuple[str, Callable[[ContactTracks], np.ndarray]]] = {
    "I_Point": ("length", lambda t: t.i_point),
    "J_Point": ("length", lambda t: t.j_point),
    "I_Normal_Unit_Vector": ("number", lambda t: t.i_normal),
    "J_Normal_Unit_Vector": ("number", lambda t: -t.i_normal),
    "I_Normal_Force": ("force", lambda t: t.i_normal_force),
    "J_Normal_Force": ("force", lambda t: -t.i_normal_force),
    "I_Friction_Force": ("force", lambda t: t.i_friction_force),
    "J_Friction_Force": ("force", lambda t: -t.i_friction_force),
    "Slip_Velocity": ("velocity", lambda t: t.slip_velocity),
}
"""Sets of components X, Y and Z: their dimension, their values in SI."""
DEPTH = "Penetration"
TRACK_COLUMNS = tuple(f"{name}.{axis}" for name in VECTORS for axis in "XYZ") + (f"{DEPTH}.Depth",)


def tracks_of(model: AdamsModel, solution: Solution) -> dict[int, ContactTracks]:
    """Return the tracks of all active contacts between solids, by id, SI."""
    found = {}
    for kind, number in model.pairs:
        name = model.names.get((kind, number))
        element = model.mechanism.elements.get(name) if kind == "contact" and name is not None else None
        if isinstance(element, SolidContact):
            found[number] = contact_tracks(solution, element)
    return found


TRACK_DIMENSIONS = tuple(d for d, _ in VECTORS.values() for _ in "XYZ") + ("length",)


def track_table(parts: Sequence[tuple[int, ContactTracks | None]], units: Units) -> np.ndarray:
    """Return the tracks of a contact over analyses, shape (m, tracks, columns), in the deck's units.

    Parameters
    ----------
    parts : sequence of (int, ContactTracks or None)
        Of each analysis the number of output times, and the tracks, which are counted from the first on in each.
    units : Units
    """
    most = max((len(tracks) for _, tracks in parts if tracks is not None), default=0)
    tables = []
    for times, tracks in parts:
        table = np.zeros((times, most, len(TRACK_COLUMNS)))
        if tracks is not None:
            # the sum makes minus nothing nothing
            vectors = [0.0 + values(tracks) / units.factor(dimension) for dimension, values in VECTORS.values()]
            table[:, : len(tracks)] = np.concatenate([*vectors, tracks.penetration[:, :, None] / units.length], axis=2)
        tables.append(table)
    return np.concatenate(tables or [np.zeros((0, 0, len(TRACK_COLUMNS)))])


# Whether a motion depends on the ERROR asked for.


@dataclass(frozen=True)
class Doubt:
    """What a smaller error changes.

    Attributes
    ----------
    since : float
        When places begin to differ, s; if the second run did not reach the end, when it stopped.
    tol : float
        Error of the first run.
    part : str
        Which is farthest from its other place, at any time.
    apart, at_end, moved : float
        By how much, also at the end, and the largest displacement of any part, m.
    stopped : str
        Why the second run did not reach the end, "" if it did.
    """

    since: float
    tol: float
    part: str = ""
    apart: float = 0.0
    at_end: float = 0.0
    moved: float = 0.0
    stopped: str = ""

    def remark(self, time: float, length: float, unit: str) -> str:
        """Return a sentence, with the deck's units of time and length, in SI, and the latter's name."""
        again = f"at a hundredth of ERROR = {self.tol:g}"
        if self.stopped:
            return (
                f"{again} the run ends at TIME = {self.since / time:.4g}: {self.stopped} What follows here may not be "
                "the motion of the model"
            )
        return (
            f"{again} the motion is another from TIME = {self.since / time:.4g} on: {self.part} is up to "
            f"{self.apart / length:.3g} {unit} elsewhere, {self.at_end / length:.3g} at the end, where parts move by "
            f"{self.moved / length:.3g} at most; it amplifies small differences, or ERROR is too large: ask for a "
            "smaller one"
        )


def work_of_a_step(model: AdamsModel, solution: Solution) -> int:
    """Return the work of a step: unknowns and, of pairs of faceted solids, triangles."""
    contacts = [f for f in model.mechanism.elements.values() if isinstance(f, SolidContact)]
    return solution.problem.n + sum(contact.triangles() for contact in contacts)


def doubt(
    model: AdamsModel,
    solution: Solution,
    options: dict[str, Any],
    again: Callable[[dict[str, Any]], Solution],
    asked: bool | None,
) -> Doubt | None:
    """Solve an analysis again at a hundredth of its error; return what that changes, None if little or not looked at.

    Parameters
    ----------
    model : AdamsModel
    solution : Solution
    options : dict
        Of the integrator.
    again : callable
        Solves the analysis with other options.
    asked : bool or None
        Whether to look at it; None: if that is expected to cost little, and no longer than it does. What decides are
        counts of steps, unknowns and triangles, so that a model is treated alike on every machine.
    """
    if asked is False or not solution.success or solution.t.size < 2:
        return None
    tol = max(TIGHTER * options["tol"], TIGHTEST)
    if tol >= options["tol"]:
        return None
    steps = LONGER * (solution.stats.steps + 100)
    if asked is None:
        affordable = CHEAP // work_of_a_step(model, solution)
        if EXPECTED * solution.stats.steps > affordable:
            return None
        steps = min(steps, affordable)
    try:
        second = again({**options, "tol": tol, "max_steps": steps})
    except (ModelError, ArithmeticError) as error:
        return Doubt(float(solution.t[0]), options["tol"], stopped=f"{error}.")
    if second.status in (Status.TOO_MANY_STEPS, Status.INTERRUPTED, Status.BELOW_ROUNDING) or (
        not second.success and tol < TELLING
    ):
        return None
    if not second.success:
        return Doubt(float(second.t[-1]), options["tol"], stopped=second.message.partition(". ")[0].rstrip(".") + ".")
    names = [name for name in model.mechanism.bodies if name in model.sources]
    if not names:
        return None
    one, other = (np.stack([s.com_position(name) for name in names], axis=1) for s in (solution, second))
    sized = [m.global_position() for body in model.mechanism.bodies.values() for m in body.markers]
    size = max(float(np.abs(one).max()), max((float(np.abs(at).max()) for at in sized), default=0.0))
    moved = max(float(np.linalg.norm(one - one[0], axis=2).max()), STILL * size)
    if moved < NOWHERE:
        return None
    apart = np.linalg.norm(one - other, axis=2)
    off = np.flatnonzero(apart.max(axis=1) > APART * moved)
    if off.size == 0:
        return None
    farthest = int(np.argmax(apart.max(axis=0)))
    label, own = model.sources[names[farthest]].label(), apart[:, farthest]
    return Doubt(float(solution.t[off[0]]), options["tol"], label, float(own.max()), float(own[-1]), moved)


# Remarks on points of contact that leave an open curve.


OFF = 1e-9
"""Of a curve's length: beyond its end by less than it is at the end."""


def off_the_end(model: AdamsModel, solution: Solution) -> list[str]:
    """Return a remark on each point of contact that is beyond the end of its curve, with the first time of output."""
    remarks = []
    for runner, (statement, length) in model.runners.items():
        travel = solution.com_position(runner)[:, 2]
        beyond = np.flatnonzero((travel < -OFF * length) | (travel > (1.0 + OFF) * length))
        if beyond.size:
            time = solution.t[beyond[0]] / model.deck.units.time
            remarks.append(
                f"{statement.label()}: at TIME = {time:.9g} it is off the end of its curve, where the spline goes on "
                "beyond the points; give points further out, or a SENSOR that ends the analysis before"
            )
    return remarks
