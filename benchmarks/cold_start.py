"""What a start costs: processor time of fresh processes with compiled kernels, and of compiling them.

``python -m benchmarks.cold_start [CHECKOUT ...]`` times this checkout and others given, in turns, and prints the
least and the median of each. ``--compile`` also times compilation into empty folders, which takes minutes.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

TASKS = {
    "import numba": "import numba",
    "import gearmbs": "import gearmbs",
    "Case, run_case": "from gearmbs.studies import Case, run_case",
    "gearmbs --help": "import sys; sys.argv = ['gearmbs', '--help']; from gearmbs.cli import app; app()",
    "pair, 0.3 s": (
        "from gearmbs.studies import make_case, run_case; "
        "run_case(make_case({'operation': {'duration': '0.3 s', 'settling': '0 s'}}))"
    ),
}

PENDULUM = (
    "from gearmbs.mechanism import Mechanism; m = Mechanism(); "
    "b = m.body('rod', mass=1.0, inertia=(0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0)); "
    "m.revolute('pin', b, m.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0)); m.simulate(0.1, rate=100.0)"
)
COMPILED = {
    "first pendulum": ("-c", PENDULUM),
    "first pair": ("-c", TASKS["pair, 0.3 s"]),
    "all": ("-m", "gearmbs.compile"),
}


def seconds(command: tuple[str, ...], checkout: Path, **environment: str) -> float:
    """Return the processor time of a process and its children."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    surroundings = {**os.environ, "PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1", **environment}
    # an installed package has its byte code
    surroundings.pop("PYTHONDONTWRITEBYTECODE", None)
    subprocess.run([sys.executable, *command], env=surroundings, cwd=checkout, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cold_start", description=__doc__)
    parser.add_argument("checkouts", nargs="*", type=Path, help="other checkouts, compared with this one")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--compile", action="store_true")
    given = parser.parse_args(arguments)
    checkouts = [Path(__file__).parent.parent, *(path.resolve() for path in given.checkouts)]
    print(f"{'processor time, s (least, median)':<34}" + "".join(f"{str(path)[-20:]:>22}" for path in checkouts))
    for name, code in TASKS.items():
        times: list[list[float]] = [[] for _ in checkouts]
        for path in checkouts:
            seconds(("-c", code), path)
        for _ in range(given.repeats):
            for path, found in zip(checkouts, times):
                found.append(seconds(("-c", code), path))
        print(f"{name:<34}" + "".join(f"{min(t):12.2f}{statistics.median(t):10.2f}" for t in times), flush=True)
    if given.compile:
        for name, command in COMPILED.items():
            times = []
            for path in checkouts:
                with tempfile.TemporaryDirectory() as folder:
                    times.append([seconds(command, path, NUMBA_CACHE_DIR=folder)])
            print(f"{'compile: ' + name:<34}" + "".join(f"{t[0]:12.1f}{'':10}" for t in times), flush=True)


if __name__ == "__main__":
    main()
