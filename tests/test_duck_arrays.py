"""xarray asks for dask and pint once somebody has imported them."""

import pytest

from tests.test_front_door import loaded

MADE = (
    "import numpy as np, xarray as xr; from gearmbs._lazy import spare_duck_arrays; spare_duck_arrays(); "
    "made = xr.DataArray(np.arange(4.0), dims='t'); total = float((made * 2).sum())"
)


@pytest.mark.slow
def test_arrays_of_numpy_load_no_other_library():
    assert not loaded(MADE) & {"dask", "pint"}


@pytest.mark.slow
def test_arrays_of_dask_are_known_once_it_is_there():
    pytest.importorskip("dask.array")
    chunked = f"{MADE}; lazy = made.chunk(t=2); assert lazy.chunks == ((2, 2),); assert float(lazy.sum()) == 6.0"
    assert "dask" in loaded(f"{chunked}; assert xr.DataArray(lazy.data + 1, dims='t').chunks == ((2, 2),)")
