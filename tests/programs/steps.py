"""A simulation that is stepped, held as a state, and gone on with."""

from pathlib import Path

import gearmbs as gm


def main(folder: Path) -> float:
    """Return the angle of a pendulum under a torque that is switched on halfway, rad."""
    m = gm.Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = m.body("rod", mass=1.0, inertia=(0.01, 0.02, 0.02), position=(0.5, 0, 0))
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.torque("motor", rod, m.input("motor", "N m"), axis=(0, 1, 0))
    sim = gm.Simulator(m, t_end=0.4, records=True)
    sim.advance(0.2)
    state = sim.state()
    state.save(folder / "halfway.npz")
    sim.set("motor", 2.0)
    sim.advance(0.4)
    driven = sim.get("joint_angle", "pin")
    sim.restore(gm.State.load(folder / "halfway.npz"))
    sim.advance(0.4)
    return driven - sim.get("joint_angle", "pin")
