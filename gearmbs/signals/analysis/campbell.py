"""Campbell diagram: natural frequencies against speed, the orders that excite them, and where they meet."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs.progress import waiting
from gearmbs.signals.errors import SignalError
from gearmbs.units import to_si
from gearmbs.wording import warn

TURN = 2.0 * math.pi
LOWEST = 1e-3
"""Modes below this frequency (Hz) throughout are rigid motions and left out."""


def campbell(
    modes: Any,
    speeds: Sequence[Any] | np.ndarray,
    orders: Sequence[float] | Mapping[str, float] = (1.0,),
    *,
    count: int | None = None,
    maximum: float | None = None,
) -> xr.Dataset:
    """Natural frequencies against speed, excitation orders, and the critical speeds where they cross.

    Order k excites at f = k omega / 2 pi. A mode whose frequency varies linearly between two speeds meets it where both
    are equal; every such place is listed.

    Parameters
    ----------
    modes : array_like, object with `frequencies`, or callable
        Natural frequencies in Hz: of shape (modes,) for modes that do not depend on the speed, (speeds, modes) for
        those that do; a mechanism, whose modes are those of its initial position and speeds, or the result of
        `linear_modes`, or one for each speed; or a function of the speed in rad/s that returns any of them, as whirl
        needs. Columns of an array are modes, whose lines may cross. Results of analyses, and rows that a function
        returns, are followed from speed to speed in the order of their frequencies. Rigid motions, and what is damped
        beyond the critical, are left out.
    speeds : sequence
        Increasing, rad/s or texts such as "1500 rpm"; two or more.
    orders : sequence of float, or mapping of name to float
        Multiples of the shaft's frequency that excite: 1 for unbalance, the tooth count and its multiples for a mesh.
    count : int, optional
        So many of the lowest modes only.
    maximum : float, optional
        Only modes and crossings up to this frequency, Hz.

    Returns
    -------
    xarray.Dataset
        `frequency` (Hz) of dimensions (speed, mode), `excitation` (Hz) of dimensions (speed, order), `damping` where
        the modes know it; coordinate `order_name` along order; `critical_speed` (rad/s), `critical_frequency` (Hz),
        `critical_mode` and `critical_order` of dimension (crossing,). `critical_speeds` returns them as a table.

    Raises
    ------
    SignalError
        If speeds do not increase, or modes and speeds do not fit together.

    Warns
    -----
    UserWarning
        If one mechanism stands for all speeds and has bodies that spin or deform.
    """
    omega = np.array([_speed(speed) for speed in speeds])
    if omega.size < 2 or np.any(np.diff(omega) <= 0.0) or omega[0] < 0.0:
        raise SignalError(f"speeds: need two or more, increasing and not negative, got {list(speeds)[:6]}")
    names, multiples = _orders(orders)
    frequency, damping = _frequencies(modes, omega)
    kept = oscillating = np.flatnonzero(np.nanmax(frequency, axis=0, initial=0.0) > LOWEST)
    if maximum is not None:
        kept = kept[np.nanmin(frequency[:, kept], axis=0) <= maximum]
    kept = kept if count is None else kept[:count]
    if not kept.size and oscillating.size:
        lowest = np.nanmin(frequency[:, oscillating])
        raise SignalError(
            f"maximum: no mode lies below {maximum:.6g} Hz, the lowest has {lowest:.6g} Hz; give a higher one"
        )
    if not kept.size:
        raise SignalError(
            "modes: no mode oscillates within the range; rigid motions, and what is damped beyond the critical, "
            "have no place in a Campbell diagram"
        )
    frequency = frequency[:, kept]
    excitation = omega[:, None] * multiples[None, :] / TURN
    found = _crossings(omega, frequency, multiples, maximum)
    data = xr.Dataset(
        {
            "frequency": (("speed", "mode"), frequency, {"units": "Hz"}),
            "excitation": (("speed", "order"), excitation, {"units": "Hz"}),
            "critical_speed": ("crossing", found[:, 0], {"units": "rad/s"}),
            "critical_frequency": ("crossing", found[:, 1], {"units": "Hz"}),
            "critical_mode": ("crossing", found[:, 2].astype(int)),
            "critical_order": ("crossing", found[:, 3]),
        },
        coords={
            "speed": ("speed", omega, {"units": "rad/s", "long_name": "speed"}),
            "mode": np.arange(1, kept.size + 1),
            "order": multiples,
            "order_name": ("order", np.asarray(names, dtype=str)),
        },
    )
    if damping is not None:
        data["damping"] = (("speed", "mode"), damping[:, kept], {"units": "1"})
    return data


def critical_speeds(diagram: xr.Dataset) -> pd.DataFrame:
    """The crossings of a Campbell diagram as a table: speed in rpm, frequency in Hz, mode, order; by speed."""
    names = dict(zip(diagram["order"].values.tolist(), diagram["order_name"].values.tolist()))
    rows = {
        "speed_rpm": diagram["critical_speed"].values * 30.0 / math.pi,
        "frequency_hz": diagram["critical_frequency"].values,
        "mode": diagram["critical_mode"].values,
        "order": [names[float(k)] for k in diagram["critical_order"].values],
    }
    return pd.DataFrame(rows)


def _speed(value: Any) -> float:
    try:
        return to_si(value, "angular speed", "speeds")
    except (TypeError, ValueError) as error:
        raise SignalError(str(error)) from error


def _orders(orders: Sequence[float] | Mapping[str, float]) -> tuple[list[str], np.ndarray]:
    if isinstance(orders, Mapping):
        names, values = [str(name) for name in orders], list(orders.values())
    else:
        values = np.atleast_1d(np.asarray(orders, dtype=float)).tolist()
        names = [f"{value:g}×" for value in values]
    multiples = np.asarray(values, dtype=float)
    if not multiples.size or not (np.isfinite(multiples).all() and multiples.min() > 0.0):
        raise SignalError(f"orders: must be positive numbers, got {orders!r}")
    if np.unique(multiples).size != multiples.size:
        raise SignalError(f"orders: each may be given once, got {multiples.tolist()}")
    return names, multiples


def _frequencies(modes: Any, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Frequencies (Hz) and, where known, damping ratios, each of shape (speeds, modes); short rows end in NaN."""
    evaluated = callable(modes)
    if evaluated:
        found = []
        with waiting("modes at each speed") as tell:
            for i, speed in enumerate(omega):
                found.append(_modes_of(modes(float(speed))))
                tell((i + 1) / omega.size)
        modes = found
    _warn_of_whirl(modes)
    modes = _modes_of(modes)
    if hasattr(modes, "frequencies"):
        modes = [modes] * omega.size
    rows = list(modes)
    if rows and all(hasattr(row, "frequencies") for row in rows):
        order = _followed([_natural(row) for row in rows])
        damped = all(hasattr(row, "damping_ratios") for row in rows)
        frequency = _picked([np.asarray(row.frequencies, dtype=float) for row in rows], order)
        damping = _picked([np.asarray(r.damping_ratios, dtype=float) for r in rows], order) if damped else None
    else:
        try:
            frequency, damping = np.asarray(rows, dtype=float), None
        except (TypeError, ValueError):
            raise SignalError(
                "modes: give frequencies in Hz, results of linear_modes, or a function of speed"
            ) from None
        if frequency.ndim == 1:
            frequency = np.tile(frequency, (omega.size, 1))
        if frequency.ndim == 2 and evaluated:
            # rows of a function's own, which says nothing of which mode is which
            frequency = np.sort(frequency, axis=1)
        elif frequency.ndim == 2 and frequency.size:
            # columns are modes; the lowest at the first speed where they have a frequency come first
            first = np.argmax(np.isfinite(frequency), axis=0)
            frequency = frequency[:, np.argsort(frequency[first, np.arange(frequency.shape[1])], kind="stable")]
    if frequency.ndim != 2 or frequency.shape[0] != omega.size or not frequency.shape[1]:
        raise SignalError(f"modes: shape {frequency.shape} does not fit {omega.size} speeds; give (speeds, modes)")
    return frequency, damping


