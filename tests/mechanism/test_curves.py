"""Curves through points as functions of time: shape, derivatives, integral, and what they drive."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

from gearmbs.mechanism import Mechanism, ModelError, curve, curve_integral, step

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
        ([0.0], [1.0], "1 times and 1 values; give two points"),
        ([0.0, 1.0], [1.0], "a value for each time"),
        ([0.0, 1.0, 0.5], [1.0, 2.0, 3.0], "0.5 s follows 1 s"),
        ([0.0, 1.0], [1.0, np.inf], "must be finite"),
        ([0.0, "1 m"], [1.0, 2.0], "curve: times: '1 m' is in m"),
    ],
)
def test_wrong_points(t, f, words):
    with pytest.raises(ModelError, match=words):
        curve(t, f)
