"""Many stages in line: they run, and the cost grows about as their number."""

import time

import numpy as np
import pytest

from gearmbs.drivetrain import Drivetrain, GearMesh, IdealBearing, Shaft, SpeedDrive, TorqueLoad, Wheel
from gearmbs.gears import GearSpec


def stages_in_line(count):
    """Return equal stages one after the other, each mesh a face further along."""
    wheels, meshes = [], []
    for k in range(count):
        for shaft, side in ((k, "a"), (k + 1, "b")):
            gear = GearSpec(29, 95e-3 / 31, face_width=0.02, name=f"{side}{k}")
            wheels.append(Wheel(name=f"{side}{k}", shaft=f"s{shaft}", station=0.05 + 0.1 * k, gear=gear))
        meshes.append(GearMesh(name=f"m{k}", driver=f"a{k}", driven=f"b{k}", settings={"backlash": "0.1 mm"}))
    return Drivetrain(
        f"{count} stages",
        shafts=[Shaft(name=f"s{k}", length=0.1 * (count + 1)) for k in range(count + 1)],
        wheels=wheels,
        meshes=meshes,
        bearings=[IdealBearing(name=f"of {k}", shaft=f"s{k}", station=0.02) for k in range(count + 1)],
        drives=[SpeedDrive(name="drive", shaft="s0", speed="1000 rpm")],
        loads=[TorqueLoad(name="load", shaft=f"s{count}", torque=100.0)],
        running=True,
        run_up=0.02,
    )


def test_ten_stages_run():
    train = stages_in_line(10)
    assert train.speeds["s10"] == pytest.approx(1000 * np.pi / 30)
    solution = train.build().simulate(0.01, rate=1000, tol=1e-6, rate_scale=train.rate_scale)
    assert solution.success
    for k in range(10):
        assert solution.contact(f"m{k}")["pairs_drive"][-1] > 0


@pytest.mark.slow
def test_cost_grows_about_linearly():
    spent = []
    for count in (1, 2, 5, 10):
        train = stages_in_line(count)
        m = train.build()
        best = np.inf
        for _ in range(3):
            start = time.process_time()
            assert m.simulate(0.05, rate=1000, tol=1e-7, rate_scale=train.rate_scale).success
            best = min(best, time.process_time() - start)
        spent.append(best)
    exponent = np.polyfit(np.log([1, 2, 5, 10]), np.log(spent), 1)[0]
    assert exponent < 1.15
