"""Masses of grid points from the elements of an op2 file, and bodies from its modes alone."""

import numpy as np
import pytest

from gearmbs.flexible import FlexibleError, read_op2_modes
from gearmbs.flexible.nastran import op2_tables
from gearmbs.flexible.nastran_masses import bulk_table, corner_shares, element_masses
from tests.flexible.op2_files import Op2Writer
from tests.says import says

pytest.importorskip("pyyeti.nastran.op2")

RHO, NONE = 4.0, (0.0,) * 3
STEEL = {(103, 1): [(1, 1.0, 1.0, 0.3, RHO, *(0.0,) * 6, 0)]}
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=float)
LINES = {(52, 20): [(5, 1, 0.5, *NONE, 0.25, *(0.0,) * 12)], (902, 9): [(6, 1, 0.5, *NONE[:2], 0.25)],
         (1602, 16): [(7, 1, 2.0, 0.5, 0.25)], (2302, 23): [(8, 1, 0.1, 1, 1.0, 0, 0.0, 0.25, *NONE[:2], 0)],
         (2402, 24): [(9, 1, 0, 0, 0, 0, 0)],
         (2706, 27): [(10, -2, *NONE[:1], 0.25, *NONE[:1], 0, *NONE[:2], 1, 0.1, 0.0, 0, 1, 0.2, 0.0, 0)]}  # fmt: skip
"""Properties: 5 to 7 of lines, 8 and 10 of surfaces, 9 of solids."""


def file_of(elements, properties=LINES, materials=STEEL, positions=CUBE, wtmass=None):
    writer = Op2Writer()
    if wtmass is not None:
        writer.table("PVT0", [b"WTMASS  " + writer.ints(2) + writer.floats([wtmass])])
    writer.grids(np.arange(1, len(positions) + 1), positions)
    writer.entries("GEOM2", elements)
    writer.entries("EPT", properties)
    writer.entries("MPT", materials)
    return writer


def masses_of(path, *args, **others):
    file_of(*args, **others).write(path)
    return element_masses(path, op2_tables(path, [])["grids"])


@pytest.mark.parametrize(
    ("elements", "expected"),
    [
        # an edge of length 1: area 1/2, and 1/4 by length
        ({(2408, 24): [(1, 5, 1, 2, *(0.0,) * 12)]}, {1: 0.5 * (RHO * 0.5 + 0.25), 2: 0.5 * (RHO * 0.5 + 0.25)}),
        ({(3001, 30): [(1, 6, 1, 2)]}, {1: 1.125, 2: 1.125}),
        ({(1601, 16): [(1, 1, 2, 1, 0.5, 0.0, 0.0, 0.25)]}, {1: 1.125, 2: 1.125}),
        # a tube of diameters 2 and 1
        ({(3701, 37): [(1, 7, 1, 2)]}, dict.fromkeys((1, 2), 0.5 * (RHO * 0.75 * np.pi + 0.25))),
        # a face of area 1: thickness 1/10, or 1/2 at its corners; two plies and as many again
        ({(2958, 51): [(1, 8, 1, 2, 3, 4, *(0.0,) * 8)]}, dict.fromkeys((1, 2, 3, 4), 0.25 * (RHO * 0.1 + 0.25))),
        ({(2958, 51): [(1, 8, 1, 2, 3, 4, *(0.0,) * 4, *(0.5,) * 4)]}, dict.fromkeys((1, 2, 3, 4), 0.25 * 2.25)),
        ({(2958, 51): [(1, 10, 1, 2, 3, 4, *(0.0,) * 8)]}, dict.fromkeys((1, 2, 3, 4), 0.25 * (RHO * 0.6 + 0.25))),
        ({(5959, 59): [(1, 8, 1, 2, 3, *(0.0,) * 8)]}, dict.fromkeys((1, 2, 3), 0.5 / 3.0 * (RHO * 0.1 + 0.25))),
        # a cube, half of it, a sixth of it
        ({(7308, 73): [(1, 9, *range(1, 9), *(0,) * 12)]}, dict.fromkeys(range(1, 9), RHO / 8.0)),
        ({(4108, 41): [(1, 9, 1, 2, 3, 5, 6, 7, *(0,) * 9)]}, dict.fromkeys((1, 2, 3, 5, 6, 7), RHO / 12.0)),
        ({(5508, 55): [(1, 9, 1, 2, 3, 6, *(0,) * 6)]}, dict.fromkeys((1, 2, 3, 6), RHO / 24.0)),
        ({(601, 6): [(1, 5, 1, 2, 1, 1)], (3001, 30): [(2, 6, 7, 8)]}, {7: 1.125, 8: 1.125}),
    ],
    ids=["bar", "rod", "conrod", "tube", "quad", "thick", "laminate", "triangle", "hexa", "penta", "tetra", "spring"],
)  # fmt: skip
def test_masses_at_the_corners_of_elements(tmp_path, elements, expected):
    masses, inertias, factor = masses_of(tmp_path / "a.op2", elements)
    assert masses == pytest.approx([expected.get(k, 0.0) for k in range(1, 9)], rel=1e-6)
    assert not inertias.any()
    assert factor == 1.0


