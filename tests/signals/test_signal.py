"""The signal type: shapes, metadata, errors that name what is wrong."""

import inspect

import numpy as np
import pytest
import xarray as xr

from gearmbs import signals
from gearmbs.signals import (
    MissingMetadataError,
    ModalPath,
    Mode,
    SignalError,
    accelerometer,
    add_noise,
    analyse,
    as_signal,
    bandpass,
    camera,
    common_unit,
    convert,
    decimate,
    discrete_random,
    drop_outs,
    edit_cepstrum,
    envelope,
    force_components,
    force_to_acceleration,
    joint_force,
    laser_vibrometer,
    level_lines,
    make_signal,
    maximum_correlated_kurtosis,
    measure,
    mesh_frequency,
    minimum_entropy,
    point_track,
    prewhiten,
    quantise,
    rate_of,
    remove_average,
    remove_mean,
    repair_vibrometer,
    resample,
    sample,
    scale,
    scale_states,
    sections,
    shaft_phase,
    speckle,
    to_signal,
    trim,
    units_of,
    with_metadata,
    with_speed,
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
    with pytest.raises(SignalError, match=says("trim", "[5.0, None)", "0.9 s")):
        trim(s, 5.0)
    changed = with_metadata(s, units="V", speed=3.0, place="bearing")
    assert (common_unit(changed), changed.attrs["speed"], changed.attrs["place"]) == ("V", 3.0, "bearing")
    assert common_unit(s) == "unknown"
    with pytest.raises(SignalError, match="sampling_rate"):
        with_metadata(s, rate=5.0)


# What a signal that is made of another one keeps: all but the samples, and the speed over time at its own times.


def turning_signal(seconds=1.0, rate=12800.0):
    """Forces of a shaft that runs up from 30 Hz at t = 5 s by 10 Hz a second, with its angle."""
    t = 5.0 + np.arange(round(seconds * rate)) / rate
    angle = 2.0 * np.pi * revolutions(t)
    x = np.stack([np.cos(29.0 * angle), np.sin(angle), np.cos(3.0 * angle)], axis=1)
    x += 0.1 * np.random.default_rng(0).standard_normal(x.shape)
    signal = make_signal(x, rate, units="N", channels=["x", "y", "z"], t0=5.0, teeth=(29, 31), attrs={"source": "rig"})
    turning = with_speed(signal, [(5.0, 2.0 * np.pi * 30.0), (9.0, 2.0 * np.pi * 70.0)])
    return turning.assign_coords(angle=("time", angle, {"units": "rad"}))


def revolutions(t):
    return 30.0 * (t - 5.0) + 5.0 * (t - 5.0) ** 2


PATH = ModalPath((Mode(2000.0, 0.05, 1.0),))
PARTS = {
    "accelerometer": lambda s: accelerometer(s, PATH),
    "add_noise": lambda s: add_noise(s, seed=1, rms=0.1),
    "as_signal": as_signal,
    "bandpass": lambda s: bandpass(s, 300.0, 2000.0, transition=100.0),
    "camera": lambda s: camera(with_metadata(s, units="m"), 5000.0, scale=1e-4),
    "convert": lambda s: convert(with_metadata(s, units="m/s^2"), "velocity", band=(100.0, 3000.0)),
    "decimate": lambda s: decimate(s, 6400.0),
    "discrete_random": lambda s: discrete_random(s)[1],
    "drop_outs": lambda s: drop_outs(with_metadata(s, units="m/s"), per_second=3.0, full_scale=10.0, seed=1),
    "edit_cepstrum": lambda s: edit_cepstrum(s, 30.0),
    "envelope": lambda s: envelope(s, (300.0, 2000.0)),
    "force_components": lambda s: force_components(s, pressure_angle=0.35),
    "force_to_acceleration": lambda s: force_to_acceleration(s, 2.0),
    "joint_force": lambda s: joint_force(s, (1.0, 0.0, 0.0)),
    "laser_vibrometer": lambda s: laser_vibrometer(s, (1.0, 0.0, 0.0)),
    "level_lines": lambda s: level_lines(s, 200.0),
    "maximum_correlated_kurtosis": lambda s: maximum_correlated_kurtosis(s, 0.01),
    "measure": lambda s: measure(s, rate=10000.0, noise_rms=0.1, bits=16, full_scale=10.0),
    "minimum_entropy": minimum_entropy,
    "point_track": lambda s: point_track(with_metadata(s, units="pixel"), 1e-4),
    "prewhiten": prewhiten,
    "quantise": lambda s: quantise(s, bits=16, full_scale=10.0),
    "remove_average": lambda s: remove_average(s, shaft_phase(s))[1],
    "remove_mean": remove_mean,
    "repair_vibrometer": lambda s: repair_vibrometer(with_metadata(s, units="m/s")),
    "resample": lambda s: resample(s, 10000.0),
    "sample": lambda s: sample(s, 4266.0 + 2.0 / 3.0),
    "scale": lambda s: scale(s, 2.0),
    "scale_states": lambda s: scale_states({"healthy": s, "cracked": s}, 2.0, channel="x")["cracked"],
    "sections": lambda s: list(sections(s, 0.4))[1],
    "speckle": lambda s: speckle(with_metadata(s, units="m/s"), turning_signal()["angle"], rms=0.01, seed=1),
    "to_signal": lambda s: to_signal(s, channels=["x"]),
    "trim": lambda s: trim(s, 5.2),
    "with_metadata": lambda s: with_metadata(s, units="kN"),
}
NO_PARTS = {
    "made of samples or files": "even_signal make_signal read_signal",
    "given another speed": "with_speed",
    "over angle": "angular_resample difference_signal regular_signal remove_orders residual_signal planetary_average "
    "time_synchronous_average",
    "angles and speeds": "angle_of_pulses instantaneous_speed phase_from_line phase_from_speed phase_from_tacho "
    "shaft_angles shaft_phase torsional_vibration",
    "over frequency, order or channel": "band_rms dynamic_rms envelope_spectrum mesh_bands order_map order_rms "
    "order_spectrum order_track power_cepstrum spectral_kurtosis spectrogram spectrum waterfall",
}


def test_every_function_that_returns_a_signal_is_tried():
    """A new one that returns arrays belongs into one of the two tables."""
    functions = {name: getattr(signals, name) for name in dir(signals) if inspect.isfunction(getattr(signals, name))}
    arrays = {name for name, f in functions.items() if "DataArray" in str(inspect.signature(f).return_annotation)}
    assert arrays == {*PARTS, *" ".join(NO_PARTS.values()).split()}


@pytest.mark.parametrize("name", PARTS)
def test_what_is_made_of_a_signal_keeps_how_the_shaft_turns(name):
    made = PARTS[name](turning_signal())
    t = made["time"].values
    assert t.size > 1000
    np.testing.assert_allclose(made["speed"], 2.0 * np.pi * (30.0 + 10.0 * (t - 5.0)), rtol=1e-9)
    # between samples an angle is a straight line
    np.testing.assert_allclose(made["angle"], 2.0 * np.pi * revolutions(t), atol=1e-5)
    assert (made["speed"].attrs["units"], made["angle"].attrs["units"]) == ("rad/s", "rad")
    assert made.attrs["teeth"] == (29, 31)
    assert made.attrs["source"] == "rig"
    assert "speed" not in made.attrs
    # the twin of constant speed keeps that, and has none over time
    plain = turning_signal().drop_vars(["speed", "angle"])
    steady = PARTS[name](with_metadata(plain, speed=200.0))
    assert steady.attrs["speed"] == 200.0
    assert set(steady.coords) == {"time", "channel", "units"}


def test_a_constant_speed_that_is_given_replaces_the_one_over_time():
    for steady in (with_metadata(turning_signal(), speed=200.0), to_signal(turning_signal(), speed="200 rad/s")):
        assert set(steady.coords) == {"time", "channel", "units"}
        assert analyse(steady, channels=["x"]).speed == pytest.approx(200.0)
    assert "speed" in with_metadata(turning_signal(), teeth=29).coords
