"""Parts, markers, names and data of a deck into a mechanism; what constraints and forces are added with.

The mechanism keeps the deck's units in its expressions (``Mechanism.units``); its numbers are SI.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace as replaced
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.adams.builders.control import diff_name, implicit_states, state_system
from gearmbs.adams.builders.scopes import (
    FUNCTIONS,
    Accelerations,
    AdamsModel,
    Beam,
    BodyState,
    Present,
    acting,
    acts,
    joints_of,
    marker_pair,
    resting_joint,
    sensor_state,
    translated,
    with_name,
)
from gearmbs.adams.errors import ERROR, UNSUPPORTED, WARNING, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.check import MARKER_FIELDS
from gearmbs.adams.parse.data import curve_points, spline_data
from gearmbs.adams.parse.deck import Deck, read_variables
from gearmbs.dae.equations.expressions import SplineData
from gearmbs.dae.equations.rotation import matrix_from_euler
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.language.syntax import Call, Node
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.curves import add_curve
from gearmbs.mechanism.parts.elements import State
from gearmbs.mechanism.parts.joints import Joint

if TYPE_CHECKING:
    from pathlib import Path

    from gearmbs.flexible import ModalModel
    from gearmbs.mechanism.contacts.shapes import Shape
    from gearmbs.solids.bodies import Body as SolidBody

Maker = Callable[["Builder", Any], None]
"""What adds a statement of one kind to a builder's mechanism."""

PARALLEL = 1e-10
"""Sine of the angle between the axis and the second direction below which the two give no plane, as rounding of
points."""


class LeftOutError(LookupError):
    """An element needs what was left out, since it is not supported."""


class Markers(dict[int, Marker]):
    """The markers of a deck that were built, by id."""

    def __missing__(self, ref: int) -> Marker:
        raise LeftOutError(f"with MARKER/{ref}, whose part is left out,")


