"""What faults look like in the bearing force of a dynamic simulation: sidebands, and impacts once per revolution."""

from itertools import pairwise

import numpy as np
import pytest

from gearmbs.studies import Case, run_case

TEETH = 29
TURNS = 4
PER_TOOTH = 36  # samples: aliases of mesh harmonics fall on mesh harmonics
SPEED = 50.0  # turns per second

pytestmark = pytest.mark.slow


class Record:
    """Force of the shaft on the driven wheel across the line of centres over four turns, by orders of the shaft."""

    def __init__(self, **fault):
        case = Case(
            operation={
                "speed": 2 * np.pi * SPEED,
                "duration": TURNS / SPEED,
                "run_up": 0.02,
                "settling": 0.04,
            },
            fault={"backlash": "0.3 mm", **fault},
            solver={
                "output_rate": TEETH * PER_TOOTH * SPEED,
                "signal_rate": TEETH * PER_TOOTH * SPEED,
                "tolerance": 2e-8,  # the floor between the lines is the integrator's error
            },
        )
        self.dataset = run_case(case)
        self.force = self.dataset.force_2.values[:, 1]
        assert self.force.size == TURNS * TEETH * PER_TOOTH
        self.spectrum = np.fft.rfft(self.force)
        self.amplitude = 2 * np.abs(self.spectrum) / self.force.size

    @property
    def mesh(self):
        return self.amplitude[TURNS * TEETH]

    @property
    def sidebands(self):
        """The two next to the mesh frequency, in quadrature, N."""
        return np.hypot(self.amplitude[TURNS * (TEETH - 1)], self.amplitude[TURNS * (TEETH + 1)])

    @property
    def impacts(self):
        """What is left without the mesh harmonics, one row per turn, N."""
        rest = self.spectrum.copy()
        rest[:: TURNS * TEETH] = 0
        return np.fft.irfft(rest, self.force.size).reshape(TURNS, -1)

    @property
    def swing(self):
        """Peak to peak of the transmission error without the mesh harmonics, m."""
        rest = np.fft.rfft(self.dataset.transmission_error.values)
        rest[:: TURNS * TEETH] = 0
        return np.ptp(np.fft.irfft(rest, self.force.size))


@pytest.fixture(scope="module")
def healthy():
    return Record()


def test_a_healthy_pair_has_mesh_harmonics_only(healthy):
    # 112 N at the mesh frequency; the rest, 0.02 N in the sidebands, is the integrator's error
    assert healthy.mesh > 50.0
    assert healthy.sidebands < 2e-3 * healthy.mesh
    assert np.sqrt(np.mean(healthy.impacts**2)) < 0.02 * healthy.mesh


@pytest.mark.parametrize("change", [{"misalignment": "0.3 deg"}, {"centre_distance_error": "1 mm"}])
def test_misalignment_and_centre_distance_leave_the_sidebands_alone(healthy, change):
    record = Record(**change)
    # they change the mesh line itself
    assert abs(record.mesh / healthy.mesh - 1) > 0.2
    assert record.sidebands < 2e-3 * record.mesh


def test_an_eccentric_wheel_makes_sidebands_that_grow(healthy):
    records = [Record(teeth=[{"kind": "eccentricity", "amount": amount}]) for amount in ("10 um", "40 um")]
    levels = [healthy.sidebands, *(r.sidebands for r in records)]
    assert 10 * levels[0] < levels[1]
    assert 2 * levels[1] < levels[2]
    # the driven wheel lags once per turn by the eccentricity
    for record, amount in zip(records, (10e-6, 40e-6)):
        lag = 2 * np.abs(np.fft.rfft(record.dataset.transmission_error.values)) / record.force.size
        assert lag[TURNS] == pytest.approx(amount, rel=0.02)


SERIES = {
    "broken tooth": [{"lost": 0.1}, {"lost": 0.2}, {"lost": 0.8}],
    "chipped corner": [{"height": "1.5 mm", "length": "15 mm"}, {"height": "2.5 mm", "length": "20 mm"}],
}


@pytest.mark.parametrize("kind", SERIES)
def test_damaged_teeth_hit_once_per_turn_and_show_more_the_worse_they_are(healthy, kind):
    levels = [(healthy.sidebands, healthy.swing)]
    for severity in SERIES[kind]:
        record = Record(teeth=[{"kind": kind, **severity}])
        # labels travel with the record
        assert kind in record.dataset.attrs["fault_teeth"]
        impacts = np.abs(record.impacts)
        where, peak = impacts.argmax(axis=1), impacts.max(axis=1)
        # in the same place of every turn, equally hard, and standing out of the rest
        assert np.ptp(where) <= 2
        assert peak.min() > 0.9 * peak.max()
        assert peak.min() > 5 * np.sqrt(np.mean(impacts**2))
        assert peak.min() > 10 * np.abs(healthy.impacts).max()
        levels.append((record.sidebands, record.swing))
    # the height of a single hit depends on how the gap closes; sidebands and transmission error rise with the damage
    for before, after in pairwise(levels):
        assert after[0] > 1.3 * before[0]
        assert after[1] > 1.3 * before[1]


def test_faults_combine(healthy):
    record = Record(teeth=[{"kind": "eccentricity", "amount": "40 um"}, {"kind": "broken tooth", "lost": 0.4}])
    assert record.sidebands > 10 * healthy.sidebands
    assert np.abs(record.impacts).max() > 10 * np.abs(healthy.impacts).max()
