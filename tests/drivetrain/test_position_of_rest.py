"""The loaded position of rest against levers and springs by hand."""

import numpy as np
import pytest

from gearmbs.drivetrain import Drivetrain, ElasticBearing, GearMesh, Shaft, SpeedDrive, TorqueLoad
from gearmbs.gears import GearSpec

STIFFNESS, LENGTH, TORQUE = 2e8, 0.2, 100.0


def train(station, direction=0.0, speed=100.0, teeth=(20, 40)):
    """Rigid shafts on springs at both ends, with spur wheels at a station."""
    one, two = (GearSpec(abs(z), "3 mm", face_width="20 mm", bore_radius="10 mm", internal=z < 0) for z in teeth)
    spring = {"stiffness": (STIFFNESS,) * 3}
    shafts = [
        Shaft(name=name, length=LENGTH, diameter="20 mm", wheels={f"z {name}": (station, gear)})
        for name, gear in (("i", one), ("o", two))
    ]
    return Drivetrain(
        "levers",
        shafts=shafts,
        meshes=[GearMesh(name="m", driver="z i", driven="z o", direction=direction, settings={"backlash": "0.2 mm"})],
        bearings=[ElasticBearing(name=f"{name} {end}", shaft=name, station=place, **spring)
                  for name in "io" for end, place in (("left", 0.0), ("right", LENGTH))],
        drives=[SpeedDrive(name="motor", shaft="i", speed=speed)],
        loads=[TorqueLoad(name="brake", shaft="o", torque=TORQUE)],
    )  # fmt: skip


@pytest.mark.parametrize(("direction", "speed"), [(0.0, 100.0), (1.0, 100.0), (0.5, -100.0)])
def test_flanks_open_as_levers_say(direction, speed):
    """R_left = F (l - s) / l, R_right = F s / l; each axis tilts by (R_right - R_left) / (k l), against each other."""
    station = 0.04
    one = train(station, direction, speed)
    geometry = one.pairs["m"].geometry
    force = TORQUE / geometry.driven.base_radius
    left, right = force * (LENGTH - station) / LENGTH, force * station / LENGTH
    rest = one.at_rest
    assert rest.trouble == ""
    assert rest.forces["m"] == pytest.approx(force, rel=1e-3)
    assert np.hypot(*rest.bearings["i left"][:2]) == pytest.approx(left, rel=2e-3)
    assert np.hypot(*rest.bearings["o right"][:2]) == pytest.approx(right, rel=2e-3)
    tilt = 2.0 * (right - left) / (STIFFNESS * LENGTH)
    assert rest.openings["m"] == pytest.approx(tilt, rel=2e-3)
    # z_2 - z_1 of a skew gamma is -gamma y, and the line of action stands alpha to y
    alpha = geometry.working_pressure_angle
    assert rest.skews["m"] == pytest.approx(-np.sign(speed) * tilt / np.cos(alpha), rel=2e-3)
    # at the station both shafts give along the line of action, which stands alpha to the tangent
    lever = (left * (LENGTH - station) + right * station) / (STIFFNESS * LENGTH)
    assert rest.apart["m"] == pytest.approx(2.0 * lever * np.sin(alpha), rel=1e-2)


def test_symmetric_seats_do_not_tilt():
    rest = train(0.5 * LENGTH).at_rest
    assert abs(rest.openings["m"]) < 1e-12
    assert rest.torques["m"] == pytest.approx(-TORQUE, rel=1e-4)


def test_a_misalignment_is_no_tilt_under_load_but_counts():
    bent = train(0.5 * LENGTH).changed("m", settings={"misalignment": 1e-3})
    rest = bent.at_rest
    assert abs(rest.openings["m"]) < 1e-5
    assert rest.skews["m"] == pytest.approx(1e-3, abs=1e-5)


@pytest.mark.slow
def test_a_shaft_that_nothing_holds_has_no_position_of_rest():
    loose = train(0.04)
    bearings = [ElasticBearing(name=b.name, shaft=b.shaft, station=b.station, stiffness=(1e-30, 1e-30, 1e-30))
                for b in loose.bearings]  # fmt: skip
    rest = loose.with_parts(*bearings).at_rest
    assert rest.trouble
    assert rest.forces == {}
