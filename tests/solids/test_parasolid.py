"""Bodies of Parasolid text files: exact solids, facets and their volumes, damaged files."""

import numpy as np
import pytest

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.contacts import Box, Cylinder, Frustum, Mesh, Sphere, Torus, read_solid
from gearmbs.mechanism.contacts.shapes import volume
from gearmbs.solids import bodies, read_bodies
from gearmbs.solids.bodies import faceted, primitive
from gearmbs.solids.faces import Crossed
from gearmbs.solids.procedural import Blend, Bound
from tests.says import says
from tests.solids.transmit_files import (
    Solid,
    block,
    circle,
    cylinder,
    drilled,
    line,
    plane,
    rounded_cylinder,
    transmit,
    turned,
)

Z, X = (0, 0, 1), (1, 0, 0)


def written(tmp_path, *solids, name="solid.x_t"):
    path = tmp_path / name
    path.write_text(transmit(*solids))
    return path


def facets_of(tmp_path, solid, tolerance=None):
    pytest.importorskip("pythoncdt")
    (body,) = read_bodies(written(tmp_path, solid))
    return faceted(body, tolerance)


def cone(radius, slope):
    c = 1.0 / np.hypot(1.0, slope)
    fields = {"pvec": (0, 0, 0), "axis": Z, "radius": radius, "sin_half_angle": slope * c, "cos_half_angle": c}
    return ("CONE", fields | {"x_axis": X}), "+"


def sphere(radius, at=(0, 0, 0)):
    return "SPHERE", {"centre": at, "radius": radius, "axis": Z, "x_axis": X}


def test_a_block_is_exact(tmp_path):
    shape = read_solid(written(tmp_path, block(at=(1.0, 0.0, -1.0))))
    assert isinstance(shape, Box)
    corners = shape.offset + shape.facets()[0] @ shape.axes.T
    assert corners.min(axis=0) == pytest.approx([1.0, 0.0, -1.0], abs=1e-12)
    assert corners.max(axis=0) == pytest.approx([2.0, 2.0, 2.0], abs=1e-12)


@pytest.mark.parametrize(
    ("solid", "kind", "sizes"),
    [
        (turned(0.4, 0.4, 2.0), Cylinder, {"radius": 0.4, "length": 2.0}),
        (turned(0.5, 0.9, 2.0, cone(0.5, 0.2)), Frustum, {"bottom": 0.5, "top": 0.9, "length": 2.0}),
        (Solid(faces=[(sphere(0.7), "+", [])]), Sphere, {"radius": 0.7}),
        (
            Solid(faces=[(("TORUS", {"centre": (0, 0, 0), "axis": Z, "major_radius": 2.0, "minor_radius": 0.5,
                                     "x_axis": X}), "+", [])]),
            Torus, {"radius": 2.0, "tube": 0.5},
        ),
    ],
)  # fmt: skip
def test_round_solids_are_exact(tmp_path, solid, kind, sizes):
    shape = read_solid(written(tmp_path, solid))
    assert isinstance(shape, kind)
    assert {k: getattr(shape, k) for k in sizes} == pytest.approx(sizes)
    middle = 1.0 if kind in (Cylinder, Frustum) else 0.0
    assert shape.offset == pytest.approx([0, 0, middle], abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("solid", "exact"),
    [
        (turned(0.4, 0.4, 2.0), np.pi * 0.16 * 2.0),
        (turned(0.5, 0.9, 2.0, cone(0.5, 0.2)), np.pi * 2.0 / 3.0 * (0.25 + 0.45 + 0.81)),
        (Solid(faces=[(sphere(0.7), "+", [])]), 4.0 / 3.0 * np.pi * 0.343),
        (
            Solid(faces=[(("TORUS", {"centre": (0, 0, 0), "axis": Z, "major_radius": 2.0, "minor_radius": 0.5,
                                     "x_axis": X}), "+", [])]),
            2.0 * np.pi**2 * 2.0 * 0.25,
        ),
        (drilled(block()), 6.0 - np.pi * 0.09 * 3.0),
        (
            # a ball of radius 1 cut off at z = 0.6
            Solid(edges=[(circle((0, 0, 0.6), Z, X, 0.8), None, None)],
                  faces=[(plane((0, 0, 0.6), Z, X), "+", [[(0, True)]]), (sphere(1.0), "+", [[(0, False)]])]),
            np.pi * (2.0 / 3.0 + 0.6 - 0.6**3 / 3.0),
        ),
        (
            # a cone with its tip at z = -2.5
            Solid(edges=[(circle((0, 0, 0), Z, X, 0.5), None, None)],
                  faces=[(plane((0, 0, 0), Z, X), "+", [[(0, True)]]), (*cone(0.5, 0.2), [[(0, False)]])]),
            np.pi * 0.25 * 2.5 / 3.0,
        ),
    ],
    ids=["cylinder", "frustum", "sphere", "torus", "drilled block", "cut ball", "cone"],
)  # fmt: skip
def test_facets_close_and_their_volume_tends_to_the_exact_one(tmp_path, solid, exact):
    off = []
    for tolerance in (4e-3, 1e-3):
        vertices, triangles = facets_of(tmp_path, solid, tolerance)
        edges = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        assert len(np.unique(edges, axis=0)) == len(edges)
        assert {tuple(e) for e in edges.tolist()} == {(b, a) for a, b in edges.tolist()}
        off.append(abs(volume(vertices, triangles) / exact - 1.0))
    # the volume between chord and arc is proportional to the tolerance, once it says more than the least turn
    assert off[0] < 0.05
    assert off[1] < 0.45 * off[0]


