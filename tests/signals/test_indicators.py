"""Condition indicators against closed forms."""

import math

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.signals import (
    INDICATORS,
    MissingMetadataError,
    SignalError,
    condition_indicators,
    crest_factor,
    difference_signal,
    energy_ratio,
    fm0,
    fm4,
    kurtosis,
    m6a,
    m8a,
    make_signal,
    mesh_envelope,
    na4,
    nb4,
    peak_to_peak,
    phase_from_speed,
    regular_signal,
    remove_orders,
    residual_signal,
    sideband_index,
    sideband_level,
    time_synchronous_average,
)
from tests.says import says

N = 4096
ANGLE = 2 * np.pi * np.arange(N) / N
SINE = np.sin(7 * ANGLE)


def average_of(values, teeth=32, turns=1):
    """An average as time_synchronous_average lays it out."""
    values = values[:, None] if values.ndim == 1 else values
    per_rev = values.shape[0] // turns
    return xr.DataArray(
        values,
        dims=("angle", "channel"),
        coords={
            "angle": np.arange(values.shape[0]) / per_rev,
            "channel": [f"c{i}" for i in range(values.shape[1])],
            "units": ("channel", ["m/s^2"] * values.shape[1]),
        },
        attrs={"samples_per_rev": per_rev, "teeth": (teeth,), "units": "m/s^2", "averages": 1},
    )


def test_moments_of_a_sine():
    # <sin^2> = 1/2, <sin^4> = 3/8, <sin^6> = 5/16, <sin^8> = 35/128
    assert kurtosis(SINE) == pytest.approx((3 / 8) / (1 / 2) ** 2)
    assert fm4(SINE) == pytest.approx(1.5)
    assert m6a(SINE) == pytest.approx((5 / 16) / (1 / 2) ** 3)
    assert m8a(SINE) == pytest.approx((35 / 128) / (1 / 2) ** 4)
    assert crest_factor(5.0 + SINE) == pytest.approx(math.sqrt(2), rel=1e-5)
    assert peak_to_peak(3 * SINE) == pytest.approx(6.0, rel=1e-5)


def test_moments_of_gaussian_noise():
    # (p - 1)!! = 3, 15, 105; the tolerances are three standard errors at 2e6 samples
    noise = np.random.default_rng(11).standard_normal(2_000_000)
    assert fm4(noise) == pytest.approx(3.0, abs=0.02)
    assert m6a(noise) == pytest.approx(15.0, abs=0.35)
    assert m8a(noise) == pytest.approx(105.0, abs=8.0)


def test_one_spike_in_n_samples():
    # +-1 and one spike A: m4 / m2^2 with m2 = 1 + A^2/N, m4 = 1 + A^4/N (mean negligible for A^2 << N)
    x = (-1.0) ** np.arange(10000)
    x[500] = 20.0
    mean = np.mean(x)
    m2, m4 = np.mean((x - mean) ** 2), np.mean((x - mean) ** 4)
    assert fm4(x) == pytest.approx(m4 / m2**2, rel=1e-12)
    assert fm4(x) == pytest.approx((1 + 20.0**4 / 10000) / (1 + 20.0**2 / 10000) ** 2, rel=2e-2)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(scale=st.floats(1e-9, 1e9), shift=st.floats(-1e3, 1e3), seed=st.integers(0, 1000))
def test_shape_indicators_ignore_scale_and_mean(scale, shift, seed):
    x = np.random.default_rng(seed).standard_normal(500)
    moved = scale * (x + shift)
    for indicator in (kurtosis, fm4, m6a, m8a, crest_factor):
        assert indicator(moved) == pytest.approx(indicator(x), rel=1e-6)


def test_a_constant_has_no_shape():
    assert math.isnan(kurtosis(np.full(10, 3.0)))
    assert math.isnan(crest_factor(np.zeros(10)))
    assert math.isnan(energy_ratio(SINE, np.zeros(N)))
    assert math.isnan(nb4(mesh_envelope(np.cos(32 * ANGLE), 1, 32)))


def test_fm0_of_two_harmonics():
    # cos + cos 2: largest 2, least -9/8 at cos a = -1/4, over the amplitudes 1 + 1
    x = np.cos(ANGLE * 8) + np.cos(ANGLE * 16)
    assert fm0(x, np.array([1.0, 1.0])) == pytest.approx((2 + 9 / 8) / 2, rel=1e-4)


def test_na4_grows_with_the_level_where_kurtosis_does_not():
    quiet, loud = SINE, 3.0 * SINE
    assert na4(quiet) == pytest.approx(1.5)
    # <x^4> = 81 * 3/8; mean variance over three quiet records and the loud one = (3/2 + 9/2) / 4
    assert na4(loud, [quiet] * 3) == pytest.approx(81 * 3 / 8 / ((3 * 0.5 + 4.5) / 4) ** 2)
    assert fm4(loud) == pytest.approx(1.5)


def test_mesh_envelope_and_nb4_of_an_am_tone():
    depth = 0.5
    modulation = 1 + depth * np.cos(3 * ANGLE)
    x = modulation * np.cos(32 * ANGLE) + 0.7 * np.cos(200 * ANGLE)
    envelope = mesh_envelope(x, 1, 32)
    np.testing.assert_allclose(envelope, modulation, atol=1e-9)
    # the envelope less its mean is a sine
    assert nb4(envelope) == pytest.approx(1.5)


