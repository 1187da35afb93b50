"""References of arrays are counted of what kernels make, and kernels are compiled with their own options alone."""

from __future__ import annotations

import sys
import textwrap

import numpy as np
import pytest
from numba import float64, int64, types
from numba.core.runtime import _nrt_python as runtime

from gearmbs.kernels.jit import njit
from gearmbs.kernels.views import vector_at
from tests.test_kernel_cache import Package

VECTOR = float64[::1]
RUNS = 10_000


@njit(cache=True)
def moved(a, b, k):
    """Write and read what is handed over."""
    a[k] += b[k]
    return a[k] * b[0]


@njit(cache=True)
def lent(a, k):
    """Return a view that nobody counts."""
    return vector_at(a, k, 3)


@njit(cache=True)
def handed(a, k):
    """Return a part of an argument."""
    return a[k:]


@njit(cache=True)
def passed(a, k):
    """Return what another kernel makes of an argument."""
    return handed(a, k), k


@njit(cache=True)
def made(n):
    """Return a new array."""
    return np.zeros(n)


@njit(cache=True)
def chosen(a, rows):
    """Return a copy: an index that is an array takes one."""
    return a[rows]


@njit(float64(VECTOR, VECTOR), cache=True)
def making_none(a, b):
    """Name arrays over and over, and make none."""
    total, w = 0.0, a
    for k in range(a.size):
        w = lent(a, 0) if k % 2 else b[1:]
        pair = (w, a)
        total += moved(pair[1], b, 0) + pair[0][1]
    return total


@njit(float64(VECTOR, int64), cache=True)
def making_some(a, n):
    """Make arrays, and mix their names with those of arguments."""
    x = made(n)
    y, z = handed(x, 1), handed(a, 1)
    q = a if n > 3 else x
    kept, _ = passed(made(n), 1)
    return x[0] + y[0] + z[0] + q[0] + kept[0] + chosen(a, np.array([1, 0]))[0]


@njit(VECTOR(VECTOR, int64), cache=True)
def give(a, n):
    """Return a part of an argument, by way of two kernels."""
    found, _ = passed(a, n)
    return found


@njit(VECTOR(int64), cache=True)
def give_made(n):
    """Return a part of what is made here."""
    return handed(made(n) + 1.0, 1)


@njit(cache=True)
def listed(a):
    """Return what was put into a list."""
    kept = [np.zeros(1)]
    kept.append(a)
    return kept[1]


@njit(VECTOR(int64), cache=True)
def give_listed(n):
    """Return what is made here and was in a list of another kernel."""
    return listed(made(n) + 1.0)


@njit(types.UniTuple(VECTOR, 2)(VECTOR), cache=True)
def give_both(a):
    """Return an argument and a part of it."""
    return a, a[1:]


@njit(types.void(VECTOR, VECTOR), cache=True)
def copied(a, b):
    """Write one array into another: numba makes a third where they may overlap."""
    a[:] = b


def counts(kernel, *args):
    """Return how often a part of a kernel counts."""
    return str(kernel.part(args).library._final_module).count("call void @NRT_")


def test_arrays_live_as_long_as_they_are_used():
    """What comes back outlives what it was taken from, and is gone once nobody has it."""
    a, b = np.arange(5.0), np.ones(5)

    def run():
        making_none(a, b)
        making_some(a, 2)
        making_some(a, 4)
        copied(a, a + 0.0)
        return give(a, 2), give_made(4), give_listed(4), give_both(a)

    run()
    runtime.memsys_enable_stats()
    try:
        before = [sys.getrefcount(a), sys.getrefcount(b)]
        under_way = runtime.memsys_get_stats_alloc() - runtime.memsys_get_stats_free()
        for _ in range(RUNS):
            run()
        assert [sys.getrefcount(a), sys.getrefcount(b)] == before
        assert runtime.memsys_get_stats_alloc() - runtime.memsys_get_stats_free() == under_way
    finally:
        runtime.memsys_disable_stats()
    part, whole, listed_one = give(3.0 * np.arange(1000.0), 990), give_made(1000), give_listed(1000)
    np.zeros(1000), np.zeros(1000)
    assert part.tolist() == [3.0 * k for k in range(990, 1000)]
    assert whole.tolist() == [1.0] * 999
    assert listed_one.tolist() == [1.0] * 1000
    # memory that is given back is handed out again: what holds it holds other numbers then
    assert listed.part((VECTOR,)).origins == ("handed", "made")


def test_what_kernels_make_none_of_is_not_counted():
    """Nothing is written for arguments and views, unlike for what is made or returned of arguments."""
    assert [counts(moved, VECTOR, VECTOR, int64), counts(lent, VECTOR, int64)] == [0, 0]
    assert counts(making_none, VECTOR, VECTOR) == 0
    assert all([counts(handed, VECTOR, int64), counts(passed, VECTOR, int64), counts(chosen, VECTOR, int64[::1])])


CALLEES = """
    import numpy as np
    from gearmbs.kernels.jit import njit

    @njit(cache=True)
    def callee(x, y):
        return x * y + y / x

    @njit("float64(float64, float64)", cache=True)
    def declared(x, y):
        return x * y + y / x
"""

CALLERS = """
    from gearmbs.kernels.jit import njit
    from smallpackage.callees import callee, declared

    @njit("float64(float64, float64)", cache=True)
    def plain(x, y):
        return callee(x, y) + declared(x, y)

    @njit("float64(float64, float64)", cache=True, error_model="numpy", fastmath=True, forceinline=True)
    def special(x, y):
        return callee(x, y) + declared(x, y)

    def failed(kernel):
        try:
            kernel(0.0, 1.0)
        except ZeroDivisionError:
            return True
"""


@pytest.mark.slow
def test_kernels_are_the_same_whoever_asks_first(tmp_path):
    """Numba hands options of a caller down to what it compiles for it."""
    found = []
    for order in (("plain", "special"), ("special", "plain")):
        package = Package(tmp_path / order[0])
        package.write("callees", textwrap.dedent(CALLEES))
        package.write("callers", textwrap.dedent(CALLERS))
        asked = ", ".join(f"callers.failed(callers.{name})" for name in order)
        answers, names = package.call(f"[{asked}]")
        assert answers == [True, True]
        assert names == ["callee", "declared", "plain", "special"]
        found.append({path.name: path.read_bytes() for path in package.kernels.iterdir() if path.suffix != ".lock"})
    assert found[0] == found[1]
