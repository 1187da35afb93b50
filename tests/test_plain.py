"""The plain mode: kernels by numba's documented interface alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
import warnings
from pathlib import Path

import pytest

import gearmbs
from gearmbs.kernels import NEWEST_KNOWN, is_plain
from tests.private_parts import named_by

FOLDER = Path(gearmbs.__file__).parent / "kernels"

NUMBERS = "FACTOR = 3.0"
KERNELS = """
    from __future__ import annotations
    import numpy as np
    from numba import float64, types
    from gearmbs.kernels.jit import njit
    from gearmbs.kernels.lanes import all_lanes, lanes_at, put_lanes
    from gearmbs.kernels.pointers import address, caller
    from gearmbs.kernels.structs import Struct, Vector
    from . import numbers

    SIGNATURE = types.void(float64[::1], float64)
    add_at = caller(SIGNATURE)

    class Pair(Struct):
        count: int
        values: Vector

    @njit(float64(float64, types.int64), cache=True)
    def scaled(x, power):
        return numbers.FACTOR * x**power

    @njit(types.void(float64[::1], float64), cache=True, late=True, error_model="numpy")
    def add(out, x):
        for k in range(out.size):
            out[k] += scaled(x, 2)

    @njit(float64(float64[::1], types.int64, Pair.numba_type), cache=True, error_model="numpy")
    def caller_of_all(out, place, pair):
        add(out, 2.0)
        add_at(place)(out, 1.0)
        put_lanes(out, 0, lanes_at(out, 0) * all_lanes(2.0))
        pair.count += 1
        return pair.values[1] + out[7]

    @njit(float64(types.FunctionType(float64(float64, types.int64)), float64), cache=True)
    def applied(function, x):
        return function(x, 1)

    @njit(cache=True)
    def helper(x):
        return x[-1] + x[x.size - 2]
"""
PROGRAM = """
    import json, pickle, sys
    from tests import private_parts
    private_parts.refuse(("gearmbs", "plainpackage"))
    import numpy as np
    from numba import njit
    from plainpackage import kernels
    from gearmbs.kernels.pointers import FUNCTIONS_TYPE

    @njit
    def raising(out, x):
        if x > 0.0:
            raise ValueError("positive")
        out[0] = x

    # numba's cache keeps the types of arguments
    assert pickle.loads(pickle.dumps(FUNCTIONS_TYPE)) == FUNCTIONS_TYPE
    pair = kernels.Pair(values=np.array([1.0, 10.0]))
    out, spoiled = np.zeros(8), np.zeros(8)
    kernels.address(kernels.scaled, kernels.scaled.signature)
    place = kernels.address(kernels.add, kernels.SIGNATURE)
    told = kernels.caller_of_all(out, place, pair)
    raised = []
    for _ in range(2):
        try:
            kernels.caller_of_all(spoiled, kernels.address(raising, kernels.SIGNATURE), pair)
        except ValueError as error:
            raised.append(str(error))
    # also after it was kept as a C function; of the declared types, not of those of the arguments
    whole = kernels.scaled(2, 2)
    kinds = sorted({type(value).__module__ for value in (kernels.add, kernels.scaled)})
    print(json.dumps([told, list(out), pair.count, raised, bool(np.isnan(spoiled).all()), whole, type(whole).__name__,
                      kernels.helper(np.arange(4.0)), kinds,
                      kernels.applied(kernels.scaled, 5.0)]))
