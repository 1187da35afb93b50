"""Records to an accuracy: what is asked for, what is told, and whether it is true."""

import warnings

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.studies import Case, CaseError, CaseWarning, run_case, run_cases, sweep
from gearmbs.studies.run.accuracy import SHARE, Recorded, accurate_record, asked_accuracy
from gearmbs.studies.run.periodic import Found
from gearmbs.studies.run.refined import ATTEMPTS
from gearmbs.studies.run.simulation import case_mechanism
from gearmbs.view import gmf_bars
from tests import generators
from tests.says import says
from tests.studies.test_auto import random_case


@pytest.mark.parametrize(("given", "part"), [("1 %", 0.01), (0.02, 0.02), ("0.1 %", 1e-3), ("0.005", 5e-3)])
def test_accuracies_that_can_be_asked_for(given, part):
    assert asked_accuracy(given) == pytest.approx(part)


@pytest.mark.parametrize("given", ["1 mm", "little", 0.0, -0.01, 2.0, "1e-5", float("nan"), None, [0.01]])
def test_accuracies_that_cannot_be_asked_for(given):
    with pytest.raises(CaseError, match=says("accuracy", "1 %")):
        asked_accuracy(given)


class Runs:
    """Levels with a known error in place of a simulation: a tolerance to a power, and slices to the power -2."""

    def __init__(self, power=0.8, steps=1e-3, slices=0.0, least=0.0, status=None):
        self.power, self.steps, self.slices, self.least, self.status = power, steps, slices, least, status
        self.cases, self.precisions = [], []

    def __call__(self, case, variables, precision=None):
        self.cases.append(case)
        self.precisions.append(precision)
        self.error = self.steps * (case.tolerance / 1e-7) ** self.power + self.slices / case.pair().face_slices ** 2
        if self.least:
            # of a motion that does not repeat itself each run is another sample
            self.error = self.least * len(self.cases)
        shape = (2, 3, 2)
        levels = np.broadcast_to([[10.0, 1.0], [4.0, 0.5], [2.0, 0.1]], shape) + self.error * np.array([10.0, 1.0])
        record = xr.Dataset(
            {
                "gmf_rms": (
                    ("way", "harmonic", "component"), levels, {"units": "m/s^2", "long_name": "RMS of harmonics"}
                ),
                "transmission_error": ("time", np.full(5, 1e-6 * (1.0 + self.error))),
            },
            coords={"way": ["band", "orders"], "harmonic": [1, 2, 3], "component": ["a", "b"]},
        )  # fmt: skip
        if self.status is not None:
            record.attrs |= {"record_status": self.status, "record_deviation": 2e-4}
        return Recorded(record, None if self.status is None else Found(8, 8))


def told(runs, accuracy, case=None, **options):
    options = {"variables": None, **options}
    return accurate_record(runs, Case() if case is None else case, accuracy, **options)


@pytest.mark.parametrize("power", [0.6, 1.0])
def test_the_error_of_the_steps_is_covered_and_not_much_too_large(power):
    runs = Runs(power)
    record = told(runs, "1 %")
    assert [c.tolerance for c in runs.cases] == pytest.approx([1e-7, 1e-6])
    true = 1e-3 * np.array([10.0, 1.0])
    stated = record["gmf_rms_error"].values
    assert stated.shape == (2, 3, 2)
    assert np.all(stated >= true)
    assert np.all(stated <= 5.0 * true)
    assert record.attrs["accuracy_found"] == pytest.approx(stated[0, 0, 0] / (10.0 * (1.0 + 1e-3)))
    assert 1e-9 <= record["transmission_error"].attrs["error_of_mean"] <= 5e-9


def test_the_error_of_the_slices_is_covered():
    runs = Runs(steps=0.0, slices=0.1)
    record = told(runs, "1 %", Case(fault={"misalignment": "1 deg"}))
    assert [c.pair().face_slices for c in runs.cases] == [11, 5]
    true = 0.1 / 11**2 * 10.0
    assert true <= float(record["gmf_rms_error"][0, 0, 0]) <= 3.0 * true
    assert "11 slices" in record.attrs["accuracy_by"]


