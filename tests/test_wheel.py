"""What users install, and what is published beside it, holds all it needs: built and tried away from the checkout."""

from __future__ import annotations

import contextlib
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tarfile
import textwrap
import zipfile
from pathlib import Path

import llvmlite.binding
import numpy as np
import pytest

from gearmbs.kernels.cache import NEEDED, folders
from gearmbs.kernels.ship import ship

ROOT = Path(__file__).parent.parent

pytestmark = pytest.mark.slow


def run(*command: str | Path, folder: Path) -> str:
    """Run a command in a folder, with nothing of this checkout on the way; return its output."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PYTEST", "NUMBA_CACHE"))}
    done = subprocess.run(
        [str(c) for c in command], cwd=folder, env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Return a copy of what is checked in: of all that is here what .gitignore does not name."""
    folder = tmp_path_factory.mktemp("source") / "checkout"
    made = shutil.ignore_patterns(".*_cache", ".hypothesis", ".venv*", ".git", "__pycache__", "*.py[co]", "*.egg-info")
    places = {Path(*name.split("/")) for name in ("build", "dist", "out", "docs/_build", "docs/_generated")}
    places.add(Path("benchmarks", "results"))

    def ignored(place: str, names: list[str]) -> set[str]:
        inside = Path(place).relative_to(ROOT)
        return {*made(place, names), *(name for name in names if inside / name in places)}

    shutil.copytree(ROOT, folder, ignore=ignored)
    return folder


@pytest.fixture(scope="module")
def wheel(source):
    """Build the wheel from a copy of the sources."""
    command = ("-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir")
    run(sys.executable, *command, source.parent / "dist", source, folder=source)
    return next((source.parent / "dist").glob("gearmbs-*.whl"))


@pytest.fixture(scope="module")
def sdist(source):
    """Build the sdist from a copy of the sources."""
    build = "from setuptools import build_meta; build_meta.build_sdist('../dist')"
    run(sys.executable, "-c", build, folder=source)
    return next((source.parent / "dist").glob("gearmbs-*.tar.gz"))


def put_kernels(folder: Path) -> None:
    """Copy the compiled kernels that are at hand: found by what they are made of, they serve there as well."""
    place = folder / "gearmbs" / "__pycache__" / "kernels"
    place.mkdir(parents=True)
    for kept in folders("gearmbs"):
        # another process may be at work there: files with these endings are whole, or removed
        for file in [*kept.glob("*.entry"), *kept.glob("*.part")]:
            with contextlib.suppress(FileNotFoundError):
                shutil.copy(file, place)


def installed(wheel: Path, folder: Path) -> tuple[Path, Path]:
    """Make an environment with a wheel in it; return its Python, and where its packages are."""
    run(sys.executable, "-m", "venv", "--without-pip", folder / "venv", folder=folder)
    python = folder / "venv" / "bin" / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps", wheel, folder=folder)
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", folder=folder).strip())
    (site / "dependencies.pth").write_text("".join(f"{p}\n" for p in sys.path if p.endswith("site-packages")))
    return python, site


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory):
    """Install the wheel alone; what it depends on is taken from the environment of the tests."""
    folder = tmp_path_factory.mktemp("installed")
    python, site = installed(wheel, folder)
    put_kernels(site)
    assert run(python, "-c", "import gearmbs; print(gearmbs.__file__)", folder=folder).startswith(str(site))
    return folder


def test_holds_every_file(wheel):
    """Whatever lies beside the sources and is no source is package data."""
    files = {p.relative_to(ROOT).as_posix() for p in (ROOT / "gearmbs").rglob("*") if p.is_file()}
    wanted = {f for f in files if "__pycache__" not in f}
    assert wanted <= set(zipfile.ZipFile(wheel).namelist())
    assert any(f.endswith("viewer3d.js") for f in wanted)
    assert "gearmbs/py.typed" in wanted


def test_the_sdist_holds_what_is_checked_in(source, sdist):
    """Tests, documentation, benchmarks, changelog and Makefile beside the package; nothing that is made of them."""
    held = {name.partition("/")[2] for name in tarfile.open(sdist).getnames()}
    made = {"PKG-INFO", "setup.cfg"}
    files = {p.relative_to(source).as_posix() for p in source.rglob("*") if p.is_file()}
    own = (".git/", ".gitignore", "build/")
    checked_in = {f for f in files if ".egg-info" not in f and f != ".git" and not f.startswith(own)}
    assert {"CHANGELOG.md", "Makefile", "docs/conf.py", "tests/conftest.py", "benchmarks/__main__.py"} <= checked_in
    assert checked_in <= held
    assert {f for f in held - checked_in - made if "." in Path(f).name and ".egg-info" not in f} <= {".ci", ".github"}


def test_the_sdist_passes_from_itself(sdist, environment, tmp_path):
    """Unpacked, with nothing of the checkout on the way: tests of imports, of pages and of stored results."""
    with tarfile.open(sdist) as opened:
        opened.extractall(tmp_path, filter="data")
    place = tmp_path / sdist.name.removesuffix(".tar.gz")
    python = environment / "venv" / "bin" / "python"
    told = run(python, "-c", "import gearmbs; print(gearmbs.__file__)", folder=place)
    assert told.startswith(str(place))
    # none that compiles kernels; .ci/matrix runs the quick subset so
    tests = ("tests/test_architecture.py", "tests/docs/test_pages.py", "tests/benchmarks/test_stored.py")
    quick = ("-m", "not slow", "-k", "not examples", "-p", "no:cacheprovider")
    told = run(python, "-m", "pytest", *quick, *tests, folder=place)
    assert re.search(r"\d{3} passed", told)


