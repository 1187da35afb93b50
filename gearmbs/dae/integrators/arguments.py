"""Checks of the integrator's arguments: each error names the argument, its value and what is allowed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearmbs.dae.integrators.bdf import MAX_ORDER


def output_times(t_eval, t0: float, t_end: float | None) -> tuple[np.ndarray, float]:
    if t_eval is None:
        if t_end is None:
            raise ValueError("give t_eval, or t_end for output at every step")
        outputs = np.empty(0)
    else:
        outputs = np.array(t_eval, dtype=float).ravel()
        if not len(outputs) or not np.isfinite(outputs).all() or (np.diff(outputs) <= 0).any():
            raise ValueError("t_eval must be finite and strictly increasing, with at least one time")
        if outputs[0] < t0:
            raise ValueError(f"t_eval starts at {outputs[0]:g}, before the problem's t0 = {t0:g}")
        if t_end is None:
            t_end = float(outputs[-1])
        elif outputs[-1] > t_end:
            raise ValueError(f"t_eval ends at {outputs[-1]:g}, after t_end = {t_end:g}")
    if not (np.isfinite(t_end) and t_end > t0):
        raise ValueError(f"the end time {t_end:g} must lie after the start {t0:g}")
    return outputs, float(t_end)


def check_choices(tol, rtol, method, corrector, max_order, max_step, first_step, min_step, max_iterations) -> None:
    if not (np.isfinite(tol) and tol > 0):
        raise ValueError(f"tol (ERROR) must be positive, is {tol!r}")
    if not (np.isfinite(rtol) and rtol >= 0):
        raise ValueError(f"rtol must not be negative, is {rtol!r}")
    if method not in ("WSTIFF", "GSTIFF"):
        raise ValueError(f"method is {method!r}; choose 'WSTIFF' or 'GSTIFF'")
    if corrector not in ("original", "modified"):
        raise ValueError(f"corrector is {corrector!r}; choose 'original' or 'modified'")
    if not 1 <= max_order <= MAX_ORDER:
        raise ValueError(f"max_order (KMAX) must be 1 to {MAX_ORDER}, is {max_order!r}")
    if not max_step > 0:
        raise ValueError(f"max_step (HMAX) must be positive, is {max_step!r}")
    if first_step is not None and not first_step > 0:
        raise ValueError(f"first_step (HINIT) must be positive, is {first_step!r}")
    if min_step is not None and not min_step >= 0:
        raise ValueError(f"min_step (HMIN) must not be negative, is {min_step!r}")
    if not 1 <= max_iterations <= 100:
        raise ValueError(f"max_iterations (MAXIT) must be 1 to 100, is {max_iterations!r}")


def event_rules(
    n_events: int,
    direction: Sequence[int] | None,
    action: Sequence[int] | None,
    count: Sequence[int] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return direction, action and count of each event, of at least one place; zeros and a count of one if not given.

    Raises
    ------
    ValueError
        For a list of the wrong length or with a value that means nothing.
    """
    rules = []
    for name, given, allowed, default in (
        ("event_direction", direction, (-1, 0, 1), 0),
        ("event_action", action, (0, 1, 2), 0),
        ("event_count", count, None, 1),
    ):
        rule = np.full(max(1, n_events), default, dtype=np.int64)
        rules.append(rule)
        if given is None:
            continue
        if len(given) != n_events:
            raise ValueError(f"{name} has {len(given)} entries for {n_events} event functions")
        for value in given:
            if allowed is not None and value not in allowed:
                raise ValueError(f"{name} may hold {allowed}, has {value!r}")
            if allowed is None and (value != int(value) or value < 1):
                raise ValueError(f"{name} may hold whole numbers from 1 on, has {value!r}")
        rule[:n_events] = given
    direction_rule, action_rule, count_rule = rules
    return direction_rule, action_rule, count_rule
