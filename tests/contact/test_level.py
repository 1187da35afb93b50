"""Values of wheels that are parallel but for rounding, in closed form, against the general way with derivatives."""

import numpy as np
import pytest

from gearmbs.contact.places import LEVEL
from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.faults import ChippedCorner, Eccentricity

from .probe_tools import Contact, moved, rotation

PAIRS = {
    "paper": GearPair.paper(),
    "rounded tips": GearPair.paper(driver=GearSpec(29, 95e-3 / 31, tip_rounding="0.3 mm")),
    "few teeth": GearPair(GearSpec(17, "2 mm"), GearSpec(38, "2 mm"), backlash="0.1 mm"),
    "ring": GearPair(GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm"), backlash="0.2 mm"),
    "faults": GearPair.paper(faults=[Eccentricity(), *(ChippedCorner(tooth=k) for k in range(0, 29, 3))]),
}


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("tilt", [0.0, 1e-12, 0.9 * LEVEL**0.5, 1e-8])
def test_values_with_and_without_derivatives(name, tilt):
    contact = Contact(PAIRS[name], 1)
    rng = np.random.default_rng(3)
    kinds = set()
    for angle in rng.uniform(0, 2 * np.pi, 40):
        state = contact.state(angle, rng.uniform(5e-6, 60e-6), 100.0)
        lean = rng.normal(size=2)
        state[1] = rotation(np.array([*(tilt * lean / np.linalg.norm(lean)), 0.0])) @ state[1]
        state[4] = state[4] + rng.normal(size=3) * [0, 0, 1e-4]
        state = moved(state, rotation(rng.normal(size=3)), rng.normal(size=3) * 0.1)
        values = contact(state)
        told = contact.diag.copy()
        general = contact(state, 1)
        for part in (slice(0, 3), slice(3, 6)):
            assert values[part] == pytest.approx(general[part], rel=0, abs=1e-10 * abs(general[part]).max())
        assert told == pytest.approx(contact.diag, rel=1e-10)
        kinds.add(int(told[5]))
    assert len(kinds) > 1


@pytest.mark.parametrize("name", PAIRS)
def test_parallel_axes_have_sparse_derivatives(name):
    contact = Contact(PAIRS[name], 1)
    state = contact.state(0.1, 20e-6, 100.0)
    state[1] = rotation(np.array([3e-13, -2e-13, 0.0])) @ state[1]
    contact(state, 1)
    # without a tilt a displacement in the plane makes no axial force, and an axial one no force in the plane
    axial = contact.jac[2, [0, 1, 12, 13]]
    assert (axial == 0.0).all()
    assert (contact.jac[:2, [2, 14]] == 0.0).all()
    assert abs(contact.jac[:2, :2]).min() > 0.0
