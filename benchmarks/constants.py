"""What halving and doubling the constants of the integrators changes: steps, residuals and errors of short problems.

    python -m benchmarks.constants --write docs/data/integrator_constants.txt

Compiled code holds the values of constants, so that each value has a process of its own. It reads the module with the
other value in place of the constant's, and compiles what depends on it; kernels that a value leaves as they are serve
the next one. All of them take twenty minutes of one core, most of them for compilation.
"""

from __future__ import annotations

import argparse
import ast
import importlib.machinery
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

from benchmarks.markdown import table

PACKAGE = "gearmbs.dae.integrators"
FOLDER = Path(__file__).parents[1] / "gearmbs" / "dae" / "integrators"
MODULES = ("bdf", "controller", "corrector", "driver", "initial_state", "newton_matrix", "restart", "step")
"""Those that choose steps, orders and when a corrector ends; what the others hold is rounding, or tells failures."""
LEFT_OUT = {
    "corrector": {"HELD", "ROUNDED_TERMS", "SETTLED_RATE", "GOLDEN_FRACTION"},
    "controller": {"START_TARGET", "START_GROWTH", "UNFORESEEN"},
    "driver": {
        *("LEAST_DIGITS", "HOPELESS_DIGITS", "UNSATISFIED"),
        # of runs that get nowhere
        *("HOPELESS", "REFUSED", "LONG", "TOLERANCES_A_STEP"),
    },
    "initial_state": {"FIRST_MOVE", "FIRST_TRIED", "CHECK_RATIO", "LARGE_GAMMA"},
    "newton_matrix": {"PLANNED_RANGE", "LEAP"},
    "restart": {"FIRST_TARGET", "SETTLED", "BLOCK_ERROR", "SHORT_OF_STOP"},
    "step": {"FORESEEN", "LANDED"},
}
"""Constants of these modules that what is said of them fixes."""
FACTORS = (0.5, 2.0)


@dataclass(frozen=True)
class Constant:
    """A float constant of a module of the integrators."""

    module: str
    name: str
    value: float


def constants() -> list[Constant]:
    """Return the float constants of these modules that are tried, in the order of lines."""
    found = []
    for module in MODULES:
        for node in ast.parse((FOLDER / f"{module}.py").read_text(encoding="utf-8")).body:
            match node:
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Constant(value=float(value))):
                    if name not in LEFT_OUT.get(module, ()):
                        found.append(Constant(module, name, value))
    return found


class _Changed(importlib.machinery.SourceFileLoader):
    """Loads a module with another value of one of its constants."""

    def __init__(self, fullname: str, path: str, name: str, value: float) -> None:
        super().__init__(fullname, path)
        self.constant, self.value = name, value

    def get_code(self, fullname: str) -> Any:
        path = self.get_filename(fullname)
        tree = ast.parse(Path(path).read_text(encoding="utf-8"))
        for node in tree.body:
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == self.constant:
                node.value = ast.copy_location(ast.Constant(self.value), node.value)
        return compile(tree, path, "exec")


class _Finder:
    """Finds that module in place of the one on disk."""

    def __init__(self, module: str, name: str, value: float) -> None:
        self.module, self.name, self.value = f"{PACKAGE}.{module}", name, value

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> Any:
        if fullname != self.module:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path)
        assert spec is not None
        assert spec.origin is not None
        spec.loader = _Changed(fullname, spec.origin, self.name, self.value)
        return spec


# The problems: a few hundred steps each, of all that the integrators are made for. They import the integrators only
# when they are called, after the constant has been changed.


def _robertson() -> tuple[Any, float]:
    """Stiff, eleven decades of time, index one; Jacobian by differences."""
    from benchmarks.problems.stiff import robertson
    from gearmbs.dae.solve import solve_dae

    p, rtol = robertson(), 1e-6
    span = 0.0, p.t_end
    result = solve_dae(p.fun, span, p.y0, rtol=rtol, atol=rtol * p.atol, t_eval=np.array(span))
    return result, p.error(result.y[-1])


def _andrews() -> tuple[Any, float]:
    """Seven bodies, fast, with multipliers and an exact Jacobian."""
    from benchmarks.problems.andrews import andrews
    from benchmarks.problems.reference import ANDREWS_END as END
    from gearmbs.dae.integrators.wstiff import solve_wstiff

    result = solve_wstiff(andrews().problem("SI2"), np.array([0.0, 0.03]), tol=1e-7)
    return result, float(np.max(np.abs(result.y[-1, : END.size] - END) / np.maximum(1.0, np.abs(END))))


def _chain() -> tuple[Any, float]:
    """Through singular positions, where rounding limits the steps."""
    from benchmarks.problems.reference import chain_problem
    from gearmbs.dae.integrators.wstiff import solve_wstiff

    p = chain_problem(3, 2.0)
    result = solve_wstiff(p.make("SI2"), p.times, tol=1e-7)
    return result, p.error(result.t, result.y)


