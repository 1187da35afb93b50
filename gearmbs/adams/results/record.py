"""What the analyses of a deck give: requests over time, parts' motion, forces, messages."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.adams.builders.scopes import AdamsModel
from gearmbs.adams.errors import Diagnostic, folded
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import Command, Script, Simulate
from gearmbs.adams.parse.deck import RESULT_NAMES, Deck, unit_names
from gearmbs.adams.results.remarks import (
    TRACK_COLUMNS,
    TRACK_DIMENSIONS,
    Assembly,
    FacetedTouch,
    facets_remark,
    track_table,
)
from gearmbs.adams.results.requests import RequestSeries
from gearmbs.dae.analyses.modes import Modes
from gearmbs.dae.analyses.plant import LinearPlant
from gearmbs.dae.analyses.statics import StaticResult
from gearmbs.dae.result import Status
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.contacts import ContactTracks
from gearmbs.mechanism.parts.modal import ModalBody

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.adams.results.remarks import Doubt

NEWTON = "Newton"
"""What solves analyses in which nothing is integrated."""


@dataclass
class Segment:
    """One SIMULATE command's outcome.

    Attributes
    ----------
    command : Simulate
    kind : str
    model : AdamsModel
    solution : Solution
        SI values.
    options : dict
        What the integrator was given.
    note : str or None
    equilibrium : StaticResult or None
        Of a single static analysis.
    assembly : Assembly or None
        How far the parts were moved at the start; None for statics, which moves them anyway.
    passage : tuple of float and str or None
        When constraints came to depend on each other, s, and which.
    doubt : Doubt or None
        What a smaller error changes.
    facets : list of FacetedTouch
        Of a dynamic analysis: pairs of round solids in facets that touched.
    requests : dict of int to RequestSeries
        Values in the deck's units.
    wrenches : dict
        (kind, id) -> force and torque on the I side, global components, SI, shape (m, 6).
    tracks : dict of int to ContactTracks
        What happened where the solids of a CONTACT touched, by id, SI.
    variables : dict of int to ndarray
        Values of the VARIABLEs, by id, in the deck's units, shape (m,).
    """

    command: Simulate
    kind: str
    model: AdamsModel
    solution: Solution
    options: dict[str, Any]
    note: str | None = None
    requests: dict[int, RequestSeries] = field(default_factory=dict)
    wrenches: dict[tuple[str, int], np.ndarray] = field(default_factory=dict)
    tracks: dict[int, ContactTracks] = field(default_factory=dict)
    variables: dict[int, np.ndarray] = field(default_factory=dict)
    equilibrium: StaticResult | None = None
    assembly: Assembly | None = None
    passage: tuple[float, str] | None = None
    doubt: Doubt | None = None
    facets: list[FacetedTouch] = field(default_factory=list)

    @property
    def success(self) -> bool:
        """True when the analysis reached its end."""
        return self.solution.success

    @property
    def interrupted(self) -> bool:
        """True when somebody interrupted the analysis; what was computed until then is there."""
        return self.solution.status is Status.INTERRUPTED


@dataclass
class RunRecord:
    """All analyses of a run, one after the other.

    Attributes
    ----------
    deck : Deck
    script : Script
    log : list of (Command, Segment, Modes, LinearPlant or None)
        The commands that were carried out, with what they gave.
    errors : list of Diagnostic
        What ended the script.
    interrupted : str
        A sentence on where somebody interrupted the run, "" if nobody did.
    """

    deck: Deck
    script: Script
    log: list[tuple[Command, Segment | Modes | LinearPlant | None]] = field(default_factory=list)
    errors: list[Diagnostic] = field(default_factory=list)
    interrupted: str = ""

    @property
    def command(self) -> Command:
        """The command that is, or was last, carried out."""
        return self.log[-1][0] if self.log else Command(self.script.file)

    @property
    def segments(self) -> list[Segment]:
        """The analyses by SIMULATE, in order."""
        return [outcome for _, outcome in self.log if isinstance(outcome, Segment)]

    @property
    def modes(self) -> list[Modes]:
        """What each LINEAR/EIGENSOL gave, in rad/s and Hz."""
        return [outcome for _, outcome in self.log if isinstance(outcome, Modes)]

    @property
    def plants(self) -> list[LinearPlant]:
        """What each LINEAR/STATEMAT gave, in the deck's units."""
        return [outcome for _, outcome in self.log if isinstance(outcome, LinearPlant)]

    @property
    def success(self) -> bool:
        """True when the script was carried out and every analysis reached its end."""
        return not self.errors and not self.interrupted and all(s.success for s in self.segments)

    @property
    def partial(self) -> bool:
        """True when somebody interrupted the run, or a routine of the user failed: results are there until then."""
        return bool(self.interrupted) or any(s.solution.status is Status.USER_ERROR for s in self.segments)

    @property
    def messages(self) -> list[str]:
        """What was left out, ignored or went wrong, one sentence each."""
        found = [str(d) for d in folded((*self.deck.diagnostics, *self.script.diagnostics))]
        for segment in self.segments:
            found.extend(self.remarks(segment))
            if not segment.success and not self.partial:
                found.append(segment.solution.message)
        return found + [str(d) for d in self.errors] + [self.interrupted] * bool(self.interrupted)

    def remarks(self, segment: Segment) -> list[str]:
        """Return what is to be said about an analysis: settings, parts that were moved, an equilibrium that is none."""
        found = [segment.note] if segment.note else []
        of_model = segment.solution.remark
        if of_model and next(s for s in self.segments if s.solution.remark == of_model) is segment:
            found.append(of_model)
        time = float(segment.solution.t[0] / self.deck.units.time)
        if segment.assembly is not None and segment.assembly.far:
            found.append(segment.assembly.remark(time, self.unit("length")))
        if segment.equilibrium is not None and segment.equilibrium.stable is False:
            found.append(f"the equilibrium at TIME = {time:g} is unstable: the parts leave it when they are touched")
        if segment.passage is not None:
            when, rows = segment.passage
            found.append(
                f"about TIME = {when / self.deck.units.time:.4g} the mechanism passed a position in which it locks or "
                f"can branch: {rows} depend on each other there; what follows may depend on ERROR: try a smaller one"
            )
        units = self.deck.units
        if segment.facets and segment is next(s for s in self.segments if s.facets):
            found.append(facets_remark(segment.facets, units.length, self.unit("length")))
        if segment.doubt is not None:
            found.append(segment.doubt.remark(units.time, units.length, self.unit("length")))
        return found

    @cached_property
    def t(self) -> np.ndarray:
        """Output times in the deck's unit; where one analysis follows another the time stands twice."""
        scale = self.deck.units.time
        return np.concatenate([s.solution.t / scale for s in self.segments] or [np.zeros(0)])

    def request(self, number: int) -> np.ndarray:
        """Return the eight columns of REQUEST/number, shape (m, 8), deck units and radians.

        Raises
        ------
        KeyError
            If there is no such request.
        """
        if number not in self.deck.of(st.Request):
            known = ", ".join(str(k) for k in self.deck.of(st.Request))
            raise KeyError(f"there is no REQUEST/{number}; the deck has {known or 'none'}")
        return np.concatenate([s.requests[number].values for s in self.segments] or [np.zeros((0, 8))])

    def part(self, number: int) -> np.ndarray:
        """Return position and velocity, angles and rates of a part's frame, shape (m, 18), deck units and radians.

        Columns: X Y Z PSI THETA PHI VX VY VZ WX WY WZ ACCX ACCY ACCZ WDX WDY WDZ.
        """
        return np.concatenate([part_motion(s, number) for s in self.segments] or [np.zeros((0, 18))])

    def point_mass(self, number: int) -> np.ndarray:
        """Return position, velocity and acceleration of the frame of POINT_MASS/number, shape (m, 9), deck units."""
        columns = [PART_COLUMNS.index(name) for name in POINT_COLUMNS]
        rows = [part_motion(s, number, "point_mass")[:, columns] for s in self.segments]
        return np.concatenate(rows or [np.zeros((0, len(columns)))])

    def flexible(self, number: int) -> np.ndarray:
        """Return the motion of the frame of FLEX_BODY/number, shape (m, 18), as of `part`."""
        rows = [part_motion(s, number, "flex_body") for s in self.segments]
        return np.concatenate(rows or [np.zeros((0, 18))])

    def nodes(self, number: int) -> dict[int, np.ndarray]:
        """Return the motion of the nodes of FE_PART/number by their labels, each of shape (m, 18), as of `part`.

        A node has the axes of its part at the start.
        """
        labels = self.segments[0].model.beams[number]
        return {
            label: np.concatenate([_frame_motion(s, s.model.beams[number][label]) for s in self.segments])
            for label in labels
        }

    @property
    def beams(self) -> tuple[int, ...]:
        """Ids of the FE_PARTs."""
        return tuple(self.segments[0].model.beams) if self.segments else ()

    def modal(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the modal coordinates of FLEX_BODY/number and their rates (1/time), each of shape (m, modes).

        The modes are those of the file without rigid motions, a unit of each what the file has, in its units.
        """
        rows = []
        for s in self.segments:
            name = s.model.names["flex_body", number]
            rates = s.solution.modal_velocities(name) * self.deck.units.time
            rows.append(np.stack([s.solution.modal_coordinates(name), rates]))
        found = np.concatenate(rows, axis=1) if rows else np.zeros((2, 0, 0))
        return found[0], found[1]

    def force(self, kind: str, number: int) -> np.ndarray:
        """Return what an element exerts on the part of its I marker, shape (m, 6), deck units.

        Columns: FX FY FZ TX TY TZ, global components, the torque about the I marker; zero while it is inactive.

        Parameters
        ----------
        kind : str
            Such as "joint", "motion", "sforce", "bushing".
        number : int
        """
        units = self.deck.units
        scale = np.array([units.factor("force")] * 3 + [units.factor("torque")] * 3)
        rows = [s.wrenches.get((kind, number), np.zeros((s.solution.t.size, 6))) for s in self.segments]
        return np.concatenate(rows or [np.zeros((0, 6))]) / scale

    @property
    def variables(self) -> list[int]:
        """Ids of the VARIABLEs whose values are known: all but those left out."""
        known = [set(s.variables) for s in self.segments]
        return [number for number in self.deck.of(st.Variable) if known and all(number in k for k in known)]

    def variable(self, number: int) -> np.ndarray:
        """Return the values of VARIABLE/number, deck units, shape (m,).

        Raises
        ------
        KeyError
            If there is no such variable, or it has been left out.
        """
        if number not in self.variables:
            known = ", ".join(str(k) for k in self.variables)
            raise KeyError(f"there are no values of VARIABLE/{number}; there are those of {known or 'none'}")
        return np.concatenate([s.variables[number] for s in self.segments])

    def tracks(self, number: int) -> np.ndarray:
        """Return where and how the solids of CONTACT/number touched, shape (m, tracks, 28), deck units.

        Points that share one load are one track, which goes on from one output time to the next; zero while it does not
        touch. Columns: `TRACK_COLUMNS`, as ADAMS's postprocessor names them, such as "I_Point.X" and "Slip_Velocity.Z",
        global components, at last "Penetration.Depth".
        """
        parts = [(s.solution.t.size, s.tracks.get(number)) for s in self.segments]
        return track_table(parts, self.deck.units)

    @property
    def track_units(self) -> tuple[str, ...]:
        """The units of the columns of tracks."""
        return self.units_of(TRACK_DIMENSIONS)

    @property
    def elements(self) -> list[tuple[str, int]]:
        """Kind and id of everything whose force is known."""
        return list(dict.fromkeys(key for s in self.segments for key in s.wrenches))

    def request_units(self, number: int) -> tuple[str, ...]:
        """Return the units of the eight columns of REQUEST/number: CUNITS, or those of the quantities."""
        request = self.deck.of(st.Request)[number]
        if request.type is None:
            given = request.cunits
            return tuple(given[k] if k < len(given) and given[k] else "no_units" for k in range(8))
        first, second = st.REQUEST_TYPES[request.type].dimensions
        return (self.unit(first),) * 4 + (self.unit(second),) * 4

    def unit(self, dimension: str) -> str:
        """Return how result files spell the unit of a dimension."""
        return self._units.get(dimension, "no_units")

    @cached_property
    def _units(self) -> dict[str, str]:
        names = unit_names(self.deck.only(st.Units))
        spelled = {q: RESULT_NAMES.get(n, n.lower()) or "no_units" for q, n in names.items()}
        length, time, force = spelled["length"], spelled["time"], spelled["force"]
        return {
            "time": time,
            "length": length,
            "angle": "rad",
            "velocity": f"{length}/{time}",
            "angular_velocity": f"rad/{time}",
            "acceleration": f"{length}/{time}**2",
            "angular_acceleration": f"rad/{time}**2",
            "force": force,
            "torque": f"{force}-{length}",
            "mass": spelled["mass"],
        }

    def units_of(self, dimensions: Iterable[str]) -> tuple[str, ...]:
        """Return how result files spell the units of some dimensions."""
        return tuple(self._units.get(dimension, "no_units") for dimension in dimensions)

    def to_dataset(self) -> xr.Dataset:
        """Return requests, parts and forces as an :class:`xarray.Dataset` in the deck's units.

        The columns of ``part_2`` (X, Y, ...), ``joint_1`` (FX, FY, ...) and ``request_3`` have dimensions with
        their names; coordinates such as ``part_unit`` hold their units: ``data.part_2.sel(part_column="X")``.
        """
        import xarray as xr

        data: dict[str, Any] = {}
        coords: dict[str, Any] = {"time": ("time", self.t, {"units": self.unit("time")})}

        def columns(dimension: str, names: tuple[str, ...], units: tuple[str, ...]) -> tuple[str, str]:
            coords[f"{dimension}_column"] = (f"{dimension}_column", np.array(names, dtype=object))
            coords[f"{dimension}_unit"] = (f"{dimension}_column", np.array(units, dtype=object))
            return ("time", f"{dimension}_column")

        for number, request in self.deck.of(st.Request).items() if self.segments else ():
            names = self.segments[0].requests[number].names
            along = columns(f"request_{number}", unique(names), self.request_units(number))
            title = request.comment or request.name or request.label()
            data[f"request_{number}"] = (along, self.request(number), {"long_name": title})
        for number, part in self.deck.of(st.Part).items() if self.segments else ():
            if not part.ground:
                along = columns("part", PART_COLUMNS, self.units_of(PART_DIMENSIONS))
                data[f"part_{number}"] = (along, self.part(number), {"long_name": part.name or part.label()})
        for number, point in self.deck.of(st.PointMass).items() if self.segments else ():
            units = self.units_of(PART_DIMENSIONS[PART_COLUMNS.index(name)] for name in POINT_COLUMNS)
            along = columns("point_mass", POINT_COLUMNS, units)
            data[f"point_mass_{number}"] = (along, self.point_mass(number), {"long_name": point.name or point.label()})
        for number, body in self.deck.of(st.FlexBody).items() if self.segments else ():
            along = columns("part", PART_COLUMNS, self.units_of(PART_DIMENSIONS))
            data[f"flex_body_{number}"] = (along, self.flexible(number), {"long_name": body.name or body.label()})
            q_f, v_f = self.modal(number)
            modes = ("time", f"flex_body_{number}_mode")
            data[f"flex_body_{number}_modal"] = (modes, q_f, {"long_name": "modal coordinates", "units": "1"})
            data[f"flex_body_{number}_modal_rate"] = (modes, v_f, {"units": f"1/{self.unit('time')}"})
        for number in self.beams:
            beam, found = self.deck.of(st.FePart)[number], self.nodes(number)
            time, component = columns("part", PART_COLUMNS, self.units_of(PART_DIMENSIONS))
            nodes = f"fe_part_{number}_node"
            coords[nodes] = (nodes, np.array(list(found)))
            motion = np.stack(list(found.values()), axis=1)
            data[f"fe_part_{number}"] = ((time, nodes, component), motion, {"long_name": beam.name or beam.label()})
        for kind, number in self.elements:
            along = columns("force", FORCE_COLUMNS, (self.unit("force"),) * 3 + (self.unit("torque"),) * 3)
            data[f"{kind}_{number}"] = (along, self.force(kind, number), {"long_name": f"{kind.upper()}/{number}"})
            tracks = self.tracks(number) if kind == "contact" else np.zeros((0, 0, 0))
            if tracks.size:
                time, component = columns("track", TRACK_COLUMNS, self.track_units)
                data[f"contact_{number}_tracks"] = ((time, f"contact_{number}_track", component), tracks)
        for number in self.variables:
            variable = self.deck.of(st.Variable)[number]
            long_name = {"long_name": variable.name or variable.label()}
            data[f"variable_{number}"] = ("time", self.variable(number), long_name)
        out = xr.Dataset(data, coords=coords)
        out.attrs["title"] = self.deck.title
        out.attrs["units"] = ", ".join(f"{d}: {self.unit(d)}" for d in ("length", "mass", "time", "force", "angle"))
        return out

    def __repr__(self) -> str:
        span = f"{self.t[0]:g} to {self.t[-1]:g}" if self.t.size else "nothing simulated"
        return f"{type(self).__name__}({self.deck.title!r}: {len(self.segments)} analyses, {self.t.size} times, {span})"


PART_COLUMNS = tuple("X Y Z PSI THETA PHI VX VY VZ WX WY WZ ACCX ACCY ACCZ WDX WDY WDZ".split())
POINT_COLUMNS = tuple("X Y Z VX VY VZ ACCX ACCY ACCZ".split())
PART_DIMENSIONS = (
    ("length",) * 3
    + ("angle",) * 3
    + ("velocity",) * 3
    + ("angular_velocity",) * 3
    + ("acceleration",) * 3
    + ("angular_acceleration",) * 3
)
FORCE_COLUMNS = ("FX", "FY", "FZ", "TX", "TY", "TZ")


def unique(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return names of columns in which none stands twice: a second A becomes A_2."""
    found: list[str] = []
    for name in names:
        other, n = name, 1
        while other in found:
            n += 1
            other = f"{name}_{n}"
        found.append(other)
    return tuple(found)


def part_motion(segment: Segment, number: int, kind: str = "part") -> np.ndarray:
    """Return the 18 columns of the frame of a part, or of a ``"flex_body"``, over an analysis, in the deck's units."""
    return _frame_motion(segment, segment.model.names[kind, number])


def _frame_motion(segment: Segment, name: str) -> np.ndarray:
    from gearmbs.dae.equations.rotation import euler_from_matrix

    s = segment.solution
    body = segment.model.mechanism.bodies[name]
    axes = s.orientation(name)
    arm, push, pushed = axes @ body.com, 0.0, 0.0
    if isinstance(body, ModalBody):
        # the centre of mass moves in the body as this deforms
        q_f, v_f, a_f = s.modal_motion(name)
        arm = arm + np.einsum("tij,tj->ti", axes, q_f @ body.mean)
        push = np.einsum("tij,tj->ti", axes, v_f @ body.mean)
        pushed = np.einsum("tij,tj->ti", axes, a_f @ body.mean)
    spin, alpha = s.angular_velocity(name), s.angular_acceleration(name)
    tip = np.cross(spin, arm)
    motion = np.hstack(
        [
            s.com_position(name) - arm,
            np.array([euler_from_matrix(a) for a in axes]),
            s.com_velocity(name) - tip - push,
            spin,
            s.com_acceleration(name) - np.cross(alpha, arm) - np.cross(spin, tip + 2.0 * push) - pushed,
            alpha,
        ]
    )
    units = segment.model.deck.units
    return motion / np.array([units.factor(d) for d in PART_DIMENSIONS])