@pytest.mark.parametrize("count", [3, 4, 5, 8])
def test_the_error_of_slices_that_a_case_gives_stays_in_every_attempt(count):
    """Of finer tolerances, which a case's own number of slices makes no better."""
    runs = Runs(steps=1e-3, slices=0.1)
    case = Case(fault={"misalignment": "1 deg"}, contact={"slices": count})
    with pytest.warns(CaseWarning, match=says("asked for", "0.2 %")):
        record = told(runs, "0.2 %", case)
    counts = [c.pair().face_slices for c in runs.cases]
    assert counts == [count, max(2, count // 2)] * ATTEMPTS
    true = 0.1 / count**2 * 10.0
    assert true <= float(record["gmf_rms_error"][0, 0, 0]) <= 6.0 * true


def test_runs_become_finer_until_the_accuracy_is_reached():
    runs = Runs(steps=5e-3)
    case = Case(fault={"misalignment": "1 deg"})
    record = told(runs, "0.5 %", case)
    assert len(runs.cases) == 3
    # the first of the runs is the twin of the last
    assert runs.cases[2].tolerance <= 0.1 * runs.cases[0].tolerance
    assert runs.cases[2].pair().face_slices == 2 * runs.cases[0].pair().face_slices - 1
    assert record.attrs["accuracy_found"] <= 5e-3
    assert float(record["gmf_rms_error"][0, 0, 0]) >= 10.0 * runs.error
    # the record is that of the case that was asked for
    assert record.attrs["case_json"] == case.model_dump_json()


def test_slices_that_a_case_gives_stay():
    runs = Runs(steps=5e-3)
    told(runs, "0.5 %", Case(fault={"misalignment": "1 deg"}, contact={"slices": 7}))
    assert [c.pair().face_slices for c in runs.cases] == [7, 3, 7, 3]


def test_flanks_that_come_apart_are_told():
    runs = Runs()

    def apart(*args):
        made = runs(*args)
        made.record.attrs["record_apart"] = 0.02
        return made

    with pytest.warns(CaseWarning, match=says("2 %", "apart")):
        record = told(apart, "1 %")
    assert "other motions may exist" in record.attrs["accuracy_by"]


@pytest.mark.slow
def test_separations_behind_the_run_up_are_seen_with_a_given_duration():
    """Two motions exist at this speed; the record itself shows no separation."""
    case = Case(
        operation={"torque": 48.24, "speed": "2190.8 rpm", "duration": 0.06}, contact={"damping": "5.08 N s/mm"}
    )
    with pytest.warns(CaseWarning, match=says("apart", "duration")):
        record = run_case(case, accuracy="1 %", variables=["gmf_rms"])
    assert record.attrs["record_apart"] > 0.0
    quiet = run_case(case.changed(operation={"speed": "1000 rpm"}), accuracy="1 %", variables=["gmf_rms"])
    assert quiet.attrs["record_apart"] == 0.0


def test_what_is_not_reached_is_told():
    runs = Runs(least=0.02, status="at the limit")
    with pytest.warns(CaseWarning, match=says("1 %", "duration")):
        record = told(runs, "1 %", Case(operation={"duration": "auto"}))
    assert len(runs.cases) == ATTEMPTS + 1
    # the whole difference of two samples
    assert float(record["gmf_rms_error"][0, 0, 0]) == pytest.approx(0.2)


def test_the_twin_is_of_the_same_stretch_and_the_deviation_counts():
    runs = Runs(status="periodic")
    record = told(runs, "1 %", Case(operation={"duration": "auto"}))
    assert runs.precisions[1].like == Found(8, 8)
    # at a tenth of the tolerance
    apart = float(10.0 * 1e-3 * (1.0 - 10**-0.8))
    expected = np.hypot(SHARE * apart, 0.5 * 2e-4 * record["gmf_rms"].values[0, 0, 0])
    assert float(record["gmf_rms_error"][0, 0, 0]) == pytest.approx(expected, rel=1e-9)


def test_only_what_is_asked_for_is_kept():
    record = told(Runs(), "1 %", variables=["transmission_error"])
    assert set(record.data_vars) == {"transmission_error"}
    assert set(record.sizes) == {"time"}
    assert not {"harmonic", "component", "way"} & {*record.coords}
    assert record.attrs["accuracy_asked"] == 0.01


def test_a_tolerance_of_ones_own_and_slices_of_ones_own_mechanism_are_refused():
    with pytest.raises(CaseError, match=says("solver.tolerance", "1e-08", "leave one")):
        told(Runs(), "1 %", Case(solver={"tolerance": 1e-8}))
    for few in (1, 2):
        with warnings.catch_warnings():
            # that one slice sees the middle of the face only
            warnings.simplefilter("ignore")
            tilted = Case(fault={"misalignment": "1 deg"}, contact={"slices": few})
            with pytest.raises(CaseError, match=says(f"slices = {few}", "3", "leave slices out")):
                told(Runs(), "1 %", tilted)
        # of flanks that are alike all along the face one is as good as many
        assert "accuracy_found" in told(Runs(), "1 %", Case(contact={"slices": few})).attrs
    tilted = case_mechanism(Case(fault={"misalignment": "1 deg"}))
    with pytest.raises(CaseError, match=says("11 slices", "leave accuracy out")):
        told(Runs(), "1 %", mechanism=tilted)
    assert "accuracy_found" in told(Runs(), "1 %", mechanism=case_mechanism(Case())).attrs


def test_refusals_come_before_anything_is_simulated_and_are_kept_where_asked(monkeypatch):
    simulated = []
    monkeypatch.setattr("gearmbs.studies.run.parallel.run_case", lambda case, *a, **k: simulated.append(case) or "done")
    cases = [Case(name="a"), Case(name="b", solver={"tolerance": 1e-8})]
    with pytest.raises(CaseError, match=says("b", "solver.tolerance")):
        run_cases(cases, accuracy="1 %", progress=False, workers=1)
    assert not simulated
    kept = run_cases(cases, accuracy="1 %", progress=False, workers=1, errors="keep")
    assert kept[0] == "done"
    assert isinstance(kept[1], CaseError)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(1, 1 + generators.cases(4)))
def test_levels_are_within_what_is_told(number):
    """Against a hundredth of the tolerance and four times the slices; a single level may be half as far off again."""
    case = random_case(number)
    if number % 2:
        case = case.changed(operation={"duration": 0.2})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaseWarning)
        record = run_case(case, accuracy="1 %", variables=["gmf_rms"])
    slices = case.pair().face_slices
    finer = {"slices": 4 * slices - 3} if slices > 1 else {}
    exact = run_case(
        case.changed(solver={"tolerance": 0.01 * case.tolerance, "lump": case.lump}, contact=finer),
        variables=["gmf_rms"],
    )
    if "at the limit" in (record.attrs.get("record_status"), exact.attrs.get("record_status")):
        return
    off = np.abs(record["gmf_rms"] - exact["gmf_rms"]).sel(way="orders").values
    stated = record["gmf_rms_error"].sel(way="orders").values
    assert np.mean(off <= stated) >= 0.75
    assert np.all(off <= 3.0 * stated)


