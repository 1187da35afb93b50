"""Layout of an integration in arrays: everything the compiled loop needs to stop anywhere and go on.

The names below are indices into the arrays of `RunState`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import float64, int64, types

# return codes of the compiled loop; zero and above are not failures
RUNNING = 0
DONE = 1
TERMINAL = 2
PAUSED = 3
REPIVOT = 4
BUFFER_FULL = 5
FAIL_NOT_FINITE = -3
FAIL_STEP_TOO_SMALL = -4
FAIL_TOO_MANY_REJECTIONS = -5
FAIL_TOO_MANY_STEPS = -7
FAIL_NEWTON = -9

# RunState.real
T = 0
H = 1
T_END = 2
H_MAX = 3
H_MIN = 4
RTOL = 5
GAMMA_J = 6
RATE = 7
GROWTH_MAX = 8
ERROR = 9
H_USED = 10
NEWTON_TOL = 11
GAMMA_BASE = 12
H_TRY = 13
H_REFUSED = 14
NOISE = 15
N_REAL = 16

# RunState.count
ORDER = 0
NPAST = 1
SINCE_CHANGE = 2
JAC_WANTED = 3
JAC_AGE = 4
ERROR_FAILS = 5
NEWTON_FAILS = 6
NAN_FAILS = 7
FRESH = 8
WORST_ERROR = 9
STEPS = 10
ERROR_REJECTIONS = 11
NEWTON_REJECTIONS = 12
RESIDUALS = 13
JACOBIANS = 14
FACTORIZATIONS = 15
SOLVES = 16
NEXT_OUTPUT = 17
NEXT_STOP = 18
N_RECORDS = 19
N_CROSSINGS = 20
WORST = 21
MAX_ORDER_ALLOWED = 22
MAX_ITERATIONS = 23
FIXED_LEADING = 24
INTERPOLATE = 25
HAS_HOOK = 26
HAS_EVENTS = 27
KEEP_ROWS = 28
MAX_STEPS = 29
CAUTION = 30
SINGULAR_FAILS = 31
SHIFTED = 32
STALE = 33
SLOPE_AGE = 34
DROP_LEVEL = 35
DROP_AGE = 36
DROP_ROUNDS = 37
NOISY = 38
NOISY_RUN = 39
SETTLED = 40
N_COUNT = 41

# rows of RunState.vec
Y = 0
YP = 1
Y_PRED = 2
YP_PRED = 3
RES = 4
DELTA = 5
W_ERROR = 6
W_NEWTON = 7
ATOL = 8
Y_INT = 9
YP_INT = 10
YP_START = 11
IS_CONTROLLED = 12
IS_TESTED = 13
IS_DIFFERENTIAL = 14
N_VEC = 15

# rows of RunState.small
VALUE = 0
SLOPE = 1
NODES = 2
WEIGHTS = 3
N_SMALL = WEIGHTS + 8

_VEC = float64[::1]
_IVEC = int64[::1]
_MAT = float64[:, ::1]


class RunState(NamedTuple):
    """Arrays of one run.

    Attributes
    ----------
    real, count : ndarray
        Scalars, indexed by the names of this module.
    times : ndarray, shape (8,)
        Times of the stored points, newest first. During a step the first is the step's end (SHIFTED is 1).
    hist : ndarray, shape (8, n)
        Values at these times.
    vec : ndarray, shape (N_VEC, n)
        Vectors of the current step.
    small : ndarray, shape (N_SMALL, 16)
        Coefficients of the current step.
    jac, jac_slope, matrix : ndarray
        CSC values: the Newton matrix at its last evaluation, its derivative dG/dy' by the leading coefficient, and the
        matrix carried over to the current leading coefficient, which is the one that is factored.
    idata, rdata, work : ndarray
        Tables and scratch of the problem.
    stops : ndarray
        Times to land on; after each the run starts afresh at order one.
    outputs : ndarray, shape (m,)
        Output times.
    y_out, yp_out : ndarray, shape (m, n)
        Outputs.
    rec_t, rec_h, rec_y, rec_order : ndarray
        Accepted points since the last call.
    g_old, g_new : ndarray
        Event functions at the last accepted point and at the new one.
    event_rules : ndarray of int64, shape (3, n_events)
        Direction and action of each event, and the crossings left until a stop.
    hit_t, hit_which, hit_y : ndarray
        Crossings since the last call.
    """

    real: np.ndarray
    count: np.ndarray  # type: ignore[assignment]
    times: np.ndarray
    hist: np.ndarray
    vec: np.ndarray
    small: np.ndarray
    jac: np.ndarray
    jac_slope: np.ndarray
    matrix: np.ndarray
    idata: np.ndarray
    rdata: np.ndarray
    work: np.ndarray
    stops: np.ndarray
    outputs: np.ndarray
    y_out: np.ndarray
    yp_out: np.ndarray
    rec_t: np.ndarray
    rec_h: np.ndarray
    rec_y: np.ndarray
    rec_order: np.ndarray
    g_old: np.ndarray
    g_new: np.ndarray
    event_rules: np.ndarray
    hit_t: np.ndarray
    hit_which: np.ndarray
    hit_y: np.ndarray


STATE_TYPE = types.NamedTuple(
    (
        _VEC,
        _IVEC,
        _VEC,
        _MAT,
        _MAT,
        _MAT,
        _VEC,
        _VEC,
        _VEC,
        _IVEC,
        _VEC,
        _VEC,
        _VEC,
        _VEC,
        _MAT,
        _MAT,
        _VEC,
        _VEC,
        _MAT,
        _IVEC,
        _VEC,
        _VEC,
        int64[:, ::1],
        _VEC,
        _IVEC,
        _MAT,
    ),
    RunState,
)