def test_facets_stay_within_the_tolerance(tmp_path):
    vertices, triangles = facets_of(tmp_path, Solid(faces=[(sphere(0.7), "+", [])]), 2e-3)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    assert np.linalg.norm(vertices, axis=1) == pytest.approx(0.7, abs=1e-12)
    for p, q in ((a, b), (b, c), (c, a)):
        assert np.linalg.norm(0.5 * (p + q), axis=1).min() > 0.7 - 1.1 * 2e-3


@pytest.mark.parametrize("kind", ["swept", "spun", "spline"])
def test_a_cylinder_s_side_may_be_given_otherwise(tmp_path, kind):
    if kind == "swept":
        side = ("SWEPT_SURF", {"section": circle((0, 0, 0), Z, X, 0.4), "sweep": Z}), "+"
    elif kind == "spun":
        side = ("SPUN_SURF", {"profile": line((0.4, 0, 0), (0.4, 0, 1)), "base": (0, 0, 0), "axis": Z}), "-"
    else:
        side = spline_cylinder(0.4, 2.0), "+"
    vertices, triangles = facets_of(tmp_path, turned(0.4, 0.4, 2.0, side), 1e-4)
    assert volume(vertices, triangles) == pytest.approx(np.pi * 0.16 * 2.0, rel=1e-3)


@pytest.mark.slow
def test_an_edge_that_a_ball_has_rounded(tmp_path):
    """Of it a quarter of a torus is left; where the ball touches it ends."""
    vertices, triangles = facets_of(tmp_path, rounded_cylinder(0.4, 2.0, 0.1), 1e-4)
    layer = 0.3**2 * 0.1 + 0.3 * np.pi * 0.1**2 / 2.0 + 2.0 * 0.1**3 / 3.0
    assert volume(vertices, triangles) == pytest.approx(np.pi * (0.16 * 1.9 + layer), rel=1e-3)
    high = vertices[vertices[:, 2] > 1.9]
    assert np.hypot(np.hypot(high[:, 0], high[:, 1]) - 0.3, high[:, 2] - 1.9) == pytest.approx(0.1, abs=1e-12)

    body = read_bodies(written(tmp_path, rounded_cylinder(0.4, 2.0, 0.1)))[0]
    blend = next(face.surface for face in body.faces if isinstance(face.surface, Blend))
    for near, touched in (((0.5, 0.0, 1.95), (0.4, 0.0, 1.9)), ((0.0, 0.35, 2.1), (0.0, 0.3, 2.0))):
        edge = Bound(blend)
        assert edge.points(edge.project(np.array([near])))[0] == pytest.approx(touched, abs=1e-9)


