"""The benchmark runner on small parts: measured once, saved, found again, reported; missing peers named."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import precision, runner, size
from benchmarks.methods import base, exudyn_peer
from benchmarks.problems.reference import reference_problems

SOME = "slider crank - WSTIFF SI2"


@pytest.fixture
def no_peers(monkeypatch):
    """Let no peer be installed."""
    monkeypatch.setattr(base, "version_of", lambda package: None)


def run(out, parts, **options):
    lines = []
    settings = {"quick": True, "fresh": False, "only": ""} | options
    return runner.run(parts, out, report=lines.append, **settings), lines


def test_settings_of_other_programs_are_set_by_their_names():
    newton = SimpleNamespace(modified=False)
    solver = SimpleNamespace(steps=1, newton=newton)
    base.assign(solver, {"steps": 7, "newton.modified": True})
    assert (solver.steps, newton.modified) == (7, True)


@pytest.mark.slow
def test_a_part_is_measured_saved_and_found_again(tmp_path):
    first, lines = run(tmp_path, ["precision"], only=SOME)
    assert lines == [f"precision - {SOME}"]
    rows = first["parts"]["precision"]["results"][0]["rows"]
    errors = [row["error"] for row in rows]
    # four tolerances, one and a half decades apart
    assert len(errors) == precision.QUICK_KNOBS
    assert errors[-1] < 1e-3 * errors[0]
    assert all(row["cpu"] > 0 and row["steps"] > 20 for row in rows)

    stored = json.loads((tmp_path / "results.json").read_text())
    assert stored["machine"]["processor"]
    assert {"numpy", "numba", "scikit-sundae", "exudyn"} <= set(stored["machine"]["packages"])
    assert stored["machine"]["threads"].keys() >= {"OMP_NUM_THREADS"}
    text = (tmp_path / "results.md").read_text()
    assert "| WSTIFF |" in text
    assert "precision.png" in text
    assert {p.name for p in tmp_path.iterdir()} >= {"precision.png", "precision.svg", "parts"}

    second, lines = run(tmp_path, ["precision"], only=SOME)
    assert lines == [f"precision - {SOME}: saved earlier"]
    assert second["parts"]["precision"]["results"] == json.loads(json.dumps(first["parts"]["precision"]["results"]))
    _, lines = run(tmp_path, ["precision"], only=SOME, fresh=True)
    assert lines == [f"precision - {SOME}"]


@pytest.mark.slow
def test_a_half_written_part_is_measured_again(tmp_path):
    run(tmp_path, ["precision"], only=SOME)
    part = next((tmp_path / "parts").iterdir())
    part.write_text(part.read_text()[:50])
    _, lines = run(tmp_path, ["precision"], only=SOME)
    assert lines == [f"precision - {SOME}"]


@pytest.mark.slow
@pytest.mark.usefixtures("no_peers")
def test_missing_peers_are_named(tmp_path):
    outcome, _ = run(tmp_path, ["precision"], only="slider crank - ")
    part = outcome["parts"]["precision"]
    families = {row["family"] for row in part["summary"]}
    assert families == {"WSTIFF"}
    text = (tmp_path / "results.md").read_text()
    for method, package in (
        ("solve_dae Radau SI2", "solve-dae"),
        ("Assimulo IDA SI1", "assimulo-testing"),
        ("Exudyn generalized alpha", "exudyn"),
        ("IDA SI1", "scikit-sundae"),
    ):
        assert f"{method}: {package} is not installed (slider crank)" in text


@pytest.mark.slow
def test_ida_reaches_the_reference(tmp_path):
    outcome, _ = run(tmp_path, ["precision"], only="slider crank - IDA SI1")
    rows = outcome["parts"]["precision"]["results"][0]["rows"]
    assert min(row["error"] for row in rows) < 1e-5


@pytest.mark.slow
def test_size_part_fits_an_exponent(tmp_path, monkeypatch):
    monkeypatch.setattr(size, "SPAN", 1.0)
    monkeypatch.setattr(size, "GRID_TOLERANCES", (1e-4,))
    monkeypatch.setattr(size, "QUICK_SIZES", (2, 4))
    outcome, _ = run(tmp_path, ["size"])
    part = outcome["parts"]["size"]
    assert part["exponents"]["WSTIFF"] is not None
    # two chains, three formulations, two correctors
    assert part["singular_runs"] == 12
    assert part["singular_failures"] == []
    text = (tmp_path / "results.md").read_text()
    assert "Exponent of time per step" in text


@pytest.mark.slow
def test_contact_part(tmp_path):
    outcome, _ = run(tmp_path, ["contact"], only="healthy, no friction")
    assert outcome["parts"]["contact"]["results"][0]["jacobian_us"] > 0


@pytest.mark.slow
def test_whole_residual_at_many_slices(tmp_path):
    outcome, _ = run(tmp_path, ["contact"], only="whole residual, healthy")
    (row,) = outcome["parts"]["contact"]["results"]
    assert row["unknowns"] > 100
    assert 0 < row["value_us"] < row["jacobian_us"]
    assert "whole residual of the study's model" in (tmp_path / "results.md").read_text()


@pytest.mark.slow
def test_unknown_parts_and_the_command_line(tmp_path, capsys):
    with pytest.raises(SystemExit):
        runner.main(["gears"])
    assert "gears" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        runner.main(["precision", "size", "--quick", "--out", str(tmp_path), "--only", "no such piece"])
    assert "no piece of precision, size has 'no such piece' in its name" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
    runner.main(["precision", "--quick", "--out", str(tmp_path), "--only", SOME])
    assert "Reference: one-degree-of-freedom" in capsys.readouterr().out


def test_time_at_an_error_is_interpolated_on_the_front():
    rows = [{"cpu": 1.0, "error": 1e-2}, {"cpu": 4.0, "error": 1e-6}, {"cpu": 2.0, "error": 1e-1}, {"failed": "no"}]
    assert precision.front(rows) == [(1.0, 1e-2), (4.0, 1e-6)]
    # half way between on logarithmic scales: sqrt(1 * 4)
    assert precision.time_at(rows, 1e-4) == pytest.approx(2.0)
    assert precision.time_at(rows, 1e-1) == 1.0
    assert precision.time_at(rows, 1e-9) is None


def test_ratios_and_what_falls_short():
    def entry(method, family, cpu):
        return {
            "problem": "p", "source": "s", "method": method, "family": family,
            "rows": [{"cpu": cpu, "error": 1e-7}],
        }  # fmt: skip

    extra = precision.finish([entry("WSTIFF SI2", "WSTIFF", 1.0), entry("X", "X", 2.0), entry("Y", "Y", 5.0)])
    by_family = {row["family"]: row["1e-06"]["ratio"] for row in extra["summary"]}
    assert by_family == {"WSTIFF": 1.0, "X": 2.0, "Y": 5.0}
    assert precision.short_of(extra, 1.0) == []
    assert precision.short_of(extra, 3.0) == ["p at 0.0001: X 2", "p at 1e-06: X 2"]


def test_exponent_of_a_power_law():
    rows = [{"links": n, "us_per_step": 3.0 * n**1.1} for n in (10, 20, 80)]
    assert size.exponent(rows) == pytest.approx(1.1)


def test_problems_a_method_cannot_do_are_named():
    with pytest.raises(base.NotPossible, match="moving base"):
        exudyn_peer.model_of(reference_problems()["car axis"])


def test_callbacks_agree_with_the_compiled_functions():
    """The Newton matrix handed to peers is dG/dy + cj dG/dy', linear in cj."""
    problem = reference_problems()["slider crank"].make("SI1")
    calls = base.Callbacks(problem)
    y, yp = problem.y0 + 0.01, problem.yp0 + 0.02
    y.setflags(write=False)
    matrices = [calls.dense(0.1, y, yp, cj) for cj in (0.0, 1.0, 5.0)]
    np.testing.assert_allclose(matrices[2], matrices[0] + 5.0 * (matrices[1] - matrices[0]), atol=1e-12)
    d = 1e-6
    for j in range(problem.n):
        step = np.zeros(problem.n)
        step[j] = d
        slope = (calls.residual(0.1, y + step, yp) - calls.residual(0.1, y - step, yp)) / (2 * d)
        np.testing.assert_allclose(matrices[0][:, j], slope, atol=1e-6)
