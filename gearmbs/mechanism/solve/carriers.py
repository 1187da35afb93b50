"""What carries the axes of wheels in mesh: from there their turns count in a transmission error."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.forces.springs import LineSpring, MatrixForce
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.elements import COMPONENTS, ForceElement, Load
from gearmbs.mechanism.parts.joints import Joint, kinds_with_angle
from gearmbs.mechanism.parts.modal import ModalBody, centre_marker

if TYPE_CHECKING:
    from gearmbs.dae.equations.expressions.tape import Tape

CARRIED = 0.1
"""Part of the centre distance by which a wheel may stand off the line about which what it is on turns, and turn of a
line of centres, rad: no bearing allows as much, and wheels that are off centre are so by less."""
TURNING = ("revolute", "spherical", "self_aligning", "cylindrical", "universal", "constant_velocity", "at_point",
           "inline", "pin_slot", "screw")  # fmt: skip
"""Kinds of joints that hold a point across an axis and let bodies turn about it."""
UNTURNING = ("translational", "orientation")
"""Kinds of joints that let bodies move, and not turn."""
PLACES = re.compile(r"\bD[XYZM]\s*\(", re.IGNORECASE)
"""Functions of the place of a marker: a load without them pushes, and holds nothing where it is."""
OTHERS = ("contact", "friction")
"""Kinds of force elements that hold nothing where it is."""
RESISTS = 1e-6
"""Part of the largest stiffness against turns above which there is one about an axis: rounding of axes is below it."""


class Meshing(Protocol):
    """What is looked at of a mechanism."""

    ground: Body
    bodies: dict[str, Body]
    joints: dict[str, Joint]
    elements: dict[str, Any]
    carriers: dict[str, str]


class Support(NamedTuple):
    """What holds a body on another.

    Attributes
    ----------
    point : ndarray, shape (3,)
        Where, global components, m.
    axis : ndarray, shape (3,), or None
        About which it lets the body turn, if there is one.
    turns : bool
        Whether it does.
    other : str
        Group of bodies that it stands on.
    body : Body
        The one of it.
    """

    point: np.ndarray
    axis: np.ndarray | None
    turns: bool
    other: str
    body: Body


class Supports:
    """What bodies that are fixed to each other, one group each, stand on."""

    def __init__(self, mechanism: Meshing) -> None:
        self.ground = mechanism.ground.name
        self.group = {name: name for name in (self.ground, *mechanism.bodies)}
        for joint in mechanism.joints.values():
            if joint.kind == "fixed":
                one, two = sorted((self.of(joint.i), self.of(joint.j)), key=lambda group: group != self.ground)
                self.group.update([(name, one) for name, group in self.group.items() if group == two])
        joints = [one for one in mechanism.joints.values() if one.kind in (*TURNING, *UNTURNING)]
        self.parts = [joints, [one for one in mechanism.elements.values() if _holds(one)]]
        """Joints, and force elements."""

    def of(self, marker: Marker) -> str:
        """Return the group of a marker's body, of the ground by its name."""
        return self.group[marker.body.name]

    def below(self, group: str, passed: list[str], along: np.ndarray) -> list[Support]:
        """Return what holds a group on others: on the ground if there is such, by joints if there are such.

        Others that have been passed are left out, and those that hang on these alone, unless nothing stands anywhere.
        What holds it from turning does so about ``along``, shape (3,).
        """
        hanging = {*self.group.values()}.difference(passed) if [group] == passed else set()
        for others in (self._standing(passed), hanging):
            for parts in self.parts:
                own = [
                    _support(part, here, there, self.of(there), along)
                    for part in parts
                    for here, there in ((part.i, part.j), (part.j, part.i))
                    if self.of(here) == group and self.of(there) in others
                ]
                if own:
                    return [one for one in own if one.other == self.ground] or own
        return []

    def _standing(self, passed: list[str]) -> set[str]:
        """Return the groups that stand on the ground without some others, the ground among them."""
        pairs = [(self.of(part.i), self.of(part.j)) for parts in self.parts for part in parts]
        pairs = [pair for pair in pairs if not (pair[0] in passed or pair[1] in passed)]
        stands, count = {self.ground}, 0
        while len(stands) > count:
            count = len(stands)
            for one, two in pairs:
                if one in stands or two in stands:
                    stands |= {one, two}
        return stands