@njit(cache=True)
def _push(height, speed):
    """IMPACT with 1e5 N/m^1.5 and 50 N s/m over 0.1 mm."""
    depth = max(-height, 0.0)
    part = min(depth / 1e-4, 1.0)
    return max(1e5 * depth**1.5 - 50.0 * speed * part * part * (3.0 - 2.0 * part), 0.0) if depth > 0.0 else 0.0


@njit(cache=True)
def _ball(t, y, yp, out):
    """Ball of 1 kg above a belt at 1 m/s; friction 0.3, reached over 10 mm/s."""
    push = _push(y[1], y[3])
    out[0] = yp[0] - y[2]
    out[1] = yp[1] - y[3]
    out[2] = yp[2] - 0.3 * push * np.tanh((1.0 - y[2]) / 0.01)
    out[3] = yp[3] - push + 9.81


def _bouncing() -> tuple[Any, float]:
    """Contacts and friction, whose derivatives jump."""
    from gearmbs.dae.solve import solve_dae

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        out = np.empty(4)
        _ball(t, y, np.zeros(4), out)
        return -out

    span, start = (0.0, 0.6), np.array([0.0, 0.05, 0.0, 0.0])
    exact = solve_ivp(rates, span, start, method="DOP853", rtol=1e-12, atol=1e-13, max_step=1e-3).y[:, -1]
    result = solve_dae(_ball, span, start, rtol=1e-7, atol=1e-8, t_eval=np.array(span))
    return result, float(np.abs(result.y[-1] - exact).max())


FAST, SLOW, JUMPS = 200.0, 1.0, (0.3, 0.7)
"""Rates of the filter's two stages, 1/s, and when its input jumps, s."""


@njit(cache=True)
def _filter(t, y, yp, out):
    source = 1.0 if JUMPS[0] <= t < JUMPS[1] else 0.0
    out[0] = yp[0] + FAST * (y[0] - source)
    out[1] = yp[1] + SLOW * (y[1] - y[0])
    out[2] = y[2] + 0.1 * y[2] ** 3 - np.sin(20.0 * t) * (1.0 + y[1])


@njit(cache=True)
def _half(t, y, yp):
    return y[2] - 0.5


def _jumping() -> tuple[Any, float]:
    """Restarts at jumps, an algebraic unknown that varies between steps, an event, a start off by 5e-7."""
    from gearmbs.dae.solve import solve_dae

    times, start = np.linspace(0.0, 1.0, 41), np.array([0.2, 0.1, 5e-7])
    result = solve_dae(_filter, (0.0, 1.0), start, rtol=1e-6, atol=1e-8, t_eval=times, events=_half, breakpoints=JUMPS)
    exact = np.empty((times.size, 3))
    x, z, at = start[0], start[1], 0.0
    for end, source in ((JUMPS[0], 0.0), (JUMPS[1], 1.0), (1.0, 0.0)):
        # between the jumps both are sums of two exponentials
        now = (times >= at) & (times <= end)
        h = np.append(times[now], end) - at
        part = SLOW * (x - source) / (FAST - SLOW)
        xs = source + (x - source) * np.exp(-FAST * h)
        zs = source - part * np.exp(-FAST * h) + (z - source + part) * np.exp(-SLOW * h)
        exact[now, 0], exact[now, 1] = xs[:-1], zs[:-1]
        x, z, at = xs[-1], zs[-1], end
    for row, t in zip(exact, times):
        roots = np.roots([0.1, 0.0, 1.0, -np.sin(20.0 * t) * (1.0 + row[1])])
        row[2] = roots.real[np.argmin(np.abs(roots.imag))]
    return result, float(np.abs(result.y - exact)[1:].max())


PROBLEMS: dict[str, tuple[str, Callable[[], tuple[Any, float]]]] = {
    "a": ("Robertson's reaction over eleven decades", _robertson),
    "b": ("Andrews's squeezer mechanism", _andrews),
    "c": ("chain of three four-bar linkages through singular positions", _chain),
    "d": ("ball bouncing on a belt by IMPACT and friction", _bouncing),
    "e": ("filter with jumps of its input, an event and an algebraic unknown", _jumping),
}


def measured() -> dict[str, dict[str, Any]]:
    """Return steps, residuals and error of every problem, or how it ended."""
    rows: dict[str, dict[str, Any]] = {}
    for letter, (_, solve) in PROBLEMS.items():
        try:
            result, error = solve()
        except Exception as failure:  # a value out of its range may end a run in any way
            rows[letter] = {"failed": repr(failure)}
            continue
        stats = result.stats
        rows[letter] = {"steps": stats.steps, "residuals": stats.residuals, "error": error}
        if not result.success:
            rows[letter] = {"failed": result.message}
    return rows


