"""Nastran's files: matrices and modes of op2, superelements of OP4 with their assembly, and files that lie."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from gearmbs.flexible import (
    FlexibleError,
    Shaft,
    ShaftSection,
    check_model,
    from_matrices,
    mnf_of,
    read_op2,
    read_op2_modes,
    read_op2_stresses,
    read_op4,
    reduce_model,
)
from gearmbs.flexible.nastran import axes_at, op2_tables
from tests.flexible.op2_files import Op2Writer
from tests.flexible.test_files import cube
from tests.generators import cases, seed
from tests.says import says

with np.printoptions():
    op4 = pytest.importorskip("pyyeti.nastran.op4")

FILES = os.environ.get("GEARMBS_NASTRAN_FILES")
CYLINDER = (20, 2, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
"""A cylindrical coordinate system about z."""


@pytest.fixture(scope="module")
def bar():
    return Shaft([ShaftSection(0.4, 0.03)], seats={"A": 0.0, "B": 0.4}, elements=4, name="bar").model()


def in_system(model, users, angle):
    """The degrees of freedom turned about z at some nodes, as a cylindrical system has them."""
    turn = np.eye(len(model.dofs))
    c, s = np.cos(angle), np.sin(angle)
    for node in np.flatnonzero(np.isin(model.ids, users)):
        for base in (0, 3):
            rows = 6 * node + base + np.arange(2)
            turn[np.ix_(rows, rows)] = [[c, s], [-s, c]]
    return turn


def g_set_file(path, bar, order="<", shift=(0.0, 0.0, 0.0), names=("KGG", "MGG")):
    """An op2 file with the matrices of the bar, two of whose points have cylindrical displacements."""
    place = bar.positions + shift
    users = bar.ids[1:3]
    angle = np.arctan2(shift[1], shift[0])
    turn = in_system(bar, users, angle)
    writer = Op2Writer(order)
    writer.grids(bar.ids, place, (CYLINDER, users))
    for name, matrix in zip(names, (bar.stiffness, bar.mass)):
        writer.matrix(name, turn @ matrix.toarray() @ turn.T)
    return writer.write(path)


@pytest.mark.parametrize("order", ["<", ">"])
def test_matrices_of_op2_are_turned_into_the_basic_system(tmp_path, bar, order):
    file = g_set_file(tmp_path / "bar.op2", bar, order, shift=(0.25, 0.5, 0.0))
    found = read_op2(file)
    np.testing.assert_allclose(found.stiffness.toarray(), bar.stiffness.toarray(), rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(found.mass.toarray(), bar.mass.toarray(), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.positions, bar.positions + [0.25, 0.5, 0.0], rtol=1e-7)
    assert check_model(found).good
    tonnes = read_op2(file, length=1e-3, mass_unit=1e3)
    np.testing.assert_allclose(tonnes.mass_properties().mass, 1e3 * bar.mass_properties().mass, rtol=1e-9)
    # lengths in mm and stiffness in N/mm make frequencies of sqrt(1 N/mm / 1 t)
    slow = reduce_model(tonnes, [], modes=1, method="free").frequencies
    np.testing.assert_allclose(slow, reduce_model(found, [], modes=1, method="free").frequencies, rtol=1e-6)


def modes_file(path, bar, model, weight=None, drop=None, mgg=True, without=(), order="<"):
    """An op2 file with the modes of the free bar and its mass matrix."""
    mnf = mnf_of(model)
    kept = mnf.elastic
    writer = Op2Writer(order)
    ids = bar.ids if drop is None else bar.ids[:drop]
    writer.grids(bar.ids, bar.positions, without=without)
    writer.weight(model.properties.mass if weight is None else weight)
    shapes = mnf.shapes[kept][:, : len(ids)]
    writer.modes(ids, shapes, (2 * np.pi * model.frequencies) ** 2, mnf.eigenvalues[kept, 3])
    if mgg:
        writer.matrix("MGG", bar.mass.toarray())
    return writer.write(path)


@pytest.mark.parametrize("order", ["<", ">"])
def test_modes_of_op2_are_those_of_the_body(tmp_path, bar, order):
    model = reduce_model(bar, modes=6)
    found = read_op2_modes(modes_file(tmp_path / "bar.op2", bar, model, order=order))
    again = found.modal_model("bar")
    np.testing.assert_allclose(again.frequencies, model.frequencies, rtol=1e-6)
    np.testing.assert_allclose(again.moved, model.moved, atol=1e-6 * np.abs(model.moved).max())
    np.testing.assert_allclose(again.properties.com, model.properties.com, atol=1e-9)
    # masses lumped at the nodes, as in a file of ADAMS
    own = mnf_of(model).modal_model("bar")
    np.testing.assert_allclose(again.properties.inertia, own.properties.inertia, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(again.integrals.second, own.integrals.second, rtol=1e-4, atol=1e-4)
    assert found.units == ("KILOGRAM", "METER", "SECOND", "NEWTON")


def places(kind, x):
    """Coordinates of a place in a system at the origin: rectangular, cylindrical, spherical (degrees)."""
    if kind == 1:
        return x
    around = np.rad2deg(np.arctan2(x[1], x[0]))
    if kind == 2:
        return np.array([np.hypot(x[0], x[1]), around, x[2]])
    return np.array([np.linalg.norm(x), np.rad2deg(np.arctan2(np.hypot(x[0], x[1]), x[2])), around])


def axes_there(kind, x):
    """Unit vectors of the coordinates at a place, as columns, by differences of the place itself."""
    if kind == 1:
        return np.eye(3)
    r, (c, s) = np.hypot(x[0], x[1]), np.array(x[:2]) / np.hypot(x[0], x[1])
    if kind == 2:
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    rho = np.linalg.norm(x)
    out = np.array([x / rho, [c * x[2] / rho, s * x[2] / rho, -r / rho], [-s, c, 0]])
    return out.T


@pytest.mark.parametrize("case", range(cases(12)))
def test_grid_points_of_bulk_data_are_where_the_basic_system_has_them(tmp_path, case):
    """GEOM1 alone: systems in systems, by points and by grid points, words of both orders, wide numbers or not."""
    rng = np.random.default_rng((seed(), case))
    order, wide = "<>"[case % 2], bool(case // 2 % 2)
    writer = Op2Writer(order)
    systems = {0: (1, np.zeros(3), np.eye(3))}
    count = 9
    ids = np.sort(rng.choice(10_000, count, replace=False) + 1)
    points = rng.normal(size=(count, 3)) + [3.0, 0.0, 0.0]
    given, shown = np.zeros(count, dtype=int), np.zeros(count, dtype=int)

    def seen_from(number, x):
        kind, origin, axes = systems[number]
        return places(kind, axes.T @ (x - origin))

    records = {}
    # three grid points in the basic system carry the first system, the others lean on those before
    for number in rng.permutation(np.arange(11, 16)):
        kind, inner = int(rng.integers(1, 4)), int(rng.choice(list(systems)))
        by_grids = len(systems) == 1
        three = points[:3] if by_grids else rng.normal(size=(3, 3)) + [5.0, 0.0, 0.0]
        z = three[1] - three[0]
        z /= np.linalg.norm(z)
        y = np.cross(z, three[2] - three[0])
        y /= np.linalg.norm(y)
        if by_grids:
            key = {1: (1801, 18, 5), 2: (1701, 17, 6), 3: (1901, 19, 7)}[kind]
            data = writer.ints(number, kind, 1, *ids[:3])
        else:
            key = {1: (2101, 21, 8), 2: (2001, 20, 9), 3: (2201, 22, 10)}[kind]
            data = writer.ints(number, kind, 2, inner) + writer.reals([seen_from(inner, x) for x in three], wide)
        records.setdefault(key, []).append(data)
        systems[int(number)] = (kind, three[0], np.column_stack([np.cross(y, z), y, z]))
    given[3:] = rng.choice(list(systems), count - 3)
    for k, c in enumerate(rng.choice(list(systems), count)):
        _, origin, axes = systems[int(c)]
        # on the axis of a system the direction around it is none
        shown[k] = c if np.hypot(*(axes.T @ (points[k] - origin))[:2]) > 0.3 else 0
    rows = [
        writer.ints(i, g) + writer.reals(seen_from(int(g), x), wide) + writer.ints(int(c), 0, 0)
        for i, g, x, c in zip(ids, given, points, shown)
    ]
    order_of_rows = rng.permutation(count)
    geometry = [writer.ints(*key) + b"".join(data) for key, data in records.items()]
    geometry.append(writer.ints(4501, 45, 1120001 if wide else 1) + b"".join(rows[k] for k in order_of_rows))
    writer.table("GEOM1", [*geometry, writer.ints(65535, 65535, 65535)])
    writer.matrix("KGG", np.eye(6 * count))
    found = op2_tables(writer.write(tmp_path / "x.op2"), ["KGG"])["grids"]
    assert list(found.ids) == list(ids)
    np.testing.assert_allclose(found.positions, points, atol=1e-12 if wide else 2e-4)
    for k, c in enumerate(shown):
        kind, origin, axes = systems[int(c)]
        expected = axes @ axes_there(kind, axes.T @ (points[k] - origin))
        np.testing.assert_allclose(found.axes[k], expected, atol=1e-9 if wide else 5e-3)


def test_grid_points_of_geom1_alone_make_the_same_body(tmp_path, bar):
    model = reduce_model(bar, modes=6)
    whole = read_op2_modes(modes_file(tmp_path / "a.op2", bar, model)).modal_model("bar")
    for drop in (("BGPDT",), ("EQEXIN",), ("BGPDT", "EQEXIN")):
        found = read_op2_modes(modes_file(tmp_path / "b.op2", bar, model, without=drop)).modal_model("bar")
        np.testing.assert_array_equal(found.positions, whole.positions)
        np.testing.assert_allclose(found.moved, whole.moved, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(found.properties.inertia, whole.properties.inertia, rtol=1e-12, atol=1e-15)
    with pytest.raises(FlexibleError, match=r"GEOM1.*missing.*GEOM1 alone"):
        read_op2_modes(modes_file(tmp_path / "c.op2", bar, model, without=("GEOM1",)))


@pytest.mark.parametrize(("analysis", "what"), [(5, "frequency responses"), (9, "complex modes"), (6, "a transient")])
def test_shapes_that_are_no_modes_are_named(tmp_path, bar, analysis, what):
    model = reduce_model(bar, modes=2)
    file = modes_file(tmp_path / "a.op2", bar, model)
    data = file.read_bytes()
    at = data.index(np.array([22, 7, 0, 1, 1], "<i4").tobytes())
    file.write_bytes(data[:at] + np.array([10 * analysis + 2], "<i4").tobytes() + data[at + 4 :])
    with pytest.raises(FlexibleError, match=says("OUGV1", what, "SOL 103")):
        read_op2_modes(file)


def test_modes_and_masses_must_fit(tmp_path, bar):
    model = reduce_model(bar, modes=6)
    own = mnf_of(model)
    without = modes_file(tmp_path / "a.op2", bar, model, mgg=False)
    with pytest.raises(FlexibleError, match=says("modes without masses", "MGG")):
        read_op2_modes(without)
    found = read_op2_modes(without, own.nodal_masses, inertias=own.inertias())
    np.testing.assert_allclose(found.eigenvalues[:, 1], model.frequencies, rtol=1e-6)
    with pytest.raises(FlexibleError, match=says("weight", "generator says")):
        read_op2_modes(without, 2 * own.nodal_masses)
    with pytest.raises(FlexibleError, match=says("mass 1", "file")):
        read_op2_modes(without, np.eye(5)[0] * own.nodal_masses.sum())
    with pytest.raises(FlexibleError, match=says("5", "none negative")):
        read_op2_modes(without, own.nodal_masses[:3])
    with pytest.raises(FlexibleError, match=says("4", "ask for all")):
        read_op2_modes(modes_file(tmp_path / "b.op2", bar, model, drop=3))
    with pytest.raises(FlexibleError, match=says("OUGV1", "DISPLACEMENT(PLOT)=ALL")):
        read_op2_modes(g_set_file(tmp_path / "c.op2", bar))
    with pytest.raises(FlexibleError, match=says("weight", "generator says")):
        read_op2_modes(modes_file(tmp_path / "d.op2", bar, model, weight=1e-3 * model.properties.mass))


def test_op2_files_that_lie_are_named(tmp_path, bar):
    file = g_set_file(tmp_path / "bar.op2", bar)
    data = file.read_bytes()
    cut = tmp_path / "cut.op2"
    for share in np.linspace(0.02, 0.999, 25):
        cut.write_bytes(data[: int(share * len(data))])
        with pytest.raises(FlexibleError, match=r"cut\.op2: byte \d+: .*(cut off|within)"):
            read_op2(cut)
    for text, message in ((b"\x07\x00\x00\x00" + data[4:], "byte 0: 07000000 begins no op2"), (b"", "begins no op2")):
        cut.write_bytes(text)
        with pytest.raises(FlexibleError, match=message):
            read_op2(cut)
    at = data.index(b"BGPDT") - 4
    cut.write_bytes(data[:at] + b"\x0a\x00\x00\x00" + data[at + 4 :])
    with pytest.raises(FlexibleError, match=says(f"byte {at}", "10 bytes")):
        read_op2(cut)
    with pytest.raises(FlexibleError, match=says("none.op2", "file")):
        read_op2(tmp_path / "none.op2")
    with pytest.raises(FlexibleError, match=says("matrix 'kxx'", "mgg")):
        read_op2(file, stiffness="KXX")
    with pytest.raises(FlexibleError, match=says("stiffness", "30", "2")):
        read_op2(file, dofs=[(1, 1), (1, 2)])
    bare = Op2Writer()
    bare.matrix("KGG", bar.stiffness.toarray())
    with pytest.raises(FlexibleError, match=says("GEOM1", "BGPDT", "EQEXIN", "Data", "KGG")):
        read_op2(bare.write(tmp_path / "bare.op2"))
    held = Op2Writer()
    held.grids(bar.ids, 1e3 * bar.positions)
    held.matrix("KGG", bar.stiffness.toarray())
    held.matrix("MGG", bar.mass.toarray())
    report = check_model(read_op2(held.write(tmp_path / "mm.op2")))
    assert any("meets stiffness" in remark for remark in report.remarks)


STRESS_OF_5 = [8.1035608e-7, -9.5543319e-7, 1.1088062e-7, -1.2773979e-7, 7.1479803e-7, -6.5983872e-7]
"""Of a mode at grid point 5 of a public file."""
BARS = [(7, 1, 2, 3, 4), (8, 2, 3, 4, 5)]
"""Two tetrahedra on the nodes of the bar, as if it had some."""


def with_stresses(path, bar, model, values, order="<", **head):
    """An op2 file with modes, masses and stresses of two elements."""
    mnf = mnf_of(model)
    writer = Op2Writer(order)
    writer.grids(bar.ids, bar.positions)
    writer.modes(bar.ids, mnf.shapes[mnf.elastic], (2 * np.pi * model.frequencies) ** 2, np.ones(model.modes))
    writer.matrix("MGG", bar.mass.toarray())
    writer.stresses(BARS, values, kind=39, **head)
    return writer.write(path)


@pytest.mark.parametrize("order", ["<", ">"])
def test_stresses_of_op2_are_means_of_elements_and_follow_the_modes(tmp_path, bar, order):
    model = reduce_model(bar, modes=6).slowest(6)
    values = np.random.default_rng(7).normal(size=(model.modes, 2, 4, 6))
    found = read_op2_stresses(with_stresses(tmp_path / "a.op2", bar, model, values, order), length=1e-3, force=2.0)
    np.testing.assert_allclose(found.positions, 1e-3 * bar.positions, rtol=1e-6)
    np.testing.assert_allclose(found.values[:, 0], 2e6 * values[:, 0, 0], rtol=1e-6)
    np.testing.assert_allclose(found.values[:, 2], 1e6 * (values[:, 0, 2] + values[:, 1, 1]), rtol=1e-5, atol=1.0)
    np.testing.assert_allclose(found.values[:, 4], 2e6 * values[:, 1, 3], rtol=1e-6)
    if order == ">":
        return
    body = read_op2_modes(tmp_path / "a.op2", stresses=True).modal_model("bar")
    np.testing.assert_allclose(body.stress_modes().values, found.values / 2e6, rtol=1e-6, atol=1e-6)
    few = body.selected([4, 1])
    np.testing.assert_allclose(few.stress_modes().values, body.stress_modes().values[[4, 1]], rtol=1e-9, atol=1e-9)
    with pytest.raises(FlexibleError, match=says("stresses", "known")):
        read_op2_modes(tmp_path / "a.op2").modal_model("bar").stress_modes()


def test_stresses_of_op2_that_cannot_be_taken_are_named(tmp_path, bar):
    model = reduce_model(bar, modes=2)
    values = np.ones((model.modes, 2, 4, 6))
    cases = [
        ({"system": 3}, says("stresses", "CTETRA 7", "system 3", "PSOLID", "leave CORDM")),
        ({"w1": 2005}, says("2005", "1", "5", "stresses", "modes")),
        ({"w8": 3}, says("5", "3", "table of code")),
        ({"w9": 50}, says("872 bytes", "50 words")),
        ({"w9": 218}, "CTETRA has 218 words, 109 hold the stresses"),
        ({"w4": 1}, says("1", "stresses", "write")),
    ]
    for head, message in cases:
        with pytest.raises(FlexibleError, match=message):
            read_op2_stresses(with_stresses(tmp_path / "a.op2", bar, model, values, **head))
    whole = with_stresses(tmp_path / "a.op2", bar, model, values).read_bytes()
    words = np.frombuffer(whole, "<i4").copy()
    words[np.flatnonzero(words == 39)[1]] = 40
    (tmp_path / "a.op2").write_bytes(words.tobytes())
    with pytest.raises(FlexibleError, match=says("2", "stresses", "40")):
        read_op2_stresses(tmp_path / "a.op2")
    with pytest.raises(FlexibleError, match=says("1 modes", "LAMA", str(model.modes), "ask for all")):
        read_op2_modes(with_stresses(tmp_path / "a.op2", bar, model, values[:1]), stresses=True)
    with pytest.raises(FlexibleError, match=says("stresses", "OES1X1", "OES1X", "OES1")):
        read_op2_stresses(modes_file(tmp_path / "b.op2", bar, model))
    writer = Op2Writer()
    writer.grids(bar.ids, bar.positions)
    writer.stresses(BARS, values, kind=39)
    writer.stresses([(9, 1, 2, 3, 4)], values[:, :1], kind=1, name="OES1")
    with pytest.warns(UserWarning, match=says("1", "left out")):
        assert len(read_op2_stresses(writer.write(tmp_path / "c.op2")).values) == model.modes


ASSEMBLY = """\
SEBULK       101  EXTOP4          MANUAL                     101
$
CORD2R*               10               0 0.000000000E+00 0.000000000E+00
*        0.000000000E+00 0.100000000E+01 0.000000000E+00 0.000000000E+00
*        0.000000000E+00 0.100000000E+01 0.000000000E+00
$
SECONCT      101       0              NO
               1       1       5       5
         2995001 2995001 2995002 2995002
