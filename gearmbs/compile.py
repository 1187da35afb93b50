"""Compile the numba kernels ahead of use: ``python -m gearmbs.compile``.

The kernels are compiled on first import and cached on disk. This does it at once, independent rooms side by
side, so that a fresh machine waits for the longest chain only.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

PACKAGE = Path(__file__).parent


def force_kernels() -> tuple[str, ...]:
    """Return the modules with kernels of force elements, which end in ``_kernel``."""
    files = sorted(PACKAGE.glob("[a-z]*/**/*_kernel.py"))
    return tuple(".".join(("gearmbs", *file.relative_to(PACKAGE).with_suffix("").parts)) for file in files)


STAGES = (
    ("gearmbs.gears.transmission", "gearmbs.dae.equations.expressions.evaluate", "gearmbs.dae.integrators.wstiff"),
    ("gearmbs.dae.equations.jacobian", "gearmbs.dae.equations.residual", *force_kernels()),
    ("gearmbs.dae.model.evaluator", "gearmbs.dae.equations.euler_switch"),
    ("gearmbs.studies.paper", "gearmbs.signals", "gearmbs.mechanism.measures", "gearmbs.dae.model.members"),
)
"""Modules whose kernels do not depend on each other within a stage."""


def compile_all(report=None) -> float:
    """Compile and cache every kernel; return the seconds it took.

    Parameters
    ----------
    report : callable, optional
        Called with a line of text as each stage begins.

    Raises
    ------
    RuntimeError
        If a module cannot be imported; with its traceback.
    """
    start = time.perf_counter()
    environment = {**os.environ, "GEARMBS_COMPILING": "1"}
    for stage in STAGES:
        if report is not None:
            report("compiling " + ", ".join(stage))
        running = [
            subprocess.Popen([sys.executable, "-c", f"import {module}"], env=environment, stderr=subprocess.PIPE)
            for module in stage
        ]
        for module, process in zip(stage, running):
            _, error = process.communicate()
            if process.returncode:
                raise RuntimeError(f"{module} could not be compiled:\n{error.decode(errors='replace')}")
    return time.perf_counter() - start


if __name__ == "__main__":
    seconds = compile_all(print)
    print(f"kernels ready after {seconds:.1f} s")