class Builder:
    """Adds a deck's statements to a mechanism one by one; use :func:`build_model`."""

    def __init__(
        self,
        deck: Deck,
        inactive: frozenset[tuple[str, int]],
        state: Mapping[tuple[str, int], BodyState],
        span: tuple[float, float],
        present: Present,
    ) -> None:
        self.deck = deck
        self.present = present
        self.span = span
        self.state = state
        self.units = deck.units
        self.inactive = inactive
        self.mechanism = Mechanism(deck.title or "adams")
        self.mechanism.units = deck.units
        # in decks a text is an expression in the deck's units, and checked with its line
        self.mechanism.reads_units = False
        self.mechanism.redundancy = "adams"
        self.model = AdamsModel(self.mechanism, deck, present=present)
        self.markers = Markers()
        self.accelerations = Accelerations(self.mechanism, self.markers)
        self.joints: dict[int, Joint] = {}
        self.flexible: dict[int, ModalModel] = {}
        self.solid_files: dict[Path, list[SolidBody]] = {}
        self.solids: dict[tuple[Path, int], Shape] = {}
        self.beams: dict[int, Beam] = {}
        self.problems: list[Diagnostic] = []
        self.left_out: set[tuple[str, int]] = set()
        self._taken: set[str] = {"ground"}

    def add_bodies(self, bodies: Mapping[type, Maker], markers: Mapping[str, Maker]) -> bool:
        """Add gravity, parts, point masses, flexible bodies and markers; return whether elements may follow.

        Parameters
        ----------
        bodies : mapping of type to callable
            What adds bodies that deform, by their statement.
        markers : mapping of str to callable
            What adds markers on them, by the name of the statement.
        """
        gravity = self.deck.only(st.Accgrav)
        if gravity is not None and ("ACCGRAV", 0) not in self.inactive:
            scale = self.units.factor("acceleration")
            self.mechanism.gravity = scale * np.array([gravity.igrav, gravity.jgrav, gravity.kgrav])
        for part in self.deck.of(st.Part).values():
            self.attempt(part, self.add_part)
        for point in self.deck.of(st.PointMass).values():
            self.attempt(point, self.add_point_mass)
        for kind, make in bodies.items():
            deforming: Mapping[int, st.Statement] = self.deck.of(kind)
            for statement in deforming.values():
                self.attempt(statement, partial(make, self))
        for marker in self.deck.of(st.Marker).values():
            owner = marker.owner()
            if owner in self.left_out:
                self.left_out.add(("MARKER", marker.id))
                continue
            on_node = markers.get(owner[0])
            self.attempt(marker, partial(on_node, self) if on_node is not None else self.add_marker)
        return not any(d.severity == ERROR for d in self.problems)

    # --- helpers ------------------------------------------------------------------------------------

    def active(self, kind: type[Any]) -> list[Any]:
        return self._acting.get(kind, [])

    @cached_property
    def _acting(self) -> dict[type[st.Statement], list[Any]]:
        return acting(self.deck, self.inactive)

    def absent_marker(self, statement: st.Statement) -> int | None:
        """Return a marker of a statement that is left out with what it is on; None without one."""
        refs = [getattr(statement, name, None) for name in MARKER_FIELDS]
        return next((ref for ref in refs if ("MARKER", ref) in self.left_out), None)

    def attempt(self, statement: st.Statement, add: Callable[[Any], None]) -> None:
        """Add one statement; what is wrong with it gets its line, and so does what it warns of."""
        with warnings.catch_warnings(record=True) as warned, np.errstate(over="raise"):
            warnings.simplefilter("always")
            try:
                if self.left_out:
                    self._refuse_without(statement)
                add(statement)
            except (ModelError, ValueError) as error:
                self.remark(ERROR, statement, str(error))
            except LeftOutError as error:
                self.left_out.add((statement.keyword, statement.id))
                self.unsupported(statement, str(error))
            except ArithmeticError:
                self.remark(ERROR, statement, "its numbers are too large or too small to compute with")
        for warning in warned:
            self.remark(WARNING, statement, str(warning.message))

    def _refuse_without(self, statement: st.Statement) -> None:
        """Raise a LeftOutError if a statement needs a joint or a marker that is left out."""
        missing = [ref for ref in joints_of(statement) if ("JOINT", ref) in self.left_out]
        if missing:
            raise LeftOutError(f"with JOINT/{missing[0]}, which is left out,")
        absent = self.absent_marker(statement)
        if absent is not None:
            raise LeftOutError(f"at MARKER/{absent}, which is left out,")

    def remark(self, severity: str, statement: st.Statement, what: str, joiner: str = ": ") -> None:
        self.problems.append(Diagnostic(severity, f"{statement.label()}{joiner}{what}", self.deck.file, statement.line))

    def unsupported(self, statement: st.Statement, what: str) -> None:
        self.remark(UNSUPPORTED, statement, f"{what} is not supported")

    def claim(self, statement: st.Statement, kind: str) -> str:
        """Return a unique name for a statement and remember it."""
        keyword = statement.keyword
        name = (statement.name or f"{keyword}_{statement.id}").replace('"', "'")
        while name in self._taken:
            name = f"{name}_{keyword}_{statement.id}"
        self._taken.add(name)
        self.model.names[kind, statement.id] = name
        self.model.sources[name] = statement
        return name

    def name_elements(self) -> None:
        """Name everything that transmits a force before any expression refers to it."""
        for cls, kind in st.KINDS.items():
            if cls not in self.deck.items:
                continue
            for statement in self.active(cls):
                self.claim(statement, kind)
            for statement in self.deck.of(cls).values():
                self.model.pairs[kind, statement.id] = marker_pair(self.deck, statement)
                joint = resting_joint(statement, self.inactive)
                if joint is not None and (cls.keyword, statement.id) not in self.inactive:
                    self.remark(WARNING, statement, f"rests while JOINT/{joint} is inactive", " ")

    def text(self, source: str) -> str:
        """Return an expression with element ids replaced by the mechanism's names."""

        def rename(call: Call) -> Node:
            return self.accelerations.call(call) if call.name in FUNCTIONS else with_name(self.model, call)

        return translated(self.deck, self.present, source, rename)

    # --- parts and markers --------------------------------------------------------------------------

    def add_part(self, part: st.Part) -> None:
        if part.ground:
            self.model.names["part", part.id] = "ground"
            return
        name = self.claim(part, "part")
        units = self.units
        markers = self.deck.of(st.Marker)
        axes = part_orientation(part)
        com, inertia = np.zeros(3), np.zeros((3, 3))
        cm = markers[part.cm] if part.cm is not None else None
        if cm is not None:
            com = units.length * np.array(cm.qp)
            im = markers[part.im] if part.im is not None else cm
            inertia = units.factor("inertia") * inertia_about_cm(part, cm, im)
        spin = self.direction(part.wm, part, axes, cm) @ np.array([part.wx, part.wy, part.wz])
        spin = units.factor("angular_velocity") * spin
        velocity = np.array([part.vx, part.vy, part.vz])
        if part.vm is not None:
            velocity = self.direction(part.vm, part, axes, cm) @ velocity
        velocity = units.factor("velocity") * velocity
        start = self.state.get(("PART", part.id))
        if start is None:
            position = units.length * np.array(part.qg)
            start = BodyState(position, axes, velocity - np.cross(spin, axes @ com), spin)
        body = self.mechanism.body(
            name,
            units.mass * part.mass,
            inertia,
            com=com,
            position=start.position,
            orientation=start.orientation,
            velocity=start.velocity,
            angular_velocity=start.angular_velocity,
        )
        self.model.sources[body.name] = part
        if self.rests(part):
            self.remark(WARNING, part, "has no mass, and nothing acts on it: it rests where it is", " ")
            hold(self.mechanism, body, "fixed")
        elif part.planar:
            hold(self.mechanism, body, "planar")

    def rests(self, part: st.Part) -> bool:
        """Return whether a part has neither inertia nor speed, and nothing that could move it names a marker of it."""
        if part.mass or any(part.ip or ()) or any((part.vx, part.vy, part.vz, part.wx, part.wy, part.wz)):
            return False
        return not any(owner == ("PART", part.id) for owner in self._acted_on)

    @cached_property
    def _acted_on(self) -> set[tuple[str, int | None]]:
        """What the markers are on that forces, constraints, curves and solids that touch name."""
        touching = {ref for s in self.deck.of(st.Contact).values() for ref in (*s.igeom, *s.jgeom)}
        acting = [s for kind, group in self.deck.items.items() if kind.switch == "acts" for s in group.values()]
        acting += [s for s in self.deck.of(st.Graphics).values() if s.id in touching]
        refs = {getattr(s, name, None) for s in acting for name in MARKER_FIELDS}
        # a general constraint holds what its function names
        refs |= {int(n) for s in self.deck.of(st.Gcon).values() for n in re.findall(r"\d{1,18}", s.function or "")}
        return {marker.owner() for marker in self.deck.of(st.Marker).values() if marker.id in refs}

    def add_point_mass(self, s: st.PointMass) -> None:
        """POINT_MASS."""
        name = self.claim(s, "point_mass")
        units = self.units
        cm = self.deck.of(st.Marker).get(s.cm or 0)
        com = np.zeros(3) if cm is None else units.length * np.array(cm.qp)
        start = self.state.get(("POINT_MASS", s.id))
        if start is None:
            velocity = units.factor("velocity") * np.array([s.vx, s.vy, s.vz])
            start = BodyState(units.length * np.array(s.qg), part_orientation(s), velocity, np.zeros(3))
        body = self.mechanism.point_mass(
            name,
            units.mass * s.mass,
            at=start.position,
            velocity=start.velocity,
            com=com,
            orientation=start.orientation,
        )
        self.model.sources[body.name] = s

    def direction(
        self, ref: int | None, part: st.Part | st.FlexBody, axes: np.ndarray, cm: st.Marker | None
    ) -> np.ndarray:
        """Return the axes along which an initial velocity is given: a marker's, by default the CM marker's."""
        marker = self.deck.of(st.Marker)[ref] if ref is not None else cm
        if marker is None:
            return np.eye(3)
        keyword, number = marker.owner()
        owner: Any = self.deck.of(st.STATEMENTS[keyword])[number or 0]
        ground = isinstance(owner, st.Part) and owner.ground
        own = np.eye(3) if ground else (axes if owner is part else part_orientation(owner))
        return own @ marker_orientation(marker)

    def add_marker(self, statement: st.Marker) -> None:
        keyword, number = statement.owner()
        owner = self.model.names.get((keyword.lower(), number or 0))
        if owner is None:
            return
        body = self.mechanism.ground if owner == "ground" else self.mechanism.bodies.get(owner)
        if body is None:
            # its part could not be built, which is reported
            return
        self.put_marker(statement, body, self.units.length * np.array(statement.qp), marker_orientation(statement))

    def put_marker(self, statement: st.Marker, body: Body, position: np.ndarray, axes: np.ndarray) -> None:
        """Put a marker on a body, m in its frame, and remember its number."""
        name = self.claim(statement, "marker")
        marker = body.marker(position, axes, name=name)
        marker.number = statement.id
        self.markers[statement.id] = marker

    def ground_marker(self, name: str) -> Marker:
        """Return a marker on the ground that takes the reaction of an action-only force."""
        return self.mechanism.ground.marker(name=name)

    # --- data ---------------------------------------------------------------------------------------

    def add_data(self) -> None:
        m = self.mechanism
        read = read_variables(self.deck, requests=False)
        m.functions.update(self.deck.functions)
        for variable in self.deck.of(st.Variable).values():
            if variable.id in read:
                self.attempt(variable, lambda v: m.variables.update({v.id: self.text(v.function or "0")}))
            else:
                m.variables[variable.id] = variable.function or "0"
        for array in self.deck.of(st.Array).values():
            m.arrays[array.id] = array.numbers
        for plant in self.deck.each(st.Plant):
            m.plants[plant.keyword.lower(), plant.id] = plant.variables
        for spline in self.deck.of(st.Spline).values():
            if spline.data_file is None:
                m.splines[spline.id] = spline_data(spline)
        for curve in self.deck.of(st.CurveStatement).values():
            if curve.sampled or curve.matrix in self.deck.of(st.Matrix):
                self.attempt(curve, self.add_curve)
        for diff in self.active(st.Diff):
            self.attempt(diff, self.add_diff)
        for system in self.deck.each(st.System):
            if acts(system, self.inactive):
                self.attempt(system, self.add_state_system)
        for sensor in self.active(st.Sensor):
            self.attempt(sensor, self.add_sensor)

    def add_sensor(self, sensor: st.Sensor) -> None:
        """SENSOR: its function is followed as a state of its own."""
        self.mechanism.algebraic_state(sensor_state(sensor.id), self.text(sensor.function or "0"))

    def add_curve(self, curve: st.CurveStatement) -> None:
        """Add a curve by its length, and one by a routine by its own parameter, too."""
        add_curve(self.mechanism, f"CURVE_{curve.id}", curve_points(self.deck, curve.id))
        if curve.sampled:
            alpha, *rows = np.array(curve.sampled).T
            for axis, values in zip("XYZ", rows):
                self.mechanism.splines[f"CURVE_{curve.id}.BY.{axis}"] = SplineData(tuple(alpha), (tuple(values),))

    def add_diff(self, diff: st.Diff) -> None:
        """Add the state of a DIFF, with IMPLICIT the one of its rate, too."""
        states, text = self.mechanism.states, self.text(diff.function or "0")
        if diff.implicit:
            states.update(implicit_states(diff, text, self.units.time))
        else:
            states[diff.id] = State(diff_name(diff), f"({text})/{self.units.time!r}", diff.ic[0])

    def add_state_system(self, statement: st.System) -> None:
        """Add the states of an LSE, TFSISO or GSE."""
        system, states = state_system(self.deck, statement), self.mechanism.states
        for name, rate, start in zip(system.names, system.rates(), system.start):
            if rate is not None:
                states[name] = State(name, f"({self.text(rate)})/{self.units.time!r}", float(start))
        for state in system.algebraic:
            states[state.name] = replaced(state, expression=self.text(state.expression))


