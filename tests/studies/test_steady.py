"""Steady motions of cases and drivetrains: their records are those of long simulations."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.dae import NoOrbit
from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    ElasticClutch,
    GearMesh,
    IdealBearing,
    InductionMotor,
    Shaft,
    SpeedDrive,
    TorqueLoad,
    Wheel,
)
from gearmbs.mechanism import ModelError
from gearmbs.studies import Case, CaseError, case_mechanism, run_case
from gearmbs.studies.run.steady import mesh_period
from tests import generators
from tests.says import says
from tests.studies.test_auto import random_case


def deviation(motion, exact):
    """Return the largest difference of mesh harmonics, of levels of 1 % of the largest at least."""
    found, wanted = (record["gmf_rms"].sel(way="orders").values for record in (motion.record, exact))
    return float((np.abs(found - wanted) / np.maximum(wanted, 0.01 * wanted.max(axis=0))).max())


def long(case, seconds=1.0):
    return run_case(
        case.changed(operation={"duration": seconds}, solver={"tolerance": 1e-9, "lump": True}), variables=["gmf_rms"]
    )


@pytest.mark.slow
@pytest.mark.parametrize("fault", [{}, {"misalignment": "1 deg"}, {"centre_distance_error": "3 mm"}, {"teeth": "wear"}])
def test_harmonics_are_those_of_a_long_record(fault):
    case = Case(operation={"speed": "1000 rpm", "torque": 20.0}, fault=fault)
    motion = gm.steady(case, variables=["gmf_rms"])
    assert motion.stable
    assert deviation(motion, long(case, 0.3)) < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("number", range(generators.cases(3)))
def test_random_cases_are_those_of_a_long_record_or_have_none(number):
    case = random_case(number)
    try:
        motion = gm.steady(case, variables=["gmf_rms"])
    except NoOrbit:
        return
    off = deviation(motion, long(case))
    # wheels that leave each other have several motions
    assert off < 1e-2 or "other motions may exist" in motion.record.attrs["record_length"], (case.name, off)


def test_the_record_of_a_steady_motion_is_that_of_a_record_that_repeats_itself():
    case = Case(operation={"speed": "1000 rpm", "duration": "auto"})
    motion, other = gm.steady(case), run_case(case)
    assert set(motion.record) == set(other)
    assert motion.record["gmf_rms"].values == pytest.approx(other["gmf_rms"].values, rel=5e-3)
    # the transmission error is counted from the same teeth, though the run starts with wheels that have turned
    error = motion.record["transmission_error"].values
    assert error.mean() == pytest.approx(float(other["transmission_error"].mean()), rel=1e-3)
    assert motion.record.attrs["record_status"] == "periodic"
    assert motion.record.attrs["orbit_multiplier"] < 1.0


@pytest.mark.slow
def test_forces_without_jumps_are_not_looked_through_before_multipliers_are_asked_for(monkeypatch):
    from gearmbs.dae import orbits

    looked, follow = [], orbits.follow

    def counted(problem, end, starts, longest, jumps, local_error):
        looked.append(jumps)
        return follow(problem, end, starts, longest, jumps, local_error)

    monkeypatch.setattr(orbits, "follow", counted)
    motion = gm.steady(Case(operation={"speed": "3000 rpm", "torque": 20.0}), variables=["gmf_rms"])
    before = len(looked)
    assert before > 0
    assert not any(looked)
    told = motion.record.attrs["orbit_multiplier"]
    assert told == pytest.approx(abs(motion.multipliers[0]), rel=0.02)
    assert looked[before:] == [True]
    # teeth with faults may have corners at which forces jump
    broken = Case(operation={"speed": "1000 rpm", "torque": 20.0}, fault={"teeth": "broken tooth"})
    gm.steady(broken, variables=["gmf_rms"])
    assert looked[before + 1 :].count(True) == 1


@pytest.mark.parametrize("rpm", [650, 700, 1200, 1375, 1600])
def test_whole_records_are_made_at_any_speed(rpm):
    case = Case(operation={"speed": f"{rpm} rpm", "torque": "100 N m"})
    record = gm.steady(case).record
    exact = run_case(case.changed(operation={"duration": "auto"}))
    assert record["acceleration"].std("signal_time").values == pytest.approx(
        exact["acceleration"].std("signal_time").values, rel=1e-2
    )


def test_a_case_and_its_mechanism_have_one_orbit():
    case = Case(operation={"speed": "1000 rpm", "run_up": "10 ms"})
    one = gm.steady(case, variables=["gmf_rms"])
    other = gm.steady(case_mechanism(case), 1.0 / case.mesh_frequency, t_start=0.01)

    def force(solution):
        return solution.contact("mesh")["normal_force"]

    assert np.abs(one.harmonics(force)) == pytest.approx(np.abs(other.harmonics(force)), rel=1e-3)
    assert np.abs(one.multipliers) == pytest.approx(np.abs(other.multipliers), abs=1e-4)


@pytest.mark.slow
def test_a_faulty_tooth_makes_the_period_a_turn_of_its_wheel():
    case = Case(gears={"teeth": (20, 31)}, operation={"speed": "1500 rpm"}, fault={"teeth": "broken tooth"})
    assert gm.steady(case, variables=["gmf_rms"]).period == pytest.approx(0.04)


@pytest.mark.parametrize("operation", [{"speed": [(0, 50.0), (1, 100.0)]}, {"torque": [(0, 50.0), (1, 100.0)]}])
def test_a_case_along_a_curve_has_no_steady_motion(operation):
    with pytest.raises(CaseError, match=says("steady", "constant", "run_case", "curves")):
        gm.steady(Case(operation=operation | {"duration": "1 s"}))


def test_an_integrator_that_does_not_keep_its_steps_is_named_and_others_are_not():
    case = Case(operation={"speed": "1000 rpm"}, solver={"integrator": "IDA"})
    with pytest.raises(CaseError, match=says("steady", "IDA", "WSTIFF")):
        gm.steady(case)
    other = case.changed(solver={"integrator": "GSTIFF", "formulation": "I3"})
    assert gm.steady(other, variables=["gmf_rms"]).stable


def test_a_wheel_without_load_has_no_motion_that_it_goes_to():
    with pytest.raises(NoOrbit, match=says("orbit", "disturbances", "another")):
        gm.steady(Case(operation={"speed": "1000 rpm", "torque": "0.001 N m"}), variables=["gmf_rms"])


def test_what_cannot_be_meant_is_named():
    with pytest.raises(CaseError, match=says("steady", "period", "case", "wheels")):
        gm.steady(Case(), 0.01)
    with pytest.raises(ModelError, match=says("steady", "period", "mechanism", "mesh")):
        gm.steady(gm.Mechanism("nothing"))
    with pytest.raises(ModelError, match=says("steady", "3", "Case", "Drivetrain")):
        gm.steady(3)


def train(drive, bearing=IdealBearing, **settings):
    """Return two wheels on shafts in bearings; a flywheel hangs on the second by a clutch."""
    gears = (gm.GearSpec(20, "3 mm", face_width="20 mm"), gm.GearSpec(30, "3 mm", face_width="20 mm"))
    return Drivetrain(
        "pair with a flywheel",
        shafts=[
            Shaft(name="in", length="0.1 m", diameter="30 mm"),
            Shaft(name="out", length="0.1 m", diameter="30 mm"),
            Shaft(name="flywheel", length="0.1 m", inertia=0.02),
        ],
        wheels=[
            Wheel(name=f"z{k + 1}", shaft=shaft, station="50 mm", gear=gear)
            for k, (shaft, gear) in enumerate(zip(("in", "out"), gears, strict=True))
        ],
        meshes=[GearMesh(name="mesh", driver="z1", driven="z2")],
        couplings=[
            ElasticClutch(
                name="clutch", first="out", second="flywheel", stiffness=2e4, relative_damping=0.5,
                damping_frequency=100.0,
            )
        ],
        bearings=[bearing(name=f"b {shaft}", shaft=shaft, **settings) for shaft in ("in", "out", "flywheel")],
        drives=[drive],
        loads=[TorqueLoad(name="load", shaft="flywheel", torque=60.0)],
        run_up=0.01,
    )  # fmt: skip


@pytest.mark.slow
def test_a_drivetrain_has_the_motion_that_a_long_simulation_comes_to():
    made = train(SpeedDrive(name="drive", shaft="in", speed="1000 rpm"))
    assert mesh_period(made) == pytest.approx(0.003)
    motion = gm.steady(made)
    assert motion.stable
    assert len(motion.multipliers) == 4

    def force(solution):
        return solution.contact("mesh")["normal_force"]

    # what is left of the start decays with the largest multiplier
    periods = int(np.ceil(np.log(1e-4) / np.log(abs(motion.multipliers[0])))) + 10
    begin = 0.01 + 0.003 * periods
    run = made.build().simulate(
        begin + 0.003, t_eval=np.concatenate([[0.0], begin + 0.003 * np.arange(257) / 256]), tol=1e-8,
        rate_scale=made.rate_scale,
    )  # fmt: skip
    there = 2.0 / 256 * np.abs(np.fft.rfft(force(run)[1:257]))[1:4]
    assert np.abs(motion.harmonics(force))[1:] == pytest.approx(there, rel=1e-2)


def test_a_drive_that_prescribes_no_speed_is_named():
    motor = InductionMotor(name="motor", shaft="in", speed="1450 rpm", power="7.5 kW")
    with pytest.raises(DrivetrainError, match=says("drive 'motor'", "prescribe", "speed", "run_train")):
        gm.steady(train(motor))
