"""The package's sparse LU beside KLU of SuiteSparse, both called from compiled code: matrices, then whole runs.

    python -m benchmarks.klu /usr/lib/x86_64-linux-gnu/libklu.so.1 --repeats 12

Whole runs alternate between two processes. In that of KLU the functions of `gearmbs.dae.linalg.sparse_lu` are replaced
before anything else is imported, with kernels in a folder of their own, so that integrators and records of outputs run
on it unchanged; pivots of either are chosen when the package chooses anew.

References
----------
.. [1] T. A. Davis, E. Palamadai Natarajan, "Algorithm 907: KLU, a direct sparse solver for circuit simulation
       problems", ACM Trans. Math. Software 37 (2010) 36.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from llvmlite import binding
from numba import float64, types

from benchmarks.markdown import number, table
from gearmbs.dae.linalg import sparse_lu
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE, LUPlan
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, LUFactors, fits
from gearmbs.dae.linalg.sparse_lu import refactor as own_refactor
from gearmbs.dae.linalg.sparse_lu import solve as own_solve
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, bits_of, double_of

SPAN = {"healthy": 0.5, "misaligned": 0.3, "planetary": 0.1, "flexible": 0.05, "chain": 1.0}
"""Simulated seconds of a whole run."""
CHAIN_LOOPS = 160
MODES = 16
"""Of each shaft of the flexible pair, beside 12 static ones."""

COMMON_BYTES, BTF_AT, ORDERING_AT, SCALE_AT = 512, 40, 44, 48
"""Room for a ``klu_common``, and where its settings are."""
ORDERINGS = {"AMD": 0, "COLAMD": 1}
COLUMNS, ROWS, SYMBOLIC, NUMERIC, COMMON = range(5)
"""Addresses in the array ``rest`` of factors."""

_P, _I = types.intp, types.int32
_FACTOR = types.ExternalFunction("klu_factor", _P(_P, _P, _P, _P, _P))
_REFACTOR = types.ExternalFunction("klu_refactor", _I(_P, _P, _P, _P, _P, _P))
_SOLVE = types.ExternalFunction("klu_solve", _I(_P, _P, _I, _I, _P, _P))

_VEC = float64[::1]
_MAT = float64[:, ::1]


@njit(cache=True, error_model="numpy")
def refactor_by_klu(plan, factors, vals):
    """Factor with the pivots of the first call; KLU tells of zero pivots only, so that growth is 1 or infinite."""
    entry, scale, taken, at = factors.w, factors.blocks, factors.lower, factors.rest
    for e in range(taken.size):
        taken[e] = vals[np.uint64(bits_of(entry[e]))] * scale[e]
    columns, rows, values = bits_of(at[COLUMNS]), bits_of(at[ROWS]), taken.ctypes.data
    symbolic, numeric, common = bits_of(at[SYMBOLIC]), bits_of(at[NUMERIC]), bits_of(at[COMMON])
    if numeric == 0:
        numeric = _FACTOR(columns, rows, values, symbolic, common)
        at[NUMERIC] = double_of(numeric)
        return 1.0 if numeric != 0 else np.inf
    return 1.0 if _REFACTOR(columns, rows, values, symbolic, numeric, common) == 1 else np.inf


@njit(float64(PLAN_TYPE, FACTORS_TYPE, _VEC), cache=True, nogil=True, error_model="numpy")
def refactor(plan, factors, vals):
    """Stand in for `sparse_lu.refactor`."""
    return refactor_by_klu(plan, factors, vals)


@njit(float64(PLAN_TYPE, FACTORS_TYPE, _VEC), cache=True, nogil=True, error_model="numpy")
def factor(plan, factors, vals):
    """Stand in for `sparse_lu.factor`."""
    return refactor_by_klu(plan, factors, vals) if fits(plan, vals) else np.inf


@njit(types.void(PLAN_TYPE, FACTORS_TYPE, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def solve(plan, factors, b, out):
    """Stand in for `sparse_lu.solve`."""
    x, at = factors.x, factors.rest
    row_from, row_scale, col_to, col_scale = plan.row_from, plan.row_scale, plan.col_to, plan.col_scale
    for k in range(x.size):
        x[row_from[k]] = b[row_from[k]] * row_scale[k]
    symbolic, numeric, common = bits_of(at[SYMBOLIC]), bits_of(at[NUMERIC]), bits_of(at[COMMON])
    _SOLVE(symbolic, numeric, x.size, 1, x.ctypes.data, common)
    for k in range(x.size):
        out[col_to[k]] = x[col_to[k]] * col_scale[k]


@njit(types.void(PLAN_TYPE, FACTORS_TYPE, _MAT), cache=True, nogil=True, error_model="numpy")
def solve_pair(plan, factors, pair):
    """Stand in for `sparse_lu.solve_pair`."""
    for m in range(2):
        solve(plan, factors, pair[m], pair[m])


class Klu:
    """KLU's side of plans of the package: patterns, symbolic analyses, settings; they live as long as the process."""

    kept: ClassVar[list[Any]] = []

    def __init__(self, library: str, ordering: int = 0, btf: bool = True) -> None:
        binding.load_library_permanently(library)
        self.library, self.ordering, self.btf = ctypes.CDLL(library), ordering, btf
        self.library.klu_analyze.restype = ctypes.c_void_p
        self.library.klu_analyze.argtypes = [ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]

    def new_factors(self, plan: LUPlan) -> LUFactors:
        """Return factors that hold KLU's addresses, its entries of the matrix and their scales."""
        n, source = len(plan.row_from), np.concatenate([plan.a_src, plan.tail_src]).astype(np.int64)
        scale = np.concatenate([plan.a_scale, plan.tail_scale])
        row, column = places(plan)
        order = np.lexsort((row, column))
        columns = np.searchsorted(column[order], np.arange(n + 1)).astype(np.int32)
        rows, common = row[order].astype(np.int32), ctypes.create_string_buffer(COMMON_BYTES)
        self.library.klu_defaults(common)
        # the package scales the entries, once a plan
        for at, value in ((BTF_AT, int(self.btf)), (ORDERING_AT, self.ordering), (SCALE_AT, -1)):
            ctypes.c_int32.from_buffer(common, at).value = value
        symbolic = self.library.klu_analyze(n, columns.ctypes.data, rows.ctypes.data, common)
        if not symbolic:
            raise RuntimeError("klu_analyze failed")
        addresses = [columns.ctypes.data, rows.ctypes.data, symbolic, 0, ctypes.addressof(common)]
        self.kept.append((columns, rows, common))
        return LUFactors(
            lu=np.zeros(1), pivot_inv=np.zeros(1), x=np.zeros(n), w=source[order].view(float),
            blocks=scale[order], lower=np.zeros(len(order)), rest=np.array(addresses, dtype=np.int64).view(float),
        )  # fmt: skip