def _warn_of_whirl(mechanism: Any) -> None:
    """Warn of modes of one mechanism for all speeds where gyroscopic moments may change them with the speed."""
    if not callable(getattr(mechanism, "linear_modes", None)):
        return
    # what a hinge holds turns without whirling
    hinges = [joint for joint in getattr(mechanism, "joints", {}).values() if joint.kind == "revolute"]
    held = {marker.body.name for joint in hinges for marker in (joint.i, joint.j)}
    found = [
        name for name, body in getattr(mechanism, "bodies", {}).items()
        if hasattr(body, "modal") or (name not in held and np.any(body.angular_velocity))
    ]  # fmt: skip
    if found:
        more = f" and {len(found) - 1} more" if len(found) > 1 else ""
        warn(
            "modes: those of the mechanism at its initial speeds are taken at all speeds, though body "
            f"'{found[0]}'{more} deforms or spins; for whirl give a function of the speed that builds the mechanism, "
            "campbell(lambda speed: build(speed), speeds)",
        )


def _modes_of(thing: Any) -> Any:
    """Return the modes of a mechanism, or of anything that has ``linear_modes()``; of all else itself."""
    return thing.linear_modes() if callable(getattr(thing, "linear_modes", None)) else thing


def _natural(row: Any) -> np.ndarray:
    """Return the frequencies of what oscillates, NaN elsewhere: what is damped beyond the critical has none."""
    frequency = np.asarray(row.frequencies, dtype=float)
    if hasattr(row, "damping_ratios"):
        frequency = np.where(np.abs(np.asarray(row.damping_ratios, dtype=float)) < 1.0, frequency, np.nan)
    return np.where(frequency > LOWEST, frequency, np.nan)


