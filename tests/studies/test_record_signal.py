"""Simulated records on their way to the analysis of measurements."""

import numpy as np
import pytest

from gearmbs.signals import SignalError, analyse, write_signal
from gearmbs.signals.files.simulated import parse_models, read_any
from gearmbs.studies import Case, record_signal, run_case
from gearmbs.studies.run.store import write_dataset
from gearmbs.view import average_plot
from tests.generators import cases, seed
from tests.says import says


@pytest.fixture(scope="module")
def records():
    """A healthy pair and one with half a tooth missing, eight revolutions each."""
    healthy = Case(name="healthy", operation={"speed": "2400 rpm", "duration": 0.2})
    broken = healthy.changed(name="broken", fault={"teeth": {"kind": "broken tooth", "lost": 0.5}})
    return {case.name: run_case(case) for case in (healthy, broken)}


@pytest.mark.slow
def test_a_broken_tooth_is_a_local_fault_to_the_indicators(records):
    found = {name: analyse(record_signal(record, "line_of_action")) for name, record in records.items()}
    # 29 teeth at 40 turns a second
    assert found["broken"].gmf == pytest.approx(1160.0)
    for name in ("kurtosis", "energy_ratio", "sideband_level"):
        assert found["broken"].indicators[name].item() > 3.0 * found["healthy"].indicators[name].item(), name


@pytest.mark.slow
@pytest.mark.parametrize("case", range(cases(3)))
def test_a_broken_tooth_shows_at_its_number(case):
    """Any tooth of either wheel, whatever the numbers of teeth, the speed and the settling."""
    rng = np.random.default_rng((seed(), case))
    teeth = tuple(int(z) for z in rng.choice(np.arange(19, 40), 2, replace=False))
    wheel = int(rng.integers(2))
    count, tooth, speed = teeth[wheel], int(rng.integers(teeth[wheel])), rng.uniform(60.0, 200.0)
    operation = {"speed": speed, "settling": rng.uniform(0.02, 0.06), "torque": "50 N m",
                 "duration": 4.2 * 2 * np.pi / speed * max(1.0, teeth[1] / teeth[0])}  # fmt: skip
    broken = {"kind": "broken tooth", "tooth": tooth, "wheel": ("driver", "driven")[wheel]}
    record = run_case(
        Case(gears={"teeth": teeth}, operation=operation, fault={"teeth": broken}), variables=["acceleration"]
    )
    average = analyse(record_signal(record, "line_of_action"), wheel=wheel + 1).average
    panel = average_plot(average, teeth=count).axes[0]
    assert panel.get_xlabel() == f"tooth of the {('driver', 'driven wheel')[wheel]} in mesh, 0 to {count - 1}"
    assert panel.get_ylabel().startswith("force over mass")
    x, y = panel.lines[0].get_data()
    # the wheels strike when the tooth should bear: within its contact, one pitch about its place on the line of centres
    assert abs((x[np.argmax(np.abs(y))] - tooth + count / 2) % count - count / 2) < 1.0


def test_record_signal_keeps_what_is_known(records):
    signal = record_signal(records["healthy"])
    assert signal["channel"].values.tolist() == records["healthy"].component.values.tolist()
    assert signal.attrs["teeth"] == (29, 29)
    assert signal.attrs["sampling_rate"] == records["healthy"].attrs["solver_signal_rate"] == 25600.0
    assert signal.attrs["units"] == "m/s^2"
    with pytest.raises(SignalError, match="there is no 'up'"):
        record_signal(records["healthy"], "up")
    with pytest.raises(SignalError, match=says("record", "case")):
        record_signal(records["healthy"].drop_attrs())


@pytest.mark.slow
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
