"""Masses of View's solids: against integrals done anew over fine meshes, closed forms, and parts of whole ones."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_script, parse_view, read_view, run_deck
from gearmbs.adams.parse import statements as st
from gearmbs.adams.view.geometry import masses, solids
from tests.says import says

CELLS = 120
"""Along each side of a box of points: sums over them are within 1 % of integrals over smooth bodies."""


def by_points(inside, low, high):
    """Return the moments of what lies inside, from the middles of small cells."""
    low, high = np.array(low, float), np.array(high, float)
    step = (high - low) / CELLS
    axes = [low[k] + step[k] * (np.arange(CELLS) + 0.5) for k in range(3)]
    p = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    p = p[inside(*p.T)]
    cell = float(np.prod(step))
    return cell * len(p), cell * p.sum(axis=0), cell * p.T @ p


def angle_of(x, y):
    return np.arctan2(y, x) % (2 * np.pi)


CASES = {
    "box": (solids.box(2, -3, 4), lambda x, y, z: (x > 0) & (y < 0) & (z > 0), (0, -3, 0), (2, 0, 4)),
    "ellipsoid": (
        solids.ellipsoid(1, 2, 3), lambda x, y, z: x**2 + y**2 / 4 + z**2 / 9 < 1, (-1, -2, -3), (1, 2, 3),
    ),
    "frustum": (
        solids.frustum(3, 2, 1, 2 * np.pi), lambda x, y, z: np.hypot(x, y) < 2 - z / 3, (-2, -2, 0), (2, 2, 3),
    ),
    "sector": (
        solids.frustum(-2, 2, 2, 2.0),
        lambda x, y, z: (np.hypot(x, y) < 2) & (angle_of(x, y) < 2.0),
        (-2, -2, -2),
        (2, 2, 0),
    ),
    "torus": (
        solids.torus(3, 1, 4.0),
        lambda x, y, z: ((np.hypot(x, y) - 3) ** 2 + z**2 < 1) & (angle_of(x, y) < 4.0),
        (-4, -4, -1),
        (4, 4, 1),
    ),
    "revolution": (
        solids.revolution(np.array([[1.0, 0.0], [3.0, 0.0], [1.0, 2.0]]), 2 * np.pi),
        lambda x, y, z: (np.hypot(x, y) > 1) & (np.hypot(x, y) + z < 3),
        (-3, -3, 0),
        (3, 3, 2),
    ),
    "plate": (
        solids.rounded(np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]]), 0.5, -1, 1),
        lambda x, y, z: _near(x, y, [(0, 0), (4, 0), (0, 3)], 0.5),
        (-0.5, -0.5, -1),
        (4.5, 3.5, 1),
    ),
    "plate that goes inwards": (
        solids.rounded(np.array([[0.0, 0.0], [1.0, 2.0], [0.0, 4.0], [4.0, 2.0]]), 0.3, 0, 1),
        # the fillet of the inner corner is within the cells' own error
        lambda x, y, z: _near(x, y, [(0, 0), (1, 2), (0, 4), (4, 2)], 0.3),
        (-0.5, -0.5, 0),
        (4.5, 4.5, 1),
    ),
    "prism": (
        solids.frustum(3, 1, 1, 2 * np.pi, 4),
        lambda x, y, z: np.abs(x) + np.abs(y) < 1,
        (-1.01, -1.02, 0),
        (1.03, 1.01, 3),
    ),
}  # fmt: skip


def _near(x, y, corners, radius):
    """Return which points are in a polygon or within a distance of its edges."""
    inside, near = np.zeros(x.shape, bool), np.zeros(x.shape, bool)
    for (px, py), (qx, qy) in zip(corners, [*corners[1:], corners[0]]):
        with np.errstate(divide="ignore", invalid="ignore"):
            crosses = (py > y) != (qy > y)
            inside ^= crosses & (x < (qx - px) * (y - py) / np.where(qy == py, np.inf, qy - py) + px)
        share = np.clip(((x - px) * (qx - px) + (y - py) * (qy - py)) / ((qx - px) ** 2 + (qy - py) ** 2), 0, 1)
        near |= np.hypot(x - px - share * (qx - px), y - py - share * (qy - py)) < radius
    return near | (inside if len(corners) > 2 else False)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_moments_are_those_of_the_body(name):
    found, inside, low, high = CASES[name]
    volume, first, second = by_points(inside, low, high)
    size = float(np.linalg.norm(np.subtract(high, low)))
    assert np.isclose(found.volume, volume, rtol=0.01)
    assert np.allclose(found.first, first, rtol=0, atol=0.01 * volume * size)
    assert np.allclose(found.second, second, rtol=0, atol=0.01 * volume * size**2)


def test_a_box_of_triangles_is_the_box():
    corners = np.array([[x, y, z] for x in (0, 2.0) for y in (0, 3.0) for z in (0, 4.0)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([(a, b, c) for f in faces for a, b, c in (f[:3], (f[0], f[2], f[3]))])
    found, box = solids.polyhedron(corners, triangles), solids.box(2, 3, 4)
    assert np.isclose(found.volume, box.volume)
    assert np.allclose(found.first, box.first)
    assert np.allclose(found.second, box.second)


def test_moved_moments_are_those_about_another_point():
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    moved = solids.box(2, 3, 4).moved(turn, np.array([3.0, 0, 0]))
    assert np.allclose(moved.first, solids.box(3, 2, 4).first)
    assert np.allclose(moved.second, solids.box(3, 2, 4).second)


PART = """\
model create model_name = m
defaults units length = meter angle = deg force = newton mass = kg time = sec
material create material_name = .m.oak density = 700
part create rigid_body name_and_position part_name = .m.P location = 0, 0, 0
marker create marker_name = .m.P.A location = 1, 0, 0
"""
MASSES = """\
part create rigid_body mass_properties part_name = .m.P %s
geometry create shape block block_name = .m.P.BOX corner_marker = .m.P.A diag_corner_coords = 2, 1, 1
%s
"""


@pytest.mark.parametrize(
    ("material", "density"),
    [("material_type = .m.oak", 700.0), ("density = 5", 5.0), ("density = (5(kg/cm**3))", 5e6), ("", 7801.0)],
)
def test_mass_from_density(material, density):
    part = parse_view(PART + MASSES % (material or "material_type = steel", "")).deck.of(st.Part)[2]
    assert np.isclose(part.mass, 2.0 * density)
    assert np.allclose(part.ip, np.array([2.0, 5.0, 5.0]) * 2.0 * density / 12.0)


@pytest.mark.parametrize(
    "marker", ["", "marker create marker_name = .m.P.cm location = 9, 9, 9 orientation = 90, 0, 0\n"]
)
def test_a_part_without_a_density_has_no_mass_whatever_its_solids(marker):
    """As View exported one: nemesis5324/DL---Dong-luc-hoc-Robot, Link1 of Controls_Plant_1.adm."""
    given = MASSES % ("density = 2", "")
    deck = parse_view(PART + marker + given[given.index("geometry") :]).deck
    part = deck.of(st.Part)[2]
    assert (part.mass, part.ip) == (0.0, None)
    assert [d.line for d in deck.diagnostics if "material_type" in d.message] == [4]
    twin = parse_view(PART + marker + given).deck
    assert twin.of(st.Part)[2].mass == pytest.approx(4.0, rel=1e-12)
    assert not [d for d in twin.diagnostics if "material_type" in d.message]


def test_a_cm_marker_goes_to_the_centre():
    marker = "marker create marker_name = .m.P.cm location = 9, 9, 9 orientation = 90, 0, 0\n"
    deck = parse_view(PART + marker + MASSES % ("density = 1", "")).deck
    assert np.allclose(deck.of(st.Marker)[deck.of(st.Part)[2].cm].qp, (2.0, 0.5, 0.5))
    assert np.allclose(deck.of(st.Part)[2].ip, np.array([5.0, 2.0, 5.0]) / 6.0)


@pytest.mark.parametrize(
    ("kind", "volume", "centre"),
    [
        ("difference", 2.0 - 0.75, (2.0 * 2.0 - 0.75 * 2.25) / 1.25),
        ("intersection", 0.75, 2.25),
        ("union", 2.0 + 1.5 - 0.75, (2.0 * 2.0 + 1.5 * 3.0 - 0.75 * 2.25) / 2.75),
    ],
)
def test_blocks_put_together(kind, volume, centre):
    """A block from x = 1 to 3 of section 1, and one from 1.5 to 4.5 (of half the width, a quarter turned) within it."""
    csg = (
        "marker create marker_name = .m.P.B location = 1.5, 1, 0.5 orientation = 0, 90, 0\n"
        "geometry create shape block block_name = .m.P.IN corner_marker = .m.P.B diag_corner_coords = 3, 0.5, 1\n"
        f"geometry create shape csg csg_name = .m.P.C base_object = .m.P.BOX object = .m.P.IN type = {kind}"
    )
    deck = parse_view(PART + MASSES % ("density = 1", csg)).deck
    part = deck.of(st.Part)[2]
    assert part.mass == pytest.approx(volume)
    assert deck.of(st.Marker)[part.cm].qp[0] == pytest.approx(centre)


AXLE = math.pi * 0.3**2
HALF = AXLE * (3.0 - 4.0 * 0.3 / (3.0 * math.pi)) / 2.0
"""First moment of the half of it that is within the block."""


@pytest.mark.parametrize(
    ("kind", "volume", "moment"),
    [
        ("union", 2.0 + 2.5 * AXLE, 4.0 + 9.0 * AXLE - HALF),
        ("difference", 2.0 - AXLE / 2.0, 4.0 - HALF),
        ("intersection", AXLE / 2.0, HALF),
    ],
)
def test_a_block_and_an_axle(kind, volume, moment):
    """A block from x = 1 to 3 of section 1, and a cylinder of radius 0.3 across its end face, longer than it."""
    csg = (
        "marker create marker_name = .m.P.B location = 3, 0.5, -1 orientation = 0, 0, 0\n"
        "geometry create shape cylinder cylinder_name = .m.P.IN center_marker = .m.P.B length = 3 radius = 0.3\n"
        f"geometry create shape csg csg_name = .m.P.C base_object = .m.P.BOX object = .m.P.IN type = {kind}"
    )
    deck = parse_view(PART + MASSES % ("density = 1", csg)).deck
    part = deck.of(st.Part)[2]
    assert part.mass == pytest.approx(volume, rel=2e-5)
    assert deck.of(st.Marker)[part.cm].qp[0] == pytest.approx(moment / volume, rel=2e-5)


BLEND = (
    "geometry create feature blend blend_name = .m.P.BOX.BLEND_1 radius1 = {0} radius2 = {0} chamfer = {1}  &\n"
    "   reference_marker = .m.P.A locations = {2}"
)


@pytest.mark.parametrize(
    ("radius", "chamfer", "area", "reach"),
    [
        (0.5, "yes", 0.5**2 / 2.0, 0.5 / 3.0),
        (0.5, "no", 0.5**2 * (1.0 - np.pi / 4.0), 0.5 * (1.0 / 2.0 - (np.pi / 4.0 - 1.0 / 3.0)) / (1.0 - np.pi / 4.0)),
    ],
)
def test_an_edge_of_a_block_is_taken_off(radius, chamfer, area, reach):
    """Of a block of 2 by 1 by 1 from x = 1, the edge at its far side, along y."""
    blend = BLEND.format(radius, chamfer, "2, 0.5, 1")
    deck = parse_view(PART + MASSES % ("density = 1", blend)).deck
    part = deck.of(st.Part)[2]
    assert part.mass == pytest.approx(2.0 - area)
    left = np.array(deck.of(st.Marker)[part.cm].qp) * part.mass
    assert left == pytest.approx(np.array([2.0, 0.5, 0.5]) * 2.0 - area * np.array([3.0 - reach, 0.5, 1.0 - reach]))


def test_a_ball_larger_than_a_side_touches_its_far_end():
    """A ball of 1.25 on a side of 1: what it leaves is the segment between both."""
    deck = parse_view(PART + MASSES % ("density = 1", BLEND.format(1.25, "no", "2, 0.5, 1"))).deck
    width = np.sqrt(1.25**2 - 0.25**2)
    under = 0.5 * (width * 0.25 + 1.25**2 * np.arcsin(width / 1.25))
    assert deck.of(st.Part)[2].mass == pytest.approx(2.0 - (1.25 * width - under))


@pytest.mark.parametrize(
    "blend",
    [
        BLEND.format(0.5, "no", "2, 0.5, 1, 2, 1, 0.5"),
        BLEND.format(0.7, "no", "2, 0.5, 1, 2, 0.5, 0"),
        BLEND.format(1.5, "yes", "2, 0.5, 1"),
        "geometry create feature hole hole_name = .m.P.BOX.H radius = 0.1 reference_marker = .m.P.A",
    ],
    ids=["edges that meet", "arcs that meet", "a large chamfer", "a hole"],
)
def test_other_features_are_refused(blend):
    refused = parse_view(PART + MASSES % ("density = 1", blend)).deck
    assert re.search(says(".m.P.BOX", "features", "center_of_mass_marker"), refused.unsupported[0].message)


def test_what_has_no_formula_is_refused_and_with_a_mass_runs():
    csg = (
        "geometry create shape ellipsoid ellipsoid_name = .m.P.E center_marker = .m.P.A x_scale_factor = 1  &\n"
        " y_scale_factor = 1 z_scale_factor = 1\n"
        "geometry create shape csg csg_name = .m.P.C base_object = .m.P.BOX object = .m.P.E type = difference"
    )
    refused = parse_view(PART + MASSES % ("density = 1", csg)).deck
    assert "csg" in refused.unsupported[0].message
    assert "center_of_mass_marker" in refused.unsupported[0].message
    given = parse_view(PART + MASSES % ("mass = 2 ixx = 1 iyy = 1 izz = 1 center_of_mass_marker = .m.P.A", csg)).deck
    assert not given.unsupported


READ = 'file geometry read type_of_geometry = step file_name = "a.stp"'


def test_geometry_of_a_file_counts_for_the_mass_unless_that_is_given():
    read = f"{READ} part_name = .m.P"
    refused = parse_view(PART + MASSES % ("density = 1", read)).deck.unsupported
    assert len(refused) == 1
    assert re.search(says("a.stp", ".m.P", "mass", "center_of_mass_marker"), refused[0].message)
    given = parse_view(PART + MASSES % ("mass = 2 ixx = 1 iyy = 1 izz = 1 center_of_mass_marker = .m.P.A", read)).deck
    assert not given.unsupported
    assert any("a.stp" in d.message for d in given.diagnostics)
    of_ground = parse_view(PART + MASSES % ("density = 1", f"{READ} part_name = .m.ground")).deck
    assert not of_ground.unsupported


@pytest.mark.parametrize("to", ["", " model_name = .m", " part_name = .m.Q"])
def test_geometry_of_a_file_that_would_make_parts_is_refused(to):
    with pytest.raises(DeckError, match=says("file geometry read", "there" if "Q" in to else "part_name")):
        parse_view(PART + MASSES % ("density = 1", READ + to))


def unwelded_box(gap=0.0):
    """A box of 2 by 3 by 4 as facets that share no corners: some turned inwards, one side a bit off the others."""
    corners = np.array([[x, y, z] for x in (0, 2.0) for y in (0, 3.0) for z in (0, 4.0)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    places = corners[np.array([t[::-1] if k % 3 == 1 else t for k, t in enumerate(triangles)])]
    places[-2:, :, 2] += gap
    return places.reshape(-1, 3), np.arange(36).reshape(-1, 3)


def test_facets_are_turned_outwards_whatever_gaps_are_between_them():
    places, triangles = unwelded_box(gap=1e-5)
    found, box = solids.polyhedron(places, masses.facing_outward(places, triangles)), solids.box(2, 3, 4)
    assert found.volume == pytest.approx(box.volume, rel=1e-5)
    assert found.first == pytest.approx(box.first, rel=1e-5)


SHELL = """\
marker create marker_name = .m.P.cm location = %s
part create rigid_body mass_properties part_name = .m.P density = 2
geometry create shape shell shell_name = .m.P.S reference_marker = .m.P.A file_name = "C:\\library\\HULL.shl"
"""


def shell_file(folder):
    places, triangles = unwelded_box()
    rows = [f"{len(places)} {len(triangles)} 1.000000", *(" ".join(f"{x:.6f}" for x in p) for p in places)]
    rows += [f"3 {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    (folder / "hull.shl").write_text("\n".join(rows))


def test_a_shell_counts_if_it_has_the_centre_that_the_file_gives(tmp_path):
    shell_file(tmp_path)
    path = tmp_path / "a.cmd"
    path.write_text(PART + SHELL % "2, 1.5, 2")
    deck = read_view(path).deck
    assert deck.of(st.Part)[2].mass == pytest.approx(48.0)
    assert deck.of(st.Part)[2].ip[:3] == pytest.approx(np.array([25.0, 20.0, 13.0]) * 48.0 / 12.0)
    assert any(re.search(says(".m.P.S", "centre of mass"), str(d)) for d in deck.diagnostics)
    path.write_text(PART + SHELL % "2, 1.5, 2.01")
    assert re.search(says(".m.P", "shell", "center_of_mass_marker"), read_view(path).deck.unsupported[0].message)


def test_a_shell_without_its_file_is_refused(tmp_path):
    path = tmp_path / "a.cmd"
    path.write_text(PART + SHELL % "2, 1.5, 2")
    assert re.search(says("HULL.shl", ".m.P.S", "mass"), read_view(path).deck.unsupported[0].message)
    (tmp_path / "hull.shl").write_text("8 12 1.0\n0 0 0\n")
    assert re.search(says("hull.shl", "mass"), read_view(path).deck.unsupported[0].message)


RESTING = """\
force create body gravitational gravity_field_name = .m.g z_component = -10
geometry create shape plane plane_name = .m.ground.F ref_marker_name = .m.ground.O x_minimum = -9 x_maximum = 9 &
   y_minimum = -9 y_maximum = 9
