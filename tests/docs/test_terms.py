"""Tables "Where each term is computed" of theory pages: what they name is there."""

import re
from functools import reduce
from importlib import import_module

import pytest

from tests.docs.support import DOCS

HEADING = "## Where each term is computed\n"
NAME = re.compile(r"`(gearmbs(?:\.\w+)+)`")
PAGES = sorted(page for page in (DOCS / "theory").glob("*.md") if HEADING in page.read_text(encoding="utf-8"))


def found(name: str) -> object:
    """Return what a dotted name stands for: an attribute, or a field of a class."""
    module, *rest = name.split(".")
    made = import_module(module)
    while rest:
        try:
            made = import_module(f"{module}.{rest[0]}")
        except ModuleNotFoundError:
            break
        module = f"{module}.{rest.pop(0)}"
    *owners, last = rest
    owner = reduce(getattr, owners, made)
    return last if last in getattr(owner, "__annotations__", {}) else getattr(owner, last)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_what_computes_each_term_is_there(page):
    table = page.read_text(encoding="utf-8").split(HEADING)[1].strip().split("\n\n")[0]
    rows = [row for row in table.split("\n") if row.startswith("| ")]
    assert len(rows) > 5
    for row in rows[1:]:
        named = NAME.findall(row.split("|")[-2])
        assert named, row
        for name in named:
            assert found(name) is not None, name


def test_pages_on_derivatives_and_orbits_have_a_table():
    assert {"tangents", "orbits"} <= {page.stem for page in PAGES}