$
GRID*                  1               0 0.000000000E+00 0.000000000E+00
*        0.000000000E+00               0               0               0
GRID*                  5               0 0.000000000E+00 0.000000000E+00
*        0.400000000E+00              10               0               0
$
SPOINT   2995001 2995002
"""


def superelement(folder, bar):
    """OP4 and assembly of the bar reduced to its ends and two modes, point 5 in a turned coordinate system."""
    k, m = bar.stiffness.toarray(), bar.mass.toarray()
    outer = np.flatnonzero(np.isin(bar.dofs[:, 0], (0, 4)))
    inner = np.setdiff1d(np.arange(len(k)), outer)
    basis = np.zeros((len(k), 14))
    basis[outer, np.arange(12)] = 1.0
    basis[np.ix_(inner, np.arange(12))] = -np.linalg.solve(k[np.ix_(inner, inner)], k[np.ix_(inner, outer)])
    _, vectors = scipy.linalg.eigh(k[np.ix_(inner, inner)], m[np.ix_(inner, inner)])
    basis[np.ix_(inner, [12, 13])] = vectors[:, :2]
    # axes of the system as columns: its z is the basic x, its x the basic y
    axes = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    turn = np.eye(14)
    turn[6:9, 6:9] = turn[9:12, 9:12] = axes.T
    reduced = [turn @ basis.T @ matrix @ basis @ turn.T for matrix in (k, m)]
    op4.write(str(folder / "bar.op4"), dict(zip(("kxx", "mxx"), reduced)))
    (folder / "bar.asm").write_text(ASSEMBLY)


def test_a_superelement_with_its_assembly_file(tmp_path, bar):
    superelement(tmp_path, bar)
    found = read_op4(tmp_path / "bar.op4", assembly=tmp_path / "bar.asm")
    report = check_model(found, 2)
    assert report.good
    np.testing.assert_allclose(report.properties.mass, bar.mass_properties().mass, rtol=1e-9)
    np.testing.assert_allclose(report.properties.com, bar.mass_properties().com, atol=1e-9)
    exact = check_model(bar, 2).frequencies[6:]
    np.testing.assert_allclose(report.frequencies[6:], exact, rtol=5e-3)
    assert np.all(report.frequencies[6:] >= exact * (1 - 1e-9))
    body = reduce_model(found, [], modes=4, method="free")
    np.testing.assert_allclose(body.frequencies[:2], exact, rtol=5e-3)


def record_ends(data):
    """Where the records of a binary file of this machine's byte order end."""
    at = 0
    while at < len(data):
        at += 8 + int.from_bytes(data[at : at + 4], sys.byteorder)
        yield at


