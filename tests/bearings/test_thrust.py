"""Thrust ball and cylindrical roller bearings: sizes, ratings, statics, and in a drivetrain."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

from gearmbs.bearings import Bearing, BearingError, BearingStatics
from gearmbs.bearings.designations.boundary import sizes
from gearmbs.bearings.rating import dynamic_rating, load_factors, static_rating
from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    GearMesh,
    RollingContactBearing,
    Shaft,
    SpeedDrive,
    TorqueLoad,
)
from gearmbs.gears import GearSpec
from tests.says import says

SERIES = ("511", "512", "513", "514", "811", "812")


def named(designation: str) -> Bearing:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return Bearing.from_designation(designation, estimate=True)


def test_each_size_has_the_dimensions_of_the_boundary_plan_and_the_ratings_of_a_maker():
    table = {f"{series}{code}": size for (series, code), size in sizes().items() if series in SERIES}
    assert len(table) == 151
    for designation, size in table.items():
        bearing = named(designation)
        told = bearing.bore, bearing.outside_diameter, bearing.width, bearing.rating
        assert told == (size.bore, size.outside_diameter, size.width, size.dynamic_rating)
        assert math.isclose(bearing.contact_angle, 0.5 * math.pi)
        assert bearing.estimated
        # what C says of the elements, C_0 says by another formula
        assert 0.75 < static_rating(bearing) / size.static_rating < 1.25, designation


@pytest.mark.parametrize(
    ("designation", "size"),
    [("51108", (40, 60, 13)), ("51210", (50, 78, 22)), ("51312", (60, 110, 35)), ("51410", (50, 110, 43)),
     ("81110", (50, 70, 14)), ("81212", (60, 95, 26))],
    ids=str,
)  # fmt: skip
def test_some_sizes_of_iso_104(designation, size):
    bearing = named(designation)
    found = [round(1e3 * value, 9) for value in (bearing.bore, bearing.outside_diameter, bearing.width)]
    assert tuple(found) == size


@pytest.mark.parametrize(("share", "factor"), [(0.01, 36.7), (0.03, 51.1), (0.10, 73.3), (0.20, 90.2), (0.34, 105.8)])
def test_the_factor_of_the_standards_table(share, factor):
    """f_c of thrust ball bearings at 90 degrees, ISO 281: C_a = 1.3 f_c Z^(2/3) d^1.8."""
    bearing = Bearing(
        elements=8, element_diameter=0.01, pitch_diameter=0.01 / share, contact_angle="90 deg", kind="thrust ball"
    )
    assert math.isclose(dynamic_rating(bearing), 1.3 * factor * 8 ** (2 / 3) * 10**1.8, rel_tol=3e-3)


@pytest.mark.parametrize("designation", ["51206", "81206"])
def test_all_elements_carry_alike(designation):
    bearing, force = named(designation), 5000.0
    found = BearingStatics(bearing).under((0.0, 0.0, force))
    moved = found.displacement[2]
    if not bearing.rollers:
        # rollers have a profile
        assert math.isclose(moved, (force / (bearing.elements * bearing.stiffness)) ** (2 / 3), rel_tol=1e-6)
    np.testing.assert_allclose(found.element_loads, force / bearing.elements, rtol=1e-9)
    more = BearingStatics(bearing).under((0.0, 0.0, 1.001 * force))
    axial = 0.001 * force / (more.displacement[2] - moved)
    assert math.isclose(found.stiffness[2, 2], axial, rel_tol=1e-3)
    # tilts: half the pitch radius squared of the axial stiffness
    assert math.isclose(found.stiffness[3, 3], 0.125 * bearing.pitch_diameter**2 * axial, rel_tol=0.02)
    if bearing.rollers:
        for wrong in ((0.0, 0.0, -force), (100.0, 0.0, force)):
            with pytest.raises(BearingError, match=says("5000.0", "sense")):
                BearingStatics(bearing).under(wrong)
    else:
        with pytest.warns(UserWarning, match=says("thrust ball", "sense", "+1")):
            BearingStatics(bearing).under((0.0, 0.0, -force))


def test_factors_of_the_equivalent_load():
    assert load_factors(named("51206"), 0.0, 1000.0) == (0.0, 1.0)
    with pytest.raises(BearingError, match=says("100", "1000", "thrust ball")):
        load_factors(named("51206"), 100.0, 1000.0)


def test_angles_that_are_none():
    given = {"elements": 12, "element_diameter": "8 mm", "pitch_diameter": "41 mm"}
    with pytest.raises(BearingError, match=says("Bearing.contact_angle", "60", "90")):
        Bearing(kind="thrust ball", contact_angle="60 deg", **given)
    with pytest.raises(BearingError, match=says("Bearing.contact_angle", "90", "angular contact")):
        Bearing(kind="angular contact", contact_angle="90 deg", **given)


def seated(*across: RollingContactBearing, sense: int = 1) -> Drivetrain:
    driver = GearSpec(21, "3 mm", helix_angle="15 deg", face_width="25 mm", bore_radius="15 mm")
    driven = GearSpec(52, "3 mm", helix_angle="15 deg", face_width="25 mm", hand="left", bore_radius="15 mm")
    thrust = [
        RollingContactBearing(name=f"t{k}", shaft="in", station=z, rolling="51106", sense=s)
        for k, (z, s) in enumerate(((0.0, sense), (0.2, -sense)))
    ]
    out = {"e": ("20 mm", "6206"), "f": ("180 mm", "6206")}
    return Drivetrain(
        "thrust",
        shafts=[
            Shaft(name="in", length="200 mm", wheels={"z1": ("100 mm", driver)}),
            Shaft(name="out", length="200 mm", wheels={"z2": ("100 mm", driven)}, bearings=out),
        ],
        bearings=[*thrust, *across],
        meshes=[GearMesh(name="stage", driver="z1", driven="z2", settings={"friction": {"kind": "none"}})],
        drives=[SpeedDrive(name="motor", shaft="in", speed="1500 rpm")],
        loads=[TorqueLoad(name="brake", shaft="out", torque="80 N m")],
        running=True,
    )


def rollers() -> list[RollingContactBearing]:
    return [
        RollingContactBearing(name=name, shaft="in", station=z, rolling="NU206")
        for name, z in (("a", 0.02), ("b", 0.18))
    ]


@pytest.mark.filterwarnings("ignore:designation")
@pytest.mark.parametrize("sense", [1, -1])
def test_a_helical_pinion_leans_on_the_one_in_its_way(sense):
    made = seated(*rollers(), sense=sense)
    rest = made.at_rest
    assert not rest.trouble
    wheel = made.part("z2").gear
    expected = 80.0 / wheel.pitch_radius * math.tan(wheel.helix_angle)
    axial = [abs(rest.bearings[name][2]) for name in ("t0", "t1")]
    assert math.isclose(max(axial), expected, rel_tol=0.01)
    assert min(axial) == 0.0


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("52208", ("two", "'51208'", "sense=1 and sense=-1")),
        ("54310", ("'51310'", "sense=-1")),
        ("53208 U", ("51208",)),
    ],
)
def test_those_of_two_directions_are_two(name, told):
    with pytest.raises(BearingError, match=says(*told)):
        Bearing.from_designation(name, estimate=True)


@pytest.mark.filterwarnings("ignore:designation")
@pytest.mark.parametrize("sense", [1, -1])
def test_two_of_one_at_one_station_hold_both_ways(sense):
    """As the message says: of the two that stand for 52206 the one in the way carries the pinion's thrust."""
    one = seated(*rollers(), sense=sense)
    made = one.with_parts(*(replace(one.part(name), rolling="51206", station=0.1) for name in ("t0", "t1")))
    rest = made.at_rest
    assert not rest.trouble
    wheel = made.part("z2").gear
    axial = sorted(abs(rest.bearings[name][2]) for name in ("t0", "t1"))
    assert axial[0] == 0.0
    assert axial[1] == pytest.approx(80.0 / wheel.pitch_radius * math.tan(wheel.helix_angle), rel=0.01)


@pytest.mark.filterwarnings("ignore:designation")
def test_they_hold_nothing_across():
    with pytest.raises(DrivetrainError, match=says("'in'", "'t0'", "'t1'")):
        seated()
