"""Linear plants of a mechanism: from inputs and outputs by name to A, B, C and D."""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.analyses.coordinates import chosen
from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.analyses.linearisation import Inputs, reduce, warn_of_varying
from gearmbs.dae.analyses.plant import LinearPlant, OperatingPoint, poles_of
from gearmbs.dae.analyses.realisation import Asked, lowered, realised
from gearmbs.dae.analyses.response import response_of
from gearmbs.dae.analyses.turning import turning
from gearmbs.dae.equations.rotation import POSE_W
from gearmbs.dae.problem import ModelError
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.checks import check_mechanism, warn_of_stiff_seats
from gearmbs.mechanism.parts.bodies import markers_kept
from gearmbs.mechanism.parts.elements import State as ElementState
from gearmbs.mechanism.parts.joints import Joint
from gearmbs.mechanism.solve.carriers import levers, pair_of
from gearmbs.mechanism.solve.plant_accelerations import Frame, changed_acceleration, frame_of, told_accelerations
from gearmbs.mechanism.solve.plant_names import LEVELS, Given, PlantNames, Told, has_phase
from gearmbs.mechanism.solve.points import instant_at, joint_coordinates, point_of, turns_of
from gearmbs.progress import waiting
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism

INPUT_STEP = 1e-3
"""Step of differences by an input, of its value or 1: what is linear in it, as most loads are, is exact with any; of
what is not 1e-12 of its fifth derivative is left out."""
DIFFERENCE = ((1.0, 8.0 / 12.0), (-1.0, -8.0 / 12.0), (2.0, -1.0 / 12.0), (-2.0, 1.0 / 12.0))
"""Central differences of fourth order: places in steps, and their weights."""
STANDING = 0.01
"""Part of the speed that is told for a wheel up to which it counts as standing: swings of one at rest are below."""
TURNS = 1e-6
"""Speed of a wheel, rad/s, up to which it rests: a mesh cycle takes a week."""
TOLD = "plant output {}"
"""Name of the state whose rate is an output."""


