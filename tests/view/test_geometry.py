import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.faults import BrokenTooth, ChippedCorner, Eccentricity, Pit, PitchError
from gearmbs.view import gear_outline, gear_solid, pair_solids, profile_area, read_stl, write_dxf, write_step, write_stl
from gearmbs.view.mesh import ball, box, cylinder, rod
from gearmbs.view.profile import Arc, Spline, bore_edges, half_tooth, profile_edges
from tests.says import says
from tests.view.looking_at_step import check_shell, check_volume, step_entities

PAPER = GearPair.paper().driver
WHEELS = {
    "paper": PAPER,
    "rounded tips and bore": GearSpec(29, 3.0645e-3, tip_rounding=2e-4, bore_radius="10 mm"),
    "many teeth": GearSpec(62, "2 mm", bore_radius="17.5 mm"),
    "shifted": GearSpec(17, "2 mm", profile_shift=0.2),
    "thinned": GearSpec(20, "3 mm", thinning="0.1 mm"),
}


@pytest.fixture(params=WHEELS)
def wheel(request):
    return WHEELS[request.param]


def shoelace(points):
    x, y = points.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


@st.composite
def gears(draw):
    teeth = draw(st.integers(12, 90))
    module = draw(st.floats(0.5e-3, 8e-3))
    options = {
        "profile_shift": draw(st.floats(-0.2, 0.5)),
        "thinning": draw(st.floats(0.0, 0.05)) * module,
        "tip_rounding": draw(st.sampled_from([0.0, 0.05])) * module,
        "face_width": draw(st.floats(5e-3, 60e-3)),
    }
    try:
        gear = GearSpec(teeth, module, **options)
        return GearSpec(teeth, module, bore_radius=draw(st.floats(0.0, 0.9)) * gear.root_radius, **options)
    except ValueError:
        assume(False)


