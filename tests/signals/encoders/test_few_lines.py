"""Few lines: what encoders do not show is said and is in the intervals, no sound tooth is accused; loads compared."""

import math
import re

import numpy as np
import pytest

from gearmbs.signals import SignalError, transmission_error_from_pulses
from tests.says import says
from tests.signals.encoders.bench import Discs, coupled

TEETH, RADIUS, TOOTH, BUMP = (29, 29), 40e-3, 7, 10e-6


def lag(turned, tooth=BUMP, mesh=3e-6):
    """Mesh harmonics 1 and 2, and one tooth of the driver, higher by a half on average, m."""
    cycle = 29 * turned
    there = np.floor(cycle + 0.5) % 29 == TOOTH
    own = np.where(there, np.sin(math.pi * (cycle + 0.5)) ** 2, 0.0)
    return mesh * (np.cos(math.tau * cycle) + 0.5 * np.cos(2 * math.tau * cycle)) + tooth * own


def found(lines, **known):
    discs = Discs(lines, error=0.0, jitter="1 ns", clock="1 ns")
    angles = coupled(lambda turned: lag(turned, **known), TEETH, RADIUS, turns=16)
    return transmission_error_from_pulses(discs.run(angles), TEETH, base_radius=RADIUS, mark_error=1e-6)


# exact: of a tooth's pitch sin^2 has the mean 1/2
DEVIATION, RANGE = 0.5 * BUMP, float(np.ptp(lag(np.arange(58000) / 58000)))


@pytest.mark.parametrize("lines", [60, 90, 200, 360])
def test_a_wrong_tooth_seen_in_part_accuses_no_sound_one(lines):
    """Of 60 lines a third of it is seen, and as much half a turn away: 21 and 22 had stood out, known to 0.05 um."""
    result = found(lines)
    teeth = result.tooth_errors("driver")
    assert set(teeth.index[teeth["stands_out"]]) <= {TOOTH}
    assert abs(teeth["deviation"][TOOTH] - DEVIATION) < teeth["within"][TOOTH]
    assert teeth["stands_out"][TOOTH] == (lines >= 200)
    flank = result.single_flank().set_index("of")
    assert np.all(np.abs(flank["F_i"] - RANGE) < flank["within"])
    assert re.search(says("Not seen", "orders", "driver"), result.to_markdown())


@pytest.mark.slow
def test_of_many_lines_intervals_are_those_of_noise():
    result = found(1024)
    teeth = result.tooth_errors("driver")
    assert list(teeth.index[teeth["stands_out"]]) == [TOOTH]
    assert teeth["within"][0] < 0.02 * DEVIATION
    assert abs(teeth["deviation"][TOOTH] - DEVIATION) < 0.02 * DEVIATION
    assert abs(result.single_flank()["F_i"][0] - RANGE) < 0.02 * RANGE
    assert "Not seen" not in result.to_markdown()


def test_orders_of_the_shafts_are_seen_where_no_mesh_harmonic_is():
    """60 lines of 20 and 29 teeth fold all mesh harmonics onto 0 and 20; run-out of the driver is right."""
    discs = Discs(60, error=0.0, jitter="1 ns", clock="1 ns")
    angles = coupled(lambda turned: 2e-6 * np.cos(math.tau * turned), (20, 29), RADIUS, turns=60)
    result = transmission_error_from_pulses(discs.run(angles), (20, 29), base_radius=RADIUS, mark_error=1e-6)
    orders = result.shaft_orders().set_index("order_driver")
    assert orders["amplitude"][1.0] == pytest.approx(2e-6, rel=0.01)
    assert not len(result.harmonics())
    flank = result.single_flank().set_index("of")
    assert flank[["F_i", "f_i", "f_k"]].isna().all(axis=None)
    assert flank["f_l"]["driver"] == pytest.approx(4e-6, rel=0.02)
    assert re.search(says("no mesh harmonic", "shafts"), result.verdict)
    assert re.search(says("harmonic 2", "driver"), result.to_markdown())
    assert "mesh_harmonics" in result.tables()
    with pytest.raises(SignalError, match=says("60", "more lines")):
        transmission_error_from_pulses(discs.run(angles), (20, 29), base_radius=RADIUS, harmonics=2)


def test_loads_are_compared_in_report_and_tables():
    """The difference has no part of marks that are not known."""
    discs = Discs(256, error=0.01)
    runs = []
    for k, (load, size) in enumerate({"low": 3e-6, "high": 5e-6}.items()):
        angles = coupled(lambda turned, size=size: lag(turned, tooth=0.0, mesh=size), TEETH, RADIUS, turns=16)
        runs.append(discs.run(angles, k, load=load))
    result = transmission_error_from_pulses(runs, TEETH, base_radius=RADIUS)
    table = result.tables()["mesh_differences"]
    assert set(table["load"]) == {"high - low"}
    np.testing.assert_allclose(table["amplitude"][:2], [2e-6, 1e-6], atol=3e-8)
    assert re.search(says("From low to high", "harmonic 1", "um"), result.verdict)
    assert re.search(says("difference high - low"), result.to_markdown())
    assert "mesh_differences" not in transmission_error_from_pulses(runs[0], TEETH, base_radius=RADIUS).tables()
