"""Outputs of mechanisms with solids that touch, eight evaluated side by side and one after the other, at random poses.

A contact has one kernel, which both forms call for each output; what is compared is that its load reaches the lanes
that it belongs to, at poses at which patches differ from one output to the next.
"""

from itertools import combinations_with_replacement

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.contacts import (  # fmt: skip
    Box,
    Coulomb,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    Impact,
    Mesh,
    Sphere,
    Torus,
)
from tests.dae.model.test_side_by_side import records

CUBE = Box((0.1, 0.1, 0.1)).facets()
SHAPES = {
    "sphere": Sphere(0.1),
    "ellipsoid": Ellipsoid((0.12, 0.1, 0.08)),
    "box": Box((0.2, 0.15, 0.18)),
    "frustum": Frustum(0.1, 0.06, 0.2),
    "cylinder": Cylinder(0.1, 0.2),
    "torus": Torus(0.1, 0.04),
    "mesh": Mesh(1.8 * CUBE[0], CUBE[1]),
    "plane": HalfSpace(),
}
PAIRS = [pair for pair in combinations_with_replacement(SHAPES, 2) if pair != ("plane", "plane")]
OUTPUTS = 19
"""Two blocks of eight, and three outputs more."""


def touching(pair: tuple[str, str], draw: np.random.Generator) -> Mechanism:
    """Return a body on a guide and an axle, which spins in a solid of the ground that it overlaps."""
    m = Mechanism("pair", gravity=(0.0, 0.0, -9.81))
    carriage = m.body("carriage", 0.5, (1e-3, 1e-3, 1e-3))
    m.translational("guide", carriage, m.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    spin = draw.normal(size=3) * 40.0
    turn = Rotation.random(random_state=draw).as_matrix()
    body = m.body("body", 1.0, (2e-3, 3e-3, 4e-3), orientation=turn, angular_velocity=spin)
    m.spherical("ball", body, carriage, at=(0.0, 0.0, 0.0))
    first, second = (SHAPES[name] for name in pair)
    place = draw.uniform(-0.03, 0.03, 3) - (0.0, 0.0, 0.13 if pair[1] != "plane" else 0.05)
    other = m.ground.marker(place, np.eye(3) if pair[1] == "plane" else Rotation.random(random_state=draw).as_matrix())
    law, friction = Impact(2e4, 1.5, 20.0, 1e-3), Coulomb(0.3, 0.2, 0.05, 0.1)
    m.contact("touch", body.marker(), first, other, second, law, friction)
    return m


@pytest.mark.parametrize(
    "pair", [p if p[0] == p[1] else pytest.param(p, marks=pytest.mark.slow) for p in PAIRS], ids="-".join
)
def test_loads_of_contacts_are_the_same_side_by_side(pair):
    draw = np.random.default_rng(PAIRS.index(pair))
    solution = touching(pair, draw).simulate(0.03, t_eval=np.linspace(0.0, 0.03, OUTPUTS), tol=1e-5)
    assert solution.success, solution.message
    together, _ = records(solution, True)
    alone, _ = records(solution, False)
    for name, one, other in zip(together._fields, together, alone, strict=True):
        scale = max(1.0, np.abs(other).max())
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-12 * scale, err_msg=name)
    forces, _ = solution.load("touch")
    assert (np.abs(forces).max(axis=1) > 1.0).sum() > OUTPUTS // 3
