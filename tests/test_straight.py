"""Kernels without branches that are compiled from their text, against the same text run by Python."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.kernels import texts
from gearmbs.kernels.jit import njit
from gearmbs.kernels.own.straight import straight
from tests.says import says


@njit(cache=True, straight=True, error_model="numpy", forceinline=True)
def everything(x, n, pair, row, matrix, out):
    """All that may stand in a kernel."""
    a, b = row[0], row[n + 1]
    c = matrix[n, 1]
    _0 = np.sqrt(a * a + b * b) - np.sin(x) * np.cos(c) / (2.0 + n)
    _1 = -((np.arctan2(a, b) + np.exp(-x) - np.log(2.0 + np.abs(c))) ** 2)
    out[0, n] = _0
    out[0, 0] += _0 * _1
    out[1, 0] -= _1 / pair[1] + np.tanh(x) * np.tan(0.1 * x) - np.arctan(b)
    out[1, 1] = (np.sqrt(x - c) if x > c else x * c) + (a if b > a else b)
    return _0 - 3, _1, pair[0] ** 1.5


@njit(cache=True, straight=True, error_model="numpy")
def one_number(x):
    return x * x - 1.0 / x


@njit(cache=True, error_model="numpy")
def caller(x, n, pair, row, matrix, out):
    # a view that is not contiguous, as rows of tables are
    return everything(x, n, pair, row[::2], matrix, out), one_number(x)


def test_numbers_and_arrays_are_those_of_python():
    rng = np.random.default_rng(1)
    row, matrix = rng.normal(size=8), rng.normal(size=(3, 2))
    compiled, python = np.ones((2, 2)), np.ones((2, 2))
    three, one = caller(0.7, 1, (1.3, 2), row, matrix, compiled)
    expected = everything.py_func(0.7, 1, (1.3, 2), row[::2], matrix, python)
    assert three == pytest.approx(expected, rel=1e-14)
    assert one == pytest.approx(one_number.py_func(0.7), rel=1e-15)
    assert compiled == pytest.approx(python, rel=1e-14)


def test_text_that_has_changed_since_it_was_read_is_left_to_numba(tmp_path):
    """Machine code is kept under a digest of what Python read."""
    path = tmp_path / "law.py"
    path.write_text("def law(x):\n    return 2.0 * x\n")
    space: dict = {}
    exec(compile(path.read_text(), str(path), "exec"), space)
    assert texts.text_of(space["law"]).name == "law"
    path.write_text("def law(x):\n    return 3.0 * x\n")
    texts.linecache.checkcache(str(path))
    with pytest.raises(OSError, match=says("law.py", "imported")):
        texts.text_of(space["law"])


def test_what_is_compiled_of_a_kernel_is_of_its_module():
    """Of no module it would be kept with the builtins of the process, to which an interactive one adds anything."""
    assert straight(one_number.py_func).__module__ == __name__