def _holds(element: Any) -> bool:
    """Return whether a force element holds a point of a body where it is, as a bearing does."""
    if isinstance(element, Load):
        texts = " ".join(text for text in element.expressions[:3] if text)
        return element.mode == COMPONENTS and PLACES.search(texts) is not None
    if isinstance(element, MatrixForce):
        return bool(np.any(element.stiffness[:3, :3]))
    if isinstance(element, LineSpring):
        return element.stiffness != 0.0
    if not isinstance(element, ForceElement) or element.kind in OTHERS:
        return False
    return element.has_force and len(element.markers) == 2 and pair_of(element) is None


def _support(part: Any, here: Marker, there: Marker, other: str, along: np.ndarray) -> Support:
    axis, turns = None, True
    if isinstance(part, Joint):
        turns = part.kind in TURNING
        axis = part.j.global_orientation()[:, 2] if part.kind in kinds_with_angle() else None
    elif isinstance(part, MatrixForce):
        held, about = part.stiffness[3:, 3:], part.j.global_orientation().T @ along
        turns = bool(about @ held @ about <= RESISTS * np.abs(held).max())
    return Support(here.global_position(), axis, turns, other, there.body)


def _off_line(points: np.ndarray, along: np.ndarray) -> float:
    """Return the largest distance of some points from the line through the first, m."""
    arms = points - points[0]
    return float(np.linalg.norm(arms - np.outer(arms @ along, along), axis=1).max())


def what_carries(supports: Supports, wheel: Marker, mate: Marker, near: float) -> Body | None:
    """Return the body that turns about a line which passes a wheel's centre by more than ``near``; None for none.

    From the wheel's body down to the ground: a group whose supports all lie on one line turns about it. Through the
    wheel's centre it is a shaft, which leaves that where it is; elsewhere it takes it along.
    """
    centre, along = wheel.global_position(), wheel.global_orientation()[:, 2]
    start = supports.of(wheel)
    # not by way of the other wheel, which carries nothing of this one's axis
    aside = {supports.of(mate)} - {supports.ground, start}
    rest, passed, found = [(start, wheel.body)], [start], None
    while rest:
        group, body = rest.pop(0)
        if group == supports.ground:
            return None
        below = [one for one in supports.below(group, passed, along) if one.other not in aside]
        free = not below
        if free or all(one.turns for one in below):
            line = next((one.axis for one in below if one.axis is not None), along)
            points = np.array([one.point for one in below])
            turns = free or _off_line(points, line) <= near
            if turns and (group != start if free else _off_line(np.array([points[0], centre]), line) > near):
                found = found or body
                continue
        for one in below:
            if one.other not in passed:
                passed.append(one.other)
                rest.append((one.other, one.body))
    return found


def carrier_of(mechanism: Meshing, element: Any) -> Body:
    """Return the body from which the turns of the wheels of a mesh count.

    Raises
    ------
    ModelError
        If none is named and the axis of a wheel is carried around by a body that turns about another axis.
    """
    name = mechanism.carriers.get(element.name)
    if name is not None:
        return mechanism.bodies.get(name, mechanism.ground)
    carried = _carried(mechanism, element)
    if carried is not None:
        wheel, carrier = carried
        raise ModelError(
            f"gear contact '{element.name}': the axis of its wheel on '{wheel.body.name}' is carried by "
            f"'{carrier.name}', which turns about another axis; {how_to_name(element.name, carrier.name)}"
        )
    return mechanism.ground