def test_outline_keeps_to_the_drawing(wheel):
    half = half_tooth(wheel)
    assert half.radius[0] == wheel.root_radius
    assert half.radius[-1] == wheel.tip_radius
    assert (np.diff(half.radius) > 0).all()
    # on the involute the half angle is that of the closed form used by the contact
    roll_length = np.sqrt(np.maximum(half.radius**2 - wheel.base_radius**2, 0.0))
    on = (
        (roll_length >= wheel.form_roll_length)
        & (roll_length <= wheel.tip_roll_length)
        & (half.radius > wheel.base_radius * 1.000001)
    )
    expected = [wheel.half_angle(r) for r in half.radius[on]]
    np.testing.assert_allclose(half.half_angle[on], expected, atol=1e-12)
    # the whole profile repeats every pitch and is symmetric about tooth 0
    outline = gear_outline(wheel)
    per_tooth = outline.reshape(wheel.teeth, -1, 2)
    angle = 2 * math.pi / wheel.teeth
    turned = per_tooth[0] @ [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
    np.testing.assert_allclose(per_tooth[1], turned, atol=1e-15)


def test_area_of_the_outline_is_that_of_the_closed_form(wheel):
    # chords within 1e-9 m of the curve leave out less than 1e-9 m times the length of the profile
    bore = math.pi * wheel.bore_radius**2
    length = np.linalg.norm(np.diff(gear_outline(wheel), axis=0), axis=1).sum()
    assert abs(shoelace(gear_outline(wheel, 1e-9)) - bore - profile_area(wheel)) < 1e-9 * length


def test_area_of_the_paper_s_wheel_by_quadrature():
    # area: integral of half the squared radius over the angle, here over half a tooth, 58 times
    half = half_tooth(PAPER, 1e-10)
    tooth = -np.trapezoid(0.5 * half.radius**2, half.half_angle)
    tip = 0.5 * PAPER.tip_radius**2 * half.half_angle[-1]
    land = 0.5 * PAPER.root_radius**2 * (math.pi / 29 - half.half_angle[0])
    assert profile_area(PAPER) == pytest.approx(58 * (tooth + tip + land), rel=1e-7)


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(gears())
def test_any_wheel_is_a_watertight_solid_of_the_right_volume(gear):
    solid = gear_solid(gear, 2e-6)
    assert solid.watertight
    assert solid.volume == pytest.approx(profile_area(gear) * gear.face_width, rel=1e-3)
    assert np.ptp(solid.vertices[:, 2]) == pytest.approx(gear.face_width)


def test_stl_weighs_what_the_wheel_weighs(wheel, tmp_path):
    path = write_stl(wheel, tmp_path / "wheel.stl")
    solid = read_stl(path)
    assert solid.watertight
    mass = wheel.material.density * profile_area(wheel) * wheel.face_width
    assert solid.volume * wheel.material.density == pytest.approx(mass, rel=5e-3)
    assert solid.volume * wheel.material.density == pytest.approx(mass, rel=1e-4)
    assert np.hypot(*solid.vertices[:, :2].T).max() == pytest.approx(wheel.tip_radius, rel=1e-6)


def test_stl_of_the_bore_and_units(tmp_path):
    gear = WHEELS["many teeth"]
    solid = read_stl(write_stl(gear, tmp_path / "in.stl", unit="in"), unit="in")
    radius = np.hypot(*solid.vertices[:, :2].T)
    assert radius.min() == pytest.approx(gear.bore_radius, rel=1e-5)
    with pytest.raises(ValueError, match="furlong"):
        write_stl(gear, tmp_path / "x.stl", unit="furlong")
    with pytest.raises(ValueError, match=says("solid", "str", "give a GearSpec")):
        write_stl("gear", tmp_path / "x.stl")
    (tmp_path / "bad.stl").write_bytes(b"x" * 100)
    with pytest.raises(ValueError, match=r"bad\.stl"):
        read_stl(tmp_path / "bad.stl")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad.stl", "in.stl"]


@pytest.mark.slow
def test_stl_of_a_pair_stands_where_the_pair_stands(tmp_path):
    pair = GearPair.paper(misalignment="1 deg", backlash="0.4 mm", centre_distance_error="3 mm")
    solid = read_stl(write_stl(pair, tmp_path / "pair.stl"))
    total = sum(profile_area(w) * w.face_width for w in pair.wheels)
    assert solid.volume == pytest.approx(total, rel=1e-4)
    assert solid.watertight
    # farthest point of the driven wheel: tip radius beyond its centre
    assert solid.vertices[:, 0].max() == pytest.approx(pair.centre_distance + 0.0475, abs=3e-4)


def test_thinned_teeth_are_written_thinner():
    plain, thinned = GearPair.paper(), GearPair.paper(backlash="0.4 mm")
    one, two = (gear_solid(p.wheels[0]).volume for p in (plain, thinned))
    # half the normal backlash over cos(alpha) leaves each tooth, about over its height; within 5 % of that
    cut = 29 * 0.2e-3 / math.cos(math.radians(20)) * (0.0475 - 0.0406) * 0.02
    assert one - two == pytest.approx(cut, rel=0.05)


@pytest.mark.slow
def test_faults_are_in_the_solid():
    pair = GearPair.paper(backlash="0.1 mm")
    whole = gear_solid(pair.wheels[0]).volume
    broken, driven = pair_solids(pair.with_faults(BrokenTooth(tooth=0, lost=0.5)))
    assert broken.watertight
    assert driven.volume == pytest.approx(whole, rel=1e-12)
    # tooth 0 points along +x; half of 6.895 mm of its height is gone
    near = broken.vertices[np.abs(np.arctan2(broken.vertices[:, 1], broken.vertices[:, 0])) < 0.05]
    assert np.hypot(*near[:, :2].T).max() == pytest.approx(0.0475 - 0.5 * (0.0475 - PAPER.root_radius), abs=1e-7)

    chipped, _ = pair_solids(pair.with_faults(ChippedCorner(tooth=0, height="3 mm", length="8 mm", end=1)))
    assert chipped.watertight
    near = chipped.vertices[np.abs(np.arctan2(chipped.vertices[:, 1], chipped.vertices[:, 0])) < 0.02]
    for z, tip in ((0.01, 0.0445), (-0.01, 0.0475)):
        assert np.hypot(*near[np.abs(near[:, 2] - z) < 1e-9, :2].T).max() == pytest.approx(tip, abs=1e-7)

    faults = (Eccentricity(amount="50 um"), PitchError(tooth=4), Pit(tooth=2, depth="0.2 mm", width="8 mm"))
    mixed, _ = pair_solids(pair.with_faults(*faults))
    assert mixed.watertight
    assert mixed.volume < whole * (1 + 1e-4)


def test_edges_close_and_follow_the_profile(wheel):
    edges = profile_edges(wheel)
    for one, two in zip(edges, edges[1:] + edges[:1]):
        np.testing.assert_allclose(one.stop, two.start, atol=1e-15)
    area = 0.0
    for edge in edges + bore_edges(wheel):
        points = edge.points(8001) if isinstance(edge, Spline) else np.array([edge.start, edge.stop])
        x, y = points.T
        area += 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
        if isinstance(edge, Arc):
            area += edge.sense * 0.5 * edge.radius**2 * (edge.opening - math.sin(edge.opening))
    assert area == pytest.approx(profile_area(wheel), rel=1e-8)
    spline = next(e for e in edges if isinstance(e, Spline)).points(501)
    radius = np.hypot(*spline.T)
    expected = np.array([wheel.half_angle(max(r, wheel.base_radius)) for r in radius])
    assert np.abs((-np.arctan2(spline[:, 1], spline[:, 0]) - expected) * radius).max() < 1e-10


def dxf_pairs(path):
    lines = path.read_text().splitlines()
    return list(zip(lines[::2], lines[1::2]))


def dxf_profiles(path):
    """Return vertices (x, y, bulge) of every polyline, mm."""
    out, vertex = [], None
    for code, value in dxf_pairs(path):
        if code == "0":
            if value == "POLYLINE":
                out.append([])
            vertex = [0.0, 0.0, 0.0] if value == "VERTEX" else None
            if vertex is not None:
                out[-1].append(vertex)
        elif vertex is not None and code in ("10", "20", "42"):
            vertex[("10", "20", "42").index(code)] = float(value)
    return [np.array(p) for p in out]


def bulged_area(profile):
    x, y, bulge = profile.T
    chord = np.hypot(np.roll(x, -1) - x, np.roll(y, -1) - y)
    opening = 4 * np.arctan(bulge)
    with np.errstate(divide="ignore", invalid="ignore"):
        segment = np.where(bulge == 0, 0.0, (chord / 2 / np.sin(opening / 2)) ** 2 / 2 * (opening - np.sin(opening)))
    return shoelace(profile[:, :2]) + segment.sum()


def test_dxf_holds_the_profile(wheel, tmp_path):
    path = write_dxf(wheel, tmp_path / "wheel.dxf")
    (profile,) = dxf_profiles(path)
    area = bulged_area(profile) * 1e-6 - math.pi * wheel.bore_radius**2
    assert area == pytest.approx(profile_area(wheel), rel=1e-5)
    layers = {v for c, v in dxf_pairs(path) if c == "8"}
    assert layers == {"PROFILE", "PITCH", "BASE"} | ({"BORE"} if wheel.bore_radius else set())


def test_dxf_of_a_pair_stands_where_the_pair_stands(tmp_path):
    pair = GearPair.paper(centre_distance_error="1 mm", backlash="0.1 mm")
    path = write_dxf(pair, tmp_path / "pair.dxf")
    one, two = dxf_profiles(path)
    # vertices repeat every pitch, so that their mean is the wheel's centre
    np.testing.assert_allclose(one[:, :2].mean(axis=0), [0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(two[:, :2].mean(axis=0), [pair.centre_distance * 1e3, 0.0], atol=1e-6)
    with pytest.raises(ValueError, match=says("gears", "with_changes", "misalignment=0")):
        write_dxf(pair.with_changes(misalignment=0.01), tmp_path / "x.dxf")
    with pytest.raises(ValueError, match=says("gears", "with_changes", "faults=()")):
        write_dxf(pair.with_faults(BrokenTooth()), tmp_path / "x.dxf")


@pytest.mark.slow
def test_dxf_passes_the_audit_of_another_program(wheel, tmp_path):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed")
    drawing = ezdxf.readfile(write_dxf(wheel, tmp_path / "wheel.dxf"))
    assert not drawing.audit().errors


def test_step_is_a_closed_shell(wheel, tmp_path):
    check_shell(wheel, tmp_path)


def test_step_of_a_pair_and_of_faults(tmp_path):
    pair = GearPair.paper(misalignment="1 deg", backlash="0.4 mm")
    entities = step_entities(write_step(pair, tmp_path / "pair.step"))
    assert sum(body.startswith("MANIFOLD_SOLID_BREP") for body in entities.values()) == 2
    with pytest.raises(ValueError, match="write_stl"):
        write_step(pair.with_faults(BrokenTooth()), tmp_path / "x.step")


@pytest.mark.slow
def test_step_volume_in_a_cad_kernel(wheel, tmp_path):
    check_volume(wheel, tmp_path)


def test_simple_solids():
    # a prism of n sides fills n/(2 pi) sin(2 pi/n) of the cylinder
    share = 48 / (2 * math.pi) * math.sin(2 * math.pi / 48)
    for mesh, volume in (
        (cylinder(1.0, 2.0), 2 * math.pi * share),
        (box(1.0, 2.0, 3.0), 6.0),
        (rod([0, 0, 0], [1, 2, 3], 0.1, 48), math.pi * 0.01 * math.sqrt(14) * share),
    ):
        assert mesh.watertight
        assert mesh.volume == pytest.approx(volume, rel=1e-12)
    assert ball(1.0, 60).watertight
    assert ball(1.0, 60).volume == pytest.approx(4 / 3 * math.pi, rel=2e-3)
    with pytest.raises(ValueError, match="two different points"):
        rod([1, 1, 1], [1, 1, 1], 0.1)
    with pytest.raises(ValueError, match=says("tolerance", "0.0", "give", "1e-6")):
        gear_outline(PAPER, 0.0)
