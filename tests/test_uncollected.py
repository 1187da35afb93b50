"""What modules leave behind is old at once: no collection of young objects goes through it."""

import gc
import importlib
import sys

import pytest

from gearmbs._lazy import uncollected


@pytest.fixture(autouse=True)
def nothing_frozen():
    """As in a program of a user's; `tests/conftest.py` freezes what it collects."""
    gc.unfreeze()
    yield
    gc.freeze()


@pytest.fixture
def module(tmp_path, monkeypatch):
    """A module that has not been imported, whose objects the collector follows."""
    (tmp_path / "never_seen_before.py").write_text("KEPT = [{}]\n")
    monkeypatch.syspath_prepend(tmp_path)
    yield "never_seen_before"
    sys.modules.pop("never_seen_before", None)


def is_old(thing):
    return any(one is thing for one in gc.get_objects(generation=2))


def test_objects_of_an_imported_module_are_old_and_the_collector_is_on(module):
    with uncollected():
        kept = importlib.import_module(module).KEPT
    assert gc.isenabled()
    assert is_old(kept)
    assert gc.get_freeze_count() == 0


def test_what_a_run_makes_without_an_import_stays_young():
    with uncollected():
        made = [{}]
    assert not is_old(made)


def test_what_somebody_else_froze_stays_frozen(module):
    kept = [{}]
    gc.freeze()
    try:
        with uncollected():
            importlib.import_module(module)
        # frozen objects are on no list of the collector's; their number falls with each that nobody holds any more
        assert not any(one is kept for one in gc.get_objects())
        assert gc.get_freeze_count() > 0
    finally:
        gc.unfreeze()


def test_a_collector_that_is_off_stays_off(module):
    gc.disable()
    try:
        with uncollected():
            kept = importlib.import_module(module).KEPT
        assert not gc.isenabled()
        assert not is_old(kept)
    finally:
        gc.enable()