def spline_cylinder(radius, length):
    """A cylinder as a rational B-spline surface: nine poles around, two along."""
    w = np.sqrt(0.5)
    ring = [(1, 0, 1), (w, w, w), (0, 1, 1), (-w, w, w), (-1, 0, 1), (-w, -w, w), (0, -1, 1), (w, -w, w), (1, 0, 1)]
    poles = [q for x, y, h in ring for z in (0.0, length) for q in (radius * x, radius * y, h * z, h)]
    nurbs = {
        "u_closed": "T", "u_degree": 2, "v_degree": 1, "n_u_vertices": 9, "n_v_vertices": 2, "rational": "T",
        "n_u_knots": 5, "n_v_knots": 2, "vertex_dim": 4, "bspline_vertices": ("BSPLINE_VERTICES", {"vertices": poles}),
        "u_knot_mult": ("KNOT_MULT", {"mult": [3, 2, 2, 2, 3]}), "v_knot_mult": ("KNOT_MULT", {"mult": [2, 2]}),
        "u_knots": ("KNOT_SET", {"knots": [0.0, 0.25, 0.5, 0.75, 1.0]}),
        "v_knots": ("KNOT_SET", {"knots": [0.0, 1.0]}),
    }  # fmt: skip
    return "B_SURFACE", {"nurbs": ("NURBS_SURF", nurbs)}


def test_arcs_closer_than_the_tolerance_are_cut_finer(tmp_path):
    # a tube so thin that chains of one tolerance on both rings would cross
    solid = turned(1.0, 1.0, 2.0)
    for h in (0.0, 2.0):
        solid.edges.append((circle((0, 0, h), Z, (0.6, 0.8, 0), 0.995), None, None))
    solid.faces[0][2].append([(2, True)])
    solid.faces[1][2].append([(3, False)])
    inner = cylinder(0.995)[0]
    solid.faces.append((inner, "-", [[(3, True)], [(2, False)]]))
    vertices, triangles = facets_of(tmp_path, solid, 0.05)
    assert volume(vertices, triangles) == pytest.approx(np.pi * (1.0 - 0.995**2) * 2.0, rel=0.2)


def test_edges_that_cross_by_themselves_are_cut_coarser(tmp_path, monkeypatch):
    """The hole is the short edge of its face; what is cut finer first goes on crossing."""
    lengths = []

    def cut(surface, outward, loops, *rest):
        if len(loops) == 2 and len(loops[1]) > 25:
            lengths.append(len(loops[1]))
            raise Crossed("its edges cross")
        return whole(surface, outward, loops, *rest)

    solid = block()
    drilled(solid, radius=0.08)
    whole = bodies.cut
    fine = facets_of(tmp_path, solid, 1e-4)
    monkeypatch.setattr(bodies, "cut", cut)
    coarse = facets_of(tmp_path, solid, 1e-4)
    assert max(lengths) > 4 * lengths[0]
    assert volume(*coarse) == pytest.approx(volume(*fine), rel=1e-3)


def test_an_edge_around_a_surface_may_be_trimmed_backwards(tmp_path):
    """A curve in the parameters of a cylinder is open there and closed in space."""
    nurbs = {
        "degree": 1, "n_vertices": 2, "vertex_dim": 2, "n_knots": 2, "periodic": "F", "closed": "F", "rational": "F",
        "bspline_vertices": ("BSPLINE_VERTICES", {"vertices": [0.0, 2.0, 2.0 * np.pi, 2.0]}),
        "knot_mult": ("KNOT_MULT", {"mult": [2, 2]}), "knots": ("KNOT_SET", {"knots": [0.0, 1.0]}),
    }  # fmt: skip
    around = "SP_CURVE", {"surface": cylinder(0.4)[0], "b_curve": ("B_CURVE", {"nurbs": ("NURBS_CURVE", nurbs)})}
    at = (0.4, 0.0, 2.0)
    solid = turned(0.4, 0.4, 2.0)
    trimmed = {"basis_curve": around, "sense": "-", "point_1": at, "point_2": at, "parm_1": 0.0, "parm_2": -1.0}
    solid.edges[1] = (("TRIMMED_CURVE", trimmed), None, None)
    found = facets_of(tmp_path, solid, 1e-4)
    assert volume(*found) == pytest.approx(np.pi * 0.16 * 2.0, rel=1e-3)