class Runs:
    """Runs in processes of their own, and what they gave.

    Parameters
    ----------
    folder : Path
        For the kernels, and for the results: a folder that has some spares their runs.
    """

    def __init__(self, folder: Path) -> None:
        self.kernels, self.kept = folder / "kernels", folder / "results.jsonl"
        lines = self.kept.read_text(encoding="utf-8").splitlines() if self.kept.exists() else []
        self.known = {tuple(line[:-1]): line[-1] for line in map(json.loads, lines)}

    def measured(self, *changed: str) -> dict[str, dict[str, Any]]:
        """Return `measured` of a process in which ``changed`` names a module, its constant and a value."""
        if changed not in self.known:
            self.known[changed] = self._measured(*changed)
            with self.kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps([*changed, self.known[changed]]) + "\n")
        return self.known[changed]

    def _measured(self, *changed: str) -> dict[str, dict[str, Any]]:
        setting = {"NUMBA_CACHE_DIR": str(self.kernels), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        command = [sys.executable, "-m", "benchmarks.constants", "--run", *changed]
        done = subprocess.run(
            command, env=os.environ | setting, cwd=FOLDER.parents[2], capture_output=True, text=True, check=False
        )
        if done.returncode:
            return {letter: {"failed": done.stderr[-200:]} for letter in PROBLEMS}
        return json.loads(done.stdout.splitlines()[-1])


# The table.


def extremes(new: dict, own: dict, what: str) -> str:
    """Return the least and the largest change over the problems with their letters; of errors the ratio."""
    failed = [letter for letter in own if "failed" in new[letter] and "failed" not in own[letter]]
    both = {
        letter: (new[letter][what], own[letter][what]) for letter in own if what in new[letter] and what in own[letter]
    }
    words = [f"fails {' '.join(failed)}"] if failed else []
    if what == "error":
        changes = {letter: after / before for letter, (after, before) in both.items() if after != before}
        shown = {letter: f"x {change:.2g}" for letter, change in changes.items()}
    else:
        changes = {
            letter: 100.0 * (after / before - 1.0) for letter, (after, before) in both.items() if after != before
        }
        shown = {letter: f"{change:+.2g} %" for letter, change in changes.items()}
    ends = sorted(changes, key=lambda letter: changes[letter])
    words += [f"{shown[letter]} {letter}" for letter in dict.fromkeys((*ends[:1], *ends[-1:]))]
    return ", ".join(words) or "0"


def page(chosen: list[Constant], runs: Runs, tell: Callable[[str], None]) -> str:
    """Return the problems, the table, and the constants that move nothing."""
    rows: list[list[str]] = []
    still: list[str] = []
    own = runs.measured()
    for constant in chosen:
        tell(f"{constant.module}.{constant.name}")
        values = (repr(factor * constant.value) for factor in FACTORS)
        others = [runs.measured(constant.module, constant.name, value) for value in values]
        if all(other == own for other in others):
            still.append(f"`{constant.module}.{constant.name}` ({constant.value:g})")
            continue
        cells = [extremes(other, own, what) for what in ("steps", "residuals", "error") for other in others]
        rows.append([f"`{constant.name}`", f"{constant.value:g}", f"`{constant.module}`", *cells])
    head = ["constant", "value", "module"]
    head += [f"{what}, {way}" for what in ("steps", "residuals", "error") for way in ("halved", "doubled")]
    told = []
    for letter, (title, _) in PROBLEMS.items():
        now = own[letter]
        told.append(
            f"* {letter}: {title}, {now['steps']} steps, {now['residuals']} residuals, error {now['error']:.1e}"
        )
    lines = [
        "Made by `python -m benchmarks.constants --write docs/data/integrator_constants.txt`. The problems:",
        "",
        *told,
        "",
        table(head, rows),
        "Neither half nor double the value changes a step, a residual or a digit of these runs:",
        "",
        *(f"* {text}" for text in still),
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the page, or write it to a file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="constants to try; default all")
    parser.add_argument(
        "--keep", type=Path, metavar="FOLDER", help="for kernels and results: an interrupted run goes on"
    )
    parser.add_argument("--run", nargs="*", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.run is not None:
        if given.run:
            module, name, value = given.run
            sys.meta_path.insert(0, _Finder(module, name, float(value)))  # type: ignore[arg-type]
        print(json.dumps(measured()))
        return
    chosen = [c for c in constants() if given.only is None or c.name in given.only]
    with tempfile.TemporaryDirectory() as temporary:
        folder = given.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        text = page(chosen, Runs(folder), lambda name: print(name, file=sys.stderr, flush=True))
    if given.write is None:
        print(text)
    else:
        given.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
