"""Holds that pages call no kernels but those that a wheel with kernels brings along.

Each page's process notes the kernels that it calls (`note`, from the startup file that ``conf.py`` writes), beside the
executed pages; the end of the build reads the notes.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

NOTES = "GEARMBS_ASKED_KERNELS"
"""Environment variable with the file of notes."""

STARTUP = "import asked_kernels\n\nasked_kernels.note()\ndel asked_kernels\n"
"""What a page's process runs first, from a file of another name than this one's: its folder comes first there."""


def note() -> None:
    """Let kernels of the package that Python calls be noted, with their types, when they are compiled or loaded."""
    from gearmbs.kernels import PLAIN

    file = os.environ.get(NOTES)
    if PLAIN or not file:
        return
    from numba.core import sigutils

    from gearmbs.kernels.jit import Kernel
    from gearmbs.kernels.kinds import numba_of

    compiled = Kernel.compile

    def noted(kernel, signature):
        if kernel.__module__.startswith("gearmbs."):
            open_to = sigutils.normalize_signature(numba_of(signature)) if kernel.declared is None else None
            types = ", ".join(map(str, (open_to or kernel.declared_types())[0]))
            with open(file, "a", encoding="utf-8") as notes:
                notes.write(f"{kernel.__module__}:{kernel.__name__}\t{types}\n")
        return compiled(kernel, signature)

    Kernel.compile = noted


def unlisted(notes: str) -> list[str]:
    """Return what was noted and is compiled neither by its declared signature nor by the list, a line each."""
    from gearmbs.kernels.calls import address, entries, import_all, kernel_modules, kernels, texts

    import_all()
    known = entries(kernels(kernel_modules()))
    declared = {(address(k), ", ".join(map(str, k.declared_types()[0]))) for k in known}
    found = {tuple(line.split("\t")) for line in notes.splitlines()}
    return [f"{kernel} ({types})" for kernel, types in sorted(found - texts() - declared)]


def check(app, exception) -> None:
    """Refuse a build whose pages have called kernels that are not listed.

    They are compared in a process of its own: in that of the build kernels stand as the functions that they document.

    Raises
    ------
    RuntimeError
        With their names and types.
    """
    file = Path(os.environ.get(NOTES, ""))
    if exception is not None or not file.is_file():
        return
    told = subprocess.run([sys.executable, __file__, str(file)], capture_output=True, text=True, encoding="utf-8")
    if told.returncode:
        raise RuntimeError(f"gearmbs/kernels/calls.py: {told.stdout or told.stderr}")


if __name__ == "__main__":
    if lines := unlisted(Path(sys.argv[1]).read_text(encoding="utf-8")):
        sys.exit(print(f"pages call kernels that are not listed: {'; '.join(lines)}") or 1)