contact create contact_name = .m.C i_geometry_name = .m.P.S j_geometry_name = .m.ground.F stiffness = 4.8E+05 &
   damping = 1000 exponent = 1 dmax = 1E-4
"""


STICKING = """   coulomb_friction = on mu_static = 0.3 mu_dynamic = 0.2 stiction_transition_velocity = 0.01 &
   friction_transition_velocity = 0.1 stiction = {stiction} max_stiction_deformation = 1E-5
"""


@pytest.mark.parametrize("stiction", ["on", "off"])
def test_a_contact_that_sticks_is_remarked_on(tmp_path, stiction):
    places, triangles = unwelded_box()
    rows = [f"{len(places)} {len(triangles)} 1.000000", *(" ".join(f"{x:.6f}" for x in p) for p in places)]
    (tmp_path / "hull.shl").write_text("\n".join([*rows, *(f"3 {a + 1} {b + 1} {c + 1}" for a, b, c in triangles)]))
    path = tmp_path / "a.cmd"
    contact = RESTING.rstrip("\n") + " &\n" + STICKING.format(stiction=stiction)
    text = PART + SHELL % "2, 1.5, 2" + "marker create marker_name = .m.ground.O location = 1, 1.5, 0.0009\n" + contact
    path.write_text(text)
    deck = read_view(path).deck
    assert not deck.unsupported
    told = [
        d for d in deck.diagnostics if re.search(says("CONTACT/1", "STICTION", "MAX_STICTION_DEFORMATION"), d.message)
    ]
    assert len(told) == (stiction == "on")


@pytest.mark.slow
def test_a_shell_touches_with_its_facets(tmp_path):
    """A box of 48 kg on a floor: its force is its weight."""
    places, triangles = unwelded_box()
    rows = [f"{len(places)} {len(triangles)} 1.000000", *(" ".join(f"{x:.6f}" for x in p) for p in places)]
    turned = masses.facing_outward(places, triangles)
    (tmp_path / "hull.shl").write_text("\n".join([*rows, *(f"3 {a + 1} {b + 1} {c + 1}" for a, b, c in turned)]))
    path = tmp_path / "a.cmd"
    text = PART + SHELL % "2, 1.5, 2" + "marker create marker_name = .m.ground.O location = 1, 1.5, 0.0009\n" + RESTING
    path.write_text(text)
    view = read_view(path)
    assert not view.deck.unsupported
    result = run_deck(view.deck, parse_script("a\nb\nSIMULATE/STATICS\n"))
    assert result.force("contact", 1)[-1, 2] == pytest.approx(480.0, rel=1e-6)
    (tmp_path / "hull.shl").unlink()
    assert any(re.search(says("HULL.shl", ".m.P.S", "beside"), d.message) for d in read_view(path).deck.unsupported)
