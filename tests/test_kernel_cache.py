"""Compiled kernels on disk: found when nothing they are made of has changed, and never otherwise."""

from __future__ import annotations

import json
import os
import pickle
import platform
import shutil
import subprocess
import sys
import textwrap
import threading
import time
import types
import zlib
from pathlib import Path

import numpy as np
import pytest

from gearmbs.kernels import cache, locks

CALLEES = """
    from typing import NamedTuple
    from gearmbs.kernels.jit import njit
    from . import numbers

    class Pair(NamedTuple):
        first: float
        second: float

    @njit(cache=True)
    def scaled(x):
        '''Return a multiple.'''
        return numbers.FACTOR * x

    @njit("float64(float64)", cache=True)
    def unrelated(x):
        return x + 1.0
"""

CALLERS = """
    import numpy as np
    from numba import float64, types
    from gearmbs.kernels.jit import njit
    from smallpackage.callees import Pair, scaled, unrelated

    PAIR = types.NamedUniTuple(float64, 2, Pair)

    @njit("float64(float64)", cache=True)
    def caller(x):
        return scaled(x) + 1.0

    @njit(float64(PAIR), cache=True)
    def second(pair):
        return pair.second

    @njit("float64(float64[::1], int64)", cache=True)
    def checked(x, k):
        if k < 0:
            raise ValueError("negative")
        return x[k]
"""

RUN = """
    import json, sys
    from gearmbs.kernels import jit
    made = []
    compile_ = jit.Kernel._compile
    def counted(self, *rest):
        made.append(self.__name__)
        return compile_(self, *rest)
    jit.Kernel._compile = counted
    from smallpackage import callees, callers
    result = {expression}
    print(json.dumps([result, sorted(made)]))
"""


class Package:
    """A small package of two modules with kernels, and a way to call them in a process of its own."""

    def __init__(self, folder: Path, home: Path | str | None = None) -> None:
        self.folder = folder / "smallpackage"
        self.folder.mkdir(parents=True)
        self.environment = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
        self.environment["PYTHONPATH"] = os.pathsep.join([str(folder), *sys.path])
        self.environment["HOME"] = str(home or folder / "home")
        for name, text in (
            ("__init__", ""),
            ("numbers", "FACTOR = 2.0\nOTHER = 5.0\n"),
            ("callees", CALLEES),
            ("callers", CALLERS),
        ):
            self.write(name, textwrap.dedent(text))

    @property
    def kernels(self) -> Path:
        """Where its kernels are kept."""
        return self.folder.parent / "home" / ".cache" / "gearmbs" / "smallpackage"

    @property
    def beside(self) -> Path:
        """Where they are kept if that cannot be written."""
        return self.folder / "__pycache__" / "kernels"

    def write(self, name: str, text: str) -> None:
        """Write a module."""
        (self.folder / f"{name}.py").write_text(text)

    def edit(self, name: str, old: str, new: str) -> None:
        """Change a module as a person would."""
        text = (self.folder / f"{name}.py").read_text()
        assert old in text
        self.write(name, text.replace(old, new))

    def start(self, expression: str) -> subprocess.Popen:
        """Start a process that evaluates an expression."""
        code = textwrap.dedent(RUN).format(expression=expression)
        # whether byte code is fresh goes by seconds, and edits come faster
        command = [sys.executable, "-B", "-c", code]
        return subprocess.Popen(
            command, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd="/"
        )

    def call(self, expression: str = "callers.caller(3.0)") -> list:
        """Return the value of an expression and the names of what had to be compiled."""
        return self.answer(self.start(expression))

    @staticmethod
    def answer(process: subprocess.Popen) -> list:
        import json

        out, error = process.communicate(timeout=300)
        assert process.returncode == 0, error
        return json.loads(out)


@pytest.fixture
def package(tmp_path):
    return Package(tmp_path)


@pytest.mark.slow
def test_edits(package):
    """What is called stands in another file; callers are compiled again when, and only when, it changes."""
    assert package.call() == [7.0, ["caller", "scaled"]]
    assert package.call() == [7.0, []]
    package.edit("numbers", "FACTOR = 2.0", "FACTOR = 3.0")
    assert package.call() == [10.0, ["caller", "scaled"]]
    package.edit("callees", "numbers.FACTOR * x", "x - numbers.FACTOR")
    assert package.call() == [1.0, ["caller", "scaled"]]
    # what does not bear on the code
    package.edit("callees", "Return a multiple.", "Return a\n    difference.")
    package.edit("callees", "return x + 1.0", "return x + 2.0")
    package.edit("numbers", "OTHER = 5.0", "OTHER = 6.0")
    assert package.call() == [1.0, []]
    # back: what was compiled once is still there
    package.edit("callees", "x - numbers.FACTOR", "numbers.FACTOR * x")
    package.edit("numbers", "FACTOR = 3.0", "FACTOR = 2.0")
    assert package.call() == [7.0, []]


