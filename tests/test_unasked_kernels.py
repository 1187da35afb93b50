"""Kernels that nobody has asked for anything are no dispatchers of numba's yet; whoever asks first makes them so."""

import threading

import pytest

from gearmbs.kernels import cache
from gearmbs.kernels.jit import Kernel, njit


def fresh() -> Kernel:
    """Return a kernel of which nothing has been asked."""

    @njit("float64(float64)", cache=True)
    def twice(x):
        """Return a number twice."""
        return 2.0 * x

    return twice


def test_a_digest_asks_for_nothing():
    kernel = fresh()
    assert len(cache.identity(kernel)) == 64
    assert isinstance(kernel, Kernel)
    assert type(kernel) is not Kernel


@pytest.mark.parametrize("name", ["overloads", "_can_compile", "_numba_type_", "__doc__", "ready", "_compiler"])
def test_all_else_makes_it_an_ordinary_one(name):
    kernel = fresh()
    before = cache.identity(kernel)
    getattr(kernel, name)
    assert type(kernel) is Kernel
    assert kernel.__doc__ == "Return a number twice."
    assert len(kernel.overloads) == 0
    cache._identities.pop(kernel)
    assert cache.identity(kernel) == before


def test_a_call_makes_it_an_ordinary_one():
    kernel = fresh()
    with pytest.raises(TypeError):
        kernel()
    assert type(kernel) is Kernel


def test_threads_that_ask_at_once_find_the_same():
    kernel, barrier, found = fresh(), threading.Barrier(8), []

    def ask() -> None:
        barrier.wait()
        found.append(kernel.overloads)

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    assert all(one is kernel.overloads for one in found)


def test_what_was_never_asked_is_given_back():
    for _ in range(100):
        fresh()
