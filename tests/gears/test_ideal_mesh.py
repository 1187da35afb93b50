"""The ideal mesh made from a pair's tooth contact carries its load with its stiffness, for every kind of wheels."""

import math

import numpy as np
import pytest

from gearmbs.contact.ideal import ideal_mesh
from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec, IdealMesh
from gearmbs.gears.ideal_mesh import IdealMeshForce
from gearmbs.gears.transmission import StaticMesh

LOAD = 200.0


def torque_on_driven(compiled, place):
    """Torque of the kernel on the driven wheel about its axis, N m."""
    frames = np.zeros((2, 18))
    for row, (origin, axes) in zip(frames, place.frames):
        row[:3], row[3:12] = origin, axes.ravel()
    wrench, jac, none = np.zeros((1, 6)), np.zeros((6, 24)), np.zeros(0)
    work = np.zeros(compiled.scratch)
    ideal_mesh(compiled.integers, compiled.reals, 0.0, frames, none, none, 1, work, wrench, none, jac, np.zeros(4))
    moment = -wrench[0, 3:] + np.cross(place.origin_2 - place.origin_1, wrench[0, :3])
    return float(moment @ place.axes_2[:, 2])


@pytest.mark.parametrize("helix", [0.0, 0.26])
@pytest.mark.parametrize("internal", [False, True])
def test_load_and_stiffness_are_those_of_the_teeth(internal, helix):
    one = GearSpec(23, "3 mm", helix_angle=helix)
    two = GearSpec(
        70 if internal else 37,
        "3 mm",
        helix_angle=helix,
        internal=internal,
        hand="right" if internal else "left",
    )
    pair = GearPair(one, two, backlash="0.2 mm", contact=ContactLaw.linear("4e8 N/m"), friction=FlankFriction.none())
    compiled = IdealMeshForce("mesh", None, None, IdealMesh.from_contact(pair, LOAD, 64)).compiled()
    teeth = StaticMesh(pair)
    loads, slopes = [], []
    for k in range(7):
        angle = (k + 0.37) / 7 * 2 * math.pi / one.teeth
        driven = teeth.loaded_angle(angle, LOAD, teeth.ideal_angle(angle) + teeth.turning * 1e-4)
        step = 1e-7
        found = [torque_on_driven(compiled, pair.frames(angle, driven + s)) for s in (0.0, step, -step)]
        loads.append(abs(abs(found[0]) / LOAD - 1))
        slopes.append(abs((found[1] - found[2]) / (2 * step) / teeth.torque(angle, driven)[1] - 1))
    # where the number of teeth in contact steps, a curve through 64 points does so over a sixty-fourth of the cycle
    judged = np.max if helix else np.median
    assert judged(loads) < 2e-3
    assert judged(slopes) < 5e-3
