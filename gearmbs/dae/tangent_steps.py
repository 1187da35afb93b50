"""The compiled loop of forward sensitivities: their equations at the points of a run, for all parameters.

Parameters stand in groups of `LANES` side by side, so that what is the same for all of them is done for eight at once.
"""

from __future__ import annotations

from numba import float64, int64

from gearmbs.dae.integrators.bdf import HISTORY, error_constant
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE
from gearmbs.dae.linalg.several import solve_lanes
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, factor, solve
from gearmbs.dae.problem import EPS, HISTORY_CHANGED
from gearmbs.dae.result import lagrange_weights
from gearmbs.dae.tangent_jumps import cross, look_for_jumps
from gearmbs.dae.tangent_points import AFRESH, END_OF_STEP, JUMP, SHORT
from gearmbs.dae.tangent_track import BY, TRACK_TYPE, group_at, groups, lane_of, size_of_move, slot_of
from gearmbs.kernels.bound import unbound
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, all_lanes, lanes_at, larger_number, magnitude, put_lanes
from gearmbs.kernels.pointers import FUNCTIONS_TYPE

TOGETHER = 3
"""Steps that are looked at for jumps at once: a fourth difference over their ends takes one evaluation."""
BEGINNING, LOOKED_AT = 64, 16
"""Points at the start of which each parameter is moved to both sides, and of how many later ones one."""
BENT = 1e-6
"""Bend of the residual with a parameter, as part of its change, from which on that is moved to both sides. Surfaces
that a length moves by a nanometre are some thousand deep in each other: what is left of the bend is of terms a thousand
times the result."""
STAYS = 4096
"""Points for which it stays so: it may bend only now and then, as where surfaces come together."""
SHARP = 1e-4
"""The same from which on what is left of both sides, the square of the bend, may be seen a thousand times as large."""
ONE_SIDED = 0.5
"""The same from which on one side is taken alone: where the equations jump the bend is as large as the change."""
ROUNDED = 64.0
"""Roundings of the terms of an equation that such a bend is not told from: each is a product of some factors."""
_VEC, _MAT, _IVEC = float64[::1], float64[:, ::1], int64[::1]


@njit(cache=True, nogil=True, error_model="numpy")
def _foretell(tr, k, past, g):
    """Write what the past says of a group's sensitivities to their rows, and begin its right-hand side.

    Parameters
    ----------
    tr : Track
        In ``slope`` the slopes of the polynomial through the new point and k past ones, in ``value`` the weights with
        which ``past`` points foretell the next.
    k, past, g : int
    """
    n, s, rates, sides = tr.scale.shape[0], tr.s, tr.rate, tr.sides
    new, side = group_at(tr, 0, g), n * g
    # two at a time: half as much is fetched
    for j in range(0, past, 2):
        two = j + 1 < past
        start, next_start = group_at(tr, j + 1, g), group_at(tr, j + 2 if two else j + 1, g)
        weight, next_weight = tr.value[j], tr.value[j + 1] if two else 0.0
        slope, next_slope = tr.slope[j + 1] if j < k else 0.0, tr.slope[j + 2] if j + 1 < k else 0.0
        if j == 0:
            for i in range(n):
                known, beside = lanes_at(s, start + i), lanes_at(s, next_start + i)
                # tells the error
                put_lanes(s, new + i, weight * known + next_weight * beside)
                put_lanes(rates, i, slope * known + next_slope * beside)
            continue
        for i in range(n):
            known, beside = lanes_at(s, start + i), lanes_at(s, next_start + i)
            put_lanes(s, new + i, lanes_at(s, new + i) + (weight * known + next_weight * beside))
            put_lanes(rates, i, lanes_at(rates, i) + (slope * known + next_slope * beside))
    for i in range(n):
        put_lanes(sides, side + i, all_lanes(0.0))
    rows, columns, slopes = tr.slope_row, tr.slope_col, tr.slope_value
    for q in range(rows.shape[0]):
        to = side + rows[q]
        put_lanes(sides, to, lanes_at(sides, to) - slopes[q] * lanes_at(rates, columns[q]))


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _move(tr, p, by, rdata):
    """Move a parameter by a part of its scale in the table of numbers."""
    for q in range(tr.first[p], tr.first[p + 1]):
        tr.kept[q] = rdata[tr.place[q]]
        rdata[tr.place[q]] += by * tr.weight[q]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _move_back(tr, p, rdata):
    """Take a parameter back to where it was."""
    for q in range(tr.first[p], tr.first[p + 1]):
        rdata[tr.place[q]] = tr.kept[q]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _looks_back(tr, p):
    """Return whether a parameter is moved to both sides: the residual bends with it, or is looked at for that."""
    return tr.points < tr.two_sided[p] or tr.points < BEGINNING or tr.points % LOOKED_AT == 0