# Where parts and markers are: Euler angles, or points on axes, as rotation matrices.


def axes_from_points(
    origin: Sequence[float], z_point: Sequence[float] | None, x_point: Sequence[float] | None, x_first: bool
) -> np.ndarray:
    """Return the axes (columns) of a frame from a point on z and a point in the xz plane.

    With ``x_first`` the x axis passes through ``x_point`` and ``z_point`` lies in the xz plane (USEXP).  A missing
    point leaves that axis along the parent's, or as near to it as the other axis allows.

    Raises
    ------
    ValueError
        If a point coincides with the origin.
    """
    base = np.asarray(origin, dtype=float)
    z = np.array([0.0, 0.0, 1.0]) if z_point is None else np.asarray(z_point) - base
    x = np.array([1.0, 0.0, 0.0]) if x_point is None else np.asarray(x_point) - base
    first, second = (x, z) if x_first else (z, x)
    spare = np.array([0.0, 1.0, 0.0])
    if np.linalg.norm(first) == 0.0:
        raise ValueError("the point on the axis coincides with the origin")
    first = first / np.linalg.norm(first)
    if float(np.linalg.norm(np.cross(first, second))) <= PARALLEL * float(np.linalg.norm(second)):
        second = spare if abs(first @ spare) < 0.9 else np.array([0.0, 0.0, 1.0])
    second = second - first * (first @ second)
    second = second / np.linalg.norm(second)
    x, z = (first, second) if x_first else (second, first)
    return np.column_stack([x, np.cross(z, x), z])