def test_every_command(environment):
    """The script is installed, and every command of it can tell what it does."""
    script = environment / "venv" / "bin" / "gearmbs"
    listed = "from gearmbs.cli import app; print(*(c.name or c.callback.__name__ for c in app.registered_commands))"
    commands = run(script.with_name("python"), "-c", listed, folder=environment).replace("_", "-").split()
    assert {"paper", "run", "analyse", "compare", "adams"} <= set(commands)
    assert run(script, "--version", folder=environment).startswith("gearmbs ")
    for command in commands:
        assert "--help" in run(script, command, "--help", folder=environment)


def test_every_module(environment):
    """All modules can be imported but those of extras."""
    code = """
        import importlib, pkgutil, gearmbs
        for info in pkgutil.walk_packages(gearmbs.__path__, "gearmbs."):
            if not info.name.endswith("__main__"):
                importlib.import_module(info.name)
    """
    run(environment / "venv" / "bin" / "python", "-c", textwrap.dedent(code), folder=environment)


def test_simulates_and_shows(environment):
    """A pendulum, its scene as a page, a figure, and the animation of a mesh."""
    code = """
        import gearmbs as gm

        mechanism = gm.Mechanism()
        arm = mechanism.body("arm", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0))
        mechanism.revolute("pin", arm, mechanism.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))
        solution = mechanism.simulate(0.1, rate=100.0)
        assert solution.success
        gm.mechanism_scene(mechanism).save_html("pendulum.html")
        gm.solution_scene(solution).save_html("swing.html")
        gm.mesh_animation(gm.GearPair.paper()).save("mesh.html")
        gm.gear_scene(gm.GearPair.paper()).save_html("wheel.html")
    """
    run(environment / "venv" / "bin" / "python", "-c", textwrap.dedent(code), folder=environment)
    for page in ("pendulum", "swing", "mesh", "wheel"):
        assert (environment / f"{page}.html").stat().st_size > 10_000


ROTATION = """
    import json
    import numpy as np
    from gearmbs.dae.equations.rotation import REFERENCE_IDENTITY, rotation_matrix
    from gearmbs.kernels import cache
    matrix = np.zeros(9)
    rotation_matrix(0.1, 0.2, 0.3, REFERENCE_IDENTITY, matrix, 0)
    print(json.dumps([cache.target()[0], matrix.tolist()]))
"""
"""Calls one kernel; tells for which processor kernels are, and what came out."""


STALE = ("dae.equations.rotation.rotation_matrix-0a.entry", "dae.no_more.kernel-0b.part")
"""Kernels that cannot be read, or of a module that is no more, in a folder that is kept from one wheel to the next."""


@pytest.fixture(scope="module")
def with_kernels(wheel, tmp_path_factory):
    """Put the kernels of one module into the wheel, and install that."""
    folder = tmp_path_factory.mktemp("shipped")
    kept = folder / "kernels" / "gearmbs"
    kept.mkdir(parents=True)
    for name in STALE:
        (kept / name).write_bytes(b"of other sources")
    made = ship(wheel, folder / "dist", ["gearmbs.dae.equations.rotation"], folder / "kernels")
    python, site = installed(made, folder)
    return made, python, site / "gearmbs" / "kernels" / "shipped"


@pytest.mark.skipif(platform.system() != "Linux" or platform.machine() != "x86_64", reason="POSIX: kernels are shipped")
def test_a_wheel_with_kernels_compiles_nothing(with_kernels, tmp_path, monkeypatch):
    """It is for one Python and one system; an empty home finds its kernels; who names a processor gets that one's."""
    made, python, along = with_kernels
    assert not {path.name for path in along.iterdir()} & set(STALE)
    version = f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert made.name.endswith(f"-{version}-{version}-manylinux_2_28_x86_64.whl")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    for chosen in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.delenv(chosen, raising=False)

    kept: set[Path] = set()

    def called() -> tuple[bool, str, list[float]]:
        """Return whether the kernel was compiled, for which processor it is, and its result."""
        told = json.loads(run(python, "-c", textwrap.dedent(ROTATION), folder=tmp_path))
        new = set((tmp_path / "home").rglob("*rotation_matrix*.entry")) - kept
        kept.update(new)
        return bool(new), *told

    has = llvmlite.binding.get_host_cpu_features()
    fits = all(has.get(name) for name in NEEDED)
    compiled, processor, found = called()
    assert (not compiled, processor == "x86-64-v3") == (fits, fits)
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    compiled, processor, again = called()
    assert (compiled, processor) == (True, "generic")
    assert np.allclose(found, again, rtol=0.0, atol=1e-15)
    # what cannot be read is compiled for this machine, and kept in the home
    monkeypatch.delenv("NUMBA_CPU_NAME")
    for file in along.glob("*rotation_matrix*.entry"):
        file.write_bytes(b"cut")
    compiled, _, again = called()
    assert compiled == fits
    assert not called()[0]
    assert np.allclose(found, again, rtol=0.0, atol=1e-15)
