"""Even samples from values at uneven times."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from gearmbs.signals import SignalError, even_signal
from gearmbs.signals.resampling import BLOCK, MARGIN, EvenSamples, monotone_cubic
from tests.says import says

RATE = 51200.0


def uneven_times(least=4e-6, seed=3, span=0.1):
    """Steps of 4 to 12 us, as an integrator takes them about a tooth contact."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(least, 3.0 * least, int(span / least)))
    return np.concatenate([[0.0], t[t < span]])


def test_slow_tones_keep_their_values():
    """PCHIP's error is about (omega h)^2 / 8 near extrema: 1 kHz at 12 us gives 7e-4 there, far less on average."""
    t = uneven_times()
    values = np.stack([np.sin(2000 * np.pi * t), np.cos(600 * np.pi * t)], axis=1)
    out = even_signal(t, values, RATE, start=0.01, stop=0.09, units="N", channels=["a", "b"], teeth=(29, 29))
    grid = out["time"].values
    assert grid[0] == pytest.approx(0.01)
    assert grid.size == 4097
    np.testing.assert_allclose(np.diff(grid), 1 / RATE, rtol=1e-6)
    np.testing.assert_allclose(out.values[:, 0], np.sin(2000 * np.pi * grid), atol=3e-4)
    np.testing.assert_allclose(out.values[:, 1], np.cos(600 * np.pi * grid), atol=3e-5)
    assert out.attrs["teeth"] == (29, 29)


def test_samples_of_values_that_come_in_pieces_are_those_of_all_at_once():
    t = uneven_times(span=0.3)
    tone = np.sin(2000 * np.pi * t)
    values = np.stack([tone, np.full(t.size, 0.1), tone, tone, np.floor(3.0 * tone)], axis=1)
    samples = EvenSamples(RATE, 0.01, 0.29, smooth=1, linear=1, held=1)
    waiting = []
    for k in range(0, t.size, 700):
        samples.take(t[k : k + 700], values[k : k + 700])
        waiting.append(samples.known()[1][0].size)
    made = samples.known()[0][1].copy()
    found, held = samples.finish()
    whole = even_signal(t, values[:, :2], RATE, start=0.01, stop=0.29)
    np.testing.assert_array_equal(samples.t, whole["time"].values)
    np.testing.assert_array_equal(found[:, :2], whole.values)
    np.testing.assert_array_equal(found[:, 2], monotone_cubic(t, tone, samples.t))
    np.testing.assert_array_equal(found[:, 3], np.interp(samples.t, t, tone))
    np.testing.assert_array_equal(held[:, 0], values[np.searchsorted(t, samples.t, side="right") - 1, 4])
    # what is waited for does not grow with the record
    assert max(waiting[len(waiting) // 2 :]) <= max(waiting[: len(waiting) // 2]) < t.size // 2
    np.testing.assert_array_equal(made, np.column_stack([found, held])[: len(made)])
    assert np.issubdtype(held.dtype, np.integer)


@pytest.mark.parametrize("also", [[], [lambda t: np.sin(2000 * np.pi * t)]], ids=["all", "beside others"])
def test_channels_that_do_not_change_stay_what_they_are(also):
    t = uneven_times()
    columns = [np.full(t.size, 0.1), *(function(t) for function in also), np.zeros(t.size)]
    out = even_signal(t, np.stack(columns, axis=1), RATE, start=0.01, stop=0.09)
    assert np.all(out.values[:, 0] == 0.1)
    assert np.all(out.values[:, -1] == 0.0)
    for column in columns[1:-1]:
        alone = even_signal(t, column, RATE, start=0.01, stop=0.09)
        np.testing.assert_array_equal(out.values[:, 1], alone.values[:, 0])


def test_tones_above_half_the_rate_do_not_fold_back():
    """40 kHz sampled at 51.2 kHz would show at 11.2 kHz with its full amplitude."""
    t = uneven_times(least=1e-6)
    out = even_signal(t, np.sin(80e3 * np.pi * t), RATE, start=0.01, stop=0.09)
    grid = out["time"].values
    direct = np.interp(grid, t, np.sin(80e3 * np.pi * t))
    assert np.sqrt(np.mean(direct**2)) > 0.5
    spectrum = np.abs(np.fft.rfft(out.values[:-1, 0] * np.hanning(grid.size - 1))) / (0.25 * grid.size)
    frequency = np.fft.rfftfreq(grid.size - 1, 1 / RATE)
    # the uneven steps themselves leave a noise at -70 dB
    assert spectrum[abs(frequency - 11200.0) < 500.0].max() < 3e-4


@pytest.mark.parametrize(
    ("t", "values", "span", "words"),
    [
        ([0.0, 0.1, 0.1], [1, 2, 3], (0.0, 0.05), "do not increase"),
        ([0.0, 0.1], [1, 2, 3], (0.0, 0.05), says("values", "time", "row")),
        ([0.0, 0.1], [1, 2], (0.0, 0.5), says("within the times")),
    ],
)
def test_wrong_input(t, values, span, words):
    with pytest.raises(SignalError, match=words):
        even_signal(np.array(t), np.array(values), RATE, start=span[0], stop=span[1])


@pytest.mark.parametrize("n", [2, 3, 4, 500])
def test_the_cubic_is_pchip(n):
    rng = np.random.default_rng(n)
    x = np.cumsum(rng.uniform(0.1, 1.0, n))
    y = np.cumsum(rng.normal(size=(n, 3)), axis=0)
    y[n // 2 : n // 2 + 3] = y[n // 2]
    at = np.concatenate([x, rng.uniform(x[0], x[-1], 300)])
    expected = PchipInterpolator(x, y, axis=0)(at)
    np.testing.assert_allclose(monotone_cubic(x, y, at), expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(monotone_cubic(x, y[:, 1], at), expected[:, 1], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("extra", [-1, 0, 1, 63, 64, 65])
def test_spans_that_end_about_the_end_of_a_block(extra):
    """What lies behind the span is made in blocks, too, of which the last may hold nothing else."""
    rate, count = 1000.0, 2 * BLOCK - MARGIN + extra
    t = np.arange(4 * (count + 4 * MARGIN)) / (4 * rate)
    start, stop = 2 * MARGIN / rate, (2 * MARGIN + count - 1) / rate
    found = even_signal(t, np.sin(40.0 * t), rate, start=start, stop=stop).values[:, 0]
    assert found.size == count
    assert np.abs(found - np.sin(40.0 * (start + np.arange(count) / rate))).max() < 1e-4
