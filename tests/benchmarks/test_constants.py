"""The table of the integrators' constants: those tried have the values in the code."""

import importlib.util

import pytest

from benchmarks import constants
from tests.docs.support import DOCS

STORED = (DOCS / "data" / "integrator_constants.txt").read_text(encoding="utf-8")


def test_constants_are_found_with_their_values():
    found = {(c.module, c.name): c.value for c in constants.constants()}
    for (module, name), value in found.items():
        assert getattr(importlib.import_module(f"{constants.PACKAGE}.{module}"), name) == value


@pytest.mark.parametrize("constant", constants.constants(), ids=lambda c: f"{c.module}.{c.name}")
def test_stored_table_has_the_value(constant):
    row = f"| `{constant.name}` | {constant.value:g} | `{constant.module}` |"
    still = f"* `{constant.module}.{constant.name}` ({constant.value:g})\n"
    assert row in STORED or still in STORED, "run `python -m benchmarks.constants` again"


def test_another_value_is_read_in_its_place():
    package = importlib.import_module(constants.PACKAGE).__path__
    spec = constants._Finder("controller", "TARGET", 0.4).find_spec(f"{constants.PACKAGE}.controller", package)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.TARGET == 0.4
    assert module.GROW_AT_MOST == 2.0
    assert importlib.import_module(f"{constants.PACKAGE}.controller").TARGET != 0.4


def test_cells_name_the_extremes():
    own = {k: {"steps": 100, "residuals": 200, "error": 1e-6} for k in "abc"}
    new = {
        "a": {"steps": 110, "residuals": 200, "error": 3e-6},
        "b": {"steps": 95, "residuals": 200, "error": 1e-6},
        "c": {"failed": "no"},
    }
    assert constants.extremes(new, own, "steps") == "fails c, -5 % b, +10 % a"
    assert constants.extremes(new, own, "residuals") == "fails c"
    assert constants.extremes(own, own, "error") == "0"
    assert constants.extremes(new, own, "error") == "fails c, x 3 a"
