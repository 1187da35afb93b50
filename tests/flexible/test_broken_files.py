"""Files cut off or with a wrong byte: each reader names what is wrong, and returns the whole or nothing."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from gearmbs.flexible import (
    FlexibleError,
    Shaft,
    ShaftSection,
    mnf_of,
    read_abaqus,
    read_calculix,
    read_mnf,
    read_op2,
    read_op2_modes,
    read_op2_stresses,
    read_op4,
    reduce_model,
    write_mnf,
)
from gearmbs.flexible.mnf import COMMENTS, FLAGS, MARK, ints_bytes, record_bytes
from tests.flexible import test_nastran as nastran
from tests.flexible.test_files import cube, write_nodes, write_triplets
from tests.generators import cases, seed
from tests.says import says

with np.printoptions():
    op4 = pytest.importorskip("pyyeti.nastran.op4")

CUTS, FLIPS = 120, 80
CHECKED = ("b.mnf",)
"""Kinds that carry a checksum of all they hold; the others repeat only part of it, so that a wrong digit may pass."""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Every kind of file, and how it is read."""
    folder = tmp_path_factory.mktemp("files")
    bar = Shaft([ShaftSection(0.4, 0.03)], seats={"A": 0.0, "B": 0.4}, elements=4, name="bar").model()
    model = reduce_model(bar, modes=4)
    stresses = np.random.default_rng(1).normal(size=(model.modes, 2, 4, 6))
    modes = nastran.with_stresses(folder / "modes.op2", bar, model, stresses)
    nastran.superelement(folder, bar)
    op4.write(str(folder / "text.op4"), op4.read(str(folder / "bar.op4"), into="dct"), binary=False)
    corners, k, m = cube()
    nodes = folder / "n.inp"
    write_nodes(nodes, corners)
    for pairs in (False, True):
        for name, matrix in (("k", k), ("m", m)):
            write_triplets(folder / f"{name}{int(pairs)}.mtx", matrix, both=False, pairs=pairs)
    for name, matrix in (("sti", k), ("mas", m)):
        write_triplets(folder / f"x.{name}", matrix)
    (folder / "x.dof").write_text("".join(f"{i // 3 + 1}.{i % 3 + 1}\n" for i in range(24)))
    write_mnf(folder / "b.mnf", mnf_of(model))
    assembly = folder / "bar.asm"
    first = {f"{name}{pairs}.mtx": (name, pairs) for name in "km" for pairs in (0, 1)}

    def matrices(name, pairs):
        other = folder / f"{'m' if name == 'k' else 'k'}{pairs}.mtx"
        return lambda p: read_abaqus(*((p, other) if name == "k" else (other, p)), nodes)

    return {
        "g.op2": (nastran.g_set_file(folder / "g.op2", bar, shift=(0.25, 0.5, 0.0)), read_op2),
        "big.op2": (nastran.g_set_file(folder / "big.op2", bar, ">", shift=(0.25, 0.5, 0.0)), read_op2),
        "modes.op2": (modes, lambda p: read_op2_modes(p, stresses=True)),
        "stresses.op2": (modes, read_op2_stresses),
        "bar.op4": (folder / "bar.op4", lambda p: read_op4(p, assembly=assembly)),
        "text.op4": (folder / "text.op4", lambda p: read_op4(p, assembly=assembly)),
        "bar.asm": (assembly, lambda p: read_op4(folder / "bar.op4", assembly=p)),
        "n.inp": (nodes, lambda p: read_abaqus(folder / "k0.mtx", folder / "m0.mtx", p)),
        **{name: (folder / name, matrices(*what)) for name, what in first.items()},
        **{f"x.{end}": (folder / f"x.{end}", lambda p: read_calculix(p, nodes)) for end in ("sti", "mas", "dof")},
        "b.mnf": (folder / "b.mnf", read_mnf),
    }


def arrays(found):
    """What a reader returned, as arrays."""
    if hasattr(found, "stiffness"):
        return found.stiffness.toarray(), found.mass.toarray(), found.positions, found.ids, found.dofs
    if hasattr(found, "eigenvalues"):
        inner = (found.mass, found.centre, found.inertia, found.inertias(), found.interfaces, found.transformation)
        own = () if found.transformation is None else tuple(np.asarray(a) for a in inner)
        return found.ids, found.positions, found.eigenvalues, found.shapes, found.nodal_masses, *own
    return found.positions, found.values


