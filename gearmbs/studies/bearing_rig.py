"""Rigs with rolling bearings: one bearing in a housing on mounts, and the gear pair on four bearings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.bearings import Bearing, BearingError, RollingBearing, add_bearing
from gearmbs.bearings.errors import require
from gearmbs.mechanism import Mechanism
from gearmbs.studies.rig import BEARINGS, SHAFTS, gear_rig
from gearmbs.units import Quantity, to_si

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.dae.results.solution import Solution
    from gearmbs.gears import GearPair

BEARING = "bearing"
HOUSING = "housing"
SPINDLE = "spindle"
MOUNT = "mount"
ENDS = ("a", "b")


def bearing_rig(
    bearing: Bearing,
    *,
    speed: Quantity,
    radial_load: Quantity = 500.0,
    axial_load: Quantity = 0.0,
    run_up: Quantity = 0.02,
    housing_mass: Quantity = 3.0,
    mount_frequency: Quantity = "150 Hz",
    mount_damping: float = 0.2,
    **settings: Any,
) -> Mechanism:
    """Return a test bench: the inner ring on a driven spindle, the outer ring in a housing that stands on mounts.

    The load draws the housing along -x, so that the outer ring carries where x of its marker points, at angle 0, and
    its reaction is in the spindle. The spindle turns at full speed from the start, the loads grow during ``run_up``.

    Parameters
    ----------
    bearing : Bearing
    speed : float or str
        rad/s or text.
    radial_load, axial_load : float or str
        N. The axial load draws the housing along -z, against the inner ring.
    run_up : float or str
        s.
    housing_mass : float or str
        kg; a block of steel of that mass.
    mount_frequency : float or str
        Natural frequency of the housing on its mounts, Hz.
    mount_damping : float
        Fraction of critical damping there.
    **settings
        As of `gearmbs.bearings.add_bearing`: defects, cage_slip, damping, ...

    Returns
    -------
    Mechanism
        Named parts: spindle, housing (bodies), bearing, mount, load, and the joint and motion of the spindle.

    Examples
    --------
    >>> from gearmbs.bearings import Bearing, Spall
    >>> rig = bearing_rig(Bearing.from_designation("6205"), speed="1800 rpm", defects=Spall(width="1 mm"))
    >>> sorted(rig.bodies)
    ['housing', 'spindle']
    """
    speed = to_si(speed, "angular speed", "speed")
    radial, axial = to_si(radial_load, "force", "radial_load"), to_si(axial_load, "force", "axial_load")
    run_up, mass = to_si(run_up, "time", "run_up"), to_si(housing_mass, "mass", "housing_mass")
    if not (run_up > 0.0 and mass > 0.0 and mount_damping >= 0.0):
        raise BearingError(
            f"run_up is {run_up} s, housing_mass {mass} kg, mount_damping {mount_damping}; make them positive"
        )
    omega = 2.0 * np.pi * to_si(mount_frequency, "frequency", "mount_frequency")
    side = (mass / 7850.0) ** (1.0 / 3.0)
    moment = mass * side**2 / 6.0
    rig = Mechanism("bearing in a housing on mounts")
    spindle = rig.body(SPINDLE, mass=2.0, inertia=(2e-3, 2e-3, 1e-3), angular_velocity=(0.0, 0.0, speed))
    housing = rig.body(HOUSING, mass=mass, inertia=(moment, moment, moment))
    pin = rig.revolute("pin", spindle, rig.ground, at=(0, 0, 0), axis=(0, 0, 1))
    rig.rotation("drive", pin, speed, level="velocity")
    add_bearing(rig, BEARING, spindle.marker(name="bearing.I"), housing.marker(name="bearing.J"), bearing, **settings)
    # four feet at the corners of the block make it as stiff against tilting as against shifting
    rig.bushing(
        MOUNT,
        housing.marker(name="mount.I"),
        rig.ground.marker(name="mount.J"),
        stiffness=(mass * omega**2,) * 3,
        damping=(2.0 * mount_damping * mass * omega,) * 3,
        torsional_stiffness=(moment * (2.0 * omega) ** 2,) * 3,
        torsional_damping=(4.0 * mount_damping * moment * omega,) * 3,
    )
    rig.load(
        "load",
        housing.marker(name="load.I"),
        rig.ground.marker(name="load.J"),
        fx=f"STEP(TIME, 0, 0, {run_up!r}, {-radial!r})",
        fz=f"STEP(TIME, 0, 0, {run_up!r}, {-axial!r})",
    )
    return rig


def rolling_rig(
    pair: GearPair,
    bearing: Bearing,
    *,
    bearing_distance: Quantity = None,
    settings: dict[str, Any] | None = None,
    each: Mapping[str, dict[str, Any]] | None = None,
    **rig: Any,
) -> Mechanism:
    """Return the mechanism of :func:`gear_rig` with two rolling bearings on each shaft instead of its joints.

    Parameters
    ----------
    pair : GearPair
    bearing : Bearing
        All four are alike.
    bearing_distance : float or str, optional
        Between the bearings of a shaft, m; default: the length of the shaft.
    settings : dict, optional
        Of all bearings, see `gearmbs.bearings.RollingBearing`.
    each : mapping of str to dict, optional
        Settings of single bearings by name, which overrule those of all: ``{"bearing 1 a": {"defects": [...]}}``.
    **rig
        As of :func:`gear_rig`: speed, torque, run_up, shaft_radius, shaft_length, ...

    Returns
    -------
    Mechanism
        Bearings are named "bearing 1 a", "bearing 1 b", "bearing 2 a", "bearing 2 b".
    """
    names = [f"{name} {end}" for name in BEARINGS for end in ENDS]
    for given in each or {}:
        require(given in names, f"each: there is no {given!r}; choose among {', '.join(names)}")
    made = gear_rig(pair, **rig)
    length = rig.get("shaft_length", 0.2) if bearing_distance is None else bearing_distance
    half = 0.5 * to_si(length, "length", "bearing_distance")
    for name, shaft in zip(BEARINGS, SHAFTS):
        joint, body = made.joints.pop(name), made.bodies[shaft]
        axis = joint.j.global_orientation()[:, 2]
        for end, sign in zip(ENDS, (-1.0, 1.0)):
            made.add(
                RollingBearing.between(
                    f"{name} {end}", body, made.ground, bearing, at=body.position + sign * half * axis, axis=axis,
                    **{**(settings or {}), **(each or {}).get(f"{name} {end}", {})},
                )
            )  # fmt: skip
    return made


def housing_signal(solution: Solution, *, start: float = 0.0, body: str = HOUSING) -> xr.DataArray:
    """Return the acceleration of a housing as a signal, the input of the measuring chain (`gearmbs.signals.measure`).

    Parameters
    ----------
    solution : Solution
        With outputs at an even rate.
    start : float
        Time before which it is left out, s.
    body : str

    Returns
    -------
    xarray.DataArray
        Channels x, y, z in m/s^2.
    """
    from gearmbs.signals import make_signal

    keep = solution.t >= start - 1e-12
    rate = (solution.t.size - 1) / float(solution.t[-1] - solution.t[0])
    values = solution.com_acceleration(body)[keep]
    return make_signal(values, rate, channels=["x", "y", "z"], units="m/s^2")
