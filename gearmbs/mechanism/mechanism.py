"""The Mechanism: bodies, joints, motions and forces by name, and its translation into tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar, Unpack

import numpy.typing as npt

from gearmbs._display import Shown
from gearmbs.dae.equations.expressions import SplineData
from gearmbs.dae.model.system import System
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.forces.friction import FrictionForce, add_friction, friction_of
from gearmbs.mechanism.forces.functions import FunctionForce, function_force
from gearmbs.mechanism.forces.laws import ForceLaw
from gearmbs.mechanism.language.syntax import Units
from gearmbs.mechanism.language.user_functions import UserFunction
from gearmbs.mechanism.load_methods import LoadMethods
from gearmbs.mechanism.parts import joints as jt
from gearmbs.mechanism.parts.bodies import Body, Marker, OwnAttributes, make_body
from gearmbs.mechanism.parts.constraint_laws import ConstraintMethods, GeneralConstraint
from gearmbs.mechanism.parts.elements import ForceElement, Load, State, Torque
from gearmbs.mechanism.parts.functions import TimeFunction, as_function
from gearmbs.mechanism.parts.inputs import Input, Output, Parameter
from gearmbs.mechanism.parts.joints import JointMethods
from gearmbs.mechanism.parts.modal import ModalBody, Mode, ShapeIntegrals, Shapes, make_modal_body
from gearmbs.mechanism.parts.point_mass import PointMass, make_point_mass
from gearmbs.mechanism.parts.quantities import Vector, frame_along, keeps_given, quantity, reader, vector
from gearmbs.mechanism.value_methods import ValueMethods
from gearmbs.units import QuantityLike, truth

if TYPE_CHECKING:
    from gearmbs.dae.analyses.modes import Modes
    from gearmbs.dae.analyses.plant import LinearPlant
    from gearmbs.dae.analyses.statics import StaticResult
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism.parts.keywords import BodyKeywords, FrictionKeywords
    from gearmbs.mechanism.solve.keywords import SimulateOptions
    from gearmbs.mechanism.solve.measures import Measures

E = TypeVar("E", bound=ForceElement)


class ContactPair(Protocol):
    """Two wheels that can touch; `gearmbs.gears.GearPair` is one."""

    def contact_element(self, name: str, i: Marker, j: Marker) -> ForceElement:
        """Return the force element between the wheels' frames."""
        ...


