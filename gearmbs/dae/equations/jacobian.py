"""The exact sparse Jacobian dG/dy + cj dG/dy' of the residual, and its pattern.

One routine walks through the entries in a fixed order.  Asked for the pattern it records their places;
asked for numbers it adds each entry to its slot of the CSC values, so both can never disagree.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.body import body_entries
from gearmbs.dae.equations.constraints.jacobian import row_entries, tape_row_entries
from gearmbs.dae.equations.kinematics import update_tables
from gearmbs.dae.equations.loads.jacobian import element_entries, load_entries, state_entries
from gearmbs.dae.equations.residual import S_TERM
from gearmbs.dae.equations.unknowns import COUNT, NUMBERS, PLACES, compressed
from gearmbs.dae.problem import JACOBIAN_SIG
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import uncounted, vector_at


@njit(JACOBIAN_SIG, cache=True, error_model="numpy")
def jacobian(t, y, yp, cj, vals, idata, rdata, work):
    """Evaluate dG/dy + cj dG/dy' into ``vals``, CSC order.

    Asked for it in the header, count the entries or write their rows and columns instead.

    Parameters
    ----------
    t
        Time, s.
    y, yp
        Unknowns and their derivatives.
    cj
        Factor of dG/dy'.
    vals : ndarray
        Values in CSC order, or what the header asks for.
    idata, rdata, work : ndarray
        The packed tables and the work array.
    """
    y, yp, vals, idata = uncounted(y), uncounted(yp), uncounted(vals), uncounted(idata)
    tab = T.unpack(idata, rdata, work)
    mode = idata[T.H_MODE]
    update_tables(t, y, tab, True)
    slot = tab.slot
    if mode == NUMBERS:
        for j in range(vals.size):
            vals[j] = 0.0
        for j in range(idata[T.H_QF] - idata[T.H_THETA]):
            tab.seen[j] = y[idata[T.H_THETA] + j]
    # a literal 0 would make numba compile every callee once more
    k = np.int64(0)
    for b in range(1, idata[T.H_BODIES]):
        s = vector_at(tab.scratch, S_TERM, 100)
        k = body_entries(mode, cj, y, tab.at[b], tab.body[b], tab.modal, tab.partial, tab.kin[b], s, slot, vals, k)
    for r in range(idata[T.H_ROWS]):
        k = row_entries(mode, r, y, yp, cj, idata, tab, slot, vals, k)
        if tab.row[r, T.ROW_TAPE] >= 0:
            k = tape_row_entries(mode, t, r, y, yp, cj, idata, tab, slot, vals, k)
    for f in range(idata[T.H_FORCES]):
        row = tab.force[f]
        if row[T.FORCE_KIND] != T.REACTION:
            k = load_entries(mode, tab.marker_body[row[T.FORCE_I]], 1.0, row, y, tab, slot, vals, k)
            k = load_entries(mode, tab.marker_body[row[T.FORCE_J]], -1.0, row, y, tab, slot, vals, k)
        k = element_entries(mode, t, row, y, yp, cj, idata, tab, slot, vals, k)
    for z in range(idata[T.H_STATES]):
        if tab.state[z, T.STATE_TAPE] >= 0:
            k = state_entries(mode, t, z, y, cj, idata, tab, slot, vals, k)
    if mode == COUNT:
        vals[0] = k


def pattern(
    idata: np.ndarray, rdata: np.ndarray, work_size: int, t: float, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (indptr, indices, slots): the CSC pattern and, for each entry in walking order, its place in it.

    It is that of any t and y; functions of the user may be defined at some only.
    """
    n = y.size
    yp, work, count = np.zeros(n), np.zeros(work_size), np.zeros(1)
    ask = idata.copy()
    ask[T.H_MODE] = COUNT
    jacobian(t, y, yp, 1.0, count, ask, rdata.copy(), work)
    places = np.zeros(2 * int(count[0]))
    ask[T.H_MODE] = PLACES
    jacobian(t, y, yp, 1.0, places, ask, rdata.copy(), work)
    return compressed(places.reshape(-1, 2).astype(np.int64), n)
