"""Figures of records whose speed changes."""

import io

import numpy as np
import pytest

from gearmbs.signals import campbell, order_map, order_track, speed_curve, to_signal, waterfall
from gearmbs.view import campbell_plot, order_map_plot, order_track_plot, spectrogram_plot, waterfall_plot
from gearmbs.view.figures.style import png_bytes
from tests.says import says

POINTS = [(0.0, 0.0), (2.0, 300.0)]


@pytest.fixture(scope="module")
def signal():
    t = np.arange(8000) / 4000.0
    x = np.cos(10 * speed_curve(POINTS).angle(t))
    return to_signal({"a": x, "b": 2 * x}, rate=4000.0, units="m/s^2", speed=POINTS)


@pytest.mark.parametrize(
    ("draw", "settings", "labels"),
    [
        (spectrogram_plot, {"orders": [10]}, ("time, s", "frequency, Hz")),
        (order_map_plot, {"over": "speed", "marked": [10]}, ("order of the shaft's speed", "speed, rpm")),
        (order_map_plot, {}, ("order of the shaft's speed", "time, s")),
        (waterfall_plot, {"orders": [10], "steps": 10}, ("frequency, Hz", "speed, rpm")),
        (waterfall_plot, {"style": "map", "maximum": 800.0}, ("frequency, Hz", "speed, rpm")),
        (waterfall_plot, {"decibels": 40.0}, ("frequency, Hz", "speed, rpm")),
        (order_track_plot, {"orders": [10]}, ("speed, rpm", "peak amplitude, m/s²")),
        (order_track_plot, {"orders": [10], "over": "time", "log": True}, ("time, s", "peak amplitude, m/s²")),
    ],
)
@pytest.mark.slow
def test_a_signal_is_drawn_with_labels(signal, draw, settings, labels):
    figure = draw(signal, channel="b", title="run-up", **settings)
    panel = figure.axes[0]
    assert (panel.get_xlabel(), panel.get_ylabel()) == labels
    assert panel.get_title(loc="left") == "run-up: b"
    assert len(png_bytes(figure, 50)) > 5000


@pytest.mark.slow
def test_computed_maps_are_drawn_as_they_are(signal):
    assert order_map_plot(order_map(signal)).axes
    assert waterfall_plot(waterfall(signal)).axes
    assert order_track_plot(order_track(signal, orders=10)).axes


def test_campbell_diagram_over_a_measurement(signal):
    diagram = campbell([200.0, 400.0], ["0 rpm", "3000 rpm"], {"1×": 1, "10×": 10})
    figure = campbell_plot(diagram, measured=waterfall(signal), title="rig")
    panel = figure.axes[0]
    points = next(line for line in panel.lines if line.get_label() == "critical speeds")
    np.testing.assert_allclose(points.get_xdata(), [1200.0, 2400.0])
    assert campbell_plot([200.0], speeds=[0.0, 300.0], orders=[10]).axes
    assert "operating speed" not in figure.axes[0].get_legend_handles_labels()[1]
    for drawn in (
        campbell_plot(diagram, operating="1500 rpm"), campbell_plot(diagram.assign_attrs(operating_speed=50 * np.pi))
    ):  # fmt: skip
        lines = dict(zip(*drawn.axes[0].get_legend_handles_labels()[::-1]))
        np.testing.assert_allclose(lines["operating speed"].get_xdata(), 1500.0)
    with pytest.raises(ValueError, match="operating"):
        campbell_plot(diagram, operating="1500 kg")
    with pytest.raises(ValueError, match="speeds: give"):
        campbell_plot([200.0])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda s: order_map_plot(s, channel="c"), "there is no 'c'"),
        (lambda s: order_map_plot(s, over="angle"), says("over", "'time'", "'speed'", "'angle'")),
        (lambda s: waterfall_plot(s, style="bars"), says("style", "'lines'", "'map'", "'bars'")),
        (lambda s: spectrogram_plot(s.drop_vars("speed"), orders=[1]), says("speed", "known")),
        (lambda s: spectrogram_plot(s, maximum=0.0), says("maximum", "0.0 Hz", "31.25 Hz")),
    ],
)
def test_wrong_calls_name_the_argument(signal, call, said):
    with pytest.raises(ValueError, match=said):
        call(signal)


@pytest.mark.slow
def test_a_waterfall_has_a_scale(signal):
    """The bar beside the lines is as tall as the highest of them, and says how much that is, as a peak."""
    figure = waterfall_plot(signal, channel="b")
    panel = figure.axes[0]
    bar = next(line for line in panel.lines if list(line.get_xdata()) == [1.012, 1.012])
    tall = float(np.ptp(bar.get_ydata()))
    heights = [np.ptp(lines.get_segments()[0][:, 1]) for lines in panel.collections if hasattr(lines, "get_segments")]
    assert max(heights) == pytest.approx(tall, rel=0.05)
    assert any(text.get_text().startswith("peak amplitude, ") for text in panel.texts)
    figure.savefig(io.BytesIO(), format="png")