@waiting("plant")
def linearize(
    mechanism: Mechanism, inputs: Sequence[Any], outputs: Sequence[Any], *, at: Any = "initial", t: float | None = None
) -> LinearPlant:
    """Return the linear plant x' = A x + B u, y = C x + D u of a mechanism at one of its states.

    Constraints are eliminated: the states are independent coordinates, their rates, and the states of elements. The
    coordinates are angles and displacements of joints, by the name of a body where they are the same as one of its own,
    then displacements and small rotations of bodies.

    Parameters
    ----------
    mechanism : Mechanism
    inputs : sequence
        Of texts and tuples:

        * ``"load"``: an input of the mechanism, see `Mechanism.input`, in its unit, whatever it enters
        * ``("torque", joint or element)``: about z_J, on I's body and back on J's, N m; ``("force", ...)`` along z_J, N
        * ``("torque", body or marker, axis)``, ``("force", ...)`` with axis "x", "y" or "z": from the ground along a
          global axis, on a body at its centre of mass, N m and N
        * ``("motion", motion, level)``: what a motion prescribes, by its "position" (m, rad), "rate" or "acceleration"
        * ``("transmission_error", mesh, level)``: an error of the flanks of a gear contact along the line of action, m,
          as a function of time; ``("transmission_error", mesh, level, speed)``: one that goes with the angle of the
          first wheel, which turns at this speed about its axis, rad/s
    outputs : sequence
        Of texts and tuples:

        * an expression in the function language, accelerations included
        * ``("joint_angle", joint)``, ``("joint_displacement", joint)``, ``("joint_rate", joint)``: of I about or
          along z_J
        * ``("com_position", body, component)``, ``("com_velocity", ...)``, ``("com_acceleration", ...)``,
          ``("angular_velocity", ...)``, ``("angular_acceleration", ...)``, of a marker's origin
          ``("marker_position", marker, component)``, ``("marker_velocity", ...)``, ``("marker_acceleration", ...)``;
          component "x", "y" or "z" of the global frame, all three when left out
        * ``("reaction", joint, component)``, ``("load", element, component)``: on I's body at marker I, component "fx",
          "fy", "fz", "tx", "ty" or "tz"; ``("reaction_force", joint, component)`` with "x", "y" or "z"
        * ``("state", name)``, ``("transmission_error", mesh)``
    at : {"initial", "equilibrium"}, StaticResult, State or Solution
        Operating point: the initial position and velocity, the equilibrium reached from there, one found before, a
        state, or the state of a solution at ``t``. Where it moves, changes are those from the motion.
    t : float, optional
        Time at which functions of time are frozen, s; default 0, of a Solution its end.

    Returns
    -------
    LinearPlant

    Raises
    ------
    ModelError
        For a name, a component or a level that is not there; if a motion left free has no inertia; and for an output
        that follows a rate of an input that is not given by this rate.

    Warns
    -----
    UserWarning
        If the coefficients vary with time along the motion, or are going to, of what is at rest and not in balance:
        they are those of this instant. So they are of teeth that run. And of a mesh whose teeth do not touch.

    Examples
    --------
    >>> import gearmbs as gm
    >>> m = gm.Mechanism("pendulum", gravity=(0, 0, -9.81))
    >>> rod = m.body("rod", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0, 0, -0.5))
    >>> pin = m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    >>> plant = m.linearize([("torque", "pin")], [("joint_angle", "pin")])
    >>> round(float(plant.dc_gain[0, 0]), 6)  # 1 / (m g l)
    0.203874
    """
    check_mechanism(mechanism)
    warn_of_stiff_seats(mechanism.joints, mechanism.elements)
    for what, asked in (("inputs", inputs), ("outputs", outputs)):
        if isinstance(asked, str):
            raise ModelError(f"{what}: {asked!r} is one name; give a list, [{asked!r}]")
        if not isinstance(asked, Iterable):
            raise ModelError(f"{what}: {asked!r} is no list; give one of names and tuples, such as [('torque', 'pin')]")
    names = PlantNames(mechanism)
    point = point_of(mechanism, at, t)
    with markers_kept((mechanism.ground, *mechanism.bodies.values())):
        given = [one for item in inputs for one in names.inputs(item)]
        for name, count in Counter(one.name for one in given).items():
            if count > 1:
                raise ModelError(f"inputs: {name!r} is there {count} times; give it once")
        whole, told = _with_outputs(mechanism, names, outputs)
        # outputs begin where the model has counted to, and so does all of a model that was integrated as less
        whole.turns = {**mechanism.turns, **point.turns}
        instant = instant_at(whole, point)
        if isinstance(at, Solution) and (more := turns_of(at, point, instant)):
            whole.turns |= more
            instant = instant_at(whole, point)
        wanted = [acceleration for one in told for acceleration in one.accelerations]
        held = told_accelerations(whole.bodies.values(), instant, wanted)
        if held:
            # expressions look at the accelerations of the operating point
            for state, value in held.items():
                instant.y[instant.at["z"] + instant.system.state_names.index(state)] = value
            instant.y = instant.settle(instant.y)
        return _plant(whole, instant, given, told, point.state)


