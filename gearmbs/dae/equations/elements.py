"""The equations of one force element, or what a body's mass and inertia add to its own, alone.

They are all that numbers of elements and bodies enter, so that derivatives by these take no whole residual.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.body import has_angles, inertia_times
from gearmbs.dae.equations.constraints.terms import dot3
from gearmbs.dae.equations.kinematics import update_functions
from gearmbs.dae.equations.loads import expressions, time_functions
from gearmbs.dae.equations.loads.forces import evaluate_element
from gearmbs.dae.equations.residual import S_VECTOR, S_WRENCH, add_own_states
from gearmbs.dae.equations.rotation import KIN_ADOT, KIN_AXES, KIN_W
from gearmbs.dae.equations.unknowns import NUMBERS
from gearmbs.dae.problem import RESIDUAL_SIG, Alone
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, uncounted, vector_at


@njit(cache=True, error_model="numpy", forceinline=True)
def inertia_residual(b, yp, tab, out):
    """Write what a rigid body's mass and inertia add to its equations to ``out``."""
    at, body, kin = tab.at[b], tab.body[b], tab.kin[b]
    for c in range(3):
        out[at[T.AT_U] + c] = body[T.BODY_MASS] * (yp[at[T.AT_U] + c] - tab.gravity[c])
    if not has_angles(at):
        return
    s = vector_at(tab.scratch, S_VECTOR, 6)
    inertia_times(kin, body, kin, KIN_W, s, 0, vector_at(tab.scratch, S_VECTOR + 6, 3))
    for c in range(3):
        out[at[T.AT_P] + c] = -dot3(kin, KIN_ADOT + 3 * c, s, 0)
        out[at[T.AT_EPS] + c] = -dot3(kin, KIN_AXES + 3 * c, s, 0)


@njit(RESIDUAL_SIG, cache=True, error_model="numpy")
def element_residual(t, y, yp, out, idata, rdata, work):
    """Evaluate the equations of one element into ``out``: definitions of its loads, and of its own states.

    ``residual`` has just been called at the same t, y and y', and has left the kinematics there. The number of the
    element's row stands where the header otherwise has the mode of the Jacobian; behind those of all elements follow
    those of bodies, which stand for what `inertia_residual` writes.
    """
    y, yp, out, idata = uncounted(y), uncounted(yp), uncounted(out), uncounted(idata)
    tab = T.unpack(idata, rdata, work)
    f = idata[T.H_MODE]
    if f >= idata[T.H_FORCES]:
        inertia_residual(f - idata[T.H_FORCES], yp, tab, out)
        return
    update_functions(t, tab)
    row = tab.force[f]
    if row[T.FORCE_KIND] == T.COMPILED:
        evaluate_element(row, t, y, tab, row[T.FORCE_WANT])
        add_own_states(row, y, yp, idata, tab.state, tab.scratch, out)
    count = row[T.FORCE_WRENCHES] if row[T.FORCE_KIND] == T.COMPILED else 1
    for part in range(count):
        row = tab.force[f + part]
        wrench = vector_at(tab.scratch, row[T.FORCE_WORK] + 6 * part, 6)
        if row[T.FORCE_KIND] != T.COMPILED:
            wrench = vector_at(tab.scratch, S_WRENCH, 6)
            jac = matrix_at(tab.scratch, T.SCRATCH_FIXED, 6, row[T.FORCE_WIDTH])
            expressions.load(row, t, y, tab, wrench, jac, np.int64(0))
        for c in range(3):
            if row[T.FORCE_F] >= 0:
                out[row[T.FORCE_F] + c] = y[row[T.FORCE_F] + c] - wrench[c]
            if row[T.FORCE_N] >= 0:
                out[row[T.FORCE_N] + c] = y[row[T.FORCE_N] + c] - wrench[3 + c]


