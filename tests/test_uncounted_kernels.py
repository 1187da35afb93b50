"""Kernels that count no references: what they call says so too where it matters.

A kernel without a declared signature is compiled for the first caller that asks for it, and numba hands the options of
that caller down. One that allocates, or returns an array, then fails or not by who came first, unless it has an option
of its own.
"""

import ast
import importlib
import inspect
import re
from pathlib import Path

import pytest

import gearmbs
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


def called_outside_kernels(addresses):
    """Return where kernels, as "module:name", are called by what is no kernel itself."""
    found = []
    folder = Path(gearmbs.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        imported = {
            alias.asname or alias.name: (f"{node.module}:{alias.name}", f"{node.module}.{alias.name}")
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        kernel = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)
                  and any("jit" in ast.unparse(d) for d in node.decorator_list)]  # fmt: skip
        inside = {id(node) for one in kernel for node in ast.walk(one)}
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call) or id(node) in inside:
                continue
            module, _, name = ast.unparse(node.func).rpartition(".")
            called, _ = imported.get(name, ("", "")) if not module else ("", "")
            if module in imported:
                called = f"{imported[module][1]}:{name}"
            if called in addresses:
                found.append(f"{path.relative_to(folder)}:{node.lineno}: {called}")
    return found


def test_python_asks_no_kernel_without_counts_for_arrays():
    """What it would be handed is freed under it: the interpreter crashed, or not, by what was compiled before."""
    returns = re.compile(r"return [^\n]*(vector_at|matrix_at|Tables)\(")
    handed = {
        address(kernel)
        for kernel in loaded()
        if kernel.options.get("_nrt") is False and returns.search(inspect.getsource(kernel.py_func))
    }
    assert PLAIN or "gearmbs.dae.equations.layout:unpack" in handed
    assert called_outside_kernels(handed) == []


@pytest.mark.slow
def test_what_allocates_or_returns_arrays_says_that_it_counts():
    without = [kernel for kernel in loaded() if kernel.options.get("_nrt") is False]
    assert without or PLAIN
    assert unsaid(without) == set()
    # the four functions of a problem are counted where they are handed on bound together
    assert not [address(kernel) for kernel in without if "functions" in inspect.signature(kernel.py_func).parameters]
