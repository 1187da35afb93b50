"""The compile command knows every kernel, and programs that lack kernels compile those they have imported."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import llvmlite.binding
import pytest

import gearmbs
from gearmbs.kernels import ahead as compiling
from gearmbs.kernels import cache, calls
from gearmbs.kernels.ahead import compile_entries
from tests.says import says

ROOT = Path(gearmbs.__file__).parent


@pytest.fixture(scope="module")
def found():
    """Return all kernels of the package."""
    calls.import_all()
    return calls.kernels(calls.kernel_modules())


def test_every_module_that_compiles_is_known():
    known = set(calls.kernel_modules())
    for path in ROOT.rglob("*.py"):
        name = ".".join(("gearmbs", *path.relative_to(ROOT).with_suffix("").parts))
        # what stands in for modules in the other mode is not imported in this one
        if name.startswith(calls.OTHER_MODE):
            assert name not in known
        elif re.search(r"^\s*@(?:njit|kernel|inlined|summing)\b", path.read_text("utf-8"), re.M):
            assert name in known


def test_kernels_are_declared_one_way():
    """numba's own decorator would compile at import; `gearmbs.kernels.jit` does not."""
    for path in ROOT.rglob("*.py"):
        if path.name != "jit.py" or ROOT / "kernels" not in path.parents:
            assert not re.search(r"from numba import .*\bnjit\b|numba\.njit\(", path.read_text("utf-8")), path


@pytest.mark.slow
def test_entries_and_parts(found):
    """Whatever has a signature is an entry, or is reached from one; helpers are reached from one."""
    entries = calls.entries(found)
    names = {calls.address(kernel) for kernel in entries}
    for address in (
        "gearmbs.dae.equations.residual:residual",
        "gearmbs.dae.equations.jacobian:jacobian",
        "gearmbs.dae.integrators.step:advance",
        "gearmbs.dae.linalg.sparse_lu:factor",
        "gearmbs.contact.kernel:gear_contact",
        "gearmbs.gears.pattern:_run",
    ):
        assert address in names
    reached = {*entries}.union(*(calls.below(kernel) for kernel in entries))
    assert not [calls.address(k) for k in found if k.declared is not None and k not in reached]


@pytest.mark.slow
def test_a_mechanism_does_not_need_the_contact(found):
    """No kernel of the equations or integrators calls one of the contact."""
    for kernel in found:
        if kernel.__module__.startswith("gearmbs.dae"):
            below = {callee.__module__ for callee in calls.below(kernel)}
            assert not any(module.startswith(("gearmbs.contact", "gearmbs.gears")) for module in below)


