"""A speed as the command line has it: a text with a unit, or a file with the speed over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.files.formats import read_signal
from gearmbs.signals.rotation.shaft import speed_of_channel
from gearmbs.signals.signal.record import SHAFT_FREQUENCIES, SPEED_NAMES, key_of, name_and_unit
from gearmbs.units import to_si


def parse_speed(text: str | None, name: str = "--speed") -> Any:
    """The speed (rad/s) that a text such as "1500 rpm" means, or the curve in the file that it names.

    The file may be of any format that is read. Of several columns beside the times the one is taken that is called
    speed or rpm, in the unit that its label names.

    Raises
    ------
    SignalError
        If the file has no such column, or its unit is not one of rotation.
    ValueError
        If the text is no speed.
    """
    if text is None:
        return None
    if not Path(text).is_file():
        return to_si(text, "angular speed", name)
    signal = read_signal(text)
    names = [str(c) for c in signal["channel"].values]
    if len(names) > 1:
        keys = [key_of(name_and_unit(name)[0])[0] for name in names]
        found = [n for n, k in zip(names, keys) if k in SPEED_NAMES | SHAFT_FREQUENCIES or "speed" in k or "rpm" in k]
        if len(found) != 1:
            raise SignalError(f"speed: {text} holds {names}; leave the column of the speed and that of the times")
        names = found
    return _over_time(signal, names[0])


def _over_time(signal: xr.DataArray, name: str) -> xr.DataArray:
    try:
        curve = speed_of_channel(signal, name)
    except SignalError:
        unit = str(signal["units"].values[list(signal["channel"].values).index(name)])
        source = signal.attrs.get("source", "the file")
        raise SignalError(
            f"speed: {source} has {name!r} in {unit!r}; write its unit, rpm, Hz or rad/s, into its label, "
            f"'{name} [rpm]'"
        ) from None
    return curve.assign_coords(time=signal["time"].values)
