"""Tracks of contacts: where solids touch, what presses and rubs there, of several patches each for itself."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from gearmbs.adams import parse_deck, read_deck, run_deck
from gearmbs.adams.results.remarks import TRACK_COLUMNS, FacetedTouch, facets_remark
from gearmbs.adams.results.res import NAMESPACE
from gearmbs.mechanism.contacts import Box, Cylinder

from .test_contacts import IMPACT, PLANE, deck
from .test_curves import matrix

WEIGHT = 9.81


def column(table, name):
    """Components of a quantity of tracks, shape (m, tracks, 3 or 1)."""
    at = [k for k, c in enumerate(TRACK_COLUMNS) if c.partition(".")[0] == name]
    return table[:, :, at]


def test_the_track_of_a_ball_that_slides():
    friction = (
        ", COULOMB_FRICTION=ON, MU_STATIC=0.2, MU_DYNAMIC=0.2, STICTION_TRANSITION_VELOCITY=0.5, "
        "FRICTION_TRANSITION_VELOCITY=1"
    )
    contact = "CONTACT/1, IGEOM=2, JGEOM=1, IMPACT, STIFFNESS=1E4, EXPONENT=1, DAMPING=5, DMAX=0.001" + friction
    result = run_deck(parse_deck(deck(20.0 - 9.81e-4, contact=contact, start=", VX=1000")), end=0.2, steps=50)
    table = result.tracks(1)
    assert table.shape == (51, 1, len(TRACK_COLUMNS))
    force, rubbing = column(table, "I_Normal_Force"), column(table, "I_Friction_Force")
    assert (force + rubbing)[:, 0] == pytest.approx(result.force("contact", 1)[:, :3], abs=1e-9)
    assert force[:, 0, 2] == pytest.approx(np.full(51, WEIGHT), rel=1e-3)
    assert column(table, "J_Normal_Force") == pytest.approx(-force)
    assert column(table, "I_Normal_Unit_Vector")[:, 0] == pytest.approx(np.tile([0.0, 0.0, 1.0], (51, 1)))
    # the surface of the ball against the plane: v + w x r
    v, w, x, z = result.request(1)[:, [5, 6, 7, 1]].T
    slip = column(table, "Slip_Velocity")[:, 0]
    depth = column(table, "Penetration")[:, 0, 0]
    # at half the depth, where the force acts
    assert slip[:, 0] == pytest.approx(v - (20.0 - 0.5 * depth) * w, abs=1e-6)
    assert depth == pytest.approx(20.0 - z, abs=1e-9)
    assert column(table, "I_Point")[:, 0] == pytest.approx(np.column_stack([x, 0 * x, z - 20.0]), abs=1e-6)
    assert column(table, "J_Point")[:, 0] == pytest.approx(np.column_stack([x, 0 * x, 0 * x]), abs=1e-6)


def test_a_bouncing_ball_touches_now_and_then_on_one_track(tmp_path):
    result = run_deck(
        parse_deck(deck(40.0, contact=IMPACT.replace("DAMPING=20", "DAMPING=0"))),
        end=0.4,
        steps=400,
        out=tmp_path / "b",
    )
    table = result.tracks(1)
    assert table.shape[1] == 1
    touching = column(table, "Penetration")[:, 0, 0] > 0.0
    assert list(touching) == list(result.request(1)[:, 1] < 20.0)
    assert np.count_nonzero(np.diff(touching.astype(int)) == 1) == 3
    assert np.all(table[~touching] == 0.0)
    data = result.to_dataset().contact_1_tracks.sel(track_column="I_Point.X")
    assert data.shape == (401, 1)
    root = ET.parse(tmp_path / "b.res").getroot()
    names = [e.get("name") for e in root.iter(f"{{{NAMESPACE}}}Entity")]
    assert "CONTACT_1.Track_1.I_Point" in names
    assert "CONTACT_1.Track_1.Penetration" in names
    depth = next(e for e in root.iter(f"{{{NAMESPACE}}}Entity") if e.get("name") == "CONTACT_1.Track_1.Penetration")
    number = int(depth[0].get("id"))
    steps = [[float(w) for w in step.text.split()] for step in root.iter(f"{{{NAMESPACE}}}Step")]
    assert [row[number - 1] for row in steps] == list(column(table, "Penetration")[:, 0, 0])


def stool_mesh():
    """Two legs of 10 by 10 by 40 mm, 60 mm apart, as one surface."""
    leg, triangles = Box((10, 10, 40)).facets()
    return np.concatenate([leg - (30, 0, 0), leg + (30, 0, 0)]), np.concatenate([triangles, triangles + 8])


def obj(vertices, triangles):
    return "".join(f"v {x} {y} {z}\n" for x, y, z in vertices) + "".join(
        f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles
    )


def stl(vertices, triangles):
    rows = ["solid stool"]
    for t in triangles:
        corners = "\n".join("vertex {} {} {}".format(*vertices[k]) for k in t)
        rows.append(f"facet normal 0 0 0\nouter loop\n{corners}\nendloop\nendfacet")
    return "\n".join([*rows, "endsolid stool"])


def shell(vertices, triangles):
    rows = [f"{len(vertices)} {len(triangles)} {len(triangles)} 1.0", *("{} {} {}".format(*v) for v in vertices)]
    return "\n".join([*rows, *(f"3 {a + 1} {b + 1} {c + 1}" for a, b, c in triangles)])


FILES = {"obj": obj, "stl": stl, "shl": shell, "slp": stl}
BRIDGE = np.array(
    [(-35, -20), (-25, -20), (-25, 0), (25, 0), (25, -20), (35, -20), (35, 20), (-35, 20), (-35, -20)], dtype=float
)
BRIDGE = np.column_stack([BRIDGE, 0 * BRIDGE[:, 0]])
"""A profile of two legs."""
DUMBBELL = np.array(
    [(1e-6, 0, -40), (20, 0, -40), (20, 0, -20), (5, 0, -20), (5, 0, 20), (20, 0, 20), (20, 0, 40), (1e-6, 0, 40)]
)
"""Two discs on an axle, as a profile turned about z."""
SLABS = (
    "MARKER/11, PART=1, QP=-80,-100,-100\nGRAPHICS/1, BOX, CORNER=11, X=60, Y=200, Z=100\n"
    "MARKER/12, PART=1, QP=20,-100,-100\nGRAPHICS/5, BOX, CORNER=12, X=60, Y=200, Z=100"
)
"""The ground on either side of a gap of 40 mm along x."""
ACROSS = "MARKER/23, PART=2, REULER=90D,90D,0D"
"""With z along x of the part."""
CURVE = "CURVE/1, {kind}, CONTROL_POINTS, ORDER=2, MATRIX=1\n"
CASES = {
    "extrusion on a plane": (
        f"{matrix(1, BRIDGE)}\n{CURVE.format(kind='CLOSED')}"
        "MARKER/23, PART=2, QP=0,10,0, REULER=0D,90D,0D\nGRAPHICS/2, EXTRUSION, RM=23, CID=1, LENGTH=20",
        PLANE, 20.0, "1",
    ),
    "revolution on a plane": (
        f"{matrix(1, DUMBBELL)}\n{CURVE.format(kind='OPEN')}{ACROSS}\nGRAPHICS/2, REVOLUTION, RM=23, CID=1",
        PLANE, 20.0, "1",
    ),
    "torus across a gap": (f"{ACROSS}\nGRAPHICS/2, TORUS, CM=20, MAJOR=40, MINOR=5", SLABS, 5.0, "1,5"),
    "frustum across a gap": (
        "MARKER/23, PART=2, QP=-50,0,0, REULER=90D,90D,0D\nGRAPHICS/2, FRUSTUM, CM=23, LENGTH=100, TOP=10, BOTTOM=10",
        SLABS, 10.0, "1,5",
    ),
    "cylinder across a gap": (
        "MARKER/23, PART=2, QP=-50,0,0, REULER=90D,90D,0D\nGRAPHICS/2, CYLINDER, CM=23, LENGTH=100, RADIUS=10",
        SLABS, 10.0, "1,5",
    ),
    **{
        f"{ending} on a plane": (f"GRAPHICS/2, EXTERNAL, RM=20, FILE=stool.{ending}", PLANE, 20.0, "1")
        for ending in FILES
    },
    "stool on slabs": ("GRAPHICS/2, EXTERNAL, RM=20, FILE=stool.obj", SLABS, 20.0, "1,5"),
    "stool on a mesh": (
        "GRAPHICS/2, EXTERNAL, RM=20, FILE=stool.obj",
        "MARKER/11, PART=1, QP=0,0,-50\nGRAPHICS/1, EXTERNAL, RM=11, FILE=slab.stl",
        20.0, "1",
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_two_patches_carry_half_each(name, tmp_path):
    """What stands on two places has two tracks, each with half of the weight, where it stands."""
    solid, ground, height, refs = CASES[name]
    for ending, write in FILES.items():
        (tmp_path / f"stool.{ending}").write_text(write(*stool_mesh()))
    (tmp_path / "slab.stl").write_text(stl(*Box((200, 200, 100)).facets()))
    path = tmp_path / "rest.adm"
    contact = IMPACT.replace("JGEOM=1", f"JGEOM={refs}")
    path.write_text(deck(height, solids=f"{ground}\n{solid}", contact=contact))
    result = run_deck(read_deck(path), end=0.3, steps=30)
    assert result.success
    table = result.tracks(1)
    carried = column(table, "I_Normal_Force")[-1]
    touching = np.flatnonzero(np.abs(carried[:, 2]) > 0.0)
    assert len(touching) == 2
    # a faceted solid's legs stand on corners, which are not quite where its round is
    assert carried[touching, 2] == pytest.approx([WEIGHT / 2] * 2, rel=2e-2)
    assert carried[:, 2].sum() == pytest.approx(WEIGHT, rel=1e-3)
    places = column(table, "I_Point")[-1, touching]
    assert np.sort(places[:, 0]) == pytest.approx([-1, 1] * np.abs(places[:, 0]), rel=2e-2)
    assert np.abs(places[:, 0]).min() > 19.0
    # feet that are one closed surface share the one load of their pair; others have one each
    loads = 1 if name in ("extrusion on a plane", "revolution on a plane") else 2
    sunk = (WEIGHT / loads / 1e4) ** (2 / 3)
    assert column(table, "Penetration")[-1, touching, 0] == pytest.approx([sunk] * 2, rel=2e-2)


def test_a_contact_that_rests_has_no_track():
    result = run_deck(parse_deck(deck(60.0)), end=0.05, steps=5)
    assert result.tracks(1).shape == (6, 0, len(TRACK_COLUMNS))
    assert "contact_1_tracks" not in result.to_dataset()


ROLLER = """{name}
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
PART/2, MASS=2, CM=2, IP=7900,2500,7900, QG=0,0,49.9, VX=1000, WY=20
MARKER/2, PART=2
MARKER/3, PART=2, QP=0,-100,0, ZP=0,1,0
GRAPHICS/1, {floor}
GRAPHICS/2, {solid}
CONTACT/1, IGEOM=2, JGEOM=1, IMPACT, STIFFNESS=1E4, DAMPING=1, DMAX=0.1, EXPONENT=1.5
ACCGRAV/KGRAV=-9810
END
"""


@pytest.mark.slow
def test_what_rolls_on_facets_is_remarked(tmp_path):
    """A cylinder of 48 segments leaves the round by r (1 - cos(pi/48)); an exact one and a block do not."""
    (tmp_path / "roller.obj").write_text(obj(*Cylinder(50, 200).facets()))
    (tmp_path / "block.obj").write_text(obj(*Box((100, 100, 100)).facets()))
    mesh = "EXTERNAL, RM=2, FILE={}"
    found = {}
    for name, floor, solid in (
        ("facets", "PLANE, RM=1", mesh.format("roller.obj")),
        ("block", "PLANE, RM=1", mesh.format("block.obj")),
        ("exact", "PLANE, RM=1", "CYLINDER, CM=3, LENGTH=200, RADIUS=50"),
    ):
        path = tmp_path / f"{name}.adm"
        path.write_text(ROLLER.format(name=name, floor=floor, solid=solid))
        result = run_deck(path, end=0.02, steps=10)
        assert result.success
        found[name] = [m for m in result.messages if "facets" in m]
    assert not found["block"]
    assert not found["exact"]
    (remark,) = found["facets"]
    assert "CONTACT/1: GRAPHICS/2 and GRAPHICS/1 are cut into" in remark
    assert f"up to {50.0 * (1.0 - np.cos(np.pi / 48)):.3g} mm" in remark


def test_one_remark_names_many_faceted_contacts():
    touches = [FacetedTouch(f"CONTACT/{k}", "GRAPHICS/1", "GRAPHICS/2", 100 * k, 1e-4, 1e-5 * k) for k in range(1, 7)]
    remark = facets_remark(touches, 1e-3, "mm")
    assert remark.startswith("CONTACT/1: GRAPHICS/1 and GRAPHICS/2 are cut into 100 triangles")
    assert "by up to 0.1 mm, while they sink in by 0.01; so are" in remark
    assert "GRAPHICS/1 and GRAPHICS/2 of CONTACT/4 and 2 more." in remark
