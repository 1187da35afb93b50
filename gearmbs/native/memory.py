"""The memory of an exported run: its structs and what they need beside them, laid out in an `Image`."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.rotation import KIN_COLUMNS
from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.driver import Run
from gearmbs.dae.integrators.run_state import RunState
from gearmbs.dae.integrators.stepping.held_run import HeldRun
from gearmbs.dae.integrators.stepping.jumps import TERMS
from gearmbs.dae.linalg.entry_lists import NEGLIGIBLE, NEGLIGIBLE_IN_NEWTON
from gearmbs.dae.linalg.left_out import signs_of_error
from gearmbs.dae.linalg.lu_plan import NO_MODES, LUPlan, SingularMatrixError, analyse, new_lines
from gearmbs.dae.linalg.sparse_lu import LUFactors, new_factors
from gearmbs.dae.model.evaluator import Evaluator, new_records, pattern
from gearmbs.dae.model.kinetic import inertias
from gearmbs.dae.model.members import MemberEvaluator, Members
from gearmbs.dae.model.records import Records
from gearmbs.dae.problem import INPUT, DAEProblem, Number
from gearmbs.kernels.bound import NAMES, SIGNATURES
from gearmbs.kernels.lanes import LANES
from gearmbs.mechanism.solve.told import Begun
from gearmbs.native.afresh import Afresh
from gearmbs.native.asked import Expressions, Told, expressions_of
from gearmbs.native.driver import Driver
from gearmbs.native.image import CONSTANT, SCRATCH, STATE, Image, Layout, member_of, word_of
from gearmbs.native.kernels import BY_ADDRESS
from gearmbs.native.pivots import PlanRoom
from gearmbs.native.series import ENERGY
from gearmbs.native.teller import Teller

ROWS = 2
"""Rows of outputs: the present point, and the next."""
FILL = 2
"""Times the entries of a matrix that each of L and U has room for. Of a pair of gears, a planetary set, a drivetrain on
rolling bearings, flexible shafts and a slider crank they have up to 0.74 times as many with pivots for all entries."""
OPERATIONS = 6
"""Times the entries of a matrix that a factorisation may have operations: of the same up to 2.2."""
POOL = 4
"""Times the room that the search for pivots begins with in Python, where it is doubled when it is full."""

PER_COLUMN = ("a_ptr", "u_ptr", "l_ptr", "pivot_ptr", "op_ptr", "div_ptr")
OF_TAIL = (
    "tail_at", "tail_src", "tail_scale", "block_col", "lane_ptr", "act_ptr", "act_to", "act_by", "act_u", "last_ptr",
    "last_to", "part_ptr", "part_at", "part_col", "above_ptr", "above_col", "above_at",
)  # fmt: skip
"""Arrays of a plan with a dense tail."""
OF_MODES = (
    "groups", "mode_at", "row_at", "column_at", "fill_at", "fill_src", "rest_src", "rest_scale", "schur_at",
    "schur_scale",
)  # fmt: skip
"""Arrays of a plan with condensed modes."""
OF_KNOWN = ("blocks", "above", "lower", "rest", "every", "left", "reduced", "moving")
"""Arrays of factors that have room for twice what those of known plans take."""
OF_MATRIX = ("a_pos", "a_src", "a_scale", "a_to", "left_src", "left_limit", "limit")
OF_FACTORS = ("u_pos", "u_col", "l_pos", "l_col", "l_to", "l_by", "u_to", "u_by", "div_to", "div_by")
OF_OPERATIONS = ("op_to", "op_l", "op_u")


class Memory(NamedTuple):
    """The memory of an exported run.

    Attributes
    ----------
    layout : Layout
    structs : dict of str to int
        Offset of each struct.
    members : dict of str to int
        Offset of single members and arrays that are read and written from outside.
    motions : Motions or None
        None where no input that can be set prescribes a motion.
    """

    layout: Layout
    structs: dict[str, int]
    members: dict[str, int]
    motions: Motions | None


class Motions(NamedTuple):
    """What is needed to start afresh where an input that prescribes a motion is set.

    Attributes
    ----------
    afresh, rdata, values : int
        Offsets of the struct `gearmbs.native.afresh.Afresh`, of the table of numbers, and of what is to stand there.
    copies : list of (int, int, int)
        From where to where so many bytes make the state of a run what it is before all steps.
    """

    afresh: int
    rdata: int
    values: int
    copies: list[tuple[int, int, int]]


class _Factored(NamedTuple):
    """Parts of a plan, its factors, their room, and scratch for the choice of pivots."""

    plan: int
    factors: int
    room: int
    columns: int
    rows: int


def memory_of(begun: Begun, numbers: Mapping[str, Number], told: list[Told], function: Callable[[Any], int]) -> Memory:
    """Lay out the memory of a run.

    Parameters
    ----------
    begun : Begun
    numbers : mapping of str to Number
        What can be set.
    told : list of Told
        Outputs.
    function : callable
        Returns the number of a kernel by its address in this process, or by its name where the driver calls it.
    """
    run, image = begun.run, Image()
    st = _state(begun)
    parts = {"run": image.struct(st, STATE, dict.fromkeys(("entry_row", "entry_col"), CONSTANT))}
    parts["part"] = image.struct(run.algebraic.part, STATE)
    moved = any(number.prescribes for number in numbers.values())
    copied = _as_before_all_steps(image, begun, st, parts) if moved else []
    afresh = image.struct(_afresh(begun), STATE) if moved else -1
    parts["bound"] = _functions(image, begun.problem, function)
    matrix = run.indptr, run.indices, run.scale, run.counted
    assert run.plan is not None
    assert run.factors is not None
    others, problem = _other_plans(run), begun.problem
    between = problem.couplings, problem.modes
    own = _factored(image, run.plan, run.factors, *matrix, others, problem.small_entries, *between)
    driver = _driver(begun, numbers)
    parts["driver"] = image.struct(driver, STATE, {"scratch": SCRATCH, **dict.fromkeys(_FIXED, CONSTANT)})
    for kernel in BY_ADDRESS:
        image.function_at(parts["driver"], member_of(Driver, kernel.__name__), function(kernel.__name__))
    asked = expressions_of(begun.system, told)
    teller, plan, indptr, indices = _teller(begun, told, asked)
    by_axes, lumped = begun.by_axes, begun.members is not None
    ones, counted = np.ones(indptr.size - 1), np.zeros(indices.size)
    found = _factored(image, plan, new_factors(plan), indptr, indices, ones, counted, [], False, None, None)
    kinds = {**dict.fromkeys(_RECORDS, SCRATCH), **dict.fromkeys(_ASKED, CONSTANT)}
    if not asked.starts.size:
        # of the point before nothing is asked
        kinds |= dict.fromkeys(_OF_POINTS, SCRATCH)
    parts["teller"] = image.struct(teller, STATE, kinds)
    of_teller = {
        "evaluate": "" if by_axes else "evaluate_rows",
        "axes": "evaluate_axes" if by_axes else "",
        "expand": "expand" if lumped and not by_axes else "",
        "kinetic": "write_kinetic_energy" if teller.bodies.size else "",
    }
    for name, kernel in of_teller.items():
        if kernel:
            image.function_at(parts["teller"], member_of(Teller, name), function(kernel))
    if asked.bounds.size:
        for name, kernel in (("series", "evaluate_series"), ("elastic_frames", "elastic_frames")):
            image.function_at(parts["teller"], member_of(Teller, name), function(kernel))
    parts |= {name: getattr(own, name) for name in own._fields}
    parts |= {f"told_{name}": getattr(found, name) for name in found._fields}
    # kernels of elements stand in the tables of integers
    addressed = {id(table): table for table in (st.idata, driver.table, driver.table_before, driver.last_table)}
    for table in addressed.values():
        part = image.array(table, STATE)
        for at in np.flatnonzero(np.isin(table, np.fromiter(NAMES, dtype=np.int64))).tolist():
            image.function_at(part, 8 * at, function(int(table[at])))
    layout = image.lay_out()
    structs = {name: image.places[part] for name, part in parts.items()}
    members = {
        "time": structs["driver"] + member_of(Driver, "t"),
        "present": structs["driver"] + member_of(Driver, "present"),
        "steps": structs["run"] + member_of(RunState, "steps"),
        "integrated": structs["run"] + member_of(RunState, "t"),
    }
    arrays = {
        "waiting": driver.waiting,
        "wanted": driver.wanted,
        "values": st.y_out,
        "rates": st.yp_out,
        "out": teller.out,
    }
    members |= {name: image.places[image.array(array, STATE)] if array.size else 0 for name, array in arrays.items()}
    motions = None
    if moved:
        copies = [(image.places[a], image.places[b], size) for a, b, size in copied]
        rdata, values = (image.places[image.array(array, STATE)] for array in (st.rdata, driver.values))
        motions = Motions(image.places[afresh], rdata, values, copies)
    return Memory(layout, structs, members, motions)


_STAYS = (
    "entry_row", "entry_col", "idata", "rdata", "stops", "outputs", "y_out", "yp_out", "kept", "kept_out", "watched",
    "record_y",
)  # fmt: skip
"""Arrays of a state that a start afresh leaves, or fills itself."""


def _as_before_all_steps(
    image: Image, begun: Begun, st: RunState, parts: Mapping[str, int]
) -> list[tuple[int, int, int]]:
    """Take in the state of a run that has not begun; return which parts are copied to which, and their bytes."""
    run = begun.run
    options = replace(run.options, history=None, check_start=False)
    other = HeldRun(run.problem, float(run.state.t_end), options)
    found = []
    for name, own, new, stays in (
        ("run", st, other.state, _STAYS),
        ("part", run.algebraic.part, other.algebraic.part, ()),
    ):
        scalars = getattr(type(new), "words:").offset
        bytes_of = np.frombuffer(bytes(new), dtype=np.uint8)[:scalars].copy()
        found.append((image.array(bytes_of, CONSTANT), parts[name], scalars))
        for member in type(new).array_members:
            array = getattr(new, member)
            if member not in stays and array.size:
                found.append((image.array(array, CONSTANT), image.array(getattr(own, member), STATE), array.nbytes))
    return found


def _afresh(begun: Begun) -> Afresh:
    """Return what starts a run afresh, at the start of the simulation or behind it."""
    run, options = begun.run, begun.run.options
    kinds = begun.system.model.states[:, T.STATE_KIND]
    return Afresh(
        first_given=options.first_step is not None,
        first_step=options.first_step or 0.0,
        smallest_given=options.min_step is not None,
        smallest_step=options.min_step or 0.0,
        y0=np.array(run.problem.y0, dtype=float),
        yp0=np.array(run.problem.yp0, dtype=float),
        settled=int(begun.problem.idata[T.H_Z]) + np.flatnonzero(kinds == T.STATE_ALGEBRAIC).astype(np.int64),
    )


def _state(begun: Begun) -> RunState:
    """Return a copy of the state of a run that has room for two outputs, of which the first is the present point."""
    st, point = begun.run.state, begun.point
    y_out, yp_out = np.zeros((ROWS, begun.problem.n)), np.zeros((ROWS, begun.problem.n))
    y_out[0], yp_out[0] = point.y, point.yp
    kept = np.zeros((ROWS, len(st.kept)))
    kept[0] = point.rows.kept[point.row]
    return st.with_members(
        outputs=np.full(ROWS, np.inf), y_out=y_out, yp_out=yp_out, kept_out=kept, next_output=ROWS, t_pause=np.inf
    )


def _functions(image: Image, problem: DAEProblem, function: Callable[[Any], int]) -> int:
    """Take in the addresses of the functions bound together."""
    number = image.array(np.zeros(len(SIGNATURES), dtype=np.int64), STATE)
    for k, name in enumerate(SIGNATURES):
        image.function_at(number, 8 * k, function(name))
    return number


def _other_plans(run: Run) -> list[LUPlan]:
    """Return plans for the present matrix of a run whose bodies deform, by what may be left out of it."""
    st, plans = run.state, []
    if not run.problem.small_entries:
        return []
    nothing = np.zeros(len(run.indices), dtype=bool)
    counted = [(negligible, nothing.copy()) for negligible in (*NEGLIGIBLE_IN_NEWTON, NEGLIGIBLE)]
    if run.problem.couplings is not None:
        # all that modes condensed one by one may ever meet; at the start most of it has not counted yet
        counted.append((NEGLIGIBLE_IN_NEWTON[0], ~run.problem.couplings))
    for negligible, known in counted:
        with contextlib.suppress(SingularMatrixError):
            plans.append(
                analyse(
                    run.indptr, run.indices, st.matrix, run.scale, 0.0, known, negligible, with_tail=True,
                    couplings=run.problem.couplings, modes=run.problem.modes,
                )
            )  # fmt: skip
    with contextlib.suppress(SingularMatrixError):
        plans.append(analyse(run.indptr, run.indices, st.matrix, run.scale, with_tail=True, modes=run.problem.modes))
    return plans


def _room_for(name: str, n: int, entries: int, present: int) -> int:
    """Return how long an array of a plan may become; ``present`` is the length of the longest that is known."""
    if name in OF_TAIL or name in OF_MODES:
        return FILL * present
    if name in PER_COLUMN:
        wanted = n + 1
    elif name in OF_MATRIX:
        wanted = entries
    elif name in OF_FACTORS:
        wanted = FILL * entries
    elif name in OF_OPERATIONS:
        wanted = OPERATIONS * entries
    else:
        wanted = n
    return max(wanted, present)


def _factored(
    image: Image, plan: LUPlan, factors: LUFactors, indptr: np.ndarray, indices: np.ndarray, scale: np.ndarray,
    counted: np.ndarray, others: list[LUPlan], with_tail: bool, couplings: np.ndarray | None, modes: np.ndarray | None,
) -> _Factored:  # fmt: skip
    """Take in a plan and its factors, with room for others of the same matrix, among them some that are known."""
    n, entries = len(indptr) - 1, len(indices)
    members = type(plan).array_members
    longest = [max(getattr(one, name).size for one in (plan, *others)) for name in members]
    rooms = np.array([_room_for(name, n, entries, size) for name, size in zip(members, longest)], dtype=np.int64)
    at, sizes = np.zeros(len(members), dtype=np.int64), {"i8": 0, "u4": 0, "f8": 0}
    for k, (kind, _) in enumerate(members.values()):
        at[k] = sizes[kind]
        sizes[kind] += int(rooms[k])
    pools = {kind: np.zeros(max(size, 1), dtype=kind) for kind, size in sizes.items()}
    for k, (name, (kind, _)) in enumerate(members.items()):
        array = getattr(plan, name)
        pools[kind][at[k] : at[k] + array.size] = array
    plan_part = image.record(plan, STATE)
    for k, (name, (kind, _)) in enumerate(members.items()):
        inside = int(at[k]) * pools[kind].itemsize
        image.address_of(plan_part, word_of(plan, name), image.array(pools[kind], STATE), inside)
    own = {name: getattr(factors, name) for name in type(factors).array_members}
    known = [factors, *map(new_factors, others)]
    sizes_of = {name: FILL * max(getattr(one, name).size for one in known) for name in OF_KNOWN}
    sizes_of |= {"lu": max(2 * FILL * entries + n + 1, factors.lu.size), "x": n + LANES}
    for name, length in sizes_of.items():
        larger = np.zeros(length)
        larger[: own[name].size] = own[name]
        own[name] = larger
    factors_part = image.record(factors, STATE)
    for name, array in own.items():
        image.address_of(factors_part, word_of(factors, name), image.array(array, STATE))
    room = PlanRoom(
        words=np.zeros(2 * len(members), dtype=np.int64),
        factor_words=np.zeros(2 * len(type(factors).array_members), dtype=np.int64),
        head=np.zeros(2, dtype=np.int64),
        at=at,
        room=rooms,
        factor_room=np.array([array.size for array in own.values()], dtype=np.int64),
        with_tail=with_tail,
        ints=pools["i8"],
        places=pools["u4"],
        numbers=pools["f8"],
        **{name: own[name] for name in type(factors).array_members if name != "pivot_inv"},
        indptr=np.asarray(indptr, dtype=np.int64),
        indices=np.asarray(indices, dtype=np.int64),
        scale=np.asarray(scale, dtype=float),
        counted=np.asarray(counted).astype(np.int64),
        couplings=np.zeros(0, dtype=np.int64) if couplings is None else couplings.astype(np.int64),
        modes=NO_MODES if modes is None else modes,
        signs=signs_of_error(n),
    )
    part = image.record(room, STATE)
    aliases = {
        "words": (plan_part, word_of(plan, next(iter(members)))),
        "factor_words": (factors_part, word_of(factors, "lu")),
        "head": (plan_part, member_of(LUPlan, "tail")),
    }
    fixed = ("at", "room", "factor_room", "indptr", "indices", "scale", "couplings", "modes", "signs")
    for name in type(room).array_members:
        number, inside = aliases.get(name, (-1, 0))
        if number < 0:
            number = image.array(getattr(room, name), CONSTANT if name in fixed else STATE)
        image.address_of(part, word_of(room, name), number, inside)
    columns, rows = new_lines(n, POOL * (3 * entries + 4 * n))
    lines = [image.struct(one, STATE, dict.fromkeys(type(one).array_members, SCRATCH)) for one in (columns, rows)]
    return _Factored(plan_part, factors_part, part, *lines)


_FIXED = ("cells", "is_input", "loads", "first", "place", "coefficients", "per_unit", "offset", "plain")
_RECORDS = (
    "work",
    "vals",
    "pose",
    "solution",
    "phi",
    "strayed",
    "loads",
    "force",
    "moment",
    "rdata",
    "grad",
    "tape_work",
    "energy",
    "own_pose",
    "own_solution",
    "own_phi",
    "own_strayed",
    "own_loads",
    "own_force",
    "own_moment",
)
_ASKED = (
    "slots", "turns", "first", "kind", "at", "ints", "floats", "bounds", "own_first", "own_kind", "own_at",
    "marker_body", "marker_frame", "elastic", "shapes", "counts", "further", "home", "bodies", "modal", "integrals",
    "group", "place", "of_marker", "row", "edge", "turn",
)  # fmt: skip
_OF_POINTS = ("kin", "acc", "tape_y")


def _driver(begun: Begun, numbers: Mapping[str, Number]) -> Driver:
    """Return what drives the run, which stands at the present point."""
    run, st, point = begun.run, begun.run.state, begun.point
    n, cells, records = begun.problem.n, begun.cells, run.last_records
    given = run.last_step() if st.steps else None
    last: dict[str, Any] = {
        "last_t": np.zeros(HISTORY), "last_rows": np.zeros((HISTORY, n)), "last_y": np.zeros(n),
        "last_yp": np.zeros(n), "last_table": st.idata.copy(), "last_count": 0, "given_at": -1,
    }  # fmt: skip
    if given is not None:
        count = len(given.nodes)
        last["last_t"][:count], last["last_rows"][:count] = given.nodes, given.rows
        last |= {"last_y": given.y.copy(), "last_yp": given.yp.copy(), "last_table": given.idata.copy()}
        last |= {"last_count": count, "given_at": int(st.steps)}
    own = [number.moved_to(cells) for number in numbers.values()]
    places = [place for number in own for place in number.places]
    return Driver(
        **last,
        t=point.t,
        before=not np.array_equal(point.idata, records.table),
        changed_at=int(records.changed_at),
        jumped_at=-1,
        look_at=int(st.steps),
        watch_steps=int(st.steps),
        watch_t=float(st.t),
        repivots=run.repivots,
        whole=run.options.fixed_pivots,
        jump_y=np.zeros(n),
        jump_yp=np.zeros(n),
        table=records.table.copy(),
        table_before=records.before.copy(),
        cells=cells.astype(np.int64),
        held=point.rows.kept[point.row, run.turns :].copy(),
        values=np.zeros(cells.size),
        is_input=np.array([number.kind == INPUT for number in own], dtype=np.int64),
        loads=np.array([number.loads for number in own], dtype=np.int64),
        first=np.cumsum([0, *(len(number.places) for number in own)]).astype(np.int64),
        place=np.array([place.at for place in places], dtype=np.int64),
        coefficients=np.array([place.size for place in places], dtype=np.int64),
        per_unit=np.array([place.factor for place in places], dtype=float),
        offset=np.array([place.offset for place in places], dtype=float),
        plain=np.array([(place.at, place.size, place.bent) for place in places], dtype=np.int64).ravel(),
        waiting=np.zeros(len(own), dtype=np.int64),
        wanted=np.zeros(len(own)),
        scratch=np.zeros((TERMS + 3, n)),
    )


def _teller(begun: Begun, told: list[Told], asked: Expressions) -> tuple[Teller, LUPlan, np.ndarray, np.ndarray]:
    """Return what tells outputs, a plan for its matrix, and the pattern of that."""
    problem, model = begun.problem, begun.system.model
    indptr, indices, slots = _pattern(begun)
    names, modes = model.names, sum(model.modes)
    most = max((len(d) for d in model.diagnostics), default=0)
    records = new_records(1, len(names.bodies), len(names.rows), len(names.forces), most, modes)
    n, angles = len(indptr) - 1, int(problem.idata[T.H_QF] - problem.idata[T.H_THETA])
    # a plan of a diagonal matrix stands there until pivots are chosen
    plan = analyse(np.arange(n + 1), np.arange(n), np.ones(n), np.ones(n))
    places = [place for one in told for place in one.places]
    teller = Teller(
        elements=records.loads.shape[1],
        columns=records.loads.shape[2],
        slots=slots.astype(np.int64),
        turns=np.sin(1.0 + np.arange(angles)),
        rdata=np.zeros(len(problem.rdata)),
        work=np.zeros(problem.work_size),
        vals=np.zeros(len(indices)),
        pose=records.pose,
        solution=records.solution,
        phi=records.phi,
        strayed=records.strayed,
        loads=records.loads.ravel(),
        force=records.force.ravel(),
        moment=records.moment.ravel(),
        first=np.cumsum([0, *(len(one.places) for one in told)]).astype(np.int64),
        kind=np.array([kind for kind, _ in places], dtype=np.int64),
        at=np.array([at for _, at in places], dtype=np.int64),
        out=np.zeros(len(told)),
        ints=asked.ints,
        floats=asked.floats,
        bounds=asked.bounds,
        own_first=asked.first,
        own_kind=asked.kind,
        own_at=asked.at,
        marker_body=asked.marker_body,
        marker_frame=asked.marker_frame,
        elastic=asked.elastic,
        shapes=asked.shapes,
        counts=asked.counts,
        further=asked.further,
        times=np.zeros(2),
        kin=np.zeros((2 * asked.frames, KIN_COLUMNS)),
        acc=np.zeros((2 * asked.frames, 6)),
        tape_y=np.zeros(2 * (len(asked.first) - 1)),
        angles=np.concatenate([asked.starts, np.zeros(asked.starts.size)]),
        known=np.full(2 * asked.starts.size, np.nan),
        grad=np.zeros(max(1, asked.gradient)),
        tape_work=np.zeros(asked.work),
        home=np.zeros(0) if problem.home is None or begun.by_axes else _evaluator(begun).matrix_at_home(),
        energy=np.zeros(1),
        **_inertias(begun, told),
        **_members(begun, records),
    )
    return teller, plan, indptr, indices


def _pattern(begun: Begun) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (indptr, indices, slots) of the matrix of accelerations; where there is none, of one of a single entry."""
    problem = begun.problem
    if begun.by_axes:
        return np.array([0, 1]), np.array([0]), np.zeros(1, dtype=np.int64)
    return pattern(problem.idata, problem.rdata, problem.work_size, problem.t0, problem.y0)


