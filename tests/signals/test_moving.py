"""What moves in a record: the shaft whose speed is told, or something beside it while the shaft is steady."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.signals import analyse, diagnose_bearing, make_signal
from gearmbs.signals.rotation.moving import still_orders
from gearmbs.signals.rotation.sweep import moving_lines, swept
from tests.generators import seed

RATE, SECONDS, TURN = 12800.0, 8.0, 27.5
TIME = np.arange(int(RATE * SECONDS)) / RATE
PART = TIME / SECONDS


def lines(orders, speed, size=1.0):
    """Lines at orders of a speed, Hz."""
    angle = 2.0 * np.pi * np.cumsum(np.broadcast_to(speed, TIME.shape)) / RATE
    return sum(size / np.sqrt(i + 1) * np.cos(k * angle + k * k) for i, k in enumerate(orders))


def record(*parts, rng=0):
    noise = 0.3 * np.random.default_rng(rng).standard_normal(TIME.size)
    return make_signal(sum(parts) + noise, RATE, units="m/s^2")


def told(signal, turn=TURN, teeth=()):
    found = swept(signal, 2.0 * np.pi * turn, teeth)
    return [doubted for _, doubted in found]


GEAR = (29, 58, 87)
STEADY = lines(GEAR, TURN) + lines((1, 2), TURN, 0.3)
DRIFTS = {
    "an inverter's": lines((1,), 2000.0 + 600.0 * PART, 0.8),
    "down": lines((1,), 3000.0 - 600.0 * PART, 0.8),
    "one that warms up": lines((1,), 1300.0 * (1.0 + 0.08 * (1.0 - np.exp(-3.0 * PART))), 0.8),
    "a neighbour that runs up": lines((1, 2, 3, 4), 1.31 * TURN * (1.0 + 0.1 * PART), 0.8),
}


@pytest.mark.slow
@pytest.mark.parametrize("drift", DRIFTS)
@pytest.mark.parametrize("teeth", [(), (29,)])
@pytest.mark.parametrize("turn", [TURN, 1.004 * TURN])
def test_what_drifts_beside_a_steady_shaft_is_not_the_shaft(drift, teeth, turn):
    seen = record(STEADY, DRIFTS[drift])
    assert {1, 2, 29, 58, 87} <= set(still_orders(seen, 2.0 * np.pi * turn))
    assert told(seen, turn, teeth) == ([] if moving_lines(seen) is None else [False])


@pytest.mark.slow
@pytest.mark.parametrize("rise", [0.05, -0.1, 0.2, 0.5])
@pytest.mark.parametrize("beside", [
    (), lines((1, 2, 3, 4), TURN, 0.5), lines((1, 2, 3, 4), 3 * TURN, 0.5), lines((1, 2, 3), 2 * TURN, 0.1),
    lines((1, 2, 3, 4, 5), 1.3 * TURN, 0.5), lines((1, 2, 3, 5), 50.0, 0.5),
], ids=["alone", "same speed", "three times", "twice, weak", "another", "mains"])  # fmt: skip
def test_a_run_up_is_told_beside_machines_that_stand_still(rise, beside):
    """Of the same nominal speed, or of a multiple of it: their lines are whole orders of the told speed."""
    speed = TURN * (1.0 + rise * PART)
    seen = record(lines(GEAR, speed), lines((1,), speed, 0.3), *([] if isinstance(beside, tuple) else [beside]))
    assert told(seen) == [True]
    assert told(seen, teeth=(29,)) == [True]


@pytest.mark.slow
@pytest.mark.parametrize("ramp", [PART, np.clip(3.0 * PART - 1.0, 0.0, 1.0)])
def test_a_run_up_of_one_line_is_told_where_it_passes_the_mesh(ramp):
    """Of a line alone nothing else tells: without teeth it is named, with its frequencies, and no speed doubted."""
    seen = record(lines((29,), TURN * (1.0 + 0.2 * ramp)), lines((1, 2, 3, 4), TURN, 0.5))
    assert told(seen, teeth=(29,)) == [True]
    ((words, doubted),) = swept(seen, 2.0 * np.pi * TURN)
    assert not doubted
    assert "orders 1, 2, 3, 4 stand still" in words
    low = record(lines((1, 2, 3, 4, 5), TURN * (1.0 + 0.3 * ramp)), lines((1, 2, 3, 4), TURN, 0.5))
    assert told(low) == [True]


@pytest.mark.slow
def test_reports_name_what_drifts_and_doubt_no_speed():
    seen = record(STEADY, lines((3, 4, 5), TURN, 0.2), DRIFTS["an inverter's"])
    report = analyse(seen, speed=f"{60 * TURN} rpm")
    said = [note for note in report.notes if "moves up" in note]
    assert len(said) == 1
    assert "CHECK" not in said[0]
    assert any("moves up" in note for note in diagnose_bearing(seen, "6205", f"{60 * TURN} rpm").notes)
    assert "CHECK THE SPEED" not in diagnose_bearing(seen, "6205", f"{60 * TURN} rpm").verdict


@pytest.mark.slow
@pytest.mark.hunt
@pytest.mark.parametrize("draw", range(20))
def test_drifts_and_run_ups_of_many_machines_are_told_apart(draw):
    rng = np.random.default_rng(seed(100 + draw))
    turn, teeth, way = rng.uniform(15.0, 45.0), int(rng.integers(17, 48)), rng.choice([-1, 1])
    ramp = PART if rng.random() < 0.7 else np.clip(3.0 * PART - 1.0, 0.0, 1.0)
    speed = turn * (1.0 + rng.choice([0.05, 0.1, 0.2, 0.5]) * way * ramp)
    mesh = [teeth * h for h in (1, 2, 3)]
    up = record(lines(mesh, speed), lines((1,), speed, 0.3), lines((1, 2, 3, 4), turn, 0.5), rng=draw)
    assert told(up, turn) == [True]
    start = rng.uniform(300.0, 4000.0)
    drift = lines((1,), start * (1.0 + rng.uniform(0.04, 0.4) * way * PART), 0.8)
    still = record(lines(mesh, turn), lines((1, 2), turn, 0.3), drift, rng=draw)
    assert told(still, turn) in ([], [False])
