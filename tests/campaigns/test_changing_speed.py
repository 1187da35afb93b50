"""Cases whose speed changes: what goes by one mesh frequency is left empty, and the rest is kept."""

import numpy as np
import pytest
import xarray as xr

from gearmbs.campaigns import Campaign, DrivetrainSubject, Factor, make_plan
from gearmbs.campaigns.subjects.pair import PairSubject, contact_numbers
from gearmbs.studies import Case
from tests.campaigns.test_tables import STAGE

CURVE = [(0.0, "600 rpm"), (1.0, "1200 rpm")]
ALWAYS = {"force.mean", "force.max", "penetration.max", "two_flanks", "error.mean", "error.peak_to_peak"}
RUN_UP = STAGE | {
    "drives": {"motor": {"shaft": "in", "speed": "1500 rpm", "curve": [["0 s", "1200 rpm"], ["0.1 s", "1500 rpm"]]}},
    "run": {"settling": "10 ms", "duration": "90 ms"},
}


def record_of(case, mesh_cycles):
    """Return a record whose transmission error has amplitudes of 3 and 1 um at the first two mesh harmonics."""
    error = 1e-6 * (3.0 * np.sin(2.0 * np.pi * mesh_cycles) + np.sin(4.0 * np.pi * mesh_cycles))
    names = ("normal_force", "penetration_drive", "pairs_back")
    return xr.Dataset({"transmission_error": ("time", error), **{n: ("time", np.ones(error.size)) for n in names}})


def test_harmonics_of_the_transmission_error_are_those_of_one_speed():
    case = Case(operation={"speed": "900 rpm", "duration": "0.5 s"})
    t = np.arange(int(0.5 * case.output_rate)) / case.output_rate
    numbers = contact_numbers(case, record_of(case, case.mesh_frequency * t))
    assert numbers.keys() == ALWAYS | {"error.1", "error.2", "error.3"}
    np.testing.assert_allclose([numbers[f"error.{k}"] for k in (1, 2, 3)], [3e-6, 1e-6, 0.0], rtol=0.01, atol=1e-8)
    case = Case(operation={"speed": CURVE})
    t = np.arange(int(case.output_rate)) / case.output_rate
    cycles = case.gears.teeth[0] * (10.0 * t + 5.0 * t**2)
    kept = PairSubject().reduce(case, record_of(case, cycles), ["harmonics", "contact"])
    assert kept.numbers.keys() == ALWAYS


@pytest.mark.slow
def test_a_drivetrain_whose_drive_follows_a_curve(tmp_path):
    factors = [Factor("loads.brake.torque", "80 N m", "100 N m")]
    campaigns = {}
    for name, keep in (("default", None), ("all", ["harmonics", "forces", "signal:turn"])):
        campaigns[name] = Campaign(tmp_path / name, make_plan(DrivetrainSubject(RUN_UP), factors, "grid", keep=keep))
        campaigns[name].run(workers=0)
        assert campaigns[name].table["status"].tolist() == ["done"] * 2, campaigns[name].failed()
    table = campaigns["all"].table
    assert not [name for name in table if name.endswith(".mesh.1")]
    assert (table["mesh.normal_force.mean"] > 0.0).all()
    steady = make_plan(DrivetrainSubject(STAGE), factors[:1], "grid")
    campaign = Campaign(tmp_path / "steady", steady)
    campaign.run(workers=0)
    assert [name for name in campaign.table if name.endswith(".mesh.1")]