def _carried(mechanism: Meshing, element: Any) -> tuple[Marker, Body] | None:
    """Return a wheel of a mesh whose axis is carried around, and what carries it; None if both stay."""
    supports = Supports(mechanism)
    near = CARRIED * float(np.linalg.norm(element.j.global_position() - element.i.global_position()))
    pairs = ((element.i, element.j), (element.j, element.i))
    found = ((wheel, what_carries(supports, wheel, mate, near)) for wheel, mate in pairs)
    return next(((wheel, body) for wheel, body in found if body is not None), None)


def how_to_name(mesh: str, carrier: str = "body") -> str:
    """Return how to name what carries the wheels of a mesh."""
    return (
        f"name it, gear_contact(..., carrier={carrier}), or where the contact is there already "
        f"mechanism.carriers[{mesh!r}] = '{carrier}': turns of a transmission error count from there"
    )


def unturned(mechanism: Meshing, marker: Marker, element: Any, carrier: Body | None = None) -> Marker:
    """Return the marker of the ground, or a carrier, from which a wheel's turn counts, made if it is not there yet."""
    body, axes = carrier or carrier_of(mechanism, element), marker.global_orientation()
    name = f"{marker.name} plant {'ground' if body.is_ground else 'carrier'}"
    if isinstance(body, ModalBody):
        # its frame, which goes through no node
        return own_marker(body, name, partial(centre_marker, body, axes=body.orientation.T @ axes))
    return own_marker(body, name, body.marker_at, marker.global_position(), axes)


def own_marker(body: Body, name: str, make: Callable[..., Marker], *where: Any) -> Marker:
    """Return the marker of a body that has a name, made by a method of the body if it is not there yet."""
    return next((one for one in body.markers if one.name == name), None) or make(*where, name=name)


def count_from_here(mechanism: Meshing) -> None:
    """Let transmission errors count from where the wheels are now, wherever bodies are moved afterwards."""
    for element in mechanism.elements.values():
        if pair_of(element) is None or (element.name not in mechanism.carriers and _carried(mechanism, element)):
            continue
        for marker in (element.i, element.j):
            unturned(mechanism, marker, element)


def error_tape(bodies: Sequence[int], turning: Sequence[int], still: Sequence[int], element: Any) -> Tape:
    """Return r_b1 phi_1 + s r_b2 phi_2 of a mesh as an expression, of all that differ by base pitches nearest to zero.

    Parameters
    ----------
    bodies : sequence of int
        Row of the kinematics table of every marker.
    turning, still : sequence of int
        Markers of the two wheels, and those from which their turns about the axes z count.
    element
        The mesh.
    """
    # what expressions need is loaded by those who ask for some
    from gearmbs.dae.equations.expressions.tape import TapeBuilder

    b, total = TapeBuilder(bodies), -1
    *both, pitch = levers(element)
    for i, j, lever in zip(turning, still, both, strict=True):
        angle = b.binary(op.ATAN2, b.cosine(i, 0, j, 1), b.cosine(i, 0, j, 0))
        way = b.binary(op.MUL, b.constant(lever), angle)
        total = way if total < 0 else b.binary(op.ADD, total, way)
    pitches = b.unary(op.ANINT, b.binary(op.DIV, total, b.constant(pitch)))
    return b.finish(b.binary(op.SUB, total, b.binary(op.MUL, b.constant(pitch), pitches)))


def pair_of(element: Any) -> Any:
    """Return the two wheels of a gear contact or an ideal mesh, None of other elements."""
    return getattr(element, "pair", None) or getattr(getattr(element, "mesh", None), "pair", None)


def levers(element: Any) -> tuple[float, float, float]:
    """Return r_b1 and s r_b2 of a mesh, s = 1 for external and -1 for internal pairs, and its base pitch."""
    pair = pair_of(element)
    one, two = pair.driver, pair.driven
    return float(one.base_radius), float(two.sign * two.base_radius), float(one.base_pitch)
