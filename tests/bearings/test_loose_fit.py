"""Rings that are loose on their seats: bodies of their own, which lie where the load puts them, rattle and creep."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gearmbs.bearings import Bearing, BearingError, BearingStatics, LooseFit, RollingBearing, Spall, add_bearing
from gearmbs.bearings.element import ring_inertia
from gearmbs.mechanism import Mechanism
from gearmbs.studies import bearing_rig

DEEP = Bearing.from_designation("6205")
SPEED = 2.0 * np.pi * 30.0


def test_ring_lies_where_the_load_puts_it():
    """The housing, drawn along -x, sinks by half the clearance, the seat's and the bearing's own deflection."""
    fit = LooseFit(clearance="40 um", stiffness=2e8)
    rig = bearing_rig(DEEP, speed=1.0, radial_load=400.0, mount_frequency="2 Hz", mount_damping=20.0, defects=[fit])
    solution = rig.simulate(0.3, rate=1000, tol=1e-8)
    assert solution.success, solution.message
    ring, housing = solution.com_position("bearing.outer ring")[-1], solution.com_position("housing")[-1]
    carried = float(solution.load("bearing")[0][-1, 0])
    own = BearingStatics(DEEP).under([abs(carried), 0.0, 0.0]).displacement[0]
    # elements hardly move at 1 rad/s, varying compliance is below 1 % of the deflection
    assert abs(ring[0]) == pytest.approx(own, rel=0.02)
    assert abs(housing[0] - ring[0]) == pytest.approx(20e-6 + abs(carried) / 2e8, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("part", ["outer", "inner"])
def test_energy_closes_with_loose_rings(part):
    fit = LooseFit(part=part, clearance="10 um")
    rig = bearing_rig(DEEP, speed=SPEED, radial_load=400.0, axial_load=30.0, defects=[fit, Spall(width="1 mm")])
    solution = rig.simulate(0.03, rate=500000, tol=1e-10)
    assert solution.success, solution.message
    assert solution.energy_balance().attrs["relative_imbalance"] < 1e-6


@pytest.mark.slow
def test_stiff_and_narrow_seat_is_a_fixed_ring():
    places = []
    for fit in ([], [LooseFit(clearance="0.02 um", stiffness=2e10, creep=1e3)]):
        rig = bearing_rig(DEEP, speed=SPEED, radial_load=400.0, axial_load=30.0, defects=fit)
        places.append(rig.simulate(0.05, rate=2000, tol=1e-8).com_position("housing")[-40:])
    np.testing.assert_allclose(places[1][:, 0], places[0][:, 0], rtol=2e-2)


def test_mass_of_a_ring():
    """An outer ring of a 6205 has about 60 g of the bearing's 130 g."""
    mass, moments = ring_inertia(DEEP, "outer")
    assert 0.03 < mass < 0.08
    assert moments[2] == pytest.approx(mass * 0.024**2, rel=0.1)
    with pytest.raises(BearingError, match=r"needs Bearing\.outside_diameter and Bearing\.width"):
        ring_inertia(Bearing.from_designation("MFPT"), "outer")


def test_what_is_wrong_is_said():
    m = Mechanism()
    shaft = m.body("shaft", 1.0, (1e-3, 1e-3, 1e-3))
    with pytest.raises(BearingError, match="add_bearing"):
        RollingBearing("a", shaft.marker(), m.ground.marker(), bearing=DEEP, defects=[LooseFit()])
    with pytest.raises(BearingError, match="more than one LooseFit"):
        add_bearing(m, "a", shaft.marker(), m.ground.marker(), DEEP, defects=[LooseFit(), LooseFit()])
    with pytest.raises(BearingError, match=r"LooseFit\.clearance"):
        add_bearing(m, "b", shaft.marker(), m.ground.marker(), DEEP, defects=LooseFit(clearance="3 mm"))
    assert LooseFit(clearance="30 um").description["label"] == "loose fit"
    assert math.isclose(LooseFit(clearance="30 um").severity, 30e-6)
