"""A slider crank of bodies, joints, a motion and a spring, with units in texts."""

from pathlib import Path

import numpy as np

import gearmbs as gm
from gearmbs.mechanism import Mechanism


def main(folder: Path) -> float:
    """Return the largest force in the pin of the crank, N."""
    m = Mechanism("slider crank", gravity=(0, 0, -9.81))
    crank = m.body("crank", mass="500 g", inertia=(1e-4, 1e-3, 1e-3), position=(0.05, 0, 0))
    rod = m.body("rod", mass=0.8, inertia=(1e-4, 6e-3, 6e-3), position=(0.25, 0, 0))
    piston = m.body("piston", mass="1 kg", inertia=(1e-3, 1e-3, 1e-3), position=(0.4, 0, 0))
    main_pin = m.revolute("main", crank, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.revolute("crank pin", rod, crank, at=(0.1, 0, 0), axis=(0, 1, 0))
    m.spherical("wrist", piston, rod, at=(0.4, 0, 0))
    m.translational("bore", piston, m.ground, at=(0.4, 0, 0), axis=(1, 0, 0))
    m.friction("dry", main_pin, 0.02, 0.01, pin_radius="10 mm")
    m.rotation("motor", main_pin, "600 rpm", level="velocity")
    m.spring_damper("spring", piston.marker(), m.ground.marker((0.6, 0, 0)), stiffness="2 N/mm", length="200 mm")
    solution = m.simulate("0.1 s", rate="1 kHz", max_step=1e-3, tol=1e-7)
    force, _ = solution.reaction("main")
    path: np.ndarray = solution.com_position("piston")
    gm.save(solution, folder / "crank.nc")
    return float(np.linalg.norm(force, axis=1).max()) + 0.0 * float(path[0, 0])
