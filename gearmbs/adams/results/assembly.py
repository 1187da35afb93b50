"""How far an analysis had to move the parts before it could start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs.adams.builders.model import AdamsModel, markers_of
from gearmbs.dae.results.solution import Solution

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