def alone(idata: np.ndarray) -> Alone:
    """Return how the equations of single elements and bodies are evaluated, of packed tables."""
    forces = int(idata[T.H_FORCES])
    at = T.rows_in(idata, int(idata[T.H_I_AT]), int(idata[T.H_BODIES]), T.AT_COLUMNS)

    def owners(places: np.ndarray) -> list[tuple[int, np.ndarray]] | None:
        found = []
        claimed = np.zeros(places.size, dtype=bool)
        of_functions = _numbers_of_functions(idata)
        for f, row in enumerate(T.forces_in(idata)):
            mine = np.zeros(places.size, dtype=bool)
            seen = _functions_seen(idata, row)
            for first, size in [*_numbers(idata, row), *(of_functions[k] for k in seen if k in of_functions)]:
                mine |= (places >= first) & (places < first + size)
            if mine.any():
                found.append((f, _equations(idata, f)))
                claimed |= mine
        for b in range(1, int(idata[T.H_BODIES])):
            first = int(idata[T.H_R_BODY]) + T.BODY_COLUMNS * b
            mine = (places >= first) & (places < first + T.BODY_COLUMNS)
            if mine.any() and at[b, T.AT_MODES] == 0:
                blocks = (T.AT_U, T.AT_P, T.AT_EPS) if at[b, T.AT_ANGLES] else (T.AT_U,)
                rows = np.concatenate([np.arange(at[b, k], at[b, k] + 3) for k in blocks])
                found.append((forces + b, rows))
                claimed |= mine
        return found if claimed.all() else None

    return Alone(element_residual, T.H_MODE, NUMBERS, forces, owners)


def _numbers(idata: np.ndarray, row: np.ndarray) -> list[tuple[int, int]]:
    """Return first place and size of each run of numbers that an element has for itself."""
    reals, integers = int(idata[T.H_R_EXTRA]), int(idata[T.H_I_EXTRA])
    at = integers + int(row[T.FORCE_IEXTRA])
    if row[T.FORCE_KIND] == T.COMPILED:
        return [(reals + int(row[T.FORCE_REXTRA]), int(idata[at + 1]))] if row[T.FORCE_PART] == 0 else []
    if row[T.FORCE_KIND] != T.EXPRESSION:
        return []
    first = at + 2 + expressions.LOAD_TAPES
    line = idata[at + 2 + expressions.LOAD_MODE] == expressions.LINE
    return [_reals_of_tape(idata, int(k)) for k in idata[first : first + (1 if line else 6)] if k >= 0]


def _reals_of_tape(idata: np.ndarray, tape: int) -> tuple[int, int]:
    row = T.rows_in(idata, int(idata[T.H_I_TAPE]), int(idata[T.H_TAPES]), T.TAPE_COLUMNS)[tape]
    return int(idata[T.H_R_EXTRA] + row[T.TAPE_R]), int(row[T.TAPE_R_SIZE])


def _functions_seen(idata: np.ndarray, row: np.ndarray) -> list[int]:
    """Return the functions of time that an element is handed the values of."""
    if row[T.FORCE_KIND] != T.COMPILED or row[T.FORCE_PART] != 0:
        return []
    at = int(idata[T.H_I_EXTRA] + row[T.FORCE_SEES])
    at += 1 + int(idata[at])
    return idata[at + 1 : at + 1 + int(idata[at])].tolist()


def _numbers_of_functions(idata: np.ndarray) -> dict[int, tuple[int, int]]:
    """Return first place and size of the numbers of each function of time that enters no constraint."""
    functions = T.rows_in(idata, int(idata[T.H_I_FUNCTION]), int(idata[T.H_FUNCTIONS]), T.FUNCTION_COLUMNS)
    rows = T.rows_in(idata, int(idata[T.H_I_ROW]), int(idata[T.H_ROWS]), T.ROW_COLUMNS)
    terms = T.rows_in(idata, int(idata[T.H_I_TERM]), int(idata[T.H_TERMS]), T.TERM_COLUMNS)
    taken = {*rows[:, T.ROW_FUNCTION].tolist(), *terms[:, T.TERM_FUNCTION].tolist()}
    closed = sorted(int(at) for kind, at in functions.tolist() if kind != time_functions.TAPE)
    ends = dict(pairwise([*closed, int(idata[T.H_N_FUNCTION_R])]))
    found = {}
    for k, (kind, at) in enumerate(functions.tolist()):
        if k in taken:
            continue
        if kind == time_functions.TAPE:
            found[k] = _reals_of_tape(idata, at)
        else:
            found[k] = (int(idata[T.H_R_FUNCTION]) + at, ends[at] - at)
    return found


def _equations(idata: np.ndarray, f: int) -> np.ndarray:
    """Return the places of the equations of an element, by the number of its first row."""
    rows = T.forces_in(idata)
    compiled = rows[f, T.FORCE_KIND] == T.COMPILED
    found = [
        np.arange(row[column], row[column] + 3)
        for row in rows[f : f + (rows[f, T.FORCE_WRENCHES] if compiled else 1)]
        for column in (T.FORCE_F, T.FORCE_N)
        if row[column] >= 0
    ]
    if compiled:
        found.append(np.arange(rows[f, T.FORCE_Z], rows[f, T.FORCE_Z] + rows[f, T.FORCE_STATES]))
    return np.concatenate(found).astype(np.int64)
