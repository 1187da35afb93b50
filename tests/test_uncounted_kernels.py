"""Kernels that count no references: what they call says so too where it matters.

A kernel without a declared signature is compiled for the first caller that asks for it, and numba hands the options of
that caller down. One that allocates, or returns an array, then fails or not by who came first, unless it has an option
of its own.
"""

import importlib
import inspect
import re

import pytest

from gearmbs.kernels import PLAIN
from gearmbs.kernels.calls import address, callees, kernel_modules, kernels

COUNTS = re.compile(r"np\.(empty|zeros|ones|array|full)|\.copy\(\)|return (vector_at|matrix_at|rows_from|times_from)\(")
"""What numba counts references for: memory of one's own, and an array that is returned."""


def loaded():
    """All kernels whose modules can be imported."""
    found = []
    for name in kernel_modules():
        try:
            importlib.import_module(name)
        except ImportError:
            continue
        found.append(name)
    return kernels(found)


def unsaid(first):
    """Return the kernels that numba may hand the options of a kernel without counts down to, and must not."""
    found, seen, waiting = set(), set(), list(first)
    while waiting:
        for callee in callees(waiting.pop()):
            if "_nrt" in callee.options or callee in seen:
                continue
            seen.add(callee)
            waiting.append(callee)
            if COUNTS.search(inspect.getsource(callee.py_func)):
                found.add(address(callee))
    return found


@pytest.mark.slow
def test_what_allocates_or_returns_arrays_says_that_it_counts():
    without = [kernel for kernel in loaded() if kernel.options.get("_nrt") is False]
    assert without or PLAIN
    assert unsaid(without) == set()
    # the four functions of a problem are counted where they are handed on bound together
    assert not [address(kernel) for kernel in without if "functions" in inspect.signature(kernel.py_func).parameters]