def test_bodies_are_found_by_name_and_part(tmp_path):
    path = written(tmp_path, block(name="A", part=3), turned(0.4, 0.4, 1.0, name="B", part=4), name="two.xmt_txt")
    assert [b.name for b in read_bodies(path)] == ["A", "B"]
    assert isinstance(read_solid(path, "b"), Cylinder)
    with pytest.raises(ModelError, match=says("'C'", "0", "2", "B", "body named")):
        read_solid(path, "C")
    with pytest.raises(ModelError, match="one body"):
        read_solid(path)


def test_an_open_body_is_named(tmp_path):
    pytest.importorskip("pythoncdt")
    solid = drilled(block())
    del solid.faces[-1]
    with pytest.raises(ModelError, match=says("solid.x_t", "'SOLID1'")):
        read_solid(written(tmp_path, solid))


def test_edges_off_their_surface_are_named(tmp_path):
    pytest.importorskip("pythoncdt")
    solid = turned(0.4, 0.4, 2.0)
    solid.faces[2] = (cylinder(0.5)[0], "+", solid.faces[2][2])
    with pytest.raises(ModelError, match=r"0\.1 m off its CYLINDER"):
        facets_of(tmp_path, solid)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.replace("**END_OF_HEADER", "**END"), "no line \\*\\*END_OF_HEADER"),
        (lambda t: t.replace("\nT51", "\nPS\0\0"), says("solid", "text", "binary transmit file")),
        (lambda t: t.replace("_1300\n6", "_1200\n6"), says("solid.x_t", "schema", "given")),
        (lambda t: t.replace("\nT51", "\nX51"), says("text", "transmit data")),
    ],
)
def test_other_files_are_named_with_a_remedy(tmp_path, change, message):
    path = written(tmp_path, block())
    path.write_text(change(path.read_text()))
    with pytest.raises(ModelError, match=message):
        read_solid(path)
    with pytest.raises(ModelError, match=says("none.x_t", "No such file")):
        read_solid(tmp_path / "none.x_t")


def test_truncated_files_end_with_a_place(tmp_path):
    path = written(tmp_path, block())
    text = path.read_text()
    start = text.index("T51")
    for end in range(start + 3, len(text) - 8, 61):
        path.write_text(text[:end])
        with pytest.raises(ModelError, match=r"solid.x_t(:\d+)?: "):
            read_solid(path)


@pytest.mark.slow
def test_damaged_files_are_read_or_named(tmp_path):
    """Whatever stands in a file, it is a solid or an error of one kind."""
    pytest.importorskip("pythoncdt")
    path = written(tmp_path, drilled(block()))
    text = path.read_text()
    start = text.index("T51") + 90
    rng = np.random.default_rng(5)
    read = 0
    for _ in range(250):
        damaged = list(text)
        for at in rng.integers(start, len(text), size=rng.integers(1, 4)):
            damaged[at] = str(rng.choice(list("0123456789-.?+TF e ")))
        path.write_text("".join(damaged))
        try:
            read_solid(path)
            read += 1
        except ModelError:
            pass
    assert 0 < read < 250


def test_a_mesh_of_a_drilled_block_touches_like_one(tmp_path):
    pytest.importorskip("pythoncdt")
    shape = read_solid(written(tmp_path, drilled(block())), tolerance="1 mm")
    assert isinstance(shape, Mesh)
    assert primitive(read_bodies(written(tmp_path, drilled(block())))[0]) is None
