"""The standard problems as Exudyn models: bodies, joints and forces of its own library, nothing in Python per step."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.methods.base import assign
from benchmarks.problems.reference import PENDULUM_PERIOD
from benchmarks.problems.small import GRAVITY


@dataclass
class Model:
    """An assembled system and how to read it.

    Attributes
    ----------
    exu, mbs : module, MainSystem
    sensors : list of (sensor number, columns of its values or None)
        In the order of the reference's columns.
    grid : float
        Spacing of the stored output, s; all reference times are multiples of it.
    bodies : int
    """

    exu: Any
    mbs: Any
    sensors: list[tuple[int, list[int] | None]]
    grid: float
    bodies: int

    def values(self, times: np.ndarray) -> np.ndarray:
        """Return the stored values at ``times``, shape (m, k)."""
        rows = np.round(times / self.grid).astype(int)
        parts = []
        for sensor, columns in self.sensors:
            stored = self.mbs.GetSensorStoredData(sensor)[:, 1:]
            parts.append(stored[rows] if columns is None else stored[rows][:, columns])
        return np.hstack(parts)


def _library():
    # the build without range checks, their fastest; it announces itself on import
    assign(sys, {"exudynFast": True})
    with contextlib.redirect_stdout(io.StringIO()):
        import exudyn as exu
        import exudyn.itemInterface as items

    return exu, items


def pendulum(loops: int = 0) -> Model:
    """A point mass on a distance constraint."""
    exu, it = _library()
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    ground = mbs.AddObject(it.ObjectGround())
    node = mbs.AddNode(it.NodePoint2D(referenceCoordinates=[1.0, 0.0]))
    mass = mbs.AddObject(it.MassPoint2D(nodeNumber=node, mass=1.0))
    a = mbs.AddMarker(it.MarkerBodyPosition(bodyNumber=ground))
    b = mbs.AddMarker(it.MarkerBodyPosition(bodyNumber=mass))
    mbs.AddObject(it.ObjectConnectorDistance(markerNumbers=[a, b], distance=1.0))
    mbs.AddLoad(it.LoadForceVector(markerNumber=b, loadVector=[0.0, -GRAVITY, 0.0]))
    kinds = exu.OutputVariableType
    sensors = [
        (mbs.AddSensor(it.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind)), [0, 1])
        for kind in (kinds.Position, kinds.Velocity)
    ]
    mbs.Assemble()
    return Model(exu, mbs, sensors, 0.05 * PENDULUM_PERIOD, 1)


def _body_2d(mbs, it, position, velocity, mass: float, inertia: float) -> tuple[int, int]:
    node = mbs.AddNode(it.NodeRigidBody2D(referenceCoordinates=list(position), initialVelocities=list(velocity)))
    return node, mbs.AddObject(it.ObjectRigidBody2D(nodeNumber=node, mass=mass, inertia=inertia))


def _revolute_2d(mbs, it, one: int, at_one, two: int, at_two) -> None:
    markers = [
        mbs.AddMarker(it.MarkerBodyPosition(bodyNumber=body, localPosition=[*place, 0.0]))
        for body, place in ((one, at_one), (two, at_two))
    ]
    mbs.AddObject(it.ObjectJointRevolute2D(markerNumbers=markers))


def slider_crank(loops: int = 0) -> Model:
    """Crank on the ground, rod with the slider's mass at its end, spring-damper between the midpoints."""
    exu, it = _library()
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    ground = mbs.AddObject(it.ObjectGround())
    r = float(np.arcsin(-0.5))
    crank_node, crank = _body_2d(mbs, it, (0.0, 0.0, 0.5 * np.pi), (0.0, 0.0, 0.0), 1.0, 1.0)
    rod_node, rod = _body_2d(mbs, it, (np.cos(r), 0.0, r), (0.0, 0.0, 0.0), 1.0, 2.0)
    _revolute_2d(mbs, it, ground, (0.0, 0.0), crank, (0.0, 0.0))
    _revolute_2d(mbs, it, crank, (0.5, 0.0), rod, (-1.0, 0.0))
    height = mbs.AddMarker(it.MarkerNodeCoordinate(nodeNumber=rod_node, coordinate=1))
    fixed = mbs.AddMarker(
        it.MarkerNodeCoordinate(
            nodeNumber=mbs.AddNode(it.NodePointGround(referenceCoordinates=[0.0, 0.0, 0.0])), coordinate=0
        )
    )
    mbs.AddObject(it.CoordinateConstraint(markerNumbers=[fixed, height]))
    middle = [
        mbs.AddMarker(it.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0.0, 0.0]))
        for body, x in ((crank, 0.25), (rod, -0.5))
    ]
    mbs.AddObject(it.ObjectConnectorSpringDamper(markerNumbers=middle, stiffness=1.0, damping=1.0, referenceLength=1.0))
    # the load does work on x + cos r: it acts one metre along the rod
    pushed = mbs.AddMarker(it.MarkerBodyPosition(bodyNumber=rod, localPosition=[1.0, 0.0, 0.0]))
    mbs.AddLoad(it.LoadForceVector(markerNumber=pushed, loadVector=[1.0, 0.0, 0.0]))
    kinds = exu.OutputVariableType
    sensors = []
    for kind in (kinds.CoordinatesTotal, kinds.Coordinates_t):
        for node, column in ((crank_node, 2), (rod_node, 0), (rod_node, 2)):
            number = mbs.AddSensor(it.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
            sensors.append((number, [column]))
    mbs.Assemble()
    return Model(exu, mbs, sensors, 1.0, 2)


def heavy_top(loops: int = 0) -> Model:
    """One rigid body with Euler parameters on a spherical joint."""
    exu, it = _library()
    from exudyn.rigidBodyUtilities import RigidBodyInertia

    system = exu.SystemContainer()
    mbs = system.AddSystem()
    omega = np.array([0.0, 150.0, -4.61538])
    inertia = RigidBodyInertia(15.0, np.diag([0.234375, 0.46875, 0.234375]))
    body = mbs.CreateRigidBody(
        referencePosition=[0.0, 1.0, 0.0],
        initialVelocity=np.cross(omega, [0.0, 1.0, 0.0]),
        initialAngularVelocity=omega,
        inertia=inertia,
        gravity=[0.0, 0.0, -GRAVITY],
        nodeType=exu.NodeType.RotationEulerParameters,
    )
    ground = mbs.CreateGround()
    mbs.CreateSphericalJoint(bodyNumbers=[ground, body], position=[0.0, 0.0, 0.0], show=False)
    kinds = exu.OutputVariableType
    position, rotation, velocity, spin = (
        mbs.AddSensor(it.SensorBody(bodyNumber=body, storeInternal=True, outputVariableType=kind))
        for kind in (kinds.Position, kinds.RotationMatrix, kinds.Velocity, kinds.AngularVelocity)
    )
    mbs.Assemble()
    return _TopModel(exu, mbs, [(position, None), (rotation, None), (velocity, None), (spin, None)], 0.1, 1)


class _TopModel(Model):
    def values(self, times: np.ndarray) -> np.ndarray:
        """Return centre and axes, then their rates."""
        rows = np.round(times / self.grid).astype(int)
        place, turn, rate, spin = (self.mbs.GetSensorStoredData(s)[rows, 1:] for s, _ in self.sensors)
        axes = turn.reshape(-1, 3, 3).transpose(0, 2, 1)
        rates = np.cross(spin[:, None, :], axes)
        m = len(times)
        return np.hstack((place, axes.reshape(m, 9), rate, rates.reshape(m, 9)))


def four_bar_chain(loops: int) -> Model:
    """The chain of `benchmarks.problems.chain`: uniform bars, revolute joints."""
    exu, it = _library()
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    ground = mbs.AddObject(it.ObjectGround())
    bodies, nodes = [], []
    for i in range(loops + 1):
        node, body = _body_2d(mbs, it, (i, 0.5, 0.5 * np.pi), (0.5, 0.0, -1.0), 1.0, 1.0 / 12.0)
        bodies.append(body)
        nodes.append(node)
        if i < loops:
            node, body = _body_2d(mbs, it, (i + 0.5, 1.0, 0.0), (1.0, 0.0, 0.0), 1.0, 1.0 / 12.0)
            bodies.append(body)
            nodes.append(node)
    for body in bodies:
        centre = mbs.AddMarker(it.MarkerBodyMass(bodyNumber=body))
        mbs.AddLoad(it.LoadMassProportional(markerNumber=centre, loadVector=[0.0, -9.81, 0.0]))
    for i in range(loops + 1):
        _revolute_2d(mbs, it, ground, (float(i), 0.0), bodies[2 * i], (-0.5, 0.0))
        if i > 0:
            _revolute_2d(mbs, it, bodies[2 * i - 1], (0.5, 0.0), bodies[2 * i], (0.5, 0.0))
        if i < loops:
            _revolute_2d(mbs, it, bodies[2 * i], (0.5, 0.0), bodies[2 * i + 1], (-0.5, 0.0))
    kinds = exu.OutputVariableType
    sensors = []
    for node in (nodes[0], nodes[-1]):
        for kind in (kinds.CoordinatesTotal, kinds.Coordinates_t):
            number = mbs.AddSensor(it.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
            sensors.append((number, [2]))
    mbs.Assemble()
    return Model(exu, mbs, sensors, 0.5, 2 * loops + 1)


MODELS: dict[str, Callable[[int], Model]] = {
    "pendulum": pendulum,
    "slider crank": slider_crank,
    "heavy top": heavy_top,
}