@pytest.mark.slow
def test_op4_files_that_lie_are_named(tmp_path, bar):
    superelement(tmp_path, bar)
    file = tmp_path / "bar.op4"
    data, cut = file.read_bytes(), tmp_path / "cut.op4"
    # wherever it is cut: how long its records are, and so what a share of the file hits, is a matter of rounding
    ends = list(record_ends(data))
    assert ends[-1] == len(data)
    for end in {*ends[:-1], *(end + part for end in (0, *ends[:-1]) for part in (1, 3, 4, 7, 8, 20))}:
        cut.write_bytes(data[:end])
        with pytest.raises(FlexibleError, match=r"cut\.op4: .*(cut off|matrix|byte 0)"):
            read_op4(cut, assembly=tmp_path / "bar.asm")
    with pytest.raises(FlexibleError, match=says("assembly", "give positions")):
        read_op4(file)
    (tmp_path / "short.asm").write_text(ASSEMBLY.replace("SPOINT   2995001 2995002\n", "SPOINT   2995001\n"))
    with pytest.raises(FlexibleError, match=r"14 rows|no assembly file"):
        read_op4(file, assembly=tmp_path / "short.asm")
    (tmp_path / "no.asm").write_text("nothing\n")
    with pytest.raises(FlexibleError, match=r"no\.asm: it is no assembly file"):
        read_op4(file, assembly=tmp_path / "no.asm")
    op4.write(str(cut), {"kxx": np.eye(14), "mxx": np.eye(14)}, binary=False)
    whole = cut.read_bytes()
    for end in range(1, len(whole.rstrip().rpartition(b"\n")[0]), 37):
        cut.write_bytes(whole[:end])
        with pytest.raises(FlexibleError, match=r"cut\.op4: .*(OP4|no matrix)"):
            read_op4(cut, assembly=tmp_path / "bar.asm")


