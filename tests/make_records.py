"""Records that tests read instead of simulating: ``python -m tests.make_records [NAME ...]`` makes them again."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

FOLDER = Path(__file__).with_name("records")
FRICTION = np.geomspace(0.01, 0.2, 3)
"""Lowest, middle and highest dynamic friction of the stored levels."""
NODES = np.polynomial.chebyshev.chebpts2(9)
"""Chebyshev points of the logarithm of friction at which levels are stored, in half of its range about the middle."""


def planet() -> xr.Dataset:
    """Return the record at the ring while the carrier turns nine times with a broken tooth on planet 2."""
    from tests.signals.test_planetary_diagnosis import simulated

    return simulated("planet 2 ring side")[["ring_sensor", "carrier_angle"]]


def levels() -> xr.Dataset:
    """Return the levels of the cases that `tests.identify.levels` looks up, over friction."""
    from gearmbs.studies import run_case
    from tests.identify.levels import CASES, with_friction

    def over_friction(case):
        runs = [run_case(with_friction(case, node), False, variables=["gmf_rms"]) for node in NODES]
        levels = [run["gmf_rms"].sel(way="orders") for run in runs]
        return xr.concat(levels, xr.DataArray(NODES, dims="friction", name="friction"))

    names = xr.DataArray(list(CASES), dims="case", name="case")
    return xr.concat([over_friction(case) for case in CASES.values()], names).to_dataset(name="gmf_rms")


def resonance() -> xr.Dataset:
    """Return sweeps through the resonance, up and down, of both models."""
    from gearmbs.studies.presets.resonance import DIRECTIONS, MODELS, sweep_resonance

    both = [xr.concat([sweep_resonance(None, d, m) for d in DIRECTIONS], "direction") for m in MODELS]
    return xr.concat(both, "model").assign_coords(model=list(MODELS), direction=list(DIRECTIONS))


RECORDS: dict[str, Callable[[], xr.Dataset]] = {"planet.nc": planet, "levels.nc": levels, "resonance.nc": resonance}
"""By what each file is made."""


def read(name: str) -> xr.Dataset:
    """Return a stored record."""
    return xr.load_dataset(FOLDER / name, engine="h5netcdf")


def write(name: str) -> None:
    """Make a record and store it, compressed, with as many digits as tests need."""
    data = RECORDS[name]()
    kept = {"dtype": "float32", "zlib": True, "complevel": 9, "shuffle": True}
    data.to_netcdf(FOLDER / name, engine="h5netcdf", encoding={variable: kept for variable in data.data_vars})


if __name__ == "__main__":
    for name in sys.argv[1:] or RECORDS:
        write(name)
