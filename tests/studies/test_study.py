"""The study's parts that need no long simulation, and its core on short records."""

import re

import numpy as np
import pytest
import xarray as xr
from scipy.signal.windows import blackmanharris
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.files import whole_file
from gearmbs.signals.files.simulated import model_signals, parse_states
from gearmbs.studies import Case, SimulationFailed, run_case, run_paper, simulate_case
from gearmbs.studies.case.case import CaseError, make_case
from gearmbs.studies.presets.paper import choices
from gearmbs.studies.presets.paper_cases import judge, paper_cases
from gearmbs.studies.run import rig as parts
from gearmbs.studies.run.simulation import case_mechanism
from gearmbs.studies.run.store import write_dataset
from tests.says import says

SHORT = {"run_up": 0.03, "settling": 0.01, "duration": 0.06}


@pytest.fixture(scope="module")
def short_study():
    return run_paper(Case(operation=SHORT), workers=2)


def test_judgement_of_the_claims():
    table = xr.DataArray(
        np.ones((2, 3, 3)),
        dims=("load", "state", "harmonic"),
        coords={"load": ["low", "high"], "state": ["healthy", "misaligned", "distance"], "harmonic": [1, 2, 3]},
    )
    assert [c.held for c in judge(table, "x")] == [False, False, False]
    rising = table.copy()
    rising.loc[{"state": "misaligned", "harmonic": 2}] = 3.0
    rising.loc[{"state": "distance"}] = 2.0
    rising.loc[{"load": "high"}] *= 2.0
    assert [c.held for c in judge(rising, "x")] == [True, True, True]
    rising.loc[{"load": "high", "state": "distance", "harmonic": 3}] = 0.5
    assert [c.held for c in judge(rising, "x")] == [True, False, False]


def test_much_smaller_is_more_than_smaller():
    """1.4 times at high load is larger, not much larger."""
    table = xr.DataArray(
        np.ones((2, 3, 3)),
        dims=("load", "state", "harmonic"),
        coords={"load": ["low", "high"], "state": ["healthy", "misaligned", "distance"], "harmonic": [1, 2, 3]},
    )
    table.loc[{"load": "high"}] = 1.4
    claim = judge(table, "x")[2]
    assert not claim.held
    assert "9 of 9 amplitudes are smaller at low load, 0 by 1.5 times or more" in claim.numbers


def test_report_states_the_choices_made():
    base = make_case(
        {"contact": {"depth": "0.02 mm"}, "friction": {"enabled": False}, "fault": {"plane": "inclination"}}
    )
    rows = {c.what: c for c in choices(paper_cases(base=base), "tangential")}
    assert rows["penetration d of full damping"].chosen == "0.02 mm"
    assert rows["friction"].chosen == "none"
    assert rows["misalignment"].chosen == "1 degree, inclination"
    assert rows["which force"].chosen == "tangential"
    changed = {c.what for c in rows.values() if c.changed}
    assert changed == {"penetration d of full damping", "friction", "misalignment", "which force"}
    assert not any(c.changed for c in choices(paper_cases(), "line_of_action"))


def test_wheels_pushed_into_each_other_are_refused():
    """-0.5 mm closes 2 x 0.5 sin(20 deg) = 0.342 mm of backlash, less the second-order 0.007 mm."""
    with pytest.raises(CaseError, match=r"centre_distance_error = -0.5 mm .* overlap by 0.2346 mm"):
        Case().changed(fault={"centre_distance_error": "-0.5 mm"})


def test_files_appear_whole_or_not_at_all(tmp_path):
    target = tmp_path / "a" / "result.txt"

    def interrupted():
        with whole_file(target) as part:
            part.write_text("half")
            raise RuntimeError("interrupted by the test")

    with pytest.raises(RuntimeError, match="interrupted by the test"):
        interrupted()
    assert list(tmp_path.rglob("*.*")) == []
    with whole_file(target) as part:
        part.write_text("whole")
    assert target.read_text() == "whole"
    assert [p.name for p in target.parent.iterdir()] == ["result.txt"]