class _Columns:
    """Makes the columns of the residual by inputs at an instant."""

    def __init__(self, mechanism: Mechanism, instant: Instant) -> None:
        self.mechanism, self.instant = mechanism, instant
        self.axes = instant.axes()
        counts = instant.system.model.counts
        # place of the three angles of each body, -1 of one that does not turn
        self.angle = np.full(len(instant.system.body_names), -1)
        self.angle[counts.turning] = 3 * np.arange(counts.turning.size)
        self.matrix = instant.matrix(instant.y)
        self.turn = turning(instant)

    def of(self, given: Given) -> tuple[np.ndarray, np.ndarray]:
        """Return the columns by u and u'."""
        value, rate = np.zeros(self.instant.y.size), np.zeros(self.instant.y.size)
        if given.kind in ("force", "torque"):
            self._wrench(given, value)
        elif given.kind == "motion":
            self._motion(given, given.joints[0], value)
        elif given.kind == "input":
            self._number(given, value)
        else:
            self._flank(given, value, rate)
        return value, rate

    def _wrench(self, given: Given, value: np.ndarray) -> None:
        """Write what a force or torque of one does: on the body of I at its origin, the opposite on J's body there."""
        i = frame_of(self.instant, given.i)
        direction = np.eye(3)[given.axis] if given.j is None else frame_of(self.instant, given.j).axes[:, 2]
        self._push(value, i, i.place, direction, given.kind == "torque", 1.0)
        if given.j is not None:
            self._push(value, frame_of(self.instant, given.j), i.place, direction, given.kind == "torque", -1.0)

    def _push(
        self, value: np.ndarray, frame: Frame, place: np.ndarray, direction: np.ndarray, torque: bool, sign: float
    ) -> None:
        if frame.body < 0:
            return
        at, centre = self.instant.at, frame.place - frame.arm
        moment = direction if torque else np.cross(place - centre, direction)
        if not torque:
            first = at["u"] + 3 * frame.body
            value[first : first + 3] -= sign * direction
        if self.angle[frame.body] >= 0:
            first = at["p"] + self.angle[frame.body]
            value[first : first + 3] -= sign * self.axes[frame.body] @ moment

    def _number(self, given: Given, value: np.ndarray) -> None:
        """Write what an input of the mechanism does: motions exactly, all else by differences of fourth order."""
        instant, number = self.instant, self.instant.problem.numbers[given.name]
        if given.level > 0 and any(place.order != given.level for place in number.places[1:]):
            raise ModelError(
                f"input {given.name!r}: it prescribes a {LEVELS[given.level]} and enters expressions as it is; give "
                "the motion an input of its own"
            )
        if given.level == 0:
            tables, now = instant.rdata, number.value(instant.rdata, instant.t)
            step = INPUT_STEP * max(abs(now), 1.0)
            for share, weight in DIFFERENCE:
                instant.rdata = tables.copy()
                number.write(instant.rdata, instant.t, now + share * step)
                value += weight / step * instant.residual(instant.y)
            instant.rdata = tables
        for joint in given.joints:
            self._motion(given, joint, value)

    def _motion(self, given: Given, joint: Joint, value: np.ndarray) -> None:
        """Write how the constraint of a motion changes with what it prescribes."""
        names, row = self.instant.system.row_names, joint.rows[0]
        label = f"{joint.name}: {row.label}"
        if label not in names:
            raise ModelError(
                f"input {given.name!r}: motion '{joint.name}' was removed as redundant; take a motion that does not "
                "repeat other constraints"
            )
        place = self.instant.at["lambda"] + names.index(label)
        if row.rotation is None:
            value[place] = -1.0
            return
        # a turn of I about z_J by what the motion asks for leaves its constraint satisfied
        term = row.terms[0]
        i, j = frame_of(self.instant, term.i), frame_of(self.instant, term.j)
        moved = self._turned(i, j.axes[:, 2]) if i.body >= 0 else -self._turned(j, j.axes[:, 2])
        value[place] = -float((self.matrix[[place]] @ moved)[0])

    def _turned(self, frame: Frame, axis: np.ndarray) -> np.ndarray:
        """Return the change of y by a small rotation of a body about an axis through a point fixed in it."""
        out = np.zeros(self.instant.y.size)
        at, start = self.instant.at, self.angle[frame.body]
        out[at["R"] + 3 * frame.body : at["R"] + 3 * frame.body + 3] = -np.cross(axis, frame.arm)
        out[at["theta"] + start : at["theta"] + start + 3] = np.linalg.solve(self.axes[frame.body].T, axis)
        return out

    def _flank(self, given: Given, value: np.ndarray, rate: np.ndarray) -> None:
        """Write what a turn of the flanks of the second wheel in its body does to the force of a mesh.

        The force sees the frame of this wheel turned by -u/r about its axis z, at a rate that is fixed in the body.
        """
        instant, element = self.instant, given.element
        j = frame_of(instant, element.j)
        if j.body < 0 or self.angle[j.body] < 0:
            raise ModelError(f"input {given.name!r}: the second wheel of '{element.name}' is fixed; give another mesh")
        axis = j.axes[:, 2]
        spin = instant.pose()[j.body, POSE_W:]
        at, start, first = instant.at, self.angle[j.body], instant.at["R"]
        # phi = axis; phi' = omega x axis, since the axis turns with the body
        moved, sped = self._turned(j, axis), np.zeros(instant.y.size)
        angles, rates = at["theta"] + start, at["eps"] + start
        to = np.linalg.inv(self.axes[j.body].T)
        sped[rates : rates + 3] = to @ axis
        sped[at["u"] + 3 * j.body : at["u"] + 3 * j.body + 3] = -np.cross(axis, j.arm)
        along = np.cross(spin, axis)
        change = to @ along
        if self.turn is not None:
            places = slice(angles - first, angles - first + 3)
            change = change + self.turn.transform_rate[places, places] @ axis
        moved[rates : rates + 3] = change
        pushed = np.cross(along, j.arm) + np.cross(axis, np.cross(spin, j.arm))
        moved[at["u"] + 3 * j.body : at["u"] + 3 * j.body + 3] = -pushed
        rows = self.unknowns_of(element.name)
        value[rows] = -(self.matrix[rows] @ moved) / given.lever
        rate[rows] = -(self.matrix[rows] @ sped) / given.lever
        if given.speed:
            self._lean(given, rows, rate)

    def _lean(self, given: Given, rows: np.ndarray, rate: np.ndarray) -> None:
        """Write what a mesh that carries F does by an error u(phi) that goes with the angle of its first wheel.

        phi is the angle by which the first wheel has rolled, from where the line of action touches its base circle:
        phi_1 - theta - beta, theta the direction of the line of centres and cos beta = (r_b1 +- r_b2) / a. Of the
        energy k (r_b1 phi_1 + r_b2 phi_2 - u)^2 / 2 the error leaves the torque Q = F du/dphi = F u'/Omega on the first
        wheel, and by d theta = t (dR_2 - dR_1) / a and d beta = cot beta da / a the force Q e / (a sin beta) on its
        centre and the opposite on the other one, e = cos beta c + sin beta t towards the point of the base circle.
        """
        first, second = frame_of(self.instant, given.element.i), frame_of(self.instant, given.element.j)
        if first.body < 0 or self.angle[first.body] < 0:
            raise ModelError(
                f"input {given.name!r}: the first wheel of '{given.element.name}' is fixed; leave its speed out"
            )
        force, torque = self.instant.y[rows[:3]], self.instant.y[rows[-3:]]
        radius, other, _ = levers(given.element)
        axis = first.axes[:, 2]
        spin = float(self.instant.pose()[first.body, POSE_W:] @ axis)
        carried = given.element.name in self.mechanism.carriers
        if spin * given.speed < 0.0 and abs(spin) > STANDING * abs(given.speed) and not carried:
            raise ModelError(
                f"input {given.name!r}: the speed of the first wheel is given as {given.speed:.6g} rad/s, and at this "
                f"point it is {spin:.6g} rad/s; give that, or a point where it turns the other way"
            )
        share = -float(torque @ axis) / (radius * given.speed)
        self._push(rate, first, first.place, axis, True, share)
        if share == 0.0:
            return
        apart = second.place - first.place
        centres = apart - (apart @ axis) * axis
        a = float(np.linalg.norm(centres))
        across = np.cross(axis, centres) / a
        cosine = (radius + other) / a
        # e x F is along the torque
        towards = np.cross(force, axis) * (torque @ axis)
        sine = float(np.copysign(np.sqrt(1.0 - cosine**2), towards @ across))
        e = (cosine / a * centres + sine * across) / (a * sine)
        self._push(rate, first, first.place, e, False, share)
        self._push(rate, second, second.place, e, False, -share)

    def unknowns_of(self, name: str) -> np.ndarray:
        """Return the places in y of the force and torque of an element, and of its states."""
        instant = self.instant
        force, torque = instant.at["F"], instant.at["N"]
        for element in self.mechanism.elements.values():
            f, n = 3 * element.has_force * element.wrenches, 3 * element.has_torque * element.wrenches
            if element.name == name:
                return np.concatenate([np.arange(force, force + f), np.arange(torque, torque + n)])
            force, torque = force + f, torque + n
        raise AssertionError(name)


