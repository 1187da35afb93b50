"""Where a held run lies in memory, for kernels that are handed one number, and what of it a state takes along.

What is copied for a state are a few stretches of memory, one behind the other, see `pack`: seventy arrays one by one
would take longer than some steps of a small model do.
"""

from __future__ import annotations

from gearmbs.dae.integrators.algebraic.part import PART_TYPE
from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.run_state import STATE_TYPE, WINDOW, copy
from gearmbs.dae.integrators.stepping.jumps import steer
from gearmbs.dae.integrators.stepping.reach import REACHED, reach, stand_behind
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE
from gearmbs.kernels.bound import FUNCTIONS_TYPE
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import boolean, float64, int64, types
from gearmbs.kernels.placed import struct_at
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector
from gearmbs.kernels.views import matrix_at, vector_at


class Standing(Struct):
    """Addresses of the structs of a run, and its memory as stretches of 64-bit words.

    Attributes
    ----------
    state, part, plan, factors, functions, advance : int
        Addresses.
    row, first, count : int
        The row of the next point, the first that is not kept, and how many there are.
    look_at : int
        Steps from which on somebody has to look at how the run gets on.
    scalars, part_scalars : ndarray
        Those of the state, and of the part that is solved at an instant.
    numbers : ndarray
        Arrays of the state that a continuation needs, behind the window.
    factor_numbers : ndarray
        Those of the factors.
    cells : ndarray of int
        Places of named numbers in the table of numbers.
    values : ndarray
        Scratch: what is to stand there.
    places : ndarray of int, shape (3 p,)
        Places of inputs among the cells: of the time before the coefficients, and the number of these.
    scratch : ndarray
        See `gearmbs.dae.integrators.stepping.jumps.pass_jump`.
    """

    state: int
    part: int
    plan: int
    factors: int
    functions: int
    advance: int
    row: int
    first: int
    count: int
    look_at: int
    scalars: Vector
    part_scalars: Vector
    numbers: Vector
    factor_numbers: Vector
    cells: IntVector
    values: Vector
    places: IntVector
    scratch: Matrix


standing_at = struct_at(Standing.struct_kind)
state_at = struct_at(STATE_TYPE)
part_at = struct_at(PART_TYPE)
plan_at = struct_at(PLAN_TYPE)
factors_at = struct_at(FACTORS_TYPE)
functions_at = struct_at(FUNCTIONS_TYPE)

AHEAD = 4
"""More than the codes of `go_next` are less than zero."""
_VEC = float64[::1]


@njit(int64(int64, float64), cache=True, nogil=True, error_model="numpy")
def go_on(standing, t):
    """Go on to a time as `reach` does, and write the point to the next row; return what it does.

    Parameters
    ----------
    standing : int
        Address of the run's `Standing`.
    t : float
        As of `reach`.
    """
    own = standing_at(standing)
    return reach(
        functions_at(own.functions),
        state_at(own.state),
        part_at(own.part),
        plan_at(own.plan),
        factors_at(own.factors),
        own.advance,
        t,
        own.row,
        own.look_at,
    )


@njit(int64(int64, float64, boolean), cache=True, nogil=True, error_model="numpy")
def go_next(standing, t, keep):
    """Go on as `go_on` does, and let the point be the present one, as `HeldRun` does at most points.

    Parameters
    ----------
    standing, t
        As of `go_on`.
    keep : bool
        Whether the point is to be kept: else the next but one is written over it.

    Returns
    -------
    row : int
        The row of the point; -1 less what `go_on` returns where something is left to do.
    """
    code = go_on(standing, t)
    own = standing_at(standing)
    row = own.row
    if code != REACHED or row + 2 >= own.count:
        return -1 - code
    if keep:
        own.first = row + 1
        own.row = row + 1
    else:
        own.row = own.first + 1 if row == own.first else own.first
    return row


@njit(
    int64(int64, float64, int64, int64, int64, float64, float64),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def steer_on(standing, t, row, first, count, value, end):
    """Steer as `steer` does; return what it does.

    Parameters
    ----------
    standing : int
        Address of the run's `Standing`.
    t : float
        Within the last step.
    row : int
        Of the outputs: where the values at ``t`` stand.
    first, count : int
        The first of the input's places among all, and how many there are.
    value, end
        As of `steer`.
    """
    own = standing_at(standing)
    st = state_at(own.state)
    return steer(
        functions_at(own.functions),
        st,
        plan_at(own.plan),
        factors_at(own.factors),
        t,
        st.y_out[row],
        st.yp_out[row],
        matrix_at(own.places, 3 * first, count, 3),
        value,
        end,
        own.cells,
        own.values,
        own.scratch,
    )


@njit(
    int64(int64, float64, int64, int64, int64, float64, int64, float64, boolean),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def steer_next(standing, t, row, first, count, value, hold, t_next, keep):
    """Steer, then go on to another time; return what `steer` does, and 4 times `AHEAD` more than what `go_next` does.

    Parameters
    ----------
    standing, t, row, first, count, value
        As of `steer_on`.
    hold : int
        Whether it goes there evenly until ``t_next``, or jumps.
    t_next, keep
        As of `go_next`.
    """
    steered = steer_on(standing, t, row, first, count, value, t_next if hold else t)
    return steered + 4 * (AHEAD + go_next(standing, t_next, keep))


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _pass_on(part, block, first, taking):
    """Copy a stretch of memory to its place in a block, or back; return where the next one stands there."""
    size = part.shape[0]
    place = vector_at(block, first, size)
    if taking:
        copy(part, place)
    else:
        copy(place, part)
    return first + size


@njit(cache=True, nogil=True, error_model="numpy")
def _walk(own, st, row, block, taking):
    """Copy what a continuation needs to a block, one stretch behind the other, or back from it."""
    k = 0
    for part in (own.scalars, own.part_scalars, st.y_out[row], st.yp_out[row], st.window_t):
        k = _pass_on(part, block, k, taking)
    # the scalars, which are there by now, tell which rows are in use
    n = st.y.shape[0]
    _pass_on(vector_at(st.window_y, st.newest * n, min(HISTORY, WINDOW - st.newest) * n), block, k, taking)
    k += HISTORY * n
    for part in (own.numbers, own.factor_numbers):
        k = _pass_on(part, block, k, taking)


@njit(int64(int64, int64, _VEC), cache=True, nogil=True, error_model="numpy")
def pack(standing, row, block):
    """Write what a continuation needs one behind the other; return the order of the last step.

    Parameters
    ----------
    standing : int
        Address of a `Standing`; no step is open.
    row : int
        Where the point stands that the state is one of.
    block : ndarray
        See `gearmbs.dae.integrators.stepping.memory.Layout`.
    """
    own = standing_at(standing)
    st = state_at(own.state)
    _walk(own, st, row, block, True)
    return st.record_order[st.n_records - 1]


@njit(types.void(int64, int64, int64, _VEC), cache=True, nogil=True, error_model="numpy")
def unpack(standing, row, order, block):
    """Let a run be as it was when it was packed, stand behind its last step, and keep the point in a row.

    Parameters
    ----------
    standing, row, block
        As of `pack`.
    order : int
        See `stand_behind`.
    """
    own = standing_at(standing)
    st = state_at(own.state)
    _walk(own, st, row, block, False)
    st.n_crossings = 0
    stand_behind(st, order)
    for c in range(st.kept.shape[0]):
        st.kept_out[row, c] = st.rdata[st.kept[c]]
