"""Files cut off or with a wrong byte: each reader names what is wrong, and returns the whole or nothing."""

import warnings

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
from tests.flexible import test_nastran as nastran
from tests.flexible.test_files import cube, write_nodes, write_triplets

with np.printoptions():
    op4 = pytest.importorskip("pyyeti.nastran.op4")

CUTS, FLIPS = 120, 80


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
        return found.ids, found.positions, found.eigenvalues, found.shapes, found.nodal_masses
    return found.positions, found.values


KINDS = [
    "g.op2", "big.op2", "modes.op2", "stresses.op2", "bar.op4", "text.op4", "bar.asm", "n.inp", "k0.mtx", "k1.mtx",
    "m0.mtx", "m1.mtx", "x.sti", "x.mas", "x.dof", "b.mnf",
]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_a_broken_file_is_refused_or_read_whole(files, kind):
    path, read = files[kind]
    data = path.read_bytes()
    whole = arrays(read(path))
    random = np.random.default_rng(7)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            for size in np.unique(np.linspace(0, len(data) - 1, CUTS).astype(int)):
                path.write_bytes(data[:size])
                try:
                    found = arrays(read(path))
                except FlexibleError:
                    continue
                # what is missing says nothing: the mark of the end, the last end of a line, what is not looked at
                assert all(np.array_equal(a, b) for a, b in zip(found, whole, strict=True)), f"{kind} cut at {size}"
            for at in random.integers(0, len(data), FLIPS):
                broken = bytearray(data)
                broken[at] ^= 1 << int(random.integers(8))
                path.write_bytes(bytes(broken))
                try:
                    found = arrays(read(path))
                except FlexibleError:
                    continue
                assert [a.shape for a in found] == [a.shape for a in whole], f"{kind} with another byte {at}"
        finally:
            path.write_bytes(data)


def test_a_modal_neutral_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FlexibleError, match=r"path = '.*absent.mnf': there is no such file; give a modal neutral file"):
        read_mnf(tmp_path / "absent.mnf")
