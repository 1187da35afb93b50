"""Bending of a ring's rim between the bolts that hold it, as a circular beam under the load of a tooth.

References
----------
.. [1] Chen, Z., Shao, Y.: Mesh stiffness of an internal spur gear pair with ring gear rim deformation. Mechanism and
   Machine Theory 69 (2013) 1-12. The rim as a uniformly curved Timoshenko beam between its supports.
"""

from __future__ import annotations

import math

import numpy as np

from gearmbs.gears.spec import GearSpec

SHEAR = 1.2
"""Shear correction of a rectangular section."""
STATIONS = 400
"""Of the integration along a half of the beam."""


def arc_flexibility(radius: float, angle: float, thickness: float, width: float, moduli: tuple[float, float]):
    """Return the flexibility of a circular cantilever at its free end.

    Parameters
    ----------
    radius, thickness, width : float
        Of the middle line and of the section, m.
    angle : float
        From the free end, which is on the x axis, to the clamp, rad; its sign tells on which side.
    moduli : (float, float)
        Young's and shear modulus, N/m^2.

    Returns
    -------
    ndarray, shape (3, 3)
        Displacements outwards and along the rim, m, and turn, rad, by forces (N) and moment (N m) in these directions.
    """
    phi = angle * (np.arange(STATIONS) + 0.5) / STATIONS
    sin, cos, one = np.sin(phi), np.cos(phi), np.ones(STATIONS)
    # what a force outwards, one along the rim and a moment at the end make in a section
    moment = np.stack([radius * sin, radius * (1 - cos), one])
    normal = np.stack([-sin, cos, 0 * one])
    shear = np.stack([cos, sin, 0 * one])
    area = width * thickness
    young, rigid = moduli
    per = abs(angle) * radius / STATIONS
    return per * (
        moment @ moment.T / (young * area * thickness**2 / 12)
        + normal @ normal.T / (young * area)
        + SHEAR * shear @ shear.T / (rigid * area)
    )


def rim_compliance(gear: GearSpec, supports: int, beta: np.ndarray, lever: np.ndarray) -> np.ndarray:
    """Compliance of a ring's rim under the load of a tooth half-way between two bolts [1]_, m/N.

    Parameters
    ----------
    gear : GearSpec
        Internal wheel.
    supports : int
        Evenly spaced bolts, at which the rim is clamped.
    beta : ndarray
        Angle of the load against the direction across the tooth, rad; it pushes outwards.
    lever : ndarray
        Height above the root where the load meets the tooth's middle line, m.

    Raises
    ------
    ValueError
        For an external wheel, or fewer than two bolts.
    """
    if not gear.internal:
        raise ValueError(f"{gear.name} is external; only the rim of an internal wheel is held by bolts")
    if not (isinstance(supports, int) and supports >= 2):
        raise ValueError(f"rim_supports is {supports!r}; give the number of bolts, 2 or more")
    young = gear.material.youngs_modulus
    moduli = young, young / (2 * (1 + gear.material.poisson_ratio))
    thickness = gear.rim_thickness
    radius = gear.root_radius + 0.5 * thickness
    stiffness = sum(
        np.linalg.inv(arc_flexibility(radius, side * math.pi / supports, thickness, gear.face_width, moduli))
        for side in (1, -1)
    )
    beta = np.asarray(beta)
    inwards = np.asarray(lever) + 0.5 * thickness
    load = np.stack([np.sin(beta), np.cos(beta), -inwards * np.cos(beta)])
    return np.einsum("i...,ij,j...->...", load, np.linalg.inv(stiffness), load)
