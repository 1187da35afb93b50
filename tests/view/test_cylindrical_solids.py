"""Solids and drawings of internal and helical wheels."""

import math

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec, faults
from gearmbs.view import gear_outline, gear_solid, pair_solids, profile_area, write_dxf, write_step, write_stl

WHEELS = {
    "ring": GearSpec.ring(50, "2 mm", face_width="10 mm"),
    "rounded ring": GearSpec.ring(50, "2 mm", face_width="10 mm", tip_rounding="0.2 mm"),
    "helical": GearSpec(24, "2 mm", helix_angle="20 deg", face_width="10 mm", bore_radius="8 mm"),
    "helical ring": GearSpec.ring(60, "2 mm", helix_angle="20 deg", hand="left", face_width="10 mm"),
}


@pytest.mark.parametrize("name", WHEELS)
def test_solids_are_closed_and_have_their_volume(name):
    gear = WHEELS[name]
    mesh = gear_solid(gear, 1e-5)
    assert mesh.watertight
    assert mesh.volume == pytest.approx(profile_area(gear) * gear.face_width, rel=2e-3)


@pytest.mark.parametrize("name", WHEELS)
def test_outline_lies_between_tip_and_root(name):
    gear = WHEELS[name]
    radius = np.hypot(*gear_outline(gear).T)
    low, high = sorted([gear.tip_radius, gear.root_radius])
    assert (radius.min(), radius.max()) == pytest.approx((low, high), rel=1e-9)


def test_the_helix_turns_the_sections():
    gear = WHEELS["helical"]
    points = gear_solid(gear, 1e-5).vertices
    # the middle of tooth 0 at both ends
    top, bottom = (points[np.isclose(points[:, 2], z)] for z in (0.005, -0.005))
    lead = math.tan(gear.helix_angle) / gear.pitch_radius * 0.01
    turned = np.column_stack(
        [
            bottom[:, 0] * math.cos(lead) - bottom[:, 1] * math.sin(lead),
            bottom[:, 0] * math.sin(lead) + bottom[:, 1] * math.cos(lead),
        ]
    )
    for point in turned[::37]:
        assert np.hypot(*(top[:, :2] - point).T).min() < 1e-9


def test_files(tmp_path):
    for name in ("ring", "helical ring"):
        assert write_stl(WHEELS[name], tmp_path / f"{name}.stl").stat().st_size > 1000
        assert write_dxf(WHEELS[name], tmp_path / f"{name}.dxf").stat().st_size > 1000
        with pytest.raises(ValueError, match="write_stl"):
            write_step(WHEELS[name], tmp_path / f"{name}.step")


def test_faults_are_drawn_on_a_ring():
    ring = GearSpec.ring(70, "2 mm", helix_angle="15 deg", face_width="10 mm")
    one = GearSpec(24, "2 mm", helix_angle="15 deg", face_width="10 mm")
    broken = faults.BrokenTooth(wheel="driven", tooth=3, lost=0.5)
    pair = GearPair(one, ring, backlash="0.1 mm", faults=(broken, faults.TipRelief(wheel="driven", amount="20 um")))
    plain = pair_solids(pair.with_changes(faults=()), 1e-5)[1]
    drawn = pair_solids(pair, 1e-5)[1]
    assert drawn.watertight
    assert drawn.volume < plain.volume
