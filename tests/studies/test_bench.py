"""The bench of Fig. 2: its description, the energy it turns over, its claims, its cost."""

import numpy as np
import pytest

from gearmbs.drivetrain import RunSettings
from gearmbs.studies import BenchSettings, bench_choices, bench_train
from gearmbs.studies.presets.bench import BenchStudy, levels, run_bench
from gearmbs.studies.run.rig import gear_rig
from tests.says import says
from tests.studies.presets import agrees_with_its_file


def test_loads_of_the_two_pressures():
    """One pump with an idle torque has both of the paper's loads; see the choice that says so."""
    for pressure, torque in (("1 MPa", 100.0), ("5 MPa", 200.0)):
        train = bench_train(pressure)
        assert train.power.on_driven("pair 1") == pytest.approx(torque)
        assert train.power.drive["drive"] == pytest.approx(torque)
    assert train.kinematics.mesh_frequency("pair 1") == pytest.approx(29 * 1000 / 60)
    first = bench_choices()[0]
    assert "157.1 cm^3" in first.chosen
    assert "T_0 = 75 N m" in first.chosen
    changed = bench_choices(BenchSettings(phase=0.5))[-1]
    assert changed.chosen == "phase = 0.5"


def test_the_file_is_the_bench():
    agrees_with_its_file("bench", bench_train())


def test_joints_need_no_inertia_of_the_pump():
    """What a bench in joints has not is not asked about: its housing, its shafts that twist, the pump's own shaft."""
    train = bench_train(settings=BenchSettings(bearings="ideal", pump_inertia=0.0, shafts=0.0))
    assert [shaft.name for shaft in train.shafts] == ["motor", "one", "two", "four"]
    assert not train.housings
    with pytest.raises(ValueError, match=says("shaft 'pump'", "inertia", "0.0", "positive")):
        bench_train(settings=BenchSettings(pump_inertia=0.0))


@pytest.mark.slow
@pytest.mark.parametrize(("motor", "tol"), [("speed", 1e-7), ("induction", 1e-8)])
def test_energy_and_drift_of_the_whole_bench(motor, tol):
    """Everything that stores, works and dissipates: the balance closes to a hundred-thousandth of the work.

    A rotor that is not held at its speed errs in its kinetic energy by what the tolerance leaves of its speed.
    """
    train = bench_train("5 MPa", settings=BenchSettings(motor=motor))
    solution = train.build().simulate(0.1, every_step=True, tol=tol, rate_scale=train.rate_scale)
    assert solution.success
    balance = solution.energy_balance()
    assert balance.relative_imbalance < 1e-5
    assert solution.constraint_violation.max() < 1e-10


@pytest.mark.parametrize(("motor", "words"), [("steam", "motor is 'steam'")])
def test_wrong_settings(motor, words):
    with pytest.raises(ValueError, match=words):
        bench_train(settings=BenchSettings(motor=motor))
    with pytest.raises(ValueError, match="state is 'ill'"):
        bench_train(state="ill")


@pytest.mark.slow
def test_wheels_of_one_shaft_add_or_cancel_as_the_phasors_say():
    """Two stiff meshes on one shaft, driven by their kinematic errors: lines add in phase, cancel in opposition."""
    from tests.studies.phasors import shaft_line

    together, apart, quarter = (shaft_line(phase) for phase in (0.0, 0.5, 0.25))
    single = 0.5 * together
    assert apart < 0.02 * together
    assert quarter == pytest.approx(np.sqrt(2.0) * single, rel=0.02)


@pytest.mark.slow
def test_study_of_the_bench(tmp_path):
    run = RunSettings(settling=0.05, duration=0.2, tolerance=1e-6)
    study = run_bench(run=run, pair=False)
    assert isinstance(study, BenchStudy)
    assert study.table.dims == ("sensor", "load", "state", "harmonic")
    assert np.all(study.table > 0.0)
    assert study.claims("laser")[0].held
    text = study.report()
    assert "| misalignment raises the 2nd GMF harmonic |" in text
    assert "T_0 = 75 N m" in text
    paths = study.save(tmp_path)
    assert all(path.exists() for path in paths)
    assert "verdicts.png" in {path.name for path in paths}
    record = study.records["low", "healthy"]
    np.testing.assert_allclose(
        levels(record, "support"), study.table.sel(sensor="support", load="low", state="healthy")
    )


@pytest.mark.slow
def test_cost_beside_the_pair():
    """Processor time for the same simulated span, interleaved in one run: at most 2.5 times the healthy pair's."""
    import time

    train = bench_train("5 MPa", settings=BenchSettings(bearings="ideal", motor="speed", pump_teeth=0))
    bench, pair = train.build(), gear_rig(train.pairs["pair 1"], speed="1000 rpm", torque="200 N m", run_up=0.02)
    ratios = []
    for _ in range(5):
        spent = []
        for m in (bench, pair):
            start = time.process_time()
            assert m.simulate(0.2, rate=12800, tol=1e-7, rate_scale=train.rate_scale).success
            spent.append(time.process_time() - start)
        ratios.append(spent[0] / spent[1])
    assert np.median(ratios[1:]) < 2.5
