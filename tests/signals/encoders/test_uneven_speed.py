"""Mesh lines of shafts whose speed swings within a turn, as by a joint or an engine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import special

from gearmbs.signals import (
    CoupledRun,
    encoder,
    make_signal,
    mark_errors,
    order_spectrum,
    phase_from_tacho,
    time_synchronous_average,
)
from gearmbs.signals import transmission_error_from_pulses as transmission_error
from gearmbs.signals.encoders.orders import common_angle
from tests.signals.encoders.bench import angle, free

RADIUS, HEIGHTS = 0.04, np.array([3e-6, 1e-6, 0.4e-6, 0.2e-6])
SPEED, RATE = 100.0, 20e3


def swinging(turns, swing, order):
    """Return times and the angle of a shaft whose speed swings by a share of itself."""
    times = np.arange(round(turns * math.tau / SPEED * RATE)) / RATE
    return times, SPEED * times + swing / order * np.sin(order * SPEED * times)


def shafts(teeth, turns, swing, order):
    times, driver = swinging(turns, swing, order)
    lag = sum(a * np.cos((h + 1) * teeth[0] * driver + h) for h, a in enumerate(HEIGHTS))
    return angle(driver, times), angle((driver - lag / RADIUS) * teeth[0] / teeth[1], times)


@pytest.mark.parametrize(("swing", "order"), [(0.01, 1.0), (0.01, 0.31), (0.01, 4.0), (0.03, 0.5), (0.02, 2.7)])
def test_a_swing_of_the_speed_takes_nothing_from_mesh_lines(swing, order):
    """Over an angle that lacks it J0(34 * 0.01) = 0.971 of the second harmonic is left."""
    pulses = [encoder(one, 180) for one in shafts((17, 43), 30, swing, order)]
    mesh = transmission_error(CoupledRun(*pulses), (17, 43), base_radius=RADIUS).harmonics()
    assert np.allclose(mesh["amplitude"][:2], HEIGHTS[:2], rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("order", [0.31, 1.0])
def test_uneven_marks_do_not_part_swinging_shafts(order):
    """What both shafts share leaks by uneven marks into other orders of the one than of the other.

    Of lines of 100 and 90, with what is folded taken out, the first harmonic was 15 % low, single ones 53 %.
    """
    lines, marks = (100, 90), [mark_errors(count, 0.01, k) for k, count in enumerate((100, 90))]

    def trains(both):
        return [encoder(one, n, marks=m, index=True) for one, n, m in zip(both, lines, marks)]

    known = dict(zip(("driver", "driven"), trains([free(seconds=0.5)] * 2)))
    run = CoupledRun(*trains(shafts((29, 31), 40, 0.01, order)))
    mesh = transmission_error(run, (29, 31), base_radius=RADIUS, free=known).harmonics()
    assert mesh["harmonic"].tolist() == [1]
    assert mesh["amplitude"][0] == pytest.approx(HEIGHTS[0], rel=2e-3)


def test_the_common_angle_has_the_swing_and_not_the_marks():
    times, driver = swinging(30, 0.01, 1.0)
    marks = mark_errors(256, 0.02, 3)
    train = encoder(angle(driver, times), 256, marks=marks, index=True)
    course = common_angle(train, marks)
    inside = (times > course.begin) & (times < course.end)
    off = course.angle(times[inside]) - driver[inside]
    # 1/1900 of a swing of 10 mrad
    assert np.ptp(off) < 2e-5
    assert np.ptp(common_angle(train).angle(times[inside]) - driver[inside]) < 1e-3


@pytest.mark.parametrize(("pulses", "line"), [(1, special.j0(0.68)), (4, 1.0), (60, 1.0)])
def test_a_tacho_of_some_pulses_a_turn_shows_vibration_its_whole_lines(pulses, line):
    """One pulse a turn shows no swing once a turn: J0(68 * 0.01) of the line is left, the rest beside it."""
    _, driver = swinging(30, 0.01, 1.0)
    tacho = np.where((pulses * driver / math.tau) % 1.0 < 0.5, 5.0, 0.0)
    signal = make_signal(np.stack((np.cos(68 * driver), tacho), 1), RATE, channels=["a", "tacho"])
    phase = phase_from_tacho(signal, "tacho", pulses_per_rev=pulses)
    average = time_synchronous_average(signal.sel(channel=["a"]), phase, revolutions=20)
    found = order_spectrum(average, window="boxcar").sel(order=68.0, method="nearest")
    assert found.item() == pytest.approx(line, rel=5e-3)
