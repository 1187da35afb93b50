"""The paper's mechanism: two gears on two shafts, one shaft driven, the other loaded."""

from __future__ import annotations

import numpy as np

from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism, ramp, step

GEARS = ("gear 1", "gear 2")
SHAFTS = ("shaft 1", "shaft 2")
SEATS = ("seat 1", "seat 2")
BEARINGS = ("bearing 1", "bearing 2")
MESH = "mesh"
LOAD = "load"
DRIVE = "drive"


def gear_rig(
    pair: GearPair,
    *,
    speed: float,
    torque: float,
    run_up: float = 0.05,
    shaft_radius: float = 0.015,
    shaft_length: float = 0.200,
    shaft_density: float = 7850.0,
) -> Mechanism:
    """Return the mechanism of the paper's Fig. 1 for a gear pair.

    Both gears are fixed to their shafts, both shafts turn in revolute joints on the ground. The driver's shaft follows
    a rotation that reaches ``speed`` after ``run_up``; a torque on the driven shaft resists and grows as smoothly.

    Parameters
    ----------
    pair : GearPair
    speed : float
        Of the driver, rad/s.
    torque : float
        On the driven shaft, N m.
    run_up : float
        Duration of the STEP of speed and torque, s.
    shaft_radius, shaft_length : float
        m. The shafts are solid cylinders centred on their wheels.
    shaft_density : float
        kg/m^3.

    Returns
    -------
    Mechanism
        Named parts: gear 1, gear 2, shaft 1, shaft 2, seat 1, seat 2 (fixed), bearing 1, bearing 2 (revolute), drive
        (motion), load (torque), mesh (contact).
    """
    place = pair.placement(0.0)
    rig = Mechanism("gear pair on two shafts")
    mass = shaft_density * np.pi * shaft_radius**2 * shaft_length
    across = mass * (3.0 * shaft_radius**2 + shaft_length**2) / 12.0
    moments = (across, across, 0.5 * mass * shaft_radius**2)
    frames = ((place.origin_1, place.axes_1), (place.origin_2, place.axes_2))
    for k, ((origin, axes), wheel) in enumerate(zip(frames, pair.wheels)):
        gear = rig.body(GEARS[k], wheel.mass, wheel.inertia, position=origin, orientation=axes)
        shaft = rig.body(SHAFTS[k], mass, moments, position=origin, orientation=axes)
        rig.fixed(SEATS[k], gear, shaft, at=origin, axis=axes[:, 2])
        bearing = rig.revolute(BEARINGS[k], shaft, rig.ground, at=origin, axis=axes[:, 2])
        if k == 0:
            rig.rotation(DRIVE, bearing, ramp(pair.rotation * speed, over=run_up))
    load = step(0.0, 0.0, run_up, pair.rotation * torque)
    rig.torque(LOAD, rig.bodies[SHAFTS[1]], load, axis=place.axes_2[:, 2])
    rig.gear_contact(MESH, rig.bodies[GEARS[0]], rig.bodies[GEARS[1]], pair)
    return rig