def _with_outputs(mechanism: Mechanism, names: PlantNames, outputs: Sequence[Any]) -> tuple[Mechanism, list[Told]]:
    """Return a copy of the mechanism whose last states have the outputs as their rates."""
    whole = copy.copy(mechanism)
    whole.states = dict(mechanism.states)
    told = [one for item in outputs for one in names.outputs(item)]
    for k, one in enumerate(told):
        for acceleration in one.accelerations:
            for label in acceleration.labels:
                whole.states[label] = ElementState(label, "0")
        whole.states[TOLD.format(k)] = ElementState(TOLD.format(k), one.expression)
    return whole, told


def _plant(
    mechanism: Mechanism, instant: Instant, given: Sequence[Given], told: Sequence[Told], state: Any
) -> LinearPlant:
    columns = _Columns(mechanism, instant)
    pairs = [columns.of(one) for one in given]
    size = instant.y.size
    stacked = [np.array([pair[k] for pair in pairs]).reshape(-1, size).T for k in (0, 1)]
    joints = joint_coordinates(mechanism)
    reduced = reduce(instant, Inputs(*stacked), joints, balance=True)
    warn_of_varying(reduced)
    _warn_of_running_teeth(mechanism, instant)
    _warn_of_idle_meshes(columns)
    kinds = instant.system.model.differential_states
    names = [name for name, differential in zip(instant.system.state_names, kinds, strict=True) if differential]
    outputs = [names.index(TOLD.format(k)) for k in range(len(told))]
    # outputs share what stands for the acceleration of a marker
    held = {
        names.index(label): (one, c)
        for item in told
        for one in item.accelerations
        for c, label in enumerate(one.labels)
    }
    own = np.array([k for k in range(len(names)) if k not in outputs and k not in held], dtype=int)
    found = realised(reduced, own, np.array(outputs, dtype=int), np.zeros(0, dtype=int))
    if held:
        rows = np.array(
            [
                changed_acceleration(mechanism.bodies.values(), instant, reduced, found, one)[c]
                for one, c in held.values()
            ]
        )
        found.outputs = found.outputs + reduced.state_state[np.ix_(outputs, list(held))] @ rows
    asked = [Asked(one.name, one.unit, one.level, remedy=one.remedy) for one in given]
    labels = [one.name for one in told]
    a, b, c, d = lowered(found, asked, labels)
    n = len(reduced.mass)
    change = np.eye(len(a))
    coordinates = reduced.coordinates
    if coordinates is None:
        coordinates = chosen(instant, reduced.motion, reduced.turning, joints)
        change[:n, :n] = change[n : 2 * n, n : 2 * n] = coordinates.rows[0]
    titles, units = coordinates.titles, coordinates.units
    back = np.linalg.inv(change)
    states = [*titles, *(f"{title}, rate" for title in titles), *(names[k] for k in own)]
    state_units = [*units, *(f"{unit}/s" for unit in units), *[""] * own.size]
    for k, one in enumerate(given):
        chain = len(found.chains[k])
        for level in range(min(one.level, chain)):
            states.append(f"{one.name} ({LEVELS[level]})")
            state_units.append(one.unit_of(level))
    for one, acting in zip(given, found.chains, strict=True):
        for level in range(len(acting), one.level):
            states.append(f"{one.name} ({LEVELS[level]})")
            state_units.append(one.unit_of(level))
    values = -instant.residual(instant.y)[instant.at["z"] + np.flatnonzero(kinds)][outputs]
    periods = np.array([one.period for one in told])
    values -= periods * np.round(np.divide(values, periods, out=np.zeros_like(values), where=periods > 0.0))
    point = OperatingPoint(instant.t, np.array([_value(instant, one) for one in given]), values, state)
    return LinearPlant(
        change @ a @ back, change @ b, c @ back, d, states, [one.name for one in given], labels, 1.0, state_units,
        [one.unit for one in given], [one.unit for one in told], point,
        poles_of(reduced, own, len(a) - 2 * n - own.size),
        response_of(reduced, own, np.zeros(0, dtype=int), found.outputs, found.chains, [one.level for one in given]),
    )  # fmt: skip


