"""Records as plain arrays: the numbers of the dataset, and nothing that is not asked for."""

import numpy as np
import pytest

from gearmbs.campaigns.subjects.pair import contact_numbers, harmonics, record_numbers
from gearmbs.signals import gmf_rms
from gearmbs.signals.files.simulated import record_signal
from gearmbs.studies import Case, plain_record, run_case
from gearmbs.studies.run import periodic

AUTO = Case(operation={"duration": "auto"}, solver={"lump": True})
GIVEN = Case(operation={"duration": 0.1, "settling": 0.0}, solver={"lump": True})
ASKED = ("gmf_rms", "acceleration", "normal_force", "transmission_error", "penetration_drive", "pairs_back")


@pytest.mark.parametrize("case", [AUTO, GIVEN], ids=["auto", "given"])
def test_numbers_of_a_plain_record_are_those_of_its_dataset(case):
    plain = plain_record(case, variables=ASKED)
    dataset = plain.dataset()
    assert {*dataset.data_vars} == {*ASKED}
    for name in (*ASKED, "way", "harmonic", "component", "time", "signal_time"):
        assert name in plain or name in plain.coords
        np.testing.assert_array_equal(plain.values(name), dataset[name].values)
    assert plain.told.items() <= dataset.attrs.items()
    assert harmonics(plain) == harmonics(dataset) != {}
    assert record_numbers(plain) == record_numbers(dataset)
    assert bool(record_numbers(plain)) == case.is_auto
    assert contact_numbers(case, plain) == contact_numbers(case, dataset)
    levels = dataset["gmf_rms"].sel(way="orders", component="line_of_action", harmonic=2)
    assert harmonics(plain)["orders.line_of_action.2"] == float(levels)


def test_levels_of_a_record_are_those_of_its_signal():
    """By the analysis of measurements, which knows the acceleration alone."""
    record = plain_record(GIVEN, variables=["gmf_rms", "acceleration"]).dataset()
    found = gmf_rms(record_signal(record), GIVEN.mesh_frequency, teeth=1)
    for way in ("band", "orders"):
        np.testing.assert_array_equal(record["gmf_rms"].sel(way=way), found[way])


def test_whoever_asks_for_levels_has_no_series_made(monkeypatch):
    levels = plain_record(AUTO, variables=["gmf_rms", "normal_force"]).values("gmf_rms")

    def measured(self, beyond):
        raise AssertionError("series over time are made")

    monkeypatch.setattr(periodic.PeriodicRecorder, "measured", measured)
    np.testing.assert_array_equal(run_case(AUTO, variables=["gmf_rms"])["gmf_rms"], levels)
    with pytest.raises(AssertionError, match="series"):
        plain_record(AUTO, variables=["gmf_rms", "normal_force"])


@pytest.mark.parametrize(
    "fault", [{}, pytest.param({"misalignment": "1 deg"}, marks=pytest.mark.slow)], ids=["healthy", "misaligned"]
)
def test_samples_that_are_not_kept_are_made_again(fault, monkeypatch):
    """The same sums from another beginning, whose rounding is a part of about 1e-16 of each of some thousand steps."""
    case = AUTO.changed(fault=fault)
    kept = plain_record(case, variables=["gmf_rms"])
    monkeypatch.setattr(periodic, "KEPT", 0)
    again = plain_record(case, variables=["gmf_rms"])
    assert kept.told == again.told
    np.testing.assert_allclose(kept.values("gmf_rms"), again.values("gmf_rms"), rtol=1e-9)