@pytest.mark.slow
def test_study_on_short_records(short_study, tmp_path):
    """The whole chain of `gearmbs paper` on 60 ms a case: 29 mesh periods."""
    paths = short_study.save(tmp_path)
    assert {p.name for p in paths} == {
        "paper.nc",
        "gmf_rms.csv",
        "figure_5.png",
        "figure_5.svg",
        "figure_7.png",
        "figure_7.svg",
        "report.md",
    }
    assert all(p.stat().st_size > 1000 for p in paths)
    assert not [p for p in tmp_path.rglob(".*")]
    records = xr.open_dataset(tmp_path / "paper.nc", engine="h5netcdf")
    assert records["force_2"].dims == ("load", "state", "time", "xyz")
    assert records["force_2"].attrs["units"] == "N"
    assert records.attrs["operation_speed"] == pytest.approx(104.71975512)
    assert "numba_version" in records.attrs
    # scaled: RMS of the default component, healthy at low load, is 1 m/s^2
    scaled = records["acceleration_scaled"].sel(load="low", state="healthy", component=short_study.component)
    assert float(scaled.std()) == pytest.approx(1.0, rel=1e-9)
    text = (tmp_path / "report.md").read_text()
    for claim in short_study.claims():
        assert claim.name in text
    assert "what the paper leaves open" in text
    assert re.search(r"\| low \| healthy \| 24\d\d(\.\d+)? \| 2394\.9 \| 0 \| 0 \|", text), text
    rows = (tmp_path / "gmf_rms.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * 3 * 4 * 2 * 3


@pytest.mark.slow
def test_misalignment_and_distance_raise_the_harmonics(short_study):
    """Line of action, low load: two-flank contact makes 2 x GMF dominate; +3 mm raises all three."""
    assert [c.held for c in short_study.claims("line_of_action")[:2]] == [True, True]
    table = short_study.table("line_of_action")
    tilted = table.sel(load="low", state="misaligned")
    assert int(np.argmax(tilted.values)) == 1


def test_mean_mesh_force_is_torque_over_base_radius(short_study):
    """Tangential balance of the driven wheel, friction's moment left out: F_y ~ T/r_w = 100/0.044435 = 2250.5 N."""
    healthy = short_study.records["force_2"].sel(load="low", state="healthy")
    assert float(abs(healthy.sel(xyz="y").mean())) == pytest.approx(100.0 / 0.0444354839, rel=0.01)


def test_action_equals_reaction(short_study):
    """Shaft forces on both gears balance: the centres do not accelerate and nothing else pulls."""
    total = short_study.records["force_1"] + short_study.records["force_2"]
    assert float(abs(total).max()) < 1e-6


@pytest.mark.slow
def test_exchange_with_measurements(short_study, tmp_path):
    path = tmp_path / "paper.nc"
    write_dataset(path, short_study.records)
    signals = model_signals(path, "resultant")
    assert list(signals) == ["low", "high"]
    assert signals["low"]["healthy"].attrs["teeth"] == (29, 29)
    assert list(parse_states(["low:healthy=a.csv", "low:broken=b.csv"])["low"]) == ["healthy", "broken"]
    with pytest.raises(ValueError, match="load:state=path"):
        parse_states(["healthy"])
    with pytest.raises(ValueError, match=says("component", "'sideways'", "choose", "resultant")):
        model_signals(path, "sideways")


@pytest.mark.slow
def test_only_lines_at_multiples_of_the_mesh_frequency():
    """Frictionless healthy pair: between the lines everything is 80 dB below the first.

    100 samples a mesh period exactly, so that a window of whole periods has no leakage and aliases fall on lines.
    """
    speed = 51200.0 / 100 * 2 * np.pi / 29
    case = Case(
        operation={"speed": speed, "run_up": 0.03, "settling": 0.03, "duration": 0.12},
        friction={"enabled": False},
        solver={"tolerance": 1e-9},
    )
    force = run_case(case)["force_2"].sel(xyz="x").values
    periods = force.size // 100
    spectrum = np.abs(np.fft.rfft(force[: periods * 100] - force.mean()))
    between = np.delete(spectrum, np.arange(0, spectrum.size, periods))
    assert between.max() < 1e-4 * spectrum[periods]


@pytest.mark.slow
@pytest.mark.parametrize("fault", [{}, {"centre_distance_error": "3 mm"}, {"misalignment": "1 deg"}])
def test_floor_between_the_lines_at_the_study_settings(fault):
    """1000 rpm, friction, a sampling rate that is no multiple of the mesh frequency: what lies between the lines below
    6.4 kHz is the integrator's tolerance; sharp edges of the contact folded back would lie at -22 to -52 dB.

    The largest line of a noise floor scatters from -71.7 to -76.7 dB where the tolerance changes by 3 %: the median of
    three near tolerances is taken.
    """
    case = Case(operation={"run_up": 0.05, "settling": 0.05, "duration": 0.25}, fault=fault)
    near = [case.solver.used_tolerance * part for part in (0.97, 1.0, 1.03)]
    floor = np.median([floor_between_the_lines(case.changed(solver={"tolerance": tol})) for tol in near], axis=0)
    assert floor[0] < -72.0
    assert floor[1] < -52.0


def floor_between_the_lines(case: Case) -> np.ndarray:
    """Return the largest of what lies between the lines below 6.4 kHz against the first, of x and y of a force, dB."""
    force = run_case(case)["force_2"].values[:, :2]
    spectrum = np.abs(
        np.fft.rfft((force - force.mean(axis=0)) * blackmanharris(len(force), sym=False)[:, None], axis=0)
    )
    frequency = np.fft.rfftfreq(len(force), 1.0 / case.output_rate)
    apart = np.abs(frequency - np.round(frequency / case.mesh_frequency) * case.mesh_frequency)
    width = 6.0 * frequency[1]
    between = spectrum[(apart > width) & (frequency > width) & (frequency < 6400.0)].max(axis=0)
    first = spectrum[np.abs(frequency - case.mesh_frequency) < width].max(axis=0)
    return 20.0 * np.log10(between / first)


def test_failure_keeps_what_was_computed(monkeypatch):
    """A torque that turns into NaN stops the run; the message tells when and what, the solution stays."""
    case = Case(operation=SHORT)
    mechanism = parts.gear_rig(case.pair(), speed=100.0, torque=50.0, run_up=0.02)
    mechanism.torque("poison", mechanism.bodies["shaft 2"], "SQRT(0.01 - TIME)")
    solution = mechanism.simulate(0.03, rate=20000, rate_scale=3000.0)
    assert not solution.success
    assert 0.005 < solution.t[-1] <= 0.0101
    assert "not finite" in solution.message or "NaN" in solution.message
    monkeypatch.setattr("gearmbs.studies.run.simulation.simulate_case", lambda *a, **k: solution)
    with pytest.raises(SimulationFailed) as caught:
        run_case(case)
    assert caught.value.solution is solution


@pytest.mark.slow
def test_command_run_and_its_errors(tmp_path):
    runner = CliRunner()
    path = tmp_path / "mine.toml"
    path.write_text("[operation]\nrun_up = '30 ms'\nsettling = '10 ms'\nduration = '80 ms'\n")
    result = runner.invoke(app, ["run", str(path)])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "mine.nc").exists()
    assert re.search(r"line_of_action\s+[\d.]+", result.output)
    path.write_text("[operation]\nspeed = 'fast'\n")
    result = runner.invoke(app, ["run", str(path)])
    assert result.exit_code == 1
    assert "operation.speed" in result.output


