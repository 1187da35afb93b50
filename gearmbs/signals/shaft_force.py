"""From the force between gear and shaft to accelerations: components and Newton's second law."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.signals.errors import SignalError
from gearmbs.signals.signal.signal import common_unit, like, make_signal, rate_of

if TYPE_CHECKING:
    import xarray as xr

COMPONENTS = ("line_of_centres", "tangential", "line_of_action", "resultant")
"""Components of a force between gear and shaft; see `force_components`."""


def force_components(
    force: xr.DataArray,
    *,
    pressure_angle: float,
    centre_line: Sequence[float] = (1.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    sense: int = 1,
    channels: Sequence[str] = ("x", "y", "z"),
) -> xr.DataArray:
    """Project a vector signal on the directions of the mesh.

    With e_c the unit vector from wheel 1's centre to wheel 2's, e_z the axis and e_t = e_z x e_c:
    line_of_centres = F.e_c, tangential = F.e_t, line_of_action = F.(sense cos(alpha') e_t + sin(alpha') e_c),
    resultant = |F|. A driving wheel 1 that turns in the sense +1 about e_z carries the tooth force along minus the
    line of action.

    Parameters
    ----------
    force : xarray.DataArray
        Dimensions (time, channel), three channels with fixed Cartesian components.
    pressure_angle : float
        Working pressure angle alpha' in rad.
    centre_line, axis : sequence of 3 floats
        Need not be of unit length; the part of `centre_line` along `axis` is taken out.
    sense : {1, -1}
        Sense of rotation of wheel 1 about `axis` (of its load, if it is driven).
    channels : sequence of 3 str
        Names of the x, y, z channels.

    Returns
    -------
    xarray.DataArray
        Channels "line_of_centres", "tangential", "line_of_action", "resultant", in the units of `force`.

    Raises
    ------
    SignalError
        If a channel is missing, a direction is degenerate or an argument is out of range.
    """
    names = [str(c) for c in force["channel"].values]
    missing = [c for c in channels if c not in names]
    if missing or len(channels) != 3:
        raise SignalError(
            f"channels: need the names of three Cartesian channels, {missing or channels} not among {names}"
        )
    if sense not in (1, -1):
        raise SignalError(f"sense: must be 1 or -1, got {sense!r}")
    if not 0.0 <= pressure_angle < math.pi / 2:
        raise SignalError(f"pressure_angle: must lie in [0, pi/2) rad, got {pressure_angle!r}")
    e_z = _unit(axis, "axis")
    along = np.asarray(centre_line, dtype=float)
    e_c = _unit(along - e_z * (along @ e_z), "centre_line")
    e_t = np.cross(e_z, e_c)
    e_a = sense * math.cos(pressure_angle) * e_t + math.sin(pressure_angle) * e_c
    vector = force.values[:, [names.index(c) for c in channels]]
    result = np.stack((vector @ e_c, vector @ e_t, vector @ e_a, np.linalg.norm(vector, axis=1)), axis=1)
    attrs = {k: v for k, v in force.attrs.items() if k not in ("sampling_rate", "units", "speed", "teeth")}
    return make_signal(
        result,
        rate_of(force),
        units=common_unit(force),
        channels=COMPONENTS,
        t0=float(force["time"].values[0]),
        speed=force.attrs.get("speed"),
        teeth=force.attrs.get("teeth"),
        attrs={**attrs, "pressure_angle": pressure_angle},
    )


def force_to_acceleration(force: xr.DataArray, mass: float) -> xr.DataArray:
    """Newton's second law, a = F / m.

    Parameters
    ----------
    force : xarray.DataArray
        In N (every channel).
    mass : float
        Mass in kg of the body the force acts on.

    Returns
    -------
    xarray.DataArray
        In m/s^2.

    Raises
    ------
    SignalError
        If a channel is not in N or the mass is not positive.
    """
    if common_unit(force) != "N":
        raise SignalError(f"force: every channel must be in N, got {common_unit(force)!r}")
    if not (math.isfinite(mass) and mass > 0.0):
        raise SignalError(f"mass: must be a positive number of kg, got {mass!r}")
    return like(force, force.values / mass, units="m/s^2", mass=float(mass))


def _unit(vector: Sequence[float] | np.ndarray, name: str) -> np.ndarray:
    value = np.asarray(vector, dtype=float)
    length = float(np.linalg.norm(value))
    if value.shape != (3,) or not math.isfinite(length) or length < 1e-12:
        raise SignalError(f"{name}: must be a vector of three numbers with a direction of its own, got {vector!r}")
    return value / length
