"""What the sources of compiled code keep to: documented arguments, short functions, no gears in dae."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.docs.support import ROOT

PACKAGE = ROOT / "gearmbs"
MANY = 8
"""Number of arguments from which a kernel documents each of them, or names the contract that does."""
LONGEST = 80
CONTRACTS = re.compile(r"loads\.forces|parameters\s+are those of `\w+`")
"""Of a kernel's docstring: the module that documents the arguments of force elements, or a kernel with the same."""
SIGNATURES = re.compile(r"\bJACOBIAN_SIG\b")
"""Of a decorator: signatures whose arguments are documented where they are defined, in `gearmbs.dae.problem`."""
GEARS = re.compile(r"gear|tooth|teeth|flank|pinion", re.IGNORECASE)


def functions() -> Iterator[tuple[Path, ast.FunctionDef]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        if path.name == "derived.py":
            # written by a program, see docs/theory/one_definition.md
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                yield path, node


def is_kernel(node: ast.FunctionDef) -> bool:
    """Whether a function is decorated by numba's njit or one of the package's decorators of kernels."""
    return any(re.search(r"njit|kernel|compiled|entry", ast.unparse(d)) for d in node.decorator_list)


@pytest.mark.slow
def test_kernels_with_many_arguments_document_them():
    bare = []
    for path, node in functions():
        if is_kernel(node) and len(node.args.args) >= MANY:
            text = ast.get_docstring(node) or ""
            declared = any(SIGNATURES.search(ast.unparse(d)) for d in node.decorator_list)
            if "Parameters\n----------" not in text and not CONTRACTS.search(text) and not declared:
                bare.append(f"{path.relative_to(ROOT)}:{node.lineno} {node.name}")
    assert not bare


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["dae/integrators", "dae/linalg", "contact"])
def test_functions_are_short(folder):
    long = []
    for path, node in functions():
        lines = (node.end_lineno or node.lineno) - node.lineno + 1
        if path.is_relative_to(PACKAGE / folder) and lines > LONGEST:
            long.append(f"{path.relative_to(ROOT)}:{node.lineno} {node.name}: {lines} lines")
    assert not long


def test_dae_knows_no_gears():
    found = []
    for path in sorted((PACKAGE / "dae").rglob("*.py")):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if GEARS.search(line.replace("gearmbs", "")):
                found.append(f"{path.relative_to(ROOT)}:{number} {line.strip()}")
    assert not found
