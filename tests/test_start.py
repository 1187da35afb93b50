"""A run whose kernels are on disk imports neither numba nor LLVM: their code is loaded and called without."""

import pickle
import subprocess
import sys
import textwrap

import numba
import numpy as np
import pytest

from gearmbs.dae.equations.rotation import rotation_matrix
from gearmbs.kernels import PLAIN, cache, entries
from gearmbs.kernels.kinds import float64, int64, named_tuple, types, void
from tests.test_kernel_cache import Package

pytestmark = pytest.mark.skipif(PLAIN or not entries.HERE, reason="numba loads kernels here")

PAIR = """
import sys
from gearmbs.studies import make_case, run_case
run_case(make_case({"operation": {"duration": "10 ms", "settling": "0 s"}}))
print(*sorted({name.partition(".")[0] for name in sys.modules} & {"numba", "llvmlite", "dask", "pint", "matplotlib"}))
"""
THEN_NUMBA = """
import numpy as np, sys
from gearmbs.dae.equations.rotation import rotation_matrix
before, after, own = np.zeros(9), np.zeros(9), np.zeros(9)
rotation_matrix(0.1, 0.2, 0.3, 0, before, 0)
assert "numba" not in sys.modules
import numba

@numba.njit
def of_a_user(out):
    rotation_matrix(0.1, 0.2, 0.3, 0, out, 0)
    return np.ones(3)

assert of_a_user(own).sum() == 3.0
rotation_matrix(0.1, 0.2, 0.3, 0, after, 0)
assert (before == own).all() and (before == after).all()
"""


LATE = """
    from gearmbs.kernels.jit import njit

    @njit("float64(float64)", cache=True, late=True)
    def late(x):
        return 2.0 * x

    @njit("float64(float64)", cache=True, nogil=True)
    def caller(x):
        return late(x) + 1.0
"""
FORKED = """
import os
from smallpackage.lately import caller, late
caller.ready()
child = os.fork()
if not child:
    # what stands at places that the parent knows nothing of, until it maps something else there
    kept = [bytearray(1 << 20) for _ in range(50)]
    os._exit(caller(1.0) != 3.0)
assert os.waitpid(child, 0)[1] == 0
assert late._entry is None
assert caller(2.0) == 5.0
"""
IN_THREADS = """
import threading
from smallpackage.lately import caller
found, start = [], threading.Barrier(8)

def call():
    start.wait()
    found.append((caller.entry().address, caller(1.0)))

threads = [threading.Thread(target=call) for _ in range(8)]
for thread in threads: thread.start()
for thread in threads: thread.join()
assert set(found) == {(caller.entry().address, 3.0)}
"""


def run(program: str, environment: dict[str, str] | None = None) -> str:
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("program", [FORKED, IN_THREADS], ids=["fork", "threads"])
def test_processes_and_threads_find_late_kernels_for_themselves(program, tmp_path):
    """A fork finds addresses that its parent has not; threads that load a kernel at once have the same of it."""
    package = Package(tmp_path)
    package.write("lately", textwrap.dedent(LATE))
    run("from smallpackage.lately import caller, late; late.ready(), caller.ready()", package.environment)
    assert run(program, package.environment) == ""


@pytest.mark.slow
def test_the_pair_of_the_paper_runs_without_numba():
    # whatever is not on disk yet is compiled by the first
    assert run(PAIR) == "\n" or run(PAIR) == "\n"


@pytest.mark.slow
def test_numba_comes_with_functions_of_a_user():
    rotation_matrix.ready()
    run(THEN_NUMBA)


def test_code_is_that_of_numba():
    """The same object file is loaded, so that bits are equal; numba's own loading is kept for its own calls."""
    one, two = np.zeros(9), np.zeros(9)
    rotation_matrix(0.1, 0.2, 0.3, 0, one, 0)
    rotation_matrix.dispatcher(0.1, 0.2, 0.3, 0, two, 0)
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize(
    "wrong",
    [
        np.zeros(9, dtype=np.float32),
        np.zeros(18)[::2],
        np.zeros((3, 3)),
        np.broadcast_to(np.zeros(1), 9),
        [0.0] * 9,
    ],
    ids=["32 bits", "strides", "dimensions", "read-only", "list"],
)
def test_arguments_that_do_not_fit_are_refused(wrong):
    with pytest.raises(TypeError):
        rotation_matrix(0.1, 0.2, 0.3, 0, wrong, 0)


def test_numbers_are_taken_as_numba_takes_them():
    one, two = np.zeros(9), np.zeros(9)
    rotation_matrix(0, np.float32(0.5), np.int64(1), np.int32(0), one, 0)
    rotation_matrix(0.0, 0.5, 1.0, 0, two, 0)
    np.testing.assert_array_equal(one, two)


def test_an_object_that_asks_for_more_is_left_to_numba(monkeypatch):
    """Other kinds of relocations, and symbols that nobody knows."""
    payload = cache._read(cache.file_name(rotation_matrix.ready(), "entry", ()), "gearmbs")
    kept = entries.Kept(*payload)
    assert entries.loaded(kept, "gearmbs") is not None
    with monkeypatch.context() as other:
        other.setattr(entries, "_address", lambda symbol: 0)
        assert entries.loaded(kept, "gearmbs") is None
    monkeypatch.setattr(entries, "_ADDRESS", 2)
    assert entries.loaded(kept, "gearmbs") is None
    assert entries.loaded(kept._replace(plain=False), "gearmbs") is None


def test_types_are_told_as_by_numba():
    row, rows = float64[::1], float64[:, ::1]
    signature = void(row, rows, float64[:, :, ::1], float64[:], types.Tuple((row, int64)), types.UniTuple(float64, 3))
    assert list(map(str, signature.args)) == [str(kind.numba) for kind in signature.args]
    assert int64(2.0) == 2
    assert pickle.loads(pickle.dumps(signature)).numba == signature.numba

    @numba.njit(signature)
    def of_a_user(a, b, c, d, e, f):
        a[0] = f[0]

    assert of_a_user.signatures == [signature.numba.args]
    one, other = (named_tuple((row, row), cache.Slot), named_tuple((row, row), entries.Kept))
    assert one != other
    assert one.told != other.told


def test_the_processor_is_told_by_the_system_as_by_llvm(monkeypatch, tmp_path):
    import llvmlite.binding

    monkeypatch.setattr(cache, "SHIPPED", tmp_path)
    has = llvmlite.binding.get_host_cpu_features()
    assert cache.lacking() == [name for name in cache.NEEDED if not has.get(name)]
    assert llvmlite.binding.get_process_triple() == cache.COMMON_SYSTEM
