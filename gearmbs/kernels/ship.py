"""Put compiled kernels into a wheel: ``python -m gearmbs.kernels.ship WHEEL``.

The kernels are those of the wheel's own sources, all of them, compiled for `gearmbs.kernels.cache.COMMON`, and the
objects that exported models are linked of. They fit one minor version of Python and of numba, and one system; so the
wheel gets tags of Python and system, and stands beside the one for all. With another numba they are not found, and
kernels are compiled as without them.
"""

from __future__ import annotations

import argparse
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from gearmbs.kernels import cache
from gearmbs.kernels.calls import find

KEPT = ("entry", "part")
"""Machine code, and the LLVM code that kernels of a user's own are linked with; beside these, objects of exports."""

SYSTEM = "manylinux_2_28_x86_64"
"""Kernels call functions of the C library's mathematics, and of numba: its wheels ask for this much, so no less."""


class ShippingError(RuntimeError):
    """A wheel that kernels cannot be put into."""


def ship(wheel: Path, folder: Path, modules: list[str] | None = None, kernels: Path | None = None) -> Path:
    """Write a wheel with compiled kernels beside one without; return its path.

    Parameters
    ----------
    wheel : Path
        A wheel of this package for all systems.
    folder : Path
        Where the new one is written.
    modules : list of str, optional
        Compile what these modules need; by default, all of the package.
    kernels : Path, optional
        A ``NUMBA_CACHE_DIR`` where kernels are kept from one wheel to the next, so that the next compiles what has
        changed alone; what is of other sources is left out. By default one that begins empty.

    Raises
    ------
    ShippingError
        If there is no such wheel, if this machine is not one whose kernels others can use, or if a kernel cannot be
        compiled.
    """
    machine = os.uname() if hasattr(os, "uname") else None
    if machine is None or (machine.sysname, machine.machine) != ("Linux", "x86_64"):
        raise ShippingError("kernels are shipped for Linux on x86-64; run this there")
    if not wheel.is_file():
        raise ShippingError(f"wheel is {str(wheel)!r}; give one that pip wheel has made")
    with tempfile.TemporaryDirectory() as place:
        _run(sys.executable, "-m", "wheel", "unpack", "--dest", place, str(wheel))
        (root,) = Path(place).glob("gearmbs-*")
        kept_in = (kernels or Path(place, "kernels")).absolute()
        files = _compile(root, kept_in, modules, Path(place, "files"))
        along = root / "gearmbs" / "kernels" / cache.SHIPPED.name
        along.mkdir()
        for file in files:
            shutil.copy(kept_in / "gearmbs" / file, along)
        for made in sorted(root.rglob("__pycache__"), reverse=True):
            shutil.rmtree(made)
        _run(sys.executable, "-m", "wheel", "pack", "--dest-dir", place, str(root))
        (packed,) = Path(place).glob("*.whl")
        version = f"cp{sys.version_info.major}{sys.version_info.minor}"
        tags = ("--python-tag", version, "--abi-tag", version, "--platform-tag", SYSTEM)
        name = _run(sys.executable, "-m", "wheel", "tags", "--remove", *tags, str(packed)).strip().splitlines()[-1]
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.move(packed.with_name(Path(name).name), folder / Path(name).name))


def _compile(root: Path, kernels: Path, modules: list[str] | None, told: Path) -> list[str]:
    """Compile kernels of a package that lies in some folder, for the common processor; return the names of their files.

    With all kernels go the objects that exported models are made of.
    """
    name, features = cache.COMMON
    own = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA_", "GEARMBS_"))}
    own |= {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": features, "NUMBA_CACHE_DIR": str(kernels)}
    own |= {"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"}
    steps = [
        "from pathlib import Path",
        "from gearmbs.kernels.ahead import compile_all",
        "from gearmbs.kernels.ship import current",
        f"compile_all(print, {modules!r})",
        "files = current()",
    ]
    if modules is None:
        steps += ["from gearmbs.native.ahead import compile_objects", f"files += compile_objects({name!r}, print)"]
    steps.append(f"Path({str(told)!r}).write_text('\\n'.join(files), encoding='utf-8')")
    _run(sys.executable, "-P", "-c", "\n".join(steps), environment=own, folder=root, shown=True)
    return told.read_text(encoding="utf-8").splitlines()


def current() -> list[str]:
    """Return the names of the files of entries and parts that kernels of this package would be looked for in.

    A file whose kernel is in no module under its name, as one that is made in a function, is taken for current.
    """
    package = __package__.partition(".")[0]
    folder = cache.own_folders(package)[-1]
    found = []
    for kind in KEPT:
        for file in sorted(folder.glob(f"*.{kind}")):
            module, _, name = file.name.rpartition("-")[0].rpartition(".")
            payload = cache._read(file.name, package)
            try:
                kernel = find(f"{package}.{module}", name)
            except ImportError:
                # of a module that is no more
                continue
            if payload is None or (kernel is not None and cache.file_name(kernel, kind, _args(payload)) != file.name):
                continue
            found.append(file.name)
    return found


def _args(payload: tuple) -> tuple:
    """Return the types of arguments for which an entry or part was compiled."""
    told = pickle.loads(payload[-1]) if isinstance(payload[-1], bytes) else payload
    (signature,) = (one for one in told if hasattr(one, "return_type"))
    return tuple(signature.args)


def _run(
    *command: str, environment: dict[str, str] | None = None, folder: Path | None = None, shown: bool = False
) -> str:
    """Run a command and return what it tells, or let it be shown."""
    done = subprocess.run(
        command, stdout=None if shown else subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
        cwd=folder,
    )  # fmt: skip
    if done.returncode:
        raise ShippingError(f"{' '.join(command[1:4])} failed:\n{done.stderr.strip()[-2000:]}")
    return done.stdout or ""


def main(arguments: list[str] | None = None) -> None:
    """Run the command line of this module."""
    parser = argparse.ArgumentParser(
        prog="python -m gearmbs.kernels.ship", description="Put compiled kernels into a wheel."
    )
    parser.add_argument("wheel", type=Path, help="a wheel of gearmbs for all systems")
    parser.add_argument("--out", type=Path, default=Path("dist"), help="folder of the new wheel; default: dist")
    parser.add_argument("--kernels", type=Path, help="a NUMBA_CACHE_DIR, made for the same processor, to ship as well")
    given = parser.parse_args(arguments)
    try:
        made = ship(given.wheel, given.out, kernels=given.kernels)
    except ShippingError as error:
        sys.exit(str(error))
    print(f"{made}: {made.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
