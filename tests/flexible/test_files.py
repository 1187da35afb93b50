"""Files of other programs: what they hold, that they survive a round trip, and that files that lie are named."""

import os
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from gearmbs.flexible import (
    FlexibleError,
    Interface,
    Shaft,
    ShaftSection,
    check_model,
    check_reduction,
    from_matrices,
    mnf_of,
    read_abaqus,
    read_calculix,
    read_mnf,
    read_op4,
    reduce_model,
    write_mnf,
)
from gearmbs.flexible.fe_model import MassProperties
from gearmbs.mechanism import Mechanism
from tests.says import says

MNF = os.environ.get("GEARMBS_MNF_FILES")
ROTOR = os.environ.get("GEARMBS_ROTOR_FILES")


def bar():
    return Shaft([ShaftSection(0.4, 0.03)], seats={"A": 0.0, "B": 0.4}, elements=4, name="bar").model()


def rotating_bar_file(folder: Path) -> Path:
    path = folder / "bar.mnf"
    write_mnf(path, mnf_of(reduce_model(bar()).slowest(8)))
    return path


# --- modal neutral files ----------------------------------------------------------------------------------


def test_a_written_file_is_read_as_it_was(tmp_path):
    model = reduce_model(bar()).slowest(8)
    path = rotating_bar_file(tmp_path)
    found = read_mnf(path)
    assert list(found.interfaces) == [1, 5]
    copy = tmp_path / "copy.mnf"
    write_mnf(copy, found)
    assert copy.read_bytes() == path.read_bytes()
    back = found.modal_model("bar")
    np.testing.assert_array_equal(back.frequencies, model.frequencies)
    np.testing.assert_array_equal(back.moved, model.moved)
    np.testing.assert_allclose(back.properties.mass, model.properties.mass, rtol=1e-12)
    assert list(back.seats) == ["node 1", "node 5"]
    m = Mechanism("m")
    body = back.add_to(m, damping="adams")
    m.fixed("clamp", body.marker(back.place(1)), m.ground.marker())
    assert back.modes == 8


def test_invariants_have_their_meaning(tmp_path):
    """Kinetic energy of nodes moved rigidly and by two modes, from the invariants."""
    found = read_mnf(rotating_bar_file(tmp_path))
    i, rng = found.invariants(), np.random.default_rng(1)
    w, q, v = rng.standard_normal(3), 1e-3 * rng.standard_normal((2, 2)), None
    q, v = q
    chosen = [7, 8]
    phi, m, s = found.shapes[chosen, :, :3], found.nodal_masses, found.positions
    moved = s + np.einsum("n,npi->pi", q, phi)
    speed = np.cross(w, moved) + np.einsum("n,npi->pi", v, phi)
    energy = 0.5 * m @ (speed**2).sum(axis=1)
    own = found.inertias().sum(axis=0)
    first = i["I8"][chosen]
    inertia = i["I7"] - own - np.einsum("n,nij->ij", q, first + first.transpose(0, 2, 1))
    inertia -= np.einsum("j,k,jkab->ab", q, q, i["I9"][np.ix_(chosen, chosen)])
    spun = np.einsum("pij,npj->npi", found.inertias(), found.shapes[chosen, :, 3:]).sum(axis=1)
    coupling = i["I4"][chosen] - spun + np.einsum("j,jkc->kc", q, i["I5"][np.ix_(chosen, chosen)])
    mass = np.einsum("p,kpi,lpi->kl", m, phi, phi)
    total = 0.5 * w @ inertia @ w + w @ coupling.T @ v + 0.5 * v @ mass @ v
    np.testing.assert_allclose(total, energy, rtol=1e-10)


@pytest.mark.parametrize("share", [0.0005, 0.1, 0.3, 0.6, 0.9, 0.97])
def test_a_file_that_is_cut_off_is_named_with_its_block(tmp_path, share):
    data = rotating_bar_file(tmp_path).read_bytes()
    cut = tmp_path / "cut.mnf"
    cut.write_bytes(data[: int(share * len(data))])
    with pytest.raises(FlexibleError, match=r"cut\.mnf: byte \d+.*(cut off|version)"):
        read_mnf(cut)


def changed(path: Path, at: int, new: bytes) -> Path:
    data = bytearray(path.read_bytes())
    data[at : at + len(new)] = new
    out = path.with_name("lie.mnf")
    out.write_bytes(bytes(data))
    return out


