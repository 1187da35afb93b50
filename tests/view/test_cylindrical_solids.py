"""Solids and drawings of internal and helical wheels."""

import math

import numpy as np
import pytest
from scipy.interpolate import BSpline

from gearmbs.gears import GearPair, GearSpec, faults
from gearmbs.view import gear_outline, gear_solid, mesh_animation, pair_solids, profile_area, write_dxf, write_stl
from gearmbs.view.figures.drawings import action_ends, pitch_point
from gearmbs.view.profile import DEGREE, Spline, profile_edges
from gearmbs.view.step import Sweep
from tests.view.looking_at_step import check_shell, check_volume

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


@pytest.mark.slow
@pytest.mark.parametrize("name", WHEELS)
def test_step_is_a_closed_shell(name, tmp_path):
    check_shell(WHEELS[name], tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", WHEELS)
def test_step_volume_in_a_cad_kernel(name, tmp_path):
    # the area of an internal wheel is that of its outline's chords
    check_volume(WHEELS[name], tmp_path, rel=2e-4 if WHEELS[name].internal else 1e-8)


@pytest.mark.parametrize("name", ["helical", "helical ring"])
def test_step_surfaces_lie_on_the_helicoid(name):
    gear = WHEELS[name]
    sweep = Sweep(0.5 * gear.face_width, gear.twist_tangent / gear.base_radius)
    flank = next(edge for edge in profile_edges(gear) if isinstance(edge, Spline))
    u, v = np.linspace(flank.knots[0], flank.knots[-1], 37), np.linspace(-0.005, 0.005, 23)
    found = BSpline(flank.knots, BSpline(sweep.knots, sweep.points(flank.control), DEGREE, axis=1)(v), DEGREE)(u)
    assert found[..., 2] == pytest.approx(np.broadcast_to(v, (37, 23)), abs=1e-15)
    string = np.sqrt(np.maximum(np.hypot(found[..., 0], found[..., 1]) ** 2 - gear.base_radius**2, 0))
    away = np.arctan2(found[..., 1], found[..., 0]) - math.tan(gear.helix_angle) / gear.pitch_radius * v * (
        1 if gear.hand == "right" else -1
    )
    roll = string / gear.base_radius
    exact = gear.sign * (roll - np.arctan(roll)) - gear.base_half_angle
    assert away == pytest.approx(exact, abs=2e-10)


@pytest.mark.slow
def test_files(tmp_path):
    for name in ("ring", "helical ring"):
        assert write_stl(WHEELS[name], tmp_path / f"{name}.stl").stat().st_size > 1000
        assert write_dxf(WHEELS[name], tmp_path / f"{name}.dxf").stat().st_size > 1000


def test_faults_are_drawn_on_a_ring():
    ring = GearSpec.ring(70, "2 mm", helix_angle="15 deg", face_width="10 mm")
    one = GearSpec(24, "2 mm", helix_angle="15 deg", face_width="10 mm")
    broken = faults.BrokenTooth(wheel="driven", tooth=3, lost=0.5)
    pair = GearPair(one, ring, backlash="0.1 mm", faults=(broken, faults.TipRelief(wheel="driven", amount="20 um")))
    plain = pair_solids(pair.with_changes(faults=()), 1e-5)[1]
    drawn = pair_solids(pair, 1e-5)[1]
    assert drawn.watertight
    assert drawn.volume < plain.volume


@pytest.mark.parametrize("helix", [0.0, 0.26])
def test_animation_of_a_ring_shows_its_mesh(helix):
    ring = GearSpec.ring(70, "3 mm", helix_angle=helix)
    pinion = GearSpec(23, "3 mm", helix_angle=helix)
    pair = GearPair(pinion, ring, backlash="0.1 mm")
    assert pitch_point(pair) == pytest.approx(-pinion.pitch_radius)
    animation = mesh_animation(pair, frames=3, torque=20.0)
    for k, points in enumerate(animation.points):
        # flanks touch on the line of action
        place = animation.motion.placement(k)
        begin, end = action_ends(pair, pair.rotation)
        along = (end - begin) / np.linalg.norm(end - begin)
        away = (points.point - place.origin_1)[(points.force > 0) & (points.kind == 0)][:, :2] - begin
        assert len(away) > 0
        assert abs(away @ [-along[1], along[0]]).max() < 1e-12
        assert points.force.sum() * ring.base_radius == pytest.approx(20.0, rel=0.15)