def _warn_of_running_teeth(mechanism: Mechanism, instant: Instant) -> None:
    """Warn of meshes whose stiffness is another one at each phase, and whose wheels turn."""
    running = []
    for name, element in mechanism.elements.items():
        if has_phase(element):
            frames = [frame_of(instant, marker) for marker in element.markers]
            spins = [abs(instant.pose()[one.body, POSE_W:] @ one.axes[:, 2]) for one in frames if one.body >= 0]
            if max(spins, default=0.0) > TURNS:
                running.append(f"{name!r} (at {max(spins):.4g} rad/s)")
    if running:
        warn(
            f"teeth run in {', '.join(running)}, at another stiffness in each phase of the mesh: A is that of this "
            "instant, and shafts that turn freely have poles of some rad/s and of either sign in place of zeros. Take "
            "the mesh at rest under its load (at='equilibrium', of a drivetrain at='loaded'), or an IdealMesh of its "
            "mean stiffness, or compare several instants"
        )


def _warn_of_idle_meshes(columns: _Columns) -> None:
    """Warn of meshes whose force depends on no displacement: their teeth do not touch."""
    instant = columns.instant
    moves = instant.block("R", "lambda")
    idle = [
        repr(name)
        for name, element in columns.mechanism.elements.items()
        if pair_of(element) is not None and not np.any(columns.matrix[columns.unknowns_of(name)][:, moves].data)
    ]
    if idle:
        warn(
            f"plant: of {', '.join(idle)} no teeth touch at t = {instant.t:.6g} s: neither stiffness nor damping of "
            "that mesh is in it. Take it under load: at='equilibrium' and a time t= at which the load acts, or a state "
            "or solution that is under way"
        )


def _value(instant: Instant, given: Given) -> float:
    """Return the value of an input of the mechanism; what is added to it else is 0."""
    number = instant.problem.numbers.get(given.name) if given.kind == "input" else None
    return 0.0 if number is None else number.value(instant.rdata, instant.t)
