"""The loaded position of rest of a drivetrain, in numbers.

All that the mechanism has is at rest under the torques of the operating point, without friction, the shafts of drives
held: shafts and housings bend, bearings give, teeth deflect by their laws, and flanks that do not reach each other
carry nothing. With z_1 and z_2 the axes of two wheels in mesh there, and n the transverse line of action in the sense
of the force on the driven wheel, the flanks open by (z_2 - z_1) . n a metre of face. Of two axes in parallel planes at
an angle gamma that is -gamma n_y, y across the line of centres.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.drivetrain.members.rim import rim_meshes, told_of_mesh
from gearmbs.drivetrain.placement import order
from gearmbs.drivetrain.plants import ITERATIONS, resting
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.solve.analyses import static_equilibrium

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain
    from gearmbs.drivetrain.planetary import Meshing
    from gearmbs.mechanism.parts.bodies import Marker

POSITIONS = 16
"""Positions of rest for the mean shares of branches: an even spread tells them to a sixteenth of a mesh cycle."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Mesh cycles between them: the golden section spreads them evenly over the cycles of all meshes at once."""


@dataclass(frozen=True)
class Rest:
    """A drivetrain at rest under its loads.

    Attributes
    ----------
    bearings : dict of str to ndarray, shape (3,)
        Force of each bearing on its first part, in the axes of its shaft, N.
    forces : dict of str to float
        Normal force of each mesh, N.
    torques : dict of str to float
        On the driven wheel of each mesh that is not of a planetary stage, about its axis, N m.
    openings : dict of str to float
        Of each mesh that carries: by how much more than without load the flanks open a metre of face along the line of
        action, towards the positive axis of the driver, m/m.
    skews : dict of str to float
        Angle between axes in parallel planes that opens them as much, a misalignment of the wheels included, rad.
    apart : dict of str to float
        By how much the centre distance is larger than without load, m.
    trouble : str
        Why no position of rest was found; ``""`` where it was, and everything else is empty where it was not.
    """

    bearings: dict[str, np.ndarray] = field(default_factory=dict)
    forces: dict[str, float] = field(default_factory=dict)
    torques: dict[str, float] = field(default_factory=dict)
    openings: dict[str, float] = field(default_factory=dict)
    skews: dict[str, float] = field(default_factory=dict)
    apart: dict[str, float] = field(default_factory=dict)
    trouble: str = ""


def position_of_rest(train: Drivetrain) -> Rest:
    """Return the loaded position of rest at the start; one without any has the reason as its ``trouble``."""
    still = resting(train)
    mechanism = still.build()
    try:
        rest = static_equilibrium(mechanism, t=2.0 * still.run_up, max_iterations=ITERATIONS).solution
    except ModelError as error:
        return Rest(trouble=str(error).rstrip("."))
    out = Rest()
    for bearing in train.bearings:
        # of joints reactions, of elements loads
        is_joint = bearing.name in mechanism.joints
        force = (rest.reaction(bearing.name) if is_joint else rest.load(bearing.name))[0][-1]
        out.bearings[bearing.name] = force @ still.layout.seats[bearing.shaft].axes
    on_rims = rim_meshes(still)
    for mesh in still.meshings:
        if mesh.name in on_rims:
            # along the rim, which bends, axes stand to each other as the flanks do
            out.forces[mesh.name] = float(told_of_mesh(rest, *on_rims[mesh.name])["normal_force"][-1])
            continue
        _add_mesh(out, still, mesh, mechanism.elements[mesh.name], rest)
    return out


def mean_torques(train: Drivetrain) -> tuple[dict[str, float], str]:
    """Return the torques on the driven wheels of meshes at rest, N m, their means over positions of the mesh cycle.

    Where one pair of teeth carries in one branch and two in the other, these share the load as 1 to 2, and a moment
    later as 2 to 1.

    Returns
    -------
    torques : dict of str to float
        Of meshes that are not of planetary stages; empty where a position of rest was not found.
    trouble : str
        Why, or ``""``.
    """
    positions = [train.at_rest]
    meshes = train.nominal_power.senses.keys() & set(train.nominal_power.shared)
    frequency = max((train.kinematics.mesh_frequency(name) for name in meshes), default=0.0)
    if frequency > 0.0:
        settled = _settled(train)
        with warnings.catch_warnings():
            # what is said of the drivetrain was said at its start
            warnings.simplefilter("ignore")
            positions += [position_of_rest(_turned(settled, k * GOLDEN / frequency)) for k in range(1, POSITIONS)]
    trouble = next((rest.trouble for rest in positions if rest.trouble), "")
    if trouble:
        return {}, trouble
    return {name: float(np.mean([rest.torques[name] for rest in positions])) for name in train.at_rest.torques}, ""


