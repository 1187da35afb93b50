"""Kinds of joints whose rows take a number: a radius, of each joint its own."""

import numpy as np
import pytest

from gearmbs.dae.equations.constraints import terms
from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.mechanism.parts.functions import constant
from gearmbs.mechanism.parts.joints import JOINTS, JointKind, Row, Term, in_plane
from tests.says import says


@pytest.fixture(autouse=True)
def ring(monkeypatch):
    """I's origin stays on a circle about z_J."""

    def rows(i, j, radius):
        return [in_plane(i, j), Row(f"{radius:g} m from J", (Term(terms.DISTANCE, i, j),), constant(radius))]

    monkeypatch.setitem(JOINTS, "ring", JointKind(rows, numbers={"radius": "m"}))


def test_two_rings_of_one_mechanism_have_radii_of_their_own():
    m = Mechanism("beads")
    for name, radius, given in (("small", 0.2, "20 cm"), ("large", 0.5, 0.5)):
        bead = m.point_mass(name, 2.0, at=(radius, 0, 0), velocity=(0, 1.0, 0))
        m.joint("ring", f"{name} ring", bead.marker(), m.ground.marker(), numbers={"radius": given})
    run = m.simulate(0.5, rate=50, tol=1e-9)
    for name, radius in (("small", 0.2), ("large", 0.5)):
        place = run.com_position(name)
        np.testing.assert_allclose(np.linalg.norm(place, axis=1), radius, atol=1e-9)
        np.testing.assert_allclose(run.reaction(f"{name} ring")[0], -2.0 / radius**2 * place, atol=1e-5)


@pytest.mark.parametrize(
    ("kind", "numbers", "told"),
    [
        ("ring", None, ("radius", "m")),
        ("ring", {"radius": "0.2 kg"}, ("radius", "kg")),
        ("ring", {"radius": 0.2, "width": 0.1}, ("width", "radius")),
        ("spherical", {"radius": 0.2}, ("radius", "none")),
    ],
)
def test_numbers_that_are_missing_or_unknown_are_named(kind, numbers, told):
    m = Mechanism("bead")
    bead = m.point_mass("bead", 2.0, at=(0.2, 0, 0))
    with pytest.raises(ModelError, match=says("'guide'", *told)):
        m.joint(kind, "guide", bead.marker(), m.ground.marker(), numbers=numbers)
    assert not m.joints