@pytest.mark.parametrize(
    ("at", "new", "message"),
    [
        (0, b"\x3c\x01\x00\x00", "little-endian"),
        (0, b"\x00\x00\x01\x32", says("MNF", "version code")),
        (0xA14, b"\x05\x00\x00\x00", "number of them"),
        (0xA14 + 4, b"\x00\x00\x00\x02", "nodes of 2 coordinates"),
        (0xA14 + 8, b"\x00\x00\x00\x02", says("lie.mnf", "nodes", "twice")),
        (0xA14 + 12, b"\x7f\xf8" + bytes(6), says("lie.mnf", "2588", "nodes", "finite")),
        (0xA14 - 400 + 4 * 9, b"\x00\x00\x00\x01", says("generalised stiffness")),
        (0xA14 - 400 + 4 * 5, b"\x00\x00\x00\x00", "no nodal masses"),
        (0xA14 + 8 + 5 * 28, b"\x40\x59" + bytes(6), says("nodal masses sum")),
    ],
)
def test_files_that_lie_are_named(tmp_path, at, new, message):
    with pytest.raises(FlexibleError, match=message):
        read_mnf(changed(rotating_bar_file(tmp_path), at, new))


def test_numbers_that_do_not_fit_each_other_are_named(tmp_path):
    """Whole files: shapes in millimetres, a wrong eigenvalue, and units that are not those of the numbers."""
    path = rotating_bar_file(tmp_path)
    found = read_mnf(path)
    shapes = found.shapes * [1e3, 1e3, 1e3, 1, 1, 1]
    write_mnf(path, replace(found, shapes=shapes))
    with pytest.raises(FlexibleError, match=says("bar.mnf", "1", "06", "units")):
        read_mnf(path)
    eigenvalues = found.eigenvalues.copy()
    eigenvalues[9, 0] *= 1.01
    write_mnf(path, replace(found, eigenvalues=eigenvalues))
    with pytest.raises(FlexibleError, match=says("10", "fit each other")):
        read_mnf(path)
    write_mnf(path, replace(found, units=("KILOGRAM", "MILLIMETER", "SECOND", "NEWTON"), unit_bytes=b""))
    with pytest.warns(UserWarning, match=says("units", "file", "KILOGRAM", "MILLIMETER")):
        read_mnf(path)


def test_other_nodes_units_and_no_nodal_inertias(tmp_path):
    found = read_mnf(rotating_bar_file(tmp_path))
    path = tmp_path / "other.mnf"
    write_mnf(path, replace(found, units=("STONE", "METER", "SECOND", "NEWTON"), unit_bytes=b""))
    with pytest.raises(FlexibleError, match=says("unit", "mass 'STONE'")):
        read_mnf(path)
    small = replace(
        found, units=("MEGAGRAM", "MILLIMETER", "SECOND", "NEWTON"), unit_bytes=b"", positions=1e3 * found.positions,
        centre=1e3 * found.centre, mass=1e-3 * found.mass, nodal_masses=1e-3 * found.nodal_masses,
        nodal_inertias=None, header=b"",
    )  # fmt: skip
    write_mnf(path, small)
    scaled = read_mnf(path).modal_model()
    np.testing.assert_allclose(scaled.properties.mass, found.mass, rtol=1e-12)
    np.testing.assert_allclose(np.ptp(scaled.positions[:, 2]), 0.4, rtol=1e-12)
    np.testing.assert_allclose(np.diag(scaled.integrals.mass), 1e-3, rtol=1e-12)
    with pytest.raises(FlexibleError, match="no node 9"):
        scaled.place(9)


