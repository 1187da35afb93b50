"""Zones of vibration severity of industrial machines by ISO 20816-3, from the record of a bearing housing.

The limits of the velocity, RMS over 10 to 1000 Hz, or from 2 Hz on below 600 rpm, are those of ISO 10816-3:2009, which
ISO 20816-3:2022 replaces; public manuals of instruments and of controllers print them (docs/howto/bearings.md). The
standard also limits the displacement, which decides for slow machines. No public source prints those limits: whoever
has the standard gives them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, Unpack

import numpy as np
import pandas as pd

from gearmbs.signals.conversion import convert
from gearmbs.signals.errors import SignalError
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.given import given_speed
from gearmbs.signals.signal.signal import rate_of
from gearmbs.units import Quantity, to_si

ZONES = "ABCD"
MEANING = {
    "A": "as of machines newly put into service",
    "B": "acceptable without restriction",
    "C": "not acceptable for long: until it can be mended",
    "D": "severe enough to do damage",
}


LIMITS: dict[tuple[int, str], tuple[float, float, float]] = {
    (1, "rigid"): (2.3e-3, 4.5e-3, 7.1e-3),
    (1, "flexible"): (3.5e-3, 7.1e-3, 11.0e-3),
    (2, "rigid"): (1.4e-3, 2.8e-3, 4.5e-3),
    (2, "flexible"): (2.3e-3, 4.5e-3, 7.1e-3),
}
"""Upper ends of zones A, B and C, m/s RMS, by group (1: above 300 kW, or shafts 315 mm high and more; 2: 15 to 300 kW,
or 160 to 315 mm) and support."""
ROUNDING = 1e-9
"""Part of a duration by which a rate written as a decimal may make it short."""
QUANTITIES: tuple[Literal["velocity", "displacement"], ...] = ("velocity", "displacement")
TOP = 1000.0
"""Hz."""
SLOW, SLOWEST = 600.0, 120.0
"""rpm: below the first the band begins at 2 Hz instead of 10; below the second the standard does not apply."""
FEWEST_PERIODS = 5.0
"""Periods of the band's lower end in a record: a line just above it is then 10 % low at most, in three periods 25 %."""


@takes_data()
def vibration_zones(
    signal: Any,
    speed: Any,
    *,
    group: Literal[1, 2] = 2,
    support: Literal["rigid", "flexible"] = "rigid",
    velocity: Sequence[Quantity] | None = None,
    displacement: Sequence[Quantity] | None = None,
    **_data: Unpack[DataKeywords],
) -> pd.DataFrame:
    """Return the zone of ISO 20816-3 of each channel.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel) in units of displacement, velocity or acceleration, measured on bearing housings; or
        whatever `to_signal` makes a signal of, with ``rate``, ``units``, ``channels`` and ``gaps`` as there.
    speed : float or str
        Of the shaft, rad/s or text.
    group : {1, 2}
        2: 15 to 300 kW, or shafts 160 to 315 mm high; 1: larger ones.
    support : {"rigid", "flexible"}
        Rigid if the lowest natural frequency of machine and support in the direction measured is a quarter above the
        speed.
    velocity : sequence of three floats or str, optional
        Upper ends of zones A, B and C of the velocity, m/s RMS or text, in place of those by `group` and `support`: of
        another standard, as ISO 20816-9 of gear units, or of one's own machines. The band stays the same.
    displacement : sequence of three floats or str, optional
        Upper ends of zones A, B and C of the displacement, m RMS or text, as your copy of the standard has them.
        Without them velocities alone are judged; below 600 rpm they are needed.

    Returns
    -------
    DataFrame
        A row for each channel: ``velocity`` (m/s) and ``displacement`` (m), RMS over the band; ``velocity_zone`` and,
        with limits of it, ``displacement_zone``; the worse of the two, ``zone``; ``meaning``, which says so if the
        rate does not hold the band: the zone is then the best there can be.

    Raises
    ------
    SignalError
        If there are no such tables, the speed is below 120 rpm, or below 600 rpm without limits of the displacement, a
        unit is none of motion, the record is shorter than five periods of the band's lower end, or the rate below
        twice it.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(100000) / 10000.0
    >>> table = vibration_zones(3.0 * np.sqrt(2) * np.cos(2 * np.pi * 25 * t), "1500 rpm", rate=10000, units="mm/s")
    >>> str(table["zone"][0]), round(float(table["velocity"][0]), 4)
    ('C', 0.003)
    """
    if (group, support) not in LIMITS:
        raise SignalError(f"group, support: there are no limits for {group!r}, {support!r}; give one of {[*LIMITS]}")
    turning = given_speed(speed)
    if turning is None:
        raise SignalError("speed: is not given; pass the shaft's, such as '1500 rpm'")
    rpm = float(turning) * 30.0 / np.pi
    if rpm < SLOWEST:
        raise SignalError(f"speed: {rpm:g} rpm is below {SLOWEST:g} rpm, from which ISO 20816-3 applies")
    if displacement is None and rpm < SLOW:
        raise SignalError(
            f"displacement: at {rpm:g} rpm, below {SLOW:g} rpm, it decides beside the velocity, and no public source "
            "has its limits; give the upper ends of zones A, B and C as the standard has them, as "
            "displacement=('... um', '... um', '... um')"
        )
    limits: dict[str, tuple[float, ...]] = {"velocity": LIMITS[group, support]}
    if velocity is not None:
        limits["velocity"] = _ends(velocity, "velocity", "m/s")
    if displacement is not None:
        limits["displacement"] = _ends(displacement, "displacement", "m")
    rate = rate_of(signal)
    band = (10.0 if rpm >= SLOW else 2.0, min(TOP, 0.5 * rate))
    duration, least = signal.sizes["time"] / rate, FEWEST_PERIODS / band[0]
    if band[1] <= band[0]:
        raise SignalError(
            f"rate: {rate:g} Hz holds nothing of the band from {band[0]:g} Hz on; record at 2000 Hz or more"
        )
    if duration < least * (1.0 - ROUNDING):
        raise SignalError(
            f"signal: a record of {duration:.3g} s is too short for levels from {band[0]:g} Hz on; {least:g} s or more "
            "are needed"
        )
    best = (
        f"at least, for the rate of {rate:g} Hz holds the band up to {band[1]:g} Hz only, not {TOP:g} Hz: "
        if band[1] < TOP
        else ""
    )
    rows = []
    for c, name in enumerate(signal["channel"].values):
        one = signal.isel(channel=[c])
        levels: dict[str, float] = {to: float(convert(one, to, band=band, edges="keep").std()) for to in QUANTITIES}
        zones = [ZONES[int(np.searchsorted(ends, levels[of]))] for of, ends in limits.items()]
        rows.append((str(name), *levels.values(), *zones, max(zones), best + MEANING[max(zones)]))
    columns = ["channel", *QUANTITIES, *(f"{of}_zone" for of in limits), "zone", "meaning"]
    return pd.DataFrame(rows, columns=columns)


def _ends(told: Sequence[Quantity], name: str, unit: str) -> tuple[float, ...]:
    """Return the upper ends of three zones in a unit of SI."""
    given = (told,) if isinstance(told, str) else tuple(told)
    ends = tuple(to_si(end, unit, name) for end in given)
    if len(ends) != len(ZONES) - 1 or not all(a < b for a, b in zip((0.0, *ends), ends)):
        raise SignalError(f"{name}: {told!r} are not the upper ends of zones A, B and C, which increase")
    return ends
