"""A stage between a motor and a pump: kinematics, modes and a short run."""

from pathlib import Path

import gearmbs as gm
from gearmbs.drivetrain import Drivetrain, GearMesh, IdealBearing, Shaft, SpeedDrive, TorqueLoad, Wheel


def main(folder: Path) -> float:
    """Return the mesh frequency, Hz."""
    pinion = gm.GearSpec(21, "3 mm", face_width="25 mm", bore_radius="15 mm")
    wheel = gm.GearSpec(52, "3 mm", face_width="25 mm", bore_radius="20 mm")
    train = Drivetrain(
        "one stage",
        shafts=[
            Shaft(name="input", length="120 mm", diameter="30 mm"),
            Shaft(name="output", length="120 mm", diameter="40 mm"),
        ],
        wheels=[
            Wheel(
                name="z1",
                shaft="input",
                station="60 mm",
                gear=pinion,
            ),
            Wheel(
                name="z2",
                shaft="output",
                station="60 mm",
                gear=wheel,
            ),
        ],
        meshes=[GearMesh(name="mesh", driver="z1", driven="z2", settings={"backlash": "0.1 mm"})],
        bearings=[IdealBearing(name="a", shaft="input"), IdealBearing(name="b", shaft="output")],
        drives=[SpeedDrive(name="motor", shaft="input", speed="1450 rpm")],
        loads=[TorqueLoad(name="load", shaft="output", torque="100 N m")],
        running=True,
    )
    frequency = train.kinematics.mesh_frequency("mesh")
    modes = train.changed("load", torque="50 N m").build().linear_modes()
    (folder / "modes.txt").write_text(str(modes))
    solution = train.build().simulate(0.005, rate=20_000)
    if not solution.success:
        raise RuntimeError(solution.message)
    return frequency
