"""Kernels have no dispatcher of numba's until somebody asks for what only that has."""

import pickle
import threading

import pytest

from gearmbs.dae.equations.rotation import rotation_matrix
from gearmbs.kernels import cache
from gearmbs.kernels.jit import Kernel, njit


def fresh() -> Kernel:
    """Return a kernel of which nothing has been asked."""

    @njit("float64(float64)", cache=True)
    def twice(x):
        """Return a number twice."""
        return 2.0 * x

    return twice


def has_dispatcher(kernel: Kernel) -> bool:
    return "_dispatcher" in vars(kernel)


def test_what_it_is_made_of_asks_for_nothing():
    kernel = fresh()
    assert len(cache.identity(kernel)) == 64
    assert (kernel.__name__, kernel.__doc__) == ("twice", "Return a number twice.")
    assert str(kernel.signature) == "float64(float64)"
    assert kernel.py_func(2.0) == 4.0
    assert len(kernel.overloads) == 0
    assert not has_dispatcher(kernel)


@pytest.mark.parametrize("name", ["_can_compile", "_numba_type_", "nopython_signatures", "_compiler"])
def test_what_is_numbas_makes_one(name):
    kernel = fresh()
    before = cache.identity(kernel)
    getattr(kernel, name)
    assert has_dispatcher(kernel)
    cache._identities.pop(kernel)
    assert cache.identity(kernel) == before == cache.identity(kernel.dispatcher)


def test_names_that_nobody_has():
    with pytest.raises(AttributeError):
        _ = fresh().nothing_of_this_name


def test_wrong_arguments_are_told_by_numba():
    kernel = fresh()
    with pytest.raises(TypeError):
        kernel()
    assert has_dispatcher(kernel)


def test_kernels_travel_by_their_names():
    assert pickle.loads(pickle.dumps(rotation_matrix)) is rotation_matrix


def test_threads_that_ask_at_once_find_the_same():
    kernel, barrier, found = fresh(), threading.Barrier(8), []

    def ask() -> None:
        barrier.wait()
        found.append(kernel.dispatcher)

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    assert all(one is kernel.dispatcher for one in found)
