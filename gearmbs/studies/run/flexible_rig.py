"""The paper's pair on two shafts that bend and twist."""

from __future__ import annotations

from gearmbs.flexible import Disc, ElasticMaterial, Shaft, ShaftSection
from gearmbs.flexible.material import Damping
from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism, ramp, step
from gearmbs.studies.run.rig import BEARINGS, DRIVE, LOAD, MESH, SHAFTS
from gearmbs.units import Quantity, to_si

SUPPORTS = ("support 1", "support 2")


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
    point = pair.operating_point
    speed = point.rotation * to_si(speed, "angular speed", "speed")
    torque = point.rotation * (point.torque if torque is None else to_si(torque, "torque", "torque"))
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
    rig.gear_contact(MESH, wheels[0], wheels[1], pair)
    return rig
