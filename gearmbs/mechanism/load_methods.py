"""Loads of a Mechanism: forces and torques by expressions, springs, bushings, fields, beams, and distributed loads.

A load distributed over a body with modal coordinates is a force F and a torque T on its frame, and a force Q_k on each
mode. F and T act at a marker that is the frame itself, without shapes. Q acts as a torque about one axis between two
markers there, of which one turns about this axis by psi_k = Q_k / max |Q| for one unit of mode k: the virtual work of
the torque max |Q| is sum Q_k dq_k, and, since the axis does not turn, nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.forces.springs import SI_UNITS, AxisSpring, Beam, Bushing, Field, LineSpring, MatrixForce, in_si
from gearmbs.mechanism.parts import elements as el
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.elements import Load
from gearmbs.mechanism.parts.inputs import Input, Parameter, number_text
from gearmbs.mechanism.parts.modal import ModalBody, ShapedMarker
from gearmbs.mechanism.parts.quantities import Vector, expression_text, keeps_given, quantity, vector
from gearmbs.units import QuantityLike

if TYPE_CHECKING:
    from gearmbs.mechanism.contacts.element import Coulomb, Impact, Poisson, SolidContact
    from gearmbs.mechanism.contacts.shapes import Shape
    from gearmbs.mechanism.language.syntax import Units

Expression = str | float | Input | Parameter | None

M = TypeVar("M", bound=MatrixForce)

FIELDS = {"damping_ratio": "time"}
"""Dimensions of fields that are not called like them."""


class LoadMethods:
    """The part of :class:`gearmbs.mechanism.Mechanism` that adds loads."""

    units: Units
    ground: Body
    reads_units: bool
    given: dict[str, dict[str, Any]]
    parameters: dict[str, Parameter]
    _take_inputs: Callable[..., None]
    add: Callable[[Any], Any]
    _add_load: Callable[[Load], Load]

    def _text(self, label: str, value: Expression, dimension: str) -> str:
        """Return an expression, that of an input or a parameter, or the number a text with a unit stands for."""
        if isinstance(value, Input | Parameter):
            if isinstance(value, Input):
                self._take_inputs(value)
            elif self.parameters.get(value.name) is not value:
                raise ModelError(
                    f"{label}: parameter {value.name!r} is none of the mechanism's; make it by parameter(...)"
                )
            return number_text(value, SI_UNITS[dimension], self.units, self.units.factor(dimension), label)
        if not self.reads_units:
            return str(value)
        return expression_text(value, SI_UNITS[dimension], label, self.units.factor(dimension))

    def _number(self, label: str, field: str, value: QuantityLike, dimension: str | None = None) -> float:
        """Return a number in the mechanism's units; ``dimension`` is that of the field's name by default."""
        dimension = dimension or FIELDS.get(field, field)
        return quantity(value, SI_UNITS[dimension], f"{label}: {field}", self.units.factor(dimension))

    def _in_si(self, *values: tuple[float, str]) -> list[float]:
        """Return numbers in the mechanism's units, each with its dimension, in SI."""
        factors = [self.units.factor(dimension) for _, dimension in values]
        return [value if factor == 1.0 else value * factor for (value, _), factor in zip(values, factors)]

    @keeps_given
    def load(
        self,
        name: str,
        i: Marker,
        j: Marker,
        *,
        fx: Expression = None,
        fy: Expression = None,
        fz: Expression = None,
        tx: Expression = None,
        ty: Expression = None,
        tz: Expression = None,
        rm: Marker | None = None,
        kind: str = "gforce",
    ) -> Load:
        """Apply forces and torques given by expressions, in the frame of marker ``rm`` (default: J).

        They act on I's body at I; the reaction acts on J's body at the same point. Expressions are in the ADAMS
        function language and SI units, for instance ``"-100*DX(tip, anchor, anchor) - STEP(TIME, 0, 0, 1, 5)"``;
        markers go by their names (in quotes when they hold other characters than letters, digits, dot and underscore).
        """
        given = zip(("fx", "fy", "fz", "tx", "ty", "tz"), (fx, fy, fz, tx, ty, tz))
        expressions = tuple(
            None if e is None else self._text(f"{kind} '{name}': {c}", e, "force" if c[0] == "f" else "torque")
            for c, e in given
        )
        if not any(expressions):
            raise ModelError(f"load '{name}': give at least one of fx, fy, fz, tx, ty, tz")
        return self._add_load(Load(name, kind, i, j, rm or j, el.COMPONENTS, expressions))

    @keeps_given
    def line_force(self, name: str, i: Marker, j: Marker, expression: Expression, kind: str = "sforce") -> Load:
        """Apply a force along the line between two markers; positive values push I and J apart."""
        text = self._text(f"{kind} '{name}'", expression, "force")
        return self._add_load(Load(name, kind, i, j, j, el.LINE, (text,)))

    @keeps_given
    def axis_force(self, name: str, i: Marker, j: Marker, expression: Expression, rm: Marker | None = None) -> Load:
        """Apply a force on I along z of ``rm`` (default: J), the reaction on J's body at the same point."""
        text = self._text(f"sforce '{name}'", expression, "force")
        return self._add_load(Load(name, "sforce", i, j, rm or j, el.AXIS_FORCE, (text,)))

    @keeps_given
    def axis_torque(self, name: str, i: Marker, j: Marker, expression: Expression, rm: Marker | None = None) -> Load:
        """Apply a torque on I about z of ``rm`` (default: J), the reaction on J's body."""
        text = self._text(f"sforce '{name}'", expression, "torque")
        return self._add_load(Load(name, "sforce", i, j, rm or j, el.AXIS_TORQUE, (text,)))

    @keeps_given
    def spring_damper(
        self,
        name: str,
        i: Marker,
        j: Marker,
        *,
        stiffness: QuantityLike,
        damping: QuantityLike = 0.0,
        length: QuantityLike | None = None,
        preload: QuantityLike = 0.0,
    ) -> LineSpring:
        """Connect two markers by a spring (N/m) and damper (N s/m) along the line between them.

        ``length`` is the length at which the force is ``preload`` (default: the initial distance).
        """
        if length is None:
            length = float(np.linalg.norm(i.global_position() - j.global_position())) / self.units.length
        label = f"spring-damper '{name}'"
        k, c = self._number(label, "stiffness", stiffness), self._number(label, "damping", damping)
        free, start = self._number(label, "length", length), self._number(label, "preload", preload, "force")
        made = {"stiffness": k, "damping": c, "length": free, "preload": start}
        k, c, free, start = self._in_si((k, "stiffness"), (c, "damping"), (free, "length"), (start, "force"))
        return self.add(LineSpring(name, i, j, k, c, free, start, made))

    @keeps_given
    def torsion_spring(
        self,
        name: str,
        i: Marker,
        j: Marker,
        *,
        stiffness: QuantityLike,
        damping: QuantityLike = 0.0,
        angle: QuantityLike = 0.0,
        preload: QuantityLike = 0.0,
    ) -> AxisSpring:
        """Connect two markers by a rotational spring (N m/rad) and damper (N m s/rad) about z of J."""
        label = f"torsion spring '{name}'"
        k = self._number(label, "stiffness", stiffness, "rotational_stiffness")
        c = self._number(label, "damping", damping, "rotational_damping")
        free, start = self._number(label, "angle", angle), self._number(label, "preload", preload, "torque")
        made = {"stiffness": k, "damping": c, "angle": free, "preload": start}
        dimensions = ("rotational_stiffness", "rotational_damping", "angle", "torque")
        k, c, free, start = self._in_si(*zip((k, c, free, start), dimensions))
        return self.add(AxisSpring(name, i, j, k, c, free, start, made))

    @keeps_given
    def bushing(
        self,
        name: str,
        i: Marker,
        j: Marker,
        *,
        stiffness: Vector = (0.0, 0.0, 0.0),
        damping: Vector = (0.0, 0.0, 0.0),
        torsional_stiffness: Vector = (0.0, 0.0, 0.0),
        torsional_damping: Vector = (0.0, 0.0, 0.0),
    ) -> Bushing:
        """Connect two markers by springs and dampers along and about the three axes of J (small rotations)."""
        label = f"bushing '{name}'"
        k, c, kt, ct = (
            vector(value, f"{label}: {field}", SI_UNITS[dimension], self.units.factor(dimension)).tolist()
            for field, value, dimension in (
                ("stiffness", stiffness, "stiffness"),
                ("damping", damping, "damping"),
                ("torsional_stiffness", torsional_stiffness, "rotational_stiffness"),
                ("torsional_damping", torsional_damping, "rotational_damping"),
            )
        )
        if not any((*k, *c, *kt, *ct)):
            raise ModelError(f"bushing '{name}': all stiffnesses and dampings are zero")
        made = {"stiffness": k, "damping": c, "torsional_stiffness": kt, "torsional_damping": ct}
        return self.matrix_force(Bushing, name, i, j, np.diag([*k, *kt]), np.diag([*c, *ct]), made)

    def matrix_force(
        self,
        kind: type[M],
        name: str,
        i: Marker,
        j: Marker,
        stiffness: np.ndarray,
        damping: np.ndarray,
        parameters: Mapping[str, Any],
        free: npt.ArrayLike = (0.0,) * 6,
        preload: npt.ArrayLike = (0.0,) * 6,
    ) -> M:
        """Add an element of a class derived from MatrixForce, its numbers in the mechanism's units."""
        k, c = in_si(stiffness, self.units, False), in_si(damping, self.units, True)
        rest = np.asarray(free, dtype=float) * np.repeat([self.units.factor("length"), 1.0], 3)
        factors = np.repeat([self.units.factor("force"), self.units.factor("torque")], 3)
        start = factors * np.asarray(preload, dtype=float)
        return self.add(kind(name, i, j, k, c, rest, start, parameters))

    def field(
        self,
        name: str,
        i: Marker,
        j: Marker,
        *,
        stiffness: npt.ArrayLike | None = None,
        damping: npt.ArrayLike | None = None,
        free: npt.ArrayLike = (0.0,) * 6,
        preload: npt.ArrayLike = (0.0,) * 6,
    ) -> Field:
        """Connect two markers by full matrices: F = preload - K (q - free) - C q'.

        Parameters
        ----------
        stiffness, damping : array_like, shape (6, 6)
            N/m, N/rad, N m/m, N m/rad and with s; zero when left out.
        free, preload : array_like, shape (6,)
            Displacements and rotations of I in J's frame (small rotations about its axes) without load, and the load
            there.
        """
        label = f"field '{name}'"
        k, c = (
            np.zeros((6, 6)) if m is None else _numbers(m, f"{label}: {field}")
            for field, m in (("stiffness", stiffness), ("damping", damping))
        )
        rest, start = _numbers(free, f"{label}: free"), _numbers(preload, f"{label}: preload")
        if k.shape != (6, 6) or c.shape != (6, 6) or rest.shape != (6,) or start.shape != (6,):
            raise ModelError(f"{label}: stiffness and damping are 6x6, free and preload have 6 entries")
        if not any(np.any(part) for part in (k, c, start)):
            raise ModelError(f"{label}: all stiffnesses, dampings and preloads are zero")
        made = {"stiffness": k, "damping": c, "free": rest, "preload": start}
        return self.matrix_force(Field, name, i, j, k, c, made, rest, start)

    @keeps_given
    def beam(
        self,
        name: str,
        i: Marker,
        j: Marker,
        *,
        length: QuantityLike,
        area: QuantityLike,
        second_moments: Vector,
        modulus: QuantityLike,
        shear_modulus: QuantityLike,
        shear_ratios: tuple[float, float] = (0.0, 0.0),
        damping_ratio: QuantityLike = 0.0,
    ) -> Beam:
        """Connect two markers by a massless Timoshenko beam from J to I along x of J.

        Parameters
        ----------
        length, area : float
            m, m^2.
        second_moments : array_like
            Torsion constant and second moments about y and z, m^4.
        modulus, shear_modulus : float
            N/m^2.
        shear_ratios : tuple of float
            Shear area ratios in y and z; 0: without shear.
        damping_ratio : float
            Damping over stiffness, s.
        """
        label = f"beam '{name}'"
        units = self.units
        ixx, iyy, izz = vector(second_moments, f"{label}: second_moments", "m^4", units.length**4)
        length, damping_ratio = (
            self._number(label, "length", length),
            self._number(label, "damping_ratio", damping_ratio),
        )
        area = quantity(area, "area", f"{label}: area", units.length**2)
        modulus, shear_modulus = (
            quantity(value, "pressure", f"{label}: {field}", units.force / units.length**2)
            for field, value in (("modulus", modulus), ("shear_modulus", shear_modulus))
        )
        for field, value in (
            ("length", length),
            ("area", area),
            ("modulus", modulus),
            ("shear_modulus", shear_modulus),
        ):
            if not value > 0.0:
                raise ModelError(f"beam '{name}': {field} = {value}; it must be positive")
        k = beam_stiffness(length, area, ixx, iyy, izz, modulus, shear_modulus, shear_ratios)
        free = (length, 0.0, 0.0, 0.0, 0.0, 0.0)
        made = {
            "length": length,
            "area": area,
            "second_moments": (ixx, iyy, izz),
            "modulus": modulus,
            "shear_modulus": shear_modulus,
            "shear_ratios": shear_ratios,
            "damping_ratio": damping_ratio,
        }
        return self.matrix_force(Beam, name, i, j, k, damping_ratio * k, made, free)

    def contact(
        self, name: str, i: Marker, solids_i: Shape | Sequence[Shape], j: Marker, solids_j: Shape | Sequence[Shape],
        law: Impact | Poisson, friction: Coulomb | None = None,
    ) -> SolidContact:  # fmt: skip
        """Let solids of two bodies touch; ADAMS's CONTACT.

        Parameters
        ----------
        i, j : Marker
            In whose frames the solids are given.
        solids_i, solids_j : Shape or sequence of Shape
            From :mod:`gearmbs.mechanism.contacts`; each of the first may touch each of the second.
        law : Impact or Poisson
            From :mod:`gearmbs.mechanism.contacts`, SI.
        friction : Coulomb, optional

        Raises
        ------
        ModelError
            If a size or a constant makes no sense, or both sides are on one body.

        Examples
        --------
        >>> from gearmbs.mechanism import Mechanism
        >>> from gearmbs.mechanism.contacts import HalfSpace, Impact, Sphere
        >>> m = Mechanism("drop", gravity=(0, 0, -9.81))
        >>> ball = m.body("ball", 1.0, (4e-4, 4e-4, 4e-4), position=(0, 0, 0.5))
        >>> m.contact("floor", ball.marker(), Sphere("20 mm"), m.ground.marker(), HalfSpace(), Impact(1e7, 1.5, 500.0))
        SolidContact('floor', sphere and plane, I='ball.marker1', J='ground.marker1')
        """
        from gearmbs.mechanism.contacts.element import SolidContact

        first, second = (tuple(s) if isinstance(s, Sequence) else (s,) for s in (solids_i, solids_j))
        return self.add(SolidContact(name, i, j, first, second, law, friction))