def test_a_beam_that_tapers_weighs_what_its_sections_do(tmp_path):
    """Areas of 1, 3 and 2 at the ends and the quarter: 0.25 * 2 + 0.75 * 2.5 on a length of 1."""
    stations = np.zeros((11, 16))
    stations[0, 2], stations[1, 1:3], stations[10, 1:3] = 1.0, (0.25, 3.0), (1.0, 2.0)
    beam = (5, 1, 2, 0, 0.0, *map(float, stations.ravel()), *(0.0,) * 16)
    masses, _, _ = masses_of(tmp_path / "a.op2", {(5408, 54): [(1, 5, 1, 2, *(0.0,) * 14)]}, {(5402, 54): [beam]})
    assert masses[:2] == pytest.approx([0.5 * RHO * 2.375] * 2, rel=1e-6)


def test_volumes_at_the_corners_of_a_pyramid_and_of_a_skewed_brick():
    """A pyramid weighs a third of its box; a brick that is sheared as much as before, and its shares stay an eighth."""
    pyramid = corner_shares(np.array([[*CUBE[:4], *[(0.5, 0.5, 1.0)] * 4]]))
    assert pyramid.sum() == pytest.approx(1.0 / 3.0)
    sheared = CUBE + CUBE[:, 2:] * [0.7, -0.3, 0.0]
    np.testing.assert_allclose(corner_shares(sheared[None]), 0.125, rtol=1e-12)


