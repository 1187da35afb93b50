"""The paper's pair on shafts that bend and twist."""

import numpy as np
import pytest

from gearmbs.flexible import ElasticMaterial
from gearmbs.gears import GearPair
from gearmbs.studies import flexible_rig


def run(coupling="full", stiffer=1.0, time=0.07, rate=2000):
    pair = GearPair.paper(backlash="0.1 mm")
    material = ElasticMaterial(2.1e11 * stiffer)
    rig = flexible_rig(pair, speed="300 rpm", run_up=0.05, modes=1, coupling=coupling, material=material, damping=0.3)
    solution = rig.simulate(time, rate=rate, tol=1e-6)
    assert solution.success, solution.message
    return solution


@pytest.mark.slow
def test_shafts_bend_and_twist_by_the_tooth_force():
    # the energy balance sums powers over the outputs
    solution = run(rate=8000)
    rig = solution.system
    balance = solution.energy_balance()
    assert balance.attrs["relative_imbalance"] < 1e-4
    q = solution.modal_coordinates("shaft 2")
    assert np.abs(q).max() > 1e-7
    assert rig is not None
    # statics of a beam on two supports: F l^3 / 48 E I at the wheel, within what three bending modes and shear give
    load = np.linalg.norm(solution.reaction("bearing 2")[0][-10:], axis=1).mean() * 2
    place = solution.marker_position("shaft 2.wheel")[-10:]
    middle = 0.5 * (solution.marker_position("shaft 2.beginning") + solution.marker_position("shaft 2.end"))[-10:]
    bent = np.linalg.norm((place - middle)[:, :2], axis=1).mean()
    expected = load * 0.2**3 / (48 * 2.1e11 * np.pi / 64 * 0.03**4)
    assert 0.7 * expected < bent < 1.4 * expected


@pytest.mark.slow
def test_stiff_shafts_are_rigid_shafts():
    rigid = run("rigid")
    angles = [s.joint_angle("bearing 2") for s in (run(), run(stiffer=1e4), rigid)]
    far, near = (np.abs(a - angles[2]).max() for a in angles[:2])
    assert near < 1e-5 * np.ptp(angles[2])
    assert near < 0.01 * far