"""


class Package:
    """A package of kernels in a folder, run by a Python of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "plainpackage").mkdir()
        (folder / "plainpackage" / "__init__.py").touch()
        self.write("numbers", NUMBERS)
        self.write("kernels", textwrap.dedent(KERNELS))

    def write(self, module: str, text: str) -> None:
        """Write a module."""
        (self.folder / "plainpackage" / f"{module}.py").write_text(text)

    def run(self, program: str, compiler: str = "plain") -> subprocess.CompletedProcess:
        """Run a program in the folder."""
        paths = [str(self.folder), *(os.path.abspath(path) for path in sys.path if path)]
        environment = {
            **os.environ,
            "GEARMBS_COMPILER": compiler,
            "NUMBA_CACHE_DIR": str(self.folder / "kept"),
            "PYTHONPATH": os.pathsep.join(paths),
        }
        command = [sys.executable, "-c", textwrap.dedent(program)]
        return subprocess.run(command, env=environment, cwd=self.folder, capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Return a package of kernels."""
    return Package(tmp_path_factory.mktemp("plain"))


@pytest.mark.slow
def test_kernels_of_every_kind(package):
    """Late kernels, addresses, structs and lanes; what a C function raises comes out, and spoils its numbers."""
    done = package.run(PROGRAM)
    assert done.returncode == 0, done.stderr
    told, out, count, raised, spoiled, whole, kind, helper, kinds, applied = json.loads(done.stdout)
    # 2 (3 2^2 + 3 1^2) in each place, and 10 of the struct
    assert out == [30.0] * 8
    assert told == 40.0
    assert count == 3
    assert raised == ["positive", "positive"]
    assert spoiled
    assert (whole, kind) == (12.0, "float")
    assert helper == 5.0
    assert applied == 15.0
    assert kinds == ["gearmbs.kernels.plain.jit"]
    assert "in the plain mode" in done.stderr


@pytest.mark.slow
def test_an_edit_of_what_a_kernel_uses_is_seen(package):
    """numba's own cache looks at the file of the kernel alone; kept kernels are found again."""
    program = """
        from plainpackage.kernels import scaled
        print(scaled(1.0, 1), sum(scaled.dispatcher.stats.cache_hits.values()))
    """
    assert package.run(program).stdout.split()[0] == "3.0"
    package.write("numbers", "FACTOR = 4.0")
    assert package.run(program).stdout == "4.0 0\n"
    package.write("numbers", NUMBERS)
    assert package.run(program).stdout == "3.0 1\n"


@pytest.mark.slow
def test_kernels_are_compiled_ahead(package):
    """What Python calls, and what is called by its address, each as it will be asked for; a run finds them."""
    package.write("numbers", "FACTOR = 3.0  # in a folder of its own")
    before = set(package.folder.rglob("*.nbc"))
    done = package.run("from gearmbs.kernels.ahead import compile_all; compile_all(print, ['plainpackage.kernels'])")
    assert done.returncode == 0, done.stderr
    assert "plainpackage.kernels:caller_of_all" in done.stdout
    ahead = set(package.folder.rglob("*.nbc")) - before
    assert package.run(PROGRAM).returncode == 0
    # no program can know that this helper will be called, or this kernel through an address
    left = {path.name.partition("-")[0] for path in set(package.folder.rglob("*.nbc")) - before - ahead}
    assert left == {"kernels.helper", "kernels.scaled"}
    package.write("numbers", NUMBERS)


@pytest.mark.slow
def test_one_process_compiles_at_a_time(package):
    """numba's cache mixes up what two processes write of one function; a kernel that compiles another may go on."""
    program = """
        import fcntl
        from gearmbs.kernels.plain.jit import alone
        with alone("plainpackage") as place:
            with alone("plainpackage.kernels"):
                pass
            with open(place / "lock") as other:
                try:
                    fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    print("held")
        print((place / "lock").exists())
    """
    assert package.run(program).stdout.split() == ["held", "False"]


def test_an_unknown_mode_is_refused(package):
    done = package.run("import gearmbs.kernels", compiler="fast")
    assert done.returncode != 0
    assert 'GEARMBS_COMPILER = \'fast\': set it to "plain" or "own"' in done.stderr


FOUND = """
    {before}
    import os, sys, warnings
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        from gearmbs import kernels
        from gearmbs.kernels.structs import Struct
    print(kernels.PLAIN, os.environ.get("GEARMBS_COMPILER"), "gearmbs.kernels.library" in sys.modules)
    print(*(w.message for w in told), sep="\\n")
"""
NEWER = f"import importlib.metadata as m; m.version = lambda name: '{NEWEST_KNOWN[0]}.{NEWEST_KNOWN[1] + 1}.0'"
MOVED = "import numba.core.codegen as moved; del moved.JITCodeLibrary"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "says"),
    [
        (NEWER, "is newer than"),
        (MOVED, "has not what the usual mode of gearmbs uses (cannot import name 'JITCodeLibrary'"),
    ],
    ids=["newer", "moved"],
)
def test_the_plain_mode_is_taken_where_the_own_does_not_fit(package, before, says):
    """With one remark, not repeated by processes it starts; whoever asks for the own mode gets it, or why not."""
    done = package.run(FOUND.format(before=before), compiler="")
    assert done.returncode == 0, done.stderr
    mode, *told = done.stdout.splitlines()
    assert mode == "True plain False"
    (told,) = told
    assert told.startswith("numba ")
    assert says in told
    assert "compiled in the plain mode" in told
    assert "GEARMBS_COMPILER=own" in told

    asked = package.run(FOUND.format(before=before), compiler="own")
    if before is MOVED:
        assert "leave out GEARMBS_COMPILER=own, or set it to plain" in asked.stderr
    else:
        assert asked.stdout.strip() == "False own True"


def test_the_mode_by_the_version_of_numba():
    """Newer than known: the plain mode, with a warning; not if a mode was asked for."""
    first, second = NEWEST_KNOWN
    newer = f"{first}.{second + 1}.0rc1"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not is_plain("", f"{first}.{second}.7")
        assert not is_plain("", "")
        assert not is_plain("own", newer)
        assert is_plain("plain", newer)
        assert is_plain("plain", f"{first}.{second}.0")
    with pytest.warns(UserWarning, match=rf"numba {newer} is newer than .*GEARMBS_COMPILER=own"):
        assert is_plain("", newer)
    with pytest.warns(UserWarning, match="plain mode"):
        assert is_plain("", f"{first + 1}.0")


OWN_STAGES = {"cache", "jit", "library", "objects", *(f"own/{path.stem}" for path in FOLDER.glob("own/[a-z]*.py"))}
"""Modules that the plain mode does not import."""


@pytest.mark.slow
def test_the_plain_mode_names_no_private_part():
    own = {FOLDER / f"{name}.py" for name in OWN_STAGES}
    assert len(own) > 10
    named = {path: parts for path in FOLDER.parent.rglob("*.py") if (parts := named_by(path))}
    assert set(named) == own


@pytest.mark.slow
def test_a_private_part_is_refused(package):
    """The guard of `PROGRAM`, and of all tests in the plain mode, does refuse; numba's own modules may go on."""
    package.write("private", "def ask():\n    from numba.core import types")
    program = """
        from tests import private_parts
        private_parts.refuse(("plainpackage",))
        import numba, plainpackage.private
        plainpackage.private.ask()
    """
    assert "plainpackage.private imports numba.core, a private part of numba" in package.run(program).stderr