def test_parts_of_an_average_by_their_orders():
    orders = {1: 1.0, 2: 0.9, 5: 0.8, 31: 0.7, 32: 2.0, 33: 0.6, 34: 0.5, 64: 1.5, 63: 0.4, 100: 0.3}
    x = 4.0 + sum(a * np.cos(k * ANGLE + k) for k, a in orders.items())
    average = average_of(x)

    def of(*kept):
        return sum((orders[k] * np.cos(k * ANGLE + k) for k in kept), np.zeros(N))

    np.testing.assert_allclose(regular_signal(average).values[:, 0], of(1, 2, 31, 32, 33, 63, 64), atol=1e-12)
    np.testing.assert_allclose(difference_signal(average).values[:, 0], of(5, 34, 100), atol=1e-12)
    np.testing.assert_allclose(residual_signal(average).values[:, 0], of(5, 31, 33, 34, 63, 100), atol=1e-12)
    np.testing.assert_allclose(
        (regular_signal(average) + difference_signal(average)).values[:, 0], x - x.mean(), atol=1e-12
    )
    np.testing.assert_allclose(remove_orders(average, [5], keep=True).values[:, 0], of(5), atol=1e-12)


def test_all_indicators_of_an_am_tone():
    depth, teeth = 0.4, 32
    tone = (1 + depth * np.cos(ANGLE)) * np.cos(teeth * ANGLE)
    difference = 0.1 * np.cos(10 * ANGLE)
    found = condition_indicators(average_of(tone + difference), harmonics=1)
    assert set(found.data_vars) == set(INDICATORS)
    value = {name: found[name].item() for name in INDICATORS}
    assert value["sideband_index"] == pytest.approx(depth / 2)
    # RMS^2 = 1/2 + 2 (d/2)^2/2 + 0.1^2/2
    level = math.sqrt(0.5 + depth**2 / 4 + 0.005)
    assert value["rms"] == pytest.approx(level)
    assert value["sideband_level"] == pytest.approx(depth / level)
    assert value["fm4"] == pytest.approx(1.5)  # the difference signal is the sine at order 10
    assert value["m6a"] == pytest.approx(2.5)
    assert value["m8a"] == pytest.approx(4.375)
    assert value["energy_ratio"] == pytest.approx(0.1 / math.sqrt(2) / math.sqrt(0.5 + depth**2 / 4))
    assert value["fm0"] == pytest.approx(np.ptp(tone + difference))  # the mesh amplitude is 1
    assert value["nb4"] == pytest.approx(1.5)
    assert found["rms"].attrs["units"] == "m/s^2"
    assert found["fm4"].attrs["units"] == "1"


def test_sideband_numbers_of_a_pure_am_tone():
    depth = 0.3
    x = (1 + depth * np.cos(ANGLE)) * np.cos(32 * ANGLE)
    assert sideband_index(np.array([depth / 2, depth / 2])) == pytest.approx(0.15)
    assert sideband_level(np.array([depth / 2, depth / 2]), x) == pytest.approx(
        depth / math.sqrt(0.5 + depth**2 / 4), rel=1e-9
    )


def test_history_enters_na4_and_nb4():
    x = np.cos(32 * ANGLE) * (1 + 0.5 * np.cos(3 * ANGLE)) + 0.2 * np.cos(11 * ANGLE)
    now = average_of(3 * x)
    old = [average_of(x), average_of(x)]
    alone, run = condition_indicators(now), condition_indicators(now, history=old)
    # variance 9 v now, v before: the mean is 11/3 v, so the quotient is (9 / (11/3))^2 of the one alone
    assert run["na4"].item() / alone["na4"].item() == pytest.approx((27 / 11) ** 2)
    assert run["nb4"].item() / alone["nb4"].item() == pytest.approx((27 / 11) ** 2)
    assert run["fm4"].item() == pytest.approx(alone["fm4"].item())


def test_indicators_over_two_revolutions():
    x = (1 + 0.2 * np.cos(2 * ANGLE)) * np.cos(32 * ANGLE) + 0.1 * np.cos(7 * ANGLE)
    once, twice = condition_indicators(average_of(x)), condition_indicators(average_of(np.tile(x, 2), turns=2))
    for name in INDICATORS:
        assert twice[name].item() == pytest.approx(once[name].item(), rel=1e-9)


@pytest.mark.parametrize(
    ("call", "error", "match"),
    [
        (lambda: condition_indicators(average_of(SINE[:32])), SignalError, says("32", "reach the mesh")),
        (lambda: condition_indicators(average_of(SINE).drop_attrs()), MissingMetadataError, "teeth is missing"),
        (lambda: regular_signal(average_of(SINE), sidebands=16), SignalError, says("sidebands", "16", "32 teeth")),
        (lambda: regular_signal(average_of(SINE)[:100]), SignalError, says("average", "0.0244141", "whole")),
        (lambda: remove_orders(average_of(SINE), [0.5]), SignalError, "not a multiple"),
    ],
)
def test_bad_calls_name_the_field(call, error, match):
    with pytest.raises(error, match=match):
        call()


def test_white_noise_averages_away():
    rate, f, revs = 10240.0, 20.0, 400
    noise = np.random.default_rng(2).standard_normal(round(rate / f * revs))
    signal = make_signal(noise, rate)
    average = time_synchronous_average(signal, phase_from_speed(signal, 2 * np.pi * f))
    # 512 samples a revolution fall on samples: the variance falls as 1 / averages
    assert average.values.std() == pytest.approx(1 / math.sqrt(average.attrs["averages"]), rel=0.05)
