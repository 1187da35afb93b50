"""What results come from is known, and nothing is put beside what comes from something else."""

from __future__ import annotations

import importlib
import math
import os
import subprocess
import sys

import pytest

from gearmbs import system
from gearmbs.campaigns import Campaign, CampaignError, Factor, FunctionSubject, make_plan
from gearmbs.campaigns.codes import code_counts
from gearmbs.campaigns.surroundings import refusal
from gearmbs.studies.run import code
from gearmbs.studies.run.code import Code, CodeChanged, code_of, running_code, what_counts
from gearmbs.studies.run.loaded import as_loaded
from gearmbs.system import processor_lines
from tests.campaigns.models import PLACES, needy
from tests.says import says

SOURCE = '''
"""A module."""
import numpy as np

GAIN = 2.0


def f(x, kind="rolling bearing"):
    """Return a number."""
    if not x > 0:
        told = f"x = {x}"
        more = f"{told}; give a positive number"
        raise ValueError(more)
    shown = f"{x} m"
    if kind == "rolling bearing":
        raise Stop("late", 0.5 * x)
    assert x < 9, "x is large"
    return {shown: GAIN * x}
'''


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"""A module."""', '"""Another text.\n\nWith two parts."""'),
        ('    """Return a number."""\n', ""),
        ("GAIN = 2.0", "# doubles\nGAIN = 2.0"),
        ("{told}; give a positive number", "must be above zero"),
        ('f"x = {x}"', 'f"{x} is too small"'),
        ('"x is large"', 'f"{x} is above 9"'),
        ("GAIN * x", "(GAIN  *  x)"),
    ],
    ids=["module", "docstring", "comment", "message", "message by a name", "assertion", "layout"],
)
def test_texts_do_not_count(old, new):
    assert old in SOURCE
    assert what_counts(SOURCE.encode()) == what_counts(SOURCE.replace(old, new).encode())


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("GAIN = 2.0", "GAIN = 2.5"),
        ('if kind == "rolling bearing"', 'if kind == "plain bearing"'),
        ("not x > 0", "not x >= 0"),
        ("0.5 * x", "0.25 * x"),
        ('"late"', '"early"'),
        ("x < 9", "x < 8"),
        ("{x} m", "{x} cm"),
        ("ValueError", "KeyError"),
    ],
    ids=[
        "constant",
        "name with a blank",
        "condition",
        "number in an error",
        "name in an error",
        "bound",
        "name of a result",
        "kind",
    ],
)
def test_what_may_change_a_number_counts(old, new):
    assert old in SOURCE
    assert what_counts(SOURCE.encode()) != what_counts(SOURCE.replace(old, new).encode())


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """A user's module with a helper in a package, found by this process; the name is used once, for it is loaded."""
    name = f"user_{os.getpid()}_{abs(hash(tmp_path)) % 10**8}"
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").write_text("")
    (tmp_path / name / "model.py").write_text(
        "import json\n\n\ndef model(x):\n    from .helper import offset\n\n    return {'y': x + offset()}\n"
    )
    (tmp_path / name / "helper.py").write_text("OFFSET = 1.0\n\n\ndef offset():\n    return OFFSET\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(code, "_seen", {})
    # bytecode is known by seconds and size, and edits come faster
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    return tmp_path / name


def made(modules, path, **settings) -> Campaign:
    subject = FunctionSubject(f"{modules.name}.model:model", {"x": 0.0})
    settings = {"n": 8, "unit": 2, **settings}
    return Campaign(path, make_plan(subject, [Factor("x", 0.0, 1.0)], **settings))


def loaded_anew(modules, monkeypatch) -> None:
    """Let the process be one that has loaded nothing yet."""
    monkeypatch.setattr(code, "_seen", {})
    for name in [name for name in sys.modules if name.startswith(modules.name)]:
        del sys.modules[name]


def test_a_module_counts_with_what_belongs_to_it(modules):
    found = code_of([f"{modules.name}.model"])
    own = sorted(name for name in found.sources if not name.startswith("gearmbs"))
    assert own == [modules.name, f"{modules.name}.helper", f"{modules.name}.model"]
    assert any(name.startswith("gearmbs.contact.") for name in found.sources)
    assert "gearmbs.studies.presets.bench.toml" in found.sources
    assert "gearmbs.mechanism.compile" in found.sources
    assert not [n for n in found.sources if n.startswith(("gearmbs.view", "gearmbs.compile")) or "commands" in n]
    assert {"python", "processor", "numba", "llvmlite", "numpy"} <= found.setting.keys()
    with pytest.raises(ImportError, match="nowhere"):
        code_of(["nowhere_at_all.model"])


PROCESSOR = """
import sys
from gearmbs.studies.run import code
print(code.processor(), "numba" in sys.modules, code._processor(), sep="|")
"""


@pytest.mark.slow
def test_the_processor_is_remembered_as_it_is_found_out(tmp_path):
    """Without the compiler, by options and files that the compiler heeds; in the plain mode it is found out anew."""
    found = {}
    chosen = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "GEARMBS_COMPILER")
    own = {name: value for name, value in os.environ.items() if name not in chosen}
    for options in ({}, {"NUMBA_CPU_NAME": "generic"}, {"GEARMBS_COMPILER": "plain"}):
        environment = {**own, "XDG_CACHE_HOME": str(tmp_path), **options}
        for again in (False, True):
            command = [sys.executable, "-c", PROCESSOR]
            told = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
            remembered, loaded, known = told.stdout.strip().split("|")
            assert remembered == known
            assert loaded == str(not again or "GEARMBS_COMPILER" in options)
        found[repr(options)] = known
    assert len(set(found.values())) == 3