@njit(cache=True, nogil=True, error_model="numpy")
def _note_terms(tr, y):
    """Note the sums of the sizes of the terms of each equation, of which it has roundings, without those of rates."""
    terms = tr.terms
    for i in range(terms.shape[0]):
        terms[i] = 0.0
    for j in range(terms.shape[0]):
        for q in range(tr.indptr[j], tr.indptr[j + 1]):
            terms[tr.indices[q]] += abs(tr.vals[q] * y[j])
    for q in range(tr.slope_row.shape[0]):
        terms[tr.slope_row[q]] -= abs(tr.gamma * tr.slope_value[q] * y[tr.slope_col[q]])


@njit(cache=True, nogil=True, error_model="numpy")
def _bend(tr, middle, first, last):
    """Return by how much the residual bends with a parameter, as part of its change, and the parts of both sides.

    Parameters
    ----------
    tr : Track
        In ``plus`` and ``other`` the residual with the parameter moved up and down.
    middle : ndarray
        The residual in between.
    first, last : int
        Range of ``tr.equation`` that is looked at.

    Returns
    -------
    bend, up, down : float
        Parts that the differences to both sides have in the derivative: half each, or the smaller one alone, where the
        residual jumps on the other.
    """
    plus, other, equations, weight = tr.plus, tr.other, tr.equation, tr.row_scale
    up, down, bent = 0.0, 0.0, 0.0
    for q in range(first, last):
        i = equations[q]
        up, down = max(up, abs(plus[i] - middle[i]) * weight[i]), max(down, abs(other[i] - middle[i]) * weight[i])
        bend = abs(plus[i] - 2.0 * middle[i] + other[i])
        if bend > ROUNDED * EPS * tr.terms[i]:
            bent = max(bent, bend * weight[i])
    most = max(up, down)
    bend = bent / most if most > 0.0 else 0.0
    if bend < ONE_SIDED:
        return bend, 0.5, 0.5
    return (bend, 1.0, 0.0) if up < down else (bend, 0.0, 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_difference(tr, p, by, looks_back, middle, first, last):
    """Add minus the rate of the residual with a parameter to its right-hand side, in a range of ``tr.equation``.

    Parameters
    ----------
    tr, middle, first, last
        As of `_bend`.
    p, by : int, float
    looks_back : bool
        Whether the parameter was moved down, too.

    Returns
    -------
    bool
        Whether the residual does not bend too much for that, else nothing is added.
    """
    n, plus, other, sides, equations = tr.scale.shape[0], tr.plus, tr.other, tr.sides, tr.equation
    to = LANES * n * (p // LANES) + p % LANES
    if not looks_back:
        for q in range(first, last):
            i = equations[q]
            sides[to + LANES * i] += (middle[i] - plus[i]) / by
        return True
    bend, up, down = _bend(tr, middle, first, last)
    if bend > BENT:
        tr.two_sided[p] = tr.points + STAYS
    if bend > SHARP and tr.constant_slopes:
        return False
    for q in range(first, last):
        i = equations[q]
        sides[to + LANES * i] += (up * (middle[i] - plus[i]) + down * (other[i] - middle[i])) / by
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _add_along(functions, tr, p, y, yp, idata, rdata, work):
    """Add minus the rate of the residual with a parameter to its right-hand side, by one along what is foretold.

    Where surfaces just touch, what moves one alone bends the residual, and what moves both does not: the unknowns are
    moved with the parameter, and what that changes is taken off again by the exact derivatives.

    Parameters
    ----------
    functions, tr, y, yp, idata, rdata, work
        As of `_step`, with the residual itself in ``minus``.
    p : int
        The parameter; what its past foretells stands in the newest slot.
    """
    n, moved, found, sides = tr.scale.shape[0], tr.between, tr.found, tr.sides
    by = min(BY, size_of_move(tr, 0, p))
    for side in range(2):
        out, step = (tr.plus, by) if side == 0 else (tr.other, -by)
        for i in range(n):
            moved[i] = y[i] + step * tr.s[lane_of(tr, 0, p, i)]
        _move(tr, p, step, rdata)
        functions.residual(tr.looked, moved, yp, out, idata, rdata, work)
        _move_back(tr, p, rdata)
    _, up, down = _bend(tr, tr.minus, tr.first_equation[p], tr.first_equation[p + 1])
    for i in range(n):
        found[i] = (up * (tr.minus[i] - tr.plus[i]) + down * (tr.other[i] - tr.minus[i])) / by
    for j in range(n):
        foretold = tr.s[lane_of(tr, 0, p, j)]
        for q in range(tr.indptr[j], tr.indptr[j + 1]):
            found[tr.indices[q]] += tr.vals[q] * foretold
    for q in range(tr.slope_row.shape[0]):
        found[tr.slope_row[q]] -= tr.gamma * tr.slope_value[q] * tr.s[lane_of(tr, 0, p, tr.slope_col[q])]
    to = LANES * n * (p // LANES) + p % LANES
    for i in range(n):
        sides[to + LANES * i] += found[i]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _evaluate_owners(alone, tr, p, least, y, yp, out, idata, rdata, work):
    """Evaluate the equations of those elements that a parameter's numbers belong to, from a number on.

    Parameters
    ----------
    alone, tr, y, yp, idata, rdata, work
        As of `_step`.
    p, least : int
        The parameter, and the least number of an element.
    out : ndarray, shape (n,)
        Receives them.
    """
    for q in range(tr.first_owner[p], tr.first_owner[p + 1]):
        if tr.owner[q] >= least:
            idata[tr.owner_place] = tr.owner[q]
            alone.residual(tr.looked, y, yp, out, idata, rdata, work)
    idata[tr.owner_place] = tr.owner_rest


@njit(cache=True, nogil=True, error_model="numpy")
def _add_numbers_of_elements(functions, alone, tr, y, yp, idata, rdata, work):
    """Add minus the rates of the residual with those parameters to right-hand sides that enter single elements alone.

    Parameters
    ----------
    functions, alone, tr, y, yp, idata, rdata, work
        As of `_step`. The residual has just been called, so that it is in ``minus`` and kinematics in the scratch.
    """
    for p in range(tr.parameters):
        if tr.first_owner[p] == tr.first_owner[p + 1]:
            continue
        first, last = tr.first_equation[p], tr.first_equation[p + 1]
        middle = tr.minus
        # those that add to equations come last
        if tr.owner[tr.first_owner[p + 1] - 1] >= tr.owner_sums:
            middle = tr.found
            for q in range(first, last):
                middle[tr.equation[q]] = tr.minus[tr.equation[q]]
            _evaluate_owners(alone, tr, p, tr.owner_sums, y, yp, middle, idata, rdata, work)
        _move(tr, p, BY, rdata)
        _evaluate_owners(alone, tr, p, 0, y, yp, tr.plus, idata, rdata, work)
        _move_back(tr, p, rdata)
        looks_back = _looks_back(tr, p)
        if looks_back:
            _move(tr, p, -BY, rdata)
            _evaluate_owners(alone, tr, p, 0, y, yp, tr.other, idata, rdata, work)
            _move_back(tr, p, rdata)
        if not _add_difference(tr, p, BY, looks_back, middle, first, last):
            _add_along(functions, tr, p, y, yp, idata, rdata, work)
            functions.residual(tr.looked, y, yp, tr.minus, idata, rdata, work)


@njit(cache=True, nogil=True, error_model="numpy")
def _moved_residual(functions, tr, p, by, y, yp, out, idata, rdata, work):
    """Evaluate the residual with a parameter moved, and with rates along the past where these do not enter alike.

    Parameters
    ----------
    functions, tr, y, yp, idata, rdata, work
        As of `_step`.
    p, by : int, float
        The parameter, and by which part of its scale.
    out : ndarray, shape (n,)
        Receives it.
    """
    n, moved, rates, lane = tr.scale.shape[0], tr.yp_moved, tr.rate, p % LANES
    for i in range(n):
        moved[i] = yp[i]
    if not tr.constant_slopes:
        for i in range(n):
            moved[i] += by * rates[LANES * i + lane]
    _move(tr, p, by, rdata)
    functions.residual(tr.looked, y, moved, out, idata, rdata, work)
    _move_back(tr, p, rdata)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_numbers(functions, tr, g, y, yp, idata, rdata, work):
    """Add minus the rates of the residual with the other parameters of a group, and with rates, to its side.

    Parameters
    ----------
    functions, tr, y, yp, idata, rdata, work
        As of `_step`, with the residual itself in ``minus``.
    g : int
        The group.
    """
    for p in range(LANES * g, min(LANES * (g + 1), tr.parameters)):
        if tr.first_owner[p] < tr.first_owner[p + 1]:
            continue
        if tr.constant_slopes and tr.first[p] == tr.first[p + 1]:
            continue
        by = BY
        if tr.nonlinear_rates:
            by = min(BY, size_of_move(tr, 0, p))
        _moved_residual(functions, tr, p, by, y, yp, tr.plus, idata, rdata, work)
        looks_back = _looks_back(tr, p)
        if looks_back:
            _moved_residual(functions, tr, p, -by, y, yp, tr.other, idata, rdata, work)
        first, last = tr.first_equation[p], tr.first_equation[p + 1]
        if not _add_difference(tr, p, by, looks_back, tr.minus, first, last):
            _add_along(functions, tr, p, y, yp, idata, rdata, work)


@njit(cache=True, nogil=True, error_model="numpy")
def _solve_group(tr, plan, factors, g):
    """Solve for the sensitivities of a group, which take the place of its right-hand sides."""
    n, sides, one = tr.scale.shape[0], tr.sides, tr.plus
    there = min(tr.parameters - LANES * g, LANES)
    if there > 1 and tr.by_lanes:
        solve_lanes(plan, factors, sides, n * g, tr.solved)
        return
    for lane in range(there):
        at = LANES * n * g + lane
        for i in range(n):
            one[i] = sides[at + LANES * i]
        solve(plan, factors, one, one)
        for i in range(n):
            sides[at + LANES * i] = one[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _take(tr, g, told):
    """Take what has been found of a group, and note its largest values and errors by what had been foretold."""
    n, s, sides, error, largest = tr.scale.shape[0], tr.s, tr.sides, tr.error, tr.largest
    new, side = group_at(tr, 0, g), n * g
    for i in range(n):
        found = lanes_at(sides, side + i)
        local = magnitude(found - lanes_at(s, new + i)) * told
        put_lanes(error, side + i, larger_number(local, lanes_at(error, side + i)))
        put_lanes(largest, side + i, larger_number(magnitude(found), lanes_at(largest, side + i)))
        put_lanes(s, new + i, found)


@njit(cache=True, nogil=True, error_model="numpy")
def _largest_excess(tr, told):
    """Return the largest local error of the step, as part of what is allowed."""
    n, over = tr.scale.shape[0], 0.0
    for p in range(tr.parameters):
        at, most = LANES * n * (p // LANES) + p % LANES, 0.0
        for i in range(n):
            local = told * abs(tr.sides[at + LANES * i] - tr.s[lane_of(tr, 0, p, i)])
            most = max(most, tr.tested[i] * local)
        over = max(over, most / tr.allowed[p])
    return over


@njit(cache=True, nogil=True, error_model="numpy")
def _step(functions, alone, tr, plan, factors, t, k, y, yp, may_be_refused, idata, rdata, work):
    """Find the sensitivities at ``t`` by the order-k formula.

    The history has been moved back by one point: what is sought stands in the newest slot.

    Parameters
    ----------
    functions, alone, tr, plan, factors
        As of `follow_run`.
    t : float
        Where the equations are looked at.
    k : int
    y, yp : ndarray, shape (n,)
        The run there.
    may_be_refused : bool
        Whether a local error that is not allowed refuses the step.
    idata, rdata, work : ndarray
        Tables and scratch of the problem.

    Returns
    -------
    served : bool
        Whether the pivots do, and the local error is allowed: ``tr.over`` is more than 1 if it is not.
    """
    times, nodes = tr.times, tr.nodes
    nodes[0] = t
    for j in range(k):
        nodes[j + 1] = times[j + 1]
    # slopes of the polynomial through the new point and k past ones; the new point's own is gamma
    lagrange_weights(t, nodes, k + 1, tr.value, tr.slope)
    gamma = tr.slope[0]
    tr.gamma, tr.looked, tr.over = gamma, t, 0.0
    tr.points += 1
    functions.jacobian(t, y, yp, gamma, tr.vals, idata, rdata, work)
    growth = factor(plan, factors, tr.vals)
    if not growth <= tr.growth_limit:
        return False
    if tr.jumps or tr.first[tr.parameters] > 0 or not tr.constant_slopes:
        functions.residual(t, y, yp, tr.minus, idata, rdata, work)
    if tr.points < BEGINNING or tr.points % LOOKED_AT == 0:
        _note_terms(tr, y)
    past = min(k + 1, tr.n_past)
    for j in range(past):
        nodes[j] = times[j + 1]
    for j in range(past):
        w = 1.0
        for m in range(past):
            if m != j:
                w *= (t - nodes[m]) / (nodes[j] - nodes[m])
        tr.value[j] = w
    # of the first steps behind a start, of which as many past points tell as the formula takes, nothing is known
    told = error_constant(t, nodes, k) if past > k else 0.0
    for g in range(groups(tr)):
        _foretell(tr, k, past, g)
        if not tr.constant_slopes:
            # of the group whose rates have just been foretold
            _add_numbers(functions, tr, g, y, yp, idata, rdata, work)
    if tr.constant_slopes:
        _add_numbers_of_elements(functions, alone, tr, y, yp, idata, rdata, work)
        for g in range(groups(tr)):
            _add_numbers(functions, tr, g, y, yp, idata, rdata, work)
    for g in range(groups(tr)):
        _solve_group(tr, plan, factors, g)
    if tr.limited:
        tr.over = _largest_excess(tr, told)
        if tr.over > 1.0 and may_be_refused:
            return False
    for g in range(groups(tr)):
        _take(tr, g, told)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _write_outputs(tr, k, outputs, s_out, sp_out):
    """Write sensitivities and their rates at the outputs up to the newest point, on its polynomial."""
    count, n = tr.parameters, tr.scale.shape[0]
    while tr.seen < outputs.shape[0] and outputs[tr.seen] <= tr.times[0]:
        m = tr.seen
        lagrange_weights(outputs[m], tr.times, k + 1, tr.value, tr.slope)
        for p in range(count):
            for i in range(n):
                v, d = 0.0, 0.0
                for j in range(k + 1):
                    known = tr.s[lane_of(tr, j, p, i)]
                    v += tr.value[j] * known
                    d += tr.slope[j] * known
                s_out[m * count + p, i] = v
                sp_out[m * count + p, i] = d
        tr.seen = m + 1


@njit(cache=True, nogil=True, error_model="numpy")
def _change_coordinates(functions, tr, t, rdata, work):
    """Rewrite sensitivities as the hook has rewritten the points that they belong to.

    The hook decides by the first row: it is handed the old points, each with those moved along its sensitivities.
    """
    n, count, past = tr.scale.shape[0], tr.parameters, tr.n_past
    width = 1 + 2 * count
    for j in range(past):
        before = tr.before[slot_of(tr, j)]
        for i in range(n):
            tr.rows[j * width, i] = before[i]
        for p in range(count):
            by = size_of_move(tr, j, p)
            for i in range(n):
                moved = by * tr.s[lane_of(tr, j, p, i)]
                tr.rows[j * width + 1 + 2 * p, i] = before[i] + moved
                tr.rows[j * width + 2 + 2 * p, i] = before[i] - moved
    for i in range(tr.old.shape[0]):
        tr.table[i] = tr.old[i]
    numbers = rdata.copy()  # in which it has counted already
    functions.hook(t, tr.rows, past * width, tr.table, numbers, work)
    for j in range(past):
        for p in range(count):
            by = size_of_move(tr, j, p)
            for i in range(n):
                moved = tr.rows[j * width + 1 + 2 * p, i] - tr.rows[j * width + 2 + 2 * p, i]
                tr.rows[j * width + 1 + 2 * p, i] = moved / (2.0 * by)
    for j in range(past):
        for i in range(n):
            tr.before[slot_of(tr, j), i] = tr.y[j, i]
        for p in range(count):
            for i in range(n):
                tr.s[lane_of(tr, j, p, i)] = tr.rows[j * width + 1 + 2 * p, i]


@njit(cache=True, nogil=True, error_model="numpy")
def _begin_afresh(tr):
    """Let algebraic unknowns begin at the newest point.

    They may jump where a run starts afresh, and be impulses in a start that was repaired.
    """
    for i in range(tr.scale.shape[0]):
        if tr.differential[i] == 0.0:
            tr.y[1, i] = tr.y[0, i]
            tr.before[slot_of(tr, 1), i] = tr.y[0, i]
            for g in range(groups(tr)):
                put_lanes(tr.s, group_at(tr, 1, g) + i, lanes_at(tr.s, group_at(tr, 0, g) + i))


@njit(
    int64(
        FUNCTIONS_TYPE, FUNCTIONS_TYPE, TRACK_TYPE, PLAN_TYPE, FACTORS_TYPE, int64, _VEC, _VEC, _IVEC, _IVEC, _MAT,
        _MAT, _VEC, _MAT, _MAT, _IVEC, _VEC, _VEC,
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)  # fmt: skip
def follow_run(
    bound, of_elements, tr, plan, factors, start, times, looked, orders, flags, y, yp, outputs, s_out, sp_out, idata,
    rdata, work,
):  # fmt: skip
    """Follow a run from point ``start`` on; return the number of points, or the first that needs new pivots.

    Parameters
    ----------
    bound, of_elements, tr, plan, factors
        Functions of the problem, those with the residual of single elements, the `Track`, plan and numbers of the
        factorisation.
    start : int
    times, looked : ndarray, shape (m,)
        Times of the points, and where the equations are looked at: before a jump.
    orders, flags : ndarray of int64, shape (m,)
        Orders of the formula at most; `END_OF_STEP`, `AFRESH` and `JUMP`.
    y, yp : ndarray, shape (m, n)
        The run there.
    outputs, s_out, sp_out : ndarray
        Output times, and sensitivities and their rates there, all parameters of one output after another.
    idata, rdata, work : ndarray
        Tables of the problem as the run has left them at the point before, and scratch.
    """
    functions, alone = unbound(bound), unbound(of_elements)
    n, history, before, left, rates = tr.scale.shape[0], tr.y, tr.before, tr.left, tr.rates
    for m in range(start, times.shape[0]):
        if flags[m] & JUMP != 0:
            cross(functions, tr, plan, factors, min(orders[m], tr.n_past - 1), times[m], yp[m], idata, rdata, work)
            tr.times[0] = times[m]
            history[0] = y[m]
            before[slot_of(tr, 0)] = y[m]
            continue
        afresh = flags[m] & AFRESH != 0
        if afresh:
            tr.n_past = 1
            tr.known = 0
        past = min(tr.n_past, HISTORY - 1)
        for j in range(past, 0, -1):
            tr.times[j] = tr.times[j - 1]
            for i in range(n):
                history[j, i] = history[j - 1, i]
        tr.newest = slot_of(tr, HISTORY - 1)
        k = min(orders[m], past)
        may_be_refused = flags[m] & SHORT == 0
        served = _step(
            functions, alone, tr, plan, factors, looked[m], k, y[m], yp[m], may_be_refused, idata, rdata, work
        )
        if not served:
            for j in range(past):
                tr.times[j] = tr.times[j + 1]
                for i in range(n):
                    history[j, i] = history[j + 1, i]
            tr.newest = slot_of(tr, 1)
            return m
        tr.times[0] = times[m]
        slot = slot_of(tr, 0)
        for i in range(n):
            history[0, i] = y[m, i]
            before[slot, i] = y[m, i]
        if afresh:
            _begin_afresh(tr)
        if tr.jumps:
            for i in range(n):
                left[slot, i] = tr.minus[i]
                rates[slot, i] = yp[m, i]
            tr.known += 1
            tr.unseen += 1
            # as many steps at once as the next polynomial would not go through, and none across a restart
            following = m + 1
            goes_on = following < times.shape[0] and flags[following] & AFRESH == 0
            if tr.unseen == TOGETHER or not goes_on or orders[following] <= tr.unseen:
                look_for_jumps(functions, tr, plan, factors, k, tr.unseen, yp[m], idata, rdata, work)
                tr.unseen = 0
        tr.n_past = min(past + 1, HISTORY)
        _write_outputs(tr, k, outputs, s_out, sp_out)
        if tr.has_hook and flags[m] & END_OF_STEP != 0:
            if functions.hook(times[m], tr.y, tr.n_past, idata, rdata, work) == HISTORY_CHANGED:
                _change_coordinates(functions, tr, times[m], rdata, work)
                tr.known = 0
                for i in range(idata.shape[0]):
                    tr.old[i] = idata[i]
    return times.shape[0]