def test_point_masses_count_with_their_offset(tmp_path):
    elements = {(1501, 15): [(1, 2, 0, 3.0, 0.0, 0.5, 0.0, 2.0, 0.0, 4.0, 0.0, 0.0, 6.0),
                             (2, 3, -1, 5.0, 1.0, 1.0, 0.0, *(0.0,) * 6)]}  # fmt: skip
    with pytest.warns(UserWarning, match=says("CONM2", "offset", "1.5")):
        masses, inertias, _ = masses_of(tmp_path / "a.op2", elements)
    assert masses.tolist() == [0.0, 3.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(inertias[1], np.diag([2.0 + 0.75, 4.0, 6.0 + 0.75]))


CHAIN = {(3001, 30): [(k, 6, k, k + 1) for k in range(1, 5)]}
ALONG = np.outer(np.arange(5.0), (1.0, 0.0, 0.0))


def chain(path, factor=1.0, listed=True, block="OUGV1", weight=9.0, scale=1.0, without=()):
    """A free chain of four rods of 2.25 kg and 1000 N/m, whose modes in lumped masses are cosines."""
    n = np.arange(1, 5)
    at = np.arange(5)
    w2 = 1000.0 / (2.25 * factor) * 2.0 * (1.0 - np.cos(n * np.pi / 4))
    shapes = np.zeros((4, 5, 6))
    shapes[:, :, 0] = np.cos(np.outer(n, at) * np.pi / 4)
    mass = 2.25 * factor * np.array([0.5, 1, 1, 1, 0.5])
    shapes[:, :, 0] /= np.sqrt((shapes[:, :, 0] ** 2) @ mass)[:, None]
    writer = file_of(CHAIN, positions=ALONG, wtmass=factor)
    writer.weight(weight)
    kept = [k for k in at if k + 1 not in without]
    writer.modes(at[kept] + 1, scale * shapes[:, kept], w2, np.ones(4), listed=listed, block=block)
    return writer.write(path), np.sqrt(w2) / (2 * np.pi)


@pytest.mark.parametrize("others", [{}, {"listed": False}, {"factor": 0.00259}, {"block": "OPHIG", "listed": False}])
def test_modes_with_elements_are_a_body(tmp_path, others):
    """Weights are printed without WTMASS, which the masses have; without LAMA frequencies are those of the shapes."""
    file, expected = chain(tmp_path / "a.op2", **others)
    found = read_op2_modes(file)
    assert found.mass == pytest.approx(9.0 * others.get("factor", 1.0), rel=1e-6)
    np.testing.assert_allclose(found.eigenvalues[:, 3], 1.0, rtol=1e-5)
    np.testing.assert_allclose(found.modal_model("chain").frequencies, expected, rtol=1e-6)


def test_points_without_a_mass_may_have_no_shapes(tmp_path):
    """A sixth grid point, of a panel, that moves with nothing; of one with a mass the shapes are needed."""
    writer = file_of(CHAIN, positions=np.vstack([ALONG, [(9.0, 0.0, 0.0)]]))
    shapes = np.zeros((1, 5, 6))
    shapes[0, :, 0] = np.cos(np.arange(5) * np.pi / 4) / np.sqrt(2.25 * 2.0)
    writer.modes(np.arange(1, 6), shapes, np.array([100.0]), np.ones(1))
    assert read_op2_modes(writer.write(tmp_path / "a.op2")).ids.tolist() == [1, 2, 3, 4, 5]
    with pytest.raises(FlexibleError, match=says("OUGV1", "2", "all points")):
        read_op2_modes(chain(tmp_path / "b.op2", without=(2,))[0])


def test_masses_that_are_not_those_of_the_modes_are_named(tmp_path):
    with pytest.raises(FlexibleError, match=says("9", "4.5", "weight")):
        read_op2_modes(chain(tmp_path / "a.op2", weight=4.5)[0])
    with pytest.raises(FlexibleError, match=says("mode 1", "mass 1 ", "4")):
        read_op2_modes(chain(tmp_path / "b.op2", scale=2.0)[0])
    unknown = {(1101, 11): [(1, 1.0, 1, 2, 1, 1)], **CHAIN}
    with pytest.raises(FlexibleError, match=says("CMASS2", "give masses")):
        masses_of(tmp_path / "c.op2", unknown, positions=ALONG)
    with pytest.raises(FlexibleError, match=says("material 1", "MPT")):
        masses_of(tmp_path / "d.op2", CHAIN, materials={}, positions=ALONG)
    with pytest.raises(FlexibleError, match=says("CROD", "properties")):
        masses_of(tmp_path / "e.op2", {(3001, 30): [(1, 77, 1, 2)]}, positions=ALONG)
    writer = file_of(CHAIN, positions=ALONG)
    shapes = np.zeros((2, 5, 6))
    shapes[:, :, 0] = np.cos(np.outer((1, 2), np.arange(5)) * np.pi / 4) / np.sqrt(4.5)
    writer.modes(np.arange(1, 6), shapes, np.array([-5.5e4, 2.0e5]), np.ones(2))
    with pytest.raises(FlexibleError, match=says("mode 1", "-5.5e", "not stable")):
        read_op2_modes(writer.write(tmp_path / "f.op2"))


# --- bulk data ------------------------------------------------------------------------------------

CARDS = {
    "bar": (["CBAR,1,5,1,2,0.,0.,1."], {(2408, 24): [(1, 5, 1, 2, *(0.0,) * 12)]}),
    "rod": (["CROD,1,6,1,2"], {(3001, 30): [(1, 6, 1, 2)]}),
    "conrod": (["CONROD,1,1,2,1,.5,,,.25"], {(1601, 16): [(1, 1, 2, 1, 0.5, 0.0, 0.0, 0.25)]}),
    "tube": (["CTUBE,1,7,1,2"], {(3701, 37): [(1, 7, 1, 2)]}),
    "quad": (["CQUAD4,1,8,1,2,3,4"], {(2958, 51): [(1, 8, 1, 2, 3, 4, *(0.0,) * 8)]}),
    "thick": (["CQUAD4,1,8,1,2,3,4,,,+", "+,,,.5,.5,.5,.5"],
              {(2958, 51): [(1, 8, 1, 2, 3, 4, *(0.0,) * 4, *(0.5,) * 4)]}),
    "laminate": (["CQUAD4,1,10,1,2,3,4"], {(2958, 51): [(1, 10, 1, 2, 3, 4, *(0.0,) * 8)]}),
    "hexa": (["CHEXA,1,9,1,2,3,4,5,6,+", "+,7,8"], {(7308, 73): [(1, 9, *range(1, 9), *(0,) * 12)]}),
    "mass": (["CONM2,1,2,0,3.,0.,0.,0.,,+", "+,2.,0.,4.,0.,0.,6."],
             {(1501, 15): [(1, 2, 0, 3.0, *NONE, 2.0, 0.0, 4.0, 0.0, 0.0, 6.0)]}),
}  # fmt: skip
BOTH = ["MAT1,1,1.,,.3,4.", "PBAR,5,1,.5,,,,.25", "PROD,6,1,.5,,,.25", "PTUBE,7,1,2.,.5,.25", "PSHELL,8,1,.1,1,,,,.25",
        "PSOLID,9,1", "PCOMP,10,,.25,,,,,SYM,+", "+,1,.1,,,,.2"]  # fmt: skip


def bulk_file(path, cards, positions=CUBE):
    """Bulk data with case control before it, half of the grid points in a file of their own."""
    grids = [f"GRID,{k + 1},,{x:.4f},{y:.4f},{z:.4f}" for k, (x, y, z) in enumerate(positions)]
    (path.parent / "grids.inc").write_text("\n".join(grids[4:]) + "\n")
    head = ["SOL 103", "CEND", "METHOD = 1", "BEGIN BULK", "INCLUDE 'grids.inc'"]
    path.write_text("\n".join([*head, *grids[:4], *cards, "PLOTEL,90,1,2", "CELAS2,91,1.,1,1", "ENDDATA"]) + "\n")
    return path


@pytest.mark.parametrize("kind", CARDS)
def test_bulk_data_weigh_what_their_op2_file_does(tmp_path, kind):
    cards, elements = CARDS[kind]
    file = bulk_file(tmp_path / "a.bdf", [*BOTH, *cards])
    table = bulk_table(file)
    np.testing.assert_allclose(table.positions, CUBE)
    masses, inertias, _ = element_masses(file, table, file)
    expected = masses_of(tmp_path / "a.op2", elements)
    np.testing.assert_allclose(masses, expected[0], rtol=1e-6)
    np.testing.assert_allclose(inertias, expected[1], rtol=1e-6)
    assert masses.any()


def test_beams_and_layers_of_bulk_data(tmp_path):
    """A beam whose end B has the area of end A, and one that grows to 3 A; layers of a solid by their shares."""
    cards = ["MAT1,1,1.,,.3,4.", "MAT11,2,1.,1.,1.,.3,.3,.3,1.,+", "+,1.,1.,10.", "PBEAM,5,1,.5,1.,1.,,1.,.25,+",
             "+,,,,,,,,,+", "+,YESA,1.", "PBEAM,6,1,.5,1.,1.,,1.,,+", "+,,,,,,,,,+", "+,NO,1.,1.5",
             "CBEAM,1,5,1,2,0.,0.,1.", "CBEAM,2,6,3,4,0.,0.,1.",
             "PCOMPS,11,,,,,,,,+", "+,1,1,.75,,,,,,+", "+,2,2,.25", "CHEXA,3,11,1,2,3,4,5,6,+", "+,7,8"]  # fmt: skip
    file = bulk_file(tmp_path / "a.bdf", cards)
    masses = element_masses(file, bulk_table(file), file)[0]
    solid = (0.75 * 4.0 + 0.25 * 10.0) / 8.0
    assert masses[:4] == pytest.approx([solid + 0.5 * (RHO * 0.5 + 0.25)] * 2 + [solid + 0.5 * RHO] * 2)
    assert masses[4:] == pytest.approx([solid] * 4)


def test_layered_solids_of_op2_files(tmp_path):
    layers = (11, 0, 0, 0.0, 0.0, 0.0, 0.0, 0, 1, 1, 0.75, 0.0, 0, 0, 0, 0, 2, 2, 0.25, 0.0, 0, 0, 0, 0, *(-1,) * 8)
    materials = STEEL | {(2903, 29): [(2, *(0.0,) * 9, 10.0, *(0.0,) * 21)]}
    brick = {(7708, 77): [(3, 11, 0, *range(1, 9), *(0,) * 12)]}
    masses = masses_of(tmp_path / "a.op2", brick, {(16006, 160): [layers]}, materials)[0]
    assert masses == pytest.approx([5.5 / 8.0] * 8)


def test_modes_without_geometry_are_a_body_with_their_bulk_data(tmp_path):
    """Only weights, eigenvalues and shapes are in the file, as of PARAM,OGEOM,NO."""
    full, expected = chain(tmp_path / "a.op2")
    known = read_op2_modes(full)
    writer = Op2Writer()
    writer.weight(9.0)
    shapes = np.zeros((4, 5, 6))
    shapes[:, :, 0] = known.shapes[:, :, 0]
    writer.modes(np.arange(1, 6), shapes, (2.0 * np.pi * expected) ** 2, np.ones(4))
    bare = writer.write(tmp_path / "b.op2")
    with pytest.raises(FlexibleError, match=says("no grid points", "bulk")):
        read_op2_modes(bare)
    cards = ["MAT1,1,1.,,.3,4.", "PROD,6,1,.5,,,.25", *(f"CROD,{k},6,{k},{k + 1}" for k in range(1, 5))]
    found = read_op2_modes(bare, bulk=bulk_file(tmp_path / "b.bdf", cards, ALONG))
    assert found.mass == pytest.approx(9.0)
    np.testing.assert_allclose(found.modal_model("chain").frequencies, expected, rtol=1e-6)


@pytest.mark.parametrize(
    ("cards", "said"),
    [
        (["CMASS2,7,1.,1,1"], ("CMASS2", "give masses")),
        (["CBEND,7,5,1,2,0.,0.,1."], ("CBEND", "give masses")),
        (["BEGIN SUPER=1"], ("a.bdf", "BEGIN SUPER")),
        (["CBAR,7,99,1,2,0.,0.,1."], ("a.bdf", "CBAR", "properties")),
    ],
)
def test_bulk_data_that_are_not_read_are_named(tmp_path, cards, said):
    file = bulk_file(tmp_path / "a.bdf", [*BOTH, "CROD,1,6,1,2", *cards])
    with pytest.raises(FlexibleError, match=says(*said)):
        element_masses(file, bulk_table(file), file)


def test_bulk_data_that_are_not_there(tmp_path):
    with pytest.raises(FlexibleError, match=says("none.bdf", "no such file")):
        bulk_table(tmp_path / "none.bdf")
    (tmp_path / "empty.bdf").write_text("BEGIN BULK\nENDDATA\n")
    with pytest.raises(FlexibleError, match=says("empty.bdf", "grid points")):
        bulk_table(tmp_path / "empty.bdf")
