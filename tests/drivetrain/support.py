"""What tests of drivetrains share: evaluated kernels, differences, and small trains."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.loads.forces import DERIVATIVES, DIAGNOSTICS
from gearmbs.drivetrain import Drivetrain, GearMesh, IdealBearing, Shaft, SpeedDrive, TorqueLoad, Wheel
from gearmbs.gears import GearSpec
from gearmbs.kernels.pointers import address
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.forces.functions import vary


def rotation(vector):
    """Return the rotation by a vector, by the exponential of its cross product."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(vector).as_matrix()


def frame(position, axes, velocity, spin):
    """Return a row of frames."""
    return np.concatenate([position, np.asarray(axes).ravel(), velocity, spin])


def evaluate(element, frames, states=(), inputs=(), t=0.0, want=DERIVATIVES | DIAGNOSTICS):
    """Return wrench, rates, derivatives and diagnostics of a force element at given frames."""
    made = element.compiled()
    ints = np.array([*(address(f, s) for f, s in made.functions), *made.integers], dtype=np.int64)
    n = len(states)
    wrench, rates, jac = np.zeros((1, 6)), np.zeros(n), np.zeros((6 + n, 24 + n))
    told, work = np.zeros(len(element.diagnostics)), np.zeros(max(1, made.scratch))
    reals, z, u = (np.array(a, dtype=float) for a in (made.reals, states, inputs))
    made.kernel(ints, reals, t, np.ascontiguousarray(frames), z, u, want, work, wrench, rates, jac, told)
    return wrench[0], rates, jac, told


def differences(element, frames, states, inputs, step=1e-6):
    """Return the derivatives of wrench and rates by central differences."""
    n = len(states)
    out = np.zeros((6 + n, 24 + n))
    for column in range(24 + n):
        sides = []
        for sign in (1.0, -1.0):
            moved, z = np.array(frames, dtype=float), np.array(states, dtype=float)
            if column < 24:
                fresh = np.zeros_like(moved)
                vary(np.ascontiguousarray(moved), fresh, column // 12, column % 12, sign * step)
                moved = fresh
            else:
                z[column - 24] += sign * step
            wrench, rates, _, _ = evaluate(element, moved, z, inputs)
            sides.append(np.concatenate([wrench, rates]))
        out[:, column] = (sides[0] - sides[1]) / (2.0 * step)
    return out


def rotor(inertia=0.05):
    """Return a mechanism with one rotor on a revolute joint, and the joint."""
    m = Mechanism("rotor")
    body = m.body("rotor", mass=1.0, inertia=(inertia, inertia, inertia))
    return m, m.revolute("pin", body, m.ground, at=(0, 0, 0), axis=(0, 0, 1))


def stage(**changes):
    """Return a train of one pair, 20/60 teeth at 1500 rpm and 300 N m."""
    given = {
        "shafts": [Shaft(name="in", length=0.1), Shaft(name="out", length=0.1)],
        "wheels": [
            Wheel(name="pinion", shaft="in", gear=GearSpec(20, "3 mm", name="pinion")),
            Wheel(name="gear", shaft="out", gear=GearSpec(60, "3 mm", name="gear")),
        ],
        "meshes": [GearMesh(name="mesh", driver="pinion", driven="gear", settings={"backlash": "0.1 mm"})],
        "bearings": [IdealBearing(name="a", shaft="in"), IdealBearing(name="b", shaft="out")],
        "drives": [SpeedDrive(name="motor", shaft="in", speed="1500 rpm")],
        "loads": [TorqueLoad(name="brake", shaft="out", torque="300 N m")],
    }
    return Drivetrain("one stage", **{**given, **changes})


def chain_frequencies(inertias, springs):
    """Return natural frequencies (Hz) of a chain: springs are (i, j, lever of i, lever of j, stiffness)."""
    import scipy.linalg

    k = np.zeros((len(inertias), len(inertias)))
    for i, j, a, b, stiffness in springs:
        k[i, i] += stiffness * a * a
        k[j, j] += stiffness * b * b
        k[i, j] += stiffness * a * b
        k[j, i] += stiffness * a * b
    squares = scipy.linalg.eigh(k, np.diag(inertias), eigvals_only=True)
    return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
