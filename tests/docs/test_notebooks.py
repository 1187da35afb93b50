"""The notebooks run from the first cell to the last, as the build of the documentation runs them."""

from __future__ import annotations

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest

from tests.docs.support import DOCS, notebooks, run_blocks

BY_THEIR_BUILD = ("cli.md", "benchmarks.md")
"""Pages that display things in a notebook only; the build of the documentation runs them."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", [p for p in notebooks() if p.name not in BY_THEIR_BUILD], ids=lambda p: str(p.relative_to(DOCS))
)
def test_notebook(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")
    run_blocks(path, "code-cell")
    plt.close("all")
