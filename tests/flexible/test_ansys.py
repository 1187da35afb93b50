"""Matrices of Ansys, through its reader and the files that come with it; without it through one in its place."""

import os
import signal
import sys
import types
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.io import mmread

from gearmbs.flexible import FlexibleError, check_model, read_ansys
from tests.flexible.test_files import cube
from tests.says import says

FILES = os.environ.get("GEARMBS_ANSYS_FILES")


class FullFile:
    """What the reader returns of a .full file: degrees of freedom and upper triangles."""

    def __init__(self, dofs, k, m):
        self.parts = dofs, sp.csc_array(np.triu(k)), None if m is None else sp.csc_array(np.triu(m))

    def load_km(self, sort):
        assert sort
        if self.parts[0] is None:
            raise RuntimeError("short read")
        return self.parts


@pytest.fixture
def reader(monkeypatch, tmp_path):
    """A reader whose files are in memory, under names that exist."""
    files = {}
    module = types.ModuleType("ansys.mapdl.reader")
    module.read_binary = lambda path: files[Path(path).name]
    package = types.ModuleType("ansys.mapdl")
    package.reader = module
    for name, part in (("ansys", types.ModuleType("ansys")), ("ansys.mapdl", package), ("ansys.mapdl.reader", module)):
        monkeypatch.setitem(sys.modules, name, part)

    def put(name, content):
        files[name] = content
        (tmp_path / name).write_bytes(bytes(4096))
        return tmp_path / name

    return put


def body(ids, **changed):
    corners, k, m = cube()
    dofs = np.column_stack([np.repeat(ids, 3), np.tile([0, 1, 2], 8)])
    parts = {"dofs": dofs, "k": k, "m": m} | changed
    return corners, FullFile(parts["dofs"], parts["k"], parts["m"])


@pytest.mark.slow
def test_matrices_and_nodes_of_ansys(reader):
    ids = np.array([4, 7, 8, 9, 11, 20, 21, 22])
    corners, full = body(ids)
    # a result file has nodes that the matrices do not need, too
    mesh = types.SimpleNamespace(nnum=np.r_[ids, 99], nodes=np.vstack([corners, [[9.0, 9, 9]]]))
    found = read_ansys(reader("a.full", full), reader("a.rst", types.SimpleNamespace(mesh=mesh)))
    assert found.ids.tolist() == ids.tolist()
    _, k, _ = cube()
    np.testing.assert_array_equal(found.stiffness.toarray(), k)
    assert check_model(found).good
    same = read_ansys(reader("a.full", full), (ids, 1e3 * corners), length=1e-3, force=1e-3, mass_unit=1.0)
    np.testing.assert_allclose(same.positions, corners)
    np.testing.assert_allclose(same.stiffness.toarray(), k)


@pytest.mark.slow
def test_files_of_ansys_that_lie_are_named(reader, tmp_path):
    ids = np.arange(1, 9)
    corners, full = body(ids)
    _, k, m = cube()
    held = np.ones(24, dtype=bool)
    held[:3] = False
    nodes = (ids, corners)
    loose = {"k": k * np.outer(held, held), "m": m * np.outer(held, held)}
    twice = np.column_stack([np.repeat(np.r_[1:8, 3], 3), np.tile([0, 1, 2], 8)])
    heat = np.column_stack([np.repeat(ids, 3), np.tile([0, 1, 20], 8)])
    cases = [
        (
            body(ids, **loose)[1],
            nodes,
            says("3", "1 nodes"),
        ),
        (body(ids, m=None)[1], nodes, says("write", "modal analysis")),
        (
            body(ids, dofs=heat)[1],
            nodes,
            "freedom 20 of node 1",
        ),
        (body(ids, dofs=twice)[1], nodes, says("1", "3", "twice")),
        (FullFile(None, k, m), nodes, says("read", "RuntimeError")),
        (types.SimpleNamespace(mesh=1), nodes, says("SimpleNamespace")),
        (full, (ids[:7], corners[:7]), says("8", "matrices name node")),
        (full, (ids[:7], corners), says("7", "nodes", "8")),
        (full, tmp_path / "none.rst", says("none.rst")),
    ]
    for content, given, message in cases:
        with pytest.raises(FlexibleError, match=message):
            read_ansys(reader("b.full", content), given)
    with pytest.raises(FlexibleError, match=says("none.full")):
        read_ansys(tmp_path / "none.full", nodes)
    (tmp_path / "small.full").write_bytes(b"odd")
    with pytest.raises(FlexibleError, match=says("small.full", "3 bytes")):
        read_ansys(tmp_path / "small.full", nodes)
    (tmp_path / "odd.full").write_bytes(bytes(4096))
    full._header = {"ptrEND": 5000}
    with pytest.raises(FlexibleError, match=says("b.full", "4096", "header", "20000 bytes")):
        read_ansys(reader("b.full", full), nodes)
    with pytest.raises(FlexibleError, match=says("odd.full", "Ansys")):
        read_ansys(tmp_path / "odd.full", nodes)