@pytest.mark.skipif(MNF is None, reason="GEARMBS_MNF_FILES names no folder with the public files and their text dumps")
@pytest.mark.parametrize("name", ["siso_beam", "siso_block", "two_input_single_output_block_beam"])
def test_public_files_against_the_text_dump_of_adams(tmp_path, name):
    folder = Path(MNF or "")
    found = read_mnf(folder / f"{name}.mnf")
    write_mnf(tmp_path / "copy.mnf", found)
    assert (tmp_path / "copy.mnf").read_bytes() == (folder / f"{name}.mnf").read_bytes()
    text, own = (folder / f"{name}.mtx").read_text(), found.invariants()
    for block, key in ((21, "I3"), (22, "I4"), (23, "I5"), (24, "I7"), (25, "I8"), (26, "I9")):
        start = text.index(f"Block {block:3d}:")
        part = text[start : text.find("|    Block", start + 5)]
        numbers = [float(x) for x in re.findall(r"-?\d\.\d+e[+-]\d+", part)]
        np.testing.assert_allclose(np.array(numbers).reshape(own[key].shape), own[key], atol=1e-10)

    start = text.index("Block   7:")
    rows = re.findall(r"^ *\d+((?: +[-\d.]+e[+-]\d+){5})$", text[start : text.index("Block   8:")], re.MULTILINE)
    printed = np.array([[float(x) for x in row.split()] for row in rows])
    assert len(printed) == len(found.mode_ids)
    elastic = printed[:, 1] > 1e-2
    np.testing.assert_allclose(found.eigenvalues[elastic], printed[elastic], rtol=1e-9)
    # what rounding leaves of the six rigid modes
    np.testing.assert_allclose(found.eigenvalues[~elastic], printed[~elastic], rtol=1e-7, atol=1e-9)
    model = found.modal_model()
    assert np.count_nonzero(elastic) == model.modes == len(printed) - 6
    np.testing.assert_allclose(np.sort(model.frequencies), np.sort(printed[elastic, 1]), rtol=1e-8)
    mass, *centre = re.search(r"Mass: +(\S+)\s+Center of Mass: +(\S+) +(\S+) +(\S+)", text).groups()
    np.testing.assert_allclose(model.properties.mass, float(mass), rtol=1e-8)
    np.testing.assert_allclose(model.properties.com, [float(x) for x in centre], atol=1e-9)


# --- matrices ---------------------------------------------------------------------------------------------