@pytest.mark.slow
def test_fields_of_named_tuples(package):
    """Types of the same name whose fields change places are other types."""
    expression = "callers.second(callees.Pair(first=1.0, second=2.0))"
    assert package.call(expression) == [2.0, ["second"]]
    package.edit("callees", "    first: float\n    second: float\n", "    second: float\n    first: float\n")
    assert package.call(expression) == [2.0, ["second"]]


@pytest.mark.slow
def test_errors_and_conversions(package):
    """From the cache as from the compiler: exceptions arrive, and arguments that do not fit are refused."""
    package.write(
        "__init__",
        textwrap.dedent("""
            import numpy as np
            def tried(kernel, *arguments):
                try:
                    return kernel(*arguments)
                except (TypeError, ValueError) as error:
                    return type(error).__name__
        """),
    )
    calls = "[tried(callers.checked, x, k) for x, k in ((v, 2), (v, -1), (v[::2], 0), (list(v), 0))]"
    expression = f"(lambda tried, v: {calls})(sys.modules['smallpackage'].tried, callers.np.arange(4.0))"
    expected = [2.0, "ValueError", "TypeError", "TypeError"]
    assert package.call(expression) == [expected, ["checked"]]
    assert package.call(expression) == [expected, []]


@pytest.mark.slow
def test_two_processes(package):
    """Processes that start together compile each kernel once, and both get it."""
    together = [package.start("callers.caller(3.0)") for _ in range(3)]
    answers = [package.answer(process) for process in together]
    assert [value for value, _ in answers] == [7.0] * 3
    assert sorted(name for _, made in answers for name in made) == ["caller", "scaled"]
    left = {path.suffix for path in package.kernels.iterdir()}
    assert left == {".entry", ".part"}


@pytest.mark.slow
def test_named_folder(package, tmp_path):
    package.environment["NUMBA_CACHE_DIR"] = str(tmp_path / "elsewhere")
    assert package.call() == [7.0, ["caller", "scaled"]]
    assert package.call() == [7.0, []]
    assert len(list((tmp_path / "elsewhere").rglob("*.entry"))) == 1
    assert not package.kernels.exists()
    assert not package.beside.exists()


@pytest.mark.slow
def test_two_checkouts_share_their_kernels(package, tmp_path):
    """What one installation has compiled another one finds, whatever folder it stands in."""
    assert package.call() == [7.0, ["caller", "scaled"]]
    other = Package(tmp_path / "other", home=package.environment["HOME"])
    assert other.call() == [7.0, []]
    assert not package.beside.exists()
    assert not other.beside.exists()


@pytest.mark.slow
def test_folders_that_cannot_be_written(package):
    """What the user's folder cannot take goes beside the package, or is compiled for the process alone."""
    home = package.environment["HOME"]
    package.environment["XDG_CACHE_HOME"] = "/dev/null/none"
    assert package.call() == [7.0, ["caller", "scaled"]]
    before = {path.name: path.stat().st_mtime_ns for path in package.beside.iterdir()}
    # what lies beside the package, as shipped with it, is found where the user's folder can be written too
    del package.environment["XDG_CACHE_HOME"]
    assert package.call() == [7.0, []]
    package.edit("numbers", "FACTOR = 2.0", "FACTOR = 3.0")
    assert package.call() == [10.0, ["caller", "scaled"]]
    assert package.call() == [10.0, []]
    assert {path.name: path.stat().st_mtime_ns for path in package.beside.iterdir()} == before
    assert Path(home, ".cache").is_dir()
    package.environment["XDG_CACHE_HOME"] = "/dev/null/none"
    # a file in the place of a folder stands for one that is read-only, which root could write
    shutil.rmtree(package.beside)
    package.beside.write_text("")
    assert package.call() == [10.0, ["caller", "scaled"]]
    assert package.call() == [10.0, ["caller", "scaled"]]


