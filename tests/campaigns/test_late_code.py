"""Modules that no statement imports, and docstrings that are read: they count, too."""

from __future__ import annotations

import os
import sys

import pytest

from gearmbs.campaigns import Campaign, CampaignError, Factor, FunctionSubject, make_plan
from gearmbs.campaigns.codes import noted
from gearmbs.studies.run import code
from gearmbs.studies.run.code import code_of, what_counts
from tests.says import says

HEAD = "import importlib\n\n\ndef model(x):\n"
PUT_TOGETHER = HEAD + "    return {'y': x + importlib.import_module(__package__ + '.help' + 'er').OFFSET}\n"
SOMETIMES = HEAD + (
    "    if x > 0.5:\n        return {'y': x + importlib.import_module(__package__ + '.help' + 'er').OFFSET}\n"
    "    return {'y': x}\n"
)


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """A package of a model and a helper, whose name is used once."""
    name = f"late_{os.getpid()}_{abs(hash(tmp_path)) % 10**8}"
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").write_text("")
    (tmp_path / name / "helper.py").write_text("OFFSET = 1.0\n")
    (tmp_path / name / "model.py").write_text(PUT_TOGETHER)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setattr(code, "_seen", {})
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    return tmp_path / name


def made(modules, path, values=(0.1, 0.9, 0.2, 0.8), **settings) -> Campaign:
    subject = FunctionSubject(f"{modules.name}.model:model", {"x": 0.0})
    plan = make_plan(subject, [Factor("x", values=values)], "grid", unit=1, **settings)
    loaded_anew(modules)
    return Campaign(path, plan)


def loaded_anew(modules) -> None:
    """Let the process be one that has loaded nothing yet."""
    code._seen.clear()
    for name in [name for name in sys.modules if name.startswith(modules.name)]:
        del sys.modules[name]


@pytest.mark.parametrize(
    "call",
    [
        "importlib.import_module('PACKAGE.helper')",
        "__import__('PACKAGE.helper')",
        "import_module('.helper', 'PACKAGE')",
    ],
)
def test_names_in_calls_are_imports(modules, call):
    text = call.replace("PACKAGE", modules.name)
    (modules / "model.py").write_text(f"def model(x):\n    return {{'y': {text}.OFFSET}}\n")
    assert f"{modules.name}.helper" in code_of([f"{modules.name}.model"]).sources
    (modules / "model.py").write_text("def model(x):\n    return {'y': import_module(x).OFFSET}\n")
    code._seen.clear()
    assert f"{modules.name}.helper" not in code_of([f"{modules.name}.model"]).sources


@pytest.mark.slow
@pytest.mark.parametrize("how", ["here", "guarded", "workers"])
def test_what_a_case_loads_counts_from_then_on(modules, tmp_path, how):
    """Whichever process does the case; another source of it is refused by name, a comment is not."""
    limit = {"wall_limit": "60 s"} if how == "guarded" else {}
    campaign = made(modules, tmp_path / "c", **limit)
    assert not noted(campaign.folder)
    if how == "workers":
        campaign.run(workers=1)
    else:
        campaign.work(1, 2)
    assert list(noted(campaign.folder)) == [f"{modules.name}.helper"]
    assert campaign.status().codes == 1
    (modules / "helper.py").write_text("# as it was\nOFFSET = 1.0\n")
    loaded_anew(modules)
    campaign.run(workers=0)
    campaign = Campaign(tmp_path / "c")
    assert campaign.status().codes == 1
    assert campaign.check() == []
    assert set((campaign.table.y - campaign.table.x).round(9)) == {1.0}
    (modules / "helper.py").write_text("OFFSET = 2.5\n")
    loaded_anew(modules)
    with pytest.raises(CampaignError, match=says(f"{modules.name}.helper", "another", "--other-code")):
        campaign.run(workers=0)
    campaign.run(workers=0, other_code="again")
    assert set((campaign.table.y - campaign.table.x).round(9)) == {2.5}


@pytest.mark.slow
def test_what_some_cases_load_is_no_other_code(modules, tmp_path):
    """Cases done before it was met do not depend on it."""
    (modules / "model.py").write_text(SOMETIMES)
    campaign = made(modules, tmp_path / "c")
    status = campaign.run(workers=0)
    assert (status.done, status.codes) == (4, 1)
    table = campaign.table
    assert ((table.y - table.x).round(9) == (table.x > 0.5)).all()
    # equal cases of equal code have equal keys, whenever it was met
    other = made(modules, tmp_path / "d", (0.9, 0.8))
    other.run(workers=0)
    keys = dict(zip(table.x, table.id))
    assert [keys[x] for x in other.table.x] == list(other.table.id)


def test_docstrings_that_are_read_count():
    text = "def f(x):\n    'two'\n    return {'y': (2.0 if f.__doc__ == 'two' else 3.0) * x}\n"
    for asking in (
        text,
        text.replace("f.__doc__", "inspect.getdoc(f)"),
        text.replace("f.__doc__", "getattr(f, '__doc__')"),
    ):
        assert what_counts(asking.encode()) != what_counts(asking.replace("    'two'", "    'three'").encode())
    silent = text.replace("f.__doc__", "f.__name__")
    assert what_counts(silent.encode()) == what_counts(silent.replace("    'two'", "    'three'").encode())
