"""Kernels that Python calls with types of its own: listed, and noted where pages call them."""

import types

import pytest

from gearmbs.dae.equations.residual import residual
from gearmbs.kernels.calls import ASKED, LINKED, LOOKED_UP, address, asked, linked, texts
from gearmbs.kernels.jit import Kernel
from tests.docs.support import DOCS

LISTED = "gearmbs.contact.laws:damping_of_share\tint64, float64, float64\n"


@pytest.fixture
def asked_kernels(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS / "scripts"))
    import asked_kernels

    return asked_kernels


def test_listed_kernels_are_there():
    found = list(asked())
    assert len(found) == len(ASKED) + len(LOOKED_UP) == len(texts())
    for kernel, args in found:
        assert isinstance(kernel, Kernel)
        assert (kernel.declared is None) == (address(kernel) in ASKED)
        assert len(args) == kernel.py_func.__code__.co_argcount
    assert {address(kernel) for kernel in linked()} == set(LINKED)


@pytest.mark.slow
def test_calls_are_noted_and_those_that_are_not_listed_refused(asked_kernels, tmp_path, monkeypatch):
    notes = tmp_path / "notes.txt"
    monkeypatch.setenv(asked_kernels.NOTES, str(notes))
    monkeypatch.setattr(Kernel, "compile", lambda kernel, signature: "made")
    asked_kernels.note()
    kernel = next(kernel for kernel, _ in asked() if kernel.__name__ == "damping_of_share")
    assert kernel.compile("(int64, float64, float64)") == "made"
    assert notes.read_text() == LISTED
    residual.compile(residual.declared)
    app = types.SimpleNamespace()
    asked_kernels.check(app, None)
    kernel.compile("(int64, float64, float32)")
    with pytest.raises(RuntimeError, match=r"damping_of_share \(int64, float64, float32\)"):
        asked_kernels.check(app, None)
    # a build that has failed says why itself
    asked_kernels.check(app, ValueError())