def cube():
    """Eight masses joined by springs along all lines: free, with displacements only."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 2)], dtype=float)
    k = np.zeros((24, 24))
    for a in range(8):
        for b in range(a):
            line = corners[a] - corners[b]
            line = line / np.linalg.norm(line)
            part = 1e5 * np.outer(line, line)
            for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                k[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += sign * part
    return corners, k, 0.5 * np.eye(24)


def write_triplets(path, matrix, both=True, pairs=False):
    rows = []
    for i, j in zip(*np.nonzero(matrix)):
        if both or i >= j:
            value = f"{matrix[i, j]:.17e}"
            rows.append(
                f"{i // 3 + 1},{i % 3 + 1},{j // 3 + 1},{j % 3 + 1},{value}" if pairs else f"{i + 1} {j + 1} {value}"
            )
    path.write_text("\n".join(rows) + "\n")


def write_nodes(path, corners):
    rows = [f"{k + 1}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(corners)]
    path.write_text("*Heading\n** made here\n*NODE, NSET=ALL\n" + "\n".join(rows) + "\n*ELEMENT, TYPE=C3D8\n1,1,2\n")


@pytest.mark.parametrize(("both", "pairs"), [(True, False), (False, False), (True, True), (False, True)])
def test_abaqus_and_calculix_matrices(tmp_path, both, pairs):
    corners, k, m = cube()
    expected = reduce_model(from_matrices(k, m, corners), [], modes=6, method="free").frequencies
    stiff, mass, nodes = tmp_path / "a.sti", tmp_path / "a.mas", tmp_path / "a.inp"
    write_triplets(stiff, k, both, pairs)
    write_triplets(mass, m, both, pairs)
    write_nodes(nodes, corners)
    model = read_abaqus(stiff, mass, nodes)
    assert check_model(model).good
    np.testing.assert_allclose(reduce_model(model, [], modes=6, method="free").frequencies, expected, rtol=1e-12)
    write_nodes(nodes, 1e3 * corners)
    scaled = read_abaqus(stiff, mass, nodes, length=1e-3, force=1e-3)
    np.testing.assert_allclose(scaled.positions, corners)
    if not pairs:
        write_nodes(nodes, corners)
        (tmp_path / "a.dof").write_text("".join(f"{i // 3 + 1}.{i % 3 + 1}\n" for i in range(24)))
        found = reduce_model(read_calculix(stiff, nodes), [], modes=6, method="free")
        np.testing.assert_allclose(found.frequencies, expected, rtol=1e-12)
        write_nodes(nodes, 1e3 * corners)
        in_mm = read_calculix(stiff, nodes, length="mm", mass_unit="t")
        np.testing.assert_allclose(in_mm.positions, corners)
        np.testing.assert_allclose(in_mm.mass.toarray(), 1e3 * np.asarray(m), rtol=1e-12)


def test_one_triangle_of_nodes_in_any_order(tmp_path):
    corners, k, m = cube()
    numbers = np.array([3, 8, 1, 6, 2, 7, 5, 4])
    paths = [tmp_path / name for name in ("k.mtx", "m.mtx", "n.inp")]
    for path, matrix in zip(paths, (k, m)):
        coo = sp.coo_array(np.tril(matrix))
        rows = ((numbers[i // 3], i % 3 + 1, numbers[j // 3], j % 3 + 1, v) for i, j, v in zip(*coo.coords, coo.data))
        path.write_text("".join("{},{},{},{},{!r}\n".format(*row[:4], float(row[4])) for row in rows))
    paths[2].write_text("*NODE\n" + "".join("{}, {}, {}, {}\n".format(n, *x) for n, x in zip(numbers, corners)))
    found = reduce_model(read_abaqus(*paths), [], modes=6, method="free").frequencies
    expected = reduce_model(from_matrices(k, m, corners), [], modes=6, method="free").frequencies
    np.testing.assert_allclose(found, expected, rtol=1e-10)


@pytest.mark.parametrize(
    ("head", "word"),
    [
        ("*NODE, SYSTEM=C\n", "SYSTEM=C"),
        ("*SYSTEM\n1,0,0,2,0,0\n*NODE\n", "SYSTEM"),
        ("*Instance, name=a, part=b\n1,0,0\n*NODE\n", "INSTANCE"),
        ("*NODE, SYSTEM=R\n", None),
        ("*Instance, name=a, part=b\n*NODE, NSET=all\n", None),
    ],
)
def test_nodes_in_coordinates_of_their_own(tmp_path, head, word):
    corners, k, m = cube()
    paths = [tmp_path / name for name in ("k.mtx", "m.mtx", "n.inp")]
    write_triplets(paths[0], k)
    write_triplets(paths[1], m)
    write_nodes(paths[2], corners)
    paths[2].write_text(head + paths[2].read_text().split("\n", 1)[1])
    if word is None:
        np.testing.assert_allclose(read_abaqus(*paths).positions, corners)
    else:
        with pytest.raises(FlexibleError, match=says(word, "give", "line")):
            read_abaqus(*paths)


def millimetres(tmp_path):
    """Return the files of a steel bar in mm, N, t, and the bar."""
    model = bar()
    turned = np.where(model.dofs[:, 1] < 3, 1e-3, 1.0)
    paths = [tmp_path / name for name in ("k.mtx", "m.mtx", "n.inp")]
    for path, matrix in zip(paths, (model.stiffness.toarray(), model.mass.toarray())):
        # work in N mm, time in s
        coo = sp.coo_array(1e3 * matrix * np.outer(turned, turned))
        path.write_text("".join(f"{i + 1} {j + 1} {v:.17g}\n" for i, j, v in zip(coo.row, coo.col, coo.data)))
    write_nodes(paths[2], 1e3 * model.positions)
    return paths, model


def test_wrong_units_of_a_file_are_warned_of(tmp_path):
    paths, model = millimetres(tmp_path)
    parts = [Interface("end", [1])]
    expected = reduce_model(model, [Interface("end", [model.ids[0]])], modes=4).frequencies
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for units in ((1e-3, 1.0, 1e3), ("mm", "N", "t"), ("1 mm", "1e-3 kN", "1000 kg")):
            found = read_abaqus(*paths, **dict(zip(("length", "force", "mass_unit"), units)))
            np.testing.assert_allclose(reduce_model(found, parts, modes=4).frequencies, expected, rtol=1e-6)
            assert check_model(found).good
            np.testing.assert_allclose(found.wave_speed(found.mass_properties()), np.sqrt(210e9 / 7850), rtol=0.02)
    inches = {"length": 0.0254, "force": 4.448, "mass_unit": 175.1}
    for wrong in ({}, {"length": 1e-3}, {"length": 1e-3, "force": 1e3, "mass_unit": 1e3}, inches):
        with pytest.warns(UserWarning, match=says("give the units", "material")):
            found = reduce_model(read_abaqus(*paths, **wrong), parts, modes=4)
        assert not check_model(read_abaqus(*paths, **wrong)).good
    with pytest.warns(UserWarning, match=says("3", "give the units")):
        reduce_model(read_abaqus(*paths, length=1e-3, mass_unit=1e6), parts, modes=4)
    for wrong, message in (
        ({"length": -1}, says("length = -1", "unit", "give the file's")),
        ({"length": 0}, says("length = 0", "unit", "give the file's")),
        ({"force": np.inf}, "force = inf; give"),
        ({"mass_unit": "mm"}, says("mass_unit", "'1 mm'", "expected")),
        ({"length": None}, "length: got None"),
    ):
        with pytest.raises(FlexibleError, match=message):
            read_abaqus(*paths, **wrong)


def test_no_body_is_less_dense_than_its_ellipsoid_of_inertia():
    inertia = 0.4 * 2.0 * 0.1**2 * np.eye(3)
    ball = MassProperties(2.0, np.zeros(3), inertia)
    np.testing.assert_allclose(ball.least_density, 2.0 / (4 / 3 * np.pi * 0.1**3), rtol=1e-12)
    assert MassProperties(2.0, np.zeros(3), np.zeros((3, 3))).least_density == np.inf
    assert bar().mass_properties().least_density < 7850.0


def test_a_mass_file_of_abaqus_that_ends_early(tmp_path):
    """It ends with a whole line and a whole node, so that only the nodes of the stiffness tell."""
    corners, k, m = cube()
    for name, matrix in (("k.mtx", k), ("m.mtx", m)):
        write_triplets(tmp_path / name, matrix, both=False, pairs=True)
    write_nodes(tmp_path / "n.inp", corners)
    files = [tmp_path / name for name in ("k.mtx", "m.mtx", "n.inp")]
    assert check_model(read_abaqus(*files)).good
    files[1].write_text("".join(files[1].read_text().splitlines(True)[:15]))
    with pytest.raises(FlexibleError, match=says("m.mtx", "9 displacements", "6", "mass")):
        read_abaqus(*files)
    write_triplets(files[1], m, both=False, pairs=True)
    files[0].write_text("".join(files[0].read_text().splitlines(True)[:40]))
    with pytest.raises(FlexibleError, match=says("k.mtx", "mass", "lacks direction")):
        read_abaqus(*files)
    half = np.diag([0.5] * 21 + [0.0] * 3)
    report = check_model(from_matrices(k, half, corners))
    assert any("3 displacements have no mass" in remark for remark in report.remarks)


def test_op4_files_through_pyyeti(tmp_path):
    with np.printoptions():
        op4 = pytest.importorskip("pyyeti.nastran.op4")
    model = bar()
    path = tmp_path / "bar.op4"
    op4.write(str(path), {"kxx": model.stiffness.toarray(), "mxx": model.mass.toarray()})
    found = read_op4(path, model.positions, 6, ids=model.ids)
    np.testing.assert_allclose(found.stiffness.toarray(), model.stiffness.toarray(), rtol=1e-12)
    report = check_model(found)
    np.testing.assert_allclose(report.properties.mass, model.mass_properties().mass, rtol=1e-9)
    with pytest.raises(FlexibleError, match="no matrix 'kaa'; matrices: kxx, mxx"):
        read_op4(path, model.positions, 6, stiffness="kaa")
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(FlexibleError, match=says("bar.op4", "bytes")):
        read_op4(path, model.positions, 6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f["sti"].write_text("1 1\n"), r"a.sti: line 1: 2 columns"),
        (
            lambda f: f["sti"].write_text("1 1 2.0\n2 2\n"),
            says("a.sti", "2", "3", "columns instead"),
        ),
        (lambda f: f["sti"].write_text("1 1 2.x\n"), says("a.sti", "1", "number")),
        (lambda f: f["sti"].write_text("1 1 nan\n"), r"a.sti: line 1: not finite"),
        (lambda f: f["sti"].write_text("0 1 1.0\n"), r"count from 1"),
        (lambda f: f["sti"].write_text(""), r"no entries"),
        (lambda f: f["sti"].write_text("30 30 1.0\n"), r"row 30 of 24"),
        (lambda f: f["dof"].write_text("1.1 x\n"), r"a.dof: line 1: 'x' is no node.direction"),
        (
            lambda f: f["dof"].write_text("1.1\n1.\u00b2\n", "latin-1"),
            r"a.dof: line 2: '1.\u00b2' is no node.direction",
        ),
        (lambda f: f["dof"].write_text("1.1\n1.2"), says("a.dof", "2", "file ends within")),
        (lambda f: f["sti"].write_bytes(f["sti"].read_bytes()[:-1]), says("a.sti", "file ends within")),
        (lambda f: f["inp"].write_text("*NODE\n1, 0, 0, 0.2"), says("a.inp", "2", "file ends within")),
        (lambda f: f["sti"].write_bytes(b"1 1 2.0\n1 \xe4 2.0\n"), says("a.sti", "2", "number")),
        (
            lambda f: f["sti"].write_bytes(b"1 1 2.0\n24 23 2.0\n"),
            says("23", "node 1"),
        ),
        (
            lambda f: f["dof"].write_text("".join(f"{i // 3 + 5}.{i % 3 + 1}\n" for i in range(24))),
            r"name node 9, which",
        ),
        (lambda f: f["inp"].write_text("*NODE\n1, 0, 0\n"), r"a.inp: line 2: .* is no node"),
        (lambda f: f["inp"].write_text("*ELEMENT\n1, 0, 0\n"), r"it has no nodes"),
        (lambda f: f["mas"].unlink(), says("a.mas", "such file")),
        (
            lambda f: f["mas"].write_text("".join(f["mas"].read_text().splitlines(True)[:21])),
            says("a.mas", "3", "node 8"),
        ),
    ],
)
def test_wrong_matrix_files_are_named(tmp_path, change, message):
    corners, k, m = cube()
    files = {end: tmp_path / f"a.{end}" for end in ("sti", "mas", "inp", "dof")}
    write_triplets(files["sti"], k)
    write_triplets(files["mas"], m)
    write_nodes(files["inp"], corners)
    files["dof"].write_text("".join(f"{i // 3 + 1}.{i % 3 + 1}\n" for i in range(24)))
    change(files)
    with pytest.raises(FlexibleError, match=message):
        read_calculix(files["sti"], files["inp"])


def test_models_that_are_no_free_bodies_are_refused_or_remarked():
    corners, k, m = cube()
    held = k + np.diag([1e4] + [0.0] * 23)
    report = check_model(from_matrices(held, m, corners))
    assert any("rigid motion x meets stiffness" in remark for remark in report.remarks)
    with pytest.raises(FlexibleError, match="meets stiffness"):
        reduce_model(from_matrices(held, m, corners), [], modes=3, method="free")
    with pytest.raises(FlexibleError, match="not symmetric"):
        from_matrices(np.triu(k), m, corners)
    with pytest.raises(FlexibleError, match="in x, y and z"):
        reduce_model(from_matrices(k, np.diag([0.0] + [0.5] * 23), corners), [], method="free")
    with pytest.raises(FlexibleError, match=says("8", "6", "48", "degrees of freedom")):
        from_matrices(k, m, corners, dofs=6)
    with pytest.raises(FlexibleError, match="below max_frequency"):
        reduce_model(from_matrices(k, m, corners), [], method="free", max_frequency=1e-3)
    printed = repr(check_model(from_matrices(sp.csc_array(k), m, corners)))
    assert "mass 4 kg" in printed
    assert "first frequencies, Hz: 6 rigid motions, " in printed


@pytest.mark.skipif(ROTOR is None, reason="GEARMBS_ROTOR_FILES names no folder with the public matrices of a rotor")
def test_public_rotor_of_abaqus():
    folder = Path(ROTOR or "")
    files = [folder / f"rotorDiscTest{end}" for end in ("STIF1.mtx", "MASS1.mtx", ".inp")]
    model = read_abaqus(*files, force=0.01)
    report = check_model(model, 10)
    expected = [104.637, 104.637, 187.824, 212.330, 224.552, 238.688, 284.205, 284.205, 394.572, 394.572]
    np.testing.assert_allclose(report.frequencies[6:], expected, atol=6e-4)
    z = model.positions[:, 2]
    faces = [Interface(f"end {k}", model.ids[np.abs(z - e) < 1e-6]) for k, e in enumerate((z.min(), z.max()))]
    found = check_reduction(model, reduce_model(model, faces, modes=8), faces)
    np.testing.assert_allclose(found.exact[:4], [104.6626, 104.6626, 187.8241, 212.5661], atol=1e-4)
    np.testing.assert_allclose(found.errors[0], 0.0058, atol=5e-5)