def test_command_paper_refuses_nonsense():
    result = CliRunner().invoke(app, ["paper", "--backlash", "-1 mm"])
    assert result.exit_code == 1
    assert "negative backlash" in result.output


@pytest.mark.slow
def test_start_one_tooth_later_and_other_output_rate_change_nothing():
    """GMF RMS within 0.5 %: run-up settling longer by one mesh period; output at 64 kHz instead of 51.2 kHz."""
    period = 1.0 / Case().mesh_frequency
    base = Case(operation={"run_up": 0.03, "settling": 0.02, "duration": 0.1})
    later = base.changed(operation={"settling": 0.02 + period})
    finer = base.changed(solver={"output_rate": 64000.0})
    tighter = base.changed(solver={"tolerance": 1e-8})
    reference = run_case(base)["gmf_rms"].sel(way="orders")
    for other in (later, finer, tighter):
        values = run_case(other)["gmf_rms"].sel(way="orders")
        np.testing.assert_allclose(values.values, reference.values, rtol=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("fault", [{}, {"misalignment": "1 deg"}, {"centre_distance_error": "3 mm"}])
def test_energy_balance(fault):
    """Work in less dissipation less stored, within 1e-6 of the work, once the powers are sampled finely enough."""
    case = Case(
        operation={"run_up": 0.05, "settling": 0.0, "duration": 0.1},
        solver={"tolerance": 1e-9, "output_rate": 204800.0},
        fault=fault,
    )
    balance = simulate_case(case).energy_balance()
    assert balance.attrs["relative_imbalance"] < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("fault", [{}, {"misalignment": "1 deg"}], ids=["healthy", "misaligned"])
def test_gear_and_shaft_as_one_body_make_the_same_record(fault):
    case = Case(operation=SHORT, fault=fault, solver={"tolerance": 1e-9})
    full, lump = run_case(case), run_case(case.changed(solver={"lump": True}))
    assert lump.attrs["solver_lump"] == 1
    plane = ["line_of_action", "line_of_centres", "tangential"]
    a, b = (record.gmf_rms.sel(component=plane).values for record in (lump, full))
    np.testing.assert_allclose(a, b, rtol=1e-3, atol=1e-3 * b.max())
    np.testing.assert_allclose(lump.force_2, full.force_2, atol=1e-3 * float(abs(full.force_2).max()))


def test_reactions_of_one_body_are_those_of_all():
    """At the same positions and velocities, to rounding: the whole system solved anew at some steps of a lumped run."""
    case = Case(fault={"misalignment": "1 deg"})
    solution = case_mechanism(case).simulate(0.03, rate=1000.0, tol=1e-7, rate_scale=3000.0, lump=True)
    assert solution.problem.n == 2
    for k in range(5, 30, 6):
        acceleration, multipliers, _ = solution.system.accelerations(solution._pose[k].copy(), float(solution.t[k]))
        np.testing.assert_allclose(solution.multipliers[k], multipliers, atol=1e-8 * np.abs(multipliers).max())
        np.testing.assert_allclose(solution._acc[k], acceleration, atol=1e-8 * np.abs(acceleration).max())