def places(plan: LUPlan) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns in the matrix of the entries that a plan takes: by columns, then those of its tail."""
    pivot = np.repeat(np.arange(len(plan.row_from)), np.diff(plan.a_ptr))
    # blocks of the tail's rows before it, column by column; behind them its own
    block, lane = np.divmod(plan.tail_at.astype(np.int64), LANES)
    own = block - len(plan.block_col)
    before, lanes = own < 0, -(-(len(plan.row_from) - plan.tail) // LANES)
    column, lane_of = plan.tail + own // max(lanes, 1), own % max(lanes, 1)
    column[before] = plan.block_col[block[before]]
    lane_of[before] = np.searchsorted(plan.lane_ptr, block[before], side="right") - 1
    rows = np.concatenate([plan.a_pos, plan.tail + LANES * lane_of + lane]).astype(int)
    columns = np.concatenate([pivot, column]).astype(int)
    return plan.row_from[rows].astype(int), plan.col_to[columns].astype(int)


# Matrices of runs under way.


def problems() -> dict[str, Callable[[], tuple]]:
    """Return what makes the problem of each model, with its options and the end of a run."""
    from benchmarks.problems.reference import chain_problem
    from gearmbs.dae.integrators.options import Options
    from gearmbs.gears import GearPair, planetary_mechanism
    from gearmbs.studies import Case, flexible_rig, simulate_case

    gears = Options(tol=1e-7, corrector="modified", slopes=False)

    def pair(**settings: Any) -> tuple:
        return simulate_case(Case(operation={"duration": 0.06}, **settings)).problem, gears, 0.05

    def built(mechanism: Any) -> tuple:
        return mechanism.simulate(1e-3, rate=1e4).problem, gears, 0.02

    def flexible() -> tuple:
        return built(flexible_rig(GearPair.paper(), speed="1000 rpm", torque="100 N m", modes=MODES))

    def planets() -> tuple:
        run = planetary_run(0.1)
        return built(planetary_mechanism(run.gears, speeds=run.speeds, torques=run.torques, run_up=run.run_up))

    return {
        "healthy": pair,
        "misaligned": lambda: pair(fault={"misalignment": "1 deg"}),
        "planetary": planets,
        "flexible": flexible,
        "chain": lambda: (chain_problem(CHAIN_LOOPS, 5.0).make("SI2"), Options(tol=1e-5), 1.0),
    }


def planetary_run(duration: float) -> Any:
    """Return the planetary set of `benchmarks.planetary`."""
    from gearmbs.gears import ContactLaw, planetary
    from gearmbs.studies.planetary import PlanetaryRun

    law = ContactLaw.impact()
    gears = planetary((24, 30, 84), "1.5 mm", 3, backlash_sun="0.05 mm", backlash_ring="0.05 mm", contact=law)
    speed = 2.0 * np.pi * 170.0 / gears.ring.teeth
    return PlanetaryRun(gears, speeds={"carrier": speed}, torques={"sun": "-11 N m"}, duration=duration)


def matrices(library: str, repeats: int) -> list[list[str]]:
    """Time a refactorisation and a solution of one matrix of each model; KLU with its fastest ordering."""
    from benchmarks.step_parts import warm

    rows = []
    for name, make in problems().items():
        problem, options, end = make()
        run = warm(problem, options, end)
        plan, own_factors, vals, n = run.plan, run.factors, run.state.matrix.copy(), problem.n
        assert plan is not None
        assert own_factors is not None
        programs = {"own": (True, own_factors)}
        best = np.inf
        for (label, ordering), btf in product(ORDERINGS.items(), (True, False)):
            factors = Klu(library, ordering, btf).new_factors(plan)
            factor(plan, factors, vals)
            spent = per_call(refactor, 20, plan, factors, vals)
            if spent < best:
                best = spent
                programs = {"own": programs["own"], f"KLU, {label}{', BTF' if btf else ''}": (False, factors)}
        b, x = np.random.default_rng(0).standard_normal(n), np.zeros(n)
        for program, (own, factors) in programs.items():
            calls = (own_refactor, own_solve) if own else (refactor, solve)
            growth = calls[0](plan, factors, vals)
            calls[1](plan, factors, b, x)
            times = [
                np.median([per_call(call, 200, plan, factors, *given) for _ in range(repeats)])
                for call, given in ((calls[0], (vals,)), (calls[1], (b, x)))
            ]
            off = backward_error(problem, plan, vals, x, b)
            rows.append([name, str(n), str(len(vals) - plan.left_src.size), program, *(number(1e6 * t) for t in times),
                         f"{off:.1e}", number(growth)])  # fmt: skip
    return rows


def backward_error(problem: Any, plan: LUPlan, vals: np.ndarray, x: np.ndarray, b: np.ndarray) -> float:
    """Return the largest |A x - b| / (|A| |x| + |b|) of an equation, without the entries that the plan leaves out."""
    import scipy.sparse as sp

    taken = vals.copy()
    taken[plan.left_src] = 0.0
    matrix = sp.csc_array((taken, problem.indices, problem.indptr), shape=(problem.n, problem.n))
    return float(np.max(np.abs(matrix @ x - b) / (np.abs(matrix) @ np.abs(x) + np.abs(b))))


def per_call(call: Any, count: int, *given: Any) -> float:
    """Return the processor seconds of one of ``count`` calls from compiled code."""
    loop = REPEATED[len(given) - 3, call in (refactor, solve)]
    loop(1, *given)
    begin = time.process_time()
    loop(count, *given)
    return (time.process_time() - begin) / count


@njit(cache=True, error_model="numpy")
def _refactor_own(count, plan, factors, vals):
    for _ in range(count):
        own_refactor(plan, factors, vals)


@njit(cache=True, error_model="numpy")
def _refactor_klu(count, plan, factors, vals):
    for _ in range(count):
        refactor(plan, factors, vals)


@njit(cache=True, error_model="numpy")
def _solve_own(count, plan, factors, b, x):
    for _ in range(count):
        own_solve(plan, factors, b, x)


@njit(cache=True, error_model="numpy")
def _solve_klu(count, plan, factors, b, x):
    for _ in range(count):
        solve(plan, factors, b, x)


REPEATED = {(0, False): _refactor_own, (0, True): _refactor_klu, (1, False): _solve_own, (1, True): _solve_klu}


# Whole runs.


def replace_own(library: str) -> None:
    """Let everything that is imported from now on run on KLU."""
    klu = Klu(library)
    for name, stand_in in (
        ("refactor", refactor), ("factor", factor), ("solve", solve), ("solve_pair", solve_pair),
        ("new_factors", klu.new_factors),
    ):  # fmt: skip
        setattr(sparse_lu, name, stand_in)


def job(name: str) -> None:
    """Run a model once, with all that is recorded of it."""
    from gearmbs.gears import GearPair
    from gearmbs.studies import Case, flexible_rig, run_case
    from gearmbs.studies.planetary import run_planetary

    if name in ("healthy", "misaligned"):
        fault = {"misalignment": "1 deg"} if name == "misaligned" else {}
        run_case(Case(name=name, operation={"duration": SPAN[name]}, fault=fault), False)
    elif name == "planetary":
        run_planetary(planetary_run(SPAN[name]))
    elif name == "flexible":
        rig = flexible_rig(GearPair.paper(), speed="1000 rpm", torque="100 N m", modes=MODES)
        rig.simulate(SPAN[name], rate=12_800).reaction_force("bearing 1")
    else:
        from gearmbs.dae.integrators.driver import Run

        problem, options, end = problems()["chain"]()
        Run(problem, np.array([problem.t0, end]), end, options).drive()


def serve(library: str) -> None:
    """Run what is asked for on standard input, and print its processor seconds."""
    if library:
        replace_own(library)
    for line in sys.stdin:
        begin = time.process_time()
        job(line.strip())
        print("took", time.process_time() - begin, flush=True)


def compare(library: str, repeats: int) -> list[list[str]]:
    """Return the ratio of whole runs on KLU to those on the own LU, with its 95 % interval."""
    with tempfile.TemporaryDirectory() as kernels:
        programs = [_start("", None), _start(library, os.environ.get("KLU_KERNELS", kernels))]
        rows = []
        for name in SPAN:
            for program in programs:
                _ask(program, name)
            pairs = []
            for k in range(repeats):
                order = (0, 1) if k % 2 else (1, 0)
                spent = {which: _ask(programs[which], name) for which in order}
                pairs.append((spent[0], spent[1]))
            own, other = np.array(pairs).T
            draws = np.random.default_rng(0).integers(0, repeats, (4000, repeats))
            low, high = np.percentile(np.median((other / own)[draws], axis=1), (2.5, 97.5))
            rows.append([name, number(np.median(own)), number(np.median(other)), number(np.median(other / own)),
                         f"{low:.2f} to {high:.2f}"])  # fmt: skip
            print(*rows[-1], file=sys.stderr, flush=True)
        for program in programs:
            program.communicate()
    return rows


def _start(library: str, kernels: str | None) -> subprocess.Popen:
    environment = dict(os.environ) if kernels is None else {**os.environ, "NUMBA_CACHE_DIR": kernels}
    command = [sys.executable, "-m", "benchmarks.klu", library, "--serve"]
    return subprocess.Popen(
        command,
        cwd=Path(__file__).parents[1],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def _ask(program: subprocess.Popen, name: str) -> float:
    assert program.stdin is not None
    assert program.stdout is not None
    program.stdin.write(name + "\n")
    program.stdin.flush()
    for line in program.stdout:
        if line.startswith("took"):
            return float(line.split()[1])
    raise RuntimeError(f"{name}: the run failed")


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("library", help="file of KLU's shared library")
    parser.add_argument("--repeats", type=int, default=12)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--skip", choices=("matrices", "runs"), default="", help="leave a table away")
    given = parser.parse_args()
    if given.serve:
        serve(given.library)
        return
    if given.skip != "matrices":
        header = ("model", "unknowns", "entries", "program", "us a refactorisation", "us a solution", "backward error",
                  "growth")  # fmt: skip
        print(table(header, matrices(given.library, given.repeats)))
    if given.skip != "runs":
        print(table(("model", "own, s", "KLU, s", "KLU / own", "95 %"), compare(given.library, given.repeats)))


if __name__ == "__main__":
    main()