KINDS = [
    "g.op2", "big.op2", "modes.op2", "stresses.op2", "bar.op4", "text.op4", "bar.asm", "n.inp", "k0.mtx", "k1.mtx",
    "m0.mtx", "m1.mtx", "x.sti", "x.mas", "x.dof", "b.mnf",
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("kind", [KINDS[0], *(pytest.param(k, marks=pytest.mark.slow) for k in KINDS[1:-1]), KINDS[-1]])
def test_a_broken_file_is_refused_or_read_whole(files, kind):
    path, read = files[kind]
    data = path.read_bytes()
    whole = arrays(read(path))
    random = np.random.default_rng(seed(7))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            for size in np.unique(
                np.append(np.linspace(0, len(data) - 1, CUTS).astype(int), random.integers(0, len(data), CUTS // 4))
            ):
                path.write_bytes(data[:size])
                try:
                    found = arrays(read(path))
                except FlexibleError:
                    continue
                # what is missing says nothing: the mark of the end, the last end of a line, what is not looked at
                assert all(np.array_equal(a, b) for a, b in zip(found, whole, strict=True)), f"{kind} cut at {size}"
            for at in random.integers(0, len(data), cases(FLIPS)):
                broken = bytearray(data)
                broken[at] ^= 1 << int(random.integers(8))
                path.write_bytes(bytes(broken))
                try:
                    found = arrays(read(path))
                except FlexibleError:
                    continue
                assert [a.shape for a in found] == [a.shape for a in whole], f"{kind} with another byte {at}"
                if kind in CHECKED:
                    assert all(np.array_equal(a, b) for a, b in zip(found, whole, strict=True)), f"{kind}: byte {at}"
        finally:
            path.write_bytes(data)


def test_a_modal_neutral_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FlexibleError, match=says("path", "absent.mnf", "give a modal neutral")):
        read_mnf(tmp_path / "absent.mnf")


STRESS, STATISTICS = 16, 28


def with_tail(path, stresses=True, statistics=True, other=0, extra=b""):
    """A neutral file as other programs write it: stresses at nodes, statistics of the modes, without a checksum."""
    bar = Shaft([ShaftSection(0.4, 0.03)], seats={"A": 0.0, "B": 0.4}, elements=4, name="bar").model()
    found = mnf_of(reduce_model(bar, modes=3))
    header = bytearray(found.header)
    header[COMMENTS : COMMENTS + len(MARK)] = bytes(len(MARK))
    n, count = len(found.mode_ids), len(found.ids)
    tail = b""
    for place, there in ((STRESS, stresses), (STATISTICS, statistics), (other, other)):
        if there:
            header[FLAGS + 4 * place : FLAGS + 4 * place + 4] = ints_bytes(1)
    if stresses:
        kind = [("id", ">i4"), ("v", ">f8", (count, 6))]
        values = np.random.default_rng(1).normal(size=(n, count, 6))
        tail += ints_bytes(n, count, *found.ids) + record_bytes(kind, (found.mode_ids, values))
    if statistics:
        lengths = [np.linalg.norm(found.shapes[:, :, part], axis=2) for part in (slice(0, 3), slice(3, 6))]
        rows = np.zeros(n, [("k", ">i4", (13,)), ("v", ">f8", (13,))])
        for column, length in enumerate(lengths):
            rows["k"][:, column] = found.ids[length.argmax(axis=1)]
            rows["v"][:, column] = length.max(axis=1)
        tail += ints_bytes(n) + rows.tobytes()
    write_mnf(path, replace(found, header=bytes(header), tail=tail + extra))
    return path, found


@pytest.mark.parametrize(("stresses", "statistics"), [(True, True), (False, True), (True, False)])
def test_the_end_of_a_neutral_file_of_another_program_is_followed(tmp_path, stresses, statistics):
    """Cut anywhere it is refused; whole it is read and written as it was."""
    path, own = with_tail(tmp_path / "a.mnf", stresses, statistics)
    data = path.read_bytes()
    found = read_mnf(path)
    np.testing.assert_array_equal(found.shapes, own.shapes)
    write_mnf(tmp_path / "b.mnf", found)
    assert (tmp_path / "b.mnf").read_bytes() == data
    random = np.random.default_rng(seed())
    for size in [*random.integers(0, len(data), cases(60)), *random.integers(len(data) - 400, len(data), 20)]:
        path.write_bytes(data[:size])
        with pytest.raises(FlexibleError, match=r"a\.mnf: byte \d+"):
            read_mnf(path)


def test_shapes_are_held_against_the_statistics_of_the_modes(tmp_path):
    path, own = with_tail(tmp_path / "a.mnf")
    row = int(np.linalg.norm(own.shapes[7, :, :3], axis=1).argmax())
    at = path.read_bytes().index(own.shapes[7, row].astype(">f8").tobytes())
    data = bytearray(path.read_bytes())
    column = int(np.abs(own.shapes[7, row, :3]).argmax())
    # the greatest component by a ten-thousandth: no other block tells
    changed = np.array(own.shapes[7, row, column] * 1.0001).astype(">f8").tobytes()
    data[at + 8 * column : at + 8 * column + 8] = changed
    path.write_bytes(bytes(data))
    with pytest.raises(FlexibleError, match=says("8", "greatest displacement")):
        read_mnf(path)


def test_what_follows_without_a_length_is_said(tmp_path):
    path, own = with_tail(tmp_path / "a.mnf", other=19, extra=bytes(40))
    with pytest.warns(UserWarning, match=says("21", "whether the file")):
        np.testing.assert_array_equal(read_mnf(path).shapes, own.shapes)
    path, own = with_tail(tmp_path / "b.mnf", extra=bytes(12))
    with pytest.warns(UserWarning, match=says("12 bytes")):
        np.testing.assert_array_equal(read_mnf(path).shapes, own.shapes)


def test_a_neutral_file_that_was_changed_says_so(tmp_path):
    """One digit of a shape in a file of this package; without the comments it is one of another program."""
    path = tmp_path / "a.mnf"
    bar = Shaft([ShaftSection(0.4, 0.03)], seats={"A": 0.0, "B": 0.4}, elements=4, name="bar").model()
    own = mnf_of(reduce_model(bar, modes=3))
    write_mnf(path, own)
    data = bytearray(path.read_bytes())
    at = bytes(data).index(own.shapes[7, 2].astype(">f8").tobytes())
    data[at + 7] ^= 1
    path.write_bytes(bytes(data))
    with pytest.raises(FlexibleError, match=says("a.mnf", "SHA-256", "comments")):
        read_mnf(path)
    data[COMMENTS : COMMENTS + 320] = bytes(320)
    path.write_bytes(bytes(data))
    assert read_mnf(path).shapes.shape == own.shapes.shape
