"""The picture of the README and the front page: both loads of the paper's study side by side.

``python docs/scripts/picture.py out/paper/paper.nc docs/images/paper.png``
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt
import xarray as xr

from gearmbs.view import gmf_bars


def main(source: str, target: str) -> None:
    """Draw the GMF table of a finished study."""
    records = xr.open_dataset(source, engine="h5netcdf")
    table = records["gmf_rms_scaled"].sel(component=records.attrs["component"], way="band")
    figure, axes = plt.subplots(1, 2, figsize=(11, 4), sharey=True, layout="constrained")
    for ax, load in zip(axes, table["load"].values):
        torque = float(records["torque"].sel(load=load))
        gmf_bars(table.sel(load=load), ax=ax, title=f"{load} load, {torque:g} N m")
    axes[1].set_ylabel("")
    figure.savefig(target, dpi=110)


if __name__ == "__main__":
    main(*sys.argv[1:])
