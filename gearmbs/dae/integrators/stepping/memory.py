"""What a run of WSTIFF or GSTIFF remembers, taken out of it and put into another one.

A step depends on the points behind it, the order and the size chosen for it, the Newton matrix and its factors, the
pivots they were found with, and what the controller has noted of earlier steps. All of it is copied, so that the other
run takes the very steps that this one would have taken. What was asked of a run (tolerances, limits, stops, outputs) is
its own.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, NamedTuple, Protocol
from weakref import ref

import numpy as np

from gearmbs.dae.integrators.algebraic.between import settle_between, settle_output
from gearmbs.dae.integrators.algebraic.outputs import AlgebraicOutputs
from gearmbs.dae.integrators.algebraic.part import PART_TYPE, AlgebraicPart
from gearmbs.dae.integrators.bdf import HISTORY, MAX_ORDER
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.records import Records
from gearmbs.dae.integrators.run_state import WINDOW, RunState
from gearmbs.dae.linalg.lu_plan import LUPlan, analyse
from gearmbs.dae.linalg.sparse_lu import LUFactors, new_factors
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.state import History
from gearmbs.kernels.bound import FUNCTIONS_TYPE
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types
from gearmbs.kernels.placed import unbound
from gearmbs.kernels.pointers import direct

ASKED = {
    "t_end", "h_max", "rtol", "max_order", "max_iterations", "max_steps", "n_events", "most_crossings", "fixed_leading",
    "interpolate", "has_hook", "has_index_one", "nonlinear_rates", "watches_pencil", "watches_poles", "constrained",
    "keep_rows", "step_in_weights", "t_pause", "code", "next_output", "next_stop", "n_records", "n_crossings",
}  # fmt: skip
"""Scalars of a run that are its own."""
SCALARS = tuple(name for name in RunState.scalar_members if name not in ASKED)
OWN = {
    "weight", "atol", "controlled", "tested", "differential", "coupled", "index_one", "entry_row", "entry_col", "idata",
    "rdata", "stops", "outputs", "y_out", "yp_out", "kept", "kept_out", "record_t", "record_h", "record_order",
    "record_y", "g_new", "g_between", "event_direction", "event_action", "crossing_t", "crossing_event", "crossing_y",
    "watched", "w_error", "w_newton", "g_old", "event_left", "work",
}  # fmt: skip
"""Arrays of a run that are its own, or follow from the state, or are scratch that is written before it is read."""
ARRAYS = tuple(name for name in RunState.array_members if name not in OWN)
TABLES = ("idata", "rdata", "g_old", "event_left")
"""Those among them that a run takes along where it goes back itself."""
PART_SCALARS = ("factored", "t_start", "t_first", "t_last", "failures", "first_failure")
PART_ARRAYS = ("lu", "scale", "pivots", "guess", "last", "known")
FACTORS = tuple(LUFactors.array_members)
WORD = 8
"""Bytes of a word."""

_VEC = float64[::1]
_MAT = float64[:, ::1]


class Pivots(NamedTuple):
    """What pivots were chosen from, of which they follow: the matrix, how small pivots may be, what may be left out."""

    matrix: np.ndarray
    drop: float
    negligible: float
    counted: np.ndarray | None


class LastStep(NamedTuple):
    """The last step as its outputs see it: nodes newest first, their values, its end, the integer table valid in it."""

    nodes: np.ndarray
    rows: np.ndarray
    y: np.ndarray
    yp: np.ndarray
    idata: np.ndarray


class Remembers(Protocol):
    """A run as far as its memory goes, see `gearmbs.dae.integrators.driver.Run`."""

    problem: DAEProblem
    options: Options
    state: RunState
    algebraic: AlgebraicOutputs
    plan: LUPlan | None
    factors: LUFactors | None
    functions: Any
    counted: np.ndarray
    indptr: np.ndarray
    indices: np.ndarray
    scale: np.ndarray
    repivots: int
    first_pivots: int
    started: bool


class Continued(Remembers, Protocol):
    """The same, and what it has to tell of its outputs."""

    pivots: Pivots | None
    records: Records
    stall: Any


class Laid(Continued, Protocol):
    """The same, and where its arrays lie, found once."""

    layout: Layout
    words: int
    itself: ref
    crossings: list[tuple[float, int]]
    told: dict[int, float]
    last_records: Any

    @property
    def row(self) -> int:
        """Of the next point."""

    def pack(self, row: int, block: np.ndarray) -> int:
        """Copy its memory, see `standing.pack`."""

    def unpack(self, row: int, order: int, block: np.ndarray) -> None:
        """Put it back."""


class Layout(NamedTuple):
    """Where the memory of a run stands in a block that is copied of it, see `standing.pack`.

    Attributes
    ----------
    arrays, part : dict of str to tuple
        Shape, type and place in bytes of arrays of its state, and shape and type of those of its part.
    part_scalars, y, window, factors : int
        First words of the scalars of the part, of the point, of the window's rows, and of the factors.
    """

    arrays: dict[str, tuple[tuple[int, ...], np.dtype, int]]
    part: dict[str, tuple[tuple[int, ...], np.dtype]]
    part_scalars: int
    y: int
    window: int
    factors: int


class Held(Mapping[str, np.ndarray]):
    """What a run remembers, as its memory lay: copied in one go, and taken apart by name where somebody asks.

    Parameters
    ----------
    run : HeldRun
        No step of it is open.
    row : int
        Where the point stands that this is a state of.
    given : LastStep or None
        Its last step where that cannot be told from its window.

    Attributes
    ----------
    mark
        What the owner of the run notes.
    """

    mark: Any = None

    def __init__(self, run: Laid, row: int, given: LastStep | None) -> None:
        factors, pivots, part = run.factors, run.pivots, run.algebraic.part
        assert factors is not None
        assert pivots is not None
        self.layout, self._run = run.layout, run.itself
        self._plan, self._factors, self._pivots = run.plan, factors, pivots
        self._block = block = np.empty(run.words)
        order = run.pack(row, block)
        self._order = order if given is None else 0
        self._part_arrays = [getattr(part, name).copy() for name in PART_ARRAYS] if part.count else ()
        self._counts, self._counted = (run.repivots, run.first_pivots), run.counted.tobytes()
        self.given, self.table, self.crossings = given, run.last_records.table, tuple(run.crossings)
        self.told = dict(run.told)

    def belongs_to(self, run: Continued) -> bool:
        """Whether it is of this very run."""
        return self._run() is run

    def put_back(self, run: Laid, row: int) -> None:
        """Let the run it is of remember what it did then, and keep the point in a row."""
        run.plan, run.factors, run.pivots = self._plan, self._factors, self._pivots
        run.repivots, run.first_pivots = self._counts
        run.unpack(row, self._order, self._block)
        for name, array in zip(PART_ARRAYS, self._part_arrays, strict=False):
            getattr(run.algebraic.part, name)[...] = array
        if run.counted.tobytes() != self._counted:
            run.counted[:] = np.frombuffer(self._counted, dtype=bool)

    @property
    def point(self) -> tuple[np.ndarray, np.ndarray]:
        """Unknowns and rates at the point, copies."""
        first, last = self.layout.y, self.layout.y + 2 * self._unknowns
        y, yp = self._block[first:last].reshape(2, -1)
        return y.copy(), yp.copy()

    @property
    def _unknowns(self) -> int:
        return self.layout.arrays["y"][0][0]

    @property
    def rdata(self) -> np.ndarray:
        """The table of numbers, a copy."""
        return self._array("rdata")

    def _array(self, name: str) -> np.ndarray:
        """Return a copy of an array of the state of the run."""
        shape, kind, offset = self.layout.arrays[name]
        return np.ndarray(shape, kind, self._block, offset).copy()

    def _window(self, newest: int) -> np.ndarray:
        """Return the window, of which the rows in use have been copied."""
        n, first = self._unknowns, self.layout.window
        window = np.zeros(WINDOW * n)
        size = min(HISTORY, WINDOW - newest) * n
        window[newest * n : newest * n + size] = self._block[first : first + size]
        return window

    def _last(self, newest: int) -> LastStep:
        """Return the last step, from the window."""
        if self.given is not None:
            return self.given
        n, count = self._unknowns, self._order + 1
        rows = self._window(newest)[newest * n : (newest + count) * n].reshape(count, n)
        nodes = self._array("window_t")[newest : newest + count]
        return LastStep(nodes, rows, self._array("y"), self._array("yp"), self._array("idata"))

    @cached_property
    def _numbers(self) -> dict[str, np.ndarray]:
        # only scalars are read
        first = self.layout.part_scalars
        st, part = (
            kind.from_buffer_copy(scalars.tobytes().ljust(ctypes.sizeof(kind), b"\0"))
            for kind, scalars in ((RunState, self._block[:first]), (AlgebraicPart, self._block[first : self.layout.y]))
        )
        last, pivots, idata = self._last(st.newest), self._pivots, self._array("idata")
        factors, start = self._factors, _address(_block(self._factors.x))
        numbers: dict[str, np.ndarray] = {
            "run": np.array([getattr(st, name) for name in SCALARS], dtype=float),
            "part": np.array([getattr(part, name) for name in PART_SCALARS], dtype=float),
            "counts": np.array(self._counts),
            "counted": np.frombuffer(self._counted, dtype=bool).copy(),
            "pivots": np.array([pivots.drop, pivots.negligible]),
            "pivots matrix": pivots.matrix,
            "pivots counted": np.zeros(0, dtype=bool) if pivots.counted is None else pivots.counted,
            "run window_y": self._window(st.newest),
        }
        numbers |= {f"run {name}": self._array(name) for name in ARRAYS if name != "window_y"}
        numbers |= {f"part {name}": array for name, array in zip(PART_ARRAYS, self._part_arrays, strict=False)}
        if not self._part_arrays:
            numbers |= {f"part {name}": np.zeros(shape, kind) for name, (shape, kind) in self.layout.part.items()}
        for name in FACTORS:
            array = getattr(factors, name)
            offset = _address(array) - start if array.size else 0
            place = WORD * self.layout.factors + offset
            numbers[f"factors {name}"] = np.ndarray(array.shape, array.dtype, self._block, place).copy()
        numbers |= {"last nodes": last.nodes, "last rows": last.rows, "last y": last.y, "last yp": last.yp}
        changed = np.flatnonzero(last.idata != idata)
        return numbers | {"table at": changed, "table": idata[changed]}

    def __getitem__(self, name: str) -> np.ndarray:
        return self._numbers[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._numbers)

    def __reduce__(self) -> tuple:
        return dict, (self._numbers,)


def _block(array: np.ndarray) -> np.ndarray:
    """Return the memory in which all arrays of a struct stand (`gearmbs.kernels.structs.BlockLayout`)."""
    base = array.base
    assert isinstance(base, np.ndarray)
    return base


def _address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]


def words_of(struct: Any) -> np.ndarray:
    """Return the scalars of a struct as words, to be written to."""
    return np.frombuffer(struct, dtype=float, count=getattr(type(struct), "words:").offset // WORD)


def factor_words(factors: LUFactors) -> np.ndarray:
    """Return the numbers of factors as words."""
    block = _block(factors.x)
    return block[: block.size // WORD * WORD].view(float)


def laid_out(run: Remembers) -> tuple[Layout, np.ndarray]:
    """Return where the memory of a run stands in what is copied of it, and its arrays behind the window as words."""
    st, part = run.state, run.algebraic.part
    block = _block(st.y)
    start, n = _address(block), st.y.shape[0]
    taken = [getattr(st, name) for name in (*ARRAYS, *TABLES)]
    assert all(array.base is block for array in taken)
    behind = [array for array in taken if array is not st.window_t and array is not st.window_y]
    first = min(_address(array) for array in behind) - start
    last = max(_address(array) + array.nbytes for array in behind) - start
    numbers = block[first : first - (first - last) // WORD * WORD].view(float)
    scalars = words_of(st).size
    y = scalars + words_of(part).size
    window_t = y + 2 * n
    window = window_t + st.window_t.size
    own = window + HISTORY * n
    arrays = {}
    for name, array in zip((*ARRAYS, *TABLES), taken, strict=True):
        if array is not st.window_y:
            place = WORD * window_t if array is st.window_t else WORD * own + _address(array) - start - first
            arrays[name] = array.shape, array.dtype, place
    of_part = {name: (getattr(part, name).shape, getattr(part, name).dtype) for name in PART_ARRAYS}
    return Layout(arrays, of_part, scalars, y, window, own + numbers.size), numbers


def put_memory(run: Remembers, history: History) -> tuple[Pivots, LastStep]:
    """Let a run go on with what another one remembers; its tables are those of the state already.

    The state may lie within the last step, after which coordinates may have changed.

    Returns
    -------
    pivots : Pivots
    last : LastStep

    Raises
    ------
    ModelError
        If the history is one of another version or of other equations.
    """
    st, part, numbers = run.state, run.algebraic.part, history.numbers
    counted = numbers["pivots counted"] if len(numbers["pivots counted"]) else None
    drop, negligible = map(float, numbers["pivots"])
    pivots = Pivots(numbers["pivots matrix"], drop, negligible, counted)
    plan = history.plan
    if plan is None:
        plan = _analysed(run, pivots)
    factors = new_factors(plan)
    wanted: dict[str, tuple[int, ...]] = {"run": (len(SCALARS),), "part": (len(PART_SCALARS),)}
    targets = {f"run {name}": getattr(st, name) for name in ARRAYS}
    targets |= {f"part {name}": getattr(part, name) for name in PART_ARRAYS}
    targets |= {f"factors {name}": getattr(factors, name) for name in FACTORS}
    targets["counted"] = run.counted
    wanted |= {name: array.shape for name, array in targets.items()}
    for name, shape in wanted.items():
        if name not in numbers or numbers[name].shape != shape:
            raise _unfit(f"{name!r} has not the size it has here")
    scalars = dict(zip(SCALARS, numbers["run"].tolist(), strict=True))
    _check(scalars, numbers, part.count)
    for name, array in targets.items():
        array[...] = numbers[name]
    for name, value in scalars.items():
        setattr(st, name, int(value) if RunState.scalar_members[name] != "f8" else value)
    for name, value in zip(PART_SCALARS, numbers["part"].tolist(), strict=True):
        setattr(part, name, int(value) if type(part).scalar_members[name] != "f8" else value)
    st.order = min(int(st.order), int(st.max_order))
    st.next_stop = int(np.searchsorted(st.stops, st.t, side="right"))
    run.repivots, run.first_pivots = map(int, numbers["counts"])
    run.plan, run.factors, run.started = plan, factors, True
    idata = st.idata.copy()
    changed = numbers["table at"]
    if len(changed) and not 0 <= changed.min() <= changed.max() < len(idata):
        raise _unfit("its tables are others")
    st.idata[changed] = numbers["table"]
    nodes, rows, y, yp = (numbers[f"last {name}"] for name in ("nodes", "rows", "y", "yp"))
    return pivots, LastStep(nodes, rows, y, yp, idata)


def _analysed(run: Remembers, pivots: Pivots) -> LUPlan:
    """Choose pivots once more from what they were chosen from."""
    if len(pivots.matrix) != len(run.indices) or len(run.counted) != len(run.indices):
        raise _unfit("its matrix has another pattern")
    counted = None if pivots.counted is None else pivots.counted.copy()
    return analyse(
        run.indptr, run.indices, pivots.matrix, run.scale, pivots.drop, counted, pivots.negligible,
        with_tail=run.problem.small_entries, couplings=run.problem.couplings, modes=run.problem.modes,
    )  # fmt: skip


def _check(scalars: dict[str, float], numbers: Any, count: int) -> None:
    """Refuse what compiled code would read beside its arrays for."""
    first, past = scalars["newest"], scalars["n_past"]
    carried, pivots = numbers["run carried"], numbers["part pivots"]
    sound = 1 <= past <= HISTORY and 0 <= first <= WINDOW - HISTORY + 1 and 1 <= scalars["order"] <= MAX_ORDER
    sound &= 0 <= scalars["n_carried"] <= len(carried) and carried.max(initial=0) < max(1, len(carried))
    sound &= bool((pivots >= 0).all()) and pivots.max(initial=0) < max(1, count)
    sound &= len(numbers["last nodes"]) == len(numbers["last rows"]) <= MAX_ORDER + 1
    if not sound or scalars["open"]:
        raise _unfit("its numbers do not belong together")


def _unfit(why: str) -> ModelError:
    return ModelError(
        f"state: its history does not fit: {why}; state.without_history() goes on from it at order one, in any version"
    )


def continue_run(run: Continued, history: History) -> None:
    """Let a run that has just been made go on with a history, and write its outputs within the last step."""
    pivots, last = put_memory(run, history)
    run.pivots, st, records = pivots, run.state, run.records
    run.stall.steps, run.stall.t = st.steps, st.t
    while st.next_output < len(st.outputs) and st.outputs[st.next_output] <= st.t:
        row = st.next_output
        st.y_out[row], st.yp_out[row] = value_in(run, last, float(st.outputs[row]))
        st.next_output = row + 1
    if not np.array_equal(last.idata, st.idata):
        records.change_table()
    if st.keep_rows:
        record_window(st)


def record_window(st: RunState) -> None:
    """Append the points of the history, oldest first, as records of order 0."""
    n, first, p = len(st.y), int(st.newest), int(st.n_records)
    count = min(int(st.n_past), HISTORY - 1)
    rows = slice(p, p + count)
    st.record_t[rows] = st.window_t[first : first + count][::-1]
    st.record_h[rows] = st.record_order[rows] = 0.0
    st.record_y[rows, :n] = st.window_y[first * n : (first + count) * n].reshape(count, n)[::-1]
    st.n_records = p + count


# --- values inside the last step --------------------------------------------------------------------------


@njit(
    types.void(
        FUNCTIONS_TYPE, PART_TYPE, float64, float64, _VEC, float64, _VEC,
        _MAT, int64, _VEC, _VEC, int64[::1], _VEC, _VEC,
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)  # fmt: skip
def value_between(bound, part, t, t_old, y_old, h, nodes, rows, count, y, yp, idata, rdata, work):
    """Write y and y' at ``t`` from the polynomial of the last step, through all its points.

    Parameters
    ----------
    bound, part, t, t_old, y_old, h, nodes, rows, count, y, yp, idata, rdata, work
        As of `settle_between`.
    """
    settle_between(unbound(bound), part, t, t_old, y_old, h, nodes, rows, 0, count, y, yp, idata, rdata, work)


def value_in(run: Remembers, last: LastStep, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Return y and y' at a time within the last step, as an output there; the run itself is left alone."""
    st, part = run.state, run.algebraic.part
    # without anything to solve for they are not looked at
    tables = last.idata, *((st.rdata.copy(), st.work.copy()) if part.count else (st.rdata, st.work))
    nodes, rows = last.nodes, last.rows
    if len(nodes) < 2 or t == nodes[0]:
        y, yp = last.y.copy(), last.yp.copy()
        if part.count > 0 and len(nodes) > 1:
            h = float(nodes[0] - nodes[1])
            direct(settle_output)(run.functions, part, t, y, yp, h, t, y, *tables)
        return y, yp
    y, yp = np.empty_like(last.y), np.empty_like(last.yp)
    t_old = float(nodes[1])
    direct(value_between)(
        run.functions, part, t, t_old, rows[1], float(nodes[0] - nodes[1]), nodes, rows, len(nodes), y, yp, *tables
    )
    return y, yp
