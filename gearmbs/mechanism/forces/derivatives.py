"""Derivatives that a user writes by hand, of force elements, against differences: each family once."""

from __future__ import annotations

from weakref import WeakSet

import numpy as np

from gearmbs.dae.equations.loads.forces import DERIVATIVES, FRAME_V, FRAME_W
from gearmbs.dae.problem import EPS, ModelError
from gearmbs.kernels.pointers import address
from gearmbs.mechanism.forces.functions import FunctionForce, frame_of, vary
from gearmbs.mechanism.parts.elements import Compiled, ForceElement

AWAY = (1e-3, 1e-2, 0.1, 0.1)
"""Distances over the reach of the markers, angles, and speeds over the reach and a second, at which it is tried: at the
start itself, where springs are often at rest, much is zero."""
STEP = 1e-6
"""The same of the differences."""
OFF = 1e-3
"""Part of its block, a force or torque by the three components of a variation, by which a derivative may be off."""
OF_ALL = 1e-9
"""The same of all that the variations of one size do to a force or torque: what cancels in one block is rounding."""
ROUNDED = 100.0 * EPS
"""Part of a force by which differences of it may be off."""
VARIATIONS = tuple(f"{what} {axis}" for what in ("place", "rotation", "velocity", "angular velocity") for axis in "xyz")
COMPONENTS = ("Fx", "Fy", "Fz", "Nx", "Ny", "Nz")

_TRIED: WeakSet = WeakSet()
"""Kernels that have been tried in this process: nothing but time depends on it."""


def check_derivatives(element: ForceElement, made: Compiled) -> None:
    """Compare the derivatives that a user has written with one-sided differences, near the start.

    Between the two differences on either side any value is right: at a kink, or where a force jumps.

    Raises
    ------
    ModelError
        Where a derivative is outside both; the message names the element, the entry and both values.
    """
    written = element.derivatives if isinstance(element, FunctionForce) else made.kernel
    if written is None or written in _TRIED:
        return
    sees = element.markers if made.sees is None else made.sees
    start = np.array([frame_of(marker) for marker in sees])
    reach = float(np.linalg.norm(start[:, None, :3] - start[None, :, :3], axis=2).max(initial=0.0)) or 0.1
    units = np.concatenate([np.tile(np.repeat((reach, 1.0, reach, 1.0), 3), len(sees))])
    rng = np.random.default_rng(0)
    for away in AWAY:
        frames = start.copy()
        for k in range(len(sees)):
            for c, move in enumerate(away * rng.normal(size=12) * units[:12]):
                moved = frames.copy()
                vary(moved, frames, k, c, move)
        frames[:, FRAME_V:] += rng.normal(size=(len(sees), 6)) * np.repeat((reach, 1.0), FRAME_W - FRAME_V)
        own = [state.start for state in element.states]
        states = np.array(own, dtype=float) + away * rng.normal(size=len(element.states))
        times = [rng.normal() if function.is_expression else function(0.0) for function in made.times]
        inputs = np.concatenate([rng.normal(size=6 * len(made.reactions)), times, np.zeros(len(made.angles))])
        _compare(element, made, [marker.name for marker in sees], frames, states, inputs, units)
    _TRIED.add(written)


def _compare(element, made: Compiled, names: list[str], frames, states, inputs, units: np.ndarray) -> None:
    """Compare all derivatives at one place."""
    free = 6 * len(made.reactions)
    columns = len(units) + len(states) + free
    units = np.concatenate([units, np.maximum(np.abs(states), 1.0), np.ones(free)])
    ints = np.array([*(address(*function) for function in made.functions), *made.integers], dtype=np.int64)
    reals = np.array(made.reals, dtype=float)
    work = np.zeros(made.scratch)

    def values(frames, states, inputs, want: int = 0) -> tuple[np.ndarray, np.ndarray]:
        wrench, rates = np.zeros((element.wrenches, 6)), np.zeros(len(states))
        jac = np.zeros((wrench.size + rates.size, columns))
        told = np.zeros(len(element.diagnostics))
        made.kernel(ints, reals, 0.0, frames, states, inputs, want, work, wrench, rates, jac, told)
        return np.concatenate([wrench.ravel(), rates]), jac

    def changed(column: int, size: float) -> np.ndarray:
        moved, own, given = frames.copy(), states.copy(), inputs.copy()
        at = column - 12 * len(frames)
        if at < 0:
            vary(frames, moved, column // 12, column % 12, size)
        elif at < len(states):
            own[at] += size
        else:
            given[at - len(states)] += size
        return values(moved, own, given)[0]

    steps = STEP * units
    try:
        force, jac = values(frames, states, inputs, DERIVATIVES)
        behind = np.array([(force - changed(c, -h)) / STEP for c, h in enumerate(steps)]).T
        ahead = np.array([(changed(c, h) - force) / STEP for c, h in enumerate(steps)]).T
    except ArithmeticError:
        # the force is not defined here
        return
    scaled = jac * units
    if not (np.isfinite(force).all() and np.isfinite(ahead).all() and np.isfinite(behind).all()):
        # nothing acts here that could be compared
        return
    low, high = np.minimum(behind, ahead), np.maximum(behind, ahead)
    size = np.maximum(np.maximum(np.abs(low), np.abs(high)), np.abs(scaled))
    blocks = np.minimum(np.arange(columns) // 3, len(frames) * 4 + np.arange(columns))
    block = np.array([size[:, blocks == b].max(axis=1) for b in blocks]).T
    allowed = OFF * block + OF_ALL * size.max(axis=1, keepdims=True) + (ROUNDED / STEP) * np.abs(force)[:, None]
    off = np.maximum(low - scaled, scaled - high)
    off[np.isnan(off)] = np.inf
    for k in range(element.wrenches):
        # what is written for a part that is no unknown is ignored
        off[6 * k : 6 * k + 3] *= element.has_force
        off[6 * k + 3 : 6 * k + 6] *= element.has_torque
    ratio = np.divide(off, allowed, out=np.where(off > 0.0, np.inf, 0.0), where=allowed > 0.0)
    row, column = np.unravel_index(int(np.argmax(np.nan_to_num(ratio, posinf=1e300))), ratio.shape)
    if not ratio[row, column] > 1.0:
        return
    raise ModelError(
        f"{element.kind} '{element.name}': jac[{row}, {column}], its derivative of {_row(element, int(row))} by "
        f"{_column(element, names, int(column))}, is {jac[row, column]:.6g}; differences of "
        f"what the kernel gives make it {0.5 * (low + high)[row, column] / units[column]:.6g}. Correct it, or give the "
        "force to Mechanism.force without derivatives, which takes differences"
    )


def _row(element: ForceElement, row: int) -> str:
    if row >= 6 * element.wrenches:
        return f"the rate of state {row - 6 * element.wrenches}"
    return COMPONENTS[row % 6] + (f" of wrench {row // 6}" if element.wrenches > 1 else "")


def _column(element: ForceElement, names: list[str], column: int) -> str:
    at = column - 12 * len(names)
    if at < 0:
        return f"the {VARIATIONS[column % 12]} of marker '{names[column // 12]}'"
    return f"state {at}" if at < len(element.states) else f"input {at - len(element.states)}"