class Mechanism(JointMethods, ConstraintMethods, LoadMethods, ValueMethods, Shown, OwnAttributes):
    """A system of bodies, rigid or with modes of deformation, joints, motions and forces.

    Every part has a name. Joints take two bodies with a point and an axis in global components at the
    initial position, or two markers::

        m = Mechanism("pendulum", gravity=(0, 0, -9.81))
        rod = m.body("rod", mass=1.0, inertia=(0.1, 0.1, 0.01), position=(0.5, 0, 0))
        m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
        solution = m.simulate(2.0)

    Parameters
    ----------
    name : str
        Title used in messages and results.
    gravity : array_like of 3 floats
        Acceleration of gravity, m/s^2.

    Attributes
    ----------
    redundancy : {"declared", "adams"}
        Which of redundant constraint rows are kept: those added first, or as in ADAMS, see
        `gearmbs.mechanism.checks`. Only their reactions depend on it.
    lump : bool
        Whether `simulate` integrates bodies fixed to each other as one unless told otherwise; default False.
    rate_scale : float or None
        Angular frequency of interest, rad/s, where `simulate` is given none; default None: that of the fastest mesh, as
        far as motions and initial speeds tell it.
    turns : dict of (str, str, str) to float
        About which angle, in rad, AX, AY and AZ start to count, by function and names of the markers:
        ``m.turns["AZ", "shaft.I", "shaft.J"] = 4 * np.pi`` winds a torsion spring twice. Default: 0.
    carriers : dict of str to str
        Names of the bodies from which the turns of wheels in mesh count, by the name of the contact; see
        :meth:`gear_contact`.
    inputs, parameters, outputs : dict
        What :meth:`input`, :meth:`parameter` and :meth:`output` have added, by name.
    aliases : dict of str to str
        Further names of numbers that `gearmbs.Simulator.set` changes, as of the case that a mechanism is made from.
    given : dict of str to dict
        Settings that were written with units, by the names of bodies, joints and forces.
    """

    reads: ClassVar = {
        "gravity": reader("acceleration", vector),
        "lump": truth,
    }
    other_words: ClassVar[Mapping[str, str]] = {
        "hinge": "revolute(...)",
        "pin": "revolute(...)",
        "slider": "translational(...)",
        "prismatic": "translational(...)",
        "ball": "spherical(...)",
        "weld": "fixed(...)",
        "motor": "rotation(...) for a motion that is given, axis_torque(...) for a torque",
        "motion": "rotation(...) or translation(...)",
        "damper": "spring_damper(...) with stiffness=0",
        "sensor": "output(...)",
        "run": "simulate(t_end)",
        "solve": "simulate(t_end)",
        "modes": "linear_modes()",
    }

    def __init__(self, name: str = "mechanism", gravity: Vector = (0.0, 0.0, 0.0)) -> None:
        self.name = name
        self.gravity = vector(gravity, "gravity", "acceleration")
        self.ground = Body("ground", is_ground=True)
        self.bodies: dict[str, Body] = {}
        self.joints: dict[str, jt.Joint] = {}
        self.elements: dict[str, Any] = {}
        self.constraints: dict[str, GeneralConstraint] = {}
        self.variables: dict[Any, str] = {}
        self.states: dict[Any, State] = {}
        self.splines: dict[Any, SplineData] = {}
        self.arrays: dict[Any, tuple[float, ...]] = {}
        self.functions: dict[str, UserFunction] = {}
        self.inputs: dict[str, Input] = {}
        self.parameters: dict[str, Parameter] = {}
        self.outputs: dict[str, Output] = {}
        self.aliases: dict[str, str] = {}
        self.plants: dict[tuple[str, Any], tuple[Any, ...]] = {}
        self.units = Units()
        self.reads_units = True
        self.redundancy = "declared"
        self.lump = False
        self.rate_scale: float | None = None
        self.turns: dict[tuple[str, str, str], float] = {}
        self.carriers: dict[str, str] = {}
        self.given: dict[str, dict[str, Any]] = {}

    # --- bodies -----------------------------------------------------------------------------------

    @keeps_given
    def body(
        self,
        name: str,
        mass: QuantityLike = 0.0,
        inertia: npt.ArrayLike = (0.0, 0.0, 0.0),
        *,
        com: Vector = (0.0, 0.0, 0.0),
        position: Vector = (0.0, 0.0, 0.0),
        orientation: npt.ArrayLike | None = None,
        velocity: Vector = (0.0, 0.0, 0.0),
        angular_velocity: Vector = (0.0, 0.0, 0.0),
    ) -> Body:
        """Add a rigid body.

        Parameters
        ----------
        name : str
            Unique in the mechanism.
        mass : float
            kg.
        inertia : array_like
            About the centre of mass in the body's axes, kg m^2: 3 moments, 6 entries (xx, yy, zz, xy, xz, yz) or 3x3.
        com : array_like
            Centre of mass in the body's frame, m.
        position, orientation : array_like
            The body's frame at the start (m; 3x3 matrix or 3-1-3 Euler angles in rad).
        velocity, angular_velocity : array_like
            At the start, global components (m/s of the frame's origin, rad/s).

        Raises
        ------
        ModelError
            For a name in use, a negative mass, an impossible inertia or a malformed vector.
        """
        self._check_body_name(name)
        body = make_body(name, mass, inertia, com, position, orientation, velocity, angular_velocity)
        self.bodies[name] = body
        return body

    @keeps_given
    def point_mass(
        self,
        name: str,
        mass: QuantityLike,
        *,
        at: Vector = (0.0, 0.0, 0.0),
        velocity: Vector = (0.0, 0.0, 0.0),
        com: Vector = (0.0, 0.0, 0.0),
        orientation: npt.ArrayLike | None = None,
    ) -> PointMass:
        """Add a point mass: a body with three coordinates, which moves and does not turn (ADAMS's POINT_MASS).

        Forces act at its markers; joints hold its place: spherical, at_point, inline, inplane, distance. Those that
        hold an orientation, and loads with torques, need a body with an inertia.

        Parameters
        ----------
        name : str
            Unique in the mechanism.
        mass : float
            kg, positive.
        at, velocity : array_like
            Of its frame at the start, global components, m and m/s.
        com : array_like
            Where the mass is in the frame, m.
        orientation : array_like, optional
            Axes of the frame, which stay: 3x3 matrix or 3-1-3 Euler angles in rad.

        Raises
        ------
        ModelError
            For a name in use, a mass that is not positive or a malformed vector.
        """
        self._check_body_name(name)
        body = make_point_mass(name, mass, at, velocity, com, orientation)
        self.bodies[name] = body
        return body

    @keeps_given
    def modal_body(
        self,
        name: str,
        mass: QuantityLike,
        inertia: npt.ArrayLike,
        modes: Sequence[Mode],
        shapes: Shapes,
        *,
        integrals: ShapeIntegrals | None = None,
        **where: Unpack[BodyKeywords],
    ) -> ModalBody:
        """Add a body that deforms by modes; its markers move and turn with their shapes.

        Deformations are small: displacements are linear in the modal coordinates. The equations are those of
        `gearmbs.dae.equations.bodies.inertia` and `gearmbs.dae.equations.bodies.frames`.

        Parameters
        ----------
        name, mass, inertia
            As of :meth:`body`, of the undeformed body.
        modes : sequence of Mode
            Stiffness, modal mass, damping, and what each mode carries of momentum and angular momentum.
        shapes : callable
            From a point of the body's frame (m) to displacements (m) and rotations (rad) there by one unit of each
            mode, two arrays of shape (modes, 3) in the body's axes. It is asked at the markers.
        integrals : ShapeIntegrals, optional
            All integrals of the shapes, in place of the masses and momenta of the modes, which leave out the change of
            the inertia with the deformation: see :meth:`ShapeIntegrals.of_points`.
        **where
            ``com``, ``position``, ``orientation``, ``velocity``, ``angular_velocity`` as of :meth:`body`.

        Raises
        ------
        ModelError
            As :meth:`body`, and for modes that no body of this mass and inertia can have.
        """
        body = make_modal_body(self.body(name, mass, inertia, **where), modes, shapes, integrals)
        self.bodies[name] = body
        return body

    # --- forces -----------------------------------------------------------------------------------

    @keeps_given
    def torque(
        self,
        name: str,
        on: Body | Marker,
        function: QuantityLike | TimeFunction | Parameter,
        *,
        axis: Vector = (0, 0, 1),
        reaction: Body | None = None,
    ) -> Torque:
        """Apply a torque f(t) in N m about an axis fixed in the reacting body (default: ground).

        Parameters
        ----------
        on : Body or Marker
            Body that feels the torque.
        function : float, TimeFunction or Parameter
            Value in N m; a number is a constant.
        axis : array_like
            Direction at the initial position, global components.
        reaction : Body, optional
            Body that feels the opposite torque.
        """
        self._check_name(name)
        marker = self._own_marker(f"torque '{name}'", on, f"{name}.I")
        against = reaction or self.ground
        self._check_body(f"torque '{name}'", against)
        frame = frame_along(axis, f"torque '{name}': axis")
        other = against.marker_at(marker.global_position(), frame, name=f"{name}.J")
        label = f"torque '{name}'"
        value = self._text(label, function, "torque") if isinstance(function, Parameter) else function
        return self.add(Torque(name, marker, other, other, as_function(value, "torque", label)))

    def gear_contact(
        self, name: str, wheel_1: Body | Marker, wheel_2: Body | Marker, pair: ContactPair, carrier: Body | None = None
    ) -> ForceElement:
        """Let the teeth of two wheels touch.

        Parameters
        ----------
        wheel_1, wheel_2 : Body or Marker
            Wheel frames: origin at mid-face on the axis, z the axis, x through the middle of tooth 0. A body stands
            for its own frame.
        pair : ContactPair
            Usually a :class:`gearmbs.gears.GearPair`.
        carrier : Body, optional
            What carries the axes of the wheels, from which the turns of a transmission error count, as those of planets
            do from their carrier; default: the ground, and where a wheel stands on what turns about another axis a
            transmission error is refused until it is named. Forces do not depend on it.

        Raises
        ------
        ModelError
            If the wheels stand in each other. Wheels out of reach give a warning.
        """
        self._check_name(name)
        i = self._own_marker(f"gear contact '{name}'", wheel_1, f"{name}.I")
        j = self._own_marker(f"gear contact '{name}'", wheel_2, f"{name}.J")
        element = self.add(pair.contact_element(name, i, j))
        if carrier is not None:
            self._check_body(f"gear contact '{name}': carrier", carrier)
            self.carriers[name] = carrier.name
        return element

    def add(self, element: E) -> E:
        """Add a force element made elsewhere, of a class derived from `gearmbs.mechanism.parts.elements.ForceElement`.

        Raises
        ------
        ModelError
            If the name is in use, or a marker belongs to another mechanism.
        """
        self._check_name(element.name)
        label = f"{element.kind} '{element.name}'"
        markers = element.markers
        for marker in markers:
            if not isinstance(marker, Marker):
                raise ModelError(f"{label}: {marker!r} is not a marker; make one with body.marker(...)")
            self._check_body(label, marker.body)
        for marker in markers:
            marker.body.check(element)
        self._take_inputs(*vars(element).values())
        self.elements[element.name] = element
        return element

    def force(
        self,
        name: str,
        kernel: Callable[..., None] | ForceLaw,
        *markers: Marker,
        parameters: Mapping[str, float] | Sequence[float] = (),
        states: Mapping[str, float] | Sequence[str] = (),
        algebraic: Mapping[str, float] | Sequence[str] = (),
        diagnostics: Sequence[Any] = (),
        derivatives: Callable[..., None] | None = None,
        steps: Mapping[str, float] | None = None,
    ) -> FunctionForce:
        """Add a force given by a function of your own, compiled by numba.

        Parameters
        ----------
        kernel : callable or ForceLaw
            What :func:`gearmbs.force_law` makes of a formula, with its derivatives and energy; or
            ``kernel(t, frames, states, parameters, wrench, rates, diagnostics)``, plain Python that numba compiles, or
            compiled by ``numba.njit`` without a signature. It reads the first four and writes to the others, which are
            zero before, and returns nothing; all in SI and global components:

            * ``frames[k]`` of marker k: origin ``[0:3]``, orientation ``[3:12]`` (row-major 3x3, columns are the
              marker's axes), velocity of the origin ``[12:15]``, angular velocity ``[15:18]``
            * ``wrench[0]``: force and torque on the body of the first marker at its origin. Of two markers, the second
              one's body takes the reaction at the same point, of one marker the ground does. More than two: each has
              a wrench of its own, ``wrench[k]``. A torque on a point mass, which does not turn, does nothing; a run
              warns of that of the first wrench at its end.
            * ``rates[k]``: the derivative of a differential state, the value of an algebraic one, differential ones
              first
            * ``diagnostics[k]``: what else is to be told

            It must depend on its arguments alone, and smoothly enough for Newton's method.
        *markers : Marker
            One, two or more.
        parameters : mapping or sequence of float
            In a kernel an array, in the order given; of a law by name.
        states, algebraic : mapping of str to float
            Own states with their start: z' = rate, or z = rate. Results know them as ``name.state``.
        diagnostics : sequence
            Of names, (name, unit, role) or :class:`gearmbs.mechanism.Diagnostic`. Roles: "stored" (J) and "dissipated"
            (W) enter the energy balance, "count", "plain".
        derivatives : callable, optional
            ``derivatives(t, frames, states, parameters, jac)`` writes the exact derivatives: rows are the wrenches,
            then the rates; columns the variations [dP, dpi, dv, dw] of each frame (dA = dpi x A), then the states.
            Default: central differences.
        steps : mapping, optional
            Steps of the differences, ``length``, ``angle``, ``speed``, ``angular_speed`` (m, rad, m/s, rad/s), for a
            force that changes within less than some 10 um or 0.1 mm/s.

        Raises
        ------
        ModelError
            If numba cannot compile the function, or what is given does not fit together.

        Examples
        --------
        >>> from gearmbs.mechanism import Mechanism
        >>> def pull(t, frames, states, parameters, wrench, rates, diagnostics):
        ...     apart = frames[0, 0:3] - frames[1, 0:3]
        ...     wrench[0, 0:3] = -parameters[0] * apart / (apart @ apart) ** 1.5
        >>> m = Mechanism("magnets")
        >>> ball = m.body("ball", mass=0.1, inertia=(1e-5, 1e-5, 1e-5), position=(0.1, 0, 0))
        >>> m.force("magnet", pull, ball.marker(), m.ground.marker(), parameters={"strength": 1e-4})
        FunctionForce('magnet' on 'ball.marker1', 'ground.marker1')
        """
        self._check_name(name)
        if not markers:
            raise ModelError(f"force '{name}': give the markers it acts on, one or more")
        for marker in markers:
            if not isinstance(marker, Marker):
                raise ModelError(f"force '{name}': {marker!r} is not a marker; make one with body.marker(...)")
            self._check_body(f"force '{name}'", marker.body)
        made = function_force(
            name, kernel, markers, parameters, states, algebraic, diagnostics, derivatives, steps
        )  # fmt: skip
        return self.add(made)

    @keeps_given
    def friction(
        self,
        name: str,
        joint: jt.Joint,
        mu_static: QuantityLike,
        mu_dynamic: QuantityLike,
        **parameters: Unpack[FrictionKeywords],
    ) -> list[FrictionForce]:
        """Add dry friction to a revolute, translational, cylindrical, spherical or universal joint.

        It depends on the joint's reaction and its slip speed as in ADAMS.

        Parameters
        ----------
        mu_static, mu_dynamic : float
            Coefficients of friction.
        **parameters
            Radii, arms, preloads, transition velocity: see :class:`gearmbs.mechanism.JointFriction`.

        Raises
        ------
        ModelError
            For a joint without friction of this kind, or a parameter that is wrong or missing.
        """
        self._check_name(name)
        if self.joints.get(getattr(joint, "name", "")) is not joint:
            raise ModelError(f"friction '{name}': {joint!r} is not a joint of mechanism '{self.name}'")
        return add_friction(self, name, joint, friction_of(name, mu_static, mu_dynamic, {**parameters}, self.units))

    @property
    def every_state(self) -> list[State]:
        """All states in their order among the unknowns: those given by expressions, then those of force elements."""
        own = [state for e in self.elements.values() if isinstance(e, ForceElement) for state in e.states]
        return [*self.states.values(), *own]

    @property
    def state_names(self) -> list[str]:
        """Names of `every_state`; of one given by an expression, that under which expressions know it."""
        return self.names_of(self.every_state)

    def names_of(self, every_state: Sequence[State]) -> list[str]:
        """Return `state_names` from `every_state`."""
        return [*map(str, self.states), *(state.name for state in every_state[len(self.states) :])]

    # --- translation into tables ------------------------------------------------------------------

    def compile(self, t0: float = 0.0) -> System:
        """Return the mechanism as flat tables with names.

        Raises
        ------
        ModelError
            If the mechanism has no bodies, or an expression cannot be read.
        """
        from gearmbs.mechanism.compile import compile_mechanism

        return compile_mechanism(self, quantity(t0, "time", "t"))

    def simulate(self, t_end: QuantityLike, **options: Unpack[SimulateOptions]) -> Solution:
        """Integrate from 0 to ``t_end`` seconds; see :func:`gearmbs.mechanism.simulate`."""
        from gearmbs.mechanism.solve.simulate import simulate

        return simulate(self, t_end, **options)

    def linear_modes(self, *, t: float = 0.0, at: StaticResult | str = "initial") -> Modes:
        """Return the natural frequencies and mode shapes; see :func:`gearmbs.mechanism.linear_modes`."""
        from gearmbs.mechanism.solve.analyses import linear_modes

        return linear_modes(self, t=t, at=at)

    def linearize(
        self, inputs: Sequence[Any], outputs: Sequence[Any], *, at: Any = "initial", t: float | None = None
    ) -> LinearPlant:
        """Return the linear plant between inputs and outputs; see :func:`gearmbs.mechanism.linearize`."""
        from gearmbs.mechanism.solve.plants import linearize

        return linearize(self, inputs, outputs, at=at, t=t)

    def measures(self, solution: Solution) -> Measures:
        """Return what can be measured on a solution of this mechanism; its methods offer it by name."""
        from gearmbs.mechanism.solve.measures import Measures

        return Measures(self, solution)

    # --- checks -----------------------------------------------------------------------------------

    def _check_body_name(self, name: str) -> None:
        if name in self.bodies or name == "ground":
            raise ModelError(f"body '{name}': the name is in use; choose another")

    def _add_load(self, load: Load) -> Load:
        self._check_name(load.name)
        for marker in (load.i, load.j, load.rm):
            if not isinstance(marker, Marker):
                raise ModelError(f"load '{load.name}': {marker!r} is not a marker; make one with body.marker(...)")
            self._check_body(f"load '{load.name}'", marker.body)
        for marker in load.markers:
            marker.body.check(load)
        self.elements[load.name] = load
        return load

    def __repr__(self) -> str:
        rows = sum(len(joint.rows) for joint in self.joints.values())
        coordinates = sum(body.coordinates for body in self.bodies.values())
        lines = [f"Mechanism({self.name!r}: {coordinates} coordinates, {rows} constraint rows)"]
        for part in (*self.bodies.values(), *self.joints.values(), *self.elements.values()):
            lines.append(f"  {part!r}")
        return "\n".join(lines)
