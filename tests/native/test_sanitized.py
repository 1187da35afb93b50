"""The part in C under the sanitizers of addresses and of undefined behaviour: library, FMI 2.0 and FMI 3.0."""

import shutil
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree as xml

import pytest

import gearmbs as gm
from gearmbs.native import export
from gearmbs.native.fmu import ABILITIES

COMPILER = shutil.which("gcc") or shutil.which("cc")
WATCHED = "-g -O1 -fsanitize=address,undefined -fno-sanitize-recover=all"
WALKS = {"so": 0, "fmu2": 2, "fmu3": 3}
END = 0.5


def _has_sanitizers(folder):
    """Whether there is a compiler whose programs find what they should: a byte behind the end of memory."""
    if COMPILER is None:
        return False
    program = folder / "beyond"
    text = (
        "#include <stdlib.h>\nint main(int n, char **a) {\n"
        "(void)a; volatile char *p = malloc(n); p[n] = 1; free((void *)p); return 0; }"
    )
    made = subprocess.run(
        [COMPILER, *WATCHED.split(), "-x", "c", "-", "-o", program], input=text, text=True, capture_output=True
    )
    return made.returncode == 0 and b"heap-buffer-overflow" in subprocess.run([program], capture_output=True).stderr


@pytest.fixture(scope="module")
def compiler(tmp_path_factory):
    """A compiler that builds for sanitizers whatever it is asked for."""
    folder = tmp_path_factory.mktemp("compiler")
    if not _has_sanitizers(folder):
        pytest.skip("no compiler with sanitizers is installed")
    command = folder / "watched"
    command.write_text(f'#!/bin/sh\nexec {COMPILER} {WATCHED} "$@"\n')
    command.chmod(0o755)
    return command


def driven():
    """A torque, a speed that is prescribed, and outputs of all kinds: each part in C has something to do."""
    m = gm.Mechanism("driven")
    for name in ("disc", "wheel"):
        body = m.body(name, mass=1.0, inertia=(2.0, 2.0, 2.0))
        m.revolute(f"{name} pin", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", m.bodies["disc"], m.input("load", "N m", 4.0))
    m.rotation("turning", m.joints["wheel pin"], m.input("rate", "rad/s", 1.0), level="velocity")
    m.output("speed", ("angular_velocity", "disc", "z"))
    m.output("angle", ("joint_angle", "disc pin"))
    m.output("way", 'AZ("wheel pin.I", "wheel pin.J") + WDTZ("disc pin.I")')
    return m


@pytest.mark.slow
@pytest.mark.parametrize("target", WALKS)
def test_nothing_is_found(target, compiler, tmp_path):
    made = export(driven(), tmp_path, t_end=END, target=target, name="watched", compiler=str(compiler))
    library, token = made.library, ""
    if target != "so":
        with zipfile.ZipFile(made.library) as archive:
            head = xml.fromstring(archive.read("modelDescription.xml"))
            inside = next(name for name in archive.namelist() if name.endswith(".so"))
            library = Path(archive.extract(inside, tmp_path))
        token = head.get("guid") or head.get("instantiationToken")
        assert head.find("CoSimulation").attrib.items() >= ABILITIES[head.get("fmiVersion")].items()
    told = [f"-DWALK={WALKS[target]}", f'-DTOKEN="{token}"', f"-DNUMBERS={len(made.numbers)}", f"-DEND={END}"]
    program = tmp_path / "walk"
    command = [compiler, "-Wall", "-Wextra", "-Werror", *told, Path(__file__).with_name("walk.c"), library]
    subprocess.run([*command, f"-I{tmp_path}", "-o", program, f"-Wl,-rpath,{library.parent}"], check=True)
    done = subprocess.run([program], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
