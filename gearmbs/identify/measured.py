"""From recordings to tables of mesh harmonics with their scatter, through the band-pass and window of the
simulations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gearmbs.identify.parameters import IdentifyError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

COLUMNS = ("case", "channel", "harmonic", "value", "sigma")
"""Columns of a table of harmonics: which case, channel or component, harmonic, RMS, relative standard deviation."""


def harmonic_table(
    signals: Mapping[str, xr.DataArray],
    *,
    harmonics: int = 3,
    way: Literal["band", "orders"] = "band",
    sections: int = 8,
    floor: float = 0.02,
    channels: Sequence[str] | None = None,
    **settings: Any,
) -> pd.DataFrame:
    """Return the RMS of the mesh harmonics of recordings with their relative standard deviations.

    Each recording is cut into sections; value and scatter are those of the sections' levels. The standard deviation
    is that of
    the mean, but at least ``floor``: what is systematic does not average out.

    Parameters
    ----------
    signals : mapping of str to DataArray
        Recordings by the name of the case that models them; dimensions (time, channel).
    harmonics : int
    way : {"band", "orders"}
        Through the band-pass about each harmonic, or by lines at the orders; see `gearmbs.signals.gmf_rms`.
    sections : int
    floor : float
        Least relative standard deviation.
    channels : sequence of str, optional
        Default all.
    **settings
        For `gmf_rms`: ``gmf``, ``speed``, ``teeth``.

    Returns
    -------
    DataFrame
        With the columns `COLUMNS`.
    """
    import pandas as pd

    from gearmbs.signals import gmf_rms

    rows = []
    if not isinstance(signals, Mapping):
        raise IdentifyError("signals: give recordings by the name of the case that models them, {name: signal}")
    for case, signal in signals.items():
        if "channel" not in getattr(signal, "dims", ()) or "time" not in signal.dims:
            raise IdentifyError(f"signals: {case} is no signal with time and channels; read it by gearmbs.read_signal")
        names = [str(c) for c in signal.channel.values]
        size = signal.sizes["time"] // sections
        levels = []
        for k in range(sections):
            part = signal.isel(time=slice(k * size, (k + 1) * size))
            part = part - part.mean("time")
            part.attrs.update(signal.attrs)
            levels.append(gmf_rms(part, harmonics=harmonics, **settings)[way].transpose("harmonic", "channel").values)
        stack = np.array(levels)
        mean = np.sqrt((stack**2).mean(axis=0))
        scatter = stack.std(axis=0, ddof=1) / np.sqrt(sections) / mean if sections > 1 else np.zeros_like(mean)
        for j, name in enumerate(names):
            if channels is not None and name not in channels:
                continue
            for h in range(harmonics):
                sigma = float(max(scatter[h, j], floor))
                rows.append((case, name, h + 1, float(mean[h, j]), sigma))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def check_table(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table of harmonics with its columns checked; ``sigma`` is 2 % where it is missing.

    Raises
    ------
    IdentifyError
        For missing columns and values that have no logarithm.
    """
    import pandas as pd

    if not isinstance(table, pd.DataFrame):
        raise IdentifyError(f"measured is a {type(table).__name__}; give a DataFrame with {', '.join(COLUMNS)}")
    missing = [c for c in COLUMNS[:4] if c not in table.columns]
    if missing:
        raise IdentifyError(f"measured: columns {', '.join(missing)} are missing; give {', '.join(COLUMNS)}")
    if table.empty:
        raise IdentifyError("measured: the table has no rows")
    table = table.copy()
    if "sigma" not in table.columns:
        table["sigma"] = 0.02
    for name in ("harmonic", "value", "sigma"):
        try:
            table[name] = pd.to_numeric(table[name])
        except (ValueError, TypeError) as error:
            raise IdentifyError(f"measured: column {name}: {error}") from None
    if not ((table["harmonic"] >= 1) & (table["harmonic"] % 1 == 0)).all():
        raise IdentifyError("measured: harmonic must be a whole number, 1 or more, in every row")
    if not ((table["value"] > 0.0) & (table["sigma"] > 0.0)).all():
        raise IdentifyError("measured: value and sigma must be positive in every row")
    return table.reset_index(drop=True)
