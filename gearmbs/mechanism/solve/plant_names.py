"""What the inputs and outputs of a plant stand for in a mechanism, by name."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.inputs import Input, Output
from gearmbs.mechanism.parts.joints import JOINTS, Joint, kinds_with_angle, kinds_with_displacement
from gearmbs.mechanism.parts.modal import ModalBody, centre_marker
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.carriers import levers, own_marker, pair_of, unturned
from gearmbs.mechanism.solve.plant_accelerations import Acceleration
from gearmbs.units import QuantityLike
from gearmbs.wording import any_of, did_you_mean

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism

LEVELS = ("position", "rate", "acceleration")
AXES = ("x", "y", "z")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
COMPONENT = (2, 3, 4, 6, 7, 8)
"""Components of JOINT and its kin: force and torque along x, y and z."""
MOTIONS = {"rotation": "rad", "translation": "m"}
"""Kinds of motions and the units of what they prescribe."""
ACCELERATIONS = {"ACC": False, "WDT": True}
"""Beginnings of the functions that ask for accelerations: whether for angular ones."""


@dataclass(frozen=True)
class Given:
    """An input.

    Attributes
    ----------
    kind : {"input", "force", "torque", "motion", "transmission_error"}
    name, unit : str
    level : int
        By which of its rates it is given.
    base : str
        Unit of the input itself.
    i, j : Marker
        Where a force or torque acts, and where it goes back to; without J it comes from outside.
    axis : int
        Of a force or torque from outside, a global one.
    joints : tuple of Joint
        The motions it is prescribed by.
    element, lever
        The mesh, and r_b2, negative of internal pairs.
    speed : float
        Of its first wheel, rad/s, where an error of its flanks goes with the angle of that; else 0.
    """

    kind: str
    name: str
    unit: str
    level: int = 0
    base: str = ""
    i: Marker | None = None
    j: Marker | None = None
    axis: int = 2
    joints: tuple[Joint, ...] = ()
    element: Any = None
    lever: float = 1.0
    speed: float = 0.0

    def unit_of(self, level: int) -> str:
        """Return the unit of one of its rates."""
        if self.kind == "input":
            return ""
        return f"{self.base}{('', '/s', '/s^2')[level]}"

    @property
    def remedy(self) -> str:
        """What to ask for instead where an output follows a higher rate."""
        if self.kind in ("force", "torque") or (self.kind == "input" and not self.joints):
            return ""
        if self.kind == "input":
            return f"let it prescribe the acceleration, by level='acceleration' of motion '{self.joints[0].name}'"
        place = self.element if self.kind == "transmission_error" else self.joints[0]
        others = LEVELS[self.level + 1 :] or LEVELS[-1:]
        return f"give ({self.kind!r}, {getattr(place, 'name', '')!r}, {any_of(map(repr, others))})"


@dataclass(frozen=True)
class Told:
    """An output: an expression, with the accelerations in it."""

    name: str
    unit: str
    expression: str
    accelerations: tuple[Acceleration, ...] = ()
    period: float = 0.0
    """Its value is known up to whole numbers of this, and told nearest to zero; 0: it is known."""


@dataclass
class PlantNames:
    """Reads the inputs and outputs of a plant; adds markers to bodies that expressions need."""

    mechanism: Mechanism
    _held: dict[tuple[int, bool], Acceleration] = field(default_factory=dict)

    # --- inputs -------------------------------------------------------------------------------------

    def inputs(self, item: Any) -> list[Given]:
        """Return the input that an item stands for.

        Raises
        ------
        ModelError
            One line with what is there.
        """
        if isinstance(item, str | Input):
            return [self._input(item)]
        if isinstance(item, Given):
            return [item]
        known: dict[str, Callable[..., Given]] = {
            "force": self._force, "torque": self._torque, "motion": self._motion,
            "transmission_error": self._transmission_error,
        }  # fmt: skip
        return [self._read("input", item, known)]

    def _input(self, item: str | Input) -> Given:
        """Return an input of the mechanism; it may be the speed or the acceleration that motions prescribe."""
        m = self.mechanism
        name = item if isinstance(item, str) else item.name
        name = m.aliases.get(name, name)
        made = m.inputs.get(name)
        if made is None:
            remedy = (
                _there(name, [*m.inputs, *(k for k, one in m.aliases.items() if one in m.inputs)])
                if m.inputs
                else "add one with Mechanism.input, or give a tuple"
            )
            part, _, field = name.partition(".")
            if part in m.elements and field in ("torque", "force"):
                remedy = f"it is a number of an element: give ({field!r}, {part!r})"
            raise ModelError(f"input {name!r}: the mechanism has no input of this name; {remedy}")
        orders: dict[int, list[Joint]] = {}
        for joint in m.joints.values():
            for row in joint.rows:
                for function in (row.function, row.rotation):
                    if isinstance(function, Input) and function.name == name:
                        orders.setdefault(function.order, []).append(joint)
        if len(orders) > 1:
            names = ", ".join(joint.name for joints in orders.values() for joint in joints)
            raise ModelError(
                f"input {name!r}: motions {names} take it at different levels; give each an input of its own"
            )
        order = max(orders, default=0)
        return Given("input", name, made.unit, order, "", joints=tuple(orders.get(order, ())))

    def _read(self, role: str, item: Any, known: Mapping[str, Callable[..., Any]]) -> Any:
        if not isinstance(item, tuple | list) or not item or not isinstance(item[0], str):
            raise ModelError(f"{role} {item!r}; give a tuple, such as {next(iter(known))!r} and the name of a part")
        kind, *rest = item
        if kind not in known:
            hint = did_you_mean(kind, list(known), shown=repr, otherwise=f"they are {', '.join(known)}")
            raise ModelError(f"{role} {item!r}: there is no {role} of the kind {kind!r}; {hint}")
        try:
            return known[kind](*rest)
        except TypeError as error:
            if "argument" not in str(error) or "_" not in str(error):
                raise
            raise ModelError(f"{role} {item!r}: {len(rest)} entries follow {kind!r}; see Mechanism.linearize") from None
        except ModelError as error:
            raise ModelError(f"{role} {item!r}: {error}") from None

    def _force(self, where: Any, axis: str | None = None) -> Given:
        return self._wrench("force", "N", where, axis)

    def _torque(self, where: Any, axis: str | None = None) -> Given:
        return self._wrench("torque", "N m", where, axis)

    def _wrench(self, kind: str, unit: str, where: Any, axis: str | None) -> Given:
        m = self.mechanism
        name = where if isinstance(where, str) else getattr(where, "name", where)
        between = where if hasattr(where, "i") else m.joints.get(name) or m.elements.get(name)
        # a body has the name of none of its joints and elements
        if axis is None and between is not None:
            for marker in (between.i, between.j):
                self._check_rigid(marker, kind)
            return Given(kind, f"{kind} {between.name}", unit, base=unit, i=between.i, j=between.j)
        if axis is not None and (isinstance(where, Marker | Body) or between is None):
            marker = self._marker(where)
            self._check_rigid(marker, kind)
            return Given(kind, f"{kind} {name} {axis}", unit, base=unit, i=marker, axis=_one_of("axis", axis, AXES))
        if axis is not None:
            raise ModelError(
                f"{name!r} is a {getattr(between, 'kind', 'joint')}, which has its own axis; leave {axis!r} away"
            )
        if name in m.bodies:
            raise ModelError(f"on a body give the axis, too: ({kind!r}, {name!r}, 'x')")
        there = [*m.joints, *m.elements]
        raise ModelError(f"there is no joint or element {name!r}; {_there(name, there)}")

    def _motion(self, motion: Any, level: str = "position") -> Given:
        joint = self._joint(motion)
        if joint.kind not in MOTIONS:
            there = [name for name, one in self.mechanism.joints.items() if one.kind in MOTIONS]
            raise ModelError(
                f"joint {joint.name!r} is {joint.kind}, no motion; the motions are {', '.join(there) or 'none'}"
            )
        k = _one_of("level", level, LEVELS)
        base = MOTIONS[joint.kind]
        one = Given("motion", f"motion {joint.name}", base, k, base, joints=(joint,))
        return _at_level(one)

    def _transmission_error(self, mesh: Any, level: str = "position", speed: QuantityLike | None = None) -> Given:
        element = self._mesh(mesh)
        turns = 0.0
        if speed is not None:
            label = f"transmission_error '{element.name}': the speed of its first wheel"
            turns = quantity(speed, "rad/s", label)
            if not (np.isfinite(turns) and turns):
                raise ModelError(f"{label} is {turns:g} rad/s; give the one that it turns at, or leave it out")
        name = f"transmission_error {element.name}{' of the angle' if turns else ''}"
        one = Given(
            "transmission_error", name, "m", _one_of("level", level, LEVELS), "m", element=element,
            lever=levers(element)[1], speed=turns,
        )  # fmt: skip
        return _at_level(one)

    # --- outputs ------------------------------------------------------------------------------------

    def outputs(self, item: Any) -> list[Told]:
        """Return the outputs that an item stands for.

        Raises
        ------
        ModelError
            One line with what is there.
        """
        named = self.mechanism.outputs.get(item) if isinstance(item, str) else item
        if isinstance(named, Output):
            text = named.text
            parts = self.outputs(named.what) if text is None else [self._expression(text)]
            return [replace(parts[0], name=named.name)] if len(parts) == 1 else parts
        if isinstance(item, str):
            from gearmbs.mechanism.language.lowering import CONSTANTS

            m = self.mechanism
            if (
                item.isidentifier()
                and item.upper() not in {"TIME", *CONSTANTS}
                and item not in {**m.inputs, **m.parameters}
            ):
                remedy = _there(item, list(m.outputs)) if m.outputs else "add one with Mechanism.output"
                raise ModelError(f"output {item!r}: the mechanism has no output of this name; {remedy}")
            return [self._expression(item)]
        if isinstance(item, Told):
            one = self._expression(item.expression)
            return [replace(item, expression=one.expression, accelerations=one.accelerations)]
        known: dict[str, Callable[..., list[Told]]] = {
            "joint_angle": self._angle, "joint_displacement": self._displacement, "joint_rate": self._rate,
            "com_position": self._vector("com_position", "D", "m"),
            "com_velocity": self._vector("com_velocity", "V", "m/s"),
            "com_acceleration": self._vector("com_acceleration", "ACC", "m/s^2"),
            "angular_velocity": self._vector("angular_velocity", "W", "rad/s"),
            "angular_acceleration": self._vector("angular_acceleration", "WDT", "rad/s^2"),
            "marker_position": self._vector("marker_position", "D", "m"),
            "marker_velocity": self._vector("marker_velocity", "V", "m/s"),
            "marker_acceleration": self._vector("marker_acceleration", "ACC", "m/s^2"),
            "reaction": self._reaction, "reaction_force": self._reaction_force, "load": self._load,
            "state": self._state, "transmission_error": self._error,
        }  # fmt: skip
        return self._read("output", item, known)

    def _expression(self, text: str) -> Told:
        """Return an expression in which states stand for the accelerations of markers."""
        from gearmbs.mechanism.compile import scope_of
        from gearmbs.mechanism.language.library import compile_expression
        from gearmbs.mechanism.language.syntax import Call, parse

        try:
            parse(text)
        except ExpressionError as error:
            raise ModelError(f"output {text!r}: {error}") from None
        asked: dict[tuple[int, bool], Acceleration] = {}
        out, rest = "", text
        while True:
            found = _first_call(rest, ACCELERATIONS)
            if found is None:
                break
            start, end, name = found
            try:
                # the states that take its place would hide a marker that is not there
                compile_expression(rest[start:end], scope_of(self.mechanism)[0], accelerations=True)
            except ExpressionError as error:
                raise ModelError(f"output {text!r}: {error}") from None
            call = parse(rest[start:end])
            assert isinstance(call, Call)
            out += rest[:start] + self._substitute(text, name, call, asked)
            rest = rest[end:]
        return Told(text, "", out + rest, tuple(asked.values()))

    def _substitute(self, text: str, name: str, call: Any, asked: dict[tuple[int, bool], Acceleration]) -> str:
        """Return what takes the place of ACCX(i, j, k, l) and its kin: components of vectors along axes of k."""
        angular, magnitude = ACCELERATIONS[name[:3]], name.endswith("M")
        refs = [getattr(arg, "text", None) for arg in call.args] + [None] * 4
        numbers = [getattr(arg, "integer", None) for arg in call.args] + [None] * 4
        markers = [self._named(ref, number) for ref, number in zip(refs, numbers)]
        i, j = markers[0], markers[1]
        along, seen = (None, markers[2]) if magnitude else (markers[2], markers[3])
        if seen is not None and not seen.body.is_ground:
            raise ModelError(f"output {text!r}: {name} seen from '{seen.name}', which moves, is no output of a plant")
        sides: list[tuple[str, ...]] = []
        for marker in (i, j):
            if marker is None or marker.body.is_ground:
                sides.append(("0", "0", "0"))
            else:
                one = self._acceleration(marker, angular)
                asked[id(marker), angular] = one
                sides.append(tuple(f'DIF("{label}")' for label in one.labels))
        parts = [f"({a} - {b})" for a, b in zip(*sides, strict=True)]
        if magnitude:
            return f"SQRT({' + '.join(f'{part}**2' for part in parts)})"
        k = "XYZ".index(name[3])
        if along is None:
            return parts[k]
        if isinstance(along.body, ModalBody):
            raise ModelError(
                f"output {text!r}: its components are along axes of '{along.name}' on '{along.body.name}', which "
                "deforms; take axes of a rigid body or of the ground"
            )
        place = along.position + along.orientation[:, k]
        tip = own_marker(along.body, f"{along.name} plant tip {k}", along.body.marker, place)
        shown = [f'D{c}("{tip.name}", "{along.name}")' for c in "XYZ"]
        return f"({' + '.join(f'{part}*{cosine}' for part, cosine in zip(parts, shown, strict=True))})"

    def _acceleration(self, marker: Marker, angular: bool) -> Acceleration:
        key = id(marker), angular
        if key not in self._held:
            labels = tuple(f"plant acceleration {len(self._held)} {c}" for c in AXES)
            self._held[key] = Acceleration(marker, angular, labels)  # type: ignore[arg-type]
        return self._held[key]

    def _vector(self, kind: str, function: str, unit: str) -> Callable[..., list[Told]]:
        def read(where: Any, component: str | None = None) -> list[Told]:
            if kind.startswith("marker"):
                marker = self._marker(where, of_body=False)
            else:
                marker = self._marker(where)
            name = where if isinstance(where, str) else where.name
            axes = AXES if component is None else (AXES[_one_of("component", component, AXES)],)
            told = [self._expression(f'{function}{c.upper()}("{marker.name}")') for c in axes]
            return [Told(f"{kind} {name} {c}", unit, one.expression, one.accelerations) for c, one in zip(axes, told)]

        return read

    def _angle(self, joint: Any) -> list[Told]:
        one = self._of_kind(joint, kinds_with_angle(), "angle")
        return [Told(f"joint_angle {one.name}", "rad", f'AZ("{one.i.name}", "{one.j.name}")')]

    def _displacement(self, joint: Any) -> list[Told]:
        one = self._of_kind(joint, kinds_with_displacement(), "displacement")
        return [Told(f"joint_displacement {one.name}", "m", f'DZ("{one.i.name}", "{one.j.name}", "{one.j.name}")')]

    def _rate(self, joint: Any) -> list[Told]:
        one = self._of_kind(joint, [*kinds_with_angle(), *kinds_with_displacement()], "rate")
        i, j = one.i.name, one.j.name
        if one.kind in kinds_with_angle():
            return [Told(f"joint_rate {one.name}", "rad/s", f'WZ("{i}", "{j}", "{j}")')]
        return [Told(f"joint_rate {one.name}", "m/s", f'VZ("{i}", "{j}", "{j}", "{j}")')]

    def _reaction(self, joint: Any, component: str | None = None) -> list[Told]:
        from gearmbs.mechanism.compile import REACTION_KINDS

        one = self._joint(joint)
        function = REACTION_KINDS.get(one.kind, ("joint" if one.kind in JOINTS or one.kind == "screw" else "jprim",))[0]
        told = []
        for k in _components(component):
            text = f'{function.upper()}("{one.name}", 0, {COMPONENT[k]})'
            told.append(Told(f"reaction {one.name} {WRENCH[k]}", "N" if k < 3 else "N m", text))
        return told

    def _reaction_force(self, joint: Any, component: str | None = None) -> list[Told]:
        parts = self._reaction(joint)[: len(AXES)]
        return parts if component is None else [parts[_one_of("component", component, AXES)]]

    def _load(self, element: Any, component: str | None = None) -> list[Told]:
        m = self.mechanism
        name = element if isinstance(element, str) else getattr(element, "name", element)
        one = m.elements.get(name)
        if one is None:
            raise ModelError(f"there is no element {name!r}; {_there(name, list(m.elements))}")
        pair = {id(one.i), id(one.j)}
        parts = [*m.joints.values(), *m.elements.values()]
        sharing = [other.name for other in parts if other is not one and {id(other.i), id(other.j)} == pair]
        if sharing or len(one.markers) != 2:
            why = f"its markers are also those of '{sharing[0]}'" if sharing else "it has not two markers"
            raise ModelError(f"the load of '{name}' cannot be told apart: {why}; give each its own two markers")
        absent = {True: one.has_force, False: one.has_torque}
        return [
            Told(
                f"load {name} {WRENCH[k]}", "N" if k < 3 else "N m",
                f'{WRENCH[k].upper()}("{one.i.name}", "{one.j.name}")' if absent[k < 3] else "0",
            )
            for k in _components(component)
        ]  # fmt: skip

    def _state(self, state: Any) -> list[Told]:
        m = self.mechanism
        name = getattr(state, "name", state)
        known = {s_name: s for s_name, s in zip(m.state_names, m.every_state, strict=True)}
        if name not in known:
            raise ModelError(f"there is no state {name!r}; {_there(name, list(known))}")
        function = "VARVAL" if known[name].algebraic else "DIF"
        return [Told(f"state {name}", "", f'{function}("{name}")')]

    def _error(self, mesh: Any) -> list[Told]:
        element = self._mesh(mesh)
        parts, (*both, pitch) = [], levers(element)
        for marker, lever in zip((element.i, element.j), both, strict=True):
            at = unturned(self.mechanism, marker, element)
            parts.append(f'{lever!r}*AZ("{marker.name}", "{at.name}")')
        return [Told(f"transmission_error {element.name}", "m", " + ".join(parts), period=pitch)]

    # --- what is there ------------------------------------------------------------------------------

    def _joint(self, joint: Any) -> Joint:
        name = getattr(joint, "name", joint)
        found = self.mechanism.joints.get(name)
        if found is None:
            raise ModelError(f"there is no joint {name!r}; {_there(name, list(self.mechanism.joints))}")
        return found

    def _of_kind(self, joint: Any, kinds: Collection[str], what: str) -> Joint:
        found = self._joint(joint)
        if found.kind not in kinds:
            raise ModelError(
                f"joint '{found.name}' is {found.kind}; {what} is for {any_of(dict.fromkeys(kinds))} joints"
            )
        return found

    def _mesh(self, mesh: Any) -> Any:
        name = getattr(mesh, "name", mesh)
        meshes = {n: e for n, e in self.mechanism.elements.items() if pair_of(e) is not None}
        if name not in meshes:
            raise ModelError(f"there is no gear contact {name!r}; {_there(name, list(meshes))}")
        return meshes[name]

    def _marker(self, where: Any, of_body: bool = True) -> Marker:
        """Return a marker by name, or one at the centre of mass of a body, made for it."""
        m = self.mechanism
        if isinstance(where, Marker):
            return where
        body = where if isinstance(where, Body) else m.bodies.get(where) if of_body else None
        if body is not None:
            return self._centre(body)
        found = self._named(where, None)
        if found is None:
            there = [
                *(m.bodies if of_body else ()),
                *(one.name for b in (m.ground, *m.bodies.values()) for one in b.markers),
            ]
            what = "body or marker" if of_body else "marker"
            raise ModelError(f"there is no {what} {where!r}; {_there(where, there)}")
        return found

    def _centre(self, body: Body) -> Marker:
        name = f"{body.name} plant centre"
        if isinstance(body, ModalBody):
            # the material there deforms, and what a solution tells of the body is its frame
            return own_marker(body, name, partial(centre_marker, body))
        return own_marker(body, name, body.marker, body.com)

    def _named(self, name: str | None, number: int | None) -> Marker | None:
        for body in (self.mechanism.ground, *self.mechanism.bodies.values()):
            for one in body.markers:
                if (name is not None and one.name.upper() == name.upper()) or (number and one.number == number):
                    return one
        return None

    def _check_rigid(self, marker: Marker, kind: str) -> None:
        if isinstance(marker.body, ModalBody):
            raise ModelError(
                f"'{marker.body.name}' deforms, so that a {kind} also acts on its modes; fix a body to '{marker.name}' "
                "and give this one"
            )


def _at_level(given: Given) -> Given:
    name = given.name if given.level == 0 else f"{given.name} {LEVELS[given.level]}"
    return replace(given, name=name, unit=given.unit_of(given.level))


def _one_of(what: str, value: Any, known: Collection[str]) -> int:
    names = list(known)
    if value not in names:
        raise ModelError(f"{what} {value!r}; choose {any_of(map(repr, names))}")
    return names.index(value)


def _components(component: str | None) -> list[int]:
    return list(range(len(WRENCH))) if component is None else [_one_of("component", component, WRENCH)]


def _there(name: Any, names: list[str]) -> str:
    return did_you_mean(str(name), names, shown=repr, otherwise=f"there are {', '.join(names) or 'none'}")


def has_phase(element: Any) -> bool:
    """Return whether an element is a mesh whose force depends on where teeth are in their cycle."""
    mesh: Any = getattr(element, "mesh", None)
    if getattr(mesh, "pair", None) is not None:
        return mesh.stiffness_curve is not None or mesh.error is not None
    return bool(getattr(element, "pair", None) or getattr(element, "pairs", None))


def _first_call(text: str, beginnings: Collection[str]) -> tuple[int, int, str] | None:
    """Return where the first call of a function with one of the beginnings stands, its end, and its name."""
    pattern = rf"(?<![A-Za-z0-9_.$\"'])({'|'.join(beginnings)})([XYZM])\s*\("
    found = re.search(pattern, text, re.IGNORECASE)
    if found is None:
        return None
    depth = 0
    for k in range(found.end() - 1, len(text)):
        depth += (text[k] == "(") - (text[k] == ")")
        if depth == 0:
            return found.start(), k + 1, found.group(0).rstrip("( \t").upper()
    return None


__all__ = ["LEVELS", "Given", "PlantNames", "Told", "has_phase"]