@pytest.mark.slow
def test_terms_are_counted_and_a_reader_that_breaks_down_is_survived(reader):
    ids = np.arange(1, 9)
    corners, full = body(ids)
    full._header = {"ntermKl": full.parts[1].nnz, "ntermMl": full.parts[2].nnz}
    assert check_model(read_ansys(reader("c.full", full), (ids, corners))).good
    full._header = {"ntermKl": full.parts[1].nnz + 3, "ntermMl": full.parts[2].nnz}
    with pytest.raises(FlexibleError, match=says("c.full", "header")):
        read_ansys(reader("c.full", full), (ids, corners))
    full.load_km = lambda sort: os.kill(os.getpid(), signal.SIGKILL)
    with pytest.raises(FlexibleError, match=says("c.full", "read")):
        read_ansys(reader("c.full", full), (ids, corners))


def test_without_the_reader_its_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "ansys.mapdl", None)
    with pytest.raises(FlexibleError, match=r"pip install gearmbs\[ansys\]"):
        read_ansys("a.full", "a.rst")


def test_the_example_of_the_reader_is_held_and_refused():
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    with pytest.raises(FlexibleError, match=says("file.full", "63", "21", "1")):
        read_ansys(examples.fullfile, examples.rstfile)


@pytest.mark.skipif(FILES is None, reason="GEARMBS_ANSYS_FILES names no folder with the public files of a rotor")
def test_public_rotor_of_ansys(tmp_path):
    pytest.importorskip("ansys.mapdl.reader")
    folder = Path(FILES or "")
    text = (folder / "rotorAnsysNodalCoordinates.txt").read_text(encoding="latin1").replace(",", ".").splitlines()[1:]
    nodes = np.array([line.split() for line in text if line.strip()], dtype=float)
    found = read_ansys(folder / "sparse.full", (nodes[:, 0].astype(int), nodes[:, 1:4]))
    report = check_model(found)
    np.testing.assert_allclose(report.properties.mass, 77.96604704575773, rtol=1e-12)
    assert report.rigid_energy.max() < 1e-9
    # the file has consistent masses (LUMPM off); lumped, they make the frequency that is published for this rotor
    np.testing.assert_allclose(report.frequencies[6:8], 116.733109, rtol=1e-7)
    along = found.dofs[:, 1][:, None] == np.arange(3)
    lumped = ((found.mass @ along) * along).sum(axis=1)
    own = replace(found, mass=sp.diags_array(lumped).tocsc())
    np.testing.assert_allclose(check_model(own).frequencies[6:8], 104.63701055, rtol=1e-9)
    for matrix, ending in ((sp.diags_array(lumped), "Mass"), (found.stiffness, "Stiffness")):
        published = mmread(folder / f"rotorAnsys{ending}MatrixSparse.txt").diagonal()
        np.testing.assert_allclose(np.sort(matrix.diagonal()), np.sort(published), rtol=1e-14)
    cut, data = tmp_path / "cut.full", (folder / "sparse.full").read_bytes()
    for size in (100, 3000, 60000, 150000):
        cut.write_bytes(data[:size])
        with pytest.raises(FlexibleError, match=r"cut\.full: .*(cut off|100 bytes)"):
            read_ansys(cut, (nodes[:, 0].astype(int), nodes[:, 1:4]))