def _evaluator(begun: Begun) -> Evaluator:
    """Return what Python evaluates outputs with."""
    if begun.members is None:
        return Evaluator(begun.problem)
    return MemberEvaluator(begun.problem, begun.members)


def _inertias(begun: Begun, told: list[Told]) -> dict[str, np.ndarray]:
    """Return what the kinetic energy is found with, if an output tells it."""
    if any(kind == ENERGY for one in told for kind, _ in one.places):
        return inertias(begun.system.model)._asdict()
    return {"bodies": np.zeros((0, 0)), "modal": np.zeros(0, dtype=np.int64), "integrals": np.zeros(0)}


def _members(begun: Begun, whole: Records) -> dict[str, np.ndarray]:
    """Return what bodies that are integrated as one are made of, and room for records of these."""
    members, tables = begun.members, begun.problem.idata
    if members is None or begun.by_axes:
        own = new_records(1, 0, 0, 0, 0)
    else:
        own = new_records(
            1, int(tables[T.H_BODIES]) - 1, int(tables[T.H_ROWS]), int(tables[T.H_FORCES]), int(tables[T.H_DIAGNOSTICS])
        )
        assert own.loads.shape == whole.loads.shape
    made = {f"own_{name}": part for name, part in own._asdict().items()}
    made |= {f"own_{name}": made[f"own_{name}"].ravel() for name in ("loads", "force", "moment")}
    if members is None:
        nothing = np.zeros(0, dtype=np.int64)
        return made | dict.fromkeys(Members._fields, nothing) | {"place": np.zeros(0)}
    return made | {name: np.ascontiguousarray(part).ravel() for name, part in members._asdict().items()}
