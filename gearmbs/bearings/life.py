"""The life of a mechanism's rolling bearings under the loads of a simulation."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.bearings.element import RollingBearing
from gearmbs.bearings.errors import require
from gearmbs.bearings.ratings import equivalent_load, mean_load, rating_life
from gearmbs.bearings.settings import BearingSettings

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism import Mechanism
    from gearmbs.mechanism.parts.bodies import Body

# Rolling bearings of a mechanism as plain data, for storing beside results.


def described(mechanism: Mechanism) -> dict[str, dict[str, Any]]:
    """Return of each rolling bearing by name its ``bearing``, ``settings`` other than the defaults and ``defects``."""
    return {
        name: {
            "bearing": asdict(element.bearing),
            "settings": _settings(element.settings),
            "defects": [dict(defect.description) for defect in element.defects],
        }
        for name, element in mechanism.elements.items()
        if isinstance(element, RollingBearing)
    }


def _settings(settings: BearingSettings) -> dict[str, Any]:
    given = {item.name: (getattr(settings, item.name), item.default) for item in fields(settings)}
    return {name: value for name, (value, default) in given.items()
            if name not in ("bearing", "defects") and value != default}  # fmt: skip


def bearing_lives(
    m: Mechanism, solution: Solution, *, start: float = 0.0, reliability: float = 0.9, life_factor: float = 1.0
) -> xr.Dataset:
    """Return load and life by ISO 281 of all rolling bearings of a mechanism, from the loads of a run.

    Parameters
    ----------
    m : Mechanism
    solution : Solution
        A run of it, with outputs at even times or at every step.
    start : float
        Time before which loads do not count, such as the end of a run-up, s.
    reliability, life_factor : float
        As of `rating_life`.

    Returns
    -------
    xarray.Dataset
        Over ``bearing``: equivalent load of the same life and the largest one (N), rating C (N), mean speed of
        the rings against each other (rad/s), life in revolutions and in hours, infinite for a bearing without load.

    Raises
    ------
    BearingError
        Without rolling bearings or outputs after ``start``, and for loads that the standard does not know.

    Examples
    --------
    >>> from gearmbs.bearings import Bearing
    >>> from gearmbs.studies import bearing_rig
    >>> rig = bearing_rig(Bearing.from_designation("6205"), speed="1500 rpm", radial_load="1.4 kN")
    >>> lives = bearing_lives(rig, rig.simulate(0.1, rate=4000), start=0.05)
    >>> round(float(lives.life_turns.sel(bearing="bearing")), -8)
    1100000000.0
    """
    import xarray as xr

    elements = [element for element in m.elements.values() if isinstance(element, RollingBearing)]
    require(bool(elements), f"mechanism '{m.name}' has no rolling bearings")
    counts = solution.t >= start
    require(
        int(counts.sum()) > 1,
        f"start is {start:g} s; the run has too few outputs after it, it ends at {solution.t[-1]:g} s",
    )
    lasting = np.gradient(solution.t[counts])
    rows = []
    for element in elements:
        axis = (_orientation(solution, element.j.body) @ element.j.orientation[:, 2])[counts]
        force = solution.load(element.name)[0][counts]
        axial = np.einsum("tc,tc->t", force, axis)
        radial = np.linalg.norm(force - axial[:, None] * axis, axis=1)
        turning = _spin(solution, element.i.body) - _spin(solution, element.j.body)
        speed = np.abs(np.einsum("tc,tc->t", turning[counts], axis))
        bearing = element.bearing
        largest = max(equivalent_load(bearing, r, a) for r, a in zip(radial, axial))
        mean, turns = 0.0, np.inf
        if largest > 0.0 and np.any(speed > 0.0):
            mean = mean_load(bearing, radial, axial, lasting * speed)
            turns = rating_life(bearing, mean, reliability=reliability, life_factor=life_factor)
        average = float(np.average(speed, weights=lasting))
        hours = turns * 2.0 * np.pi / average / 3600.0 if average > 0.0 else np.inf
        rows.append((mean, largest, bearing.rating, average, turns, hours))
    columns = {
        "equivalent_load": "N", "largest_load": "N", "rating": "N", "speed": "rad/s", "life_turns": "1",
        "life_hours": "h",
    }  # fmt: skip
    values = np.array(rows).T
    return xr.Dataset(
        {name: ("bearing", values[k], {"units": unit}) for k, (name, unit) in enumerate(columns.items())},
        {"bearing": [element.name for element in elements]},
        {"reliability": reliability, "life_factor": life_factor},
    )


def _orientation(solution: Solution, body: Body) -> np.ndarray:
    if body.is_ground:
        return np.broadcast_to(body.orientation, (solution.t.size, 3, 3))
    return solution.orientation(body.name)


def _spin(solution: Solution, body: Body) -> np.ndarray:
    return np.zeros((solution.t.size, 3)) if body.is_ground else solution.angular_velocity(body.name)
