"""Results of studies as files that appear under their final name only when they are whole."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from gearmbs.view.files import whole_file
from gearmbs.view.files import write_whole as write_text

__all__ = ["whole_file", "write_dataset", "write_text"]


def write_dataset(path: str | Path, dataset: xr.Dataset) -> None:
    """Write a dataset as compressed NetCDF, as a whole."""
    encoding = {
        name: {"zlib": True, "complevel": 1, "shuffle": True}
        for name, variable in dataset.data_vars.items()
        if variable.dtype.kind == "f" and variable.size > 1000
    }
    with whole_file(path) as part:
        dataset.to_netcdf(part, engine="h5netcdf", encoding=encoding)
