"""Complex numbers are no results: they are refused by name, not cut to their real parts."""

import numpy as np
import pytest
import xarray as xr

from gearmbs.campaigns import Campaign, Factor, FunctionSubject, make_plan


def returning(x: float = 0.0, what: str = "real") -> dict:
    """Return numbers and a signal, of which what is asked for is complex."""
    found = {"z": np.float64(x), "wave": np.array([x, 1.0])}
    if what in found:
        found[what] = found[what] * np.exp(1j)
    if what == "plain":
        found["z"] = complex(x, 1.0)
    if what == "array":
        found["z"] = xr.DataArray(x + 1j)
    return found


def phasor(record) -> dict:
    """Return a complex number of a record."""
    return {"p": np.complex128(1.0 + 1.0j)} if record["z"] > 2.5 else {"p": 1.0}


@pytest.mark.parametrize(("what", "name"), [("z", "z"), ("plain", "z"), ("array", "z"), ("wave", "the signal wave")])
def test_of_a_function(tmp_path, what, name):
    subject = FunctionSubject(returning, {"x": 1.0, "what": what}, signals={"wave": (2, 10.0)})
    plan = make_plan(subject, [Factor("what", values=[what, "real"])], "grid", keep=["numbers", "signal:wave"], unit=2)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    assert campaign.table["status"].tolist()[1] == "done"
    assert campaign.table["z"].tolist()[1] == 1.0
    assert campaign.table["status"].tolist()[0] != "done"
    assert f"returned {name}" in campaign.failed().message.iloc[0]
    assert "complex" in campaign.failed().message.iloc[0]
    assert np.isnan(campaign.open().wave.values[0]).all()


def test_of_a_function_of_a_record(tmp_path):
    keep = ["numbers", f"tests.campaigns.test_complex_numbers:{phasor.__name__}"]
    subject = FunctionSubject(returning, {"x": 1.0, "what": "real"})
    campaign = Campaign(tmp_path / "c", make_plan(subject, [Factor("x", values=[2.0, 3.0])], "grid", keep=keep, unit=2))
    campaign.run(workers=0)
    assert campaign.table["p"].tolist()[0] == 1.0
    assert "phasor returned p = (1+1j): complex" in campaign.failed().message.iloc[0]
