"""Functions of signals take plain arrays and tables with their rate, and quantities as texts."""

import inspect

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearmbs as gm
from gearmbs import signals as of_signals
from tests.says import says

RATE = 5000.0
TIME = np.arange(20000) / RATE
SPEED = 6.0 + 2.0 * TIME
VALUES = np.sin(2 * np.pi * 12 * np.cumsum(SPEED) / RATE) + 0.05 * np.random.default_rng(0).standard_normal(TIME.size)
CURVE = xr.DataArray(2 * np.pi * SPEED[::50], dims="time", coords={"time": TIME[::50]})
SHAPES = {
    "array": VALUES,
    "two columns": np.stack([VALUES, VALUES], axis=1),
    "list": VALUES.tolist(),
    "series": pd.Series(VALUES, name="x"),
    "table": pd.DataFrame({"x": VALUES}),
    "mapping": {"x": VALUES},
    "DataArray": xr.DataArray(VALUES, dims="time"),
}
CALLS = {
    gm.order_map: {"speed": CURVE},
    gm.order_track: {"speed": CURVE, "orders": [12]},
    gm.spectrogram: {"segment": "100 ms", "maximum": "2 kHz"},
    gm.waterfall: {"speed": CURVE, "segment": "0.2 s", "maximum": "1 kHz"},
    gm.spectrum: {"segment": "0.5 s"},
    gm.envelope_spectrum: {"band": ("0.5 kHz", "1 kHz")},
    of_signals.envelope: {"band": ("500 Hz", 1000.0)},
    of_signals.spectral_kurtosis: {},
    of_signals.kurtogram: {"levels": 3},
    of_signals.prewhiten: {},
    of_signals.level_lines: {"width": "40 Hz"},
    of_signals.power_cepstrum: {"segment": "1 s"},
    of_signals.bandpass: {"low": "500 Hz", "high": "1 kHz", "transition": "100 Hz"},
}
SIGNAL = gm.make_signal(VALUES, RATE, channels=["x"], units="m/s^2")


@pytest.mark.parametrize("function", CALLS, ids=lambda f: f.__name__)
@pytest.mark.parametrize("shape", SHAPES)
def test_any_shape_gives_what_the_signal_gives(function, shape):
    expected = function(SIGNAL, **CALLS[function])
    found = function(SHAPES[shape], rate="5 kHz", units="m/s^2", **CALLS[function])
    np.testing.assert_allclose(
        _first(found).isel(channel=0).values, _first(expected).isel(channel=0).values, rtol=1e-9, atol=1e-12
    )


def _first(result):
    return result if isinstance(result, xr.DataArray) else result["kurtosis"]


def test_texts_are_the_numbers():
    text = gm.spectrogram(SIGNAL, segment="100 ms", maximum="1 kHz")
    xr.testing.assert_identical(text, gm.spectrogram(SIGNAL, segment=0.1, maximum=1000.0))
    one, other = (of_signals.envelope(SIGNAL, band) for band in (("500 Hz", "1 kHz"), (500.0, 1000.0)))
    xr.testing.assert_identical(one, other)


def test_figures_take_them_too():
    figure = gm.order_map_plot(VALUES, speed=CURVE, rate=RATE, units="g")
    assert "g" in figure.axes[-1].get_ylabel()
    gm.waterfall_plot({"500 rpm": VALUES, "600 rpm": VALUES}, rate="5 kHz", maximum="1 kHz")
    limit = gm.spectrogram_plot(VALUES, rate=RATE, maximum="1 kHz").axes[0].get_ylim()[1]
    assert 990.0 < limit < 1100.0


def test_what_is_missing_or_wrong_is_told_in_one_line():
    with pytest.raises(of_signals.MissingMetadataError, match=says("rate", "array of samples")):
        gm.order_map(VALUES, CURVE)
    with pytest.raises(of_signals.SignalError, match=says("segment", "'3 mm'")):
        gm.spectrogram(VALUES, rate=RATE, segment="3 mm")
    with pytest.raises(of_signals.SignalError, match="leave rate out"):
        gm.spectrogram(SIGNAL, rate=2 * RATE)


def test_signatures_show_the_keywords():
    for function in CALLS:
        assert {"rate", "units", "channels", "gaps"} <= set(inspect.signature(function).parameters)


@pytest.mark.parametrize("function", CALLS, ids=lambda f: f.__name__)
def test_keywords_there_are_not_are_refused(function):
    with pytest.raises(TypeError, match="unexpected keyword argument 'rates'"):
        function(SIGNAL, rates="5 kHz", **CALLS[function])


def test_type_checkers_are_told_of_the_keywords():
    """Each function that takes data has a table of keywords with those of data in it, which signatures do not show."""
    taking = {name: f for name in of_signals.__all__ if holds_given(f := getattr(of_signals, name))}
    assert {"spectrum", "order_map", "diagnose_bearing", "phase_from_tacho"} <= taking.keys()
    for name, function in taking.items():
        own = list(parameters_of(inspect.unwrap(function)))
        # some have these keywords among their own parameters
        tables = [str(p.annotation) for p in own if p.kind is p.VAR_KEYWORD]
        assert "rate" in {p.name for p in own} or tables[0] in {f"Unpack[{kind}]" for kind in TABLES}, name
        assert "_data" not in inspect.signature(function).parameters


TABLES = ("DataKeywords", "ShaftAndDataKeywords", "OfChannelKeywords")
"""Those with the keywords of data."""


def parameters_of(function):
    return inspect.signature(function).parameters.values()


def holds_given(function):
    return inspect.isfunction(function) and {"rate", "units", "channels", "gaps"} <= set(
        inspect.signature(function).parameters
    )
