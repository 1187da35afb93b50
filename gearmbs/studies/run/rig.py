"""The paper's mechanism: two gears on two shafts, one shaft driven, the other loaded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Required, TypedDict, Unpack

import numpy as np

from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism, ramp, step
from gearmbs.studies.case.drive import drive_angle, load_torque
from gearmbs.units import Quantity, QuantityLike, to_si

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.bearings import Bearing
    from gearmbs.bearings.settings import BearingKeywords
    from gearmbs.dae.results.solution import Solution
    from gearmbs.flexible import ElasticMaterial
    from gearmbs.flexible.material import Damping

GEARS = ("gear 1", "gear 2")
SHAFTS = ("shaft 1", "shaft 2")
SEATS = ("seat 1", "seat 2")
BEARINGS = ("bearing 1", "bearing 2")
MESH = "mesh"
LOAD = "load"
DRIVE = "drive"

SUPPORTS = ("support 1", "support 2")


class RigKeywords(TypedDict, total=False):
    """Keywords of `gear_rig`, for type checkers."""

    speed: Required[Any]
    torque: Any
    run_up: QuantityLike
    start: QuantityLike | None
    shaft_radius: QuantityLike
    shaft_length: QuantityLike
    shaft_density: QuantityLike


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
    shaft_radius = to_si(shaft_radius, "length", "shaft_radius")
    shaft_length = to_si(shaft_length, "length", "shaft_length")
    shaft_density = to_si(shaft_density, "density", "shaft_density")
    angle = drive_angle(speed, run_up, start, point.rotation)
    load = load_torque(point.torque if torque is None else torque, run_up, start, resisting(pair))
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
    rig.aliases["operation.torque"] = f"{LOAD}.torque"
    rig.gear_contact(MESH, rig.bodies[GEARS[0]], rig.bodies[GEARS[1]], pair)
    return rig


def resisting(pair: GearPair) -> int:
    """Return the sense about the driver's axis in which a torque on the driven wheel resists; a ring turns alike."""
    return pair.rotation if pair.geometry.sign > 0 else -pair.rotation


# Rigs with rolling bearings: one bearing in a housing on mounts, and the gear pair on four bearings.


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
    **settings: Unpack[BearingKeywords],
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
    from gearmbs.bearings import BearingError, add_bearing

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
    **rig: Unpack[RigKeywords],
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
    from gearmbs.bearings import RollingBearing
    from gearmbs.bearings.kinds import require

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


# The pair on two shafts that bend and twist.


def flexible_rig(
    pair: GearPair,
    *,
    speed: Quantity,
    torque: Quantity = None,
    run_up: Quantity = 0.05,
    shaft_radius: Quantity = 0.015,
    shaft_length: Quantity = 0.200,
    material: ElasticMaterial | None = None,
    modes: int = 4,
    damping: Damping = ((1000.0, 0.01), (5000.0, 0.05), (20000.0, 0.3), (float("inf"), 1.0)),
    coupling: str = "full",
) -> Mechanism:
    """Return the mechanism of :func:`gear_rig` with modal bodies for the shafts, which carry their wheels.

    Each shaft turns in a self-aligning bearing at its beginning, where the driver's rotation is prescribed, and in
    one at its end that lets it move along its axis. The wheels are rigid discs at mid-length. The load acts at the end
    of the driven shaft.

    Parameters
    ----------
    pair, speed, torque, run_up, shaft_radius, shaft_length
        As of :func:`gear_rig`.
    material : ElasticMaterial, optional
        Of the shafts; default: steel.
    modes : int
        Shapes of each shaft with held seats, beside the 12 static ones of its three seats.
    damping : float, sequence or bands
        See :func:`gearmbs.flexible.damping_ratios`.
    coupling : {"full", "partial", "constant", "rigid"}
        See :meth:`gearmbs.flexible.ModalModel.add_to`; ``"rigid"`` gives rigid shafts in the same bearings.

    Returns
    -------
    Mechanism
        Named parts: shaft 1, shaft 2, bearing 1, bearing 2 (self-aligning), support 1, support 2 (inline), drive, load,
        mesh.

    Raises
    ------
    ValueError
        For text that is no quantity of its kind; the message names the argument.
    """
    from gearmbs.flexible import Disc, ElasticMaterial, Shaft, ShaftSection

    point = pair.operating_point
    speed = point.rotation * to_si(speed, "angular speed", "speed")
    torque = resisting(pair) * (point.torque if torque is None else to_si(torque, "torque", "torque"))
    run_up = to_si(run_up, "time", "run_up")
    length = to_si(shaft_length, "length", "shaft_length")
    diameter = 2.0 * to_si(shaft_radius, "length", "shaft_radius")
    place = pair.placement(0.0)
    rig = Mechanism("gear pair on two flexible shafts")
    wheels = []
    for k, ((origin, axes), wheel) in enumerate(zip(place.frames, pair.wheels)):
        across, _, polar = wheel.inertia
        shaft = Shaft(
            [ShaftSection(length, diameter)],
            [Disc(length / 2, mass=wheel.mass, polar=polar, diametral=across, name=f"gear {k + 1}")],
            {"beginning": 0.0, "wheel": length / 2, "end": length},
            material or ElasticMaterial(),
            name=SHAFTS[k],
        )
        model = shaft.modal_model(modes)
        start = origin - axes[:, 2] * length / 2
        body = model.add_to(rig, position=start, orientation=axes, damping=damping, coupling=coupling)
        first = body.marker(model.place("beginning"), name=f"{SHAFTS[k]}.beginning")
        last = body.marker(model.place("end"), name=f"{SHAFTS[k]}.end")
        wheels.append(body.marker(model.place("wheel"), name=f"{SHAFTS[k]}.wheel"))
        bearing = rig.joint(
            "self_aligning", BEARINGS[k], first, rig.ground.marker(start, axes, name=f"{BEARINGS[k]}.J")
        )
        rig.joint(
            "inline", SUPPORTS[k], last, rig.ground.marker(start + length * axes[:, 2], axes, name=f"{SUPPORTS[k]}.J")
        )
        if k == 0:
            rig.rotation(DRIVE, bearing, ramp(speed, over=run_up))
        else:
            rig.torque(LOAD, last, step(0.0, 0.0, run_up, torque), axis=axes[:, 2])
            rig.aliases["operation.torque"] = f"{LOAD}.torque"
    rig.gear_contact(MESH, wheels[0], wheels[1], pair)
    return rig
