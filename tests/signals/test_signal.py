"""The signal type: shapes, metadata, errors that name what is wrong."""

import numpy as np
import pytest
import xarray as xr

from gearmbs.signals import (
    MissingMetadataError,
    SignalError,
    as_signal,
    common_unit,
    make_signal,
    mesh_frequency,
    rate_of,
    trim,
    units_of,
    with_metadata,
)
from tests.says import says


def test_make_signal_carries_its_metadata():
    s = make_signal({"a": [1.0, 2.0], "b": [3.0, 4.0]}, 100.0, units={"a": "m/s"}, speed=6.0, teeth=(29, 31), t0=1.0)
    assert s.dims == ("time", "channel")
    assert units_of(s) == ["m/s", "unknown"]
    assert common_unit(s) == "mixed"
    assert s.attrs["teeth"] == (29, 31)
    np.testing.assert_allclose(s["time"], [1.0, 1.01])
    assert mesh_frequency(s) == pytest.approx(29 * 6.0 / (2 * np.pi))
    assert units_of(s.sel(channel="a")) == ["m/s"]


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: make_signal([], 1.0), "non-empty"),
        (lambda: make_signal([1.0, np.nan, 2.0], 1.0), says("1", "0", "first at row")),
        (lambda: make_signal([1.0], -5.0), says("positive", "rate")),
        (lambda: make_signal([1.0, 2.0j], 5.0), says("data", "complex", "give")),
        (lambda: make_signal({"a": np.array([1.0 + 0.0j])}, 5.0), says("data", "complex", "give")),
        (lambda: make_signal([1.0], 5.0, teeth=0), says("teeth", "0", "positive")),
        (lambda: make_signal([1.0], 5.0, teeth=28.5), says("teeth", "28.5", "whole")),
        (lambda: make_signal([1.0], 5.0, speed=float("nan")), says("speed", "nan", "positive")),
        (lambda: make_signal([[1.0, 2.0]], 5.0, channels=["a", "a"]), "different names"),
        (lambda: make_signal({"a": [1.0], "b": [1.0, 2.0]}, 5.0), "same length"),
        (lambda: make_signal([1.0], 5.0, units={"nope": "V"}), says("units", "'nope'", "channel is named")),
        (lambda: make_signal([1.0], 5.0, units=["V", "V"]), "need one or 1"),
    ],
)
def test_errors_name_the_field(call, match):
    with pytest.raises(SignalError, match=match):
        call()


def test_rate_is_asked_for_by_name():
    with pytest.raises(MissingMetadataError, match="rate is missing") as caught:
        make_signal([1.0, 2.0], None)
    assert caught.value.name == "rate"


def test_as_signal_from_dataset_and_bare_arrays():
    t = np.arange(100) / 12800.0
    ds = xr.Dataset(
        {"v": ("time", np.ones(100), {"units": "m/s"}), "f": ("time", np.zeros(100), {"units": "N"})},
        coords={"time": t},
        attrs={"speed": 104.72, "teeth": np.array([29, 29])},
    )
    s = as_signal(ds)
    assert rate_of(s) == 12800.0
    assert units_of(s) == ["m/s", "N"]
    assert s.attrs["teeth"] == (29, 29)
    one = as_signal(s.sel(channel="f"))
    assert one.sizes == {"time": 100, "channel": 1}
    assert units_of(one) == ["N"]
    assert [str(c) for c in one["channel"].values] == ["f"]
    bare = as_signal(xr.DataArray(np.ones((100, 2)), dims=("time", "c"), coords={"c": ["p", "q"]}), rate=50.0)
    assert rate_of(bare) == 50.0
    with pytest.raises(MissingMetadataError):
        as_signal(xr.DataArray(np.ones(5), dims="time"))


def test_as_signal_refuses_uneven_time():
    t = np.array([0.0, 1.0, 2.0, 4.0])
    with pytest.raises(SignalError, match="not uniform"):
        as_signal(xr.DataArray(np.ones(4), dims="time", coords={"time": t}))


@pytest.mark.parametrize("rate", [12800.0, 51200.0, 44100.0, 1 / 3.0, 25641.03])
def test_rate_from_times_written_with_six_decimals(rate):
    t = np.round(np.arange(5000) / rate, 6)
    s = as_signal(xr.DataArray(np.ones(5000), dims="time", coords={"time": t}))
    assert rate_of(s) == pytest.approx(rate, rel=2e-5)


def test_trim_and_metadata_changes():
    s = make_signal(np.arange(10.0), 10.0)
    assert trim(s, 0.2, 0.5).values[:, 0].tolist() == [2.0, 3.0, 4.0]
    with pytest.raises(SignalError, match="no samples"):
        trim(s, 5.0)
    changed = with_metadata(s, units="V", speed=3.0, place="bearing")
    assert (common_unit(changed), changed.attrs["speed"], changed.attrs["place"]) == ("V", 3.0, "bearing")
    assert common_unit(s) == "unknown"
    with pytest.raises(SignalError, match="sampling_rate"):
        with_metadata(s, rate=5.0)
