"""The results stored for the documentation can be shown, name their machine, and are those the page speaks of."""

import json

import pytest

from benchmarks import plots
from benchmarks.runner import PARTS
from tests.docs.support import DOCS

STORED = json.loads((DOCS / "data" / "benchmarks.json").read_text(encoding="utf-8"))["parts"]


@pytest.mark.parametrize("name", list(PARTS))
def test_part_can_be_shown(name):
    part = STORED[name]
    assert part["machine"]["processor"]
    assert part["machine"]["packages"]["numba"]
    text = PARTS[name].render(part)
    assert text.count("|") > 40
    assert "nan" not in text
    if name in ("gear", "precision", "size"):
        assert plots.figure_of(name, part).axes


def test_page_shows_every_part():
    page = (DOCS / "benchmarks.md").read_text(encoding="utf-8")
    for name in PARTS:
        assert f'results.show("{name}")' in page