def _settled(train: Drivetrain) -> Drivetrain:
    """Return a drivetrain whose wheels stay on their shafts as they are, however the shafts stand at the start."""
    wheels = [replace(wheel, angle=float(train.layout.wheels[wheel.name])) for wheel in train.wheels]
    meshes = [replace(mesh, phase=None) for mesh in train.meshes]
    return train.of_same_bodies(wheels=wheels, meshes=meshes)


def _turned(train: Drivetrain, time: float) -> Drivetrain:
    """Return a drivetrain that starts where it is after a time at its operating speed, s."""
    turned = {name: train.layout.angles[name] + speed * time for name, speed in train.speeds.items()}
    meshing = {(tie.second if forward else tie.first) for tie, forward, new in order(train) if new and tie.mesh}
    # an angle that was not given follows behind a universal joint
    meshing |= {c.second for c in train.couplings if c.kind == "universal"} & {
        s.name for s in train.shafts if s.angle is None
    }
    shafts = [replace(s, angle=None if s.name in meshing else turned[s.name]) for s in train.shafts]
    return train.of_same_bodies(shafts=shafts)


def _add_mesh(out: Rest, train: Drivetrain, mesh: Meshing, element: Any, rest: Any) -> None:
    """Add what a mesh does at rest."""
    out.forces[mesh.name] = float(rest.diagnostics(mesh.name)["normal_force"][-1])
    force, moment = (values[-1] for values in rest.load(mesh.name))
    geometry = train.pairs[mesh.name].geometry
    before_1, before_2 = (_axis(marker, marker.body.orientation) for marker in (element.i, element.j))
    (place_1, axis_1), (place_2, axis_2) = (_wheel_at_rest(marker, rest) for marker in (element.i, element.j))
    if not mesh.stage:
        # T_1 on the driver goes with -T_1 / ratio on the driven wheel, ratio = -s z_1 / z_2
        ratio = -geometry.sign * geometry.driver.teeth / geometry.driven.teeth
        out.torques[mesh.name] = float(-(moment @ axis_1) / ratio)
    across = -(force - (force @ axis_1) * axis_1)
    size = float(np.linalg.norm(across))
    if size == 0.0:
        return
    normal = across / size
    centres = place_2 - place_1
    # the centre distance of an internal pair is negative
    sense = float(np.sign(geometry.centre_distance))
    centres = sense * (centres - (centres @ axis_1) * axis_1)
    distance = float(np.linalg.norm(centres))
    beside = np.cross(axis_1, centres / distance)
    opening = float((axis_2 - axis_1) @ normal)
    out.openings[mesh.name] = opening - float((before_2 - before_1) @ normal)
    out.skews[mesh.name] = -opening / float(normal @ beside)
    out.apart[mesh.name] = sense * distance - geometry.centre_distance


def _wheel_at_rest(marker: Marker, rest: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the centre and the axis of a wheel, global; each shape (3,)."""
    body = marker.body
    if body.is_ground:
        return marker.position, marker.orientation[:, 2]
    turned = rest.orientation(body.name)[-1]
    bent = np.zeros(3)
    if isinstance(body, ModalBody):
        bent = rest.deflection(marker)[1][-1]
    place = rest.com_position(body.name)[-1] + turned @ (marker.position - body.com)
    return place, _axis(marker, turned, bent)


def _axis(marker: Marker, turned: np.ndarray, bent: np.ndarray | None = None) -> np.ndarray:
    """Return the z axis of a marker on a body of an orientation, turned by its deformation (rad, in its own axes)."""
    axis = marker.orientation[:, 2]
    if bent is not None:
        axis = axis + np.cross(bent, axis)
    return turned @ axis
