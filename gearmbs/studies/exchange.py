"""Between the study's files and the comparison with measurements."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from gearmbs.signals import make_signal
from gearmbs.studies.case import CaseError


def parse_states(items: Sequence[str]) -> dict[str, dict[str, Path]]:
    """Read texts ``load:state=path`` into nested dictionaries, in the order given.

    Raises
    ------
    CaseError
        For a text of another form, or a state named twice.
    """
    out: dict[str, dict[str, Path]] = {}
    for item in items:
        name, equals, path = item.partition("=")
        load, colon, state = name.partition(":")
        if not (equals and colon and load and state and path):
            raise CaseError(f"experiment {item!r}: write load:state=path, for instance low:healthy=h0.csv")
        states = out.setdefault(load.strip(), {})
        if state.strip() in states:
            raise CaseError(f"experiment {item!r}: {load}:{state} is given twice")
        states[state.strip()] = Path(path)
    return out


def model_signals(path: str | Path, component: str) -> dict[str, dict[str, xr.DataArray]]:
    """Return the accelerations of a ``paper.nc`` file by load and state, as signals.

    Raises
    ------
    CaseError
        If the file cannot be read, is not a study, or has no such component.
    """
    try:
        with xr.open_dataset(path, engine="h5netcdf") as data:
            records = data[["acceleration"]].load()
            attributes = dict(data.attrs)
    except (OSError, KeyError, ValueError) as error:
        raise CaseError(f"{path}: not a result file of the paper's study ({error})") from error
    names = [str(c) for c in records.component.values]
    if component not in names:
        raise CaseError(f"component: {component!r} is not in {path}; choose one of {', '.join(names)}")
    time = records.signal_time.values
    rate = float(attributes["solver_signal_rate"])
    out: dict[str, dict[str, xr.DataArray]] = {}
    for load in records["load"].values:
        for state in records.state.values:
            values = records["acceleration"].sel(load=load, state=state, component=component).values
            out.setdefault(str(load), {})[str(state)] = make_signal(
                values,
                rate,
                units="m/s^2",
                channels=[component],
                t0=float(time[0]),
                speed=float(attributes["operation_speed"]),
                teeth=tuple(int(z) for z in attributes["gears_teeth"]),
            )
    return out