@pytest.mark.skipif(FILES is None, reason="GEARMBS_NASTRAN_FILES names no folder with public files of Nastran")
def test_public_files():
    """A superelement of pyyeti's tests against Nastran's own weights; a beam of pyNastran's against its eigenvalues."""
    folder = Path(FILES or "")
    found = read_op4(folder / "inboard.op4", assembly=folder / "inboard.asm")
    report = check_model(found)
    np.testing.assert_allclose(report.properties.mass, 1.755052, rtol=1e-6)
    assert report.rigid_energy.max() < 1e-10
    masses = np.r_[0.5, np.ones(9), 0.5, 0.0] * 7.4851e-4 * np.pi
    masses[10] += 2.59e-3
    modes = read_op2_modes(folder / "beam_modes_m1.op2", masses)
    np.testing.assert_allclose(modes.eigenvalues[:2, 1], [456.6603, 456.6603], rtol=1e-6)
    np.testing.assert_allclose(modes.mass, 0.02610514, rtol=1e-5)
    with pytest.warns(UserWarning, match="are left out"):
        stresses = read_op2_stresses(folder / "modes_elements.op2")
    # of grid point 5 in mode 2, by pyNastran 1.4.1, the mean of two elements
    row = int(np.flatnonzero((stresses.positions == [1.0, 1.0, 1.0]).all(axis=1))[0])
    np.testing.assert_allclose(stresses.values[1, row], STRESS_OF_5, rtol=1e-6)


