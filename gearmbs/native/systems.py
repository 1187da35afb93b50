"""For which systems models are exported, and what links them there."""

from __future__ import annotations

import platform
import shutil
import sys
from typing import NamedTuple

from gearmbs.dae.problem import ModelError
from gearmbs.wording import any_of, did_you_mean

PORTABLE = {"x86_64": "x86-64-v3", "AMD64": "x86-64-v3"}
"""Processors that libraries are made for, by the kind of machine: those of the last ten years, with fused products."""
COMPILERS = (("cc",), ("gcc",), ("clang",))
OWN_FLAGS = ("-fPIC", "-Wl,-z,defs")
"""What systems other than Windows are asked for: code for any address, nothing left undefined."""


class System(NamedTuple):
    """A system that libraries are made for.

    Attributes
    ----------
    triple : str
        What LLVM calls it; empty for the one this is.
    zig : str
        What the compiler of the package ziglang calls it.
    cross : str
        A GNU compiler for it.
    processor : str
        Of its libraries unless another is named.
    ending : str
        Of the name of a library.
    folders : tuple of str
        Of its binaries in FMUs of FMI 2.0, which knows no other, and 3.0.
    flags : tuple of str
        Of the compiler.
    """

    triple: str
    zig: str
    cross: str
    processor: str
    ending: str
    folders: tuple[str, str]
    flags: tuple[str, ...]


SYSTEMS = {
    "linux": System("", "", "", "", ".so", ("linux64", "x86_64-linux"), OWN_FLAGS),
    "windows": System(
        "x86_64-w64-windows-gnu", "x86_64-windows-gnu", "x86_64-w64-mingw32-gcc", "x86-64-v3", ".dll",
        ("win64", "x86_64-windows"), (),
    ),
    "linux-arm64": System(
        "aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.28", "aarch64-linux-gnu-gcc", "generic", ".so",
        ("", "aarch64-linux"), OWN_FLAGS,
    ),
}  # fmt: skip
"""By the names under which they are asked for; the first is the one this is."""


def system_of(name: str) -> System:
    """Return a system by its name.

    Raises
    ------
    ModelError
        If there is none.
    """
    if name not in SYSTEMS:
        meant = did_you_mean(name, SYSTEMS, otherwise=f"choose {any_of(list(SYSTEMS))}")
        raise ModelError(f"systems: there is no {name!r}; {meant}")
    found = SYSTEMS[name]
    if not found.triple:
        return found._replace(processor=PORTABLE.get(platform.machine(), "native"))
    return found


NATIVE = "native"
"""Stands for the processor of this machine."""
LEVELS = {"x86_64": ("x86-64", "x86-64-v2", "x86-64-v3", "x86-64-v4"), "aarch64": ("generic", "cortex-a72")}
"""Processors that messages name, by the kind of machine."""


def processors_of(system: System) -> list[str]:
    """Return the names that LLVM has for processors of a system's kind, those of others of its family among them."""
    from gearmbs.kernels.objects import processors

    return processors(system.triple)


def check_processor(name: str, system: System) -> None:
    """Raise a ModelError if a system has no processor of a name."""
    machine = system.triple.partition("-")[0] or platform.machine()
    usual = LEVELS.get(machine, ())
    if name in (NATIVE, *usual):
        return
    from gearmbs.kernels.objects import is_processor

    if not is_processor(system.triple, name):
        known = [one for one in (NATIVE, *usual, *processors_of(system)) if one != name]
        meant = did_you_mean(name, known, otherwise=f"choose {any_of(list(dict.fromkeys(known)))}", count=3)
        raise ModelError(f"processor = {name!r}: {machine} has none of this name that it runs on; {meant}")


def c_compiler(given: str | None, system: System = SYSTEMS["linux"]) -> list[str]:
    """Return the command of a C compiler.

    Raises
    ------
    ModelError
        If there is none.
    """
    own = COMPILERS if not system.triple else ((system.cross,),)
    for command in own if given is None else ((given,),):
        if shutil.which(command[0]) is not None:
            return list(command)
    if given is None:
        try:
            import ziglang  # noqa: F401

            zig = [sys.executable, "-m", "ziglang", "cc"]
            return [*zig, "-target", system.zig] if system.zig else zig
        except ImportError:
            pass
    tried = given or ", ".join(command[0] for command in own)
    remedy = "gcc or clang" if not system.triple else "a compiler for that system"
    raise ModelError(
        f"compiler: {tried} was not found; install {remedy}, or the package ziglang (pip install 'gearmbs[link]')"
    )
