"""Run-ups and coast-downs: speed and torque as curves, and what the record of one holds."""

import numpy as np
import pytest
from typer.testing import CliRunner

from gearmbs import cli
from gearmbs.mechanism import polyline
from gearmbs.signals import angular_resample, order_spectrum
from gearmbs.studies import Case, CaseError, make_case, record_signal, run_case
from gearmbs.studies.case.limits import check_record
from tests.says import says

UP = [["0 s", "0 rpm"], ["0.6 s", "1800 rpm"]]


@pytest.fixture(scope="module")
def run_up():
    case = Case(name="up", operation={"speed": UP, "torque": "100 N m"}, friction={"enabled": False})
    return case, run_case(case)


@pytest.mark.slow
def test_the_record_begins_at_rest_and_follows_the_curve(run_up):
    case, record = run_up
    t = record.signal_time.values - 0.1
    speed = polyline([0.0, 0.6], [0.0, 60.0 * np.pi])
    np.testing.assert_allclose(record["speed"].values, [speed(at) for at in t], rtol=1e-9, atol=1e-6)
    # the line itself but for its first and last 4 %
    kept = (t > 0.024 + 1e-9) & (t < 0.576 - 1e-9)
    np.testing.assert_allclose(record["speed"].values[kept], 100.0 * np.pi * t[kept], rtol=1e-9, atol=1e-6)
    assert np.abs(record["speed"].values - 100.0 * np.pi * t).max() < 0.006 * 60.0 * np.pi
    # it covers half of what its end speed would
    assert float(record["angle"][-1]) == pytest.approx(0.5 * 0.6 * 60.0 * np.pi, rel=1e-3)
    assert record.attrs["operation_speed"] == pytest.approx(60.0 * np.pi)
    assert "gmf_rms" not in record
    # the run-up to zero and the settling turn nothing
    assert record.attrs["solver_mesh_cycles"] == pytest.approx(29 * case.angle_turned / (2 * np.pi), rel=0.04)
    share = record.attrs["solver_wall_time"] / record.attrs["solver_mesh_cycles"]
    assert record.attrs["solver_time_per_mesh_cycle"] == pytest.approx(share)
    assert case.operation.duration == 0.6


def test_the_mesh_carries_the_load_and_accelerates_the_driven_side(run_up):
    """Mean normal force times base radius is torque plus inertia times the driven side's acceleration."""
    case, record = run_up
    pair = case.pair()
    shaft = case.shafts
    mass = shaft.density * np.pi * shaft.radius**2 * shaft.length
    inertia = pair.wheels[1].inertia[2] + 0.5 * mass * shaft.radius**2
    speed = polyline([0.0, 0.6], [0.0, 60.0 * np.pi])
    force, t = record["normal_force"].values, record.time.values - 0.1
    for middle in (0.2, 0.3, 0.45):
        near = np.abs(t - middle) < 0.05
        wanted = 100.0 + inertia * np.mean([speed.derivatives(at)[1] for at in t[near]])
        assert force[near].mean() * pair.wheels[1].base_radius == pytest.approx(wanted, rel=2e-3)


def test_order_lines_stay_where_they_are(run_up):
    """The mesh lines of the faster half, piece by piece, lie at multiples of the teeth to a hundredth."""
    _, record = run_up
    signal = record_signal(record, "line_of_action")
    assert "speed" not in signal.attrs
    turning = signal["speed"].values > 60.0
    part = signal.isel(time=turning)
    angular = angular_resample(part, part["angle"].reset_coords(drop=True))
    per_rev = int(angular.attrs["samples_per_rev"])
    pieces = range(0, angular.sizes["angle"] - 4 * per_rev, 2 * per_rev)
    assert len(pieces) >= 3
    for start in pieces:
        lines = order_spectrum(angular.isel(angle=slice(start, start + 4 * per_rev)))[:, 0]
        near = lines.sel(order=slice(20.0, 38.0))
        assert float(near.order[int(np.argmax(near.values))]) == pytest.approx(29.0, rel=0.01)


def test_the_record_follows_the_mesh_orders(run_up):
    """Levels over speed as those of runs at constant speeds near by, whose mesh harmonics are known otherwise."""
    case, record = run_up
    levels = record["order_rms"].sel(component="line_of_action")
    assert levels.dims == ("track_time", "harmonic")
    assert np.all(np.diff(record["track_speed"].values) > 0.0)
    k = int(np.argmin(np.abs(record["track_speed"].values - 50.0 * np.pi)))
    speed = float(record["track_speed"][k])
    steady = run_case(case.changed(operation={"speed": speed, "duration": 0.1, "run_up": 0.05}))
    wanted = steady["gmf_rms"].sel(component="line_of_action", way="orders").values
    # the torque that accelerates the driven side loads the mesh besides
    np.testing.assert_allclose(levels.values[k], wanted, rtol=0.25)


@pytest.mark.slow
def test_a_coast_down_and_a_torque_that_changes():
    case = Case(
        operation={
            "speed": [[0, "1200 rpm"], ["0.3 s", "600 rpm"]],
            "torque": [[0, "100 N m"], ["0.3 s", "20 N m"]],
            "run_up": "30 ms",
            "settling": "20 ms",
        }
    )
    record = run_case(case)
    force = record["normal_force"].values
    radius = case.pair().wheels[1].base_radius
    assert float(record["speed"][0]) == pytest.approx(40.0 * np.pi, rel=1e-4)
    assert float(record["speed"][-1]) == pytest.approx(20.0 * np.pi, rel=1e-3)
    count = force.size // 10
    # means of the line from 100 to 20 N m over its first and last tenth
    assert force[:count].mean() * radius == pytest.approx(96.0, rel=0.05)
    assert force[-count:].mean() * radius == pytest.approx(24.0, rel=0.1)


def test_a_run_up_of_hardly_a_turn_is_refused():
    case = make_case({"operation": {"speed": [[0, 0.0], ["50 ms", "500 rpm"]]}})
    with pytest.raises(CaseError, match=says("operation.speed", "0.208", "give a longer curve")):
        check_record(case)


@pytest.mark.slow
def test_from_a_file_on_the_command_line(tmp_path):
    path = tmp_path / "up.toml"
    path.write_text('[operation]\nspeed = [["0 s", "0 rpm"], ["0.4 s", "1800 rpm"]]\nrun_up = "30 ms"\n')
    result = CliRunner().invoke(cli.app, ["run", str(path)])
    assert result.exit_code == 0, result.output
    assert "to 1800 rpm" in result.output
    assert "1 x GMF   at rpm" in result.output
