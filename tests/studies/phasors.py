"""Two wheels of one shaft, each in mesh: the line of the mesh frequency in the torque on their shaft."""

import numpy as np

from gearmbs.drivetrain import Drivetrain, GearMesh, IdealBearing, Shaft, SpeedDrive, TorqueLoad, Wheel
from gearmbs.gears import GearSpec


def shaft_line(phase):
    """Return the first mesh harmonic of the sum of the normal forces of two meshes, one ``phase`` pitches later.

    Both wheels of the middle shaft push a wheel of their own, whose load is large against its inertia.
    """
    gear = lambda name: GearSpec(29, 95e-3 / 31, face_width=0.020, name=name)  # noqa: E731
    settings = {"backlash": "0.1 mm", "friction": False}
    speed = 2.0 * np.pi * 2.0
    train = Drivetrain(
        "two wheels on one shaft",
        shafts=[Shaft(name="middle", length=0.3), Shaft(name="left", length=0.1), Shaft(name="right", length=0.1)],
        wheels=[
            Wheel(name="a", shaft="middle", gear=gear("a"), station=0.05),
            Wheel(name="b", shaft="middle", gear=gear("b"), station=0.25),
            Wheel(name="c", shaft="left", gear=gear("c")),
            Wheel(name="d", shaft="right", gear=gear("d")),
        ],
        meshes=[
            GearMesh(name="one", driver="a", driven="c", phase=0.0, settings=settings),
            GearMesh(name="two", driver="b", driven="d", phase=phase, settings=settings),
        ],
        bearings=[IdealBearing(name=f"of {n}", shaft=n) for n in ("middle", "left", "right")],
        drives=[SpeedDrive(name="drive", shaft="middle", speed=speed)],
        loads=[TorqueLoad(name=f"load {n}", shaft=n, torque=50.0) for n in ("left", "right")],
        running=True,
        run_up=0.02,
    )
    rate = 40 * 29 * 2.0
    solution = train.build().simulate(0.5, rate=rate, tol=1e-7, rate_scale=train.rate_scale)
    # driven shafts feel the tooth errors as speeds: slow, so that the error is followed
    error = sum(solution.joint_angle(f"of {n}") for n in ("left", "right"))
    keep = solution.t >= 0.1 - 1e-9
    t, x = solution.t[keep], error[keep]
    whole = int(np.floor((t[-1] - t[0]) * 58.0) * 40)
    t, x = t[:whole], x[:whole]
    x = x - np.polyval(np.polyfit(t, x, 1), t)
    return 2.0 * abs(np.mean(x * np.exp(-2j * np.pi * 58.0 * t)))
