"""Order and step size of the next step, from divided differences over the actual history."""

from __future__ import annotations

from gearmbs.dae.integrators.bdf import HISTORY, divided_difference_norm, local_error, step_for_error
from gearmbs.dae.integrators.run_state import KINK_MEMORY, rows_from, times_from
from gearmbs.kernels.jit import njit

TARGET = 0.2
"""Local error, in tolerances, that steps aim at where derivatives jump, which leaves room for the next jump, and with
multipliers, whose rounding grows with every step that is shorter: chains of linkages at 1e-11 pass their singular
positions with it and not with a third of it."""
RAISE_GAIN = 1.15
"""Ratio of the step at the higher order to that at the present one from which the order is raised. LSODE's biases
against either, 1.4 and 1.2, come to 1.17 (A. C. Hindmarsh, "ODEPACK", in Scientific Computing, North-Holland 1983).
Tuned, see the table of constants."""
GROW_FROM = 1.2
"""Ratio to the present step from which the next one is taken longer: smaller gains are not worth the pause of order + 1
steps before the next change, nor the factors that serve up to `GAMMA_DRIFT`. Tuned, see the table of constants."""
GROW_AT_MOST = 2.0
"""Largest ratio of a step to the one before, but for starts within a run; DASSL and IDA double at most, too."""
START_TARGET = 0.02
"""Local error of the first steps behind a jump, in tolerances: those of a start have the same sign, and at a fifth of a
tolerance each twenty jumps add up to thirty."""
START_GROWTH = 8.0
"""The same in the first steps, which are shorter than those that follow by as much as the tolerance is small."""
SHRINK_FROM = 0.9
"""Ratio to the present step from which the next one is taken shorter; in DASSL and IDA a shorter one is 0.9 of it at
most, too. The error of a step that stays as it is exceeds its target by less than a factor 2.1 at order 6."""
SHRINK_AT_MOST = 0.5
"""Smallest ratio of the step after an accepted one to it, as in DASSL and IDA."""
FAIL_SHRINK = (0.1, 0.8)
UNFORESEEN = 0.6
"""Local error of an accepted step, in tolerances, that differences have not foretold: three times what steps aim at,
where one that stays as it is exceeds that by less than a factor 2.1. Of pendulums, linkages and tops at 1e-5 and 1e-8
one step of 5 900 has it, and three of 842 of Andrews's squeezer; of lines of 1 to 30 meshes one in 18 to 50."""


@njit(cache=True, nogil=True, error_model="numpy")
def meets_kinks(st):
    """Return whether derivatives of the solution seem to jump, as at contacts: errors have not been foretold lately.

    Where they are continuous, the differences foretell the error of the next step, and hardly one in a thousand is
    refused; where they jump, no difference knows of it before, and the step that meets the jump is refused. Jumps come
    in groups, and few steps lie between them. Of many contacts the steps are so short that most jumps pass the error
    test: an error beyond `UNFORESEEN` soon after a refused step, or another one, counts as one.
    """
    return st.since_kink < KINK_MEMORY


@njit(cache=True, nogil=True, error_model="numpy")
def target(st, k):
    """Return the local error, in tolerances, that steps of order k aim at.

    Of a smooth solution the errors of all steps have one sign, and add up. A code that refuses a step at the tolerance
    and doubles one whose error allows twice the size, as DASSL and IDA do, works between 2^-(k+1) and 1, with the
    geometric mean 2^-(k+1)/2. Steps that stay at their target must not aim above it, to be as accurate at the same
    tolerance: at a fifth they lost half a digit over the thousands of steps of orders 5 and 6 of a relaxation.
    """
    return TARGET if st.constrained or meets_kinks(st) else min(TARGET, 2.0 ** (-0.5 * (k + 1)))


@njit(cache=True, nogil=True, error_model="numpy")
def difference_norm(st, k):
    """Return the norm of the difference of order k + 1, over the newest k + 2 points."""
    return divided_difference_norm(times_from(st, 0), k + 2, rows_from(st, 0), st.w_error, st.value)


@njit(cache=True, nogil=True, error_model="numpy")
def step_at_order(st, k, h, nodes):
    """Return the step size at order k from ``nodes[0]``.

    Parameters
    ----------
    st : RunState
    k : int
    h : float
        Size from which the search starts.
    nodes : ndarray
        Times of the past points of the step, newest first.
    """
    return step_for_error(h, nodes, k, difference_norm(st, k), target(st, k))


@njit(cache=True, nogil=True, error_model="numpy")
def step_reaching(st, k, wanted, h, nodes, difference):
    """Return the step size at order k, or zero without a search where it is less than ``wanted``.

    ``difference`` is the `difference_norm` of the order; the other parameters are those of `step_at_order`, whose
    search goes by powers and takes far longer than one error.
    """
    if local_error(wanted, nodes, k, difference) > target(st, k):
        return 0.0
    return step_for_error(h, nodes, k, difference, target(st, k))


@njit(cache=True, nogil=True, error_model="numpy")
def step_below(st, k, h, nodes):
    """Return the step size at which the two orders below k agree: the smaller of theirs.

    One difference may be small by chance, where its derivative passes through zero; two rarely are. Parameters are
    those of `step_at_order`.
    """
    below = step_at_order(st, k - 1, h, nodes)
    return min(below, step_at_order(st, k - 2, h, nodes)) if k > 2 else below