@pytest.mark.slow
def test_damaged_files(package):
    """A file that was cut short, or holds what nothing can be rebuilt from, is compiled anew."""
    package.call()
    strange = pickle.dumps(("what", "is", "this"))
    for path in package.kernels.iterdir():
        if path.suffix == ".part":
            path.write_bytes(path.read_bytes()[:-7])
        else:
            path.write_bytes(zlib.crc32(strange).to_bytes(4, "little") + strange)
    assert package.call() == [7.0, ["caller", "scaled"]]
    assert package.call() == [7.0, []]


def test_what_makes_the_files_is_in_their_names(tmp_path, monkeypatch):
    (tmp_path / "own").mkdir()
    for name in cache.MAKERS:
        shutil.copy(Path(cache.__file__).parent / f"{name}.py", tmp_path / f"{name}.py")
    known = cache.setting()
    monkeypatch.setattr(cache, "__file__", str(tmp_path / "cache.py"))
    assert cache.setting.__wrapped__() == known
    with (tmp_path / "own" / "jit.py").open("a") as stream:
        stream.write("CHANGED = True\n")
    assert cache.setting.__wrapped__() != known


def test_patch_versions_make_no_other_names(monkeypatch):
    """What fits is told by minor versions of Python, numba and LLVM's wrapper, and by no version of numpy."""
    known = cache.setting()
    version_of = cache.version_of
    for library in ("numba", "llvmlite"):
        minor, _, _ = version_of(library).rpartition(".")
        for version, same in ((f"{minor}.987", True), ("0.987.0", False)):
            with monkeypatch.context() as other:
                told = {library: version}
                other.setattr(cache, "version_of", lambda name, told=told: told.get(name) or version_of(name))
                assert (cache.setting.__wrapped__() == known) is same
    with monkeypatch.context() as other:
        other.setattr(np, "__version__", "2.987.0")
        assert cache.setting.__wrapped__() == known
        major, minor, _ = platform.python_version_tuple()
        other.setattr(cache.platform, "python_version", lambda: f"{major}.{minor}.987")
        assert cache.setting.__wrapped__() == known
        other.setattr(cache.platform, "python_version", lambda: f"{major}.987.0")
        assert cache.setting.__wrapped__() != known


def test_interrupted_description(monkeypatch):
    """A digest that could not be finished is not taken for a recursion afterwards."""

    def function():
        return 1.0

    def interrupted(function):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(cache, "_described", interrupted)
        with pytest.raises(KeyboardInterrupt):
            cache.identity(function)
    assert len(cache.identity(function)) == 64


EACH_OTHER = """
def first(n):
    return 1.0 if n == 0 else 2.0 * second(n - 1)

def second(n):
    return {last} if n == 0 else first(n - 1)
"""


def test_functions_that_call_each_other():
    """The digest of each covers the other, whichever is asked for first."""

    def digests(last, *order):
        module = types.ModuleType("own.module")
        exec(EACH_OTHER.format(last=last), module.__dict__)
        cache._identities.clear()
        return {name: cache.identity(getattr(module, name)) for name in order}

    known = digests(1.0, "first", "second")
    assert digests(1.0, "second", "first") == known
    edited = digests(3.0, "first", "second")
    assert edited["first"] != known["first"]
    assert edited["second"] != known["second"]


def test_lock_after_it_was_removed(tmp_path):
    """Who waited for a lock holds the file that the next one will find, not the one that its last holder removed."""
    pytest.importorskip("fcntl")
    path = tmp_path / "kernel.lock"
    seen = []

    def second():
        with locks.held(path):
            seen.append(path.exists())

    thread = threading.Thread(target=second)
    with locks.held(path):
        thread.start()
        time.sleep(0.2)
        assert seen == []
    thread.join(timeout=30)
    assert seen == [True]
    assert not path.exists()


@pytest.mark.slow
def test_numba_calls_kernels(package):
    """A user's own numba function may call a kernel that calls others."""
    package.write(
        "__init__", "import numba\ndef doubled(kernel):\n    return numba.njit(lambda x: 2.0 * kernel(x))(3.0)\n"
    )
    expression = "sys.modules['smallpackage'].doubled(callers.caller)"
    assert package.call(expression) == [14.0, ["caller", "scaled"]]
    assert package.call(expression) == [14.0, []]


@pytest.mark.slow
def test_importing_looks_at_no_files(package):
    """Nothing is compiled, loaded or looked for before a kernel is called."""
    package.write("__init__", "")
    assert package.call("0") == [0, []]
    assert not package.kernels.exists()
    assert not package.beside.exists()