def part_orientation(part: st.Part | st.FlexBody | st.FePart | st.PointMass) -> np.ndarray:
    """Return the axes of a part's frame at the start, global components."""
    if part.zg is not None or part.xg is not None:
        return axes_from_points(part.qg, part.zg, part.xg, False)
    return matrix_from_euler(*(part.reuler or (0.0, 0.0, 0.0)))


def marker_orientation(marker: st.Marker) -> np.ndarray:
    """Return the axes of a marker in its part's frame."""
    if marker.reuler is not None:
        return matrix_from_euler(*marker.reuler)
    if marker.zp is None and marker.xp is None:
        return np.eye(3)
    return axes_from_points(marker.qp, marker.zp, marker.xp, marker.usexp)


def inertia_about_cm(part: st.Part, cm: st.Marker, im: st.Marker) -> np.ndarray:
    """Return the inertia about the centre of mass in the part's axes, in the deck's units.

    IP holds the moments and the products (positive integrals) about the origin of IM along its axes.
    """
    xx, yy, zz, xy, xz, yz = (*(part.ip or (0.0, 0.0, 0.0)), 0.0, 0.0, 0.0)[:6]
    local = np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]])
    axes = marker_orientation(im)
    tensor = axes @ local @ axes.T
    d = np.array(cm.qp) - np.array(im.qp)
    return tensor - part.mass * ((d @ d) * np.eye(3) - np.outer(d, d))


# PART with PLANAR: it keeps the plane it starts in, parallel to xy of the ground, by a joint.


def hold(mechanism: Mechanism, body: Body, kind: str, normal: int = 2) -> None:
    """Hold a body to the ground by a joint, where the body starts; its z is the given axis of the ground."""
    at = body.centre_of_mass()[0]
    name = f"{body.name}.{kind}"
    axes = np.roll(np.eye(3), 2 - normal, axis=1)
    i, j = (owner.marker_at(at, axes, name=f"{name} {owner.name}") for owner in (body, mechanism.ground))
    mechanism.joint(kind, name, i, j)
