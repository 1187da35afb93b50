"""The plant of two masses, for a controller."""

from pathlib import Path

import numpy as np

import gearmbs as gm


def main(folder: Path) -> float:
    """Return the largest real part of the plant's poles, 1/s."""
    m = gm.Mechanism("two masses")
    first = m.body("first", mass=1.0, inertia=(0.1, 0.1, 0.1))
    second = m.body("second", mass=2.0, inertia=(0.2, 0.2, 0.2), position=(0, 0, 1))
    for body in (first, second):
        m.revolute(f"pin of {body.name}", body, m.ground, axis=(0, 0, 1))
    m.torsion_spring("spring", first.marker(), second.marker(), stiffness="100 N*m/rad", damping=0.1)
    m.torque("motor", first, m.input("motor", "N m"))
    m.output("speed", ("angular_velocity", "first", "z"))
    plant = m.linearize(["motor"], ["speed"])
    plant.save(folder / "plant.mat")
    response: np.ndarray = plant.frequency_response([1.0, 10.0])
    return float(plant.poles.real.max()) + 0.0 * float(abs(response).max())