@pytest.mark.slow
def test_kernels_as_arguments(package):
    """A kernel handed to a user's numba function as a typed pointer, inside compiled code."""
    package.write(
        "__init__",
        textwrap.dedent("""
            import numba
            pointer = numba.types.FunctionType(numba.float64(numba.float64))
            def twice(kernel):
                @numba.njit(numba.float64(pointer, numba.float64))
                def applied(function, x):
                    return function(function(x))
                return numba.njit(lambda x: applied(kernel, x))(3.0)
        """),
    )
    expression = "sys.modules['smallpackage'].twice(callers.caller)"
    assert package.call(expression) == [15.0, ["caller", "scaled"]]
    assert package.call(expression) == [15.0, []]


LATE = """

@njit("float64(float64)", cache=True, late=True)
def seldom(x):
    if x < 0.0:
        raise ValueError("negative")
    return scaled(x)

@njit("float64(float64)", cache=True)
def cautious(x):
    return x if 0.0 <= x < 10.0 else seldom(x)

@njit("float64(float64)", cache=True, late=True)
def impossible(x):
    return x.nothing

@njit("float64(float64)", cache=True)
def hopeful(x):
    return impossible(x) if x > 0.0 else x

def tried(kernel, x):
    try:
        return kernel(x)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
"""


@pytest.mark.slow
def test_late_kernels(package):
    """What a caller need not call is not compiled for it; an edit of it leaves the caller as it is."""
    package.edit("callers", "    return x[k]\n", "    return x[k]\n" + LATE)
    assert package.call("callers.cautious(3.0)") == [3.0, ["cautious"]]
    assert package.call("callers.cautious(11.0)") == [22.0, ["scaled", "seldom"]]
    assert package.call("[callers.cautious(11.0), callers.cautious(12.0)]") == [[22.0, 24.0], []]
    assert package.call("callers.tried(callers.cautious, -1.0)") == ["ValueError: negative", []]
    package.edit("numbers", "FACTOR = 2.0", "FACTOR = 3.0")
    assert package.call("callers.cautious(3.0)") == [3.0, []]
    assert package.call("callers.cautious(11.0)") == [33.0, ["scaled", "seldom"]]


@pytest.mark.slow
def test_late_kernels_that_cannot_be_compiled(package):
    """The caller raises an error, and does so again when it is called again."""
    package.edit("callers", "    return x[k]\n", "    return x[k]\n" + LATE)
    answer, _ = package.call("[callers.hopeful(-1.0), *[callers.tried(callers.hopeful, 1.0) for _ in range(2)]]")
    expected = "RuntimeError: smallpackage.callers:impossible could not be compiled; what went wrong was printed"
    assert answer == [-1.0, expected, expected]


def test_symbols_have_the_same_names_in_all_processes():
    """A part is looked for by the name that its callers have on disk, whatever the process that has compiled it."""
    from numba.core.registry import cpu_target

    from gearmbs.kernels.own.jit import _Flags

    def flags(fastmath) -> _Flags:
        found = _Flags()
        cpu_target.options.parse_as_flags(found, {"fastmath": fastmath})
        return found

    several = flags({"reassoc", "contract", "arcp", "nsz"})
    assert "arcp', 'contract', 'nsz', 'reassoc" in several.summary()
    assert several.get_mangle_string() != flags(True).get_mangle_string()


@pytest.mark.parametrize("kept", ["", "5", "null", '["x", "y"]', "[1, 2, 3]", '{"a": 1, "b": 2, "c": 3}', None])
def test_what_tells_the_processor_is_replaced_where_it_is_broken(kept, tmp_path, monkeypatch):
    file = tmp_path / "target.json"
    if kept is not None:
        file.write_text(kept, encoding="utf-8")
    monkeypatch.setattr(cache, "_target_file", lambda: file)
    assert not cache.known()
    found = cache._own_target.__wrapped__()
    assert cache.known()
    assert tuple(json.loads(file.read_text(encoding="utf-8"))) == found == cache._own_target()


def test_a_folder_that_cannot_be_looked_into_keeps_nothing(tmp_path, monkeypatch):
    """Of a name that is too long the system tells an error, as of a folder of somebody else's."""
    monkeypatch.setattr(cache, "_target_file", lambda: tmp_path / ("x" * 300) / "target.json")
    assert not cache.known()
    assert cache._own_target.__wrapped__() == cache._own_target()