def beam_stiffness(
    length: float, area: float, ixx: float, iyy: float, izz: float, modulus: float, shear_modulus: float,
    shear_ratios: tuple[float, float],
) -> np.ndarray:  # fmt: skip
    """Return the 6x6 stiffness of a beam's free end along x, the other end held; Timoshenko's with shear ratios."""
    k = np.zeros((6, 6))
    k[0, 0], k[3, 3] = modulus * area / length, shear_modulus * ixx / length
    for shift, turn, inertia, ratio, sign in ((1, 5, izz, shear_ratios[0], -1.0), (2, 4, iyy, shear_ratios[1], 1.0)):
        shear = 12.0 * modulus * inertia * ratio / (shear_modulus * area * length**2)
        bending = modulus * inertia / (1.0 + shear)
        k[shift, shift] = 12.0 * bending / length**3
        k[shift, turn] = k[turn, shift] = sign * 6.0 * bending / length**2
        k[turn, turn] = (4.0 + shear) * bending / length
    return k


def _numbers(value: npt.ArrayLike, field: str) -> np.ndarray:
    """Return an array without texts: its entries have different units."""
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(
            f"{field}: {value!r} is not made of numbers; give them in SI, texts have no place here"
        ) from None


COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")


def add_modal_force(
    mechanism: LoadMethods,
    name: str,
    body: ModalBody,
    load: npt.ArrayLike,
    scale: str | float = 1.0,
    *,
    reaction: Marker | None = None,
    kind: str = "mforce",
) -> list[Load]:
    """Apply a distribution of forces on a modal body, scaled by an expression.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
        Of the load on the modes; that on the frame is ``name.frame``.
    body : ModalBody
    load : array_like, shape (6 + n,)
        Force (N) and torque (N m) about the origin of the body's frame, in its axes, and the force on each mode (J for
        one unit of its coordinate), as :meth:`gearmbs.flexible.ModalModel.modal_load` gives them.
    scale : str or float
        Expression in the mechanism's function language.
    reaction : Marker, optional
        On the rigid body that takes the reaction of force and torque, at the frame's origin; default: none does.
    kind : str

    Returns
    -------
    list of Load
        On the frame, where there is force or torque, and on the modes.

    Raises
    ------
    ModelError
        If the load has another size, or the body has no modes.

    Examples
    --------
    >>> from gearmbs.flexible import Shaft, ShaftSection
    >>> from gearmbs.mechanism import Mechanism, add_modal_force
    >>> bar = Shaft([ShaftSection(0.4, 0.01)], seats={"A": 0.0, "B": 0.4}).modal_model().slowest(4)
    >>> m = Mechanism("m")
    >>> body = bar.add_to(m)
    >>> load = bar.modal_load({"A": ((10.0, 0, 0), (0, 0, 0)), "B": ((-10.0, 0, 0), (0, 0, 0))})
    >>> loads = add_modal_force(m, "wind", body, load, "SIN(TIME)")
    """
    label = f"modal force '{name}'"
    if not isinstance(body, ModalBody):
        raise ModelError(f"{label}: {body!r} has no modes; apply a load(...)")
    n = body.modal.modes
    given = np.asarray(load, dtype=float)
    if given.shape != (6 + n,) or not np.all(np.isfinite(given)):
        raise ModelError(
            f"{label}: it has {given.size} numbers; force, torque and the forces on {n} modes are {6 + n} finite ones"
        )
    frame = frame_marker(body)
    units = [mechanism.units.factor("force")] * 3 + [mechanism.units.factor("torque")] * 3
    parts = {c: f"({scale})*({float(v / u)!r})" for c, v, u in zip(COMPONENTS, given[:6], units) if v != 0.0}
    made = []
    if parts:
        other = reaction or mechanism.ground.marker(name=f"{name}.reaction")
        held = f"{name}.frame"
        made.append(mechanism.load(held, frame, other, rm=frame, kind=kind, **parts))  # type: ignore[arg-type]
    largest = float(np.abs(given[6:]).max(initial=0.0))
    if largest > 0.0:
        turned = np.zeros((n, 3))
        turned[:, 0] = given[6:] / largest
        lever = ShapedMarker(f"{name}.modes", body, np.zeros(3), np.eye(3), moved=np.zeros((n, 3)), turned=turned)
        body.markers.append(lever)
        text = f"({scale})*({largest / mechanism.units.factor('torque')!r})"
        made.append(mechanism.load(name, lever, frame, rm=frame, kind=kind, tx=text))
    return made


def frame_marker(body: ModalBody) -> Marker:
    """Return the marker that is the body's own frame: it does not move with the deformation."""
    name = f"{body.name}.frame"
    found = next((marker for marker in body.markers if marker.name == name), None)
    if found is None:
        nothing = np.zeros((body.modal.modes, 3))
        found = ShapedMarker(name, body, np.zeros(3), np.eye(3), moved=nothing, turned=nothing)
        body.markers.append(found)
    return found