@pytest.mark.parametrize("kind", [2, 3])
def test_points_on_the_axis_of_a_tilted_system_have_its_axes(kind):
    c, s = np.cos(0.7), np.sin(0.7)
    axes, origin = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]), np.array([1.1, 0.3, -0.2])
    usual = axes if kind == 2 else axes[:, [2, 0, 1]]
    for along in (0.1, 0.3, 0.7, 1.3):
        # in words of 4 bytes, too, such points are beside the axis by rounding
        for place in (origin + along * axes[:, 2], np.float32(origin + along * axes[:, 2]).astype(float)):
            found = axes_at(np.vstack([place, [0.0, kind, 0.0], origin, axes]))
            np.testing.assert_allclose(found, usual, atol=1e-5)
    beside = axes_at(np.vstack([origin + axes @ [0.0, 1e-3, 0.3], [0.0, 2.0, 0.0], origin, axes]))
    np.testing.assert_allclose(beside, axes[:, [1, 0, 2]] * [1.0, -1.0, 1.0], atol=1e-9)


def test_empty_rotations_of_solid_elements_are_none(tmp_path):
    corners, k, m = cube()
    rows = np.flatnonzero(np.arange(48) % 6 < 3)
    writer = Op2Writer()
    writer.grids(np.arange(1, 9), corners)
    for name, matrix in (("KGG", k), ("MGG", m)):
        whole = np.zeros((48, 48))
        whole[np.ix_(rows, rows)] = matrix
        writer.matrix(name, whole)
    found = read_op2(writer.write(tmp_path / "cube.op2"))
    assert not found.has_rotations
    expected = reduce_model(from_matrices(k, m, corners), [], modes=4, method="free").frequencies
    np.testing.assert_allclose(reduce_model(found, [], modes=4, method="free").frequencies, expected, rtol=1e-6)