@pytest.mark.slow
def test_the_two_lengths_of_a_record_agree_within_their_errors():
    """Healthy wheels over one second and over as long as they need, to 0.2 %: two ways to one motion."""
    records = [
        run_case(Case(operation={"duration": d}), accuracy="0.2 %", variables=["gmf_rms"]) for d in (0.4, "auto")
    ]
    one, other = (r["gmf_rms"].sel(way="orders") for r in records)
    errors = sum(r["gmf_rms_error"].sel(way="orders") for r in records)
    assert (np.abs(one - other) <= 2.0 * errors).all()
    assert all(r.attrs["accuracy_found"] <= 2e-3 for r in records)


@pytest.mark.slow
def test_a_sweep_tells_its_errors_and_takes_up_records_to_the_same_accuracy(tmp_path):
    case, values = Case(solver={"output_rate": 51200}), ["20 N m", "100 N m"]
    study = sweep(case, "operation.torque", values, folder=tmp_path, accuracy="1 %", progress=False)
    table = study.table()
    assert (table["1 x GMF +/-"] > 0.0).all()
    assert (table["1 x GMF +/-"] <= 0.01 * table["1 x GMF"].max()).all()
    again = run_cases(study.cases, folder=tmp_path, accuracy=0.01, progress=False)
    assert again[0].attrs["solver_wall_time"] == study.records[0].attrs["solver_wall_time"]
    other = run_cases(study.cases[:1], folder=tmp_path, progress=False)
    assert "accuracy_asked" not in other[0].attrs
    assert study.plot().axes[0].containers


@pytest.mark.slow
def test_the_command_prints_errors_and_knows_what_it_is_for(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text('[operation]\nduration = "0.1 s"\n')
    done = CliRunner().invoke(app, ["run", str(file), "--accuracy", "1 %"])
    assert done.exit_code == 0, done.output
    assert "+/- numerically" in done.output
    assert "mesh harmonics are known to" in done.output
    file.write_text(
        'name = "short"\n[solver]\nlump = true\n[fault]\nbacklash = "0.1 mm"\n[contact]\ndepth = "0.1 mm"\n'
    )
    done = CliRunner().invoke(app, ["run", str(file), "--accuracy", "5 %"])
    assert done.exit_code == 0, done.output
    train = tmp_path / "set.toml"
    train.write_text("[planetary]\n")
    done = CliRunner().invoke(app, ["run", str(train), "--accuracy", "1 %"])
    assert done.exit_code == 1
    assert "planetary.teeth" in done.output


def test_bars_have_errors_of_their_own_shape():
    table = xr.DataArray([[1.0, 2.0, 3.0]], dims=("state", "harmonic"), coords={"state": ["a"], "harmonic": [1, 2, 3]})
    figure = gmf_bars(table, errors=0.1 * table)
    assert sum(len(c.get_children()) > 1 for c in figure.axes[0].containers) >= 2
    assert len(gmf_bars(table[0].drop_vars("state"), errors=0.1 * table[0].drop_vars("state")).axes[0].containers) >= 2
    with pytest.raises(ValueError, match=says("errors", "(1, 2)", "(1, 3)")):
        gmf_bars(table, errors=table.isel(harmonic=[0, 1]))