@njit(cache=True, nogil=True, error_model="numpy")
def after_start(st):
    """Set order and step size after an accepted step of a new start within a run, until a lower order does as well.

    Steps grow at order one up to the size that the error test allows, then the order is raised with every step, as far
    as there are points and the step grows by it. Such ratios of steps are not stable for ever, but for the few steps of
    a start they are, and the points, dense where they are old, stand for the derivatives at the start.
    """
    k, h, n_past = st.order, st.h, st.n_past
    nodes = times_from(st, 0)
    if n_past < 3:
        # of a single step the distance from its prediction is all that is known
        ratio = START_GROWTH if st.error <= 0.0 else min((START_TARGET / st.error) ** 0.5, START_GROWTH)
        st.h = h * max(ratio, SHRINK_AT_MOST)
        return
    if n_past < k + 2:
        return
    h_best = step_for_error(h, nodes, k, difference_norm(st, k), START_TARGET)
    if k > 2 and step_for_error(h, nodes, k - 1, difference_norm(st, k - 1), START_TARGET) >= h_best:
        st.starting = False
        after_success(st)
        return
    # a history much shorter than the step would be taken far beyond its ends
    growth = GROW_AT_MOST if k > 1 else START_GROWTH
    st.h = min(max(h_best, SHRINK_AT_MOST * h), growth * h)
    st.since_change = 0
    if h_best < START_GROWTH * h:
        if k == st.max_order:
            st.starting = False
        else:
            st.order = k + 1


@njit(cache=True, nogil=True, error_model="numpy")
def after_success(st):
    """Set order and step size after an accepted step, the newest point of the history.

    The order is raised only after order + 1 steps without a change or a failure, and only for a clear gain; it is
    lowered as soon as the lower orders allow the same step. Order one lets the step grow without such a pause only at
    the start: later a step that doubles and halves by turns would keep it there for good.
    """
    k, h, n_past = st.order, st.h, st.n_past
    st.since_change += 1
    if st.caution > 0:
        st.caution -= 1
    unchanged = st.since_change > k
    if n_past < k + 2 or (st.fixed_leading and not unchanged):
        # a re-interpolated history tells nothing new before it has been replaced
        return
    nodes = times_from(st, 0)
    best = k
    here, low = difference_norm(st, k), difference_norm(st, k - 1) if k > 1 else 0.0
    if k > 1 and (st.caution > 0 or not unchanged) and local_error(h, nodes, k, here) <= target(st, k):
        # neither longer nor of a higher order, nor shorter; nor lower where the error there, which grows with the step,
        # is too large already: no search is needed to go on
        if local_error(h, nodes, k - 1, low) > target(st, k - 1):
            return
    h_best = step_for_error(h, nodes, k, here, target(st, k))
    if k > 1:
        h_low = step_reaching(st, k - 1, h_best, h, nodes, low)
        # see `step_below`
        if h_low >= h_best and (
            k == 2
            or meets_kinks(st)
            or step_reaching(st, k - 2, h_best, h, nodes, difference_norm(st, k - 2)) >= h_best
        ):
            best = k - 1
            h_best = h_low
    if best == k and k < st.max_order and n_past >= k + 3 and unchanged and st.caution == 0:
        h_high = step_reaching(st, k + 1, RAISE_GAIN * h_best, h, nodes, difference_norm(st, k + 1))
        if h_high > RAISE_GAIN * h_best:
            best = k + 1
            h_best = h_high
    ratio = h_best / h
    if best != k:
        st.order = best
        st.since_change = 0
    if ratio > GROW_FROM:
        if (unchanged or (k == 1 and n_past < HISTORY) or best != k) and st.caution == 0:
            st.h = h * min(ratio, GROW_AT_MOST)
            st.since_change = 0
    elif ratio < SHRINK_FROM:
        st.h = h * max(ratio, SHRINK_AT_MOST)
        st.since_change = 0


@njit(cache=True, nogil=True, error_model="numpy")
def after_error_failure(st, error, fails):
    """Set order and step size after the error test failed for the ``fails``-th time at this step.

    The newest point of the history is the rejected result, so that a kink within the step shows in the differences and
    takes the order down with the step.

    Parameters
    ----------
    st : RunState
    error : float
        Local error in units of the tolerance.
    fails : int
    """
    k, h, n_past = st.order, st.h, st.n_past
    low, high = FAIL_SHRINK
    if n_past < 2:
        factor = 0.8 * (TARGET / error) ** 0.5
        best = 1
    elif fails >= 3:
        factor = 0.25
        best = 1
    else:
        nodes = st.nodes
        past = times_from(st, 1)
        for m in range(min(n_past, k + 1)):
            nodes[m] = past[m]
        best = k
        h_best = step_at_order(st, k, h, nodes)
        lowest = max(1, k - 1) if fails == 1 else 1
        while best > lowest and h_best <= step_below(st, best, h, nodes):
            best -= 1
            h_best = step_at_order(st, best, h, nodes)
        factor = h_best / h
        if fails > 1:
            factor = min(factor, 0.5)
    st.h = h * min(max(factor, low), high)
    st.order = best
    st.since_change = 0
    st.caution = 1 + best