def _followed(rows: list[np.ndarray]) -> list[np.ndarray]:
    """Return, for each speed, which entry each mode is, -1 where it does not oscillate.

    In the order of frequencies while there are as many; where a motion begins or ceases to oscillate, modes are those
    whose frequencies changed least.
    """
    from scipy.optimize import linear_sum_assignment

    places: list[np.ndarray] = []
    last = np.zeros(0)
    for row in rows:
        here = np.argsort(row, kind="stable")[: int(np.isfinite(row).sum())]
        alive = np.flatnonzero(np.isfinite(last))
        found = np.full(last.size, -1)
        if here.size == alive.size:
            found[alive[np.argsort(last[alive], kind="stable")]] = here
            new = here[:0]
        else:
            kept, taken = linear_sum_assignment(np.abs(np.log(last[alive])[:, None] - np.log(row[here])))
            found[alive[kept]] = here[taken]
            new = np.delete(here, taken)
        found = np.concatenate([found, new]).astype(int)
        last = np.where(found >= 0, row[found], np.nan) if found.size else last
        places.append(found)
    # by the frequency at the first speed where there is one
    width = places[-1].size
    whole = [np.pad(p, (0, width - p.size), constant_values=-1) for p in places]
    first = [next(row[p[j]] for row, p in zip(rows, whole) if p[j] >= 0) for j in range(width)]
    order = np.argsort(first, kind="stable")
    return [p[order] for p in whole]


def _picked(rows: list[np.ndarray], order: list[np.ndarray]) -> np.ndarray:
    if not order[0].size:
        return np.full((len(rows), 1), np.nan)
    return np.stack([np.where(k >= 0, row[k], np.nan) if row.size else k * np.nan for row, k in zip(rows, order)])


def _crossings(omega: np.ndarray, frequency: np.ndarray, multiples: np.ndarray, maximum: float | None) -> np.ndarray:
    """Rows (speed, frequency, mode, order) where a mode's frequency equals an order's, by speed."""
    rows = []
    for j, curve in enumerate(frequency.T):
        for order in multiples:
            gap = curve - order * omega / TURN
            for i in np.flatnonzero(np.isfinite(gap[:-1]) & np.isfinite(gap[1:])):
                here, there = gap[i], gap[i + 1]
                last = i + 2 == omega.size and there == 0.0
                if not (here == 0.0 or here * there < 0.0 or last) or here == there:
                    continue
                s = here / (here - there)
                at = omega[i] + s * (omega[i + 1] - omega[i])
                rows.append((at, order * at / TURN, j + 1, order))
    found = np.array(sorted(rows)).reshape(-1, 4)
    return found if maximum is None else found[found[:, 1] <= maximum]
