"""Objects and libraries for other systems than this one."""

import platform
import shutil
import subprocess
import zipfile

import numba
import numpy as np
import pytest

import gearmbs as gm
from gearmbs.kernels.objects import compiled_object, object_of_function
from gearmbs.kernels.pointers import no_hook
from gearmbs.mechanism import ModelError
from gearmbs.native import export
from gearmbs.native.systems import SYSTEMS, c_compiler, system_of
from tests.says import says

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(platform.system() != "Linux" or platform.machine() != "x86_64", reason="POSIX: made on Linux"),
]
MACHINES = {"windows": (0, 0x8664), "linux-arm64": (18, 183)}
"""Where objects tell the kind of processor, and which: COFF's machine, ELF's e_machine."""


def machine_of(code, system):
    at, _ = MACHINES[system]
    return int.from_bytes(code[at : at + 2], "little")


@numba.njit
def with_arrays(n):
    held = np.zeros(n)
    for k in range(n):
        held[k] = np.sqrt(k)
    return held.sum()


@pytest.mark.parametrize("system", MACHINES)
def test_objects_are_of_the_system_that_is_asked_for(system):
    """Of kernels, and of functions with arrays, whose references are counted by an instruction of this processor."""
    one, wanted = system_of(system), MACHINES[system][1]
    kernel = compiled_object(no_hook, one.processor, triple=one.triple)
    own = object_of_function(with_arrays, one.processor, numba.float64(numba.int64), "0", one.triple)
    assert machine_of(kernel.code, system) == machine_of(own.code, system) == wanted
    assert kernel.symbol.encode() in kernel.code


def test_systems_are_told_by_name(tmp_path, monkeypatch):
    m = disc()
    with pytest.raises(ModelError, match=says("systems", "macos", "linux-arm64")):
        export(m, tmp_path, t_end=1.0, systems=["macos"])
    with pytest.raises(ModelError, match=says("systems", "fmu2", "windows")):
        export(m, tmp_path, t_end=1.0, target="fmu2", systems=["linux", "linux-arm64"])
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setitem(__import__("sys").modules, "ziglang", None)
    with pytest.raises(ModelError, match=says("compiler", "x86_64-w64-mingw32-gcc", "ziglang")):
        c_compiler(None, SYSTEMS["windows"])


def disc():
    m = gm.Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", body, m.input("load", "N m", 1.0))
    m.output("speed", ("angular_velocity", "disc", "z"))
    return m


def test_one_fmu_for_all_systems(tmp_path):
    """Linked by the compiler of ziglang, which knows them; run where Wine or QEMU are: 2 w' = 1."""
    pytest.importorskip("ziglang")
    made = export(disc(), tmp_path, t_end=10.0, target="fmu3", systems=list(SYSTEMS))
    names = zipfile.ZipFile(made.library).namelist()
    folders = [f"binaries/{one.folders[1]}/disc{one.ending}" for one in SYSTEMS.values()]
    assert sorted(names) == sorted(["modelDescription.xml", *folders])
    assert set(made.libraries.values()) == {made.library}
    made = export(disc(), tmp_path, t_end=10.0, systems=list(SYSTEMS))
    assert [path.name for path in made.libraries.values()] == ["disc.so", "disc.dll", "disc.linux-arm64.so"]
    run_by = {"linux": [], "windows": ["wine"], "linux-arm64": ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"]}
    for name, library in made.libraries.items():
        program = tmp_path / f"example_{name}.exe"
        command = [*c_compiler(None, SYSTEMS[name]), "example.c", library.name, "-o", program.name]
        rpath = [] if name == "windows" else ["-Wl,-rpath,."]
        subprocess.run([*command, *rpath], cwd=tmp_path, check=True)
        if run_by[name] and shutil.which(run_by[name][0]) is None:
            continue
        told = subprocess.run([*run_by[name], f"./{program.name}"], cwd=tmp_path, check=True, capture_output=True)
        t, speed, unit = told.stdout.decode().splitlines()[-1].split()
        assert (float(t), unit) == (10.0, "rad/s")
        assert float(speed) == pytest.approx(5.0, rel=1e-6)
