"""One setting over many values: records that fit together, taken up again, with tables and figures."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from gearmbs.studies import Case, CaseError, SimulationFailed, load_case, sweep
from gearmbs.studies.case.texts import case_toml
from gearmbs.studies.run import recorder, simulation
from tests.says import says
from tests.view.looking import assert_readable

SHORT = {"run_up": "20 ms", "settling": 0.0, "duration": "70 ms"}
SPEEDS = ["900 rpm", "1800 rpm", "2700 rpm"]


@pytest.fixture(scope="module")
def speeds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("speeds")
    return folder, sweep(Case(name="pair", operation=SHORT), "operation.speed", SPEEDS, folder=folder)


@pytest.mark.slow
def test_records_of_all_values_fit_together(speeds):
    """One rate for all, that of the fastest; a row of the table for each; names that tell."""
    _, study = speeds
    assert study.unit == "rpm"
    np.testing.assert_allclose(study.values, [900.0, 1800.0, 2700.0])
    assert [case.name for case in study.cases] == [f"pair, speed {speed}" for speed in SPEEDS]
    assert {record.attrs["solver_signal_rate"] for record in study.records} == {25600.0}
    table = study.table()
    assert table.index.name == "speed, rpm"
    np.testing.assert_allclose(table["mesh frequency, Hz"], [435.0, 870.0, 1305.0])
    levels = [float(r.gmf_rms.sel(component="line_of_action", way="band", harmonic=1)) for r in study.records]
    np.testing.assert_allclose(table["1 x GMF"], levels)
    assert [s.attrs["speed"] for s in study.signals()] == pytest.approx([30 * np.pi, 60 * np.pi, 90 * np.pi])


@pytest.mark.slow
def test_it_is_taken_up_where_it_stopped(speeds, monkeypatch):
    folder, study = speeds
    monkeypatch.setattr(simulation, "simulate_case", None)
    again = sweep(Case(name="pair", operation=SHORT), "operation.speed", SPEEDS, folder=folder)
    assert again.table().drop(columns="ms a mesh cycle").equals(study.table().drop(columns="ms a mesh cycle"))


@pytest.mark.slow
def test_levels_of_all_rows_are_found_by_one_way(speeds):
    """A record that is too short for bands takes the others along, and the column says so."""
    study = speeds[1]
    assert list(study.table()["way"]) == ["band"] * 3
    assert list(study.table()["record"]) == ["given"] * 3
    first = study.records[0].copy(deep=True)
    first.gmf_rms.loc[{"way": "band"}] = np.nan
    mixed = replace(study, results=[first, *study.results[1:]])
    assert list(mixed.table()["way"]) == ["orders"] * 3
    levels = [float(r.gmf_rms.sel(component="line_of_action", way="orders", harmonic=1)) for r in study.records]
    np.testing.assert_allclose(mixed.table()["1 x GMF"], levels)


@pytest.mark.slow
def test_it_shows_and_saves_itself(speeds, tmp_path):
    _, study = speeds
    figure = study.plot()
    assert isinstance(figure, Figure)
    assert_readable(figure)
    assert "Sweep of operation.speed, pair" in study._repr_html_()
    assert repr(study) == "Sweep('pair', operation.speed: 3 of 3 records)"
    names = sorted(path.name for path in study.save(tmp_path))
    assert names[:2] == ["figure.png", "figure.svg"]
    assert "table.csv" in names
    assert len(names) == 6


def test_errors_are_kept_in_their_places(monkeypatch):
    monkeypatch.setattr(
        recorder, "slip", lambda pair, *a: "the wheels slipped" if pair.operating_point.torque > 90.0 else None
    )
    study = sweep(Case(operation=SHORT), "operation.torque", [50.0, "100 N m"], errors="keep")
    assert list(study.failures) == ["case, torque 100 N m"]
    assert isinstance(study.results[1], SimulationFailed)
    np.testing.assert_allclose(study.values, [50.0])
    assert "slipped" in study._repr_html_()


@pytest.mark.parametrize(
    ("field", "values", "words"),
    [
        ("operation.sped", ["1 rpm"], says("'operation.sped'", "case", "operation.speed")),
        ("speed", ["1 rpm"], "did you mean operation.speed"),
        ("operation.speed", ["1000 rpm", "5 mm"], "value 2 of operation.speed: operation.speed = '5 mm'"),
        ("operation.speed", "1000 rpm", "give a sequence of values"),
        ("operation.speed", [], "give a sequence of values"),
    ],
)
def test_wrong_sweeps(field, values, words):
    with pytest.raises(CaseError, match=words):
        sweep(Case(), field, values)


@pytest.mark.parametrize(
    "case",
    [
        Case(),
        Case(name='with "quotes"', operation={"speed": "1500 rpm", "torque": 80.0}, friction={"enabled": False}),
        Case(gears={"teeth": 21, "module": "2 mm", "face_width": ["22 mm", 0.02]}, solver={"lump": True}),
        Case(operation={"speed": [["0 s", "0 rpm"], [2.0, "3000 rpm"]]}, contact={"depth": "50 um"}),
        Case(fault={"misalignment": "1 deg", "teeth": [{"kind": "wear", "teeth": [1, 2]}, "root crack"]}),
    ],
    ids=["default", "units", "wheels", "run-up", "faults"],
)
def test_case_files_make_the_same_case_again(case, tmp_path):
    path = case.save(tmp_path / "case.toml")
    assert load_case(path) == case
    for section in ("operation", "gears", "fault"):
        for text in getattr(case, section).written.values():
            assert str(text).replace("'", '"') in case_toml(case) or isinstance(text, (list, tuple))