def test_what_the_processor_depends_on(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    known = {code._host(processor_lines())}
    for name in ("NUMBA_CPU_FEATURES", "NUMBA_ENABLE_AVX", "GEARMBS_COMPILER"):
        with monkeypatch.context() as patch:
            patch.setenv(name, "own")
            known.add(code._host(processor_lines()))
    (tmp_path / ".numba_config.yaml").write_text("cpu_name: generic")
    known.add(code._host(processor_lines()))
    (tmp_path / ".numba_config.yaml").unlink()
    assert code._host(processor_lines()) in known
    assert len(known) == 5
    other = tmp_path / "cpuinfo"
    other.write_text(
        "processor : 0\nmodel : 1\nflags : fpu\ncpu MHz : 3000.1\n\nprocessor : 1\nmodel : 1\nflags : fpu\n"
    )
    monkeypatch.setattr(system, "PROC", tmp_path)
    assert processor_lines() == ["flags : fpu", "model : 1"]
    monkeypatch.setattr(system, "PROC", tmp_path / "nothing")
    assert processor_lines() == []


@pytest.mark.slow
def test_an_edit_in_the_middle_is_refused_by_name(modules, tmp_path, monkeypatch):
    """Refused; gone on with if that is told, which is then told; or done again."""
    campaign = made(modules, tmp_path / "c")
    campaign.work(1, 2)
    helper = modules / "helper.py"
    helper.write_text(helper.read_text().replace("return OFFSET", "return OFFSET  # as it was"))
    loaded_anew(modules, monkeypatch)
    assert campaign.work(1, 4).codes == 1
    helper.write_text(helper.read_text().replace("1.0", "2.5"))
    loaded_anew(modules, monkeypatch)
    with pytest.raises(CampaignError, match=says("another code", f"{modules.name}.helper", "--other-code")):
        campaign.run(workers=0)
    status = campaign.run(workers=0, other_code="mix")
    assert (status.done, status.codes) == (8, 2)
    assert "from 2 different codes" in str(status)
    assert any("2 of 4 units" in line and "helper" in line for line in campaign.check())
    assert sorted(round(y - x, 9) for x, y in campaign.table[["x", "y"]].to_numpy()) == [1.0] * 4 + [2.5] * 4
    status = campaign.run(workers=0, other_code="again")
    assert status.codes == 1
    assert set((campaign.table.y - campaign.table.x).round(9)) == {2.5}
    with pytest.raises(CampaignError, match=says("other_code", "'all'", "mix")):
        campaign.run(workers=0, other_code="all")


@pytest.mark.slow
def test_what_the_driver_cannot_look_at_is_told_in_a_line(modules, tmp_path, monkeypatch):
    """A source that was edited since the first look, is no Python, or is gone; once it is as it was, it runs."""
    campaign = made(modules, tmp_path / "c")
    campaign.work(1, 4)
    helper = modules / "helper.py"
    text = helper.read_text()
    helper.write_text(text.replace("1.0", "2.5"))
    with pytest.raises(CampaignError, match=says(f"{modules.name}.helper", "edited while", "start")):
        campaign.run(workers=0)
    helper.write_text("def offset(:\n")
    with pytest.raises(CampaignError, match=says("helper.py", "line 1", "installed")):
        campaign.run(workers=0)
    helper.write_text(text)
    model = modules / "model.py"
    model.rename(modules / "away.py")
    loaded_anew(modules, monkeypatch)
    importlib.invalidate_caches()
    with pytest.raises(CampaignError, match=says(f"{modules.name}.model", "PYTHONPATH")):
        campaign.run(workers=0)
    (modules / "away.py").rename(model)
    importlib.invalidate_caches()
    assert campaign.run(workers=0).done == 8


@pytest.mark.slow
def test_results_of_other_code_are_not_taken_over(modules, tmp_path, monkeypatch):
    made(modules, tmp_path / "first").run(workers=0)
    assert made(modules, tmp_path / "second", reuse=[str(tmp_path / "first")]).run(workers=0).reused == 8
    helper = modules / "helper.py"
    helper.write_text(helper.read_text().replace("1.0", "3.0"))
    loaded_anew(modules, monkeypatch)
    third = made(modules, tmp_path / "third", reuse=[str(tmp_path / "first")])
    assert third.run(workers=0).reused == 0
    assert set((third.table.y - third.table.x).round(9)) == {3.0}


def test_an_edit_under_a_worker_makes_it_refuse(modules, tmp_path, monkeypatch):
    """Between two units, and after it was loaded but before the first look: what runs is not what stands there."""
    campaign = made(modules, tmp_path / "c")
    campaign.work(1, 4)
    helper = modules / "helper.py"
    text = helper.read_text()
    helper.write_text(text.replace("1.0", "2.5"))
    # a look before will do to begin a unit; at its end there is another one
    assert running_code([*campaign.plan.subject.modules()], within=math.inf).sources
    with pytest.raises(CodeChanged, match=says("edited while", f"{modules.name}.helper")):
        running_code([*campaign.plan.subject.modules()])
    monkeypatch.setattr(code, "_seen", {})
    with pytest.raises(CodeChanged, match=says("edited after", f"{modules.name}.helper")):
        running_code([*campaign.plan.subject.modules()])
    # a text was edited, and that can be seen
    helper.write_text('"""Texts."""\n' + text)
    monkeypatch.setattr(code, "_seen", {})
    assert running_code([*campaign.plan.subject.modules()]).sources


@pytest.mark.slow
def test_a_unit_under_which_a_source_is_edited_is_not_done(modules, tmp_path, monkeypatch):
    """However short ago the sources were looked at when it began."""
    campaign = made(modules, tmp_path / "c")
    helper, run = modules / "helper.py", FunctionSubject.run

    def edited(self, thing, progress, keep):
        helper.write_text(helper.read_text().replace("1.0", "2.5"))
        return run(self, thing, progress, keep)

    monkeypatch.setattr(FunctionSubject, "run", edited)
    with pytest.raises(CampaignError, match=says(f"{modules.name}.helper", "edited")):
        campaign.work(1, 4)
    assert campaign.status().units_done == 0
    # as long as nothing is, the twin is
    monkeypatch.setattr(FunctionSubject, "run", run)
    helper.write_text(helper.read_text().replace("2.5", "1.0"))
    assert campaign.work(1, 4).units_done == 1


BEFORE = '''
import functools
import warnings
from math import sin as g

LARGE = 2.0 ** 2


class K:
    v: float = 2.0

    def key(self, a):
        """Return what is shown of a number."""
        if a < 0:
            raise ValueError(f"a = {a}; give more")
        if a == 0:
            warnings.warn(f"a = {a} is {self.v}", stacklevel=2)
        assert a < 9 or a == "so many", f"a = {a}"
        return f"{a} m"


def around(f):
    return functools.wraps(f)(lambda *a: f(*a))


@around
def inner(a):
    return a


def f(a, k=2.0, *, m=1.0):
    """Return a number."""
    return g(a) + k + m + K.v
'''


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("k=2.0", "k=3.0"),
        ("m=1.0", "m=3.0"),
        ("v: float = 2.0", "v: float = 3.0"),
        ("import sin", "import cos"),
        ("return a\n", "return -a\n"),
        ("2.0 ** 2", "2.0 ** 3"),
        ("{a} m", "{a} cm"),
        ("so many", "so few"),
        ("ValueError", "KeyError"),
        ("stacklevel=2", "stacklevel=3"),
    ],
)
def test_what_is_loaded_is_held_against_its_source(tmp_path, monkeypatch, old, new):
    """What can be seen of a module by what it has, the rest by the bytecode that its import has left."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    path = tmp_path / f"seen_{abs(hash((tmp_path, old)))}.py"

    def same(text, later):
        path.write_text(text)
        os.utime(path, (1e9 + later, 1e9 + later))
        about = path.stat()
        return as_loaded(path.stem, path, (about.st_mtime_ns, about.st_ctime_ns, about.st_size))

    assert same(BEFORE, 0)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setitem(sys.modules, path.stem, importlib.import_module(path.stem))
    assert same(BEFORE, 0)
    assert old in BEFORE
    assert not same(BEFORE.replace(old, new), 5)
    # all of this can be seen
    plain = BEFORE.replace("LARGE = 2.0 ** 2\n", "").replace("@around\n", "")
    (tmp_path / f"{path.stem}_2.py").write_text(plain)
    path = tmp_path / f"{path.stem}_2.py"
    monkeypatch.setitem(sys.modules, path.stem, importlib.import_module(path.stem))
    assert same(plain.replace("Return a number", "Return some number"), 5)
    for message, other in {
        "= {a}; give more": "is {a:g}, {a - 1}",
        "is {self.v}": "is much",
        '9 or a == "so many", f"a = {a}"': '9 or a == "so many", "a is large"',
    }.items():
        assert message in plain
        assert same(plain.replace(message, other), 5), message


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.slow
def test_an_edit_after_the_import_is_refused_in_one_process(modules, tmp_path, named):
    """Also of what two campaigns of it have in common; what is loaded as it stands there runs."""
    first = made(modules, tmp_path / "first")
    assert first.run(workers=0).done == 8
    helper = modules / "helper.py"
    helper.write_text(helper.read_text().replace("1.0", "2.5"))
    (modules / "other.py").write_text((modules / "model.py").read_text())
    other = importlib.import_module(f"{modules.name}.other").model
    subject = FunctionSubject(f"{modules.name}.other:model" if named else other, {"x": 0.0})
    second = Campaign(tmp_path / "second", make_plan(subject, [Factor("x", 0.0, 1.0)], n=8))
    with pytest.raises(CampaignError, match=says("edited after", f"{modules.name}.helper")):
        second.run(workers=0)
    assert second.status().done == 0
    helper.write_text(helper.read_text().replace("2.5", "1.0"))
    assert made(modules, tmp_path / "third").run(workers=0).done == 8


def test_the_code_of_a_campaign_is_found_again_when_its_note_is_lost(modules, tmp_path):
    campaign = made(modules, tmp_path / "c")
    campaign.work(1, 2)
    (first,) = code_counts(campaign.folder)
    for path in (campaign.path / "codes").iterdir():
        path.write_text("{}")
    campaign.run(workers=0)
    assert list(code_counts(campaign.folder)) == [first]


def test_what_is_the_surroundings_and_what_is_the_case():
    for error in (ModuleNotFoundError("x"), OSError(116, "Stale file handle"), PermissionError(13, "denied")):
        around = RuntimeError("the case failed")
        around.__cause__ = error
        assert refusal(error) is not None
        assert refusal(around) is not None
    for error in (ValueError("x"), FileNotFoundError(2, "No such file"), OSError("unable to open"), MemoryError()):
        assert refusal(error) is None


def needing(path, values, **settings) -> Campaign:
    """Return a campaign of cases of which those beyond 3 need a module that nobody has."""
    rows = [{"x1": float(x)} for x in values]
    subject = FunctionSubject(needy, PLACES)
    return Campaign(path, make_plan(subject, design="list", options={"rows": rows}, **settings))


@pytest.mark.parametrize("unit", [1, 3, 16])
def test_a_case_that_lacks_a_module_does_not_end_the_run(tmp_path, unit):
    """The first one, one among others, and two that have a unit for themselves: the others are done."""
    campaign = needing(tmp_path / "c", [4, 1, 2, 1, 5, 1, 7, 8, 9, 2], unit=unit)
    status = campaign.run(workers=0)
    assert (status.done, status.failed) == (10, 5)
    failed = campaign.failed()
    assert failed.x1.tolist() == [4, 5, 7, 8, 9]
    assert failed.message.str.contains("a_module_that_nobody_has").all()
    assert failed.advice.str.contains("retry").all()
    assert campaign.table.id.str.len().eq(64).all()


def test_a_worker_that_lacks_a_module_for_all_refuses(tmp_path, monkeypatch):
    """Nothing is recorded of cases, of which none can be carried out; nor of a worker that breaks in the middle."""
    campaign = needing(tmp_path / "c", [4.0] * 20, unit=10)
    with pytest.raises(CampaignError, match=says("a_module_that_nobody_has", "host")):
        campaign.run(workers=0)
    assert campaign.status().done == 0
    breaking = needing(tmp_path / "d", range(3), unit=3)

    def broken(*_args, **_kwargs):
        raise ImportError("libodd.so: cannot open shared object file")

    run = FunctionSubject.run
    monkeypatch.setattr(
        FunctionSubject, "run", lambda self, thing, *a: (run if thing["x1"] < 1.0 else broken)(self, thing, *a)
    )
    assert breaking.run(workers=0).failed == 2
    calls = iter(range(100))
    monkeypatch.setattr(FunctionSubject, "run", lambda self, *a: (run if next(calls) < 2 else broken)(self, *a))
    with pytest.raises(CampaignError, match=says("libodd.so", "host")):
        needing(tmp_path / "e", range(3), unit=3).run(workers=0)


def test_the_first_failure_may_be_a_module(tmp_path):
    with pytest.raises(CampaignError, match=says("stopped", "case 1", "a_module_that_nobody_has")):
        needing(tmp_path / "c", [1, 4, 1], on_failure="stop").run(workers=0)
    with pytest.raises(CampaignError, match=says("host", "a_module_that_nobody_has")):
        needing(tmp_path / "d", [4, 4, 4], on_failure="stop").run(workers=0)


@pytest.mark.slow
def test_cases_that_lack_a_module_in_processes_of_their_own(tmp_path):
    campaign = needing(tmp_path / "c", [4, 1, 5, 1, 1, 6], unit=1, wall_limit=60.0)
    status = campaign.run(workers=2)
    assert (status.done, status.failed) == (6, 3)


def test_differences_are_told():
    one = Code({"a": "1", "b": "2"}, {"numba": "0.63", "processor": "znver5"})
    other = Code({"a": "1", "b": "3"}, {"numba": "0.68", "processor": "znver5"})
    assert one.differences(other) == "numba 0.68 instead of 0.63; another source of b"
    assert one.differences(one) == "nothing"
    assert one.digest != other.digest


STAGE = {
    "running": True,
    "shafts": {"in": {"length": "100 mm"}, "out": {"length": "100 mm"}},
    "wheels": {
        "pinion": {"shaft": "in", "teeth": 20, "module": "3 mm"},
        "gear": {"shaft": "out", "teeth": 40, "module": "3 mm"},
    },
    "meshes": {"mesh": {"driver": "pinion", "driven": "gear", "backlash": "0.1 mm"}},
    "bearings": {"a": {"shaft": "in"}, "b": {"shaft": "out"}},
    "drives": {"motor": {"shaft": "in", "speed": "1500 rpm"}},
    "loads": {"brake": {"shaft": "out", "torque": "80 N m"}},
    "run": {"settling": "10 ms", "duration": "20 ms"},
}
SIMULATED = {
    "pair": ({"case": {"operation": {"duration": 0.06, "run_up": 0.01, "settling": 0.01}}}, "harmonics contact"),
    "drivetrain": ({"tables": STAGE}, "harmonics forces"),
}  # fmt: skip
REFUSING = """
import sys
from gearmbs.studies.run.code import counts

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.startswith("gearmbs.") and not counts(name.removeprefix("gearmbs.")):
            raise AssertionError(name + " takes part")

sys.meta_path.insert(0, Refuse())
from gearmbs.campaigns.subjects.base import make_subject
kind, settings, keep = sys.argv[1], eval(sys.argv[2]), sys.argv[3].split()
subject = make_subject(kind, settings)
thing = subject.check(subject.base(), "x")
subject.canonical(thing)
print(len(subject.reduce(thing, subject.run(thing, lambda fraction: None, keep), keep).numbers))
"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", SIMULATED)
def test_modules_that_do_not_count_simulate_nothing(kind):
    """A case is carried out by a process that cannot import them."""
    settings, keep = SIMULATED[kind]
    found = subprocess.run(
        [sys.executable, "-c", REFUSING, kind, repr(settings), keep], capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(p or "." for p in sys.path)},
    )  # fmt: skip
    assert found.returncode == 0, found.stderr
    assert int(found.stdout) > 3
