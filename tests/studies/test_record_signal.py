"""Simulated records on their way to the analysis of measurements."""

import pytest

from gearmbs.signals import SignalError, analyse, write_signal
from gearmbs.signals.simulated import parse_models, read_any
from gearmbs.studies import Case, record_signal, run_case
from gearmbs.studies.store import write_dataset


@pytest.fixture(scope="module")
def records():
    """A healthy pair and one with half a tooth missing, eight revolutions each."""
    healthy = Case(name="healthy", operation={"speed": "2400 rpm", "duration": 0.2})
    broken = healthy.changed(name="broken", fault={"teeth": {"kind": "broken tooth", "lost": 0.5}})
    return {case.name: run_case(case) for case in (healthy, broken)}


def test_a_broken_tooth_is_a_local_fault_to_the_indicators(records):
    found = {name: analyse(record_signal(record, "line_of_action")) for name, record in records.items()}
    # 29 teeth at 40 turns a second
    assert found["broken"].gmf == pytest.approx(1160.0)
    for name in ("kurtosis", "energy_ratio", "sideband_level"):
        assert found["broken"].indicators[name].item() > 3.0 * found["healthy"].indicators[name].item(), name


def test_record_signal_keeps_what_is_known(records):
    signal = record_signal(records["healthy"])
    assert signal["channel"].values.tolist() == records["healthy"].component.values.tolist()
    assert signal.attrs["teeth"] == (29, 29)
    assert signal.attrs["sampling_rate"] == records["healthy"].attrs["solver_signal_rate"] == 25600.0
    assert signal.attrs["units"] == "m/s^2"
    with pytest.raises(SignalError, match="there is no 'up'"):
        record_signal(records["healthy"], "up")
    with pytest.raises(SignalError, match="not the record of a case"):
        record_signal(records["healthy"].drop_attrs())


def test_files_of_runs_and_measurements_are_read_alike(records, tmp_path):
    write_dataset(tmp_path / "run.nc", records["broken"])
    signal = record_signal(records["broken"], "tangential")
    assert read_any(tmp_path / "run.nc", "tangential").equals(signal)
    write_signal(signal, tmp_path / "measured.nc")
    assert read_any(tmp_path / "measured.nc").equals(signal)
    models = parse_models(["low:broken=" + str(tmp_path / "run.nc")], "tangential")
    assert models["low"]["broken"].equals(signal)
    with pytest.raises(SignalError, match="is_none"):
        parse_models([str(tmp_path / "is_none.nc")], "tangential")