def run(folder: Path, *command: str) -> subprocess.CompletedProcess:
    """Run Python in a folder that has a package of the same name, with the folder for kernels by a relative path."""
    decoy = folder / "gearmbs"
    decoy.mkdir(exist_ok=True)
    (decoy / "__init__.py").write_text("raise ImportError('the wrong package')")
    environment = {**os.environ, "NUMBA_CACHE_DIR": "kept"}
    environment.pop("PYTHONPATH", None)
    done = subprocess.run(
        [sys.executable, *command], env=environment, cwd=folder, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return done


PROGRAM = f"""
import sys
sys.path[:0] = {[path for path in sys.path if path]}
from gearmbs.dae.equations.rotation import rotation_matrix
import numpy as np
a = np.zeros((3, 3))
print(rotation_matrix.ready() is rotation_matrix)
"""


@pytest.mark.slow
def test_a_program_says_that_it_compiles(tmp_path):
    """Missing: helpers compile what the program has imported, and it tells so; there: not a word.

    The helpers import what the program imports, though nothing in their surroundings tells them where it is.
    """
    first = run(tmp_path, "-c", PROGRAM)
    assert "compiling numerical kernels" in first.stderr
    assert "failed" not in first.stderr
    assert first.stdout == "True\n"
    kept = {path.name.partition("-")[0] for path in tmp_path.rglob("*.entry")}
    assert "dae.equations.rotation.rotation_matrix" in kept
    assert all(name.startswith("dae.equations.rotation.") for name in kept)
    second = run(tmp_path, "-c", PROGRAM)
    assert second.stderr == ""
    assert second.stdout == "True\n"


LOADED_LATER = """
import sys
from gearmbs.kernels.jit import Kernel
from gearmbs.kernels.calls import address, kernel_modules, kernels

compiling, first = Kernel.compile, set()

def noted(kernel, signature):
    first.update(() if first else sys.modules)
    return compiling(kernel, signature)

Kernel.compile = noted
{program}
assert first
print(*sorted((set(sys.modules) - first) & set(kernel_modules())))
loaded = [name for name in sys.modules if name.startswith("gearmbs.")]
print(*[address(k) for k in kernels(loaded) if k.late and len(k.overloads)])
"""
PENDULUM = """
from gearmbs.mechanism import Mechanism
m = Mechanism()
rod = m.body("rod", 1.0, (0.1, 0.1, 0.01), position=(0.5, 0, 0))
m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
m.simulate(0.1)
"""
PAIR = """
from gearmbs.studies import make_case, run_case
run_case(make_case({"operation": {"duration": "0.3 s", "settling": "0 s"}}))
"""


@pytest.mark.slow
@pytest.mark.parametrize("program", [PENDULUM, PAIR])
def test_what_a_run_needs_is_known_at_once(program):
    """Kernels that were loaded, or late kernels called, after the first one was would be compiled in a second round."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    code = LOADED_LATER.format(program=program)
    assert not subprocess.check_output([sys.executable, "-c", code], env=environment, text=True, cwd="/").strip()


@pytest.mark.slow
def test_looking_for_calls_imports_nothing():
    """Packages whose names are imported late stay as they are: their kernels would be compiled, too."""
    code = "import sys; from gearmbs.kernels.calls import entries, kernels; import gearmbs.mechanism.solve.simulate; "
    code += "loaded = [n for n in sys.modules if n.startswith('gearmbs.')]; entries(kernels(loaded), loaded); "
    code += "print(*({n for n in sys.modules if n.startswith('gearmbs.')} - {*loaded}))"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert not subprocess.check_output([sys.executable, "-c", code], env=environment, text=True, cwd="/").strip()


@pytest.mark.slow
def test_failing_helpers(monkeypatch):
    """What a helper cannot compile is told with its traceback."""
    kernel = calls.find("gearmbs.dae.equations.rotation", "rotation_matrix")
    monkeypatch.setattr(cache, "stored", lambda *rest: False)
    monkeypatch.setattr(calls, "address", lambda kernel: f"{kernel.__module__}:not_there")
    with pytest.raises(RuntimeError, match=says("not_there", "LookupError")):
        compile_entries([kernel], workers=1)


@pytest.fixture
def missing(monkeypatch):
    """Return a kernel that seems to be missing, in a process that has said nothing yet."""
    monkeypatch.setattr(cache, "stored", lambda *rest: False)
    monkeypatch.setattr(compiling, "_said", set())
    monkeypatch.setattr(compiling, "_failures", [])
    monkeypatch.delenv(compiling.HELPER, raising=False)
    return calls.find("gearmbs.dae.equations.rotation", "rotation_matrix")


@pytest.mark.slow
def test_announced_once(missing, monkeypatch, capsys):
    """A program may lack kernels again and again, as it imports more."""
    monkeypatch.setattr(compiling, "compile_entries", lambda wanted, report: report("1/1 part 0.1 s"))
    assert compiling.compile_missing(missing)
    assert compiling.compile_missing(missing)
    said = capsys.readouterr().err
    assert said == "gearmbs: compiling numerical kernels that are not on disk yet; they are kept there\n"


@pytest.mark.slow
def test_a_processor_without_what_shipped_kernels_need_is_told(missing, monkeypatch, capsys, tmp_path):
    """The system tells of its processor, or LLVM does where the system tells nothing."""
    monkeypatch.setattr(compiling, "compile_entries", lambda wanted, report: None)
    monkeypatch.setattr(cache, "SHIPPED", tmp_path)
    chosen: dict[str, str] = {}
    monkeypatch.setattr(cache, "option", chosen.get)
    monkeypatch.setattr(cache, "CPU_FILE", tmp_path / "cpuinfo")
    flags = {name: cache.IN_FLAGS.get(name, name) for name in cache.NEEDED}
    told = "processor : {}\nflags : fpu {}\n\n"

    def with_flags(names):
        cache.CPU_FILE.write_text("".join(told.format(k, " ".join(names)) for k in range(2)))

    with_flags(flags.values())
    assert cache.shipped.__wrapped__()
    assert compiling.compile_missing(missing)
    assert "has no" not in capsys.readouterr().err
    with_flags(flag for name, flag in flags.items() if name != "lzcnt")
    assert not cache.shipped.__wrapped__()
    assert compiling.compile_missing(missing)
    said = capsys.readouterr().err
    assert "x86-64-v3" in said
    assert "has no lzcnt" in said
    cache.CPU_FILE.unlink()
    has = dict.fromkeys(cache.NEEDED, True)
    monkeypatch.setattr(llvmlite.binding, "get_host_cpu_features", lambda: has)
    assert cache.shipped.__wrapped__()
    has["fma"] = False
    assert cache.lacking() == ["fma"]
    has["fma"] = True
    chosen["CPU_NAME"] = "generic"
    assert not cache.shipped.__wrapped__()


@pytest.mark.slow
def test_helpers_that_fail_are_not_started_again(missing, monkeypatch, capsys):
    started = []
    monkeypatch.setattr(sys, "executable", "/does/not/exist")
    monkeypatch.setattr(compiling, "_check_folders", lambda packages: started.append(packages))
    assert not compiling.compile_missing(missing)
    assert not compiling.compile_missing(missing)
    assert len(started) == 1
    assert capsys.readouterr().err.count("helper processes failed (a helper process failed: [Errno 2]") == 1


def test_helpers_of_another_checkout_are_refused():
    own = compiling._introduction()
    compiling._check_helper(json.dumps(own))
    for line, reason in (
        ("", "ended at .* start"),
        ("Traceback", "another version"),
        (json.dumps(["/other/gearmbs/kernels/ahead.py", own[1]]), "/other/gearmbs/kernels/ahead.py instead of"),
        (json.dumps([own[0], "other"]), "another setting"),
    ):
        with pytest.raises(RuntimeError, match=reason):
            compiling._check_helper(line)


def test_kernels_that_nobody_compiled(missing, monkeypatch):
    monkeypatch.setattr(compiling._Tasks, "work", lambda self: None)
    with pytest.raises(RuntimeError, match=says("wait for each")):
        compile_entries([missing])


def test_kernels_that_cannot_be_kept(missing, monkeypatch):
    """The command does not claim that kernels are ready that the next process has to compile again."""
    monkeypatch.setattr(cache, "writable", lambda package: False)
    monkeypatch.setattr(compiling, "compile_all", lambda *rest, **options: compile_entries([missing]))
    with pytest.raises(SystemExit, match=re.escape(str(cache.folders("gearmbs")[-1]))):
        compiling.main(["--quiet"])


def test_pruning(tmp_path, monkeypatch, capsys):
    """Kernels that nobody has read for some time go, and what killed processes left; other files stay."""
    monkeypatch.setattr(cache, "folders", lambda package: (tmp_path / "none", tmp_path))
    now = time.time()
    for name, days in (("a.entry", 40), ("b.part", 40), ("b.part.lock", 40), ("c.entry", 20), ("notes.txt", 40)):
        (tmp_path / name).write_bytes(b"12345")
        os.utime(tmp_path / name, (now - 86400 * days,) * 2)
    # written long ago and read lately
    (tmp_path / "d.entry").write_bytes(b"12345")
    os.utime(tmp_path / "d.entry", (now, now - 86400 * 40))
    compiling.main(["--prune"])
    assert capsys.readouterr().out == "3 files deleted, 0.0 MB\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.entry", "d.entry", "notes.txt"]
    with pytest.raises(SystemExit, match=r"days = 0\.1"):
        compiling.main(["--prune", "0.1"])


NEEDED = """
import gearmbs.kernels.jit as jit
from gearmbs.kernels import calls
used, compile_ = set(), jit.Kernel.compile
def noted(kernel, signature):
    used.add(calls.address(kernel))
    return compile_(kernel, signature)
jit.Kernel.compile = noted
from gearmbs.studies import bench_train
assert bench_train().build().simulate(2e-4).success
calls.import_all()
entries = {calls.address(k) for k in calls.entries(calls.kernels(calls.kernel_modules()))}
print(len(used), *sorted(used - entries))
"""


@pytest.mark.slow
def test_what_a_run_of_the_bench_calls_is_compiled_ahead():
    """Each kernel that Python calls in it is an entry of the compile command, which makes nothing else to be called."""
    done = subprocess.run([sys.executable, "-c", NEEDED], capture_output=True, text=True, check=True, timeout=300)
    count, *left_out = done.stdout.split()
    assert int(count) > 15
    assert left_out == []
