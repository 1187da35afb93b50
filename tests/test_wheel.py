"""The wheel that users install holds all it needs: built, installed into an empty environment, tried away from here."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import textwrap
import zipfile
from pathlib import Path

import pytest

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
def wheel(tmp_path_factory):
    """Build the wheel from a copy of the sources."""
    folder = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    shutil.copytree(ROOT / "gearmbs", folder / "gearmbs", ignore=shutil.ignore_patterns("__pycache__"))
    command = (
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--wheel-dir",
        folder / "dist",
        folder,
    )
    run(sys.executable, *command, folder=folder)
    return next((folder / "dist").glob("gearmbs-*.whl"))


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory):
    """Install the wheel alone; what it depends on is taken from the environment of the tests."""
    folder = tmp_path_factory.mktemp("installed")
    run(sys.executable, "-m", "venv", "--without-pip", folder / "venv", folder=folder)
    python = folder / "venv" / "bin" / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps", wheel, folder=folder)
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", folder=folder).strip())
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    # kernels are found by what they are made of, so that those of the checkout serve as well
    compiled = ROOT / "gearmbs" / "__pycache__" / "kernels"
    if compiled.is_dir():
        shutil.copytree(compiled, site / "gearmbs" / "__pycache__" / "kernels")
    assert run(python, "-c", "import gearmbs; print(gearmbs.__file__)", folder=folder).startswith(str(site))
    return folder


def test_holds_every_file(wheel):
    """Whatever lies beside the sources and is no source is package data."""
    files = {p.relative_to(ROOT).as_posix() for p in (ROOT / "gearmbs").rglob("*") if p.is_file()}
    wanted = {f for f in files if "__pycache__" not in f}
    assert wanted <= set(zipfile.ZipFile(wheel).namelist())
    assert any(f.endswith("viewer3d.js") for f in wanted)
    assert "gearmbs/py.typed" in wanted


def test_every_command(environment):
    """The script is installed, and every command of it can tell what it does."""
    script = environment / "venv" / "bin" / "gearmbs"
    listed = "from gearmbs.cli import app; print(*(c.name or c.callback.__name__ for c in app.registered_commands))"
    commands = run(script.with_name("python"), "-c", listed, folder=environment).split()
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
