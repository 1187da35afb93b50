"""What a result depends on besides the program: the machine, the versions, and a stamp of the sources."""

from __future__ import annotations

import hashlib
import os
import platform
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "scikit-sundae", "solve-dae", "assimulo-testing", "exudyn")
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def version_of(package: str) -> str | None:
    """Return the installed version of a distribution, or None."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def processor() -> str:
    """Return the name of the processor."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def describe() -> dict:
    """Return machine, versions and thread settings, as they go into each result."""
    return {
        "processor": processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "gearmbs": version_of("gearmbs") or "not installed",
        "packages": {name: version_of(name) or "not installed" for name in PACKAGES},
        "threads": {name: os.environ.get(name, "not set") for name in THREAD_VARIABLES},
        "load_average": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
    }


def stamp(settings: str) -> str:
    """Return a hash of the sources, versions, processor and ``settings``: equal stamps mean comparable results."""
    digest = hashlib.sha1(usedforsecurity=False)
    for folder in ("gearmbs", "benchmarks"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            digest.update(str(path.relative_to(ROOT)).encode())
            digest.update(path.read_bytes())
    facts = describe()
    digest.update(repr((facts["processor"], facts["python"], facts["packages"], facts["threads"], settings)).encode())
    return digest.hexdigest()[:16]
