"""The paper's mechanism: two gears on two shafts, one shaft driven, the other loaded."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism
from gearmbs.studies.drive import drive_angle, load_torque
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
    speed: Any,
    torque: Any = None,
    run_up: Quantity = 0.05,
    start: Quantity = None,
    shaft_radius: Quantity = 0.015,
    shaft_length: Quantity = 0.200,
    shaft_density: Quantity = 7850.0,
) -> Mechanism:
    """Return the mechanism of the paper's Fig. 1 for a gear pair.

    Both gears are fixed to their shafts, both shafts turn in revolute joints on the ground. The driver's shaft follows
    a rotation in the sense of the pair's operating point that reaches ``speed`` after ``run_up``; a torque on the
    driven shaft resists and grows as smoothly. Both may follow curves after that, for run-ups and coast-downs.

    Parameters
    ----------
    pair : GearPair
    speed : float or str, or sequence of points
        Of the driver, rad/s or text such as ``"1000 rpm"``; or points (time, speed) of a `gearmbs.mechanism.curve`.
    torque : float or str, or sequence of points, optional
        On the driven shaft, N m; default that of the pair's operating point.
    run_up : float or str
        Duration of the STEP of speed and torque, s; of curves to their first value.
    start : float or str, optional
        When the curves begin, s, not before ``run_up``, which is the default.
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
    run_up = to_si(run_up, "time", "run_up")
    start = run_up if start is None else to_si(start, "time", "start")
    if start < run_up:
        raise ValueError(f"start: {start:g} s is before the end of run_up, {run_up:g} s; give a later one")
    angle = drive_angle(speed, run_up, start, point.rotation)
    load = load_torque(point.torque if torque is None else torque, run_up, start, point.rotation)
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
            rig.rotation(DRIVE, bearing, angle)
    rig.torque(LOAD, rig.bodies[SHAFTS[1]], load, axis=place.axes_2[:, 2])
    rig.gear_contact(MESH, rig.bodies[GEARS[0]], rig.bodies[GEARS[1]], pair)
    return rig
