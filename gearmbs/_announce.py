"""Said once, before the first import that compiles: what takes so long. Importing this module is all there is to it."""

from __future__ import annotations

import os
import sys
from pathlib import Path

PACKAGE = Path(__file__).parent


def kernels_missing(package: Path = PACKAGE) -> bool:
    """True if numba's cache beside the sources is in use and holds no contact kernel yet."""
    elsewhere = bool(os.environ.get("NUMBA_CACHE_DIR")) or not os.access(package, os.W_OK)
    return not elsewhere and not any((package / "contact" / "__pycache__").glob("kernel.*.nbi"))


def announce(package: Path = PACKAGE) -> None:
    """Tell on standard error that kernels are about to be compiled, unless they are there or someone else tells."""
    if "GEARMBS_COMPILING" not in os.environ and kernels_missing(package):
        print(
            "gearmbs: compiling the numerical kernels, once; this takes two to five minutes",
            file=sys.stderr,
            flush=True,
        )


announce()
