"""The paper's mechanism: two gears on two shafts, one shaft driven, the other loaded."""

from __future__ import annotations

import numpy as np

from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism, ramp, step
from gearmbs.units import Quantity, to_si

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
    speed: Quantity,
    torque: Quantity = None,
    run_up: Quantity = 0.05,
    shaft_radius: Quantity = 0.015,
    shaft_length: Quantity = 0.200,
    shaft_density: Quantity = 7850.0,
) -> Mechanism:
    """Return the mechanism of the paper's Fig. 1 for a gear pair.

    Both gears are fixed to their shafts, both shafts turn in revolute joints on the ground. The driver's shaft follows
    a rotation in the sense of the pair's operating point that reaches ``speed`` after ``run_up``; a torque on the
    driven shaft resists and grows as smoothly.

    Parameters
    ----------
    pair : GearPair
    speed : float or str
        Of the driver, rad/s or text such as ``"1000 rpm"``.
    torque : float or str, optional
        On the driven shaft, N m; default that of the pair's operating point.
    run_up : float or str
        Duration of the STEP of speed and torque, s.
    shaft_radius, shaft_length : float or str
        m. The shafts are solid cylinders centred on their wheels.
    shaft_density : float or str
        kg/m^3.

    Returns
    -------
    Mechanism
        Named parts: gear 1, gear 2, shaft 1, shaft 2, seat 1, seat 2 (fixed), bearing 1, bearing 2 (revolute), drive
        (motion), load (torque), mesh (contact).

    Raises
    ------
    ValueError
        For text that is no quantity of its kind; the message names the argument.

    Examples
    --------
    >>> from gearmbs.gears import GearPair
    >>> rig = gear_rig(GearPair.paper(backlash="0.1 mm"), speed="1000 rpm", torque="100 N m")
    >>> sorted(rig.bodies)
    ['gear 1', 'gear 2', 'shaft 1', 'shaft 2']
    """
    point = pair.operating_point
    speed = point.rotation * to_si(speed, "angular speed", "speed")
    torque = point.rotation * (point.torque if torque is None else to_si(torque, "torque", "torque"))
    run_up = to_si(run_up, "time", "run_up")
    shaft_radius = to_si(shaft_radius, "length", "shaft_radius")
    shaft_length = to_si(shaft_length, "length", "shaft_length")
    shaft_density = to_si(shaft_density, "density", "shaft_density")
    place = pair.placement(0.0)
    rig = Mechanism("gear pair on two shafts")
    mass = shaft_density * np.pi * shaft_radius**2 * shaft_length
    across = mass * (3.0 * shaft_radius**2 + shaft_length**2) / 12.0
    moments = (across, across, 0.5 * mass * shaft_radius**2)
    for k, ((origin, axes), wheel) in enumerate(zip(place.frames, pair.wheels)):
        gear = rig.body(GEARS[k], wheel.mass, wheel.inertia, position=origin, orientation=axes)
        shaft = rig.body(SHAFTS[k], mass, moments, position=origin, orientation=axes)
        rig.fixed(SEATS[k], gear, shaft, at=origin, axis=axes[:, 2])
        bearing = rig.revolute(BEARINGS[k], shaft, rig.ground, at=origin, axis=axes[:, 2])
        if k == 0:
            rig.rotation(DRIVE, bearing, ramp(speed, over=run_up))
    load = step(0.0, 0.0, run_up, torque)
    rig.torque(LOAD, rig.bodies[SHAFTS[1]], load, axis=place.axes_2[:, 2])
    rig.gear_contact(MESH, rig.bodies[GEARS[0]], rig.bodies[GEARS[1]], pair)
    return rig
