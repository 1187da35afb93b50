"""The compile command knows every kernel, and programs that lack kernels compile those they have imported."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import gearmbs
from gearmbs import _kernel_cache, _kernel_calls
from gearmbs.compile import compile_entries

ROOT = Path(gearmbs.__file__).parent


@pytest.fixture(scope="module")
def found():
    """Return all kernels of the package."""
    _kernel_calls.import_all()
    return _kernel_calls.kernels(_kernel_calls.kernel_modules())


def test_every_module_that_compiles_is_known():
    known = set(_kernel_calls.kernel_modules())
    for path in ROOT.rglob("*.py"):
        if re.search(r"^\s*@(?:njit|kernel)\b", path.read_text("utf-8"), re.M):
            assert ".".join(("gearmbs", *path.relative_to(ROOT).with_suffix("").parts)) in known


def test_kernels_are_declared_one_way():
    """numba's own decorator would compile at import; `gearmbs._jit` does not."""
    for path in ROOT.rglob("*.py"):
        if path.name != "_jit.py":
            assert not re.search(r"from numba import .*\bnjit\b|numba\.njit\(", path.read_text("utf-8")), path


def test_entries_and_parts(found):
    """Whatever has a signature is an entry, or is reached from one; helpers are reached from one."""
    entries = _kernel_calls.entries(found)
    names = {_kernel_calls.address(kernel) for kernel in entries}
    for address in (
        "gearmbs.dae.equations.residual:residual",
        "gearmbs.dae.equations.jacobian:jacobian",
        "gearmbs.dae.integrators.step:advance",
        "gearmbs.dae.linalg.sparse_lu:factor",
        "gearmbs.contact.kernel:gear_contact",
        "gearmbs.gears.history:_run",
    ):
        assert address in names
    reached = {*entries}.union(*(_kernel_calls.below(kernel) for kernel in entries))
    assert not [_kernel_calls.address(k) for k in found if k.declared is not None and k not in reached]


def test_a_mechanism_does_not_need_the_contact(found):
    """No kernel of the equations or integrators calls one of the contact."""
    for kernel in found:
        if kernel.__module__.startswith("gearmbs.dae"):
            below = {callee.__module__ for callee in _kernel_calls.below(kernel)}
            assert not any(module.startswith(("gearmbs.contact", "gearmbs.gears")) for module in below)


def run(folder: Path, *command: str) -> subprocess.CompletedProcess:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "NUMBA_CACHE_DIR": str(folder)}
    done = subprocess.run([sys.executable, *command], env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done


PROGRAM = """
from gearmbs.dae.equations.rotation import rotation_matrix
import numpy as np
a = np.zeros((3, 3))
print(rotation_matrix.ready() is rotation_matrix)
"""


def test_a_program_says_that_it_compiles(tmp_path):
    """Missing: helpers compile what the program has imported, and it tells so; there: not a word."""
    first = run(tmp_path, "-c", PROGRAM)
    assert "compiling the numerical kernels" in first.stderr
    assert first.stdout == "True\n"
    kept = {path.name.partition("-")[0] for path in tmp_path.rglob("*.entry")}
    assert "dae.equations.rotation.rotation_matrix" in kept
    assert all(name.startswith("dae.equations.rotation.") for name in kept)
    second = run(tmp_path, "-c", PROGRAM)
    assert second.stderr == ""
    assert second.stdout == "True\n"


def test_failing_helpers(monkeypatch):
    """What a helper cannot compile is told with its traceback."""
    kernel = _kernel_calls.find("gearmbs.dae.equations.rotation", "rotation_matrix")
    monkeypatch.setattr(_kernel_cache, "stored", lambda *rest: False)
    monkeypatch.setattr(_kernel_calls, "address", lambda kernel: f"{kernel.__module__}:not_there")
    with pytest.raises(RuntimeError, match=r"not_there could not be compiled[\s\S]*LookupError"):
        compile_entries([kernel], workers=1)
