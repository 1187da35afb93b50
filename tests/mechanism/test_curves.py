"""Curves through points as functions of time: shape, derivatives, integral, and what they drive."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

from gearmbs.mechanism import Mechanism, ModelError, curve, curve_integral, polyline, polyline_integral, step
from tests.generators import cases, seed
from tests.says import says

T = [0.0, 0.3, 0.5, 1.2, 1.5]
F = [0.0, 40.0, 90.0, 90.0, 20.0]


def test_between_the_ends_it_is_the_monotone_cubic():
    f, peer = curve(T, F), PchipInterpolator(T, F)
    # the outer pieces have slope zero at the ends, the peer's have not
    for t in np.linspace(0.3, 1.2, 41):
        np.testing.assert_allclose(f.derivatives(t)[:2], (peer(t), peer(t, 1)), rtol=1e-12, atol=1e-9)


def test_it_is_held_outside_and_smooth_at_the_points():
    f = curve(T, F)
    assert f.derivatives(-1.0) == (0.0, 0.0, 0.0)
    assert f.derivatives(9.0) == (20.0, 0.0, 0.0)
    for t, value in zip(T, F, strict=True):
        before, after = f.derivatives(t - 1e-12), f.derivatives(t)
        assert after[0] == pytest.approx(value)
        np.testing.assert_allclose(before[:2], after[:2], atol=1e-7)


def test_two_points_make_a_step():
    f, same = curve([0.2, 0.7], [1.0, 5.0]), step(0.2, 1.0, 0.7, 5.0)
    for t in np.linspace(0.01, 1.01, 21):
        np.testing.assert_allclose(f.derivatives(t), same.derivatives(t), atol=1e-12)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(
    st.lists(st.floats(0.01, 3.0), min_size=1, max_size=8),
    st.lists(st.floats(-100.0, 100.0), min_size=9, max_size=9),
)
def test_the_integral_has_the_curve_as_its_rate(widths, values):
    t = np.concatenate([[0.25], 0.25 + np.cumsum(widths)])
    f = values[: t.size]
    rate, angle = curve(t, f), curve_integral(t, f, start=0.5)
    assert angle(t[0]) == pytest.approx(0.5)
    for x in np.linspace(t[0] - 0.2, t[-1] + 0.2, 7):
        _, first, second = angle.derivatives(x)
        np.testing.assert_allclose((first, second), rate.derivatives(x)[:2], rtol=1e-9, atol=1e-9)
    area = quad(rate, t[0], t[-1], points=t, limit=200)[0]
    assert angle(t[-1]) - 0.5 == pytest.approx(area, rel=1e-7, abs=1e-6)
    inside = [rate(x) for x in np.linspace(t[0], t[1], 9)]
    assert min(f[:2]) - 1e-9 <= min(inside) <= max(inside) <= max(f[:2]) + 1e-9


def test_it_drives_a_joint_and_a_torque():
    """Wheels driven along a speed curve and by a torque curve: angle and momentum are the integrals."""
    m = Mechanism("two wheels")
    driven, free = m.body("driven", 1.0, (0.1, 0.1, 0.2)), m.body("free", 1.0, (0.1, 0.1, 0.2))
    pin = m.revolute("pin", driven, m.ground, axis=(0, 0, 1))
    m.revolute("second pin", free, m.ground, axis=(0, 0, 1))
    m.rotation("drive", pin, curve_integral(["0 s", "300 ms", "0.5 s"], ["0 rpm", "600 rpm", "300 rpm"]))
    m.torque("load", free, curve([0.0, 0.3, 0.5], [0.0, 2.0, 1.0]), axis=(0, 0, 1))
    solution = m.simulate(0.7, tol=1e-8)
    speed = curve([0.0, 0.3, 0.5], np.array([0.0, 600.0, 300.0]) * np.pi / 30.0)
    np.testing.assert_allclose(
        solution.angular_velocity("driven")[:, 2], [speed(t) for t in solution.t], rtol=1e-9, atol=1e-9
    )
    impulse = curve_integral([0.0, 0.3, 0.5], [0.0, 2.0, 1.0])
    np.testing.assert_allclose(
        0.2 * solution.angular_velocity("free")[:, 2], [impulse(t) for t in solution.t], atol=2e-7
    )


@pytest.mark.parametrize(
    ("t", "f", "words"),
    [
        ([0.0], [1.0], says("1 times", "1 values", "give")),
        ([0.0, 1.0], [1.0], says("curve", "value for each")),
        ([0.0, 1.0, 0.5], [1.0, 2.0, 3.0], "0.5 s follows 1 s"),
        ([0.0, 1.0], [1.0, np.inf], says("curve", "times", "values", "finite")),
        ([0.0, "1 m"], [1.0, 2.0], "curve: times: '1 m' is in m"),
    ],
)
def test_wrong_points(t, f, words):
    with pytest.raises(ModelError, match=words):
        curve(t, f)


@pytest.mark.slow
def test_lines_are_the_lines_but_for_their_corners():
    """Of random points: exactly linear between the corners, near them at them, smooth, with a continuous integral."""
    rng = np.random.default_rng(seed())
    for _ in range(cases(20)):
        n = int(rng.integers(2, 7))
        t, f = np.cumsum(rng.uniform(0.2, 2.0, n)), rng.uniform(-300.0, 300.0, n)
        if n > 3 and rng.random() < 0.5:
            f[1] = f[2]
        rounding = float(rng.choice([0.005, 0.02, 0.25]))
        soft = bool(rng.random() < 0.5)
        rate = polyline(t, f, rounding, soft)
        angle = polyline_integral(t, f, 0.3, rounding, soft)
        times = np.sort(np.concatenate([rng.uniform(t[0] - 0.2, t[-1] + 0.2, 2000), t]))
        values = np.array([rate.derivatives(x) for x in times])
        line = np.interp(times, t, f)
        lines = np.flatnonzero(np.diff(t) > 0.0)
        for k in lines[1:] if soft else lines:
            width = t[k + 1] - t[k]
            inside = (times > t[k] + 2 * rounding * width) & (times < t[k + 1] - 2 * rounding * width)
            np.testing.assert_allclose(values[inside, 0], line[inside], atol=1e-9)
            np.testing.assert_allclose(values[inside, 1], (f[k + 1] - f[k]) / width, atol=1e-8)
            here = (times >= t[k]) & (times <= t[k + 1])
            assert np.abs(values[here, 0] - line[here]).max() <= rounding * np.abs(np.diff(f)).max() + 1e-9
        if soft:
            first = step(t[0], f[0], t[1], f[1])
            early = times < t[1]
            np.testing.assert_allclose(values[early, 0], [first(x) for x in times[early]], atol=1e-9)
        # neither the function nor its slope jumps
        fine = np.linspace(t[0] - 0.1, t[-1] + 0.1, 20001)
        slopes = np.array([rate.derivatives(x)[:2] for x in fine])
        steepest = np.abs(slopes[:, 1]).max()
        assert np.abs(np.diff(slopes[:, 0])).max() <= 1.01 * steepest * (fine[1] - fine[0]) + 1e-9
        assert np.abs(np.diff(slopes[:, 1])).max() < 0.3 * steepest + 1e-9
        np.testing.assert_allclose([angle.derivatives(x)[1] for x in times], values[:, 0], atol=1e-9)
        summed = np.concatenate([[0.0], np.cumsum(0.5 * (slopes[1:, 0] + slopes[:-1, 0]) * np.diff(fine))])
        turned = np.array([angle(x) for x in fine])
        np.testing.assert_allclose(turned - turned[0], summed, atol=1e-4 * np.abs(f).max())
        assert angle(t[0]) == pytest.approx(0.3, abs=1e-12)


def test_sharp_corners_and_wrong_roundings():
    assert polyline([0.0, 1.0, 3.0], [0.0, 2.0, 2.0], 0.0)(0.999) == pytest.approx(1.998, abs=1e-12)
    assert polyline([0.0, 1.0], [5.0, 7.0])(1.0) == pytest.approx(7.0, abs=1e-12)
    with pytest.raises(ModelError, match=says("0.3", "0", "0.25", "give a share")):
        polyline([0.0, 1.0], [5.0, 7.0], 0.3)
